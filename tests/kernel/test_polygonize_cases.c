/* The polygoniser beyond nice shapes: cut by the box, scaled, turned, permuted, badly seeded, failing fields. */
#include "polygonize_cases.h"

static batten_context *ctx;
static double seeds[3 * SEEDS_MAX];

static bool same_mesh(const batten_mesh *a, const batten_mesh *b, double scale) {
  size_t v = batten_mesh_vertex_count(a), f = batten_mesh_triangle_count(a);
  if (v != batten_mesh_vertex_count(b) || f != batten_mesh_triangle_count(b)) return false;
  if (memcmp(batten_mesh_triangles(a), batten_mesh_triangles(b), 3 * f * sizeof(uint32_t)) != 0) return false;
  for (size_t i = 0; i < 3 * v; i++)
    if (batten_mesh_vertices(a)[i] * scale != batten_mesh_vertices(b)[i]) return false;
  return true;
}

/* Boundary vertices lie on the box, all others within. Returns how many lie on it. */
static size_t count_on_box(const batten_mesh *mesh, const batten_polygonize_options *o, bool *within) {
  size_t on = 0;
  *within = true;
  for (size_t v = 0; v < batten_mesh_vertex_count(mesh); v++) {
    const double *p = batten_mesh_vertices(mesh) + 3 * v;
    bool here = false;
    for (int k = 0; k < 3; k++) {
      here = here || p[k] == o->lower[k] || p[k] == o->upper[k];
      *within = *within && p[k] >= o->lower[k] && p[k] <= o->upper[k];
    }
    on += here;
  }
  return on;
}

static void test_clipped(void) {
  const struct {
    const char *name;
    shape_function function;
    double reach, cell;
    size_t loops;
    bool turned;
  } cases[] = {{"sheet", shape_sheet, 1, 0.08, 1, false},
               {"sheet", shape_sheet, 1, 0.08, 1, true},
               {"ball", shape_ball, 0.8, 0.08, 6, false},
               {"gyroid", shape_gyroid, 1, 0.06, 0, true}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    shape s = shape_make(cases[i].function);
    if (cases[i].turned) shape_turn(&s, 0.7, 1.1);
    size_t n = shape_seeds(&s, 0.6, 500, 11, seeds);
    batten_polygonize_options o = shape_options(&s, cases[i].reach, cases[i].cell);
    polygonized p = polygonize(ctx, &s, &o, n, seeds);
    bool within;
    polygonized_print(cases[i].name, &p);
    T_CHECK(p.status == BATTEN_W_CLIPPED && p.info.clipped && strstr(batten_error(ctx), "opt.lower"), "%s: %s",
            cases[i].name, batten_error(ctx));
    T_CHECK(!p.m.closed && p.m.manifold && p.m.oriented && p.m.components == 1, "%s: oriented manifold",
            cases[i].name);
    T_CHECK(cases[i].loops ? p.m.boundary_loops == cases[i].loops : p.m.boundary_loops > 0, "%s: %zu boundary loops",
            cases[i].name, p.m.boundary_loops);
    size_t on = count_on_box(p.mesh, &o, &within);
    T_CHECK(within && on == p.m.boundary_edges, "%s: %zu boundary vertices, all on the box, the others inside",
            cases[i].name, on);
    T_CHECK(p.crossings == 0 && p.m.angles_above_20deg >= 0.99, "%s: %zu crossings, %.4f good triangles",
            cases[i].name, p.crossings, p.m.angles_above_20deg);
    T_RATIO(p.info.distance_max, 1e-6 * 2.1 * sqrt(3.0) * cases[i].reach, "%s: distance from f = 0", cases[i].name);
    batten_mesh_free(p.mesh);
  }
}

/* Area of the unit ball's surface within [-a, b]^3 a b around 0.8: caps beyond the six planes are cut off. */
static void test_clipped_area(void) {
  shape s = shape_make(shape_ball);
  size_t n = shape_seeds(&s, 0.7, 500, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 0.8, 0.04);
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  double expected = 4 * acos(-1);
  for (int k = 0; k < 3; k++) expected -= 2 * acos(-1) * ((1 + o.lower[k]) + (1 - o.upper[k]));
  T_RATIO(fabs(p.m.area - expected), 0.04 * 0.04 * expected, "area of the ball without six caps");
  batten_mesh_free(p.mesh);
}

