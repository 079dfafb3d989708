/* Sections as JSON documents: written and read.
 *
 * {"batten": "sections", "version": 1,
 *  "sections": [{"origin": [x, y, z], "rotation": [[...], [...], [...]], "contours": [[[x, y], ...], ...]}, ...]}
 *
 * What the numbers mean, whether rotations are some and contours cross, is for batten_stack_build to judge. */
#include "format.h"
#include "json_solid.h"
#include "sections.h"
#include "write.h"

#include "base/checked.h"

#include <string.h>

/* ---- reading ----------------------------------------------------------------------------------------- */

static batten_status get_rotation(bx_json *j, const json_t *object, double rotation[3][3]) {
  static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  json_t *rows;
  memcpy(rotation, unit, sizeof unit);
  if (!json_object_get(object, "rotation")) return BATTEN_OK;
  batten_status st = bx_get_array(j, object, "rotation", 3, &rows);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, "rotation");
  st = bx_fill_rows(j, rows, 3, 3, rotation[0]);
  bx_leave(j, mark);
  return st;
}

static batten_status count_points(bx_json *j, const json_t *contours, size_t *points) {
  batten_status st = BATTEN_OK;
  if (!json_is_array(contours)) return bx_json_fail(j, "'contours' must be an array of contours");
  *points = 0;
  for (size_t i = 0; st == BATTEN_OK && i < json_array_size(contours); i++) {
    const json_t *contour = json_array_get(contours, i);
    size_t mark = bx_enter(j, "contours");
    bx_enter_item(j, i);
    if (json_array_size(contour) == 0) st = bx_json_fail(j, "it must be an array of points [x, y], one or more");
    *points += json_array_size(contour);
    bx_leave(j, mark);
  }
  return st;
}

batten_status bx_get_section(bx_json *j, const json_t *object, batten_section *out) {
  json_t *contours = NULL;
  size_t points = 0;
  batten_status st = bx_get_numbers(j, object, "origin", 3, out->origin);
  if (st == BATTEN_OK) st = get_rotation(j, object, out->rotation);
  if (st == BATTEN_OK) st = bx_get(j, object, "contours", &contours);
  if (st == BATTEN_OK) st = count_points(j, contours, &points);
  if (st == BATTEN_OK) st = bx_section_make(j->ctx, json_array_size(contours), points, out);
  if (st != BATTEN_OK) return st;
  size_t *starts = bx_section_starts(out), used = 0;
  for (size_t i = 0; st == BATTEN_OK && i < out->contour_count; i++) {
    const json_t *contour = json_array_get(contours, i);
    size_t mark = bx_enter(j, "contours"), count = json_array_size(contour);
    bx_enter_item(j, i);
    starts[i] = used;
    st = bx_fill_rows(j, contour, count, 2, bx_section_points(out) + 2 * used);
    used += count;
    bx_leave(j, mark);
  }
  starts[out->contour_count] = used;
  return st;
}

static batten_status get_sections(bx_json *j, const json_t *root, batten_section_set *out) {
  static const char *const known[] = {"origin", "rotation", "contours", NULL};
  json_t *array;
  batten_status st = bx_get(j, root, "sections", &array);
  if (st != BATTEN_OK) return st;
  size_t count = json_array_size(array); /* 0 for what is no array */
  if (count == 0) return bx_json_fail(j, "'sections' must be an array of one or more");
  out->sections = batten_alloc_array(j->ctx, count, sizeof *out->sections);
  if (!out->sections) return BATTEN_E_NOMEM;
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) {
    size_t mark = bx_enter(j, "sections");
    bx_enter_item(j, i);
    out->sections[i] = (batten_section){.contour_count = 0};
    out->count++;
    st = bx_check_members(j, json_array_get(array, i), "a section", known);
    if (st == BATTEN_OK) st = bx_get_section(j, json_array_get(array, i), &out->sections[i]);
    bx_leave(j, mark);
    if (st == BATTEN_OK && i % 64 == 0) st = batten_progress(j->ctx, "read", (double)i / (double)count);
  }
  return st;
}

batten_status bx_read_json_sections(bx_reader *r, batten_section_set *out) {
  bx_json j = {.ctx = r->ctx, .path = r->path};
  json_t *root = NULL;
  batten_section_set set = {0};
  batten_status st = bx_json_parse(r, &root);
  if (st == BATTEN_OK) st = bx_check_head(&j, root, "sections");
  if (st == BATTEN_OK) st = get_sections(&j, root, &set);
  json_decref(root);
  if (st == BATTEN_OK)
    *out = set;
  else
    batten_section_set_free(r->ctx, &set);
  return st;
}

/* ---- writing ------------------------------------------------------------------------------------------- */

static batten_status check_section(batten_context *ctx, size_t i, const batten_section *s) {
  if (!s->starts || (!s->points && s->starts[s->contour_count]))
    return batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu].%s: NULL", i, s->starts ? "points" : "starts");
  for (size_t k = 0; k < s->contour_count; k++)
    if (s->starts[k] >= s->starts[k + 1] || s->starts[0])
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "sections[%zu].starts[%zu]: %zu; they begin with 0 and ascend, contours have points", i,
                         s->starts[0] ? (size_t)0 : k + 1, s->starts[s->starts[0] ? 0 : k + 1]);
  size_t numbers = 2 * s->starts[s->contour_count], bad = batten_first_nonfinite(numbers, s->points);
  if (bad < numbers) return batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu].points[%zu]: not finite", i, bad / 2);
  bool frame = batten_first_nonfinite(3, s->origin) == 3 && batten_first_nonfinite(9, s->rotation[0]) == 9;
  return frame ? BATTEN_OK : batten_fail(ctx, BATTEN_E_INVALID, "sections[%zu]: its frame is not finite", i);
}

void bx_put_section_members(bx_writer *w, const batten_section *s) {
  bx_put_text(w, "\"origin\": ");
  bx_put_json_numbers(w, s->origin, 3);
  bx_put_text(w, ", \"rotation\": ");
  bx_put_json_rows(w, s->rotation[0], 3, 3, ", ");
  bx_put_text(w, ",\n\"contours\": [");
  for (size_t i = 0; i < s->contour_count; i++) {
    bx_put_text(w, i ? ",\n" : "");
    bx_put_json_rows(w, s->points + 2 * s->starts[i], s->starts[i + 1] - s->starts[i], 2, ",\n");
  }
  bx_put_text(w, "]");
}

batten_status batten_write_sections(batten_context *ctx, size_t count, const batten_section *sections,
                                    const char *path) {
  bx_writer w;
  batten_status st = bx_check_pointers(ctx, path, sections, "sections");
  if (st == BATTEN_OK && bx_format_of(path, NULL) != BX_JSON)
    st =
        batten_fail(ctx, BATTEN_E_INVALID, "%s: sections are written as .json; rename the file", bx_short_path(path));
  if (st == BATTEN_OK && count == 0) st = batten_fail(ctx, BATTEN_E_INVALID, "count: 0; give one section or more");
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) st = check_section(ctx, i, &sections[i]);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  bx_put_text(&w, "{\"batten\": \"sections\", \"version\": 1,\n\"sections\": [\n");
  for (size_t i = 0; i < count && bx_goes_on(&w, i, count); i++) {
    bx_put_text(&w, i ? ",\n{" : "{");
    bx_put_section_members(&w, &sections[i]);
    bx_put_u8(&w, '}');
  }
  bx_put_text(&w, "]}\n");
  return bx_commit(&w);
}
