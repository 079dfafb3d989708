/* The context of a run, its progress bar, and Ctrl-C.
 *
 * The bar is drawn on stderr when that is a terminal and the work lasts; it is gone before anything else is said.
 * Ctrl-C asks the library to cancel, so that files in the making are removed; a second one ends at once. */
#include "cli.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static volatile sig_atomic_t interrupted;

static void note_interrupt(int signal_number) {
  (void)signal_number;
  interrupted = 1;
}

bool cli_interrupted(void) { return interrupted != 0; }

static const double patience_s = 0.5, redraw_s = 0.1;

static int show(void *user, const char *phase, double fraction) {
  cli_run *run = user;
  if (interrupted) return 1;
  double now = batten_now();
  if (!run->bar || now - run->started < patience_s || now - run->drawn < redraw_s) return 0;
  enum { CELLS = 32 };
  char cells[CELLS + 1];
  int full = (int)(fraction * CELLS + 0.5);
  for (int i = 0; i < CELLS; i++) cells[i] = i < full ? '#' : '.';
  cells[CELLS] = '\0';
  fprintf(stderr, "\r\033[K%-12.24s [%s] %3.0f %%  %.0f s", phase, cells, 100 * fraction, now - run->started);
  fflush(stderr);
  run->drawn = now;
  run->line = true;
  return 0;
}

void cli_run_clear(cli_run *run) {
  if (run->line) {
    fputs("\r\033[K", stderr);
    fflush(stderr);
  }
  run->line = false;
}

/* 0 when unknown. A request beyond it is refused with its size, before the system grants it and ends the program when
 * it is used. */
static size_t machine_memory(void) {
  long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
  return pages > 0 && page > 0 ? (size_t)pages / 10 * 9 * (size_t)page : 0;
}

bool cli_run_open(cli_run *run, unsigned threads, size_t memory_limit, bool quiet) {
  *run = (cli_run){.quiet = quiet, .bar = !quiet && isatty(STDERR_FILENO), .started = batten_now()};
  long cores = sysconf(_SC_NPROCESSORS_ONLN);
  run->threads = threads ? threads : cores > 64 ? 64 : cores > 0 ? (unsigned)cores : 1;
  batten_context_options o = batten_context_options_default();
  o.threads = run->threads;
  o.memory_limit = memory_limit ? memory_limit : machine_memory();
  o.progress = show;
  o.progress_user = run;
  batten_status st = batten_context_new(&o, &run->ctx);
  if (st < 0) {
    cli_error("%s", batten_status_text(st));
    return false;
  }
  struct sigaction action = {.sa_handler = note_interrupt, .sa_flags = (int)(SA_RESETHAND | SA_RESTART)};
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
  signal(SIGXFSZ, SIG_IGN); /* a file beyond the limit is an error of writing, after which what there is of it goes */
  return true;
}

void cli_run_close(cli_run *run) {
  cli_run_clear(run);
  batten_context_free(run->ctx);
  run->ctx = NULL;
}

/* Replaces every `from` in text [size] by `to`, as far as they fit. */
static void substitute(char *text, size_t size, const char *from, const char *to) {
  size_t length = strlen(to), cut = strlen(from);
  for (char *at = strstr(text, from); at; at = strstr(at + length, from)) {
    if (strlen(text) - cut + length + 1 > size) return;
    memmove(at + length, at + cut, strlen(at + cut) + 1);
    memcpy(at, to, length);
  }
}

/* Fields of options that are left: opt.rounds_tol is --rounds-tol, opt.degree[1] is --degree. */
static void name_options(char *text) {
  for (char *at = strstr(text, "opt."); at; at = strstr(at, "opt.")) {
    if (at > text && at[-1] != ' ' && at[-1] != '(') { /* part of a name */
      at += 4;
      continue;
    }
    memmove(at + 2, at + 4, strlen(at + 4) + 1);
    memcpy(at, "--", 2);
    for (at += 2; (*at >= 'a' && *at <= 'z') || *at == '_'; at++)
      if (*at == '_') *at = '-';
    char *end = *at == '[' ? strchr(at, ']') : NULL;
    if (end) memmove(at, end + 1, strlen(end + 1) + 1);
  }
}

/* Length of the input's name at the beginning of a text, 0 when it is not there. Long names are cut from the left. */
static size_t named_input(const char *own, const char *input) {
  size_t head = strcspn(own, ":"), length = input ? strlen(input) : 0;
  return head <= length && strncmp(input + length - head, own, head) == 0 ? head : 0;
}

/* Whether a text is about what the input holds. */
static bool about_input(const char *own) {
  static const char *const words[] = {"points",        "matrix",   "seeds",      "problem",        "edge",
                                      "vert",          "triangle", "mesh",       "opt.parameters", "opt.weights",
                                      "opt.triangles", "count",    "parameters", "contour",        "planes",
                                      "slice",         "sections", "a: ",        "field: "};
  for (size_t i = 0; i < sizeof words / sizeof *words; i++)
    if (strncmp(own, words[i], strlen(words[i])) == 0) return true;
  return false;
}

