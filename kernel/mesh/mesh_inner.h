/* What a mesh is made of; for kernel/mesh only. */
#ifndef BATTEN_MESH_INNER_H
#define BATTEN_MESH_INNER_H

#include <batten/mesh.h>

typedef struct mesh_field {
  size_t components;
  double *values; /* [V][components], then the name */
  const char *name;
} mesh_field;

struct batten_mesh {
  batten_context *ctx;
  size_t vertex_count, triangle_count;
  double *vertices;    /* [V][3] */
  uint32_t *triangles; /* [F][3] */
  size_t field_count;
  mesh_field *fields;
};

/* Half-edge 3 t + k runs from corner k of triangle t to corner k + 1; 3 F stays below this. */
#define MESH_NONE UINT32_MAX

static inline uint32_t mesh_next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
static inline uint32_t mesh_previous(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

/* order [3 F]: the half-edges sorted by their lower vertex, then the higher, then their number. Time O(V + F). */
batten_status batten_mesh_sort_edges(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                     const uint32_t *triangles, uint32_t *order);

/* Crossing pairs of triangles (see batten_mesh_self_intersections); marks [F] or NULL: set to 1 for triangles
 * that take part, else 0. */
batten_status batten_mesh_find_crossings(batten_context *ctx, size_t vertex_count, const double *vertices,
                                         size_t triangle_count, const uint32_t *triangles, unsigned char *marks,
                                         size_t *pairs);

#endif
