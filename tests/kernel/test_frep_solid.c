/* A tree as a solid: its points, its mesh, a carrier of others, a leaf again. */
#include "frep_checks.h"

static const double o[3] = {0, 0, 0};
#define T_PI_OVER_3 1.04719755119659774615

/* A plate with a through-hole, a ball apart from it. */
static batten_frep *plate(batten_context *ctx) {
  batten_carrier *c = NULL;
  batten_frep *box = NULL, *hole = NULL, *ball = NULL, *plate = NULL, *all = NULL;
  T_OK(batten_carrier_box(ctx, 3, o, (double[]){1, 0.8, 0.25}, NULL, 0, &c), ctx);
  T_OK(batten_frep_carrier(ctx, c, &box), ctx);
  batten_carrier_free(c);
  T_OK(batten_frep_cone(ctx, (double[]){0, 0, -1}, (double[]){0, 0, 1}, 0.4, 0.3, &hole), ctx);
  T_OK(batten_frep_ball(ctx, 3, (double[]){2, 0, 0}, 0.3, &ball), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_DIFFERENCE, box, hole, 0, &plate), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, plate, ball, 1, &all), ctx);
  batten_frep_free(box);
  batten_frep_free(hole);
  batten_frep_free(ball);
  batten_frep_free(plate);
  return all;
}

static void test_mesh(batten_context *ctx) {
  batten_frep *a = plate(ctx);
  batten_solid *s = NULL;
  T_OK(batten_frep_to_solid(ctx, a, NULL, NULL, 0, &s), ctx);
  T_CHECK(batten_solid_kind_of(s) == BATTEN_SOLID_TREE && batten_solid_tree(s) == a, "the solid is the tree");
  size_t count;
  const double *points = batten_solid_points(s, &count);
  double *f = malloc(count * sizeof *f), *g = malloc(3 * count * sizeof *g), worst = 0;
  size_t on_ball = 0;
  T_OK(batten_solid_evaluate(ctx, s, count, points, f, g, NULL), ctx);
  for (size_t i = 0; i < count; i++) {
    worst = fmax(worst, fabs(f[i]));
    on_ball += points[3 * i] > 1.5;
  }
  T_RATIO(worst, 1e-6, "%zu points on the surface (%zu of the ball)", count, on_ball);
  T_CHECK(on_ball > 10 && count - on_ball > 100, "both pieces have points");
  free(f);
  free(g);
  batten_polygonize_options opt = batten_polygonize_options_default();
  opt.cell = 0.06;
  batten_mesh *mesh = NULL;
  batten_field field = batten_solid_field(s);
  batten_status st = batten_polygonize(ctx, &field, count, points, &opt, &mesh, NULL);
  T_CHECK(st >= 0, "%s: %s", batten_status_name(st), batten_error(ctx));
  batten_mesh_measures m;
  T_OK(batten_mesh_measure(ctx, mesh, &m), ctx);
  T_CHECK(m.components == 2 && m.boundary_loops == 0 && m.genus == 1, "a ring and a ball: %zu pieces, genus %ld",
          m.components, m.genus);
  /* box less the frustum of radii 0.3625 and 0.3375 over its thickness of 0.5, and the ball; its 20.8 of sharp edges
   * are cut by cells, up to a triangle across one */
  double hole = T_PI_OVER_3 * 0.5 * (0.3625 * 0.3625 + 0.3625 * 0.3375 + 0.3375 * 0.3375);
  double volume = 2 * 1.6 * 0.5 - hole + 4 * T_PI_OVER_3 * 0.027;
  T_RATIO(fabs(m.volume - volume), 20.8 * opt.cell * opt.cell / 2, "volume %g of %g", m.volume, volume);
  batten_mesh_free(mesh);
  batten_solid_free(s);
  batten_frep_free(a);
}

