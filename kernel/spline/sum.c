/* Sums over all centres and tiles of the matrix, for one instruction set (see sum.h).
 *
 * SPLINE_LANES points go side by side through the loop over the centres: the compiler turns each loop over the lanes
 * into a few vector instructions and keeps the sums in registers. Each kernel power, dimension and order of
 * derivative has its own function, made from one inline body by constants. */
#include "spline/sum.h"

#include "basis/green.h"

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

/* gcc would first unroll a loop over the lanes, then fail to see the vectors in what is left. */
#if defined(__GNUC__) && !defined(__clang__)
#define LANES_LOOP _Pragma("GCC unroll 1") for
#else
#define LANES_LOOP for
#endif

/* (n, power) that exist, and those smooth enough for gradient data. */
#define KERNELS(X) X(1, 1) X(1, 3) X(1, 5) X(1, 7) X(2, 2) X(2, 4) X(2, 6) X(3, 1) X(3, 3) X(3, 5)
#define SMOOTH_KERNELS(X) X(1, 3) X(1, 5) X(1, 7) X(2, 4) X(2, 6) X(3, 3) X(3, 5)

/* Centres whose terms are added up before they join the total: rounding errors grow with CHUNK + N / CHUNK, not N. */
enum { CHUNK = 64 };

/* The terms of centre j. U = w phi - t phi1 with t = g . d and so on: the derivatives of green.h. */
BATTEN_ALWAYS_INLINE void add_centre(unsigned n, unsigned power, unsigned order, bool hermite, const spline_terms *c,
                                     size_t j, double x[3][SPLINE_LANES], double sums[SPLINE_SUMS][SPLINE_LANES]) {
  const double cx = c->x[0][j], cy = n > 1 ? c->x[1][j] : 0, cz = n > 2 ? c->x[2][j] : 0, w = c->w[j];
  const size_t h = hermite ? j - c->plain : 0;
  const double gx = hermite ? c->g[0][h] : 0, gy = hermite && n > 1 ? c->g[1][h] : 0;
  const double gz = hermite && n > 2 ? c->g[2][h] : 0;
  LANES_LOOP(unsigned i = 0; i < SPLINE_LANES; i++) {
    const double dx = x[0][i] - cx, dy = n > 1 ? x[1][i] - cy : 0, dz = n > 2 ? x[2][i] - cz : 0;
    double d2 = dx * dx, t = gx * dx;
    if (n > 1) d2 += dy * dy, t += gy * dy;
    if (n > 2) d2 += dz * dz, t += gz * dz;
    const batten_radial_terms f = batten_green_radial(power, order + hermite, d2);
    sums[0][i] += hermite ? w * f.f0 - t * f.f1 : w * f.f0;
    if (order == 0) continue;
    /* u1 d_a and u2 d_a d_b collect what has the same shape. */
    const double u1 = hermite ? w * f.f1 - t * f.f2 : w * f.f1;
    sums[1][i] += hermite ? u1 * dx - gx * f.f1 : u1 * dx;
    if (n > 1) sums[2][i] += hermite ? u1 * dy - gy * f.f1 : u1 * dy;
    if (n > 2) sums[3][i] += hermite ? u1 * dz - gz * f.f1 : u1 * dz;
    if (order == 1) continue;
    const double u2 = hermite ? w * f.f2 - t * f.f3 : w * f.f2;
    sums[4][i] += u1 + (hermite ? u2 * dx * dx - 2 * f.f2 * (gx * dx) : u2 * dx * dx);
    if (n > 1) {
      sums[5][i] += hermite ? u2 * dx * dy - f.f2 * (gx * dy + gy * dx) : u2 * dx * dy;
      sums[7][i] += u1 + (hermite ? u2 * dy * dy - 2 * f.f2 * (gy * dy) : u2 * dy * dy);
    }
    if (n > 2) {
      sums[6][i] += hermite ? u2 * dx * dz - f.f2 * (gx * dz + gz * dx) : u2 * dx * dz;
      sums[8][i] += hermite ? u2 * dy * dz - f.f2 * (gy * dz + gz * dy) : u2 * dy * dz;
      sums[9][i] += u1 + (hermite ? u2 * dz * dz - 2 * f.f2 * (gz * dz) : u2 * dz * dz);
    }
  }
}

BATTEN_ALWAYS_INLINE void add_centres(unsigned n, unsigned power, unsigned order, bool hermite, const spline_terms *c,
                                      double x[3][SPLINE_LANES], double sums[SPLINE_SUMS][SPLINE_LANES]) {
  const size_t first = hermite ? c->plain : 0, last = hermite ? c->plain + c->hermite : c->plain;
  static const unsigned used_by_order[3] = {1, 4, SPLINE_SUMS};
  const unsigned used = used_by_order[order];
  for (size_t j0 = first; j0 < last; j0 += CHUNK) {
    const size_t j1 = last - j0 < CHUNK ? last : j0 + CHUNK;
    double part[SPLINE_SUMS][SPLINE_LANES] = {{0}};
    for (size_t j = j0; j < j1; j++) add_centre(n, power, order, hermite, c, j, x, part);
    for (unsigned q = 0; q < used; q++) LANES_LOOP(unsigned i = 0; i < SPLINE_LANES; i++) sums[q][i] += part[q][i];
  }
}

