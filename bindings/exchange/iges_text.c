/* IGES 5.3 files: see iges_text.h.
 *
 * The directory, which comes before the parameters, says on which of their lines each entity begins: everything is
 * formatted twice, the first time to count lines and write the directory. */
#include "iges_text.h"

#include "number.h"

#include <stdio.h>
#include <string.h>

enum { COLUMNS = 72, LINES_MAX = 9999999 };

/* ---- entities ---------------------------------------------------------------------------------------- */

unsigned long iges_pointer(size_t entity) { return (unsigned long)(2 * entity + 1); }

static void end_line(iges_file *f) {
  f->line++;
  f->text[f->used] = '\0';
  if (!f->directory) bx_print(f->w, "%-64s %7luP%7lu\n", f->text, iges_pointer(f->entity), (unsigned long)f->line);
  f->used = 0;
}

static void put_item(iges_file *f, const char *item, size_t length) {
  if (f->used + length + 1 > IGES_PARAMETER_COLUMNS) end_line(f);
  memcpy(f->text + f->used, item, length);
  f->used += length;
  f->text[f->used++] = ',';
}

void iges_put_whole(iges_file *f, unsigned long value) {
  char text[24];
  put_item(f, text, (size_t)snprintf(text, sizeof text, "%lu", value));
}

void iges_put_real(iges_file *f, double value) {
  char text[BX_NUMBER_SIZE];
  put_item(f, text, (size_t)bx_format_real(value, text));
}

void iges_put_reals(iges_file *f, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) iges_put_real(f, values[i]);
}

void iges_begin(iges_file *f, unsigned type, iges_role role, const char *label, unsigned long number) {
  f->type = type;
  f->role = role;
  f->label = label;
  f->number = number;
  f->first = f->line;
  iges_put_whole(f, type);
}

/* Type, line, and status: blank, subordinate, use (05 is parameter space), hierarchy. */
static void put_directory(iges_file *f) {
  static const char *const status[] = {"00000000", "00010000", "00010500"};
  bx_print(f->w, "%8u%8lu%8d%8d%8d%8d%8d%8d%sD%7lu\n", f->type, (unsigned long)f->first + 1, 0, 0, 0, 0, 0, 0,
           status[f->role], iges_pointer(f->entity));
  bx_print(f->w, "%8u%8d%8d%8lu%8d%8s%8s%8s%8luD%7lu\n", f->type, 0, 0, (unsigned long)(f->line - f->first), 0, "",
           "", f->label, f->number % 100000000ul, iges_pointer(f->entity) + 1);
}

void iges_end(iges_file *f) {
  f->text[f->used - 1] = ';';
  end_line(f);
  if (f->directory) put_directory(f);
  f->entity++;
}

/* ---- B-splines --------------------------------------------------------------------------------------- */

static void put_ones(iges_file *f, size_t count) {
  for (size_t i = 0; i < count; i++) iges_put_real(f, 1);
}

/* Upper indices, degrees; closed, polynomial, not periodic. The first parameter runs faster. */
void iges_put_surface(iges_file *f, const batten_surface_form *form, const bool closed[2]) {
  size_t rows = form->knot_count[0] - form->degree[0] - 1, columns = form->knot_count[1] - form->degree[1] - 1;
  const size_t head[] = {rows - 1, columns - 1, form->degree[0], form->degree[1], closed[0], closed[1], 1, 0, 0};
  iges_begin(f, 128, IGES_PART, "", 0);
  for (size_t i = 0; i < sizeof head / sizeof head[0]; i++) iges_put_whole(f, (unsigned long)head[i]);
  for (int i = 0; i < 2; i++) iges_put_reals(f, form->knots[i], form->knot_count[i]);
  put_ones(f, rows * columns);
  for (size_t j = 0; j < columns; j++)
    for (size_t i = 0; i < rows; i++) iges_put_reals(f, form->control_points + 3 * (i * columns + j), 3);
  for (int i = 0; i < 2; i++) {
    iges_put_real(f, form->knots[i][0]);
    iges_put_real(f, form->knots[i][form->knot_count[i] - 1]);
  }
  iges_end(f);
}

/* Upper index, degree; planar, closed, polynomial, not periodic; the ends of the parameters, the normal. */
void iges_put_curve(iges_file *f, const iges_curve *c) {
  static const double none[3] = {0};
  const size_t count = c->knot_count - c->degree - 1;
  const size_t head[] = {count - 1, c->degree, c->normal != NULL, c->closed, 1, 0};
  iges_begin(f, 126, c->role, c->label, c->number);
  for (size_t i = 0; i < sizeof head / sizeof head[0]; i++) iges_put_whole(f, (unsigned long)head[i]);
  iges_put_reals(f, c->knots, c->knot_count);
  put_ones(f, count);
  iges_put_reals(f, c->points, 3 * count);
  iges_put_real(f, c->knots[0]);
  iges_put_real(f, c->knots[c->knot_count - 1]);
  iges_put_reals(f, c->normal ? c->normal : none, 3);
  iges_end(f);
}

