/* Picture of a plane solid: the filled inside, its outline, the data, axes with numbers. PNG or SVG.
 *
 * Both come from one list of drawing steps over a sheet, which either blends into an image or writes elements. */
#include "picture.h"
#include "write_file.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "base/checked.h"

/* ---- sheet --------------------------------------------------------------------------------------- */

typedef struct sheet {
  picture_image image;                   /* PNG */
  bx_writer *svg;                        /* SVG; NULL = PNG */
  double origin[2], scale, left, bottom; /* data to pixels: x = left + scale (p - origin), y = bottom - ... */
  unsigned width, height;
} sheet;

static double sheet_x(const sheet *s, double x) { return s->left + s->scale * (x - s->origin[0]); }
static double sheet_y(const sheet *s, double y) { return s->bottom - s->scale * (y - s->origin[1]); }

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

static void draw_line(sheet *s, double x0, double y0, double x1, double y1, double width, unsigned color) {
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

/* anchor 0: text starts at x, 1: is centred, 2: ends there. */
static void draw_text(sheet *s, double x, double y, double height, int anchor, unsigned color, const char *text) {
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

/* Points [count][2] to pixels, into xy. */
static void to_pixels(const sheet *s, size_t count, const double *points, double *xy) {
  for (size_t i = 0; i < count; i++) {
    xy[2 * i] = sheet_x(s, points[2 * i]);
    xy[2 * i + 1] = sheet_y(s, points[2 * i + 1]);
  }
}

static void svg_path(sheet *s, const batten_outline *o, bool closed_only) {
  for (size_t l = 0; l < batten_outline_loop_count(o); l++) {
    size_t count;
    int closed;
    const double *p = batten_outline_loop(o, l, &count, &closed);
    if (closed_only && !closed) continue;
    for (size_t i = 0; i < count; i++) {
      bx_put_text(s->svg, i == 0 ? "M" : "L");
      put_pixel(s->svg, sheet_x(s, p[2 * i]), " ");
      put_pixel(s->svg, sheet_y(s, p[2 * i + 1]), "");
    }
    bx_put_text(s->svg, closed ? "Z\n" : "\n");
  }
}

/* The inside, where loops are closed, and all loops as lines. xy: room for the longest loop. */
static void draw_outline(sheet *s, const batten_outline *o, double width, unsigned fill, unsigned ink, double *xy) {
  if (s->svg) {
    bx_print(s->svg, "<path fill=\"#%06x\" d=\"", fill);
    svg_path(s, o, true);
    bx_print(s->svg, "\"/>\n<path fill=\"none\" stroke=\"#%06x\" stroke-linejoin=\"round\" stroke-linecap=\"round\"",
             ink);
    put_attribute(s->svg, "stroke-width", width);
    bx_put_text(s->svg, " d=\"");
    svg_path(s, o, false);
    bx_put_text(s->svg, "\"/>\n");
    return;
  }
  for (int pass = 0; pass < 2; pass++) {
    for (size_t l = 0; l < batten_outline_loop_count(o); l++) {
      size_t count;
      int closed;
      const double *p = batten_outline_loop(o, l, &count, &closed);
      to_pixels(s, count, p, xy);
      if (pass == 0 && closed) picture_mask_polygon(&s->image, count, xy);
      for (size_t i = 0; pass == 1 && i + !closed < count; i++) {
        size_t next = i + 1 < count ? i + 1 : 0;
        picture_mask_capsule(&s->image, xy[2 * i], xy[2 * i + 1], xy[2 * next], xy[2 * next + 1], 0.5 * width);
      }
    }
    if (pass == 0) picture_mask_fold(&s->image);
    picture_blend(&s->image, picture_srgb(pass == 0 ? fill : ink), 1);
  }
}

/* Dots with a light rim, so that they stand off the line that they lie on. */
static void draw_dots(sheet *s, size_t count, const double *points, double radius, double rim, unsigned color) {
  if (s->svg) {
    bx_print(s->svg, "<g fill=\"#%06x\" stroke=\"#ffffff\"", color);
    put_attribute(s->svg, "stroke-width", rim);
    bx_put_text(s->svg, ">\n");
    for (size_t i = 0; i < count; i++) {
      bx_put_text(s->svg, "<circle");
      put_attribute(s->svg, "cx", sheet_x(s, points[2 * i]));
      put_attribute(s->svg, "cy", sheet_y(s, points[2 * i + 1]));
      put_attribute(s->svg, "r", radius);
      bx_put_text(s->svg, "/>\n");
    }
    bx_put_text(s->svg, "</g>\n");
    return;
  }
  for (int pass = 0; pass < 2; pass++) {
    for (size_t i = 0; i < count; i++) {
      double x = sheet_x(s, points[2 * i]), y = sheet_y(s, points[2 * i + 1]);
      picture_mask_capsule(&s->image, x, y, x, y, pass == 0 ? radius + 0.5 * rim : radius - 0.5 * rim);
    }
    picture_blend(&s->image, picture_srgb(pass == 0 ? 0xffffff : color), 1);
  }
}

/* ---- layout -------------------------------------------------------------------------------------- */

typedef struct plane_box {
  double lower[2], upper[2];
} plane_box;

static void include(plane_box *b, size_t count, const double *points) {
  for (size_t i = 0; i < 2 * count; i++) {
    b->lower[i % 2] = fmin(b->lower[i % 2], points[i]);
    b->upper[i % 2] = fmax(b->upper[i % 2], points[i]);
  }
}

static batten_status box_of(batten_context *ctx, const batten_outline *o, const batten_picture_options *opt,
                            plane_box *out, size_t *longest) {
  plane_box b = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
  *longest = 0;
  for (size_t l = 0; l < batten_outline_loop_count(o); l++) {
    size_t count;
    int closed;
    const double *p = batten_outline_loop(o, l, &count, &closed);
    include(&b, count, p);
    if (count > *longest) *longest = count;
  }
  include(&b, opt->point_count, opt->points);
  if (!(b.lower[0] <= b.upper[0])) return batten_fail(ctx, BATTEN_E_INVALID, "outline: it has no loops to draw");
  if (!isfinite(b.upper[0] - b.lower[0]) || !isfinite(b.upper[1] - b.lower[1]))
    return batten_fail(ctx, BATTEN_E_INVALID, "outline: a vertex is not finite");
  *out = b;
  return BATTEN_OK;
}

/* The plot's frame in pixels and the scale that fits the box, grown by 6 %, into it with equal axes. */
typedef struct plot {
  double x0, y0, x1, y1, unit;
} plot;

static plot lay_out(sheet *s, const plane_box *b, bool title) {
  double unit = fmax(6, fmin(s->width, s->height) / 55.0);
  plot f = {5.2 * unit, (title ? 4.6 : 2) * unit, s->width - 2.2 * unit, s->height - 3.6 * unit, unit};
  double size[2] = {b->upper[0] - b->lower[0], b->upper[1] - b->lower[1]};
  if (size[0] == 0 && size[1] == 0) size[0] = size[1] = 1;
  s->scale = fmin((f.x1 - f.x0) / size[0], (f.y1 - f.y0) / size[1]) / 1.12;
  for (size_t k = 0; k < 2; k++) s->origin[k] = 0.5 * b->lower[k] + 0.5 * b->upper[k];
  s->left = 0.5 * (f.x0 + f.x1);
  s->bottom = 0.5 * (f.y0 + f.y1);
  return f;
}

static void draw_axes(sheet *s, const plot *f) {
  const unsigned grid = 0xe8eaee, frame = 0xb4b9c2, ink = 0x4a4f58;
  double span_x = 0.5 * (f->x1 - f->x0) / s->scale, span_y = 0.5 * (f->y1 - f->y0) / s->scale;
  unsigned wanted = (unsigned)fmax(2, fmin(f->x1 - f->x0, f->y1 - f->y0) / (9 * f->unit));
  double step = 2 * fmin(span_x, span_y) / wanted;
  char text[PICTURE_TICK_SIZE];
  /* The same step on both axes. */
  picture_ticks tx =
      picture_ticks_choose(s->origin[0] - span_x, s->origin[0] + span_x, (unsigned)fmax(1, 2 * span_x / step));
  picture_ticks ty =
      picture_ticks_choose(s->origin[1] - span_y, s->origin[1] + span_y, (unsigned)fmax(1, 2 * span_y / step));
  for (size_t i = 0; i < tx.count; i++) {
    double x = sheet_x(s, picture_tick_value(&tx, i));
    draw_line(s, x, f->y0, x, f->y1, 1, grid);
    picture_tick_text(&tx, i, text);
    draw_text(s, x, f->y1 + 1.9 * f->unit, 0.85 * f->unit, 1, ink, text);
  }
  for (size_t i = 0; i < ty.count; i++) {
    double y = sheet_y(s, picture_tick_value(&ty, i));
    draw_line(s, f->x0, y, f->x1, y, 1, grid);
    picture_tick_text(&ty, i, text);
    draw_text(s, f->x0 - 0.8 * f->unit, y + 0.42 * f->unit, 0.85 * f->unit, 2, ink, text);
  }
  draw_line(s, f->x0, f->y0, f->x1, f->y0, 1.2, frame);
  draw_line(s, f->x0, f->y1, f->x1, f->y1, 1.2, frame);
  draw_line(s, f->x0, f->y0, f->x0, f->y1, 1.2, frame);
  draw_line(s, f->x1, f->y0, f->x1, f->y1, 1.2, frame);
}

static void draw_sheet(sheet *s, const batten_outline *o, const batten_picture_options *opt, const plane_box *box,
                       double *xy) {
  plot f = lay_out(s, box, opt->title != NULL);
  draw_axes(s, &f);
  draw_outline(s, o, 0.22 * f.unit, 0xb9cfe4, 0x1f4e79, xy);
  double spread = sqrt((f.x1 - f.x0) * (f.y1 - f.y0) / fmax(1, (double)opt->point_count));
  draw_dots(s, opt->point_count, opt->points, fmin(0.32 * f.unit, fmax(1, 0.06 * spread)), 0.1 * f.unit, 0xc8442c);
  if (opt->title) draw_text(s, f.x0, 2.8 * f.unit, 1.25 * f.unit, 0, 0x2a2d33, opt->title);
}

static batten_status write_svg(batten_context *ctx, sheet *s, const batten_outline *o,
                               const batten_picture_options *opt, const plane_box *box, const char *path) {
  bx_writer w;
  batten_status st = bx_create(&w, ctx, path);
  if (st < 0) return st;
  s->svg = &w;
  bx_print(&w,
           "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%u\" height=\"%u\" viewBox=\"0 0 %u %u\" "
           "font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"%u\" height=\"%u\" fill=\"#ffffff\"/>\n",
           s->width, s->height, s->width, s->height, s->width, s->height);
  draw_sheet(s, o, opt, box, NULL);
  bx_put_text(&w, "</svg>\n");
  return bx_commit(&w);
}

batten_status batten_picture_outline(batten_context *ctx, const batten_outline *outline,
                                     const batten_picture_options *opt, const char *path) {
  batten_picture_options o;
  batten_status st = picture_check_options(ctx, opt, 2, &o);
  if (st < 0) return st;
  bool svg = picture_has_extension(path, ".svg");
  if (!svg && !picture_has_extension(path, ".png"))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: unknown extension for a picture of an outline; use .svg or .png",
                       path);
  plane_box box;
  size_t longest;
  st = box_of(ctx, outline, &o, &box, &longest);
  if (st >= 0) st = batten_progress(ctx, "picture", 0);
  if (st < 0) return st;
  sheet s = {.width = o.width, .height = o.height};
  if (svg) return write_svg(ctx, &s, outline, &o, &box, path);
  double *xy = batten_alloc_array(ctx, longest, 2 * sizeof *xy);
  if (!xy) return BATTEN_E_NOMEM;
  st = picture_image_new(ctx, o.width, o.height, &s.image);
  if (st >= 0) {
    draw_sheet(&s, outline, &o, &box, xy);
    st = batten_progress(ctx, "picture", 0.9);
    if (st >= 0) st = picture_write_png(ctx, &s.image, path);
    picture_image_free(ctx, &s.image);
  }
  batten_free(ctx, xy);
  return st;
}
