/* The iterative method where it could fail: quadratic polynomials and none, points that nearly coincide, outliers,
 * uneven, flat and straight data, singular systems. */
#include "saddle_sums.h"

/* Ten columns of P: 1, x, y, z and all products. Checked by residuals: the dense evaluation above knows four. */
static void test_polynomials(batten_context *ctx) {
  enum { N = 3300 };
  for (size_t k = 0; k <= 10; k += 10) {
    scene s = scene_new(SCENE_RANDOM, KERNEL_R3, N, k, 8);
    answer a = answer_new(N);
    direct d = {0};
    batten_saddle_options o = iterative_options(1e-9);
    for (size_t i = 0; i < N && k == 10; i++) {
      const double *x = s.x + 3 * i;
      double products[6] = {x[0] * x[0], x[1] * x[1], x[2] * x[2], x[0] * x[1], x[0] * x[2], x[1] * x[2]};
      for (size_t c = 0; c < 6; c++) s.p[i + (4 + c) * N] = products[c];
    }
    for (size_t i = 0; i < N; i++) s.f[i] = sin(3 * s.x[3 * i]) * cos(2 * s.x[3 * i + 1]) + s.x[3 * i + 2];
    if (k == 0) s.kernel = KERNEL_R, s.nugget = 4 * N; /* which makes it definite without polynomials */
    o.smooth_kernel = k == 10;
    solve(ctx, &s, &d, &o, &a);
    T_CHECK(a.status == BATTEN_OK, "k = %zu: %u iterations %s", k, a.info.iterations,
            a.status ? batten_error(ctx) : "");
    T_RATIO(residual_of(&s, &a, a.c), 3e-9, "k = %zu: residual of all rows", k);
    free(a.w);
    scene_free(&s);
  }
}

/* ---- Awkward points ---- */

static void awkward(batten_context *ctx, scene *s, unsigned allowed, const char *what) {
  answer a = answer_new(s->n);
  direct d = {0};
  batten_saddle_options o = iterative_options(1e-8);
  polynomials(s);
  solve(ctx, s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK, "%s: residual %.2g, %zu of %zu domains in double%s%s", what, a.info.residual_rows,
          a.info.domains_double, a.info.domains, a.status ? ", " : "", a.status ? batten_error(ctx) : "");
  T_RATIO(a.info.iterations, allowed, "%s: iterations", what);
  T_RATIO(residual_of(s, &a, a.c), 3e-8, "%s: residual of all rows", what);
  free(a.w);
}

static void test_awkward(batten_context *ctx) {
  enum { N = 3300 };
  static const scene_type types[] = {SCENE_GRID, SCENE_CLUSTERS, SCENE_TINY, SCENE_HUGE, SCENE_TRANSLATED};
  for (size_t q = 0; q < sizeof types / sizeof *types; q++) {
    scene s = scene_new(types[q], KERNEL_R, N, 4, 7);
    for (size_t i = 0; i < N; i++) s.f[i] = sin((double)i * 0.01) + s.f[i] * 1e-3;
    awkward(ctx, &s, 9, scene_names[types[q]]);
    scene_free(&s);
  }
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 9);
  for (size_t i = 1; i < N; i += 20) /* 5 % twice, 1e-10 away */
    for (size_t a = 0; a < 3; a++) s.x[3 * i + a] = s.x[3 * i - 3 + a] + 1e-10 * (double)(a + 1);
  smooth_data(&s);
  awkward(ctx, &s, 8, "pairs 1e-10 apart");
  scene_free(&s);

  s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 10);
  smooth_data(&s);
  s.x[3 * 17] = 1e6;
  s.f[17] = 0;
  awkward(ctx, &s, 9, "an outlier");
  scene_free(&s);

  s = scene_new(SCENE_SPHERE, KERNEL_R, N, 4, 11); /* a thousandth of the spacing on a cap */
  for (size_t i = 0; i < N; i += 2) {
    double *x = s.x + 3 * i;
    x[0] *= 1e-3, x[1] *= 1e-3, x[2] = sqrt(1 - x[0] * x[0] - x[1] * x[1]);
  }
  for (size_t i = 0; i < N; i++) s.f[i] = sin(3 * s.x[3 * i]) + s.x[3 * i + 1] * s.x[3 * i + 2];
  awkward(ctx, &s, 7, "densities 1 : 1000");
  scene_free(&s);

  s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 12); /* every domain is flat, or of few flats: P is singular there */
  for (size_t i = 0; i < N; i++) s.x[3 * i + i % 3] = s.x[3 * i + i % 3] < 0 ? -1 : 1;
  smooth_data(&s);
  awkward(ctx, &s, 7, "a cube's faces");
  scene_free(&s);

  s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 13); /* lines */
  for (size_t i = 0; i < N; i++) s.x[3 * i + i % 3] = 0, s.x[3 * i + (i + 1) % 3] = 0.5;
  smooth_data(&s);
  awkward(ctx, &s, 5, "three lines");
  scene_free(&s);
}

static void test_singular(batten_context *ctx) {
  enum { N = 3300 };
  answer a = answer_new(N);
  direct d = {0};
  batten_saddle_options o = iterative_options(1e-6);
  scene s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 14);
  for (size_t q = 0; q < 3; q++) s.x[3 * 2000 + q] = s.x[3 * 7 + q];
  polynomials(&s);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_E_SINGULAR && strstr(batten_error(ctx), "rows 7 and 2000 are equal"), "a duplicate: %s",
          batten_error(ctx));
  s.nugget = 1e-3;
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_OK, "a duplicate with a nugget %s", a.status ? batten_error(ctx) : "");
  s.nugget = 0;
  for (size_t i = 0; i < 60; i++)
    for (size_t q = 0; q < 3; q++) s.x[3 * (40 * i + 3) + q] = s.x[3 * 7 + q];
  polynomials(&s);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_E_SINGULAR && strstr(batten_error(ctx), "are equal"), "sixty duplicates: %s",
          batten_error(ctx));
  scene_free(&s);

  s = scene_new(SCENE_RANDOM, KERNEL_R, N, 4, 15);
  for (size_t i = 0; i < N; i++) s.x[3 * i + 2] = 0.5 * s.x[3 * i] + 0.25;
  polynomials(&s);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_E_SINGULAR && strstr(batten_error(ctx), "matrix.p: column"), "all in a plane: %s",
          batten_error(ctx));
  s.factor = -1;
  scene_points(SCENE_RANDOM, N, &(uint64_t){5}, s.x);
  polynomials(&s);
  solve(ctx, &s, &d, &o, &a);
  T_CHECK(a.status == BATTEN_E_SINGULAR && strstr(batten_error(ctx), "check the kernel's sign"), "the wrong sign: %s",
          batten_error(ctx));
  scene_free(&s);
  free(a.w);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_polynomials(ctx);
  test_awkward(ctx);
  test_singular(ctx);
  batten_context_free(ctx);
  return t_done();
}
