/* Images in linear light, the coverage mask, PNG files. See picture.h.
 *
 * Polygons are covered exactly: each edge adds its signed area to the pixels of a row that it passes and the rest
 * of its height to the next pixel to the right; the running sum along the row is then the winding number weighted
 * by area. Solid outlines have their holes turned the other way, so the sum is 0 or 1 inside pixels. */
#include "picture.h"
#include "write_file.h"

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>

batten_status picture_image_new(batten_context *ctx, size_t width, size_t height, picture_image *out) {
  picture_image image = {.width = width,
                         .height = height,
                         .dirty_x0 = width,
                         .dirty_y0 = height,
                         .whole_width = width,
                         .whole_height = height};
  image.rgb = batten_alloc_array(ctx, width * height, 3 * sizeof *image.rgb);
  image.mask = batten_alloc_array(ctx, width * height, sizeof *image.mask);
  if (!image.rgb || !image.mask) {
    picture_image_free(ctx, &image);
    return BATTEN_E_NOMEM;
  }
  for (size_t i = 0; i < 3 * width * height; i++) image.rgb[i] = 1.0f;
  memset(image.mask, 0, width * height * sizeof *image.mask);
  *out = image;
  return BATTEN_OK;
}

void picture_image_free(batten_context *ctx, picture_image *image) {
  batten_free(ctx, image->rgb);
  batten_free(ctx, image->mask);
  image->rgb = image->mask = NULL;
}

picture_color picture_background(const picture_image *im, size_t x, size_t y) {
  float u = ((float)(im->whole_x + x) + 0.5f) / (float)im->whole_width - 0.5f;
  float v = ((float)(im->whole_y + y) + 0.5f) / (float)im->whole_height - 0.5f;
  float level = 0.93f - 0.16f * v - 0.36f * (u * u + v * v);
  return (picture_color){level * 0.985f, level * 0.995f, level};
}

void picture_paste(const picture_image *im, picture_image *whole) {
  for (size_t y = 0; y < im->height; y++)
    memcpy(whole->rgb + 3 * ((im->whole_y + y) * whole->width + im->whole_x), im->rgb + 3 * y * im->width,
           3 * im->width * sizeof *im->rgb);
}

/* ---- mask ---------------------------------------------------------------------------------------- */

static size_t clamp_index(double x, size_t limit) {
  if (!(x > 0)) return 0;
  return x >= (double)limit ? limit : (size_t)x;
}

/* Pixels that [x0, x1] x [y0, y1] touches, noted as dirty. */
typedef struct pixel_box {
  size_t x0, y0, x1, y1;
} pixel_box;

static pixel_box touch(picture_image *im, double x0, double y0, double x1, double y1) {
  pixel_box b = {clamp_index(floor(x0), im->width), clamp_index(floor(y0), im->height),
                 clamp_index(ceil(x1), im->width), clamp_index(ceil(y1), im->height)};
  if (b.x0 >= b.x1 || b.y0 >= b.y1) return (pixel_box){0};
  if (b.x0 < im->dirty_x0) im->dirty_x0 = b.x0;
  if (b.y0 < im->dirty_y0) im->dirty_y0 = b.y0;
  if (b.x1 > im->dirty_x1) im->dirty_x1 = b.x1;
  if (b.y1 > im->dirty_y1) im->dirty_y1 = b.y1;
  return b;
}

void picture_mask_capsule(picture_image *im, double x0, double y0, double x1, double y1, double radius) {
  double reach = radius + 1;
  pixel_box b = touch(im, fmin(x0, x1) - reach, fmin(y0, y1) - reach, fmax(x0, x1) + reach, fmax(y0, y1) + reach);
  double dx = x1 - x0, dy = y1 - y0, length2 = dx * dx + dy * dy;
  /* Thinner than a pixel: a line one pixel wide, but paler. */
  double strength = fmin(1, 2 * radius), drawn = fmax(radius, 0.5);
  for (size_t y = b.y0; y < b.y1; y++)
    for (size_t x = b.x0; x < b.x1; x++) {
      double px = (double)x + 0.5 - x0, py = (double)y + 0.5 - y0;
      double t = length2 > 0 ? fmin(1, fmax(0, (px * dx + py * dy) / length2)) : 0;
      double coverage = strength * fmin(1, fmax(0, drawn + 0.5 - hypot(px - t * dx, py - t * dy)));
      float *m = &im->mask[y * im->width + x];
      if (coverage > *m) *m = (float)coverage;
    }
}

