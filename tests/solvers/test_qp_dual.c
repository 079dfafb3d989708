/* Dual engine: problems by hand, with known solutions, against the enumeration of all working sets; dependent,
 * duplicate, degenerate and contradicting rows; warm starts, limits, cancelling, threads. */
#include <float.h>

#include "qp/engine.h"
#include "tap.h"

static double random_symmetric(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }

/* A problem with dense rows of any length, which the core sees scaled to one. */
typedef struct problem {
  size_t n, m;
  double *r, *c, *dense, *scale, *lower, *upper;
  size_t *row;
  uint32_t *identity;
  batten_matrix matrix;
} problem;

static problem make_problem(size_t n, size_t m) {
  problem p = {.n = n, .m = m};
  p.r = calloc(n * n, sizeof *p.r);
  p.c = calloc(n, sizeof *p.c);
  p.dense = calloc(m * n + 1, sizeof *p.dense);
  p.scale = malloc((m + 1) * sizeof *p.scale);
  p.lower = malloc((m + 1) * sizeof *p.lower);
  p.upper = malloc((m + 1) * sizeof *p.upper);
  p.row = malloc((m + 1) * sizeof *p.row);
  p.identity = malloc(n * sizeof *p.identity);
  for (size_t i = 0; i < n; i++) p.r[i + i * n] = 1, p.identity[i] = (uint32_t)i;
  for (size_t k = 0; k < m; k++) p.row[k] = k, p.lower[k] = 0, p.upper[k] = INFINITY;
  return p;
}

static void free_problem(problem *p) {
  free(p->r);
  free(p->c);
  free(p->dense);
  free(p->scale);
  free(p->lower);
  free(p->upper);
  free(p->row);
  free(p->identity);
}

/* Scales lower and upper with the rows: call once, when they are complete. */
static qp_rows rows_of(problem *p) {
  for (size_t k = 0; k < p->m; k++) {
    double square = 0;
    for (size_t j = 0; j < p->n; j++) square += p->dense[k * p->n + j] * p->dense[k * p->n + j];
    p->scale[k] = 1 / sqrt(square);
    p->lower[k] *= p->scale[k];
    p->upper[k] *= p->scale[k];
  }
  p->matrix = batten_matrix_dense(p->m, p->n, p->dense);
  return (qp_rows){p->n, p->m, &p->matrix, p->row, p->identity, p->scale, p->lower, p->upper};
}

static void random_factor(problem *p, double condition, uint64_t *seed) {
  for (size_t j = 0; j < p->n; j++) {
    double size = pow(condition, -(double)j / (double)(p->n > 1 ? p->n - 1 : 1));
    for (size_t i = 0; i < j; i++) p->r[i + j * p->n] = 0.3 * size * random_symmetric(seed);
    p->r[j + j * p->n] = size;
  }
}

static void random_rows(problem *p, uint64_t *seed) {
  for (size_t e = 0; e < p->m * p->n; e++) p->dense[e] = random_symmetric(seed);
}

typedef struct answer {
  double *x, *y;
  signed char *active;
  qp_point point;
  batten_status status;
} answer;

static answer new_answer(const problem *p) {
  answer a = {calloc(p->n, sizeof *a.x), calloc(p->m + 1, sizeof *a.y), calloc(p->m + 1, 1), {0}, BATTEN_OK};
  return a;
}
static void free_answer(answer *a) {
  free(a->x);
  free(a->y);
  free(a->active);
}

static void run(batten_context *ctx, const problem *p, const qp_rows *rows, answer *a) {
  qp_dense objective = {p->n, p->r, p->c};
  qp_limits limits = {.iterations = SIZE_MAX, .deadline = INFINITY, .tolerance = 1e-9};
  a->point = (qp_point){.x = a->x, .y = a->y, .active = a->active};
  a->status = qp_dual(ctx, &objective, rows, &limits, &a->point);
}

typedef struct residuals {
  double primal, dual, signs, gap;
} residuals;

/* Of an answer: largest violation; |R'(Rx - c) - sum y a| relative to its terms; largest multiplier of the wrong sign
 * or away from its side; sum |y| (distance from its side). */
