/* Objectives: R'R against P and target against gradient in long double; what is convex, singular, indefinite by
 * 1e-10; the sparse Hessian against the dense one; the same bits however columns are scaled by powers of two. */
#include "la/la.h"
#include "qp/certify.h"
#include "qp/matrix_row.h"
#include "qp/objective.h"
#include "tap.h"

static double uniform(uint64_t *seed) { return 2 * t_uniform(seed) - 1; }
static double *vector(size_t count, uint64_t *seed) {
  double *v = malloc((count + 1) * sizeof *v);
  for (size_t i = 0; i < count; i++) v[i] = uniform(seed);
  return v;
}

static double row_product(const batten_matrix *a, size_t i, const double *x) {
  qp_matrix_row row = qp_row_of(a, i);
  double sum = 0;
  for (size_t e = 0; e < row.count; e++) sum += row.values[e] * x[qp_row_column(&row, e)];
  return sum;
}

/* The objective at x as it is stated, without the constant. */
static double value_at(const batten_qp_problem *p, const double *x) {
  double squares = 0, energy = 0, linear = 0;
  for (size_t i = 0; p->a && i < p->a->rows; i++) {
    double residual = row_product(p->a, i, x) - (p->b ? p->b[i] : 0);
    squares += (p->weights ? p->weights[i] : 1) * residual * residual;
  }
  for (size_t i = 0; p->h && i < p->n; i++) energy += x[i] * row_product(p->h, i, x);
  for (size_t j = 0; p->g && j < p->n; j++) linear += p->g[j] * x[j];
  return 0.5 * squares + 0.5 * energy + linear;
}

/* s [n][n] := H S H, H a random reflection. */
static void reflect(size_t n, double *s, uint64_t *seed) {
  double *v = vector(n, seed), square = 0;
  for (size_t i = 0; i < n; i++) square += v[i] * v[i];
  for (int side = 0; side < 2; side++) {
    for (size_t j = 0; j < n; j++) {
      double along = 0;
      for (size_t i = 0; i < n; i++) along += v[i] * s[side ? j * n + i : i * n + j];
      for (size_t i = 0; i < n; i++) s[side ? j * n + i : i * n + j] -= 2 * along / square * v[i];
    }
  }
  free(v);
}

/* Symmetric [n][n] with these eigenvalues, columns and rows times 2^-spread .. 2^spread. */
static double *with_spectrum(size_t n, const double *eigenvalues, int spread, uint64_t *seed) {
  double *s = calloc(n * n + 1, sizeof *s);
  for (size_t i = 0; i < n; i++) s[i * n + i] = eigenvalues[i];
  for (int round = 0; round < 3; round++) reflect(n, s, seed);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < i; j++) s[i * n + j] = s[j * n + i];
  int *power = malloc((n + 1) * sizeof *power);
  for (size_t i = 0; i < n; i++) power[i] = (int)floor(spread * uniform(seed));
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) s[i * n + j] = ldexp(s[i * n + j], power[i] + power[j]);
  free(power);
  return s;
}

/* ---- Factor ---- */

/* (A'WA + H)_ij in long double. */
static long double entry(const batten_qp_problem *p, size_t i, size_t j) {
  long double sum = p->h ? p->h->dense[i * p->n + j] : 0;
  for (size_t r = 0; p->a && r < p->a->rows; r++)
    sum += (p->weights ? (long double)p->weights[r] : 1) * p->a->dense[r * p->n + i] * p->a->dense[r * p->n + j];
  return sum;
}

/* Factor at rho: R'R against P + rho D^2 and R'(R x - target) against gradient + rho D^2 (x - center), relative to
 * the metric. */
