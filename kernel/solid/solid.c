/* A solid: a spline, a carrier and a sign, or a form of another part of the kernel. Making, sharing, evaluating; the
 * fit is in solid_fit.c. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "solid/carrier_inner.h"
#include "solid/differences.h"
#include "solid/solid_inner.h"

/* ---- evaluating ---------------------------------------------------------------------------------- */

/* out = sign (carrier - out) */
static void combine(int sign, size_t count, const double *carrier, double *out) {
  for (size_t i = 0; i < count; i++) out[i] = sign * (carrier[i] - out[i]);
}

static batten_status evaluate_spline(batten_context *ctx, const batten_solid *s, size_t count, const double *points,
                                     double *values, double *gradients, double *hessians) {
  size_t n = s->n, each = (values ? 1 : 0) + (gradients ? n : 0) + (hessians ? n * n : 0);
  /* The carrier goes first, aside: what it says may be an error of the host's. */
  double *aside = batten_alloc_array(ctx, count, each * sizeof *aside), *next = aside;
  if (!aside) return BATTEN_E_NOMEM;
  double *f = values ? next : NULL;
  next += values ? count : 0;
  double *df = gradients ? next : NULL;
  next += gradients ? count * n : 0;
  double *ddf = hessians ? next : NULL;
  batten_status st = batten_carrier_evaluate(ctx, s->carrier, count, points, f, df, ddf);
  if (st >= 0) st = batten_spline_evaluate(ctx, s->spline, count, points, values, gradients, hessians);
  if (st >= 0 && f) combine(s->sign, count, f, values);
  if (st >= 0 && df) combine(s->sign, count * n, df, gradients);
  if (st >= 0 && ddf) combine(s->sign, count * n * n, ddf, hessians);
  batten_free(ctx, aside);
  return st;
}

/* Hessians of a form that has none, by differences of gradients: block by block, so that memory stays small. */
static batten_status differ(batten_context *ctx, const batten_solid *s, size_t count, const double *points,
                            double *hessians) {
  enum { BLOCK = 1024, AROUND = 6 }; /* points about one: two along each axis */
  size_t n = s->n;
  double square = 0;
  for (size_t k = 0; k < n; k++) square += (s->upper[k] - s->lower[k]) * (s->upper[k] - s->lower[k]);
  /* 1e-5 balances the error of the difference, h^2, and of rounding, 1e-16 / h. */
  double h = 1e-5 * (square > 0 ? sqrt(square) : 1);
  double *at = batten_alloc_array(ctx, BLOCK * AROUND, 2 * n * sizeof *at);
  if (!at) return BATTEN_E_NOMEM;
  double *g = at + BLOCK * AROUND * n;
  batten_status st = BATTEN_OK;
  for (size_t first = 0; st >= 0 && first < count; first += BLOCK) {
    size_t now = count - first < BLOCK ? count - first : BLOCK, each = 2 * n;
    for (size_t i = 0; i < now; i++)
      batten_difference_points(s->n, points + (first + i) * n, h, false, at + i * each * n);
    st = s->form->evaluate(s->state, ctx, now * each, at, NULL, g, NULL);
    for (size_t i = 0; st >= 0 && i < now; i++)
      batten_differences_of_gradients(s->n, h, g + i * each * n, hessians + (first + i) * n * n);
  }
  batten_free(ctx, at);
  return st;
}

static batten_status evaluate_form(batten_context *ctx, const batten_solid *s, size_t count, const double *points,
                                   double *values, double *gradients, double *hessians) {
  bool direct = s->form->order >= 2;
  batten_status st = BATTEN_OK;
  if (values || gradients || direct)
    st = s->form->evaluate(s->state, ctx, count, points, values, gradients, direct ? hessians : NULL);
  if (st >= 0 && hessians && !direct) st = differ(ctx, s, count, points, hessians);
  return st;
}

