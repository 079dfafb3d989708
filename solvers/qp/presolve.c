/* From the caller's rows and bounds to the constraints that engines see. One pass over the entries:
 *
 *   a row without finite sides is left out, a row of zeros is checked, a row of one entry tightens a bound;
 *   every other row gets its length, and the component of its direction along a fixed random vector. Parallel and
 *   antiparallel rows have the same component up to sign, so they meet in the cells of a hash table and are compared
 *   there; the tighter sides go to the first of them.
 *
 * Then rows that the bounds imply are dropped, with a second pass where there are bounds at all. See presolve.h. */
#include "presolve.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

#include "base/checked.h"
#include "lanes.h"
#include "matrix_row.h"

static const size_t NONE = SIZE_MAX;

/* Everything below works on this: the result and what the passes share. */
typedef struct presolver {
  batten_context *ctx;
  const batten_qp_problem *problem;
  qp_presolve *out;
  size_t n, m, kept;                   /* unknowns; the caller's rows; constraints so far */
  double *random;                      /* [n] in (-1, 1) */
  double *work;                        /* [n] zeros between uses */
  double *x_lower, *x_upper;           /* [n] bounds as rows of one entry tighten them */
  size_t *x_lower_from, *x_upper_from; /* [n] */
  double *x_lower_factor, *x_upper_factor;
  size_t *heads, cells; /* [cells] first constraint of each cell of the hash table, NONE = empty */
  size_t *next;         /* [m] next constraint in the same cell */
  uint64_t *key;        /* [m] cell of constraint k before hashing */
  double slack;         /* how far the caller lets a row or bound be violated */
  double *certificate;
} presolver;

/* Sides that cross by less than this, relative to their size, are the same. Twice what certify.c puts down to
 * rounding, so that it accepts every proof that is given here. */
static double crossing(size_t n) { return 2 * (1000 + 8 * (double)n) * DBL_EPSILON; }

/* Unit rows that differ by less in every entry, relative to it, are parallel: entries, length and scale are each
 * rounded once or twice. Not relative to 1: an entry that is small may stand before an unknown that is large. */
static const double SAME_ROW = 16 * DBL_EPSILON;

/* ---- One row ---- */

typedef struct direction {
  size_t entries;   /* that are not zero: 0, 1, or 2 for more */
  size_t first;     /* where the first of them is */
  double scale;     /* 1 / length */
  double component; /* of the unit row along the random vector */
} direction;

static void count_entries(const qp_matrix_row *row, direction *d) {
  d->entries = 0;
  for (size_t e = 0; e < row->count && d->entries < 2; e++) {
    if (row->values[e] == 0) continue;
    if (d->entries++ == 0) d->first = e;
  }
}

/* Sums of a_j^2 and a_j r_j of a * unit. */
static void sums_of_row(const qp_matrix_row *row, const double *random, double unit, double *square, double *along) {
  double s = 0, t = 0;
  if (!row->columns && unit == 1) {
    qp_lanes_now()->squares(row->count, row->values, random, square, along);
    return;
  }
  for (size_t e = 0; e < row->count; e++) {
    double a = row->values[e] * unit;
    s += a * a;
    t += a * random[qp_row_column(row, e)];
  }
  *square = s, *along = t;
}

static direction direction_of(const qp_matrix_row *row, const double *random) {
  direction d = {0};
  count_entries(row, &d);
  if (d.entries < 2) return d;
  double square, along, unit = 1;
  sums_of_row(row, random, 1, &square, &along);
  if (!(square > 0x1p-900 && square < 0x1p900)) { /* squares leave the range: bring the largest entry to one first */
    double most = 0;
    for (size_t e = 0; e < row->count; e++) most = fmax(most, fabs(row->values[e]));
    unit = batten_unit(most);
    sums_of_row(row, random, unit, &square, &along);
  }
  double length = sqrt(square);
  d.component = along / length;
  d.scale = unit / length;
  if (!(d.scale < DBL_MAX)) d.scale = DBL_MAX;
  return d;
}

/* A side in the units of the unit row: what overflows on the far side is none, on the near side the largest number.
 */
static double scaled_lower(double side, double scale) {
  double scaled = side * scale;
  return scaled < DBL_MAX ? scaled : DBL_MAX;
}
static double scaled_upper(double side, double scale) {
  double scaled = side * scale;
  return scaled > -DBL_MAX ? scaled : -DBL_MAX;
}

