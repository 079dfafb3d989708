/* Inflections that the data speak for: what the fit asks for, and the caller. See smooth.c, bends.c. */
#include "bends.h"

#include <string.h>

#include "base/checked.h"
#include "curve/curve_inner.h"

/* The smoothing spline and its plot. */
static batten_status smooth_and_plot(batten_context *ctx, const contour_data *data, const double *parameters,
                                     bool closed, contour_smooth *smooth, contour_plot *plot) {
  batten_status st = contour_smooth_fit(ctx, data, parameters, closed, smooth);
  if (st < 0) return st;
  st = contour_plot_make(ctx, smooth, plot);
  if (st < 0) contour_smooth_free(ctx, smooth);
  return st;
}

batten_status contour_inflections_find(batten_context *ctx, const contour_data *data, const double *parameters,
                                       bool closed, double significance, size_t *count, double **inflections,
                                       int *sign) {
  contour_smooth smooth = {0};
  contour_plot plot = {0};
  contour_bends bends = {0};
  batten_status st = smooth_and_plot(ctx, data, parameters, closed, &smooth, &plot);
  if (st >= 0) st = contour_bends_find(ctx, &smooth, &plot, data->count, parameters, 1, &significance, &bends);
  if (st >= 0) {
    *count = bends.count;
    *inflections = bends.inflections;
    *sign = bends.sign;
    bends.inflections = NULL;
  }
  contour_bends_free(ctx, &bends);
  contour_plot_free(ctx, &plot);
  contour_smooth_free(ctx, &smooth);
  return st;
}

/* Each sample's curvature in its standard deviations, those of far above one not counted more, by its length. */
static double vote(const contour_plot *plot, size_t i) {
  const double *at = plot->samples + 4 * i;
  double z = at[2] > 0 && at[2] < INFINITY ? at[1] / at[2] : 0;
  return z / (1 + fabs(z)) * (plot->angles[i + 1] - plot->angles[i]) * (at[1] < 0 ? -1 : 1);
}

batten_status contour_sign_guess(batten_context *ctx, const contour_data *data, const double *parameters, bool closed,
                                 size_t count, const double *inflections, int *sign) {
  contour_smooth smooth = {0};
  contour_plot plot = {0};
  batten_status st = smooth_and_plot(ctx, data, parameters, closed, &smooth, &plot);
  if (st < 0) return st;
  double sum = 0;
  int way = 1; /* of the run, where the start has + */
  size_t next = 0;
  while (next < count && inflections[next] <= 0) next++;
  for (size_t i = 0; i + 1 < plot.count; i++) {
    double t = 0.5 * (plot.samples[4 * i] + plot.samples[4 * i + 4]);
    for (; next < count && inflections[next] <= t; next++) way = -way;
    sum += way * vote(&plot, i);
  }
  *sign = sum >= 0 ? 1 : -1;
  contour_plot_free(ctx, &plot);
  contour_smooth_free(ctx, &smooth);
  return BATTEN_OK;
}

/* ---- what the caller sees ----------------------------------------------------------------------- */

void batten_contour_proposal_free(batten_context *ctx, batten_contour_proposal *proposal) {
  if (!proposal) return;
  batten_curve_free(proposal->smoothed);
  batten_free(ctx, proposal->samples);
  batten_free(ctx, proposal->uncertainties);
  batten_free(ctx, proposal->inflections);
  batten_free(ctx, proposal->runs);
  *proposal = (batten_contour_proposal){0};
}

/* The value of the blossom of span `span` of the smoothing spline, its spans of length 1, at 5 arguments. */
static void blossom(const contour_smooth *s, size_t span, const double *arguments, double out[2]) {
  double d[SMOOTH_ORDER][2];
  for (size_t k = 0; k < SMOOTH_ORDER; k++)
    for (size_t c = 0; c < 2; c++) d[k][c] = s->control[c * s->functions + contour_smooth_row(s, span + k)];
  for (size_t r = 1; r <= SMOOTH_DEGREE; r++)
    for (size_t k = SMOOTH_DEGREE; k >= r; k--) {
      double from = (double)(span + k) - SMOOTH_DEGREE, part = (arguments[r - 1] - from) / (double)(SMOOTH_ORDER - r);
      for (size_t c = 0; c < 2; c++) d[k][c] = (1 - part) * d[k - 1][c] + part * d[k][c];
    }
  memcpy(out, d[SMOOTH_DEGREE], 2 * sizeof *out);
}