static void check_factor(batten_context *ctx, const batten_qp_problem *p, double rho, const char *what) {
  size_t n = p->n, index = 77;
  uint64_t seed = 5;
  double *r = malloc((n * n + 1) * sizeof *r), *base = malloc((n + 1) * sizeof *base),
         *ray = malloc((n + 1) * sizeof *ray);
  double *x = vector(n, &seed), *center = vector(n, &seed), *target = malloc((n + 1) * sizeof *target);
  double *gradient = malloc((n + 1) * sizeof *gradient);
  qp_objective o;
  T_OK(qp_objective_new(ctx, p, &o), ctx);
  T_OK(qp_objective_factor(ctx, &o, rho, r, base, &index, ray), ctx);
  double worst = 0, largest = 0, off = 0;
  for (size_t j = 0; j < n; j++) {
    for (size_t i = 0; i <= j; i++) {
      long double sum = 0, whole = entry(p, i, j) + (i == j ? (long double)rho * o.metric[j] * o.metric[j] : 0);
      for (size_t q = 0; q <= i; q++) sum += (long double)r[q + i * n] * r[q + j * n];
      worst = fmax(worst, (double)fabsl(sum - whole) / o.metric[i] / o.metric[j]);
      largest = fmax(largest, (double)fabsl(whole) / o.metric[i] / o.metric[j]);
    }
    for (size_t i = j + 1; i < n; i++) off = fmax(off, fabs(r[i + j * n]));
    off = fmax(off, r[j + j * n] > 0 ? 0 : 1);
  }
  double bound = 4 * (double)(n + 10) * 0x1p-52; /* and what is left out of a semidefinite H as rounding */
  T_RATIO(worst / fmax(largest, 1), p->h && p->a ? bound + 1e-12 : bound, "%s, rho %g, n = %zu: R'R", what, rho, n);
  T_CHECK(off == 0, "R is upper triangular, diagonal positive");

  qp_objective_target(&o, rho, r, base, center, target);
  for (size_t j = 0; j < n; j++) x[j] /= o.metric[j], center[j] /= o.metric[j];
  qp_objective_target(&o, rho, r, base, center, target);
  qp_objective_gradient(&o, x, gradient);
  worst = 0;
  for (size_t j = 0; j < n; j++) {
    long double sum = 0;
    for (size_t i = 0; i <= j; i++) {
      long double row = -(long double)target[i];
      for (size_t q = i; q < n; q++) row += (long double)r[i + q * n] * x[q];
      sum += row * r[i + j * n];
    }
    long double other = gradient[j] + (long double)rho * o.metric[j] * o.metric[j] * ((long double)x[j] - center[j]);
    worst = fmax(worst, (double)fabsl(sum - other) / o.metric[j]);
  }
  double size = 1;
  for (size_t j = 0; j < n; j++) size = fmax(size, fabs(target[j]));
  T_RATIO(worst / size, 10 * bound, "its target");

  /* the value's differences are the gradient's products: exact for quadratics */
  double plus, minus, slope = 0, h = 0x1p-8;
  for (size_t j = 0; j < n; j++) slope += gradient[j] * center[j], x[j] += h * center[j];
  plus = value_at(o.problem, x);
  for (size_t j = 0; j < n; j++) x[j] -= 2 * h * center[j];
  minus = value_at(o.problem, x);
  T_RATIO(fabs((plus - minus) / (2 * h) - slope), 1e-10 * (1 + fabs(plus)), "value against gradient");
  qp_objective_free(ctx, &o);
  free(gradient), free(target), free(center), free(x), free(ray), free(base), free(r);
}

static void test_factors(batten_context *ctx) {
  uint64_t seed = 11;
  static const size_t sizes[][2] = {{1, 1}, {2, 3}, {7, 5}, {20, 700}, {48, 60}}; /* n, k; the 4th by blocks */
  for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++) {
    size_t n = sizes[q][0], k = sizes[q][1];
    double *a = vector(k * n, &seed), *b = vector(k, &seed), *g = vector(n, &seed), *w = vector(k, &seed);
    double *eigenvalues = vector(n, &seed);
    for (size_t i = 0; i < k; i++) w[i] = i % 3 ? w[i] * w[i] : 0;
    for (size_t i = 0; i < n; i++) eigenvalues[i] = i % 2 ? 0 : fabs(eigenvalues[i]) + 0.1;
    double *tension = with_spectrum(n, eigenvalues, 0, &seed);
    batten_matrix rows = batten_matrix_dense(k, n, a), h = batten_matrix_dense(n, n, tension);
    batten_qp_problem p = {.struct_size = sizeof p, .n = n, .a = &rows, .b = b, .g = g};
    check_factor(ctx, &p, k >= n ? 0 : 1e-3, "A");
    check_factor(ctx, &p, 1e-6, "A");
    p.weights = w;
    p.h = &h;
    check_factor(ctx, &p, 1e-6, "A, w, H");
    p.a = NULL;
    check_factor(ctx, &p, 1e-6, "semidefinite H");
    for (size_t i = 0; i < n; i++) eigenvalues[i] = pow(10, -10.0 * (double)i / (double)n);
    double *definite = with_spectrum(n, eigenvalues, 12, &seed);
    batten_matrix hd = batten_matrix_dense(n, n, definite);
    p.h = &hd;
    check_factor(ctx, &p, 0, "definite H, scaled");
    free(definite), free(tension), free(eigenvalues), free(w), free(g), free(b), free(a);
  }
}

