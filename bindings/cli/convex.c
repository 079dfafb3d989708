/* batten convex: scattered points to a convex surface, or to a convex function.
 *
 * Phases: read, fit, measure, write. All outputs are checked before the first and appear after the last, or not at
 * all. */
#include "convex.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "convex_picture.h"

/* ---- command line -------------------------------------------------------------------------------- */

enum {
  OPT_UNCONSTRAINED = CLI_KEY_OWN,
  OPT_PICTURE,
  OPT_DEGREE,
  OPT_SPANS,
  OPT_SMOOTHNESS,
  OPT_DOMAIN,
  OPT_TENSION,
  OPT_ROUNDS, /* last of those that both kinds have */
  OPT_PARAMETERS,
  OPT_ROUNDS_TOL,
  OPT_CORRECTION,
  OPT_MARGIN, /* last of surfaces */
  OPT_FUNCTION,
  OPT_CONCAVE,
  OPT_SIGNS,
  OPT_GAP, /* last of functions */
  OPT_UNIT,
  OPT_DENSITY,
  OPT_TOLERANCE
};

static const cli_option table[] = {
    {"output", 'o', "FILE",
     "surface, by extension: .step .stp .iges .igs (CAD), .json (reads back to the same\n"
     "bits), .vtu (Bezier patches); or a mesh of it: .ply .obj .stl .off .vtp .vtk; may\nbe given more than once"},
    {"unconstrained", OPT_UNCONSTRAINED, "FILE", "the fit without inequalities, to compare with; formats as -o"},
    {"picture", OPT_PICTURE, "FILE", "both fits with control nets, level curves and Gaussian curvature, .png"},
    CLI_OPTION_REPORT,
    {"degree", OPT_DEGREE, "M[,N]", "in both directions, 2 to 7; default 3"},
    {"spans", OPT_SPANS, "M[,N]",
     "polynomial pieces in both directions, 1 to 16; default 1 (one Bezier patch); with\n--function 1 to 64, default "
     "4"},
    {"smoothness", OPT_SMOOTHNESS, "M[,N]",
     "continuous derivatives between pieces, 1 to degree - 1; default degree - 1"},
    {"domain", OPT_DOMAIN, "U0,U1,V0,V1",
     "of the parameters u v in the file, or of x and y with --function; default their range"},
    {"tension", OPT_TENSION, "W",
     "weight of stiffness beside the mean square distance; default 1e-6, with --function 1e-8"},
    {"rounds", OPT_ROUNDS, "N",
     "of inequalities and quadratic program at most, to 100, with --function 20; default 10"},
    {"parameters", OPT_PARAMETERS, "HOW",
     "project (into the best plane), floater (shape preserving, on the triangles of the\n"
     "file or those of Delaunay) or file (columns u v); default auto: file, else project"},
    {"rounds-tol", OPT_ROUNDS_TOL, "T", "a round that lowers the sum by a smaller part brings the last one nearer;\ndefault 1e-3"},
    {"correction", OPT_CORRECTION, "N", "passes of parameter correction in a round, 0 keeps them; default 3"},
    {"margin", OPT_MARGIN, "M", "inequalities hold by this part of what the reference has; default 1e-3"},
    {"function", OPT_FUNCTION, NULL, "fit z = f(x, y), convex"},
    {"concave", OPT_CONCAVE, NULL, "with --function: concave"},
    {"signs", OPT_SIGNS, "FILE",
     "with --function: a line of + (convex), - (concave), 0 (free) for each span in y,\nthe topmost for the largest "
     "y, a sign for each span in x"},
    {"gap", OPT_GAP, "T", "with --function: refine until the sum is so near to its lower bound; default 1e-3"},
    {"unit", OPT_UNIT, "NAME", "of lengths in STEP and IGES: mm, cm, m or inch; default mm"},
    {"density", OPT_DENSITY, "N", "segments of each piece in meshes; default 16"},
    {"tolerance", OPT_TOLERANCE, "T", "meshes within T of the surface, with at most --density segments"},
    {"view", CLI_KEY_VIEW, "AZ,EL", "direction of the picture's camera, degrees; default 35,38"},
    CLI_OPTION_UP,
    CLI_OPTION_SIZE,
    CLI_OPTION_TITLE,
    CLI_OPTION_MEMORY,
    CLI_OPTION_THREADS,
    CLI_OPTION_QUIET,
    CLI_OPTION_HELP,
    {0},
};

