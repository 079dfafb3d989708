/* A solid from scattered surface points: fit with the carrier, look at the signs, and where they are not settled
 * orient the points and fit again with the orientation as data.   [Savchenko et al. 1995, section 3] */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "solid/solid_inner.h"
#include "solid/solid_noise.h"

batten_solid_options batten_solid_options_default(void) {
  return (batten_solid_options){.struct_size = sizeof(batten_solid_options),
                                .energy_points = 1000,
                                .pair_distance = 0.5,
                                .check_cells = 40,
                                .spline = batten_spline_options_default()};
}

/* One way of fitting and what came of it. */
typedef struct attempt {
  batten_solid *solid;
  batten_spline_info spline;
  batten_spline_reduce_info reduced;
  double value_range, smoothing;
  batten_orient_data data; /* AUTO: the carrier alone */
  batten_sign_check check;
  batten_solid_evaluator_info evaluation; /* of the check */
} attempt;

typedef struct fit_state {
  batten_context *ctx;
  batten_solid_options opt;
  surface_data data;
  batten_carrier *carrier; /* owned; NULL until somebody needs it */
  double *normals;         /* that are in use; owned when estimated */
  batten_orientation_used orientation;
  attempt best;       /* so far */
  bool carrier_tried; /* the first attempt was with the carrier alone */
  batten_solid_info info;
} fit_state;

/* max |f| / range of the values above which the fit counts as inaccurate. */
static const double RESIDUAL = 1e-10;

/* ---- checks -------------------------------------------------------------------------------------- */

static batten_status check_enum(batten_context *ctx, const char *name, int value, int last) {
  if (value >= 0 && value <= last) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %d; give one of its names", name, value);
}

static batten_status check_options(batten_context *ctx, unsigned n, const batten_solid_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_solid_options", o->struct_size, sizeof *o);
  if (st >= 0) st = batten_check_struct(ctx, "batten_spline_options", o->spline.struct_size, sizeof o->spline);
  if (st >= 0) st = check_enum(ctx, "orientation", (int)o->orientation, BATTEN_ORIENT_ESTIMATE);
  if (st >= 0) st = check_enum(ctx, "orient_data", (int)o->orient_data, BATTEN_ORIENT_DATA_PAIRS);
  if (st >= 0) st = check_enum(ctx, "evaluation", (int)o->evaluation, BATTEN_EVALUATE_FAST);
  if (st >= 0) st = check_enum(ctx, "orient_method", (int)o->orient_method, BATTEN_ORIENT_METHOD_PLANES);
  if (st < 0) return st;
  if (!(o->merge_radius >= 0) || !isfinite(o->merge_radius))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.merge_radius: %g; give a length >= 0", o->merge_radius);
  if (!isfinite(o->noise))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.noise: %g; give a length, 0, or BATTEN_NOISE_ESTIMATE", o->noise);
  if (o->noise != 0 && (o->spline.smoothing != 0 || o->spline.smoothing_per_point))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.noise: %g beside opt.spline.smoothing%s; noise finds the smoothing: give one of them",
                       o->noise, o->spline.smoothing_per_point ? "_per_point" : "");
  if (!(o->pair_distance > 0 && o->pair_distance <= 1))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.pair_distance: %g; give 0 < it <= 1", o->pair_distance);
  if (!(o->reduce >= 0) || !isfinite(o->reduce))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.reduce: %g; give a length >= 0", o->reduce);
  if (o->reduce > 0 && o->orient_data == BATTEN_ORIENT_DATA_GRADIENTS)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.reduce: %g with opt.orient_data gradients; a tolerance is for points alone, give pairs",
                       o->reduce);
  if (o->reduce > 0 && o->noise != 0)
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "opt.noise: %g beside opt.reduce: %g; a tolerance holds the points that noise lets go: give one of them",
        o->noise, o->reduce);
  if (o->check_cells < 8 || o->check_cells > 1000)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.check_cells: %zu; give 8 to 1000", o->check_cells);
  if (2 * o->spline.m <= n || o->spline.m > 4)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.spline.m: %u; give %u to 4 in %u dimensions", o->spline.m,
                       n / 2 + 1, n);
  if (o->orientation == BATTEN_ORIENT_GIVEN && !o->normals)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.normals: NULL; orientation given needs them");
  unsigned of_carrier = o->carrier ? batten_carrier_field(o->carrier).dimension : n;
  if (of_carrier != n)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.carrier: of dimension %u, the points are of %u", of_carrier, n);
  return BATTEN_OK;
}

