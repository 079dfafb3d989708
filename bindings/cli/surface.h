/* Figures that a tensor-product surface itself has, for the commands that make or look at one. */
#ifndef BATTEN_CLI_SURFACE_H
#define BATTEN_CLI_SURFACE_H

#include "cli.h"

void surface_report_form(const batten_surface_form *form, cli_report *r);
void surface_report_convexity(const batten_convexity *c, cli_report *r);
void surface_report_measures(const batten_surface_measures *m, cli_report *r);
void surface_print_form(const batten_surface_form *form);
void surface_print_convexity(const batten_convexity *c);
void surface_print_measures(const batten_surface_measures *m);

/* Whether the sections v = const lie in parallel planes, and the proof of their signs if they do. */
batten_status surface_prove_sections(batten_context *ctx, const batten_surface *surface, bool *plane,
                                     batten_sections *out);
/* plane false: the keys are null. */
void surface_report_sections(bool plane, const batten_sections *s, cli_report *r);
void surface_print_sections(const batten_sections *s);

#endif
