/* Tables of numbers in text: see text_table.h. */
#include "text_table.h"

#include "number.h"

#include <stdio.h>
#include <string.h>

enum { COLUMNS_MAX = 256 };

/* Without its comment. */
static size_t content_length(const char *line) {
  const char *end = line;
  while (*end && *end != '#' && *end != '%' && !(*end == '/' && end[1] == '/')) end++;
  return (size_t)(end - line);
}

static char find_separator(const char *line, size_t length) {
  if (memchr(line, ';', length)) return ';';
  return memchr(line, ',', length) ? ',' : ' ';
}

static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

/* The next field of line[*at .. length), trimmed; false when there is none. A separator at the very end closes the
 * last field and opens none. */
static bool next_field(const char *line, size_t length, char separator, size_t *at, bx_field *out) {
  while (*at < length && is_space(line[*at])) ++*at;
  if (*at >= length) return false;
  size_t begin = *at, end = begin;
  while (end < length && (separator == ' ' ? !is_space(line[end]) : line[end] != separator)) end++;
  *at = end + (end < length);
  while (end > begin && is_space(line[end - 1])) end--;
  *out = (bx_field){line + begin, end - begin};
  return true;
}

static size_t count_fields(const char *line, size_t length, char separator) {
  size_t at = 0, count = 0;
  bx_field f;
  while (next_field(line, length, separator, &at, &f)) count++;
  return count;
}

static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c + ('a' - 'A')) : c; }

static bool is_alphanumeric(char c) { return (c >= '0' && c <= '9') || (lower(c) >= 'a' && lower(c) <= 'z'); }

/* x, "X", x_m, "y [mm]", Nx, normal_z ...; -1 for other names. */
static int role_of(bx_field f) {
  static const struct {
    const char *name;
    bx_role role;
  } names[] = {{"x", BX_X},
               {"y", BX_Y},
               {"z", BX_Z},
               {"nx", BX_NX},
               {"ny", BX_NY},
               {"nz", BX_NZ},
               {"normal_x", BX_NX},
               {"normal_y", BX_NY},
               {"normal_z", BX_NZ},
               {"normalx", BX_NX},
               {"normaly", BX_NY},
               {"normalz", BX_NZ},
               {"u", BX_U},
               {"v", BX_V},
               {"w", BX_W},
               {"weight", BX_W},
               {"t", BX_T},
               {"parameter", BX_T},
               {"contour", BX_CONTOUR},
               {"curve", BX_CONTOUR},
               {"station", BX_STATION},
               {"half_breadth", BX_HALF_BREADTH},
               {"half-breadth", BX_HALF_BREADTH},
               {"half breadth", BX_HALF_BREADTH},
               {"halfbreadth", BX_HALF_BREADTH},
               {"waterline", BX_WATERLINE}};
  while (f.length && (*f.text == '"' || *f.text == '\'')) f = (bx_field){f.text + 1, f.length - 1};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    const char *name = names[i].name;
    size_t length = strlen(name), k = 0;
    while (k < length && k < f.length && lower(f.text[k]) == name[k]) k++;
    bool ends = k == length && (k == f.length || !is_alphanumeric(f.text[k]));
    if (ends) return (int)names[i].role;
  }
  return -1;
}

/* Half-breadths y over stations x and waterlines z: their names say that it is a table of offsets, in which x and z
 * may have their plain names, and y has where the other two say it. x and z are taken before stations and waterlines,
 * which may be their numbers. */
static bool resolve_offsets(int column_of[BX_ROLES]) {
  static const bx_role plain[3] = {BX_X, BX_Y, BX_Z}, own[3] = {BX_STATION, BX_HALF_BREADTH, BX_WATERLINE};
  bool offsets = column_of[BX_HALF_BREADTH] >= 0 || (column_of[BX_STATION] >= 0 && column_of[BX_WATERLINE] >= 0);
  int found[3];
  for (int k = 0; k < 3; k++) {
    bool own_first = plain[k] == BX_Y ? column_of[own[k]] >= 0 : column_of[plain[k]] < 0;
    found[k] = column_of[own_first ? own[k] : plain[k]];
    offsets = offsets && found[k] >= 0;
  }
  for (int k = 0; offsets && k < 3; k++) column_of[plain[k]] = found[k];
  return offsets;
}

