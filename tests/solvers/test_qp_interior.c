/* The interior point through its internal interface: by hand, random problems with known solutions, their kinds
 * (equations only, bounds only, linear, semidefinite, dependent rows), problems without solution and their proofs,
 * warm starts, limits, memory. Residuals are summed here in long double from the rows as given. */
#include "tap.h"

#include <float.h>

#include "qp/engine.h"

typedef struct problem {
  size_t n, m, general;
  size_t *h_starts, *c_starts, *row;
  uint32_t *h_indices, *c_indices, *identity;
  double *h_values, *c_values, *g, *scale, *lower, *upper, *x, *y; /* x, y: a solution, if known */
  batten_matrix h, c;
  qp_rows rows;
  qp_sparse objective;
} problem;

/* n unknowns, `general` rows of up to `length` neighbouring unknowns each, then bounds on all unknowns if wanted. */
static problem *problem_new(size_t n, size_t general, size_t length, bool bounds) {
  problem *p = calloc(1, sizeof *p);
  size_t m = general + (bounds ? n : 0), entries = general * length;
  p->n = n, p->m = m, p->general = general;
  p->h_starts = calloc(n + 1, sizeof(size_t)), p->c_starts = calloc(general + 1, sizeof(size_t));
  p->row = calloc(m + 1, sizeof(size_t));
  p->h_indices = calloc(3 * n + 1, sizeof(uint32_t)), p->c_indices = calloc(entries + 1, sizeof(uint32_t));
  p->identity = calloc(n + 1, sizeof(uint32_t));
  p->h_values = calloc(3 * n + 1, sizeof(double)), p->c_values = calloc(entries + 1, sizeof(double));
  p->g = calloc(n + 1, sizeof(double)), p->x = calloc(n + 1, sizeof(double));
  p->scale = calloc(m + 1, sizeof(double)), p->lower = calloc(m + 1, sizeof(double));
  p->upper = calloc(m + 1, sizeof(double)), p->y = calloc(m + 1, sizeof(double));
  for (size_t j = 0; j < n; j++) p->identity[j] = (uint32_t)j;
  for (size_t k = 0; k < m; k++) p->row[k] = k, p->scale[k] = 1;
  p->h = batten_matrix_sparse(n, n, p->h_starts, p->h_indices, p->h_values);
  p->c = batten_matrix_sparse(general, n, p->c_starts, p->c_indices, p->c_values);
  p->rows = (qp_rows){n, m, &p->c, p->row, p->identity, p->scale, p->lower, p->upper};
  p->objective = (qp_sparse){n, &p->h, p->g};
  return p;
}
static void problem_free(problem *p) {
  void *blocks[] = {p->h_starts, p->c_starts, p->row,      p->h_indices, p->c_indices,
                    p->identity, p->h_values, p->c_values, p->g,         p->x,
                    p->scale,    p->lower,    p->upper,    p->y,         p};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) free(blocks[i]);
}

typedef struct answer {
  batten_status status;
  double *x, *y, *ray;
  signed char *active;
  bool have_x;
  size_t iterations;
  double primal, dual, gap; /* relative to 1 + sizes */
} answer;

