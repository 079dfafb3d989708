/* What stands between a triangle mesh and an oriented manifold: counted, and the first of each kind named.
 *
 * Places are compared by a hash grid, corners and edges by counting sorts, fans are disjoint sets of corners that are
 * joined through the edges at their vertex. Triangles with a repeated corner and duplicates of triangles take no part
 * in the edges and fans: those defects go away with them. */
#include "mesh_inner.h"

#include "base/checked.h"
#include "sets.h"
#include "vec.h"

#include <float.h>
#include <string.h>

/* ---- places ------------------------------------------------------------------------------------- */

double batten_mesh_size(size_t vertex_count, const double *vertices) {
  double size = 0;
  for (size_t i = 0; i < 3 * vertex_count; i++) size = fmax(size, fabs(vertices[i]));
  return size;
}

/* Kept vertices by the cell of a grid: chains of vertices in a hash table, the cell's coordinates whole numbers held
 * in doubles, or for radius 0 the place itself. */
typedef struct grid {
  const double *vertices;
  double radius, cell;
  uint32_t *head; /* [mask + 1] */
  uint32_t *next; /* [V] */
  size_t mask;
} grid;

static void cell_of(const grid *g, const double *p, double *cell) {
  for (int k = 0; k < 3; k++) cell[k] = g->radius > 0 ? floor(p[k] / g->cell) : p[k] + 0.0; /* -0 becomes 0 */
}

static size_t slot_of(const grid *g, const double *cell) {
  uint64_t hash = 0;
  for (int k = 0; k < 3; k++) {
    uint64_t bits;
    memcpy(&bits, cell + k, sizeof bits);
    hash = (hash ^ bits) * 0x9e3779b97f4a7c15u; /* multiplicative hashing; the shift brings high bits down */
    hash ^= hash >> 29;
  }
  return (size_t)(hash ^ (hash >> 32)) & g->mask;
}

static int is_near(const grid *g, const double *p, const double *q) {
  return (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) || vec_distance(p, q) < g->radius;
}

/* The first kept vertex near v, or MESH_NONE. */
static uint32_t find_kept(const grid *g, uint32_t v) {
  const double *p = g->vertices + 3 * (size_t)v;
  double cell[3];
  cell_of(g, p, cell);
  uint32_t found = MESH_NONE;
  int reach = g->radius > 0 ? 1 : 0;
  for (int i = -reach; i <= reach; i++)
    for (int j = -reach; j <= reach; j++)
      for (int k = -reach; k <= reach; k++) {
        double other[3] = {cell[0] + i, cell[1] + j, cell[2] + k};
        for (int d = 0; d < 3; d++) other[d] += 0.0;
        for (uint32_t q = g->head[slot_of(g, other)]; q != MESH_NONE; q = g->next[q])
          if (q < found && is_near(g, p, g->vertices + 3 * (size_t)q)) found = q;
      }
  return found;
}

batten_status batten_mesh_find_welds(batten_context *ctx, size_t vertex_count, const double *vertices,
                                     const unsigned char *used, double radius, uint32_t *kept) {
  batten_status st = BATTEN_E_NOMEM;
  grid g = {.vertices = vertices, .radius = radius, .mask = 1};
  while (g.mask < 2 * vertex_count) g.mask *= 2;
  g.mask--;
  /* Cells far below the coordinates' rounding, which would overflow, tell no vertices apart; larger ones find the
   * same. */
  g.cell = fmax(radius, 0x1p-50 * batten_mesh_size(vertex_count, vertices));
  g.next = batten_alloc_array(ctx, vertex_count, sizeof *g.next);
  g.head = g.next ? batten_alloc_array(ctx, g.mask + 1, sizeof *g.head) : NULL;
  if (!g.head) goto done;
  for (size_t i = 0; i <= g.mask; i++) g.head[i] = MESH_NONE;
  for (uint32_t v = 0; v < vertex_count; v++) {
    kept[v] = v;
    if (used && !used[v]) continue;
    uint32_t other = find_kept(&g, v);
    if (other != MESH_NONE) {
      kept[v] = other;
      continue;
    }
    double cell[3];
    cell_of(&g, vertices + 3 * (size_t)v, cell);
    size_t slot = slot_of(&g, cell);
    g.next[v] = g.head[slot];
    g.head[slot] = v;
  }
  st = BATTEN_OK;
done:
  batten_free(ctx, g.head);
  batten_free(ctx, g.next);
  return st;
}

