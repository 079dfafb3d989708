/* Cones that bound first derivatives and their cross products: [section 4, eqs. 6 and 7].
 *
 * Vectors w near an axis a, w.a > 0, are described by two slopes (w.f_k) / (w.a), where a, f_0, f_1 are orthonormal.
 * A rectangle of slopes is a cone of four facets and four rays; a rectangle around the slopes of some vectors,
 * widened, bounds them with room to move. */
#ifndef BATTEN_CONVEX_CONES_H
#define BATTEN_CONVEX_CONES_H

#include <stdbool.h>
#include <stddef.h>

enum { CONVEX_CROSS_RAYS = 16 };

typedef struct convex_cone {
  double axis[3], side[2][3];
  double low[2], high[2]; /* slopes */
} convex_cone;

/* The narrowest cone around vectors [count][3], its axis their mean, side[0] in the plane of axis and `normal`. false
 * when they do not lie on one side. */
bool convex_cone_bound(size_t count, double (*vectors)[3], const double normal[3], convex_cone *out);

/* The same with its slopes wider by delta on each side. */
convex_cone convex_cone_widen(const convex_cone *cone, double delta);

/* w lies in the cone where facets[k].w >= 0 for all four; unit vectors. */
void convex_cone_facets(const convex_cone *cone, double facets[4][3]);

/* Rays (extreme ones, each with out.normal = 1, in cyclic order) of the least cone that contains the cross products
 * of all vectors of two cones. Returns their number, 0 when some cross product does not have normal.w > 0. */
size_t convex_cone_cross(const convex_cone *first, const convex_cone *second, const double normal[3],
                         double out[CONVEX_CROSS_RAYS][3]);

#endif
