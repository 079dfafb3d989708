/* What is known to break solvers of quadratic programs, each for every engine: duplicates, zero and scaled rows, a
 * cone collapsed to its apex, rows dependent through equalities, degenerate vertices, cycling examples, infeasible
 * and unbounded problems and their proofs, indefinite by a hair, semidefinite, linear; and what must not change the
 * solution. */
#include "qp_check.h"
#include "tap.h"

enum { MOST = 512 };

static uint64_t seed_of_test = 1;
static double uniform(void) { return 2 * scene_uniform(&seed_of_test) - 1; }

/* One solve; arrays as the caller of batten gives them, poisoned before. */
typedef struct outcome {
  batten_status status;
  batten_qp_info info;
  double *x, *y, *proof, *ray; /* into memory */
  double memory[4 * MOST * 4];
} outcome;

static outcome *solve(batten_context *ctx, batten_qp_engine engine, const batten_qp_problem *p) {
  static outcome o;
  for (size_t i = 0; i < sizeof o.memory / sizeof *o.memory; i++) o.memory[i] = NAN;
  o.x = o.memory, o.y = o.x + MOST, o.proof = o.y + 3 * MOST, o.ray = o.proof + 3 * MOST;
  batten_qp_options opt = batten_qp_options_default();
  opt.engine = engine;
  batten_qp_solution s = {.x = o.x, .multipliers = o.y, .certificate = o.proof, .ray = o.ray};
  o.status = batten_qp_solve(ctx, p, &opt, NULL, &s, &o.info);
  return &o;
}

/* What a trap asks of every engine, over many seeds; one line each, naming the first seed that fails. */
typedef struct tally {
  const char *what;
  size_t runs[4], failed[4], first[4];
  double worst[4];
  char text[4][200];
} tally;

static void count(tally *t, int engine, size_t seed, bool ok, double measure, const char *text) {
  t->runs[engine]++;
  t->worst[engine] = fmax(t->worst[engine], isnan(measure) ? INFINITY : measure);
  if (ok) return;
  if (!t->failed[engine]++) {
    t->first[engine] = seed;
    snprintf(t->text[engine], sizeof t->text[engine], "%s", text);
  }
}
static void report(const tally *t) {
  for (int e = 0; e < 4; e++)
    T_CHECK(!t->failed[e] && t->runs[e], "%s, %s: %zu of %zu, worst %.2g%s%zu %s", t->what, qp_engine_names[e],
            t->runs[e] - t->failed[e], t->runs[e], t->worst[e], t->failed[e] ? ", first failing " : "; ",
            t->failed[e] ? t->first[e] : t->runs[e], t->failed[e] ? t->text[e] : "runs");
}

/* Solved: status, residuals by the judge at 1e-9, info says the same; x (or the objective) as expected to `near`. */
static void expect_solved(batten_context *ctx, tally *t, size_t seed, const batten_qp_problem *p, const double *x,
                          double objective, double near) {
  for (int e = 0; e < 4; e++) {
    outcome *o = solve(ctx, qp_engines[e], p);
    char text[200];
    if (o->status != BATTEN_OK) {
      snprintf(text, sizeof text, "%s: %s", batten_status_name(o->status), batten_error(ctx));
      count(t, e, seed, false, INFINITY, text);
      continue;
    }
    qp_verdict v = qp_check(p, o->x, o->y);
    double off = 0, size = 1;
    for (size_t j = 0; x && j < p->n; j++) off = fmax(off, fabs(o->x[j] - x[j])), size = fmax(size, fabs(x[j]));
    if (!isnan(objective)) off = fmax(off, fabs(v.objective - objective)), size = fmax(size, fabs(objective));
    bool within = qp_check_within(&v, 1e-9, 1),
         honest = fabs(o->info.primal_residual - v.primal) <= 0x1p-51 * fmax(v.primal_scale, 1) + 1e-6 * v.primal;
    snprintf(text, sizeof text, "primal %.2g (said %.2g), dual %.2g of %.2g, gap %.2g of %.2g, x off by %.2g",
             v.primal, o->info.primal_residual, v.dual, v.dual_scale, v.gap, v.gap_scale, off);
    count(t, e, seed, within && honest && off <= near * size, off / size, text);
  }
}

static void expect_infeasible(batten_context *ctx, tally *t, size_t seed, const batten_qp_problem *p) {
  for (int e = 0; e < 4; e++) {
    outcome *o = solve(ctx, qp_engines[e], p);
    char text[200];
    double miss = o->status == BATTEN_E_INFEASIBLE ? qp_check_infeasible(p, o->proof) : INFINITY;
    snprintf(text, sizeof text, "%s, proof off by %.2g: %s", batten_status_name(o->status), miss, batten_error(ctx));
    count(t, e, seed, miss <= 1e-12, miss, text);
  }
}

static void expect_unbounded(batten_context *ctx, tally *t, size_t seed, const batten_qp_problem *p) {
  for (int e = 0; e < 4; e++) {
    outcome *o = solve(ctx, qp_engines[e], p);
    char text[200];
    double miss = o->status == BATTEN_E_UNBOUNDED ? qp_check_unbounded(p, o->ray) : INFINITY;
    snprintf(text, sizeof text, "%s, ray off by %.2g: %s", batten_status_name(o->status), miss, batten_error(ctx));
    count(t, e, seed, miss <= 1e-9, miss, text);
  }
}

