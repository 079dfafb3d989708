/* Several meshes in a picture; lines with their hidden parts; axes. Pixels are told apart by what only one of them
 * paints: balls are blue, lines red or green. */
#include "tap.h"

#include <batten/exchange.h>
#include <unistd.h>

#include "pixels.h"

static char directory[] = "/tmp/batten-panels-XXXXXX";
static char path_a[64], path_b[64];

enum { WIDTH = 400, HEIGHT = 300, CELL_X = WIDTH / 2, CELL_Y = HEIGHT / 2 };

typedef struct spot { /* pixels of one colour in a rectangle */
  size_t count, x0, x1, y0, y1;
} spot;

static const unsigned char *pixel(const pixels *p, size_t x, size_t y) { return p->rgb + 3 * (y * p->width + x); }

typedef bool (*is_wanted)(const unsigned char *);
static bool is_blue(const unsigned char *c) { return c[2] > c[0] + 25; }
static bool is_red(const unsigned char *c) { return c[0] > c[1] + 40 && c[0] > c[2] + 40; }
static bool is_strong_red(const unsigned char *c) { return c[0] > c[1] + 95; }
static bool is_dark(const unsigned char *c) { return c[0] < 180 && c[1] < 180 && c[2] < 180; }

static spot find(const pixels *p, is_wanted wanted, size_t x0, size_t y0, size_t x1, size_t y1) {
  spot s = {.x0 = x1, .y0 = y1};
  for (size_t y = y0; y < y1; y++)
    for (size_t x = x0; x < x1; x++) {
      if (!wanted(pixel(p, x, y))) continue;
      s.count++;
      if (x < s.x0) s.x0 = x;
      if (x > s.x1) s.x1 = x;
      if (y < s.y0) s.y0 = y;
      if (y > s.y1) s.y1 = y;
    }
  return s;
}

static double across(const spot *s) { return s->count ? (double)(s->x1 + 1 - s->x0) : 0; }

/* The ball, smaller or moved. */
static batten_mesh *change(batten_context *ctx, const batten_mesh *ball, double factor, double move) {
  size_t V = batten_mesh_vertex_count(ball);
  double *v = malloc(3 * V * sizeof *v);
  batten_mesh *out = NULL;
  for (size_t i = 0; i < 3 * V; i++) {
    double middle = 3 + (double)(i % 3);
    v[i] = middle + factor * (batten_mesh_vertices(ball)[i] - middle) + move;
  }
  batten_status st =
      batten_mesh_create(ctx, V, v, batten_mesh_triangle_count(ball), batten_mesh_triangles(ball), &out);
  free(v);
  return st >= 0 ? out : NULL;
}

/* One colour for a whole mesh. */
static double *blue(const batten_mesh *mesh) {
  double *colors = malloc(batten_mesh_vertex_count(mesh) * sizeof *colors);
  for (size_t i = 0; i < batten_mesh_vertex_count(mesh); i++) colors[i] = 1;
  return colors;
}

static batten_picture_options parted(const double *colors) {
  batten_picture_options o = batten_picture_options_default();
  o.colors = colors;
  o.color_map = BATTEN_MAP_PARTED;
  o.color_lower = -1;
  o.color_upper = 1;
  o.no_color_bar = 1;
  return o;
}

