/* The inner loops of fast multipole sums, once per instruction set; batten_fmm_lanes_now() gives the widest that the
 * processor has.
 *
 * Every number is made by the same IEEE operations in the same order in each set, and no product is contracted with a
 * sum: the choice changes the time and no bit. */
#ifndef BATTEN_FMM_LANES_H
#define BATTEN_FMM_LANES_H

#include <stddef.h>

enum {
  FMM_LANES = 8,      /* targets that are summed side by side: one AVX-512 register */
  FMM_SUMS = 4,       /* u, u_x, u_y, u_z */
  FMM_PANEL = 24,     /* rows of a matrix that lie together, see tile */
  FMM_COLUMNS = 8,    /* columns of a product made at a time */
  FMM_ORDER_MAX = 16, /* Chebyshev polynomials for each axis; also the length of a row of a small matrix */
};

/* Sources, one array for each axis; g is read by sums with dipoles only. */
typedef struct fmm_terms {
  const double *x[3], *w, *g[3];
} fmm_terms;

/* sums[q][lane] += the terms first .. last - 1 at the points x[axis][lane]; those of derivatives and of axes that the
 * function does not have are untouched. */
typedef void fmm_near_function(const fmm_terms *terms, size_t first, size_t last, const double x[3][FMM_LANES],
                               double sums[FMM_SUMS][FMM_LANES]);

/* panel[j][i] = phi(|row_i - column_j|), i < FMM_PANEL, j < count */
typedef void fmm_fill_function(const double rows[3][FMM_PANEL], size_t count, const double *const columns[3],
                               double *panel);

/* Where a cell is. */
typedef struct fmm_frame {
  double centre[3], half; /* half the side, a power of two */
} fmm_frame;

/* Tensors have order^n entries, the last axis fastest; tau_0 .. tau_(order-1) are the polynomials of operators.c. */
typedef struct fmm_lanes {
  const char *name; /* of the instruction set */
  /* By dimension, power, whether gradients are wanted, and whether sources have dipoles. */
  fmm_near_function *(*near)(unsigned n, unsigned power, int gradients, int dipoles);
  fmm_fill_function *(*fill)(unsigned n, unsigned power);
  /* y[c][i] = sum_k panel[k][i] b[c][k], i < FMM_PANEL, c < FMM_COLUMNS, k < depth */
  void (*tile)(size_t depth, const double *panel, const double *b, size_t ldb, double *y, size_t ldy);
  /* out[q][i] = sum_a matrix[a][i] in[a][q], a and i < order, q < rest: one axis of a tensor goes through a matrix
   * and from the first place to the last */
  void (*contract)(unsigned order, size_t rest, const double (*matrix)[FMM_ORDER_MAX], const double *in, double *out);
  /* out[i] += sum_j rows[j][i] x[j], i < length, j < count */
  void (*combine)(size_t count, size_t length, const double *rows, const double *x, double *out);
  /* moments += those of the terms first .. last - 1; scratch has 8 order^(n-1) numbers */
  void (*moments)(unsigned n, unsigned order, const fmm_frame *frame, int dipoles, const fmm_terms *terms,
                  size_t first, size_t last, double *moments, double *scratch);
  /* sums += the expansion `local` at FMM_LANES points, with its derivatives if wanted */
  void (*evaluate)(unsigned n, unsigned order, const fmm_frame *frame, int gradients, const double *local,
                   const double x[3][FMM_LANES], double sums[FMM_SUMS][FMM_LANES]);
} fmm_lanes;

/* The names that sources built for a set give to what they make. */
#define FMM_JOIN_(a, b) a##_##b
#define FMM_JOIN(a, b) FMM_JOIN_(a, b)
#define FMM_OF_SET(name) FMM_JOIN(name, FMM_ISA)
#if defined(FMM_ISA)
fmm_near_function *FMM_OF_SET(batten_fmm_near)(unsigned n, unsigned power, int gradients, int dipoles);
fmm_fill_function *FMM_OF_SET(batten_fmm_fill)(unsigned n, unsigned power);
extern const fmm_lanes FMM_OF_SET(batten_fmm_lanes);
#endif

const fmm_lanes *batten_fmm_lanes_now(void);
/* The sets that run here, widest first; NULL when there are no more. */
const fmm_lanes *batten_fmm_lanes_at(unsigned index);

#endif
