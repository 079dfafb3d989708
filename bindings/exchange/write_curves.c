/* Planar curves by the file's extension; what the formats have of them is told in exchange.h. */
#include "curves.h"
#include "format.h"

#include "base/checked.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

batten_write_curves_options batten_write_curves_options_default(void) {
  return (batten_write_curves_options){.struct_size = sizeof(batten_write_curves_options)};
}

static bx_product product_of(const batten_write_curves_options *o) {
  return (bx_product){.unit = o->unit,
                      .schema = o->schema,
                      .name = o->name,
                      .time_stamp = o->time_stamp,
                      .description = "B-spline curves"};
}

static batten_status check_options(batten_context *ctx, size_t count, const batten_write_curves_options *o) {
  bx_product product = product_of(o);
  batten_status st = batten_check_struct(ctx, "batten_write_curves_options", o->struct_size, sizeof *o);
  if (st == BATTEN_OK) st = bx_check_product(ctx, &product);
  if (st == BATTEN_OK) st = bx_check_tolerance(ctx, o->tolerance);
  for (size_t i = 0; st == BATTEN_OK && o->planes && i < count; i++) {
    const char *fault = bx_plane_fault(&o->planes[i]);
    if (fault) st = batten_fail(ctx, BATTEN_E_INVALID, "opt.planes[%zu].%s", i, fault);
  }
  return st;
}

static batten_status check_curves(batten_context *ctx, size_t count, const batten_curve *const *curves) {
  if (count == 0) return batten_fail(ctx, BATTEN_E_INVALID, "count: 0; must be 1 or more");
  for (size_t i = 0; i < count; i++)
    if (!curves[i]) return batten_fail(ctx, BATTEN_E_INVALID, "curves[%zu]: NULL", i);
  return BATTEN_OK;
}

/* ---- planes ------------------------------------------------------------------------------------------ */

const char *bx_plane_fault(const batten_plane *plane) {
  const double *x = plane->axes[0], *y = plane->axes[1], near = 1e-9; /* what a file with ten digits keeps */
  if (batten_first_nonfinite(3, plane->origin) < 3) return "origin: not finite; give the place of (0, 0) in space";
  if (batten_first_nonfinite(6, x) < 6) return "axes: not finite; give two directions of length 1";
  double xx = x[0] * x[0] + x[1] * x[1] + x[2] * x[2], yy = y[0] * y[0] + y[1] * y[1] + y[2] * y[2];
  double xy = x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  if (!(fabs(xx - 1) <= near && fabs(yy - 1) <= near)) return "axes: not of length 1; divide by their lengths";
  return fabs(xy) <= near ? NULL : "axes: not at a right angle; turn one of them";
}

bool bx_plane_is_horizontal(const batten_plane *plane) {
  static const double zero[2] = {0, 0}, axes[2][3] = {{1, 0, 0}, {0, 1, 0}};
  return !memcmp(plane->origin, zero, sizeof zero) && !memcmp(plane->axes, axes, sizeof axes);
}

void bx_curve_place(const bx_curve_set *set, size_t i, const double point[2], double out[3]) {
  if (!set->planes) {
    memcpy(out, (double[3]){point[0], point[1], 0}, 3 * sizeof *out);
    return;
  }
  const batten_plane *p = &set->planes[i];
  for (int k = 0; k < 3; k++) out[k] = p->origin[k] + (point[0] * p->axes[0][k] + point[1] * p->axes[1][k]);
}

/* ---- measures ---------------------------------------------------------------------------------------- */

typedef struct box {
  double lower[3], upper[3];
} box;

static const box nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void add_point(box *b, const double *point, int n) {
  for (int k = 0; k < n; k++) {
    b->lower[k] = fmin(b->lower[k], point[k]);
    b->upper[k] = fmax(b->upper[k], point[k]);
  }
}

static double diagonal(const box *b, int n) {
  double side[3] = {0};
  for (int k = 0; k < n; k++) side[k] = b->upper[k] - b->lower[k];
  return hypot(hypot(side[0], side[1]), side[2]);
}

