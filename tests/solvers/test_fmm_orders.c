/* Fast multipole sums in every order that an accuracy asks for, against sums in long double: each decade is met, and
 * takes an order more than the one before. */
#include "fmm_scene.h"

enum { COUNT = 60000, LOOKED_AT = 40 };

/* Decades 1e-from .. 1e-to; least: the order of the first is that at least. */
static void check(batten_context *ctx, const batten_radial *k, int from, int to, unsigned least) {
  fmm_scene s = fmm_scene_new(PLACE_VOLUME, k->n, COUNT, 0, 11);
  unsigned before = least - 1;
  for (int decade = from; decade <= to; decade++) {
    batten_fmm_options o = batten_fmm_options_default();
    batten_fmm *f = NULL;
    double error = 0, unused;
    char what[64];
    o.accuracy = pow(10, -decade);
    snprintf(what, sizeof what, "r^%d%s in %u-D to 1e-%d", k->power, k->logarithm ? " ln r" : "", k->n, decade);
    batten_status st = batten_fmm_create(ctx, k, COUNT, s.y, COUNT, NULL, &o, &f);
    T_CHECK(st == BATTEN_OK, "%s: %s", what, batten_status_name(st));
    if (!f) break;
    T_OK(batten_fmm_apply(ctx, f, s.w, NULL, s.u, NULL), ctx);
    const batten_fmm_info i = batten_fmm_get_info(f);
    scene_errors(&s, k, false, COUNT / LOOKED_AT, &error, &unused);
    printf("# %s: order %u, rank %zu, operators %.2f s\n", what, i.order, i.rank, i.time_operators_s);
    T_CHECK(!i.direct && i.order > before, "%s: by order %u", what, i.order);
    T_RATIO(error, o.accuracy, "%s", what);
    before = i.order < 14 ? i.order : 13; /* there is no higher one */
    batten_fmm_free(f);
  }
  fmm_scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  check(ctx, &(batten_radial){3, 1, 0}, 4, 12, 6);
  check(ctx, &(batten_radial){3, 3, 0}, 8, 8, 11);
  check(ctx, &(batten_radial){3, 3, 0}, 10, 10, 13);
  check(ctx, &(batten_radial){3, 2, 1}, 8, 8, 11);
  check(ctx, &(batten_radial){2, 1, 0}, 4, 12, 6);
  check(ctx, &(batten_radial){2, 2, 1}, 4, 12, 7);
  check(ctx, &(batten_radial){2, 4, 1}, 12, 12, 14);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
