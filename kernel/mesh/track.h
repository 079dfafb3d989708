/* The first, rough surface: marching tetrahedra that follow f = 0 from the seeds; for kernel/mesh only. */
#ifndef BATTEN_MESH_TRACK_H
#define BATTEN_MESH_TRACK_H

#include "sampler.h"

#include <stdint.h>

typedef struct batten_rough_surface {
  size_t vertex_count, triangle_count;
  double *vertices;     /* [V][3] within a cell of f = 0 */
  unsigned char *faces; /* [V] of the box that the vertex lies on, as in project.h */
  uint32_t *triangles;  /* [F][3] */
  size_t seeds_missed;
} batten_rough_surface;

void batten_rough_surface_free(batten_context *ctx, batten_rough_surface *surface);

/* cell: edge of the cubes, fitted to the box in each direction. The surface does not depend on the order of the
 * seeds. Fails: NOT_FOUND, TOO_LARGE, NOMEM, CANCELLED, what the sampler fails with. */
batten_status batten_track_surface(batten_sampler *sampler, const double *lower, const double *upper, double cell,
                                   size_t seed_count, const double *seeds, batten_rough_surface *out);

#endif
