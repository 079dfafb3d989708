/* Dual active set method [Goldfarb, Idnani 1983] on 1/2 |R x - c|^2, for few unknowns and very many rows.
 *
 * x is always the minimiser on the working set, with multipliers of the right sign; what is still missing is the
 * rows. A violated row is added by moving along J2 J2'a until it holds; members whose multipliers would turn their
 * sign on the way are dropped. The objective rises with every row added, so no working set comes back. Equalities are
 * eliminated first, by one QR with column pivoting; so is a working set to start from.
 *
 * Rounding: rows that depend on the members are told by relative tests (active.h); every full pass over the rows
 * starts from x and multipliers solved afresh from the factors, and the factors themselves are made anew after so
 * many updates that their errors could pass those of a fresh factorization. */
#include <float.h>
#include <string.h>

#include "active.h"
#include "base/checked.h"
#include "pricing.h"

typedef struct dual {
  batten_context *ctx;
  const qp_dense *objective;
  const qp_rows *rows;
  const qp_limits *limits;
  qp_point *point; /* point->active[k] is the working set of now */
  qp_active set;
  qp_pricing pricing;
  size_t equalities;    /* members that stay, in front */
  size_t updates;       /* of the factors since they were fresh */
  double length;        /* |Rx| at the last settling: x is known to eps of length times reach (active.h) */
  double noise;         /* that eps: grows where pivots do not end */
  bool moved;           /* some pivot since the last pass went further than that */
  double *x;            /* point->x */
  double *y;            /* [n] of the members: gradient = N y */
  double *d, *part, *b; /* [n] scratch: J'a, T^-1 d, sides */
} dual;

/* ---- Values from factors ---- */

/* x of the working set: T'u1 = b, u2 = Q2'c, x = J u, and one correction of x towards the members' sides. */
static void solve(dual *s) {
  const qp_active *set = &s->set;
  size_t n = set->n, q = set->q;
  double *u = s->d;
  for (size_t i = 0; i < q; i++) s->b[i] = qp_active_bound(set, i);
  qp_active_solve_transposed(set, s->b, u);
  memcpy(u + q, set->target + q, (n - q) * sizeof *u);
  s->length = 0;
  for (size_t i = 0; i < n; i++) s->length += u[i] * u[i];
  s->length = sqrt(s->length);
  memset(s->x, 0, n * sizeof *s->x);
  qp_active_combine(set, 0, n, 1, u, s->x);
  for (size_t i = 0; i < q; i++) s->y[i] = u[i] - set->target[i];
  qp_active_solve(set, s->y, s->y);

  for (size_t i = 0; i < q; i++) s->b[i] -= qp_rows_dot(s->rows, set->member[i], s->x);
  qp_active_solve_transposed(set, s->b, u);
  qp_active_combine(set, 0, q, 1, u, s->x);
}

/* A member's multiplier in the direction in which it must not be negative. */
static double oriented(const dual *s, size_t place, double y) { return s->set.side[place] == QP_UPPER ? -y : y; }

/* One step of iterative refinement of x and y: their residuals come from R, c and the rows, not from the factors, and
 * keep what is small in R and c apart from what is large. */
static void refine(dual *s) {
  const qp_active *set = &s->set;
  size_t n = set->n, q = set->q;
  const double *r = s->objective->r;
  double *miss = s->part, *left = s->b, *u = s->d;
  for (size_t i = 0; i < n; i++) miss[i] = -s->objective->target[i];
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= j; i++) miss[i] += r[i + j * n] * s->x[j];
  for (size_t j = 0; j < n; j++) {
    left[j] = 0;
    for (size_t i = 0; i <= j; i++) left[j] -= r[i + j * n] * miss[i];
  }
  for (size_t i = 0; i < q; i++) qp_rows_add(s->rows, set->member[i], s->y[i], left);
  qp_active_project_vector(set, left, u); /* J'(N y - gradient) */
  for (size_t i = 0; i < q; i++) left[i] = qp_active_bound(set, i) - qp_rows_dot(s->rows, set->member[i], s->x);
  qp_active_solve_transposed(set, left, left);
  for (size_t i = 0; i < q; i++) {
    miss[i] = left[i] - u[i];
    u[i] = left[i];
  }
  qp_active_combine(set, 0, n, 1, u, s->x);
  qp_active_solve(set, miss, miss);
  for (size_t i = 0; i < q; i++) {
    s->y[i] += miss[i];
    if (i >= s->equalities && oriented(s, i, s->y[i]) < 0) s->y[i] = 0;
  }
}

