/* Sums in twice the working precision [Ogita, Rump, Oishi, SIAM J. Sci. Comput. 26 (2005) 1955], for residuals whose
 * own rounding must not limit what is made of them. */
#ifndef BATTEN_QP_TWICE_H
#define BATTEN_QP_TWICE_H

#include <math.h>

typedef struct qp_twice {
  double high, low; /* the value is high + low */
} qp_twice;

static inline double qp_twice_value(qp_twice s) { return s.high + s.low; }

static inline void qp_twice_add(qp_twice *s, double v) {
  double sum = s->high + v, part = sum - s->high;
  s->low += (s->high - (sum - part)) + (v - part);
  s->high = sum;
}

/* s += a b; the product's error by Dekker's splitting, which needs no FMA unit. */
static inline void qp_twice_add_product(qp_twice *s, double a, double b) {
  const double SPLIT = 0x1p27 + 1;
  double p = a * b, ca = SPLIT * a, cb = SPLIT * b;
  double a1 = ca - (ca - a), a2 = a - a1, b1 = cb - (cb - b), b2 = b - b1;
  double error = a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2);
  qp_twice_add(s, p);
  if (isfinite(error)) s->low += error; /* not where numbers are too large to be split */
}

#endif
