/* Digits below rounding: by hand, where one double has no gap and its neighbours have; on a sequence of large numbers
 * with disturbed multipliers; and nothing is touched where nothing is missing. */
#include <float.h>

#include "qp/certify.h"
#include "qp/driver.h"
#include "qp_scenes.h"
#include "tap.h"

static batten_qp_options within(double tolerance) {
  batten_qp_options o = batten_qp_options_default();
  o.tolerance_absolute = tolerance, o.tolerance_relative = 0;
  return o;
}

/* min g'x with x_1 + x_2 = 2^20, x >= 0 and g = (1, 3): x = (2^20, 0), y = 1, bound 2. The multiplier given is off by
 * 2^-32, which is a gap of 2^-12 and no more than 2^-32 in the gradient: y has to be put right. */
static void test_by_hand(void) {
  const double big = 0x1p20, off = 0x1p-32;
  const double g[2] = {1, 3}, row[2] = {1, 1}, zero[2] = {0, 0};
  batten_matrix c = batten_matrix_dense(1, 2, row);
  batten_qp_problem p = batten_qp_problem_default(2);
  p.g = g, p.c = &c, p.lower = p.upper = &big, p.x_lower = zero;
  double x[2] = {big, 0}, y[3] = {1 + off, 0, 2 - off}, work[6];
  batten_qp_options o = within(1e-9);
  batten_qp_info info = {0};
  qp_certify_residuals(&p, x, y, work, &info);
  T_CHECK(info.duality_gap == big * off, "gap before: %g", info.duality_gap);
  qp_last_digits(&p, &o, x, y, work, &info);
  T_CHECK(y[0] == 1 && info.duality_gap == 0 && info.dual_residual == off, "y = %a, gap %g, dual residual %g", y[0],
          info.duality_gap, info.dual_residual);
  T_CHECK(x[0] == big && x[1] == 0 && y[2] == 2 - off, "the rest stays");
}

/* A convex sequence of size 1e6 whose multipliers are off by some spacings. */
static void test_sequence(batten_context *ctx, double tolerance) {
  enum { N = 600 };
  qp_scene *s = qp_scene_convex(N, 2, 0.1, 3);
  size_t m = s->c.rows;
  double *g = malloc(N * sizeof *g), *x = malloc(4 * N * sizeof *x), *y = malloc((m + N) * sizeof *y);
  double *work = x + N;
  if (!g || !x || !y) exit(1);
  for (size_t j = 0; j < N; j++) g[j] = 1e6 * s->problem.g[j];
  s->problem.g = g;
  batten_qp_options o = batten_qp_options_default();
  batten_qp_solution to = {.x = x, .multipliers = y};
  batten_qp_info before = {0}, after, again;
  T_OK(batten_qp_solve(ctx, &s->problem, &o, NULL, &to, NULL), ctx);
  uint64_t seed = 5;
  for (size_t i = 0; i < m; i++)
    if (y[i] > 0) y[i] *= 1 + 3 * DBL_EPSILON * (2 * t_uniform(&seed) - 1);
  qp_certify_residuals(&s->problem, x, y, work, &before);
  after = before;
  o = within(tolerance);
  qp_last_digits(&s->problem, &o, x, y, work, &after);
  qp_certify_residuals(&s->problem, x, y, work, &again);
  printf("# dual %.2e -> %.2e, gap %.2e -> %.2e\n", before.dual_residual, after.dual_residual, before.duality_gap,
         after.duality_gap);
  if (before.dual_residual > tolerance)
    T_RATIO(after.dual_residual, before.dual_residual / 2, "dual residual, of what it was");
  T_CHECK(after.dual_residual == again.dual_residual && after.duality_gap == again.duality_gap &&
              after.primal_residual == again.primal_residual,
          "the figures are those of x and y");
  bool signs = true;
  for (size_t i = 0; i < m; i++) signs = signs && y[i] >= 0;
  T_CHECK(signs, "multipliers keep their signs");
  free(y);
  free(x);
  free(g);
  qp_scene_free(s);
}

static void test_untouched(void) {
  const double h[1] = {2}, g[1] = {-4}, low[1] = {3};
  batten_matrix hessian = batten_matrix_dense(1, 1, h);
  batten_qp_problem p = batten_qp_problem_default(1);
  p.h = &hessian, p.g = g, p.x_lower = low;
  double x[1] = {3}, y[1] = {2}, work[3];
  batten_qp_options o = within(1e-15);
  batten_qp_info info = {0};
  qp_last_digits(&p, &o, x, y, work, &info);
  T_CHECK(x[0] == 3 && y[0] == 2 && info.duality_gap == 0 && info.dual_residual == 0, "a solution stays as it is");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand();
  test_sequence(ctx, 1e-9);
  test_sequence(ctx, 1e-12);
  test_untouched();
  batten_context_free(ctx);
  return t_done();
}
