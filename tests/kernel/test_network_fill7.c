/* Patches of degree 7: joints, the least integral inside, invariances, refusals. */
#include "network_rig.h"

#include "basis/triangular.h"

static batten_context *ctx;

/* Whatever the nodes' data, the joints hold: the field and the curve decide, not how they were found. */
static void joints(void) {
  const struct {
    const char *name;
    scene_mesh mesh;
  } all[] = {{"octahedron", scene_mesh_octahedron()},
             {"shifted octahedron", scene_mesh_octahedron_shifted(.5, .3)},
             {"tetrahedron", scene_mesh_tetrahedron()},
             {"sphere 42", scene_mesh_icosphere(2)},
             {"torus", scene_mesh_torus_10_6()},
             {"graph", scene_mesh_graph_7()},
             {"ears", scene_mesh_ears(4)},
             {"noisy sphere", scene_mesh_sphere_noisy()}};
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
    network_rig r;
    rig_open(ctx, all[i].mesh, NULL, NULL, &r);
    rig_nodes_random(&r, 0.3, 7 + i);
    joint_figures j = rig_fill(&r, RIG_7, 21);
    T_RATIO(j.angle_deg, 1e-11, "%s: normals at joints, degrees", all[i].name);
    T_RATIO(j.gap, 1e-14, "%s: gap", all[i].name);
    T_CHECK(r.refused == 0 && j.jacobian > 0.1, "%s: all %zu regular, least normal %.3g", all[i].name,
            r.topology.faces, j.jacobian);
    rig_close(&r);
  }
}

/* Gauss's rule for degree 11. */
static const double places[6] = {0.0337652428984240, 0.1693953067668678, 0.3806904069584015,
                                 0.6193095930415985, 0.8306046932331322, 0.9662347571015760};
static const double weights[6] = {0.0856622461895852, 0.1803807865240693, 0.2339569672863455,
                                  0.2339569672863455, 0.1803807865240693, 0.0856622461895852};

/* Derivative of a net of degree n along x (axis 0) or y (axis 1) of the equilateral triangle with corners (0, 0),
 * (1, 0), (1/2, sqrt(3) / 2): S_x = S_u, S_y = (2 S_v - S_u) / sqrt(3). In place, degree n - 1. */
static void differentiate(unsigned n, unsigned axis, double (*net)[3]) {
  for (unsigned k = 0, to = 0; k < n; k++)
    for (unsigned j = 0; j + k < n; j++, to++)
      for (int x = 0; x < 3; x++) {
        double a = net[triangular_index(n, j, k)][x], du = n * (net[triangular_index(n, j + 1, k)][x] - a);
        double dv = n * (net[triangular_index(n, j, k + 1)][x] - a);
        net[to][x] = axis ? (2 * dv - du) / sqrt(3) : du;
      }
}

/* Integral over the triangle, to a constant, of the products of all derivatives of an order of two nets, a vector. */
static void product(unsigned order, const double (*a)[3], const double (*b)[3], double *out) {
  double binomial = 1;
  memset(out, 0, 3 * sizeof *out);
  for (unsigned ys = 0; ys <= order; ys++) {
    double net[2][36][3];
    memcpy(net[0], a, sizeof net[0]);
    memcpy(net[1], b, sizeof net[1]);
    for (unsigned i = 0; i < order; i++)
      for (int s = 0; s < 2; s++) differentiate(7 - i, i < ys, net[s]);
    for (int i = 0; i < 6; i++)
      for (int j = 0; j < 6; j++) {
        double u = places[i], v = places[j] * (1 - u), value[2][1][3];
        for (int s = 0; s < 2; s++) triangular_jet(7 - order, (const double(*)[3])net[s], u, v, 0, value[s]);
        for (int x = 0; x < 3; x++)
          out[x] += binomial * weights[i] * weights[j] * (1 - u) * value[0][0][x] * value[1][0][x];
      }
    binomial = binomial * (order - ys) / (ys + 1);
  }
}

