/* Contours from raw slices: the same direction, the same start, inflections at the same parameters, the same knots;
 * then each slice is fitted on its own by batten_contour_fit.
 *
 * Fits call into the context, which serves one thread at a time: slices are fitted one after the other, and each fit
 * uses the context's threads. */
#include "match.h"

#include <string.h>

#include "base/checked.h"
#include "contour/contour_inner.h"

/* Slices of few points have the knots of those that need most, and between its points a curve must not run away: as
 * many points as unknowns get this tension, four times as many hardly any. */
static const double TENSION = 1e-4, TENSION_POWER = 4;

batten_loft_match_options batten_loft_match_options_default(void) {
  batten_loft_match_options o = {
      .struct_size = sizeof o, .fit = batten_contour_options_default(), .orient = 1, .align = 1, .features = 1};
  /* Contours that hardly bend at some knots leave sections no room there. Every round takes a part of what the
   * reference had. */
  o.fit.margin = 0.2;
  o.fit.rounds = 3;
  return o;
}

enum { ATTEMPTS = 4 }; /* to meet a tolerance */

/* ---- checks -------------------------------------------------------------------------------------- */

static batten_status check_given(batten_context *ctx, const batten_contour_options *o) {
  const char *name = NULL;
  if (o->parameters) name = "parameters";
  if (o->breaks || o->break_count) name = "breaks";
  if (o->inflections || o->inflection_count != BATTEN_INFLECTIONS_AUTO) name = "inflections";
  if (o->sign != 0) name = "sign";
  if (!isnan(o->domain[0]) || !isnan(o->domain[1])) name = "domain";
  for (int e = 0; e < 2; e++) {
    if (o->fix_ends[e]) name = "fix_ends";
    for (int k = 0; k < 2; k++)
      if (!isnan(o->end_points[e][k]) || !isnan(o->end_tangents[e][k])) name = "end_points and end_tangents";
  }
  if (!name) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "opt.fit.%s: given; leave it as in the default, it is found for each slice", name);
}

/* Texts of the fit's options say where they are here. */
static batten_status check_fit(batten_context *ctx, const batten_contour_options *o) {
  char text[400];
  batten_status st = contour_options_check(ctx, o);
  if (st != BATTEN_E_INVALID || strncmp(batten_error(ctx), "opt.", 4) != 0) return st;
  text[0] = 0;
  strncat(text, batten_error(ctx) + 4, sizeof text - 1);
  return batten_fail(ctx, st, "opt.fit.%s", text);
}

static batten_status check_options(batten_context *ctx, const batten_loft_match_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_loft_match_options", o->struct_size, sizeof *o);
  if (st >= 0)
    st = batten_check_struct(ctx, "batten_contour_options", o->fit.struct_size, sizeof(batten_contour_options));
  if (st >= 0) st = check_given(ctx, &o->fit);
  return st < 0 ? st : check_fit(ctx, &o->fit);
}

static batten_status check_slices(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                                  const batten_contour_options *fit) {
  static const double LARGE = 0x1p500; /* squares are numbers */
  if (count < 2) return batten_fail(ctx, BATTEN_E_INVALID, "slice_count: %zu; a loft needs 2 at least", count);
  if (!starts || !points)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %s", starts ? "points" : "starts",
                       starts ? "[starts[slice_count]][2] numbers" : "[slice_count + 1] numbers");
  if (starts[0] != 0) return batten_fail(ctx, BATTEN_E_INVALID, "starts[0]: %zu; must be 0", starts[0]);
  for (size_t i = 0; i < count; i++)
    if (starts[i + 1] < starts[i] || starts[i + 1] - starts[i] < 3)
      return batten_fail(ctx, BATTEN_E_INVALID, "starts[%zu]: slice %zu has %s points; give it 3 at least", i + 1, i,
                         starts[i + 1] < starts[i] ? "fewer than 0" : "fewer than 3");
  size_t numbers;
  if (!batten_mul(starts[count], 2, &numbers) || numbers > SIZE_MAX / sizeof *points)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "starts[%zu]: %zu points are more than memory can have", count,
                       starts[count]);
  for (size_t i = 0; i < count; i++)
    for (size_t k = 2 * starts[i]; k < 2 * starts[i + 1]; k++)
      if (!(fabs(points[k]) < LARGE))
        return batten_fail(ctx, BATTEN_E_INVALID, "slice %zu: points[%zu][%zu]: %g; give finite points below 1e150",
                           i, k / 2, k % 2, points[k]);
  for (size_t k = 0; k < starts[count] && fit->weights; k++)
    if (!(fit->weights[k] >= 0 && fit->weights[k] < INFINITY))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.fit.weights[%zu]: %g; must be finite and 0 or more", k,
                         fit->weights[k]);
  return BATTEN_OK;
}

