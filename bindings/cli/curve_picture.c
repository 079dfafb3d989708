/* Pictures of `batten curve`: the fits without and with inequalities beside each other, with data, control polygons
 * and combs (normals as long as the curvature is large, as in figure 2 of the paper); for one contour also plots of
 * the curvature by length, over what the smoothed data have. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "curve.h"

/* Points of polylines as they grow; a part ends where the next begins. */
typedef struct lines {
  size_t count, room, part_count, part_room;
  double *points;
  size_t *starts;
} lines;

static batten_status lines_reserve(batten_context *ctx, lines *l, size_t points) {
  if (l->count + points > l->room) {
    size_t room = 2 * (l->count + points);
    double *grown = batten_realloc_array(ctx, l->points, room, 2 * sizeof *grown);
    if (!grown) return BATTEN_E_NOMEM;
    l->points = grown;
    l->room = room;
  }
  if (l->part_count + 2 > l->part_room) {
    size_t room = 2 * (l->part_count + 2);
    size_t *grown = batten_realloc_array(ctx, l->starts, room, sizeof *grown);
    if (!grown) return BATTEN_E_NOMEM;
    l->starts = grown;
    l->part_room = room;
  }
  return BATTEN_OK;
}

/* Room has been made. */
static void lines_point(lines *l, double x, double y) {
  l->points[2 * l->count] = x;
  l->points[2 * l->count + 1] = y;
  l->count++;
}

static void lines_end(lines *l) {
  if (l->part_count == 0) l->starts[0] = 0;
  l->starts[++l->part_count] = l->count;
}

static void lines_free(batten_context *ctx, lines *l) {
  batten_free(ctx, l->points);
  batten_free(ctx, l->starts);
}

/* What is drawn of one of the two fits of all contours. */
typedef struct side {
  lines curve, polygon, quills, envelope, inflections, curvature;
} side;

static void side_free(batten_context *ctx, side *s) {
  lines *all[] = {&s->curve, &s->polygon, &s->quills, &s->envelope, &s->inflections, &s->curvature};
  for (size_t i = 0; i < sizeof all / sizeof *all; i++) lines_free(ctx, all[i]);
}

/* ---- geometry ------------------------------------------------------------------------------------ */

static batten_status add_polyline(batten_context *ctx, const batten_curve *curve, double tolerance, lines *out) {
  size_t count = 0;
  double *parameters = NULL;
  batten_curve_point *at = NULL;
  batten_status st = batten_curve_sample(ctx, curve, tolerance, &count, &parameters);
  if (st < 0) return st;
  at = batten_alloc_array(ctx, count, sizeof *at);
  st = at ? batten_curve_evaluate(ctx, curve, count, parameters, at) : BATTEN_E_NOMEM;
  if (st >= 0) st = lines_reserve(ctx, out, count);
  if (st >= 0) {
    for (size_t i = 0; i < count; i++) lines_point(out, at[i].point[0], at[i].point[1]);
    lines_end(out);
  }
  batten_free(ctx, at);
  batten_free(ctx, parameters);
  return st;
}

static batten_status add_polygon(batten_context *ctx, const batten_curve *curve, lines *out) {
  batten_curve_form f = batten_curve_get(curve);
  size_t n = f.knot_count - f.degree - 1;
  batten_status st = lines_reserve(ctx, out, n);
  if (st < 0) return st;
  for (size_t i = 0; i < n; i++) lines_point(out, f.control_points[2 * i], f.control_points[2 * i + 1]);
  lines_end(out);
  return BATTEN_OK;
}

static batten_status add_inflections(batten_context *ctx, const batten_curve *curve, lines *out) {
  size_t count = 0;
  double *parameters = NULL;
  batten_status st = batten_curve_inflections(ctx, curve, &count, &parameters);
  if (st < 0 || count == 0) return st;
  batten_curve_point *at = batten_alloc_array(ctx, count, sizeof *at);
  st = at ? batten_curve_evaluate(ctx, curve, count, parameters, at) : BATTEN_E_NOMEM;
  if (st >= 0) st = lines_reserve(ctx, out, count);
  if (st >= 0)
    for (size_t i = 0; i < count; i++) lines_point(out, at[i].point[0], at[i].point[1]);
  batten_free(ctx, at);
  batten_free(ctx, parameters);
  return st;
}

