/* Pieces by bisection.   [section 2.2 (ii)]
 *
 * Directions of a_i relative to their mean lie in [theta_0, theta_1], those of c_i in [phi_0, phi_1], turned towards
 * the wanted side. u may have any angle between phi_1 - pi and theta_0, v any between theta_1 and phi_0. Where these
 * gaps are wide enough the piece is accepted, with u and v inside the gaps: the reference then satisfies all
 * inequalities strictly. Else the piece is halved. Its differences tend to the directions of x' and x'', which
 * enclose an angle inside (0, pi) wherever curvature has its sign; at an inflection with x'' = 0 the second
 * differences tend to x'''. So bisection ends.
 *
 * Where in its gap v lies says how much of it is left to the first differences, and how much to the second ones;
 * likewise u. A first reference may be far away in direction, and first differences get most of the gaps. Later ones
 * lie where the last solution has pushed them within its own u and v: near v with their first differences, where
 * these want more room, or with their second ones. So a direction that was near one side of its gap is put near the
 * other: what was at its limit becomes free. (Three such rounds do what four or five with u and v in the middle do.)
 */
#include "wedges.h"

#include <string.h>

#include "base/checked.h"

/* The part of a gap that first differences have at first, and the least that either kind has later. */
static const double FIRST_SHARE = 0.8, LEAST_SHARE = 0.15;

/* A reference that is nearly straight, or changes its speed much, has x'' nearly along x', however small the piece. A
 * gap of this part of their angle is then enough, down to the least one. */
static const double LIMIT_PART = 0.5, LEAST_GAP = 1e-9;

enum { STACK = 64 }; /* > deepest bisection */

void contour_piece_set(contour_piece *p, const contour_shape *shape, const bspline *b, const contour_wedge *w) {
  bspline_rows(b, w->mu, 1, w->from, w->to, p->first);
  bspline_rows(b, w->mu, 2, w->from, w->to, p->second);
  size_t span = (w->mu - b->degree) / (b->degree - shape->smoothness); /* inner breaks have that many knots */
  bool smooth = shape->smoothness > 1;
  p->zero_first = smooth && w->from == b->knots[w->mu] && contour_inflection(shape, span);
  p->zero_last = smooth && w->to == b->knots[w->mu + 1] && contour_inflection(shape, span + 1);
}

static void times(const double *row, unsigned count, const double *points, double out[2]) {
  out[0] = out[1] = 0;
  for (unsigned j = 0; j < count; j++)
    for (unsigned k = 0; k < 2; k++) out[k] += row[j] * points[2 * j + k];
}

static double length(unsigned count, const double *row) {
  double sum = 0;
  for (unsigned j = 0; j < count; j++) sum += row[j] * row[j];
  return sqrt(sum);
}

/* A piece with the vectors that the reference has there. */
typedef struct differences {
  contour_piece rows;
  unsigned degree, from, to; /* second differences from .. to - 1 count */
  double a[BSPLINE_ORDER][2], c[BSPLINE_ORDER][2];
} differences;

/* False when one of them is too short for its direction to mean something. */
static bool differences_set(differences *d, const contour_shape *shape, const bspline *b, const double *reference,
                            const contour_wedge *w) {
  unsigned order = b->degree + 1;
  const double *points = reference + 2 * (w->mu - b->degree);
  bool clear = true;
  contour_piece_set(&d->rows, shape, b, w);
  d->degree = b->degree;
  d->from = d->rows.zero_first ? 1 : 0;
  d->to = b->degree - (d->rows.zero_last ? 2U : 1U);
  for (unsigned i = 0; i < b->degree; i++) {
    const double *row = d->rows.first + i * order;
    times(row, order, points, d->a[i]);
    clear = clear && hypot(d->a[i][0], d->a[i][1]) > CONTOUR_CLEAR * length(order, row);
  }
  for (unsigned i = d->from; i < d->to; i++) {
    const double *row = d->rows.second + i * order;
    times(row, order, points, d->c[i]);
    clear = clear && hypot(d->c[i][0], d->c[i][1]) > CONTOUR_CLEAR * length(order, row);
  }
  return clear && d->from < d->to;
}

