/* Convex spline functions of scattered data: checks, scales, the result.   [Juettler: Surface fitting using convex
 * tensor-product splines, 1997]
 *
 * The points are taken to [0, 1]^2, their best plane is taken off z, which changes no second derivative, and what is
 * left is scaled to about 1 by a power of two. Concave functions are the negatives of convex ones, to the bit. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "function_inner.h"
#include "surface/surface_inner.h"

enum { SPANS_MAX = 64 };

batten_convex_function_options batten_convex_function_options_default(void) {
  return (batten_convex_function_options){.struct_size = sizeof(batten_convex_function_options),
                                          .degree = {3, 3},
                                          .spans = {4, 4},
                                          .domain = {{NAN, NAN}, {NAN, NAN}},
                                          .tension = 1e-8,
                                          .gap_tol = 1e-3,
                                          .rounds = 10};
}

typedef struct function_fit {
  batten_context *ctx;
  size_t count;
  const double *points;
  batten_convex_function_options opt;
  double domain[2][2];
  function_space space; /* of [0, 1]^2 */
  bspline caller[2];    /* the same knots over the caller's domain */
  double *knots[2], *knots_caller[2], *greville[2];
  signed char *signs;         /* of the space: first constrained one +1 */
  double sign;                /* what they were multiplied with */
  double *scaled, *weights;   /* [count][3], [count] of sum 1 */
  double plane[3];            /* of z sign scale: plane[0] + plane[1] x + plane[2] y, x and y scaled */
  double scale, total_weight; /* of z: power of two */
  double variation;           /* of z scaled when all are on a plane, else 0 */
  double noise;               /* size of what rounding is a part of, scaled */
  double *x, *unconstrained;  /* [n] */
  double *bowl, *tried;       /* [n] */
  double *points_of;          /* [n][3] control points */
} function_fit;

/* ---- checks -------------------------------------------------------------------------------------- */

