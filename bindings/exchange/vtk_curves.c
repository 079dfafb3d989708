/* Planar curves for VTK: Bezier curves (cell type 75, VTK 9 and later), one a span, and polylines.
 *
 * A cell lists its control points by dimension: both ends, then the inner ones. The degrees are in a cell array that
 * the grid names as its HigherOrderDegrees. */
#include "curves.h"
#include "spans.h"
#include "vtk.h"

#include <string.h>

typedef struct counts {
  size_t cells, points;
} counts;

static counts count_cells(const bx_curve_set *set) {
  counts c = {0};
  for (size_t i = 0; i < set->count; i++) {
    batten_curve_form form = batten_curve_get(set->curves[i]);
    size_t spans = bx_knot_spans(form.degree, bx_curve_points(&form), form.knots);
    c.cells += spans;
    c.points += spans * (form.degree + 1);
  }
  return c;
}

/* Calls put for every span. */
typedef void span_put(bx_writer *w, const bx_curve_set *set, size_t i, const batten_curve_form *form, size_t mu,
                      uint64_t *state);

static void put_spans(bx_writer *w, const bx_curve_set *set, span_put *put) {
  uint64_t state = 0;
  for (size_t i = 0; i < set->count && bx_goes_on(w, i, set->count); i++) {
    batten_curve_form form = batten_curve_get(set->curves[i]);
    size_t count = bx_curve_points(&form);
    for (size_t mu = bx_knot_span(form.degree, count, form.knots, 0); mu < count;
         mu = bx_knot_span(form.degree, count, form.knots, mu))
      put(w, set, i, &form, mu, &state);
  }
}

static void put_point(bx_writer *w, const double point[3]) {
  for (int k = 0; k < 3; k++) bx_put_f64(w, point[k]);
}

static void put_points(bx_writer *w, const bx_curve_set *set, size_t i, const batten_curve_form *form, size_t mu,
                       uint64_t *state) {
  double line[BX_SPAN_DEGREE + 1][3];
  (void)state;
  for (unsigned k = 0; k <= form->degree; k++)
    bx_curve_place(set, i, form->control_points + 2 * (mu - form->degree + k), line[k]);
  bx_span_to_bezier(form->degree, form->knots, mu, line, 1);
  put_point(w, line[0]);
  put_point(w, line[form->degree]);
  for (unsigned k = 1; k < form->degree; k++) put_point(w, line[k]);
}

static void put_degrees(bx_writer *w, const bx_curve_set *set, size_t i, const batten_curve_form *form, size_t mu,
                        uint64_t *state) {
  (void)set, (void)i, (void)mu, (void)state;
  put_point(w, (double[3]){form->degree, 0, 0});
}

static void put_domain(bx_writer *w, const bx_curve_set *set, size_t i, const batten_curve_form *form, size_t mu,
                       uint64_t *state) {
  (void)set, (void)i, (void)state;
  bx_put_f64(w, form->knots[mu]);
  bx_put_f64(w, form->knots[mu + 1]);
}

static void put_number(bx_writer *w, const bx_curve_set *set, size_t i, const batten_curve_form *form, size_t mu,
                       uint64_t *state) {
  (void)set, (void)form, (void)mu, (void)state;
  bx_put_u64(w, i);
}

static void put_offset(bx_writer *w, const bx_curve_set *set, size_t i, const batten_curve_form *form, size_t mu,
                       uint64_t *state) {
  (void)set, (void)i, (void)mu;
  bx_put_u64(w, *state += form->degree + 1);
}

void bx_write_vtu_curves(bx_writer *w, const bx_curve_set *set) {
  enum { VTK_BEZIER_CURVE = 75 };
  vtk_file v = {.w = w};
  counts c = count_cells(set);
  vtk_begin(&v, "UnstructuredGrid");
  bx_print(w, "    <Piece NumberOfPoints=\"%zu\" NumberOfCells=\"%zu\">\n      <Points>\n", c.points, c.cells);
  vtk_declare(&v, "Float64", "Points", 3, c.points, sizeof(double));
  bx_put_text(w, "      </Points>\n      <CellData HigherOrderDegrees=\"HigherOrderDegrees\">\n");
  vtk_declare(&v, "Float64", "HigherOrderDegrees", 3, c.cells, sizeof(double));
  vtk_declare(&v, "Float64", "domain", 2, c.cells, sizeof(double));
  vtk_declare(&v, "Int64", "curve", 1, c.cells, sizeof(int64_t));
  bx_put_text(w, "      </CellData>\n      <Cells>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, c.points, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, c.cells, sizeof(int64_t));
  vtk_declare(&v, "UInt8", "types", 1, c.cells, 1);
  bx_put_text(w, "      </Cells>\n");
  vtk_begin_appended(&v, "UnstructuredGrid");
  bx_put_u64(w, (uint64_t)c.points * 3 * sizeof(double));
  put_spans(w, set, put_points);
  bx_put_u64(w, (uint64_t)c.cells * 3 * sizeof(double));
  put_spans(w, set, put_degrees);
  bx_put_u64(w, (uint64_t)c.cells * 2 * sizeof(double));
  put_spans(w, set, put_domain);
  bx_put_u64(w, (uint64_t)c.cells * sizeof(int64_t));
  put_spans(w, set, put_number);
  bx_put_u64(w, (uint64_t)c.points * sizeof(int64_t));
  for (size_t i = 0; i < c.points; i++) bx_put_u64(w, i);
  bx_put_u64(w, (uint64_t)c.cells * sizeof(int64_t));
  put_spans(w, set, put_offset);
  bx_put_u64(w, c.cells);
  for (size_t i = 0; i < c.cells; i++) bx_put_u8(w, VTK_BEZIER_CURVE);
  vtk_end(&v);
}
