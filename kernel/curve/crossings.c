/* Where a curve crosses or touches itself.
 *
 * Spans are Bezier curves. A part whose legs all point to one side of its chord is monotone along it and does not
 * cross itself; others are halved, and their halves are then a pair with a common end. Pairs of parts whose boxes
 * along the chord of either are apart have nothing to do with each other. Of the rest,
 *   - where no leg of the one is parallel to a leg of the other there is one common point at most: Newton's method
 *     finds it; of parts with a common end that is the end;
 *   - parts with a common end whose legs point to one side of a line are monotone together;
 *   - where the ends of parts and places between them lie on both they lie on each other;
 *   - tiny parts touch when they are near enough: Newton's method looks for parallel tangents.
 * All other pairs are halved. Neighbours in different pairs find the same place: that is told once.
 *
 * Points are around the middle of the curve's box, which is 1 .. 2 large. */
#include "curve_inner.h"

#include "base/checked.h"
#include "mesh/box_tree.h"

#include <float.h>
#include <stdlib.h>
#include <string.h>

enum { ORDER = BSPLINE_ORDER, DEPTH = 50, STACK = 2 * DEPTH + 8, TREE_STACK = 64, NEWTON = 24 };
/* What counts as common. */
static const double NEAR = 1e-13;
/* Parts of this size are not halved any more: tangents that are parallel there are so to rounding. */
static const double SMALL = 1e-8;
/* Parts nowhere further apart lie on each other: more than NEAR, since to tell parts apart that are hardly more than
 * NEAR from each other takes as many pairs as these are flat to the difference. */
static const double LIE = 1e-12;
/* Shorter than that parts do not lie on each other but touch. */
static const double SHORT = 3e-5;
/* In spans: places that are the same. */
static const double SAME = 1e-6;
/* What directions of parts have to differ by, radians. */
static const double ANGLE = 1e-9;
/* Below this angle parts may as well touch: their distance in between is below NEAR. */
static const double PARALLEL = 1e-6;

static const double HALF_TURN = 3.14159265358979323846;

typedef struct part {
  size_t span;
  double lower, width; /* in parts of the span */
  unsigned depth;
  double net[ORDER][2];
} part;

/* Two parts, or one with itself. */
typedef struct couple {
  part a, b;
  bool self;
  bool joined;  /* a ends where b begins */
  bool wrapped; /* b ends where a begins */
} couple;

/* Places on spans, as the span's index and the part of it together. */
typedef struct crossing {
  double at[2];
  bool touch;            /* its place is less certain */
  bool lies;             /* parts on each other: */
  double from[2], to[2]; /* from here to there */
} crossing;

typedef struct search {
  batten_context *ctx;
  const batten_curve *curve;
  unsigned degree;
  size_t spans;
  size_t *span;     /* [spans] mu, spans without length left out */
  double (*net)[2]; /* [spans][degree + 1] */
  couple *stack;    /* [STACK] */
  crossing *found;
  size_t count, room;
} search;

/* The directions of a part's legs, angles against its chord. */
typedef struct cone {
  double chord[2], length, low, high;
  bool narrow; /* all legs point forwards */
} cone;

static double dot(const double a[2], const double b[2]) { return a[0] * b[0] + a[1] * b[1]; }
static double cross(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }
static double norm(const double a[2]) { return sqrt(dot(a, a)); }

/* ---- parts ---------------------------------------------------------------------------------------- */

static void halve(unsigned d, part *left, part *right) {
  left->width *= 0.5;
  left->depth++;
  *right = *left;
  right->lower = left->lower + left->width;
  for (unsigned level = 1; level <= d; level++) {
    for (unsigned i = 0; i + level <= d; i++)
      for (int k = 0; k < 2; k++) right->net[i][k] = 0.5 * right->net[i][k] + 0.5 * right->net[i + 1][k];
    memcpy(left->net[level], right->net[0], sizeof left->net[level]);
  }
}

