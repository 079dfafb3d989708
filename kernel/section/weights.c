/* One-dimensional blends between sections: natural and not-a-knot cubic splines, monotone cubics, linear, rational.
 * [Savchenko et al. 1995, section 4; Fritsch, Butland 1984]
 *
 * With u = (t - t_i) / h, h = t_(i+1) - t_i, a cubic spline is
 *   (1 - u) f_i + u f_(i+1) + h^2 / 6 (p(1 - u) M_i + p(u) M_(i+1)),   p(v) = v^3 - v,
 * M its second derivatives at the sections. M_i is taken from the spline through the 16 sections on each side of it
 * alone, so that a value costs the functions of 34 sections and not of all: what lies farther away counts 0.268 a
 * section (of even spacing) and so a part in 10^9. p vanishes at 0 and 1: the sections themselves stay exact, and the
 * spline of any 33 sections draws straight lines through sections on a line. A blend's row of weights is a cubic in t
 * between two sections, which is what its bounds live on: over part of a gap it stays within the hull of its
 * Bernstein coefficients, each of which is a sum over the sections. */
#include <math.h>
#include <string.h>

#include "section/section_inner.h"

enum {
  REACH = STACK_WINDOW / 2 - 1, /* sections on each side that M depends on */
  ROW = 2 * REACH + 1
};

struct stack_weights {
  batten_context *ctx;
  batten_stack_between between;
  double shape;
  size_t count;
  double *t;    /* [count] */
  double *rows; /* [count][ROW]: M_i by f of the sections from row_first(i) on; NULL but for cubic splines */
};

static bool is_spline(batten_stack_between b) {
  return b == BATTEN_BETWEEN_NATURAL || b == BATTEN_BETWEEN_NOT_A_KNOT;
}
static size_t row_first(size_t i) { return i > REACH ? i - REACH : 0; }
static size_t row_last(const stack_weights *w, size_t i) {
  return w->count - 1 - i > REACH ? i + REACH : w->count - 1;
}

/* The second derivative at knot `at` of the spline through n <= ROW knots by their values: row [n]. not_a_knot: of
 * the first and last end; otherwise natural. The tridiagonal system A M = R f of the inner knots is solved for the
 * one row that is wanted: A' y = e, row = R' y. A is strictly dominant by rows, with the ends' conditions put in. */
static void moment_row(size_t n, const double *t, size_t at, const bool not_a_knot[2], double *row) {
  double lower[ROW] = {0}, diagonal[ROW], upper[ROW] = {0}, y[ROW] = {0};
  memset(row, 0, n * sizeof *row);
  if (n < 3) return;
  double h0 = t[1] - t[0], h1 = t[2] - t[1], hn = t[n - 1] - t[n - 2], hm = t[n - 2] - t[n - 3];
  if (n == 3 && (not_a_knot[0] || not_a_knot[1])) { /* one cubic through three: the parabola */
    row[0] = 2 / (h0 * (h0 + h1));
    row[1] = -2 / (h0 * h1);
    row[2] = 2 / (h1 * (h0 + h1));
    return;
  }
  for (size_t k = 1; k + 1 < n; k++) {
    lower[k] = t[k] - t[k - 1];
    upper[k] = t[k + 1] - t[k];
    diagonal[k] = 2 * (lower[k] + upper[k]);
  }
  double first = h0 / h1, last = hn / hm; /* M_0 = (1 + first) M_1 - first M_2, and from the other end */
  if (not_a_knot[0]) {
    diagonal[1] += (1 + first) * h0;
    upper[1] -= first * h0;
  }
  if (not_a_knot[1]) {
    diagonal[n - 2] += (1 + last) * hn;
    lower[n - 2] -= last * hn;
  }
  if (at > 0 && at + 1 < n) {
    y[at] = 1;
  } else if (at == 0 && not_a_knot[0]) {
    y[1] = 1 + first;
    y[2] = -first;
  } else if (at > 0 && not_a_knot[1]) {
    y[n - 2] = 1 + last;
    y[n - 3] = -last;
  }
  /* A' has lower[k + 1] above and upper[k - 1] below its diagonal */
  for (size_t k = 2; k + 1 < n; k++) {
    double factor = upper[k - 1] / diagonal[k - 1];
    diagonal[k] -= factor * lower[k];
    y[k] -= factor * y[k - 1];
  }
  for (size_t k = n - 2; k > 0; k--) y[k] = (y[k] - (k + 2 < n ? lower[k + 1] * y[k + 1] : 0)) / diagonal[k];
  for (size_t k = 1; k + 1 < n; k++) {
    double before = 6 * y[k] / (t[k] - t[k - 1]), behind = 6 * y[k] / (t[k + 1] - t[k]);
    row[k - 1] += before;
    row[k] -= before + behind;
    row[k + 1] += behind;
  }
}

