/* Rows of constraints where the caller has them, dense or sparse, and unit rows for bounds: products without copies.
 * See engine.h. */
#include "engine.h"
#include "lanes.h"

static const double UNIT = 1;

size_t qp_rows_entries(const qp_rows *rows, size_t k, const double **values, const uint32_t **columns) {
  size_t row = rows->row[k], caller_rows = rows->c ? rows->c->rows : 0;
  const batten_matrix *c = rows->c;
  if (row >= caller_rows) {
    *values = &UNIT;
    *columns = rows->identity + (row - caller_rows);
    return 1;
  }
  if (c->dense) {
    *values = c->dense + row * c->columns;
    *columns = NULL;
    return c->columns;
  }
  *values = c->values + c->starts[row];
  *columns = c->indices + c->starts[row];
  return c->starts[row + 1] - c->starts[row];
}

size_t qp_rows_count(const qp_rows *rows) {
  const double *values;
  const uint32_t *columns;
  size_t count = 0, k = rows->m;
  if (rows->c && rows->c->dense) { /* bounds come last */
    while (k > 0 && rows->row[k - 1] >= rows->c->rows) k--;
    return k * rows->c->columns + (rows->m - k);
  }
  while (k > 0) count += qp_rows_entries(rows, --k, &values, &columns);
  return count;
}

double qp_rows_dot(const qp_rows *rows, size_t k, const double *x) {
  const double *values;
  const uint32_t *columns;
  size_t count = qp_rows_entries(rows, k, &values, &columns);
  double sum = 0;
  if (!columns) {
    qp_lanes_now()->dots(count, 1, values, count, x, &sum);
    return rows->scale[k] * sum;
  }
  for (size_t e = 0; e < count; e++) sum += values[e] * x[columns[e]];
  return rows->scale[k] * sum;
}

void qp_rows_add(const qp_rows *rows, size_t k, double factor, double *to) {
  const double *values;
  const uint32_t *columns;
  size_t count = qp_rows_entries(rows, k, &values, &columns);
  factor *= rows->scale[k];
  if (columns)
    for (size_t e = 0; e < count; e++) to[columns[e]] += factor * values[e];
  else
    for (size_t e = 0; e < count; e++) to[e] += factor * values[e];
}

/* How many of the constraints from k on, at most `most`, are dense rows that follow each other in the caller's
 * matrix. */
static size_t dense_run(const qp_rows *rows, size_t k, size_t most) {
  if (!rows->c || !rows->c->dense) return 0;
  size_t run = 0;
  while (run < most && rows->row[k + run] < rows->c->rows && rows->row[k + run] == rows->row[k] + run) run++;
  return run;
}

void qp_rows_times(const qp_rows *rows, size_t first, size_t count, const double *x, double *out) {
  for (size_t i = 0; i < count;) {
    size_t run = dense_run(rows, first + i, count - i);
    if (run == 0) {
      out[i] = qp_rows_dot(rows, first + i, x);
      i++;
      continue;
    }
    const double *a = rows->c->dense + rows->row[first + i] * rows->n;
    qp_lanes_now()->dots(rows->n, run, a, rows->n, x, out + i);
    for (size_t end = i + run; i < end; i++) out[i] *= rows->scale[first + i];
  }
}