static batten_status check_arguments(batten_context *ctx, unsigned n, size_t count, const double *points,
                                     const void *out) {
  size_t bytes;
  if (n < 1 || n > 3) return batten_fail(ctx, BATTEN_E_INVALID, "n: %u; give 1, 2 or 3", n);
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the solid");
  if (count == 0) return batten_fail(ctx, BATTEN_E_INVALID, "count: 0; give points");
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][%u] numbers", count, n);
  if (!batten_mul3(count, n, sizeof(double), &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; too many", count);
  return BATTEN_OK;
}

/* Carriers that a spline of order m contains whole, known by their kind. */
static bool kind_is_reproduced(const batten_carrier *c, unsigned m) {
  batten_carrier_parts parts;
  batten_carrier_get_parts(c, &parts);
  switch (parts.kind) {
    case BATTEN_CARRIER_NONE:
      return true;
    case BATTEN_CARRIER_HALF_SPACE:
      return m >= 2;
    case BATTEN_CARRIER_BALL:
    case BATTEN_CARRIER_ELLIPSOID:
      return m >= 3;
    default:
      return false;
  }
}

static batten_status refuse_carrier(batten_context *ctx, const batten_carrier *c, unsigned m) {
  batten_carrier_parts parts;
  batten_carrier_get_parts(c, &parts);
  const char *name = batten_carrier_kind_name(parts.kind);
  if (parts.kind == BATTEN_CARRIER_NONE)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.carrier: none needs oriented points; give opt.normals, or set "
                       "opt.orientation to estimate");
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "opt.carrier: the spline of order m = %u reproduces this %s, so that f is 0 "
                     "everywhere; %s",
                     m, name,
                     m >= 3 ? "set opt.spline.m to 2, or opt.orientation to given or estimate"
                            : "take a ball, an ellipsoid, or NULL for a fitted one");
}

/* ---- fits ---------------------------------------------------------------------------------------- */

static batten_status need_carrier(fit_state *f) {
  if (f->carrier) return BATTEN_OK;
  return batten_carrier_fit(f->ctx, f->data.n, f->data.count, f->data.points, &f->carrier);
}

enum { TRIALS = 128 };

/* Whether U equals f_c to rounding off the data too: then f = f_c - U is noise. Looks at fixed pseudo-random points
 * in the box. *scale: the largest |f_c| there. */
static batten_status is_reproduced(fit_state *f, const batten_solid *s, bool *reproduced, double *scale) {
  size_t n = f->data.n;
  double *x = batten_alloc_array(f->ctx, TRIALS, (n + 2) * sizeof *x);
  if (!x) return BATTEN_E_NOMEM;
  double *carrier = x + TRIALS * n, *value = carrier + TRIALS, largest = 0, difference = 0;
  uint64_t state = 1;
  for (size_t i = 0; i < TRIALS * n; i++) {
    state =
        state * 6364136223846793005u + 1442695040888963407u; /* Knuth's linear congruence; the high bits are good */
    double t = (double)(state >> 11) * 0x1p-53;
    x[i] = f->data.lower[i % n] + t * (f->data.upper[i % n] - f->data.lower[i % n]);
  }
  batten_status st = batten_carrier_evaluate(f->ctx, f->carrier, TRIALS, x, carrier, NULL, NULL);
  if (st >= 0) st = batten_solid_evaluate(f->ctx, s, TRIALS, x, value, NULL, NULL);
  for (size_t i = 0; i < TRIALS; i++) {
    largest = fmax(largest, fabs(carrier[i]));
    difference = fmax(difference, fabs(value[i]));
  }
  /* 1e-8: the rounding of ill-conditioned fits; fits that mean something have 1e-3 and more */
  *reproduced = !(difference > 1e-8 * largest);
  *scale = largest;
  batten_free(f->ctx, x);
  return st;
}

