/* The best plane of points, and the least rectangle around them in it; for kernel/convex only. */
#ifndef BATTEN_CONVEX_PLANE_H
#define BATTEN_CONVEX_PLANE_H

#include <batten/base.h>

/* Coordinates flat [count][2] along the sides of the rectangle, >= 0, lengths true to each other (in units of about
 * the points' size); size [2] of the rectangle, > 0, is the largest of each, and axes [2] are the unit directions of
 * its sides. The rules for which side is which are at batten_parametrize. count >= 3. Fails: INVALID (a coordinate
 * that is not finite; points on a line), TOO_LARGE, NOMEM. */
batten_status convex_plane_project(batten_context *ctx, size_t count, const double *points, double *flat,
                                   double size[2], double axes[2][3]);

#endif
