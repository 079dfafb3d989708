/* Where contours are flat and where they have inflections. */
#include <string.h>

#include "base/checked.h"
#include "basis/refine.h"
#include "shape_inner.h"

/* x'' on a span of length h is 0 where it changes x' by less over the span: of x', and of the size of contours. */
static const double FLAT = 0x1p-33, FLAT_ROUNDING = 0x1p-46;
/* Of the shorter span beside it: inflections that near to a knot are meant to be there. */
static const double NEAR = 1e-6;

/* ---- a contour at t ------------------------------------------------------------------------------ */

size_t shape_span(const loft_space *s, double t) {
  size_t low = 0, high = s->spans;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (s->breaks[middle] <= t)
      low = middle;
    else
      high = middle;
  }
  return low;
}

double shape_wrap(const loft_space *s, double t) {
  if (!s->closed) return t;
  t -= floor(t);
  return t < 1 ? t : 0;
}

double shape_break(const loft_space *s, ptrdiff_t i) {
  if (!s->closed) return s->breaks[i];
  ptrdiff_t n = (ptrdiff_t)s->spans, periods = i >= 0 ? i / n : -((n - 1 - i) / n);
  return s->breaks[i - periods * n] + (double)periods;
}

static void derivatives(const loft_contour *c, size_t span, double t, double first[2], double second[2]) {
  const loft_space *s = &c->space;
  double table[3 * BSPLINE_ORDER];
  unsigned d = s->degree;
  bspline_basis(&s->b, s->first[span] + d, t, 2, table);
  for (size_t x = 0; x < 2; x++) {
    first[x] = second[x] = 0;
    for (size_t j = 0; j <= d; j++) {
      double p = c->points[2 * ((s->first[span] + j) % s->count) + x];
      first[x] += table[d + 1 + j] * p;
      second[x] += table[2 * (d + 1) + j] * p;
    }
  }
}

/* [x', x''] beyond what is 0; 0 otherwise. */
static double bend_at(const loft_contour *c, size_t span, double t) {
  double first[2], second[2], h = c->space.breaks[span + 1] - c->space.breaks[span];
  derivatives(c, span, t, first, second);
  double speed = hypot(first[0], first[1]), g = loft_cross(first, second);
  return fabs(g) * h <= speed * (FLAT * speed + FLAT_ROUNDING / h) ? 0 : g;
}

bool shape_is_flat(const loft_contour *c, size_t span, double t) {
  double first[2], second[2], h = c->space.breaks[span + 1] - c->space.breaks[span];
  derivatives(c, span, t, first, second);
  return hypot(second[0], second[1]) * h <= FLAT * hypot(first[0], first[1]) + FLAT_ROUNDING / h;
}

int shape_sign(const loft_contour *c, double a, double b) {
  enum { SAMPLES = 8 };
  double most = 0;
  for (int k = 0; k < SAMPLES; k++) {
    double t = shape_wrap(&c->space, bspline_blend(a, b, (k + 0.5) / SAMPLES));
    if (!(t >= 0 && t <= 1)) continue;
    double g = bend_at(c, shape_span(&c->space, t), t);
    if (fabs(g) > fabs(most)) most = g;
  }
  return (most > 0) - (most < 0);
}

static int span_sign(const loft_contour *c, size_t span) {
  return shape_sign(c, c->space.breaks[span], c->space.breaks[span + 1]);
}

/* ---- places -------------------------------------------------------------------------------------- */

static batten_status add(batten_context *ctx, shape_places *list, const shape_place *place) {
  if (list->count == list->room) {
    size_t room = list->room ? 2 * list->room : 16;
    shape_place *at = batten_realloc_array(ctx, list->at, room, sizeof *at);
    if (!at) return BATTEN_E_NOMEM;
    list->at = at;
    list->room = room;
  }
  size_t k = list->count++;
  for (; k > 0 && list->at[k - 1].t > place->t; k--) list->at[k] = list->at[k - 1];
  list->at[k] = *place;
  return BATTEN_OK;
}

/* The break that t is meant to be, SIZE_MAX if none. */
static size_t find_break(const loft_space *s, double t) {
  size_t span = shape_span(s, t);
  for (size_t i = span; i <= span + 1; i++) {
    bool inner = s->closed || (i > 0 && i < s->spans);
    double h = s->breaks[span + 1] - s->breaks[span];
    if (inner) {
      double a = shape_break(s, (ptrdiff_t)i - 1), b = shape_break(s, (ptrdiff_t)i),
             c = shape_break(s, (ptrdiff_t)i + 1);
      h = fmin(b - a, c - b);
    }
    if (fabs(t - s->breaks[i]) <= NEAR * h) return s->closed && i == s->spans ? 0 : i;
  }
  return SIZE_MAX;
}

static size_t span_before(const loft_space *s, size_t i) { return i > 0 ? i - 1 : s->spans - 1; }

