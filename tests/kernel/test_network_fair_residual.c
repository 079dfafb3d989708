/* What the fair fill is made of, apart: the integral of |grad II|^2 by hand and by a second route, derivatives
 * against differences, nodes that turn. */
#include "basis/triangular.h"
#include "network/fair.h"
#include "network_rig.h"

static fair_tables *tables;

/* ---- surfaces --------------------------------------------------------------------------------------------- */

typedef void map_function(double x, double y, double out[3]);

static void plane(double x, double y, double out[3]) {
  out[0] = x + 0.3 * x * y;
  out[1] = y - 0.2 * x * x;
  out[2] = 0.5 * out[0] - 0.25 * out[1];
}
static void sphere(double x, double y, double out[3]) {
  double s = 1 + x * x + y * y;
  out[0] = 2 * x / s;
  out[1] = 2 * y / s;
  out[2] = (1 - x * x - y * y) / s;
}
static void cylinder(double x, double y, double out[3]) {
  out[0] = cos(x + 0.3 * y);
  out[1] = sin(x + 0.3 * y);
  out[2] = y - 0.5 * x;
}
static void parabola(double x, double y, double out[3]) {
  out[0] = x;
  out[1] = y;
  out[2] = 0.5 * x * x;
}

/* The patch of degree 7 that agrees with a map at 36 places of the triangle (0, 0), (size, 0), (0, size). */
static void interpolate(map_function *map, double size, double (*net)[3]) {
  static double a[36][39];
  for (unsigned k = 0, i = 0; k <= 7; k++)
    for (unsigned j = 0; j + k <= 7; j++, i++) {
      triangular_basis(7, j / 7., k / 7., 0, a[i]);
      map(size * j / 7, size * k / 7, a[i] + 36);
    }
  for (unsigned c = 0; c < 36; c++) {
    unsigned pivot = c;
    for (unsigned i = c; i < 36; i++)
      if (fabs(a[i][c]) > fabs(a[pivot][c])) pivot = i;
    for (unsigned j = 0; j < 39; j++) {
      double swap = a[c][j];
      a[c][j] = a[pivot][j];
      a[pivot][j] = swap;
    }
    for (unsigned i = 0; i < 36; i++) {
      double factor = i == c ? 0 : a[i][c] / a[c][c];
      for (unsigned j = c; j < 39; j++) a[i][j] -= factor * a[c][j];
    }
  }
  for (unsigned i = 0; i < 36; i++)
    for (unsigned x = 0; x < 3; x++) net[i][x] = a[i][36 + x] / a[i][i];
}

static void to_planes(const double (*points)[3], fair_net net) {
  for (unsigned p = 0; p < 36; p++)
    for (unsigned x = 0; x < 3; x++) net[x][p] = points[p][x];
}

static double energy_of(const fair_net net, double *residuals) {
  double sum = 0, r[4];
  for (unsigned g = 0; g < FAIR_POINTS; g++) {
    fair_residual(tables, net, g, FAIR_FULL, r, NULL, NULL);
    for (unsigned a = 0; a < 4; a++) {
      sum += r[a] * r[a];
      if (residuals) residuals[4 * g + a] = r[a];
    }
  }
  return sum;
}

