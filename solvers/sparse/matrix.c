/* Compressed rows of small blocks: the pattern from pairs of neighbours, look-up, product with a vector. */
#include "block.h"

#include <assert.h>
#include <string.h>

#include "base/checked.h"
#include "rows.h"

void block_matrix_free(batten_context *ctx, block_matrix *a) {
  batten_free(ctx, a->starts);
  batten_free(ctx, a->columns);
  batten_free(ctx, a->values);
  *a = (block_matrix){0};
}

/* Neighbours of all rows, sorted by row and by column in a row: two counting sorts, first by column, then by row.
 * starts [rows + 1] and columns [2 pair_count + rows], pairs that are given twice still twice; by_column of the same
 * length and at [rows + 1] are scratch. */
static void sort_pairs(size_t rows, size_t pair_count, const uint32_t *pairs, size_t *starts, uint32_t *columns,
                       uint32_t *by_column, size_t *at) {
  memset(starts, 0, (rows + 1) * sizeof *starts);
  for (size_t e = 0; e < 2 * pair_count; e++) starts[pairs[e] + 1]++;
  for (size_t i = 0; i < rows; i++) starts[i + 1] += starts[i] + 1;
  memcpy(at, starts, (rows + 1) * sizeof *at);
  for (size_t i = 0; i < rows; i++) by_column[at[i]++] = (uint32_t)i;
  for (size_t e = 0; e < pair_count; e++) {
    by_column[at[pairs[2 * e]]++] = pairs[2 * e + 1];
    by_column[at[pairs[2 * e + 1]]++] = pairs[2 * e];
  }
  memcpy(at, starts, (rows + 1) * sizeof *at);
  for (size_t j = 0; j < rows; j++)
    for (size_t e = starts[j]; e < starts[j + 1]; e++) columns[at[by_column[e]]++] = (uint32_t)j;
}

/* Keeps one of equal columns in each row; starts are adapted. */
static void drop_repeats(size_t rows, size_t *starts, uint32_t *columns) {
  size_t kept = 0, from = 0;
  for (size_t i = 0; i < rows; i++) {
    size_t to = starts[i + 1], first = kept;
    for (size_t e = from; e < to; e++)
      if (kept == first || columns[kept - 1] != columns[e]) columns[kept++] = columns[e];
    from = to;
    starts[i + 1] = kept;
  }
}

batten_status block_matrix_new(batten_context *ctx, size_t rows, unsigned size, size_t pair_count,
                               const uint32_t *pairs, block_matrix *out) {
  assert(size >= 1 && size <= BLOCK_SIZE_MAX);
  batten_status st = BATTEN_E_NOMEM;
  block_matrix a = {.rows = rows, .size = size};
  uint32_t *by_column = NULL, *shrunk;
  size_t *at = NULL, entries, values;
  if (rows > UINT32_MAX - 2 || !batten_mul(pair_count, 2, &entries) || !batten_add(entries, rows, &entries))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "sparse system: %zu rows with %zu pairs", rows, pair_count);
  for (size_t e = 0; e < 2 * pair_count; e++) assert(pairs[e] < rows && pairs[e] != pairs[e ^ 1]);
  a.starts = batten_alloc_array(ctx, rows + 1, sizeof *a.starts);
  if (!a.starts) goto done;
  a.columns = batten_alloc_array(ctx, entries, sizeof *a.columns);
  if (!a.columns) goto done;
  by_column = batten_alloc_array(ctx, entries, sizeof *by_column);
  if (!by_column) goto done;
  at = batten_alloc_array(ctx, rows + 1, sizeof *at);
  if (!at) goto done;
  sort_pairs(rows, pair_count, pairs, a.starts, a.columns, by_column, at);
  drop_repeats(rows, a.starts, a.columns);
  batten_free(ctx, by_column);
  batten_free(ctx, at);
  by_column = NULL;
  at = NULL;
  entries = a.starts[rows];
  shrunk = batten_realloc_array(ctx, a.columns, entries, sizeof *a.columns);
  if (!shrunk) goto done;
  a.columns = shrunk;
  if (!batten_mul3(entries, size, size, &values)) goto done;
  a.values = batten_alloc_array(ctx, values, sizeof *a.values);
  if (!a.values) goto done;
  memset(a.values, 0, values * sizeof *a.values);
  *out = a;
  a = (block_matrix){0};
  st = BATTEN_OK;
done:
  batten_free(ctx, at);
  batten_free(ctx, by_column);
  block_matrix_free(ctx, &a);
  return st;
}

double *block_matrix_at(const block_matrix *a, size_t i, size_t j) {
  size_t low = a->starts[i], end = a->starts[i + 1], high = end;
  while (low < high) {
    size_t middle = low + (high - low) / 2;
    if (a->columns[middle] < j)
      low = middle + 1;
    else
      high = middle;
  }
  return low < end && a->columns[low] == j ? a->values + low * a->size * a->size : NULL;
}

typedef struct apply_task {
  const block_matrix *a;
  const double *x;
  double *y;
} apply_task;

static void apply_part(void *arg, size_t index) {
  apply_task *t = arg;
  size_t first, last;
  block_part(t->a, index, &first, &last);
  block_rows_apply(t->a, first, last, t->x, t->y);
}

void block_matrix_apply(batten_context *ctx, const block_matrix *a, const double *x, double *y) {
  apply_task t = {a, x, y};
  batten_parallel(ctx, block_parts(a), apply_part, &t);
}
