/* Fitting a volume spline: interpolation (or smoothing) of values and gradients.
 *                                                    [Savchenko et al. 1995, section 3; Wendland 2005, section 16]
 *
 * Points go to the unit box, values to [-1, 1] by a shift (the constants belong to the spline) and a power of two,
 * gradients along with both. The saddle system is solved, the weights go back to the caller's unit of value, and the
 * evaluator that the caller will use says how well the result meets the data. */
#include "spline/inner.h"

#include "base/checked.h"
#include "basis/green.h"

#include <batten/saddle.h>
#include <float.h>

/* Residuals above this part of the data's range are a warning. */
static const double RESIDUAL_PROMISED = 1e-10;

/* Residuals of a fit by iteration are looked at directly at all points where that takes no more than so many terms
 * (some tenths of a second), else at so many points as that allows, and at a thousand at least: fast sums would add
 * an error of their own, of the size of what is looked for. */
static const size_t RESIDUAL_TERMS = 1000000000, RESIDUAL_POINTS = 1000;

typedef struct fit {
  batten_context *ctx;
  const batten_spline_data *data;
  batten_spline_options opt;
  spline_system system;
  batten_saddle *saddle;
  double middle; /* subtracted from the values */
  int exponent;  /* then divided by 2^exponent */
  double *f, *w; /* [rows] right side, solution */
  double c[BATTEN_POLYNOMIAL_MAX];
  batten_spline *spline;
  batten_spline_info info;
} fit;

batten_spline_options batten_spline_options_default(void) {
  return (batten_spline_options){.struct_size = sizeof(batten_spline_options),
                                 .m = 2,
                                 .loo_samples = 256,
                                 .saddle = batten_saddle_options_default()};
}

/* Of the iterative solver with its products with K: more accurate than what is asked for by a factor of 20, or of 400
 * and 5e-10 (1e-11 of many points) with smooth kernels. Those of its levels, whose points fall off by four or more
 * from one to the next, take about as much again as the main one. */
static size_t iterative_bytes(unsigned n, unsigned m, size_t points, size_t gradients, double accuracy) {
  size_t rows, sums, bytes, total;
  batten_mul(n, gradients, &rows);
  batten_add(rows, points, &rows);
  const double smooth = fmin(accuracy / 400, rows > 150000 ? 1e-11 : 5e-10);
  const double products = batten_green_power(n, m) > 1 ? smooth : accuracy / 20;
  batten_mul(2, batten_spline_sums_bytes(n, m, points, gradients, products), &sums);
  bytes = batten_saddle_bytes(BATTEN_SADDLE_ITERATIVE, rows, batten_polynomial_count(n, m - 1));
  return batten_add(bytes, sums, &total) ? total : SIZE_MAX;
}

/* Peak: the factor with the 64 right sides that leave-one-out errors take at a time, beside the system. */
size_t batten_spline_bytes(batten_saddle_method method, unsigned n, unsigned m, size_t points, size_t gradients) {
  if (!batten_green_exists(n, m)) return SIZE_MAX;
  const size_t k = batten_polynomial_count(n, m - 1);
  size_t rows, own, bytes, total;
  if (!batten_mul(n, gradients, &rows) || !batten_add(rows, points, &rows)) return SIZE_MAX;
  /* P, f, w, coordinates (at most n a row), samples (index, diagonal) and the right sides. */
  if (!batten_mul3(rows + 1, k + 2 + n + 2 + 64 + 1, sizeof(double), &own)) return SIZE_MAX;
  if (method == BATTEN_SADDLE_ITERATIVE)
    bytes = iterative_bytes(n, m, points, gradients, batten_saddle_options_default().accuracy);
  else
    bytes = batten_saddle_bytes(method, rows, k);
  return batten_add(bytes, own, &total) ? total : SIZE_MAX;
}

/* ---- units of value ---- */

static double smoothing_at(const fit *t, size_t i) {
  return t->opt.smoothing_per_point ? t->opt.smoothing_per_point[i] : t->opt.smoothing;
}

static double value_range(const batten_spline_data *d, double *middle) {
  double lower = d->values[0], upper = lower;
  for (size_t i = 1; i < d->count; i++) {
    if (d->values[i] < lower) lower = d->values[i];
    if (d->values[i] > upper) upper = d->values[i];
  }
  *middle = lower + 0.5 * (upper - lower);
  return upper - lower;
}

