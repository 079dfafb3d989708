/* The picture of `batten convex`. See convex_picture.h: here the grids of both surfaces are evaluated, turned into
 * meshes and plots, and put together in panels. */
#include "convex_picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
  GRID = CONVEX_GRID,
  SIDE = GRID + 1,
  PLACES = SIDE * SIDE,
  PLOT_LINES = 16, /* parameter lines of a plot in either direction; divides GRID */
  LINE_KINDS = 5,
  TEXT = 128
};

/* Height of a plot; its base is the unit square. */
static const double plot_height = 0.62;

/* One surface with its two panels. */
typedef struct drawing {
  const batten_surface *surface;
  bool ellipses;
  convex_grid grid;
  double from, to;    /* range of the plot */
  double least, most; /* K on the grid */
  double size;        /* diagonal of its box */
  bool flat;
  batten_mesh *space, *plot;
  double *normals, *tones;
  convex_segments net, knots, spans, ellipse, plot_lines;
  double *levels, *zero; /* segments of batten_mesh_level_lines */
  size_t level_count, zero_count;
  batten_picture_lines space_lines[LINE_KINDS], plot_line_kinds[2];
  batten_picture_axes axes;
  char space_caption[TEXT], plot_caption[TEXT], plot_title[TEXT];
  batten_picture_options space_options, plot_options;
} drawing;

static void drawing_free(batten_context *ctx, drawing *d) {
  batten_free(ctx, d->grid.points);
  batten_mesh_free(d->space);
  batten_mesh_free(d->plot);
  batten_free(ctx, d->normals);
  batten_free(ctx, d->tones);
  batten_free(ctx, d->net.ends);
  batten_free(ctx, d->knots.ends);
  batten_free(ctx, d->spans.ends);
  batten_free(ctx, d->ellipse.ends);
  batten_free(ctx, d->plot_lines.ends);
  batten_free(ctx, d->levels);
  batten_free(ctx, d->zero);
}

static size_t index_of(size_t i, size_t j) { return i * SIDE + j; }

static batten_status evaluate_grid(batten_context *ctx, const batten_surface *surface, convex_grid *g) {
  batten_surface_form f = batten_surface_get(surface);
  double *places = batten_alloc_array(ctx, PLACES, 2 * sizeof *places);
  g->points = batten_alloc_array(ctx, PLACES, sizeof *g->points);
  batten_status st = places && g->points ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t k = 0; k < 2; k++) {
    g->lower[k] = f.knots[k][0];
    g->upper[k] = f.knots[k][f.knot_count[k] - 1];
  }
  for (size_t i = 0; st >= 0 && i < PLACES; i++)
    for (size_t k = 0; k < 2; k++) {
      size_t at = k == 0 ? i / SIDE : i % SIDE;
      double t = (double)at / GRID;
      places[2 * i + k] = at == GRID ? g->upper[k] : g->lower[k] + t * (g->upper[k] - g->lower[k]);
    }
  if (st >= 0) st = batten_surface_evaluate(ctx, surface, PLACES, places, g->points);
  batten_free(ctx, places);
  return st;
}

/* ---- what is up ---------------------------------------------------------------------------------- */

/* Twice the area vector of a grid: the sum of du x dv over it, whatever its inner points are. */
static void area_vector(const convex_grid *g, double out[3]) {
  memset(out, 0, 3 * sizeof *out);
  for (size_t i = 0; i < GRID; i++)
    for (size_t j = 0; j < GRID; j++) {
      const double *a = g->points[index_of(i, j)].point, *b = g->points[index_of(i + 1, j)].point;
      const double *c = g->points[index_of(i + 1, j + 1)].point, *d = g->points[index_of(i, j + 1)].point;
      double p[3], q[3];
      for (int k = 0; k < 3; k++) p[k] = c[k] - a[k], q[k] = d[k] - b[k];
      for (int k = 0; k < 3; k++) out[k] += p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3];
    }
}

/* Non-zero: x depends on u alone and y on v alone, so the surface is the graph of a function. */
static bool is_graph(const batten_surface *surface) {
  batten_surface_form f = batten_surface_get(surface);
  size_t nu = f.knot_count[0] - f.degree[0] - 1, nv = f.knot_count[1] - f.degree[1] - 1;
  for (size_t i = 0; i < nu; i++)
    for (size_t j = 0; j < nv; j++) {
      const double *b = f.control_points + 3 * (i * nv + j);
      if (b[0] != f.control_points[3 * i * nv] || b[1] != f.control_points[3 * j + 1]) return false;
    }
  return true;
}

