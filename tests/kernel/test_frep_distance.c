/* The algebra of solids: distances to first order, offsets, shells, noise; leaves that are given. */
#include "frep_checks.h"
#include "scenes.h"

static double value_at(batten_context *ctx, const batten_frep *a, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  return batten_frep_evaluate(ctx, a, 1, p, &f, NULL) == BATTEN_OK ? f : NAN;
}

static batten_frep *from_carrier(batten_context *ctx, batten_carrier *c) {
  batten_frep *a = NULL;
  T_OK(batten_frep_carrier(ctx, c, &a), ctx);
  batten_carrier_free(c);
  return a;
}

static const double o[3] = {0, 0, 0}, z_axis[3] = {0, 0, 1};

static void test_carriers(batten_context *ctx) {
  const double c = cos(0.7), s = sin(0.7), turned[9] = {c, s, 0, -s, c, 0, 0, 0, 1};
  batten_carrier *shape[7] = {NULL};
  const char *names[] = {"ball carrier", "ellipsoid", "box", "cylinder", "torus", "half-space", "union of carriers"};
  T_OK(batten_carrier_ball(ctx, 3, o, 1, &shape[0]), ctx);
  T_OK(batten_carrier_ellipsoid(ctx, 3, o, (double[]){0.5, 1, 1.2}, turned, &shape[1]), ctx);
  T_OK(batten_carrier_box(ctx, 3, o, (double[]){0.5, 1, 1.2}, turned, 0.1, &shape[2]), ctx);
  T_OK(batten_carrier_cylinder(ctx, o, (double[]){1, 1, 0.5}, 0.4, 0.1, &shape[3]), ctx);
  T_OK(batten_carrier_torus(ctx, o, (double[]){1, 2, 3}, 1, 0.4, &shape[4]), ctx);
  T_OK(batten_carrier_half_space(ctx, 3, o, z_axis, &shape[5]), ctx);
  T_OK(batten_carrier_union(ctx, shape[0], shape[4], 0, &shape[6]), ctx);
  for (int i = 0; i < 7; i++) {
    batten_frep *a = NULL;
    T_OK(batten_frep_carrier(ctx, shape[i], &a), ctx);
    frep_check(ctx, names[i], a, 2, 0.02, 1e-7, 10000);
    T_CHECK(batten_frep_is_distance(a) == (i >= 2 && i <= 5), "%s: a distance or none", names[i]);
    batten_frep_free(a);
  }
  for (int i = 0; i < 7; i++) batten_carrier_free(shape[i]);
}

/* By hand: a square with a square hole; and a star, where many corners are nearest. */
static void test_polygon(batten_context *ctx) {
  const double square[16] = {0, 0, 4, 0, 4, 4, 0, 4, 1, 1, 3, 1, 3, 3, 1, 3};
  batten_frep *a = NULL;
  T_OK(batten_frep_polygon(ctx, 2, (size_t[]){0, 4, 8}, square, &a), ctx);
  const double at[7][3] = {{2, 0.25, 0.25}, {2, 2, -1},        {-3, -4, -5},    {0.5, 0.5, 0.5},
                           {2, 0, 0},       {2.5, 0.75, 0.25}, {1.25, 2, -0.25}};
  double worst = 0, g[2], bad = 0;
  for (int i = 0; i < 7; i++) worst = fmax(worst, fabs(value_at(ctx, a, at[i][0], at[i][1], 0) - at[i][2]));
  T_RATIO(worst, 1e-15, "square with a hole at points by hand");
  /* gradients on the boundary and at a corner point inwards */
  batten_frep_evaluate(ctx, a, 1, (double[]){2, 0}, NULL, g);
  bad += fabs(g[0]) + fabs(g[1] - 1);
  batten_frep_evaluate(ctx, a, 1, (double[]){1, 2}, NULL, g);
  bad += fabs(g[0] + 1) + fabs(g[1]);
  batten_frep_evaluate(ctx, a, 1, (double[]){-3, -4}, NULL, g);
  bad += fabs(g[0] - 0.6) + fabs(g[1] - 0.8);
  T_RATIO(bad, 1e-15, "gradients of it by hand, on edges too");
  frep_check(ctx, "square with a hole", a, 5, 0.03, 1e-7, 20000);
  batten_frep_free(a);
  double star[40], kinks = 0.05;
  for (int i = 0; i < 20; i++) {
    star[2 * i] = (i % 2 ? 0.4 : 1) * cos(0.314159265358979 * i);
    star[2 * i + 1] = (i % 2 ? 0.4 : 1) * sin(0.314159265358979 * i);
  }
  T_OK(batten_frep_polygon(ctx, 1, (size_t[]){0, 20}, star, &a), ctx);
  frep_check(ctx, "star", a, 1.5, kinks, 1e-7, 20000);
  batten_frep_free(a);
}

