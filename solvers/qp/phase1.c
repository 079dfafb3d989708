/* Phase 1: the simplex method for the sum of infeasibilities, in the working set that phase 2 goes on with
 * [Wolfe, The composite simplex algorithm, SIAM Review 7, 1965; Conn, SIAM J. Numerical Analysis 13, 1976].
 *
 *   F(x) = sum over rows of max(lower - a'x, 0) + max(a'x - upper, 0),   gradient f where no row is at a side
 *
 * F is piecewise linear and convex along p = -J2 J2'f. The search goes past the places where a row changes from
 * violated to satisfied or back until F stops falling there; the row of that place becomes a member. Where p is zero,
 * f = sum y_k a_k over the members, and a member whose y has the wrong sign is dropped. When none has, those y, with
 * 1 and -1 for the rows violated below and above, are a combination of all rows that is zero and whose sides' is
 * positive: no x satisfies them (Farkas).
 *
 * A vertex found so may be far from the minimum of the objective. Therefore the composite of both is tried before,
 * 1/2 |Rx - c|^2 + weight F(x), in the same way; it ends where F is zero, which for a weight above the largest
 * multiplier is no later than at the minimum. What it leaves undone after some weights, F alone decides. */
#include <float.h>
#include <string.h>

#include "primal.h"

static double dot(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t i = 0; i < n; i++) sum += a[i] * b[i];
  return sum;
}

/* Which side of the row at a place in sight is violated by more than factor times its rounding. */
static signed char violated_side(const qp_search *s, size_t place, double factor) {
  size_t k = s->sight[place];
  if (s->is[k] & QP_MEMBER) return QP_FREE;
  double lower = s->rows->lower[k], upper = s->rows->upper[k], v = s->value[place];
  if (v < lower && lower - v > factor * qp_search_tolerance(s, place, lower)) return QP_LOWER;
  if (v > upper && v - upper > factor * qp_search_tolerance(s, place, upper)) return QP_UPPER;
  return QP_FREE;
}

/* f at x; says whether a row is violated. */
static bool gradient(qp_search *s) {
  memset(s->f, 0, s->n * sizeof *s->f);
  s->f_size = 0;
  for (size_t i = 0; i < s->sighted; i++) {
    signed char side = violated_side(s, i, 1);
    if (side == QP_FREE) continue;
    qp_rows_add(s->rows, s->sight[i], side == QP_LOWER ? -1 : 1, s->f);
    s->f_size++;
  }
  return s->f_size > 0;
}

/* Of f'p: f is a sum of f_size rows of length 1. */
static double slope_error(const qp_search *s) {
  return qp_search_error(s->n) * s->f_size * sqrt(dot(s->n, s->p, s->p));
}

bool qp_phase1_falls(const qp_search *s) { return -dot(s->n, s->f, s->p) > slope_error(s); }

/* ---- Along p ---- */

/* Heap with the nearest place on top, the steepest first among equals. */
static bool before(const qp_break *a, const qp_break *b) {
  return a->at != b->at ? a->at < b->at : a->steeper > b->steeper;
}

static void sift(qp_break *heap, size_t count, size_t i) {
  for (;;) {
    size_t child = 2 * i + 1;
    if (child >= count) return;
    if (child + 1 < count && before(heap + child + 1, heap + child)) child++;
    if (!before(heap + child, heap + i)) return;
    qp_break kept = heap[i];
    heap[i] = heap[child];
    heap[child] = kept;
    i = child;
  }
}

static qp_break take_first(qp_break *heap, size_t *count) {
  qp_break first = heap[0];
  heap[0] = heap[--*count];
  sift(heap, *count, 0);
  return first;
}

/* Where the row at a place crosses its sides, up to two entries. Along r > 0 the lower side is crossed by a row that
 * is violated there, the upper side by any that is not yet above it. */
