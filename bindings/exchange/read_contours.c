/* Contours from text: rows as text_table.c gives them, told apart by lines "contour N", by a column or by blank
 * lines. Which of these it is, the first that is met decides; blank lines mean nothing with the others.
 *
 * Tables of offsets are parted by their stations, and by nothing else. */
#include "contours.h"
#include "format.h"
#include "names.h"
#include "soup.h"
#include "text_table.h"

#include "base/checked.h"

#include <math.h>
#include <string.h>

typedef struct sequences {
  batten_context *ctx;
  bx_table table;
  unsigned n;   /* 2 or 3 */
  size_t count; /* rows */
  double *rows; /* [count][width]: coordinates, then t, then w, as far as there are */
  size_t width, row_capacity;
  size_t *starts; /* [contours] first rows, without a column */
  size_t contours, start_capacity;
  uint32_t *which; /* [count] with a column */
  size_t which_capacity;
  bx_names names;   /* of the column */
  size_t announced; /* by the last line "contour N"; rows that are still to come */
  size_t missing;
  uint64_t head_line;
  bool has_heads;
  bool parted; /* a blank line since the last row */
} sequences;

static void free_sequences(sequences *s) {
  batten_free(s->ctx, s->rows);
  batten_free(s->ctx, s->starts);
  batten_free(s->ctx, s->which);
  bx_names_free(&s->names);
}

/* ---- lines ------------------------------------------------------------------------------------------- */

static batten_status begin_contour(sequences *s) {
  void *starts = s->starts;
  batten_status st = bx_grow(s->ctx, &starts, &s->start_capacity, s->contours + 1, sizeof *s->starts);
  s->starts = starts;
  if (st == BATTEN_OK) s->starts[s->contours++] = s->count;
  return st;
}

/* Of the contour that the last line "contour N" began. */
static batten_status check_complete(sequences *s) {
  if (s->missing == 0) return BATTEN_OK;
  return bx_fail_line(s->table.r, "'contour %zu' in line %llu says how many points follow, but there are %zu",
                      s->announced, (unsigned long long)s->head_line, s->announced - s->missing);
}

static batten_status take_head(sequences *s) {
  bx_reader *r = s->table.r;
  const char *number = s->table.head;
  int64_t count = 0;
  if (s->table.offsets)
    return bx_fail_line(r, "a line 'contour' in a table of offsets, which its stations part; remove it");
  batten_status st = check_complete(s);
  if (st == BATTEN_OK) st = bx_next_integer(r, &number, "the number of points", &count);
  if (st != BATTEN_OK) return st;
  const char *rest = bx_skip_blanks(number);
  if (*rest && *rest != '#' && *rest != '%')
    return bx_fail_line(r, "something follows 'contour %lld'; leave it out, or begin it with #", (long long)count);
  if (count < 1) return bx_fail_line(r, "contour %lld: must be 1 or more points; remove the line", (long long)count);
  if (!s->has_heads && s->count)
    return bx_fail_line(r, "points before the first line 'contour N'; begin each contour so, or none");
  s->has_heads = true;
  s->announced = s->missing = (size_t)count;
  s->head_line = r->line;
  return begin_contour(s);
}

/* Which contour the row belongs to. */
static batten_status place_row(sequences *s) {
  bx_table *t = &s->table;
  if (t->offsets) return BATTEN_OK;
  if (bx_table_has(t, BX_CONTOUR)) {
    if (s->has_heads)
      return bx_fail_line(t->r, "a column 'contour' and lines 'contour N' at once; leave out one of them");
    void *which = s->which;
    batten_status st = bx_grow(s->ctx, &which, &s->which_capacity, s->count + 1, sizeof *s->which);
    s->which = which;
    size_t index = bx_names_find(&s->names, t->contour.text, t->contour.length);
    if (st == BATTEN_OK && index == SIZE_MAX) {
      st = bx_names_add(&s->names, t->contour.text, t->contour.length);
      index = s->contours++;
    }
    if (st == BATTEN_OK) s->which[s->count] = (uint32_t)index;
    return st;
  }
  if (s->has_heads) {
    if (s->missing == 0)
      return bx_fail_line(t->r, "more points than 'contour %zu' in line %llu says", s->announced,
                          (unsigned long long)s->head_line);
    s->missing--;
    return BATTEN_OK;
  }
  bool begins = s->parted || s->count == 0;
  s->parted = false;
  return begins ? begin_contour(s) : BATTEN_OK;
}

