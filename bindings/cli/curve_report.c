/* Figures of `batten curve`: the report's keys (docs/report.md), the summary. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "curve.h"
#include "curves.h"

/* All contours together. */
typedef struct totals {
  size_t points, unknowns, rows, equalities, iterations, wanted, found, found_free;
  unsigned rounds, fallbacks;
  double unconstrained, first, reference, lsq, max_error, margin, misfit, inflection_error;
  size_t worst; /* contour of max_error */
  bool certified;
  double time_parameters, time_inflections, time_knots, time_reference, time_rows, time_qp, time_correction,
      time_check;
} totals;

static size_t last_rows(const batten_contour_info *i) { return i->rounds ? i->rows_per_round[i->rounds - 1] : 0; }

static totals add_up(const curve_work *w) {
  totals t = {.certified = true, .margin = INFINITY, .misfit = NAN};
  for (size_t k = 0; k < w->count; k++) {
    const curve_item *c = &w->items[k];
    const batten_contour_info *i = &c->info;
    t.points += c->count;
    t.unknowns += i->unknowns;
    t.rows += last_rows(i);
    t.equalities += i->equalities;
    t.iterations += i->iterations;
    t.wanted += i->inflections_wanted;
    t.found += i->inflections_found;
    t.found_free += i->inflections_unconstrained;
    t.rounds = i->rounds > t.rounds ? i->rounds : t.rounds;
    t.fallbacks += i->fallback != 0;
    t.unconstrained += i->lsq_unconstrained;
    t.first += i->lsq_unconstrained_first;
    t.reference += i->lsq_reference;
    t.lsq += i->lsq;
    if (i->max_error > t.max_error || k == 0) {
      t.max_error = i->max_error;
      t.worst = k;
    }
    t.margin = fmin(t.margin, i->shape.margin_min);
    t.inflection_error = fmax(t.inflection_error, i->shape.inflection_error);
    t.misfit = fmax(t.misfit, i->misfit);
    t.certified = t.certified && i->shape.certified;
    t.time_parameters += i->time_parameters_s;
    t.time_inflections += i->time_inflections_s;
    t.time_knots += i->time_knots_s;
    t.time_reference += i->time_reference_s;
    t.time_rows += i->time_rows_s;
    t.time_qp += i->time_qp_s;
    t.time_correction += i->time_correction_s;
    t.time_check += i->time_check_s;
  }
  return t;
}

/* Root mean square over all points; a contour's is of its points, weights taken in. */
static double total_rms(const curve_work *w, size_t points) {
  double sum = 0;
  for (size_t k = 0; k < w->count; k++)
    sum += (double)w->items[k].count * w->items[k].info.rms * w->items[k].info.rms;
  return sqrt(sum / (double)points);
}

/* ---- report -------------------------------------------------------------------------------------- */

/* One list for each of some keys: a figure of each contour. */
static void report_lists(const curve_work *w, cli_report *r) {
  size_t n = w->count;
  double *numbers = malloc(n * sizeof *numbers);
  size_t *counts = malloc(n * sizeof *counts);
  if (!numbers || !counts) {
    r->failed = true;
    goto done;
  }
  for (size_t i = 0; i < n; i++) counts[i] = w->items[i].number;
  cli_report_counts(r, "contour", n, counts);
  for (size_t i = 0; i < n; i++) numbers[i] = w->items[i].info.lsq_unconstrained;
  cli_report_numbers(r, "contour_lsq_unconstrained", n, numbers);
  for (size_t i = 0; i < n; i++) numbers[i] = w->items[i].info.lsq;
  cli_report_numbers(r, "contour_lsq", n, numbers);
  for (size_t i = 0; i < n; i++) numbers[i] = w->items[i].info.max_error;
  cli_report_numbers(r, "contour_max_error", n, numbers);
  for (size_t i = 0; i < n; i++) counts[i] = w->items[i].info.inflections_unconstrained;
  cli_report_counts(r, "contour_inflections_unconstrained", n, counts);
  for (size_t i = 0; i < n; i++) counts[i] = w->items[i].info.inflections_wanted;
  cli_report_counts(r, "contour_inflections_wanted", n, counts);
  for (size_t i = 0; i < n; i++) counts[i] = w->items[i].info.shape.certified != 0;
  cli_report_counts(r, "contour_certified", n, counts);
  for (size_t i = 0; i < n; i++) numbers[i] = w->items[i].info.shape.margin_min;
  cli_report_numbers(r, "contour_margin_min", n, numbers);
done:
  free(numbers);
  free(counts);
}