static batten_status fit_with_carrier(fit_state *f, attempt *a) {
  const surface_data *d = &f->data;
  batten_context *ctx = f->ctx;
  batten_spline *spline = NULL;
  double *values = NULL, scale = 0, least = INFINITY, most = -INFINITY;
  bool reproduced = false;
  batten_status st = need_carrier(f);
  if (st < 0) return st;
  if (kind_is_reproduced(f->carrier, f->opt.spline.m)) return refuse_carrier(ctx, f->carrier, f->opt.spline.m);
  values = batten_alloc_array(ctx, d->count, sizeof *values);
  st = values ? batten_carrier_evaluate(ctx, f->carrier, d->count, d->points, values, NULL, NULL) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  batten_spline_data data = batten_spline_data_default();
  data.n = d->n;
  data.count = d->count;
  data.points = d->points;
  data.values = values;
  batten_spline_options o = f->opt.spline;
  o.smoothing_per_point = d->smoothing;
  st = batten_solid_fit_spline(ctx, &f->opt, f->carrier, d->count, &data, &o, &spline, &a->spline, &a->reduced);
  if (st >= 0) st = batten_solid_new(ctx, spline, f->carrier, 1, d->count, d->points, d->lower, d->upper, &a->solid);
  if (st >= 0) st = is_reproduced(f, a->solid, &reproduced, &scale);
  if (st >= 0 && reproduced) st = refuse_carrier(ctx, f->carrier, f->opt.spline.m);
  if (st < 0) goto done;
  for (size_t i = 0; i < d->count; i++) {
    least = fmin(least, values[i]);
    most = fmax(most, values[i]);
  }
  /* A carrier that passes through all points gives them equal values: then its own size is the measure. */
  a->value_range = most - least > 1e-6 * scale ? most - least : scale;
done:
  batten_spline_free(spline);
  batten_free(ctx, values);
  return st;
}

/* The check's probes lie a tenth of the spacing off the points: sums are a tenth of that fine. */
static double check_accuracy(const surface_data *d) {
  const double wanted = d->radius > 0 ? 0.01 * d->spacing_median / (2 * d->radius) : 0;
  return fmax(fmin(wanted, 1e-5), 1e-10);
}

static batten_status check_attempt(fit_state *f, attempt *a) {
  double start = batten_now();
  batten_solid_evaluator *e = NULL;
  batten_status st = batten_solid_evaluator_new(f->ctx, a->solid, f->opt.evaluation, check_accuracy(&f->data), &e);
  st = batten_expect(f->ctx, st, BATTEN_W_ACCURACY); /* as good as the sums get: the info tells */
  if (st >= 0)
    st = batten_solid_check_sign(f->ctx, &f->data, f->opt.check_cells, a->data == BATTEN_ORIENT_DATA_AUTO, a->solid,
                                 e, &a->check);
  if (st >= 0) a->evaluation = batten_solid_evaluator_get_info(e);
  batten_solid_evaluator_free(e);
  f->info.time_check_s += batten_now() - start;
  return st;
}

static batten_status fit_oriented(fit_state *f, attempt *a) {
  if (a->data == BATTEN_ORIENT_DATA_GRADIENTS)
    return batten_solid_fit_gradients(f->ctx, &f->data, f->normals, &f->opt, &a->solid, &a->spline, &a->value_range);
  batten_status st = need_carrier(f);
  if (st < 0) return st;
  return batten_solid_fit_pairs(f->ctx, &f->data, f->normals, f->carrier, &f->opt, &a->solid, &a->spline, &a->reduced,
                                &a->value_range);
}

/* ---- smoothing that noise asks for ---------------------------------------------------------------- */

typedef batten_status (*fit_function)(fit_state *f, attempt *a);

typedef struct smoothing_search {
  fit_state *f;
  fit_function fit;
  attempt *last;
} smoothing_search;

