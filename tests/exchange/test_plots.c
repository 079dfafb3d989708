/* Plots in the plane: what is drawn where, read back from PNG and SVG; wrong layers; failures. */
#include "tap.h"

#include <batten/exchange.h>
#include <unistd.h>

#include "picture.h"
#include "pixels.h"

static char directory[] = "/tmp/batten-plots-XXXXXX";
static char png[64], svg[64], other[64];

typedef struct box {
  size_t count, x0, y0, x1, y1; /* pixels of a colour, and where they are */
} box;

/* Pixels within 60 of a colour in a part of the picture. */
static box find(const pixels *p, unsigned color, size_t from_x, size_t to_x) {
  box b = {.x0 = p->width, .y0 = p->height};
  for (size_t y = 0; y < p->height; y++)
    for (size_t x = from_x; x < to_x && x < p->width; x++) {
      const unsigned char *c = p->rgb + 3 * (y * p->width + x);
      int far = abs(c[0] - (int)(color >> 16)) + abs(c[1] - (int)(color >> 8 & 255)) + abs(c[2] - (int)(color & 255));
      if (far > 150) continue;
      b.count++;
      if (x < b.x0) b.x0 = x;
      if (x > b.x1) b.x1 = x;
      if (y < b.y0) b.y0 = y;
      if (y > b.y1) b.y1 = y;
    }
  return b;
}

static const double SQUARE[] = {0, 0, 4, 0, 4, 2, 0, 2};

static batten_picture_options small(unsigned width, unsigned height) {
  batten_picture_options o = batten_picture_options_default();
  o.width = width, o.height = height;
  return o;
}

/* A rectangle twice as wide as high stays so, unless the axes are stretched. */
static void test_scales(batten_context *ctx) {
  batten_picture_options o = small(600, 600);
  batten_plot_layer layer = {.kind = BATTEN_PLOT_AREA, .count = 4, .points = SQUARE, .color = 0x2040c0};
  batten_plot plot = {.layer_count = 1, .layers = &layer};
  T_OK(batten_picture_plots(ctx, 1, 1, &plot, &o, png), ctx);
  pixels p = read_png(png);
  box b = find(&p, 0x2040c0, 0, p.width);
  double wide = (double)(b.x1 - b.x0), high = (double)(b.y1 - b.y0);
  T_RATIO(fabs(wide / high - 2), 0.02, "an area keeps its proportions: %.3f", wide / high);
  T_RATIO(fabs((double)b.count / ((wide + 1) * (high + 1)) - 1), 0.02, "and is filled");
  free(p.rgb);
  plot.stretched = 1;
  T_OK(batten_picture_plots(ctx, 1, 1, &plot, &o, png), ctx);
  p = read_png(png);
  b = find(&p, 0x2040c0, 0, p.width);
  T_CHECK(b.y1 - b.y0 > 400 && b.x1 - b.x0 > 400, "stretched it fills the frame: %zu x %zu", b.x1 - b.x0,
          b.y1 - b.y0);
  free(p.rgb);
}

