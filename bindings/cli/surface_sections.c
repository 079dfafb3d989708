/* The proof of plane sections v = const of a surface: the report's keys (docs/report.md), lines of the summary. */
#include <math.h>

#include "surface.h"

/* Twice the area vector of the triangle a b c. */
static void area_of(const double a[3], const double b[3], const double c[3], double out[3]) {
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    out[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
  }
}

/* The largest triangle of consecutive control points of any section tells the planes; false: there is none. */
static bool find_normal(const batten_surface_form *form, double normal[3]) {
  size_t nu = form->knot_count[0] - form->degree[0] - 1, nv = form->knot_count[1] - form->degree[1] - 1;
  double largest = 0;
  for (size_t i = 0; i + 2 < nu; i++)
    for (size_t j = 0; j < nv; j++) {
      const double *p = form->control_points + 3 * (i * nv + j);
      double area[3];
      area_of(p, p + 3 * nv, p + 6 * nv, area);
      double size = sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]);
      if (!(size > largest)) continue;
      largest = size;
      for (int k = 0; k < 3; k++) normal[k] = area[k] / size;
    }
  return largest > 0;
}

batten_status surface_prove_sections(batten_context *ctx, const batten_surface *surface, bool *plane,
                                     batten_sections *out) {
  batten_surface_form form = batten_surface_get(surface);
  batten_sections_options o = batten_sections_options_default();
  *plane = false;
  if (!find_normal(&form, o.normal)) return BATTEN_OK;
  batten_status st = batten_surface_certify_sections(ctx, surface, &o, out, NULL);
  *plane = st >= 0;
  return st == BATTEN_E_INVALID ? batten_fail(ctx, BATTEN_OK, "%s", "") : st; /* they are not plane */
}

void surface_report_sections(bool plane, const batten_sections *s, cli_report *r) {
  if (plane) {
    cli_report_count(r, "section_pairs", s->pairs);
    cli_report_count(r, "section_violations", s->violations);
    cli_report_bool(r, "sections_certified", s->certified != 0);
    return;
  }
  cli_report_null(r, "section_pairs");
  cli_report_null(r, "section_violations");
  cli_report_null(r, "sections_certified");
}

void surface_print_sections(const batten_sections *s) {
  if (s->certified)
    cli_line("sections",
             "plane; proven to bend as the end sections in all %zu span pairs where these bend to one side",
             s->pairs);
  else
    cli_line("sections",
             "plane; in %zu of %zu span pairs where the end sections bend to one side some between do not",
             s->violations + s->unproven, s->pairs);
}
