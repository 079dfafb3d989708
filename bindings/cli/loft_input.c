/* Input of `batten loft`: curves, or slices that become curves; in parallel planes, by ascending height. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "loft.h"

typedef struct place {
  size_t number; /* of the contour in the file */
  batten_plane_place at;
} place;

static int by_height(const void *a, const void *b) {
  const place *p = a, *q = b;
  if (p->at.height < q->at.height) return -1;
  if (p->at.height > q->at.height) return 1;
  return p->number < q->number ? -1 : 1;
}

/* Where the contours lie, in the order of heights; *places batten's. planes NULL: the file knows of none. */
static batten_status find_places(loft_work *w, size_t count, const batten_plane *planes, place **places) {
  batten_context *ctx = w->run.ctx;
  const batten_plane_place flat = {0, {1, 0, 0, 1}, {0, 0}};
  batten_plane_place *found = batten_alloc_array(ctx, count, sizeof *found);
  place *out = batten_alloc_array(ctx, count, sizeof *out);
  batten_status st = found && out ? BATTEN_OK : BATTEN_E_NOMEM;
  w->planar = !planes;
  w->base = (batten_plane){{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}}};
  if (st >= 0 && planes) st = batten_plane_stack(ctx, count, planes, &w->base, found);
  if (st >= 0 && !planes && isnan(w->request->gap))
    st = batten_fail(ctx, BATTEN_E_INVALID, "contours: the file tells no heights; give points x y z, or --gap");
  if (st >= 0 && planes && !isnan(w->request->gap))
    st = batten_fail(ctx, BATTEN_E_INVALID, "contours: the file tells their heights; leave --gap away");
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) {
    out[i] = (place){i, planes ? found[i] : flat};
    if (!planes) out[i].at.height = (double)i * w->request->gap;
  }
  qsort(out, count, sizeof *out, by_height);
  for (size_t i = 1; i < count && st >= 0; i++)
    if (!(out[i].at.height > out[i - 1].at.height))
      st = batten_fail(
          ctx, BATTEN_E_INVALID,
          "contours: %zu and %zu lie in one plane, at the height %.17g; a loft goes through one contour in "
          "each plane: take one out, or put them into files of their own",
          out[i - 1].number, out[i].number, out[i].at.height);
  if (st >= 0) {
    *places = out;
    out = NULL;
  }
done:
  batten_free(ctx, out);
  batten_free(ctx, found);
  return st;
}

static batten_status allocate(loft_work *w, size_t count) {
  if (count < 2)
    return batten_fail(w->run.ctx, BATTEN_E_INVALID, "contours: %zu in the file; a loft goes through two or more",
                       count);
  w->contours = batten_alloc_array(w->run.ctx, count, sizeof *w->contours);
  w->heights = batten_alloc_array(w->run.ctx, count, sizeof *w->heights);
  if (!w->contours || !w->heights) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) w->contours[i] = NULL;
  w->count = count;
  return BATTEN_OK;
}

/* ---- curves -------------------------------------------------------------------------------------- */

static batten_status read_curves(loft_work *w) {
  batten_context *ctx = w->run.ctx;
  batten_curves curves = {0};
  place *places = NULL;
  if (w->request->fit_options || w->request->match.fit.closed)
    return batten_fail(
        ctx, BATTEN_E_INVALID,
        "contours: the file has curves; --closed, --degree, --smooth, --significance, --knots, --tolerance "
        "and --match are for slices of points");
  batten_status st = batten_read_curves(ctx, w->request->common.input, &curves);
  if (st >= 0) st = allocate(w, curves.count);
  if (st >= 0) st = find_places(w, curves.count, curves.planes, &places);
  for (size_t i = 0; st >= 0 && i < curves.count; i++) {
    w->heights[i] = places[i].at.height;
    st = batten_curve_transform(ctx, curves.curves[places[i].number], places[i].at.matrix, places[i].at.shift, NULL,
                                &w->contours[i]);
  }
  batten_free(ctx, places);
  batten_curves_free(ctx, &curves);
  return st;
}

/* ---- slices -------------------------------------------------------------------------------------- */

/* Slices in the order of heights, over the base. */
typedef struct slices {
  size_t *starts;
  double *points, *weights;
} slices;

static void slices_free(batten_context *ctx, slices *s) {
  batten_free(ctx, s->weights);
  batten_free(ctx, s->points);
  batten_free(ctx, s->starts);
}