/* The longer side of the net's box. */
static double extent_of(unsigned d, const double (*net)[2]) {
  double lower[2], upper[2];
  curve_points_box(d + 1, net[0], lower, upper);
  return fmax(upper[0] - lower[0], upper[1] - lower[1]);
}

static cone cone_of(unsigned d, const double (*net)[2]) {
  cone c = {.chord = {net[d][0] - net[0][0], net[d][1] - net[0][1]}, .narrow = true};
  c.length = norm(c.chord);
  for (unsigned i = 0; i < d; i++) {
    double leg[2] = {net[i + 1][0] - net[i][0], net[i + 1][1] - net[i][1]}, length = norm(leg);
    if (length <= 4 * DBL_EPSILON) continue; /* no more than rounding */
    double angle = atan2(cross(c.chord, leg), dot(c.chord, leg)), error = 4 * DBL_EPSILON / length;
    c.low = fmin(c.low, angle - error);
    c.high = fmax(c.high, angle + error);
  }
  c.narrow = c.length > 4 * DBL_EPSILON && c.low > -0.5 * HALF_TURN + ANGLE && c.high < 0.5 * HALF_TURN - ANGLE;
  return c;
}

/* Whether no leg of a is parallel to one of b; both are narrow. */
static bool transversal(const cone *a, const cone *b) {
  double turn = atan2(cross(a->chord, b->chord), dot(a->chord, b->chord));
  double low = turn + b->low - a->high, high = turn + b->high - a->low;
  double whole = HALF_TURN * ceil((low - ANGLE) / HALF_TURN);
  return whole > high + ANGLE;
}

/* Whether the legs of a and b together point to one side of a line. */
static bool forwards(const cone *a, const cone *b) {
  double turn = atan2(cross(a->chord, b->chord), dot(a->chord, b->chord));
  return fmax(a->high, turn + b->high) - fmin(a->low, turn + b->low) < HALF_TURN - ANGLE;
}

/* Whether boxes along direction w are apart. */
static bool apart_along(unsigned d, const part *a, const part *b, const double w[2]) {
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, size = norm(w);
  for (unsigned i = 0; i <= d; i++) {
    const double at[2] = {dot(a->net[i], w), dot(b->net[i], w)};
    for (int k = 0; k < 2; k++) {
      low[k] = fmin(low[k], at[k]);
      high[k] = fmax(high[k], at[k]);
    }
  }
  return fmax(low[0] - high[1], low[1] - high[0]) > NEAR * size;
}

static bool apart(unsigned d, const part *a, const part *b) {
  for (int k = 0; k < 2; k++)
    if (apart_along(d, a, b, (const double[2]){k == 0, k == 1})) return true;
  for (int k = 0; k < 2; k++) {
    const part *p = k ? b : a;
    const double along[2] = {p->net[d][0] - p->net[0][0], p->net[d][1] - p->net[0][1]};
    if (apart_along(d, a, b, along) || apart_along(d, a, b, (const double[2]){-along[1], along[0]})) return true;
  }
  return false;
}

/* x, x', x'' at s by de Casteljau's algorithm; beyond the ends too. */
static void jet_at(unsigned d, const double (*net)[2], double s, double jet[3][2]) {
  double w[ORDER][2];
  memcpy(w, net, (d + 1) * sizeof *w);
  for (int k = 0; k < 2; k++) jet[2][k] = 0;
  for (unsigned left = d; left > 0; left--) {
    for (int k = 0; k < 2 && left == 2; k++)
      jet[2][k] = (double)d * (d - 1) * ((w[2][k] - w[1][k]) - (w[1][k] - w[0][k]));
    for (int k = 0; k < 2 && left == 1; k++) jet[1][k] = d * (w[1][k] - w[0][k]);
    for (unsigned i = 0; i < left; i++)
      for (int k = 0; k < 2; k++) w[i][k] = (1 - s) * w[i][k] + s * w[i + 1][k];
  }
  for (int k = 0; k < 2; k++) jet[0][k] = w[0][k];
}

