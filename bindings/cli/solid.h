/* What the parts of `batten solid` share: the request of the command line, and the work's state. */
#ifndef BATTEN_CLI_SOLID_H
#define BATTEN_CLI_SOLID_H

#include "body.h"

typedef struct solid_request {
  cli_request common;
  const char *carrier;
  batten_solid_options fit;
  body_request body;
} solid_request;

typedef struct solid_work {
  solid_request *request;
  cli_run run;
  batten_cloud cloud;
  batten_carrier *carrier; /* NULL = the library's own choice */
  batten_solid_info info;
  body body;
  double time_read_s;
} solid_work;

void solid_report(const solid_work *w, cli_report *r);
void solid_summary(const solid_work *w);

#endif
