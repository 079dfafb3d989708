/* Wavefront OBJ: v, vn, f; everything else is passed over.
 *
 * Corners are v, v/vt, v//vn or v/vt/vn, counted from 1 or, negative, back from the last one so far. A vertex takes
 * the normal of the first corner that names one; without faces, as many vn as v belong together in order. */
#include "soup.h"

#include "number.h"

#include <string.h>

#define NO_NORMAL UINT32_MAX

typedef struct obj {
  bx_reader *r;
  bx_soup *soup;
  uint64_t highest; /* largest vertex number in a face, and its line */
  uint64_t highest_line;
  uint32_t *normal_of; /* [normal_of_count] index of a vn, or NO_NORMAL */
  size_t normal_of_count, normal_of_capacity;
  double *file_normals; /* vn lines, [file_normal_count][3] */
  size_t file_normal_count, file_normal_capacity;
  bool corner_normals; /* some corner named one */
  uint64_t highest_normal, highest_normal_line;
} obj;

static batten_status read_vertex(obj *o, const char *at) {
  static const char *const names[] = {"x", "y", "z", "w"};
  double x[4];
  batten_status st = BATTEN_OK;
  for (int i = 0; st == BATTEN_OK && i < 3; i++) st = bx_next_number(o->r, &at, names[i], &x[i]);
  if (st != BATTEN_OK) return st;
  size_t words = 3;
  const char *word, *rest = at;
  while (bx_next_word(&rest, &word) && *word != '#') words++;
  if (words == 4) { /* six or seven words: a colour follows */
    st = bx_next_number(o->r, &at, names[3], &x[3]);
    if (st == BATTEN_OK && !(x[3] == 1))
      return bx_fail_line(o->r, "w: a weight other than 1; rational vertices are not read");
  }
  return st == BATTEN_OK ? bx_add_vertex(o->soup, x) : st;
}

static batten_status read_normal(obj *o, const char *at) {
  static const char *const names[] = {"x of the normal", "y of the normal", "z of the normal"};
  double x[3];
  batten_status st = BATTEN_OK;
  for (int i = 0; st == BATTEN_OK && i < 3; i++) st = bx_next_number(o->r, &at, names[i], &x[i]);
  if (st != BATTEN_OK) return st;
  void *grown = o->file_normals;
  st = bx_grow(o->r->ctx, &grown, &o->file_normal_capacity, o->file_normal_count + 1, 3 * sizeof(double));
  o->file_normals = grown;
  if (st == BATTEN_OK) memcpy(o->file_normals + 3 * o->file_normal_count++, x, sizeof x);
  return st;
}

/* One number of a corner: absolute index from 0, of something that has `count` so far. */
static batten_status resolve(obj *o, const char *what, int64_t number, size_t count, uint64_t *index) {
  if (number == 0) return bx_fail_line(o->r, "%s number 0; they are counted from 1", what);
  if (number < 0 && (uint64_t)-number > count)
    return bx_fail_line(o->r, "%s number %lld, but only %zu came before", what, (long long)number, count);
  *index = number < 0 ? count - (uint64_t)-number : (uint64_t)number - 1;
  if (*index >= UINT32_MAX) return bx_fail_line(o->r, "%s number %lld is too large", what, (long long)number);
  return BATTEN_OK;
}

static batten_status set_normal_of(obj *o, uint32_t vertex, uint32_t normal) {
  if (vertex >= o->soup->vertex_count) return BATTEN_OK; /* not there yet: no memory for what is only promised */
  void *grown = o->normal_of;
  batten_status st = bx_grow(o->r->ctx, &grown, &o->normal_of_capacity, (size_t)vertex + 1, sizeof *o->normal_of);
  o->normal_of = grown;
  if (st != BATTEN_OK) return st;
  while (o->normal_of_count <= vertex) o->normal_of[o->normal_of_count++] = NO_NORMAL;
  if (o->normal_of[vertex] == NO_NORMAL) o->normal_of[vertex] = normal;
  return BATTEN_OK;
}

