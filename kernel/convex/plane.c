/* The plane of the first two principal axes through the mean, and the rectangle of least area around the points
 * there.
 *
 * One side of the least rectangle lies on an edge of the convex hull [Freeman, Shapira 1975], so a pair of calipers
 * that turns around the hull finds it [Toussaint 1983].
 *
 * Rectangles of equal area are common (a square turned by a quarter, a grid of hexagons), and rounding must not
 * choose among them. So which rectangle, and which of its sides is u, is settled by what a reader would expect: u is
 * the direction that points most along the coordinate axis which follows the normal's largest coordinate (x where the
 * normal is nearest to z), and v lies to its left.
 *
 * All sums are in lexicographic order of the points, so that the order in which they come changes no bit; scaling by
 * a power of two changes none either. */
#include "plane.h"

#include <float.h>
#include <stdint.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "basis/sort_points.h"
#include "mesh/predicates.h"
#include "mesh/vec.h"

/* Areas (and cosines) nearer to each other than this part are equal: far above rounding, far below what a user would
 * see. */
static const double AREA_TIE = 1e-9;

batten_status convex_scale_find(batten_context *ctx, size_t count, const double *points, convex_scale *out) {
  size_t bad = batten_first_nonfinite(3 * count, points);
  if (bad < 3 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu]: coordinate %zu is %g; must be finite", bad / 3, bad % 3,
                       points[bad]);
  convex_scale s = {.scale = 1};
  double lower[3], upper[3], largest = 0, extent = 0;
  for (size_t k = 0; k < 3; k++) {
    lower[k] = upper[k] = points[k];
    for (size_t i = 1; i < count; i++) {
      lower[k] = fmin(lower[k], points[3 * i + k]);
      upper[k] = fmax(upper[k], points[3 * i + k]);
    }
    largest = fmax(largest, fmax(fabs(lower[k]), fabs(upper[k])));
  }
  if (largest > 0) s.scale = batten_unit(largest);
  for (int k = 0; k < 3; k++) {
    s.middle[k] = 0.5 * (lower[k] * s.scale + upper[k] * s.scale);
    extent = fmax(extent, upper[k] * s.scale - lower[k] * s.scale);
  }
  if (!(extent > 0))
    return batten_fail(ctx, BATTEN_E_INVALID, "points: all %zu lie at one place; a surface needs three corners",
                       count);
  s.unit = batten_unit(extent);
  s.rounding = DBL_EPSILON * largest * s.scale * s.unit;
  *out = s;
  return BATTEN_OK;
}

void convex_scale_apply(const convex_scale *s, const double *point, double out[3]) {
  for (int k = 0; k < 3; k++) out[k] = (point[k] * s->scale - s->middle[k]) * s->unit;
}

double convex_plane_suits_u(const double normal[3], const double direction[3]) {
  int largest = 0;
  for (int k = 1; k < 3; k++)
    if (fabs(normal[k]) > fabs(normal[largest])) largest = k;
  /* The third axis decides where two sides lie at 45 degrees to the one that counts. */
  return direction[(largest + 1) % 3] + AREA_TIE * direction[(largest + 2) % 3];
}

/* The principal axes: two in the plane, and the normal; a right-handed system. */
typedef struct frame {
  const convex_scale *scale;
  double axis[3][3];
} frame;

/* Principal axes, the normal's largest coordinate positive. */
static void find_axes(size_t count, const double *points, const double *weights, const uint32_t *order, frame *f) {
  double mean[3] = {0}, moment[9] = {0}, values[3], vectors[9], total = 0;
  for (size_t i = 0; i < count; i++) {
    double x[3];
    convex_scale_apply(f->scale, points + 3 * (size_t)order[i], x);
    double weight = weights ? weights[order[i]] : 1;
    total += weight;
    for (int k = 0; k < 3; k++) mean[k] += weight * x[k];
  }
  for (int k = 0; k < 3; k++) mean[k] /= total;
  for (size_t i = 0; i < count; i++) {
    double x[3];
    convex_scale_apply(f->scale, points + 3 * (size_t)order[i], x);
    vec_sub(x, mean, x);
    for (int k = 0; k < 3; k++)
      for (int j = k; j < 3; j++) moment[3 * k + j] += (weights ? weights[order[i]] : 1) * x[k] * x[j];
  }
  batten_eigen_symmetric(3, moment, values, vectors);
  int largest = 0;
  for (int k = 1; k < 3; k++)
    if (fabs(vectors[k]) > fabs(vectors[largest])) largest = k;
  double sign = copysign(1, vectors[largest]);
  for (int k = 0; k < 3; k++) {
    f->axis[2][k] = sign * vectors[k];
    f->axis[0][k] = vectors[6 + k];
  }
  vec_cross(f->axis[2], f->axis[0], f->axis[1]);
}

