/* Deformation by displaced points.   [Savchenko et al. 1995, section 3; Bookstein 1989]
 *
 * y = S(x), S the volume spline with S(to[i]) = from[i], one for each coordinate: what is x - u(x) for the spline u
 * through the displacements, as splines of order m = 2 give every linear function back. Taken so, bounds of y need no
 * difference of two large intervals.
 *
 * Box. In the splines' unit coordinates, S(x) = p + P x + R(x), R a sum of w_i phi(|x - x_i|) with sum w_i = 0 and
 * sum w_i x_i = 0. So R stays bounded in space by sum |w_i| |x_i|, as | |x - x_i| - |x| | <= |x_i|; in the plane, at
 * twice the reach of the x_i and beyond, by sum |w_i| |x_i|^2 / 2 times the largest second derivative of r^2 ln r
 * near |x|, 2 ln r + 3. Points that come from a box of size Y then have |x| <= |P^-1| (Y + |p| + R), and R grows too
 * slowly to follow: iterated, the right side comes to rest. */
#include <string.h>

#include "base/checked.h"
#include "frep/gather.h"

typedef struct deform_state {
  batten_context *ctx;
  batten_spline *splines[3];
} deform_state;

static void deform_release(void *state) {
  deform_state *s = state;
  if (!s) return;
  for (unsigned k = 0; k < 3; k++) batten_spline_free(s->splines[k]);
  batten_free(s->ctx, s);
}

static batten_status deform_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                     double *values, double *gradients) {
  const deform_state *s = a->state;
  const unsigned n = a->n;
  batten_status st = BATTEN_E_NOMEM;
  size_t each = gradients ? 1 + 2 * (size_t)n + n : 1 + (size_t)n; /* of one axis: y, dy; y and df of the child */
  double *block = batten_alloc_array(ctx, count, each * n * sizeof *block);
  if (!block) return st;
  double *y = block, *one = y + count * n, *df = one + count, *dy = df + count * n;
  st = BATTEN_OK;
  for (unsigned k = 0; st >= 0 && k < n; k++) {
    st = batten_spline_evaluate(ctx, s->splines[k], count, points, one, gradients ? dy + k * count * n : NULL, NULL);
    for (size_t i = 0; st >= 0 && i < count; i++) y[i * n + k] = one[i];
  }
  if (st >= 0) st = frep_evaluate_block(a->children[0], ctx, count, y, values, gradients ? df : NULL);
  for (size_t i = 0; st >= 0 && gradients && i < count; i++)
    for (unsigned j = 0; j < n; j++) {
      double sum = 0;
      for (unsigned k = 0; k < n; k++) sum += df[i * n + k] * dy[(k * count + i) * n + j];
      gradients[i * n + j] = sum;
    }
  batten_free(ctx, block);
  return st;
}

static batten_status deform_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *ranges) {
  const deform_state *s = a->state;
  const unsigned n = a->n;
  double *images = batten_alloc_array(ctx, count, 2 * n * sizeof *images);
  if (!images) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  for (unsigned k = 0; st >= 0 && k < n; k++) {
    st = batten_spline_bounds(ctx, s->splines[k], count, boxes, ranges);
    for (size_t i = 0; st >= 0 && i < count; i++) {
      interval y[1] = {{ranges[2 * i], ranges[2 * i + 1]}};
      double ends[2];
      frep_intervals_box(1, y, ends);
      images[2 * n * i + k] = ends[0];
      images[2 * n * i + n + k] = ends[1];
    }
  }
  if (st >= 0) st = frep_bounds_block(a->children[0], ctx, count, images, ranges);
  batten_free(ctx, images);
  return st;
}

/* What the splines are made of, for the box; all in their unit coordinates, which they share. */
typedef struct deform_terms {
  double constant, inverse; /* |p|, |P^-1| */
  double reach, moment;     /* max |x_i|; over the axes the root of the sum of squares of sum |w_i| |x_i|^(1 or 2) */
  double origin[3], scale;
} deform_terms;

static bool take_terms(const deform_state *s, unsigned n, const double *towards, deform_terms *t) {
  double linear[9], inverse[9], constant = 0, moments = 0;
  *t = (deform_terms){0};
  for (unsigned k = 0; k < n; k++) {
    batten_spline_parts parts = {.struct_size = sizeof parts};
    batten_spline_get_parts(s->splines[k], &parts);
    double moment = 0;
    for (size_t i = 0; i < parts.count; i++) {
      double square = 0;
      for (unsigned j = 0; j < n; j++) {
        double x = (parts.centers[i * n + j] - parts.origin[j]) / parts.scale;
        square += x * x;
      }
      t->reach = fmax(t->reach, sqrt(square));
      moment += fabs(parts.coefficients[i]) * (n == 2 ? square : sqrt(square));
    }
    moments += moment * moment;
    constant += (parts.polynomial[0] - towards[k]) * (parts.polynomial[0] - towards[k]);
    memcpy(linear + k * n, parts.polynomial + 1, n * sizeof *linear);
    memcpy(t->origin, parts.origin, sizeof t->origin);
    t->scale = parts.scale;
  }
  if (!frep_invert(n, linear, inverse)) return false;
  for (unsigned i = 0; i < n * n; i++) t->inverse += inverse[i] * inverse[i];
  t->inverse = sqrt(t->inverse);
  t->constant = sqrt(constant);
  t->moment = sqrt(moments);
  return true;
}

