/* A symmetric positive definite matrix B of order n in rectangular full packed storage (Gustavson, Wasniewski,
 * Dongarra, Langou 2010): n (n + 1) / 2 elements, every block a plain column-major one, so that all work is level-3
 * BLAS. LAPACK's transr = 'N', uplo = 'L', hence dpftrs reads the same factor. With n1 = ceil(n / 2), n2 = n - n1:
 *
 *     B = [ B11      ]   B11 lower [n1], with B21 [n2][n1] right below it: one trapezoid [n][n1];
 *         [ B21  B22 ]   B22 as upper [n2], in the triangle that the trapezoid leaves free.
 *
 *     n = 5 (ld 5):   00 33 43      n = 6 (ld 7):   33 43 53
 *                     10 11 44                      00 44 54
 *                     20 21 22                      10 11 55
 *                     30 31 32                      20 21 22
 *                     40 41 42                      30 31 32
 *                                                   40 41 42
 *                                                   50 51 52
 */
#ifndef BATTEN_SADDLE_RFP_H
#define BATTEN_SADDLE_RFP_H

#include "la/la.h"

typedef struct batten_rfp {
  batten_la_real real;
  size_t n, n1, n2, ld;
  void *b11, *b21, *b22; /* into one block of n (n + 1) / 2 elements */
} batten_rfp;

/* Elements of the storage; false on overflow. */
bool batten_rfp_count(size_t n, size_t *count);

/* Views the storage of a matrix of order n. */
batten_rfp batten_rfp_view(batten_la_real real, size_t n, void *storage);

/* 1-norm; sums [n] is scratch. */
double batten_rfp_norm1(const batten_rfp *b, double *sums);

/* B := L with B = L L'. Progress between blocks. SINGULAR: the leading minor of order *failed is not positive. */
batten_status batten_rfp_cholesky(batten_context *ctx, const batten_rfp *b, size_t *failed);

/* Row of the smallest pivot of a factored B; *ratio: that pivot over the largest. */
size_t batten_rfp_weakest(const batten_rfp *b, double *ratio);

/* x := L^-1 x and x := L^-T x for m columns, x [m][ldx] in B's precision. */
void batten_rfp_forward(const batten_rfp *b, size_t m, void *x, size_t ldx);
void batten_rfp_backward(const batten_rfp *b, size_t m, void *x, size_t ldx);

#endif
