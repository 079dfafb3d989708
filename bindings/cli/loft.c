/* batten loft: contours in parallel planes, as curves or as slices of points, to a surface whose sections keep their
 * shape.
 *
 * Phases: read, match (slices), build, measure, write. All outputs are checked before the first and appear after the
 * last, or not at all. */
#include "loft.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- command line -------------------------------------------------------------------------------- */

enum {
  OPT_UNCONSTRAINED = CLI_KEY_OWN,
  OPT_CONTOURS,
  OPT_SECTIONS,
  OPT_PICTURE,
  OPT_BETWEEN,
  OPT_GAP,
  OPT_CLOSED,
  OPT_DEGREE, /* first of how slices are fitted */
  OPT_SMOOTH,
  OPT_SIGNIFICANCE,
  OPT_KNOTS,
  OPT_TOLERANCE,
  OPT_MATCH, /* last of it */
  OPT_DEGREE_Z,
  OPT_DEGREE_Z_MAX,
  OPT_SMOOTH_Z,
  OPT_START_SLOPE,
  OPT_END_SLOPE,
  OPT_TENSION,
  OPT_KNOT_TOLERANCE,
  OPT_ZONE,
  OPT_MARGIN,
  OPT_ROUNDS,
  OPT_KNOT_ROUNDS,
  OPT_UNIT,
  OPT_DENSITY
};

