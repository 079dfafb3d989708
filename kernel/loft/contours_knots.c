/* Knots of contours: as often as smoothness allows, near ones of different contours made equal.
 *
 * The control point of a spline over knots u' is the blossom of one of its polynomials at the arguments u'_(j + 1) ..
 * u'_(j + d): of any span in its support when the spline has these knots. So a knot that is there more often than the
 * spline needs (the seam of a closed curve that was written down clamped; Bezier pieces) is made less frequent, and a
 * knot is moved, without fitting anything: the span that reaches these arguments with least extrapolation is taken.
 * Points whose arguments are old knots in a row are copied. */
#include <stdio.h>
#include <string.h>

#include "base/checked.h"
#include "basis/refine.h"
#include "contours_inner.h"

/* Of the contours' size: jumps of derivatives below that are rounding; as places, by the shorter span beside them. */
static const double SMOOTH = 0x1p-37;
/* Of the leg that is longer by its knot interval, and of the contours' size: x'' below that is 0. */
static const double FLAT = 0x1p-33, FLAT_ROUNDING = 0x1p-46;

/* ---- smoothness ---------------------------------------------------------------------------------- */

static void derivatives(const contours_raw *r, size_t mu, double t, unsigned order, double (*out)[2]) {
  double table[3 * BSPLINE_ORDER];
  bspline_basis(&r->b, mu, t, order, table);
  unsigned d = r->b.degree;
  for (unsigned k = 0; k <= order; k++)
    for (size_t x = 0; x < 2; x++) {
      out[k][x] = 0;
      for (unsigned j = 0; j <= d; j++) out[k][x] += table[k * (d + 1) + j] * r->points[2 * (mu - d + j) + x];
    }
}

/* The first derivative up to order 2 that jumps between the end of span `before` and the start of span `after`, and
 * by how much as a place; 3 when none does. */
static unsigned first_jump(const contours_raw *r, size_t before, size_t after, double *amount) {
  double left[3][2], right[3][2], most = 0;
  const double *u = r->b.knots;
  derivatives(r, before, u[before + 1], 2, left);
  derivatives(r, after, u[after], 2, right);
  double h = fmin(u[before + 1] - u[before], u[after + 1] - u[after]), by = 1;
  for (size_t j = 0; j < 2 * r->b.count; j++) most = fmax(most, fabs(r->points[j]));
  for (unsigned k = 0; k < 3; k++, by *= h) {
    *amount = by * hypot(left[k][0] - right[k][0], left[k][1] - right[k][1]);
    if (*amount > SMOOTH * fmax(most, 1)) return k;
  }
  return 3;
}

static batten_status refuse(batten_context *ctx, const contours_raw *r, double t, unsigned fold, unsigned jump,
                            unsigned wanted, double amount) {
  static const char *const jumping[3] = {"point", "tangent", "second derivative"};
  const char *advice = r->slope   ? "give one without that jump, or NULL"
                       : jump < 2 ? "split all contours at that place (batten_curve_split) and loft the parts, or "
                                    "fit it anew"
                                  : "fit it with smoothness 2";
  char where[96], need[96] = "needs continuous first derivatives";
  double knot = bspline_blend(r->domain[0], r->domain[1], t);
  if (t == 0)
    snprintf(where, sizeof where, "where it closes, at t = %.17g", knot);
  else
    snprintf(where, sizeof where, "at the knot %.17g, which is there %u times", knot, fold - r->raised);
  if (jump == 2) snprintf(need, sizeof need, "with opt.smooth_z %u needs more: ask for 1, or for 0, or", wanted);
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "%s: %s, its %s jumps (%.2g of the contours' size on the shorter span); a loft %s%s %s", r->name,
                     where, jumping[jump], amount, need, jump == 2 ? "" : ":", advice);
}

/* At most `wanted` (2 if that is 0); below 1, or below what is wanted, it is refused. */
static batten_status find_smoothness(batten_context *ctx, const contours_raw *r, unsigned wanted, unsigned *out) {
  const bspline *b = &r->b;
  unsigned d = b->degree, need = wanted ? wanted : 1;
  size_t first = bspline_first(b), before = b->count;
  for (size_t mu = first; mu < b->count; before = mu, mu = bspline_next(b, mu)) {
    if (before == b->count && !r->closed) continue;
    unsigned fold = 0;
    double amount;
    if (before == b->count) { /* the seam */
      before = b->count - 1;
      fold = d + 1;
    } else {
      while (b->knots[mu - fold] == b->knots[mu]) fold++;
      if (fold + *out <= d) continue;
    }
    unsigned jump = first_jump(r, before, mu, &amount);
    if (jump <= need) return refuse(ctx, r, b->knots[mu], fold, jump, wanted, amount);
    if (jump <= *out) *out = jump - 1;
  }
  return BATTEN_OK;
}

