/* Pricing in passes and candidates, see pricing.h. The rows are cut into chunks, each of which offers its most
 * violated row, so that the candidates come from everywhere: the most violated rows of all are often one row many
 * times over. */
#include "pricing.h"

#include <float.h>
#include <string.h>

#include "base/checked.h"
#include "lanes.h"

enum { CANDIDATES = 32 };

/* A pass is over when the farthest candidate is below this share of the first one's distance: rows that are no
 * candidates are then likely to be farther. The dearer a pass is beside a pivot (m / n), the longer its candidates
 * are used: to the end for very many rows. */
static double last_share(const qp_rows *rows) { return fmin(0.1, 5 * (double)rows->n / (double)rows->m); }

/* Two times the worst error of a product of four terms or less, far below that of long rows, where errors seldom add
 * up. */
static const double FEASIBILITY = 8 * DBL_EPSILON;

/* ---- Life ---- */

/* Rows whose products are one call and one task. */
static size_t block_rows(const qp_rows *rows) { return 8192 / (rows->n > 0 ? rows->n : 1); }

/* Their weights cost as much as many pivots: fewer where there are few rows. */
static size_t candidates_most(const qp_rows *rows) {
  size_t part = rows->m / 8;
  if (part < 16) part = rows->m < 16 ? rows->m : 16;
  return part < CANDIDATES ? part : CANDIDATES;
}

/* As many chunks as candidates where there are rows enough, and more where a chunk would be larger than a block. */
static size_t chunk_rows(const qp_rows *rows) {
  size_t most = block_rows(rows), offers = candidates_most(rows), chunk = offers > 0 ? rows->m / offers : 0;
  if (chunk > most) chunk = most;
  return chunk < 4 ? 4 : chunk;
}

/* Numbers that pricing keeps; false when they are too many to count. */
static bool count_doubles(const qp_rows *rows, size_t chunks, size_t *doubles) {
  size_t most = candidates_most(rows), copies;
  bool fits = batten_mul(most, rows->n, &copies);
  fits = batten_add(copies, rows->n + chunks + 2 * most, doubles) && fits;
  fits = batten_add(*doubles, rows->m, doubles) && fits;
  return batten_add(*doubles, rows->m, doubles) && fits;
}

batten_status qp_pricing_new(batten_context *ctx, const qp_rows *rows, const signed char *active,
                             const double *inverse, qp_pricing *p) {
  size_t n = rows->n, m = rows->m, most = candidates_most(rows), doubles;
  *p = (qp_pricing){.rows = rows, .active = active, .inverse = inverse, .feasibility = FEASIBILITY, .path = INFINITY};
  p->chunk = chunk_rows(rows);
  p->chunks = m / p->chunk + (m % p->chunk != 0);
  p->per_block = block_rows(rows) / p->chunk;
  if (p->per_block == 0) p->per_block = 1;
  if (!count_doubles(rows, p->chunks, &doubles))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu constraints of %zu unknowns", m, n);
  p->last = batten_alloc_array(ctx, doubles, sizeof *p->last);
  if (!p->last) return BATTEN_E_NOMEM;
  p->offer = batten_alloc_array(ctx, p->chunks + 2 * most, sizeof *p->offer);
  if (!p->offer) return BATTEN_E_NOMEM;
  p->values = batten_alloc_array(ctx, most, sizeof *p->values + sizeof *p->skip);
  if (!p->values) return BATTEN_E_NOMEM;
  p->skip = (bool *)(p->values + most);
  p->safe_till = p->last + n;
  p->known = p->safe_till + m;
  p->offer_by = p->known + m;
  p->product = p->offer_by + p->chunks;
  p->weight = p->product + most;
  p->copy = p->weight + most;
  p->candidate = p->offer + p->chunks;
  p->fresh = p->candidate + most;
  memset(p->last, 0, n * sizeof *p->last);
  memset(p->known, 0, m * sizeof *p->known);
  for (size_t k = 0; k < m; k++) p->safe_till[k] = qp_rows_is_equality(rows, k) ? INFINITY : -1;
  return BATTEN_OK;
}

