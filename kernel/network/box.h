/* The box of a network's surface. */
#ifndef BATTEN_NETWORK_BOX_H
#define BATTEN_NETWORK_BOX_H

#include <batten/network.h>

/* lower, upper: in: the box of some points of the surface; out: a box that holds all of it, larger than the least one
 * by 1e-6 of its size or less where that is within reach of 8 splits. Fails: NOMEM. */
batten_status net_box(batten_context *ctx, const batten_network *network, double lower[3], double upper[3]);

#endif
