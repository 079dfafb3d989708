/* The spline of a solid: through all points of the fit, or with so few centres that the surface is within a distance
 * of them.
 *
 * On the surface the tolerance is a distance, |f| / |grad f|. Points off it are there for the sign alone: half of
 * their f may be missed, which keeps the surface off them. */
#include <math.h>

#include "base/checked.h"
#include "solid/solid_inner.h"

/* Part of f that may be missed off the surface. */
static const double OFF_SURFACE = 0.5;

/* tolerances [count], gradients [surface][n] of the carrier. */
static batten_status set_tolerances(batten_context *ctx, double distance, const batten_carrier *carrier,
                                    size_t surface, const batten_spline_data *data, double *tolerances,
                                    double *gradients) {
  const size_t off = data->count - surface;
  batten_status st = batten_carrier_evaluate(ctx, carrier, surface, data->points, NULL, gradients, NULL);
  for (size_t i = 0; i < surface; i++) tolerances[i] = distance;
  if (st < 0 || off == 0) return st;
  st = batten_carrier_evaluate(ctx, carrier, off, data->points + surface * data->n, tolerances + surface, NULL, NULL);
  for (size_t i = surface; st >= 0 && i < data->count; i++) {
    const double f = tolerances[i] - data->values[i];
    tolerances[i] = f != 0 ? OFF_SURFACE * fabs(f) : distance;
  }
  return st;
}

batten_status batten_solid_fit_spline(batten_context *ctx, const batten_solid_options *opt,
                                      const batten_carrier *carrier, size_t surface, const batten_spline_data *data,
                                      const batten_spline_options *o, batten_spline **out, batten_spline_info *info,
                                      batten_spline_reduce_info *reduced) {
  *reduced = (batten_spline_reduce_info){0};
  if (opt->reduce == 0) return batten_spline_fit(ctx, data, o, out, info);
  batten_spline_reduce_options r = batten_spline_reduce_options_default();
  batten_status st = BATTEN_E_NOMEM;
  double *tolerances = batten_alloc_array(ctx, data->count, sizeof *tolerances);
  double *gradients = batten_alloc_array(ctx, surface, data->n * sizeof *gradients);
  if (!tolerances || !gradients) goto done;
  st = set_tolerances(ctx, opt->reduce, carrier, surface, data, tolerances, gradients);
  if (st < 0) goto done;
  r.tolerances = tolerances;
  r.distance_count = surface;
  r.field_gradients = gradients;
  st = batten_spline_fit_reduced(ctx, data, o, &r, out, reduced);
  if (st >= 0) *info = reduced->fit;
done:
  batten_free(ctx, gradients);
  batten_free(ctx, tolerances);
  return st;
}
