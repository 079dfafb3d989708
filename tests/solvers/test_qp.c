/* Quadratic programs from end to end: problems done by hand for each status, one way of stating them against another,
 * engine against engine, edges, memory, cancelling, warm starts. Random problems by the thousand are in
 * test_qp_random.c, mistakes of the caller in test_qp_bad.c. */
#include <batten/qp.h>
#include <float.h>

#include "qp_check.h"
#include "qp_scenes.h"
#include "tap.h"

static batten_context *ctx;

/* A problem with room for its result. */
typedef struct small {
  batten_matrix a, h, c;
  batten_qp_problem p;
  batten_qp_options o;
  double x[8], y[24], certificate[24], ray[8];
  signed char active[24];
  batten_qp_solution s;
  batten_qp_info info;
} small;

static void scene_init(small *s, size_t n) {
  *s = (small){.p = batten_qp_problem_default(n), .o = batten_qp_options_default()};
  s->s = (batten_qp_solution){s->x, s->y, s->active, s->certificate, s->ray};
}
static void scene_hessian(small *s, const double *h) {
  s->h = batten_matrix_dense(s->p.n, s->p.n, h);
  s->p.h = &s->h;
}
static void scene_rows(small *s, size_t m, const double *c, const double *lower, const double *upper) {
  s->c = batten_matrix_dense(m, s->p.n, c);
  s->p.c = &s->c;
  s->p.lower = lower;
  s->p.upper = upper;
}
static batten_status scene_solve(small *s) { return batten_qp_solve(ctx, &s->p, &s->o, NULL, &s->s, &s->info); }

static double distance(size_t n, const double *a, const double *b) {
  double most = 0;
  for (size_t i = 0; i < n; i++) most = fmax(most, fabs(a[i] - b[i]));
  return most;
}

#define FOR_ENGINES for (int e = BATTEN_QP_AUTO; e <= BATTEN_QP_INTERIOR; e++)

/* ---- By hand ---- */

/* min (x0 - 3)^2 + (x1 - 2)^2, x0 + 2 x1 <= 4, x >= 0, x1 <= 1.5. On the row: (3, 2) - t (1, 2) with 7 - 5 t = 4, t = 0.6:
 * x = (2.4, 0.8), gradient 2 (x - (3, 2)) = (-1.2, -2.4) = -1.2 (1, 2). Objective with constant: 0.36 + 1.44 = 1.8. */
static void test_by_hand(void) {
  const double h[] = {2, 0, 0, 2}, g[] = {-6, -4}, c[] = {1, 2}, upper[] = {4}, zero[] = {0, 0};
  const double x_upper[] = {INFINITY, 1.5}, x[] = {2.4, 0.8}, y[] = {-1.2, 0, 0};
  FOR_ENGINES {
    small s;
    scene_init(&s, 2);
    scene_hessian(&s, h);
    scene_rows(&s, 1, c, NULL, upper);
    s.p.g = g, s.p.constant = 13, s.p.x_lower = zero, s.p.x_upper = x_upper;
    s.o.engine = (batten_qp_engine)e;
    T_OK(scene_solve(&s), ctx);
    T_RATIO(distance(2, s.x, x), 1e-14, "%s: x", qp_engine_names[e]);
    T_RATIO(distance(3, s.y, y), 1e-14, "%s: multipliers", qp_engine_names[e]);
    T_CHECK(s.active[0] == 1 && s.active[1] == 0 && s.active[2] == 0, "%s: the row is active at its upper side",
            qp_engine_names[e]);
    T_RATIO(fabs(s.info.objective - 1.8), 1e-14, "%s: objective", qp_engine_names[e]);
    T_CHECK(s.info.rows_active == 1 && s.info.rows_used >= 1 && s.info.not_convex_index == 2 && s.info.blend == 0 &&
                s.info.time_s >= s.info.time_solve_s && (e == 0 || s.info.engine == (batten_qp_engine)e),
            "%s: figures (engine %d, %zu rows used)", qp_engine_names[e], (int)s.info.engine, s.info.rows_used);
  }
}

