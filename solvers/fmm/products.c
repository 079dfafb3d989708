/* Small dense products, and polynomials at many points, for one instruction set (see lanes.h). BLAS would start
 * threads of its own inside of ours, and its bits depend on its make. */
#include "fmm/lanes.h"

#include <math.h>
#include <string.h>

/* gcc would first unroll a loop over the lanes, then fail to see the vectors in what is left. */
#if defined(__GNUC__) && !defined(__clang__)
#define LANES_LOOP _Pragma("GCC unroll 1") for
#else
#define LANES_LOOP for
#endif

/* ---- the far field's product ---- */

/* How much of a tile fits the registers: 3 vectors times 8 columns of 32 registers with AVX-512, 3 times 4 of 16
 * otherwise. Vectors are the processor's own: gcc takes wider ones apart through memory, at a tenth of the speed.
 * Each number of the product is one sum over k in its order, however the tile is cut. */
#if defined(__AVX512F__)
enum { VECTOR = 8, PART_COLUMNS = 8 };
#define COLUMNS(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7)
#else
#if defined(__AVX2__)
enum { VECTOR = 4, PART_COLUMNS = 4 };
#else
enum { VECTOR = 2, PART_COLUMNS = 4 };
#endif
#define COLUMNS(X) X(0) X(1) X(2) X(3)
#endif
enum { PART_ROWS = 3 * VECTOR };
#define VECTORS(X, c) X(c, 0) X(c, 1) X(c, 2)

/* VECTOR numbers at any address. */
typedef double vector __attribute__((vector_size(VECTOR * sizeof(double)), aligned(8), may_alias));

static inline void part(size_t depth, const double *panel, const double *b, size_t ldb, double *y, size_t ldy) {
#define CLEAR_ONE(c, v) vector s##c##v = {0};
#define CLEAR(c) VECTORS(CLEAR_ONE, c)
#define LOAD(c, v) const vector a##v = *(const vector *)(panel + VECTOR * v);
#define ADD_ONE(c, v) s##c##v += a##v * factor##c;
#define ADD(c)                             \
  const double factor##c = b[c * ldb + k]; \
  VECTORS(ADD_ONE, c)
#define STORE_ONE(c, v) *(vector *)(y + c * ldy + VECTOR * v) = s##c##v;
#define STORE(c) VECTORS(STORE_ONE, c)
  COLUMNS(CLEAR)
  for (size_t k = 0; k < depth; k++, panel += FMM_PANEL) {
    VECTORS(LOAD, 0)
    COLUMNS(ADD)
  }
  COLUMNS(STORE)
}

static void tile(size_t depth, const double *panel, const double *b, size_t ldb, double *y, size_t ldy) {
  for (size_t c = 0; c < FMM_COLUMNS; c += PART_COLUMNS)
    for (size_t i = 0; i < FMM_PANEL; i += PART_ROWS) part(depth, panel + i, b + c * ldb, ldb, y + c * ldy + i, ldy);
}

static void contract(unsigned order, size_t rest, const double (*matrix)[FMM_ORDER_MAX], const double *in,
                     double *out) {
  for (size_t q = 0; q < rest; q++, out += order) {
    double sum[FMM_ORDER_MAX] = {0};
    for (unsigned a = 0; a < order; a++) {
      const double t = in[a * rest + q];
      LANES_LOOP(unsigned i = 0; i < FMM_ORDER_MAX; i++) sum[i] += matrix[a][i] * t;
    }
    memcpy(out, sum, order * sizeof *out);
  }
}

static void combine(size_t count, size_t length, const double *rows, const double *x, double *restrict out) {
  size_t j = 0;
  for (; j + 4 <= count; j += 4, rows += 4 * length) {
    const double *b = rows + length, *c = b + length, *d = c + length;
    const double p = x[j], q = x[j + 1], r = x[j + 2], s = x[j + 3];
    for (size_t i = 0; i < length; i++) out[i] += (p * rows[i] + q * b[i]) + (r * c[i] + s * d[i]);
  }
  for (; j < count; j++, rows += length)
    for (size_t i = 0; i < length; i++) out[i] += x[j] * rows[i];
}

