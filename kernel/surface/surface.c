/* Tensor-product B-spline surfaces: what they are made of. */
#include "surface_inner.h"

#include "base/checked.h"
#include "basis/check_knots.h"

#include <string.h>

static batten_status check_axis(batten_context *ctx, const batten_surface_form *form, int i, size_t *count) {
  unsigned d = form->degree[i];
  batten_status st = bspline_check_knots(ctx, i == 0 ? "[0]" : "[1]", d, BATTEN_SURFACE_DEGREE_MAX,
                                         form->knot_count[i], form->knots[i]);
  if (st >= 0) *count = form->knot_count[i] - d - 1;
  return st;
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
