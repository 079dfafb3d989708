/* Where breaks go, and how many.
 *
 * Inflections cut the domain into runs, whose ends are breaks. Each run gets its part of the spans by the density of
 * density.c, and no fewer than the reference curve can be built on: it is a spline of degree l + 1, whose control
 * polygon turns by less than a right angle (l = 2) or a half turn (l = 1) at a vertex; x'' = 0 at both ends of a run
 * takes a break between (l = 2). In a run breaks have equal parts of the density between them. So no break comes near
 * an inflection by chance.
 *
 * Numbers of spans are tried by fits without inequalities:
 * - for a tolerance the smallest that brings all points within it, by doubling and bisection, with two rounds of
 *   parameter correction;
 * - else that of the least criterion of Schwarz [1978: Estimating the dimension of a model],
 *     n log(mean square) + unknowns log(n)   of the parts of n distances that are normal to the curve,
 *   with as many unknowns as there are control points, since these have a normal part, too. Tangential parts tell of
 *   parameters, not of the curve; and without correction no curve can gather points of noise by turning to and fro.
 *   Numbers grow by 1.3, and stop when neighbouring distances differ as those of noise do and three numbers in a row
 *   were no better. Structure below 3e-5 of the data's size counts as none: without it exact data would have no
 * least.
 */
#include <string.h>

#include "base/checked.h"
#include "density.h"

enum { CORRECTION_PASSES = 3, WORSE_MOST = 3 };
static const double PI = 3.14159265358979323846;
static const double LEAST_STEP = 1e-3; /* between breaks, parts of what equal steps in the run were */

typedef struct search {
  batten_context *ctx;
  const contour_data *data;
  const double *parameters;
  const contour_knots_options *opt;
  contour_density density;
  size_t runs;
  double *edges;          /* [runs + 1] 0, inflections, 1 */
  size_t *least, *counts; /* [runs] spans */
  double *parts;          /* [runs] of the density */
  size_t least_spans, most_spans;
  double *moved, *squares; /* [count] parameters that are corrected, and what they give */
} search;

/* What a number of spans leaves, and takes: unknowns for the normals' part of the curve. */
typedef struct trial {
  contour_left left;
  size_t unknowns;
} trial;

/* ---- runs ---------------------------------------------------------------------------------------- */

/* Spans that the reference needs in a run: turns of a third of the largest that a vertex (l = 1: half of it) may
 * have.
 */
static size_t least_of_run(const search *s, size_t run, bool start_is_inflection) {
  const contour_knots_options *o = s->opt;
  bool begins = run > 0 || start_is_inflection, ends = run + 1 < s->runs || start_is_inflection;
  bool two = o->smoothness == 2 && begins && ends;
  double turn = 0;
  if (s->density.pilot.spans) turn = fabs(contour_pilot_turn(&s->density.pilot, s->edges[run], s->edges[run + 1]));
  if (o->closed && s->runs == 1 && !start_is_inflection) turn = fmax(turn, 2 * PI);
  double spans = ceil(turn / (o->smoothness == 2 ? PI / 3 : PI / 2) - 0.1) + two;
  return (size_t)fmax(spans, two ? 2 : 1);
}

static batten_status find_runs(search *s) {
  const contour_knots_options *o = s->opt;
  s->edges = batten_alloc_array(s->ctx, o->inflection_count + 2, sizeof *s->edges);
  s->least = batten_alloc_array(s->ctx, o->inflection_count + 1, sizeof *s->least);
  s->counts = batten_alloc_array(s->ctx, o->inflection_count + 1, sizeof *s->counts);
  s->parts = batten_alloc_array(s->ctx, o->inflection_count + 1, sizeof *s->parts);
  if (!s->edges || !s->least || !s->counts || !s->parts) return BATTEN_E_NOMEM;
  bool start_is_inflection = false;
  s->edges[0] = 0;
  for (size_t i = 0; i < o->inflection_count; i++) {
    double t = o->inflections[i];
    if (t > s->edges[s->runs] && t < 1)
      s->edges[++s->runs] = t;
    else if (o->closed)
      start_is_inflection = true;
  }
  s->edges[++s->runs] = 1;
  for (size_t i = 0; i < s->runs; i++) {
    s->least[i] = least_of_run(s, i, start_is_inflection);
    s->least_spans += s->least[i];
  }
  for (size_t fold = o->degree - o->smoothness; o->closed && s->least_spans * fold < 3; s->least_spans++)
    s->least[0]++; /* fewer control points make no closed curve */
  return BATTEN_OK;
}

