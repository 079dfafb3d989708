/* VTK's XML files, appended raw: .vtp (surfaces, lines) and .vtu (cells).
 *
 * <AppendedData encoding="raw">_ [8 bytes: size of the block][block] [8 bytes][block] ...
 * Each DataArray names the offset of its block behind the underscore. All arrays are doubles, Int64 or UInt8. */
#include "vtk.h"

#include <string.h>

/* A name as the value of an XML attribute. */
static void put_attribute(bx_writer *w, const char *text) {
  for (; *text; text++) {
    switch (*text) {
      case '&':
        bx_put_text(w, "&amp;");
        break;
      case '<':
        bx_put_text(w, "&lt;");
        break;
      case '>':
        bx_put_text(w, "&gt;");
        break;
      case '"':
        bx_put_text(w, "&quot;");
        break;
      default:
        bx_put_u8(w, (unsigned char)*text < ' ' ? (uint8_t)'_' : (uint8_t)*text);
    }
  }
}

void vtk_declare(vtk_file *v, const char *type, const char *name, size_t components, size_t tuples,
                 size_t item_size) {
  bx_print(v->w, "        <DataArray type=\"%s\" Name=\"", type);
  put_attribute(v->w, name);
  bx_print(v->w, "\" NumberOfComponents=\"%zu\" format=\"appended\" offset=\"%llu\"/>\n", components,
           (unsigned long long)v->offset);
  v->offset += sizeof(uint64_t) + (uint64_t)components * tuples * item_size;
}

void vtk_begin(vtk_file *v, const char *type) {
  bx_print(v->w,
           "<?xml version=\"1.0\"?>\n<VTKFile type=\"%s\" version=\"1.0\" byte_order=\"LittleEndian\" "
           "header_type=\"UInt64\">\n  <%s>\n",
           type, type);
}

void vtk_begin_appended(vtk_file *v, const char *type) {
  bx_print(v->w, "    </Piece>\n  </%s>\n  <AppendedData encoding=\"raw\">\n_", type);
}

void vtk_end(vtk_file *v) { bx_put_text(v->w, "\n  </AppendedData>\n</VTKFile>\n"); }

static void put_doubles(vtk_file *v, const double *values, size_t count) {
  bx_put_u64(v->w, (uint64_t)count * sizeof(double));
  for (size_t i = 0; i < count; i++) bx_put_f64(v->w, values[i]);
}

static void declare_points_and_fields(vtk_file *v, const batten_mesh *mesh) {
  size_t count = batten_mesh_vertex_count(mesh);
  bx_put_text(v->w, "      <Points>\n");
  vtk_declare(v, "Float64", "Points", 3, count, sizeof(double));
  bx_put_text(v->w, "      </Points>\n      <PointData>\n");
  for (size_t f = 0; f < batten_mesh_field_count(mesh); f++) {
    const char *name;
    size_t components;
    batten_mesh_field(mesh, f, &name, &components);
    vtk_declare(v, "Float64", name, components, count, sizeof(double));
  }
  bx_put_text(v->w, "      </PointData>\n");
}

static void put_points_and_fields(vtk_file *v, const batten_mesh *mesh) {
  size_t count = batten_mesh_vertex_count(mesh);
  put_doubles(v, batten_mesh_vertices(mesh), 3 * count);
  for (size_t f = 0; f < batten_mesh_field_count(mesh); f++) {
    size_t components;
    const double *values = batten_mesh_field(mesh, f, NULL, &components);
    put_doubles(v, values, count * components);
  }
}

static void put_triangles(vtk_file *v, const batten_mesh *mesh) {
  size_t count = batten_mesh_triangle_count(mesh);
  const uint32_t *t = batten_mesh_triangles(mesh);
  bx_put_u64(v->w, (uint64_t)count * 3 * sizeof(int64_t));
  for (size_t i = 0; i < 3 * count; i++) bx_put_u64(v->w, t[i]);
  bx_put_u64(v->w, (uint64_t)count * sizeof(int64_t));
  for (size_t i = 0; i < count; i++) bx_put_u64(v->w, 3 * ((uint64_t)i + 1));
}

void bx_write_vtp(bx_writer *w, const batten_mesh *mesh) {
  vtk_file v = {.w = w};
  size_t triangles = batten_mesh_triangle_count(mesh);
  vtk_begin(&v, "PolyData");
  bx_print(w,
           "    <Piece NumberOfPoints=\"%zu\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
           "NumberOfPolys=\"%zu\">\n",
           batten_mesh_vertex_count(mesh), triangles);
  declare_points_and_fields(&v, mesh);
  bx_put_text(w, "      <Polys>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, 3 * triangles, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, triangles, sizeof(int64_t));
  bx_put_text(w, "      </Polys>\n");
  vtk_begin_appended(&v, "PolyData");
  put_points_and_fields(&v, mesh);
  put_triangles(&v, mesh);
  vtk_end(&v);
}

void bx_write_vtu(bx_writer *w, const batten_mesh *mesh) {
  enum { VTK_TRIANGLE = 5 };
  vtk_file v = {.w = w};
  size_t triangles = batten_mesh_triangle_count(mesh);
  vtk_begin(&v, "UnstructuredGrid");
  bx_print(w, "    <Piece NumberOfPoints=\"%zu\" NumberOfCells=\"%zu\">\n", batten_mesh_vertex_count(mesh),
           triangles);
  declare_points_and_fields(&v, mesh);
  bx_put_text(w, "      <Cells>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, 3 * triangles, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, triangles, sizeof(int64_t));
  vtk_declare(&v, "UInt8", "types", 1, triangles, 1);
  bx_put_text(w, "      </Cells>\n");
  vtk_begin_appended(&v, "UnstructuredGrid");
  put_points_and_fields(&v, mesh);
  put_triangles(&v, mesh);
  bx_put_u64(w, triangles);
  for (size_t i = 0; i < triangles; i++) bx_put_u8(w, VTK_TRIANGLE);
  vtk_end(&v);
}