static batten_status try_smoothing(batten_context *ctx, void *user, double rho, double *rms) {
  smoothing_search *s = user;
  attempt next = {.data = s->last->data};
  s->f->opt.spline.smoothing = rho;
  batten_status st = s->fit(s->f, &next);
  if (st >= 0)
    st = batten_solid_rms_distance(ctx, next.solid, s->f->data.count, s->f->data.points, s->f->info.noise, rms);
  batten_solid_free(s->last->solid);
  *s->last = next;
  return st;
}

/* rho of the kind of fit from a subset, for all points: see solid_noise.c. */
static batten_status start_smoothing(fit_state *f, fit_function fit, batten_orient_data data, double *rho) {
  fit_state sub = *f;
  attempt last = {.data = data};
  double reached;
  sub.data = (surface_data){0};
  batten_status st = batten_solid_noise_subset(f->ctx, &f->data, &f->opt, f->normals, &sub.data, &sub.normals);
  if (st >= 0) {
    sub.opt.spline.loo_samples = 0;
    st = batten_solid_find_smoothing(f->ctx, f->info.noise, *rho, try_smoothing,
                                     &(smoothing_search){&sub, fit, &last}, rho, &reached);
  }
  if (st >= 0) *rho *= sqrt((double)f->data.count / (double)sub.data.count);
  batten_solid_free(last.solid);
  f->carrier = sub.carrier; /* one that was needed stays */
  batten_surface_data_free(f->ctx, &sub.data);
  return st;
}

/* One fit, or as many as the smoothing takes that opt.noise asks for. */
static batten_status fit_smoothed(fit_state *f, fit_function fit, attempt *a) {
  double rho = 1e-4, reached = 0;
  batten_status st = BATTEN_OK;
  if (f->info.noise == 0) return fit(f, a);
  if (batten_solid_noise_is_large(&f->data)) st = start_smoothing(f, fit, a->data, &rho);
  if (st < 0) return st;
  st = batten_solid_find_smoothing(f->ctx, f->info.noise, rho, try_smoothing, &(smoothing_search){f, fit, a}, &rho,
                                   &reached);
  if (st >= 0 && f->opt.spline.smoothing != rho) /* the last one tried was not the best */
    st = try_smoothing(f->ctx, &(smoothing_search){f, fit, a}, rho, &reached);
  a->smoothing = rho;
  return st;
}

static batten_status try_carrier(fit_state *f, attempt *a) {
  double start = batten_now();
  batten_status st = fit_smoothed(f, fit_with_carrier, a);
  f->info.time_fit_s += batten_now() - start;
  return st < 0 ? st : check_attempt(f, a);
}

static batten_status try_oriented(fit_state *f, batten_orient_data data, attempt *a) {
  double start = batten_now();
  a->data = data;
  batten_status st = fit_smoothed(f, fit_oriented, a);
  f->info.time_fit_s += batten_now() - start;
  return st < 0 ? st : check_attempt(f, a);
}

/* ---- the cure ------------------------------------------------------------------------------------ */

/* Iteration promises a 2-norm, factors every point. */
static bool is_iterative(const batten_spline_info *i) { return i->saddle.method == BATTEN_SADDLE_ITERATIVE; }

static bool is_accurate(const fit_state *f, const attempt *a) {
  const batten_spline_info *i = &a->spline;
  if (f->opt.reduce > 0) return a->reduced.ratio_max <= 1;
  if (is_iterative(i)) return i->saddle.residual_rows <= f->opt.spline.saddle.accuracy;
  return i->residual_max <= RESIDUAL;
}

static bool is_good(const fit_state *f, const attempt *a) { return a->check.clean && is_accurate(f, a); }

static size_t complaints(const batten_sign_check *c) {
  return c->weak_gradients + c->flipped_neighbours + c->phantom_components + c->phantom_cells;
}

static bool is_better(const fit_state *f, const attempt *a, const attempt *b) {
  if (!b->solid || is_good(f, a)) return true;
  if (is_good(f, b)) return false;
  if (a->check.clean != b->check.clean) return a->check.clean;
  size_t of_a = complaints(&a->check), of_b = complaints(&b->check);
  return of_a < of_b || (of_a == of_b && a->spline.residual_max < b->spline.residual_max);
}

/* Errors that end the fit even where another way might be left. */
static bool is_final(batten_status st) {
  return st == BATTEN_E_NOMEM || st == BATTEN_E_CANCELLED || st == BATTEN_E_INTERNAL;
}

