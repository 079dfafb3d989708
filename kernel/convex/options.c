/* Options of batten_convex_fit: defaults and ranges, and data that cannot be fitted. */
#include "fit_inner.h"

#include "base/checked.h"
#include "basis/eigen3.h"
#include "mesh/vec.h"

enum { DEGREE_MAX = 7, SPANS_MAX = 16, PASSES_MAX = 100, COUNT_MIN = 6, DIRECTIONS_MAX = 16, DEPTH_MAX = 10 };

batten_convex_options batten_convex_options_default(void) {
  return (batten_convex_options){.struct_size = sizeof(batten_convex_options),
                                 .degree = {3, 3},
                                 .spans = {1, 1},
                                 .domain = {{0, 1}, {0, 1}},
                                 .parametrize = batten_parametrize_options_default(),
                                 .rounds = 10,
                                 .rounds_tol = 1e-3,
                                 .correction_passes = 3,
                                 .tension = 1e-6,
                                 .blend = 0.1,
                                 .margin = 1e-3,
                                 .directions = 4,
                                 .row_share = 0.15,
                                 .depth_max = 6,
                                 .row_limit = 500000};
}

static batten_status check_space(batten_context *ctx, const batten_convex_options *o) {
  for (int k = 0; k < 2; k++) {
    if (o->degree[k] < 2 || o->degree[k] > DEGREE_MAX)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.degree[%d]: %u; must be 2 .. %d", k, o->degree[k], DEGREE_MAX);
    if (o->spans[k] < 1 || o->spans[k] > SPANS_MAX)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.spans[%d]: %u; must be 1 .. %d", k, o->spans[k], SPANS_MAX);
    if (o->smoothness[k] >= o->degree[k])
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.smoothness[%d]: %u; must be 1 .. %u for degree %u, or 0 for the most", k,
                         o->smoothness[k], o->degree[k] - 1, o->degree[k]);
  }
  return BATTEN_OK;
}

static batten_status check_counts(batten_context *ctx, const batten_convex_options *o) {
  const struct {
    const char *name;
    unsigned value, least, most;
  } counts[] = {
      {"rounds", o->rounds, 1, BATTEN_CONVEX_ROUNDS_MAX},
      {"correction_passes", o->correction_passes, 0, PASSES_MAX},
      {"directions", o->directions, 3, DIRECTIONS_MAX},
      {"depth_max", o->depth_max, 0, DEPTH_MAX},
  };
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (counts[i].value < counts[i].least || counts[i].value > counts[i].most)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %u; must be %u .. %u", counts[i].name, counts[i].value,
                         counts[i].least, counts[i].most);
  if (o->row_limit < 1) return batten_fail(ctx, BATTEN_E_INVALID, "opt.row_limit: 0; must be 1 or more");
  return BATTEN_OK;
}

static batten_status check_numbers(batten_context *ctx, const batten_convex_options *o) {
  const struct {
    const char *name;
    double value;
  } parts[] = {{"blend", o->blend}, {"margin", o->margin}, {"row_share", o->row_share}};
  for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
    if (!(parts[i].value > 0 && parts[i].value < 1))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.%s: %g; must be above 0 and below 1", parts[i].name,
                         parts[i].value);
  if (!(o->tension >= 0 && o->tension < INFINITY))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.tension: %g; must be finite and 0 or more", o->tension);
  if (!(o->rounds_tol >= 0 && o->rounds_tol < INFINITY))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.rounds_tol: %g; must be finite and 0 or more", o->rounds_tol);
  return BATTEN_OK;
}

batten_status convex_options_check(batten_context *ctx, const batten_convex_options *opt) {
  batten_status st =
      batten_check_struct(ctx, "batten_convex_options", opt->struct_size, sizeof(batten_convex_options));
  if (st >= 0) st = check_space(ctx, opt);
  if (st >= 0) st = check_counts(ctx, opt);
  return st < 0 ? st : check_numbers(ctx, opt);
}

/* ---- data --------------------------------------------------------------------------------------- */

static batten_status check_weights(batten_context *ctx, size_t count, const double *weights) {
  double largest = 0;
  for (size_t i = 0; i < count; i++) {
    if (!(weights[i] >= 0 && weights[i] < INFINITY))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.weights[%zu]: %g; must be finite and 0 or more", i, weights[i]);
    largest = fmax(largest, weights[i]);
  }
  return largest > 0 ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "opt.weights: all 0; give some point a weight");
}

