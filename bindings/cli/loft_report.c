/* Figures of `batten loft`: the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdlib.h>

#include "loft.h"

/* ---- report -------------------------------------------------------------------------------------- */

/* Keys in one order for both kinds of input; what curves do not have is null. */
static void report_match(const loft_work *w, cli_report *r) {
  const batten_loft_match_info *m = &w->match;
  const struct {
    const char *key;
    size_t value;
  } counts[] = {{"points", m->points},
                {"slices_left_out", w->left_out},
                {"slices_reversed", m->reversed},
                {"slices_told", m->told},
                {"slices_certified", m->certified},
                {"slice_inflections", m->inflections},
                {"slice_inflections_matched", m->inflections_matched},
                {"tracks", m->tracks},
                {"slice_spans", m->spans}};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
    if (w->matched)
      cli_report_count(r, counts[i].key, counts[i].value);
    else
      cli_report_null(r, counts[i].key);
  cli_report_number(r, "rms", w->matched ? m->rms : NAN);
  cli_report_number(r, "max_error", w->matched ? m->max_error : NAN);
}

static void report_surface(const batten_loft_info *i, cli_report *r) {
  cli_report_count(r, "contours", i->contours);
  cli_report_count(r, "patches", i->patches);
  cli_report_count(r, "smoothness", i->smoothness);
  cli_report_count(r, "degree_t", i->degree_t);
  cli_report_count(r, "degree_z", i->degree_z);
  cli_report_count(r, "degree_raised", i->degree_raised);
  cli_report_count(r, "knots_inserted", i->knots_inserted);
  cli_report_number(r, "knot_shift", i->knot_shift);
  cli_report_count(r, "unknowns", i->unknowns);
  cli_report_count(r, "equalities", i->equalities);
  cli_report_count(r, "rows", i->rows);
  cli_report_count(r, "rows_used", i->rows_used);
  cli_report_count(r, "rounds", i->rounds);
  cli_report_count(r, "iterations", i->iterations);
  cli_report_bool(r, "settled", i->settled != 0);
  cli_report_number(r, "objective", i->objective);
  cli_report_number(r, "objective_unconstrained", i->objective_unconstrained);
  cli_report_number(r, "interpolation_error", i->interpolation_error);
  cli_report_number(r, "continuity_error", i->continuity_error);
  cli_report_count(r, "inflections", i->inflections);
  cli_report_count(r, "inflections_unmatched", i->inflections_unmatched);
  cli_report_count(r, "vertices_elastic", i->vertices_elastic);
  cli_report_count(r, "self_intersecting", i->self_intersecting);
}

static void report_proof(const batten_loft_info *i, cli_report *r) {
  cli_report_count(r, "sign_pairs", i->sign_pairs);
  cli_report_count(r, "sign_pairs_free", i->sign_pairs_free);
  cli_report_count(r, "sign_violations_unconstrained", i->sign_violations_unconstrained);
  cli_report_count(r, "sign_violations", i->sign_violations);
  cli_report_bool(r, "certified", i->certified != 0);
  cli_report_number(r, "margin_min", i->margin_min);
  cli_report_count(r, "margin_patch", i->worst_patch);
  cli_report_number(r, "margin_t", i->worst_at[0]);
  cli_report_number(r, "margin_z", i->worst_at[1]);
}

/* Inflections and vertices that are told, as lists of the same length. */
static void report_notes(const loft_work *w, cli_report *r) {
  size_t count = 0;
  const batten_loft_note *notes = batten_loft_notes(w->loft, &count);
  size_t *kinds = malloc((count + 1) * sizeof *kinds), *contours = malloc((count + 1) * sizeof *contours);
  double *at = malloc((count + 1) * sizeof *at);
  if (!kinds || !contours || !at)
    r->failed = true;
  else {
    for (size_t i = 0; i < count; i++) {
      kinds[i] = (size_t)notes[i].remark;
      contours[i] = notes[i].contour;
      at[i] = notes[i].t;
    }
    cli_report_counts(r, "remark", count, kinds);
    cli_report_counts(r, "remark_contour", count, contours);
    cli_report_numbers(r, "remark_t", count, at);
  }
  free(kinds);
  free(contours);
  free(at);
}

