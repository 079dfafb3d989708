/* A triangle surface that can be changed. See surface.h. */
#include "surface.h"

#include "table.h"
#include "vec.h"

#include <string.h>

void mesh_surface_free(mesh_surface *s) {
  batten_free(s->ctx, s->points);
  batten_free(s->ctx, s->normals);
  batten_free(s->ctx, s->faces);
  batten_free(s->ctx, s->out);
  batten_free(s->ctx, s->origin);
  batten_free(s->ctx, s->twin);
  batten_free(s->ctx, s->sharp);
  batten_free(s->ctx, s->drift);
  *s = (mesh_surface){.ctx = s->ctx};
}

static void set_twins(mesh_surface *s, uint32_t h, uint32_t g) {
  if (h != MESH_NONE) s->twin[h] = g;
  if (g != MESH_NONE) s->twin[g] = h;
}

/* Turns back clockwise from half-edge h as far as it goes, and makes that the first of its origin. */
static void set_first(mesh_surface *s, uint32_t h) {
  uint32_t first = h;
  while (s->twin[h] != MESH_NONE) {
    h = mesh_next(s->twin[h]);
    if (h == first) break;
  }
  s->out[s->origin[h]] = h;
}

/* ---- building ----------------------------------------------------------------------------------- */

static void set_normals(mesh_surface *s) {
  memset(s->normals, 0, s->vertex_count * 3 * sizeof *s->normals);
  for (size_t t = 0; t < s->triangle_count; t++) {
    const uint32_t *v = s->origin + 3 * t;
    double n[3];
    vec_triangle_normal(s->points + 3 * (size_t)v[0], s->points + 3 * (size_t)v[1], s->points + 3 * (size_t)v[2], n);
    for (int k = 0; k < 3; k++)
      for (size_t d = 0; d < 3; d++) s->normals[3 * (size_t)v[k] + d] += n[d];
  }
  for (size_t v = 0; v < s->vertex_count; v++) vec_normalize(s->normals + 3 * v);
}

static batten_status pair_half_edges(mesh_surface *s, const uint32_t *order) {
  size_t half_edges = 3 * s->triangle_count;
  for (size_t i = 0; i < half_edges; i++) {
    uint32_t h = order[i], g = i + 1 < half_edges ? order[i + 1] : h;
    uint32_t a = s->origin[h], b = s->origin[mesh_next(h)];
    s->twin[h] = MESH_NONE;
    if (g != h && s->origin[g] == b && s->origin[mesh_next(g)] == a) {
      set_twins(s, h, g);
      i++;
    } else if (s->faces[a] == 0 || s->faces[b] == 0) {
      return batten_fail(s->ctx, BATTEN_E_INTERNAL, "tracked surface: open at the edge %lu-%lu inside of the box",
                         (unsigned long)a, (unsigned long)b);
    }
  }
  return BATTEN_OK;
}

static void set_out(mesh_surface *s) {
  for (size_t v = 0; v < s->vertex_count; v++) s->out[v] = MESH_NONE;
  for (uint32_t h = 0; h < 3 * s->triangle_count; h++)
    if (s->out[s->origin[h]] == MESH_NONE) set_first(s, h);
}

