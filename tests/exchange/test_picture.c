/* Pictures: the parts by hand (coverage, ticks, colours, lettering), then whole pictures read back. */
#include "tap.h"

#include <batten/exchange.h>
#include <unistd.h>

#include "picture.h"
#include "pixels.h"

static char directory[] = "/tmp/batten-picture-XXXXXX";
static char path_a[64], path_b[64];

static double total(const picture_image *im) {
  double sum = 0;
  for (size_t i = 0; i < im->width * im->height; i++) sum += (double)im->mask[i];
  return sum;
}

static void test_mask(batten_context *ctx) {
  picture_image im;
  T_OK(picture_image_new(ctx, 20, 10, &im), ctx);
  /* A triangle of area 12, one corner on a half pixel; and its hole, a square of area 1 turned the other way. */
  const double triangle[] = {2.5, 1, 10.5, 1, 2.5, 4}, hole[] = {3.5, 1.5, 3.5, 2.5, 4.5, 2.5, 4.5, 1.5};
  picture_mask_polygon(&im, 3, triangle);
  picture_mask_polygon(&im, 4, hole);
  picture_mask_fold(&im);
  double sum = total(&im);
  T_RATIO(fabs(sum - 11), 1e-5, "a polygon covers its area, less its hole");
  T_CHECK(im.mask[1 * 20 + 2] == 0.5f, "its edge pixel is half covered: %g", (double)im.mask[1 * 20 + 2]);
  picture_blend(&im, (picture_color){0, 0, 0}, 1);
  T_CHECK(fabsf(im.rgb[3 * (1 * 20 + 2)] - 0.5f) < 1e-6f, "and half blended");
  sum = total(&im);
  T_CHECK(sum == 0, "a blend leaves the mask empty");
  const double beyond[] = {-30, -20, 60, -20, 60, 40, -30, 40};
  picture_mask_polygon(&im, 4, beyond);
  picture_mask_fold(&im);
  sum = total(&im);
  T_CHECK(sum == 200, "a polygon around the image covers it: %g of 200", sum);
  picture_blend(&im, (picture_color){0, 0, 0}, 1);
  picture_mask_capsule(&im, 5, 5, 13, 5, 2);
  sum = total(&im);
  T_RATIO(fabs(sum / (8 * 4 + 3.14159265 * 4) - 1), 0.02, "a capsule covers its area");
  picture_blend(&im, (picture_color){0, 0, 0}, 1);
  picture_mask_text(&im, -5, 300, 4e3, 1, "far out");
  picture_blend(&im, (picture_color){0, 0, 0}, 1);
  T_RATIO(fabs(picture_text_width(8, "II") - 2 * picture_text_width(8, "I") - 2), 1e-12,
          "letters stand 2 units apart");
  T_CHECK(picture_text_width(8, "\xc3") == picture_text_width(8, "?"), "what has no letter is a question mark");
  T_CHECK(picture_text_width(8, "5 \xc2\xb5m \xe2\x82\xac") == picture_text_width(8, "5 ?m ?"),
          "and a character of several bytes is one");
  picture_image_free(ctx, &im);
}

static void check_ticks(double lower, double upper, unsigned wanted, const char *expected) {
  char text[PICTURE_TICK_SIZE], all[512] = "";
  picture_ticks t = picture_ticks_choose(lower, upper, wanted);
  bool exact = true;
  for (size_t i = 0; i < t.count && i < 20; i++) {
    picture_tick_text(&t, i, text);
    exact &= strtod(text, NULL) == picture_tick_value(&t, i);
    snprintf(all + strlen(all), sizeof all - strlen(all), "%s%s", i ? " " : "", text);
  }
  T_CHECK(exact && strcmp(all, expected) == 0, "ticks of [%g, %g]: %s", lower, upper, all);
}

