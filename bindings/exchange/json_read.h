/* Checked reading of JSON values. Every error names the file and the place in it: "a.json: solid.lower[2]: ..." */
#ifndef BATTEN_EXCHANGE_JSON_READ_H
#define BATTEN_EXCHANGE_JSON_READ_H

#include "stream.h"

#include <jansson.h>

typedef struct bx_json {
  batten_context *ctx;
  const char *path;
  char place[192]; /* of the value in hand */
  unsigned level;  /* of nodes in nodes: json_scene.c */
} bx_json;

/* Opens path, which must be .json, also .gz; what: "surfaces". INVALID for out = NULL and other extensions. */
batten_status bx_open_document(bx_reader *r, batten_context *ctx, const char *path, const void *out,
                               const char *what);

/* Parses the whole stream; *out is released by json_decref. Jansson's memory is not the context's: it has one
 * allocator for the whole process, which belongs to the host. */
batten_status bx_json_parse(bx_reader *r, json_t **out);

/* The place of a member or item, for as long as it is read: size_t mark = bx_enter(...); ... bx_leave(j, mark). */
size_t bx_enter(bx_json *j, const char *key);
size_t bx_enter_item(bx_json *j, size_t index);
void bx_leave(bx_json *j, size_t mark);

batten_status bx_json_fail(bx_json *j, const char *format, ...) BATTEN_PRINTF(2, 3);

/* The document's "batten": KIND, "version": 1. */
batten_status bx_check_head(bx_json *j, const json_t *root, const char *kind);

/* A member that must be there. */
batten_status bx_get(bx_json *j, const json_t *object, const char *key, json_t **out);
batten_status bx_get_text(bx_json *j, const json_t *object, const char *key, const char **out);
batten_status bx_get_number(bx_json *j, const json_t *object, const char *key, double *out);
batten_status bx_get_whole(bx_json *j, const json_t *object, const char *key, int64_t lower, int64_t upper,
                           int64_t *out);
/* Whether it is true; it need not be there. */
batten_status bx_get_flag(bx_json *j, const json_t *object, const char *key, bool *out);
/* [count] numbers into out. */
batten_status bx_get_numbers(bx_json *j, const json_t *object, const char *key, size_t count, double *out);
/* [*rows][width] numbers in memory of the context; width 0: plain numbers, [*rows]. */
batten_status bx_get_rows(bx_json *j, const json_t *object, const char *key, size_t width, size_t *rows,
                          double **out);
/* Members that no one reads would be errors of writing that no one sees. what: "a ball"; known: NULL-ended. */
batten_status bx_check_members(bx_json *j, const json_t *object, const char *what, const char *const *known);
/* An array of count items. */
batten_status bx_get_array(bx_json *j, const json_t *object, const char *key, size_t count, json_t **out);

/* The same as bx_get_rows, and [rows][width] numbers into out, of a value whose place is entered. */
batten_status bx_rows_of(bx_json *j, const json_t *value, size_t width, size_t *rows, double **out);
batten_status bx_fill_rows(bx_json *j, const json_t *value, size_t rows, size_t width, double *out);

#endif
