/* Tensor-product B-spline surfaces: what they are made of. */
#include "surface_inner.h"

#include "base/checked.h"

#include <string.h>

static batten_status check_axis(batten_context *ctx, const batten_surface_form *form, int i, size_t *count) {
  unsigned d = form->degree[i];
  if (d < 1 || d > BATTEN_SURFACE_DEGREE_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "degree[%d]: %u; give 1 to %d", i, d, BATTEN_SURFACE_DEGREE_MAX);
  size_t n = form->knot_count[i];
  const double *knots = form->knots[i];
  if (n < 2 * (size_t)(d + 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "knot_count[%d]: %zu; degree %u needs %u knots at least", i, n, d,
                       2 * (d + 1));
  if (!knots) return batten_fail(ctx, BATTEN_E_INVALID, "knots[%d]: NULL; give %zu", i, n);
  size_t bad = batten_first_nonfinite(n, knots);
  if (bad < n) return batten_fail(ctx, BATTEN_E_INVALID, "knots[%d][%zu]: %g; give finite knots", i, bad, knots[bad]);
  *count = n - d - 1;
  for (size_t k = 0; k + 1 < n; k++)
    if (knots[k] > knots[k + 1])
      return batten_fail(ctx, BATTEN_E_INVALID, "knots[%d][%zu]: %.17g is below the knot before it; sort them", i,
                         k + 1, knots[k + 1]);
  if (knots[0] == knots[n - 1])
    return batten_fail(ctx, BATTEN_E_INVALID, "knots[%d]: all are %.17g; give a domain of some length", i, knots[0]);
  for (size_t k = 1; k < n; k++) {
    bool end = k <= d || k > *count;
    bool equal = knots[k] == knots[k - 1];
    if (end && !equal)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "knots[%d][%zu]: %.17g; the first and the last %u knots of degree %u must be equal", i, k,
                         knots[k], d + 1, d);
    /* One inner knot at the upper end is one too many; those at the lower one repeat the first d + 1. */
    if (!end && k >= d && (knots[k] == knots[k - d] || (k == *count && equal)))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "knots[%d][%zu]: %.17g repeats too often; inner knots may be there %u times", i, k, knots[k],
                         d);
  }
  if (!isfinite(knots[n - 1] - knots[0]))
    return batten_fail(ctx, BATTEN_E_INVALID, "knots[%d]: %g to %g; their distance is beyond a double", i, knots[0],
                       knots[n - 1]);
  return BATTEN_OK;
}

/* The exponent that brings the size of the points' box to about 1; false when that size is beyond a double. */
static bool find_exponent(size_t count, const double *points, int *out) {
  double size = 0;
  for (int d = 0; d < 3; d++) {
    double lower = points[d], upper = points[d];
    for (size_t i = 1; i < count; i++) {
      lower = fmin(lower, points[3 * i + (size_t)d]);
      upper = fmax(upper, points[3 * i + (size_t)d]);
    }
    size = fmax(size, upper - lower);
  }
  *out = size > 0 && isfinite(size) ? ilogb(batten_unit(size)) : 0;
  return isfinite(size);
}

batten_status batten_surface_create(batten_context *ctx, const batten_surface_form *form, batten_surface **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!form || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a form and room for its surface",
                       form ? "out" : "form");
  size_t n[2], points, knots, bytes;
  int exponent;
  for (int i = 0; i < 2; i++) {
    batten_status st = check_axis(ctx, form, i, &n[i]);
    if (st < 0) return st;
  }
  if (!form->control_points) return batten_fail(ctx, BATTEN_E_INVALID, "control_points: NULL; give [n_0][n_1][3]");
  batten_mul3(n[0], n[1], 3, &points);
  batten_add(form->knot_count[0], form->knot_count[1], &knots);
  batten_add(points, knots, &bytes);
  batten_mul(bytes, sizeof(double), &bytes);
  batten_add(bytes, sizeof(batten_surface), &bytes);
  if (bytes == SIZE_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu x %zu control points; give fewer", n[0], n[1]);
  size_t bad = batten_first_nonfinite(points, form->control_points);
  if (bad < points)
    return batten_fail(ctx, BATTEN_E_INVALID, "control_points[%zu][%zu][%zu]: %g; give finite points", bad / 3 / n[1],
                       bad / 3 % n[1], bad % 3, form->control_points[bad]);
  if (!find_exponent(points / 3, form->control_points, &exponent))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "control_points: their box is larger than a double can say; scale them");
  batten_surface *s = batten_alloc(ctx, bytes);
  if (!s) return BATTEN_E_NOMEM;
  s->ctx = ctx;
  s->exponent = exponent;
  double *block = (double *)(s + 1);
  for (int i = 0; i < 2; i++) {
    memcpy(block, form->knots[i], form->knot_count[i] * sizeof *block);
    s->space[i] = (bspline){form->degree[i], n[i], block};
    block += form->knot_count[i];
  }
  s->control_points = block;
  memcpy(block, form->control_points, points * sizeof *block);
  *out = s;
  return BATTEN_OK;
}

void batten_surface_free(batten_surface *surface) {
  if (surface) batten_free(surface->ctx, surface);
}

batten_surface_form batten_surface_get(const batten_surface *surface) {
  batten_surface_form form = {.control_points = surface->control_points};
  for (int i = 0; i < 2; i++) {
    const bspline *b = &surface->space[i];
    form.degree[i] = b->degree;
    form.knot_count[i] = b->count + b->degree + 1;
    form.knots[i] = b->knots;
  }
  return form;
}
