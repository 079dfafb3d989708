/* Saddle systems: solutions by hand, residuals over sizes and kinds of point sets, second routes, invariances. */
#include "saddle_scene.h"

static const batten_saddle_method methods[] = {BATTEN_SADDLE_AUTO, BATTEN_SADDLE_CHOLESKY,
                                               BATTEN_SADDLE_CHOLESKY_MIXED, BATTEN_SADDLE_LDL, BATTEN_SADDLE_QR};
enum { METHODS = sizeof methods / sizeof *methods, MOST = 1000 };

/* Solves; returns the status of the first call that failed, or of the solve. info may be NULL. */
static batten_status solve_scene(batten_context *ctx, const scene *s, batten_saddle_method method, double *w,
                                 double *c, batten_saddle_info *info) {
  batten_saddle_options o = batten_saddle_options_default();
  batten_saddle_matrix m = scene_matrix(s);
  batten_saddle *h = NULL;
  o.method = method;
  batten_status st = batten_saddle_factor(ctx, &m, &o, &h);
  if (st == BATTEN_OK) {
    st = batten_saddle_solve(ctx, h, s->f, w, c);
    if (info) *info = batten_saddle_get_info(h);
  }
  batten_saddle_free(h);
  return st;
}

static double largest(size_t n, const double *x) {
  double norm = 0;
  for (size_t i = 0; i < n; i++) norm = fmax(norm, fabs(x[i]));
  return norm;
}

static double difference(size_t n, const double *a, const double *b) {
  double worst = 0;
  for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(a[i] - b[i]));
  return worst / fmax(largest(n, a), 1e-300);
}

/* Two points at distance 2, kernel -r, P = 1: f1 = -2 w2 + c, f2 = -2 w1 + c, w1 + w2 = 0. */
static void test_by_hand(batten_context *ctx) {
  double x[6] = {0, 0, 0, 2, 0, 0}, p[2] = {1, 1}, f[2] = {5, 1}, w[2], c[1], d[2];
  size_t index[2] = {0, 1};
  scene s = {.n = 2, .k = 1, .kernel = KERNEL_R, .factor = 1, .x = x, .p = p, .f = f};
  for (int q = 0; q < METHODS; q++) {
    batten_status st = solve_scene(ctx, &s, methods[q], w, c, NULL);
    T_CHECK(st == BATTEN_OK && fabs(w[0] - 1) < 1e-15 && fabs(w[1] + 1) < 1e-15 && fabs(c[0] - 3) < 1e-15,
            "two points by %s: w = %g %g, c = %g", batten_saddle_method_name(methods[q]), w[0], w[1], c[0]);
    /* The inverse's block for w is [1 -1; -1 1] / 4. */
    batten_saddle_options o = batten_saddle_options_default();
    batten_saddle_matrix m = scene_matrix(&s);
    batten_saddle *h = NULL;
    o.method = methods[q];
    st = batten_saddle_factor(ctx, &m, &o, &h);
    if (st == BATTEN_OK) st = batten_saddle_inverse_diagonal(ctx, h, 2, index, d);
    T_CHECK(st == BATTEN_OK && fabs(d[0] - 0.25) < 1e-7 && fabs(d[1] - 0.25) < 1e-7, "its inverse's diagonal: %g %g",
            d[0], d[1]);
    batten_saddle_free(h);
  }
}

