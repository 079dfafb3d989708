/* The primal active set method through its internal interface: by hand, against all working sets tried in turn,
 * against known solutions, stopped after each pivot, at degenerate and cycling vertices, without a feasible point. */
#include <float.h>

#include "qp/engine.h"
#include "qp_scenes.h"
#include "tap.h"

/* A problem in its own memory: dense rows [m][n], brought to length 1 by scale. */
typedef struct program {
  size_t n, m;
  double *r, *c, *dense, *scale, *lower, *upper;
  size_t *row;
  uint32_t *identity;
  batten_matrix matrix;
  qp_rows rows;
  qp_dense objective;
  double *x, *y;
  signed char *active;
} program;

static program *program_new(size_t n, size_t m) {
  program *p = calloc(1, sizeof *p);
  p->n = n;
  p->m = m;
  p->r = calloc(n * n, sizeof(double));
  p->c = calloc(n, sizeof(double));
  p->dense = calloc(m * n + 1, sizeof(double));
  p->scale = calloc(m + 1, sizeof(double));
  p->lower = calloc(m + 1, sizeof(double));
  p->upper = calloc(m + 1, sizeof(double));
  p->row = calloc(m + 1, sizeof(size_t));
  p->identity = calloc(n, sizeof(uint32_t));
  p->x = calloc(n, sizeof(double));
  p->y = calloc(m + 1, sizeof(double));
  p->active = calloc(m + 1, 1);
  for (size_t i = 0; i < n; i++) {
    p->r[i + i * n] = 1;
    p->identity[i] = (uint32_t)i;
  }
  for (size_t k = 0; k < m; k++) {
    p->row[k] = k;
    p->lower[k] = -INFINITY;
    p->upper[k] = INFINITY;
  }
  return p;
}

static void program_free(program *p) {
  free(p->r);
  free(p->c);
  free(p->dense);
  free(p->scale);
  free(p->lower);
  free(p->upper);
  free(p->row);
  free(p->identity);
  free(p->x);
  free(p->y);
  free(p->active);
  free(p);
}

/* After the rows' entries are set: lengths. lower and upper are of the rows of length 1. */
static void program_connect(program *p) {
  for (size_t k = 0; k < p->m; k++) {
    double square = 0;
    for (size_t j = 0; j < p->n; j++) square += p->dense[k * p->n + j] * p->dense[k * p->n + j];
    p->scale[k] = 1 / sqrt(square);
  }
  p->matrix = batten_matrix_dense(p->m, p->n, p->dense);
  p->rows = (qp_rows){p->n, p->m, &p->matrix, p->row, p->identity, p->scale, p->lower, p->upper};
  p->objective = (qp_dense){p->n, p->r, p->c};
}

static double row_dot(const program *p, size_t k, const double *x) {
  double sum = 0;
  for (size_t j = 0; j < p->n; j++) sum += p->scale[k] * p->dense[k * p->n + j] * x[j];
  return sum;
}

static void objective_gradient(const program *p, const double *x, double *value, double *g) {
  size_t n = p->n;
  *value = 0;
  for (size_t j = 0; j < n; j++) g[j] = 0;
  for (size_t i = 0; i < n; i++) {
    double w = -p->c[i];
    for (size_t j = i; j < n; j++) w += p->r[i + j * n] * x[j];
    *value += w * w / 2;
    for (size_t j = i; j < n; j++) g[j] += p->r[i + j * n] * w;
  }
}

static double random_symmetric(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }

/* R with condition about the given one, and rows of random directions and lengths. */
static program *random_program(size_t n, size_t m, double condition, uint64_t *seed) {
  program *p = program_new(n, m);
  for (size_t j = 0; j < n; j++) {
    double size = pow(condition, -(double)(t_random(seed) % (n + 1)) / (double)n);
    for (size_t i = 0; i < j; i++) p->r[i + j * n] = size * random_symmetric(seed) / sqrt((double)n);
    p->r[j + j * n] = size * (1 + t_uniform(seed));
    p->c[j] = random_symmetric(seed);
  }
  for (size_t k = 0; k < m; k++) {
    double length = ldexp(1, (int)(t_random(seed) % 40) - 20);
    for (size_t j = 0; j < n; j++) p->dense[k * n + j] = length * random_symmetric(seed);
  }
  program_connect(p);
  return p;
}

typedef struct measure {
  double primal, dual,
      wrong; /* relative violation, |gradient - sum y a|, largest y against its sign or off its side */
} measure;

