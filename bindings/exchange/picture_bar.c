/* Titles, and the scale of the colours. */
#include "picture.h"

#include <math.h>
#include <string.h>

double picture_title_room(const batten_picture_options *o, double unit) {
  return (o->title ? 3.4 * unit : 0) + (o->caption ? 1.9 * unit : 0);
}

/* A long line is written smaller, so that its end is in the picture. */
static void title_line(picture_image *im, double left, double base, double height, double weight, const char *text) {
  double room = (double)im->width - 1.5 * left, width = picture_text_width(height, text);
  if (width > room && room > 0) height *= room / width;
  picture_mask_text(im, left, base, height, weight, text);
}

void picture_draw_title(picture_image *im, const batten_picture_options *o, double unit, double left) {
  double base = o->title ? 3.2 * unit : 1.2 * unit;
  if (o->title) {
    title_line(im, left, base, 1.25 * unit, 1.15, o->title);
    picture_blend(im, picture_srgb(0x2a2d33), 0.95);
  }
  if (o->caption) {
    title_line(im, left, base + 1.9 * unit, 0.9 * unit, 1, o->caption);
    picture_blend(im, picture_srgb(0x3a3e46), 0.9);
  }
}

static picture_ticks color_ticks(const batten_picture_options *o) {
  return picture_ticks_choose(o->color_lower, o->color_upper, 6);
}

/* The bar's own width, the numbers to its right, and a margin; all in units of the lettering's height. */
static const double bar_width = 1.2, bar_to_numbers = 0.75, bar_margin = 0.8;

bool picture_has_color_bar(const batten_picture_options *o) {
  return o->colors && o->color_map != BATTEN_MAP_STRIPES && !o->no_color_bar;
}

double picture_color_bar_room(const batten_picture_options *o, double unit) {
  picture_ticks ticks = color_ticks(o);
  double numbers = 0;
  for (size_t i = 0; i < ticks.count; i++) {
    char text[PICTURE_TICK_SIZE];
    picture_tick_text(&ticks, i, text);
    numbers = fmax(numbers, picture_text_width(unit, text));
  }
  return fmax(7 * unit, (bar_width + bar_to_numbers + bar_margin) * unit + numbers);
}

/* Over the bar; in two lines, parted at the last blank, where one would reach into the view. */
static void draw_color_label(picture_image *im, const char *label, double x, double base, double unit) {
  double end = (double)im->width - bar_margin * unit;
  const char *blank = picture_text_width(unit, label) > end - x ? strrchr(label, ' ') : NULL;
  char first[128];
  size_t length = blank ? (size_t)(blank - label) : 0;
  if (length > 0 && length < sizeof first) {
    memcpy(first, label, length);
    first[length] = '\0';
    picture_mask_text(im, fmin(x, end - picture_text_width(unit, first)), base - 1.6 * unit, unit, 1, first);
    label = blank + 1;
  }
  picture_mask_text(im, fmin(x, end - picture_text_width(unit, label)), base, unit, 1, label);
}

/* Vertical bar in the middle half of the height, with ticks and numbers to its right. */
void picture_draw_color_bar(picture_image *im, const batten_picture_options *o, double unit) {
  double x = (double)im->width - picture_color_bar_room(o, unit), width = bar_width * unit;
  double top = 0.25 * (double)im->height, bottom = 0.75 * (double)im->height;
  for (size_t y = (size_t)top; y < (size_t)bottom; y++) {
    picture_mask_rectangle(im, x, (double)y, x + width, (double)y + 1);
    picture_blend(im, picture_colormap(o->color_map, (bottom - (double)y - 0.5) / (bottom - top)), 1);
  }
  const picture_color ink = picture_srgb(0x2a2d33);
  picture_ticks ticks = color_ticks(o);
  for (size_t i = 0; i < ticks.count; i++) {
    double t = (picture_tick_value(&ticks, i) - o->color_lower) / (o->color_upper - o->color_lower);
    double y = bottom - t * (bottom - top);
    if (y < top - 0.5 || y > bottom + 0.5) continue;
    char text[PICTURE_TICK_SIZE];
    picture_tick_text(&ticks, i, text);
    picture_mask_capsule(im, x + width, y, x + width + 0.4 * unit, y, 0.05 * unit);
    picture_mask_text(im, x + width + bar_to_numbers * unit, y + 0.5 * unit, unit, 1, text);
  }
  if (o->color_label) draw_color_label(im, o->color_label, x, top - 1.1 * unit, unit);
  picture_blend(im, ink, 0.9);
}
