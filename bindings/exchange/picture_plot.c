/* Plots in the plane: frames with axes, and layers of areas, lines and marks in them. PNG or SVG.
 *
 * Outlines of plane solids are a plot too: an area, its loops as lines, and dots. */
#include "picture_sheet.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "base/checked.h"

enum { PLOTS_MAX = 16 }; /* in a row or column */

static const unsigned GRID = 0xe8eaee, FRAME = 0xb4b9c2, INK = 0x4a4f58, TITLE = 0x2a2d33;

/* ---- checks -------------------------------------------------------------------------------------- */

static batten_status check_layer(batten_context *ctx, const batten_plot_layer *l, size_t plot, size_t i) {
  size_t numbers;
  if ((unsigned)l->kind > BATTEN_PLOT_RINGS)
    return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu].layers[%zu].kind: %d; must be a batten_plot_kind", plot, i,
                       (int)l->kind);
  if (l->count && !l->points)
    return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu].layers[%zu].points: NULL with count = %zu", plot, i,
                       l->count);
  if (!batten_mul(l->count, 2, &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "plots[%zu].layers[%zu].count: %zu is too many", plot, i, l->count);
  size_t bad = batten_first_nonfinite(numbers, l->points);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu].layers[%zu].points[%zu]: coordinate %zu is not finite",
                       plot, i, bad / 2, bad % 2);
  if (l->color > 0xffffff || !(l->width >= 0 && l->width <= 100))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "plots[%zu].layers[%zu].color, width: 0x%x, %g; must be 0 .. 0xffffff, 0 .. 100", plot, i,
                       l->color, l->width);
  if (l->part_count && !l->starts)
    return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu].layers[%zu].starts: NULL with part_count = %zu", plot, i,
                       l->part_count);
  for (size_t k = 0; k < l->part_count; k++)
    if (l->starts[k] > l->starts[k + 1] || l->starts[k + 1] > l->count)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "plots[%zu].layers[%zu].starts[%zu], [%zu]: %zu, %zu; must not fall, and not exceed count "
                         "= %zu",
                         plot, i, k, k + 1, l->starts[k], l->starts[k + 1], l->count);
  return BATTEN_OK;
}

static batten_status check_plot(batten_context *ctx, const batten_plot *p, size_t plot) {
  if (p->layer_count && !p->layers)
    return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu].layers: NULL with layer_count = %zu", plot, p->layer_count);
  for (int k = 0; k < 2; k++)
    if (!(p->lower[k] <= p->upper[k]) || !isfinite(p->upper[k] - p->lower[k]))
      return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu].lower[%d], upper: %g, %g; must be finite and in order",
                         plot, k, p->lower[k], p->upper[k]);
  for (size_t i = 0; i < p->layer_count; i++) {
    batten_status st = check_layer(ctx, &p->layers[i], plot, i);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

/* ---- layout -------------------------------------------------------------------------------------- */

typedef struct plot_view {
  const batten_plot *plot;
  double x0, y0, x1, y1; /* its rectangle of the picture */
  double unit;           /* height of lettering */
  double lower[2], upper[2];
  picture_frame frame;
} plot_view;

/* What the layers have; false when that is nothing. */
static bool find_range(const batten_plot *p, double lower[2], double upper[2]) {
  for (int k = 0; k < 2; k++) lower[k] = INFINITY, upper[k] = -INFINITY;
  for (size_t i = 0; i < p->layer_count; i++) {
    const batten_plot_layer *l = &p->layers[i];
    for (size_t j = 0; !l->beyond && j < 2 * l->count; j++) {
      lower[j % 2] = fmin(lower[j % 2], l->points[j]);
      upper[j % 2] = fmax(upper[j % 2], l->points[j]);
    }
  }
  return lower[0] <= upper[0];
}

/* The range of a plot alone: what is asked for, or what there is and 6 % around it. */
static batten_status make_range(batten_context *ctx, plot_view *v, size_t index) {
  const batten_plot *p = v->plot;
  double lower[2], upper[2];
  bool any = find_range(p, lower, upper);
  for (int k = 0; k < 2; k++) {
    bool asked = p->lower[k] < p->upper[k];
    double margin = 0;
    if (asked) {
      lower[k] = p->lower[k];
      upper[k] = p->upper[k];
    } else if (!any) {
      return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu]: its layers have no points to draw", index);
    } else {
      margin = 0.06 * (upper[k] - lower[k]);
    }
    v->lower[k] = lower[k] - margin;
    v->upper[k] = upper[k] + margin;
    if (!isfinite(v->upper[k] - v->lower[k]))
      return batten_fail(ctx, BATTEN_E_INVALID, "plots[%zu]: its points are too far apart to be drawn", index);
  }
  return BATTEN_OK;
}

