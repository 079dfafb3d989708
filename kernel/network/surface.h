/* The handle of a finished network: the mesh with its adjacency, and the patches' control points in one block.
 *
 * Patches are numbered in the order of the faces. A network whose faces have all the same number of patches, of one
 * degree, needs no tables: patch p belongs to face p / parts and has its points at p count(degree). Others carry the
 * four tables of struct batten_network. */
#ifndef BATTEN_NETWORK_SURFACE_H
#define BATTEN_NETWORK_SURFACE_H

#include <batten/network.h>
#include <stdbool.h>
#include <stdint.h>

#include "basis/triangular.h"
#include "network/net.h"

struct batten_network {
  batten_context *ctx;
  size_t vertex_count, face_count, patch_count, crease_count;
  double *vertices;       /* [V][3] */
  uint32_t *triangles;    /* [F][3] */
  uint32_t *creases;      /* [crease_count][2] */
  uint32_t *twin;         /* [3 F], NET_NONE at boundaries */
  unsigned char *sharp;   /* [F], bit k: half-edge k is a crease; NULL: none is */
  unsigned degree;        /* of all patches, or 0: tables */
  unsigned parts;         /* patches of all faces, 1 or 3 */
  double *points;         /* control points of all, or of most, patches */
  double *spare;          /* those of faces that were split later, or NULL */
  uint32_t *first;        /* [F + 1] first patch of a face */
  uint32_t *owner;        /* [P] face of a patch */
  unsigned char *degrees; /* [P] */
  double **where;         /* [P] control points */
};

/* A network of one degree (1 .. 12) with 1 or 3 patches a face, whose control points are for the caller to write (at
 * net_surface_points, also from worker threads). Indices and coordinates are copied, not checked; twin as in
 * net_topology, or NULL: found here. Fails: INVALID (edges of more than two triangles or passed the same way twice;
 * creases that are no edges), TOO_LARGE, NOMEM. */
batten_status net_surface_new(batten_context *ctx, size_t vertex_count, const double *vertices, size_t face_count,
                              const uint32_t *triangles, const uint32_t *twin, size_t crease_count,
                              const uint32_t *creases, unsigned degree, unsigned parts, batten_network **out);

/* Faces [count], ascending, of a network of net_surface_new with one patch a face get three patches of `degree`,
 * whose points are for the caller to write; all others keep theirs, but the patches' numbers change. Once for a
 * network. Fails: NOMEM, TOO_LARGE; the network is then as before. */
batten_status net_surface_split(batten_network *network, size_t count, const uint32_t *faces, unsigned degree);

/* Bytes that such a network keeps, SIZE_MAX when they cannot be counted; split_faces as in net_surface_split. */
size_t net_surface_bytes(size_t vertex_count, size_t face_count, size_t crease_count, unsigned degree, unsigned parts,
                         size_t split_faces, unsigned split_degree);

static inline unsigned net_surface_degree(const batten_network *n, size_t patch) {
  return n->degree ? n->degree : n->degrees[patch];
}
static inline double (*net_surface_points(const batten_network *n, size_t patch))[3] {
  double *at = n->degree ? n->points + patch * 3 * triangular_count(n->degree) : n->where[patch];
  return (double(*)[3])at;
}
static inline size_t net_surface_face(const batten_network *n, size_t patch) {
  return n->degree ? patch / n->parts : n->owner[patch];
}
static inline size_t net_surface_first(const batten_network *n, size_t face) {
  return n->degree ? face * n->parts : n->first[face];
}
static inline unsigned net_surface_parts(const batten_network *n, size_t face) {
  return n->degree ? n->parts : (unsigned)(n->first[face + 1] - n->first[face]);
}
/* 0 for the only patch of a face, else 1, 2, 3. */
static inline unsigned net_surface_part(const batten_network *n, size_t patch) {
  size_t face = net_surface_face(n, patch);
  return net_surface_parts(n, face) == 1 ? 0 : (unsigned)(patch - net_surface_first(n, face)) + 1;
}
static inline bool net_surface_sharp(const batten_network *n, uint32_t h) {
  return n->sharp && n->sharp[h / 3] >> h % 3 & 1;
}

/* An edge of a patch: side k runs from its corner k to corner (k + 1) % 3, the patch on its left. */
typedef struct net_side {
  size_t patch;
  unsigned side;
} net_side;

/* The side of a patch that is half-edge h of the mesh. */
static inline net_side net_surface_side(const batten_network *n, uint32_t h) {
  size_t first = net_surface_first(n, h / 3);
  unsigned k = h % 3;
  return net_surface_parts(n, h / 3) == 1 ? (net_side){first, k} : (net_side){first + k, 0};
}

/* Of a face of three patches the edge from corner k to the inner point: [0] runs that way, [1] comes back. */
static inline void net_surface_inner(const batten_network *n, size_t face, unsigned k, net_side sides[2]) {
  size_t first = net_surface_first(n, face);
  sides[0] = (net_side){first + (k + 2) % 3, 1};
  sides[1] = (net_side){first + k, 2};
}

/* Index of point s (0 .. n - row) of the row that is `row` away from a side, counted along the side's run. */
static inline size_t net_side_index(unsigned n, unsigned side, unsigned row, unsigned s) {
  unsigned rest = n - row - s;
  return side == 0   ? triangular_index(n, s, row)
         : side == 1 ? triangular_index(n, rest, s)
                     : triangular_index(n, row, rest);
}

/* The place on a patch at t along a side. */
static inline void net_side_place(unsigned side, double t, double uv[2]) {
  uv[0] = side == 0 ? t : side == 1 ? 1 - t : 0;
  uv[1] = side == 0 ? 0 : side == 1 ? t : 1 - t;
}

#endif