/* ---- triangles ---------------------------------------------------------------------------------- */

mesh_rounding batten_mesh_rounding(size_t vertex_count, const double *vertices) {
  double size = batten_mesh_size(vertex_count, vertices), unit = size > 0 ? batten_unit(size) : 1;
  return (mesh_rounding){unit, 4 * DBL_EPSILON * unit * size};
}

int batten_mesh_is_degenerate(mesh_rounding rounding, const double *a, const double *b, const double *c) {
  double unit = rounding.unit, sides[3][3], n[3], longest = 0;
  for (int k = 0; k < 3; k++) {
    double x = unit * a[k], y = unit * b[k], z = unit * c[k];
    sides[0][k] = y - x;
    sides[1][k] = z - y;
    sides[2][k] = x - z;
  }
  for (int k = 0; k < 3; k++) longest = fmax(longest, vec_dot(sides[k], sides[k]));
  vec_cross(sides[0], sides[1], n);
  return !(vec_dot(n, n) > rounding.height * rounding.height * longest);
}

static uint32_t low_corner(const uint32_t *triangles, uint32_t t) {
  const uint32_t *v = triangles + 3 * (size_t)t;
  uint32_t low = v[0] < v[1] ? v[0] : v[1];
  return low < v[2] ? low : v[2];
}
static uint32_t high_corner(const uint32_t *triangles, uint32_t t) {
  const uint32_t *v = triangles + 3 * (size_t)t;
  uint32_t high = v[0] > v[1] ? v[0] : v[1];
  return high > v[2] ? high : v[2];
}
static uint32_t middle_corner(const uint32_t *triangles, uint32_t t) {
  const uint32_t *v = triangles + 3 * (size_t)t;
  return v[0] ^ v[1] ^ v[2] ^ low_corner(triangles, t) ^ high_corner(triangles, t);
}

static int has_same_corners(const uint32_t *triangles, uint32_t s, uint32_t t) {
  return low_corner(triangles, s) == low_corner(triangles, t) &&
         middle_corner(triangles, s) == middle_corner(triangles, t) &&
         high_corner(triangles, s) == high_corner(triangles, t);
}

/* scratch [2][F], start [V + 1]. */
static void mark_duplicates(size_t vertex_count, size_t triangle_count, const uint32_t *triangles, uint32_t *scratch,
                            uint32_t *start, unsigned char *marks, uint32_t *first) {
  uint32_t *order = scratch, *other = scratch + triangle_count;
  batten_mesh_counting_sort(vertex_count, triangle_count, triangles, high_corner, NULL, start, order);
  batten_mesh_counting_sort(vertex_count, triangle_count, triangles, middle_corner, order, start, other);
  batten_mesh_counting_sort(vertex_count, triangle_count, triangles, low_corner, other, start, order);
  uint32_t last = MESH_NONE;
  for (size_t i = 0; i < triangle_count; i++) {
    uint32_t t = order[i];
    if (marks[t] != MESH_GOOD) continue;
    if (last != MESH_NONE && has_same_corners(triangles, last, t)) {
      marks[t] = MESH_DUPLICATE;
      first[t] = last;
    } else {
      last = t;
    }
  }
}