/* Beside the frame, and the height of small lettering, in heights of lettering. */
static const double LEFT = 5.2, RIGHT = 2.2, SMALL = 0.85;

static double frame_width(const plot_view *v) { return fmax(1, v->x1 - v->x0 - (LEFT + RIGHT) * v->unit); }

/* The legend is filled from the right, row by row upwards; the name of the upward axis has the left of the lowest. */
typedef struct legend_place {
  unsigned row;
  double right; /* where the name ends, from the left of the frame; 0 before the first */
  double width; /* of sample and name */
} legend_place;

static void legend_next(const plot_view *v, const char *label, legend_place *at) {
  const char *axis = v->plot->labels[1];
  double unit = v->unit, height = SMALL * unit, room = frame_width(v), gap = 1.4 * unit;
  double taken = at->row == 0 && axis ? picture_text_width(height, axis) + gap : 0;
  bool first = at->width == 0;
  double right = first ? room : at->right - at->width - gap;
  at->width = fmin(room, picture_text_width(height, label) + 2.5 * unit);
  if (right - at->width < taken && !(first && taken == 0)) {
    at->row++;
    right = room;
  }
  at->right = right;
}

/* Above the frame, in heights of lettering: caption, then the legend on the right and the name of the upward
 * axis on the left. */
static double top_room(const plot_view *v) {
  const batten_plot *p = v->plot;
  legend_place at = {0};
  for (size_t i = p->layer_count; i-- > 0;)
    if (p->layers[i].label) legend_next(v, p->layers[i].label, &at);
  bool any = at.width > 0 || p->labels[1];
  return 1.2 + (p->caption ? 1.8 : 0) + 1.5 * (at.row + any);
}

/* top: of the plot in its row that needs most, so that frames are in line. */
static void make_frame(plot_view *v, double top) {
  const batten_plot *p = v->plot;
  picture_frame *f = &v->frame;
  double size[2];
  *f = (picture_frame){.x0 = v->x0 + LEFT * v->unit,
                       .y0 = v->y0 + top * v->unit,
                       .x1 = v->x1 - RIGHT * v->unit,
                       .y1 = v->y1 - (p->labels[0] ? 4.6 : 3.6) * v->unit};
  double room[2] = {fmax(1, f->x1 - f->x0), fmax(1, f->y1 - f->y0)};
  for (int k = 0; k < 2; k++) size[k] = v->upper[k] - v->lower[k];
  if (size[0] == 0 && size[1] == 0) size[0] = size[1] = 1;
  double scale = fmin(room[0] / size[0], room[1] / size[1]);
  for (int k = 0; k < 2; k++) {
    f->origin[k] = 0.5 * v->lower[k] + 0.5 * v->upper[k];
    f->scale[k] = !p->stretched ? scale : size[k] > 0 ? room[k] / size[k] : 1;
  }
  f->middle[0] = 0.5 * (f->x0 + f->x1);
  f->middle[1] = 0.5 * (f->y0 + f->y1);
}

static void join_groups(size_t count, plot_view *views) {
  for (size_t i = 0; i < count; i++)
    for (size_t j = 0; j < count; j++) {
      plot_view *a = &views[i], *b = &views[j];
      if (!a->plot->layer_count || !b->plot->layer_count) continue;
      if (a->plot->group == 0 || a->plot->group != b->plot->group) continue;
      for (int k = 0; k < 2; k++) {
        a->lower[k] = b->lower[k] = fmin(a->lower[k], b->lower[k]);
        a->upper[k] = b->upper[k] = fmax(a->upper[k], b->upper[k]);
      }
    }
}

