/* Checked size arithmetic and argument checks shared by all modules. */
#ifndef BATTEN_BASE_CHECKED_H
#define BATTEN_BASE_CHECKED_H

#include <batten/base.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* *out = a * b (or a + b), false on overflow: *out is then SIZE_MAX, so that a size too large stays too large. */
static inline bool batten_mul(size_t a, size_t b, size_t *out) {
  bool fits = b == 0 || a <= SIZE_MAX / b;
  *out = fits ? a * b : SIZE_MAX;
  return fits;
}
static inline bool batten_add(size_t a, size_t b, size_t *out) {
  bool fits = a <= SIZE_MAX - b;
  *out = fits ? a + b : SIZE_MAX;
  return fits;
}
static inline bool batten_mul3(size_t a, size_t b, size_t c, size_t *out) {
  bool first = batten_mul(a, b, out);
  return batten_mul(*out, c, out) && first;
}

/* Index of the first value that is not finite, or count. */
static inline size_t batten_first_nonfinite(size_t count, const double *values) {
  size_t i = 0;
  while (i < count && isfinite(values[i])) i++;
  return i;
}

/* Number q of `samples` out of `count`, evenly drawn; samples <= count. */
static inline size_t batten_drawn(size_t q, size_t samples, size_t count) {
  return q * (count / samples) + q * (count % samples) / samples;
}

/* The power of two that brings |x| to [1, 2): multiplying by it is exact. x > 0 and finite; a subnormal x comes as
 * near to 1 as a double can bring it. */
static inline double batten_unit(double x) {
  int exponent = ilogb(x);
  return ldexp(1, -(exponent > -1022 ? exponent : -1022));
}

/* Refuses an options struct whose struct_size is not the library's: BATTEN_OK or BATTEN_E_INVALID. */
static inline batten_status batten_check_struct(batten_context *ctx, const char *name, size_t given,
                                                size_t expected) {
  if (given == expected) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s.struct_size: %zu, expected %zu; start from %s_default()", name, given,
                     expected, name);
}

/* What a status means that the caller of a trial expected: that status is BATTEN_OK, and its text, which tells of
 * nothing that the user would meet, is taken back. Other statuses stay. */
static inline batten_status batten_expect(batten_context *ctx, batten_status status, batten_status expected) {
  return status == expected ? batten_fail(ctx, BATTEN_OK, "%s", "") : status;
}

#endif