batten_status batten_mesh_mark_triangles(batten_context *ctx, size_t vertex_count, const double *vertices,
                                         size_t triangle_count, const uint32_t *triangles, unsigned char *marks,
                                         uint32_t *first) {
  uint32_t *start = batten_alloc_array(ctx, vertex_count + 1, sizeof *start);
  uint32_t *scratch = start ? batten_alloc_array(ctx, triangle_count, 2 * sizeof *scratch) : NULL;
  if (scratch) {
    mesh_rounding rounding = batten_mesh_rounding(vertex_count, vertices);
    for (size_t t = 0; t < triangle_count; t++) {
      const uint32_t *v = triangles + 3 * t;
      const double *a = vertices + 3 * (size_t)v[0], *b = vertices + 3 * (size_t)v[1];
      marks[t] = MESH_GOOD;
      if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
        marks[t] = MESH_REPEATED;
      else if (batten_mesh_is_degenerate(rounding, a, b, vertices + 3 * (size_t)v[2]))
        marks[t] = MESH_STRAIGHT;
      first[t] = (uint32_t)t;
    }
    mark_duplicates(vertex_count, triangle_count, triangles, scratch, start, marks, first);
  }
  batten_status st = scratch ? BATTEN_OK : BATTEN_E_NOMEM;
  batten_free(ctx, scratch);
  batten_free(ctx, start);
  return st;
}

/* ---- edges and fans ----------------------------------------------------------------------------- */

typedef struct scratch {
  uint32_t *order;      /* [3 F] half-edges, those of one edge together */
  uint32_t *corner;     /* [3 F] disjoint sets: fans; then corners after welding */
  uint32_t *first;      /* [F] */
  uint32_t *kept;       /* [V] */
  uint32_t *fans;       /* [V] */
  unsigned char *marks; /* [F] */
  unsigned char *used;  /* [V] */
  unsigned char *alone; /* [3 F] non-zero: the only half-edge of its edge */
} scratch;

static int takes_part(const scratch *s, uint32_t h) {
  return s->marks[h / 3] == MESH_GOOD || s->marks[h / 3] == MESH_STRAIGHT;
}

/* One edge: `count` half-edges that take part. */
static void judge_edge(const uint32_t *triangles, const uint32_t *run, size_t count, scratch *s,
                       batten_mesh_defects *d) {
  uint32_t a = triangles[run[0]], b = triangles[mesh_next(run[0])];
  for (size_t i = 1; i < count; i++) {
    int along = triangles[run[i]] == a;
    sets_join(s->corner, run[0], along ? run[i] : mesh_next(run[i]));
    sets_join(s->corner, mesh_next(run[0]), along ? mesh_next(run[i]) : run[i]);
  }
  if (count > 2 && !d->nonmanifold_edges++) {
    d->nonmanifold_edge[0] = a;
    d->nonmanifold_edge[1] = b;
    for (int i = 0; i < 3; i++) d->nonmanifold_triangle[i] = run[i] / 3;
  }
  if (count == 2 && triangles[run[1]] == a && !d->flipped_edges++) {
    d->flipped_edge[0] = a;
    d->flipped_edge[1] = b;
    for (int i = 0; i < 2; i++) d->flipped_triangle[i] = run[i] / 3;
  }
}

/* Those of order that take part are left; their number. */
static size_t drop_others(size_t half_edges, scratch *s) {
  size_t alive = 0;
  for (size_t i = 0; i < half_edges; i++)
    if (takes_part(s, s->order[i])) s->order[alive++] = s->order[i];
  return alive;
}

static size_t edge_length(const uint32_t *corners, const uint32_t *run, size_t most) {
  size_t n = 1;
  while (n < most && mesh_is_same_edge(corners, run[0], run[n])) n++;
  return n;
}

static void judge_edges(size_t triangle_count, const uint32_t *triangles, scratch *s, batten_mesh_defects *d) {
  size_t alive = drop_others(3 * triangle_count, s);
  for (size_t i = 0, n; i < alive; i += n) {
    n = edge_length(triangles, s->order + i, alive - i);
    for (size_t k = 0; k < n; k++) s->alone[s->order[i + k]] = n == 1;
    judge_edge(triangles, s->order + i, n, s, d);
  }
}

static void judge_fans(size_t vertex_count, size_t triangle_count, const uint32_t *triangles, scratch *s,
                       batten_mesh_defects *d) {
  for (size_t v = 0; v < vertex_count; v++) s->fans[v] = 0;
  for (uint32_t h = 0; h < 3 * triangle_count; h++)
    if (takes_part(s, h) && s->corner[h] == h) s->fans[triangles[h]]++;
  for (size_t v = 0; v < vertex_count; v++)
    if (s->fans[v] > 1 && !d->nonmanifold_vertices++) d->nonmanifold_vertex = v;
}

