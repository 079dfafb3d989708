/* What the fills of quintic networks share, and what the fair fill takes apart: ribbons from one end at a time, the
 * patch of degree 7 in two steps, the proof of regularity along an edge. */
#ifndef BATTEN_NETWORK_FILL_H
#define BATTEN_NETWORK_FILL_H

#include "network/net.h"

/* Ribbon whose curvature vector is fixed at neither, one or both ends: bend_i, bend_j [3] or NULL. */
void net_ribbon_join(const double *vi, const double *vj, const net_node *i, const net_node *j, const net_local *local,
                     const double *bend_i, const double *bend_j, net_ribbon *out);

/* Curvature vector of edge e at its start (end = 0) or end (1) if the curve is fixed there, else NULL. */
const double *net_edge_bend(const net_topology *t, uint32_t e, unsigned end);

/* Ribbon of the edge of half-edge h along it, with the field of its side. */
void net_half_ribbon(const net_topology *t, const net_node *nodes, const net_local *local, uint32_t h,
                     net_ribbon *out);

/* How the derivative across edge k of a facet is made: the derivative towards the third corner is, for a point of the
 * facet that moves with the edge's, k(t) d(t) + h(t) C'(t). Positive k is regularity as far as the edge goes. */
typedef struct net_across {
  double k[4]; /* Bernstein form, cubic */
  double h[2]; /* linear */
  double miss; /* by which the row beside the edge misses the corners' twists: rounding, unless the curves at a corner
                  have other curvatures than its form */
} net_across;

/* Patch of degree 7: the 33 control points that nodes and ribbons determine; the other three, b_322, b_232 and b_223
 * at NET_DEGREE7_INTERIOR, are left as they are. No branches on data: as smooth as the data are, NaN where the
 * construction is singular. across [3] may be NULL. */
void net_degree7_frame(const net_node *nodes, const net_ribbon *ribbons, double (*out)[3], net_across *across);
/* Their three for the fair fill to start from, by the least integral of S_xx^2 + 2 S_xy^2 + S_yy^2 over an
 * equilateral parameter triangle. (net_fill_degree7 takes fourth derivatives instead: fairer where nothing more is
 * done.) */
void net_degree7_interior(double (*net)[3]);
static const unsigned char NET_DEGREE7_INTERIOR[3] = {17, 18, 23};
/* The integers over 66 with which the 36 points count for b_322 (0 at the interior ones). Those for b_232 and b_223
 * are the same, one and two corners on. */
extern const signed char net_degree7_weights[36];

/* True when the normal of a facet is proven not to vanish along an edge: k of degree n is positive, by more than a
 * thousandth of its mean, and so is C' x d, turned to some direction, on each of a few pieces of the edge. */
bool net_across_regular(unsigned n, const double *k, const net_ribbon *ribbon);

#endif
