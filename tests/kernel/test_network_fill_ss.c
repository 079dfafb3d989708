/* The fill by three quartics, and PN triangles. */
#include <time.h>

#include "network_check.h"

static size_t fill_ss(const check_net *n, bool classic, const check_patches *out) {
  size_t clamped = 0;
  for (size_t f = 0; f < n->t.faces; f++) {
    double edges[3][4][3], normal[3][3];
    check_cubics(n, f, edges, normal);
    clamped += net_fill_ss(classic, (const double(*)[4][3])edges, (const double(*)[3])normal,
                           (double(*)[15][3])check_patch(out, 3 * f));
  }
  return clamped;
}

static void fill_pn(const check_net *n, const check_patches *out) {
  for (size_t f = 0; f < n->t.faces; f++) {
    double corner[3][3], normal[3][3];
    for (size_t k = 0; k < 3; k++)
      for (size_t x = 0; x < 3; x++) {
        corner[k][x] = n->t.points[3 * n->t.triangles[3 * f + k] + x];
        normal[k][x] = n->normals[3 * n->t.node[3 * f + k] + x];
      }
    net_fill_pn((const double(*)[3])corner, (const double(*)[3])normal, check_patch(out, f));
  }
}

/* One facet of some roundness: corners, normals near to (0, 0, 1), tangents in their planes. */
static void random_facet(uint64_t *seed, double edges[3][4][3], double normal[3][3]) {
  double corner[3][3] = {{0, 0, 0}, {1, 0.1, 0}, {0.2, 0.9, 0.1}};
  for (int k = 0; k < 3; k++)
    for (int x = 0; x < 3; x++) {
      corner[k][x] += 0.2 * (t_uniform(seed) - 0.5);
      normal[k][x] = (x == 2) + 0.6 * (t_uniform(seed) - 0.5);
    }
  for (int k = 0; k < 3; k++) vec_normalize(normal[k]);
  for (int k = 0; k < 3; k++) {
    int j = (k + 1) % 3;
    double chord[3];
    vec_sub(corner[j], corner[k], chord);
    double at_k = vec_dot(chord, normal[k]), at_j = vec_dot(chord, normal[j]);
    for (int x = 0; x < 3; x++) {
      edges[k][0][x] = corner[k][x];
      edges[k][1][x] = corner[k][x] + (chord[x] - at_k * normal[k][x]) / 3;
      edges[k][2][x] = corner[j][x] - (chord[x] - at_j * normal[j][x]) / 3;
      edges[k][3][x] = corner[j][x];
    }
  }
}

/* Straight sides: every control point is where the linear function has it, by hand. */
static void test_straight(void) {
  const double corner[3][3] = {{0, 0, 0}, {4, 1, 2}, {-1, 3, 1}};
  double normal[3][3], edges[3][4][3], out[3][15][3], inner[3], worst = 0;
  for (int k = 0; k < 3; k++) {
    vec_triangle_normal(corner[0], corner[1], corner[2], normal[k]);
    vec_normalize(normal[k]);
    for (int m = 0; m < 4; m++)
      for (int x = 0; x < 3; x++) edges[k][m][x] = ((3 - m) * corner[k][x] + m * corner[(k + 1) % 3][x]) / 3;
  }
  for (int x = 0; x < 3; x++) inner[x] = (corner[0][x] + corner[1][x] + corner[2][x]) / 3;
  for (int classic = 0; classic < 2; classic++) {
    bool clamped = net_fill_ss(classic, (const double(*)[4][3])edges, (const double(*)[3])normal, out);
    for (unsigned p = 0; p < 3; p++)
      for (unsigned k = 0; k <= 4; k++)
        for (unsigned j = 0; j + k <= 4; j++)
          for (int x = 0; x < 3; x++) {
            double hand = ((4 - j - k) * corner[p][x] + j * corner[(p + 1) % 3][x] + k * inner[x]) / 4;
            worst = fmax(worst, fabs(out[p][triangular_index(4, j, k)][x] - hand));
          }
    T_CHECK(!clamped, "straight sides need no substitute");
  }
  T_RATIO(worst, 4e-15, "three quartics on straight sides are linear");
  double pn[10][3];
  net_fill_pn(corner, (const double(*)[3])normal, pn);
  worst = 0;
  for (unsigned k = 0; k <= 3; k++)
    for (unsigned j = 0; j + k <= 3; j++)
      for (int x = 0; x < 3; x++)
        worst = fmax(worst, fabs(pn[triangular_index(3, j, k)][x] -
                                 ((3 - j - k) * corner[0][x] + j * corner[1][x] + k * corner[2][x]) / 3));
  T_RATIO(worst, 4e-15, "so are PN triangles");
}