/* ---- what is found -------------------------------------------------------------------------------- */

static const double (*net_of(const search *s, size_t span))[2] {
  return (const double(*)[2])(s->net + span * (s->degree + 1));
}

static void point_at(const search *s, double at, double out[2]) {
  size_t span = at >= (double)s->spans ? s->spans - 1 : (size_t)at;
  curve_net_at(s->degree, net_of(s, span), at - (double)span, out);
}

/* How far two places are from each other along the curve, in spans; and with its ends joined. */
static double between(const search *s, double a, double b) {
  double way = fabs(a - b);
  return s->curve->closed ? fmin(way, (double)s->spans - way) : way;
}

/* Whether the curve goes anywhere between two places near to each other: else they are one. */
static bool goes_away(const search *s, const double at[2]) {
  if (between(s, at[0], at[1]) > 2) return true;
  double x[2], far = 0, way = at[1] - at[0], whole = (double)s->spans;
  if (s->curve->closed && fabs(way) > 0.5 * whole) way -= way > 0 ? whole : -whole;
  point_at(s, at[0], x);
  for (int k = 1; k < 8; k++) {
    double y[2], place = at[0] + way * k / 8;
    if (place < 0) place += whole;
    if (place >= whole && s->curve->closed) place -= whole;
    point_at(s, fmax(place, 0), y);
    far = fmax(far, hypot(y[0] - x[0], y[1] - x[1]));
  }
  return far > SMALL;
}

static bool same_place(const search *s, const double a[2], const double b[2]) {
  return (between(s, a[0], b[0]) <= SAME && between(s, a[1], b[1]) <= SAME) ||
         (between(s, a[0], b[1]) <= SAME && between(s, a[1], b[0]) <= SAME);
}

/* Whether `at` is where the parts of c lie on each other, their ends included. */
static bool lies_within(const crossing *c, const double at[2]) {
  bool within = c->lies;
  for (int k = 0; k < 2; k++) within = within && at[k] >= c->from[k] - SAME && at[k] <= c->to[k] + SAME;
  return within;
}

static batten_status add(search *s, const crossing *c) {
  if (s->count == s->room) {
    size_t room = s->room ? 2 * s->room : 16;
    crossing *more = batten_alloc_array(s->ctx, room, sizeof *more);
    if (!more) return BATTEN_E_NOMEM;
    if (s->count) memcpy(more, s->found, s->count * sizeof *more);
    batten_free(s->ctx, s->found);
    s->found = more;
    s->room = room;
  }
  s->found[s->count++] = *c;
  return BATTEN_OK;
}

/* The place of both parts at u, in [0, 1] but for rounding; canonical: a span's end is the next one's start. */
static void set_place(const search *s, const part *a, double u, const part *b, double v, double at[2]) {
  const part *p[2] = {a, b};
  for (int k = 0; k < 2; k++) {
    at[k] = (double)p[k]->span + (p[k]->lower + p[k]->width * fmin(fmax(k ? v : u, 0), 1));
    if (s->curve->closed && at[k] >= (double)s->spans) at[k] = 0;
  }
}

/* ---- a pair --------------------------------------------------------------------------------------- */

