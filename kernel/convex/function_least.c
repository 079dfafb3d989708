/* The least eigenvalue of the Hessian of a spline function, from below.
 *
 * The least eigenvalue is a concave function of a matrix, so that on a box it is nowhere below the least one of the
 * Bernstein coefficients; those at the corners are values. Boxes are quartered until the two meet. */
#include <string.h>

#include "base/checked.h"
#include "basis/bezier.h"
#include "function_inner.h"

enum { LEAST_DEPTH = 20 };

typedef struct least_frame { /* coefficients [d_0 + 1][d_1 + 1][3] */
  unsigned depth;
  double lower[2], upper[2];
  double h[3 * FUNCTION_TABLE];
} least_frame;

static double lower_bound(size_t points, const double *h) {
  double least = INFINITY;
  for (size_t k = 0; k < points; k++) {
    double values[2];
    function_eigen(h + 3 * k, values, NULL);
    least = fmin(least, values[1]);
  }
  return least;
}

/* The values at corners; a less one than *upper is kept, with its place. */
static void corner_values(size_t n0, size_t n1, const least_frame *frame, const uint32_t span[2], double *upper,
                          function_place *where) {
  size_t corners[4] = {0, n1 - 1, (n0 - 1) * n1, n0 * n1 - 1};
  for (int k = 0; k < 4; k++) {
    double values[2];
    function_eigen(frame->h + 3 * corners[k], values, NULL);
    if (!(values[1] < *upper)) continue;
    *upper = values[1];
    *where = (function_place){{span[0], span[1]},
                              {k / 2 ? frame->upper[0] : frame->lower[0], k % 2 ? frame->upper[1] : frame->lower[1]}};
  }
}

/* Halves in the second (dir 1) or the first direction. */
static void halve(size_t n0, size_t n1, int dir, const double *h, double *left, double *right) {
  size_t lines = dir ? n0 : n1, points = dir ? n1 : n0, step = dir ? 3 : 3 * n1;
  double line[3 * FUNCTION_ORDER], low[3 * FUNCTION_ORDER], high[3 * FUNCTION_ORDER];
  for (size_t l = 0; l < lines; l++) {
    size_t first = dir ? l * 3 * n1 : l * 3;
    for (size_t k = 0; k < points; k++) memcpy(line + 3 * k, h + first + k * step, 3 * sizeof *line);
    bezier_split((unsigned)points - 1, 3, line, 0.5, low, high);
    for (size_t k = 0; k < points; k++) {
      memcpy(left + first + k * step, low + 3 * k, 3 * sizeof *line);
      memcpy(right + first + k * step, high + 3 * k, 3 * sizeof *line);
    }
  }
}

/* In place of the frame its quarters, behind each other; scratch: two frames. */
static void quarter(size_t n0, size_t n1, least_frame *frame, least_frame *scratch) {
  least_frame whole = *frame;
  halve(n0, n1, 0, whole.h, scratch[0].h, scratch[1].h);
  for (size_t k = 0; k < 2; k++) halve(n0, n1, 1, scratch[k].h, frame[2 * k].h, frame[2 * k + 1].h);
  for (int k = 0; k < 4; k++) {
    int side[2] = {k / 2, k % 2};
    frame[k].depth = whole.depth + 1;
    for (int i = 0; i < 2; i++) {
      double middle = whole.lower[i] / 2 + whole.upper[i] / 2;
      frame[k].lower[i] = side[i] ? middle : whole.lower[i];
      frame[k].upper[i] = side[i] ? whole.upper[i] : middle;
    }
  }
}

batten_status function_least(batten_context *ctx, const function_space *space, const double *x, double tolerance,
                             size_t box_limit, double *least, function_place *where) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t spans = space->spans[0] * space->spans[1], boxes = 0, points = n0 * n1;
  least_frame *stack = batten_alloc_array(ctx, 3 * LEAST_DEPTH + 6, sizeof *stack);
  if (!stack) return BATTEN_E_NOMEM;
  double lower = INFINITY, upper = INFINITY;
  *where = (function_place){{0, 0}, {0, 0}};
  for (int pass = 0; pass < 2; pass++) /* values at corners first: boxes that lie above them need no look */
    for (size_t s = 0; s < spans; s++) {
      function_box box = {.span = {(uint32_t)(s / space->spans[1]), (uint32_t)(s % space->spans[1])}};
      double sign = function_sign(space, box.span);
      if (sign == 0) continue;
      for (int i = 0; i < 2; i++) {
        box.lower[i] = space->spline.axis[i].knots[space->span[i][box.span[i]]];
        box.upper[i] = space->spline.axis[i].knots[space->span[i][box.span[i]] + 1];
      }
      size_t used = 1;
      function_hessian_box(space, &box, x, stack[0].h);
      for (size_t k = 0; k < 3 * points; k++) stack[0].h[k] *= sign;
      stack[0].depth = 0;
      for (int i = 0; i < 2; i++) {
        stack[0].lower[i] = box.lower[i];
        stack[0].upper[i] = box.upper[i];
      }
      if (pass == 0) {
        corner_values(n0, n1, &stack[0], box.span, &upper, where);
        continue;
      }
      while (used > 0) {
        least_frame *top = &stack[used - 1];
        double bound = lower_bound(points, top->h);
        corner_values(n0, n1, top, box.span, &upper, where);
        boxes++;
        if (bound >= upper - fmax(tolerance, fabs(upper) / 16) || bound >= lower || top->depth == LEAST_DEPTH ||
            boxes > box_limit) {
          lower = fmin(lower, bound);
          used--;
          continue;
        }
        quarter(n0, n1, top, &stack[used + 3]); /* scratch beyond the three new ones */
        used += 3;
      }
    }
  batten_free(ctx, stack);
  *least = lower;
  return BATTEN_OK;
}