/* The published constants of the classic fill: P = 2/3 L - 1/2 S + 1/6 A, R = 7/4 P + 3/4 Z - 1/2 S. */
static void test_constants(void) {
  uint64_t seed = 4;
  double worst = 0;
  for (int trial = 0; trial < 50; trial++) {
    double edges[3][4][3], normal[3][3], o[3][15][3];
    random_facet(&seed, edges, normal);
    net_fill_ss(true, (const double(*)[4][3])edges, (const double(*)[3])normal, o);
    for (int i = 0; i < 3; i++)
      for (int x = 0; x < 3; x++) {
        int before = (i + 2) % 3;
        double a = o[i][0][x], s = (4 * o[i][5][x] - a) / 3, p = 2 * o[i][9][x] - s, z = o[i][14][x];
        double l = o[i][6][x] + o[before][7][x], r = o[i][10][x] + o[before][10][x];
        double centroid = (a + edges[i][1][x] + edges[before][2][x]) / 3;
        worst = fmax(worst, fabs(s - centroid));
        worst = fmax(worst, fabs(p - (2. / 3 * l - 0.5 * s + a / 6)));
        worst = fmax(worst, fabs(r - (7. / 4 * p + 3. / 4 * z - 0.5 * s)));
        worst = fmax(worst, fabs(z - (o[0][12][x] + o[1][12][x] + o[2][12][x] - 0.75 * z) / 2.25));
      }
  }
  T_RATIO(worst, 1e-14, "the classic fill has the constants 2/3, -1/2, 1/6 and 7/4, 3/4, -1/2");
}

static void test_invariance(void) {
  uint64_t seed = 9;
  double turned_worst = 0;
  bool scaled_same = true;
  for (int trial = 0; trial < 50; trial++) {
    double edges[3][4][3], normal[3][3], o[3][15][3], again[3][15][3], other[3][4][3], other_normal[3][3];
    random_facet(&seed, edges, normal);
    net_fill_ss(false, (const double(*)[4][3])edges, (const double(*)[3])normal, o);
    for (int k = 0; k < 3; k++) {
      memcpy(other[k], edges[(k + 1) % 3], sizeof other[k]);
      memcpy(other_normal[k], normal[(k + 1) % 3], sizeof other_normal[k]);
    }
    net_fill_ss(false, (const double(*)[4][3])other, (const double(*)[3])other_normal, again);
    for (int k = 0; k < 3; k++)
      for (int m = 0; m < 15; m++) turned_worst = fmax(turned_worst, vec_distance(again[k][m], o[(k + 1) % 3][m]));
    for (int k = 0; k < 36; k++) ((double *)other)[k] = ldexp(((double *)edges)[k], 40);
    net_fill_ss(false, (const double(*)[4][3])other, (const double(*)[3])normal, again);
    for (int k = 0; k < 135; k++) scaled_same &= ((double *)again)[k] == ldexp(((double *)o)[k], 40);
  }
  T_RATIO(turned_worst, 1e-14, "the fill does not depend on the corner at which the facet begins");
  T_CHECK(scaled_same, "the fill of a facet 2^40 times as large has the same bits");
}

/* The stated substitutes: a curve without derivative at an end, a factor out of its bounds. */
static void test_degenerate(void) {
  uint64_t seed = 2;
  double edges[3][4][3], normal[3][3], o[3][15][3];
  random_facet(&seed, edges, normal);
  memcpy(edges[0][1], edges[0][0], sizeof edges[0][1]);
  bool clamped = net_fill_ss(true, (const double(*)[4][3])edges, (const double(*)[3])normal, o);
  bool finite = true;
  for (int k = 0; k < 135; k++) finite &= isfinite(((double *)o)[k]) != 0;
  T_CHECK(clamped && finite, "a derivative of length zero is told and met");
  random_facet(&seed, edges, normal);
  for (int x = 0; x < 3; x++) { /* the side opposite to corner 0 bulges far out */
    edges[1][1][x] += 6 * (edges[1][1][x] - edges[0][0][x]);
    edges[1][2][x] += 6 * (edges[1][2][x] - edges[0][0][x]);
  }
  clamped = net_fill_ss(false, (const double(*)[4][3])edges, (const double(*)[3])normal, o);
  double s[3];
  for (int x = 0; x < 3; x++) s[x] = (o[0][5][x] - o[0][0][x]) * 4;
  double ratio = vec_norm(s), way = 0;
  for (int x = 0; x < 3; x++) s[x] = edges[0][1][x] + edges[2][2][x] - 2 * edges[0][0][x];
  way = vec_norm(s);
  T_CHECK(clamped && fabs(ratio / way - 2) < 1e-12, "the factor ends at 2: %.15g", ratio / way);
  T_CHECK(!net_fill_ss(true, (const double(*)[4][3])edges, (const double(*)[3])normal, o),
          "the classic fill knows no factor");
}