static batten_solid *fit_moon(batten_context *ctx, size_t count) {
  double *points = malloc(count * 3 * sizeof *points);
  batten_solid *s = NULL;
  scene_moon_points(3, count, points);
  T_CHECK(batten_solid_fit(ctx, 3, count, points, NULL, &s, NULL) >= 0, "a moon is fitted");
  free(points);
  return s;
}

static void test_solid(batten_context *ctx) {
  batten_solid *s = fit_moon(ctx, 120);
  batten_frep *a = NULL, *ball = NULL, *u = NULL, *grown = NULL;
  T_OK(batten_frep_solid(ctx, s, &a), ctx);
  frep_check(ctx, "reconstructed solid", a, 2, 0, 1e-6, 2048);
  T_OK(batten_frep_ball(ctx, 3, (double[]){1, 0, 0}, 0.5, &ball), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_DIFFERENCE, a, ball, 0, &u), ctx);
  frep_check(ctx, "reconstructed solid without a ball", u, 2, 0.01, 1e-6, 2048);
  T_OK(batten_frep_offset(ctx, a, 0.1, &grown), ctx);
  frep_check(ctx, "reconstructed solid, grown", grown, 1.5, 0.01, 1e-4, 1024);
  double worst = 0;
  uint64_t seed = 4;
  for (int i = 0; i < 200; i++) { /* the grown surface lies at the distance 0.1 along the normal */
    double x[3], f, g[3], length = 0, f_grown;
    scene_moon_points(seed++, 1, x);
    for (int step = 0; step < 5; step++) {
      batten_frep_evaluate(ctx, a, 1, x, &f, g);
      length = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
      for (int k = 0; k < 3; k++) x[k] -= f * g[k] / length;
    }
    for (int k = 0; k < 3; k++) x[k] -= 0.1 * g[k] / sqrt(length);
    batten_frep_evaluate(ctx, grown, 1, x, &f_grown, NULL);
    worst = fmax(worst, fabs(f_grown));
  }
  T_RATIO(worst, 0.02, "a solid grown by 0.1 ends 0.1 outside of it, to first order (0.1^2 times the curvature)");
  batten_frep_free(a);
  batten_frep_free(ball);
  batten_frep_free(u);
  batten_frep_free(grown);
  batten_solid_free(s);
}

/* An offset ball is a ball, to the bit of its own formula. */
static void test_offset(batten_context *ctx) {
  batten_frep *a = NULL, *b = NULL, *c = NULL, *d = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.5, 0, 0}, 1, &a), ctx);
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.5, 0, 0}, 1.25, &b), ctx);
  T_OK(batten_frep_offset(ctx, a, 0.25, &c), ctx);
  T_OK(batten_frep_offset(ctx, c, -0.25, &d), ctx);
  uint64_t seed = 7;
  double worst = 0;
  for (int i = 0; i < 1000; i++) {
    double x = 4 * t_uniform(&seed) - 2, y = 4 * t_uniform(&seed) - 2, z = 4 * t_uniform(&seed) - 2;
    worst = fmax(worst, fabs(value_at(ctx, b, x, y, z) - value_at(ctx, c, x, y, z)));
    worst = fmax(worst, fabs(value_at(ctx, a, x, y, z) - value_at(ctx, d, x, y, z)));
  }
  T_RATIO(worst, 1e-15, "a ball offset by 0.25 is the ball of 0.25 more; and back again");
  T_CHECK(batten_frep_is_distance(c) && batten_frep_is_distance(d), "an offset distance is a distance");
  batten_frep_parts parts;
  batten_frep_get_parts(c, &parts);
  T_CHECK(parts.children[0] == a, "nothing is put between an offset and a distance");
  frep_check(ctx, "offset", c, 2, 0, 1e-7, 10000);
  batten_frep_free(c);
  batten_frep_free(d);
  T_OK(batten_frep_shell(ctx, a, 0.2, &c), ctx);
  worst = fabs(value_at(ctx, c, 0.5, 0, 1.1)) + fabs(value_at(ctx, c, 0.5, 0.9, 0)) +
          fabs(value_at(ctx, c, 1.5, 0, 0) - 0.1);
  T_RATIO(worst, 1e-15, "a shell of a ball by hand");
  frep_check(ctx, "shell", c, 2, 0.01, 1e-7, 10000);
  batten_frep_free(a);
  batten_frep_free(b);
  batten_frep_free(c);
}

