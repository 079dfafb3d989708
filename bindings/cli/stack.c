/* batten stack: contours in planes to a solid, its surface, a picture, figures.
 *
 * Phases: read, build, cut at the deck (hulls), surface, measures, write. All outputs are checked before the first
 * and appear after the last, or not at all. */
#include "stack.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- command line -------------------------------------------------------------------------------- */

enum {
  OPT_GAP = BODY_KEY_OWN,
  OPT_POINTS,
  OPT_METHOD,
  OPT_TOLERANCE,
  OPT_PAIR_DISTANCE,
  OPT_MIN_AREA,
  OPT_APEX,
  OPT_BETWEEN,
  OPT_SHAPE,
  OPT_SCALES,
  OPT_SATURATION,
  OPT_ENDS,
  OPT_END_HEIGHT,
  OPT_ROTATION,
  OPT_PATH,
  OPT_PARAMETER,
  OPT_ROUTE,
  OPT_LINK,
  OPT_DRAUGHTS
};

static const cli_option table[] = {
    BODY_OPTION_OUTPUT(";\nmay be given more than once"),
    {"picture", BODY_KEY_PICTURE, "FILE", "shaded view, .png"},
    CLI_OPTION_REPORT,
    BODY_OPTION_SAVE,
    {"gap", OPT_GAP, "H", "distance of sections where the file tells no heights, or where there is only one"},
    {"points", OPT_POINTS, NULL, "points in no order: the file's points are put into planes first"},
    {"method", OPT_METHOD, "NAME",
     "sections from pairs (contours in order: centres beside the curve, sign certified),\n"
     "points (in no order: carrier, check, cure) or carrier (the carrier alone); default\n"
     "pairs, with --points points"},
    {"tolerance", OPT_TOLERANCE, "T",
     "how far sections may miss their points; default a tenth of the distance of\nneighbouring points, at most a "
     "thousandth of the sections' size"},
    {"pair-distance", OPT_PAIR_DISTANCE, "P",
     "of centres beside the curve over the distance of points, to 1; default 0.75"},
    {"min-area", OPT_MIN_AREA, "A", "smaller contours are left out and told; default a quarter of a spacing squared"},
    {"apex", OPT_APEX, NULL, "a first or last section of one or two points closes the solid there"},
    {"between", OPT_BETWEEN, "NAME",
     "sections: natural, not-a-knot (C2 splines; the latter for smooth bodies cut finely),\n"
     "monotone, linear or rational; default natural"},
    {"shape", OPT_SHAPE, "C", "of rational, positive; 1 is linear; default 1"},
    {"scales", OPT_SCALES, "S0,S1,...",
     "a factor for each section: above 1 draws the solid between towards it; default 1"},
    {"saturation", OPT_SATURATION, "W",
     "section functions level off at W gaps, `none` not at all (smooth bodies); default 2"},
    {"ends", OPT_ENDS, "RULE[,RULE]",
     "flat (half a gap beyond), plane, rounded or open, of the first and the last section;\ndefault flat"},
    {"end-height", OPT_END_HEIGHT, "G[,G]", "gaps that flat or rounded ends reach; default 0.5 and 1"},
    {"rotation", OPT_ROTATION, "NAME",
     "of planes that are not parallel: spherical (C1), geodesic or logarithm (the paper's);\ndefault spherical"},
    {"path", OPT_PATH, "NAME", "of their origins: cubic or linear; default cubic"},
    {"parameter", OPT_PARAMETER, "NAME",
     "of a point between them: root (a moving plane meets it) or ratio (of distances, the\npaper's); default root"},
    {"route", OPT_ROUTE, "NAME",
     "auto, sections, or space (one spline through all points, for planes in no sequence);\ndefault auto"},
    {"link", OPT_LINK, NULL, "join pieces whose sections do not overlap; the sections stay as they are"},
    {"draughts", OPT_DRAUGHTS, "Z,...", "report the volume below these heights"},
    {"cell", BODY_KEY_CELL, "LENGTH",
     "edge length of the mesh; default from the points' spacing, but at most\n1/120 of the diagonal of their box"},
    BODY_OPTION_SHARP("35"),
    BODY_OPTION_BOX("the solid's box grown by 25 %"),
    BODY_OPTION_COLOR,
    {"dots", BODY_KEY_DOTS, NULL, "draw the contours' points in the picture"},
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
      "usage: batten stack CONTOURS [OPTIONS]\n\n"
      "Makes a smooth solid through plane sections: several contours in a plane, holes, branches, planes that are "
      "not\n"
      "parallel. CONTOURS: closed contours of points x y z in .txt .xyz .csv, parted by blank lines, by lines\n"
      "`contour N`, or by a column contour; tables of offsets of hulls (station, waterline, half_breadth); .json "
      "with\n"
      "the frame of each section; also with .gz. Contours in one plane are one section, parted by even-odd.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: a trunk that branches in two, from seven sections\n\n"
      "  awk 'BEGIN { for (k = 0; k <= 6; k++) for (s = -1; s <= 1; s += 2) { if (k < 3 && s > 0) continue\n"
      "    for (i = 0; i < 40; i++) { a = i * 0.15708; r = k < 3 ? 10 - k : 5\n"
      "      print (k < 3 ? 0 : s * (3 + k)) + r * cos(a), r * sin(a), 5 * k }; print \"\" } }' > trunk.txt\n"
      "  batten stack trunk.txt -o trunk.ply --picture trunk.png --report trunk.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

/* One or two words parted by a comma. */
static bool take_ends(stack_request *q, const char *v) {
  static const char *const rules[] = {"flat", "plane", "rounded", "open", NULL};
  char first[16];
  size_t length = strcspn(v, ",");
  int word = 0;
  snprintf(first, sizeof first, "%.*s", (int)(length < sizeof first ? length : sizeof first - 1), v);
  if (!cli_parse_word("--ends", first, rules, &word)) return false;
  q->options.ends[0] = q->options.ends[1] = (batten_stack_end)word;
  if (v[length] == '\0') return true;
  if (!cli_parse_word("--ends", v + length + 1, rules, &word)) return false;
  q->options.ends[1] = (batten_stack_end)word;
  return true;
}

static bool take_heights(stack_request *q, const char *v) {
  double *h = q->options.end_height;
  size_t count = strchr(v, ',') ? 2 : 1;
  if (!cli_parse_numbers("--end-height", v, count, h)) return false;
  if (count == 1) h[1] = h[0];
  for (size_t e = 0; e < 2; e++)
    if (!(h[e] > 0)) {
      cli_error("--end-height: %g; give gaps above 0, or --ends plane", h[e]);
      return false;
    }
  return true;
}

static bool take_between(stack_request *q, int key, const char *v) {
  static const char *const between[] = {"natural", "not-a-knot", "monotone", "linear", "rational", NULL};
  static const char *const rotations[] = {"spherical", "geodesic", "logarithm", NULL};
  static const char *const paths[] = {"cubic", "linear", NULL};
  static const char *const parameters[] = {"root", "ratio", NULL};
  static const char *const routes[] = {"auto", "sections", "space", NULL};
  batten_stack_options *o = &q->options;
  int word = 0;
  bool ok = true;
  switch (key) {
    case OPT_BETWEEN:
      ok = cli_parse_word("--between", v, between, &word);
      o->between = (batten_stack_between)word;
      return ok;
    case OPT_SHAPE:
      return cli_parse_number("--shape", v, 1e-300, 1e300, &o->shape);
    case OPT_SCALES:
      q->scales = v;
      return true;
    case OPT_SATURATION:
      o->saturation = INFINITY;
      return strcmp(v, "none") == 0 || cli_parse_number("--saturation", v, 1e-300, 1e300, &o->saturation);
    case OPT_ENDS:
      return take_ends(q, v);
    case OPT_END_HEIGHT:
      return take_heights(q, v);
    case OPT_ROTATION:
      ok = cli_parse_word("--rotation", v, rotations, &word);
      o->rotation = (batten_stack_rotation)word;
      return ok;
    case OPT_PATH:
      ok = cli_parse_word("--path", v, paths, &word);
      o->path = (batten_stack_path)word;
      return ok;
    case OPT_PARAMETER:
      ok = cli_parse_word("--parameter", v, parameters, &word);
      o->parameter = (batten_stack_parameter)word;
      return ok;
    case OPT_ROUTE:
      ok = cli_parse_word("--route", v, routes, &word);
      o->route = (batten_stack_route)word;
      return ok;
    case OPT_LINK:
      o->link = 1;
      return true;
    default:
      q->draughts = v;
      return true;
  }
}

static bool take(cli_request *common, int key, const char *v) {
  static const char *const methods[] = {"pairs", "points", "carrier", NULL};
  stack_request *q = (stack_request *)common;
  batten_stack_options *o = &q->options;
  int word = 0;
  bool ok = true;
  switch (key) {
    case OPT_GAP:
      ok = cli_parse_number("--gap", v, 1e-300, 1e300, &q->read.gap);
      o->gap = q->read.gap;
      return ok;
    case OPT_POINTS:
      q->read.points = 1;
      if (o->method == BATTEN_SECTION_PAIRS) o->method = BATTEN_SECTION_POINTS;
      return true;
    case OPT_METHOD:
      ok = cli_parse_word("--method", v, methods, &word);
      o->method = (batten_section_method)word;
      return ok;
    case OPT_TOLERANCE:
      return cli_parse_number("--tolerance", v, 1e-300, 1e300, &o->tolerance);
    case OPT_PAIR_DISTANCE:
      return cli_parse_number("--pair-distance", v, 1e-6, 1, &o->pair_distance);
    case OPT_MIN_AREA:
      return cli_parse_number("--min-area", v, 1e-300, 1e300, &o->min_area);
    case OPT_APEX:
      o->apex = 1;
      return true;
    default:
      return key >= BODY_KEY_OWN ? take_between(q, key, v) : body_take(common, &q->body, key, v);
  }
}

/* ---- phases -------------------------------------------------------------------------------------- */

static size_t count_numbers(const char *text) {
  size_t n = 1;
  for (; *text; text++) n += *text == ',';
  return n;
}

static batten_status read_sections(stack_work *w) {
  double start = batten_now();
  batten_status st = batten_read_sections(w->run.ctx, w->request->common.input, &w->request->read, &w->set);
  if (w->set.deck_count) w->request->options.apex = 1; /* stems of hulls */
  w->time_read_s = batten_now() - start;
  return st;
}

/* Lists of numbers, whose lengths are known only now. */
static int take_lists(stack_work *w) {
  stack_request *q = w->request;
  if (q->scales) {
    size_t count = count_numbers(q->scales);
    if (count != w->set.count) {
      cli_error("--scales: %zu numbers for %zu sections; give one for each", count, w->set.count);
      return CLI_USAGE;
    }
    w->scales = batten_alloc_array(w->run.ctx, count, sizeof *w->scales);
    if (!w->scales) return cli_run_failed(&w->run, BATTEN_E_NOMEM);
    if (!cli_parse_numbers("--scales", q->scales, count, w->scales)) return CLI_USAGE;
    q->options.scales = w->scales;
  }
  if (q->draughts) {
    w->draught_count = count_numbers(q->draughts);
    w->draughts = batten_alloc_array(w->run.ctx, w->draught_count, 2 * sizeof *w->draughts);
    if (!w->draughts) return cli_run_failed(&w->run, BATTEN_E_NOMEM);
    w->displacements = w->draughts + w->draught_count;
    if (!cli_parse_numbers("--draughts", q->draughts, w->draught_count, w->draughts)) return CLI_USAGE;
  }
  return CLI_DONE;
}

/* What lies below the deck, as a tree over x and z moved into space. */
static batten_status make_deck(stack_work *w, batten_frep **out) {
  static const double upright[9] = {1, 0, 0, 0, 0, 1, 0, 1, 0}; /* the profile's y becomes z, its height y */
  static const double nowhere[3] = {0, 0, 0};
  batten_context *ctx = w->run.ctx;
  const batten_section_set *set = &w->set;
  double lower[3], upper[3];
  batten_solid_box(w->body.solid, lower, upper);
  double far = 0;
  for (size_t k = 0; k < 3; k++) far += upper[k] - lower[k];
  size_t n = set->deck_count, starts[2] = {0, n + 4};
  double *points = batten_alloc_array(ctx, n + 4, 2 * sizeof *points);
  batten_frep *profile = NULL, *prism = NULL;
  batten_status st = points ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) {
    double *p = points;
    *p++ = set->deck[0] - far;
    *p++ = set->deck[1];
    memcpy(p, set->deck, 2 * n * sizeof *p);
    p += 2 * n;
    *p++ = set->deck[2 * n - 2] + far;
    *p++ = set->deck[2 * n - 1];
    *p++ = set->deck[2 * n - 2] + far;
    *p++ = lower[2] - far;
    *p++ = set->deck[0] - far;
    *p++ = lower[2] - far;
    st = batten_frep_polygon(ctx, 1, starts, points, &profile);
  }
  if (st >= 0) st = batten_frep_extrude(ctx, profile, -INFINITY, INFINITY, &prism);
  if (st >= 0) st = batten_frep_affine(ctx, prism, upright, nowhere, out);
  batten_frep_free(prism);
  batten_frep_free(profile);
  batten_free(ctx, points);
  return st;
}

