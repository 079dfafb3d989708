/* The smoothing spline of data, for propose.c and bends.c.
 *
 * The least sum of weight |x(t) - point|^2 + lambda * integral of |x'''|^2 among splines of degree 5 on equal spans,
 * lambda by restricted maximum likelihood: the curve is then the mean, and noise^2 (gram + lambda penalty)^-1 the
 * covariance, of what the data tell.   [Wahba; Eilers, Marx: Flexible smoothing with B-splines and penalties] */
#ifndef BATTEN_CONTOUR_SMOOTH_H
#define BATTEN_CONTOUR_SMOOTH_H

#include "contour_inner.h"

enum { SMOOTH_DEGREE = 5, SMOOTH_ORDER = 6 };

/* Of the points' size: data are not taken for more exact than this, since all else would be wiggles of rounding. */
static const double CONTOUR_EXACT = 1e-5;

typedef struct contour_smooth {
  bool closed;
  size_t spans; /* of length 1 / spans; on span s functions s .. s + 5 live, of closed curves modulo `functions` */
  size_t functions;         /* spans + 5, closed: spans */
  size_t width;             /* of the bands below: lower triangles by columns, in the order of contour_smooth_row */
  double *gram;             /* [functions][width + 1] sums of weight N_i N_j */
  double *penalty;          /* integrals of N_i''' N_j''' */
  double *factor;           /* Cholesky factor of gram + lambda penalty */
  double *inverse;          /* its inverse, within the band */
  double *right;            /* [2][functions] sums of weight N_i point */
  double *control;          /* [2][functions] */
  double square;            /* sum of weight |point|^2 */
  double size;              /* larger side of the box of the points */
  double count;             /* points of positive weight; their weights have the mean 1 */
  double lambda, bandwidth; /* lambda = count * bandwidth^6: about how far the curve averages */
  double noise;             /* standard deviation of a coordinate of weight 1 */
  double fitted;            /* that which the fit alone tells, and neighbours do not raise */
} contour_smooth;

/* parameters [count] in [0, 1] in any order. Fails: NOMEM, TOO_LARGE, CANCELLED (progress phase "inflections"). */
batten_status contour_smooth_fit(batten_context *ctx, const contour_data *data, const double *parameters, bool closed,
                                 contour_smooth *out);
void contour_smooth_free(batten_context *ctx, contour_smooth *s);

/* The row of a function: that of closed curves is folded, 0, n - 1, 1, n - 2, .., so that a band remains. */
static inline size_t contour_smooth_row(const contour_smooth *s, size_t function) {
  if (!s->closed) return function;
  size_t j = function % s->functions;
  return 2 * j < s->functions ? 2 * j : 2 * (s->functions - 1 - j) + 1;
}
/* The span of t in [0, 1], and where in it t is, in [0, 1]. */
static inline size_t contour_smooth_span(const contour_smooth *s, double t, double *u) {
  double at = t * (double)s->spans;
  size_t span = at > 0 ? (size_t)at : 0;
  if (span >= s->spans) span = s->spans - 1;
  *u = at - (double)span;
  return span;
}
/* The order-th derivative, by t, of the functions of a span at u: values [6]. */
void contour_smooth_basis(const contour_smooth *s, double u, unsigned order, double values[SMOOTH_ORDER]);
/* x, x', x'' of a control [2][functions] at t. */
void contour_smooth_jet(const contour_smooth *s, const double *control, double t, double jet[3][2]);
/* The variance of the second derivative of a coordinate at t, noise 1. */
double contour_smooth_variance(const contour_smooth *s, double t);
/* The sum with a lambda; squares NULL, or the sum of squares alone. */
double contour_smooth_cost(const contour_smooth *s, double lambda, const double *control, double *squares);

#endif
