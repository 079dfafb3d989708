/* The header of a PLY file: format, elements, properties. See ply.h. */
#include "ply.h"

#include <string.h>

enum { ELEMENTS_MAX = 1000, PROPERTIES_MAX = 10000 }; /* a header is not where the data are */

void ply_free_header(bx_reader *r, ply_header *h) {
  batten_free(r->ctx, h->elements);
  batten_free(r->ctx, h->properties);
  *h = (ply_header){0};
}

static batten_status copy_name(bx_reader *r, const char *word, size_t length, char to[BX_NAME_SIZE]) {
  char quote[BX_QUOTE_SIZE];
  if (length == 0) return bx_fail_line(r, "a name is missing");
  if (length >= BX_NAME_SIZE)
    return bx_fail_line(r, "the name '%s' has more than %d characters", bx_quote(word, length, quote),
                        BX_NAME_SIZE - 1);
  memcpy(to, word, length);
  to[length] = '\0';
  return BATTEN_OK;
}

static batten_status read_type(bx_reader *r, const char **at, ply_type *out) {
  static const struct {
    const char *name;
    ply_type type;
  } types[] = {{"char", PLY_INT8},     {"int8", PLY_INT8},       {"uchar", PLY_UINT8},    {"uint8", PLY_UINT8},
               {"short", PLY_INT16},   {"int16", PLY_INT16},     {"ushort", PLY_UINT16},  {"uint16", PLY_UINT16},
               {"int", PLY_INT32},     {"int32", PLY_INT32},     {"uint", PLY_UINT32},    {"uint32", PLY_UINT32},
               {"float", PLY_FLOAT32}, {"float32", PLY_FLOAT32}, {"double", PLY_FLOAT64}, {"float64", PLY_FLOAT64}};
  const char *word;
  size_t length = bx_next_word(at, &word);
  for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
    if (bx_word_is(word, length, types[i].name)) {
      *out = types[i].type;
      return BATTEN_OK;
    }
  char quote[BX_QUOTE_SIZE];
  return bx_fail_line(r, "'%s' is not a type of PLY (char, uchar, short, ushort, int, uint, float, double)",
                      bx_quote(word, length, quote));
}

static batten_status read_format(bx_reader *r, const char *at, ply_header *h) {
  const char *word, *version;
  size_t length = bx_next_word(&at, &word), version_length = bx_next_word(&at, &version);
  char quote[BX_QUOTE_SIZE];
  if (bx_word_is(word, length, "ascii"))
    h->encoding = PLY_TEXT;
  else if (bx_word_is(word, length, "binary_little_endian"))
    h->encoding = PLY_LITTLE_ENDIAN;
  else if (bx_word_is(word, length, "binary_big_endian"))
    h->encoding = PLY_BIG_ENDIAN;
  else
    return bx_fail_line(r, "format '%s' is not ascii, binary_little_endian or binary_big_endian",
                        bx_quote(word, length, quote));
  if (!bx_word_is(version, version_length, "1.0"))
    return bx_fail_line(r, "version '%s' of PLY; 1.0 is read", bx_quote(version, version_length, quote));
  return BATTEN_OK;
}

static batten_status read_element(bx_reader *r, const char *at, ply_header *h) {
  ply_element e = {.first_property = h->property_count};
  const char *word;
  size_t length = bx_next_word(&at, &word);
  batten_status st = copy_name(r, word, length, e.name);
  if (st == BATTEN_OK) st = bx_next_integer(r, &at, "the number of elements", &e.count);
  if (st != BATTEN_OK) return st;
  if (e.count < 0) return bx_fail_line(r, "%lld elements", (long long)e.count);
  if (h->element_count == ELEMENTS_MAX) return bx_fail_line(r, "more than %d elements", ELEMENTS_MAX);
  for (size_t i = 0; i < h->element_count; i++)
    if (!strcmp(h->elements[i].name, e.name)) return bx_fail_line(r, "a second element '%.32s'", e.name);
  void *grown = h->elements;
  st = bx_grow(r->ctx, &grown, &h->element_capacity, h->element_count + 1, sizeof e);
  h->elements = grown;
  if (st == BATTEN_OK) h->elements[h->element_count++] = e;
  return st;
}

