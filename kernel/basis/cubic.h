/* Cubic splines with two continuous derivatives through values at given places. */
#ifndef BATTEN_BASIS_CUBIC_H
#define BATTEN_BASIS_CUBIC_H

#include <stddef.h>

/* Slopes at the places t [count] of the spline through values [count][dims] whose third derivative is continuous at
 * the second place and the last but one (not-a-knot): it gives cubics back. count 3: the parabola; 2: the line; 1:
 * zero. t increases strictly. slopes [count][dims], work [count]. */
void cubic_slopes(size_t count, size_t dims, const double *t, const double *values, double *slopes, double *work);

/* Value and slope (may be NULL) at `at`, in [t[0], t[count - 1]] and held outside, of the cubics with these slopes:
 * [dims] each. count >= 2. */
void cubic_value(size_t count, size_t dims, const double *t, const double *values, const double *slopes, double at,
                 double *value, double *slope);

/* The largest i < count - 1 with t[i] <= at, or 0: the interval of `at`. count >= 2. */
size_t cubic_interval(size_t count, const double *t, double at);

#endif
