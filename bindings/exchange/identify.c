/* What a file holds, from its extension and as much of its content as that takes: the start of a document, the header
 * of PLY and OFF, an OBJ up to its first face. */
#include "format.h"
#include "ply.h"

#include <string.h>

static bool is_space(unsigned char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/* bytes[*at ..] is blanks and then the character? Moves behind it. */
static bool take(const unsigned char *bytes, size_t count, size_t *at, char c) {
  while (*at < count && is_space(bytes[*at])) ++*at;
  if (*at >= count || bytes[*at] != (unsigned char)c) return false;
  ++*at;
  return true;
}

static bool take_text(const unsigned char *bytes, size_t count, size_t *at, const char *text) {
  size_t length = strlen(text), to = *at;
  if (!take(bytes, count, &to, '"') || count - to < length + 1 || memcmp(bytes + to, text, length) ||
      bytes[to + length] != '"')
    return false;
  *at = to + length + 1;
  return true;
}

/* { "batten" : "KIND" */
static batten_file_kind kind_of_document(const unsigned char *bytes, size_t count) {
  size_t at = 0;
  if (count >= 3 && !memcmp(bytes, "\xef\xbb\xbf", 3)) at = 3;
  if (!take(bytes, count, &at, '{') || !take_text(bytes, count, &at, "batten") || !take(bytes, count, &at, ':'))
    return BATTEN_FILE_UNKNOWN;
  if (take_text(bytes, count, &at, "solid")) return BATTEN_FILE_SOLID;
  if (take_text(bytes, count, &at, "carrier")) return BATTEN_FILE_CARRIER;
  if (take_text(bytes, count, &at, "qp")) return BATTEN_FILE_QP;
  if (take_text(bytes, count, &at, "network")) return BATTEN_FILE_NETWORK;
  if (take_text(bytes, count, &at, "surface")) return BATTEN_FILE_SURFACE;
  if (take_text(bytes, count, &at, "curve") || take_text(bytes, count, &at, "contours")) return BATTEN_FILE_CURVES;
  if (take_text(bytes, count, &at, "sections")) return BATTEN_FILE_SECTIONS;
  if (take_text(bytes, count, &at, "frep")) return BATTEN_FILE_FREP;
  return BATTEN_FILE_DOCUMENT;
}

static batten_status identify_ply(bx_reader *r, batten_file_kind *out) {
  ply_header header;
  batten_status st = ply_read_header(r, &header);
  *out = BATTEN_FILE_POINTS;
  for (size_t i = 0; st == BATTEN_OK && i < header.element_count; i++)
    if (!strcmp(header.elements[i].name, "face") && header.elements[i].count > 0) *out = BATTEN_FILE_MESH;
  ply_free_header(r, &header);
  return st;
}

static batten_status identify_obj(bx_reader *r, batten_file_kind *out) {
  bool end = false;
  *out = BATTEN_FILE_POINTS;
  batten_status st = BATTEN_OK;
  while (st == BATTEN_OK && !end && *out == BATTEN_FILE_POINTS) {
    st = bx_next_line(r, &end);
    if (st != BATTEN_OK || end) break;
    const char *at = r->text, *word;
    size_t length = bx_next_word(&at, &word);
    if (bx_word_is(word, length, "f")) *out = BATTEN_FILE_MESH;
  }
  return st;
}

static batten_status identify_off(bx_reader *r, batten_file_kind *out) {
  int64_t vertices, faces = 0;
  batten_status st = bx_read_off_counts(r, &vertices, &faces);
  *out = faces > 0 ? BATTEN_FILE_MESH : BATTEN_FILE_POINTS;
  return st;
}

static batten_status identify(bx_reader *r, bx_format format, batten_file_kind *out) {
  enum { LOOKED_AT = 4096 };
  const unsigned char *bytes;
  size_t got;
  batten_status st = bx_peek(r, LOOKED_AT, &bytes, &got);
  if (st != BATTEN_OK) return st;
  if (format == BX_UNKNOWN && got >= 4 && !memcmp(bytes, "ply", 3) && is_space(bytes[3])) format = BX_PLY;
  if (format == BX_UNKNOWN && got >= 4 && !memcmp(bytes, "OFF", 3) && is_space(bytes[3])) format = BX_OFF;
  switch (format) {
    case BX_TEXT:
      *out = BATTEN_FILE_POINTS;
      return BATTEN_OK;
    case BX_STL:
      *out = BATTEN_FILE_MESH;
      return BATTEN_OK;
    case BX_QPS:
    case BX_MAT:
      *out = BATTEN_FILE_QP;
      return BATTEN_OK;
    case BX_PLY:
      return identify_ply(r, out);
    case BX_OBJ:
      return identify_obj(r, out);
    case BX_OFF:
      return identify_off(r, out);
    default:
      *out = kind_of_document(bytes, got);
      return BATTEN_OK;
  }
}

batten_status batten_file_identify(batten_context *ctx, const char *path, batten_file_kind *out) {
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  bx_reader r;
  if (st == BATTEN_OK) st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  bool gz;
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  st = identify(&r, bx_format_of(path, &gz), &kind);
  bx_close(&r);
  if (st == BATTEN_OK) *out = kind;
  return st;
}
