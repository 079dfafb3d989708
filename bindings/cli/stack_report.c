/* Figures of `batten stack`: the report's keys (docs/report.md), the summary. */
#include <stdio.h>

#include "stack.h"

static const char *note_name(batten_stack_note_kind kind) {
  static const char *const names[] = {"dropped", "no overlap", "thin", "linked", "uncertified", "crossing"};
  return names[kind];
}

static const char *route_name(const stack_work *w) {
  return w->info.route == BATTEN_ROUTE_SPACE ? "space" : "sections";
}

/* Lists of the notes, entry by entry: what, section, contour, other, value. */
static void report_notes(const stack_work *w, cli_report *r) {
  json_t *list = json_array();
  for (size_t i = 0; list && i < w->note_count; i++) {
    const batten_stack_note *n = w->notes + i;
    json_t *entry = json_object();
    json_object_set_new(entry, "what", json_string(note_name(n->kind)));
    json_object_set_new(entry, "section", json_integer((json_int_t)n->section));
    json_object_set_new(entry, "contour", json_integer((json_int_t)n->contour));
    json_object_set_new(entry, "above", json_boolean(n->above));
    json_object_set_new(entry, "other", n->other == SIZE_MAX ? json_null() : json_integer((json_int_t)n->other));
    json_object_set_new(entry, "value", json_real(n->value));
    if (json_array_append_new(list, entry) != 0) r->failed = true;
  }
  if (!list || json_object_set_new(r->object, "notes", list) != 0) r->failed = true;
}

void stack_report(const stack_work *w, cli_report *r) {
  const batten_stack_info *i = &w->info;
  double lower[3], upper[3];
  cli_report_text(r, "command", "stack");
  cli_report_common(r, &w->run, w->body.status);
  cli_report_text(r, "input", w->request->common.input);
  cli_report_count(r, "sections", i->sections);
  cli_report_count(r, "contours", i->contours);
  cli_report_count(r, "holes", i->holes);
  cli_report_count(r, "contours_dropped", i->contours_dropped);
  cli_report_count(r, "points_read", i->points_given);
  cli_report_count(r, "centers", i->centers);
  cli_report_count(r, "sections_certified", i->certified);
  cli_report_number(r, "section_residual_max", i->section_residual_max);
  cli_report_number(r, "wrong_sign_max", i->wrong_sign_max);
  cli_report_number(r, "tolerance", i->tolerance);
  cli_report_number(r, "spacing", i->spacing);
  cli_report_number(r, "gap", i->gap);
  cli_report_bool(r, "parallel", i->parallel != 0);
  cli_report_count(r, "crossings", i->crossings);
  cli_report_text(r, "route", route_name(w));
  cli_report_count(r, "pieces", i->pieces);
  cli_report_count(r, "non_overlaps", i->non_overlaps);
  cli_report_count(r, "links", i->links);
  report_notes(w, r);
  cli_report_numbers(r, "draughts", w->draught_count, w->draughts);
  cli_report_numbers(r, "displacements", w->draught_count, w->displacements);
  batten_solid_box(w->body.solid, lower, upper);
  cli_report_box(r, 3, lower, upper);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_fit_s", i->time_fit_s);
  cli_report_number(r, "time_build_s", i->time_total_s);
  cli_report_number(r, "time_surface_s", w->body.time_surface_s);
  cli_report_number(r, "time_write_s", w->body.time_write_s);
  body_report(&w->body, r);
}

/* The first few notes in words; the report has them all. */
static void print_notes(const stack_work *w) {
  enum { MOST = 8 };
  size_t told = 0;
  for (size_t k = 0; k < w->note_count && told < MOST; k++) {
    const batten_stack_note *n = w->notes + k;
    const char *way = n->above ? "next" : "previous";
    const char *head = told++ ? "" : "notes";
    switch (n->kind) {
      case BATTEN_NOTE_DROPPED:
        cli_line(head, "section %zu, contour %zu: left out, area %g", n->section, n->contour, n->value);
        break;
      case BATTEN_NOTE_NO_OVERLAP:
        cli_line(head, "section %zu, contour %zu: overlaps none of the %s section", n->section, n->contour, way);
        break;
      case BATTEN_NOTE_THIN:
        cli_line(head, "section %zu, contour %zu: the solid thins to %.0f %% towards the %s section", n->section,
                 n->contour, 100 * n->value, way);
        break;
      case BATTEN_NOTE_LINKED:
        cli_line(head, "section %zu, contour %zu: joined to contour %zu of the %s section, %g aside", n->section,
                 n->contour, n->other, way, n->value);
        break;
      case BATTEN_NOTE_UNCERTIFIED:
        cli_line(head, "section %zu: wrong sign up to %g deep", n->section, n->value);
        break;
      case BATTEN_NOTE_CROSSING:
        cli_line(head, "sections %zu and %zu: planes cross within both", n->section, n->other);
    }
  }
  if (w->note_count > told) cli_line("", "and %zu more, see the report", w->note_count - told);
}

void stack_summary(const stack_work *w) {
  const batten_stack_info *i = &w->info;
  cli_line("sections", "%zu, %s; %zu contours, %zu of them holes", i->sections,
           i->parallel ? "parallel" : "not parallel", i->contours, i->holes);
  if (i->route == BATTEN_ROUTE_SPACE)
    cli_line("route", "planes in no sequence: one spline in space through %zu centres", i->centers);
  else if (w->request->options.method == BATTEN_SECTION_PAIRS)
    cli_line("fit", "%zu centres, within %.2g of the points; sign certified on %zu sections to %.2g", i->centers,
             i->section_residual_max, i->certified, i->tolerance);
  else
    cli_line("fit", "%zu centres, within %.2g of the points; their side settled on %zu sections", i->centers,
             i->section_residual_max, i->certified);
  if (i->route == BATTEN_ROUTE_SECTIONS)
    cli_line("pieces", "%zu; %zu contours without a partner, %zu joined", i->pieces, i->non_overlaps, i->links);
  print_notes(w);
  body_print(&w->body);
  for (size_t k = 0; k < w->draught_count; k++)
    cli_line(k ? "" : "below", "%g: %.6g", w->draughts[k], w->displacements[k]);
  body_print_end(&w->body, "sections", i->time_total_s, w->time_read_s);
}