static void test_invariance(void) {
  shape s = shape_make(shape_torus);
  shape_turn(&s, 0.7, 1.1);
  size_t n = shape_seeds(&s, 1.5, 400, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 1.5, 0.12);
  polygonized first = polygonize(ctx, &s, &o, n, seeds);

  double permuted[3 * SEEDS_MAX];
  for (size_t i = 0; i < n; i++) memcpy(permuted + 3 * i, seeds + 3 * ((i * 7 + 3) % n), 3 * sizeof *seeds);
  T_CHECK(n % 7 != 0, "7 and %zu have no common factor", n);
  polygonized p = polygonize(ctx, &s, &o, n, permuted);
  T_CHECK(same_mesh(first.mesh, p.mesh, 1), "seeds permuted: the same bits");
  batten_mesh_free(p.mesh);

  p = polygonize(ctx, &s, &o, 1, seeds);
  T_CHECK(same_mesh(first.mesh, p.mesh, 1), "one seed only: the same bits");
  batten_mesh_free(p.mesh);

  for (unsigned threads = 1; threads <= 5; threads += 4) {
    batten_context *other = t_context(NULL, NULL, threads);
    p = polygonize(other, &s, &o, n, seeds);
    T_CHECK(same_mesh(first.mesh, p.mesh, 1), "%u threads: the same bits", threads);
    batten_mesh_free(p.mesh);
    batten_context_free(other);
  }

  const int exponents[] = {-490, -300, -100, -20, 100, 300, 490}; /* of squares and products of these some overflow */
  for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++) {
    const int exponent = exponents[e];
    shape scaled = s;
    scaled.scale = ldexp(1, exponent);
    for (size_t i = 0; i < 3 * n; i++) permuted[i] = ldexp(seeds[i], exponent);
    o = shape_options(&scaled, 1.5, 0.12);
    p = polygonize(ctx, &scaled, &o, n, permuted);
    T_CHECK(p.status == BATTEN_OK && same_mesh(first.mesh, p.mesh, scaled.scale), "scaled by 2^%d: the same digits",
            exponent);
    T_CHECK(p.info.cell == 0.12 * scaled.scale && p.info.distance_max == first.info.distance_max * scaled.scale,
            "and cell %g, distance %g", p.info.cell, p.info.distance_max);
    batten_mesh_free(p.mesh);
  }

  shape far = s;
  double place[3] = {7e6, -2e6, 5e5};
  memcpy(far.origin, place, sizeof place);
  for (size_t i = 0; i < 3 * n; i++) permuted[i] = seeds[i] + place[i % 3];
  o = shape_options(&far, 1.5, 0.12);
  p = polygonize(ctx, &far, &o, n, permuted);
  T_CHECK(p.status == BATTEN_OK && p.m.genus == 1 && p.crossings == 0, "7e6 away: genus %ld, %zu crossings",
          p.m.genus, p.crossings);
  T_RATIO(fabs(p.m.volume - first.m.volume), 1e-4, "7e6 away: volume");
  batten_mesh_free(p.mesh);

  shape turned = shape_make(shape_torus);
  shape_turn(&turned, -1.9, 0.4);
  n = shape_seeds(&turned, 1.5, 400, 11, seeds);
  o = shape_options(&turned, 1.5, 0.12);
  p = polygonize(ctx, &turned, &o, n, seeds);
  T_CHECK(p.m.genus == 1 && p.crossings == 0, "turned: genus 1");
  T_RATIO(fabs(p.m.volume - first.m.volume) / first.m.volume, 2e-3, "turned: volume");
  batten_mesh_free(p.mesh);
  batten_mesh_free(first.mesh);
}

static void test_default_box_and_cell(void) {
  shape s = shape_make(shape_ball);
  for (size_t wanted = 60; wanted <= 960; wanted *= 2) {
    size_t n = shape_seeds(&s, 1.3, wanted, 4, seeds);
    polygonized p = polygonize(ctx, &s, NULL, n, seeds);
    double pi = acos(-1);
    T_CHECK(p.status == BATTEN_OK && p.m.genus == 0 && p.crossings == 0, "%zu seeds, all by default: %zu vertices", n,
            p.m.vertices);
    T_RATIO(fabs(p.m.volume / (4 * pi / 3) - 1), 3.0 / (double)n, "volume");
    batten_mesh_free(p.mesh);
  }
  size_t n = shape_seeds(&s, 1.3, 200, 4, seeds);
  memcpy(seeds + 3 * n, seeds, 3 * n * sizeof *seeds);
  polygonized p = polygonize(ctx, &s, NULL, n, seeds), twice = polygonize(ctx, &s, NULL, 2 * n, seeds);
  T_CHECK(twice.status == BATTEN_OK && p.info.cell <= twice.info.cell, "seeds given twice: cell %g, %g", p.info.cell,
          twice.info.cell);
  batten_mesh_free(p.mesh);
  batten_mesh_free(twice.mesh);
  double flat[9] = {1, 0, 0, -1, 0, 0, 0, 1, 0}; /* all in a plane: the box is made from the largest extent */
  p = polygonize(ctx, &s, NULL, 3, flat);
  T_CHECK(p.status >= 0 && p.mesh, "three seeds in a plane");
  batten_mesh_free(p.mesh);
  batten_field field = shape_field(&s);
  batten_mesh *mesh = NULL;
  T_STATUS(batten_polygonize(ctx, &field, 1, flat, NULL, &mesh, NULL), BATTEN_E_INVALID, ctx,
           "seeds: their box is [1, 1] along axis 0; give opt.lower and opt.upper");
}

