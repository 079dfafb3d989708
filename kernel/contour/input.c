/* Points, weights and parameters as the fit wants them: what makes no sense is refused, the rest is moved and scaled
 * to size 1 by powers of two. */
#include "contour_inner.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"

enum { COUNT_MIN = 3 };

static batten_status check_weights(batten_context *ctx, size_t count, const double *weights) {
  double largest = 0;
  for (size_t i = 0; i < count; i++) {
    if (!(weights[i] >= 0 && weights[i] < INFINITY))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.weights[%zu]: %g; must be finite and 0 or more", i, weights[i]);
    largest = fmax(largest, weights[i]);
  }
  return largest > 0 ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "opt.weights: all 0; give some point a weight");
}

static batten_status check_points(batten_context *ctx, size_t count, const double *points) {
  size_t numbers;
  if (count < COUNT_MIN)
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu points; a curve that bends needs %d at least", count,
                       COUNT_MIN);
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][2] numbers", count);
  if (!batten_mul(count, 2 * sizeof(double), &numbers) || count > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points; give %zu at most", count, (size_t)UINT32_MAX);
  size_t bad = batten_first_nonfinite(2 * count, points);
  if (bad < 2 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite points", bad / 2, bad % 2,
                       points[bad]);
  for (size_t i = 0; i < 2 * count; i++)
    if (fabs(points[i]) > 0x1p1000)
      return batten_fail(ctx, BATTEN_E_TOO_LARGE, "points[%zu][%zu]: %g; scale the points below 1e300", i / 2, i % 2,
                         points[i]);
  return BATTEN_OK;
}

static batten_status check_parameters(batten_context *ctx, size_t count, const double *t, const double domain[2]) {
  for (size_t i = 0; i < count; i++) {
    if (!(t[i] >= domain[0] && t[i] <= domain[1]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.parameters[%zu]: %.17g is outside the domain, %.17g to %.17g", i,
                         t[i], domain[0], domain[1]);
    if (i > 0 && t[i] < t[i - 1])
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.parameters[%zu]: %.17g is below the one before, %.17g; give the points in order", i,
                         t[i], t[i - 1]);
  }
  if (!(t[0] < t[count - 1]))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.parameters: all are %.17g; give points different ones", t[0]);
  return BATTEN_OK;
}

/* The domain that the caller sees. */
static batten_status find_domain(batten_context *ctx, size_t count, const batten_contour_options *o,
                                 double domain[2]) {
  bool none = isnan(o->domain[0]) && isnan(o->domain[1]);
  const double *t = o->parameters;
  if (none && t && o->closed)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.domain: NaN; closed curves with given parameters need it: opt.domain[1] is where the "
                       "first point comes again");
  domain[0] = !none ? o->domain[0] : t ? t[0] : 0;
  domain[1] = !none ? o->domain[1] : t ? t[count - 1] : 1;
  if (!(domain[0] < domain[1]) || !isfinite(domain[1] - domain[0]))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: from %g to %g; give finite bounds, the lower first",
                       none ? "parameters" : "domain", domain[0], domain[1]);
  return t ? check_parameters(ctx, count, t, domain) : BATTEN_OK;
}

static bool counts(const contour_input *in, size_t i) { return !in->weights || in->weights[i] > 0; }

/* To the size of the points that count. Others may lie anywhere, yet squares of their distances stay finite. */
static void scale_points(contour_input *in, const double *points) {
  static const double FAR = 0x1p400;
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY}, size = 0;
  for (size_t i = 0; i < 2 * in->count; i++) {
    if (!counts(in, i / 2)) continue;
    lower[i % 2] = fmin(lower[i % 2], points[i]);
    upper[i % 2] = fmax(upper[i % 2], points[i]);
  }
  for (int k = 0; k < 2; k++) {
    in->middle[k] = lower[k] + (upper[k] - lower[k]) / 2;
    size = fmax(size, upper[k] - lower[k]);
  }
  in->unit = size > 0 ? batten_unit(size) : 1;
  for (size_t i = 0; i < 2 * in->count; i++)
    in->points[i] = fmax(-FAR, fmin(FAR, (points[i] - in->middle[i % 2]) * in->unit));
}

static void scale_weights(contour_input *in, const double *weights) {
  double largest = 0;
  in->weight_unit = 1;
  in->total = (double)in->count;
  if (!weights) return;
  for (size_t i = 0; i < in->count; i++) largest = fmax(largest, weights[i]);
  if (largest > 0) in->weight_unit = batten_unit(largest);
  in->total = 0;
  for (size_t i = 0; i < in->count; i++) in->total += in->weights[i] = weights[i] * in->weight_unit;
}