/* Unknowns j, j + groups, .. meet in rows of A alone and, with a Hessian, one pair more across two groups: their
 * factors are made apart, and together where one has too few rows. */
static void test_groups(batten_context *ctx, size_t groups, size_t rows_of_last, bool hessian, double rho) {
  enum { N = 14, K = 60 };
  uint64_t seed = 3;
  double *a = calloc(K * N, sizeof *a), *b = vector(K, &seed), *g = vector(N, &seed), h[N * N] = {0}, w[K];
  for (size_t i = 0, last = 0; i < K; i++) {
    size_t mine = i % groups;
    w[i] = i % 5 == 3 ? 1e-6 : 1 + t_uniform(&seed);
    if (mine == groups - 1 && last++ >= rows_of_last) continue; /* a row of zeros */
    for (size_t j = mine; j < N; j += groups) a[i * N + j] = uniform(&seed);
  }
  h[0] = h[1 * N + 1] = 2, h[1] = h[N] = 1;
  batten_matrix rows = batten_matrix_dense(K, N, a), tension = batten_matrix_dense(N, N, h);
  batten_qp_problem p = batten_qp_problem_default(N);
  p.a = &rows, p.b = b, p.g = g, p.weights = w;
  if (hessian) p.h = &tension;
  char what[80];
  snprintf(what, sizeof what, "%zu groups, %zu rows in the last%s", groups, rows_of_last, hessian ? ", joined" : "");
  check_factor(ctx, &p, rho, what);
  free(g), free(b), free(a);
}

/* Two unknowns by hand: (x + y - 2)^2 / 2 + 4 y^2 / 2. */
static void test_by_hand(batten_context *ctx) {
  static const double a[] = {1, 1, 0, 2}, b[] = {2, 0};
  batten_matrix rows = batten_matrix_dense(2, 2, a);
  batten_qp_problem p = {.struct_size = sizeof p, .n = 2, .a = &rows, .b = b};
  qp_objective o;
  double r[4], base[2], ray[2], at[] = {3, 1}, gradient[2];
  size_t index;
  T_OK(qp_objective_new(ctx, &p, &o), ctx);
  T_OK(qp_objective_factor(ctx, &o, 0, r, base, &index, ray), ctx);
  T_RATIO(fabs(r[0] - 1) + fabs(r[2] - 1) + fabs(r[3] - 2) + fabs(r[1]), 1e-15, "R of a triangle is itself");
  T_RATIO(fabs(base[0] - 2) + fabs(base[1]), 1e-15, "and its target b");
  qp_objective_gradient(&o, at, gradient);
  T_CHECK(gradient[0] == 2 && gradient[1] == 6 && value_at(o.problem, at) == 4, "gradient and value by hand");
  T_CHECK(o.metric[0] == 1 && o.metric[1] == 2, "metric: %g %g", o.metric[0], o.metric[1]);
  qp_objective_free(ctx, &o);

  batten_qp_problem none = {.struct_size = sizeof none};
  T_OK(qp_objective_new(ctx, &none, &o), ctx);
  T_OK(qp_objective_factor(ctx, &o, 0, r, base, &index, ray), ctx);
  T_CHECK(value_at(o.problem, at) == 0, "nothing has the value 0");
  qp_objective_free(ctx, &o);

  batten_matrix thin = batten_matrix_dense(2, 0, NULL);
  none.a = &thin, none.b = b;
  T_OK(qp_objective_new(ctx, &none, &o), ctx);
  T_OK(qp_objective_factor(ctx, &o, 1, r, base, &index, ray), ctx);
  T_CHECK(value_at(o.problem, at) == 2, "rows without unknowns have a value");
  qp_objective_free(ctx, &o);

  batten_qp_problem linear = {.struct_size = sizeof linear, .n = 2, .g = b};
  T_OK(qp_objective_new(ctx, &linear, &o), ctx);
  T_STATUS(qp_objective_factor(ctx, &o, 0, r, base, &index, ray), BATTEN_E_SINGULAR, ctx, "not strictly convex");
  T_OK(qp_objective_factor(ctx, &o, 0.25, r, base, &index, ray), ctx);
  T_CHECK(r[0] == 0.5 && r[3] == 0.5 && base[0] == -4 && base[1] == 0, "a linear objective with a proximal term");
  qp_objective_free(ctx, &o);
}

/* Least squares of condition 1e10 with a known solution: by QR the error is that of A's condition, not of its square.
 */
