/* B-spline surfaces as the Bezier patches of their span pairs.   [Ramshaw: Blossoming]
 *
 * The k-th Bezier point of a polynomial of degree d on [a, b] is the value of its blossom with d - k arguments a and
 * k arguments b; its B-spline points on the span are the values at d knots in a row. De Boor's algorithm changes one
 * argument in every step, always by means between two points. */
#include "surface.h"

#include <string.h>

size_t bx_next_span(const batten_surface_form *form, int direction, size_t mu) {
  const double *knots = form->knots[direction];
  size_t end = bx_form_points(form, direction);
  for (mu = mu < form->degree[direction] ? form->degree[direction] : mu + 1; mu < end; mu++)
    if (knots[mu] < knots[mu + 1]) break;
  return mu;
}

size_t bx_span_count(const batten_surface_form *form, int direction) {
  size_t count = 0, end = bx_form_points(form, direction);
  for (size_t mu = bx_next_span(form, direction, 0); mu < end; mu = bx_next_span(form, direction, mu)) count++;
  return count;
}

/* line [degree + 1], with points stride apart, in place. */
static void to_bezier(unsigned degree, const double *knots, size_t mu, double (*line)[3], size_t stride) {
  double work[BATTEN_SURFACE_DEGREE_MAX + 1][3], out[BATTEN_SURFACE_DEGREE_MAX + 1][3];
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

void bx_span_points(const batten_surface_form *form, const size_t mu[2], double (*points)[3]) {
  unsigned p = form->degree[0], q = form->degree[1];
  size_t columns = bx_form_points(form, 1), width = (size_t)q + 1;
  for (unsigned i = 0; i <= p; i++)
    memcpy(points[i * width], form->control_points + 3 * ((mu[0] - p + i) * columns + mu[1] - q),
           width * sizeof points[0]);
  for (unsigned i = 0; i <= p; i++) to_bezier(q, form->knots[1], mu[1], points + i * width, 1);
  for (unsigned j = 0; j <= q; j++) to_bezier(p, form->knots[0], mu[0], points + j, width);
}
