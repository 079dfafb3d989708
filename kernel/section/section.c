/* The function of one section alone, as a stack makes it. */
#include "base/checked.h"
#include "section/section_inner.h"

/* Of the caller's options only those of sections are read: a single one has no frame, no neighbours and no ends. */
static batten_status take_options(batten_context *ctx, const batten_stack_options *given, batten_stack_options *out) {
  *out = batten_stack_options_default();
  out->gap = 1; /* no function depends on it */
  if (!given) return BATTEN_OK;
  batten_status st = batten_check_struct(ctx, "batten_stack_options", given->struct_size, sizeof *given);
  if (st < 0) return st;
  out->method = given->method;
  out->tolerance = given->tolerance;
  out->pair_distance = given->pair_distance;
  out->min_area = given->min_area;
  return BATTEN_OK;
}

static batten_stack_info tell(const stack *s, const batten_section *given, const section_figures *figures,
                              double tolerance, size_t dropped) {
  const polygon_set *loops = &s->sections[0].loops;
  batten_stack_info info = {.sections = 1,
                            .contours = loops->count ? loops->count : given->contour_count,
                            .points_given = given->starts[given->contour_count] - given->starts[0],
                            .centers = figures->centers,
                            .contours_dropped = dropped,
                            .certified = figures->certified,
                            .section_residual_max = figures->residual_max,
                            .wrong_sign_max = figures->wrong_sign_max,
                            .tolerance = tolerance,
                            .spacing = s->spacing,
                            .parallel = 1,
                            .route = BATTEN_ROUTE_SECTIONS};
  for (size_t i = 0; i < loops->count; i++) info.holes += loops->depth[i] % 2;
  info.pieces = loops->count ? loops->count - info.holes : 1;
  return info;
}

static batten_status judge(batten_context *ctx, const section_figures *figures, double tolerance, bool loops) {
  if (!figures->certified && figures->wrong_sign_max > tolerance)
    return batten_fail(ctx, BATTEN_W_AMBIGUOUS,
                       "section: its function has a wrong sign %.3g deep, above the tolerance %.3g; raise "
                       "opt.tolerance, or give more points where contours come near each other",
                       figures->wrong_sign_max, tolerance);
  if (!figures->certified && loops)
    return batten_fail(
        ctx, BATTEN_W_AMBIGUOUS,
        "section: the sign of its function is not proven everywhere, wrong signs were found %.3g deep, "
        "the tolerance is %.3g; raise opt.tolerance, or give more points where contours come near each "
        "other",
        figures->wrong_sign_max, tolerance);
  if (!figures->certified)
    return batten_fail(
        ctx, BATTEN_W_AMBIGUOUS,
        "section: its points do not settle which side of them is inside; give contours in their order");
  if (figures->status == BATTEN_OK) return BATTEN_OK;
  return batten_fail(ctx, figures->status,
                     "section: its function misses a centre by more than 1e-10 of its range; drop points that nearly "
                     "coincide");
}

batten_status batten_section_fit(batten_context *ctx, const batten_section *section, const batten_stack_options *opt,
                                 batten_solid **out, batten_stack_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!section || !out) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", section ? "out" : "section");
  const double start = batten_now();
  batten_stack_options options;
  section_figures figures;
  stack s = {.ctx = ctx};
  stack_notes notes = {.ctx = ctx};
  batten_section flat = *section;
  for (unsigned k = 0; k < 3; k++) {
    flat.origin[k] = 0;
    for (unsigned l = 0; l < 3; l++) flat.rotation[k][l] = k == l;
  }
  batten_status st = take_options(ctx, opt, &options);
  if (st >= 0) st = stack_check_options(ctx, 1, &options);
  if (st >= 0) st = stack_take_sections(ctx, 1, &flat, &options, &s, &notes);
  if (st < 0) goto done;
  const double tolerance = stack_tolerance(&s, &options), taken = batten_now();
  st = stack_fit_all(ctx, &s, &flat, &options, tolerance, &figures);
  if (st < 0) goto done;
  if (info) {
    *info =
        tell(&s, &flat, &figures, tolerance, notes.count); /* a single section has notes of dropped contours only */
    info->time_total_s = batten_now() - start;
    info->time_fit_s = batten_now() - taken;
  }
  *out = s.sections[0].function;
  s.sections[0].function = NULL;
  st = judge(ctx, &figures, tolerance, s.sections[0].loops.count > 0);
done:
  stack_release(&s);
  batten_free(ctx, notes.items);
  return st;
}