batten_status mesh_surface_build(batten_context *ctx, batten_rough_surface *rough, mesh_surface *out) {
  mesh_surface s = {.ctx = ctx, .vertex_count = rough->vertex_count, .triangle_count = rough->triangle_count};
  batten_status st = BATTEN_E_NOMEM;
  s.points = rough->vertices;
  s.faces = rough->faces;
  s.origin = rough->triangles;
  *rough = (batten_rough_surface){0};
  s.points_capacity = s.faces_capacity = s.normals_capacity = s.out_capacity = s.drift_capacity = s.vertex_count;
  s.origin_capacity = s.twin_capacity = s.sharp_capacity = 3 * s.triangle_count;
  uint32_t *order = batten_alloc_array(ctx, 3 * s.triangle_count, sizeof *order);
  if (!order || !(s.normals = batten_alloc_array(ctx, s.vertex_count, 3 * sizeof *s.normals)) ||
      !(s.out = batten_alloc_array(ctx, s.vertex_count, sizeof *s.out)) ||
      !(s.twin = batten_alloc_array(ctx, 3 * s.triangle_count, sizeof *s.twin)) ||
      !(s.sharp = batten_alloc_array(ctx, 3 * s.triangle_count, 1)) ||
      !(s.drift = batten_alloc_array(ctx, s.vertex_count, sizeof *s.drift)))
    goto done;
  for (size_t v = 0; v < s.vertex_count; v++) s.drift[v] = INFINITY;
  memset(s.sharp, 0, 3 * s.triangle_count);
  st = batten_progress(ctx, "improve", 0);
  if (st >= 0) st = batten_mesh_sort_edges(ctx, s.vertex_count, s.triangle_count, s.origin, order);
  if (st >= 0) st = batten_progress(ctx, "improve", 0);
  if (st >= 0) st = pair_half_edges(&s, order);
  if (st >= 0) st = batten_progress(ctx, "improve", 0);
  if (st < 0) goto done;
  set_out(&s);
  st = batten_progress(ctx, "improve", 0);
  if (st < 0) goto done;
  set_normals(&s);
  *out = s;
done:
  if (st < 0) mesh_surface_free(&s);
  batten_free(ctx, order);
  return st;
}

/* A copy of size bytes for each of count items; NULL: out of memory. */
static void *copy_array(batten_context *ctx, const void *from, size_t count, size_t size) {
  void *to = batten_alloc_array(ctx, count, size);
  if (to && count) memcpy(to, from, count * size);
  return to;
}

batten_status mesh_surface_copy(const mesh_surface *s, mesh_surface *out) {
  batten_context *ctx = s->ctx;
  size_t v = s->vertex_count, h = 3 * s->triangle_count;
  mesh_surface copy = {.ctx = ctx, .vertex_count = v, .triangle_count = s->triangle_count};
  copy.points_capacity = copy.normals_capacity = copy.faces_capacity = copy.out_capacity = copy.drift_capacity = v;
  copy.origin_capacity = copy.twin_capacity = copy.sharp_capacity = h;
  if (!(copy.points = copy_array(ctx, s->points, v, 3 * sizeof *s->points)) ||
      !(copy.normals = copy_array(ctx, s->normals, v, 3 * sizeof *s->normals)) ||
      !(copy.faces = copy_array(ctx, s->faces, v, 1)) || !(copy.out = copy_array(ctx, s->out, v, sizeof *s->out)) ||
      !(copy.origin = copy_array(ctx, s->origin, h, sizeof *s->origin)) ||
      !(copy.twin = copy_array(ctx, s->twin, h, sizeof *s->twin)) ||
      !(copy.sharp = copy_array(ctx, s->sharp, h, 1)) ||
      !(copy.drift = copy_array(ctx, s->drift, v, sizeof *s->drift))) {
    mesh_surface_free(&copy);
    return BATTEN_E_NOMEM;
  }
  *out = copy;
  return BATTEN_OK;
}

/* ---- rings -------------------------------------------------------------------------------------- */

size_t mesh_surface_ring(const mesh_surface *s, uint32_t v, uint32_t *half_edges) {
  uint32_t first = s->out[v], h = first;
  size_t count = 0;
  do {
    if (count == SURFACE_RING_MAX) return 0;
    half_edges[count++] = h;
    h = s->twin[mesh_previous(h)];
  } while (h != MESH_NONE && h != first);
  return count;
}

size_t mesh_surface_neighbours(const mesh_surface *s, uint32_t v, uint32_t *vertices) {
  uint32_t ring[SURFACE_RING_MAX];
  size_t count = mesh_surface_ring(s, v, ring);
  for (size_t i = 0; i < count; i++) vertices[i] = s->origin[mesh_next(ring[i])];
  if (count && mesh_surface_on_boundary(s, v)) {
    vertices[count] = s->origin[mesh_previous(ring[count - 1])];
    count++;
  }
  return count;
}

