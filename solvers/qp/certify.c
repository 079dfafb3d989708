/* The judge of quadratic programs: residuals, certificates and rays from the caller's arrays alone.
 *
 * Sums run in twice the working precision [Ogita, Rump, Oishi 2005, Dot2]: each product and each addition keeps its
 * rounding error, by fma() and by Knuth's TwoSum, so that bits are the same with and without FMA units. Rows that a
 * plain sum shows to hold by more than its error bound are not summed again. Nothing here is shared with the engines;
 * judge_sums.c has its loops over rows. See certify.h. */
#include "certify.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "judge_sums.h"

/* Relative size below which a quantity that should vanish, or one that should be positive, is put down to rounding in
 * the data and in the engine: entries may be sums of some thousand products. */
static double rounding(const batten_qp_problem *p) { return (1000 + 8 * (double)p->n) * DBL_EPSILON; }

/* ---- Sums in twice the working precision ---- */

typedef struct exact {
  double hi, lo; /* the sum is hi + lo, lo the gathered rounding errors */
} exact;

static exact plus(exact s, double v) {
  double sum = s.hi + v, part = sum - s.hi;
  s.lo += (s.hi - (sum - part)) + (v - part);
  s.hi = sum;
  return s;
}

static exact plus_product(exact s, double a, double b) {
  double product = a * b;
  s = plus(s, product);
  s.lo += fma(a, b, -product);
  return s;
}

/* s + a * t */
static exact plus_multiple(exact s, double a, exact t) {
  s = plus_product(s, a, t.hi);
  s.lo += a * t.lo;
  return s;
}

static double value_of(exact s) { return s.hi + s.lo; }

static exact normal(exact s) {
  double sum = s.hi + s.lo;
  return (exact){sum, (s.hi - sum) + s.lo};
}

/* ---- Rows of the caller ---- */

typedef struct line {
  size_t count;
  const double *values;
  const uint32_t *columns; /* NULL: all */
} line;

static line line_of(const batten_matrix *m, size_t i) {
  if (m->columns == 0) return (line){0, NULL, NULL}; /* may come without arrays */
  if (m->dense) return (line){m->columns, m->dense + i * m->columns, NULL};
  return (line){m->starts[i + 1] - m->starts[i], m->values + m->starts[i], m->indices + m->starts[i]};
}

static size_t rows_of(const batten_matrix *m) { return m ? m->rows : 0; }

static size_t column_of(const line *l, size_t e) { return l->columns ? l->columns[e] : e; }

static exact dot(const batten_matrix *m, size_t i, const double *x) {
  line l = line_of(m, i);
  exact sum = {0, 0};
  if (l.count > 0) qp_judge_sums_now()->twice(l.count, l.values, l.columns, x, &sum.hi, &sum.lo);
  return sum;
}

/* Plain sum of products, and of their absolute values. */
static double plain_dot(const batten_matrix *m, size_t i, const double *x, double *size) {
  line l = line_of(m, i);
  *size = 0;
  return l.count > 0 ? qp_judge_sums_now()->plain(l.count, l.values, l.columns, x, size) : 0;
}

/* (hi, lo) [n] += factor * row i */
static void add_row(const batten_matrix *m, size_t i, exact factor, double *hi, double *lo) {
  line l = line_of(m, i);
  if (l.count > 0) qp_judge_sums_now()->add(l.count, l.values, l.columns, factor.hi, factor.lo, hi, lo);
}

static double weight(const batten_qp_problem *p, size_t i) { return p->weights ? p->weights[i] : 1; }
static double target(const batten_qp_problem *p, size_t i) { return p->b ? p->b[i] : 0; }

/* Sides of constraint i: rows first, then the bounds of x. */
static double lower_of(const batten_qp_problem *p, size_t i) {
  size_t m = rows_of(p->c);
  const double *side = i < m ? p->lower : p->x_lower;
  return side ? side[i < m ? i : i - m] : -INFINITY;
}
static double upper_of(const batten_qp_problem *p, size_t i) {
  size_t m = rows_of(p->c);
  const double *side = i < m ? p->upper : p->x_upper;
  return side ? side[i < m ? i : i - m] : INFINITY;
}

/* Larger of both, and NaN if there is one: a residual that is not a number must not pass. */
static double larger(double a, double b) { return isnan(a) || a > b ? a : b; }

static double largest(size_t n, const double *v) {
  double most = 0;
  for (size_t j = 0; j < n; j++) most = larger(fabs(v[j]), most);
  return most;
}

/* ---- Residuals ---- */