batten_status batten_solid_evaluate(batten_context *ctx, const batten_solid *s, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  if (!s) return batten_fail(ctx, BATTEN_E_INVALID, "solid: NULL; give a solid");
  if (count == 0) return BATTEN_OK;
  size_t n = s->n, bytes, each = (values ? 1 : 0) + (gradients ? n : 0) + (hessians ? n * n : 0);
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][%u] numbers", count, s->n);
  if (each == 0) return BATTEN_OK;
  if (!batten_mul3(count, each, sizeof(double), &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; too many", count);
  return (s->form ? evaluate_form : evaluate_spline)(ctx, s, count, points, values, gradients, hessians);
}

static batten_status evaluate_field(const void *user, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients, double *hessians) {
  return batten_solid_evaluate(ctx, user, count, points, values, gradients, hessians);
}

static batten_status bounds_of_field(const void *user, batten_context *ctx, size_t count, const double *boxes,
                                     double *ranges) {
  return batten_solid_bounds(ctx, user, count, boxes, ranges);
}

batten_field batten_solid_field(const batten_solid *s) {
  return (batten_field){
      .dimension = s->n, .order = 2, .evaluate = evaluate_field, .user = s, .bounds = bounds_of_field};
}

/* ---- making -------------------------------------------------------------------------------------- */

/* A solid with its box and points, and nothing else yet. */
static batten_status make(batten_context *ctx, unsigned n, const double *lower, const double *upper, size_t count,
                          const double *points, batten_solid **out) {
  batten_solid *s = batten_alloc(ctx, sizeof *s);
  double *copy = batten_alloc_array(ctx, count, n * sizeof *copy);
  if (!s || !copy) {
    batten_free(ctx, s);
    batten_free(ctx, copy);
    return BATTEN_E_NOMEM;
  }
  memcpy(copy, points, count * n * sizeof *copy);
  *s = (batten_solid){.ctx = ctx, .n = n, .sign = 1, .count = count, .points = copy};
  atomic_init(&s->owners, 1);
  memcpy(s->lower, lower, n * sizeof *lower);
  memcpy(s->upper, upper, n * sizeof *upper);
  *out = s;
  return BATTEN_OK;
}

batten_status batten_solid_new(batten_context *ctx, batten_spline *spline, batten_carrier *carrier, int sign,
                               size_t count, const double *points, const double *lower, const double *upper,
                               batten_solid **out) {
  batten_spline_parts parts;
  batten_spline_get_parts(spline, &parts);
  batten_solid *s = NULL;
  batten_status st = make(ctx, parts.n, lower, upper, count, points, &s);
  if (st < 0) return st;
  s->sign = sign;
  s->spline = batten_spline_retain(spline);
  s->carrier = batten_carrier_retain(carrier);
  s->depth = carrier->depth;
  *out = s;
  return BATTEN_OK;
}

batten_status batten_solid_make(batten_context *ctx, const solid_form *form, void *state, unsigned n, unsigned depth,
                                const double *lower, const double *upper, size_t count, const double *points,
                                batten_solid **out) {
  batten_solid *s = NULL;
  batten_status st = make(ctx, n, lower, upper, count, points, &s);
  if (st < 0) return st;
  s->form = form;
  s->state = state;
  s->depth = depth;
  *out = s;
  return BATTEN_OK;
}

/* Keeps the centres at which f vanishes, in place: the others are points off the surface. A smoothed spline misses
 * its data, so that too few vanish: then every centre stays. */
static size_t keep_surface_points(unsigned n, size_t count, const double *f, const double *u, double *points) {
  double largest = 0;
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) largest = fmax(largest, fmax(fabs(f[i]), fabs(u[i])));
  /* 1e-6: far above the residual of a fit, far below a pair's distance */
  for (size_t i = 0; i < count; i++) kept += fabs(f[i]) <= 1e-6 * largest;
  if (kept == 0 || kept < count / 4) return count; /* a third are on the surface when every point has a pair */
  kept = 0;
  for (size_t i = 0; i < count; i++)
    if (fabs(f[i]) <= 1e-6 * largest) memmove(points + kept++ * n, points + i * n, n * sizeof *points);
  return kept;
}

/* The points of a solid of which only the centres are known. Fast sums of the default 1e-7 tell f = 0 to 1e-6 as
 * well; where they do not come so near, the sums are direct, however many. */