/* Of count vectors of n components. */
static double largest_length(size_t n, size_t count, const double *vectors) {
  double largest = 0;
  for (size_t q = 0; q < count; q++) {
    double square = 0;
    for (size_t a = 0; a < n; a++) square += vectors[q * n + a] * vectors[q * n + a];
    if (!(square <= largest)) largest = square;
  }
  return sqrt(largest);
}

static batten_status make_right_side(fit *t) {
  const batten_spline_data *d = t->data;
  const spline_system *s = &t->system;
  double range = value_range(d, &t->middle), slope = s->scale * largest_length(d->n, d->gradient_count, d->gradients);
  double largest = fmax(0.5 * range, slope);
  if (!(largest <= 1e150))
    return batten_fail(t->ctx, BATTEN_E_INVALID,
                       "values: range %g with gradients up to %g per box; choose a unit that "
                       "brings them below 1e150",
                       range, slope);
  t->f = batten_alloc_array(t->ctx, s->rows, sizeof *t->f);
  t->w = batten_alloc_array(t->ctx, s->rows, sizeof *t->w);
  if (!t->f || !t->w) return BATTEN_E_NOMEM;
  frexp(largest, &t->exponent);
  for (size_t i = 0; i < s->count; i++) t->f[i] = ldexp(d->values[i] - t->middle, -t->exponent);
  for (size_t q = 0; q < s->gradient_count; q++)
    for (unsigned a = 0; a < s->n; a++)
      t->f[s->count + a * s->gradient_count + q] = ldexp(d->gradients[q * s->n + a] * s->scale, -t->exponent);
  return BATTEN_OK;
}

/* ---- solving ---- */

/* As many conditions as monomials: P c = f alone, by elimination with pivots. false when P is singular. */
static bool solve_polynomial(fit *t) {
  enum { MAX = BATTEN_POLYNOMIAL_MAX };
  const unsigned k = t->system.basis.count;
  double a[MAX][MAX], *b = t->c;
  for (unsigned i = 0; i < k; i++) {
    b[i] = t->f[i];
    t->w[i] = 0;
    for (unsigned j = 0; j < k; j++) a[i][j] = t->system.p[j * k + i];
  }
  for (unsigned j = 0; j < k; j++) {
    unsigned pivot = j;
    for (unsigned i = j + 1; i < k; i++)
      if (fabs(a[i][j]) > fabs(a[pivot][j])) pivot = i;
    /* Entries of P are at most of order 1 and each column has one that is (or is flat: 1e-13 is no pivot). */
    if (fabs(a[pivot][j]) < 1e-13) return false;
    for (unsigned l = j; l < k; l++) {
      double x = a[j][l];
      a[j][l] = a[pivot][l];
      a[pivot][l] = x;
    }
    double x = b[j];
    b[j] = b[pivot];
    b[pivot] = x;
    for (unsigned i = j + 1; i < k; i++) {
      double factor = a[i][j] / a[j][j];
      for (unsigned l = j + 1; l < k; l++) a[i][l] -= factor * a[j][l];
      b[i] -= factor * b[j];
    }
  }
  for (unsigned j = k; j-- > 0;) {
    for (unsigned l = j + 1; l < k; l++) b[j] -= a[j][l] * b[l];
    b[j] /= a[j][j];
  }
  return true;
}

static batten_status fail_singular(const fit *t, const char *detail) {
  const spline_system *s = &t->system;
  return batten_fail(
      t->ctx, BATTEN_E_SINGULAR,
      "points: the system of the %zu points is singular to working precision: some "
      "nearly coincide, or all lie on or near the zero set of one polynomial of degree %u; merge near points, "
      "lower m = %u, or set opt.smoothing (%s)",
      s->count, s->m - 1, s->m, detail);
}

/* From so many unknowns on iteration takes half the time of factors, and less with every point, for the kernels that
 * it takes easily: r, and r^2 ln r in the plane (benchmarks/bench_large). Below that a factor takes a second at most,
 * and gives residuals of rounding and leave-one-out errors besides. */
enum { ITERATIVE_FROM = 6000 };

/* Where no factor has room, iteration is tried from so many unknowns on, whatever the kernel. */
enum { ITERATIVE_FROM_SMALL = 2000 };

