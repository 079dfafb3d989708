/* Distances and what is made of them: normalize, offset, shell; and solid noise.
 *
 * f / |grad f| is the distance to the surface to first order near it. It has a pole where the gradient vanishes, so
 *   N = f / w,   w^2 = |grad f|^2 + (f / L)^2,   |N| <= L
 * is taken, with L ten times the size of the solid as the leaves tell it: within a tenth of that size of the surface
 * N differs from f / |grad f| by (N / L)^2 / 2 < 5e-5 of itself. Its gradient is grad f / w (1 - (f / (L w))^2) - f H
 * grad f / w^3, with H grad f from two gradients at a ten thousandth of N before and behind along grad f: the term
 * counts as much as N does, so the step may shrink with it.
 *
 * |N| grows with |f| and falls with |grad f|: ranges of f and bounds of the slope give those of N.
 *   [noise: Savchenko et al. 1995, section 5.5; Pasko, Savchenko 1993] */
#include "base/checked.h"
#include "frep/frep_inner.h"

/* A first-order distance may fall short of the distance far from the surface: where f goes like the power p of the
 * distance from the middle, by p times. Reconstructed solids have p up to 3, R^2 - |x - c|^2 has 2. */
#define FIRST_ORDER_REACH 4

/* ---- normalize ------------------------------------------------------------------------------------------ */

typedef struct normalized {
  double limit;              /* L */
  double lower[3], upper[3]; /* of the child, where boxed */
  bool boxed;
} normalized;

static double norm(size_t n, const double *v) {
  double sum = 0;
  for (size_t k = 0; k < n; k++) sum += v[k] * v[k];
  return sqrt(sum);
}

/* N from f and its gradient's length. */
static double bounded_ratio(double f, double slope, double limit) {
  double w = hypot(slope, f / limit);
  return w > 0 ? f / w : 0;
}

/* Gradients of f in, those of N out. work [4 n count]: points and gradients at both sides of each point. */
static batten_status normalize_gradients(const batten_frep *a, batten_context *ctx, size_t count,
                                         const double *points, const double *f, double *gradients, double *work) {
  const size_t n = a->n, all = n * count;
  const double limit = ((const normalized *)a->state)->limit;
  double *ahead = work, *behind = work + all, *ahead_gradient = behind + all, *behind_gradient = ahead_gradient + all;
  for (size_t i = 0; i < count; i++) {
    double slope = norm(n, gradients + n * i),
           step = fmin(1e-4 * fabs(bounded_ratio(f[i], slope, limit)), 1e-6 * limit);
    for (size_t k = n * i; k < n * i + n; k++) {
      double move = slope > 0 ? step * gradients[k] / slope : 0;
      ahead[k] = points[k] + move;
      behind[k] = points[k] - move;
    }
  }
  double *values = batten_alloc_array(ctx, count, sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, ahead, values, ahead_gradient);
  if (st >= 0) st = frep_evaluate_block(a->children[0], ctx, count, behind, values, behind_gradient);
  batten_free(ctx, values);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double slope = norm(n, gradients + n * i), w = hypot(slope, f[i] / limit), apart = 0;
    for (size_t k = n * i; k < n * i + n; k++) apart += (ahead[k] - behind[k]) * (ahead[k] - behind[k]);
    apart = sqrt(apart);
    for (size_t k = n * i; k < n * i + n; k++) {
      double bend = apart > 0 ? (ahead_gradient[k] - behind_gradient[k]) / apart * slope : 0; /* H grad f */
      double part = f[i] / limit / w;
      gradients[k] = w > 0 ? gradients[k] / w * (1 - part * part) - f[i] / w * (bend / w / w) : 0;
    }
  }
  return st;
}