static batten_status take_row(sequences *s) {
  const bx_table *t = &s->table;
  batten_status st = place_row(s);
  if (st != BATTEN_OK) return st;
  s->n = bx_table_has(t, BX_Z) ? 3 : 2;
  s->width = s->n + bx_table_has(t, BX_T) + bx_table_has(t, BX_W);
  size_t need;
  void *rows = s->rows;
  if (!batten_mul(s->count + 1, s->width, &need)) return BATTEN_E_NOMEM;
  st = bx_grow(s->ctx, &rows, &s->row_capacity, need, sizeof *s->rows);
  s->rows = rows;
  if (st != BATTEN_OK) return st;
  double *row = s->rows + s->count++ * s->width;
  for (unsigned k = 0; k < s->n; k++) *row++ = t->values[BX_X + k];
  if (bx_table_has(t, BX_T)) *row++ = t->values[BX_T];
  if (bx_table_has(t, BX_W)) *row = t->values[BX_W];
  return BATTEN_OK;
}

static batten_status take_line(sequences *s) {
  bx_line line;
  batten_status st = bx_table_take(&s->table, &line);
  if (st != BATTEN_OK) return st;
  if (line == BX_LINE_HEAD) return take_head(s);
  if (line == BX_LINE_BLANK) s->parted = true;
  return line == BX_LINE_ROW ? take_row(s) : BATTEN_OK;
}

/* ---- airfoils ---------------------------------------------------------------------------------------- */

static bool is_count(double x) { return x >= 2 && x < 1e9 && x == floor(x); }

static void turn_round(double *points, size_t count) {
  for (size_t i = 0; i < count / 2; i++)
    for (int k = 0; k < 2; k++) {
      double *a = &points[2 * i + (size_t)k], *b = &points[2 * (count - 1 - i) + (size_t)k], x = *a;
      *a = *b;
      *b = x;
    }
}

/* Lednicer's tables of airfoils: under the title the numbers of points of the upper and of the lower surface, then
 * these, both from the nose to the tail. They become one contour as in Selig's tables: along the upper surface to the
 * nose, back along the lower one. The counts have to fit, since a first point may also have whole coordinates. */
static batten_status join_surfaces(sequences *s) {
  if (!s->table.may_have_title || s->width != 2 || s->has_heads || s->which || s->table.named) return BATTEN_OK;
  double *rows = s->rows;
  if (!is_count(rows[0]) || !is_count(rows[1])) return BATTEN_OK;
  size_t upper = (size_t)rows[0], lower = (size_t)rows[1];
  if (upper + lower + 1 != s->count) {
    bool stands_alone = s->contours > 1 && s->starts[1] == 1;
    if (!stands_alone) return BATTEN_OK;
    return batten_fail(s->ctx, BATTEN_E_FORMAT,
                       "%s: the first line of numbers says that %zu and %zu points of two surfaces follow, but there "
                       "are %zu; correct or remove it",
                       bx_short_path(s->table.r->path), upper, lower, s->count - 1);
  }
  turn_round(rows + 2, upper);
  double *nose = rows + 2 * upper;
  bool twice = nose[0] == nose[2] && nose[1] == nose[3];
  memmove(rows, rows + 2, 2 * upper * sizeof *rows);
  memmove(rows + 2 * upper, rows + 2 * (upper + 1 + twice), 2 * (lower - twice) * sizeof *rows);
  s->count = upper + lower - twice;
  s->contours = 1;
  return BATTEN_OK;
}

/* ---- from rows to contours --------------------------------------------------------------------------- */

/* Rows of one contour next to each other, in their order: order [count] are the rows, starts [contours + 1]. */
static void sort_rows(const sequences *s, size_t *order, size_t *starts) {
  memset(starts, 0, (s->contours + 1) * sizeof *starts);
  if (!s->which) {
    memcpy(starts, s->starts, s->contours * sizeof *starts);
    starts[s->contours] = s->count;
    for (size_t i = 0; i < s->count; i++) order[i] = i;
    return;
  }
  for (size_t i = 0; i < s->count; i++) starts[s->which[i] + 1]++;
  for (size_t c = 0; c < s->contours; c++) starts[c + 1] += starts[c];
  for (size_t i = 0; i < s->count; i++) order[starts[s->which[i]]++] = i;
  for (size_t c = s->contours; c > 0; c--) starts[c] = starts[c - 1];
  starts[0] = 0;
}

/* A column of the rows, or some, in the order of the contours: [count][columns]. */
static batten_status take_columns(const sequences *s, size_t count, const size_t *order, size_t first, size_t columns,
                                  double **out) {
  *out = batten_alloc_array(s->ctx, count, columns * sizeof **out);
  if (!*out) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++)
    memcpy(*out + i * columns, s->rows + order[i] * s->width + first, columns * sizeof **out);
  return BATTEN_OK;
}