/* One function per kernel, order of derivative, and kind of data. */
#define SUM_FUNCTION(n, power, order, hermite)                                                          \
  static void sum_##n##_##power##_##order##_##hermite(const spline_terms *c, double x[3][SPLINE_LANES], \
                                                      double sums[SPLINE_SUMS][SPLINE_LANES]) {         \
    add_centres(n, power, order, hermite, c, x, sums);                                                  \
  }
#define PLAIN_FUNCTIONS(n, power) \
  SUM_FUNCTION(n, power, 0, 0) SUM_FUNCTION(n, power, 1, 0) SUM_FUNCTION(n, power, 2, 0)
#define HERMITE_FUNCTIONS(n, power) \
  SUM_FUNCTION(n, power, 0, 1) SUM_FUNCTION(n, power, 1, 1) SUM_FUNCTION(n, power, 2, 1)
KERNELS(PLAIN_FUNCTIONS)
SMOOTH_KERNELS(HERMITE_FUNCTIONS)

typedef void part_function(const spline_terms *c, double x[3][SPLINE_LANES], double sums[SPLINE_SUMS][SPLINE_LANES]);

static part_function *const plain_functions[4][8][3] = {
#define PLAIN_ROW(n, power) [n][power] = {sum_##n##_##power##_0_0, sum_##n##_##power##_1_0, sum_##n##_##power##_2_0},
    KERNELS(PLAIN_ROW)};
static part_function *const hermite_functions[4][8][3] = {
#define HERMITE_ROW(n, power) \
  [n][power] = {sum_##n##_##power##_0_1, sum_##n##_##power##_1_1, sum_##n##_##power##_2_1},
    SMOOTH_KERNELS(HERMITE_ROW)};

static void sum(const spline_terms *c, unsigned order, double x[3][SPLINE_LANES],
                double sums[SPLINE_SUMS][SPLINE_LANES]) {
  if (c->plain) plain_functions[c->n][c->power][order](c, x, sums);
  if (c->hermite) hermite_functions[c->n][c->power][order](c, x, sums);
}

/* kind 0: value and value; 1: one derivative, along `axis`, with `sign`; 2: two derivatives.
 * Entry (i, j) and entry (j, i) of the mirrored tile agree to the bit: they differ in the sign of d, and in nothing
 * else. */
BATTEN_ALWAYS_INLINE void fill(unsigned n, unsigned power, unsigned kind, const spline_tile *t) {
  const double *rx = t->row_x[0], *ry = n > 1 ? t->row_x[1] : rx, *rz = n > 2 ? t->row_x[2] : rx;
  const int a = t->row_axis < 0 ? t->col_axis : t->row_axis, b = t->col_axis < 0 ? t->row_axis : t->col_axis;
  const double *ra = kind ? t->row_x[a] : rx, *rb = kind ? t->row_x[b] : rx;
  const double sign = power % 4 == 2 || power % 4 == 3 ? 1 : -1; /* batten_green_sign */
  /* A derivative taken at the column's point changes the sign. */
  const double factor = t->col_axis < 0 ? sign : -sign, delta = a == b ? 1 : 0;
  for (size_t j = 0; j < t->cols; j++) {
    const double cx = t->col_x[0][j], cy = n > 1 ? t->col_x[1][j] : 0, cz = n > 2 ? t->col_x[2][j] : 0;
    const double ca = kind ? t->col_x[a][j] : 0, cb = kind ? t->col_x[b][j] : 0;
    double *restrict column = t->tile + j * t->ld;
    for (size_t i = 0; i < t->rows; i++) {
      const double dx = rx[i] - cx, dy = n > 1 ? ry[i] - cy : 0, dz = n > 2 ? rz[i] - cz : 0;
      double d2 = dx * dx;
      if (n > 1) d2 += dy * dy;
      if (n > 2) d2 += dz * dz;
      const batten_radial_terms f = batten_green_radial(power, kind, d2);
      if (kind == 0) column[i] = factor * f.f0;
      if (kind == 1) column[i] = factor * (f.f1 * (ra[i] - ca));
      if (kind == 2) column[i] = factor * (f.f1 * delta + f.f2 * ((ra[i] - ca) * (rb[i] - cb)));
    }
  }
}

#define FILL_FUNCTION(n, power, kind) \
  static void fill_##n##_##power##_##kind(const spline_tile *t) { fill(n, power, kind, t); }
#define VALUE_FILL(n, power) FILL_FUNCTION(n, power, 0)
#define DERIVATIVE_FILLS(n, power) FILL_FUNCTION(n, power, 1) FILL_FUNCTION(n, power, 2)
KERNELS(VALUE_FILL)
SMOOTH_KERNELS(DERIVATIVE_FILLS)

static spline_tile_function *const fill_functions[3][4][8] = {
#define FILL_0(n, power) [0][n][power] = fill_##n##_##power##_0,
#define FILL_1(n, power) [1][n][power] = fill_##n##_##power##_1, [2][n][power] = fill_##n##_##power##_2,
    KERNELS(FILL_0) SMOOTH_KERNELS(FILL_1)};

static void tile(const spline_tile *t) { fill_functions[(t->row_axis >= 0) + (t->col_axis >= 0)][t->n][t->power](t); }

#define SPLINE_NAME_TEXT_(a) #a
#define SPLINE_NAME_TEXT(a) SPLINE_NAME_TEXT_(a)
extern const spline_code JOIN(batten_spline_code_, SPLINE_ISA);
const spline_code JOIN(batten_spline_code_, SPLINE_ISA) = {SPLINE_NAME_TEXT(SPLINE_ISA), sum, tile};