static void test_numbers(void) {
  check_ticks(0, 1, 5, "0 0.2 0.4 0.6 0.8 1.0");
  check_ticks(-0.31, 0.29, 6, "-0.3 -0.2 -0.1 0 0.1 0.2");
  check_ticks(1234, 5678, 4, "2000 3000 4000 5000");
  check_ticks(-3e9, 3e9, 3, "-2e9 0 2e9");
  check_ticks(1e-12, 5e-12, 4, "1e-12 2e-12 3e-12 4e-12 5e-12");
  check_ticks(-2e-16, 2.2e-16, 6, "-2e-16 -1.5e-16 -1e-16 -5e-17 0 5e-17 1e-16 1.5e-16 2e-16");
  check_ticks(0, 0.00022, 4, "0 5e-5 1e-4 1.5e-4 2e-4");
  check_ticks(1.015e-6, 1.035e-6, 4, "1.015e-6 1.02e-6 1.025e-6 1.03e-6 1.035e-6");
  check_ticks(1.05e9, 1.09e9, 4, "1.05e9 1.06e9 1.07e9 1.08e9 1.09e9");
  check_ticks(2, 2, 5, "");
  check_ticks(7e6, 7e6 + 2, 4, "7000000.0 7000000.5 7000001.0 7000001.5 7000002.0");
  double last = -1;
  bool rises = true;
  for (int i = 0; i <= 100; i++) {
    picture_color c = picture_colormap(BATTEN_MAP_LIGHTNESS, i / 100.0);
    double y = 0.2126 * (double)c.r + 0.7152 * (double)c.g + 0.0722 * (double)c.b;
    rises &= y > last;
    last = y;
  }
  T_CHECK(rises, "the colour map gets lighter all along, to %.2f", last);
  picture_color grey = picture_colormap(BATTEN_MAP_LIGHTNESS, NAN);
  T_CHECK(grey.r == grey.g && grey.g == grey.b, "not a number is grey");
  picture_color low = picture_colormap(BATTEN_MAP_RAINBOW, 0), high = picture_colormap(BATTEN_MAP_RAINBOW, 1);
  picture_color middle = picture_colormap(BATTEN_MAP_RAINBOW, 0.5);
  T_CHECK(low.r > 4 * low.g && low.r > 4 * low.b && high.b > 4 * high.r && high.b > 4 * high.g &&
              middle.g > 4 * middle.r && middle.g > 4 * middle.b,
          "the rainbow goes from red over green to blue");
  T_CHECK(picture_stripe(3.1, 0) > 0.9 && picture_stripe(3.6, 0) < 0.1 && picture_stripe(-0.1, 0) < 0.1 &&
              picture_stripe(-0.9, 0) > 0.9,
          "stripes are white from whole numbers to the next half");
  T_RATIO(fabs(picture_stripe(7, 0.1) - 0.5), 1e-12, "a pixel on their edge has half of each");
  T_RATIO(fabs(picture_stripe(7.02, 0.1) - 0.7), 1e-12, "and 0.2 of its width further 0.7");
  T_RATIO(fabs(picture_stripe(0.3, 2) - 0.5), 1e-12, "stripes too narrow to be seen are grey");
}

