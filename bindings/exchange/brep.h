/* The boundary representation of a network: which edges its faces share, what is closed, what lies in what. */
#ifndef BATTEN_EXCHANGE_BREP_H
#define BATTEN_EXCHANGE_BREP_H

#include "patch_square.h"

#include <batten/exchange.h>
#include <stdbool.h>
#include <stdint.h>

#define BX_NONE UINT32_MAX

typedef struct bx_component {
  bool closed;
  bool inward;               /* closed, and its triangles are clockwise seen from outside of it */
  uint32_t parent;           /* closed components inside of others: the solid whose void this one is. Else BX_NONE */
  uint32_t first, faces;     /* its triangles: sorted [first .. first + faces) */
  uint32_t joints;           /* edges between two of them */
  uint32_t vertex;           /* one of its vertices */
  double volume;             /* of a tessellation, signed as the triangles say */
  double lower[3], upper[3]; /* of the control points */
} bx_component;

typedef struct bx_brep {
  const batten_network *network;
  size_t face_count, edge_count, component_count;
  uint32_t *edge;      /* [3 faces] of half-edge 3 f + k, from corner k of triangle f to the next */
  uint32_t *half;      /* [edges] half-edge along which the edge runs */
  uint32_t *component; /* [faces], numbered by their first face */
  uint32_t *sorted;    /* [faces] by component */
  bx_component *components;
  double size;  /* diagonal of the vertices' box */
  double reach; /* largest coordinate of a vertex */
} bx_brep;

/* Joints are checked to 1e-9 of the size: INVALID names the triangles. Edges of more than two triangles, or passed
 * the same way by both of theirs, are not joined: their triangles bound nothing. */
batten_status bx_brep_make(batten_context *ctx, const batten_network *network, bx_brep *out);
void bx_brep_free(batten_context *ctx, bx_brep *b);

/* The patch that has side k of a face, and which of its sides that is. */
batten_network_patch bx_brep_side(const bx_brep *b, uint32_t half_edge, unsigned *side);

/* What is left of raising and lowering a curve's degree by rounding. */
double bx_brep_rounding(const bx_brep *b);

/* Curve of an edge in the degree that it really has, [<= BX_DEGREE_MAX + 1]; returns the degree. */
unsigned bx_brep_curve(const bx_brep *b, size_t edge, double (*points)[3]);
/* The same for any side of a patch. */
unsigned bx_patch_curve(const bx_brep *b, const batten_network_patch *patch, unsigned side, double (*points)[3]);

#endif