static residuals judge(const problem *p, const qp_rows *rows, const answer *a) {
  residuals res = {0};
  size_t n = p->n;
  double *miss = malloc(n * sizeof *miss), *gradient = calloc(n, sizeof *gradient), size = DBL_MIN;
  for (size_t i = 0; i < n; i++) {
    miss[i] = -p->c[i];
    for (size_t j = i; j < n; j++) miss[i] += p->r[i + j * n] * a->x[j];
  }
  for (size_t j = 0; j < n; j++) {
    double terms = 0;
    for (size_t i = 0; i <= j; i++) {
      gradient[j] += p->r[i + j * n] * miss[i];
      terms += fabs(p->r[i + j * n]) * (fabs(miss[i]) + fabs(p->c[i]));
    }
    size = fmax(size, terms);
  }
  for (size_t k = 0; k < p->m; k++) {
    double value = qp_rows_dot(rows, k, a->x), y = a->y[k];
    res.primal = fmax(res.primal, fmax(rows->lower[k] - value, value - rows->upper[k]));
    if (y != 0) {
      qp_rows_add(rows, k, -y, gradient);
      double side = y > 0 ? rows->lower[k] : rows->upper[k];
      if (!isfinite(side) || a->active[k] == QP_FREE) res.signs = fmax(res.signs, fabs(y));
      res.gap += fabs(y * (value - side));
      size = fmax(size, fabs(y));
    }
  }
  for (size_t j = 0; j < n; j++) res.dual = fmax(res.dual, fabs(gradient[j]) / size);
  free(miss);
  free(gradient);
  return res;
}

static void check_answer(const problem *p, const qp_rows *rows, const answer *a, const char *what) {
  residuals r = judge(p, rows, a);
  double size = 1;
  for (size_t j = 0; j < p->n; j++) size = fmax(size, fabs(a->x[j]));
  bool ok = a->status == BATTEN_OK && a->point.have_x && r.primal <= 1e-13 * size && r.dual <= 1e-12 && r.signs == 0;
  T_CHECK(ok, "%s: %s, primal %.2g dual %.2g signs %.2g gap %.2g, %zu pivots", what, batten_status_name(a->status),
          r.primal, r.dual, r.signs, r.gap, a->point.iterations);
}

/* The proof: sum y a = 0 and sum y side > 0. */
static void check_proof(const problem *p, const qp_rows *rows, const answer *a, const char *what) {
  double *sum = calloc(p->n, sizeof *sum), size = 0, left = 0, value = 0;
  for (size_t k = 0; k < p->m; k++) {
    if (a->y[k] == 0) continue;
    qp_rows_add(rows, k, a->y[k], sum);
    size += fabs(a->y[k]);
    value += a->y[k] * (a->y[k] > 0 ? rows->lower[k] : rows->upper[k]);
  }
  for (size_t j = 0; j < p->n; j++) left = fmax(left, fabs(sum[j]));
  T_CHECK(a->status == BATTEN_E_INFEASIBLE && left <= 1e-13 * size && value > 1e-9 * size && !a->point.have_x,
          "%s: %s, sum y a = %.2g, sum y side = %.2g, of |y| = %.2g", what, batten_status_name(a->status), left,
          value, size);
  free(sum);
}

/* ---- By hand ---- */

static void test_hand(batten_context *ctx) {
  problem p = make_problem(2, 3);      /* nearest point to (2, 2) in x + y <= 2, x >= 0.5, y <= 0.25: (1.75, 0.25) */
  double rows[6] = {2, 2, 4, 0, 0, 1}; /* two of them scaled */
  memcpy(p.dense, rows, sizeof rows);
  p.c[0] = p.c[1] = 2;
  p.lower[0] = -INFINITY, p.upper[0] = 4;
  p.lower[1] = 2;
  p.lower[2] = -INFINITY, p.upper[2] = 0.25;
  qp_rows r = rows_of(&p);
  answer a = new_answer(&p);
  run(ctx, &p, &r, &a);
  check_answer(&p, &r, &a, "nearest point");
  T_RATIO(fabs(a.x[0] - 1.75) + fabs(a.x[1] - 0.25), 4 * DBL_EPSILON, "(1.75, 0.25)");
  T_CHECK(a.active[0] == QP_UPPER && a.active[1] == QP_FREE && a.active[2] == QP_UPPER, "active sides");
  T_RATIO(fabs(a.y[0] + 0.25 * sqrt(2)) + fabs(a.y[2] + 1.5), 8 * DBL_EPSILON, "multipliers -1/4 and -3/2");
  free_answer(&a);
  p.c[0] = 1, p.c[1] = 0; /* inside */
  a = new_answer(&p);
  run(ctx, &p, &r, &a);
  T_CHECK(a.status == BATTEN_OK && a.x[0] == 1 && a.x[1] == 0 && a.point.iterations == 0, "inside: no pivot");
  free_answer(&a);
  free_problem(&p);

  problem none = make_problem(3, 0);
  none.c[1] = 7;
  r = rows_of(&none);
  a = new_answer(&none);
  run(ctx, &none, &r, &a);
  T_CHECK(a.status == BATTEN_OK && a.point.have_x && a.x[1] == 7 && a.x[0] == 0, "no rows");
  free_answer(&a);
  free_problem(&none);
}

