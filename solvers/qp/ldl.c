/* L D L' of the quasidefinite [H + d, C'; C, -w] in an order of little fill: rows of L one after the other [Davis,
 * Direct Methods for Sparse Linear Systems, 4.8], on a pattern that is found once. The signs of the pivots are known,
 * so one that rounding has turned round or eaten is seen and repaired; the caller's refinement takes the repair out
 * again. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "kkt.h"

struct qp_ldl {
  size_t n, m, all;
  uint32_t *order; /* [all] node at each place: unknowns, then n + row */
  size_t *above;   /* [all + 1] entries above the diagonal of each column, in the new order */
  uint32_t *above_row;
  double *above_value;
  double *diagonal; /* [n] of H */
  size_t *column;   /* [all + 1] of L */
  uint32_t *index;  /* row of each entry of L, ascending in its column */
  double *value;
  size_t *row;          /* [all + 1] */
  uint32_t *row_column; /* columns of each row of L, ascending */
  size_t *filled;       /* [all] end of what is known of each column */
  double *pivot;        /* [all] 1 / D */
  double *work;         /* [all] */
  size_t bytes;
  double flops;
};

void qp_ldl_free(batten_context *ctx, qp_ldl *f) {
  if (!f) return;
  void *blocks[] = {f->order, f->above, f->above_row,  f->above_value, f->diagonal, f->column, f->index,
                    f->value, f->row,   f->row_column, f->filled,      f->pivot,    f->work,   f};
  for (size_t b = 0; b < sizeof blocks / sizeof *blocks; b++) batten_free(ctx, blocks[b]);
}

static void *take(batten_context *ctx, qp_ldl *f, size_t count, size_t size) {
  void *block = batten_alloc_array(ctx, count, size);
  if (block) f->bytes += count * size;
  return block;
}

/* The entries above the diagonal in the new order; place [all] is the inverse order. */
static batten_status permute(batten_context *ctx, qp_ldl *f, const qp_csr *h, const qp_csr *c,
                             const uint32_t *place) {
  size_t n = f->n, all = f->all;
  f->above = take(ctx, f, all + 2, sizeof *f->above);
  f->diagonal = take(ctx, f, n, sizeof *f->diagonal);
  f->above_row = take(ctx, f, h->starts[n] + c->starts[f->m], sizeof *f->above_row);
  f->above_value = take(ctx, f, h->starts[n] + c->starts[f->m], sizeof *f->above_value);
  if (!f->above || !f->diagonal || !f->above_row || !f->above_value) return BATTEN_E_NOMEM;
  memset(f->above, 0, (all + 2) * sizeof *f->above);
  for (size_t j = 0; j < n; j++) f->diagonal[j] = 0;
  size_t *next = f->above + 1;
  for (int pass = 0; pass < 2; pass++) {
    for (size_t j = 0; j < n; j++)
      for (size_t e = h->starts[j]; e < h->starts[j + 1]; e++) {
        uint32_t a = place[j], b = place[h->indices[e]];
        if (a == b) f->diagonal[j] = h->values[e];
        if (a >= b) continue;
        if (pass) {
          f->above_row[next[b]] = a;
          f->above_value[next[b]++] = h->values[e];
        } else
          next[b + 1]++;
      }
    for (size_t i = 0; i < f->m; i++)
      for (size_t e = c->starts[i]; e < c->starts[i + 1]; e++) {
        uint32_t a = place[c->indices[e]], b = place[n + i], low = a < b ? a : b, high = a < b ? b : a;
        if (pass) {
          f->above_row[next[high]] = low;
          f->above_value[next[high]++] = c->values[e];
        } else
          next[high + 1]++;
      }
    if (!pass)
      for (size_t k = 1; k < all + 1; k++) next[k] += next[k - 1];
  }
  return BATTEN_OK;
}

/* Rows k whose pattern has column i, by walking up the elimination tree from every entry of A: counts them, or writes
 * them to the columns. */
static void walk(qp_ldl *f, uint32_t *parent, uint32_t *mark, bool write) {
  for (uint32_t k = 0; k < f->all; k++) {
    if (!write) parent[k] = UINT32_MAX;
    mark[k] = k;
    for (size_t e = f->above[k]; e < f->above[k + 1]; e++)
      for (uint32_t i = f->above_row[e]; mark[i] != k; i = parent[i]) {
        if (parent[i] == UINT32_MAX) parent[i] = k;
        mark[i] = k;
        if (write)
          f->index[f->filled[i]++] = k;
        else
          f->filled[i]++;
      }
  }
}

