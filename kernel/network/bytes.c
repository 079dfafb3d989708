/* Memory of a build, foretold from the numbers of vertices and triangles. */
#include <math.h>

#include "fair.h"
#include "net.h"
#include "options.h"
#include "surface.h"

/* Doubles, since only the end must fit a size. */
typedef struct net_counts {
  double vertices, faces, edges;
} net_counts;

/* Every edge has two triangles but those at boundaries, of which a vertex begins one at most. */
static net_counts count(size_t vertices, size_t triangles) {
  double v = (double)vertices, f = (double)triangles;
  return (net_counts){v, f, fmin(3 * f, (3 * f + v) / 2)};
}

static double topology_bytes(const net_counts *c) { return 36 * c->faces + 32 * c->vertices + 5 * c->edges; }

/* A system of blocks with its pattern, right side and solution. */
static double system_bytes(const net_counts *c, double size) {
  double blocks = c->vertices + 2 * c->edges;
  return blocks * (8 * size * size + 8) + c->vertices * (16 + 16 * size) + 8 * c->edges;
}

/* Conjugate gradients: three vectors and the inverses of the diagonal. */
static double cg_bytes(const net_counts *c, double size) { return c->vertices * 8 * size * (3 + size); }

/* Cholesky by fronts after dissection leaves 7.5 N log2 N blocks, its work included, on pieces of surface of 1e3 to
 * 1e5 nodes (measured); and never more than the whole triangle, twice. */
static double direct_bytes(const net_counts *c, double size) {
  double v = c->vertices, dissected = 9 * v * log2(v + 2) + 100 * v / size, whole = v * v + v;
  return fmin(dissected, whole) * size * size * 8 + 256 * v;
}

static double solve_bytes(const net_counts *c, const batten_network_options *o, double size, double direct_below) {
  bool direct =
      o->solver == BATTEN_NETWORK_DIRECT || (o->solver == BATTEN_NETWORK_AUTO && c->vertices < direct_below);
  return system_bytes(c, size) + cg_bytes(c, size) + (direct ? direct_bytes(c, size) : 0);
}

static double fair_bytes(const net_counts *c) {
  double state = c->vertices * sizeof(net_node) + c->edges * sizeof(net_local) + c->faces * 81;
  double equations = c->faces * (sizeof(fair_equations) + FAIR_REDUCED * 8.0);
  double scratch = FAIR_PARTS_MAX * (double)sizeof(fair_scratch) + sizeof(fair_tables);
  return 2 * state + equations + scratch + c->vertices * (sizeof(fair_freedom) + 8 + 40) + system_bytes(c, 5) +
         direct_bytes(c, 5);
}

/* Whichever of the phases takes most, beside what they all keep. */
static double build_bytes(const net_counts *c, const batten_network_options *o, batten_network_fill fill,
                          double kept) {
  double common = 24 * c->vertices + topology_bytes(c) + 24 * c->vertices + c->edges * sizeof(net_local) + c->faces;
  double features = o->crease_angle_deg > 0 || o->crease_count || o->line_count || o->boundary_curves
                        ? c->edges * 120 + c->vertices * (sizeof(net_constraint) + 24.0)
                        : 48 * c->edges; /* guides of folds */
  bool fair = fill == BATTEN_FILL_FAIR || fill == BATTEN_FILL_FAIR_LINEAR, quintic = net_fill_continuity(fill) == 2;
  double nodes = quintic ? c->vertices * sizeof(net_node) : 0, forms = 24 * c->vertices + 160 * c->edges;
  double g1 = solve_bytes(c, o, 2, 0) + c->vertices * sizeof(net_node) +
              (o->functional == BATTEN_FUNCTIONAL_SIMPLE ? 0 : forms);
  double g2 = quintic ? solve_bytes(c, o, 5, NET_DIRECT_NODES) + 24 * c->vertices : 0;
  double fill_most = kept + (fair ? fair_bytes(c) : fill == BATTEN_FILL_PETERS ? 96 * c->faces : 0);
  return common + features + nodes + fmax(fmax(g1, g2), fill_most) + 65536;
}

batten_status batten_network_bytes(batten_context *ctx, size_t vertices, size_t triangles,
                                   const batten_network_options *opt, size_t *build, size_t *kept) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_network_options o;
  batten_status st = net_options_check(ctx, opt, &o);
  if (st < 0) return st;
  unsigned degree, parts;
  batten_network_fill fill = net_options_fill(&o, triangles);
  net_fill_degree(fill, &degree, &parts);
  net_counts c = count(vertices, triangles);
  size_t result = net_surface_bytes(vertices, triangles, o.crease_count, degree, parts, 0, 0);
  double most = build_bytes(&c, &o, fill, (double)result);
  if (result == SIZE_MAX || most > 0x1p62)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "vertices, triangles: %zu, %zu; too many to address", vertices,
                       triangles);
  if (build) *build = (size_t)most;
  if (kept) *kept = result;
  return BATTEN_OK;
}
