/* Slices that run the same way and begin where their neighbours begin.
 *
 * Slices are compared at equal parts of their lengths. Closed ones: x(s + shift) of one beside y(s) of the one
 * before. integral |x(s + shift) - y(s)|^2 ds  =  constant - 2 integral x(s + shift) . y(s) ds, so that the shift
 * between two neighbours does not depend on where either begins, and the sum over all neighbours is least where each
 * of its terms is. The constant swallows translations, too. */
#include <string.h>

#include "base/checked.h"
#include "match.h"

enum { SAMPLES = 256 };

void match_stack_free(batten_context *ctx, match_stack *s) {
  batten_free(ctx, s->t);
  batten_free(ctx, s->line);
  batten_free(ctx, s->last);
  batten_free(ctx, s->first);
  for (size_t i = 0; i < s->count && s->slices; i++) {
    match_slice *slice = s->slices + i;
    batten_free(ctx, slice->bends);
    batten_free(ctx, slice->parameters);
    batten_free(ctx, slice->lengths);
    batten_free(ctx, slice->weights);
    batten_free(ctx, slice->points);
    batten_free(ctx, slice->from);
  }
  batten_free(ctx, s->slices);
  *s = (match_stack){0};
}

batten_status match_fail_in(batten_context *ctx, size_t i, batten_status st) {
  char text[400];
  if (st != BATTEN_E_INVALID && st != BATTEN_E_INFEASIBLE && st != BATTEN_E_SINGULAR && st != BATTEN_E_TOO_LARGE)
    return st;
  text[0] = 0;
  strncat(text, batten_error(ctx), sizeof text - 1);
  return batten_fail(ctx, st, "slice %zu: %s", i, text);
}

/* Doubles are handed over in the order `from`. */
static void take_points(const match_slice *s, size_t start, const double *points, const double *weights) {
  for (size_t i = 0; i < s->count; i++) {
    memcpy(s->points + 2 * i, points + 2 * (start + s->from[i]), 2 * sizeof *points);
    if (weights) s->weights[i] = weights[start + s->from[i]];
  }
}

static batten_status copy_slice(batten_context *ctx, size_t start, size_t count, const double *points,
                                const batten_contour_options *fit, match_slice *out) {
  const double *p = points + 2 * start, *q = p + 2 * (count - 1);
  bool repeated = fit->closed && p[0] == q[0] && p[1] == q[1];
  size_t n = out->count = count - repeated;
  out->from = batten_alloc_array(ctx, n, sizeof *out->from);
  out->points = batten_alloc_array(ctx, n, 2 * sizeof *out->points);
  out->lengths = batten_alloc_array(ctx, n, sizeof *out->lengths);
  out->parameters = batten_alloc_array(ctx, n, sizeof *out->parameters);
  if (fit->weights) out->weights = batten_alloc_array(ctx, n, sizeof *out->weights);
  if (!out->from || !out->points || !out->lengths || !out->parameters || (fit->weights && !out->weights))
    return BATTEN_E_NOMEM;
  for (size_t i = 0; i < n; i++) out->from[i] = i;
  return BATTEN_OK;
}

/* ---- samples ------------------------------------------------------------------------------------ */

/* The polygon at equal parts of its length, [SAMPLES][2], from its middle. Open: both ends are samples. */
static void sample(match_slice *s, bool closed, double *out) {
  size_t cell = 0, n = s->count;
  double sum[2] = {0, 0}, squares = 0;
  for (size_t k = 0; k < SAMPLES; k++) {
    double at = (double)k / (closed ? SAMPLES : SAMPLES - 1);
    while (cell + 1 < n && s->lengths[cell + 1] <= at) cell++;
    size_t next = cell + 1 < n ? cell + 1 : closed ? 0 : cell;
    double to = cell + 1 < n ? s->lengths[cell + 1] : 1, width = to - s->lengths[cell];
    double part = width > 0 ? (at - s->lengths[cell]) / width : 0;
    for (size_t c = 0; c < 2; c++) {
      out[2 * k + c] = (1 - part) * s->points[2 * cell + c] + part * s->points[2 * next + c];
      sum[c] += out[2 * k + c] / SAMPLES;
    }
  }
  for (size_t k = 0; k < 2 * SAMPLES; k++) {
    out[k] -= sum[k % 2];
    squares += out[k] * out[k] / SAMPLES;
  }
  memcpy(s->middle, sum, sizeof sum);
  s->radius = sqrt(squares);
}

