/* Set operations by R-functions, blends, negation, metamorphosis.   [Savchenko et al. 1995, section 1; Pasko,
 * Savchenko 1994 for blends]
 *
 *   union u(f, g) = (f + g + sqrt(f^2 + g^2 - 2 a f g)) / (1 + a);  intersection with - sqrt;  difference: g -> -g
 *
 * The root S is at least |f - a g| and |g - a f| (S^2 - (f - a g)^2 = (1 - a^2) g^2), so both partial derivatives
 * (1 +- (f - a g) / S) / (1 + a) are >= 0: an R-function grows with both arguments, and its range over ranges of f
 * and g is taken at their ends. a = 1 is max and min, taken as such: no rounding.
 *
 * A blend adds d(f, g) = a0 / (1 + (f / a1)^2 + (g / a2)^2), which falls where u grows. Its ranges come from the
 * signs of the partial derivatives of the sum over the ranges of f and g, and from the mean value form. */
#include <string.h>

#include "base/checked.h"
#include "frep/frep_inner.h"
#include "solid/carrier_inner.h"

/* ---- R-functions ----------------------------------------------------------------------------------- */

/* max (sign 1) or min (-1) of two fields, in place of f; where equal, the mean of both gradients. */
static void take_extreme(size_t n, double sign, size_t count, double *f, double *df, const double *g,
                         const double *dg) {
  for (size_t i = 0; i < count; i++) {
    bool equal = g[i] == f[i], other = sign * g[i] > sign * f[i];
    for (size_t k = n * i; df && (equal || other) && k < n * (i + 1); k++)
      df[k] = equal ? df[k] / 2 + dg[k] / 2 : dg[k];
    if (other) f[i] = g[i];
  }
}

static void join(unsigned n, double alpha, double sign, size_t count, double *f, double *df, const double *g,
                 const double *dg) {
  if (alpha == 1)
    take_extreme(n, sign, count, f, df, g, dg);
  else
    batten_carrier_combine(n, alpha, sign, count, f, df, NULL, g, dg, NULL);
}

/* One end of the range of an R-function. Towards infinity: a union with -infinity is the other argument. Beyond 1e150
 * squares overflow: there the end moves to infinity, or back to 1e150, whichever holds more. */
static double join_end(double alpha, double sign, double f, double g, double outward) {
  const double limit = 1e150;
  if (alpha == 1) return sign > 0 ? fmax(f, g) : fmin(f, g);
  double *both[2] = {&f, &g};
  for (int i = 0; i < 2; i++)
    if (fabs(*both[i]) > limit) *both[i] = *both[i] * outward > 0 ? outward * INFINITY : -outward * limit;
  if (isinf(f) || isinf(g)) {
    if (f == sign * INFINITY || g == sign * INFINITY) return sign * INFINITY;
    return isinf(f) ? g : f;
  }
  batten_carrier_combine(1, alpha, sign, 1, &f, NULL, NULL, &g, NULL, NULL);
  return f;
}

/* Rounding: of the terms under the root the one may cancel the other up to (1 + a) / 2 of both when f and g differ in
 * sign; the sum outside of it has no cancellation, as the formula is taken in the form that has none. So the result
 * is right to 8 + 16 / (1 + a) units, with room; 1e-150 is for squares that vanish below the smallest numbers. */
static interval join_range(double alpha, double sign, interval f, interval g) {
  double lo = join_end(alpha, sign, f.lo, g.lo, -1), hi = join_end(alpha, sign, f.hi, g.hi, 1);
  if (alpha == 1) return (interval){lo, hi};
  interval r = interval_widen(lo, hi, 8 + 16 / (1 + alpha));
  return (interval){r.lo - 1e-150, r.hi + 1e-150};
}

/* |c_f df + c_g dg| with c_f, c_g the partial derivatives: for a = 1 one of them is 0 and the other 1, else they are
 * 1 + cos and 1 + sin of an angle for a = 0, and within [0, 2 / (1 + a)] in general. */
static double join_slope(double alpha, double f, double g) {
  double slope = alpha == 1 ? fmax(f, g) : alpha == 0 ? f + g + hypot(f, g) : 2 / (1 + alpha) * (f + g);
  return slope * (1 + 1e-12);
}

/* ---- two children at a block ------------------------------------------------------------------------ */