/* Convex hull, counter-clockwise, no three corners on a line: Andrew's chains over the lexicographic order. hull
 * needs room for 2 count. Returns its number of corners. */
static size_t find_hull(size_t count, const double *flat, const uint32_t *order, uint32_t *hull) {
  size_t size = 0;
  for (int upper = 0; upper < 2; upper++) {
    size_t first = size;
    for (size_t i = 0; i < count; i++) {
      uint32_t next = order[upper ? count - 1 - i : i];
      const double *p = flat + 2 * (size_t)next;
      if (size > first && p[0] == flat[2 * (size_t)hull[size - 1]] && p[1] == flat[2 * (size_t)hull[size - 1] + 1])
        continue;
      while (size > first + 1 &&
             batten_orient2d(flat + 2 * (size_t)hull[size - 2], flat + 2 * (size_t)hull[size - 1], p, 0, 1) <= 0)
        size--;
      hull[size++] = next;
    }
    if (size > first + 1) size--; /* the chain's last is the other one's first */
  }
  return size;
}

typedef struct caliper {
  size_t corners;
  const double *flat;
  const uint32_t *hull;
} caliper;

static const double *corner(const caliper *c, size_t i) { return c->flat + 2 * (size_t)c->hull[i % c->corners]; }

/* The corner furthest along d from corner `start` on, where distance first rises, then falls. */
static size_t climb(const caliper *c, size_t start, const double *d) {
  size_t i = start;
  for (size_t steps = 0; steps < c->corners; steps++) {
    const double *p = corner(c, i), *q = corner(c, i + 1);
    if (!((q[0] - p[0]) * d[0] + (q[1] - p[1]) * d[1] > 0)) break;
    i++;
  }
  return i;
}

static double edge_direction(const caliper *c, size_t edge, double *d) {
  const double *p = corner(c, edge), *q = corner(c, edge + 1);
  double length = hypot(q[0] - p[0], q[1] - p[1]);
  d[0] = (q[0] - p[0]) / length;
  d[1] = (q[1] - p[1]) / length;
  return length;
}

/* area [corners] of the least rectangle with a side along each edge of the hull; returns the least. */
static double turn_calipers(const caliper *c, double *area) {
  double least = INFINITY;
  size_t right = 0, top = 0, left = 0;
  for (size_t edge = 0; edge < c->corners; edge++) {
    double d[2];
    edge_direction(c, edge, d);
    double up[2] = {-d[1], d[0]}, back[2] = {-d[0], -d[1]};
    right = climb(c, right > edge ? right : edge + 1, d);
    top = climb(c, top > right ? top : right, up);
    left = climb(c, left > top ? left : top, back);
    const double *r = corner(c, right), *t = corner(c, top), *l = corner(c, left), *b = corner(c, edge);
    double width = (r[0] - l[0]) * d[0] + (r[1] - l[1]) * d[1];
    double height = (t[0] - b[0]) * up[0] + (t[1] - b[1]) * up[1];
    area[edge] = width * height;
    least = fmin(least, area[edge]);
  }
  return least;
}

/* Of the four directions of the sides of a rectangle along d: u, and how well it suits. */
static double choose_side(const frame *f, const double *d, double *u) {
  double best = -INFINITY, turned[2] = {d[0], d[1]};
  u[0] = d[0];
  u[1] = d[1];
  for (int quarter = 0; quarter < 4; quarter++) {
    double component[3];
    for (int k = 0; k < 3; k++) component[k] = turned[0] * f->axis[0][k] + turned[1] * f->axis[1][k];
    double score = convex_plane_suits_u(f->axis[2], component);
    if (score > best) {
      best = score;
      u[0] = turned[0];
      u[1] = turned[1];
    }
    double x = turned[0];
    turned[0] = -turned[1];
    turned[1] = x;
  }
  return best;
}

