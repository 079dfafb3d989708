/* batten frep: a scene of the algebra of solids to its surface, a picture, figures.
 *
 * Phases: read, box, surface, measures, write. All outputs are checked before the first and appear after the last, or
 * not at all. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "body.h"

typedef struct frep_request {
  cli_request common;
  body_request body;
} frep_request;

typedef struct frep_work {
  frep_request *request;
  cli_run run;
  batten_frep *tree;
  size_t nodes; /* of the tree, shared ones counted once */
  body body;
  double time_read_s, time_search_s;
} frep_work;

static const cli_option table[] = {
    BODY_OPTION_OUTPUT("; outline of plane scenes:\n.svg .csv .xyz .txt .vtp .obj; may be given more than once"),
    {"picture", BODY_KEY_PICTURE, "FILE", "shaded view .png, of plane scenes .png or .svg"},
    CLI_OPTION_REPORT,
    BODY_OPTION_SAVE,
    {"cell", BODY_KEY_CELL, "LENGTH", "edge length of the mesh; default 1/150 of the diagonal of the box"},
    BODY_OPTION_SHARP("35"),
    BODY_OPTION_BOX("the one that\nthe bounds of the functions tell"),
    BODY_OPTION_COLOR,
    {"dots", BODY_KEY_DOTS, NULL, "draw the points that were found on the surface in the picture"},
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
      "usage: batten frep SCENE.json [OPTIONS]\n\n"
      "Makes the surface of a tree of solids: unions, intersections, blends, offsets, shells, metamorphoses, "
      "sweeps,\n"
      "deformations, over primitives and over solids that batten solid and batten stack have saved. All nodes and\n"
      "their arguments: docs/files.md.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: a block, twisted, with a bore and a rounded rod through it\n\n"
      "  cat > scene.json <<'END'\n"
      "  {\"batten\": \"frep\", \"version\": 1,\n"
      "   \"nodes\": {\n"
      "     \"block\": {\"node\": \"box\", \"center\": [0, 0, 0], \"half_extents\": [1, 1, 2], \"rounding\": 0.1},\n"
      "     \"twisted\": {\"node\": \"twist\", \"a\": \"block\", \"origin\": [0, 0, 0], \"axis\": [0, 0, 1], "
      "\"rate\": 0.4},\n"
      "     \"bore\": {\"node\": \"cylinder\", \"a\": [0, 0, -3], \"b\": [0, 0, 3], \"radius\": 0.5},\n"
      "     \"rod\": {\"node\": \"cylinder\", \"a\": [-2, 0, 0], \"b\": [2, 0, 0], \"radius\": 0.3, \"rounding\": "
      "0.1}},\n"
      "   \"root\": {\"node\": \"blend-union\", \"a0\": 0.2, \"a1\": 0.3, \"a2\": 0.3, \"b\": \"rod\",\n"
      "            \"a\": {\"node\": \"difference\", \"a\": \"twisted\", \"b\": \"bore\"}}}\n"
      "  END\n"
      "  batten frep scene.json -o scene.ply --picture scene.png --report scene_report.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not,\n"
      "2 wrong usage, 130 interrupted\n");
}

static bool take(cli_request *common, int key, const char *v) {
  frep_request *q = (frep_request *)common;
  return body_take(common, &q->body, key, v);
}

/* ---- phases -------------------------------------------------------------------------------------- */

/* How many different nodes there are: a list that grows by the children of its members. */
static batten_status count_nodes(frep_work *w) {
  batten_context *ctx = w->run.ctx;
  size_t count = 1, room = 64;
  const batten_frep **list = batten_alloc_array(ctx, room, sizeof *list);
  if (!list) return BATTEN_E_NOMEM;
  list[0] = w->tree;
  for (size_t i = 0; i < count; i++) {
    batten_frep_parts p = {.struct_size = sizeof p};
    batten_frep_get_parts(list[i], &p);
    if (count + p.child_count > room) {
      const batten_frep **larger = batten_realloc_array(ctx, list, room *= 2, sizeof *list);
      if (!larger) {
        batten_free(ctx, list);
        return BATTEN_E_NOMEM;
      }
      list = larger;
    }
    for (size_t k = 0; k < p.child_count; k++) {
      size_t at = 0;
      while (at < count && list[at] != p.children[k]) at++;
      if (at == count) list[count++] = p.children[k];
    }
  }
  w->nodes = count;
  batten_free(ctx, list);
  return BATTEN_OK;
}