uint32_t mesh_surface_find(const mesh_surface *s, uint32_t a, uint32_t b) {
  uint32_t ring[SURFACE_RING_MAX];
  size_t count = mesh_surface_ring(s, a, ring);
  for (size_t i = 0; i < count; i++)
    if (s->origin[mesh_next(ring[i])] == b) return ring[i];
  return MESH_NONE;
}

size_t mesh_surface_sharp_count(const mesh_surface *s, uint32_t v) {
  uint32_t ring[SURFACE_RING_MAX];
  size_t count = mesh_surface_ring(s, v, ring), sharp = 0;
  if (count == 0) return SURFACE_RING_MAX;
  for (size_t i = 0; i < count; i++) sharp += s->sharp[ring[i]];
  return sharp + (mesh_surface_on_boundary(s, v) && s->sharp[mesh_previous(ring[count - 1])]);
}

static bool are_neighbours(const mesh_surface *s, uint32_t a, uint32_t b) {
  uint32_t around[SURFACE_RING_MAX + 1];
  size_t count = mesh_surface_neighbours(s, a, around);
  for (size_t i = 0; i < count; i++)
    if (around[i] == b) return true;
  return count == 0; /* not known */
}

/* ---- split -------------------------------------------------------------------------------------- */

static batten_status make_room(mesh_surface *s) {
  size_t v = s->vertex_count + 1, h = 3 * s->triangle_count + 6;
  batten_context *ctx = s->ctx;
  if (v >= UINT32_MAX || h >= UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.cell: %zu triangles are too many; enlarge it",
                       s->triangle_count);
  if (v <= s->points_capacity && v <= s->normals_capacity && v <= s->faces_capacity && v <= s->out_capacity &&
      v <= s->drift_capacity && h <= s->origin_capacity && h <= s->twin_capacity && h <= s->sharp_capacity)
    return BATTEN_OK;
  if (batten_reserve(ctx, (void **)&s->points, &s->points_capacity, v, 3 * sizeof *s->points) < 0 ||
      batten_reserve(ctx, (void **)&s->normals, &s->normals_capacity, v, 3 * sizeof *s->normals) < 0 ||
      batten_reserve(ctx, (void **)&s->faces, &s->faces_capacity, v, 1) < 0 ||
      batten_reserve(ctx, (void **)&s->out, &s->out_capacity, v, sizeof *s->out) < 0 ||
      batten_reserve(ctx, (void **)&s->origin, &s->origin_capacity, h, sizeof *s->origin) < 0 ||
      batten_reserve(ctx, (void **)&s->twin, &s->twin_capacity, h, sizeof *s->twin) < 0 ||
      batten_reserve(ctx, (void **)&s->sharp, &s->sharp_capacity, h, 1) < 0 ||
      batten_reserve(ctx, (void **)&s->drift, &s->drift_capacity, v, sizeof *s->drift) < 0)
    return BATTEN_E_NOMEM;
  return BATTEN_OK;
}

/* The half at the end of h (a -> b, apex c) becomes the new triangle m b c: returns its half-edge m -> b. */
static uint32_t split_half(mesh_surface *s, uint32_t h, uint32_t m) {
  uint32_t hn = mesh_next(h), n = 3 * (uint32_t)s->triangle_count++;
  uint32_t b = s->origin[hn], c = s->origin[mesh_next(hn)];
  s->origin[n] = m;
  s->origin[n + 1] = b;
  s->origin[n + 2] = c;
  set_twins(s, n + 1, s->twin[hn]);
  s->sharp[n] = s->sharp[h];
  s->sharp[n + 1] = s->sharp[hn];
  s->sharp[n + 2] = s->sharp[hn] = 0;
  s->origin[hn] = m;
  set_twins(s, hn, n + 2);
  if (s->out[b] == hn) s->out[b] = n + 1;
  return n;
}

