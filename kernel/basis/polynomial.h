/* Monomials of low degree in 1 to 3 variables and their derivatives: the polynomial part of volume splines.
 *
 * Order: by degree, within a degree lexicographic: 1, x, y, z, x^2, xy, xz, y^2, yz, z^2, x^3, ... */
#ifndef BATTEN_BASIS_POLYNOMIAL_H
#define BATTEN_BASIS_POLYNOMIAL_H

#include <stddef.h>

enum {
  BATTEN_POLYNOMIAL_DEGREE = 3, /* highest */
  BATTEN_POLYNOMIAL_MAX = 20    /* monomials of degree <= 3 in 3 variables */
};

typedef struct batten_polynomial {
  unsigned n, degree, count;
  unsigned char exponent[BATTEN_POLYNOMIAL_MAX][3];
} batten_polynomial;

/* C(n + degree, n), 1 <= n <= 3, degree <= 3. */
unsigned batten_polynomial_count(unsigned n, unsigned degree);
batten_polynomial batten_polynomial_basis(unsigned n, unsigned degree);

/* row[q] = monomial q at x [n] (axis < 0) or its derivative along the axis. */
void batten_polynomial_row(const batten_polynomial *basis, const double *x, int axis, double *row);

/* The sum of coefficients[q] times monomial q at x [n], and its derivatives up to `order` (0, 1, 2), in the order
 * U, U_x, U_y, U_z, U_xx, U_xy, U_xz, U_yy, U_yz, U_zz; axes >= n give 0, derivatives above `order` too. */
void batten_polynomial_sum(const batten_polynomial *basis, const double *coefficients, const double *x,
                           unsigned order, double sums[10]);

#endif
