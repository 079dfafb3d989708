/* The reference curve: of the wanted shape, near the data.   [Juettler: contour data, section 2.2 (i)]
 *
 * Its degree is smoothness + 1, its breaks are those of the fit or some of them, and it is then written in the space
 * of the fit. Construction 2 is least squares on fewer knots, construction 1 prescribes the directions of legs. What
 * counts in the end is whether linear inequalities can enclose the curve: contour_rows_make is asked.
 *
 * Departures from the paper. It expects construction 2 to be nearer to the data, and keeps the other one for want of
 * it. With directions that follow the data (reference_legs.c) neither is always nearer, and the nearer one leads to
 * the better fit: both are made, and their sums compared. Where few spans turn far, references may have a higher
 * degree than smoothness + 1, for more control points. A cubic span with inflections at both ends is straight, for
 * its x'' is linear: there references begin with degree 4, which the space of the fit must have. */
#include "reference.h"

#include "basis/refine.h"

#include <math.h>
#include <string.h>

enum { SAMPLES = 8 };

/* Bernstein coefficients -> the value at s, destroys them. */
static void casteljau(unsigned degree, double s, double (*c)[2], double value[2]) {
  for (unsigned r = degree; r > 0; r--)
    for (unsigned i = 0; i < r; i++)
      for (int k = 0; k < 2; k++) c[i][k] = (1 - s) * c[i][k] + s * c[i + 1][k];
  memcpy(value, c[0], 2 * sizeof *value);
}

/* Bernstein coefficients of the k-th derivative on span mu. */
static void derivative(const bspline *b, const double *control, size_t mu, unsigned k, double (*out)[2]) {
  double rows[BSPLINE_ORDER * BSPLINE_ORDER];
  unsigned order = b->degree + 1;
  bspline_rows(b, mu, k, b->knots[mu], b->knots[mu + 1], rows);
  for (unsigned i = 0; i + k < order; i++) {
    out[i][0] = out[i][1] = 0;
    for (unsigned j = 0; j < order; j++)
      for (unsigned c = 0; c < 2; c++) out[i][c] += rows[i * order + j] * control[2 * (mu - b->degree + j) + c];
  }
}

/* c of degree n vanishes at the left (right) end: divides by the distance from there. The new degree. */
static unsigned divide(unsigned n, bool left, double (*c)[2]) {
  for (unsigned i = 0; i < n; i++) {
    unsigned from = left ? i + 1 : i;
    double factor = (double)n / (double)(left ? i + 1 : n - i);
    for (int k = 0; k < 2; k++) c[i][k] = factor * c[from][k];
  }
  return n - 1;
}

static double span_quality(const bspline *b, const double *control, size_t mu, bool left, bool right, int sign) {
  double first[BSPLINE_ORDER][2], second[BSPLINE_ORDER][2], work[BSPLINE_ORDER][2], u[2], v[2], least = 1;
  unsigned n = b->degree - 2;
  derivative(b, control, mu, 1, first);
  derivative(b, control, mu, 2, second);
  if (n < (unsigned)left + (unsigned)right) return 0; /* straight */
  if (left) n = divide(n, true, second);
  if (right) n = divide(n, false, second);
  for (int i = 0; i <= SAMPLES; i++) {
    memcpy(work, first, sizeof work);
    casteljau(b->degree - 1, (double)i / SAMPLES, work, u);
    memcpy(work, second, sizeof work);
    casteljau(n, (double)i / SAMPLES, work, v);
    double size = hypot(u[0], u[1]) * hypot(v[0], v[1]), sine = size > 0 ? sign * contour_cross(u, v) / size : 0;
    least = fmin(least, sine);
  }
  return least;
}

void reference_assess(const contour_shape *shape, const bspline *b, const double *control, double *quality) {
  size_t s = 0;
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu), s++)
    quality[s] = span_quality(b, control, mu, shape->smoothness == 2 && contour_inflection(shape, s),
                              shape->smoothness == 2 && contour_inflection(shape, s + 1), shape->signs[s]);
}

batten_status reference_accept(batten_context *ctx, const reference_task *task, const bspline *b,
                               const double *reference, double *control, bool *accepted) {
  bspline_refine(b, 2, reference, &task->space->b, control);
  *accepted = contour_forward(task->ends, task->space->b.count, control);
  if (!*accepted) return BATTEN_OK;
  return contour_rows_make(ctx, task->shape, &task->space->b, control, task->rows, NULL, accepted, NULL);
}

