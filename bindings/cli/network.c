/* batten network: a triangle mesh to a smooth surface of Bezier triangles.
 *
 * Phases: read, prepare (repair, smooth, decimate), build, measure, write. All outputs are checked before the first
 * and appear after the last, or not at all. */
#include "network.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- command line -------------------------------------------------------------------------------- */

enum {
  OPT_PICTURE = CLI_KEY_OWN,
  OPT_CONTINUITY,
  OPT_FILL,
  OPT_NORMALS,
  OPT_NORMAL_PASSES,
  OPT_DIRECTION,
  OPT_LENGTH,
  OPT_FUNCTIONAL,
  OPT_WEIGHT_POWER,
  OPT_FIELD_WEIGHT,
  OPT_SOLVER,
  OPT_FAIR_PASSES, /* last of those that tell how to build */
  OPT_CREASES,
  OPT_CREASE_EDGES,
  OPT_CORNER,
  OPT_BOUNDARY_CURVES,
  OPT_LINES,
  OPT_REPAIR,
  OPT_WELD,
  OPT_SMOOTH,
  OPT_FACES, /* last of those about the mesh */
  OPT_STEP_FORM,
  OPT_UNIT,
  OPT_DENSITY,
  OPT_TOLERANCE,
  OPT_COLOR,
  OPT_RANGE,
  OPT_NO_EDGES
};

