/* Profiles of the plane swept along a path in space: the node a over one child of n = 2. */
#ifndef BATTEN_FREP_SWEEP_PROFILE_H
#define BATTEN_FREP_SWEEP_PROFILE_H

#include "frep/frep_inner.h"
#include "frep/sweep_path.h"

batten_status frep_profile_evaluate(const batten_frep *a, const sweep_path *path, batten_context *ctx, size_t count,
                                    const double *points, double *values, double *gradients);
batten_status frep_profile_bounds(const batten_frep *a, const sweep_path *path, batten_context *ctx, size_t count,
                                  const double *boxes, double *ranges);

#endif