/* ---- Against enumeration ---- */

/* Solves the system [size][size + 1] by elimination with row pivoting; false when singular. */
static bool eliminate(size_t size, long double *a) {
  for (size_t p = 0; p < size; p++) {
    size_t best = p, w = size + 1;
    for (size_t i = p; i < size; i++)
      if (fabsl(a[i * w + p]) > fabsl(a[best * w + p])) best = i;
    if (fabsl(a[best * w + p]) < 1e-13L) return false;
    for (size_t j = 0; j < w; j++) {
      long double t = a[p * w + j];
      a[p * w + j] = a[best * w + j];
      a[best * w + j] = t;
    }
    for (size_t i = 0; i < size; i++) {
      if (i == p) continue;
      long double f = a[i * w + p] / a[p * w + p];
      for (size_t j = p; j < w; j++) a[i * w + j] -= f * a[p * w + j];
    }
  }
  for (size_t i = 0; i < size; i++) a[i * (size + 1) + size] /= a[i * (size + 1) + i];
  return true;
}

/* Tries every working set of at most n sides: true and x when one is optimal. code: base 3 digits, 0 free, 1 lower, 2
 * upper. */
static bool enumerate(const problem *p, const qp_rows *rows, double *x) {
  size_t n = p->n, m = p->m, codes = 1;
  for (size_t k = 0; k < m; k++) codes *= 3;
  for (size_t code = 0; code < codes; code++) {
    size_t q = 0, member[8];
    double side[8], sign[8];
    bool possible = true;
    for (size_t k = 0, rest = code; k < m && possible; k++, rest /= 3) {
      if (rest % 3 == 0) {
        possible = !qp_rows_is_equality(rows, k);
        continue;
      }
      double bound = rest % 3 == 1 ? rows->lower[k] : rows->upper[k];
      possible = isfinite(bound) && q < n && !(qp_rows_is_equality(rows, k) && rest % 3 == 2);
      if (possible)
        member[q] = k, side[q] = bound, sign[q++] = qp_rows_is_equality(rows, k) ? 0 : rest % 3 == 1 ? 1 : -1;
    }
    if (!possible) continue;
    long double a[8 * 9] = {0}; /* [R'R -N; N' 0] (x, y) = (R'c, side) */
    size_t w = n + q + 1;
    for (size_t i = 0; i < n; i++)
      for (size_t l = 0; l <= i; l++) {
        a[i * w + n + q] += (long double)p->r[l + i * n] * p->c[l];
        for (size_t j = l; j < n; j++) a[i * w + j] += (long double)p->r[l + i * n] * p->r[l + j * n];
      }
    for (size_t s = 0; s < q; s++) {
      for (size_t j = 0; j < n; j++) {
        double entry = rows->scale[member[s]] * p->dense[member[s] * n + j];
        a[j * w + n + s] = -entry;
        a[(n + s) * w + j] = entry;
      }
      a[(n + s) * w + n + q] = side[s];
    }
    if (!eliminate(n + q, a)) continue;
    for (size_t j = 0; j < n; j++) x[j] = (double)a[j * w + n + q];
    bool optimal = true;
    for (size_t s = 0; s < q; s++) optimal = optimal && sign[s] * (double)a[(n + s) * w + n + q] >= -1e-12;
    for (size_t k = 0; k < m; k++) {
      double value = qp_rows_dot(rows, k, x);
      optimal = optimal && value >= rows->lower[k] - 1e-11 && value <= rows->upper[k] + 1e-11;
    }
    if (optimal) return true;
  }
  return false;
}