static void test_condition(batten_context *ctx) {
  enum { N = 20, K = 40 };
  uint64_t seed = 3;
  double eigenvalues[K] = {0}, solution[N], b[K], r[N * N], base[N], ray[N], x[N];
  for (size_t j = 0; j < N; j++) eigenvalues[j] = pow(10, -10.0 * (double)j / (N - 1)), solution[j] = uniform(&seed);
  double *s = with_spectrum(K, eigenvalues, 0, &seed), *a = malloc(K * N * sizeof *a);
  for (size_t i = 0; i < K; i++) {
    long double sum = 0;
    for (size_t j = 0; j < N; j++)
      sum += (long double)(a[i * N + j] = s[i * K + j] * (j < N / 2 ? 1 : 0x1p-30)) * solution[j];
    b[i] = (double)sum;
  }
  batten_matrix rows = batten_matrix_dense(K, N, a);
  batten_qp_problem p = {.struct_size = sizeof p, .n = N, .a = &rows, .b = b};
  qp_objective o;
  size_t index;
  double rcond, worst = 0;
  T_OK(qp_objective_new(ctx, &p, &o), ctx);
  T_OK(qp_objective_factor(ctx, &o, 0, r, base, &index, ray), ctx);
  memcpy(x, base, sizeof x);
  batten_la_trsv(BATTEN_LA_DOUBLE, 'U', 'N', N, r, N, x);
  for (size_t j = 0; j < N; j++) {
    worst = fmax(worst, fabs(x[j] - solution[j]) * o.metric[j]);
    for (size_t i = 0; i <= j; i++) r[i + j * N] /= o.metric[j];
  }
  T_OK(batten_la_trcon(ctx, N, r, N, &rcond), ctx);
  T_RATIO(worst * rcond, 1e-14, "error over condition %.2g, columns apart by 1e9", 1 / rcond);
  T_CHECK(rcond < 1e-8, "the problem is hard");
  qp_objective_free(ctx, &o);
  free(a), free(s);
}

/* Weights 1e16 apart: the heavy rows hold to rounding, and the others' solution among what is left is as good as if
 * the heavy ones were constraints. Two unknowns are held, x_0 + x_1 = 1 and x_1 - x_2 = 0.5, wherever their rows
 * stand. */
static void test_weights(batten_context *ctx) {
  enum { N = 3, K = 40 };
  uint64_t seed = 8;
  for (size_t at = 0; at < K; at += K / 2 - 1) {
    double a[K * N], b[K], w[K], r[N * N], x[N], ray[N], square = 0, along = 0;
    for (size_t i = 0; i < K; i++) {
      b[i] = uniform(&seed), w[i] = 1;
      for (size_t j = 0; j < N; j++) a[i * N + j] = uniform(&seed);
    }
    memcpy(a + at * N, (double[]){1, 1, 0, 0, 1, -1}, 2 * N * sizeof *a);
    b[at] = 1, b[at + 1] = 0.5, w[at] = w[at + 1] = 1e16;
    /* x = (1, 0, -0.5) + t (-1, 1, 1), t by least squares of the light rows: right to 1e-16 */
    for (size_t i = 0; i < K; i++) {
      if (i == at || i == at + 1) continue;
      double slope = a[i * N + 1] + a[i * N + 2] - a[i * N];
      square += slope * slope, along += slope * (b[i] - (a[i * N] - 0.5 * a[i * N + 2]));
    }
    batten_matrix rows = batten_matrix_dense(K, N, a);
    batten_qp_problem p = {.struct_size = sizeof p, .n = N, .a = &rows, .b = b, .weights = w};
    qp_objective o;
    size_t index;
    T_OK(qp_objective_new(ctx, &p, &o), ctx);
    T_OK(qp_objective_factor(ctx, &o, 0, r, x, &index, ray), ctx);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'U', 'N', N, r, N, x);
    T_RATIO(fabs(x[1] - along / square) + fabs(x[0] - 1 + x[1]) + fabs(x[1] - x[2] - 0.5), 1e-14,
            "heavy rows from %zu on", at);
    qp_objective_free(ctx, &o);
  }
}