static void print_help(void) {
  printf(
      "usage: batten convex POINTS [OPTIONS]\n\n"
      "Fits a smooth surface to scattered points of a convex part: a tensor-product Bezier patch, or several, whose\n"
      "Gaussian curvature is proven to be positive everywhere. POINTS: x y z, with names in the first line also u v\n"
      "(parameters) and w (weight): .xyz .txt .csv .ply .obj .off .stl, also with .gz.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: noisy points of an ellipsoid\n\n"
      "  awk 'BEGIN { srand(3); for (i = 0; i < 60; i++) { x = 2 * rand() - 1; y = 2 * rand() - 1;\n"
      "    print x, y, sqrt(4 - x * x - 2 * y * y) + 0.1 * (rand() - 0.5) } }' > points.xyz\n"
      "  batten convex points.xyz -o patch.step -o patch.json --picture patch.png --report patch.report.json\n"
      "\nexample: values of a concave function\n\n"
      "  batten convex points.xyz --function --concave --spans 4 -o function.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

/* One number for both directions, or two parted by a comma. */
static bool parse_pair(const char *option, const char *text, size_t lower, size_t upper, unsigned out[2]) {
  char first[32];
  const char *comma = strchr(text, ',');
  size_t length = comma ? (size_t)(comma - text) : strlen(text), count[2] = {0};
  if (length >= sizeof first) length = sizeof first - 1;
  memcpy(first, text, length);
  first[length] = '\0';
  if (!cli_parse_count(option, first, lower, upper, &count[0])) return false;
  count[1] = count[0];
  if (comma && !cli_parse_count(option, comma + 1, lower, upper, &count[1])) return false;
  for (int i = 0; i < 2; i++) out[i] = (unsigned)count[i];
  return true;
}

/* Of both kinds of fit. */
static bool take_fit_option(convex_request *q, int key, const char *v) {
  batten_convex_options *o = &q->options;
  batten_convex_function_options *f = &q->function_options;
  unsigned pair[2];
  double four[4], number;
  size_t count = 0;
  switch (key) {
    case OPT_DEGREE:
      if (!parse_pair("--degree", v, 2, 7, pair)) return false;
      memcpy(o->degree, pair, sizeof pair);
      memcpy(f->degree, pair, sizeof pair);
      return true;
    case OPT_SPANS:
      if (!parse_pair("--spans", v, 1, 64, pair)) return false;
      memcpy(o->spans, pair, sizeof pair);
      memcpy(f->spans, pair, sizeof pair);
      return true;
    case OPT_SMOOTHNESS:
      if (!parse_pair("--smoothness", v, 1, 6, pair)) return false;
      memcpy(o->smoothness, pair, sizeof pair);
      memcpy(f->smoothness, pair, sizeof pair);
      return true;
    case OPT_DOMAIN:
      if (!cli_parse_numbers("--domain", v, 4, four)) return false;
      memcpy(o->domain, four, sizeof four);
      memcpy(f->domain, four, sizeof four);
      return true;
    case OPT_TENSION:
      if (!cli_parse_number("--tension", v, 0, 1e300, &number)) return false;
      o->tension = f->tension = number;
      return true;
    default:
      if (!cli_parse_count("--rounds", v, 1, BATTEN_CONVEX_ROUNDS_MAX, &count)) return false;
      o->rounds = f->rounds = (unsigned)count;
      return true;
  }
}

static bool take_surface_option(convex_request *q, int key, const char *v) {
  static const char *const parameters[] = {"auto", "project", "floater", "file", NULL};
  size_t count = 0;
  int word = 0;
  switch (key) {
    case OPT_PARAMETERS:
      if (!cli_parse_word("--parameters", v, parameters, &word)) return false;
      q->parameters = (convex_parameters)word;
      q->only_surface = "--parameters";
      return true;
    case OPT_ROUNDS_TOL:
      q->only_surface = "--rounds-tol";
      return cli_parse_number("--rounds-tol", v, 0, 1, &q->options.rounds_tol);
    case OPT_CORRECTION:
      if (!cli_parse_count("--correction", v, 0, 1000, &count)) return false;
      q->options.correction_passes = (unsigned)count;
      q->only_surface = "--correction";
      return true;
    default:
      q->only_surface = "--margin";
      return cli_parse_number("--margin", v, 1e-12, 0.5, &q->options.margin);
  }
}

static bool take_function_option(convex_request *q, int key, const char *v) {
  switch (key) {
    case OPT_FUNCTION:
      q->function = true;
      return true;
    case OPT_CONCAVE:
      q->concave = true;
      q->only_function = "--concave";
      return true;
    case OPT_SIGNS:
      q->signs_file = v;
      q->only_function = "--signs";
      return true;
    default:
      q->only_function = "--gap";
      return cli_parse_number("--gap", v, 1e-12, 1e300, &q->function_options.gap_tol);
  }
}

static bool take_write_option(convex_request *q, int key, const char *v) {
  static const char *const units[] = {"mm", "cm", "m", "inch", NULL};
  size_t count = 0;
  int word = 0;
  switch (key) {
    case OPT_UNIT:
      if (!cli_parse_word("--unit", v, units, &word)) return false;
      q->write.unit = (batten_length_unit)word;
      return true;
    case OPT_DENSITY:
      if (!cli_parse_count("--density", v, 1, 1024, &count)) return false;
      q->write.density = (unsigned)count;
      return true;
    default:
      return cli_parse_number("--tolerance", v, 1e-300, INFINITY, &q->write.tolerance);
  }
}

static bool take(cli_request *common, int key, const char *v) {
  convex_request *q = (convex_request *)common;
  if (key == 'o') return cli_outputs_add(&common->outputs, CLI_OUTPUT_PATCH, v);
  if (key == OPT_UNCONSTRAINED) return cli_outputs_add(&common->outputs, CLI_OUTPUT_UNCONSTRAINED, v);
  if (key == OPT_PICTURE) return cli_outputs_add(&common->outputs, CLI_OUTPUT_SHADED, v);
  if (key < CLI_KEY_OWN) return cli_take_picture(&q->picture, key, v);
  if (key <= OPT_ROUNDS) return take_fit_option(q, key, v);
  if (key <= OPT_MARGIN) return take_surface_option(q, key, v);
  if (key <= OPT_GAP) return take_function_option(q, key, v);
  return take_write_option(q, key, v);
}

/* What does not go together; CLI_DONE: all does. */
static int check_request(const convex_request *q) {
  if (q->function && q->only_surface)
    return cli_usage("convex", "%s is of surfaces: not with --function", q->only_surface);
  if (!q->function && q->only_function) return cli_usage("convex", "%s needs --function", q->only_function);
  if (q->concave && q->signs_file) return cli_usage("convex", "--concave and --signs: give one of them");
  return CLI_DONE;
}

/* ---- phases -------------------------------------------------------------------------------------- */

/* The first warning is kept. */
static void note(convex_work *w, batten_status st) {
  cli_run_warn(&w->run, st);
  if (st > 0 && w->status == BATTEN_OK) w->status = st;
}

/* Triangles of a mesh file, whose vertices are the points then. */
static batten_status read_triangles(convex_work *w) {
  convex_request *q = w->request;
  batten_file_kind kind = BATTEN_FILE_UNKNOWN;
  batten_status st = batten_file_identify(w->run.ctx, q->common.input, &kind);
  if (st < 0 || kind != BATTEN_FILE_MESH) return st;
  st = batten_read_mesh(w->run.ctx, q->common.input, &w->mesh);
  if (st < 0) return st;
  q->options.parametrize.triangle_count = batten_mesh_triangle_count(w->mesh);
  q->options.parametrize.triangles = batten_mesh_triangles(w->mesh);
  return BATTEN_OK;
}

static batten_status take_parameters(convex_work *w) {
  convex_request *q = w->request;
  bool own = q->parameters == CONVEX_FILE || (q->parameters == CONVEX_AUTO && w->cloud.parameters);
  if (q->parameters == CONVEX_FILE && !w->cloud.parameters)
    return batten_fail(w->run.ctx, BATTEN_E_INVALID,
                       "points: no columns u and v in the file; name them in its first line, or leave --parameters");
  if (own) q->options.parameters = w->cloud.parameters;
  if (!own && !isnan(q->options.domain[0][0]))
    return batten_fail(w->run.ctx, BATTEN_E_INVALID,
                       "--domain: of parameters in the file, which are not taken; add columns u and v, or leave it");
  if (q->parameters != CONVEX_FLOATER) return BATTEN_OK;
  q->options.parametrize.method = BATTEN_PARAMETERS_FLOATER;
  return read_triangles(w);
}

static batten_status read_input(convex_work *w) {
  convex_request *q = w->request;
  batten_context *ctx = w->run.ctx;
  double start = batten_now();
  batten_read_points_options o = batten_read_points_options_default();
  o.n = 3;
  batten_status st = batten_read_points(ctx, q->common.input, &o, &w->cloud);
  q->options.weights = q->function_options.weights = w->cloud.weights;
  if (st >= 0 && !q->function) st = take_parameters(w);
  const unsigned *spans = q->function_options.spans;
  if (st >= 0 && q->signs_file) st = convex_read_signs(ctx, q->signs_file, spans[0], spans[1], &w->signs);
  if (st >= 0 && q->concave) {
    w->signs = batten_alloc(ctx, (size_t)spans[0] * spans[1]);
    if (!w->signs) return BATTEN_E_NOMEM;
    memset(w->signs, -1, (size_t)spans[0] * spans[1]);
  }
  q->function_options.signs = w->signs;
  w->time_read_s = batten_now() - start;
  return st;
}

static batten_status fit(convex_work *w) {
  const convex_request *q = w->request;
  size_t count = w->cloud.count;
  const double *points = w->cloud.points;
  batten_status st = q->function ? batten_convex_function_fit(w->run.ctx, count, points, &q->function_options,
                                                              &w->surface, &w->unconstrained, &w->function_info)
                                 : batten_convex_fit(w->run.ctx, count, points, &q->options, &w->surface,
                                                     &w->unconstrained, &w->info);
  note(w, st);
  return st;
}

static batten_status measure(convex_work *w) {
  double start = batten_now();
  batten_status st = batten_surface_measure(w->run.ctx, w->surface, &w->measures);
  w->time_measure_s = batten_now() - start;
  return st;
}

static batten_status write_surface(convex_work *w, const batten_surface *surface, const cli_output *f) {
  batten_write_surface_options o = w->request->write;
  char *name = cli_product_name(f->path);
  if (!name) return BATTEN_E_NOMEM;
  o.name = name;
  batten_status st = batten_write_surface(w->run.ctx, surface, &o, f->staged ? f->staged : f->target);
  free(name);
  return st;
}

/* Over the pictures. */
static const char *shape_of(const convex_work *w) {
  const convex_request *q = w->request;
  if (!q->function) return w->info.plane ? "best plane" : "convex";
  return q->concave ? "concave" : q->signs_file ? "shape wanted" : "convex";
}

static batten_status write_one(convex_work *w, const cli_output *f) {
  const convex_request *q = w->request;
  const char *path = f->staged ? f->staged : f->target;
  switch (f->kind) {
    case CLI_OUTPUT_PATCH:
      return write_surface(w, w->surface, f);
    case CLI_OUTPUT_UNCONSTRAINED:
      return write_surface(w, w->unconstrained, f);
    case CLI_OUTPUT_SHADED:
      return cli_convex_picture(w->run.ctx, w->unconstrained, w->surface, shape_of(w), w->cloud.count,
                                w->cloud.points, &q->picture, path);
    default:
      return BATTEN_OK; /* reports come last: they tell the times of the others */
  }
}

static int write_outputs(convex_work *w) {
  convex_request *q = w->request;
  double start = batten_now();
  for (size_t i = 0; i < q->common.outputs.count; i++) {
    batten_status st = write_one(w, &q->common.outputs.items[i]);
    if (st < 0) return cli_run_failed(&w->run, st);
  }
  w->time_write_s = batten_now() - start;
  cli_report report;
  cli_report_open(&report);
  convex_report(w, &report);
  bool ok = cli_report_write(&report, &q->common.outputs);
  cli_report_close(&report);
  cli_run_clear(&w->run);
  if (cli_interrupted()) return cli_run_failed(&w->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(&q->common.outputs) ? CLI_DONE : CLI_FAILED;
}

static void work_free(convex_work *w) {
  batten_surface_free(w->surface);
  batten_surface_free(w->unconstrained);
  batten_mesh_free(w->mesh);
  batten_free(w->run.ctx, w->signs);
  batten_cloud_free(w->run.ctx, &w->cloud);
  cli_run_close(&w->run);
}

static int work(cli_request *common) {
  convex_request *q = (convex_request *)common;
  convex_work w = {.request = q};
  int usage = check_request(q);
  if (usage != CLI_DONE) return usage;
  if (!cli_run_open(&w.run, common->threads, common->memory, common->quiet)) return CLI_FAILED;
  w.run.input = common->input;
  w.run.outputs = &common->outputs;
  batten_status st = read_input(&w);
  if (st >= 0) st = fit(&w);
  if (st >= 0) st = measure(&w);
  int status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !common->quiet && !cli_outputs_to_stdout(&common->outputs)) convex_summary(&w);
  work_free(&w);
  return status;
}

int cli_convex(int argc, char **argv) {
  static const cli_command command = {"convex", "file of points", table, print_help, take, work};
  convex_request q = {.options = batten_convex_options_default(),
                      .function_options = batten_convex_function_options_default(),
                      .write = batten_write_surface_options_default(),
                      .picture = batten_picture_options_default()};
  q.picture.elevation_deg = 38; /* steep enough to see into the ellipses on the far side */
  /* The range of the parameters in the file. */
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 2; k++) q.options.domain[i][k] = NAN;
  return cli_command_run(&command, &q.common, argc, argv);
}
