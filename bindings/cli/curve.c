/* batten curve: points in order to planar curves whose curvature has the wanted signs.
 *
 * Phases: read, propose (where asked for), fit, measure, write; each for all contours of the file. All outputs are
 * checked before the first and appear after the last, or not at all. */
#include "curve.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- command line -------------------------------------------------------------------------------- */

enum {
  OPT_UNCONSTRAINED = CLI_KEY_OWN,
  OPT_PROPOSAL,
  OPT_PICTURE,
  OPT_DEGREE,
  OPT_SMOOTH,
  OPT_CLOSED,
  OPT_CONTOUR, /* last of what is fitted */
  OPT_INFLECTIONS,
  OPT_SIGN,
  OPT_SIGNIFICANCE,
  OPT_KNOTS,
  OPT_TOLERANCE,
  OPT_PARAMETERS,
  OPT_DOMAIN,
  OPT_ENDS,
  OPT_START_TANGENT,
  OPT_END_TANGENT, /* last of what is wanted of the curve */
  OPT_ROUNDS,
  OPT_ROUNDS_TOL,
  OPT_CORRECTION,
  OPT_TENSION,
  OPT_MARGIN,
  OPT_CONSTRUCTION, /* last of how it is found */
  OPT_UNIT,
  OPT_DEVIATION
};

static const cli_option table[] = {
    {"output", 'o', "FILE",
     "curve, by extension: .json (reads back to the same bits), .step .stp .iges .igs (CAD),\n"
     ".svg, .vtu (Bezier curves), .vtp .vtk (polylines), .csv (points, curvature); may be\ngiven more than once"},
    {"unconstrained", OPT_UNCONSTRAINED, "FILE", "the fit without inequalities, to compare with; formats as -o"},
    {"proposal", OPT_PROPOSAL, "FILE",
     "inflections as the data propose them, with their significance, .json: to be edited and\ngiven to "
     "--inflections"},
    {"picture", OPT_PICTURE, "FILE", "both fits with control polygons, curvature combs and plots, .png or .svg"},
    CLI_OPTION_REPORT,
    {"degree", OPT_DEGREE, "D", "smoothness + 1 to 9; default 3"},
    {"smooth", OPT_SMOOTH, "L", "continuous derivatives, 1 or 2; default 2"},
    {"closed", OPT_CLOSED, NULL, "smooth closed curves; the first point may be there again at the end"},
    {"contour", OPT_CONTOUR, "N", "only this one of the file, counted from 0"},
    {"inflections", OPT_INFLECTIONS, "LIST",
     "auto (those that the data speak for), none, parameters T1,T2,... or a FILE: numbers,\n"
     "or an edited --proposal; default auto"},
    {"sign", OPT_SIGN, "SIDE", "to which the curve turns at its start: auto, left or right; default auto"},
    {"significance", OPT_SIGNIFICANCE, "S",
     "with auto: standard deviations of noise that a bend must have to count; default 4"},
    {"knots", OPT_KNOTS, "WHAT",
     "auto, the number N of polynomial pieces, or a FILE of inner knots; inflections become\nknots too; default "
     "auto"},
    {"tolerance", OPT_TOLERANCE, "T",
     "with auto knots: as few pieces as bring all points within T of the fit without\ninequalities"},
    {"parameters", OPT_PARAMETERS, "HOW",
     "chord, centripetal, uniform, foley, or file (column t); default file, else chord"},
    {"domain", OPT_DOMAIN, "T0,T1",
     "of the file's parameters; closed curves: T1 is where the first point comes again, by\n"
     "default where it does in the file"},
    {"ends", OPT_ENDS, "HOW", "free, or fixed: the curve begins and ends in the first and last point; default free"},
    {"start-tangent", OPT_START_TANGENT, "X,Y", "direction in which the curve begins"},
    {"end-tangent", OPT_END_TANGENT, "X,Y", "direction in which it ends"},
    {"rounds", OPT_ROUNDS, "N", "of inequalities and quadratic program at most, to 100; default 10"},
    {"rounds-tol", OPT_ROUNDS_TOL, "T",
     "a round that lowers the sum of squares by a smaller part is the last; default 1e-3"},
    {"correction", OPT_CORRECTION, "N", "passes of parameter correction in a round, 0 keeps them; default 3"},
    {"tension", OPT_TENSION, "W", "weight of stiffness beside the mean square distance; default 1e-9"},
    {"margin", OPT_MARGIN, "M", "inequalities hold by this part of what the reference has; default 1e-3"},
    {"construction", OPT_CONSTRUCTION, "N",
     "of the reference: 1 (directions of legs) or 2 (removal of knots); default: the nearer"},
    {"unit", OPT_UNIT, "NAME", "of lengths in STEP and IGES: mm, cm, m or inch; default mm"},
    {"deviation", OPT_DEVIATION, "T", "of polylines and points from the curve; default 1e-4 of its size"},
    {"size", CLI_KEY_SIZE, "W,H", "picture's size in pixels; default 1600 wide and as high as it needs"},
    CLI_OPTION_TITLE,
    CLI_OPTION_MEMORY,
    CLI_OPTION_THREADS,
    CLI_OPTION_QUIET,
    CLI_OPTION_HELP,
    {0},
};

