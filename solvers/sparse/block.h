/* Symmetric positive definite systems of small square blocks: unknowns of one node stay together.
 *
 * Both triangles are stored, as compressed rows of blocks. Conjugate gradients with the inverses of the diagonal
 * blocks for systems that are well conditioned by nature; Cholesky for those that are not, in a band after reverse
 * Cuthill-McKee by LAPACK, or supernodal after dissection where that is cheaper. All sums are in a fixed order: the
 * same bits for any number of threads. */
#ifndef BATTEN_SPARSE_BLOCK_H
#define BATTEN_SPARSE_BLOCK_H

#include <batten/base.h>
#include <stdbool.h>
#include <stdint.h>

enum { BLOCK_SIZE_MAX = 6 };

typedef struct block_matrix {
  size_t rows;       /* of blocks */
  unsigned size;     /* of a block, 1 .. BLOCK_SIZE_MAX */
  size_t *starts;    /* [rows + 1] */
  uint32_t *columns; /* [starts[rows]] ascending in a row, the diagonal among them */
  double *values;    /* [starts[rows]][size][size] row-major */
} block_matrix;

/* Pattern of the diagonal and of the pairs [pair_count][2] of different rows, both ways, pairs may repeat; values 0.
 */
batten_status block_matrix_new(batten_context *ctx, size_t rows, unsigned size, size_t pair_count,
                               const uint32_t *pairs, block_matrix *out);
void block_matrix_free(batten_context *ctx, block_matrix *a);
/* Block (i, j), NULL where the pattern has none. O(log of the row). */
double *block_matrix_at(const block_matrix *a, size_t i, size_t j);
/* y = A x. */
void block_matrix_apply(batten_context *ctx, const block_matrix *a, const double *x, double *y);

typedef struct block_cg_figures {
  size_t iterations;
  double residual; /* |b - A x| / |b| in the norm of the inverse diagonal blocks, from the true residual at the end */
} block_cg_figures;
/* x in: start; out: solution to residual <= tolerance. W_ACCURACY when most iterations do not reach it, SINGULAR when
 * a diagonal block is not positive definite (names the row). progress phase as given. */
batten_status block_cg(batten_context *ctx, const block_matrix *a, const double *b, double tolerance, size_t most,
                       const char *phase, double *x, block_cg_figures *figures);

/* Cholesky. The plan depends on the pattern alone and serves many factorisations. AUTO is the cheaper one of both;
 * QUICK is so too, but does without dissection, which takes as long to find as ten factorisations and more: for plans
 * that serve few. */
typedef struct block_plan block_plan;
typedef enum block_method { BLOCK_AUTO = 0, BLOCK_BAND, BLOCK_SUPERNODAL, BLOCK_QUICK } block_method;
batten_status block_plan_new(batten_context *ctx, const block_matrix *a, block_method method, block_plan **out);
void block_plan_free(batten_context *ctx, block_plan *plan);
block_method block_plan_method(const block_plan *plan);
double block_plan_flops(const block_plan *plan);
size_t block_plan_bytes(const block_plan *plan); /* held, the factor included */
/* SINGULAR: not positive definite to rounding; *row (may be NULL) is the block row. */
batten_status block_factor(batten_context *ctx, block_plan *plan, const block_matrix *a, size_t *row);
void block_solve(batten_context *ctx, const block_plan *plan, double *x /* [rows * size] */);

#endif
