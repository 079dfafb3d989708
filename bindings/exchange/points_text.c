/* Points in text: XYZ, TXT, CSV, with or without a header line of names.
 *
 * The separator is what the first line of a kind (names, numbers) uses: semicolons, else commas, else blanks. Without
 * names the number of columns decides: 2 = x y, 3 = x y z, 4 = x y nx ny, 6 = x y z nx ny nz. Names may also stand in
 * a comment above the first numbers ("# x y z nx ny nz", "//X Y Z R G B"); columns with other names are skipped.
 * Parameters (u v) and weights (w) always need names. */
#include "number.h"
#include "soup.h"

#include <stdio.h>
#include <string.h>

enum { X, Y, Z, NX, NY, NZ, U, V, W, ROLES, COLUMNS_MAX = 256 };

typedef struct table {
  bx_reader *r;
  bx_soup *soup;
  unsigned n;            /* asked for, 0 = open */
  size_t columns;        /* 0 = no line of numbers yet */
  char separator;        /* of the numbers */
  bool named;            /* columns come from names */
  bool names_in_comment; /* which count only when they fit the numbers */
  size_t named_columns;
  int role[ROLES]; /* column of x, y, ...; -1 = none */
  bool has_normals, has_parameters, has_weights;
} table;

typedef struct field {
  const char *text;
  size_t length;
} field;

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
static bool next_field(const char *line, size_t length, char separator, size_t *at, field *out) {
  while (*at < length && is_space(line[*at])) ++*at;
  if (*at >= length) return false;
  size_t begin = *at, end = begin;
  while (end < length && (separator == ' ' ? !is_space(line[end]) : line[end] != separator)) end++;
  *at = end + (end < length);
  while (end > begin && is_space(line[end - 1])) end--;
  *out = (field){line + begin, end - begin};
  return true;
}

static size_t count_fields(const char *line, size_t length, char separator) {
  size_t at = 0, count = 0;
  field f;
  while (next_field(line, length, separator, &at, &f)) count++;
  return count;
}

static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c + ('a' - 'A')) : c; }

static bool is_alphanumeric(char c) { return (c >= '0' && c <= '9') || (lower(c) >= 'a' && lower(c) <= 'z'); }

/* X .. W for x, "X", x_m, "y [mm]", Nx, normal_z ...; -1 for other names. */
static int role_of(field f) {
  static const struct {
    const char *name;
    int role;
  } names[] = {{"x", X},         {"y", Y},        {"z", Z},         {"nx", NX},
               {"ny", NY},       {"nz", NZ},      {"normal_x", NX}, {"normal_y", NY},
               {"normal_z", NZ}, {"normalx", NX}, {"normaly", NY},  {"normalz", NZ},
               {"u", U},         {"v", V},        {"w", W},         {"weight", W}};
  while (f.length && (*f.text == '"' || *f.text == '\'')) f = (field){f.text + 1, f.length - 1};
  for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
    const char *name = names[i].name;
    size_t length = strlen(name), k = 0;
    while (k < length && k < f.length && lower(f.text[k]) == name[k]) k++;
    bool ends = k == length && (k == f.length || !is_alphanumeric(f.text[k]));
    if (ends) return names[i].role;
  }
  return -1;
}

/* Reads names; false when x and y are not among them. */
static bool take_names(table *t, const char *line, size_t length) {
  int role[ROLES];
  for (int i = 0; i < ROLES; i++) role[i] = -1;
  char separator = find_separator(line, length);
  size_t at = 0, column = 0;
  field f;
  for (; next_field(line, length, separator, &at, &f); column++) {
    int which = role_of(f);
    if (which >= 0 && role[which] < 0) role[which] = (int)column;
  }
  if (role[X] < 0 || role[Y] < 0) return false;
  if (role[U] < 0 || role[V] < 0) role[U] = role[V] = -1; /* one alone means something else */
  memcpy(t->role, role, sizeof role);
  t->named = true;
  t->named_columns = column;
  return true;
}

static bool looks_like_number(field f) {
  if (f.length == 0) return true; /* an empty field: the line of numbers will say so */
  char c = *f.text;
  const char *end;
  double value;
  return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.' ||
         (bx_parse_number(f.text, &end, &value) == BX_NUMBER_NOT_FINITE && end == f.text + f.length);
}

static bool is_header(const char *line, size_t length) {
  size_t at = 0;
  field f;
  return next_field(line, length, find_separator(line, length), &at, &f) && !looks_like_number(f);
}