static void judge_vertices(size_t vertex_count, const scratch *s, batten_mesh_defects *d) {
  for (size_t v = 0; v < vertex_count; v++)
    if (!s->used[v] && !d->isolated_vertices++) d->isolated_vertex = v;
}

/* Vertices at one place may be meant: closed parts that touch, or the fans of one vertex that were split. They are
 * not where an open edge lies upon another edge: s->fans marks those. */
static batten_status judge_places(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                  const uint32_t *triangles, scratch *s, batten_mesh_defects *d) {
  size_t half_edges = 3 * triangle_count, shared = 0;
  for (size_t v = 0; v < vertex_count; v++) {
    s->fans[v] = 0;
    shared += s->kept[v] != v;
  }
  if (!shared) return BATTEN_OK;
  uint32_t *welded = s->corner;
  for (size_t h = 0; h < half_edges; h++) welded[h] = s->kept[triangles[h]];
  batten_status st = batten_mesh_sort_edges(ctx, vertex_count, triangle_count, welded, s->order);
  if (st < 0) return st;
  size_t alive = drop_others(half_edges, s);
  for (size_t i = 0, n; i < alive; i += n) {
    const uint32_t *run = s->order + i;
    n = edge_length(welded, run, alive - i);
    int open = 0, several = 0;
    for (size_t k = 0; k < n; k++) {
      open |= s->alone[run[k]];
      several |= !mesh_is_same_edge(triangles, run[0], run[k]);
    }
    for (size_t k = 0; k < n && open && several; k++)
      s->fans[triangles[run[k]]] = s->fans[triangles[mesh_next(run[k])]] = 1;
  }
  for (uint32_t v = 0; v < vertex_count; v++)
    if (s->fans[v] && s->kept[v] != v && !d->duplicate_vertices++) {
      d->duplicate_vertex[0] = s->kept[v];
      d->duplicate_vertex[1] = v;
    }
  return BATTEN_OK;
}

static void judge_triangles(size_t triangle_count, const scratch *s, batten_mesh_defects *d) {
  for (size_t t = 0; t < triangle_count; t++) {
    if ((s->marks[t] == MESH_REPEATED || s->marks[t] == MESH_STRAIGHT) && !d->degenerate_triangles++)
      d->degenerate_triangle = t;
    if (s->marks[t] == MESH_DUPLICATE && !d->duplicate_triangles++) {
      d->duplicate_triangle[0] = s->first[t];
      d->duplicate_triangle[1] = t;
    }
  }
}

batten_status batten_mesh_find_defects_of(batten_context *ctx, size_t vertex_count, const double *vertices,
                                          size_t triangle_count, const uint32_t *triangles,
                                          batten_mesh_defects *out) {
  const size_t none = SIZE_MAX;
  batten_mesh_defects d = {.isolated_vertex = none,
                           .duplicate_vertex = {MESH_NONE, MESH_NONE},
                           .degenerate_triangle = none,
                           .duplicate_triangle = {none, none},
                           .nonmanifold_edge = {MESH_NONE, MESH_NONE},
                           .nonmanifold_triangle = {none, none, none},
                           .flipped_edge = {MESH_NONE, MESH_NONE},
                           .flipped_triangle = {none, none},
                           .nonmanifold_vertex = none};
  batten_status st = BATTEN_E_NOMEM;
  size_t half_edges = 3 * triangle_count;
  scratch s = {0};
  if (!(s.order = batten_alloc_array(ctx, half_edges, sizeof *s.order)) ||
      !(s.corner = batten_alloc_array(ctx, half_edges, sizeof *s.corner)) ||
      !(s.first = batten_alloc_array(ctx, triangle_count, sizeof *s.first)) ||
      !(s.kept = batten_alloc_array(ctx, vertex_count, sizeof *s.kept)) ||
      !(s.fans = batten_alloc_array(ctx, vertex_count, sizeof *s.fans)) ||
      !(s.alone = batten_alloc_array(ctx, half_edges, sizeof *s.alone)) ||
      !(s.marks = batten_alloc_array(ctx, triangle_count, sizeof *s.marks)) ||
      !(s.used = batten_alloc_array(ctx, vertex_count, sizeof *s.used)))
    goto done;
  for (size_t v = 0; v < vertex_count; v++) s.used[v] = 0;
  for (size_t h = 0; h < half_edges; h++) s.used[triangles[h]] = 1;
  st = batten_mesh_mark_triangles(ctx, vertex_count, vertices, triangle_count, triangles, s.marks, s.first);
  if (st == BATTEN_OK) st = batten_mesh_find_welds(ctx, vertex_count, vertices, s.used, 0, s.kept);
  if (st == BATTEN_OK) st = batten_mesh_sort_edges(ctx, vertex_count, triangle_count, triangles, s.order);
  if (st < 0) goto done;
  sets_start(half_edges, s.corner);
  judge_vertices(vertex_count, &s, &d);
  judge_triangles(triangle_count, &s, &d);
  judge_edges(triangle_count, triangles, &s, &d);
  judge_fans(vertex_count, triangle_count, triangles, &s, &d);
  st = judge_places(ctx, vertex_count, triangle_count, triangles, &s, &d);
  if (st == BATTEN_OK) *out = d;
done:
  batten_free(ctx, s.used);
  batten_free(ctx, s.marks);
  batten_free(ctx, s.alone);
  batten_free(ctx, s.fans);
  batten_free(ctx, s.kept);
  batten_free(ctx, s.first);
  batten_free(ctx, s.corner);
  batten_free(ctx, s.order);
  return st;
}

