/* Contours as they come become a stack: checked, scaled, of one degree, on knots of which near ones are equal. */
#include "contours_inner.h"

#include <stdio.h>
#include <string.h>

#include "base/checked.h"
#include "basis/refine.h"

/* ---- scales -------------------------------------------------------------------------------------- */

/* Powers of two, and a middle that is a whole number of the size's: taking it off is exact, and so is putting it back
 * where the box is no smaller than its distance from the origin: there is no need of a middle then. */
static batten_status find_scales(batten_context *ctx, size_t count, const batten_curve *const *contours,
                                 const double *heights, loft_stack *s) {
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < count; i++) {
    batten_curve_form f = batten_curve_get(contours[i]);
    for (size_t j = 0; j < 2 * (f.knot_count - f.degree - 1); j++) {
      lower[j % 2] = fmin(lower[j % 2], f.control_points[j]);
      upper[j % 2] = fmax(upper[j % 2], f.control_points[j]);
    }
  }
  double size = fmax(upper[0] - lower[0], upper[1] - lower[1]);
  if (!isfinite(size))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "contours: the box of their control points, %g .. %g by %g .. %g, is larger than a double can "
                       "say; scale them",
                       lower[0], upper[0], lower[1], upper[1]);
  s->unit = batten_unit(size);
  for (size_t x = 0; x < 2; x++) {
    double middle = lower[x] / 2 + upper[x] / 2;
    s->middle[x] = fabs(middle) <= size ? 0 : rint(middle * s->unit) / s->unit;
  }
  s->size = size * s->unit;
  s->base = heights[0];
  s->height_unit = batten_unit((heights[count - 1] - heights[0]) / (double)(count - 1));
  return BATTEN_OK;
}

/* ---- curves as they come ------------------------------------------------------------------------- */

void contours_raw_free(batten_context *ctx, contours_raw *r) {
  batten_free(ctx, r->knots);
  batten_free(ctx, r->points);
  batten_free(ctx, r->breaks);
  batten_free(ctx, r->folds);
  *r = (contours_raw){0};
}

/* To [0, 1]; knots that differ still do. */
static batten_status map_knots(batten_context *ctx, contours_raw *r, const double *knots) {
  size_t count = r->b.count + r->b.degree + 1;
  double lower = knots[0], upper = knots[count - 1];
  r->domain[0] = lower;
  r->domain[1] = upper;
  for (size_t k = 0; k < count; k++) {
    r->knots[k] = knots[k] == upper ? 1 : (knots[k] - lower) / (upper - lower);
    if (k > 0 && knots[k - 1] != knots[k] && !(r->knots[k - 1] < r->knots[k]))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s: knots %.17g and %.17g are too near to each other to differ in a domain from %.17g to "
                         "%.17g; make them one",
                         r->name, knots[k - 1], knots[k], lower, upper);
  }
  return BATTEN_OK;
}

/* A copy. Slopes are by height, and have no middle. */
static batten_status copy_curve(batten_context *ctx, const batten_curve *curve, const loft_stack *s,
                                contours_raw *r) {
  batten_curve_form f = batten_curve_get(curve);
  size_t count = f.knot_count - f.degree - 1;
  r->closed = f.closed != 0;
  r->knots = batten_alloc_array(ctx, f.knot_count, sizeof *r->knots);
  r->points = batten_alloc_array(ctx, count, 2 * sizeof *r->points);
  if (!r->knots || !r->points) return BATTEN_E_NOMEM;
  r->b = (bspline){f.degree, count, r->knots};
  int exponent = ilogb(s->unit) - (r->slope ? ilogb(s->height_unit) : 0);
  for (size_t j = 0; j < 2 * count; j++) {
    double p = f.control_points[j] - (r->slope ? 0 : s->middle[j % 2]);
    r->points[j] = ldexp(p, exponent);
    if (!isfinite(r->points[j]) || fabs(r->points[j]) > 0x1p500)
      return batten_fail(
          ctx, BATTEN_E_INVALID,
          "%s: control point %zu, %g, is beyond doubles beside contours of size %g over heights of %g; "
          "give smaller slopes, or NULL",
          r->name, j / 2, f.control_points[j], s->size / s->unit, 1 / s->height_unit);
  }
  return map_knots(ctx, r, f.knots);
}

