/* Picture of a plane solid: the filled inside, its outline, the data, axes with numbers. PNG or SVG. A plot of four
 * layers: open loops bound nothing. */
#include "picture.h"

#include <string.h>

#include "base/checked.h"

/* Loops of one kind as parts of a layer. */
typedef struct loops {
  size_t count, part_count, *starts;
  double *points;
} loops;

static void loops_free(batten_context *ctx, loops *l) {
  batten_free(ctx, l->starts);
  batten_free(ctx, l->points);
}

static batten_status take_loops(batten_context *ctx, const batten_outline *o, bool wanted, loops *out) {
  size_t all = batten_outline_loop_count(o), total = 0, count;
  int closed;
  for (size_t i = 0; i < all; i++) {
    batten_outline_loop(o, i, &count, &closed);
    total += count;
  }
  *out = (loops){.starts = batten_alloc_array(ctx, all + 1, sizeof *out->starts),
                 .points = batten_alloc_array(ctx, total, 2 * sizeof *out->points)};
  if (!out->starts || !out->points) return BATTEN_E_NOMEM;
  out->starts[0] = 0;
  for (size_t i = 0; i < all; i++) {
    const double *p = batten_outline_loop(o, i, &count, &closed);
    if (wanted != (closed != 0)) continue;
    memcpy(out->points + 2 * out->count, p, 2 * count * sizeof *p);
    out->count += count;
    out->starts[++out->part_count] = out->count;
  }
  return BATTEN_OK;
}

static batten_plot_layer loops_layer(batten_plot_kind kind, const loops *l, bool closed, unsigned color) {
  return (batten_plot_layer){.kind = kind,
                             .count = l->count,
                             .points = l->points,
                             .part_count = l->part_count,
                             .starts = l->starts,
                             .closed = closed,
                             .color = color,
                             .width = 4};
}

batten_status batten_picture_outline(batten_context *ctx, const batten_outline *outline,
                                     const batten_picture_options *opt, const char *path) {
  batten_picture_options o;
  loops closed = {0}, open = {0};
  batten_status st = picture_check_options(ctx, opt, 2, &o);
  if (st >= 0 && batten_outline_loop_count(outline) == 0 && o.point_count == 0)
    st = batten_fail(ctx, BATTEN_E_INVALID, "outline: it has no loops to draw");
  if (st < 0) return st;
  st = take_loops(ctx, outline, true, &closed);
  if (st >= 0) st = take_loops(ctx, outline, false, &open);
  if (st >= 0) {
    batten_plot_layer layers[] = {
        loops_layer(BATTEN_PLOT_AREA, &closed, true, 0xb9cfe4),
        loops_layer(BATTEN_PLOT_LINE, &closed, true, 0x1f4e79),
        loops_layer(BATTEN_PLOT_LINE, &open, false, 0x1f4e79),
        {.kind = BATTEN_PLOT_DOTS, .count = o.point_count, .points = o.points, .color = 0xc8442c},
    };
    batten_plot plot = {.layer_count = sizeof layers / sizeof *layers, .layers = layers};
    st = batten_picture_plots(ctx, 1, 1, &plot, &o, path);
  }
  loops_free(ctx, &open);
  loops_free(ctx, &closed);
  return st;
}