/* In one dimension the order of the points says it all: the ends of intervals, in turn. */
static batten_status orient_on_line(fit_state *f) {
  const surface_data *d = &f->data;
  if (d->count % 2 != 0)
    return batten_fail(f->ctx, BATTEN_E_INVALID, "points: %zu distinct ends of intervals; give an even number",
                       d->count);
  for (size_t i = 0; i < d->count; i++) {
    size_t below = 0;
    for (size_t j = 0; j < d->count; j++) below += d->points[j] < d->points[i];
    f->normals[i] = below % 2 ? 1 : -1;
  }
  return BATTEN_OK;
}

static batten_status orient(fit_state *f) {
  const surface_data *d = &f->data;
  if (d->normals && f->opt.orientation != BATTEN_ORIENT_ESTIMATE) {
    f->normals = d->normals;
    f->orientation = BATTEN_ORIENTATION_GIVEN;
    return BATTEN_OK;
  }
  double start = batten_now();
  f->normals = batten_alloc_array(f->ctx, d->count, d->n * sizeof(double));
  if (!f->normals) return BATTEN_E_NOMEM;
  batten_status st =
      d->n == 1 ? orient_on_line(f)
                : batten_orient(f->ctx, d->n, d->count, d->points, f->opt.orient_method, f->opt.energy_points,
                                f->normals, &f->info.orient_method, &f->info.orient_lambda);
  f->info.time_orient_s += batten_now() - start;
  if (st >= 0) f->orientation = BATTEN_ORIENTATION_ESTIMATED;
  return st;
}

/* Gradients for up to so many points: their system is n + 1 times as large. */
enum { GRADIENT_POINTS = 2000 };

/* Fits with orientation; few points also with the other kind of data, when the first is not clean and the caller left
 * the choice. Keeps what has the fewest complaints; a cure that fails leaves the first fit. */
static batten_status cure(fit_state *f) {
  batten_orient_data kinds[2] = {f->opt.orient_data, f->opt.orient_data};
  if (f->opt.orient_data == BATTEN_ORIENT_DATA_AUTO) {
    /* Gradients are held exactly, those estimated from noisy points too: smoothing could not mend them. */
    bool small = ((f->data.count <= GRADIENT_POINTS && f->info.noise == 0) || f->data.n == 1) && f->opt.reduce == 0;
    kinds[0] = small ? BATTEN_ORIENT_DATA_GRADIENTS : BATTEN_ORIENT_DATA_PAIRS;
    kinds[1] = BATTEN_ORIENT_DATA_PAIRS;
  }
  batten_status st = orient(f);
  for (int k = 0; st >= 0 && k < 2; k++) {
    if (is_good(f, &f->best) && f->best.data != BATTEN_ORIENT_DATA_AUTO) break;
    if (k == 1 && kinds[1] == kinds[0]) break;
    attempt next = {0};
    st = try_oriented(f, kinds[k], &next);
    if (st >= 0 && is_better(f, &next, &f->best)) {
      batten_solid_free(f->best.solid);
      f->best = next;
      next.solid = NULL;
    }
    batten_solid_free(next.solid);
    if (st < 0 && k == 0 && kinds[1] != kinds[0] && !is_final(st)) st = BATTEN_OK; /* the other kind may do */
  }
  if (st < 0 && f->best.solid && !is_final(st)) st = BATTEN_OK;
  if (st >= 0 && !f->best.solid) st = BATTEN_E_SINGULAR; /* the text is the last failure's */
  return st;
}

/* ---- the report ---------------------------------------------------------------------------------- */

size_t batten_solid_points_to_sum(const batten_solid *s, size_t count) {
  enum { TERMS = 1000000000, LEAST = 1000 };
  const size_t terms = batten_solid_term_count(s), most = TERMS / (terms ? terms : 1);
  if (count <= most || count <= LEAST) return count;
  return most > LEAST ? most : LEAST;
}

/* f at the points, of which many are evenly drawn: by direct sums, since what is looked for is smaller than fast ones
 * are accurate. */
