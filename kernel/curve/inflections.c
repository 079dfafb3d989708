/* Where the curvature of a curve changes its sign.
 *
 * What counts are signs of g = [x', x''], and of turns at corners, beyond what the rounding of the control points may
 * do to them. Spans are bisected until no piece has Bernstein coefficients of both signs, or these change their sign
 * once, from one end to the other: then so does g [variation diminishing]. A sign that is seen at some place is kept;
 * when the next one is another, what lies between is narrowed from both sides by bisection to where g is beyond
 * rounding, and the inflection is in the middle of that: of a straight piece too. */
#include "bend.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"

enum {
  DEPTH = 50,
  PATIENCE = 1 << 12 /* pieces of a span: only g as large as its error everywhere needs more, and then has no sign */
};
/* Of the shorter span beside it: what is narrower than that around a knot lies at the knot. */
static const double NARROW = 0x1p-6;

typedef struct piece {
  bend b;
  double from, to;
  unsigned depth;
} piece;

/* A sign that was seen, at an end of the piece at least; `point`: at a corner, from = to. */
typedef struct seen {
  piece p;
  int sign;
  bool point;
  double span[2]; /* where p is */
} seen;

typedef struct scan {
  batten_context *ctx;
  const batten_curve *curve;
  double data_error;
  piece stack[DEPTH + 2];
  seen first, last;
  size_t count, room;
  double *out;
} scan;

static bool beyond(const bend *b, int sign, unsigned i) { return sign * b->g[i] > b->g_error[i]; }

/* The place nearest to `from` at which the sign is seen, which it is at `to`: by bisection. */
static double narrow(const seen *s, bool from_end) {
  piece p = s->p;
  if (s->point) return p.from;
  bend other;
  if (from_end) {
    bend_reverse(&p.b);
    p.from = s->p.to;
    p.to = s->p.from;
  }
  if (beyond(&p.b, s->sign, 0)) return p.from;
  for (unsigned depth = 0; depth < DEPTH; depth++) {
    double middle = 0.5 * p.from + 0.5 * p.to;
    bend_split(&p.b, 0.5, &other);
    if (beyond(&other, s->sign, 0)) {
      p.to = middle;
    } else {
      p.b = other;
      p.from = middle;
    }
  }
  return p.to;
}

static batten_status add(scan *s, double t) {
  if (s->count == s->room) {
    size_t room = s->room ? 2 * s->room : 16;
    double *out = batten_realloc_array(s->ctx, s->out, room, sizeof *out);
    if (!out) return BATTEN_E_NOMEM;
    s->out = out;
    s->room = room;
  }
  s->out[s->count++] = t;
  return BATTEN_OK;
}

/* Between two signs, the second `shift` further on. */
static double between(const seen *a, const seen *b, double shift) {
  double from = narrow(a, true), to = narrow(b, false) + shift, knot = b->span[0] + shift;
  double width = fmin(a->span[1] - a->span[0], b->span[1] - b->span[0]);
  if (a->point) knot = from;
  if (b->point) knot = to;
  if (knot >= from && knot <= to && to - from <= NARROW * width) return knot;
  return 0.5 * from + 0.5 * to;
}

static batten_status see(scan *s, const seen *now) {
  batten_status st = BATTEN_OK;
  if (s->last.sign == 0)
    s->first = *now;
  else if (s->last.sign != now->sign)
    st = add(s, between(&s->last, now, 0));
  s->last = *now;
  return st;
}

/* What the coefficients beyond their errors are: their first and last sign, 0 without any, and how often it changes.
 */
static int changes_of(const bend *b, int signs[2]) {
  int changes = 0;
  signs[0] = signs[1] = 0;
  for (unsigned i = 0; i <= b->n; i++) {
    int sign = beyond(b, 1, i) - beyond(b, -1, i);
    if (sign == 0) continue;
    if (signs[0] == 0) signs[0] = sign;
    if (signs[1] == -sign) changes++;
    signs[1] = sign;
  }
  return changes;
}

