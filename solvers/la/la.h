/* Dense linear algebra for solvers/: the only way to BLAS and LAPACK. Column-major, size_t sizes.
 *
 * Sizes are checked once where a problem comes in, by batten_la_fits(); the BLAS wrappers then only assert it. Calls
 * with an empty operand return at once (LAPACK's dsytrf fails with n = 0). Workspace comes from the context; the
 * ..._work() functions tell how many doubles a call will take, so that a caller can predict memory. LAPACK reads NaN
 * as "singular", so callers refuse non-finite data where they take them in. */
#ifndef BATTEN_LA_LA_H
#define BATTEN_LA_LA_H

#include <batten/base.h>
#include <stdbool.h>

#include "fortran.h"

/* Precision of a matrix; the value is the bytes of an element. Scalars are passed as double in both. */
typedef enum batten_la_real { BATTEN_LA_FLOAT = sizeof(float), BATTEN_LA_DOUBLE = sizeof(double) } batten_la_real;

/* Pointer to element `offset`. */
static inline void *batten_la_at(batten_la_real real, void *a, size_t offset) {
  return (char *)a + offset * (size_t)real;
}
static inline const void *batten_la_at_const(batten_la_real real, const void *a, size_t offset) {
  return (const char *)a + offset * (size_t)real;
}

/* True when n is a size that the loaded BLAS's integers can hold as a leading dimension. */
bool batten_la_fits(size_t n);

/* BLAS. Arguments as in the Fortran routines; vectors have stride 1, triangles are not unit. */
void batten_la_gemv(batten_la_real real, char trans, size_t m, size_t n, double alpha, const void *a, size_t lda,
                    const void *x, double beta, void *y);
void batten_la_symv(char uplo, size_t n, double alpha, const double *a, size_t lda, const double *x, double beta,
                    double *y);
void batten_la_trsv(batten_la_real real, char uplo, char trans, size_t n, const void *a, size_t lda, void *x);
void batten_la_gemm(batten_la_real real, char transa, char transb, size_t m, size_t n, size_t k, double alpha,
                    const void *a, size_t lda, const void *b, size_t ldb, double beta, void *c, size_t ldc);
void batten_la_symm(batten_la_real real, char side, char uplo, size_t m, size_t n, double alpha, const void *a,
                    size_t lda, const void *b, size_t ldb, double beta, void *c, size_t ldc);
void batten_la_syrk(batten_la_real real, char uplo, char trans, size_t n, size_t k, double alpha, const void *a,
                    size_t lda, double beta, void *c, size_t ldc);
void batten_la_trsm(batten_la_real real, char side, char uplo, char trans, size_t m, size_t n, double alpha,
                    const void *a, size_t lda, void *b, size_t ldb);

/* Cholesky. 0, or the 1-based order of the leading minor that is not positive. */
size_t batten_la_potrf(batten_la_real real, char uplo, size_t n, void *a, size_t lda);

/* Cholesky of a band matrix with kd diagonals beside the main one, in LAPACK's band storage; as potrf. */
size_t batten_la_pbtrf(char uplo, size_t n, size_t kd, double *ab, size_t ldab);

/* Cholesky with diagonal pivoting of a semidefinite matrix, upper triangle: P'AP = U'U with *rank rows of U, column j
 * of AP being column pivots[j] of A. Stops where the diagonal left is at most tolerance, but not before
 * the first pivot if that is positive; a negative tolerance stands for n eps / 2 times the largest. */
batten_status batten_la_pstrf(batten_context *ctx, size_t n, double *a, size_t lda, double tolerance, size_t *pivots,
                              size_t *rank);

/* Bunch-Kaufman of the lower triangle. SINGULAR: D has an exact zero, *zero is its 0-based place, the factor is
 * complete otherwise. */
size_t batten_la_sytrf_work(size_t n);
batten_status batten_la_sytrf(batten_context *ctx, size_t n, double *a, size_t lda, batten_la_int *pivots,
                              size_t *zero);
void batten_la_sytrs(size_t n, size_t nrhs, const double *a, size_t lda, const batten_la_int *pivots, double *b,
                     size_t ldb);
/* Reciprocal condition from the factor and the 1-norm of the matrix. */
batten_status batten_la_sycon(batten_context *ctx, size_t n, const double *a, size_t lda, const batten_la_int *pivots,
                              double norm, double *rcond);
/* 1-norm of a symmetric matrix whose lower triangle is stored; work [n]. */
double batten_la_norm_sy(size_t n, const double *a, size_t lda, double *work);

/* Householder QR. geqp3: with column pivoting, column j of A*P is column pivots[j] (0-based) of A. */
batten_status batten_la_geqp3(batten_context *ctx, size_t m, size_t n, double *a, size_t lda, size_t *pivots,
                              double *tau);
size_t batten_la_geqrf_work(size_t m, size_t n);
batten_status batten_la_geqrf(batten_context *ctx, size_t m, size_t n, double *a, size_t lda, double *tau);
/* C := Q' C (trans T) or Q C (trans N), C [m][n], Q from k reflectors. */
size_t batten_la_ormqr_work(char trans, size_t m, size_t n, size_t k);
batten_status batten_la_ormqr(batten_context *ctx, char trans, size_t m, size_t n, size_t k, const double *a,
                              size_t lda, const double *tau, double *c, size_t ldc);
/* Triangular factor T [k][k] of the product of k forward columnwise reflectors: Q = I - V T V'. */
void batten_la_larft(size_t n, size_t k, const double *v, size_t ldv, const double *tau, double *t, size_t ldt);
/* Reciprocal condition of an upper triangle, 1-norm. */
batten_status batten_la_trcon(batten_context *ctx, size_t n, const double *a, size_t lda, double *rcond);

/* Estimate of the 1-norm of a symmetric operator (Hager, Higham): apply overwrites x with operator * x. */
batten_status batten_la_norm1_estimate(batten_context *ctx, size_t n, void (*apply)(void *arg, double *x), void *arg,
                                       double *norm);

#endif