static void known_surfaces(void) {
  double net[36][3], planar[3][36];
  double worst = 0;
  for (int i = 0; i <= 8; i++)
    for (int j = 0; i + j <= 8; j++) { /* integral of u^i v^j: i! j! / (i + j + 2)! */
      double sum = 0;
      for (unsigned g = 0; g < FAIR_POINTS; g++) {
        double u = 0, v = 0; /* where point g is: of S_u of u^2 / 2 and of S_v of v^2 / 2 in degree 7 */
        for (unsigned p = 0, k = 0; k <= 7; k++)
          for (unsigned q = 0; q + k <= 7; q++, p++) {
            u += tables->jets[g][0][p] * q * (q - 1) / 84;
            v += tables->jets[g][1][p] * k * (k - 1) / 84;
          }
        sum += tables->weight[g] * pow(u, i) * pow(v, j);
      }
      worst = fmax(worst, fabs(sum * tgamma(i + j + 3) / (tgamma(i + 1) * tgamma(j + 1)) - 1));
    }
  T_RATIO(worst, 1e-12, "quadrature: monomials to degree 8");
  interpolate(plane, 1, net);
  T_RATIO(fair_patch_energy((const double(*)[3])net), 1e-22, "curved parameters on a plane have no energy");
  static map_function *const round[] = {sphere, cylinder};
  for (int i = 0; i < 2; i++) {
    double coarse, fine;
    interpolate(round[i], 0.5, net);
    coarse = fair_patch_energy((const double(*)[3])net);
    interpolate(round[i], 0.25, net);
    fine = fair_patch_energy((const double(*)[3])net);
    printf("# %s: %.3g over 1/2, %.3g over 1/4\n", i ? "cylinder" : "sphere", coarse, fine);
    /* third derivatives are right to order 5, the integral of their squares to order 12 */
    T_CHECK(coarse < 1e-3 && fine < coarse / 1000, "%s: what is left is the interpolation's",
            i ? "cylinder" : "sphere");
  }
  /* On z = x^2 / 2 grad II is the derivative of the parabola's curvature by its length, -3 x (1 + x^2)^-3, in one
   * component; lines of length L - x lie over each x. */
  double size = 0.4, integral = 0;
  for (int i = 0; i < 2000; i++) {
    double x = (i + 0.5) / 2000 * size;
    integral += size / 2000 * (size - x) * 9 * x * x * pow(1 + x * x, -6) * sqrt(1 + x * x);
  }
  interpolate(parabola, size, net);
  double energy = fair_patch_energy((const double(*)[3])net);
  T_RATIO(fabs(energy / integral - 1), 2e-6, "parabolic cylinder %.8g", energy);
  to_planes((const double(*)[3])net, planar);
  T_RATIO(fabs(energy_of((const double(*)[36])planar, NULL) / energy - 1), 1e-12, "residuals add up to it");
}

/* ---- nets at random ------------------------------------------------------------------------------------------ */

static void random_net(uint64_t *seed, double size, fair_net net) {
  double points[36][3];
  interpolate(sphere, 0.8, points);
  to_planes((const double(*)[3])points, net);
  for (unsigned x = 0; x < 3; x++)
    for (unsigned p = 0; p < 36; p++) net[x][p] += size * (2 * t_uniform(seed) - 1);
}

static void invariance(void) {
  uint64_t seed = 7;
  fair_net net, other;
  random_net(&seed, 0.01, net);
  double energy = energy_of((const double(*)[36])net, NULL), c = cos(0.7), s = sin(0.7);
  for (unsigned p = 0; p < 36; p++) {
    double x = c * net[0][p] - s * net[1][p], y = s * net[0][p] + c * net[1][p];
    other[0][p] = net[2][p] + 3;
    other[1][p] = x - 1;
    other[2][p] = y;
  }
  T_RATIO(fabs(energy_of((const double(*)[36])other, NULL) / energy - 1), 1e-10, "moved about");
  for (unsigned x = 0; x < 3; x++)
    for (unsigned p = 0; p < 36; p++) other[x][p] = 4 * net[x][p];
  T_CHECK(energy_of((const double(*)[36])other, NULL) == energy / 16, "four times as large: a sixteenth, to the bit");
  for (unsigned k = 0, p = 0; k <= 7; k++)
    for (unsigned j = 0; j + k <= 7; j++, p++) /* corners (1, 2, 0) instead of (0, 1, 2) */
      for (unsigned x = 0; x < 3; x++) other[x][p] = net[x][triangular_index(7, k, 7 - j - k)];
  T_RATIO(fabs(energy_of((const double(*)[36])other, NULL) / energy - 1), 1e-10, "begun at another corner");
}

