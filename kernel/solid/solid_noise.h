/* Noise of surface points and the smoothing that it asks for: see solid_noise.c. */
#ifndef BATTEN_SOLID_NOISE_H
#define BATTEN_SOLID_NOISE_H

#include <stdbool.h>

#include "solid/solid_inner.h"

/* Standard deviation of the points' distance from the surface, 0 where quadrics fit them. */
batten_status batten_solid_estimate_noise(batten_context *ctx, const surface_data *d, double *noise);

/* f / slope, cut at 5 noise (noise 0: not cut); f >= 0. */
double batten_solid_cut_distance(double f, double slope, double noise);

/* Root mean square of |f| / |grad f| at the points, or at evenly drawn ones of many, each cut as above. */
batten_status batten_solid_rms_distance(batten_context *ctx, const batten_solid *s, size_t count,
                                        const double *points, double noise, double *rms);

/* One fit with smoothing rho; *rms: what batten_solid_rms_distance says of it. */
typedef batten_status (*batten_smoothing_trial)(batten_context *ctx, void *user, double rho, double *rms);

/* *rho such that *reached = noise to 5 %, or as near as rho in 1e-12 .. 1e6 comes in 12 fits. */
batten_status batten_solid_find_smoothing(batten_context *ctx, double noise, double start,
                                          batten_smoothing_trial trial, void *user, double *rho, double *reached);

/* Whether rho is looked for with a subset first; the subset of some 3000 points, its normals being the caller's
 * at these points (NULL: none); out_normals belong to *out. */
bool batten_solid_noise_is_large(const surface_data *d);
batten_status batten_solid_noise_subset(batten_context *ctx, const surface_data *d, const batten_solid_options *opt,
                                        const double *normals, surface_data *out, double **out_normals);

#endif
