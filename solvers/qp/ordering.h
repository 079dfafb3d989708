/* Orderings of the unknowns of symmetric sparse systems, for little fill or a narrow band. */
#ifndef BATTEN_QP_ORDERING_H
#define BATTEN_QP_ORDERING_H

#include <batten/base.h>
#include <stdint.h>

/* Pattern of a symmetric matrix, both triangles, without the diagonal: neighbours of i are
 * indices[starts[i] .. starts[i+1]-1], in any order, none twice. */
typedef struct qp_graph {
  size_t count;
  size_t *starts;    /* [count + 1] */
  uint32_t *indices; /* [starts[count]] */
} qp_graph;

void qp_graph_free(batten_context *ctx, qp_graph *g);

/* Pattern of C'C + H over the rows of C with keep[row] == 0 (NULL: all): two unknowns are neighbours when they meet
 * in a row or in H. c and h as compressed rows; unknowns with drop[j] != 0 have no neighbours (NULL: none). TOO_LARGE
 * when it has more than `most` entries. */
typedef struct qp_csr {
  size_t rows, columns;
  const size_t *starts;
  const uint32_t *indices;
  const double *values;
} qp_csr;

/* Row i of a at x. */
static inline double qp_csr_dot(const qp_csr *a, size_t i, const double *x) {
  double sum = 0;
  for (size_t e = a->starts[i]; e < a->starts[i + 1]; e++) sum += a->values[e] * x[a->indices[e]];
  return sum;
}

batten_status qp_graph_condensed(batten_context *ctx, const qp_csr *h, const qp_csr *c, const unsigned char *keep,
                                 const unsigned char *drop, size_t most, qp_graph *out);
/* Pattern of [H C'; C 0]: unknowns first, then rows. */
batten_status qp_graph_augmented(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_graph *out);

/* Reverse Cuthill-McKee from a pseudo-peripheral node of each component [George, Liu 1981, 4.3]:
 * order[place] = node; *bandwidth = largest distance of neighbours. Time O(entries log). */
batten_status qp_order_band(batten_context *ctx, const qp_graph *g, uint32_t *order, size_t *bandwidth);

/* Approximate minimum degree [Amestoy, Davis, Duff 1996]: order[place] = node. The graph is overwritten and freed. */
batten_status qp_order_degree(batten_context *ctx, qp_graph *g, uint32_t *order);

#endif