/* R^2 - r^2 over 2 r is the first-order distance of a ball's carrier. */
static void test_normalize(batten_context *ctx) {
  batten_carrier *carrier = NULL;
  T_OK(batten_carrier_ball(ctx, 3, o, 1, &carrier), ctx);
  batten_frep *a = from_carrier(ctx, carrier), *b = NULL, *c = NULL;
  T_OK(batten_frep_normalize(ctx, a, &b), ctx);
  const double limit = 10 * 2 * sqrt(3);
  double worst = 0;
  for (int i = 0; i <= 30; i++) {
    double r = 0.1 * i, f = 1 - r * r;
    worst = fmax(worst, fabs(value_at(ctx, b, r, 0, 0) - f / hypot(2 * r, f / limit)));
  }
  T_RATIO(worst, 1e-6, "f / |grad f| of a ball's carrier, %g at its middle", value_at(ctx, b, 0, 0, 0));
  frep_check(ctx, "normalized ball carrier", b, 2, 0.01, 1e-5, 20000);
  T_OK(batten_frep_offset(ctx, a, 0.1, &c), ctx);
  worst = fabs(value_at(ctx, c, 0.1 + sqrt(1.01), 0, 0));
  T_RATIO(worst, 1e-5, "offset of it: r = d + sqrt(R^2 + d^2)");
  frep_check(ctx, "offset of a ball carrier", c, 2, 0.01, 1e-5, 20000);
  batten_frep *d = NULL, *e = NULL;
  T_OK(batten_frep_shell(ctx, c, 0.1, &d), ctx);
  batten_frep_parts parts;
  batten_frep_get_parts(d, &parts);
  T_CHECK(parts.children[0] == c, "what is normalized already is not normalized again");
  frep_check(ctx, "shell of an offset", d, 2, 0.02, 1e-5, 10000);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, a, b, 0, &e), ctx);
  batten_frep_free(d);
  T_OK(batten_frep_normalize(ctx, e, &d), ctx);
  frep_check(ctx, "normalized union", d, 2, 0.05, 1e-4, 10000);
  batten_frep_free(a);
  batten_frep_free(b);
  batten_frep_free(c);
  batten_frep_free(d);
  batten_frep_free(e);
}

static void test_noise(batten_context *ctx) {
  for (unsigned n = 2; n <= 3; n++) {
    batten_frep *a = NULL, *b = NULL, *c = NULL;
    T_OK(batten_frep_ball(ctx, n, o, 1, &a), ctx);
    T_OK(batten_frep_noise(ctx, a, 0.1, 3, 0.7, &b), ctx);
    frep_check(ctx, n == 2 ? "noisy disc" : "noisy ball", b, 2, 0, 1e-7, 20000);
    const double x[3] = {0.3, -0.8, 0.5};
    double s = 1, most = 0;
    for (unsigned i = 0; i < n; i++) s *= sin(3 * x[i]) + sin(3 * x[i] / 1.35 + 0.7 * sin(3 * x[(i + 1) % n])) / 1.17;
    T_RATIO(fabs(value_at(ctx, b, x[0], x[1], x[2]) - value_at(ctx, a, x[0], x[1], x[2]) - 0.1 * s), 1e-15,
            "noise by hand (n = %u)", n);
    uint64_t seed = 9;
    for (int i = 0; i < 5000; i++) {
      double y[3] = {20 * t_uniform(&seed), 20 * t_uniform(&seed), 20 * t_uniform(&seed)};
      most = fmax(most, fabs(value_at(ctx, b, y[0], y[1], y[2]) - value_at(ctx, a, y[0], y[1], y[2])) / 0.1);
    }
    T_CHECK(most <= pow(1 + 1 / 1.17, n) && most > 0.7 * pow(1 + 1 / 1.17, n), "noise reaches %g of %g", most,
            pow(1 + 1 / 1.17, n));
    T_OK(batten_frep_offset(ctx, b, 0.05, &c), ctx);
    frep_check(ctx, "noisy, grown", c, 2, 0.02, 1e-3, 10000);
    batten_frep_free(a);
    batten_frep_free(b);
    batten_frep_free(c);
  }
}

static batten_status flat(const void *user, batten_context *ctx, size_t count, const double *x, double *f, double *g,
                          double *h) {
  (void)user, (void)ctx, (void)x, (void)h;
  for (size_t i = 0; f && i < count; i++) f[i] = 1;
  for (size_t i = 0; g && i < 3 * count; i++) g[i] = 0;
  return BATTEN_OK;
}