batten_status stack_weights_make(batten_context *ctx, batten_stack_between between, double shape, size_t count,
                                 const double *t, stack_weights **out) {
  batten_status st = BATTEN_E_NOMEM;
  stack_weights *w = batten_alloc(ctx, sizeof *w);
  if (!w) return BATTEN_E_NOMEM;
  *w = (stack_weights){.ctx = ctx, .between = between, .shape = shape, .count = count};
  w->t = batten_alloc_array(ctx, count, sizeof *w->t);
  if (!w->t) goto done;
  memcpy(w->t, t, count * sizeof *t);
  if (is_spline(between)) {
    w->rows = batten_alloc_array(ctx, count, ROW * sizeof *w->rows);
    if (!w->rows) goto done;
    for (size_t i = 0; i < count; i++) {
      size_t first = row_first(i), last = row_last(w, i);
      bool wanted = between == BATTEN_BETWEEN_NOT_A_KNOT;
      const bool not_a_knot[2] = {wanted && first == 0, wanted && last + 1 == count};
      moment_row(last - first + 1, t + first, i - first, not_a_knot, w->rows + i * ROW);
    }
  }
  *out = w;
  w = NULL;
  st = BATTEN_OK;
done:
  stack_weights_free(w);
  return st;
}

void stack_weights_free(stack_weights *w) {
  if (!w) return;
  batten_free(w->ctx, w->t);
  batten_free(w->ctx, w->rows);
  batten_free(w->ctx, w);
}

/* The gap between sections i and i + 1 that t lies in; count >= 2. */
static size_t gap_of(const stack_weights *w, double t) {
  size_t low = 0, high = w->count - 1;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (t < w->t[middle])
      high = middle;
    else
      low = middle;
  }
  return low;
}

static size_t gap_window(const stack_weights *w, size_t i, size_t *first) {
  size_t last = i + 1;
  *first = i;
  if (is_spline(w->between)) {
    *first = row_first(i);
    last = row_last(w, i + 1);
  } else if (w->between == BATTEN_BETWEEN_MONOTONE) {
    *first = i > 0 ? i - 1 : 0;
    last = i + 2 < w->count ? i + 2 : i + 1;
  }
  return last - *first + 1;
}

size_t stack_window(const stack_weights *w, double t, size_t *first) {
  *first = 0;
  return w->count < 2 ? w->count : gap_window(w, gap_of(w, t), first);
}

/* ---- monotone ------------------------------------------------------------------------------------- */

/* Slope of the monotone cubic at an inner section from the chords a, b before and behind it, h0, h1 their lengths:
 * the weighted harmonic mean, 0 where they differ in sign. by [2]: its derivatives. It grows with a and with b. */
static double inner_slope(double h0, double h1, double a, double b, double by[2]) {
  by[0] = by[1] = 0;
  if (!((a > 0 && b > 0) || (a < 0 && b < 0))) return 0;
  double v = (2 * h1 + h0) / (h0 + h1) / 3, w = (h1 + 2 * h0) / (h0 + h1) / 3, size = fmax(fabs(a), fabs(b));
  double x = a / size, y = b / size, bottom = v * y + w * x;
  by[0] = v * (y / bottom) * (y / bottom);
  by[1] = w * (x / bottom) * (x / bottom);
  return size * (x * y / bottom);
}

static double median(double a, double b, double c) { return fmax(fmin(a, b), fmin(fmax(a, b), c)); }

/* Slope at an end from the chords a next to it and b after that: the parabola's, held between 0 and 3 a (which it
 * leaves only where b differs in sign from a: else it is under 2 a). */
static double end_slope(double h0, double h1, double a, double b, double by[2]) {
  double share = h0 / (h0 + h1), parabola = (1 + share) * a - share * b, slope = median(0, 3 * a, parabola);
  bool cut = slope != parabola;
  by[0] = !cut ? 1 + share : slope != 0 ? 3 : 0;
  by[1] = !cut ? -share : 0;
  return slope;
}

