/* The smoothing spline again, with its curvature kept to given signs: what that costs says how much the data speak
 * for the runs that it does not have. */
#ifndef BATTEN_CONTOUR_SMOOTH_FORCED_H
#define BATTEN_CONTOUR_SMOOTH_FORCED_H

#include "smooth.h"

/* Where and which way the curve may bend. */
typedef struct contour_site {
  size_t span;
  double u;        /* in the span */
  double stiff;    /* of its row: many times 1 / variance */
  signed char way; /* +1, -1, 0 = as it likes */
  double bend;     /* [x', x''] / |x'| */
  double step;     /* what a step of Newton's changes it by */
} contour_site;

typedef struct contour_forced {
  const contour_smooth *smooth;
  double lambda; /* may be larger than that of smooth */
  size_t count;
  contour_site *sites; /* [count] in order of t */
  double *system;      /* [2 functions][2 width + 2] of both coordinates */
  double *right;       /* [2 functions] coordinate k of row j at 2 j + k */
  double *control;     /* [2][functions] of the last solution */
  double *direction;   /* [2][functions] whose x' the inequalities have */
  double *step;        /* [2][functions] */
} contour_forced;
enum { CONTOUR_SITES = 2 }; /* a span */
batten_status contour_forced_new(batten_context *ctx, const contour_smooth *s, double lambda, contour_forced *out);
void contour_forced_free(batten_context *ctx, contour_forced *f);
/* The least sum (see contour_smooth_cost) with the sites' ways; INFINITY when there is none in floating point. */
double contour_forced_solve(contour_forced *f, double *squares);

#endif