/* x, y, z, nx, ny, nz and other single numbers of a vertex; the corners of a face. */
static ply_role role_of(const ply_element *e, const ply_property *p) {
  static const char *const names[] = {"x", "y", "z", "nx", "ny", "nz"};
  if (!strcmp(e->name, "vertex") && !p->count_type) {
    for (int i = 0; i < 6; i++)
      if (!strcmp(p->name, names[i])) return (ply_role)(PLY_X + i);
    return PLY_FIELD;
  }
  bool corners = !strcmp(p->name, "vertex_indices") || !strcmp(p->name, "vertex_index");
  return !strcmp(e->name, "face") && p->count_type && corners ? PLY_CORNERS : PLY_SKIPPED;
}

static batten_status read_property(bx_reader *r, const char *at, ply_header *h) {
  if (h->element_count == 0) return bx_fail_line(r, "a property before the first element");
  ply_element *e = &h->elements[h->element_count - 1];
  ply_property p = {0};
  const char *word, *list = at;
  size_t length = bx_next_word(&list, &word);
  batten_status st = BATTEN_OK;
  if (bx_word_is(word, length, "list")) {
    at = list;
    st = read_type(r, &at, &p.count_type);
    if (st == BATTEN_OK && p.count_type >= PLY_FLOAT32)
      st = bx_fail_line(r, "the length of a list as a floating-point number");
  }
  if (st == BATTEN_OK) st = read_type(r, &at, &p.type);
  if (st != BATTEN_OK) return st;
  length = bx_next_word(&at, &word);
  st = copy_name(r, word, length, p.name);
  if (st != BATTEN_OK) return st;
  for (size_t i = e->first_property; i < h->property_count; i++)
    if (!strcmp(h->properties[i].name, p.name))
      return bx_fail_line(r, "a second property '%.32s' of element '%.32s'", p.name, e->name);
  p.role = role_of(e, &p);
  if (p.role == PLY_CORNERS && p.type >= PLY_FLOAT32)
    return bx_fail_line(r, "corners of faces as floating-point numbers");
  if (h->property_count == PROPERTIES_MAX) return bx_fail_line(r, "more than %d properties", PROPERTIES_MAX);
  void *grown = h->properties;
  st = bx_grow(r->ctx, &grown, &h->property_capacity, h->property_count + 1, sizeof p);
  h->properties = grown;
  if (st != BATTEN_OK) return st;
  h->properties[h->property_count++] = p;
  e->property_count++;
  return BATTEN_OK;
}

batten_status ply_read_header(bx_reader *r, ply_header *h) {
  *h = (ply_header){0};
  bool end, has_format = false;
  batten_status st = bx_next_line(r, &end);
  if (st == BATTEN_OK && strcmp(r->text, "ply")) st = bx_fail_line(r, "a PLY file begins with the line 'ply'");
  while (st == BATTEN_OK) {
    st = bx_next_line(r, &end);
    if (st != BATTEN_OK) return st;
    if (end) return bx_fail_line(r, "the file ends here; end_header is missing");
    const char *at = r->text, *word;
    size_t length = bx_next_word(&at, &word);
    char quote[BX_QUOTE_SIZE];
    if (bx_word_is(word, length, "end_header")) {
      return has_format ? BATTEN_OK : bx_fail_line(r, "the line 'format ... 1.0' is missing");
    } else if (bx_word_is(word, length, "format")) {
      st = read_format(r, at, h);
      has_format = true;
    } else if (bx_word_is(word, length, "element")) {
      st = read_element(r, at, h);
    } else if (bx_word_is(word, length, "property")) {
      st = read_property(r, at, h);
    } else if (length && !bx_word_is(word, length, "comment") && !bx_word_is(word, length, "obj_info")) {
      st = bx_fail_line(r, "'%s' is not a word of a PLY header", bx_quote(word, length, quote));
    }
  }
  return st;
}
