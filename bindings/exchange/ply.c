/* PLY (Turk 1994) in its three encodings. Elements and properties in any order and number; those that batten does not
 * know are passed over, and further numbers of the vertices become fields.
 *
 * Element and list lengths are only believed as the data come: an element without properties has none. */
#include "ply.h"

#include "base/checked.h"
#include "number.h"

#include <string.h>

enum { PLY_NUMBERS = PLY_W - PLY_X + 1 }; /* of a vertex that have a meaning */

typedef struct ply {
  bx_reader *r;
  bx_soup *soup;
  ply_header header;
  const char *at;   /* in the current line of a text file */
  double *fields;   /* [soup->field_count] of the current vertex */
  int64_t vertices; /* declared: what corners may refer to */
} ply;

static size_t size_of(ply_type type) {
  static const unsigned char sizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[type];
}

/* An integer or floating-point value out of its bytes, in one of the two orders. */
static double decode(ply_type type, bool big, const unsigned char *bytes) {
  uint64_t bits = 0;
  size_t size = size_of(type);
  for (size_t i = 0; i < size; i++) bits |= (uint64_t)bytes[big ? size - 1 - i : i] << (8 * i);
  uint32_t bits32 = (uint32_t)bits;
  float single;
  double value;
  switch (type) {
    case PLY_INT8:
      return (double)(bits & 0x7f) - (double)(bits & 0x80);
    case PLY_INT16:
      return (double)(bits & 0x7fff) - (double)(bits & 0x8000);
    case PLY_INT32:
      return (double)(bits & 0x7fffffff) - (double)(bits & 0x80000000u);
    case PLY_FLOAT32:
      memcpy(&single, &bits32, sizeof single);
      return (double)single;
    case PLY_FLOAT64:
      memcpy(&value, &bits, sizeof value);
      return value;
    default:
      return (double)bits;
  }
}

/* The next number of the element: in text a word of its line, in binary the next bytes. Whole numbers are exact. */
static batten_status next_value(ply *p, const ply_property *property, ply_type type, double *out) {
  unsigned char bytes[8];
  if (p->header.encoding == PLY_TEXT) {
    if (type >= PLY_FLOAT32) {
      /* What is no coordinate may be nan. */
      if (property->role != PLY_SKIPPED && property->role != PLY_FIELD)
        return bx_next_number(p->r, &p->at, property->name, out);
      const char *word, *end, *rest = p->at;
      size_t length = bx_next_word(&rest, &word);
      if (length && bx_parse_number(word, &end, out) == BX_NUMBER_NOT_FINITE && end == word + length) {
        p->at = rest;
        *out = NAN;
        return BATTEN_OK;
      }
      return bx_next_number(p->r, &p->at, property->name, out);
    }
    int64_t whole = 0;
    batten_status st = bx_next_integer(p->r, &p->at, property->name, &whole);
    *out = (double)whole;
    return st;
  }
  batten_status st = bx_read_bytes(p->r, bytes, size_of(type), property->name);
  if (st == BATTEN_OK) *out = decode(type, p->header.encoding == PLY_BIG_ENDIAN, bytes);
  return st;
}

static batten_status fail_here(ply *p, int64_t index, const char *element, const char *name, const char *what,
                               double value) {
  if (p->header.encoding == PLY_TEXT) return bx_fail_line(p->r, "%s: %s (%g)", name, what, value);
  return bx_fail_byte(p->r, "%s of %s %lld: %s (%g)", name, element, (long long)index, what, value);
}

static batten_status begin_element(ply *p, const ply_element *e) {
  if (p->header.encoding != PLY_TEXT) return BATTEN_OK;
  bool end;
  batten_status st = bx_next_line(p->r, &end);
  while (st == BATTEN_OK && !end && *bx_skip_blanks(p->r->text) == '\0') st = bx_next_line(p->r, &end);
  if (st == BATTEN_OK && end)
    return bx_fail_line(p->r, "the file ends here; the header declares %lld of element '%.32s'", (long long)e->count,
                        e->name);
  p->at = p->r->text;
  return st;
}

static batten_status read_list(ply *p, const ply_property *property, int64_t index) {
  double length = 0, value = 0;
  batten_status st = next_value(p, property, property->count_type, &length);
  if (st != BATTEN_OK) return st;
  bool corners = property->role == PLY_CORNERS;
  if (length < 0 || length > UINT32_MAX)
    return fail_here(p, index, "element", property->name, "the length of a list is out of range", length);
  if (corners && length < 3)
    return fail_here(p, index, "face", property->name, "a face of fewer than 3 corners", length);
  bx_begin_polygon(p->soup);
  for (uint64_t i = 0; st == BATTEN_OK && i < (uint64_t)length; i++) {
    st = next_value(p, property, property->type, &value);
    if (st != BATTEN_OK || !corners) continue;
    if (!(value >= 0 && value < (double)p->vertices))
      return fail_here(p, index, "face", property->name, "no such vertex; they are counted from 0", value);
    st = bx_add_corner(p->soup, (uint32_t)value);
  }
  return st;
}

