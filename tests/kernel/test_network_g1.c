/* Optimised normals: fixed points, the minimum by another route, conditioning, constraints, invariance, limits. */
#include <float.h>

#include "network/fan.h"
#include "network_case.h"

static void run(network_case *c, const batten_network_options *o) {
  batten_status st = net_normals_make(c->ctx, &c->t, o, c->normals);
  if (st == BATTEN_OK) st = net_g1(c->ctx, &c->t, o, c->normals, c->local, &c->figures);
  if (st != BATTEN_OK) t_line(false, "%s: %s", batten_status_name(st), batten_error(c->ctx));
}

static network_case solved(scene_mesh mesh, const batten_network_options *o, unsigned threads) {
  network_case c = case_make(mesh, threads);
  run(&c, o);
  return c;
}

/* Largest angle between the normals of two cases. */
static double normals_apart(const network_case *a, const network_case *b) {
  double worst = 0;
  for (size_t i = 0; i < a->t.nodes; i++) worst = fmax(worst, case_angle(a->normals + 3 * i, b->normals + 3 * i));
  return worst;
}

static const batten_network_length lengths[] = {BATTEN_LENGTH_L1, BATTEN_LENGTH_L2, BATTEN_LENGTH_L3,
                                                BATTEN_LENGTH_L4};

/* ---- fixed points ----------------------------------------------------------------------------------- */

static void test_sphere(void) {
  for (int m = 0; m < 4; m++)
    for (int f = 0; f < 2; f++)
      for (int l = 0; l < 4; l++) {
        static const char *const names[] = {"octahedron", "tetrahedron", "icosahedron", "icosphere 42"};
        batten_network_options o = case_options();
        o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
        o.length = lengths[l];
        network_case c = solved(m == 0   ? scene_mesh_octahedron()
                                : m == 1 ? scene_mesh_tetrahedron()
                                : m == 2 ? scene_mesh_icosahedron()
                                         : scene_mesh_icosphere(2),
                                &o, 1);
        double worst = 0;
        for (size_t i = 0; i < c.t.nodes; i++)
          worst = fmax(worst, case_angle(c.normals + 3 * i, c.mesh.points + 3 * i));
        T_RATIO(worst, 1e-14, "%s, %s, L%d: normals of the sphere stay", names[m], f ? "Laplace-Beltrami" : "simple",
                l + 1);
        T_CHECK(c.figures.normal_passes == 1 && c.figures.clamped == 0 && c.figures.unknowns == 2 * c.t.nodes,
                "one pass to see that");
        case_free(&c);
      }
}

static void test_plane(void) {
  const double expected[3] = {-0.5, 0.25, 1};
  for (int f = 0; f < 2; f++) {
    batten_network_options o = case_options();
    scene_mesh mesh = scene_mesh_plane(9);
    uint64_t seed = 6;
    for (size_t v = 0; v < mesh.vertices; v++) { /* no pattern in it */
      double *p = mesh.points + 3 * v;
      for (int k = 0; k < 2; k++) p[k] += 0.1 * (t_uniform(&seed) - 0.5);
      p[2] = 0.5 * p[0] - 0.25 * p[1] + 0.125;
    }
    o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
    network_case c = solved(mesh, &o, 1);
    double worst = 0, straight = 0;
    for (size_t i = 0; i < c.t.nodes; i++) worst = fmax(worst, case_angle(c.normals + 3 * i, expected));
    for (size_t e = 0; e < c.t.edges; e++) {
      double chord[3];
      uint32_t h = c.t.half[e];
      vec_sub(c.t.points + (size_t)3 * c.t.triangles[net_next(h)], c.t.points + (size_t)3 * c.t.triangles[h], chord);
      straight = fmax(straight, vec_distance(chord, c.local[e].t[0]));
    }
    T_RATIO(worst, 1e-14, "normals of a plane stay");
    T_RATIO(straight, 1e-14, "its curves are the edges");
    T_RATIO(c.figures.energy, 1e-24, "without energy");
    case_free(&c);
  }
}

/* ---- the minimum by another route --------------------------------------------------------------------- */

/* The functional of one edge for slopes x [2] at both ends, straight from its definition: C by its control points,
 * the integral by a fine midpoint rule. Kept apart: frames and t of before the pass. */
typedef struct rival {
  const network_case *c;
  const batten_network_options *o;
  double (*x)[2];
} rival;

