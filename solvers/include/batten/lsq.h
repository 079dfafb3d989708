/* Dense linear least squares: minimise sum_i w_i ((A x - b)_i)^2 + x'T x for each right side, [A; T] of full rank. */
#ifndef BATTEN_LSQ_H
#define BATTEN_LSQ_H

#include <batten/base.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum batten_lsq_method {
  BATTEN_LSQ_AUTO = 0,   /* normal equations when their condition allows, else QR */
  BATTEN_LSQ_NORMAL = 1, /* Cholesky of A'A (+ tension) with refinement: fast, squares the condition */
  BATTEN_LSQ_QR = 2      /* Householder QR of A (on top of the tension's rows) */
} batten_lsq_method;

typedef struct batten_lsq_options {
  size_t struct_size;
  batten_lsq_method method; /* default AUTO */
  const double *weights;    /* [m] >= 0, of the squared residuals; NULL = ones */
  const double *tension;    /* [n][n] symmetric positive semidefinite T: adds x'T x; NULL = none */
} batten_lsq_options;
BATTEN_API batten_lsq_options batten_lsq_options_default(void);

typedef struct batten_lsq_info {
  batten_lsq_method method;
  double rcond;           /* of R (QR) or of the triangular factor of A'A + T */
  double residual_norm;   /* sqrt of the weighted sum of squares, over all right sides */
  double gradient_norm;   /* how exactly it is solved: max |A'W(A x - b) + T x| / max |A'W b|, the columns of A scaled
                             to size 1; the largest over the right sides */
  double time_s;
} batten_lsq_info;

/* n, nrhs >= 0; m >= n, or any m >= 0 with tension. a [m][n] and b [m][nrhs] row-major, only read; x [n][nrhs] row-major.
 * x may be a or b. Fails: INVALID, TOO_LARGE, NOMEM, SINGULAR (rank; names the column), CANCELLED. info may be NULL.
 * Time 2 m n^2 flops by QR, half of it by normal equations; bytes about 8 m n, by QR 16 m n.
 * [Golub, Van Loan, Matrix Computations, section 5.3] */
BATTEN_API batten_status batten_lsq_solve(batten_context *ctx, size_t m, size_t n, size_t nrhs, const double *a,
                                          const double *b, const batten_lsq_options *opt, double *x,
                                          batten_lsq_info *info);

#ifdef __cplusplus
}
#endif
#endif