static void test_edges(batten_context *ctx) {
  scene none = {.factor = 1};
  double x[3] = {1, 2, 3}, f[1] = {8}, w[1] = {0};
  scene single = {.n = 1, .kernel = KERNEL_R, .nugget = 4, .factor = 1, .x = x, .f = f};
  for (int q = 0; q < METHODS; q++) {
    const char *name = batten_saddle_method_name(methods[q]);
    batten_status st = solve_scene(ctx, &none, methods[q], NULL, NULL, NULL);
    T_CHECK(st == BATTEN_OK, "N = k = 0 by %s %s", name, st < 0 ? batten_error(ctx) : "");
    st = solve_scene(ctx, &single, methods[q], w, NULL, NULL);
    T_CHECK(st == BATTEN_OK && w[0] == 2, "1 x 1 by %s: %g", name, w[0]);
  }
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 20, 4, 3);
  double z[20], c[4];
  memset(s.f, 0, 20 * sizeof *s.f);
  batten_saddle_info info;
  batten_status st = solve_scene(ctx, &s, BATTEN_SADDLE_AUTO, z, c, &info);
  T_CHECK(st == BATTEN_OK && largest(20, z) == 0 && largest(4, c) == 0 && info.residual == 0, "f = 0 gives zeros");
  scene_free(&s);
}

static void test_residuals(batten_context *ctx) {
  static const size_t sizes[] = {2, 3, 5, 10, 50, 100, 300};
  static double w[300], c[4];
  for (int kernel = 0; kernel < 3; kernel++)
    for (int type = 0; type < SCENE_TYPES; type++) {
      double residual = 0, met = 0, scaled = 0, orthogonality = 0;
      bool ok = true;
      for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++)
        for (int method = 0; method < METHODS; method++) {
          /* N <= k cannot be unisolvent with linear polynomials: constants there. */
          scene s = scene_new((scene_type)type, (scene_kernel)(sizes[q] < 5 ? KERNEL_R : kernel), sizes[q],
                              sizes[q] < 5 ? 1 : 4, 7 + sizes[q]);
          batten_status st = solve_scene(ctx, &s, methods[method], w, c, NULL);
          if (st < 0)
            printf("# n = %zu, %s: %s\n", sizes[q], batten_saddle_method_name(methods[method]), batten_error(ctx));
          ok = ok && st >= 0;
          scene_quality quality = scene_check(&s, w, c);
          residual = fmax(residual, quality.residual);
          if (st == BATTEN_W_ACCURACY)
            scaled = fmax(scaled, quality.scaled);
          else
            met = fmax(met, quality.residual);
          orthogonality = fmax(orthogonality, quality.orthogonality);
          scene_free(&s);
        }
      T_CHECK(ok, "%s on %s is solved, residual %.2g", kernel_names[kernel], scene_names[type], residual);
      /* tolerance 1e-13, and the rounding of this check itself */
      T_RATIO(met, 1.5e-13, "%s on %s: residual where none is reported", kernel_names[kernel], scene_names[type]);
      T_RATIO(scaled, 30, "%s on %s: residual over rounding", kernel_names[kernel], scene_names[type]);
      T_RATIO(orthogonality, 1e-12, "%s on %s: P'w", kernel_names[kernel], scene_names[type]);
    }
}

/* Cholesky, LDL' and QR share nothing but the assembly; mixed shares only the projection with Cholesky. */
static void test_second_routes(batten_context *ctx) {
  static double w[MOST], other[MOST], c[4], other_c[4];
  for (int kernel = 0; kernel < 3; kernel++) {
    scene s = scene_new(SCENE_RANDOM, (scene_kernel)kernel, 400, 4, 11);
    for (size_t i = 0; i < s.n; i++) s.f[i] = s.x[3 * i] * s.x[3 * i] + sin(s.x[3 * i + 1]);
    solve_scene(ctx, &s, BATTEN_SADDLE_LDL, w, c, NULL);
    for (int q = 0; q < METHODS; q++) {
      batten_saddle_info info = {0};
      batten_status st = solve_scene(ctx, &s, methods[q], other, other_c, &info);
      T_CHECK(st >= 0 && info.rcond > 0 && info.rcond <= 1,
              "%s by %s: used %s, %u refinements, residual %.2g, rcond %.2g", kernel_names[kernel],
              batten_saddle_method_name(methods[q]), batten_saddle_method_name(info.method), info.refinements,
              info.residual, info.rcond);
      T_RATIO(difference(s.n, w, other), 1e-9, "its w against LDL'");
      T_RATIO(difference(4, c, other_c), 1e-9, "its c against LDL'");
    }
    scene_free(&s);
  }
}