/* Of the stack's degree. */
static batten_status make_raw(batten_context *ctx, const batten_curve *curve, const loft_stack *s, contours_raw *r) {
  r->raised = s->degree - batten_curve_get(curve).degree;
  if (r->raised == 0) return copy_curve(ctx, curve, s, r);
  batten_curve *raised = NULL;
  batten_status st = batten_curve_elevate(ctx, curve, s->degree, &raised);
  if (st >= 0) st = copy_curve(ctx, raised, s, r);
  batten_curve_free(raised);
  return st;
}

/* raw [count + 2]: the contours, and the slopes (without points where there are none). */
static batten_status make_all(batten_context *ctx, size_t count, const batten_curve *const *contours,
                              const batten_loft_options *opt, const loft_stack *s, contours_raw *raw) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st >= 0; i++) {
    snprintf(raw[i].name, sizeof raw[i].name, "contours[%zu]", i);
    st = make_raw(ctx, contours[i], s, raw + i);
  }
  for (size_t e = 0; e < 2 && st >= 0; e++) {
    contours_raw *r = raw + count + e;
    snprintf(r->name, sizeof r->name, "opt.slopes[%zu]", e);
    r->slope = true;
    if (opt->slopes[e]) st = make_raw(ctx, opt->slopes[e], s, r);
  }
  return st;
}

/* ---- the stack ----------------------------------------------------------------------------------- */

void loft_stack_free(batten_context *ctx, loft_stack *s) {
  for (size_t i = 0; s->contours && i < s->count; i++) {
    loft_space_free(ctx, &s->contours[i].space);
    batten_free(ctx, s->contours[i].points);
    batten_free(ctx, s->contours[i].flat_above);
  }
  batten_free(ctx, s->contours);
  for (int e = 0; e < 2; e++) batten_free(ctx, s->slopes[e]);
  batten_free(ctx, s->notes);
  *s = (loft_stack){0};
}

/* By contour and t. */
batten_status loft_stack_note(batten_context *ctx, loft_stack *s, const batten_loft_note *note) {
  if (s->note_count == s->note_room) {
    size_t room = s->note_room ? 2 * s->note_room : 16;
    batten_loft_note *notes = batten_realloc_array(ctx, s->notes, room, sizeof *notes);
    if (!notes) return BATTEN_E_NOMEM;
    s->notes = notes;
    s->note_room = room;
  }
  size_t at = s->note_count++;
  for (; at > 0; at--) {
    const batten_loft_note *last = s->notes + at - 1;
    if (last->contour < note->contour || (last->contour == note->contour && last->t <= note->t)) break;
    s->notes[at] = *last;
  }
  s->notes[at] = *note;
  return BATTEN_OK;
}

/* points := those over `to`. */
static batten_status refine(batten_context *ctx, const loft_space *from, const loft_space *to, double **points) {
  loft_matrix m = {0};
  batten_status st = loft_insertion(ctx, from, to, &m);
  double *fresh = st >= 0 ? batten_alloc_array(ctx, to->count, 2 * sizeof *fresh) : NULL;
  if (fresh) {
    loft_matrix_apply(&m, *points, fresh);
    batten_free(ctx, *points);
    *points = fresh;
  } else if (st >= 0) {
    st = BATTEN_E_NOMEM;
  }
  loft_matrix_free(ctx, &m);
  return st;
}

/* A contour over `to`, which it takes over if all goes well, its flat points kept. */
static batten_status move_contour(batten_context *ctx, loft_contour *c, loft_space *to) {
  unsigned char *flat = batten_alloc_array(ctx, to->spans + 1, sizeof *flat);
  if (!flat) return BATTEN_E_NOMEM;
  batten_status st = refine(ctx, &c->space, to, &c->points);
  if (st < 0) {
    batten_free(ctx, flat);
    return st;
  }
  for (size_t i = 0, old = 0; i <= to->spans; i++) {
    while (c->space.breaks[old] < to->breaks[i]) old++;
    flat[i] = c->space.breaks[old] == to->breaks[i] && c->flat_above[old];
  }
  batten_free(ctx, c->flat_above);
  c->flat_above = flat;
  loft_space_free(ctx, &c->space);
  c->space = *to;
  *to = (loft_space){0};
  return BATTEN_OK;
}

