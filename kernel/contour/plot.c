/* The curvature plot of the smoothing spline. */
#include "bends.h"

#include "base/checked.h"

enum { PER_SPAN = 4 };

/* Of the curvature [x', x''] / |x'|^3 only the part that x'' has, along the normal, is uncertain to speak of. */
static void sample(const contour_smooth *s, double t, double *out, double *angle) {
  double jet[3][2];
  contour_smooth_jet(s, s->control, t, jet);
  double speed2 = jet[1][0] * jet[1][0] + jet[1][1] * jet[1][1], speed = sqrt(speed2);
  out[0] = t;
  out[1] = speed > 0 ? contour_cross(jet[1], jet[2]) / (speed2 * speed) : 0;
  out[2] =
      speed > 0 ? fmax(s->noise, CONTOUR_EXACT * s->size) * sqrt(contour_smooth_variance(s, t)) / speed2 : INFINITY;
  *angle = atan2(jet[1][1], jet[1][0]);
}

batten_status contour_plot_make(batten_context *ctx, const contour_smooth *s, contour_plot *out) {
  contour_plot p = {.count = PER_SPAN * s->spans + 1};
  p.samples = batten_alloc_array(ctx, p.count, 4 * sizeof(double));
  p.angles = p.samples ? batten_alloc_array(ctx, p.count, sizeof(double)) : NULL;
  if (!p.angles) {
    batten_free(ctx, p.samples);
    return BATTEN_E_NOMEM;
  }
  const double pi = acos(-1);
  double length = 0, before[3][2], jet[3][2];
  for (size_t i = 0; i < p.count; i++) {
    double t = (double)i / (double)(p.count - 1), angle, *at = p.samples + 4 * i;
    sample(s, t, at, &angle);
    if (i > 0) {
      double middle[3][2], h = 1 / (double)(p.count - 1);
      contour_smooth_jet(s, s->control, t - 0.5 * h, middle);
      contour_smooth_jet(s, s->control, t, jet);
      length +=
          h / 6 *
          (hypot(before[1][0], before[1][1]) + 4 * hypot(middle[1][0], middle[1][1]) + hypot(jet[1][0], jet[1][1]));
      double turn = angle - p.angles[i - 1];
      p.angles[i] = p.angles[i - 1] + turn - 2 * pi * round(turn / (2 * pi));
    } else {
      contour_smooth_jet(s, s->control, t, jet);
      p.angles[0] = angle;
    }
    for (int k = 0; k < 2; k++) before[1][k] = jet[1][k];
    at[3] = length;
  }
  *out = p;
  return BATTEN_OK;
}

void contour_plot_free(batten_context *ctx, contour_plot *p) {
  if (!p) return;
  batten_free(ctx, p->angles);
  batten_free(ctx, p->samples);
  *p = (contour_plot){0};
}
