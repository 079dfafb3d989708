/* Planar curves as SVG paths, one each: lines, quadratic and cubic Bezier pieces as they are.
 *
 * Pieces of higher degree are taken as cubic Hermite interpolants of n equal parts, which join with equal tangents.
 * With x on [0, 1] an interpolant of width h is off by at most h^4 / 384 max |x''''|, in each direction and so in
 * length, and the control points of x'''' bound it: that gives n. */
#include "curves.h"
#include "spans.h"
#include "svg.h"

#include <math.h>
#include <string.h>

/* Point and derivative by de Casteljau's algorithm. */
static void evaluate(unsigned degree, const double (*points)[3], double t, double x[2], double dx[2]) {
  double line[BX_SPAN_DEGREE + 1][2];
  for (unsigned i = 0; i <= degree; i++) memcpy(line[i], points[i], sizeof line[i]);
  for (unsigned left = degree; left > 0; left--) {
    if (left == 1)
      for (int k = 0; k < 2; k++) dx[k] = degree * (line[1][k] - line[0][k]);
    for (unsigned i = 0; i < left; i++)
      for (int k = 0; k < 2; k++) line[i][k] = (1 - t) * line[i][k] + t * line[i + 1][k];
  }
  memcpy(x, line[0], sizeof line[0]);
}

/* Largest |x''''| that the control points allow. */
static double fourth_derivative(unsigned degree, const double (*points)[3]) {
  double most = 0;
  for (unsigned i = 0; i + 4 <= degree; i++) {
    double difference[2];
    for (int k = 0; k < 2; k++)
      difference[k] =
          points[i][k] - 4 * points[i + 1][k] + 6 * points[i + 2][k] - 4 * points[i + 3][k] + points[i + 4][k];
    most = fmax(most, hypot(difference[0], difference[1]));
  }
  return degree * (degree - 1.0) * (degree - 2.0) * (degree - 3.0) * most;
}

static void put_piece(bx_writer *w, const char *letter, const double (*points)[2], size_t count) {
  bx_put_text(w, letter);
  for (size_t i = 0; i < count; i++) {
    bx_put_u8(w, ' ');
    bx_put_numbers(w, points[i], 2);
  }
}

static void put_cubics(bx_writer *w, unsigned degree, const double (*points)[3], double tolerance) {
  enum { PARTS_MAX = 4096 }; /* by then the bound is below the rounding of the points */
  double parts = ceil(pow(fourth_derivative(degree, points) / 384 / tolerance, 0.25));
  unsigned count = parts >= 1 ? (unsigned)fmin(parts, PARTS_MAX) : 1;
  double from[2], slope[2], to[2], end_slope[2];
  evaluate(degree, points, 0, from, slope);
  for (unsigned i = 1; i <= count; i++) {
    double cubic[3][2];
    evaluate(degree, points, (double)i / count, to, end_slope);
    if (i == count) memcpy(to, points[degree], sizeof to);
    for (int k = 0; k < 2; k++) {
      cubic[0][k] = from[k] + slope[k] / (3.0 * count);
      cubic[1][k] = to[k] - end_slope[k] / (3.0 * count);
      cubic[2][k] = to[k];
    }
    put_piece(w, "\nC", (const double(*)[2])cubic, 3);
    memcpy(from, to, sizeof from);
    memcpy(slope, end_slope, sizeof slope);
  }
}

static void put_span(bx_writer *w, unsigned degree, const double (*points)[3], double tolerance) {
  static const char *const letters[] = {"\nL", "\nQ", "\nC"};
  double plane[3][2];
  if (degree > 3) {
    put_cubics(w, degree, points, tolerance);
    return;
  }
  for (unsigned i = 0; i < degree; i++) memcpy(plane[i], points[i + 1], sizeof plane[i]);
  put_piece(w, letters[degree - 1], (const double(*)[2])plane, degree);
}

static void put_curve(bx_writer *w, const batten_curve_form *form, double tolerance) {
  size_t count = bx_curve_points(form);
  double points[BX_SPAN_DEGREE + 1][3] = {{0}};
  put_piece(w, "M", (const double(*)[2])form->control_points, 1);
  for (size_t mu = bx_knot_span(form->degree, count, form->knots, 0); mu < count;
       mu = bx_knot_span(form->degree, count, form->knots, mu)) {
    for (unsigned i = 0; i <= form->degree; i++)
      memcpy(points[i], form->control_points + 2 * (mu - form->degree + i), 2 * sizeof(double));
    bx_span_to_bezier(form->degree, form->knots, mu, points, 1);
    put_span(w, form->degree, (const double(*)[3])points, tolerance);
  }
  if (form->closed) bx_put_text(w, "\nZ");
}

void bx_write_svg_curves(bx_writer *w, const bx_curve_set *set, batten_length_unit unit, double tolerance) {
  static const char *const names[] = {"mm", "cm", "cm", "in"}; /* SVG has no metres */
  double size = bx_svg_begin(w, set->lower, set->upper, names[unit], unit == BATTEN_UNIT_M ? 100 : 1);
  bx_put_text(w, "  <g " BX_SVG_UPWARDS " fill=\"none\" stroke=\"#1f3a5f\" stroke-width=\"");
  bx_put_number(w, size / 400);
  bx_put_text(w, "\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n");
  for (size_t i = 0; i < set->count && bx_goes_on(w, i, set->count); i++) {
    batten_curve_form form = batten_curve_get(set->curves[i]);
    bx_print(w, "    <path id=\"curve-%zu\" d=\"", i);
    put_curve(w, &form, tolerance);
    bx_put_text(w, "\"/>\n");
  }
  bx_put_text(w, "  </g>\n");
  bx_svg_end(w);
}
