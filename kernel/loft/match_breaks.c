/* One set of knots for all slices.
 *
 * Each slice is asked for the knots that it would have of its own (kernel/contour/knots.c). How densely these lie is
 * averaged over slices with a high power, which comes near to the largest that any slice asks for without counting
 * single ones fully; knots divide the integral of that evenly between the lines of inflections, which are knots. */
#include "base/checked.h"
#include "contour/contour_inner.h"
#include "match.h"

enum { CELLS = 1024 };
static const double POWER = 8;

/* Pieces per unit of t that a slice asks for, by cells. */
static void add_density(size_t pieces, const double *breaks, double part, double *sum) {
  size_t piece = 0;
  for (size_t c = 0; c < CELLS; c++) {
    double from = (double)c / CELLS, to = (double)(c + 1) / CELLS, count = 0;
    while (piece + 1 < pieces && breaks[piece + 1] <= from) piece++;
    for (size_t k = piece; k < pieces && breaks[k] < to; k++)
      count += (fmin(to, breaks[k + 1]) - fmax(from, breaks[k])) / (breaks[k + 1] - breaks[k]);
    sum[c] += part * pow(count * CELLS, POWER);
  }
}

static batten_status ask_slice(batten_context *ctx, const match_stack *s, size_t i, const batten_contour_options *fit,
                               double *inflections, double *sum) {
  const match_slice *slice = s->slices + i;
  batten_contour_options o = *fit;
  contour_input in = {0};
  double *breaks = NULL;
  size_t pieces;
  int sign;
  o.parameters = slice->parameters;
  o.weights = slice->weights;
  o.domain[0] = 0;
  o.domain[1] = 1;
  match_inflections(s, i, inflections, &sign);
  batten_status st = contour_input_make(ctx, slice->count, slice->points, &o, &in);
  if (st < 0) return match_fail_in(ctx, i, st);
  const contour_data data = {in.count, in.points, in.weights};
  const contour_knots_options k = {o.degree,          o.smoothness, s->closed, o.spans, o.tolerance * in.unit,
                                   slice->bend_count, inflections};
  st = contour_knots_place(ctx, &data, in.parameters, &k, &pieces, &breaks);
  if (st >= 0) add_density(pieces, breaks, 1 / (double)s->count, sum);
  batten_free(ctx, breaks);
  contour_input_free(ctx, &in);
  return st < 0 ? match_fail_in(ctx, i, st) : st;
}

/* ---- spans between lines -------------------------------------------------------------------------- */

/* sum [CELLS + 1] of the density from 0 on. */
static double sum_at(const double *sum, double t) {
  size_t c = (size_t)(t * CELLS);
  if (c >= CELLS) return sum[CELLS];
  double part = t * CELLS - (double)c;
  return (1 - part) * sum[c] + part * sum[c + 1];
}

static double place_of(const double *sum, double value, size_t *cell) {
  while (*cell + 1 < CELLS && sum[*cell + 1] < value) ++*cell;
  double part = (value - sum[*cell]) / (sum[*cell + 1] - sum[*cell]);
  return ((double)*cell + fmin(1, fmax(0, part))) / CELLS;
}

/* x'' = 0 at both ends of a piece would make it straight: runs between inflections of one slice get two. */
static void ask_between(const match_stack *s, unsigned smoothness, size_t *counts) {
  for (size_t i = 0; i < s->count && smoothness == 2; i++)
    for (size_t j = 0; j < s->slices[i].bend_count; j++) {
      const match_slice *slice = s->slices + i;
      size_t a = s->line[slice->bends[j].track], b = s->line[slice->bends[(j + 1) % slice->bend_count].track];
      if (b == a + 1 && counts[b] < 2) counts[b] = 2;
    }
}

/* Spans of each run, between line k - 1 and line k: their sum. */
static size_t count_spans(const match_stack *s, const batten_contour_options *fit, const double *sum,
                          size_t *counts) {
  size_t total = 0, least = s->closed ? 3 : 1;
  for (size_t k = 0; k <= s->line_count; k++) {
    double from = k > 0 ? s->t[k - 1] : 0, to = k < s->line_count ? s->t[k] : 1;
    double spans = nearbyint(sum_at(sum, to) - sum_at(sum, from));
    counts[k] = spans > 1 ? (size_t)spans : 1;
  }
  ask_between(s, fit->smoothness, counts);
  for (size_t k = 0; k <= s->line_count; k++) total += counts[k];
  if (total < least) {
    counts[0] += least - total;
    total = least;
  }
  return total;
}

static void fill_breaks(const match_stack *s, const double *sum, const size_t *counts, double *breaks) {
  size_t at = 0, cell = 0;
  for (size_t k = 0; k <= s->line_count; k++) {
    double from = k > 0 ? s->t[k - 1] : 0, to = k < s->line_count ? s->t[k] : 1;
    double low = sum_at(sum, from), high = sum_at(sum, to);
    for (size_t j = 1; j < counts[k]; j++) {
      double part = (double)j / (double)counts[k];
      breaks[at++] = place_of(sum, (1 - part) * low + part * high, &cell);
    }
    if (k < s->line_count) breaks[at++] = to;
  }
}

/* From powers by cells to sums, [CELLS + 1]. */
static void add_up(const batten_contour_options *fit, double *sum) {
  double total = 0;
  for (size_t c = 0; c < CELLS; c++) {
    double density = pow(sum[c], 1 / POWER) / CELLS;
    sum[c] = total;
    total += density;
  }
  sum[CELLS] = total;
  for (size_t c = 0; c <= CELLS && fit->spans > 0; c++) sum[c] *= (double)fit->spans / total;
}

batten_status match_density(batten_context *ctx, const match_stack *s, const batten_contour_options *fit,
                            double **sum) {
  size_t most = 1;
  for (size_t i = 0; i < s->count; i++)
    if (s->slices[i].bend_count > most) most = s->slices[i].bend_count;
  double *result = batten_alloc_array(ctx, CELLS + 1, sizeof *result);
  double *inflections = batten_alloc_array(ctx, most, sizeof *inflections);
  batten_status st = result && inflections ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t c = 0; c <= CELLS && st >= 0; c++) result[c] = 0;
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    st = batten_progress(ctx, "slices", 0.3 + 0.2 * (double)i / (double)s->count);
    if (st >= 0) st = ask_slice(ctx, s, i, fit, inflections, result);
  }
  if (st >= 0) {
    add_up(fit, result);
    *sum = result;
    result = NULL;
  }
  batten_free(ctx, inflections);
  batten_free(ctx, result);
  return st;
}

batten_status match_breaks(batten_context *ctx, const match_stack *s, const batten_contour_options *fit,
                           const double *density, double crowding, size_t *count, double **breaks) {
  double *sum = batten_alloc_array(ctx, CELLS + 1, sizeof *sum);
  size_t *counts = batten_alloc_array(ctx, s->line_count + 1, sizeof *counts);
  batten_status st = sum && counts ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  for (size_t c = 0; c <= CELLS; c++) sum[c] = crowding * density[c];
  size_t spans = count_spans(s, fit, sum, counts);
  double *result = batten_alloc_array(ctx, spans, sizeof *result);
  st = result ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  fill_breaks(s, sum, counts, result);
  *count = spans - 1;
  *breaks = result;
done:
  batten_free(ctx, counts);
  batten_free(ctx, sum);
  return st;
}
