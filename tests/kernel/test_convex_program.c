/* The quadratic program of a round: kernel/convex/program.c, which hands only some of the rows to the solver, against
 * the primal engine on all of them. */
#include "convex/fit_inner.h"
#include "convex_scenes.h"
#include "tap.h"

enum { UNKNOWNS_MAX = 3 * 36 };

/* sum + w T at control. */
static double value_at(const convex_objective *o, const convex_space *space, double w, const double *control) {
  double tension = 0;
  for (size_t i = 0; i < o->n; i++)
    for (size_t j = 0; j < o->n; j++)
      for (size_t k = 0; k < 3; k++) tension += control[3 * i + k] * o->tension[i * o->n + j] * control[3 * j + k];
  return convex_objective_sum(o, space, control) + w * tension;
}

static double worst_row(const convex_rows *rows, const double *x) {
  double worst = -INFINITY;
  const batten_matrix *m = &rows->matrix;
  for (size_t i = 0; i < m->rows; i++) {
    double sum = 0;
    if (m->dense)
      for (size_t j = 0; j < m->columns; j++) sum += m->dense[i * m->columns + j] * x[j];
    else
      for (size_t at = m->starts[i]; at < m->starts[i + 1]; at++) sum += m->values[at] * x[m->indices[at]];
    worst = fmax(worst, rows->lower[i] - sum);
  }
  return worst;
}

/* All rows at once, in the control points themselves. */
static batten_status solve_whole(batten_context *ctx, const convex_objective *o, double w, const convex_rows *rows,
                                 const double *reference, double *x) {
  size_t unknowns = 3 * o->n;
  double *h = convex_allocate(unknowns * unknowns, sizeof *h), *g = convex_allocate(unknowns, sizeof *g);
  for (size_t i = 0; i < unknowns; i++) {
    g[i] = -o->right[i % 3 * o->n + i / 3];
    for (size_t j = 0; j < unknowns; j++)
      h[i * unknowns + j] =
          i % 3 == j % 3 ? o->normal[i / 3 * o->n + j / 3] + w * o->tension[i / 3 * o->n + j / 3] : 0;
  }
  batten_matrix hessian = batten_matrix_dense(unknowns, unknowns, h);
  batten_qp_problem problem = batten_qp_problem_default(unknowns);
  problem.h = &hessian;
  problem.g = g;
  problem.c = &rows->matrix;
  problem.lower = rows->lower;
  batten_qp_options opt = batten_qp_options_default();
  opt.engine = BATTEN_QP_PRIMAL;
  opt.hand_over = 0;
  opt.x0 = reference;
  batten_qp_solution solution = {.x = x};
  batten_status st = batten_qp_solve(ctx, &problem, &opt, NULL, &solution, NULL);
  free(g);
  free(h);
  return st;
}

static void check(batten_context *ctx, uint64_t seed, unsigned degree, size_t spans) {
  double knots[2][24], reference[UNKNOWNS_MAX], unbound[UNKNOWNS_MAX], x[UNKNOWNS_MAX], y[UNKNOWNS_MAX];
  convex_space space;
  for (int k = 0; k < 2; k++) {
    size_t n = bspline_make_knots(degree, degree - 1, spans, NULL, 0, 1, knots[k]);
    space.axis[k] = (bspline){degree, n - degree - 1, knots[k]};
  }
  const convex_row_options options = {
      .directions = 4, .depth_max = 6, .row_share = 0.15, .margin = 1e-3, .row_limit = 500000};
  const double w = 51e-6;
  convex_scene s = convex_scene_paper(seed);
  convex_objective o;
  convex_program p;
  convex_rows rows;
  bool accepted = false, solved = false;
  size_t active;
  T_OK(convex_objective_new(ctx, &space, s.count, s.points, NULL, &o), ctx);
  T_OK(convex_program_new(ctx, &space, &p), ctx);
  convex_objective_set(&o, &space, s.parameters);
  convex_reference r = {.control = reference};
  T_OK(convex_reference_find(ctx, &o, &space, s.parameters, &options, w, &r), ctx);
  T_OK(convex_objective_solve(ctx, &o, &space, w, unbound), ctx);
  T_OK(convex_rows_make(ctx, &space, reference, &options, &accepted, &rows), ctx);
  T_OK(convex_program_solve(ctx, &p, &o, &space, w, &rows, unbound, reference, x, &active, &solved), ctx);
  T_OK(solve_whole(ctx, &o, w, &rows, reference, y), ctx);
  double least = value_at(&o, &space, w, unbound), mine = value_at(&o, &space, w, x);
  double other = value_at(&o, &space, w, y);
  T_RATIO(worst_row(&rows, x), 1e-15, "seed %d, degree %u, %zu x %zu spans, %zu rows: all hold", (int)seed, degree,
          spans, spans, rows.matrix.rows);
  T_RATIO(fabs(mine - other) / other, 1e-7, "against the primal engine on all rows: %.6g of %.6g", mine, other);
  T_CHECK(solved && active > 0 && least < mine && mine < value_at(&o, &space, w, reference),
          "%zu rows active; between the minimum without rows, %.4g, and the reference", active, least);
  /* nothing to solve where the minimum lies inside */
  T_OK(convex_program_solve(ctx, &p, &o, &space, w, &rows, reference, reference, x, &active, &solved), ctx);
  T_CHECK(active == 0 && memcmp(x, reference, 3 * o.n * sizeof *x) == 0, "a minimum inside stays");
  /* what has no solution, as rounding may have it, is said and leaves the place alone */
  double both[2 * UNKNOWNS_MAX] = {0}, lower[2] = {1, 1};
  both[0] = 1;
  both[3 * o.n] = -1;
  const convex_rows none = {.matrix = batten_matrix_dense(2, 3 * o.n, both), .lower = lower};
  memcpy(y, x, 3 * o.n * sizeof *x);
  T_OK(convex_program_solve(ctx, &p, &o, &space, w, &none, unbound, reference, x, &active, &solved), ctx);
  T_CHECK(!solved && memcmp(x, y, 3 * o.n * sizeof *x) == 0, "no solution: said, nothing written");
  convex_rows_free(ctx, &rows);
  convex_program_free(ctx, &p);
  convex_objective_free(ctx, &o);
  convex_scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  check(ctx, 0, 3, 1);
  check(ctx, 3, 3, 1);
  check(ctx, 1, 4, 1);
  check(ctx, 2, 3, 2);
  batten_context_free(ctx);
  return t_done();
}
