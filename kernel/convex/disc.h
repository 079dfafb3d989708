/* A triangulation that is a disc: its half-edges and its rim; for kernel/convex only.
 *
 * Half-edge 3 t + k runs from corner k of triangle t to the next corner (mesh/mesh_inner.h). */
#ifndef BATTEN_CONVEX_DISC_H
#define BATTEN_CONVEX_DISC_H

#include <batten/base.h>
#include <stdbool.h>
#include <stdint.h>

#include "mesh/mesh_inner.h"

typedef struct convex_disc {
  size_t points, triangles;
  uint32_t *corners; /* [triangles][3] */
  uint32_t *twin;    /* [triangles][3] the half-edge the other way, MESH_NONE at the rim */
  uint32_t *leaving; /* [points] a half-edge that leaves the point, at the rim that of the rim; MESH_NONE: unused */
  size_t rim_count;
  uint32_t *rim; /* [rim_count] points, the disc on their left */
} convex_disc;

/* Copies triangles [triangle_count][3]. Room is left for the points and triangles of convex_disc_split. first
 * [points] or NULL: points with first[i] != i need no triangle. Fails: INVALID (not a disc: the text names a triangle
 * or point), TOO_LARGE, NOMEM. */
batten_status convex_disc_new(batten_context *ctx, size_t points, const uint32_t *first, size_t triangle_count,
                              const uint32_t *triangles, convex_disc *out);
void convex_disc_free(batten_context *ctx, convex_disc *disc);

static inline bool convex_disc_is_rim(const convex_disc *d, uint32_t point) {
  return d->leaving[point] != MESH_NONE && d->twin[d->leaving[point]] == MESH_NONE;
}

/* The next half-edge that leaves the same point, counter-clockwise; MESH_NONE past the rim. */
static inline uint32_t convex_disc_turn(const convex_disc *d, uint32_t h) { return d->twin[mesh_previous(h)]; }

/* Puts a new point, disc->points, on the edge of half-edge h, which is not of the rim: two triangles become four. */
void convex_disc_split(convex_disc *disc, uint32_t h);

/* Which triangles convex_disc_peel takes off the rim: the one of half-edge h on the rim, if take says so and its
 * third point is not on the rim; then those behind it. What goes behind one half-edge of the first rim, from point a
 * to b, is a pocket with the third points apexes [count]; it stays whole unless confirm agrees. */
typedef struct convex_peel {
  const void *arg;
  bool (*take)(const void *arg, const convex_disc *disc, uint32_t h);
  bool (*confirm)(const void *arg, uint32_t a, uint32_t b, size_t count, const uint32_t *apexes); /* NULL: always */
} convex_peel;
batten_status convex_disc_peel(batten_context *ctx, convex_disc *disc, const convex_peel *peel);

#endif
