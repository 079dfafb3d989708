/* Other forms of a curve: more knots, a higher degree, parts of it, the other way round, elsewhere.
 *
 * All that changes knots and keeps the curve is basis/refine.c: a new knot vector, and control points by convex
 * combinations. A part is cut out between knots that were made as frequent as the degree. Of closed curves the part
 * may run over the seam: for it the curve is written down twice, one after the other. */
#include "curve_inner.h"

#include "base/checked.h"
#include "basis/refine.h"
#include "basis/sort_points.h"

#include <string.h>

/* ---- common -------------------------------------------------------------------------------------- */

static batten_status check_curve(batten_context *ctx, const batten_curve *curve, const void *out) {
  if (curve && out) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for another", curve ? "out" : "curve");
}

static size_t knot_count(const bspline *b) { return b->count + b->degree + 1; }

/* The curve over other knots [count] of a degree. */
static batten_status refine(batten_context *ctx, const bspline *from, const double *points, bool closed,
                            unsigned degree, size_t count, const double *knots, batten_curve **out) {
  bspline to = {degree, count - degree - 1, knots};
  double *control = batten_alloc_array(ctx, to.count, 2 * sizeof *control);
  if (!control) return BATTEN_E_NOMEM;
  bspline_refine(from, 2, points, &to, control);
  batten_status st = curve_make(ctx, &to, control, closed, out);
  batten_free(ctx, control);
  return st;
}

/* Knots that differ must still do so after they were moved, or they could become too frequent. remedy: what to do. */
static batten_status check_moved(batten_context *ctx, const char *name, const char *remedy, size_t count,
                                 const double *old, const double *moved) {
  for (size_t k = 1; k < count; k++)
    if (old[k - 1] != old[k] && moved[k - 1] == moved[k])
      return batten_fail(ctx, BATTEN_E_INVALID, "%s: knots %.17g and %.17g would both be %.17g there; %s", name,
                         old[k - 1], old[k], moved[k], remedy);
  return BATTEN_OK;
}

/* ---- knots --------------------------------------------------------------------------------------- */

/* Adds sorted knots to those of b: out [both]. */
static void merge_knots(const bspline *b, size_t count, const double *more, double *out) {
  size_t all = knot_count(b);
  for (size_t k = 0, i = 0; k < all || i < count;)
    *out++ = i == count || (k < all && b->knots[k] <= more[i]) ? b->knots[k++] : more[i++];
}

/* knots by `order` -> sorted [count], in the domain; names the one that is outside or too frequent. */
static batten_status sort_knots(batten_context *ctx, const batten_curve *curve, size_t count, const double *knots,
                                const uint32_t *order, double *sorted) {
  const bspline *b = &curve->space;
  size_t at = 0;
  unsigned times = 0;
  for (size_t i = 0; i < count; i++) {
    double t = sorted[i] = knots[order[i]];
    times = i > 0 && t == sorted[i - 1] ? times + 1 : 1;
    while (b->knots[at] < t) at++;
    unsigned there = 0;
    while (at + there < knot_count(b) && b->knots[at + there] == t) there++;
    if (there + times > b->degree)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "knots[%u]: %.17g would be there more often than %u times, the degree; leave it out",
                         (unsigned)order[i], t, b->degree);
  }
  return BATTEN_OK;
}

static batten_status insert_sorted(batten_context *ctx, const batten_curve *curve, size_t count, const double *sorted,
                                   batten_curve **out) {
  const bspline *b = &curve->space;
  size_t all;
  if (!batten_add(knot_count(b), count, &all))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu more knots; give fewer", count);
  double *knots = batten_alloc_array(ctx, all, sizeof *knots);
  if (!knots) return BATTEN_E_NOMEM;
  merge_knots(b, count, sorted, knots);
  batten_status st = refine(ctx, b, curve->control_points, curve->closed, b->degree, all, knots, out);
  batten_free(ctx, knots);
  return st;
}

