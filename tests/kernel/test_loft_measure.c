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

static errors measure(batten_context *ctx, const loft_rule *rule, unsigned degree, double gap) {
  batten_loft_options opt = batten_loft_options_default();
  opt.smooth_z = rule->smoothness;
  loft_scene scene = loft_scene_make(ctx, rule);
  for (size_t i = 1; i < scene.count && gap > 0; i++) scene.heights[i] = scene.heights[i - 1] + (i % 2 ? 1 : gap);
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

/* Points times 2^20, heights times 2^-7: the same bits. Over the domain [0, 8], turned by a right angle and moved by
 * the size of the box: the same loft to rounding. */
static void invariances(batten_context *ctx, bool closed) {
  loft_rule rule = {.degree = 3,
                    .smoothness = 2,
                    .closed = closed,
                    .contours = 5,
                    .inflections = 2,
                    .decades = 2,
                    .rotation = 0.3,
                    .seed = 5};
  batten_loft_options opt = batten_loft_options_default();
  opt.smooth_z = rule.smoothness;
  loft_scene first = loft_scene_make(ctx, &rule);
  batten_loft *loft = NULL, *other = NULL;
  double size, domain[2] = {0, 8}, scale[4] = {0x1p20, 0, 0, 0x1p20}, turn[4] = {0, -1, 1, 0};
  T_OK(build(ctx, &first, 0, &opt, &loft, &size), ctx);
  for (int moved = 0; moved < 2; moved++) {
    double shift[2] = {moved ? size : 0, moved ? -size : 0}, apart = 0, other_size;
    loft_scene scene = loft_scene_make(ctx, &rule);
    for (size_t i = 0; i < scene.count; i++) {
      batten_curve_free(scene.contours[i]);
      scene.contours[i] = NULL;
      T_OK(batten_curve_transform(ctx, first.contours[i], moved ? turn : scale, shift, moved ? domain : NULL,
                                  &scene.contours[i]),
           ctx);
      if (!moved) scene.heights[i] *= 0x1p-7;
    }
    T_OK(build(ctx, &scene, 0, &opt, &other, &other_size), ctx);
    bool same = true;
    for (size_t i = 0; i + 1 < scene.count; i++) {
      const loft_patch *a = &loft->patches[i], *b = &other->patches[i];
      same = same && a->count == b->count;
      for (size_t k = 0; same && k < a->count * (loft->degree[1] + 1); k++) {
        const double *x = a->control + 2 * k, *y = b->control + 2 * k;
        same = same && (moved || (y[0] == 0x1p20 * x[0] && y[1] == 0x1p20 * x[1]));
        if (moved) apart = fmax(apart, hypot(y[0] - (shift[0] - x[1]), y[1] - (shift[1] + x[0])));
      }
      for (size_t k = 0; same && k < a->knot_count; k++)
        same = same && (moved ? fabs(b->knots[k] - 8 * a->knots[k]) <= 1e-14 : b->knots[k] == a->knots[k]);
    }
    if (!moved)
      T_CHECK(same, "%s: points times 2^20, heights times 2^-7: the same bits", closed ? "closed" : "open");
    else
      T_RATIO(same ? apart / size : INFINITY, 1e-12, "turned and moved, over another domain");
    batten_loft_free(other);
    other = NULL;
    loft_scene_free(&scene);
  }
  batten_loft_free(loft);
  loft_scene_free(&first);
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
          errors e = measure(ctx, &rule, seed % 3 ? 0 : 2 * l + 1, 0);
          worst.interpolation = fmax(worst.interpolation, e.interpolation);
          worst.continuity = fmax(worst.continuity, e.continuity);
        }
        T_RATIO(worst.interpolation, 1e-13, "degree %u, smoothness %u, %s: interpolation", d, l,
                closed ? "closed" : "open");
        T_RATIO(worst.continuity, 1e-11, "continuity");
      }
  /* Gaps of 1 and 1e-6 in turn: derivatives in the narrow ones are large by rounding alone. */
  loft_rule uneven = {.degree = 3, .smoothness = 2, .contours = 5, .decades = 1, .seed = 3};
  T_RATIO(measure(ctx, &uneven, 0, 1e-6).continuity, 1e-11, "continuity where gaps are uneven");
  for (int closed = 0; closed < 2; closed++) invariances(ctx, closed);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