static void test_seeds(void) {
  shape s = shape_make(shape_ball);
  batten_polygonize_options o = shape_options(&s, 1.5, 0.1);
  size_t n = shape_seeds(&s, 1.3, 20, 4, seeds);
  /* Every second seed 1.2 cells off the surface, one in the middle, one outside of the box. */
  for (size_t i = 0; i < 3 * n; i++) seeds[i] *= i / 3 % 2 ? 1 : 1.12;
  double bad[6] = {0, 0, 0, 2, 0, 0};
  memcpy(seeds + 3 * n, bad, sizeof bad);
  polygonized p = polygonize(ctx, &s, &o, n + 2, seeds);
  T_CHECK(p.status == BATTEN_OK && p.info.seeds_missed == 2,
          "%zu of %zu seeds missed: the middle and the one outside", p.info.seeds_missed, n + 2);
  batten_mesh_free(p.mesh);
  p = polygonize(ctx, &s, &o, 1, seeds);
  T_CHECK(p.status == BATTEN_OK && p.info.seeds_missed == 0 && p.m.closed, "one seed 1.2 cells off finds all of it");
  batten_mesh_free(p.mesh);
  s = shape_make(shape_links);
  o = shape_options(&s, 2.6, 0.1);
  double on_first[3] = {0, 1.35, 0};
  p = polygonize(ctx, &s, &o, 1, on_first);
  T_CHECK(p.m.components == 1 && p.m.genus == 1, "a component without a seed is not found");
  batten_mesh_free(p.mesh);

  batten_mesh *mesh = NULL;
  s = shape_make(shape_outside);
  batten_field field = shape_field(&s);
  T_STATUS(batten_polygonize(ctx, &field, n, seeds, &o, &mesh, NULL), BATTEN_E_NOT_FOUND, ctx, "any of the 20 seeds");
}

/* Fields without gradients are differenced; the surface is the same to the tolerance. */
static void test_order_0(void) {
  shape s = shape_make(shape_torus);
  shape_turn(&s, 0.7, 1.1);
  size_t n = shape_seeds(&s, 1.5, 100, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 1.5, 0.12);
  polygonized with = polygonize(ctx, &s, &o, n, seeds);
  batten_field field = shape_field(&s);
  field.order = 0;
  s.points = 0;
  batten_mesh *mesh = NULL;
  batten_mesh_measures m;
  batten_polygonize_info info;
  T_OK(batten_polygonize(ctx, &field, n, seeds, &o, &mesh, &info), ctx);
  batten_mesh_measure(ctx, mesh, &m);
  T_CHECK(m.genus == 1 && m.angles_above_20deg > 0.99, "without gradients: genus %ld", m.genus);
  T_RATIO(fabs(m.volume - with.m.volume) / m.volume, 1e-3, "without gradients: volume");
  T_CHECK(info.evaluations == s.points, "%zu evaluations counted, %zu with gradients", info.evaluations,
          with.info.evaluations);
  double worst = 0;
  for (size_t v = 0; v < batten_mesh_vertex_count(mesh); v++) {
    double f = NAN;
    shape_evaluate(&s, ctx, 1, batten_mesh_vertices(mesh) + 3 * v, &f, NULL, NULL);
    worst = fmax(worst, fabs(f));
  }
  T_RATIO(worst, 1.001e-6 * sqrt(3.0) * 1.5 * 2.015625, "without gradients: distance from f = 0");
  batten_mesh_free(mesh);
  batten_mesh_free(with.mesh);
}