static size_t breaks_of_row(const qp_search *s, size_t place, qp_break *out) {
  size_t k = s->sight[place], count = 0;
  double v = s->value[place], r = s->slope[place];
  signed char violated = violated_side(s, place, 1), left = r > 0 ? QP_LOWER : QP_UPPER,
              entered = r > 0 ? QP_UPPER : QP_LOWER;
  double from = left == QP_LOWER ? s->rows->lower[k] : s->rows->upper[k];
  double to = entered == QP_LOWER ? s->rows->lower[k] : s->rows->upper[k];
  if (violated == left) out[count++] = (qp_break){fmax(0, (from - v) / r), fabs(r), place, left};
  if (violated != entered && isfinite(to)) out[count++] = (qp_break){fmax(0, (to - v) / r), fabs(r), place, entered};
  return count;
}

static size_t collect_breaks(qp_search *s) {
  double level = 4 * (double)s->n * DBL_EPSILON * sqrt(dot(s->n, s->p, s->p));
  size_t count = 0;
  qp_search_slopes(s);
  for (size_t i = 0; i < s->sighted; i++)
    if (!(s->is[s->sight[i]] & QP_MEMBER) && fabs(s->slope[i]) > level)
      count += breaks_of_row(s, i, s->breaks + count);
  for (size_t i = count / 2; i-- > 0;) sift(s->breaks, count, i);
  return count;
}

/* Takes the row of a break into the working set and x there, unless the row depends on the members. */
static bool stop_at(qp_search *s, const qp_break *b) {
  if (!qp_search_add(s, b->place, b->side)) return false;
  qp_search_move(s, b->at);
  s->value[b->place] = b->side == QP_UPPER ? s->rows->upper[s->sight[b->place]] : s->rows->lower[s->sight[b->place]];
  return true;
}

/* Moves along p to the minimum of F and takes the row there into the working set. False when there is none, which
 * only rounding can bring about: F is bounded below. */
static bool search_along(qp_search *s) {
  double slope = dot(s->n, s->f, s->p), error = slope_error(s);
  size_t count = collect_breaks(s);
  while (count > 0) {
    qp_break b = take_first(s->breaks, &count);
    slope += b.steeper;
    if (slope >= -error && stop_at(s, &b)) return true;
  }
  return false;
}

/* ---- Proof ---- */

static void write_proof(qp_search *s) {
  memset(s->point->y, 0, s->m * sizeof *s->point->y);
  for (size_t i = 0; i < s->set.q; i++) s->point->y[s->set.member[i]] = s->y[i];
  for (size_t i = 0; i < s->sighted; i++) {
    signed char side = violated_side(s, i, 1);
    if (side != QP_FREE) s->point->y[s->sight[i]] = side == QP_LOWER ? 1 : -1;
  }
}

/* At a minimum of F: whether its rest is rounding after all, seen from x on the members' sides, against the length of
 * x and the entries that it had on the way. Rows that depend on the members cannot be met better than these are. */
static bool rest_is_rounding(qp_search *s) {
  qp_search_return(s);
  for (size_t i = 0; i < s->sighted; i++)
    s->rounding[i] = qp_search_error(s->n) * fmax(qp_search_terms(s, s->sight[i], s->ever), s->size);
  for (size_t i = 0; i < s->sighted; i++)
    if (violated_side(s, i, QP_LOOSE) != QP_FREE) return false;
  return true;
}

/* ---- Composite ---- */

/* |R p|^2: curvature of the objective along p. */
static double curvature(qp_search *s) {
  size_t n = s->n;
  memset(s->work, 0, n * sizeof *s->work);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= j; i++) s->work[i] += s->objective->r[i + j * n] * s->p[j];
  return dot(n, s->work, s->work);
}

/* Moves along p to the minimum of the composite, at a row that becomes a member or between rows. True when p was gone
 * all along with the same rows violated: x is the minimiser on the working set. */
static bool composite_search(qp_search *s) {
  double curved = curvature(s), steeper = 0;
  size_t count = collect_breaks(s);
  while (count > 0) {
    qp_break b = take_first(s->breaks, &count);
    double slope = steeper - (1 - b.at) * curved;
    if (slope >= 0) break;
    steeper += s->weight * b.steeper;
    if (slope + s->weight * b.steeper >= 0) {
      if (stop_at(s, &b)) return false;
      steeper -= s->weight * b.steeper;
    }
  }
  qp_search_move(s, curved > 0 ? fmax(0, 1 - steeper / curved) : 1);
  return steeper == 0;
}

