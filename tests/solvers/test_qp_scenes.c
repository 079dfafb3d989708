/* The generators of quadratic programs, judged before any solver is: the known solution and multipliers are optimal,
 * starts are strictly feasible, sizes are those asked for. */
#include "qp_check.h"
#include "tap.h"

static void test_random(void) {
  size_t most_n = 0, most_m = 0, semidefinite = 0, beyond = 0;
  double worst[3] = {0};
  enum { PROBLEMS = 300 };
  for (uint64_t number = 0; number < PROBLEMS; number++) {
    qp_scene_spec spec = qp_scene_spec_random(number, 120, 3000);
    qp_scene *s = qp_scene_random(&spec);
    qp_verdict v = qp_check(&s->problem, s->x, s->y);
    worst[0] = fmax(worst[0], v.primal);
    /* Residuals of the least squares are up to condition^1/2, and b is rounded. */
    double rounded = 0x1p-52 * (spec.lsq ? sqrt(spec.condition) : 1);
    worst[1] = fmax(worst[1], v.dual / v.dual_scale / rounded);
    worst[2] = fmax(worst[2], v.gap / v.gap_scale / rounded);
    if (spec.n > most_n) most_n = spec.n;
    if (spec.m > most_m) most_m = spec.m;
    semidefinite += spec.null > 0;
    beyond += spec.active + spec.equalities + spec.bounded > spec.n;
    qp_scene_free(s);
  }
  T_CHECK(worst[0] == 0, "%d random problems: rows and bounds hold exactly", PROBLEMS);
  T_RATIO(worst[1], 10, "gradient = C'y up to rounding of the data");
  T_RATIO(worst[2], 10, "gap");
  T_CHECK(most_n > 80 && most_m > 2000 && semidefinite > 5 && beyond > 10,
          "n to %zu, m to %zu, %zu semidefinite, %zu with more active than unknowns", most_n, most_m, semidefinite,
          beyond);
}

/* Smallest singular value by inverse iteration would need a solver; the largest by power iteration is 1, and the
 * determinant of a 2 x 2 Hessian is what condition says. */
static void test_condition(void) {
  for (uint64_t seed = 1; seed <= 5; seed++) {
    qp_scene_spec spec = {.seed = seed, .n = 2, .m = 1, .condition = 1e6};
    qp_scene *s = qp_scene_random(&spec);
    const double *h = s->h.dense;
    T_RATIO(fabs((h[0] * h[3] - h[1] * h[2]) * 1e6 - 1), 1e-9, "product of the eigenvalues 1 and 1e-6");
    T_RATIO(fabs(h[0] + h[3] - 1 - 1e-6), 1e-14, "their sum");
    qp_scene_free(s);
  }
}

static void check_start(const char *what, const qp_scene *s) {
  double least = INFINITY, length = 0;
  for (size_t i = 0; i < s->c.rows; i++) least = fmin(least, (double)qp_scene_dot(&s->c, i, s->start));
  for (size_t i = 0; i < s->c.rows; i++) length = fmax(length, s->problem.lower[i]);
  T_CHECK(least > 0 && length == 0, "%s: %zu unknowns, %zu rows, least at the start %.3g", what, s->problem.n,
          s->c.rows, least);
}

static void test_shapes(void) {
  static const size_t rows[4] = {352, 2496, 9856, 27104};
  for (size_t size = 0; size < 4; size++) {
    qp_scene *s = qp_scene_patch(size, false, 1);
    T_CHECK(s->c.rows == rows[size] && s->problem.n == 48, "patch of %zu rows, %zu asked", s->c.rows, rows[size]);
    check_start("patch", s);
    qp_scene *h = qp_scene_patch(size, true, 1);
    double far = 0;
    for (size_t i = 0; i < 48; i++) {
      long double row[48] = {0};
      for (size_t k = 0; k < s->a.rows; k++)
        for (size_t e = s->a.starts[k]; e < s->a.starts[k + 1]; e++)
          if (s->a.indices[e] == i) qp_scene_add(&s->a, k, s->a.values[e], row);
      for (size_t j = 0; j < 48; j++) far = fmax(far, (double)fabsl(row[j] - h->h.dense[i * 48 + j]));
    }
    T_RATIO(far, 1e-13, "its Hessian form against A'A");
    qp_scene_free(s);
    qp_scene_free(h);
  }
  static const size_t controls[] = {18, 250, 5000};
  for (size_t i = 0; i < 3; i++) {
    qp_scene *s = qp_scene_curve(controls[i], 0.05, 1);
    T_CHECK(s->problem.n == 2 * controls[i] && s->c.rows == 6 * (controls[i] - 3), "curve of %zu control points",
            controls[i]);
    check_start("curve", s);
    qp_scene_free(s);
  }
  for (size_t k = 1; k <= 4; k++) {
    qp_scene *s = qp_scene_convex(50, k, 0.1, 1);
    T_CHECK(s->c.rows == 50 - k, "%zu-convex: %zu rows", k, s->c.rows);
    check_start("k-convex", s);
    qp_scene_free(s);
  }
}

/* The judge itself: min 1/2 (x - 3)^2, x <= 1: x = 1, y = -2, and what is off by a little. */
static void test_judge(void) {
  double h = 1, g = -3, upper = 1, one = 1, x = 1, y[2] = {-2, 0};
  batten_matrix hm = batten_matrix_dense(1, 1, &h), cm = batten_matrix_dense(1, 1, &one);
  batten_qp_problem p = batten_qp_problem_default(1);
  p.h = &hm, p.g = &g, p.c = &cm, p.upper = &upper;
  qp_verdict v = qp_check(&p, &x, y);
  T_CHECK(v.primal == 0 && v.dual == 0 && v.gap == 0 && v.objective == -2.5, "by hand: objective %g", v.objective);
  x = 1.25;
  v = qp_check(&p, &x, y);
  T_CHECK(v.primal == 0.25 && v.dual == 0.25, "off by a quarter: primal %g, dual %g", v.primal, v.dual);
  y[0] = 2;
  v = qp_check(&p, &x, y);
  T_CHECK(v.dual >= 2, "a multiplier of the wrong sign: dual %g", v.dual);
  double lower[2] = {2, -INFINITY}, uppers[2] = {INFINITY, 1}, rows[2] = {1, 1}, proof[3] = {1, -1, 0};
  batten_matrix cross = batten_matrix_dense(2, 1, rows);
  p.c = &cross, p.lower = lower, p.upper = uppers;
  T_CHECK(qp_check_infeasible(&p, proof) == 0, "2 <= x <= 1 disproved");
  proof[1] = -0.999;
  T_CHECK(qp_check_infeasible(&p, proof) > 1e-4, "a proof that is none");
  double ray = 1. / 3;
  p.h = NULL, p.c = NULL;
  T_CHECK(qp_check_unbounded(&p, &ray) < 1e-15, "-3 x falls along 1/3");
}

int main(void) {
  test_judge();
  test_condition();
  test_random();
  test_shapes();
  return t_done();
}
