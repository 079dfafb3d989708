/* How a span bends: x' and [x', x''] in Bernstein form, with bounds of all rounding errors.
 *
 * With a_0 .. a_m the Bernstein coefficients of x' (m = degree - 1) and b_0 .. b_(m-1) those of x'' the product
 * [x', x''] has degree 2 m - 2, one less than its factors tell: with u = 1 - s, v = s and p = sum_(i<m) a_i B_i,
 * q = sum_(i<m) a_(i+1) B_i, Euler's theorem on homogeneous functions gives x' = u p + v q, x'' = m (q - p), hence
 * [x', x''] = m [p, q] = [p, x''], p made of the coefficients of x' without the last one.
 *
 * Parameters are parts s of the span, points are times 2^exponent of the curve, and both derivatives are then times
 * powers of two of their own, so that spans and units of any size are alike. */
#ifndef BATTEN_CURVE_BEND_H
#define BATTEN_CURVE_BEND_H

#include "basis/rounding.h"
#include "curve_inner.h"

enum { BEND_TANGENTS = BATTEN_CURVE_DEGREE_MAX, BEND_PRODUCTS = 2 * BATTEN_CURVE_DEGREE_MAX - 3 };

typedef struct bend {
  unsigned m, n; /* degrees of a and of g */
  double a[BEND_TANGENTS][2], g[BEND_PRODUCTS];
  double a_error[BEND_TANGENTS]; /* of both coordinates */
  double g_error[BEND_PRODUCTS];
  int exponent; /* curvature = 2^exponent g / |a|^3, of the curve times 2^curve->exponent */
} bend;

/* data_error: what the control points' coordinates themselves are taken to be off by; changes nothing but the errors.
 * Degree 1: g is 0, n = 0. */
void bend_make(const batten_curve *curve, size_t mu, double data_error, bend *out);
/* What rounding of coordinates as large as the curve's may have moved control points by, times 2^curve->exponent. */
double bend_data_error(const batten_curve *curve);

/* The parts over [0, s], which the whole becomes, and [s, 1], 0 < s < 1, each by parameters from 0 to 1. Both are
 * multiplied as the whole is, so that curvature is as before. */
void bend_split(bend *whole, double s, bend *right);
/* By 1 - s; the sign of g stays. */
void bend_reverse(bend *b);
void bend_negate(bend *b);

/* [a, b] = a_1 b_2 - a_2 b_1 of vectors with errors: its sign, 0 where that is not certain. */
int bend_turn(const double a[2], double a_error, const double b[2], double b_error);

#endif
