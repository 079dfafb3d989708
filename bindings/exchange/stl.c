/* STL, text and binary. Corners with the same three coordinates become one vertex (-0 is 0); a triangle that has lost
 * a corner by that has no area and is dropped.
 *
 * Binary files may begin with "solid" as text does. What tells: a size of exactly 84 + 50 F bytes is binary;
 * otherwise "solid" at the start and no byte of value 0 in the first block is text. */
#include "soup.h"

#include "base/checked.h"

#include <string.h>

enum { HEADER = 80, RECORD = 50, LOOKED_AT = 1 << 12 };

#define FREE_SLOT UINT32_MAX

/* Open addressing; slots hold vertex numbers. */
typedef struct welder {
  bx_reader *r;
  bx_soup *soup;
  uint32_t *slots;
  size_t slot_count; /* a power of two, at least twice the vertices */
} welder;

static size_t hash(const double x[3]) {
  uint64_t h = 0x9e3779b97f4a7c15u;
  for (int i = 0; i < 3; i++) {
    uint64_t bits;
    memcpy(&bits, &x[i], sizeof bits);
    h = (h ^ bits) * 0xbf58476d1ce4e5b9u;
    h ^= h >> 29;
  }
  return (size_t)h;
}

/* The slot of x, or the free one where it belongs. */
static size_t find_slot(const welder *w, const double x[3]) {
  size_t slot = hash(x) & (w->slot_count - 1);
  while (w->slots[slot] != FREE_SLOT && memcmp(w->soup->vertices + 3 * (size_t)w->slots[slot], x, 3 * sizeof *x))
    slot = (slot + 1) & (w->slot_count - 1);
  return slot;
}

static batten_status grow_slots(welder *w) {
  size_t count = w->slot_count ? w->slot_count : 128;
  if (w->slot_count && !batten_mul(count, 2, &count))
    return batten_fail(w->r->ctx, BATTEN_E_TOO_LARGE, "%zu vertices", w->soup->vertex_count);
  uint32_t *slots = batten_alloc_array(w->r->ctx, count, sizeof *slots);
  if (!slots) return BATTEN_E_NOMEM;
  batten_free(w->r->ctx, w->slots);
  w->slots = slots;
  w->slot_count = count;
  for (size_t i = 0; i < count; i++) slots[i] = FREE_SLOT;
  for (size_t i = 0; i < w->soup->vertex_count; i++) slots[find_slot(w, w->soup->vertices + 3 * i)] = (uint32_t)i;
  return BATTEN_OK;
}

static batten_status weld(welder *w, const double given[3], uint32_t *vertex) {
  double x[3] = {given[0] + 0.0, given[1] + 0.0, given[2] + 0.0}; /* -0 + 0 = 0: equal numbers, equal bits */
  batten_status st = BATTEN_OK;
  if (2 * (w->soup->vertex_count + 1) > w->slot_count) st = grow_slots(w);
  if (st != BATTEN_OK) return st;
  size_t slot = find_slot(w, x);
  if (w->slots[slot] == FREE_SLOT) {
    st = bx_add_vertex(w->soup, x);
    if (st != BATTEN_OK) return st;
    w->slots[slot] = (uint32_t)(w->soup->vertex_count - 1);
  }
  *vertex = w->slots[slot];
  return BATTEN_OK;
}

static batten_status add_triangle(welder *w, const uint32_t v[3]) {
  if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) return BATTEN_OK;
  bx_begin_polygon(w->soup);
  batten_status st = BATTEN_OK;
  for (int i = 0; st == BATTEN_OK && i < 3; i++) st = bx_add_corner(w->soup, v[i]);
  return st;
}