static void test_enumeration(batten_context *ctx) {
  size_t solved = 0, contradicting = 0, wrong = 0;
  double worst = 0;
  for (uint64_t trial = 0; trial < 1500; trial++) {
    uint64_t seed = trial;
    size_t n = 1 + trial % 4, m = 1 + t_random(&seed) % 6;
    problem p = make_problem(n, m);
    random_factor(&p, 10, &seed);
    random_rows(&p, &seed);
    for (size_t j = 0; j < n; j++) p.c[j] = 2 * random_symmetric(&seed);
    for (size_t k = 0; k < m; k++) { /* sides on a grid, rows at times twice: ties and degeneracy */
      if (k > 0 && t_uniform(&seed) < 0.15) memcpy(p.dense + k * n, p.dense + (k - 1) * n, n * sizeof *p.dense);
      double kind = t_uniform(&seed), at = (double)(t_random(&seed) % 5) / 2 - 1;
      p.lower[k] = kind < 0.4 ? -INFINITY : at;
      p.upper[k] = kind < 0.4 ? at : kind < 0.6 ? INFINITY : kind < 0.85 ? at + 0.5 : at;
    }
    qp_rows rows = rows_of(&p);
    answer a = new_answer(&p);
    double x[4];
    bool exists = enumerate(&p, &rows, x);
    run(ctx, &p, &rows, &a);
    residuals r = judge(&p, &rows, &a);
    if (exists) {
      double off = 0;
      for (size_t j = 0; j < n; j++) off = fmax(off, fabs(a.x[j] - x[j]));
      solved++;
      worst = fmax(worst, off);
      if (a.status != BATTEN_OK || off > 1e-9 || r.primal > 1e-12 || r.dual > 1e-12 || r.signs > 0) {
        wrong++;
        printf("# trial %llu: %s, x off by %g, primal %g dual %g signs %g\n", (unsigned long long)trial,
               batten_status_name(a.status), off, r.primal, r.dual, r.signs);
      }
    } else {
      contradicting++; /* or with an equality twice, which enumeration does not do: then residuals decide */
      bool optimal = a.status == BATTEN_OK && r.primal <= 1e-12 && r.dual <= 1e-12 && r.signs == 0;
      if (a.status != BATTEN_E_INFEASIBLE && !optimal) {
        wrong++;
        printf("# trial %llu: %s where no working set is optimal, primal %g dual %g\n", (unsigned long long)trial,
               batten_status_name(a.status), r.primal, r.dual);
      }
    }
    free_answer(&a);
    free_problem(&p);
  }
  T_CHECK(wrong == 0 && solved > 500 && contradicting > 50,
          "enumeration: %zu solved, %zu contradicting, x off by %.2g", solved, contradicting, worst);
}

/* ---- Known solutions ---- */

/* x, an active set of q rows and their multipliers are chosen; c and the sides follow. */
static void known_solution(problem *p, double *x, size_t q, uint64_t *seed) {
  size_t n = p->n;
  for (size_t j = 0; j < n; j++) x[j] = random_symmetric(seed);
  double *pull = calloc(n, sizeof *pull);
  for (size_t k = 0; k < p->m; k++) {
    double value = 0, slack = k < q ? 0 : 0.01 + t_uniform(seed);
    for (size_t j = 0; j < n; j++) value += p->dense[k * n + j] * x[j];
    bool low = t_uniform(seed) < 0.5;
    p->lower[k] = low ? value - slack : t_uniform(seed) < 0.5 ? -INFINITY : value - 3;
    p->upper[k] = low ? INFINITY : value + slack;
    double multiplier = (low ? 1 : -1) * (0.1 + t_uniform(seed));
    for (size_t j = 0; j < n && k < q; j++) pull[j] += multiplier * p->dense[k * n + j];
  }
  for (size_t j = 0; j < n; j++) { /* R'(Rx - c) = pull */
    double v = pull[j];
    for (size_t i = 0; i < j; i++) v -= p->r[i + j * n] * pull[i];
    pull[j] = v / p->r[j + j * n];
  }
  for (size_t i = 0; i < n; i++) {
    p->c[i] = -pull[i];
    for (size_t j = i; j < n; j++) p->c[i] += p->r[i + j * n] * x[j];
  }
  free(pull);
}

