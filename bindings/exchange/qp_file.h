/* What the readers and writers of quadratic programs share: sparse matrices from entries in any order, and the memory
 * of a problem that was read. */
#ifndef BATTEN_EXCHANGE_QP_FILE_H
#define BATTEN_EXCHANGE_QP_FILE_H

#include "format.h"
#include "names.h"

typedef struct bx_entry {
  double value;
  uint32_t row, column;
  uint32_t line; /* of the file, for messages; 0 = none */
} bx_entry;

/* {.ctx = ctx} is an empty list. */
typedef struct bx_entries {
  batten_context *ctx;
  bx_entry *items;
  size_t count, capacity;
} bx_entries;

batten_status bx_entries_add(bx_entries *entries, bx_entry entry);

/* Sparse rows, the columns of a row ascending. */
typedef struct bx_sparse {
  size_t rows, columns;
  size_t *starts;
  uint32_t *indices;
  double *values;
} bx_sparse;

void bx_sparse_free(batten_context *ctx, bx_sparse *sparse);

/* Every entry must lie within rows x columns. Entries in one place stay apart: bx_sparse_twice finds them. */
batten_status bx_sparse_from(batten_context *ctx, size_t rows, size_t columns, const bx_entry *entries, size_t count,
                             bx_sparse *out);
batten_status bx_sparse_transpose(batten_context *ctx, const bx_sparse *from, bx_sparse *out);

/* The first place that has two entries; false when there is none. */
bool bx_sparse_twice(const bx_sparse *sparse, size_t *row, size_t *column);

/* The first place (row, column) where the matrix differs from its transpose; false when there is none. */
bool bx_sparse_differs(const bx_sparse *a, const bx_sparse *transposed, size_t *row, size_t *column);

/* Entries that are not 0 of a matrix as callers hand it over. */
batten_status bx_sparse_of(batten_context *ctx, const batten_matrix *m, bx_sparse *out);

/* ---- a problem in the making --------------------------------------------------------------------- */

/* Everything that a batten_qp_file points to; its `memory`. */
typedef struct bx_qp_store {
  batten_matrix a, h, c;
  bx_sparse sparse[3]; /* of a, h, c; arrays may be NULL */
  double *dense[3];    /* of a, h, c; may be NULL */
  double *b, *weights, *g, *lower, *upper, *x_lower, *x_upper, *x0;
  char *name, *unknown_text, *row_text;
  char **unknown_names, **row_names;
} bx_qp_store;

/* NULL: out of memory. */
bx_qp_store *bx_qp_store_new(batten_context *ctx);
void bx_qp_store_free(batten_context *ctx, bx_qp_store *store);

/* count doubles of one value; NULL: out of memory. */
double *bx_qp_fill(batten_context *ctx, size_t count, double value);

/* Moves the names into *text and *list. */
batten_status bx_qp_take_names(bx_names *names, char **text, char ***list);

/* The whole as the public struct, which owns the store from now on; store->name is set to "" where there is none. */
batten_status bx_qp_finish(batten_context *ctx, bx_qp_store *store, size_t n, double constant, batten_qp_file *out);

/* From this size on a bound in QPS and MAT files is none: they write 1e20 or more, and some have subtracted something
 * from that. */
#define BX_QP_INFINITE 9e19

/* The readers. */
batten_status bx_read_qps(bx_reader *r, batten_qp_file *out);
batten_status bx_read_mat(bx_reader *r, batten_qp_file *out);
batten_status bx_load_qp(bx_reader *r, batten_qp_file *out);

/* x, multipliers and active into those arrays of out that are there; n unknowns, m rows. */
batten_status bx_load_qp_solution(bx_reader *r, size_t n, size_t m, const batten_qp_solution *out);

#endif
