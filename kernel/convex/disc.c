/* Checks of the topology of a disc, in the order in which each makes sense: triangles that are triangles, edges of
 * one or two, fans around points, one rim, one piece, no handles. Half-edges are paired by sorting them by their
 * ends. */
#include "disc.h"

#include <string.h>

#include "base/checked.h"
#include "mesh/sets.h"

static batten_status check_triangles(batten_context *ctx, size_t points, size_t count, const uint32_t *triangles) {
  for (size_t t = 0; t < count; t++) {
    const uint32_t *c = triangles + 3 * t;
    for (size_t k = 0; k < 3; k++) {
      if (c[k] >= points)
        return batten_fail(ctx, BATTEN_E_INVALID, "opt.triangles[%zu]: corner %zu is %lu, but there are %zu points",
                           t, k, (unsigned long)c[k], points);
      if (c[k] == c[(k + 1) % 3])
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "opt.triangles[%zu]: point %lu is a corner twice; leave the triangle out", t,
                           (unsigned long)c[k]);
    }
  }
  return BATTEN_OK;
}

/* twin from order [3 F], which has the half-edges of one edge together. */
static batten_status pair_edges(batten_context *ctx, const uint32_t *order, convex_disc *d) {
  size_t half_edges = 3 * d->triangles, first = 0;
  while (first < half_edges) {
    size_t last = first + 1;
    while (last < half_edges && mesh_is_same_edge(d->corners, order[first], order[last])) last++;
    uint32_t g = order[first], h = last - first > 1 ? order[first + 1] : MESH_NONE;
    if (last - first > 2)
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "opt.triangles[%lu]: its edge of points %lu and %lu is in %zu triangles, also in %lu and %lu; "
          "two can share one",
          (unsigned long)g / 3, (unsigned long)d->corners[g], (unsigned long)d->corners[mesh_next(g)], last - first,
          (unsigned long)h / 3, (unsigned long)order[first + 2] / 3);
    if (h != MESH_NONE && d->corners[g] == d->corners[h])
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "opt.triangles[%lu]: passes its edge from point %lu to %lu the same way as triangle %lu; turn "
          "one of them",
          (unsigned long)h / 3, (unsigned long)d->corners[h], (unsigned long)d->corners[mesh_next(h)],
          (unsigned long)g / 3);
    d->twin[g] = h;
    if (h != MESH_NONE) d->twin[h] = g;
    first = last;
  }
  return BATTEN_OK;
}

/* leaving: at the rim the half-edge of the rim, elsewhere that of the lowest number. */
static void find_leaving(convex_disc *d) {
  for (size_t i = 0; i < d->points; i++) d->leaving[i] = MESH_NONE;
  for (uint32_t h = 0; h < 3 * d->triangles; h++) {
    uint32_t *place = d->leaving + d->corners[h];
    if (*place == MESH_NONE || d->twin[h] == MESH_NONE) *place = h;
  }
}

/* Every point is used, and its triangles are one fan. corners_at [points] is scratch. */
static batten_status check_fans(batten_context *ctx, const uint32_t *first, const convex_disc *d,
                                uint32_t *corners_at) {
  memset(corners_at, 0, d->points * sizeof *corners_at);
  for (size_t h = 0; h < 3 * d->triangles; h++) corners_at[d->corners[h]]++;
  for (uint32_t i = 0; i < d->points; i++) {
    if (d->leaving[i] == MESH_NONE) {
      if (first && first[i] != i) continue;
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "points[%lu]: in no triangle; leave the point out, or give triangles of all points",
                         (unsigned long)i);
    }
    uint32_t h = d->leaving[i], count = 0;
    do {
      count++;
      h = convex_disc_turn(d, h);
    } while (h != MESH_NONE && h != d->leaving[i]);
    if (count != corners_at[i])
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "points[%lu]: its %lu triangles fall apart into more than one fan; give each its own point",
                         (unsigned long)i, (unsigned long)corners_at[i]);
  }
  return BATTEN_OK;
}

/* The half-edge of the rim that follows h. */
static uint32_t rim_next(const convex_disc *d, uint32_t h) { return d->leaving[d->corners[mesh_next(h)]]; }

