/* See judge_sums.h. Built once per instruction set, whose name is QP_ISA. */
#include "judge_sums.h"

#include <math.h>

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

/* gcc would first unroll a loop over the lanes, then fail to see the vectors in what is left. */
#if defined(__GNUC__) && !defined(__clang__)
#define LANES_LOOP _Pragma("GCC unroll 1") for
#else
#define LANES_LOOP for
#endif

enum { LANES = 8 };

static double sum_of(const double *s) { return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7])); }

/* x at the next LANES entries: where it is, or gathered. */
static inline const double *take(const double *x, const uint32_t *columns, size_t i, double *gathered) {
  if (!columns) return x + i;
  for (size_t l = 0; l < LANES; l++) gathered[l] = x[columns[i + l]];
  return gathered;
}

static inline double plain_of(size_t n, const double *restrict a, const uint32_t *restrict columns,
                              const double *restrict x, double *size) {
  double s[LANES] = {0}, t[LANES] = {0}, gathered[LANES];
  size_t i = 0;
  for (; i + LANES <= n; i += LANES) {
    const double *v = take(x, columns, i, gathered);
    LANES_LOOP(size_t l = 0; l < LANES; l++) {
      double product = a[i + l] * v[l];
      s[l] += product;
      t[l] += fabs(product);
    }
  }
  for (size_t l = 0; i + l < n; l++) {
    double product = a[i + l] * x[columns ? columns[i + l] : i + l];
    s[l] += product;
    t[l] += fabs(product);
  }
  *size = sum_of(t);
  return sum_of(s);
}

/* Twice, so that the loop over dense rows is one of its own. */
static double plain(size_t n, const double *a, const uint32_t *columns, const double *x, double *size) {
  return columns ? plain_of(n, a, columns, x, size) : plain_of(n, a, NULL, x, size);
}

/* hi + lo += v, Knuth's TwoSum. */
static inline void plus(double *hi, double *lo, double v) {
  double sum = *hi + v, part = sum - *hi;
  *lo += (*hi - (sum - part)) + (v - part);
  *hi = sum;
}

static inline void plus_product(double *hi, double *lo, double a, double b) {
  double product = a * b;
  plus(hi, lo, product);
  *lo += fma(a, b, -product);
}

static inline void twice_of(size_t n, const double *restrict a, const uint32_t *restrict columns,
                            const double *restrict x, double *hi, double *lo) {
  double s[LANES] = {0}, t[LANES] = {0}, gathered[LANES];
  size_t i = 0;
  for (; i + LANES <= n; i += LANES) {
    const double *v = take(x, columns, i, gathered);
    LANES_LOOP(size_t l = 0; l < LANES; l++) plus_product(&s[l], &t[l], a[i + l], v[l]);
  }
  for (size_t l = 0; i + l < n; l++) plus_product(&s[l], &t[l], a[i + l], x[columns ? columns[i + l] : i + l]);
  double high = s[0], low = sum_of(t);
  for (size_t l = 1; l < LANES; l++) plus(&high, &low, s[l]);
  *hi = high + low;
  *lo = (high - *hi) + low;
}

static void twice(size_t n, const double *a, const uint32_t *columns, const double *x, double *hi, double *lo) {
  if (columns)
    twice_of(n, a, columns, x, hi, lo);
  else
    twice_of(n, a, NULL, x, hi, lo);
}

static inline void add_entry(double a, double factor_hi, double factor_lo, double *hi, double *lo) {
  plus_product(hi, lo, a, factor_hi);
  *lo += a * factor_lo;
}

/* Columns are met once in a row. */
static void add(size_t n, const double *restrict a, const uint32_t *restrict columns, double factor_hi,
                double factor_lo, double *restrict hi, double *restrict lo) {
  size_t i = 0;
  for (; !columns && i < n; i++) add_entry(a[i], factor_hi, factor_lo, &hi[i], &lo[i]);
  for (; i + LANES <= n; i += LANES) {
    double h[LANES], o[LANES];
    take(hi, columns, i, h);
    take(lo, columns, i, o);
    LANES_LOOP(size_t l = 0; l < LANES; l++) add_entry(a[i + l], factor_hi, factor_lo, &h[l], &o[l]);
    for (size_t l = 0; l < LANES; l++) {
      hi[columns[i + l]] = h[l];
      lo[columns[i + l]] = o[l];
    }
  }
  for (; i < n; i++) add_entry(a[i], factor_hi, factor_lo, &hi[columns[i]], &lo[columns[i]]);
}

extern const qp_judge_sums JOIN(qp_judge_sums_, QP_ISA);
const qp_judge_sums JOIN(qp_judge_sums_, QP_ISA) = {plain, twice, add};