/* Newton's method on a(u) = b(v); true when it ends inside of both. touch: nearly parallel there. */
static bool find_crossing(const search *s, const couple *c, crossing *out) {
  double jet[2][3][2], at[2] = {0.5, 0.5};
  for (int pass = 0; pass < NEWTON; pass++) {
    jet_at(s->degree, (const double(*)[2])c->a.net, at[0], jet[0]);
    jet_at(s->degree, (const double(*)[2])c->b.net, at[1], jet[1]);
    const double *p = jet[0][1], *q = jet[1][1];
    const double off[2] = {jet[1][0][0] - jet[0][0][0], jet[1][0][1] - jet[0][0][1]};
    double area = cross(p, q);
    if (!(fabs(area) > 0)) return false;
    at[0] += cross(off, q) / area;
    at[1] += cross(off, p) / area;
    if (!(at[0] > -1 && at[0] < 2 && at[1] > -1 && at[1] < 2)) return false;
    if (norm(off) > 8 * DBL_EPSILON) continue;
    const double slip[2] = {NEAR * norm(q) / fabs(area), NEAR * norm(p) / fabs(area)};
    for (int k = 0; k < 2; k++)
      if (at[k] < -slip[k] || at[k] > 1 + slip[k]) return false;
    set_place(s, &c->a, at[0], &c->b, at[1], out->at);
    out->touch = fabs(area) < PARALLEL * norm(p) * norm(q);
    return true;
  }
  return false;
}

/* The place of a narrow part at which x is across its chord, in [0, 1]; its distance from x. */
static double project(unsigned d, const part *p, const double x[2], double *distance) {
  const double along[2] = {p->net[d][0] - p->net[0][0], p->net[d][1] - p->net[0][1]};
  double low = 0, high = 1, at = 0.5, jet[3][2];
  for (int pass = 0; pass < 60; pass++) {
    jet_at(d, (const double(*)[2])p->net, at, jet);
    const double off[2] = {jet[0][0] - x[0], jet[0][1] - x[1]};
    double height = dot(off, along), next = at - height / dot(jet[1], along);
    if (height > 0)
      high = at;
    else
      low = at;
    if (!(next >= low && next <= high)) next = 0.5 * low + 0.5 * high;
    if (pass > 0 && !(fabs(next - at) > DBL_EPSILON)) break;
    at = next;
  }
  curve_net_at(d, (const double(*)[2])p->net, at, jet[0]);
  *distance = hypot(jet[0][0] - x[0], jet[0][1] - x[1]);
  return at;
}

/* Whether narrow parts have a piece in common: where they do. */
static bool lie_on_each_other(const search *s, const couple *c, crossing *out) {
  unsigned d = s->degree;
  double low = INFINITY, high = -INFINITY, distance, point[2], ends[2][2], other[2];
  for (unsigned k = 0; k < 4; k++) {
    unsigned end = k & 1;
    double at = k < 2 ? project(d, &c->a, c->b.net[end * d], &distance) : end;
    if (k >= 2) project(d, &c->b, c->a.net[end * d], &distance);
    if (distance > LIE) continue;
    low = fmin(low, at);
    high = fmax(high, at);
  }
  if (!(low < high)) return false;
  /* More places than two curves of this degree can have in common. */
  unsigned count = d * d + 2;
  for (unsigned k = 0; k <= count; k++) {
    double u = low + (high - low) * k / count;
    curve_net_at(d, (const double(*)[2])c->a.net, u, point);
    double v = project(d, &c->b, point, &distance);
    if (distance > LIE) return false;
    if (k == 0 || k == count) {
      memcpy(ends[k > 0], point, sizeof point);
      other[k > 0] = v;
    }
    if (k == count / 2) set_place(s, &c->a, u, &c->b, v, out->at);
  }
  if (hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]) < SHORT) return false;
  out->lies = true;
  set_place(s, &c->a, low, &c->b, fmin(other[0], other[1]), out->from);
  set_place(s, &c->a, high, &c->b, fmax(other[0], other[1]), out->to);
  return true;
}

/* Newton's method on whole spans from a place at which they are near, to where tangents are parallel and points
 * across them; stays when that is not to be had nearby. */