batten_status batten_mesh_fail_defects(batten_context *ctx, const batten_mesh_defects *d) {
  static const char remedy[] = "see batten_mesh_repair";
  if (d->isolated_vertices)
    return batten_fail(ctx, BATTEN_E_INVALID, "vertices[%zu]: in no triangle, one of %zu; %s", d->isolated_vertex,
                       d->isolated_vertices, remedy);
  if (d->duplicate_vertices)
    return batten_fail(ctx, BATTEN_E_INVALID, "vertices[%lu]: at the place of vertices[%lu], one of %zu; %s",
                       (unsigned long)d->duplicate_vertex[1], (unsigned long)d->duplicate_vertex[0],
                       d->duplicate_vertices, remedy);
  if (d->degenerate_triangles)
    return batten_fail(ctx, BATTEN_E_INVALID, "triangles[%zu]: without area, one of %zu; %s", d->degenerate_triangle,
                       d->degenerate_triangles, remedy);
  if (d->duplicate_triangles)
    return batten_fail(ctx, BATTEN_E_INVALID, "triangles[%zu]: has the corners of triangles[%zu], one of %zu; %s",
                       d->duplicate_triangle[1], d->duplicate_triangle[0], d->duplicate_triangles, remedy);
  if (d->nonmanifold_edges)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "edge from vertex %lu to %lu: in triangles %zu, %zu, %zu, one of %zu such edges; leave two of "
                       "its triangles",
                       (unsigned long)d->nonmanifold_edge[0], (unsigned long)d->nonmanifold_edge[1],
                       d->nonmanifold_triangle[0], d->nonmanifold_triangle[1], d->nonmanifold_triangle[2],
                       d->nonmanifold_edges);
  if (d->flipped_edges)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "edge from vertex %lu to %lu: triangles %zu and %zu pass it the same way, one of %zu such "
                       "edges; turn one of them, %s",
                       (unsigned long)d->flipped_edge[0], (unsigned long)d->flipped_edge[1], d->flipped_triangle[0],
                       d->flipped_triangle[1], d->flipped_edges, remedy);
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "vertices[%zu]: its triangles fall apart into more than one fan, one of %zu; %s",
                     d->nonmanifold_vertex, d->nonmanifold_vertices, remedy);
}

batten_status batten_mesh_find_defects(batten_context *ctx, const batten_mesh *mesh, batten_mesh_defects *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!mesh || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a mesh and room for its defects",
                       mesh ? "out" : "mesh");
  return batten_mesh_find_defects_of(ctx, mesh->vertex_count, mesh->vertices, mesh->triangle_count, mesh->triangles,
                                     out);
}