/* The second child's values and gradients into one block of the caller's to free. */
static batten_status evaluate_both(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                   double *f, double *df, double **scratch) {
  size_t n = a->n;
  double *g = batten_alloc_array(ctx, count, (df ? 1 + n : 1) * sizeof *g);
  if (!g) return BATTEN_E_NOMEM;
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, points, f, df);
  if (st >= 0) st = frep_evaluate_block(a->children[1], ctx, count, points, g, df ? g + count : NULL);
  if (st >= 0)
    *scratch = g;
  else
    batten_free(ctx, g);
  return st;
}

typedef batten_status (*child_call)(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *out);

/* The same for bounds (2 numbers a box) and slopes (1). */
static batten_status call_both(const batten_frep *a, batten_context *ctx, child_call call, size_t count,
                               const double *boxes, size_t each, double *out, double **scratch) {
  double *g = batten_alloc_array(ctx, count, each * sizeof *g);
  if (!g) return BATTEN_E_NOMEM;
  batten_status st = call(a->children[0], ctx, count, boxes, out);
  if (st >= 0) st = call(a->children[1], ctx, count, boxes, g);
  if (st >= 0)
    *scratch = g;
  else
    batten_free(ctx, g);
  return st;
}

/* ---- union, intersection, difference ----------------------------------------------------------------- */

/* What the kind does: the sign of the root, and of the second argument. Blends have that of their operation. */
static double root_sign(const batten_frep *a) {
  return a->cls->kind == BATTEN_FREP_KIND_UNION || a->cls->kind == BATTEN_FREP_KIND_BLEND_UNION ? 1 : -1;
}
static bool turns_second(const batten_frep *a) {
  return a->cls->kind == BATTEN_FREP_KIND_DIFFERENCE || a->cls->kind == BATTEN_FREP_KIND_BLEND_DIFFERENCE;
}

static void turn(size_t count, double *v) {
  for (size_t i = 0; i < count; i++) v[i] = -v[i];
}

static interval second_range(const batten_frep *a, const double *range) {
  interval g = {range[0], range[1]};
  return turns_second(a) ? interval_neg(g) : g;
}

static batten_status combine_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  double *g = NULL;
  batten_status st = evaluate_both(a, ctx, count, points, values, gradients, &g);
  if (st < 0) return st;
  if (turns_second(a)) turn(count * (gradients ? 1 + a->n : 1), g);
  join(a->n, a->numbers[0], root_sign(a), count, values, gradients, g, gradients ? g + count : NULL);
  batten_free(ctx, g);
  return BATTEN_OK;
}

static batten_status combine_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  double *g = NULL;
  batten_status st = call_both(a, ctx, frep_bounds_block, count, boxes, 2, ranges, &g);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval f = {ranges[2 * i], ranges[2 * i + 1]};
    interval r = join_range(a->numbers[0], root_sign(a), f, second_range(a, g + 2 * i));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  batten_free(ctx, g);
  return st;
}

static batten_status combine_both(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges, double *slopes) {
  double *g = batten_alloc_array(ctx, count, 4 * sizeof *g), *dg = g + 2 * count;
  if (!g) return BATTEN_E_NOMEM;
  const double alpha = a->numbers[0], sign = root_sign(a);
  batten_status st = frep_both_block(a->children[0], ctx, count, boxes, ranges, slopes);
  if (st >= 0) st = frep_both_block(a->children[1], ctx, count, boxes, g, dg);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval f = {ranges[2 * i], ranges[2 * i + 1]}, second = second_range(a, g + 2 * i);
    interval df = {slopes[2 * i], slopes[2 * i + 1]};
    interval steep = batten_carrier_join_steep(alpha, sign, f, second, df, (interval){dg[2 * i], dg[2 * i + 1]});
    interval r = join_range(alpha, sign, f, second);
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
    slopes[2 * i] = steep.lo;
    slopes[2 * i + 1] = steep.hi;
  }
  batten_free(ctx, g);
  return st;
}

static bool hull_box(const batten_frep *a, double *lower, double *upper) {
  double low[3], high[3];
  if (!frep_structural_box(a->children[0], lower, upper) || !frep_structural_box(a->children[1], low, high))
    return false;
  for (unsigned k = 0; k < a->n; k++) {
    lower[k] = fmin(lower[k], low[k]);
    upper[k] = fmax(upper[k], high[k]);
  }
  return true;
}

