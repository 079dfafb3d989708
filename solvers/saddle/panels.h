/* Small symmetric positive definite matrices for the local solves, without BLAS: these run inside of batten's own
 * loops, where every OpenBLAS would start threads of its own or wait for those of another call, and none can be told
 * to stay on one thread without changing the host's setting.
 *
 * The lower triangle is cut into panels of `width` rows, 64 bytes of a column, one vector or a few:
 *
 *     panel p    rows p width .. p width + width - 1, columns 0 .. p width + width - 1, column after column
 *     (i, j)     at width^2 q (q + 1) / 2 + width j + i - width q,   q = i / width
 *
 * which is what the inner loop of a Cholesky factorization by blocks reads one after the other: a vector of the
 * panel's rows times single numbers of another panel. About n (n + width) / 2 elements. Rows from n on are those of
 * the identity. */
#ifndef BATTEN_SADDLE_PANELS_H
#define BATTEN_SADDLE_PANELS_H

#include <stddef.h>

#include "la/la.h"

enum { BATTEN_PANEL_BYTES = 64 };

static inline size_t batten_panel_width(batten_la_real real) { return BATTEN_PANEL_BYTES / (size_t)real; }

/* n rounded up to whole panels. */
static inline size_t batten_panel_rows(batten_la_real real, size_t n) {
  size_t width = batten_panel_width(real);
  return (n + width - 1) / width * width;
}

/* Elements of the storage; for n below 2^26 or so: nobody makes larger ones. */
static inline size_t batten_panel_count(batten_la_real real, size_t n) {
  size_t rows = batten_panel_rows(real, n), width = batten_panel_width(real);
  return rows * (rows + width) / 2;
}

/* Where (i, j), j <= i, stands. */
static inline size_t batten_panel_at(batten_la_real real, size_t i, size_t j) {
  size_t width = batten_panel_width(real), q = i / width;
  return width * width * (q * (q + 1) / 2) + width * j + (i - width * q);
}

typedef struct saddle_panels {
  /* B := L with B = L L', the diagonal of L inverted; storage aligned to 64 bytes. Returns 0, or the 1-based order of
   * the leading minor whose pivot is not above `least` times what stood on the diagonal. */
  size_t (*factor)(size_t n, void *b, double least);
  /* x [batten_panel_rows] := B^-1 x by the factor; x aligned, zeros from n on. */
  void (*solve)(size_t n, const void *b, void *x);
} saddle_panels;

/* The loops of one instruction set; the same results within a set for any thread count. */
typedef struct saddle_code {
  saddle_panels in_float, in_double;
  /* y [r][ld] := A v for r vectors v [r][ld], A [m][ld] symmetric by its lower triangle. */
  void (*multiply)(size_t m, size_t ld, const double *a, size_t r, const double *v, double *y);
  /* A := A - v x' - x v' in the columns from r on of the lower triangle. */
  void (*update)(size_t m, size_t ld, double *a, size_t r, const double *v, const double *x);
} saddle_code;

static inline const saddle_panels *batten_saddle_panels(const saddle_code *code, batten_la_real real) {
  return real == BATTEN_LA_DOUBLE ? &code->in_double : &code->in_float;
}

/* The widest set that the processor has, and all that it has, widest first, NULL at the end. */
const saddle_code *batten_saddle_code(void);
const saddle_code *batten_saddle_code_at(unsigned index);

#endif