/* Reads names; false when x and y are not among them. */
static bool take_names(bx_table *t, const char *line, size_t length) {
  int column_of[BX_ROLES];
  for (int i = 0; i < BX_ROLES; i++) column_of[i] = -1;
  char separator = find_separator(line, length);
  size_t at = 0, column = 0;
  bx_field f;
  for (; next_field(line, length, separator, &at, &f); column++) {
    int role = role_of(f);
    if (role >= 0 && t->wanted >> role & 1 && column_of[role] < 0) column_of[role] = (int)column;
  }
  bool offsets = resolve_offsets(column_of);
  t->half_breadths = column_of[BX_HALF_BREADTH] >= 0;
  if (column_of[BX_X] < 0 || column_of[BX_Y] < 0) return false;
  if (column_of[BX_U] < 0 || column_of[BX_V] < 0) column_of[BX_U] = column_of[BX_V] = -1; /* alone: something else */
  memcpy(t->column_of, column_of, sizeof column_of);
  for (int role = BX_STATION; role <= BX_WATERLINE; role++) t->column_of[role] = -1;
  t->named = true;
  t->offsets = offsets;
  t->named_columns = column;
  return true;
}

static bool looks_like_number(bx_field f) {
  if (f.length == 0) return true; /* an empty field: the line of numbers will say so */
  char c = *f.text;
  const char *end;
  double value;
  return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.' ||
         (bx_parse_number(f.text, &end, &value) == BX_NUMBER_NOT_FINITE && end == f.text + f.length);
}

static bool is_header(const char *line, size_t length) {
  size_t at = 0;
  bx_field f;
  return next_field(line, length, find_separator(line, length), &at, &f) && !looks_like_number(f);
}

/* Which columns mean what, from their number. */
static batten_status choose_roles(bx_table *t) {
  enum { PLAIN = 6 }; /* roles that columns have without names */
  static const int planar[PLAIN] = {0, 1, -1, -1, -1, -1}, planar_normals[PLAIN] = {0, 1, -1, 2, 3, -1};
  static const int spatial[PLAIN] = {0, 1, 2, -1, -1, -1}, spatial_normals[PLAIN] = {0, 1, 2, 3, 4, 5};
  bool normals = t->wanted >> BX_NX & 1;
  const int *column_of = t->columns == 2                           ? planar
                         : t->columns == 3                         ? spatial
                         : normals && t->columns == 4 && t->n != 3 ? planar_normals
                         : normals && t->columns == 6              ? spatial_normals
                                                                   : NULL;
  if (!column_of)
    return bx_fail_line(t->r, "%zu column%s without names; %s are known, for others put a line of names above: %s",
                        t->columns, t->columns == 1 ? "" : "s",
                        normals ? "2, 3, 4 (x y nx ny) or 6 (x y z nx ny nz)" : "2 (x y) or 3 (x y z)", t->names);
  for (int i = 0; i < BX_ROLES; i++) t->column_of[i] = i < PLAIN ? column_of[i] : -1;
  return BATTEN_OK;
}

/* At the first line of numbers. */
static batten_status begin_numbers(bx_table *t, const char *line, size_t length) {
  t->separator = find_separator(line, length);
  t->columns = count_fields(line, length, t->separator);
  if (t->columns > COLUMNS_MAX)
    return bx_fail_line(t->r, "%zu columns; at most %d are read", t->columns, COLUMNS_MAX);
  if (t->named && t->names_in_comment && t->named_columns != t->columns) t->named = t->offsets = false;
  if (t->named && t->named_columns != t->columns)
    return bx_fail_line(t->r, "%zu columns, but the header names %zu", t->columns, t->named_columns);
  return t->named ? BATTEN_OK : choose_roles(t);
}