static void judge(const problem *p, answer *a) {
  long double quadratic = 0, linear = 0, sides = 0, primal = 0, dual = 0, size = 1, slopes = 1;
  long double *left = calloc(p->n + 1, sizeof *left);
  for (size_t j = 0; j < p->n; j++) {
    long double hx = 0;
    for (size_t e = p->h_starts[j]; e < p->h_starts[j + 1]; e++)
      hx += (long double)p->h_values[e] * a->x[p->h_indices[e]];
    quadratic += hx * a->x[j], linear += (long double)p->g[j] * a->x[j];
    left[j] = hx + p->g[j];
    slopes = fmaxl(slopes, fmaxl(fabsl(hx), fabsl((long double)p->g[j])));
  }
  for (size_t k = 0; k < p->m; k++) {
    const double *v;
    const uint32_t *columns;
    size_t count = qp_rows_entries(&p->rows, k, &v, &columns);
    long double ax = 0, y = a->y[k];
    for (size_t e = 0; e < count; e++) {
      ax += (long double)p->scale[k] * v[e] * a->x[columns[e]];
      left[columns[e]] -= (long double)p->scale[k] * v[e] * y;
    }
    size = fmaxl(size, fabsl(ax));
    primal = fmaxl(primal, fmaxl(p->lower[k] - ax, ax - p->upper[k]));
    double side = y > 0 ? p->lower[k] : p->upper[k];
    if (isfinite(side))
      sides += y * side;
    else
      dual = fmaxl(dual, fabsl(y));
  }
  for (size_t j = 0; j < p->n; j++) dual = fmaxl(dual, fabsl(left[j]));
  a->primal = (double)(primal / size), a->dual = (double)(dual / slopes);
  a->gap = (double)(fabsl(quadratic + linear - sides) / (1 + fabsl(quadratic / 2 + linear)));
  free(left);
}

static answer solve_on(batten_context *ctx, const problem *p, const answer *start, size_t iterations) {
  answer a = {.x = calloc(p->n + 1, sizeof(double)),
              .y = calloc(p->m + 1, sizeof(double)),
              .ray = calloc(p->n + 1, sizeof(double)),
              .active = calloc(p->m + 1, 1)};
  if (start) memcpy(a.x, start->x, p->n * sizeof *a.x), memcpy(a.active, start->active, p->m);
  qp_limits limits = {.iterations = iterations, .deadline = INFINITY, .tolerance = 1e-10};
  qp_point point = {.x = a.x, .y = a.y, .active = a.active, .ray = a.ray, .have_x = start != NULL};
  a.status = qp_interior(ctx, &p->objective, &p->rows, &limits, &point);
  a.have_x = point.have_x, a.iterations = point.iterations;
  judge(p, &a);
  return a;
}
static answer solve(const problem *p, const answer *start) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  qp_cost cost = {0};
  answer a = solve_on(ctx, p, start, SIZE_MAX);
  size_t peak = batten_bytes_peak(ctx);
  batten_status st = qp_interior_cost(ctx, &p->h, &p->rows, &cost);
  if (st < 0 || batten_bytes_in_use(ctx) != 0 || peak > 3 * cost.bytes + 100000)
    t_line(false, "memory: peak %zu, predicted %zu, left %zu", peak, cost.bytes, batten_bytes_in_use(ctx));
  batten_context_free(ctx);
  return a;
}
static void answer_free(answer *a) { free(a->x), free(a->y), free(a->ray), free(a->active); }

static double signed_uniform(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }

enum { STRICT, SEMIDEFINITE, LINEAR };

/* Chosen x, multipliers of about a third of the sides; g and sides follow. kind: of H. `duplicate`: every fifth row
 * is a multiple of the one before. equalities: how many of the rows, at the front. */