static batten_status guess_points(batten_context *ctx, batten_solid *s) {
  const size_t count = s->count;
  const bool few = batten_solid_points_to_sum(s, count) == count;
  batten_solid_evaluator *e = NULL;
  double *f = batten_alloc_array(ctx, count, 2 * sizeof *f), *u = f ? f + count : NULL;
  if (!f) return BATTEN_E_NOMEM;
  batten_status st = batten_solid_evaluator_new(ctx, s, few ? BATTEN_EVALUATE_DIRECT : BATTEN_EVALUATE_AUTO, 0, &e);
  if (st == BATTEN_W_ACCURACY) {
    batten_solid_evaluator_free(e);
    st = batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_DIRECT, 0, &e);
  }
  if (st >= 0) st = batten_carrier_evaluate(ctx, s->carrier, count, s->points, u, NULL, NULL);
  if (st >= 0) st = batten_solid_evaluator_evaluate(ctx, e, count, s->points, f, NULL);
  for (size_t i = 0; st >= 0 && i < count; i++) u[i] -= s->sign * f[i]; /* f = sign (f_c - U) */
  batten_solid_evaluator_free(e);
  if (st >= 0) s->count = keep_surface_points(s->n, count, f, u, s->points);
  batten_free(ctx, f);
  return st;
}

static batten_status check_parts(batten_context *ctx, const batten_spline_parts *parts, const batten_carrier *carrier,
                                 int sign, const double *lower, const double *upper, size_t point_count,
                                 const double *points) {
  unsigned n = parts->n, of_carrier = batten_carrier_field(carrier).dimension;
  size_t bytes;
  if (sign != 1 && sign != -1) return batten_fail(ctx, BATTEN_E_INVALID, "sign: %d; give 1 or -1", sign);
  if (!lower || !upper)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give the box", lower ? "upper" : "lower");
  if (of_carrier != n)
    return batten_fail(ctx, BATTEN_E_INVALID, "carrier: of dimension %u, the spline's is %u", of_carrier, n);
  for (unsigned i = 0; i < n; i++)
    if (!isfinite(lower[i]) || !isfinite(upper[i]) || lower[i] > upper[i])
      return batten_fail(ctx, BATTEN_E_INVALID, "lower[%u], upper[%u]: %g, %g; give finite bounds in order", i, i,
                         lower[i], upper[i]);
  if (!points) return BATTEN_OK;
  if (point_count == 0)
    return batten_fail(ctx, BATTEN_E_INVALID, "point_count: 0; give points on the surface, or NULL for the centres");
  if (!batten_mul3(point_count, n, sizeof(double), &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "point_count: %zu; too many", point_count);
  size_t bad = batten_first_nonfinite(point_count * n, points);
  if (bad < point_count * n)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu]: coordinate %zu is %g; remove the point", bad / n, bad % n,
                       points[bad]);
  return BATTEN_OK;
}

batten_status batten_solid_create(batten_context *ctx, batten_spline *spline, batten_carrier *carrier, int sign,
                                  const double *lower, const double *upper, size_t point_count, const double *points,
                                  batten_solid **out) {
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the solid");
  if (!spline || !carrier)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give one", spline ? "carrier" : "spline");
  batten_solid *s = NULL;
  batten_spline_parts parts;
  batten_spline_get_parts(spline, &parts);
  batten_status st = check_parts(ctx, &parts, carrier, sign, lower, upper, point_count, points);
  if (st >= 0)
    st = batten_solid_new(ctx, spline, carrier, sign, points ? point_count : parts.count,
                          points ? points : parts.centers, lower, upper, &s);
  if (st >= 0 && !points) st = guess_points(ctx, s);
  if (st < 0) {
    batten_solid_free(s);
    return st;
  }
  *out = s;
  return BATTEN_OK;
}

/* ---- another carrier ----------------------------------------------------------------------------- */

enum { NEWTON_STEPS = 20 };

/* Moves the points of s onto f = 0 by Newton steps along the gradient, none longer than step_max; ends when no point
 * moves any more, to rounding. */
