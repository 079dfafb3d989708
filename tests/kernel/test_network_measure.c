/* Measures of networks: by hand, against closed forms integrated another way, and where there is nothing to measure.
 */
#include "mesh/vec.h"
#include "network/regular.h"
#include "network/surface.h"
#include "network_scenes.h"
#include "network_shapes.h"
#include "tap.h"

#include <float.h>

static void plane(const double xy[2], double out[3]) {
  out[0] = xy[0] + 0.2 * xy[0] * xy[1];
  out[1] = xy[1] + 0.1 * xy[0] * xy[0];
  out[2] = 2 - out[0];
}
static batten_network_measures measured(batten_context *ctx, const shape *s) {
  batten_network *n = network_of(ctx, s);
  batten_network_measures m;
  memset(&m, 0xff, sizeof m);
  T_OK(batten_network_measure(ctx, n, &m), ctx);
  batten_network_free(n);
  return m;
}
static double off(double a, double b) { return fabs(a - b) / fmax(fabs(b), 1e-300); }

static void test_by_hand(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network_measures m = measured(ctx, &s);
  T_RATIO(off(m.area, 4 * sqrt(3)) + off(m.volume, 4 / 3.0), 1e-14, "octahedron: area and volume");
  T_CHECK(vec_norm(m.centroid) < 1e-15 && m.closed && m.components == 1 && m.boundary_edges == 0 && m.euler == 2 &&
              m.genus == 0,
          "centroid, topology");
  T_CHECK(m.gauss_min == 0 && m.gauss_max == 0 && m.gauss_p50 == 0 && m.gauss_integral == 0 && m.fairness == 0 &&
              fabs(m.regularity_min - 1) < 1e-12 && m.irregular_patches == 0,
          "flat and regular");
  for (int d = 0; d < 3; d++) T_CHECK(m.lower[d] == -1 && m.upper[d] == 1, "box along axis %d", d);
  shape_free(&s);
}

/* Gauss-Legendre nodes on [-1, 1] by Newton's method on the polynomials. */
enum { FINE = 40 };
static void gauss_rule(double x[FINE], double w[FINE]) {
  for (int i = 0; i < FINE; i++) {
    double z = cos(SHAPE_PI * (i + 0.75) / (FINE + 0.5)), slope = 1;
    for (int pass = 0; pass < 20; pass++) {
      double p = 1, before = 0;
      for (int k = 0; k < FINE; k++) {
        double next = ((2 * k + 1) * z * p - k * before) / (k + 1);
        before = p;
        p = next;
      }
      slope = FINE * (z * p - before) / (z * z - 1);
      z -= p / slope;
    }
    x[i] = z;
    w[i] = 2 / ((1 - z * z) * slope * slope);
  }
}

/* z = -r^2 / 2 turns about its axis: with s the arc of the meridian, k1 = (1 + r^2)^(-3/2) along it and
 * k2 = (1 + r^2)^(-1/2) around, and |grad II|^2 = (dk1/ds)^2 + 3 (dk2/ds)^2. */