static void test_known(batten_context *ctx) {
  const struct {
    size_t n, m, q;
    double condition;
  } cases[] = {{2, 5, 1, 1},      {5, 40, 4, 10},     {10, 300, 10, 1e3}, {30, 3000, 12, 1e2}, {48, 6000, 30, 10},
               {48, 6000, 48, 1}, {100, 900, 60, 10}, {60, 200, 20, 1e6}, {20, 100, 12, 1e8},  {150, 1200, 90, 1e2}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    uint64_t seed = 77 + i;
    size_t n = cases[i].n;
    problem p = make_problem(n, cases[i].m);
    random_factor(&p, cases[i].condition, &seed);
    random_rows(&p, &seed);
    double *x = malloc(n * sizeof *x), off = 0;
    known_solution(&p, x, cases[i].q, &seed);
    qp_rows rows = rows_of(&p);
    answer a = new_answer(&p);
    run(ctx, &p, &rows, &a);
    char what[80];
    snprintf(what, sizeof what, "n=%zu m=%zu q=%zu condition %.0e", n, cases[i].m, cases[i].q, cases[i].condition);
    check_answer(&p, &rows, &a, what);
    for (size_t j = 0; j < n; j++) off = fmax(off, fabs(a.x[j] - x[j]));
    T_RATIO(off, 100 * (double)n * DBL_EPSILON * cases[i].condition * cases[i].condition, "x");

    answer warm = new_answer(&p); /* from the solution's working set: nothing left to do */
    memcpy(warm.active, a.active, p.m);
    run(ctx, &p, &rows, &warm);
    check_answer(&p, &rows, &warm, "warm");
    T_CHECK(warm.point.iterations == 0, "from its own working set: %zu pivots", warm.point.iterations);
    free_answer(&warm);
    free_answer(&a);
    free(x);
    free_problem(&p);
  }
}

/* ---- Shapes: cones through 0 ---- */

/* Many nearly parallel rows with a strictly feasible point, sides 0, as shape problems have. */
static problem cone_problem(size_t n, size_t m, uint64_t seed) {
  problem p = make_problem(n, m);
  random_factor(&p, 10, &seed);
  random_rows(&p, &seed);
  double *inside = malloc(n * sizeof *inside);
  for (size_t j = 0; j < n; j++) inside[j] = random_symmetric(&seed);
  for (size_t k = 0; k < m; k++) {
    double *a = p.dense + k * n, value = 0, square = 0;
    if (k % 5) /* near the one before */
      for (size_t j = 0; j < n; j++) a[j] = a[(ptrdiff_t)j - (ptrdiff_t)n] + 0.05 * a[j];
    for (size_t j = 0; j < n; j++) value += a[j] * inside[j], square += inside[j] * inside[j];
    for (size_t j = 0; j < n; j++)
      a[j] += (0.02 * sqrt(square) - fmin(value, 0.02 * sqrt(square))) / square * inside[j];
  }
  for (size_t j = 0; j < n; j++) p.c[j] = p.r[j + j * n] * inside[j] + random_symmetric(&seed);
  free(inside);
  return p;
}

static void test_cones(batten_context *ctx, batten_context *threaded) {
  for (size_t i = 0; i < 4; i++) {
    const size_t m[] = {60, 350, 2500, 20000};
    problem p = cone_problem(48, m[i], 5 + i);
    qp_rows rows = rows_of(&p);
    answer cold = new_answer(&p), other = new_answer(&p), warm = new_answer(&p);
    run(ctx, &p, &rows, &cold);
    check_answer(&p, &rows, &cold, "cone");
    run(threaded, &p, &rows, &other);
    T_CHECK(memcmp(cold.x, other.x, p.n * sizeof *cold.x) == 0 && memcmp(cold.y, other.y, p.m * sizeof *cold.y) == 0,
            "m=%zu: the same bits on four threads", p.m);
    uint64_t seed = 9;
    for (size_t j = 0; j < p.n; j++) p.c[j] *= 1 + 0.01 * random_symmetric(&seed);
    memcpy(warm.active, cold.active, p.m);
    run(ctx, &p, &rows, &warm);
    check_answer(&p, &rows, &warm, "data changed by 1 %, warm");
    T_RATIO((double)warm.point.iterations, 0.2 * (double)cold.point.iterations, "pivots of %zu",
            cold.point.iterations);
    free_answer(&cold);
    free_answer(&other);
    free_answer(&warm);
    free_problem(&p);
  }
}

