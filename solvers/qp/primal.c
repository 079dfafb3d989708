/* Primal active set method [Fletcher, Practical Methods of Optimization, 2nd ed., 10.3; Gill, Murray 1978],
 * null-space form on the factorised working set of active.h:
 *
 *   at a feasible x, go towards the minimiser on the working set; a row that is met on the way becomes a member;
 *   at the minimiser, drop a member whose multiplier has the wrong sign; when there is none, x is optimal.
 *
 * The minimiser is computed from the members' sides and Q'c each time, not updated, so that errors do not gather.
 * Degeneracy: search.c. A feasible point: phase1.c.
 *
 * Most of very many rows are far from all iterates. The method runs on the rows in sight; a survey of all rows then
 * takes the safe point, which is feasible in all of them, as far as it can go towards the minimiser found, and brings
 * into sight the row that stops it and the most violated ones of each stretch of rows. The objective at the safe
 * point never rises, and it is what a limit or cancel leaves. Once there is one, dual steps lead from the minimiser
 * to that with the new rows, as on the second level of search.c; where rounding spoils them the method itself goes on
 * from the safe point. Each survey but the last brings a row into sight, so there are finitely many. */
#include "primal.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"

/* Up to this many rows beyond 4 n are all taken into sight: a pass over them costs no more than a pivot's update. */
enum { FEW_ROWS = 64 };

static size_t rows_in_sight_at_first(size_t n, size_t m) { return m <= 4 * n + FEW_ROWS ? m : 0; }

/* ---- Ratio test ---- */

/* How far along p the row at a place in sight lets x go, with its sides moved out by slack times the tolerance. */
static double reach_of_row(const qp_search *s, size_t place, double slack) {
  size_t k = s->sight[place];
  double r = s->slope[place], side = r < 0 ? s->rows->lower[k] : s->rows->upper[k];
  if (!isfinite(side)) return INFINITY;
  double room =
      (r < 0 ? s->value[place] - side : side - s->value[place]) + slack * qp_search_tolerance(s, place, side);
  return fmax(0, room) / fabs(r);
}

/* The row that stops x along p before 1, and where; sighted if none. Of those that stop it within rounding of the
 * first the steepest is taken [Harris 1973]: it makes the best member. */
static size_t stopping_row(const qp_search *s, double *alpha) {
  double length = 0, first = 1;
  for (size_t j = 0; j < s->n; j++) length += s->p[j] * s->p[j];
  double level = 4 * (double)s->n * DBL_EPSILON * sqrt(length), steepest = 0;
  for (size_t i = 0; i < s->sighted; i++)
    if (!(s->is[s->sight[i]] & (QP_MEMBER | QP_SKIPPED)) && fabs(s->slope[i]) > level)
      first = fmin(first, reach_of_row(s, i, 1));
  size_t stops = s->sighted;
  for (size_t i = 0; i < s->sighted && first < 1; i++) {
    if (s->is[s->sight[i]] & (QP_MEMBER | QP_SKIPPED) || fabs(s->slope[i]) <= level) continue;
    if (fabs(s->slope[i]) <= steepest || reach_of_row(s, i, 0) > first) continue;
    steepest = fabs(s->slope[i]);
    stops = i;
  }
  *alpha = stops < s->sighted ? reach_of_row(s, stops, 0) : 1;
  return stops;
}

/* ---- Phase 2 on the rows in sight ---- */

/* Goes along p until a row stops x, which becomes a member (false), or to the minimiser (true). Rows that stop x but
 * depend on the members do so by rounding and are passed. */
static bool advance(qp_search *s) {
  double alpha;
  size_t stops;
  bool more = false;
  qp_search_slopes(s);
  while ((stops = stopping_row(s, &alpha)) < s->sighted) {
    if (qp_search_add(s, stops, s->slope[stops] < 0 ? QP_LOWER : QP_UPPER)) break;
    s->is[s->sight[stops]] |= QP_SKIPPED;
    more = true;
  }
  if (more)
    for (size_t i = 0; i < s->sighted; i++) s->is[s->sight[i]] &= (unsigned char)~QP_SKIPPED;
  qp_search_move(s, alpha);
  if (stops == s->sighted) {
    memcpy(s->x, s->aim, s->n * sizeof *s->x);
    return true;
  }
  size_t k = s->sight[stops];
  s->value[stops] = s->slope[stops] < 0 ? s->rows->lower[k] : s->rows->upper[k];
  return false;
}