static measure judge(const program *p) {
  size_t n = p->n;
  measure r = {0};
  double *g = malloc(n * sizeof *g), value, gsize = 0, xsize = 0, csize = 0;
  objective_gradient(p, p->x, &value, g);
  for (size_t j = 0; j < n; j++) xsize = fmax(xsize, fabs(p->x[j])), csize += p->c[j] * p->c[j];
  for (size_t j = 0; j < n; j++) {
    double column = 0, part = fabs(g[j]);
    for (size_t i = 0; i <= j; i++) column += p->r[i + j * n] * p->r[i + j * n];
    for (size_t k = 0; k < p->m; k++) part = fmax(part, fabs(p->y[k] * p->scale[k] * p->dense[k * n + j]));
    gsize = fmax(gsize, fmax(part, sqrt(column * csize)));
  }
  double ysize = DBL_MIN;
  for (size_t k = 0; k < p->m; k++) ysize = fmax(ysize, fabs(p->y[k]));
  for (size_t k = 0; k < p->m; k++) {
    double v = row_dot(p, k, p->x), out = fmax(0, fmax(p->lower[k] - v, v - p->upper[k]));
    r.primal = fmax(r.primal, out / (xsize + fmin(fabs(p->lower[k]), fabs(p->upper[k])) + DBL_MIN));
    double side = p->y[k] > 0 ? p->lower[k] : p->upper[k];
    if (p->y[k] != 0)
      r.wrong = fmax(r.wrong, fmin(fabs(p->y[k]) / ysize, fabs(v - side) / (xsize + fabs(v) + DBL_MIN)));
    for (size_t j = 0; j < n; j++) g[j] -= p->y[k] * p->scale[k] * p->dense[k * n + j];
  }
  for (size_t j = 0; j < n; j++) r.dual = fmax(r.dual, fabs(g[j]) / gsize);
  free(g);
  return r;
}

static const qp_limits NO_LIMITS = {.iterations = SIZE_MAX, .deadline = INFINITY, .tolerance = 1e-9};

static batten_status solve(batten_context *ctx, program *p, bool have_x, const qp_limits *limits, qp_point *out) {
  qp_point point = {.x = p->x, .y = p->y, .active = p->active, .have_x = have_x};
  batten_status st = qp_primal(ctx, &p->objective, &p->rows, limits, &point);
  if (out) *out = point;
  return st;
}

/* ---- Against all working sets ---- */

/* Gauss elimination with full columns pivots on a [q][q + 1]; false when singular. */
static bool eliminate(size_t q, double *a, double *out) {
  for (size_t i = 0; i < q; i++) {
    size_t best = i;
    for (size_t l = i; l < q; l++)
      if (fabs(a[l * (q + 1) + i]) > fabs(a[best * (q + 1) + i])) best = l;
    if (fabs(a[best * (q + 1) + i]) < 1e-11) return false;
    for (size_t j = 0; j <= q; j++) {
      double t = a[i * (q + 1) + j];
      a[i * (q + 1) + j] = a[best * (q + 1) + j];
      a[best * (q + 1) + j] = t;
    }
    for (size_t l = 0; l < q; l++) {
      double f = l == i ? 0 : a[l * (q + 1) + i] / a[i * (q + 1) + i];
      for (size_t j = i; j <= q; j++) a[l * (q + 1) + j] -= f * a[i * (q + 1) + j];
    }
  }
  for (size_t i = 0; i < q; i++) out[i] = a[i * (q + 1) + q] / a[i * (q + 1) + i];
  return true;
}