/* Weights of the four functions around a gap: slopes m at both of its sections from the chords d [3] of the gaps
 * before, in and behind it, and their derivatives by the chords. */
typedef struct gap_slopes {
  double m[2], by[2][3];
} gap_slopes;

static gap_slopes slopes_of(const stack_weights *w, size_t i, const double d[3]) {
  gap_slopes s = {{d[1], d[1]}, {{0, 1, 0}, {0, 1, 0}}};
  if (w->count == 2) return s;
  const double *t = w->t;
  double h = t[i + 1] - t[i], by[2];
  double before = i > 0 ? t[i] - t[i - 1] : 0, behind = i + 2 < w->count ? t[i + 2] - t[i + 1] : 0;
  s.m[0] = i > 0 ? inner_slope(before, h, d[0], d[1], by) : end_slope(h, behind, d[1], d[2], by);
  memcpy(s.by[0], (double[3]){i > 0 ? by[0] : 0, i > 0 ? by[1] : by[0], i > 0 ? 0 : by[1]}, sizeof s.by[0]);
  bool inner = i + 2 < w->count;
  s.m[1] = inner ? inner_slope(h, behind, d[1], d[2], by) : end_slope(h, before, d[1], d[0], by);
  memcpy(s.by[1], (double[3]){inner ? 0 : by[1], by[0], inner ? by[1] : 0}, sizeof s.by[1]);
  return s;
}

/* The chord of gap i from functions f of sections `first` on. */
static double chord(const stack_weights *w, size_t i, size_t first, const double *f) {
  return (f[i + 1 - first] - f[i - first]) / (w->t[i + 1] - w->t[i]);
}

static double weigh_monotone(const stack_weights *w, size_t i, size_t first, double u, const double *f, double *dt,
                             double *weights) {
  size_t n = w->count, at = i - first;
  double h = w->t[i + 1] - w->t[i], q = 1 - u;
  const double d[3] = {i > 0 ? chord(w, i - 1, first, f) : 0, chord(w, i, first, f),
                       i + 2 < n ? chord(w, i + 1, first, f) : 0};
  gap_slopes s = slopes_of(w, i, d);
  double h01 = u * u * (3 - 2 * u), h10 = h * u * q * q, h11 = -h * u * u * q;
  if (dt) *dt = 6 * u * q * d[1] + (1 - u * (4 - 3 * u)) * s.m[0] + u * (3 * u - 2) * s.m[1];
  if (weights) {
    memset(weights, 0, (size_t)(i + 2 < n ? at + 3 : at + 2) * sizeof *weights);
    weights[at] += q * q * (1 + 2 * u);
    weights[at + 1] += h01;
    for (size_t k = 0; k < 3; k++) { /* the chord of gap i - 1 + k */
      double by = h10 * s.by[0][k] + h11 * s.by[1][k];
      if ((k == 0 && i == 0) || (k == 2 && i + 2 >= n)) continue;
      by /= w->t[i + k] - w->t[i + k - 1];
      weights[at + k] += by;
      weights[at + k - 1] -= by;
    }
  }
  return q * q * (1 + 2 * u) * f[at] + h01 * f[at + 1] + h10 * s.m[0] + h11 * s.m[1];
}

/* ---- values --------------------------------------------------------------------------------------- */

static double weigh_spline(const stack_weights *w, size_t i, size_t first, size_t count, double u, const double *f,
                           double *dt, double *weights) {
  const double *rows[2] = {w->rows + i * ROW, w->rows + (i + 1) * ROW};
  size_t skip = row_first(i + 1) - first, length = row_last(w, i) - first + 1;
  double h = w->t[i + 1] - w->t[i], q = 1 - u, value = 0, slope = 0, bend[2] = {0, 0};
  double c0 = -h * h / 6 * (u * q) * (1 + q), c1 = -h * h / 6 * (u * q) * (1 + u);
  for (size_t k = 0; k < length; k++) bend[0] += rows[0][k] * f[k];
  for (size_t k = skip; k < count; k++) bend[1] += rows[1][k - skip] * f[k];
  value = q * f[i - first] + u * f[i + 1 - first] + (c0 * bend[0] + c1 * bend[1]);
  slope =
      (f[i + 1 - first] - f[i - first]) / h - h / 6 * (3 * q * q - 1) * bend[0] + h / 6 * (3 * u * u - 1) * bend[1];
  if (dt) *dt = slope;
  if (weights) {
    for (size_t k = 0; k < count; k++)
      weights[k] = (k < length ? c0 * rows[0][k] : 0) + (k >= skip ? c1 * rows[1][k - skip] : 0);
    weights[i - first] += q;
    weights[i + 1 - first] += u;
  }
  return value;
}

