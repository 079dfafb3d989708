/* batten solid: points to a solid, its surface, a picture, figures.
 *
 * Phases: read, fit, surface, measures and fields, write. All outputs are checked before the first and appear
 * after the last, or not at all. */
#include "cli.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "solid.h"

/* ---- command line -------------------------------------------------------------------------------- */

enum {
  OPT_PICTURE = CLI_KEY_OWN,
  OPT_SAVE,
  OPT_CARRIER,
  OPT_ORDER,
  OPT_SMOOTHING,
  OPT_MERGE,
  OPT_ORIENTATION,
  OPT_ORIENT_DATA,
  OPT_ORIENT_METHOD,
  OPT_METHOD,
  OPT_LOO, /* last of those that tell how to fit */
  OPT_CELL,
  OPT_BOX,
  OPT_COLOR,
  OPT_DOTS
};

static const cli_option table[] = {
    {"output", 'o', "FILE",
     "surface, by extension: .ply .obj .stl .off .vtp .vtu .vtk; outline of plane points:\n"
     ".svg .csv .xyz .txt .vtp .obj; may be given more than once"},
    {"picture", OPT_PICTURE, "FILE", "shaded view .png, of plane points .png or .svg"},
    CLI_OPTION_REPORT,
    {"save", OPT_SAVE, "FILE", "the solid itself, as JSON that batten reads back to the same bits"},
    {"carrier", OPT_CARRIER, "WHAT",
     "auto, ball, ellipsoid (fitted to the points), none, or a carrier FILE.json;\n"
     "default auto"},
    {"order", OPT_ORDER, "M", "order of the spline's energy, 2 to 4; default 2"},
    {"smoothing", OPT_SMOOTHING, "RHO", "0 passes through the points, larger is smoother; default 0"},
    {"merge-radius", OPT_MERGE, "R", "points closer than this become one; default 0: equal points only"},
    {"orientation", OPT_ORIENTATION, "HOW",
     "auto (where the check of the sign asks for it), never, given (normals\n"
     "of the file), estimate; default auto"},
    {"orient-data", OPT_ORIENT_DATA, "WHAT", "orientation enters as auto, gradients or pairs; default auto"},
    {"orient-method", OPT_ORIENT_METHOD, "HOW", "estimated by auto, energy or planes; default auto"},
    {"method", OPT_METHOD, "NAME", "linear solver: auto, cholesky, mixed, ldl or qr; default auto"},
    {"cell", OPT_CELL, "LENGTH",
     "edge length of the mesh; default from the points' spacing, but at most\n1/120 of the diagonal of their box"},
    {"box", OPT_BOX, "X0,Y0[,Z0],X1,...", "cut the surface at this box; default: the points' box grown by 25 %"},
    CLI_OPTION_MEMORY,
    {"loo", OPT_LOO, "N", "leave-one-out errors of N points, all or none; default 256"},
    CLI_OPTION_THREADS,
    CLI_OPTION_VIEW,
    CLI_OPTION_UP,
    {"color", OPT_COLOR, "WHAT", "colour the picture by none, gradient, mean or gauss (curvature); default none"},
    {"dots", OPT_DOTS, NULL, "draw the points in the picture"},
    CLI_OPTION_SIZE,
    CLI_OPTION_TITLE,
    CLI_OPTION_QUIET,
    CLI_OPTION_HELP,
    {0},
};