/* ---- start and global sections ----------------------------------------------------------------------- */

typedef struct global_section {
  bx_writer *w;
  unsigned lines;
  size_t used;
  char text[COLUMNS + 1];
} global_section;

static void end_global_line(global_section *g) {
  g->text[g->used] = '\0';
  bx_print(g->w, "%-72sG%7u\n", g->text, ++g->lines);
  g->used = 0;
}

/* Numbers may not cross the end of a line; texts that are longer than one have to. */
static void put_global(global_section *g, const char *item, char delimiter) {
  size_t length = strlen(item);
  if (g->used + length + 1 > COLUMNS && length < COLUMNS) end_global_line(g);
  for (size_t i = 0; i <= length; i++) {
    if (g->used == COLUMNS) end_global_line(g);
    g->text[g->used++] = i < length ? item[i] : delimiter;
  }
}

/* "4Hname"; what is no ASCII becomes an underscore. */
static void put_global_text(global_section *g, const char *text, char delimiter) {
  char item[300];
  size_t at = (size_t)snprintf(item, sizeof item, "%zuH", strlen(text));
  for (size_t i = 0; text[i] && at + 1 < sizeof item; i++)
    item[at++] = text[i] >= ' ' && (unsigned char)text[i] < 0x7f ? text[i] : '_';
  item[at] = '\0';
  put_global(g, item, delimiter);
}

static void put_global_real(global_section *g, double value) {
  char text[BX_NUMBER_SIZE];
  bx_format_real(value, text);
  put_global(g, text, ',');
}

/* Delimiters, names and versions, ranges of numbers, scale, unit, line widths, date, accuracy, size, authors, version
 * of the standard (11: 5.3), date of change. Returns the number of lines. */
static unsigned put_global_section(bx_writer *w, const bx_product *p, double size, double reach) {
  static const char *const unit_flags[] = {"2", "10", "6", "1"}, *const units[] = {"MM", "CM", "M", "IN"};
  static const char *const ranges[] = {"32", "38", "6", "308", "15"};
  global_section g = {.w = w};
  char stamp[16], program[40];
  const char *t = p->time_stamp; /* 2026-11-22T10:00:00 as 20261122.100000 */
  snprintf(stamp, sizeof stamp, "%.4s%.2s%.2s.%.2s%.2s%.2s", t, t + 5, t + 8, t + 11, t + 14, t + 17);
  snprintf(program, sizeof program, "batten %s", batten_version());
  put_global(&g, "1H,,1H;", ',');
  put_global_text(&g, p->name, ',');
  put_global_text(&g, p->name, ',');
  put_global_text(&g, program, ',');
  put_global_text(&g, program, ',');
  for (int i = 0; i < 5; i++) put_global(&g, ranges[i], ',');
  put_global_text(&g, p->name, ',');
  put_global(&g, "1.", ',');
  put_global(&g, unit_flags[p->unit], ',');
  put_global_text(&g, units[p->unit], ',');
  put_global(&g, "1", ',');
  put_global(&g, "0.1", ',');
  put_global_text(&g, stamp, ',');
  put_global_real(&g, bx_cad_uncertainty(size));
  put_global_real(&g, reach);
  put_global(&g, "", ',');
  put_global(&g, "", ',');
  put_global(&g, "11", ',');
  put_global(&g, "0", ',');
  put_global_text(&g, stamp, ';');
  end_global_line(&g);
  return g.lines;
}

/* ---- the file ---------------------------------------------------------------------------------------- */

static void run_pass(iges_file *f, bool directory, iges_put *put, void *user) {
  f->directory = directory;
  f->entity = f->line = f->used = 0;
  put(f, user);
}

void bx_write_iges(bx_writer *w, const bx_product *product, double size, double reach, iges_put *put, void *user) {
  iges_file f = {.w = w};
  /* the text has to fit its line; descriptions do */
  bx_print(w, "%-72sS%7u\n", product->description, 1);
  unsigned global = put_global_section(w, product, size, reach);
  run_pass(&f, true, put, user);
  if (w->status == BATTEN_OK && (f.line > LINES_MAX || 2 * f.entity > LINES_MAX)) {
    bx_writer_fail(
        w, batten_fail(w->ctx, BATTEN_E_TOO_LARGE, "%s: %zu lines of parameters; IGES numbers %d: write .step",
                       w->path, f.line, LINES_MAX));
    return;
  }
  run_pass(&f, false, put, user);
  bx_print(w, "S%7uG%7uD%7luP%7lu%40sT%7u\n", 1, global, (unsigned long)(2 * f.entity), (unsigned long)f.line, "", 1);
}
