/* B-splines in one variable.   [de Boor; Ramshaw: Blossoming]
 *
 * A space of degree d has `count` functions on the knots u_0 <= ... <= u_(count + d), the first and the last d + 1 of
 * which are equal. A span mu is a nonempty interval [u_mu, u_(mu + 1)]; on it the functions mu - d .. mu live, and
 * all that is said of a span is said of these d + 1 functions, in this order. */
#ifndef BATTEN_BASIS_BSPLINE_H
#define BATTEN_BASIS_BSPLINE_H

#include <stddef.h>

enum { BSPLINE_DEGREE = 9, BSPLINE_ORDER = 10 }; /* highest degree, and the coefficients that it has */

typedef struct bspline {
  unsigned degree;
  size_t count;        /* functions, > degree */
  const double *knots; /* [count + degree + 1] */
} bspline;

static inline double bspline_lower(const bspline *b) { return b->knots[0]; }
static inline double bspline_upper(const bspline *b) { return b->knots[b->count]; }

/* Knots of equal or given spans: the ends degree + 1 fold, the inner breaks [spans - 1] (NULL: equal spans) degree -
 * smoothness fold. Returns the number of knots; knots may be NULL. The number of functions is that less degree + 1.
 */
size_t bspline_make_knots(unsigned degree, unsigned smoothness, size_t spans, const double *breaks, double lower,
                          double upper, double *knots);

/* The span with u_mu <= t < u_(mu + 1); the last one at and beyond the end, the first one before the beginning. */
size_t bspline_span(const bspline *b, double t);
/* The first span, and the one after mu; count when there is none. */
size_t bspline_first(const bspline *b);
size_t bspline_next(const bspline *b, size_t mu);
size_t bspline_span_count(const bspline *b);

/* Values and derivatives up to an order of the functions of a span at t: table [order + 1][degree + 1]. */
void bspline_basis(const bspline *b, size_t mu, double t, unsigned order, double *table);

/* The k-th derivative (k <= degree) on [lower, upper], a part of the span, in Bernstein form of degree d - k: rows
 * [d - k + 1][d + 1] are its coefficients as combinations of the control points. By the blossom of the derivative's
 * own control points, so that small parts cost no digits; for k = 0 rows are not negative and have sum 1. Derivatives
 * are those by t, whatever the length of the part. */
void bspline_rows(const bspline *b, size_t mu, unsigned k, double lower, double upper, double *rows);

/* Greville abscissas [count]: the control points of the function t. */
void bspline_greville(const bspline *b, double *out);

#endif