/* Places at equal lengths, batten's. */
static batten_status places(batten_context *ctx, const batten_curve *curve, double length, size_t count,
                            batten_curve_point **out) {
  double *parameters = batten_alloc_array(ctx, count, sizeof *parameters);
  batten_curve_point *at = batten_alloc_array(ctx, count, sizeof *at);
  batten_status st = parameters && at ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    for (size_t i = 0; i < count; i++) parameters[i] = length * (double)i / (double)(count - 1);
    st = batten_curve_at_lengths(ctx, curve, count, parameters, parameters);
  }
  if (st >= 0) st = batten_curve_evaluate(ctx, curve, count, parameters, at);
  batten_free(ctx, parameters);
  if (st >= 0)
    *out = at;
  else
    batten_free(ctx, at);
  return st;
}

/* Quills to the outer side of the bend, and the line through their ends; none is longer than `most`. Between quills
 * that line goes through further ends, since curvature changes within few of them at a nose. */
static batten_status add_comb(batten_context *ctx, const batten_curve *curve, double length, size_t count,
                              double scale, double most, side *out) {
  enum { FINER = 8 };
  size_t ends = FINER * (count - 1) + 1;
  batten_curve_point *at = NULL;
  batten_status st = places(ctx, curve, length, ends, &at);
  if (st >= 0) st = lines_reserve(ctx, &out->envelope, ends);
  for (size_t i = 0; st >= 0 && i < ends; i++) {
    double k = isnan(at[i].curvature) ? 0 : fmax(-most, fmin(most, scale * at[i].curvature));
    double tip[2] = {at[i].point[0] + k * at[i].tangent[1], at[i].point[1] - k * at[i].tangent[0]};
    lines_point(&out->envelope, tip[0], tip[1]);
    if (i % FINER) continue;
    st = lines_reserve(ctx, &out->quills, 2);
    if (st < 0) break;
    lines_point(&out->quills, at[i].point[0], at[i].point[1]);
    lines_point(&out->quills, tip[0], tip[1]);
    lines_end(&out->quills);
  }
  if (st >= 0) lines_end(&out->envelope);
  batten_free(ctx, at);
  return st;
}

/* Curvature by length, each span by itself, since it may jump between them. */
static batten_status add_curvature(batten_context *ctx, const batten_curve *curve, lines *out) {
  enum { STEPS = 24 };
  batten_curve_form f = batten_curve_get(curve);
  double length = 0;
  batten_status st = BATTEN_OK;
  for (size_t mu = f.degree; st >= 0 && mu + f.degree + 1 < f.knot_count; mu++) {
    double from = f.knots[mu], to = f.knots[mu + 1], t[STEPS + 1], part;
    batten_curve_point at[STEPS + 1];
    if (!(from < to)) continue;
    for (int i = 0; i <= STEPS; i++) t[i] = from + (to - from) * i / STEPS;
    t[STEPS] = nextafter(to, from); /* from the left */
    st = batten_curve_evaluate(ctx, curve, STEPS + 1, t, at);
    if (st >= 0) st = batten_curve_length(ctx, curve, from, to, &part);
    if (st >= 0) st = lines_reserve(ctx, out, STEPS + 1);
    if (st < 0) break;
    double run = 0, whole = 0;
    for (int i = 0; i < STEPS; i++)
      whole += hypot(at[i + 1].point[0] - at[i].point[0], at[i + 1].point[1] - at[i].point[1]);
    for (int i = 0; i <= STEPS; i++) {
      if (i > 0) run += hypot(at[i].point[0] - at[i - 1].point[0], at[i].point[1] - at[i - 1].point[1]);
      if (isfinite(at[i].curvature)) lines_point(out, length + (whole > 0 ? part * run / whole : 0), at[i].curvature);
    }
    lines_end(out);
    length += part;
  }
  return st;
}

