/* Figures of `batten solid`: the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "solid.h"

/* ---- report -------------------------------------------------------------------------------------- */

static const char *orientation_name(batten_orientation_used o) {
  return o == BATTEN_ORIENTATION_GIVEN ? "given" : o == BATTEN_ORIENTATION_ESTIMATED ? "estimated" : "none";
}
static const char *sign_name(batten_sign_state s) {
  return s == BATTEN_SIGN_CLEAN ? "clean" : s == BATTEN_SIGN_CURED ? "cured" : "ambiguous";
}
static const char *orient_data_name(batten_orient_data d) {
  return d == BATTEN_ORIENT_DATA_GRADIENTS ? "gradients" : d == BATTEN_ORIENT_DATA_PAIRS ? "pairs" : "none";
}
static const char *orient_method_name(batten_orient_method m) {
  return m == BATTEN_ORIENT_METHOD_ENERGY ? "energy" : m == BATTEN_ORIENT_METHOD_PLANES ? "planes" : "none";
}

static const char *carrier_name(const solid_work *w) {
  batten_carrier_parts parts;
  batten_carrier_get_parts(batten_solid_carrier(w->body.solid), &parts);
  return batten_carrier_kind_name(parts.kind);
}

/* Figures that only the iterative solver has, null for the others. */
static void report_iteration(const solid_work *w, cli_report *r) {
  const batten_saddle_info *s = &w->info.spline.saddle;
  const bool used = s->method == BATTEN_SADDLE_ITERATIVE;
  const struct {
    const char *key;
    size_t value;
  } counts[] = {{"rows_checked", s->rows_checked},
                {"iterations", s->iterations},
                {"levels", s->levels},
                {"domains", s->domains}};
  cli_report_number(r, "accuracy", used ? w->request->fit.spline.saddle.accuracy : NAN);
  cli_report_number(r, "residual_rows", used ? s->residual_rows : NAN);
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
    if (used)
      cli_report_count(r, counts[i].key, counts[i].value);
    else
      cli_report_null(r, counts[i].key);
  }
  cli_report_number(r, "products_accuracy", used ? s->products_accuracy : NAN);
  cli_report_number(r, "time_setup_s", used ? s->time_setup_s : NAN);
}

/* What was asked for and came of it, null without. */
static void report_reduction(const solid_work *w, cli_report *r) {
  const batten_spline_reduce_info *i = &w->info.reduced;
  const bool used = w->request->fit.reduce > 0;
  cli_report_number(r, "reduce", used ? w->request->fit.reduce : NAN);
  cli_report_number(r, "distance_certified", used ? i->error_certified : NAN);
  cli_report_number(r, "distance_certified_rms", used ? i->error_rms : NAN);
  cli_report_number(r, "reduce_ratio", used ? i->ratio_max : NAN);
  if (used) {
    cli_report_count(r, "points_certified", i->certified_points);
    cli_report_count(r, "reduce_rounds", i->rounds);
  } else {
    cli_report_null(r, "points_certified");
    cli_report_null(r, "reduce_rounds");
  }
  cli_report_number(r, "time_certify_s", used ? i->time_certify_s : NAN);
}

static const char *evaluation_name(batten_evaluation e) { return e == BATTEN_EVALUATE_FAST ? "fast" : "direct"; }

/* How f was evaluated, by the check and for the surface. */
static void report_evaluation(const solid_work *w, cli_report *r) {
  const batten_solid_evaluator_info *check = &w->info.evaluation, *surface = &w->body.evaluation;
  const bool check_fast = check->method == BATTEN_EVALUATE_FAST, fast = surface->method == BATTEN_EVALUATE_FAST;
  cli_report_text(r, "check_evaluation", evaluation_name(check->method));
  cli_report_number(r, "check_evaluation_error", check_fast ? check->error : NAN);
  cli_report_text(r, "evaluation", evaluation_name(surface->method));
  cli_report_number(r, "evaluation_error", fast ? surface->error : NAN);
  cli_report_number(r, "evaluation_gradient_error", fast ? surface->gradient_error : NAN);
  cli_report_number(r, "sums_accuracy", fast ? surface->sums_accuracy : NAN);
  cli_report_number(r, "time_evaluation_setup_s", fast ? surface->time_new_s : NAN);
  cli_report_number(r, "time_evaluation_s", fast ? surface->time_evaluate_s : NAN);
}