static batten_status check_breaks(batten_context *ctx, const batten_convex_function_options *o, int i,
                                  const double domain[2]) {
  size_t count = o->break_count[i];
  if (count >= SPANS_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.break_count[%d]: %zu; give at most %d", i, count, SPANS_MAX - 1);
  if (!o->breaks[i])
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.breaks[%d]: NULL; give [%zu] ascending numbers", i, count);
  for (size_t k = 0; k < count; k++) {
    double at = o->breaks[i][k], before = k ? o->breaks[i][k - 1] : domain[0];
    if (!(at > domain[0] && at < domain[1]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.breaks[%d][%zu]: %.17g; give one inside the domain %.17g .. %.17g", i, k, at, domain[0],
                         domain[1]);
    /* 1e-6: second derivatives have the square of it as a unit */
    if (!(at - before > 1e-6 * (domain[1] - domain[0])) ||
        (k + 1 == count && !(domain[1] - at > 1e-6 * (domain[1] - domain[0]))))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.breaks[%d][%zu]: %.17g; breaks must ascend, by a millionth of the domain at least", i,
                         k, at);
  }
  return BATTEN_OK;
}

static batten_status check_options(batten_context *ctx, const batten_convex_function_options *o) {
  batten_status st = batten_check_struct(ctx, "batten_convex_function_options", o->struct_size,
                                         sizeof(batten_convex_function_options));
  if (st < 0) return st;
  for (int i = 0; i < 2; i++) {
    if (o->degree[i] < 2 || o->degree[i] > 7)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.degree[%d]: %u; give 2 to 7", i, o->degree[i]);
    if (o->break_count[i] == 0 && (o->spans[i] < 1 || o->spans[i] > SPANS_MAX))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.spans[%d]: %u; give 1 to %d", i, o->spans[i], SPANS_MAX);
    if (o->smoothness[i] >= o->degree[i])
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.smoothness[%d]: %u; degree %u allows 1 to %u, 0 = the most", i,
                         o->smoothness[i], o->degree[i], o->degree[i] - 1);
  }
  if (!(o->tension >= 0) || !isfinite(o->tension))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.tension: %g; give a number >= 0", o->tension);
  if (!(o->gap_tol > 0) || !isfinite(o->gap_tol))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.gap_tol: %g; give a number > 0", o->gap_tol);
  if (o->rounds < 1 || o->rounds > FUNCTION_ROUNDS_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.rounds: %u; give 1 to %d", o->rounds, FUNCTION_ROUNDS_MAX);
  return BATTEN_OK;
}

static batten_status check_weights(function_fit *f) {
  const double *weights = f->opt.weights;
  double largest = 0;
  for (size_t k = 0; weights && k < f->count; k++) {
    if (!(weights[k] >= 0) || !isfinite(weights[k]))
      return batten_fail(f->ctx, BATTEN_E_INVALID, "opt.weights[%zu]: %g; give numbers >= 0", k, weights[k]);
    largest = fmax(largest, weights[k]);
  }
  if (weights && largest == 0)
    return batten_fail(f->ctx, BATTEN_E_INVALID, "opt.weights: all are 0; give one above 0 at least");
  return BATTEN_OK;
}

/* The domain that is given, or the points' box; points outside are named. */
static batten_status find_domain(function_fit *f) {
  bool given = false;
  for (int k = 0; k < 4; k++) given = given || !isnan(f->opt.domain[k / 2][k % 2]);
  memcpy(f->domain, f->opt.domain, sizeof f->domain);
  for (int i = 0; i < 2; i++) {
    double *d = f->domain[i];
    for (size_t k = 0; k < f->count && !given; k++) {
      double at = f->points[3 * k + (size_t)i];
      d[0] = k ? fmin(d[0], at) : at;
      d[1] = k ? fmax(d[1], at) : at;
    }
    if (!given && !(d[0] < d[1]))
      return batten_fail(
          f->ctx, BATTEN_E_SINGULAR,
          "points: all have %c = %.17g, so that they do not determine a function; give points that are "
          "not on a line",
          i ? 'y' : 'x', d[0]);
    if (!(d[0] < d[1]) || !isfinite(d[1] - d[0]) || !isnormal(d[1] - d[0]))
      return batten_fail(f->ctx, BATTEN_E_INVALID,
                         "opt.domain[%d]: %g to %g; give two ascending numbers, or NaN four times", i, d[0], d[1]);
    if (d[1] - d[0] < 1e-10 * fmax(fabs(d[0]), fabs(d[1])))
      return batten_fail(
          f->ctx, BATTEN_E_INVALID,
          "opt.domain[%d]: %.17g to %.17g: too far from 0 for its length, few digits of places are left; "
          "move it towards 0",
          i, d[0], d[1]);
    for (size_t k = 0; k < f->count; k++) {
      double at = f->points[3 * k + (size_t)i];
      if (at < d[0] || at > d[1])
        return batten_fail(f->ctx, BATTEN_E_INVALID,
                           "points[%zu]: %c = %.17g is outside the domain %.17g .. %.17g; remove it, or widen "
                           "opt.domain",
                           k, i ? 'y' : 'x', at, d[0], d[1]);
    }
  }
  return BATTEN_OK;
}

static batten_status check(function_fit *f) {
  size_t numbers;
  batten_status st = check_options(f->ctx, &f->opt);
  if (st < 0) return st;
  if (f->count == 0) return batten_fail(f->ctx, BATTEN_E_INVALID, "count: 0; give points");
  if (!f->points) return batten_fail(f->ctx, BATTEN_E_INVALID, "points: NULL; give [count][3] numbers");
  if (f->count > UINT32_MAX || !batten_mul(f->count, 3 * sizeof(double), &numbers))
    return batten_fail(f->ctx, BATTEN_E_TOO_LARGE, "count: %zu; give fewer points", f->count);
  size_t bad = batten_first_nonfinite(3 * f->count, f->points);
  if (bad < 3 * f->count)
    return batten_fail(f->ctx, BATTEN_E_INVALID, "points[%zu][%zu]: %g; give finite points", bad / 3, bad % 3,
                       f->points[bad]);
  st = check_weights(f);
  if (st == BATTEN_OK) st = find_domain(f);
  for (int i = 0; i < 2 && st == BATTEN_OK; i++) {
    if (f->opt.break_count[i] > 0) st = check_breaks(f->ctx, &f->opt, i, f->domain[i]);
    f->space.spans[i] = f->opt.break_count[i] > 0 ? f->opt.break_count[i] + 1 : f->opt.spans[i];
    f->space.smoothness[i] = f->opt.smoothness[i] ? f->opt.smoothness[i] : f->opt.degree[i] - 1;
  }
  for (size_t k = 0; st == BATTEN_OK && f->opt.signs && k < f->space.spans[0] * f->space.spans[1]; k++)
    if (f->opt.signs[k] < -1 || f->opt.signs[k] > 1)
      st = batten_fail(f->ctx, BATTEN_E_INVALID, "opt.signs[%zu][%zu]: %d; give -1, 0 or 1", k / f->space.spans[1],
                       k % f->space.spans[1], f->opt.signs[k]);
  return st;
}

/* ---- scales -------------------------------------------------------------------------------------- */

static double to_unit(const double domain[2], double t) {
  return fmin(fmax((t - domain[0]) / (domain[1] - domain[0]), 0), 1);
}

static batten_status make_space(function_fit *f) {
  function_space *s = &f->space;
  for (int i = 0; i < 2; i++) {
    unsigned d = f->opt.degree[i];
    const double *breaks = f->opt.break_count[i] ? f->opt.breaks[i] : NULL;
    size_t knots = bspline_make_knots(d, s->smoothness[i], s->spans[i], NULL, 0, 1, NULL), count = knots - d - 1;
    double unit[SPANS_MAX];
    for (size_t k = 0; breaks && k + 1 < s->spans[i]; k++) unit[k] = to_unit(f->domain[i], breaks[k]);
    f->knots[i] = batten_alloc_array(f->ctx, 2 * knots + count, sizeof(double));
    s->span[i] = batten_alloc_array(f->ctx, s->spans[i], sizeof *s->span[i]);
    if (!f->knots[i] || !s->span[i]) return BATTEN_E_NOMEM;
    f->knots_caller[i] = f->knots[i] + knots;
    f->greville[i] = f->knots_caller[i] + knots;
    bspline_make_knots(d, s->smoothness[i], s->spans[i], breaks ? unit : NULL, 0, 1, f->knots[i]);
    bspline_make_knots(d, s->smoothness[i], s->spans[i], breaks, f->domain[i][0], f->domain[i][1],
                       f->knots_caller[i]);
    s->spline.axis[i] = (bspline){d, count, f->knots[i]};
    f->caller[i] = (bspline){d, count, f->knots_caller[i]};
    size_t span = 0;
    for (size_t mu = bspline_first(&s->spline.axis[i]); mu < count; mu = bspline_next(&s->spline.axis[i], mu))
      s->span[i][span++] = mu;
  }
  s->n = convex_points(&s->spline);
  return BATTEN_OK;
}

/* Signs, turned such that the first is +1; whether there are opposite ones. */
static batten_status make_signs(function_fit *f) {
  size_t rows = f->space.spans[0], columns = f->space.spans[1];
  f->signs = batten_alloc(f->ctx, rows * columns);
  if (!f->signs) return BATTEN_E_NOMEM;
  f->sign = 0;
  for (size_t k = 0; k < rows * columns; k++) {
    f->signs[k] = f->opt.signs ? f->opt.signs[k] : 1;
    if (f->sign == 0) f->sign = f->signs[k];
  }
  if (f->sign == 0) f->sign = 1;
  for (size_t k = 0; k < rows * columns; k++) {
    f->signs[k] = (signed char)(f->signs[k] * (int)f->sign);
    f->space.opposite = f->space.opposite || f->signs[k] < 0;
  }
  f->space.signs = f->signs;
  return BATTEN_OK;
}

/* The best plane of z over the scaled places, by weighted moments; SINGULAR when the places are on a line. */
static batten_status best_plane(function_fit *f) {
  double mean[3] = {0}, m[5] = {0}; /* xx, xy, yy, xz, yz */
  for (size_t k = 0; k < f->count; k++)
    for (int i = 0; i < 3; i++) mean[i] += f->weights[k] * f->scaled[3 * k + (size_t)i];
  for (size_t k = 0; k < f->count; k++) {
    const double *p = f->scaled + 3 * k;
    double x = p[0] - mean[0], y = p[1] - mean[1], z = p[2] - mean[2], w = f->weights[k];
    double add[5] = {x * x, x * y, y * y, x * z, y * z};
    for (int i = 0; i < 5; i++) m[i] += w * add[i];
  }
  double values[2], angle;
  function_eigen(m, values, &angle);
  /* 1e-18: a width of 1e-9 of the length; less is the rounding of points that were on a line */
  if (!(values[1] > 1e-18 * values[0]))
    return batten_fail(f->ctx, BATTEN_E_SINGULAR,
                       "points: all that count are on a line, so that they do not determine a function; give points "
                       "beside it");
  for (int i = 0; i < 5; i++) m[i] /= values[0]; /* of tiny weights the determinant would be 0 */
  double det = values[1] / values[0];
  f->plane[1] = (m[2] * m[3] - m[1] * m[4]) / det;
  f->plane[2] = (m[0] * m[4] - m[1] * m[3]) / det;
  f->plane[0] = mean[2] - f->plane[1] * mean[0] - f->plane[2] * mean[1];
  return BATTEN_OK;
}

static batten_status check_size(const function_fit *f) {
  double unit = 1 / f->scale;
  if (isfinite(f->scale) && isfinite(unit * unit * f->total_weight)) return BATTEN_OK;
  return batten_fail(
      f->ctx, BATTEN_E_INVALID,
      "points, weights: z of %g and weights of %g together; their sums of squares are beyond a double: "
      "scale them",
      unit, f->total_weight);
}

static batten_status scale_points(function_fit *f) {
  size_t count = f->count;
  f->scaled = batten_alloc_array(f->ctx, 4 * count, sizeof *f->scaled);
  if (!f->scaled) return BATTEN_E_NOMEM;
  f->weights = f->scaled + 3 * count;
  double largest = 0, heaviest = 1, total = 0;
  for (size_t k = 0; k < count; k++) largest = fmax(largest, fabs(f->points[3 * k + 2]));
  for (size_t k = 0; k < count && f->opt.weights; k++)
    heaviest = k ? fmax(heaviest, f->opt.weights[k]) : f->opt.weights[0];
  for (size_t k = 0; k < count; k++) total += f->weights[k] = f->opt.weights ? f->opt.weights[k] / heaviest : 1;
  for (size_t k = 0; k < count; k++) f->weights[k] /= total;
  f->total_weight = total * heaviest;
  f->scale = largest > 0 ? batten_unit(largest) : 1;
  for (size_t k = 0; k < count; k++) {
    for (int i = 0; i < 2; i++) f->scaled[3 * k + (size_t)i] = to_unit(f->domain[i], f->points[3 * k + (size_t)i]);
    f->scaled[3 * k + 2] = f->sign * f->scale * f->points[3 * k + 2];
  }
  batten_status st = best_plane(f);
  if (st < 0) return st;
  double left = 0, low = INFINITY, high = -INFINITY;
  for (size_t k = 0; k < count; k++) {
    double *p = f->scaled + 3 * k;
    low = fmin(low, p[2]);
    high = fmax(high, p[2]);
    p[2] -= f->plane[0] + f->plane[1] * p[0] + f->plane[2] * p[1];
    left = fmax(left, fabs(p[2]));
  }
  double size = fmax(1, fabs(f->plane[0]) + fabs(f->plane[1]) + fabs(f->plane[2]));
  bool flat = left <= 64 * DBL_EPSILON * size; /* rounding of the plane itself */
  double unit = flat ? 1 : batten_unit(left);
  for (size_t k = 0; k < count; k++) f->scaled[3 * k + 2] *= flat ? 0 : unit;
  for (int i = 0; i < 3; i++) f->plane[i] *= unit;
  f->scale *= unit;
  /* What is off by rounding: z itself, and the places of control points, by which a slope becomes one of z. */
  double far = 0;
  for (int i = 0; i < 2; i++)
    far = fmax(far, fmax(fabs(f->domain[i][0]), fabs(f->domain[i][1])) / (f->domain[i][1] - f->domain[i][0]));
  f->noise = size * unit + far * (1 + fabs(f->plane[1]) + fabs(f->plane[2]));
  f->variation = flat ? high - low : 0;
  return check_size(f);
}

/* ---- the result ---------------------------------------------------------------------------------- */

static double value_at(const function_fit *f, const double *point) {
  const bspline *u = &f->caller[0], *v = &f->caller[1];
  size_t mu[2] = {bspline_span(u, point[0]), bspline_span(v, point[1])};
  double table[2][BSPLINE_ORDER], sum = 0;
  bspline_basis(u, mu[0], point[0], 0, table[0]);
  bspline_basis(v, mu[1], point[1], 0, table[1]);
  for (unsigned i = 0; i <= u->degree; i++)
    for (unsigned j = 0; j <= v->degree; j++)
      sum += table[0][i] * table[1][j] *
             f->points_of[((mu[0] - u->degree + i) * v->count + mu[1] - v->degree + j) * 3 + 2];
  return sum;
}

/* The surface of scaled coefficients; its distances in z. */
static batten_status make_surface(function_fit *f, const double *x, batten_surface **out,
                                  batten_convex_function_info *info) {
  batten_surface_form form = {.control_points = f->points_of};
  size_t stride = f->caller[1].count;
  double *greville[2] = {f->greville[0], f->greville[1]};
  for (int i = 0; i < 2; i++) {
    bspline_greville(&f->caller[i], greville[i]);
    form.degree[i] = f->opt.degree[i];
    form.knot_count[i] = f->caller[i].count + f->opt.degree[i] + 1;
    form.knots[i] = f->caller[i].knots;
  }
  for (size_t k = 0; k < f->space.n; k++) {
    size_t at[2] = {k / stride, k % stride};
    double place[2], z = x[k];
    for (int i = 0; i < 2; i++) {
      f->points_of[3 * k + (size_t)i] = greville[i][at[i]];
      place[i] = to_unit(f->domain[i], greville[i][at[i]]);
    }
    z += f->plane[0] + f->plane[1] * place[0] + f->plane[2] * place[1];
    f->points_of[3 * k + 2] = z * f->sign / f->scale;
  }
  double sum = 0, worst = -1;
  for (size_t k = 0; k < f->count; k++) {
    double off = fabs(value_at(f, f->points + 3 * k) - f->points[3 * k + 2]);
    sum += f->weights[k] * (off * f->scale) * (off * f->scale); /* scaled: small ones have squares, too */
    if (off > worst) {
      worst = off;
      info->max_error_index = k;
    }
  }
  info->rms = sqrt(sum) / f->scale;
  info->lsq = info->rms * info->rms * f->total_weight;
  info->max_error = worst;
  return batten_surface_create(f->ctx, &form, out);
}

/* Subtracts one number [every third] from all where that is exact. */
static void move_to_origin(size_t count, double *at) {
  double origin = at[0];
  for (size_t k = 0; k < count; k++) {
    double moved = at[3 * k] - origin, part = moved - at[3 * k];
    if ((at[3 * k] - (moved - part)) - (origin + part) != 0) return;
  }
  for (size_t k = 0; k < count; k++) at[3 * k] -= origin;
}

/* The certificate, of the surface moved to the origin, where its digits tell of its shape, and with z multiplied by a
 * power of two that makes it about as high as wide: what is proven of that holds of the surface, with another margin.
 * K = D / (1 + g^2)^2, g the slope: with z times q it is q^2 D / (1 + q^2 g^2)^2, so that K is at least min(q, 1 /
 * q)^2 of that. */
static batten_status certify(function_fit *f, const batten_surface *surface, const batten_convexity_options *opt,
                             batten_convexity *out) {
  batten_surface_form form = batten_surface_get(surface);
  batten_convexity_options o = *opt;
  batten_surface *copy = NULL;
  double low = INFINITY, high = -INFINITY;
  for (size_t k = 0; k < f->space.n; k++) {
    low = fmin(low, form.control_points[3 * k + 2]);
    high = fmax(high, form.control_points[3 * k + 2]);
  }
  double wide = fmax(f->domain[0][1] - f->domain[0][0], f->domain[1][1] - f->domain[1][0]);
  double factor = high > low && isfinite(high - low) ? batten_unit(high - low) / batten_unit(wide) : 1;
  factor = fmin(fmax(factor, 0x1p-1000), 0x1p1000);
  memcpy(f->points_of, form.control_points, 3 * f->space.n * sizeof(double));
  for (size_t axis = 0; axis < 3; axis++) move_to_origin(f->space.n, f->points_of + axis);
  for (size_t k = 0; k < f->space.n; k++) f->points_of[3 * k + 2] *= factor;
  form.control_points = f->points_of;
  o.slack *= factor;
  batten_status st = batten_surface_create(f->ctx, &form, &copy);
  if (st == BATTEN_OK) st = batten_surface_certify_convex(f->ctx, copy, &o, out);
  if (st == BATTEN_OK) {
    double least = fmin(factor, 1 / factor);
    if (out->certified) out->margin_min = fmin(out->margin_min, DBL_MAX) * least * least;
    if (out->graph) { /* of any function */
      const double up[3] = {0, 0, 1};
      memcpy(out->direction, up, sizeof up);
    }
  }
  batten_surface_free(copy);
  return st;
}

/* Proves with ever more slack. From a ten millionth of the curvature: with less, rounding of products of curvature
 * and slack is above the square of the slack. Where an attempt with little slack needs many boxes, the next needs
 * few. */
static batten_status prove_slack(function_fit *f, const function_rounds_info *rounds, const batten_surface *surface,
                                 batten_convexity_options *o, batten_convex_function_info *info) {
  double width = fmin(f->domain[0][1] - f->domain[0][0], f->domain[1][1] - f->domain[1][0]);
  batten_status st = BATTEN_OK;
  o->slack = fmax(-2 * rounds->margin, 1e-7 * rounds->scale) / (f->scale * width * width);
  for (int attempt = 0; attempt < 12 && st == BATTEN_OK; attempt++) {
    st = certify(f, surface, o, &info->convexity);
    info->slack = o->slack;
    if (info->convexity.certified) break;
    o->slack *= 2;
  }
  return st;
}

/* Makes the surface and proves it. Where the margin, which is above the rounding of second derivatives, is not above
 * that of the proof, as for data on a plane: with more margin. When none will do the surface is as it was. */
static batten_status prove(function_fit *f, const function_terms *terms, function_rounds_info *rounds,
                           batten_surface **surface, batten_convex_function_info *info) {
  batten_convexity_options o = batten_convexity_options_default();
  size_t spans = f->space.spans[0] * f->space.spans[1];
  signed char *signs = batten_alloc(f->ctx, spans);
  if (!signs) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < spans; k++) signs[k] = (signed char)(f->signs[k] * (int)f->sign);
  o.signs = signs;
  o.box_limit = 20000 + 64 * spans;
  function_bowl(&f->space, f->bowl);
  batten_status st = BATTEN_OK;
  double more = 0;
  for (int attempt = 0; attempt < 9 && st == BATTEN_OK; attempt++) {
    batten_surface *made = NULL;
    batten_convex_function_info found = *info;
    for (size_t k = 0; k < f->space.n; k++) f->tried[k] = f->x[k] + more * f->bowl[k];
    st = make_surface(f, f->tried, &made, &found);
    if (st == BATTEN_OK && f->space.opposite) st = prove_slack(f, rounds, made, &o, &found);
    if (st == BATTEN_OK && !f->space.opposite) st = certify(f, made, &o, &found.convexity);
    bool proven = found.convexity.certified, taken = st == BATTEN_OK && (attempt == 0 || proven);
    if (taken) {
      batten_surface *before = *surface;
      *surface = made;
      made = before;
      *info = found;
      if (attempt > 0)
        rounds->objective = function_terms_squares(terms, f->tried) + function_terms_tension(terms, f->tried);
    }
    batten_surface_free(made);
    if (proven || f->space.opposite) break;
    more = attempt == 0 ? rounds->least_margin : 4 * more;
  }
  batten_free(f->ctx, signs);
  return st;
}

