/* Outlines of plane solids as SVG, text, OBJ lines and VTK polylines. */
#include "format.h"
#include "svg.h"
#include "vtk.h"

#include <math.h>

typedef struct box {
  double lower[2], upper[2];
} box;

static box bound(const batten_outline *outline) {
  box b = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t count;
    const double *x = batten_outline_loop(outline, i, &count, NULL);
    for (size_t k = 0; k < 2 * count; k++) {
      b.lower[k % 2] = fmin(b.lower[k % 2], x[k]);
      b.upper[k % 2] = fmax(b.upper[k % 2], x[k]);
    }
  }
  if (!(b.lower[0] <= b.upper[0])) b = (box){{0, 0}, {0, 0}};
  return b;
}

/* One path with the solid filled and holes left open. The view box is the caller's unit. */
static void write_svg(bx_writer *w, const batten_outline *outline) {
  box b = bound(outline);
  double size = bx_svg_begin(w, b.lower, b.upper, NULL, 1);
  bx_put_text(w, "  <path " BX_SVG_UPWARDS
                 " fill=\"#c9d8e8\" fill-rule=\"evenodd\" stroke=\"#1f3a5f\" "
                 "stroke-width=\"");
  bx_put_number(w, size / 400);
  bx_put_text(w, "\" stroke-linejoin=\"round\" d=\"");
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t count;
    int closed;
    const double *x = batten_outline_loop(outline, i, &count, &closed);
    for (size_t k = 0; k < count; k++) {
      bx_put_text(w, k ? "\nL " : "\nM ");
      bx_put_numbers(w, x + 2 * k, 2);
    }
    if (closed) bx_put_text(w, " Z");
  }
  bx_put_text(w, "\"/>\n");
  bx_svg_end(w);
}

/* Loops with a blank line between; a closed one ends with its first corner again. */
static void write_text(bx_writer *w, const batten_outline *outline, bool commas) {
  if (commas) bx_put_text(w, "x,y\n");
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t count;
    int closed;
    const double *x = batten_outline_loop(outline, i, &count, &closed);
    if (i) bx_put_text(w, "\n");
    for (size_t k = 0; k < count + (closed ? 1 : 0); k++) {
      bx_put_number(w, x[2 * (k % count)]);
      bx_put_text(w, commas ? "," : " ");
      bx_put_number(w, x[2 * (k % count) + 1]);
      bx_put_text(w, "\n");
    }
  }
}

static void write_obj(bx_writer *w, const batten_outline *outline) {
  size_t loops = batten_outline_loop_count(outline), first = 1, count;
  int closed;
  bx_print(w, "# batten %s\n", batten_version());
  for (size_t i = 0; i < loops; i++) {
    const double *x = batten_outline_loop(outline, i, &count, &closed);
    for (size_t k = 0; k < count; k++) {
      bx_put_text(w, "v ");
      bx_put_numbers(w, x + 2 * k, 2);
      bx_put_text(w, " 0\n");
    }
  }
  for (size_t i = 0; i < loops; i++, first += count) {
    batten_outline_loop(outline, i, &count, &closed);
    bx_put_text(w, "l");
    for (size_t k = 0; k < count; k++) bx_print(w, " %zu", first + k);
    if (closed) bx_print(w, " %zu", first);
    bx_put_text(w, "\n");
  }
}

/* Corners of all loops, and the entries of the lines: a closed loop comes back to its first corner. */
static void count_outline(const batten_outline *outline, size_t *points, size_t *entries) {
  *points = *entries = 0;
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t count;
    int closed;
    batten_outline_loop(outline, i, &count, &closed);
    *points += count;
    *entries += count + (closed ? 1 : 0);
  }
}

static void put_outline_points(vtk_file *v, const batten_outline *outline, size_t points) {
  bx_put_u64(v->w, (uint64_t)points * 3 * sizeof(double));
  for (size_t i = 0; i < batten_outline_loop_count(outline); i++) {
    size_t count;
    int closed;
    const double *x = batten_outline_loop(outline, i, &count, &closed);
    for (size_t k = 0; k < count; k++) {
      bx_put_f64(v->w, x[2 * k]);
      bx_put_f64(v->w, x[2 * k + 1]);
      bx_put_f64(v->w, 0);
    }
  }
}

static void put_outline_lines(vtk_file *v, const batten_outline *outline, size_t entries) {
  size_t loops = batten_outline_loop_count(outline), first = 0, count;
  int closed;
  bx_put_u64(v->w, (uint64_t)entries * sizeof(int64_t));
  for (size_t i = 0; i < loops; i++, first += count) {
    batten_outline_loop(outline, i, &count, &closed);
    for (size_t k = 0; k < count; k++) bx_put_u64(v->w, first + k);
    if (closed) bx_put_u64(v->w, first);
  }
  bx_put_u64(v->w, (uint64_t)loops * sizeof(int64_t));
  uint64_t end_of_line = 0;
  for (size_t i = 0; i < loops; i++) {
    batten_outline_loop(outline, i, &count, &closed);
    end_of_line += count + (closed ? 1 : 0);
    bx_put_u64(v->w, end_of_line);
  }
}

static void write_vtp(bx_writer *w, const batten_outline *outline) {
  vtk_file v = {.w = w};
  size_t loops = batten_outline_loop_count(outline), points, entries;
  count_outline(outline, &points, &entries);
  vtk_begin(&v, "PolyData");
  bx_print(w,
           "    <Piece NumberOfPoints=\"%zu\" NumberOfVerts=\"0\" NumberOfLines=\"%zu\" NumberOfStrips=\"0\" "
           "NumberOfPolys=\"0\">\n      <Points>\n",
           points, loops);
  vtk_declare(&v, "Float64", "Points", 3, points, sizeof(double));
  bx_put_text(w, "      </Points>\n      <Lines>\n");
  vtk_declare(&v, "Int64", "connectivity", 1, entries, sizeof(int64_t));
  vtk_declare(&v, "Int64", "offsets", 1, loops, sizeof(int64_t));
  bx_put_text(w, "      </Lines>\n");
  vtk_begin_appended(&v, "PolyData");
  put_outline_points(&v, outline, points);
  put_outline_lines(&v, outline, entries);
  vtk_end(&v);
}

batten_status batten_write_outline(batten_context *ctx, const batten_outline *outline, const char *path) {
  batten_status st = bx_check_pointers(ctx, path, outline, "outline");
  if (st != BATTEN_OK) return st;
  bx_format format = bx_format_of(path, NULL);
  if (format != BX_SVG && format != BX_TEXT && format != BX_VTP && format != BX_OBJ)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: outlines are written as .svg .csv .xyz .txt .vtp .obj; rename the "
                       "file",
                       bx_short_path(path));
  bx_writer w;
  st = bx_create(&w, ctx, path);
  if (st != BATTEN_OK) return st;
  switch (format) {
    case BX_SVG:
      write_svg(&w, outline);
      break;
    case BX_VTP:
      write_vtp(&w, outline);
      break;
    case BX_OBJ:
      write_obj(&w, outline);
      break;
    default:
      write_text(&w, outline, bx_has_extension(path, "csv"));
  }
  return bx_commit(&w);
}