/* A ball and one of half its size, together and each by itself, and a cell that is left empty. */
static void test_groups(batten_context *ctx, const batten_mesh *ball) {
  batten_mesh *half = change(ctx, ball, 0.5, 0), *same = change(ctx, ball, 0.5, 100);
  double *colors = blue(ball);
  batten_picture_options o = parted(colors), whole = batten_picture_options_default();
  whole.width = WIDTH, whole.height = HEIGHT;
  batten_picture_panel panels[4] = {{.mesh = ball, .opt = &o}, {.mesh = half, .opt = &o}, {.mesh = NULL, .opt = &o}};
  panels[3] = (batten_picture_panel){.mesh = same, .opt = &o};
  T_OK(batten_picture_panels(ctx, 2, 2, panels, &whole, path_a), ctx);
  pixels p = read_png(path_a);
  T_CHECK(p.width == WIDTH && p.height == HEIGHT, "the picture is %u x %u", p.width, p.height);
  spot a = find(&p, is_blue, 0, 0, CELL_X, CELL_Y), b = find(&p, is_blue, CELL_X, 0, WIDTH, CELL_Y);
  spot c = find(&p, is_blue, 0, CELL_Y, CELL_X, HEIGHT), d = find(&p, is_blue, CELL_X, CELL_Y, WIDTH, HEIGHT);
  T_CHECK(a.count > 4000 && c.count == 0, "a panel has its ball, the empty one nothing: %zu, %zu pixels", a.count,
          c.count);
  T_RATIO(fabs(across(&a) - (CELL_Y - 2.3 * 0.055 * CELL_Y)), 2, "it fills its own frame");
  T_RATIO(fabs(across(&a) - across(&b)) + fabs(across(&a) - across(&d)), 2,
          "balls by themselves are of one size: %g, %g, %g", across(&a), across(&b), across(&d));
  T_CHECK(a.x0 + CELL_X == b.x0 && a.x0 + CELL_X == d.x0 && a.y0 + CELL_Y == d.y0,
          "and in the same place of a panel");
  int lowest = 255, highest = 0;
  for (size_t x = 20; x < CELL_X - 20; x++) {
    int level = pixel(&p, x, HEIGHT - 75)[1];
    lowest = level < lowest ? level : lowest;
    highest = level > highest ? level : highest;
  }
  T_CHECK(highest - lowest < 12, "nothing but background in the empty one: %d .. %d", lowest, highest);
  free(p.rgb);

  panels[0].group = panels[1].group = 7;
  T_OK(batten_picture_panels(ctx, 1, 2, panels, &whole, path_a), ctx);
  p = read_png(path_a);
  a = find(&p, is_blue, 0, 0, CELL_X, HEIGHT), b = find(&p, is_blue, CELL_X, 0, WIDTH, HEIGHT);
  T_RATIO(fabs(across(&b) / across(&a) - 0.5), 0.08, "in a group half the size is half the width: %g of %g",
          across(&b), across(&a));
  T_CHECK(a.x0 > 0 && a.x1 < CELL_X - 1 && b.x0 > CELL_X && b.x1 < WIDTH - 1, "and both are in view");
  free(p.rgb);
  batten_mesh_free(same);
  batten_mesh_free(half);
  free(colors);
}

/* A line that runs through the ball: its ends stick out before and behind. */
static void test_lines(batten_context *ctx, const batten_mesh *ball) {
  const double rod[2][6] = {{3, 4, 5, 3, 4, 7.6}, {3, 4, 2.4, 3, 4, 5}};
  const batten_picture_options plain = batten_picture_options_default();
  batten_picture_lines line = {.count = 2, .segments = &rod[0][0], .color = 0xff0000, .width = 20};
  batten_picture_options o = plain;
  o.width = 320, o.height = 240, o.elevation_deg = 0, o.line_count = 1, o.lines = &line;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  pixels p = read_png(path_a);
  spot seen = find(&p, is_strong_red, 0, 0, 320, 240);
  T_RATIO(fabs(across(&seen) - 20e-3 * 364), 2, "a line has its width: %g pixels", across(&seen));
  const unsigned char *middle = pixel(&p, (seen.x0 + seen.x1) / 2, 120);
  T_CHECK(!is_red(middle), "what is in the ball is not seen: %d %d %d", middle[0], middle[1], middle[2]);
  T_CHECK(seen.y0 > 2 && seen.y1 < 237 && seen.y1 - seen.y0 > 190, "its ends are in view, from %zu to %zu", seen.y0,
          seen.y1);
  free(p.rgb);
  line.hidden = 0.5;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  p = read_png(path_a);
  spot strong = find(&p, is_strong_red, 0, 0, 320, 240), all = find(&p, is_red, 0, 0, 320, 240);
  middle = pixel(&p, (seen.x0 + seen.x1) / 2, 120);
  T_CHECK(is_red(middle) && all.count > strong.count * 3 / 2, "unless it is asked for, fainter: %d %d %d", middle[0],
          middle[1], middle[2]);
  free(p.rgb);
  /* A net that leads far away and behind the camera is cut; its first part is still drawn. */
  const double far[6] = {3, 4, 7, 3, 4, 1e12};
  line = (batten_picture_lines){.count = 1, .segments = far, .color = 0xff0000, .width = 20};
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  p = read_png(path_a);
  spot cut = find(&p, is_strong_red, 0, 0, 320, 240);
  T_CHECK(cut.count > 100 && cut.y0 == 0, "a line of length 1e12 leaves at the top: %zu pixels", cut.count);
  free(p.rgb);
  const double dot[6] = {3, 4, 7.5, 3, 4, 7.5};
  line.segments = dot;
  T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
  p = read_png(path_a);
  spot disc = find(&p, is_strong_red, 0, 0, 320, 240);
  T_RATIO(fabs(across(&disc) - 20e-3 * 364), 2, "a line without length is a disc: %g pixels", across(&disc));
  free(p.rgb);
}