batten_status batten_curve_insert_knots(batten_context *ctx, const batten_curve *curve, size_t count,
                                        const double *knots, batten_curve **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_curve(ctx, curve, out);
  if (st < 0) return st;
  if (count && !knots) return batten_fail(ctx, BATTEN_E_INVALID, "knots: NULL; give %zu", count);
  if (count > UINT32_MAX) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu more knots; give fewer", count);
  for (size_t i = 0; i < count && st >= 0; i++) st = curve_check_parameter(ctx, curve, "knots", i, knots[i]);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  double *wrapped = batten_alloc_array(ctx, count, 2 * sizeof *wrapped);
  uint32_t *order = wrapped ? batten_alloc_array(ctx, count, sizeof *order) : NULL;
  if (!order) goto done;
  for (size_t i = 0; i < count; i++) wrapped[i] = curve_wrap(curve, knots[i]);
  st = batten_sort_points(ctx, 1, count, wrapped, order);
  if (st >= 0) st = sort_knots(ctx, curve, count, wrapped, order, wrapped + count);
  if (st >= 0) st = insert_sorted(ctx, curve, count, wrapped + count, out);
done:
  batten_free(ctx, order);
  batten_free(ctx, wrapped);
  return st;
}

batten_status batten_curve_elevate(batten_context *ctx, const batten_curve *curve, unsigned degree,
                                   batten_curve **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_curve(ctx, curve, out);
  if (st < 0) return st;
  const bspline *b = &curve->space;
  if (degree < b->degree || degree > BATTEN_CURVE_DEGREE_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "degree: %u; give one from %u, the curve's, to %d", degree, b->degree,
                       BATTEN_CURVE_DEGREE_MAX);
  unsigned more = degree - b->degree;
  size_t all;
  batten_mul(bspline_span_count(b) + 1, more, &all);
  if (!batten_add(all, knot_count(b), &all))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu control points; elevate parts of the curve", b->count);
  double *knots = batten_alloc_array(ctx, all, sizeof *knots);
  if (!knots) return BATTEN_E_NOMEM;
  size_t at = 0;
  for (size_t k = 0; k < knot_count(b); k++) {
    bool last = k + 1 == knot_count(b) || b->knots[k] < b->knots[k + 1];
    for (unsigned times = 0; times < 1 + (last ? more : 0); times++) knots[at++] = b->knots[k];
  }
  st = refine(ctx, b, curve->control_points, curve->closed, degree, all, knots, out);
  batten_free(ctx, knots);
  return st;
}

/* ---- parts --------------------------------------------------------------------------------------- */

/* A closed curve twice: the seam becomes an inner knot that is there degree times. Knots and control points are in
 * one block, at *knots. */
