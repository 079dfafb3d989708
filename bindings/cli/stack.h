/* What the parts of `batten stack` share. */
#ifndef BATTEN_CLI_STACK_H
#define BATTEN_CLI_STACK_H

#include "body.h"

typedef struct stack_request {
  cli_request common;
  batten_read_sections_options read;
  batten_stack_options options;
  body_request body;
  const char *scales, *draughts;
} stack_request;

typedef struct stack_work {
  stack_request *request;
  cli_run run;
  batten_section_set set;
  double *scales; /* [set.count] or NULL */
  batten_stack_info info;
  batten_stack_note *notes;
  size_t note_count;
  size_t draught_count;
  double *draughts, *displacements; /* [draught_count] */
  body body;
  double time_read_s;
} stack_work;

void stack_report(const stack_work *w, cli_report *r);
void stack_summary(const stack_work *w);

#endif
