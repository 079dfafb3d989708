/* Three patches of degree 6: joints, also beside patches of degree 7, the least integral inside, invariances. */
#include "network_rig.h"

#include "basis/triangular.h"

static batten_context *ctx;

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
    for (int mixed = 0; mixed < 2; mixed++) {
      joint_figures j = rig_fill(&r, mixed ? RIG_MIXED : RIG_6, 21);
      T_RATIO(j.angle_deg, 1e-11, "%s%s: normals at joints, degrees", all[i].name, mixed ? ", mixed with 7" : "");
      T_RATIO(j.gap, 1e-14, "%s: gap", all[i].name);
      T_CHECK(j.jacobian > 0.1, "%s: least normal %.3g", all[i].name, j.jacobian);
    }
    size_t good = 0;
    for (size_t f = 0; f < r.topology.faces; f++) {
      net_node node[3];
      net_ribbon ribbon[3];
      net_facet_ribbons(&r.topology, r.nodes, r.local, f, node, ribbon);
      good += net_fill_degree6(node, ribbon, r.thirds[f]);
    }
    T_CHECK(good == r.topology.faces, "%s: all %zu regular", all[i].name, good);
    rig_close(&r);
  }
}

/* ---- the integral ------------------------------------------------------------------------------- */

/* Integral, to a constant, of the products of third derivatives of two split facets over the equilateral triangle
 * with corners (0, 0), (1, 0), (1/2, sqrt(3) / 2), summed over coordinates. Degree 6: two Gauss points a direction
 * and more.
 */
static double product(const double (*a)[28][3], const double (*b)[28][3]) {
  static const double places[4] = {0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263};
  static const double weights[4] = {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};
  /* u and v of each part by x and y: all parts are the first one turned, and turning changes nothing. Corners (0, 0),
   * (1, 0), (1/2, 1 / (2 sqrt(3))): v = 2 sqrt(3) y, u = x - v / 2. */
  const double ux = 1, uy = -sqrt(3), vy = 2 * sqrt(3);
  double sum = 0;
  for (int k = 0; k < 3; k++)
    for (int i = 0; i < 4; i++)
      for (int j = 0; j < 4; j++) {
        double u = places[i], v = places[j] * (1 - u), s[2][10][3];
        triangular_jet(6, a[k], u, v, 3, s[0]);
        triangular_jet(6, b[k], u, v, 3, s[1]);
        for (int x = 0; x < 3; x++) {
          double third[2][4];
          for (int f = 0; f < 2; f++) {
            double uuu = s[f][6][x], uuv = s[f][7][x], uvv = s[f][8][x], vvv = s[f][9][x];
            third[f][0] = ux * ux * ux * uuu;
            third[f][1] = ux * ux * (uy * uuu + vy * uuv);
            third[f][2] = ux * (uy * uy * uuu + 2 * uy * vy * uuv + vy * vy * uvv);
            third[f][3] = uy * uy * uy * uuu + 3 * uy * uy * vy * uuv + 3 * uy * vy * vy * uvv + vy * vy * vy * vvv;
          }
          sum += weights[i] * weights[j] * (1 - u) *
                 (third[0][0] * third[1][0] + 3 * third[0][1] * third[1][1] + 3 * third[0][2] * third[1][2] +
                  third[0][3] * third[1][3]);
        }
      }
  return sum;
}

/* Points of the row beside the inner curve from corner i: step m in the part after it and the part before it. */
static double *beside(double (*net)[28][3], int i, int m, bool after) {
  static const int start[7] = {0, 7, 13, 18, 22, 25, 27};
  return after ? net[i][start[m] + 1] : net[(i + 2) % 3][start[m] + 5 - m];
}

/* What may move: point m of the inner curve of corner i, by (dx, dy, dz) in I_m, with all that must follow so that
 * r_m + r'_m - 2 I_m = mu I' / 5 goes on to hold, mu_0 at the corner given; all in a net of differences. */
static void inner_direction(const double mu[3], const double inner[3][6], int axis, double (*out)[28][3]) {
  static const int start[7] = {0, 7, 13, 18, 22, 25, 27};
  memset(out, 0, 3 * sizeof *out);
  double mean[3][6];
  for (int i = 0; i < 3; i++) {
    for (int m = 1; m < 6; m++) {
      double raised = (m * inner[i][m - 1] + (6 - m) * inner[i][m]) / 6;
      out[i][start[m]][axis] = raised;
      out[(i + 2) % 3][start[m] + 6 - m][axis] = raised;
    }
    out[i][27][axis] = inner[i][5];
    for (int m = 1; m < 5; m++)
      mean[i][m] =
          inner[i][m] +
          ((5 - m) * mu[i] * (inner[i][m + 1] - inner[i][m]) + m * (5. / 6) * (inner[i][m] - inner[i][m - 1])) / 10;
  }
  for (int i = 0; i < 3; i++) {
    for (int m = 2; m < 4; m++) beside(out, i, m, true)[axis] = beside(out, i, m, false)[axis] = mean[i][m];
    out[i][23][axis] = mean[i][4] + mean[(i + 1) % 3][4] - mean[(i + 2) % 3][4];
  }
}