/* Spans of each run: as the density has it, rounded so that parts of the density per span are alike. Their number is
 * `spans`, unless the runs need more. */
static size_t share_spans(search *s, size_t spans) {
  double from = 0;
  size_t total = 0;
  for (size_t i = 0; i < s->runs; i++) {
    double to = i + 1 < s->runs ? contour_density_sum(&s->density, s->edges[i + 1]) : 1;
    s->parts[i] = to - from;
    size_t whole = (size_t)(s->parts[i] * (double)spans);
    s->counts[i] = whole > s->least[i] ? whole : s->least[i];
    total += s->counts[i];
    from = to;
  }
  while (total < spans) {
    size_t most = 0;
    for (size_t i = 1; i < s->runs; i++)
      if (s->parts[i] / (double)s->counts[i] > s->parts[most] / (double)s->counts[most]) most = i;
    s->counts[most]++;
    total++;
  }
  while (total > spans && total > s->least_spans) {
    size_t from_run = s->runs;
    double least = INFINITY;
    for (size_t i = 0; i < s->runs; i++) {
      double after = s->counts[i] > s->least[i] ? s->parts[i] / (double)(s->counts[i] - 1) : INFINITY;
      if (after < least) {
        least = after;
        from_run = i;
      }
    }
    if (from_run == s->runs) break;
    s->counts[from_run]--;
    total--;
  }
  return total;
}

/* Inner breaks of a run, in equal parts of the density; never too near to each other for numbers. */
static void fill_run(const search *s, size_t run, double from, double to, double *breaks, size_t *cell) {
  size_t n = s->counts[run];
  double step = LEAST_STEP * (s->edges[run + 1] - s->edges[run]) / (double)n;
  breaks[0] = s->edges[run];
  for (size_t j = 1; j < n; j++) {
    double part = (double)j / (double)n;
    double t = contour_density_place(&s->density, (1 - part) * from + part * to, cell);
    breaks[j] = fmax(t, breaks[j - 1] + step);
  }
  double next = s->edges[run + 1];
  for (size_t j = n; j-- > 1 && breaks[j] > next - step;) next = breaks[j] = next - step;
}

static batten_status place(search *s, size_t spans, size_t *pieces, double **breaks) {
  size_t fold = s->opt->degree - s->opt->smoothness, at = 0, cell = 0;
  double most = (double)s->density.places / (2 * (double)spans * (double)fold), from = 0;
  contour_density_blend(&s->density, fmax(most, 1));
  *pieces = share_spans(s, spans);
  *breaks = batten_alloc_array(s->ctx, *pieces + 1, sizeof **breaks);
  if (!*breaks) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < s->runs; i++) {
    double to = from + s->parts[i];
    fill_run(s, i, from, i + 1 < s->runs ? to : 1, *breaks + at, &cell);
    at += s->counts[i];
    from = to;
  }
  (*breaks)[at] = 1;
  return BATTEN_OK;
}

/* ---- how many ------------------------------------------------------------------------------------ */

/* Fits spans that are placed, and looks at what is left; rounds > 1: with parameter correction after each of them.
 * Spans that leave unknowns undetermined leave everything. */
static batten_status try_spans(search *s, size_t spans, int rounds, trial *out) {
  const contour_knots_options *o = s->opt;
  contour_least f = {0};
  double *breaks = NULL;
  size_t pieces;
  *out = (trial){.left = {INFINITY, INFINITY, 0}};
  batten_status st = place(s, spans, &pieces, &breaks);
  memcpy(s->moved, s->parameters, s->data->count * sizeof *s->moved);
  for (int round = 0; round < rounds && st >= 0; round++) {
    contour_least_free(s->ctx, &f);
    st = contour_least_fit(s->ctx, s->data, s->moved, o->degree, o->smoothness, o->closed, pieces, breaks, &f);
    if (st >= 0 && rounds > 1)
      contour_correct(s->ctx, &f.space.b, o->closed, f.control, s->data, CORRECTION_PASSES, s->moved, s->squares);
  }
  if (st >= 0) {
    contour_left_of(&f.space.b, f.control, s->data, s->moved, &out->left);
    out->unknowns = f.space.unknowns / 2;
  }
  contour_least_free(s->ctx, &f);
  batten_free(s->ctx, breaks);
  return batten_expect(s->ctx, st, BATTEN_E_SINGULAR);
}

