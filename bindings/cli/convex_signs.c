/* Signs of span pairs as one sees them on paper: lines of +, - and 0, y upwards, x to the right. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "convex.h"

/* Bytes of the UTF-8 character at the beginning of a text. */
static int character_length(const char *text) {
  int length = 1;
  while (length < 4 && ((unsigned char)text[length] & 0xc0) == 0x80) length++;
  return length;
}

/* One line into row `line` from the top. */
static batten_status read_line(batten_context *ctx, const char *path, const char *text, size_t line, size_t nx,
                               size_t ny, signed char *signs) {
  size_t x = 0;
  for (; *text; text++) {
    if (strchr(" \t,;\r\n", *text)) continue;
    if (!strchr("+-0", *text))
      return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%zu: '%.*s' is no sign; give +, - or 0", path, line + 1,
                         character_length(text), text);
    if (x < nx && line < ny) signs[x * ny + ny - 1 - line] = *text == '+' ? 1 : *text == '-' ? -1 : 0;
    x++;
  }
  if (x != nx)
    return batten_fail(ctx, BATTEN_E_FORMAT, "%s:%zu: %zu signs for %zu spans in x; give one each (see --spans)",
                       path, line + 1, x, nx);
  return BATTEN_OK;
}

batten_status convex_read_signs(batten_context *ctx, const char *path, size_t nx, size_t ny, signed char **signs) {
  char text[1024]; /* 64 signs with separators */
  FILE *f = fopen(path, "r");
  if (!f) return batten_fail(ctx, BATTEN_E_IO, "%s: cannot be read: %s", path, strerror(errno));
  signed char *made = batten_alloc(ctx, nx * ny);
  batten_status st = made ? BATTEN_OK : BATTEN_E_NOMEM;
  size_t line = 0;
  while (st >= 0 && fgets(text, sizeof text, f)) {
    if (text[strspn(text, " \t\r\n")] == '\0') continue;
    st = read_line(ctx, path, text, line, nx, ny, made);
    line++;
  }
  if (st >= 0 && ferror(f)) st = batten_fail(ctx, BATTEN_E_IO, "%s: cannot be read: %s", path, strerror(errno));
  if (st >= 0 && line != ny)
    st = batten_fail(ctx, BATTEN_E_FORMAT, "%s: %zu lines for %zu spans in y; give one each (see --spans)", path,
                     line, ny);
  fclose(f);
  if (st >= 0)
    *signs = made;
  else
    batten_free(ctx, made);
  return st;
}