static batten_status normalize_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                        double *values, double *gradients) {
  const size_t n = a->n;
  const double limit = ((const normalized *)a->state)->limit;
  double *work = batten_alloc_array(ctx, count * n, (gradients ? 4 : 1) * sizeof *work), *g = gradients;
  if (!work) return BATTEN_E_NOMEM;
  if (!g) g = work;
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, points, values, g);
  double *slopes = NULL;
  if (st >= 0) {
    slopes = batten_alloc_array(ctx, count, sizeof *slopes);
    if (!slopes) st = BATTEN_E_NOMEM;
  }
  for (size_t i = 0; st >= 0 && i < count; i++) slopes[i] = norm(n, g + n * i);
  if (st >= 0 && gradients) st = normalize_gradients(a, ctx, count, points, values, gradients, work);
  for (size_t i = 0; st >= 0 && i < count; i++) values[i] = bounded_ratio(values[i], slopes[i], limit);
  batten_free(ctx, slopes);
  batten_free(ctx, work);
  return st;
}

/* N from the lower end of f and the slope at which it is least. An infinite slope or end tells the sign alone. */
static double least_ratio(double f, double slope, double limit) {
  if (f >= 0) return isinf(slope) || isinf(f) ? 0 : bounded_ratio(f, slope, limit);
  return slope > 0 && !isinf(f) ? bounded_ratio(f, slope, limit) : -limit;
}

static batten_status normalize_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                      double *ranges) {
  const double limit = ((const normalized *)a->state)->limit;
  double *slopes = batten_alloc_array(ctx, count, 2 * sizeof *slopes);
  if (!slopes) return BATTEN_E_NOMEM;
  batten_status st = frep_both_block(a->children[0], ctx, count, boxes, ranges, slopes);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double lo = ranges[2 * i], hi = ranges[2 * i + 1], least = slopes[2 * i], most = slopes[2 * i + 1];
    interval r = interval_widen(least_ratio(lo, lo >= 0 ? most : least, limit),
                                -least_ratio(-hi, -hi >= 0 ? most : least, limit), 8);
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  batten_free(ctx, slopes);
  return st;
}

static bool normalize_box(const batten_frep *a, double *lower, double *upper) {
  const normalized *state = a->state;
  if (!state->boxed) return frep_structural_box(a->children[0], lower, upper);
  for (unsigned k = 0; k < a->n; k++) {
    lower[k] = state->lower[k];
    upper[k] = state->upper[k];
  }
  return true;
}

/* The child's box by its bounds, which are better than those of N; and what |N| is bounded by: ten diagonals of what
 * the leaves tell; where they tell nothing, no size of anybody's. */
static batten_status measure(batten_context *ctx, const batten_frep *a, normalized *state) {
  double lower[3], upper[3], diagonal = 0;
  state->limit = 1e30;
  if (frep_hint_box(a, lower, upper)) {
    for (unsigned k = 0; k < a->n; k++) diagonal = hypot(diagonal, upper[k] - lower[k]);
    if (diagonal > 0 && isfinite(diagonal)) state->limit = 10 * diagonal;
  }
  batten_status st = frep_rough_box(ctx, a, state->lower, state->upper);
  state->boxed = st >= 0;
  return batten_expect(ctx, st, BATTEN_E_NOT_FOUND);
}

batten_status batten_frep_normalize(batten_context *ctx, batten_frep *a, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st < 0) return st;
  normalized *state = batten_alloc(ctx, sizeof *state);
  if (!state) return BATTEN_E_NOMEM;
  st = measure(ctx, a, state);
  batten_frep_parts parts = {.n = a->n, .child_count = 1, .children = {a}};
  if (st >= 0) st = frep_make(ctx, &frep_class_normalize, &parts, false, state, out);
  if (st >= 0)
    (*out)->normal = true;
  else
    batten_free(ctx, state);
  return st;
}

static batten_status create_normalize(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 0, 1);
  return st < 0 ? st : batten_frep_normalize(ctx, parts->children[0], out);
}

const frep_class frep_class_normalize = {.kind = BATTEN_FREP_KIND_NORMALIZE,
                                         .name = "normalize",
                                         .evaluate = normalize_evaluate,
                                         .bounds = normalize_bounds,
                                         .box = normalize_box,
                                         .create = create_normalize};

/* ---- offset and shell ------------------------------------------------------------------------------------ */