void loft_report(const loft_work *w, cli_report *r) {
  const batten_loft_info *i = &w->info;
  cli_report_text(r, "command", "loft");
  cli_report_common(r, &w->run, w->status);
  cli_report_text(r, "input", w->request->common.input);
  report_match(w, r);
  report_surface(i, r);
  report_proof(i, r);
  report_notes(w, r);
  cli_report_number(r, "area", w->measures.area);
  cli_report_number(r, "volume", w->measures.volume);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_match_s", w->matched ? w->time_match_s : NAN);
  cli_report_number(r, "time_prepare_s", i->time_prepare_s);
  cli_report_number(r, "time_objective_s", i->time_objective_s);
  cli_report_number(r, "time_rows_s", i->time_rows_s);
  cli_report_number(r, "time_qp_s", i->time_qp_s);
  cli_report_number(r, "time_check_s", i->time_check_s);
  cli_report_number(r, "time_measure_s", w->time_measure_s);
  cli_report_number(r, "time_write_s", w->time_write_s);
}

/* ---- summary ------------------------------------------------------------------------------------- */

static void print_match(const loft_work *w) {
  const batten_loft_match_info *m = &w->match;
  if (!w->matched) return;
  cli_line("slices", "%zu with %zu points; %zu inflections, of which %zu are followed to their neighbours", m->slices,
           m->points, m->inflections, m->inflections_matched);
  cli_line("deviation", "rms %.4g, largest %.4g in slice %zu", m->rms, m->max_error, m->max_error_slice);
}

static void print_proof(const batten_loft_info *i) {
  if (i->certified)
    cli_line("sections", "proven to keep the contours' signs in all %zu span pairs that have one; %zu have none",
             i->sign_pairs, i->sign_pairs_free);
  else
    cli_line("sections",
             "NOT PROVEN: worst in patch %zu near t = %.6g, z = %.6g; %zu of %zu span pairs have the wrong sign",
             i->worst_patch, i->worst_at[0], i->worst_at[1], i->sign_violations, i->sign_pairs);
  cli_line("", "without inequalities %zu would have the wrong sign", i->sign_violations_unconstrained);
  if (!isnan(i->margin_min)) cli_line("", "least curvature %.4g / unit, away from inflections", i->margin_min);
  if (i->inflections)
    cli_line("inflections", "%zu, %zu of them without a partner in a neighbouring contour", i->inflections,
             i->inflections_unmatched);
}

void loft_summary(const loft_work *w) {
  const batten_loft_info *i = &w->info;
  print_match(w);
  cli_line("surface", "%zu contours, degree %u x %u, %zu unknowns, %zu inequalities", i->contours, i->degree_t,
           i->degree_z, i->unknowns, i->rows);
  cli_line("exactness", "interpolation %.2g, continuity %.2g of the contours' size", i->interpolation_error,
           i->continuity_error);
  print_proof(i);
  if (i->self_intersecting) cli_line("remark", "%zu contours cross themselves", i->self_intersecting);
  if (isnan(w->measures.volume))
    cli_line("area", "%.6g", w->measures.area);
  else
    cli_line("volume", "%.6g inside, between the planes of its ends; area %.6g", fabs(w->measures.volume),
             w->measures.area);
  cli_line(
      "time",
      "%.2f s: slices %.2f, contours %.2f, objective %.2f, inequalities %.2f, programs %.2f, proof %.2f, files %.2f",
      batten_now() - w->run.started, w->time_match_s, i->time_prepare_s, i->time_objective_s, i->time_rows_s,
      i->time_qp_s, i->time_check_s, w->time_read_s + w->time_write_s);
  cli_line("memory", "%.0f MB at most", (double)batten_bytes_peak(w->run.ctx) / 1e6);
  for (size_t k = 0; k < w->request->common.outputs.count; k++)
    cli_line(k ? "" : "written", "%s", w->request->common.outputs.items[k].path);
}
