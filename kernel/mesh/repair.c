/* Repair of triangle meshes: what can be mended on the way to an oriented manifold.
 *
 * In this order: vertices are welded; triangles without area give way; duplicates go; what is left must have at most
 * two triangles at an edge; fans that hang together in a vertex alone get vertices of their own; triangles are
 * turned, part by part, from the first triangle of each outwards; vertices without triangles go.
 *
 * A triangle whose corners lie on one line has a vertex in the middle of its longest side. Taking the triangle away
 * would open a slit there, so the side is swapped instead: with d beyond a c, the triangles a b c and c a d become
 * a b d and b c d.
 *
 *          b                 b
 *      a---.---c   -->   a---.---c
 *        \   /             \ | /
 *          d                 d                                                                                   */
#include "mesh_inner.h"

#include "base/checked.h"
#include "sets.h"
#include "vec.h"

#include <string.h>

/* Each round swaps what it can without one swap meeting another; further rounds go on into fans of such triangles. */
enum { SWAP_ROUNDS_MAX = 64 };

typedef struct repair {
  const batten_mesh *mesh;
  size_t triangles;     /* those that are left */
  uint32_t *corners;    /* [F][3] vertices of the mesh, later of the result */
  uint32_t *origin;     /* [F] triangle of the mesh that it was */
  unsigned char *marks; /* [F] */
  uint32_t *first;      /* [F] scratch of the marks; queue of the flood */
  uint32_t *order;      /* [3 F] half-edges by edge */
  uint32_t *other;      /* [3 F] half-edge of the other triangle at the same edge, MESH_NONE without one */
  uint32_t *fan;        /* [3 F] disjoint sets of corners */
  uint32_t *kept;       /* [V] what vertices were welded to, later their numbers in the result */
  uint32_t *source;     /* [3 F] vertex of the mesh for each of the result */
  unsigned char *used;  /* [V] */
  size_t vertices;      /* of the result */
  batten_mesh_repair_info info;
} repair;

static const double *corner_place(const repair *r, uint32_t h) {
  return r->mesh->vertices + 3 * (size_t)r->corners[h];
}

/* ---- vertices and triangles that go ------------------------------------------------------------- */

static void mark_used(repair *r) {
  memset(r->used, 0, r->mesh->vertex_count);
  for (size_t h = 0; h < 3 * r->triangles; h++) r->used[r->corners[h]] = 1;
}

static batten_status weld(batten_context *ctx, repair *r, double radius) {
  if (radius < 0) return BATTEN_OK;
  mark_used(r);
  batten_status st = batten_mesh_find_welds(ctx, r->mesh->vertex_count, r->mesh->vertices, r->used, radius, r->kept);
  if (st < 0) return st;
  for (size_t v = 0; v < r->mesh->vertex_count; v++) r->info.welded_vertices += r->kept[v] != v;
  for (size_t h = 0; h < 3 * r->triangles; h++) r->corners[h] = r->kept[r->corners[h]];
  return BATTEN_OK;
}

static batten_status mark(batten_context *ctx, repair *r) {
  return batten_mesh_mark_triangles(ctx, r->mesh->vertex_count, r->mesh->vertices, r->triangles, r->corners, r->marks,
                                    r->first);
}

/* Triangles of which marks allow it stay. */
static void drop_triangles(repair *r, unsigned allowed) {
  size_t left = 0;
  for (size_t t = 0; t < r->triangles; t++) {
    if (!(1u << r->marks[t] & allowed)) continue;
    memmove(r->corners + 3 * left, r->corners + 3 * t, 3 * sizeof *r->corners);
    r->origin[left] = r->origin[t];
    r->marks[left++] = r->marks[t];
  }
  r->info.removed_triangles += r->triangles - left;
  r->triangles = left;
}

/* ---- edges -------------------------------------------------------------------------------------- */

