/* Lettering of our own: letters as pen strokes, so that they stay sharp at any size.
 *
 * A glyph is a text of strokes parted by blanks; a stroke is a list of points, each a digit for x and a letter for
 * y: 'a' is -3, 'd' the base line, 'i' the height of small letters, 'l' that of capitals (8 units). A stroke that
 * starts with '~' is a quadratic B-spline with clamped ends over its points, the others are polylines. */
#include "picture.h"

#include <math.h>
#include <string.h>

enum { GLYPH_FIRST = 33, GLYPH_LAST = 126, CURVE_STEPS = 8 };

static const char *const glyphs[GLYPH_LAST - GLYPH_FIRST + 1] = {
    /* ! */ "1l1g 1d1d",
    /* " */ "1l1j 3l3j",
    /* # */ "2k1e 5k4e 0i6i 0g6g",
    /* $ */ "~6j6k3k0k0h3h6h6e3e0e0f 3l3d",
    /* % */ "6l0d ~1l0l0i2i2l1l ~5g4g4d6d6g5g",
    /* & */ "~6d1j1l3l5l4i0g0d3d5d6g",
    /* ' */ "1l1j",
    /* ( */ "~3m1k0h0e1b3a",
    /* ) */ "~0m2k3h3e2b0a",
    /* * */ "3k3g 1j5h 5j1h",
    /* + */ "3j3d 0g6g",
    /* , */ "1d1c0b",
    /* - */ "0g4g",
    /* . */ "1d1d",
    /* / */ "0c5l",
    /* 0 */ "~3l0l0d6d6l3l",
    /* 1 */ "1j4l4d",
    /* 2 */ "~0j0l3l6l6j6h3g0d 0d6d",
    /* 3 */ "~0k1l3l6l6h2h ~2h6h6d3d1d0e",
    /* 4 */ "4d4l0f6f",
    /* 5 */ "5l1l0h ~0h2i6j6d3d1d0e",
    /* 6 */ "~5l1k0g0d3d6d6h3h1h0f",
    /* 7 */ "0l6l2d",
    /* 8 */ "~3l0l0h6h6l3l ~3h0h0d6d6h3h",
    /* 9 */ "~1d5e6i6l3l0l0h3h5h6j",
    /* : */ "1h1h 1d1d",
    /* ; */ "1h1h 1d1c0b",
    /* < */ "5j0g5d",
    /* = */ "0h5h 0f5f",
    /* > */ "0j5g0d",
    /* ? */ "~0j0l3l6l6j6h3h3f 3d3d",
    /* @ */ "~4f2e2i5i5g ~5i5f7f7l4l0l0d4d6e",
    /* A */ "0d3l6d 1g5g",
    /* B */ "0d0l ~0l3l6l6h3h0h ~0h3h6h6d3d0d",
    /* C */ "~6j6l3l0l0d3d6d6f",
    /* D */ "0d0l ~0l2l6l6d2d0d",
    /* E */ "5l0l0d5d 0h4h",
    /* F */ "5l0l0d 0h4h",
    /* G */ "~6j6l3l0l0d3d6d6h 6h4h",
    /* H */ "0d0l 6d6l 0h6h",
    /* I */ "1d1l",
    /* J */ "~4l4f4d2d0d0f",
    /* K */ "0d0l 6l0g 2i6d",
    /* L */ "0l0d5d",
    /* M */ "0d0l3g6l6d",
    /* N */ "0d0l6d6l",
    /* O */ "~3l0l0d6d6l3l",
    /* P */ "0d0l ~0l3l6l6h3h0h",
    /* Q */ "~3l0l0d6d6l3l 4f6d",
    /* R */ "0d0l ~0l3l6l6h3h0h 3h6d",
    /* S */ "~6j6l3l0l0h3h6h6d3d0d0f",
    /* T */ "0l6l 3l3d",
    /* U */ "~0l0f0d3d6d6f6l",
    /* V */ "0l3d6l",
    /* W */ "0l2d4l6d8l",
    /* X */ "0l6d 6l0d",
    /* Y */ "0l3h6l 3h3d",
    /* Z */ "0l6l0d6d",
    /* [ */ "2m0m0a2a",
    /* \ */ "0l5c",
    /* ] */ "0m2m2a0a",
    /* ^ */ "0j2l4j",
    /* _ */ "0c6c",
    /* ` */ "0l2k",
    /* a */ "5i5d ~5g5i2i0i0d2d5d5f",
    /* b */ "0l0d ~0g0i3i5i5d3d0d0f",
    /* c */ "~5h5i3i0i0d3d5d5e",
    /* d */ "5l5d ~5g5i2i0i0d2d5d5f",
    /* e */ "0g5g ~5g5i3i0i0d3d4d5e",
    /* f */ "~4l2l2i 2j2d 0i4i",
    /* g */ "5i5d ~5d5a2a1a0b ~5g5i2i0i0d2d5d5f",
    /* h */ "0l0d ~0g0i3i5i5g 5g5d",
    /* i */ "1i1d 1k1k",
    /* j */ "2i2c ~2c2a0a 2k2k",
    /* k */ "0l0d 4i0f 1g5d",
    /* l */ "1l1d",
    /* m */ "0i0d ~0g0i2i4i4g 4g4d ~4g4i6i8i8g 8g8d",
    /* n */ "0i0d ~0g0i3i5i5g 5g5d",
    /* o */ "~3i0i0d6d6i3i",
    /* p */ "0i0a ~0g0i3i5i5d3d0d0f",
    /* q */ "5i5a ~5g5i2i0i0d2d5d5f",
    /* r */ "0i0d ~0g0i3i4i",
    /* s */ "~5h5i3i0i0g3g5g5d3d0d0e",
    /* t */ "2k2e ~2e2d4d 0i4i",
    /* u */ "5i5d ~0i0f0d2d5d5g",
    /* v */ "0i3d6i",
    /* w */ "0i2d4i6d8i",
    /* x */ "0i5d 5i0d",
    /* y */ "0i3d 6i3d1a",
    /* z */ "0i5i0d5d",
    /* { */ "~3m1m1k1g0g ~0g1g1c1a3a",
    /* | */ "1m1a",
    /* } */ "~0m2m2k2g3g ~3g2g2c2a0a",
    /* ~ */ "~0f1h3g5f6h",
};