static void drop(dual *s, size_t place) {
  s->point->active[s->set.member[place]] = QP_FREE;
  qp_active_drop(&s->set, place);
  memmove(s->y + place, s->y + place + 1, (s->set.q - place) * sizeof *s->y);
  s->updates++;
  s->point->iterations++;
}

/* x and y afresh; inequalities whose multipliers have the wrong sign beyond rounding leave, the worst first. */
static void settle(dual *s) {
  size_t n = s->set.n;
  for (;;) {
    solve(s);
    size_t worst = SIZE_MAX;
    double most = 0, least = 0;
    for (size_t i = 0; i < s->set.q; i++) most = fmax(most, fabs(s->y[i]));
    for (size_t i = s->equalities; i < s->set.q; i++)
      if (oriented(s, i, s->y[i]) < least) {
        least = oriented(s, i, s->y[i]);
        worst = i;
      }
    if (-least <= (double)n * DBL_EPSILON * most) break;
    drop(s, worst);
  }
  for (size_t i = s->equalities; i < s->set.q; i++)
    if (oriented(s, i, s->y[i]) < 0) s->y[i] = 0;
}

/* ---- A working set at once ---- */

/* So many at once that LAPACK works on blocks, so few that memory stays near n^2. */
static batten_status add_in_blocks(dual *s, size_t count, const size_t *k, const signed char *side) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < count && st == BATTEN_OK; i += s->set.n)
    st = qp_active_add_many(s->ctx, &s->set, count - i < s->set.n ? count - i : s->set.n, k + i, side + i);
  return st;
}

/* Factors of point->active and all equalities, from R^-1 on, then x and y. Members that depend on others leave. */
static batten_status refactor(dual *s) {
  size_t m = s->rows->m, equal = 0, count = 0, other = 0;
  signed char *active = s->point->active;
  batten_status st = BATTEN_E_NOMEM;
  size_t *k = NULL;
  signed char *side = NULL;
  for (size_t i = 0; i < m; i++) {
    equal += qp_rows_is_equality(s->rows, i) ? 1 : 0;
    count += active[i] != QP_FREE && !qp_rows_is_equality(s->rows, i) ? 1 : 0;
  }
  count += equal;
  k = batten_alloc_array(s->ctx, count, sizeof *k);
  if (!k) goto done;
  side = batten_alloc_array(s->ctx, count, sizeof *side);
  if (!side) goto done;
  for (size_t i = 0, next = 0; i < m; i++) {
    bool equality = qp_rows_is_equality(s->rows, i);
    if (!equality && active[i] == QP_FREE) continue;
    size_t to = equality ? next++ : equal + other++;
    k[to] = i;
    side[to] = equality ? QP_EQUAL : active[i];
  }

  qp_active_reset(&s->set, s->objective->target);
  st = add_in_blocks(s, equal, k, side);
  if (st < 0) goto done;
  s->equalities = s->set.q;
  st = add_in_blocks(s, other, k + equal, side + equal);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) active[k[i]] = QP_FREE;
  for (size_t i = 0; i < s->set.q; i++) active[s->set.member[i]] = s->set.side[i];
  s->point->factorizations += count > 0;
  s->updates = 0;
  settle(s);
  st = BATTEN_OK;
done:
  batten_free(s->ctx, side);
  batten_free(s->ctx, k);
  return st;
}

/* ---- Rows that depend on the members ---- */

/* What rounding in the factors may leave in a_k'x. */
static double noise(const dual *s, size_t k) { return s->noise * qp_active_row_reach(&s->set, k) * s->length; }

/* By how much a dependent row may miss its side by rounding alone: a_k = N part, so its error is made up of theirs.
 */
static double dependent_tolerance(const dual *s, size_t k, const double *part) {
  double sum = qp_pricing_tolerance(&s->pricing, k, s->x);
  for (size_t i = 0; i < s->set.q; i++)
    sum += fabs(part[i]) * qp_pricing_tolerance(&s->pricing, s->set.member[i], s->x);
  return noise(s, k) + 2 * sum;
}

/* The proof that no x exists: sign * (a_k - N part) = 0, while the sides ask for more than 0. */
static batten_status infeasible(dual *s, size_t k, double sign, const double *part) {
  double *y = s->point->y;
  memset(y, 0, s->rows->m * sizeof *y);
  for (size_t i = 0; i < s->set.q; i++) y[s->set.member[i]] = -sign * part[i];
  y[k] = sign;
  return batten_fail(s->ctx, BATTEN_E_INFEASIBLE, "the constraints contradict each other");
}