/* The rotation by the least angle that takes unit vector n to the axis `up`; n is not its opposite. */
static convex_frame turn_up(const double n[3], unsigned up) {
  convex_frame f;
  double axis[3] = {0}, w[3];
  axis[up] = 1;
  for (unsigned k = 0; k < 3; k++) w[k] = n[(k + 1) % 3] * axis[(k + 2) % 3] - n[(k + 2) % 3] * axis[(k + 1) % 3];
  double cosine = n[up], factor = 1 / (1 + cosine); /* Rodrigues' formula: I + [w] + [w]^2 / (1 + cos) */
  double cross[3][3] = {{0, -w[2], w[1]}, {w[2], 0, -w[0]}, {-w[1], w[0], 0}};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      double square = 0;
      for (int k = 0; k < 3; k++) square += cross[i][k] * cross[k][j];
      f.rows[i][j] = (i == j) + cross[i][j] + factor * square;
    }
  return f;
}

/* 15 degrees: the camera looks down on surfaces that are tilted so far away from it, too. */
static const double upright_cosine = 0.966;

static convex_frame choose_frame(const drawing *d, unsigned up) {
  convex_frame same = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  double n[3], bend = 0;
  area_vector(&d->grid, n);
  double length = hypot(hypot(n[0], n[1]), n[2]);
  if (!(length > 0) || !isfinite(length) || is_graph(d->surface)) return same;
  for (size_t i = 0; i < PLACES; i++)
    if (isfinite(d->grid.points[i].mean)) bend += d->grid.points[i].mean;
  if (fabs(n[up]) >= upright_cosine * length) return same;
  for (int k = 0; k < 3; k++) n[k] *= (bend < 0 ? -1 : 1) / length;
  return turn_up(n, up);
}

/* ---- meshes -------------------------------------------------------------------------------------- */

/* Two triangles for each cell, those left out of which a corner is not finite; flipped: seen from the other side. */
static batten_status grid_mesh(batten_context *ctx, const double *vertices, const bool *missing, bool flipped,
                               batten_mesh **out) {
  uint32_t *triangles = batten_alloc_array(ctx, 2 * GRID * GRID, 3 * sizeof *triangles);
  if (!triangles) return BATTEN_E_NOMEM;
  size_t count = 0;
  for (size_t i = 0; i < GRID; i++)
    for (size_t j = 0; j < GRID; j++) {
      size_t a = index_of(i, j), b = index_of(i + 1, j), c = index_of(i + 1, j + 1), d = index_of(i, j + 1);
      size_t corners[2][3] = {{a, b, c}, {a, c, d}};
      for (int t = 0; t < 2; t++) {
        const size_t *v = corners[t];
        if (missing && (missing[v[0]] || missing[v[1]] || missing[v[2]])) continue;
        uint32_t *triangle = triangles + 3 * count++;
        triangle[0] = (uint32_t)v[0];
        triangle[1] = (uint32_t)v[flipped ? 2 : 1];
        triangle[2] = (uint32_t)v[flipped ? 1 : 2];
      }
    }
  batten_status st = batten_mesh_create(ctx, PLACES, vertices, count, triangles, out);
  batten_free(ctx, triangles);
  return st;
}

static batten_status make_space(batten_context *ctx, drawing *d, const convex_frame *frame, unsigned up) {
  double area[3], turned[3];
  double *vertices = batten_alloc_array(ctx, PLACES, 3 * sizeof *vertices);
  d->normals = batten_alloc_array(ctx, PLACES, 3 * sizeof *d->normals);
  if (!vertices || !d->normals) {
    batten_free(ctx, vertices);
    return BATTEN_E_NOMEM;
  }
  area_vector(&d->grid, area);
  convex_to_frame(frame, area, turned);
  bool flipped = turned[up] < 0; /* the camera is above */
  for (size_t i = 0; i < PLACES; i++) {
    convex_to_frame(frame, d->grid.points[i].point, vertices + 3 * i);
    convex_to_frame(frame, d->grid.points[i].normal, d->normals + 3 * i);
    for (size_t k = 0; flipped && k < 3; k++) d->normals[3 * i + k] = -d->normals[3 * i + k];
  }
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = 0; i < 3 * (size_t)PLACES; i++) {
    lower[i % 3] = fmin(lower[i % 3], vertices[i]);
    upper[i % 3] = fmax(upper[i % 3], vertices[i]);
  }
  d->size = hypot(hypot(upper[0] - lower[0], upper[1] - lower[1]), upper[2] - lower[2]);
  batten_status st = grid_mesh(ctx, vertices, NULL, flipped, &d->space);
  batten_free(ctx, vertices);
  return st;
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Values that are less, of 1 / size^2, are rounding: the surface is flat. */
static const double flat_gauss = 1e-9;