/* The weight to start with: twice the largest multiplier, as far as it can be told: those of the members, and what
 * rows violated now would get if each were met alone. One too large leads to a vertex far from the minimum. */
static double first_weight(qp_search *s) {
  const size_t LOOKS = 16;
  double weight = 0;
  size_t looked = 0, step = 1 + (size_t)s->f_size / LOOKS, place = 0;
  for (size_t i = 0; i < s->sighted && looked < LOOKS; i++) {
    signed char side = violated_side(s, i, 1);
    if (side == QP_FREE || place++ % step) continue;
    size_t k = s->sight[i];
    looked++;
    qp_active_project(&s->set, k, s->d);
    double by = side == QP_LOWER ? s->rows->lower[k] - s->value[i] : s->value[i] - s->rows->upper[k];
    weight = fmax(weight, by / dot(s->n, s->d, s->d));
  }
  qp_search_direction(s);
  qp_search_multipliers(s);
  for (size_t i = 0; i < s->set.q; i++) weight = fmax(weight, fabs(s->y[i]));
  return 2 * weight;
}

/* Goes to a point where the rows in sight hold by the composite, if some weight leads there. */
static batten_status try_composite(qp_search *s) {
  const int WEIGHTS = 10;
  const double HEAVIER = 4;
  size_t pivots = 0, enough = 100 + 10 * s->n;
  int weights = 0;
  s->weight = 0;
  s->weight = first_weight(s);
  while (s->weight > 0 && isfinite(s->weight) && pivots++ < enough && gradient(s)) {
    batten_status st = qp_search_pivot(s);
    if (st != BATTEN_OK) return st;
    qp_search_direction(s);
    if (!composite_search(s)) continue;
    qp_search_multipliers(s);
    if (qp_search_wrong(s) < s->set.q) {
      if (!qp_search_resolve(s)) break;
    } else {
      if (++weights == WEIGHTS) break;
      s->weight *= HEAVIER;
    }
  }
  return BATTEN_OK;
}

/* ---- F alone ---- */

static batten_status simplex(qp_search *s) {
  const size_t REFRESH = 50;                       /* pivots after which values have gathered rounding */
  const size_t ENOUGH = 1000 + 50 * (s->n + s->m); /* far more than any problem needs; only rounding gets there */
  size_t pivots = 0, looks = 0;
  s->weight = INFINITY;
  while (gradient(s)) {
    batten_status st = qp_search_pivot(s);
    if (st != BATTEN_OK) return st;
    if (++pivots > ENOUGH)
      return batten_fail(s->ctx, BATTEN_W_ACCURACY, "rounding: no feasible point after %zu pivots", pivots);
    if (s->since > REFRESH) {
      qp_search_return(s);
      continue;
    }
    qp_search_direction(s);
    if (qp_phase1_falls(s) && search_along(s)) continue;
    qp_search_multipliers(s);
    if (qp_search_wrong(s) < s->set.q && qp_search_resolve(s) && search_along(s)) continue;
    double violated = s->f_size;
    if (rest_is_rounding(s)) return BATTEN_OK;
    if (!gradient(s)) return BATTEN_OK;
    if (s->f_size != violated && looks++ < 3) continue;
    write_proof(s);
    return batten_fail(s->ctx, BATTEN_E_INFEASIBLE, "no x satisfies the constraints");
  }
  return BATTEN_OK;
}

batten_status qp_phase1(qp_search *s) {
  s->stuck = 0;
  qp_search_refresh(s);
  if (!gradient(s)) return BATTEN_OK;
  batten_status st = try_composite(s);
  if (st == BATTEN_OK) {
    qp_search_return(s);
    s->stuck = 0;
    st = simplex(s);
  }
  s->weight = 0;
  if (st == BATTEN_OK) qp_search_return(s);
  return st;
}
