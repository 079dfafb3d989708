/* Curves for the tests: random ones of any degree and knots, and their values by the recursion of Cox and de Boor,
 * which shares nothing with the library. */
#ifndef CURVE_CASE_H
#define CURVE_CASE_H

#include <batten/curve.h>

#include "tap.h"

enum { CASE_POINTS = 64, CASE_KNOTS = CASE_POINTS + 10 };

typedef struct curve_case {
  unsigned degree;
  size_t knot_count;
  double knots[CASE_KNOTS], control[CASE_POINTS][2];
  int closed;
} curve_case;

static inline size_t curve_case_count(const curve_case *c) { return c->knot_count - c->degree - 1; }

static inline batten_curve_form curve_case_form(const curve_case *c) {
  return (batten_curve_form){c->degree, c->knot_count, c->knots, c->control[0], c->closed};
}

static inline batten_curve *curve_case_make(batten_context *ctx, const curve_case *c) {
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st < 0) t_line(false, "create: %s", batten_error(ctx));
  return curve;
}

/* Inner knots at random places, each up to `fold` (<= degree) times; points in the square of side 2. */
static inline curve_case curve_case_random(uint64_t *state, unsigned degree, size_t breaks, unsigned fold, int closed,
                                           double lower, double upper) {
  curve_case c = {.degree = degree, .closed = closed};
  double at = 0, all = 0, step[CASE_KNOTS];
  for (size_t s = 0; s <= breaks; s++) all += step[s] = 0.05 + t_uniform(state);
  for (unsigned k = 0; k <= degree; k++) c.knots[c.knot_count++] = lower;
  for (size_t s = 0; s < breaks; s++) {
    at += step[s] / all;
    unsigned times = 1 + (unsigned)(t_random(state) % fold);
    for (unsigned k = 0; k < times; k++) c.knots[c.knot_count++] = lower + (upper - lower) * at;
  }
  for (unsigned k = 0; k <= degree; k++) c.knots[c.knot_count++] = upper;
  size_t n = curve_case_count(&c);
  for (size_t i = 0; i < n; i++)
    for (int x = 0; x < 2; x++) c.control[i][x] = 2 * t_uniform(state) - 1;
  if (closed) memcpy(c.control[n - 1], c.control[0], sizeof c.control[0]);
  return c;
}

/* N_j of a degree at t in [u_mu, u_mu+1). */
static inline long double curve_case_basis(const double *knots, size_t mu, size_t j, unsigned degree, double t) {
  if (degree == 0) return j == mu;
  long double sum = 0, width = (long double)knots[j + degree] - knots[j];
  if (width > 0) sum += ((long double)t - knots[j]) / width * curve_case_basis(knots, mu, j, degree - 1, t);
  width = (long double)knots[j + degree + 1] - knots[j + 1];
  if (width > 0)
    sum += ((long double)knots[j + degree + 1] - t) / width * curve_case_basis(knots, mu, j + 1, degree - 1, t);
  return sum;
}

/* The order-th derivative of N_j. */
static inline long double curve_case_slope(const double *knots, size_t mu, size_t j, unsigned degree, unsigned order,
                                           double t) {
  if (order == 0) return curve_case_basis(knots, mu, j, degree, t);
  if (degree == 0) return 0;
  long double sum = 0, width = (long double)knots[j + degree] - knots[j];
  if (width > 0) sum += degree / width * curve_case_slope(knots, mu, j, degree - 1, order - 1, t);
  width = (long double)knots[j + degree + 1] - knots[j + 1];
  if (width > 0) sum -= degree / width * curve_case_slope(knots, mu, j + 1, degree - 1, order - 1, t);
  return sum;
}

/* Derivative at t of a form; at the end from the left. scale: the sum of the terms' sizes. */
static inline void curve_case_value(const batten_curve_form *f, unsigned order, double t, double out[2],
                                    double *scale) {
  size_t n = f->knot_count - f->degree - 1, mu = f->degree;
  while (mu + 1 < n && f->knots[mu + 1] <= t) mu++;
  while (f->knots[mu] == f->knots[mu + 1]) mu--;
  long double sum[2] = {0, 0}, size = 0;
  for (size_t j = mu - f->degree; j <= mu; j++) {
    long double value = curve_case_slope(f->knots, mu, j, f->degree, order, t);
    for (size_t x = 0; x < 2; x++) {
      sum[x] += value * f->control_points[2 * j + x];
      size += fabsl(value * f->control_points[2 * j + x]);
    }
  }
  for (int x = 0; x < 2; x++) out[x] = (double)sum[x];
  if (scale) *scale = (double)size;
}

#endif