static batten_status take_points(const sequences *s, const size_t *order, batten_contours *out) {
  size_t count = out->starts[out->count];
  if (s->n == 2) return take_columns(s, count, order, 0, 2, &out->points);
  if (s->table.offsets) {
    out->planes = batten_alloc_array(s->ctx, out->count, sizeof *out->planes);
    for (size_t i = 0; out->planes && i < out->count; i++)
      out->planes[i] = bx_station_plane(s->rows[order[out->starts[i]] * s->width]);
    return out->planes ? take_columns(s, count, order, 1, 2, &out->points) : BATTEN_E_NOMEM;
  }
  double *space = NULL;
  batten_status st = take_columns(s, count, order, 0, 3, &space);
  out->points = batten_alloc_array(s->ctx, count, 2 * sizeof *out->points);
  out->planes = batten_alloc_array(s->ctx, s->contours, sizeof *out->planes);
  if (st == BATTEN_OK && (!out->points || !out->planes)) st = BATTEN_E_NOMEM;
  if (st == BATTEN_OK) st = bx_find_planes(s->table.r, s->contours, out->starts, space, out->points, out->planes);
  batten_free(s->ctx, space);
  return st;
}

static batten_status finish(const sequences *s, bool stems, batten_contours *out) {
  const bx_table *t = &s->table;
  batten_contours c = {.count = s->contours};
  batten_status st = BATTEN_E_NOMEM;
  size_t *order = batten_alloc_array(s->ctx, s->count, sizeof *order), column = s->n;
  c.starts = batten_alloc_array(s->ctx, (t->offsets ? s->count : s->contours) + 1, sizeof *c.starts);
  if (!order || !c.starts) goto done;
  st = BATTEN_OK;
  if (t->offsets)
    st = bx_arrange_offsets(t->r, stems, s->count, s->rows, s->width, order, c.starts, &c.count);
  else
    sort_rows(s, order, c.starts);
  if (st == BATTEN_OK) st = take_points(s, order, &c);
  size_t count = st == BATTEN_OK ? c.starts[c.count] : 0;
  if (st == BATTEN_OK && bx_table_has(t, BX_T)) st = take_columns(s, count, order, column++, 1, &c.parameters);
  if (st == BATTEN_OK && bx_table_has(t, BX_W)) st = take_columns(s, count, order, column, 1, &c.weights);
done:
  batten_free(s->ctx, order);
  if (st == BATTEN_OK)
    *out = c;
  else
    batten_contours_free(s->ctx, &c);
  return st;
}

batten_status bx_parse_contours(bx_reader *r, bool stems, batten_contours *out, bool *offsets) {
  sequences s = {.ctx = r->ctx,
                 .names = {.ctx = r->ctx},
                 .table = {.r = r,
                           .wanted = 1u << BX_X | 1u << BX_Y | 1u << BX_Z | 1u << BX_W | 1u << BX_T |
                                     1u << BX_CONTOUR | 1u << BX_STATION | 1u << BX_HALF_BREADTH | 1u << BX_WATERLINE,
                           .names = "x y z t w contour",
                           .may_have_title = bx_has_extension(r->path, "dat")}};
  bool end;
  batten_status st = bx_next_line(r, &end);
  while (st == BATTEN_OK && !end) {
    st = take_line(&s);
    if (st == BATTEN_OK) st = bx_next_line(r, &end);
  }
  if (st == BATTEN_OK) st = check_complete(&s);
  if (st == BATTEN_OK && s.count == 0)
    st = batten_fail(r->ctx, BATTEN_E_FORMAT, "%s: no points in the file", bx_short_path(r->path));
  if (st == BATTEN_OK) st = join_surfaces(&s);
  if (st == BATTEN_OK) st = finish(&s, stems, out);
  *offsets = s.table.offsets;
  free_sequences(&s);
  return st;
}

batten_status bx_read_contours_from(bx_reader *r, batten_contours *out) {
  bool offsets;
  return bx_parse_contours(r, false, out, &offsets);
}

batten_status batten_read_contours(batten_context *ctx, const char *path, batten_contours *out) {
  bx_reader r;
  bool gz;
  batten_status st = bx_check_pointers(ctx, path, out, "out");
  if (st == BATTEN_OK && bx_format_of(path, &gz) != BX_TEXT)
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "%s: contours are read from .txt .xyz .csv .tsv .asc .dat, each also with .gz; rename the file",
                     bx_short_path(path));
  if (st == BATTEN_OK) st = bx_open(&r, ctx, path);
  if (st != BATTEN_OK) return st;
  st = bx_read_contours_from(&r, out);
  bx_close(&r);
  return st;
}

void batten_contours_free(batten_context *ctx, batten_contours *contours) {
  if (!contours) return;
  batten_free(ctx, contours->starts);
  batten_free(ctx, contours->points);
  batten_free(ctx, contours->parameters);
  batten_free(ctx, contours->weights);
  batten_free(ctx, contours->planes);
  *contours = (batten_contours){0};
}