static const cli_option table[] = {
    {"output", 'o', "FILE",
     "surface, by extension: .json (reads back to the same bits), .step .stp .iges .igs (CAD)\n"
     ".vtu (Bezier cells), or a mesh .ply .obj .stl .off .vtp .vtk; may be given more than\nonce"},
    {"unconstrained", OPT_UNCONSTRAINED, "FILE", "the surface without inequalities, to compare with; formats as -o"},
    {"contours", OPT_CONTOURS, "FILE",
     "the contours as curves: .json (to be given again), .step .iges .svg .csv .vtk"},
    {"sections", OPT_SECTIONS, "FILE", "contours and sections between them as curves; formats as --contours"},
    {"between", OPT_BETWEEN, "N", "sections between neighbouring contours that --sections writes; default 4"},
    {"picture", OPT_PICTURE, "FILE",
     "both surfaces with control polygons, sections, Gaussian curvature and curvature of the\nsections, .png"},
    CLI_OPTION_REPORT,
    {"gap", OPT_GAP, "H", "distance of neighbouring contours where the file tells no heights"},
    {"closed", OPT_CLOSED, NULL, "closed slices; the first point may be there again at the end"},
    {"degree", OPT_DEGREE, "D", "slices: of the contours, smoothness + 1 to 9; default 3"},
    {"smooth", OPT_SMOOTH, "L", "slices: continuous derivatives of the contours, 1 or 2; default 2"},
    {"significance", OPT_SIGNIFICANCE, "S",
     "slices: standard deviations of noise that a bend must have to count; default 4"},
    {"knots", OPT_KNOTS, "N", "slices: polynomial pieces of each contour; default as many as the points speak for"},
    {"tolerance", OPT_TOLERANCE, "T", "slices: as few pieces as bring all points within T of the contours"},
    {"match", OPT_MATCH, "WHAT",
     "slices: all, none, or some of orient (reverse those that run the other way), align\n"
     "(begin closed ones where neighbours begin), features (give inflections that belong\n"
     "together one parameter), parted by commas; default all"},
    {"degree-z", OPT_DEGREE_Z, "N", "of the surface across contours, 2 L + 1 to 9; default 2 L + 2"},
    {"degree-z-max", OPT_DEGREE_Z_MAX, "N", "to which it may be raised where there is no solution; default 9"},
    {"smooth-z", OPT_SMOOTH_Z, "L", "continuous derivatives across contours, 1 or 2; default as the contours have"},
    {"start-slope", OPT_START_SLOPE, "X,Y", "dx/dz, dy/dz of the surface at the first contour; default free"},
    {"end-slope", OPT_END_SLOPE, "X,Y", "the same at the last contour"},
    {"tension", OPT_TENSION, "W", "of legs and of the paths of end points (closed: of all) by z; default 0.01"},
    {"knot-tolerance", OPT_KNOT_TOLERANCE, "T",
     "knots of different contours nearer than this part of the domain are made equal;\ndefault 1e-12"},
    {"zone", OPT_ZONE, "P", "free part of the spans beside inflections without a partner; default 0.1"},
    {"margin", OPT_MARGIN, "M", "part of the contours' turns that sections keep; default 0.01"},
    {"rounds", OPT_ROUNDS, "N", "of inequalities and quadratic program for each degree, to 100; default 6"},
    {"knot-rounds", OPT_KNOT_ROUNDS, "N", "times that knots are inserted where there is no solution; default 2"},
    {"unit", OPT_UNIT, "NAME", "of lengths in STEP and IGES: mm, cm, m or inch; default mm"},
    {"density", OPT_DENSITY, "N", "meshes: segments of every span in either direction; default 8"},
    CLI_OPTION_VIEW,
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
      "usage: batten loft CONTOURS [OPTIONS]\n\n"
      "Makes a smooth surface through contours in parallel planes. Where neighbouring contours bend to the same\n"
      "side, every section between them is proven to do. CONTOURS: curves in .json, as batten curve writes them,\n"
      "which correspond by their parameter; or slices of points x y z in order, which are fitted and matched first:\n"
      ".txt .xyz .csv, parted by blank lines, by lines `contour N`, or by a column contour; tables of offsets of\n"
      "hulls (station, waterline, half_breadth); also with .gz.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: slices of a twisted vase\n\n"
      "  awk 'BEGIN { for (k = 0; k <= 6; k++) { for (i = 0; i < 60; i++) { a = i * 0.10472;\n"
      "    r = 3 + cos(k) + 0.3 * cos(3 * a + k / 2); print r * cos(a), r * sin(a), 2 * k }; print \"\" } }' > "
      "vase.txt\n"
      "  batten loft vase.txt --closed -o vase.step -o vase.ply --picture vase.png --report vase.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

/* Words parted by commas. */
static bool take_match(loft_request *q, const char *v) {
  static const char *const words[] = {"all", "none", "orient", "align", "features", NULL};
  batten_loft_match_options *m = &q->match;
  char part[16];
  m->orient = m->align = m->features = 0;
  for (const char *from = v;; from++) {
    size_t length = strcspn(from, ",");
    int word = 0;
    snprintf(part, sizeof part, "%.*s", (int)(length < sizeof part ? length : sizeof part - 1), from);
    if (!cli_parse_word("--match", part, words, &word)) return false;
    m->orient |= word == 0 || word == 2;
    m->align |= word == 0 || word == 3;
    m->features |= word == 0 || word == 4;
    from += length;
    if (*from == '\0') return true;
  }
}

static bool take_fit(loft_request *q, int key, const char *v) {
  batten_contour_options *o = &q->match.fit;
  size_t count = 0;
  q->fit_options = true;
  switch (key) {
    case OPT_DEGREE:
      if (!cli_parse_count("--degree", v, 2, BATTEN_CURVE_DEGREE_MAX, &count)) return false;
      o->degree = (unsigned)count;
      return true;
    case OPT_SMOOTH:
      if (!cli_parse_count("--smooth", v, 1, 2, &count)) return false;
      o->smoothness = (unsigned)count;
      return true;
    case OPT_SIGNIFICANCE:
      return cli_parse_number("--significance", v, 1e-300, 1e300, &o->significance);
    case OPT_KNOTS:
      return cli_parse_count("--knots", v, 1, 1000000, &o->spans);
    case OPT_TOLERANCE:
      return cli_parse_number("--tolerance", v, 1e-300, 1e300, &o->tolerance);
    default:
      return take_match(q, v);
  }
}

static bool take_small(const char *option, const char *v, size_t least, size_t most, unsigned *out) {
  size_t count = 0;
  if (!cli_parse_count(option, v, least, most, &count)) return false;
  *out = (unsigned)count;
  return true;
}

static bool take_surface(loft_request *q, int key, const char *v) {
  batten_loft_options *o = &q->options;
  switch (key) {
    case OPT_DEGREE_Z:
      return take_small("--degree-z", v, 3, BATTEN_SURFACE_DEGREE_MAX, &o->degree_z);
    case OPT_DEGREE_Z_MAX:
      return take_small("--degree-z-max", v, 3, BATTEN_SURFACE_DEGREE_MAX, &o->degree_z_max);
    case OPT_SMOOTH_Z:
      return take_small("--smooth-z", v, 1, 2, &o->smooth_z);
    case OPT_START_SLOPE:
      return cli_parse_numbers("--start-slope", v, 2, q->slopes[0]);
    case OPT_END_SLOPE:
      return cli_parse_numbers("--end-slope", v, 2, q->slopes[1]);
    case OPT_TENSION:
      return cli_parse_number("--tension", v, 0, 1e300, &o->tension);
    case OPT_KNOT_TOLERANCE:
      return cli_parse_number("--knot-tolerance", v, 0, 0.0999, &o->knot_tolerance);
    case OPT_ZONE:
      return cli_parse_number("--zone", v, 1e-6, 0.5, &o->zone);
    case OPT_MARGIN:
      return cli_parse_number("--margin", v, 1e-12, 0.999, &o->margin);
    case OPT_ROUNDS:
      return take_small("--rounds", v, 1, 100, &o->rounds);
    default:
      return take_small("--knot-rounds", v, 0, 10, &o->knot_rounds);
  }
}

static bool take(cli_request *common, int key, const char *v) {
  static const char *const units[] = {"mm", "cm", "m", "inch", NULL};
  loft_request *q = (loft_request *)common;
  int word = 0;
  switch (key) {
    case 'o':
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_PATCH, v);
    case OPT_UNCONSTRAINED:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_UNCONSTRAINED, v);
    case OPT_CONTOURS:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_CONTOURS, v);
    case OPT_SECTIONS:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_SECTIONS, v);
    case OPT_PICTURE:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_SHADED, v);
    case OPT_BETWEEN:
      return cli_parse_count("--between", v, 0, 1000, &q->between);
    case OPT_GAP:
      return cli_parse_number("--gap", v, 1e-300, 1e300, &q->gap);
    case OPT_CLOSED:
      q->match.fit.closed = 1;
      return true;
    case OPT_UNIT:
      if (!cli_parse_word("--unit", v, units, &word)) return false;
      q->write.unit = (batten_length_unit)word;
      return true;
    case OPT_DENSITY:
      return take_small("--density", v, 1, 1024, &q->write.density);
    default:
      if (key < CLI_KEY_OWN) return cli_take_picture(&q->picture, key, v);
      return key <= OPT_MATCH ? take_fit(q, key, v) : take_surface(q, key, v);
  }
}