/* ---- rows that repeat, vanish, or are scaled ----------------------------------------------------------------- */

/* Rows of a dense scene in another order and scale, times over: row i of the result is factor[i] times row from[i].
 */
static void rearrange(qp_scene *s, size_t m, const size_t *from, const double *factor) {
  size_t n = s->problem.n;
  double *rows = qp_scene_array(s, m * n, sizeof *rows), *lower = qp_scene_array(s, m, sizeof *lower);
  double *upper = qp_scene_array(s, m, sizeof *upper);
  for (size_t i = 0; i < m; i++) {
    for (size_t j = 0; j < n; j++) rows[i * n + j] = factor[i] * s->c.dense[from[i] * n + j];
    double a = factor[i] * s->problem.lower[from[i]], b = factor[i] * s->problem.upper[from[i]];
    lower[i] = fmin(a, b);
    upper[i] = fmax(a, b);
  }
  s->c = batten_matrix_dense(m, n, rows);
  s->problem.lower = lower;
  s->problem.upper = upper;
}

static qp_scene_spec small_spec(uint64_t seed) {
  return (qp_scene_spec){.seed = seed,
                         .n = 8,
                         .m = 24,
                         .condition = 100,
                         .active = 5,
                         .two_sided = seed % 2 == 1,
                         .lsq = seed % 3 == 0,
                         .equalities = seed % 4 == 0 ? 2 : 0};
}

static void test_rows(batten_context *ctx) {
  tally same = {.what = "every row five times"}, scaled = {.what = "rows scaled by 1e-8 .. 1e8"};
  tally turned = {.what = "duplicates turned round and scaled"}, order = {.what = "rows in another order"};
  tally zero = {.what = "zero rows that hold"}, near = {.what = "rows repeated but for 1e-14 of noise"};
  for (uint64_t seed = 0; seed < 12; seed++) {
    qp_scene_spec spec = small_spec(seed);
    size_t from[5 * 24];
    double factor[5 * 24];
    seed_of_test = seed;
    for (int kind = 0; kind < 6; kind++) {
      qp_scene *s = qp_scene_random(&spec);
      size_t m = kind == 1 || kind == 3 ? 24 : kind == 4 ? 30 : 120;
      for (size_t i = 0; i < m; i++) {
        from[i] = kind == 3 ? (i * 7 + 5) % 24 : i % 24;
        factor[i] = kind == 1 || kind == 2 ? pow(10, 8 * uniform()) : 1;
        if (kind == 2 && i % 2) factor[i] = -factor[i];
        if (kind == 4 && i >= 24) factor[i] = 0;
      }
      double *sides[2] = {NULL, NULL};
      if (kind == 4) { /* 0 * infinity is no side: give them ones */
        sides[0] = qp_scene_array(s, 24, sizeof(double)), sides[1] = qp_scene_array(s, 24, sizeof(double));
        memcpy(sides[0], s->problem.lower, 24 * sizeof(double)),
            memcpy(sides[1], s->problem.upper, 24 * sizeof(double));
        for (size_t i = 0; i < 24; i++) {
          if (isinf(sides[0][i])) sides[0][i] = -1000;
          if (isinf(sides[1][i])) sides[1][i] = 1000;
        }
        s->problem.lower = sides[0], s->problem.upper = sides[1];
      }
      rearrange(s, m, from, factor);
      if (kind == 5) {
        double *rows = (double *)(uintptr_t)s->c.dense;
        for (size_t i = 24 * 8; i < m * 8; i++) rows[i] *= 1 + 1e-14 * uniform();
      }
      tally *t[6] = {&same, &scaled, &turned, &order, &zero, &near};
      expect_solved(ctx, t[kind], seed, &s->problem, s->x, NAN, kind == 5 ? 1e-9 : 1e-11);
      qp_scene_free(s);
    }
  }
  report(&same), report(&scaled), report(&turned), report(&order), report(&zero), report(&near);
}

/* 40 half-spaces through 0 in R^5 leave 0 alone; any objective. */
static void test_cone(batten_context *ctx) {
  enum { N = 5, M = 40 };
  tally t = {.what = "cone collapsed to its apex"}, sparse = {.what = "the same with x0 = 0 far from the target"};
  for (size_t seed = 0; seed < 40; seed++) {
    double rows[M * N], lower[M] = {0}, g[N], h[N * N] = {0}, x[N] = {0};
    seed_of_test = seed;
    for (size_t i = 0; i < M * N; i++) rows[i] = uniform();
    for (size_t j = 0; j < N; j++) g[j] = uniform() * (seed % 2 ? 1 : 1e4), h[j * N + j] = 1;
    batten_matrix c = batten_matrix_dense(M, N, rows), hm = batten_matrix_dense(N, N, h);
    batten_qp_problem p = batten_qp_problem_default(N);
    p.c = &c, p.lower = lower, p.h = &hm, p.g = g;
    expect_solved(ctx, seed % 2 ? &t : &sparse, seed, &p, x, NAN, 1e-11);
  }
  report(&t), report(&sparse);
}

