/* Figures that a tensor-product surface itself has: the report's keys (docs/report.md), lines of the summary. */
#include "surface.h"

typedef struct sizes {
  size_t points[2], spans[2];
} sizes;

static sizes sizes_of(const batten_surface_form *form) {
  sizes s = {0};
  for (int i = 0; i < 2; i++) {
    s.points[i] = form->knot_count[i] - form->degree[i] - 1;
    for (size_t k = 1; k < form->knot_count[i]; k++) s.spans[i] += form->knots[i][k] > form->knots[i][k - 1];
  }
  return s;
}

void surface_report_form(const batten_surface_form *form, cli_report *r) {
  sizes s = sizes_of(form);
  cli_report_count(r, "degree_u", form->degree[0]);
  cli_report_count(r, "degree_v", form->degree[1]);
  cli_report_count(r, "spans_u", s.spans[0]);
  cli_report_count(r, "spans_v", s.spans[1]);
  cli_report_count(r, "control_points", s.points[0] * s.points[1]);
}

void surface_print_form(const batten_surface_form *form) {
  sizes s = sizes_of(form);
  cli_line("surface", "degree %u x %u, %zu x %zu control points, %zu x %zu span%s", form->degree[0], form->degree[1],
           s.points[0], s.points[1], s.spans[0], s.spans[1], s.spans[0] * s.spans[1] == 1 ? "" : "s");
}

void surface_report_convexity(const batten_convexity *c, cli_report *r) {
  cli_report_bool(r, "certified", c->certified != 0);
  cli_report_bool(r, "flat", c->flat != 0);
  cli_report_bool(r, "creased", c->creased != 0);
  cli_report_integer(r, "sign", c->sign);
  cli_report_number(r, "margin_min", c->margin_min);
  cli_report_number(r, "margin_u", c->worst_at[0]);
  cli_report_number(r, "margin_v", c->worst_at[1]);
  cli_report_count(r, "proof_boxes", c->boxes);
  cli_report_count(r, "proof_depth", c->depth);
  cli_report_count(r, "proof_unproven", c->unproven);
  cli_report_bool(r, "graph", c->graph != 0);
}

void surface_report_measures(const batten_surface_measures *m, cli_report *r) {
  cli_report_number(r, "K_min", m->gauss_min);
  cli_report_number(r, "K_max", m->gauss_max);
  cli_report_number(r, "K_min_u", m->gauss_min_at[0]);
  cli_report_number(r, "K_min_v", m->gauss_min_at[1]);
  cli_report_number(r, "K_max_u", m->gauss_max_at[0]);
  cli_report_number(r, "K_max_v", m->gauss_max_at[1]);
  cli_report_number(r, "K_p1", m->gauss_p01);
  cli_report_number(r, "K_p50", m->gauss_p50);
  cli_report_number(r, "K_p99", m->gauss_p99);
  cli_report_number(r, "K_integral", m->gauss_integral);
  cli_report_number(r, "H_min", m->mean_min);
  cli_report_number(r, "H_max", m->mean_max);
  cli_report_number(r, "regularity_min", m->regularity_min);
  cli_report_number(r, "supporting_gap", m->supporting_gap);
  cli_report_number(r, "area", m->area);
  cli_report_centroid(r, m->centroid);
  cli_report_box(r, 3, m->lower, m->upper);
}

void surface_print_convexity(const batten_convexity *c) {
  if (c->certified)
    cli_line("convexity", "proven: Gaussian curvature at least %.4g, in %zu box%s%s", c->margin_min, c->boxes,
             c->boxes == 1 ? "" : "es", c->graph ? "; no folds" : "");
  else if (c->flat)
    cli_line("convexity", "a plane");
  else if (c->creased)
    cli_line("convexity", "not proven: there is a crease near u = %.4g, v = %.4g that turns the wrong way",
             c->worst_at[0], c->worst_at[1]);
  else
    cli_line("convexity", "not proven: Gaussian curvature %.4g near u = %.4g, v = %.4g", c->margin_min,
             c->worst_at[0], c->worst_at[1]);
}

void surface_print_measures(const batten_surface_measures *m) {
  cli_line("curvature", "Gaussian %.4g .. %.4g, 1 %% to 99 %% of the area %.4g .. %.4g", m->gauss_min, m->gauss_max,
           m->gauss_p01, m->gauss_p99);
  cli_line("area", "%.9g", m->area);
  cli_line("box", "%.6g .. %.6g  x  %.6g .. %.6g  x  %.6g .. %.6g", m->lower[0], m->upper[0], m->lower[1],
           m->upper[1], m->lower[2], m->upper[2]);
}