/* Pairs half-edges; *crowded is one of an edge with three triangles or more, or MESH_NONE. */
static batten_status pair_edges(batten_context *ctx, repair *r, const uint32_t **crowded) {
  size_t half_edges = 3 * r->triangles;
  batten_status st = batten_mesh_sort_edges(ctx, r->mesh->vertex_count, r->triangles, r->corners, r->order);
  if (st < 0) return st;
  *crowded = NULL;
  for (size_t i = 0, n; i < half_edges; i += n) {
    const uint32_t *run = r->order + i;
    for (n = 0; i + n < half_edges && mesh_is_same_edge(r->corners, run[0], run[n]); n++)
      r->other[run[n]] = MESH_NONE;
    if (n == 2) {
      r->other[run[0]] = run[1];
      r->other[run[1]] = run[0];
    }
    if (n > 2 && !*crowded) *crowded = run;
  }
  return BATTEN_OK;
}

static batten_status fail_crowded(batten_context *ctx, const repair *r, const uint32_t *run) {
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "mesh: triangles %lu, %lu and %lu, or more, share the edge from vertex %lu to vertex %lu; leave "
                     "two of them%s",
                     (unsigned long)r->origin[run[0] / 3], (unsigned long)r->origin[run[1] / 3],
                     (unsigned long)r->origin[run[2] / 3], (unsigned long)r->corners[run[0]],
                     (unsigned long)r->corners[mesh_next(run[0])],
                     r->info.welded_vertices ? ", or do not weld (opt.weld_radius)" : "");
}

/* ---- triangles whose corners lie on one line ---------------------------------------------------- */

static uint32_t longest_side(const repair *r, uint32_t t, double unit) {
  uint32_t best = 3 * t;
  double longest = -1;
  for (uint32_t h = 3 * t; h < 3 * t + 3; h++) {
    double side[3];
    for (int k = 0; k < 3; k++) side[k] = unit * corner_place(r, mesh_next(h))[k] - unit * corner_place(r, h)[k];
    double length = vec_norm(side);
    if (length > longest) {
      longest = length;
      best = h;
    }
  }
  return best;
}

static uint32_t end_of(const uint32_t *corners, uint32_t h, int high) {
  uint32_t a = corners[h], b = corners[mesh_next(h)];
  return (a > b) == high ? a : b;
}

/* By bisection of the sorted half-edges; sides that were swapped away since count as well. */
static int has_edge(const uint32_t *sorted_low, const uint32_t *sorted_high, size_t count, uint32_t a, uint32_t b) {
  uint32_t low = a < b ? a : b, high = a < b ? b : a;
  size_t from = 0, to = count;
  while (from < to) {
    size_t middle = from + (to - from) / 2;
    if (sorted_low[middle] < low || (sorted_low[middle] == low && sorted_high[middle] < high))
      from = middle + 1;
    else
      to = middle;
  }
  return from < count && sorted_low[from] == low && sorted_high[from] == high;
}

/* Swaps the longest side of straight triangle t, when the triangle beyond is of some use. touched [V]: vertices whose
 * edges changed in this round. */
static int swap_side(repair *r, uint32_t t, double unit, const uint32_t *low, const uint32_t *high, size_t edges) {
  uint32_t h = longest_side(r, t, unit), g = r->other[h];
  if (g == MESH_NONE || r->marks[g / 3] != MESH_GOOD) return 0;
  uint32_t b = r->corners[mesh_previous(h)], d = r->corners[mesh_previous(g)];
  uint32_t from = r->corners[g], to = r->corners[mesh_next(g)];
  if (r->used[b] || r->used[d] || r->used[from] || r->used[to] || has_edge(low, high, edges, b, d)) return 0;
  r->used[b] = r->used[d] = r->used[from] = r->used[to] = 1;
  const uint32_t halves[6] = {from, b, d, b, to, d};
  memcpy(r->corners + 3 * (size_t)t, halves, 3 * sizeof *halves);
  memcpy(r->corners + 3 * (size_t)(g / 3), halves + 3, 3 * sizeof *halves);
  return 1;
}