/* A hull goes on above its deck, so that its edge is where the deck cuts it. */
static batten_status cut_deck(stack_work *w) {
  batten_context *ctx = w->run.ctx;
  batten_frep *hull = NULL, *deck = NULL, *cut = NULL;
  batten_solid *solid = NULL;
  double lower[3], upper[3], margin = 0;
  batten_solid_box(w->body.solid, lower, upper);
  for (size_t k = 0; k < 3; k++) margin += 0.01 * (upper[k] - lower[k]);
  for (size_t k = 0; k < 3; k++) {
    lower[k] -= margin;
    upper[k] += margin;
  }
  batten_status st = batten_frep_solid(ctx, w->body.solid, &hull);
  if (st >= 0) st = make_deck(w, &deck);
  if (st >= 0) st = batten_frep_combine(ctx, BATTEN_FREP_INTERSECTION, hull, deck, BATTEN_R_MIN_MAX, &cut);
  if (st >= 0) st = batten_frep_to_solid(ctx, cut, lower, upper, 0, &solid);
  if (st >= 0) {
    batten_solid_free(w->body.solid);
    w->body.solid = solid;
  }
  batten_frep_free(cut);
  batten_frep_free(deck);
  batten_frep_free(hull);
  return st;
}

/* The surface is cut at the planes of open ends: these must be faces of a box. */
static batten_status open_box(stack_work *w) {
  const batten_stack_options *o = &w->request->options;
  batten_polygonize_options *surface = &w->request->body.surface;
  double lower[3], upper[3], extent = 0;
  if (w->request->body.box) return BATTEN_OK;
  if (o->ends[0] != BATTEN_END_OPEN && o->ends[1] != BATTEN_END_OPEN) return BATTEN_OK;
  const batten_section *first = w->set.sections;
  int axis = -1;
  for (int k = 0; k < 3; k++)
    if (fabs(first->rotation[2][k]) > 1 - 1e-12) axis = k;
  if (axis < 0 || !w->info.parallel)
    return batten_fail(
        w->run.ctx, BATTEN_E_INVALID,
        "--ends open: the planes are not x, y or z = const, so that no box cuts there; close the ends, "
        "or give --box");
  bool upwards = first->rotation[2][axis] > 0;
  batten_solid_box(w->body.solid, lower, upper);
  for (int k = 0; k < 3; k++) extent = fmax(extent, upper[k] - lower[k]);
  for (int k = 0; k < 3; k++) {
    surface->lower[k] = lower[k] - 0.25 * extent;
    surface->upper[k] = upper[k] + 0.25 * extent;
  }
  if (o->ends[upwards ? 0 : 1] == BATTEN_END_OPEN) surface->lower[axis] = lower[axis];
  if (o->ends[upwards ? 1 : 0] == BATTEN_END_OPEN) surface->upper[axis] = upper[axis];
  return BATTEN_OK;
}