static void fill_info(const function_fit *f, const function_rounds_info *rounds, batten_convex_function_info *info) {
  double unit = 1 / (f->scale * f->scale);
  info->unknowns = f->space.n;
  info->objective = rounds->objective * unit;
  info->objective_lower = fmin(rounds->lower, rounds->objective) * unit;
  info->lsq_lower = fmin(rounds->squares_lower * unit * f->total_weight, info->lsq);
  info->rounds = rounds->rounds;
  memcpy(info->rows_per_round, rounds->rows, sizeof rounds->rows);
  info->rows_outer = rounds->cuts;
  info->time_rows_s = rounds->time_rows;
  info->time_qp_s = rounds->time_qp;
}

static batten_status allocate(function_fit *f) {
  size_t n = f->space.n;
  f->x = batten_alloc_array(f->ctx, 7 * n, sizeof *f->x);
  if (!f->x) return BATTEN_E_NOMEM;
  f->unconstrained = f->x + n;
  f->bowl = f->x + 2 * n;
  f->tried = f->x + 3 * n;
  f->points_of = f->x + 4 * n;
  return BATTEN_OK;
}

static void release(function_fit *f) {
  for (int i = 0; i < 2; i++) {
    batten_free(f->ctx, f->knots[i]);
    batten_free(f->ctx, f->space.span[i]);
  }
  batten_free(f->ctx, f->signs);
  batten_free(f->ctx, f->scaled);
  batten_free(f->ctx, f->x);
}

