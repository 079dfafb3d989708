/* What the writers of VTK's XML files share: see vtk.c for the layout. */
#ifndef BATTEN_EXCHANGE_VTK_H
#define BATTEN_EXCHANGE_VTK_H

#include "write.h"

typedef struct vtk_file {
  bx_writer *w;
  uint64_t offset; /* of the next array that is declared */
} vtk_file;

/* Up to the opening of the data set's element. */
void vtk_begin(vtk_file *v, const char *type);
/* One array, appended in the order of the declarations: 8 bytes with its size, then its items. */
void vtk_declare(vtk_file *v, const char *type, const char *name, size_t components, size_t tuples, size_t item_size);
void vtk_begin_appended(vtk_file *v, const char *type);
void vtk_end(vtk_file *v);

/* ---- files from before XML: see vtk_legacy.c --------------------------------------------------------- */

/* Up to the points, of which there are so many. */
void vtk_legacy_begin(bx_writer *w, size_t points);
void vtk_legacy_put_double(bx_writer *w, double value);
/* 32 bits. */
void vtk_legacy_put_int(bx_writer *w, size_t value);

#endif