/* The smoothing spline in the caller's units, with clamped knots. */
static batten_status make_curve(batten_context *ctx, const contour_smooth *s, const contour_input *in,
                                batten_curve **out) {
  const size_t count = s->spans + SMOOTH_DEGREE, knots = count + SMOOTH_ORDER;
  double *knot = batten_alloc_array(ctx, knots, sizeof *knot);
  double *points = knot ? batten_alloc_array(ctx, count, 2 * sizeof *points) : NULL;
  batten_status st = points ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    for (size_t i = 0; i < knots; i++)
      knot[i] = i < SMOOTH_DEGREE ? 0 : i - SMOOTH_DEGREE > s->spans ? (double)s->spans : (double)(i - SMOOTH_DEGREE);
    for (size_t j = 0; j < count; j++) {
      size_t middle = j > 2 ? j - 3 : 0, span = middle < s->spans ? middle : s->spans - 1;
      blossom(s, span, knot + j + 1, points + 2 * j);
      for (size_t c = 0; c < 2; c++) points[2 * j + c] = points[2 * j + c] / in->unit + in->middle[c];
    }
    if (s->closed) memcpy(points + 2 * (count - 1), points, 2 * sizeof *points);
    for (size_t i = 0; i < knots; i++) {
      double part = knot[i] / (double)s->spans;
      knot[i] = part < 1 ? in->domain[0] + part * (in->domain[1] - in->domain[0]) : in->domain[1];
    }
    bspline space = {SMOOTH_DEGREE, count, knot};
    st = curve_make(ctx, &space, points, s->closed, out);
  }
  batten_free(ctx, points);
  batten_free(ctx, knot);
  return st;
}

/* From [0, 1] and scaled points to the caller's units. The proposal takes over the parts. */
static void hand_over(const contour_input *in, contour_bends *bends, contour_plot *plot, double noise,
                      batten_contour_proposal *out) {
  double width = in->domain[1] - in->domain[0];
  for (size_t i = 0; i < bends->run_count; i++) {
    bends->runs[i].from = in->domain[0] + width * bends->runs[i].from;
    bends->runs[i].to = in->domain[0] + width * bends->runs[i].to;
  }
  for (size_t i = 0; i < bends->count; i++) {
    bends->inflections[i] = in->domain[0] + width * bends->inflections[i];
    bends->uncertainties[i] *= width;
  }
  for (size_t i = 0; i < plot->count; i++) {
    double *at = plot->samples + 4 * i;
    at[0] = in->domain[0] + width * at[0];
    at[1] *= in->unit;
    at[2] *= in->unit;
    at[3] /= in->unit;
  }
  out->run_count = bends->run_count;
  out->runs = bends->runs;
  out->inflection_count = bends->count;
  out->inflections = bends->inflections;
  out->uncertainties = bends->uncertainties;
  out->sign = bends->sign;
  out->noise = noise / in->unit;
  out->sample_count = plot->count;
  out->samples = plot->samples;
  *bends = (contour_bends){0};
  plot->samples = NULL;
}

batten_status batten_contour_propose(batten_context *ctx, size_t count, const double *points,
                                     const batten_contour_options *opt, batten_contour_proposal *out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give room for the proposal");
  batten_contour_options o = batten_contour_options_default();
  batten_status st = opt ? contour_options_check(ctx, opt) : BATTEN_OK;
  if (st < 0) return st;
  if (opt) o = *opt; /* not before its size is known */
  contour_input in = {0};
  st = contour_input_make(ctx, count, points, &o, &in);
  if (st < 0) return st;
  const contour_data data = {in.count, in.points, in.weights};
  const bool closed = o.closed != 0;
  contour_smooth smooth = {0};
  contour_plot plot = {0};
  contour_bends bends = {0};
  batten_curve *curve = NULL;
  st = smooth_and_plot(ctx, &data, in.parameters, closed, &smooth, &plot);
  if (st >= 0) st = contour_bends_find(ctx, &smooth, &plot, in.count, in.parameters, 1, &o.significance, &bends);
  if (st >= 0) st = make_curve(ctx, &smooth, &in, &curve);
  if (st >= 0) {
    batten_status go = batten_progress(ctx, "inflections", 1);
    if (go < 0) st = go;
  }
  if (st >= 0) {
    /* weights have the mean 1 in the smoothing: the noise is that of a point of mean weight */
    hand_over(&in, &bends, &plot, smooth.noise, out);
    out->smoothed = curve;
    curve = NULL;
  }
  batten_curve_free(curve);
  contour_bends_free(ctx, &bends);
  contour_plot_free(ctx, &plot);
  contour_smooth_free(ctx, &smooth);
  contour_input_free(ctx, &in);
  return st;
}