/* Lines are cut at the frame of a range that was asked for; layers beyond do not widen one that is found. */
static void test_frames(batten_context *ctx) {
  const double line[] = {-100, 1, 100, 1}, far[] = {1e6, 1, 2, 1};
  batten_picture_options o = small(500, 400);
  batten_plot_layer layers[] = {
      {.count = 4, .points = SQUARE, .closed = 1, .color = 0x000000},
      {.count = 2, .points = line, .color = 0xe01010, .beyond = 1, .width = 10},
      {.kind = BATTEN_PLOT_DOTS, .count = 2, .points = far, .color = 0x10a010, .beyond = 1, .width = 15}};
  batten_plot plot = {.layer_count = 3, .layers = layers};
  T_OK(batten_picture_plots(ctx, 1, 1, &plot, &o, png), ctx);
  pixels p = read_png(png);
  box square = find(&p, 0x000000, 0, p.width), red = find(&p, 0xe01010, 0, p.width);
  box green = find(&p, 0x10a010, 0, p.width);
  T_CHECK(square.x1 - square.x0 > 300, "what lies beyond does not shrink the rest: %zu", square.x1 - square.x0);
  T_CHECK(red.x0 < square.x0 && red.x1 > square.x1 && red.x1 < 500 - 10, "it is cut at the frame: %zu to %zu", red.x0,
          red.x1);
  T_CHECK(green.count > 20 && green.x1 - green.x0 < 30, "and of two dots the one inside is there: %zu pixels",
          green.count);
  free(p.rgb);
  plot.lower[0] = 1, plot.upper[0] = 3, plot.lower[1] = 0.5, plot.upper[1] = 1.5;
  T_OK(batten_picture_plots(ctx, 1, 1, &plot, &o, png), ctx);
  p = read_png(png);
  T_CHECK(find(&p, 0x000000, 0, p.width).count == 0, "of a smaller range only what is in it is seen");
  free(p.rgb);
}

/* Plots of one group have one scale; parts and marks. */
static void test_panels(batten_context *ctx) {
  const double small_square[] = {0, 0, 2, 0, 2, 1, 0, 1}, pieces[] = {0, 0, 1, 0, 3, 0, 4, 0};
  const size_t starts[] = {0, 2, 4};
  batten_picture_options o = small(1000, 500);
  batten_plot_layer big = {.kind = BATTEN_PLOT_AREA, .count = 4, .points = SQUARE, .color = 0x2040c0};
  batten_plot_layer less = {.kind = BATTEN_PLOT_AREA, .count = 4, .points = small_square, .color = 0x2040c0};
  batten_plot plots[] = {{.layer_count = 1, .layers = &big, .group = 7},
                         {.layer_count = 1, .layers = &less, .group = 7}};
  T_OK(batten_picture_plots(ctx, 1, 2, plots, &o, png), ctx);
  pixels p = read_png(png);
  box a = find(&p, 0x2040c0, 0, 500), b = find(&p, 0x2040c0, 500, 1000);
  T_RATIO(fabs((double)(b.x1 - b.x0) / (double)(a.x1 - a.x0) - 0.5), 0.01, "plots of a group have one scale");
  free(p.rgb);
  batten_plot_layer parts[] = {
      {.count = 4, .points = pieces, .part_count = 2, .starts = starts, .color = 0xe01010, .width = 10},
      {.kind = BATTEN_PLOT_CROSSES, .count = 1, .points = pieces, .color = 0x10a010, .width = 20},
      {.kind = BATTEN_PLOT_RINGS, .count = 1, .points = pieces + 6, .color = 0x0000ff, .width = 20}};
  batten_plot one = {.layer_count = 3, .layers = parts};
  o = small(500, 500);
  T_OK(batten_picture_plots(ctx, 1, 1, &one, &o, png), ctx);
  p = read_png(png);
  box line = find(&p, 0xe01010, 0, p.width), cross = find(&p, 0x10a010, 0, p.width),
      ring = find(&p, 0x0000ff, 0, p.width);
  size_t gap = find(&p, 0xe01010, (line.x0 + line.x1) / 2 - 5, (line.x0 + line.x1) / 2 + 5).count;
  T_CHECK(line.count > 100 && gap == 0, "parts are not joined: %zu pixels between", gap);
  T_CHECK(cross.count > 20 && cross.x1 - cross.x0 > 15 && cross.x1 - cross.x0 < 26, "a cross has its size");
  T_CHECK(ring.count > 12 && ring.x1 - ring.x0 > 17 && ring.x1 - ring.x0 < 26, "and a ring: %zu pixels, %zu wide",
          ring.count, ring.x1 - ring.x0);
  size_t middle = (ring.x0 + ring.x1) / 2;
  T_CHECK(find(&p, 0x0000ff, middle, middle + 1).count <= 6, "which is open inside");
  free(p.rgb);
}