/* How much the value lies outside of its sides; negative or 0 = inside. */
static double outside(const batten_qp_problem *p, size_t i, exact value) {
  double below = (lower_of(p, i) - value.hi) - value.lo, above = (value.hi - upper_of(p, i)) + value.lo;
  return larger(below, above);
}

static void judge_primal(const batten_qp_problem *p, const double *x, batten_qp_info *info) {
  size_t m = rows_of(p->c);
  info->primal_residual = info->primal_scale = 0;
  for (size_t i = 0; i < m; i++) {
    double size, value = plain_dot(p->c, i, x, &size);
    double error = (double)(p->n + 2) * DBL_EPSILON * size; /* twice the bound of any order of summation */
    info->primal_scale = larger(fabs(value), info->primal_scale);
    if (value - error >= lower_of(p, i) && value + error <= upper_of(p, i)) continue;
    info->primal_residual = larger(outside(p, i, dot(p->c, i, x)), info->primal_residual);
  }
  for (size_t j = 0; j < p->n; j++) {
    if (lower_of(p, m + j) > -INFINITY || upper_of(p, m + j) < INFINITY)
      info->primal_scale = larger(fabs(x[j]), info->primal_scale);
    info->primal_residual = larger(outside(p, m + j, (exact){x[j], 0}), info->primal_residual);
  }
}

/* curvature [n] := A'WA x + H x, linear [n] := g - A'W b, plainly: for their sizes. */
static void plain_parts(const batten_qp_problem *p, const double *x, double *curvature, double *linear) {
  double size;
  for (size_t j = 0; j < p->n; j++) {
    curvature[j] = p->h ? plain_dot(p->h, j, x, &size) : 0;
    linear[j] = p->g ? p->g[j] : 0;
  }
  for (size_t i = 0; i < rows_of(p->a); i++) {
    line l = line_of(p->a, i);
    double w = weight(p, i), along = w * plain_dot(p->a, i, x, &size), from = w * target(p, i);
    for (size_t e = 0; e < l.count; e++) {
      size_t j = column_of(&l, e);
      curvature[j] += along * l.values[e];
      linear[j] -= from * l.values[e];
    }
  }
}

/* (hi, lo) [n] := gradient at x. Returns the objective. */
static double gradient(const batten_qp_problem *p, const double *x, double *hi, double *lo) {
  exact whole = {p->constant, 0};
  for (size_t j = 0; j < p->n; j++) hi[j] = p->g ? p->g[j] : 0;
  memset(lo, 0, p->n * sizeof *lo);
  for (size_t j = 0; p->g && j < p->n; j++) whole = plus_product(whole, p->g[j], x[j]);
  for (size_t j = 0; j < rows_of(p->h); j++) {
    exact hx = dot(p->h, j, x), sum = plus(plus((exact){hi[j], lo[j]}, hx.hi), hx.lo);
    hi[j] = sum.hi, lo[j] = sum.lo;
    whole = plus_multiple(whole, 0.5 * x[j], hx);
  }
  for (size_t i = 0; i < rows_of(p->a); i++) {
    exact r = normal(plus(dot(p->a, i, x), -target(p, i))),
          wr = normal(plus_multiple((exact){0, 0}, weight(p, i), r));
    add_row(p->a, i, wr, hi, lo);
    whole = plus_multiple(whole, 0.5 * r.hi, wr);
    whole.lo += 0.5 * r.lo * wr.hi;
  }
  return value_of(whole);
}

/* The side that a multiplier holds on to: infinite = it must be 0. */
static double side_of(const batten_qp_problem *p, size_t i, double y) {
  return y > 0 ? lower_of(p, i) : upper_of(p, i);
}

/* (hi, lo) [n] += factor * (C'y_rows + y_bounds) */
static void add_multipliers(const batten_qp_problem *p, double factor, const double *y, double *hi, double *lo) {
  size_t m = rows_of(p->c);
  for (size_t i = 0; i < m; i++)
    if (y[i] != 0) add_row(p->c, i, (exact){factor * y[i], 0}, hi, lo);
  for (size_t j = 0; j < p->n; j++) {
    exact sum = plus((exact){hi[j], lo[j]}, factor * y[m + j]);
    hi[j] = sum.hi, lo[j] = sum.lo;
  }
}

/* Sum of y_i side_i. A multiplier without a side is charged to the dual residual; in the gap it takes the row's
 * value, with which it adds nothing. */