/* The largest derivative of the integral by an interior point, over the integral. */
static double slope(unsigned order, const double (*net)[3]) {
  double size[3], first[3], worst = 0, sum = 0;
  product(order, net, net, size);
  for (int x = 0; x < 3; x++) sum += size[x];
  for (int i = 0; i < 3; i++) {
    double unit[36][3] = {{0}};
    for (int x = 0; x < 3; x++) unit[NET_DEGREE7_INTERIOR[i]][x] = 1;
    product(order, net, (const double(*)[3])unit, first);
    for (int x = 0; x < 3; x++) worst = fmax(worst, fabs(first[x]));
  }
  return worst / sum;
}

static void interior_is_least(void) {
  network_rig r;
  double net[36][3];
  rig_open(ctx, scene_mesh_octahedron_shifted(.5, .3), NULL, NULL, &r);
  rig_nodes_random(&r, 0.3, 3);
  rig_fill(&r, RIG_7, 3);
  memcpy(net, r.single[2], sizeof net);
  T_RATIO(slope(4, (const double(*)[3])net), 1e-13, "the fill's interior: least fourth derivatives");
  net[17][0] = NAN; /* what is at the interior places does not matter */
  net_degree7_interior(net);
  T_RATIO(slope(2, (const double(*)[3])net), 1e-13, "the fair fill's interior: least second derivatives");
  int sum = 0;
  for (int i = 0; i < 36; i++) sum += net_degree7_weights[i];
  T_CHECK(sum == 66, "weights of %d / 66 keep what is added to all points", sum);
  rig_close(&r);
}

/* Turning the corners turns the net. */
static void corners_turn(void) {
  network_rig r;
  rig_open(ctx, scene_mesh_octahedron_shifted(.5, .3), NULL, NULL, &r);
  rig_nodes_random(&r, 0.3, 4);
  net_node node[3], node_b[3];
  net_ribbon ribbon[3], ribbon_b[3], back;
  double net[36][3], net_b[36][3], worst = 0;
  net_facet_ribbons(&r.topology, r.nodes, r.local, 0, node, ribbon);
  for (int k = 0; k < 3; k++) {
    node_b[k] = node[(k + 1) % 3];
    ribbon_b[k] = ribbon[(k + 1) % 3];
  }
  T_CHECK(net_fill_degree7(node, ribbon, net) && net_fill_degree7(node_b, ribbon_b, net_b), "a facet");
  for (unsigned c = 0; c <= 7; c++)
    for (unsigned b = 0; b + c <= 7; b++)
      for (int x = 0; x < 3; x++)
        worst = fmax(worst, fabs(net[triangular_index(7, b, c)][x] - net_b[triangular_index(7, c, 7 - b - c)][x]));
  T_RATIO(worst, 1e-14, "corners in turn");
  net_ribbon_reverse(&ribbon[0], &back);
  net_ribbon_reverse(&back, &back);
  T_CHECK(!memcmp(&back, &ribbon[0], sizeof back), "reversed twice is the same");
  rig_close(&r);
}

/* A flat facet stays flat and has the straight lines' parameters: all points of the net where a plane's are. */
static void plane(void) {
  network_rig r;
  rig_open(ctx, scene_mesh_plane(3), NULL, NULL, &r);
  rig_nodes_random(&r, 0, 1);
  rig_fill(&r, RIG_7, 3);
  double worst = 0;
  for (size_t f = 0; f < r.topology.faces; f++)
    for (unsigned c = 0; c <= 7; c++)
      for (unsigned b = 0; b + c <= 7; b++)
        for (int x = 0; x < 3; x++) {
          const uint32_t *v = r.mesh.corners + 3 * f;
          double sum = 0, part[3] = {(7. - b - c) / 7, b / 7., c / 7.};
          for (int k = 0; k < 3; k++) sum += part[k] * r.mesh.points[3 * v[k] + (unsigned)x];
          worst = fmax(worst, fabs(sum - r.single[f][triangular_index(7, b, c)][x]));
        }
  T_RATIO(worst, 1e-14, "a plane's facets have the control points of the plane");
  rig_close(&r);
}