batten_status contours_smoothness(batten_context *ctx, size_t count, const contours_raw *raw, unsigned wanted,
                                  unsigned *out) {
  unsigned least = wanted ? wanted : 2;
  if (raw->b.degree == 2 && wanted == 2)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.smooth_z: 2, but contours of degree 2 have one continuous derivative; ask for 1, or "
                       "for 0, or fit contours of a higher degree");
  if (raw->b.degree == 2) least = 1;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st >= 0; i++)
    if (raw[i].points) st = find_smoothness(ctx, raw + i, wanted, &least);
  if (st >= 0) *out = least;
  return st;
}

/* ---- merging ------------------------------------------------------------------------------------- */

/* Knots of the contours so far, ascending from 0 to 1. */
typedef struct pool {
  size_t count, room;
  double *knots;
} pool;

static size_t nearest(const pool *p, double t) {
  size_t low = 0, high = p->count - 1; /* knots[low] <= t <= knots[high] */
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (p->knots[middle] <= t)
      low = middle;
    else
      high = middle;
  }
  return t - p->knots[low] <= p->knots[high] - t ? low : high;
}

static batten_status pool_add(batten_context *ctx, pool *p, size_t count, const double *more) {
  size_t all;
  if (!batten_add(p->count, count, &all)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "contours: too many knots");
  if (all > p->room) {
    size_t room = all + all / 2;
    double *knots = batten_realloc_array(ctx, p->knots, room, sizeof *knots);
    if (!knots) return BATTEN_E_NOMEM;
    p->knots = knots;
    p->room = room;
  }
  /* From behind: the larger of both goes last. */
  for (size_t at = all, old = p->count; count > 0;)
    p->knots[--at] = old > 0 && p->knots[old - 1] > more[count - 1] ? p->knots[--old] : more[--count];
  p->count = all;
  return BATTEN_OK;
}

/* Each break's knot in the pool, NONE where it stays. Of two breaks that are near the same one the nearer one gets
 * it, and no break gets a place that its neighbour has. */
static const size_t NONE = SIZE_MAX;
static void find_partners(const pool *p, const contours_raw *r, double tolerance, size_t *partner) {
  size_t last = r->spans;
  for (size_t k = 0; k <= last; k++) {
    double t = r->breaks[k];
    size_t i = nearest(p, t);
    double gap = fabs(t - p->knots[i]);
    partner[k] = gap < tolerance || gap == 0 ? i : NONE;
    if (k == 0 || partner[k] == NONE || partner[k] != partner[k - 1]) continue;
    bool stays = k == 1 || (k != last && gap >= fabs(r->breaks[k - 1] - p->knots[i]));
    partner[stays ? k : k - 1] = NONE;
  }
  /* Knots nearer to the ends than the tolerance are the ends. */
  for (size_t k = 1; k < last; k++) {
    double t = r->breaks[k];
    if (t < tolerance && t < 1 - t) partner[k] = 0;
    if (1 - t < tolerance && 1 - t <= t) partner[k] = p->count - 1;
  }
  partner[0] = 0;
  partner[last] = p->count - 1;
}

/* Moves breaks to their partners; those at the ends go: of closed ones into the seam. fresh: those without. Returns
 * how many these are. */
static size_t move(const pool *p, const size_t *partner, unsigned most, contours_raw *r, double *fresh) {
  size_t kept = 0, count = 0, last = r->spans;
  unsigned seam = r->closed ? most : r->b.degree + 1;
  for (size_t k = 0; k <= last; k++) {
    double t = partner[k] == NONE ? r->breaks[k] : p->knots[partner[k]];
    bool inside = t > 0 && t < 1;
    if (partner[k] == NONE) fresh[count++] = t;
    if (t != r->breaks[k]) r->moved = true;
    if (!inside && k > 0 && k < last) continue;
    r->breaks[kept] = t;
    r->folds[kept++] = !inside ? seam : r->folds[k] < most ? r->folds[k] : most;
  }
  r->spans = kept - 1;
  return count;
}

/* A periodic space has more functions than the degree: longest spans are halved until it has. */
static void ensure_functions(contours_raw *r) {
  for (;;) {
    size_t count = 0, longest = 0;
    for (size_t s = 0; s < r->spans; s++) {
      count += r->folds[s];
      if (r->breaks[s + 1] - r->breaks[s] > r->breaks[longest + 1] - r->breaks[longest]) longest = s;
    }
    if (count > r->b.degree) return;
    size_t behind = r->spans - longest;
    memmove(r->breaks + longest + 2, r->breaks + longest + 1, behind * sizeof *r->breaks);
    memmove(r->folds + longest + 2, r->folds + longest + 1, behind * sizeof *r->folds);
    r->breaks[longest + 1] = r->breaks[longest] / 2 + r->breaks[longest + 2] / 2;
    r->folds[longest + 1] = 1;
    r->spans++;
  }
}

