/* Pieces of JSON documents: see write.h. */
#include "write.h"

void bx_put_json_text(bx_writer *w, const char *text) {
  bx_put_text(w, "\"");
  for (const char *c = text; *c; c++) {
    if (*c == '"' || *c == '\\') bx_put_u8(w, '\\');
    if ((unsigned char)*c < 0x20)
      bx_print(w, "\\u%04x", (unsigned)*c);
    else
      bx_put_u8(w, (uint8_t)*c);
  }
  bx_put_text(w, "\"");
}

void bx_put_json_numbers(bx_writer *w, const double *values, size_t count) {
  bx_put_u8(w, '[');
  for (size_t i = 0; i < count; i++) {
    if (i) bx_put_text(w, i % 8 ? ", " : ",\n");
    bx_put_number(w, values[i]);
  }
  bx_put_u8(w, ']');
}

void bx_put_json_rows(bx_writer *w, const double *values, size_t rows, size_t width, const char *between) {
  bx_put_u8(w, '[');
  for (size_t i = 0; i < rows; i++) {
    if (i) bx_put_text(w, between);
    bx_put_json_numbers(w, values + i * width, width);
  }
  bx_put_u8(w, ']');
}
