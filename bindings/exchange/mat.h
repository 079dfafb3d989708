/* MATLAB's level 5 files [MathWorks, MAT-File Format]: numeric and sparse variables, one after the other, plain or
 * compressed, of either byte order. Memory grows with the data that come, whatever sizes are declared. */
#ifndef BATTEN_EXCHANGE_MAT_H
#define BATTEN_EXCHANGE_MAT_H

#include "stream.h"

enum { MAT_NAME_SIZE = 64 }; /* MATLAB's own limit is 63 characters */

typedef struct mat_reader {
  bx_reader *r;
  bool big_endian;
  /* the variable at hand */
  char name[MAT_NAME_SIZE];
  /* inside */
  uint64_t left;   /* bytes of the element that are still in the file */
  uint64_t inside; /* bytes of the variable's parts that are still to come */
  bool compressed, inflating, inflated;
  z_stream zip;
  unsigned char *packed; /* window on the compressed bytes */
} mat_reader;

/* A real matrix: values column by column, all of them or, sparse, those with their rows and the columns' starts. */
typedef struct mat_matrix {
  size_t rows, columns;
  bool sparse;
  double *values; /* [count] */
  double *row_of; /* [count] sparse: whole numbers >= 0, below rows */
  double *starts; /* [columns + 1] sparse: whole numbers, not decreasing, from 0 to count */
  size_t count;
} mat_matrix;

/* Reads the header. On failure nothing is left; afterwards mat_end. */
batten_status mat_begin(mat_reader *m, bx_reader *r);
void mat_end(mat_reader *m);

/* Goes to the next variable that wanted() knows by name and reads it; *end instead when there is none. */
batten_status mat_next(mat_reader *m, bool (*wanted)(const char *name), mat_matrix *out, bool *end);
void mat_free(batten_context *ctx, mat_matrix *matrix);

batten_status mat_fail(mat_reader *m, const char *format, ...) BATTEN_PRINTF(2, 3);

#endif
