/* A solid's f and gradient at many points: the spline's sums by <batten/fmm.h> where there are many, direct
 * otherwise.
 *
 * What the caller asks for is a distance: how far the surface may move. What the sums take is a relative accuracy of
 * their own, and how the two go together depends on the data: f is a difference of large sums. So it is found by
 * trial: at some places f is summed directly too, and the sums are made finer until the difference over the slope of
 * f is small enough. The first trial is coarse and cheap, and says how fine the second has to be. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "solid/solid_inner.h"

/* Terms N + n M from which on sums pay for a check and a surface: half the time for 15,000 with the kernels r and
 * r^2 ln r, where the fit takes iteration from as many on. Others lose digits that cost more. */
enum { FAST_FROM = 12000, FAST_FROM_SMOOTH = 30000 };

static const double ACCURACY = 1e-7; /* a tenth of what the polygoniser settles vertices to */
static const double ACCURACY_FINEST = 1e-12, ACCURACY_COARSEST = 1e-2;

/* What sums can be asked for, and what the first trial does: operators of 1e-6 take a tenth of a second. */
static const double SUMS_FINEST = 1e-12, SUMS_FIRST = 1e-6;

/* Errors at some hundred places say what they are at many: of 60,000 on the surfaces of 3300 to 12,000 points the
 * largest was up to 5.4 times as large. */
static const double LARGEST = 1.0 / 6;

/* Off its own slope the gradient of a place counts with this part of the median's. */
static const double WEAK = 0.01;

struct batten_solid_evaluator {
  batten_context *ctx;
  batten_solid *solid;           /* retained */
  batten_spline_evaluator *sums; /* NULL: direct */
  double margin;                 /* ten times the largest error of f that was seen */
  batten_solid_evaluator_info info;
};

/* ---- evaluating ---------------------------------------------------------------------------------- */

/* out = sign (carrier - out) */
static void combine(int sign, size_t count, const double *carrier, double *out) {
  for (size_t i = 0; i < count; i++) out[i] = sign * (carrier[i] - out[i]);
}

static batten_status evaluate_fast(batten_solid_evaluator *e, size_t count, const double *points, double *values,
                                   double *gradients) {
  const batten_solid *s = e->solid;
  double *aside = batten_alloc_array(e->ctx, count, ((values ? 1 : 0) + (gradients ? s->n : 0)) * sizeof *aside);
  if (!aside) return BATTEN_E_NOMEM;
  double *f = values ? aside : NULL, *df = gradients ? aside + (values ? count : 0) : NULL;
  batten_status st = batten_carrier_evaluate(e->ctx, s->carrier, count, points, f, df, NULL);
  if (st >= 0) st = batten_spline_evaluator_evaluate(e->ctx, e->sums, count, points, values, gradients, NULL);
  if (st >= 0 && f) combine(s->sign, count, f, values);
  if (st >= 0 && df) combine(s->sign, count * s->n, df, gradients);
  batten_free(e->ctx, aside);
  return st;
}

batten_status batten_solid_evaluator_evaluate(batten_context *ctx, batten_solid_evaluator *e, size_t count,
                                              const double *points, double *values, double *gradients) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!e) return batten_fail(ctx, BATTEN_E_INVALID, "e: NULL; make it with batten_solid_evaluator_new()");
  if (e->ctx != ctx)
    return batten_fail(ctx, BATTEN_E_INVALID, "e: made with another context; pass the one it was made with");
  if (count == 0) return BATTEN_OK;
  size_t bytes;
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][%u] numbers", count, e->solid->n);
  if (!values && !gradients) return BATTEN_OK;
  if (!batten_mul3(count, e->solid->n + 1, sizeof(double), &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; too many", count);
  double start = batten_now();
  batten_status st = e->sums ? evaluate_fast(e, count, points, values, gradients)
                             : batten_solid_evaluate(ctx, e->solid, count, points, values, gradients, NULL);
  e->info.time_evaluate_s += batten_now() - start;
  if (st >= 0) e->info.evaluations += count;
  return st;
}

/* ---- as a field ---------------------------------------------------------------------------------- */

/* The field's user is const for who evaluates it; the evaluator keeps books. */
static batten_solid_evaluator *from_user(const void *user) { return (batten_solid_evaluator *)(uintptr_t)user; }

static batten_status evaluate_field(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  (void)hessians; /* of order 1 */
  return batten_solid_evaluator_evaluate(ctx, from_user(user), count, points, values, gradients);
}

static batten_status bounds_of_field(const void *user, batten_context *ctx, size_t count, const double *boxes,
                                     double *ranges) {
  const batten_solid_evaluator *e = user;
  batten_status st = batten_solid_bounds(ctx, e->solid, count, boxes, ranges);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    ranges[2 * i] -= e->margin;
    ranges[2 * i + 1] += e->margin;
  }
  return st;
}

