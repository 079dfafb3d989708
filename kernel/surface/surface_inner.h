/* What a surface is made of, for kernel/surface and kernel/convex.
 *
 * surface.c    create, free, parts         evaluate.c   points, normals, curvatures
 * closest.c    nearest places              tessellate.c meshes
 * measure.c    area, extremes of K         certify*.c   the proof of convexity: includes nothing of kernel/convex and
 *                                          not the blossoms of basis/bspline.c, with which its inequalities are made
 */
#ifndef BATTEN_SURFACE_INNER_H
#define BATTEN_SURFACE_INNER_H

#include <batten/surface.h>

#include "basis/bspline.h"

struct batten_surface {
  batten_context *ctx;
  bspline space[2];       /* their knots are in the surface's one block */
  double *control_points; /* [space[0].count][space[1].count][3] */
};

/* S, S_u, S_v, S_uu, S_uv, S_vv at a place of the domain: jet [6][3]. */
void surface_jet(const batten_surface *surface, const double place[2], double (*jet)[3]);

#endif
