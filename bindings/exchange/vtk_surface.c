/* Surfaces as VTK's XML unstructured grid of Bezier quadrilaterals (cell type 77, VTK 9 and later), one a span pair.
 *
 * A cell lists its control points by dimension: the corners (0, 0), (1, 0), (1, 1), (0, 1); the inner ones of the
 * sides v = 0, u = 1, v = 1, u = 0, each in the direction of its parameter; then those inside, u running faster. The
 * degrees are in a cell array that the grid names as its HigherOrderDegrees: with it they may differ. */
#include "surface.h"
#include "vtk.h"

size_t bx_vtk_quadrilateral_order(unsigned p, unsigned q, unsigned order[]) {
  const unsigned width = q + 1;
  size_t count = 0;
  order[count++] = 0;
  order[count++] = p * width;
  order[count++] = p * width + q;
  order[count++] = q;
  for (unsigned i = 1; i < p; i++) order[count++] = i * width;
  for (unsigned j = 1; j < q; j++) order[count++] = p * width + j;
  for (unsigned i = 1; i < p; i++) order[count++] = i * width + q;
  for (unsigned j = 1; j < q; j++) order[count++] = j;
  for (unsigned j = 1; j < q; j++)
    for (unsigned i = 1; i < p; i++) order[count++] = i * width + j;
  return count;
}

static void put_points(bx_writer *w, const batten_surface_form *form, size_t cells) {
  unsigned order[BX_SPAN_MAX];
  double points[BX_SPAN_MAX][3];
  size_t count = bx_vtk_quadrilateral_order(form->degree[0], form->degree[1], order), mu[2], done = 0;
  size_t end[2] = {bx_form_points(form, 0), bx_form_points(form, 1)};
  bx_put_u64(w, (uint64_t)cells * count * 3 * sizeof(double));
  for (mu[0] = bx_next_span(form, 0, 0); mu[0] < end[0]; mu[0] = bx_next_span(form, 0, mu[0]))
    for (mu[1] = bx_next_span(form, 1, 0); mu[1] < end[1] && bx_goes_on(w, done, cells); done++) {
      bx_span_points(form, (const size_t *)mu, points);
      for (size_t i = 0; i < count; i++)
        for (size_t x = 0; x < 3; x++) bx_put_f64(w, points[order[i]][x]);
      mu[1] = bx_next_span(form, 1, mu[1]);
    }
}

/* The domain's rectangle of every cell: lower and upper end in u, in v. */
static void put_domains(bx_writer *w, const batten_surface_form *form, size_t cells) {
  size_t end[2] = {bx_form_points(form, 0), bx_form_points(form, 1)};
  bx_put_u64(w, (uint64_t)cells * 4 * sizeof(double));
  for (size_t i = bx_next_span(form, 0, 0); i < end[0]; i = bx_next_span(form, 0, i))
    for (size_t j = bx_next_span(form, 1, 0); j < end[1]; j = bx_next_span(form, 1, j)) {
      bx_put_f64(w, form->knots[0][i]);
      bx_put_f64(w, form->knots[0][i + 1]);
      bx_put_f64(w, form->knots[1][j]);
      bx_put_f64(w, form->knots[1][j + 1]);
    }
}

void bx_write_vtu_surface(bx_writer *w, const batten_surface_form *form) {
  enum { VTK_BEZIER_QUADRILATERAL = 77 };
  vtk_file v = {.w = w};
  size_t cells = bx_span_count(form, 0) * bx_span_count(form, 1);
  size_t each = ((size_t)form->degree[0] + 1) * (form->degree[1] + 1), points = cells * each;
  vtk_begin(&v, "UnstructuredGrid");
  bx_print(w, "    <Piece NumberOfPoints=\"%zu\" NumberOfCells=\"%zu\">\n      <Points>\n", points, cells);
  vtk_declare(&v, "Float64", "Points", 3, points, sizeof(double));
  bx_put_text(w, "      </Points>\n      <CellData HigherOrderDegrees=\"HigherOrderDegrees\">\n");
  vtk_declare(&v, "Float64", "HigherOrderDegrees", 3, cells, sizeof(double));
  vtk_declare(&v, "Float64", "domain", 4, cells, sizeof(double));
  bx_put_text(w, "      </CellData>\n      <Cells>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, points, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, cells, sizeof(int64_t));
  vtk_declare(&v, "UInt8", "types", 1, cells, 1);
  bx_put_text(w, "      </Cells>\n");
  vtk_begin_appended(&v, "UnstructuredGrid");
  put_points(w, form, cells);
  bx_put_u64(w, (uint64_t)cells * 3 * sizeof(double));
  for (size_t c = 0; c < cells; c++) {
    bx_put_f64(w, form->degree[0]);
    bx_put_f64(w, form->degree[1]);
    bx_put_f64(w, 0);
  }
  put_domains(w, form, cells);
  bx_put_u64(w, (uint64_t)points * sizeof(int64_t));
  for (size_t i = 0; i < points; i++) bx_put_u64(w, i);
  bx_put_u64(w, (uint64_t)cells * sizeof(int64_t));
  for (size_t c = 1; c <= cells; c++) bx_put_u64(w, c * each);
  bx_put_u64(w, cells);
  for (size_t c = 0; c < cells; c++) bx_put_u8(w, VTK_BEZIER_QUADRILATERAL);
  vtk_end(&v);
}