/* The part of an edge within one row: from x0 to x1 (both in [0, width]), height h signed, added to the row. */
static void add_span(float *row, size_t width, double x0, double x1, double h) {
  if (x0 > x1) {
    double t = x0;
    x0 = x1;
    x1 = t;
  }
  size_t first = clamp_index(x0, width - 1), last = clamp_index(x1, width - 1);
  if (first == last) {
    double right = (double)first + 1 - 0.5 * (x0 + x1); /* mean part of the pixel right of the edge */
    row[first] += (float)(h * right);
    if (first + 1 < width) row[first + 1] += (float)(h * (1 - right));
    return;
  }
  double slope = h / (x1 - x0), carried = 0;
  for (size_t x = first; x <= last; x++) {
    double a = fmax(x0, (double)x), b = fmin(x1, (double)x + 1);
    double part = slope * (b - a), right = (double)x + 1 - 0.5 * (a + b);
    row[x] += (float)(part * right + carried);
    carried = part * (1 - right);
  }
  if (last + 1 < width) row[last + 1] += (float)carried;
}

static void add_edge(picture_image *im, double x0, double y0, double x1, double y1) {
  double width = (double)im->width, sign = 1;
  if (y0 > y1) {
    double t = x0;
    x0 = x1, x1 = t;
    t = y0, y0 = y1, y1 = t;
    sign = -1;
  }
  size_t first = clamp_index(floor(y0), im->height), end = clamp_index(ceil(y1), im->height);
  for (size_t y = first; y < end; y++) {
    double a = fmax(y0, (double)y), b = fmin(y1, (double)y + 1);
    if (!(b > a)) continue;
    double xa = x0 + (x1 - x0) * ((a - y0) / (y1 - y0)), xb = x0 + (x1 - x0) * ((b - y0) / (y1 - y0));
    add_span(&im->mask[y * im->width], im->width, fmin(fmax(xa, 0), width), fmin(fmax(xb, 0), width), sign * (b - a));
  }
}

void picture_mask_polygon(picture_image *im, size_t count, const double *xy) {
  if (count < 3) return;
  double lower = xy[1], upper = xy[1];
  for (size_t i = 0; i < count; i++) {
    const double *p = xy + 2 * i, *q = xy + 2 * (i + 1 < count ? i + 1 : 0);
    add_edge(im, p[0], p[1], q[0], q[1]);
    lower = fmin(lower, p[1]);
    upper = fmax(upper, p[1]);
  }
  touch(im, 0, lower, (double)im->width, upper); /* the sums run on to the end of the row */
}

void picture_mask_fold(picture_image *im) {
  for (size_t y = im->dirty_y0; y < im->dirty_y1; y++) {
    float sum = 0, *row = &im->mask[y * im->width];
    for (size_t x = 0; x < im->width; x++) {
      sum += row[x];
      float coverage = fabsf(sum);
      row[x] = coverage < 1e-4f ? 0 : fminf(coverage, 1); /* 1e-4: rounding of the sum */
    }
  }
}

void picture_mask_rectangle(picture_image *im, double x0, double y0, double x1, double y1) {
  pixel_box b = touch(im, x0, y0, x1, y1);
  for (size_t y = b.y0; y < b.y1; y++)
    for (size_t x = b.x0; x < b.x1; x++) {
      double w = fmin(x1, (double)x + 1) - fmax(x0, (double)x), h = fmin(y1, (double)y + 1) - fmax(y0, (double)y);
      if (w > 0 && h > 0) im->mask[y * im->width + x] = fmaxf(im->mask[y * im->width + x], (float)(w * h));
    }
}

