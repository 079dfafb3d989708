/* See lanes.h. Built once per instruction set, whose name is QP_ISA: the compiler turns loops over the lanes into
 * vector instructions. */
#include "lanes.h"

#include <math.h>

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

/* gcc would first unroll a loop over the lanes, then fail to see the vectors in what is left. */
#if defined(__GNUC__) && !defined(__clang__)
#define LANES_LOOP _Pragma("GCC unroll 1") for
#else
#define LANES_LOOP for
#endif

enum { LANES = QP_LANES };

static double sum_of(const double *s) { return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])); }

static double dot(size_t n, const double *restrict a, const double *restrict x) {
  double s[LANES] = {0};
  size_t i = 0;
  for (; i + LANES <= n; i += LANES) LANES_LOOP(size_t l = 0; l < LANES; l++) s[l] += a[i + l] * x[i + l];
  for (size_t l = 0; i + l < n; l++) s[l] += a[i + l] * x[i + l];
  return sum_of(s);
}

/* Four columns for each time that x is loaded. */
static inline void four_dots(size_t n, const double *const a[4], const double *restrict x, double *restrict out) {
  enum { SIDE = 4 };
  double s[SIDE][LANES] = {{0}};
  size_t i = 0;
  for (; i + LANES <= n; i += LANES)
    for (size_t q = 0; q < SIDE; q++) LANES_LOOP(size_t l = 0; l < LANES; l++) s[q][l] += a[q][i + l] * x[i + l];
  for (; i < n; i++)
    for (size_t q = 0; q < SIDE; q++) s[q][i % LANES] += a[q][i] * x[i];
  for (size_t q = 0; q < SIDE; q++) out[q] = sum_of(s[q]);
}

static void dots(size_t n, size_t count, const double *restrict a, size_t ld, const double *restrict x,
                 double *restrict out) {
  size_t j = 0;
  for (; j + 4 <= count; j += 4, a += 4 * ld)
    four_dots(n, (const double *const[4]){a, a + ld, a + 2 * ld, a + 3 * ld}, x, out + j);
  for (; j < count; j++, a += ld) out[j] = dot(n, a, x);
}

static void dots_at(size_t n, size_t count, const double *const *a, const double *restrict x, double *restrict out) {
  size_t j = 0;
  for (; j + 4 <= count; j += 4) four_dots(n, a + j, x, out + j);
  for (; j < count; j++) out[j] = dot(n, a[j], x);
}

/* Four columns for each time that x is loaded and stored. */
static void combine(size_t n, size_t count, const double *restrict a, size_t ld, double factor,
                    const double *restrict u, double *restrict x) {
  size_t j = 0;
  for (; j + 4 <= count; j += 4, a += 4 * ld) {
    const double *b = a + ld, *c = b + ld, *d = c + ld;
    double p = factor * u[j], q = factor * u[j + 1], r = factor * u[j + 2], s = factor * u[j + 3];
    for (size_t i = 0; i < n; i++) x[i] += (p * a[i] + q * b[i]) + (r * c[i] + s * d[i]);
  }
  for (; j < count; j++, a += ld) {
    double p = factor * u[j];
    for (size_t i = 0; i < n; i++) x[i] += p * a[i];
  }
}

static void subtract(size_t n, size_t count, double *restrict a, size_t ld, const double *restrict w,
                     const double *restrict d) {
  for (size_t j = 0; j < count; j++, a += ld) {
    double p = d[j];
    for (size_t i = 0; i < n; i++) a[i] -= p * w[i];
  }
}

static void rotate(size_t n, double c, double s, double *restrict a, double *restrict b) {
  for (size_t i = 0; i < n; i++) {
    double x = a[i], y = b[i];
    a[i] = c * x + s * y;
    b[i] = c * y - s * x;
  }
}

static void slacks(size_t count, const double *restrict lower, const double *restrict upper,
                   double *restrict products) {
  for (size_t k = 0; k < count; k++) {
    double above = products[k] - lower[k], below = upper[k] - products[k], least = above < below ? above : below;
    products[k] = lower[k] < upper[k] ? least : INFINITY;
  }
}

static void squares(size_t n, const double *restrict a, const double *restrict x, double *square, double *along) {
  double s[LANES] = {0}, t[LANES] = {0};
  size_t i = 0;
  for (; i + LANES <= n; i += LANES) LANES_LOOP(size_t l = 0; l < LANES; l++) {
      s[l] += a[i + l] * a[i + l];
      t[l] += a[i + l] * x[i + l];
    }
  for (size_t l = 0; i + l < n; l++) {
    s[l] += a[i + l] * a[i + l];
    t[l] += a[i + l] * x[i + l];
  }
  *square = sum_of(s), *along = sum_of(t);
}

extern const qp_lanes JOIN(qp_lanes_, QP_ISA);
const qp_lanes JOIN(qp_lanes_, QP_ISA) = {dots, dots_at, combine, subtract, rotate, slacks, squares};
