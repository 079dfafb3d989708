/* Measures of a curve: area and turn span by span, integrals by length, extremes (extremes.c).
 *
 * The tangent's turn is exact: a span is halved until the Bezier points of x' of a part lie in a half plane around 0;
 * there x' turns by less than pi, and by as much as from the first of them to the last. */
#include "curve_inner.h"

#include "base/checked.h"
#include "basis/refine.h"

#include <float.h>
#include <string.h>

/* ---- area ---------------------------------------------------------------------------------------- */

static double binomial(unsigned n, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i; /* whole numbers */
  return value;
}

/* Half the integral of [x, x'] by u: that of a product of Bernstein polynomials of degree d and d - 1. */
static double piece_area(const curve_piece *piece) {
  unsigned d = piece->degree;
  double sum = 0;
  for (unsigned i = 0; i <= d; i++)
    for (unsigned j = 0; j < d; j++) {
      const double *p = piece->point[i], *q = piece->first[j];
      double weight = binomial(d, i) * binomial(d - 1, j) / binomial(2 * d - 1, i + j);
      sum += weight * (p[0] * q[1] - p[1] * q[0]);
    }
  return 0.5 * sum / (2 * d);
}

/* ---- turn ---------------------------------------------------------------------------------------- */

enum { DEPTH = 50 };

static double dot(const double a[2], const double b[2]) { return a[0] * b[0] + a[1] * b[1]; }

static double angle(const double from[2], const double to[2]) {
  return atan2(from[0] * to[1] - from[1] * to[0], dot(from, to));
}

typedef struct turning {
  curve_sum sum;
  bool begun;
  double first[2], last[2]; /* directions so far */
} turning;

static void turn_to(turning *t, const double direction[2]) {
  if (t->begun)
    curve_sum_add(&t->sum, angle(t->last, direction));
  else
    memcpy(t->first, direction, sizeof t->first);
  t->begun = true;
  memcpy(t->last, direction, sizeof t->last);
}

/* Adds the part with these Bezier points; false when they are not in a half plane, and must not be taken anyway.
 * Those below the noise have no direction. */
static bool turn_along(turning *t, unsigned n, const double (*net)[2], double noise, bool anyway) {
  unsigned first = 0, last = n;
  while (first <= n && hypot(net[first][0], net[first][1]) <= noise) first++;
  if (first > n) return true;
  while (hypot(net[last][0], net[last][1]) <= noise) last--;
  double a = hypot(net[first][0], net[first][1]), b = hypot(net[last][0], net[last][1]);
  double middle[2] = {net[first][0] / a + net[last][0] / b, net[first][1] / a + net[last][1] / b};
  bool together = dot(middle, net[first]) > 0 && dot(middle, net[last]) > 0;
  for (unsigned i = first; i <= last; i++) together = together && dot(middle, net[i]) >= 0;
  if (!together && !anyway) return false;
  turn_to(t, net[first]);
  turn_to(t, net[last]);
  return true;
}

static void piece_turn(const curve_piece *piece, turning *t) {
  unsigned n = piece->degree - 1, depth = 0;
  double index = 0, most = 0; /* the part [index, index + 1] / 2^depth is the next */
  for (unsigned i = 0; i <= n; i++) most = fmax(most, fmax(fabs(piece->first[i][0]), fabs(piece->first[i][1])));
  for (;;) {
    double width = ldexp(1, -(int)depth), net[BSPLINE_ORDER][2];
    memcpy(net, piece->first, (n + 1) * sizeof *net);
    curve_restrict(n, 2, index * width, (index + 1) * width, net[0]);
    if (!turn_along(t, n, (const double(*)[2])net, 4 * DBL_EPSILON * most, depth == DEPTH)) {
      depth++;
      index *= 2;
      continue;
    }
    index += 1;
    for (; depth > 0 && fmod(index, 2) == 0; depth--) index *= 0.5;
    if (depth == 0) return;
  }
}