/* The slope on the contour's knots, and the contour on those of the slope. */
static batten_status add_slope(batten_context *ctx, const contours_raw *raw, loft_contour *c, double **slope) {
  loft_space own = {0}, both = {0};
  double shift;
  batten_status st = contours_convert(ctx, raw, &own, slope, &shift);
  if (st >= 0) st = loft_space_union(ctx, &own, &c->space, &both);
  if (st >= 0) st = refine(ctx, &own, &both, slope);
  if (st >= 0) st = move_contour(ctx, c, &both);
  loft_space_free(ctx, &both);
  loft_space_free(ctx, &own);
  return st;
}

static batten_status fill(batten_context *ctx, const contours_raw *raw, const double *heights, loft_stack *s) {
  s->contours = batten_alloc_array(ctx, s->count, sizeof *s->contours);
  if (!s->contours) return BATTEN_E_NOMEM;
  memset(s->contours, 0, s->count * sizeof *s->contours);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < s->count && st >= 0; i++) {
    loft_contour *c = s->contours + i;
    double shift = 0;
    c->height = (heights[i] - s->base) * s->height_unit;
    st = contours_convert(ctx, raw + i, &c->space, &c->points, &shift);
    if (st < 0) break;
    s->knot_shift = fmax(s->knot_shift, shift);
    c->flat_above = batten_alloc_array(ctx, c->space.spans + 1, 1);
    if (!c->flat_above) return BATTEN_E_NOMEM;
    memset(c->flat_above, 0, c->space.spans + 1);
  }
  for (size_t e = 0; e < 2 && st >= 0; e++)
    if (raw[s->count + e].points)
      st = add_slope(ctx, raw + s->count + e, s->contours + (e ? s->count - 1 : 0), &s->slopes[e]);
  return st;
}

batten_status loft_stack_make(batten_context *ctx, size_t count, const batten_curve *const *contours,
                              const double *heights, const batten_loft_options *opt, loft_stack *out) {
  batten_status st = contours_check(ctx, count, contours, heights, opt);
  if (st < 0) return st;
  batten_curve_form first = batten_curve_get(contours[0]);
  loft_stack s = {.count = count, .closed = first.closed != 0};
  s.domain[0] = first.knots[0];
  s.domain[1] = first.knots[first.knot_count - 1];
  for (size_t i = 0; i < count; i++) {
    unsigned degree = batten_curve_get(contours[i]).degree;
    if (degree > s.degree) s.degree = degree;
  }
  st = find_scales(ctx, count, contours, heights, &s);
  size_t all = 0;
  if (st >= 0 && !batten_add(count, 2, &all)) st = batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu contours", count);
  if (st < 0) return st;
  contours_raw *raw = batten_alloc_array(ctx, all, sizeof *raw);
  if (!raw) return BATTEN_E_NOMEM;
  memset(raw, 0, all * sizeof *raw);
  st = make_all(ctx, count, contours, opt, &s, raw);
  if (st >= 0) st = contours_check_directions(ctx, count, raw);
  if (st >= 0) st = contours_smoothness(ctx, all, raw, opt->smooth_z, &s.smoothness);
  if (st >= 0) st = contours_merge(ctx, all, raw, opt->knot_tolerance, s.smoothness);
  if (st >= 0) st = fill(ctx, raw, heights, &s);
  for (size_t i = 0; i < all; i++) contours_raw_free(ctx, raw + i);
  batten_free(ctx, raw);
  if (st < 0)
    loft_stack_free(ctx, &s);
  else
    *out = s;
  return st;
}

batten_status loft_stack_insert(batten_context *ctx, loft_stack *s, size_t i, size_t count, const double *knots,
                                const unsigned *folds) {
  loft_contour *c = s->contours + i;
  loft_space to = {0};
  batten_status st = loft_space_insert(ctx, &c->space, count, knots, folds, &to);
  size_t more = st >= 0 ? to.count - c->space.count : 0;
  if (st >= 0 && i == 0 && s->slopes[0]) st = refine(ctx, &c->space, &to, &s->slopes[0]);
  if (st >= 0 && i + 1 == s->count && s->slopes[1]) st = refine(ctx, &c->space, &to, &s->slopes[1]);
  if (st >= 0) st = move_contour(ctx, c, &to);
  if (st >= 0) s->knots_inserted += more;
  loft_space_free(ctx, &to);
  return st;
}
