/* Growing arrays of vertices, triangles and fields: see soup.h. */
#include "soup.h"

#include "base/checked.h"

#include <string.h>

void bx_soup_free(bx_soup *soup) {
  batten_free(soup->ctx, soup->vertices);
  batten_free(soup->ctx, soup->normals);
  batten_free(soup->ctx, soup->parameters);
  batten_free(soup->ctx, soup->weights);
  batten_free(soup->ctx, soup->triangles);
  batten_free(soup->ctx, soup->field_names);
  batten_free(soup->ctx, soup->field_values);
  *soup = (bx_soup){.ctx = soup->ctx};
}

batten_status bx_grow(batten_context *ctx, void **array, size_t *capacity, size_t need, size_t item_size) {
  if (need <= *capacity) return BATTEN_OK;
  size_t wanted;
  if (!batten_mul(*capacity, 2, &wanted) || wanted < need) wanted = need;
  if (wanted < 64) wanted = 64;
  void *grown = batten_realloc_array(ctx, *array, wanted, item_size);
  if (!grown) return BATTEN_E_NOMEM;
  *array = grown;
  *capacity = wanted;
  return BATTEN_OK;
}

/* Appends `width` doubles to a matrix that has `rows` rows; capacity is counted in doubles. */
static batten_status append_row(batten_context *ctx, double **matrix, size_t *capacity, size_t rows, size_t width,
                                const double *row) {
  size_t used, need;
  if (!batten_mul(rows, width, &used) || !batten_add(used, width, &need))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu rows of %zu numbers", rows, width);
  void *grown = *matrix;
  batten_status st = bx_grow(ctx, &grown, capacity, need, sizeof **matrix);
  *matrix = grown;
  if (st == BATTEN_OK) memcpy(*matrix + used, row, width * sizeof *row);
  return st;
}

batten_status bx_add_vertex(bx_soup *soup, const double *x) {
  if (soup->vertex_count >= UINT32_MAX)
    return batten_fail(soup->ctx, BATTEN_E_TOO_LARGE, "more than %lu vertices", (unsigned long)UINT32_MAX);
  batten_status st = append_row(soup->ctx, &soup->vertices, &soup->vertex_capacity, soup->vertex_count, soup->n, x);
  if (st == BATTEN_OK) soup->vertex_count++;
  return st;
}

batten_status bx_add_normal(bx_soup *soup, const double *x) {
  batten_status st = append_row(soup->ctx, &soup->normals, &soup->normal_capacity, soup->normal_count, soup->n, x);
  if (st == BATTEN_OK) soup->normal_count++;
  return st;
}

batten_status bx_add_parameters(bx_soup *soup, const double *x) {
  batten_status st = append_row(soup->ctx, &soup->parameters, &soup->parameter_capacity, soup->parameter_count, 2, x);
  if (st == BATTEN_OK) soup->parameter_count++;
  return st;
}

batten_status bx_add_weight(bx_soup *soup, double x) {
  batten_status st = append_row(soup->ctx, &soup->weights, &soup->weight_capacity, soup->weight_count, 1, &x);
  if (st == BATTEN_OK) soup->weight_count++;
  return st;
}

batten_status bx_add_field(bx_soup *soup, const char *name, size_t length) {
  void *names = soup->field_names;
  batten_status st = bx_grow(soup->ctx, &names, &soup->field_capacity, soup->field_count + 1, BX_NAME_SIZE);
  soup->field_names = names;
  if (st != BATTEN_OK) return st;
  size_t kept = length < BX_NAME_SIZE ? length : BX_NAME_SIZE - 1;
  char *to = soup->field_names[soup->field_count++];
  memcpy(to, name, kept);
  to[kept] = '\0';
  return BATTEN_OK;
}

batten_status bx_add_field_row(bx_soup *soup, const double *values) {
  if (soup->field_count == 0) return BATTEN_OK;
  batten_status st = append_row(soup->ctx, &soup->field_values, &soup->field_value_capacity, soup->field_rows,
                                soup->field_count, values);
  if (st == BATTEN_OK) soup->field_rows++;
  return st;
}

void bx_begin_polygon(bx_soup *soup) { soup->corners = 0; }

batten_status bx_add_corner(bx_soup *soup, uint32_t vertex) {
  soup->corners++;
  if (soup->corners == 1) soup->first = vertex;
  if (soup->corners >= 3 && soup->want_triangles) {
    void *grown = soup->triangles;
    batten_status st =
        bx_grow(soup->ctx, &grown, &soup->triangle_capacity, soup->triangle_count + 1, 3 * sizeof *soup->triangles);
    soup->triangles = grown;
    if (st != BATTEN_OK) return st;
    uint32_t *t = soup->triangles + 3 * soup->triangle_count++;
    t[0] = soup->first;
    t[1] = soup->last;
    t[2] = vertex;
  }
  soup->last = vertex;
  return BATTEN_OK;
}