/* Rows that are combinations of equalities, with sides that hold with equality up to rounding: the drop-zero example
 * of plane curves with inflections, and random ones. */
static void test_dependent_on_equalities(batten_context *ctx) {
  enum { N = 10, Q = 3, EXTRA = 12 };
  tally t = {.what = "rows dependent through equalities"},
        curve = {.what = "second differences that vanish at an inflection"};
  for (size_t seed = 0; seed < 20; seed++) {
    qp_scene_spec spec = {.seed = seed, .n = N, .m = 24, .condition = 1000, .equalities = Q, .active = 4};
    qp_scene *s = qp_scene_random(&spec);
    seed_of_test = seed;
    size_t m = 24 + EXTRA;
    double *rows = qp_scene_array(s, m * N, sizeof *rows), *lower = qp_scene_array(s, m, sizeof *lower);
    double *upper = qp_scene_array(s, m, sizeof *upper);
    memcpy(rows, s->c.dense, 24 * N * sizeof *rows);
    memcpy(lower, s->problem.lower, 24 * sizeof *lower);
    memcpy(upper, s->problem.upper, 24 * sizeof *upper);
    for (size_t i = 24; i < m; i++) {
      double sum = 0;
      for (size_t q = 0; q < Q; q++) {
        double f = uniform();
        for (size_t j = 0; j < N; j++) rows[i * N + j] += f * rows[q * N + j];
        sum += f * lower[q];
      }
      lower[i] = sum, upper[i] = INFINITY;
      if (i % 3 == 0) lower[i] = -INFINITY, upper[i] = sum;
      if (i % 3 == 1) lower[i] = upper[i] = sum;
    }
    s->c = batten_matrix_dense(m, N, rows);
    s->problem.lower = lower, s->problem.upper = upper;
    expect_solved(ctx, &t, seed, &s->problem, s->x, NAN, 1e-10);
    qp_scene_free(s);
  }
  for (size_t seed = 0; seed < 12; seed++) {
    /* Points d_0 .. d_6 in the plane, d_2 - 2 d_3 + d_4 = 0, and [w, d_2 - 2 d_3 + d_4] >= 0 for four w, twice;
     * convex to the left of the inflection, concave to its right, along a reference that is so. */
    enum { P = 7, ROWS = 2 + 8 + 4 };
    double rows[ROWS * 2 * P] = {0}, lower[ROWS] = {0}, upper[ROWS], h[4 * P * P] = {0}, g[2 * P];
    seed_of_test = seed;
    for (size_t i = 0; i < ROWS; i++) {
      static const size_t centre[4] = {1, 2, 4, 5};
      size_t at = i < 10 ? 3 : centre[i - 10];
      double angle = SCENE_PI * uniform(), w[2] = {cos(angle), sin(angle)};
      if (i < 2) w[0] = i == 0, w[1] = i == 1;
      if (i >= 10) w[0] = 0, w[1] = i < 12 ? 1 : -1;
      upper[i] = i < 2 ? 0 : INFINITY;
      for (size_t k = 0; k < 3; k++)
        for (size_t d = 0; d < 2; d++) rows[i * 2 * P + 2 * (at + k - 1) + d] = w[d] * (k == 1 ? -2 : 1);
    }
    for (size_t j = 0; j < 2 * P; j++) h[j * 2 * P + j] = 1, g[j] = -(double)(j / 2) * (j % 2 == 0) - 0.5 * uniform();
    batten_matrix c = batten_matrix_dense(ROWS, 2 * P, rows), hm = batten_matrix_dense(2 * P, 2 * P, h);
    batten_qp_problem p = batten_qp_problem_default(2 * P), without = p;
    p.c = &c, p.lower = lower, p.upper = upper, p.h = &hm, p.g = g;
    double x[2 * P];
    without = p;
    batten_matrix few = c;
    double few_rows[6 * 2 * P], few_upper[6];
    memcpy(few_rows, rows, 2 * 2 * P * sizeof *rows);
    memcpy(few_rows + 4 * P, rows + 10 * 2 * P, 4 * 2 * P * sizeof *rows);
    memcpy(few_upper, upper, 2 * sizeof *upper);
    memcpy(few_upper + 2, upper + 10, 4 * sizeof *upper);
    few = batten_matrix_dense(6, 2 * P, few_rows);
    without.c = &few, without.upper = few_upper;
    outcome *o = solve(ctx, BATTEN_QP_DUAL, &without);
    memcpy(x, o->x, sizeof x);
    expect_solved(ctx, &curve, seed, &p, x, NAN, 1e-11);
  }
  report(&t), report(&curve);
}

/* ---- degenerate ---------------------------------------------------------------------------------------------- */

