/* batten qp: solves a quadratic program from a file.
 *
 * Phases: read, solve, write. Also a proof that there is no solution is a result: solution and report are then
 * written too, and the exit status is 1. */
#include "qp.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* ---- command line -------------------------------------------------------------------------------- */

enum { OPT_WRITE = CLI_KEY_OWN, OPT_ENGINE, OPT_TOLERANCE, OPT_EXACT, OPT_START, OPT_TIME_LIMIT, OPT_ITERATIONS };

static const cli_option table[] = {
    {"output", 'o', "FILE",
     "solution: .json with multipliers and active set, .csv of x alone; may be given\nmore than once"},
    CLI_OPTION_REPORT,
    {"write", OPT_WRITE, "FILE", "the problem itself, as .qps or .json"},
    {"engine", OPT_ENGINE, "NAME",
     "auto (by estimated cost), primal or dual (active sets), interior (point);\ndefault auto"},
    {"tolerance", OPT_TOLERANCE, "T",
     "residuals and gap within T + T times their scale count as solved; default\n1e-9"},
    {"exact", OPT_EXACT, NULL, "move x until every inequality holds exactly in floating point"},
    {"start", OPT_START, "FILE",
     "start from x and active set of an earlier solution (.json of -o), also of a\nslightly other problem of the "
     "same size"},
    {"time-limit", OPT_TIME_LIMIT, "S", "stop after so many seconds, with the best feasible point; default none"},
    {"iterations", OPT_ITERATIONS, "N", "stop after so many pivots or interior steps; default by size, generous"},
    CLI_OPTION_MEMORY,
    CLI_OPTION_THREADS,
    CLI_OPTION_QUIET,
    CLI_OPTION_HELP,
    {0},
};

static void print_help(void) {
  printf(
      "usage: batten qp PROBLEM [OPTIONS]\n\n"
      "Solves a convex quadratic program: least squares or a Hessian, under two-sided rows and bounds. PROBLEM: "
      ".qps\n"
      ".sif .mps (fixed or free columns), .json, .mat (P q r l u A, as the Maros-Meszaros problems are handed on),\n"
      "also with .gz.\n\n");
  cli_options_print(table);
  printf(
      "\nexample: the point nearest to (1, 2.5) below three lines\n\n"
      "  echo '{\"batten\": \"qp\", \"version\": 1, \"A\": [[1, 0], [0, 1]], \"b\": [1, 2.5],\n"
      "    \"C\": [[1, -2], [-1, -2], [-1, 2]], \"lower\": [-2, -6, -2], \"x_lower\": [0, 0]}' > near.json\n"
      "  batten qp near.json -o near-x.csv --report near-figures.json\n\n"
      "exit status: 0 done (a warning on stderr and `status` in the report say when to look twice), 1 could not, or\n"
      "there is no solution (infeasible, unbounded, not convex, or a limit came first; a solution .json then holds "
      "the\n"
      "proof), 2 wrong usage, 130 interrupted\n");
}

static bool take(cli_request *common, int key, const char *v) {
  static const char *const engines[] = {"auto", "primal", "dual", "interior", NULL};
  qp_request *q = (qp_request *)common;
  batten_qp_options *o = &q->options;
  int word = 0;
  switch (key) {
    case 'o':
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_QP_SOLUTION, v);
    case OPT_WRITE:
      return cli_outputs_add(&common->outputs, CLI_OUTPUT_QP, v);
    case OPT_ENGINE:
      if (!cli_parse_word("--engine", v, engines, &word)) return false;
      o->engine = (batten_qp_engine)word;
      return true;
    case OPT_TOLERANCE:
      if (!cli_parse_number("--tolerance", v, 1e-300, 1, &o->tolerance_relative)) return false;
      o->tolerance_absolute = o->tolerance_relative;
      return true;
    case OPT_EXACT:
      o->exact = 1;
      return true;
    case OPT_START:
      q->start = v;
      return true;
    case OPT_TIME_LIMIT:
      return cli_parse_number("--time-limit", v, 1e-9, INFINITY, &o->time_limit_s);
    default:
      return cli_parse_count("--iterations", v, 1, SIZE_MAX - 1, &o->iteration_limit);
  }
}

/* ---- phases -------------------------------------------------------------------------------------- */

/* Where --start is given, it takes the place of the file's x0. */
static batten_status read_start(qp_work *w) {
  batten_context *ctx = w->run.ctx;
  size_t n = w->counts.unknowns, all = n + w->counts.rows;
  if (!w->request->start) return BATTEN_OK;
  w->start.x = batten_alloc_array(ctx, n, sizeof *w->start.x);
  w->start.active = batten_alloc_array(ctx, all, sizeof *w->start.active);
  if (!w->start.x || !w->start.active) return BATTEN_E_NOMEM;
  return batten_read_qp_solution(ctx, &w->file, w->request->start, &w->start);
}

