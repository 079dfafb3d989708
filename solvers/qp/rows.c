/* Rows of constraints where the caller has them, dense or sparse, and unit rows for bounds: products without copies.
 * See engine.h. */
#include "engine.h"
#include "la/la.h"

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

/* Four running sums, added in a fixed order: independent of BLAS and its threads. */
static double dot_dense(size_t n, const double *a, const double *x) {
  double s[4] = {0};
  size_t j = 0;
  for (; j + 4 <= n; j += 4)
    for (size_t q = 0; q < 4; q++) s[q] += a[j + q] * x[j + q];
  for (; j < n; j++) s[0] += a[j] * x[j];
  return (s[0] + s[1]) + (s[2] + s[3]);
}

double qp_rows_dot(const qp_rows *rows, size_t k, const double *x) {
  const double *values;
  const uint32_t *columns;
  size_t count = qp_rows_entries(rows, k, &values, &columns);
  if (!columns) return rows->scale[k] * dot_dense(count, values, x);
  double sum = 0;
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

/* How many of the constraints from k on, at most `most`, are dense rows that follow each other in the caller's matrix. */
static size_t dense_run(const qp_rows *rows, size_t k, size_t most) {
  if (!rows->c || !rows->c->dense) return 0;
  size_t run = 0;
  while (run < most && rows->row[k + run] < rows->c->rows && rows->row[k + run] == rows->row[k] + run) run++;
  return run;
}

void qp_rows_times(const qp_rows *rows, size_t first, size_t count, const double *x, double *out) {
  const size_t WORTH_A_CALL = 8;
  for (size_t i = 0; i < count;) {
    size_t run = dense_run(rows, first + i, count - i);
    if (run < WORTH_A_CALL) {
      out[i] = qp_rows_dot(rows, first + i, x);
      i++;
      continue;
    }
    const double *a = rows->c->dense + rows->row[first + i] * rows->n;
    batten_la_gemv(BATTEN_LA_DOUBLE, 'T', rows->n, run, 1, a, rows->n, x, 0, out + i);
    for (size_t end = i + run; i < end; i++) out[i] *= rows->scale[first + i];
  }
}
