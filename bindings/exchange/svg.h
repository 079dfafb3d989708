/* What SVG files of plane shapes share: the view box around them, and y upwards. */
#ifndef BATTEN_EXCHANGE_SVG_H
#define BATTEN_EXCHANGE_SVG_H

#include "write.h"

/* The document up to its content, for what lies in [lower, upper]; returns the size that line widths go by. unit: one
 * of the coordinates in SVG's own, with its name ("mm"), as which the width and height are given; NULL: none. */
double bx_svg_begin(bx_writer *w, const double lower[2], const double upper[2], const char *unit, double in_units);
/* The attribute that turns y upwards: the numbers of a shape stay as they are. */
#define BX_SVG_UPWARDS "transform=\"scale(1 -1)\""
void bx_svg_end(bx_writer *w);

#endif