static bool dense_fits(const fit *t) {
  return batten_saddle_bytes(BATTEN_SADDLE_CHOLESKY_MIXED, t->system.rows, t->system.basis.count) <=
         batten_bytes_available(t->ctx);
}

static batten_saddle_method choose_method(const fit *t) {
  const spline_system *s = &t->system;
  const batten_saddle_method asked = t->opt.saddle.method;
  if (asked != BATTEN_SADDLE_AUTO || !batten_spline_sums_exist(s->n) || s->rows < ITERATIVE_FROM_SMALL) return asked;
  const size_t available = batten_bytes_available(t->ctx);
  const bool easy = s->power <= 2 && s->rows >= ITERATIVE_FROM;
  if (!easy && dense_fits(t)) return asked;
  const size_t bytes = iterative_bytes(s->n, s->m, s->count, s->gradient_count, t->opt.saddle.accuracy);
  return bytes <= available ? BATTEN_SADDLE_ITERATIVE : asked;
}

static batten_status solve(fit *t) {
  spline_system *s = &t->system;
  if (s->rows == s->basis.count) {
    t->info.saddle.rcond = NAN;
    return solve_polynomial(t) ? BATTEN_OK : fail_singular(t, "as many conditions as monomials");
  }
  batten_saddle_matrix matrix = {
      .n = s->rows, .k = s->basis.count, .p = s->p, .fill = batten_spline_system_fill, .user = s};
  batten_saddle_options o = t->opt.saddle;
  if (s->power > 1) o.smooth_kernel = 1;
  o.method = choose_method(t);
  batten_status st = BATTEN_OK;
  if (o.method == BATTEN_SADDLE_ITERATIVE) {
    if ((st = batten_spline_sums_make(t->ctx, s)) < 0) return st;
    matrix.sums = &s->sums->calls;
  }
  st = batten_saddle_factor(t->ctx, &matrix, &o, &t->saddle);
  if (st == BATTEN_E_TOO_LARGE && o.method != t->opt.saddle.method && dense_fits(t)) {
    st = batten_expect(t->ctx, st, BATTEN_E_TOO_LARGE); /* chosen before the neighbours were known */
    matrix.sums = NULL;
    o.method = t->opt.saddle.method;
    st = batten_saddle_factor(t->ctx, &matrix, &o, &t->saddle);
  }
  if (st >= 0) st = batten_saddle_solve(t->ctx, t->saddle, t->f, t->w, t->c);
  if (st == BATTEN_E_SINGULAR) return fail_singular(t, batten_error(t->ctx));
  if (st >= 0) t->info.saddle = batten_saddle_get_info(t->saddle);
  /* The accuracy of factors is judged on the spline, by judge. */
  return st < 0 ? st : BATTEN_OK;
}

static bool is_iterative(const fit *t) { return t->info.saddle.method == BATTEN_SADDLE_ITERATIVE; }

/* ---- leave-one-out ---- */

/* U_without_i(x_i) - v_i = -w_i / (inverse matrix)_ii  [Rippa 1999], with or without smoothing: the row and column
 * that go take the point's own smoothing with them. Points that the polynomial part cannot miss have no such error.
 */
