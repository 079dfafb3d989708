/* Dense engines on any convex objective: at once where it is strictly convex, else as proximal points [Rockafellar
 * 1976]
 *
 *     x_{i+1} = argmin f(x) + rho/2 |D (x - x_i)|^2   over the rows,
 *
 * with one factor of P + rho D^2 for all rounds, each from the working set of the one before. rho is tiny, so that
 * few rounds are needed: every direction with curvature is settled to the digits of rho by the first, every direction
 * without goes as far as the next row. Two ways to be faster: after a round, f itself is minimised along the step
 * just made; and once the working set stays, the problem on it is solved outright (refine.c). A step along which f
 * falls and no row is met is a ray. */
#include <float.h>
#include <string.h>

#include "certify.h"
#include "driver.h"
#include "la/la.h"

/* Against curvatures of the scaled objective, which are about 1: half of the digits for the curvature that is kept,
 * half for the steps without. */
static const double RHO = 1e-8;

/* ---- The factor ---- */

void qp_task_free(batten_context *ctx, qp_task *task) {
  batten_free(ctx, task->r);
  batten_free(ctx, task->base);
  task->r = task->base = NULL;
}

bool qp_dense_damp(qp_task *task) {
  const double STEP = 1000, MOST = 1e-1;
  double more = fmax(STEP * task->rho, RHO);
  if (more >= MOST) return false;
  task->least_rho = more;
  return true;
}

void qp_dense_undamp(batten_context *ctx, qp_task *task) {
  if (task->least_rho > 0) qp_task_free(ctx, task);
  task->least_rho = 0;
}

batten_status qp_dense_factor(batten_context *ctx, qp_task *task, double *ray) {
  size_t n = task->rows->n;
  if (task->r && task->rho >= task->least_rho) return BATTEN_OK;
  if (!task->r) {
    task->r = batten_alloc_array(ctx, n, n * sizeof *task->r);
    if (!task->r) return BATTEN_E_NOMEM;
    task->base = batten_alloc_array(ctx, n, sizeof *task->base);
    if (!task->base) {
      qp_task_free(ctx, task);
      return BATTEN_E_NOMEM;
    }
  }
  batten_status st = BATTEN_E_SINGULAR;
  double start = batten_now();
  for (double rho = task->least_rho; st == BATTEN_E_SINGULAR && rho <= 1; rho = rho > 0 ? 100 * rho : RHO) {
    task->rho = rho;
    st = qp_objective_factor(ctx, task->objective, rho, task->r, task->base, &task->not_convex_index, ray);
  }
  task->factor_s += batten_now() - start;
  if (st == BATTEN_OK) return st;
  qp_task_free(ctx, task);
  return st;
}

/* ---- One round ---- */

typedef struct loop {
  qp_task *task;
  batten_qp_engine engine;
  double *center, *target;       /* [n] */
  double *before, *after, *step; /* [n] gradients of f at center and at x, x - center */
  double *rows_x, *rows_step;    /* [m] products of the rows */
  signed char *last;             /* [m] working set of the round before */
} loop;

static batten_status engine_run(batten_context *ctx, loop *l, qp_point *point) {
  qp_task *task = l->task;
  qp_dense objective = {task->rows->n, task->r, l->target};
  return l->engine == BATTEN_QP_PRIMAL ? qp_primal(ctx, &objective, task->rows, &task->limits, point)
                                       : qp_dual(ctx, &objective, task->rows, &task->limits, point);
}

/* How far x + t step stays within the rows. */
static double free_way(const loop *l, const qp_point *point, double length) {
  const qp_rows *rows = l->task->rows;
  double most = INFINITY;
  if (rows->m == 0) return most;
  qp_rows_times(rows, 0, rows->m, point->x, l->rows_x);
  qp_rows_times(rows, 0, rows->m, l->step, l->rows_step);
  for (size_t k = 0; k < rows->m; k++) {
    double rate = l->rows_step[k];
    if (fabs(rate) <= 1e-12 * length) continue;
    double room = rate > 0 ? (rows->upper[k] - l->rows_x[k]) / rate : (rows->lower[k] - l->rows_x[k]) / rate;
    most = fmin(most, fmax(room, 0));
  }
  return most;
}

