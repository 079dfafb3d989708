/* The same curve in a larger spline space: knot insertion and degree elevation in one, by blossoms. */
#ifndef BATTEN_BASIS_REFINE_H
#define BATTEN_BASIS_REFINE_H

#include "bspline.h"

/* The combination (1 - part) a + part b, part in [0, 1]: a and b themselves at its ends, and where a = b. */
static inline double bspline_blend(double a, double b, double part) {
  return part <= 0.5 ? a + part * (b - a) : b - (1 - part) * (b - a);
}

/* points [from->count][dim] (dim 1 .. 3) -> out [to->count][dim]. `to` has the same domain, a degree >= that of from,
 * and every knot of from at least as often plus the difference of degrees. Time O(to->count), times the number of
 * subsets for elevation. All combinations are convex; control points that stay are copied to the bit. */
void bspline_refine(const bspline *from, unsigned dim, const double *points, const bspline *to, double *out);

/* The same for one degree as rows: control point j of `to` is the sum of rows[j][k] times control point first[j] + k
 * of from, k = 0 .. degree; rows [to->count][degree + 1] are not negative and have sum 1, points that stay have one
 * entry 1, and what is 0 at the end of a row may stand for points that are not there. `to` may also be a part of
 * from: its knots within from's, which need not be clamped, every one of from between its ends as often at least. */
void bspline_insertion(const bspline *from, const bspline *to, size_t *first, double *rows);

/* The polygon's value of the blossom of span mu at arguments [degree]: out [dim]. */
void bspline_blossom(const bspline *b, unsigned dim, const double *points, size_t mu, const double *arguments,
                     double *out);

#endif