/* Of the control points; *least: the smallest curve. */
static bx_curve_set measure(size_t count, const batten_curve *const *curves, const batten_plane *planes,
                            size_t *least) {
  bx_curve_set set = {.count = count, .curves = curves, .planes = planes};
  box plane = nothing, space = nothing;
  double smallest = INFINITY;
  *least = 0;
  for (size_t i = 0; i < count; i++) {
    batten_curve_form form = batten_curve_get(curves[i]);
    size_t points = bx_curve_points(&form);
    box own = nothing;
    for (size_t k = 0; k < points; k++) {
      double place[3];
      bx_curve_place(&set, i, form.control_points + 2 * k, place);
      add_point(&own, form.control_points + 2 * k, 2);
      add_point(&space, place, 3);
    }
    add_point(&plane, own.lower, 2);
    add_point(&plane, own.upper, 2);
    double extent = diagonal(&own, 2);
    set.extent = fmax(set.extent, extent);
    if (extent < smallest) {
      smallest = extent;
      *least = i;
    }
    if (points > set.point_max) set.point_max = points;
  }
  memcpy(set.lower, plane.lower, sizeof set.lower);
  memcpy(set.upper, plane.upper, sizeof set.upper);
  set.size = diagonal(&space, 3);
  for (int k = 0; k < 3; k++) set.reach = fmax(set.reach, fmax(fabs(space.lower[k]), fabs(space.upper[k])));
  return set;
}

/* A curve that is a point is no edge. */
static batten_status check_cad(batten_context *ctx, const bx_curve_set *set, size_t least, batten_length_unit unit) {
  char name[40];
  bx_curve_set one = measure(1, set->curves + least, set->planes ? set->planes + least : NULL, &(size_t){0});
  snprintf(name, sizeof name, "curves[%zu]", least);
  batten_status st = bx_check_cad_size(ctx, name, one.size, unit);
  return st == BATTEN_OK ? bx_check_cad_size(ctx, "curves", set->size, unit) : st;
}

/* ---- the file ---------------------------------------------------------------------------------------- */

static void write_format(bx_writer *w, const bx_curve_set *set, const bx_curve_samples *samples,
                         const batten_write_curves_options *o, bx_format format) {
  char name[BX_PRODUCT_NAME];
  bx_product product = product_of(o);
  bx_complete_product(&product, w->path, name);
  switch (format) {
    case BX_STEP:
      bx_write_step_curves(w, set, &product);
      break;
    case BX_IGES:
      bx_write_iges_curves(w, set, &product);
      break;
    case BX_SVG:
      bx_write_svg_curves(w, set, o->unit, o->tolerance);
      break;
    case BX_VTU:
      bx_write_vtu_curves(w, set);
      break;
    case BX_VTP:
      bx_write_vtp_curves(w, set, samples);
      break;
    case BX_VTK:
      bx_write_vtk_curves(w, set, samples);
      break;
    case BX_TEXT:
      bx_write_csv_curves(w, set, samples);
      break;
    default:
      bx_write_json_curves(w, set);
  }
}

static bool is_known(bx_format format, const char *path) {
  static const bx_format known[] = {BX_JSON, BX_STEP, BX_IGES, BX_SVG, BX_VTU, BX_VTP, BX_VTK};
  for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
    if (format == known[i]) return true;
  return format == BX_TEXT && bx_has_extension(path, "csv");
}

batten_status batten_write_curves(batten_context *ctx, size_t count, const batten_curve *const *curves,
                                  const batten_write_curves_options *opt, const char *path) {
  batten_write_curves_options o = opt ? *opt : batten_write_curves_options_default();
  bx_curve_samples samples = {0};
  bx_writer w;
  size_t least;
  batten_status st = bx_check_pointers(ctx, path, curves, "curves");
  if (st == BATTEN_OK) st = check_curves(ctx, count, curves);
  if (st == BATTEN_OK) st = check_options(ctx, count, &o);
  if (st != BATTEN_OK) return st;
  bx_format format = bx_format_of(path, NULL);
  if (!is_known(format, path))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "%s: curves are written as .json .step .stp .iges .igs .svg .vtu .vtp .vtk .csv; rename the "
                       "file",
                       bx_short_path(path));
  bx_curve_set set = measure(count, curves, o.planes, &least);
  if (!(o.tolerance > 0)) o.tolerance = set.extent > 0 ? 1e-4 * set.extent : 1; /* all are points */
  if (format == BX_STEP || format == BX_IGES) st = check_cad(ctx, &set, least, o.unit);
  if (st == BATTEN_OK && (format == BX_VTP || format == BX_VTK || format == BX_TEXT))
    st = bx_sample_curves(ctx, &set, o.tolerance, &samples);
  if (st == BATTEN_OK) st = bx_create(&w, ctx, path);
  if (st == BATTEN_OK) {
    write_format(&w, &set, &samples, &o, format);
    st = bx_commit(&w);
  }
  bx_free_samples(ctx, &samples);
  return st;
}
