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

static double corner_value(size_t n0, size_t n1, const double *h) {
  size_t corners[4] = {0, n1 - 1, (n0 - 1) * n1, n0 * n1 - 1};
  double least = INFINITY;
  for (int k = 0; k < 4; k++) {
    double values[2];
    function_eigen(h + 3 * corners[k], values, NULL);
    least = fmin(least, values[1]);
  }
  return least;
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

batten_status function_least(batten_context *ctx, const function_space *space, const double *x, double tolerance,
                             size_t box_limit, double *least) {
  size_t n0 = space->spline.axis[0].degree + 1, n1 = space->spline.axis[1].degree + 1;
  size_t spans = space->spans[0] * space->spans[1], boxes = 0, points = n0 * n1;
  least_frame *stack = batten_alloc_array(ctx, 3 * LEAST_DEPTH + 6, sizeof *stack);
  if (!stack) return BATTEN_E_NOMEM;
  double lower = INFINITY, upper = INFINITY;
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
      if (pass == 0) {
        upper = fmin(upper, corner_value(n0, n1, stack[0].h));
        continue;
      }
      while (used > 0) {
        least_frame *top = &stack[used - 1];
        double bound = lower_bound(points, top->h);
        upper = fmin(upper, corner_value(n0, n1, top->h));
        boxes++;
        if (bound >= upper - fmax(tolerance, fabs(upper) / 16) || bound >= lower || top->depth == LEAST_DEPTH ||
            boxes > box_limit) {
          lower = fmin(lower, bound);
          used--;
          continue;
        }
        least_frame *half = &stack[used + 3]; /* scratch beyond the three new ones */
        unsigned depth = top->depth + 1;
        halve(n0, n1, 0, top->h, half[0].h, half[1].h);
        halve(n0, n1, 1, half[0].h, stack[used - 1].h, stack[used].h);
        halve(n0, n1, 1, half[1].h, stack[used + 1].h, stack[used + 2].h);
        for (int k = 0; k < 4; k++) stack[used - 1 + (size_t)k].depth = depth;
        used += 3;
      }
    }
  batten_free(ctx, stack);
  *least = lower;
  return BATTEN_OK;
}