/* x0 + x1 >= 3 and x0 + 2 x1 <= 2, x1 >= 0: with y = (1, -1) left is -x1, held by its bound with y = 1; bounds sum to
 * 3 - 2 = 1. */
static void test_infeasible(void) {
  const double h[] = {1, 0, 0, 1}, c[] = {1, 1, 1, 2}, lower[] = {3, -INFINITY}, upper[] = {INFINITY, 2};
  const double x_lower[] = {-INFINITY, 0}, proof[] = {1, -1, 0, 1};
  FOR_ENGINES {
    small s;
    scene_init(&s, 2);
    scene_hessian(&s, h);
    scene_rows(&s, 2, c, lower, upper);
    s.p.x_lower = x_lower;
    s.o.engine = (batten_qp_engine)e;
    s.x[0] = 7;
    T_STATUS(scene_solve(&s), BATTEN_E_INFEASIBLE, ctx, "no x satisfies");
    T_RATIO(distance(4, s.certificate, proof), 1e-8, "%s: certificate", qp_engine_names[e]);
    T_CHECK(s.x[0] == 7, "%s: x untouched", qp_engine_names[e]);
  }
}

/* min -x0 - x1 + x1^2 / 2, x0 >= 1, x0 - x1 >= -5: falls along (1, 0). With x0 <= 8 it is (8, 1). */
static void test_unbounded(void) {
  const double h[] = {0, 0, 0, 1}, g[] = {-1, -1}, c[] = {1, -1}, lower[] = {-5}, x_lower[] = {1, -INFINITY};
  const double ray[] = {1, 0}, x_upper[] = {8, INFINITY}, x[] = {8, 1};
  FOR_ENGINES {
    small s;
    scene_init(&s, 2);
    scene_hessian(&s, h);
    scene_rows(&s, 1, c, lower, NULL);
    s.p.g = g, s.p.x_lower = x_lower;
    s.o.engine = (batten_qp_engine)e;
    T_STATUS(scene_solve(&s), BATTEN_E_UNBOUNDED, ctx, "falls without end");
    T_RATIO(distance(2, s.ray, ray), 1e-9, "%s: ray", qp_engine_names[e]);
    T_RATIO(qp_check_unbounded(&s.p, s.ray), 1e-12, "%s: ray, by the judge of the tests", qp_engine_names[e]);
    s.p.x_upper = x_upper;
    T_OK(scene_solve(&s), ctx);
    T_RATIO(distance(2, s.x, x), 1e-12, "%s: bounded again", qp_engine_names[e]);
  }
}

/* Both at once: the rows contradict each other, the objective would fall. */
static void test_unbounded_and_infeasible(void) {
  const double g[] = {-1, 0}, c[] = {0, 1, 0, 1}, lower[] = {1, -INFINITY}, upper[] = {INFINITY, 0};
  FOR_ENGINES {
    small s;
    scene_init(&s, 2);
    scene_rows(&s, 2, c, lower, upper);
    s.p.g = g;
    s.o.engine = (batten_qp_engine)e;
    T_STATUS(scene_solve(&s), BATTEN_E_INFEASIBLE, ctx, "no x satisfies");
  }
}

/* Indefinite by 1e-10, with bounds that make a solution all the same: never OK. And semidefinite by rounding: OK. */
static void test_not_convex(void) {
  double h[] = {1, 0, 0, 0, 2, 2, 0, 2, 2 - 1e-10};
  const double bound[] = {1, 1, 1}, zero[] = {0, 0, 0};
  FOR_ENGINES {
    small s;
    scene_init(&s, 3);
    scene_hessian(&s, h);
    s.p.x_lower = zero, s.p.x_upper = bound;
    s.o.engine = (batten_qp_engine)e;
    h[8] = 2 - 1e-10;
    T_STATUS(scene_solve(&s), BATTEN_E_NOT_CONVEX, ctx, "problem.h: not positive semidefinite");
    double energy = 0;
    for (size_t i = 0; i < 3; i++)
      for (size_t j = 0; j < 3; j++) energy += s.ray[i] * h[3 * i + j] * s.ray[j];
    T_CHECK(energy < 0 && s.info.not_convex_index < 3 && s.info.not_convex_index > 0,
            "%s: unknown %zu, along the ray d'Hd = %g", qp_engine_names[e], s.info.not_convex_index, energy);
    h[8] = 2 - 4 * DBL_EPSILON;
    T_OK(scene_solve(&s), ctx);
  }
}

