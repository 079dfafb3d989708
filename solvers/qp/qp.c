/* Convex quadratic programs: the driver. See <batten/qp.h> for the problem, engine.h for the parts.
 *
 * Engines are tried in the order of their estimated cost until the judge (certify.c) accepts a result or a proof.
 * What an engine says of itself counts for nothing: each point is mapped back to the caller's rows, judged there, and
 * kept when it is the best so far; the next engine starts from it and from its working set. */
#include <string.h>

#include "base/checked.h"
#include "certify.h"
#include "driver.h"
#include "exact.h"
#include "presolve.h"

batten_qp_problem batten_qp_problem_default(size_t n) {
  return (batten_qp_problem){.struct_size = sizeof(batten_qp_problem), .n = n};
}

batten_qp_options batten_qp_options_default(void) {
  return (batten_qp_options){.struct_size = sizeof(batten_qp_options),
                             .engine = BATTEN_QP_AUTO,
                             .tolerance_absolute = 1e-9,
                             .tolerance_relative = 1e-9,
                             .time_limit_s = INFINITY,
                             .hand_over = 1};
}

typedef struct solver {
  batten_context *ctx;
  const batten_qp_problem *problem;
  const batten_qp_options *o;
  size_t n, m; /* unknowns, rows of the caller */
  qp_presolve pre;
  qp_objective objective;
  qp_task task;
  qp_plan plan;
  qp_point point;      /* of the attempt under way, in constraints of the core */
  qp_point best;       /* the best so far, likewise; its figures are in info */
  bool found;          /* there is a best */
  batten_status proof; /* E_INFEASIBLE, E_UNBOUNDED, E_NOT_CONVEX once proven, else BATTEN_OK */
  batten_status stop;  /* E_LIMIT, E_CANCELLED once met, else BATTEN_OK */
  bool worn;           /* an engine met the limit that was chosen by size */
  bool settled;        /* y holds the multipliers of best, which best.y only comes near to */
  bool inexact;        /* exact was asked for and could not be had */
  double *y;           /* [m + n] multipliers of the caller; the certificate of E_INFEASIBLE */
  signed char *active; /* [m + n] working set of the caller */
  double *work;        /* [3 n] */
  double start, setup_s;
  batten_qp_info info;
} solver;

/* ---- Judging ---- */

static double against(double residual, double scale, const batten_qp_options *o) {
  return residual / (o->tolerance_absolute + o->tolerance_relative * scale);
}

/* Largest residual against what is allowed: a number to compare points by. */
static double merit(const batten_qp_info *info, const batten_qp_options *o) {
  double primal = against(info->primal_residual, info->primal_scale, o);
  double dual = against(info->dual_residual, info->dual_scale, o);
  double gap = against(info->duality_gap, info->gap_scale, o);
  if (!(primal < INFINITY)) return INFINITY;
  return dual < INFINITY && gap < INFINITY ? fmax(primal, fmax(dual, gap)) : 1e300 + primal;
}

/* Multipliers of sides that there are not are rounding of the engine: 0. x within its bounds up to rounding is put
 * there, and on them where they are in the working set. */
static void clean(const solver *s, qp_point *point) {
  const double NEAR = 1e-9;
  const qp_rows *rows = &s->pre.rows;
  for (size_t k = 0; k < rows->m; k++) {
    if (!isfinite(point->y[k] > 0 ? rows->lower[k] : rows->upper[k])) point->y[k] = 0;
    if (rows->row[k] < s->m || point->active[k] == QP_FREE) continue;
    double *x = &point->x[rows->row[k] - s->m];
    double side = (point->active[k] == QP_UPPER ? rows->upper[k] : rows->lower[k]) / rows->scale[k];
    if (isfinite(side) && fabs(*x - side) <= NEAR * (1 + fabs(side))) *x = side;
  }
  for (size_t j = 0; j < s->n; j++) {
    double from = s->problem->x_lower ? s->problem->x_lower[j] : -INFINITY;
    double to = s->problem->x_upper ? s->problem->x_upper[j] : INFINITY;
    if (point->x[j] < from && from - point->x[j] <= NEAR * (1 + fabs(from))) point->x[j] = from;
    if (point->x[j] > to && point->x[j] - to <= NEAR * (1 + fabs(to))) point->x[j] = to;
  }
}