static void test_cap(batten_context *ctx, unsigned split) {
  shape s = shape_graph(4, 2, split, shape_cap);
  batten_network_measures m = measured(ctx, &s);
  double x[FINE], w[FINE], area = 0, gauss = 0, fairness = 0, moment = 0;
  gauss_rule(x, w);
  for (int i = 0; i < FINE; i++)
    for (int k = 0; k < FINE; k++) {
      double rr = x[i] * x[i] + x[k] * x[k], q = 1 + rr, da = w[i] * w[k] * sqrt(q);
      area += da;
      moment -= da * rr / 2;
      gauss += da / (q * q);
      fairness += da * (9 * rr / pow(q, 6) + 3 * rr / pow(q, 4));
    }
  T_RATIO(off(m.area, area), 1e-11, "cap, split %u: area", split);
  T_RATIO(off(m.gauss_integral, gauss), 1e-10, "integral of K");
  T_RATIO(off(m.fairness, fairness), 1e-8, "integral of |grad II|^2");
  T_RATIO(fabs(m.centroid[0]) + fabs(m.centroid[1]) + off(m.centroid[2], moment / area), 1e-11, "centroid");
  T_CHECK(isnan(m.volume) && !m.closed && m.genus == -1 && m.euler == 1 && m.boundary_edges == 16, "open");
  T_RATIO(fabs(m.gauss_max - 1) + fabs(m.gauss_min - 1 / 9.0) + fabs(m.mean_max - 1) +
              fabs(m.mean_min - 0.5 * (pow(3, -1.5) + pow(3, -0.5))),
          1e-10, "extremes of K and H, at vertices");
  /* K = (1 + r^2)^-2 falls outwards: 2 % of the area lie within r of the middle, area 2 pi ((1 + r^2)^(3/2) - 1) / 3.
   */
  double k98 = pow(1 + 3 * 0.02 * area / (2 * SHAPE_PI), -4 / 3.0);
  T_RATIO(off(m.gauss_p98, k98), 0.01, "98 %% of the area have a K below %.4f", k98);
  T_CHECK(m.gauss_min < m.gauss_p01 && m.gauss_p01 < m.gauss_p02 && m.gauss_p02 < m.gauss_p50 &&
              m.gauss_p50 < m.gauss_p98 && m.gauss_p98 < m.gauss_p99 && m.gauss_p99 < m.gauss_max,
          "quantiles in order");
  double lower = fabs(m.lower[2] + 1), upper = m.upper[2];
  T_CHECK(lower < 1e-12 && upper > -1e-15 && upper < 3e-6 && fabs(m.lower[0] + 1) + fabs(m.upper[1] - 1) < 1e-14,
          "box: top at %.2g", upper);
  T_CHECK(m.irregular_patches == 0 && m.regularity_min > 0.5 && m.regularity_min < 1, "regular: %.3f",
          m.regularity_min);
  shape_free(&s);
}

/* On a cylinder over a parabola k1 depends on x alone: |grad II|^2 = (dk1/ds)^2; in a plane it is 0 for any
 * parameters. */
static void test_flat_ones(batten_context *ctx) {
  shape s = shape_graph(2, 3, 2, shape_ridge);
  batten_network_measures m = measured(ctx, &s);
  double x[FINE], w[FINE], fairness = 0;
  gauss_rule(x, w);
  for (int i = 0; i < FINE; i++) fairness += 2 * w[i] * 9 * x[i] * x[i] / pow(1 + x[i] * x[i], 5.5);
  T_RATIO(off(m.fairness, fairness), 1e-7, "ridge: integral of |grad II|^2");
  T_RATIO(fabs(m.gauss_integral) + fabs(m.gauss_max) + fabs(m.gauss_min), 1e-10, "ridge: no K");
  shape_free(&s);
  s = shape_graph(3, 2, 2, plane);
  m = measured(ctx, &s);
  T_RATIO(m.fairness, 1e-18, "curved parameters in a plane: fairness 0");
  T_RATIO(fmax(fabs(m.gauss_min), fabs(m.gauss_max)), 1e-18, "and no K");
  shape_free(&s);
}

/* The torus by another quadrature, through the public evaluation; Gauss-Bonnet. */
static void test_torus(batten_context *ctx) {
  for (unsigned split = 0; split < 4; split += 3) {
    shape s = shape_torus(split);
    batten_network *n = network_of(ctx, &s);
    batten_network_measures m;
    T_OK(batten_network_measure(ctx, n, &m), ctx);
    double x[FINE], w[FINE], area = 0, volume = 0, absolute = 0, moment[3] = {0, 0, 0};
    gauss_rule(x, w);
    batten_surface_point p;
    for (uint32_t k = 0; k < s.patches; k++)
      for (int i = 0; i < 13; i++)
        for (int j = 0; j < 13; j++) {
          /* 13 points of Clenshaw and Curtis, exact for degree 12; periodic sums do the rest. */
          static double cc[13];
          if (cc[6] == 0)
            for (int a = 0; a < 13; a++) {
              double sum = 1;
              for (int b = 1; b <= 6; b++)
                sum -= (b == 6 ? 1.0 : 2.0) / (4 * b * b - 1) * cos(2 * b * a * SHAPE_PI / 12);
              cc[a] = (a == 0 || a == 12 ? 1 : 2) * sum / 12;
            }
          double u = 0.5 - 0.5 * cos(i * SHAPE_PI / 12), v = (1 - u) * (0.5 - 0.5 * cos(j * SHAPE_PI / 12));
          double weight = 0.25 * cc[i] * cc[j] * (1 - u), cross[3];
          if (batten_network_evaluate(ctx, n, 1, &(batten_place){k, u, v}, &p) < 0) exit(1);
          vec_cross(p.du, p.dv, cross);
          area += weight * vec_norm(cross);
          volume += weight * vec_dot(p.point, cross) / 3;
          absolute += weight * vec_norm(cross) * fabs(p.gauss);
          for (int d = 0; d < 3; d++) moment[d] += weight * vec_dot(p.point, cross) * p.point[d] / 4;
        }
    T_RATIO(off(m.area, area), 1e-9, "torus, split %u: area against another rule", split);
    T_RATIO(off(m.volume, volume), 1e-9, "volume");
    double centroid = 0;
    for (int d = 0; d < 3; d++) centroid = fmax(centroid, fabs(m.centroid[d] - moment[d] / volume));
    T_RATIO(centroid, 1e-9, "centroid");
    T_RATIO(fabs(m.gauss_integral) / absolute, 1e-7, "Gauss and Bonnet: the integral of K is 0");
    T_CHECK(m.closed && m.genus == 1 && m.euler == 0 && m.components == 1, "genus 1");
    T_CHECK(m.irregular_patches == 0 && m.regularity_min > 0.3, "regular: %.3f", m.regularity_min);
    T_CHECK(m.gauss_min < -0.5 && m.gauss_max > 0.3 && m.gauss_min <= m.gauss_p01 && m.gauss_p99 <= m.gauss_max,
            "K in [%.3f, %.3f]", m.gauss_min, m.gauss_max);
    batten_network_free(n);
    shape_free(&s);
  }
}