/* ---- Limits ---- */

/* n rows x_j <= -1 against |x - 1|^2: a dual engine needs a pivot for each. */
static void test_limits(void) {
  enum { N = 8 };
  double h[N * N] = {0}, g[N], c[N * N] = {0}, upper[N], start[N];
  for (size_t j = 0; j < N; j++) {
    h[j * N + j] = 1, g[j] = -1, upper[j] = -1, start[j] = -2;
    c[j * N + j] = 1;
    c[j * N + (j + 1) % N] = 0.25;
  }
  small s;
  scene_init(&s, N);
  scene_hessian(&s, h);
  scene_rows(&s, N, c, NULL, upper);
  s.p.g = g;
  s.o.iteration_limit = 1;
  s.o.engine = BATTEN_QP_DUAL;
  s.x[0] = 7;
  T_STATUS(scene_solve(&s), BATTEN_E_LIMIT, ctx, "opt.iteration_limit: 1");
  T_CHECK(s.x[0] == 7, "x untouched");
  s.o.engine = BATTEN_QP_PRIMAL;
  s.o.x0 = start;
  T_STATUS(scene_solve(&s), BATTEN_W_STOPPED, ctx, "stopped at a feasible point: opt.iteration_limit");
  T_CHECK(s.info.primal_residual <= 1e-12 && s.x[0] < 0, "the point is feasible: violation %g", s.info.primal_residual);
  s.o.iteration_limit = 0;
  s.o.time_limit_s = 1e-12;
  FOR_ENGINES {
    s.o.engine = (batten_qp_engine)e;
    s.o.x0 = NULL;
    batten_status st = scene_solve(&s);
    T_CHECK((st == BATTEN_E_LIMIT || st == BATTEN_W_STOPPED) && strstr(batten_error(ctx), "time_limit_s"),
            "%s without time: %s", qp_engine_names[e], batten_error(ctx));
  }
  s.o.time_limit_s = 1e9;
  T_OK(scene_solve(&s), ctx);
}

/* ---- Edges ---- */

static void test_no_unknowns(void) {
  const double lower[] = {-1, 0}, upper[] = {1, INFINITY}, wrong[] = {1, 0};
  batten_qp_problem p = batten_qp_problem_default(0);
  batten_qp_info info;
  p.constant = 2.5;
  T_OK(batten_qp_solve(ctx, &p, NULL, NULL, NULL, &info), ctx);
  T_CHECK(info.objective == 2.5, "nothing at all: the constant");
  batten_matrix c = batten_matrix_dense(2, 0, NULL);
  p.c = &c, p.lower = lower, p.upper = upper;
  double y[2] = {7, 7};
  batten_qp_solution out = {.multipliers = y};
  T_OK(batten_qp_solve(ctx, &p, NULL, NULL, &out, &info), ctx);
  T_CHECK(y[0] == 0 && y[1] == 0, "rows of nothing that hold");
  const double proof_upper[] = {2, INFINITY};
  p.lower = wrong, p.upper = proof_upper;
  T_STATUS(batten_qp_solve(ctx, &p, NULL, NULL, &(batten_qp_solution){.certificate = y}, NULL), BATTEN_E_INFEASIBLE,
           ctx, "no x satisfies");
  T_CHECK(y[0] == 1 && y[1] == 0, "rows of nothing that do not hold");
}

