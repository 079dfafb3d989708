/* What a curve is made of, for kernel/curve and kernel/contour.
 *
 * curve.c      create, free, parts              refine.c    knots, degree, parts, reversal, transformation
 * evaluate.c   points, derivatives, curvature   length.c    arc length and its inverse, samples
 * measure.c    box, area, curvature, energy     closest.c   nearest parameters
 * inflections.c  changes of sign                certify*.c  the proof of shape: includes nothing of kernel/contour
 * and not the blossoms of basis/bspline.c, with which its inequalities are made
 */
#ifndef BATTEN_CURVE_INNER_H
#define BATTEN_CURVE_INNER_H

#include <batten/curve.h>
#include <stdbool.h>

#include "basis/bspline.h"

struct batten_curve {
  batten_context *ctx;
  bspline space;          /* its knots are in the curve's one block */
  double *control_points; /* [space.count][2] */
  int exponent;           /* 2^exponent brings the larger side of the control points' box to [1, 2) */
  bool closed;
};

/* A curve that takes over nothing: copies knots and points without the checks of batten_curve_create. Fails: NOMEM,
 * TOO_LARGE. */
batten_status curve_make(batten_context *ctx, const bspline *space, const double *points, bool closed,
                         batten_curve **out);

/* x, x', x'' at t on span mu (at its ends from within): jet [order + 1][2]. points [count][2]. */
void curve_jet(const bspline *space, const double *points, size_t mu, double t, unsigned order, double (*jet)[2]);

/* The same with derivatives by 2^e t of 2^curve->exponent times the curve (not its point), so that the span is about 1
 * long. Returns e. */
int curve_jet_scaled(const batten_curve *curve, size_t mu, double t, unsigned order, double (*jet)[2]);
/* Of its x': the length, 0 with tangent 0 where it is below rounding. exponent: that e. */
double curve_tangent(const batten_curve *curve, size_t mu, int exponent, const double first[2], double tangent[2]);
/* The curvature there, in the scaled unit. */
double curve_curvature(const double tangent[2], double speed, const double second[2]);

/* t in the domain: of closed curves by whole periods. */
double curve_wrap(const batten_curve *curve, double t);

/* Whether t is a parameter of the curve; errors name it so, with [index] unless that is SIZE_MAX. Fails: INVALID. */
batten_status curve_check_parameter(batten_context *ctx, const batten_curve *curve, const char *name, size_t index,
                                    double t);

#endif