static void print_help(void) {
  printf(
      "usage: batten solid POINTS [OPTIONS]\n\n"
      "Makes the smooth solid whose surface passes through scattered points. POINTS: .xyz .txt .csv .ply .obj .off\n"
      ".stl, also with .gz; two columns are a plane solid; normals are used where they are needed.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: a ball from 200 points, with mesh, picture and figures\n\n"
      "  awk 'BEGIN { for (i = 0; i < 200; i++) { z = 1 - (2 * i + 1) / 200; r = sqrt(1 - z * z); a = 2.39996 * i;\n"
      "    print r * cos(a), r * sin(a), z } }' > ball.xyz\n"
      "  batten solid ball.xyz -o ball.ply --picture ball.png --report ball.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

/* One option into the request; false after a line on stderr. */
static bool take_fit_option(solid_request *q, int key, const char *v) {
  static const char *const orientations[] = {"auto", "never", "given", "estimate", NULL};
  static const char *const orient_data[] = {"auto", "gradients", "pairs", NULL};
  static const char *const orient_methods[] = {"auto", "energy", "planes", NULL};
  static const char *const methods[] = {"auto", "cholesky", "mixed", "ldl", "qr", NULL};
  int word = 0;
  size_t count = 0;
  bool ok = true;
  switch (key) {
    case OPT_CARRIER:
      q->carrier = v;
      break;
    case OPT_ORDER:
      ok = cli_parse_count("--order", v, 1, 4, &count);
      q->fit.spline.m = (unsigned)count;
      break;
    case OPT_SMOOTHING:
      ok = cli_parse_number("--smoothing", v, 0, INFINITY, &q->fit.spline.smoothing);
      break;
    case OPT_MERGE:
      ok = cli_parse_number("--merge-radius", v, 0, INFINITY, &q->fit.merge_radius);
      break;
    case OPT_ORIENTATION:
      ok = cli_parse_word("--orientation", v, orientations, &word);
      q->fit.orientation = (batten_orientation)word;
      break;
    case OPT_ORIENT_DATA:
      ok = cli_parse_word("--orient-data", v, orient_data, &word);
      q->fit.orient_data = (batten_orient_data)word;
      break;
    case OPT_ORIENT_METHOD:
      ok = cli_parse_word("--orient-method", v, orient_methods, &word);
      q->fit.orient_method = (batten_orient_method)word;
      break;
    case OPT_METHOD:
      ok = cli_parse_word("--method", v, methods, &word);
      q->fit.spline.saddle.method = (batten_saddle_method)word;
      break;
    default:
      if (strcmp(v, "all") == 0)
        q->fit.spline.loo_samples = SIZE_MAX;
      else if (strcmp(v, "none") == 0)
        q->fit.spline.loo_samples = 0;
      else
        ok = cli_parse_count("--loo", v, 0, SIZE_MAX - 1, &q->fit.spline.loo_samples);
  }
  return ok;
}

static bool take_view_option(solid_request *q, int key, const char *v) {
  static const char *const colors[] = {"none", "gradient", "mean", "gauss", NULL};
  int word = 0;
  switch (key) {
    case OPT_CELL:
      return cli_parse_number("--cell", v, 1e-300, INFINITY, &q->surface.cell);
    case OPT_BOX:
      q->box = v;
      return true;
    case OPT_COLOR:
      if (!cli_parse_word("--color", v, colors, &word)) return false;
      q->color = (solid_color)word;
      return true;
    case OPT_DOTS:
      q->dots = true;
      return true;
    default:
      return cli_take_picture(&q->picture, key, v);
  }
}

static bool take(cli_request *common, int key, const char *v) {
  solid_request *q = (solid_request *)common;
  switch (key) {
    case 'o':
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_SURFACE, v);
    case OPT_PICTURE:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_PICTURE, v);
    case OPT_SAVE:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_SOLID, v);
    default:
      return key >= CLI_KEY_OWN && key <= OPT_LOO ? take_fit_option(q, key, v) : take_view_option(q, key, v);
  }
}

/* ---- phases -------------------------------------------------------------------------------------- */

static batten_status read_points(solid_work *w) {
  double start = batten_now();
  batten_read_points_options o = batten_read_points_options_default();
  batten_status st = batten_read_points(w->run.ctx, w->request->common.input, &o, &w->cloud);
  w->time_read_s = batten_now() - start;
  return st;
}

static int count_numbers(const char *text) {
  int n = 1;
  for (; *text; text++) n += *text == ',';
  return n;
}

