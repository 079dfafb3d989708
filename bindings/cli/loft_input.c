/* Input of `batten loft`: curves, or slices that become curves; in parallel planes, by ascending height. */
#include <math.h>
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

static batten_status order_slices(loft_work *w, const batten_contours *c, const place *places, slices *out) {
  batten_context *ctx = w->run.ctx;
  size_t all = c->starts[c->count], at = 0;
  out->starts = batten_alloc_array(ctx, c->count + 1, sizeof *out->starts);
  out->points = batten_alloc_array(ctx, all, 2 * sizeof *out->points);
  if (c->weights) out->weights = batten_alloc_array(ctx, all, sizeof *out->weights);
  if (!out->starts || !out->points || (c->weights && !out->weights)) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < c->count; i++) {
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
  out->starts[c->count] = at;
  return BATTEN_OK;
}

static batten_status match(loft_work *w, size_t count, const slices *s) {
  batten_loft_match_options o = w->request->match;
  double start = batten_now();
  o.fit.weights = s->weights;
  batten_status st = batten_loft_match(w->run.ctx, count, s->starts, s->points, &o, w->contours, &w->match);
  w->time_match_s = batten_now() - start;
  w->matched = true;
  cli_run_warn(&w->run, st);
  if (st > 0) w->status = st;
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
  if (st >= 0) st = order_slices(w, &contours, places, &s);
  if (st >= 0) st = match(w, contours.count, &s);
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
  st = kind == BATTEN_FILE_CURVES ? read_curves(w) : read_slices(w);
  w->time_read_s = batten_now() - start - w->time_match_s;
  return st;
}