/* Rows against central differences along random directions. */
static void rows_by_differences(void) {
  uint64_t seed = 11;
  double full = 0, gradient = 0, linear = 0;
  fair_net net, way, moved;
  static fair_net rows[FAIR_ROWS];
  for (int trial = 0; trial < 20; trial++) {
    random_net(&seed, 0.01, net);
    for (unsigned x = 0; x < 3; x++)
      for (unsigned p = 0; p < 36; p++) way[x][p] = 2 * t_uniform(&seed) - 1;
    double before[64], after[64], h = 1e-6, slope = 0, change = 0, energies[2];
    for (int side = 0; side < 2; side++) {
      for (unsigned x = 0; x < 3; x++)
        for (unsigned p = 0; p < 36; p++) moved[x][p] = net[x][p] + (side ? h : -h) * way[x][p];
      energies[side] = energy_of((const double(*)[36])moved, side ? after : before);
    }
    for (unsigned g = 0; g < FAIR_POINTS; g++) {
      double r[4];
      fair_residual(tables, (const double(*)[36])net, g, FAIR_FULL, r, rows, NULL);
      for (unsigned a = 0; a < 4; a++) {
        double along = 0, difference = (after[4 * g + a] - before[4 * g + a]) / (2 * h);
        for (unsigned x = 0; x < 3; x++)
          for (unsigned p = 0; p < 36; p++) along += rows[a][x][p] * way[x][p];
        slope += along * r[a];
        change += difference * r[a];
      }
      fair_residual(tables, (const double(*)[36])net, g, FAIR_LINEAR, r, rows, NULL);
      for (unsigned a = 0; a < 4; a++) {
        double value = 0, size = 0;
        for (unsigned x = 0; x < 3; x++)
          for (unsigned p = 0; p < 36; p++) {
            value += rows[a][x][p] * net[x][p];
            size += fabs(rows[a][x][p] * net[x][p]);
          }
        linear = fmax(linear, fabs(value - r[a]) / size);
      }
    }
    gradient = fmax(gradient, fabs(slope - (energies[1] - energies[0]) / (4 * h)) / fabs(slope));
    full = fmax(full, fabs(slope - change) / fabs(slope));
  }
  T_RATIO(gradient, 1e-6, "full rows times residuals: the gradient, by differences of the energy");
  T_RATIO(full, 1e-6, "... and by differences of the residuals");
  T_RATIO(linear, 1e-12, "linear rows times the net: the residuals themselves");
}

/* ---- from the nodes ------------------------------------------------------------------------------------------ */

/* The facet's net after a step at one corner, everything made anew. */
static void remake(network_rig *r, size_t face, uint32_t node, const double step[5], bool linear, fair_net net) {
  net_node before = r->nodes[node];
  if (linear)
    for (int k = 0; k < 5; k++) r->nodes[node].x[k] += step[k];
  else
    fair_node_turn(&before, step, &r->nodes[node]);
  fair_facet facet = {0};
  net_local *local = scene_allocate(r->topology.edges * sizeof *local);
  for (uint32_t e = 0; e < r->topology.edges; e++)
    if (linear)
      local[e] = r->local[e];
    else
      net_tangent_edge(&r->topology, &r->options, r->nodes, NULL, e, &local[e]);
  net_facet_ribbons(&r->topology, r->nodes, local, face, facet.corner, facet.ribbon);
  fair_facet_net(&facet, net);
  free(local);
  r->nodes[node] = before;
}

