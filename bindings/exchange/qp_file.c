/* Sparse matrices and memory of quadratic programs in files: see qp_file.h. */
#include "qp_file.h"

#include "base/checked.h"
#include "soup.h"

#include <string.h>

batten_status bx_entries_add(bx_entries *entries, bx_entry entry) {
  void *grown = entries->items;
  batten_status st = bx_grow(entries->ctx, &grown, &entries->capacity, entries->count + 1, sizeof entry);
  entries->items = grown;
  if (st == BATTEN_OK) entries->items[entries->count++] = entry;
  return st;
}

/* ---- sparse matrices ------------------------------------------------------------------------------ */

void bx_sparse_free(batten_context *ctx, bx_sparse *sparse) {
  batten_free(ctx, sparse->starts);
  batten_free(ctx, sparse->indices);
  batten_free(ctx, sparse->values);
  *sparse = (bx_sparse){0};
}

static batten_status sparse_new(batten_context *ctx, size_t rows, size_t columns, size_t count, bx_sparse *out) {
  bx_sparse s = {.rows = rows, .columns = columns};
  size_t starts;
  if (rows > UINT32_MAX || columns > UINT32_MAX || !batten_add(rows, 1, &starts))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "a matrix of %zu x %zu; at most %lu each", rows, columns,
                       (unsigned long)UINT32_MAX);
  s.starts = batten_alloc_array(ctx, starts, sizeof *s.starts);
  if (s.starts) s.indices = batten_alloc_array(ctx, count, sizeof *s.indices);
  if (s.indices) s.values = batten_alloc_array(ctx, count, sizeof *s.values);
  if (!s.values) {
    bx_sparse_free(ctx, &s);
    return BATTEN_E_NOMEM;
  }
  memset(s.starts, 0, starts * sizeof *s.starts);
  *out = s;
  return BATTEN_OK;
}

/* counts[i + 1] = number of key i becomes counts[i] = place of the first; [count + 1]. */
static void accumulate(size_t *counts, size_t count) {
  for (size_t i = 0; i < count; i++) counts[i + 1] += counts[i];
}

/* After a place was handed out for each key, starts[i] is where i ends: move them back. */
static void shift_back(size_t *starts, size_t count) {
  memmove(starts + 1, starts, count * sizeof *starts);
  starts[0] = 0;
}

batten_status bx_sparse_transpose(batten_context *ctx, const bx_sparse *from, bx_sparse *out) {
  size_t count = from->starts[from->rows];
  batten_status st = sparse_new(ctx, from->columns, from->rows, count, out);
  if (st != BATTEN_OK) return st;
  for (size_t e = 0; e < count; e++) out->starts[from->indices[e] + 1]++;
  accumulate(out->starts, out->rows);
  for (size_t i = 0; i < from->rows; i++)
    for (size_t e = from->starts[i]; e < from->starts[i + 1]; e++) {
      size_t at = out->starts[from->indices[e]]++;
      out->indices[at] = (uint32_t)i;
      out->values[at] = from->values[e];
    }
  shift_back(out->starts, out->rows);
  return BATTEN_OK;
}

/* Puts the entries in the order of their columns (as rows of the transpose); the transpose of that is in order. */
batten_status bx_sparse_from(batten_context *ctx, size_t rows, size_t columns, const bx_entry *entries, size_t count,
                             bx_sparse *out) {
  bx_sparse t;
  batten_status st = sparse_new(ctx, columns, rows, count, &t);
  if (st != BATTEN_OK) return st;
  for (size_t e = 0; e < count; e++) t.starts[entries[e].column + 1]++;
  accumulate(t.starts, columns);
  for (size_t e = 0; e < count; e++) {
    size_t at = t.starts[entries[e].column]++;
    t.indices[at] = entries[e].row;
    t.values[at] = entries[e].value;
  }
  shift_back(t.starts, columns);
  st = bx_sparse_transpose(ctx, &t, out);
  bx_sparse_free(ctx, &t);
  return st;
}

bool bx_sparse_twice(const bx_sparse *sparse, size_t *row, size_t *column) {
  for (size_t i = 0; i < sparse->rows; i++)
    for (size_t e = sparse->starts[i] + 1; e < sparse->starts[i + 1]; e++)
      if (sparse->indices[e] == sparse->indices[e - 1]) {
        *row = i;
        *column = sparse->indices[e];
        return true;
      }
  return false;
}