/* ---- Traps ---- */

static void test_duplicates(batten_context *ctx) {
  problem p = cone_problem(12, 240, 3);
  uint64_t seed = 1;
  for (size_t k = 80; k < 240; k++) /* each again, at lengths from 1e-8 to 1e8, and each negative sum of two */
    for (size_t j = 0; j < 12; j++)
      p.dense[k * 12 + j] = p.dense[(k - 80) * 12 + j] * (k < 160 ? pow(10, 16 * t_uniform(&seed) - 8) : 1) +
                            (k < 160 ? 0 : p.dense[(k - 79) * 12 + j]);
  qp_rows rows = rows_of(&p);
  answer a = new_answer(&p);
  run(ctx, &p, &rows, &a);
  check_answer(&p, &rows, &a, "duplicates, scaled rows, implied rows");
  memset(a.active, QP_LOWER, 240); /* a start of nothing but dependent rows */
  run(ctx, &p, &rows, &a);
  check_answer(&p, &rows, &a, "started from all rows at once");
  free_answer(&a);
  free_problem(&p);
}

static void test_collapsed_cone(batten_context *ctx) {
  size_t optimal = 0;
  double worst = 0;
  for (uint64_t trial = 0; trial < 50; trial++) {
    uint64_t seed = 1000 + trial;
    problem p = make_problem(5, 40); /* 40 random half-spaces through 0: 0 is their only point */
    random_rows(&p, &seed);
    for (size_t j = 0; j < 5; j++) p.c[j] = random_symmetric(&seed);
    qp_rows rows = rows_of(&p);
    answer a = new_answer(&p);
    run(ctx, &p, &rows, &a);
    residuals r = judge(&p, &rows, &a);
    optimal += a.status == BATTEN_OK && r.dual < 1e-12 && r.signs == 0 ? 1 : 0;
    worst = fmax(worst, r.primal);
    free_answer(&a);
    free_problem(&p);
  }
  T_CHECK(optimal == 50, "collapsed cone: %zu of 50 optimal", optimal);
  T_RATIO(worst, 1e-14, "their violation");
}

static void test_degenerate_vertex(batten_context *ctx) {
  problem p = make_problem(3, 62); /* a pyramid of 60 sides over its apex (0, 0, 1), and two planes through it */
  for (size_t k = 0; k < 62; k++) {
    double angle = 2 * 3.14159265358979323846 * (double)k / 60;
    p.dense[k * 3] = k < 60 ? cos(angle) : 0;
    p.dense[k * 3 + 1] = k < 60 ? sin(angle) : 0.5 * (double)(k - 60);
    p.dense[k * 3 + 2] = 1;
    p.lower[k] = -INFINITY;
    p.upper[k] = 1;
  }
  p.c[0] = 0.01, p.c[1] = -0.02, p.c[2] = 5;
  qp_rows rows = rows_of(&p);
  answer a = new_answer(&p);
  run(ctx, &p, &rows, &a);
  check_answer(&p, &rows, &a, "degenerate vertex");
  T_RATIO(fabs(a.x[0]) + fabs(a.x[1]) + fabs(a.x[2] - 1), 1e-14, "its apex");
  free_answer(&a);
  free_problem(&p);
}

