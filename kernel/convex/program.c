/* The quadratic program of a round.   [Juettler 1998, section 5]
 *
 * In the unknown d = control - free, from the minimum without inequalities: minimise d'H d / 2 subject to
 * C d >= lower - C free. So that minimum keeps all its digits, and where it satisfies the rows there is nothing to
 * solve. H = (N + w T) (x) I_3, scaled to a diagonal of about one. */
#include "fit_inner.h"

#include "base/checked.h"

#include <string.h>

batten_status convex_program_new(batten_context *ctx, const convex_space *space, convex_program *out) {
  size_t n = convex_points(space), unknowns = 3 * n, size;
  convex_program p = {NULL};
  bool dense = bspline_span_count(&space->axis[0]) * bspline_span_count(&space->axis[1]) == 1;
  p.point = batten_alloc_array(ctx, 2 * unknowns, sizeof *p.point);
  bool all = p.point;
  if (dense) {
    batten_mul(unknowns, unknowns, &size);
    p.hessian = batten_alloc_array(ctx, size, sizeof *p.hessian);
    all = all && p.hessian;
  } else {
    size = 3; /* each control point meets those of degree steps either way */
    for (int k = 0; k < 2; k++) {
      size_t band = (2 * (size_t)space->axis[k].degree + 1) * space->axis[k].count;
      batten_mul(size, band, &size);
    }
    p.starts = batten_alloc_array(ctx, unknowns + 1, sizeof *p.starts);
    p.indices = batten_alloc_array(ctx, size, sizeof *p.indices);
    p.values = batten_alloc_array(ctx, size, sizeof *p.values);
    all = all && p.starts && p.indices && p.values;
  }
  batten_status st = all ? batten_qp_workspace_new(ctx, &p.workspace) : BATTEN_E_NOMEM;
  if (st < 0)
    convex_program_free(ctx, &p);
  else
    *out = p;
  return st;
}

void convex_program_free(batten_context *ctx, convex_program *p) {
  batten_qp_workspace_free(p->workspace);
  batten_free(ctx, p->values);
  batten_free(ctx, p->indices);
  batten_free(ctx, p->starts);
  batten_free(ctx, p->hessian);
  batten_free(ctx, p->point);
  *p = (convex_program){NULL};
}

static batten_matrix dense_hessian(convex_program *p, const convex_objective *o, double w, double scale) {
  size_t n = o->n, unknowns = 3 * n;
  memset(p->hessian, 0, unknowns * unknowns * sizeof *p->hessian);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k < 3; k++)
        p->hessian[(3 * i + k) * unknowns + 3 * j + k] = scale * (o->normal[i * n + j] + w * o->tension[i * n + j]);
  return batten_matrix_dense(unknowns, unknowns, p->hessian);
}

static batten_matrix sparse_hessian(convex_program *p, const convex_objective *o, const convex_space *space, double w,
                                    double scale) {
  size_t n = o->n, nv = space->axis[1].count, at = 0;
  for (size_t row = 0; row < 3 * n; row++) {
    size_t i = row / 3, k = row % 3;
    p->starts[row] = at;
    for (size_t j = 0; j < n; j++) {
      size_t du = i / nv > j / nv ? i / nv - j / nv : j / nv - i / nv;
      size_t dv = i % nv > j % nv ? i % nv - j % nv : j % nv - i % nv;
      if (du > space->axis[0].degree || dv > space->axis[1].degree) continue;
      p->indices[at] = (uint32_t)(3 * j + k);
      p->values[at++] = scale * (o->normal[i * n + j] + w * o->tension[i * n + j]);
    }
  }
  p->starts[3 * n] = at;
  return batten_matrix_sparse(3 * n, 3 * n, p->starts, p->indices, p->values);
}

static double row_times(const batten_matrix *m, size_t row, const double *x) {
  double sum = 0;
  if (m->dense)
    for (size_t j = 0; j < m->columns; j++) sum += m->dense[row * m->columns + j] * x[j];
  else
    for (size_t at = m->starts[row]; at < m->starts[row + 1]; at++) sum += m->values[at] * x[m->indices[at]];
  return sum;
}

batten_status convex_program_solve(batten_context *ctx, convex_program *p, const convex_objective *o,
                                   const convex_space *space, double w, const convex_rows *rows, const double *free,
                                   const double *reference, double *control, size_t *active, bool *solved) {
  size_t unknowns = 3 * o->n, m = rows->matrix.rows;
  double *lower = batten_alloc_array(ctx, m, sizeof *lower), *start = p->point, *x = p->point + unknowns;
  if (!lower) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_OK;
  bool inside = true;
  double largest = 0;
  for (size_t i = 0; i < m; i++) {
    lower[i] = rows->lower[i] - row_times(&rows->matrix, i, free);
    inside = inside && lower[i] <= 0;
  }
  *active = 0;
  *solved = true;
  if (inside) {
    memcpy(control, free, unknowns * sizeof *control);
    goto done;
  }
  for (size_t i = 0; i < o->n; i++)
    largest = fmax(largest, o->normal[i * (o->n + 1)] + w * o->tension[i * (o->n + 1)]);
  double scale = batten_unit(largest);
  batten_matrix h = p->hessian ? dense_hessian(p, o, w, scale) : sparse_hessian(p, o, space, w, scale);
  for (size_t i = 0; i < unknowns; i++) start[i] = reference[i] - free[i];
  batten_qp_problem problem = batten_qp_problem_default(unknowns);
  problem.h = &h;
  problem.c = &rows->matrix;
  problem.lower = lower;
  batten_qp_options opt = batten_qp_options_default();
  opt.x0 = opt.interior = start;
  opt.exact = 1;
  batten_qp_solution solution = {.x = x};
  batten_qp_info info;
  st = batten_qp_solve(ctx, &problem, &opt, p->workspace, &solution, &info);
  if (st == BATTEN_W_STOPPED) /* no limit was set: the host asked for it */
    st = batten_fail(ctx, BATTEN_E_CANCELLED, "cancelled by the host during quadratic program");
  if (st == BATTEN_OK || st == BATTEN_W_ACCURACY) {
    for (size_t i = 0; i < unknowns; i++) control[i] = free[i] + x[i];
    *active = info.rows_active;
    st = BATTEN_OK;
  } else if (st != BATTEN_E_NOMEM && st != BATTEN_E_CANCELLED && st != BATTEN_E_TOO_LARGE) {
    *solved = false;
    st = BATTEN_OK;
  }
done:
  batten_free(ctx, lower);
  return st;
}