static bool meet_box(const batten_frep *a, double *lower, double *upper) {
  double low[3], high[3];
  bool first = frep_structural_box(a->children[0], lower, upper);
  bool second = frep_structural_box(a->children[1], low, high);
  for (unsigned k = 0; second && k < a->n; k++) {
    lower[k] = first ? fmax(lower[k], low[k]) : low[k];
    upper[k] = first ? fmin(upper[k], high[k]) : high[k];
  }
  return first || second;
}

static bool first_box(const batten_frep *a, double *lower, double *upper) {
  return frep_structural_box(a->children[0], lower, upper);
}

static bool is_operation(batten_frep_operation operation) {
  return operation == BATTEN_FREP_UNION || operation == BATTEN_FREP_INTERSECTION ||
         operation == BATTEN_FREP_DIFFERENCE;
}

static batten_status check_pair(batten_context *ctx, batten_frep_operation operation, const batten_frep *a,
                                const batten_frep *b, const void *out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0 && !is_operation(operation))
    st = batten_fail(ctx, BATTEN_E_INVALID, "operation: %d; give union, intersection or difference", (int)operation);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st >= 0) st = frep_check_node(ctx, "b", b, a->n);
  return st;
}

static batten_status check_alpha(batten_context *ctx, double alpha) {
  if (alpha > -1 && alpha <= 1) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "alpha: %g; give -1 < alpha <= 1 (0 smooth, 1 max and min)", alpha);
}

static batten_status make_pair(batten_context *ctx, const frep_class *cls, batten_frep *a, batten_frep *b,
                               size_t number_count, const double *numbers, bool distance, batten_frep **out) {
  batten_frep_parts parts = {
      .n = a->n, .number_count = number_count, .numbers = numbers, .child_count = 2, .children = {a, b}};
  return frep_make(ctx, cls, &parts, distance, NULL, out);
}

batten_status batten_frep_combine(batten_context *ctx, batten_frep_operation operation, batten_frep *a,
                                  batten_frep *b, double alpha, batten_frep **out) {
  static const frep_class *const classes[] = {&frep_class_union, &frep_class_intersection, &frep_class_difference};
  batten_status st = check_pair(ctx, operation, a, b, out);
  if (st >= 0) st = check_alpha(ctx, alpha);
  if (st < 0) return st;
  bool distance = alpha == 1 && a->distance && b->distance;
  st = make_pair(ctx, classes[operation], a, b, 1, &alpha, distance, out);
  if (st >= 0) (*out)->normal = alpha == 1 && a->normal && b->normal;
  return st;
}

/* Neighbours in pairs until one is left: nodes[0] then. nodes are owned; on failure all are let go. */
static batten_status combine_in_pairs(batten_context *ctx, batten_frep_operation operation, size_t count,
                                      batten_frep **nodes, double alpha) {
  batten_status st = BATTEN_OK;
  while (st >= 0 && count > 1) {
    size_t made = 0;
    for (size_t i = 0; i < count; i += 2, made++) {
      batten_frep *pair = nodes[i];
      if (i + 1 < count) {
        pair = NULL;
        if (st >= 0) st = batten_frep_combine(ctx, operation, nodes[i], nodes[i + 1], alpha, &pair);
        batten_frep_free(nodes[i]);
        batten_frep_free(nodes[i + 1]);
      }
      nodes[made] = pair;
    }
    count = made;
  }
  if (st < 0)
    for (size_t i = 0; i < count; i++) batten_frep_free(nodes[i]);
  return st;
}