/* No curve that bends goes through one or two points, as tables of offsets have them at the stem. */
static batten_status leave_out(loft_work *w, const batten_contours *c, place *places) {
  size_t kept = 0;
  double first = 0;
  for (size_t i = 0; i < c->count; i++) {
    size_t points = c->starts[places[i].number + 1] - c->starts[places[i].number];
    if (points >= 3)
      places[kept++] = places[i];
    else if (w->left_out++ == 0)
      first = places[i].at.height;
  }
  w->count = kept;
  if (kept < 2)
    return batten_fail(w->run.ctx, BATTEN_E_INVALID,
                       "contours: %zu in the file with 3 points or more; a loft goes through two or more", kept);
  if (w->left_out == 0) return BATTEN_OK;
  cli_run_warn(&w->run,
               batten_fail(w->run.ctx, BATTEN_W_SHAPE,
                           "contours: %zu of fewer than 3 points left out, the first at the height %.9g; the "
                           "surface does without them",
                           w->left_out, first));
  w->status = BATTEN_W_SHAPE;
  return BATTEN_OK;
}

static batten_status order_slices(loft_work *w, const batten_contours *c, const place *places, slices *out) {
  batten_context *ctx = w->run.ctx;
  size_t all = c->starts[c->count], at = 0;
  out->starts = batten_alloc_array(ctx, w->count + 1, sizeof *out->starts);
  out->points = batten_alloc_array(ctx, all, 2 * sizeof *out->points);
  if (c->weights) out->weights = batten_alloc_array(ctx, all, sizeof *out->weights);
  if (!out->starts || !out->points || (c->weights && !out->weights)) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < w->count; i++) {
    const batten_plane_place *p = &places[i].at;
    out->starts[i] = at;
    w->heights[i] = p->height;
    for (size_t k = c->starts[places[i].number]; k < c->starts[places[i].number + 1]; k++, at++) {
      const double *x = c->points + 2 * k;
      for (int r = 0; r < 2; r++)
        out->points[2 * at + (size_t)r] = p->matrix[2 * r] * x[0] + p->matrix[2 * r + 1] * x[1] + p->shift[r];
      if (c->weights) out->weights[at] = c->weights[k];
    }
  }
  out->starts[w->count] = at;
  return BATTEN_OK;
}

/* Slices are numbered by height, not as in the file: the height tells which one a text is about. */
static void tell_height(const loft_work *w, batten_status st) {
  char text[512];
  size_t slice = 0;
  int head = 0;
  snprintf(text, sizeof text, "%s", batten_error(w->run.ctx));
  if (sscanf(text, "slice %zu:%n", &slice, &head) == 1 && head > 0 && slice < w->count)
    batten_fail(w->run.ctx, st, "slice %zu, at the height %.9g:%s", slice, w->heights[slice], text + head);
}

static batten_status match(loft_work *w, const slices *s) {
  batten_loft_match_options o = w->request->match;
  double start = batten_now();
  o.fit.weights = s->weights;
  batten_status st = batten_loft_match(w->run.ctx, w->count, s->starts, s->points, &o, w->contours, &w->match);
  if (st != BATTEN_OK) tell_height(w, st);
  w->time_match_s = batten_now() - start;
  w->matched = true;
  cli_run_warn(&w->run, st);
  if (st > 0 && w->status == BATTEN_OK) w->status = st;
  return st;
}

static batten_status read_slices(loft_work *w) {
  batten_context *ctx = w->run.ctx;
  batten_contours contours = {0};
  slices s = {0};
  place *places = NULL;
  batten_status st = batten_read_contours(ctx, w->request->common.input, &contours);
  if (st >= 0) st = allocate(w, contours.count);
  if (st >= 0) st = find_places(w, contours.count, contours.planes, &places);
  if (st >= 0) st = leave_out(w, &contours, places);
  if (st >= 0) st = order_slices(w, &contours, places, &s);
  if (st >= 0) st = match(w, &s);
  slices_free(ctx, &s);
  batten_free(ctx, places);
  batten_contours_free(ctx, &contours);
  return st;
}

batten_status loft_read(loft_work *w) {
  double start = batten_now();
  batten_file_kind kind;
  batten_status st = batten_file_identify(w->run.ctx, w->request->common.input, &kind);
  if (st < 0) return st;
  if (kind == BATTEN_FILE_POINTS || kind == BATTEN_FILE_UNKNOWN)
    st = read_slices(w); /* tells what is wrong where it is unknown */
  else if (kind == BATTEN_FILE_CURVES)
    st = read_curves(w);
  else
    st = batten_fail(w->run.ctx, BATTEN_E_FORMAT,
                     "contours: there are none in the file; give curves, as batten curve writes them to .json, or "
                     "slices of points (batten inspect tells what a file has)");
  w->time_read_s = batten_now() - start - w->time_match_s;
  return st;
}
