/* Planar curves as JSON documents; read_curves.c reads them.
 *
 * {"batten": "curve", "version": 1, CURVE}                                  one
 * {"batten": "contours", "version": 1, "curves": [{CURVE}, {CURVE}, ...]}   several
 *
 * CURVE: "degree": 3, "knots": [...], "control_points": [[x, y], ...], "periodic": false and, where there are planes,
 * "z": 1.5 for those that lie over the plane of x and y, "plane": {"origin": [x, y, z], "axes": [[...], [...]]} for
 * others. */
#include "curves.h"
#include "write.h"

static void put_plane(bx_writer *w, const batten_plane *plane) {
  if (bx_plane_is_horizontal(plane)) {
    bx_put_text(w, ",\n\"z\": ");
    bx_put_number(w, plane->origin[2]);
    return;
  }
  bx_put_text(w, ",\n\"plane\": {\"origin\": ");
  bx_put_json_numbers(w, plane->origin, 3);
  bx_put_text(w, ", \"axes\": ");
  bx_put_json_rows(w, plane->axes[0], 2, 3, ", ");
  bx_put_u8(w, '}');
}

static void put_curve(bx_writer *w, const bx_curve_set *set, size_t i) {
  batten_curve_form form = batten_curve_get(set->curves[i]);
  bx_print(w, "\"degree\": %u, \"periodic\": %s,\n\"knots\": ", form.degree, form.closed ? "true" : "false");
  bx_put_json_numbers(w, form.knots, form.knot_count);
  bx_put_text(w, ",\n\"control_points\": ");
  bx_put_json_rows(w, form.control_points, bx_curve_points(&form), 2, ",\n");
  if (set->planes) put_plane(w, &set->planes[i]);
}

void bx_write_json_curves(bx_writer *w, const bx_curve_set *set) {
  if (set->count == 1 && bx_goes_on(w, 0, 1)) {
    bx_put_text(w, "{\"batten\": \"curve\", \"version\": 1,\n");
    put_curve(w, set, 0);
    bx_put_text(w, "\n}\n");
    return;
  }
  bx_put_text(w, "{\"batten\": \"contours\", \"version\": 1,\n\"curves\": [");
  for (size_t i = 0; i < set->count && bx_goes_on(w, i, set->count); i++) {
    bx_put_text(w, i ? ",\n{" : "\n{");
    put_curve(w, set, i);
    bx_put_u8(w, '}');
  }
  bx_put_text(w, "]\n}\n");
}