/* What could not be checked before the dimension was known. */
static int check_dimension(solid_work *w) {
  solid_request *q = w->request;
  unsigned n = w->cloud.n;
  if (!cli_outputs_check_dimension(&q->common.outputs, n)) return CLI_USAGE;
  if (q->box) {
    double box[6];
    if (count_numbers(q->box) != (int)(2 * n)) {
      cli_error("--box: '%s' is not the %u numbers of two corners", q->box, 2 * n);
      return CLI_USAGE;
    }
    if (!cli_parse_numbers("--box", q->box, 2 * n, box)) return CLI_USAGE;
    for (unsigned k = 0; k < n; k++) {
      q->surface.lower[k] = box[k];
      q->surface.upper[k] = box[n + k];
      if (box[k] < box[n + k]) continue;
      cli_error("--box: '%s': the first corner must be below the second", q->box);
      return CLI_USAGE;
    }
  }
  if (q->fit.orientation == BATTEN_ORIENT_GIVEN && !w->cloud.normals) {
    cli_error("%s: has no normals, which --orientation given needs; use --orientation estimate", q->common.input);
    return CLI_FAILED;
  }
  if (2 * q->fit.spline.m <= n) {
    cli_error("--order: %u is too low for points of dimension %u; use 2 or more", q->fit.spline.m, n);
    return CLI_USAGE;
  }
  return CLI_DONE;
}

/* A ball about the points' centroid: any ball gives the same solid. */
static batten_status ball_about(solid_work *w) {
  unsigned n = w->cloud.n;
  double center[3] = {0}, radius = 0;
  for (size_t i = 0; i < w->cloud.count * n; i++) center[i % n] += w->cloud.points[i] / (double)w->cloud.count;
  for (size_t i = 0; i < w->cloud.count; i++) {
    double r2 = 0;
    for (unsigned k = 0; k < n; k++) r2 += pow(w->cloud.points[i * n + k] - center[k], 2);
    radius += sqrt(r2) / (double)w->cloud.count;
  }
  return batten_carrier_ball(w->run.ctx, n, center, radius, &w->carrier);
}

static batten_status make_carrier(solid_work *w) {
  const char *name = w->request->carrier;
  unsigned n = w->cloud.n;
  if (strcmp(name, "auto") == 0) return BATTEN_OK;
  if (strcmp(name, "none") == 0) return batten_carrier_none(w->run.ctx, n, &w->carrier);
  if (strcmp(name, "ball") == 0) return ball_about(w);
  if (strcmp(name, "ellipsoid") == 0)
    return batten_carrier_fit(w->run.ctx, n, w->cloud.count, w->cloud.points, &w->carrier);
  batten_status st = batten_load_carrier(w->run.ctx, name, &w->carrier);
  if (st < 0) return st;
  batten_carrier_parts parts;
  batten_carrier_get_parts(w->carrier, &parts);
  if (parts.n != n)
    return batten_fail(w->run.ctx, BATTEN_E_INVALID, "%s: a carrier of dimension %u for points of dimension %u", name,
                       parts.n, n);
  return BATTEN_OK;
}

/* The worse of two statuses that both mean done: the first that warns is kept. */
static void note(solid_work *w, batten_status st) {
  cli_run_warn(&w->run, st);
  if (w->status == BATTEN_OK) w->status = st;
}

static batten_status fit(solid_work *w) {
  batten_solid_options o = w->request->fit;
  o.carrier = w->carrier;
  o.normals = o.orientation == BATTEN_ORIENT_NEVER ? NULL : w->cloud.normals;
  batten_status st =
      batten_solid_fit(w->run.ctx, w->cloud.n, w->cloud.count, w->cloud.points, &o, &w->solid, &w->info);
  if (st > 0) note(w, st);
  return st;
}

/* Finer than the library does where points are few: the surface between them is smooth and shall look so. */
static double default_cell(const solid_work *w) {
  double lower[3] = {0}, upper[3] = {0};
  batten_solid_box(w->solid, lower, upper);
  double diagonal = hypot(hypot(upper[0] - lower[0], upper[1] - lower[1]), upper[2] - lower[2]);
  if (w->cloud.n == 2) return fmax(w->info.spacing / 10, 2e-4 * diagonal); /* lines are cheap */
  return fmin(fmax(0.7 * w->info.spacing, diagonal / 200), diagonal / 120);
}

