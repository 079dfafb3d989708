/* SVG files of plane shapes: see svg.h. */
#include "svg.h"

#include <math.h>

double bx_svg_begin(bx_writer *w, const double lower[2], const double upper[2], const char *unit, double in_units) {
  double width = upper[0] - lower[0], height = upper[1] - lower[1];
  double size = fmax(width, height) > 0 ? fmax(width, height) : 1, margin = size / 20;
  double view[4] = {lower[0] - margin, -upper[1] - margin, width + 2 * margin, height + 2 * margin};
  bx_put_text(w, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\"");
  for (int i = 0; unit && i < 2; i++) {
    bx_put_text(w, i == 0 ? " width=\"" : " height=\"");
    bx_put_number(w, view[2 + i] * in_units);
    bx_print(w, "%s\"", unit);
  }
  bx_put_text(w, " viewBox=\"");
  bx_put_numbers(w, view, 4);
  bx_put_text(w, "\">\n");
  return size;
}

void bx_svg_end(bx_writer *w) { bx_put_text(w, "</svg>\n"); }