void qp_pricing_free(batten_context *ctx, qp_pricing *p) {
  batten_free(ctx, p->values);
  batten_free(ctx, p->offer);
  batten_free(ctx, p->last);
  *p = (qp_pricing){0};
}

size_t qp_pricing_bytes(const qp_rows *rows) {
  size_t chunks = rows->m / chunk_rows(rows) + 1, all;
  count_doubles(rows, chunks, &all);
  batten_add(all, chunks + 5 * candidates_most(rows), &all);
  batten_mul(all, sizeof(double), &all);
  return all;
}

/* ---- One row ---- */

static double length(size_t n, const double *x) {
  double square = 0;
  for (size_t j = 0; j < n; j++) square += x[j] * x[j];
  return sqrt(square);
}

double qp_pricing_tolerance(const qp_pricing *p, size_t k, const double *x) {
  const double *values;
  const uint32_t *columns;
  size_t count = qp_rows_entries(p->rows, k, &values, &columns);
  double sum = 0;
  for (size_t e = 0; e < count; e++) sum += fabs(values[e] * x[columns ? columns[e] : e]);
  return p->feasibility * p->rows->scale[k] * sum;
}

static double slack_at(const qp_rows *rows, size_t k, double product) {
  double above = product - rows->lower[k], below = rows->upper[k] - product;
  return above < below ? above : below;
}

double qp_pricing_violation(const qp_pricing *p, size_t k, double product, const double *x, signed char *side) {
  double missing = -slack_at(p->rows, k, product);
  if (!(missing > 0)) return 0;
  /* |a_k| = 1: most violations are far above what the tolerance can be. */
  if (missing <= 2 * p->feasibility * p->length && missing <= qp_pricing_tolerance(p, k, x)) return 0;
  *side = product < p->rows->lower[k] ? QP_LOWER : QP_UPPER;
  return missing;
}

/* ---- Full pass ---- */

typedef struct pass {
  qp_pricing *p;
  const double *x;
} pass;

/* Rows first .. first + count - 1 of one chunk make its offer. known: their slacks are in till, INFINITY for those
 * that are not priced. */
static void price_chunk(const pass *job, size_t chunk, size_t first, size_t count, bool known) {
  qp_pricing *p = job->p;
  const qp_rows *rows = p->rows;
  double keep = p->path * (1 - 4 * DBL_EPSILON), most = 0, *till = p->safe_till;
  size_t offer = SIZE_MAX;
  for (size_t k = first; k < first + count; k++) {
    if (!known && !(till[k] <= p->path)) continue;
    double slack = known ? till[k] : slack_at(rows, k, qp_rows_dot(rows, k, job->x));
    signed char side;
    till[k] = slack + keep;
    if (!(-slack > most) || p->active[k] != QP_FREE) continue;
    double violation = qp_pricing_violation(p, k, qp_rows_dot(rows, k, job->x), job->x, &side);
    if (violation <= most) continue;
    offer = k;
    most = violation;
  }
  p->offer[chunk] = offer;
  p->offer_by[chunk] = most;
}