static batten_status pull_to_surface(batten_context *ctx, batten_solid *s, double step_max) {
  unsigned n = s->n;
  double *points = s->points, longest = INFINITY;
  batten_solid_evaluator *e = NULL;
  double *f = batten_alloc_array(ctx, s->count, sizeof *f), *df = batten_alloc_array(ctx, s->count, n * sizeof *df);
  batten_status st = f && df ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_solid_evaluator_new(ctx, s, BATTEN_EVALUATE_AUTO, 0, &e);
  st = batten_expect(ctx, st, BATTEN_W_ACCURACY); /* they are seeds: as near as the sums get */
  for (unsigned round = 0; st >= 0 && round < NEWTON_STEPS && longest > 1e-12 * step_max; round++) {
    st = batten_solid_evaluator_evaluate(ctx, e, s->count, points, f, df);
    longest = 0;
    for (size_t i = 0; st >= 0 && i < s->count; i++) {
      double square = 0;
      for (unsigned k = 0; k < n; k++) square += df[i * n + k] * df[i * n + k];
      double length = sqrt(square), step = fabs(f[i]) / length;
      if (!(step > 0) || !isfinite(step)) continue; /* there already, or no way known */
      longest = fmax(longest, step);
      double scale = fmin(1, step_max / step) * f[i] / square;
      for (unsigned k = 0; k < n; k++) points[i * n + k] -= scale * df[i * n + k];
    }
  }
  batten_solid_evaluator_free(e);
  batten_free(ctx, f);
  batten_free(ctx, df);
  return st;
}

static void box_of(unsigned n, size_t count, const double *points, double *lower, double *upper) {
  for (unsigned k = 0; k < n; k++) {
    lower[k] = INFINITY;
    upper[k] = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lower[k] = fmin(lower[k], points[i * n + k]);
      upper[k] = fmax(upper[k], points[i * n + k]);
    }
  }
}

batten_status batten_solid_with_carrier(batten_context *ctx, const batten_solid *solid, batten_carrier *carrier,
                                        batten_solid **out) {
  if (!out) return batten_fail(ctx, BATTEN_E_INVALID, "out: NULL; give the place for the solid");
  if (!solid || !carrier)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give one", solid ? "carrier" : "solid");
  unsigned of_carrier = batten_carrier_field(carrier).dimension;
  if (of_carrier != solid->n)
    return batten_fail(ctx, BATTEN_E_INVALID, "carrier: of dimension %u, the solid's is %u", of_carrier, solid->n);
  if (solid->form)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "solid: of %s, it has no carrier; give a solid that was fitted to surface points",
                       solid->form->kind == BATTEN_SOLID_STACK ? "sections" : "other solids");
  batten_solid *s = NULL;
  batten_status st = batten_solid_new(ctx, solid->spline, carrier, solid->sign, solid->count, solid->points,
                                      solid->lower, solid->upper, &s);
  if (st < 0) return st;
  double diagonal = 0;
  for (unsigned k = 0; k < s->n; k++) diagonal += (s->upper[k] - s->lower[k]) * (s->upper[k] - s->lower[k]);
  /* A tenth of the diagonal: a step that stays on its side of the solid. */
  st = pull_to_surface(ctx, s, 0.1 * sqrt(diagonal));
  if (st < 0) {
    batten_solid_free(s);
    return st;
  }
  box_of(s->n, s->count, s->points, s->lower, s->upper);
  *out = s;
  return BATTEN_OK;
}

/* ---- sharing and looking ------------------------------------------------------------------------- */

batten_solid *batten_solid_retain(batten_solid *s) {
  if (s) atomic_fetch_add(&s->owners, 1);
  return s;
}

void batten_solid_free(batten_solid *s) {
  if (!s || atomic_fetch_sub(&s->owners, 1) != 1) return;
  if (s->form) s->form->release(s->state);
  batten_spline_free(s->spline);
  batten_carrier_free(s->carrier);
  batten_free(s->ctx, s->points);
  batten_free(s->ctx, s);
}

unsigned batten_solid_dimension(const batten_solid *s) { return s->n; }
batten_solid_kind batten_solid_kind_of(const batten_solid *s) {
  return s->form ? s->form->kind : BATTEN_SOLID_SPLINE;
}
batten_spline *batten_solid_spline(const batten_solid *s) { return s->spline; }
batten_carrier *batten_solid_carrier(const batten_solid *s) { return s->carrier; }
int batten_solid_sign(const batten_solid *s) { return s->sign; }
void *batten_solid_state(const batten_solid *s, const solid_form *form) { return s->form == form ? s->state : NULL; }
unsigned batten_solid_depth(const batten_solid *s) { return s->depth; }

void batten_solid_box(const batten_solid *s, double *lower, double *upper) {
  memcpy(lower, s->lower, s->n * sizeof *lower);
  memcpy(upper, s->upper, s->n * sizeof *upper);
}

const double *batten_solid_points(const batten_solid *s, size_t *count) {
  *count = s->count;
  return s->points;
}