/* A part of the range of K is left out where the rest would be pressed flat by it, into a third of the height. */
static const double worth_cutting = 3;

/* Curvatures that are rounding beside the largest are 0: else their signs were drawn. */
static void round_gauss(convex_grid *g) {
  double largest = 0;
  for (size_t i = 0; i < PLACES; i++)
    if (isfinite(g->points[i].gauss)) largest = fmax(largest, fabs(g->points[i].gauss));
  for (size_t i = 0; i < PLACES; i++)
    if (fabs(g->points[i].gauss) < 1e-12 * largest) g->points[i].gauss = 0;
}

/* The plot's range: that of all K, or, where there are spikes, so far beyond where 96 % of them are as these spread
 * themselves. */
static batten_status choose_range(batten_context *ctx, drawing *d) {
  double *sorted = batten_alloc_array(ctx, PLACES, sizeof *sorted);
  if (!sorted) return BATTEN_E_NOMEM;
  size_t n = 0;
  for (size_t i = 0; i < PLACES; i++)
    if (isfinite(d->grid.points[i].gauss)) sorted[n++] = d->grid.points[i].gauss;
  qsort(sorted, n, sizeof *sorted, compare_doubles);
  d->least = n ? sorted[0] : 0;
  d->most = n ? sorted[n - 1] : 0;
  double low = n ? sorted[n / 50] : 0, high = n ? sorted[n - 1 - n / 50] : 0, spread = high - low;
  d->from = fmax(d->least, low - spread);
  d->to = fmin(d->most, high + spread);
  if (d->most - d->least <= worth_cutting * (d->to - d->from)) d->from = d->least, d->to = d->most;
  if (d->from > 0 && d->from < 0.8 * d->to) d->from = 0;
  if (d->to < 0 && d->to > 0.8 * d->from) d->to = 0;
  double largest = fmax(fabs(d->from), fabs(d->to)), unit = 1 / (d->size * d->size);
  d->flat = !(largest > flat_gauss * unit);
  if (d->flat) {
    d->from = isfinite(unit) && unit > 0 ? -unit : -1;
    d->to = -d->from;
  } else if (!(d->to - d->from > 1e-9 * largest)) { /* one value */
    d->from -= 0.5 * largest;
    d->to += 0.5 * largest;
  }
  batten_free(ctx, sorted);
  return BATTEN_OK;
}

/* Colours by K: -1 at the lower end of the plot's range, 1 at the upper, 0 where K is 0. Roots, so that a sign shows
 * where K is small, too. */
static double tone_of(const drawing *d, double gauss) {
  double end = gauss < 0 ? d->from : d->to;
  if (!isfinite(gauss)) return NAN;
  if (gauss == 0 || end == 0 || d->flat) return 0;
  return copysign(sqrt(fmin(1, gauss / end)), gauss);
}

static batten_status make_plot(batten_context *ctx, drawing *d) {
  double *vertices = batten_alloc_array(ctx, PLACES, 3 * sizeof *vertices);
  double *values = batten_alloc_array(ctx, PLACES, sizeof *values);
  bool *missing = batten_alloc_array(ctx, PLACES, sizeof *missing);
  d->tones = batten_alloc_array(ctx, PLACES, sizeof *d->tones);
  batten_status st = BATTEN_E_NOMEM;
  if (!vertices || !values || !missing || !d->tones) goto done;
  round_gauss(&d->grid);
  st = choose_range(ctx, d);
  if (st < 0) goto done;
  for (size_t i = 0; i < PLACES; i++) {
    double gauss = d->flat ? 0 : d->grid.points[i].gauss;
    missing[i] = !isfinite(gauss);
    values[i] = gauss;
    vertices[3 * i] = (double)(i / SIDE) / GRID;
    vertices[3 * i + 1] = (double)(i % SIDE) / GRID;
    double shown = missing[i] ? d->from : fmin(d->to, fmax(d->from, gauss));
    vertices[3 * i + 2] = plot_height * (shown - d->from) / (d->to - d->from);
    d->tones[i] = tone_of(d, gauss);
  }
  st = grid_mesh(ctx, vertices, missing, false, &d->plot);
  for (size_t i = 0; st >= 0 && i < SIDE; i += GRID / PLOT_LINES)
    for (size_t j = 0; st >= 0 && j < GRID; j++) {
      size_t a = index_of(i, j), b = index_of(i, j + 1), c = index_of(j, i), e = index_of(j + 1, i);
      if (!missing[a] && !missing[b])
        st = convex_add_segment(ctx, &d->plot_lines, vertices + 3 * a, vertices + 3 * b);
      if (st >= 0 && !missing[c] && !missing[e])
        st = convex_add_segment(ctx, &d->plot_lines, vertices + 3 * c, vertices + 3 * e);
    }
  const double zero = 0;
  if (st >= 0 && !d->flat) st = batten_mesh_level_lines(ctx, d->plot, values, 1, &zero, &d->zero_count, &d->zero);
done:
  batten_free(ctx, missing);
  batten_free(ctx, values);
  batten_free(ctx, vertices);
  return st;
}

