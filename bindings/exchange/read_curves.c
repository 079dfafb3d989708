/* Planar curves from the documents that json_curves.c writes. Types and counts are checked here, with the place in
 * the document; knots and closedness are checked by batten_curve_create, whose text is passed on. */
#include "curves.h"
#include "format.h"
#include "json_read.h"

#include "base/checked.h"

#include <stdio.h>
#include <string.h>

/* *has: the curve says where it lies. */
static batten_status get_plane(bx_json *j, const json_t *object, batten_plane *plane, bool *has) {
  *plane = (batten_plane){{0}, {{1, 0, 0}, {0, 1, 0}}};
  json_t *place = json_object_get(object, "plane"), *rows = NULL;
  *has = place || json_object_get(object, "z");
  if (!place) return *has ? bx_get_number(j, object, "z", &plane->origin[2]) : BATTEN_OK;
  if (json_object_get(object, "z")) return bx_json_fail(j, "'z' and 'plane' at once; leave out one of them");
  size_t mark = bx_enter(j, "plane");
  batten_status st = bx_get_numbers(j, place, "origin", 3, plane->origin);
  if (st == BATTEN_OK) st = bx_get_array(j, place, "axes", 2, &rows);
  if (st == BATTEN_OK) {
    size_t inner = bx_enter(j, "axes");
    st = bx_fill_rows(j, rows, 2, 3, plane->axes[0]);
    bx_leave(j, inner);
  }
  const char *fault = st == BATTEN_OK ? bx_plane_fault(plane) : NULL;
  if (fault) st = bx_json_fail(j, "%s", fault);
  bx_leave(j, mark);
  return st;
}

static batten_status get_points(bx_json *j, const json_t *object, size_t expected, double **points) {
  size_t count = 0;
  batten_status st = bx_get_rows(j, object, "control_points", 2, &count, points);
  if (st != BATTEN_OK || count == expected) return st;
  size_t mark = bx_enter(j, "control_points");
  st = bx_json_fail(j, "%zu points, where the knots and the degree need %zu", count, expected);
  bx_leave(j, mark);
  return st;
}

static batten_status get_curve(bx_json *j, const json_t *object, batten_curve **out, batten_plane *plane,
                               bool *has_plane) {
  int64_t degree = 0;
  bool periodic = false;
  double *knots = NULL, *points = NULL;
  size_t knot_count = 0;
  batten_status st = bx_get_whole(j, object, "degree", 1, BATTEN_CURVE_DEGREE_MAX, &degree);
  size_t order = (size_t)degree + 1;
  if (st == BATTEN_OK) st = bx_get_flag(j, object, "periodic", &periodic);
  if (st == BATTEN_OK) st = bx_get_rows(j, object, "knots", 0, &knot_count, &knots);
  if (st == BATTEN_OK && knot_count < 2 * order) {
    size_t mark = bx_enter(j, "knots");
    st = bx_json_fail(j, "%zu knots, where degree %d needs %zu at least", knot_count, (int)degree, 2 * order);
    bx_leave(j, mark);
  }
  if (st == BATTEN_OK) st = get_points(j, object, knot_count - order, &points);
  if (st == BATTEN_OK) st = get_plane(j, object, plane, has_plane);
  if (st == BATTEN_OK) {
    st = batten_curve_create(j->ctx,
                             &(batten_curve_form){.degree = (unsigned)degree,
                                                  .knot_count = knot_count,
                                                  .knots = knots,
                                                  .control_points = points,
                                                  .closed = periodic},
                             out);
    if (st == BATTEN_E_INVALID) st = bx_json_fail(j, "%s", batten_error(j->ctx));
  }
  batten_free(j->ctx, knots);
  batten_free(j->ctx, points);
  return st;
}

/* items: the curves' objects, or the document's own where it holds one. */
static batten_status get_curves(bx_json *j, const json_t *root, const json_t *items, batten_curves *out) {
  size_t count = items ? json_array_size(items) : 1;
  bool planes = false;
  batten_status st = BATTEN_OK;
  if (count == 0) return bx_json_fail(j, "'curves' is empty; there must be one or more");
  out->curves = batten_alloc_array(j->ctx, count, sizeof(batten_curve *));
  out->planes = batten_alloc_array(j->ctx, count, sizeof *out->planes);
  if (!out->curves || !out->planes) return BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) {
    size_t mark = strlen(j->place);
    bool has_plane = false;
    if (items) {
      bx_enter(j, "curves");
      bx_enter_item(j, i);
    }
    st = get_curve(j, items ? json_array_get(items, i) : root, &out->curves[i], &out->planes[i], &has_plane);
    bx_leave(j, mark);
    planes = planes || has_plane;
    if (st != BATTEN_OK) break;
    out->count++;
    if (i % 64 == 0) st = batten_progress(j->ctx, "read", (double)i / (double)count);
  }
  if (!planes) {
    batten_free(j->ctx, out->planes);
    out->planes = NULL;
  }
  return st;
}

batten_status bx_read_curves_from(bx_reader *r, batten_curves *out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL, *items = NULL;
  batten_curves curves = {0};
  batten_status st = bx_json_parse(r, &root);
  if (st != BATTEN_OK) return st;
  const json_t *kind = json_object_get(root, "batten");
  bool several = json_is_string(kind) && !strcmp(json_string_value(kind), "contours");
  const char *name = several ? "contours" : "curve";
  st = bx_check_head(&j, root, name);
  snprintf(j.place, sizeof j.place, "%s", name);
  if (st == BATTEN_OK && several) st = bx_get_array(&j, root, "curves", SIZE_MAX, &items);
  if (st == BATTEN_OK) st = get_curves(&j, root, items, &curves);
  json_decref(root);
  if (st == BATTEN_OK)
    *out = curves;
  else
    batten_curves_free(r->ctx, &curves);
  return st;
}

batten_status batten_read_curves(batten_context *ctx, const char *path, batten_curves *out) {
  bx_reader r;
  batten_status st = bx_open_document(&r, ctx, path, out, "curves");
  if (st != BATTEN_OK) return st;
  st = bx_read_curves_from(&r, out);
  bx_close(&r);
  return st;
}

void batten_curves_free(batten_context *ctx, batten_curves *curves) {
  if (!curves) return;
  for (size_t i = 0; i < curves->count; i++) batten_curve_free(curves->curves[i]);
  batten_free(ctx, curves->curves);
  batten_free(ctx, curves->planes);
  *curves = (batten_curves){0};
}
