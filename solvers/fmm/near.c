/* Direct sums, and panels of the matrix phi(|x - y|), for one instruction set (see lanes.h).
 *
 * FMM_LANES targets go side by side through the loop over the sources: the compiler turns each loop over the lanes
 * into a few vector instructions and keeps the sums in registers. Each kernel, dimension and kind of term has its own
 * function, made from one inline body by constants. */
#include "fmm/lanes.h"

#include "fmm/radial.h"

/* gcc would first unroll a loop over the lanes, then fail to see the vectors in what is left. */
#if defined(__GNUC__) && !defined(__clang__)
#define LANES_LOOP _Pragma("GCC unroll 1") for
#else
#define LANES_LOOP for
#endif

/* (n, power) that exist; even powers have the logarithm. */
#define KERNELS(X) \
  X(2, 1) X(2, 2) X(2, 3) X(2, 4) X(2, 5) X(2, 6) X(2, 7) X(3, 1) X(3, 2) X(3, 3) X(3, 4) X(3, 5) X(3, 6) X(3, 7)

/* Sources whose terms are added up before they join the total: rounding errors grow with CHUNK + N / CHUNK, not N. */
enum { CHUNK = 64 };

/* The terms of source j. u = w phi - t phi1 with t = g . d, and its derivatives as radial.h has them. */
BATTEN_ALWAYS_INLINE void add_source(unsigned n, unsigned power, bool gradients, bool dipoles, const fmm_terms *s,
                                     size_t j, const double x[3][FMM_LANES], double sums[FMM_SUMS][FMM_LANES]) {
  const double sx = s->x[0][j], sy = s->x[1][j], sz = n > 2 ? s->x[2][j] : 0, w = s->w[j];
  const double gx = dipoles ? s->g[0][j] : 0, gy = dipoles ? s->g[1][j] : 0, gz = dipoles && n > 2 ? s->g[2][j] : 0;
  LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) {
    const double dx = x[0][i] - sx, dy = x[1][i] - sy, dz = n > 2 ? x[2][i] - sz : 0;
    double d2 = dx * dx + dy * dy, t = gx * dx + gy * dy;
    if (n > 2) d2 += dz * dz, t += gz * dz;
    const batten_radial_terms f = batten_green_radial(power, gradients + dipoles, d2);
    sums[0][i] += dipoles ? w * f.f0 - t * f.f1 : w * f.f0;
    if (!gradients) continue;
    const double u1 = dipoles ? w * f.f1 - t * f.f2 : w * f.f1;
    sums[1][i] += dipoles ? u1 * dx - gx * f.f1 : u1 * dx;
    sums[2][i] += dipoles ? u1 * dy - gy * f.f1 : u1 * dy;
    if (n > 2) sums[3][i] += dipoles ? u1 * dz - gz * f.f1 : u1 * dz;
  }
}

BATTEN_ALWAYS_INLINE void add_sources(unsigned n, unsigned power, bool gradients, bool dipoles, const fmm_terms *s,
                                      size_t first, size_t last, const double x[3][FMM_LANES],
                                      double sums[FMM_SUMS][FMM_LANES]) {
  const unsigned used = gradients ? 1 + n : 1;
  for (size_t j0 = first; j0 < last; j0 += CHUNK) {
    const size_t j1 = last - j0 < CHUNK ? last : j0 + CHUNK;
    double part[FMM_SUMS][FMM_LANES] = {{0}};
    for (size_t j = j0; j < j1; j++) add_source(n, power, gradients, dipoles, s, j, x, part);
    for (unsigned q = 0; q < used; q++) LANES_LOOP(unsigned i = 0; i < FMM_LANES; i++) sums[q][i] += part[q][i];
  }
}

#define FUNCTION(n, power, gradients, dipoles)                                                            \
  static void near_##n##_##power##_##gradients##_##dipoles(const fmm_terms *s, size_t first, size_t last, \
                                                           const double x[3][FMM_LANES],                  \
                                                           double sums[FMM_SUMS][FMM_LANES]) {            \
    add_sources(n, power, gradients, dipoles, s, first, last, x, sums);                                   \
  }
#define FUNCTIONS(n, power) \
  FUNCTION(n, power, 0, 0) FUNCTION(n, power, 0, 1) FUNCTION(n, power, 1, 0) FUNCTION(n, power, 1, 1)
KERNELS(FUNCTIONS)

fmm_near_function *FMM_OF_SET(batten_fmm_near)(unsigned n, unsigned power, int gradients, int dipoles) {
  static fmm_near_function *const functions[4][8][2][2] = {
#define ROW(n, power)                                                 \
  [n][power] = {{near_##n##_##power##_0_0, near_##n##_##power##_0_1}, \
                {near_##n##_##power##_1_0, near_##n##_##power##_1_1}},
      KERNELS(ROW)};
  return n < 4 && power < 8 ? functions[n][power][gradients != 0][dipoles != 0] : NULL;
}

BATTEN_ALWAYS_INLINE void fill(unsigned n, unsigned power, const double rows[3][FMM_PANEL], size_t count,
                               const double *const columns[3], double *panel) {
  for (size_t j = 0; j < count; j++, panel += FMM_PANEL) {
    const double x = columns[0][j], y = columns[1][j], z = n > 2 ? columns[2][j] : 0;
    LANES_LOOP(unsigned i = 0; i < FMM_PANEL; i++) {
      const double dx = rows[0][i] - x, dy = rows[1][i] - y, dz = n > 2 ? rows[2][i] - z : 0;
      double d2 = dx * dx + dy * dy;
      if (n > 2) d2 += dz * dz;
      panel[i] = batten_green_radial(power, 0, d2).f0;
    }
  }
}

#define FILL_FUNCTION(n, power)                                                                                 \
  static void fill_##n##_##power(const double rows[3][FMM_PANEL], size_t count, const double *const columns[3], \
                                 double *panel) {                                                               \
    fill(n, power, rows, count, columns, panel);                                                                \
  }
KERNELS(FILL_FUNCTION)

fmm_fill_function *FMM_OF_SET(batten_fmm_fill)(unsigned n, unsigned power) {
  static fmm_fill_function *const functions[4][8] = {
#define FILL_ROW(n, power) [n][power] = fill_##n##_##power,
      KERNELS(FILL_ROW)};
  return n < 4 && power < 8 ? functions[n][power] : NULL;
}
