/* Options of batten_contour_fit and batten_contour_propose: defaults and ranges. */
#include "contour_inner.h"

#include "base/checked.h"

enum { PASSES_MAX = 100, DEPTH_MAX = 20 };

batten_contour_options batten_contour_options_default(void) {
  return (batten_contour_options){.struct_size = sizeof(batten_contour_options),
                                  .degree = 3,
                                  .smoothness = 2,
                                  .parametrization = BATTEN_CONTOUR_CHORD,
                                  .domain = {NAN, NAN},
                                  .inflection_count = BATTEN_INFLECTIONS_AUTO,
                                  .significance = 4,
                                  .end_points = {{NAN, NAN}, {NAN, NAN}},
                                  .end_tangents = {{NAN, NAN}, {NAN, NAN}},
                                  .rounds = 10,
                                  .rounds_tol = 1e-3,
                                  .correction_passes = 3,
                                  .tension = CONTOUR_TENSION,
                                  .blend = 0.05,
                                  .margin = 1e-3,
                                  .gap = 0.1,
                                  .depth_max = 12,
                                  .row_limit = 2000000};
}

static batten_status check_space(batten_context *ctx, const batten_contour_options *o) {
  if (o->smoothness < 1 || o->smoothness > 2)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.smoothness: %u; must be 1 or 2", o->smoothness);
  if (o->degree <= o->smoothness || o->degree > BATTEN_CURVE_DEGREE_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.degree: %u; must be %u .. %d for smoothness %u", o->degree,
                       o->smoothness + 1, BATTEN_CURVE_DEGREE_MAX, o->smoothness);
  if ((unsigned)o->parametrization > BATTEN_CONTOUR_FOLEY)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.parametrization: %d; must be a batten_contour_parametrization",
                       (int)o->parametrization);
  return BATTEN_OK;
}

static batten_status check_counts(batten_context *ctx, const batten_contour_options *o) {
  const struct {
    const char *name;
    unsigned value, least, most;
  } counts[] = {{"rounds", o->rounds, 1, BATTEN_CONTOUR_ROUNDS_MAX},
                {"correction_passes", o->correction_passes, 0, PASSES_MAX},
                {"construction", o->construction, 0, 2},
                {"depth_max", o->depth_max, 0, DEPTH_MAX}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].value < counts[i].least || counts[i].value > counts[i].most)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %u; must be %u .. %u", counts[i].name, counts[i].value,
                         counts[i].least, counts[i].most);
  if (o->row_limit < 1) return batten_fail(ctx, BATTEN_E_INVALID, "opt.row_limit: 0; must be 1 or more");
  if (o->sign < -1 || o->sign > 1)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.sign: %d; must be 1 (left), -1 (right), or 0 (as the data have it)", o->sign);
  return BATTEN_OK;
}

static batten_status check_numbers(batten_context *ctx, const batten_contour_options *o) {
  const struct {
    const char *name;
    double value, below;
  } parts[] = {{"blend", o->blend, 1},
               {"margin", o->margin, 1},
               {"gap", o->gap, 0.5},
               {"significance", o->significance, INFINITY}};
  for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
    if (!(parts[i].value > 0 && parts[i].value < parts[i].below))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %g; must be above 0 and below %g", parts[i].name,
                         parts[i].value, parts[i].below);
  const struct {
    const char *name;
    double value;
  } sizes[] = {{"tension", o->tension}, {"rounds_tol", o->rounds_tol}, {"tolerance", o->tolerance}};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
    if (!(sizes[i].value >= 0 && sizes[i].value < INFINITY))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %g; must be finite and 0 or more", sizes[i].name,
                         sizes[i].value);
  return BATTEN_OK;
}

/* Both numbers are given, or both are NaN. */
static batten_status check_pair(batten_context *ctx, const char *name, int end, const double v[2], bool *given) {
  *given = isfinite(v[0]) && isfinite(v[1]);
  if (*given || (isnan(v[0]) && isnan(v[1]))) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s[%d]: (%g, %g); give two finite numbers, or NaN for both", name,
                     end, v[0], v[1]);
}

static batten_status check_ends(batten_context *ctx, const batten_contour_options *o) {
  for (int end = 0; end < 2; end++) {
    bool point, tangent;
    batten_status st = check_pair(ctx, "end_points", end, o->end_points[end], &point);
    if (st >= 0) st = check_pair(ctx, "end_tangents", end, o->end_tangents[end], &tangent);
    if (st < 0) return st;
    if (o->closed && (o->fix_ends[end] || tangent))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s[%d]: a closed curve has no ends; leave it %s",
                         o->fix_ends[end] ? "fix_ends" : "end_tangents", end, o->fix_ends[end] ? "0" : "NaN");
    if (tangent && o->end_tangents[end][0] == 0 && o->end_tangents[end][1] == 0)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.end_tangents[%d]: (0, 0); give a direction, or NaN for both",
                         end);
  }
  return BATTEN_OK;
}

batten_status contour_options_check(batten_context *ctx, const batten_contour_options *opt) {
  batten_status st =
      batten_check_struct(ctx, "batten_contour_options", opt->struct_size, sizeof(batten_contour_options));
  if (st >= 0) st = check_space(ctx, opt);
  if (st >= 0) st = check_counts(ctx, opt);
  if (st >= 0) st = check_numbers(ctx, opt);
  return st < 0 ? st : check_ends(ctx, opt);
}

/* ---- knots and inflections that are given ------------------------------------------------------- */

static batten_status check_ascending(batten_context *ctx, const char *name, size_t count, const double *values,
                                     const double domain[2], bool start) {
  if (count > 0 && !values)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: NULL; give [%zu] numbers", name, count);
  for (size_t i = 0; i < count; i++) {
    bool inside = values[i] < domain[1] && (start ? values[i] >= domain[0] : values[i] > domain[0]);
    if (!inside)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s[%zu]: %.17g; must lie inside the domain, %.17g to %.17g",
                         name, i, values[i], domain[0], domain[1]);
    if (i > 0 && !(values[i] > values[i - 1]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s[%zu]: %.17g is not above the one before, %.17g; sort them",
                         name, i, values[i], values[i - 1]);
  }
  return BATTEN_OK;
}

batten_status contour_breaks_check(batten_context *ctx, const batten_contour_options *o, const double domain[2]) {
  batten_status st = BATTEN_OK;
  if (o->breaks || o->break_count) st = check_ascending(ctx, "breaks", o->break_count, o->breaks, domain, false);
  if (st < 0 || o->inflection_count == BATTEN_INFLECTIONS_AUTO) return st;
  if (o->closed && o->inflection_count % 2)
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "opt.inflection_count: %zu; a closed curve changes the sign of its curvature an even number of "
        "times",
        o->inflection_count);
  return check_ascending(ctx, "inflections", o->inflection_count, o->inflections, domain, o->closed);
}
