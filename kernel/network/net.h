/* Minimum norm networks: what the parts of kernel/network share. The map of the folder:
 *
 *   network.c    the public call as a list of phases; options.c: what may be asked; figures
 *   topology.c   half-edges, edges, fans, nodes (one tangent plane each: a vertex, or a sector between creases);
 *                checks that name what is wrong
 *   bytes.c      the memory that a build will take
 *   features.c   creases, corners, boundary curves, polylines: fixed directions and curvatures; corners.c: what
 *                creases without a common tangent ask of the sectors between them; folds.c: edges out of order
 *   normals.c    estimated normals at the nodes; node.c: frames, and what constraints leave free
 *   tangent.c    D1, D2 and L1 .. L4: the local parameters t, s of an edge; curvature estimate
 *   g1.c         the 2N system and its iteration
 *   g2.c         the 5N system; ribbon.c: curve and cross field of an edge from the data at its ends
 *   fill_*.c     one facet each: raw arrays in, control points out; facet.c gathers what they need
 *   fair.c       the fair fill and its linear variant; fair_*.c
 *   surface.c    the handle; evaluate.c, tessellate.c, closest.c, measure.c, continuity.c, lines.c: know nothing of
 *                all above but the handle. For them: basis/shape.c, normal and curvatures; regular.c,
 *                proofs that a normal vanishes nowhere; box.c, the box of the whole;
 *                pattern.c, triangles between edges of unlike density
 *
 * Below network.c coordinates are scaled by a power of two, and shifted, so that the mesh's size is about 1:
 * constants may say so. Numerics take raw arrays and run on worker threads: no allocation, no context.
 *
 * Half-edge h = 3 f + k runs from corner k of face f to corner (k + 1) % 3, the face on its left. "Outgoing" data t,
 * s, T, S of an edge at an end belong to the curve run away from that end. Curvature (II) is positive where the
 * surface bends towards the normal: n . C'' = II(T, T); a sphere with outward normal has II = -1/R. */
#ifndef BATTEN_NETWORK_NET_H
#define BATTEN_NETWORK_NET_H

#include <batten/network.h>
#include <stdbool.h>
#include <stdint.h>

#include "mesh/vec.h"

#define NET_NONE UINT32_MAX