/* Columns times powers of two: the same bits of R, so scaled, and the same target. */
static void test_scaling(batten_context *ctx) {
  enum { N = 9, K = 30 };
  uint64_t seed = 21;
  double *a = vector(K * N, &seed), *b = vector(K, &seed), r[2][N * N], base[2][N], ray[N];
  double *scaled = malloc(K * N * sizeof *scaled);
  int power[N];
  for (size_t j = 0; j < N; j++) power[j] = (int)(60 * uniform(&seed));
  for (size_t q = 0; q < K * N; q++) scaled[q] = ldexp(a[q], power[q % N]);
  for (int q = 0; q < 2; q++) {
    batten_matrix rows = batten_matrix_dense(K, N, q ? scaled : a);
    batten_qp_problem p = {.struct_size = sizeof p, .n = N, .a = &rows, .b = b};
    qp_objective o;
    size_t index;
    T_OK(qp_objective_new(ctx, &p, &o), ctx);
    T_OK(qp_objective_factor(ctx, &o, 1e-3, r[q], base[q], &index, ray), ctx);
    qp_objective_free(ctx, &o);
  }
  bool same = !memcmp(base[0], base[1], sizeof base[0]);
  for (size_t q = 0; q < N * N; q++) same = same && ldexp(r[0][q], power[q / N]) == r[1][q];
  T_CHECK(same, "the same bits however columns are scaled");
  free(scaled), free(b), free(a);
}

/* ---- Convexity ---- */

/* Status at rho of an H alone, and beside an A; the judge agrees. */
static batten_status judge(batten_context *ctx, size_t n, const double *values, double rho, bool with_a) {
  batten_matrix h = batten_matrix_dense(n, n, values);
  double *a = calloc(n * n + 1, sizeof *a), *r = malloc((n * n + 1) * sizeof *r),
         *base = malloc((n + 1) * sizeof *base);
  double *ray = calloc(n + 1, sizeof *ray);
  for (size_t i = 0; i < n; i++) a[i * n + i] = 1;
  batten_matrix rows = batten_matrix_dense(n, n, a);
  batten_qp_problem p = {.struct_size = sizeof p, .n = n, .h = &h, .a = with_a ? &rows : NULL};
  qp_objective o;
  size_t index = n;
  batten_status st = qp_objective_new(ctx, &p, &o);
  if (st >= 0) st = qp_objective_factor(ctx, &o, rho, r, base, &index, ray);
  if (st == BATTEN_E_NOT_CONVEX && !qp_certify_not_convex(&p, ray)) st = BATTEN_E_INTERNAL;
  if (st == BATTEN_E_NOT_CONVEX && !(index < n && ray[index] != 0)) st = BATTEN_E_INTERNAL;
  qp_objective_free(ctx, &o);
  free(ray), free(base), free(r), free(a);
  return st;
}

static void test_indefinite(batten_context *ctx) {
  uint64_t seed = 9;
  static const size_t sizes[] = {2, 3, 10, 50, 120};
  static const double by[] = {1, 1e-4, 1e-8, 1e-10};
  size_t missed = 0, wrong = 0, tried = 0;
  for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++)
    for (size_t e = 0; e < sizeof by / sizeof *by; e++)
      for (size_t kind = 0; kind < 6; kind++) {
        size_t n = sizes[q];
        int spread = kind < 3 ? 0 : e < 2 ? 25 : 2; /* a little below 0 and far apart in units looks like rounding */
        double *eigenvalues = vector(n, &seed);
        /* others: of size one; half of them 0; falling to 1e-12 */
        for (size_t i = 0; i < n; i++)
          eigenvalues[i] = kind % 3 == 0   ? 1 + fabs(eigenvalues[i])
                           : kind % 3 == 1 ? (double)(i % 2)
                                           : pow(10, -12.0 * (double)i / (double)n);
        eigenvalues[n - 1 - n / 3] = -by[e];
        double *h = with_spectrum(n, eigenvalues, spread, &seed);
        batten_status alone = judge(ctx, n, h, 0, false), shifted = judge(ctx, n, h, 1e-2, false);
        batten_status beside = judge(ctx, n, h, 0, true);
        bool all = alone == BATTEN_E_NOT_CONVEX && shifted == BATTEN_E_NOT_CONVEX && beside == BATTEN_E_NOT_CONVEX;
        if (!all) printf("# n %zu, by %g, kind %zu: %d %d %d\n", n, by[e], kind, alone, shifted, beside);
        missed += !all;
        free(h);
        eigenvalues[n - 1 - n / 3] = 0;
        h = with_spectrum(n, eigenvalues, spread, &seed);
        alone = judge(ctx, n, h, 0, false), shifted = judge(ctx, n, h, 1e-6, false),
        beside = judge(ctx, n, h, 0, true);
        /* rounding may leave it definite, of condition 1e13 or more */
        all = (alone == BATTEN_E_SINGULAR || (n < 10 && alone == BATTEN_OK)) && shifted == BATTEN_OK &&
              beside == BATTEN_OK;
        if (!all) printf("# n %zu, 0 for %g, kind %zu: %d %d %d\n", n, by[e], kind, alone, shifted, beside);
        wrong += !all;
        free(h), free(eigenvalues);
        tried++;
      }
  T_CHECK(missed == 0, "indefinite by 1 to 1e-10 of the scale: %zu of %zu missed", missed, tried);
  T_CHECK(wrong == 0, "semidefinite up to rounding: %zu of %zu called otherwise", wrong, tried);
}