/* The ball coloured by one value: its pixels are known by their colour, so its disc can be measured. */
static void test_ball(batten_context *ctx, const batten_mesh *ball) {
  size_t V = batten_mesh_vertex_count(ball);
  double *colors = malloc(V * sizeof *colors);
  for (size_t i = 0; i < V; i++) colors[i] = 0.25;
  batten_picture_options o = batten_picture_options_default();
  o.width = 320, o.height = 240, o.colors = colors, o.color_lower = 0, o.color_upper = 1;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  pixels p = read_png(path_a);
  T_CHECK(p.width == 320 && p.height == 240, "the file is a PNG of 320 x 240");
  size_t x0 = 320, x1 = 0, y0 = 240, y1 = 0, count = 0;
  for (size_t y = 0; y < p.height; y++)
    for (size_t x = 0; x < 240; x++) { /* left of the colour bar */
      const unsigned char *c = p.rgb + 3 * (y * 320 + x);
      if (c[2] < c[0] + 25) continue;
      count++;
      if (x < x0) x0 = x;
      if (x > x1) x1 = x;
      if (y < y0) y0 = y;
      if (y > y1) y1 = y;
    }
  double wide = (double)(x1 + 1 - x0), high = (double)(y1 + 1 - y0), margin = 0.055 * 240;
  T_RATIO(fabs(high - (240 - 2.3 * margin)), 2, "a ball fills the frame: %g pixels high", high);
  T_RATIO(fabs(wide - high), 2, "and is round: %g x %g", wide, high);
  T_RATIO(fabs((double)count / (3.14159265 / 4 * wide * high) - 1), 0.02, "and full");
  const unsigned char *light = p.rgb + 3 * (70 * 320 + 105), *dark = p.rgb + 3 * (175 * 320 + 165);
  T_CHECK(light[1] > dark[1] + 20, "light comes from above on the left: %d, below on the right %d", light[1],
          dark[1]);
  const unsigned char *ground = p.rgb + 3 * (228 * 320 + 150), *open = p.rgb + 3 * (228 * 320 + 10);
  T_CHECK(ground[1] + 15 < open[1], "and the ball's shadow lies on the ground: %d beside %d", ground[1], open[1]);
  free(p.rgb);
  o.color_lower = 7e6, o.color_upper = 7e6 + 2, o.color_label = "a label of several words";
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  p = read_png(path_a);
  int darkest = 255;
  for (size_t i = 0; i < 3 * p.height; i++) {
    const unsigned char *c = p.rgb + 3 * (i / 3 * 320 + 317 + i % 3);
    if (c[1] < darkest) darkest = c[1];
  }
  T_CHECK(darkest > 150, "long numbers and labels stay within the picture: %d in its last columns", darkest);
  free(p.rgb);
  free(colors);
}

/* A circle about the ball, at height z above its centre. */
static void make_circle(double z, double lines[][6], size_t count) {
  double radius = sqrt(4 - z * z);
  for (size_t i = 0; i < count; i++)
    for (size_t e = 0; e < 2; e++) {
      double a = 2 * 3.14159265358979 * (double)(i + e) / (double)count;
      lines[i][3 * e] = 3 + radius * cos(a), lines[i][3 * e + 1] = 4 + radius * sin(a), lines[i][3 * e + 2] = 5 + z;
    }
}

/* Pixels of the ball's disc that are darker by far than in the other picture. */
static size_t count_darker(const pixels *p, const pixels *than) {
  size_t count = 0;
  for (size_t i = 0; i < (size_t)p->width * p->height; i++) count += p->rgb[3 * i + 1] + 30 < than->rgb[3 * i + 1];
  return count;
}

/* What networks are shown with: normals, lines, stripes. */
static void test_surface(batten_context *ctx, const batten_mesh *ball) {
  enum { PIECES = 200 };
  static double lines[PIECES][6];
  size_t V = batten_mesh_vertex_count(ball);
  const double *v = batten_mesh_vertices(ball);
  double *normals = malloc(3 * V * sizeof *normals), *values = malloc(V * sizeof *values);
  for (size_t i = 0; i < V; i++)
    for (size_t k = 0; k < 3; k++) normals[3 * i + k] = 1e-200 * (v[3 * i + k] - 3 - (double)k);
  batten_picture_options o = batten_picture_options_default();
  o.width = 320, o.height = 240, o.normals = normals;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  pixels plain = read_png(path_a);
  const batten_picture_lines circle = {.count = PIECES, .segments = &lines[0][0]};
  o.line_count = 1, o.lines = &circle;
  make_circle(0, lines, PIECES);
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  pixels equator = read_png(path_a);
  size_t drawn = count_darker(&equator, &plain);
  T_CHECK(drawn > 100 && drawn < 600, "a line about the ball shows on its front: %zu pixels", drawn);
  make_circle(-1.9, lines, PIECES); /* low: the camera looks from above */
  T_OK(batten_picture_mesh(ctx, ball, &o, path_b), ctx);
  pixels low = read_png(path_b);
  drawn = count_darker(&low, &plain);
  T_CHECK(drawn < 10, "a line that is behind it does not: %zu pixels", drawn);
  for (size_t i = 0; i < V; i++)
    values[i] = 2 * v[3 * i + 2]; /* from 6 to 14; the last black one, at the top, is beyond the horizon */
  o.line_count = 0, o.colors = values, o.color_map = BATTEN_MAP_STRIPES, o.elevation_deg = 0;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  pixels zebra = read_png(path_a);
  int stripes = 0, level = 0;
  for (size_t y = 0; y < 240; y++) {
    int green = zebra.rgb[3 * (y * 320 + 160) + 1], now = green > 130 ? 1 : green < 60 ? -1 : level;
    stripes += now != level && now < 0;
    level = now;
  }
  T_CHECK(stripes == 7, "7 black stripes down its middle: %d", stripes);
  for (size_t i = 0; i < V; i++)
    values[i] = fmod(values[i], 4) + (v[3 * i] > 3 ? 4 : 0); /* the same but for the period */
  o.color_upper = 4;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_b), ctx);
  pixels again = read_png(path_b);
  size_t differ = 0;
  for (size_t i = 0; i < 3 * 320 * 240; i++) differ += abs(again.rgb[i] - zebra.rgb[i]) > 3;
  T_CHECK(differ == 0, "values that begin anew make the same stripes, %zu differ", differ);
  free(plain.rgb), free(equator.rgb), free(low.rgb), free(zebra.rgb), free(again.rgb);
  free(normals), free(values);
}