/* Whether the reference satisfies the inequalities of w so that rounding does not decide. */
static bool wedge_holds(const differences *d, const contour_wedge *w) {
  unsigned order = d->degree + 1;
  double least = INFINITY, s = w->sign;
  for (unsigned i = 0; i < d->degree; i++) {
    double size = length(order, d->rows.first + i * order);
    least = fmin(least, fmin(s * contour_cross(w->u, d->a[i]), s * contour_cross(d->a[i], w->v)) / size);
  }
  for (unsigned i = d->from; i < d->to; i++) {
    double size = length(order, d->rows.second + i * order);
    least = fmin(least, fmin(s * contour_cross(w->u, d->c[i]), s * contour_cross(w->v, d->c[i])) / size);
  }
  return s * contour_cross(w->u, w->v) > 0 && least > CONTOUR_CLEAR;
}

/* The gap that is asked for where bisection can bring it to `limit` at most. */
static double wanted(double gap, double limit) { return fmax(LEAST_GAP, fmin(gap, LIMIT_PART * limit)); }

/* The part of a gap for first differences, where an old direction left them `room` of it. */
static double share(double room, double gap) { return fmin(1 - LEAST_SHARE, fmax(LEAST_SHARE, 1 - room / gap)); }

/* Angle from the unit vector `mean`, to the side s. */
static double angle_of(const double mean[2], double s, const double w[2]) {
  return atan2(s * contour_cross(mean, w), mean[0] * w[0] + mean[1] * w[1]);
}

static void turn_by(const double mean[2], double angle, double out[2]) {
  out[0] = mean[0] * cos(angle) - mean[1] * sin(angle);
  out[1] = mean[1] * cos(angle) + mean[0] * sin(angle);
}

/* Directions for a piece, whose place and sign are set. old: the piece that was there, or NULL. */
static bool wedge_find(const differences *d, double gap, const contour_wedge *old, contour_wedge *w) {
  const double pi = acos(-1), half = pi / 2, s = w->sign;
  double mean[2] = {0}, theta[2] = {INFINITY, -INFINITY}, phi[2] = {INFINITY, -INFINITY};
  for (unsigned i = 0; i < d->degree; i++)
    for (int k = 0; k < 2; k++) mean[k] += d->a[i][k] / hypot(d->a[i][0], d->a[i][1]);
  double size = hypot(mean[0], mean[1]);
  if (!(size > 0)) return false;
  for (int k = 0; k < 2; k++) mean[k] /= size;
  double first = 0, last = 0; /* the directions at the ends of the piece, to which smaller pieces shrink */
  for (unsigned i = 0; i < d->degree; i++) {
    double angle = angle_of(mean, s, d->a[i]);
    theta[0] = fmin(theta[0], angle);
    theta[1] = fmax(theta[1], angle);
    if (i == 0) first = -angle;
    last = -angle;
  }
  for (unsigned i = d->from; i < d->to; i++) { /* around the normal */
    double along = mean[0] * d->c[i][0] + mean[1] * d->c[i][1];
    double angle = half + atan2(-along, s * contour_cross(mean, d->c[i]));
    phi[0] = fmin(phi[0], angle);
    phi[1] = fmax(phi[1], angle);
    if (i == d->from) first += angle;
    if (i + 1 == d->to) last += angle;
  }
  double gap_v = phi[0] - theta[1], gap_u = theta[0] - (phi[1] - pi);
  if (!(gap_v > wanted(gap, fmin(first, last)) && gap_u > wanted(gap, pi - fmax(first, last)))) return false;
  double share_u = old ? share(theta[0] - angle_of(mean, s, old->u), gap_u) : FIRST_SHARE;
  double share_v = old ? share(angle_of(mean, s, old->v) - theta[1], gap_v) : FIRST_SHARE;
  turn_by(mean, s * (theta[0] - share_u * gap_u), w->u);
  turn_by(mean, s * (theta[1] + share_v * gap_v), w->v);
  return wedge_holds(d, w);
}

/* ---- all spans ---------------------------------------------------------------------------------- */

typedef struct search {
  batten_context *ctx;
  const contour_shape *shape;
  const bspline *b;
  const double *reference;
  const contour_row_options *opt;
  const contour_rows *old;
  bool keep;
  contour_wedge *wedges;
  size_t count, room;
} search;

