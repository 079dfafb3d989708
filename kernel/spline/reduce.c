/* A spline with fewer centres than data points that still meets all of them to a tolerance.
 *                                                                        [Carr et al. 2001, section 5]
 *
 * Rounds of: fit to the centres, look at all points, add the worst. Centres about double from round to round, so that
 * all rounds together cost about twice the last one. What is returned has passed the final check, or says that it has
 * not: that check is by direct sums and knows of no fit (reduce_measure.c). */
#include "spline/reduce.h"

#include "base/checked.h"

#include <string.h>

/* Centres of the first round: what follows costs twice as much as this in any case. */
enum { START = 120 };

batten_spline_reduce_options batten_spline_reduce_options_default(void) {
  return (batten_spline_reduce_options){
      .struct_size = sizeof(batten_spline_reduce_options), .share_max = 0.5, .terms_max = 2e10};
}

/* ---- checks ---- */

static batten_status check_tolerances(batten_context *ctx, size_t count, const batten_spline_reduce_options *o) {
  if (!o->tolerances && !(o->tolerance > 0 && isfinite(o->tolerance)))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "reduce.tolerance: %g; must be > 0 and finite, batten_spline_fit() meets all values",
                       o->tolerance);
  for (size_t i = 0; i < count && o->tolerances; i++)
    if (!(o->tolerances[i] > 0) || !isfinite(o->tolerances[i]))
      return batten_fail(ctx, BATTEN_E_INVALID, "reduce.tolerances[%zu]: %g; must be > 0 and finite", i,
                         o->tolerances[i]);
  return BATTEN_OK;
}

static batten_status check_reduce(batten_context *ctx, const batten_spline_data *d, const batten_spline_options *opt,
                                  const batten_spline_reduce_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_spline_reduce_options", o->struct_size, sizeof *o);
  if (st < 0) return st;
  if (d->gradient_count)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "data.gradient_count: %zu; a tolerance is for values alone, fit gradients with "
                       "batten_spline_fit() or give points off the surface in their place",
                       d->gradient_count);
  if ((st = check_tolerances(ctx, d->count, o)) < 0) return st;
  if (!(o->share_max > 0 && o->share_max <= 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "reduce.share_max: %g; must be in (0, 1]", o->share_max);
  if (!(o->terms_max >= 0))
    return batten_fail(ctx, BATTEN_E_INVALID, "reduce.terms_max: %g; must be >= 0", o->terms_max);
  const size_t least = batten_polynomial_count(d->n, opt->m - 1) + 2 * d->n; /* they span the box too */
  if (o->centers_max && o->centers_max < least)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "reduce.centers_max: %zu; with n = %u and m = %u give 0 or at least %zu", o->centers_max, d->n,
                       opt->m, least);
  if (o->distance_count > d->count)
    return batten_fail(ctx, BATTEN_E_INVALID, "reduce.distance_count: %zu, more than data.count = %zu points",
                       o->distance_count, d->count);
  if (o->distance_count && !o->field_gradients)
    return batten_fail(ctx, BATTEN_E_INVALID, "reduce.field_gradients: NULL with reduce.distance_count = %zu",
                       o->distance_count);
  size_t bad = batten_first_nonfinite(o->distance_count * d->n, o->distance_count ? o->field_gradients : NULL);
  if (bad < o->distance_count * d->n)
    return batten_fail(ctx, BATTEN_E_INVALID, "reduce.field_gradients[%zu][%zu]: %g; must be finite", bad / d->n,
                       bad % d->n, o->field_gradients[bad]);
  return BATTEN_OK;
}

