/* Solids of the plane in space and back: extrusions, solids of revolution, cuts by planes. */
#include <string.h>

#include "base/checked.h"
#include "frep/gather.h"

/* ---- extrude: the meet of the plane's solid with lower <= z <= upper ------------------------------- */

static unsigned extrude_places(const batten_frep *a, const double *x, frep_place *p) {
  double below = x[2] - a->numbers[0], above = a->numbers[1] - x[2];
  *p = (frep_place){.y = {x[0], x[1]}, .jacobian = {{1, 0, 0}, {0, 1, 0}}};
  p->limit = fmin(below, above);
  p->limit_slope[2] = below <= above ? 1 : -1;
  return 1;
}

static unsigned extrude_images(const batten_frep *a, const interval *x, frep_image *image) {
  const interval none = {INFINITY, INFINITY};
  double lower = a->numbers[0], upper = a->numbers[1];
  interval below = isfinite(lower) ? interval_sub(x[2], interval_of(lower)) : none;
  interval above = isfinite(upper) ? interval_sub(interval_of(upper), x[2]) : none;
  *image = (frep_image){.y = {x[0], x[1]}, .limit = interval_min(below, above), .stretch = 1};
  /* both cannot be large at once */
  image->limit.hi = fmin(image->limit.hi, (upper - lower) / 2 * (1 + 1e-15));
  return 1;
}

static batten_status extrude_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  return frep_map_evaluate(a, ctx, extrude_places, count, points, values, gradients);
}

static batten_status extrude_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  return frep_map_bounds(a, ctx, extrude_images, count, boxes, ranges, NULL);
}

static batten_status extrude_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *slopes) {
  return frep_map_bounds(a, ctx, extrude_images, count, boxes, NULL, slopes);
}

static bool extrude_box(const batten_frep *a, double *lower, double *upper) {
  lower[2] = a->numbers[0];
  upper[2] = a->numbers[1];
  return isfinite(lower[2]) && isfinite(upper[2]) && frep_structural_box(a->children[0], lower, upper);
}

batten_status batten_frep_extrude(batten_context *ctx, batten_frep *a, double lower, double upper,
                                  batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 2);
  if (st < 0) return st;
  if (!(lower < upper) || lower == INFINITY || upper == -INFINITY)
    return batten_fail(ctx, BATTEN_E_INVALID, "upper: %g, lower: %g; give lower < upper", upper, lower);
  const double numbers[2] = {lower, upper};
  batten_frep_parts parts = {.n = 3, .number_count = 2, .numbers = numbers, .child_count = 1, .children = {a}};
  return frep_make(ctx, &frep_class_extrude, &parts, a->distance, NULL, out);
}

static batten_status extrude_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 2, 1);
  return st < 0 ? st : batten_frep_extrude(ctx, parts->children[0], parts->numbers[0], parts->numbers[1], out);
}

const frep_class frep_class_extrude = {.kind = BATTEN_FREP_KIND_EXTRUDE,
                                       .name = "extrude",
                                       .evaluate = extrude_evaluate,
                                       .bounds = extrude_bounds,
                                       .slopes = extrude_slopes,
                                       .box = extrude_box,
                                       .create = extrude_create};

/* ---- revolve: y = (sqrt(x0^2 + x1^2), x2) ----------------------------------------------------------- */

static unsigned revolve_places(const batten_frep *a, const double *x, frep_place *p) {
  (void)a;
  double r = sqrt(x[0] * x[0] + x[1] * x[1]), inverse = r > 0 ? 1 / r : 0; /* on the axis: the mean of all sides */
  *p = (frep_place){.y = {r, x[2]}, .jacobian = {{x[0] * inverse, x[1] * inverse, 0}, {0, 0, 1}}, .limit = INFINITY};
  return 1;
}

static unsigned revolve_images(const batten_frep *a, const interval *x, frep_image *image) {
  (void)a;
  *image = (frep_image){.y = {interval_hypot(x[0], x[1]), x[2]}, .limit = {INFINITY, INFINITY}, .stretch = 1 + 1e-12};
  return 1;
}

static batten_status revolve_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  return frep_map_evaluate(a, ctx, revolve_places, count, points, values, gradients);
}

static batten_status revolve_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  return frep_map_bounds(a, ctx, revolve_images, count, boxes, ranges, NULL);
}

static batten_status revolve_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *slopes) {
  return frep_map_bounds(a, ctx, revolve_images, count, boxes, NULL, slopes);
}

static bool revolve_box(const batten_frep *a, double *lower, double *upper) {
  double low[2], high[2];
  if (!frep_structural_box(a->children[0], low, high)) return false;
  for (unsigned k = 0; k < 2; k++) { /* nothing where the plane's solid lies on the other side of its axis */
    upper[k] = high[0] * (1 + 1e-15);
    lower[k] = -upper[k];
  }
  lower[2] = low[1];
  upper[2] = high[1];
  if (low[0] > high[0]) lower[2] = 1, upper[2] = -1;
  return true;
}

