/* Surfaces from the documents that json_surface.c writes. Types and counts are checked here, with the place in the
 * document; knots are checked by batten_surface_create, whose text is passed on. */
#include "format.h"
#include "json_read.h"

#include <math.h>
#include <stdio.h>

typedef struct parts {
  unsigned degree[2];
  size_t knot_count[2], point_count[2];
  double *knots[2], *points;
} parts;

static batten_status get_degree(bx_json *j, const json_t *root, parts *p) {
  double values[2] = {0};
  batten_status st = bx_get_numbers(j, root, "degree", 2, values);
  for (size_t i = 0; st == BATTEN_OK && i < 2; i++) {
    size_t mark = bx_enter(j, "degree");
    bx_enter_item(j, i);
    if (values[i] >= 1 && values[i] <= BATTEN_SURFACE_DEGREE_MAX && !(values[i] > floor(values[i])))
      p->degree[i] = (unsigned)values[i];
    else
      st = bx_json_fail(j, "%g, where a whole number from 1 to %d is expected", values[i], BATTEN_SURFACE_DEGREE_MAX);
    bx_leave(j, mark);
  }
  return st;
}

static batten_status get_knots(bx_json *j, const json_t *root, parts *p) {
  json_t *array = NULL;
  batten_status st = bx_get_array(j, root, "knots", 2, &array);
  for (size_t i = 0; st == BATTEN_OK && i < 2; i++) {
    size_t mark = bx_enter(j, "knots");
    bx_enter_item(j, i);
    st = bx_rows_of(j, json_array_get(array, i), 0, &p->knot_count[i], &p->knots[i]);
    if (st == BATTEN_OK && p->knot_count[i] < 2 * ((size_t)p->degree[i] + 1))
      st = bx_json_fail(j, "%zu knots, where degree %u needs %u at least", p->knot_count[i], p->degree[i],
                        2 * (p->degree[i] + 1));
    bx_leave(j, mark);
    p->point_count[i] = p->knot_count[i] - p->degree[i] - 1;
  }
  return st;
}

/* The number of rows and of points in each follows from the knots. */
static batten_status get_points(bx_json *j, const json_t *root, parts *p) {
  json_t *rows = NULL;
  size_t mark = 0, columns = p->point_count[1];
  batten_status st = bx_get_array(j, root, "control_points", p->point_count[0], &rows);
  if (st != BATTEN_OK) return st;
  size_t row_size = columns * 3 * sizeof *p->points; /* columns of a file: far below overflow */
  p->points = batten_alloc_array(j->ctx, p->point_count[0], row_size);
  if (!p->points) return BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < p->point_count[0]; i++) {
    mark = bx_enter(j, "control_points");
    bx_enter_item(j, i);
    st = bx_fill_rows(j, json_array_get(rows, i), columns, 3, p->points + 3 * columns * i);
    bx_leave(j, mark);
  }
  return st;
}

batten_status bx_read_surface_from(bx_reader *r, batten_surface **out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL;
  parts p = {0};
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "surface");
  snprintf(j.place, sizeof j.place, "surface");
  if (st == BATTEN_OK) st = get_degree(&j, root, &p);
  if (st == BATTEN_OK) st = get_knots(&j, root, &p);
  if (st == BATTEN_OK) st = get_points(&j, root, &p);
  json_decref(root);
  if (st == BATTEN_OK) {
    st = batten_surface_create(r->ctx,
                               &(batten_surface_form){.degree = {p.degree[0], p.degree[1]},
                                                      .knot_count = {p.knot_count[0], p.knot_count[1]},
                                                      .knots = {p.knots[0], p.knots[1]},
                                                      .control_points = p.points},
                               out);
    if (st == BATTEN_E_INVALID) st = bx_json_fail(&j, "%s", batten_error(r->ctx));
  }
  for (int i = 0; i < 2; i++) batten_free(r->ctx, p.knots[i]);
  batten_free(r->ctx, p.points);
  return st;
}

batten_status batten_read_surface(batten_context *ctx, const char *path, batten_surface **out) {
  bx_reader r;
  batten_status st = bx_open_document(&r, ctx, path, out, "surfaces");
  if (st != BATTEN_OK) return st;
  st = bx_read_surface_from(&r, out);
  bx_close(&r);
  return st;
}