/* ---- level curves -------------------------------------------------------------------------------- */

/* A step of 1, 2 or 5 times a power of 10 of which about `count` fit into a range. */
static double level_step(double range, double count) {
  double raw = range / count, power = pow(10, floor(log10(raw))), lead = raw / power;
  return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
}

static void height_range(const batten_mesh *mesh, unsigned up, double *low, double *high) {
  const double *v = batten_mesh_vertices(mesh);
  for (size_t i = 0; i < batten_mesh_vertex_count(mesh); i++) {
    *low = fmin(*low, v[3 * i + up]);
    *high = fmax(*high, v[3 * i + up]);
  }
}

/* One for both surfaces, a dozen levels on the convex one; but an unconstrained surface that rises far above it is
 * not to be black with them. */
static double choose_step(const drawing *d, size_t sides, unsigned up) {
  double step = 0;
  for (size_t i = 0; i < sides; i++) {
    double low = INFINITY, high = -INFINITY;
    height_range(d[i].space, up, &low, &high);
    if (high > low) step = fmax(step, level_step(high - low, i + 1 < sides ? 40 : 12));
  }
  return step > 0 ? step : 1;
}

static batten_status make_levels(batten_context *ctx, drawing *d, unsigned up, double step) {
  double low = INFINITY, high = -INFINITY;
  height_range(d->space, up, &low, &high);
  double first = ceil(low / step), last = floor(high / step);
  if (!(last >= first)) return BATTEN_OK;
  size_t count = (size_t)(last - first) + 1, V = batten_mesh_vertex_count(d->space);
  double *levels = batten_alloc_array(ctx, count, sizeof *levels);
  double *heights = batten_alloc_array(ctx, V, sizeof *heights);
  batten_status st = levels && heights ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < count; i++) levels[i] = (first + (double)i) * step;
  for (size_t i = 0; st >= 0 && i < V; i++) heights[i] = batten_mesh_vertices(d->space)[3 * i + up];
  if (st >= 0) st = batten_mesh_level_lines(ctx, d->space, heights, count, levels, &d->level_count, &d->levels);
  batten_free(ctx, heights);
  batten_free(ctx, levels);
  return st;
}

/* ---- panels -------------------------------------------------------------------------------------- */

static batten_picture_lines kind(const convex_segments *s, unsigned color, double width, double hidden) {
  return (batten_picture_lines){s->count, s->ends, color, width, hidden};
}

static void describe(drawing *d, const batten_picture_options *view, const char *name) {
  snprintf(d->plot_title, TEXT, "Gaussian curvature, %s", name);
  batten_picture_options *o = &d->space_options;
  d->space_lines[0] = kind(&d->spans, 0x3f4d63, 1.1, 0.25);
  d->space_lines[1] = (batten_picture_lines){d->level_count, d->levels, 0x14161b, 1.3, 0};
  d->space_lines[2] = kind(&d->ellipse, 0x7a1f5c, 1.7, 0);
  d->space_lines[3] = kind(&d->net, 0x2f6b34, 1.5, 0.35);
  d->space_lines[4] = kind(&d->knots, 0x2f6b34, 5.5, 0.35);
  *o = batten_picture_options_default();
  o->azimuth_deg = view->azimuth_deg;
  o->elevation_deg = view->elevation_deg;
  o->up_axis = view->up_axis;
  o->title = name;
  o->caption = d->space_caption;
  o->colors = d->tones;
  o->normals = d->normals;
  o->line_count = LINE_KINDS;
  o->lines = d->space_lines;
  o = &d->plot_options;
  *o = batten_picture_options_default();
  d->plot_line_kinds[0] = kind(&d->plot_lines, 0x14161b, 0.9, 0);
  d->plot_line_kinds[1] = (batten_picture_lines){d->zero_count, d->zero, 0xb01010, 2.6, 0};
  d->axes = (batten_picture_axes){.upper = {1, 1, plot_height},
                                  .from = {d->grid.lower[0], d->grid.lower[1], d->from},
                                  .to = {d->grid.upper[0], d->grid.upper[1], d->to},
                                  .labels = {"u", "v", "K"}};
  o->azimuth_deg = -62;
  o->elevation_deg = 27;
  o->title = d->plot_title;
  o->caption = d->plot_caption;
  o->colors = d->tones;
  o->line_count = 2;
  o->lines = d->plot_line_kinds;
  o->axes = &d->axes;
  for (int i = 0; i < 2; i++) {
    o = i == 0 ? &d->space_options : &d->plot_options;
    o->color_map = BATTEN_MAP_PARTED;
    o->color_lower = -1;
    o->color_upper = 1;
    o->no_color_bar = 1;
    o->both_sides = 1;
  }
}

