/* The program batten: what its subcommands share.
 *
 * Exit status: 0 done, 1 could not (one line on stderr), 2 wrong usage (one line on stderr), 130 interrupted. */
#ifndef BATTEN_CLI_H
#define BATTEN_CLI_H

#include <batten/exchange.h>
#include <getopt.h>
#include <jansson.h>
#include <limits.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>

enum { CLI_DONE = 0, CLI_FAILED = 1, CLI_USAGE = 2, CLI_INTERRUPTED = 130 };

/* ---- subcommands: argv[0] is the subcommand's name ---- */
int cli_solid(int argc, char **argv);
int cli_stack(int argc, char **argv);
int cli_frep(int argc, char **argv);
int cli_qp(int argc, char **argv);
int cli_network(int argc, char **argv);
int cli_convex(int argc, char **argv);
int cli_curve(int argc, char **argv);
int cli_loft(int argc, char **argv);
int cli_inspect(int argc, char **argv);

/* ---- options.c: one table gives the parser and the help ---- */
typedef struct cli_option {
  const char *name;     /* long name, NULL ends the table */
  int key;              /* what cli_options_next returns; a letter is a short option too */
  const char *argument; /* NULL = none; else its name in the help */
  const char *help;     /* lines after the first are indented */
} cli_option;

typedef struct cli_options {
  const char *command; /* "solid" */
  const cli_option *table;
  int argc;
  char **argv;
  struct option *longs;
  char *shorts;
  const char *value; /* of the option that cli_options_next returned */
} cli_options;

enum { CLI_OPTIONS_END = -1, CLI_OPTIONS_BAD = -2 };
/* False when out of memory. */
bool cli_options_open(cli_options *o, const char *command, const cli_option *table, int argc, char **argv);
/* Key of the next option, CLI_OPTIONS_END, or CLI_OPTIONS_BAD after a line on stderr. argv[optind ...] are the
 * operands at the end. */
int cli_options_next(cli_options *o);
void cli_options_close(cli_options *o);
void cli_options_print(const cli_option *table);

/* Values of options; false after a line on stderr. */
bool cli_parse_number(const char *option, const char *text, double lower, double upper, double *out);
bool cli_parse_count(const char *option, const char *text, size_t lower, size_t upper, size_t *out);
bool cli_parse_bytes(const char *option, const char *text, size_t *out); /* 500M, 2G, ... */
/* count finite numbers parted by commas. */
bool cli_parse_numbers(const char *option, const char *text, size_t count, double *out);
/* Index of the word in a NULL-ended list; suggests the nearest. */
bool cli_parse_word(const char *option, const char *text, const char *const *words, int *out);
/* The word of the list that looks most like text, or NULL when none does. */
const char *cli_nearest(const char *text, const char *const *words, size_t count);

/* "batten: ..." on stderr, one line; the second adds where help is and returns CLI_USAGE. */
void cli_error(const char *format, ...) BATTEN_PRINTF(1, 2);
int cli_usage(const char *command, const char *format, ...) BATTEN_PRINTF(2, 3);

struct cli_outputs;

/* ---- progress.c: context, progress bar, Ctrl-C ---- */
typedef struct cli_run {
  batten_context *ctx;
  bool quiet, bar; /* bar: stderr is a terminal */
  double started, drawn;
  bool line; /* the bar is on the screen */
  unsigned threads;
  const char *input;                 /* names the points in messages; NULL = none */
  const struct cli_outputs *outputs; /* their staged names are told as they were given; NULL = none */
} cli_run;

/* threads 0 = all cores, memory_limit 0 = 90 % of what the machine has. False after a line on stderr. Ctrl-C cancels
 * the library's work from here on. */
bool cli_run_open(cli_run *run, unsigned threads, size_t memory_limit, bool quiet);
void cli_run_close(cli_run *run);
void cli_run_clear(cli_run *run); /* removes the bar, before other output */
bool cli_interrupted(void);
/* Why the last call failed or warned, in the words of the command line. */
void cli_run_text(const cli_run *run, batten_status status, char *text, size_t size);
/* Prints it and returns the exit status. */
int cli_run_failed(cli_run *run, batten_status status);
/* A positive status is told on stderr. */
void cli_run_warn(cli_run *run, batten_status status);

/* ---- outputs.c: files that appear together, or not at all ---- */
typedef enum cli_output_kind {
  CLI_OUTPUT_SURFACE,
  CLI_OUTPUT_PICTURE, /* of solids in space or in the plane */
  CLI_OUTPUT_SHADED,  /* of surfaces */
  CLI_OUTPUT_REPORT,
  CLI_OUTPUT_SOLID,
  CLI_OUTPUT_NETWORK,
  CLI_OUTPUT_PATCH,         /* tensor-product surface */
  CLI_OUTPUT_UNCONSTRAINED, /* the same, to compare with */
  CLI_OUTPUT_CURVE,
  CLI_OUTPUT_CURVE_FREE, /* the same, to compare with */
  CLI_OUTPUT_PROPOSAL,   /* inflections as the data propose them */
  CLI_OUTPUT_PLOTS,      /* pictures in the plane */
  CLI_OUTPUT_CONTOURS,   /* of a loft, as curves */
  CLI_OUTPUT_SECTIONS,   /* with sections between them */
  CLI_OUTPUT_QP,
  CLI_OUTPUT_QP_SOLUTION
} cli_output_kind;

typedef struct cli_output {
  cli_output_kind kind;
  const char *path; /* as given */
  char *target;     /* where links lead; "-" = standard output */
  char *staged;     /* what is written until all are whole; NULL = target is written straight */
} cli_output;

typedef struct cli_outputs {
  size_t count, room;
  cli_output *items;
} cli_outputs;

