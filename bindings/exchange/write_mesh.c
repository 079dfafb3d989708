/* Meshes as PLY, OBJ, OFF and STL; VTK's are in vtk.c and vtk_legacy.c.
 *
 * PLY is binary little endian with doubles and all fields of the mesh; a field of several components becomes NAME_0,
 * NAME_1, ... OBJ, OFF and STL hold the shape alone, STL in single precision with the facets' normals. */
#include "format.h"
#include "number.h"
#include "write.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

void bx_put_number(bx_writer *w, double value) {
  char text[BX_NUMBER_SIZE];
  bx_put(w, text, (size_t)bx_format_number(value, text));
}

void bx_put_numbers(bx_writer *w, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) {
    if (i) bx_put_u8(w, ' ');
    bx_put_number(w, values[i]);
  }
}

void bx_put_word(bx_writer *w, const char *name) {
  for (; *name; name++) bx_put_u8(w, *name > ' ' && *name < 0x7f ? (uint8_t)*name : (uint8_t)'_');
}

static void put_ply_header(bx_writer *w, const batten_mesh *mesh) {
  bx_put_text(w, "ply\nformat binary_little_endian 1.0\n");
  bx_print(w, "comment batten %s\n", batten_version());
  bx_print(w, "element vertex %zu\nproperty double x\nproperty double y\nproperty double z\n",
           batten_mesh_vertex_count(mesh));
  for (size_t f = 0; f < batten_mesh_field_count(mesh); f++) {
    const char *name;
    size_t components;
    batten_mesh_field(mesh, f, &name, &components);
    for (size_t c = 0; c < components; c++) {
      bx_put_text(w, "property double ");
      bx_put_word(w, name);
      if (components > 1) bx_print(w, "_%zu", c);
      bx_put_text(w, "\n");
    }
  }
  bx_print(w, "element face %zu\nproperty list uchar uint vertex_indices\nend_header\n",
           batten_mesh_triangle_count(mesh));
}

static void write_ply(bx_writer *w, const batten_mesh *mesh) {
  const double *x = batten_mesh_vertices(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  put_ply_header(w, mesh);
  for (size_t i = 0; i < batten_mesh_vertex_count(mesh); i++) {
    for (int c = 0; c < 3; c++) bx_put_f64(w, x[3 * i + (size_t)c]);
    for (size_t f = 0; f < batten_mesh_field_count(mesh); f++) {
      size_t components;
      const double *values = batten_mesh_field(mesh, f, NULL, &components);
      for (size_t c = 0; c < components; c++) bx_put_f64(w, values[i * components + c]);
    }
  }
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh); i++) {
    bx_put_u8(w, 3);
    for (int c = 0; c < 3; c++) bx_put_u32(w, t[3 * i + (size_t)c]);
  }
}

/* prefix, three numbers, end of line, for each vertex */
static void put_vertices(bx_writer *w, const batten_mesh *mesh, const char *prefix) {
  const double *x = batten_mesh_vertices(mesh);
  for (size_t i = 0; i < batten_mesh_vertex_count(mesh); i++) {
    bx_put_text(w, prefix);
    bx_put_numbers(w, x + 3 * i, 3);
    bx_put_u8(w, '\n');
  }
}

static void write_obj(bx_writer *w, const batten_mesh *mesh) {
  const uint32_t *t = batten_mesh_triangles(mesh);
  bx_print(w, "# batten %s\n", batten_version());
  put_vertices(w, mesh, "v ");
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh); i++)
    bx_print(w, "f %llu %llu %llu\n", t[3 * i] + 1ull, t[3 * i + 1] + 1ull, t[3 * i + 2] + 1ull);
}

static void write_off(bx_writer *w, const batten_mesh *mesh) {
  const uint32_t *t = batten_mesh_triangles(mesh);
  bx_print(w, "OFF\n%zu %zu 0\n", batten_mesh_vertex_count(mesh), batten_mesh_triangle_count(mesh));
  put_vertices(w, mesh, "");
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh); i++)
    bx_print(w, "3 %lu %lu %lu\n", (unsigned long)t[3 * i], (unsigned long)t[3 * i + 1], (unsigned long)t[3 * i + 2]);
}

