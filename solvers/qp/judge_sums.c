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

static double plain(size_t n, const double *restrict a, const uint32_t *restrict columns, const double *restrict x,
                    double *size) {
  double s[LANES] = {0}, t[LANES] = {0};
  size_t i = 0;
  for (; !columns && i + LANES <= n; i += LANES) LANES_LOOP(size_t l = 0; l < LANES; l++) {
      double product = a[i + l] * x[i + l];
      s[l] += product;
      t[l] += fabs(product);
    }
  for (; i < n; i++) {
    double product = a[i] * x[columns ? columns[i] : i];
    s[i % LANES] += product;
    t[i % LANES] += fabs(product);
  }
  *size = sum_of(t);
  return sum_of(s);
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

static void twice(size_t n, const double *restrict a, const uint32_t *restrict columns, const double *restrict x,
                  double *hi, double *lo) {
  double s[LANES] = {0}, t[LANES] = {0};
  size_t i = 0;
  for (; !columns && i + LANES <= n; i += LANES)
    LANES_LOOP(size_t l = 0; l < LANES; l++) plus_product(&s[l], &t[l], a[i + l], x[i + l]);
  for (; i < n; i++) plus_product(&s[i % LANES], &t[i % LANES], a[i], x[columns ? columns[i] : i]);
  double high = s[0], low = sum_of(t);
  for (size_t l = 1; l < LANES; l++) plus(&high, &low, s[l]);
  *hi = high + low;
  *lo = (high - *hi) + low;
}

static void add(size_t n, const double *restrict a, const uint32_t *restrict columns, double factor_hi,
                double factor_lo, double *restrict hi, double *restrict lo) {
  for (size_t i = 0; !columns && i < n; i++) {
    plus_product(&hi[i], &lo[i], a[i], factor_hi);
    lo[i] += a[i] * factor_lo;
  }
  for (size_t i = 0; columns && i < n; i++) {
    plus_product(&hi[columns[i]], &lo[columns[i]], a[i], factor_hi);
    lo[columns[i]] += a[i] * factor_lo;
  }
}

extern const qp_judge_sums JOIN(qp_judge_sums_, QP_ISA);
const qp_judge_sums JOIN(qp_judge_sums_, QP_ISA) = {plain, twice, add};