static problem *random_problem(size_t n, size_t general, size_t length, bool bounds, int kind, size_t equalities,
                               bool duplicate, uint64_t *seed) {
  problem *p = problem_new(n, general, length, bounds);
  size_t at = 0;
  for (size_t j = 0; j < n; j++) { /* D'D of first differences, and a diagonal where H is to be definite */
    p->h_starts[j] = at;
    if (kind != LINEAR) {
      double own = kind == STRICT ? 0.5 + t_uniform(seed) : 0, links = (j > 0) + (j + 1 < n);
      if (j > 0) p->h_indices[at] = (uint32_t)(j - 1), p->h_values[at++] = -1;
      p->h_indices[at] = (uint32_t)j, p->h_values[at++] = own + links;
      if (j + 1 < n) p->h_indices[at] = (uint32_t)(j + 1), p->h_values[at++] = -1;
    }
  }
  p->h_starts[n] = at;
  at = 0;
  for (size_t k = 0; k < general; k++) {
    size_t first = (size_t)(t_uniform(seed) * (double)(n - length + 1));
    p->c_starts[k] = at;
    bool twin = duplicate && k % 5 == 4;
    for (size_t e = 0; e < length; e++, at++) {
      p->c_indices[at] = twin ? p->c_indices[at - length] : (uint32_t)(first + e);
      p->c_values[at] = twin ? 2 * p->c_values[at - length] : signed_uniform(seed);
    }
  }
  p->c_starts[general] = at;
  for (size_t j = 0; j < n; j++) p->x[j] = signed_uniform(seed);
  for (size_t j = 0; j < n; j++)
    for (size_t e = p->h_starts[j]; e < p->h_starts[j + 1]; e++) p->g[j] -= p->h_values[e] * p->x[p->h_indices[e]];
  for (size_t k = 0; k < p->m; k++) {
    double ax = qp_rows_dot(&p->rows, k, p->x), dice = t_uniform(seed);
    p->lower[k] = ax - 0.1 - t_uniform(seed), p->upper[k] = dice < 0.5 ? ax + 0.1 + t_uniform(seed) : INFINITY;
    if (k < equalities)
      p->lower[k] = p->upper[k] = ax, p->y[k] = signed_uniform(seed);
    else if (dice < 0.2)
      p->lower[k] = ax, p->y[k] = t_uniform(seed);
    else if (dice < 0.35)
      p->upper[k] = ax, p->y[k] = -t_uniform(seed), p->lower[k] = dice < 0.3 ? -INFINITY : p->lower[k];
    qp_rows_add(&p->rows, k, p->y[k], p->g);
  }
  return p;
}

static double apart(size_t n, const double *a, const double *b) {
  double most = 0;
  for (size_t j = 0; j < n; j++) most = fmax(most, fabs(a[j] - b[j]));
  return most;
}

static void test_random(void) {
  static const struct {
    const char *name;
    size_t n, general, length;
    bool bounds;
    int kind;
    size_t equalities;
    bool twins;
  } cases[] = {{"one unknown", 1, 1, 1, false, STRICT, 0, false},
               {"one unknown with bounds", 1, 0, 1, true, STRICT, 0, false},
               {"no rows", 30, 0, 1, false, STRICT, 0, false},
               {"bounds only", 200, 0, 1, true, STRICT, 0, false},
               {"equations only", 100, 40, 4, false, STRICT, 40, false},
               {"dependent equations", 60, 50, 3, false, STRICT, 50, true},
               {"rows", 150, 400, 5, false, STRICT, 0, false},
               {"rows and bounds", 150, 300, 6, true, STRICT, 20, true},
               {"wide rows", 40, 900, 40, false, STRICT, 3, true},
               {"semidefinite", 120, 200, 5, true, SEMIDEFINITE, 10, false},
               {"linear", 100, 150, 4, true, LINEAR, 10, false},
               {"banded", 3000, 4000, 4, true, STRICT, 100, false}};
  size_t tried = 0, immediate = 0;
  for (size_t t = 0; t < sizeof cases / sizeof *cases; t++)
    for (uint64_t round = 0; round < (cases[t].n > 1000 ? 1 : 4); round++) {
      uint64_t seed = 100 * t + round;
      problem *p = random_problem(cases[t].n, cases[t].general, cases[t].length, cases[t].bounds, cases[t].kind,
                                  cases[t].equalities, cases[t].twins, &seed);
      answer a = solve(p, NULL);
      double worst = fmax(a.primal, fmax(a.dual, a.gap));
      T_RATIO(a.status == BATTEN_OK && a.have_x ? worst : INFINITY, 1e-9,
              "%s, round %d: residuals after %zu steps (%s)", cases[t].name, (int)round, a.iterations,
              batten_status_name(a.status));
      if (cases[t].kind == STRICT) T_RATIO(apart(p->n, a.x, p->x), 1e-6, "  x is the known one");
      answer warm = solve(p, &a);
      T_CHECK(warm.status == BATTEN_OK && warm.iterations <= a.iterations,
              "  from its own working set: %zu steps, %zu before", warm.iterations, a.iterations);
      if (cases[t].kind == STRICT && a.iterations > 6) tried++, immediate += warm.iterations == 0;
      answer_free(&a);
      answer_free(&warm);
      problem_free(p);
    }
  /* Where active rows depend on each other their multipliers are not unique, and the first that come may pull. */
  T_CHECK(4 * immediate >= 3 * tried, "no step at all from the final working set in %zu of %zu", immediate, tried);
}