static batten_status build(stack_work *w) {
  batten_status st = batten_stack_build(w->run.ctx, w->set.count, w->set.sections, &w->request->options,
                                        &w->body.solid, &w->info, &w->notes, &w->note_count);
  body_note(&w->body, st);
  if (st >= 0) st = open_box(w);
  if (st >= 0 && w->set.deck_count) st = cut_deck(w);
  return st;
}

/* Finer than the distance of points asks for where these are few: the surface between them is smooth. */
static double default_cell(const stack_work *w) {
  double lower[3], upper[3];
  batten_solid_box(w->body.solid, lower, upper);
  double diagonal = hypot(hypot(upper[0] - lower[0], upper[1] - lower[1]), upper[2] - lower[2]);
  return fmin(fmax(0.7 * w->info.spacing, diagonal / 200), diagonal / 120);
}

/* Volume of the part of a closed mesh below z = height: over each triangle's part below, the column up to the height.
 */
static double volume_below(const batten_mesh *mesh, double height) {
  const double *vertices = batten_mesh_vertices(mesh);
  const uint32_t *triangles = batten_mesh_triangles(mesh);
  double sum = 0;
  for (size_t t = 0; t < batten_mesh_triangle_count(mesh); t++) {
    double part[4][3];
    size_t count = 0;
    for (size_t k = 0; k < 3; k++) {
      const double *a = vertices + 3 * (size_t)triangles[3 * t + k];
      const double *b = vertices + 3 * (size_t)triangles[3 * t + (k + 1) % 3];
      if (a[2] < height) memcpy(part[count++], a, sizeof *part);
      if ((a[2] < height) == (b[2] < height)) continue;
      double share = (height - a[2]) / (b[2] - a[2]);
      for (size_t i = 0; i < 3; i++) part[count][i] = a[i] + share * (b[i] - a[i]);
      count++;
    }
    for (size_t k = 2; k < count; k++) { /* area seen from above times mean depth, less where seen from below */
      const double *a = part[0], *b = part[k - 1], *c = part[k];
      double area = ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2;
      sum -= area * (height - (a[2] + b[2] + c[2]) / 3);
    }
  }
  return sum;
}