static batten_status draw_small(batten_context *ctx, void *arg) {
  (void)arg;
  batten_mesh *ball = make_ball(ctx, 5);
  if (!ball) return BATTEN_E_NOMEM;
  batten_picture_options o = batten_picture_options_default();
  o.width = 40, o.height = 30, o.title = "A & b", o.color_label = "z";
  o.points = batten_mesh_vertices(ball);
  o.point_count = 3;
  o.colors = o.normals = batten_mesh_vertices(ball);
  const batten_picture_lines lines = {.count = 4, .segments = batten_mesh_vertices(ball)};
  o.lines = &lines;
  o.line_count = 1;
  batten_status st = batten_picture_mesh(ctx, ball, &o, path_b);
  batten_mesh_free(ball);
  return st;
}

static void test_bad(batten_context *ctx, const batten_mesh *ball) {
  const batten_picture_options good = batten_picture_options_default();
  batten_picture_options o = good;
  o.width = 8;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "8 x 900; each must be 16 .. 8192");
  o = good, o.height = 8193;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "1200 x 8193");
  o = good, o.struct_size = 0;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx,
           "batten_picture_options.struct_size: 0");
  o = good, o.elevation_deg = 91;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "elevation within -90 .. 90");
  o = good, o.azimuth_deg = NAN;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "must be finite");
  o = good, o.up_axis = 3;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.up_axis: 3");
  o = good, o.point_count = 1;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.points: NULL");
  const double bad[] = {0, 0, 0, 1, INFINITY, 1};
  o = good, o.point_count = 2, o.points = bad;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.points[1]: coordinate 1");
  o = good, o.color_lower = 1;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "in order");
  o = good, o.color_map = (batten_picture_map)4;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.color_map: 4");
  T_STATUS(batten_picture_mesh(ctx, ball, NULL, "ball.jpg"), BATTEN_E_INVALID, ctx, "use .png");
  T_STATUS(batten_picture_mesh(ctx, ball, NULL, "/nonexistent/ball.png"), BATTEN_E_IO, ctx, "/nonexistent/ball.png");
  batten_mesh *empty = NULL;
  T_OK(batten_mesh_create(ctx, 0, NULL, 0, NULL, &empty), ctx);
  T_STATUS(batten_picture_mesh(ctx, empty, NULL, path_a), BATTEN_E_INVALID, ctx, "no triangles");
  batten_mesh_free(empty);
}

