/* The last digits: the minimiser on a given working set, up to the rounding of x and y themselves.
 *
 * On the members N of the working set the solution solves  P s - N dy = r_d,  N's = r_p  for the residuals of where
 * we are. With J'N = [T; 0] of the factor R'R = P + rho D^2 (active.h) and s = J w this is T'w1 = r_p,   w2 = J2'r_d,
 * T dy = w1 - J1'r_d, exact for rho = 0, where repeating it is iterative refinement, and a preconditioner otherwise:
 * with I - rho J2'D^2 J2 for a matrix, conjugate gradients end after as many steps as there are directions of little
 * curvature. Residuals are summed in twice the working precision, from the caller's data, so that their rounding does
 * not limit the result. */
#include <float.h>
#include <string.h>

#include "active.h"
#include "driver.h"
#include "matrix_row.h"
#include "twice.h"

static qp_twice row_product(const qp_matrix_row *row, const double *x) {
  qp_twice sum = {0, 0};
  for (size_t e = 0; e < row->count; e++) qp_twice_add_product(&sum, row->values[e], x[qp_row_column(row, e)]);
  return sum;
}

/* ---- The system ---- */

typedef struct refinement {
  const qp_task *task;
  qp_active set;
  qp_twice *sum;              /* [n] */
  double *x, *y;           /* [n], [n] of members: where we are */
  double *best_x, *best_y; /* where the residuals were least */
  double *dual, *primal;   /* [n] r_d, [n] r_p of members */
  double *d, *w, *p;       /* [n] J'r_d, the step in the factor's variables, the direction of conjugate gradients */
  double *step;            /* [n] J2 p */
} refinement;

static void add_gradient(refinement *f) {
  const batten_qp_problem *p = f->task->problem;
  size_t n = p->n;
  for (size_t j = 0; j < n; j++) f->sum[j] = (qp_twice){p->g ? p->g[j] : 0, 0};
  for (size_t i = 0; p->h && i < n; i++) {
    qp_matrix_row row = qp_row_of(p->h, i);
    qp_twice product = row_product(&row, f->x);
    qp_twice_add(&f->sum[i], product.high);
    f->sum[i].low += product.low;
  }
  for (size_t i = 0; p->a && i < p->a->rows; i++) {
    qp_matrix_row row = qp_row_of(p->a, i);
    qp_twice residual = row_product(&row, f->x);
    if (p->b) qp_twice_add(&residual, -p->b[i]);
    double weighted = (p->weights ? p->weights[i] : 1) * (residual.high + residual.low);
    for (size_t e = 0; e < row.count; e++)
      qp_twice_add_product(&f->sum[qp_row_column(&row, e)], row.values[e], weighted);
  }
}

/* r_d = -(gradient - N y), r_p; returns the larger of the two against the sizes of what they are made of. */
static double residuals(refinement *f) {
  const qp_rows *rows = f->task->rows;
  size_t n = rows->n;
  double dual_scale = 0, primal_scale = 0, dual = 0, primal = 0;
  add_gradient(f);
  for (size_t j = 0; j < n; j++) dual_scale = fmax(dual_scale, fabs(f->sum[j].high));
  for (size_t i = 0; i < f->set.q; i++) {
    const double *values;
    const uint32_t *columns;
    size_t k = f->set.member[i], count = qp_rows_entries(rows, k, &values, &columns);
    double factor = -f->y[i] * rows->scale[k], bound = qp_active_bound(&f->set, i);
    qp_twice product = {0, 0};
    for (size_t e = 0; e < count; e++) {
      size_t j = columns ? columns[e] : e;
      qp_twice_add_product(&f->sum[j], values[e], factor);
      qp_twice_add_product(&product, values[e], f->x[j]);
      dual_scale = fmax(dual_scale, fabs(values[e] * factor));
      primal_scale = fmax(primal_scale, rows->scale[k] * fabs(values[e] * f->x[j]));
    }
    f->primal[i] = bound - rows->scale[k] * (product.high + product.low);
    primal_scale = fmax(primal_scale, fabs(bound));
    primal = fmax(primal, fabs(f->primal[i]));
  }
  for (size_t j = 0; j < n; j++) {
    f->dual[j] = -(f->sum[j].high + f->sum[j].low);
    dual = fmax(dual, fabs(f->dual[j]));
  }
  return fmax(dual > 0 ? dual / dual_scale : 0, primal > 0 ? primal / primal_scale : 0);
}

