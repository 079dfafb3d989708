/* Assumptions (2) and (3) on contours, made true by knots, and what is told of them.   [Juettler, section 3.1]
 *
 * Inflections become knots that part the vertices of both sides: x'' jumps at them, or is 0 and then itself a control
 * point of x'' (a knot degree - 2 fold). A neighbour that has such a place at the same t (a partner) keeps the
 * inflections between both there. Otherwise sections must be free near the place, on the side on which the neighbour
 * bends to the same side: a knot at a small part of the span ends that. So it does on both sides of inflections at
 * which x'' is not 0. */
#include <string.h>

#include "base/checked.h"
#include "basis/refine.h"
#include "shape_inner.h"

/* Of the domain: inflections of neighbours inside spans that are nearer are one. */
static const double SAME = 1e-9;

static size_t neighbour(size_t i, int side) { return side ? i + 1 : i - 1; }
static bool has_neighbour(const loft_stack *s, size_t i, int side) { return side ? i + 1 < s->count : i > 0; }

/* ---- partners ------------------------------------------------------------------------------------ */

/* Flat places inside spans go where the neighbour's is, if it is flat there, too. */
static void join(const loft_contour *c, shape_places *own, const shape_places *other) {
  for (size_t k = 0; k < own->count; k++) {
    shape_place *p = own->at + k;
    if (p->kind != SHAPE_FLAT || !p->inflection) continue;
    size_t span = shape_span(&c->space, p->t);
    if (c->space.breaks[span] == p->t) continue;
    for (size_t q = 0; q < other->count; q++) {
      double t = other->at[q].t;
      if (other->at[q].kind != SHAPE_FLAT || !(fabs(t - p->t) <= SAME)) continue;
      if (shape_span(&c->space, t) == span && shape_is_flat(c, span, t)) p->t = t;
    }
  }
}

static bool is_partner(const shape_place *p, const shape_place *q) {
  if (p->kind != q->kind || p->inflection != q->inflection) return false;
  if (p->inflection && (p->before != q->before || p->after != q->after)) return false;
  return p->kind == SHAPE_STRAIGHT ? p->from == q->from && p->to == q->to : p->t == q->t && p->kind != SHAPE_BENT;
}

static void find_partners(shape_places *own, int side, const shape_places *other) {
  for (size_t k = 0; k < own->count; k++) {
    own->at[k].partner[side] = false;
    for (size_t q = 0; q < other->count; q++)
      if (is_partner(own->at + k, other->at + q)) own->at[k].partner[side] = true;
  }
}

/* ---- zones --------------------------------------------------------------------------------------- */

/* Where the zone beside a place ends, on the side of lower (-1) or higher t (1); NaN if there is no span. */
static double zone_end(const loft_space *s, const shape_places *places, size_t k, int way, double zone) {
  double t = places->at[k].t;
  size_t span = shape_span(s, t);
  ptrdiff_t i = (ptrdiff_t)span + (way > 0 ? 1 : 0), n = (ptrdiff_t)s->spans;
  if (way < 0 && s->breaks[span] == t) i--;
  if (!s->closed && (i < 0 || i > n || t == (way > 0 ? 1 : 0))) return NAN;
  double next = shape_break(s, i), reach = zone * fabs(next - t);
  /* A knot just beside it: beyond that. */
  bool more = s->closed || (i + way >= 0 && i + way <= n);
  if (more) {
    double beyond = fabs(shape_break(s, i + way) - next);
    if (fabs(next - t) < zone * beyond) reach = fabs(next - t) + zone * beyond;
  }
  size_t m = places->count;
  if (s->closed || (way > 0 ? k + 1 < m : k > 0)) {
    double other = places->at[(k + (way > 0 ? 1 : m - 1)) % m].t, gap = way * (other - t);
    if (s->closed && gap <= 0) gap += 1;
    reach = fmin(reach, gap / 3);
  }
  return t + way * reach;
}

/* Whether sections are to keep a sign somewhere on the span there: that of a neighbour for which the place is no
 * partner. */
static bool needs_zone(const loft_stack *s, size_t i, const shape_place *p, double end, double zone) {
  enum { PARTS = 8 };
  int sign = shape_sign(s->contours + i, p->t, end);
  double part = (end - p->t) / zone / PARTS;
  for (int side = 0; side < 2; side++) {
    if (!has_neighbour(s, i, side) || p->partner[side] || sign == 0) continue;
    const loft_contour *other = s->contours + neighbour(i, side);
    for (int k = 0; k < PARTS; k++)
      if (sign == shape_sign(other, p->t + k * part, p->t + (k + 1) * part)) return true;
  }
  return false;
}