static batten_status measure_residual(fit_state *f) {
  const surface_data *d = &f->data;
  const size_t n = d->n, count = batten_solid_points_to_sum(f->best.solid, d->count);
  double *values = batten_alloc_array(f->ctx, count, (2 * n + 1) * sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  double *gradients = values + count, *points = gradients + count * n;
  for (size_t q = 0; q < count; q++)
    memcpy(points + q * n, d->points + batten_drawn(q, count, d->count) * n, n * sizeof *points);
  batten_status st = batten_solid_evaluate(f->ctx, f->best.solid, count, points, values, gradients, NULL);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double square = 0;
    for (size_t k = 0; k < n; k++) square += gradients[i * n + k] * gradients[i * n + k];
    const double miss = fabs(values[i]), cut = batten_solid_cut_distance(miss, sqrt(square), f->info.noise);
    f->info.residual_max = fmax(f->info.residual_max, miss / f->best.value_range);
    if (miss != 0) f->info.distance_max = fmax(f->info.distance_max, miss / sqrt(square));
    f->info.distance_rms += cut * cut / (double)count;
  }
  f->info.distance_rms = sqrt(f->info.distance_rms);
  f->info.residual_points = count;
  batten_free(f->ctx, values);
  return st;
}

static batten_status ambiguous(const fit_state *f) {
  const batten_sign_check *c = &f->best.check;
  return batten_fail(
      f->ctx, BATTEN_W_AMBIGUOUS,
      "points: the sign is not settled: of %zu points %zu do not separate inside from outside, %zu pairs "
      "of neighbours contradict each other, %zu pieces of f = 0 without data, %zu cells of f = 0 far "
      "from data; %s",
      f->data.count, c->weak_gradients, c->flipped_neighbours, c->phantom_components, c->phantom_cells,
      f->orientation == BATTEN_ORIENTATION_GIVEN
          ? "check that opt.normals point outwards, or give more points where the surface is open"
          : "give opt.normals, or more points where the surface is thin or open");
}

static batten_status judge_reduced(const fit_state *f) {
  if (is_accurate(f, &f->best)) return BATTEN_OK;
  const batten_spline_reduce_info *r = &f->best.reduced;
  return batten_fail(f->ctx, BATTEN_W_ACCURACY,
                     "points: with %zu centres the surface is up to %.3g away from them, and the worst of all data "
                     "misses %.3g times its tolerance; give a larger opt.reduce = %g, %s",
                     r->centers, r->error_certified, r->ratio_max, f->opt.reduce,
                     f->opt.spline.smoothing > 0 || f->data.smoothing ? "or less smoothing" : "or opt.merge_radius");
}

static batten_status finish(fit_state *f) {
  batten_status st = measure_residual(f);
  if (st < 0) return st;
  batten_solid_info *info = &f->info;
  bool oriented = f->best.data != BATTEN_ORIENT_DATA_AUTO, first_was_left = oriented && f->carrier_tried;
  info->points_given = f->data.given;
  info->points_used = f->data.count;
  info->duplicates_merged = f->data.given - f->data.count;
  info->orientation = oriented ? f->orientation : BATTEN_ORIENTATION_NONE;
  if (info->orientation != BATTEN_ORIENTATION_ESTIMATED) {
    info->orient_method = BATTEN_ORIENT_METHOD_AUTO;
    info->orient_lambda = 0;
  }
  info->orient_data = f->best.data;
  info->check_final = f->best.check;
  info->evaluation = f->best.evaluation;
  info->spline = f->best.spline;
  info->reduced = f->best.reduced;
  info->smoothing = info->noise > 0 ? f->best.smoothing : f->opt.spline.smoothing;
  info->spacing = f->data.spacing_median;
  info->sign = !f->best.check.clean ? BATTEN_SIGN_AMBIGUOUS : first_was_left ? BATTEN_SIGN_CURED : BATTEN_SIGN_CLEAN;
  if (!f->best.check.clean) return ambiguous(f);
  if (f->opt.reduce > 0) return judge_reduced(f);
  /* The saddle solver's tolerance is for its equations; here counts how near f comes to 0, or, where smoothing keeps
   * it away, the spline to what it aims at. */
  double miss = fmin(info->residual_max, info->spline.residual_max);
  if (miss <= RESIDUAL || (is_iterative(&info->spline) && is_accurate(f, &f->best))) return BATTEN_OK;
  if (is_iterative(&info->spline))
    return batten_fail(f->ctx, BATTEN_W_ACCURACY,
                       "points: residual %.3g (2-norm), above opt.spline.saddle.accuracy = %g, and the surface up to "
                       "%.3g away from them; ask for less, or give opt.merge_radius or opt.spline.smoothing",
                       info->spline.saddle.residual_rows, f->opt.spline.saddle.accuracy, info->distance_max);
  return batten_fail(f->ctx, BATTEN_W_ACCURACY,
                     "points: |f| is up to %.3g of the values' range, %g allowed, and the surface up to %.3g away "
                     "from them; give %sopt.merge_radius or opt.spline.smoothing",
                     miss, RESIDUAL, info->distance_max,
                     info->orient_data == BATTEN_ORIENT_DATA_GRADIENTS ? "opt.orient_data pairs, " : "");
}