static inline uint32_t net_next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
static inline uint32_t net_prev(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

typedef enum net_edge_kind {
  NET_SMOOTH = 0, /* normals agree across it */
  NET_CREASE,     /* two sides with tangent planes of their own; one side where a boundary is a curve of its own. The
                     curve is fixed at its ends where the nodes are not free */
  NET_BOUNDARY    /* one side, curve as free as a smooth edge's */
} net_edge_kind;

/* What holds a node's data x = (p, q, r, m, n) in its frame. */
typedef enum net_node_kind {
  NET_FREE = 0, /* five unknowns */
  NET_CREASED,  /* a crease passes with unit tangent d[0] and curvature vector k[0]: the normal is orthogonal to d[0],
                   II(d0, d0) = k0 . n */
  NET_CORNER    /* the sector between two creases with tangents d[0], d[1] at an angle: the normal is d[0] x d[1]
                   up to length, sign as the triangles have it; II(d0, d0) = k0 . n, II(d1, d1) = k1 . n */
} net_node_kind;
typedef struct net_constraint {
  net_node_kind kind;
  double d[2][3], k[2][3];
} net_constraint;

typedef struct net_topology {
  size_t vertices, faces, edges, nodes;
  const double *points;      /* [vertices][3]; caller's */
  const uint32_t *triangles; /* [faces][3]; caller's */
  uint32_t *twin;            /* [3 faces], NET_NONE at boundaries */
  uint32_t *edge;            /* [3 faces] */
  uint32_t *half;            /* [edges] the lowest numbered of its half-edges: the curve runs along it */
  unsigned char *kind;       /* [edges] net_edge_kind */
  uint32_t *node;            /* [3 faces] node of the face's corner at which the half-edge starts */
  uint32_t *node_vertex;     /* [nodes] */
  uint32_t *node_first; /* [nodes] outgoing half-edge with which the node's fan begins: counter-clockwise the fan goes
                           on with twin[prev(h)], to its end at a boundary or crease or once around */
  double *guide;        /* [edges][2][3] or NULL: vectors along which the curve must leave start (0) and end (1),
                           outgoing, before projection into the tangent plane; 0 0 0 = free */
  double *bend;         /* [edges][2][3] or NULL: curvature vectors of curves that are fixed (crease edges at ends
                           that are not free), orthogonal to guide */
  net_constraint *constraint;                      /* [nodes] or NULL: all free */
  size_t boundary_edges, crease_edges, line_edges; /* crease_edges: all of kind NET_CREASE */
} net_topology;

/* points and triangles as in a mesh; stay the caller's. Checks: INVALID with vertex, edge and triangle numbers. No
 * features yet: one node for each vertex in use, numbered as the vertices; edges numbered by their lowest half-edge.
 */
batten_status net_topology_make(batten_context *ctx, size_t vertices, const double *points, size_t faces,
                                const uint32_t *triangles, net_topology *out);
/* Creases, corners, boundary curves and lines of opt: kinds, nodes, guides (unit vectors), bends, constraints.
 * INVALID: pairs that are no edges, lines that do not run along edges, ...; the topology is then good for
 * net_topology_free alone. The half-edges out of a vertex that have the same node are its fan, from node_first on;
 * one crease that ends inside the mesh does not cut it, and the fan then begins there. */
batten_status net_features_make(batten_context *ctx, const batten_network_options *opt, net_topology *topology);
/* Guides at nodes that are folded, and in sectors whose edges are out of order: see folds.c. */
batten_status net_folds_make(batten_context *ctx, net_topology *topology);
void net_topology_free(batten_context *ctx, net_topology *topology);

/* Node at the start (end = 0) or end (1) of edge e, seen from its left (side = 0, the side of half[e]) or right side
 * (1; NET_NONE at boundaries). On smooth edges both sides have the same. */
static inline uint32_t net_edge_node(const net_topology *t, uint32_t e, unsigned end, unsigned side) {
  uint32_t h = t->half[e];
  if (side) {
    h = t->twin[h];
    if (h == NET_NONE) return NET_NONE;
    end = !end;
  }
  return t->node[end ? net_next(h) : h];
}

/* ---- nodes and edges ------------------------------------------------------------------------------ */

/* A node's frame, orthonormal, v = w x u, and surface data in it: to second order the surface is
 * p u + q v + (r u^2 + 2 m u v + n v^2) / 2 over the plane of u and v. Nodes of NET_CREASED have u along d[0]. */
typedef struct net_node {
  double u[3], v[3], w[3];
  double x[5]; /* p, q, r, m, n */
} net_node;

/* Orthonormal frame with third axis w (unit), smooth in nothing; u along `along` when that is given. */
void net_frame(const double w[3], const double *along, net_node *out);

/* x = origin + columns y, columns [5][*dof] (row-major, 5 a row): what the constraint leaves free, to first order in
 * p, q. FREE: identity, 5. */
void net_node_freedom(const net_constraint *c, const net_node *node, double origin[5], double columns[5][5],
                      unsigned *dof);

/* Normals at the nodes [nodes][3] by opt->normals or normals_given; CREASED and CORNER ones keep to their constraint.
 */
batten_status net_normals_make(batten_context *ctx, const net_topology *t, const batten_network_options *opt,
                               double *normals);

/* Second fundamental form (r, m, n) in the node's frame by least squares from the neighbours [Moreton, Sequin 1992].
 */
void net_curvature_estimate(const net_topology *t, uint32_t node, const net_node *frame, double form[3]);

/* Local parameters of one edge: chord E from i to j, unit normals at the ends; t[0] outgoing at i, t[1] outgoing at
 * j, both in the tangent planes there; s likewise (0 but for L4). guide [2][3] or NULL; curvature [2]: normal
 * curvatures along the curve at the ends for L3, L4, NULL = L2 is taken. fallback [2][3]: directions that are taken
 * when the chord is along the normal. True when a substitute had to be taken. */
typedef struct net_local {
  double t[2][3], s[2][3];
} net_local;
bool net_tangent(batten_network_direction direction, batten_network_length length, const double chord[3],
                 const double normal_i[3], const double normal_j[3], const double (*guide)[3],
                 const double *curvature, const double (*fallback)[3], net_local *out);
/* The same for edge e of a network with these frames (and forms [nodes][3] for L3, L4, else NULL), on its left or
 * right side; creases have the same t on both sides. Tangents of smooth edges keep to a share of the angles between
 * the projections of their neighbours, so that they are in the order of the edges where those are. */
bool net_tangent_edge(const net_topology *t, const batten_network_options *opt, const net_node *nodes,
                      const double *forms, uint32_t e, net_local *out);
/* ... with the nodes at the start and the end of half[e], and their forms [2] or NULL. */
bool net_tangent_between(const net_topology *t, const batten_network_options *opt, const net_node *const ends[2],
                         const double *const *forms, uint32_t e, net_local *out);

/* ---- G1: cubics ----------------------------------------------------------------------------------- */

typedef struct net_figures {
  unsigned normal_passes;
  double normal_change;
  size_t cg_iterations, unknowns, clamped;
  double residual, energy, energy_start;
  unsigned fairing_passes;
} net_figures;

/* Optimises normals [nodes][3] in place; local [edges]: t of the last frames, so that the cubic of edge e is
 * V_i, V_i + t0/3, V_j + t1/3, V_j. Progress "normals". */
batten_status net_g1(batten_context *ctx, const net_topology *t, const batten_network_options *opt, double *normals,
                     net_local *local, net_figures *figures);

/* ---- G2: quintics --------------------------------------------------------------------------------- */

/* Curve of an edge and the cross field of one side of it, in Bezier form, the field pointing to the left of the run.
 */
typedef struct net_ribbon {
  double c[6][3];
  double d[4][3];
} net_ribbon;
/* From the data at the two nodes (x included) and the local parameters. bend [2][3] or NULL: fixed curvature vectors
 * (creases), which replace the forms in the curve; the field of creases is that of the side to which the nodes
 * belong. */
void net_ribbon_make(const double *vi, const double *vj, const net_node *i, const net_node *j, const net_local *local,
                     const double (*bend)[3], net_ribbon *out);
void net_ribbon_reverse(const net_ribbon *in, net_ribbon *out); /* run the other way, the field to its left again:
                                                                   the other side of a smooth edge */

/* Systems of fewer nodes are solved by Cholesky where the choice is ours. */
enum { NET_DIRECT_NODES = 2000 };

/* One linear solve: nodes [nodes] get frames (from normals) and x. local [edges] as used. Progress "network". */
batten_status net_g2(batten_context *ctx, const net_topology *t, const batten_network_options *opt,
                     const double *normals, net_node *nodes, net_local *local, net_figures *figures);

/* ---- fills: one facet, corners 0 1 2 counter-clockwise ---------------------------------------------- */

/* Cubic edges [3][4][3] (edge k from corner k to k + 1), unit normals [3][3] -> three quartics [3][15][3] in the
 * order of the parts. curves of neighbours must be the same points. True when a substitute was taken. */
bool net_fill_ss(bool classic, const double (*edges)[4][3], const double (*normals)[3], double (*out)[15][3]);
/* PN triangle [10][3] from corners and normals alone. */
void net_fill_pn(const double (*corners)[3], const double (*normals)[3], double (*out)[3]);

/* Degree 7 from ribbons [3] (edge k from corner k to k + 1, fields inward) and the nodes at the corners [3]:
 * out [36][3]. False: singular or not proven regular on its boundary; out is then written all the same. */
bool net_fill_degree7(const net_node *nodes, const net_ribbon *ribbons, double (*out)[3]);
/* Three of degree 6, [3][28][3], from the same. */
bool net_fill_degree6(const net_node *nodes, const net_ribbon *ribbons, double (*out)[28][3]);

/* Peters' single quintics: needs twists around every node first, so whole networks at a time: out [faces][21][3].
 * forms: least squares per node from the cubics. */
batten_status net_fill_peters(batten_context *ctx, const net_topology *t, const double *normals,
                              const net_local *local, double (*out)[21][3]);

/* The fair fill: nodes in: frames and x to start from; out: final. out [faces][36][3]: all patches, interior points
 * included. linear: the variant with frozen coefficients. Progress "fair". */
batten_status net_fair(batten_context *ctx, const net_topology *t, const batten_network_options *opt, bool linear,
                       net_node *nodes, double (*out)[36][3], net_figures *figures);

/* Data of face f gathered for the fills of quintic networks, t by opt from the nodes' frames or as given in local. */
void net_facet_ribbons(const net_topology *t, const net_node *nodes, const net_local *local, size_t face,
                       net_node corner[3], net_ribbon ribbon[3]);
/* ... and of cubic networks. */
void net_facet_cubics(const net_topology *t, const double *normals, const net_local *local, size_t face,
                      double edges[3][4][3], double normal[3][3]);

#endif