double stack_weigh(const stack_weights *w, double t, const double *f, double *dt, double *weights) {
  if (w->count < 2) {
    if (dt) *dt = 0;
    if (weights) *weights = 1;
    return f[0];
  }
  size_t first, i = gap_of(w, t), count = gap_window(w, i, &first);
  double h = w->t[i + 1] - w->t[i], u = (t - w->t[i]) / h;
  if (is_spline(w->between)) return weigh_spline(w, i, first, count, u, f, dt, weights);
  if (w->between == BATTEN_BETWEEN_MONOTONE) return weigh_monotone(w, i, first, u, f, dt, weights);
  double c = w->between == BATTEN_BETWEEN_RATIONAL ? w->shape : 1, bottom = u + c * (1 - u);
  double g = u / bottom, rest = c * (1 - u) / bottom;
  if (dt) *dt = (f[1] - f[0]) * (c / (bottom * bottom) / h);
  if (weights) {
    weights[0] = rest;
    weights[1] = g;
  }
  return rest * f[0] + g * f[1];
}

/* ---- bounds --------------------------------------------------------------------------------------- */

static double magnitude(interval a) { return fmax(fabs(a.lo), fabs(a.hi)); }
/* sum + weight a, so that an unbounded a of weight 0 does not count. */
static interval add_scaled(interval sum, double weight, interval a) {
  return weight == 0 ? sum : interval_add(sum, interval_scale(a, weight));
}

/* Blossom of v and of p(v) = v^3 - v at three places: their Bernstein coefficients over a part of [0, 1]. */
static double linear_blossom(const double v[3]) { return (v[0] + v[1] + v[2]) / 3; }
static double cubic_blossom(const double v[3]) { return v[0] * v[1] * v[2] - linear_blossom(v); }
static void blossom_places(double u0, double u1, unsigned k, double u[3], double q[3]) {
  for (unsigned j = 0; j < 3; j++) {
    u[j] = j < k ? u1 : u0;
    q[j] = 1 - u[j];
  }
}

static interval spline_bounds(const stack_weights *w, size_t i, size_t first, size_t count, double u0, double u1,
                              const interval *f) {
  const double *rows[2] = {w->rows + i * ROW, w->rows + (i + 1) * ROW};
  size_t skip = row_first(i + 1) - first, length = row_last(w, i) - first + 1;
  double h = w->t[i + 1] - w->t[i], size = 0;
  interval hull = {INFINITY, -INFINITY};
  for (unsigned k = 0; k < 4; k++) {
    double u[3], q[3];
    blossom_places(u0, u1, k, u, q);
    double c0 = h * h / 6 * cubic_blossom(q), c1 = h * h / 6 * cubic_blossom(u), main = linear_blossom(u);
    interval sum = {0, 0};
    size = 0;
    for (size_t j = 0; j < count; j++) {
      double weight = (j < length ? c0 * rows[0][j] : 0) + (j >= skip ? c1 * rows[1][j - skip] : 0);
      size_t section = first + j;
      if (section == i) weight += 1 - main;
      if (section == i + 1) weight += main;
      sum = add_scaled(sum, weight, f[j]);
      /* what the terms are made of, for their rounding: |p| <= 0.385 */
      double parts = (j < length ? fabs(rows[0][j]) : 0) + (j >= skip ? fabs(rows[1][j - skip]) : 0);
      double term = (parts * h * h / 6 + (section == i || section == i + 1)) * magnitude(f[j]);
      if (term > 0) size += term;
    }
    hull = interval_hull(hull, sum);
  }
  double slack = 64 * 0x1p-52 * size; /* sums of 34 terms, each of a few roundings */
  return interval_widen(hull.lo - slack, hull.hi + slack, 1);
}

/* a weight of both, weights in [0, 1] that sum to 1. */
static interval between(interval a, interval b, double g) {
  return add_scaled(add_scaled((interval){0, 0}, 1 - g, a), g, b);
}