static void slopes_by_differences(batten_context *ctx) {
  static const uint32_t crease[2][2] = {{0, 2}, {2, 1}}; /* ends within the surface on both sides */
  static fair_slopes slopes;
  for (int scene = 0; scene < 3; scene++) {
    network_rig r;
    batten_network_options o = {.crease_count = scene == 2 ? 2 : 0, .creases = crease[0], .corner_angle_deg = 60};
    scene_mesh mesh = scene == 0   ? scene_mesh_octahedron_shifted(.5, .3)
                      : scene == 1 ? scene_mesh_graph_7()
                                   : scene_mesh_octahedron();
    rig_open(ctx, mesh, &o, net_features_make, &r);
    rig_nodes_random(&r, 0.1, 3);
    for (size_t i = 0; i < r.topology.nodes; i++) fair_node_upright(&r.nodes[i], &r.nodes[i]);
    for (uint32_t e = 0; e < r.topology.edges; e++)
      net_tangent_edge(&r.topology, &r.options, r.nodes, NULL, e, &r.local[e]);
    for (int linear = 0; linear < 2; linear++) {
      double worst = 0;
      for (size_t face = 0; face < 4; face++) {
        fair_facet facet = {0};
        net_facet_ribbons(&r.topology, r.nodes, r.local, face, facet.corner, facet.ribbon);
        fair_facet_slopes(&r.topology, &r.options, r.local, face, &facet, linear, slopes);
        for (unsigned column = 0; column < FAIR_OUTER; column++) {
          fair_net ahead, behind;
          double step[5] = {0}, h = 3e-5, difference = 0, size = 0;
          uint32_t node = r.topology.node[3 * face + column / 5];
          step[column % 5] = h;
          remake(&r, face, node, step, linear, ahead);
          step[column % 5] = -h;
          remake(&r, face, node, step, linear, behind);
          for (unsigned x = 0; x < 3; x++)
            for (unsigned p = 0; p < 36; p++) {
              double d = (ahead[x][p] - behind[x][p]) / (2 * h);
              difference = fmax(difference, fabs(d - slopes[x][p][column]));
              size = fmax(size, fabs(d));
            }
          worst = fmax(worst, difference / size);
        }
      }
      T_RATIO(worst, 1e-7, "scene %d%s: derivatives of nets by nodes", scene, linear ? ", linear" : "");
    }
    rig_close(&r);
  }
}

/* A graph to second order, seen from its tangent plane: the same curvatures, and once upright it stays. */
static void upright(void) {
  uint64_t seed = 5;
  double worst = 0, frame = 0, still = 0;
  for (int trial = 0; trial < 100; trial++) {
    net_node node, up, again;
    double w[3];
    for (int k = 0; k < 3; k++) w[k] = 2 * t_uniform(&seed) - 1;
    vec_normalize(w);
    net_frame(w, NULL, &node);
    for (int k = 0; k < 5; k++) node.x[k] = 2 * t_uniform(&seed) - 1;
    fair_node_upright(&node, &up);
    const double *x = node.x, *y = up.x;
    double s = 1 + x[0] * x[0] + x[1] * x[1], k = (x[2] * x[4] - x[3] * x[3]) / (s * s);
    double h = ((1 + x[1] * x[1]) * x[2] - 2 * x[0] * x[1] * x[3] + (1 + x[0] * x[0]) * x[4]) / (2 * s * sqrt(s));
    worst = fmax(worst, fabs(y[2] * y[4] - y[3] * y[3] - k) + fabs((y[2] + y[4]) / 2 - h));
    for (int c = 0; c < 3; c++)
      frame = fmax(frame, fabs(up.w[c] * sqrt(s) - (node.w[c] - x[0] * node.u[c] - x[1] * node.v[c])));
    fair_node_upright(&up, &again);
    for (int c = 0; c < 5; c++) still = fmax(still, fabs(again.x[c] - up.x[c]));
  }
  T_RATIO(worst, 1e-14, "upright nodes keep both curvatures");
  T_RATIO(frame, 1e-14, "... and have the graph's normal");
  T_RATIO(still, 1e-14, "... and stay");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  tables = scene_allocate(sizeof *tables);
  fair_tables_make(tables);
  known_surfaces();
  invariance();
  rows_by_differences();
  slopes_by_differences(ctx);
  upright();
  free(tables);
  batten_context_free(ctx);
  return t_done();
}