static batten_status add(search *s, const contour_wedge *w) {
  if (!s->keep) return BATTEN_OK;
  if (s->count == s->opt->row_limit)
    return batten_fail(s->ctx, BATTEN_E_TOO_LARGE,
                       "row_limit: %zu inequalities are not enough; raise it, or lower depth_max", s->opt->row_limit);
  if (s->count == s->room) {
    size_t room = s->room + s->room / 2 + 16;
    contour_wedge *larger = batten_realloc_array(s->ctx, s->wedges, room, sizeof *larger);
    if (!larger) return BATTEN_E_NOMEM;
    s->wedges = larger;
    s->room = room;
  }
  s->wedges[s->count++] = *w;
  return BATTEN_OK;
}

/* The old piece at the middle of w, or NULL. */
static const contour_wedge *old_piece(const search *s, const contour_wedge *w) {
  if (!s->old) return NULL;
  double middle = w->from + (w->to - w->from) / 2;
  size_t low = 0, high = s->old->wedge_count;
  while (high - low > 1) {
    size_t at = low + (high - low) / 2;
    if (middle < s->old->wedges[at].from)
      high = at;
    else
      low = at;
  }
  const contour_wedge *o = &s->old->wedges[low];
  return o->mu == w->mu && o->sign == w->sign ? o : NULL;
}

/* Whether an old piece can stand for w: bisection of the same breaks nests. */
static bool old_holds(const search *s, const contour_wedge *o, const contour_wedge *w) {
  differences d;
  return o && o->from <= w->from && w->to <= o->to && differences_set(&d, s->shape, s->b, s->reference, o) &&
         wedge_holds(&d, o);
}

/* The span mu, of a sign. *fits = false: it does not bend clearly enough. */
static batten_status bisect(search *s, size_t mu, signed char sign, bool *fits) {
  struct {
    double from, to;
    unsigned depth;
  } stack[STACK];
  size_t open = 0, before = s->count;
  differences d;
  stack[open].from = s->b->knots[mu];
  stack[open].to = s->b->knots[mu + 1];
  stack[open++].depth = 0;
  *fits = true;
  while (open > 0) {
    contour_wedge w = {.mu = mu, .from = stack[open - 1].from, .to = stack[open - 1].to, .sign = sign};
    unsigned depth = stack[--open].depth;
    double middle = w.from + (w.to - w.from) / 2;
    const contour_wedge *o = old_piece(s, &w);
    bool found = differences_set(&d, s->shape, s->b, s->reference, &w) && wedge_find(&d, s->opt->gap, o, &w);
    if (!found && depth < s->opt->depth_max && w.from < middle && middle < w.to) {
      stack[open].from = middle;
      stack[open].to = w.to;
      stack[open++].depth = depth + 1;
      stack[open].from = w.from;
      stack[open].to = middle;
      stack[open++].depth = depth + 1;
      continue;
    }
    if (!found) {
      *fits = old_holds(s, o, &w);
      if (!*fits) return BATTEN_OK;
      w = *o;
      while (s->count > before && s->wedges[s->count - 1].from >= w.from) s->count--;
      while (open > 0 && stack[open - 1].from < w.to) open--;
    }
    batten_status st = add(s, &w);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

batten_status contour_wedges_make(batten_context *ctx, const contour_shape *shape, const bspline *b,
                                  const double *reference, const contour_row_options *opt, const contour_rows *old,
                                  bool *accepted, contour_wedge **wedges, size_t *count) {
  search s = {ctx, shape, b, reference, opt, old, .keep = wedges != NULL};
  batten_status st = BATTEN_OK;
  bool fits = true;
  size_t span = 0;
  for (size_t mu = bspline_first(b); mu < b->count && fits && st >= 0; mu = bspline_next(b, mu), span++)
    st = bisect(&s, mu, shape->signs[span], &fits);
  if (st >= 0) *accepted = fits;
  if (st >= 0 && fits && wedges) {
    *wedges = s.wedges;
    *count = s.count;
  } else {
    batten_free(ctx, s.wedges);
  }
  return st;
}
