/* Signs of orientation determinants, exact for finite input short of under- and overflow; for kernel/mesh, and for
 * kernel/convex. */
#ifndef BATTEN_MESH_PREDICATES_H
#define BATTEN_MESH_PREDICATES_H

/* Sign of det [b - a, c - a] in the plane of the coordinates x and y (0 .. 2): +1 when a b c turn left. */
int batten_orient2d(const double *a, const double *b, const double *c, int x, int y);

/* Sign of det [b - a, c - a, d - a]: +1 when d lies on the side of a b c from which they are seen counter-clockwise.
 */
int batten_orient3d(const double *a, const double *b, const double *c, const double *d);

/* In the plane, a b c turning left: +1 when d lies inside of their circle, 0 on it, -1 outside. Scaled by a power of
 * two where that is needed: exact for coordinates below 1e300 in which no two of the points are 1e-70 times nearer
 * than others. */
int batten_incircle(const double *a, const double *b, const double *c, const double *d);

#endif
