/* The search for the tension weight: kernel/convex/reference.c. */
#include "convex/convex_inner.h"
#include "convex_scenes.h"
#include "tap.h"

typedef struct rig {
  double knots[2][16];
  convex_space space;
  convex_objective objective;
  convex_scene scene;
  double control[3 * 64];
  convex_row_options rows;
} rig;

static void make_rig(batten_context *ctx, rig *r, unsigned degree, convex_scene scene) {
  r->scene = scene;
  r->rows =
      (convex_row_options){.directions = 4, .depth_max = 6, .row_share = 0.15, .margin = 1e-3, .row_limit = 500000};
  for (int k = 0; k < 2; k++) {
    size_t n = bspline_make_knots(degree, degree - 1, 1, NULL, 0, 1, r->knots[k]);
    r->space.axis[k] = (bspline){degree, n - degree - 1, r->knots[k]};
  }
  T_OK(convex_objective_new(ctx, &r->space, scene.count, scene.points, NULL, &r->objective), ctx);
  convex_objective_set(&r->objective, &r->space, scene.parameters);
}

static void free_rig(batten_context *ctx, rig *r) {
  convex_objective_free(ctx, &r->objective);
  convex_scene_free(&r->scene);
}

static bool is_convex(batten_context *ctx, rig *r, double w) {
  double control[3 * 64];
  bool convex = false;
  if (convex_objective_solve(ctx, &r->objective, &r->space, w, control) < 0) return false;
  return convex_is_convex(ctx, &r->space, control, &r->rows, &convex) >= 0 && convex;
}

/* The weight is a power of two; its surface is convex, that of half of it is not. */
static void check_paper(batten_context *ctx, uint64_t seed) {
  rig r;
  make_rig(ctx, &r, 3, convex_scene_paper(seed));
  convex_reference out = {.control = r.control};
  T_OK(convex_reference_find(ctx, &r.objective, &r.space, r.scene.parameters, &r.rows, 1e-9, &out), ctx);
  int exponent;
  T_CHECK(out.found && !out.whole && frexp(out.weight, &exponent) == 0.5, "seed %d: w = %g after %u steps", (int)seed,
          out.weight, out.steps);
  T_CHECK(is_convex(ctx, &r, out.weight) && !is_convex(ctx, &r, out.weight / 2), "w does, w / 2 does not");
  free_rig(ctx, &r);
}

static void check_kinds(batten_context *ctx) {
  rig r;
  /* an ellipsoid without noise is fitted convex without tension */
  make_rig(ctx, &r, 3, convex_scene_make(&(convex_rule){.count = 300, .seed = 1}));
  convex_reference out = {.control = r.control};
  T_OK(convex_reference_find(ctx, &r.objective, &r.space, r.scene.parameters, &r.rows, 0, &out), ctx);
  T_CHECK(out.found && out.whole && out.weight == 0, "without noise no tension is needed");
  free_rig(ctx, &r);
  /* a saddle stays one, a plane flat */
  for (int flat = 0; flat < 2; flat++) {
    make_rig(ctx, &r, 3,
             convex_scene_make(&(convex_rule){.body = flat ? CONVEX_PLANE : CONVEX_SADDLE, .count = 300}));
    out = (convex_reference){.control = r.control};
    T_OK(convex_reference_find(ctx, &r.objective, &r.space, r.scene.parameters, &r.rows, 1e-9, &out), ctx);
    T_CHECK(out.found && out.bent, "a %s has no convex reference but a bent plane", flat ? "plane" : "saddle");
    free_rig(ctx, &r);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (uint64_t seed = 0; seed < 4; seed++) check_paper(ctx, seed);
  check_kinds(ctx);
  batten_context_free(ctx);
  return t_done();
}