batten_status batten_frep_combine_all(batten_context *ctx, batten_frep_operation operation, size_t count,
                                      batten_frep *const *nodes, double alpha, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0 && !is_operation(operation))
    st = batten_fail(ctx, BATTEN_E_INVALID, "operation: %d; give union, intersection or difference", (int)operation);
  if (st >= 0 && count == 0) st = batten_fail(ctx, BATTEN_E_INVALID, "count: 0; give at least one node");
  if (st >= 0 && !nodes) st = batten_fail(ctx, BATTEN_E_INVALID, "nodes: NULL; give %zu nodes", count);
  for (size_t i = 0; st >= 0 && i < count; i++)
    if (!nodes[i] || nodes[i]->n != nodes[0]->n)
      st = batten_fail(ctx, BATTEN_E_INVALID,
                       nodes[i] ? "nodes[%zu]: of another dimension than nodes[0]"
                                  "; give nodes of one dimension"
                                : "nodes[%zu]: NULL; give a node",
                       i);
  if (st >= 0) st = check_alpha(ctx, alpha);
  if (st < 0) return st;
  batten_frep **work = batten_alloc_array(ctx, count, sizeof(batten_frep *));
  if (!work) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) work[i] = batten_frep_retain(nodes[i]);
  if (operation != BATTEN_FREP_DIFFERENCE) {
    st = combine_in_pairs(ctx, operation, count, work, alpha);
  } else if (count > 1) { /* what is taken away is united first */
    st = combine_in_pairs(ctx, BATTEN_FREP_UNION, count - 1, work + 1, alpha);
    if (st >= 0)
      st = combine_in_pairs(ctx, BATTEN_FREP_DIFFERENCE, 2, work, alpha);
    else
      batten_frep_free(work[0]);
  }
  if (st >= 0) *out = work[0];
  batten_free(ctx, work);
  return st;
}

static batten_status create_operation(batten_context *ctx, const batten_frep_parts *parts,
                                      batten_frep_operation operation, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 1, 2);
  if (st < 0) return st;
  return batten_frep_combine(ctx, operation, parts->children[0], parts->children[1], parts->numbers[0], out);
}
static batten_status create_union(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  return create_operation(ctx, parts, BATTEN_FREP_UNION, out);
}
static batten_status create_intersection(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  return create_operation(ctx, parts, BATTEN_FREP_INTERSECTION, out);
}
static batten_status create_difference(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  return create_operation(ctx, parts, BATTEN_FREP_DIFFERENCE, out);
}

const frep_class frep_class_union = {.kind = BATTEN_FREP_KIND_UNION,
                                     .name = "union",
                                     .evaluate = combine_evaluate,
                                     .bounds = combine_bounds,
                                     .both = combine_both,
                                     .box = hull_box,
                                     .create = create_union};
const frep_class frep_class_intersection = {.kind = BATTEN_FREP_KIND_INTERSECTION,
                                            .name = "intersection",
                                            .evaluate = combine_evaluate,
                                            .bounds = combine_bounds,
                                            .both = combine_both,
                                            .box = meet_box,
                                            .create = create_intersection};
const frep_class frep_class_difference = {.kind = BATTEN_FREP_KIND_DIFFERENCE,
                                          .name = "difference",
                                          .evaluate = combine_evaluate,
                                          .bounds = combine_bounds,
                                          .both = combine_both,
                                          .box = first_box,
                                          .create = create_difference};

/* ---- blends ------------------------------------------------------------------------------------------- */

static batten_status blend_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  const double a0 = a->numbers[0], a1 = a->numbers[1], a2 = a->numbers[2], sign = root_sign(a);
  double *g = NULL;
  batten_status st = evaluate_both(a, ctx, count, points, values, gradients, &g);
  if (st < 0) return st;
  size_t n = a->n;
  if (turns_second(a)) turn(count * (gradients ? 1 + n : 1), g);
  for (size_t i = 0; i < count; i++) {
    double *df = gradients ? gradients + n * i : NULL, *dg = g + count + n * i;
    double p = values[i] / a1, q = g[i] / a2, below = 1 + p * p + q * q, add = a0 / below, add_gradient[3];
    double by_f = -2 * add * (p / below / a1), by_g = -2 * add * (q / below / a2); /* so that widths may be tiny */
    for (size_t k = 0; df && k < n; k++) add_gradient[k] = by_f * df[k] + by_g * dg[k];
    batten_carrier_combine(a->n, 0, sign, 1, values + i, df, NULL, g + i, df ? dg : NULL, NULL);
    values[i] += add;
    for (size_t k = 0; df && k < n; k++) df[k] += add_gradient[k];
  }
  batten_free(ctx, g);
  return BATTEN_OK;
}

/* f / sqrt(f^2 + g^2) grows with f; with |g| it falls where f > 0 and grows where f < 0. */
static interval cosine_range(interval f, interval g) {
  interval size = interval_abs(g);
  double from = f.lo > 0 ? size.hi : size.lo, to = f.hi > 0 ? size.lo : size.hi;
  double lo = f.lo / hypot(f.lo, from), hi = f.hi / hypot(f.hi, to);
  interval r = interval_widen(lo, hi, 8);
  return (interval){lo >= -1 ? fmax(r.lo, -1) : -1, hi <= 1 ? fmin(r.hi, 1) : 1}; /* 0 / 0: anything */
}