batten_status batten_frep_revolve(batten_context *ctx, batten_frep *a, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 2);
  if (st < 0) return st;
  batten_frep_parts parts = {.n = 3, .child_count = 1, .children = {a}};
  return frep_make(ctx, &frep_class_revolve, &parts, a->distance, NULL, out);
}

static batten_status revolve_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 0, 1);
  return st < 0 ? st : batten_frep_revolve(ctx, parts->children[0], out);
}

const frep_class frep_class_revolve = {.kind = BATTEN_FREP_KIND_REVOLVE,
                                       .name = "revolve",
                                       .evaluate = revolve_evaluate,
                                       .bounds = revolve_bounds,
                                       .slopes = revolve_slopes,
                                       .box = revolve_box,
                                       .create = revolve_create};

/* ---- section: y = origin + x0 axes[0] + x1 axes[1]; numbers: origin [3], axes [2][3] ----------------- */

static unsigned section_places(const batten_frep *a, const double *x, frep_place *p) {
  const double *origin = a->numbers, *u = origin + 3, *v = u + 3;
  for (unsigned k = 0; k < 3; k++) {
    p->y[k] = origin[k] + (x[0] * u[k] + x[1] * v[k]);
    p->jacobian[k][0] = u[k];
    p->jacobian[k][1] = v[k];
  }
  p->limit = INFINITY;
  return 1;
}

static unsigned section_images(const batten_frep *a, const interval *x, frep_image *image) {
  const double *origin = a->numbers, *u = origin + 3, *v = u + 3;
  *image = (frep_image){.limit = {INFINITY, INFINITY}, .stretch = 1 + 1e-8};
  for (unsigned k = 0; k < 3; k++)
    image->y[k] = interval_add(interval_of(origin[k]), frep_linear_range(2, (const double[2]){u[k], v[k]}, x));
  return 1;
}

static batten_status section_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  return frep_map_evaluate(a, ctx, section_places, count, points, values, gradients);
}

static batten_status section_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  return frep_map_bounds(a, ctx, section_images, count, boxes, ranges, NULL);
}

static batten_status section_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *slopes) {
  return frep_map_bounds(a, ctx, section_images, count, boxes, NULL, slopes);
}

static bool section_box(const batten_frep *a, double *lower, double *upper) {
  double low[3], high[3];
  if (!frep_structural_box(a->children[0], low, high)) return false;
  interval d[3];
  bool empty = false;
  for (unsigned k = 0; k < 3; k++) {
    empty = empty || low[k] > high[k];
    if (!empty) d[k] = interval_sub((interval){low[k], high[k]}, interval_of(a->numbers[k]));
  }
  for (unsigned i = 0; i < 2; i++) { /* axes are orthonormal to 1e-9 */
    if (!empty) {
      interval range = frep_linear_range(3, a->numbers + 3 + 3 * i, d);
      double slack = 1e-8 * (fabs(range.lo) + fabs(range.hi));
      lower[i] = range.lo - slack;
      upper[i] = range.hi + slack;
    } else {
      lower[i] = 1;
      upper[i] = -1;
    }
  }
  return true;
}

batten_status batten_frep_section(batten_context *ctx, batten_frep *a, const double origin[3],
                                  const double axes[2][3], batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 3);
  if (st >= 0) st = frep_check_numbers(ctx, "origin", 3, origin);
  if (st >= 0) st = frep_check_numbers(ctx, "axes", 6, axes ? axes[0] : NULL);
  if (st < 0) return st;
  for (unsigned i = 0; i < 2; i++)
    for (unsigned j = 0; j <= i; j++) {
      double dot = axes[i][0] * axes[j][0] + axes[i][1] * axes[j][1] + axes[i][2] * axes[j][2];
      if (!(fabs(dot - (i == j)) <= 1e-9)) /* as rotations of carriers */
        return batten_fail(ctx, BATTEN_E_INVALID,
                           "axes: rows %u and %u have the product %.12g, not %d; give orthonormal rows", j, i, dot,
                           i == j);
    }
  double numbers[9];
  memcpy(numbers, origin, 3 * sizeof *numbers);
  memcpy(numbers + 3, axes, 6 * sizeof *numbers);
  batten_frep_parts parts = {.n = 2, .number_count = 9, .numbers = numbers, .child_count = 1, .children = {a}};
  return frep_make(ctx, &frep_class_section, &parts, false, NULL, out);
}

static batten_status section_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 9, 1);
  if (st < 0) return st;
  double axes[2][3];
  memcpy(axes, parts->numbers + 3, sizeof axes);
  return batten_frep_section(ctx, parts->children[0], parts->numbers, (const double(*)[3])axes, out);
}

const frep_class frep_class_section = {.kind = BATTEN_FREP_KIND_SECTION,
                                       .name = "section",
                                       .evaluate = section_evaluate,
                                       .bounds = section_bounds,
                                       .slopes = section_slopes,
                                       .box = section_box,
                                       .create = section_create};
