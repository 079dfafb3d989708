/* One row of a caller's matrix, dense or sparse, seen in one way. */
#ifndef BATTEN_QP_MATRIX_ROW_H
#define BATTEN_QP_MATRIX_ROW_H

#include <batten/matrix.h>

typedef struct qp_matrix_row {
  size_t count;
  const double *values;
  const uint32_t *columns; /* NULL: entry e is column e */
} qp_matrix_row;

static inline qp_matrix_row qp_row_of(const batten_matrix *m, size_t i) {
  if (m->columns == 0) return (qp_matrix_row){0, NULL, NULL}; /* may come without arrays */
  if (m->dense) return (qp_matrix_row){m->columns, m->dense + i * m->columns, NULL};
  return (qp_matrix_row){m->starts[i + 1] - m->starts[i], m->values + m->starts[i], m->indices + m->starts[i]};
}
static inline size_t qp_row_column(const qp_matrix_row *row, size_t e) { return row->columns ? row->columns[e] : e; }

#endif
