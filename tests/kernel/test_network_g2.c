/* Optimised second order networks: against the integral itself, both solvers, invariances, constraints; the joints
 * and curvatures of the surfaces that come of them. */
#include "network_rig.h"

#include "basis/triangular.h"

static batten_context *ctx;

static batten_network_options options(double power, double field) {
  return (batten_network_options){
      .normal_passes = 30, .normal_tol_rad = 1e-6, .weight_power = power, .field_weight = field};
}

/* Normals, then the network. */
static net_figures build(network_rig *r) {
  net_figures g1 = {0}, g2 = {0};
  T_OK(net_g1(ctx, &r->topology, &r->options, r->normals, r->local, &g1), ctx);
  T_OK(net_g2(ctx, &r->topology, &r->options, r->normals, r->nodes, r->local, &g2), ctx);
  return g2;
}

/* K over 15 rows on each patch. */
static void gauss_range(const network_rig *r, double range[2]) {
  range[0] = INFINITY;
  range[1] = -INFINITY;
  for (size_t p = 0; p < 3 * r->topology.faces; p++) {
    bool split = r->split[p / 3];
    if (!split && p % 3) continue;
    const double(*net)[3] = (const double(*)[3])(split ? r->thirds[p / 3][p % 3] : r->single[p / 3]);
    for (int i = 0; i <= 15; i++)
      for (int j = 0; i + j <= 15; j++) {
        double s[6][3], n[3];
        triangular_jet(split ? 6 : 7, net, i / 15., j / 15., 2, s);
        vec_cross(s[1], s[2], n);
        double k = vec_dot(n, s[3]) * vec_dot(n, s[5]) - vec_dot(n, s[4]) * vec_dot(n, s[4]);
        k /= vec_dot(n, n) * vec_dot(n, n);
        range[0] = fmin(range[0], k);
        range[1] = fmax(range[1], k);
      }
  }
}

/* What a plain implementation of the method reaches, to its two digits: unweighted, and with edges weighted by their
 * length. */
static void reached(void) {
  static const struct {
    const char *name;
    double paper[2], weighted[2];
  } wanted[] = {{"octahedron", {.905, 1.395}, {.905, 1.395}}, {"shifted octahedron", {.335, 3.585}, {.685, 1.735}},
                {"sphere 42", {.975, 1.065}, {.975, 1.065}},  {"graph", {-1.105, .155}, {-.805, .02}},
                {"torus", {-1.115, .765}, {-1.165, .525}},    {"tetrahedron", {.935, 1.535}, {.935, 1.535}},
                {"ellipsoid", {.025, 9.95}, {-.515, 12.25}}};
  for (int w = 0; w < 2; w++)
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
      scene_mesh mesh = i == 0   ? scene_mesh_octahedron()
                        : i == 1 ? scene_mesh_octahedron_shifted(.5, .3)
                        : i == 2 ? scene_mesh_icosphere(2)
                        : i == 3 ? scene_mesh_graph_7()
                        : i == 4 ? scene_mesh_torus_10_6()
                        : i == 5 ? scene_mesh_tetrahedron()
                                 : scene_mesh_ellipsoid_long();
      const char *name = wanted[i].name;
      const double *bound = w ? wanted[i].weighted : wanted[i].paper;
      batten_network_options o = w ? options(3, .32) : options(0, .1);
      network_rig r;
      rig_open(ctx, mesh, &o, NULL, &r);
      net_figures f = build(&r);
      joint_figures j = rig_fill(&r, RIG_FALLBACK, 41);
      double range[2];
      gauss_range(&r, range);
      T_RATIO(j.angle_deg, 1e-11, "%s: normals at joints, degrees", name);
      T_CHECK(r.refused == 0 && f.energy < f.energy_start && f.unknowns == 5 * r.topology.nodes,
              "%s: energy %g from %g with %zu unknowns", name, f.energy, f.energy_start, f.unknowns);
      T_CHECK(range[0] >= bound[0] && range[1] <= bound[1], "%s, %s: K from %.4f to %.4f, wanted %g to %g", name,
              w ? "weighted" : "paper", range[0], range[1], bound[0], bound[1]);
      rig_close(&r);
    }
}

/* ---- the integral ------------------------------------------------------------------------------- */

/* Weighted int |C''|^2 + field_weight int |d''|^2 over all edges, from facets' ribbons at Gauss points, every edge's
 * curve once, every field once (smooth edges) or on both sides (creases). */