/* What is not white between two columns. */
static size_t inked(const pixels *p, size_t from_x, size_t to_x) {
  size_t count = 0;
  for (size_t y = 0; y < p->height; y++)
    for (size_t x = from_x; x < to_x; x++) count += p->rgb[3 * (y * p->width + x)] < 250;
  return count;
}

/* Captions and legends that are longer than the frame is wide stay above it. */
static void test_narrow(batten_context *ctx) {
  static char text[1 << 16];
  static const char *const names[] = {"curvature", "data", "control polygon", "curve", "inflection"};
  batten_plot_layer layers[5];
  for (size_t i = 0; i < 5; i++)
    layers[i] = (batten_plot_layer){.count = 4, .points = SQUARE, .closed = 1, .label = names[i]};
  batten_plot plots[2] = {{0},
                          {.layer_count = 5,
                           .layers = layers,
                           .caption = "a caption that is much longer than what there is room for in the frame below",
                           .labels = {NULL, "curvature, cut"}}};
  batten_picture_options o = small(300, 400);
  T_OK(batten_picture_plots(ctx, 1, 2, plots, &o, png), ctx);
  pixels p = read_png(png);
  T_CHECK(inked(&p, 0, 150) == 0 && inked(&p, 292, 300) == 0 && inked(&p, 150, 292) > 1000,
          "nothing beyond the plot: %zu pixels before it, %zu behind it", inked(&p, 0, 150), inked(&p, 292, 300));
  free(p.rgb);
  const double far[] = {4e6, -5500000.25, 4000000.5, -5500000.5};
  batten_plot_layer line = {.count = 2, .points = far};
  batten_plot beside[2] = {{0}, {.layer_count = 1, .layers = &line}};
  batten_picture_options wide = small(800, 600);
  T_OK(batten_picture_plots(ctx, 1, 2, beside, &wide, png), ctx);
  p = read_png(png);
  T_CHECK(inked(&p, 0, 400) == 0 && inked(&p, 400, 430) > 20, "long numbers stay beside the frame: %zu, %zu pixels",
          inked(&p, 0, 400), inked(&p, 400, 430));
  free(p.rgb);
  T_OK(batten_picture_plots(ctx, 1, 2, plots, &o, svg), ctx);
  FILE *f = fopen(svg, "r");
  if (f) text[fread(text, 1, sizeof text - 1, f)] = '\0';
  if (f) fclose(f);
  T_CHECK(strstr(text, ">a caption") && strstr(text, "...</text>"), "a caption that is cut says so");
  double y[5] = {0};
  for (size_t i = 0; i < 5; i++) {
    char name[64];
    snprintf(name, sizeof name, ">%s</text>", names[i]);
    const char *at = strstr(text, name);
    while (at && at > text && strncmp(at, " y=\"", 4)) at--;
    if (at) y[i] = atof(at + 4);
  }
  T_CHECK(y[0] > 0 && y[0] < y[2] && y[2] <= y[4] && y[4] < 100, "names of the legend in rows: %g %g %g %g %g", y[0],
          y[1], y[2], y[3], y[4]);
}

static batten_status draw(batten_context *ctx, void *path) {
  const double dots[] = {1, 1, 3, 1};
  batten_picture_options o = small(300, 200);
  o.title = "a & b";
  batten_plot_layer layers[] = {
      {.kind = BATTEN_PLOT_AREA, .count = 4, .points = SQUARE, .color = 0x2040c0, .label = "area"},
      {.count = 4, .points = SQUARE, .closed = 1, .color = 0x102030, .label = "line"},
      {.kind = BATTEN_PLOT_CROSSES, .count = 2, .points = dots, .label = "data"},
      {.kind = BATTEN_PLOT_DOTS, .count = 0}};
  batten_plot plots[2] = {{.layer_count = 4, .layers = layers, .caption = "x < 1", .labels = {"length", "height"}}};
  return batten_picture_plots(ctx, 2, 1, plots, &o, path);
}