batten_field batten_solid_evaluator_field(batten_solid_evaluator *e) {
  return (batten_field){
      .dimension = e->solid->n, .order = 1, .evaluate = evaluate_field, .user = e, .bounds = bounds_of_field};
}

/* ---- trials -------------------------------------------------------------------------------------- */

enum { ON = 400, OFF = 112, PLACES = ON + OFF };

/* Where f is summed directly too, and what it is there. */
typedef struct trial {
  size_t on, count; /* places on the surface, which come first; all */
  double *x;        /* [count][n] */
  double *f, *df;   /* direct: [count], [count][n] */
  double *g, *dg;   /* by sums */
  double *slope;    /* [count] |grad f|, not much under the median */
  double diagonal;  /* of the box */
} trial;

static double length(size_t n, const double *v) {
  double square = 0;
  for (size_t k = 0; k < n; k++) square += v[k] * v[k];
  return sqrt(square);
}

/* Points of the surface, evenly drawn, and places between two of them: from beside the surface to its inside. */
static void choose_places(const batten_solid *s, trial *t) {
  const size_t n = s->n;
  for (size_t q = 0; q < t->on; q++)
    memcpy(t->x + q * n, s->points + batten_drawn(q, t->on, s->count) * n, n * sizeof *t->x);
  for (size_t q = t->on; q < t->count; q++) {
    const double *a = t->x + (q * 7 % t->on) * n, *b = t->x + (q * 13 + t->on / 2) % t->on * n;
    const double part = ldexp(1, -1 - (int)(q % 8));
    for (size_t k = 0; k < n; k++) t->x[q * n + k] = a[k] + part * (b[k] - a[k]);
  }
}

/* Slopes at the places; those off the surface, and where it is flat, are measured by the median. */
static void find_slopes(size_t n, trial *t) {
  double sorted[ON] = {0};
  for (size_t q = 0; q < t->count; q++) t->slope[q] = length(n, t->df + q * n);
  for (size_t q = 0; q < t->on; q++) { /* in order, by insertion */
    size_t at = q;
    for (; at > 0 && sorted[at - 1] > t->slope[q]; at--) sorted[at] = sorted[at - 1];
    sorted[at] = t->slope[q];
  }
  const double median = sorted[t->on / 2];
  for (size_t q = 0; q < t->count; q++) t->slope[q] = q < t->on ? fmax(t->slope[q], WEAK * median) : median;
}

static batten_status open_trial(batten_context *ctx, const batten_solid *s, trial *t) {
  const size_t n = s->n;
  double square = 0;
  for (size_t k = 0; k < n; k++) square += (s->upper[k] - s->lower[k]) * (s->upper[k] - s->lower[k]);
  *t = (trial){.on = s->count < ON ? s->count : ON, .diagonal = sqrt(square)};
  t->count = t->on + OFF;
  t->x = batten_alloc_array(ctx, PLACES, (3 * n + 3) * sizeof *t->x);
  if (!t->x) return BATTEN_E_NOMEM;
  t->df = t->x + PLACES * n;
  t->dg = t->df + PLACES * n;
  t->f = t->dg + PLACES * n;
  t->g = t->f + PLACES;
  t->slope = t->g + PLACES;
  choose_places(s, t);
  batten_status st = batten_solid_evaluate(ctx, s, t->count, t->x, t->f, t->df, NULL);
  if (st >= 0) find_slopes(n, t);
  return st;
}

/* The larger of *worst and miss over unit; nothing is missed by 0 of 0. Not fmax, which would lose what is no number.
 */
static void raise(double *worst, double miss, double unit) {
  const double part = miss == 0 ? 0 : miss / unit;
  if (!(part <= *worst)) *worst = part;
}

/* How far the sums of e are off. */
static batten_status measure(batten_solid_evaluator *e, trial *t) {
  const size_t n = e->solid->n;
  batten_solid_evaluator_info *info = &e->info;
  batten_status st = evaluate_fast(e, t->count, t->x, t->g, t->dg);
  if (st < 0) return st;
  double largest = 0;
  info->error = info->gradient_error = 0;
  for (size_t q = 0; q < t->count; q++) {
    const double miss = fabs(t->g[q] - t->f[q]);
    for (size_t k = 0; k < n; k++) t->dg[q * n + k] -= t->df[q * n + k];
    largest = fmax(largest, miss);
    const double turn = length(n, t->dg + q * n);
    raise(&info->error, miss, t->slope[q] * t->diagonal);
    raise(&info->gradient_error, turn, t->slope[q]);
  }
  info->places = t->count;
  e->margin = 10 * largest;
  return BATTEN_OK;
}

