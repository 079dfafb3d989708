/* Figures of `batten convex`: the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdio.h>

#include "convex.h"
#include "surface.h"

/* ---- report -------------------------------------------------------------------------------------- */

static void report_count(cli_report *r, const char *key, bool has, size_t value) {
  if (has)
    cli_report_count(r, key, value);
  else
    cli_report_null(r, key);
}

/* Keys in one order for both kinds; what a kind has not is null. */
static void report_fit(const convex_work *w, cli_report *r) {
  bool f = w->request->function;
  const batten_convex_info *i = &w->info;
  const batten_convex_function_info *g = &w->function_info;
  cli_report_bool(r, "function", f);
  cli_report_count(r, "unknowns", f ? g->unknowns : i->unknowns);
  cli_report_number(r, "lsq_unconstrained", f ? g->lsq_unconstrained : i->lsq_unconstrained);
  cli_report_number(r, "lsq_unconstrained_first", f ? NAN : i->lsq_unconstrained_first);
  cli_report_number(r, "lsq_reference", f ? NAN : i->lsq_reference);
  cli_report_number(r, "lsq", f ? g->lsq : i->lsq);
  cli_report_number(r, "lsq_lower", f ? g->lsq_lower : NAN);
  cli_report_number(r, "objective", f ? g->objective : NAN);
  cli_report_number(r, "objective_lower", f ? g->objective_lower : NAN);
  cli_report_number(r, "rms", f ? g->rms : i->rms);
  cli_report_number(r, "max_error", f ? g->max_error : i->max_error);
  cli_report_count(r, "max_error_index", f ? g->max_error_index : i->max_error_index);
  cli_report_number(r, "tension_weight", f ? NAN : i->tension_weight);
  report_count(r, "tension_steps", !f, i->tension_steps);
  unsigned rounds = f ? g->rounds : i->rounds;
  cli_report_count(r, "rounds", rounds);
  report_count(r, "round_best", !f, i->round_best);
  cli_report_counts(r, "rows_per_round", rounds, f ? g->rows_per_round : i->rows_per_round);
  cli_report_counts(r, "boxes_per_round", f ? 0 : rounds, i->boxes_per_round);
  cli_report_numbers(r, "lsq_per_round", f ? 0 : rounds, i->lsq_per_round);
  report_count(r, "boxes", !f && rounds > 0, rounds ? i->boxes_per_round[rounds - 1] : 0);
  report_count(r, "rows_active", !f, i->rows_active);
  report_count(r, "rows_outer", f, g->rows_outer);
  cli_report_number(r, "slack", f ? g->slack : 0);
  cli_report_bool(r, "plane", !f && i->plane);
  cli_report_number(r, "misfit", f ? NAN : i->misfit);
  cli_report_number(r, "K_min_unconstrained", f ? g->gauss_min_unconstrained : i->gauss_min_unconstrained);
  cli_report_number(r, "K_max_unconstrained", f ? NAN : i->gauss_max_unconstrained);
}

static void report_times(const convex_work *w, cli_report *r) {
  bool f = w->request->function;
  const batten_convex_info *i = &w->info;
  const batten_convex_function_info *g = &w->function_info;
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_parameters_s", f ? NAN : i->time_parameters_s);
  cli_report_number(r, "time_reference_s", f ? NAN : i->time_reference_s);
  cli_report_number(r, "time_rows_s", f ? g->time_rows_s : i->time_rows_s);
  cli_report_number(r, "time_qp_s", f ? g->time_qp_s : i->time_qp_s);
  cli_report_number(r, "time_correction_s", f ? NAN : i->time_correction_s);
  cli_report_number(r, "time_check_s", f ? g->time_check_s : i->time_check_s);
  cli_report_number(r, "time_measure_s", w->time_measure_s);
  cli_report_number(r, "time_write_s", w->time_write_s);
}

void convex_report(const convex_work *w, cli_report *r) {
  batten_surface_form form = batten_surface_get(w->surface);
  cli_report_text(r, "command", "convex");
  cli_report_common(r, &w->run, w->status);
  cli_report_text(r, "input", w->request->common.input);
  cli_report_count(r, "points", w->cloud.count);
  surface_report_form(&form, r);
  report_fit(w, r);
  surface_report_convexity(w->request->function ? &w->function_info.convexity : &w->info.convexity, r);
  surface_report_measures(&w->measures, r);
  report_times(w, r);
}

/* ---- summary ------------------------------------------------------------------------------------- */

static void print_sums(const convex_work *w) {
  if (w->request->function) {
    const batten_convex_function_info *g = &w->function_info;
    cli_line("sums", "unconstrained %.6g, result %.6g, which none of this shape undercuts by more than %.2g %%",
             g->lsq_unconstrained, g->lsq, 100 * fmax(0, 1 - g->objective_lower / g->objective));
    cli_line("inequalities", "%zu necessary ones, %zu sufficient ones in round %u", g->rows_outer,
             g->rows_per_round[g->rounds ? g->rounds - 1 : 0], g->rounds);
    cli_line("deviation", "rms %.4g, largest %.4g at point %zu", g->rms, g->max_error, g->max_error_index);
    return;
  }
  const batten_convex_info *i = &w->info;
  if (isnan(i->lsq_reference))
    cli_line("sums", "unconstrained %.6g, result %.6g", i->lsq_unconstrained, i->lsq);
  else
    cli_line("sums", "unconstrained %.6g, reference %.6g, result %.6g", i->lsq_unconstrained, i->lsq_reference,
             i->lsq);
  if (i->rounds)
    cli_line("rounds", "%u, the last with %zu inequalities on %zu boxes", i->rounds, i->rows_per_round[i->rounds - 1],
             i->boxes_per_round[i->rounds - 1]);
  cli_line("deviation", "rms %.4g, largest %.4g at point %zu", i->rms, i->max_error, i->max_error_index);
}

void convex_summary(const convex_work *w) {
  bool f = w->request->function;
  batten_surface_form form = batten_surface_get(w->surface);
  cli_line("points", "%zu", w->cloud.count);
  surface_print_form(&form);
  print_sums(w);
  surface_print_convexity(f ? &w->function_info.convexity : &w->info.convexity);
  surface_print_measures(&w->measures);
  double fitting = f ? w->function_info.time_rows_s + w->function_info.time_qp_s
                     : w->info.time_parameters_s + w->info.time_reference_s + w->info.time_rows_s +
                           w->info.time_qp_s + w->info.time_correction_s;
  cli_line("time", "%.2f s: fit %.2f, proof %.2f, measures %.2f, files %.2f", batten_now() - w->run.started, fitting,
           f ? w->function_info.time_check_s : w->info.time_check_s, w->time_measure_s,
           w->time_read_s + w->time_write_s);
  cli_line("memory", "%.0f MB at most", (double)batten_bytes_peak(w->run.ctx) / 1e6);
  for (size_t k = 0; k < w->request->common.outputs.count; k++)
    cli_line(k ? "" : "written", "%s", w->request->common.outputs.items[k].path);
}
