/* Boxes of the domain on which the reference surface is convex enough for linear inequalities. [section 4]
 *
 * On a box, derivatives are polynomials in Bernstein form whose coefficients are linear in the control points. With
 * x_u in one cone, x_v in another, x_u x x_v = sum tau_k t_k, tau_k >= 0, over the rays t_k of a third. The second
 * fundamental form is then definite when all the matrices
 *
 *   H_k = [x_uu.t_k, x_uv.t_k; x_uv.t_k, x_vv.t_k]
 *
 * have definite coefficients, and a symmetric 2 x 2 matrix H is positive semidefinite when z_a'H z_(a + 1) >= 0 for
 * a = 0 .. P - 1, P >= 3, where z_0 .. z_(P - 1) are directions in angular order over a half turn and z_P = -z_0:
 * these are the facets of a polygonal cone inscribed in the round cone of semidefinite matrices, whose rays are
 * z_a^ z_a^' (z^ across z). So P inequalities do for a matrix, and none for z_a'H z_a. The directions are equally
 * spaced in the metric M of the reference's mean H: z_a = M^(-1/2) (cos, sin)(a pi / P), where H = M has all P values
 * equal to cos(pi / P), as far inside as can be. */
#ifndef BATTEN_CONVEX_BOXES_H
#define BATTEN_CONVEX_BOXES_H

#include "convex/cones.h"
#include "convex/convex_inner.h"

enum {
  CONVEX_DEGREE = 7,
  CONVEX_AXIS = CONVEX_DEGREE + 1,        /* coefficients along one axis */
  CONVEX_NET = CONVEX_AXIS * CONVEX_AXIS, /* of a net, of control points on a span pair */
  CONVEX_DIRECTIONS = 16
};

typedef struct convex_box {
  size_t span[2];
  double lower[2], upper[2];
  unsigned depth[2]; /* bisections of the span in each direction */
  double delta;      /* by which cones are wider than what the reference needs */
  size_t rows;
} convex_box;

/* Along one axis, on one box: rows [..][degree + 1] over the span's control points of the coefficients of values,
 * first and second derivatives, these two also with the degree raised to that of values. */
typedef struct convex_axis_rows {
  double value[CONVEX_NET], first[CONVEX_NET], first_raised[CONVEX_NET], second_raised[CONVEX_NET];
} convex_axis_rows;

/* The reference on a box, and what is asked there. */
typedef struct convex_patch {
  const convex_space *space;
  convex_axis_rows rows[2];
  double points[CONVEX_NET][3];  /* control points of the span pair */
  double first_u[CONVEX_NET][3]; /* coefficients of x_u [m][n + 1], x_v [m + 1][n] */
  double first_v[CONVEX_NET][3];
  double second[3][CONVEX_NET][3]; /* of x_uu, x_uv, x_vv [m + 1][n + 1] */
  double raised[2][CONVEX_NET][3]; /* of x_u, x_v, to the degree of second */
  double along[3][2];              /* parts of x_u and x_v that are taken from x_uu, x_uv, x_vv */
  convex_cone cone[2];             /* of x_u, x_v, not widened */
  double normal[3];                /* mean x_u x mean x_v */
  size_t ray_count;                /* widened by the box's delta */
  double rays[CONVEX_CROSS_RAYS][3];
  double form[CONVEX_DIRECTIONS][3]; /* z_a'H z_(a+1) = form . (H_uu, H_uv, H_vv) */
} convex_patch;

/* Fills rows, points, coefficients, cones for a box; false when the first derivatives have no cones. */
bool convex_patch_set(convex_patch *patch, const convex_space *space, const double *reference, const convex_box *box);

/* Rays and forms for cones widened by delta. Returns the least value of a form at the reference's coefficients as a
 * part of what it is at their mean, at most 1; -1 when the mean is not definite, -2 when cross products have no cone.
 */
double convex_patch_measure(convex_patch *patch, int sign, unsigned directions, double delta);

/* Boxes that cover the domain, on each of which the reference has share row_share of the best value with the widest
 * cones that allow it. *accepted = false when there are none within opt's limits. out NULL: only the question. The
 * array *out is the caller's to free. Fails: NOMEM. */
batten_status convex_boxes_make(batten_context *ctx, const convex_space *space, const double *reference,
                                const convex_row_options *opt, bool *accepted, int *sign, convex_box **out,
                                size_t *count);

#endif
