#ifndef BATTEN_NETWORK_NORMALS_H
#define BATTEN_NETWORK_NORMALS_H

#include "network/net.h"

/* Brings a unit normal to what the node's constraint asks for, by as little as possible; c NULL = free. */
void net_normal_constrain(const net_constraint *c, double normal[3]);

#endif