/* What the blend adds over ranges of f and g. */
static interval addition_range(const double *numbers, interval f, interval g) {
  interval p = interval_div(f, interval_of(numbers[1])), q = interval_div(g, interval_of(numbers[2]));
  interval below = interval_add(interval_of(1), interval_add(interval_square(p), interval_square(q)));
  below.lo = fmax(below.lo, 1);
  return interval_div(interval_of(numbers[0]), below);
}

static interval blend_naive(const double *numbers, double sign, interval f, interval g) {
  return interval_add(join_range(0, sign, f, g), addition_range(numbers, f, g));
}

/* Partial derivatives of the blend: 1 +- f / S - 2 d (f / a1^2) / (1 + ...), likewise by g. */
static void blend_partials(const double *numbers, double sign, interval f, interval g, interval partial[2]) {
  interval add = addition_range(numbers, f, g);
  interval ratio = addition_range((const double[3]){1, numbers[1], numbers[2]}, f, g);
  for (int which = 0; which < 2; which++) {
    interval own = which ? g : f, other = which ? f : g, width = interval_of(numbers[1 + which]);
    interval root = interval_add(interval_of(1), interval_scale(cosine_range(own, other), sign));
    interval slope = interval_div(interval_div(own, width), width);
    partial[which] = interval_sub(root, interval_mul(interval_mul(interval_scale(add, 2), ratio), slope));
  }
}

/* An argument along which the blend goes one way only counts with its ends; beside that the mean value form. */
static interval blend_range(const double *numbers, double sign, interval f, interval g) {
  interval naive = blend_naive(numbers, sign, f, g), partial[2];
  if (!(isfinite(f.lo) && isfinite(f.hi) && isfinite(g.lo) && isfinite(g.hi))) return naive;
  blend_partials(numbers, sign, f, g, partial);
  interval args[2] = {f, g}, low[2], high[2], middle[2];
  for (int i = 0; i < 2; i++) {
    low[i] = high[i] = args[i];
    if (partial[i].lo >= 0) low[i].hi = args[i].lo, high[i].lo = args[i].hi;
    if (partial[i].hi <= 0) low[i].lo = args[i].hi, high[i].hi = args[i].lo;
    middle[i] = interval_of(args[i].lo / 2 + args[i].hi / 2);
  }
  interval least = blend_naive(numbers, sign, low[0], low[1]), most = blend_naive(numbers, sign, high[0], high[1]);
  interval mean = blend_naive(numbers, sign, middle[0], middle[1]);
  for (int i = 0; i < 2; i++) mean = interval_add(mean, interval_mul(partial[i], interval_sub(args[i], middle[i])));
  interval r = interval_meet((interval){least.lo, most.hi}, mean);
  /* The sum is right to a few units of its terms, which may be larger than it, and larger within than at the ends. */
  double slack = 0x1p-48 * (fmax(fabs(naive.lo), fabs(naive.hi)) + 2 * fabs(numbers[0]));
  return (interval){r.lo - slack, r.hi + slack};
}

static batten_status blend_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  double *g = NULL;
  batten_status st = call_both(a, ctx, frep_bounds_block, count, boxes, 2, ranges, &g);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval f = {ranges[2 * i], ranges[2 * i + 1]};
    interval r = blend_range(a->numbers, root_sign(a), f, second_range(a, g + 2 * i));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  batten_free(ctx, g);
  return st;
}

/* |p| / (1 + p^2 + ...)^2 is at most 3 sqrt(3) / 16 < 0.325, reached at p^2 = 1/3. */
static batten_status blend_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  double *g = NULL;
  batten_status st = call_both(a, ctx, frep_slopes_block, count, boxes, 1, slopes, &g);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    double added = 0.65 * fabs(a->numbers[0]) * (slopes[i] / a->numbers[1] + g[i] / a->numbers[2]);
    slopes[i] = join_slope(0, slopes[i], g[i]) + added;
  }
  batten_free(ctx, g);
  return st;
}

/* Material that is taken away leaves the operation's box. What is added has f + g +- sqrt(f^2 + g^2) >= -a0: of a
 * union
 * -(2 - sqrt 2) times the smaller of |f| and |g| is at least that, so that one of both is above -1.71 a0; of an
 * intersection both are. A distance is so only as far out; of others that is taken to be 4 times as far, as for
 * offsets. */