static scene_mesh shifted(void) { return scene_mesh_octahedron_shifted(0.5, 0.3); }
static scene_mesh sphere_42(void) { return scene_mesh_icosphere(2); }

typedef struct scene {
  const char *name;
  scene_mesh (*make)(void);
} scene;

/* Joints on all scenes, from estimated normals with D1 and L1. */
static void test_joints(batten_context *ctx) {
  static const scene scenes[] = {{"octahedron", scene_mesh_octahedron},
                                 {"tetrahedron", scene_mesh_tetrahedron},
                                 {"irregular sphere", scene_mesh_sphere_irregular},
                                 {"noisy sphere", scene_mesh_sphere_noisy},
                                 {"ellipsoid", scene_mesh_ellipsoid_long},
                                 {"torus", scene_mesh_torus_10_6},
                                 {"cube", scene_mesh_cube_26},
                                 {"genus 3", scene_mesh_genus3},
                                 {"graph", scene_mesh_graph_7},
                                 {"panel", scene_mesh_panel},
                                 {"valve", scene_mesh_valve},
                                 {"one triangle", scene_mesh_triangle},
                                 {"two triangles", scene_mesh_hinge}};
  batten_network_options o = check_options(0);
  o.direction = BATTEN_DIRECTION_D1;
  o.length = BATTEN_LENGTH_L1;
  for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
    check_net n;
    if (check_net_make(ctx, scenes[i].make(), &o, false, &n) < 0) {
      T_CHECK(false, "%s: %s", scenes[i].name, batten_error(ctx));
    } else {
      check_patches p = check_patches_make(&n.t, 4, 3);
      for (int classic = 0; classic < 2; classic++) {
        size_t clamped = fill_ss(&n, classic, &p);
        check_figures c = check_measure(&p, n.normals);
        bool good = c.jump_max <= 2e-11 && c.inner_max <= 2e-11 && c.gap_max <= 1e-14 && c.corner_gap == 0 &&
                    c.corner_normal_deg <= 1e-11 && clamped == 0;
        T_CHECK(good,
                "%s%s: normals differ by %.1e deg, inside by %.1e, at vertices by %.1e; gap %.1e; K %.3f .. %.3f",
                scenes[i].name, classic ? " classic" : "", c.jump_max, c.inner_max, c.corner_normal_deg, c.gap_max,
                c.K_min, c.K_max);
      }
      free(p.net);
    }
    check_net_free(ctx, &n);
  }
}

/* What is known of the methods without optimised normals: how far PN triangles miss a common normal (from a
 * prototype, on its meshes), and the range of K of the classic fill with D1 and L1. */