/* One step from the residuals. squares: |J2'r_d|^2 of the step before, 0 at first. Along a direction without
 * curvature there is nothing to gain on this working set: only members and multipliers are corrected then. */
static void take_step(refinement *f, double *squares) {
  const qp_task *task = f->task;
  size_t n = task->rows->n, q = f->set.q;
  double now = 0, flat = 0, length = 0;
  qp_active_project_vector(&f->set, f->dual, f->d);
  for (size_t j = q; j < n; j++) now += f->d[j] * f->d[j];
  double beta = *squares > 0 ? now / *squares : 0;
  for (size_t j = q; j < n; j++) f->p[j] = f->d[j] + beta * f->p[j];
  memset(f->step, 0, n * sizeof *f->step);
  qp_active_combine(&f->set, q, n, 1, f->p, f->step);
  for (size_t j = q; j < n; j++) length += f->p[j] * f->p[j];
  for (size_t j = 0; j < n && task->rho > 0; j++) {
    double moved = task->objective->metric[j] * f->step[j];
    flat += task->rho * moved * moved;
  }
  double curvature = length - flat;
  double alpha = curvature > 64 * (double)n * DBL_EPSILON * length ? now / curvature : 0;
  for (size_t j = 0; j < n; j++) f->x[j] += alpha * f->step[j];
  qp_active_solve_transposed(&f->set, f->primal, f->w);
  qp_active_combine(&f->set, 0, q, 1, f->w, f->x);
  /* multipliers from the gradient of the factor's objective, less what the proximal term has in it */
  for (size_t i = 0; i < q; i++) f->w[i] -= f->d[i];
  qp_active_solve(&f->set, f->w, f->w);
  for (size_t i = 0; i < q; i++) f->y[i] += f->w[i];
  *squares = now;
}

/* ---- The working set ---- */

/* Which of three classes a constraint is in: equalities, multipliers that count, the rest. -1: not in the set. */
static int class_of(const qp_rows *rows, const qp_point *point, size_t k, double most) {
  if (qp_rows_is_equality(rows, k)) return 0;
  signed char side = point->active[k];
  if (side == QP_FREE || !isfinite(side == QP_UPPER ? rows->upper[k] : rows->lower[k])) return -1;
  return fabs(point->y[k]) > 1e-6 * most ? 1 : 2;
}

static batten_status gather(batten_context *ctx, refinement *f, const qp_point *point) {
  const qp_rows *rows = f->task->rows;
  size_t m = rows->m;
  batten_status st = BATTEN_E_NOMEM;
  double most = 0;
  signed char *side = NULL;
  size_t *member = batten_alloc_array(ctx, m, sizeof *member);
  if (!member) goto done;
  side = batten_alloc_array(ctx, m, sizeof *side);
  if (!side) goto done;
  for (size_t k = 0; k < m; k++) most = fmax(most, fabs(point->y[k]));
  st = BATTEN_OK;
  for (int class = 0; class < 3 && st == BATTEN_OK; class ++) {
    size_t count = 0;
    for (size_t k = 0; k < m; k++) {
      if (class_of(rows, point, k, most) != class) continue;
      side[count] = class == 0 ? QP_EQUAL : point->active[k] == QP_UPPER ? QP_UPPER : QP_LOWER;
      member[count++] = k;
    }
    if (count > 0) st = qp_active_add_many(ctx, &f->set, count, member, side);
  }
done:
  batten_free(ctx, side);
  batten_free(ctx, member);
  return st;
}

/* ---- Whether it solves the whole ---- */

/* Signs: what is wrong by rounding is set to 0. */
static bool signs_hold(refinement *f) {
  double most = 0;
  for (size_t i = 0; i < f->set.q; i++) most = fmax(most, fabs(f->best_y[i]));
  for (size_t i = 0; i < f->set.q; i++) {
    double wrong = f->set.side[i] == QP_EQUAL ? 0 : f->set.side[i] * f->best_y[i];
    if (wrong <= 0) continue;
    if (wrong > 8 * (double)f->set.n * DBL_EPSILON * most) return false;
    f->best_y[i] = 0;
  }
  return true;
}