static void test_small_indefinite(batten_context *ctx) {
  static const double zero_diagonal[] = {0, 1, 1, 0}, half[] = {0, 1e-3, 1e-3, 1}, negative[] = {1, 0, 0, -1e-10};
  static const double minor[] = {1, 1, 1, 1 - 1e-10}, far[] = {1e300, 0, 0, -1e-300}, zeros[] = {0, 0, 0, 0};
  static const double ulp[] = {1, 1, 1, 1 - 0x1p-53}, noise[] = {1, 1e-17, 1e-17, 0}, tiny[] = {0x1p-1060, 0, 0, 1};
  static const double all_negative[] = {-1, -1, -1, -1}, noisy_negative[] = {1, 0, 0, -1e-17};
  static const struct {
    const char *what;
    const double *h;
    bool convex;
  } cases[] = {{"zero diagonal", zero_diagonal, false},
               {"half a zero diagonal", half, false},
               {"negative entry", negative, false},
               {"minor", minor, false},
               {"a minor by an ulp", ulp, true},
               {"rounding beside a zero", noise, true},
               {"zeros", zeros, true},
               {"subnormal entry", tiny, true},
               {"all negative", all_negative, false},
               {"negative rounding", noisy_negative, true},
               {"sizes apart by 1e600", far, true}};
  for (size_t q = 0; q < sizeof cases / sizeof *cases; q++) {
    batten_status st = judge(ctx, 2, cases[q].h, 0x1p-10, false), beside = judge(ctx, 2, cases[q].h, 0, true);
    batten_status expected = cases[q].convex ? BATTEN_OK : BATTEN_E_NOT_CONVEX;
    T_CHECK(st == expected && beside == expected, "%s: %s, %s", cases[q].what, batten_status_name(st),
            batten_status_name(beside));
    batten_matrix h = batten_matrix_dense(2, 2, cases[q].h);
    batten_qp_problem p = {.struct_size = sizeof p, .n = 2, .h = &h};
    qp_objective o;
    size_t index = 2;
    double ray[2];
    T_OK(qp_objective_new(ctx, &p, &o), ctx);
    st = qp_hessian_minors(ctx, &h, &index, ray);
    T_CHECK(st == expected && (st == BATTEN_OK || (index < 2 && qp_certify_not_convex(&p, ray))), "by minors: %s",
            st ? batten_error(ctx) : "convex");
    qp_objective_free(ctx, &o);
  }
}

/* Banded H, sparse, n unknowns in shuffled order: L D L' of bidiagonal L with one pivot `by` among pivots of 1, so
 * that no minor of two rows tells. Columns times powers of two. */
static void test_sparse_indefinite(batten_context *ctx, size_t n, double by, uint64_t seed) {
  size_t *starts = malloc((n + 1) * sizeof *starts), *place = malloc(n * sizeof *place), entries = 0, odd = n / 3;
  uint32_t *indices = malloc(3 * n * sizeof *indices);
  double *values = malloc(3 * n * sizeof *values), *ray = malloc(n * sizeof *ray);
  for (size_t i = 0; i < n; i++) place[i] = i;
  for (size_t i = n; i-- > 1;) {
    size_t j = t_random(&seed) % (i + 1), k = place[i];
    place[i] = place[j], place[j] = k;
  }
  size_t *node = malloc(n * sizeof *node);
  for (size_t i = 0; i < n; i++) node[place[i]] = i;
  for (size_t i = 0; i < n; i++) {
    size_t q = node[i];
    starts[i] = entries;
    for (size_t r = q > 0 ? q - 1 : 0; r < n && r <= q + 1; r++) {
      double low = r < q ? (double)(r % 5) / 4 : (double)(q % 5) / 4, pivot = q == odd ? by : 1,
             before = q == odd + 1 ? by : 1;
      double l_before = q > 0 ? (double)((q - 1) % 5) / 4 : 0;
      if (r == q)
        values[entries] = pivot + l_before * l_before * (q > 0 ? before : 0);
      else
        values[entries] = low * ((r < q ? r : q) == odd ? by : 1);
      values[entries] = ldexp(values[entries], (int)(q % 7) + (int)(r % 7));
      indices[entries++] = (uint32_t)place[r];
    }
  }
  starts[n] = entries;
  batten_matrix h = batten_matrix_sparse(n, n, starts, indices, values);
  batten_qp_problem p = {.struct_size = sizeof p, .n = n, .h = &h};
  qp_objective o;
  size_t index = n;
  double before = batten_now();
  T_OK(qp_objective_new(ctx, &p, &o), ctx);
  batten_status st = qp_objective_convex(ctx, &o, &index, ray);
  T_CHECK(st == (by < 0 ? BATTEN_E_NOT_CONVEX : BATTEN_OK), "n = %zu, pivot %g: %s, %.2g ms", n, by,
          st ? batten_error(ctx) : "convex", 1e3 * (batten_now() - before));
  if (by < 0) T_CHECK(index < n && ray[index] != 0 && qp_certify_not_convex(&p, ray), "the judge agrees");
  qp_objective_free(ctx, &o);
  free(node), free(ray), free(values), free(indices), free(place), free(starts);
}

