/* Inflections that the data speak for: what the fit asks for, and the caller. See smooth.c, bends.c. */
#include "bends.h"

#include <string.h>

#include "base/checked.h"

/* The smoothing spline and its plot. */
static batten_status smooth_and_plot(batten_context *ctx, const contour_data *data, const double *parameters,
                                     bool closed, contour_smooth *smooth, contour_plot *plot) {
  batten_status st = contour_smooth_fit(ctx, data, parameters, closed, smooth);
  if (st < 0) return st;
  st = contour_plot_make(ctx, smooth, plot);
  if (st < 0) contour_smooth_free(ctx, smooth);
  return st;
}

batten_status contour_inflections_find(batten_context *ctx, const contour_data *data, const double *parameters,
                                       bool closed, double significance, size_t *count, double **inflections,
                                       int *sign) {
  contour_smooth smooth = {0};
  contour_plot plot = {0};
  contour_bends bends = {0};
  batten_status st = smooth_and_plot(ctx, data, parameters, closed, &smooth, &plot);
  if (st >= 0) st = contour_bends_find(ctx, &smooth, &plot, data->count, parameters, significance, &bends);
  if (st >= 0) {
    *count = bends.count;
    *inflections = bends.inflections;
    *sign = bends.sign;
    bends.inflections = NULL;
  }
  contour_bends_free(ctx, &bends);
  contour_plot_free(ctx, &plot);
  contour_smooth_free(ctx, &smooth);
  return st;
}

/* Each sample's curvature in its standard deviations, those of far above one not counted more, by its length. */
static double vote(const contour_plot *plot, size_t i) {
  const double *at = plot->samples + 4 * i;
  double z = at[2] > 0 && at[2] < INFINITY ? at[1] / at[2] : 0;
  return z / (1 + fabs(z)) * (plot->angles[i + 1] - plot->angles[i]) * (at[1] < 0 ? -1 : 1);
}

batten_status contour_sign_guess(batten_context *ctx, const contour_data *data, const double *parameters, bool closed,
                                 size_t count, const double *inflections, int *sign) {
  contour_smooth smooth = {0};
  contour_plot plot = {0};
  batten_status st = smooth_and_plot(ctx, data, parameters, closed, &smooth, &plot);
  if (st < 0) return st;
  double sum = 0;
  int way = 1; /* of the run, where the start has + */
  size_t next = 0;
  while (next < count && inflections[next] <= 0) next++;
  for (size_t i = 0; i + 1 < plot.count; i++) {
    double t = 0.5 * (plot.samples[4 * i] + plot.samples[4 * i + 4]);
    for (; next < count && inflections[next] <= t; next++) way = -way;
    sum += way * vote(&plot, i);
  }
  *sign = sum >= 0 ? 1 : -1;
  contour_plot_free(ctx, &plot);
  contour_smooth_free(ctx, &smooth);
  return BATTEN_OK;
}
