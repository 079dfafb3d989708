/* The fair fill: what its files share.
 *
 *   fair.c           the iteration
 *   fair_node.c      tangent planes and curvatures move: frames turn with their normals, constraints hold
 *   fair_facet.c     from the nodes to the control points of one facet, and the derivative of that map
 *   fair_residual.c  from the control points to grad II at the quadrature points, and its derivative
 *   fair_assemble.c  a facet's equations, without its inner unknowns, to the system of all nodes and back
 *
 * Nets are planes here, [3][36]: inner loops run over the control points. */
#ifndef BATTEN_NETWORK_FAIR_H
#define BATTEN_NETWORK_FAIR_H

#include "network/fill.h"
#include "sparse/block.h"

enum {
  FAIR_POINTS = 16,    /* of quadrature, on a facet */
  FAIR_FIELDS = 9,     /* S_u, S_v, S_uu, S_uv, S_vv, S_uuu, S_uuv, S_uvv, S_vvv */
  FAIR_PARTS_MAX = 64, /* of a loop: none uses more threads */
  FAIR_NET = 36,       /* control points of degree 7 */
  FAIR_ROWS = 4,       /* residuals at a point */
  FAIR_INNER = 9,      /* unknown displacements of a facet's three inner control points */
  FAIR_OUTER = 15,     /* and five at each corner */
  FAIR_UNKNOWNS = FAIR_INNER + FAIR_OUTER,
  FAIR_LANES = 16, /* columns of the derivative by the corners, padded */
  FAIR_PACKED = (FAIR_UNKNOWNS + 1) * (FAIR_UNKNOWNS + 2) / 2,
  FAIR_REDUCED = FAIR_OUTER * (FAIR_OUTER + 1) / 2 + FAIR_OUTER
};

/* ---- grad II (fair_residual.c) ---------------------------------------------------------------------- */

/* Constants of degree 7: basis and quadrature. */
typedef struct fair_tables {
  double weight[FAIR_POINTS];                          /* of the triangle of area 1/2 */
  double jets[FAIR_POINTS][FAIR_FIELDS][FAIR_NET];     /* derivatives of the basis */
  double nets[FAIR_POINTS][FAIR_NET][FAIR_FIELDS + 1]; /* the same the other way round, for sums over the net */
  double inner[3][2][FAIR_NET];                        /* first derivatives above the inner control points */
} fair_tables;
void fair_tables_make(fair_tables *out);

/* A net of degree 7, and a row of derivatives by it, as planes x, y, z. */
typedef double fair_net[3][FAIR_NET];

/* What a derivative of the residuals holds still. */
typedef enum fair_model {
  FAIR_LINEAR, /* normal, connection, metric: the residuals are linear functions of the net then */
  FAIR_FROZEN, /* metric and frame: their change is small where the residuals are, and without it the first steps
                  from afar are better */
  FAIR_FULL    /* nothing: the gradient is exact, which residuals that stay large ask for */
} fair_model;

/* Residuals of a net at point g; their squares add up, over the points, to the integral of |grad II|^2. rows: NULL or
 * [FAIR_ROWS] derivatives by the net. normal (may be NULL): S_u x S_v. Where that vanishes, residuals and rows are 0.
 */
void fair_residual(const fair_tables *tables, const fair_net net, unsigned g, fair_model model,
                   double residual[FAIR_ROWS], fair_net *rows, double normal[3]);

/* The integral over a patch of degree 7 [36][3]. Needs no tables: for figures of finished patches. */
double fair_patch_energy(const double (*patch)[3]);

/* ---- one facet (fair_facet.c) ------------------------------------------------------------------------- */

typedef struct fair_facet {
  net_node corner[3];
  net_ribbon ribbon[3];
  double inner[3][3]; /* displacements of the inner control points from those of least thin plate energy */
} fair_facet;

/* The facet's net. */
void fair_facet_net(const fair_facet *facet, fair_net net);

/* Derivatives of the net by p, q, r, m, n of the three corners, columns 5 * corner + which; the last lane is 0.
 * Normals turn their frames, and the curves follow the normals; linear: frames and tangents stand still. */
typedef double fair_slopes[3][FAIR_NET][FAIR_LANES];
void fair_facet_slopes(const net_topology *t, const batten_network_options *opt, const net_local *local, size_t face,
                       const fair_facet *facet, bool linear, fair_slopes slopes);

/* Axes along which the inner points move: the normal of the patch, and two tangents. */
void fair_facet_axes(const fair_tables *tables, const fair_net net, double (*axes)[3][3]);

/* ---- nodes (fair_node.c) ------------------------------------------------------------------------------ */

/* The node after a step: turned to the normal w - p u - q v by the least rotation, its p, q then 0. */
void fair_node_turn(const net_node *node, const double step[5], net_node *out);
/* The same surface to second order, seen from its own tangent plane. */
void fair_node_upright(const net_node *node, net_node *out);
/* Onto what the constraint allows, the normal staying. c may be NULL. */
void fair_node_constrain(const net_constraint *c, net_node *node);

/* ---- equations (fair_assemble.c) ---------------------------------------------------------------------- */

/* Of a facet: the products of all columns of its Jacobian (inner unknowns, then those of the corners) and its
 * residuals as the last column, upper triangle by rows. */
typedef struct fair_equations {
  double products[FAIR_PACKED];
  double axes[3][3][3];
  double tie;
  double slid[3][2]; /* displacements of the inner points along the surface, from before */
} fair_equations;

/* What a task works on. */
typedef struct fair_scratch {
  fair_slopes slopes;
  fair_net net, rows[FAIR_ROWS];
  double points[FAIR_NET][3];
  double columns[FAIR_ROWS][FAIR_UNKNOWNS + 2], products[FAIR_UNKNOWNS + 1][FAIR_UNKNOWNS + 2];
} fair_scratch;

/* From scratch->slopes, scratch->net and out->axes. inner: displacements up to now. */
void fair_equations_make(const fair_tables *tables, fair_model model, const double (*inner)[3], fair_scratch *scratch,
                         fair_equations *out);

/* What the ties that hold the inner points against sliding along the surface add to the facet's energy. */
double fair_equations_ties(const fair_equations *equations, const double (*inner)[3]);

/* Equations of the corners alone: upper triangle by rows, then the right side. damping: of the inner unknowns, and of
 * those at the corners. All are relative to the diagonal. */
void fair_equations_reduce(const fair_equations *equations, double damping, const double corner_damping[3],
                           fair_scratch *scratch, double *reduced);
/* Steps of the inner control points from those of the corners. */
void fair_equations_inner(const fair_equations *equations, double damping, const double *corner_step,
                          fair_scratch *scratch, double (*step)[3]);

/* Adds up the facets' equations [faces][FAIR_REDUCED] in their order. freedom [nodes]: see fair_freedom; rows without
 * unknown become the identity. */
typedef struct fair_freedom {
  double columns[5][5];
  unsigned dof;
} fair_freedom;
void fair_assemble(const net_topology *t, const fair_freedom *freedom, const double *reduced, block_matrix *matrix,
                   double *right);

#endif
