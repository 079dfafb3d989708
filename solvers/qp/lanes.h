/* Inner loops of the dense engines, once per instruction set; qp_lanes_now() gives the widest that the processor has.
 *
 * Every sum runs in LANES sums side by side, added up in a fixed order, and no product is contracted with a sum: all
 * sets give the same bits, and so do BLAS's of whatever make, which is not asked. Matrices are columns of length n,
 * ld apart: column-major, or rows of a caller. */
#ifndef BATTEN_QP_LANES_H
#define BATTEN_QP_LANES_H

#include <stddef.h>

enum { QP_LANES = 8 };

typedef struct qp_lanes {
  /* out[j] = a_j'x, j < count */
  void (*dots)(size_t n, size_t count, const double *a, size_t ld, const double *x, double *out);
  /* the same of vectors here and there */
  void (*dots_at)(size_t n, size_t count, const double *const *a, const double *x, double *out);
  /* x += factor * sum_j u[j] a_j */
  void (*combine)(size_t n, size_t count, const double *a, size_t ld, double factor, const double *u, double *x);
  /* a_j -= d[j] w */
  void (*subtract)(size_t n, size_t count, double *a, size_t ld, const double *w, const double *d);
  /* The pair (a, b) of vectors: a := c a + s b, b := c b - s a. */
  void (*rotate)(size_t n, double c, double s, double *a, double *b);
  /* products[k] := how far it is within [lower[k], upper[k]], negative outside; INFINITY where the two are equal */
  void (*slacks)(size_t count, const double *lower, const double *upper, double *products);
  /* a'a and a'x in one go */
  void (*squares)(size_t n, const double *a, const double *x, double *square, double *along);
} qp_lanes;

const qp_lanes *qp_lanes_now(void);
/* The sets that run here, widest first; NULL when there are no more. */
const qp_lanes *qp_lanes_at(unsigned index);

#endif
