/* Products with dense symmetric matrices: half the memory traffic of dgemv. */
#include "la_dense.h"

#include <assert.h>

#define IN const batten_la_int *
void FORTRAN(dsymv)(const char *uplo, IN n, const double *alpha, const double *a, IN lda, const double *x, IN incx,
                    const double *beta, double *y, IN incy, size_t uplo_length);
#undef IN

void batten_la_symv(char uplo, size_t n, double alpha, const double *a, size_t lda, const double *x, double beta,
                    double *y) {
  if (n == 0) return;
  assert(batten_la_fits(n) && batten_la_fits(lda));
  batten_la_int ni = (batten_la_int)n, la = (batten_la_int)lda, one = 1;
  FORTRAN(dsymv)(&uplo, &ni, &alpha, a, &la, x, &one, &beta, y, &one, 1);
}