/* The least objective over all choices of up to n rows with lower sides whose minimiser is feasible. */
static double least_of_all(const program *p, double *x) {
  enum { MOST = 12 };
  size_t n = p->n;
  double least = INFINITY, best[4] = {0};
  for (unsigned mask = 0; mask < 1u << p->m; mask++) {
    size_t members[MOST], q = 0;
    for (size_t k = 0; k < p->m; k++)
      if (mask >> k & 1) members[q++] = k;
    if (q > n) continue;
    size_t all = n + q;
    double a[MOST * (MOST + 1)] = {0}, out[MOST], g[4], value;
    for (size_t i = 0; i < n; i++) {
      for (size_t j = 0; j < n; j++)
        for (size_t l = 0; l < n; l++) a[i * (all + 1) + j] += p->r[l + i * n] * p->r[l + j * n];
      for (size_t l = 0; l < n; l++) a[i * (all + 1) + all] += p->r[l + i * n] * p->c[l];
      for (size_t l = 0; l < q; l++) {
        double entry = p->scale[members[l]] * p->dense[members[l] * n + i];
        a[i * (all + 1) + n + l] = a[(n + l) * (all + 1) + i] = entry;
      }
    }
    for (size_t l = 0; l < q; l++) a[(n + l) * (all + 1) + all] = p->lower[members[l]];
    if (!eliminate(all, a, out)) continue;
    bool feasible = true;
    for (size_t k = 0; k < p->m; k++) feasible = feasible && row_dot(p, k, out) >= p->lower[k] - 1e-10;
    if (!feasible) continue;
    objective_gradient(p, out, &value, g);
    if (value < least) {
      least = value;
      for (size_t j = 0; j < n; j++) best[j] = out[j];
    }
  }
  for (size_t j = 0; j < n; j++) x[j] = best[j];
  return least;
}

static void test_all_working_sets(batten_context *ctx) {
  uint64_t seed = 11;
  double far = 0;
  size_t infeasible = 0, differ = 0;
  measure worst = {0};
  for (int t = 0; t < 400; t++) {
    size_t n = 1 + t_random(&seed) % 4, m = 1 + t_random(&seed) % 8;
    program *p = random_program(n, m, 1, &seed);
    for (size_t k = 0; k < m; k++)
      p->lower[k] = t % 3 == 0 ? 0 : t % 3 == 1 ? random_symmetric(&seed) : t_uniform(&seed);
    double x[4], value, g[4], least = least_of_all(p, x);
    qp_point point;
    batten_status st = solve(ctx, p, false, &NO_LIMITS, &point);
    if (st == BATTEN_E_INFEASIBLE) {
      infeasible++;
      double sum[4] = {0}, sides = 0;
      for (size_t k = 0; k < m; k++) {
        sides += p->y[k] * p->lower[k];
        differ += p->y[k] < 0 ? 1 : 0;
        for (size_t j = 0; j < n; j++) sum[j] += p->y[k] * p->scale[k] * p->dense[k * n + j];
      }
      for (size_t j = 0; j < n; j++) differ += fabs(sum[j]) > 1e-12 ? 1 : 0;
      differ += sides > 1e-12 ? 0 : 1;
      differ += isfinite(least) ? 1 : 0;
    } else {
      differ += st != BATTEN_OK || !isfinite(least) ? 1 : 0;
      objective_gradient(p, p->x, &value, g);
      for (size_t j = 0; j < n; j++) far = fmax(far, fabs(p->x[j] - x[j]) / (1 + fabs(x[j])));
      measure r = judge(p);
      worst = (measure){fmax(worst.primal, r.primal), fmax(worst.dual, r.dual), fmax(worst.wrong, r.wrong)};
    }
    program_free(p);
  }
  T_CHECK(differ == 0,
          "400 programs of up to 4 unknowns: %zu verdicts differ from trying all working sets; %zu infeasible, "
          "each with a proof",
          differ, infeasible);
  T_RATIO(far, 1e-9, "solutions differ");
  T_RATIO(worst.primal, 1e-13, "rows");
  T_RATIO(worst.dual, 1e-13, "gradient");
  T_RATIO(worst.wrong, 1e-13, "multipliers");
}

/* ---- Known solutions ---- */

/* Sides such that a random x is the solution with `members` rows active, `extra` more met with zero multiplier and
 * the rest apart by up to 1. */
static program *known_program(size_t n, size_t m, size_t members, size_t extra, double condition, double *x,
                              uint64_t *seed) {
  program *p = random_program(n, m, condition, seed);
  double *g = calloc(n, sizeof *g);
  for (size_t j = 0; j < n; j++) x[j] = random_symmetric(seed);
  for (size_t k = 0; k < m; k++) {
    double v = row_dot(p, k, x), y = k < members ? 0.1 + t_uniform(seed) : 0;
    bool met = k < members + extra, upper = t_random(seed) % 2, both = t_random(seed) % 4 == 0;
    double gap = met ? 0 : t_uniform(seed);
    if (upper) p->upper[k] = v + gap;
    if (!upper) p->lower[k] = v - gap;
    if (both && upper) p->lower[k] = v - 1 - t_uniform(seed);
    if (both && !upper) p->upper[k] = v + 1 + t_uniform(seed);
    if (k < members && k % 5 == 4) p->lower[k] = p->upper[k] = v;
    for (size_t j = 0; j < n; j++) g[j] += (upper ? -y : y) * p->scale[k] * p->dense[k * n + j];
  }
  /* R'(R x - c) = g */
  for (size_t i = 0; i < n; i++) {
    for (size_t l = 0; l < i; l++) g[i] -= p->r[l + i * n] * g[l];
    g[i] /= p->r[i + i * n];
    p->c[i] = -g[i];
    for (size_t j = i; j < n; j++) p->c[i] += p->r[i + j * n] * x[j];
  }
  free(g);
  return p;
}