static void report_fit(const curve_work *w, const totals *t, cli_report *r) {
  const batten_contour_info *one = &w->items[0].info;
  size_t rounds = w->count == 1 ? one->rounds : 0;
  cli_report_count(r, "unknowns", t->unknowns);
  cli_report_number(r, "lsq_unconstrained", t->unconstrained);
  cli_report_number(r, "lsq_unconstrained_first", t->first);
  cli_report_number(r, "lsq_reference", t->reference);
  cli_report_number(r, "lsq", t->lsq);
  cli_report_number(r, "rms", total_rms(w, t->points));
  cli_report_number(r, "max_error", t->max_error);
  cli_report_count(r, "max_error_index", w->items[t->worst].info.max_error_index);
  cli_report_count(r, "max_error_contour", w->items[t->worst].number);
  cli_report_number(r, "misfit", t->misfit);
  cli_report_count(r, "rows", t->rows);
  cli_report_count(r, "equalities", t->equalities);
  cli_report_count(r, "iterations", t->iterations);
  cli_report_count(r, "rounds", t->rounds);
  cli_report_counts(r, "rows_per_round", rounds, one->rows_per_round);
  cli_report_numbers(r, "lsq_per_round", rounds, one->lsq_per_round);
  cli_report_count(r, "construction_1", t->fallbacks);
  cli_report_count(r, "inflections_wanted", t->wanted);
  cli_report_count(r, "inflections_found", t->found);
  cli_report_count(r, "inflections_unconstrained", t->found_free);
  cli_report_bool(r, "certified", t->certified);
  cli_report_number(r, "margin_min", t->margin);
  cli_report_number(r, "inflection_error", t->inflection_error);
}

/* Curves and their measures as arrays; false when out of memory. */
typedef struct curve_arrays {
  const batten_curve **curves;
  batten_curve_measures *measures;
} curve_arrays;

static bool arrays_make(const curve_work *w, curve_arrays *out) {
  *out = (curve_arrays){malloc(w->count * sizeof *out->curves), malloc(w->count * sizeof *out->measures)};
  for (size_t i = 0; out->curves && out->measures && i < w->count; i++) {
    out->curves[i] = w->items[i].curve;
    out->measures[i] = w->items[i].measures;
  }
  return out->curves && out->measures;
}

static void arrays_free(curve_arrays *a) {
  free(a->curves);
  free(a->measures);
}

void curve_report(const curve_work *w, cli_report *r) {
  const curve_request *q = w->request;
  totals t = add_up(w);
  cli_report_text(r, "command", "curve");
  cli_report_common(r, &w->run, w->status);
  cli_report_text(r, "input", q->common.input);
  cli_report_count(r, "points", t.points);
  cli_report_count(r, "smoothness", q->options.smoothness);
  report_fit(w, &t, r);
  report_lists(w, r);
  cli_report_bool(r, "planes", w->planes != NULL);
  curve_arrays a;
  if (arrays_make(w, &a)) {
    curves_report_form(w->count, a.curves, r);
    curves_report_measures(w->count, a.measures, r);
  } else {
    r->failed = true;
  }
  arrays_free(&a);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_propose_s", w->time_propose_s);
  cli_report_number(r, "time_parameters_s", t.time_parameters);
  cli_report_number(r, "time_inflections_s", t.time_inflections);
  cli_report_number(r, "time_knots_s", t.time_knots);
  cli_report_number(r, "time_reference_s", t.time_reference);
  cli_report_number(r, "time_rows_s", t.time_rows);
  cli_report_number(r, "time_qp_s", t.time_qp);
  cli_report_number(r, "time_correction_s", t.time_correction);
  cli_report_number(r, "time_check_s", t.time_check);
  cli_report_number(r, "time_measure_s", w->time_measure_s);
  cli_report_number(r, "time_write_s", w->time_write_s);
}

/* ---- summary ------------------------------------------------------------------------------------- */

void curve_summary(const curve_work *w) {
  const curve_request *q = w->request;
  totals t = add_up(w);
  curve_arrays a;
  if (!arrays_make(w, &a)) {
    arrays_free(&a);
    return;
  }
  cli_line("points", "%zu", t.points);
  curves_print_form(w->count, a.curves);
  cli_line("sums", "unconstrained %.6g, reference %.6g, result %.6g", t.unconstrained, t.reference, t.lsq);
  if (t.rows)
    cli_line("rounds", "%u, with %zu inequalities in the last", t.rounds, t.rows);
  else
    cli_line("rounds", "%u, which needed no inequalities in the end", t.rounds);
  if (w->count == 1)
    cli_line("deviation", "rms %.4g, largest %.4g at point %zu", w->items[0].info.rms, t.max_error,
             w->items[0].info.max_error_index);
  else
    cli_line("deviation", "rms %.4g, largest %.4g at point %zu of contour %zu", total_rms(w, t.points), t.max_error,
             w->items[t.worst].info.max_error_index, w->items[t.worst].number);
  if (t.certified)
    cli_line("shape", "proven: exactly %zu inflection%s (%zu without inequalities), margin %.3g",
             t.wanted, t.wanted == 1 ? "" : "s", t.found_free, t.margin);
  else
    cli_line("shape", "NOT proven: %zu inflections wanted, %zu found", t.wanted, t.found);
  curves_print_measures(w->count, a.measures);
  arrays_free(&a);
  double fitting = t.time_parameters + t.time_inflections + t.time_knots + t.time_reference + t.time_rows +
                   t.time_qp + t.time_correction;
  cli_line("time", "%.2f s: fit %.2f, proof %.2f, files %.2f", batten_now() - w->run.started, fitting, t.time_check,
           w->time_read_s + w->time_write_s);
  cli_line("memory", "%.0f MB at most", (double)batten_bytes_peak(w->run.ctx) / 1e6);
  for (size_t k = 0; k < q->common.outputs.count; k++)
    cli_line(k ? "" : "written", "%s", q->common.outputs.items[k].path);
}
