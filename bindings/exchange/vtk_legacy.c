/* VTK's files from before XML: .vtk, surfaces with fields and polylines, which every tool that knows of VTK reads.
 *
 * A header in text, then binary blocks, big endian whatever the machine: text would have no way to write NaN that all
 * readers take. */
#include "vtk.h"

static void put_big(bx_writer *w, uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) bx_put_u8(w, (uint8_t)(value >> shift));
}

void vtk_legacy_put_double(bx_writer *w, double value) {
  union {
    double number;
    uint64_t bits;
  } v = {value};
  put_big(w, v.bits, 8);
}

void vtk_legacy_put_int(bx_writer *w, size_t value) { put_big(w, value, 4); }

void vtk_legacy_begin(bx_writer *w, size_t points) {
  bx_print(w, "# vtk DataFile Version 3.0\nbatten %s\nBINARY\nDATASET POLYDATA\nPOINTS %zu double\n",
           batten_version(), points);
}

static void put_doubles(bx_writer *w, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) vtk_legacy_put_double(w, values[i]);
  bx_put_u8(w, '\n');
}

void bx_write_vtk(bx_writer *w, const batten_mesh *mesh) {
  size_t vertices = batten_mesh_vertex_count(mesh), triangles = batten_mesh_triangle_count(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  vtk_legacy_begin(w, vertices);
  put_doubles(w, batten_mesh_vertices(mesh), 3 * vertices);
  bx_print(w, "POLYGONS %zu %zu\n", triangles, 4 * triangles);
  for (size_t i = 0; i < triangles; i++) {
    vtk_legacy_put_int(w, 3);
    for (size_t c = 0; c < 3; c++) vtk_legacy_put_int(w, t[3 * i + c]);
  }
  bx_print(w, "\nPOINT_DATA %zu\nFIELD FieldData %zu\n", vertices, batten_mesh_field_count(mesh));
  for (size_t f = 0; f < batten_mesh_field_count(mesh); f++) {
    const char *name;
    size_t components;
    const double *values = batten_mesh_field(mesh, f, &name, &components);
    bx_put_word(w, name);
    bx_print(w, " %zu %zu double\n", components, vertices);
    put_doubles(w, values, components * vertices);
  }
}
