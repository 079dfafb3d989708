/* What a mesh is made of; for kernel/mesh, and the sorting of edges for kernel/network too. */
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

/* Between the same vertices, whichever way. corners [3 F]. */
static inline int mesh_is_same_edge(const uint32_t *corners, uint32_t g, uint32_t h) {
  uint32_t a = corners[g], b = corners[mesh_next(g)], c = corners[h], d = corners[mesh_next(h)];
  return (a == c && b == d) || (a == d && b == c);
}

/* What a mesh can be made of: INVALID (names triangle and index), TOO_LARGE. */
batten_status batten_mesh_check_arrays(batten_context *ctx, size_t vertex_count, const double *vertices,
                                       size_t triangle_count, const uint32_t *triangles);

/* out [count] = in sorted by key(triangles, item) < key_count, equal ones in their order; in NULL = 0, 1, ...
 * start [key_count + 1] is scratch. */
void batten_mesh_counting_sort(size_t key_count, size_t count, const uint32_t *triangles,
                               uint32_t (*key)(const uint32_t *, uint32_t), const uint32_t *in, uint32_t *start,
                               uint32_t *out);

/* order [3 F]: the half-edges sorted by their lower vertex, then the higher, then their number. Time O(V + F). */
batten_status batten_mesh_sort_edges(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                     const uint32_t *triangles, uint32_t *order);

/* kept [V]: the vertex that stands for each: itself, or the first one nearer than radius, or at the same place, that
 * stands for itself. So no vertex is further than radius from the one that it becomes, and which ones those are
 * depends on the vertices' order alone. Unused vertices (used[v] = 0; NULL: all are used) stand for themselves.
 * radius >= 0. Time O(V) in the mean, when not many vertices lie within a radius. */
batten_status batten_mesh_find_welds(batten_context *ctx, size_t vertex_count, const double *vertices,
                                     const unsigned char *used, double radius, uint32_t *kept);

/* The largest |coordinate|. */
double batten_mesh_size(size_t vertex_count, const double *vertices);

/* Whether the corners a b c lie on one line to the rounding of coordinates of the mesh's size: the triangle's height
 * over its longest side is below 4 units in the last place of the largest coordinate. */
typedef struct mesh_rounding {
  double unit, height; /* a power of two that brings coordinates to about 1; the bound in these units */
} mesh_rounding;
mesh_rounding batten_mesh_rounding(size_t vertex_count, const double *vertices);
int batten_mesh_is_degenerate(mesh_rounding rounding, const double *a, const double *b, const double *c);

/* marks [F]: MESH_GOOD, or the first reason that holds why a triangle is none. Of the same three corners, whichever
 * way round, the first triangle is good; first [F] tells the others which one that is. */
enum { MESH_GOOD = 0, MESH_REPEATED, MESH_STRAIGHT, MESH_DUPLICATE };
batten_status batten_mesh_mark_triangles(batten_context *ctx, size_t vertex_count, const double *vertices,
                                         size_t triangle_count, const uint32_t *triangles, unsigned char *marks,
                                         uint32_t *first);

batten_status batten_mesh_find_defects_of(batten_context *ctx, size_t vertex_count, const double *vertices,
                                          size_t triangle_count, const uint32_t *triangles, batten_mesh_defects *out);
/* Fails with the text of the first defect, in the order of the struct; there must be one. */
batten_status batten_mesh_fail_defects(batten_context *ctx, const batten_mesh_defects *defects);

/* Crossing pairs of triangles (see batten_mesh_self_intersections); marks [F] or NULL: set to 1 for triangles
 * that take part, else 0. */
batten_status batten_mesh_find_crossings(batten_context *ctx, size_t vertex_count, const double *vertices,
                                         size_t triangle_count, const uint32_t *triangles, unsigned char *marks,
                                         size_t *pairs);

#endif
