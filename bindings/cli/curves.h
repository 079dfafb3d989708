/* Figures that planar curves themselves have, for the commands that make or look at some. */
#ifndef BATTEN_CLI_CURVES_H
#define BATTEN_CLI_CURVES_H

#include "cli.h"

/* Sums, extremes and lists of curves [count]. */
void curves_report_form(size_t count, const batten_curve *const *curves, cli_report *r);
void curves_report_measures(size_t count, const batten_curve_measures *measures, cli_report *r);
void curves_print_form(size_t count, const batten_curve *const *curves);
void curves_print_measures(size_t count, const batten_curve_measures *measures);

#endif
