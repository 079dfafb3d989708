/* Green's functions of the iterated Laplacian and their radial derivatives.   [Duchon 1977; Wendland 2005, section 8]
 *
 *   phi(r) = s r^p          p = 2m - n odd        s = +-1 makes phi conditionally positive definite of order <= m:
 *   phi(r) = s r^p ln r     p even                -r, +r^3, -r^5, +r^7, +r^2 ln r, -r^4 ln r, +r^6 ln r
 *
 * Their derivatives are those of r^p and r^p ln r in fmm/radial.h, times s. */
#ifndef BATTEN_BASIS_GREEN_H
#define BATTEN_BASIS_GREEN_H

#include "fmm/radial.h"

#include <stdbool.h>

/* Orders that exist here: n in 1 .. 3, m <= 4, 2m > n. */
static inline bool batten_green_exists(unsigned n, unsigned m) { return n >= 1 && n <= 3 && m <= 4 && 2 * m > n; }

/* The kernel's power p = 2m - n, 1 .. 7; even powers carry the logarithm. */
static inline unsigned batten_green_power(unsigned n, unsigned m) { return 2 * m - n; }

/* s above. */
static inline double batten_green_sign(unsigned power) {
  return power % 2 ? ((power / 2) % 2 ? 1 : -1) : ((power / 2) % 2 ? 1 : -1);
}

#endif