static void caption(drawing *d, size_t count, double step, bool alone) {
  char cut[TEXT / 2] = "";
  bool below = d->least<d->from, above = d->most> d->to;
  if (below && above)
    snprintf(cut, sizeof cut, ", cut off at %.3g and %.3g", d->from, d->to);
  else if (below || above)
    snprintf(cut, sizeof cut, ", cut off at %.3g", below ? d->from : d->to);
  if (d->flat)
    snprintf(d->plot_caption, TEXT, "K = 0 but for rounding");
  else
    snprintf(d->plot_caption, TEXT, "K from %.3g to %.3g%s", d->least, d->most, cut);
  if (d->ellipse.count && !alone)
    snprintf(d->space_caption, TEXT, "ellipses: diameters as the principal curvatures");
  else
    snprintf(d->space_caption, TEXT, "%zu points, control net, level curves %.3g apart", count, step);
}

static batten_status draw(batten_context *ctx, drawing *d, size_t count, const convex_frame *frame, unsigned up) {
  for (size_t i = 0; i < count; i++) {
    batten_status st = make_space(ctx, &d[i], frame, up);
    if (st >= 0) st = make_plot(ctx, &d[i]);
    if (st >= 0) st = convex_net(ctx, d[i].surface, frame, &d[i].net, &d[i].knots);
    if (st >= 0) st = convex_span_curves(ctx, d[i].surface, frame, &d[i].spans);
    if (st >= 0 && d[i].ellipses) st = convex_ellipses(ctx, d[i].surface, frame, &d[i].ellipse);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

batten_status cli_convex_picture(batten_context *ctx, const batten_surface *unconstrained,
                                 const batten_surface *convex, const char *shape, size_t count, const double *points,
                                 const batten_picture_options *view, const char *path) {
  size_t sides = unconstrained ? 2 : 1;
  unsigned up = view->up_axis;
  drawing *d = batten_alloc_array(ctx, 2, sizeof *d);
  double *turned = batten_alloc_array(ctx, count, 3 * sizeof *turned);
  batten_status st = BATTEN_E_NOMEM;
  if (d) memset(d, 0, 2 * sizeof *d);
  if (!d || !turned) goto done;
  d[0].surface = unconstrained ? unconstrained : convex;
  d[1].surface = convex;
  d[sides - 1].ellipses = true;
  st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < sides; i++) st = evaluate_grid(ctx, d[i].surface, &d[i].grid);
  if (st < 0) goto done;
  convex_frame frame = choose_frame(&d[sides - 1], up);
  st = draw(ctx, d, sides, &frame, up);
  if (st < 0) goto done;
  double step = choose_step(d, sides, up);
  for (size_t i = 0; i < count; i++) convex_to_frame(&frame, points + 3 * i, turned + 3 * i);
  batten_picture_panel panels[4] = {{0}};
  for (size_t i = 0; st >= 0 && i < sides; i++) {
    st = make_levels(ctx, &d[i], up, step);
    caption(&d[i], count, step, !unconstrained);
    bool left = unconstrained && i == 0;
    describe(&d[i], view, left ? "unconstrained" : shape);
    d[i].space_options.point_count = count;
    d[i].space_options.points = turned;
    d[i].space_options.point_scale = 0.75; /* ellipses want to be seen between them */
    panels[i] = (batten_picture_panel){d[i].space, &d[i].space_options, 1};
    panels[sides + i] = (batten_picture_panel){d[i].plot, &d[i].plot_options, 2};
  }
  if (st >= 0) st = batten_picture_panels(ctx, unconstrained ? 2 : 1, 2, panels, view, path);
done:
  for (size_t i = 0; d && i < 2; i++) drawing_free(ctx, &d[i]);
  batten_free(ctx, turned);
  batten_free(ctx, d);
  return st;
}