static void report_fit(const solid_work *w, cli_report *r) {
  const batten_solid_info *i = &w->info;
  const batten_saddle_info *s = &i->spline.saddle;
  const bool iterative = s->method == BATTEN_SADDLE_ITERATIVE;
  batten_spline_parts parts = {.struct_size = sizeof parts};
  batten_spline_get_parts(batten_solid_spline(w->body.solid), &parts);
  cli_report_text(r, "carrier", carrier_name(w));
  cli_report_count(r, "order", parts.m);
  cli_report_number(r, "smoothing", i->smoothing);
  cli_report_number(r, "noise", i->noise);
  cli_report_count(r, "centers", parts.count);
  report_reduction(w, r);
  cli_report_text(r, "method", batten_saddle_method_name(s->method));
  cli_report_count(r, "fallbacks", s->fallbacks);
  report_iteration(w, r);
  cli_report_number(r, "residual_max", i->residual_max);
  cli_report_number(r, "distance_max", i->distance_max);
  cli_report_number(r, "distance_rms", i->distance_rms);
  cli_report_count(r, "residual_points", i->residual_points);
  cli_report_number(r, "rcond", iterative ? NAN : s->rcond);
  cli_report_number(r, "loo_rms", i->spline.loo_rms);
  cli_report_count(r, "loo_samples", i->spline.loo_samples);
  cli_report_count(r, "refinements", s->refinements);
  cli_report_number(r, "energy", i->spline.energy);
  cli_report_number(r, "spacing", i->spacing);
  cli_report_count(r, "factor_bytes", s->bytes);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_data_s", i->time_data_s);
  cli_report_number(r, "time_assemble_s", s->time_assemble_s);
  cli_report_number(r, "time_project_s", s->time_project_s);
  cli_report_number(r, "time_factor_s", s->time_factor_s);
  cli_report_number(r, "time_solve_s", s->time_project_s + s->time_factor_s + s->time_setup_s + s->time_solve_s);
  cli_report_number(r, "time_fit_s", i->time_fit_s);
  cli_report_number(r, "time_check_s", i->time_check_s);
  cli_report_number(r, "time_orient_s", i->time_orient_s);
  cli_report_number(r, "time_surface_s", w->body.time_surface_s);
  cli_report_number(r, "time_write_s", w->body.time_write_s);
}

static void report_sign(const solid_work *w, cli_report *r) {
  const batten_solid_info *i = &w->info;
  cli_report_text(r, "orientation", orientation_name(i->orientation));
  cli_report_text(r, "orient_data", orient_data_name(i->orient_data));
  cli_report_text(r, "orient_method", orient_method_name(i->orient_method));
  cli_report_number(r, "orient_lambda", i->orient_lambda);
  cli_report_text(r, "sign_check", sign_name(i->sign));
  cli_report_count(r, "phantom_components", i->check_final.phantom_components);
  cli_report_count(r, "phantom_cells", i->check_final.phantom_cells);
  cli_report_count(r, "weak_gradients", i->check_final.weak_gradients);
  cli_report_count(r, "flipped_neighbours", i->check_final.flipped_neighbours);
  cli_report_bool(r, "inside_out", i->check_final.inside_out != 0);
  cli_report_count(r, "first_phantom_components", i->check.phantom_components);
  cli_report_count(r, "first_phantom_cells", i->check.phantom_cells);
  cli_report_count(r, "first_weak_gradients", i->check.weak_gradients);
  cli_report_count(r, "first_flipped_neighbours", i->check.flipped_neighbours);
}

void solid_report(const solid_work *w, cli_report *r) {
  double lower[3], upper[3];
  unsigned n = w->cloud.n;
  cli_report_text(r, "command", "solid");
  cli_report_common(r, &w->run, w->body.status);
  cli_report_text(r, "input", w->request->common.input);
  cli_report_count(r, "dimension", n);
  cli_report_count(r, "points_read", w->info.points_given);
  cli_report_count(r, "points_used", w->info.points_used);
  cli_report_count(r, "duplicates_merged", w->info.duplicates_merged);
  cli_report_bool(r, "normals_read", w->cloud.normals != NULL);
  batten_solid_box(w->body.solid, lower, upper);
  if (n == 2) lower[2] = upper[2] = NAN;
  cli_report_box(r, 3, lower, upper);
  report_fit(w, r);
  report_sign(w, r);
  report_evaluation(w, r);
  body_report(&w->body, r);
}

/* ---- summary ------------------------------------------------------------------------------------- */

void solid_summary(const solid_work *w) {
  const batten_solid_info *i = &w->info;
  cli_line("points", "%zu used of %zu read%s", i->points_used, i->points_given,
           w->cloud.normals ? ", with normals" : "");
  char loo[40] = ""; /* not with every method */
  if (!isnan(i->spline.loo_rms)) snprintf(loo, sizeof loo, ", leave-one-out %.2e", i->spline.loo_rms);
  cli_line("solid", "carrier %s, solver %s, residual %.1e%s", carrier_name(w),
           batten_saddle_method_name(i->spline.saddle.method), i->residual_max, loo);
  if (w->request->fit.reduce > 0)
    cli_line("centres", "%zu of %zu, the surface within %.3g of all points%s", i->reduced.centers, i->reduced.points,
             i->reduced.error_certified, i->reduced.certified_points == i->reduced.points ? "" : ", by fast sums");
  if (i->noise > 0)
    cli_line("noise", "%.3g, the points within %.3g of the surface (root mean square) by smoothing %.3g", i->noise,
             i->distance_rms, i->smoothing);
  cli_line("sign", "%s%s%s", sign_name(i->sign), i->orientation == BATTEN_ORIENTATION_NONE ? "" : ", orientation ",
           i->orientation == BATTEN_ORIENTATION_NONE ? "" : orientation_name(i->orientation));
  if (w->body.evaluation.method == BATTEN_EVALUATE_FAST)
    cli_line("evaluation", "fast sums, off by %.1e of the box at most", w->body.evaluation.error);
  body_print(&w->body);
  body_print_end(&w->body, "fit", i->time_data_s + i->time_fit_s + i->time_check_s + i->time_orient_s,
                 w->time_read_s);
}