static batten_status swap_round(batten_context *ctx, repair *r, size_t *swapped) {
  const uint32_t *crowded;
  *swapped = 0;
  batten_status st = pair_edges(ctx, r, &crowded);
  if (st < 0) return st;
  size_t half_edges = 3 * r->triangles;
  double unit = batten_mesh_rounding(r->mesh->vertex_count, r->mesh->vertices).unit;
  uint32_t *low = batten_alloc_array(ctx, half_edges, 2 * sizeof *low);
  if (!low) return BATTEN_E_NOMEM;
  uint32_t *high = low + half_edges;
  for (size_t i = 0; i < half_edges; i++) {
    low[i] = end_of(r->corners, r->order[i], 0);
    high[i] = end_of(r->corners, r->order[i], 1);
  }
  memset(r->used, 0, r->mesh->vertex_count);
  for (uint32_t t = 0; t < r->triangles; t++)
    if (r->marks[t] == MESH_STRAIGHT) *swapped += (size_t)swap_side(r, t, unit, low, high, half_edges);
  batten_free(ctx, low);
  r->info.swapped_edges += *swapped;
  return BATTEN_OK;
}

static size_t count_straight(const repair *r) {
  size_t count = 0;
  for (size_t t = 0; t < r->triangles; t++) count += r->marks[t] == MESH_STRAIGHT;
  return count;
}

/* Leaves good triangles only. */
static batten_status clear_triangles(batten_context *ctx, repair *r) {
  batten_status st = mark(ctx, r);
  if (st < 0) return st;
  drop_triangles(r, 1u << MESH_GOOD | 1u << MESH_STRAIGHT);
  for (int round = 0; round < SWAP_ROUNDS_MAX && count_straight(r); round++) {
    size_t swapped;
    st = swap_round(ctx, r, &swapped);
    if (st == BATTEN_OK) st = mark(ctx, r);
    if (st < 0) return st;
    if (!swapped) break;
  }
  drop_triangles(r, 1u << MESH_GOOD);
  return BATTEN_OK;
}

/* ---- numbers of the result ---------------------------------------------------------------------- */

static void find_fans(repair *r) {
  sets_start(3 * r->triangles, r->fan);
  for (uint32_t h = 0; h < 3 * r->triangles; h++) {
    uint32_t g = r->other[h];
    if (g == MESH_NONE || g < h) continue;
    int along = r->corners[g] == r->corners[h];
    sets_join(r->fan, h, along ? g : mesh_next(g));
    sets_join(r->fan, mesh_next(h), along ? mesh_next(g) : g);
  }
}

/* Corners get the numbers of the result: vertices in their order, then the further fans of split ones in the order of
 * their first corners. */
static void number_vertices(repair *r, int split) {
  mark_used(r);
  uint32_t count = 0;
  for (size_t v = 0; v < r->mesh->vertex_count; v++) {
    int welded = r->kept[v] != v; /* gone, and counted */
    r->info.removed_vertices += !r->used[v] && !welded;
    if (!r->used[v]) continue;
    r->source[count] = (uint32_t)v;
    r->kept[v] = count++;
  }
  /* Roots are the first of their fans: they have their number when the other corners ask for it. used: the vertex has
   * no fan yet. order is free by now. */
  for (uint32_t h = 0; h < 3 * r->triangles; h++) {
    uint32_t v = r->corners[h], root = sets_find(r->fan, h);
    if (root == h) {
      r->order[h] = r->kept[v];
      if (split && !r->used[v]) {
        r->source[count] = v;
        r->order[h] = count++;
        r->info.split_vertices++;
      }
      r->used[v] = 0;
    }
  }
  for (uint32_t h = 0; h < 3 * r->triangles; h++) r->corners[h] = r->order[sets_find(r->fan, h)];
  r->vertices = count;
}

/* ---- orientation -------------------------------------------------------------------------------- */

enum { UNSEEN = 0, AS_IT_IS, TURNED };

static const double *result_place(const repair *r, uint32_t h) {
  return r->mesh->vertices + 3 * (size_t)r->source[r->corners[h]];
}

/* 6 times the volume of triangle t with the point `from`, in units. */
static double cone(const repair *r, uint32_t t, const double *from, double unit) {
  double p[3][3], n[3];
  for (uint32_t i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) p[i][k] = unit * result_place(r, 3 * t + i)[k] - unit * from[k];
  vec_cross(p[1], p[2], n);
  return vec_dot(p[0], n);
}