static exact sum_of_sides(const batten_qp_problem *p, const double *x, const double *y, double *unheld) {
  size_t m = rows_of(p->c);
  exact sum = {0, 0};
  *unheld = 0;
  for (size_t i = 0; i < m + p->n; i++) {
    if (y[i] == 0) continue;
    double side = side_of(p, i, y[i]);
    if (isfinite(side)) {
      sum = plus_product(sum, y[i], side);
    } else {
      *unheld = larger(fabs(y[i]), *unheld);
      sum = plus_multiple(sum, y[i], i < m ? dot(p->c, i, x) : (exact){x[i - m], 0});
    }
  }
  return sum;
}

void qp_certify_residuals(const batten_qp_problem *problem, const double *x, const double *y, double *work,
                          batten_qp_info *info) {
  const batten_qp_problem *p = problem;
  size_t n = p->n;
  double *hi = work, *lo = work + n, energy = 0, linear = 0, unheld = 0;
  exact sides = {0, 0}, gap = {0, 0};
  judge_primal(p, x, info);

  plain_parts(p, x, hi, lo);
  for (size_t j = 0; j < n; j++) {
    energy += hi[j] * x[j];
    linear += lo[j] * x[j];
  }
  info->dual_scale = larger(largest(n, hi), largest(n, lo));
  if (y) {
    memset(work, 0, 2 * n * sizeof *work);
    add_multipliers(p, 1, y, hi, lo);
    info->dual_scale = larger(largest(n, hi), info->dual_scale);
    sides = sum_of_sides(p, x, y, &unheld);
  }
  info->objective = gradient(p, x, hi, lo);
  for (size_t j = 0; j < n; j++) gap = plus_multiple(gap, x[j], (exact){hi[j], lo[j]});
  info->duality_gap = fabs(value_of(plus(plus(gap, -sides.hi), -sides.lo)));
  info->gap_scale = larger(fabs(value_of(sides)), larger(fabs(energy), fabs(linear)));

  if (y) add_multipliers(p, -1, y, hi, lo);
  info->dual_residual = unheld;
  for (size_t j = 0; j < n; j++) info->dual_residual = larger(fabs(hi[j] + lo[j]), info->dual_residual);
}

static bool within(double residual, double scale, const batten_qp_options *o) {
  return residual <= o->tolerance_absolute + o->tolerance_relative * scale;
}

bool qp_certify_feasible(const batten_qp_info *info, const batten_qp_options *o) {
  return within(info->primal_residual, info->primal_scale, o);
}

bool qp_certify_optimal(const batten_qp_info *info, const batten_qp_options *o) {
  return qp_certify_feasible(info, o) && within(info->dual_residual, info->dual_scale, o) &&
         within(info->duality_gap, info->gap_scale, o);
}

/* ---- Proofs ---- */

/* Multipliers of rows, largest of size one; those without a side are dropped, and are no proof if they are not small
 * beside the largest (what they leave behind is seen in the sum). False if none is left. */
static bool clean_rows(const batten_qp_problem *p, double *y) {
  size_t m = rows_of(p->c);
  double most = 0;
  for (size_t i = 0; i < m; i++) {
    if (!isfinite(y[i])) return false;
    if (!isfinite(side_of(p, i, y[i]))) y[i] = 0;
    most = fmax(most, fabs(y[i]));
  }
  if (!(most > 0)) return false;
  int exponent;
  frexp(most, &exponent);
  for (size_t i = 0; i < m; i++) y[i] = ldexp(y[i], -exponent);
  return true;
}

bool qp_certify_infeasible(const batten_qp_problem *problem, double *y, double *work) {
  const batten_qp_problem *p = problem;
  size_t m = rows_of(p->c), n = p->n;
  double *hi = work, *lo = work + n;
  if (!clean_rows(p, y)) return false;
  memset(work, 0, 2 * n * sizeof *work);
  for (size_t i = 0; i < m; i++)
    if (y[i] != 0) add_row(p->c, i, (exact){y[i], 0}, hi, lo);

  /* bounds take what they can; what is left is kept in lo, and measured against the products that it came from */
  for (size_t j = 0; j < n; j++) {
    exact left = normal((exact){hi[j], lo[j]});
    y[m + j] = isfinite(side_of(p, m + j, -left.hi)) ? -left.hi : 0;
    lo[j] = y[m + j] != 0 ? fabs(left.lo) : fabs(left.hi);
    hi[j] = 0;
  }
  for (size_t i = 0; i < m; i++) {
    if (y[i] == 0) continue;
    line l = line_of(p->c, i);
    for (size_t e = 0; e < l.count; e++) hi[column_of(&l, e)] += fabs(l.values[e] * y[i]);
  }
  for (size_t j = 0; j < n; j++)
    if (!(lo[j] <= rounding(p) * hi[j])) return false;

  exact sum = {0, 0};
  double size = 0;
  for (size_t i = 0; i < m + n; i++) {
    if (y[i] == 0) continue;
    sum = plus_product(sum, y[i], side_of(p, i, y[i]));
    size += fabs(y[i] * side_of(p, i, y[i]));
  }
  double total = value_of(sum);
  if (!(total > rounding(p) * size) || !isfinite(size)) return false;
  for (size_t i = 0; i < m + n; i++) y[i] /= total;
  return true;
}

