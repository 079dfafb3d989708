/* Figures of quadratic programs: counts, the report's keys (docs/report.md), the summary, proofs in words. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "qp.h"

/* ---- counts -------------------------------------------------------------------------------------- */

static void extend(qp_range *range, double value) {
  double size = fabs(value);
  if (!(size > 0) || isinf(size)) return;
  if (range->entries++ == 0) range->least = range->largest = size;
  range->least = fmin(range->least, size);
  range->largest = fmax(range->largest, size);
}

static void extend_all(qp_range *range, const double *values, size_t count) {
  for (size_t i = 0; values && i < count; i++) extend(range, values[i]);
}

static void extend_matrix(qp_range *range, const batten_matrix *m) {
  if (!m || m->rows == 0) return;
  if (m->dense)
    extend_all(range, m->dense, m->rows * m->columns);
  else
    extend_all(range, m->values, m->starts[m->rows]);
}

static double side(const double *values, size_t i, double none) { return values ? values[i] : none; }

void qp_count(const batten_qp_problem *p, qp_counts *out) {
  static const qp_range nothing = {0, NAN, NAN};
  qp_counts c = {.unknowns = p->n, .rows = p->c ? p->c->rows : 0, .squares = p->a ? p->a->rows : 0};
  c.a = c.h = c.c = c.g = c.sides = nothing;
  extend_matrix(&c.a, p->a);
  extend_matrix(&c.h, p->h);
  extend_matrix(&c.c, p->c);
  extend_all(&c.g, p->g, p->n);
  extend_all(&c.sides, p->lower, c.rows);
  extend_all(&c.sides, p->upper, c.rows);
  extend_all(&c.sides, p->x_lower, p->n);
  extend_all(&c.sides, p->x_upper, p->n);
  for (size_t i = 0; i < c.rows; i++) c.equalities += side(p->lower, i, -INFINITY) >= side(p->upper, i, INFINITY);
  for (size_t j = 0; j < p->n; j++)
    c.bounds += (size_t)isfinite(side(p->x_lower, j, -INFINITY)) + (size_t)isfinite(side(p->x_upper, j, INFINITY));
  *out = c;
}

static void report_range(cli_report *r, const char *const keys[3], const qp_range *range) {
  cli_report_count(r, keys[0], range->entries);
  cli_report_number(r, keys[1], range->least);
  cli_report_number(r, keys[2], range->largest);
}

void qp_report_counts(const qp_counts *c, const batten_qp_file *file, cli_report *r) {
  static const char *const h[] = {"hessian_entries", "hessian_min", "hessian_max"};
  static const char *const a[] = {"square_entries", "square_min", "square_max"};
  static const char *const rows[] = {"entries", "entry_min", "entry_max"};
  static const char *const g[] = {"gradient_entries", "gradient_entry_min", "gradient_entry_max"};
  static const char *const sides[] = {"side_entries", "side_min", "side_max"};
  cli_report_text(r, "name", file->name && *file->name ? file->name : NULL);
  cli_report_count(r, "unknowns", c->unknowns);
  cli_report_count(r, "rows", c->rows);
  cli_report_count(r, "equalities", c->equalities);
  cli_report_count(r, "bounds", c->bounds);
  cli_report_count(r, "squares", c->squares);
  report_range(r, rows, &c->c);
  report_range(r, h, &c->h);
  report_range(r, a, &c->a);
  report_range(r, g, &c->g);
  report_range(r, sides, &c->sides);
}

static void print_range(const char *name, const qp_range *range) {
  if (range->entries) cli_line(name, "%zu, sizes %.3g .. %.3g", range->entries, range->least, range->largest);
}

static const char *plural(size_t count, const char *one, const char *many) { return count == 1 ? one : many; }

void qp_print_counts(const qp_counts *c, const batten_qp_file *file) {
  const char *name = file->name ? file->name : "";
  cli_line("problem", "%s%s%zu unknown%s, %zu row%s (%zu %s), %zu bound%s", name, *name ? ": " : "", c->unknowns,
           plural(c->unknowns, "", "s"), c->rows, plural(c->rows, "", "s"), c->equalities,
           plural(c->equalities, "equality", "equalities"), c->bounds, plural(c->bounds, "", "s"));
  if (c->squares) cli_line("least squares", "%zu row%s", c->squares, plural(c->squares, "", "s"));
}

