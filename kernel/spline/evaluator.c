/* Values and gradients of a spline at many points, in time that grows with the number of centres and points and not
 * with their product: the sum over the centres is that of an evaluator of <batten/fmm.h>, the polynomial is added. */
#include "spline/inner.h"

#include "base/checked.h"
#include "basis/green.h"

#include <batten/fmm.h>

struct batten_spline_evaluator {
  batten_context *ctx;
  batten_spline *spline; /* retained */
  batten_fmm_evaluator *sums;
};

/* The terms as sources: in the unit box, those without gradients with dipoles of 0 where others have them. */
static batten_status make_sums(batten_context *ctx, const spline_terms *t, double accuracy,
                               batten_fmm_evaluator **out) {
  const size_t n = t->n, count = t->plain + t->hermite;
  const batten_radial kernel = {.n = t->n, .power = (int)t->power, .logarithm = t->power % 2 == 0};
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy;
  o.gradients = 1;
  o.dipoles = t->hermite > 0;
  batten_status st = BATTEN_E_NOMEM;
  double *dipoles = NULL, *centers = batten_alloc_array(ctx, count, n * sizeof *centers);
  if (!centers) goto done;
  if (o.dipoles && !(dipoles = batten_alloc_array(ctx, count, n * sizeof *dipoles))) goto done;
  for (size_t j = 0; j < count; j++)
    for (size_t a = 0; a < n; a++) {
      centers[j * n + a] = t->x[a][j];
      if (dipoles) dipoles[j * n + a] = j < t->plain ? 0 : t->g[a][j - t->plain];
    }
  st = batten_fmm_evaluator_new(ctx, &kernel, count, centers, t->w, dipoles, &o, out);
done:
  batten_free(ctx, dipoles);
  batten_free(ctx, centers);
  return st;
}

batten_status batten_spline_evaluator_new(batten_context *ctx, batten_spline *s, double accuracy,
                                          batten_spline_evaluator **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!s || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", s ? "out" : "s");
  if (!(accuracy >= 1e-12 && accuracy <= 1e-3))
    return batten_fail(ctx, BATTEN_E_INVALID, "accuracy: %g; must be 1e-12 .. 1e-3", accuracy);
  if (s->parts.n < 2)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "s: of one dimension, for which there are no fast sums; use "
                       "batten_spline_evaluate()");
  batten_status st = BATTEN_E_NOMEM;
  batten_spline_evaluator *e = batten_alloc(ctx, sizeof *e);
  if (!e) goto done;
  *e = (batten_spline_evaluator){.ctx = ctx, .spline = batten_spline_retain(s)};
  if ((st = make_sums(ctx, &s->terms, accuracy, &e->sums)) < 0) goto done;
  *out = e;
  e = NULL;
done:
  batten_spline_evaluator_free(e);
  return st;
}

void batten_spline_evaluator_free(batten_spline_evaluator *e) {
  if (!e) return;
  batten_fmm_evaluator_free(e->sums);
  batten_spline_free(e->spline);
  batten_free(e->ctx, e);
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

/* Up to CHECKED points, evenly drawn. */
static size_t checked_count(size_t count) { return count < CHECKED ? count : CHECKED; }
static size_t checked_point(size_t count, size_t q) { return q * (count / checked_count(count)); }

/* direct [CHECKED]: the values there by batten_spline_evaluate(). */
static batten_status sum_checked(const batten_spline_evaluator *e, size_t count, const double *points,
                                 double *direct) {
  const size_t n = e->spline->parts.n;
  double x[3 * CHECKED] = {0};
  for (size_t q = 0; q < checked_count(count); q++)
    for (size_t a = 0; a < n; a++) x[q * n + a] = points[checked_point(count, q) * n + a];
  return batten_spline_evaluate(e->ctx, e->spline, checked_count(count), x, direct, NULL, NULL);
}

/* y [count][n] in the unit box. */
static batten_status take_to_box(batten_context *ctx, const batten_spline_parts *p, size_t count,
                                 const double *points, double *y) {
  const size_t n = p->n;
  for (size_t i = 0; i < count * n; i++) {
    y[i] = spline_to_box(points[i], p->origin[i % n], p->scale);
    if (!(fabs(y[i]) < 1e30))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "points[%zu][%zu]: %g; must be finite and within 1e30 boxes of the centres", i / n, i % n,
                         points[i]);
  }
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
  const size_t n = e->spline->parts.n;
  double direct[CHECKED], error = 0, *spare = NULL, *u = values;
  batten_status st = BATTEN_E_NOMEM;
  double *y = batten_alloc_array(ctx, count, n * sizeof *y);
  if (!y) goto done;
  if (!values && !(u = spare = batten_alloc_array(ctx, count, sizeof *spare))) goto done;
  if ((st = take_to_box(ctx, &e->spline->parts, count, points, y)) < 0) goto done;
  if (value_error && (st = sum_checked(e, count, points, direct)) < 0) goto done;
  /* The last that can fail: it leaves values and gradients as they were. */
  if ((st = batten_fmm_evaluator_evaluate(ctx, e->sums, count, y, u, gradients)) < 0) goto done;
  add_polynomial(e->spline, count, y, u, gradients);
  for (size_t q = 0; q < checked_count(count) && value_error; q++)
    error = fmax(error, fabs(u[checked_point(count, q)] - direct[q]));
  if (value_error) *value_error = error;
done:
  batten_free(ctx, spare);
  batten_free(ctx, y);
  return st;
}