static void print_help(void) {
  printf(
      "usage: batten curve POINTS [OPTIONS]\n\n"
      "Fits a smooth spline curve to points in order whose curvature is proven to have the wanted signs: exactly\n"
      "the wanted inflections, no wiggle. POINTS: x y, or x y z of a plane, with names in the first line also t\n"
      "(parameter) and w (weight): .txt .xyz .csv .dat; several contours parted by blank lines, by lines\n"
      "`contour N`, or by a column contour; tables of airfoils (Selig, Lednicer); also with .gz.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: noisy points of a wave, whose inflections are found\n\n"
      "  awk 'BEGIN { srand(3); for (i = 0; i <= 80; i++)\n"
      "    print i / 10, sin(i / 10) + 0.1 * (rand() - 0.5) }' > wave.txt\n"
      "  batten curve wave.txt -o wave.step -o wave.json --picture wave.png --report wave.report.json\n"
      "\nexample: a convex closed curve through points of a circle\n\n"
      "  awk 'BEGIN { srand(5); for (i = 0; i < 40; i++)\n"
      "    print cos(i * 0.157) + 0.05 * rand(), sin(i * 0.157) + 0.05 * rand() }' > ring.txt\n"
      "  batten curve ring.txt --closed --inflections none -o ring.svg\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

static bool take_fitted(curve_request *q, int key, const char *v) {
  size_t count = 0;
  switch (key) {
    case OPT_DEGREE:
      if (!cli_parse_count("--degree", v, 2, BATTEN_CURVE_DEGREE_MAX, &count)) return false;
      q->options.degree = (unsigned)count;
      return true;
    case OPT_SMOOTH:
      if (!cli_parse_count("--smooth", v, 1, 2, &count)) return false;
      q->options.smoothness = (unsigned)count;
      return true;
    case OPT_CLOSED:
      q->options.closed = 1;
      return true;
    default:
      q->alone = true;
      return cli_parse_count("--contour", v, 0, SIZE_MAX, &q->contour);
  }
}

static bool take_parameters(curve_request *q, const char *v) {
  static const char *const words[] = {"chord", "centripetal", "uniform", "foley", "file", NULL};
  int word = 0;
  if (!cli_parse_word("--parameters", v, words, &word)) return false;
  q->file_parameters = word == 4;
  q->own_parameters = word != 4;
  if (word != 4) q->options.parametrization = (batten_contour_parametrization)word;
  return true;
}

/* Numbers, a word, or the name of a file. */
static bool take_inflections(curve_request *q, const char *v) {
  batten_contour_options *o = &q->options;
  free(q->list);
  q->list = NULL;
  q->wishes_file = NULL;
  o->inflections = NULL;
  o->inflection_count = strcmp(v, "auto") == 0 ? BATTEN_INFLECTIONS_AUTO : 0;
  if (strcmp(v, "auto") == 0 || strcmp(v, "none") == 0) return true;
  if (v[strspn(v, "0123456789.,+-eE")] != '\0') {
    q->wishes_file = v;
    return true;
  }
  size_t count = 1;
  for (const char *c = v; *c; c++) count += *c == ',';
  q->list = malloc(count * sizeof *q->list);
  if (!q->list) {
    cli_error("out of memory");
    return false;
  }
  o->inflection_count = count;
  o->inflections = q->list;
  return cli_parse_numbers("--inflections", v, count, q->list);
}

static bool take_knots(curve_request *q, const char *v) {
  q->options.spans = 0;
  q->knots_file = NULL;
  if (strcmp(v, "auto") == 0) return true;
  if (v[strspn(v, "0123456789")] == '\0') return cli_parse_count("--knots", v, 1, 1000000, &q->options.spans);
  q->knots_file = v;
  return true;
}

static bool take_direction(const char *option, const char *v, double out[2]) {
  if (!cli_parse_numbers(option, v, 2, out)) return false;
  bool any = out[0] < 0 || out[0] > 0 || out[1] < 0 || out[1] > 0;
  if (!any) cli_error("%s: '%s' is no direction", option, v);
  return any;
}

static bool take_wanted(curve_request *q, int key, const char *v) {
  static const char *const sides[] = {"auto", "left", "right", NULL}, *const ends[] = {"free", "fixed", NULL};
  batten_contour_options *o = &q->options;
  int word = 0;
  switch (key) {
    case OPT_INFLECTIONS:
      return take_inflections(q, v);
    case OPT_SIGN:
      if (!cli_parse_word("--sign", v, sides, &word)) return false;
      o->sign = word == 2 ? -1 : word;
      return true;
    case OPT_SIGNIFICANCE:
      return cli_parse_number("--significance", v, 1e-300, 1e300, &o->significance);
    case OPT_KNOTS:
      return take_knots(q, v);
    case OPT_TOLERANCE:
      return cli_parse_number("--tolerance", v, 1e-300, 1e300, &o->tolerance);
    case OPT_PARAMETERS:
      return take_parameters(q, v);
    case OPT_DOMAIN:
      return cli_parse_numbers("--domain", v, 2, o->domain);
    case OPT_ENDS:
      if (!cli_parse_word("--ends", v, ends, &word)) return false;
      o->fix_ends[0] = o->fix_ends[1] = word;
      return true;
    case OPT_START_TANGENT:
      return take_direction("--start-tangent", v, o->end_tangents[0]);
    default:
      return take_direction("--end-tangent", v, o->end_tangents[1]);
  }
}

static bool take_way(curve_request *q, int key, const char *v) {
  batten_contour_options *o = &q->options;
  size_t count = 0;
  switch (key) {
    case OPT_ROUNDS:
      if (!cli_parse_count("--rounds", v, 1, BATTEN_CONTOUR_ROUNDS_MAX, &count)) return false;
      o->rounds = (unsigned)count;
      return true;
    case OPT_ROUNDS_TOL:
      return cli_parse_number("--rounds-tol", v, 0, 1, &o->rounds_tol);
    case OPT_CORRECTION:
      if (!cli_parse_count("--correction", v, 0, 1000, &count)) return false;
      o->correction_passes = (unsigned)count;
      return true;
    case OPT_TENSION:
      return cli_parse_number("--tension", v, 0, 1e300, &o->tension);
    case OPT_MARGIN:
      return cli_parse_number("--margin", v, 1e-12, 0.5, &o->margin);
    default:
      if (!cli_parse_count("--construction", v, 1, 2, &count)) return false;
      o->construction = (unsigned)count;
      return true;
  }
}

static bool take(cli_request *common, int key, const char *v) {
  static const char *const units[] = {"mm", "cm", "m", "inch", NULL};
  curve_request *q = (curve_request *)common;
  int word = 0;
  if (key == 'o') return cli_outputs_add(&common->outputs, CLI_OUTPUT_CURVE, v);
  if (key == OPT_UNCONSTRAINED) return cli_outputs_add(&common->outputs, CLI_OUTPUT_CURVE_FREE, v);
  if (key == OPT_PROPOSAL) return cli_outputs_add(&common->outputs, CLI_OUTPUT_PROPOSAL, v);
  if (key == OPT_PICTURE) return cli_outputs_add(&common->outputs, CLI_OUTPUT_PLOTS, v);
  if (key < CLI_KEY_OWN) return cli_take_picture(&q->picture, key, v);
  if (key <= OPT_CONTOUR) return take_fitted(q, key, v);
  if (key <= OPT_END_TANGENT) return take_wanted(q, key, v);
  if (key <= OPT_CONSTRUCTION) return take_way(q, key, v);
  if (key == OPT_DEVIATION) return cli_parse_number("--deviation", v, 1e-300, 1e300, &q->write.tolerance);
  if (!cli_parse_word("--unit", v, units, &word)) return false;
  q->write.unit = (batten_length_unit)word;
  return true;
}

/* ---- what is wanted ------------------------------------------------------------------------------ */

static bool has_output(const curve_work *w, cli_output_kind kind) {
  const cli_outputs *o = &w->request->common.outputs;
  for (size_t i = 0; i < o->count; i++)
    if (o->items[i].kind == kind) return true;
  return false;
}

/* Parameters of a closed contour tell where the first point comes again if it is there again, as in the .csv that is
 * written. */
static batten_status find_period(curve_work *w, curve_item *item) {
  batten_contour_options *o = &item->options;
  if (!o->closed || !o->parameters || !isnan(o->domain[0])) return BATTEN_OK;
  const double *first = item->points, *last = item->points + 2 * (item->count - 1);
  if (item->count < 2 || first[0] < last[0] || first[0] > last[0] || first[1] < last[1] || first[1] > last[1])
    return batten_fail(
        w->run.ctx, BATTEN_E_INVALID,
        "points: closed contour %zu has parameters, but does not tell where its first point comes again; "
        "repeat it at the end, or give --domain",
        item->number);
  o->domain[0] = o->parameters[0];
  o->domain[1] = o->parameters[item->count - 1];
  return BATTEN_OK;
}

/* Contour i of the file becomes item k. */
static batten_status take_contour(curve_work *w, size_t i, size_t k) {
  const curve_request *q = w->request;
  const batten_contours *c = &w->contours;
  curve_item *item = &w->items[k];
  size_t first = c->starts[i];
  *item = (curve_item){.number = i, .count = c->starts[i + 1] - first, .points = c->points + 2 * first};
  item->options = q->options;
  if (c->weights) item->options.weights = c->weights + first;
  if (c->parameters && !q->own_parameters) item->options.parameters = c->parameters + first;
  if (q->wishes_file) {
    const curve_wishes *all = &w->wishes;
    if (all->count != 1 && i >= all->count)
      return batten_fail(w->run.ctx, BATTEN_E_INVALID, "%s: inflections of %zu contours, but there are %zu",
                         q->wishes_file, all->count, c->count);
    const curve_wish *wish = &all->items[all->count == 1 ? 0 : i];
    item->options.inflection_count = wish->count;
    item->options.inflections = wish->inflections;
    if (!item->options.sign) item->options.sign = wish->sign;
  }
  if (c->planes) w->planes[k] = c->planes[i];
  batten_status st = find_period(w, item);
  if (st < 0) return st;
  item->parameters = batten_alloc_array(w->run.ctx, item->count, sizeof *item->parameters);
  return item->parameters ? BATTEN_OK : BATTEN_E_NOMEM;
}

static batten_status take_contours(curve_work *w) {
  const curve_request *q = w->request;
  batten_context *ctx = w->run.ctx;
  size_t all = w->contours.count, wanted = q->alone ? 1 : all;
  if (q->alone && q->contour >= all)
    return batten_fail(ctx, BATTEN_E_INVALID, "--contour: %zu; the last of the file is %zu", q->contour, all - 1);
  if (q->file_parameters && !w->contours.parameters)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "points: no column t in the file; name it in its first line, or leave --parameters");
  w->items = batten_alloc_array(ctx, wanted, sizeof *w->items);
  if (w->contours.planes) w->planes = batten_alloc_array(ctx, wanted, sizeof *w->planes);
  if (!w->items || (w->contours.planes && !w->planes)) return BATTEN_E_NOMEM;
  for (size_t k = 0; k < wanted; k++) {
    w->items[k] = (curve_item){0};
    w->count++;
    batten_status st = take_contour(w, q->alone ? q->contour : k, k);
    if (st < 0) return st;
  }
  return BATTEN_OK;
}

static batten_status read_input(curve_work *w) {
  double start = batten_now();
  curve_request *q = w->request;
  batten_context *ctx = w->run.ctx;
  batten_status st = BATTEN_OK;
  if (q->wishes_file) st = curve_read_wishes(ctx, q->wishes_file, &w->wishes);
  if (st >= 0 && q->knots_file) st = curve_read_numbers(ctx, q->knots_file, &q->options.break_count, &w->knots);
  q->options.breaks = w->knots;
  if (st >= 0) st = batten_read_contours(ctx, q->common.input, &w->contours);
  if (st >= 0) st = take_contours(w);
  w->time_read_s = batten_now() - start;
  return st;
}

/* ---- phases -------------------------------------------------------------------------------------- */

/* A text about one contour of several says which. */
static batten_status name_contour(curve_work *w, const curve_item *item, batten_status st) {
  if (st == BATTEN_OK || w->contours.count == 1 || st == BATTEN_E_CANCELLED) return st;
  char text[896];
  snprintf(text, sizeof text, "%s", batten_error(w->run.ctx));
  return batten_fail(w->run.ctx, st, "contour %zu: %s", item->number, text);
}

/* The first warning is kept, and its text told. */
static batten_status note(curve_work *w, curve_item *item, batten_status st) {
  st = name_contour(w, item, st);
  cli_run_warn(&w->run, st);
  item->status = st;
  if (st > 0 && w->status == BATTEN_OK) w->status = st;
  return st;
}

static batten_status fit(curve_work *w) {
  bool propose = has_output(w, CLI_OUTPUT_PROPOSAL) || (has_output(w, CLI_OUTPUT_PLOTS) && w->count == 1);
  batten_context *ctx = w->run.ctx;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < w->count; i++) {
    curve_item *c = &w->items[i];
    if (propose) {
      double start = batten_now();
      st = name_contour(w, c, batten_contour_propose(ctx, c->count, c->points, &c->options, &c->proposal));
      w->time_propose_s += batten_now() - start;
    }
    if (st >= 0)
      st = note(w, c,
                batten_contour_fit(ctx, c->count, c->points, &c->options, &c->curve, c->parameters, &c->unconstrained,
                                   &c->info));
    double start = batten_now();
    if (st >= 0) st = batten_curve_measure(ctx, c->curve, &c->measures);
    w->time_measure_s += batten_now() - start;
  }
  return st;
}