static void measure_draughts(stack_work *w) {
  bool closed = w->body.measures.closed && w->body.measures.oriented;
  for (size_t i = 0; i < w->draught_count; i++)
    w->displacements[i] = closed ? volume_below(w->body.mesh, w->draughts[i]) : NAN;
}

static int write_outputs(stack_work *w) {
  batten_status st = body_write(&w->body);
  if (st < 0) return cli_run_failed(&w->run, st);
  cli_report report; /* last: it tells the times of the others */
  cli_report_open(&report);
  stack_report(w, &report);
  int status = body_finish(&w->body, &report);
  cli_report_close(&report);
  return status;
}

static void work_free(stack_work *w) {
  batten_context *ctx = w->run.ctx;
  body_free(&w->body);
  batten_solid_free(w->body.solid);
  batten_section_set_free(ctx, &w->set);
  batten_free(ctx, w->scales);
  batten_free(ctx, w->draughts);
  batten_free(ctx, w->notes);
  cli_run_close(&w->run);
}

static int work(cli_request *q) {
  stack_work w = {.request = (stack_request *)q};
  w.body = (body){.request = &w.request->body, .common = q, .run = &w.run};
  if (!cli_run_open(&w.run, q->threads, q->memory, q->quiet)) return CLI_FAILED;
  w.run.input = q->input;
  w.run.outputs = &q->outputs;
  int status = body_check(&w.body, 3);
  batten_status st = status == CLI_DONE ? read_sections(&w) : BATTEN_OK;
  if (status == CLI_DONE && st >= 0) status = take_lists(&w);
  if (status != CLI_DONE) goto done;
  if (st >= 0) st = build(&w);
  if (st >= 0) st = body_mesh(&w.body, default_cell(&w));
  if (st >= 0) measure_draughts(&w);
  status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !q->quiet && !cli_outputs_to_stdout(&q->outputs)) stack_summary(&w);
done:
  work_free(&w);
  return status;
}

int cli_stack(int argc, char **argv) {
  static const cli_command command = {"stack", "file of contours", table, print_help, take, work};
  stack_request q = {.read = batten_read_sections_options_default(),
                     .options = batten_stack_options_default(),
                     .body = body_request_default()};
  q.body.surface.sharp_deg = BODY_SHARP_DEG;
  return cli_command_run(&command, &q.common, argc, argv);
}
