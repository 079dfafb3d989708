/* Running the polygoniser on a shape: seeds on the surface, mesh, measures, crossings. */
#ifndef POLYGONIZE_CASES_H
#define POLYGONIZE_CASES_H

#include <batten/mesh.h>

#include "field_shapes.h"
#include "tap.h"

enum { SEEDS_MAX = 2000 };

typedef struct polygonized {
  batten_status status;
  batten_mesh *mesh;
  batten_mesh_measures m;
  batten_polygonize_info info;
  size_t crossings;
} polygonized;

/* Seeds by Newton's method from random points of the cube of half side reach: returns how many. */
static inline size_t shape_seeds(shape *s, double reach, size_t wanted, uint64_t seed, double *seeds) {
  size_t count = 0;
  for (int tries = 0; tries < 100000 && count < wanted; tries++) {
    double u[3], x[3], f, g[3];
    bool inside = true;
    for (int k = 0; k < 3; k++) u[k] = reach * (2 * t_uniform(&seed) - 1);
    for (int step = 0; step < 20; step++) {
      f = s->function(u, g);
      double gg = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
      for (int k = 0; k < 3 && gg > 0; k++) u[k] -= f * g[k] / gg;
    }
    for (int k = 0; k < 3; k++) inside = inside && fabs(u[k]) < reach;
    if (!inside || fabs(s->function(u, g)) > 1e-9) continue;
    shape_to_world(s, u, x);
    memcpy(seeds + 3 * count++, x, sizeof x);
  }
  return count;
}

/* Box [-reach, 1.01 reach]^3 of the shape's scale around its origin; cell in units of the scale. */
static inline batten_polygonize_options shape_options(const shape *s, double reach, double cell) {
  batten_polygonize_options o = batten_polygonize_options_default();
  o.cell = cell * s->scale;
  for (int k = 0; k < 3; k++) {
    o.lower[k] = s->origin[k] - reach * s->scale;
    o.upper[k] = s->origin[k] + reach * s->scale * 1.015625;
  }
  return o;
}

static inline polygonized polygonize(batten_context *ctx, shape *s, const batten_polygonize_options *o,
                                     size_t seed_count, const double *seeds) {
  batten_field field = shape_field(s);
  polygonized p = {.mesh = NULL};
  p.status = batten_polygonize(ctx, &field, seed_count, seeds, o, &p.mesh, &p.info);
  if (p.status < 0) return p;
  batten_mesh_measure(ctx, p.mesh, &p.m);
  batten_mesh_self_intersections(ctx, p.mesh, &p.crossings);
  return p;
}

static inline void polygonized_print(const char *name, const polygonized *p) {
  printf(
      "# %-10s V %6zu F %6zu angles %4.1f .. %5.1f, above 20 degrees %.4f, edges / cell %.2f %.2f %.2f, "
      "evaluations / V %.1f, distance %.1e\n",
      name, p->m.vertices, p->m.triangles, p->m.angle_min_deg, p->m.angle_max_deg, p->m.angles_above_20deg,
      p->m.edge_min / p->info.cell, p->m.edge_mean / p->info.cell, p->m.edge_max / p->info.cell,
      (double)p->info.evaluations / (double)p->m.vertices, p->info.distance_max);
}

#endif