/* A field with a jump instead of a zero, and one whose gradient vanishes on the surface: bisection finds both. */
static double shape_jump(const double *x, double *g) {
  g[0] = g[1] = g[2] = 0;
  return x[0] * x[0] + x[1] * x[1] + x[2] * x[2] < 1 ? 1 : -1;
}
static double shape_cubed(const double *x, double *g) {
  double f = shape_ball(x, g);
  for (int k = 0; k < 3; k++) g[k] *= 3 * f * f;
  return f * f * f;
}

static void test_hard_fields(void) {
  shape ball = shape_make(shape_ball);
  size_t n = shape_seeds(&ball, 1.3, 100, 11, seeds);
  shape s = shape_make(shape_cubed);
  batten_polygonize_options o = shape_options(&s, 1.5, 0.15);
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  T_CHECK(p.status == BATTEN_OK && p.m.genus == 0, "f^3: %s", p.status ? batten_error(ctx) : "done");
  T_RATIO(fabs(p.m.volume / (4 * acos(-1) / 3) - 1), 0.02, "f^3: volume");
  batten_mesh_free(p.mesh);
  s = shape_make(shape_jump);
  p = polygonize(ctx, &s, &o, n, seeds);
  T_CHECK(p.status == BATTEN_OK && p.m.closed && p.m.genus == 0, "a jump: %s", p.status ? batten_error(ctx) : "done");
  T_RATIO(fabs(p.m.volume / (4 * acos(-1) / 3) - 1), 0.05, "a jump: volume");
  batten_mesh_free(p.mesh);
}

/* A shell thinner than the lattice's cubes: found out by its crossings, and done again on a finer lattice. */
static double shape_shell(const double *x, double *g) {
  double r = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  for (int k = 0; k < 3; k++) g[k] = (r > 1 ? -x[k] : x[k]) / (r > 0 ? r : 1);
  return 0.07 - fabs(r - 1);
}

static void test_thin(void) {
  shape s = shape_make(shape_shell);
  size_t n = shape_seeds(&s, 1.3, 400, 11, seeds);
  batten_polygonize_options o = shape_options(&s, 1.3, 0.2);
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  polygonized_print("shell", &p);
  T_CHECK(p.status == BATTEN_OK && p.m.components == 2 && p.m.genus == 0 && p.crossings == 0 &&
              p.info.self_intersections == 0,
          "shell of thickness 0.14 with cells of 0.2: %zu components, genus %ld, %zu crossings", p.m.components,
          p.m.genus, p.crossings);
  batten_mesh_free(p.mesh);
  o.improve = 0;
  p = polygonize(ctx, &s, &o, n, seeds);
  T_CHECK(p.status == BATTEN_W_ACCURACY && p.info.self_intersections == p.crossings && p.crossings > 0 &&
              strstr(batten_error(ctx), "crosses itself"),
          "without improvement it stays as it is, and says so: %s", batten_error(ctx));
  batten_mesh_free(p.mesh);
}

static void test_failing_fields(void) {
  shape s = shape_make(shape_ball);
  batten_field field = shape_field(&s);
  batten_mesh *mesh = NULL;
  batten_polygonize_options o = shape_options(&s, 1.3, 0.3);
  size_t n = shape_seeds(&s, 1.3, 20, 4, seeds), calls;
  polygonized p = polygonize(ctx, &s, &o, n, seeds);
  batten_mesh_free(p.mesh);
  calls = s.calls;
  bool handed = true;
  for (size_t k = 1; k <= calls; k++) {
    s = shape_make(shape_ball);
    s.fail_at = k;
    batten_status st = batten_polygonize(ctx, &field, n, seeds, &o, &mesh, NULL);
    handed = handed && st == BATTEN_E_SINGULAR && strstr(batten_error(ctx), "the field fails at call");
  }
  T_CHECK(handed, "failure of the field at each of its %zu calls is handed on", calls);
  for (size_t k = 1; k <= p.info.evaluations; k += 211) {
    s = shape_make(shape_ball);
    s.nan_at = k;
    batten_status st = batten_polygonize(ctx, &field, n, seeds, &o, &mesh, NULL);
    handed = handed && st == BATTEN_E_INVALID && strstr(batten_error(ctx), "field: nan at the point (");
  }
  T_CHECK(handed, "a value that is no number is named: %s", batten_error(ctx));
  for (size_t k = 1; k < p.info.evaluations; k += 211) {
    s = shape_make(shape_ball);
    o.evaluations_max = k;
    batten_status st = batten_polygonize(ctx, &field, n, seeds, &o, &mesh, NULL);
    handed = handed && st == BATTEN_E_TOO_LARGE && strstr(batten_error(ctx), "opt.evaluations_max") && s.points <= k;
  }
  T_CHECK(handed, "the limit of evaluations holds: %s", batten_error(ctx));
  o.evaluations_max = p.info.evaluations;
  T_OK(batten_polygonize(ctx, &field, n, seeds, &o, &mesh, NULL), ctx);
  batten_mesh_free(mesh);
}