/* An inflection at break i. */
static shape_kind kind_at(const loft_contour *c, size_t i) {
  const loft_space *s = &c->space;
  size_t left = span_before(s, i), right = i;
  bool flat[2] = {shape_is_flat(c, left, s->breaks[left + 1]), shape_is_flat(c, right, s->breaks[i])};
  if (flat[0] && flat[1]) return SHAPE_FLAT;
  if (s->folds[i] + 1 < s->degree) return SHAPE_BENT;
  return bend_at(c, left, s->breaks[left + 1]) * bend_at(c, right, s->breaks[i]) < 0 ? SHAPE_JUMP : SHAPE_BENT;
}

static shape_place classify(const loft_contour *c, double t) {
  const loft_space *s = &c->space;
  shape_place p = {.t = t, .kind = SHAPE_BENT, .inflection = true};
  size_t i = find_break(s, t), span = shape_span(s, t);
  if (span_sign(c, span) == 0 || (i != SIZE_MAX && (s->closed || i > 0) && span_sign(c, span_before(s, i)) == 0)) {
    if (span_sign(c, span) != 0) span = span_before(s, i);
    ptrdiff_t from = (ptrdiff_t)span, to = from + 1, n = (ptrdiff_t)s->spans;
    while ((s->closed ? to - from < n : from > 0) && span_sign(c, (size_t)((from - 1 + n) % n)) == 0) from--;
    while ((s->closed ? to - from < n : to < n) && span_sign(c, (size_t)(to % n)) == 0) to++;
    p.kind = SHAPE_STRAIGHT;
    p.from = shape_wrap(s, shape_break(s, from));
    p.to = shape_wrap(s, shape_break(s, to));
  } else if (i != SIZE_MAX) {
    p.t = s->breaks[i];
    p.kind = kind_at(c, i);
  } else if (shape_is_flat(c, span, t)) {
    p.kind = SHAPE_FLAT;
  }
  return p;
}

/* Flat breaks that are no inflections: ends of straight pieces, natural ends. x'' is 0 on both sides, or jumps. */
static batten_status add_flat(batten_context *ctx, const loft_contour *c, shape_places *list) {
  const loft_space *s = &c->space;
  for (size_t i = 0; i < s->spans + (s->closed ? 0 : 1); i++) {
    double t = s->breaks[i];
    bool left = s->closed || i > 0, right = s->closed || i < s->spans, known = false;
    size_t before = span_before(s, i);
    if (left && !shape_is_flat(c, before, s->breaks[before + 1])) continue;
    if (right && !shape_is_flat(c, i, t)) continue;
    for (size_t k = 0; k < list->count; k++) known = known || (list->at[k].t == t && list->at[k].kind == SHAPE_FLAT);
    if (known) continue;
    const shape_place p = {.t = t, .kind = SHAPE_FLAT};
    batten_status st = add(ctx, list, &p);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* Signs beside places: between them the curvature has one. */
static void find_signs(const loft_contour *c, shape_places *list) {
  bool closed = c->space.closed;
  for (size_t k = 0; k < list->count; k++) {
    shape_place *p = list->at + k;
    double last = k > 0 ? p[-1].t : closed ? list->at[list->count - 1].t - 1 : 0;
    double next = k + 1 < list->count ? p[1].t : closed ? list->at[0].t + 1 : 1;
    p->before = last < p->t ? shape_sign(c, last, p->t) : 0;
    p->after = p->t < next ? shape_sign(c, p->t, next) : 0;
  }
}

batten_status shape_curve(batten_context *ctx, const loft_contour *c, batten_curve **out) {
  size_t count = 0;
  double *knots = NULL, *points = NULL;
  loft_matrix m = {0};
  batten_status st = loft_clamped(ctx, &c->space, &count, &knots, &m);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  points = batten_alloc_array(ctx, m.rows, 2 * sizeof *points);
  if (!points) goto done;
  loft_matrix_apply(&m, c->points, points);
  const batten_curve_form form = {c->space.degree, count, knots, points, c->space.closed};
  st = batten_curve_create(ctx, &form, out);
done:
  batten_free(ctx, points);
  batten_free(ctx, knots);
  loft_matrix_free(ctx, &m);
  return st;
}

batten_status shape_places_find(batten_context *ctx, const loft_contour *c, const batten_curve *curve,
                                shape_places *out) {
  size_t count = 0;
  double *inflections = NULL;
  batten_status st = batten_curve_inflections(ctx, curve, &count, &inflections);
  for (size_t k = 0; k < count && st >= 0; k++) {
    const shape_place p = classify(c, shape_wrap(&c->space, inflections[k]));
    st = add(ctx, out, &p);
  }
  if (st >= 0) st = add_flat(ctx, c, out);
  if (st >= 0) find_signs(c, out);
  batten_free(ctx, inflections);
  return st;
}
