/* Surfaces as JSON documents; read_surface.c reads them.
 *
 * {"batten": "surface", "version": 1, "degree": [p, q], "knots": [[u_0, ...], [v_0, ...]],
 *  "control_points": [[[x, y, z], ...], ...]}     a row for every control point in u; v runs along the rows */
#include "surface.h"
#include "write.h"

void bx_write_json_surface(bx_writer *w, const batten_surface_form *form) {
  size_t rows = bx_form_points(form, 0), columns = bx_form_points(form, 1);
  bx_print(w, "{\"batten\": \"surface\", \"version\": 1,\n\"degree\": [%u, %u],\n\"knots\": [\n", form->degree[0],
           form->degree[1]);
  bx_put_json_numbers(w, form->knots[0], form->knot_count[0]);
  bx_put_text(w, ",\n");
  bx_put_json_numbers(w, form->knots[1], form->knot_count[1]);
  bx_put_text(w, "],\n\"control_points\": [");
  for (size_t i = 0; i < rows && bx_goes_on(w, i, rows); i++) {
    bx_put_text(w, i ? ",\n" : "\n");
    bx_put_json_rows(w, form->control_points + 3 * i * columns, columns, 3, ", ");
  }
  bx_put_text(w, "]\n}\n");
}