static void test_known(batten_context *ctx) {
  static const struct {
    size_t n, m, members, extra;
    double condition;
  } CASES[] = {{5, 40, 3, 0, 1},        {20, 100, 10, 0, 10},   {20, 2000, 15, 5, 10},   {40, 300, 40, 30, 1e2},
               {10, 500, 10, 60, 1},    {60, 3000, 30, 0, 1e2}, {48, 6000, 25, 20, 1e3}, {30, 100, 0, 0, 1e4},
               {100, 400, 70, 10, 1e3}, {12, 30, 8, 4, 1e5}};
  uint64_t seed = 5;
  for (size_t t = 0; t < sizeof CASES / sizeof *CASES; t++) {
    size_t n = CASES[t].n, failed = 0, pivots = 0;
    double *x = malloc(n * sizeof *x), far = 0, started = batten_now();
    measure worst = {0};
    for (int times = 0; times < 5; times++) {
      program *p = known_program(n, CASES[t].m, CASES[t].members, CASES[t].extra, CASES[t].condition, x, &seed);
      qp_point point;
      batten_status st = solve(ctx, p, false, &NO_LIMITS, &point);
      failed += st != BATTEN_OK || !point.have_x;
      if (st != BATTEN_OK) printf("# %s %s\n", batten_status_name(st), batten_error(ctx));
      pivots += point.iterations;
      for (size_t j = 0; j < n; j++) far = fmax(far, fabs(p->x[j] - x[j]));
      measure r = judge(p);
      worst = (measure){fmax(worst.primal, r.primal), fmax(worst.dual, r.dual), fmax(worst.wrong, r.wrong)};
      program_free(p);
    }
    T_CHECK(failed == 0 && worst.primal < 1e-12 && worst.dual < 1e-11 && worst.wrong < 1e-12 &&
                far < 1e-12 * CASES[t].condition * CASES[t].condition + 1e-10,
            "n %zu, m %zu, %zu active, condition %g: %zu fail, rows %.1e, gradient %.1e, multipliers %.1e, x %.1e; "
            "%zu pivots, %.2f ms",
            n, CASES[t].m, CASES[t].members, CASES[t].condition, failed, worst.primal, worst.dual, worst.wrong, far,
            pivots / 5, (batten_now() - started) / 5 * 1e3);
    free(x);
  }
}

/* ---- Stopped on the way ---- */

static double violation(const program *p, const double *x) {
  double most = 0;
  for (size_t k = 0; k < p->m; k++) {
    double v = row_dot(p, k, x);
    most = fmax(most, fmax(p->lower[k] - v, v - p->upper[k]));
  }
  return most;
}

/* A start inside: half of the way from the solution of known_program() into the feasible set is not known, so rows
 * are given sides around a random point. */
static program *program_around(size_t n, size_t m, double *inside, uint64_t *seed) {
  program *p = random_program(n, m, 10, seed);
  for (size_t j = 0; j < n; j++) {
    inside[j] = random_symmetric(seed);
    p->c[j] *= 100;
  }
  for (size_t k = 0; k < m; k++) {
    double v = row_dot(p, k, inside), gap = k % 3 ? t_uniform(seed) : 0;
    if (k % 2) p->lower[k] = v - gap;
    if (k % 2 == 0 || k % 7 == 0) p->upper[k] = v + gap;
  }
  return p;
}