static void test_bad(batten_context *ctx) {
  batten_frep *a = NULL, *b = NULL;
  batten_carrier *line = NULL, *call = NULL;
  const double x[10] = {0, 0, 2, 2, 2, 0, 0, 2, NAN, 1};
  T_STATUS(batten_frep_carrier(ctx, NULL, &a), BATTEN_E_INVALID, ctx, "carrier: NULL; give a carrier");
  T_OK(batten_carrier_ball(ctx, 1, o, 1, &line), ctx);
  T_STATUS(batten_frep_carrier(ctx, line, &a), BATTEN_E_INVALID, ctx,
           "carrier: of dimension 1; give one of dimension 2 or 3");
  T_STATUS(batten_frep_solid(ctx, NULL, &a), BATTEN_E_INVALID, ctx, "solid: NULL; give a solid");
  T_STATUS(batten_frep_polygon(ctx, 0, NULL, NULL, &a), BATTEN_E_INVALID, ctx, "count: 0; give at least one polygon");
  T_STATUS(batten_frep_polygon(ctx, 1, (size_t[]){0, 2}, x, &a), BATTEN_E_INVALID, ctx,
           "starts[1]: 2 after 0; give each polygon at least 3 points");
  T_STATUS(batten_frep_polygon(ctx, 1, (size_t[]){0, 4}, x, &a), BATTEN_E_INVALID, ctx, "cross at (1, 1)");
  T_STATUS(batten_frep_polygon(ctx, 1, (size_t[]){0, 5}, x, &a), BATTEN_E_INVALID, ctx, "points[4][0]: nan");
  T_STATUS(batten_frep_polygon(ctx, 1, (size_t[]){0, 3}, (double[]){0, 0, 1, 1, 0, 0}, &a), BATTEN_E_INVALID, ctx,
           "points: no polygon has an area");
  T_OK(batten_frep_ball(ctx, 3, o, 1, &b), ctx);
  T_STATUS(batten_frep_offset(ctx, b, NAN, &a), BATTEN_E_INVALID, ctx, "distance: nan; give a finite number");
  T_STATUS(batten_frep_shell(ctx, b, 0, &a), BATTEN_E_INVALID, ctx, "thickness: 0; give a positive finite number");
  T_STATUS(batten_frep_noise(ctx, b, 1, 0, 1, &a), BATTEN_E_INVALID, ctx,
           "frequency: 0; give a positive finite number");
  T_STATUS(batten_frep_normalize(ctx, NULL, &a), BATTEN_E_INVALID, ctx, "a: NULL; give a node");
  T_CHECK(a == NULL, "out is untouched on failure");
  batten_frep_free(b);
  /* a field that is constant and tells no bounds */
  const batten_field field = {.dimension = 3, .order = 1, .evaluate = flat};
  T_OK(batten_carrier_callback(ctx, &field, 1e-3, &call), ctx);
  a = from_carrier(ctx, call);
  T_OK(batten_frep_normalize(ctx, a, &b), ctx);
  double f, g[3], range[2];
  T_OK(batten_frep_evaluate(ctx, b, 1, o, &f, g), ctx);
  T_OK(batten_frep_bounds(ctx, b, 1, (double[6]){0}, range), ctx);
  T_CHECK(fabs(f - 1e30) < 1e18 && g[0] == 0 && range[0] <= f && range[1] >= f,
          "a field without slope: %g in [%g, %g]", f, range[0], range[1]);
  batten_frep_free(a);
  batten_frep_free(b);
  batten_carrier_free(line);
}

static batten_status build_and_use(batten_context *ctx, void *arg) {
  (void)arg;
  batten_carrier *carrier = NULL;
  batten_frep *a[5] = {NULL}, *flat_one = NULL;
  const double square[8] = {0, 0, 1, 0, 1, 1, 0, 1}, x[3] = {0.1, 0.2, 0.3};
  double f, df[3], range[2];
  batten_status st = batten_carrier_ball(ctx, 3, o, 1, &carrier);
  if (st >= 0) st = batten_frep_carrier(ctx, carrier, &a[0]);
  if (st >= 0) st = batten_frep_noise(ctx, a[0], 0.1, 1, 1, &a[1]);
  if (st >= 0) st = batten_frep_offset(ctx, a[1], 0.1, &a[2]);
  if (st >= 0) st = batten_frep_shell(ctx, a[2], 0.1, &a[3]);
  if (st >= 0) st = batten_frep_evaluate(ctx, a[3], 1, x, &f, df);
  if (st >= 0) st = batten_frep_bounds(ctx, a[3], 1, (double[6]){0, 0, 0, 1, 1, 1}, range);
  if (st >= 0) st = batten_frep_polygon(ctx, 1, (size_t[]){0, 4}, square, &flat_one);
  if (st >= 0) st = batten_frep_evaluate(ctx, flat_one, 1, x, &f, df);
  for (int i = 0; i < 5; i++) batten_frep_free(a[i]);
  batten_frep_free(flat_one);
  batten_carrier_free(carrier);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_carriers(ctx);
  test_polygon(ctx);
  test_solid(ctx);
  test_offset(ctx);
  test_normalize(ctx);
  test_noise(ctx);
  test_bad(ctx);
  t_fail_every_allocation("distances", build_and_use, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
