/* B-splines in one variable, by blossoms.
 *
 * The blossom of a span is symmetric, multi-affine and agrees with the polynomial on the diagonal. Its value at
 * arguments a_1 .. a_d is d rounds of the triangle of de Boor, one argument each; the coefficients of the Bernstein
 * form on [a, b] are its values at a (d - i times) and b (i times). All combinations are convex as long as the
 * arguments lie in the span. */
#include "bspline.h"

#include <assert.h>

size_t bspline_make_knots(unsigned degree, unsigned smoothness, size_t spans, const double *breaks, double lower,
                          double upper, double *knots) {
  size_t at = 0;
  for (size_t s = 0; s <= spans; s++) {
    unsigned fold = s == 0 || s == spans ? degree + 1 : degree - smoothness;
    double part = (double)s / (double)spans;
    double knot = s == 0 ? lower : s == spans ? upper : breaks ? breaks[s - 1] : (1 - part) * lower + part * upper;
    for (unsigned k = 0; k < fold; k++, at++)
      if (knots) knots[at] = knot;
  }
  return at;
}

size_t bspline_first(const bspline *b) { return b->degree; }

size_t bspline_next(const bspline *b, size_t mu) {
  do mu++;
  while (mu < b->count && !(b->knots[mu] < b->knots[mu + 1]));
  return mu;
}

size_t bspline_span_count(const bspline *b) {
  size_t spans = 0;
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) spans++;
  return spans;
}

size_t bspline_span(const bspline *b, double t) {
  size_t low = b->degree, high = b->count; /* u_low <= t < u_high, as far as t is inside */
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (t < b->knots[middle])
      high = middle;
    else
      low = middle;
  }
  while (!(b->knots[low] < b->knots[low + 1])) low--; /* at the end: back to the last nonempty one */
  return low;
}

/* rows [d + 1][d + 1], row j the control point mu - d + j of the space of degree d; becomes, in [d - k + 1][d + 1],
 * those of the k-th derivative. */
static void differentiate(const bspline *b, size_t mu, unsigned k, double (*rows)[BSPLINE_ORDER]) {
  unsigned d = b->degree;
  for (unsigned i = 0; i <= d; i++)
    for (unsigned j = 0; j <= d; j++) rows[i][j] = i == j;
  for (unsigned level = 0; level < k; level++) {
    unsigned degree = d - level; /* of what is differentiated: points 0 .. degree */
    for (unsigned i = 0; i < degree; i++) {
      /* These knots enclose the span, so that they differ. */
      double width = b->knots[mu + i + 1] - b->knots[mu - degree + i + 1];
      for (unsigned j = 0; j <= d; j++) rows[i][j] = degree / width * (rows[i + 1][j] - rows[i][j]);
    }
  }
}

/* One round of the triangle: `points` rows of a spline of this degree over the span become one less, at argument t.
 */
static void blossom_round(const bspline *b, size_t mu, unsigned degree, unsigned round, double t,
                          double (*rows)[BSPLINE_ORDER]) {
  for (unsigned i = 0; i + round <= degree; i++) {
    double left = b->knots[mu - degree + i + round], right = b->knots[mu + i + 1];
    double part = (t - left) / (right - left);
    for (unsigned j = 0; j <= b->degree; j++) rows[i][j] = (1 - part) * rows[i][j] + part * rows[i + 1][j];
  }
}

void bspline_rows(const bspline *b, size_t mu, unsigned k, double lower, double upper, double *rows) {
  unsigned d = b->degree, degree = d - k;
  assert(d <= BSPLINE_DEGREE && k <= d);
  double base[BSPLINE_ORDER][BSPLINE_ORDER], work[BSPLINE_ORDER][BSPLINE_ORDER];
  differentiate(b, mu, k, base);
  for (unsigned i = 0; i <= degree; i++) {
    for (unsigned p = 0; p <= degree; p++)
      for (unsigned j = 0; j <= d; j++) work[p][j] = base[p][j];
    for (unsigned round = 1; round <= degree; round++)
      blossom_round(b, mu, degree, round, round <= degree - i ? lower : upper, work);
    for (unsigned j = 0; j <= d; j++) rows[i * (d + 1) + j] = work[0][j];
  }
}

void bspline_basis(const bspline *b, size_t mu, double t, unsigned order, double *table) {
  unsigned d = b->degree;
  assert(d <= BSPLINE_DEGREE);
  double work[BSPLINE_ORDER][BSPLINE_ORDER];
  for (unsigned k = 0; k <= order; k++) {
    if (k <= d) differentiate(b, mu, k, work);
    for (unsigned round = 1; k <= d && round <= d - k; round++) blossom_round(b, mu, d - k, round, t, work);
    for (unsigned j = 0; j <= d; j++) table[k * (d + 1) + j] = k <= d ? work[0][j] : 0;
  }
}

void bspline_greville(const bspline *b, double *out) {
  for (size_t i = 0; i < b->count; i++) {
    double sum = 0;
    for (unsigned j = 1; j <= b->degree; j++) sum += b->knots[i + j];
    out[i] = sum / b->degree;
  }
}
