/* Fast multipole sums against sums in long double: every kernel, dimension and kind of term. */
#include "fmm_scene.h"

static batten_context *ctx;

/* One product by hand: two sources, one target between, in the plane. */
static void test_by_hand(void) {
  const double y[4] = {0, 0, 3, 4}, x[2] = {0, 4}, w[2] = {2, -1}, g[4] = {0, 1, 0, 0};
  batten_fmm_options o = batten_fmm_options_default();
  o.gradients = o.dipoles = 1;
  batten_fmm *f = NULL;
  double u = 0, du[2] = {0, 0};
  T_OK(batten_fmm_create(ctx, &(batten_radial){2, 3, 0}, 2, y, 1, x, &o, &f), ctx);
  T_OK(batten_fmm_apply(ctx, f, w, g, &u, du), ctx);
  /* 2 * 64 - 27 - 3 * 4 * 4;  gradients: 2 * 3 r d - (3 r e + 3 d_y d / r), and -3 r d of the second */
  T_RATIO(fabs(u - (128 - 27 - 48)), 1e-13, "value by hand");
  T_RATIO(fabs(du[0] - 27) + fabs(du[1] - (2 * 48 - 24)), 1e-13, "gradient by hand");
  batten_fmm_free(f);
}

/* What is wanted may be missed by `slack` where derivatives come in: they are rougher than the values. */
static void check(const batten_radial *k, size_t sources, size_t targets, double accuracy, bool derivatives) {
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, k->n, sources, targets, 5);
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = accuracy;
  o.gradients = o.dipoles = derivatives;
  batten_fmm *f = NULL;
  char what[96];
  snprintf(what, sizeof what, "r^%d%s in %u-D, %zu to %zu, %g%s", k->power, k->logarithm ? " ln r" : "", k->n,
           sources, s.targets, accuracy, derivatives ? ", derivatives" : "");
  bool ok = batten_fmm_create(ctx, k, sources, s.y, targets ? targets : sources, targets ? s.x : NULL, &o, &f) >= 0 &&
            batten_fmm_apply(ctx, f, s.w, derivatives ? s.g : NULL, s.u, derivatives ? s.du : NULL) >= 0;
  if (!T_CHECK(ok, "%s %s", what, ok ? "" : batten_error(ctx))) return;
  double value, gradient, told = 0, told_gradient = 0;
  scene_errors(&s, k, derivatives, s.targets / 60 + 1, &value, &gradient);
  batten_fmm_error(ctx, f, s.w, derivatives ? s.g : NULL, s.u, derivatives ? s.du : NULL, 200, 3, &told,
                   derivatives ? &told_gradient : NULL);
  const batten_fmm_info i = batten_fmm_get_info(f);
  printf("# order %u, rank %zu, %zu cells, %zu terms, told %.2g, %.2g\n", i.order, i.rank, i.cells, i.pairs, told,
         told_gradient);
  T_CHECK(!i.direct, "%s is not summed directly", what);
  T_RATIO(value, accuracy, "%s: values", what);
  if (derivatives) T_RATIO(gradient, 30 * accuracy, "%s: gradients", what);
  T_CHECK(told < 3 * value + 1e-14 && value < 3 * told + 1e-14, "%s: the error is told, %.2g for %.2g", what, told,
          value);
  if (derivatives) { /* neither dipoles nor gradients */
    T_OK(batten_fmm_apply(ctx, f, s.w, NULL, s.u, NULL), ctx);
    scene_errors(&s, k, false, s.targets / 30 + 1, &value, &gradient);
    T_RATIO(value, accuracy, "%s: values of weights alone", what);
  }
  batten_fmm_free(f);
  fmm_scene_free(&s);
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_by_hand();
  static const batten_radial kernels[] = {{2, 1, 0}, {2, 2, 1}, {2, 3, 0}, {2, 4, 1}, {2, 5, 0},
                                          {2, 6, 1}, {2, 7, 0}, {3, 1, 0}, {3, 2, 1}, {3, 3, 0},
                                          {3, 4, 1}, {3, 5, 0}, {3, 6, 1}, {3, 7, 0}};
  for (size_t i = 0; i < sizeof kernels / sizeof *kernels; i++) check(&kernels[i], 6000, 0, 1e-3, true);
  /* Finer: a kernel with a logarithm and one without in either dimension, with derivatives and without. */
  check(&kernels[1], 15000, 0, 1e-8, true);
  check(&kernels[2], 15000, 0, 1e-11, false);
  check(&kernels[7], 15000, 0, 1e-5, true);
  check(&kernels[8], 8000, 0, 1e-4, false);
  check(&kernels[9], 15000, 0, 1e-7, false);
  check(&kernels[7], 20000, 3000, 1e-3, true);
  check(&kernels[7], 3000, 20000, 1e-3, true);
  batten_context_free(ctx);
  return t_done();
}