/* ---- all contours -------------------------------------------------------------------------------- */

typedef struct drawing {
  const curve_work *w;
  double box[2], size, length; /* of all results together; size: the longer side of the box */
  double scale, most;          /* of combs */
  double bend;                 /* that nineteen of twenty places of the results do not exceed */
  lines data;
  side sides[2]; /* without inequalities, with them */
} drawing;

static size_t quills_of(const drawing *d, double length) {
  double share = d->length > 0 ? length / d->length : 0;
  return (size_t)fmax(16, fmin(240, 360 * share));
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* Several curves are drawn without control polygons, and many without combs: nobody could tell them apart. */
static bool has_polygons(const drawing *d) { return d->w->count <= 6; }
static bool has_combs(const drawing *d) { return d->w->count <= 16; }

/* Nineteen of twenty quills of the results are shorter than an eighth of the picture, of several less; none is longer
 * than two and a half of that. */
static batten_status find_scale(batten_context *ctx, drawing *d) {
  size_t count = 0, at = 0;
  for (size_t i = 0; i < d->w->count; i++) count += quills_of(d, d->w->items[i].measures.length);
  double *sizes = batten_alloc_array(ctx, count, sizeof *sizes);
  batten_status st = sizes ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < d->w->count; i++) {
    const curve_item *item = &d->w->items[i];
    size_t n = quills_of(d, item->measures.length);
    batten_curve_point *p = NULL;
    st = places(ctx, item->curve, item->measures.length, n, &p);
    for (size_t k = 0; st >= 0 && k < n; k++) sizes[at++] = isnan(p[k].curvature) ? 0 : fabs(p[k].curvature);
    batten_free(ctx, p);
  }
  if (st >= 0) {
    qsort(sizes, count, sizeof *sizes, ascending);
    d->bend = sizes[count - 1 - count / 20];
    double length = 0.12 / sqrt((double)d->w->count) * d->size;
    d->scale = d->bend > 0 ? length / d->bend : 0;
    d->most = 2.5 * length;
  }
  batten_free(ctx, sizes);
  return st;
}

static batten_status gather_side(batten_context *ctx, drawing *d, int which) {
  side *s = &d->sides[which];
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < d->w->count; i++) {
    const curve_item *item = &d->w->items[i];
    const batten_curve *curve = which ? item->curve : item->unconstrained;
    double length = item->measures.length;
    if (!which) {
      batten_curve_form f = batten_curve_get(curve);
      st = batten_curve_length(ctx, curve, f.knots[0], f.knots[f.knot_count - 1], &length);
    }
    if (st >= 0) st = add_polyline(ctx, curve, d->size / 4000, &s->curve);
    if (st >= 0) st = add_inflections(ctx, curve, &s->inflections);
    if (st >= 0 && has_polygons(d)) st = add_polygon(ctx, curve, &s->polygon);
    if (st >= 0 && has_combs(d)) st = add_comb(ctx, curve, length, quills_of(d, length), d->scale, d->most, s);
    if (st >= 0 && d->w->count == 1) st = add_curvature(ctx, curve, &s->curvature);
  }
  return st;
}

static batten_status gather(batten_context *ctx, drawing *d) {
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < d->w->count; i++) {
    const curve_item *item = &d->w->items[i];
    for (int k = 0; k < 2; k++) {
      lower[k] = fmin(lower[k], item->measures.lower[k]);
      upper[k] = fmax(upper[k], item->measures.upper[k]);
    }
    d->length += item->measures.length;
    st = lines_reserve(ctx, &d->data, item->count);
    for (size_t k = 0; st >= 0 && k < item->count; k++)
      lines_point(&d->data, item->points[2 * k], item->points[2 * k + 1]);
  }
  for (int k = 0; k < 2; k++) d->box[k] = upper[k] - lower[k];
  d->size = fmax(d->box[0], d->box[1]);
  if (st >= 0) st = find_scale(ctx, d);
  if (st >= 0) st = gather_side(ctx, d, 0);
  if (st >= 0) st = gather_side(ctx, d, 1);
  return st;
}