/* ---- fits ---------------------------------------------------------------------------------------- */

/* What comes out of it. */
typedef struct outcome {
  batten_curve **curves;
  batten_loft_match_info info;
  double squares, total;
  double worst_misfit;
  size_t worst_misfit_slice, unproven; /* the first one */
} outcome;

static void note_fit(const match_slice *slice, size_t i, const batten_contour_info *fit, batten_status st,
                     outcome *out) {
  double weight = (double)slice->count;
  out->squares += weight * fit->rms * fit->rms;
  out->total += weight;
  out->info.spans = fit->spans;
  if (fit->max_error > out->info.max_error || i == 0) {
    out->info.max_error = fit->max_error;
    out->info.max_error_slice = i;
  }
  out->info.certified += fit->shape.certified != 0;
  if (!fit->shape.certified && out->unproven == MATCH_NONE) out->unproven = i;
  if (st != BATTEN_W_SHAPE) return;
  out->info.told++;
  if (!(fit->misfit > out->worst_misfit)) return;
  out->worst_misfit = fit->misfit;
  out->worst_misfit_slice = i;
}

/* At least what is asked for. */
static double tension_of(const match_slice *slice, const batten_contour_options *o) {
  double fold = o->degree - o->smoothness, unknowns = fold * (double)(o->break_count + 1);
  if (!o->closed) unknowns += o->smoothness + 1;
  return fmax(o->tension, TENSION * fmin(1, pow(unknowns / (double)slice->count, TENSION_POWER)));
}

static batten_status fit_slice(batten_context *ctx, const match_stack *s, size_t i,
                               const batten_contour_options *base, double *inflections, outcome *out) {
  const match_slice *slice = s->slices + i;
  batten_contour_options o = *base;
  batten_contour_info fit;
  o.parameters = slice->parameters;
  o.weights = slice->weights;
  o.domain[0] = 0;
  o.domain[1] = 1;
  o.tension = tension_of(slice, base);
  o.inflection_count = slice->bend_count;
  o.inflections = inflections;
  match_inflections(s, i, inflections, &o.sign);
  batten_status st = batten_contour_fit(ctx, slice->count, slice->points, &o, out->curves + i, NULL, NULL, &fit);
  if (st < 0) return match_fail_in(ctx, i, st);
  note_fit(slice, i, &fit, st, out);
  return BATTEN_OK;
}

static void free_curves(size_t count, batten_curve **curves) {
  for (size_t i = 0; i < count && curves; i++) {
    batten_curve_free(curves[i]);
    curves[i] = NULL;
  }
}

/* All slices on `breaks`: *met: within the tolerance, or there is none. */
static batten_status fit_each(batten_context *ctx, const match_stack *s, const batten_contour_options *fit,
                              double *inflections, bool *met, outcome *out) {
  batten_status st = BATTEN_OK;
  *out = (outcome){.curves = out->curves, .unproven = MATCH_NONE};
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    st = batten_progress(ctx, "slices", 0.5 + 0.5 * (double)i / (double)s->count);
    if (st >= 0) st = fit_slice(ctx, s, i, fit, inflections, out);
  }
  *met = fit->tolerance <= 0 || out->info.max_error <= fit->tolerance;
  return st;
}

/* A tolerance was met by fits without inequalities and on knots of their own: where it is not met now, knots become
 * denser, as often as helps; the last curves are what there is. */
