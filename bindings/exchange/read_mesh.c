/* Triangle meshes from files: the format's reader fills a soup, which becomes a mesh with fields. */
#include "format.h"
#include "soup.h"

#include <string.h>

static batten_status check_mesh(bx_reader *r, const bx_soup *soup) {
  if (soup->n != 3)
    return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s: the vertices have x and y only; a mesh needs z",
                       bx_short_path(r->path));
  if (soup->triangle_count == 0)
    return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s: no faces in the file; read it as points",
                       bx_short_path(r->path));
  return BATTEN_OK;
}

static batten_status add_column(batten_context *ctx, batten_mesh *mesh, const char *name, size_t count,
                                const double *values, size_t stride) {
  double *column = batten_alloc_array(ctx, count, sizeof *column);
  if (!column) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) column[i] = values[i * stride];
  batten_status st = batten_mesh_set_field(ctx, mesh, name, 1, column);
  batten_free(ctx, column);
  return st;
}

static batten_status add_normals(batten_context *ctx, batten_mesh *mesh, const bx_soup *soup) {
  static const char *const names[] = {"nx", "ny", "nz"};
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < 3; i++)
    st = add_column(ctx, mesh, names[i], soup->vertex_count, soup->normals + i, 3);
  return st;
}

batten_status bx_read_mesh_from(bx_reader *r, bx_format format, batten_mesh **out) {
  bx_soup soup = {.ctx = r->ctx, .want_triangles = true};
  batten_mesh *mesh = NULL;
  batten_status st = format == BX_PLY   ? bx_read_ply(r, &soup)
                     : format == BX_OBJ ? bx_read_obj(r, &soup)
                     : format == BX_OFF ? bx_read_off(r, &soup)
                                        : bx_read_stl(r, &soup);
  if (st == BATTEN_OK) st = check_mesh(r, &soup);
  if (st == BATTEN_OK)
    st = batten_mesh_create(r->ctx, soup.vertex_count, soup.vertices, soup.triangle_count, soup.triangles, &mesh);
  if (st == BATTEN_OK && soup.normal_count == soup.vertex_count) st = add_normals(r->ctx, mesh, &soup);
  for (size_t i = 0; st == BATTEN_OK && i < soup.field_count; i++)
    st = add_column(r->ctx, mesh, soup.field_names[i], soup.vertex_count, soup.field_values + i, soup.field_count);
  bx_soup_free(&soup);
  if (st == BATTEN_OK)
    *out = mesh;
  else
    batten_mesh_free(mesh);
  return st;
}

batten_status batten_read_mesh(batten_context *ctx, const char *path, batten_mesh **out) {
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st != BATTEN_OK) return st;
  bool gz;
  bx_format format = bx_format_of(path, &gz);
  if (format < BX_PLY || format > BX_STL)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: meshes are read from .ply .obj .off .stl, each also with .gz; "
                       "rename the file",
                       bx_short_path(path));
  bx_reader r;
  st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_read_mesh_from(&r, format, out);
  bx_close(&r);
  return st;
}
