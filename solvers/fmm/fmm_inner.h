/* The inside of a plan of fast multipole sums, for solvers/fmm only. */
#ifndef BATTEN_FMM_INNER_H
#define BATTEN_FMM_INNER_H

#include <batten/fmm.h>

#include "fmm/lanes.h"

/* Points of one role, one array for each axis. */
typedef struct fmm_points {
  size_t count;
  double *x[3];
  double *block; /* what x points into */
} fmm_points;

struct batten_fmm {
  batten_context *ctx;
  batten_radial kernel;
  double accuracy;
  int gradients, dipoles;
  fmm_points sources, targets; /* in the caller's order */
  batten_fmm_info info;
};

/* Everything that can be wrong with the arguments of batten_fmm_create(); opt is not NULL. */
batten_status batten_fmm_check_plan(batten_context *ctx, const batten_radial *kernel, size_t source_count,
                                    const double *sources, size_t target_count, const double *targets,
                                    const batten_fmm_options *opt);
/* The same of weights and dipoles. */
batten_status batten_fmm_check_weights(batten_context *ctx, const batten_fmm *fmm, const double *weights,
                                       const double *dipoles);

#endif