/* k that turns negative, and a field along the curve: refused, though written. */
static void refusals(void) {
  net_ribbon ribbon = {{{0, 0, 0}, {.2, 0, 0}, {.4, 0, 0}, {.6, 0, 0}, {.8, 0, 0}, {1, 0, 0}},
                       {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}}};
  const double good[4] = {1, 1, 1, 1}, dips[4] = {1, -.2, -.2, 1}, bad[4] = {1, -1, -1, 1}, none[4] = {0};
  const double nan[4] = {1, NAN, 1, 1};
  T_CHECK(net_across_regular(3, good, &ribbon), "straight");
  T_CHECK(net_across_regular(3, dips, &ribbon), "coefficients below 0, but not the polynomial: proven on parts");
  T_CHECK(!net_across_regular(3, bad, &ribbon), "below 0 in the middle");
  T_CHECK(!net_across_regular(3, none, &ribbon) && !net_across_regular(3, nan, &ribbon), "0 and NaN");
  T_CHECK(!net_across_regular(1, dips, &ribbon), "linear: below 0 at the end");
  for (int k = 1; k < 3; k++) {
    ribbon.d[k][0] = 5;
    ribbon.d[k][1] = -1.2;
  }
  T_CHECK(!net_across_regular(3, good, &ribbon), "the field turns to the other side of the curve");
}

/* Curves that leave with speeds of all sizes: k turns negative in facets, and those alone take degree 6. */
static void falls_back(void) {
  for (int i = 0; i < 3; i++) {
    const char *name = i == 0 ? "shifted octahedron" : i == 1 ? "torus" : "graph";
    network_rig r;
    uint64_t seed = 5;
    rig_open(ctx,
             i == 0   ? scene_mesh_octahedron_shifted(1, .6)
             : i == 1 ? scene_mesh_torus_10_6()
                      : scene_mesh_graph_7(),
             NULL, NULL, &r);
    rig_nodes_random(&r, 0.3, 3);
    for (size_t e = 0; e < 2 * r.topology.edges; e++) {
      double factor = pow(i == 0 ? 6 : 2.2, 2 * t_uniform(&seed) - 1);
      for (int x = 0; x < 3; x++) r.local[e / 2].t[e % 2][x] *= factor;
    }
    joint_figures seven = rig_fill(&r, RIG_7, 21), back = rig_fill(&r, RIG_FALLBACK, 21);
    T_CHECK(r.refused > 0 && 2 * r.refused <= r.topology.faces,
            "%s: %zu of %zu refused, alone they are off by %.3g degrees", name, r.refused, r.topology.faces,
            seven.angle_deg);
    T_RATIO(back.angle_deg, 1e-9, "%s: normals at joints with degree 6 there, degrees", name);
    rig_close(&r);
  }
}

/* A crease's curve may have another curvature than a corner's form: then no twist fits both edges. */
static void misses(void) {
  network_rig r;
  rig_open(ctx, scene_mesh_octahedron_shifted(.5, .3), NULL, NULL, &r);
  rig_nodes_random(&r, 0.3, 4);
  net_node node[3];
  net_ribbon ribbon[3];
  double net[36][3];
  net_facet_ribbons(&r.topology, r.nodes, r.local, 0, node, ribbon);
  T_CHECK(net_fill_degree7(node, ribbon, net), "curvatures of the forms");
  for (int x = 0; x < 3; x++) ribbon[0].c[2][x] += 1e-6 * node[0].w[x];
  T_CHECK(!net_fill_degree7(node, ribbon, net), "one of another curvature");
  rig_close(&r);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  joints();
  interior_is_least();
  corners_turn();
  plane();
  refusals();
  falls_back();
  misses();
  batten_context_free(ctx);
  return t_done();
}