bool bx_sparse_differs(const bx_sparse *a, const bx_sparse *transposed, size_t *row, size_t *column) {
  for (size_t i = 0; i < a->rows; i++) {
    size_t e = a->starts[i], f = transposed->starts[i];
    size_t e_end = a->starts[i + 1], f_end = transposed->starts[i + 1];
    for (; e < e_end || f < f_end; e++, f++) {
      bool both = e < e_end && f < f_end && a->indices[e] == transposed->indices[f];
      if (both && !(a->values[e] < transposed->values[f]) && !(a->values[e] > transposed->values[f])) continue;
      bool first = f >= f_end || (e < e_end && a->indices[e] < transposed->indices[f]);
      *row = i;
      *column = first ? a->indices[e] : transposed->indices[f];
      return true;
    }
  }
  return false;
}

batten_status bx_sparse_of(batten_context *ctx, const batten_matrix *m, bx_sparse *out) {
  bx_entries entries = {.ctx = ctx};
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < m->rows; i++) {
    size_t from = m->dense ? i * m->columns : m->starts[i];
    size_t count = m->dense ? m->columns : m->starts[i + 1] - from;
    for (size_t j = 0; st == BATTEN_OK && j < count; j++) {
      double value = m->dense ? m->dense[from + j] : m->values[from + j];
      uint32_t column = m->dense ? (uint32_t)j : m->indices[from + j];
      if (value < 0 || value > 0)
        st = bx_entries_add(&entries, (bx_entry){.row = (uint32_t)i, .column = column, .value = value});
    }
  }
  if (st == BATTEN_OK) st = bx_sparse_from(ctx, m->rows, m->columns, entries.items, entries.count, out);
  batten_free(ctx, entries.items);
  return st;
}

/* ---- the memory of a problem ---------------------------------------------------------------------- */

bx_qp_store *bx_qp_store_new(batten_context *ctx) {
  bx_qp_store *store = batten_alloc(ctx, sizeof *store);
  if (store) *store = (bx_qp_store){0};
  return store;
}

void bx_qp_store_free(batten_context *ctx, bx_qp_store *store) {
  if (!store) return;
  for (int i = 0; i < 3; i++) {
    bx_sparse_free(ctx, &store->sparse[i]);
    batten_free(ctx, store->dense[i]);
  }
  void *blocks[] = {store->b,       store->weights,       store->g,        store->lower,        store->upper,
                    store->x_lower, store->x_upper,       store->x0,       store->unknown_text, store->row_text,
                    store->name,    store->unknown_names, store->row_names};
  for (size_t i = 0; i < sizeof blocks / sizeof blocks[0]; i++) batten_free(ctx, blocks[i]);
  batten_free(ctx, store);
}

double *bx_qp_fill(batten_context *ctx, size_t count, double value) {
  double *values = batten_alloc_array(ctx, count, sizeof *values);
  for (size_t i = 0; values && i < count; i++) values[i] = value;
  return values;
}

batten_status bx_qp_take_names(bx_names *names, char **text, char ***list) {
  char **pointers = batten_alloc_array(names->ctx, names->count, sizeof *pointers);
  if (!pointers) return BATTEN_E_NOMEM;
  *text = names->text;
  names->text = NULL;
  for (size_t i = 0; i < names->count; i++) pointers[i] = *text + names->starts[i];
  *list = pointers;
  return BATTEN_OK;
}

/* The matrix number i of the store, NULL when it is not there. */
static const batten_matrix *matrix(bx_qp_store *store, batten_matrix *to, int i) {
  const bx_sparse *s = &store->sparse[i];
  if (store->dense[i]) return to; /* its reader has set it */
  if (!s->starts || s->rows == 0) return NULL;
  *to = batten_matrix_sparse(s->rows, s->columns, s->starts, s->indices, s->values);
  return to;
}

batten_status bx_qp_finish(batten_context *ctx, bx_qp_store *store, size_t n, double constant, batten_qp_file *out) {
  if (!store->name) {
    store->name = batten_alloc(ctx, 1);
    if (!store->name) return BATTEN_E_NOMEM;
    store->name[0] = '\0';
  }
  batten_qp_problem p = {.struct_size = sizeof p, .n = n};
  p.a = matrix(store, &store->a, 0);
  p.h = matrix(store, &store->h, 1);
  p.c = matrix(store, &store->c, 2);
  p.b = store->b;
  p.weights = store->weights;
  p.g = store->g;
  p.constant = constant;
  p.lower = store->lower;
  p.upper = store->upper;
  p.x_lower = store->x_lower;
  p.x_upper = store->x_upper;
  *out = (batten_qp_file){.problem = p,
                          .x0 = store->x0,
                          .name = store->name,
                          .unknown_names = store->unknown_names,
                          .row_names = store->row_names,
                          .memory = store};
  return BATTEN_OK;
}