/* ---- integrals by length ------------------------------------------------------------------------- */

static void moments(const curve_piece *piece, double u, double *out) {
  double point[2];
  curve_speed(piece, u, out);
  curve_net_at(piece->degree, (const double(*)[2])piece->point, u, point);
  for (int x = 0; x < 2; x++) out[1 + x] = out[0] * point[x];
}

static void bending(const curve_piece *piece, double u, double *out) {
  double first[2], second[2] = {0, 0};
  curve_speed(piece, u, out);
  if (piece->degree < 2 || !(out[0] > 0)) return;
  curve_net_at(piece->degree - 1, (const double(*)[2])piece->first, u, first);
  curve_net_at(piece->degree - 2, (const double(*)[2])piece->second, u, second);
  const double tangent[2] = {first[0] / out[0], first[1] / out[0]};
  double curvature = curve_curvature(tangent, out[0], second);
  out[1] = curvature * curvature * out[0];
}

static void add_integrals(const curve_piece *piece, curve_integrand *integrand, curve_sum sums[CURVE_INTEGRALS]) {
  curve_walk walk;
  double from, to, integrals[CURVE_INTEGRALS];
  curve_sum own[CURVE_INTEGRALS] = {{0, 0}}; /* as in length.c: the length has the same bits */
  curve_walk_start(&walk, piece, integrand, 0, 1);
  while (curve_walk_next(&walk, &from, &to, integrals))
    for (int k = 0; k < CURVE_INTEGRALS; k++) curve_sum_add(&own[k], integrals[k]);
  for (int k = 0; k < CURVE_INTEGRALS; k++) curve_sum_add(&sums[k], curve_sum_get(&own[k]));
}

/* ---- the whole ----------------------------------------------------------------------------------- */

static void set_integrals(const batten_curve *curve, batten_curve_measures *m) {
  const bspline *b = &curve->space;
  double middle[2];
  curve_sum area = {0, 0}, by_length[CURVE_INTEGRALS] = {{0, 0}}, bend[CURVE_INTEGRALS] = {{0, 0}};
  turning turn = {.begun = false};
  curve_find_middle(curve, middle);
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    curve_piece piece;
    curve_piece_make(curve, mu, middle, &piece);
    if (curve->closed) curve_sum_add(&area, piece_area(&piece));
    piece_turn(&piece, &turn);
    add_integrals(&piece, moments, by_length);
    add_integrals(&piece, bending, bend);
  }
  if (curve->closed && turn.begun) turn_to(&turn, turn.first);
  double length = curve_whole_length(curve);
  m->length = ldexp(length, -curve->exponent);
  m->area = ldexp(curve_sum_get(&area), -2 * curve->exponent);
  m->turn = curve_sum_get(&turn.sum);
  m->energy = ldexp(curve_sum_get(&bend[1]), curve->exponent);
  for (int x = 0; x < 2; x++) {
    double moment = curve_sum_get(&by_length[1 + x]), weight = curve_sum_get(&by_length[0]);
    m->centroid[x] = weight > 0 ? middle[x] + ldexp(moment / weight, -curve->exponent) : curve->control_points[x];
  }
}

batten_status batten_curve_measure(batten_context *ctx, const batten_curve *curve, batten_curve_measures *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!curve || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for its measures",
                       curve ? "out" : "curve");
  batten_curve_measures m = {0};
  double curvature[2], at[2], *inflections = NULL;
  batten_status st = batten_curve_inflections(ctx, curve, &m.inflections, &inflections);
  batten_free(ctx, inflections);
  if (st < 0) return st;
  set_integrals(curve, &m);
  curve_find_box(curve, m.lower, m.upper);
  curve_find_curvatures(curve, curvature, at);
  m.curvature_min = curvature[0];
  m.curvature_max = curvature[1];
  m.curvature_min_at = at[0];
  m.curvature_max_at = at[1];
  *out = m;
  return BATTEN_OK;
}