static void test_degenerate(batten_context *ctx) {
  tally vertex = {.what = "120 rows through a vertex of 6 unknowns"}, weak = {.what = "the same, most multipliers 0"};
  tally near = {.what = "pencil of rows 1e-7 apart"};
  for (size_t seed = 0; seed < 20; seed++) {
    qp_scene_spec spec = {.seed = seed, .n = 6, .m = 150, .condition = 10, .active = 120, .weak = seed % 2 == 1};
    qp_scene *s = qp_scene_random(&spec);
    expect_solved(ctx, seed % 2 ? &weak : &vertex, seed, &s->problem, s->x, NAN, 1e-11);
    qp_scene_free(s);
  }
  /* x_1 + k 1e-7 x_2 >= 0 for |k| <= 30, towards (-1, -1/2): the outermost row and a face of the wedge or its apex
   * hold. */
  for (size_t seed = 0; seed < 4; seed++) {
    enum { M = 61 };
    double rows[M * 2], lower[M] = {0}, h[4] = {1, 0, 0, 1}, g[2] = {1, seed < 2 ? 0.5 : -0.5};
    for (int i = 0; i < M; i++) {
      rows[2 * i] = 1;
      rows[2 * i + 1] = 1e-7 * (i - 30);
      if (seed % 2) rows[2 * i] *= i + 1, rows[2 * i + 1] *= i + 1;
    }
    batten_matrix c = batten_matrix_dense(M, 2, rows), hm = batten_matrix_dense(2, 2, h);
    batten_qp_problem p = batten_qp_problem_default(2);
    p.c = &c, p.lower = lower, p.h = &hm, p.g = g;
    /* On the edge x_1 = s x_2, s = 3e-6 (x_2 > 0) or -s: the minimum along it. */
    double s = 3e-6, sign = seed < 2 ? -1 : 1, t = (-g[0] * s - sign * g[1]) / (s * s + 1);
    double x[2] = {t * s, sign * t};
    expect_solved(ctx, &near, seed, &p, x, NAN, 1e-11);
  }
  report(&vertex), report(&weak), report(&near);
}

/* Linear programs on which the simplex method cycles, and each with a little of 1/2 |x|^2. */
static void test_cycling(batten_context *ctx) {
  static const double beale[] = {.25, -60, -.04, 9, .5, -90, -.02, 3, 0, 0, 1, 0},
                      beale_cost[] = {-.75, 150, -.02, 6};
  static const double kuhn[] = {-2, -9, 1, 9, 1. / 3, 1, -1. / 3, -2, 2, 3, -1, -12}, kuhn_cost[] = {-2, -3, 1, 12};
  static const double marshall[] = {.5, -5.5, -2.5, 9, .5, -1.5, -.5, 1, 1, 0, 0, 0},
                      marshall_cost[] = {-10, 57, 9, 24};
  static const double upper[3][3] = {{0, 0, 1}, {0, 0, 2}, {0, 0, 1}};
  static const struct {
    const double *rows, *cost;
    double optimum;
  } cases[3] = {{beale, beale_cost, -.05}, {kuhn, kuhn_cost, -2}, {marshall, marshall_cost, -1}};
  tally linear = {.what = "cycling linear programs (Beale, Kuhn, Marshall and Suurballe)"};
  tally quadratic = {.what = "the same with 1e-3 |x|^2"};
  for (size_t k = 0; k < 3; k++) {
    double zero[4] = {0}, h[16] = {0};
    batten_matrix c = batten_matrix_dense(3, 4, cases[k].rows), hm = batten_matrix_dense(4, 4, h);
    batten_qp_problem p = batten_qp_problem_default(4);
    p.c = &c, p.upper = upper[k], p.x_lower = zero, p.g = cases[k].cost;
    expect_solved(ctx, &linear, k, &p, NULL, cases[k].optimum, 1e-9);
    for (int j = 0; j < 4; j++) h[5 * j] = 2e-3;
    p.h = &hm;
    expect_solved(ctx, &quadratic, k, &p, NULL, NAN, 0);
  }
  report(&linear), report(&quadratic);
}

/* ---- no solution --------------------------------------------------------------------------------------------- */

/* m rows of which the first n + 1 have sum_i y_i a_i = 0, y > 0, and sum y_i lower_i = gap (sum y = 1): no x when gap
 * > 0. */
static qp_scene *farkas(uint64_t seed, size_t n, size_t m, double gap) {
  qp_scene *s = qp_scene_new(n);
  double *rows = qp_scene_array(s, m * n, sizeof *rows), *lower = qp_scene_array(s, m, sizeof *lower);
  double *h = qp_scene_array(s, n * n, sizeof *h), *g = qp_scene_array(s, n, sizeof *g);
  double *x = qp_scene_array(s, n, sizeof *x), y = 1 / (double)(n + 1);
  seed_of_test = seed;
  for (size_t j = 0; j < n; j++) x[j] = uniform(), g[j] = uniform(), h[j * n + j] = 1 + scene_uniform(&seed_of_test);
  for (size_t i = 0; i < m; i++) {
    for (size_t j = 0; j < n; j++)
      if (i != n) rows[i * n + j] = uniform();
    if (i == n)
      for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < n; j++) rows[n * n + j] -= rows[k * n + j];
    for (size_t j = 0; j < n; j++) lower[i] += rows[i * n + j] * x[j];
    lower[i] += i <= n ? gap / y / (double)(n + 1) : -1;
  }
  s->c = batten_matrix_dense(m, n, rows);
  s->h = batten_matrix_dense(n, n, h);
  s->problem.c = &s->c, s->problem.lower = lower, s->problem.h = &s->h, s->problem.g = g;
  return s;
}

