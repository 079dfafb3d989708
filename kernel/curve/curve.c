/* Planar B-spline curves: what they are made of. */
#include "curve_inner.h"

#include "base/checked.h"
#include "basis/check_knots.h"

#include <string.h>

void curve_points_box(size_t count, const double *points, double lower[2], double upper[2]) {
  for (size_t x = 0; x < 2; x++) {
    lower[x] = upper[x] = points[x];
    for (size_t i = 1; i < count; i++) {
      lower[x] = fmin(lower[x], points[2 * i + x]);
      upper[x] = fmax(upper[x], points[2 * i + x]);
    }
  }
}

/* The larger side of the points' box. */
static double box_size(size_t count, const double *points) {
  double lower[2], upper[2];
  curve_points_box(count, points, lower, upper);
  return fmax(upper[0] - lower[0], upper[1] - lower[1]);
}

batten_status curve_make(batten_context *ctx, const bspline *space, const double *points, bool closed,
                         batten_curve **out) {
  size_t knots = space->count + space->degree + 1, numbers, bytes;
  batten_mul(space->count, 2, &numbers);
  batten_add(numbers, knots, &numbers);
  batten_mul(numbers, sizeof(double), &bytes);
  batten_add(bytes, sizeof(batten_curve), &bytes);
  if (bytes == SIZE_MAX) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu control points; give fewer", space->count);
  batten_curve *c = batten_alloc(ctx, bytes);
  if (!c) return BATTEN_E_NOMEM;
  double *block = (double *)(c + 1);
  c->ctx = ctx;
  c->closed = closed;
  c->space = (bspline){space->degree, space->count, block};
  memcpy(block, space->knots, knots * sizeof *block);
  c->control_points = block + knots;
  memcpy(c->control_points, points, 2 * space->count * sizeof *points);
  double size = box_size(space->count, points);
  c->exponent = size > 0 && isfinite(size) ? ilogb(batten_unit(size)) : 0;
  *out = c;
  return BATTEN_OK;
}

static batten_status check_points(batten_context *ctx, const batten_curve_form *form, size_t count) {
  const double *points = form->control_points;
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "control_points: NULL; give [%zu][2]", count);
  size_t bad = batten_first_nonfinite(2 * count, points);
  if (bad < 2 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "control_points[%zu][%zu]: %g; give finite points", bad / 2, bad % 2,
                       points[bad]);
  if (!isfinite(box_size(count, points)))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "control_points: their box is larger than a double can say; scale them");
  const double *last = points + 2 * (count - 1);
  if (form->closed && memcmp(points, last, 2 * sizeof *points) != 0)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "control_points[%zu]: (%.17g, %.17g) is not the first one, (%.17g, %.17g), to the bit; a "
                       "closed curve needs it to be",
                       count - 1, last[0], last[1], points[0], points[1]);
  return BATTEN_OK;
}

batten_status batten_curve_create(batten_context *ctx, const batten_curve_form *form, batten_curve **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!form || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a form and room for its curve", form ? "out" : "form");
  batten_status st =
      bspline_check_knots(ctx, "", form->degree, BATTEN_CURVE_DEGREE_MAX, form->knot_count, form->knots);
  if (st < 0) return st;
  bspline space = {form->degree, form->knot_count - form->degree - 1, form->knots};
  st = check_points(ctx, form, space.count);
  return st < 0 ? st : curve_make(ctx, &space, form->control_points, form->closed != 0, out);
}

void batten_curve_free(batten_curve *curve) {
  if (curve) batten_free(curve->ctx, curve);
}

batten_curve_form batten_curve_get(const batten_curve *curve) {
  const bspline *b = &curve->space;
  return (batten_curve_form){.degree = b->degree,
                             .knot_count = b->count + b->degree + 1,
                             .knots = b->knots,
                             .control_points = curve->control_points,
                             .closed = curve->closed};
}
