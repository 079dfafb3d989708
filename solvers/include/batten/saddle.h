/* Symmetric saddle systems of interpolation with polynomial precision:
 *
 *     [ K  P ] [w]   [f]      K  [N][N] symmetric, positive definite on the null space of P'
 *     [ P' 0 ] [c] = [0]      P  [N][k] of full column rank, k < N (k = 0 allowed)
 *
 * K is never asked for as a whole: a callback fills tiles of it, so that a single precision factor can
 * be refined against entries that are computed anew in double. Where products with K can be had in less than N^2, the
 * iterative method takes them and makes no matrix at all. */
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
  BATTEN_SADDLE_QR = 4,             /* Householder QR of the whole matrix (the paper's literal method) */
  BATTEN_SADDLE_ITERATIVE = 5       /* Krylov iteration on products, with local solves on several levels */
} batten_saddle_method;

/* "cholesky", "cholesky-mixed", "ldl", "qr", "iterative", "auto". */
BATTEN_API const char *batten_saddle_method_name(batten_saddle_method method);

/* What the iterative method needs beside single entries: where the unknowns are, and products K[rows][cols] x that
 * cost less than row_count * col_count. `user` is that of the matrix. The callbacks are called on the thread that
 * called batten, may use the context, and ask for progress themselves where they take long; a failure they return is
 * passed on.
 *
 * K should be that of interpolation by a conditionally positive definite function of the distance (its derivatives
 * included: unknowns may share a point), with P the polynomials that belong to it: nearby unknowns are then the ones
 * that matter to each other, which is all that the method builds upon. A nugget on the diagonal is part of K. */
typedef struct batten_saddle_sums {
  unsigned dimension;   /* 1 .. 3 */
  const double *points; /* [N][dimension] of each unknown, at most 1e150 */

  /* Makes a plan for y = K[rows][cols] x. accuracy: relative 2-norm of the error over all rows, above 0 (the method
   * asks for 1e-4 .. 1e-13; what cannot be reached is to be made as exact as it goes). rows, cols: increasing indices
   * of unknowns, copied; NULL: all. */
  batten_status (*plan)(const void *user, batten_context *ctx, double accuracy, size_t row_count, const size_t *rows,
                        size_t col_count, const size_t *cols, void **plan);
  /* y [row_count] := the product with x [col_count]. Same bits for the same x. */
  batten_status (*apply)(void *plan, batten_context *ctx, const double *x, double *y);
  void (*release)(void *plan); /* with the context that it was made with */

  /* tile[i + j * ld] := K[row[i]][col[j]] to the bit as fill has it, i < rows, j < cols; from several threads at a
   * time, as fill. NULL: fill is called for each run of consecutive indices, which is slow where points that are
   * neighbours have distant indices. */
  void (*entries)(const void *user, size_t rows, const size_t *row, size_t cols, const size_t *col, double *tile,
                  size_t ld);
  /* Bytes that a plan holds (with what making it takes for a time); for the prediction of memory. NULL: 0. */
  size_t (*bytes)(const void *user, double accuracy, size_t row_count, size_t col_count);
} batten_saddle_sums;

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
  const batten_saddle_sums *sums; /* for ITERATIVE; NULL otherwise. Copied, its points are not. */
} batten_saddle_matrix;

typedef enum batten_saddle_krylov {
  BATTEN_SADDLE_KRYLOV_AUTO = 0, /* FGMRES, or CG where the memory limit has no room for its vectors */
  BATTEN_SADDLE_FGMRES = 1,      /* never restarted; keeps two vectors of N for each step */
  BATTEN_SADDLE_CG = 2           /* flexible conjugate gradients (Polak, Ribiere): six vectors, a few steps more */
} batten_saddle_krylov;