static batten_status make_surface(solid_work *w) {
  double start = batten_now();
  batten_context *ctx = w->run.ctx;
  batten_field field = batten_solid_field(w->solid);
  size_t count;
  const double *seeds = batten_solid_points(w->solid, &count);
  if (w->request->surface.cell == 0) w->request->surface.cell = default_cell(w);
  batten_status st =
      w->cloud.n == 2
          ? batten_trace_outline(ctx, &field, count, seeds, &w->request->surface, &w->outline, &w->surface)
          : batten_polygonize(ctx, &field, count, seeds, &w->request->surface, &w->mesh, &w->surface);
  w->time_surface_s = batten_now() - start;
  if (st > 0) note(w, st);
  if (st < 0 || !w->mesh) return st;
  st = batten_mesh_measure(ctx, w->mesh, &w->measures);
  if (st >= 0) st = batten_mesh_self_intersections(ctx, w->mesh, &w->self_intersections);
  return st < 0 ? st : solid_add_fields(w);
}

static batten_status draw(solid_work *w, const char *path) {
  batten_picture_options o = w->request->picture;
  size_t count;
  const double *points = batten_solid_points(w->solid, &count);
  if (w->request->dots || w->outline) {
    o.points = points;
    o.point_count = count;
  }
  if (w->outline) return batten_picture_outline(w->run.ctx, w->outline, &o, path);
  static const char *const labels[] = {NULL, "|grad f|", "mean curvature", "Gaussian curvature"};
  o.colors = solid_color_values(w);
  o.color_label = labels[w->request->color];
  return batten_picture_mesh(w->run.ctx, w->mesh, &o, path);
}

/* Everything to its staged name, the report last, for it tells the times of the others. */
static int write_outputs(solid_work *w) {
  solid_request *q = w->request;
  double start = batten_now();
  for (size_t i = 0; i < q->common.outputs.count; i++) {
    const cli_output *f = &q->common.outputs.items[i];
    const char *path = f->staged ? f->staged : f->target;
    batten_status st = BATTEN_OK;
    if (f->kind == CLI_OUTPUT_SURFACE)
      st = w->outline ? batten_write_outline(w->run.ctx, w->outline, path)
                      : batten_write_mesh(w->run.ctx, w->mesh, path);
    else if (f->kind == CLI_OUTPUT_SOLID)
      st = batten_save_solid(w->run.ctx, w->solid, path);
    else if (f->kind == CLI_OUTPUT_PICTURE)
      st = draw(w, path);
    if (st < 0) return cli_run_failed(&w->run, st);
  }
  w->time_write_s = batten_now() - start;
  cli_report report;
  cli_report_open(&report);
  solid_report(w, &report);
  bool ok = cli_report_write(&report, &q->common.outputs);
  cli_report_close(&report);
  cli_run_clear(&w->run);
  if (cli_interrupted()) return cli_run_failed(&w->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(&q->common.outputs) ? CLI_DONE : CLI_FAILED;
}

static void work_free(solid_work *w) {
  batten_outline_free(w->outline);
  batten_mesh_free(w->mesh);
  batten_solid_free(w->solid);
  batten_carrier_free(w->carrier);
  if (w->run.ctx) {
    batten_cloud_free(w->run.ctx, &w->cloud);
    batten_free(w->run.ctx, w->color);
    cli_run_close(&w->run);
  }
}

static int work(cli_request *q) {
  solid_work w = {.request = (solid_request *)q};
  if (!cli_run_open(&w.run, q->threads, q->memory, q->quiet)) return CLI_FAILED;
  w.run.input = q->input;
  w.run.outputs = &q->outputs;
  int status;
  batten_status st = read_points(&w);
  if (st >= 0) {
    status = check_dimension(&w);
    if (status != CLI_DONE) goto done;
    st = make_carrier(&w);
  }
  if (st >= 0) st = fit(&w);
  if (st >= 0) st = make_surface(&w);
  status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !q->quiet && !cli_outputs_to_stdout(&q->outputs)) solid_summary(&w);
done:
  work_free(&w);
  return status;
}

int cli_solid(int argc, char **argv) {
  static const cli_command command = {"solid", "file of points", table, print_help, take, work};
  solid_request q = {.carrier = "auto",
                     .fit = batten_solid_options_default(),
                     .surface = batten_polygonize_options_default(),
                     .picture = batten_picture_options_default()};
  return cli_command_run(&command, &q.common, argc, argv);
}
