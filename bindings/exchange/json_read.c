/* Checked reading of JSON values: see json_read.h. */
#include "json_read.h"

#include "format.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

batten_status bx_open_document(bx_reader *r, batten_context *ctx, const char *path, const void *out,
                               const char *what) {
  bool gz;
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st == BATTEN_OK && bx_format_of(path, &gz) != BX_JSON)
    st = batten_fail(ctx, BATTEN_E_INVALID, "%s: %s are read from .json .json.gz; convert the file",
                     bx_short_path(path), what);
  return st == BATTEN_OK ? bx_open(r, ctx, path) : st;
}

typedef struct source {
  bx_reader *r;
  batten_status status;
} source;

static size_t feed(void *buffer, size_t size, void *user) {
  enum { AT_ONCE = 1 << 14 };
  source *s = user;
  const unsigned char *bytes;
  size_t got = 0;
  s->status = s->r->offset == 0 ? bx_skip_mark(s->r) : BATTEN_OK;
  if (s->status == BATTEN_OK) s->status = bx_peek(s->r, size < AT_ONCE ? size : AT_ONCE, &bytes, &got);
  if (s->status == BATTEN_OK) s->status = bx_read_bytes(s->r, buffer, got, "text");
  return s->status == BATTEN_OK ? got : (size_t)-1;
}

batten_status bx_json_parse(bx_reader *r, json_t **out) {
  source s = {.r = r};
  json_error_t error = {0};
  json_t *root = json_load_callback(feed, &s, JSON_DECODE_INT_AS_REAL | JSON_REJECT_DUPLICATES, &error);
  if (root && s.status == BATTEN_OK) {
    *out = root;
    return BATTEN_OK;
  }
  json_decref(root);
  if (s.status != BATTEN_OK) return s.status;
  if (json_error_code(&error) == json_error_out_of_memory)
    return batten_fail(r->ctx, BATTEN_E_NOMEM, "%s: out of memory while parsing JSON", bx_short_path(r->path));
  char text[sizeof error.text];
  snprintf(text, sizeof text, "%s", error.text);
  for (char *c = text; *c; c++)
    if (*c < ' ' || *c >= 0x7f) *c = '?';
  return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s:%d: JSON: %s", bx_short_path(r->path), error.line, text);
}

size_t bx_enter(bx_json *j, const char *key) {
  size_t mark = strlen(j->place);
  snprintf(j->place + mark, sizeof j->place - mark, "%s%s", mark ? "." : "", key);
  return mark;
}

size_t bx_enter_item(bx_json *j, size_t index) {
  size_t mark = strlen(j->place);
  snprintf(j->place + mark, sizeof j->place - mark, "[%zu]", index);
  return mark;
}

void bx_leave(bx_json *j, size_t mark) { j->place[mark] = '\0'; }

batten_status bx_json_fail(bx_json *j, const char *format, ...) {
  char detail[256];
  va_list args;
  va_start(args, format);
  vsnprintf(detail, sizeof detail, format, args);
  va_end(args);
  return batten_fail(j->ctx, BATTEN_E_FORMAT, "%s: %s: %s", bx_short_path(j->path), j->place, detail);
}

static const char *type_name(const json_t *value) {
  switch (json_typeof(value)) {
    case JSON_OBJECT:
      return "an object";
    case JSON_ARRAY:
      return "an array";
    case JSON_STRING:
      return "a text";
    case JSON_INTEGER:
    case JSON_REAL:
      return "a number";
    case JSON_TRUE:
    case JSON_FALSE:
      return "true or false";
    case JSON_NULL:
      break;
  }
  return "null";
}

/* Numbers of JSON are finite: jansson refuses those that are too large. */
static batten_status number(bx_json *j, const json_t *value, double *out) {
  if (!json_is_number(value)) return bx_json_fail(j, "%s, where a number is expected", type_name(value));
  *out = json_number_value(value);
  return BATTEN_OK;
}

static batten_status array(bx_json *j, const json_t *value, size_t count, const char *of) {
  if (!json_is_array(value)) return bx_json_fail(j, "%s, where an array is expected", type_name(value));
  if (count != SIZE_MAX && json_array_size(value) != count)
    return bx_json_fail(j, "%zu %s, where %zu are expected", json_array_size(value), of, count);
  return BATTEN_OK;
}

static batten_status numbers(bx_json *j, const json_t *value, size_t count, double *out) {
  batten_status st = array(j, value, count, "numbers");
  for (size_t i = 0; st == BATTEN_OK && i < count; i++) {
    const json_t *item = json_array_get(value, i);
    if (json_is_number(item)) {
      out[i] = json_number_value(item);
      continue;
    }
    size_t mark = bx_enter_item(j, i);
    st = number(j, item, &out[i]);
    bx_leave(j, mark);
  }
  return st;
}

batten_status bx_get(bx_json *j, const json_t *object, const char *key, json_t **out) {
  if (!json_is_object(object)) return bx_json_fail(j, "%s, where an object is expected", type_name(object));
  *out = json_object_get(object, key);
  return *out ? BATTEN_OK : bx_json_fail(j, "'%s' is missing", key);
}