typedef struct batten_saddle_options {
  size_t struct_size;
  batten_saddle_method method; /* AUTO: mixed where it pays, else Cholesky, else LDL'. Default AUTO. */
  int smooth_kernel;           /* non-zero: the caller knows K to be too ill-conditioned for a float factor
                                  (condition above 1e7); AUTO then skips mixed. Default 0. */
  unsigned refine_max;         /* refinement steps at most. Default 10. */
  double residual_tol;         /* relative residual aimed at, max |f - K w - P c| / max |f|. Default 1e-13.
                                  Misses are told by BATTEN_W_ACCURACY. */

  /* ITERATIVE, which does not look at refine_max and residual_tol. With smooth_kernel it keeps all local factors in
   * double. */
  double accuracy;             /* aimed at: 2-norm of f - K w - P c over that of f less its best polynomial, on rows
                                  whose entries are computed afresh, 1000 of them at random. The products are made as
                                  accurate as that asks for. Misses are told by BATTEN_W_ACCURACY. Between 1e-13 and
                                  0.1. Default 1e-6. */
  double products_accuracy;    /* of the products at first, 0: chosen. Default 0. */
  double overlap;              /* unknowns that a local solve takes in around its own, over its own, up to 4. 0: two
                                  whole rings of neighbours, 0.6 to 0.8 on a surface and 1.8 in a volume, where 0.5
                                  may not converge; with smooth_kernel three, where unknowns do not share points, 1.1
                                  and 3.1. Default 0. */
  batten_saddle_krylov krylov; /* Default AUTO. */
  unsigned iterations_max;     /* of one solve, above 0. Default 200. */
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

  /* ITERATIVE; rcond is 0 then, and residual is residual_rows. */
  unsigned levels;           /* of the preconditioner, the exact one included */
  size_t level_sizes[8];     /* unknowns of the first 8 levels, the finest first; 0 where there is none */
  size_t domains;            /* local solves */
  size_t domains_double;     /* of which in double */
  unsigned iterations;       /* of the last solve */
  unsigned iterations_to[3]; /* of them, when the iteration's own residual first came below 1e-3, 1e-6, 1e-9; 0: it
                                did not, or began there */
  double residual_rows;      /* of the last solve: what options.accuracy speaks of */
  size_t rows_checked;       /* on how many rows: min(N, 1000) */
  double products_accuracy;  /* asked for in the end */
  double time_setup_s;       /* levels, local factors, plans */
} batten_saddle_info;

typedef struct batten_saddle batten_saddle;

/* Bytes that factor and solve take at their peak, before anything is taken; SIZE_MAX on overflow. AUTO: as CHOLESKY.
 * ITERATIVE: with default options, without what the plans hold; some KB for each unknown where they lie on a surface.
 * In a volume, with smooth_kernel, or where unknowns share points it is two to six times as much: factor finds out
 * when it knows the neighbours, before it takes it.
 * A fall-back takes what its own method takes, where the memory limit has room for it.
 * Packed: about 4 N^2 (double) or 2 N^2 (mixed); LDL': 8 (N+k)^2; QR: 8 (N+k)^2. */
BATTEN_API size_t batten_saddle_bytes(batten_saddle_method method, size_t n, size_t k);

/* Factors once; solve as often as wanted. matrix->user, matrix->p and the points of the sums must live as long as
 * *out. ITERATIVE is chosen by who asks for it alone: AUTO keeps to the factors. Fails: INVALID, TOO_LARGE (does not
 * fit the context's memory limit or LAPACK's integers), NOMEM, SINGULAR (text names the row: duplicates, or P without
 * full rank), CANCELLED. */
BATTEN_API batten_status batten_saddle_factor(batten_context *ctx, const batten_saddle_matrix *matrix,
                                              const batten_saddle_options *opt, batten_saddle **out);

/* w [N], c [k] from f [N] (finite); w may be f. ctx is the one that s was factored with: a handle serves one thread
 * at a time, since a solve may fall back to another factor. Positive status: BATTEN_W_ACCURACY. Fails as factor does;
 * the handle stays usable. Each refinement step costs N^2/2 entries of K anew. ITERATIVE begins where the last solve
 * of the handle ended, when that is nearer than zero: right sides that change little take a step or two. Bits
 * therefore depend on the solves before. */
BATTEN_API batten_status batten_saddle_solve(batten_context *ctx, batten_saddle *s, const double *f, double *w,
                                             double *c);

/* w [N] (finite) for the next solve by ITERATIVE to begin at, as the weights of a system a little different from this
 * one; NULL: zero. Other methods have no use for it. Fails: INVALID, NOMEM. */
BATTEN_API batten_status batten_saddle_begin_at(batten_context *ctx, batten_saddle *s, const double *w);

/* diagonal[q] = (inverse of the whole matrix)[index[q]][index[q]], q < count: leave-one-out errors are
 * w_i / diagonal_i (Rippa 1999). Cost: N^2 flops each, and 64 N numbers beyond what batten_saddle_bytes() says. Float
 * precision when the factor is mixed. Fails: INVALID (ITERATIVE has no factor to do it with), NOMEM, CANCELLED. */
BATTEN_API batten_status batten_saddle_inverse_diagonal(batten_context *ctx, batten_saddle *s, size_t count,
                                                        const size_t *index, double *diagonal);

BATTEN_API batten_saddle_info batten_saddle_get_info(const batten_saddle *s);
BATTEN_API void batten_saddle_free(batten_saddle *s);

#ifdef __cplusplus
}
#endif
#endif
