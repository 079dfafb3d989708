/* Symmetric saddle systems of interpolation with polynomial precision:
 *
 *     [ K  P ] [w]   [f]      K  [N][N] symmetric, positive definite on the null space of P'
 *     [ P' 0 ] [c] = [0]      P  [N][k] of full column rank, k < N (k = 0 allowed)
 *
 * K is never asked for as a whole: a callback fills tiles of it, so that a single precision factor can
 * be refined against entries that are computed anew in double. */
#ifndef BATTEN_SADDLE_H
#define BATTEN_SADDLE_H

#include <batten/base.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum batten_saddle_method {
  BATTEN_SADDLE_AUTO = 0,
  BATTEN_SADDLE_CHOLESKY = 1,       /* Householder projection + Cholesky in RFP storage, double */
  BATTEN_SADDLE_CHOLESKY_MIXED = 2, /* the same, float factor, residuals in double from fresh entries */
  BATTEN_SADDLE_LDL = 3,            /* Bunch-Kaufman LDL' of the whole indefinite matrix */
  BATTEN_SADDLE_QR = 4              /* Householder QR of the whole matrix (the paper's literal method) */
} batten_saddle_method;

/* "cholesky", "cholesky-mixed", "ldl", "qr", "auto". */
BATTEN_API const char *batten_saddle_method_name(batten_saddle_method method);

/* The matrix. fill writes K[row0 + i][col0 + j] to tile[i + j * ld], i < rows, j < cols (column-major).
 * It is called from several threads at a time when the context has more than one, or a host's executor: it must only
 * read.
 * K must be symmetric to the bit: entry (i, j) equals entry (j, i). */
typedef struct batten_saddle_matrix {
  size_t n;        /* N >= 0 */
  size_t k;        /* columns of P, 0 <= k < N, or N = k = 0 */
  const double *p; /* [k][N]: column c of P at p + c * N; NULL when k = 0 */
  void (*fill)(const void *user, size_t row0, size_t rows, size_t col0, size_t cols, double *tile, size_t ld);
  const void *user;
} batten_saddle_matrix;

typedef struct batten_saddle_options {
  size_t struct_size;
  batten_saddle_method method; /* AUTO: mixed where it pays, else Cholesky, else LDL'. Default AUTO. */
  int smooth_kernel;           /* non-zero: the caller knows K to be too ill-conditioned for a float factor
                                  (condition above 1e7); AUTO then skips mixed. Default 0. */
  unsigned refine_max;         /* refinement steps at most. Default 10. */
  double residual_tol;         /* relative residual aimed at, max |f - K w - P c| / max |f|. Default 1e-13.
                                  Misses are told by BATTEN_W_ACCURACY. */
} batten_saddle_options;
BATTEN_API batten_saddle_options batten_saddle_options_default(void);

typedef struct batten_saddle_info {
  batten_saddle_method method; /* what was used in the end */
  unsigned fallbacks;          /* how often a cheaper method was given up */
  unsigned refinements;        /* steps taken by the last solve */
  double residual;             /* of the last solve, recomputed from fresh entries, relative to max |f| */
  double rcond;                /* reciprocal condition of the factored matrix, 1-norm estimate */
  size_t bytes;                /* held by the factor */
  double time_assemble_s, time_project_s, time_factor_s, time_solve_s;
} batten_saddle_info;

typedef struct batten_saddle batten_saddle;

/* Bytes that factor and solve take at their peak, before anything is taken; SIZE_MAX on overflow. AUTO: as CHOLESKY.
 * A fall-back takes what its own method takes, where the memory limit has room for it.
 * Packed: about 4 N^2 (double) or 2 N^2 (mixed); LDL': 8 (N+k)^2; QR: 8 (N+k)^2. */
BATTEN_API size_t batten_saddle_bytes(batten_saddle_method method, size_t n, size_t k);

/* Factors once; solve as often as wanted. matrix->user and matrix->p must live as long as *out.
 * Fails: INVALID, TOO_LARGE (does not fit the context's memory limit or LAPACK's integers), NOMEM,
 * SINGULAR (text names the row: duplicates, or P without full rank), CANCELLED. */
BATTEN_API batten_status batten_saddle_factor(batten_context *ctx, const batten_saddle_matrix *matrix,
                                              const batten_saddle_options *opt, batten_saddle **out);

/* w [N], c [k] from f [N] (finite); w may be f. ctx is the one that s was factored with: a handle serves one thread at a
 * time, since a solve may fall back to another factor. Positive status: BATTEN_W_ACCURACY. Fails as factor does; the
 * handle stays usable. Each refinement step costs N^2/2 entries of K anew. */
BATTEN_API batten_status batten_saddle_solve(batten_context *ctx, batten_saddle *s, const double *f, double *w,
                                             double *c);

/* diagonal[q] = (inverse of the whole matrix)[index[q]][index[q]], q < count: leave-one-out errors are
 * w_i / diagonal_i (Rippa 1999). Cost: N^2 flops each, and 64 N numbers beyond what batten_saddle_bytes() says. Float
 * precision when the factor is mixed. Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_saddle_inverse_diagonal(batten_context *ctx, batten_saddle *s, size_t count,
                                                        const size_t *index, double *diagonal);

BATTEN_API batten_saddle_info batten_saddle_get_info(const batten_saddle *s);
BATTEN_API void batten_saddle_free(batten_saddle *s);

#ifdef __cplusplus
}
#endif
#endif
