/* Lists of parameters: knots from text files, inflections from text or from edited proposals. */
#define _XOPEN_SOURCE 700 /* getline */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "curve.h"

/* ---- text ---------------------------------------------------------------------------------------- */

typedef struct numbers {
  size_t count, room;
  double *values;
} numbers;

static batten_status push(batten_context *ctx, numbers *n, double value) {
  if (n->count == n->room) {
    size_t room = n->room ? 2 * n->room : 64;
    double *grown = batten_realloc_array(ctx, n->values, room, sizeof *grown);
    if (!grown) return BATTEN_E_NOMEM;
    n->values = grown;
    n->room = room;
  }
  n->values[n->count++] = value;
  return BATTEN_OK;
}

static batten_status take_line(batten_context *ctx, const char *path, size_t line_number, char *line, numbers *n) {
  static const char blanks[] = " \t\r\n,;";
  line[strcspn(line, "#%")] = '\0';
  for (char *word = strtok(line, blanks); word; word = strtok(NULL, blanks)) {
    char *end;
    double value = strtod(word, &end); /* the program stays in the C locale */
    if (*end || !isfinite(value))
      return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%zu: '%.40s' is not a number", path, line_number, word);
    if (n->count && !(value > n->values[n->count - 1]))
      return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%zu: %s is not above the number before it; sort them", path,
                         line_number, word);
    if (push(ctx, n, value) < 0) return BATTEN_E_NOMEM;
  }
  return BATTEN_OK;
}

batten_status curve_read_numbers(batten_context *ctx, const char *path, size_t *count, double **out) {
  numbers n = {0};
  char *line = NULL;
  size_t size = 0;
  batten_status st = BATTEN_OK;
  FILE *file = fopen(path, "r");
  if (!file) return batten_fail(ctx, BATTEN_E_IO, "%s: cannot be read: %s", path, strerror(errno));
  for (size_t number = 1; st >= 0 && getline(&line, &size, file) >= 0; number++)
    st = take_line(ctx, path, number, line, &n);
  if (st >= 0 && ferror(file)) st = batten_fail(ctx, BATTEN_E_IO, "%s: cannot be read: %s", path, strerror(errno));
  free(line);
  fclose(file);
  if (st >= 0) {
    *count = n.count;
    *out = n.values;
  } else {
    batten_free(ctx, n.values);
  }
  return st;
}

/* ---- proposals ----------------------------------------------------------------------------------- */

static batten_status take_wish(batten_context *ctx, const char *path, size_t index, const json_t *object,
                               curve_wish *out) {
  const json_t *list = json_object_get(object, "inflections"), *sign = json_object_get(object, "sign");
  if (!json_is_array(list))
    return batten_fail(ctx, BATTEN_E_FORMAT, "%s: contours[%zu].inflections: missing; give a list of parameters",
                       path, index);
  if (sign && !json_is_integer(sign))
    return batten_fail(ctx, BATTEN_E_FORMAT, "%s: contours[%zu].sign: give 1, -1, or 0 for as the data have it", path,
                       index);
  out->sign = sign ? (int)json_integer_value(sign) : 0;
  out->inflections = batten_alloc_array(ctx, json_array_size(list), sizeof *out->inflections);
  if (!out->inflections) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < json_array_size(list); i++) {
    const json_t *v = json_array_get(list, i);
    if (!json_is_number(v))
      return batten_fail(ctx, BATTEN_E_FORMAT, "%s: contours[%zu].inflections[%zu]: is no number", path, index, i);
    out->inflections[out->count++] = json_number_value(v);
  }
  return BATTEN_OK;
}

void curve_wishes_free(batten_context *ctx, curve_wishes *wishes) {
  for (size_t i = 0; i < wishes->count; i++) batten_free(ctx, wishes->items[i].inflections);
  batten_free(ctx, wishes->items);
  *wishes = (curve_wishes){0};
}

static batten_status read_proposals(batten_context *ctx, const char *path, curve_wishes *out) {
  json_error_t error;
  json_t *root = json_load_file(path, 0, &error);
  if (!root) return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%d: %s", path, error.line, error.text);
  const json_t *list = json_object_get(root, "contours");
  const char *kind = json_string_value(json_object_get(root, "batten"));
  batten_status st = BATTEN_OK;
  if (!kind || strcmp(kind, "inflections") != 0 || !json_is_array(list))
    st = batten_fail(ctx, BATTEN_E_FORMAT, "%s: is no document \"inflections\" with a list \"contours\"", path);
  if (st >= 0) {
    out->items = batten_alloc_array(ctx, json_array_size(list), sizeof *out->items);
    st = out->items ? BATTEN_OK : BATTEN_E_NOMEM;
  }
  for (size_t i = 0; st >= 0 && i < json_array_size(list); i++) {
    out->items[i] = (curve_wish){0};
    out->count++;
    st = take_wish(ctx, path, i, json_array_get(list, i), &out->items[i]);
  }
  json_decref(root);
  return st;
}

batten_status curve_read_wishes(batten_context *ctx, const char *path, curve_wishes *out) {
  size_t length = strlen(path);
  curve_wishes w = {0};
  batten_status st;
  if (length > 5 && strcasecmp(path + length - 5, ".json") == 0) {
    st = read_proposals(ctx, path, &w);
  } else { /* one list for all */
    w.items = batten_alloc(ctx, sizeof *w.items);
    if (!w.items) return BATTEN_E_NOMEM;
    w.items[0] = (curve_wish){0};
    w.count = 1;
    st = curve_read_numbers(ctx, path, &w.items[0].count, &w.items[0].inflections);
  }
  if (st >= 0)
    *out = w;
  else
    curve_wishes_free(ctx, &w);
  return st;
}

/* ---- writing ------------------------------------------------------------------------------------- */

static json_t *numbers_json(size_t count, const double *values) {
  json_t *list = json_array();
  for (size_t i = 0; list && i < count; i++)
    if (json_array_append_new(list, json_real(values[i])) != 0) {
      json_decref(list);
      return NULL;
    }
  return list;
}

static json_t *proposal_json(const curve_item *item) {
  const batten_contour_proposal *p = &item->proposal;
  json_t *runs = json_array();
  for (size_t i = 0; runs && i < p->run_count; i++) {
    const batten_contour_run *r = &p->runs[i];
    json_array_append_new(
        runs, json_pack("{s:f, s:f, s:i, s:f, s:f, s:b}", "from", r->from, "to", r->to, "sign", r->sign, "turn",
                        r->turn, "significance", r->significance, "kept", r->kept));
  }
  return json_pack("{s:I, s:o, s:i, s:o, s:f, s:o}", "contour", (json_int_t)item->number, "inflections",
                   numbers_json(p->inflection_count, p->inflections), "sign", p->sign, "uncertainties",
                   numbers_json(p->inflection_count, p->uncertainties), "noise", p->noise, "runs", runs);
}

bool curve_write_proposals(const curve_work *w, const char *path, const char *shown) {
  json_t *list = json_array();
  for (size_t i = 0; list && i < w->count; i++) json_array_append_new(list, proposal_json(&w->items[i]));
  json_t *root = json_pack("{s:s, s:i, s:o}", "batten", "inflections", "version", 1, "contours", list);
  bool whole = root && json_array_size(list) == w->count;
  if (!whole) {
    cli_error("out of memory");
  } else if (json_dump_file(root, path, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) != 0) {
    cli_error("%s: cannot be written: %s", shown, strerror(errno));
    whole = false;
  }
  json_decref(root);
  return whole;
}