/* A linear f is reproduced by the polynomial alone. */
static void test_reproduction(batten_context *ctx) {
  static double w[200];
  double c[4];
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 200, 4, 5);
  for (size_t i = 0; i < s.n; i++) s.f[i] = 3 - s.x[3 * i] + 2 * s.x[3 * i + 1] + 0.5 * s.x[3 * i + 2];
  for (int q = 0; q < METHODS; q++) {
    solve_scene(ctx, &s, methods[q], w, c, NULL);
    double error = fmax(fmax(fabs(c[0] - 3), fabs(c[1] + 1)), fmax(fabs(c[2] - 2), fabs(c[3] - 0.5)));
    T_RATIO(fmax(error, largest(s.n, w)), 1e-11, "linear f by %s", batten_saddle_method_name(methods[q]));
  }
  scene_free(&s);
}

static void test_invariance(batten_context *ctx) {
  static double w[150], other[150], back[150];
  double c[4], other_c[4];
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 150, 4, 21), t = scene_new(SCENE_RANDOM, KERNEL_R, 150, 4, 21);
  solve_scene(ctx, &s, BATTEN_SADDLE_CHOLESKY, w, c, NULL);
  for (size_t i = 0; i < s.n; i++) { /* reversed order */
    size_t j = s.n - 1 - i;
    memcpy(t.x + 3 * i, s.x + 3 * j, 3 * sizeof *t.x);
    for (size_t q = 0; q < 4; q++) t.p[i + q * s.n] = s.p[j + q * s.n];
    t.f[i] = s.f[j];
  }
  solve_scene(ctx, &t, BATTEN_SADDLE_CHOLESKY, other, other_c, NULL);
  for (size_t i = 0; i < s.n; i++) back[i] = other[s.n - 1 - i];
  T_RATIO(difference(s.n, w, back), 1e-11, "reversed order");
  scene_free(&t);
  static const int units[][2] = {{40, -30}, {-500, -500}, {500, 450}};
  for (size_t u = 0; u < sizeof units / sizeof *units; u++) {
    t = scene_new(SCENE_RANDOM, KERNEL_R, 150, 4, 21);
    t.factor = ldexp(1, units[u][0]);
    for (size_t i = 0; i < 4 * t.n; i++) t.p[i] = ldexp(t.p[i], units[u][1]);
    for (int q = 0; q < METHODS; q++) {
      solve_scene(ctx, &s, methods[q], w, c, NULL);
      solve_scene(ctx, &t, methods[q], other, other_c, NULL);
      for (size_t i = 0; i < s.n; i++) other[i] = ldexp(other[i], units[u][0]);
      for (size_t i = 0; i < 4; i++) other_c[i] = ldexp(other_c[i], units[u][1]);
      T_CHECK(!memcmp(w, other, s.n * sizeof *w) && !memcmp(c, other_c, sizeof c),
              "K scaled by 2^%d and P by 2^%d: same bits by %s", units[u][0], units[u][1],
              batten_saddle_method_name(methods[q]));
    }
    scene_free(&t);
  }
  scene_free(&s);
}

/* Entries of K, of P or of f that are subnormal numbers, and scales whose quotient is no double: few digits, but no
 * infinities. */
static void test_extreme_units(batten_context *ctx) {
  static const int powers[][3] = {{-1040, 0, -300}, {0, -1040, -600}, {0, 0, -1030}, {550, -500, 0}};
  static double w[100];
  double c[4];
  for (size_t u = 0; u < sizeof powers / sizeof *powers; u++)
    for (int q = 0; q < METHODS; q++) {
      scene s = scene_new(SCENE_RANDOM, KERNEL_R, 100, 4, 23);
      s.factor = ldexp(1, powers[u][0]);
      for (size_t i = 0; i < 4 * s.n; i++) s.p[i] = ldexp(s.p[i], powers[u][1]);
      for (size_t i = 0; i < s.n; i++) s.f[i] = ldexp(s.f[i], powers[u][2]);
      batten_status st = solve_scene(ctx, &s, methods[q], w, c, NULL);
      double miss = scene_check(&s, w, c).residual;
      T_CHECK(st >= 0 && miss < (powers[u][2] < -1022 ? 1e-9 : 1e-13), "K by 2^%d, P by 2^%d, f by 2^%d, %s: %.2g",
              powers[u][0], powers[u][1], powers[u][2], batten_saddle_method_name(methods[q]), miss);
      scene_free(&s);
    }
}