static batten_status symbolic(batten_context *ctx, qp_ldl *f, uint32_t *parent, uint32_t *mark) {
  size_t all = f->all, entries = 0;
  f->column = take(ctx, f, all + 1, sizeof *f->column);
  f->row = take(ctx, f, all + 2, sizeof *f->row);
  f->filled = take(ctx, f, all, sizeof *f->filled);
  f->pivot = take(ctx, f, all, sizeof *f->pivot);
  f->work = take(ctx, f, all, sizeof *f->work);
  if (!f->column || !f->row || !f->filled || !f->pivot || !f->work) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < all; k++) f->filled[k] = 0, mark[k] = UINT32_MAX, f->work[k] = 0;
  walk(f, parent, mark, false);
  for (size_t k = 0; k < all; k++) {
    double count = (double)f->filled[k];
    f->column[k] = entries;
    entries += f->filled[k];
    f->filled[k] = f->column[k];
    f->flops += count * (count + 2);
  }
  f->column[all] = entries;
  f->index = take(ctx, f, entries, sizeof *f->index);
  f->value = take(ctx, f, entries, sizeof *f->value);
  f->row_column = take(ctx, f, entries, sizeof *f->row_column);
  if (!f->index || !f->value || !f->row_column) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < all; k++) mark[k] = UINT32_MAX;
  walk(f, parent, mark, true);
  memset(f->row, 0, (all + 2) * sizeof *f->row);
  for (size_t e = 0; e < entries; e++) f->row[f->index[e] + 2]++;
  for (size_t k = 2; k < all + 2; k++) f->row[k] += f->row[k - 1];
  for (size_t k = 0; k < all; k++)
    for (size_t e = f->column[k]; e < f->column[k + 1]; e++) f->row_column[f->row[f->index[e] + 1]++] = (uint32_t)k;
  return BATTEN_OK;
}

batten_status qp_ldl_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_ldl **out) {
  size_t n = c->columns, m = c->rows, all = n + m;
  sparse_graph g = {0};
  uint32_t *place = NULL, *mark = NULL;
  qp_ldl *f = batten_alloc(ctx, sizeof *f);
  if (!f) return BATTEN_E_NOMEM;
  *f = (qp_ldl){.n = n, .m = m, .all = all};
  batten_status st = BATTEN_E_NOMEM;
  f->order = take(ctx, f, all, sizeof *f->order);
  if (!f->order) goto done;
  place = batten_alloc_array(ctx, all, sizeof *place);
  if (!place) goto done;
  mark = batten_alloc_array(ctx, all, sizeof *mark);
  if (!mark) goto done;
  st = qp_graph_augmented(ctx, h, c, &g);
  if (st < 0) goto done;
  st = sparse_order_degree(ctx, &g, f->order);
  if (st < 0) goto done;
  for (size_t k = 0; k < all; k++) place[f->order[k]] = (uint32_t)k;
  st = permute(ctx, f, h, c, place);
  if (st < 0) goto done;
  st = symbolic(ctx, f, place, mark);
  if (st < 0) goto done;
  *out = f;
  f = NULL;
done:
  sparse_graph_free(ctx, &g);
  batten_free(ctx, mark);
  batten_free(ctx, place);
  qp_ldl_free(ctx, f);
  return st;
}

size_t qp_ldl_factor(qp_ldl *f, const double *d, const double *w) {
  size_t repaired = 0;
  double *y = f->work;
  for (size_t k = 0; k < f->all; k++) {
    uint32_t node = f->order[k];
    bool unknown = node < f->n;
    double diagonal = unknown ? f->diagonal[node] + d[node] : -w[node - f->n], size = fabs(diagonal);
    for (size_t e = f->above[k]; e < f->above[k + 1]; e++) y[f->above_row[e]] = f->above_value[e];
    for (size_t r = f->row[k]; r < f->row[k + 1]; r++) {
      uint32_t i = f->row_column[r];
      double yi = y[i], l = yi * f->pivot[i];
      size_t end = f->filled[i];
      y[i] = 0;
      for (size_t p = f->column[i]; p < end; p++) y[f->index[p]] -= f->value[p] * yi;
      diagonal -= l * yi;
      if (fabs(l * yi) > size) size = fabs(l * yi);
      f->value[end] = l;
      f->filled[i] = end + 1;
    }
    /* Pivots of unknowns are positive, of rows negative, beyond rounding of what was subtracted. */
    double least = 1e-15 * size + 1e-30;
    if (unknown ? !(diagonal > least) : !(diagonal < -least)) {
      diagonal = unknown ? 1e8 * least : -1e8 * least;
      repaired++;
    }
    f->pivot[k] = 1 / diagonal;
    f->filled[k] = f->column[k];
  }
  return repaired;
}

void qp_ldl_solve(qp_ldl *f, double *r, double *s) {
  double *y = f->work;
  size_t n = f->n;
  for (size_t k = 0; k < f->all; k++) y[k] = f->order[k] < n ? r[f->order[k]] : s[f->order[k] - n];
  for (size_t k = 0; k < f->all; k++) {
    double yk = y[k];
    for (size_t p = f->column[k]; p < f->column[k + 1]; p++) y[f->index[p]] -= f->value[p] * yk;
  }
  for (size_t k = f->all; k-- > 0;) {
    double sum = y[k] * f->pivot[k];
    for (size_t p = f->column[k]; p < f->column[k + 1]; p++) sum -= f->value[p] * y[f->index[p]];
    y[k] = sum;
  }
  for (size_t k = 0; k < f->all; k++) {
    if (f->order[k] < n)
      r[f->order[k]] = y[k];
    else
      s[f->order[k] - n] = y[k];
    y[k] = 0;
  }
}

double qp_ldl_flops(const qp_ldl *f) { return f->flops; }
size_t qp_ldl_bytes(const qp_ldl *f) { return f->bytes; }