static void judge(solver *s, const qp_point *point, batten_qp_info *info) {
  qp_presolve_back(&s->pre, point->y, point->active, s->y, s->active);
  qp_certify_residuals(s->problem, point->x, s->y, s->work, info);
}

/* Rounding of x and y themselves: no engine can do better. Tolerances may be out of reach by then. */
static const double ROUNDING = 1e-14;

static bool within(const batten_qp_info *f, double level) {
  return f->primal_residual <= level * f->primal_scale && f->dual_residual <= level * f->dual_scale &&
         f->duality_gap <= level * f->gap_scale;
}

static bool at_rounding(const solver *s) { return s->found && within(&s->info, ROUNDING); }

/* Residuals that are rounding but for a few digits: none of two such points is better for being smaller. */
static const double ENOUGH = 1e-12;

/* Keeps the point under way when it is better than the best so far. Where both are good enough the minimiser on a
 * working set goes before the end of a path, which is off by the root of its residuals where multipliers are 0. */
static void consider(solver *s, batten_qp_engine engine, bool on_working_set) {
  size_t m = s->pre.rows.m;
  if (batten_first_nonfinite(s->n, s->point.x) < s->n) return;
  if (batten_first_nonfinite(m, s->point.y) < m) memset(s->point.y, 0, m * sizeof *s->point.y);
  clean(s, &s->point);
  batten_qp_info info = s->info;
  judge(s, &s->point, &info);
  bool instead = on_working_set && s->info.engine == BATTEN_QP_INTERIOR && within(&info, ENOUGH) &&
                 qp_certify_optimal(&info, s->o);
  if (s->found && !instead && !(merit(&info, s->o) < merit(&s->info, s->o))) return;
  s->found = true;
  s->info = info;
  s->info.engine = engine;
  memcpy(s->best.x, s->point.x, s->n * sizeof *s->best.x);
  memcpy(s->best.y, s->point.y, m * sizeof *s->best.y);
  memcpy(s->best.active, s->point.active, m);
}

static bool optimal(const solver *s) { return s->found && qp_certify_optimal(&s->info, s->o); }
static bool feasible(const solver *s) { return s->found && qp_certify_feasible(&s->info, s->o); }
static bool finished(const solver *s) { return optimal(s) || s->proof < 0 || s->stop < 0; }

/* ---- One engine ---- */

/* Where a run starts: at what the caller gave, at the best so far, or at 0 with an empty working set: an engine that
 * got stuck from one may get through from the other. */
typedef enum beginning { GIVEN, BEST, COLD } beginning;

static void set_start(solver *s, beginning from) {
  size_t n = s->n, m = s->pre.rows.m;
  memset(s->point.y, 0, m * sizeof *s->point.y);
  memset(s->point.active, QP_FREE, m);
  memset(s->point.x, 0, n * sizeof *s->point.x);
  s->point.have_x = from == BEST || (from == GIVEN && s->o->x0);
  if (from == BEST) {
    memcpy(s->point.x, s->best.x, n * sizeof *s->point.x);
    memcpy(s->point.active, s->best.active, m);
  } else if (s->point.have_x) {
    memcpy(s->point.x, s->o->x0, n * sizeof *s->point.x);
  }
  if (from == GIVEN && s->o->active) qp_presolve_forward(&s->pre, s->o->active, s->point.active);
}

static batten_status run_interior(solver *s) {
  qp_sparse objective;
  batten_matrix h;
  void *memory = NULL;
  batten_status st = qp_objective_convex(s->ctx, &s->objective, &s->task.not_convex_index, s->point.ray);
  if (st < 0) return st;
  st = qp_objective_sparse(s->ctx, &s->objective, &objective, &h, &memory);
  if (st < 0) return st;
  st = qp_interior(s->ctx, &objective, &s->pre.rows, &s->task.limits, &s->point);
  batten_free(s->ctx, memory);
  return st;
}