static double lower_of(const batten_qp_problem *p, size_t i) { return p->lower ? p->lower[i] : -INFINITY; }
static double upper_of(const batten_qp_problem *p, size_t i) { return p->upper ? p->upper[i] : INFINITY; }

/* ---- Failures, with their proofs ---- */

static void prove(const presolver *s, size_t i, double y) {
  if (s->certificate && i != NONE) s->certificate[i] += y;
}

/* "row 3" or "the bounds of x[3]" */
static void name_of(const presolver *s, size_t i, char *text, size_t size) {
  if (i < s->m)
    snprintf(text, size, "row %zu of c", i);
  else
    snprintf(text, size, "the bounds of x[%zu]", i - s->m);
}

static batten_status conflict(const presolver *s, size_t lower, double lower_factor, size_t upper,
                              double upper_factor, double by) {
  char one[64], other[64];
  prove(s, lower, lower_factor);
  prove(s, upper, -upper_factor);
  name_of(s, lower, one, sizeof one);
  name_of(s, upper, other, sizeof other);
  return batten_fail(s->ctx, BATTEN_E_INFEASIBLE, "%s and %s: the sides cross by %.3g of the unit row; relax one",
                     one, other, by);
}

/* Sides that cross by rounding, or by less than the caller minds, are made equal, so that each gives way by as much
 * in the caller's units; beyond it, no x satisfies them. */
static batten_status meet(const presolver *s, double *lower, double *upper, size_t lower_from, double lower_factor,
                          size_t upper_from, double upper_factor) {
  if (*lower <= *upper) return BATTEN_OK;
  double by = *lower - *upper;
  double both = fmin(fabs(lower_factor) + fabs(upper_factor), DBL_MAX), minded = s->slack * both;
  if (by > crossing(s->n) * (fabs(*lower) + fabs(*upper)) && by > minded)
    return conflict(s, lower_from, lower_factor, upper_from, upper_factor, by);
  *lower = *upper = *upper + fabs(upper_factor) / both * by;
  return BATTEN_OK;
}

/* ---- Rows of the caller, one after the other ---- */

static batten_status zero_row(const presolver *s, size_t i) {
  double lower = lower_of(s->problem, i), upper = upper_of(s->problem, i);
  if (lower <= s->slack && upper >= -s->slack) return BATTEN_OK;
  prove(s, i, lower > 0 ? 1 : -1);
  return batten_fail(s->ctx, BATTEN_E_INFEASIBLE, "row %zu of c: zeros, but sides [%g, %g]; remove or relax it", i,
                     lower, upper);
}

/* a x_j within its sides: x_j within theirs. */
static void tighten(presolver *s, size_t i, size_t j, double a) {
  double lower = lower_of(s->problem, i), upper = upper_of(s->problem, i), factor = 1 / a;
  double low = a > 0 ? lower / a : upper / a, high = a > 0 ? upper / a : lower / a;
  low = fmin(low, DBL_MAX), high = fmax(high, -DBL_MAX);
  factor = fmax(fmin(factor, DBL_MAX), -DBL_MAX);
  if (low > s->x_lower[j]) s->x_lower[j] = low, s->x_lower_from[j] = i, s->x_lower_factor[j] = factor;
  if (high < s->x_upper[j]) s->x_upper[j] = high, s->x_upper_from[j] = i, s->x_upper_factor[j] = factor;
}

/* +1 parallel, -1 antiparallel, 0 neither. */
static int compare_rows(presolver *s, size_t k, size_t i, double scale) {
  qp_matrix_row one = qp_row_of(s->problem->c, s->out->row[k]), other = qp_row_of(s->problem->c, i);
  double most = 0, unit = s->out->scale[k];
  bool same = true;
  size_t at = 0;
  for (size_t e = 0; e < one.count; e++) {
    s->work[qp_row_column(&one, e)] = one.values[e] * unit;
    if (fabs(one.values[e]) > most) most = fabs(one.values[e]), at = qp_row_column(&one, e);
  }
  double at_most = s->work[at], there = 0;
  for (size_t e = 0; e < other.count; e++)
    if (qp_row_column(&other, e) == at) there = other.values[e];
  double sign = (at_most > 0) == (there > 0) ? 1 : -1;
  /* every entry of the other is met in work and taken away there; what is left belongs to the one alone */
  for (size_t e = 0; e < other.count; e++) {
    size_t j = qp_row_column(&other, e);
    double here = s->work[j], entry = sign * (other.values[e] * scale);
    same &= fabs(here - entry) <= SAME_ROW * fabs(entry);
    s->work[j] = 0;
  }
  for (size_t e = 0; e < one.count; e++) {
    size_t j = qp_row_column(&one, e);
    same &= s->work[j] == 0;
    s->work[j] = 0;
  }
  if (!same) return 0;
  return sign > 0 ? 1 : -1;
}

