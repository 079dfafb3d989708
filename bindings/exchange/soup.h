/* What the readers of point and mesh files fill: vertices, perhaps normals, triangles and numbers at the vertices.
 * Everything grows with what has been read, never with what a header declares. */
#ifndef BATTEN_EXCHANGE_SOUP_H
#define BATTEN_EXCHANGE_SOUP_H

#include "stream.h"

#include <batten/base.h>

enum { BX_NAME_SIZE = 64 };

typedef struct bx_soup {
  batten_context *ctx;
  bool want_triangles; /* else faces are checked but not kept */
  unsigned n;          /* coordinates of a vertex, 2 or 3 */
  size_t vertex_count, vertex_capacity;
  double *vertices; /* [vertex_count][n] */
  size_t normal_count, normal_capacity;
  double *normals; /* [normal_count][n]; of use when normal_count == vertex_count */
  size_t parameter_count, parameter_capacity;
  double *parameters; /* [parameter_count][2]; as the normals */
  size_t weight_count, weight_capacity;
  double *weights; /* [weight_count] */
  size_t triangle_count, triangle_capacity;
  uint32_t *triangles; /* [triangle_count][3] */
  /* numbers at the vertices */
  size_t field_count, field_capacity;
  char (*field_names)[BX_NAME_SIZE];
  double *field_values; /* [field_rows][field_count] */
  size_t field_rows, field_value_capacity;
  /* the polygon that is being cut into a fan */
  size_t corners;
  uint32_t first, last;
} bx_soup;

void bx_soup_free(bx_soup *soup);

/* Makes *array (of *capacity items) hold `need` items, at least doubling it. */
batten_status bx_grow(batten_context *ctx, void **array, size_t *capacity, size_t need, size_t item_size);

batten_status bx_add_vertex(bx_soup *soup, const double *x);     /* [n] */
batten_status bx_add_normal(bx_soup *soup, const double *x);     /* [n] */
batten_status bx_add_parameters(bx_soup *soup, const double *x); /* [2] */
batten_status bx_add_weight(bx_soup *soup, double x);
batten_status bx_add_field(bx_soup *soup, const char *name, size_t length);
batten_status bx_add_field_row(bx_soup *soup, const double *values); /* [field_count] */

/* A polygon, corner by corner; it becomes the fan around its first corner. */
void bx_begin_polygon(bx_soup *soup);
batten_status bx_add_corner(bx_soup *soup, uint32_t vertex);

/* The readers. Vertices of STL are welded; want_triangles false leaves faces out. */
batten_status bx_read_text(bx_reader *r, bx_soup *soup, unsigned n); /* n = 0: as the columns say */
batten_status bx_read_ply(bx_reader *r, bx_soup *soup);
batten_status bx_read_obj(bx_reader *r, bx_soup *soup);
batten_status bx_read_off(bx_reader *r, bx_soup *soup);
/* The head alone. */
batten_status bx_read_off_counts(bx_reader *r, int64_t *vertices, int64_t *faces);
batten_status bx_read_stl(bx_reader *r, bx_soup *soup);

#endif
