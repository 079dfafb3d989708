/* Factorised working set: invariants after random adds and drops, against fresh factors; dependent rows; conditions
 * up to 1e12. Errors are measured in units of n eps times the lengths of the rows of R^-1, which hold whatever the
 * condition. */
#include <float.h>

#include "la/la.h"
#include "qp/active.h"
#include "tap.h"

static double random_symmetric(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }

/* a [n][n] := (I - 2 v v' / v'v) a for some random v: orthogonal mixing. */
static void reflect(size_t n, double *a, uint64_t *seed) {
  for (int times = 0; times < 3; times++) {
    double v[128], square = 0;
    for (size_t i = 0; i < n; i++) v[i] = random_symmetric(seed), square += v[i] * v[i];
    for (size_t j = 0; j < n; j++) {
      double s = 0;
      for (size_t i = 0; i < n; i++) s += v[i] * a[i + j * n];
      for (size_t i = 0; i < n; i++) a[i + j * n] -= 2 * s / square * v[i];
    }
  }
}

typedef struct scene {
  size_t n;
  double *r, *c; /* factor, target */
  double *dense;
  batten_matrix matrix;
  size_t *row;
  uint32_t *identity;
  double *scale, *side;
  qp_rows rows;
  qp_dense objective;
} scene;

/* m dense rows of length one (every fourth is the previous one moved by 1e-3) and n bounds; R of the given condition.
 */
static scene make_scene(size_t n, size_t m, double condition, uint64_t seed) {
  scene s = {.n = n};
  s.r = calloc(n * n, sizeof *s.r);
  s.c = malloc(n * sizeof *s.c);
  for (size_t i = 0; i < n; i++) s.r[i + i * n] = pow(condition, -(double)i / (double)(n > 1 ? n - 1 : 1));
  reflect(n, s.r, &seed);
  double *turned = malloc(n * n * sizeof *turned), *tau = malloc(n * sizeof *tau);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i < n; i++) turned[j + i * n] = s.r[i + j * n];
  reflect(n, turned, &seed);
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_la_geqrf(ctx, n, n, turned, n, tau);
  batten_context_free(ctx);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i < n; i++) s.r[i + j * n] = i <= j ? turned[i + j * n] : 0;
  free(turned);
  free(tau);
  for (size_t i = 0; i < n; i++) s.c[i] = random_symmetric(&seed);

  s.dense = malloc(m * n * sizeof *s.dense);
  s.row = malloc((m + n) * sizeof *s.row);
  s.scale = malloc((m + n) * sizeof *s.scale);
  s.side = calloc(m + n, sizeof *s.side);
  s.identity = malloc(n * sizeof *s.identity);
  for (size_t k = 0; k < m; k++) {
    double square = 0;
    for (size_t j = 0; j < n; j++) {
      double *a = s.dense + k * n + j;
      *a = k % 4 == 3 ? a[-(ptrdiff_t)n] + 1e-3 * random_symmetric(&seed) : random_symmetric(&seed);
      square += *a * *a;
    }
    s.scale[k] = 1 / sqrt(square);
  }
  for (size_t k = 0; k < m + n; k++) s.row[k] = k;
  for (size_t j = 0; j < n; j++) s.identity[j] = (uint32_t)j, s.scale[m + j] = 1;
  s.matrix = batten_matrix_dense(m, n, s.dense);
  s.objective = (qp_dense){n, s.r, s.c};
  return s;
}

static void connect(scene *s) {
  s->rows = (qp_rows){s->n, s->matrix.rows + s->n, &s->matrix, s->row, s->identity, s->scale, s->side, s->side};
}

static void free_scene(scene *s) {
  free(s->r);
  free(s->c);
  free(s->dense);
  free(s->row);
  free(s->identity);
  free(s->scale);
  free(s->side);
}

/* Inverse of the triangle in extended precision. */
static long double *long_inverse(size_t n, const double *r) {
  long double *x = calloc(n * n, sizeof *x);
  for (size_t j = 0; j < n; j++)
    for (size_t i = j + 1; i-- > 0;) {
      long double s = i == j;
      for (size_t l = i + 1; l <= j; l++) s -= (long double)r[i + l * n] * x[l + j * n];
      x[i + j * n] = s / r[i + i * n];
    }
  return x;
}

/* Worst errors, each in units of n eps times the reaches concerned. */
typedef struct errors {
  double triangle; /* J'N - [T; 0] */
  double metric;   /* J J' - R^-1 R^-T */
  double target;   /* J Q'c - R^-1 c */
} errors;

