/* The vertex enclosure of single patches: what fill_peters.c solves at the nodes before it fills facets. */
#ifndef BATTEN_NETWORK_FILL_PETERS_H
#define BATTEN_NETWORK_FILL_PETERS_H

#include "network/net.h"

/* twists [3 faces]: n . S_uv of a patch at the corner at which the half-edge starts, u along it and v along the
 * facet's other side there. *residual (may be NULL): the largest curvature by which curves at a node of an even
 * number of facets miss what any twists can meet, 1 / unit of the coordinates. */
batten_status net_peters_twists(batten_context *ctx, const net_topology *t, const double *normals,
                                const net_local *local, double *twists, double *residual);

#endif
