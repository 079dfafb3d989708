/* Powers of the distance and their radial derivatives, with a logarithm where the power is even.
 *
 *   phi(r) = r^p            p odd
 *   phi(r) = r^p ln r       p even
 *
 * With d = x - y the derivatives by x are
 *   d_a phi   = phi1 d_a                                         phi1 = phi' / r
 *   d_ab phi  = phi1 delta_ab + phi2 d_a d_b                     phi2 = phi1' / r
 *   d_abc phi = phi2 (delta_ab d_c + ...) + phi3 d_a d_b d_c     phi3 = phi2' / r
 * and each phi_k is (a ln r + b) r^q, q falling by 2. At r = 0 all of them are set to 0: that is the limit of
 * phi, and of the products above wherever there is one.
 *
 * Everything is written on d2 = r^2 in plain arithmetic without branches, so that loops over it become vector code
 * and every instruction set gives the same bits. */
#ifndef BATTEN_FMM_RADIAL_H
#define BATTEN_FMM_RADIAL_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#if defined(__GNUC__)
#define BATTEN_ALWAYS_INLINE static inline __attribute__((always_inline))
#else
#define BATTEN_ALWAYS_INLINE static inline
#endif

/* ln x for normal x > 0, within 1 ulp; anything for other x.
 * x = 2^k t, t in [sqrt 1/2, sqrt 2); f = t - 1, s = f / (2 + f), so that ln t = 2 atanh s = f - s (f - s^2 P(s^2)),
 * P = (2 atanh s - 2 s) / s^3 by Chebyshev interpolation (error 0.04 ulp of ln t). */
BATTEN_ALWAYS_INLINE double batten_log_normal(double x) {
  const uint64_t sqrt_half = 0x3fe6a09e667f3bcd, one = 0x3ff0000000000000, mantissa = 0x000fffffffffffff;
  const uint64_t two52 = 0x4330000000000000; /* 2^52: an integer below it, or'ed in, becomes its fraction */
  uint64_t bits, k_bits, t_bits;
  double t, k;
  memcpy(&bits, &x, sizeof bits);
  bits += one - sqrt_half;
  k_bits = (bits >> 52) | two52;
  t_bits = (bits & mantissa) + sqrt_half;
  memcpy(&k, &k_bits, sizeof k);
  memcpy(&t, &t_bits, sizeof t);
  k -= 0x1p52 + 1023;
  double f = t - 1, s = f / (2 + f), z = s * s, z2 = z * z;
  /* Two half-length chains in z^2: half the latency. */
  double even =
      0x1.5555555555558p-1 + z2 * (0x1.2492492df281ap-2 + z2 * (0x1.7462b51cb66b1p-3 + z2 * 0x1.2b5900de53b32p-3));
  double odd = 0x1.99999999952d7p-2 + z2 * (0x1.c71c62e3f11e6p-3 + z2 * 0x1.39fe51a7c18f9p-3);
  double tail = s * (f - z * (even + z * odd));
  /* ln 2 in two parts, the first with 21 zero bits at its end: its product with k is exact. */
  return k * 0x1.62e42fee00000p-1 + (f - (tail - k * 0x1.a39ef35793c76p-33));
}

typedef struct batten_radial_terms {
  double f0, f1, f2, f3; /* phi, phi1, phi2, phi3 */
} batten_radial_terms;

/* Up to derivative `order` (0 .. 3; the rest is 0), for d2 >= 0. power and order are compile-time constants where
 * speed counts. Distances below 1e-90 count as 0: their inverse cubes would overflow. */
BATTEN_ALWAYS_INLINE batten_radial_terms batten_green_radial(unsigned power, unsigned order, double d2) {
  batten_radial_terms out = {0, 0, 0, 0};
  if (power % 2) {
    double r = sqrt(d2), inverse = 0;
    /* p - 2 order < 0: some phi_k has a negative power. */
    if (power < 2 * order) inverse = d2 < 1e-180 ? 0 : 1 / r;
    switch (power) {
      case 1:
        out.f0 = r;
        if (order > 0) out.f1 = inverse;
        if (order > 1) out.f2 = -(inverse * inverse * inverse);
        break;
      case 3:
        out.f0 = d2 * r;
        if (order > 0) out.f1 = 3 * r;
        if (order > 1) out.f2 = 3 * inverse;
        if (order > 2) out.f3 = -3 * (inverse * inverse * inverse);
        break;
      case 5:
        out.f0 = d2 * d2 * r;
        if (order > 0) out.f1 = 5 * (d2 * r);
        if (order > 1) out.f2 = 15 * r;
        if (order > 2) out.f3 = 15 * inverse;
        break;
      default:
        out.f0 = d2 * d2 * d2 * r;
        if (order > 0) out.f1 = 7 * (d2 * d2 * r);
        if (order > 1) out.f2 = 35 * (d2 * r);
        if (order > 2) out.f3 = 105 * r;
        break;
    }
    return out;
  }
  bool centre = d2 < 1e-180;
  double safe = centre ? 1 : d2, l = batten_log_normal(safe); /* l = 2 ln r */
  switch (power) {
    case 2:
      out.f0 = 0.5 * d2 * l;
      if (order > 0) out.f1 = centre ? 0 : l + 1;
      if (order > 1) out.f2 = centre ? 0 : 2 / safe;
      break;
    case 4:
      out.f0 = 0.5 * (d2 * d2) * l;
      if (order > 0) out.f1 = d2 * (2 * l + 1);
      if (order > 1) out.f2 = centre ? 0 : 4 * l + 6;
      if (order > 2) out.f3 = centre ? 0 : 8 / safe;
      break;
    default:
      out.f0 = 0.5 * (d2 * d2 * d2) * l;
      if (order > 0) out.f1 = d2 * d2 * (3 * l + 1);
      if (order > 1) out.f2 = d2 * (12 * l + 10);
      if (order > 2) out.f3 = centre ? 0 : 24 * l + 44;
      break;
  }
  return out;
}

#endif
