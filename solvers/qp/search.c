/* The steps that both phases of the primal method take, see primal.h: values and tolerances of the rows in sight,
 * moves, changes of the working set, and what to do where more rows are zero at x than can be members.
 *
 * Degeneracy follows [Fletcher, Resolving degeneracy in quadratic programming, Annals of Operations Research 46/47,
 * 1993]: where dropping a member leads nowhere because other rows are zero at x, the problem of these rows alone is
 * solved in the dual on a second level, where the sides are all met, and what comes out is either a direction along
 * which x can move or the proof that it need not. Fletcher's levels go on as long as the dual is degenerate in turn;
 * with a strictly convex objective it is not: each dual step raises the local minimum, so working sets cannot recur,
 * and the second level is the last [Goldfarb, Idnani 1983, theorem 3]. The method ends because x falls strictly
 * between two such points. */
#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "primal.h"

static double norm(size_t n, const double *a) {
  double most = 0, sum = 0;
  for (size_t i = 0; i < n; i++) most = fmax(most, fabs(a[i]));
  if (most == 0 || !isfinite(most)) return most;
  double unit = batten_unit(most);
  for (size_t i = 0; i < n; i++) sum += (unit * a[i]) * (unit * a[i]);
  return sqrt(sum) / unit;
}

/* Errors of sums of n terms, as a multiple of the sum of their sizes: they grow like the root of n; the factor leaves
 * room for the few sums that lead to x. */
double qp_search_error(size_t n) { return (16 + 4 * sqrt((double)n)) * DBL_EPSILON; }

/* The sign that makes a right multiplier of this side positive, and inside of it a_k'x - side. */
static double sign_of(signed char side) { return side == QP_UPPER ? -1 : 1; }

/* ---- Tolerances, values ---- */

double qp_search_terms(const qp_search *s, size_t k, const double *x) {
  const double *values;
  const uint32_t *columns;
  size_t count = qp_rows_entries(s->rows, k, &values, &columns);
  double sum = 0;
  for (size_t e = 0; e < count; e++) sum += fabs(values[e] * x[columns ? columns[e] : e]);
  return s->rows->scale[k] * sum;
}

double qp_search_tolerance(const qp_search *s, size_t place, double side) {
  return s->rounding[place] + qp_search_error(s->n) * fabs(side);
}

batten_status qp_search_pivot(qp_search *s) {
  double count = (double)++s->point->iterations;
  s->since++;
  return qp_limits_check(s->ctx, s->limits, s->point->iterations, count / (count + 2 * (double)s->n));
}

void qp_search_remember(qp_search *s) {
  for (size_t j = 0; j < s->n; j++) {
    s->most[j] = fmax(s->most[j], fabs(s->x[j]));
    s->ever[j] = fmax(s->ever[j], s->most[j]);
  }
  s->size = norm(s->n, s->most);
}

/* An unknown that is zero has errors from what it is computed from: more than its own size tells. */
static void compute(qp_search *s, size_t place) {
  const double FLOOR = 0x1p-20;
  size_t k = s->sight[place];
  s->value[place] = qp_rows_dot(s->rows, k, s->x);
  s->rounding[place] = qp_search_error(s->n) * fmax(qp_search_terms(s, k, s->most), FLOOR * s->size);
}

void qp_search_see(qp_search *s, size_t k) {
  if (s->is[k] & QP_SEEN) return;
  s->is[k] |= QP_SEEN;
  s->sight[s->sighted] = k;
  compute(s, s->sighted++);
}

void qp_search_refresh(qp_search *s) {
  memset(s->most, 0, s->n * sizeof *s->most);
  qp_search_remember(s);
  for (size_t i = 0; i < s->sighted; i++) compute(s, i);
  s->since = 0;
}

/* Rows in sight are scattered unless all are: then they come in order and one product does. */
void qp_search_slopes(qp_search *s) {
  if (s->sighted == s->m && s->m > 0 && s->sight[0] == 0 && s->sight[s->m - 1] == s->m - 1) {
    qp_rows_times(s->rows, 0, s->m, s->p, s->slope);
    return;
  }
  for (size_t i = 0; i < s->sighted; i++)
    s->slope[i] = s->is[s->sight[i]] & QP_MEMBER ? 0 : qp_rows_dot(s->rows, s->sight[i], s->p);
}

void qp_search_move(qp_search *s, double alpha) {
  double size = norm(s->n, s->x), length = alpha * norm(s->n, s->p);
  if (alpha > 0) {
    for (size_t j = 0; j < s->n; j++) s->x[j] += alpha * s->p[j];
    for (size_t i = 0; i < s->sighted; i++)
      if (!(s->is[s->sight[i]] & QP_MEMBER)) s->value[i] += alpha * s->slope[i];
    qp_search_remember(s);
  }
  if (length > qp_search_error(s->n) * size) s->stuck = 0;
}

