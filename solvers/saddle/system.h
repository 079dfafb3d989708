/* The inside of a batten_saddle, shared by the files of solvers/saddle.
 *
 * Factors are of the scaled system
 *     [ s K   P S ] [w ]   [s f]
 *     [ S P'   0  ] [c'] = [ 0 ],   c = S c' / s,
 * s and the diagonal S being powers of two that bring K and each column of P to size 1: exact, it keeps float from
 * under- and overflow and makes pivoting independent of the caller's units.
 *
 *   tiles.c     walks K tile by tile: assembly, products with fresh entries
 *   rfp.c       Cholesky and BLAS-3 on a triangle in rectangular full packed storage, double or float
 *   project.c   QR of P, Householder projection, solves with the projected factor
 *   dense.c     LDL' and QR of the whole matrix
 *   saddle.c    the public calls: choice of method, memory, refinement, fall-back
 *   schwarz.h   the map of the iterative method */
#ifndef BATTEN_SADDLE_SYSTEM_H
#define BATTEN_SADDLE_SYSTEM_H

#include <batten/saddle.h>
#include <stdbool.h>

#include "base/checked.h"
#include "la/la.h"

/* QR of P S with column pivoting: P S = Q [R; 0] Pi', Q = I - V T V'. All NULL when k = 0. */
typedef struct batten_saddle_qr {
  double *v;      /* [k][N] columns of V, ones and zeros written out */
  double *t;      /* [k][k] */
  double *r;      /* [k][k] upper */
  size_t *pivots; /* [k] column j of R is column pivots[j] of P */
} batten_saddle_qr;

struct batten_saddle {
  batten_context *ctx;
  batten_saddle_matrix matrix;
  batten_saddle_options options;
  batten_saddle_info info;
  bool factored;   /* false before the first factor, and after a fall-back that failed */
  double scale;    /* s */
  double *p_scale; /* [k] the diagonal of S */

  /* Projection methods: Q' s K Q = [b11 b21'; b21 b22], and the factor of b22. */
  batten_saddle_qr qr;
  batten_la_real real; /* precision of rfp */
  void *rfp;           /* factor of b22, order N - k */
  double *head;        /* [k][N]: b11 (full) over b21 */

  /* LDL' and QR of the whole matrix. */
  double *a;             /* [N+k][N+k] */
  batten_la_int *pivots; /* [N+k], LDL' */
  double *tau;           /* [N+k], QR */

  struct saddle_iterative *iterative;
  double *begin; /* [N] where the next solve by iteration begins, NULL: at zero */
};

/* A double factor with a smaller reciprocal condition counts as singular. 32: a pivot that should be 0 (duplicates)
 * comes out as a few eps of either sign, and the estimate is within a factor of 3. */
#define BATTEN_SADDLE_RCOND_MIN (32 * 0x1p-52)

static inline size_t batten_saddle_order(const batten_saddle *s) { return s->matrix.n + s->matrix.k; }

/* b [N+k] holds a right side of the caller's system and becomes its solution, once, unrefined, by the factor at hand.
 */
batten_status batten_saddle_apply(const batten_saddle *s, double *b);

/* ---- iterative.c ---- */

/* Bytes that set-up and solve take at their peak; s NULL: with default options. */
size_t batten_saddle_iterative_bytes(const batten_saddle *s, size_t n, size_t k);
batten_status batten_saddle_iterative_new(batten_saddle *s);
void batten_saddle_iterative_free(batten_saddle *s);
/* w, c for f; W_ACCURACY where direct rows miss options.accuracy. w may be f. */
batten_status batten_saddle_iterative_solve(batten_saddle *s, const double *f, double *w, double *c);

/* ---- tiles.c ---- */

/* One tile of the lower triangle: rows >= cols block by block, data[i + j * ld] = K[row0 + i][col0 + j], a diagonal
 * tile being full. With `across`, data holds the transpose: data[j + i * ld]. */
typedef struct batten_saddle_tile {
  size_t row0, rows, col0, cols, ld;
  bool across;
  double *data;
} batten_saddle_tile;

/* Bytes that a walk takes. */
size_t batten_saddle_walk_bytes(size_t n);

/* Calls sink(arg, worker, tile) for each tile of the lower triangle of K, once, from several threads; which tiles a
 * worker gets, in which order, depends on n and the breaks alone. No tile straddles a break (breaks[0] <= breaks[1]);
 * tiles with col0 >= breaks[1] come across. With check, entries that are not finite are refused. */
batten_status batten_saddle_walk(const batten_saddle *s, const char *phase, const size_t breaks[2], bool check,
                                 void (*sink)(void *arg, size_t worker, const batten_saddle_tile *tile), void *arg);

/* Finds the power of two that brings a few probed columns of K to size 1. */
batten_status batten_saddle_probe_scale(batten_saddle *s);

/* y = K x (or |K| |x|) for m columns, x and y [m][N]; entries computed anew, same bits for any thread count. Bytes:
 * product_bytes. */
size_t batten_saddle_product_bytes(size_t n, size_t m);
batten_status batten_saddle_product(const batten_saddle *s, const char *phase, bool absolute, size_t m,
                                    const double *x, double *y);

/* Bytes that a solve takes beside the factor: its vectors, and the product of a residual. */
static inline size_t batten_saddle_solve_bytes(size_t n, size_t k) {
  return 3 * (n + k) * sizeof(double) + batten_saddle_product_bytes(n, 1);
}

/* ---- project.c ---- */

/* QR of P into s->qr, with p_scale; SINGULAR names the column that depends on others. */
batten_status batten_saddle_qr_new(batten_saddle *s);
void batten_saddle_qr_free(batten_saddle *s);

/* Projection and Cholesky in double or float. SINGULAR when the projected matrix is not positive definite to that
 * precision. */
size_t batten_saddle_project_bytes(batten_la_real real, size_t n, size_t k);
batten_status batten_saddle_project_factor(batten_saddle *s, batten_la_real real);
/* b [N+k] := inverse of the scaled matrix * b. */
batten_status batten_saddle_project_solve(const batten_saddle *s, double *b);
/* diagonal[q] = (inverse of the scaled matrix)[index[q]][index[q]]; count at most 64 or so at a time. */
batten_status batten_saddle_project_diagonal(const batten_saddle *s, size_t count, const size_t *index,
                                             double *diagonal);
void batten_saddle_project_free(batten_saddle *s);

/* ---- dense.c ---- */

size_t batten_saddle_dense_bytes(batten_saddle_method method, size_t n, size_t k);
batten_status batten_saddle_dense_factor(batten_saddle *s, batten_saddle_method method);
/* b [nrhs][N+k] := inverse of the scaled matrix * b. */
batten_status batten_saddle_dense_solve(const batten_saddle *s, size_t nrhs, double *b);
void batten_saddle_dense_free(batten_saddle *s);

/* SINGULAR, naming the rows that make the factored matrix so: found by inverse iteration. */
batten_status batten_saddle_dense_singular(const batten_saddle *s);

#endif