static void test_rivals(batten_context *ctx) {
  static const struct {
    const char *name;
    scene_mesh (*make)(void);
    double jump, tolerance, K[2];
  } rows[] = {{"octahedron", scene_mesh_octahedron, 46, 0.5, {.28, 2.52}},
              {"shifted octahedron", shifted, 60, 0.5, {.19, 3.47}},
              {"sphere of 42 vertices", sphere_42, 2.6, 0.05, {.87, 1.21}},
              {"torus", scene_mesh_torus_10_6, 13, 0.5, {-3.2, 2.2}},
              {"tetrahedron", scene_mesh_tetrahedron, 0, 180, {.068, 4.12}}};
  batten_network_options o = check_options(0);
  o.direction = BATTEN_DIRECTION_D1;
  o.length = BATTEN_LENGTH_L1;
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    check_net n;
    T_OK(check_net_make(ctx, rows[i].make(), &o, false, &n), ctx);
    check_patches pn = check_patches_make(&n.t, 3, 1), ss = check_patches_make(&n.t, 4, 3);
    fill_pn(&n, &pn);
    fill_ss(&n, true, &ss);
    check_figures a = check_measure(&pn, n.normals), b = check_measure(&ss, n.normals);
    T_CHECK(
        fabs(a.jump_max - rows[i].jump) <= rows[i].tolerance && a.corner_normal_deg <= 1e-11 && a.gap_max <= 1e-14,
        "%s, PN triangles: normals differ by %.3g deg, K %.3f .. %.3f", rows[i].name, a.jump_max, a.K_min, a.K_max);
    T_CHECK(b.jump_max <= 1e-11 && b.K_min >= rows[i].K[0] - 0.01 && b.K_max <= rows[i].K[1] + 0.01,
            "%s, classic: normals differ by %.1e deg, K %.3f .. %.3f", rows[i].name, b.jump_max, b.K_min, b.K_max);
    free(pn.net);
    free(ss.net);
    check_net_free(ctx, &n);
  }
}

/* 200 closed meshes of valences 3 .. 20. */
static void test_random(batten_context *ctx) {
  batten_network_options o = check_options(0);
  size_t clamped = 0, faces = 0, failed = 0;
  double worst = 0, inner = 0, gap = 0;
  for (uint64_t seed = 0; seed < 200; seed++) {
    check_net n;
    if (check_net_make(ctx, scene_mesh_random(seed), &o, false, &n) < 0) {
      failed++;
    } else {
      check_patches p = check_patches_make(&n.t, 4, 3);
      clamped += fill_ss(&n, false, &p);
      check_figures c = check_measure(&p, n.normals);
      worst = fmax(worst, c.jump_max);
      inner = fmax(inner, c.inner_max);
      gap = fmax(gap, c.gap_max);
      faces += n.t.faces;
      free(p.net);
    }
    check_net_free(ctx, &n);
  }
  T_CHECK(failed == 0, "200 random meshes give networks: %s", failed ? batten_error(ctx) : "all");
  T_RATIO(worst, 1e-9, "largest angle of normals across edges, degrees (%zu facets, %zu clamped)", faces, clamped);
  T_RATIO(inner, 1e-9, "largest angle inside facets, degrees");
  T_RATIO(gap, 1e-14, "largest gap");
}

static void test_flat(batten_context *ctx) {
  check_net n;
  batten_network_options o = check_options(0);
  T_OK(check_net_make(ctx, scene_mesh_plane(6), &o, false, &n), ctx);
  check_patches ss = check_patches_make(&n.t, 4, 3), pn = check_patches_make(&n.t, 3, 1);
  fill_ss(&n, false, &ss);
  fill_pn(&n, &pn);
  double worst[2] = {0};
  for (int which = 0; which < 2; which++) {
    const check_patches *p = which ? &pn : &ss;
    for (size_t i = 0; i < n.t.faces * p->parts * triangular_count(p->degree); i++)
      worst[which] = fmax(worst[which], fabs(p->net[i][2] - (0.5 * p->net[i][0] - 0.25 * p->net[i][1] + 0.125)));
  }
  T_RATIO(worst[0], 1e-15, "flat stays flat with three quartics");
  T_RATIO(worst[1], 1e-15, "flat stays flat with PN triangles");
  free(ss.net);
  free(pn.net);
  check_net_free(ctx, &n);
}

static void test_time(void) {
  uint64_t seed = 1;
  double edges[3][4][3], normal[3][3], o[3][15][3], sum = 0;
  random_facet(&seed, edges, normal);
  clock_t start = clock();
  enum { TIMES = 20000 };
  for (int i = 0; i < TIMES; i++) {
    edges[0][1][2] += 1e-9;
    net_fill_ss(false, (const double(*)[4][3])edges, (const double(*)[3])normal, o);
    sum += o[2][14][2];
  }
  double us = (double)(clock() - start) / CLOCKS_PER_SEC / TIMES * 1e6;
  T_CHECK(isfinite(sum), "three quartics take %.2f us a facet", us);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_straight();
  test_constants();
  test_invariance();
  test_degenerate();
  test_flat(ctx);
  test_joints(ctx);
  test_rivals(ctx);
  test_random(ctx);
  test_time();
  batten_context_free(ctx);
  return t_done();
}