/* A host's executor that runs the last task first. */
static void backwards(void *user, size_t tasks, void (*task)(void *arg, size_t index), void *arg) {
  *(size_t *)user += tasks;
  while (tasks-- > 0) task(arg, tasks);
}

/* The threads of the context change no bit (those of BLAS may), and the order of the tasks neither. */
static void test_threads(void) {
  static double w[MOST], other[MOST];
  double c[4];
  scene s = scene_new(SCENE_SPHERE, KERNEL_R, MOST, 4, 9);
  for (unsigned threads = 1; threads <= 16; threads *= 4) {
    batten_context *ctx = t_context(NULL, NULL, threads);
    solve_scene(ctx, &s, BATTEN_SADDLE_CHOLESKY_MIXED, threads == 1 ? w : other, c, NULL);
    if (threads > 1) T_CHECK(!memcmp(w, other, sizeof w), "same bits on %u threads", threads);
    batten_context_free(ctx);
  }
  size_t tasks = 0;
  batten_context_options o = batten_context_options_default();
  batten_context *ctx = NULL;
  o.threads = 3;
  o.parallel_for = backwards;
  o.parallel_user = &tasks;
  batten_context_new(&o, &ctx);
  solve_scene(ctx, &s, BATTEN_SADDLE_CHOLESKY_MIXED, other, c, NULL);
  T_CHECK(!memcmp(w, other, sizeof w) && tasks > 16, "same bits on the host's executor, %zu tasks", tasks);
  batten_context_free(ctx);
  scene_free(&s);
}

/* Against the solution with a unit right side, which is a column of the inverse. */
static void test_inverse_diagonal(batten_context *ctx) {
  static double w[150], d[150], e[150];
  static size_t index[150];
  double c[4];
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 150, 4, 31);
  batten_saddle_matrix m = scene_matrix(&s);
  for (int q = 1; q < METHODS; q++) {
    batten_saddle_options o = batten_saddle_options_default();
    batten_saddle *h = NULL;
    o.method = methods[q];
    for (size_t i = 0; i < s.n; i++) index[i] = (i * 7) % s.n;
    batten_saddle_factor(ctx, &m, &o, &h);
    T_OK(batten_saddle_inverse_diagonal(ctx, h, s.n, index, d), ctx);
    double worst = 0;
    for (size_t i = 0; i < s.n; i++) {
      memset(e, 0, sizeof e);
      e[index[i]] = 1;
      batten_saddle_solve(ctx, h, e, w, c);
      worst = fmax(worst, fabs(d[i] / w[index[i]] - 1));
    }
    T_RATIO(worst, methods[q] == BATTEN_SADDLE_CHOLESKY_MIXED ? 1e-3 : 1e-9, "diagonal of the inverse by %s",
            batten_saddle_method_name(methods[q]));
    T_OK(batten_saddle_inverse_diagonal(ctx, h, 0, NULL, NULL), ctx);
    T_STATUS(batten_saddle_inverse_diagonal(ctx, h, 1, (size_t[]){150}, d), BATTEN_E_INVALID, ctx, "index[0]: 150");
    batten_saddle_free(h);
  }
  scene_free(&s);
}

