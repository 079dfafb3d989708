/* The primal active set method through its internal interface: by hand, against all working sets tried in turn,
 * against known solutions, stopped after each pivot, at degenerate and cycling vertices, without a feasible point. */
#include <float.h>

#include "qp/engine.h"
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

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_all_working_sets(ctx);
  test_known(ctx);
  batten_context_free(ctx);
  return t_done();
}