/* From a point where the rows in sight hold to the minimiser on them. */
static batten_status descend(qp_search *s) {
  const size_t REFRESH = 100;
  const size_t ENOUGH = 1000 + 50 * (s->n + s->m);
  size_t pivots = 0;
  s->stuck = 0;
  qp_search_refresh(s);
  for (;;) {
    batten_status st = qp_search_pivot(s);
    if (st != BATTEN_OK) return st;
    if (++pivots > ENOUGH)
      return batten_fail(s->ctx, BATTEN_W_ACCURACY, "rounding: no minimum after %zu pivots", pivots);
    if (s->since > REFRESH) qp_search_refresh(s);
    qp_search_direction(s);
    if (!advance(s)) continue;
    qp_search_multipliers(s);
    if (qp_search_wrong(s) == s->set.q || !qp_search_resolve(s)) return BATTEN_OK;
  }
}

/* ---- Survey of all rows ---- */

/* How far a value is outside of its row's sides, beyond rounding: of a row in sight in terms of the length of x,
 * since the search has done what it could; of others in those of its own terms. */
static double outside(const qp_search *s, size_t k, double value) {
  double lower = s->rows->lower[k], upper = s->rows->upper[k], side = value < lower ? lower : upper;
  double by = value < lower ? lower - value : value - upper, error = qp_search_error(s->n);
  if (!(by > 0)) return 0;
  if (by > error * (s->size + fabs(side))) return by; /* the row has length 1 */
  if (s->is[k] & QP_SEEN) return 0;
  return by > error * (qp_search_terms(s, k, s->most) + fabs(side)) ? by : 0;
}

/* Takes the safe point towards x as far as all rows allow, brings into sight what stops it and, of every stretch of
 * rows, the most violated. Without a safe point x becomes it if all rows hold. Says whether rows came into sight. */
static bool survey(qp_search *s) {
  size_t m = s->m, before = s->sighted, stops = m;
  size_t stretch = m / 64 < 32 ? 32 : m / 64 > 1024 ? 1024 : m / 64;
  double alpha = 1;
  memset(s->most, 0, s->n * sizeof *s->most);
  qp_search_remember(s);
  bool all_hold = true;
  for (size_t first = 0; first < m; first += stretch) {
    size_t count = m - first < stretch ? m - first : stretch, worst = m;
    double most = 0;
    qp_rows_times(s->rows, first, count, s->x, s->new_value + first);
    for (size_t k = first; k < first + count; k++) {
      double by = outside(s, k, s->new_value[k]);
      if (by == 0) continue;
      all_hold = false;
      if (!(s->is[k] & QP_SEEN) && by > most) {
        most = by;
        worst = k;
      }
      if (!s->have_safe) continue;
      double side = s->new_value[k] < s->rows->lower[k] ? s->rows->lower[k] : s->rows->upper[k];
      double reach = fmin(1, fmax(0, (s->safe_value[k] - side) / (s->safe_value[k] - s->new_value[k])));
      if (reach < alpha) {
        alpha = reach;
        stops = k;
      }
    }
    if (worst < m) qp_search_see(s, worst);
  }
  if (stops < m) qp_search_see(s, stops);
  if (all_hold) {
    memcpy(s->safe, s->x, s->n * sizeof *s->safe);
    memcpy(s->safe_value, s->new_value, m * sizeof *s->safe_value);
    s->have_safe = true;
  } else if (s->have_safe && alpha > 0) {
    for (size_t j = 0; j < s->n; j++) s->safe[j] += alpha * (s->x[j] - s->safe[j]);
    for (size_t k = 0; k < m; k++) s->safe_value[k] += alpha * (s->new_value[k] - s->safe_value[k]);
  }
  return s->sighted > before;
}

/* ---- Start ---- */