void picture_blend(picture_image *im, picture_color color, double opacity) {
  for (size_t y = im->dirty_y0; y < im->dirty_y1; y++)
    for (size_t x = im->dirty_x0; x < im->dirty_x1; x++) {
      size_t at = y * im->width + x;
      float a = im->mask[at] * (float)opacity, *p = &im->rgb[3 * at];
      im->mask[at] = 0;
      if (a <= 0) continue;
      p[0] += a * (color.r - p[0]);
      p[1] += a * (color.g - p[1]);
      p[2] += a * (color.b - p[2]);
    }
  im->dirty_x0 = im->width;
  im->dirty_y0 = im->height;
  im->dirty_x1 = im->dirty_y1 = 0;
}

/* ---- PNG ----------------------------------------------------------------------------------------- */

static png_voidp png_allocate(png_structp png, png_alloc_size_t bytes) {
  return batten_alloc(png_get_mem_ptr(png), bytes);
}
static void png_release(png_structp png, png_voidp block) { batten_free(png_get_mem_ptr(png), block); }

static void png_failed(png_structp png, png_const_charp text) {
  snprintf(png_get_error_ptr(png), 128, "%s", text);
  longjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)), 1);
}
static void png_warned(png_structp png, png_const_charp text) { (void)png, (void)text; }

/* Rows are turned into bytes one at a time, with the rounding spread by an ordered pattern: smooth shades of an
 * 8-bit picture would show steps else. */
static void quantize_row(const picture_image *im, size_t y, png_byte *row) {
  static const unsigned char pattern[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};
  for (size_t x = 0; x < im->width; x++) {
    double shift = (pattern[y & 3][x & 3] + 0.5) / 16 - 0.5;
    for (size_t c = 0; c < 3; c++) {
      double v = im->rgb[3 * (y * im->width + x) + c];
      v = v <= 0 ? 0 : v >= 1 ? 1 : v;
      v = 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055); /* IEC 61966-2-1 */
      double whole = floor(v + 0.5);
      /* Values that are whole (flat colours) stay as they are. */
      if (fabs(v - whole) > 0.05) whole = floor(v + 0.5 + shift);
      row[3 * x + c] = (png_byte)fmin(255, fmax(0, whole));
    }
  }
}

static void png_put(png_structp png, png_bytep bytes, size_t count) { bx_put(png_get_io_ptr(png), bytes, count); }
static void png_flush_nothing(png_structp png) { (void)png; }

/* False when libpng gave up; text then says why, or is empty for want of memory. What must survive the longjmp
 * lies behind pointers or is not changed after setjmp. */
static bool encode(batten_context *ctx, const picture_image *im, bx_writer *writer, png_byte *row, char text[128]) {
  png_structp png =
      png_create_write_struct_2(PNG_LIBPNG_VER_STRING, text, png_failed, png_warned, ctx, png_allocate, png_release);
  if (!png) return false;
  png_infop info = png_create_info_struct(png);
  if (!info || setjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, writer, png_put, png_flush_nothing);
  png_set_user_limits(png, PICTURE_SIDE_MAX, PICTURE_SIDE_MAX);
  png_set_IHDR(png, info, (png_uint_32)im->width, (png_uint_32)im->height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(png, info);
  for (size_t y = 0; y < im->height; y++) {
    quantize_row(im, y, row);
    png_write_row(png, row);
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

batten_status picture_write_png(batten_context *ctx, const picture_image *im, const char *path) {
  png_byte *row = batten_alloc_array(ctx, im->width, 3);
  if (!row) return BATTEN_E_NOMEM;
  bx_writer writer;
  batten_status st = bx_create(&writer, ctx, path);
  if (st == BATTEN_OK) {
    char text[128] = "";
    if (!encode(ctx, im, &writer, row, text)) {
      /* libpng and zlib report a refused allocation as errors of their own. */
      bool memory = text[0] == '\0' || strstr(text, "emory") != NULL;
      bx_writer_fail(&writer, memory ? batten_fail(ctx, BATTEN_E_NOMEM, "%s: no memory to compress the picture", path)
                                     : batten_fail(ctx, BATTEN_E_IO, "%s: %s", path, text));
    }
    st = bx_commit(&writer);
  }
  batten_free(ctx, row);
  return st;
}