static double rival_edge(const rival *r, size_t e, const double *xi, const double *xj) {
  const net_topology *t = &r->c->t;
  bool beltrami = r->o->functional == BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI;
  uint32_t node[2] = {net_edge_node(t, (uint32_t)e, 0, 0), net_edge_node(t, (uint32_t)e, 1, 0)};
  double b[4][3], b0[4][3], sum = 0;
  for (int end = 0; end < 2; end++) {
    const net_node *n = &r->c->nodes[node[end]];
    const double *tangent = r->c->local[e].t[end], *x = end ? xj : xi;
    double slope = x[0] * vec_dot(tangent, n->u) + x[1] * vec_dot(tangent, n->v);
    const double *p = t->points + (size_t)3 * t->node_vertex[node[end]];
    for (int k = 0; k < 3; k++) {
      b[3 * end][k] = b0[3 * end][k] = p[k];
      b0[1 + end][k] = p[k] + tangent[k] / 3;
      b[1 + end][k] = p[k] + (tangent[k] + slope * n->w[k]) / 3;
    }
  }
  double length = vec_distance(b[0], b[3]), weight = pow(length, (beltrami ? 3 : 0) - r->o->weight_power);
  int steps = beltrami ? 400 : 2;
  for (int i = 0; i < steps; i++) {
    /* two-point Gauss in each step: exact for the simple functional in one */
    for (int g = 0; g < 2; g++) {
      double s = (i + 0.5 + (g ? 0.5 : -0.5) / sqrt(3)) / steps, d1[3], d2[3], r1[3], r2[3], q = 0;
      for (int k = 0; k < 3; k++) {
        double(*const curves[2])[3] = {b, b0};
        for (int which = 0; which < 2; which++) {
          double(*p)[3] = curves[which], *first = which ? r1 : d1, *second = which ? r2 : d2;
          double a = p[1][k] - p[0][k], m = p[2][k] - p[1][k], z = p[3][k] - p[2][k];
          first[k] = 3 * ((1 - s) * (1 - s) * a + 2 * s * (1 - s) * m + s * s * z);
          second[k] = 6 * ((1 - s) * (m - a) + s * (z - m));
        }
      }
      double speed = vec_dot(r1, r1), along = vec_dot(r1, r2);
      for (int k = 0; k < 3; k++) {
        double d = beltrami ? d2[k] / speed - along * d1[k] / (speed * speed) : d2[k];
        q += d * d;
      }
      sum += 0.5 / steps * q * (beltrami ? sqrt(speed) : 1) * weight;
    }
  }
  return sum;
}

/* Hessian [4][4] and gradient [4] of an edge's functional, which is quadratic: differences are exact. */
static void rival_derivatives(const rival *r, size_t e, const double *xi, const double *xj, double h[4][4],
                              double g[4]) {
  double x[4] = {xi[0], xi[1], xj[0], xj[1]};
  for (int a = 0; a < 4; a++) {
    double value[2];
    for (int side = 0; side < 2; side++) {
      double y[4];
      memcpy(y, x, sizeof y);
      y[a] += side ? 0.5 : -0.5;
      value[side] = rival_edge(r, e, y, y + 2);
    }
    g[a] = value[1] - value[0];
    for (int b = 0; b < 4; b++) {
      double corner[4];
      for (int k = 0; k < 4; k++) {
        double y[4];
        memcpy(y, x, sizeof y);
        y[a] += k & 1 ? 0.5 : -0.5;
        y[b] += k & 2 ? 0.5 : -0.5;
        corner[k] = rival_edge(r, e, y, y + 2);
      }
      h[a][b] = corner[3] - corner[2] - corner[1] + corner[0];
    }
  }
}

/* After one pass from the frames and t in c: the largest change of an unknown that would lower the functional alone.
 */
static double rival_gain(const network_case *c, const batten_network_options *o, const double *normals) {
  double(*x)[2] = calloc(c->t.nodes, sizeof *x), (*g)[2] = calloc(c->t.nodes, sizeof *g);
  double(*d)[2] = calloc(c->t.nodes, sizeof *d), worst = 0;
  rival r = {c, o, x};
  for (size_t i = 0; i < c->t.nodes; i++) {
    const net_node *n = &c->nodes[i];
    double up = vec_dot(normals + 3 * i, n->w);
    x[i][0] = -vec_dot(normals + 3 * i, n->u) / up;
    x[i][1] = -vec_dot(normals + 3 * i, n->v) / up;
  }
  for (size_t e = 0; e < c->t.edges; e++) {
    uint32_t i = net_edge_node(&c->t, (uint32_t)e, 0, 0), j = net_edge_node(&c->t, (uint32_t)e, 1, 0);
    double h[4][4], grad[4];
    rival_derivatives(&r, e, x[i], x[j], h, grad);
    for (int a = 0; a < 4; a++) {
      g[a < 2 ? i : j][a % 2] += grad[a];
      d[a < 2 ? i : j][a % 2] += h[a][a];
    }
  }
  for (size_t i = 0; i < c->t.nodes; i++) {
    net_node_kind kind = c->t.constraint ? c->t.constraint[i].kind : NET_FREE;
    for (int a = kind == NET_CREASED; a < 2 && kind != NET_CORNER; a++) worst = fmax(worst, fabs(g[i][a]) / d[i][a]);
  }
  free(x);
  free(g);
  free(d);
  return worst;
}

