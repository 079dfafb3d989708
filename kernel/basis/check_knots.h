/* Are these the knots of a spline that a caller may give? */
#ifndef BATTEN_BASIS_CHECK_KNOTS_H
#define BATTEN_BASIS_CHECK_KNOTS_H

#include <batten/base.h>

/* Degree 1 .. degree_max; finite knots [count] that do not decrease, the first and the last degree + 1 equal, inner
 * ones there degree times at most, the domain's length a double greater than 0. Error texts speak of "degree",
 * "knot_count" and "knots", each followed by `which` ("" or "[1]"). Fails: INVALID. */
batten_status bspline_check_knots(batten_context *ctx, const char *which, unsigned degree, unsigned degree_max,
                                  size_t count, const double *knots);

#endif