static double area_of(const double *samples) {
  double area = 0;
  for (size_t k = 0; k < SAMPLES; k++) {
    const double *a = samples + 2 * k, *b = samples + 2 * ((k + 1) % SAMPLES);
    area += a[0] * b[1] - a[1] * b[0];
  }
  return area / 2;
}

/* ---- direction ---------------------------------------------------------------------------------- */

static void reverse_samples(bool closed, double *samples) {
  size_t from = closed; /* sample 0 stays where the way begins */
  for (size_t a = from, b = SAMPLES - 1; a < b; a++, b--)
    for (size_t c = 0; c < 2; c++) {
      double x = samples[2 * a + c];
      samples[2 * a + c] = samples[2 * b + c];
      samples[2 * b + c] = x;
    }
}

/* Closed: the first point stays the first. */
static void reverse_slice(match_slice *s, bool closed) {
  s->reversed = !s->reversed;
  for (size_t a = closed, b = s->count - 1; a < b; a++, b--) {
    size_t x = s->from[a];
    s->from[a] = s->from[b];
    s->from[b] = x;
  }
}

/* Whether an open slice, run through backwards, is nearer to the one before. */
static bool runs_against(const double *before, const double *own) {
  double forward = 0, backward = 0;
  for (size_t k = 0; k < SAMPLES; k++)
    for (size_t c = 0; c < 2; c++) {
      double x = before[2 * k + c], there = own[2 * (SAMPLES - 1 - k) + c];
      forward += (x - own[2 * k + c]) * (x - own[2 * k + c]);
      backward += (x - there) * (x - there);
    }
  return backward < forward;
}

/* ---- start -------------------------------------------------------------------------------------- */

static double agreement(const double *before, const double *own, size_t shift) {
  double sum = 0;
  for (size_t k = 0; k < SAMPLES; k++) {
    const double *x = before + 2 * k, *y = own + 2 * ((k + shift) % SAMPLES);
    sum += x[0] * y[0] + x[1] * y[1];
  }
  return sum;
}

/* The most agreement, and the sample of that; of equal ones that of least way. */
static double most_agreement(const double *before, const double *own, size_t *best) {
  double most = -INFINITY;
  for (size_t k = 0; k < SAMPLES; k++) {
    size_t shift = k % 2 ? SAMPLES - 1 - k / 2 : k / 2; /* 0, -1, 1, -2, ... */
    double value = agreement(before, own, shift);
    if (value <= most) continue;
    most = value;
    *best = shift;
  }
  return most;
}

/* The shift of best agreement, between samples by the parabola through the best one and its neighbours. */
static double best_shift(const double *before, const double *own) {
  size_t best = 0;
  double most = most_agreement(before, own, &best);
  double left = agreement(before, own, (best + SAMPLES - 1) % SAMPLES),
         right = agreement(before, own, (best + 1) % SAMPLES), bend = left - 2 * most + right;
  double step = bend < 0 ? 0.5 * (left - right) / bend : 0;
  return ((double)best + fmax(-0.5, fmin(0.5, step))) / SAMPLES;
}

/* Numbers and lengths go round: the slice begins at part `start` of its length. */
static void rotate_slice(match_slice *s, double start, size_t *room) {
  size_t first = 0, n = s->count;
  while (first < n && s->lengths[first] < start) first++;
  for (size_t i = 0; i < n; i++) {
    size_t k = (first + i) % n;
    room[i] = s->from[k];
    s->parameters[i] = fmax(0, s->lengths[k] - start + (k < first));
  }
  memcpy(s->from, room, n * sizeof *room);
  for (size_t i = 0; i < n; i++) s->lengths[i] = fmin(1, s->parameters[i]);
}