static void test_edges(void) {
  const double h[] = {1, 0, 0, 2}, g[] = {-1, -2}, ones[] = {1, 1}, fixed[] = {3, 4}, none[] = {-INFINITY, -INFINITY};
  FOR_ENGINES {
    const char *name = qp_engine_names[e];
    small s;
    scene_init(&s, 2);
    s.o.engine = (batten_qp_engine)e;
    T_OK(scene_solve(&s), ctx);
    T_CHECK(isfinite(s.x[0]) && s.info.objective == 0, "%s: no objective, no rows", name);
    scene_hessian(&s, h);
    s.p.g = g;
    T_OK(scene_solve(&s), ctx);
    T_RATIO(distance(2, s.x, ones), 1e-14, "%s: free", name);
    s.p.x_lower = none;
    T_OK(scene_solve(&s), ctx);
    T_RATIO(distance(2, s.x, ones), 1e-14, "%s: infinite bounds are none", name);
    s.p.x_lower = s.p.x_upper = fixed;
    T_OK(scene_solve(&s), ctx);
    T_CHECK(s.x[0] == 3 && s.x[1] == 4 && s.active[0] == 2 && s.active[1] == 2, "%s: all fixed", name);
    T_RATIO(fabs(s.y[0] - 2) + fabs(s.y[1] - 6), 1e-14, "%s: their multipliers", name);
    scene_init(&s, 2); /* only a feasible point is wanted */
    const double c[] = {1, 1, 1, -1}, lower[] = {2, 0};
    scene_rows(&s, 2, c, lower, lower);
    s.o.engine = (batten_qp_engine)e;
    T_OK(scene_solve(&s), ctx);
    T_RATIO(distance(2, s.x, ones), 1e-14, "%s: no objective, equalities", name);
  }
}

/* max 3 x0 + 2 x1 on a polygon, the vertex (2, 2) met by four rows, one of them twice, one scaled. */
static void test_vertex(void) {
  const double c[] = {1, 1, 1, 0, 3e6, 3e6, 1, 1, 2, 1, 0, 0}, upper[] = {4, 2, 12e6, 4, 6, 0}, g[] = {-3, -2};
  const double zero[] = {0, 0}, x[] = {2, 2};
  FOR_ENGINES {
    small s;
    scene_init(&s, 2);
    scene_rows(&s, 6, c, NULL, upper);
    s.p.g = g, s.p.x_lower = zero;
    s.o.engine = (batten_qp_engine)e;
    T_OK(scene_solve(&s), ctx);
    T_RATIO(distance(2, s.x, x), 1e-12, "%s: linear program at a degenerate vertex", qp_engine_names[e]);
    T_RATIO(fabs(s.info.objective + 10), 1e-12, "%s: objective", qp_engine_names[e]);
  }
}

/* ---- One way against another ---- */

/* A scene of the generator, solved with the engine; x goes to out [n]. */
static batten_status solve_scene(const qp_scene *scene, batten_qp_engine engine, double *x, batten_qp_info *info) {
  batten_qp_options o = batten_qp_options_default();
  o.engine = engine;
  batten_qp_solution s = {.x = x};
  return batten_qp_solve(ctx, &scene->problem, &o, NULL, &s, info);
}

static const qp_scene_spec MIXED = {
    .seed = 5, .n = 20, .m = 60, .condition = 1e4, .equalities = 3, .active = 6, .bounded = 4, .two_sided = true};

static void test_engines(void) {
  for (size_t kind = 0; kind < 4; kind++) {
    qp_scene_spec spec = MIXED;
    spec.seed += kind;
    spec.lsq = (kind & 1) != 0;
    spec.sparse = (kind & 2) != 0;
    qp_scene *scene = qp_scene_random(&spec);
    FOR_ENGINES {
      double x[20];
      batten_qp_info info;
      T_OK(solve_scene(scene, (batten_qp_engine)e, x, &info), ctx);
      T_RATIO(distance(20, x, scene->x), 1e-9, "%s: %s, %s rows: the known solution", qp_engine_names[e],
              spec.lsq ? "least squares" : "Hessian", spec.sparse ? "sparse" : "dense");
    }
    qp_scene_free(scene);
  }
}