/* One pass of a mesh; c->nodes and c->local are those of before. */
static double one_pass_gain(scene_mesh mesh, batten_network_options o, net_constraint *constraint, double *moved) {
  network_case c = case_make(mesh, 1);
  net_local *after = calloc(c.t.edges, sizeof *after);
  c.t.constraint = constraint;
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  case_frames(&c);
  for (size_t e = 0; e < c.t.edges; e++) net_tangent_edge(&c.t, &o, c.nodes, NULL, (uint32_t)e, &c.local[e]);
  o.normal_passes = 1;
  batten_status st = net_g1(c.ctx, &c.t, &o, c.normals, after, &c.figures);
  if (st != BATTEN_OK) t_line(false, "%s", batten_error(c.ctx));
  double gain = rival_gain(&c, &o, c.normals);
  *moved = c.figures.normal_change;
  c.t.constraint = NULL;
  free(after);
  case_free(&c);
  return gain;
}

static void test_minimum(void) {
  for (int f = 0; f < 2; f++)
    for (int p = 0; p < 2; p++) {
      batten_network_options o = case_options();
      double moved, gain, bound = f ? 1e-5 : 1e-11; /* 8 places of Gauss against 800 */
      o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
      o.weight_power = p ? 3 : 0;
      const char *name = f ? "Laplace-Beltrami" : "simple";
      gain = one_pass_gain(scene_mesh_sphere_noisy(), o, NULL, &moved);
      T_RATIO(gain, bound, "noisy sphere, %s, power %g: least value (normals moved by %.2g)", name, o.weight_power,
              moved);
      gain = one_pass_gain(scene_mesh_graph_7(), o, NULL, &moved);
      T_RATIO(gain, bound, "open graph, %s, power %g: least value (%.2g)", name, o.weight_power, moved);
      o.direction = BATTEN_DIRECTION_D1;
      o.length = BATTEN_LENGTH_L1;
      gain = one_pass_gain(scene_mesh_ears(5), o, NULL, &moved);
      T_RATIO(gain, bound, "ears, D1, L1, %s, power %g: least value (%.2g)", name, o.weight_power, moved);
    }
}

/* Lanczos's method would see the same: bounds of the spectrum of D^-1 A by power iteration on D^-1 A and 2 - D^-1 A,
 * A and D from the functional's own differences. */
static void condition(scene_mesh mesh, double *low, double *high) {
  batten_network_options o = case_options();
  network_case c = case_make(mesh, 1);
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  case_frames(&c);
  size_t n = 2 * c.t.nodes;
  double zero[2] = {0}, *a = calloc(n * n, sizeof *a), *x = calloc(2 * n, sizeof *x), *y = x + n;
  rival r = {&c, &o, NULL};
  for (size_t e = 0; e < c.t.edges; e++) {
    double h[4][4], g[4];
    net_tangent_edge(&c.t, &o, c.nodes, NULL, (uint32_t)e, &c.local[e]);
    rival_derivatives(&r, e, zero, zero, h, g);
    size_t at[2] = {2 * (size_t)net_edge_node(&c.t, (uint32_t)e, 0, 0),
                    2 * (size_t)net_edge_node(&c.t, (uint32_t)e, 1, 0)};
    for (size_t i = 0; i < 4; i++)
      for (size_t j = 0; j < 4; j++) a[(at[i / 2] + i % 2) * n + at[j / 2] + j % 2] += h[i][j];
  }
  for (int side = 0; side < 2; side++) {
    double value = 0;
    uint64_t seed = 9;
    for (size_t i = 0; i < n; i++) x[i] = t_uniform(&seed) - 0.5;
    for (int pass = 0; pass < 300; pass++) {
      double size = 0;
      for (size_t i = 0; i < n; i++) {
        y[i] = 0;
        for (size_t j = 0; j < n; j++) y[i] += a[i * n + j] * x[j];
      }
      for (size_t i = 0; i < n; i += 2) {
        double p = a[i * n + i], q = a[i * n + i + 1], s = a[(i + 1) * n + i + 1], det = p * s - q * q;
        double first = (s * y[i] - q * y[i + 1]) / det, second = (p * y[i + 1] - q * y[i]) / det;
        y[i] = side ? 2 * x[i] - first : first;
        y[i + 1] = side ? 2 * x[i + 1] - second : second;
      }
      for (size_t i = 0; i < n; i++) size = fmax(size, fabs(y[i]));
      for (size_t i = 0; i < n; i++) x[i] = y[i] / size;
      value = size;
    }
    *(side ? low : high) = side ? 2 - value : value;
  }
  free(a);
  free(x);
  case_free(&c);
}

