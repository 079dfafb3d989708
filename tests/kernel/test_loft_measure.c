/* What lofts of scenes leave of interpolation and continuity: minima without inequalities of random stacks, by way of
 * their handles, in the caller's units. */
#include "tap.h"

#include "loft/loft_inner.h"
#include "loft_scenes.h"

typedef struct errors {
  double interpolation, continuity; /* over the size of the contours' box */
} errors;

/* The loft without inequalities. */
static batten_status build(batten_context *ctx, const loft_scene *scene, unsigned degree,
                           const batten_loft_options *opt, batten_loft **out, double *size) {
  loft_stack stack = {0};
  loft_slab *slabs = NULL;
  loft_net net = {0};
  loft_objective *objective = NULL;
  double *y = NULL, *control = NULL;
  size_t count = 0;
  batten_status st =
      loft_stack_make(ctx, scene->count, (const batten_curve *const *)scene->contours, scene->heights, opt, &stack);
  if (st >= 0) {
    count = stack.count - 1;
    *size = stack.size / stack.unit;
    st = loft_slabs_make(ctx, &stack, &slabs);
  }
  for (size_t i = 0; i < count && st >= 0; i++) st = loft_vertices_make(ctx, &stack, i, &slabs[i]);
  if (st >= 0) st = loft_net_make(ctx, &stack, slabs, degree ? degree : 2 * stack.smoothness + 2, &net);
  if (st >= 0) st = loft_objective_new(ctx, &stack, &net, opt, &objective);
  if (st >= 0) {
    y = batten_alloc_array(ctx, net.z.columns, 2 * sizeof *y);
    control = batten_alloc_array(ctx, net.z.rows, 2 * sizeof *control);
    st = y && control ? loft_objective_minimum(ctx, objective, y) : BATTEN_E_NOMEM;
  }
  if (st >= 0) {
    loft_net_expand(&net, y, control);
    st = loft_make(ctx, &stack, &net, scene->heights, control, out);
  }
  batten_free(ctx, control);
  batten_free(ctx, y);
  loft_objective_free(ctx, objective);
  loft_net_free(ctx, &net);
  loft_slabs_free(ctx, count, slabs);
  loft_stack_free(ctx, &stack);
  return st;
}

static errors measure(batten_context *ctx, const loft_rule *rule, unsigned degree) {
  batten_loft_options opt = batten_loft_options_default();
  opt.smoothness = rule->smoothness;
  loft_scene scene = loft_scene_make(ctx, rule);
  batten_loft *loft = NULL;
  double size = 0;
  errors e = {INFINITY, INFINITY};
  batten_status st = build(ctx, &scene, degree, &opt, &loft, &size);
  if (st >= 0)
    st = loft_measure(ctx, loft, (const batten_curve *const *)scene.contours, &e.interpolation, &e.continuity);
  if (st < 0) T_CHECK(false, "%s: %s", batten_status_name(st), batten_error(ctx));
  e.interpolation /= size;
  e.continuity /= size;
  batten_loft_free(loft);
  loft_scene_free(&scene);
  return e;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  for (unsigned d = 2; d <= 5; d++)
    for (unsigned l = 1; l <= (d > 2 ? 2u : 1u); l++)
      for (int closed = 0; closed < 2; closed++) {
        errors worst = {0, 0};
        for (uint64_t seed = 1; seed <= 6; seed++) {
          loft_rule rule = {.degree = d,
                            .smoothness = l,
                            .closed = closed,
                            .contours = 2 + 2 * seed % 9,
                            .inflections = seed % 2 ? 0 : 2,
                            .decades = seed > 4 ? 4 : 2,
                            .rotation = 0.3,
                            .seed = seed};
          errors e = measure(ctx, &rule, seed % 3 ? 0 : 2 * l + 1);
          worst.interpolation = fmax(worst.interpolation, e.interpolation);
          worst.continuity = fmax(worst.continuity, e.continuity);
        }
        T_RATIO(worst.interpolation, 1e-13, "degree %u, smoothness %u, %s: interpolation", d, l,
                closed ? "closed" : "open");
        T_RATIO(worst.continuity, 1e-11, "continuity");
      }
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