/* Sums of this accuracy in place of those that there are. */
static batten_status take_sums(batten_solid_evaluator *e, double accuracy) {
  batten_spline_evaluator_free(e->sums);
  e->sums = NULL;
  e->info.sums_accuracy = accuracy;
  return batten_spline_evaluator_new(e->ctx, e->solid->spline, accuracy, &e->sums);
}

static batten_status find_sums(batten_solid_evaluator *e, double accuracy) {
  trial t;
  const double wanted = LARGEST * accuracy;
  batten_status st = open_trial(e->ctx, e->solid, &t);
  for (double sums = SUMS_FIRST; st >= 0;) {
    st = take_sums(e, sums);
    if (st >= 0) st = measure(e, &t);
    if (st < 0 || e->info.error <= wanted || sums <= SUMS_FINEST) break;
    /* In proportion, and a little finer; what is no number says nothing. */
    const double finer = isfinite(e->info.error) ? 0.7 * sums * wanted / e->info.error : 0;
    sums = fmax(fmin(finer, sums / 3), SUMS_FINEST);
  }
  batten_free(e->ctx, t.x);
  if (st < 0 || e->info.error <= wanted) return st;
  return batten_fail(
      e->ctx, BATTEN_W_ACCURACY,
      "accuracy: %.3g of the box's diagonal reached with sums of %g, the finest, %g asked for; evaluate "
      "directly, or ask for less",
      e->info.error, SUMS_FINEST, accuracy);
}

/* ---- making -------------------------------------------------------------------------------------- */

size_t batten_solid_term_count(const batten_solid *s) {
  if (!s->spline) return 0;
  batten_spline_parts parts;
  batten_spline_get_parts(s->spline, &parts);
  return parts.count + parts.n * parts.gradient_count;
}

/* Not of a spline that is its polynomial alone, nor without a point at which trials could look. */
static bool takes_sums(const batten_solid *s, batten_evaluation how) {
  if (!s->spline || s->n < 2 || how == BATTEN_EVALUATE_DIRECT) return false;
  if (batten_solid_term_count(s) == 0 || s->count == 0) return false;
  batten_spline_parts parts;
  batten_spline_get_parts(s->spline, &parts);
  const size_t from = 2 * parts.m - parts.n > 2 ? FAST_FROM_SMOOTH : FAST_FROM;
  return how == BATTEN_EVALUATE_FAST || batten_solid_term_count(s) >= from;
}

batten_status batten_solid_evaluator_new(batten_context *ctx, batten_solid *s, batten_evaluation how, double accuracy,
                                         batten_solid_evaluator **out) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!s || !out)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %s", s ? "out" : "s",
                       s ? "the place for the evaluator" : "a solid");
  if (how < BATTEN_EVALUATE_AUTO || how > BATTEN_EVALUATE_FAST)
    return batten_fail(ctx, BATTEN_E_INVALID, "how: %d; give one of its names", (int)how);
  if (accuracy == 0) accuracy = ACCURACY;
  if (!(accuracy >= ACCURACY_FINEST && accuracy <= ACCURACY_COARSEST))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "accuracy: %g; give a share of the box's diagonal, %g .. %g, or 0 for %g", accuracy,
                       ACCURACY_FINEST, ACCURACY_COARSEST, ACCURACY);
  double start = batten_now();
  batten_solid_evaluator *e = batten_alloc(ctx, sizeof *e);
  if (!e) return BATTEN_E_NOMEM;
  *e = (batten_solid_evaluator){.ctx = ctx, .solid = batten_solid_retain(s)};
  e->info.terms = batten_solid_term_count(s);
  e->info.method = takes_sums(s, how) ? BATTEN_EVALUATE_FAST : BATTEN_EVALUATE_DIRECT;
  batten_status st = e->info.method == BATTEN_EVALUATE_FAST ? find_sums(e, accuracy) : BATTEN_OK;
  if (st < 0) {
    batten_solid_evaluator_free(e);
    return st;
  }
  e->info.time_new_s = batten_now() - start;
  *out = e;
  return st;
}

batten_solid_evaluator_info batten_solid_evaluator_get_info(const batten_solid_evaluator *e) { return e->info; }

void batten_solid_evaluator_free(batten_solid_evaluator *e) {
  if (!e) return;
  batten_spline_evaluator_free(e->sums);
  batten_solid_free(e->solid);
  batten_free(e->ctx, e);
}