uint32_t mesh_surface_split(mesh_surface *s, uint32_t h, const double *x) {
  if (make_room(s) < 0) return MESH_NONE;
  uint32_t m = (uint32_t)s->vertex_count++, g = s->twin[h], a = s->origin[h], b = s->origin[mesh_next(h)];
  memcpy(s->points + 3 * (size_t)m, x, 3 * sizeof *x);
  double *n = s->normals + 3 * (size_t)m;
  for (size_t k = 0; k < 3; k++) n[k] = s->normals[3 * (size_t)a + k] + s->normals[3 * (size_t)b + k];
  vec_normalize(n);
  double half = 0.5 * vec_distance(s->points + 3 * (size_t)a, s->points + 3 * (size_t)b);
  s->drift[m] = (float)(fmax(s->drift[a], s->drift[b]) + half);
  s->faces[m] = g == MESH_NONE ? s->faces[a] & s->faces[b] & (unsigned char)~MESH_MARKS : 0;
  if (s->sharp[h]) s->faces[m] |= MESH_CREASE;
  uint32_t mb = split_half(s, h, m);
  s->out[m] = mb;
  s->twin[mb] = MESH_NONE;
  if (g == MESH_NONE) return m;
  uint32_t ma = split_half(s, g, m);
  set_twins(s, h, ma);
  set_twins(s, mb, g);
  return m;
}

uint32_t mesh_surface_poke(mesh_surface *s, uint32_t t, const double *x) {
  if (make_room(s) < 0) return MESH_NONE;
  uint32_t m = (uint32_t)s->vertex_count++, h = 3 * t, n = 3 * (uint32_t)s->triangle_count;
  s->triangle_count += 2;
  memcpy(s->points + 3 * (size_t)m, x, 3 * sizeof *x);
  double *normal = s->normals + 3 * (size_t)m;
  for (size_t k = 0; k < 3; k++) {
    normal[k] = 0;
    for (uint32_t i = 0; i < 3; i++) normal[k] += s->normals[3 * (size_t)s->origin[h + i] + k];
  }
  vec_normalize(normal);
  s->faces[m] = 0;
  s->drift[m] = INFINITY;
  for (uint32_t i = 1; i < 3; i++) { /* its sides 1 and 2 get a triangle each, with the sides: old, to m, from m */
    uint32_t side = n + 3 * (i - 1), old = h + i;
    s->origin[side] = s->origin[old];
    s->origin[side + 1] = s->origin[h + (i + 1) % 3];
    s->origin[side + 2] = m;
    set_twins(s, side, s->twin[old]);
    if (s->twin[old] == MESH_NONE) s->twin[side] = MESH_NONE;
    s->sharp[side] = s->sharp[old];
    s->sharp[side + 1] = s->sharp[side + 2] = 0;
    if (s->out[s->origin[old]] == old) s->out[s->origin[old]] = side;
  }
  s->origin[h + 2] = m;
  s->sharp[h + 1] = s->sharp[h + 2] = 0;
  set_twins(s, h + 1, n + 2); /* b -> m and m -> b */
  set_twins(s, n + 1, n + 5); /* c -> m and m -> c */
  set_twins(s, n + 4, h + 2); /* a -> m and m -> a */
  s->out[m] = h + 2;
  return m;
}

/* ---- collapse ----------------------------------------------------------------------------------- */