static void test_infeasible(batten_context *ctx) {
  tally plain = {.what = "infeasible"}, hair = {.what = "infeasible by 1e-6"}, other = {.what = "feasible by 1e-6"};
  tally equal = {.what = "equalities that contradict each other"}, bound = {.what = "rows against bounds"};
  tally zero = {.what = "zero row that cannot hold"}, parallel = {.what = "parallel rows that cross by 1e-6"};
  for (size_t seed = 0; seed < 20; seed++) {
    size_t n = 2 + seed % 9;
    qp_scene *s = farkas(seed, n, 3 * n + 4, 0.5);
    expect_infeasible(ctx, &plain, seed, &s->problem);
    qp_scene_free(s);
    s = farkas(seed, n, 3 * n + 4, 1e-6);
    expect_infeasible(ctx, &hair, seed, &s->problem);
    qp_scene_free(s);
    s = farkas(seed, n, 3 * n + 4, -1e-6);
    expect_solved(ctx, &other, seed, &s->problem, NULL, NAN, 0);
    qp_scene_free(s);
    qp_scene_spec spec = {.seed = seed, .n = 8, .m = 10, .condition = 10, .equalities = 4, .active = 2};
    s = qp_scene_random(&spec);
    double *lower = qp_scene_array(s, 10, sizeof *lower), *upper = qp_scene_array(s, 10, sizeof *upper);
    double *rows = qp_scene_array(s, 80, sizeof *rows);
    memcpy(rows, s->c.dense, 80 * sizeof *rows);
    memcpy(lower, s->problem.lower, 10 * sizeof *lower);
    memcpy(upper, s->problem.upper, 10 * sizeof *upper);
    for (size_t j = 0; j < 8; j++) rows[24 + j] = rows[j] + rows[8 + j] - rows[16 + j];
    lower[3] = upper[3] = lower[0] + lower[1] - lower[2] + 1e-5;
    s->c = batten_matrix_dense(10, 8, rows);
    s->problem.lower = lower, s->problem.upper = upper;
    expect_infeasible(ctx, &equal, seed, &s->problem);
    qp_scene_free(s);
  }
  double rows[6] = {1, 1, 0, 0, 2, 2}, lower[3] = {3, 0, -INFINITY}, upper[3] = {INFINITY, INFINITY, INFINITY},
         h[4] = {1, 0, 0, 1};
  double low[2] = {0, 0}, high[2] = {1, 1.5};
  batten_matrix c = batten_matrix_dense(3, 2, rows), hm = batten_matrix_dense(2, 2, h);
  batten_qp_problem p = batten_qp_problem_default(2);
  p.h = &hm, p.c = &c, p.lower = lower, p.upper = upper, p.x_lower = low, p.x_upper = high;
  expect_infeasible(ctx, &bound, 0, &p);
  lower[0] = 0, lower[1] = 1;
  expect_infeasible(ctx, &zero, 0, &p);
  lower[1] = 0, lower[0] = 1, upper[2] = 2 - 2e-6;
  expect_infeasible(ctx, &parallel, 0, &p);
  report(&plain), report(&hair), report(&other), report(&equal), report(&bound), report(&zero), report(&parallel);
}

static void test_unbounded(batten_context *ctx) {
  tally t = {.what = "unbounded along a null direction"}, free_lp = {.what = "unbounded linear program"};
  tally lsq = {.what = "unbounded least squares with g"};
  for (size_t seed = 0; seed < 12; seed++) {
    /* A direction d with P d = 0: rows are made >= 0 along it, the gradient falls along it. */
    double d[6], g[6], rows[30], lower[5], a[24], h[36] = {0};
    seed_of_test = seed;
    for (size_t j = 0; j < 6; j++) d[j] = uniform();
    for (size_t i = 0; i < 24; i++) a[i] = uniform();
    double norm = 0;
    for (size_t j = 0; j < 6; j++) norm += d[j] * d[j];
    for (size_t i = 0; i < 4; i++) {
      double dot = 0;
      for (size_t j = 0; j < 6; j++) dot += a[i * 6 + j] * d[j];
      for (size_t j = 0; j < 6; j++) a[i * 6 + j] -= dot / norm * d[j];
    }
    for (size_t i = 0; i < 6; i++)
      for (size_t j = 0; j < 6; j++)
        for (size_t k = 0; k < 4; k++) h[i * 6 + j] += a[k * 6 + i] * a[k * 6 + j];
    for (size_t i = 0; i < 5; i++) {
      double dot = 0;
      for (size_t j = 0; j < 6; j++) rows[i * 6 + j] = uniform();
      for (size_t j = 0; j < 6; j++) dot += rows[i * 6 + j] * d[j];
      for (size_t j = 0; j < 6; j++) rows[i * 6 + j] *= dot < 0 ? -1 : 1;
      lower[i] = uniform();
    }
    for (size_t j = 0; j < 6; j++) g[j] = uniform() - 3 * d[j];
    batten_matrix c = batten_matrix_dense(5, 6, rows), hm = batten_matrix_dense(6, 6, h),
                  am = batten_matrix_dense(4, 6, a);
    batten_qp_problem p = batten_qp_problem_default(6);
    p.c = &c, p.lower = lower, p.g = g;
    if (seed % 2)
      p.a = &am;
    else
      p.h = &hm;
    expect_unbounded(ctx, seed % 2 ? &lsq : &t, seed, &p);
  }
  double row[2] = {1, -1}, lower = -1, g[2] = {-1, -1}, zero[2] = {0, 0};
  batten_matrix c = batten_matrix_dense(1, 2, row);
  batten_qp_problem p = batten_qp_problem_default(2);
  p.c = &c, p.lower = &lower, p.g = g, p.x_lower = zero;
  expect_unbounded(ctx, &free_lp, 0, &p);
  p.c = NULL, p.lower = NULL;
  expect_unbounded(ctx, &free_lp, 1, &p);
  report(&t), report(&lsq), report(&free_lp);
}