static bool blend_box(const batten_frep *a, double *lower, double *upper) {
  bool second = !turns_second(a), known = !second            ? first_box(a, lower, upper)
                                          : root_sign(a) > 0 ? hull_box(a, lower, upper)
                                                             : meet_box(a, lower, upper);
  if (!known || a->numbers[0] <= 0) return known;
  bool distance = a->children[0]->distance && (!second || a->children[1]->distance);
  double reach = 1.71 * a->numbers[0] * (distance ? 1 : 4);
  for (unsigned k = 0; k < a->n; k++) {
    lower[k] -= reach;
    upper[k] += reach;
  }
  return true;
}

batten_status batten_frep_blend(batten_context *ctx, batten_frep_operation operation, batten_frep *a, batten_frep *b,
                                double a0, double a1, double a2, batten_frep **out) {
  static const frep_class *const classes[] = {&frep_class_blend_union, &frep_class_blend_intersection,
                                              &frep_class_blend_difference};
  batten_status st = check_pair(ctx, operation, a, b, out);
  if (st >= 0) st = frep_check_numbers(ctx, "a0", 1, &a0);
  if (st >= 0) st = frep_check_positive(ctx, "a1", a1);
  if (st >= 0) st = frep_check_positive(ctx, "a2", a2);
  if (st < 0) return st;
  return make_pair(ctx, classes[operation], a, b, 3, (const double[3]){a0, a1, a2}, false, out);
}

static batten_status create_blend(batten_context *ctx, const batten_frep_parts *parts,
                                  batten_frep_operation operation, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 3, 2);
  if (st < 0) return st;
  const double *v = parts->numbers;
  return batten_frep_blend(ctx, operation, parts->children[0], parts->children[1], v[0], v[1], v[2], out);
}
static batten_status create_blend_union(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  return create_blend(ctx, parts, BATTEN_FREP_UNION, out);
}
static batten_status create_blend_intersection(batten_context *ctx, const batten_frep_parts *parts,
                                               batten_frep **out) {
  return create_blend(ctx, parts, BATTEN_FREP_INTERSECTION, out);
}
static batten_status create_blend_difference(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  return create_blend(ctx, parts, BATTEN_FREP_DIFFERENCE, out);
}

const frep_class frep_class_blend_union = {.kind = BATTEN_FREP_KIND_BLEND_UNION,
                                           .name = "blend-union",
                                           .evaluate = blend_evaluate,
                                           .bounds = blend_bounds,
                                           .slopes = blend_slopes,
                                           .box = blend_box,
                                           .create = create_blend_union};
const frep_class frep_class_blend_intersection = {.kind = BATTEN_FREP_KIND_BLEND_INTERSECTION,
                                                  .name = "blend-intersection",
                                                  .evaluate = blend_evaluate,
                                                  .bounds = blend_bounds,
                                                  .slopes = blend_slopes,
                                                  .box = blend_box,
                                                  .create = create_blend_intersection};
const frep_class frep_class_blend_difference = {.kind = BATTEN_FREP_KIND_BLEND_DIFFERENCE,
                                                .name = "blend-difference",
                                                .evaluate = blend_evaluate,
                                                .bounds = blend_bounds,
                                                .slopes = blend_slopes,
                                                .box = blend_box,
                                                .create = create_blend_difference};

/* ---- negation ------------------------------------------------------------------------------------------ */

static batten_status negation_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                       double *values, double *gradients) {
  batten_status st = frep_evaluate_block(a->children[0], ctx, count, points, values, gradients);
  if (st < 0) return st;
  turn(count, values);
  if (gradients) turn(count * a->n, gradients);
  return st;
}

static void turn_ranges(size_t count, double *ranges) {
  for (size_t i = 0; i < count; i++) {
    double lo = ranges[2 * i];
    ranges[2 * i] = -ranges[2 * i + 1];
    ranges[2 * i + 1] = -lo;
  }
}

static batten_status negation_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                     double *ranges) {
  batten_status st = frep_bounds_block(a->children[0], ctx, count, boxes, ranges);
  if (st >= 0) turn_ranges(count, ranges);
  return st;
}

static batten_status negation_both(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                   double *ranges, double *slopes) {
  batten_status st = frep_both_block(a->children[0], ctx, count, boxes, ranges, slopes);
  if (st >= 0) turn_ranges(count, ranges);
  return st;
}

