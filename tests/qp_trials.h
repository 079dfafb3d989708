/* Random quadratic programs with a known solution, solved by every engine and judged: the property test runs some
 * hundreds, the benchmark ten thousand. A trial passes when
 *   - the status is BATTEN_OK,
 *   - primal and dual residual and gap are within 1e-9 of their scales, recomputed in long double,
 *   - x is the known solution within 10 n eps times the condition of the Hessian, and so agrees with every other
 * engine. Excluded from the last, where the objective is to be the known one within 1e-9 instead: semidefinite
 * Hessians, whose solution need not be unique, and the interior point on more than 300 unknowns, where it stops at
 * residuals of 1e-9 and no dense engine takes over for the last digits. No problem is excluded from the rest;
 * conditions go to 1e10. */
#ifndef QP_TRIALS_H
#define QP_TRIALS_H

#include "qp_check.h"

/* Index as in qp_engines. */
typedef struct qp_trials {
  size_t runs[4], passed[4], semidefinite[4], semidefinite_passed[4];
  double primal[4], dual[4], gap[4], off[4]; /* the worst: over scales; off over what is allowed */
  double seconds[4];
  size_t pivots[4];
  size_t failures; /* printed so far */
} qp_trials;

typedef struct qp_trial_result {
  batten_status status;
  qp_verdict verdict;
  double primal, dual, gap; /* over their scales */
  double off;               /* over what is allowed */
  bool passed;
} qp_trial_result;

/* Scales below this are those of a problem that is nearly nothing; all data are of size one. */
#define QP_TRIAL_LEAST 0.01

/* Condition of the rows that hold with equality, as Gram and Schmidt find it: 1 over the least part of one of them,
 * of length 1, that those before it do not make up (rows that they do make up do not count). At a vertex x is given
 * by these rows alone, whatever the Hessian. */
static inline double qp_trial_rows_condition(const qp_scene_spec *spec, const qp_scene *s) {
  const double DEPENDENT = 1e-9;
  size_t n = spec->n, held = spec->equalities + spec->active, rank = 0;
  double *q = calloc(n * n + n, sizeof *q), least = 1;
  long double *row = calloc(n, sizeof *row);
  for (size_t i = 0; i < held + spec->bounded && rank < n; i++) {
    long double before = 0, after = 0;
    memset(row, 0, n * sizeof *row);
    if (i < held)
      qp_scene_add(&s->c, i, 1, row);
    else
      row[i - held] = 1;
    for (size_t j = 0; j < n; j++) before += row[j] * row[j];
    for (size_t k = 0; k < rank; k++) {
      long double dot = 0;
      for (size_t j = 0; j < n; j++) dot += q[k * n + j] * row[j];
      for (size_t j = 0; j < n; j++) row[j] -= dot * q[k * n + j];
    }
    for (size_t j = 0; j < n; j++) after += row[j] * row[j];
    double part = before > 0 ? (double)sqrtl(after / before) : 0;
    if (part < DEPENDENT) continue;
    least = fmin(least, part);
    for (size_t j = 0; j < n; j++) q[rank * n + j] = (double)(row[j] / sqrtl(after));
    rank++;
  }
  free(q);
  free(row);
  return 1 / least;
}

/* Rounding in x, and that of the data, by which the known solution itself misses to be one; but for the condition of
 * the rows. */
static inline double qp_trial_allowed(const qp_scene_spec *spec, const qp_verdict *v, const qp_verdict *known) {
  double n = (double)spec->n;
  return spec->condition * (10 * n * 0x1p-52 * (1 + v->dual_scale) + sqrt(n) * known->dual);
}

