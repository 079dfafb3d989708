/* What batten says of a surface at places of it, as text for those who read its files. */
#ifndef TEST_SURFACE_PLACES_H
#define TEST_SURFACE_PLACES_H

#include <batten/surface.h>
#include <stdbool.h>
#include <stdio.h>

/* A line a place: u v, point, normal, Gaussian and mean curvature; lengths times scale. False when it could not. */
static inline bool surface_places_write(batten_context *ctx, const batten_surface *surface, double scale,
                                        const char *path) {
  enum { STEPS = 11 };
  batten_surface_form form = batten_surface_get(surface);
  bool good = true;
  FILE *file = fopen(path, "w");
  if (!file) return false;
  for (int i = 0; i < (STEPS + 1) * (STEPS + 1); i++) {
    double at[2];
    batten_surface_point p;
    for (int k = 0; k < 2; k++) {
      double from = form.knots[k][0], to = form.knots[k][form.knot_count[k] - 1];
      at[k] = from + (to - from) * (0.01 + 0.98 * (k ? i % (STEPS + 1) : i / (STEPS + 1)) / STEPS); /* not at poles */
    }
    good = good && batten_surface_evaluate(ctx, surface, 1, at, &p) >= 0;
    if (!good) break;
    fprintf(file, "%.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", at[0], at[1], scale * p.point[0],
            scale * p.point[1], scale * p.point[2], p.normal[0], p.normal[1], p.normal[2], p.gauss / scale / scale,
            p.mean / scale);
  }
  return fclose(file) == 0 && good;
}

#endif