static batten_status check_arguments(batten_context *ctx, const batten_spline_data *data,
                                     const batten_spline_options *opt, const batten_spline_reduce_options *reduce,
                                     batten_spline **out) {
  if (!data || !reduce || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", !data ? "data" : reduce ? "out" : "reduce");
  batten_status st = batten_spline_check_data(ctx, data, opt);
  return st < 0 ? st : check_reduce(ctx, data, opt, reduce);
}

/* ---- memory ---- */

static batten_status take_memory(reduction *r) {
  const size_t count = r->data->count;
  double **const numbers[] = {&r->values, &r->error, &r->ratio};
  size_t **const lists[] = {&r->heap, &r->near, &r->chosen};
  for (size_t k = 0; k < 3; k++) {
    *numbers[k] = batten_alloc_array(r->ctx, count, sizeof(double));
    *lists[k] = batten_alloc_array(r->ctx, count, sizeof(size_t));
    if (!*numbers[k] || !*lists[k]) return BATTEN_E_NOMEM;
  }
  r->gradients = batten_alloc_array(r->ctx, r->reduce.distance_count, r->data->n * sizeof(double));
  r->state = batten_alloc(r->ctx, count);
  return r->gradients && r->state ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void release(reduction *r) {
  batten_spline_free(r->spline);
  batten_tree_free(r->ctx, r->tree);
  batten_free(r->ctx, r->state);
  batten_free(r->ctx, r->gradients);
  batten_free(r->ctx, r->values);
  batten_free(r->ctx, r->error);
  batten_free(r->ctx, r->ratio);
  batten_free(r->ctx, r->heap);
  batten_free(r->ctx, r->near);
  batten_free(r->ctx, r->chosen);
}

/* ---- one fit ---- */

static double value_range(const batten_spline_data *d) {
  double least = d->values[0], most = least;
  for (size_t i = 1; i < d->count; i++) {
    least = fmin(least, d->values[i]);
    most = fmax(most, d->values[i]);
  }
  return most - least;
}

/* A residual is told as a 2-norm over that of the values, which is below half their range a point; the largest is ten
 * times the mean or so; and a twentieth of the tolerance is to be left for it. */
static double accuracy_needed(const reduction *r) {
  const double range = value_range(r->data);
  return fmin(fmax(range > 0 ? r->allowed / (100 * range) : 0, 1e-12), 1e-3);
}

static batten_spline_options options_of_round(const reduction *r) {
  batten_spline_options o = r->opt;
  o.loo_samples = 0;
  o.saddle.accuracy = accuracy_needed(r);
  return o;
}

/* Fits o to the centres. */
static batten_status fit_to_centres(reduction *r, batten_spline_options o) {
  const size_t n = r->data->n, count = r->centres;
  const double *smoothing = r->opt.smoothing_per_point;
  batten_spline *made = NULL;
  batten_status st = BATTEN_E_NOMEM;
  double *x = batten_alloc_array(r->ctx, count, (n + 2) * sizeof *x), *v = x ? x + count * n : NULL;
  if (!x) return st;
  for (size_t i = 0, q = 0; i < r->data->count; i++) {
    if (r->state[i] != REDUCE_CENTRE) continue;
    memcpy(x + q * n, r->data->points + i * n, n * sizeof *x);
    v[q] = r->data->values[i];
    if (smoothing) v[count + q] = smoothing[i];
    q++;
  }
  batten_spline_data d = *r->data;
  d.count = count;
  d.points = x;
  d.values = v;
  if (smoothing) o.smoothing_per_point = v + count;
  st = batten_spline_fit(r->ctx, &d, &o, &made, &r->info.fit);
  batten_free(r->ctx, x);
  if (st < 0) return st;
  batten_spline_free(r->spline);
  r->spline = made;
  return BATTEN_OK;
}

/* Fits and measures, and keeps the round for the record. */
static batten_status fit_round(reduction *r, batten_spline_options o) {
  batten_spline_reduce_info *info = &r->info;
  double start = batten_now(), worst = 0;
  batten_status st = fit_to_centres(r, o);
  info->time_fit_s += batten_now() - start;
  if (st >= 0) st = batten_reduce_measure(r);
  if (st < 0) return st;
  for (size_t i = 0; i < r->data->count; i++) worst = fmax(worst, r->ratio[i]);
  if (info->rounds < BATTEN_SPLINE_REDUCE_ROUNDS)
    info->history[info->rounds] = (batten_spline_reduce_round){r->centres, worst};
  info->rounds++;
  return BATTEN_OK;
}

/* ---- rounds ---- */

static batten_status take_all(reduction *r) {
  batten_spline_options o = r->opt;
  for (size_t i = 0; i < r->data->count; i++)
    if (r->state[i] == REDUCE_FREE) r->state[i] = REDUCE_CENTRE;
  r->centres = r->distinct;
  r->info.all = 1;
  o.loo_samples = 0;
  o.saddle.accuracy = fmin(o.saddle.accuracy, accuracy_needed(r));
  return fit_round(r, o);
}

static size_t centres_allowed(const reduction *r) {
  const size_t asked = r->reduce.centers_max;
  return asked && asked < r->distinct ? asked : r->distinct;
}

/* A start whose points lie on the zero set of a polynomial has no spline: twice as many may, in the end all. */
static batten_status first_round(reduction *r) {
  const size_t allowed = centres_allowed(r);
  for (size_t wanted = START;; wanted *= 2) {
    double start = batten_now();
    batten_status st = batten_reduce_start(r, wanted, allowed);
    r->info.time_select_s += batten_now() - start;
    if (st >= 0) st = fit_round(r, options_of_round(r));
    if (st != BATTEN_E_SINGULAR) return st;
    const bool last = wanted >= r->data->count;
    if (allowed < r->distinct && (last || r->centres >= allowed)) return st;
    if (allowed == r->distinct && (last || 2 * r->centres > r->distinct)) return take_all(r);
  }
}

/* From 0 to 1 as the largest error falls towards the tolerance, in powers. */
static batten_status tell_progress(const reduction *r) {
  const batten_spline_reduce_round *h = r->info.history;
  const size_t last = r->info.rounds < BATTEN_SPLINE_REDUCE_ROUNDS ? r->info.rounds : BATTEN_SPLINE_REDUCE_ROUNDS;
  double fraction = 0;
  if (last > 0 && h[0].ratio_max > 1 && isfinite(h[0].ratio_max))
    fraction = 1 - log(fmax(h[last - 1].ratio_max, 1)) / log(h[0].ratio_max);
  return batten_progress(r->ctx, "reduce", fmin(fmax(fraction, 0), 1));
}

/* Adds centres and fits again until no free point asks for it, or no more are allowed. */
static batten_status go_on(reduction *r) {
  const size_t allowed = centres_allowed(r);
  for (;;) {
    batten_status st = tell_progress(r);
    if (st < 0) return st;
    const double start = batten_now();
    const size_t room = allowed > r->centres ? allowed - r->centres : 0;
    const size_t added = batten_reduce_add_worst(r, room < r->centres ? room : r->centres);
    r->info.time_select_s += batten_now() - start;
    if (added == 0) return BATTEN_OK;
    const bool many = (double)r->centres > r->reduce.share_max * (double)r->distinct;
    if (allowed == r->distinct && (many || r->info.rounds + 1 >= BATTEN_SPLINE_REDUCE_ROUNDS)) return take_all(r);
    if ((st = fit_round(r, options_of_round(r))) < 0) return st;
  }
}

/* Rounds until the final check finds nothing more to add. */
static batten_status find_centres(reduction *r) {
  batten_status st = first_round(r);
  for (size_t certified = 0; st >= 0 && certified != r->centres;) {
    st = go_on(r);
    if (st < 0 || certified == r->centres) break;
    st = batten_reduce_certify(r);
    if (r->info.all || r->info.ratio_max <= 1) break;
    certified = r->centres;
  }
  return st;
}

/* ---- the result ---- */

static batten_status judge(const reduction *r) {
  const batten_spline_reduce_info *i = &r->info;
  if (i->ratio_max <= 1) return batten_fail(r->ctx, BATTEN_OK, "%s", "");
  size_t worst = 0;
  for (size_t q = 1; q < r->data->count; q++)
    if (r->ratio[q] > r->ratio[worst]) worst = q;
  if (r->ratio[worst] <= 1)
    return batten_fail(r->ctx, BATTEN_W_ACCURACY,
                       "points: fast sums are off by so much that the bound of the error is %.3g of what is allowed; "
                       "allow more direct sums by reduce.terms_max",
                       i->ratio_max);
  const bool limited = r->reduce.centers_max && r->centres >= r->reduce.centers_max;
  const bool smooth = r->opt.smoothing > 0 || r->opt.smoothing_per_point;
  return batten_fail(
      r->ctx, BATTEN_W_ACCURACY, "points[%zu]: missed by %.3g with %zu centres, %.3g allowed; %s", worst,
      r->error[worst], r->centres, batten_reduce_tolerance(r, worst),
      limited  ? "allow more by reduce.centers_max, or a larger tolerance"
      : smooth ? "smoothing holds U off its centres: take less of it, or a larger tolerance"
      : r->state[worst] == REDUCE_TWIN
          ? "it equals another point, whose value differs: merge them"
          : "that is all that the fit to its centres gives: allow a larger tolerance, or merge near points");
}

batten_status batten_spline_fit_reduced(batten_context *ctx, const batten_spline_data *data,
                                        const batten_spline_options *opt, const batten_spline_reduce_options *reduce,
                                        batten_spline **out, batten_spline_reduce_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  const double start = batten_now();
  reduction r = {.ctx = ctx, .data = data, .opt = opt ? *opt : batten_spline_options_default(), .accuracy = 1e-6};
  batten_status st = check_arguments(ctx, data, &r.opt, reduce, out);
  if (st < 0) return st;
  r.reduce = *reduce;
  r.allowed = 0;
  if ((st = take_memory(&r)) < 0) goto done;
  if ((st = batten_reduce_prepare(&r)) < 0) goto done;
  r.allowed = batten_reduce_allowed_at_first(&r);
  if ((st = find_centres(&r)) < 0) goto done;
  st = judge(&r);
  r.info.points = data->count;
  r.info.centers = r.centres;
  r.info.all = r.centres == r.distinct;
  r.info.time_total_s = batten_now() - start;
  if (info) *info = r.info;
  *out = r.spline;
  r.spline = NULL;
done:
  release(&r);
  return st;
}