/* Spans for a tolerance; those that come nearest to it where it cannot be met. */
static batten_status search_tolerance(search *s, size_t *spans) {
  size_t low = s->least_spans - 1, high = s->least_spans, tried = 0; /* low: not enough */
  bool met = false;
  double best = INFINITY;
  trial t;
  *spans = high;
  while (!met) {
    batten_status st = batten_progress(s->ctx, "knots", fmin(0.5, 0.02 * (double)++tried));
    if (st >= 0) st = try_spans(s, high, 2, &t);
    if (st < 0) return st;
    met = t.left.most <= s->opt->tolerance;
    if (met || t.left.most < best) {
      best = t.left.most;
      *spans = high;
    }
    if (met || high >= s->most_spans) break;
    low = high;
    high = high < s->most_spans / 2 ? 2 * high : s->most_spans;
  }
  while (met && high - low > 1) {
    size_t middle = low + (high - low) / 2;
    batten_status st = batten_progress(s->ctx, "knots", fmin(1, 0.02 * (double)++tried));
    if (st >= 0) st = try_spans(s, middle, 2, &t);
    if (st < 0) return st;
    if (t.left.most <= s->opt->tolerance)
      *spans = high = middle;
    else
      low = middle;
  }
  return BATTEN_OK;
}

/* Spans that the data speak for. */
static batten_status search_structure(search *s, size_t *spans) {
  size_t fold = s->opt->degree - s->opt->smoothness, n = s->density.places, worse = 0, tried = 0;
  size_t first = s->density.pilot.spans / (8 * fold);
  double best = INFINITY, floor = s->density.floor;
  trial t;
  *spans = s->least_spans;
  if (first < s->least_spans) first = s->least_spans;
  for (size_t k = first; k <= s->most_spans; k = k + 1 + 3 * k / 10) {
    batten_status st = batten_progress(s->ctx, "knots", fmin(1, 0.02 * (double)++tried));
    if (st >= 0) st = try_spans(s, k, 1, &t);
    if (st < 0) return st;
    if (isinf(t.left.rms)) break;
    double value = contour_schwarz(n, t.left.rms, floor, t.unknowns);
    worse = value < best ? 0 : worse + 1;
    if (value < best) {
      best = value;
      *spans = k;
    }
    bool noise = t.left.rms <= (1 + 2 / sqrt((double)n)) * t.left.noise + floor;
    if (worse >= WORSE_MOST && noise) break;
  }
  return BATTEN_OK;
}

/* ---- the breaks ---------------------------------------------------------------------------------- */

static batten_status search_start(search *s) {
  const contour_knots_options *o = s->opt;
  size_t fold = o->degree - o->smoothness;
  batten_status st = contour_density_make(s->ctx, s->data, s->parameters, o->degree, o->closed, &s->density);
  if (st >= 0) st = find_runs(s);
  if (st < 0 || o->spans) return st;
  size_t places = s->density.places, ends = o->closed ? 0 : o->smoothness + 1;
  if (o->tolerance <= 0) places /= 2;
  s->most_spans = places > ends ? (places - ends) / fold : 0;
  if (s->most_spans < s->least_spans) s->most_spans = s->least_spans;
  s->moved = batten_alloc_array(s->ctx, s->data->count, sizeof *s->moved);
  s->squares = batten_alloc_array(s->ctx, s->data->count, sizeof *s->squares);
  return s->moved && s->squares ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void search_free(search *s) {
  batten_free(s->ctx, s->squares);
  batten_free(s->ctx, s->moved);
  batten_free(s->ctx, s->parts);
  batten_free(s->ctx, s->counts);
  batten_free(s->ctx, s->least);
  batten_free(s->ctx, s->edges);
  contour_density_free(s->ctx, &s->density);
}

batten_status contour_knots_place(batten_context *ctx, const contour_data *data, const double *parameters,
                                  const contour_knots_options *opt, size_t *pieces, double **breaks) {
  search s = {.ctx = ctx, .data = data, .parameters = parameters, .opt = opt};
  size_t spans = opt->spans;
  double *result = NULL;
  if (spans > SIZE_MAX / 4 / sizeof(double))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.spans: %zu; ask for fewer", spans);
  batten_status st = search_start(&s);
  if (st >= 0 && !spans) st = opt->tolerance > 0 ? search_tolerance(&s, &spans) : search_structure(&s, &spans);
  if (st >= 0) st = place(&s, spans, pieces, &result);
  if (st >= 0) *breaks = result;
  search_free(&s);
  return st;
}