/* Equalities as members. One that depends on the others must hold with them, or no x satisfies them. */
static batten_status take_equalities(qp_search *s) {
  size_t count = 0;
  signed char *side = (signed char *)s->breaks; /* scratch of more than m bytes */
  for (size_t k = 0; k < s->m; k++)
    if (qp_rows_is_equality(s->rows, k)) s->sight[count++] = k;
  memset(side, QP_EQUAL, count);
  batten_status st = qp_active_add_many(s->ctx, &s->set, count, s->sight, side);
  if (st < 0) return st;
  for (size_t i = 0; i < s->set.q; i++) s->is[s->set.member[i]] |= QP_MEMBER | QP_SEEN;
  qp_search_direction(s);
  for (size_t i = 0; i < count; i++) {
    size_t k = s->sight[i];
    if (s->is[k] & QP_MEMBER) continue;
    s->is[k] |= QP_SEEN; /* looked at here, never again */
    double by = s->rows->lower[k] - qp_rows_dot(s->rows, k, s->aim), parts = 1;
    qp_active_project(&s->set, k, s->d);
    qp_active_solve(&s->set, s->d, s->y);
    for (size_t l = 0; l < s->set.q; l++) parts += fabs(s->y[l]);
    if (fabs(by) <=
        QP_LOOSE * parts * qp_search_error(s->n) * (qp_search_terms(s, k, s->aim) + fabs(s->rows->lower[k])))
      continue;
    double sign = by > 0 ? 1 : -1;
    memset(s->point->y, 0, s->m * sizeof *s->point->y);
    for (size_t l = 0; l < s->set.q; l++) s->point->y[s->set.member[l]] = -sign * s->y[l];
    s->point->y[k] = sign;
    return batten_fail(s->ctx, BATTEN_E_INFEASIBLE, "the equalities contradict each other");
  }
  return BATTEN_OK;
}

/* Rows of the working set to try come into sight and become members: all when x is to be the minimiser on them, else
 * those that are met at x. */
static batten_status take_members(qp_search *s, bool met) {
  size_t count = 0;
  size_t *k = (size_t *)s->breaks;
  signed char *side = (signed char *)(k + s->m);
  for (size_t i = 0; i < s->m && count < s->n; i++) {
    signed char given = s->point->active[i];
    double bound = given == QP_UPPER ? s->rows->upper[i] : s->rows->lower[i];
    if ((given != QP_LOWER && given != QP_UPPER) || !isfinite(bound) || qp_rows_is_equality(s->rows, i)) continue;
    qp_search_see(s, i);
    if (met) {
      double error = qp_search_error(s->n) * (qp_search_terms(s, i, s->most) + fabs(bound));
      if (fabs(qp_rows_dot(s->rows, i, s->x) - bound) > error) continue;
    }
    side[count] = given;
    k[count++] = i;
  }
  size_t before = s->set.q;
  batten_status st = qp_active_add_many(s->ctx, &s->set, count, k, side);
  for (size_t i = before; i < s->set.q && st == BATTEN_OK; i++) s->is[s->set.member[i]] |= QP_MEMBER;
  return st;
}

/* x and working set to start from. */
static batten_status start(qp_search *s) {
  batten_status st = take_equalities(s);
  if (st != BATTEN_OK) return st;
  size_t few = rows_in_sight_at_first(s->n, s->m);
  s->sighted = 0;
  bool given = s->point->have_x;
  memcpy(s->x, given ? s->point->x : s->aim, s->n * sizeof *s->x);
  if (given) qp_search_return(s);
  qp_search_remember(s);
  for (size_t k = 0; k < few; k++) qp_search_see(s, k);
  survey(s);
  st = take_members(s, s->have_safe);
  if (st != BATTEN_OK || s->have_safe) return st;

  bool tried = false;
  for (size_t k = 0; k < s->m && !tried; k++) tried = s->point->active[k] != QP_FREE;
  if (tried || !given) {
    qp_search_direction(s);
    memcpy(s->x, s->aim, s->n * sizeof *s->x);
    survey(s);
  }
  return BATTEN_OK;
}

/* ---- End ---- */

/* The working set factored afresh. */
static batten_status refactor(qp_search *s) {
  size_t q = s->set.q;
  size_t *member = (size_t *)s->breaks;
  signed char *side = (signed char *)(member + q);
  memcpy(member, s->set.member, q * sizeof *member);
  memcpy(side, s->set.side, q);
  for (size_t i = 0; i < q; i++) s->is[member[i]] &= (unsigned char)~QP_MEMBER;
  qp_active_reset(&s->set, s->objective->target);
  batten_status st = qp_active_add_many(s->ctx, &s->set, q, member, side);
  for (size_t i = 0; i < s->set.q; i++) s->is[s->set.member[i]] |= QP_MEMBER;
  s->point->factorizations++;
  return st;
}