static void test_condition(void) {
  double low, high;
  condition(scene_mesh_triangle(), &low, &high);
  T_CHECK(low >= 0.5 - 1e-9 && high <= 1.5 + 1e-9, "one triangle: [%.4f, %.4f]", low, high);
  condition(scene_mesh_plane(5), &low, &high);
  T_CHECK(low >= 0.5 - 1e-9 && high <= 1.5 + 1e-9, "plane: [%.4f, %.4f], condition %.3f", low, high, high / low);
  condition(scene_mesh_cube_26(), &low, &high);
  T_CHECK(low >= 0.5 - 1e-9 && high <= 1.5 + 1e-9, "cube: [%.4f, %.4f], condition %.3f", low, high, high / low);
  double worst = 0;
  for (uint64_t seed = 1; seed <= 12; seed++) {
    condition(scene_mesh_random(seed), &low, &high);
    worst = fmax(worst, high / low);
  }
  T_RATIO(worst, 3, "largest condition over 12 random meshes");
  size_t most = 0;
  unsigned slow = 0;
  bool finite = true;
  for (uint64_t seed = 1; seed <= 100; seed++) {
    batten_network_options o = case_options();
    o.normal_passes = 1;
    network_case c = solved(scene_mesh_random(seed), &o, 1);
    most = c.figures.cg_iterations > most ? c.figures.cg_iterations : most;
    o.normal_passes = 30;
    run(&c, &o);
    slow += c.figures.normal_change > 1e-6;
    for (size_t i = 0; i < 3 * c.t.nodes; i++) finite &= isfinite(c.normals[i]);
    case_free(&c);
  }
  T_CHECK(finite && most <= 26, "100 random meshes: at most %zu steps to 1e-12 for a pass", most);
  T_CHECK(slow < 10, "%u of them did not converge in 30 passes", slow);
}

/* Nielson's functional networks [1983]: over the plane of x and y, t the projected edge, the integral of the second
 * derivative's square by the length in the plane. His equations, one vertex after another until they stay. */
static void test_functional_case(void) {
  scene_mesh mesh = scene_mesh_graph(8);
  uint64_t seed = 4;
  const double small = 0x1p-20; /* so that edges are as long as in the plane, to 1e-12 */
  for (size_t v = 0; v < mesh.vertices; v++) {
    double *p = mesh.points + 3 * v;
    for (int k = 0; k < 2; k++) p[k] += 0.1 * (t_uniform(&seed) - 0.5);
    p[2] = small * sin(3 * p[0] + p[1]) * cos(2 * p[1]);
  }
  batten_network_options o = case_options();
  double *up = calloc(mesh.vertices, 3 * sizeof *up), (*g)[2] = calloc(mesh.vertices, sizeof *g);
  for (size_t v = 0; v < mesh.vertices; v++) up[3 * v + 2] = 1;
  o.normals_given = up;
  o.normal_passes = 1;
  o.direction = BATTEN_DIRECTION_D1;
  o.length = BATTEN_LENGTH_L1;
  for (int f = 0; f < 2; f++) {
    o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
    network_case c = solved(scene_mesh_from(mesh.vertices, mesh.points, mesh.triangles, mesh.corners), &o, 1);
    memset(g, 0, c.t.nodes * sizeof *g);
    for (int pass = 0; pass < 200; pass++)
      for (uint32_t i = 0; i < c.t.nodes; i++) {
        double a = 0, b = 0, d = 0, r[2] = {0};
        const double *p = c.mesh.points + (size_t)3 * i;
        for (net_spoke s = net_spoke_first(&c.t, i); s.half != NET_NONE; s = net_spoke_next(&c.t, s)) {
          uint32_t j = net_spoke_vertex(&c.t, s);
          double e[3];
          vec_sub(c.mesh.points + (size_t)3 * j, p, e);
          double weight = pow(e[0] * e[0] + e[1] * e[1], -1.5), q = 3 * e[2] - e[0] * g[j][0] - e[1] * g[j][1];
          a += 2 * weight * e[0] * e[0];
          b += 2 * weight * e[0] * e[1];
          d += 2 * weight * e[1] * e[1];
          for (int k = 0; k < 2; k++) r[k] += weight * q * e[k];
        }
        g[i][0] = (d * r[0] - b * r[1]) / (a * d - b * b);
        g[i][1] = (a * r[1] - b * r[0]) / (a * d - b * b);
      }
    double worst = 0, largest = 0;
    for (size_t i = 0; i < c.t.nodes; i++)
      for (int k = 0; k < 2; k++) {
        double slope = -c.normals[3 * i + (size_t)k] / c.normals[3 * i + 2];
        worst = fmax(worst, fabs(slope - g[i][k]));
        largest = fmax(largest, fabs(g[i][k]));
      }
    T_RATIO(worst / largest, 1e-9, "gradients of Nielson's network, %s", f ? "Laplace-Beltrami" : "simple");
    case_free(&c);
  }
  free(up);
  free(g);
  scene_mesh_free(&mesh);
}

/* ---- energy, solvers, stopping ---------------------------------------------------------------------- */

