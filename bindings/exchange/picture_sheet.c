/* Drawing in the plane: each step either blends into an image or writes elements of SVG. */
#include "picture_sheet.h"

#include <math.h>
#include <stdio.h>

/* A pixel coordinate with three decimals; printf's decimal point would depend on the locale. */
static void put_pixel(bx_writer *w, double v, const char *after) {
  long long thousandths = llround(fmin(1e6, fmax(-1e6, v)) * 1000);
  unsigned long long size = (unsigned long long)(thousandths < 0 ? -thousandths : thousandths);
  bx_print(w, "%s%llu.%03llu%s", thousandths < 0 ? "-" : "", size / 1000, size % 1000, after);
}

static void put_attribute(bx_writer *w, const char *name, double v) {
  bx_print(w, " %s=\"", name);
  put_pixel(w, v, "\"");
}

void sheet_line(picture_sheet *s, double x0, double y0, double x1, double y1, double width, unsigned color) {
  if (s->svg) {
    bx_put_text(s->svg, "<line");
    put_attribute(s->svg, "x1", x0);
    put_attribute(s->svg, "y1", y0);
    put_attribute(s->svg, "x2", x1);
    put_attribute(s->svg, "y2", y1);
    put_attribute(s->svg, "stroke-width", width);
    bx_print(s->svg, " stroke=\"#%06x\"/>\n", color);
  } else {
    picture_mask_capsule(&s->image, x0, y0, x1, y1, 0.5 * width);
    picture_blend(&s->image, picture_srgb(color), 1);
  }
}

void sheet_text(picture_sheet *s, double x, double y, double height, int anchor, unsigned color, const char *text) {
  if (s->svg) {
    static const char *const anchors[] = {"start", "middle", "end"};
    bx_put_text(s->svg, "<text");
    put_attribute(s->svg, "x", x);
    put_attribute(s->svg, "y", y);
    put_attribute(s->svg, "font-size", height / 0.72); /* capitals are 0.72 of the size in common sans faces */
    bx_print(s->svg, " text-anchor=\"%s\" fill=\"#%06x\">", anchors[anchor], color);
    for (const char *c = text; *c; c++) {
      if (*c == '&' || *c == '<' || *c == '>')
        bx_put_text(s->svg, *c == '&' ? "&amp;" : *c == '<' ? "&lt;" : "&gt;");
      else {
        char one = *c < 32 || *c > 126 ? '?' : *c;
        bx_put(s->svg, &one, 1);
      }
    }
    bx_put_text(s->svg, "</text>\n");
  } else {
    x -= 0.5 * anchor * picture_text_width(height, text);
    picture_mask_text(&s->image, x, y, height, 1, text);
    picture_blend(&s->image, picture_srgb(color), 1);
  }
}

/* ---- in a frame ---------------------------------------------------------------------------------- */

/* The part of a segment within the frame [Liang, Barsky]; false when there is none. */
static bool cut(const picture_frame *f, double a[2], double b[2]) {
  double lower[2] = {f->x0, f->y0}, upper[2] = {f->x1, f->y1}, from = 0, to = 1;
  for (int k = 0; k < 2; k++) {
    double d = b[k] - a[k];
    if (d == 0 && (a[k] < lower[k] || a[k] > upper[k])) return false;
    if (d == 0) continue;
    double enter = ((d > 0 ? lower[k] : upper[k]) - a[k]) / d, leave = ((d > 0 ? upper[k] : lower[k]) - a[k]) / d;
    from = fmax(from, enter);
    to = fmin(to, leave);
  }
  if (!(from <= to)) return false;
  double start[2] = {a[0], a[1]}, d[2] = {b[0] - a[0], b[1] - a[1]};
  for (int k = 0; k < 2; k++) {
    if (from > 0) a[k] = start[k] + from * d[k];
    if (to < 1) b[k] = start[k] + to * d[k];
  }
  return true;
}

void sheet_polylines(picture_sheet *s, const picture_frame *f, const sheet_parts *p, bool closed, double width,
                     unsigned color) {
  if (s->svg) {
    bx_print(s->svg, "<path fill=\"none\" stroke=\"#%06x\" stroke-linejoin=\"round\" stroke-linecap=\"round\"",
             color);
    put_attribute(s->svg, "stroke-width", width);
    bx_put_text(s->svg, " d=\"");
  }
  for (size_t k = 0; k < p->count; k++) {
    size_t count = p->starts[k + 1] - p->starts[k];
    const double *q = p->points + 2 * p->starts[k];
    double last[2] = {NAN, NAN}; /* where the path is */
    for (size_t i = 0; i + !closed < count; i++) {
      size_t next = i + 1 < count ? i + 1 : 0;
      double a[2] = {frame_x(f, q[2 * i]), frame_y(f, q[2 * i + 1])};
      double b[2] = {frame_x(f, q[2 * next]), frame_y(f, q[2 * next + 1])};
      if (!cut(f, a, b)) continue;
      if (!s->svg) {
        picture_mask_capsule(&s->image, a[0], a[1], b[0], b[1], 0.5 * width);
        continue;
      }
      if (a[0] != last[0] || a[1] != last[1]) {
        bx_put_text(s->svg, "M");
        put_pixel(s->svg, a[0], " ");
        put_pixel(s->svg, a[1], "");
      }
      bx_put_text(s->svg, "L");
      put_pixel(s->svg, b[0], " ");
      put_pixel(s->svg, b[1], "");
      last[0] = b[0], last[1] = b[1];
    }
    if (s->svg) bx_put_text(s->svg, "\n");
  }
  if (s->svg)
    bx_put_text(s->svg, "\"/>\n");
  else
    picture_blend(&s->image, picture_srgb(color), 1);
}