/* ---- polynomials ---- */

/* tau_k and its derivative at x[lane] in [-1, 1]. */
static inline void polynomials(unsigned order, const double x[FMM_LANES], double value[FMM_ORDER_MAX][FMM_LANES],
                               double slope[FMM_ORDER_MAX][FMM_LANES]) {
  const double first = sqrt(1.0 / order), others = sqrt(2.0 / order);
  LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) {
    value[0][i] = 1, slope[0][i] = 0;
    value[1][i] = x[i], slope[1][i] = 1;
  }
  for (unsigned k = 2; k < order; k++) LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) {
      value[k][i] = 2 * x[i] * value[k - 1][i] - value[k - 2][i];
      slope[k][i] = 2 * value[k - 1][i] + 2 * x[i] * slope[k - 1][i] - slope[k - 2][i];
    }
  for (unsigned k = 0; k < order; k++) LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) {
      const double factor = k ? others : first;
      value[k][i] *= factor, slope[k][i] *= factor;
    }
}

/* A few sources at a time, so that the moments are loaded and stored once for all of them. */
enum { SIDE = 4 };

static void add_side(size_t order, size_t rest, const double a[FMM_ORDER_MAX][FMM_LANES], unsigned lane,
                     const double *w, double *restrict moments) {
  for (size_t i = 0; i < order; i++, moments += rest) {
    const double *c = a[i] + lane, *w1 = w + rest, *w2 = w1 + rest, *w3 = w2 + rest;
    for (size_t q = 0; q < rest; q++) moments[q] += (c[0] * w[q] + c[1] * w1[q]) + (c[2] * w2[q] + c[3] * w3[q]);
  }
}

/* w . g: the part of the terms that goes with tau(x) and that which goes with its derivative, for each source a row
 * of the other axes' products. u and g are the weight and the dipole in units of the cell. */
static void side_rows(unsigned n, size_t order, unsigned lane, double u, const double g[3],
                      double value[3][FMM_ORDER_MAX][FMM_LANES], double slope[3][FMM_ORDER_MAX][FMM_LANES],
                      double *plain, double *along) {
  if (n == 2) {
    for (size_t b = 0; b < order; b++) {
      plain[b] = u * value[1][b][lane] + g[1] * slope[1][b][lane];
      along[b] = g[0] * value[1][b][lane];
    }
    return;
  }
  for (size_t b = 0; b < order; b++) {
    const double vb = value[1][b][lane], p = u * vb + g[1] * slope[1][b][lane], q = g[2] * vb, r = g[0] * vb;
    for (size_t c = 0; c < order; c++, plain++, along++) {
      *plain = p * value[2][c][lane] + q * slope[2][c][lane];
      *along = r * value[2][c][lane];
    }
  }
}

static void moments(unsigned n, unsigned order, const fmm_frame *frame, int dipoles, const fmm_terms *terms,
                    size_t first, size_t last, double *out, double *scratch) {
  const size_t rest = n == 2 ? order : (size_t)order * order;
  double value[3][FMM_ORDER_MAX][FMM_LANES], slope[3][FMM_ORDER_MAX][FMM_LANES], x[FMM_LANES];
  double *plain = scratch, *along = scratch + SIDE * rest;
  for (size_t j0 = first; j0 < last; j0 += FMM_LANES) {
    for (unsigned a = 0; a < n; a++) {
      for (size_t i = 0; i < FMM_LANES; i++)
        x[i] = (terms->x[a][j0 + i < last ? j0 + i : last - 1] - frame->centre[a]) / frame->half;
      polynomials(order, x, value[a], slope[a]);
    }
    for (unsigned lane = 0; lane < FMM_LANES && j0 + lane < last; lane += SIDE) {
      for (unsigned s = 0; s < SIDE; s++) { /* those beyond the last weigh nothing */
        const size_t j = j0 + lane + s;
        double g[3] = {0, 0, 0};
        for (unsigned a = 0; a < n && dipoles && j < last; a++) g[a] = terms->g[a][j] / frame->half;
        side_rows(n, order, lane + s, j < last ? terms->w[j] : 0, g, value, slope, plain + s * rest,
                  along + s * rest);
      }
      add_side(order, rest, (const double(*)[FMM_LANES])value[0], lane, plain, out);
      if (dipoles) add_side(order, rest, (const double(*)[FMM_LANES])slope[0], lane, along, out);
    }
  }
}