/* Knots of contour i: flat places, and where zones end. */
static batten_status add_knots(batten_context *ctx, loft_stack *s, size_t i, shape_places *places, double zone,
                               shape_knots *list) {
  const loft_space *space = &s->contours[i].space;
  unsigned fold = s->degree > 3 ? s->degree - 2 : 1;
  batten_status st = BATTEN_OK;
  for (size_t k = 0; k < places->count && st >= 0; k++) {
    shape_place *p = places->at + k;
    bool inner = s->closed || (p->t > 0 && p->t < 1);
    if (p->kind != SHAPE_FLAT && p->kind != SHAPE_BENT) continue;
    if (p->kind == SHAPE_FLAT && inner && s->degree > 2) st = shape_knots_add(ctx, list, p->t, fold);
    for (int way = -1; way <= 1 && st >= 0; way += 2) {
      double end = zone_end(space, places, k, way, zone);
      if (p->kind == SHAPE_BENT) *(way < 0 ? &p->from : &p->to) = isnan(end) ? p->t : end;
      if (isnan(end) || (p->kind == SHAPE_FLAT && !needs_zone(s, i, p, end, zone))) continue;
      end = shape_wrap(space, end);
      if (s->closed || (end > 0 && end < 1)) st = shape_knots_add(ctx, list, end, fold);
    }
  }
  return st;
}

/* ---- notes --------------------------------------------------------------------------------------- */

static batten_status tell(batten_context *ctx, loft_stack *s, batten_loft_remark remark, size_t i, size_t other,
                          double t) {
  const batten_loft_note note = {
      .remark = remark, .contour = i, .other = other, .t = s->domain[0] + t * (s->domain[1] - s->domain[0])};
  return loft_stack_note(ctx, s, &note);
}

/* An inflection at the same t, of whatever kind, that goes the same way. */
static bool has_inflection(const shape_places *places, const shape_place *p) {
  for (size_t k = 0; k < places->count; k++)
    if (places->at[k].inflection && fabs(places->at[k].t - p->t) <= SAME && places->at[k].before == p->before)
      return true;
  return false;
}

static batten_status tell_all(batten_context *ctx, loft_stack *s, size_t i, const shape_places *all) {
  batten_status st = BATTEN_OK;
  for (size_t k = 0; k < all[i].count && st >= 0; k++) {
    const shape_place *p = all[i].at + k;
    if (!p->inflection) continue;
    s->inflections++;
    bool missed = p->kind == SHAPE_BENT;
    if (missed) st = tell(ctx, s, BATTEN_LOFT_NOT_FLAT, i, i, p->t);
    for (int side = 0; side < 2 && st >= 0; side++) {
      if (!has_neighbour(s, i, side) || p->partner[side]) continue;
      size_t other = neighbour(i, side);
      if (p->kind == SHAPE_BENT && has_inflection(all + other, p)) continue;
      missed = true;
      st = tell(ctx, s, BATTEN_LOFT_UNMATCHED, i, other, p->t);
    }
    s->unmatched += missed;
  }
  return st;
}

/* The first place at which a contour crosses itself: the loft does, too, which is for the caller to judge. */
static batten_status tell_crossing(batten_context *ctx, loft_stack *s, size_t i, const batten_curve *curve) {
  size_t count = 0;
  double(*crossings)[2] = NULL;
  batten_status st = batten_curve_crossings(ctx, curve, &count, &crossings);
  if (st >= 0 && count > 0) {
    s->self_crossing++;
    st = tell(ctx, s, BATTEN_LOFT_SELF_CROSSING, i, i, crossings[0][0]);
  }
  batten_free(ctx, crossings);
  return st;
}

static batten_status look_at(batten_context *ctx, loft_stack *s, size_t i, shape_places *out) {
  batten_curve *curve = NULL;
  batten_status st = shape_curve(ctx, s->contours + i, &curve);
  if (st >= 0) st = shape_places_find(ctx, s->contours + i, curve, out);
  if (st >= 0) st = tell_crossing(ctx, s, i, curve);
  batten_curve_free(curve);
  return st;
}

static void mark_flat(loft_contour *c, const shape_places *places) {
  for (size_t k = 0; k < places->count; k++) {
    const shape_place *p = places->at + k;
    if (p->kind != SHAPE_FLAT || !p->partner[1]) continue;
    for (size_t b = 0; b <= c->space.spans; b++)
      if (c->space.breaks[b] == p->t) c->flat_above[b] = 1;
    if (c->space.closed && p->t == 0) c->flat_above[c->space.spans] = 1;
  }
}

/* ---- slopes -------------------------------------------------------------------------------------- */