/* Whether the points that count lie on a line, to rounding of their coordinates. */
static bool on_line(const contour_input *in) {
  size_t first = 0, far = 0;
  double most = 0, off = 0, reach = 1;
  while (!counts(in, first)) first++;
  const double *p = in->points + 2 * first;
  for (int pass = 0; pass < 2; pass++)
    for (size_t i = first; i < in->count; i++) {
      const double *q = in->points + 2 * i, v[2] = {q[0] - p[0], q[1] - p[1]};
      const double line[2] = {in->points[2 * far] - p[0], in->points[2 * far + 1] - p[1]};
      double length = hypot(v[0], v[1]);
      if (!counts(in, i)) continue;
      if (pass == 0 && length > most) {
        most = length;
        far = i;
      } else if (pass == 1 && most > 0) {
        off = fmax(off, fabs(contour_cross(line, v)) / most);
      }
    }
  for (int k = 0; k < 2; k++) reach = fmax(reach, fabs(in->middle[k]) * in->unit);
  return off <= 64 * DBL_EPSILON * reach;
}

/* Parameters of points that count; others, which may be outliers, take that of the one before. */
static batten_status estimate(batten_context *ctx, contour_input *in, const batten_contour_options *o) {
  if (!in->weights)
    return batten_contour_parametrize(ctx, in->count, in->points, o->parametrization, o->closed, in->parameters);
  size_t counted = 0;
  double *points = batten_alloc_array(ctx, in->count, 3 * sizeof *points);
  if (!points) return BATTEN_E_NOMEM;
  double *parameters = points + 2 * in->count;
  for (size_t i = 0; i < in->count; i++)
    if (counts(in, i)) memcpy(points + 2 * counted++, in->points + 2 * i, 2 * sizeof *points);
  batten_status st = batten_contour_parametrize(ctx, counted, points, o->parametrization, o->closed, parameters);
  for (size_t i = 0, k = 0; i < in->count && st >= 0; i++) {
    if (counts(in, i)) k++;
    in->parameters[i] = parameters[k ? k - 1 : 0];
  }
  batten_free(ctx, points);
  return st;
}

static batten_status fill(batten_context *ctx, contour_input *in, const double *points,
                          const batten_contour_options *o) {
  in->points = batten_alloc_array(ctx, in->count, 2 * sizeof(double));
  in->parameters = batten_alloc_array(ctx, in->count, sizeof(double));
  if (o->weights) in->weights = batten_alloc_array(ctx, in->count, sizeof(double));
  if (!in->points || !in->parameters || (o->weights && !in->weights)) return BATTEN_E_NOMEM;
  scale_weights(in, o->weights);
  if (!(in->total > 0))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.weights: all 0 but of the repeated first point; give others one");
  scale_points(in, points);
  if (on_line(in)) {
    size_t counted = 0;
    for (size_t i = 0; i < in->count; i++) counted += counts(in, i);
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "points: all %zu%s are one point or lie on a line, to rounding; a curve that bends needs others "
        "beside it",
        counted, o->weights ? " of positive weight" : "");
  }
  double begin = in->domain[0], width = in->domain[1] - in->domain[0];
  for (size_t i = 0; i < in->count && o->parameters; i++)
    in->parameters[i] = fmin(1, (o->parameters[i] - begin) / width);
  return o->parameters ? BATTEN_OK : estimate(ctx, in, o);
}

batten_status contour_input_make(batten_context *ctx, size_t count, const double *points,
                                 const batten_contour_options *opt, contour_input *out) {
  contour_input in = {.count = count};
  batten_status st = check_points(ctx, count, points);
  if (st >= 0 && opt->weights) st = check_weights(ctx, count, opt->weights);
  if (st >= 0) st = find_domain(ctx, count, opt, in.domain);
  if (st >= 0) st = contour_breaks_check(ctx, opt, in.domain);
  if (st < 0) return st;
  in.repeated = opt->closed && points[0] == points[2 * count - 2] && points[1] == points[2 * count - 1];
  if (in.repeated) in.count--;
  st = fill(ctx, &in, points, opt);
  if (st < 0)
    contour_input_free(ctx, &in);
  else
    *out = in;
  return st;
}

void contour_input_free(batten_context *ctx, contour_input *in) {
  batten_free(ctx, in->weights);
  batten_free(ctx, in->parameters);
  batten_free(ctx, in->points);
  *in = (contour_input){0};
}