/* Whether some span has inflections at both ends. */
static bool flat_span(const contour_shape *shape) {
  for (size_t s = 0; s < shape->spans; s++)
    if (contour_inflection(shape, s) && contour_inflection(shape, s + 1)) return true;
  return false;
}

static bool ends_fixed(const contour_ends *ends) {
  return ends && !(isnan(ends->point[0][0]) && isnan(ends->point[1][0]) && isnan(ends->tangent[0][0]) &&
                   isnan(ends->tangent[1][0]));
}

/* The lowest degree that references can have: smoothness + 1, but that a cubic span with inflections at both ends is
 * straight, and that a parabola alone has not enough legs for two tangents. */
static unsigned least_degree(const contour_shape *shape, const contour_ends *ends) {
  bool tangents = ends && !isnan(ends->tangent[0][0]) && !isnan(ends->tangent[1][0]);
  unsigned least = shape->smoothness + 1;
  bool more = shape->smoothness == 2 ? flat_span(shape) : shape->spans == 1 && tangents;
  return more ? least + 1 : least;
}

/* What keeps a reference from being found: INFEASIBLE. */
static batten_status none_found(batten_context *ctx, const reference_task *task, unsigned construction) {
  /* Over spans shorter than this x'' of a curve of size one is little more than rounding, 1e-16 / NEAR^2. */
  static const double NEAR = 1e-6;
  static const char none[] = "no reference curve of the wanted shape";
  const contour_shape *shape = task->shape;
  size_t least = 0;
  for (size_t i = 1; i < shape->spans; i++)
    if (shape->breaks[i + 1] - shape->breaks[i] < shape->breaks[least + 1] - shape->breaks[least]) least = i;
  double from = shape->breaks[least], width = shape->breaks[least + 1] - from;
  if (width < NEAR)
    return batten_fail(ctx, BATTEN_E_INFEASIBLE,
                       "%s: two knots or inflections at %g (of [0, 1]) are only %.2g apart; leave out one of them",
                       none, from, width);
  if (construction == 2)
    return batten_fail(ctx, BATTEN_E_INFEASIBLE, "%s: knot removal does not find one; allow construction 1", none);
  if (ends_fixed(task->ends))
    return batten_fail(ctx, BATTEN_E_INFEASIBLE,
                       "%s: the fixed ends contradict the signs of curvature, or leave no room; free them, or change "
                       "the inflections",
                       none);
  return batten_fail(ctx, BATTEN_E_INFEASIBLE,
                     "%s: runs between inflections turn too far for their number of spans; give more knots, or raise "
                     "opt.depth_max",
                     none);
}

batten_status contour_reference_find(batten_context *ctx, const contour_shape *shape, const contour_space *space,
                                     const contour_ends *ends, const contour_data *data, const double *parameters,
                                     unsigned construction, double tension, const contour_row_options *rows,
                                     contour_reference *out) {
  reference_task task = {shape, space, ends, data, parameters, tension, rows, least_degree(shape, ends)};
  if (task.degree > shape->degree)
    return batten_fail(ctx, BATTEN_E_INFEASIBLE,
                       "opt.inflections: between two of them a cubic piece is straight; give a knot between them, or "
                       "degree 4");
  size_t n = 2 * space->b.count;
  double *by_legs = batten_alloc_array(ctx, n, sizeof *by_legs);
  double *by_removal = batten_alloc_array(ctx, n, sizeof *by_removal);
  double legs = INFINITY, removal = INFINITY;
  batten_status st = by_legs && by_removal ? batten_progress(ctx, "reference", 0) : BATTEN_E_NOMEM;
  if (st >= 0 && construction != 1) st = reference_by_removal(ctx, &task, by_removal, &removal);
  if (st >= 0 && construction != 2) st = reference_by_legs(ctx, &task, by_legs, &legs);
  if (st >= 0 && isinf(legs) && isinf(removal)) st = none_found(ctx, &task, construction);
  if (st >= 0) {
    out->construction = legs < removal ? 1 : 2;
    out->fallback = construction != 1 && isinf(removal);
    memcpy(out->control, legs < removal ? by_legs : by_removal, n * sizeof *out->control);
    st = batten_progress(ctx, "reference", 1);
  }
  batten_free(ctx, by_removal);
  batten_free(ctx, by_legs);
  return st < 0 ? st : BATTEN_OK;
}