static batten_matrix sparse_of(const batten_matrix *m, size_t *starts, uint32_t *indices, double *values) {
  size_t count = 0;
  for (size_t i = 0; i < m->rows; i++) {
    starts[i] = count;
    for (size_t j = m->columns; j-- > 0;) { /* in falling order: any is allowed */
      if (m->dense[i * m->columns + j] == 0) continue;
      indices[count] = (uint32_t)j;
      values[count++] = m->dense[i * m->columns + j];
    }
  }
  starts[m->rows] = count;
  return batten_matrix_sparse(m->rows, m->columns, starts, indices, values);
}

static void test_dense_and_sparse(void) {
  qp_scene *scene = qp_scene_random(&MIXED);
  size_t n = 20, m = scene->problem.c->rows;
  size_t *starts = calloc(m + n + 2, sizeof *starts);
  uint32_t *indices = calloc((m + n) * n, sizeof *indices);
  double *values = calloc((m + n) * n, sizeof *values), x[20], again[20];
  batten_matrix c, h;
  FOR_ENGINES {
    batten_qp_info info;
    T_OK(solve_scene(scene, (batten_qp_engine)e, x, &info), ctx);
    const batten_matrix *kept_c = scene->problem.c, *kept_h = scene->problem.h;
    c = sparse_of(kept_c, starts, indices, values);
    h = sparse_of(kept_h, starts + m + 1, indices + m * n, values + m * n);
    scene->problem.c = &c, scene->problem.h = &h;
    T_OK(solve_scene(scene, (batten_qp_engine)e, again, &info), ctx);
    scene->problem.c = kept_c, scene->problem.h = kept_h;
    T_RATIO(distance(n, x, again), 1e-11, "%s: sparse matrices give what dense ones give", qp_engine_names[e]);
  }
  free(values), free(indices), free(starts);
  qp_scene_free(scene);
}

/* H = A'WA, g = -A'Wb + a part that only g has, by long double sums. */
static void test_squares_and_hessian(void) {
  enum { N = 12, K = 30, M = 25 };
  double a[K * N], b[K], w[K], h[N * N], g[N], tension[N * N] = {0}, both[N], c[M * N], lower[M], x[N], again[N];
  uint64_t seed = 11;
  for (size_t i = 0; i < K * N; i++) a[i] = t_uniform(&seed) - 0.5;
  for (size_t i = 0; i < K; i++) b[i] = t_uniform(&seed), w[i] = i % 7 ? t_uniform(&seed) : 0;
  for (size_t i = 0; i < M * N; i++) c[i] = t_uniform(&seed) - 0.5;
  for (size_t i = 0; i < M; i++) lower[i] = -0.2;
  for (size_t j = 0; j < N; j++) tension[j * N + j] = 0.01, g[j] = t_uniform(&seed) - 0.5;
  for (size_t i = 0; i < N; i++) {
    long double linear = g[i];
    for (size_t k = 0; k < K; k++) linear -= (long double)a[k * N + i] * w[k] * b[k];
    both[i] = (double)linear;
    for (size_t j = 0; j < N; j++) {
      long double sum = tension[i * N + j];
      for (size_t k = 0; k < K; k++) sum += (long double)a[k * N + i] * w[k] * a[k * N + j];
      h[i * N + j] = (double)sum;
    }
  }
  batten_matrix am = batten_matrix_dense(K, N, a), hm = batten_matrix_dense(N, N, h), cm = batten_matrix_dense(M, N, c);
  batten_matrix tm = batten_matrix_dense(N, N, tension);
  FOR_ENGINES {
    batten_qp_options o = batten_qp_options_default();
    o.engine = (batten_qp_engine)e;
    batten_qp_problem p = batten_qp_problem_default(N);
    p.a = &am, p.b = b, p.weights = w, p.h = &tm, p.g = g, p.c = &cm, p.lower = lower;
    batten_qp_info info;
    T_OK(batten_qp_solve(ctx, &p, &o, NULL, &(batten_qp_solution){.x = x}, &info), ctx);
    p.a = NULL, p.b = p.weights = NULL, p.h = &hm, p.g = both;
    T_OK(batten_qp_solve(ctx, &p, &o, NULL, &(batten_qp_solution){.x = again}, &info), ctx);
    T_RATIO(distance(N, x, again), 1e-10, "%s: least squares with tension, and the same by its Hessian",
            qp_engine_names[e]);
  }
}