/* The next center: where f is least along the step just made. *falls: f falls along it and nothing is in the way. */
static void next_center(loop *l, const qp_point *point, bool *falls) {
  size_t n = l->task->rows->n;
  const double *metric = l->task->objective->metric;
  double slope = 0, curvature = 0, squares = 0, length = 0;
  qp_objective_gradient(l->task->objective, l->center, l->before);
  for (size_t j = 0; j < n; j++) {
    double moved = metric[j] * l->step[j];
    slope += l->after[j] * l->step[j];
    curvature += (l->after[j] - l->before[j]) * l->step[j];
    squares += moved * moved;
    length += l->step[j] * l->step[j];
  }
  double t = 0;
  *falls = false;
  if (slope < 0) {
    double way = free_way(l, point, sqrt(length));
    bool flat = curvature <= 1e-10 * squares; /* below what rho lets through, above rounding */
    *falls = flat && way >= 1e12;
    t = fmin(flat ? way : -slope / curvature, way);
    if (*falls) t = 0; /* where that is not yet a ray, the next step has rho of the curvature that this one has */
  }
  for (size_t j = 0; j < n; j++) l->center[j] = point->x[j] + t * l->step[j];
}

/* How much of the gradient the proximal term holds, against the gradient's size. */
static double pull(const loop *l) {
  const qp_objective *o = l->task->objective;
  double most = 0, size = 0;
  for (size_t j = 0; j < o->n; j++) {
    most = fmax(most, l->task->rho * fabs(o->metric[j] * (o->metric[j] * l->step[j])));
    size = fmax(size, fabs(l->after[j]));
    if (o->problem->g) size = fmax(size, fabs(o->problem->g[j]));
  }
  return most > 0 ? most / size : 0;
}

/* out := (P + sum of a_k a_k' over the working set) ray. scratch [n]. */
static void stiffness(const loop *l, const qp_point *point, const double *ray, double *scratch, double *out) {
  const qp_rows *rows = l->task->rows;
  size_t n = rows->n;
  memset(out, 0, n * sizeof *out);
  qp_objective_gradient(l->task->objective, out, scratch);
  qp_objective_gradient(l->task->objective, ray, out);
  for (size_t j = 0; j < n; j++) out[j] -= scratch[j];
  for (size_t k = 0; k < rows->m; k++)
    if (point->active[k] != QP_FREE) qp_rows_add(rows, k, qp_rows_dot(rows, k, ray), out);
}

/* ray -= (K + rho D^2)^-1 K ray until nothing changes, K = P + sum of a_k a_k' over the working set: takes out what
 * has curvature and what leaves the working set, by rho / (rho + K) each time. before and after are scratch. */
static batten_status straighten(batten_context *ctx, const loop *l, const qp_point *point, double *ray) {
  enum { TIMES = 60 };
  const qp_task *task = l->task;
  size_t n = task->rows->n;
  double change = 1, *row, *k = batten_alloc_array(ctx, n + 1, n * sizeof *k);
  if (!k) return BATTEN_E_NOMEM;
  row = k + n * n;
  memset(k, 0, n * n * sizeof *k);
  batten_la_syrk(BATTEN_LA_DOUBLE, 'U', 'T', n, n, 1, task->r, n, 0, k, n);
  for (size_t q = 0; q < task->rows->m; q++) {
    if (point->active[q] == QP_FREE) continue;
    memset(row, 0, n * sizeof *row);
    qp_rows_add(task->rows, q, 1, row);
    batten_la_syrk(BATTEN_LA_DOUBLE, 'U', 'N', n, 1, 1, row, n, 1, k, n);
  }
  if (batten_la_potrf(BATTEN_LA_DOUBLE, 'U', n, k, n) != 0) change = 0;
  for (int time = 0; time < TIMES && change > DBL_EPSILON; time++) {
    stiffness(l, point, ray, l->after, l->before);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'U', 'T', n, k, n, l->before);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'U', 'N', n, k, n, l->before);
    change = 0;
    for (size_t j = 0; j < n; j++) {
      ray[j] -= l->before[j];
      change = fmax(change, fabs(task->objective->metric[j] * l->before[j]));
    }
  }
  batten_free(ctx, k);
  return BATTEN_OK;
}

/* Whether the step is a ray, once entries that are rounding are taken out, or else what has curvature: E_UNBOUNDED.
 */