/* A flat plot in a box: its walls and numbers are drawn about it, and the mesh hides what is behind it. */
static void test_axes(batten_context *ctx) {
  const double v[][3] = {{0, 0, 0.5}, {1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}}, ones[] = {1, 1, 1, 1};
  const uint32_t t[] = {0, 1, 2, 0, 2, 3};
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, 4, &v[0][0], 2, t, &mesh), ctx);
  batten_picture_axes axes = {.upper = {1, 1, 1}, .from = {0, 0, -3}, .to = {1, 1, 3}, .labels = {"u", "v", "K"}};
  batten_picture_options o = parted(ones);
  o.width = 400, o.height = 300, o.azimuth_deg = -60, o.elevation_deg = 30, o.axes = &axes;
  T_OK(batten_picture_mesh(ctx, mesh, &o, path_a), ctx);
  pixels p = read_png(path_a);
  spot plot = find(&p, is_blue, 0, 0, 400, 300), left = find(&p, is_dark, 0, 0, plot.x0, 300);
  spot below = find(&p, is_dark, plot.x0, plot.y1 + 1, plot.x1, 300);
  T_CHECK(plot.count > 2000, "the plot is there: %zu pixels", plot.count);
  T_CHECK(left.count > 40 && left.x0 > 2, "numbers stand on its left: %zu pixels from %zu", left.count, left.x0);
  T_CHECK(below.count > 60 && below.y1 < 298, "and below: %zu pixels to %zu", below.count, below.y1);
  spot inside = find(&p, is_dark, plot.x0 + 60, (plot.y0 + plot.y1) / 2 - 5, plot.x1 - 60, (plot.y0 + plot.y1) / 2);
  T_CHECK(inside.count == 0, "nothing behind the plot is drawn over it");
  free(p.rgb);
  /* Any camera, and the mesh's own axes turned: nothing to measure, but whole pictures. */
  o.width = 80, o.height = 60;
  for (int i = 0; i < 12; i++) {
    o.azimuth_deg = 30 * i, o.elevation_deg = 16 * i - 90, o.up_axis = (unsigned)i % 3;
    T_OK(batten_picture_mesh(ctx, mesh, &o, path_a), ctx);
  }
  axes.from[2] = 7e6, axes.to[2] = 7e6 + 1e-9; /* no numbers between them */
  o.width = o.height = 16;
  T_OK(batten_picture_mesh(ctx, mesh, &o, path_a), ctx);
  batten_mesh_free(mesh);
}

/* A dot before the ball, and the same of twice the size. */
static void test_dots(batten_context *ctx, const batten_mesh *ball) {
  const double dot[] = {5.05, 5.43, 5};
  double *colors = blue(ball);
  batten_picture_options o = parted(colors);
  o.width = 320, o.height = 240, o.elevation_deg = 0, o.point_count = 1, o.points = dot;
  spot s[2];
  for (int i = 0; i < 2; i++) {
    o.point_scale = 2 * (i + 1);
    T_OK(batten_picture_mesh(ctx, ball, &o, path_a), ctx);
    pixels p = read_png(path_a);
    s[i] = find(&p, is_red, 0, 0, 320, 240);
    free(p.rgb);
  }
  T_CHECK(across(&s[0]) > 4, "a dot is seen");
  T_RATIO(fabs(across(&s[1]) - 2 * across(&s[0])), 2, "dots have the size asked for: %g, %g pixels", across(&s[0]),
          across(&s[1]));
  free(colors);
}

/* A sheet seen from below: brown, or as from above. */
static void test_sides(batten_context *ctx) {
  const double v[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, ones[] = {1, 1, 1, 1};
  const uint32_t t[] = {0, 1, 2, 0, 2, 3};
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, 4, &v[0][0], 2, t, &mesh), ctx);
  batten_picture_options o = parted(ones);
  o.width = 160, o.height = 120, o.elevation_deg = -50;
  for (o.both_sides = 0; o.both_sides < 2; o.both_sides++) {
    T_OK(batten_picture_mesh(ctx, mesh, &o, path_a), ctx);
    pixels p = read_png(path_a);
    const unsigned char *c = pixel(&p, 80, 58);
    T_CHECK(is_blue(c) == (o.both_sides == 1), "%s from behind: %d %d %d", o.both_sides ? "blue" : "brown", c[0],
            c[1], c[2]);
    free(p.rgb);
  }
  batten_mesh_free(mesh);
}

