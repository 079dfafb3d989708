/* Triangulation of points without triangles; for kernel/convex only. */
#ifndef BATTEN_CONVEX_CLOUD_H
#define BATTEN_CONVEX_CLOUD_H

#include "disc.h"
#include "plane.h"

/* The disc that FLOATER takes where none is given, see <batten/convex.h>. first [count]: the lowest index at each
 * point's place in the plane, whose others are in no triangle. Fails: INVALID, TOO_LARGE, NOMEM. */
batten_status convex_cloud_triangulate(batten_context *ctx, size_t count, const double *points,
                                       const convex_scale *scale, uint32_t *first, convex_disc *disc);

#endif
