/* The best plane of points, and the least rectangle around them in it; for kernel/convex only. */
#ifndef BATTEN_CONVEX_PLANE_H
#define BATTEN_CONVEX_PLANE_H

#include <batten/base.h>
#include <stdbool.h>

/* Points in a box of size about 1 around 0, wherever they lie: squares and cubes of coordinates stay in range, and
 * scaling the points by a power of two changes nothing. */
typedef struct convex_scale {
  double scale, middle[3], unit; /* ((point * scale) - middle) * unit; scale and unit are powers of two */
  double rounding;               /* what rounding of the points' coordinates is in this unit */
} convex_scale;
/* count >= 1. Fails: INVALID (a coordinate that is not finite; all points at one place). */
batten_status convex_scale_find(batten_context *ctx, size_t count, const double *points, convex_scale *out);
void convex_scale_apply(const convex_scale *s, const double *point, double out[3]);

/* Coordinates flat [count][2] of points in their scale along the sides of the rectangle, >= 0, lengths true; size [2]
 * of the rectangle, > 0, is the largest of each, and axes [2] are the unit directions of its sides. The rules for
 * which side is which are at batten_parametrize. weights [count], NULL = ones: what the plane is best for; the
 * rectangle holds all points. count >= 3. Fails: INVALID (points on a line), TOO_LARGE, NOMEM. */
batten_status convex_plane_project(batten_context *ctx, size_t count, const double *points, const double *weights,
                                   const convex_scale *scale, double *flat, double size[2], double axes[2][3]);

/* How well a direction suits as u: its part along the coordinate axis that follows the normal's largest coordinate.
 */
double convex_plane_suits_u(const double normal[3], const double direction[3]);

#endif