/* Room for as many spans as ensure_functions may need. */
static batten_status find_breaks(batten_context *ctx, contours_raw *r) {
  const bspline *b = &r->b;
  size_t spans = bspline_span_count(b), room = spans + 1 + b->degree, at = 0;
  r->breaks = batten_alloc_array(ctx, room, sizeof *r->breaks);
  r->folds = batten_alloc_array(ctx, room, sizeof *r->folds);
  if (!r->breaks || !r->folds) return BATTEN_E_NOMEM;
  r->spans = spans;
  for (size_t k = 0; k < b->count + b->degree + 1; k++) {
    if (k > 0 && b->knots[k] == b->knots[k - 1]) {
      r->folds[at - 1]++;
      continue;
    }
    r->breaks[at] = b->knots[k];
    r->folds[at++] = 1;
  }
  return BATTEN_OK;
}

static batten_status merge_one(batten_context *ctx, pool *p, double tolerance, unsigned smoothness, contours_raw *r) {
  batten_status st = find_breaks(ctx, r);
  if (st < 0) return st;
  size_t *partner = batten_alloc_array(ctx, r->spans + 1, sizeof *partner);
  double *fresh = partner ? batten_alloc_array(ctx, r->spans + 1, sizeof *fresh) : NULL;
  st = BATTEN_E_NOMEM;
  if (!fresh) goto done;
  find_partners(p, r, tolerance, partner);
  st = pool_add(ctx, p, move(p, partner, r->b.degree - smoothness, r, fresh), fresh);
  if (r->closed) ensure_functions(r);
done:
  batten_free(ctx, fresh);
  batten_free(ctx, partner);
  return st;
}

batten_status contours_merge(batten_context *ctx, size_t count, contours_raw *raw, double tolerance,
                             unsigned smoothness) {
  pool p = {0};
  const double ends[2] = {0, 1};
  batten_status st = pool_add(ctx, &p, 2, ends);
  for (size_t i = 0; i < count && st >= 0; i++)
    if (raw[i].points) st = merge_one(ctx, &p, tolerance, smoothness, raw + i);
  batten_free(ctx, p.knots);
  return st;
}

/* ---- control points ------------------------------------------------------------------------------ */

/* Where arguments [degree] stand in a row among the knots: the control point that has them; count if nowhere. */
static size_t find_row(const bspline *b, const double *arguments) {
  size_t low = 0, high = b->count + b->degree + 1;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (b->knots[middle] <= arguments[0])
      low = middle + 1;
    else
      high = middle;
  }
  unsigned times = 0, d = b->degree;
  while (times < d && arguments[times] == arguments[0]) times++;
  if (low < times + 1 || low - times - 1 >= b->count) return b->count;
  size_t j = low - times - 1;
  for (unsigned k = 0; k < d; k++)
    if (b->knots[j + 1 + k] != arguments[k]) return b->count;
  return j;
}

/* What a span, `shift` further on, has of the support u [degree + 2], and how far from it the inner knots are. */
static double overlap(const bspline *b, size_t mu, double shift, const double *u) {
  return fmin(b->knots[mu + 1] + shift, u[b->degree + 1]) - fmax(b->knots[mu] + shift, u[0]);
}

static double extrapolation(const bspline *b, size_t mu, double shift, const double *u) {
  double lower = b->knots[mu] + shift, upper = b->knots[mu + 1] + shift, product = 1;
  for (unsigned k = 1; k <= b->degree; k++)
    product *= 1 + 2 * fmax(0, fmax(lower - u[k], u[k] - upper)) / (upper - lower);
  return product;
}

/* Support u [degree + 2] of a new control point. */
static void take_blossom(const contours_raw *r, const double *u, double out[2]) {
  const bspline *b = &r->b;
  size_t best = 0;
  double best_shift = 0, best_value = INFINITY, widest = 0, arguments[BSPLINE_DEGREE];
  int periods = r->closed ? 1 : 0;
  /* Slivers are of neighbours whose knots moved: spans that have a good part of the support are asked. */
  for (int pass = 0; pass < 2; pass++)
    for (int shift = -periods; shift <= periods; shift++)
      for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
        double width = overlap(b, mu, shift, u);
        if (pass == 0) widest = fmax(widest, width);
        if (pass == 0 || !(width >= 0.25 * fmin(widest, b->knots[mu + 1] - b->knots[mu]))) continue;
        double value = extrapolation(b, mu, shift, u);
        if (value >= best_value) continue;
        best_value = value;
        best = mu;
        best_shift = shift;
      }
  for (unsigned k = 0; k < b->degree; k++) arguments[k] = u[k + 1] - best_shift;
  bspline_blossom(b, 2, r->points, best, arguments, out);
}

