/* How a caller hands over a real matrix: dense rows, or compressed sparse rows (CSR). Only read, never copied whole. */
#ifndef BATTEN_MATRIX_H
#define BATTEN_MATRIX_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* rows x columns. Either dense is given, or starts, indices and values. A matrix without rows or columns needs none
 * of them. The arrays are the caller's. */
typedef struct batten_matrix {
  size_t rows, columns;
  const double *dense;     /* [rows][columns] row-major */
  const size_t *starts;    /* [rows + 1] not decreasing, starts[0] = 0: row i has the entries starts[i] .. starts[i+1]-1 */
  const uint32_t *indices; /* [starts[rows]] column of each entry, in any order within a row, none twice in a row */
  const double *values;    /* [starts[rows]] */
} batten_matrix;

static inline batten_matrix batten_matrix_dense(size_t rows, size_t columns, const double *dense) {
  batten_matrix m = {rows, columns, dense, NULL, NULL, NULL};
  return m;
}
static inline batten_matrix batten_matrix_sparse(size_t rows, size_t columns, const size_t *starts,
                                                 const uint32_t *indices, const double *values) {
  batten_matrix m = {rows, columns, NULL, starts, indices, values};
  return m;
}

#ifdef __cplusplus
}
#endif
#endif