static void refine_touch(const search *s, const couple *c, double place[2]) {
  unsigned d = s->degree;
  const double start[2] = {(double)c->a.span, (double)c->b.span};
  double jet[2][3][2], at[2];
  for (int k = 0; k < 2; k++) at[k] = place[k] - start[k];
  if (!(at[0] >= 0 && at[1] >= 0)) return; /* the seam */
  for (int pass = 0; pass < NEWTON; pass++) {
    jet_at(d, net_of(s, c->a.span), at[0], jet[0]);
    jet_at(d, net_of(s, c->b.span), at[1], jet[1]);
    const double *p = jet[0][1], *q = jet[1][1], off[2] = {jet[0][0][0] - jet[1][0][0], jet[0][0][1] - jet[1][0][1]};
    const double value[2] = {cross(p, q), dot(off, p)};
    const double by_u[2] = {cross(jet[0][2], q), dot(p, p) + dot(off, jet[0][2])};
    const double by_v[2] = {cross(p, jet[1][2]), -dot(q, p)};
    double area = cross(by_u, by_v), step[2] = {cross(value, by_v) / area, cross(by_u, value) / area};
    if (fabs(step[0]) + fabs(step[1]) <= 1e-14 && norm(off) <= NEAR) {
      for (int k = 0; k < 2; k++) place[k] = start[k] + at[k];
      return;
    }
    for (int k = 0; k < 2; k++) {
      at[k] -= step[k];
      if (!(at[k] >= 0 && at[k] <= 1 && fabs(start[k] + at[k] - place[k]) < 1e-3)) return;
    }
  }
}

/* Tiny parts: the nearest ends; true when they are near enough. */
static bool find_touch(const search *s, const couple *c, double place[2]) {
  unsigned d = s->degree;
  double best = INFINITY, distance;
  for (unsigned end = 0; end < 2; end++)
    for (int k = 0; k < 2; k++) {
      const part *p = k ? &c->b : &c->a, *q = k ? &c->a : &c->b;
      double u = project(d, p, q->net[end * d], &distance);
      if (!(distance < best)) continue;
      best = distance;
      set_place(s, &c->a, k ? end : u, &c->b, k ? u : end, place);
    }
  if (!(best <= NEAR)) return false;
  refine_touch(s, c, place);
  return true;
}

/* True when nothing remains to be looked at. */
static batten_status judge(search *s, const couple *c, bool *done) {
  unsigned d = s->degree;
  *done = true;
  if (!c->self && apart(d, &c->a, &c->b)) return BATTEN_OK;
  cone a = cone_of(d, (const double(*)[2])c->a.net);
  bool joined = c->joined || c->wrapped, single = !(c->joined && c->wrapped);
  double size_a = extent_of(d, (const double(*)[2])c->a.net);
  if (c->self) {
    *done = a.narrow || c->a.depth >= DEPTH || size_a <= SMALL;
    return BATTEN_OK;
  }
  cone b = cone_of(d, (const double(*)[2])c->b.net);
  double size_b = extent_of(d, (const double(*)[2])c->b.net);
  bool narrow = a.narrow && b.narrow;
  crossing x = {.lies = false};
  if (narrow && transversal(&a, &b)) {
    if (joined && single) return BATTEN_OK;
    if (!joined && find_crossing(s, c, &x)) {
      if (x.touch) refine_touch(s, c, x.at);
      return add(s, &x);
    }
  } else if (narrow && joined && single && (c->joined ? forwards(&a, &b) : forwards(&b, &a))) {
    return BATTEN_OK;
  } else if (narrow && lie_on_each_other(s, c, &x)) {
    return goes_away(s, x.at) ? add(s, &x) : BATTEN_OK;
  }
  bool tiny = (size_a <= SMALL || c->a.depth >= DEPTH) && (size_b <= SMALL || c->b.depth >= DEPTH);
  if (!tiny && !(joined && fmin(size_a, size_b) <= SMALL)) {
    *done = false;
    return BATTEN_OK;
  }
  x.touch = true;
  if (!joined && find_touch(s, c, x.at) && goes_away(s, x.at)) return add(s, &x);
  return BATTEN_OK;
}

