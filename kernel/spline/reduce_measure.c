/* Errors at all points. Rounds may take fast sums; the final check takes batten_spline_evaluate(), which shares
 * nothing with them nor with the fit, and where that is too much at all points, at the worst and at evenly drawn
 * ones: at the others the fast sums are then taken to be off by as much as at the worst of these. */
#include "spline/reduce.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Fast sums take over where direct ones would take some seconds more than it takes to make the operators of fast
 * ones, and never where there are fewer centres than a fast sum costs direct terms a point. */
static const size_t FAST_CENTRES = 2500;
static const double FAST_TERMS = 5e9;

/* Fast sums are to be off by no more than this part of what the tolerances allow, at the points that the evaluator
 * looks at; else they are asked for REFINE times as much. */
static const double OFF = 0.05, REFINE = 30, FINEST = 1e-12;

/* Of the points, at most this part is certified as the worst ones, and at least as many points are drawn evenly. */
static const size_t WORST_PART = 10, CERTIFIED_LEAST = 1000;

/* ---- from values to errors ---- */

/* Over the largest entry, since squares of values in small or large units leave the range of doubles. */
static double length(size_t n, const double *v) {
  double largest = 0, square = 0;
  for (size_t a = 0; a < n; a++) largest = fmax(largest, fabs(v[a]));
  if (!(largest > 0) || isinf(largest)) return largest;
  for (size_t a = 0; a < n; a++) square += (v[a] / largest) * (v[a] / largest);
  return largest * sqrt(square);
}

/* |grad f| at point i < D, gradient: grad U. */
static double slope(const reduction *r, size_t i, const double *gradient) {
  const size_t n = r->data->n;
  double v[3] = {0};
  for (size_t a = 0; a < n; a++) v[a] = r->reduce.field_gradients[i * n + a] - gradient[a];
  return length(n, v);
}

/* Of point i when |U - v| is miss and |grad f| is slope (not read but for distances). A distance without a slope is
 * infinite, and so is what is no number: nothing is missed by more. */
static double error_of(const reduction *r, size_t i, double miss, double steep) {
  if (i < r->reduce.distance_count && miss != 0) miss = steep > 0 && !isinf(steep) ? miss / steep : INFINITY;
  return isnan(miss) ? INFINITY : miss;
}

/* From U and grad U at point i. */
static void set_error(reduction *r, size_t i, double value, const double *gradient) {
  const double steep = i < r->reduce.distance_count ? slope(r, i, gradient) : 1;
  r->error[i] = error_of(r, i, fabs(value - r->data->values[i]), steep);
  r->ratio[i] = r->error[i] / batten_reduce_tolerance(r, i);
}

static void set_errors(reduction *r) {
  const size_t n = r->data->n, count = r->data->count, distances = r->reduce.distance_count;
  double sum = 0;
  for (size_t i = 0; i < count; i++) {
    const double *gradient = i < distances ? r->gradients + i * n : NULL;
    set_error(r, i, r->values[i], gradient);
    sum += batten_reduce_tolerance(r, i) * (gradient ? slope(r, i, gradient) : 1);
  }
  r->allowed = sum / (double)count;
}

double batten_reduce_allowed_at_first(const reduction *r) {
  const size_t n = r->data->n;
  double sum = 0;
  for (size_t i = 0; i < r->data->count; i++)
    sum += batten_reduce_tolerance(r, i) *
           (i < r->reduce.distance_count ? length(n, r->reduce.field_gradients + i * n) : 1);
  return sum / (double)r->data->count;
}

/* ---- sums ---- */

static batten_status sum_directly(reduction *r) {
  const batten_spline_data *d = r->data;
  const size_t n = d->n, distances = r->reduce.distance_count;
  batten_status st = BATTEN_OK;
  if (distances) st = batten_spline_evaluate(r->ctx, r->spline, distances, d->points, r->values, r->gradients, NULL);
  if (st >= 0 && distances < d->count)
    st = batten_spline_evaluate(r->ctx, r->spline, d->count - distances, d->points + distances * n,
                                r->values + distances, NULL, NULL);
  r->direct = true;
  return st;
}

/* *off: the largest difference to direct sums that the evaluator found. */
static batten_status sum_fast(reduction *r, double *off) {
  const batten_spline_data *d = r->data;
  const size_t n = d->n, distances = r->reduce.distance_count;
  batten_spline_evaluator *e = NULL;
  double first = 0, rest = 0;
  batten_status st = batten_spline_evaluator_new(r->ctx, r->spline, r->accuracy, &e);
  if (st >= 0 && distances)
    st = batten_spline_evaluator_evaluate(r->ctx, e, distances, d->points, r->values, r->gradients, &first);
  if (st >= 0 && distances < d->count)
    st = batten_spline_evaluator_evaluate(r->ctx, e, d->count - distances, d->points + distances * n,
                                          r->values + distances, NULL, &rest);
  batten_spline_evaluator_free(e);
  *off = fmax(first, rest);
  r->direct = false;
  return st;
}

/* Of direct sums; with a gradient they take about twice as long. */
static double terms(const reduction *r) {
  return ((double)r->data->count + (double)r->reduce.distance_count) * (double)r->centres;
}

static bool fast_pays(const reduction *r) {
  if (!batten_spline_sums_exist(r->data->n)) return false;
  return terms(r) > r->reduce.terms_max || (terms(r) > FAST_TERMS && r->centres >= FAST_CENTRES);
}