/* ---- plots --------------------------------------------------------------------------------------- */

enum { SHAPE_LAYERS = 7, CURVATURE_LAYERS = 3, CAPTION = 128 };

static batten_plot_layer layer(batten_plot_kind kind, const lines *l, unsigned color, double width,
                               const char *label) {
  return (batten_plot_layer){.kind = kind,
                             .count = l->count,
                             .points = l->points,
                             .part_count = kind == BATTEN_PLOT_LINE ? l->part_count : 0,
                             .starts = l->starts,
                             .color = color,
                             .width = width,
                             .label = label};
}

/* Several contours have two plots alone, which need not be higher than what they show. */
static unsigned needed_height(const drawing *d, unsigned width) {
  if (d->w->count == 1) return width / 16 * 11;
  double aspect = d->box[0] > 0 ? d->box[1] / d->box[0] : 1;
  return (unsigned)fmax(16, width * fmax(0.35, fmin(1, 0.46 * aspect + 0.11)));
}

/* In thousandths of the picture: crosses of neighbours hardly touch, where the curve takes half of the picture. */
static double cross_radius(const drawing *d) {
  double spacing = d->size > 0 ? 450 * d->length / d->size / (double)d->data.count : 0;
  return fmax(1.6, fmin(has_polygons(d) ? 4 : 2.2, 0.35 * spacing));
}

static void shape_plot(const drawing *d, int which, batten_plot_layer *layers, batten_plot *plot,
                       char caption[CAPTION]) {
  const side *s = &d->sides[which];
  const curve_work *w = d->w;
  bool few = w->count == 1 && s->polygon.count <= 60, named = which == 1, all = has_polygons(d);
  layers[0] = layer(BATTEN_PLOT_LINE, &s->quills, all ? 0xcfdbe9 : 0xafc3da, 0.9, NULL);
  layers[1] = layer(BATTEN_PLOT_LINE, &s->envelope, 0x8fabcb, all ? 1.3 : 0.9,
                    named && s->envelope.count ? "curvature" : NULL);
  layers[2] = layer(BATTEN_PLOT_CROSSES, &d->data, 0xc8442c, cross_radius(d), named ? "data" : NULL);
  layers[3] = layer(BATTEN_PLOT_LINE, &s->polygon, 0xa0a0a0, 1.2, named && all ? "control polygon" : NULL);
  layers[4] = layer(BATTEN_PLOT_DOTS, &s->polygon, 0x808080, few ? 3.2 : 1.8, NULL);
  layers[5] = layer(BATTEN_PLOT_LINE, &s->curve, 0x1f4e79, all ? 2.4 : 1.4, named ? "curve" : NULL);
  layers[6] = layer(BATTEN_PLOT_RINGS, &s->inflections, 0x1a7f37, w->count == 1 ? 7 : 4,
                    named && s->inflections.count ? "inflection" : NULL);
  double sum = 0;
  size_t inflections = 0;
  bool proven = true;
  for (size_t i = 0; i < w->count; i++) {
    const batten_contour_info *info = &w->items[i].info;
    sum += which ? info->lsq : info->lsq_unconstrained;
    inflections += which ? info->inflections_found : info->inflections_unconstrained;
    proven = proven && info->shape.certified;
  }
  snprintf(caption, CAPTION, "%s: %zu inflection%s%s, sum of squares %.4g",
           which ? "with inequalities" : "without inequalities", inflections, inflections == 1 ? "" : "s",
           !which   ? ""
           : proven ? " (proven)"
                    : " (NOT PROVEN)",
           sum);
  *plot = (batten_plot){.layer_count = SHAPE_LAYERS, .layers = layers, .group = 1, .caption = caption};
}