/* Rows scaled by powers of two between 2^-30 and 2^30, and turned round: the same problem. */
static void test_scaled_rows(void) {
  qp_scene *scene = qp_scene_random(&MIXED);
  size_t n = 20, m = scene->problem.c->rows;
  double *c = malloc(m * n * sizeof *c), *lower = malloc(m * sizeof *lower), *upper = malloc(m * sizeof *upper);
  batten_matrix scaled = batten_matrix_dense(m, n, c);
  for (size_t i = 0; i < m; i++) {
    double by = ldexp(i % 3 ? 1 : -1, (int)(i % 61) - 30), from = by * scene->problem.lower[i];
    double to = by * scene->problem.upper[i];
    lower[i] = fmin(from, to), upper[i] = fmax(from, to);
    for (size_t j = 0; j < n; j++) c[i * n + j] = by * scene->problem.c->dense[i * n + j];
  }
  qp_scene other = *scene;
  other.problem.c = &scaled, other.problem.lower = lower, other.problem.upper = upper;
  FOR_ENGINES {
    double x[20], again[20];
    batten_qp_info info;
    T_OK(solve_scene(scene, (batten_qp_engine)e, x, &info), ctx);
    T_OK(solve_scene(&other, (batten_qp_engine)e, again, &info), ctx);
    T_RATIO(distance(n, x, again), 1e-11, "%s: rows scaled by 2^-30 .. 2^30", qp_engine_names[e]);
  }
  free(upper), free(lower), free(c);
  qp_scene_free(scene);
}

/* ---- Exactness ---- */

static void test_exact(void) {
  qp_scene *patch = qp_scene_patch(1, false, 3);
  size_t n = patch->problem.n, m = patch->problem.c->rows, broken = 0;
  double x[48];
  batten_qp_options o = batten_qp_options_default();
  batten_qp_info info;
  o.exact = 1;
  o.interior = patch->start;
  T_OK(batten_qp_solve(ctx, &patch->problem, &o, NULL, &(batten_qp_solution){.x = x}, &info), ctx);
  for (size_t i = 0; i < m; i++) {
    double sum = 0;
    for (size_t j = n; j-- > 0;) sum += patch->problem.c->dense[i * n + j] * x[j]; /* in an order of our own */
    broken += sum >= patch->problem.lower[i] ? 0 : 1;
  }
  T_CHECK(broken == 0, "%zu of %zu rows broken, blend %.3g", broken, m, info.blend);
  T_RATIO(info.blend, 1e-9, "the blend is small");
  qp_scene_free(patch);

  const double c[] = {1, 0, -1, 0}, lower[] = {0, 0}, h[] = {1, 0, 0, 1};
  small s; /* x0 = 0: no strictly feasible point */
  scene_init(&s, 2);
  scene_hessian(&s, h);
  scene_rows(&s, 2, c, lower, NULL);
  s.o.exact = 1;
  batten_status st = scene_solve(&s);
  T_CHECK(st == BATTEN_OK || (st == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "opt.exact")),
          "flat feasible set: %s %s", batten_status_name(st), st ? batten_error(ctx) : "");
}

/* ---- Memory and the host ---- */

typedef struct case_of {
  const qp_scene *scene;
  batten_qp_engine engine;
  int exact;
} case_of;

static batten_status solve_case(batten_context *host, void *arg) {
  const case_of *c = arg;
  batten_qp_options o = batten_qp_options_default();
  o.engine = c->engine;
  o.exact = c->exact;
  double x[32];
  batten_qp_info info;
  return batten_qp_solve(host, &c->scene->problem, &o, NULL, &(batten_qp_solution){.x = x}, &info);
}