/* For a graph over a square: int K = 2 pi - int kg ds - sum of the exterior angles (Gauss and Bonnet). */
static void test_gauss_bonnet_with_boundary(batten_context *ctx) {
  shape s = shape_graph(4, 3, 3, shape_saddle);
  batten_network_measures m = measured(ctx, &s);
  double x[FINE], w[FINE], turn = 0;
  gauss_rule(x, w);
  for (int side = 0; side < 4; side++) {
    static const double from[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}},
                        run[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (int i = 0; i < FINE; i++) {
      double t = 1 + x[i], a = from[side][0] + t * run[side][0], b = from[side][1] + t * run[side][1];
      double fx = 0.9 * a * a - b, fy = b - a, fxx = 1.8 * a, dx = run[side][0], dy = run[side][1];
      double c1[3] = {dx, dy, fx * dx + fy * dy}, c2[3] = {0, 0, fxx * dx * dx - 2 * dx * dy + dy * dy};
      double n[3] = {-fx, -fy, 1}, side_ways[3];
      vec_cross(n, c1, side_ways);
      turn += w[i] * vec_dot(c2, side_ways) / (vec_norm(n) * vec_dot(c1, c1)); /* kg ds */
    }
    double a = from[side][0], b = from[side][1], fx = 0.9 * a * a - b, fy = b - a;
    int before = (side + 3) % 4;
    double in[3] = {run[before][0], run[before][1], fx * run[before][0] + fy * run[before][1]};
    double out[3] = {run[side][0], run[side][1], fx * run[side][0] + fy * run[side][1]}, cross[3];
    vec_cross(in, out, cross);
    turn += atan2(vec_norm(cross), vec_dot(in, out));
  }
  T_RATIO(fabs(m.gauss_integral + turn - 2 * SHAPE_PI), 1e-7, "Gauss and Bonnet with a boundary and corners");
  shape_free(&s);
}

static void test_units(batten_context *ctx, batten_context *three) {
  shape s[3];
  batten_network_measures m[4];
  for (int i = 0; i < 3; i++) s[i] = shape_torus(4);
  shape_move(&s[1], false, 0x1p-60, (double[3]){0, 0, 0});
  shape_move(&s[2], true, 1, (double[3]){100, 200, -300});
  for (int i = 0; i < 3; i++) m[i] = measured(ctx, &s[i]);
  m[3] = measured(three, &s[0]);
  T_CHECK(!memcmp(&m[0].area, &m[3].area, sizeof(double) * 5) && m[0].fairness == m[3].fairness &&
              m[0].gauss_p98 == m[3].gauss_p98 && m[0].gauss_integral == m[3].gauss_integral,
          "the same bits on three threads");
  T_CHECK(ldexp(m[0].area, -120) == m[1].area && ldexp(m[0].volume, -180) == m[1].volume &&
              ldexp(m[0].gauss_p02, 120) == m[1].gauss_p02 && ldexp(m[0].upper[1], -60) == m[1].upper[1] &&
              m[0].gauss_integral == m[1].gauss_integral && ldexp(m[0].fairness, 120) == m[1].fairness &&
              m[0].regularity_min == m[1].regularity_min,
          "2^-60 times as large: each figure by its power of two, to the bit");
  double centre[3] = {100, 200, -300}, away = 0,
         turned[3] = {2 / 3.0 * m[0].centroid[0] - m[0].centroid[1] / 3 + 2 / 3.0 * m[0].centroid[2]};
  away = fabs(m[2].centroid[0] - centre[0] - turned[0]);
  T_RATIO(off(m[2].area, m[0].area) + off(m[2].volume, m[0].volume) + off(m[2].fairness, m[0].fairness) + away +
              off(m[2].gauss_min, m[0].gauss_min),
          1e-8, "turned and far away: the same figures");
  for (int i = 0; i < 3; i++) shape_free(&s[i]);
}

