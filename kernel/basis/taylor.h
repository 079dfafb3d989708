/* Quadratic models of functions over boxes, with a bound of what they leave out: ranges from them narrow with the
 * square of the box and faster, also of sums in which large terms cancel (a carrier less its spline).
 *
 * x in the box, d = x - middle:  |f(x) - (value + slope . d + d' bend d / 2)| <= rest,  and f(x) is in range,
 *                                |grad f(x) - (slope + bend d)| <= rest_slope,  and |grad f(x)| is in steep,
 * for the exact f as well as for what its evaluation makes of it by rounding. Where no model is known, rest is
 * infinite and the range alone counts; so do rest_slope and steep. */
#ifndef BATTEN_BASIS_TAYLOR_H
#define BATTEN_BASIS_TAYLOR_H

#include <batten/base.h>

#include "basis/interval.h"

typedef struct taylor_box {
  double lower[3], upper[3], middle[3], radius[3]; /* |x - middle| <= radius; 0 for axes >= n */
} taylor_box;

typedef struct taylor {
  double value, slope[3], bend[6]; /* bend: xx, xy, xz, yy, yz, zz */
  double rest, rest_slope;
  interval range, steep;
} taylor;

/* Where the entry of row a and column b stands in bend. */
static const unsigned char TAYLOR_BEND[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

/* Checks boxes [count][2][n] and ranges as every batten_..._bounds does: INVALID names the box. */
batten_status batten_check_boxes(batten_context *ctx, unsigned n, size_t count, const double *boxes,
                                 const double *ranges);
/* box [2][n], finite and in order */
taylor_box batten_taylor_box(unsigned n, const double *box);
/* Bounds of |value| + |slope . d| + |d' bend d / 2| over the box: what roundings of the model are relative to. */
double batten_taylor_size(unsigned n, const taylor_box *box, const taylor *t);
/* All that the model and its range leave open. Ends may be infinite, never NaN. */
interval batten_taylor_range(unsigned n, const taylor_box *box, const taylor *t);
/* Bounds of |grad f| over the box. At least 0, the upper one may be infinite, never NaN. */
interval batten_taylor_steep(unsigned n, const taylor_box *box, const taylor *t);
static inline interval batten_steep_unknown(void) { return (interval){0, INFINITY}; }
/* Of |grad f + grad g| from those of both. */
interval batten_steep_add(interval f, interval g);
/* A function of which only the range and how steep it is are known; -INFINITY, INFINITY or NaN where nothing is. */
taylor batten_taylor_of_range(double lo, double hi, interval steep);
/* sign (f - g) */
taylor batten_taylor_difference(unsigned n, const taylor_box *box, int sign, const taylor *f, const taylor *g);

#endif
