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

/* Peak: the factor with the 64 right sides that leave-one-out errors take at a time, beside the system. */
size_t batten_spline_bytes(batten_saddle_method method, unsigned n, unsigned m, size_t points, size_t gradients) {
  if (!batten_green_exists(n, m)) return SIZE_MAX;
  const size_t k = batten_polynomial_count(n, m - 1);
  size_t rows, own, bytes, total;
  if (!batten_mul(n, gradients, &rows) || !batten_add(rows, points, &rows)) return SIZE_MAX;
  /* P, f, w, coordinates (at most n a row), samples (index, diagonal) and the right sides. */
  if (!batten_mul3(rows + 1, k + 2 + n + 2 + 64 + 1, sizeof(double), &own)) return SIZE_MAX;
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

/* Largest |gradient|, [M][n]. */
static double largest_gradient(const batten_spline_data *d, const double *gradients) {
  double largest = 0;
  for (size_t q = 0; q < d->gradient_count; q++) {
    double square = 0;
    for (unsigned a = 0; a < d->n; a++) square += gradients[q * d->n + a] * gradients[q * d->n + a];
    if (!(square <= largest)) largest = square;
  }
  return sqrt(largest);
}

static batten_status make_right_side(fit *t) {
  const batten_spline_data *d = t->data;
  const spline_system *s = &t->system;
  double range = value_range(d, &t->middle), slope = s->scale * largest_gradient(d, d->gradients);
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

static batten_status solve(fit *t) {
  const spline_system *s = &t->system;
  if (s->rows == s->basis.count) {
    t->info.saddle.rcond = NAN;
    return solve_polynomial(t) ? BATTEN_OK : fail_singular(t, "as many conditions as monomials");
  }
  batten_saddle_matrix matrix = {
      .n = s->rows, .k = s->basis.count, .p = s->p, .fill = batten_spline_system_fill, .user = s};
  batten_saddle_options o = t->opt.saddle;
  if (s->power > 1) o.smooth_kernel = 1;
  batten_status st = batten_saddle_factor(t->ctx, &matrix, &o, &t->saddle);
  if (st >= 0) st = batten_saddle_solve(t->ctx, t->saddle, t->f, t->w, t->c);
  if (st == BATTEN_E_SINGULAR) return fail_singular(t, batten_error(t->ctx));
  if (st >= 0) t->info.saddle = batten_saddle_get_info(t->saddle);
  /* Its accuracy is judged on the spline, by check_residuals. */
  return st < 0 ? st : BATTEN_OK;
}

/* ---- leave-one-out ---- */

/* U_without_i(x_i) - v_i = -w_i / (inverse matrix)_ii  [Rippa 1999], with or without smoothing: the row and column
 * that go take the point's own smoothing with them. Points that the polynomial part cannot miss have no such error.
 */
static batten_status leave_one_out(fit *t) {
  const size_t count = t->system.count;
  size_t samples = t->opt.loo_samples < count ? t->opt.loo_samples : count;
  t->info.loo_rms = NAN;
  if (!t->saddle || samples == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  double *diagonal = batten_alloc_array(t->ctx, samples, sizeof *diagonal), largest = 0, sum = 0;
  size_t *index = batten_alloc_array(t->ctx, samples, sizeof *index), used = 0;
  if (!diagonal || !index) goto done;
  for (size_t q = 0; q < samples; q++) index[q] = q * (count / samples) + q * (count % samples) / samples;
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

/* Values at all points, gradients at those that have one; w has room for both: N + n M. */
static batten_status find_residuals(fit *t) {
  const batten_spline_data *d = t->data;
  const spline_system *s = &t->system;
  double middle, range = value_range(d, &middle), slope = largest_gradient(d, d->gradients), worst = 0;
  double *values = t->f, *gradients = values + s->count;
  batten_status st = batten_spline_evaluate(t->ctx, t->spline, s->count, d->points, values, NULL, NULL);
  if (st < 0) return st;
  for (size_t i = 0; i < s->count; i++) {
    double miss = fabs(values[i] + smoothing_at(t, i) * t->w[i] - d->values[i]);
    if (!(miss <= worst)) worst = miss;
  }
  /* Values that are all the same (a surface with its normals) have no range: the gradients say what is much. */
  if (range == 0) range = slope > 0 ? slope * s->scale : fabs(d->values[0]);
  t->info.residual_max = range > 0 ? worst / range : worst;
  if (s->gradient_count == 0) return BATTEN_OK;
  /* The points with gradients go where w was. */
  double *points = t->w;
  for (size_t q = 0; q < s->gradient_count; q++)
    for (unsigned a = 0; a < s->n; a++)
      points[q * s->n + a] = d->points[(d->gradient_at ? d->gradient_at[q] : q) * s->n + a];
  st = batten_spline_evaluate(t->ctx, t->spline, s->gradient_count, points, NULL, gradients, NULL);
  if (st < 0) return st;
  for (size_t q = 0; q < s->gradient_count * s->n; q++) gradients[q] -= d->gradients[q];
  worst = largest_gradient(d, gradients);
  if (slope == 0) slope = range / s->scale;
  t->info.gradient_residual_max = slope > 0 ? worst / slope : worst;
  return BATTEN_OK;
}

static batten_status judge(const fit *t) {
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