batten_status batten_reduce_measure(reduction *r) {
  const double start = batten_now();
  batten_status st;
  if (!fast_pays(r)) {
    st = sum_directly(r);
  } else {
    double off;
    while ((st = sum_fast(r, &off)) >= 0 && off > OFF * r->allowed && r->accuracy > FINEST)
      r->accuracy = fmax(r->accuracy / REFINE, FINEST);
  }
  if (st >= 0) set_errors(r);
  r->info.time_evaluate_s += batten_now() - start;
  return st;
}

/* ---- the final check ---- */

/* What fast sums are off, at the most. */
typedef struct sums_off {
  double value, gradient;
} sums_off;

/* The worst points and evenly drawn ones: list [count], increasing in nothing. Returns how many. */
static size_t points_to_certify(reduction *r, size_t *list) {
  const size_t count = r->data->count;
  size_t most = count, worst, made = 0;
  if (terms(r) > r->reduce.terms_max) {
    most = (size_t)(r->reduce.terms_max / terms(r) * (double)count);
    if (most < CERTIFIED_LEAST) most = CERTIFIED_LEAST;
  }
  if (most >= count) most = count;
  worst = most / 2 < count / WORST_PART ? most / 2 : count / WORST_PART;
  for (size_t i = 0; i < count; i++) r->heap[i] = i;
  if (most == count) worst = 0; /* all, in their order */
  if (worst) batten_reduce_heap_make(r, r->heap, count);
  for (; made < worst; made++) {
    list[made] = r->heap[0];
    batten_reduce_heap_pop(r, r->heap, count - made);
  }
  /* What is left stands in an order that has to do with the errors only roughly: take evenly from it. */
  const size_t left = count - worst, drawn = most - worst;
  for (size_t q = 0; q < drawn; q++) list[made++] = r->heap[q * (left / drawn) + q * (left % drawn) / drawn];
  return made;
}

/* Errors at the points of list by direct sums; *off: what fast sums are off there, values and gradients. */
static batten_status certify_some(reduction *r, size_t count, const size_t *list, sums_off *off) {
  const size_t n = r->data->n;
  double *x = batten_alloc_array(r->ctx, count, (2 * n + 1) * sizeof *x);
  if (!x) return BATTEN_E_NOMEM;
  double *g = x + count * n, *u = g + count * n;
  for (size_t q = 0; q < count; q++) memcpy(x + q * n, r->data->points + list[q] * n, n * sizeof *x);
  batten_status st =
      batten_spline_evaluate(r->ctx, r->spline, count, x, u, r->reduce.distance_count ? g : NULL, NULL);
  for (size_t q = 0; st >= 0 && q < count; q++) {
    const size_t i = list[q];
    double d[3] = {0};
    off->value = fmax(off->value, fabs(u[q] - r->values[i]));
    for (size_t a = 0; a < n && i < r->reduce.distance_count; a++) d[a] = g[q * n + a] - r->gradients[i * n + a];
    off->gradient = fmax(off->gradient, length(n, d));
    set_error(r, i, u[q], g + q * n);
  }
  batten_free(r->ctx, x);
  return st;
}

/* The error of point i, whose sums are fast ones, when they are off by as much as at any point that was summed
 * directly. In values and gradients, not in distances over tolerances: these have to do with the point alone. */
static double bound_of(const reduction *r, size_t i, const sums_off *off) {
  const bool distance = i < r->reduce.distance_count;
  const double steep = distance ? slope(r, i, r->gradients + i * r->data->n) - off->gradient : 1;
  return error_of(r, i, fabs(r->values[i] - r->data->values[i]) + off->value, steep);
}

/* The bounds from the errors; certified: marks of the points that were summed directly, NULL: all. */
static void tell(reduction *r, const unsigned char *certified, const sums_off *off) {
  const size_t count = r->data->count, told = r->reduce.distance_count ? r->reduce.distance_count : count;
  batten_spline_reduce_info *i = &r->info;
  double sum = 0;
  i->error_max = i->error_certified = i->ratio_max = 0;
  for (size_t q = 0; q < count; q++) {
    const bool direct = !certified || certified[q];
    const double error = direct ? r->error[q] : bound_of(r, q, off);
    i->ratio_max = fmax(i->ratio_max, direct ? r->ratio[q] : error / batten_reduce_tolerance(r, q));
    if (q >= told) continue;
    i->error_max = fmax(i->error_max, r->error[q]);
    i->error_certified = fmax(i->error_certified, error);
    sum += r->error[q] * r->error[q];
  }
  i->error_rms = sqrt(sum / (double)told);
}

batten_status batten_reduce_certify(reduction *r) {
  const double start = batten_now();
  const size_t count = r->data->count;
  unsigned char *marks = NULL;
  sums_off off = {0};
  batten_status st = BATTEN_OK;
  r->info.certified_points = count;
  if (!r->direct && terms(r) <= r->reduce.terms_max) {
    st = sum_directly(r);
    if (st >= 0) set_errors(r);
  } else if (!r->direct) {
    const size_t some = points_to_certify(r, r->near);
    marks = batten_alloc(r->ctx, count);
    if (!marks) return BATTEN_E_NOMEM;
    memset(marks, 0, count);
    for (size_t q = 0; q < some; q++) marks[r->near[q]] = 1;
    st = certify_some(r, some, r->near, &off);
    r->info.certified_points = some;
  }
  if (st >= 0) tell(r, marks, &off);
  batten_free(r->ctx, marks);
  r->info.time_certify_s += batten_now() - start;
  return st;
}
