/* Where the pieces of a fit begin, and which way each is to bend: breaks and inflections that are given or found,
 * joined.
 *
 * Knots of the result are numbers of the caller's domain. Each break is rounded there first, and brought to [0, 1]
 * from there, so that lengths of pieces, with which x'' = 0 is stated, are those of the result's knots. */
#include "layout.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"

static double to_unit(const contour_input *in, double t) {
  return (t - in->domain[0]) / (in->domain[1] - in->domain[0]);
}

static double from_unit(const contour_input *in, double t) {
  if (t == 1) return in->domain[1];
  return in->domain[0] + t * (in->domain[1] - in->domain[0]);
}

/* Below this, two numbers of the domain are the same to rounding. */
static double rounding_of(const contour_input *in) {
  return 64 * DBL_EPSILON * fmax(fabs(in->domain[0]), fabs(in->domain[1]));
}

/* ---- inflections -------------------------------------------------------------------------------- */

static batten_status find_inflections(batten_context *ctx, const contour_data *data, const contour_input *in,
                                      const batten_contour_options *opt, contour_layout *out) {
  double *found = NULL;
  batten_status st = contour_inflections_find(ctx, data, in->parameters, opt->closed != 0, opt->significance,
                                              &out->inflection_count, &found, &out->sign);
  if (st < 0) return st;
  out->inflections = batten_alloc_array(ctx, out->inflection_count, sizeof *out->inflections);
  for (size_t i = 0; i < out->inflection_count && out->inflections; i++)
    out->inflections[i] = from_unit(in, found[i]);
  batten_free(ctx, found);
  if (!out->inflections) return BATTEN_E_NOMEM;
  if (opt->sign) out->sign = opt->sign;
  return BATTEN_OK;
}

static batten_status take_inflections(batten_context *ctx, const contour_data *data, const contour_input *in,
                                      const batten_contour_options *opt, contour_layout *out) {
  size_t count = opt->inflection_count;
  double *units = NULL;
  batten_status st = BATTEN_E_NOMEM;
  out->inflections = batten_alloc_array(ctx, count, sizeof *out->inflections);
  if (!out->inflections || !(units = batten_alloc_array(ctx, count, sizeof *units))) goto done;
  out->inflection_count = count;
  out->sign = opt->sign;
  for (size_t i = 0; i < count; i++) {
    out->inflections[i] = opt->inflections[i];
    units[i] = to_unit(in, opt->inflections[i]);
  }
  st = opt->sign ? BATTEN_OK
                 : contour_sign_guess(ctx, data, in->parameters, opt->closed != 0, count, units, &out->sign);
done:
  batten_free(ctx, units);
  return st;
}

/* ---- breaks ------------------------------------------------------------------------------------- */

static bool is_inflection(const contour_layout *l, double mark) {
  size_t low = 0, high = l->inflection_count; /* inflections before low are below the mark */
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (l->inflections[middle] < mark)
      low = middle + 1;
    else
      high = middle;
  }
  return low < l->inflection_count && l->inflections[low] == mark;
}

/* Given breaks and inflections in order; breaks that are an inflection to rounding are left out. */
static batten_status merge_breaks(batten_context *ctx, const contour_input *in, const batten_contour_options *opt,
                                  contour_layout *out) {
  size_t room, at = 0, b = 0, i = 0;
  double near = rounding_of(in);
  batten_add(opt->break_count, out->inflection_count, &room);
  batten_mul(room, 2, &room); /* pieces between inflections may be halved */
  batten_add(room, 2, &room);
  double *m = out->marks = batten_alloc_array(ctx, room, sizeof *m);
  if (!m) return BATTEN_E_NOMEM;
  m[at++] = in->domain[0];
  while (b < opt->break_count || i < out->inflection_count) {
    double next_break = b < opt->break_count ? opt->breaks[b] : INFINITY;
    double next = i < out->inflection_count ? out->inflections[i] : INFINITY;
    if (fabs(next_break - next) <= near) {
      b++;
    } else if (next_break < next) {
      m[at++] = next_break;
      b++;
    } else {
      if (next > in->domain[0]) m[at++] = next; /* closed: the start may be one */
      i++;
    }
  }
  m[at] = in->domain[1];
  out->pieces = at;
  return BATTEN_OK;
}

/* x'' = 0 at both ends of a piece, and its reference of degree 3 would be straight: the piece is halved where the
 * degree allows to go on. */
static batten_status halve_between(batten_context *ctx, const batten_contour_options *opt, contour_layout *out) {
  double *m = out->marks;
  for (size_t i = out->pieces; i-- > 0 && opt->smoothness == 2;) {
    bool first = is_inflection(out, m[i]), last = is_inflection(out, m[i + 1]);
    if (opt->closed && i + 1 == out->pieces) last = is_inflection(out, m[0]);
    if (!first || !last) continue;
    if (opt->degree == 3)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.inflections: no knot between %g and %g, where degree 3 would be straight; give a break "
                         "there, or a higher degree",
                         m[i], m[i + 1]);
    memmove(m + i + 2, m + i + 1, (out->pieces - i) * sizeof *m);
    m[i + 1] = m[i] + (m[i + 2] - m[i]) / 2;
    out->pieces++;
  }
  return BATTEN_OK;
}

