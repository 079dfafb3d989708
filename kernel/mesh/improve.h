/* From the rough surface to an even mesh on f = 0; for kernel/mesh only. */
#ifndef BATTEN_MESH_IMPROVE_H
#define BATTEN_MESH_IMPROVE_H

#include "sampler.h"
#include "surface.h"

/* Rounds of split, collapse, flip and tangential smoothing towards edges of the length `edge`; every second one takes
 * vertices that may have left f = 0 back to it by a Newton step. Vertices stay in the box. */
batten_status mesh_surface_improve(mesh_surface *s, batten_sampler *sampler, const double *lower, const double *upper,
                                   double edge, unsigned rounds);

/* Such rounds that keep to creases (sharp.h), which are bent by more than angle (radians). */
batten_status mesh_surface_improve_creased(mesh_surface *s, batten_sampler *sampler, const double *lower,
                                           const double *upper, double edge, double angle, unsigned rounds);

/* Puts every vertex on f = 0 to |f| / |grad f| <= tolerance; *distance_max: what is left. Vertices move at most by
 * about `edge`, those on the box within its faces. */
batten_status mesh_surface_settle(mesh_surface *s, batten_sampler *sampler, double edge, double tolerance,
                                  double *distance_max);

#endif