static double functional(const network_rig *r) {
  static const double place[3] = {0.1127016653792583, 0.5, 0.8872983346207417},
                      weight[3] = {5. / 18, 4. / 9, 5. / 18};
  static const double place5[4] = {0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263};
  static const double weight5[4] = {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};
  const net_topology *t = &r->topology;
  double sum = 0;
  for (size_t f = 0; f < t->faces; f++) {
    net_node node[3];
    net_ribbon ribbon[3];
    net_facet_ribbons(t, r->nodes, r->local, f, node, ribbon);
    for (size_t k = 0; k < 3; k++) {
      uint32_t h = (uint32_t)(3 * f + k), e = t->edge[h];
      bool first = t->half[e] == h, field = first || t->kind[e] == NET_CREASE;
      double part = 0;
      for (int i = 0; i < 4 && first; i++)
        for (int x = 0; x < 3; x++) {
          double s = place5[i], q = 1 - s, (*c)[3] = ribbon[k].c, second = 0;
          double b[4] = {q * q * q, 3 * q * q * s, 3 * q * s * s, s * s * s};
          for (int m = 0; m < 4; m++) second += 20 * b[m] * (c[m + 2][x] - 2 * c[m + 1][x] + c[m][x]);
          part += weight5[i] * second * second;
        }
      for (int i = 0; i < 3 && field; i++)
        for (int x = 0; x < 3; x++) {
          double s = place[i], (*d)[3] = ribbon[k].d;
          double second = 6 * ((1 - s) * (d[2][x] - 2 * d[1][x] + d[0][x]) + s * (d[3][x] - 2 * d[2][x] + d[1][x]));
          part += r->options.field_weight * weight[i] * second * second;
        }
      sum += part * pow(vec_distance(ribbon[k].c[0], ribbon[k].c[5]), -r->options.weight_power);
    }
  }
  return sum;
}

/* The integral is quadratic: along each free direction of each node its differences give slope and bend exactly. */
static double largest_slope(network_rig *r) {
  double worst = 0;
  for (size_t i = 0; i < r->topology.nodes; i++) {
    double origin[5], columns[5][5], keep[5];
    unsigned dof;
    net_node_freedom(r->topology.constraint ? &r->topology.constraint[i] : NULL, &r->nodes[i], origin, columns, &dof);
    memcpy(keep, r->nodes[i].x, sizeof keep);
    for (unsigned y = 0; y < dof; y++) {
      double value[3];
      for (int s = 0; s < 3; s++) {
        for (int k = 0; k < 5; k++) r->nodes[i].x[k] = keep[k] + 0.5 * (s - 1) * columns[k][y];
        value[s] = functional(r);
      }
      memcpy(r->nodes[i].x, keep, sizeof keep);
      double slope = value[2] - value[0], bend = value[2] - 2 * value[1] + value[0];
      worst = fmax(worst, fabs(slope) / sqrt(bend * value[1]));
      if (!(bend > 0)) worst = INFINITY;
    }
  }
  return worst;
}

static void stationary(void) {
  const struct {
    const char *name;
    scene_mesh mesh;
    batten_network_direction direction;
    batten_network_length length;
  } all[] = {{"shifted octahedron", scene_mesh_octahedron_shifted(.5, .3), BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2},
             {"octahedron, D1 and L1", scene_mesh_octahedron_shifted(.3, .3), BATTEN_DIRECTION_D1, BATTEN_LENGTH_L1},
             {"octahedron, L4", scene_mesh_octahedron_shifted(.2, .1), BATTEN_DIRECTION_D2, BATTEN_LENGTH_L4},
             {"graph", scene_mesh_graph(4), BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2},
             {"ears", scene_mesh_ears(3), BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2}};
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
    batten_network_options o = options(i % 2 ? 3 : 1.5, .2);
    network_rig r;
    o.direction = all[i].direction;
    o.length = all[i].length;
    rig_open(ctx, all[i].mesh, &o, NULL, &r);
    net_figures f = build(&r);
    T_RATIO(fabs(f.energy / functional(&r) - 1), 1e-13, "%s: the integral by quadrature, %g", all[i].name, f.energy);
    T_RATIO(largest_slope(&r), 1e-10, "%s: slope of the integral along each unknown", all[i].name);
    rig_close(&r);
  }
}

