/* Between contours.c, contours_check.c and contours_knots.c. */
#ifndef BATTEN_LOFT_CONTOURS_INNER_H
#define BATTEN_LOFT_CONTOURS_INNER_H

#include "loft_inner.h"

/* A curve as it came, but scaled, over [0, 1] and of the stack's degree; clamped, closed or not. */
typedef struct contours_raw {
  char name[32]; /* in error texts: contours[3], opt.slopes[0] */
  bool closed, slope;
  unsigned raised; /* by so many degrees: each knot is there so many times more than it was given */
  bspline b;       /* its knots are `knots` */
  double *knots;
  double *points; /* [b.count][2] */
  double domain[2];
  /* Its knots as they shall be, the last of closed ones being the first: [spans + 1] */
  size_t spans;
  double *breaks;
  unsigned *folds;
  bool moved; /* some of them are not where they were */
} contours_raw;

void contours_raw_free(batten_context *ctx, contours_raw *r);

/* ---- contours_check.c ---------------------------------------------------------------------------- */

/* All that can be told of the arguments before anything is computed. Fails: INVALID. */
batten_status contours_check(batten_context *ctx, size_t count, const batten_curve *const *contours,
                             const double *heights, const batten_loft_options *opt);
/* Neighbours that run against each other. raw [count]. Fails: INVALID, NOMEM. */
batten_status contours_check_directions(batten_context *ctx, size_t count, const contours_raw *raw);

/* ---- contours_knots.c: raw without points are none ------------------------------------------------ */

/* The stack's smoothness: wanted, or (0) what all have, 2 at most. Fails: INVALID (one that has less). */
batten_status contours_smoothness(batten_context *ctx, size_t count, const contours_raw *raw, unsigned wanted,
                                  unsigned *out);
/* Breaks and folds of all: knots of different ones that are nearer than the tolerance become that of the first, and
 * no knot is there more often than smoothness allows. Fails: NOMEM. */
batten_status contours_merge(batten_context *ctx, size_t count, contours_raw *raw, double tolerance,
                             unsigned smoothness);
/* The spline over these knots: its control points, and by how much it differs. Fails: NOMEM, TOO_LARGE. */
batten_status contours_convert(batten_context *ctx, const contours_raw *raw, loft_space *space, double **points,
                               double *shift);

/* x'' at vertex v is 0 to rounding; legs [2] and their knot intervals. */
bool contours_is_flat(const loft_space *space, const double *points, ptrdiff_t v);

#endif