/* What the library calls otherwise than the command line, or does not offer as the remedy. */
static void use_words(char *text, size_t size) {
  static const char *const words[][2] = {
      {"opt.lower and opt.upper", "--box"},
      {"give lower and upper", "give --box"},
      {"opt.evaluations_max", "evaluations"},
      {"opt.normals", "normals in the file"},
      {"opt.spline.smoothing", "--smoothing"},
      {"opt.spline.saddle.accuracy", "--accuracy"},
      {"opt.saddle.accuracy", "--accuracy"},
      {"opt.saddle.method", "--method"},
      {"opt.spline.m ", "--order "},
      {"opt.spline.m:", "--order:"},
      {"opt.fit.", "opt."},
      {"see batten_loft_notes", "see remark in the report"},
      {"memory_limit", "--memory"},
      {"opt.width, opt.height", "--size"},
      {", or opt.improve larger than 0", ""},
      {"matrix.n: ", ""},
      {"planes[", "contours["},
      {"reverse it by batten_curve_reverse", "reverse its knots and control points in the file"},
      {"bring it there by batten_curve_transform", "scale its knots in the file"},
      {"(2 smooth_z + 1 .. degree_z_max), or 0", "(2 --smooth-z + 1 .. --degree-z-max)"},
      {"the context allows", "allowed are"},
      {"opt.time_limit_s", "--time-limit"},
      {"opt.iteration_limit", "--iterations"},
      {"batten_mesh_repair", "--repair"},
      {"opt.tolerance_relative", "--tolerance"},
      {"opt.tolerance_absolute", "--tolerance"},
      {"leave it 0 or take another fill", "leave it away, or take another --fill"},
      {"opt.creases", "--crease-edges"},
      {"opt.line_vertices", "--lines"},
      {"opt.weld_radius", "--weld"},
      {"opt.parametrize.triangles", "triangles"},
      {"opt.parameters", "parameters"},
      {"opt.weights", "weights"},
      {"opt.gap_tol", "--gap"},
      {"opt.triangles", "triangles"},
      {"opt.correction_passes", "--correction"},
      {"opt.width x height", "--size"},
      {"the context's limit is", "--memory allows"},
      {"but n = 3 was asked for; take n = 2", "a column z is missing"},
      {", or NaN for all four", ", or leave it away"},
      {", or NaN four times", ", or leave it away"},
      {"or all NaN there for their box", "or leave it away for their box"},
      {"leave parameters NULL", "take --parameters project"},
      {", or 0 for the most", ""},
      {", 0 = the most", ""},
  };
  if (strncmp(text, "noise: ", 7) == 0) substitute(text, size, "noise: ", "--smooth: "); /* of a mesh; not --noise */
  for (size_t i = 0; i < sizeof words / sizeof *words; i++) substitute(text, size, words[i][0], words[i][1]);
  name_options(text);
}

void cli_run_text(const cli_run *run, batten_status status, char *text, size_t size) {
  const char *own = batten_error(run->ctx), *input = run->input;
  size_t head = input ? named_input(own, input) : 0; /* the name of a file stays as it is */
  if (!*own)
    snprintf(text, size, "%s", batten_status_text(status));
  else if (head || !input || !about_input(own))
    snprintf(text, size, "%s", own);
  else {
    head = strlen(input) + 2;
    bool count = strncmp(own, "count: ", 7) == 0, faces = strncmp(own, "triangles: ", 11) == 0;
    bool tree = strncmp(own, "a: ", 3) == 0; /* the only one that there is */
    snprintf(text, size, "%s: %s%s", input, faces ? "--faces: " : "", own + (count ? 7 : faces ? 11 : tree ? 3 : 0));
  }
  if (head < strlen(text)) use_words(text + head, size - head);
  for (size_t i = 0; run->outputs && i < run->outputs->count; i++) {
    const cli_output *f = &run->outputs->items[i];
    if (f->staged) substitute(text, size, f->staged, f->path);
  }
}

int cli_run_failed(cli_run *run, batten_status status) {
  cli_run_clear(run);
  if (interrupted) {
    cli_error("interrupted; nothing was written");
    return CLI_INTERRUPTED;
  }
  char text[1024];
  cli_run_text(run, status, text, sizeof text);
  cli_error("%s", text);
  return CLI_FAILED;
}

void cli_run_warn(cli_run *run, batten_status status) {
  if (status <= 0) return;
  cli_run_clear(run);
  char text[1024];
  cli_run_text(run, status, text, sizeof text);
  cli_error("warning: %s", text);
}