static void test_energy(void) {
  for (int f = 0; f < 2; f++) {
    batten_network_options o = case_options();
    o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
    o.weight_power = f ? 3 : 1.5;
    network_case c = solved(scene_mesh_blob(2, 0.1), &o, 1);
    case_frames(&c);
    double zero[2] = {0}, sum = 0;
    rival r = {&c, &o, NULL};
    for (size_t e = 0; e < c.t.edges; e++) sum += rival_edge(&r, e, zero, zero);
    T_RATIO(fabs(c.figures.energy / sum - 1), f ? 1e-5 : 1e-13, "energy of the last curves, %s",
            f ? "Laplace-Beltrami" : "simple");
    case_free(&c);
  }
  /* with the normals of the unit sphere the integral of the curvature's square is the length of the great arcs, but
     for what cubics are off by */
  double error[2];
  for (int n = 0; n < 2; n++) {
    batten_network_options o = case_options();
    o.functional = BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI;
    o.normals = BATTEN_NORMALS_SPHERE;
    o.normal_passes = 0;
    network_case c = solved(scene_mesh_icosphere(n ? 12 : 6), &o, 1);
    double length = 0;
    for (size_t e = 0; e < c.t.edges; e++) {
      uint32_t h = c.t.half[e];
      length +=
          case_angle(c.t.points + (size_t)3 * c.t.triangles[h], c.t.points + (size_t)3 * c.t.triangles[net_next(h)]);
    }
    error[n] = fabs(c.figures.energy / length - 1);
    case_free(&c);
  }
  T_RATIO(error[0], 1e-5, "Laplace-Beltrami on a sphere: the length of all arcs");
  T_RATIO(error[1] / error[0], 0.08, "sixteen times as near with half the edges");
}

static void test_direct(void) {
  batten_network_options o = case_options();
  o.normal_passes = 1;
  network_case a = solved(scene_mesh_blob(4, 0.09), &o, 1);
  o.solver = BATTEN_NETWORK_DIRECT;
  network_case b = solved(scene_mesh_blob(4, 0.09), &o, 1);
  T_RATIO(normals_apart(&a, &b), 1e-11, "one pass, conjugate gradients against Cholesky");
  T_CHECK(a.figures.cg_iterations > 0 && b.figures.cg_iterations == 0, "%zu steps and none", a.figures.cg_iterations);
  T_RATIO(b.figures.residual, 1e-13, "residual of Cholesky");
  o.normal_passes = 30;
  run(&b, &o);
  o.solver = BATTEN_NETWORK_CG;
  run(&a, &o);
  T_RATIO(normals_apart(&a, &b), 1e-7, "converged (%u and %u passes)", a.figures.normal_passes,
          b.figures.normal_passes);
  case_free(&a);
  case_free(&b);
}

static void test_stop(void) {
  batten_network_options o = case_options();
  o.normal_passes = 0;
  network_case c = solved(scene_mesh_sphere_irregular(), &o, 1);
  double *before = malloc(c.t.nodes * 3 * sizeof *before);
  net_normals_make(c.ctx, &c.t, &o, before);
  T_CHECK(memcmp(before, c.normals, c.t.nodes * 3 * sizeof *before) == 0 && c.figures.normal_passes == 0 &&
              c.figures.unknowns == 0 && c.figures.energy == c.figures.energy_start,
          "no pass, no change");
  o.normal_passes = 30;
  o.normal_tol_rad = 1e-3;
  run(&c, &o);
  unsigned coarse = c.figures.normal_passes;
  T_CHECK(c.figures.normal_change < 1e-3, "stops below the tolerance after %u passes", coarse);
  o.normal_tol_rad = 1e-9;
  run(&c, &o);
  T_CHECK(c.figures.normal_passes > coarse && c.figures.normal_change < 1e-9, "later for a smaller one: %u",
          c.figures.normal_passes);
  /* from its own result it has nothing left to do */
  memcpy(before, c.normals, c.t.nodes * 3 * sizeof *before);
  net_g1(c.ctx, &c.t, &o, c.normals, c.local, &c.figures);
  T_CHECK(c.figures.normal_passes <= 2, "its result is a fixed point");
  free(before);
  case_free(&c);
  o = case_options();
  o.normal_passes = 3;
  c = solved(scene_mesh_octahedron_shifted(0.5, 0.3), &o, 1);
  T_CHECK(c.figures.normal_passes == 3 && c.figures.normal_change > 1e-6, "the most passes are kept");
  case_free(&c);
}

