/* B-spline surfaces as the Bezier patches of their span pairs: rows first, then columns. */
#include "spans.h"
#include "surface.h"

#include <string.h>

size_t bx_next_span(const batten_surface_form *form, int direction, size_t mu) {
  return bx_knot_span(form->degree[direction], bx_form_points(form, direction), form->knots[direction], mu);
}

size_t bx_span_count(const batten_surface_form *form, int direction) {
  return bx_knot_spans(form->degree[direction], bx_form_points(form, direction), form->knots[direction]);
}

void bx_span_points(const batten_surface_form *form, const size_t mu[2], double (*points)[3]) {
  unsigned p = form->degree[0], q = form->degree[1];
  size_t columns = bx_form_points(form, 1), width = (size_t)q + 1;
  for (unsigned i = 0; i <= p; i++)
    memcpy(points[i * width], form->control_points + 3 * ((mu[0] - p + i) * columns + mu[1] - q),
           width * sizeof points[0]);
  for (unsigned i = 0; i <= p; i++) bx_span_to_bezier(q, form->knots[1], mu[1], points + i * width, 1);
  for (unsigned j = 0; j <= q; j++) bx_span_to_bezier(p, form->knots[0], mu[0], points + j, width);
}