static bool deform_box(const batten_frep *a, double *lower, double *upper) {
  const deform_state *s = a->state;
  const unsigned n = a->n;
  double low[3], high[3], middle[3], square = 0;
  if (!frep_structural_box(a->children[0], low, high)) return false;
  bool empty = false;
  for (unsigned k = 0; k < n; k++) {
    empty = empty || low[k] > high[k];
    middle[k] = low[k] / 2 + high[k] / 2;
    square += (high[k] - middle[k]) * (high[k] - middle[k]);
  }
  deform_terms t = {0};
  if (!empty && !take_terms(s, n, middle, &t)) return false;
  double size = 0, at = empty ? 0 : 2 * t.reach;
  for (int step = 0; !empty && step < 100; step++) {
    double rest = n == 3 ? t.moment : t.moment / 2 * (2 * fabs(log(1.5 * at)) + 2 * fabs(log(0.5 * at)) + 3);
    size = fmax(2 * t.reach, t.inverse * (sqrt(square) + t.constant + rest) * 1.001);
    if (size <= at) break;
    at = 1.1 * size;
  }
  if (!empty && !(size <= at && isfinite(at))) return false;
  for (unsigned k = 0; k < n; k++) {
    lower[k] = empty ? 1 : t.origin[k] - t.scale * at;
    upper[k] = empty ? -1 : t.origin[k] + t.scale * at;
  }
  return true;
}

static batten_status fit_splines(batten_context *ctx, unsigned n, size_t count, const double *from, const double *to,
                                 deform_state *s) {
  double *values = batten_alloc_array(ctx, count, sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  batten_spline_options opt = batten_spline_options_default();
  opt.loo_samples = 0;
  batten_status st = BATTEN_OK, worst = BATTEN_OK;
  for (unsigned k = 0; st >= 0 && k < n; k++) {
    for (size_t i = 0; i < count; i++) values[i] = from[i * n + k];
    batten_spline_data data = batten_spline_data_default();
    data.n = n;
    data.count = count;
    data.points = to;
    data.values = values;
    st = batten_spline_fit(ctx, &data, &opt, &s->splines[k], NULL);
    if (st > 0) worst = st;
  }
  batten_free(ctx, values);
  return st < 0 ? st : worst;
}

batten_status batten_frep_deform(batten_context *ctx, batten_frep *a, size_t count, const double *from,
                                 const double *to, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st < 0) return st;
  const unsigned n = a->n;
  if (count <= n)
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; give more than %u points, not all on one line or plane",
                       count, n);
  size_t half, all;
  if (!batten_mul(count, n, &half) || !batten_mul(half, 2, &all))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points", count);
  st = frep_check_numbers(ctx, "from", half, from);
  if (st >= 0) st = frep_check_numbers(ctx, "to", half, to);
  if (st < 0) return st;
  double *numbers = batten_alloc_array(ctx, all, sizeof *numbers);
  deform_state *s = numbers ? batten_alloc(ctx, sizeof *s) : NULL;
  st = s ? BATTEN_OK : BATTEN_E_NOMEM;
  if (s) *s = (deform_state){.ctx = ctx};
  if (st >= 0) st = fit_splines(ctx, n, count, from, to, s);
  if (st >= 0) {
    memcpy(numbers, from, half * sizeof *numbers);
    memcpy(numbers + half, to, half * sizeof *numbers);
    batten_frep_parts parts = {.n = n, .number_count = all, .numbers = numbers, .child_count = 1, .children = {a}};
    batten_status made = frep_make(ctx, &frep_class_deform, &parts, false, s, out);
    if (made < 0) st = made;
  }
  if (st < 0) deform_release(s);
  batten_free(ctx, numbers);
  return st;
}

static batten_status deform_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  size_t pair = 2 * (size_t)parts->n, count = parts->number_count / pair;
  batten_status st = frep_check_parts(ctx, parts, count * pair, 1);
  if (st >= 0) st = frep_check_node(ctx, "a", parts->children[0], parts->n);
  if (st < 0) return st;
  return batten_frep_deform(ctx, parts->children[0], count, parts->numbers, parts->numbers + count * parts->n, out);
}

const frep_class frep_class_deform = {.kind = BATTEN_FREP_KIND_DEFORM,
                                      .name = "deform",
                                      .evaluate = deform_evaluate,
                                      .bounds = deform_bounds,
                                      .box = deform_box,
                                      .create = deform_create,
                                      .release = deform_release};
