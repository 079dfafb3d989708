/* Points, derivatives and curvatures at parameters of a curve.
 *
 * Control points are differenced first and then go through the triangle of de Boor: far from the origin derivatives
 * lose nothing. For curvatures they are taken by a parameter and in a unit in which span and curve have a size of
 * about 1, by powers of two: neither tiny nor huge units or domains overflow. */
#include "curve_inner.h"

#include "base/checked.h"
#include "basis/refine.h"

#include <stdio.h>
#include <string.h>

enum { PARAMETERS = 512 }; /* a task: about 100 us */

/* ---- jets ---------------------------------------------------------------------------------------- */

/* Derivatives by unit[0] t of unit[1] times the curve; the point itself as it is. */
static void jet_in_units(const bspline *space, const double *points, size_t mu, double t, unsigned order,
                         const double unit[2], double (*jet)[2]) {
  unsigned d = space->degree;
  const double *knots = space->knots + mu; /* the span is knots[0 .. 1] */
  double control[BSPLINE_ORDER][2], work[BSPLINE_ORDER][2];
  memcpy(control, points + 2 * (mu - d), (d + 1) * sizeof *control);
  for (unsigned k = 0; k <= order; k++) {
    if (k > d) {
      jet[k][0] = jet[k][1] = 0;
      continue;
    }
    /* Control points 0 .. left of the k-th derivative. */
    unsigned left = d - k;
    for (unsigned i = 0; i <= left && k > 0; i++) {
      double width = (knots[i + 1] - *(knots + i - left)) * unit[0], own = k == 1 ? unit[1] : 1;
      for (unsigned x = 0; x < 2; x++)
        control[i][x] = (left + 1) * ((control[i + 1][x] - control[i][x]) * own) / width;
    }
    memcpy(work, control, (left + 1) * sizeof *work);
    for (unsigned round = 1; round <= left; round++)
      for (unsigned i = 0; i + round <= left; i++) {
        double start = *(knots + i + round - left), part = (t - start) / (knots[i + 1] - start);
        for (unsigned x = 0; x < 2; x++) work[i][x] = bspline_blend(work[i][x], work[i + 1][x], part);
      }
    memcpy(jet[k], work[0], sizeof *jet);
  }
}

void curve_jet(const bspline *space, const double *points, size_t mu, double t, unsigned order, double (*jet)[2]) {
  jet_in_units(space, points, mu, t, order, (const double[2]){1, 1}, jet);
}

/* The exponent that brings the span to about 1, as far as that keeps the whole domain within range. */
static int span_exponent(const bspline *b, size_t mu) {
  int own = -ilogb(b->knots[mu + 1] - b->knots[mu]), most = 1000 - ilogb(bspline_upper(b) - bspline_lower(b));
  int e = own < most ? own : most;
  return e < -1022 ? -1022 : e > 1023 ? 1023 : e;
}

int curve_jet_scaled(const batten_curve *curve, size_t mu, double t, unsigned order, double (*jet)[2]) {
  int exponent = span_exponent(&curve->space, mu);
  const double unit[2] = {ldexp(1, exponent), ldexp(1, curve->exponent)};
  jet_in_units(&curve->space, curve->control_points, mu, t, order, unit, jet);
  return exponent;
}

/* ---- a point ------------------------------------------------------------------------------------- */

double curve_tangent(const batten_curve *curve, size_t mu, int exponent, const double first[2], double tangent[2]) {
  const bspline *b = &curve->space;
  unsigned d = b->degree;
  const double *p = curve->control_points + 2 * (mu - d);
  double speed = hypot(first[0], first[1]), most = 0, unit = ldexp(1, curve->exponent);
  for (unsigned i = 0; i < d; i++, p += 2) {
    double width = ldexp(b->knots[mu + i + 1] - b->knots[mu + i + 1 - d], exponent);
    most = fmax(most, d * fmax(fabs(p[2] - p[0]), fabs(p[3] - p[1])) * unit / width);
  }
  /* Each round of the triangle errs by two roundings of the largest control point at most. */
  if (!(speed > 4 * d * 0x1p-53 * most)) {
    tangent[0] = tangent[1] = 0;
    return 0;
  }
  tangent[0] = first[0] / speed;
  tangent[1] = first[1] / speed;
  return speed;
}

double curve_curvature(const double tangent[2], double speed, const double second[2]) {
  return (tangent[0] * second[1] - tangent[1] * second[0]) / speed / speed;
}

/* out = from 2^exponent, also where that power is no double. */
static void shift(const double from[2], int exponent, double out[2]) {
  for (int d = 0; d < 2; d++) out[d] = ldexp(from[d], exponent);
}