static batten_status read_row(ply *p, const ply_element *e, int64_t index, double x[PLY_NUMBERS]) {
  size_t field = 0;
  batten_status st = begin_element(p, e);
  for (size_t i = 0; st == BATTEN_OK && i < e->property_count; i++) {
    const ply_property *property = &p->header.properties[e->first_property + i];
    double value = 0;
    if (property->count_type) {
      st = read_list(p, property, index);
      continue;
    }
    st = next_value(p, property, property->type, &value);
    if (st != BATTEN_OK || property->role == PLY_SKIPPED) continue;
    if (property->role == PLY_FIELD) {
      if (p->fields) p->fields[field++] = value;
      continue;
    }
    if (!isfinite(value))
      return fail_here(p, index, "vertex", property->name, "not finite; remove the vertex", value);
    x[property->role - PLY_X] = value;
  }
  return st;
}

static bool has_role(const ply *p, const ply_element *e, ply_role role) {
  for (size_t i = 0; i < e->property_count; i++)
    if (p->header.properties[e->first_property + i].role == role) return true;
  return false;
}

static const ply_element *find_element(const ply *p, const char *name) {
  for (size_t i = 0; i < p->header.element_count; i++)
    if (!strcmp(p->header.elements[i].name, name)) return &p->header.elements[i];
  return NULL;
}

static ply_property *find_field(ply *p, const ply_element *e, const char *name) {
  for (size_t i = 0; i < e->property_count; i++) {
    ply_property *property = &p->header.properties[e->first_property + i];
    if (property->role == PLY_FIELD && !strcmp(property->name, name)) return property;
  }
  return NULL;
}

/* Parameters and weights of points are fields of these names; u or v alone means something else. */
static void find_point_roles(ply *p, const ply_element *vertex) {
  ply_property *u = find_field(p, vertex, "u"), *v = find_field(p, vertex, "v"), *w = find_field(p, vertex, "w");
  if (!w) w = find_field(p, vertex, "weight");
  if (w) w->role = PLY_W;
  if (!u || !v) return;
  u->role = PLY_U;
  v->role = PLY_V;
}

/* Checks what there must be, and makes room for the fields. */
static batten_status prepare(ply *p) {
  const ply_element *vertex = find_element(p, "vertex");
  if (!vertex) return bx_fail_line(p->r, "no element 'vertex'");
  if (!has_role(p, vertex, PLY_X) || !has_role(p, vertex, PLY_Y))
    return bx_fail_line(p->r, "the vertices have no properties x and y");
  p->soup->n = has_role(p, vertex, PLY_Z) ? 3 : 2;
  p->vertices = vertex->count;
  if (vertex->count > UINT32_MAX) return bx_fail_line(p->r, "%lld vertices; too many", (long long)vertex->count);
  if (!p->soup->want_triangles) find_point_roles(p, vertex);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && p->soup->want_triangles && i < vertex->property_count; i++) {
    const ply_property *property = &p->header.properties[vertex->first_property + i];
    if (property->role == PLY_FIELD) st = bx_add_field(p->soup, property->name, strlen(property->name));
  }
  if (st != BATTEN_OK || p->soup->field_count == 0) return st;
  p->fields = batten_alloc_array(p->r->ctx, p->soup->field_count, sizeof *p->fields);
  return p->fields ? BATTEN_OK : BATTEN_E_NOMEM;
}

static batten_status read_vertices(ply *p, const ply_element *e) {
  bool normals = has_role(p, e, PLY_NX) && has_role(p, e, PLY_NY) && (p->soup->n == 2 || has_role(p, e, PLY_NZ));
  bool parameters = has_role(p, e, PLY_U) && has_role(p, e, PLY_V), weights = has_role(p, e, PLY_W);
  batten_status st = BATTEN_OK;
  for (int64_t i = 0; st == BATTEN_OK && i < e->count; i++) {
    double x[PLY_NUMBERS] = {0};
    st = read_row(p, e, i, x);
    if (st == BATTEN_OK) st = bx_add_vertex(p->soup, x);
    if (st == BATTEN_OK && normals) st = bx_add_normal(p->soup, x + PLY_NX - PLY_X);
    if (st == BATTEN_OK && parameters) st = bx_add_parameters(p->soup, x + PLY_U - PLY_X);
    if (st == BATTEN_OK && weights) st = bx_add_weight(p->soup, x[PLY_W - PLY_X]);
    if (st == BATTEN_OK && p->fields) st = bx_add_field_row(p->soup, p->fields);
  }
  return st;
}

static batten_status read_others(ply *p, const ply_element *e) {
  batten_status st = BATTEN_OK;
  for (int64_t i = 0; st == BATTEN_OK && i < e->count && e->property_count; i++) {
    double unused[PLY_NUMBERS];
    st = read_row(p, e, i, unused);
  }
  return st;
}

/* Points need nothing behind the vertices. */
static batten_status read_elements(ply *p) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < p->header.element_count; i++) {
    const ply_element *e = &p->header.elements[i];
    bool vertices = !strcmp(e->name, "vertex");
    st = vertices ? read_vertices(p, e) : read_others(p, e);
    if (vertices && !p->soup->want_triangles) return st;
  }
  return st;
}

batten_status bx_read_ply(bx_reader *r, bx_soup *soup) {
  ply p = {.r = r, .soup = soup};
  batten_status st = ply_read_header(r, &p.header);
  if (st == BATTEN_OK) st = prepare(&p);
  if (st == BATTEN_OK) st = read_elements(&p);
  ply_free_header(r, &p.header);
  batten_free(r->ctx, p.fields);
  return st;
}