/* Fills rim, from the lowest half-edge on it. */
static batten_status find_rim(batten_context *ctx, convex_disc *d) {
  uint32_t start = MESH_NONE;
  size_t rim_edges = 0;
  for (uint32_t h = 0; h < 3 * d->triangles; h++)
    if (d->twin[h] == MESH_NONE) {
      if (start == MESH_NONE) start = h;
      rim_edges++;
    }
  if (rim_edges == 0)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.triangles: they close to a surface without a boundary; cut it open to a disc");
  d->rim_count = 0;
  uint32_t h = start;
  do {
    d->rim[d->rim_count++] = d->corners[h];
    h = rim_next(d, h);
  } while (h != start);
  if (d->rim_count == rim_edges) return BATTEN_OK;
  /* A point of another boundary: one that the walk has not passed. */
  unsigned char *passed = batten_alloc_array(ctx, d->points, 1);
  if (!passed) return BATTEN_E_NOMEM;
  memset(passed, 0, d->points);
  for (size_t i = 0; i < d->rim_count; i++) passed[d->rim[i]] = 1;
  uint32_t other = 0;
  while (passed[other] || !convex_disc_is_rim(d, other)) other++;
  batten_free(ctx, passed);
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "opt.triangles: more than one boundary, through points %lu and %lu; fill the holes, or give one "
                     "piece at a time",
                     (unsigned long)d->rim[0], (unsigned long)other);
}

/* One piece without handles; one rim is there. parent [points] is scratch. */
static batten_status check_genus(batten_context *ctx, const convex_disc *d, uint32_t *parent) {
  size_t used = 0;
  sets_start(d->points, parent);
  for (uint32_t h = 0; h < 3 * d->triangles; h++) sets_join(parent, d->corners[h], d->corners[mesh_next(h)]);
  uint32_t root = sets_find(parent, d->rim[0]);
  for (uint32_t i = 0; i < d->points; i++) {
    if (d->leaving[i] == MESH_NONE) continue;
    used++;
    if (sets_find(parent, i) != root)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.triangles[%lu]: no edges lead to it from triangle %lu; give one piece at a time",
                         (unsigned long)d->leaving[i] / 3, (unsigned long)d->leaving[d->rim[0]] / 3);
  }
  size_t edges = (3 * d->triangles + d->rim_count) / 2;
  if (used + d->triangles == edges + 1) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.triangles: not a disc, it has %zu handles; cut them open",
                     (edges + 1 - used - d->triangles) / 2);
}

void convex_disc_free(batten_context *ctx, convex_disc *d) {
  batten_free(ctx, d->corners);
  batten_free(ctx, d->twin);
  batten_free(ctx, d->leaving);
  batten_free(ctx, d->rim);
  *d = (convex_disc){0};
}

batten_status convex_disc_new(batten_context *ctx, size_t points, const uint32_t *first, size_t triangle_count,
                              const uint32_t *triangles, convex_disc *out) {
  /* Splits: edges with both ends on the rim are fewer than the rim has points, each gives two triangles. */
  size_t room_points = 2 * points, room_triangles = triangle_count + 2 * points;
  if (points > UINT32_MAX / 16 || triangle_count > UINT32_MAX / 16)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points and %zu triangles; at most %u of each", points,
                       triangle_count, UINT32_MAX / 16);
  batten_status st = check_triangles(ctx, points, triangle_count, triangles);
  if (st < 0) return st;
  convex_disc d = {.points = points, .triangles = triangle_count};
  uint32_t *order = batten_alloc_array(ctx, 3 * triangle_count, sizeof *order);
  uint32_t *scratch = order ? batten_alloc_array(ctx, points, sizeof *scratch) : NULL;
  d.corners = scratch ? batten_alloc_array(ctx, room_triangles, 3 * sizeof *d.corners) : NULL;
  d.twin = d.corners ? batten_alloc_array(ctx, room_triangles, 3 * sizeof *d.twin) : NULL;
  d.leaving = d.twin ? batten_alloc_array(ctx, room_points, sizeof *d.leaving) : NULL;
  d.rim = d.leaving ? batten_alloc_array(ctx, points, sizeof *d.rim) : NULL;
  st = d.rim ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  memcpy(d.corners, triangles, 3 * triangle_count * sizeof *triangles);
  st = batten_mesh_sort_edges(ctx, points, triangle_count, triangles, order);
  if (st >= 0) st = pair_edges(ctx, order, &d);
  if (st < 0) goto done;
  find_leaving(&d);
  st = check_fans(ctx, first, &d, scratch);
  if (st >= 0) st = find_rim(ctx, &d);
  if (st >= 0) st = check_genus(ctx, &d, scratch);