static size_t hash(const presolver *s, uint64_t key) {
  uint64_t z = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
  return (size_t)(z ^ (z >> 27)) & (s->cells - 1);
}

/* The constraint that row i is parallel to, or NONE. At most so many are compared, whatever the caller's rows. */
static size_t find_parallel(presolver *s, size_t i, const direction *d, uint64_t key, int *sign) {
  const size_t PATIENCE = 16;
  size_t tried = 0;
  for (size_t k = s->heads[hash(s, key)]; k != NONE && tried < PATIENCE; k = s->next[k]) {
    if (s->key[k] != key) continue;
    tried++;
    *sign = compare_rows(s, k, i, d->scale);
    if (*sign != 0) return k;
  }
  return NONE;
}

/* Row i is sign * constraint k: the tighter sides stay. */
static void merge(presolver *s, size_t k, size_t i, double scale, int sign) {
  qp_presolve *o = s->out;
  double lower = lower_of(s->problem, i), upper = upper_of(s->problem, i);
  double low = scaled_lower(sign > 0 ? lower : -upper, scale), high = scaled_upper(sign > 0 ? upper : -lower, scale);
  if (low > o->lower[k]) o->lower[k] = low, o->lower_from[k] = i, o->lower_factor[k] = sign * scale;
  if (high < o->upper[k]) o->upper[k] = high, o->upper_from[k] = i, o->upper_factor[k] = sign * scale;
}

static void append(presolver *s, size_t i, double scale, double lower, double upper, size_t lower_from,
                   double lower_factor, size_t upper_from, double upper_factor) {
  qp_presolve *o = s->out;
  size_t k = s->kept++;
  o->row[k] = i;
  o->scale[k] = scale;
  o->lower[k] = lower, o->upper[k] = upper;
  o->lower_from[k] = lower > -INFINITY ? lower_from : NONE;
  o->upper_from[k] = upper < INFINITY ? upper_from : NONE;
  o->lower_factor[k] = lower_factor, o->upper_factor[k] = upper_factor;
}

/* Cells of the component are 2^-30 wide; within 2^-40 of a border, far beyond the component's rounding, the next cell
 * is searched, too. */
static void place_row(presolver *s, size_t i, const direction *d) {
  double cell = fabs(d->component) * 0x1p30, whole = floor(cell), part = cell - whole;
  uint64_t key = (uint64_t)whole;
  int sign = 1;
  size_t k = find_parallel(s, i, d, key, &sign);
  if (k == NONE && part < 0x1p-10 && key > 0) k = find_parallel(s, i, d, key - 1, &sign);
  if (k == NONE && part > 1 - 0x1p-10) k = find_parallel(s, i, d, key + 1, &sign);
  if (k != NONE) {
    merge(s, k, i, d->scale, sign);
    return;
  }
  k = s->kept;
  append(s, i, d->scale, scaled_lower(lower_of(s->problem, i), d->scale),
         scaled_upper(upper_of(s->problem, i), d->scale), i, d->scale, i, d->scale);
  size_t at = hash(s, key);
  s->key[k] = key;
  s->next[k] = s->heads[at];
  s->heads[at] = k;
}

static batten_status place_rows(presolver *s) {
  const batten_matrix *c = s->problem->c;
  for (size_t i = 0; i < s->m; i++) {
    if (lower_of(s->problem, i) == -INFINITY && upper_of(s->problem, i) == INFINITY) continue;
    qp_matrix_row row = qp_row_of(c, i);
    direction d = direction_of(&row, s->random);
    if (d.entries == 0) {
      batten_status st = zero_row(s, i);
      if (st < 0) return st;
    } else if (d.entries == 1) {
      tighten(s, i, qp_row_column(&row, d.first), row.values[d.first]);
    } else {
      place_row(s, i, &d);
    }
  }
  return BATTEN_OK;
}

/* ---- What bounds imply ---- */