/* v[/[vt][/vn]] */
static batten_status read_corner(obj *o, const char *word, size_t length) {
  const char *at = word, *end = word + length;
  char quote[BX_QUOTE_SIZE];
  int64_t number[3] = {0, 0, 0};
  bool given[3] = {false, false, false};
  for (int i = 0; i < 3 && at < end; i++) {
    given[i] = bx_parse_integer(at, &at, &number[i]) == BX_NUMBER_OK;
    if (at < end && *at == '/')
      at++;
    else
      break;
  }
  if (at != end || !given[0])
    return bx_fail_line(o->r, "corner '%s' is not v, v/vt, v//vn or v/vt/vn", bx_quote(word, length, quote));
  uint64_t vertex, normal;
  batten_status st = resolve(o, "vertex", number[0], o->soup->vertex_count, &vertex);
  if (st != BATTEN_OK) return st;
  if (vertex >= o->highest) {
    o->highest = vertex + 1;
    o->highest_line = o->r->line;
  }
  if (given[2]) {
    st = resolve(o, "normal", number[2], o->file_normal_count, &normal);
    if (st != BATTEN_OK) return st;
    if (normal >= o->highest_normal) {
      o->highest_normal = normal + 1;
      o->highest_normal_line = o->r->line;
    }
    o->corner_normals = true;
    st = set_normal_of(o, (uint32_t)vertex, (uint32_t)normal);
  }
  return st == BATTEN_OK ? bx_add_corner(o->soup, (uint32_t)vertex) : st;
}

static batten_status read_face(obj *o, const char *at) {
  bx_begin_polygon(o->soup);
  const char *word;
  size_t length;
  batten_status st = BATTEN_OK;
  while (st == BATTEN_OK && (length = bx_next_word(&at, &word)) > 0) {
    if (bx_word_is(word, length, "\\") && *bx_skip_blanks(at) == '\0') { /* the face goes on in the next line */
      bool end;
      st = bx_next_line(o->r, &end);
      at = o->r->text;
    } else if (*word == '#') {
      break;
    } else {
      st = read_corner(o, word, length);
    }
  }
  if (st == BATTEN_OK && o->soup->corners < 3)
    return bx_fail_line(o->r, "a face of %zu corners; it needs 3 or more", o->soup->corners);
  return st;
}

static batten_status read_line(obj *o) {
  const char *at = o->r->text, *word;
  size_t length = bx_next_word(&at, &word);
  if (bx_word_is(word, length, "v")) return read_vertex(o, at);
  if (bx_word_is(word, length, "vn")) return read_normal(o, at);
  if (bx_word_is(word, length, "f")) return read_face(o, at);
  return BATTEN_OK;
}

static batten_status check_numbers(obj *o) {
  if (o->highest > o->soup->vertex_count) {
    o->r->line = o->highest_line;
    return bx_fail_line(o->r, "vertex number %llu, but the file has %zu vertices", (unsigned long long)o->highest,
                        o->soup->vertex_count);
  }
  if (o->highest_normal > o->file_normal_count) {
    o->r->line = o->highest_normal_line;
    return bx_fail_line(o->r, "normal number %llu, but the file has %zu normals",
                        (unsigned long long)o->highest_normal, o->file_normal_count);
  }
  return BATTEN_OK;
}

/* Normals in the order of the vertices, where every vertex has one. */
static batten_status order_normals(obj *o) {
  size_t count = o->soup->vertex_count;
  if (o->corner_normals ? o->normal_of_count != count : o->file_normal_count != count) return BATTEN_OK;
  for (size_t i = 0; o->corner_normals && i < count; i++)
    if (o->normal_of[i] == NO_NORMAL) return BATTEN_OK;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st == BATTEN_OK && i < count; i++)
    st = bx_add_normal(o->soup, o->file_normals + 3 * (o->corner_normals ? o->normal_of[i] : i));
  return st;
}

batten_status bx_read_obj(bx_reader *r, bx_soup *soup) {
  obj o = {.r = r, .soup = soup};
  soup->n = 3;
  bool end;
  batten_status st = bx_next_line(r, &end);
  while (st == BATTEN_OK && !end) {
    st = read_line(&o);
    if (st == BATTEN_OK) st = bx_next_line(r, &end);
  }
  if (st == BATTEN_OK) st = check_numbers(&o);
  if (st == BATTEN_OK) st = order_normals(&o);
  batten_free(r->ctx, o.normal_of);
  batten_free(r->ctx, o.file_normals);
  return st;
}
