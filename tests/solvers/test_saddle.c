/* Saddle systems: solutions by hand, residuals over sizes and kinds of point sets, invariances, bad input. */
#include "saddle_scene.h"

static const batten_saddle_method methods[] = {BATTEN_SADDLE_AUTO, BATTEN_SADDLE_CHOLESKY, BATTEN_SADDLE_CHOLESKY_MIXED,
                                               BATTEN_SADDLE_LDL, BATTEN_SADDLE_QR};
enum { METHODS = sizeof methods / sizeof *methods };

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

/* Two points on a line at distance 2, kernel -r, P = 1: w = +-1/4 (f1 - f2), c = mean. */
static void test_by_hand(batten_context *ctx) {
  double x[6] = {0, 0, 0, 2, 0, 0}, p[2] = {1, 1}, f[2] = {5, 1}, w[2], c[1];
  scene s = {.n = 2, .k = 1, .kernel = KERNEL_R, .factor = 1, .x = x, .p = p, .f = f};
  for (int q = 0; q < METHODS; q++) {
    batten_saddle_info info;
    batten_status st = solve_scene(ctx, &s, methods[q], w, c, &info);
    /* f1 = -2 w2 + c, f2 = -2 w1 + c, w1 + w2 = 0 */
    T_CHECK(st == BATTEN_OK && fabs(w[0] - 1) < 1e-15 && fabs(w[1] + 1) < 1e-15 && fabs(c[0] - 3) < 1e-15,
            "two points by %s: w = %g %g, c = %g", batten_saddle_method_name(methods[q]), w[0], w[1], c[0]);
  }
}

static void test_residuals(batten_context *ctx) {
  static const size_t sizes[] = {5, 10, 50, 100, 300};
  static double w[300], c[4];
  for (int kernel = 0; kernel < 3; kernel++)
    for (int type = 0; type < SCENE_TYPES; type++) {
      double residual = 0, met = 0, scaled = 0, orthogonality = 0;
      bool ok = true;
      for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++)
        for (int method = 0; method < METHODS; method++) {
          scene s = scene_new((scene_type)type, (scene_kernel)kernel, sizes[q], 4, 7 + sizes[q]);
          batten_status st = solve_scene(ctx, &s, methods[method], w, c, NULL);
          if (st < 0) printf("# n = %zu, %s: %s\n", sizes[q], batten_saddle_method_name(methods[method]), batten_error(ctx));
          ok = ok && st >= 0;
          scene_quality quality = scene_check(&s, w, c);
          residual = fmax(residual, quality.residual);
          if (st == BATTEN_W_ACCURACY) scaled = fmax(scaled, quality.scaled); /* else it met its tolerance */
          else if (st == BATTEN_OK) met = fmax(met, quality.residual);
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

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_by_hand(ctx);
  test_residuals(ctx);
  batten_context_free(ctx);
  return t_done();
}