static batten_status fail_one_sided(batten_context *ctx, const repair *r, uint32_t h) {
  uint32_t a = r->source[r->corners[h]], b = r->source[r->corners[mesh_next(h)]];
  return batten_fail(
      ctx, BATTEN_E_INVALID,
      "mesh: its part with triangle %lu has one side only, as a Moebius strip: at the edge from vertex "
      "%lu to vertex %lu triangles %lu and %lu cannot agree; cut it open there",
      (unsigned long)r->origin[r->first[0]], (unsigned long)a, (unsigned long)b, (unsigned long)r->origin[h / 3],
      (unsigned long)r->origin[r->other[h] / 3]);
}

/* The part of triangle `start`; its triangles come to r->first, *count. marks are the states from here on. */
static batten_status flood(batten_context *ctx, repair *r, uint32_t start, size_t *count, int *closed) {
  uint32_t *queue = r->first;
  size_t known = 0;
  *closed = 1;
  r->marks[start] = AS_IT_IS;
  queue[known++] = start;
  for (size_t at = 0; at < known; at++)
    for (uint32_t h = 3 * queue[at]; h < 3 * queue[at] + 3; h++) {
      uint32_t g = r->other[h];
      if (g == MESH_NONE) {
        *closed = 0;
        continue;
      }
      int agree = r->corners[g] != r->corners[h];
      unsigned char state = (r->marks[h / 3] == AS_IT_IS) == agree ? AS_IT_IS : TURNED;
      if (r->marks[g / 3] == UNSEEN) {
        r->marks[g / 3] = state;
        queue[known++] = g / 3;
      } else if (r->marks[g / 3] != state) {
        return fail_one_sided(ctx, r, h);
      }
    }
  *count = known;
  return BATTEN_OK;
}

/* Closed parts get a positive volume; of others as few triangles as possible are turned. */
static void settle_part(repair *r, size_t count, int closed, double unit) {
  double volume = 0;
  size_t turned = 0;
  for (size_t i = 0; i < count; i++) {
    uint32_t t = r->first[i];
    double part = cone(r, t, result_place(r, 3 * r->first[0]), unit);
    volume += r->marks[t] == TURNED ? -part : part;
    turned += r->marks[t] == TURNED;
  }
  if (closed && volume != 0 ? volume > 0 : 2 * turned <= count) return;
  for (size_t i = 0; i < count; i++) {
    unsigned char *state = r->marks + r->first[i];
    *state = *state == TURNED ? AS_IT_IS : TURNED;
  }
}

static batten_status orient(batten_context *ctx, repair *r) {
  double unit = batten_mesh_rounding(r->mesh->vertex_count, r->mesh->vertices).unit;
  memset(r->marks, UNSEEN, r->triangles);
  for (uint32_t t = 0; t < r->triangles; t++) {
    size_t count = 0;
    int closed = 0;
    if (r->marks[t] != UNSEEN) continue;
    batten_status st = flood(ctx, r, t, &count, &closed);
    if (st < 0) return st;
    settle_part(r, count, closed, unit);
  }
  for (size_t t = 0; t < r->triangles; t++) {
    uint32_t *v = r->corners + 3 * t, corner = v[1];
    if (r->marks[t] != TURNED) continue;
    v[1] = v[2];
    v[2] = corner;
    r->info.turned_triangles++;
  }
  return BATTEN_OK;
}

/* ---- the result --------------------------------------------------------------------------------- */