/* Which columns mean what, from their number. */
static batten_status choose_roles(table *t) {
  enum { PLAIN = 6 }; /* roles that columns have without names */
  static const int planar[PLAIN] = {0, 1, -1, -1, -1, -1}, planar_normals[PLAIN] = {0, 1, -1, 2, 3, -1};
  static const int spatial[PLAIN] = {0, 1, 2, -1, -1, -1}, spatial_normals[PLAIN] = {0, 1, 2, 3, 4, 5};
  const int *role = t->columns == 2                ? planar
                    : t->columns == 3              ? spatial
                    : t->columns == 4 && t->n != 3 ? planar_normals
                    : t->columns == 6              ? spatial_normals
                                                   : NULL;
  if (!role)
    return bx_fail_line(t->r,
                        "%zu column%s without names; 2, 3, 4 (x y nx ny) or 6 (x y z nx ny nz) are known, for "
                        "others put a line of names above: x y z nx ny nz u v w",
                        t->columns, t->columns == 1 ? "" : "s");
  for (int i = 0; i < ROLES; i++) t->role[i] = i < PLAIN ? role[i] : -1;
  return BATTEN_OK;
}

/* At the first line of numbers. */
static batten_status begin_numbers(table *t, const char *line, size_t length) {
  t->separator = find_separator(line, length);
  t->columns = count_fields(line, length, t->separator);
  if (t->columns > COLUMNS_MAX)
    return bx_fail_line(t->r, "%zu columns; at most %d are read", t->columns, COLUMNS_MAX);
  if (t->named && t->names_in_comment && t->named_columns != t->columns) t->named = false;
  if (t->named && t->named_columns != t->columns)
    return bx_fail_line(t->r, "%zu columns, but the header names %zu", t->columns, t->named_columns);
  batten_status st = t->named ? BATTEN_OK : choose_roles(t);
  if (st != BATTEN_OK) return st;
  t->soup->n = t->role[Z] < 0 ? 2 : 3;
  t->has_normals = t->role[NX] >= 0 && t->role[NY] >= 0 && (t->soup->n == 2 || t->role[NZ] >= 0);
  t->has_parameters = t->role[U] >= 0 && t->role[V] >= 0;
  t->has_weights = t->role[W] >= 0;
  return BATTEN_OK;
}

static batten_status fail_field(table *t, size_t column, field f) {
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

static batten_status take_numbers(table *t, const char *line, size_t length) {
  double row[COLUMNS_MAX];
  size_t at = 0, column = 0;
  field f;
  for (; next_field(line, length, t->separator, &at, &f); column++) {
    const char *end;
    if (column >= t->columns) continue; /* counted for the message below */
    bool used = !t->named;
    for (int i = 0; i < ROLES; i++) used = used || t->role[i] == (int)column;
    if (!used) continue; /* other columns may hold text */
    if (f.length == 0 || bx_parse_number(f.text, &end, &row[column]) != BX_NUMBER_OK || end != f.text + f.length)
      return fail_field(t, column, f);
  }
  if (column != t->columns)
    return bx_fail_line(t->r, "%zu column%s, but the lines before have %zu", column, column == 1 ? "" : "s",
                        t->columns);
  double x[3], normal[3];
  for (unsigned i = 0; i < t->soup->n; i++) {
    x[i] = row[t->role[(int)i]];
    if (t->has_normals) normal[i] = row[t->role[NX + (int)i]];
  }
  batten_status st = bx_add_vertex(t->soup, x);
  if (st == BATTEN_OK && t->has_normals) st = bx_add_normal(t->soup, normal);
  if (st == BATTEN_OK && t->has_parameters)
    st = bx_add_parameters(t->soup, (double[2]){row[t->role[U]], row[t->role[V]]});
  if (st == BATTEN_OK && t->has_weights) st = bx_add_weight(t->soup, row[t->role[W]]);
  return st;
}

static batten_status take_line(table *t, const char *line) {
  size_t length = content_length(line), at = 0;
  field f;
  bool empty = !next_field(line, length, ' ', &at, &f);
  if (t->columns == 0 && empty) {
    const char *comment = line + length + strspn(line + length, "#%/ \t");
    if (take_names(t, comment, strlen(comment))) t->names_in_comment = true;
    return BATTEN_OK;
  }
  if (empty) return BATTEN_OK;
  bool has_header = t->named && !t->names_in_comment; /* then text may stand in the other columns */
  if (t->columns == 0 && !has_header && is_header(line, length)) {
    char quote[BX_QUOTE_SIZE];
    if (!take_names(t, line, length))
      return bx_fail_line(t->r, "the header '%s' names no columns x and y; rename them, or remove the line",
                          bx_quote(line, length, quote));
    t->names_in_comment = false;
    return BATTEN_OK;
  }
  batten_status st = t->columns ? BATTEN_OK : begin_numbers(t, line, length);
  return st == BATTEN_OK ? take_numbers(t, line, length) : st;
}

batten_status bx_read_text(bx_reader *r, bx_soup *soup, unsigned n) {
  table t = {.r = r, .soup = soup, .n = n};
  bool end;
  batten_status st = bx_next_line(r, &end);
  while (st == BATTEN_OK && !end) {
    st = take_line(&t, r->text);
    if (st == BATTEN_OK) st = bx_next_line(r, &end);
  }
  return st;
}