static batten_status judge_ray(batten_context *ctx, const loop *l, qp_point *point) {
  const qp_objective *o = l->task->objective;
  double most = 0, *ray = point->ray;
  for (size_t j = 0; j < o->n; j++) most = fmax(most, fabs(o->metric[j] * l->step[j]));
  for (size_t j = 0; j < o->n; j++) ray[j] = fabs(o->metric[j] * l->step[j]) > 1e-9 * most ? l->step[j] : 0;
  if (qp_certify_unbounded(l->task->problem, ray, l->before)) return BATTEN_E_UNBOUNDED;
  for (size_t j = 0; j < o->n; j++) ray[j] = l->step[j] / most;
  batten_status st = straighten(ctx, l, point, ray);
  if (st < 0) return st;
  for (size_t j = 0; j < o->n; j++)
    if (fabs(o->metric[j] * ray[j]) <= (double)o->n * DBL_EPSILON) ray[j] = 0;
  return qp_certify_unbounded(l->task->problem, ray, l->before) ? BATTEN_E_UNBOUNDED : BATTEN_OK;
}

/* ---- The loop ---- */

static batten_status rounds(batten_context *ctx, loop *l, qp_point *point) {
  enum { MOST = 100 };
  const double DONE = 1e-14, SETTLED = 1e-12;
  qp_task *task = l->task;
  size_t n = task->rows->n, m = task->rows->m;
  bool refused = false; /* this working set is not that of a solution */
  for (size_t round = 0; round < MOST; round++) {
    qp_objective_target(task->objective, task->rho, task->r, task->base, l->center, l->target);
    if (m > 0) memcpy(l->last, point->active, m);
    batten_status st = engine_run(ctx, l, point);
    task->proximal_steps++;
    if (st != BATTEN_OK) return st;
    for (size_t j = 0; j < n; j++) l->step[j] = point->x[j] - l->center[j];
    qp_objective_gradient(task->objective, point->x, l->after);
    if (pull(l) <= DONE) return BATTEN_OK;
    bool settled = round > 0 && (m == 0 || memcmp(l->last, point->active, m) == 0);
    if (!settled) refused = false;
    if (settled && !refused) {
      double error;
      st = qp_refine(ctx, task, point, &error);
      if (st < 0 || error <= SETTLED) return st;
      refused = !(error < INFINITY);
      if (!refused) qp_objective_gradient(task->objective, point->x, l->after);
      for (size_t j = 0; j < n; j++) l->step[j] = point->x[j] - l->center[j];
    }
    bool falls;
    next_center(l, point, &falls);
    if (falls) st = judge_ray(ctx, l, point);
    if (st < 0) return st;
  }
  return BATTEN_W_ACCURACY;
}

static batten_status allocate(batten_context *ctx, loop *l, size_t n, size_t m) {
  double **by_unknown[] = {&l->center, &l->target, &l->before, &l->after, &l->step};
  enum { ARRAYS = sizeof by_unknown / sizeof *by_unknown };
  double *all = batten_alloc_array(ctx, n, ARRAYS * sizeof *all);
  if (!all) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < ARRAYS; i++) *by_unknown[i] = all + i * n;
  l->rows_x = batten_alloc_array(ctx, m, 2 * sizeof *l->rows_x);
  if (!l->rows_x) return BATTEN_E_NOMEM;
  l->rows_step = l->rows_x + m;
  l->last = batten_alloc_array(ctx, m, sizeof *l->last);
  return l->last ? BATTEN_OK : BATTEN_E_NOMEM;
}

batten_status qp_dense_solve(batten_context *ctx, qp_task *task, batten_qp_engine engine, qp_point *point) {
  loop l = {.task = task, .engine = engine};
  size_t n = task->rows->n;
  batten_status st = qp_dense_factor(ctx, task, point->ray);
  if (st < 0) return st;
  point->factorizations++;
  st = allocate(ctx, &l, n, task->rows->m);
  if (st < 0) goto done;
  if (task->rho <= 0) {
    memcpy(l.target, task->base, n * sizeof *l.target);
    st = engine_run(ctx, &l, point);
  } else {
    memcpy(l.center, point->x, n * sizeof *l.center);
    st = rounds(ctx, &l, point);
  }
done:
  batten_free(ctx, l.last);
  batten_free(ctx, l.rows_x);
  batten_free(ctx, l.center);
  return st;
}