/* Equalities that were left out must hold by themselves. */
static batten_status check_equalities(dual *s) {
  for (size_t k = 0; k < s->rows->m; k++) {
    if (!qp_rows_is_equality(s->rows, k) || s->point->active[k] != QP_FREE) continue;
    double missing = s->rows->lower[k] - qp_rows_dot(s->rows, k, s->x);
    qp_active_project(&s->set, k, s->d);
    qp_active_solve(&s->set, s->d, s->part);
    if (fabs(missing) > dependent_tolerance(s, k, s->part)) return infeasible(s, k, missing > 0 ? 1 : -1, s->part);
  }
  return BATTEN_OK;
}

/* ---- Pivots ---- */

/* The first member whose multiplier vanishes on the way y - t sign part, t > 0: its place and t; SIZE_MAX and
 * infinity. */
static size_t first_to_leave(const dual *s, double sign, double *t) {
  size_t leaves = SIZE_MAX;
  *t = INFINITY;
  for (size_t i = s->equalities; i < s->set.q; i++) {
    double falls = oriented(s, i, sign * s->part[i]), from = fmax(0, oriented(s, i, s->y[i]));
    if (falls > 0 && from < *t * falls) {
      *t = from / falls;
      leaves = i;
    }
  }
  return leaves;
}

/* Adds constraint k, violated at `side`, dropping members on the way. *given_up: it depends on the members and is
 * violated by rounding alone. */
static batten_status pivot(dual *s, size_t k, signed char side, bool *given_up) {
  qp_active *set = &s->set;
  double sign = side == QP_UPPER ? -1 : 1, bound = side == QP_UPPER ? s->rows->upper[k] : s->rows->lower[k];
  double multiplier = 0;
  *given_up = false;
  for (;;) {
    double missing = fmax(0, sign * (bound - qp_rows_dot(s->rows, k, s->x))), square = 0, full = INFINITY, t;
    qp_active_project(set, k, s->d);
    qp_active_solve(set, s->d, s->part);
    bool depends = qp_active_depends(set, k, s->d);
    if (depends && missing <= dependent_tolerance(s, k, s->part)) {
      *given_up = true;
      if (multiplier > 0) settle(s); /* the gradient held a part of a_k */
      return BATTEN_OK;
    }
    if (!depends) {
      for (size_t i = set->q; i < set->n; i++) square += s->d[i] * s->d[i];
      full = missing / square;
    }
    size_t leaves = first_to_leave(s, sign, &t);
    if (depends && leaves == SIZE_MAX) return infeasible(s, k, sign, s->part);
    if (full <= t) {
      t = full;
      leaves = SIZE_MAX;
    }
    if (!depends) qp_active_combine(set, set->q, set->n, sign * t, s->d, s->x);
    for (size_t i = 0; i < set->q; i++) s->y[i] -= t * sign * s->part[i];
    s->moved = s->moved || missing > noise(s, k);
    multiplier += t;
    if (leaves == SIZE_MAX) break;
    drop(s, leaves);
  }
  s->y[set->q] = sign * multiplier;
  qp_active_add(set, k, side, s->d);
  s->point->active[k] = side;
  s->updates++;
  s->point->iterations++;
  return BATTEN_OK;
}

