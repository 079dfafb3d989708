/* VTK's files from before XML: .vtk, surfaces with fields, which every tool that knows of VTK reads.
 *
 * A header in text, then binary blocks, big endian whatever the machine: text would have no way to write NaN that all
 * readers take. */
#include "write.h"

static void put_big(bx_writer *w, uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) bx_put_u8(w, (uint8_t)(value >> shift));
}

static void put_doubles(bx_writer *w, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) {
    union {
      double number;
      uint64_t bits;
    } v = {values[i]};
    put_big(w, v.bits, 8);
  }
  bx_put_text(w, "\n");
}

void bx_write_vtk(bx_writer *w, const batten_mesh *mesh) {
  size_t vertices = batten_mesh_vertex_count(mesh), triangles = batten_mesh_triangle_count(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  bx_print(w, "# vtk DataFile Version 3.0\nbatten %s\nBINARY\nDATASET POLYDATA\nPOINTS %zu double\n",
           batten_version(), vertices);
  put_doubles(w, batten_mesh_vertices(mesh), 3 * vertices);
  bx_print(w, "POLYGONS %zu %zu\n", triangles, 4 * triangles);
  for (size_t i = 0; i < triangles; i++) {
    put_big(w, 3, 4);
    for (size_t c = 0; c < 3; c++) put_big(w, t[3 * i + c], 4);
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
