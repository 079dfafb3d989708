/* Wrappers of BLAS and LAPACK, see la.h. Each converts sizes, returns early on empty operands, asks LAPACK for the
 * workspace it wants and turns info into a status. */
#include "la.h"

#include <assert.h>

#include "base/checked.h"

/* One conversion for all; whoever takes sizes in has asked batten_la_fits(). */
static batten_la_int to_int(size_t n) {
  assert(batten_la_fits(n));
  return (batten_la_int)n;
}

/* A leading dimension must be at least 1. */
static batten_la_int to_ld(size_t ld) { return to_int(ld > 1 ? ld : 1); }

static const batten_la_int one = 1;

/* What LAPACK answers to a workspace query, as a count: never 0, though dsytrf says 0 for n = 0. */
static size_t work_count(double answer) { return answer > 1 ? (size_t)answer : 1; }

/* A negative info means that a wrapper passed an argument wrongly. */
static batten_status illegal(batten_context *ctx, const char *name, batten_la_int info) {
  return batten_fail(ctx, BATTEN_E_INTERNAL, "%s: argument %ld is illegal, please report", name, -(long)info);
}

bool batten_la_fits(size_t n) { return n <= (size_t)BATTEN_LA_INT_MAX; }

/* ---- BLAS ---- */

/* Calls name in the precision asked for; `body` sees `real_t` and the Fortran prefix through CALL. */
#define IN_PRECISION(real, name, ...)                   \
  do {                                                  \
    if ((real) == BATTEN_LA_DOUBLE) {                   \
      typedef double real_t;                            \
      const real_t a1 = alpha, b1 = beta;               \
      (void)a1, (void)b1;                               \
      FORTRAN(d##name)(__VA_ARGS__);                    \
    } else {                                            \
      typedef float real_t;                             \
      const real_t a1 = (float)alpha, b1 = (float)beta; \
      (void)a1, (void)b1;                               \
      FORTRAN(s##name)(__VA_ARGS__);                    \
    }                                                   \
  } while (0)

void batten_la_gemv(batten_la_real real, char trans, size_t m, size_t n, double alpha, const void *a, size_t lda,
                    const void *x, double beta, void *y) {
  if (m == 0 || n == 0) return;
  batten_la_int mi = to_int(m), ni = to_int(n), la = to_ld(lda);
  IN_PRECISION(real, gemv, &trans, &mi, &ni, &a1, (const real_t *)a, &la, (const real_t *)x, &one, &b1, (real_t *)y,
               &one, 1);
}

void batten_la_symv(char uplo, size_t n, double alpha, const double *a, size_t lda, const double *x, double beta,
                    double *y) {
  if (n == 0) return;
  batten_la_int ni = to_int(n), la = to_ld(lda);
  FORTRAN(dsymv)(&uplo, &ni, &alpha, a, &la, x, &one, &beta, y, &one, 1);
}

void batten_la_trsv(batten_la_real real, char uplo, char trans, size_t n, const void *a, size_t lda, void *x) {
  if (n == 0) return;
  const double alpha = 1, beta = 0;
  batten_la_int ni = to_int(n), la = to_ld(lda);
  IN_PRECISION(real, trsv, &uplo, &trans, "N", &ni, (const real_t *)a, &la, (real_t *)x, &one, 1, 1, 1);
}

void batten_la_gemm(batten_la_real real, char transa, char transb, size_t m, size_t n, size_t k, double alpha,
                    const void *a, size_t lda, const void *b, size_t ldb, double beta, void *c, size_t ldc) {
  if (m == 0 || n == 0) return;
  batten_la_int mi = to_int(m), ni = to_int(n), ki = to_int(k), la = to_ld(lda), lb = to_ld(ldb), lc = to_ld(ldc);
  IN_PRECISION(real, gemm, &transa, &transb, &mi, &ni, &ki, &a1, (const real_t *)a, &la, (const real_t *)b, &lb, &b1,
               (real_t *)c, &lc, 1, 1);
}

void batten_la_symm(batten_la_real real, char side, char uplo, size_t m, size_t n, double alpha, const void *a,
                    size_t lda, const void *b, size_t ldb, double beta, void *c, size_t ldc) {
  if (m == 0 || n == 0) return;
  batten_la_int mi = to_int(m), ni = to_int(n), la = to_ld(lda), lb = to_ld(ldb), lc = to_ld(ldc);
  IN_PRECISION(real, symm, &side, &uplo, &mi, &ni, &a1, (const real_t *)a, &la, (const real_t *)b, &lb, &b1,
               (real_t *)c, &lc, 1, 1);
}

void batten_la_syrk(batten_la_real real, char uplo, char trans, size_t n, size_t k, double alpha, const void *a,
                    size_t lda, double beta, void *c, size_t ldc) {
  if (n == 0) return;
  batten_la_int ni = to_int(n), ki = to_int(k), la = to_ld(lda), lc = to_ld(ldc);
  IN_PRECISION(real, syrk, &uplo, &trans, &ni, &ki, &a1, (const real_t *)a, &la, &b1, (real_t *)c, &lc, 1, 1);
}

void batten_la_trsm(batten_la_real real, char side, char uplo, char trans, size_t m, size_t n, double alpha,
                    const void *a, size_t lda, void *b, size_t ldb) {
  if (m == 0 || n == 0) return;
  const double beta = 0;
  batten_la_int mi = to_int(m), ni = to_int(n), la = to_ld(lda), lb = to_ld(ldb);
  IN_PRECISION(real, trsm, &side, &uplo, &trans, "N", &mi, &ni, &a1, (const real_t *)a, &la, (real_t *)b, &lb, 1, 1,
               1, 1);
}

/* ---- Cholesky ---- */

size_t batten_la_potrf(batten_la_real real, char uplo, size_t n, void *a, size_t lda) {
  if (n == 0) return 0;
  const double alpha = 1, beta = 0;
  batten_la_int ni = to_int(n), la = to_ld(lda), info = 0;
  IN_PRECISION(real, potrf, &uplo, &ni, (real_t *)a, &la, &info, 1);
  assert(info >= 0);
  return (size_t)info;
}

size_t batten_la_pbtrf(char uplo, size_t n, size_t kd, double *ab, size_t ldab) {
  if (n == 0) return 0;
  batten_la_int ni = to_int(n), ki = to_int(kd), la = to_ld(ldab), info = 0;
  FORTRAN(dpbtrf)(&uplo, &ni, &ki, ab, &la, &info, 1);
  assert(info >= 0);
  return (size_t)info;
}

batten_status batten_la_pstrf(batten_context *ctx, size_t n, double *a, size_t lda, double tolerance, size_t *pivots,
                              size_t *rank) {
  *rank = 0;
  if (n == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  double *work = NULL;
  batten_la_int *piv = batten_alloc_array(ctx, n, sizeof *piv);
  if (!piv) goto done;
  work = batten_alloc_array(ctx, n, 2 * sizeof *work);
  if (!work) goto done;
  batten_la_int ni = to_int(n), la = to_ld(lda), r = 0, info = 0;
  FORTRAN(dpstrf)("U", &ni, a, &la, piv, &r, &tolerance, work, &info, 1);
  for (size_t j = 0; j < n; j++) pivots[j] = (size_t)piv[j] - 1;
  *rank = (size_t)r;
  st = info < 0 ? illegal(ctx, "dpstrf", info) : BATTEN_OK; /* info 1: rank below n, no error here */
done:
  batten_free(ctx, work);
  batten_free(ctx, piv);
  return st;
}

/* ---- Bunch-Kaufman ---- */

size_t batten_la_sytrf_work(size_t n) {
  if (n == 0 || !batten_la_fits(n)) return 1;
  batten_la_int ni = to_int(n), query = -1, pivot = 0, info = 0;
  double answer = 0, dummy = 0;
  FORTRAN(dsytrf)("L", &ni, &dummy, &ni, &pivot, &answer, &query, &info, 1);
  return work_count(answer);
}

batten_status batten_la_sytrf(batten_context *ctx, size_t n, double *a, size_t lda, batten_la_int *pivots,
                              size_t *zero) {
  if (n == 0) return BATTEN_OK;
  size_t count = batten_la_sytrf_work(n);
  double *work = batten_alloc_array(ctx, count, sizeof *work);
  if (!work) return BATTEN_E_NOMEM;
  batten_la_int ni = to_int(n), la = to_ld(lda), lwork = to_int(count), info = 0;
  FORTRAN(dsytrf)("L", &ni, a, &la, pivots, work, &lwork, &info, 1);
  batten_free(ctx, work);
  if (info < 0) return illegal(ctx, "dsytrf", info);
  if (info == 0) return BATTEN_OK;
  *zero = (size_t)info - 1;
  return batten_fail(ctx, BATTEN_E_SINGULAR, "LDL': pivot %zu is zero", *zero);
}

void batten_la_sytrs(size_t n, size_t nrhs, const double *a, size_t lda, const batten_la_int *pivots, double *b,
                     size_t ldb) {
  if (n == 0 || nrhs == 0) return;
  batten_la_int ni = to_int(n), nr = to_int(nrhs), la = to_ld(lda), lb = to_ld(ldb), info = 0;
  FORTRAN(dsytrs)("L", &ni, &nr, a, &la, pivots, b, &lb, &info, 1);
  assert(info == 0);
}

batten_status batten_la_sycon(batten_context *ctx, size_t n, const double *a, size_t lda, const batten_la_int *pivots,
                              double norm, double *rcond) {
  *rcond = 1;
  if (n == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  batten_la_int *iwork = NULL;
  double *work = batten_alloc_array(ctx, n, 2 * sizeof *work);
  if (!work) goto done;
  iwork = batten_alloc_array(ctx, n, sizeof *iwork);
  if (!iwork) goto done;
  batten_la_int ni = to_int(n), la = to_ld(lda), info = 0;
  FORTRAN(dsycon)("L", &ni, a, &la, pivots, &norm, rcond, work, iwork, &info, 1);
  st = info < 0 ? illegal(ctx, "dsycon", info) : BATTEN_OK;
done:
  batten_free(ctx, iwork);
  batten_free(ctx, work);
  return st;
}

double batten_la_norm_sy(size_t n, const double *a, size_t lda, double *work) {
  if (n == 0) return 0;
  batten_la_int ni = to_int(n), la = to_ld(lda);
  return FORTRAN(dlansy)("1", "L", &ni, a, &la, work, 1, 1);
}

/* ---- QR ---- */

batten_status batten_la_geqp3(batten_context *ctx, size_t m, size_t n, double *a, size_t lda, size_t *pivots,
                              double *tau) {
  if (m == 0 || n == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  double *work = NULL, answer = 0;
  batten_la_int mi = to_int(m), ni = to_int(n), la = to_ld(lda), lwork = -1, info = 0;
  batten_la_int *jpvt = batten_alloc_array(ctx, n, sizeof *jpvt);
  if (!jpvt) goto done;
  for (size_t j = 0; j < n; j++) jpvt[j] = 0; /* every column is free to move */
  FORTRAN(dgeqp3)(&mi, &ni, a, &la, jpvt, tau, &answer, &lwork, &info);
  size_t count = work_count(answer);
  work = batten_alloc_array(ctx, count, sizeof *work);
  if (!work) goto done;
  lwork = to_int(count);
  FORTRAN(dgeqp3)(&mi, &ni, a, &la, jpvt, tau, work, &lwork, &info);
  for (size_t j = 0; j < n; j++) pivots[j] = (size_t)jpvt[j] - 1;
  st = info < 0 ? illegal(ctx, "dgeqp3", info) : BATTEN_OK;
done:
  batten_free(ctx, work);
  batten_free(ctx, jpvt);
  return st;
}

size_t batten_la_geqrf_work(size_t m, size_t n) {
  if (m == 0 || n == 0 || !batten_la_fits(m) || !batten_la_fits(n)) return 1;
  batten_la_int mi = to_int(m), ni = to_int(n), query = -1, info = 0;
  double answer = 0, dummy = 0;
  FORTRAN(dgeqrf)(&mi, &ni, &dummy, &mi, &dummy, &answer, &query, &info);
  return work_count(answer);
}

batten_status batten_la_geqrf(batten_context *ctx, size_t m, size_t n, double *a, size_t lda, double *tau) {
  if (m == 0 || n == 0) return BATTEN_OK;
  size_t count = batten_la_geqrf_work(m, n);
  double *work = batten_alloc_array(ctx, count, sizeof *work);
  if (!work) return BATTEN_E_NOMEM;
  batten_la_int mi = to_int(m), ni = to_int(n), la = to_ld(lda), lwork = to_int(count), info = 0;
  FORTRAN(dgeqrf)(&mi, &ni, a, &la, tau, work, &lwork, &info);
  batten_free(ctx, work);
  return info < 0 ? illegal(ctx, "dgeqrf", info) : BATTEN_OK;
}

size_t batten_la_ormqr_work(char trans, size_t m, size_t n, size_t k) {
  if (m == 0 || n == 0 || k == 0 || !batten_la_fits(m) || !batten_la_fits(n)) return 1;
  batten_la_int mi = to_int(m), ni = to_int(n), ki = to_int(k), query = -1, info = 0;
  double answer = 0, dummy = 0;
  FORTRAN(dormqr)("L", &trans, &mi, &ni, &ki, &dummy, &mi, &dummy, &dummy, &mi, &answer, &query, &info, 1, 1);
  return work_count(answer);
}

batten_status batten_la_ormqr(batten_context *ctx, char trans, size_t m, size_t n, size_t k, const double *a,
                              size_t lda, const double *tau, double *c, size_t ldc) {
  if (m == 0 || n == 0 || k == 0) return BATTEN_OK;
  size_t count = batten_la_ormqr_work(trans, m, n, k);
  double *work = batten_alloc_array(ctx, count, sizeof *work);
  if (!work) return BATTEN_E_NOMEM;
  batten_la_int mi = to_int(m), ni = to_int(n), ki = to_int(k), la = to_ld(lda), lc = to_ld(ldc);
  batten_la_int lwork = to_int(count), info = 0;
  FORTRAN(dormqr)("L", &trans, &mi, &ni, &ki, a, &la, tau, c, &lc, work, &lwork, &info, 1, 1);
  batten_free(ctx, work);
  return info < 0 ? illegal(ctx, "dormqr", info) : BATTEN_OK;
}

void batten_la_larft(size_t n, size_t k, const double *v, size_t ldv, const double *tau, double *t, size_t ldt) {
  if (n == 0 || k == 0) return;
  batten_la_int ni = to_int(n), ki = to_int(k), lv = to_ld(ldv), lt = to_ld(ldt);
  FORTRAN(dlarft)("F", "C", &ni, &ki, v, &lv, tau, t, &lt, 1, 1);
}

batten_status batten_la_trcon(batten_context *ctx, size_t n, const double *a, size_t lda, double *rcond) {
  *rcond = 1;
  if (n == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  batten_la_int *iwork = NULL;
  double *work = batten_alloc_array(ctx, n, 3 * sizeof *work);
  if (!work) goto done;
  iwork = batten_alloc_array(ctx, n, sizeof *iwork);
  if (!iwork) goto done;
  batten_la_int ni = to_int(n), la = to_ld(lda), info = 0;
  FORTRAN(dtrcon)("1", "U", "N", &ni, a, &la, rcond, work, iwork, &info, 1, 1, 1);
  st = info < 0 ? illegal(ctx, "dtrcon", info) : BATTEN_OK;
done:
  batten_free(ctx, iwork);
  batten_free(ctx, work);
  return st;
}

/* ---- Condition ---- */

batten_status batten_la_norm1_estimate(batten_context *ctx, size_t n, void (*apply)(void *arg, double *x), void *arg,
                                       double *norm) {
  *norm = 0;
  if (n == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  batten_la_int *signs = NULL;
  double *v = batten_alloc_array(ctx, n, 2 * sizeof *v);
  if (!v) goto done;
  signs = batten_alloc_array(ctx, n, sizeof *signs);
  if (!signs) goto done;
  double *x = v + n;
  batten_la_int ni = to_int(n), kase = 0, save[3] = {0};
  for (;;) {
    FORTRAN(dlacn2)(&ni, v, x, signs, norm, &kase, save);
    if (kase == 0) break;
    apply(arg, x); /* symmetric: the transpose that kase = 2 asks for is the same */
  }
  st = BATTEN_OK;
done:
  batten_free(ctx, signs);
  batten_free(ctx, v);
  return st;
}
