/* A sheet to draw on in the plane: a picture in PNG or in SVG from one list of steps. */
#ifndef BATTEN_EXCHANGE_PICTURE_SHEET_H
#define BATTEN_EXCHANGE_PICTURE_SHEET_H

#include "picture.h"
#include "write_file.h"

typedef struct picture_sheet {
  picture_image image; /* PNG */
  bx_writer *svg;      /* SVG; NULL = PNG */
} picture_sheet;

/* What is drawn in pixels, y downwards. */
void sheet_line(picture_sheet *s, double x0, double y0, double x1, double y1, double width, unsigned color);
/* anchor 0: text starts at x, 1: is centred, 2: ends there. */
void sheet_text(picture_sheet *s, double x, double y, double height, int anchor, unsigned color, const char *text);

/* A frame in pixels that shows a part of the plane: what is beyond is cut off. */
typedef struct picture_frame {
  double x0, y0, x1, y1;       /* pixels, y0 < y1 */
  double origin[2], middle[2]; /* of the plane, and in pixels */
  double scale[2];             /* pixels per unit */
} picture_frame;
static inline double frame_x(const picture_frame *f, double x) {
  return f->middle[0] + f->scale[0] * (x - f->origin[0]);
}
static inline double frame_y(const picture_frame *f, double y) {
  return f->middle[1] - f->scale[1] * (y - f->origin[1]);
}

/* Polylines: point i of the plane at points + 2 i, part k is starts[k] .. starts[k + 1] - 1. Widths in pixels. All
 * parts are one stroke: they do not darken each other. */
typedef struct sheet_parts {
  size_t count; /* parts */
  const size_t *starts;
  const double *points;
} sheet_parts;
void sheet_polylines(picture_sheet *s, const picture_frame *f, const sheet_parts *p, bool closed, double width,
                     unsigned color);
/* The inside of closed polylines, whose holes are turned the other way. xy: room for the points of the longest part.
 */
void sheet_area(picture_sheet *s, const picture_frame *f, const sheet_parts *p, unsigned color, double *xy);
/* Marks [count] of a radius in pixels. */
typedef enum sheet_mark { SHEET_DOT = 0, SHEET_CROSS, SHEET_RING } sheet_mark;
void sheet_marks(picture_sheet *s, const picture_frame *f, size_t count, const double *points, sheet_mark mark,
                 double radius, double width, unsigned color);

#endif
