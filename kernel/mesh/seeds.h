/* The search for the surface f = 0 by bounds; for kernel/mesh only. */
#ifndef BATTEN_MESH_SEEDS_H
#define BATTEN_MESH_SEEDS_H

#include "sampler.h"

#include <batten/mesh.h>

/* batten_find_seeds behind its checks; the sampler counts and limits the evaluations. */
batten_status batten_search_seeds(batten_sampler *sampler, const double *lower, const double *upper, double cell,
                                  size_t *count, double **seeds);

#endif