/* Q diag(1, .., least) Q'. */
static void test_indefinite(batten_context *ctx) {
  enum { N = 7 };
  tally found = {.what = "indefinite by 1e-10"}, convex = {.what = "definite by 1e-10"},
        diagonal = {.what = "negative diagonal"};
  for (size_t seed = 0; seed < 10; seed++)
    for (int sign = -1; sign <= 1; sign += 2) {
      double v[N], h[N * N], square = 0, g[N], low[N], high[N];
      seed_of_test = seed;
      for (size_t j = 0; j < N; j++)
        v[j] = uniform(), square += v[j] * v[j], g[j] = uniform(), low[j] = -1, high[j] = 1;
      for (size_t i = 0; i < N; i++)
        for (size_t j = 0; j < N; j++) h[i * N + j] = (i == j) - (1 - sign * 1e-10) * v[i] * v[j] / square;
      batten_matrix hm = batten_matrix_dense(N, N, h);
      batten_qp_problem p = batten_qp_problem_default(N);
      p.h = &hm, p.g = g, p.x_lower = low, p.x_upper = high;
      if (sign > 0) {
        expect_solved(ctx, &convex, seed, &p, NULL, NAN, 0);
        continue;
      }
      for (int e = 0; e < 4; e++) {
        outcome *o = solve(ctx, qp_engines[e], &p);
        long double curvature = 0, size = 0;
        for (size_t i = 0; i < N && o->status == BATTEN_E_NOT_CONVEX; i++)
          for (size_t j = 0; j < N; j++) curvature += (long double)o->ray[i] * h[i * N + j] * o->ray[j];
        for (size_t i = 0; i < N && o->status == BATTEN_E_NOT_CONVEX; i++) size += (long double)o->ray[i] * o->ray[i];
        count(&found, e, seed, curvature < 0 && o->info.not_convex_index < N, (double)(curvature / size),
              batten_status_name(o->status));
      }
    }
  double h[4] = {1, 0, 0, -1};
  batten_matrix hm = batten_matrix_dense(2, 2, h);
  batten_qp_problem p = batten_qp_problem_default(2);
  p.h = &hm;
  for (int e = 0; e < 4; e++) {
    outcome *o = solve(ctx, qp_engines[e], &p);
    bool ok = o->status == BATTEN_E_NOT_CONVEX && o->info.not_convex_index == 1 && o->ray[1] != 0;
    count(&diagonal, e, 0, ok, 0, batten_status_name(o->status));
  }
  report(&found), report(&convex), report(&diagonal);
}

/* ---- flat objectives ----------------------------------------------------------------------------------------- */

static void test_semidefinite(batten_context *ctx) {
  tally t = {.what = "semidefinite, objective known"}, lp = {.what = "linear program with a known vertex"};
  tally degenerate = {.what = "linear program with 4 n rows through the vertex"},
        nothing = {.what = "no objective at all"};
  for (size_t seed = 0; seed < 20; seed++) {
    qp_scene_spec spec = {.seed = seed,
                          .n = 12,
                          .m = 30,
                          .condition = 1e3,
                          .null = 1 + seed % 11,
                          .active = 6,
                          .bounds = true,
                          .lsq = seed % 2 == 0};
    qp_scene *s = qp_scene_random(&spec);
    qp_verdict v = qp_check(&s->problem, s->x, s->y);
    expect_solved(ctx, &t, seed, &s->problem, NULL, v.objective, 1e-9);
    qp_scene_free(s);
    spec = (qp_scene_spec){.seed = seed, .n = 8, .m = 60, .condition = 1, .active = seed % 2 ? 32 : 8};
    s = qp_scene_random(&spec);
    /* Without the Hessian the same x and y are optimal for the gradient C'y. */
    double *g = qp_scene_array(s, 8, sizeof *g);
    long double sum[8] = {0};
    for (size_t i = 0; i < 60; i++) qp_scene_add(&s->c, i, s->y[i], sum);
    for (size_t j = 0; j < 8; j++) g[j] = (double)sum[j];
    s->problem.h = NULL, s->problem.g = g;
    expect_solved(ctx, seed % 2 ? &degenerate : &lp, seed, &s->problem, s->x, NAN, 1e-9);
    s->problem.g = NULL;
    expect_solved(ctx, &nothing, seed, &s->problem, NULL, 0, 1e-15);
    qp_scene_free(s);
  }
  report(&t), report(&lp), report(&degenerate), report(&nothing);
}