/* Slopes over all chords: inner ones grow with both, an end's with 3 a and with the parabola's slope. */
static interval slope_bounds(double h0, double h1, interval a, interval b, bool inner) {
  double by[2], share = h0 / (h0 + h1);
  if (inner) return interval_widen(inner_slope(h0, h1, a.lo, b.lo, by), inner_slope(h0, h1, a.hi, b.hi, by), 16);
  interval parabola = interval_sub(interval_scale(a, 1 + share), interval_scale(b, share));
  parabola = interval_widen(parabola.lo, parabola.hi, 8);
  return interval_widen(median(0, 3 * a.lo, parabola.lo), median(0, 3 * a.hi, parabola.hi), 1);
}

static interval monotone_bounds(const stack_weights *w, size_t i, size_t first, double u0, double u1,
                                const interval *f) {
  const double *t = w->t;
  size_t n = w->count, at = i - first;
  double h[3] = {i > 0 ? t[i] - t[i - 1] : 0, t[i + 1] - t[i], i + 2 < n ? t[i + 2] - t[i + 1] : 0};
  interval d[3] = {{0, 0}, {0, 0}, {0, 0}};
  for (size_t k = 0; k < 3; k++)
    if ((k > 0 || i > 0) && (k < 2 || i + 2 < n))
      d[k] = interval_div(interval_sub(f[at + k], f[at + k - 1]), interval_of(h[k]));
  interval m[2] = {d[1], d[1]};
  if (n > 2) {
    m[0] = i > 0 ? slope_bounds(h[0], h[1], d[0], d[1], true) : slope_bounds(h[1], h[2], d[1], d[2], false);
    m[1] = i + 2 < n ? slope_bounds(h[1], h[2], d[1], d[2], true) : slope_bounds(h[1], h[0], d[1], d[0], false);
  }
  interval hull = {INFINITY, -INFINITY};
  for (unsigned k = 0; k < 4; k++) {
    double u[3], q[3];
    blossom_places(u0, u1, k, u, q);
    /* the cubic's own coefficients f_i, f_i + h m_i / 3, f_(i+1) - h m_(i+1) / 3, f_(i+1), and their shares */
    double b1 = q[0] * q[1] * u[2] + q[0] * u[1] * q[2] + u[0] * q[1] * q[2];
    double b2 = q[0] * u[1] * u[2] + u[0] * q[1] * u[2] + u[0] * u[1] * q[2], main = b2 + u[0] * u[1] * u[2];
    interval sum = between(f[at], f[at + 1], main);
    sum = add_scaled(sum, h[1] / 3 * b1, m[0]);
    hull = interval_hull(hull, add_scaled(sum, -h[1] / 3 * b2, m[1]));
  }
  interval ends = interval_hull(f[at], f[at + 1]);
  double slack = 64 * 0x1p-52 * fmax(magnitude(ends), h[1] * fmax(magnitude(m[0]), magnitude(m[1])));
  hull = interval_widen(hull.lo - slack, hull.hi + slack, 1);
  slack = 64 * 0x1p-52 * magnitude(ends); /* no overshoot; slopes are at most 3 chords */
  return interval_meet(hull, interval_widen(ends.lo - slack, ends.hi + slack, 1));
}

interval stack_weigh_bounds(const stack_weights *w, double t0, double t1, size_t first, const interval *f) {
  if (w->count < 2) return f[0];
  interval hull = {INFINITY, -INFINITY};
  for (size_t i = gap_of(w, t0), last = gap_of(w, t1); i <= last; i++) {
    size_t from, count = gap_window(w, i, &from);
    double h = w->t[i + 1] - w->t[i];
    double u0 = fmax(0, (t0 - w->t[i]) / h), u1 = i < last ? 1 : fmin(1, (t1 - w->t[i]) / h);
    const interval *own = f + (from - first);
    interval part;
    if (is_spline(w->between)) {
      part = spline_bounds(w, i, from, count, u0, u1, own);
    } else if (w->between == BATTEN_BETWEEN_MONOTONE) {
      part = monotone_bounds(w, i, from, u0, u1, own);
    } else {
      double c = w->between == BATTEN_BETWEEN_RATIONAL ? w->shape : 1;
      interval low = between(own[0], own[1], u0 / (u0 + c * (1 - u0)));
      interval high = between(own[0], own[1], u1 / (u1 + c * (1 - u1)));
      double slack = 16 * 0x1p-52 * fmax(magnitude(own[0]), magnitude(own[1]));
      part = interval_hull(low, high);
      part = interval_widen(part.lo - slack, part.hi + slack, 1);
    }
    hull = interval_hull(hull, part);
  }
  return hull;
}
