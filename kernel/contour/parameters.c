/* Parameters of points in order: steps between neighbours, added up.
 *
 * Chord: d_i = |p_(i+1) - p_i|. Centripetal: their square roots [Lee 1989: Choosing nodes in parametric curve
 * interpolation]. Foley [Foley, Nielson 1989: Knot selection for parametric spline interpolation; Hoschek, Lasser
 * 1993, section 4.4]:
 *   d_i (1 + 3/2 a_i d_(i-1) / (d_(i-1) + d_i) + 3/2 a_(i+1) d_(i+1) / (d_i + d_(i+1))),   a = min(turn, pi / 2),
 * turn being the angle by which the polygon turns at a point; a term whose neighbour is missing is left out. Foley
 * and Nielson measure d and the turn in a metric of the points' covariance, which makes the steps invariant under
 * affine maps but has no value for points on a line, and mostly noise near one. Here distances are Euclid's: what
 * contours need is invariance under similarities.
 *
 * Points that repeat their neighbour are one point of the polygon. Steps are added up in two doubles, so that the
 * parameters of reversed points are those of the points from the other end, to rounding; points are scaled by a power
 * of two first, so that theirs have the same bits whatever power of two scales them. */
#include "contour_inner.h"

#include "base/checked.h"

/* A polygon without repeated points: side i goes from corner i to corner i + 1. */
typedef struct polygon {
  size_t sides;
  bool closed;
  const double *points; /* of the caller */
  double scale;
  size_t *corners; /* [sides + 1] numbers of points; closed: the last one is 0, or equals the first point */
} polygon;

static void side_vector(const polygon *g, size_t i, double v[2]) {
  const double *a = g->points + 2 * g->corners[i], *b = g->points + 2 * g->corners[i + 1];
  for (int k = 0; k < 2; k++) v[k] = g->scale * b[k] - g->scale * a[k];
}

static double side_length(const polygon *g, size_t i) {
  double v[2];
  side_vector(g, i, v);
  return hypot(v[0], v[1]);
}

/* What side i gains by the turn between it and its neighbour j, in parts of its length. */
static double foley_gain(const polygon *g, size_t i, size_t j) {
  double v[2], w[2], own = side_length(g, i), other = side_length(g, j);
  side_vector(g, i, v);
  side_vector(g, j, w);
  for (int k = 0; k < 2; k++) {
    v[k] /= own;
    w[k] /= other;
  }
  double turn = atan2(fabs(contour_cross(v, w)), v[0] * w[0] + v[1] * w[1]);
  return 1.5 * fmin(turn, acos(0)) * (other / (own + other));
}

static double side_step(const polygon *g, batten_contour_parametrization method, size_t i) {
  if (method == BATTEN_CONTOUR_UNIFORM) return 1;
  double length = side_length(g, i);
  if (method == BATTEN_CONTOUR_CHORD) return length;
  if (method == BATTEN_CONTOUR_CENTRIPETAL) return sqrt(length);
  double factor = 1, before = 0, after = 0;
  if (i > 0 || g->closed) before = foley_gain(g, i, i > 0 ? i - 1 : g->sides - 1);
  if (i + 1 < g->sides || g->closed) after = foley_gain(g, i, i + 1 < g->sides ? i + 1 : 0);
  factor += before + after;
  return length * factor;
}

/* Whether points i and j are one corner, scaled. */
static bool same_corner(const polygon *g, size_t i, size_t j) {
  const double *p = g->points + 2 * i, *q = g->points + 2 * j;
  return g->scale * p[0] == g->scale * q[0] && g->scale * p[1] == g->scale * q[1];
}

static void find_corners(polygon *g, size_t count) {
  size_t n = 1;
  g->corners[0] = 0;
  for (size_t i = 1; i < count; i++)
    if (!same_corner(g, i, i - 1)) g->corners[n++] = i;
  if (n > 1 && g->closed && !same_corner(g, g->corners[n - 1], 0)) g->corners[n++] = 0;
  g->sides = n - 1;
}

static batten_status check(batten_context *ctx, size_t count, const double *points,
                           batten_contour_parametrization method, const double *parameters) {
  if (count < 2) return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu points; parameters need 2 at least", count);
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][2] numbers", count);
  if (!parameters) return batten_fail(ctx, BATTEN_E_INVALID, "parameters: NULL; give room for %zu numbers", count);
  if (count > SIZE_MAX / 4 / sizeof(double))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points are more than memory can have", count);
  if ((int)method < BATTEN_CONTOUR_CHORD || (int)method > BATTEN_CONTOUR_FOLEY)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "method: %d; give BATTEN_CONTOUR_CHORD, _CENTRIPETAL, _UNIFORM or _FOLEY", (int)method);
  size_t bad = batten_first_nonfinite(2 * count, points);
  if (bad < 2 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite points", bad / 2, bad % 2,
                       points[bad]);
  return BATTEN_OK;
}

/* Sums of steps, over their total. All corners but the last of a closed polygon are points in order, and each point
 * belongs to the corner at or before it. */
static void add_up(const polygon *g, batten_contour_parametrization method, size_t count, double *parameters) {
  double high = 0, low = 0; /* the sum is high + low */
  size_t at = 0;            /* next point */
  for (size_t i = 0; i < g->sides; i++) {
    size_t next = g->corners[i + 1] > 0 ? g->corners[i + 1] : count;
    while (at < next) parameters[at++] = high + low;
    double step = side_step(g, method, i), sum = high + step, part = sum - high;
    low += (high - (sum - part)) + (step - part);
    high = sum;
  }
  double total = high + low;
  for (size_t i = 0; i < at; i++) parameters[i] = fmin(parameters[i] / total, 1);
  while (at < count) parameters[at++] = 1;
}

batten_status batten_contour_parametrize(batten_context *ctx, size_t count, const double *points,
                                         batten_contour_parametrization method, int closed, double *parameters) {
  batten_status st = check(ctx, count, points, method, parameters);
  if (st < 0) return st;
  double largest = 0;
  for (size_t i = 0; i < 2 * count; i++) largest = fmax(largest, fabs(points[i]));
  size_t *corners = batten_alloc_array(ctx, count + 1, sizeof *corners);
  if (!corners) return BATTEN_E_NOMEM;
  polygon g = {0, closed != 0, points, largest > 0 ? batten_unit(largest) / 4 : 1, corners};
  find_corners(&g, count);
  if (g.sides == 0)
    st = batten_fail(ctx, BATTEN_E_INVALID, "points: all %zu are equal; give two different ones at least", count);
  else
    add_up(&g, method, count, parameters);
  batten_free(ctx, corners);
  return st;
}