static void take_points(const contours_raw *r, const loft_space *space, double *out) {
  double u[BSPLINE_ORDER + 1];
  for (size_t j = 0; j < space->count; j++) {
    for (size_t k = 0; k < space->degree + 2; k++) u[k] = loft_knot(space, (ptrdiff_t)(j + k));
    size_t old = find_row(&r->b, u + 1);
    if (old < r->b.count)
      memcpy(out + 2 * j, r->points + 2 * old, 2 * sizeof *out);
    else
      take_blossom(r, u, out + 2 * j);
  }
}

/* ---- flat points --------------------------------------------------------------------------------- */

static void get_leg(const loft_space *s, const double *points, ptrdiff_t v, double out[2]) {
  ptrdiff_t n = (ptrdiff_t)s->count, from = ((v % n) + n) % n, to = (from + 1) % n;
  for (ptrdiff_t x = 0; x < 2; x++) out[x] = points[2 * to + x] - points[2 * from + x];
}

bool contours_is_flat(const loft_space *space, const double *points, ptrdiff_t v) {
  double a[2], b[2], i = loft_interval(space, v), k = loft_interval(space, v + 1);
  get_leg(space, points, v, a);
  get_leg(space, points, v + 1, b);
  double most = fmax(hypot(a[0], a[1]) / i, hypot(b[0], b[1]) / k);
  return hypot(b[0] / k - a[0] / i, b[1] / k - a[1] / i) <= FLAT * most + FLAT_ROUNDING / fmin(i, k);
}

/* Points with x'' = 0 at knots degree - 2 fold have it there when the knots have moved, too: the control point in the
 * middle gives way. */
static void keep_flat(const contours_raw *r, const loft_space *space, double *points) {
  unsigned d = space->degree;
  for (size_t i = r->closed ? 0 : 1; i < space->spans && d > 2; i++) {
    if (space->folds[i] != d - 2) continue;
    ptrdiff_t v = (ptrdiff_t)space->first[i]; /* its x'' control point has the copies of this knot as arguments */
    double t = space->breaks[i], gap = INFINITY, jet[3][2];
    size_t mu = 0;
    for (size_t k = bspline_first(&r->b); k < r->b.count; k = bspline_next(&r->b, k))
      if (fabs(r->b.knots[k] - t) < gap) {
        gap = fabs(r->b.knots[k] - t);
        mu = k;
      }
    derivatives(r, mu, r->b.knots[mu], 2, jet);
    double i0 = loft_interval(space, v), i1 = loft_interval(space, v + 1), size = hypot(jet[1][0], jet[1][1]);
    if (!(hypot(jet[2][0], jet[2][1]) * fmin(i0, i1) <= FLAT * size + FLAT_ROUNDING / fmin(i0, i1))) continue;
    size_t n = space->count, a = (size_t)v % n, b = ((size_t)v + 1) % n, c = ((size_t)v + 2) % n;
    for (size_t x = 0; x < 2; x++)
      points[2 * b + x] = bspline_blend(points[2 * a + x], points[2 * c + x], i0 / (i0 + i1));
  }
}

/* ---- the spline over its knots ------------------------------------------------------------------- */

/* The largest distance between both at degree + 1 places of each new span. */
static double find_shift(const contours_raw *r, const loft_space *space, const double *points) {
  double most = 0, row[BSPLINE_ORDER], old[1][2];
  unsigned d = space->degree;
  for (size_t s = 0; s < space->spans; s++)
    for (unsigned k = 0; k <= d; k++) {
      double t = bspline_blend(space->breaks[s], space->breaks[s + 1], (k + 0.5) / (d + 1)), now[2] = {0};
      derivatives(r, bspline_span(&r->b, t), t, 0, old);
      bspline_basis(&space->b, space->first[s] + d, t, 0, row);
      for (size_t j = 0; j <= d; j++)
        for (size_t x = 0; x < 2; x++) now[x] += row[j] * points[2 * ((space->first[s] + j) % space->count) + x];
      most = fmax(most, hypot(now[0] - old[0][0], now[1] - old[0][1]));
    }
  return most;
}

batten_status contours_convert(batten_context *ctx, const contours_raw *raw, loft_space *space, double **points,
                               double *shift) {
  batten_status st = loft_space_make(ctx, raw->b.degree, raw->closed, raw->spans, raw->breaks, raw->folds, space);
  if (st < 0) return st;
  double *out = batten_alloc_array(ctx, space->count, 2 * sizeof *out);
  if (!out) return BATTEN_E_NOMEM;
  take_points(raw, space, out);
  if (raw->moved) keep_flat(raw, space, out);
  *shift = raw->moved ? find_shift(raw, space, out) : 0;
  *points = out;
  return BATTEN_OK;
}
