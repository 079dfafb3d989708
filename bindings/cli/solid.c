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
  OPT_CARRIER = BODY_KEY_OWN,
  OPT_ORDER,
  OPT_SMOOTHING,
  OPT_NOISE,
  OPT_MERGE,
  OPT_REDUCE,
  OPT_ORIENTATION,
  OPT_ORIENT_DATA,
  OPT_ORIENT_METHOD,
  OPT_METHOD,
  OPT_ACCURACY,
  OPT_EVALUATE,
  OPT_LOO
};

static const cli_option table[] = {
    BODY_OPTION_OUTPUT("; outline of plane points:\n.svg .csv .xyz .txt .vtp .obj; may be given more than once"),
    {"picture", BODY_KEY_PICTURE, "FILE", "shaded view .png, of plane points .png or .svg"},
    CLI_OPTION_REPORT,
    BODY_OPTION_SAVE,
    {"carrier", OPT_CARRIER, "WHAT",
     "auto, ball, ellipsoid (fitted to the points), none, or a carrier FILE.json;\n"
     "default auto"},
    {"order", OPT_ORDER, "M", "order of the spline's energy, 2 to 4; default 2"},
    {"smoothing", OPT_SMOOTHING, "RHO", "0 passes through the points, larger is smoother; default 0"},
    {"noise", OPT_NOISE, "SIGMA",
     "distance of the points from the surface (standard deviation), or auto:\nestimated; finds the smoothing; "
     "default 0"},
    {"merge-radius", OPT_MERGE, "R", "points closer than this become one; default 0: equal points only"},
    {"reduce", OPT_REDUCE, "DISTANCE",
     "use so few of the points as centres that the surface is within this\n"
     "distance of all points, measured anew at each; default 0: all points"},
    {"orientation", OPT_ORIENTATION, "HOW",
     "auto (where the check of the sign asks for it), never, given (normals\n"
     "of the file), estimate; default auto"},
    {"orient-data", OPT_ORIENT_DATA, "WHAT", "orientation enters as auto, gradients or pairs; default auto"},
    {"orient-method", OPT_ORIENT_METHOD, "HOW", "estimated by auto, energy or planes; default auto"},
    {"method", OPT_METHOD, "NAME",
     "linear solver: auto, cholesky, mixed, ldl, qr or iterative (for many\npoints); default auto"},
    {"accuracy", OPT_ACCURACY, "EPS", "residual that an iterative solver aims at; default 1e-6"},
    {"evaluate", OPT_EVALUATE, "HOW",
     "f by direct sums, by fast ones to a tenth of the surface's accuracy, or\n"
     "auto: fast from 12,000 centres on, 30,000 above order 2; default auto"},
    {"cell", BODY_KEY_CELL, "LENGTH",
     "edge length of the mesh; default from the points' spacing, but at most\n1/120 of the diagonal of their box"},
    BODY_OPTION_SHARP("0"),
    BODY_OPTION_BOX("the points' box grown by 25 %"),
    CLI_OPTION_MEMORY,
    {"loo", OPT_LOO, "N", "leave-one-out errors of N points, all or none; default 256"},
    CLI_OPTION_THREADS,
    CLI_OPTION_VIEW,
    CLI_OPTION_UP,
    BODY_OPTION_COLOR,
    {"dots", BODY_KEY_DOTS, NULL, "draw the points in the picture"},
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
  static const char *const methods[] = {"auto", "cholesky", "mixed", "ldl", "qr", "iterative", NULL};
  static const char *const evaluations[] = {"auto", "direct", "fast", NULL};
  int word = 0;
  size_t count = 0;
  bool ok = true;
  switch (key) {
    case OPT_EVALUATE:
      ok = cli_parse_word("--evaluate", v, evaluations, &word);
      q->fit.evaluation = q->body.evaluation = (batten_evaluation)word;
      break;
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
    case OPT_NOISE:
      if (strcmp(v, "auto") == 0)
        q->fit.noise = BATTEN_NOISE_ESTIMATE;
      else
        ok = cli_parse_number("--noise", v, 0, INFINITY, &q->fit.noise);
      break;
    case OPT_MERGE:
      ok = cli_parse_number("--merge-radius", v, 0, INFINITY, &q->fit.merge_radius);
      break;
    case OPT_REDUCE:
      ok = cli_parse_number("--reduce", v, 0, INFINITY, &q->fit.reduce);
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
    case OPT_ACCURACY:
      ok = cli_parse_number("--accuracy", v, 1e-13, 0.1, &q->fit.spline.saddle.accuracy);
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

static bool take(cli_request *common, int key, const char *v) {
  solid_request *q = (solid_request *)common;
  if (key >= BODY_KEY_OWN) return take_fit_option(q, key, v);
  return body_take(common, &q->body, key, v);
}

/* ---- phases -------------------------------------------------------------------------------------- */

static batten_status read_points(solid_work *w) {
  double start = batten_now();
  batten_read_points_options o = batten_read_points_options_default();
  batten_status st = batten_read_points(w->run.ctx, w->request->common.input, &o, &w->cloud);
  w->time_read_s = batten_now() - start;
  return st;
}

/* What could not be checked before the dimension was known. */
static int check_dimension(solid_work *w) {
  solid_request *q = w->request;
  unsigned n = w->cloud.n;
  int status = body_check(&w->body, n);
  if (status != CLI_DONE) return status;
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

static batten_status fit(solid_work *w) {
  batten_solid_options o = w->request->fit;
  o.carrier = w->carrier;
  o.normals = o.orientation == BATTEN_ORIENT_NEVER ? NULL : w->cloud.normals;
  batten_status st =
      batten_solid_fit(w->run.ctx, w->cloud.n, w->cloud.count, w->cloud.points, &o, &w->body.solid, &w->info);
  body_note(&w->body, st);
  return st;
}

/* Finer than the library does where points are few: the surface between them is smooth and shall look so. */
static double default_cell(const solid_work *w) {
  double lower[3] = {0}, upper[3] = {0};
  batten_solid_box(w->body.solid, lower, upper);
  double diagonal = hypot(hypot(upper[0] - lower[0], upper[1] - lower[1]), upper[2] - lower[2]);
  if (w->cloud.n == 2) return fmax(w->info.spacing / 10, 2e-4 * diagonal); /* lines are cheap */
  return fmin(fmax(0.7 * w->info.spacing, diagonal / 200), diagonal / 120);
}

static int write_outputs(solid_work *w) {
  batten_status st = body_write(&w->body);
  if (st < 0) return cli_run_failed(&w->run, st);
  cli_report report; /* last: it tells the times of the others */
  cli_report_open(&report);
  solid_report(w, &report);
  int status = body_finish(&w->body, &report);
  cli_report_close(&report);
  return status;
}

static void work_free(solid_work *w) {
  body_free(&w->body);
  batten_solid_free(w->body.solid);
  batten_carrier_free(w->carrier);
  if (w->run.ctx) {
    batten_cloud_free(w->run.ctx, &w->cloud);
    cli_run_close(&w->run);
  }
}

static int work(cli_request *q) {
  solid_work w = {.request = (solid_request *)q};
  w.body = (body){.request = &w.request->body, .common = q, .run = &w.run};
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
  if (st >= 0) st = body_mesh(&w.body, default_cell(&w));
  status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !q->quiet && !cli_outputs_to_stdout(&q->outputs)) solid_summary(&w);
done:
  work_free(&w);
  return status;
}

int cli_solid(int argc, char **argv) {
  static const cli_command command = {"solid", "file of points", table, print_help, take, work};
  solid_request q = {.carrier = "auto", .fit = batten_solid_options_default(), .body = body_request_default()};
  return cli_command_run(&command, &q.common, argc, argv);
}