/* True when all that the piece shows is told: by its ends. */
static bool look(scan *s, const piece *p, const double span[2], batten_status *st) {
  int signs[2], changes = changes_of(&p->b, signs);
  if (signs[0] == 0) return true;
  bool lower = beyond(&p->b, signs[0], 0), upper = beyond(&p->b, signs[1], p->b.n);
  if (changes == 0 ? !lower && !upper : changes > 1 || !lower || !upper) return false;
  for (int k = 0; k <= changes && *st >= 0; k++) {
    seen now = {.p = *p, .sign = signs[k], .span = {span[0], span[1]}};
    *st = see(s, &now);
  }
  return true;
}

static batten_status scan_span(scan *s, const bend *whole, const double span[2]) {
  size_t height = 1;
  batten_status st = BATTEN_OK;
  s->stack[0] = (piece){.b = *whole, .from = span[0], .to = span[1]};
  for (size_t looked = 0; height > 0 && st >= 0 && looked < PATIENCE; looked++) {
    piece *p = &s->stack[height - 1], *left = p + 1;
    if (look(s, p, span, &st) || p->depth == DEPTH) {
      height--;
      continue;
    }
    /* The left half goes on top. */
    left->b = p->b;
    bend_split(&left->b, 0.5, &p->b);
    left->from = p->from;
    left->to = p->from = 0.5 * p->from + 0.5 * p->to;
    left->depth = ++p->depth;
    height++;
  }
  return st;
}

/* The turn from the end of `before` to the start of `after`. */
static batten_status scan_corner(scan *s, const bend *before, const bend *after, double t, const double span[2]) {
  unsigned m = before->m;
  int turn = bend_turn(before->a[m], before->a_error[m], after->a[0], after->a_error[0]);
  if (turn == 0) return BATTEN_OK;
  seen now = {.p = {.from = t, .to = t}, .sign = turn, .point = true, .span = {span[0], span[1]}};
  return see(s, &now);
}

static batten_status scan_all(scan *s) {
  const bspline *b = &s->curve->space;
  bend first, before, now;
  size_t mu = bspline_first(b), next;
  for (size_t last = b->count; mu < b->count; last = mu, mu = next) {
    next = bspline_next(b, mu);
    const double *span = b->knots + mu;
    bend_make(s->curve, mu, s->data_error, &now);
    batten_status st = BATTEN_OK;
    if (last == b->count)
      first = now;
    else if (mu - last >= b->degree)
      st = scan_corner(s, &before, &now, span[0], span);
    if (st >= 0) st = scan_span(s, &now, span);
    if (st < 0) return st;
    before = now;
  }
  if (!s->curve->closed) return BATTEN_OK;
  double lower = bspline_lower(b), upper = bspline_upper(b);
  batten_status st = scan_corner(s, &before, &first, upper, b->knots + b->degree);
  if (st >= 0 && s->last.sign != s->first.sign) st = add(s, between(&s->last, &s->first, upper - lower));
  return st;
}

/* Of closed curves those at and beyond the end are at the start: two at most, the last ones. */
static void wrap(scan *s) {
  double lower = bspline_lower(&s->curve->space), upper = bspline_upper(&s->curve->space);
  for (size_t i = s->count > 2 ? s->count - 2 : 0; i < s->count; i++) {
    double t = s->out[i];
    if (t >= upper) t = fmin(lower + (t - upper), upper);
    size_t k = i;
    for (; k > 0 && s->out[k - 1] > t; k--) s->out[k] = s->out[k - 1];
    s->out[k] = t;
  }
}

batten_status batten_curve_inflections(batten_context *ctx, const batten_curve *curve, size_t *count,
                                       double **parameters) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!curve || !count || !parameters)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for the result",
                       !curve  ? "curve"
                       : count ? "parameters"
                               : "count");
  scan *s = batten_alloc(ctx, sizeof *s);
  if (!s) return BATTEN_E_NOMEM;
  s->ctx = ctx;
  s->curve = curve;
  s->data_error = bend_data_error(curve);
  s->first.sign = s->last.sign = 0;
  s->count = s->room = 0;
  s->out = NULL;
  batten_status st = scan_all(s);
  if (st < 0) {
    batten_free(ctx, s->out);
  } else {
    if (curve->closed) wrap(s);
    *count = s->count;
    *parameters = s->out;
  }
  batten_free(ctx, s);
  return st;
}