/* min (x^2 + y^2)/2 - x - 2y, x + y <= 1, x >= 0: by hand x = 0, y = 1, multiplier of the row -1, of the bound 0. */
static void test_by_hand(void) {
  problem *p = problem_new(2, 1, 2, true);
  p->h_starts[1] = 1, p->h_starts[2] = 2;
  p->h_indices[1] = 1, p->h_values[0] = p->h_values[1] = 1;
  p->g[0] = -1, p->g[1] = -2;
  p->c_starts[1] = 2, p->c_indices[1] = 1, p->c_values[0] = p->c_values[1] = 1;
  p->lower[0] = -INFINITY, p->upper[0] = 1, p->lower[1] = 0, p->upper[1] = INFINITY;
  p->lower[2] = -5, p->upper[2] = 5;
  answer a = solve(p, NULL);
  T_RATIO(fmax(fabs(a.x[0]), fabs(a.x[1] - 1)), 1e-9, "by hand: x = (0, 1)");
  T_RATIO(fmax(fabs(a.y[0] + 1), fabs(a.y[1])), 1e-8, "by hand: multipliers -1 and 0 (degenerate)");
  T_CHECK(a.active[0] == QP_UPPER && a.active[2] == QP_FREE, "by hand: the row is active above, y's bounds are not");
  answer_free(&a);
  problem_free(p);
  problem *none = problem_new(0, 0, 1, false);
  answer b = solve(none, NULL);
  T_CHECK(b.status == BATTEN_OK && b.have_x, "no unknowns: done");
  answer_free(&b);
  problem_free(none);
}

/* Scaling rows, unknowns and objective by powers of two changes the solution by these powers. */
static void test_scaling(void) {
  uint64_t seed = 77;
  problem *p = random_problem(60, 25, 4, false, STRICT, 5, false, &seed); /* few rows: multipliers are unique */
  answer a = solve(p, NULL);
  for (size_t e = 0; e < p->c_starts[p->general]; e++) p->c_values[e] *= 0x1p-20;
  for (size_t k = 0; k < p->general; k++) p->scale[k] = 0x1p20;
  for (size_t j = 0; j < p->n; j++) p->g[j] *= 0x1p14;
  for (size_t e = 0; e < p->h_starts[p->n]; e++) p->h_values[e] *= 0x1p14;
  answer b = solve(p, NULL);
  T_RATIO(apart(p->n, a.x, b.x), 1e-9, "rows and objective times powers of two: the same x");
  for (size_t k = 0; k < p->m; k++) b.y[k] *= 0x1p-14;
  T_RATIO(apart(p->m, a.y, b.y), 1e-7, "  and multipliers times the objective's");
  T_CHECK(memcmp(a.active, b.active, p->m) == 0, "  and the same working set");
  answer_free(&a), answer_free(&b);
  problem_free(p);
}

/* sum y a = 0 and sum y side > 0. */
static bool proves_infeasible(const problem *p, const double *y) {
  double *sum = calloc(p->n + 1, sizeof *sum), sides = 0, size = 0, left = 0;
  for (size_t k = 0; k < p->m; k++) {
    double side = y[k] > 0 ? p->lower[k] : p->upper[k];
    if (y[k] != 0 && !isfinite(side)) sides = -INFINITY;
    if (y[k] != 0) sides += y[k] * side;
    qp_rows_add(&p->rows, k, y[k], sum);
    size = fmax(size, fabs(y[k]));
  }
  for (size_t j = 0; j < p->n; j++) left = fmax(left, fabs(sum[j]));
  free(sum);
  return left <= 1e-11 * size && sides > 1e-6 * size;
}