static void test_stopped(batten_context *ctx) {
  static const size_t SIZES[][2] = {{6, 20}, {15, 60}, {15, 600}};
  uint64_t seed = 3;
  for (size_t t = 0; t < sizeof SIZES / sizeof *SIZES; t++) {
    size_t n = SIZES[t][0], wrong = 0, stops = 0, rises = 0;
    double inside[15], g[15], most = 0, last = INFINITY;
    program *p = program_around(n, SIZES[t][1], inside, &seed);
    for (batten_status st = BATTEN_E_LIMIT; st == BATTEN_E_LIMIT; stops++) {
      qp_limits limits = NO_LIMITS;
      qp_point point;
      limits.iterations = stops;
      memcpy(p->x, inside, n * sizeof *inside);
      memset(p->active, 0, p->m);
      st = solve(ctx, p, true, &limits, &point);
      wrong += (st != BATTEN_E_LIMIT && st != BATTEN_OK) || !point.have_x ? 1 : 0;
      most = fmax(most, violation(p, p->x));
      double value;
      objective_gradient(p, p->x, &value, g);
      rises += value > last + 1e-13 * (1 + fabs(last)) ? 1 : 0;
      last = value;
    }
    T_CHECK(wrong == 0 && rises == 0 && stops > 3,
            "n %zu, m %zu stopped after each of %zu counts of pivots: %zu rises, %zu without a point", n, p->m, stops,
            rises, wrong);
    T_RATIO(most, 1e-14, "every one of these points holds");
    program_free(p);
  }
}

static void test_cancelled(void) {
  uint64_t seed = 4;
  double inside[12];
  program *p = program_around(12, 200, inside, &seed);
  size_t wrong = 0, calls = 0;
  double most = 0;
  for (batten_status st = BATTEN_E_CANCELLED; st == BATTEN_E_CANCELLED;) {
    t_progress progress = {.cancel_at = ++calls};
    batten_context *ctx = t_context(NULL, &progress, 1);
    qp_point point;
    memcpy(p->x, inside, sizeof inside);
    memset(p->active, 0, p->m);
    st = solve(ctx, p, true, &NO_LIMITS, &point);
    wrong += (st != BATTEN_E_CANCELLED && st != BATTEN_OK) || !point.have_x ? 1 : 0;
    most = fmax(most, violation(p, p->x));
    batten_context_free(ctx);
  }
  T_CHECK(wrong == 0 && calls > 3 && most <= 1e-14,
          "cancelled at each of %zu calls: a point that holds to %.1e is left", calls - 1, most);
  program_free(p);
}

/* A convex patch through the public call, stopped after each count of pivots: all right sides are 0, rows are many
 * and nearly parallel, the start is strictly feasible. */
static void test_patch(batten_context *ctx) {
  enum { N = 48 };
  qp_scene *s = qp_scene_patch(0, false, 7);
  size_t wrong = 0, stops = 0, rises = 0;
  double most = 0, last = INFINITY, optimum[2];
  batten_qp_options o = batten_qp_options_default();
  o.engine = BATTEN_QP_PRIMAL;
  o.x0 = s->start;
  for (batten_status st = BATTEN_W_STOPPED; st == BATTEN_W_STOPPED;) {
    double x[N];
    batten_qp_solution solution = {.x = x};
    batten_qp_info info;
    o.iteration_limit = ++stops;
    st = batten_qp_solve(ctx, &s->problem, &o, NULL, &solution, &info);
    wrong += st != BATTEN_OK && st != BATTEN_W_STOPPED ? 1 : 0;
    for (size_t k = 0; k < s->c.rows; k++) {
      double length = 0;
      for (size_t j = 0; j < N; j++) length += s->c.dense[k * N + j] * s->c.dense[k * N + j];
      most = fmax(most, -(double)qp_scene_dot(&s->c, k, x) / sqrt(length));
    }
    rises += info.objective > last * (1 + 1e-12) ? 1 : 0;
    last = optimum[0] = info.objective;
  }
  T_CHECK(wrong == 0 && rises == 0 && stops > 10 && most <= 1e-14,
          "convex patch stopped after each of %zu counts of pivots: %zu rises, rows off by %.1e", stops, rises, most);
  batten_qp_info info;
  o = batten_qp_options_default();
  o.engine = BATTEN_QP_DUAL;
  T_OK(batten_qp_solve(ctx, &s->problem, &o, NULL, NULL, &info), ctx);
  optimum[1] = info.objective;
  T_RATIO(fabs(optimum[0] / optimum[1] - 1), 1e-12, "objective beside the dual engine's");
  qp_scene_free(s);
}

/* ---- Degenerate vertices ---- */