static errors measure(const scene *s, const qp_active *set) {
  size_t n = s->n;
  double unit = (double)n * DBL_EPSILON;
  errors e = {0};
  double *a = malloc(n * sizeof *a);
  for (size_t p = 0; p < set->q; p++) {
    memset(a, 0, n * sizeof *a);
    qp_rows_add(&s->rows, set->member[p], 1, a);
    double reach = 0;
    for (size_t i = 0; i < n; i++) reach += fabs(a[i]) * set->reach[i];
    for (size_t j = 0; j < n; j++) {
      double sum = j <= p ? -set->t[j + p * n] : 0;
      for (size_t i = 0; i < n; i++) sum += set->j[i + j * n] * a[i];
      e.triangle = fmax(e.triangle, fabs(sum) / (unit * reach));
    }
  }
  double length = 0;
  for (size_t i = 0; i < n; i++) length = hypot(length, s->c[i]);
  for (size_t i = 0; i < n; i++) {
    for (size_t l = 0; l <= i; l++) {
      long double sum = 0;
      for (size_t j = 0; j < n; j++)
        sum += (long double)set->j[i + j * n] * set->j[l + j * n] -
               (long double)set->inverse[i + j * n] * set->inverse[l + j * n];
      e.metric = fmax(e.metric, (double)fabsl(sum) / (unit * set->reach[i] * set->reach[l]));
    }
    long double sum = 0;
    for (size_t j = 0; j < n; j++)
      sum += (long double)set->j[i + j * n] * set->target[j] - (long double)set->inverse[i + j * n] * s->c[j];
    e.target = fmax(e.target, (double)fabsl(sum) / (unit * set->reach[i] * length));
  }
  free(a);
  return e;
}

static void test_inverse(batten_context *ctx, double condition) {
  scene s = make_scene(24, 8, condition, 3);
  connect(&s);
  size_t n = s.n;
  qp_active set;
  T_OK(qp_active_new(ctx, &s.objective, &s.rows, &set), ctx);
  long double *exact = long_inverse(n, s.r);
  double worst = 0;
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) {
      long double bound = 0; /* |R^-1| |R| |R^-1|: what back substitution may be wrong by, in eps n */
      for (size_t p = i; p <= j; p++)
        for (size_t l = p; l <= j; l++) bound += fabsl(exact[i + p * n] * s.r[p + l * n] * exact[l + j * n]);
      double error = (double)fabsl(set.inverse[i + j * n] - exact[i + j * n]);
      if (j < i ? error > 0 : error > (double)n * DBL_EPSILON * (double)bound * worst)
        worst = j < i ? INFINITY : error / ((double)n * DBL_EPSILON * (double)bound);
    }
  T_RATIO(worst, 1.0, "inverse of R, condition %.0e", condition);
  free(exact);
  qp_active_free(ctx, &set);
  free_scene(&s);
}