done:
  batten_free(ctx, scratch);
  batten_free(ctx, order);
  if (st >= 0)
    *out = d;
  else
    convex_disc_free(ctx, &d);
  return st;
}

static void join(convex_disc *d, uint32_t g, uint32_t h) {
  d->twin[g] = h;
  if (h != MESH_NONE) d->twin[h] = g;
}

/* Triangle (a, b, c) of half-edge h = a -> b becomes (a, m, c) and a new one (m, b, c); returns the half-edge m -> b.
 */
static uint32_t halve(convex_disc *d, uint32_t h, uint32_t m) {
  uint32_t right = mesh_next(h), left = mesh_previous(h);
  uint32_t b = d->corners[right], c = d->corners[left], fresh = (uint32_t)(3 * d->triangles++);
  d->corners[fresh] = m;
  d->corners[fresh + 1] = b;
  d->corners[fresh + 2] = c;
  join(d, fresh + 1, d->twin[right]); /* b -> c */
  if (d->leaving[b] == right) d->leaving[b] = fresh + 1;
  d->corners[right] = m;
  join(d, right, fresh + 2); /* m -> c and back */
  return fresh;
}

void convex_disc_split(convex_disc *d, uint32_t h) {
  uint32_t m = (uint32_t)d->points++, g = d->twin[h];
  uint32_t h_far = halve(d, h, m), g_far = halve(d, g, m);
  join(d, h, g_far); /* a -> m, m -> a */
  join(d, h_far, g); /* m -> b, b -> m */
  d->leaving[m] = h_far;
}

batten_status convex_disc_peel(batten_context *ctx, convex_disc *d,
                               bool (*take)(const void *arg, const convex_disc *disc, uint32_t h), const void *arg) {
  /* Each half-edge comes to the rim once. */
  uint32_t *stack = batten_alloc_array(ctx, 3 * d->triangles, sizeof *stack);
  unsigned char *gone = stack ? batten_alloc_array(ctx, d->triangles, 1) : NULL;
  size_t height = 0, kept = 0;
  batten_status st = gone ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  memset(gone, 0, d->triangles);
  for (size_t i = d->rim_count; i-- > 0;) stack[height++] = d->leaving[d->rim[i]];
  while (height > 0) {
    uint32_t h = stack[--height], apex = d->corners[mesh_previous(h)];
    if (convex_disc_is_rim(d, apex) || !take(arg, d, h)) continue;
    uint32_t right = d->twin[mesh_next(h)], left = d->twin[mesh_previous(h)]; /* apex -> end, start -> apex */
    gone[h / 3] = 1;
    d->twin[right] = d->twin[left] = MESH_NONE;
    d->leaving[d->corners[left]] = left;
    d->leaving[apex] = right;
    stack[height++] = left;
    stack[height++] = right;
  }
  for (size_t t = 0; t < d->triangles; t++) {
    if (gone[t]) continue;
    if (kept != t) memcpy(d->corners + 3 * kept, d->corners + 3 * t, 3 * sizeof *d->corners);
    for (size_t k = 0; k < 3; k++) stack[3 * t + k] = (uint32_t)(3 * kept + k); /* the new number of a half-edge */
    for (size_t k = 0; k < 3; k++) d->twin[3 * kept + k] = d->twin[3 * t + k];
    kept++;
  }
  d->triangles = kept;
  for (size_t h = 0; h < 3 * kept; h++)
    if (d->twin[h] != MESH_NONE) d->twin[h] = stack[d->twin[h]];
  find_leaving(d);
  st = find_rim(ctx, d);

done:
  batten_free(ctx, gone);
  batten_free(ctx, stack);
  return st;
}