/* ---- what must not change the solution ----------------------------------------------------------------------- */

static void test_invariance(batten_context *ctx) {
  tally columns = {.what = "unknowns in units of 2^-13 .. 2^13"}, permuted = {.what = "unknowns in another order"};
  tally powers = {.what = "everything times powers of two"},
        shifted = {.what = "objective and rows times 2^200, 2^-200"};
  for (size_t seed = 0; seed < 8; seed++) {
    enum { N = 8, M = 24 };
    qp_scene_spec spec = {.seed = seed, .n = N, .m = M, .condition = 100, .active = 5, .bounds = true};
    for (int kind = 0; kind < 4; kind++) {
      qp_scene *s = qp_scene_random(&spec);
      double h[N * N], g[N], rows[M * N], lower[M], upper[M], low[N], high[N], x[N], unit[N], row_unit[M], all = 1;
      size_t place[N];
      seed_of_test = seed;
      for (size_t j = 0; j < N; j++) {
        unit[j] = kind == 0 ? ldexp(1, (int)(13 * uniform())) : kind == 2 ? 0x1p40 : 1; /* x' = unit x */
        place[j] = kind == 1 ? (5 * j + 3) % N : j;
      }
      if (kind == 2) all = 0x1p-30;
      if (kind == 3) all = seed % 2 ? 0x1p200 : 0x1p-200;
      for (size_t i = 0; i < M; i++) row_unit[i] = kind == 2 ? 0x1p20 : kind == 3 ? 1 / all : 1;
      for (size_t j = 0; j < N; j++) {
        x[j] = s->x[place[j]] * unit[j];
        g[j] = all * s->problem.g[place[j]] / unit[j];
        low[j] = s->problem.x_lower[place[j]] * unit[j];
        high[j] = s->problem.x_upper[place[j]] * unit[j];
        for (size_t i = 0; i < N; i++) h[i * N + j] = all * s->h.dense[place[i] * N + place[j]] / unit[i] / unit[j];
        for (size_t i = 0; i < M; i++) rows[i * N + j] = row_unit[i] * s->c.dense[i * N + place[j]] / unit[j];
      }
      for (size_t i = 0; i < M; i++)
        lower[i] = row_unit[i] * s->problem.lower[i], upper[i] = row_unit[i] * s->problem.upper[i];
      batten_matrix c = batten_matrix_dense(M, N, rows), hm = batten_matrix_dense(N, N, h);
      batten_qp_problem p = batten_qp_problem_default(N);
      p.h = &hm, p.g = g, p.c = &c, p.lower = lower, p.upper = upper, p.x_lower = low, p.x_upper = high;
      tally *t[4] = {&columns, &permuted, &powers, &shifted};
      for (int e = 0; e < 4; e++) {
        outcome *o = solve(ctx, qp_engines[e], &p);
        double off = o->status == BATTEN_OK ? 0 : INFINITY;
        char text[200];
        for (size_t j = 0; j < N && o->status == BATTEN_OK; j++) off = fmax(off, fabs(o->x[j] - x[j]) / unit[j]);
        snprintf(text, sizeof text, "%s, off by %.2g: %s", batten_status_name(o->status), off, batten_error(ctx));
        count(t[kind], e, seed, off <= 1e-9, off, text);
      }
      qp_scene_free(s);
    }
  }
  report(&columns), report(&permuted), report(&powers), report(&shifted);
}

/* The least there can be. */
static void test_edges(batten_context *ctx) {
  tally t = {.what = "one unknown"}, none = {.what = "no rows"}, fixed = {.what = "all unknowns fixed"};
  double h = 2, g = -6, low = -1, high = 1, x = 1, free_x = 3;
  batten_matrix hm = batten_matrix_dense(1, 1, &h);
  batten_qp_problem p = batten_qp_problem_default(1);
  p.h = &hm, p.g = &g;
  expect_solved(ctx, &none, 0, &p, &free_x, -9, 1e-15);
  p.x_lower = &low, p.x_upper = &high;
  expect_solved(ctx, &t, 0, &p, &x, -5, 1e-15);
  double h2[4] = {2, 1, 1, 2}, g2[2] = {1, -1}, at[2] = {0.1, 0.7};
  hm = batten_matrix_dense(2, 2, h2);
  p = batten_qp_problem_default(2);
  p.h = &hm, p.g = g2, p.x_lower = at, p.x_upper = at;
  expect_solved(ctx, &fixed, 0, &p, at, NAN, 1e-15);
  report(&t), report(&none), report(&fixed);
}

/* One engine alone, from a start of the caller. */
static batten_status solve_alone(batten_context *ctx, batten_qp_engine engine, const batten_qp_problem *p,
                                 const double *x0, int hand_over, batten_qp_info *info) {
  batten_qp_options opt = batten_qp_options_default();
  opt.engine = engine, opt.x0 = x0, opt.hand_over = hand_over;
  return batten_qp_solve(ctx, p, &opt, NULL, NULL, info);
}