/* Adds and drops at random, one at a time and many at once. */
static void test_updates(batten_context *ctx, size_t n, double condition, uint64_t first_seed) {
  uint64_t seed = first_seed;
  scene s = make_scene(n, 3 * n, condition, seed);
  connect(&s);
  qp_active set, fresh;
  T_OK(qp_active_new(ctx, &s.objective, &s.rows, &set), ctx);
  double *d = malloc(2 * n * sizeof *d), *y = d + n;
  size_t adds = 0, drops = 0, refused = 0;
  errors e = {0};
  for (int step = 0; step < 400; step++) {
    if (set.q > 0 && (set.q == n || t_uniform(&seed) < 0.45)) {
      qp_active_drop(&set, t_random(&seed) % set.q);
      drops++;
      continue;
    }
    size_t k = t_random(&seed) % s.rows.m, p = 0;
    while (p < set.q && set.member[p] != k) p++;
    qp_active_project(&set, k, d);
    bool depends = qp_active_depends(&set, k, d);
    if (p < set.q && !depends) T_CHECK(false, "member %zu depends on itself", k);
    if (depends) {
      refused++;
      continue;
    }
    qp_active_add(&set, k, QP_LOWER, d);
    adds++;
  }
  e = measure(&s, &set);
  double worst = fmax(e.triangle, fmax(e.metric, e.target));
  T_RATIO(worst, 20,
          "n=%zu condition %.0e seed %llu: %zu adds, %zu drops, %zu refused, %zu left; J'N %.2g, JJ' %.2g, "
          "target %.2g",
          n, condition, (unsigned long long)first_seed, adds, drops, refused, set.q, e.triangle, e.metric, e.target);

  /* The same members at once: the same invariants, all of them taken, and the same span. */
  T_OK(qp_active_new(ctx, &s.objective, &s.rows, &fresh), ctx);
  size_t half = set.q / 2;
  T_OK(qp_active_add_many(ctx, &fresh, half, set.member, set.side), ctx);
  T_OK(qp_active_add_many(ctx, &fresh, set.q - half, set.member + half, set.side + half), ctx);
  T_CHECK(fresh.q == set.q, "n=%zu: all %zu members taken at once, %zu", n, set.q, fresh.q);
  e = measure(&s, &fresh);
  worst = fmax(e.triangle, fmax(e.metric, e.target));
  T_RATIO(worst, 20, "n=%zu condition %.0e at once: J'N %.2g, JJ' %.2g, target %.2g", n, condition, e.triangle,
          e.metric, e.target);

  /* T y = d[..q] tells how a member is made up of the members; T'u = b is its transpose. */
  if (set.q > 0) {
    size_t place = set.q / 2;
    double off = 0;
    qp_active_project(&set, set.member[place], d);
    qp_active_solve(&set, d, y);
    for (size_t i = 0; i < set.q; i++) off = fmax(off, fabs(y[i] - (i == place)));
    T_RATIO(off, 1e-7, "a member is made up of itself");
    for (size_t i = 0; i < set.q; i++) d[i] = random_symmetric(&seed);
    qp_active_solve_transposed(&set, d, y);
    off = 0;
    for (size_t p = 0; p < set.q; p++) {
      double sum = -d[p], size = fabs(d[p]);
      for (size_t i = 0; i <= p; i++) sum += set.t[i + p * n] * y[i], size += fabs(set.t[i + p * n] * y[i]);
      off = fmax(off, fabs(sum) / size);
    }
    T_RATIO(off, (double)n * DBL_EPSILON, "transposed solve");
    double *x = calloc(n, sizeof *x), size = 0;
    qp_active_combine(&set, 0, set.q, 1, y, x);
    off = 0;
    for (size_t i = 0; i < set.q; i++) size = hypot(size, y[i]);
    for (size_t p = 0; p < set.q; p++) {
      double reach = 0;
      for (size_t i = 0; i < n; i++) reach += set.reach[i]; /* every |a_ki| <= 1 */
      off = fmax(off, fabs(qp_rows_dot(&s.rows, set.member[p], x) - d[p]) / (reach * size));
    }
    T_RATIO(off, 20 * (double)n * DBL_EPSILON, "x = J1 u lies at the sides b where T'u = b");
    free(x);
  }
  qp_active_reset(&set, s.c);
  e = measure(&s, &set);
  T_CHECK(set.q == 0 && e.metric == 0 && e.target == 0, "reset: R^-1 again");
  free(d);
  qp_active_free(ctx, &fresh);
  qp_active_free(ctx, &set);
  free_scene(&s);
}

/* By hand: R = diag(1, 2), rows e1 + e2 and e1. */
static void test_hand(batten_context *ctx) {
  double r[4] = {1, 0, 0, 2}, c[2] = {3, 4}, dense[4] = {1, 1, 1, 0}, scale[2] = {1, 1}, side[2] = {0, 0}, d[2],
         x[2] = {0};
  size_t row[2] = {0, 1};
  uint32_t identity[2] = {0, 1};
  batten_matrix matrix = batten_matrix_dense(2, 2, dense);
  qp_rows rows = {2, 2, &matrix, row, identity, scale, side, side};
  qp_dense objective = {2, r, c};
  qp_active set;
  T_OK(qp_active_new(ctx, &objective, &rows, &set), ctx);
  qp_active_project(&set, 0, d);
  T_CHECK(d[0] == 1 && d[1] == 0.5, "R^-T (1, 1) = (1, 1/2)");
  qp_active_add(&set, 0, QP_LOWER, d);
  T_RATIO(fabs(fabs(set.t[0]) - sqrt(1.25)), 4 * DBL_EPSILON, "T");
  T_RATIO(fabs(set.j[2] + set.j[3]) / fabs(set.j[2]), 8 * DBL_EPSILON, "J2 is along (1, -1)");
  qp_active_combine(&set, 1, 2, 1, set.target, x); /* 1/2 ((x1 - 3)^2 + (2 x2 - 4)^2) on x1 + x2 = 0 has x1 = -1 */
  T_RATIO(fabs(x[0] + 1) + fabs(x[1] - 1), 16 * DBL_EPSILON, "minimiser on x1 + x2 = 0");
  qp_active_project(&set, 1, d);
  T_CHECK(!qp_active_depends(&set, 1, d), "e1 is new");
  qp_active_add(&set, 1, QP_UPPER, d);
  qp_active_project(&set, 1, d);
  T_CHECK(set.q == 2 && set.side[1] == QP_UPPER && qp_active_depends(&set, 1, d), "full set: everything depends");
  qp_active_drop(&set, 0);
  T_CHECK(set.q == 1 && set.member[0] == 1 && set.side[0] == QP_UPPER, "the second moved up");
  T_RATIO(fabs(fabs(set.t[0]) - 1), 4 * DBL_EPSILON, "T of e1 alone");
  T_CHECK(qp_active_bound(&set, 0) == 0, "side of a member");
  qp_active_free(ctx, &set);
}

