/* Values and gradients of a spline at many points, in time that grows with the number of centres and points and not
 * with their product.
 *
 * The sum over the centres is a fast multipole sum, the polynomial is added to it. Each batch is planned anew; the
 * last plan is kept, since the next one can use its operators. */
#include "spline/inner.h"

#include "base/checked.h"
#include "basis/green.h"

#include <batten/fmm.h>

struct batten_spline_evaluator {
  batten_context *ctx;
  batten_spline *spline; /* retained */
  batten_radial kernel;
  double accuracy;
  double *centers;     /* [N][n] in the unit box, as the terms have them */
  double *dipoles;     /* [N][n]; NULL without gradient terms */
  batten_fmm *last[2]; /* without and with gradients; NULL before the first batch */
};

static size_t centre_count(const batten_spline *s) { return s->terms.plain + s->terms.hermite; }

batten_status batten_spline_evaluator_new(batten_context *ctx, batten_spline *s, double accuracy,
                                          batten_spline_evaluator **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!s || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", s ? "out" : "s");
  if (!(accuracy >= 1e-12 && accuracy <= 1e-3))
    return batten_fail(ctx, BATTEN_E_INVALID, "accuracy: %g; must be 1e-12 .. 1e-3", accuracy);
  const size_t n = s->parts.n, count = centre_count(s);
  if (n < 2)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "s: of one dimension, for which there are no fast sums; use "
                       "batten_spline_evaluate()");
  batten_status st = BATTEN_E_NOMEM;
  batten_spline_evaluator *e = batten_alloc(ctx, sizeof *e);
  if (!e) goto done;
  const int power = (int)s->terms.power;
  *e = (batten_spline_evaluator){.ctx = ctx,
                                 .spline = batten_spline_retain(s),
                                 .kernel = {.n = s->parts.n, .power = power, .logarithm = power % 2 == 0},
                                 .accuracy = accuracy};
  e->centers = batten_alloc_array(ctx, count, n * sizeof *e->centers);
  if (!e->centers) goto done;
  for (size_t j = 0; j < count; j++)
    for (size_t a = 0; a < n; a++) e->centers[j * n + a] = s->terms.x[a][j];
  if (s->terms.hermite) {
    e->dipoles = batten_alloc_array(ctx, count, n * sizeof *e->dipoles);
    if (!e->dipoles) goto done;
    for (size_t j = 0; j < count; j++)
      for (size_t a = 0; a < n; a++)
        e->dipoles[j * n + a] = j < s->terms.plain ? 0 : s->terms.g[a][j - s->terms.plain];
  }
  *out = e;
  e = NULL;
  st = BATTEN_OK;
done:
  batten_spline_evaluator_free(e);
  return st;
}

void batten_spline_evaluator_free(batten_spline_evaluator *e) {
  if (!e) return;
  for (int i = 0; i < 2; i++) batten_fmm_free(e->last[i]);
  batten_free(e->ctx, e->dipoles);
  batten_free(e->ctx, e->centers);
  batten_spline_free(e->spline);
  batten_free(e->ctx, e);
}

/* Plans the sums at y [count][n], in place of the plan before. */
static batten_status plan(batten_spline_evaluator *e, size_t count, const double *y, bool gradients) {
  batten_fmm_options o = batten_fmm_options_default();
  batten_fmm *made = NULL;
  o.accuracy = e->accuracy;
  o.gradients = gradients;
  o.dipoles = e->dipoles != NULL;
  o.share = e->last[gradients];
  batten_status st = batten_fmm_create(e->ctx, &e->kernel, centre_count(e->spline), e->centers, count, y, &o, &made);
  if (st < 0) return st;
  batten_fmm_free(e->last[gradients]);
  e->last[gradients] = made;
  return BATTEN_OK;
}

/* u [count] and g [count][n] hold the sums; they become U and its gradient. */
static void add_polynomial(const batten_spline *s, size_t count, const double *y, double *u, double *g) {
  const size_t n = s->parts.n;
  for (size_t i = 0; i < count; i++) {
    double at[3] = {0}, total[SPLINE_SUMS];
    for (size_t a = 0; a < n; a++) at[a] = y[i * n + a];
    batten_polynomial_sum(&s->basis, s->parts.polynomial, at, g != NULL, total);
    u[i] += total[0];
    for (size_t a = 0; a < n && g; a++) g[i * n + a] = (g[i * n + a] + total[1 + a]) / s->parts.scale;
  }
}

enum { CHECKED = 100 }; /* points whose values are summed directly too */

/* The largest error of u at some points, evenly drawn. */
static batten_status find_error(const batten_spline_evaluator *e, size_t count, const double *points, const double *u,
                                double *error) {
  const size_t n = e->spline->parts.n, checked = count < CHECKED ? count : CHECKED;
  double x[3 * CHECKED] = {0}, direct[CHECKED], worst = 0;
  for (size_t q = 0; q < checked; q++)
    for (size_t a = 0; a < n; a++) x[q * n + a] = points[(q * (count / checked)) * n + a];
  batten_status st = batten_spline_evaluate(e->ctx, e->spline, checked, x, direct, NULL, NULL);
  if (st < 0) return st;
  for (size_t q = 0; q < checked; q++) worst = fmax(worst, fabs(u[q * (count / checked)] - direct[q]));
  *error = worst;
  return BATTEN_OK;
}

batten_status batten_spline_evaluator_evaluate(batten_context *ctx, batten_spline_evaluator *e, size_t count,
                                               const double *points, double *values, double *gradients,
                                               double *value_error) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!e) return batten_fail(ctx, BATTEN_E_INVALID, "e: NULL; make it with batten_spline_evaluator_new()");
  if (e->ctx != ctx)
    return batten_fail(ctx, BATTEN_E_INVALID, "e: made with another context; pass the one it was made with");
  if (count && !points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL with count = %zu", count);
  const batten_spline_parts *p = &e->spline->parts;
  const size_t n = p->n;
  double *g = NULL, error = 0;
  batten_status st = BATTEN_E_NOMEM;
  double *y = batten_alloc_array(ctx, count, (n + 1) * sizeof *y); /* y [count][n], u [count] */
  if (!y) goto done;
  double *u = y + count * n;
  if (gradients) {
    g = batten_alloc_array(ctx, count, n * sizeof *g);
    if (!g) goto done;
  }
  for (size_t i = 0; i < count * n; i++) {
    y[i] = spline_to_box(points[i], p->origin[i % n], p->scale);
    if (fabs(y[i]) < 1e30) continue;
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "points[%zu][%zu]: %g; must be finite and within 1e30 boxes of the centres", i / n, i % n,
                     points[i]);
    goto done;
  }
  if ((st = plan(e, count, y, gradients != NULL)) < 0) goto done;
  st = batten_fmm_apply(ctx, e->last[gradients != NULL], e->spline->terms.w, e->dipoles, u, g);
  if (st < 0) goto done;
  add_polynomial(e->spline, count, y, u, g);
  if (value_error && count) st = find_error(e, count, points, u, &error);
  if (st < 0) goto done;
  for (size_t i = 0; i < count && values; i++) values[i] = u[i];
  for (size_t i = 0; i < count * n && gradients; i++) gradients[i] = g[i];
  if (value_error) *value_error = error;
done:
  batten_free(ctx, g);
  batten_free(ctx, y);
  return st;
}
