/* Monomials and their derivatives (see polynomial.h), from a table of d/dx^d x^e per axis. */
#include "basis/polynomial.h"

#include <assert.h>

enum { DERIVATIVES = 3, POWERS = BATTEN_POLYNOMIAL_DEGREE + 1 };

/* table[axis][d][e]: d-th derivative of x^e. */
typedef double power_table[3][DERIVATIVES][POWERS];

static void fill_table(const batten_polynomial *basis, const double *x, unsigned order, power_table table) {
  for (unsigned axis = 0; axis < 3; axis++) {
    double power[POWERS] = {1, 0, 0, 0}, t = axis < basis->n ? x[axis] : 0;
    for (unsigned e = 1; e <= basis->degree; e++) power[e] = power[e - 1] * t;
    for (unsigned d = 0; d <= order; d++)
      for (unsigned e = 0; e <= basis->degree; e++) {
        double factor = 1;
        for (unsigned k = 0; k < d; k++) factor *= (double)e - k;
        table[axis][d][e] = e < d ? 0 : factor * power[e - d];
      }
  }
}

unsigned batten_polynomial_count(unsigned n, unsigned degree) {
  unsigned count = 1;
  for (unsigned i = 1; i <= n; i++) count = count * (degree + i) / i;
  return count;
}

batten_polynomial batten_polynomial_basis(unsigned n, unsigned degree) {
  assert(n >= 1 && n <= 3 && degree <= BATTEN_POLYNOMIAL_DEGREE);
  batten_polynomial basis = {.n = n, .degree = degree};
  for (unsigned d = 0; d <= degree; d++)
    for (unsigned ex = d + 1; ex-- > 0;) {
      if (n == 1 && ex < d) break;
      for (unsigned ey = d - ex + 1; ey-- > 0;) {
        unsigned ez = d - ex - ey;
        if (n == 2 && ez > 0) break;
        unsigned char *e = basis.exponent[basis.count++];
        e[0] = (unsigned char)ex;
        e[1] = (unsigned char)ey;
        e[2] = (unsigned char)ez;
      }
    }
  return basis;
}

void batten_polynomial_row(const batten_polynomial *basis, const double *x, int axis, double *row) {
  power_table table;
  fill_table(basis, x, 1, table);
  for (unsigned q = 0; q < basis->count; q++) {
    const unsigned char *e = basis->exponent[q];
    row[q] = table[0][axis == 0][e[0]] * table[1][axis == 1][e[1]] * table[2][axis == 2][e[2]];
  }
}

void batten_polynomial_sum(const batten_polynomial *basis, const double *coefficients, const double *x,
                           unsigned order, double sums[10]) {
  static const unsigned char derivative[10][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0},
                                                  {1, 1, 0}, {1, 0, 1}, {0, 2, 0}, {0, 1, 1}, {0, 0, 2}};
  if (order > basis->degree) order = basis->degree; /* the others are 0 */
  const unsigned used = order == 0 ? 1 : order == 1 ? 4 : 10;
  power_table table;
  fill_table(basis, x, order, table);
  for (unsigned s = 0; s < 10; s++) {
    sums[s] = 0;
    if (s >= used) continue;
    const unsigned char *d = derivative[s];
    /* Highest degree first: the small terms join first. */
    for (unsigned q = basis->count; q-- > 0;) {
      const unsigned char *e = basis->exponent[q];
      sums[s] += coefficients[q] * (table[0][d[0]][e[0]] * table[1][d[1]][e[1]] * table[2][d[2]][e[2]]);
    }
  }
}