/* Meshes on which the plain iteration goes on to turn normals by up to 1.7, and folds the network. */
static void test_no_folds(void) {
  for (int m = 0; m < 3; m++)
    for (int f = 0; f < 2; f++)
      for (int p = 0; p < 4; p += 3) {
        const double shift[3][2] = {{0.5, 0.3}, {1, 0.6}, {1.2, 0.72}};
        batten_network_options o = case_options();
        o.weight_power = p;
        o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
        network_case c = solved(scene_mesh_octahedron_shifted(shift[m][0], shift[m][1]), &o, 1);
        double *start = malloc(c.t.nodes * 3 * sizeof *start), most = 0;
        net_normals_make(c.ctx, &c.t, &o, start);
        for (size_t i = 0; i < c.t.nodes; i++) most = fmax(most, case_angle(start + 3 * i, c.normals + 3 * i));
        T_CHECK(most < 0.95,
                "octahedron shifted by %g, %s, power %d: normals turned by %.2f (%u passes, last turn %.1e)",
                shift[m][0], f ? "Laplace-Beltrami" : "simple", p, most, c.figures.normal_passes,
                c.figures.normal_change);
        free(start);
        case_free(&c);
      }
}

/* ---- constraints -------------------------------------------------------------------------------------- */

static void test_constraints(void) {
  batten_network_options o = case_options();
  enum { V = 42 };
  for (int f = 0; f < 2; f++) {
    net_constraint constraint[V] = {{.kind = NET_FREE}};
    scene_mesh mesh = scene_mesh_sphere_noisy();
    uint64_t seed = 3;
    for (size_t i = 0; i < V; i += 3) { /* tangents near the sphere's planes */
      for (int d = 0; d < 2; d++) {
        double turn[3];
        case_random_unit(&seed, turn);
        vec_cross(mesh.points + 3 * i, turn, constraint[i].d[d]);
        vec_normalize(constraint[i].d[d]);
        for (int k = 0; k < 3; k++) constraint[i].d[d][k] += 0.05 * turn[k];
        vec_normalize(constraint[i].d[d]);
      }
      double across[3];
      vec_cross(constraint[i].d[0], constraint[i].d[1], across);
      constraint[i].kind = i % 2 && vec_norm(across) > 0.5 ? NET_CORNER : NET_CREASED;
    }
    o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
    double moved,
        gain = one_pass_gain(scene_mesh_from(V, mesh.points, mesh.triangles, mesh.corners), o, constraint, &moved);
    T_RATIO(gain, f ? 1e-5 : 1e-11, "least value under constraints (normals moved by %.2g)", moved);
    network_case c = case_make(mesh, 1);
    c.t.constraint = constraint;
    run(&c, &o);
    double worst = 0;
    size_t unknowns = 0;
    for (size_t i = 0; i < V; i++) {
      unknowns += constraint[i].kind == NET_FREE ? 2 : constraint[i].kind == NET_CREASED;
      for (int d = 0; d < (int)constraint[i].kind; d++)
        worst = fmax(worst, fabs(vec_dot(c.normals + 3 * i, constraint[i].d[d])));
    }
    T_RATIO(worst, 1e-14, "normals stay orthogonal to their creases (%u passes, last turn %.1e)",
            c.figures.normal_passes, c.figures.normal_change);
    T_CHECK(c.figures.unknowns == unknowns && c.figures.normal_change < 1e-6, "%zu unknowns", unknowns);
    c.t.constraint = NULL;
    case_free(&c);
  }
}

/* Tangents of a network lie in the planes of all nodes at their ends. */
static double tangents_off(const network_case *c) {
  double off = 0;
  for (uint32_t e = 0; e < c->t.edges; e++)
    for (unsigned end = 0; end < 2; end++)
      for (unsigned side = 0; side < 2; side++) {
        uint32_t node = net_edge_node(&c->t, e, end, side);
        const double *t = c->local[e].t[end];
        if (node != NET_NONE) off = fmax(off, fabs(vec_dot(t, c->normals + (size_t)3 * node)) / vec_norm(t));
      }
  return off;
}

static network_case featured(scene_mesh mesh, const batten_network_options *o) {
  network_case c = {.ctx = t_context(NULL, NULL, 1), .mesh = mesh};
  batten_status st = net_topology_make(c.ctx, mesh.vertices, mesh.points, mesh.triangles, mesh.corners, &c.t);
  if (st == BATTEN_OK) st = net_features_make(c.ctx, o, &c.t);
  if (st != BATTEN_OK) t_line(false, "features: %s", batten_error(c.ctx));
  c.normals = calloc(c.t.nodes + 1, 3 * sizeof *c.normals);
  c.nodes = calloc(c.t.nodes + 1, sizeof *c.nodes);
  c.local = calloc(c.t.edges + 1, sizeof *c.local);
  run(&c, o);
  return c;
}