/* What the smoothed data have, with two standard deviations to both sides. */
static batten_status band(batten_context *ctx, const curve_item *item, lines *out) {
  const batten_contour_proposal *p = &item->proposal;
  size_t n = p->sample_count;
  if (n == 0) return BATTEN_OK;
  batten_status st = lines_reserve(ctx, out, 2 * n);
  if (st < 0) return st;
  for (size_t i = 0; i < 2 * n; i++) {
    const double *s = p->samples + 4 * (i < n ? i : 2 * n - 1 - i);
    lines_point(out, s[3], s[1] + (i < n ? -2 : 2) * s[2]);
  }
  lines_end(out);
  return BATTEN_OK;
}

/* A bend far stronger than the others, as the nose of an airfoil is, would flatten the rest: the plot is cut, and its
 * label tells what there is. */
static void curvature_plot(const drawing *d, int which, const lines *smoothed, batten_plot_layer *layers,
                           batten_plot *plot, const double zero[4], char label[CAPTION]) {
  const side *s = &d->sides[which];
  const batten_curve_measures *m = &d->w->items[0].measures;
  double limit = 2.5 * fmax(d->bend, 0.02 * fmax(fabs(m->curvature_min), fabs(m->curvature_max)));
  double low = fmax(-limit, fmin(0, m->curvature_min)), high = fmin(limit, fmax(0, m->curvature_max));
  double margin = 0.25 * (high - low), lowest = INFINITY, highest = -INFINITY;
  for (size_t i = 0; i < s->curvature.count; i++) {
    lowest = fmin(lowest, s->curvature.points[2 * i + 1]);
    highest = fmax(highest, s->curvature.points[2 * i + 1]);
  }
  if (lowest < low - margin || highest > high + margin)
    snprintf(label, CAPTION, "curvature, cut (%.4g to %.4g)", lowest, highest);
  else
    snprintf(label, CAPTION, "curvature");
  layers[0] = layer(BATTEN_PLOT_AREA, smoothed, 0xe4e0d4, 0, which && smoothed->count ? "smoothed data" : NULL);
  layers[1] = (batten_plot_layer){.count = 2, .points = zero, .color = 0x6a6f78, .width = 1.2};
  layers[2] = layer(BATTEN_PLOT_LINE, &s->curvature, 0x1f4e79, 2.4, NULL);
  *plot = (batten_plot){.layer_count = CURVATURE_LAYERS,
                        .layers = layers,
                        .stretched = 1,
                        .lower = {0, low - margin},
                        .upper = {zero[2], high + margin},
                        .labels = {"length", label}};
}

batten_status curve_draw(const curve_work *w, const char *path) {
  batten_context *ctx = w->run.ctx;
  drawing d = {.w = w};
  lines smoothed = {0};
  batten_plot_layer shapes[2][SHAPE_LAYERS], curvatures[2][CURVATURE_LAYERS];
  batten_plot plots[4] = {0};
  char captions[2][CAPTION], labels[2][CAPTION];
  batten_picture_options options = w->request->picture;
  batten_status st = gather(ctx, &d);
  if (st >= 0 && w->count == 1) st = band(ctx, &w->items[0], &smoothed);
  if (st >= 0) {
    const double zero[4] = {0, 0, d.length, 0};
    if (options.height == 0) options.height = needed_height(&d, options.width);
    for (int k = 0; k < 2; k++) {
      shape_plot(&d, k, shapes[k], &plots[k], captions[k]);
      if (w->count == 1) curvature_plot(&d, k, &smoothed, curvatures[k], &plots[2 + k], zero, labels[k]);
    }
    st = batten_picture_plots(ctx, w->count == 1 ? 2 : 1, 2, plots, &options, path);
  }
  lines_free(ctx, &smoothed);
  lines_free(ctx, &d.data);
  for (int k = 0; k < 2; k++) side_free(ctx, &d.sides[k]);
  return st;
}