/* The solid, with points on each piece of its surface that cells show: fine enough for the mesh to miss none. */
static batten_status find_solid(frep_work *w) {
  batten_polygonize_options *o = &w->request->body.surface;
  double start = batten_now(), lower[3] = {0}, upper[3] = {0};
  unsigned n = batten_frep_dimension(w->tree);
  batten_status st = BATTEN_OK;
  if (w->request->body.box) {
    memcpy(lower, o->lower, sizeof lower);
    memcpy(upper, o->upper, sizeof upper);
  } else
    st = batten_frep_box(w->run.ctx, w->tree, lower, upper);
  if (o->cell == 0) {
    for (unsigned k = 0; k < n; k++) o->cell = hypot(o->cell, upper[k] - lower[k]);
    o->cell /= n == 2 ? 500 : 150;
  }
  if (st >= 0) st = batten_frep_to_solid(w->run.ctx, w->tree, lower, upper, o->cell, &w->body.solid);
  w->time_search_s = batten_now() - start;
  return st;
}

static void report_keys(const frep_work *w, cli_report *r) {
  double lower[3], upper[3];
  unsigned n = batten_frep_dimension(w->tree);
  cli_report_text(r, "command", "frep");
  cli_report_common(r, &w->run, w->body.status);
  cli_report_text(r, "input", w->request->common.input);
  cli_report_count(r, "dimension", n);
  cli_report_count(r, "nodes", w->nodes);
  batten_solid_box(w->body.solid, lower, upper);
  if (n == 2) lower[2] = upper[2] = NAN;
  cli_report_box(r, 3, lower, upper);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_search_s", w->time_search_s);
  cli_report_number(r, "time_surface_s", w->body.time_surface_s);
  cli_report_number(r, "time_write_s", w->body.time_write_s);
  body_report(&w->body, r);
}

static int write_outputs(frep_work *w) {
  batten_status st = body_write(&w->body);
  if (st < 0) return cli_run_failed(&w->run, st);
  cli_report report; /* last: it tells the times of the others */
  cli_report_open(&report);
  report_keys(w, &report);
  int status = body_finish(&w->body, &report);
  cli_report_close(&report);
  return status;
}

static void print_summary(const frep_work *w) {
  cli_line("tree", "%zu node%s", w->nodes, w->nodes == 1 ? "" : "s");
  body_print(&w->body);
  body_print_end(&w->body, "search", w->time_search_s, w->time_read_s);
}

static void work_free(frep_work *w) {
  body_free(&w->body);
  batten_solid_free(w->body.solid);
  batten_frep_free(w->tree);
  cli_run_close(&w->run);
}

static int work(cli_request *q) {
  frep_work w = {.request = (frep_request *)q};
  w.body = (body){.request = &w.request->body, .common = q, .run = &w.run};
  if (!cli_run_open(&w.run, q->threads, q->memory, q->quiet)) return CLI_FAILED;
  w.run.input = q->input;
  w.run.outputs = &q->outputs;
  int status = CLI_DONE;
  batten_status st = batten_load_frep(w.run.ctx, q->input, &w.tree);
  w.time_read_s = batten_now() - w.run.started;
  if (st >= 0) st = count_nodes(&w);
  if (st >= 0) {
    status = body_check(&w.body, batten_frep_dimension(w.tree));
    if (status != CLI_DONE) goto done;
    st = find_solid(&w);
  }
  if (st >= 0) st = body_mesh(&w.body, 0);
  status = st < 0 ? cli_run_failed(&w.run, st) : write_outputs(&w);
  if (status == CLI_DONE && !q->quiet && !cli_outputs_to_stdout(&q->outputs)) print_summary(&w);
done:
  work_free(&w);
  return status;
}

int cli_frep(int argc, char **argv) {
  static const cli_command command = {"frep", "scene", table, print_help, take, work};
  frep_request q = {.body = body_request_default()};
  q.body.surface.sharp_deg = BODY_SHARP_DEG;
  return cli_command_run(&command, &q.common, argc, argv);
}
