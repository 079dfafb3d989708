/* What the parts of `batten curve` share. */
#ifndef BATTEN_CLI_CURVE_H
#define BATTEN_CLI_CURVE_H

#include "cli.h"

/* Inflections of several contours, as `batten curve --proposal` writes and a person edits them. */
typedef struct curve_wish {
  size_t count;
  double *inflections;
  int sign;
} curve_wish;
typedef struct curve_wishes {
  size_t count;
  curve_wish *items;
} curve_wishes;

typedef struct curve_request {
  cli_request common;
  batten_contour_options options;
  batten_write_curves_options write;
  batten_picture_options picture;
  double *list;            /* --inflections 0.2,0.7 */
  const char *wishes_file; /* --inflections FILE; NULL = none */
  const char *knots_file;  /* --knots FILE; NULL = none */
  bool file_parameters;    /* those of the file are wanted */
  bool own_parameters;     /* they are to be estimated though the file has some */
  bool alone;              /* one contour of the file is wanted */
  size_t contour;          /* which, from 0 */
} curve_request;

/* One contour of the input and what became of it. */
typedef struct curve_item {
  size_t number; /* in the file, from 0 */
  size_t count;
  const double *points; /* [count][2] */
  batten_contour_options options;
  batten_curve *curve, *unconstrained;
  double *parameters; /* [count] */
  batten_contour_info info;
  batten_contour_proposal proposal; /* zero where none is wanted */
  batten_curve_measures measures;
  batten_status status;
} curve_item;

typedef struct curve_work {
  curve_request *request;
  cli_run run;
  batten_contours contours;
  size_t count; /* that are fitted */
  curve_item *items;
  batten_plane *planes; /* [count] or NULL */
  double *knots;        /* of knots_file */
  curve_wishes wishes;  /* of wishes_file */
  batten_status status; /* the first warning */
  double time_read_s, time_propose_s, time_measure_s, time_write_s;
} curve_work;

/* ---- curve_lists.c: inflections and knots from the command line and from files ------------------- */

/* Numbers of a text file, blanks, commas or lines between them, ascending: *numbers [*count], batten's. */
batten_status curve_read_numbers(batten_context *ctx, const char *path, size_t *count, double **numbers);

batten_status curve_read_wishes(batten_context *ctx, const char *path, curve_wishes *out);
void curve_wishes_free(batten_context *ctx, curve_wishes *wishes);
/* {"batten": "inflections", "version": 1, "contours": [...]} of what has been proposed. False when out of memory or
 * the file cannot be written, after a line on stderr. */
bool curve_write_proposals(const curve_work *w, const char *path, const char *shown);

/* ---- curve_picture.c ----------------------------------------------------------------------------- */

batten_status curve_draw(const curve_work *w, const char *path);

/* ---- curve_report.c ------------------------------------------------------------------------------ */

void curve_report(const curve_work *w, cli_report *r);
void curve_summary(const curve_work *w);

#endif