static batten_status fit_all(batten_context *ctx, const match_stack *s, const batten_contour_options *fit,
                             outcome *out) {
  static const double SHARED = 1.25, DENSER = 1.4; /* knots that are shared lie less well than own ones */
  size_t most = 1;
  bool met = false;
  for (size_t i = 0; i < s->count; i++)
    if (s->slices[i].bend_count > most) most = s->slices[i].bend_count;
  double *inflections = batten_alloc_array(ctx, most, sizeof *inflections), *sum = NULL;
  double crowding = fit->spans > 0 || fit->tolerance > 0 ? 1 : SHARED;
  batten_status st = inflections ? match_density(ctx, s, fit, &sum) : BATTEN_E_NOMEM;
  for (int attempt = 0; attempt < ATTEMPTS && st >= 0 && !met; attempt++, crowding *= DENSER) {
    batten_contour_options o = *fit;
    double *breaks = NULL;
    st = match_breaks(ctx, s, fit, sum, crowding, &o.break_count, &breaks);
    o.breaks = breaks;
    free_curves(s->count, out->curves);
    if (st >= 0) st = fit_each(ctx, s, &o, inflections, &met, out);
    batten_free(ctx, breaks);
  }
  batten_free(ctx, sum);
  batten_free(ctx, inflections);
  return st;
}

/* ---- out ----------------------------------------------------------------------------------------- */

static void describe(const match_stack *s, outcome *out) {
  batten_loft_match_info *info = &out->info;
  info->slices = s->count;
  info->tracks = s->track_count;
  info->rms = sqrt(out->squares / out->total);
  for (size_t i = 0; i < s->count; i++) {
    const match_slice *slice = s->slices + i;
    info->reversed += slice->reversed;
    info->inflections += slice->bend_count;
    for (size_t j = 0; j < slice->bend_count; j++)
      info->inflections_matched += (i == 0 || slice->bends[j].before != MATCH_NONE) &&
                                   (i + 1 == s->count || slice->bends[j].after != MATCH_NONE);
  }
}

/* What the caller is told. */
static batten_status judge(batten_context *ctx, const outcome *out) {
  if (out->unproven != MATCH_NONE)
    return batten_fail(ctx, BATTEN_W_ACCURACY,
                       "slice %zu: its curve is not proven to have the wanted shape (%zu of %zu are); raise "
                       "opt.fit.margin, or ask for fewer spans",
                       out->unproven, out->info.certified, out->info.slices);
  if (out->info.told == 0) return batten_fail(ctx, BATTEN_OK, "%s", "");
  return batten_fail(ctx, BATTEN_W_SHAPE,
                     "slice %zu: the curve is %.1f times as far from its points as their noise explains (%zu slices "
                     "are of another shape); lower opt.fit.significance, or accept the curves",
                     out->worst_misfit_slice, out->worst_misfit, out->info.told);
}

batten_status batten_loft_match(batten_context *ctx, size_t slice_count, const size_t *starts, const double *points,
                                const batten_loft_match_options *opt, batten_curve **curves,
                                batten_loft_match_info *info) {
  batten_loft_match_options defaults = batten_loft_match_options_default();
  if (!opt) opt = &defaults;
  double begin = batten_now();
  match_stack s = {0};
  outcome out = {.unproven = MATCH_NONE};
  batten_status st = check_options(ctx, opt);
  if (st >= 0) st = check_slices(ctx, slice_count, starts, points, &opt->fit);
  if (st >= 0 && !curves)
    st = batten_fail(ctx, BATTEN_E_INVALID, "curves: NULL; give room for %zu curves", slice_count);
  if (st < 0) return st;
  out.curves = batten_alloc_array(ctx, slice_count, sizeof *out.curves);
  if (!out.curves) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < slice_count; i++) out.curves[i] = NULL;
  st = match_align(ctx, slice_count, starts, points, opt, &s);
  if (st >= 0) st = match_tracks(ctx, opt, &s);
  if (st >= 0) st = match_positions(ctx, &s);
  if (st >= 0) st = match_parameters(ctx, &s);
  if (st >= 0) st = fit_all(ctx, &s, &opt->fit, &out);
  if (st < 0) goto done;
  describe(&s, &out);
  out.info.points = starts[slice_count];
  out.info.time_s = batten_now() - begin;
  st = judge(ctx, &out);
  if (info) *info = out.info;
  memcpy(curves, out.curves, slice_count * sizeof *curves);
  for (size_t i = 0; i < slice_count; i++) out.curves[i] = NULL;
done:
  free_curves(slice_count, out.curves);
  batten_free(ctx, out.curves);
  match_stack_free(ctx, &s);
  return st;
}
