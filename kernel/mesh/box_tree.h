/* Boxes along the axes, and a balanced tree of them. */
#ifndef BATTEN_MESH_BOX_TREE_H
#define BATTEN_MESH_BOX_TREE_H

#include <batten/base.h>
#include <stdint.h>

typedef struct box3 {
  double lower[3], upper[3];
} box3;

box3 box3_of_points(size_t count, const double (*points)[3]);
/* Squared distance of a point from a box, 0 within. */
double box3_distance2(const box3 *box, const double *point);

/* Node 0 holds order[0 .. count - 1]; a node of order[from .. to - 1], to - from > 1, numbered i, has the children
 * i + 1 with from .. mid - 1 and i + 2 (mid - from) with mid .. to - 1, mid = (from + to) / 2. */
typedef struct box_tree {
  size_t count;
  uint32_t *order; /* [count] leaves */
  box3 *boxes;     /* [2 count - 1] */
} box_tree;

/* Of leaves [count], count < 2^32. Time O(count log count). Fails: NOMEM. Free it in any case. */
batten_status box_tree_make(batten_context *ctx, size_t count, const box3 *leaves, box_tree *out);
void box_tree_free(batten_context *ctx, box_tree *tree);

#endif
