/* Pieces of ISO 10303-21: see step_text.h. */
#include "step_text.h"

#include "number.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void step_put_whole(step_text *s, uint64_t value) {
  char digits[20];
  size_t at = sizeof digits;
  do {
    digits[--at] = (char)('0' + value % 10);
    value /= 10;
  } while (value);
  bx_put(s->w, digits + at, sizeof digits - at);
}

void step_put_reference(step_text *s, uint64_t entity) {
  bx_put_u8(s->w, '#');
  step_put_whole(s, entity);
}

uint64_t step_begin(step_text *s) {
  step_put_reference(s, ++s->last);
  bx_put_u8(s->w, '=');
  return s->last;
}

void step_put_item(step_text *s, size_t i, uint64_t entity) {
  enum { IN_LINE = 10 };
  bx_put_text(s->w, i == 0 ? "(" : i % IN_LINE ? "," : ",\n");
  step_put_reference(s, entity);
}

void step_put_references(step_text *s, const uint64_t *entities, size_t count) {
  for (size_t i = 0; i < count; i++) step_put_item(s, i, entities[i]);
  bx_put_u8(s->w, ')');
}

void step_put_real(step_text *s, double value) {
  char text[BX_NUMBER_SIZE];
  bx_put(s->w, text, (size_t)bx_format_real(value, text));
}

/* The next letter of UTF-8, '?' for bytes that are none; *at moves behind it. */
static uint32_t next_letter(const unsigned char **at) {
  const unsigned char *c = *at;
  unsigned follow = c[0] < 0x80 ? 0 : c[0] >> 5 == 6 ? 1 : c[0] >> 4 == 14 ? 2 : c[0] >> 3 == 30 ? 3 : 9;
  uint32_t letter = follow == 0 ? c[0] : follow == 9 ? '?' : c[0] & (0x3fu >> follow);
  for (unsigned i = 1; follow < 9 && i <= follow; i++) {
    if (c[i] >> 6 != 2) {
      follow = 9;
      letter = '?';
      break;
    }
    letter = letter << 6 | (c[i] & 0x3fu);
  }
  *at = c + (follow < 9 ? follow : 0) + 1;
  return letter;
}

void step_put_text(step_text *s, const char *text) {
  bx_put_u8(s->w, '\'');
  for (const unsigned char *at = (const unsigned char *)text; *at;) {
    uint32_t letter = next_letter(&at);
    if (letter == '\'' || letter == '\\') bx_put_u8(s->w, (uint8_t)letter);
    if (letter > 0xffff)
      bx_print(s->w, "\\X4\\%08lX\\X0\\", (unsigned long)letter);
    else if (letter >= 0x7f)
      bx_print(s->w, "\\X2\\%04lX\\X0\\", (unsigned long)letter);
    else
      bx_put_u8(s->w, letter < ' ' ? (uint8_t)' ' : (uint8_t)letter);
  }
  bx_put_u8(s->w, '\'');
}

uint64_t step_print(step_text *s, const char *format, ...) {
  char text[640];
  va_list args;
  va_start(args, format);
  int length = vsnprintf(text, sizeof text, format, args);
  va_end(args);
  uint64_t entity = step_begin(s);
  if (length < 0 || (size_t)length >= sizeof text)
    bx_writer_fail(s->w, batten_fail(s->w->ctx, BATTEN_E_INTERNAL, "%s: an entity is too long to print", s->w->path));
  else
    bx_put(s->w, text, (size_t)length);
  bx_put_text(s->w, ";\n");
  return entity;
}

uint64_t step_put_point(step_text *s, const double point[3]) {
  uint64_t entity = step_begin(s);
  bx_put_text(s->w, "CARTESIAN_POINT('',(");
  for (int x = 0; x < 3; x++) {
    if (x) bx_put_u8(s->w, ',');
    step_put_real(s, point[x]);
  }
  bx_put_text(s->w, "));\n");
  return entity;
}
