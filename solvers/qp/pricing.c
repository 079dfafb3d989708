/* Pricing in passes and candidates, see pricing.h. The rows are cut into chunks, each of which offers its most
 * violated row, so that the candidates come from everywhere: the most violated rows of all are often one row many
 * times over. */
#include "pricing.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"

enum { CANDIDATES = 128 };

/* A pass is over when the farthest candidate is below this share of the first one's distance: rows that are no
 * candidates are then likely to be farther. The dearer a pass is beside a pivot (m / n), the longer its candidates
 * are used: to the end for very many rows. */
static double last_share(const qp_rows *rows) { return fmin(0.25, 5 * (double)rows->n / (double)rows->m); }

/* Two times the worst error of a product of four terms or less, far below that of long rows, where errors seldom add
 * up. */
static const double FEASIBILITY = 8 * DBL_EPSILON;

/* ---- Life ---- */

/* As many chunks as candidates where there are rows enough, and more where a chunk would be more than 8192 entries:
 * BLAS is left to do each product on the thread that calls it. */
static size_t chunk_rows(const qp_rows *rows) {
  size_t most = 8192 / (rows->n > 0 ? rows->n : 1), chunk = rows->m / CANDIDATES;
  if (chunk > most) chunk = most;
  return chunk < 4 ? 4 : chunk;
}

static size_t candidates_most(const qp_rows *rows) { return rows->m < CANDIDATES ? rows->m : CANDIDATES; }

/* Numbers that pricing keeps; false when they are too many to count. */
static bool count_doubles(const qp_rows *rows, size_t chunks, size_t *doubles) {
  size_t most = candidates_most(rows), copies;
  bool fits = batten_mul3(2, most, rows->n, &copies);
  fits = batten_add(copies, rows->n + chunks + 2 * most, doubles) && fits;
  return batten_add(*doubles, rows->m, doubles) && fits;
}

batten_status qp_pricing_new(batten_context *ctx, const qp_rows *rows, const signed char *active,
                             const double *inverse, qp_pricing *p) {
  size_t n = rows->n, m = rows->m, most = candidates_most(rows), doubles;
  *p = (qp_pricing){.rows = rows, .active = active, .inverse = inverse, .feasibility = FEASIBILITY, .path = INFINITY};
  p->chunk = chunk_rows(rows);
  p->chunks = m / p->chunk + (m % p->chunk != 0);
  if (!count_doubles(rows, p->chunks, &doubles))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu constraints of %zu unknowns", m, n);
  p->last = batten_alloc_array(ctx, doubles, sizeof *p->last);
  if (!p->last) return BATTEN_E_NOMEM;
  p->offer = batten_alloc_array(ctx, p->chunks + most, sizeof *p->offer);
  if (!p->offer) return BATTEN_E_NOMEM;
  p->skip = batten_alloc_array(ctx, most, sizeof *p->skip);
  if (!p->skip) return BATTEN_E_NOMEM;
  p->safe_till = p->last + n;
  p->offer_by = p->safe_till + m;
  p->product = p->offer_by + p->chunks;
  p->weight = p->product + most;
  p->copy = p->weight + most;
  p->work = p->copy + most * n;
  p->candidate = p->offer + p->chunks;
  memset(p->last, 0, n * sizeof *p->last);
  for (size_t k = 0; k < m; k++) p->safe_till[k] = qp_rows_is_equality(rows, k) ? INFINITY : -1;
  return BATTEN_OK;
}

void qp_pricing_free(batten_context *ctx, qp_pricing *p) {
  batten_free(ctx, p->skip);
  batten_free(ctx, p->offer);
  batten_free(ctx, p->last);
  *p = (qp_pricing){0};
}

size_t qp_pricing_bytes(const qp_rows *rows) {
  size_t chunks = rows->m / chunk_rows(rows) + 1, all;
  count_doubles(rows, chunks, &all);
  batten_add(all, chunks + 2 * candidates_most(rows), &all);
  batten_mul(all, sizeof(double), &all);
  return all;
}

/* ---- One row ---- */

double qp_pricing_tolerance(const qp_pricing *p, size_t k, const double *x) {
  const double *values, *lower = p->rows->lower, *upper = p->rows->upper;
  const uint32_t *columns;
  size_t count = qp_rows_entries(p->rows, k, &values, &columns);
  double sum = 0;
  for (size_t e = 0; e < count; e++) sum += fabs(values[e] * x[columns ? columns[e] : e]);
  sum *= p->rows->scale[k];
  double side = fmax(isfinite(lower[k]) ? fabs(lower[k]) : 0, isfinite(upper[k]) ? fabs(upper[k]) : 0);
  return p->feasibility * (sum + side);
}

static double slack_at(const qp_rows *rows, size_t k, double product) {
  return fmin(product - rows->lower[k], rows->upper[k] - product);
}

double qp_pricing_violation(const qp_pricing *p, size_t k, double product, const double *x, signed char *side) {
  double missing = -slack_at(p->rows, k, product);
  if (!(missing > 0) || missing <= qp_pricing_tolerance(p, k, x)) return 0;
  *side = product < p->rows->lower[k] ? QP_LOWER : QP_UPPER;
  return missing;
}

/* ---- Full pass ---- */

typedef struct pass {
  qp_pricing *p;
  const double *x;
} pass;