/* The least and the largest value of a row within the bounds, and the size of what was added. */
static void range_of(const presolver *s, const qp_matrix_row *row, double *least, double *most, double *size) {
  double low = 0, high = 0, all = 0;
  for (size_t e = 0; e < row->count && (low > -INFINITY || high < INFINITY); e++) {
    double a = row->values[e];
    if (a == 0) continue;
    size_t j = qp_row_column(row, e);
    double one = a * s->x_lower[j], other = a * s->x_upper[j];
    low += a > 0 ? one : other;
    high += a > 0 ? other : one;
    if (isfinite(one)) all += fabs(one);
    if (isfinite(other)) all += fabs(other);
  }
  *least = low, *most = high, *size = all;
}

/* What y = 1 or -1 times constraint k leaves over, the bounds take: the caller's, or rows of one entry. */
static void prove_by_bounds(const presolver *s, size_t k, double y) {
  qp_matrix_row row = qp_row_of(s->problem->c, s->out->row[k]);
  for (size_t e = 0; e < row.count; e++) {
    size_t j = qp_row_column(&row, e);
    double left = -y * (row.values[e] * s->out->scale[k]);
    if (left > 0) prove(s, s->x_lower_from[j], left * s->x_lower_factor[j]);
    if (left < 0) prove(s, s->x_upper_from[j], left * s->x_upper_factor[j]);
  }
}

/* By how much the unit row's range within the bounds grows when the caller minds 1 less of the row and of each bound.
 */
static double price(const presolver *s, size_t k, double y) {
  const qp_presolve *o = s->out;
  qp_matrix_row row = qp_row_of(s->problem->c, o->row[k]);
  double sum = fabs(y > 0 ? o->lower_factor[k] : o->upper_factor[k]);
  for (size_t e = 0; e < row.count; e++) {
    size_t j = qp_row_column(&row, e);
    double part = fabs(row.values[e] * o->scale[k]);
    if (part > 0) sum += part * fabs(y * row.values[e] < 0 ? s->x_lower_factor[j] : s->x_upper_factor[j]);
  }
  return sum;
}

/* Drops sides of constraint k that the bounds imply: both of an equality or none, so that it stays one. */
static batten_status judge_by_bounds(presolver *s, size_t k) {
  qp_presolve *o = s->out;
  qp_matrix_row row = qp_row_of(s->problem->c, o->row[k]);
  double least, most, size, scale = o->scale[k];
  range_of(s, &row, &least, &most, &size);
  double error = (double)(s->n + 2) * DBL_EPSILON * size;
  double low = (least - error) * scale, high = (most + error) * scale;
  double beyond = crossing(s->n) * (fabs(size) * scale);
  double over = o->lower[k] - high, under = low - o->upper[k];
  bool above = over > beyond + crossing(s->n) * fabs(o->lower[k]) && over > s->slack * price(s, k, 1);
  bool below = under > beyond + crossing(s->n) * fabs(o->upper[k]) && under > s->slack * price(s, k, -1);
  if (above || below) {
    size_t from = above ? o->lower_from[k] : o->upper_from[k];
    prove(s, from, above ? o->lower_factor[k] : -o->upper_factor[k]);
    prove_by_bounds(s, k, above ? 1 : -1);
    return batten_fail(s->ctx, BATTEN_E_INFEASIBLE,
                       "row %zu of c: within the bounds of x it is in [%g, %g], which its sides exclude; relax one",
                       from, least, most);
  }
  /* what is missing by less is not missed */
  o->lower[k] = fmin(o->lower[k], high);
  o->upper[k] = fmax(o->upper[k], low);
  bool low_implied = low >= o->lower[k], high_implied = high <= o->upper[k];
  if (o->lower[k] == o->upper[k] && !(low_implied && high_implied)) return BATTEN_OK;
  if (low_implied) o->lower[k] = -INFINITY, o->lower_from[k] = NONE;
  if (high_implied) o->upper[k] = INFINITY, o->upper_from[k] = NONE;
  return BATTEN_OK;
}

static batten_status drop_implied(presolver *s) {
  qp_presolve *o = s->out;
  bool bounded = false;
  for (size_t j = 0; j < s->n && !bounded; j++) bounded = s->x_lower[j] > -INFINITY || s->x_upper[j] < INFINITY;
  size_t left = 0;
  for (size_t k = 0; k < s->kept; k++) {
    batten_status st = meet(s, &o->lower[k], &o->upper[k], o->lower_from[k], o->lower_factor[k], o->upper_from[k],
                            o->upper_factor[k]);
    if (st >= 0 && bounded) st = judge_by_bounds(s, k);
    if (st < 0) return st;
    if (o->lower[k] == -INFINITY && o->upper[k] == INFINITY) continue;
    size_t to = left++;
    if (to == k) continue;
    o->row[to] = o->row[k], o->scale[to] = o->scale[k];
    o->lower[to] = o->lower[k], o->upper[to] = o->upper[k];
    o->lower_from[to] = o->lower_from[k], o->upper_from[to] = o->upper_from[k];
    o->lower_factor[to] = o->lower_factor[k], o->upper_factor[to] = o->upper_factor[k];
  }
  s->kept = left;
  return BATTEN_OK;
}