/* Odd meshes must still give a picture: one triangle seen from behind and edge on, far from the origin. */
static void test_odd(batten_context *ctx) {
  const double v[][3] = {{7e6, 7e6, 1}, {7e6 + 1, 7e6, 1}, {7e6, 7e6 + 1, 1}, {7e6, 7e6, 1}};
  const uint32_t one[] = {0, 1, 2};
  const double elevations[] = {-90, -40, 0, 90};
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, 4, &v[0][0], 1, one, &mesh), ctx);
  batten_picture_options o = batten_picture_options_default();
  o.width = 48, o.height = 32;
  for (int i = 0; i < 4; i++) {
    o.elevation_deg = elevations[i];
    T_OK(batten_picture_mesh(ctx, mesh, &o, path_a), ctx);
  }
  const double far[] = {7e6, 7e6, 1, 7e6 + 3, 7e6 + 3, 3, 0, 0, 0, 1e300, -1e300, 1e300};
  o.points = far, o.point_count = 4;
  T_OK(batten_picture_mesh(ctx, mesh, &o, path_a), ctx);
  batten_mesh_free(mesh);
}

/* A roof of two triangles: steep, its corners at the ridge have the normals of either side; flat, one for both. */
static batten_status part_roof(batten_context *ctx, void *height) {
  const uint32_t triangles[] = {0, 1, 2, 1, 0, 3};
  const float h = *(float *)height, v[] = {0, 0, h, 1, 0, h, 0.5f, 1, 0, 0.5f, -1, 0};
  picture_scene s = {.vertex_count = 4, .triangle_count = 2, .triangles = triangles};
  s.vertices = batten_alloc_array(ctx, 12, sizeof *s.vertices);
  s.normals = batten_alloc_array(ctx, 12, sizeof *s.normals);
  batten_status st = s.vertices && s.normals ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    memcpy(s.vertices, v, sizeof v);
    for (size_t i = 0; i < 12; i++) s.normals[i] = i % 3 == 2;
    st = picture_part_normals(ctx, &s);
  }
  if (st >= 0 && h < 0.3f) T_CHECK(!s.normal_of, "a flat roof keeps the normals of its vertices");
  if (st >= 0 && h > 0.3f) {
    float side[2][3], worst = 0;
    for (size_t t = 0; t < 2; t++) {
      picture_face_normal(&s, triangles + 3 * t, side[t]);
      for (size_t k = 0; k < 6; k++)
        worst = fmaxf(worst, fabsf(s.normals[3 * (size_t)s.normal_of[3 * t + k / 3] + k % 3] - side[t][k % 3]));
    }
    T_RATIO((double)worst, 1e-6, "both corners of a ridge have the normal of their side");
    T_CHECK(s.normal_of[2] == 2 && s.normal_of[5] == 3 && side[0][1] > 0.6f && side[1][1] < -0.6f,
            "others their own");
  }
  batten_free(ctx, s.vertices);
  batten_free(ctx, s.normals);
  batten_free(ctx, s.normal_of);
  return st;
}

static void test_creases(batten_context *ctx) {
  float heights[] = {0.1f, 1};
  T_OK(part_roof(ctx, &heights[0]), ctx);
  T_OK(part_roof(ctx, &heights[1]), ctx);
  t_fail_every_allocation("normals at creases", part_roof, &heights[1]);
}

/* ---- plane: a ring, whose area in pixels follows from its box --------------------------------------- */

static batten_status ring(const void *user, batten_context *ctx, size_t count, const double *p, double *values,
                          double *gradients, double *hessians) {
  (void)user, (void)ctx, (void)gradients, (void)hessians;
  for (size_t i = 0; values && i < count; i++) {
    double r = hypot(p[2 * i] - 1, p[2 * i + 1] - 1);
    values[i] = (r - 0.5) * (1 - r);
  }
  return BATTEN_OK;
}

static batten_outline *make_ring(batten_context *ctx) {
  const double seeds[] = {2, 1, 1.5, 1};
  batten_field field = {.dimension = 2, .evaluate = ring};
  batten_polygonize_options o = batten_polygonize_options_default();
  o.cell = 0.02;
  o.lower[0] = o.lower[1] = -0.5;
  o.upper[0] = o.upper[1] = 2.5;
  batten_outline *outline = NULL;
  batten_status st = batten_trace_outline(ctx, &field, 2, seeds, &o, &outline, NULL);
  return st >= 0 ? outline : NULL;
}

