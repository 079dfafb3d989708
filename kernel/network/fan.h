/* The spokes of a node: edges that end at it, counter-clockwise, each once. A closed fan has as many spokes as
 * triangles, an open one (boundary, crease) one more: the last is met along the half-edge that comes in.
 *
 *   for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) ... */
#ifndef BATTEN_NETWORK_FAN_H
#define BATTEN_NETWORK_FAN_H

#include "network/net.h"

typedef struct net_spoke {
  uint32_t half; /* runs out of the node; into it when `in` */
  bool in;
} net_spoke;

static inline net_spoke net_spoke_first(const net_topology *t, uint32_t node) {
  return (net_spoke){t->node_first[node], false};
}

/* The outgoing half-edge after h in the fan of h's node; NET_NONE at the fan's end. */
static inline uint32_t net_fan_next(const net_topology *t, uint32_t h) {
  uint32_t k = t->twin[net_prev(h)], node = t->node[h];
  return k == NET_NONE || k == t->node_first[node] || t->node[k] != node ? NET_NONE : k;
}

static inline net_spoke net_spoke_next(const net_topology *t, net_spoke s) {
  if (s.in) return (net_spoke){NET_NONE, false};
  uint32_t last = net_prev(s.half), k = t->twin[last], node = t->node[s.half];
  if (k != NET_NONE && t->node[k] == node) return (net_spoke){k == t->node_first[node] ? NET_NONE : k, false};
  return (net_spoke){last, true};
}

/* The end of the spoke's edge at which its node is. */
static inline unsigned net_spoke_end(const net_topology *t, net_spoke s) {
  return (t->half[t->edge[s.half]] == s.half) == s.in;
}

/* The vertex at its other end. */
static inline uint32_t net_spoke_vertex(const net_topology *t, net_spoke s) {
  return t->triangles[s.in ? s.half : net_next(s.half)];
}

#endif