/* Whether the points lie on a line, to rounding: their second moments have one value only. */
static bool on_line(size_t count, const double *points) {
  double lower[3], upper[3], mean[3] = {0, 0, 0}, moments[9] = {0}, values[3], size = 0;
  for (int k = 0; k < 3; k++) lower[k] = upper[k] = points[k];
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) {
      lower[k] = fmin(lower[k], points[3 * i + (size_t)k]);
      upper[k] = fmax(upper[k], points[3 * i + (size_t)k]);
    }
  for (int k = 0; k < 3; k++) size = fmax(size, upper[k] - lower[k]);
  if (!(size > 0)) return true;
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) mean[k] += (points[3 * i + (size_t)k] - lower[k]) / size / (double)count;
  for (size_t i = 0; i < count; i++) {
    double d[3];
    for (int k = 0; k < 3; k++) d[k] = (points[3 * i + (size_t)k] - lower[k]) / size - mean[k];
    for (int k = 0; k < 9; k++) moments[k] += d[k / 3] * d[k % 3];
  }
  batten_eigen_symmetric(3, moments, values, NULL);
  /* 1e-14: 1e-7 of the length across, which the moments' own rounding cannot make */
  return !(values[1] > 1e-14 * values[2]);
}

batten_status convex_data_check(batten_context *ctx, size_t count, const double *points,
                                const batten_convex_options *opt) {
  if (count < COUNT_MIN)
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu points; a convex surface needs %d at least", count,
                       COUNT_MIN);
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][3] numbers", count);
  size_t numbers;
  if (!batten_mul(count, 3 * sizeof(double), &numbers) || count > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points; give %zu at most", count, (size_t)UINT32_MAX);
  size_t bad = batten_first_nonfinite(3 * count, points);
  if (bad < 3 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite points", bad / 3, bad % 3,
                       points[bad]);
  for (size_t i = 0; i < 3 * count; i++)
    if (fabs(points[i]) > 0x1p1000 || !isfinite(points[i] - points[i % 3]))
      return batten_fail(ctx, BATTEN_E_TOO_LARGE, "points[%zu][%zu]: %g; scale the points below 1e300", i / 3, i % 3,
                         points[i]);
  if (opt->weights) {
    batten_status st = check_weights(ctx, count, opt->weights);
    if (st < 0) return st;
  }
  if (on_line(count, points))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "points: all %zu lie on a line, or are one point; a surface needs points beside each other",
                       count);
  if (!opt->parameters) return BATTEN_OK;
  bad = batten_first_nonfinite(2 * count, opt->parameters);
  if (bad < 2 * count)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.parameters[%zu][%zu]: %g; give finite ones", bad / 2, bad % 2,
                       opt->parameters[bad]);
  return BATTEN_OK;
}

/* The box of the parameters: lower[k] = upper[k] where all are equal. */
static void parameter_box(size_t count, const double *parameters, double box[2][2]) {
  for (size_t k = 0; k < 2; k++) {
    box[k][0] = box[k][1] = parameters[k];
    for (size_t i = 1; i < count; i++) {
      box[k][0] = fmin(box[k][0], parameters[2 * i + k]);
      box[k][1] = fmax(box[k][1], parameters[2 * i + k]);
    }
  }
}

batten_status convex_domain_check(batten_context *ctx, const double domain[2][2]) {
  for (int k = 0; k < 2; k++)
    if (!(domain[k][0] < domain[k][1]) || !isfinite(domain[k][1] - domain[k][0]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.domain[%d]: %g to %g; give finite bounds, the lower first, or NaN for all four", k,
                         domain[k][0], domain[k][1]);
  return BATTEN_OK;
}

batten_status convex_domain(batten_context *ctx, size_t count, const double *parameters,
                            const batten_convex_options *opt, double domain[2][2]) {
  double box[2][2];
  size_t absent = 0;
  parameter_box(count, parameters, box);
  for (size_t k = 0; k < 4; k++) absent += isnan(opt->domain[k / 2][k % 2]) ? 1 : 0;
  for (size_t k = 0; k < 2; k++) {
    if (!(box[k][0] < box[k][1]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "parameters: all %zu have %s = %g; spread them, or leave opt.parameters NULL", count,
                         k ? "v" : "u", box[k][0]);
    for (int i = 0; i < 2; i++) domain[k][i] = absent == 4 ? box[k][i] : opt->domain[k][i];
  }
  batten_status st = convex_domain_check(ctx, (const double(*)[2])domain);
  if (st < 0) return st;
  for (size_t i = 0; i < 2 * count; i++)
    if (parameters[i] < domain[i % 2][0] || parameters[i] > domain[i % 2][1])
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "opt.parameters[%zu][%zu]: %.17g is outside the domain, %g to %g; set opt.domain, or all NaN "
          "there for their box",
          i / 2, i % 2, parameters[i], domain[i % 2][0], domain[i % 2][1]);
  return BATTEN_OK;
}