static inline qp_trial_result qp_trial_judge(const qp_scene_spec *spec, const qp_scene *s, batten_qp_engine engine,
                                             batten_status status, const double *x, const double *y) {
  const size_t HANDED_OVER = 100;
  qp_trial_result r = {.status = status, .primal = INFINITY, .dual = INFINITY, .gap = INFINITY, .off = INFINITY};
  if (status != BATTEN_OK && status != BATTEN_W_ACCURACY) return r;
  r.verdict = qp_check(&s->problem, x, y);
  r.primal = r.verdict.primal / fmax(r.verdict.primal_scale, QP_TRIAL_LEAST);
  r.dual = r.verdict.dual / fmax(r.verdict.dual_scale, QP_TRIAL_LEAST);
  r.gap = r.verdict.gap / fmax(r.verdict.gap_scale, QP_TRIAL_LEAST);
  double off = 0;
  for (size_t j = 0; j < spec->n; j++) off = fmax(off, fabs(x[j] - s->x[j]));
  qp_verdict known = qp_check(&s->problem, s->x, s->y);
  r.off = off / qp_trial_allowed(spec, &r.verdict, &known);
  if (r.off > 1) r.off /= qp_trial_rows_condition(spec, s); /* dear, and nearly never needed */
  if (spec->null || (engine == BATTEN_QP_INTERIOR && spec->n > HANDED_OVER)) {
    r.off = fabs(r.verdict.objective - known.objective) / (1e-9 * fmax(known.gap_scale, QP_TRIAL_LEAST));
  }
  r.passed = status == BATTEN_OK && qp_check_within(&r.verdict, 1e-9, QP_TRIAL_LEAST) && r.off <= 1;
  return r;
}

static inline void qp_trials_print_failure(qp_trials *t, uint64_t number, const qp_scene_spec *p, int engine,
                                           const qp_trial_result *r, const char *text) {
  if (++t->failures > 40) return;
  printf(
      "# number %llu (n %zu, m %zu, condition %.1e, null %zu, equalities %zu, active %zu, bounded %zu%s%s%s%s%s) by "
      "%s: %s, "
      "primal %.2g, dual %.2g, gap %.2g, off %.2g of what is allowed %s\n",
      (unsigned long long)number, p->n, p->m, p->condition, p->null, p->equalities, p->active, p->bounded,
      p->bounds ? ", bounds" : "", p->lsq ? ", lsq" : "", p->sparse ? ", sparse" : "",
      p->two_sided ? ", two-sided" : "", p->weak ? ", weak" : "", qp_engine_names[engine],
      batten_status_name(r->status), r->primal, r->dual, r->gap, r->off, text);
}

/* Runs the problem of a number by the engines of a mask (bit i: qp_engines[i]). */
static inline void qp_trials_run(batten_context *ctx, batten_qp_workspace *workspace, qp_trials *t, uint64_t number,
                                 const qp_scene_spec *spec, unsigned mask) {
  qp_scene *s = qp_scene_random(spec);
  double *x = qp_scene_array(s, spec->n, sizeof *x), *y = qp_scene_array(s, spec->n + spec->m, sizeof *y);
  for (int e = 0; e < 4; e++) {
    if (!(mask >> e & 1)) continue;
    batten_qp_options o = batten_qp_options_default();
    batten_qp_info info = {0};
    batten_qp_solution solution = {.x = x, .multipliers = y};
    o.engine = qp_engines[e];
    double start = batten_now();
    batten_status status = batten_qp_solve(ctx, &s->problem, &o, workspace, &solution, &info);
    t->seconds[e] += batten_now() - start;
    t->pivots[e] += info.iterations;
    qp_trial_result r = qp_trial_judge(spec, s, info.engine, status, x, y);
    t->runs[e]++;
    t->passed[e] += r.passed;
    t->semidefinite[e] += spec->null > 0;
    t->semidefinite_passed[e] += spec->null > 0 && r.passed;
    if (!r.passed) qp_trials_print_failure(t, number, spec, e, &r, status == BATTEN_OK ? "" : batten_error(ctx));
    if (!r.passed) continue;
    t->primal[e] = fmax(t->primal[e], r.primal);
    t->dual[e] = fmax(t->dual[e], r.dual);
    t->gap[e] = fmax(t->gap[e], r.gap);
    t->off[e] = fmax(t->off[e], r.off);
  }
  qp_scene_free(s);
}

#endif