/* Unit normal of a triangle; 0 where it has no area. Scaled, so that small triangles have one too. */
static void facet_normal(const double *a, const double *b, const double *c, double normal[3]) {
  double u[3], v[3], scale = 0;
  for (int i = 0; i < 3; i++) {
    u[i] = b[i] - a[i];
    v[i] = c[i] - a[i];
    scale = fmax(scale, fmax(fabs(u[i]), fabs(v[i])));
  }
  for (int i = 0; scale > 0 && i < 3; i++) {
    u[i] /= scale;
    v[i] /= scale;
  }
  normal[0] = u[1] * v[2] - u[2] * v[1];
  normal[1] = u[2] * v[0] - u[0] * v[2];
  normal[2] = u[0] * v[1] - u[1] * v[0];
  double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
  for (int i = 0; i < 3; i++) normal[i] = length > 0 ? normal[i] / length : 0;
}

static batten_status check_stl(batten_context *ctx, const batten_mesh *mesh, const char *path) {
  if (batten_mesh_triangle_count(mesh) > UINT32_MAX)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%s: STL counts triangles in 32 bits; write .ply",
                       bx_short_path(path));
  const double *x = batten_mesh_vertices(mesh);
  for (size_t i = 0; i < 3 * batten_mesh_vertex_count(mesh); i++)
    if (!(fabs(x[i]) <= (double)FLT_MAX))
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "%s: vertices[%zu]: %g is too large for the single precision of STL; "
                         "write .ply",
                         bx_short_path(path), i / 3, x[i]);
  return BATTEN_OK;
}

static batten_status check_vtk(batten_context *ctx, const batten_mesh *mesh, const char *path) {
  if (batten_mesh_vertex_count(mesh) <= INT32_MAX) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%s: .vtk counts vertices in 31 bits; write .vtp", bx_short_path(path));
}

static void write_stl(bx_writer *w, const batten_mesh *mesh) {
  const double *x = batten_mesh_vertices(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  char head[80] = "batten: binary STL"; /* not "solid", which would look like text */
  bx_put(w, head, sizeof head);
  bx_put_u32(w, (uint32_t)batten_mesh_triangle_count(mesh));
  for (size_t i = 0; i < batten_mesh_triangle_count(mesh); i++) {
    float corners[3][3];
    double rounded[3][3], normal[3]; /* the normal of the triangle that the file holds */
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++) {
        corners[c][k] = (float)x[3 * (size_t)t[3 * i + (size_t)c] + (size_t)k];
        rounded[c][k] = (double)corners[c][k];
      }
    facet_normal(rounded[0], rounded[1], rounded[2], normal);
    for (int k = 0; k < 3; k++) bx_put_f32(w, (float)normal[k]);
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++) bx_put_f32(w, corners[c][k]);
    bx_put_u16(w, 0);
  }
}

batten_status batten_write_mesh(batten_context *ctx, const batten_mesh *mesh, const char *path) {
  batten_status st = bx_check_pointers(ctx, path, mesh, "mesh");
  if (st != BATTEN_OK) return st;
  bx_format format = bx_format_of(path, NULL);
  void (*write)(bx_writer *, const batten_mesh *) = format == BX_PLY   ? write_ply
                                                    : format == BX_OBJ ? write_obj
                                                    : format == BX_OFF ? write_off
                                                    : format == BX_STL ? write_stl
                                                    : format == BX_VTP ? bx_write_vtp
                                                    : format == BX_VTU ? bx_write_vtu
                                                    : format == BX_VTK ? bx_write_vtk
                                                                       : NULL;
  if (!write)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: meshes are written as .ply .obj .off .stl .vtp .vtu .vtk; rename the file",
                       bx_short_path(path));
  if (format == BX_STL) st = check_stl(ctx, mesh, path);
  if (format == BX_VTK) st = check_vtk(ctx, mesh, path);
  if (st != BATTEN_OK) return st;
  bx_writer w;
  st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  write(&w, mesh);
  return bx_commit(&w);
}