static uint32_t u32_at(const unsigned char *bytes) {
  return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static batten_status read_binary(welder *w) {
  unsigned char head[HEADER + 4], record[RECORD];
  batten_status st = bx_read_bytes(w->r, head, sizeof head, "the STL header of 84 bytes");
  uint32_t count = st == BATTEN_OK ? u32_at(head + HEADER) : 0;
  for (uint32_t i = 0; st == BATTEN_OK && i < count; i++) {
    uint32_t v[3];
    st = bx_read_bytes(w->r, record, sizeof record, "a triangle of those that the header declares");
    for (int k = 0; st == BATTEN_OK && k < 3; k++) {
      double x[3];
      for (int c = 0; c < 3; c++) {
        uint32_t bits = u32_at(record + 12 + 12 * k + 4 * c);
        float value;
        memcpy(&value, &bits, sizeof value);
        x[c] = (double)value;
      }
      if (batten_first_nonfinite(3, x) < 3)
        return bx_fail_byte(w->r, "triangle %lu ends here; its corner %d is not finite", (unsigned long)i, k);
      st = weld(w, x, &v[k]);
    }
    if (st == BATTEN_OK) st = add_triangle(w, v);
  }
  return st;
}

static batten_status read_corner(welder *w, const char *at, uint32_t *vertex) {
  static const char *const names[] = {"x", "y", "z"};
  double x[3];
  batten_status st = BATTEN_OK;
  for (int i = 0; st == BATTEN_OK && i < 3; i++) st = bx_next_number(w->r, &at, names[i], &x[i]);
  return st == BATTEN_OK ? weld(w, x, vertex) : st;
}

/* Some programs write all in capitals. */
static void lower_case(char *text) {
  for (; *text; text++)
    if (*text >= 'A' && *text <= 'Z') *text = (char)(*text + ('a' - 'A'));
}

/* Lines: solid, facet normal, outer loop, vertex x 3, endloop, endfacet, endsolid; several solids may follow. */
static batten_status read_text(welder *w) {
  uint32_t v[3];
  unsigned corners = 0;
  bool end, in_loop = false;
  batten_status st = bx_next_line(w->r, &end);
  for (; st == BATTEN_OK && !end; st = st == BATTEN_OK ? bx_next_line(w->r, &end) : st) {
    lower_case(w->r->text);
    const char *at = w->r->text, *word;
    size_t length = bx_next_word(&at, &word);
    if (bx_word_is(word, length, "outer")) {
      if (in_loop) return bx_fail_line(w->r, "a loop in a loop; endloop is missing");
      in_loop = true;
      corners = 0;
    } else if (bx_word_is(word, length, "vertex")) {
      if (!in_loop || corners == 3)
        return bx_fail_line(w->r, in_loop ? "a fourth corner of a triangle" : "a vertex outside of outer loop");
      st = read_corner(w, at, &v[corners++]);
    } else if (bx_word_is(word, length, "endloop")) {
      if (!in_loop || corners < 3) return bx_fail_line(w->r, "a triangle of %u corners", corners);
      in_loop = false;
      st = add_triangle(w, v);
    } else if (length && !bx_word_is(word, length, "solid") && !bx_word_is(word, length, "facet") &&
               !bx_word_is(word, length, "endfacet") && !bx_word_is(word, length, "endsolid")) {
      char quote[BX_QUOTE_SIZE];
      return bx_fail_line(w->r, "'%s' is not a word of STL", bx_quote(word, length, quote));
    }
  }
  if (st == BATTEN_OK && in_loop) return bx_fail_line(w->r, "the file ends in a triangle");
  return st;
}

static batten_status is_binary(bx_reader *r, bool *binary) {
  const unsigned char *bytes;
  size_t got;
  batten_status st = bx_peek(r, LOOKED_AT, &bytes, &got);
  if (st != BATTEN_OK) return st;
  bool sized =
      got >= HEADER + 4 && bx_size_known(r) && r->size == HEADER + 4 + (uint64_t)RECORD * u32_at(bytes + HEADER);
  size_t at = got >= 3 && !memcmp(bytes, "\xef\xbb\xbf", 3) ? 3 : 0;
  while (at < got && (bytes[at] == ' ' || bytes[at] == '\t' || bytes[at] == '\r' || bytes[at] == '\n')) at++;
  bool solid = got - at >= 5 && (!memcmp(bytes + at, "solid", 5) || !memcmp(bytes + at, "SOLID", 5));
  bool text = solid && !memchr(bytes, 0, got);
  *binary = sized || !text;
  return BATTEN_OK;
}

batten_status bx_read_stl(bx_reader *r, bx_soup *soup) {
  welder w = {.r = r, .soup = soup};
  bool binary = false;
  soup->n = 3;
  batten_status st = is_binary(r, &binary);
  if (st == BATTEN_OK) st = binary ? read_binary(&w) : read_text(&w);
  batten_free(r->ctx, w.slots);
  return st;
}