static batten_status bytes_case(batten_context *host, void *arg) {
  const case_of *c = arg;
  size_t bytes;
  return batten_qp_bytes(host, &c->scene->problem, NULL, &bytes, NULL);
}

/* Cancelled at each progress call in turn: CANCELLED, or STOPPED with a feasible point, until it goes through. */
static void cancel_everywhere(const char *name, case_of *c) {
  size_t cancelled = 0, stopped = 0, k = 0;
  bool ok = true;
  batten_status st = BATTEN_E_CANCELLED;
  while (ok && (st == BATTEN_E_CANCELLED || st == BATTEN_W_STOPPED) && k < 10000) {
    t_memory memory = {0};
    t_progress progress = {.cancel_at = ++k};
    batten_context *host = t_context(&memory, &progress, 1);
    batten_qp_options o = batten_qp_options_default();
    o.engine = c->engine;
    double x[32];
    batten_qp_info info;
    st = batten_qp_solve(host, &c->scene->problem, &o, NULL, &(batten_qp_solution){.x = x}, &info);
    cancelled += st == BATTEN_E_CANCELLED;
    stopped += st == BATTEN_W_STOPPED;
    ok = memory.live == 1 && (st == BATTEN_OK || st == BATTEN_E_CANCELLED || st == BATTEN_W_STOPPED);
    if (st == BATTEN_W_STOPPED) ok = ok && info.cancelled;
    if (st == BATTEN_OK) ok = ok && !info.cancelled;
    if (st == BATTEN_W_STOPPED) ok = ok && info.primal_residual <= 1e-9 * (1 + info.primal_scale);
    if (!ok) printf("# progress call %zu: %s %s\n", k, batten_status_name(st), batten_error(host));
    batten_context_free(host);
  }
  T_CHECK(ok && st == BATTEN_OK && cancelled + stopped > 0, "%s: %zu times cancelled, %zu times stopped feasible", name,
          cancelled, stopped);
}

static void test_host(void) {
  qp_scene *scenes[3];
  qp_scene_spec spec = {
      .seed = 8, .n = 10, .m = 20, .condition = 100, .equalities = 2, .active = 3, .bounded = 2, .two_sided = true};
  scenes[0] = qp_scene_random(&spec);
  spec.lsq = true;
  scenes[1] = qp_scene_random(&spec);
  spec.lsq = false, spec.null = 3, spec.sparse = true, spec.active = 5;
  scenes[2] = qp_scene_random(&spec);
  for (size_t i = 0; i < 3; i++) {
    FOR_ENGINES {
      char name[64];
      snprintf(name, sizeof name, "problem %zu, %s", i, qp_engine_names[e]);
      case_of c = {scenes[i], (batten_qp_engine)e, e == BATTEN_QP_DUAL};
      t_fail_every_allocation(name, solve_case, &c);
      cancel_everywhere(name, &c);
    }
    case_of c = {scenes[i], BATTEN_QP_AUTO, 0};
    t_fail_every_allocation("bytes", bytes_case, &c);
    qp_scene_free(scenes[i]);
  }
}

/* Again and again with one workspace: nothing from the host from the second time on, and the same bits. */
static void test_workspace(void) {
  for (int lsq = 0; lsq < 2; lsq++) {
    qp_scene_spec spec = MIXED;
    spec.lsq = lsq;
    qp_scene *scene = qp_scene_random(&spec);
    FOR_ENGINES {
      t_memory memory = {0};
      batten_context *host = t_context(&memory, NULL, 1);
      batten_qp_workspace *w = NULL;
      double first[20], x[20];
      batten_qp_options o = batten_qp_options_default();
      o.engine = (batten_qp_engine)e;
      T_OK(batten_qp_workspace_new(host, &w), host);
      T_OK(batten_qp_solve(host, &scene->problem, &o, w, &(batten_qp_solution){.x = first}, NULL), host);
      size_t calls = memory.calls;
      bool same = true;
      for (int again = 0; again < 3; again++) {
        batten_status st = batten_qp_solve(host, &scene->problem, &o, w, &(batten_qp_solution){.x = x}, NULL);
        same = same && st == BATTEN_OK && memcmp(first, x, sizeof x) == 0;
      }
      T_CHECK(same && memory.calls == calls, "%s: %zu allocations the first time, %zu more for three times again",
              qp_engine_names[e], calls, memory.calls - calls);
      batten_qp_workspace_free(w);
      T_CHECK(memory.live == 1, "%s: nothing is left", qp_engine_names[e]);
      batten_context_free(host);
    }
    qp_scene_free(scene);
  }
}

