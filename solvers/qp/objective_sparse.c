/* P = A'WA + H as compressed sparse rows, in time of the products that it takes and without anything [n][n].
 *
 * Row i of P gathers w_r A_ri A_r,: over the rows r of A that touch unknown i (Gustavson's algorithm on the columns
 * of A), then row i of H. Columns of a row come in the order of discovery; P is symmetric, so writing each row as a
 * column, rows in ascending order, leaves every row sorted. See objective.h. */
#include <string.h>

#include "base/checked.h"
#include "matrix_row.h"
#include "objective.h"

/* Columns of A: entries of unknown j are [starts[j], starts[j + 1]). */
typedef struct columns {
  size_t *starts; /* [n + 1] */
  size_t *rows;
  double *values;
} columns;

/* Where row i of P is gathered. */
typedef struct gatherer {
  const batten_qp_problem *problem;
  size_t n;
  columns a;
  double *sum;     /* [n] */
  size_t *seen;    /* [n] row + 1 in which an unknown was last met */
  uint32_t *found; /* [n] columns met in this row */
  size_t *length;  /* [n] of each row */
} gatherer;

static void gatherer_free(batten_context *ctx, gatherer *g) {
  batten_free(ctx, g->a.starts);
  batten_free(ctx, g->a.rows);
  batten_free(ctx, g->a.values);
  batten_free(ctx, g->sum);
  batten_free(ctx, g->seen);
  batten_free(ctx, g->found);
  batten_free(ctx, g->length);
}

/* starts[j + 1] := entries of column j that are not zero; returns all of them. */
static size_t count_columns(const batten_matrix *a, size_t n, size_t *starts) {
  size_t all = 0;
  memset(starts, 0, (n + 1) * sizeof *starts);
  for (size_t i = 0; a && i < a->rows; i++) {
    qp_matrix_row row = qp_row_of(a, i);
    for (size_t e = 0; e < row.count; e++) {
      if (row.values[e] == 0) continue;
      starts[qp_row_column(&row, e) + 1]++;
      all++;
    }
  }
  return all;
}

static batten_status make_columns(batten_context *ctx, const batten_matrix *a, size_t n, columns *out) {
  out->starts = batten_alloc_array(ctx, n + 1, sizeof *out->starts);
  if (!out->starts) return BATTEN_E_NOMEM;
  size_t all = count_columns(a, n, out->starts);
  out->rows = batten_alloc_array(ctx, all, sizeof *out->rows);
  if (!out->rows) return BATTEN_E_NOMEM;
  out->values = batten_alloc_array(ctx, all, sizeof *out->values);
  if (!out->values) return BATTEN_E_NOMEM;
  for (size_t j = 0; j < n; j++) out->starts[j + 1] += out->starts[j];
  for (size_t i = 0; a && i < a->rows; i++) {
    qp_matrix_row row = qp_row_of(a, i);
    for (size_t e = 0; e < row.count; e++) {
      if (row.values[e] == 0) continue;
      size_t at = out->starts[qp_row_column(&row, e)]++;
      out->rows[at] = i;
      out->values[at] = row.values[e];
    }
  }
  for (size_t j = n; j > 0; j--) out->starts[j] = out->starts[j - 1];
  out->starts[0] = 0;
  return BATTEN_OK;
}

static batten_status gatherer_new(batten_context *ctx, const batten_qp_problem *problem, gatherer *g) {
  size_t n = problem->n;
  *g = (gatherer){.problem = problem, .n = n};
  batten_status st = make_columns(ctx, problem->a, n, &g->a);
  if (st < 0) return st;
  g->sum = batten_alloc_array(ctx, n, sizeof *g->sum);
  if (!g->sum) return BATTEN_E_NOMEM;
  g->seen = batten_alloc_array(ctx, n, sizeof *g->seen);
  if (!g->seen) return BATTEN_E_NOMEM;
  g->found = batten_alloc_array(ctx, n, sizeof *g->found);
  if (!g->found) return BATTEN_E_NOMEM;
  g->length = batten_alloc_array(ctx, n, sizeof *g->length);
  return g->length ? BATTEN_OK : BATTEN_E_NOMEM;
}