/* Gauss and Bonnet hold where tangent planes agree, and fail where they do not: a second certificate for networks as
 * they are built, that knows nothing of the edges. */
static void test_built(batten_context *ctx) {
  static const batten_network_fill fills[4] = {BATTEN_FILL_SS, BATTEN_FILL_DEGREE7, BATTEN_FILL_DEGREE6,
                                               BATTEN_FILL_PN};
  for (int which = 0; which < 2; which++) {
    scene_mesh scene = which ? scene_mesh_genus3() : scene_mesh_octahedron_shifted(0.5, 0.3);
    batten_mesh *mesh = NULL;
    T_OK(batten_mesh_create(ctx, scene.vertices, scene.points, scene.triangles, scene.corners, &mesh), ctx);
    for (int i = 0; i < 4; i++) {
      batten_network_options opt = batten_network_options_default();
      batten_network *n = NULL;
      batten_network_info info;
      batten_network_measures m;
      opt.fill = fills[i];
      batten_status st = batten_network_build(ctx, mesh, &opt, &n, &info);
      T_CHECK(st == (i < 3 ? BATTEN_OK : BATTEN_W_ACCURACY), "fill %d of %zu facets: %s", (int)fills[i],
              scene.triangles, batten_status_name(st));
      if (st < 0) continue;
      T_OK(batten_network_measure(ctx, n, &m), ctx);
      double off_by = fabs(m.gauss_integral / (2 * SHAPE_PI) - (double)m.euler);
      T_CHECK(m.euler == (which ? -4 : 2) && m.genus == (which ? 3 : 0) && m.irregular_patches == 0, "genus %ld",
              m.genus);
      if (i < 3) T_RATIO(off_by, 3e-6, "the integral of K is 2 pi euler");
      if (i == 3) T_CHECK(off_by > 0.5, "but not on PN triangles: off by %.2g", off_by);
      batten_network_free(n);
    }
    batten_mesh_free(mesh);
    scene_mesh_free(&scene);
  }
}

/* Where few places are looked at joints may agree by symmetry: that is no certificate. The text tells what to do, and
 * blames a far origin only for what rounding can do. */