static batten_status unroll(batten_context *ctx, const batten_curve *curve, bspline *space, double **block,
                            const double **points) {
  const bspline *b = &curve->space;
  unsigned d = b->degree;
  double period = bspline_upper(b) - bspline_lower(b);
  size_t count, numbers;
  batten_mul(b->count, 2, &count);
  count -= 1;
  if (!batten_mul(count, 3, &numbers) || !batten_add(numbers, d + 1, &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu control points; give fewer", b->count);
  double *knots = *block = batten_alloc_array(ctx, numbers, sizeof *knots);
  if (!knots) return BATTEN_E_NOMEM;
  size_t all = count + d + 1, seam = b->count; /* the knots before the upper end are the first's */
  memcpy(knots, b->knots, (seam + d) * sizeof *knots);
  for (size_t k = seam + d; k < all; k++) knots[k] = b->knots[k - seam + 1] + period;
  double *control = knots + all;
  memcpy(control, curve->control_points, 2 * b->count * sizeof *control);
  memcpy(control + 2 * b->count, curve->control_points + 2, 2 * (b->count - 1) * sizeof *control);
  *space = (bspline){d, count, knots};
  *points = control;
  return isfinite(knots[all - 1] - knots[0])
             ? check_moved(ctx, "to", "take the parts before and after the start of the domain one by one",
                           b->count - d, b->knots + d + 1, knots + seam + d)
             : batten_fail(ctx, BATTEN_E_INVALID, "to: two periods are beyond a double; stay within one");
}

/* Of knots [count]: how many come before t, and how many are t. */
static size_t find_knot(const bspline *b, double t, size_t *times) {
  size_t low = 0, high = knot_count(b);
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (b->knots[middle] < t)
      low = middle + 1;
    else
      high = middle;
  }
  size_t end = low;
  while (end < knot_count(b) && b->knots[end] == t) end++;
  *times = end - low;
  return low;
}

/* The part [ends[0], ends[1]] of a spline, as one over [named[0], named[1]]. */
static batten_status cut(batten_context *ctx, const bspline *b, const double *points, const double ends[2],
                         const double named[2], batten_curve **out) {
  unsigned d = b->degree;
  size_t added = 0, times, all, start;
  double more[2 * BSPLINE_DEGREE];
  for (int e = 0; e < 2; e++) {
    find_knot(b, ends[e], &times);
    for (; times < d; times++) more[added++] = ends[e];
  }
  bspline to = {.degree = d};
  if (!batten_add(knot_count(b), added, &all))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu control points; give fewer", b->count);
  batten_status st = BATTEN_E_NOMEM;
  double *knots = batten_alloc_array(ctx, all, 2 * sizeof *knots);
  double *control = knots ? batten_alloc_array(ctx, all, 2 * sizeof *control) : NULL;
  if (!control) goto done;
  merge_knots(b, added, more, knots);
  to.count = all - d - 1;
  to.knots = knots;
  bspline_refine(b, 2, points, &to, control);
  /* The last of the knots `from`, the first of the knots `to`, and what lies between. */
  start = find_knot(&to, ends[0], &times);
  start += times - 1;
  size_t end = find_knot(&to, ends[1], &times), inner = end - start - 1;
  double *part = knots + all, shift = named[0] - ends[0];
  for (size_t k = 0; k < inner + 2 * ((size_t)d + 1); k++)
    part[k] = k <= d ? named[0] : k > inner + d ? named[1] : knots[start + k - d] + shift;
  st = check_moved(ctx, "from", "give one inside the domain", inner + 2, knots + start, part + d);
  if (st < 0) goto done;
  const bspline space = {d, inner + d + 1, part};
  st = curve_make(ctx, &space, control + 2 * (start - d), false, out);
done:
  batten_free(ctx, control);
  batten_free(ctx, knots);
  return st;
}

batten_status batten_curve_part(batten_context *ctx, const batten_curve *curve, double from, double to,
                                batten_curve **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_curve(ctx, curve, out);
  if (st < 0) return st;
  const bspline *b = &curve->space;
  double upper = bspline_upper(b), period = upper - bspline_lower(b);
  st = curve_check_parameter(ctx, curve, "from", SIZE_MAX, from);
  if (st >= 0) st = curve_check_parameter(ctx, curve, "to", SIZE_MAX, to);
  if (st < 0) return st;
  if (!(from < to)) return batten_fail(ctx, BATTEN_E_INVALID, "to: %.17g; give one after from, %.17g", to, from);
  if (curve->closed && to > from + period)
    return batten_fail(ctx, BATTEN_E_INVALID, "to: %.17g; give one up to %.17g, once round from there", to,
                       from + period);
  const double named[2] = {from, to};
  double start = curve_wrap(curve, from), ends[2] = {start, start == from ? to : start + (to - from)};
  if (!(ends[0] < ends[1]))
    return batten_fail(ctx, BATTEN_E_INVALID, "to: %.17g; too near to from, %.17g, to differ from it in the domain",
                       to, from);
  if (ends[1] <= upper) return cut(ctx, b, curve->control_points, ends, named, out);
  double *block = NULL;
  const double *points = NULL;
  bspline twice;
  st = unroll(ctx, curve, &twice, &block, &points);
  if (st >= 0) {
    ends[1] = fmin(ends[1], bspline_upper(&twice));
    st = cut(ctx, &twice, points, ends, named, out);
  }
  batten_free(ctx, block);
  return st;
}

batten_status batten_curve_split(batten_context *ctx, const batten_curve *curve, double t, batten_curve **before,
                                 batten_curve **after) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_curve(ctx, curve, before);
  if (st >= 0) st = check_curve(ctx, curve, after);
  if (st < 0) return st;
  double lower = bspline_lower(&curve->space), upper = bspline_upper(&curve->space);
  if (!(t > lower && t < upper))
    return batten_fail(ctx, BATTEN_E_INVALID, "t: %.17g; give one between %.17g and %.17g", t, lower, upper);
  batten_curve *parts[2] = {NULL, NULL};
  st = batten_curve_part(ctx, curve, lower, t, &parts[0]);
  if (st >= 0) st = batten_curve_part(ctx, curve, t, upper, &parts[1]);
  if (st < 0) {
    batten_curve_free(parts[0]);
    return st;
  }
  *before = parts[0];
  *after = parts[1];
  return BATTEN_OK;
}

/* ---- the other way round, and elsewhere ---------------------------------------------------------- */