/* min g'x + rho/2 |x|^2 over rows a x <= b and x >= 0, from x = 0. */
static void cycling_example(batten_context *ctx, const char *name, size_t n, size_t m, const double *g,
                            const double *a, const double *b, double value, const double *x) {
  const double RHO = 0x1p-12;
  program *p = program_new(n, m + n);
  for (size_t j = 0; j < n; j++) {
    p->r[j + j * n] = sqrt(RHO);
    p->c[j] = -g[j] / sqrt(RHO);
    p->dense[(m + j) * n + j] = 1;
    p->lower[m + j] = 0;
  }
  memcpy(p->dense, a, m * n * sizeof *a);
  program_connect(p);
  for (size_t k = 0; k < m; k++) p->upper[k] = b[k] * p->scale[k];
  for (int have_x = 0; have_x < 2; have_x++) {
    qp_point point;
    memset(p->x, 0, n * sizeof *p->x);
    memset(p->active, 0, p->m);
    batten_status st = solve(ctx, p, have_x, &NO_LIMITS, &point);
    double reached = 0, far = 0;
    for (size_t j = 0; j < n; j++) {
      reached += g[j] * p->x[j];
      far = fmax(far, fabs(p->x[j] - x[j]));
    }
    measure r = judge(p);
    T_CHECK(st == BATTEN_OK && fabs(reached - value) < 1e-14 && far < 1e-13 && r.dual < 1e-14 && r.primal < 1e-14 &&
                r.wrong < 1e-14,
            "%s, where the simplex method cycles, %s: %zu pivots, value %.15g", name,
            have_x ? "from the degenerate vertex" : "cold", point.iterations, reached);
  }
  program_free(p);
}

static void test_cycling(batten_context *ctx) {
  static const double BEALE_G[] = {-0.75, 150, -0.02, 6}, BEALE_B[] = {0, 0, 1}, BEALE_X[] = {0.04, 0, 1, 0};
  static const double BEALE_A[] = {0.25, -60, -0.04, 9, 0.5, -90, -0.02, 3, 0, 0, 1, 0};
  cycling_example(ctx, "Beale", 4, 3, BEALE_G, BEALE_A, BEALE_B, -0.05, BEALE_X);
  static const double MS_G[] = {-0.4, -0.4, 1.8}, MS_B[] = {0, 0, 0, 1}, MS_X[] = {4, 1, 0};
  static const double MS_A[] = {0.6, -6.4, 4.8, 0.2, -1.8, 0.6, 0.4, -1.6, 0.2, 0, 1, 0};
  cycling_example(ctx, "Marshall and Suurballe", 3, 4, MS_G, MS_A, MS_B, -2, MS_X);
}

/* Many more planes than unknowns through the start, the optimum being the start itself, or elsewhere on some of them.
 */
static void test_degenerate(batten_context *ctx) {
  uint64_t seed = 21;
  size_t failed = 0, most = 0;
  measure worst = {0};
  for (int t = 0; t < 60; t++) {
    size_t n = 2 + t_random(&seed) % 9, m = 5 * n;
    program *p = random_program(n, m, 1, &seed);
    for (size_t j = 0; j < n; j++) p->x[j] = t % 2 ? random_symmetric(&seed) : (double)(t_random(&seed) % 9) - 4;
    for (size_t k = 0; k < m; k++) {
      if (t % 3 == 0) /* integer normals: planes coincide and depend on each other exactly */
        for (size_t j = 0; j < n; j++) p->dense[k * n + j] = (double)(t_random(&seed) % 3) - 1;
      p->dense[k * n] += k % 2 == 0 && t % 3 == 0 ? 2 : 0;
      bool zero = true;
      for (size_t j = 0; j < n; j++) zero = zero && p->dense[k * n + j] == 0;
      if (zero) p->dense[k * n + n - 1] = 1;
      if (t % 4 >= 2 && p->dense[k * n] < 0) /* a cone with room */
        for (size_t j = 0; j < n; j++) p->dense[k * n + j] *= -1;
    }
    program_connect(p);
    for (size_t k = 0; k < m; k++) p->lower[k] = row_dot(p, k, p->x);
    qp_point point;
    batten_status st = solve(ctx, p, true, &NO_LIMITS, &point);
    failed += st != BATTEN_OK || !point.have_x ? 1 : 0;
    most = point.iterations > most ? point.iterations : most;
    measure r = judge(p);
    worst = (measure){fmax(worst.primal, r.primal), fmax(worst.dual, r.dual), fmax(worst.wrong, r.wrong)};
    program_free(p);
  }
  T_CHECK(failed == 0 && worst.primal < 1e-13 && worst.dual < 1e-13 && worst.wrong < 1e-13,
          "60 starts where 5 n planes meet: %zu fail, rows %.1e, gradient %.1e, multipliers %.1e; at most %zu pivots",
          failed, worst.primal, worst.dual, worst.wrong, most);
}