/* Whether s->y is a proof, and one that counts: for every x, some row or bound is violated by 1 / sum |y_i| or more,
 * and that must be more than the caller minds. */
static bool proves_infeasible(solver *s) {
  if (!qp_certify_infeasible(s->problem, s->y, s->work)) return false;
  double sum = 0;
  for (size_t i = 0; i < s->m + s->n; i++) sum += fabs(s->y[i]);
  return sum * s->o->tolerance_absolute < 1;
}

static void try_infeasible(solver *s) {
  qp_presolve_back(&s->pre, s->point.y, s->point.active, s->y, s->active);
  if (proves_infeasible(s)) s->proof = BATTEN_E_INFEASIBLE;
}

/* A ray proves something where there is a feasible point: the one under way, or the point nearest to 0, which the
 * interior engine finds or finds not to be. */
static batten_status try_unbounded(solver *s) {
  if (!qp_certify_unbounded(s->problem, s->point.ray, s->work)) return BATTEN_OK;
  memcpy(s->best.ray, s->point.ray, s->n * sizeof *s->best.ray);
  if (!feasible(s)) {
    qp_sparse nearest = {.n = s->n};
    size_t n = s->n, *starts = batten_alloc_array(s->ctx, n + 1, sizeof *starts);
    double *ones = batten_alloc_array(s->ctx, n, 2 * sizeof *ones);
    batten_status st = BATTEN_E_NOMEM;
    if (starts && ones) {
      for (size_t j = 0; j <= n; j++) starts[j] = j;
      for (size_t j = 0; j < n; j++) {
        ones[j] = 1;
        ones[n + j] = 0;
      }
      batten_matrix identity = batten_matrix_sparse(n, n, starts, s->pre.rows.identity, ones);
      nearest.h = &identity;
      nearest.g = ones + n;
      set_start(s, COLD);
      st = qp_interior(s->ctx, &nearest, &s->pre.rows, &s->task.limits, &s->point);
    }
    batten_free(s->ctx, ones);
    batten_free(s->ctx, starts);
    if (st == BATTEN_E_NOMEM) return st;
    if (st == BATTEN_E_LIMIT || st == BATTEN_E_CANCELLED) s->stop = st;
    if (st == BATTEN_E_INFEASIBLE) try_infeasible(s);
    if (s->proof < 0) return BATTEN_OK;
    memset(s->point.y, 0, s->pre.rows.m * sizeof *s->point.y);
    s->found = false; /* whatever its merit: feasible is all that counts now */
    consider(s, BATTEN_QP_INTERIOR, false);
  }
  if (s->proof == BATTEN_OK && feasible(s)) s->proof = BATTEN_E_UNBOUNDED;
  return BATTEN_OK;
}

/* One run of an engine, and what becomes of its word. Fails only where going on makes no sense. */
static batten_status run(solver *s, batten_qp_engine engine, beginning from) {
  batten_status st = BATTEN_OK;
  set_start(s, from);
  if (s->n > 0)
    st = engine == BATTEN_QP_INTERIOR ? run_interior(s) : qp_dense_solve(s->ctx, &s->task, engine, &s->point);
  switch (st) {
    case BATTEN_E_LIMIT:
      /* a limit of the caller ends the solve; one that was chosen by size says that this run goes round in circles */
      s->worn = s->o->iteration_limit == 0 && batten_now() <= s->task.limits.deadline;
      if (!s->worn) s->stop = st;
      break;
    case BATTEN_E_CANCELLED:
      s->stop = st;
      break;
    case BATTEN_E_NOT_CONVEX:
      if (!qp_certify_not_convex(s->problem, s->point.ray)) return BATTEN_OK;
      memcpy(s->best.ray, s->point.ray, s->n * sizeof *s->best.ray);
      s->proof = st;
      return BATTEN_OK;
    case BATTEN_E_INFEASIBLE:
      try_infeasible(s);
      if (s->proof < 0) return BATTEN_OK;
      break;
    case BATTEN_OK:
    case BATTEN_W_ACCURACY:
    case BATTEN_E_UNBOUNDED:
      break;
    case BATTEN_E_SINGULAR:
    case BATTEN_E_TOO_LARGE:
      return BATTEN_OK; /* not for this engine */
    default:
      return st;
  }
  consider(s, engine, engine != BATTEN_QP_INTERIOR);
  return st == BATTEN_E_UNBOUNDED ? try_unbounded(s) : BATTEN_OK;
}