static void price_block(void *arg, size_t index) {
  const pass *job = arg;
  qp_pricing *p = job->p;
  const qp_rows *rows = p->rows;
  size_t block = p->chunk * p->per_block, first = index * block, left = rows->m - first;
  size_t count = left < block ? left : block, due = 0;
  double *till = p->safe_till + first;
  for (size_t i = 0; i < count; i++) due += till[i] > p->path ? 0 : 1;
  /* A product in a run of rows costs a third of one by itself. */
  bool all = due > count / 3;
  if (all) {
    qp_rows_times(rows, first, count, job->x, till);
    qp_lanes_now()->slacks(count, rows->lower + first, rows->upper + first, till);
  }
  for (size_t chunk = index * p->per_block, done = 0; done < count; chunk++, done += p->chunk) {
    p->offer[chunk] = SIZE_MAX;
    p->offer_by[chunk] = 0;
    if (due == 0) continue;
    price_chunk(job, chunk, first + done, count - done < p->chunk ? count - done : p->chunk, all);
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

/* The candidate's row where it is, or spread out where it is sparse. */
static void take_row(qp_pricing *p, size_t place) {
  const double *values;
  const uint32_t *columns;
  size_t n = p->rows->n, count = qp_rows_entries(p->rows, p->candidate[place], &values, &columns);
  p->values[place] = values;
  if (!columns) return;
  double *to = p->copy + place * n;
  memset(to, 0, n * sizeof *to);
  for (size_t e = 0; e < count; e++) to[columns[e]] = values[e];
  p->values[place] = to;
}

/* Weights of candidates, which are kept: many come back pass after pass. R^-T a_k by blocks of columns of R^-1, which
 * stay in cache from candidate to candidate and have nothing below their last row. */
static void weigh(qp_pricing *p) {
  enum { COLUMNS = 8 };
  size_t n = p->rows->n, fresh = 0;
  double *square = p->product; /* what it holds is made anew before it is asked for */
  for (size_t i = 0; i < p->count; i++) {
    p->weight[i] = p->known[p->candidate[i]];
    if (p->weight[i] > 0) continue;
    p->fresh[fresh] = i;
    square[fresh++] = 0;
  }
  for (size_t j = 0; j < n && fresh > 0; j += COLUMNS) {
    size_t columns = n - j < COLUMNS ? n - j : COLUMNS;
    for (size_t f = 0; f < fresh; f++) {
      double part[COLUMNS];
      qp_lanes_now()->dots(j + columns, columns, p->inverse + j * n, n, p->values[p->fresh[f]], part);
      for (size_t c = 0; c < columns; c++) square[f] += part[c] * part[c];
    }
  }
  for (size_t f = 0; f < fresh; f++) {
    size_t i = p->fresh[f];
    size_t k = p->candidate[i];
    p->weight[i] = p->known[k] = 1 / (p->rows->scale[k] * sqrt(square[f]));
  }
}

static void gather(qp_pricing *p) {
  const qp_rows *rows = p->rows;
  size_t most = candidates_most(rows), count = 0;
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
  for (size_t i = 0; i < count; i++) {
    p->candidate[i] = p->offer[i];
    p->skip[i] = false;
    take_row(p, i);
  }
  weigh(p);
}

bool qp_pricing_pass(batten_context *ctx, qp_pricing *p, const double *x) {
  size_t n = p->rows->n;
  double move = 0;
  for (size_t j = 0; j < n; j++) move += (x[j] - p->last[j]) * (x[j] - p->last[j]);
  memcpy(p->last, x, n * sizeof *x);
  p->length = length(n, x);
  p->path += sqrt(move) * (1 + 1e-9); /* far above the rounding of lengths, those of rows among them */
  if (!(p->path <= p->length)) { /* first pass, or slacks could drown in the rounding of safe_till: all rows anew */
    p->path = 0;
    for (size_t k = 0; k < p->rows->m; k++)
      if (p->safe_till[k] != INFINITY) p->safe_till[k] = -1;
  }

  const double WORTH_THREADS = 1 << 19; /* entries: some 50 us */
  pass job = {p, x};
  size_t blocks = (p->chunks + p->per_block - 1) / p->per_block;
  if (batten_threads(ctx) > 1 && (double)p->rows->m * (double)n > WORTH_THREADS)
    batten_parallel(ctx, blocks, price_block, &job);
  else
    for (size_t i = 0; i < blocks; i++) price_block(&job, i);
  gather(p);
  return p->count > 0;
}

size_t qp_pricing_worst(qp_pricing *p, const double *x) {
  const qp_rows *rows = p->rows;
  size_t worst = SIZE_MAX;
  double most = 0;
  signed char side;
  p->length = length(rows->n, x);
  qp_lanes_now()->dots_at(rows->n, p->count, p->values, x, p->product);
  for (size_t i = 0; i < p->count; i++) {
    size_t k = p->candidate[i];
    p->product[i] *= rows->scale[k];
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