static batten_status draw_ring(batten_context *ctx, void *arg) {
  const double dots[] = {2, 1, 1, 2};
  batten_outline *outline = make_ring(ctx);
  if (!outline) return strstr(batten_error(ctx), "cancelled") ? BATTEN_E_CANCELLED : BATTEN_E_NOMEM;
  batten_picture_options o = batten_picture_options_default();
  o.width = 220, o.height = 200, o.title = "r < 1 & r > 0.5", o.points = dots, o.point_count = 2;
  batten_status st = batten_picture_outline(ctx, outline, &o, arg);
  batten_outline_free(outline);
  return st;
}

static void test_ring(batten_context *ctx) {
  static char svg[64];
  snprintf(svg, sizeof svg, "%s/ring.svg", directory);
  T_OK(draw_ring(ctx, path_a), ctx);
  pixels p = read_png(path_a);
  size_t blue = 0, x0 = 220, x1 = 0;
  for (size_t y = 0; y < p.height; y++)
    for (size_t x = 0; x < p.width; x++) {
      const unsigned char *c = p.rgb + 3 * (y * p.width + x);
      if (c[2] < c[0] + 25) continue; /* the fill, and the darker line about it */
      blue++;
      if (x < x0) x0 = x;
      if (x > x1) x1 = x;
    }
  double diameter = (double)(x1 + 1 - x0), ratio = (double)blue / (3.14159265 / 4 * diameter * diameter);
  T_RATIO(fabs(ratio - 0.75), 0.03, "a ring with its hole fills 3/4 of its disc: %.3f", ratio);
  free(p.rgb);
  T_OK(draw_ring(ctx, svg), ctx);
  FILE *f = fopen(svg, "r");
  static char text[1 << 17];
  size_t length = f ? fread(text, 1, sizeof text - 1, f) : 0;
  if (f) fclose(f);
  T_CHECK(length && strncmp(text, "<svg ", 5) == 0 && strstr(text, "</svg>\n") == text + length - 7, "SVG is whole");
  T_CHECK(strstr(text, "r &lt; 1 &amp; r &gt; 0.5</text>"), "and escapes what XML cannot hold");
  size_t circles = 0;
  for (const char *c = text; (c = strstr(c, "<circle")) != NULL; c++) circles++;
  T_CHECK(circles == 2, "and has its dots");
  t_fail_every_allocation("batten_picture_outline to SVG", draw_ring, svg);
  unlink(svg);
  T_STATUS(draw_ring(ctx, (void *)"ring.jpg"), BATTEN_E_INVALID, ctx, "use .svg or .png");
}

int main(void) {
  if (!mkdtemp(directory)) return 1;
  snprintf(path_a, sizeof path_a, "%s/a.png", directory);
  snprintf(path_b, sizeof path_b, "%s/b.png", directory);
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_mesh *ball = make_ball(ctx, 24);
  test_mask(ctx);
  test_numbers();
  test_ball(ctx, ball);
  test_surface(ctx, ball);
  test_odd(ctx);
  test_creases(ctx);
  test_bad(ctx, ball);
  test_ring(ctx);
  batten_mesh_free(ball);
  batten_context *three = t_context(NULL, NULL, 3);
  T_OK(draw_small(ctx, NULL), ctx);
  rename(path_b, path_a);
  T_OK(draw_small(three, NULL), three);
  T_CHECK(same_bytes(path_a, path_b), "one thread and three write the same bytes");
  t_fail_every_allocation("batten_picture_mesh", draw_small, NULL);
  t_cancel_every_progress("batten_picture_mesh", draw_small, NULL);
  T_CHECK(same_bytes(path_a, path_b), "and the file is whole after it");
  batten_context_free(three);
  batten_context_free(ctx);
  unlink(path_a);
  unlink(path_b);
  T_CHECK(rmdir(directory) == 0, "nothing else is left in the directory");
  return t_done();
}