/* The vertices whose x'' is that at t, a knot degree - 2 fold or more: *count from the one returned on. */
static size_t find_vertices(const loft_space *s, double t, size_t *count) {
  size_t span = shape_span(s, t), d = s->degree, last = s->first[span];
  if (s->breaks[span] != t) { /* 1, where it is open */
    *count = 1;
    return last + d - 2;
  }
  *count = last > 0 || s->closed ? s->folds[span] + 3 - d : 1;
  return last + 1 - *count + (*count > last + 1 ? s->count : 0);
}

/* Sections beside an end whose slope has x'' not 0 at a flat point are not flat there, and their inflection runs away
 * from it: told, for no inequality can help. What is rounding is taken off: the control points in the middle give
 * way. */
static batten_status settle_slope(batten_context *ctx, loft_stack *s, size_t end, const shape_places *places) {
  size_t i = end ? s->count - 1 : 0;
  const loft_space *space = &s->contours[i].space;
  double *slope = s->slopes[end];
  batten_status st = BATTEN_OK;
  for (size_t k = 0; k < places->count && slope && s->degree > 2 && st >= 0; k++) {
    const shape_place *p = places->at + k;
    if (p->kind != SHAPE_FLAT || !p->partner[end ? 0 : 1]) continue;
    size_t count, v = find_vertices(space, p->t, &count);
    bool flat = true;
    for (size_t q = 0; q < count; q++) flat = flat && contours_is_flat(space, slope, (ptrdiff_t)(v + q));
    if (!flat) {
      st = tell(ctx, s, BATTEN_LOFT_SLOPE, i, neighbour(i, end == 0), p->t);
      continue;
    }
    const double *from = slope + 2 * (v % space->count), *to = slope + 2 * ((v + count + 1) % space->count);
    double whole = loft_interval(space, (ptrdiff_t)v), part = 0;
    for (size_t q = 1; q <= count; q++) whole += loft_interval(space, (ptrdiff_t)(v + q));
    for (size_t q = 1; q <= count; q++) {
      part += loft_interval(space, (ptrdiff_t)(v + q - 1)) / whole;
      double *point = slope + 2 * ((v + q) % space->count);
      for (size_t x = 0; x < 2; x++) point[x] = bspline_blend(from[x], to[x], part);
    }
  }
  return st;
}

/* ---- preparing ----------------------------------------------------------------------------------- */

static batten_status progress(batten_context *ctx, double done, size_t i, size_t count) {
  return batten_progress(ctx, "contours", done + 0.5 * (double)i / (double)count);
}

/* Partners first, then knots for those of all contours as they came, then what this takes. */
static batten_status prepare(batten_context *ctx, loft_stack *s, double zone, shape_places *places,
                             shape_knots *knots) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    st = progress(ctx, 0, i, s->count);
    if (st >= 0) st = look_at(ctx, s, i, places + i);
  }
  for (size_t i = 1; i < s->count && st >= 0; i++) join(s->contours + i, places + i, places + i - 1);
  for (size_t i = s->count - 1; i-- > 0 && st >= 0;) join(s->contours + i, places + i, places + i + 1);
  for (size_t i = 0; i < s->count && st >= 0; i++)
    for (int side = 0; side < 2; side++)
      if (has_neighbour(s, i, side)) find_partners(places + i, side, places + neighbour(i, side));
  for (size_t i = 0; i < s->count && st >= 0; i++) st = add_knots(ctx, s, i, places + i, zone, knots + i);
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    st = progress(ctx, 0.5, i, s->count);
    if (st >= 0 && knots[i].count > 0)
      st = loft_stack_insert(ctx, s, i, knots[i].count, knots[i].knots, knots[i].folds);
    if (st < 0) break;
    mark_flat(s->contours + i, places + i);
    st = i == 0 ? settle_slope(ctx, s, 0, places) : BATTEN_OK;
    if (i + 1 == s->count && st >= 0) st = settle_slope(ctx, s, 1, places + i);
    if (st >= 0) st = tell_all(ctx, s, i, places);
    if (st >= 0) st = shape_bend(ctx, s, i, places + i);
  }
  return st;
}

batten_status loft_shape_prepare(batten_context *ctx, loft_stack *s, const batten_loft_options *opt) {
  batten_status st = BATTEN_E_NOMEM;
  shape_places *places = batten_alloc_array(ctx, s->count, sizeof *places);
  shape_knots *knots = batten_alloc_array(ctx, s->count, sizeof *knots);
  if (!places || !knots) goto done;
  memset(places, 0, s->count * sizeof *places);
  memset(knots, 0, s->count * sizeof *knots);
  st = prepare(ctx, s, opt->zone, places, knots);
  for (size_t i = 0; i < s->count; i++) {
    batten_free(ctx, places[i].at);
    shape_knots_free(ctx, knots + i);
  }
done:
  batten_free(ctx, knots);
  batten_free(ctx, places);
  return st;
}