/* d := J' of what is left of the gradient at the result, R'(Rx - c) - sum y_k a_k. */
static void leftover(qp_search *s) {
  size_t n = s->n;
  const double *r = s->objective->r, *x = s->have_safe ? s->safe : s->x;
  for (size_t i = 0; i < n; i++) s->work[i] = -s->objective->target[i];
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= j; i++) s->work[i] += r[i + j * n] * x[j];
  for (size_t j = 0; j < n; j++) {
    s->f[j] = 0;
    for (size_t i = 0; i <= j; i++) s->f[j] += r[i + j * n] * s->work[i];
  }
  for (size_t i = 0; i < s->set.q; i++) qp_rows_add(s->rows, s->set.member[i], -s->y[i], s->f);
  qp_active_project_vector(&s->set, s->f, s->d);
}

/* One step of iterative refinement: of x as far as rows allow, where it is worth a survey, then of the multipliers.
 */
static void refine(qp_search *s) {
  leftover(s);
  memset(s->p, 0, s->n * sizeof *s->p);
  qp_active_combine(&s->set, s->set.q, s->n, -1, s->d, s->p);
  double square = 0;
  for (size_t j = 0; j < s->n; j++) square += s->p[j] * s->p[j];
  if (s->have_safe && sqrt(square) > qp_search_error(s->n) * s->size) {
    for (size_t j = 0; j < s->n; j++) s->x[j] = s->safe[j] + s->p[j];
    survey(s);
    leftover(s);
  }
  qp_active_solve(&s->set, s->d, s->d);
  for (size_t i = 0; i < s->set.q; i++) s->y[i] += s->d[i];
}

static void write_result(qp_search *s, bool optimal) {
  if (optimal) refine(s);
  qp_point *point = s->point;
  point->have_x = s->have_safe;
  memcpy(point->x, s->have_safe ? s->safe : s->x, s->n * sizeof *point->x);
  memset(point->y, 0, s->m * sizeof *point->y);
  memset(point->active, QP_FREE, s->m);
  for (size_t i = 0; i < s->set.q; i++) {
    size_t k = s->set.member[i];
    bool wrong = s->set.side[i] != QP_EQUAL && (s->set.side[i] == QP_UPPER ? s->y[i] > 0 : s->y[i] < 0);
    point->active[k] = s->set.side[i];
    if (optimal && !wrong) point->y[k] = s->y[i];
  }
}

/* Back to the safe point, with the members that are met there. */
static void go_back(qp_search *s) {
  memcpy(s->x, s->safe, s->n * sizeof *s->x);
  qp_search_refresh(s);
  for (size_t i = s->set.q; i-- > 0;) {
    size_t k = s->set.member[i];
    double side = qp_active_bound(&s->set, i);
    double error = qp_search_error(s->n) * (qp_search_terms(s, k, s->most) + fabs(side));
    if (s->set.side[i] != QP_EQUAL && fabs(qp_rows_dot(s->rows, k, s->x) - side) > error) qp_search_drop(s, i);
  }
}

/* The last digits come from a working set that is factored afresh: x goes on from where it is, so that rows met there
 * stay satisfied. */
static batten_status solve(qp_search *s) {
  const size_t FRESH = 3; /* times at most */
  size_t fresh = 0;
  bool arrived = false; /* x is the minimiser on the rows in sight */
  batten_status st = start(s);
  while (st == BATTEN_OK) {
    size_t before = s->point->iterations;
    if (!s->have_safe) st = qp_phase1(s);
    if (st != BATTEN_OK) break;
    if (!s->have_safe && survey(s)) continue;
    if (!arrived) st = descend(s);
    if (st < 0) break;
    if (survey(s)) {
      arrived = s->have_safe && qp_search_meet(s, &st);
      if (s->have_safe && !arrived) go_back(s);
      continue;
    }
    bool settled = fresh > 0 && s->point->iterations - before <= s->n;
    if (st != BATTEN_OK || settled || fresh++ == FRESH) break;
    st = refactor(s);
    arrived = false;
  }
  return st;
}

/* ---- Memory ---- */

/* Doubles for n, of each row, and bytes of each row beside; qp_active has 3 n^2 + 4 n of its own. */
enum { VECTORS = 12, ROW_VECTORS = 5 };

