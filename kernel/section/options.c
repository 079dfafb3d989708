/* Options of batten_stack_build: defaults and ranges. */
#include <math.h>

#include "base/checked.h"
#include "section/section_inner.h"

batten_stack_options batten_stack_options_default(void) {
  return (batten_stack_options){
      .struct_size = sizeof(batten_stack_options), .pair_distance = 0.75, .shape = 1, .saturation = 2};
}

static bool at_least_zero(double x) { return x >= 0 && x < INFINITY; }
static bool above_zero(double x) { return x > 0 && x < INFINITY; }

static batten_status check_names(batten_context *ctx, const batten_stack_options *o) {
  const struct {
    const char *name;
    int value, most;
  } names[] = {{"method", (int)o->method, BATTEN_SECTION_CARRIER},
               {"between", (int)o->between, BATTEN_BETWEEN_RATIONAL},
               {"ends[0]", (int)o->ends[0], BATTEN_END_OPEN},
               {"ends[1]", (int)o->ends[1], BATTEN_END_OPEN},
               {"rotation", (int)o->rotation, BATTEN_ROTATION_VELOCITY},
               {"path", (int)o->path, BATTEN_PATH_LINEAR},
               {"parameter", (int)o->parameter, BATTEN_PARAMETER_RATIO},
               {"route", (int)o->route, BATTEN_ROUTE_SPACE}};
  for (size_t i = 0; i < sizeof names / sizeof *names; i++)
    if (names[i].value < 0 || names[i].value > names[i].most)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %d; give one of its names", names[i].name, names[i].value);
  return BATTEN_OK;
}

static batten_status check_lengths(batten_context *ctx, const batten_stack_options *o) {
  const struct {
    const char *name;
    double value;
  } lengths[] = {{"tolerance", o->tolerance},
                 {"min_area", o->min_area},
                 {"end_height[0]", o->end_height[0]},
                 {"end_height[1]", o->end_height[1]},
                 {"gap", o->gap}};
  for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++)
    if (!at_least_zero(lengths[i].value))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %g; must be finite and 0 or more", lengths[i].name,
                         lengths[i].value);
  if (!(o->pair_distance > 0 && o->pair_distance <= 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.pair_distance: %g; give 0 < it <= 1", o->pair_distance);
  if (!above_zero(o->shape))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.shape: %g; must be finite and above 0", o->shape);
  if (!(o->saturation > 0))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.saturation: %g; must be above 0 (INFINITY: none)", o->saturation);
  return BATTEN_OK;
}

static batten_status check_arrays(batten_context *ctx, size_t count, const batten_stack_options *o) {
  for (size_t i = 0; o->scales && i < count; i++)
    if (!above_zero(o->scales[i]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.scales[%zu]: %g; must be finite and above 0", i, o->scales[i]);
  for (size_t i = 0; o->parameters && i < count; i++) {
    if (!isfinite(o->parameters[i]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.parameters[%zu]: %g; must be finite", i, o->parameters[i]);
    if (i > 0 && !(o->parameters[i] > o->parameters[i - 1]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.parameters[%zu]: %.17g after %.17g; must increase", i,
                         o->parameters[i], o->parameters[i - 1]);
  }
  if (o->rotation == BATTEN_ROTATION_VELOCITY && !o->angular_velocity)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.angular_velocity: NULL; BATTEN_ROTATION_VELOCITY needs it");
  for (size_t i = 0; o->angular_velocity && i < count; i++)
    for (size_t k = 0; k < 3; k++)
      if (!isfinite(o->angular_velocity[3 * i + k]))
        return batten_fail(ctx, BATTEN_E_INVALID, "opt.angular_velocity[%zu]: component %zu is %g; must be finite", i,
                           k, o->angular_velocity[3 * i + k]);
  return BATTEN_OK;
}

/* The solid, or its box. */
static bool ends_at_plane(batten_stack_end end) { return end == BATTEN_END_PLANE || end == BATTEN_END_OPEN; }

batten_status stack_check_options(batten_context *ctx, size_t count, const batten_stack_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_stack_options", o->struct_size, sizeof *o);
  if (st >= 0) st = check_names(ctx, o);
  if (st >= 0) st = check_lengths(ctx, o);
  if (st >= 0) st = check_arrays(ctx, count, o);
  if (st < 0) return st;
  if (count == 1 && o->gap == 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.gap: 0; one section needs the distance that it stands for");
  if (count == 1 && ends_at_plane(o->ends[0]) && ends_at_plane(o->ends[1]))
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "opt.ends: both at the plane of the one section, nothing lies between; give one of them FLAT or "
        "ROUNDED");
  return BATTEN_OK;
}
