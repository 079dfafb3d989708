/* What `batten qp` and `batten inspect` share about quadratic programs: counts, names, figures. */
#ifndef BATTEN_CLI_QP_H
#define BATTEN_CLI_QP_H

#include "cli.h"

/* Entries that are not 0, and the range of their sizes (NaN without any). */
typedef struct qp_range {
  size_t entries;
  double least, largest;
} qp_range;

typedef struct qp_counts {
  size_t unknowns, rows, equalities, squares;
  size_t bounds;              /* finite bounds of unknowns */
  qp_range a, h, c, g, sides; /* sides: of rows and bounds, finite ones */
} qp_counts;

typedef struct qp_request {
  cli_request common;
  const char *start; /* file of an earlier solution, or NULL */
  batten_qp_options options;
} qp_request;

typedef struct qp_work {
  qp_request *request;
  cli_run run;
  batten_qp_file file;
  qp_counts counts;
  batten_qp_solution start, solution; /* start: of --start, else without arrays */
  batten_qp_info info;
  batten_status status; /* of solving */
  double time_read_s, time_write_s;
} qp_work;

void qp_count(const batten_qp_problem *p, qp_counts *out);
const char *qp_engine_name(batten_qp_engine engine);

/* Is the status one that proves or says something about the problem, so that figures are there? */
bool qp_has_figures(batten_status status);

/* unknowns, rows, ... of a problem into a report. */
void qp_report_counts(const qp_counts *c, const batten_qp_file *file, cli_report *r);
void qp_print_counts(const qp_counts *c, const batten_qp_file *file);
void qp_print_ranges(const qp_counts *c);

void qp_report(const qp_work *w, cli_report *r);
void qp_summary(const qp_work *w);

/* Why there is no solution: one line, with the constraints or unknowns that weigh most in the proof. */
void qp_explain(const qp_work *w, char *text, size_t size);

#endif