/* aim := aim + J1 T^-T (sides - N'aim): rounding in J then leaves the members where they belong. */
static void onto_members(qp_search *s, double *aim) {
  for (size_t i = 0; i < s->set.q; i++)
    s->work[i] = qp_active_bound(&s->set, i) - qp_rows_dot(s->rows, s->set.member[i], aim);
  qp_active_solve_transposed(&s->set, s->work, s->work);
  qp_active_combine(&s->set, 0, s->set.q, 1, s->work, aim);
}

void qp_search_return(qp_search *s) {
  onto_members(s, s->x);
  qp_search_refresh(s);
}

/* ---- Working set ---- */

bool qp_search_add(qp_search *s, size_t place, signed char side) {
  size_t k = s->sight[place];
  qp_active_project(&s->set, k, s->d);
  if (qp_active_depends(&s->set, k, s->d)) return false;
  qp_active_add(&s->set, k, side, s->d);
  s->is[k] |= QP_MEMBER;
  return true;
}

void qp_search_drop(qp_search *s, size_t place) {
  s->is[s->set.member[place]] &= (unsigned char)~QP_MEMBER;
  qp_active_drop(&s->set, place);
}

void qp_search_direction(qp_search *s) {
  size_t n = s->n, q = s->set.q;
  if (s->weight > 0) qp_active_project_vector(&s->set, s->f, s->jf);
  if (isinf(s->weight)) {
    memset(s->p, 0, n * sizeof *s->p);
    qp_active_combine(&s->set, q, n, -1, s->jf, s->p);
    return;
  }
  for (size_t i = 0; i < q; i++) s->u[i] = qp_active_bound(&s->set, i);
  qp_active_solve_transposed(&s->set, s->u, s->u);
  for (size_t i = q; i < n; i++) s->u[i] = s->set.target[i] - (s->weight > 0 ? s->weight * s->jf[i] : 0);
  memset(s->aim, 0, n * sizeof *s->aim);
  qp_active_combine(&s->set, 0, n, 1, s->u, s->aim);
  onto_members(s, s->aim);
  for (size_t j = 0; j < n; j++) s->p[j] = s->aim[j] - s->x[j];
}

/* In need of the u and jf that direction left on this working set. */
void qp_search_multipliers(qp_search *s) {
  for (size_t i = 0; i < s->set.q; i++) {
    s->y[i] = isinf(s->weight) ? s->jf[i] : s->u[i] - s->set.target[i];
    if (s->weight > 0 && !isinf(s->weight)) s->y[i] += s->weight * s->jf[i];
  }
  qp_active_solve(&s->set, s->y, s->y);
}

/* Rounding in the gradient as J sees it. */
static double gradient_error(const qp_search *s) {
  double size = 0;
  if (!isinf(s->weight)) size += norm(s->set.q, s->u) + norm(s->set.q, s->set.target);
  if (s->weight > 0) size += (isinf(s->weight) ? 1 : s->weight) * norm(s->set.q, s->jf);
  return qp_search_error(s->n) * size;
}

/* Without member i the objective falls by (y_i / |row i of T^-1|)^2 / 2. */
static double row_of_inverse(qp_search *s, size_t place) {
  memset(s->work, 0, s->set.q * sizeof *s->work);
  s->work[place] = 1;
  qp_active_solve_transposed(&s->set, s->work, s->work);
  return norm(s->set.q - place, s->work + place);
}

size_t qp_search_wrong(qp_search *s) {
  size_t worst = s->set.q;
  double most = gradient_error(s);
  for (size_t i = 0; i < s->set.q; i++) {
    double wrong = -sign_of(s->set.side[i]) * s->y[i];
    if (s->set.side[i] == QP_EQUAL || wrong <= 0) continue;
    double gain = wrong / row_of_inverse(s, i);
    if (gain <= most) continue;
    most = gain;
    worst = i;
  }
  return worst;
}

/* ---- Degeneracy ---- */

/* Which side of a row in sight is met at x; QP_FREE if none. */
static signed char met_side(const qp_search *s, size_t place) {
  size_t k = s->sight[place];
  double lower = s->rows->lower[k], upper = s->rows->upper[k], v = s->value[place];
  if (isfinite(lower) && fabs(v - lower) <= qp_search_tolerance(s, place, lower)) return QP_LOWER;
  if (isfinite(upper) && fabs(v - upper) <= qp_search_tolerance(s, place, upper)) return QP_UPPER;
  return QP_FREE;
}

/* The row zero at x that p leads away from most; sighted if none. */
static size_t most_left(qp_search *s, signed char *side, double *by) {
  size_t worst = s->sighted;
  *by = qp_search_error(s->n) * norm(s->n, s->p);
  for (size_t i = 0; i < s->sighted; i++) {
    if (s->is[s->sight[i]] & (QP_MEMBER | QP_SKIPPED)) continue;
    signed char met = met_side(s, i);
    if (met == QP_FREE) continue;
    double away = -sign_of(met) * qp_rows_dot(s->rows, s->sight[i], s->p);
    if (away <= *by || (!isinf(s->weight) && away <= s->rounding[i])) continue; /* aim has the errors of x */
    *side = met;
    *by = away;
    worst = i;
  }
  return worst;
}

