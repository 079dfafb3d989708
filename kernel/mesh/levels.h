/* Where a quantity that is linear on a triangle passes a level. */
#ifndef BATTEN_MESH_LEVELS_H
#define BATTEN_MESH_LEVELS_H

#include <stdbool.h>
#include <stdint.h>

/* True when the quantity, v at the three corners, passes the level: then segment is where, with the side where it is
 * larger on the left. A corner that is on the level counts to that side. segment NULL: only the question. The end on
 * an edge is the same in all bits for both of its triangles. */
bool levels_cut(const double *vertices, const uint32_t *corners, const double v[3], double level,
                double (*segment)[3]);

#endif