static batten_status draw_small(batten_context *ctx, void *arg) {
  batten_mesh *ball = make_ball(ctx, 5);
  if (!ball) return BATTEN_E_NOMEM;
  const double *v = batten_mesh_vertices(ball);
  const batten_picture_lines lines[] = {{.count = 4, .segments = v, .hidden = 0.5},
                                        {.count = 2, .segments = v + 9, .color = 0x00ff00}};
  const batten_picture_axes axes = {.upper = {8, 9, 10}, .to = {1, 1, 1}, .labels = {"u", NULL, "K"}};
  batten_picture_options first = batten_picture_options_default(), second = first, whole = first;
  first.lines = lines, first.line_count = 2, first.points = v, first.point_count = 3, first.title = "A";
  second.axes = &axes, second.colors = second.normals = v, second.caption = "b";
  const batten_picture_panel panels[] = {
      {.mesh = ball, .opt = &first, .group = 1}, {.mesh = NULL}, {.mesh = ball, .opt = &second, .group = 1}};
  whole.width = 72, whole.height = 64, whole.title = "whole";
  batten_status st = batten_picture_panels(ctx, 1, 3, panels, &whole, arg);
  batten_mesh_free(ball);
  return st;
}

static void test_bad(batten_context *ctx, batten_mesh *ball) {
  const batten_picture_options good = batten_picture_options_default();
  batten_picture_options o = good, other = good;
  const batten_picture_panel one = {.mesh = ball, .opt = &o};
  T_STATUS(batten_picture_panels(ctx, 0, 1, &one, NULL, path_a), BATTEN_E_INVALID, ctx, "rows x columns: 0 x 1");
  T_STATUS(batten_picture_panels(ctx, 1, 17, &one, NULL, path_a), BATTEN_E_INVALID, ctx,
           "1 x 17; each must be 1 .. 16");
  T_STATUS(batten_picture_panels(ctx, 1, 2, NULL, NULL, path_a), BATTEN_E_INVALID, ctx, "panels: NULL with 1 x 2");
  T_STATUS(batten_picture_panels(ctx, 1, 1, &one, NULL, "a.jpg"), BATTEN_E_INVALID, ctx, "a.jpg: unknown extension");
  T_STATUS(batten_picture_panels(ctx, 1, 1, &one, NULL, "/nonexistent/a.png"), BATTEN_E_IO, ctx,
           "/nonexistent/a.png");
  other.struct_size = 0;
  T_STATUS(batten_picture_panels(ctx, 1, 1, &one, &other, path_a), BATTEN_E_INVALID, ctx, "struct_size: 0");
  other = good, other.width = 100, other.height = 20, other.title = "high";
  T_STATUS(batten_picture_panels(ctx, 1, 1, &one, &other, path_a), BATTEN_E_INVALID, ctx, "100 x 20 leave 100 x 0");
  other = good, other.width = 31;
  const batten_picture_panel two[] = {{.mesh = ball, .opt = &good, .group = 3},
                                      {.mesh = ball, .opt = &o, .group = 3}};
  T_STATUS(batten_picture_panels(ctx, 1, 2, two, &other, path_a), BATTEN_E_INVALID, ctx,
           "15 x 900 pixels to a panel");
  o.up_axis = 5;
  T_STATUS(batten_picture_panels(ctx, 1, 2, two, NULL, path_a), BATTEN_E_INVALID, ctx, "panels[1]: opt.up_axis: 5");
  o = good, o.azimuth_deg = 36;
  T_STATUS(batten_picture_panels(ctx, 1, 2, two, NULL, path_a), BATTEN_E_INVALID, ctx,
           "panels[1]: group 3: its camera differs from that of panels[0]");
  o = good, o.struct_size = 3;
  T_STATUS(batten_picture_panels(ctx, 1, 1, &one, NULL, path_a), BATTEN_E_INVALID, ctx, "panels[0]: ");
  batten_mesh *empty = NULL;
  T_OK(batten_mesh_create(ctx, 0, NULL, 0, NULL, &empty), ctx);
  const batten_picture_panel none = {.mesh = empty};
  T_STATUS(batten_picture_panels(ctx, 1, 1, &none, NULL, path_a), BATTEN_E_INVALID, ctx,
           "panels[0]: the mesh has no triangles");
  batten_mesh_free(empty);
}