static batten_status lay_out(batten_context *ctx, unsigned rows, unsigned columns, const batten_plot *plots,
                             const batten_picture_options *o, plot_view *views) {
  double whole = fmin(o->width, o->height), unit = fmax(6, whole / 55), top = o->title ? 4 * unit : 0.6 * unit;
  double width = (double)o->width / columns, height = (o->height - top) / rows;
  size_t count = (size_t)rows * columns;
  for (size_t i = 0; i < count; i++) {
    plot_view *v = &views[i];
    *v = (plot_view){.plot = &plots[i], .unit = fmax(6, sqrt(whole * fmin(fmin(width, height), whole)) / 55)};
    v->x0 = (double)(i % columns) * width;
    v->y0 = top + (double)(i / columns) * height;
    v->x1 = v->x0 + width;
    v->y1 = v->y0 + height;
    batten_status st = check_plot(ctx, &plots[i], i);
    if (st >= 0 && plots[i].layer_count) st = make_range(ctx, v, i);
    if (st < 0) return st;
  }
  join_groups(count, views);
  for (size_t i = 0; i < count; i++) {
    double above = 0;
    for (size_t k = i - i % columns; k < i - i % columns + columns; k++) above = fmax(above, top_room(&views[k]));
    make_frame(&views[i], above);
  }
  return BATTEN_OK;
}

/* ---- drawing ------------------------------------------------------------------------------------- */

/* Text in a room: in smaller letters, and cut when those would be too small to read. */
static void draw_text(picture_sheet *s, double x, double y, double height, double room, int anchor, unsigned color,
                      const char *text) {
  const double least = 6;
  char shown[256];
  double width = picture_text_width(height, text);
  if (width > room) height = fmax(fmin(least, height), height * room / width);
  snprintf(shown, sizeof shown, "%s", text);
  for (size_t n = strlen(shown); n > 4 && picture_text_width(height, shown) > room * (1 + 1e-9); n--)
    memcpy(shown + n - 4, "...", 4);
  sheet_text(s, x, y, height, anchor, color, shown);
}

static void draw_axes(picture_sheet *s, const plot_view *v) {
  const picture_frame *f = &v->frame;
  double room[2] = {f->x1 - f->x0, f->y1 - f->y0}, unit = v->unit, step[2];
  char text[PICTURE_TICK_SIZE];
  picture_ticks ticks[2];
  for (int k = 0; k < 2; k++) step[k] = room[k] / f->scale[k] / fmax(2, room[k] / ((k == 0 ? 9 : 5) * unit));
  if (!v->plot->stretched) { /* the same step on both axes */
    double wanted = floor(fmax(2, fmin(room[0], room[1]) / (9 * unit)));
    step[0] = step[1] = fmin(room[0], room[1]) / f->scale[0] / wanted;
  }
  for (int k = 0; k < 2; k++) {
    double span = 0.5 * room[k] / f->scale[k];
    ticks[k] =
        picture_ticks_choose(f->origin[k] - span, f->origin[k] + span, (unsigned)fmax(1, 2 * span / step[k] + 1e-9));
  }
  for (size_t i = 0; i < ticks[0].count; i++) {
    double x = frame_x(f, picture_tick_value(&ticks[0], i));
    sheet_line(s, x, f->y0, x, f->y1, 1, GRID);
    picture_tick_text(&ticks[0], i, text);
    sheet_text(s, x, f->y1 + 1.9 * unit, SMALL * unit, 1, INK, text);
  }
  for (size_t i = 0; i < ticks[1].count; i++) {
    double y = frame_y(f, picture_tick_value(&ticks[1], i));
    sheet_line(s, f->x0, y, f->x1, y, 1, GRID);
    picture_tick_text(&ticks[1], i, text);
    draw_text(s, f->x0 - 0.8 * unit, y + 0.42 * unit, SMALL * unit, (LEFT - 1) * unit, 2, INK, text);
  }
  sheet_line(s, f->x0, f->y0, f->x1, f->y0, 1.2, FRAME);
  sheet_line(s, f->x0, f->y1, f->x1, f->y1, 1.2, FRAME);
  sheet_line(s, f->x0, f->y0, f->x0, f->y1, 1.2, FRAME);
  sheet_line(s, f->x1, f->y0, f->x1, f->y1, 1.2, FRAME);
  if (v->plot->labels[0]) sheet_text(s, f->middle[0], f->y1 + 3.5 * unit, SMALL * unit, 1, INK, v->plot->labels[0]);
  if (v->plot->labels[1]) sheet_text(s, f->x0, f->y0 - 0.7 * unit, SMALL * unit, 0, INK, v->plot->labels[1]);
}