/* Where the squares, in units of the scaled z, are as good as nothing: a millionth of z is no difference. */
static const double floor_of_squares = 1e-12;

static batten_status judge(const function_fit *f, const function_rounds_info *rounds,
                           const batten_convex_function_info *info) {
  double gap = rounds->objective - rounds->lower;
  if (!info->convexity.certified)
    return batten_fail(f->ctx, BATTEN_W_ACCURACY,
                       "convexity is not proven near (%g, %g); use fewer spans, or raise opt.rounds",
                       info->convexity.worst_at[0], info->convexity.worst_at[1]);
  if (gap > f->opt.gap_tol * rounds->lower + floor_of_squares)
    return batten_fail(
        f->ctx, BATTEN_W_STOPPED,
        "the mean square with tension is %.6g, that of the best such function at least %.6g: more than "
        "opt.gap_tol = %g apart; %s, or use fewer spans",
        info->objective, info->objective_lower, f->opt.gap_tol,
        info->rounds < f->opt.rounds ? "raise that, which more rounds would not reach" : "raise opt.rounds");
  return BATTEN_OK;
}

batten_status batten_convex_function_fit(batten_context *ctx, size_t count, const double *points,
                                         const batten_convex_function_options *opt, batten_surface **out,
                                         batten_surface **unconstrained, batten_convex_function_info *info) {
  function_fit f = {.ctx = ctx, .count = count, .points = points};
  f.opt = opt ? *opt : batten_convex_function_options_default();
  function_terms terms = {0};
  function_rounds_info rounds;
  batten_convex_function_info found = {0};
  batten_surface *surface = NULL, *free_surface = NULL;
  batten_status st = check(&f);
  if (st == BATTEN_OK) st = make_space(&f);
  if (st == BATTEN_OK) st = make_signs(&f);
  if (st == BATTEN_OK) st = scale_points(&f);
  if (st == BATTEN_OK) st = allocate(&f);
  if (st == BATTEN_OK) st = function_terms_make(ctx, &f.space, count, f.scaled, f.weights, f.opt.tension, &terms);
  if (st < 0) goto done;
  double fine = 0;
  for (int i = 0; i < 2; i++) fine = fmax(fine, (double)(f.space.spans[i] * f.opt.degree[i]));
  double noise = 256 * DBL_EPSILON * f.noise * fine * fine; /* of second differences of coefficients */
  /* Of data on a plane nothing is left: a hundred millionth of their range is as good, and easy to prove. */
  noise = fmax(noise, 1e-8 * f.variation);
  /* 0.7: the proof may ask for more margin */
  function_rounds_options how = {f.opt.rounds, 0.7 * f.opt.gap_tol, floor_of_squares, noise, false};
  st = function_rounds(ctx, &f.space, &terms, &how, f.x, f.unconstrained, &rounds);
  if (st < 0) goto done;
  double range[2][2];
  st = make_surface(&f, f.unconstrained, &free_surface, &found);
  if (st < 0) goto done;
  found.lsq_unconstrained = found.lsq;
  double begin = batten_now();
  st = surface_gauss_range(ctx, free_surface, range[0]);
  if (st < 0) goto done;
  found.gauss_min_unconstrained = range[0][0];
  st = prove(&f, &terms, &rounds, &surface, &found);
  if (st == BATTEN_OK) st = surface_gauss_range(ctx, surface, range[1]);
  if (st < 0) goto done;
  found.gauss_min = range[1][0];
  found.gauss_max = range[1][1];
  found.time_check_s = batten_now() - begin;
  fill_info(&f, &rounds, &found);
  st = judge(&f, &rounds, &found);
  *out = surface;
  surface = NULL;
  if (unconstrained) {
    *unconstrained = free_surface;
    free_surface = NULL;
  }
  if (info) *info = found;
done:
  batten_surface_free(surface);
  batten_surface_free(free_surface);
  function_terms_free(ctx, &terms);
  release(&f);
  return st;
}