bool mesh_surface_may_collapse(const mesh_surface *s, uint32_t h) {
  uint32_t g = s->twin[h], a = s->origin[h], b = s->origin[mesh_next(h)], around_a[SURFACE_RING_MAX + 1],
           around_b[SURFACE_RING_MAX + 1];
  bool a_edge = mesh_surface_on_boundary(s, a), b_edge = mesh_surface_on_boundary(s, b);
  if (a_edge && (g != MESH_NONE || !b_edge)) return false;
  size_t na = mesh_surface_neighbours(s, a, around_a), nb = mesh_surface_neighbours(s, b, around_b), common = 0;
  if (na == 0 || nb == 0 || na + nb > SURFACE_RING_MAX) return false;
  for (size_t i = 0; i < na; i++)
    for (size_t j = 0; j < nb; j++) common += around_a[i] == around_b[j];
  if (common != (g == MESH_NONE ? 1 : 2)) return false;
  uint32_t apexes[2] = {s->origin[mesh_previous(h)], g == MESH_NONE ? MESH_NONE : s->origin[mesh_previous(g)]};
  for (int i = 0; i < 2 && apexes[i] != MESH_NONE; i++) { /* they lose a neighbour, and need two triangles or three */
    uint32_t around[SURFACE_RING_MAX + 1];
    size_t n = mesh_surface_neighbours(s, apexes[i], around);
    if (n == 0 || n < (mesh_surface_on_boundary(s, apexes[i]) ? 3u : 4u)) return false;
  }
  return true;
}

/* Takes the triangle of h (a -> b, apex c) away: the triangles beyond its other two sides become neighbours. */
static void close_gap(mesh_surface *s, uint32_t h) {
  uint32_t hn = mesh_next(h), hp = mesh_previous(h), c = s->origin[hp];
  uint32_t cb = s->twin[hn], ac = s->twin[hp];
  unsigned char sharp = s->sharp[hn] | s->sharp[hp];
  if (cb != MESH_NONE) s->twin[cb] = ac;
  if (ac != MESH_NONE) s->twin[ac] = cb;
  if (cb != MESH_NONE) s->sharp[cb] = sharp;
  if (ac != MESH_NONE) s->sharp[ac] = sharp;
  if (s->out[c] == hp) s->out[c] = cb;
  s->origin[h] = s->origin[hn] = s->origin[hp] = MESH_NONE;
}

void mesh_surface_collapse(mesh_surface *s, uint32_t h) {
  uint32_t ring[SURFACE_RING_MAX], g = s->twin[h], a = s->origin[h], b = s->origin[mesh_next(h)];
  size_t count = mesh_surface_ring(s, a, ring);
  /* Of the half-edges around, these two leave b or a afterwards. */
  uint32_t beyond[4] = {s->twin[mesh_previous(h)], s->twin[mesh_next(h)], MESH_NONE, MESH_NONE};
  if (g != MESH_NONE) {
    beyond[2] = s->twin[mesh_previous(g)];
    beyond[3] = s->twin[mesh_next(g)];
  }
  for (size_t i = 0; i < count; i++) s->origin[ring[i]] = b;
  close_gap(s, h);
  /* In g (b -> a, apex d) the roles are: next side a -> d, previous side d -> b. */
  if (g != MESH_NONE) close_gap(s, g);
  s->out[a] = MESH_NONE;
  /* beyond[0]: was a -> c; beyond[1]: c -> b; beyond[2]: b -> d; beyond[3]: was d -> a. */
  uint32_t leaves_b = beyond[0] != MESH_NONE   ? beyond[0]
                      : beyond[2] != MESH_NONE ? beyond[2]
                      : beyond[1] != MESH_NONE ? mesh_next(beyond[1])
                                               : mesh_next(beyond[3]);
  set_first(s, leaves_b);
}

/* ---- flip --------------------------------------------------------------------------------------- */

bool mesh_surface_may_flip(const mesh_surface *s, uint32_t h) {
  uint32_t g = s->twin[h];
  if (g == MESH_NONE) return false;
  uint32_t a = s->origin[h], b = s->origin[g], c = s->origin[mesh_previous(h)], d = s->origin[mesh_previous(g)];
  uint32_t around[SURFACE_RING_MAX + 1];
  uint32_t ends[2] = {a, b};
  for (int i = 0; i < 2; i++) {
    size_t n = mesh_surface_neighbours(s, ends[i], around);
    if (n == 0 || n < (mesh_surface_on_boundary(s, ends[i]) ? 3u : 4u)) return false;
  }
  return c != d && !are_neighbours(s, c, d);
}