static void test_creases(void) {
  batten_network_options o = case_options();
  o.crease_angle_deg = 40;
  network_case c = featured(scene_mesh_cube_26(), &o);
  double worst = 0;
  for (size_t h = 0; h < 3 * c.t.faces; h++) {
    const uint32_t *corner = c.t.triangles + h / 3 * 3;
    double normal[3];
    vec_triangle_normal(c.t.points + (size_t)3 * corner[0], c.t.points + (size_t)3 * corner[1],
                        c.t.points + (size_t)3 * corner[2], normal);
    worst = fmax(worst, case_angle(normal, c.normals + (size_t)3 * c.t.node[h]));
  }
  T_RATIO(worst, 1e-14, "a cube with creases keeps its sides' normals");
  T_RATIO(c.figures.energy, 1e-24, "and is flat");
  T_CHECK(c.t.nodes == 6 + 2 * 12 + 3 * 8 && c.figures.unknowns == 2 * 6 + 2 * 12, "%zu nodes, %zu unknowns",
          c.t.nodes, c.figures.unknowns);
  case_free(&c);

  /* a crease around the outside of a torus, once round; and one that ends inside, at two darts */
  enum { ROUND = 10, TUBE = 6 };
  uint32_t ring[ROUND][2];
  for (uint32_t i = 0; i < ROUND; i++) {
    ring[i][0] = i * TUBE;
    ring[i][1] = (i + 1) % ROUND * TUBE;
  }
  for (int f = 0; f < 2; f++)
    for (int l = 0; l < 4; l++)
      for (size_t count = 3; count <= ROUND; count += ROUND - 3) {
        o = case_options();
        o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
        o.length = lengths[l];
        o.crease_count = count;
        o.creases = &ring[0][0];
        c = featured(scene_mesh_torus(ROUND, TUBE), &o);
        T_RATIO(tangents_off(&c), 1e-14, "torus, %zu creases, L%d: tangents lie in the planes at both sides", count,
                l + 1);
        T_CHECK(c.figures.normal_change < 1e-6 && c.t.nodes == c.mesh.vertices + (count == ROUND ? ROUND : 2),
                "%zu nodes, %u passes", c.t.nodes, c.figures.normal_passes);
        case_free(&c);
      }
}

/* Curves given by lines: at every vertex inside a line the tangents of its two edges are opposite. */
static void test_lines(void) {
  batten_network_options o = case_options();
  scene_mesh mesh = scene_mesh_valve();
  o.line_count = mesh.lines;
  o.line_starts = mesh.line_starts;
  o.line_vertices = mesh.line_vertices;
  network_case c = featured(mesh, &o);
  double worst = 0;
  size_t joints = 0;
  for (size_t n = 0; n < mesh.lines; n++)
    for (size_t i = mesh.line_starts[n]; i + 2 < mesh.line_starts[n + 1]; i++) {
      const uint32_t *v = mesh.line_vertices + i;
      const double *tangent[2] = {NULL, NULL};
      for (uint32_t e = 0; e < c.t.edges; e++)
        for (unsigned end = 0; end < 2; end++) {
          uint32_t h = c.t.half[e], own = c.t.triangles[end ? net_next(h) : h],
                   other = c.t.triangles[end ? h : net_next(h)];
          for (int k = 0; k < 2; k++)
            if (own == v[1] && other == v[2 * k]) tangent[k] = c.local[e].t[end];
        }
      if (!tangent[0] || !tangent[1]) continue;
      double back[3] = {-tangent[0][0], -tangent[0][1], -tangent[0][2]};
      worst = fmax(worst, case_angle(back, tangent[1]));
      joints++;
    }
  T_CHECK(joints > 200, "%zu vertices inside lines", joints);
  T_RATIO(worst, 1e-14, "every line is one smooth curve");
  T_RATIO(tangents_off(&c), 1e-14, "on the surface (%u passes)", c.figures.normal_passes);
  case_free(&c);
}

/* ---- invariance and edges ------------------------------------------------------------------------------ */

static void test_invariance(void) {
  for (int f = 0; f < 2; f++) {
    batten_network_options o = case_options();
    o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
    o.normal_tol_rad = 1e-10;
    network_case a = solved(scene_mesh_blob(3, 0.1), &o, 1), b;
    double r[3][3], worst = 0;
    case_rotation(17, r);
    scene_mesh turned = scene_mesh_blob(3, 0.1);
    size_t V = turned.vertices, F = turned.triangles;
    for (size_t v = 0; v < V; v++)
      case_rotate((const double(*)[3])r, a.mesh.points + 3 * v, turned.points + 3 * (V - 1 - v));
    for (size_t h = 0; h < 3 * F; h++)
      turned.corners[h] = (uint32_t)(V - 1 - a.mesh.corners[3 * (F - 1 - h / 3) + (h + 1) % 3]);
    b = solved(turned, &o, 1);
    for (size_t v = 0; v < V; v++) {
      double expected[3];
      case_rotate((const double(*)[3])r, a.normals + 3 * v, expected);
      worst = fmax(worst, case_angle(expected, b.normals + 3 * (V - 1 - v)));
    }
    T_RATIO(worst, 1e-9, "turned and numbered anew");
    case_free(&b);
    for (int s = -40; s <= 40; s += 80) {
      scene_mesh scaled = scene_mesh_blob(3, 0.1);
      scene_mesh_scale(&scaled, ldexp(1, s), ldexp(1, s), ldexp(1, s));
      b = solved(scaled, &o, 1);
      T_CHECK(memcmp(a.normals, b.normals, V * 3 * sizeof *a.normals) == 0, "2^%d times the mesh: same bits", s);
      case_free(&b);
    }
    case_free(&a);
    a = solved(scene_mesh_blob(14, 0.03), &o, 1);
    b = solved(scene_mesh_blob(14, 0.03), &o, 4);
    T_CHECK(memcmp(a.normals, b.normals, a.t.nodes * 3 * sizeof *a.normals) == 0 &&
                memcmp(a.local, b.local, a.t.edges * sizeof *a.local) == 0 &&
                memcmp(&a.figures, &b.figures, sizeof a.figures) == 0,
            "%zu nodes: same bits with 1 and 4 threads", a.t.nodes);
    case_free(&a);
    case_free(&b);
  }
}