/* Whether m d = 0 up to rounding. */
static bool annihilates(const batten_qp_problem *p, const batten_matrix *m, const double *d) {
  for (size_t i = 0; i < rows_of(m); i++) {
    double size;
    plain_dot(m, i, d, &size);
    if (!(fabs(value_of(dot(m, i, d))) <= rounding(p) * size)) return false;
  }
  return true;
}

/* Whether no side is left along d. Entries against a bound of x are rounding or refuse; they are set to 0. */
static bool recedes(const batten_qp_problem *p, double *d) {
  size_t m = rows_of(p->c);
  double most = largest(p->n, d);
  for (size_t j = 0; j < p->n; j++) {
    bool against = (d[j] < 0 && lower_of(p, m + j) > -INFINITY) || (d[j] > 0 && upper_of(p, m + j) < INFINITY);
    if (against && !(fabs(d[j]) <= rounding(p) * most)) return false;
    if (against) d[j] = 0;
  }
  for (size_t i = 0; i < m; i++) {
    double size;
    plain_dot(p->c, i, d, &size);
    double along = value_of(dot(p->c, i, d)), allowed = rounding(p) * size;
    if (lower_of(p, i) > -INFINITY && !(along >= -allowed)) return false;
    if (upper_of(p, i) < INFINITY && !(along <= allowed)) return false;
  }
  return true;
}

bool qp_certify_unbounded(const batten_qp_problem *problem, double *d, double *work) {
  const batten_qp_problem *p = problem;
  size_t n = p->n;
  double most = largest(n, d), size = 0;
  if (!(most > 0) || !isfinite(most)) return false;
  int exponent;
  frexp(most, &exponent);
  for (size_t j = 0; j < n; j++) work[j] = ldexp(d[j], -exponent);
  if (!recedes(p, work) || !annihilates(p, p->h, work)) return false;
  for (size_t i = 0; i < rows_of(p->a); i++) {
    double all;
    plain_dot(p->a, i, work, &all);
    if (weight(p, i) > 0 && !(fabs(value_of(dot(p->a, i, work))) <= rounding(p) * all)) return false;
  }
  exact slope = {0, 0};
  for (size_t j = 0; p->g && j < n; j++) {
    slope = plus_product(slope, p->g[j], work[j]);
    size += fabs(p->g[j] * work[j]);
  }
  double fall = -value_of(slope);
  if (!(fall > rounding(p) * size) || !isfinite(size)) return false;
  for (size_t j = 0; j < n; j++) d[j] = work[j] / fall;
  return isfinite(largest(n, d));
}

/* What rounding of the entries of H can hide is measured for each unknown: the entry's own, and that of computing
 * with the largest one; but what is below 0 by a millionth of the diagonal's share is not rounding in whatever units.
 */
bool qp_certify_not_convex(const batten_qp_problem *problem, const double *d) {
  const batten_qp_problem *p = problem;
  const double FAR = 1e-6;
  if (!p->h) return false;
  double most = 0, hidden = 0, longest = 0;
  for (size_t i = 0; i < p->n; i++) {
    line l = line_of(p->h, i);
    longest = fmax(longest, (double)l.count);
    for (size_t e = 0; e < l.count; e++) most = larger(fabs(l.values[e]), most);
  }
  const double OWN = (1000 + 8 * longest) * DBL_EPSILON, OTHERS = (64 + longest) * DBL_EPSILON;
  exact energy = {0, 0};
  for (size_t i = 0; i < p->n; i++) {
    line l = line_of(p->h, i);
    double own = 0;
    for (size_t e = 0; e < l.count; e++)
      if (column_of(&l, e) == i) own = fabs(l.values[e]);
    hidden += fmin(fmax(OWN * own, OTHERS * most), FAR * own) * d[i] * d[i];
    if (d[i] != 0) energy = plus_multiple(energy, d[i], dot(p->h, i, d));
  }
  /* a quarter: whoever proposes d may measure it by scales that are powers of two */
  return value_of(energy) < 0 && value_of(energy) < -hidden / 4 && isfinite(value_of(energy));
}