void mesh_surface_flip(mesh_surface *s, uint32_t h) {
  uint32_t hn = mesh_next(h), hp = mesh_previous(h), g = s->twin[h], gn = mesh_next(g), gp = mesh_previous(g);
  uint32_t a = s->origin[h], b = s->origin[g], c = s->origin[hp], d = s->origin[gp];
  uint32_t bc = s->twin[hn], ca = s->twin[hp], ad = s->twin[gn], db = s->twin[gp];
  unsigned char sharp_ca = s->sharp[hp], sharp_ad = s->sharp[gn], sharp_db = s->sharp[gp], sharp_bc = s->sharp[hn];
  s->sharp[hn] = sharp_ca;
  s->sharp[hp] = sharp_ad;
  s->sharp[gn] = sharp_db;
  s->sharp[gp] = sharp_bc;
  s->sharp[h] = s->sharp[g] = 0;
  s->origin[h] = d; /* triangle d c a */
  s->origin[hn] = c;
  s->origin[hp] = a;
  s->origin[g] = c; /* triangle c d b */
  s->origin[gn] = d;
  s->origin[gp] = b;
  set_twins(s, h, g);
  s->twin[hn] = s->twin[hp] = s->twin[gn] = s->twin[gp] = MESH_NONE;
  set_twins(s, hn, ca);
  set_twins(s, hp, ad);
  set_twins(s, gn, db);
  set_twins(s, gp, bc);
  if (s->out[a] == h || s->out[a] == gn) s->out[a] = hp;
  if (s->out[b] == g || s->out[b] == hn) s->out[b] = gp;
  if (s->out[c] == hp) s->out[c] = hn;
  if (s->out[d] == gp) s->out[d] = gn;
}

/* ---- compaction --------------------------------------------------------------------------------- */

static bool is_compact(const mesh_surface *s) {
  for (size_t v = 0; v < s->vertex_count; v++)
    if (s->out[v] == MESH_NONE) return false;
  return true; /* every collapse takes a vertex */
}

batten_status mesh_surface_compact(mesh_surface *s) {
  if (is_compact(s)) return BATTEN_OK;
  uint32_t vertices = 0, triangles = 0;
  uint32_t *number = batten_alloc_array(s->ctx, s->vertex_count + s->triangle_count, sizeof *number);
  if (!number) return BATTEN_E_NOMEM;
  uint32_t *vertex_number = number, *triangle_number = number + s->vertex_count;
  for (size_t v = 0; v < s->vertex_count; v++) {
    if (s->out[v] == MESH_NONE) continue;
    memmove(s->points + 3 * (size_t)vertices, s->points + 3 * v, 3 * sizeof *s->points);
    memmove(s->normals + 3 * (size_t)vertices, s->normals + 3 * v, 3 * sizeof *s->normals);
    s->faces[vertices] = s->faces[v];
    s->drift[vertices] = s->drift[v];
    s->out[vertices] = s->out[v];
    vertex_number[v] = vertices++;
  }
  for (size_t t = 0; t < s->triangle_count; t++)
    if (s->origin[3 * t] != MESH_NONE) triangle_number[t] = triangles++;
  for (size_t t = 0; t < s->triangle_count; t++) {
    if (s->origin[3 * t] == MESH_NONE) continue;
    size_t to = triangle_number[t];
    for (size_t k = 0; k < 3; k++) {
      uint32_t g = s->twin[3 * t + k];
      s->origin[3 * to + k] = vertex_number[s->origin[3 * t + k]];
      s->sharp[3 * to + k] = s->sharp[3 * t + k];
      s->twin[3 * to + k] = g == MESH_NONE ? MESH_NONE : 3 * triangle_number[g / 3] + g % 3;
    }
  }
  for (size_t v = 0; v < vertices; v++) s->out[v] = 3 * triangle_number[s->out[v] / 3] + s->out[v] % 3;
  s->vertex_count = vertices;
  s->triangle_count = triangles;
  batten_free(s->ctx, number);
  return BATTEN_OK;
}
