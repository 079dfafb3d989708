/* Networks as IGES 5.3 files: trimmed surfaces.
 *
 * A face is a row of entities, the same for all: so the number of an entity follows from that of its face.
 *
 *   128  surface          110 x sides  lines in parameter space    102  their loop
 *                         126 x sides  the same as curves in space 102  their loop
 *   142  the two loops on the surface            144  the face
 *
 * DEGENERATE has faces with their natural bounds: 128 and 144 alone. The directory, which comes before the
 * parameters, says on which of their lines each entity begins: everything is formatted twice, the first time only to
 * be counted. */
#include "network.h"
#include "number.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { COLUMNS = 72, PARAMETER_COLUMNS = 64, LINES_MAX = 9999999 };

typedef struct iges_file {
  bx_writer *w;
  const bx_brep *brep;
  const bx_product *product;
  bool counting;
  unsigned sides, row; /* of a face; entities of it */
  size_t entity, line; /* that is at work, and lines of parameters so far */
  uint16_t *lines;     /* [entities] of parameters */
  char text[PARAMETER_COLUMNS + 1];
  size_t used;
  bx_square_work work;
  double square[BX_SQUARE_MAX][3];
} iges_file;

/* ---- lines ------------------------------------------------------------------------------------------- */

static unsigned long pointer(size_t entity) { return (unsigned long)(2 * entity + 1); }

static void end_line(iges_file *f) {
  f->line++;
  f->lines[f->entity] = (uint16_t)(f->lines[f->entity] + 1);
  f->text[f->used] = '\0';
  if (!f->counting) bx_print(f->w, "%-64s %7luP%7lu\n", f->text, pointer(f->entity), (unsigned long)f->line);
  f->used = 0;
}

static void put_item(iges_file *f, const char *item, size_t length) {
  if (f->used + length + 1 > PARAMETER_COLUMNS) end_line(f);
  memcpy(f->text + f->used, item, length);
  f->used += length;
  f->text[f->used++] = ',';
}

static void put_whole(iges_file *f, unsigned long value) {
  char text[24];
  put_item(f, text, (size_t)snprintf(text, sizeof text, "%lu", value));
}

static void put_real(iges_file *f, double value) {
  char text[BX_NUMBER_SIZE];
  put_item(f, text, (size_t)bx_format_real(value, text));
}

static void put_reals(iges_file *f, const double *values, size_t count) {
  for (size_t i = 0; i < count; i++) put_real(f, values[i]);
}

static void begin_entity(iges_file *f, unsigned type) {
  f->lines[f->entity] = 0;
  put_whole(f, type);
}

static void end_entity(iges_file *f) {
  f->text[f->used - 1] = ';';
  end_line(f);
  f->entity++;
}

/* ---- entities ---------------------------------------------------------------------------------------- */

static void put_knots(iges_file *f, unsigned degree) {
  for (unsigned i = 0; i < 2 * (degree + 1); i++) put_real(f, i <= degree ? 0 : 1);
}

static void put_ones(iges_file *f, size_t count) {
  for (size_t i = 0; i < count; i++) put_real(f, 1);
}

/* Indices, degrees, and that it is open, polynomial and not periodic. */
static void put_surface(iges_file *f, unsigned degree) {
  const unsigned width = degree + 1, head[] = {degree, degree, degree, degree, 0, 0, 1, 0, 0};
  begin_entity(f, 128);
  for (size_t i = 0; i < sizeof head / sizeof head[0]; i++) put_whole(f, head[i]);
  put_knots(f, degree);
  put_knots(f, degree);
  put_ones(f, (size_t)width * width);
  for (unsigned t = 0; t < width; t++)
    for (unsigned s = 0; s < width; s++) put_reals(f, f->square[s * width + t], 3);
  put_reals(f, (double[4]){0, 1, 0, 1}, 4);
  end_entity(f);
}

static void put_curve(iges_file *f, unsigned degree, const double (*points)[3]) {
  const unsigned head[] = {degree, degree, 0, 0, 1, 0};
  begin_entity(f, 126);
  for (size_t i = 0; i < sizeof head / sizeof head[0]; i++) put_whole(f, head[i]);
  put_knots(f, degree);
  put_ones(f, degree + 1);
  put_reals(f, points[0], 3 * (size_t)(degree + 1));
  put_reals(f, (double[5]){0, 1, 0, 0, 0}, 5);
  end_entity(f);
}