static void test_infeasible(void) {
  for (uint64_t round = 0; round < 12; round++) {
    uint64_t seed = 500 + round;
    bool bounds = round % 2, linear = round % 3 == 0;
    problem *p = random_problem(30 + 10 * (size_t)round, 60 + 20 * (size_t)round, 4, bounds, linear ? LINEAR : STRICT,
                                0, false, &seed);
    /* The last row says the opposite of the sum of the first three's entries at their lower sides. */
    size_t last = p->general - 1, twin = last - 1;
    for (size_t e = 0; e < 4; e++) {
      p->c_indices[p->c_starts[last] + e] = p->c_indices[p->c_starts[twin] + e];
      p->c_values[p->c_starts[last] + e] = -3 * p->c_values[p->c_starts[twin] + e];
    }
    p->lower[twin] = 1, p->upper[twin] = INFINITY;
    p->lower[last] = -2.5, p->upper[last] = INFINITY; /* a'x <= 5/6 */
    answer a = solve(p, NULL);
    T_CHECK(a.status == BATTEN_E_INFEASIBLE && proves_infeasible(p, a.y) && !a.have_x,
            "round %d: infeasible, proven after %zu steps (%s)", (int)round, a.iterations,
            batten_status_name(a.status));
    answer_free(&a);
    problem_free(p);
  }
}

static void test_unbounded(void) {
  for (uint64_t round = 0; round < 8; round++) {
    uint64_t seed = 900 + round;
    problem *p = random_problem(40, 30, 3, false, round % 2 ? LINEAR : SEMIDEFINITE, 0, false, &seed);
    /* H's kernel is the constant vector; all rows have entries whose sum is >= 0 and only lower sides; g falls along
     * it. */
    for (size_t e = 0; e < p->c_starts[p->general]; e++) p->c_values[e] = fabs(p->c_values[e]);
    for (size_t k = 0; k < p->m; k++) p->lower[k] = -1, p->upper[k] = INFINITY;
    for (size_t j = 0; j < p->n; j++) p->g[j] = -1 - t_uniform(&seed);
    answer a = solve(p, NULL);
    double slope = 0, size = 0, worst = 0;
    for (size_t j = 0; j < p->n; j++) {
      double hd = 0;
      for (size_t e = p->h_starts[j]; e < p->h_starts[j + 1]; e++) hd += p->h_values[e] * a.ray[p->h_indices[e]];
      slope += p->g[j] * a.ray[j], size = fmax(size, fabs(a.ray[j])), worst = fmax(worst, fabs(hd));
    }
    for (size_t k = 0; k < p->m; k++) worst = fmax(worst, -qp_rows_dot(&p->rows, k, a.ray));
    T_CHECK(a.status == BATTEN_E_UNBOUNDED && slope < 0 && worst <= 1e-11 * size,
            "round %d: unbounded (%s), slope %.2g, off the cone by %.1e", (int)round, batten_status_name(a.status),
            slope / size, worst / size);
    answer_free(&a);
    problem_free(p);
  }
}

static batten_status call(batten_context *ctx, void *arg) {
  answer a = solve_on(ctx, arg, NULL, SIZE_MAX);
  answer_free(&a);
  return a.status;
}

static void test_limits(void) {
  uint64_t seed = 4;
  problem *p = random_problem(50, 80, 4, true, STRICT, 5, false, &seed);
  t_fail_every_allocation("qp_interior", call, p);
  t_cancel_every_progress("qp_interior", call, p);
  batten_context *ctx = t_context(NULL, NULL, 1);
  answer a = solve_on(ctx, p, NULL, 2);
  T_CHECK(a.status == BATTEN_E_LIMIT && a.iterations <= 3, "two steps allowed: %zu made, %s", a.iterations,
          batten_status_name(a.status));
  answer_free(&a);
  batten_context_free(ctx);
  problem_free(p);
}

int main(void) {
  test_by_hand();
  test_random();
  test_scaling();
  test_infeasible();
  test_unbounded();
  test_limits();
  return t_done();
}