static void test_open(void) {
  for (int m = 0; m < 5; m++) {
    static const char *const names[] = {"triangle", "hinge", "ears", "graph", "panel"};
    batten_network_options o = case_options();
    network_case c = solved(m == 0   ? scene_mesh_triangle()
                            : m == 1 ? scene_mesh_hinge()
                            : m == 2 ? scene_mesh_ears(5)
                            : m == 3 ? scene_mesh_graph_7()
                                     : scene_mesh_panel(),
                            &o, 1);
    double off = 0;
    bool finite = true;
    for (size_t e = 0; e < c.t.edges; e++)
      for (unsigned end = 0; end < 2; end++) {
        const double *t = c.local[e].t[end], *n = c.normals + (size_t)3 * net_edge_node(&c.t, (uint32_t)e, end, 0);
        off = fmax(off, fabs(vec_dot(t, n)) / vec_norm(t));
        finite &= isfinite(vec_norm(t)) && vec_norm(t) > 0;
      }
    T_CHECK(finite && c.figures.normal_change < 1e-6, "%s: converged after %u passes", names[m],
            c.figures.normal_passes);
    T_RATIO(off, 1e-14, "t lies in the planes of the last normals");
    if (m == 3) { /* normals of the graph, better than they were */
      double worst[2] = {0}, *start = malloc(c.t.nodes * 3 * sizeof *start);
      net_normals_make(c.ctx, &c.t, &o, start);
      for (size_t i = 0; i < c.t.nodes; i++) {
        const double *p = c.mesh.points + 3 * i, *const normals[2] = {start + 3 * i, c.normals + 3 * i};
        double exact[3] = {-(0.8 * p[0] + 0.16 * p[1] + 0.294 * p[0] * p[0]), -(0.16 * p[0] - 0.702 * p[1]), 1};
        for (int k = 0; k < 2; k++) worst[k] = fmax(worst[k], case_angle(normals[k], exact));
      }
      T_CHECK(worst[1] < 0.5 * worst[0], "normals of the graph: off by %.3f at first, %.3f at the end", worst[0],
              worst[1]);
      free(start);
    }
    case_free(&c);
  }
}

/* ---- memory and cancelling --------------------------------------------------------------------------- */

static batten_status whole(batten_context *ctx, void *arg) {
  const batten_network_options *o = arg;
  scene_mesh mesh = scene_mesh_graph(5);
  net_topology t;
  net_figures figures;
  net_local local[200];
  double normals[75];
  batten_status st = net_topology_make(ctx, mesh.vertices, mesh.points, mesh.triangles, mesh.corners, &t);
  if (st == BATTEN_OK) {
    st = net_normals_make(ctx, &t, o, normals);
    if (st == BATTEN_OK) st = net_g1(ctx, &t, o, normals, local, &figures);
    net_topology_free(ctx, &t);
  }
  scene_mesh_free(&mesh);
  return st;
}

static void test_failures(void) {
  for (int f = 0; f < 2; f++) {
    batten_network_options o = case_options();
    o.functional = f ? BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI : BATTEN_FUNCTIONAL_SIMPLE;
    o.length = f ? BATTEN_LENGTH_L4 : BATTEN_LENGTH_L2;
    o.solver = f ? BATTEN_NETWORK_DIRECT : BATTEN_NETWORK_CG;
    t_fail_every_allocation("net_g1", whole, &o);
    t_cancel_every_progress("net_g1", whole, &o);
  }
}

int main(void) {
  test_sphere();
  test_plane();
  test_minimum();
  test_condition();
  test_functional_case();
  test_energy();
  test_direct();
  test_stop();
  test_no_folds();
  test_constraints();
  test_creases();
  test_lines();
  test_invariance();
  test_open();
  test_failures();
  return t_done();
}