batten_status batten_curve_reverse(batten_context *ctx, const batten_curve *curve, batten_curve **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_curve(ctx, curve, out);
  if (st < 0) return st;
  const bspline *b = &curve->space;
  size_t all = knot_count(b);
  st = BATTEN_E_NOMEM;
  /* The new knots, and beside them the old ones that these were. */
  double *knots = batten_alloc_array(ctx, all, 2 * sizeof *knots);
  double *points = knots ? batten_alloc_array(ctx, b->count, 2 * sizeof *points) : NULL;
  if (!points) goto done;
  double lower = bspline_lower(b), upper = bspline_upper(b), *old = knots + all;
  for (size_t k = 0; k < all; k++) {
    double t = b->knots[all - 1 - k];
    knots[k] = t == lower ? upper : lower + (upper - t);
    old[k] = t;
  }
  st = check_moved(ctx, "curve", "its spans are too different in length; give it knots that are further apart", all,
                   old, knots);
  if (st < 0) goto done;
  for (size_t i = 0; i < b->count; i++)
    memcpy(points + 2 * i, curve->control_points + 2 * (b->count - 1 - i), 2 * sizeof *points);
  const bspline space = {b->degree, b->count, knots};
  st = curve_make(ctx, &space, points, curve->closed, out);
done:
  batten_free(ctx, points);
  batten_free(ctx, knots);
  return st;
}

static batten_status map_knots(batten_context *ctx, const bspline *b, const double domain[2], double *out) {
  double lower = bspline_lower(b), upper = bspline_upper(b), by = (domain[1] - domain[0]) / (upper - lower);
  for (size_t k = 0; k < knot_count(b); k++) {
    double t = b->knots[k], from = t - lower;
    /* The factor itself may be beyond a double, or below one. */
    double moved = isnormal(by) ? domain[0] + from * by : bspline_blend(domain[0], domain[1], from / (upper - lower));
    out[k] = t == upper ? domain[1] : fmin(moved, domain[1]);
  }
  return check_moved(ctx, "domain", "give one in which short spans are nearer to 0", knot_count(b), b->knots, out);
}

static batten_status check_transform(batten_context *ctx, const double *matrix, const double *shift,
                                     const double *domain) {
  const double *arrays[3] = {matrix, shift, domain};
  static const char *const names[3] = {"matrix", "shift", "domain"};
  static const size_t counts[3] = {4, 2, 2};
  for (int a = 0; a < 3; a++) {
    size_t bad = arrays[a] ? batten_first_nonfinite(counts[a], arrays[a]) : counts[a];
    if (bad < counts[a])
      return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; give finite numbers", names[a], bad, arrays[a][bad]);
  }
  if (domain && !(domain[0] < domain[1] && isfinite(domain[1] - domain[0])))
    return batten_fail(ctx, BATTEN_E_INVALID, "domain: %g to %g; give a rising one whose length is a double",
                       domain[0], domain[1]);
  return BATTEN_OK;
}

batten_status batten_curve_transform(batten_context *ctx, const batten_curve *curve, const double matrix[4],
                                     const double shift[2], const double domain[2], batten_curve **out) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_status st = check_curve(ctx, curve, out);
  if (st >= 0) st = check_transform(ctx, matrix, shift, domain);
  if (st < 0) return st;
  const bspline *b = &curve->space;
  st = BATTEN_E_NOMEM;
  double *knots = batten_alloc_array(ctx, knot_count(b), sizeof *knots);
  double *points = knots ? batten_alloc_array(ctx, b->count, 2 * sizeof *points) : NULL;
  if (!points) goto done;
  memcpy(knots, b->knots, knot_count(b) * sizeof *knots);
  st = domain ? map_knots(ctx, b, domain, knots) : BATTEN_OK;
  if (st < 0) goto done;
  for (size_t i = 0; i < b->count; i++) {
    const double *p = curve->control_points + 2 * i;
    for (size_t x = 0; x < 2; x++) {
      double moved = matrix ? matrix[2 * x] * p[0] + matrix[2 * x + 1] * p[1] : p[x];
      points[2 * i + x] = shift ? moved + shift[x] : moved;
    }
  }
  batten_curve_form form = {b->degree, knot_count(b), knots, points, curve->closed};
  st = batten_curve_create(ctx, &form, out); /* tells where points are beyond a double */
done:
  batten_free(ctx, points);
  batten_free(ctx, knots);
  return st;
}
