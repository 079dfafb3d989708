/* Products with dense symmetric matrices, beside la.h. */
#ifndef BATTEN_LA_LA_DENSE_H
#define BATTEN_LA_LA_DENSE_H

#include "la.h"

/* y := alpha A x + beta y, A symmetric [n][n] of which the triangle uplo is read. */
void batten_la_symv(char uplo, size_t n, double alpha, const double *a, size_t lda, const double *x, double beta,
                    double *y);

#endif