static void test_bad_lines(batten_context *ctx, const batten_mesh *ball) {
  const double bad[] = {0, 0, 0, 1, 1, 1, 0, 0, 0, 0, INFINITY, 0};
  const batten_picture_lines fine = {.count = 1, .segments = bad};
  batten_picture_lines lines[] = {fine, fine};
  batten_picture_options o = batten_picture_options_default();
  o.line_count = 2;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx,
           "opt.lines: NULL with opt.line_count = 2");
  o.lines = lines, lines[1].count = 2;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx,
           "opt.lines[1].segments[1][1]: coordinate 1 is not finite");
  lines[1] = fine, lines[1].segments = NULL;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.lines[1].segments: NULL");
  lines[1] = fine, lines[1].count = SIZE_MAX / 8;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_TOO_LARGE, ctx, "opt.lines[1].count");
  lines[1] = fine, lines[1].color = 0x1000000;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.lines[1].color: 0x1000000");
  lines[1] = fine, lines[1].width = -1;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.lines[1].width: -1");
  lines[1] = fine, lines[1].hidden = NAN;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.lines[1].hidden: nan");
  o.line_count = 0, o.point_scale = 11;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.point_scale: 11; must be 0 .. 10");
  o.point_scale = 0;
  batten_picture_axes axes = {.upper = {1, 1, 1}, .to = {1, 1, 1}};
  o.axes = &axes, axes.lower[1] = 1;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.axes->lower[1], upper: 1, 1");
  axes.lower[1] = 0, axes.to[2] = NAN;
  T_STATUS(batten_picture_mesh(ctx, ball, &o, path_a), BATTEN_E_INVALID, ctx, "opt.axes->from[2], to: 0, nan");
}

/* Titles and captions that are too long for their panel are smaller, not cut off: the last letter is seen. */
static void test_long_titles(batten_context *ctx, const batten_mesh *ball) {
  static const char *const texts[] = {"mmmmmmmmmm", "mmmmmmmmmm mmmmmmmmmm mmmmmmmmmm mmmmmmmmmm mmmmmmmmmm mmmm m"};
  for (int i = 0; i < 2; i++) {
    batten_picture_options o = batten_picture_options_default();
    o.width = WIDTH, o.height = HEIGHT, o.title = texts[i], o.caption = texts[i];
    batten_picture_panel panels[2] = {{ball, &o, 0}, {NULL, NULL, 0}};
    T_STATUS(batten_picture_panels(ctx, 1, 2, panels, &o, path_a), BATTEN_OK, ctx, "");
    pixels p = read_png(path_a);
    spot above = find(&p, is_dark, 0, 0, WIDTH, HEIGHT / 4), beside = find(&p, is_dark, CELL_X, 40, WIDTH, HEIGHT);
    T_CHECK(above.count > 50 && above.x1 < WIDTH - 4, "title %d: %zu dark pixels, up to column %zu", i, above.count,
            above.x1);
    T_CHECK(beside.count == 0, "title %d: %zu dark pixels in the other panel", i, beside.count);
    free(p.rgb);
  }
}

int main(void) {
  if (!mkdtemp(directory)) return 1;
  snprintf(path_a, sizeof path_a, "%s/a.png", directory);
  snprintf(path_b, sizeof path_b, "%s/b.png", directory);
  batten_context *ctx = t_context(NULL, NULL, 1), *three = t_context(NULL, NULL, 3);
  batten_mesh *ball = make_ball(ctx, 24);
  test_groups(ctx, ball);
  test_lines(ctx, ball);
  test_axes(ctx);
  test_sides(ctx);
  test_long_titles(ctx, ball);
  test_dots(ctx, ball);
  test_bad(ctx, ball);
  test_bad_lines(ctx, ball);
  batten_mesh_free(ball);
  T_OK(draw_small(ctx, path_a), ctx);
  T_OK(draw_small(three, path_b), three);
  T_CHECK(same_bytes(path_a, path_b), "one thread and three write the same bytes");
  t_fail_every_allocation("batten_picture_panels", draw_small, path_b);
  t_cancel_every_progress("batten_picture_panels", draw_small, path_b);
  T_CHECK(same_bytes(path_a, path_b), "and the file is whole after it");
  batten_context_free(three);
  batten_context_free(ctx);
  unlink(path_a);
  unlink(path_b);
  T_CHECK(rmdir(directory) == 0, "nothing else is left in the directory");
  return t_done();
}
