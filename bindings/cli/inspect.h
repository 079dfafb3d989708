/* batten inspect on solids and what they are made of: inspect_solids.c. */
#ifndef BATTEN_CLI_INSPECT_H
#define BATTEN_CLI_INSPECT_H

#include "cli.h"

void inspect_box(cli_report *r, bool print, unsigned n, const double *lower, const double *upper);

batten_status inspect_solid(cli_run *run, const char *path, bool print, cli_report *r);
batten_status inspect_carrier(cli_run *run, const char *path, bool print, cli_report *r);
batten_status inspect_sections(cli_run *run, const char *path, bool print, cli_report *r);
batten_status inspect_frep(cli_run *run, const char *path, bool print, cli_report *r);

#endif