void sheet_area(picture_sheet *s, const picture_frame *f, const sheet_parts *p, unsigned color, double *xy) {
  if (s->svg) bx_print(s->svg, "<path fill=\"#%06x\" d=\"", color);
  for (size_t k = 0; k < p->count; k++) {
    size_t count = p->starts[k + 1] - p->starts[k];
    const double *q = p->points + 2 * p->starts[k];
    for (size_t i = 0; i < count; i++) {
      xy[2 * i] = fmin(f->x1, fmax(f->x0, frame_x(f, q[2 * i])));
      xy[2 * i + 1] = fmin(f->y1, fmax(f->y0, frame_y(f, q[2 * i + 1])));
      if (!s->svg) continue;
      bx_put_text(s->svg, i == 0 ? "M" : "L");
      put_pixel(s->svg, xy[2 * i], " ");
      put_pixel(s->svg, xy[2 * i + 1], "");
    }
    if (s->svg)
      bx_put_text(s->svg, "Z\n");
    else
      picture_mask_polygon(&s->image, count, xy);
  }
  if (s->svg) {
    bx_put_text(s->svg, "\"/>\n");
    return;
  }
  picture_mask_fold(&s->image);
  picture_blend(&s->image, picture_srgb(color), 1);
}

/* ---- marks --------------------------------------------------------------------------------------- */

static void svg_mark(bx_writer *w, double x, double y, sheet_mark mark, double radius) {
  if (mark != SHEET_CROSS) {
    bx_put_text(w, "<circle");
    put_attribute(w, "cx", x);
    put_attribute(w, "cy", y);
    put_attribute(w, "r", radius);
    bx_put_text(w, "/>\n");
    return;
  }
  bx_put_text(w, "<path d=\"");
  for (int k = 0; k < 2; k++) {
    double side = k == 0 ? radius : -radius;
    bx_put_text(w, "M");
    put_pixel(w, x - radius, " ");
    put_pixel(w, y - side, "L");
    put_pixel(w, x + radius, " ");
    put_pixel(w, y + side, "");
  }
  bx_put_text(w, "\"/>\n");
}

static void mask_mark(picture_image *im, double x, double y, sheet_mark mark, double radius, double width) {
  enum { CORNERS = 24 };
  const double turn = 6.283185307179586 / CORNERS;
  if (mark == SHEET_DOT) {
    picture_mask_capsule(im, x, y, x, y, radius);
  } else if (mark == SHEET_CROSS) {
    picture_mask_capsule(im, x - radius, y - radius, x + radius, y + radius, 0.5 * width);
    picture_mask_capsule(im, x - radius, y + radius, x + radius, y - radius, 0.5 * width);
  } else {
    for (int k = 0; k < CORNERS; k++)
      picture_mask_capsule(im, x + radius * cos(k * turn), y + radius * sin(k * turn),
                           x + radius * cos((k + 1) * turn), y + radius * sin((k + 1) * turn), 0.5 * width);
  }
}

void sheet_marks(picture_sheet *s, const picture_frame *f, size_t count, const double *points, sheet_mark mark,
                 double radius, double width, unsigned color) {
  /* Dots have a light rim of that width, so that they stand off the line that they lie on. */
  if (s->svg) {
    if (mark == SHEET_DOT)
      bx_print(s->svg, "<g fill=\"#%06x\" stroke=\"#ffffff\"", color);
    else
      bx_print(s->svg, "<g fill=\"none\" stroke=\"#%06x\" stroke-linecap=\"round\"", color);
    put_attribute(s->svg, "stroke-width", width);
    bx_put_text(s->svg, ">\n");
  }
  for (int pass = 0; pass < (mark == SHEET_DOT && !s->svg ? 2 : 1); pass++) {
    double reach = mark != SHEET_DOT ? radius : radius + (pass == 0 ? 0.5 : -0.5) * width;
    for (size_t i = 0; i < count; i++) {
      double x = frame_x(f, points[2 * i]), y = frame_y(f, points[2 * i + 1]);
      if (x < f->x0 || x > f->x1 || y < f->y0 || y > f->y1) continue;
      if (s->svg)
        svg_mark(s->svg, x, y, mark, radius);
      else
        mask_mark(&s->image, x, y, mark, reach, width);
    }
    if (!s->svg) picture_blend(&s->image, picture_srgb(mark == SHEET_DOT && pass == 0 ? 0xffffff : color), 1);
  }
  if (s->svg) bx_put_text(s->svg, "</g>\n");
}