static void put_line(iges_file *f, const double from[2], const double to[2]) {
  begin_entity(f, 110);
  put_reals(f, (double[6]){from[0], from[1], 0, to[0], to[1], 0}, 6);
  end_entity(f);
}

/* Of the sides' entities, which are those just before. */
static void put_loop(iges_file *f) {
  begin_entity(f, 102);
  put_whole(f, f->sides);
  for (unsigned i = 0; i < f->sides; i++) put_whole(f, pointer(f->entity - f->sides + i));
  end_entity(f);
}

/* A face has the normal of its surface, and that points out of the material: surfaces whose own does not are
 * mirrored, which exchanges their parameters. */
static bool is_mirrored(const iges_file *f, const batten_network_patch *patch) {
  const bx_component *c = &f->brep->components[f->brep->component[patch->face]];
  return c->inward != (c->parent != BX_NONE);
}

/* Side of the face in space, in the direction of the loop. */
static unsigned side_curve(iges_file *f, const batten_network_patch *patch, unsigned side, double (*points)[3]) {
  if (f->product->form == BATTEN_CAD_TRIMMED) {
    bool mirrored = is_mirrored(f, patch);
    unsigned degree = bx_patch_curve(f->brep, patch, mirrored ? 2 - side : side, points);
    if (mirrored) bx_curve_reverse(degree, points);
    return degree;
  }
  unsigned n = patch->degree, width = n + 1;
  for (unsigned i = 0; i <= n; i++) {
    unsigned s = side == 0 ? i : side == 1 ? n : side == 2 ? n - i : 0;
    unsigned t = side == 0 ? 0 : side == 1 ? i : side == 2 ? n : n - i;
    memcpy(points[i], f->square[s * width + t], sizeof points[i]);
  }
  return bx_curve_reduce(n, points, bx_brep_rounding(f->brep));
}