static double line_width(const batten_plot_layer *l, double side) {
  return 1e-3 * side * (l->width > 0 ? l->width : 2);
}

static double mark_radius(const batten_plot_layer *l, const plot_view *v, double side) {
  const picture_frame *f = &v->frame;
  if (l->width > 0) return 1e-3 * side * l->width;
  double spread = sqrt((f->x1 - f->x0) * (f->y1 - f->y0) / fmax(1, (double)l->count));
  return fmin(0.32 * v->unit, fmax(1, 0.06 * spread));
}

static void draw_layer(picture_sheet *s, const plot_view *v, const batten_plot_layer *l, double side, double *xy) {
  const size_t whole[2] = {0, l->count};
  sheet_parts parts = {l->part_count ? l->part_count : 1, l->part_count ? l->starts : whole, l->points};
  switch (l->kind) {
    case BATTEN_PLOT_LINE:
      sheet_polylines(s, &v->frame, &parts, l->closed, line_width(l, side), l->color);
      break;
    case BATTEN_PLOT_AREA:
      sheet_area(s, &v->frame, &parts, l->color, xy);
      break;
    case BATTEN_PLOT_DOTS:
      sheet_marks(s, &v->frame, l->count, l->points, SHEET_DOT, mark_radius(l, v, side), 0.1 * v->unit, l->color);
      break;
    default:
      sheet_marks(s, &v->frame, l->count, l->points, l->kind == BATTEN_PLOT_CROSSES ? SHEET_CROSS : SHEET_RING,
                  mark_radius(l, v, side), fmax(1.2, 1.4e-3 * side), l->color);
  }
}

static void draw_sample(picture_sheet *s, const plot_view *v, const batten_plot_layer *l, double right, double middle,
                        double side) {
  double unit = v->unit, left = right - 1.8 * unit, place[2] = {0, 0};
  if (l->kind == BATTEN_PLOT_LINE || l->kind == BATTEN_PLOT_AREA) {
    double width = l->kind == BATTEN_PLOT_AREA ? SMALL * unit : line_width(l, side), cap = 0.5 * width;
    sheet_line(s, left + cap, middle, right - cap, middle, width, l->color);
    return;
  }
  batten_plot_layer one = *l;
  one.width = 1e3 * mark_radius(l, v, side) / side; /* as in the plot */
  one.count = 1;
  one.points = place;
  one.part_count = 0;
  picture_frame f = {left, middle - unit, right, middle + unit, {0, 0}, {0.5 * (left + right), middle}, {1, 1}};
  plot_view sample = {.unit = unit, .frame = f};
  draw_layer(s, &sample, &one, side, NULL);
}

/* Samples of the layers with a name. */
static void draw_legend(picture_sheet *s, const plot_view *v, double side) {
  legend_place at = {0};
  double unit = v->unit, height = SMALL * unit;
  for (size_t i = v->plot->layer_count; i-- > 0;) {
    const batten_plot_layer *l = &v->plot->layers[i];
    if (!l->label) continue;
    legend_next(v, l->label, &at);
    double base = v->frame.y0 - (0.7 + 1.5 * at.row) * unit, right = v->frame.x0 + at.right;
    draw_text(s, right, base, height, at.width - 2.5 * unit, 2, INK, l->label);
    draw_sample(s, v, l, right - at.width + 1.8 * unit, base - 0.5 * height, side);
  }
}

static void draw_view(picture_sheet *s, const plot_view *v, double side, double *xy) {
  draw_axes(s, v);
  for (size_t i = 0; i < v->plot->layer_count; i++)
    if (v->plot->layers[i].count) draw_layer(s, v, &v->plot->layers[i], side, xy);
  if (v->plot->caption)
    draw_text(s, v->frame.x0, v->y0 + 1.7 * v->unit, 0.95 * v->unit, frame_width(v), 0, TITLE, v->plot->caption);
  draw_legend(s, v, side);
}