/* Pieces of the pair on top of the stack; returns how many. */
static size_t halve_couple(unsigned d, couple *top) {
  couple whole = *top;
  part other;
  if (whole.self) {
    halve(d, &whole.a, &other);
    top[0] = (couple){.a = whole.a, .self = true};
    top[1] = (couple){.a = other, .self = true};
    top[2] = (couple){.a = whole.a, .b = other, .joined = true, .wrapped = whole.wrapped};
    return 3;
  }
  double size_a = extent_of(d, (const double(*)[2])whole.a.net),
         size_b = extent_of(d, (const double(*)[2])whole.b.net);
  bool cut_a = whole.b.depth >= DEPTH || (size_a >= size_b && whole.a.depth < DEPTH);
  halve(d, cut_a ? &whole.a : &whole.b, &other);
  top[0] = top[1] = whole;
  if (cut_a)
    top[1].a = other;
  else
    top[1].b = other;
  /* The common end of a's end and b's start: with a's second half, with b's first. */
  top[cut_a ? 0 : 1].joined = false;
  top[cut_a ? 1 : 0].wrapped = false;
  return 2;
}

static batten_status search_couple(search *s) {
  size_t count = 1;
  while (count > 0) {
    couple *top = &s->stack[count - 1];
    bool done;
    batten_status st = judge(s, top, &done);
    if (st < 0) return st;
    count += done ? 0 : halve_couple(s->degree, top);
    count--;
  }
  return BATTEN_OK;
}

/* ---- all spans ------------------------------------------------------------------------------------ */

static void put_part(const search *s, size_t span, part *out) {
  *out = (part){.span = span, .width = 1};
  memcpy(out->net, net_of(s, span), (s->degree + 1) * sizeof *out->net);
}

static batten_status search_pair(search *s, size_t i, size_t j) {
  couple *c = &s->stack[0];
  put_part(s, i, &c->a);
  put_part(s, j, &c->b);
  c->self = i == j;
  c->joined = j == i + 1;
  c->wrapped = s->curve->closed && i == 0 && j + 1 == s->spans;
  return search_couple(s);
}

static bool meet(const box3 *a, const box3 *b) {
  for (int k = 0; k < 2; k++)
    if (fmax(a->lower[k] - b->upper[k], b->lower[k] - a->upper[k]) > NEAR) return false;
  return true;
}

/* Span i with itself and with later ones. */
static batten_status search_span(search *s, const box_tree *tree, const box3 *boxes, size_t i) {
  struct range {
    size_t node, from, to;
  } stack[TREE_STACK] = {{0, 0, tree->count}};
  batten_status st = search_pair(s, i, i);
  for (size_t height = 1; height > 0 && st >= 0;) {
    struct range r = stack[--height];
    if (!meet(&tree->boxes[r.node], &boxes[i])) continue;
    if (r.to - r.from == 1) {
      size_t j = tree->order[r.from];
      if (j > i) st = search_pair(s, i, j);
      continue;
    }
    size_t mid = (r.from + r.to) / 2;
    stack[height++] = (struct range){r.node + 2 * (mid - r.from), mid, r.to};
    stack[height++] = (struct range){r.node + 1, r.from, mid};
  }
  return st;
}

static void make_spans(search *s, box3 *boxes) {
  const bspline *space = &s->curve->space;
  double middle[2];
  curve_find_middle(s->curve, middle);
  for (size_t mu = bspline_first(space); mu < space->count; mu = bspline_next(space, mu)) {
    curve_piece piece;
    curve_piece_make(s->curve, mu, middle, &piece);
    if (extent_of(s->degree, (const double(*)[2])piece.point) <= NEAR) continue;
    double points[ORDER][3] = {{0}};
    for (unsigned k = 0; k <= s->degree; k++) memcpy(points[k], piece.point[k], sizeof piece.point[k]);
    memcpy(s->net + s->spans * (s->degree + 1), piece.point, (s->degree + 1) * sizeof *s->net);
    boxes[s->spans] = box3_of_points(s->degree + 1, (const double(*)[3])points);
    s->span[s->spans++] = mu;
  }
}