/* Letters narrower than the grid is wide, and the gap between them, in units of 1/8 of the capitals' height. */
static const double unit_width = 0.8, gap = 2.0, blank = 3.0;

/* Other characters become one '?' each: the bytes of UTF-8 after their first are passed over. */
static bool continues(char c) { return ((unsigned char)c & 0xc0) == 0x80; }

static const char *glyph_of(char c) {
  unsigned char u = (unsigned char)c;
  return glyphs[(u < GLYPH_FIRST || u > GLYPH_LAST ? '?' : u) - GLYPH_FIRST];
}

static double glyph_width(const char *glyph) {
  char widest = '0';
  for (const char *p = glyph; *p; p++)
    if (*p >= '0' && *p <= '9' && *p > widest) widest = *p;
  return (widest - '0') * unit_width;
}

double picture_text_width(double height, const char *text) {
  double width = 0;
  for (const char *p = text; *p; p++)
    width += *p == ' ' ? blank : continues(*p) ? 0 : glyph_width(glyph_of(*p)) + gap;
  return (*text ? width - gap : 0) * height / 8;
}

typedef struct pen {
  picture_image *image;
  double x, y, scale, radius;
} pen;

static void draw(const pen *p, const double a[2], const double b[2]) {
  picture_mask_capsule(p->image, p->x + unit_width * p->scale * a[0], p->y - p->scale * a[1],
                       p->x + unit_width * p->scale * b[0], p->y - p->scale * b[1], p->radius);
}

static void stroke_point(const char *stroke, size_t i, double out[2]) {
  out[0] = stroke[2 * i] - '0';
  out[1] = stroke[2 * i + 1] - 'd';
}

static void draw_curve(const pen *p, const char *stroke, size_t count) {
  double from[2];
  stroke_point(stroke, 0, from);
  for (size_t i = 1; i + 1 < count; i++) {
    double start[2] = {from[0], from[1]}, middle[2], end[2];
    stroke_point(stroke, i, middle);
    stroke_point(stroke, i + 1, end);
    if (i + 2 < count)
      for (size_t k = 0; k < 2; k++) end[k] = 0.5 * (middle[k] + end[k]);
    for (int s = 1; s <= CURVE_STEPS; s++) {
      double t = (double)s / CURVE_STEPS, to[2];
      for (size_t k = 0; k < 2; k++)
        to[k] = (1 - t) * (1 - t) * start[k] + 2 * t * (1 - t) * middle[k] + t * t * end[k];
      draw(p, from, to);
      memcpy(from, to, sizeof from);
    }
  }
}

static void draw_stroke(const pen *p, const char *stroke, size_t length) {
  if (stroke[0] == '~') {
    draw_curve(p, stroke + 1, (length - 1) / 2);
    return;
  }
  for (size_t i = 0; 2 * i + 3 < length; i++) {
    double a[2], b[2];
    stroke_point(stroke, i, a);
    stroke_point(stroke, i + 1, b);
    draw(p, a, b);
  }
}

void picture_mask_text(picture_image *image, double x, double y, double height, double weight, const char *text) {
  pen p = {.image = image, .x = x, .y = y, .scale = height / 8, .radius = weight * height / 16};
  for (const char *c = text; *c; c++) {
    if (*c == ' ') {
      p.x += blank * p.scale;
      continue;
    }
    if (continues(*c)) continue;
    const char *glyph = glyph_of(*c);
    for (const char *s = glyph; *s;) {
      size_t length = strcspn(s, " ");
      draw_stroke(&p, s, length);
      s += length + (s[length] == ' ');
    }
    p.x += (glyph_width(glyph) + gap) * p.scale;
  }
}
