/* Sparse rows, and the patterns of the interior point's systems. */
#ifndef BATTEN_QP_PATTERN_H
#define BATTEN_QP_PATTERN_H

#include "sparse/order.h"

/* Compressed rows. */
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

/* Pattern of C'C + H over the rows of C with keep[row] == 0 (NULL: all): two unknowns are neighbours when they meet
 * in a row or in H. Unknowns with drop[j] != 0 have no neighbours (NULL: none). TOO_LARGE when it has more than
 * `most` entries. */
batten_status qp_graph_condensed(batten_context *ctx, const qp_csr *h, const qp_csr *c, const unsigned char *keep,
                                 const unsigned char *drop, size_t most, sparse_graph *out);
/* Pattern of [H C'; C 0]: unknowns first, then rows. */
batten_status qp_graph_augmented(batten_context *ctx, const qp_csr *h, const qp_csr *c, sparse_graph *out);

#endif
