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

typedef struct peeling {
  uint32_t *stack; /* [3 F]: each half-edge comes to the rim once */
  uint32_t *taken; /* [F] half-edges at which triangles of the pocket went */
  uint32_t *apexes;
  unsigned char *gone; /* [F] */
} peeling;

/* Takes the triangle of the rim's half-edge h: start -> apex -> end are on the rim in its place. */
static void take_off(convex_disc *d, uint32_t h, uint32_t *left, uint32_t *right) {
  *right = d->twin[mesh_next(h)];
  *left = d->twin[mesh_previous(h)];
  d->twin[*right] = d->twin[*left] = MESH_NONE;
  d->leaving[d->corners[*left]] = *left;
  d->leaving[d->corners[mesh_previous(h)]] = *right;
}

static void put_back(convex_disc *d, uint32_t h) {
  uint32_t right = d->twin[mesh_next(h)], left = d->twin[mesh_previous(h)]; /* the triangle still knows them */
  d->twin[right] = mesh_next(h);
  d->twin[left] = mesh_previous(h);
  d->leaving[d->corners[left]] = h;
  d->leaving[d->corners[right]] = right; /* the apex: inside again */
}

static void peel_pocket(convex_disc *d, const convex_peel *peel, uint32_t from, peeling *p) {
  size_t height = 0, count = 0;
  uint32_t a = d->corners[from], b = d->corners[mesh_next(from)];
  p->stack[height++] = from;
  while (height > 0) {
    uint32_t h = p->stack[--height], apex = d->corners[mesh_previous(h)];
    if (convex_disc_is_rim(d, apex) || !peel->take(peel->arg, d, h)) continue;
    p->taken[count] = h;
    p->apexes[count++] = apex;
    take_off(d, h, p->stack + height, p->stack + height + 1);
    height += 2;
  }
  if (count == 0) return;
  bool agreed = !peel->confirm || peel->confirm(peel->arg, a, b, count, p->apexes);
  while (count-- > 0) {
    p->gone[p->taken[count] / 3] = agreed;
    if (!agreed) put_back(d, p->taken[count]);
  }
}

/* Numbers the triangles that are left anew. name [3 F] is scratch. */
static void close_ranks(convex_disc *d, const unsigned char *gone, uint32_t *name) {
  size_t kept = 0;
  for (size_t t = 0; t < d->triangles; t++) {
    if (gone[t]) continue;
    for (size_t k = 0; k < 3; k++) {
      name[3 * t + k] = (uint32_t)(3 * kept + k);
      d->corners[3 * kept + k] = d->corners[3 * t + k];
      d->twin[3 * kept + k] = d->twin[3 * t + k];
    }
    kept++;
  }
  d->triangles = kept;
  for (size_t h = 0; h < 3 * kept; h++)
    if (d->twin[h] != MESH_NONE) d->twin[h] = name[d->twin[h]];
}

batten_status convex_disc_peel(batten_context *ctx, convex_disc *d, const convex_peel *peel) {
  peeling p = {0};
  p.stack = batten_alloc_array(ctx, 3 * d->triangles, sizeof *p.stack);
  p.taken = p.stack ? batten_alloc_array(ctx, d->triangles, sizeof *p.taken) : NULL;
  p.apexes = p.taken ? batten_alloc_array(ctx, d->triangles, sizeof *p.apexes) : NULL;
  p.gone = p.apexes ? batten_alloc_array(ctx, d->triangles, 1) : NULL;
  batten_status st = p.gone ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    memset(p.gone, 0, d->triangles);
    for (size_t i = 0; i < d->rim_count; i++) peel_pocket(d, peel, d->leaving[d->rim[i]], &p);
    close_ranks(d, p.gone, p.stack);
    find_leaving(d);
    st = find_rim(ctx, d);
  }
  batten_free(ctx, p.gone);
  batten_free(ctx, p.apexes);
  batten_free(ctx, p.taken);
  batten_free(ctx, p.stack);
  return st;
}