static batten_status search_all(search *s) {
  size_t spans = bspline_span_count(&s->curve->space);
  if (spans > UINT32_MAX) return batten_fail(s->ctx, BATTEN_E_TOO_LARGE, "curve: %zu spans are too many", spans);
  box3 *boxes = batten_alloc_array(s->ctx, spans, sizeof *boxes);
  box_tree tree = {0};
  s->span = batten_alloc_array(s->ctx, spans, sizeof *s->span);
  s->net = batten_alloc_array(s->ctx, spans, (s->degree + 1) * sizeof *s->net);
  s->stack = batten_alloc_array(s->ctx, STACK, sizeof *s->stack);
  batten_status st = boxes && s->span && s->net && s->stack ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) make_spans(s, boxes);
  if (st >= 0 && s->spans > 0) st = box_tree_make(s->ctx, s->spans, boxes, &tree);
  for (size_t i = 0; i < s->spans && st >= 0; i++) st = search_span(s, &tree, boxes, i);
  box_tree_free(s->ctx, &tree);
  batten_free(s->ctx, boxes);
  return st;
}

/* ---- the result ----------------------------------------------------------------------------------- */

static int compare_places(const void *left, const void *right) {
  const double *a = left, *b = right;
  for (int k = 0; k < 2; k++)
    if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
  return 0;
}

/* Sorted: surer ones first, then by place, so that what is kept of the same does not depend on the way there. */
static int compare(const void *left, const void *right) {
  const crossing *a = left, *b = right;
  if (a->lies != b->lies) return a->lies ? -1 : 1;
  if (a->touch != b->touch) return a->touch ? 1 : -1;
  return compare_places(a->at, b->at);
}

/* Whether c, found after the first `count`, tells nothing new. */
static bool is_known(const search *s, size_t count, const crossing *c) {
  for (size_t k = 0; k < count; k++) {
    const crossing *b = &s->found[k];
    bool spans = floor(b->at[0]) == floor(c->at[0]) && floor(b->at[1]) == floor(c->at[1]);
    if (same_place(s, b->at, c->at) || (b->lies && c->lies && spans) || (!c->lies && lies_within(b, c->at)))
      return true;
  }
  return false;
}

static double parameter_of(const search *s, double at) {
  size_t span = at >= (double)s->spans ? s->spans - 1 : (size_t)at;
  return curve_span_at(&s->curve->space, s->span[span], at - (double)span);
}

static batten_status report(search *s, size_t *count, double (**parameters)[2]) {
  size_t kept = 0;
  if (s->count) qsort(s->found, s->count, sizeof *s->found, compare);
  for (size_t k = 0; k < s->count; k++)
    if (!is_known(s, kept, &s->found[k])) s->found[kept++] = s->found[k];
  double(*out)[2] = NULL;
  if (kept) {
    out = batten_alloc_array(s->ctx, kept, sizeof *out);
    if (!out) return BATTEN_E_NOMEM;
  }
  for (size_t k = 0; k < kept; k++) {
    double a = parameter_of(s, s->found[k].at[0]), b = parameter_of(s, s->found[k].at[1]);
    out[k][0] = fmin(a, b);
    out[k][1] = fmax(a, b);
  }
  if (kept) qsort(out, kept, sizeof *out, compare_places);
  *count = kept;
  *parameters = out;
  return BATTEN_OK;
}

batten_status batten_curve_crossings(batten_context *ctx, const batten_curve *curve, size_t *count,
                                     double (**parameters)[2]) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!curve || !count || !parameters)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL; give a curve and room for the result",
                       !curve  ? "curve"
                       : count ? "parameters"
                               : "count");
  search s = {.ctx = ctx, .curve = curve, .degree = curve->space.degree};
  batten_status st = search_all(&s);
  if (st >= 0) st = report(&s, count, parameters);
  batten_free(ctx, s.found);
  batten_free(ctx, s.stack);
  batten_free(ctx, s.net);
  batten_free(ctx, s.span);
  return st;
}
