/* One facet of the fair fill: its control points from the data at its corners, and the derivative of that map.
 *
 * The map is that of the degree 7 fill, with the inner points where the least thin plate energy has them plus a
 * displacement. Curves and fields follow the normals: t is a function of the normals at both ends. For given normals
 * the map is affine in r, m, n, and a difference over any step is their derivative; central differences serve for p
 * and q, where the map's curvature is about 1 whatever the unit. */
#include <string.h>

#include "fair.h"

static const double TURN_STEP = 1e-5; /* radians: truncation and rounding are 1e-10 of the derivative then */

/* ---- the map ------------------------------------------------------------------------------------------ */

static void planes(const double (*points)[3], fair_net net) {
  for (unsigned p = 0; p < FAIR_NET; p++)
    for (unsigned x = 0; x < 3; x++) net[x][p] = points[p][x];
}

void fair_facet_net(const fair_facet *facet, fair_net net) {
  double points[FAIR_NET][3];
  net_degree7_frame(facet->corner, facet->ribbon, points, NULL);
  net_degree7_interior(points);
  for (unsigned i = 0; i < 3; i++)
    for (unsigned x = 0; x < 3; x++) points[NET_DEGREE7_INTERIOR[i]][x] += facet->inner[i][x];
  planes((const double(*)[3])points, net);
}

void fair_facet_axes(const fair_tables *tables, const fair_net net, double (*axes)[3][3]) {
  for (unsigned i = 0; i < 3; i++) {
    double s[2][3] = {{0}}, *n = axes[i][0];
    for (unsigned x = 0; x < 3; x++)
      for (unsigned p = 0; p < FAIR_NET; p++) {
        s[0][x] += tables->inner[i][0][p] * net[x][p];
        s[1][x] += tables->inner[i][1][p] * net[x][p];
      }
    vec_cross(s[0], s[1], n);
    net_node frame;
    if (!vec_normalize(n)) n[2] = 1;
    net_frame(n, s[0], &frame);
    memcpy(axes[i][1], frame.u, sizeof frame.u);
    memcpy(axes[i][2], frame.v, sizeof frame.v);
  }
}

/* ---- its derivative ------------------------------------------------------------------------------------- */

/* An edge of the facet in the direction in which its ribbon is made. */
typedef struct fair_side {
  unsigned from, to; /* corners */
  bool reversed;     /* the run is against the facet's */
  uint32_t edge;
  bool turned;     /* the run is against half[edge]: at creases */
  bool follows[2]; /* t follows the normals at this end: not where a crease has its own tangent */
  const double *vi, *vj, *bend_i, *bend_j;
  net_local local;
} fair_side;

static void side_make(const net_topology *t, const net_local *local, size_t face, unsigned k, fair_side *out) {
  uint32_t h = (uint32_t)(3 * face + k), e = t->edge[h];
  bool crease = t->kind[e] == NET_CREASE;
  uint32_t run = crease ? h : t->half[e];
  unsigned turned = run != t->half[e];
  out->reversed = run != h;
  out->from = out->reversed ? (k + 1) % 3 : k;
  out->to = out->reversed ? k : (k + 1) % 3;
  out->edge = e;
  out->turned = turned;
  out->vi = t->points + 3 * (size_t)t->triangles[run];
  out->vj = t->points + 3 * (size_t)t->triangles[net_next(run)];
  out->bend_i = net_edge_bend(t, e, turned);
  out->bend_j = net_edge_bend(t, e, !turned);
  for (unsigned end = 0; end < 2; end++) {
    unsigned from = turned ? !end : end;
    uint32_t node = t->node[end ? net_next(run) : run];
    out->follows[end] = !crease || !t->constraint || t->constraint[node].kind == NET_FREE;
    memcpy(out->local.t[end], local[e].t[from], sizeof out->local.t[end]);
    memcpy(out->local.s[end], local[e].s[from], sizeof out->local.s[end]);
  }
}

/* The ribbon for other nodes than those for which `local` was made. Where directions are by a substitute they stand
 * still: so rare that a step that is not the best will do. */