/* Pivots on the candidates of a pass until none is violated, or `most` are done. *pivots: rows added. */
static batten_status pivot_candidates(dual *s, size_t most, size_t *pivots) {
  *pivots = 0;
  while (*pivots < most) {
    size_t place = qp_pricing_worst(&s->pricing, s->x);
    if (place == SIZE_MAX) break;
    size_t k = s->pricing.candidate[place];
    signed char side;
    bool given_up;
    qp_pricing_violation(&s->pricing, k, s->pricing.product[place], s->x, &side);
    batten_status st = pivot(s, k, side, &given_up);
    if (st < 0) return st;
    if (given_up) qp_pricing_skip(&s->pricing, place);
    *pivots += !given_up;
    double done = (double)s->point->iterations;
    st = qp_limits_check(s->ctx, s->limits, s->point->iterations, done / (done + (double)s->set.n));
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* ---- Passes ---- */

static bool all_finite(size_t n, const double *x) { return batten_first_nonfinite(n, x) == n; }

/* Several times the pivots that problems of the size take. */
static size_t many_pivots(const dual *s) {
  size_t n = s->set.n, m = s->rows->m;
  return 500 + 10 * (n + (m < n ? m : n));
}

/* Whether x misses its candidates by no more than what it is known to. */
static bool within_noise(const dual *s) {
  const qp_pricing *p = &s->pricing;
  signed char side;
  for (size_t i = 0; i < p->count; i++) {
    size_t k = p->candidate[i];
    if (qp_pricing_violation(p, k, qp_rows_dot(s->rows, k, s->x), s->x, &side) > noise(s, k)) return false;
  }
  return true;
}

static batten_status run_passes(dual *s) {
  const size_t STALLS = 8;                  /* passes in a row without a step beyond rounding */
  const double LOUDEST = 1e5 * DBL_EPSILON; /* above, rounding cannot be what goes in circles */
  size_t n = s->set.n, stalls = 0, accurate = 4 * n;
  size_t many = s->point->iterations + many_pivots(s);
  bool refined = false;
  for (;;) {
    if (!all_finite(n, s->x) || s->noise > LOUDEST) return BATTEN_W_ACCURACY;
    size_t pivots = 0;
    s->moved = false;
    /* Steps within the noise are made once, for they may help; then they are not looked for again. */
    if (stalls < 2 * STALLS && qp_pricing_pass(s->ctx, &s->pricing, s->x) && !(stalls > 0 && within_noise(s))) {
      batten_status st = pivot_candidates(s, 2 * n + 64, &pivots);
      if (st < 0) return st;
    }
    if (pivots == 0 && refined) return BATTEN_OK;
    refined = pivots == 0 && s->updates <= accurate;
    if (refined) {
      refine(s);
      continue;
    }
    stalls = s->moved ? 0 : stalls + 1;
    bool too_many = s->point->iterations > many;
    if (too_many) {
      s->noise *= 16;
      many += many_pivots(s);
    }
    if (pivots == 0 || too_many || s->updates > 4 * accurate || stalls == STALLS) {
      batten_status st = refactor(s);
      if (st < 0) return st;
    } else {
      settle(s);
    }
  }
}

static batten_status prepare(dual *s, double **memory) {
  size_t n = s->objective->n;
  batten_status st = qp_active_new(s->ctx, s->objective, s->rows, &s->set);
  if (st < 0) return st;
  st = qp_pricing_new(s->ctx, s->rows, s->point->active, s->set.inverse, &s->pricing);
  if (st < 0) return st;
  *memory = batten_alloc_array(s->ctx, n, 4 * sizeof **memory);
  if (!*memory) return BATTEN_E_NOMEM;
  s->y = *memory;
  s->d = s->y + n;
  s->part = s->d + n;
  s->b = s->part + n;
  return BATTEN_OK;
}

batten_status qp_dual(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, const qp_limits *limits,
                      qp_point *point) {
  dual s = {.ctx = ctx,
            .objective = objective,
            .rows = rows,
            .limits = limits,
            .point = point,
            .x = point->x,
            .noise = 4 * DBL_EPSILON};
  double *memory = NULL;
  point->have_x = false;
  batten_status st = prepare(&s, &memory);
  if (st < 0) goto done;
  st = qp_limits_check(ctx, limits, point->iterations, 0);
  if (st < 0) goto done;
  st = refactor(&s);
  if (st < 0) goto done;
  st = check_equalities(&s);
  if (st < 0) goto done;
  st = run_passes(&s);
  if (st < 0) goto done;

  point->have_x = st == BATTEN_OK;
  memset(point->y, 0, rows->m * sizeof *point->y);
  for (size_t i = 0; i < s.set.q; i++) point->y[s.set.member[i]] = s.y[i];
done:
  batten_free(ctx, memory);
  qp_pricing_free(ctx, &s.pricing);
  qp_active_free(ctx, &s.set);
  return st;
}

qp_cost qp_dual_cost(const qp_rows *rows) {
  /* R^-1, J, T, a block of rows and its projection; LAPACK's blocks of 64 columns and other vectors; the equalities'
   * list; headers of some 20 blocks. */
  size_t n = rows->n, square, vectors, list, bytes = qp_pricing_bytes(rows);
  batten_mul3(n, n + 1, 5 * sizeof(double), &square);
  batten_mul(n + 64, (64 + 24) * sizeof(double), &vectors);
  batten_mul(rows->m, sizeof(size_t) + 1, &list);
  batten_add(bytes, square, &bytes);
  batten_add(bytes, vectors, &bytes);
  batten_add(bytes, list, &bytes);
  batten_add(bytes, 20 * 128, &bytes);

  /* R^-1; passes over all entries; pivots, of which there are about n / 2 where rows are many, with their candidates.
   */
  const double PASSES = 6;
  double unknowns = (double)n, entries = (double)qp_rows_count(rows);
  double pivots = fmin(unknowns, (double)rows->m) / 2 + 8;
  return (qp_cost){bytes, unknowns * unknowns * unknowns + PASSES * 2 * entries + pivots * 10 * unknowns * unknowns};
}