static const cli_option table[] = {
    {"output", 'o', "FILE",
     "surface, by extension: .step .stp .iges .igs (CAD), .json (reads back to the same\n"
     "bits), .vtu (Bezier triangles); or a mesh of it: .ply .obj .stl .off .vtp .vtk; may\nbe given more than once"},
    {"picture", OPT_PICTURE, "FILE", "shaded view .png, coloured by curvature"},
    CLI_OPTION_REPORT,
    {"continuity", OPT_CONTINUITY, "G1|G2",
     "of the curve network: G1 cubics, G2 quintics; default as the fill wants"},
    {"fill", OPT_FILL, "NAME",
     "how facets are filled: fair, fair-linear, degree7, degree6; of G1 networks: ss,\n"
     "ss-classic, peters (nearly smooth), pn (not smooth). Default auto: fair up to\n"
     "5000 triangles, then degree7 (for G1: ss)"},
    {"normals", OPT_NORMALS, "NAME", "to start from: angle, area, inverse-area or sphere; default angle"},
    {"normal-passes", OPT_NORMAL_PASSES, "N", "most passes of their optimisation, 0 keeps them; default 30"},
    {"direction", OPT_DIRECTION, "D2|D1", "of curves in tangent planes: plane curves or projected edges; default D2"},
    {"length", OPT_LENGTH, "L2|L1|L3|L4", "arc, chord, planar or space cubic of estimated curvature; default L2"},
    {"functional", OPT_FUNCTIONAL, "NAME", "simple or laplace-beltrami; default simple"},
    {"weight-power", OPT_WEIGHT_POWER, "P", "edges count length^-P; default 3, the paper has 0"},
    {"field-weight", OPT_FIELD_WEIGHT, "W", "of the cross-boundary field in G2 networks; default 0.32"},
    {"solver", OPT_SOLVER, "NAME", "auto, cg or direct; default auto"},
    {"fair-passes", OPT_FAIR_PASSES, "N", "most passes of the fair fill; default 12"},
    {"creases", OPT_CREASES, "DEG", "edges whose triangles differ by more degrees stay sharp; default none"},
    {"crease-edges", OPT_CREASE_EDGES, "FILE", "sharp edges: two or more vertex numbers a line, counted from 0"},
    {"corner", OPT_CORNER, "DEG", "creases and lines that turn by more have a corner there; default 60"},
    {"boundary-curves", OPT_BOUNDARY_CURVES, NULL, "the boundary forms smooth curves of its own"},
    {"lines", OPT_LINES, "FILE",
     "polylines along edges that become one smooth curve each: vertex numbers, a line each"},
    {"repair", OPT_REPAIR, NULL, "weld equal vertices, drop degenerate triangles, turn triangles to agree"},
    {"weld", OPT_WELD, "R", "as --repair, and weld vertices nearer than R"},
    {"smooth", OPT_SMOOTH, "S", "take noise of standard deviation S out of the mesh first"},
    {"faces", OPT_FACES, "N", "decimate the mesh to N triangles first"},
    {"step-form", OPT_STEP_FORM, "NAME",
     "faces in STEP and IGES: trimmed (one parallelogram each), quads (three), or\ndegenerate (a pole); default "
     "trimmed"},
    {"unit", OPT_UNIT, "NAME", "of lengths in STEP and IGES: mm, cm, m or inch; default mm"},
    {"density", OPT_DENSITY, "N", "segments of each edge in meshes; default 8"},
    {"tolerance", OPT_TOLERANCE, "T", "meshes within T of the surface, with at most --density segments"},
    {"color", OPT_COLOR, "WHAT", "picture: gauss, mean, isophotes, reflection or none; default gauss"},
    {"range", OPT_RANGE, "LOW,HIGH", "of the colours; default 2 % to 98 % of the area"},
    {"no-edges", OPT_NO_EDGES, NULL, "do not draw the patches' boundaries"},
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
      "usage: batten network MESH [OPTIONS]\n\n"
      "Makes a smooth surface of Bezier triangles through all vertices of a triangle mesh, one facet for each "
      "triangle,\n"
      "with normals that agree along all edges but those that are to be sharp. MESH: .ply .obj .off .stl, also with "
      ".gz.\n\n");
  cli_options_print(table);
  printf(
      "\nusual for scans and exports, in millimetres: mend, take out the noise, thin out, keep edges sharp\n\n"
      "  batten network scan.stl --repair --smooth 0.05 --faces 4000 --creases 40 -o part.step --picture part.png\n"
      "\nexample: a ball from an octahedron, for CAD, with picture and figures\n\n"
      "  printf 'v %%s\\n' '1 0 0' '0 1 0' '-1 0 0' '0 -1 0' '0 0 1' '0 0 -1' > octahedron.obj\n"
      "  printf 'f %%s\\n' '1 2 5' '2 3 5' '3 4 5' '4 1 5' '2 1 6' '3 2 6' '4 3 6' '1 4 6' >> octahedron.obj\n"
      "  batten network octahedron.obj -o ball.step --picture ball.png --report ball.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

/* How to build. */
static bool take_build_option(network_request *q, int key, const char *v) {
  static const char *const continuities[] = {"G1", "G2", NULL};
  static const char *const fills[] = {"auto",   "fair",    "fair-linear", "ss", "ss-classic",
                                      "peters", "degree7", "degree6",     "pn", NULL};
  static const char *const normals[] = {"angle", "area", "inverse-area", "sphere", NULL};
  static const char *const directions[] = {"D2", "D1", NULL};
  static const char *const lengths[] = {"L2", "L1", "L3", "L4", NULL};
  static const char *const functionals[] = {"simple", "laplace-beltrami", NULL};
  static const char *const solvers[] = {"auto", "cg", "direct", NULL};
  batten_network_options *o = &q->options;
  int word = 0;
  size_t count = 0;
  bool ok = true;
  switch (key) {
    case OPT_CONTINUITY:
      ok = cli_parse_word("--continuity", v, continuities, &word);
      o->continuity = (unsigned)word + 1;
      break;
    case OPT_FILL:
      ok = cli_parse_word("--fill", v, fills, &word);
      o->fill = (batten_network_fill)word;
      break;
    case OPT_NORMALS:
      ok = cli_parse_word("--normals", v, normals, &word);
      o->normals = (batten_normal_weights)word;
      break;
    case OPT_NORMAL_PASSES:
      ok = cli_parse_count("--normal-passes", v, 0, 10000, &count);
      o->normal_passes = (unsigned)count;
      break;
    case OPT_DIRECTION:
      ok = cli_parse_word("--direction", v, directions, &word);
      o->direction = (batten_network_direction)word;
      break;
    case OPT_LENGTH:
      ok = cli_parse_word("--length", v, lengths, &word);
      o->length = (batten_network_length)word;
      break;
    case OPT_FUNCTIONAL:
      ok = cli_parse_word("--functional", v, functionals, &word);
      o->functional = (batten_network_functional)word;
      break;
    case OPT_WEIGHT_POWER:
      return cli_parse_number("--weight-power", v, 0, 6, &o->weight_power);
    case OPT_FIELD_WEIGHT:
      return cli_parse_number("--field-weight", v, 0, 1e6, &o->field_weight);
    case OPT_SOLVER:
      ok = cli_parse_word("--solver", v, solvers, &word);
      o->solver = (batten_network_solver)word;
      break;
    default:
      ok = cli_parse_count("--fair-passes", v, 0, 10000, &count);
      o->fair_passes = (unsigned)count;
  }
  return ok;
}

/* What the mesh is to become before, and its features. */
static bool take_mesh_option(network_request *q, int key, const char *v) {
  switch (key) {
    case OPT_CREASES:
      return cli_parse_number("--creases", v, 0, 180, &q->options.crease_angle_deg);
    case OPT_CREASE_EDGES:
      q->crease_file = v;
      return true;
    case OPT_CORNER:
      return cli_parse_number("--corner", v, 0, 180, &q->options.corner_angle_deg);
    case OPT_BOUNDARY_CURVES:
      q->options.boundary_curves = 1;
      return true;
    case OPT_LINES:
      q->line_file = v;
      return true;
    case OPT_REPAIR:
      q->repair = true;
      return true;
    case OPT_WELD:
      q->repair = true;
      return cli_parse_number("--weld", v, 0, INFINITY, &q->weld);
    case OPT_SMOOTH:
      return cli_parse_number("--smooth", v, 1e-300, INFINITY, &q->smooth);
    default:
      return cli_parse_count("--faces", v, 1, UINT32_MAX, &q->faces);
  }
}

static bool take_write_option(network_request *q, int key, const char *v) {
  static const char *const forms[] = {"trimmed", "quads", "degenerate", NULL};
  static const char *const units[] = {"mm", "cm", "m", "inch", NULL};
  size_t count = 0;
  int word = 0;
  switch (key) {
    case OPT_STEP_FORM:
      if (!cli_parse_word("--step-form", v, forms, &word)) return false;
      q->write.form = (batten_cad_form)word;
      return true;
    case OPT_UNIT:
      if (!cli_parse_word("--unit", v, units, &word)) return false;
      q->write.unit = (batten_length_unit)word;
      return true;
    case OPT_DENSITY:
      if (!cli_parse_count("--density", v, 1, 512, &count)) return false;
      q->write.density = (unsigned)count;
      return true;
    default:
      return cli_parse_number("--tolerance", v, 1e-300, INFINITY, &q->write.tolerance);
  }
}

static bool take_view_option(network_request *q, int key, const char *v) {
  static const char *const colors[] = {"gauss", "mean", "isophotes", "reflection", "none", NULL};
  double pair[2] = {0};
  int word = 0;
  switch (key) {
    case OPT_COLOR:
      if (!cli_parse_word("--color", v, colors, &word)) return false;
      q->color = (network_color)word;
      return true;
    case OPT_RANGE:
      if (!cli_parse_numbers("--range", v, 2, pair)) return false;
      if (!(pair[0] < pair[1])) {
        cli_error("--range: '%s': the first must be below the second", v);
        return false;
      }
      q->picture.color_lower = pair[0];
      q->picture.color_upper = pair[1];
      return true;
    default:
      q->no_edges = true;
      return true;
  }
}

static bool take(cli_request *common, int key, const char *v) {
  network_request *q = (network_request *)common;
  if (key == 'o') return cli_outputs_add(&common->outputs, CLI_OUTPUT_NETWORK, v);
  if (key == OPT_PICTURE) return cli_outputs_add(&common->outputs, CLI_OUTPUT_SHADED, v);
  if (key < CLI_KEY_OWN) return cli_take_picture(&q->picture, key, v);
  if (key <= OPT_FAIR_PASSES) return take_build_option(q, key, v);
  if (key <= OPT_FACES) return take_mesh_option(q, key, v);
  if (key <= OPT_TOLERANCE) return take_write_option(q, key, v);
  return take_view_option(q, key, v);
}

/* ---- phases -------------------------------------------------------------------------------------- */

/* The first warning is kept. */
static void note(network_work *w, batten_status st) {
  cli_run_warn(&w->run, st);
  if (st > 0 && w->status == BATTEN_OK) w->status = st;
}

/* Puts a mesh made from w->mesh in its place. */
static void replace_mesh(network_work *w, batten_mesh *made) {
  batten_mesh_free(w->mesh);
  w->mesh = made;
}

/* Lists of vertices to pairs, one for each step. */
static batten_status read_creases(network_work *w) {
  size_t lists = 0, *starts = NULL, pairs = 0;
  uint32_t *vertices = NULL;
  batten_status st = network_read_lists(w->run.ctx, w->request->crease_file, &lists, &starts, &vertices);
  if (st < 0) return st;
  w->creases = batten_alloc_array(w->run.ctx, starts[lists], 2 * sizeof *w->creases);
  for (size_t l = 0; w->creases && l < lists; l++)
    for (size_t i = starts[l]; i + 1 < starts[l + 1]; i++, pairs++) {
      w->creases[2 * pairs] = vertices[i];
      w->creases[2 * pairs + 1] = vertices[i + 1];
    }
  w->request->options.creases = w->creases;
  w->request->options.crease_count = pairs;
  batten_free(w->run.ctx, starts);
  batten_free(w->run.ctx, vertices);
  return w->creases ? BATTEN_OK : BATTEN_E_NOMEM;
}

static batten_status read_input(network_work *w) {
  network_request *q = w->request;
  double start = batten_now();
  batten_status st = batten_read_mesh(w->run.ctx, q->common.input, &w->mesh);
  if (st >= 0 && q->crease_file) st = read_creases(w);
  if (st >= 0 && q->line_file) {
    st = network_read_lists(w->run.ctx, q->line_file, &q->options.line_count, &w->line_starts, &w->line_vertices);
    q->options.line_starts = w->line_starts;
    q->options.line_vertices = w->line_vertices;
  }
  w->time_read_s = batten_now() - start;
  return st;
}

/* Vertex numbers of creases and lines are those of the file: only what keeps them may come before. */
static batten_status prepare(network_work *w) {
  network_request *q = w->request;
  batten_context *ctx = w->run.ctx;
  double start = batten_now();
  batten_mesh *made = NULL;
  batten_status st = BATTEN_OK;
  w->prepared = (network_prepared){
      .faces_read = batten_mesh_triangle_count(w->mesh), .smooth_lambda = NAN, .decimate_distance = NAN};
  if (q->repair) {
    batten_mesh_repair_options o = batten_mesh_repair_options_default();
    o.weld_radius = q->weld;
    st = batten_mesh_repair(ctx, w->mesh, &o, &made, &w->prepared.repair);
    if (st >= 0) replace_mesh(w, made);
    if (st >= 0 && batten_mesh_triangle_count(w->mesh) == 0)
      st = batten_fail(ctx, BATTEN_E_INVALID, "mesh: none of its triangles is left by the repair; give less --weld");
  }
  if (st >= 0 && q->smooth > 0) {
    st = batten_mesh_smooth(ctx, w->mesh, q->smooth, &made, &w->prepared.smooth_lambda);
    if (st >= 0) replace_mesh(w, made);
    note(w, st);
  }
  if (st >= 0 && q->faces && q->faces < batten_mesh_triangle_count(w->mesh)) {
    st = batten_mesh_decimate(ctx, w->mesh, q->faces, &made, &w->prepared.decimate_distance);
    if (st >= 0) replace_mesh(w, made);
    note(w, st);
  }
  w->time_prepare_s = batten_now() - start;
  return st;
}

static batten_status build(network_work *w) {
  batten_status st = batten_network_build(w->run.ctx, w->mesh, &w->request->options, &w->network, &w->info);
  note(w, st);
  return st;
}

static batten_status measure(network_work *w) {
  double start = batten_now();
  batten_status st = batten_network_measure(w->run.ctx, w->network, &w->measures);
  if (st >= 0)
    st = batten_network_measure_continuity(w->run.ctx, w->network, w->request->options.check_samples, &w->continuity);
  w->time_measure_s = batten_now() - start;
  return st;
}

static batten_status write_surface(network_work *w, const cli_output *f) {
  batten_write_network_options o = w->request->write;
  char *name = cli_product_name(f->path);
  if (!name) return BATTEN_E_NOMEM;
  o.name = name;
  batten_status st = batten_write_network(w->run.ctx, w->network, &o, f->staged ? f->staged : f->target);
  free(name);
  return st;
}

/* Everything to its staged name, the report last, for it tells the times of the others. */
static int write_outputs(network_work *w) {
  network_request *q = w->request;
  double start = batten_now();
  for (size_t i = 0; i < q->common.outputs.count; i++) {
    const cli_output *f = &q->common.outputs.items[i];
    batten_status st = BATTEN_OK;
    if (f->kind == CLI_OUTPUT_NETWORK)
      st = write_surface(w, f);
    else if (f->kind == CLI_OUTPUT_SHADED)
      st = network_draw(w, f->staged ? f->staged : f->target);
    if (st < 0) return cli_run_failed(&w->run, st);
  }
  w->time_write_s = batten_now() - start;
  cli_report report;
  cli_report_open(&report);
  network_report(w, &report);
  bool ok = cli_report_write(&report, &q->common.outputs);
  cli_report_close(&report);
  cli_run_clear(&w->run);
  if (cli_interrupted()) return cli_run_failed(&w->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(&q->common.outputs) ? CLI_DONE : CLI_FAILED;
}

static void work_free(network_work *w) {
  batten_network_free(w->network);
  batten_mesh_free(w->mesh);
  batten_free(w->run.ctx, w->creases);
  batten_free(w->run.ctx, w->line_starts);
  batten_free(w->run.ctx, w->line_vertices);
  cli_run_close(&w->run);
}

static int work(cli_request *common) {
  network_request *q = (network_request *)common;
  network_work w = {.request = q};
  if ((q->crease_file || q->line_file) && (q->repair || q->faces))
    return cli_usage("network",
                     "--crease-edges and --lines number the vertices of the file: not with --repair, --weld "
                     "or --faces, which change them");
  if (!cli_run_open(&w.run, common->threads, common->memory, common->quiet)) return CLI_FAILED;
  w.run.input = common->input;
  w.run.outputs = &common->outputs;
  batten_status st = read_input(&w);
  if (st >= 0) st = prepare(&w);
  if (st >= 0) st = build(&w);
  if (st >= 0) st = measure(&w);
  int status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !common->quiet && !cli_outputs_to_stdout(&common->outputs)) network_summary(&w);
  work_free(&w);
  return status;
}

int cli_network(int argc, char **argv) {
  static const cli_command command = {"network", "mesh", table, print_help, take, work};
  network_request q = {.options = batten_network_options_default(),
                       .write = batten_write_network_options_default(),
                       .picture = batten_picture_options_default()};
  return cli_command_run(&command, &q.common, argc, argv);
}