static batten_status search_new(qp_search *s) {
  size_t n = s->n, m = s->m, rows = m > n ? m : n, area;
  if (!batten_mul3(rows, 2, sizeof(qp_break), &area))
    return batten_fail(s->ctx, BATTEN_E_TOO_LARGE, "%zu constraints", m);
  batten_status st = qp_active_new(s->ctx, s->objective, s->rows, &s->set);
  if (st < 0) return st;
  s->x = batten_alloc_array(s->ctx, n, VECTORS * sizeof *s->x);
  if (!s->x) return BATTEN_E_NOMEM;
  s->value = batten_alloc_array(s->ctx, m, ROW_VECTORS * sizeof *s->value);
  if (!s->value) return BATTEN_E_NOMEM;
  s->sight = batten_alloc_array(s->ctx, m, sizeof *s->sight);
  if (!s->sight) return BATTEN_E_NOMEM;
  s->is = batten_alloc(s->ctx, m);
  if (!s->is) return BATTEN_E_NOMEM;
  s->breaks = batten_alloc(s->ctx, area);
  if (!s->breaks) return BATTEN_E_NOMEM;
  double **vectors[] = {&s->p, &s->aim, &s->u, &s->y, &s->d, &s->work, &s->most, &s->ever, &s->f, &s->jf, &s->safe};
  for (size_t i = 0; i + 1 < VECTORS; i++) *vectors[i] = s->x + (i + 1) * n;
  double **of_rows[] = {&s->slope, &s->rounding, &s->safe_value, &s->new_value};
  for (size_t i = 0; i + 1 < ROW_VECTORS; i++) *of_rows[i] = s->value + (i + 1) * m;
  memset(s->is, 0, m);
  memset(s->x, 0, VECTORS * n * sizeof *s->x);
  return BATTEN_OK;
}

static void search_free(qp_search *s) {
  batten_free(s->ctx, s->breaks);
  batten_free(s->ctx, s->is);
  batten_free(s->ctx, s->sight);
  batten_free(s->ctx, s->value);
  batten_free(s->ctx, s->x);
  qp_active_free(s->ctx, &s->set);
}

batten_status qp_primal(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, const qp_limits *limits,
                        qp_point *point) {
  qp_search s = {
      .ctx = ctx, .objective = objective, .rows = rows, .limits = limits, .point = point, .n = rows->n, .m = rows->m};
  batten_status st = search_new(&s);
  if (st < 0) goto done;
  st = solve(&s);
  if (st != BATTEN_E_NOMEM && st != BATTEN_E_INFEASIBLE) {
    if (s.have_safe && st < 0) survey(&s);
    write_result(&s, st == BATTEN_OK || st == BATTEN_W_ACCURACY);
  }
done:
  search_free(&s);
  return st;
}

qp_cost qp_primal_cost(const qp_rows *rows) {
  size_t n = rows->n, m = rows->m, longest = m > n ? m : n, at_once = n, part, bytes = 0;
  double entries = (double)qp_rows_count(rows);
  for (size_t k = 0, equalities = 0; k < m; k++) {
    equalities += qp_rows_is_equality(rows, k);
    at_once = equalities > at_once ? equalities : at_once;
  }
  const size_t BLOCKS = 24 * 128;               /* headers */
  batten_mul3(n, n, 3 * sizeof(double), &part); /* R^-1, J, T */
  batten_add(BLOCKS, part, &bytes);
  batten_mul3(n + 1, at_once, 2 * sizeof(double),
              &part); /* qp_active_add_many(): normals, or J2'; their projections */
  batten_add(bytes, part, &bytes);
  batten_mul(n + 64, (64 + 4 + VECTORS + 5) * sizeof(double), &part); /* LAPACK's blocks of 64; vectors */
  batten_add(bytes, part, &bytes);
  batten_mul(m, ROW_VECTORS * sizeof(double) + sizeof(size_t) + 1, &part);
  batten_add(bytes, part, &bytes);
  batten_mul3(longest, 2, sizeof(qp_break), &part);
  batten_add(bytes, part, &bytes);

  /* Some pivots for each unknown, at 10 n^2 and a look at 8 n rows each; about 10 surveys of all rows. */
  double pivots = 4 * fmin((double)n, (double)m) + 8, square = (double)n * (double)n;
  return (qp_cost){bytes, (double)n * square + pivots * (10 + 16) * square + 10 * 2 * entries};
}