/* One step of the dual method [Goldfarb, Idnani 1983] for the row at a place, which the minimiser on the working set
 * misses by so much on this side: members whose multipliers reach zero on the way leave. */
static void dual_step(qp_search *s, size_t place, signed char side, double by) {
  size_t k = s->sight[place];
  double sign = sign_of(side);
  for (;;) {
    size_t q = s->set.q, leaving = q;
    qp_active_project(&s->set, k, s->d);
    bool depends = qp_active_depends(&s->set, k, s->d);
    double across = depends ? 0 : norm(s->n - q, s->d + q), full = depends ? INFINITY : by / (across * across),
           step = full;
    qp_active_solve(&s->set, s->d, s->work);
    for (size_t i = 0; i < q; i++) {
      double si = sign_of(s->set.side[i]), falls = si * sign * s->work[i];
      if (s->set.side[i] == QP_EQUAL || falls <= 0) continue;
      double until = fmax(0, si * s->y[i]) / falls;
      if (until >= step) continue;
      step = until;
      leaving = i;
    }
    if (leaving == q) {
      if (!depends) {
        qp_active_add(&s->set, k, side, s->d);
        s->is[k] |= QP_MEMBER;
        s->value[place] = side == QP_UPPER ? s->rows->upper[k] : s->rows->lower[k];
      } else
        s->is[k] |= QP_SKIPPED; /* made up of equalities and rows that cannot give way: zero on both sides */
      return;
    }
    for (size_t i = 0; i < q; i++) s->y[i] -= step * sign * s->work[i];
    memmove(s->y + leaving, s->y + leaving + 1, (q - leaving - 1) * sizeof *s->y);
    by -= step * across * across;
    qp_search_drop(s, leaving);
    s->point->iterations++;
  }
}

static void forget_skipped(qp_search *s) {
  for (size_t i = 0; i < s->sighted; i++) s->is[s->sight[i]] &= (unsigned char)~QP_SKIPPED;
}

static size_t most_steps(const qp_search *s) { return 20 * (s->n + s->sighted); }

bool qp_search_resolve(qp_search *s) {
  if (++s->stuck > QP_PATIENCE) return false;
  for (;;) {
    qp_search_direction(s);
    qp_search_multipliers(s);
    size_t wrong = qp_search_wrong(s);
    if (wrong == s->set.q) break;
    qp_search_drop(s, wrong);
    s->point->iterations++;
  }

  size_t place, steps = 0;
  signed char side = QP_FREE;
  double by;
  while ((place = most_left(s, &side, &by)) < s->sighted && steps++ < most_steps(s)) {
    dual_step(s, place, side, by);
    s->point->iterations++;
    qp_search_direction(s);
    qp_search_multipliers(s);
  }
  forget_skipped(s);
  if (isinf(s->weight)) return qp_phase1_falls(s);
  return norm(s->n, s->p) > qp_search_error(s->n) * norm(s->n, s->x);
}

/* ---- Rows that came into sight ---- */

/* The row in sight that x misses most; sighted if none. */
static size_t most_missed(const qp_search *s, signed char *side, double *by) {
  size_t worst = s->sighted;
  *by = 0;
  for (size_t i = 0; i < s->sighted; i++) {
    size_t k = s->sight[i];
    if (s->is[k] & (QP_MEMBER | QP_SKIPPED)) continue;
    double lower = s->rows->lower[k] - s->value[i], upper = s->value[i] - s->rows->upper[k];
    double out = fmax(lower, upper);
    if (out <= *by || out <= qp_search_tolerance(s, i, lower > upper ? s->rows->lower[k] : s->rows->upper[k]))
      continue;
    *by = out;
    *side = lower > upper ? QP_LOWER : QP_UPPER;
    worst = i;
  }
  return worst;
}

bool qp_search_meet(qp_search *s, batten_status *st) {
  size_t place, steps = 0;
  signed char side = QP_FREE;
  double by;
  bool met = false;
  *st = BATTEN_OK;
  while (!met && *st == BATTEN_OK && steps++ < most_steps(s)) {
    place = most_missed(s, &side, &by);
    if (place == s->sighted) { /* as far as values tell that have gathered rounding */
      met = s->since == 0;
      if (!met) qp_search_refresh(s);
      continue;
    }
    dual_step(s, place, side, by);
    if (s->is[s->sight[place]] & QP_SKIPPED) break;
    *st = qp_search_pivot(s);
    qp_search_direction(s);
    qp_search_multipliers(s);
    qp_search_slopes(s);
    qp_search_move(s, 1);
    memcpy(s->x, s->aim, s->n * sizeof *s->x);
  }
  forget_skipped(s);
  return met && qp_search_wrong(s) == s->set.q;
}