static void interior_is_least(void) {
  network_rig r;
  rig_open(ctx, scene_mesh_octahedron_shifted(.5, .3), NULL, NULL, &r);
  rig_nodes_random(&r, 0.3, 3);
  rig_fill(&r, RIG_6, 3);
  const double(*net)[28][3] = (const double(*)[28][3])r.thirds[2];
  double mu[3], worst = 0, size = product(net, net);
  for (int i = 0; i < 3; i++) {
    /* From I_1 raised, row 1: 5 (I_1 - A) / 6; the neighbours' first points 5 (B + C - 2 A) / 6 = mu (I_1 - A). */
    double both[3], one[3];
    for (int x = 0; x < 3; x++) {
      one[x] = 6. / 5 * (net[i][7][x] - net[i][0][x]);
      both[x] = net[i][1][x] + net[(i + 2) % 3][5][x] - 2 * net[i][0][x];
    }
    mu[i] = vec_norm(both) / vec_norm(one);
    T_CHECK(mu[i] > 1.25 && mu[i] < 2.5, "corner %d: the inner curve is longer than the mean's, mu %.3f", i, mu[i]);
  }
  double way[3][28][3];
  for (int i = 0; i < 3; i++)
    for (int x = 0; x < 3; x++)
      for (int what = 0; what < 5; what++) {
        double inner[3][6] = {{0}};
        if (what < 2) {
          inner[i][3 + what] = 1;
          for (int k = 0; k < 3 && what == 1; k++) inner[k][5] = 1. / 3;
          inner_direction(mu, (const double(*)[6])inner, x, way);
        } else {
          memset(way, 0, sizeof way);
          if (what == 2) way[i][15][x] = 1;
          if (what > 2) {
            beside(way, i, what - 1, true)[x] = 1;
            beside(way, i, what - 1, false)[x] = -1;
          }
        }
        double bend = product((const double(*)[28][3])way, (const double(*)[28][3])way);
        worst = fmax(worst, fabs(product(net, (const double(*)[28][3])way)) / sqrt(size * bend));
      }
  T_RATIO(worst, 1e-12, "the integral is stationary in all 45 ways that keep the joints");
  rig_close(&r);
}

/* ---- invariances -------------------------------------------------------------------------------- */

static void corners_turn(void) {
  network_rig r;
  rig_open(ctx, scene_mesh_octahedron_shifted(.5, .3), NULL, NULL, &r);
  rig_nodes_random(&r, 0.3, 4);
  net_node node[3], node_b[3];
  net_ribbon ribbon[3], ribbon_b[3];
  double net[3][28][3], net_b[3][28][3], worst = 0;
  net_facet_ribbons(&r.topology, r.nodes, r.local, 0, node, ribbon);
  for (int k = 0; k < 3; k++) {
    node_b[k] = node[(k + 1) % 3];
    ribbon_b[k] = ribbon[(k + 1) % 3];
  }
  T_CHECK(net_fill_degree6(node, ribbon, net) && net_fill_degree6(node_b, ribbon_b, net_b), "a facet");
  for (int k = 0; k < 3; k++)
    for (int p = 0; p < 28; p++) worst = fmax(worst, vec_distance(net[(k + 1) % 3][p], net_b[k][p]));
  T_RATIO(worst, 1e-13, "corners in turn");
  rig_close(&r);
}

static void plane(void) {
  network_rig r;
  rig_open(ctx, scene_mesh_plane(3), NULL, NULL, &r);
  rig_nodes_random(&r, 0, 1);
  rig_fill(&r, RIG_6, 3);
  double worst = 0;
  for (size_t f = 0; f < r.topology.faces; f++) {
    const double *v[3];
    double middle[3];
    for (int k = 0; k < 3; k++) v[k] = r.mesh.points + 3 * r.mesh.corners[3 * f + (size_t)k];
    for (int x = 0; x < 3; x++) middle[x] = (v[0][x] + v[1][x] + v[2][x]) / 3;
    for (unsigned p = 0; p < 3; p++)
      for (unsigned c = 0; c <= 6; c++)
        for (unsigned b = 0; b + c <= 6; b++)
          for (int x = 0; x < 3; x++) {
            double sum = ((6. - b - c) * v[p][x] + b * v[(p + 1) % 3][x] + c * middle[x]) / 6;
            worst = fmax(worst, fabs(sum - r.thirds[f][p][triangular_index(6, b, c)][x]));
          }
  }
  T_RATIO(worst, 1e-14, "a plane's facets have the control points of the plane");
  rig_close(&r);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  joints();
  interior_is_least();
  corners_turn();
  plane();
  batten_context_free(ctx);
  return t_done();
}