/* Leave-one-out by the diagonal against leaving one out. */
static void test_leave_one_out(batten_context *ctx) {
  static double w[60], d[60];
  double c[4];
  size_t index[1] = {17};
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, 60, 4, 41), t = scene_new(SCENE_RANDOM, KERNEL_R, 59, 4, 41);
  batten_saddle_matrix m = scene_matrix(&s);
  batten_saddle *h = NULL;
  batten_saddle_factor(ctx, &m, NULL, &h);
  batten_saddle_solve(ctx, h, s.f, w, c);
  batten_saddle_inverse_diagonal(ctx, h, 1, index, d);
  double predicted = w[17] / d[0];
  batten_saddle_free(h);
  for (size_t i = 0, j = 0; i < 60; i++) {
    if (i == 17) continue;
    memcpy(t.x + 3 * j, s.x + 3 * i, 3 * sizeof *t.x);
    for (size_t q = 0; q < 4; q++) t.p[j + q * 59] = s.p[i + q * 60];
    t.f[j++] = s.f[i];
  }
  solve_scene(ctx, &t, BATTEN_SADDLE_LDL, w, c, NULL);
  double value = c[0];
  for (size_t q = 0; q < 3; q++) value += c[q + 1] * s.x[3 * 17 + q];
  for (size_t j = 0; j < 59; j++) {
    double r2 = 0;
    for (size_t q = 0; q < 3; q++) r2 += pow(s.x[3 * 17 + q] - t.x[3 * j + q], 2);
    value += w[j] * scene_phi(KERNEL_R, r2);
  }
  T_RATIO(fabs(predicted / (s.f[17] - value) - 1), 1e-10, "leave-one-out error %.3g", predicted);
  scene_free(&t);
  scene_free(&s);
}

/* k = 0 is a plain definite matrix; k above a tile has blocks of its own in the head. */
static void test_odd_shapes(batten_context *ctx) {
  static double w[300], c[200];
  for (size_t k = 0; k <= 200; k += 50) {
    scene s = scene_new(SCENE_RANDOM, KERNEL_R, 300, k, 51);
    uint64_t seed = 52;
    for (size_t i = 0; i < 300 * k; i++) s.p[i] = 2 * t_uniform(&seed) - 1;
    s.nugget = 1000; /* definite with any P */
    for (int q = 0; q < METHODS; q++) {
      batten_saddle_info info = {0};
      batten_status st = solve_scene(ctx, &s, methods[q], w, c, &info);
      scene_quality quality = scene_check(&s, w, c);
      T_CHECK(st == BATTEN_OK && info.fallbacks == 0 && quality.residual < 2e-13 && quality.orthogonality < 1e-13,
              "k = %zu by %s: residual %.2g, P'w %.2g", k, batten_saddle_method_name(methods[q]), quality.residual,
              quality.orthogonality);
    }
    scene_free(&s);
  }
}

static void test_large(batten_context *ctx) {
  static double w[MOST], c[4];
  scene s = scene_new(SCENE_SPHERE, KERNEL_R, MOST, 4, 61);
  for (size_t i = 0; i < s.n; i++) s.f[i] = 1 + 0.3 * s.x[3 * i] * s.x[3 * i + 1];
  for (int q = 1; q < METHODS; q++) {
    batten_saddle_info info = {0};
    T_OK(solve_scene(ctx, &s, methods[q], w, c, &info), ctx);
    T_RATIO(scene_check(&s, w, c).residual, 1.5e-13, "N = 1000 by %s, %u refinements: residual",
            batten_saddle_method_name(info.method), info.refinements);
    T_CHECK(info.fallbacks == 0 && info.method == methods[q] && info.bytes > 0 && info.time_factor_s > 0,
            "its info: %zu bytes, %.3f s to factor", info.bytes, info.time_factor_s);
  }
  scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_by_hand(ctx);
  test_edges(ctx);
  test_residuals(ctx);
  test_second_routes(ctx);
  test_reproduction(ctx);
  test_invariance(ctx);
  test_extreme_units(ctx);
  test_threads();
  test_inverse_diagonal(ctx);
  test_leave_one_out(ctx);
  test_odd_shapes(ctx);
  test_large(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