static void test_equalities(batten_context *ctx) {
  for (int contradicting = 0; contradicting < 2; contradicting++) {
    uint64_t seed = 8;
    problem p =
        make_problem(10, 40); /* 4 equalities and 3 combinations of them; inequalities, some dependent on them */
    random_factor(&p, 100, &seed);
    random_rows(&p, &seed);
    double x[10];
    known_solution(&p, x, 0, &seed);
    for (size_t j = 0; j < 10; j++) p.c[j] += random_symmetric(&seed);
    for (size_t k = 0; k < 12; k++) {
      double *a = p.dense + 3 * k * 10, value = 0; /* rows 0, 3, 6, .. */
      for (size_t j = 0; j < 10 && k >= 4; j++)
        a[j] = p.dense[3 * (k % 4) * 10 + j] - 2.5 * p.dense[3 * ((k + 1) % 4) * 10 + j];
      for (size_t j = 0; j < 10; j++) value += a[j] * x[j];
      p.lower[3 * k] = value - (k < 7   ? 0
                                : k < 9 ? 1e-17
                                        : 0.5); /* 7 .. 11: implied by the equalities, two of them tightly */
      p.upper[3 * k] = k < 7 ? p.lower[3 * k] : INFINITY;
    }
    if (contradicting) p.lower[15] = p.upper[15] = p.lower[15] + 1e-6;
    qp_rows rows = rows_of(&p);
    answer a = new_answer(&p);
    run(ctx, &p, &rows, &a);
    if (contradicting)
      check_proof(&p, &rows, &a, "a dependent equality off by 1e-6");
    else
      check_answer(&p, &rows, &a, "dependent equalities");
    free_answer(&a);
    free_problem(&p);
  }
}

/* Assignments: a linear objective with next to no curvature on a polytope whose vertices lie on twice the sides they
 * need, where steps are lost in rounding. */
static void test_assignments(batten_context *ctx) {
  enum { k = 9, n = k * k };
  for (uint64_t trial = 0; trial < 6; trial++) {
    uint64_t seed = 400 + trial;
    problem p = make_problem(n, 2 * k + n);
    for (size_t i = 0; i < k; i++)
      for (size_t j = 0; j < k; j++) {
        size_t at = i * k + j;
        p.dense[i * n + at] = p.dense[(k + j) * n + at] = 1;
        p.dense[(2 * k + at) * n + at] = 1;
        p.r[at * (n + 1)] = 1e-4 * (1 + t_uniform(&seed));
        p.c[at] = -(double)(t_random(&seed) % 6) / p.r[at * (n + 1)]; /* small integers as costs: ties */
      }
    for (size_t i = 0; i < 2 * k; i++) p.lower[i] = p.upper[i] = 1;
    qp_rows rows = rows_of(&p);
    answer a = new_answer(&p);
    run(ctx, &p, &rows, &a);
    residuals r = judge(&p, &rows, &a);
    T_CHECK(
        a.status == BATTEN_OK && r.primal <= 1e-12 && r.dual <= 1e-13 && r.signs == 0 && a.point.iterations < 1000,
        "assignment %llu: %s, primal %.2g dual %.2g gap %.2g, %zu pivots", (unsigned long long)trial,
        batten_status_name(a.status), r.primal, r.dual, r.gap, a.point.iterations);
    free_answer(&a);
    free_problem(&p);
  }
}

static void test_infeasible(batten_context *ctx) {
  problem two = make_problem(2, 2); /* x + y >= 1, x + y <= 0 */
  double rows2[4] = {1, 1, -3, -3};
  memcpy(two.dense, rows2, sizeof rows2);
  two.lower[0] = 1;
  qp_rows rows = rows_of(&two);
  answer a = new_answer(&two);
  run(ctx, &two, &rows, &a);
  check_proof(&two, &rows, &a, "two half-planes");
  free_answer(&a);
  free_problem(&two);
  for (uint64_t trial = 0; trial < 5;
       trial++) { /* 60 half-spaces that see the origin from all sides, at distance 1 */
    uint64_t seed = 31 + trial;
    problem p = make_problem(6, 60 + 300 * trial);
    random_factor(&p, 1e3, &seed);
    random_rows(&p, &seed);
    for (size_t k = 0; k < p.m; k++) p.lower[k] = 1;
    for (size_t j = 0; j < 6; j++) p.c[j] = 3 * random_symmetric(&seed);
    rows = rows_of(&p);
    a = new_answer(&p);
    run(ctx, &p, &rows, &a);
    check_proof(&p, &rows, &a, "half-spaces all around");
    free_answer(&a);
    free_problem(&p);
  }
}