static void test_certificate(batten_context *ctx) {
  static const struct {
    batten_network_fill fill;
    unsigned samples;
    double away;
    const char *text; /* NULL: BATTEN_OK */
  } cases[] = {{BATTEN_FILL_PN, 2, 0, "check_samples: 2"},   {BATTEN_FILL_SS, 8, 0, "check_samples: 8"},
               {BATTEN_FILL_SS, 0, 0, "check_samples: 0"},   {BATTEN_FILL_SS, 9, 0, NULL},
               {BATTEN_FILL_SS, 9, 1e6, "coarse: shift it"}, {BATTEN_FILL_DEGREE7, 1000, 0, NULL},
               {BATTEN_FILL_PN, 9, 1e6, "between triangles"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    scene_mesh scene = scene_mesh_octahedron();
    batten_mesh *mesh = NULL;
    batten_network *n = NULL;
    batten_network_options opt = batten_network_options_default();
    opt.fill = cases[i].fill;
    opt.check_samples = cases[i].samples;
    for (size_t k = 0; k < 3 * scene.vertices; k++) scene.points[k] += cases[i].away;
    T_OK(batten_mesh_create(ctx, scene.vertices, scene.points, scene.triangles, scene.corners, &mesh), ctx);
    batten_status st = batten_network_build(ctx, mesh, &opt, &n, NULL);
    const char *text = st ? batten_error(ctx) : "exact";
    T_CHECK(cases[i].text ? st == BATTEN_W_ACCURACY && strstr(text, cases[i].text) : st == BATTEN_OK,
            "fill %d, %u samples, %g away: %s", (int)cases[i].fill, cases[i].samples, cases[i].away, text);
    T_CHECK(cases[i].fill != BATTEN_FILL_PN || !strstr(text, "shift it"), "shifting helps rounding only");
    batten_network_free(n);
    batten_mesh_free(mesh);
    scene_mesh_free(&scene);
  }
}

/* Of a struct of another version nothing but its size is read: memory checkers would tell. */
static void test_other_version(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network *n = network_of(ctx, &s), *built = NULL;
  batten_mesh *mesh = NULL;
  size_t *size = malloc(sizeof *size), count = 0, bytes = 0;
  double *segments = NULL;
  *size = sizeof *size;
  void *given = size;
  T_OK(batten_network_tessellate(ctx, n, NULL, &mesh), ctx);
  T_STATUS(batten_network_build(ctx, mesh, given, &built, NULL), BATTEN_E_INVALID, ctx, "struct_size: 8");
  T_STATUS(batten_network_bytes(ctx, 4, 4, given, &bytes, NULL), BATTEN_E_INVALID, ctx, "struct_size: 8");
  T_STATUS(batten_network_tessellate(ctx, n, given, &mesh), BATTEN_E_INVALID, ctx, "struct_size: 8");
  T_STATUS(batten_network_lines(ctx, n, given, &count, &segments), BATTEN_E_INVALID, ctx, "struct_size: 8");
  free(size);
  batten_mesh_free(mesh);
  batten_network_free(n);
  shape_free(&s);
}

/* ---- regularity --------------------------------------------------------------------------------- */

static void fold(const double xy[2], double out[3]) { /* along u = 0.6 */
  double x = 0.5 + 0.5 * xy[0];
  out[0] = (x - 0.6) * (x - 0.6);
  out[1] = xy[1];
  out[2] = 0.1 * x;
}
static void crease(const double xy[2], double out[3]) { /* du = 0 along x = 0.2 */
  double x = xy[0] - 0.2;
  out[0] = x * x * x;
  out[1] = xy[1];
  out[2] = x * x;
}
static void cusp(const double xy[2], double out[3]) { /* no normal at one inner point only */
  double x = xy[0] - 0.21, y = xy[1] + 0.43;
  out[0] = x * x - y * y;
  out[1] = 2 * x * y;
  out[2] = 0;
}
static void bent(const double xy[2], double out[3]) { /* a cylinder through more than a half turn: by degree 8 */
  double t = 2.2 * xy[0];
  out[1] = xy[1];
  double c = 1 - t * t / 2 + t * t * t * t / 24 - pow(t, 6) / 720 + pow(t, 8) / 40320;
  double s = t - pow(t, 3) / 6 + pow(t, 5) / 120 - pow(t, 7) / 5040;
  out[0] = s;
  out[2] = c;
}

static void test_regularity(batten_context *ctx) {
  struct {
    const char *what;
    shape_map *map;
    unsigned degree, cells;
    bool regular;
  } const cases[] = {{"a cap", shape_cap, 2, 1, true},
                     {"a saddle in degree 9", shape_saddle, 9, 1, true},
                     {"a cylinder of 250 degrees", bent, 8, 1, true},
                     {"parameters bent in a plane", plane, 12, 2, true},
                     {"a line without normal", crease, 3, 1, false},
                     {"a point without normal", cusp, 2, 1, false}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    shape s = shape_graph(cases[i].cells, cases[i].degree, 0, cases[i].map);
    batten_network_measures m = measured(ctx, &s);
    T_CHECK((m.irregular_patches == 0) == cases[i].regular, "%s: %zu patches not proven, least normal %.2g",
            cases[i].what, m.irregular_patches, m.regularity_min);
    shape_free(&s);
  }
  shape s = shape_graph(1, 2, 0, fold);
  batten_network_measures m = measured(ctx, &s);
  T_CHECK(m.irregular_patches == 0, "turned over, but with a normal everywhere");
  shape_free(&s);

  /* Random nets about a triangle: never proven where a fine grid sees the normal turn over. */
  uint64_t seed = 8;
  size_t proven = 0, wrong = 0, missed = 0;
  double *work = malloc(net_regular_work(5) * sizeof *work);
  for (int trial = 0; trial < 400; trial++) {
    double net[21][3], noise = 0.5 * t_uniform(&seed), least = 1, jet[3][3], cross[3];
    for (unsigned k = 0, i = 0; k <= 5; k++)
      for (unsigned j = 0; j + k <= 5; j++, i++) {
        net[i][0] = j / 5.0 + noise * (t_uniform(&seed) - 0.5);
        net[i][1] = k / 5.0 + noise * (t_uniform(&seed) - 0.5);
        net[i][2] = 0;
      }
    for (int k = 0; k <= 60; k++)
      for (int j = 0; j + k <= 60; j++) {
        triangular_jet(5, (const double(*)[3])net, j / 60.0, k / 60.0, 1, jet);
        vec_cross(jet[1], jet[2], cross);
        least = fmin(least, cross[2]);
      }
    bool regular = net_regular(5, (const double(*)[3])net, work);
    proven += regular;
    wrong += regular && least <= 0;
    missed += !regular && least > 0.05;
  }
  free(work);
  T_CHECK(wrong == 0 && missed == 0 && proven > 50 && proven < 350,
          "400 random nets: %zu proven, %zu of them wrongly, %zu clear ones missed", proven, wrong, missed);
}

static void test_nothing_to_measure(batten_context *ctx) {
  shape s = shape_octahedron();
  for (int f = 2; f < 4; f++) memset(s.control + f * 3 * TRIANGULAR_MAX, 0, 72);
  batten_network_measures m = measured(ctx, &s);
  T_CHECK(m.irregular_patches == 2 && m.regularity_min == 0 && m.gauss_min == 0 && fabs(m.area - 3 * sqrt(3)) < 1e-14,
          "patches that are points: told, and left out of K");
  batten_network *n = NULL;
  T_OK(net_surface_new(ctx, 6, s.points, 8, s.triangles, NULL, 0, NULL, 1, 1, &n), ctx);
  for (size_t p = 0; p < 8; p++) memcpy(net_surface_points(n, p), s.patch[p].control_points, 72);
  net_surface_points(n, 7)[1][1] = NAN;
  T_OK(batten_network_measure(ctx, n, &m), ctx);
  T_CHECK(m.irregular_patches == 3 && isnan(m.area) && isnan(m.volume) && m.regularity_min == 0, "NaN: told");
  size_t patches = 0, faces = 0;
  T_OK(net_find_irregular(ctx, n, "check", 0, &patches, &faces), ctx);
  T_CHECK(patches == 3 && faces == 3, "the same when asked alone");
  batten_network_free(n);
  shape_free(&s);
  T_OK(batten_network_create(ctx, 0, NULL, 0, NULL, 0, NULL, 0, NULL, &n), ctx);
  T_OK(batten_network_measure(ctx, n, &m), ctx);
  T_CHECK(m.area == 0 && isnan(m.volume) && isnan(m.gauss_min) && isnan(m.gauss_p50) && m.lower[0] == 0 &&
              !m.closed && m.centroid[2] == 0 && m.irregular_patches == 0,
          "nothing at all");
  T_CHECK(batten_network_measure(NULL, n, &m) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_measure(ctx, NULL, &m), BATTEN_E_INVALID, ctx, "network: NULL");
  T_STATUS(batten_network_measure(ctx, n, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  batten_network_free(n);
}

static batten_status measure_torus(batten_context *ctx, void *arg) {
  batten_network *n = NULL;
  batten_network_measures m;
  batten_status st = shape_network(ctx, arg, &n);
  if (st == BATTEN_OK) st = batten_network_measure(ctx, n, &m);
  batten_network_free(n);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1), *three = t_context(NULL, NULL, 3);
  test_by_hand(ctx);
  test_cap(ctx, 0);
  test_cap(ctx, 3);
  test_flat_ones(ctx);
  test_torus(ctx);
  test_gauss_bonnet_with_boundary(ctx);
  test_units(ctx, three);
  test_built(ctx);
  test_certificate(ctx);
  test_other_version(ctx);
  test_regularity(ctx);
  test_nothing_to_measure(ctx);
  shape s = shape_graph(2, 2, 3, shape_cap);
  t_fail_every_allocation("batten_network_measure", measure_torus, &s);
  t_cancel_every_progress("batten_network_measure", measure_torus, &s);
  shape_free(&s);
  batten_context_free(three);
  batten_context_free(ctx);
  return t_done();
}