static void price_chunk(void *arg, size_t index) {
  const pass *job = arg;
  qp_pricing *p = job->p;
  const qp_rows *rows = p->rows;
  size_t first = index * p->chunk, left = rows->m - first, count = left < p->chunk ? left : p->chunk, due = 0;
  double *till = p->safe_till + first;
  p->offer[index] = SIZE_MAX;
  p->offer_by[index] = 0;
  for (size_t i = 0; i < count; i++) due += till[i] > p->path ? 0 : 1;
  if (due == 0) return;

  /* A product in a run of rows costs a third of one by itself. */
  bool all = due > count / 3;
  if (all) qp_rows_times(rows, first, count, job->x, till);
  for (size_t i = 0; i < count; i++) {
    size_t k = first + i;
    if (qp_rows_is_equality(rows, k)) till[i] = INFINITY;
    if (till[i] == INFINITY || (!all && till[i] > p->path)) continue;
    double product = all ? till[i] : qp_rows_dot(rows, k, job->x);
    signed char side;
    double slack = slack_at(rows, k, product);
    till[i] = slack + p->path * (1 - 4 * DBL_EPSILON);
    if (!(-slack > p->offer_by[index]) || p->active[k] != QP_FREE) continue;
    double violation = qp_pricing_violation(p, k, product, job->x, &side);
    if (violation <= p->offer_by[index]) continue;
    p->offer[index] = k;
    p->offer_by[index] = violation;
  }
}

/* Moves the `most` offers with the largest violations to the front, in no order: quickselect. */
static void select_largest(size_t *rows, double *by, size_t count, size_t most) {
  size_t low = 0, high = count;
  while (high - low > 1 && most > low && most < high) {
    double pivot = by[low + (high - low - 1) / 2]; /* not the last: so both parts are not empty */
    size_t i = low, j = high - 1;
    for (;;) {
      while (by[i] > pivot) i++;
      while (by[j] < pivot) j--;
      if (i >= j) break;
      size_t row = rows[i];
      double value = by[i];
      rows[i] = rows[j], by[i++] = by[j];
      rows[j] = row, by[j--] = value;
    }
    size_t split = j + 1; /* low .. j are >= pivot, from split on <= pivot */
    if (most < split)
      high = split;
    else
      low = split;
  }
}

static void gather(qp_pricing *p) {
  const qp_rows *rows = p->rows;
  size_t n = rows->n, most = candidates_most(rows), count = 0;
  for (size_t i = 0; i < p->chunks; i++) {
    if (p->offer[i] == SIZE_MAX) continue;
    p->offer[count] = p->offer[i];
    p->offer_by[count++] = p->offer_by[i];
  }
  if (count > most) {
    select_largest(p->offer, p->offer_by, count, most);
    count = most;
  }
  p->count = count;
  p->first = 0;
  memset(p->copy, 0, count * n * sizeof *p->copy);
  for (size_t i = 0; i < count; i++) {
    p->candidate[i] = p->offer[i];
    p->skip[i] = false;
    qp_rows_add(rows, p->candidate[i], 1, p->copy + i * n);
  }
  batten_la_gemm(BATTEN_LA_DOUBLE, 'T', 'N', n, count, n, 1, p->inverse, n, p->copy, n, 0, p->work, n);
  for (size_t i = 0; i < count; i++) {
    double square = 0;
    for (size_t j = 0; j < n; j++) square += p->work[i * n + j] * p->work[i * n + j];
    p->weight[i] = 1 / sqrt(square);
  }
}

bool qp_pricing_pass(batten_context *ctx, qp_pricing *p, const double *x) {
  size_t n = p->rows->n;
  double move = 0, size = 0;
  for (size_t j = 0; j < n; j++) {
    move += (x[j] - p->last[j]) * (x[j] - p->last[j]);
    size += x[j] * x[j];
  }
  memcpy(p->last, x, n * sizeof *x);
  p->path += sqrt(move) * (1 + 1e-9); /* far above the rounding of lengths, those of rows among them */
  if (!(p->path * p->path <=
        size)) { /* first pass, or slacks could drown in the rounding of safe_till: all rows anew */
    p->path = 0;
    for (size_t k = 0; k < p->rows->m; k++)
      if (p->safe_till[k] != INFINITY) p->safe_till[k] = -1;
  }

  const double WORTH_THREADS = 1 << 19; /* entries: some 50 us */
  pass job = {p, x};
  if (batten_threads(ctx) > 1 && (double)p->rows->m * (double)n > WORTH_THREADS)
    batten_parallel(ctx, p->chunks, price_chunk, &job);
  else
    for (size_t i = 0; i < p->chunks; i++) price_chunk(&job, i);
  gather(p);
  return p->count > 0;
}

size_t qp_pricing_worst(qp_pricing *p, const double *x) {
  const qp_rows *rows = p->rows;
  size_t worst = SIZE_MAX;
  double most = 0;
  signed char side;
  batten_la_gemv(BATTEN_LA_DOUBLE, 'T', rows->n, p->count, 1, p->copy, rows->n, x, 0, p->product);
  for (size_t i = 0; i < p->count; i++) {
    size_t k = p->candidate[i];
    if (-slack_at(rows, k, p->product[i]) * p->weight[i] <= most || p->skip[i] || p->active[k] != QP_FREE) continue;
    double violation = qp_pricing_violation(p, k, p->product[i], x, &side) * p->weight[i];
    if (violation > most) {
      most = violation;
      worst = i;
    }
  }
  if (most < last_share(rows) * p->first) return SIZE_MAX;
  p->first = fmax(p->first, most);
  return worst;
}
