/* Networks as VTK's XML unstructured grid of Bezier triangles (cell type 76, VTK 9 and later).
 *
 * A cell lists its control points in shells: the three corners, then the sides 0-1, 1-2, 2-0 without their ends, then
 * the same for the triangle of degree n - 3 inside. Patches share no points: edges of different degree may meet. */
#include "network.h"
#include "vtk.h"

/* Order [size] of VTK as indices into the library's order; returns the size. */
size_t bx_vtk_triangle_order(unsigned degree, unsigned order[]) {
  size_t count = 0;
  unsigned n = degree;
  for (unsigned shell = 0; 3 * shell <= n; shell++) {
    unsigned inner = n - 3 * shell; /* steps along a side of the shell */
    for (unsigned corner = 0; corner < (inner ? 3u : 1u); corner++) {
      unsigned j = shell + (corner == 1 ? inner : 0), k = shell + (corner == 2 ? inner : 0);
      order[count++] = k * (2 * n + 3 - k) / 2 + j;
    }
    for (unsigned side = 0; side < 3; side++)
      for (unsigned i = 1; i < inner; i++) {
        unsigned j = shell + (side == 0 ? i : side == 1 ? inner - i : 0);
        unsigned k = shell + (side == 0 ? 0 : side == 1 ? i : inner - i);
        order[count++] = k * (2 * n + 3 - k) / 2 + j;
      }
  }
  return count;
}

static size_t points_of(const batten_network_patch *patch) {
  return (size_t)(patch->degree + 1) * (patch->degree + 2) / 2;
}

static void put_points(bx_writer *w, const batten_network *network, size_t total) {
  enum { MOST = 13 * 14 / 2 };
  unsigned order[MOST];
  bx_put_u64(w, (uint64_t)total * 3 * sizeof(double));
  for (size_t p = 0; p < batten_network_patch_count(network); p++) {
    batten_network_patch patch = batten_network_get_patch(network, p);
    size_t count = bx_vtk_triangle_order(patch.degree, order);
    for (size_t i = 0; i < count; i++)
      for (size_t x = 0; x < 3; x++) bx_put_f64(w, patch.control_points[3 * order[i] + x]);
  }
}

void bx_write_vtu_network(bx_writer *w, const batten_network *network) {
  enum { VTK_BEZIER_TRIANGLE = 76 };
  vtk_file v = {.w = w};
  size_t patches = batten_network_patch_count(network), points = 0;
  for (size_t p = 0; p < patches; p++) {
    batten_network_patch patch = batten_network_get_patch(network, p);
    points += points_of(&patch);
  }
  vtk_begin(&v, "UnstructuredGrid");
  bx_print(w, "    <Piece NumberOfPoints=\"%zu\" NumberOfCells=\"%zu\">\n      <Points>\n", points, patches);
  vtk_declare(&v, "Float64", "Points", 3, points, sizeof(double));
  bx_put_text(w, "      </Points>\n      <CellData>\n");
  vtk_declare(&v, "Int64", "face", 1, patches, sizeof(int64_t));
  vtk_declare(&v, "UInt8", "part", 1, patches, 1);
  bx_put_text(w, "      </CellData>\n      <Cells>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, points, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, patches, sizeof(int64_t));
  vtk_declare(&v, "UInt8", "types", 1, patches, 1);
  bx_put_text(w, "      </Cells>\n");
  vtk_begin_appended(&v, "UnstructuredGrid");
  put_points(w, network, points);
  bx_put_u64(w, (uint64_t)patches * sizeof(int64_t));
  for (size_t p = 0; p < patches; p++) bx_put_u64(w, batten_network_get_patch(network, p).face);
  bx_put_u64(w, patches);
  for (size_t p = 0; p < patches; p++) bx_put_u8(w, (uint8_t)batten_network_get_patch(network, p).part);
  bx_put_u64(w, (uint64_t)points * sizeof(int64_t));
  for (size_t i = 0; i < points; i++) bx_put_u64(w, i);
  bx_put_u64(w, (uint64_t)patches * sizeof(int64_t));
  uint64_t offset = 0;
  for (size_t p = 0; p < patches; p++) {
    batten_network_patch patch = batten_network_get_patch(network, p);
    bx_put_u64(w, offset += points_of(&patch));
  }
  bx_put_u64(w, patches);
  for (size_t p = 0; p < patches; p++) bx_put_u8(w, VTK_BEZIER_TRIANGLE);
  vtk_end(&v);
}