static void test_bytes(void) {
  for (int kind = 0; kind < 3; kind++) {
    qp_scene_spec spec = MIXED;
    spec.lsq = kind == 1;
    qp_scene *scene = kind < 2 ? qp_scene_random(&spec) : qp_scene_convex(400, 2, 0.1, 1);
    batten_qp_engine engine;
    size_t bytes = 0;
    T_OK(batten_qp_bytes(ctx, &scene->problem, NULL, &bytes, &engine), ctx);
    batten_bytes_peak_reset(ctx);
    batten_qp_info info;
    T_OK(batten_qp_solve(ctx, &scene->problem, NULL, NULL, NULL, &info), ctx);
    T_RATIO((double)batten_bytes_peak(ctx), (double)bytes, "bytes held by %s", qp_engine_names[info.engine]);
    T_CHECK(engine >= BATTEN_QP_PRIMAL && engine <= BATTEN_QP_INTERIOR, "AUTO is %s", qp_engine_names[engine]);
    qp_scene_free(scene);
  }
}

/* ---- Warm start ---- */

/* The second solve, its data changed by 1 %, from the first one's working set and point. */
static void test_warm(void) {
  for (int e = BATTEN_QP_PRIMAL; e <= BATTEN_QP_DUAL; e++) {
    size_t cold = 0, warm = 0;
    for (uint64_t seed = 1; seed <= 10; seed++) {
      qp_scene_spec spec = {.seed = seed, .n = 60, .m = 200, .condition = 1e3, .active = 30, .bounds = true};
      qp_scene *scene = qp_scene_random(&spec);
      size_t n = 60, m = scene->problem.c->rows;
      double *g = malloc(n * sizeof *g), *x = malloc(n * sizeof *x);
      signed char *active = malloc(m + n);
      batten_qp_options o = batten_qp_options_default();
      o.engine = (batten_qp_engine)e;
      batten_qp_solution s = {.x = x, .active = active};
      batten_qp_info info;
      batten_status st = batten_qp_solve(ctx, &scene->problem, &o, NULL, &s, &info);
      uint64_t noise = seed;
      for (size_t j = 0; j < n; j++) g[j] = scene->problem.g[j] * (1 + 0.01 * (2 * t_uniform(&noise) - 1));
      scene->problem.g = g;
      batten_status again = batten_qp_solve(ctx, &scene->problem, &o, NULL, NULL, &info);
      cold += info.iterations;
      o.active = active;
      o.x0 = x;
      batten_status last = batten_qp_solve(ctx, &scene->problem, &o, NULL, NULL, &info);
      warm += info.iterations;
      if (st || again || last) T_CHECK(false, "seed %zu: %d %d %d", (size_t)seed, (int)st, (int)again, (int)last);
      free(active), free(x), free(g);
      qp_scene_free(scene);
    }
    T_RATIO((double)warm, 0.2 * (double)cold, "%s: pivots from a warm start against a fifth of those from a cold one",
            qp_engine_names[e]);
  }
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_by_hand();
  test_infeasible();
  test_unbounded();
  test_unbounded_and_infeasible();
  test_not_convex();
  test_limits();
  test_no_unknowns();
  test_edges();
  test_vertex();
  test_engines();
  test_dense_and_sparse();
  test_squares_and_hessian();
  test_scaled_rows();
  test_exact();
  test_host();
  test_workspace();
  test_bytes();
  test_warm();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is held at the end");
  batten_context_free(ctx);
  return t_done();
}