static void put_face(iges_file *f, const batten_network_patch *patch, unsigned square) {
  static const double three[3][2] = {{0, 0}, {1, 0}, {0, 1}}, four[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const double(*corners)[2] = f->sides == 3 ? three : four;
  double points[BX_DEGREE_MAX + 1][3];
  bx_corners places;
  size_t first = f->entity;
  bx_corners_of(f->product->form, square, places);
  if (is_mirrored(f, patch))
    for (int i = 0; i < 3; i++) {
      double swap = places[1][i];
      places[1][i] = places[2][i];
      places[2][i] = swap;
    }
  bx_patch_square(&f->work, patch->degree, patch->control_points, (const double(*)[3])places, &f->square[0][0]);
  put_surface(f, patch->degree);
  if (f->sides) {
    for (unsigned i = 0; i < f->sides; i++) put_line(f, corners[i], corners[(i + 1) % f->sides]);
    put_loop(f);
    for (unsigned i = 0; i < f->sides; i++) {
      unsigned degree = side_curve(f, patch, i, points);
      put_curve(f, degree, (const double(*)[3])points);
    }
    put_loop(f);
    begin_entity(f, 142); /* made in no special way; surface, both loops, neither preferred */
    put_whole(f, 0);
    put_whole(f, pointer(first));
    put_whole(f, pointer(first + 1 + f->sides));
    put_whole(f, pointer(first + 2 + 2 * f->sides));
    put_whole(f, 3);
    end_entity(f);
  }
  begin_entity(f, 144); /* an outer bound or the natural one, no inner ones */
  put_whole(f, pointer(first));
  put_whole(f, f->sides ? 1 : 0);
  put_whole(f, 0);
  put_whole(f, f->sides ? pointer(f->entity - 1) : 0);
  end_entity(f);
}

static void put_faces(iges_file *f, bool counting) {
  size_t patches = batten_network_patch_count(f->brep->network);
  f->counting = counting;
  f->entity = f->line = f->used = 0;
  for (size_t p = 0; p < patches && bx_network_goes_on(f->w, p + (counting ? 0 : patches), 2 * patches); p++) {
    batten_network_patch patch = batten_network_get_patch(f->brep->network, p);
    for (unsigned q = 0; q < bx_squares_of(f->product->form); q++) put_face(f, &patch, q);
  }
}

/* ---- directory --------------------------------------------------------------------------------------- */

/* Type of the entity at a place in the row of a face. */
static unsigned type_at(const iges_file *f, unsigned at) {
  if (at == 0) return 128;
  if (at + 1 == f->row) return 144;
  if (at + 2 == f->row) return 142;
  if (at == 1 + f->sides || at + 3 == f->row) return 102;
  return at <= f->sides ? 110 : 126;
}

/* Status: blank, subordinate, use, hierarchy. All but faces belong to another entity; 05 is parameter space. */
static const char *status_at(const iges_file *f, unsigned at) {
  if (at + 1 == f->row) return "00000000";
  return f->sides && at >= 1 && at <= 1 + f->sides ? "00010500" : "00010000";
}

static void put_directory(iges_file *f) {
  size_t entities = f->entity, line = 1;
  unsigned squares = bx_squares_of(f->product->form);
  for (size_t e = 0; e < entities && f->w->status == BATTEN_OK; e++) {
    unsigned at = (unsigned)(e % f->row), type = type_at(f, at);
    batten_network_patch patch = batten_network_get_patch(f->brep->network, e / f->row / squares);
    bool face = type == 144;
    bx_print(f->w, "%8u%8lu%8d%8d%8d%8d%8d%8d%sD%7lu\n", type, (unsigned long)line, 0, 0, 0, 0, 0, 0,
             status_at(f, at), pointer(e));
    bx_print(f->w, "%8u%8d%8d%8u%8d%8s%8s%8s%8luD%7lu\n", type, 0, 0, f->lines[e], 0, "", "", face ? "FACE" : "",
             face ? (unsigned long)patch.face % 100000000ul : 0ul, pointer(e) + 1);
    line += f->lines[e];
  }
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
static unsigned put_global_section(iges_file *f) {
  static const char *const unit_flags[] = {"2", "10", "6", "1"}, *const units[] = {"MM", "CM", "M", "IN"};
  static const char *const ranges[] = {"32", "38", "6", "308", "15"};
  const bx_product *p = f->product;
  global_section g = {.w = f->w};
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
  put_global_real(&g, bx_brep_uncertainty(f->brep));
  put_global_real(&g, f->brep->reach);
  put_global(&g, "", ',');
  put_global(&g, "", ',');
  put_global(&g, "11", ',');
  put_global(&g, "0", ',');
  put_global_text(&g, stamp, ';');
  end_global_line(&g);
  return g.lines;
}

/* All that the sections need to know of each other is known after the first pass. */
static void put_sections(iges_file *f) {
  put_faces(f, true);
  size_t parameters = f->line, entities = f->entity;
  if (parameters > LINES_MAX || 2 * entities > LINES_MAX) {
    bx_writer_fail(
        f->w, batten_fail(f->w->ctx, BATTEN_E_TOO_LARGE, "%s: %zu lines of parameters; IGES numbers %d: write .step",
                          f->w->path, parameters, LINES_MAX));
    return;
  }
  bx_print(f->w, "%-72sS%7u\n", "Smooth surface through a triangle mesh", 1);
  unsigned global = put_global_section(f);
  put_directory(f);
  put_faces(f, false);
  bx_print(f->w, "S%7uG%7uD%7luP%7lu%40sT%7u\n", 1, global, (unsigned long)(2 * entities), (unsigned long)parameters,
           "", 1);
}

void bx_write_iges(bx_writer *w, const bx_brep *brep, const bx_product *product) {
  size_t faces = batten_network_patch_count(brep->network) * bx_squares_of(product->form);
  iges_file *f = batten_alloc(w->ctx, sizeof *f);
  if (!f) {
    bx_writer_fail(w, BATTEN_E_NOMEM);
    return;
  }
  f->w = w;
  f->brep = brep;
  f->product = product;
  f->sides = product->form == BATTEN_CAD_TRIMMED ? 3 : product->form == BATTEN_CAD_QUADS ? 4 : 0;
  f->row = f->sides ? 5 + 2 * f->sides : 2;
  f->lines = batten_alloc_array(w->ctx, faces, f->row * sizeof *f->lines);
  if (f->lines)
    put_sections(f);
  else
    bx_writer_fail(w, BATTEN_E_NOMEM);
  batten_free(w->ctx, f->lines);
  batten_free(w->ctx, f);
}