/* A start that is far off must not cost digits, nor a ray that is sought from it. */
static void test_nonsense_start(batten_context *ctx) {
  double a[5 * 6] = {2,  -2, 0,  1,  2,  -2, 0,  1, 1, -1, 2,  0, 2, -1, 1,
                     -1, 0,  -1, -1, -2, 2,  -2, 0, 2, 1,  -1, 0, 1, 1,  -2},
               b[5] = {2, 3, -3, -3, 1}, g[6] = {0}, x0[6] = {1.44043, 3, 1.89238e8, 0, 2, 0},
               flat[6] = {1, 0, 0, 0, 0, 0};
  batten_matrix am = batten_matrix_dense(5, 6, a);
  batten_qp_problem p = batten_qp_problem_default(6);
  p.a = &am, p.b = b;
  for (int e = 0; e < 4; e++) {
    batten_qp_info info = {0};
    T_STATUS(solve_alone(ctx, qp_engines[e], &p, x0, 1, &info), BATTEN_OK, ctx, "");
    x0[2] = -1e28;
    T_STATUS(solve_alone(ctx, qp_engines[e], &p, x0, 1, &info), BATTEN_OK, ctx, "");
    x0[2] = 1.89238e8;
  }
  for (size_t i = 0; i < 5; i++) a[6 * i] = 0, a[6 * i + 3] = 0;
  memcpy(g, flat, sizeof g);
  p.g = g;
  x0[3] = -1e28;
  for (int e = 0; e < 4; e++)
    for (int hand_over = 0; hand_over < 2; hand_over++)
      T_STATUS(solve_alone(ctx, qp_engines[e], &p, x0, hand_over, NULL), BATTEN_E_UNBOUNDED, ctx, "");
}

/* An entry that is rounding beside the others of its row stands before an unknown that is huge: the rows are not
 * parallel. And sides that contradict each other by less than the caller minds, in the units of one of the two. */
static void test_mixed_units(batten_context *ctx) {
  tally units = {.what = "rows that differ in tiny entries before huge unknowns"};
  double c[4] = {1, 0x1p-80, -1, 0x1p-80}, lower[2] = {3, 1}, h[4] = {1, 0, 0, 0x1p-160}, x[2] = {1, 0x1p81};
  batten_matrix cm = batten_matrix_dense(2, 2, c), hm = batten_matrix_dense(2, 2, h);
  batten_qp_problem p = batten_qp_problem_default(2);
  p.h = &hm, p.c = &cm, p.lower = lower, p.upper = lower;
  expect_solved(ctx, &units, 0, &p, x, 2.5, 1e-14);
  report(&units);

  tally minded = {.what = "sides that cross by less than is minded"};
  double one[4] = {0x1p-80, 0, 1, 1}, high[2] = {0, 9}, bound[2] = {3, -5};
  cm = batten_matrix_dense(2, 2, one);
  p.c = &cm, p.lower = NULL, p.upper = high, p.x_lower = bound;
  for (int e = 0; e < 4; e++) {
    outcome *o = solve(ctx, qp_engines[e], &p);
    qp_verdict v = qp_check(&p, o->x, o->y);
    count(&minded, e, 0, o->status == BATTEN_OK && v.primal <= 1e-9, v.primal, batten_error(ctx));
  }
  report(&minded);
}

/* A limit that is met at a point that is good enough: its working set is told with it. */
static void test_limit_at_solution(batten_context *ctx) {
  double h[9] = {4, 0, 0, 0, 1, 0, 0, 0, 4}, g[3] = {4, 2, -2}, c[6] = {0, -2, 0, 0, 0, -1}, lower[2] = {-4, 2};
  double x_lower[3] = {1, -INFINITY, -2}, x_upper[3] = {INFINITY, INFINITY, 0}, y[5];
  signed char active[5];
  batten_matrix hm = batten_matrix_dense(3, 3, h), cm = batten_matrix_dense(2, 3, c);
  batten_qp_problem p = batten_qp_problem_default(3);
  p.h = &hm, p.g = g, p.c = &cm, p.lower = lower, p.x_lower = x_lower, p.x_upper = x_upper;
  size_t solved = 0;
  for (size_t limit = 1; limit < 12; limit++) {
    batten_qp_options opt = batten_qp_options_default();
    opt.engine = BATTEN_QP_INTERIOR, opt.iteration_limit = limit, opt.hand_over = 0;
    batten_qp_solution s = {.multipliers = y, .active = active};
    if (batten_qp_solve(ctx, &p, &opt, NULL, &s, NULL) != BATTEN_OK) continue;
    solved++;
    for (size_t i = 0; i < 5; i++)
      T_CHECK((fabs(y[i]) > 1e-6) == (active[i] != 0), "limit %zu: multiplier %zu %g, active %d", limit, i, y[i],
              active[i]);
  }
  T_CHECK(solved > 2, "%zu limits were enough", solved);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_edges(ctx);
  test_rows(ctx);
  test_cone(ctx);
  test_dependent_on_equalities(ctx);
  test_degenerate(ctx);
  test_cycling(ctx);
  test_infeasible(ctx);
  test_unbounded(ctx);
  test_indefinite(ctx);
  test_semidefinite(ctx);
  test_invariance(ctx);
  test_nonsense_start(ctx);
  test_mixed_units(ctx);
  test_limit_at_solution(ctx);
  batten_context_free(ctx);
  return t_done();
}
