/* The judge of quadratic programs in tests and benchmarks: residuals, gap and proofs of a claimed result, in long
 * double and plain loops. Shares nothing with the library. */
#ifndef QP_CHECK_H
#define QP_CHECK_H

#include <batten/qp.h>

#include "qp_scenes.h"

/* Each with the size that it is to be seen against, from the same data. */
typedef struct qp_verdict {
  double primal, primal_scale;
  double dual, dual_scale;
  double gap, gap_scale;
  double objective;
} qp_verdict;

static inline long double qp_check_weight(const batten_qp_problem *p, size_t i) {
  return p->weights ? p->weights[i] : 1;
}
static inline double qp_check_side(const double *sides, size_t i, double none) { return sides ? sides[i] : none; }

/* One constraint: violation, and its part of sum y side. */
static inline void qp_check_constraint(double lower, double upper, long double value, double y, qp_verdict *v,
                                       long double *sides) {
  double violation = (double)fmaxl(lower - value, value - upper);
  v->primal = isnan(violation) ? INFINITY : fmax(v->primal, violation);
  if (lower > -INFINITY || upper < INFINITY) v->primal_scale = fmax(v->primal_scale, (double)fabsl(value));
  double side = y > 0 ? lower : upper;
  if (y == 0) return;
  if (isinf(side))
    v->dual = fmax(v->dual, fabs(y)); /* a multiplier of nothing */
  else
    *sides += (long double)y * side;
}

static inline qp_verdict qp_check(const batten_qp_problem *p, const double *x, const double *y) {
  size_t n = p->n, m = p->c ? p->c->rows : 0;
  qp_verdict v = {0};
  long double *px = calloc(3 * n + 1, sizeof *px), *q = px + n, *pull = q + n;
  long double square = 0, linear = 0, sides = 0, objective = p->constant;
  for (size_t j = 0; j < n && p->g; j++) q[j] = p->g[j];
  for (size_t i = 0; p->a && i < p->a->rows; i++) {
    long double ax = qp_scene_dot(p->a, i, x), b = qp_check_side(p->b, i, 0), w = qp_check_weight(p, i);
    qp_scene_add(p->a, i, w * ax, px);
    qp_scene_add(p->a, i, -w * b, q);
    objective += w * b * b / 2;
  }
  for (size_t i = 0; p->h && i < n; i++) px[i] += qp_scene_dot(p->h, i, x);
  for (size_t j = 0; j < n; j++) {
    square += px[j] * x[j];
    linear += q[j] * x[j];
  }
  for (size_t i = 0; i < m; i++) {
    qp_check_constraint(qp_check_side(p->lower, i, -INFINITY), qp_check_side(p->upper, i, INFINITY),
                        qp_scene_dot(p->c, i, x), y[i], &v, &sides);
    if (y[i] != 0) qp_scene_add(p->c, i, y[i], pull);
  }
  for (size_t j = 0; j < n; j++) {
    qp_check_constraint(qp_check_side(p->x_lower, j, -INFINITY), qp_check_side(p->x_upper, j, INFINITY), x[j],
                        y[m + j], &v, &sides);
    pull[j] += y[m + j];
    double miss = (double)fabsl(px[j] + q[j] - pull[j]);
    v.dual = isnan(miss) ? INFINITY : fmax(v.dual, miss);
    v.dual_scale = fmax(v.dual_scale, (double)fmaxl(fabsl(px[j]), fmaxl(fabsl(q[j]), fabsl(pull[j]))));
  }
  v.objective = (double)(objective + square / 2 + linear);
  v.gap = (double)fabsl(square + linear - sides);
  v.gap_scale = (double)fmaxl(fmaxl(fabsl(square), fabsl(linear)), fabsl(sides));
  free(px);
  return v;
}

/* Whether all three are within `tolerance` of their scales; scales that vanish count as `least`. */
static inline bool qp_check_within(const qp_verdict *v, double tolerance, double least) {
  return v->primal <= tolerance * fmax(v->primal_scale, least) && v->dual <= tolerance * fmax(v->dual_scale, least) &&
         v->gap <= tolerance * fmax(v->gap_scale, least);
}

/* How far y is from a proof that no x exists: |C'y_rows + y_bounds| over the sizes of its terms, or INFINITY when the
 * sum of y times sides is not 1. */
static inline double qp_check_infeasible(const batten_qp_problem *p, const double *y) {
  size_t n = p->n, m = p->c ? p->c->rows : 0;
  long double *sum = calloc(2 * n + 1, sizeof *sum), *size = sum + n, sides = 0;
  double worst = 0;
  for (size_t i = 0; i < m + n; i++) {
    if (y[i] == 0) continue;
    const double *of = i < m ? (y[i] > 0 ? p->lower : p->upper) : y[i] > 0 ? p->x_lower : p->x_upper;
    double side = of ? of[i < m ? i : i - m] : INFINITY;
    sides += isinf(side) ? NAN : (long double)y[i] * side;
    if (i >= m) {
      sum[i - m] += y[i];
      size[i - m] += fabs(y[i]);
    } else {
      qp_scene_add(p->c, i, y[i], sum);
      for (size_t j = 0; p->c->dense && j < n; j++) size[j] += fabs(y[i] * p->c->dense[i * n + j]);
      for (size_t e = p->c->dense ? 0 : p->c->starts[i]; !p->c->dense && e < p->c->starts[i + 1]; e++)
        size[p->c->indices[e]] += fabs(y[i] * p->c->values[e]);
    }
  }
  for (size_t j = 0; j < n; j++)
    if (sum[j] != 0) worst = fmax(worst, (double)(fabsl(sum[j]) / size[j]));
  free(sum);
  return fabsl(sides - 1) <= 1e-9L ? worst : INFINITY;
}

/* How far d is from a proof of unboundedness: the largest of |P d|, of a row's fall towards a side, and of |q'd + 1|,
 * each over the sizes of their terms where these are not 1 already. */
static inline double qp_check_unbounded(const batten_qp_problem *p, const double *d) {
  size_t n = p->n, m = p->c ? p->c->rows : 0;
  double worst = 0, size = 0;
  long double slope = 0;
  for (size_t j = 0; j < n; j++) {
    size = fmax(size, fabs(d[j]));
    if (p->g) slope += (long double)p->g[j] * d[j];
    if (p->x_lower && isfinite(p->x_lower[j])) worst = fmax(worst, -d[j]);
    if (p->x_upper && isfinite(p->x_upper[j])) worst = fmax(worst, d[j]);
    if (p->h) worst = fmax(worst, (double)fabsl(qp_scene_dot(p->h, j, d)));
  }
  for (size_t i = 0; p->a && i < p->a->rows; i++) {
    long double ad = qp_scene_dot(p->a, i, d);
    worst = fmax(worst, (double)fabsl(ad));
    slope -= qp_check_weight(p, i) * (long double)qp_check_side(p->b, i, 0) * ad;
  }
  for (size_t i = 0; i < m; i++) {
    double along = (double)qp_scene_dot(p->c, i, d);
    if (p->lower && isfinite(p->lower[i])) worst = fmax(worst, -along);
    if (p->upper && isfinite(p->upper[i])) worst = fmax(worst, along);
  }
  return fmax(worst / fmax(size, 1), (double)fabsl(slope + 1));
}

static const batten_qp_engine qp_engines[4] = {BATTEN_QP_AUTO, BATTEN_QP_PRIMAL, BATTEN_QP_DUAL, BATTEN_QP_INTERIOR};
static const char *const qp_engine_names[4] = {"auto", "primal", "dual", "interior"};

#endif
