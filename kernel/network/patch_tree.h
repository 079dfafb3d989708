/* A balanced tree of boxes around the control points of a network's patches. */
#ifndef BATTEN_NETWORK_PATCH_TREE_H
#define BATTEN_NETWORK_PATCH_TREE_H

#include <batten/network.h>
#include <stdint.h>

typedef struct net_box3 {
  double lower[3], upper[3];
} net_box3;

/* Node 0 holds order[0 .. count - 1]; a node of order[from .. to - 1], to - from > 1, numbered i, has the children
 * i + 1 with from .. mid - 1 and i + 2 (mid - from) with mid .. to - 1, mid = (from + to) / 2. */
typedef struct net_patch_tree {
  size_t count;
  uint32_t *order; /* [count] patches */
  net_box3 *boxes; /* [2 count - 1] */
} net_patch_tree;

/* Time O(P log P). Fails: NOMEM. Free it in any case. */
batten_status net_patch_tree_make(batten_context *ctx, const batten_network *network, net_patch_tree *out);
void net_patch_tree_free(batten_context *ctx, net_patch_tree *tree);

/* Squared distance of a point from a box, 0 within. */
double net_box3_distance2(const net_box3 *box, const double *point);

#endif
