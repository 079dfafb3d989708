/* Options of pictures and what is wrong with them. */
#include "picture.h"

#include <math.h>
#include <string.h>
#include <strings.h>

#include "base/checked.h"

batten_picture_options batten_picture_options_default(void) {
  return (batten_picture_options){.struct_size = sizeof(batten_picture_options),
                                  .width = 1200,
                                  .height = 900,
                                  .azimuth_deg = 35,
                                  .elevation_deg = 22,
                                  .up_axis = 2};
}

bool picture_has_extension(const char *path, const char *extension) {
  size_t length = strlen(path), tail = strlen(extension);
  return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

static batten_status check_lines(batten_context *ctx, const batten_picture_options *o) {
  if (o->line_count && !o->lines)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.lines: NULL with opt.line_count = %zu", o->line_count);
  size_t total = 0;
  for (size_t i = 0; i < o->line_count; i++) {
    const batten_picture_lines *l = &o->lines[i];
    size_t numbers;
    if (l->count && !l->segments)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.lines[%zu].segments: NULL with count = %zu", i, l->count);
    if (!batten_add(total, l->count, &total) || !batten_mul3(total, 6, sizeof(double), &numbers))
      return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.lines[%zu].count: %zu is too many", i, l->count);
    size_t bad = batten_first_nonfinite(6 * l->count, l->segments);
    if (bad < 6 * l->count)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.lines[%zu].segments[%zu][%zu]: coordinate %zu is not finite", i,
                         bad / 6, bad / 3 % 2, bad % 3);
    if (l->color > 0xffffff)
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.lines[%zu].color: 0x%x; must be 0 .. 0xffffff", i, l->color);
    if (!(l->width >= 0 && l->width <= 100))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.lines[%zu].width: %g; must be 0 .. 100", i, l->width);
    if (!(l->hidden >= 0 && l->hidden <= 1))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.lines[%zu].hidden: %g; must be 0 .. 1", i, l->hidden);
  }
  return BATTEN_OK;
}

static batten_status check_axes(batten_context *ctx, const batten_picture_axes *a) {
  for (size_t k = 0; k < 3; k++) {
    if (!(a->lower[k] < a->upper[k]) || !isfinite(a->upper[k] - a->lower[k]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.axes->lower[%zu], upper: %g, %g; must be finite and in order", k,
                         a->lower[k], a->upper[k]);
    if (!(a->from[k] < a->to[k]) || !isfinite(a->to[k] - a->from[k]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.axes->from[%zu], to: %g, %g; must be finite and in order", k,
                         a->from[k], a->to[k]);
  }
  return BATTEN_OK;
}

batten_status picture_check_options(batten_context *ctx, const batten_picture_options *opt, unsigned dimension,
                                    batten_picture_options *out) {
  batten_picture_options o = opt ? *opt : batten_picture_options_default();
  batten_status st = batten_check_struct(ctx, "batten_picture_options", o.struct_size, sizeof o);
  if (st < 0) return st;
  unsigned low = PICTURE_SIDE_MIN, high = PICTURE_SIDE_MAX;
  if (o.width < low || o.width > high || o.height < low || o.height > high)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.width x height: %u x %u; each must be %u .. %u pixels", o.width,
                       o.height, low, high);
  if (!isfinite(o.azimuth_deg) || !isfinite(o.elevation_deg) || fabs(o.elevation_deg) > 90)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.azimuth_deg, elevation_deg: %g, %g; must be finite, the elevation within -90 .. 90",
                       o.azimuth_deg, o.elevation_deg);
  if (o.up_axis > 2)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.up_axis: %u; must be 0 (x), 1 (y) or 2 (z)", o.up_axis);
  if (o.point_count && !o.points)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.points: NULL with opt.point_count = %zu", o.point_count);
  if (!(o.point_scale >= 0 && o.point_scale <= 10))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.point_scale: %g; must be 0 .. 10", o.point_scale);
  size_t numbers;
  if (!batten_mul(o.point_count, dimension, &numbers))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "opt.point_count: %zu is too many", o.point_count);
  size_t bad = batten_first_nonfinite(numbers, o.points);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.points[%zu]: coordinate %zu is not finite", bad / dimension,
                       bad % dimension);
  if (!isfinite(o.color_lower) || !isfinite(o.color_upper) || o.color_lower > o.color_upper)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.color_lower, color_upper: %g, %g; must be finite and in order",
                       o.color_lower, o.color_upper);
  if ((unsigned)o.color_map > BATTEN_MAP_PARTED)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "opt.color_map: %d; must be BATTEN_MAP_LIGHTNESS, RAINBOW, STRIPES or PARTED",
                       (int)o.color_map);
  st = check_lines(ctx, &o);
  if (st >= 0 && o.axes) st = check_axes(ctx, o.axes);
  if (st < 0) return st;
  *out = o;
  return BATTEN_OK;
}
