/* What the polygoniser and the outline tracer share; for kernel/mesh only. */
#ifndef BATTEN_MESH_POLYGONIZE_H
#define BATTEN_MESH_POLYGONIZE_H

#include <batten/mesh.h>

typedef struct batten_frame {
  double lower[3], upper[3], diagonal; /* of the clip box */
  double cell;
} batten_frame;

/* Checks the arguments of batten_polygonize (n = 3) and batten_trace_outline (n = 2); box and cell, from the seeds
 * where opt leaves them open. Time O(N log N). */
batten_status batten_polygonize_frame(batten_context *ctx, unsigned n, const batten_field *field, size_t seed_count,
                                      const double *seeds, const batten_polygonize_options *opt, const void *out,
                                      batten_frame *frame);

/* Where no seeds are given but a box and a field with bounds: opt->cell is set, and *seeds (freed by batten_free
 * through *found), *seed_count and *evaluations are those of a search; else nothing happens. What is wrong otherwise
 * is left to batten_polygonize_frame. */
batten_status batten_polygonize_seeds(batten_context *ctx, unsigned n, const batten_field *field, const void *out,
                                      batten_polygonize_options *opt, size_t *seed_count, const double **seeds,
                                      double **found, size_t *evaluations);

/* BATTEN_W_ACCURACY, BATTEN_W_CLIPPED or BATTEN_OK, as info says. */
batten_status batten_polygonize_warn(batten_context *ctx, const batten_polygonize_info *info, double tolerance);

/* Half step of central differences, in cells: error about 1e-8 on smooth fields. */
#define BATTEN_DIFFERENCE 1e-4

#endif