/* ---- Sparse ---- */

static void test_sparse(batten_context *ctx, size_t n, size_t k, bool dense_a, uint64_t seed) {
  double *a = calloc(k * n + 1, sizeof *a), *b = vector(k, &seed), *w = vector(k, &seed), *g = vector(n, &seed);
  double *h = calloc(n * n + 1, sizeof *h), *values = malloc((5 * k + 1) * sizeof *values);
  size_t *starts = malloc((k + 1) * sizeof *starts), entries = starts[0] = 0;
  uint32_t *indices = malloc((5 * k + 1) * sizeof *indices);
  for (size_t i = 0; i < k; i++) {
    w[i] = fabs(w[i]);
    for (size_t e = 0; e < 5 && e < n; e++) {
      size_t j = (i * 7 + 3 * e * e) % n;
      bool met = a[i * n + j] != 0;
      if (met) continue;
      indices[entries] = (uint32_t)j;
      values[entries++] = a[i * n + j] = uniform(&seed);
    }
    starts[i + 1] = entries;
  }
  for (size_t j = 0; j + 1 < n; j += 2)
    h[j * n + j] = 2, h[j * n + j + 1] = h[(j + 1) * n + j] = 1, h[(j + 1) * n + j + 1] = 1;
  batten_matrix rows = dense_a ? batten_matrix_dense(k, n, a) : batten_matrix_sparse(k, n, starts, indices, values);
  batten_matrix plain = batten_matrix_dense(k, n, a), tension = batten_matrix_dense(n, n, h), hessian;
  batten_qp_problem p = {.struct_size = sizeof p, .n = n, .a = &rows, .b = b, .weights = w, .g = g, .h = &tension};
  batten_qp_problem second = p;
  second.a = &plain;
  qp_objective o;
  qp_sparse s;
  void *memory = NULL;
  T_OK(qp_objective_new(ctx, &p, &o), ctx);
  T_OK(qp_objective_sparse(ctx, &o, &s, &hessian, &memory), ctx);
  double *full = calloc(n * n + 1, sizeof *full), *zero = calloc(n + 1, sizeof *zero),
         *q = malloc((n + 1) * sizeof *q);
  bool sorted = s.h == &hessian && s.n == n;
  size_t diagonals = 0;
  for (size_t i = 0; i < n; i++)
    for (size_t e = hessian.starts[i]; e < hessian.starts[i + 1]; e++) {
      sorted = sorted && (e == hessian.starts[i] || hessian.indices[e] > hessian.indices[e - 1]);
      full[i * n + hessian.indices[e]] = hessian.values[e];
      diagonals += hessian.indices[e] == i;
    }
  double worst = 0;
  bool symmetric = true;
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) {
      worst = fmax(worst, (double)fabsl(full[i * n + j] - entry(&second, i, j)));
      symmetric = symmetric && full[i * n + j] == full[j * n + i];
    }
  T_CHECK(sorted && symmetric && diagonals == n, "n = %zu, k = %zu, %s A: sorted, symmetric, all diagonals", n, k,
          dense_a ? "dense" : "sparse");
  T_RATIO(worst, 1e-13, "P");
  qp_objective_gradient(&o, zero, q);
  worst = 0;
  for (size_t j = 0; j < n; j++) worst = fmax(worst, fabs(q[j] - s.g[j]));
  T_RATIO(worst, 1e-13, "q is the gradient at 0");
  batten_free(ctx, memory);
  qp_objective_free(ctx, &o);
  free(q), free(zero), free(full), free(indices), free(starts), free(values), free(h), free(g), free(w), free(b),
      free(a);
}

