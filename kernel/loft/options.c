/* Options of batten_loft_build: defaults and ranges. */
#include "base/checked.h"
#include "loft_inner.h"

enum { ROUNDS_MAX = 100, DEPTH_MAX = 10, KNOT_ROUNDS_MAX = 10, SAMPLES_MAX = 1000 };

batten_loft_options batten_loft_options_default(void) {
  return (batten_loft_options){.struct_size = sizeof(batten_loft_options),
                               .degree_z_max = BATTEN_SURFACE_DEGREE_MAX,
                               .knot_tolerance = 1e-12,
                               .tension = 0.01,
                               .samples = 20,
                               .rounds = 6,
                               .margin = 0.01,
                               .depth_max = 4,
                               .knot_rounds = 2,
                               .zone = 0.1,
                               .row_limit = 5000000};
}

/* Smoothness 0 allows what one derivative does: what the contours have is not known here. */
static batten_status check_degrees(batten_context *ctx, const batten_loft_options *o) {
  if (o->smooth_z > 2)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.smooth_z: %u; must be 1 or 2, or 0 (as the contours)",
                       o->smooth_z);
  unsigned least = 2 * (o->smooth_z ? o->smooth_z : 1) + 1;
  if (o->degree_z_max < least || o->degree_z_max > BATTEN_SURFACE_DEGREE_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.degree_z_max: %u; must be %u .. %d", o->degree_z_max, least,
                       BATTEN_SURFACE_DEGREE_MAX);
  if (o->degree_z != 0 && (o->degree_z < least || o->degree_z > o->degree_z_max))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.degree_z: %u; must be %u .. %u (2 smooth_z + 1 .. degree_z_max), or 0", o->degree_z,
                       least, o->degree_z_max);
  return BATTEN_OK;
}

static batten_status check_counts(batten_context *ctx, const batten_loft_options *o) {
  const struct {
    const char *name;
    unsigned value, least, most;
  } counts[] = {{"samples", o->samples, o->degree_z > 3 ? o->degree_z : 3, SAMPLES_MAX},
                {"rounds", o->rounds, 1, ROUNDS_MAX},
                {"depth_max", o->depth_max, 0, DEPTH_MAX},
                {"knot_rounds", o->knot_rounds, 0, KNOT_ROUNDS_MAX}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].value < counts[i].least || counts[i].value > counts[i].most)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %u; must be %u .. %u", counts[i].name, counts[i].value,
                         counts[i].least, counts[i].most);
  if (o->row_limit < 1) return batten_fail(ctx, BATTEN_E_INVALID, "opt.row_limit: 0; must be 1 or more");
  return BATTEN_OK;
}

batten_status loft_options_check(batten_context *ctx, const batten_loft_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_loft_options", o->struct_size, sizeof *o);
  if (st >= 0) st = check_degrees(ctx, o);
  if (st >= 0) st = check_counts(ctx, o);
  if (st < 0) return st;
  if (!(o->knot_tolerance >= 0 && o->knot_tolerance < 0.1))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.knot_tolerance: %g; must be 0 or more and below 0.1",
                       o->knot_tolerance);
  if (!(o->tension >= 0 && o->tension < INFINITY))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.tension: %g; must be finite and 0 or more", o->tension);
  if (!(o->margin > 0 && o->margin < 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.margin: %g; must be above 0 and below 1", o->margin);
  if (!(o->zone > 0 && o->zone <= 0.5))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.zone: %g; must be above 0 and 0.5 at most", o->zone);
  return BATTEN_OK;
}