static void make_point(const batten_curve *curve, double t, batten_curve_point *out) {
  double jet[3][2];
  t = curve_wrap(curve, t);
  size_t mu = bspline_span(&curve->space, t);
  int exponent = curve_jet_scaled(curve, mu, t, 2, jet);
  double speed = curve_tangent(curve, mu, exponent, jet[1], out->tangent);
  memcpy(out->point, jet[0], sizeof jet[0]);
  shift(jet[1], exponent - curve->exponent, out->first);
  shift(jet[2], 2 * exponent - curve->exponent, out->second);
  out->curvature = speed > 0 ? ldexp(curve_curvature(out->tangent, speed, jet[2]), curve->exponent) : NAN;
}

double curve_wrap(const batten_curve *curve, double t) {
  double lower = bspline_lower(&curve->space), upper = bspline_upper(&curve->space), period = upper - lower;
  if (!curve->closed || (t >= lower && t <= upper)) return t;
  double rest = t - lower;
  /* Halves, where the difference is beyond a double. */
  rest = isfinite(rest) ? fmod(rest, period) : 2 * fmod(0.5 * t - 0.5 * lower, 0.5 * period);
  if (rest < 0) rest += period;
  t = lower + rest;
  return t < upper ? t : upper;
}

/* ---- public calls -------------------------------------------------------------------------------- */

batten_status curve_check_parameter(batten_context *ctx, const batten_curve *curve, const char *name, size_t index,
                                    double t) {
  double lower = bspline_lower(&curve->space), upper = bspline_upper(&curve->space);
  if (curve->closed ? isfinite(t) : t >= lower && t <= upper) return BATTEN_OK;
  char where[32] = "";
  if (index != SIZE_MAX) snprintf(where, sizeof where, "[%zu]", index);
  if (curve->closed) return batten_fail(ctx, BATTEN_E_INVALID, "%s%s: %g; give a finite one", name, where, t);
  return batten_fail(ctx, BATTEN_E_INVALID, "%s%s: %.17g; give one from %.17g to %.17g", name, where, t, lower,
                     upper);
}

typedef struct job {
  const batten_curve *curve;
  size_t count;
  const double *parameters;
  batten_curve_point *points;
  unsigned order; /* of derivatives */
  double *derivatives;
} job;

static void evaluate_some(void *arg, size_t index) {
  const job *j = arg;
  size_t from = index * PARAMETERS, to = from + PARAMETERS < j->count ? from + PARAMETERS : j->count;
  for (size_t i = from; i < to; i++) make_point(j->curve, j->parameters[i], &j->points[i]);
}

/* Derivatives in the caller's units. */
static void derivatives_some(void *arg, size_t index) {
  const job *j = arg;
  const bspline *b = &j->curve->space;
  size_t from = index * PARAMETERS, to = from + PARAMETERS < j->count ? from + PARAMETERS : j->count;
  unsigned top = j->order < b->degree ? j->order : b->degree;
  for (size_t i = from; i < to; i++) {
    double t = curve_wrap(j->curve, j->parameters[i]), jet[BSPLINE_ORDER][2];
    double *out = j->derivatives + i * 2 * ((size_t)j->order + 1);
    int exponent = curve_jet_scaled(j->curve, bspline_span(b, t), t, top, jet);
    memset(out, 0, 2 * ((size_t)j->order + 1) * sizeof *out);
    memcpy(out, jet[0], sizeof jet[0]);
    for (unsigned k = 1; k <= top; k++) shift(jet[k], (int)k * exponent - j->curve->exponent, out + 2 * (size_t)k);
  }
}

/* What both calls ask of their arguments. */
static batten_status check(batten_context *ctx, const batten_curve *curve, size_t count, const double *parameters,
                           const void *out) {
  if (!curve) return batten_fail(ctx, BATTEN_E_INVALID, "curve: NULL; give a curve");
  if (count && (!parameters || !out))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give %zu parameters and room for what is there",
                       parameters ? "out" : "parameters", count);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st >= 0; i++)
    st = curve_check_parameter(ctx, curve, "parameters", i, parameters[i]);
  return st;
}

static void run(batten_context *ctx, const job *j, void (*task)(void *arg, size_t index)) {
  batten_parallel(ctx, j->count / PARAMETERS + (j->count % PARAMETERS > 0), task, (void *)j);
}

batten_status batten_curve_evaluate(batten_context *ctx, const batten_curve *curve, size_t count,
                                    const double *parameters, batten_curve_point *out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, curve, count, parameters, out);
  job j = {.curve = curve, .count = count, .parameters = parameters, .points = out};
  if (st >= 0) run(ctx, &j, evaluate_some);
  return st;
}

batten_status batten_curve_derivatives(batten_context *ctx, const batten_curve *curve, unsigned order, size_t count,
                                       const double *parameters, double *out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check(ctx, curve, count, parameters, out);
  job j = {.curve = curve, .count = count, .parameters = parameters, .order = order, .derivatives = out};
  if (st >= 0) run(ctx, &j, derivatives_some);
  return st;
}