/* Creases, corners, boundary curves, darts and lines: the sides of a crease share its curve, smooth joints hold. */
static void features(void) {
  static const unsigned char cells[4] = {1, 1, 1, 0};
  const char *names[] = {"steps with creases",       "graph with boundary curves", "sphere with a dart",
                         "octahedron of two halves", "blob with creases",          "valve with lines"};
  for (int i = 0; i < 6; i++) {
    batten_network_options o = options(3, .32);
    scene_mesh mesh = i == 0   ? scene_mesh_cells(2, 2, 1, cells, 1)
                      : i == 1 ? scene_mesh_graph(5)
                      : i == 2 ? scene_mesh_icosphere(2)
                      : i == 3 ? scene_mesh_octahedron_shifted(.3, .1)
                      : i == 4 ? scene_mesh_blob_162()
                               : scene_mesh_valve();
    const uint32_t dart[4] = {mesh.corners[0], mesh.corners[1], mesh.corners[1], mesh.corners[2]};
    const uint32_t equator[8] = {0, 2, 2, 1, 1, 3, 3, 0};
    o.corner_angle_deg = i == 3 ? 100 : 60;
    if (i == 0 || i == 4) o.crease_angle_deg = 35;
    o.boundary_curves = i == 1;
    if (i == 2 || i == 3) {
      o.crease_count = i == 2 ? 2 : 4;
      o.creases = i == 2 ? dart : equator;
    }
    if (i == 5) {
      o.line_count = mesh.lines;
      o.line_starts = mesh.line_starts;
      o.line_vertices = mesh.line_vertices;
    }
    network_rig r;
    rig_open(ctx, mesh, &o, net_features_make, &r);
    net_figures f = build(&r);
    const net_topology *t = &r.topology;
    T_CHECK(t->crease_edges + t->line_edges + (i == 1) > 0 && f.unknowns <= 5 * t->nodes && f.unknowns > 0,
            "%s: %zu creases, %zu edges of lines, %zu unknowns at %zu nodes", names[i], t->crease_edges,
            t->line_edges, f.unknowns, t->nodes);
    for (int choice = RIG_7; choice <= RIG_FALLBACK; choice++) {
      joint_figures j = rig_fill(&r, (rig_choice)choice, 9);
      T_RATIO(j.angle_deg, 5e-11, "%s, fill %d: normals at smooth joints, degrees", names[i], choice);
      T_CHECK(r.refused == 0 && j.jacobian > 0.05, "%s: %zu refused, least normal %.3g", names[i], r.refused,
              j.jacobian);
    }
    memset(r.crease, 0, 3 * t->faces * sizeof *r.crease);
    T_RATIO(rig_fill(&r, RIG_MIXED, 9).gap, 1e-14, "%s: gap over all edges", names[i]);
    T_RATIO(fabs(f.energy / functional(&r) - 1), 1e-13, "%s: the integral by quadrature, %g", names[i], f.energy);
    if (i < 4) T_RATIO(largest_slope(&r), 1e-9, "%s: slope of the integral along each unknown", names[i]);
    rig_close(&r);
  }
}

/* ---- second routes ------------------------------------------------------------------------------ */

static double difference(const network_rig *a, const network_rig *b) {
  double worst = 0;
  for (size_t f = 0; f < a->topology.faces; f++)
    for (int k = 0; k < 36; k++) worst = fmax(worst, vec_distance(a->single[f][k], b->single[f][k]));
  return worst;
}

static void same_by_other_ways(void) {
  batten_network_options o = options(3, .32);
  network_rig direct, other;
  rig_open(ctx, scene_mesh_graph_7(), &o, NULL, &direct);
  build(&direct);
  rig_fill(&direct, RIG_7, 2);
  o.solver = BATTEN_NETWORK_CG;
  rig_open(ctx, scene_mesh_graph_7(), &o, NULL, &other);
  net_figures f = build(&other);
  rig_fill(&other, RIG_7, 2);
  T_RATIO(difference(&direct, &other), 1e-11, "conjugate gradients, %zu iterations", f.cg_iterations);
  T_RATIO((double)f.cg_iterations, 60, "iterations");
  rig_close(&other);

  batten_context *three = t_context(NULL, NULL, 3);
  o.solver = BATTEN_NETWORK_AUTO;
  rig_open(three, scene_mesh_graph_7(), &o, NULL, &other);
  net_figures g1 = {0}, g2 = {0};
  net_g1(three, &other.topology, &o, other.normals, other.local, &g1);
  net_g2(three, &other.topology, &o, other.normals, other.nodes, other.local, &g2);
  rig_fill(&other, RIG_7, 2);
  T_CHECK(difference(&direct, &other) == 0, "the same bits with 3 threads");
  rig_close(&other);
  batten_context_free(three);

  /* Turned by 90 degrees about z, and half as large. */
  scene_mesh turned = scene_mesh_graph_7();
  for (size_t v = 0; v < turned.vertices; v++) {
    double *p = turned.points + 3 * v, x = p[0];
    p[0] = -0.5 * p[1];
    p[1] = 0.5 * x;
    p[2] *= 0.5;
  }
  rig_open(ctx, turned, &o, NULL, &other);
  build(&other);
  rig_fill(&other, RIG_7, 2);
  for (size_t i = 0; i < 36 * other.topology.faces; i++) {
    double *p = other.single[i / 36][i % 36], x = p[0];
    p[0] = 2 * p[1];
    p[1] = -2 * x;
    p[2] *= 2;
  }
  T_RATIO(difference(&direct, &other), 1e-10, "turned and halved");
  rig_close(&other);
  rig_close(&direct);

  rig_open(ctx, scene_mesh_plane(4), &o, NULL, &other);
  build(&other);
  double most = 0;
  for (size_t i = 0; i < other.topology.nodes; i++)
    for (int k = 0; k < 5; k++) most = fmax(most, fabs(other.nodes[i].x[k]));
  T_RATIO(most, 1e-12, "a plane has neither slope nor curvature");
  rig_close(&other);
}