/* Powers of two in the objective and in the unknowns change nothing but the scale. */
static void test_scales(batten_context *ctx) {
  double first[20];
  for (int scale = 0; scale < 3; scale++) {
    problem p = cone_problem(20, 400, 21);
    double objective = scale == 1 ? 0x1p-40 : 1, unknown = scale == 2 ? 0x1p30 : 1;
    for (size_t i = 0; i < 400; i++) p.r[i] *= objective / unknown;
    for (size_t j = 0; j < 20; j++) p.c[j] *= objective;
    qp_rows rows = rows_of(&p);
    answer a = new_answer(&p);
    run(ctx, &p, &rows, &a);
    double off = a.status == BATTEN_OK ? 0 : INFINITY, size = 0;
    for (size_t j = 0; j < 20; j++) {
      if (scale == 0) first[j] = a.x[j];
      off = fmax(off, fabs(a.x[j] / unknown - first[j]));
      size = fmax(size, fabs(first[j]));
    }
    T_RATIO(off, 1e-13 * size, "objective times %g, unknowns times %g", objective, unknown);
    free_answer(&a);
    free_problem(&p);
  }
}

/* ---- Limits, cancelling, memory ---- */

static void test_limits(batten_context *ctx) {
  problem p = cone_problem(20, 500, 2);
  qp_rows rows = rows_of(&p);
  qp_dense objective = {p.n, p.r, p.c};
  answer a = new_answer(&p);
  run(ctx, &p, &rows, &a);
  size_t needed = a.point.iterations;
  for (size_t limit = 0; limit <= needed; limit += needed / 3) {
    memset(a.active, 0, p.m);
    a.point = (qp_point){.x = a.x, .y = a.y, .active = a.active};
    batten_status st =
        qp_dual(ctx, &objective, &rows, &(qp_limits){.iterations = limit, .deadline = INFINITY}, &a.point);
    bool enough = limit >= needed;
    T_CHECK(st == (enough ? BATTEN_OK : BATTEN_E_LIMIT) && a.point.have_x == enough, "limit %zu of %zu: %s", limit,
            needed, batten_status_name(st));
  }
  memset(a.active, 0, p.m);
  a.point = (qp_point){.x = a.x, .y = a.y, .active = a.active};
  batten_status st =
      qp_dual(ctx, &objective, &rows, &(qp_limits){.iterations = SIZE_MAX, .deadline = batten_now() - 1}, &a.point);
  T_CHECK(st == BATTEN_E_LIMIT && !a.point.have_x, "deadline: %s", batten_status_name(st));
  qp_cost cost = qp_dual_cost(&rows);
  run(ctx, &p, &rows, &a);
  a.point.have_x = false;
  batten_bytes_peak_reset(ctx);
  size_t before = batten_bytes_in_use(ctx);
  qp_dual(ctx, &objective, &rows, &(qp_limits){.iterations = SIZE_MAX, .deadline = INFINITY},
          &a.point); /* warm: by LAPACK, too */
  size_t held = batten_bytes_peak(ctx) - before;
  T_CHECK(held <= cost.bytes && cost.bytes < 3 * held && cost.flops > 0, "bytes: %zu held, %zu foretold", held,
          cost.bytes);
  free_answer(&a);
  free_problem(&p);
}

typedef struct call {
  problem p;
  qp_rows rows;
} call;

static batten_status one_call(batten_context *ctx, void *arg) {
  call *c = arg;
  answer a = new_answer(&c->p);
  run(ctx, &c->p, &c->rows, &a);
  batten_status st = a.status;
  free_answer(&a);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1), *threaded = t_context(NULL, NULL, 4);
  test_hand(ctx);
  test_enumeration(ctx);
  test_known(ctx);
  test_cones(ctx, threaded);
  test_duplicates(ctx);
  test_collapsed_cone(ctx);
  test_degenerate_vertex(ctx);
  test_equalities(ctx);
  test_assignments(ctx);
  test_infeasible(ctx);
  test_scales(ctx);
  test_limits(ctx);
  call c = {.p = cone_problem(8, 60, 1)};
  c.p.lower[0] = c.p.upper[0] = 0.1;
  c.rows = rows_of(&c.p);
  t_fail_every_allocation("the dual engine", one_call, &c);
  t_cancel_every_progress("the dual engine", one_call, &c);
  free_problem(&c.p);
  batten_context_free(threaded);
  batten_context_free(ctx);
  return t_done();
}
