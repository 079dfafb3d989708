/* The spans of B-splines in Bezier form: for writers of formats that know of no knots. */
#ifndef BATTEN_EXCHANGE_SPANS_H
#define BATTEN_EXCHANGE_SPANS_H

#include <stddef.h>

enum { BX_SPAN_DEGREE = 9 }; /* highest */

/* The knot index mu of the nonempty span [knots[mu], knots[mu + 1]] behind that of mu; 0 gives the first, count (of
 * the control points) is the end. */
size_t bx_knot_span(unsigned degree, size_t count, const double *knots, size_t mu);
size_t bx_knot_spans(unsigned degree, size_t count, const double *knots);

/* The control points of span mu, line [degree + 1] that lie stride apart, become those of its Bezier form: the
 * blossom, which has the span's lower or upper end as an argument in every step, always by means between two points.
 * The same bits where the knots have only that span. */
void bx_span_to_bezier(unsigned degree, const double *knots, size_t mu, double (*line)[3], size_t stride);

#endif