bool cli_outputs_add(cli_outputs *o, cli_output_kind kind, const char *path);
/* Before the work begins: extensions, directories, permissions, the same name twice, the input's own name.
 * False after a line on stderr; *usage is set when it is the caller's mistake of usage. */
bool cli_outputs_check(cli_outputs *o, const char *input, bool *usage);
/* A report goes to standard output ("-"): nothing else may. */
bool cli_outputs_to_stdout(const cli_outputs *o);
/* dimension 2 or 3: formats that fit. */
bool cli_outputs_check_dimension(const cli_outputs *o, unsigned dimension);
/* Name of a product in a CAD file: that of the file as given, not that under which it grows; without extension. malloc;
 * NULL when out of memory. */
char *cli_product_name(const char *path);
/* Moves all into place; false after a line on stderr, with nothing new left. */
bool cli_outputs_commit(cli_outputs *o);
/* Removes what was staged and not committed. */
void cli_outputs_close(cli_outputs *o);

/* ---- command.c: what every subcommand does around its work ---- */

/* First member of each command's own request. */
typedef struct cli_request {
  const char *input;
  cli_outputs outputs;
  size_t memory;    /* 0 = default */
  unsigned threads; /* 0 = all cores */
  bool quiet, help;
} cli_request;

/* Keys of the options that commands share, and their rows; a command's own keys follow CLI_KEY_OWN. */
enum {
  CLI_KEY_REPORT = CHAR_MAX + 1,
  CLI_KEY_MEMORY,
  CLI_KEY_THREADS,
  CLI_KEY_VIEW,
  CLI_KEY_UP,
  CLI_KEY_SIZE,
  CLI_KEY_TITLE,
  CLI_KEY_OWN
};
#define CLI_OPTION_REPORT                                                                              \
  {                                                                                                    \
    "report", CLI_KEY_REPORT, "FILE",                                                                  \
        "figures as a flat JSON object (keys: docs/report.md); - prints them in\nplace of the summary" \
  }
#define CLI_OPTION_MEMORY \
  { "memory", CLI_KEY_MEMORY, "SIZE", "use at most so much, for instance 2G; default 90 % of what the machine has" }
#define CLI_OPTION_THREADS \
  { "threads", CLI_KEY_THREADS, "N", "threads; default all cores (BLAS has its own: OPENBLAS_NUM_THREADS)" }
#define CLI_OPTION_QUIET \
  { "quiet", 'q', NULL, "no summary, no progress" }
/* Of commands that draw; cli_take_picture takes them. */
#define CLI_OPTION_VIEW \
  { "view", CLI_KEY_VIEW, "AZ,EL", "direction of the picture's camera, degrees; default 35,22" }
#define CLI_OPTION_UP \
  { "up", CLI_KEY_UP, "AXIS", "x, y or z points upwards in the picture; default z" }
#define CLI_OPTION_SIZE \
  { "size", CLI_KEY_SIZE, "W,H", "picture's size in pixels; default 1200,900" }
#define CLI_OPTION_TITLE \
  { "title", CLI_KEY_TITLE, "TEXT", "title in the picture, ASCII" }
#define CLI_OPTION_HELP \
  { "help", 'h', NULL, "this text" }

typedef struct cli_command {
  const char *name, *operand; /* "qp", "problem" */
  const cli_option *table;
  void (*print_help)(void);
  bool (*take)(cli_request *q, int key, const char *value); /* own options; false after a line on stderr */
  int (*work)(cli_request *q);                              /* returns the exit status */
} cli_command;

/* One of the options of pictures into p; false after a line on stderr. */
bool cli_take_picture(batten_picture_options *p, int key, const char *value);

/* Parses, then prints the help or checks the outputs and works. Returns the exit status. */
int cli_command_run(const cli_command *c, cli_request *q, int argc, char **argv);

/* ---- report.c: a flat JSON object of figures ---- */
typedef struct cli_report {
  json_t *object;
  bool failed; /* out of memory at some point */
} cli_report;

void cli_report_open(cli_report *r);
void cli_report_close(cli_report *r);
/* Keys keep the order in which they are first set. NaN and infinities become null. */
void cli_report_number(cli_report *r, const char *key, double value);
void cli_report_count(cli_report *r, const char *key, size_t value);
void cli_report_integer(cli_report *r, const char *key, long long value);
void cli_report_bool(cli_report *r, const char *key, bool value);
void cli_report_text(cli_report *r, const char *key, const char *value); /* NULL = null */
void cli_report_null(cli_report *r, const char *key);
/* Lists: one figure for each round, say. */
void cli_report_numbers(cli_report *r, const char *key, size_t count, const double *values);
void cli_report_counts(cli_report *r, const char *key, size_t count, const size_t *values);
/* box_x_min, box_x_max, ... of n coordinates; centroid_x, ... */
void cli_report_box(cli_report *r, unsigned n, const double *lower, const double *upper);
void cli_report_centroid(cli_report *r, const double centroid[3]);
/* batten_version, blas, blas_threads, threads, status, status_text, time_total_s, peak_bytes. */
void cli_report_common(cli_report *r, const cli_run *run, batten_status status);
/* To each report among the outputs; false after a line on stderr. */
bool cli_report_write(const cli_report *r, const cli_outputs *outputs);

/* Lines "  name   value unit" on stdout. */
void cli_line(const char *name, const char *format, ...) BATTEN_PRINTF(2, 3);
/* The measures of a mesh, for both subcommands. */
void cli_report_mesh(cli_report *r, const batten_mesh_measures *m, const size_t *self_intersections);
void cli_print_mesh(const batten_mesh_measures *m);

#endif