/* Whether a closed slice runs against the one before. That is what areas tell, but lines that cross themselves may
 * have hardly any: then it is the direction that agrees, where one does clearly. */
static bool turns_against(const double *before, double area_before, double *own, double area) {
  static const double FULL = 0.1, CLEAR = 0.1;
  size_t shift;
  bool full = fmin(fabs(area), fabs(area_before)) > FULL; /* of a circle: pi */
  double forward = full ? 0 : most_agreement(before, own, &shift);
  reverse_samples(true, own);
  double backward = full ? 0 : most_agreement(before, own, &shift);
  reverse_samples(true, own);
  if (fabs(forward - backward) > CLEAR * fmax(forward, backward)) return backward > forward;
  return area * area_before < 0;
}

/* ---- all slices --------------------------------------------------------------------------------- */

static batten_status measure(batten_context *ctx, size_t i, bool closed, match_slice *s) {
  batten_status st = batten_contour_parametrize(ctx, s->count, s->points, BATTEN_CONTOUR_CHORD, closed, s->lengths);
  return match_fail_in(ctx, i, st);
}

batten_status match_align(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                          const batten_loft_match_options *opt, match_stack *out) {
  match_stack s = {.closed = opt->fit.closed != 0, .count = count};
  const double *weights = opt->fit.weights;
  size_t most = 0, *room = NULL;
  double start = 0, area_before = 0;
  double *samples = batten_alloc_array(ctx, 2 * SAMPLES, sizeof *samples);
  double *before = batten_alloc_array(ctx, 2 * SAMPLES, sizeof *before);
  batten_status st = BATTEN_E_NOMEM;
  if (!samples || !before) goto done;
  s.slices = batten_alloc_array(ctx, count, sizeof *s.slices);
  for (size_t i = 0; i < count; i++)
    if (starts[i + 1] - starts[i] > most) most = starts[i + 1] - starts[i];
  room = batten_alloc_array(ctx, most, sizeof *room);
  st = s.slices && room ? BATTEN_OK : BATTEN_E_NOMEM;
  if (!s.slices) goto done;
  for (size_t i = 0; i < count; i++) s.slices[i] = (match_slice){0};
  for (size_t i = 0; i < count && st >= 0; i++) {
    match_slice *slice = s.slices + i;
    st = copy_slice(ctx, starts[i], starts[i + 1] - starts[i], points, &opt->fit, slice);
    if (st < 0) break;
    take_points(slice, starts[i], points, weights);
    st = measure(ctx, i, s.closed, slice);
    if (st < 0) break;
    sample(slice, s.closed, samples);
    double area = s.closed ? area_of(samples) / (slice->radius * slice->radius) : 0;
    if (opt->orient && i > 0 &&
        (s.closed ? turns_against(before, area_before, samples, area) : runs_against(before, samples))) {
      area = -area;
      reverse_slice(slice, s.closed);
      reverse_samples(s.closed, samples);
      take_points(slice, starts[i], points, weights);
      st = measure(ctx, i, s.closed, slice);
      if (st < 0) break;
    }
    if (s.closed && opt->align && i > 0) {
      start += best_shift(before, samples);
      start -= floor(start);
      rotate_slice(slice, start, room);
      take_points(slice, starts[i], points, weights);
    }
    memcpy(before, samples, 2 * SAMPLES * sizeof *samples);
    area_before = area;
  }
  if (st < 0) goto done;
  *out = s;
  s = (match_stack){0};
done:
  match_stack_free(ctx, &s);
  batten_free(ctx, room);
  batten_free(ctx, before);
  batten_free(ctx, samples);
  return st;
}