/* ---- The last digits ---- */

/* Whether the plan's engine i may bring something: the nearer the best so far is, the less it may cost. */
static bool worth_trying(const solver *s, size_t i) {
  const double NEAR = 1e3, CHEAP = 3e9; /* 3e9: a second or two */
  if (finished(s) || at_rounding(s)) return false;
  return i == 0 || s->plan.flops[i] <= CHEAP || !(merit(&s->info, s->o) <= NEAR);
}

/* The best point's working set, solved for outright. *refused: it is not yet the set of a solution. */
static batten_status polish(solver *s, bool *refused) {
  const size_t SMALL = 100, CHEAP = 300, MOST = 1000; /* unknowns for which it takes some 2 ms, 50 ms, a second */
  double error;
  *refused = false;
  if (!s->found || s->proof < 0 || s->stop < 0 || s->n == 0) return BATTEN_OK;
  bool path_end = s->info.engine == BATTEN_QP_INTERIOR && s->n <= SMALL;
  if (!path_end && (at_rounding(s) || (optimal(s) && within(&s->info, ENOUGH)))) return BATTEN_OK;
  if (s->info.engine == BATTEN_QP_INTERIOR && !s->o->hand_over) return BATTEN_OK;
  if (!s->plan.dense_affordable || s->n > (optimal(s) ? CHEAP : MOST)) return BATTEN_OK;
  batten_status st = qp_dense_factor(s->ctx, &s->task, s->point.ray);
  if (st < 0) return st == BATTEN_E_NOMEM ? st : BATTEN_OK;
  set_start(s, BEST);
  memcpy(s->point.y, s->best.y, s->pre.rows.m * sizeof *s->point.y);
  st = qp_refine(s->ctx, &s->task, &s->point, &error);
  if (st == BATTEN_E_LIMIT || st == BATTEN_E_CANCELLED) s->stop = st;
  if (st < 0) return st == BATTEN_E_NOMEM ? st : BATTEN_OK;
  *refused = !(error < INFINITY);
  if (!*refused) consider(s, s->info.engine, true);
  return BATTEN_OK;
}

/* ---- One engine after the other ---- */

/* A dense engine that gets stuck, or claims what it cannot prove, is tried again without the start that the caller
 * gave, and with more curvature; the interior point's working set, where it is not yet right, goes on in the dual
 * engine if the caller lets engines help each other. */
static batten_status attempt(solver *s, batten_qp_engine engine, beginning from) {
  bool refused;
  batten_status st = run(s, engine, from);
  if (st >= 0) st = polish(s, &refused);
  if (engine == BATTEN_QP_INTERIOR) {
    if (st < 0 || !refused) return st;
    st = run(s, BATTEN_QP_DUAL, BEST);
    return st >= 0 ? polish(s, &refused) : st;
  }
  bool given = from == GIVEN && (s->o->x0 || s->o->active);
  while (st >= 0 && !finished(s) && !at_rounding(s) && s->task.r && (given || qp_dense_damp(&s->task))) {
    given = false;
    st = run(s, engine, COLD);
    if (st >= 0) st = polish(s, &refused);
  }
  qp_dense_undamp(s->ctx, &s->task);
  return st;
}

/* Where only rounding keeps the best point from the tolerances: the doubles next to it, if they meet them. */
static void settle(solver *s) {
  if (!s->found || s->proof < 0 || s->n == 0 || s->o->exact || optimal(s)) return;
  batten_qp_info info = s->info;
  memcpy(s->point.x, s->best.x, s->n * sizeof *s->point.x);
  qp_presolve_back(&s->pre, s->best.y, s->best.active, s->y, s->active);
  qp_last_digits(s->problem, s->o, s->point.x, s->y, s->work, &info);
  if (!qp_certify_optimal(&info, s->o)) return;
  memcpy(s->best.x, s->point.x, s->n * sizeof *s->best.x);
  s->info = info;
  s->settled = true;
}

