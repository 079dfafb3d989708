/* Spans in Bezier form: see spans.h.   [Ramshaw: Blossoming]
 *
 * The k-th Bezier point of a polynomial of degree d on [a, b] is the value of its blossom with d - k arguments a and
 * k arguments b; its B-spline points on the span are the values at d knots in a row. De Boor's algorithm changes one
 * argument in every step, always by means between two points. */
#include "spans.h"

#include <string.h>

size_t bx_knot_span(unsigned degree, size_t count, const double *knots, size_t mu) {
  for (mu = mu < degree ? degree : mu + 1; mu < count; mu++)
    if (knots[mu] < knots[mu + 1]) break;
  return mu;
}

size_t bx_knot_spans(unsigned degree, size_t count, const double *knots) {
  size_t spans = 0;
  for (size_t mu = bx_knot_span(degree, count, knots, 0); mu < count; mu = bx_knot_span(degree, count, knots, mu))
    spans++;
  return spans;
}

void bx_span_to_bezier(unsigned degree, const double *knots, size_t mu, double (*line)[3], size_t stride) {
  double work[BX_SPAN_DEGREE + 1][3], out[BX_SPAN_DEGREE + 1][3];
  const double ends[2] = {knots[mu], knots[mu + 1]};
  for (unsigned k = 0; k <= degree; k++) {
    for (unsigned i = 0; i <= degree; i++) memcpy(work[i], line[i * stride], sizeof work[i]);
    for (unsigned level = 1; level <= degree; level++) {
      double t = ends[level <= k ? 1 : 0];
      for (unsigned i = 0; i + level <= degree; i++) {
        double lower = knots[mu - degree + level + i], upper = knots[mu + 1 + i],
               part = (t - lower) / (upper - lower);
        for (int x = 0; x < 3; x++) work[i][x] = (1 - part) * work[i][x] + part * work[i + 1][x];
      }
    }
    memcpy(out[k], work[0], sizeof out[k]);
  }
  for (unsigned k = 0; k <= degree; k++) memcpy(line[k * stride], out[k], sizeof out[k]);
}