static void test_svg(batten_context *ctx) {
  static char text[1 << 16];
  T_OK(draw(ctx, svg), ctx);
  FILE *f = fopen(svg, "r");
  size_t length = f ? fread(text, 1, sizeof text - 1, f) : 0;
  if (f) fclose(f);
  T_CHECK(length && strncmp(text, "<svg ", 5) == 0 && strstr(text, "</svg>\n") == text + length - 7, "SVG is whole");
  const char *const words[] = {"a &amp; b</text>", "x &lt; 1</text>", ">area</text>",  ">line</text>",
                               ">data</text>",     ">length</text>",  ">height</text>"};
  for (size_t i = 0; i < sizeof words / sizeof *words; i++) T_CHECK(strstr(text, words[i]), "and has %s", words[i]);
}

static void test_bad(batten_context *ctx) {
  const double bad[] = {0, 0, 1, NAN};
  const size_t starts[] = {0, 3, 2};
  batten_plot_layer l = {.count = 2, .points = bad};
  batten_plot plot = {.layer_count = 1, .layers = &l};
  batten_picture_options o = small(300, 200);
  T_STATUS(batten_picture_plots(ctx, 1, 1, NULL, &o, png), BATTEN_E_INVALID, ctx, "plots: NULL with 1 x 1 of them");
  T_STATUS(batten_picture_plots(ctx, 0, 1, &plot, &o, png), BATTEN_E_INVALID, ctx, "rows x columns: 0 x 1");
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, "x.jpg"), BATTEN_E_INVALID, ctx, "x.jpg: unknown extension");
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx,
           "plots[0].layers[0].points[1]: coordinate 1 is not finite");
  l.points = NULL;
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx, "points: NULL with count = 2");
  l = (batten_plot_layer){.count = 0};
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx,
           "plots[0]: its layers have no points");
  l = (batten_plot_layer){.count = 4, .points = SQUARE, .kind = (batten_plot_kind)9};
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx, "plots[0].layers[0].kind: 9");
  l = (batten_plot_layer){.count = 4, .points = SQUARE, .width = -1};
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx, "color, width: 0x0, -1");
  l = (batten_plot_layer){.count = 4, .points = SQUARE, .part_count = 2};
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx,
           "starts: NULL with part_count = 2");
  l.starts = starts;
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx,
           "starts[1], [2]: 3, 2; must not fall");
  l.part_count = 0;
  plot.lower[1] = 1;
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx, "plots[0].lower[1], upper: 1, 0");
  plot.lower[1] = 0;
  plot.layers = NULL;
  T_STATUS(batten_picture_plots(ctx, 1, 1, &plot, &o, png), BATTEN_E_INVALID, ctx,
           "layers: NULL with layer_count = 1");
  T_CHECK(access(png, F_OK) != 0, "nothing was written");
}

int main(void) {
  if (!mkdtemp(directory)) return 1;
  snprintf(png, sizeof png, "%s/a.png", directory);
  snprintf(svg, sizeof svg, "%s/a.svg", directory);
  snprintf(other, sizeof other, "%s/b.png", directory);
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_bad(ctx);
  test_scales(ctx);
  test_frames(ctx);
  test_panels(ctx);
  test_narrow(ctx);
  test_svg(ctx);
  T_OK(draw(ctx, png), ctx);
  T_OK(draw(ctx, other), ctx);
  T_CHECK(same_bytes(png, other), "the same plot is the same file");
  t_fail_every_allocation("batten_picture_plots to PNG", draw, other);
  t_fail_every_allocation("batten_picture_plots to SVG", draw, svg);
  t_cancel_every_progress("batten_picture_plots", draw, other);
  t_cancel_every_progress("batten_picture_plots to SVG", draw, svg);
  T_CHECK(same_bytes(png, other), "and the file is whole after it");
  batten_context_free(ctx);
  unlink(png);
  unlink(svg);
  unlink(other);
  T_CHECK(rmdir(directory) == 0, "nothing else is left in the directory");
  return t_done();
}
