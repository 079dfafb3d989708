/* A triangle surface that can be changed: half-edges with twins, split, collapse, flip; for kernel/mesh only.
 *
 * Half-edge 3 t + k belongs to triangle t, which lies on its left. twin[h] is the half-edge back, or MESH_NONE on
 * the boundary. out[v] is a half-edge that leaves v; for a vertex on the boundary the one without twin, so that
 * turning counter-clockwise from there meets all triangles of v. Removed triangles and vertices keep their numbers
 * until mesh_surface_compact: origin[3 t] or out[v] is MESH_NONE. Edges along creases are sharp: both of their
 * half-edges say so, and operations hand that on. */
#ifndef BATTEN_MESH_SURFACE_H
#define BATTEN_MESH_SURFACE_H

#include "mesh_inner.h"
#include "track.h"

#include <stdbool.h>

enum { SURFACE_RING_MAX = 32 }; /* triangles at a vertex that operations look at; more are left alone */
/* Beside the faces of the box in mesh_surface.faces: the vertex lies on a crease, or where creases meet or end. */
enum { MESH_CREASE = 64, MESH_CORNER = 128, MESH_MARKS = 192 };

typedef struct mesh_surface {
  batten_context *ctx;
  size_t vertex_count, triangle_count;
  double *points, *normals; /* [V][3]; normals: unit, outward, 0 = not known */
  unsigned char *faces;     /* [V] of the box, see project.h; and the marks above */
  uint32_t *out;            /* [V] */
  uint32_t *origin, *twin;  /* [3 T] */
  unsigned char *sharp;     /* [3 T] */
  float *drift;             /* [V] the way along the surface since f was last known there; INFINITY: it never was */
  size_t points_capacity, normals_capacity, faces_capacity, out_capacity, origin_capacity, twin_capacity;
  size_t sharp_capacity, drift_capacity;
} mesh_surface;

/* Takes over the arrays of rough, which is emptied. INTERNAL when it is no oriented manifold. */
batten_status mesh_surface_build(batten_context *ctx, batten_rough_surface *rough, mesh_surface *out);
/* out: empty but for its context. Fails: NOMEM. */
batten_status mesh_surface_copy(const mesh_surface *s, mesh_surface *out);
void mesh_surface_free(mesh_surface *s);

/* Half-edges that leave v, counter-clockwise; 0 when there are more than SURFACE_RING_MAX. */
size_t mesh_surface_ring(const mesh_surface *s, uint32_t v, uint32_t *half_edges);
/* Neighbours of v: one for each half-edge of the ring, and one more at the boundary. */
size_t mesh_surface_neighbours(const mesh_surface *s, uint32_t v, uint32_t *vertices);

/* The half-edge from a to b, or MESH_NONE. */
uint32_t mesh_surface_find(const mesh_surface *s, uint32_t a, uint32_t b);
/* How many sharp edges meet in v; SURFACE_RING_MAX where that is not known. */
size_t mesh_surface_sharp_count(const mesh_surface *s, uint32_t v);

static inline bool mesh_surface_on_boundary(const mesh_surface *s, uint32_t v) {
  return s->twin[s->out[v]] == MESH_NONE;
}

/* Splits the edge of h at a new vertex x: its number, or MESH_NONE (out of memory). */
uint32_t mesh_surface_split(mesh_surface *s, uint32_t h, const double *x);
/* Splits triangle t in three at a new vertex x: its number, or MESH_NONE. */
uint32_t mesh_surface_poke(mesh_surface *s, uint32_t t, const double *x);

/* Do the rings allow to draw the origin of h into its end (link condition)? */
bool mesh_surface_may_collapse(const mesh_surface *s, uint32_t h);
/* Does so; the end keeps its place. */
void mesh_surface_collapse(mesh_surface *s, uint32_t h);

/* Can the edge be turned in the quadrangle of its triangles? */
bool mesh_surface_may_flip(const mesh_surface *s, uint32_t h);
void mesh_surface_flip(mesh_surface *s, uint32_t h);

/* Renumbers without the removed ones, in their order. Fails: NOMEM. */
batten_status mesh_surface_compact(mesh_surface *s);

#endif