/* 40 half-spaces in R^5 through 0 that leave 0 alone. */
static void test_collapsed_cone(batten_context *ctx) {
  uint64_t seed = 31;
  size_t failed = 0;
  double far = 0;
  for (int t = 0; t < 30; t++) {
    program *p = random_program(5, 40, 1, &seed);
    for (size_t k = 0; k < 40; k++) p->lower[k] = 0;
    qp_point point;
    for (size_t j = 0; j < 5; j++) p->x[j] = t % 3 == 1 ? 0 : random_symmetric(&seed);
    batten_status st = solve(ctx, p, t % 3 > 0, &NO_LIMITS, &point);
    failed += st != BATTEN_OK || !point.have_x ? 1 : 0;
    for (size_t j = 0; j < 5; j++) far = fmax(far, fabs(p->x[j]));
    program_free(p);
  }
  T_CHECK(failed == 0 && far < 1e-14, "30 cones of 40 half-spaces that are a point: %zu fail, |x| %.1e", failed, far);
}

/* ---- Equalities ---- */

static void test_equalities(batten_context *ctx) {
  uint64_t seed = 41;
  size_t failed = 0, unproven = 0;
  double far = 0;
  for (int t = 0; t < 60; t++) {
    size_t n = 6, m = 9;
    bool contradict = t % 2;
    program *p = random_program(n, m, 1, &seed);
    double x[6];
    for (size_t j = 0; j < n; j++) x[j] = random_symmetric(&seed);
    /* rows 0 .. 2 free, 3 and 4 made up of them, the rest inequalities; the solution is x */
    for (size_t j = 0; j < n; j++) {
      p->dense[3 * n + j] = p->dense[j] / 3 + p->dense[n + j] * p->scale[1] / p->scale[0];
      p->dense[4 * n + j] = -7 * p->dense[2 * n + j];
    }
    program_connect(p);
    for (size_t k = 0; k < m; k++) {
      p->lower[k] = row_dot(p, k, x) - (k > 4 ? t_uniform(&seed) : 0);
      if (k <= 4) p->upper[k] = p->lower[k];
    }
    if (contradict) p->lower[3] = p->upper[3] = p->lower[3] + 1e-6 * (t % 4 ? 1 : -1);
    qp_point point;
    batten_status st = solve(ctx, p, t % 3 == 0, &NO_LIMITS, &point);
    failed += st != (contradict ? BATTEN_E_INFEASIBLE : BATTEN_OK) ? 1 : 0;
    if (st == BATTEN_E_INFEASIBLE) {
      double sum = 0, sides = 0;
      for (size_t j = 0; j < n; j++) {
        double part = 0;
        for (size_t k = 0; k < m; k++) part += p->y[k] * p->scale[k] * p->dense[k * n + j];
        sum = fmax(sum, fabs(part));
      }
      for (size_t k = 0; k < m; k++) sides += p->y[k] * (p->y[k] > 0 ? p->lower[k] : p->y[k] < 0 ? p->upper[k] : 0);
      unproven += sum > 1e-13 || !(sides > 1e-8) ? 1 : 0;
    } else {
      for (size_t k = 0; k < 5; k++) far = fmax(far, fabs(row_dot(p, k, p->x) - p->lower[k]));
      measure r = judge(p);
      far = fmax(far, fmax(r.dual, r.wrong));
    }
    program_free(p);
  }
  T_CHECK(
      failed == 0 && unproven == 0 && far < 1e-13,
      "60 times dependent equalities, half of them contradicting by 1e-6: %zu fail, %zu without proof, off by %.1e",
      failed, unproven, far);
}

/* ---- By hand, again, scaled ---- */