static batten_status draw_all(batten_context *ctx, picture_sheet *s, size_t count, const plot_view *views,
                              const batten_picture_options *o, double *xy) {
  double side = fmin(o->width, o->height), unit = fmax(6, side / 55);
  for (size_t i = 0; i < count; i++) {
    if (views[i].plot->layer_count) draw_view(s, &views[i], fmax(364, side), xy);
    batten_status st = batten_progress(ctx, "picture", 0.9 * (double)(i + 1) / (double)count);
    if (st < 0) return st;
  }
  double left = views[0].frame.x0;
  if (o->title) draw_text(s, left, 2.8 * unit, 1.25 * unit, o->width - left - unit, 0, TITLE, o->title);
  return BATTEN_OK;
}

static batten_status write_svg(batten_context *ctx, size_t count, const plot_view *views,
                               const batten_picture_options *o, double *xy, const char *path) {
  bx_writer w;
  picture_sheet s = {.svg = &w};
  batten_status st = bx_create(&w, ctx, path);
  if (st < 0) return st;
  bx_print(&w,
           "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%u\" height=\"%u\" viewBox=\"0 0 %u %u\" "
           "font-family=\"Helvetica, Arial, sans-serif\">\n<rect width=\"%u\" height=\"%u\" fill=\"#ffffff\"/>\n",
           o->width, o->height, o->width, o->height, o->width, o->height);
  st = draw_all(ctx, &s, count, views, o, xy);
  bx_put_text(&w, "</svg>\n");
  if (st < 0) bx_writer_fail(&w, st);
  return bx_commit(&w);
}

static batten_status write_png(batten_context *ctx, size_t count, const plot_view *views,
                               const batten_picture_options *o, double *xy, const char *path) {
  picture_sheet s = {.svg = NULL};
  batten_status st = picture_image_new(ctx, o->width, o->height, &s.image);
  if (st < 0) return st;
  st = draw_all(ctx, &s, count, views, o, xy);
  if (st >= 0) st = picture_write_png(ctx, &s.image, path);
  picture_image_free(ctx, &s.image);
  return st;
}

/* Points of the longest part of an area. */
static size_t longest_area(size_t count, const batten_plot *plots) {
  size_t longest = 0;
  for (size_t i = 0; i < count; i++)
    for (size_t j = 0; j < plots[i].layer_count; j++) {
      const batten_plot_layer *l = &plots[i].layers[j];
      if (l->kind == BATTEN_PLOT_AREA && l->count > longest) longest = l->count;
    }
  return longest;
}

batten_status batten_picture_plots(batten_context *ctx, unsigned rows, unsigned columns, const batten_plot *plots,
                                   const batten_picture_options *opt, const char *path) {
  batten_picture_options o = opt ? *opt : batten_picture_options_default();
  o = (batten_picture_options){.struct_size = o.struct_size, .width = o.width, .height = o.height, .title = o.title};
  batten_status st = picture_check_options(ctx, &o, 2, &o);
  if (st < 0) return st;
  bool svg = picture_has_extension(path, ".svg");
  if (!svg && !picture_has_extension(path, ".png"))
    return batten_fail(ctx, BATTEN_E_INVALID, "%s: unknown extension for a picture in the plane; use .svg or .png",
                       path);
  if (rows < 1 || rows > PLOTS_MAX || columns < 1 || columns > PLOTS_MAX)
    return batten_fail(ctx, BATTEN_E_INVALID, "rows x columns: %u x %u; each must be 1 .. %d", rows, columns,
                       PLOTS_MAX);
  if (!plots) return batten_fail(ctx, BATTEN_E_INVALID, "plots: NULL with %u x %u of them", rows, columns);
  size_t count = (size_t)rows * columns;
  plot_view *views = batten_alloc_array(ctx, count, sizeof *views);
  double *xy = NULL;
  if (!views) return BATTEN_E_NOMEM;
  st = lay_out(ctx, rows, columns, plots, &o, views);
  if (st >= 0) st = batten_progress(ctx, "picture", 0);
  if (st >= 0) {
    xy = batten_alloc_array(ctx, longest_area(count, plots), 2 * sizeof *xy);
    st = xy ? BATTEN_OK : BATTEN_E_NOMEM;
  }
  if (st >= 0) st = svg ? write_svg(ctx, count, views, &o, xy, path) : write_png(ctx, count, views, &o, xy, path);
  batten_free(ctx, xy);
  batten_free(ctx, views);
  return st;
}