/* ---- Exactness, status ---- */

static batten_status blend(solver *s) {
  if (!s->o->exact || !s->found || s->proof < 0) return BATTEN_OK;
  batten_status st = qp_exact(s->ctx, s->problem, &s->pre.rows, &s->task.limits, s->o->interior, s->o->x0, s->best.x,
                              &s->info.blend);
  if (st == BATTEN_E_NOMEM) return st;
  s->inexact = st != BATTEN_OK;
  judge(s, &s->best, &s->info);
  return BATTEN_OK;
}

static batten_status conclude(solver *s) {
  const batten_qp_info *f = &s->info;
  switch (s->proof) {
    case BATTEN_E_INFEASIBLE:
      return batten_fail(s->ctx, s->proof,
                         "no x satisfies the rows and bounds: relax those with solution.certificate");
    case BATTEN_E_UNBOUNDED:
      return batten_fail(s->ctx, s->proof,
                         "the objective falls without end along solution.ray; add bounds, rows or curvature");
    case BATTEN_E_NOT_CONVEX:
      return batten_fail(
          s->ctx, s->proof,
          "problem.h: not positive semidefinite, the pivot of unknown %zu is negative; add to the diagonal",
          f->not_convex_index);
    default:
      break;
  }
  if (s->inexact && (optimal(s) || feasible(s)))
    return batten_fail(s->ctx, BATTEN_W_ACCURACY, "opt.exact: could not be had: %s", batten_error(s->ctx));
  if (optimal(s)) return BATTEN_OK;
  if (s->stop < 0 && feasible(s))
    return batten_fail(s->ctx, BATTEN_W_STOPPED, "stopped at a feasible point: %s", batten_error(s->ctx));
  if (s->stop < 0) return s->stop; /* with the text of whoever stopped */
  if (!s->found)
    return batten_fail(s->ctx, BATTEN_E_LIMIT,
                       "no engine found a point; scale the problem, or try another opt.engine");
  return batten_fail(s->ctx, BATTEN_W_ACCURACY,
                     "residuals: primal %.3g at size %.3g, dual %.3g at size %.3g, gap %.3g at size %.3g miss the "
                     "tolerance; scale the problem or allow more",
                     f->primal_residual, f->primal_scale, f->dual_residual, f->dual_scale, f->duality_gap,
                     f->gap_scale);
}

/* ---- From and to the caller ---- */

static batten_status allocate_point(solver *s, qp_point *point) {
  size_t n = s->n, m = s->pre.rows.m, doubles;
  if (!batten_add(2 * n, m, &doubles)) return BATTEN_E_TOO_LARGE;
  point->x = batten_alloc_array(s->ctx, doubles, sizeof *point->x);
  if (!point->x) return BATTEN_E_NOMEM;
  point->ray = point->x + n;
  point->y = point->ray + n;
  point->active = batten_alloc_array(s->ctx, m, sizeof *point->active);
  return point->active ? BATTEN_OK : BATTEN_E_NOMEM;
}

static void set_limits(solver *s) {
  const batten_qp_options *o = s->o;
  qp_limits *limits = &s->task.limits;
  limits->iterations = o->iteration_limit;
  if (limits->iterations == 0 && !batten_mul(100, s->n + s->m + 10, &limits->iterations))
    limits->iterations = SIZE_MAX;
  limits->deadline = s->start + o->time_limit_s;
  /* a hundredth of what is asked, so that the judge, who measures otherwise, agrees; not below what rounding lets be
   */
  double relative = o->tolerance_relative > 0 ? o->tolerance_relative : o->tolerance_absolute;
  limits->tolerance = fmin(fmax(0.01 * relative, 1e-12), 1e-4);
  limits->absolute = 0.3 * o->tolerance_absolute;
  limits->relative = 0.3 * o->tolerance_relative;
}