/* Whether to start from oriented data without asking the carrier. */
static bool orientation_comes_first(const fit_state *f) {
  const batten_solid_options *o = &f->opt;
  if (f->data.n == 1 || o->orientation == BATTEN_ORIENT_GIVEN || o->orientation == BATTEN_ORIENT_ESTIMATE)
    return true;
  if (o->orientation == BATTEN_ORIENT_NEVER) return false;
  /* AUTO: what the carrier cannot do, and nobody asked it to do by name, or normals are there */
  bool reproduced = o->carrier ? kind_is_reproduced(o->carrier, o->spline.m) : o->spline.m >= 3;
  return reproduced && (!o->carrier || f->data.normals);
}

/* Whether the carrier's fit should not be left alone: the check says so, or most points lie in lines (planar cuts,
 * scan lines). Between these the carrier alone makes necks and bridges that no check of sheets far from data can see.
 */
static bool wants_orientation(const fit_state *f) {
  return !f->best.check.clean || 2 * f->data.in_lines > f->data.count;
}

static void release(fit_state *f) {
  if (f->normals != f->data.normals) batten_free(f->ctx, f->normals);
  batten_solid_free(f->best.solid);
  batten_carrier_free(f->carrier);
  batten_surface_data_free(f->ctx, &f->data);
}

/* opt->carrier is const for the caller; sharing it only counts owners. */
static batten_carrier *share(const batten_carrier *c) {
  return batten_carrier_retain((batten_carrier *)(uintptr_t)c);
}

batten_status batten_solid_fit(batten_context *ctx, unsigned n, size_t count, const double *points,
                               const batten_solid_options *opt, batten_solid **out, batten_solid_info *info) {
  fit_state f = {.ctx = ctx, .opt = opt ? *opt : batten_solid_options_default()};
  batten_status st = check_arguments(ctx, n, count, points, out);
  if (st >= 0) st = check_options(ctx, n, &f.opt);
  if (st < 0) return st;
  f.carrier = share(f.opt.carrier);
  double start = batten_now();
  st = batten_surface_data_make(ctx, n, count, points, &f.opt, &f.data);
  f.info.noise = fmax(f.opt.noise, 0);
  if (st >= 0 && f.opt.noise < 0 && n > 1) st = batten_solid_estimate_noise(ctx, &f.data, &f.info.noise);
  f.info.time_data_s = batten_now() - start;
  if (st < 0) goto done;
  if (orientation_comes_first(&f)) {
    st = cure(&f);
    if (st >= 0) f.info.check = f.best.check;
  } else {
    f.carrier_tried = true;
    st = try_carrier(&f, &f.best);
    if (st >= 0) f.info.check = f.best.check;
    if (st >= 0 && f.opt.orientation == BATTEN_ORIENT_AUTO && wants_orientation(&f)) st = cure(&f);
  }
  if (st >= 0) st = finish(&f);
  if (st < 0) goto done;
  *out = f.best.solid;
  f.best.solid = NULL;
  if (info) *info = f.info;
done:
  release(&f);
  return st;
}