/* A leaf again, and under a carrier: same values. */
static void test_nested(batten_context *ctx) {
  batten_frep *a = plate(ctx), *leaf = NULL, *through = NULL;
  batten_solid *s = NULL, *again = NULL;
  batten_carrier *carrier = NULL;
  T_OK(batten_frep_to_solid(ctx, a, (double[]){-2, -2, -2}, (double[]){3, 2, 2}, 0.2, &s), ctx);
  T_OK(batten_frep_solid(ctx, s, &leaf), ctx);
  frep_check(ctx, "a tree as a leaf", leaf, 1.5, 0.03, 1e-6, 2048);
  T_OK(batten_carrier_solid(ctx, s, &carrier), ctx);
  T_OK(batten_frep_carrier(ctx, carrier, &through), ctx);
  double x[30], f[3][10];
  uint64_t seed = 8;
  for (int i = 0; i < 30; i++) x[i] = 3 * t_uniform(&seed) - 1.5;
  T_OK(batten_frep_evaluate(ctx, a, 10, x, f[0], NULL), ctx);
  T_OK(batten_frep_evaluate(ctx, leaf, 10, x, f[1], NULL), ctx);
  T_OK(batten_frep_evaluate(ctx, through, 10, x, f[2], NULL), ctx);
  T_CHECK(!memcmp(f[0], f[1], sizeof f[0]) && !memcmp(f[0], f[2], sizeof f[0]), "the same bits through both ways");
  batten_status st = BATTEN_OK;
  unsigned levels = 0;
  batten_frep *top = batten_frep_retain(leaf);
  while (st >= 0) {
    st = batten_frep_to_solid(ctx, top, (double[]){-2, -2, -2}, (double[]){3, 2, 2}, 0.5, &again);
    batten_frep_free(top);
    if (st < 0) break;
    T_OK(batten_frep_solid(ctx, again, &top), ctx);
    batten_solid_free(again);
    levels++;
  }
  T_CHECK(st == BATTEN_E_TOO_LARGE && levels > 40, "%u levels of trees in trees, then: %s", levels,
          batten_error(ctx));
  batten_carrier_free(carrier);
  batten_solid_free(s);
  batten_frep_free(a);
  batten_frep_free(leaf);
  batten_frep_free(through);
}

static void test_plane(batten_context *ctx) {
  batten_frep *a = NULL;
  batten_solid *s = NULL;
  T_OK(batten_frep_ball(ctx, 2, (double[]){1, 2}, 0.5, &a), ctx);
  T_OK(batten_frep_to_solid(ctx, a, NULL, NULL, 0, &s), ctx);
  size_t count;
  const double *points = batten_solid_points(s, &count);
  double worst = 0;
  for (size_t i = 0; i < count; i++) worst = fmax(worst, fabs(hypot(points[2 * i] - 1, points[2 * i + 1] - 2) - 0.5));
  T_RATIO(worst, 1e-14, "%zu points of a disc lie on its circle", count);
  batten_solid_free(s);
  batten_frep_free(a);
}

static void test_bad(batten_context *ctx) {
  batten_frep *a = NULL, *b = NULL;
  batten_solid *s = NULL;
  T_OK(batten_frep_ball(ctx, 3, o, 1, &a), ctx);
  T_STATUS(batten_frep_to_solid(ctx, NULL, NULL, NULL, 0, &s), BATTEN_E_INVALID, ctx, "a: NULL; give a node");
  T_STATUS(batten_frep_to_solid(ctx, a, o, NULL, 0, &s), BATTEN_E_INVALID, ctx, "upper: NULL; give both corners");
  T_STATUS(batten_frep_to_solid(ctx, a, o, o, 0, &s), BATTEN_E_INVALID, ctx, "lower[0], upper[0]: 0, 0; give finite");
  T_STATUS(batten_frep_to_solid(ctx, a, NULL, NULL, -1, &s), BATTEN_E_INVALID, ctx, "cell: -1; give a positive");
  T_STATUS(batten_frep_to_solid(ctx, a, NULL, NULL, 0, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  batten_status st = batten_frep_to_solid(ctx, a, (double[]){2, 2, 2}, (double[]){3, 3, 3}, 0.1, &s);
  T_CHECK(st == BATTEN_E_NOT_FOUND, "a box beside the solid: %s", batten_error(ctx));
  T_OK(batten_frep_negation(ctx, a, &b), ctx);
  T_STATUS(batten_frep_to_solid(ctx, b, NULL, NULL, 0, &s), BATTEN_E_NOT_FOUND, ctx, "a: the solid has no end");
  T_CHECK(s == NULL, "out is untouched on failure");
  batten_frep_free(a);
  batten_frep_free(b);
}

static batten_status make_solid(batten_context *ctx, void *arg) {
  (void)arg;
  batten_frep *a = NULL;
  batten_solid *s = NULL;
  batten_status st = batten_frep_ball(ctx, 3, o, 1, &a);
  if (st >= 0) st = batten_frep_to_solid(ctx, a, NULL, NULL, 0.3, &s);
  batten_solid_free(s);
  batten_frep_free(a);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_mesh(ctx);
  test_nested(ctx);
  test_plane(ctx);
  test_bad(ctx);
  t_fail_every_allocation("a tree as a solid", make_solid, NULL);
  t_cancel_every_progress("a tree as a solid", make_solid, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