void qp_print_ranges(const qp_counts *c) {
  print_range("entries", &c->c);
  print_range("Hessian", &c->h);
  print_range("squares", &c->a);
  print_range("gradient", &c->g);
  print_range("sides", &c->sides);
}

/* ---- names of things ------------------------------------------------------------------------------ */

const char *qp_engine_name(batten_qp_engine engine) {
  switch (engine) {
    case BATTEN_QP_PRIMAL:
      return "primal";
    case BATTEN_QP_DUAL:
      return "dual";
    case BATTEN_QP_INTERIOR:
      return "interior";
    default:
      return "auto";
  }
}

static const char *engine_in_words(batten_qp_engine engine) {
  switch (engine) {
    case BATTEN_QP_PRIMAL:
      return "primal active set";
    case BATTEN_QP_DUAL:
      return "dual active set";
    case BATTEN_QP_INTERIOR:
      return "interior point";
    default:
      return "none needed";
  }
}

bool qp_has_figures(batten_status status) {
  return status >= 0 || status == BATTEN_E_INFEASIBLE || status == BATTEN_E_UNBOUNDED ||
         status == BATTEN_E_NOT_CONVEX || status == BATTEN_E_LIMIT;
}

/* ---- report --------------------------------------------------------------------------------------- */

void qp_report(const qp_work *w, cli_report *r) {
  const batten_qp_info *i = &w->info;
  bool solved = w->status >= 0;
  cli_report_text(r, "command", "qp");
  cli_report_common(r, &w->run, w->status);
  cli_report_text(r, "status", batten_qp_status_word(w->status));
  cli_report_text(r, "input", w->request->common.input);
  qp_report_counts(&w->counts, &w->file, r);
  cli_report_text(r, "engine", qp_engine_name(i->engine));
  cli_report_number(r, "objective", solved ? i->objective : NAN);
  cli_report_number(r, "primal_residual", solved ? i->primal_residual : NAN);
  cli_report_number(r, "dual_residual", solved ? i->dual_residual : NAN);
  cli_report_number(r, "duality_gap", solved ? i->duality_gap : NAN);
  cli_report_number(r, "primal_scale", solved ? i->primal_scale : NAN);
  cli_report_number(r, "dual_scale", solved ? i->dual_scale : NAN);
  cli_report_number(r, "gap_scale", solved ? i->gap_scale : NAN);
  cli_report_number(r, "tolerance", w->request->options.tolerance_relative);
  cli_report_count(r, "iterations", i->iterations);
  cli_report_count(r, "factorizations", i->factorizations);
  cli_report_count(r, "proximal_steps", i->proximal_steps);
  cli_report_count(r, "rows_used", i->rows_used);
  cli_report_count(r, "rows_active", i->rows_active);
  if (w->status == BATTEN_E_NOT_CONVEX)
    cli_report_count(r, "not_convex_index", i->not_convex_index);
  else
    cli_report_null(r, "not_convex_index");
  cli_report_number(r, "blend", w->request->options.exact && solved ? i->blend : NAN);
  cli_report_number(r, "time_read_s", w->time_read_s);
  cli_report_number(r, "time_setup_s", i->time_setup_s);
  cli_report_number(r, "time_solve_s", i->time_solve_s);
  cli_report_number(r, "time_qp_s", i->time_s);
  cli_report_number(r, "time_write_s", w->time_write_s);
}

void qp_summary(const qp_work *w) {
  const batten_qp_info *i = &w->info;
  qp_print_counts(&w->counts, &w->file);
  cli_line("status", "%s", batten_qp_status_word(w->status));
  cli_line("engine", "%s, %zu iteration%s, %zu factorization%s%s", engine_in_words(i->engine), i->iterations,
           plural(i->iterations, "", "s"), i->factorizations, plural(i->factorizations, "", "s"),
           i->proximal_steps ? ", proximal" : "");
  cli_line("objective", "%.12g", i->objective);
  cli_line("residuals", "primal %.1e, dual %.1e, gap %.1e, against %.1e, %.1e, %.1e", i->primal_residual,
           i->dual_residual, i->duality_gap, i->primal_scale, i->dual_scale, i->gap_scale);
  cli_line("active", "%zu of %zu constraints", i->rows_active, i->rows_used);
  if (w->request->options.exact && w->status == BATTEN_OK)
    cli_line("exact", "every inequality holds exactly; x was moved by %.1e of the way", i->blend);
  cli_line("time", "%.3f s: solving %.3f, files %.3f", batten_now() - w->run.started, i->time_s,
           w->time_read_s + w->time_write_s);
  for (size_t k = 0; k < w->request->common.outputs.count; k++)
    cli_line(k ? "" : "written", "%s", w->request->common.outputs.items[k].path);
}

