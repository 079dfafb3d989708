/* Networks from the documents that json_network.c writes. Shapes, types and counts are checked here, with the place
 * in the document; how the parts fit together is checked by batten_network_create, whose text is passed on. */
#include "format.h"
#include "json_read.h"

#include <stdio.h>
#include <string.h>

#include "base/checked.h"

enum { DEGREE_MAX = 12 };

typedef struct parts {
  double *vertices;
  uint32_t *triangles, *creases;
  batten_network_patch *patches;
  double **control_points; /* [patch_count] */
  size_t vertex_count, triangle_count, crease_count, patch_count;
} parts;

static void free_parts(batten_context *ctx, parts *p) {
  for (size_t i = 0; p->control_points && i < p->patch_count; i++) batten_free(ctx, p->control_points[i]);
  batten_free(ctx, p->control_points);
  batten_free(ctx, p->patches);
  batten_free(ctx, p->vertices);
  batten_free(ctx, p->triangles);
  batten_free(ctx, p->creases);
}

/* [*rows][width] whole numbers below limit. */
static batten_status get_indices(bx_json *j, const json_t *root, const char *key, size_t width, size_t limit,
                                 size_t *rows, uint32_t **out) {
  double *values = NULL;
  size_t count = 0;
  batten_status st = bx_get_rows(j, root, key, width, &count, &values);
  if (st != BATTEN_OK) return st;
  uint32_t *indices = batten_alloc_array(j->ctx, count, width * sizeof *indices);
  if (!indices) st = BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < count * width; i++) {
    if (values[i] >= 0 && values[i] < (double)limit && !((double)(uint32_t)values[i] < values[i])) {
      indices[i] = (uint32_t)values[i];
      continue;
    }
    size_t mark = bx_enter(j, key);
    bx_enter_item(j, i / width);
    bx_enter_item(j, i % width);
    st = bx_json_fail(j, "%g, where the number of one of %zu vertices is expected", values[i], limit);
    bx_leave(j, mark);
  }
  batten_free(j->ctx, values);
  if (st == BATTEN_OK) {
    *rows = count;
    *out = indices;
  } else {
    batten_free(j->ctx, indices);
  }
  return st;
}

static batten_status get_patch(bx_json *j, const json_t *object, size_t faces, batten_network_patch *patch,
                               double **points) {
  int64_t degree = 0, face = 0, part = 0;
  size_t count = 0;
  batten_status st = bx_get_whole(j, object, "degree", 1, DEGREE_MAX, &degree);
  if (st == BATTEN_OK) st = bx_get_whole(j, object, "face", 0, faces ? (int64_t)faces - 1 : 0, &face);
  if (st == BATTEN_OK && json_object_get(object, "part")) st = bx_get_whole(j, object, "part", 0, 3, &part);
  if (st == BATTEN_OK) st = bx_get_rows(j, object, "control_points", 3, &count, points);
  if (st != BATTEN_OK) return st;
  size_t expected = (size_t)((degree + 1) * (degree + 2) / 2);
  if (count != expected) {
    size_t mark = bx_enter(j, "control_points");
    st = bx_json_fail(j, "%zu points, where degree %d has %zu", count, (int)degree, expected);
    bx_leave(j, mark);
  }
  *patch = (batten_network_patch){
      .degree = (unsigned)degree, .face = (uint32_t)face, .part = (unsigned)part, .control_points = *points};
  return st;
}

static batten_status get_patches(bx_json *j, const json_t *root, parts *p) {
  json_t *array;
  batten_status st = bx_get(j, root, "patches", &array);
  if (st != BATTEN_OK) return st;
  if (!json_is_array(array)) return bx_json_fail(j, "'patches' must be an array of objects");
  size_t count = json_array_size(array);
  p->patches = batten_alloc_array(j->ctx, count, sizeof *p->patches);
  p->control_points = batten_alloc_array(j->ctx, count, sizeof *p->control_points);
  if (!p->patches || !p->control_points) return BATTEN_E_NOMEM;
  for (; st == BATTEN_OK && p->patch_count < count; p->patch_count++) {
    size_t i = p->patch_count, mark = bx_enter(j, "patches");
    p->control_points[i] = NULL;
    bx_enter_item(j, i);
    st = get_patch(j, json_array_get(array, i), p->triangle_count, &p->patches[i], &p->control_points[i]);
    bx_leave(j, mark);
    if (st == BATTEN_OK && i % 1024 == 0) st = batten_progress(j->ctx, "read", (double)i / (double)count);
  }
  return st;
}

batten_status bx_read_network_from(bx_reader *r, batten_network **out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL;
  parts p = {0};
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "network");
  snprintf(j.place, sizeof j.place, "network");
  if (st == BATTEN_OK) st = bx_get_rows(&j, root, "vertices", 3, &p.vertex_count, &p.vertices);
  if (st == BATTEN_OK) st = get_indices(&j, root, "triangles", 3, p.vertex_count, &p.triangle_count, &p.triangles);
  if (st == BATTEN_OK && json_object_get(root, "creases"))
    st = get_indices(&j, root, "creases", 2, p.vertex_count, &p.crease_count, &p.creases);
  if (st == BATTEN_OK) st = get_patches(&j, root, &p);
  json_decref(root);
  if (st == BATTEN_OK) {
    st = batten_network_create(r->ctx, p.vertex_count, p.vertices, p.triangle_count, p.triangles, p.patch_count,
                               p.patches, p.crease_count, p.creases, out);
    if (st == BATTEN_E_INVALID) st = bx_json_fail(&j, "%s", batten_error(r->ctx));
  }
  free_parts(r->ctx, &p);
  return st;
}

batten_status batten_read_network(batten_context *ctx, const char *path, batten_network **out) {
  bx_reader r;
  batten_status st = bx_open_document(&r, ctx, path, out, "networks");
  if (st != BATTEN_OK) return st;
  st = bx_read_network_from(&r, out);
  bx_close(&r);
  return st;
}