/* row[q][lane] += sums over the last axis: of tau, and of its derivative. */
static inline void last_axis(size_t order, int gradients, const double *local, double value[FMM_ORDER_MAX][FMM_LANES],
                             double slope[FMM_ORDER_MAX][FMM_LANES], double row[2][FMM_LANES]) {
  double v[FMM_LANES] = {0}, d[FMM_LANES] = {0};
  for (size_t c = 0; c < order; c++) LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) v[i] += local[c] * value[c][i];
  if (gradients)
    for (size_t c = 0; c < order; c++) LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) d[i] += local[c] * slope[c][i];
  memcpy(row[0], v, sizeof v), memcpy(row[1], d, sizeof d);
}

static void evaluate(unsigned n, unsigned order, const fmm_frame *frame, int gradients, const double *local,
                     const double x[3][FMM_LANES], double sums[FMM_SUMS][FMM_LANES]) {
  double value[3][FMM_ORDER_MAX][FMM_LANES], slope[3][FMM_ORDER_MAX][FMM_LANES];
  double total[FMM_SUMS][FMM_LANES] = {{0}};
  for (unsigned a = 0; a < n; a++) {
    double y[FMM_LANES];
    LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) y[i] = (x[a][i] - frame->centre[a]) / frame->half;
    polynomials(order, y, value[a], slope[a]);
  }
  for (size_t a = 0; a < order; a++) {
    double u[FMM_LANES] = {0}, uy[FMM_LANES] = {0}, uz[FMM_LANES] = {0}; /* sums over the axes after the first */
    if (n == 2) {
      double row[2][FMM_LANES];
      last_axis(order, gradients, local, value[1], slope[1], row);
      local += order;
      memcpy(u, row[0], sizeof u), memcpy(uy, row[1], sizeof uy);
    }
    for (size_t b = 0; b < order && n == 3; b++, local += order) {
      double row[2][FMM_LANES];
      last_axis(order, gradients, local, value[2], slope[2], row);
      LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) {
        u[i] += value[1][b][i] * row[0][i];
        uy[i] += slope[1][b][i] * row[0][i];
        uz[i] += value[1][b][i] * row[1][i];
      }
    }
    LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) {
      total[0][i] += value[0][a][i] * u[i];
      total[1][i] += slope[0][a][i] * u[i];
      total[2][i] += value[0][a][i] * uy[i];
      total[3][i] += value[0][a][i] * uz[i];
    }
  }
  for (unsigned q = 0; q < (gradients ? 1 + n : 1); q++)
    LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) sums[q][i] += q ? total[q][i] / frame->half : total[q][i];
}

#define NAME_TEXT_(a) #a
#define NAME_TEXT(a) NAME_TEXT_(a)
const fmm_lanes FMM_OF_SET(batten_fmm_lanes) = {
    .name = NAME_TEXT(FMM_ISA),
    .near = FMM_OF_SET(batten_fmm_near),
    .fill = FMM_OF_SET(batten_fmm_fill),
    .tile = tile,
    .contract = contract,
    .combine = combine,
    .moments = moments,
    .evaluate = evaluate,
};