/* Rows of length 1: what rounding makes of a'x is of the size of x. product: [m]. */
static bool rows_hold(const refinement *f, double *product) {
  const qp_rows *rows = f->task->rows;
  double squares = 0;
  for (size_t j = 0; j < rows->n; j++) squares += f->best_x[j] * f->best_x[j];
  if (rows->m > 0) qp_rows_times(rows, 0, rows->m, f->best_x, product);
  double rounding = 8 * (double)rows->n * DBL_EPSILON, size = sqrt(squares);
  for (size_t k = 0; k < rows->m; k++) {
    double under = rows->lower[k] - product[k], over = product[k] - rows->upper[k];
    if (under > rounding * (size + fabs(rows->lower[k])) || over > rounding * (size + fabs(rows->upper[k])))
      return false;
  }
  return true;
}

/* ---- */

static batten_status allocate(batten_context *ctx, refinement *f) {
  size_t n = f->task->rows->n;
  double **arrays[] = {&f->x, &f->y, &f->best_x, &f->best_y, &f->dual, &f->primal, &f->d, &f->w, &f->p, &f->step};
  enum { ARRAYS = sizeof arrays / sizeof *arrays };
  double *all = batten_alloc_array(ctx, n, ARRAYS * sizeof *all);
  if (!all) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < ARRAYS; i++) *arrays[i] = all + i * n;
  memset(all, 0, ARRAYS * n * sizeof *all);
  f->sum = batten_alloc_array(ctx, n, sizeof *f->sum);
  return f->sum ? BATTEN_OK : BATTEN_E_NOMEM;
}

/* Goes down to the least residuals: *best. Fails where a limit is met or the host cancels. */
static batten_status descend(batten_context *ctx, refinement *f, double *best) {
  const size_t n = f->set.n, most = f->task->rho > 0 ? 40 : 6;
  const double NEARLY_DONE = 0.99;
  double squares = 0;
  *best = INFINITY;
  for (size_t step = 0, worse = 0; step < most && worse < 3; step++) {
    batten_status st = qp_limits_check(ctx, &f->task->limits, 0, NEARLY_DONE);
    if (st < 0) return st;
    double error = residuals(f);
    if (!(error < INFINITY)) break;
    worse = error < 0.5 * *best ? 0 : worse + 1;
    if (error < *best) {
      *best = error;
      memcpy(f->best_x, f->x, n * sizeof *f->x);
      memcpy(f->best_y, f->y, f->set.q * sizeof *f->y);
    }
    if (error <= 0) break;
    take_step(f, &squares);
  }
  return BATTEN_OK;
}

batten_status qp_refine(batten_context *ctx, const qp_task *task, qp_point *point, double *error) {
  const qp_rows *rows = task->rows;
  size_t n = rows->n;
  refinement f = {.task = task};
  qp_dense objective = {n, task->r, task->base};
  double left, *product = NULL;
  *error = INFINITY;
  batten_status st = qp_active_new(ctx, &objective, rows, &f.set);
  if (st == BATTEN_OK) st = allocate(ctx, &f);
  if (st == BATTEN_OK) st = gather(ctx, &f, point);
  if (st < 0) goto done;
  product = batten_alloc_array(ctx, rows->m, sizeof *product);
  if (!product) {
    st = BATTEN_E_NOMEM;
    goto done;
  }
  memcpy(f.x, point->x, n * sizeof *f.x);
  for (size_t i = 0; i < f.set.q; i++) f.y[i] = point->y[f.set.member[i]];
  st = descend(ctx, &f, &left);
  if (st < 0) goto done;
  /* 1e-6: without a residual that small it is no minimiser, and no use */
  if (!(left < 1e-6 && signs_hold(&f) && rows_hold(&f, product))) goto done;
  *error = left;
  memcpy(point->x, f.best_x, n * sizeof *point->x);
  memset(point->y, 0, rows->m * sizeof *point->y);
  memset(point->active, QP_FREE, rows->m * sizeof *point->active);
  for (size_t i = 0; i < f.set.q; i++) {
    point->y[f.set.member[i]] = f.best_y[i];
    point->active[f.set.member[i]] = f.set.side[i];
  }
  point->have_x = true;
done:
  batten_free(ctx, product);
  batten_free(ctx, f.sum);
  batten_free(ctx, f.x);
  qp_active_free(ctx, &f.set);
  return st;
}