/* 1e5 unknowns: nothing [n][n]. */
static void test_large(batten_context *ctx) {
  size_t n = 100000, k = n - 2, *starts = malloc((k + 1) * sizeof *starts);
  uint32_t *indices = malloc(3 * k * sizeof *indices);
  double *values = malloc(3 * k * sizeof *values);
  for (size_t i = 0; i <= k; i++) starts[i] = 3 * i;
  for (size_t e = 0; e < 3 * k; e++) indices[e] = (uint32_t)(e / 3 + e % 3), values[e] = e % 3 == 1 ? -2 : 1;
  batten_matrix a = batten_matrix_sparse(k, n, starts, indices, values), h;
  batten_qp_problem p = {.struct_size = sizeof p, .n = n, .a = &a};
  qp_objective o;
  qp_sparse s;
  void *memory;
  double before = batten_now();
  T_OK(qp_objective_new(ctx, &p, &o), ctx);
  T_OK(qp_objective_sparse(ctx, &o, &s, &h, &memory), ctx);
  size_t middle = h.starts[n / 2];
  T_CHECK(
      h.starts[n] == 5 * n - 6 && h.values[middle] == 1 && h.values[middle + 1] == -4 && h.values[middle + 2] == 6,
      "second differences of %zu unknowns: 1 -4 6 -4 1, in %.3g ms", n, 1e3 * (batten_now() - before));
  batten_free(ctx, memory);
  qp_objective_free(ctx, &o);
  free(values), free(indices), free(starts);
}

/* ---- Memory ---- */

static batten_status with_memory(batten_context *ctx, void *arg) {
  const batten_qp_problem *p = arg;
  qp_objective o;
  double r[4], base[2], ray[2];
  size_t index;
  batten_status st = qp_objective_new(ctx, p, &o);
  if (st < 0) return st;
  st = qp_objective_factor(ctx, &o, 0, r, base, &index, ray);
  if (st >= 0) st = qp_objective_factor(ctx, &o, 1e-3, r, base, &index, ray);
  if (st >= 0) st = qp_objective_convex(ctx, &o, &index, ray);
  void *memory = NULL;
  qp_sparse s;
  batten_matrix h;
  if (st >= 0) st = qp_objective_sparse(ctx, &o, &s, &h, &memory);
  batten_free(ctx, memory);
  qp_objective_free(ctx, &o);
  return st;
}

static void test_memory(void) {
  static const double a[] = {1, 2, 3, 5}, h[] = {1, 1, 1, 1}, definite[] = {2, 1, 1, 2}, g[] = {1, 1};
  batten_matrix rows = batten_matrix_dense(2, 2, a), tension = batten_matrix_dense(2, 2, h);
  batten_matrix hessian = batten_matrix_dense(2, 2, definite);
  batten_qp_problem p = {.struct_size = sizeof p, .n = 2, .a = &rows, .h = &tension, .g = g};
  t_fail_every_allocation("objective of squares", with_memory, &p);
  t_cancel_every_progress("objective of squares", with_memory, &p);
  p.a = NULL, p.h = &hessian;
  t_fail_every_allocation("objective by Hessian", with_memory, &p);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_groups(ctx, 3, 60, false, 0);
  test_groups(ctx, 3, 60, true, 0);
  test_groups(ctx, 3, 2, false, 0.5);
  test_groups(ctx, 7, 60, true, 0.01);
  test_groups(ctx, 14, 60, false, 0);
  test_by_hand(ctx);
  test_factors(ctx);
  test_condition(ctx);
  test_weights(ctx);
  test_scaling(ctx);
  test_indefinite(ctx);
  test_small_indefinite(ctx);
  for (size_t n = 70; n < 100000; n *= 30) {
    test_sparse_indefinite(ctx, n, 1e-3, n);
    test_sparse_indefinite(ctx, n, 0, n);
    test_sparse_indefinite(ctx, n, -1e-8, n);
    test_sparse_indefinite(ctx, n, -1, n);
  }
  test_sparse(ctx, 1, 1, false, 1);
  test_sparse(ctx, 12, 9, false, 2);
  test_sparse(ctx, 60, 300, false, 3);
  test_sparse(ctx, 60, 30, true, 4);
  test_sparse(ctx, 5, 0, true, 5);
  test_large(ctx);
  test_memory();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