static batten_status write_curves(curve_work *w, bool unconstrained, const cli_output *f) {
  batten_write_curves_options o = w->request->write;
  const batten_curve **list = malloc(w->count * sizeof *list);
  char *name = cli_product_name(f->path);
  batten_status st = BATTEN_E_NOMEM;
  o.planes = w->planes;
  o.name = name;
  if (list && name) {
    for (size_t i = 0; i < w->count; i++) list[i] = unconstrained ? w->items[i].unconstrained : w->items[i].curve;
    st = batten_write_curves(w->run.ctx, w->count, list, &o, f->staged ? f->staged : f->target);
  }
  free(name);
  free(list);
  return st;
}

static int write_outputs(curve_work *w) {
  curve_request *q = w->request;
  double start = batten_now();
  for (size_t i = 0; i < q->common.outputs.count; i++) {
    const cli_output *f = &q->common.outputs.items[i];
    const char *path = f->staged ? f->staged : f->target;
    batten_status st = BATTEN_OK;
    if (f->kind == CLI_OUTPUT_CURVE || f->kind == CLI_OUTPUT_CURVE_FREE)
      st = write_curves(w, f->kind == CLI_OUTPUT_CURVE_FREE, f);
    else if (f->kind == CLI_OUTPUT_PLOTS)
      st = curve_draw(w, path);
    else if (f->kind == CLI_OUTPUT_PROPOSAL && !curve_write_proposals(w, path, f->path))
      return CLI_FAILED;
    if (st < 0) return cli_run_failed(&w->run, st);
  }
  w->time_write_s = batten_now() - start;
  cli_report report; /* last: it tells the times of the others */
  cli_report_open(&report);
  curve_report(w, &report);
  bool ok = cli_report_write(&report, &q->common.outputs);
  cli_report_close(&report);
  cli_run_clear(&w->run);
  if (cli_interrupted()) return cli_run_failed(&w->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(&q->common.outputs) ? CLI_DONE : CLI_FAILED;
}

static void work_free(curve_work *w) {
  batten_context *ctx = w->run.ctx;
  for (size_t i = 0; i < w->count; i++) {
    curve_item *c = &w->items[i];
    batten_curve_free(c->curve);
    batten_curve_free(c->unconstrained);
    batten_contour_proposal_free(ctx, &c->proposal);
    batten_free(ctx, c->parameters);
  }
  curve_wishes_free(ctx, &w->wishes);
  batten_free(ctx, w->knots);
  batten_free(ctx, w->planes);
  batten_free(ctx, w->items);
  batten_contours_free(ctx, &w->contours);
  cli_run_close(&w->run);
}

static int work(cli_request *common) {
  curve_request *q = (curve_request *)common;
  curve_work w = {.request = q};
  if (!cli_run_open(&w.run, common->threads, common->memory, common->quiet)) return CLI_FAILED;
  w.run.input = common->input;
  w.run.outputs = &common->outputs;
  batten_status st = read_input(&w);
  if (st >= 0) st = fit(&w);
  int status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !common->quiet && !cli_outputs_to_stdout(&common->outputs)) curve_summary(&w);
  work_free(&w);
  return status;
}

int cli_curve(int argc, char **argv) {
  static const cli_command command = {"curve", "file of points", table, print_help, take, work};
  curve_request q = {.options = batten_contour_options_default(),
                     .write = batten_write_curves_options_default(),
                     .picture = batten_picture_options_default()};
  q.picture.width = 1600;
  q.picture.height = 0; /* as needed */
  int status = cli_command_run(&command, &q.common, argc, argv);
  free(q.list);
  return status;
}