/* Everything before the first engine. E_INFEASIBLE when presolve has a proof. */
static batten_status set_up(solver *s) {
  s->y = batten_alloc_array(s->ctx, s->m + s->n, sizeof *s->y);
  if (!s->y) return BATTEN_E_NOMEM;
  s->active = batten_alloc_array(s->ctx, s->m + s->n, sizeof *s->active);
  if (!s->active) return BATTEN_E_NOMEM;
  s->work = batten_alloc_array(s->ctx, s->n, 3 * sizeof *s->work);
  if (!s->work) return BATTEN_E_NOMEM;
  batten_status st = qp_check_structure(s->ctx, s->problem);
  if (st == BATTEN_OK) st = batten_progress(s->ctx, "quadratic program", 0);
  if (st == BATTEN_OK) st = qp_presolve_new(s->ctx, s->problem, s->o->tolerance_absolute, &s->pre, s->y);
  if (st == BATTEN_E_INFEASIBLE && proves_infeasible(s)) {
    s->proof = st;
    return BATTEN_OK;
  }
  if (st == BATTEN_E_INFEASIBLE)
    return batten_fail(s->ctx, BATTEN_E_LIMIT,
                       "rows or bounds contradict each other by little more than rounding; "
                       "scale them, or relax them");
  if (st == BATTEN_OK) st = allocate_point(s, &s->point);
  if (st == BATTEN_OK) st = allocate_point(s, &s->best);
  if (st == BATTEN_OK) st = qp_objective_new(s->ctx, s->problem, &s->objective);
  if (st < 0) return st;
  s->task.problem = s->problem;
  s->task.objective = &s->objective;
  s->task.rows = &s->pre.rows;
  s->task.not_convex_index = s->n;
  set_limits(s);
  s->info.not_convex_index = s->n;
  s->info.rows_used = s->pre.rows.m;
  return BATTEN_OK;
}

static void release_point(solver *s, qp_point *point) {
  batten_free(s->ctx, point->active);
  batten_free(s->ctx, point->x);
}

static void tear_down(solver *s) {
  qp_task_free(s->ctx, &s->task);
  qp_objective_free(s->ctx, &s->objective);
  release_point(s, &s->best);
  release_point(s, &s->point);
  qp_presolve_free(s->ctx, &s->pre);
  batten_free(s->ctx, s->work);
  batten_free(s->ctx, s->active);
  batten_free(s->ctx, s->y);
}

static void copy(double *to, const double *from, size_t count) {
  if (to && count > 0) memcpy(to, from, count * sizeof *to);
}

static void deliver(solver *s, batten_status st, batten_qp_solution *out) {
  size_t all = s->m + s->n;
  s->info.rows_active = 0;
  if (st >= 0) {
    if (!s->settled) qp_presolve_back(&s->pre, s->best.y, s->best.active, s->y, s->active);
    for (size_t i = 0; i < all; i++) s->info.rows_active += s->active[i] != QP_FREE;
  }
  if (!out) return;
  if (st >= 0) {
    copy(out->x, s->best.x, s->n);
    copy(out->multipliers, s->y, all);
    if (out->active && all > 0) memcpy(out->active, s->active, all);
  }
  if (st == BATTEN_E_INFEASIBLE) copy(out->certificate, s->y, all);
  if (st == BATTEN_E_UNBOUNDED || st == BATTEN_E_NOT_CONVEX) copy(out->ray, s->best.ray, s->n);
}

/* Whether info and the solution say something under this status. */
static bool has_figures(batten_status st) {
  return st >= 0 || st == BATTEN_E_INFEASIBLE || st == BATTEN_E_UNBOUNDED || st == BATTEN_E_NOT_CONVEX ||
         st == BATTEN_E_LIMIT;
}

