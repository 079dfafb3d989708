/* Delaunay in the best plane fills the convex hull. What is none of the data's is taken off its rim: triangles that
 * are flat to rounding, so that points on a straight side all are on the rim; and pockets of long edges, where an
 * outline goes inwards. Pockets must be deep: along the side of a rectangle of random points the hull has few of
 * them, and the rest are rightly inside. */
#include "cloud.h"

#include <math.h>

#include "mesh/delaunay.h"

/* Rim edges more than so many times as long as what is usual at both ends have a pocket behind them, which is a gap
 * where it is also so much deeper. */
static const double GAP_FACTOR = 4;

/* Triangles that are lower than this many roundings of the coordinates have their third point on the rim. 64: the
 * plane adds some 20 to those of the points. */
static const double FLAT_ROUNDINGS = 64;

typedef struct rim_rule {
  const double *flat;
  const double *usual; /* [points] distance to others */
  double height;
} rim_rule;

static double flat_distance(const double *flat, uint32_t a, uint32_t b) {
  const double *p = flat + 2 * (size_t)a, *q = flat + 2 * (size_t)b;
  return hypot(q[0] - p[0], q[1] - p[1]);
}

/* Of c from the line through a and b, to the left positive. */
static double flat_height(const double *flat, uint32_t a, uint32_t b, uint32_t c) {
  const double *p = flat + 2 * (size_t)a, *q = flat + 2 * (size_t)b, *r = flat + 2 * (size_t)c;
  return ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / flat_distance(flat, a, b);
}

static bool is_flat(const void *arg, const convex_disc *disc, uint32_t h) {
  const rim_rule *rule = arg;
  uint32_t a = disc->corners[h], b = disc->corners[mesh_next(h)], c = disc->corners[mesh_previous(h)];
  return flat_height(rule->flat, a, b, c) <= rule->height;
}

static bool is_wide(const void *arg, const convex_disc *disc, uint32_t h) {
  const rim_rule *rule = arg;
  uint32_t a = disc->corners[h], b = disc->corners[mesh_next(h)];
  return flat_distance(rule->flat, a, b) > GAP_FACTOR * fmax(rule->usual[a], rule->usual[b]);
}

static bool is_deep(const void *arg, uint32_t a, uint32_t b, size_t count, const uint32_t *apexes) {
  const rim_rule *rule = arg;
  for (size_t i = 0; i < count; i++)
    if (flat_height(rule->flat, a, b, apexes[i]) > GAP_FACTOR * rule->usual[apexes[i]]) return true;
  return false;
}

typedef struct nearest {
  double length[3]; /* of the shortest edges, INFINITY where there are fewer */
  uint32_t point[3];
} nearest;

static void add_near(nearest *n, double length, uint32_t point) {
  for (int k = 0; k < 3; k++) {
    if (!(length < n->length[k])) continue;
    double t = n->length[k];
    uint32_t p = n->point[k];
    n->length[k] = length;
    n->point[k] = point;
    length = t;
    point = p;
  }
}

static nearest find_near(const convex_disc *disc, const double *flat, uint32_t i) {
  nearest n = {{INFINITY, INFINITY, INFINITY}, {i, i, i}};
  uint32_t h = disc->leaving[i];
  while (h != MESH_NONE) {
    uint32_t to = disc->corners[mesh_next(h)], back = disc->corners[mesh_previous(h)];
    add_near(&n, flat_distance(flat, i, to), to);
    h = convex_disc_turn(disc, h);
    if (h == MESH_NONE) add_near(&n, flat_distance(flat, i, back), back); /* the last of a fan at the rim */
    if (h == disc->leaving[i]) break;
  }
  return n;
}

/* third [points]: third shortest edge, of an ear the second; usual [points]: the least of that at a point and at the
 * two nearest to it: the tip of a corner has long edges across a gap itself. */
static void find_usual(const convex_disc *disc, const double *flat, double *third, double *usual) {
  for (uint32_t i = 0; i < disc->points; i++) {
    nearest n = find_near(disc, flat, i);
    third[i] = isfinite(n.length[2]) ? n.length[2] : n.length[1];
  }
  for (uint32_t i = 0; i < disc->points; i++) {
    nearest n = find_near(disc, flat, i);
    usual[i] = fmin(third[i], fmin(third[n.point[0]], third[n.point[1]]));
  }
}

static batten_status peel_rim(batten_context *ctx, const double *flat, double rounding, convex_disc *disc) {
  double *third = batten_alloc_array(ctx, disc->points, sizeof *third);
  double *usual = third ? batten_alloc_array(ctx, disc->points, sizeof *usual) : NULL;
  rim_rule rule = {flat, usual, FLAT_ROUNDINGS * rounding};
  batten_status st = usual ? convex_disc_peel(ctx, disc, &(convex_peel){&rule, is_flat, NULL}) : BATTEN_E_NOMEM;
  if (st >= 0) {
    find_usual(disc, flat, third, usual);
    st = convex_disc_peel(ctx, disc, &(convex_peel){&rule, is_wide, is_deep});
  }
  batten_free(ctx, usual);
  batten_free(ctx, third);
  return st;
}

batten_status convex_cloud_triangulate(batten_context *ctx, size_t count, const double *points,
                                       const convex_scale *scale, uint32_t *first, convex_disc *disc) {
  double size[2], axes[2][3];
  uint32_t *triangles = NULL;
  size_t triangle_count = 0;
  double *flat = batten_alloc_array(ctx, count, 2 * sizeof *flat);
  batten_status st = flat ? convex_plane_project(ctx, count, points, NULL, scale, flat, size, axes) : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_mesh_delaunay(ctx, count, flat, first, &triangle_count, &triangles);
  if (st >= 0) st = convex_disc_new(ctx, count, first, triangle_count, triangles, disc);
  if (st >= 0) st = peel_rim(ctx, flat, scale->rounding, disc);
  batten_free(ctx, triangles);
  batten_free(ctx, flat);
  return st;
}