batten_status batten_frep_negation(batten_context *ctx, batten_frep *a, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 0);
  if (st < 0) return st;
  batten_frep_parts parts = {.n = a->n, .child_count = 1, .children = {a}};
  st = frep_make(ctx, &frep_class_negation, &parts, a->distance, NULL, out);
  if (st >= 0) (*out)->normal = a->normal;
  return st;
}

static batten_status create_negation(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 0, 1);
  return st < 0 ? st : batten_frep_negation(ctx, parts->children[0], out);
}

const frep_class frep_class_negation = {.kind = BATTEN_FREP_KIND_NEGATION,
                                        .name = "negation",
                                        .evaluate = negation_evaluate,
                                        .bounds = negation_bounds,
                                        .both = negation_both,
                                        .create = create_negation};

/* ---- metamorphosis ------------------------------------------------------------------------------------- */

/* The child that the morph is, at its ends; NULL between. */
static const batten_frep *morph_end(const batten_frep *a) {
  return a->numbers[0] == 0 ? a->children[0] : a->numbers[0] == 1 ? a->children[1] : NULL;
}

static batten_status morph_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                    double *values, double *gradients) {
  const batten_frep *end = morph_end(a);
  if (end) return frep_evaluate_block(end, ctx, count, points, values, gradients);
  const double t = a->numbers[0];
  double *g = NULL;
  batten_status st = evaluate_both(a, ctx, count, points, values, gradients, &g);
  if (st < 0) return st;
  for (size_t i = 0; i < count; i++) values[i] = (1 - t) * values[i] + t * g[i];
  for (size_t i = 0; gradients && i < count * a->n; i++) gradients[i] = (1 - t) * gradients[i] + t * g[count + i];
  batten_free(ctx, g);
  return st;
}

static batten_status morph_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges) {
  const batten_frep *end = morph_end(a);
  if (end) return frep_bounds_block(end, ctx, count, boxes, ranges);
  const double t = a->numbers[0];
  double *g = NULL;
  batten_status st = call_both(a, ctx, frep_bounds_block, count, boxes, 2, ranges, &g);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    interval f = interval_scale((interval){ranges[2 * i], ranges[2 * i + 1]}, 1 - t);
    interval r = interval_add(f, interval_scale((interval){g[2 * i], g[2 * i + 1]}, t));
    ranges[2 * i] = r.lo;
    ranges[2 * i + 1] = r.hi;
  }
  batten_free(ctx, g);
  return st;
}

static batten_status morph_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes) {
  const double t = a->numbers[0];
  double *g = NULL;
  batten_status st = call_both(a, ctx, frep_slopes_block, count, boxes, 1, slopes, &g);
  for (size_t i = 0; st >= 0 && i < count; i++)
    slopes[i] = (t < 1 ? (1 - t) * slopes[i] : 0) + (t > 0 ? t * g[i] : 0);
  batten_free(ctx, g);
  return st;
}

/* Where a mean of both is not negative, one of them is not. */
static bool morph_box(const batten_frep *a, double *lower, double *upper) {
  const batten_frep *end = morph_end(a);
  return end ? frep_structural_box(end, lower, upper) : hull_box(a, lower, upper);
}

batten_status batten_frep_morph(batten_context *ctx, batten_frep *a, batten_frep *b, double t, batten_frep **out) {
  batten_status st = check_pair(ctx, BATTEN_FREP_UNION, a, b, out);
  if (st >= 0 && !(t >= 0 && t <= 1)) st = batten_fail(ctx, BATTEN_E_INVALID, "t: %g; give 0 <= t <= 1", t);
  if (st < 0) return st;
  bool distance = t == 0 ? a->distance : t == 1 && b->distance;
  return make_pair(ctx, &frep_class_morph, a, b, 1, &t, distance, out);
}

static batten_status create_morph(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  batten_status st = frep_check_parts(ctx, parts, 1, 2);
  return st < 0 ? st : batten_frep_morph(ctx, parts->children[0], parts->children[1], parts->numbers[0], out);
}

const frep_class frep_class_morph = {.kind = BATTEN_FREP_KIND_MORPH,
                                     .name = "morph",
                                     .evaluate = morph_evaluate,
                                     .bounds = morph_bounds,
                                     .slopes = morph_slopes,
                                     .box = morph_box,
                                     .create = create_morph};