static batten_status fail_field(bx_table *t, size_t column, bx_field f) {
  char name[40];
  snprintf(name, sizeof name, "column %zu", column + 1);
  /* "1,5 2,5": cut at the commas, a field holds two numbers. */
  for (size_t i = 0; t->separator == ',' && i < f.length; i++)
    if (is_space(f.text[i])) {
      char quote[BX_QUOTE_SIZE];
      return bx_fail_line(t->r,
                          "%s: '%s' holds a blank; separate by commas or by blanks, and write a point as the "
                          "decimal sign",
                          name, bx_quote(f.text, f.length, quote));
    }
  return bx_fail_number(t->r, name, f.text, f.length, false);
}

static batten_status take_number(bx_table *t, size_t column, bx_field f) {
  const char *end;
  double value = 0;
  bool is_used = false;
  for (int role = 0; role < BX_ROLES; role++) is_used = is_used || t->column_of[role] == (int)column;
  if (!is_used) return BATTEN_OK; /* other columns may hold text */
  if (t->column_of[BX_CONTOUR] == (int)column) {
    t->contour = f;
    return f.length ? BATTEN_OK : fail_field(t, column, f);
  }
  if (f.length == 0 || bx_parse_number(f.text, &end, &value) != BX_NUMBER_OK || end != f.text + f.length)
    return fail_field(t, column, f);
  for (int role = 0; role < BX_ROLES; role++)
    if (t->column_of[role] == (int)column) t->values[role] = value;
  return BATTEN_OK;
}

static batten_status take_numbers(bx_table *t, const char *line, size_t length) {
  size_t at = 0, column = 0;
  bx_field f;
  for (; next_field(line, length, t->separator, &at, &f); column++) {
    batten_status st = column < t->columns ? take_number(t, column, f) : BATTEN_OK;
    if (st != BATTEN_OK) return st;
  }
  if (column == t->columns) return BATTEN_OK;
  return bx_fail_line(t->r, "%zu column%s, but the lines before have %zu", column, column == 1 ? "" : "s",
                      t->columns);
}

/* "contour 56"? "contour x y" names columns. */
static bool is_head(const char *line, const char **number) {
  const char *word, *end;
  size_t length = bx_next_word(&line, &word);
  if (!bx_word_is(word, length, "contour")) return false;
  *number = line;
  length = bx_next_word(&line, &word);
  int64_t value;
  return length == 0 || bx_parse_integer(word, &end, &value) != BX_NUMBER_NONE;
}

batten_status bx_table_take(bx_table *t, bx_line *out) {
  const char *line = t->r->text;
  if (is_head(line, &t->head)) {
    *out = BX_LINE_HEAD;
    return BATTEN_OK;
  }
  size_t length = content_length(line), at = 0;
  bx_field f;
  if (!next_field(line, length, ' ', &at, &f)) {
    const char *comment = line + length + strspn(line + length, "#%/ \t");
    if (t->columns == 0 && take_names(t, comment, strlen(comment))) t->names_in_comment = true;
    *out = line[length] ? BX_LINE_COMMENT : BX_LINE_BLANK;
    return BATTEN_OK;
  }
  bool has_header = t->named && !t->names_in_comment; /* then text may stand in the other columns */
  if (t->columns == 0 && !has_header && is_header(line, length)) {
    char quote[BX_QUOTE_SIZE];
    bool names = take_names(t, line, length), title = !names && t->may_have_title && t->r->line == 1;
    if (title) {
      *out = BX_LINE_COMMENT;
      return BATTEN_OK;
    }
    if (!names && t->half_breadths)
      return bx_fail_line(t->r,
                          "the header '%s' names half-breadths, but not both of station (or x) and waterline (or "
                          "z); add them",
                          bx_quote(line, length, quote));
    if (!names)
      return bx_fail_line(t->r, "the header '%s' names no columns x and y; rename them, or remove the line",
                          bx_quote(line, length, quote));
    t->names_in_comment = false;
    *out = BX_LINE_NAMES;
    return BATTEN_OK;
  }
  batten_status st = t->columns ? BATTEN_OK : begin_numbers(t, line, length);
  *out = BX_LINE_ROW;
  return st == BATTEN_OK ? take_numbers(t, line, length) : st;
}