static batten_status solve(solver *s) {
  batten_status st = set_up(s);
  if (st < 0) return st;
  if (s->proof == BATTEN_OK) st = qp_choose(s->ctx, &s->task, s->o, false, &s->plan);
  s->setup_s = batten_now() - s->start;
  for (size_t i = 0; st >= 0 && i < s->plan.count && worth_trying(s, i); i++) {
    st = attempt(s, s->plan.engine[i], i == 0 ? GIVEN : COLD);
    if (st >= 0) settle(s);
  }
  if (st >= 0 && s->worn && !finished(s))
    s->stop = batten_fail(s->ctx, BATTEN_E_LIMIT,
                          "opt.iteration_limit: %zu iterations, chosen by size, were not enough; "
                          "allow more",
                          s->task.limits.iterations);
  if (st >= 0) st = blend(s);
  if (st < 0) return st;
  s->info.not_convex_index = s->proof == BATTEN_E_NOT_CONVEX ? s->task.not_convex_index : s->n;
  s->info.cancelled = s->stop == BATTEN_E_CANCELLED && !optimal(s); /* the last step may have come in time */
  s->info.iterations = s->point.iterations;
  s->info.factorizations = s->point.factorizations;
  s->info.proximal_steps = s->task.proximal_steps;
  return conclude(s);
}

batten_status batten_qp_solve(batten_context *ctx, const batten_qp_problem *problem, const batten_qp_options *opt,
                              batten_qp_workspace *workspace, batten_qp_solution *solution, batten_qp_info *info) {
  if (!ctx) return BATTEN_E_INVALID;
  batten_qp_options o = opt ? *opt : batten_qp_options_default();
  double start = batten_now();
  batten_qp_workspace *own = NULL;
  batten_status st = qp_check(ctx, problem, &o);
  if (st < 0) return st;
  if (workspace && qp_outer_context(workspace) != ctx)
    return batten_fail(ctx, BATTEN_E_INVALID, "workspace: made with another context; make one with this");
  if (!workspace) {
    st = batten_qp_workspace_new(ctx, &own);
    if (st < 0) return st;
  }

  solver s = {.ctx = qp_context(workspace ? workspace : own),
              .problem = problem,
              .o = &o,
              .n = problem->n,
              .m = qp_problem_rows(problem),
              .start = start};
  st = solve(&s);
  if (has_figures(st)) {
    deliver(&s, st, solution);
    s.info.time_setup_s = s.setup_s + s.task.factor_s;
    s.info.time_s = batten_now() - start;
    s.info.time_solve_s = s.info.time_s - s.info.time_setup_s;
    if (info) *info = s.info;
  }
  if (st != BATTEN_OK) batten_fail(ctx, st, "%s", batten_error(s.ctx));
  tear_down(&s);
  batten_qp_workspace_free(own);
  return st;
}

batten_status batten_qp_bytes(batten_context *ctx, const batten_qp_problem *problem, const batten_qp_options *opt,
                              size_t *bytes, batten_qp_engine *engine) {
  if (!ctx) return BATTEN_E_INVALID;
  if (!bytes) return batten_fail(ctx, BATTEN_E_INVALID, "bytes: NULL");
  batten_qp_options o = opt ? *opt : batten_qp_options_default();
  batten_qp_workspace *own = NULL;
  batten_status st = qp_check(ctx, problem, &o);
  if (st == BATTEN_OK) st = batten_qp_workspace_new(ctx, &own);
  if (st < 0) return st;
  solver s = {.ctx = qp_context(own), .problem = problem, .o = &o, .n = problem->n, .m = qp_problem_rows(problem)};
  st = set_up(&s);
  if (st == BATTEN_OK && s.proof == BATTEN_OK) st = qp_choose(s.ctx, &s.task, &o, true, &s.plan);
  if (st == BATTEN_OK) {
    /* what is held while an engine runs, or what presolve took, whichever is more */
    size_t held = batten_bytes_in_use(ctx), with_engine;
    batten_add(held, s.plan.bytes, &with_engine);
    *bytes = with_engine > batten_bytes_peak(ctx) ? with_engine : batten_bytes_peak(ctx);
    if (engine) *engine = s.plan.count > 0 ? s.plan.engine[0] : o.engine;
  } else {
    batten_fail(ctx, st, "%s", batten_error(s.ctx));
  }
  tear_down(&s);
  batten_qp_workspace_free(own);
  return st;
}
