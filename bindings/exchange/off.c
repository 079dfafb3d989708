/* OFF of Geomview: [ST][C][N]OFF, counts, then a line for each vertex and each face; # comments, blank lines
 * anywhere.
 *
 * The keyword may be missing, the counts may stand on its line, and colours or texture coordinates behind the numbers
 * that count are passed over. */
#include "soup.h"

#include <string.h>

typedef struct off {
  bx_reader *r;
  bx_soup *soup;
  bool has_normals;
  int64_t vertices, faces;
} off;

/* The next line with something on it, cut at its comment; FORMAT at the end of the file. */
static batten_status next_content(off *o, const char *missing, const char **at) {
  for (;;) {
    bool end;
    batten_status st = bx_next_line(o->r, &end);
    if (st != BATTEN_OK) return st;
    if (end) return bx_fail_line(o->r, "the file ends here; %s is missing", missing);
    o->r->text[strcspn(o->r->text, "#")] = '\0';
    *at = bx_skip_blanks(o->r->text);
    if (**at) return BATTEN_OK;
  }
}

/* The keyword at *at, if there is one. */
static batten_status read_keyword(off *o, const char **at) {
  const char *behind = *at, *word;
  size_t length = bx_next_word(&behind, &word);
  char quote[BX_QUOTE_SIZE];
  if (strchr("0123456789+-.", *word) && length < 2 + strspn(word, "0123456789+-.eE")) return BATTEN_OK;
  const char *left = word;
  size_t rest = length;
  if (rest > 3 && !memcmp(left, "ST", 2)) left += 2, rest -= 2;
  if (rest > 3 && *left == 'C') left++, rest--;
  if (rest > 3 && *left == 'N') left++, rest--, o->has_normals = true;
  if (!bx_word_is(left, rest, "OFF"))
    return bx_fail_line(o->r, "'%s' is not OFF, NOFF, COFF, STOFF or a mixture (three dimensions only)",
                        bx_quote(word, length, quote));
  const char *next = behind;
  length = bx_next_word(&next, &word);
  if (bx_word_is(word, length, "BINARY")) return bx_fail_line(o->r, "OFF BINARY is not read; save the file as text");
  *at = behind;
  return BATTEN_OK;
}

static batten_status read_counts(off *o, const char *at) {
  batten_status st = bx_next_integer(o->r, &at, "the number of vertices", &o->vertices);
  if (st == BATTEN_OK) st = bx_next_integer(o->r, &at, "the number of faces", &o->faces);
  if (st == BATTEN_OK && (o->vertices < 0 || o->faces < 0 || o->vertices > UINT32_MAX))
    st = bx_fail_line(o->r, "%lld vertices and %lld faces", (long long)o->vertices, (long long)o->faces);
  return st;
}

static batten_status read_vertex(off *o) {
  static const char *const names[] = {"x", "y", "z", "x of the normal", "y of the normal", "z of the normal"};
  const char *at;
  double x[6];
  batten_status st = next_content(o, "a vertex", &at);
  for (int i = 0; st == BATTEN_OK && i < (o->has_normals ? 6 : 3); i++)
    st = bx_next_number(o->r, &at, names[i], &x[i]);
  if (st == BATTEN_OK) st = bx_add_vertex(o->soup, x);
  if (st == BATTEN_OK && o->has_normals) st = bx_add_normal(o->soup, x + 3);
  return st;
}

static batten_status read_face(off *o) {
  const char *at;
  int64_t corners = 0, vertex;
  batten_status st = next_content(o, "a face", &at);
  if (st == BATTEN_OK) st = bx_next_integer(o->r, &at, "the number of corners", &corners);
  if (st == BATTEN_OK && corners < 3)
    return bx_fail_line(o->r, "a face of %lld corners; it needs 3 or more", (long long)corners);
  bx_begin_polygon(o->soup);
  for (int64_t i = 0; st == BATTEN_OK && i < corners; i++) {
    st = bx_next_integer(o->r, &at, "a corner", &vertex);
    if (st == BATTEN_OK && (vertex < 0 || vertex >= o->vertices))
      return bx_fail_line(o->r, "corner %lld: vertex %lld, but the %lld vertices are counted from 0", (long long)i,
                          (long long)vertex, (long long)o->vertices);
    if (st == BATTEN_OK) st = bx_add_corner(o->soup, (uint32_t)vertex);
  }
  return st;
}

static batten_status read_head(off *o) {
  const char *at = NULL;
  batten_status st = next_content(o, "the word OFF", &at);
  if (st == BATTEN_OK) st = read_keyword(o, &at);
  if (st == BATTEN_OK && *bx_skip_blanks(at) == '\0') st = next_content(o, "the line of counts", &at);
  return st == BATTEN_OK ? read_counts(o, at) : st;
}

batten_status bx_read_off_counts(bx_reader *r, int64_t *vertices, int64_t *faces) {
  off o = {.r = r};
  batten_status st = read_head(&o);
  *vertices = o.vertices;
  *faces = o.faces;
  return st;
}

batten_status bx_read_off(bx_reader *r, bx_soup *soup) {
  off o = {.r = r, .soup = soup};
  soup->n = 3;
  batten_status st = read_head(&o);
  for (int64_t i = 0; st == BATTEN_OK && i < o.vertices; i++) st = read_vertex(&o);
  for (int64_t i = 0; st == BATTEN_OK && i < o.faces && soup->want_triangles; i++) st = read_face(&o);
  return st;
}
