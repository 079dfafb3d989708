/* The one page that declares Fortran symbols of BLAS and LAPACK: integer width, name mangling, hidden string lengths.
 *
 * Everything else in the house calls the wrappers of la.h; benchmarks include this page to time bare routines.
 * For a library with 64-bit integers or with a symbol suffix, build with -DBATTEN_BLAS_ILP64 or
 * -DBATTEN_BLAS_SUFFIX=64_. Each character argument has a length that Fortran compilers pass by value at the end. */
#ifndef BATTEN_LA_FORTRAN_H
#define BATTEN_LA_FORTRAN_H

#include <stddef.h>
#include <stdint.h>

#ifdef BATTEN_BLAS_ILP64
typedef int64_t batten_la_int;
#define BATTEN_LA_INT_MAX INT64_MAX
#else
typedef int32_t batten_la_int;
#define BATTEN_LA_INT_MAX INT32_MAX
#endif

#ifndef BATTEN_BLAS_SUFFIX
#define BATTEN_BLAS_SUFFIX _
#endif
#define BATTEN_FORTRAN_JOIN(name, suffix) name##suffix
#define BATTEN_FORTRAN_PASTE(name, suffix) BATTEN_FORTRAN_JOIN(name, suffix)
#define FORTRAN(name) BATTEN_FORTRAN_PASTE(name, BATTEN_BLAS_SUFFIX)

#define IN const batten_la_int *
#define OUT batten_la_int *
#define CH const char *
#define LEN size_t

/* Level 2 and 3 BLAS, and Cholesky, in both precisions. */
#define BATTEN_DECLARE_REAL(s, real)                                                                               \
  void FORTRAN(s##gemv)(CH trans, IN m, IN n, const real *alpha, const real *a, IN lda, const real *x, IN incx,    \
                        const real *beta, real *y, IN incy, LEN);                                                  \
  void FORTRAN(s##trsv)(CH uplo, CH trans, CH diag, IN n, const real *a, IN lda, real *x, IN incx, LEN, LEN, LEN); \
  void FORTRAN(s##gemm)(CH transa, CH transb, IN m, IN n, IN k, const real *alpha, const real *a, IN lda,          \
                        const real *b, IN ldb, const real *beta, real *c, IN ldc, LEN, LEN);                       \
  void FORTRAN(s##symm)(CH side, CH uplo, IN m, IN n, const real *alpha, const real *a, IN lda, const real *b,     \
                        IN ldb, const real *beta, real *c, IN ldc, LEN, LEN);                                      \
  void FORTRAN(s##syrk)(CH uplo, CH trans, IN n, IN k, const real *alpha, const real *a, IN lda, const real *beta, \
                        real *c, IN ldc, LEN, LEN);                                                                \
  void FORTRAN(s##trsm)(CH side, CH uplo, CH trans, CH diag, IN m, IN n, const real *alpha, const real *a, IN lda, \
                        real *b, IN ldb, LEN, LEN, LEN, LEN);                                                      \
  void FORTRAN(s##potrf)(CH uplo, IN n, real * a, IN lda, OUT info, LEN);                                          \
  void FORTRAN(s##pftrf)(CH transr, CH uplo, IN n, real * a, OUT info, LEN, LEN);                                  \
  void FORTRAN(s##pftrs)(CH transr, CH uplo, IN n, IN nrhs, const real *a, real *b, IN ldb, OUT info, LEN, LEN);
BATTEN_DECLARE_REAL(d, double)
BATTEN_DECLARE_REAL(s, float)
#undef BATTEN_DECLARE_REAL

void FORTRAN(dsymv)(CH uplo, IN n, const double *alpha, const double *a, IN lda, const double *x, IN incx,
                    const double *beta, double *y, IN incy, LEN);

/* LAPACK in double. */
void FORTRAN(dpbtrf)(CH uplo, IN n, IN kd, double *ab, IN ldab, OUT info, LEN);
void FORTRAN(dpstrf)(CH uplo, IN n, double *a, IN lda, OUT piv, OUT rank, const double *tol, double *work, OUT info,
                     LEN);
void FORTRAN(dsytrf)(CH uplo, IN n, double *a, IN lda, OUT ipiv, double *work, IN lwork, OUT info, LEN);
void FORTRAN(dsytrs)(CH uplo, IN n, IN nrhs, const double *a, IN lda, IN ipiv, double *b, IN ldb, OUT info, LEN);
void FORTRAN(dsycon)(CH uplo, IN n, const double *a, IN lda, IN ipiv, const double *anorm, double *rcond,
                     double *work, OUT iwork, OUT info, LEN);
double FORTRAN(dlansy)(CH norm, CH uplo, IN n, const double *a, IN lda, double *work, LEN, LEN);
void FORTRAN(dgeqp3)(IN m, IN n, double *a, IN lda, OUT jpvt, double *tau, double *work, IN lwork, OUT info);
void FORTRAN(dgeqrf)(IN m, IN n, double *a, IN lda, double *tau, double *work, IN lwork, OUT info);
void FORTRAN(dormqr)(CH side, CH trans, IN m, IN n, IN k, const double *a, IN lda, const double *tau, double *c,
                     IN ldc, double *work, IN lwork, OUT info, LEN, LEN);
void FORTRAN(dlarft)(CH direct, CH storev, IN n, IN k, const double *v, IN ldv, const double *tau, double *t, IN ldt,
                     LEN, LEN);
void FORTRAN(dtrcon)(CH norm, CH uplo, CH diag, IN n, const double *a, IN lda, double *rcond, double *work, OUT iwork,
                     OUT info, LEN, LEN, LEN);
void FORTRAN(dlacn2)(IN n, double *v, double *x, OUT isgn, double *est, OUT kase, OUT isave);

/* For comparison in benchmarks only. */
void FORTRAN(dgesv)(IN n, IN nrhs, double *a, IN lda, OUT ipiv, double *b, IN ldb, OUT info);
void FORTRAN(dsysv)(CH uplo, IN n, IN nrhs, double *a, IN lda, OUT ipiv, double *b, IN ldb, double *work, IN lwork,
                    OUT info, LEN);

#undef IN
#undef OUT
#undef CH
#undef LEN

#endif