/* Meshes with valences from 3 to 20, of three sizes. */
static void random_meshes(void) {
  double worst = 0, gap = 0;
  size_t refused = 0, faces = 0;
  for (uint64_t seed = 0; seed < 60; seed++) {
    const double size = seed % 3 == 0 ? 1 : seed % 3 == 1 ? 0x1p-20 : 0x1p20;
    batten_network_options o = options(3, .32);
    scene_mesh mesh = scene_mesh_random(seed);
    network_rig r;
    net_figures g1 = {0}, g2 = {0};
    scene_mesh_scale(&mesh, size, size, size);
    rig_open(ctx, mesh, &o, NULL, &r);
    if (net_g1(ctx, &r.topology, &o, r.normals, r.local, &g1) ||
        net_g2(ctx, &r.topology, &o, r.normals, r.nodes, r.local, &g2))
      T_CHECK(false, "seed %d: %s", (int)seed, batten_error(ctx));
    joint_figures j = rig_fill(&r, RIG_FALLBACK, 9);
    worst = fmax(worst, j.angle_deg);
    gap = fmax(gap, j.gap / size);
    refused += r.refused;
    faces += r.topology.faces;
    rig_close(&r);
  }
  T_RATIO(worst, 1e-10, "60 random meshes: normals at joints, degrees; %zu of %zu facets by degree 6", refused,
          faces);
  T_RATIO(gap, 1e-14, "60 random meshes: gap");
}

/* AUTO leaves large systems to conjugate gradients. */
static void large(void) {
  batten_network_options o = options(3, .32);
  network_rig r;
  rig_open(ctx, scene_mesh_icosphere(15), &o, NULL, &r);
  net_figures f = {0}, direct = {0};
  T_OK(net_g2(ctx, &r.topology, &r.options, r.normals, r.nodes, r.local, &f), ctx);
  r.options.solver = BATTEN_NETWORK_DIRECT;
  T_OK(net_g2(ctx, &r.topology, &r.options, r.normals, r.nodes, r.local, &direct), ctx);
  T_CHECK(f.cg_iterations > 5 && f.cg_iterations < 60 && direct.cg_iterations < 2, "%zu nodes: %zu iterations or %zu",
          r.topology.nodes, f.cg_iterations, direct.cg_iterations);
  T_RATIO(fabs(f.energy / direct.energy - 1), 1e-13, "the same energy, %.12g", f.energy);
  rig_close(&r);
}

/* Without the field two edges leave a form undetermined at ears: the safety term takes the least. */
static void ears_without_field(void) {
  batten_network_options o = options(3, 0);
  double energy[2];
  for (int i = 0; i < 2; i++) {
    network_rig r;
    o.solver = i ? BATTEN_NETWORK_CG : BATTEN_NETWORK_DIRECT;
    rig_open(ctx, scene_mesh_ears(4), &o, NULL, &r);
    net_figures f = build(&r);
    energy[i] = f.energy;
    joint_figures j = rig_fill(&r, RIG_FALLBACK, 21);
    T_RATIO(j.angle_deg, 1e-11, "ears without field: normals at joints, degrees; residual %.3g", f.residual);
    double most = 0;
    for (size_t k = 0; k < 5 * r.topology.nodes; k++) most = fmax(most, fabs(r.nodes[k / 5].x[k % 5]));
    T_RATIO(most, 2, "and no form is out of size");
    rig_close(&r);
  }
  T_RATIO(fabs(energy[0] / energy[1] - 1), 1e-11, "both solvers");
}

/* ---- failures ----------------------------------------------------------------------------------- */

static batten_status call(batten_context *other, void *arg) {
  network_rig *r = arg;
  net_figures f = {0};
  return net_g2(other, &r->topology, &r->options, r->normals, r->nodes, r->local, &f);
}

static void failures(void) {
  batten_network_options o = options(3, .32);
  network_rig r;
  o.length = BATTEN_LENGTH_L4;
  rig_open(ctx, scene_mesh_octahedron_shifted(.5, .3), &o, NULL, &r);
  t_fail_every_allocation("direct", call, &r);
  t_cancel_every_progress("direct", call, &r);
  r.options.solver = BATTEN_NETWORK_CG;
  t_fail_every_allocation("conjugate gradients", call, &r);
  t_cancel_every_progress("conjugate gradients", call, &r);
  rig_close(&r);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  reached();
  stationary();
  features();
  same_by_other_ways();
  random_meshes();
  large();
  ears_without_field();
  failures();
  batten_context_free(ctx);
  return t_done();
}