static void test_by_hand(batten_context *ctx) {
  /* The point of x + y <= 1, x - 2 y <= 1 that is nearest to (3, 0): the vertex (1, 0); gradient (-2, 0) =
   * -4/3 (1, 1) - 2/3 (1, -2). */
  program *p = program_new(2, 2);
  p->c[0] = 3;
  p->dense[0] = p->dense[1] = p->dense[2] = 1;
  p->dense[3] = -2;
  program_connect(p);
  p->upper[0] = 1 / sqrt(2);
  p->upper[1] = 1 / sqrt(5);
  qp_point point;
  T_OK(solve(ctx, p, false, &NO_LIMITS, &point), ctx);
  double off =
      fabs(p->x[0] - 1) + fabs(p->x[1]) + fabs(p->y[0] + 4. / 3 * sqrt(2)) + fabs(p->y[1] + 2. / 3 * sqrt(5));
  T_RATIO(off, 1e-15 * 8, "the corner (1, 0) and its multipliers");
  T_CHECK(p->active[0] == QP_UPPER && p->active[1] == QP_UPPER && point.have_x, "both rows are at their upper sides");
  program_free(p);
}

static void test_scaled(batten_context *ctx) {
  uint64_t seed = 51;
  double inside[15];
  program *p = program_around(15, 80, inside, &seed);
  size_t differ = 0, last = 0;
  double first[15];
  for (int power = 0; power <= 60; power += 30) {
    double unit = ldexp(1, power);
    for (size_t j = 0; j < 15; j++) p->x[j] = unit * inside[j], p->c[j] *= power ? 0x1p30 : 1;
    for (size_t k = 0; k < p->m; k++) p->lower[k] *= power ? 0x1p30 : 1, p->upper[k] *= power ? 0x1p30 : 1;
    memset(p->active, 0, p->m);
    qp_point point;
    differ += solve(ctx, p, true, &NO_LIMITS, &point) != BATTEN_OK ? 1 : 0;
    for (size_t j = 0; j < 15 && power; j++) differ += p->x[j] != unit * first[j] ? 1 : 0;
    differ += power && point.iterations != last ? 1 : 0;
    if (!power) memcpy(first, p->x, sizeof first);
    last = point.iterations;
  }
  T_CHECK(differ == 0, "sides and target times 2^30, 2^60: the same bits but for the exponent, in %zu pivots", last);
  program_free(p);
}

/* Data moved by 1 %, from the working set of before. */
static void test_warm(batten_context *ctx) {
  uint64_t seed = 61;
  size_t cold = 0, warm = 0, again = 0, failed = 0;
  for (int t = 0; t < 10; t++) {
    double x[40];
    program *p = known_program(40, t % 2 ? 120 : 1200, 20, 0, 10, x, &seed);
    qp_point point;
    failed += solve(ctx, p, false, &NO_LIMITS, &point) != BATTEN_OK ? 1 : 0;
    cold += point.iterations;
    failed += solve(ctx, p, true, &NO_LIMITS, &point) != BATTEN_OK ? 1 : 0;
    again += point.iterations;
    for (size_t j = 0; j < 40; j++) p->c[j] *= 1 + 0.01 * random_symmetric(&seed);
    failed += solve(ctx, p, false, &NO_LIMITS, &point) != BATTEN_OK ? 1 : 0;
    warm += point.iterations;
    measure r = judge(p);
    failed += r.primal > 1e-13 || r.dual > 1e-13 || r.wrong > 1e-13 ? 1 : 0;
    program_free(p);
  }
  T_CHECK(failed == 0 && again <= 40, "solved again from the solution: %zu pivots of %zu", again, cold);
  T_RATIO((double)warm, 0.2 * (double)cold, "pivots after a change by 1 %%");
}

/* ---- Memory ---- */

static batten_status solve_once(batten_context *ctx, void *arg) {
  program *p = arg;
  memset(p->active, 0, p->m);
  return solve(ctx, p, false, &NO_LIMITS, NULL);
}

static void test_memory(void) {
  uint64_t seed = 71;
  double x[20];
  program *p = known_program(20, 200, 10, 0, 10, x, &seed);
  t_fail_every_allocation("qp_primal", solve_once, p);
  qp_cost cost = qp_primal_cost(&p->rows);
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_bytes_peak_reset(ctx);
  solve_once(ctx, p);
  size_t peak = batten_bytes_peak(ctx);
  T_CHECK(peak <= cost.bytes && 2 * peak > cost.bytes, "%zu bytes held, %zu foretold", peak, cost.bytes);
  batten_context_free(ctx);
  program_free(p);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_all_working_sets(ctx);
  test_known(ctx);
  test_stopped(ctx);
  test_cancelled();
  test_patch(ctx);
  test_cycling(ctx);
  test_degenerate(ctx);
  test_collapsed_cone(ctx);
  test_equalities(ctx);
  test_scaled(ctx);
  test_warm(ctx);
  test_memory();
  batten_context_free(ctx);
  return t_done();
}
