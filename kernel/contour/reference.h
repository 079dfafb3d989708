/* What the two constructions of a reference share. */
#ifndef BATTEN_CONTOUR_REFERENCE_H
#define BATTEN_CONTOUR_REFERENCE_H

#include "contour_inner.h"

/* Where smoothness + 1 does not do, references may have so many degrees more, as far as the fit has them: they have
 * more control points on the same knots. */
enum { REFERENCE_MORE_DEGREES = 2 };

typedef struct reference_task {
  const contour_shape *shape; /* of the fit, as is the space */
  const contour_space *space;
  const contour_ends *ends; /* may be NULL */
  const contour_data *data;
  const double *parameters;
  double tension;
  const contour_row_options *rows;
  unsigned degree; /* the lowest that references can have: smoothness + 1, or one more */
} reference_task;

/* How clearly each span of a spline of a shape bends to its side: quality [spans] the least sine, with the sign of
 * the span, of the angle from x' to x'' at a few places; next to inflections where x'' vanishes, x'' over the
 * distance from there. What is <= 0 bends to the wrong side. */
void reference_assess(const contour_shape *shape, const bspline *b, const double *control, double *quality);

/* The curve in the space of the fit, control [task->space->b.count][2], and whether inequalities can enclose it. */
batten_status reference_accept(batten_context *ctx, const reference_task *task, const bspline *b,
                               const double *reference, double *control, bool *accepted);

/* Construction 1 (reference_legs.c) and 2 (reference_removal.c): control as above and its sum of squares, INFINITY
 * when there is none. Fail: NOMEM, CANCELLED, TOO_LARGE. */
batten_status reference_by_legs(batten_context *ctx, const reference_task *task, double *control, double *sum);
batten_status reference_by_removal(batten_context *ctx, const reference_task *task, double *control, double *sum);

#endif