/* ---- phases -------------------------------------------------------------------------------------- */

/* A constant curve over the contours' domain. */
static batten_status make_slope(loft_work *w, int end) {
  const double *slope = w->request->slopes[end];
  if (isnan(slope[0])) return BATTEN_OK;
  batten_curve_form contour = batten_curve_get(w->contours[0]);
  double from = contour.knots[0], to = contour.knots[contour.knot_count - 1];
  double knots[4] = {from, from, to, to}, points[4] = {slope[0], slope[1], slope[0], slope[1]};
  batten_curve_form form = {1, 4, knots, points, contour.closed};
  return batten_curve_create(w->run.ctx, &form, &w->slopes[end]);
}

static batten_status build(loft_work *w) {
  batten_loft_options o = w->request->options;
  batten_status st = BATTEN_OK;
  for (int end = 0; end < 2 && st >= 0; end++) {
    st = make_slope(w, end);
    o.slopes[end] = w->slopes[end];
  }
  if (st >= 0)
    st = batten_loft_build(w->run.ctx, w->count, (const batten_curve *const *)w->contours, w->heights, &o, &w->loft,
                           &w->unconstrained, &w->info);
  cli_run_warn(&w->run, st);
  if (st > 0 && w->status == BATTEN_OK) w->status = st;
  double start = batten_now();
  if (st >= 0) st = batten_loft_measure(w->run.ctx, w->loft, &w->measures);
  w->time_measure_s = batten_now() - start;
  return st;
}

static int write_outputs(loft_work *w) {
  loft_request *q = w->request;
  double start = batten_now();
  for (size_t i = 0; i < q->common.outputs.count; i++) {
    batten_status st = loft_write(w, &q->common.outputs.items[i]);
    if (st < 0) return cli_run_failed(&w->run, st);
  }
  w->time_write_s = batten_now() - start;
  cli_report report; /* last: it tells the times of the others */
  cli_report_open(&report);
  loft_report(w, &report);
  bool ok = cli_report_write(&report, &q->common.outputs);
  cli_report_close(&report);
  cli_run_clear(&w->run);
  if (cli_interrupted()) return cli_run_failed(&w->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(&q->common.outputs) ? CLI_DONE : CLI_FAILED;
}

static void work_free(loft_work *w) {
  batten_context *ctx = w->run.ctx;
  batten_loft_free(w->loft);
  batten_loft_free(w->unconstrained);
  for (int end = 0; end < 2; end++) batten_curve_free(w->slopes[end]);
  for (size_t i = 0; w->contours && i < w->count; i++) batten_curve_free(w->contours[i]);
  batten_free(ctx, w->contours);
  batten_free(ctx, w->heights);
  cli_run_close(&w->run);
}

static int work(cli_request *common) {
  loft_request *q = (loft_request *)common;
  loft_work w = {.request = q};
  if (!cli_run_open(&w.run, common->threads, common->memory, common->quiet)) return CLI_FAILED;
  w.run.input = common->input;
  w.run.outputs = &common->outputs;
  batten_status st = loft_read(&w);
  if (st >= 0) st = build(&w);
  int status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !common->quiet && !cli_outputs_to_stdout(&common->outputs)) loft_summary(&w);
  work_free(&w);
  return status;
}

int cli_loft(int argc, char **argv) {
  static const cli_command command = {"loft", "file of contours", table, print_help, take, work};
  loft_request q = {.options = batten_loft_options_default(),
                    .match = batten_loft_match_options_default(),
                    .write = batten_write_surface_options_default(),
                    .picture = batten_picture_options_default(),
                    .slopes = {{NAN, NAN}, {NAN, NAN}},
                    .gap = NAN,
                    .between = 4};
  q.write.density = 8;
  return cli_command_run(&command, &q.common, argc, argv);
}