static void test_refusals(void) {
  shape s = shape_make(shape_ball);
  batten_field field = shape_field(&s), plane = field, none = field;
  plane.dimension = 2;
  none.evaluate = NULL;
  batten_mesh *mesh = NULL;
  batten_polygonize_options good = shape_options(&s, 1.3, 0.3), o = good;
  double x[6] = {1, 0, 0, 0, NAN, 0};
  T_CHECK(batten_polygonize(NULL, &field, 1, x, &o, &mesh, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_polygonize(ctx, NULL, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "field: NULL");
  T_STATUS(batten_polygonize(ctx, &none, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "field: NULL");
  T_STATUS(batten_polygonize(ctx, &plane, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "field.dimension: 2");
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_polygonize(ctx, &field, 0, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "seeds: none");
  T_STATUS(batten_polygonize(ctx, &field, 2, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "seeds[1][1]: nan");
  T_STATUS(batten_polygonize(ctx, &field, SIZE_MAX / 4, x, &o, &mesh, NULL), BATTEN_E_TOO_LARGE, ctx, "seed_count");
  batten_polygonize_options zero = {0};
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &zero, &mesh, NULL), BATTEN_E_INVALID, ctx, "struct_size: 0");
  o.cell = -1;
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "opt.cell: -1");
  o.cell = NAN;
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "opt.cell: nan");
  o.cell = 1e-9;
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, &mesh, NULL), BATTEN_E_TOO_LARGE, ctx, "opt.cell:");
  o = good;
  o.accuracy = 0;
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx, "opt.accuracy: 0");
  o = good;
  o.lower[1] = 5;
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx,
           "opt.lower[1], opt.upper[1]");
  o = good;
  o.upper[2] = INFINITY;
  T_STATUS(batten_polygonize(ctx, &field, 1, x, &o, &mesh, NULL), BATTEN_E_INVALID, ctx,
           "opt.lower[2], opt.upper[2]");
  T_CHECK(!mesh, "failures leave the result alone");
}

/* A corner of the shell, cut by its box: takes two attempts. */
static batten_status call_polygonize(batten_context *c, void *arg) {
  shape s = shape_make(shape_shell);
  batten_field field = shape_field(&s);
  batten_polygonize_options o = batten_polygonize_options_default();
  batten_polygonize_info *info = arg;
  double x[6] = {0.62, 0.62, 0.62, 0.53, 0.53, 0.53};
  for (int k = 0; k < 3; k++) {
    o.lower[k] = 0.1;
    o.upper[k] = 1;
  }
  o.cell = 0.25;
  o.improve = 1;
  batten_mesh *mesh = NULL;
  batten_status st = batten_polygonize(c, &field, 2, x, &o, &mesh, info);
  batten_mesh_free(mesh);
  return st;
}
/* A ball much smaller than the box of the seeds, most of which are off it: the cell follows from the box. In a unit
 * so small that lengths are taken in another. */
static batten_status call_defaults(batten_context *c, void *arg) {
  shape s = shape_make(shape_ball);
  s.scale = ldexp(0.25, -300);
  batten_field field = shape_field(&s);
  batten_polygonize_options o = batten_polygonize_options_default();
  (void)arg;
  o.improve = 1;
  field.order = 0;
  double x[12] = {0.25, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int i = 0; i < 12; i++) x[i] = ldexp(x[i], -300);
  batten_mesh *mesh = NULL;
  batten_status st = batten_polygonize(c, &field, 4, x, &o, &mesh, NULL);
  batten_mesh_free(mesh);
  return st;
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_clipped();
  test_clipped_area();
  test_invariance();
  test_default_box_and_cell();
  test_seeds();
  test_order_0();
  test_hard_fields();
  test_thin();
  test_failing_fields();
  test_refusals();
  batten_polygonize_info info = {0};
  t_fail_every_allocation("polygonising", call_polygonize, &info);
  t_cancel_every_progress("polygonising", call_polygonize, &info);
  printf("# %zu evaluations\n", info.evaluations);
  t_fail_every_allocation("polygonising by default", call_defaults, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
