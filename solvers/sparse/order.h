/* Orderings of the unknowns of symmetric sparse systems, for little fill or a narrow band. */
#ifndef BATTEN_SPARSE_ORDER_H
#define BATTEN_SPARSE_ORDER_H

#include <batten/base.h>
#include <stdint.h>

/* Pattern of a symmetric matrix, both triangles, without the diagonal: neighbours of i are
 * indices[starts[i] .. starts[i+1]-1], in any order, none twice. */
typedef struct sparse_graph {
  size_t count;
  size_t *starts;    /* [count + 1] */
  uint32_t *indices; /* [starts[count]] */
} sparse_graph;

void sparse_graph_free(batten_context *ctx, sparse_graph *g);

/* Reverse Cuthill-McKee from a pseudo-peripheral node of each component [George, Liu 1981, 4.3]:
 * order[place] = node; *bandwidth = largest distance of neighbours. Time O(entries log). */
batten_status sparse_order_band(batten_context *ctx, const sparse_graph *g, uint32_t *order, size_t *bandwidth);

/* Approximate minimum degree [Amestoy, Davis, Duff 1996]: order[place] = node. The graph is overwritten and freed. */
batten_status sparse_order_degree(batten_context *ctx, sparse_graph *g, uint32_t *order);

/* Nested dissection, small parts by minimum degree: order[place] = node. */
batten_status sparse_order_dissection(batten_context *ctx, const sparse_graph *g, uint32_t *order);

#endif