batten_status bx_get_text(bx_json *j, const json_t *object, const char *key, const char **out) {
  json_t *value;
  batten_status st = bx_get(j, object, key, &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, key);
  if (json_is_string(value))
    *out = json_string_value(value);
  else
    st = bx_json_fail(j, "%s, where a text is expected", type_name(value));
  bx_leave(j, mark);
  return st;
}

batten_status bx_get_number(bx_json *j, const json_t *object, const char *key, double *out) {
  json_t *value;
  batten_status st = bx_get(j, object, key, &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, key);
  st = number(j, value, out);
  bx_leave(j, mark);
  return st;
}

batten_status bx_get_whole(bx_json *j, const json_t *object, const char *key, int64_t lower, int64_t upper,
                           int64_t *out) {
  double value = 0;
  batten_status st = bx_get_number(j, object, key, &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, key);
  if (value >= (double)lower && value <= (double)upper && !(value > floor(value)))
    *out = (int64_t)value;
  else
    st = bx_json_fail(j, "%g, where a whole number from %lld to %lld is expected", value, (long long)lower,
                      (long long)upper);
  bx_leave(j, mark);
  return st;
}

batten_status bx_get_flag(bx_json *j, const json_t *object, const char *key, bool *out) {
  const json_t *value = json_object_get(object, key);
  *out = json_is_true(value);
  if (!value || json_is_boolean(value)) return BATTEN_OK;
  size_t mark = bx_enter(j, key);
  batten_status st = bx_json_fail(j, "%s, where true or false is expected", type_name(value));
  bx_leave(j, mark);
  return st;
}

batten_status bx_get_numbers(bx_json *j, const json_t *object, const char *key, size_t count, double *out) {
  json_t *value;
  batten_status st = bx_get(j, object, key, &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, key);
  st = numbers(j, value, count, out);
  bx_leave(j, mark);
  return st;
}

batten_status bx_fill_rows(bx_json *j, const json_t *value, size_t rows, size_t width, double *out) {
  batten_status st = array(j, value, rows, "rows");
  for (size_t i = 0; st == BATTEN_OK && i < rows; i++) {
    size_t mark = bx_enter_item(j, i);
    st = numbers(j, json_array_get(value, i), width, out + i * width);
    bx_leave(j, mark);
  }
  return st;
}

batten_status bx_rows_of(bx_json *j, const json_t *value, size_t width, size_t *rows, double **out) {
  batten_status st = array(j, value, SIZE_MAX, "rows");
  if (st != BATTEN_OK) return st;
  size_t count = json_array_size(value);
  double *values = batten_alloc_array(j->ctx, count, (width ? width : 1) * sizeof *values);
  if (!values) return BATTEN_E_NOMEM;
  st = width ? bx_fill_rows(j, value, count, width, values) : numbers(j, value, count, values);
  if (st == BATTEN_OK) {
    *rows = count;
    *out = values;
  } else {
    batten_free(j->ctx, values);
  }
  return st;
}

batten_status bx_get_array(bx_json *j, const json_t *object, const char *key, size_t count, json_t **out) {
  batten_status st = bx_get(j, object, key, out);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, key);
  st = array(j, *out, count, "items");
  bx_leave(j, mark);
  return st;
}

batten_status bx_get_rows(bx_json *j, const json_t *object, const char *key, size_t width, size_t *rows,
                          double **out) {
  json_t *value;
  batten_status st = bx_get(j, object, key, &value);
  if (st != BATTEN_OK) return st;
  size_t mark = bx_enter(j, key);
  st = bx_rows_of(j, value, width, rows, out);
  bx_leave(j, mark);
  return st;
}

batten_status bx_check_members(bx_json *j, const json_t *object, const char *what, const char *const *known) {
  const char *key;
  json_t *value;
  json_object_foreach((json_t *)(uintptr_t)object, key, value) {
    size_t i = 0;
    while (known[i] && strcmp(known[i], key)) i++;
    if (known[i] || !strcmp(key, "node")) continue; /* that of a node's kind */
    char quote[BX_QUOTE_SIZE], list[128] = "";
    for (size_t k = 0, used = 0; known[k] && used < sizeof list; k++)
      used += (size_t)snprintf(list + used, sizeof list - used, "%s%s", k ? ", " : "", known[k]);
    return bx_json_fail(j, "'%s' is no argument of %s, which takes %s", bx_quote(key, strlen(key), quote), what,
                        *list ? list : "none");
  }
  return BATTEN_OK;
}

batten_status bx_check_head(bx_json *j, const json_t *root, const char *kind) {
  const char *given = "";
  int64_t version;
  char quote[BX_QUOTE_SIZE];
  snprintf(j->place, sizeof j->place, "document");
  batten_status st = bx_get_text(j, root, "batten", &given);
  if (st == BATTEN_OK && strcmp(given, kind))
    st = bx_json_fail(j, "it holds a batten '%s', not a %s", bx_quote(given, strlen(given), quote), kind);
  if (st == BATTEN_OK) st = bx_get_whole(j, root, "version", 1, 1, &version);
  return st;
}
