/* What batten says of curves, as text for those who read their files. */
#ifndef TEST_CURVE_PLACES_H
#define TEST_CURVE_PLACES_H

#include <batten/curve.h>
#include <batten/exchange.h>
#include <stdbool.h>
#include <stdio.h>

/* "degree closed knots places", the knots, and a line a place: t, then point, first and second derivative in space;
 * lengths times scale. False when it could not. */
static inline bool curve_places_put(batten_context *ctx, const batten_curve *curve, const batten_plane *plane,
                                    double scale, FILE *file) {
  enum { STEPS = 100 };
  batten_curve_form form = batten_curve_get(curve);
  double lower = form.knots[0], upper = form.knots[form.knot_count - 1];
  fprintf(file, "%u %d %zu %d\n", form.degree, form.closed != 0, form.knot_count, STEPS + 1);
  for (size_t i = 0; i < form.knot_count; i++) fprintf(file, "%.17g\n", form.knots[i]);
  for (int i = 0; i <= STEPS; i++) {
    /* between the knots, where derivatives of every order are those of one span */
    double t = lower + (upper - lower) * (0.0013 + 0.9971 * i / STEPS), x[3][2];
    if (batten_curve_derivatives(ctx, curve, 2, 1, &t, x[0]) < 0) return false;
    fprintf(file, "%.17g", t);
    for (int order = 0; order < 3; order++)
      for (int k = 0; k < 3; k++)
        fprintf(file, " %.17g",
                scale * ((order == 0 ? plane->origin[k] : 0) + x[order][0] * plane->axes[0][k] +
                         x[order][1] * plane->axes[1][k]));
    fputc('\n', file);
  }
  return true;
}

#endif