static batten_status solve(qp_work *w) {
  batten_context *ctx = w->run.ctx;
  batten_qp_options o = w->request->options;
  size_t n = w->counts.unknowns, all = n + w->counts.rows;
  batten_qp_solution *s = &w->solution;
  s->x = batten_alloc_array(ctx, n, sizeof *s->x);
  s->ray = batten_alloc_array(ctx, n, sizeof *s->ray);
  s->multipliers = batten_alloc_array(ctx, all, sizeof *s->multipliers);
  s->certificate = batten_alloc_array(ctx, all, sizeof *s->certificate);
  s->active = batten_alloc_array(ctx, all, sizeof *s->active);
  if (!s->x || !s->ray || !s->multipliers || !s->certificate || !s->active) return BATTEN_E_NOMEM;
  o.x0 = w->start.x ? w->start.x : w->file.x0;
  o.active = w->start.active;
  return batten_qp_solve(ctx, &w->file.problem, &o, NULL, s, &w->info);
}

static bool is_json(const char *path) {
  size_t length = strlen(path);
  return length >= 5 && strcasecmp(path + length - 5, ".json") == 0;
}

static batten_status write_solution(qp_work *w, cli_output *f) {
  const char *path = f->staged ? f->staged : f->target;
  if (w->status < 0 && !is_json(f->path)) { /* there is no x: an older file of the name stays */
    free(f->staged);
    f->staged = NULL;
    return BATTEN_OK;
  }
  return batten_write_qp_solution(w->run.ctx, &w->file, w->status, &w->solution, path);
}

/* Everything to its staged name, the report last, for it tells the times of the others. */
static int write_outputs(qp_work *w) {
  cli_outputs *outputs = &w->request->common.outputs;
  double start = batten_now();
  for (size_t i = 0; i < outputs->count; i++) {
    cli_output *f = &outputs->items[i];
    batten_status st = BATTEN_OK;
    if (f->kind == CLI_OUTPUT_QP_SOLUTION) st = write_solution(w, f);
    if (f->kind == CLI_OUTPUT_QP) st = batten_write_qp(w->run.ctx, &w->file, f->staged ? f->staged : f->target);
    if (st < 0) return cli_run_failed(&w->run, st);
  }
  w->time_write_s = batten_now() - start;
  cli_report report;
  cli_report_open(&report);
  qp_report(w, &report);
  bool ok = cli_report_write(&report, outputs);
  cli_report_close(&report);
  cli_run_clear(&w->run);
  if (cli_interrupted()) return cli_run_failed(&w->run, BATTEN_E_CANCELLED);
  return ok && cli_outputs_commit(outputs) ? CLI_DONE : CLI_FAILED;
}

static void work_free(qp_work *w) {
  batten_context *ctx = w->run.ctx;
  if (!ctx) return;
  batten_free(ctx, w->start.x);
  batten_free(ctx, w->start.active);
  batten_free(ctx, w->solution.x);
  batten_free(ctx, w->solution.ray);
  batten_free(ctx, w->solution.multipliers);
  batten_free(ctx, w->solution.certificate);
  batten_free(ctx, w->solution.active);
  batten_qp_file_free(ctx, &w->file);
  cli_run_close(&w->run);
}

static int work(cli_request *q) {
  qp_work w = {.request = (qp_request *)q};
  char text[1024];
  if (!cli_run_open(&w.run, q->threads, q->memory, q->quiet)) return CLI_FAILED;
  w.run.input = q->input;
  w.run.outputs = &q->outputs;
  double start = batten_now();
  batten_status st = batten_read_qp(w.run.ctx, q->input, &w.file);
  if (st >= 0) {
    qp_count(&w.file.problem, &w.counts);
    st = read_start(&w);
  }
  w.time_read_s = batten_now() - start;
  if (st >= 0) w.status = st = solve(&w);
  if (st < 0 && qp_has_figures(st)) qp_explain(&w, text, sizeof text);
  int status = !qp_has_figures(st) || cli_interrupted() ? cli_run_failed(&w.run, st) : CLI_DONE;
  if (status == CLI_DONE && st > 0) cli_run_warn(&w.run, st);
  if (status == CLI_DONE) status = write_outputs(&w);
  if (status == CLI_DONE && st < 0) {
    cli_error("%s", text);
    status = CLI_FAILED;
  }
  if (status == CLI_DONE && !q->quiet && !cli_outputs_to_stdout(&q->outputs)) qp_summary(&w);
  work_free(&w);
  return status;
}

int cli_qp(int argc, char **argv) {
  static const cli_command command = {"qp", "problem", table, print_help, take, work};
  qp_request q = {.options = batten_qp_options_default()};
  return cli_command_run(&command, &q.common, argc, argv);
}