/* Sums of rows depend, rows 1e-9 beside the sum do not, at any scale of the unknowns. */
static void test_dependence(batten_context *ctx, double condition, double unknowns) {
  enum { n = 12 };
  scene s = make_scene(n, 8, condition, 11);
  connect(&s);
  for (size_t l = 0; l < 2; l++) { /* rows 4 and 5: combinations of 0, 1, 2; 5 is off */
    double square = 0;
    for (size_t j = 0; j < n; j++) {
      double *a = s.dense + j;
      a[(4 + l) * n] =
          s.scale[0] * a[0] - 2 * s.scale[1] * a[n] + 0.5 * s.scale[2] * a[2 * n] + (l && j == 7 ? 1e-9 : 0);
      square += a[(4 + l) * n] * a[(4 + l) * n];
    }
    s.scale[4 + l] = 1 / sqrt(square);
  }
  for (size_t j = 0; j < n; j += 2) { /* in unknowns of other size */
    for (size_t i = 0; i <= j; i++) s.r[i + j * n] *= unknowns;
    for (size_t k = 0; k < 8; k++) s.dense[k * n + j] *= unknowns;
  }
  qp_active set;
  T_OK(qp_active_new(ctx, &s.objective, &s.rows, &set), ctx);
  double d[n];
  for (size_t k = 0; k < 3; k++) {
    qp_active_project(&set, k, d);
    qp_active_add(&set, k, QP_LOWER, d);
  }
  qp_active_project(&set, 4, d);
  T_CHECK(qp_active_depends(&set, 4, d), "a combination depends, condition %.0e, unknowns times %g", condition,
          unknowns);
  qp_active_project(&set, 5, d);
  T_CHECK(!qp_active_depends(&set, 5, d), "1e-9 beside it does not");
  qp_active_reset(&set, s.c);
  size_t k[5] = {4, 0, 2, 1, 0};
  signed char side[5] = {QP_UPPER, QP_LOWER, QP_LOWER, QP_LOWER, QP_LOWER};
  T_OK(qp_active_add_many(ctx, &set, 5, k, side), ctx);
  bool twice = false, sides = true;
  for (size_t p = 0; p < set.q; p++) {
    sides = sides && set.side[p] == (set.member[p] == 4 ? QP_UPPER : QP_LOWER);
    for (size_t o = 0; o < p; o++) twice = twice || set.member[o] == set.member[p];
  }
  T_CHECK(set.q == 3 && !twice && sides, "of five rows of rank three, three are taken with their sides: %zu", set.q);
  qp_active_free(ctx, &set);
  free_scene(&s);
}

static batten_status all_calls(batten_context *ctx, void *arg) {
  scene *s = arg;
  qp_active set;
  batten_status st = qp_active_new(ctx, &s->objective, &s->rows, &set);
  size_t k[4] = {0, 1, 2, 3};
  signed char side[4] = {QP_LOWER, QP_LOWER, QP_LOWER, QP_LOWER};
  if (st == BATTEN_OK) st = qp_active_add_many(ctx, &set, 4, k, side);
  qp_active_free(ctx, &set);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_hand(ctx);
  test_inverse(ctx, 1e2);
  test_inverse(ctx, 1e12);
  size_t sizes[] = {1, 2, 3, 7, 20, 48, 90};
  for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
    test_updates(ctx, sizes[i], 10, 100 + i);
    test_updates(ctx, sizes[i], 1e6, 200 + i);
    test_updates(ctx, sizes[i], 1e12, 300 + i);
  }
  test_dependence(ctx, 10, 1);
  test_dependence(ctx, 1e8, 1);
  test_dependence(ctx, 1e2, 0x1p40);
  scene s = make_scene(6, 8, 10, 1);
  connect(&s);
  t_fail_every_allocation("a working set", all_calls, &s);
  free_scene(&s);
  batten_context_free(ctx);
  return t_done();
}
