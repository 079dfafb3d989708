/* Cholesky factor of a symmetric positive definite band matrix, for narrow bands and wide ones. Lower triangle by
 * columns: entry (i, j), j <= i <= j + width, at a[j * (width + 1) + i - j]. */
#ifndef BATTEN_SPARSE_BAND_H
#define BATTEN_SPARSE_BAND_H

#include <stddef.h>

/* Factors by what is faster for the width, and leaves L with the inverses of its diagonal, as the solves want it. 0,
 * or the 1-based number of the first pivot that is not positive. */
size_t sparse_band_cholesky(size_t n, size_t width, double *a);
/* L itself, by loops of our own: for narrow bands faster than LAPACK's call of BLAS for each column. */
size_t sparse_band_cholesky_narrow(size_t n, size_t width, double *a);
/* x := L^-1 x, x := L^-T x, L as sparse_band_cholesky leaves it. */
void sparse_band_forward(size_t n, size_t width, const double *l, double *x);
void sparse_band_backward(size_t n, size_t width, const double *l, double *x);

#endif