/* u: unit direction of the side that is u, of the least rectangle: by the longest edge along it, whose direction is
 * the least rounded. */
static void choose_rectangle(const frame *f, const caliper *c, double *area, double *u) {
  double least = turn_calipers(c, area), best = -INFINITY, longest = 0;
  for (size_t edge = 0; edge < c->corners; edge++) {
    double d[2], side[2];
    if (area[edge] > least * (1 + AREA_TIE)) continue;
    double length = edge_direction(c, edge, d), score = choose_side(f, d, side);
    if (score < best - AREA_TIE || (score < best + AREA_TIE && length <= longest)) continue;
    best = score;
    longest = length;
    u[0] = side[0];
    u[1] = side[1];
  }
}

/* flat: from coordinates along axis[0] and axis[1] to those along the sides, from the lower left corner. */
static void turn_to_sides(size_t count, const double *u, double *flat, double *size) {
  double lower[2] = {INFINITY, INFINITY};
  size[0] = size[1] = 0;
  for (size_t i = 0; i < count; i++) {
    double x = flat[2 * i], y = flat[2 * i + 1];
    flat[2 * i] = x * u[0] + y * u[1];
    flat[2 * i + 1] = y * u[0] - x * u[1];
    for (int k = 0; k < 2; k++) lower[k] = fmin(lower[k], flat[2 * i + (size_t)k]);
  }
  for (size_t i = 0; i < count; i++)
    for (size_t k = 0; k < 2; k++) {
      flat[2 * i + k] -= lower[k];
      size[k] = fmax(size[k], flat[2 * i + k]);
    }
}

batten_status convex_plane_project(batten_context *ctx, size_t count, const double *points, const double *weights,
                                   const convex_scale *scale, double *flat, double size[2], double axes[2][3]) {
  if (count > UINT32_MAX / 2)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; at most %u points have parameters", count,
                       UINT32_MAX / 2);
  frame f = {.scale = scale};
  uint32_t *order = batten_alloc_array(ctx, count, sizeof *order);
  uint32_t *hull = order ? batten_alloc_array(ctx, 2 * count, sizeof *hull) : NULL;
  double *area = NULL, u[2] = {1, 0};
  batten_status st = hull ? batten_sort_points(ctx, 3, count, points, order) : BATTEN_E_NOMEM;
  if (st < 0) goto done;

  find_axes(count, points, weights, order, &f);
  for (size_t i = 0; i < count; i++) {
    double x[3];
    convex_scale_apply(scale, points + 3 * i, x);
    for (size_t k = 0; k < 2; k++) flat[2 * i + k] = vec_dot(x, f.axis[k]);
  }
  st = batten_sort_points(ctx, 2, count, flat, order);
  if (st < 0) goto done;
  caliper c = {find_hull(count, flat, order, hull), flat, hull};
  if (c.corners > 2) {
    area = batten_alloc_array(ctx, c.corners, sizeof *area);
    st = area ? BATTEN_OK : BATTEN_E_NOMEM;
    if (st < 0) goto done;
    choose_rectangle(&f, &c, area, u);
  }
  turn_to_sides(count, u, flat, size);
  double least = fmin(size[0], size[1]);
  /* 16: coordinates are rounded, their differences once more, and a turn adds up six products. */
  if (c.corners < 3 || least <= 16 * scale->rounding) {
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "points: all %zu lie on a line to the rounding of their coordinates; a surface needs points "
                     "beside it",
                     count);
    goto done;
  }
  for (int k = 0; k < 3; k++) {
    axes[0][k] = u[0] * f.axis[0][k] + u[1] * f.axis[1][k];
    axes[1][k] = u[0] * f.axis[1][k] - u[1] * f.axis[0][k];
  }

done:
  batten_free(ctx, area);
  batten_free(ctx, hull);
  batten_free(ctx, order);
  return st;
}
