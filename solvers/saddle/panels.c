/* Loops over panels, for one instruction set (see panels.h), whose name is SADDLE_ISA. Vectors are those of the
 * compiler: it makes one of them of 512 bits, two of 256, or four of 128. */
#include "panels.h"

#include <math.h>
#include <string.h>

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

/* Vectors of the processor in 64 bytes, and columns of a block that are summed up at a time: as many as there are
 * registers for. */
#if defined(__AVX512F__)
#define PARTS 1
enum { COLUMNS_FLOAT = 16, COLUMNS_DOUBLE = 8 };
#elif defined(__AVX2__)
#define PARTS 2
enum { COLUMNS_FLOAT = 4, COLUMNS_DOUBLE = 4 };
#else
#define PARTS 4
enum { COLUMNS_FLOAT = 2, COLUMNS_DOUBLE = 2 };
#endif

#define REAL float
#define WIDTH 16
#define COLUMNS COLUMNS_FLOAT
#define NAME(name) JOIN(name, _float)
#include "panels_body.h"
#undef REAL
#undef WIDTH
#undef COLUMNS
#undef NAME

#define REAL double
#define WIDTH 8
#define COLUMNS COLUMNS_DOUBLE
#define NAME(name) JOIN(name, _double)
#include "panels_body.h"

enum { LANES = 8 }; /* partial sums of a dot product */

/* gcc would first unroll a loop over the lanes, then fail to see the vectors in what is left. */
#if defined(__GNUC__) && !defined(__clang__)
#define LANES_LOOP _Pragma("GCC unroll 1") for
#else
#define LANES_LOOP for
#endif

/* y += a x, and returns a'z. */
static double both(size_t n, const double *restrict a, double x, const double *restrict z, double *restrict y) {
  double s[LANES] = {0};
  size_t i = 0;
  for (; i + LANES <= n; i += LANES) LANES_LOOP(size_t l = 0; l < LANES; l++) {
      y[i + l] += a[i + l] * x;
      s[l] += a[i + l] * z[i + l];
    }
  for (size_t l = 0; i + l < n; l++) {
    y[i + l] += a[i + l] * x;
    s[l] += a[i + l] * z[i + l];
  }
  return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

static void multiply(size_t m, size_t ld, const double *a, size_t r, const double *v, double *y) {
  memset(y, 0, r * ld * sizeof *y);
  for (size_t j = 0; j < m; j++) {
    const double *below = a + j * ld + j + 1;
    for (size_t c = 0; c < r; c++) {
      const double *vc = v + c * ld;
      double *yc = y + c * ld;
      double dot = both(m - j - 1, below, vc[j], vc + j + 1, yc + j + 1);
      yc[j] += a[j * ld + j] * vc[j] + dot;
    }
  }
}

static void update(size_t m, size_t ld, double *a, size_t r, const double *v, const double *x) {
  for (size_t j = r; j < m; j++) {
    double *restrict column = a + j * ld;
    for (size_t c = 0; c < r; c++) {
      const double *restrict vc = v + c * ld, *restrict xc = x + c * ld;
      double of_v = vc[j], of_x = xc[j];
      for (size_t i = j; i < m; i++) column[i] -= vc[i] * of_x + xc[i] * of_v;
    }
  }
}

extern const saddle_code JOIN(batten_saddle_code_, SADDLE_ISA);
const saddle_code JOIN(batten_saddle_code_, SADDLE_ISA) = {
    .in_float = {factor_float, solve_float},
    .in_double = {factor_double, solve_double},
    .multiply = multiply,
    .update = update,
};
