/* Delaunay triangulation of points of the plane. */
#ifndef BATTEN_MESH_DELAUNAY_H
#define BATTEN_MESH_DELAUNAY_H

#include <batten/base.h>
#include <stdint.h>

/* points [count][2], finite. *triangles [*triangle_count][3], counter-clockwise, freed by batten_free: they fill the
 * convex hull, and no point lies inside the circle of any (by exact arithmetic, see batten_incircle). None when all
 * points lie on one line: then *triangle_count = 0. Of points at one place only that of the lowest index is a corner;
 * first [count], or NULL: that one's index for each. Coordinates count to some 2^-256 of the largest. Which diagonals
 * cocircular points get does not depend on the order in which they come. Time O(count log count). Fails: TOO_LARGE,
 * NOMEM. */
batten_status batten_mesh_delaunay(batten_context *ctx, size_t count, const double *points, uint32_t *first,
                                   size_t *triangle_count, uint32_t **triangles);

#endif