/* A node over a, or over a normalized where that is no distance. */
static batten_status make_over_distance(batten_context *ctx, const frep_class *cls, batten_frep *a, double number,
                                        batten_frep **out) {
  batten_frep *below = batten_frep_retain(a);
  batten_status st = BATTEN_OK;
  if (!a->normal) {
    batten_frep_free(below);
    below = NULL;
    st = batten_frep_normalize(ctx, a, &below);
  }
  if (st >= 0) {
    batten_frep_parts parts = {
        .n = a->n, .number_count = 1, .numbers = &number, .child_count = 1, .children = {below}};
    st = frep_make(ctx, cls, &parts, below->distance, NULL, out);
  }
  if (st >= 0) (*out)->normal = true;
  batten_frep_free(below);
  return st;
}

/* What lies within a distance of the child. A distance never changes faster than the way, so what is left of it after
 * a negative offset lies as deep within the box. */
static bool grown_box(const batten_frep *a, double distance, double *lower, double *upper) {
  const batten_frep *child = a->children[0];
  if (!frep_structural_box(child, lower, upper)) return false;
  if (!child->distance) distance *= distance > 0 ? FIRST_ORDER_REACH : 0;
  for (unsigned k = 0; k < a->n; k++) {
    lower[k] = interval_sub(interval_of(lower[k]), interval_of(distance)).lo;
    upper[k] = interval_add(interval_of(upper[k]), interval_of(distance)).hi;
  }
  return true;
}

static batten_status offset_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                     double *values, double *gradients) {
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, points, values, gradients);
  for (size_t i = 0; st >= 0 && i < count; i++) values[i] += a->numbers[0];
  return st;
}

static batten_status offset_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *ranges) {
  batten_status st = frep_bounds_block(a->children[0], ctx, count, boxes, ranges);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval r = interval_add((interval){ranges[2 * i], ranges[2 * i + 1]}, interval_of(a->numbers[0]));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return st;
}

static bool offset_box(const batten_frep *a, double *lower, double *upper) {
  return grown_box(a, a->numbers[0], lower, upper);
}

batten_status batten_frep_offset(batten_context *ctx, batten_frep *a, double distance, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0) st = frep_check_numbers(ctx, "distance", 1, &distance);
  return st < 0 ? st : make_over_distance(ctx, &frep_class_offset, a, distance, out);
}

static batten_status create_offset(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 1, 1);
  return st < 0 ? st : batten_frep_offset(ctx, parts->children[0], parts->numbers[0], out);
}

static batten_status child_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  return frep_slopes_block(a->children[0], ctx, count, boxes, slopes);
}

const frep_class frep_class_offset = {.kind = BATTEN_FREP_KIND_OFFSET,
                                      .name = "offset",
                                      .evaluate = offset_evaluate,
                                      .bounds = offset_bounds,
                                      .slopes = child_slopes,
                                      .box = offset_box,
                                      .create = create_offset};

static batten_status shell_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  const size_t n = a->n;
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, points, values, gradients);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    bool inside = values[i] > 0;
    values[i] = a->numbers[0] / 2 - fabs(values[i]);
    for (size_t k = n * i; gradients && inside && k < n * i + n; k++) gradients[k] = -gradients[k];
  }
  return st;
}

static batten_status shell_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  batten_status st = frep_bounds_block(a->children[0], ctx, count, boxes, ranges);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval f = interval_abs((interval){ranges[2 * i], ranges[2 * i + 1]});
    interval r = interval_sub(interval_of(a->numbers[0] / 2), f);
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  return st;
}

static bool shell_box(const batten_frep *a, double *lower, double *upper) {
  return grown_box(a, a->numbers[0] / 2, lower, upper);
}

batten_status batten_frep_shell(batten_context *ctx, batten_frep *a, double thickness, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0) st = frep_check_positive(ctx, "thickness", thickness);
  return st < 0 ? st : make_over_distance(ctx, &frep_class_shell, a, thickness, out);
}

static batten_status create_shell(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 1, 1);
  return st < 0 ? st : batten_frep_shell(ctx, parts->children[0], parts->numbers[0], out);
}

const frep_class frep_class_shell = {.kind = BATTEN_FREP_KIND_SHELL,
                                     .name = "shell",
                                     .evaluate = shell_evaluate,
                                     .bounds = shell_bounds,
                                     .slopes = child_slopes,
                                     .box = shell_box,
                                     .create = create_shell};
