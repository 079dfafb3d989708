/* Contours on their way from the lines of a file to planes. */
#ifndef BATTEN_EXCHANGE_CONTOURS_H
#define BATTEN_EXCHANGE_CONTOURS_H

#include "stream.h"

#include <batten/exchange.h>

/* Takes points in space [starts[count]][3] to the planes in which each contour lies: out [starts[count]][2], planes
 * [count]. Where a coordinate is constant, the others are taken over as they are. FORMAT: the points of a contour lie
 * in no plane, to 1e-6 of its size. */
batten_status bx_find_planes(bx_reader *r, size_t count, const size_t *starts, const double *points, double *out,
                             batten_plane *planes);

#endif
