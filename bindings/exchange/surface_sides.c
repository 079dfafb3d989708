/* How the sides of a surface meet: what its boundary is as edges and vertices. */
#include "surface.h"

#include <math.h>

static const double *point_at(const batten_surface_form *form, size_t i, size_t j) {
  return form->control_points + 3 * (i * bx_form_points(form, 1) + j);
}

static bool near(const double a[3], const double b[3], double tolerance) {
  return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]) <= tolerance;
}

/* Control point k of a side, in the direction of its parameter. */
static const double *side_point(const batten_surface_form *form, unsigned side, size_t k) {
  size_t last[2] = {bx_form_points(form, 0) - 1, bx_form_points(form, 1) - 1};
  if (side % 2 == 0) return point_at(form, k, side == 0 ? 0 : last[1]);
  return point_at(form, side == 1 ? last[0] : 0, k);
}

static bool is_point(const batten_surface_form *form, unsigned side, double tolerance) {
  for (size_t k = 1; k < bx_form_points(form, side % 2); k++)
    if (!near(side_point(form, side, 0), side_point(form, side, k), tolerance)) return false;
  return true;
}

static bool are_same(const batten_surface_form *form, unsigned a, unsigned b, double tolerance) {
  for (size_t k = 0; k < bx_form_points(form, a % 2); k++)
    if (!near(side_point(form, a, k), side_point(form, b, k), tolerance)) return false;
  return true;
}

static void measure_box(const batten_surface_form *form, bx_sides *out) {
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  size_t count = bx_form_points(form, 0) * bx_form_points(form, 1);
  out->reach = 0;
  for (size_t i = 0; i < 3 * count; i++) {
    double x = form->control_points[i];
    lower[i % 3] = fmin(lower[i % 3], x);
    upper[i % 3] = fmax(upper[i % 3], x);
    out->reach = fmax(out->reach, fabs(x));
  }
  out->size = hypot(hypot(upper[0] - lower[0], upper[1] - lower[1]), upper[2] - lower[2]);
}

/* Is any facet of the control net wider than the tolerance? Their vector areas are half their diagonals' product. */
static bool has_area(const batten_surface_form *form, double size, double tolerance) {
  size_t rows = bx_form_points(form, 0), columns = bx_form_points(form, 1);
  double sum = 0;
  for (size_t i = 0; i + 1 < rows; i++)
    for (size_t j = 0; j + 1 < columns; j++) {
      double a[3], b[3];
      for (int x = 0; x < 3; x++) {
        a[x] = (point_at(form, i + 1, j + 1)[x] - point_at(form, i, j)[x]) / size;
        b[x] = (point_at(form, i, j + 1)[x] - point_at(form, i + 1, j)[x]) / size;
      }
      sum += 0.5 * hypot(hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2]), a[0] * b[1] - a[1] * b[0]);
    }
  return sum > tolerance / size;
}

static void join(bx_sides *s, unsigned a, unsigned b) {
  unsigned low = s->corner[a] < s->corner[b] ? s->corner[a] : s->corner[b], high = s->corner[a] + s->corner[b] - low;
  for (unsigned c = 0; c < BX_SIDES; c++)
    if (s->corner[c] == high) s->corner[c] = low;
}

/* Corner c is where side c of the loop begins. */
static void join_corners(const batten_surface_form *form, double tolerance, bx_sides *s) {
  const double *corners[BX_SIDES] = {side_point(form, 0, 0), side_point(form, 1, 0),
                                     side_point(form, 1, bx_form_points(form, 1) - 1),
                                     side_point(form, 3, bx_form_points(form, 1) - 1)};
  for (unsigned a = 0; a < BX_SIDES; a++) s->corner[a] = a;
  for (unsigned a = 0; a < BX_SIDES; a++) {
    if (s->point[a]) join(s, a, (a + 1) % BX_SIDES);
    for (unsigned b = a + 1; b < BX_SIDES; b++)
      if (near(corners[a], corners[b], tolerance)) join(s, a, b);
  }
}

batten_status bx_find_sides(batten_context *ctx, const batten_surface_form *form, batten_length_unit unit,
                            bx_sides *out) {
  measure_box(form, out);
  batten_status st = bx_check_cad_size(ctx, "surface", out->size, unit);
  if (st != BATTEN_OK) return st;
  double tolerance = bx_cad_uncertainty(out->size);
  if (!has_area(form, out->size, tolerance))
    return batten_fail(ctx, BATTEN_E_INVALID, "surface: its control points span no area; CAD files need a face");
  for (unsigned k = 0; k < BX_SIDES; k++) out->point[k] = is_point(form, k, tolerance);
  for (unsigned k = 0; k < 2; k++) {
    out->closed[1 - k] = are_same(form, k, k + 2, tolerance);
    if (out->closed[1 - k]) out->point[k + 2] = out->point[k];
  }
  join_corners(form, tolerance, out);
  return BATTEN_OK;
}