/* Meets the entries of a row: adds factor * (by * value), so that P_ij and P_ji are the same bits. */
static size_t gather_row(gatherer *g, size_t i, qp_matrix_row row, double factor, double by, size_t count) {
  for (size_t e = 0; e < row.count; e++) {
    if (row.values[e] == 0) continue;
    size_t j = qp_row_column(&row, e);
    if (g->seen[j] != i + 1) {
      g->seen[j] = i + 1;
      g->sum[j] = 0;
      g->found[count++] = (uint32_t)j;
    }
    g->sum[j] += factor * (by * row.values[e]);
  }
  return count;
}

/* Row i of P -> sum at the columns found; returns how many. */
static size_t gather(gatherer *g, size_t i) {
  const batten_qp_problem *p = g->problem;
  g->seen[i] = i + 1;
  g->sum[i] = 0;
  g->found[0] = (uint32_t)i;
  size_t count = 1;
  for (size_t q = g->a.starts[i]; q < g->a.starts[i + 1]; q++) {
    size_t r = g->a.rows[q];
    double w = p->weights ? p->weights[r] : 1;
    if (w > 0) count = gather_row(g, i, qp_row_of(p->a, r), w, g->a.values[q], count);
  }
  return p->h ? gather_row(g, i, qp_row_of(p->h, i), 1, 1, count) : count;
}

/* q = g - A'Wb */
static void linear_term(const batten_qp_problem *p, double *q) {
  for (size_t j = 0; j < p->n; j++) q[j] = p->g ? p->g[j] : 0;
  for (size_t i = 0; p->a && p->b && i < p->a->rows; i++) {
    qp_matrix_row row = qp_row_of(p->a, i);
    double wb = (p->weights ? p->weights[i] : 1) * p->b[i];
    for (size_t e = 0; e < row.count; e++) q[qp_row_column(&row, e)] -= wb * row.values[e];
  }
}

/* One block for starts, values, q, indices, in this order: each starts aligned for its type. */
static batten_status take_arrays(batten_context *ctx, size_t n, size_t entries, char **memory, size_t bytes[4]) {
  size_t all = 0;
  bool fits = batten_mul(n + 1, sizeof(size_t), &bytes[0]) && batten_mul(entries, sizeof(double), &bytes[1]) &&
              batten_mul(n, sizeof(double), &bytes[2]) && batten_mul(entries, sizeof(uint32_t), &bytes[3]);
  for (size_t part = 0; part < 4; part++) fits = batten_add(all, bytes[part], &all) && fits;
  if (!fits) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "objective: A'A has %zu entries", entries);
  *memory = batten_alloc(ctx, all);
  return *memory ? BATTEN_OK : BATTEN_E_NOMEM;
}

batten_status qp_objective_sparse(batten_context *ctx, const qp_objective *o, qp_sparse *out, batten_matrix *h,
                                  void **memory) {
  size_t n = o->n, entries = 0, bytes[4];
  gatherer g;
  char *block = NULL;
  batten_status st = gatherer_new(ctx, o->problem, &g);
  if (st < 0) goto done;
  memset(g.seen, 0, n * sizeof *g.seen);
  for (size_t i = 0; i < n; i++) entries += g.length[i] = gather(&g, i);
  st = take_arrays(ctx, n, entries, &block, bytes);
  if (st < 0) goto done;
  size_t *starts = (size_t *)(void *)block;
  double *values = (double *)(void *)(block + bytes[0]), *q = (double *)(void *)(block + bytes[0] + bytes[1]);
  uint32_t *indices = (uint32_t *)(void *)(block + bytes[0] + bytes[1] + bytes[2]);

  /* lengths of rows are those of columns; each row is written as a column */
  starts[0] = 0;
  for (size_t i = 0; i < n; i++) starts[i + 1] = starts[i] + g.length[i];
  memset(g.seen, 0, n * sizeof *g.seen);
  for (size_t i = 0; i < n; i++) {
    size_t count = gather(&g, i);
    for (size_t e = 0; e < count; e++) {
      size_t at = starts[g.found[e]]++;
      indices[at] = (uint32_t)i;
      values[at] = g.sum[g.found[e]];
    }
  }
  for (size_t i = n; i > 0; i--) starts[i] = starts[i - 1];
  starts[0] = 0;
  linear_term(o->problem, q);
  *h = batten_matrix_sparse(n, n, starts, indices, values);
  *out = (qp_sparse){.n = n, .h = h, .g = q};
  *memory = block;
  block = NULL;
done:
  batten_free(ctx, block);
  gatherer_free(ctx, &g);
  return st;
}