static batten_status meet_bounds(presolver *s) {
  for (size_t j = 0; j < s->n; j++) {
    batten_status st = meet(s, &s->x_lower[j], &s->x_upper[j], s->x_lower_from[j], s->x_lower_factor[j],
                            s->x_upper_from[j], s->x_upper_factor[j]);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

static void append_bounds(presolver *s) {
  for (size_t j = 0; j < s->n; j++) {
    if (s->x_lower[j] == -INFINITY && s->x_upper[j] == INFINITY) continue;
    append(s, s->m + j, 1, s->x_lower[j], s->x_upper[j], s->x_lower_from[j], s->x_lower_factor[j], s->x_upper_from[j],
           s->x_upper_factor[j]);
  }
}

/* ---- Memory ---- */

static batten_status take_result(presolver *s) {
  qp_presolve *o = s->out;
  size_t most;
  if (!batten_add(s->m, s->n, &most)) return batten_fail(s->ctx, BATTEN_E_TOO_LARGE, "c: %zu rows", s->m);
  o->row = batten_alloc_array(s->ctx, most, sizeof *o->row);
  if (!o->row) return BATTEN_E_NOMEM;
  o->identity = batten_alloc_array(s->ctx, s->n, sizeof *o->identity);
  if (!o->identity) return BATTEN_E_NOMEM;
  o->scale = batten_alloc_array(s->ctx, most, 5 * sizeof *o->scale);
  if (!o->scale) return BATTEN_E_NOMEM;
  o->lower_from = batten_alloc_array(s->ctx, most, 2 * sizeof *o->lower_from);
  if (!o->lower_from) return BATTEN_E_NOMEM;
  o->lower = o->scale + most, o->upper = o->scale + 2 * most;
  o->lower_factor = o->scale + 3 * most, o->upper_factor = o->scale + 4 * most;
  o->upper_from = o->lower_from + most;
  for (size_t j = 0; j < s->n; j++) o->identity[j] = (uint32_t)j;
  return BATTEN_OK;
}

/* splitmix64 of j, in (-1, 1). */
static double random_of(size_t j) {
  uint64_t z = ((uint64_t)j + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-52 - 1;
}

static batten_status take_scratch(presolver *s) {
  const batten_qp_problem *p = s->problem;
  size_t n = s->n;
  for (s->cells = 64; s->cells < s->m && s->cells <= SIZE_MAX / 4;) s->cells *= 2;
  s->random = batten_alloc_array(s->ctx, n, 6 * sizeof *s->random);
  if (!s->random) return BATTEN_E_NOMEM;
  s->x_lower_from = batten_alloc_array(s->ctx, n, 2 * sizeof *s->x_lower_from);
  if (!s->x_lower_from) return BATTEN_E_NOMEM;
  s->heads = batten_alloc_array(s->ctx, s->cells, sizeof *s->heads);
  if (!s->heads) return BATTEN_E_NOMEM;
  s->next = batten_alloc_array(s->ctx, s->m, sizeof *s->next);
  if (!s->next) return BATTEN_E_NOMEM;
  s->key = batten_alloc_array(s->ctx, s->m, sizeof *s->key);
  if (!s->key) return BATTEN_E_NOMEM;
  s->work = s->random + n, s->x_lower = s->random + 2 * n, s->x_upper = s->random + 3 * n;
  s->x_lower_factor = s->random + 4 * n, s->x_upper_factor = s->random + 5 * n;
  s->x_upper_from = s->x_lower_from + n;
  for (size_t q = 0; q < s->cells; q++) s->heads[q] = NONE;
  for (size_t j = 0; j < n; j++) {
    s->random[j] = random_of(j);
    s->work[j] = 0;
    s->x_lower[j] = p->x_lower ? p->x_lower[j] : -INFINITY;
    s->x_upper[j] = p->x_upper ? p->x_upper[j] : INFINITY;
    s->x_lower_from[j] = s->x_upper_from[j] = s->m + j;
    s->x_lower_factor[j] = s->x_upper_factor[j] = 1;
  }
  return BATTEN_OK;
}

batten_status qp_presolve_new(batten_context *ctx, const batten_qp_problem *problem, double slack, qp_presolve *out,
                              double *certificate) {
  presolver s = {.ctx = ctx, .problem = problem, .out = out, .n = problem->n};
  s.slack = slack;
  s.certificate = certificate;
  s.m = problem->c ? problem->c->rows : 0;
  *out = (qp_presolve){.problem = problem};
  for (size_t i = 0; certificate && i < s.m + s.n; i++) certificate[i] = 0;
  batten_status st = take_result(&s);
  if (st < 0) goto done;
  st = take_scratch(&s);
  if (st < 0) goto done;
  st = place_rows(&s);
  if (st < 0) goto done;
  st = meet_bounds(&s);
  if (st < 0) goto done;
  st = drop_implied(&s);
  if (st < 0) goto done;
  append_bounds(&s);
  out->rows = (qp_rows){.n = s.n,
                        .m = s.kept,
                        .c = problem->c,
                        .row = out->row,
                        .identity = out->identity,
                        .scale = out->scale,
                        .lower = out->lower,
                        .upper = out->upper};
done:
  batten_free(ctx, s.key);
  batten_free(ctx, s.next);
  batten_free(ctx, s.heads);
  batten_free(ctx, s.x_lower_from);
  batten_free(ctx, s.random);
  return st;
}

void qp_presolve_free(batten_context *ctx, qp_presolve *p) {
  batten_free(ctx, p->row);
  batten_free(ctx, p->identity);
  batten_free(ctx, p->scale);
  batten_free(ctx, p->lower_from);
  *p = (qp_presolve){0};
}

/* ---- There and back ---- */

static bool caller_equality(const batten_qp_problem *p, size_t i) {
  size_t m = p->c ? p->c->rows : 0;
  if (i < m) return p->lower && p->upper && p->lower[i] == p->upper[i];
  return p->x_lower && p->x_upper && p->x_lower[i - m] == p->x_upper[i - m];
}

/* How the caller sees constraint `from` when the core holds it at its lower (upper) side. */
static signed char caller_side(const qp_presolve *p, size_t from, double factor, bool at_lower) {
  if (caller_equality(p->problem, from)) return QP_EQUAL;
  return (factor > 0) == at_lower ? QP_LOWER : QP_UPPER;
}

void qp_presolve_back(const qp_presolve *p, const double *y, const signed char *active, double *caller_y,
                      signed char *caller_active) {
  size_t all = (p->problem->c ? p->problem->c->rows : 0) + p->problem->n;
  if (y && caller_y) {
    for (size_t i = 0; i < all; i++) caller_y[i] = 0;
    for (size_t k = 0; k < p->rows.m; k++) {
      size_t from = y[k] > 0 ? p->lower_from[k] : p->upper_from[k];
      if (y[k] != 0 && from != NONE) caller_y[from] = y[k] * (y[k] > 0 ? p->lower_factor[k] : p->upper_factor[k]);
    }
  }
  if (!active || !caller_active) return;
  memset(caller_active, QP_FREE, all);
  for (size_t k = 0; k < p->rows.m; k++) {
    bool at_lower = active[k] == QP_LOWER || (active[k] == QP_EQUAL && !(y && y[k] < 0));
    size_t from = at_lower ? p->lower_from[k] : p->upper_from[k];
    if (active[k] == QP_FREE || from == NONE) continue;
    caller_active[from] = caller_side(p, from, at_lower ? p->lower_factor[k] : p->upper_factor[k], at_lower);
  }
}

void qp_presolve_forward(const qp_presolve *p, const signed char *caller_active, signed char *active) {
  for (size_t k = 0; k < p->rows.m; k++) {
    size_t low = p->lower_from[k], high = p->upper_from[k];
    bool at_lower = low != NONE && caller_active[low] == caller_side(p, low, p->lower_factor[k], true);
    bool at_upper = high != NONE && caller_active[high] == caller_side(p, high, p->upper_factor[k], false);
    if (p->lower[k] == p->upper[k])
      active[k] = at_lower || at_upper ? QP_EQUAL : QP_FREE;
    else
      active[k] = at_lower ? QP_LOWER : at_upper ? QP_UPPER : QP_FREE;
  }
}