/* ---- proofs in words ------------------------------------------------------------------------------ */

enum { NAMED = 4 };

BATTEN_PRINTF(3, 4) static void append(char *text, size_t size, const char *format, ...) {
  size_t length = strlen(text);
  va_list args;
  va_start(args, format);
  vsnprintf(text + length, size - length, format, args);
  va_end(args);
}

/* The NAMED largest values by size, in descending order; returns how many are more than rounding beside the largest.
 */
static size_t largest(const double *values, size_t count, size_t index[NAMED]) {
  size_t found = 0;
  double most = 0;
  for (size_t i = 0; i < count; i++) most = fmax(most, fabs(values[i]));
  for (size_t i = 0; i < count; i++) {
    if (!(fabs(values[i]) > 1e-6 * most)) continue;
    size_t at = found < NAMED ? found : NAMED;
    found++;
    for (; at > 0 && fabs(values[index[at - 1]]) < fabs(values[i]); at--)
      if (at < NAMED) index[at] = index[at - 1];
    if (at < NAMED) index[at] = i;
  }
  return found;
}

static void append_unknown(const qp_work *w, char *text, size_t size, size_t j) {
  char *const *names = w->file.unknown_names;
  if (names)
    append(text, size, "%.40s", names[j]);
  else
    append(text, size, "x%zu", j + 1);
}

/* "R1 >= 4", the side that the sign of the weight means. */
static void append_side(const qp_work *w, char *text, size_t size, size_t i, double weight) {
  const batten_qp_problem *p = &w->file.problem;
  size_t m = w->counts.rows;
  const double *sides = i < m ? (weight > 0 ? p->lower : p->upper) : (weight > 0 ? p->x_lower : p->x_upper);
  if (i >= m)
    append_unknown(w, text, size, i - m);
  else if (w->file.row_names)
    append(text, size, "%.40s", w->file.row_names[i]);
  else
    append(text, size, "r%zu", i + 1);
  append(text, size, " %s %.6g", weight > 0 ? ">=" : "<=", sides ? sides[i < m ? i : i - m] : NAN);
}

static void append_proof(const qp_work *w, char *text, size_t size, bool sides) {
  size_t index[NAMED], n = w->counts.unknowns, m = w->counts.rows;
  const double *values = sides ? w->solution.certificate : w->solution.ray;
  size_t found = largest(values, sides ? m + n : n, index);
  if (sides) append(text, size, found > 1 ? "; these contradict each other:" : "; this cannot hold, whatever x is:");
  for (size_t k = 0; k < found && k < NAMED; k++) {
    append(text, size, k ? ", " : " ");
    if (sides)
      append_side(w, text, size, index[k], values[index[k]]);
    else
      append_unknown(w, text, size, index[k]);
    append(text, size, sides ? " (times %.3g)" : " (%+.3g)", sides ? fabs(values[index[k]]) : values[index[k]]);
  }
  if (found > NAMED) append(text, size, " and %zu more", found - NAMED);
}

void qp_explain(const qp_work *w, char *text, size_t size) {
  text[0] = '\0';
  append(text, size, "%s: ", w->request->common.input);
  if (w->status == BATTEN_E_LIMIT) {
    size_t length = strlen(text);
    cli_run_text(&w->run, w->status, text + length, size - length);
    return;
  }
  append(text, size, "%s", batten_status_text(w->status));
  if (w->status == BATTEN_E_INFEASIBLE) {
    append_proof(w, text, size, true);
  } else if (w->status == BATTEN_E_UNBOUNDED) {
    append(text, size, " along");
    append_proof(w, text, size, false);
    append(text, size, "; bound these unknowns");
  } else {
    append(text, size, ": it curves downwards along");
    append_proof(w, text, size, false);
  }
}
