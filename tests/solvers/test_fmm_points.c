/* Fast multipole sums of points that lie badly: the accuracy holds, and the work does not grow with the square. */
#include "fmm_scene.h"

static batten_context *ctx;

static void check(fmm_place place, const batten_radial *k, size_t count, bool own_targets) {
  fmm_scene s = fmm_scene_new(place, k->n, count, own_targets ? count / 2 : 0, 11);
  batten_fmm_options o = batten_fmm_options_default();
  o.accuracy = 1e-6;
  batten_fmm *f = NULL;
  bool ok = batten_fmm_create(ctx, k, count, s.y, s.targets, own_targets ? s.x : NULL, &o, &f) >= 0 &&
            batten_fmm_apply(ctx, f, s.w, NULL, s.u, NULL) >= 0;
  if (!T_CHECK(ok, "%s in %u-D %s", place_names[place], k->n, ok ? "" : batten_error(ctx))) return;
  double value, gradient;
  scene_errors(&s, k, false, s.targets / 60 + 1, &value, &gradient);
  const batten_fmm_info i = batten_fmm_get_info(f);
  printf("# %u levels, %zu cells, %zu translations, %zu terms, %.3f s\n", i.levels, i.cells, i.translations, i.pairs,
         i.time_apply_s);
  /* Graded points lie in the corners of their cells, all of them: there an expansion is worst. */
  T_RATIO(value, place == PLACE_GRADED ? 3e-5 : 2e-6, "%s in %u-D, r^%d", place_names[place], k->n, k->power);
  if (!i.direct) T_RATIO((double)i.pairs, 0.3 * (double)count * (double)s.targets, "terms summed directly");
  batten_fmm_free(f);
  fmm_scene_free(&s);
}

/* Doubling the points about doubles the work, even where they lie in clusters. */
static void test_growth(fmm_place place) {
  const batten_radial k = {3, 1, 0};
  size_t pairs[2], translations[2];
  for (size_t q = 0; q < 2; q++) {
    fmm_scene s = fmm_scene_new(place, 3, q ? 160000 : 20000, 0, 3);
    batten_fmm_options o = batten_fmm_options_default();
    o.accuracy = 1e-3;
    batten_fmm *f = NULL;
    if (batten_fmm_create(ctx, &k, s.sources, s.y, s.sources, NULL, &o, &f) < 0) printf("# %s\n", batten_error(ctx));
    const batten_fmm_info i = batten_fmm_get_info(f);
    pairs[q] = i.pairs, translations[q] = i.translations;
    batten_fmm_free(f);
    fmm_scene_free(&s);
  }
  T_RATIO((double)pairs[1] / (double)pairs[0], 14, "%s, 8 times the points: growth of the terms", place_names[place]);
  T_RATIO((double)translations[1] / (double)translations[0], 16, "%s: and of the translations", place_names[place]);
}

/* All points at one place, or at two: nothing but r = 0, or one distance. */
static void test_equal_points(void) {
  enum { COUNT = 6000 };
  double *x = calloc(COUNT * 3, sizeof *x), *w = malloc(COUNT * sizeof *w), *u = calloc(COUNT, sizeof *u);
  for (size_t i = 0; i < COUNT; i++) w[i] = i % 3 == 0 ? 2 : -0.5;
  batten_fmm *f = NULL;
  T_OK(batten_fmm_create(ctx, &(batten_radial){3, 3, 0}, COUNT, x, COUNT, NULL, NULL, &f), ctx);
  T_OK(batten_fmm_apply(ctx, f, w, NULL, u, NULL), ctx);
  double largest = 0;
  for (size_t i = 0; i < COUNT; i++) largest = fmax(largest, fabs(u[i]));
  T_CHECK(largest == 0, "equal points: 0");
  T_CHECK(batten_fmm_get_info(f).pairs == 1, "and one term");
  batten_fmm_free(f), f = NULL;
  for (size_t i = 0; i < COUNT; i += 2) x[3 * i] = 4, w[i] = 1, w[i + 1] = 3;
  T_OK(batten_fmm_create(ctx, &(batten_radial){3, 3, 0}, COUNT, x, COUNT, NULL, NULL, &f), ctx);
  T_OK(batten_fmm_apply(ctx, f, w, NULL, u, NULL), ctx);
  T_RATIO(fabs(u[0] / (64.0 * 3 * COUNT / 2) - 1) + fabs(u[1] / (64.0 * COUNT / 2) - 1), 1e-8, "two places");
  batten_fmm_free(f);
  free(x), free(w), free(u);
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  for (fmm_place p = 0; p < PLACES; p++) {
    check(p, &(batten_radial){3, 1, 0}, 20000, false);
    check(p, &(batten_radial){2, 2, 1}, 12000, false);
    check(p, &(batten_radial){2, 4, 1}, 12000, true);
  }
  check(PLACE_UNEVEN, &(batten_radial){3, 3, 0}, 30000, true);
  test_growth(PLACE_SURFACE);
  test_growth(PLACE_CLUSTERS);
  test_equal_points();
  batten_context_free(ctx);
  return t_done();
}