static void side_ribbon(const net_topology *t, const batten_network_options *opt, const fair_side *side,
                        const net_node *corner, bool linear, net_ribbon *out) {
  const net_node *i = &corner[side->from], *j = &corner[side->to];
  net_local local = side->local, moved;
  if (!linear) {
    const net_node *ends[2] = {side->turned ? j : i, side->turned ? i : j};
    bool substitute = net_tangent_between(t, opt, ends, NULL, side->edge, &moved);
    for (int end = 0; end < 2; end++)
      if (!substitute && side->follows[end])
        memcpy(local.t[end], moved.t[side->turned ? !end : end], sizeof local.t[end]);
  }
  net_ribbon_join(side->vi, side->vj, i, j, &local, side->bend_i, side->bend_j, out);
  if (side->reversed) net_ribbon_reverse(out, out);
}

/* Control points that nodes and ribbons determine, after a step at one corner. */
static void moved(const net_topology *t, const batten_network_options *opt, const fair_side *side,
                  const fair_facet *facet, unsigned corner, const double step[5], bool linear, double (*points)[3]) {
  net_node node[3];
  net_ribbon ribbon[3];
  memcpy(node, facet->corner, sizeof node);
  memcpy(ribbon, facet->ribbon, sizeof ribbon);
  if (linear)
    for (int k = 0; k < 5; k++) node[corner].x[k] += step[k];
  else
    fair_node_turn(&facet->corner[corner], step, &node[corner]);
  side_ribbon(t, opt, &side[corner], node, linear, &ribbon[corner]);
  side_ribbon(t, opt, &side[(corner + 2) % 3], node, linear, &ribbon[(corner + 2) % 3]);
  net_degree7_frame(node, ribbon, points, NULL);
}

/* The inner points follow the others by the least thin plate energy. */
static void inner_slopes(double (*slopes)[FAIR_LANES]) {
  double sum[3][FAIR_LANES] = {{0}};
  for (unsigned c = 0, p = 0; c <= 7; c++)
    for (unsigned b = 0; b + c <= 7; b++, p++) {
      double weight = net_degree7_weights[p] / 66.0;
      unsigned a = 7 - b - c;
      if (weight == 0) continue;
      const double *from[3] = {slopes[p], slopes[b * 8 - b * (b - 1) / 2 + a], slopes[a * 8 - a * (a - 1) / 2 + c]};
      for (unsigned i = 0; i < 3; i++)
        for (unsigned l = 0; l < FAIR_LANES; l++) sum[i][l] += weight * from[i][l];
    }
  for (unsigned i = 0; i < 3; i++) memcpy(slopes[NET_DEGREE7_INTERIOR[i]], sum[i], sizeof sum[i]);
}

void fair_facet_slopes(const net_topology *t, const batten_network_options *opt, const net_local *local, size_t face,
                       const fair_facet *facet, bool linear, fair_slopes slopes) {
  fair_side side[3];
  double ahead[FAIR_NET][3] = {{0}}, behind[FAIR_NET][3] = {{0}}, base[FAIR_NET][3] = {{0}}, length = 0;
  for (unsigned k = 0; k < 3; k++) {
    side_make(t, local, face, k, &side[k]);
    length += vec_distance(side[k].vi, side[k].vj) / 3;
  }
  memset(slopes, 0, sizeof(fair_slopes));
  net_degree7_frame(facet->corner, facet->ribbon, base, NULL);
  for (unsigned column = 0; column < FAIR_OUTER; column++) {
    unsigned which = column % 5;
    double step[5] = {0}, reach = which < 2 && !linear ? TURN_STEP : which < 2 ? 1 : 1 / length, scale = 1 / reach;
    step[which] = reach;
    moved(t, opt, side, facet, column / 5, step, linear, ahead);
    const double(*from)[3] = (const double(*)[3])base;
    if (which < 2 && !linear) {
      step[which] = -reach;
      moved(t, opt, side, facet, column / 5, step, linear, behind);
      from = (const double(*)[3])behind;
      scale = 0.5 / reach;
    }
    for (unsigned p = 0; p < FAIR_NET; p++)
      for (unsigned x = 0; x < 3; x++) slopes[x][p][column] = scale * (ahead[p][x] - from[p][x]);
  }
  for (unsigned x = 0; x < 3; x++) inner_slopes(slopes[x]);
}