static batten_status place_breaks(batten_context *ctx, const contour_data *data, const contour_input *in,
                                  const batten_contour_options *opt, contour_layout *out) {
  contour_knots_options o = {.degree = opt->degree,
                             .smoothness = opt->smoothness,
                             .closed = opt->closed != 0,
                             .spans = opt->spans,
                             .tolerance = opt->tolerance * in->unit,
                             .inflection_count = out->inflection_count};
  double *units = batten_alloc_array(ctx, out->inflection_count, sizeof *units), *breaks = NULL;
  if (!units) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < out->inflection_count; i++) units[i] = to_unit(in, out->inflections[i]);
  o.inflections = units;
  batten_status st = contour_knots_place(ctx, data, in->parameters, &o, &out->pieces, &breaks);
  if (st < 0) goto done;
  out->marks = batten_alloc_array(ctx, out->pieces + 1, sizeof *out->marks);
  st = out->marks ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0, k = 0; i <= out->pieces && st >= 0; i++) {
    while (k < out->inflection_count && units[k] < breaks[i]) k++;
    bool same = i < out->pieces && k < out->inflection_count && units[k] == breaks[i];
    out->marks[i] = same ? out->inflections[k] : from_unit(in, breaks[i]);
  }
done:
  batten_free(ctx, breaks);
  batten_free(ctx, units);
  return st;
}

/* Breaks of [0, 1], and the signs of pieces. */
static batten_status finish(batten_context *ctx, const contour_input *in, const batten_contour_options *opt,
                            contour_layout *out) {
  if (opt->closed && out->pieces < 3) /* the reference, of degree smoothness + 1, has a free point for each */
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: a closed curve of %zu span%s; it takes 3 at least",
                       opt->breaks ? "breaks" : "spans", out->pieces, out->pieces == 1 ? "" : "s");
  out->breaks = batten_alloc_array(ctx, out->pieces + 1, sizeof *out->breaks);
  out->signs = batten_alloc_array(ctx, out->pieces, sizeof *out->signs);
  if (!out->breaks || !out->signs) return BATTEN_E_NOMEM;
  for (size_t i = 0; i <= out->pieces; i++) out->breaks[i] = i == out->pieces ? 1 : to_unit(in, out->marks[i]);
  for (size_t i = 0; i < out->pieces; i++)
    if (!(out->breaks[i] < out->breaks[i + 1]) || !(out->marks[i] < out->marks[i + 1]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.domain: %g to %g is too narrow so far from 0: knots at %.17g fall together; move it",
                         in->domain[0], in->domain[1], out->marks[i]);
  int sign = out->sign;
  for (size_t i = 0, k = 0; i < out->pieces; i++) {
    if (k < out->inflection_count && out->inflections[k] <= out->marks[i]) {
      if (i > 0) sign = -sign; /* at the start the sign is already that after it */
      k++;
    }
    out->signs[i] = (signed char)sign;
  }
  out->shape = (contour_shape){opt->degree, opt->smoothness, opt->closed != 0, out->pieces, out->breaks, out->signs};
  return BATTEN_OK;
}

batten_status contour_layout_make(batten_context *ctx, const contour_data *data, const contour_input *in,
                                  const batten_contour_options *opt, contour_layout *out) {
  contour_layout l = {0};
  double start = batten_now();
  batten_status st = batten_progress(ctx, "inflections", 0);
  if (st >= 0)
    st = opt->inflection_count == BATTEN_INFLECTIONS_AUTO ? find_inflections(ctx, data, in, opt, &l)
                                                          : take_inflections(ctx, data, in, opt, &l);
  l.time_inflections_s = batten_now() - start;
  start = batten_now();
  if (st >= 0) st = batten_progress(ctx, "knots", 0);
  if (st >= 0) st = opt->breaks ? merge_breaks(ctx, in, opt, &l) : place_breaks(ctx, data, in, opt, &l);
  if (st >= 0 && opt->breaks) st = halve_between(ctx, opt, &l);
  if (st >= 0) st = finish(ctx, in, opt, &l);
  l.time_knots_s = batten_now() - start;
  if (st < 0)
    contour_layout_free(ctx, &l);
  else
    *out = l;
  return st;
}

void contour_layout_free(batten_context *ctx, contour_layout *l) {
  batten_free(ctx, l->signs);
  batten_free(ctx, l->breaks);
  batten_free(ctx, l->marks);
  batten_free(ctx, l->inflections);
  *l = (contour_layout){0};
}
