/* What products and conjugate gradients share: the partition of the rows, fixed by the matrix alone, and the product
 * with some rows. */
#ifndef BATTEN_SPARSE_ROWS_H
#define BATTEN_SPARSE_ROWS_H

#include "block.h"

/* 8192 unknowns with some seven blocks a row: about 100 us of a product at memory's speed. */
static inline size_t block_part_rows(const block_matrix *a) { return 8192 / a->size; }
static inline size_t block_parts(const block_matrix *a) {
  return (a->rows + block_part_rows(a) - 1) / block_part_rows(a);
}
static inline void block_part(const block_matrix *a, size_t part, size_t *first, size_t *last) {
  *first = part * block_part_rows(a);
  *last = *first + block_part_rows(a) < a->rows ? *first + block_part_rows(a) : a->rows;
}

/* Rows first .. last - 1 of y = A x; returns their share of x'y. */
double block_rows_apply(const block_matrix *a, size_t first, size_t last, const double *x, double *y);

/* Calls body(constant, ...) for the block size in hand: the compiler makes straight code of each. */
#define BLOCK_FOR_SIZE(size, body, ...) \
  ((size) == 1   ? body(1, __VA_ARGS__) \
   : (size) == 2 ? body(2, __VA_ARGS__) \
   : (size) == 3 ? body(3, __VA_ARGS__) \
   : (size) == 4 ? body(4, __VA_ARGS__) \
   : (size) == 5 ? body(5, __VA_ARGS__) \
                 : body(6, __VA_ARGS__))

#if defined(__GNUC__)
#define BLOCK_INLINE static inline __attribute__((always_inline))
#else
#define BLOCK_INLINE static inline
#endif

#endif
