/* A scalar field evaluated in batches: what carriers, solids and users' callbacks have in common, and
 * what the polygoniser takes. The solid of a field is { x : f(x) >= 0 }. */
#ifndef BATTEN_FIELD_H
#define BATTEN_FIELD_H

#include <batten/base.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_field {
  unsigned dimension; /* n: 1, 2 or 3 */
  unsigned order;     /* highest derivative that evaluate supplies: 0, 1 or 2 */
  /* points [count][n]; values [count], gradients [count][n], hessians [count][n][n], each NULL when not
   * wanted, gradients and hessians always NULL above `order`. Outputs do not overlap the input. A
   * negative status is handed on to the caller, the outputs then being partly written: a batch may be large, and a
   * copy to keep them would cost as much memory again. Called on the calling thread. */
  batten_status (*evaluate)(const void *user, batten_context *ctx, size_t count, const double *points,
                            double *values, double *gradients, double *hessians);
  const void *user;
  /* Bounds over boxes, or NULL. boxes [count][2][n]: lower and upper corners, finite, lower <= upper; ranges [count][2]:
   * evaluate gives no value outside of [lo, hi] at any point of the box; -INFINITY, INFINITY where nothing is known.
   * Narrow boxes should have narrow ranges. The polygoniser finds surfaces by it without seeds and leaves out empty
   * space. */
  batten_status (*bounds)(const void *user, batten_context *ctx, size_t count, const double *boxes, double *ranges);
} batten_field;

#ifdef __cplusplus
}
#endif
#endif