static batten_status make_mesh(batten_context *ctx, const repair *r, batten_mesh **out) {
  const batten_mesh *mesh = r->mesh;
  size_t widest = 3;
  for (size_t i = 0; i < mesh->field_count; i++)
    if (mesh->fields[i].components > widest) widest = mesh->fields[i].components;
  batten_mesh *made = NULL;
  double *values = batten_alloc_array(ctx, r->vertices, widest * sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  for (size_t v = 0; v < r->vertices; v++)
    memcpy(values + 3 * v, mesh->vertices + 3 * (size_t)r->source[v], 3 * sizeof *values);
  batten_status st = batten_mesh_create(ctx, r->vertices, values, r->triangles, r->corners, &made);
  for (size_t i = 0; i < mesh->field_count && st == BATTEN_OK; i++) {
    const mesh_field *field = mesh->fields + i;
    size_t n = field->components;
    for (size_t v = 0; v < r->vertices; v++)
      memcpy(values + n * v, field->values + n * r->source[v], n * sizeof *values);
    st = batten_mesh_set_field(ctx, made, field->name, n, values);
  }
  batten_free(ctx, values);
  if (st == BATTEN_OK)
    *out = made;
  else
    batten_mesh_free(made);
  return st;
}

static batten_status mend(batten_context *ctx, repair *r, const batten_mesh_repair_options *opt) {
  const uint32_t *crowded;
  batten_status st = weld(ctx, r, opt->weld_radius);
  if (st == BATTEN_OK) st = clear_triangles(ctx, r);
  if (st == BATTEN_OK) st = pair_edges(ctx, r, &crowded);
  if (st < 0) return st;
  if (crowded) return fail_crowded(ctx, r, crowded);
  find_fans(r);
  number_vertices(r, opt->split);
  return opt->orient ? orient(ctx, r) : BATTEN_OK;
}

static batten_status check(batten_context *ctx, const batten_mesh *mesh, const batten_mesh_repair_options *opt,
                           batten_mesh **out) {
  if (!mesh || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a mesh and the address of the result",
                       mesh ? "out" : "mesh");
  batten_status st = batten_check_struct(ctx, "batten_mesh_repair_options", opt->struct_size, sizeof *opt);
  if (st < 0) return st;
  if (!isfinite(opt->weld_radius))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.weld_radius: %g; give a length, or a negative one not to weld",
                       opt->weld_radius);
  return BATTEN_OK;
}

batten_mesh_repair_options batten_mesh_repair_options_default(void) {
  return (batten_mesh_repair_options){.struct_size = sizeof(batten_mesh_repair_options), .orient = 1, .split = 1};
}

batten_status batten_mesh_repair(batten_context *ctx, const batten_mesh *mesh, const batten_mesh_repair_options *opt,
                                 batten_mesh **out, batten_mesh_repair_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_mesh_repair_options defaults = batten_mesh_repair_options_default();
  if (!opt) opt = &defaults;
  batten_status st = check(ctx, mesh, opt, out);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  size_t faces = mesh->triangle_count, half_edges = 3 * faces, vertices = mesh->vertex_count;
  repair r = {.mesh = mesh, .triangles = faces};
  if (!(r.corners = batten_alloc_array(ctx, half_edges, sizeof *r.corners)) ||
      !(r.origin = batten_alloc_array(ctx, faces, sizeof *r.origin)) ||
      !(r.marks = batten_alloc_array(ctx, faces, sizeof *r.marks)) ||
      !(r.first = batten_alloc_array(ctx, faces, sizeof *r.first)) ||
      !(r.order = batten_alloc_array(ctx, half_edges, sizeof *r.order)) ||
      !(r.other = batten_alloc_array(ctx, half_edges, sizeof *r.other)) ||
      !(r.fan = batten_alloc_array(ctx, half_edges, sizeof *r.fan)) ||
      !(r.kept = batten_alloc_array(ctx, vertices, sizeof *r.kept)) ||
      !(r.source = batten_alloc_array(ctx, half_edges, sizeof *r.source)) ||
      !(r.used = batten_alloc_array(ctx, vertices, sizeof *r.used)))
    goto done;
  if (faces) memcpy(r.corners, mesh->triangles, half_edges * sizeof *r.corners);
  for (uint32_t t = 0; t < faces; t++) r.origin[t] = t;
  for (uint32_t v = 0; v < vertices; v++) r.kept[v] = v;
  st = mend(ctx, &r, opt);
  if (st == BATTEN_OK) st = make_mesh(ctx, &r, out);
  if (st == BATTEN_OK && info) *info = r.info;
done:
  batten_free(ctx, r.used);
  batten_free(ctx, r.source);
  batten_free(ctx, r.kept);
  batten_free(ctx, r.fan);
  batten_free(ctx, r.other);
  batten_free(ctx, r.order);
  batten_free(ctx, r.first);
  batten_free(ctx, r.marks);
  batten_free(ctx, r.origin);
  batten_free(ctx, r.corners);
  return st;
}
