#ifndef BATTEN_NETWORK_NORMALS_H
#define BATTEN_NETWORK_NORMALS_H

#include "network/net.h"

/* Brings a unit normal to what the node's constraint asks for, by as little as possible; c NULL = free. */
void net_normal_constrain(const net_constraint *c, double normal[3]);

/* The normal, within the node's constraint, that sees all of the node's triangles best: its least product with theirs,
 * which is returned, is nearly as large as can be. */
double net_normal_front(const net_topology *t, uint32_t node, double normal[3]);

/* Turns a normal of a node, no more than it takes, until it sees all of the node's triangles from the front: where it
 * does not, edges come out of order in the tangent plane, and facets turn over. True when it was turned. Where no
 * normal sees them all, the one that comes nearest to it. */
bool net_normal_guard(const net_topology *t, uint32_t node, double normal[3]);

#endif
