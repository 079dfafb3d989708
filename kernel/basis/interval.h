/* Intervals that hold the exact result and what ordinary rounding makes of it, for bounds of fields over boxes. Every
 * operation widens its result by more than its own rounding error, so no rounding mode is touched. Ends may be
 * infinite, never NaN. */
#ifndef BATTEN_BASIS_INTERVAL_H
#define BATTEN_BASIS_INTERVAL_H

#include <math.h>
#include <stdbool.h>

typedef struct interval {
  double lo, hi;
} interval;

/* ulps: how wrong lo and hi may be, in units of 2^-53 relative; 1 for + - * / sqrt. */
static inline interval interval_widen(double lo, double hi, double ulps) {
  const double unit = 0x1p-52 * ulps, tiny = 0x1p-1070;
  interval r = {lo - (fabs(lo) * unit + tiny), hi + (fabs(hi) * unit + tiny)};
  if (!(r.lo <= INFINITY)) r.lo = -INFINITY; /* inf - inf */
  if (!(r.hi >= -INFINITY)) r.hi = INFINITY;
  return r;
}
static inline interval interval_of(double x) { return (interval){x, x}; }
static inline interval interval_all(void) { return (interval){-INFINITY, INFINITY}; }
static inline interval interval_add(interval a, interval b) { return interval_widen(a.lo + b.lo, a.hi + b.hi, 1); }
static inline interval interval_sub(interval a, interval b) { return interval_widen(a.lo - b.hi, a.hi - b.lo, 1); }
static inline interval interval_neg(interval a) { return (interval){-a.hi, -a.lo}; }
/* 0 times infinity is 0: the ends are limits. */
static inline double interval_product(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }
static inline interval interval_mul(interval a, interval b) {
  double p = interval_product(a.lo, b.lo), q = interval_product(a.lo, b.hi);
  double r = interval_product(a.hi, b.lo), s = interval_product(a.hi, b.hi);
  return interval_widen(fmin(fmin(p, q), fmin(r, s)), fmax(fmax(p, q), fmax(r, s)), 1);
}
static inline interval interval_scale(interval a, double s) { return interval_mul(a, interval_of(s)); }
/* Everything when b holds 0. */
static inline interval interval_div(interval a, interval b) {
  if (b.lo <= 0 && b.hi >= 0) return interval_all();
  interval inverse = interval_widen(1 / b.hi, 1 / b.lo, 1);
  return interval_mul(a, inverse);
}
static inline interval interval_square(interval a) {
  double p = a.lo * a.lo, q = a.hi * a.hi, least = a.lo <= 0 && a.hi >= 0 ? 0 : fmin(p, q);
  interval r = interval_widen(least, fmax(p, q), 1);
  if (r.lo < 0) r.lo = 0;
  return r;
}
/* Of what is not negative in a; 0 if nothing. */
static inline interval interval_sqrt(interval a) {
  interval r = interval_widen(sqrt(fmax(a.lo, 0)), sqrt(fmax(a.hi, 0)), 1);
  if (r.lo < 0) r.lo = 0;
  return r;
}
static inline interval interval_abs(interval a) {
  if (a.lo >= 0) return a;
  if (a.hi <= 0) return interval_neg(a);
  return (interval){0, fmax(-a.lo, a.hi)};
}
static inline interval interval_min(interval a, interval b) { return (interval){fmin(a.lo, b.lo), fmin(a.hi, b.hi)}; }
static inline interval interval_max(interval a, interval b) { return (interval){fmax(a.lo, b.lo), fmax(a.hi, b.hi)}; }
static inline interval interval_hull(interval a, interval b) {
  return (interval){fmin(a.lo, b.lo), fmax(a.hi, b.hi)};
}
/* The part that both have, where both are known to hold the same thing. */
static inline interval interval_meet(interval a, interval b) {
  interval r = {fmax(a.lo, b.lo), fmin(a.hi, b.hi)};
  return r.lo <= r.hi ? r : a;
}
static inline interval interval_hypot(interval a, interval b) {
  return interval_sqrt(interval_add(interval_square(a), interval_square(b)));
}
/* libm's functions are right to a few units in the last place: 8 is ample. */
static inline interval interval_tanh(interval a) { return interval_widen(tanh(a.lo), tanh(a.hi), 8); }
static inline interval interval_cos(interval a) {
  const double two_pi = 6.28318530717958647692;
  if (!(a.hi - a.lo < two_pi) || fabs(a.lo) > 0x1p40 || fabs(a.hi) > 0x1p40) return (interval){-1, 1};
  /* a little wider than a turn's rounding: an extremum that may lie within is taken to do so */
  double slack = 1e-15 * (1 + fabs(a.lo) + fabs(a.hi));
  double p = cos(a.lo), q = cos(a.hi);
  interval r = interval_widen(fmin(p, q), fmax(p, q), 8);
  r.lo -= slack;
  r.hi += slack;
  if (floor((a.hi + slack) / two_pi) * two_pi >= a.lo - slack) r.hi = 1;
  if (floor((a.hi + slack) / two_pi - 0.5) * two_pi + two_pi / 2 >= a.lo - slack) r.lo = -1;
  return (interval){fmax(r.lo, -1), fmin(r.hi, 1)};
}
static inline interval interval_sin(interval a) {
  return interval_cos(interval_sub(a, interval_of(1.57079632679489661923)));
}

#endif