static batten_status leave_one_out(fit *t) {
  const size_t count = t->system.count;
  size_t samples = t->opt.loo_samples < count ? t->opt.loo_samples : count;
  t->info.loo_rms = NAN;
  if (!t->saddle || is_iterative(t) || samples == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  double *diagonal = batten_alloc_array(t->ctx, samples, sizeof *diagonal), largest = 0, sum = 0;
  size_t *index = batten_alloc_array(t->ctx, samples, sizeof *index), used = 0;
  if (!diagonal || !index) goto done;
  for (size_t q = 0; q < samples; q++) index[q] = batten_drawn(q, samples, count);
  st = batten_saddle_inverse_diagonal(t->ctx, t->saddle, samples, index, diagonal);
  if (st < 0) goto done;
  for (size_t q = 0; q < samples; q++) largest = fmax(largest, fabs(diagonal[q]));
  for (size_t q = 0; q < samples; q++) {
    if (!(fabs(diagonal[q]) > 1e-10 * largest)) continue;
    double error = t->w[index[q]] / diagonal[q];
    sum += error * error;
    used++;
  }
  if (used) t->info.loo_rms = ldexp(sqrt(sum / (double)used), t->exponent);
  t->info.loo_samples = used;
  st = BATTEN_OK;
done:
  batten_free(t->ctx, index);
  batten_free(t->ctx, diagonal);
  return st;
}

/* ---- the result ---- */

/* w' K w = w' f - rho w' w, because P' w = 0. Where smoothing leaves next to nothing the difference is rounding, of
 * either sign. */
static double energy(const fit *t) {
  double sum = 0;
  for (size_t i = 0; i < t->system.rows; i++) {
    sum += t->w[i] * t->f[i];
    if (i < t->system.count) sum -= smoothing_at(t, i) * t->w[i] * t->w[i];
  }
  return sum > 0 ? ldexp(sum, 2 * t->exponent) : 0;
}

/* f is free by now: it takes the gradient coefficients as [M][n]. */
static batten_status make_spline(fit *t) {
  const spline_system *s = &t->system;
  for (size_t i = 0; i < s->rows; i++) t->w[i] = ldexp(t->w[i], t->exponent);
  for (unsigned q = 0; q < s->basis.count; q++) t->c[q] = ldexp(t->c[q], t->exponent);
  t->c[0] += t->middle;
  batten_status st = BATTEN_E_NOMEM;
  size_t *at = batten_alloc_array(t->ctx, s->gradient_count, sizeof *at);
  if (!at) goto done;
  for (size_t q = 0; q < s->gradient_count; q++) {
    at[q] = t->data->gradient_at ? t->data->gradient_at[q] : q;
    for (unsigned a = 0; a < s->n; a++) t->f[q * s->n + a] = t->w[s->count + a * s->gradient_count + q];
  }
  batten_spline_parts parts = {.struct_size = sizeof parts,
                               .n = s->n,
                               .m = s->m,
                               .count = s->count,
                               .centers = t->data->points,
                               .coefficients = t->w,
                               .gradient_count = s->gradient_count,
                               .gradient_at = at,
                               .gradient_coefficients = t->f,
                               .polynomial_count = s->basis.count,
                               .polynomial = t->c,
                               .origin = {s->origin[0], s->origin[1], s->origin[2]},
                               .scale = s->scale};
  st = batten_spline_create(t->ctx, &parts, &t->spline);
done:
  batten_free(t->ctx, at);
  return st;
}

/* Points out of count to look at. */
static size_t points_to_check(const fit *t, size_t count) {
  if (!is_iterative(t)) return count;
  const size_t most = RESIDUAL_TERMS / t->system.rows;
  if (count <= most || count <= RESIDUAL_POINTS) return count;
  return most > RESIDUAL_POINTS ? most : RESIDUAL_POINTS;
}

/* The largest miss of a value, at points evenly drawn; f has room for values. */
static batten_status check_values(fit *t, double *worst) {
  const batten_spline_data *d = t->data;
  const size_t n = d->n, checked = points_to_check(t, d->count);
  const double *points = d->points;
  double *values = t->f, *some = NULL;
  batten_status st = BATTEN_OK;
  if (checked < d->count) {
    some = batten_alloc_array(t->ctx, checked, n * sizeof *some);
    if (!some) return BATTEN_E_NOMEM;
    for (size_t q = 0; q < checked; q++)
      memcpy(some + q * n, d->points + batten_drawn(q, checked, d->count) * n, n * sizeof *some);
    points = some;
  }
  st = batten_spline_evaluate(t->ctx, t->spline, checked, points, values, NULL, NULL);
  batten_free(t->ctx, some);
  if (st < 0) return st;
  for (size_t q = 0; q < checked; q++) {
    const size_t i = batten_drawn(q, checked, d->count);
    double miss = fabs(values[q] + smoothing_at(t, i) * t->w[i] - d->values[i]);
    if (!(miss <= *worst)) *worst = miss;
  }
  t->info.residual_points = checked;
  return BATTEN_OK;
}

/* The largest length of a miss of a gradient. w and f have room for N + n M numbers, and nobody needs them any more.
 */
static batten_status check_gradients(fit *t, double *worst) {
  const batten_spline_data *d = t->data;
  const size_t n = d->n, count = d->gradient_count, checked = points_to_check(t, count);
  double *points = t->w, *gradients = t->f;
  for (size_t q = 0; q < checked; q++) {
    const size_t g = batten_drawn(q, checked, count), at = d->gradient_at ? d->gradient_at[g] : g;
    memcpy(points + q * n, d->points + at * n, n * sizeof *points);
  }
  batten_status st = batten_spline_evaluate(t->ctx, t->spline, checked, points, NULL, gradients, NULL);
  if (st < 0) return st;
  for (size_t q = 0; q < checked; q++)
    for (size_t a = 0; a < n; a++) gradients[q * n + a] -= d->gradients[batten_drawn(q, checked, count) * n + a];
  *worst = largest_length(n, checked, gradients);
  return BATTEN_OK;
}

static batten_status find_residuals(fit *t) {
  const batten_spline_data *d = t->data;
  double middle, range = value_range(d, &middle), slope = largest_length(d->n, d->gradient_count, d->gradients);
  double worst = 0;
  batten_status st = check_values(t, &worst);
  if (st < 0) return st;
  /* Values that are all the same (a surface with its normals) have no range: the gradients say what is much. */
  if (range == 0) range = slope > 0 ? slope * t->system.scale : fabs(d->values[0]);
  t->info.residual_max = range > 0 ? worst / range : worst;
  if (d->gradient_count == 0) return BATTEN_OK;
  if ((st = check_gradients(t, &worst)) < 0) return st;
  if (slope == 0) slope = range / t->system.scale;
  t->info.gradient_residual_max = slope > 0 ? worst / slope : worst;
  return BATTEN_OK;
}

/* Factors promise every point, iteration what it was asked for. */
static batten_status judge(const fit *t) {
  const batten_saddle_info *s = &t->info.saddle;
  if (is_iterative(t)) {
    if (s->residual_rows <= t->opt.saddle.accuracy) return BATTEN_OK;
    return batten_fail(t->ctx, BATTEN_W_ACCURACY,
                       "residual: %.3g of the data less their best polynomial (2-norm over %zu points) after %u "
                       "iterations, above opt.saddle.accuracy = %g; ask for less, merge points that nearly coincide, "
                       "lower m, or set opt.smoothing",
                       s->residual_rows, s->rows_checked, s->iterations, t->opt.saddle.accuracy);
  }
  double middle, range = value_range(t->data, &middle),
                 worst = fmax(t->info.residual_max, t->info.gradient_residual_max);
  /* Values about 1e8 with a range of 1 have only 8 digits of it to be met. */
  double digits = range > 0 ? 4 * DBL_EPSILON * (fabs(middle) / range) : 0;
  if (worst <= RESIDUAL_PROMISED + digits) return BATTEN_OK;
  return batten_fail(t->ctx, BATTEN_W_ACCURACY,
                     "residual: %.3g of the data's range, above %g (reciprocal condition %.3g); "
                     "merge points that nearly coincide, lower m, or set opt.smoothing",
                     worst, RESIDUAL_PROMISED, t->info.saddle.rcond);
}

batten_status batten_spline_fit(batten_context *ctx, const batten_spline_data *data, const batten_spline_options *opt,
                                batten_spline **out, batten_spline_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!data || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", data ? "out" : "data");
  const double start = batten_now();
  fit t = {.ctx = ctx, .data = data, .opt = opt ? *opt : batten_spline_options_default()};
  batten_status st = batten_spline_check_data(ctx, data, &t.opt);
  if (st < 0) return st;
  if ((st = batten_spline_system_make(ctx, data, &t.opt, &t.system)) < 0) goto done;
  if ((st = batten_spline_check_points(ctx, &t.system)) < 0) goto done;
  if ((st = make_right_side(&t)) < 0) goto done;
  if ((st = solve(&t)) < 0) goto done;
  if ((st = leave_one_out(&t)) < 0) goto done;
  t.info.energy = energy(&t);
  batten_saddle_free(t.saddle); /* the factor is the bulk of the memory, and done with */
  t.saddle = NULL;
  batten_spline_sums_free(ctx, &t.system);
  if ((st = make_spline(&t)) < 0) goto done;
  if ((st = find_residuals(&t)) < 0) goto done;
  st = judge(&t);
  t.info.time_total_s = batten_now() - start;
  if (info) *info = t.info;
  *out = t.spline;
  t.spline = NULL;
done:
  batten_spline_free(t.spline);
  batten_saddle_free(t.saddle);
  batten_free(ctx, t.f);
  batten_free(ctx, t.w);
  batten_spline_system_free(ctx, &t.system);
  return st;
}
