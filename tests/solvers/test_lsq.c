/* Least squares: by hand, QR against normal equations, tension against stacked rows, weights, rank, bad input. */
#include <batten/lsq.h>

#include "tap.h"

enum { M = 60, N = 7, Q = 3 };

static const batten_lsq_method methods[] = {BATTEN_LSQ_AUTO, BATTEN_LSQ_NORMAL, BATTEN_LSQ_QR};
static const char *const names[] = {"auto", "normal", "qr"};

typedef struct data {
  double a[M * N], b[M * Q], weights[M], tension[N * N], rows[N * N];
} data;

static data make_data(uint64_t seed) {
  data d;
  for (int i = 0; i < M * N; i++) d.a[i] = 2 * t_uniform(&seed) - 1;
  for (int i = 0; i < M * Q; i++) d.b[i] = 2 * t_uniform(&seed) - 1;
  for (int i = 0; i < M; i++) d.weights[i] = t_uniform(&seed);
  /* T = U'U with second differences: rank N - 2. */
  memset(d.rows, 0, sizeof d.rows);
  for (int i = 0; i + 2 < N; i++) d.rows[i * N + i] = 1, d.rows[i * N + i + 1] = -2, d.rows[i * N + i + 2] = 1;
  for (int i = 0; i < N; i++)
    for (int j = 0; j < N; j++) {
      double sum = 0;
      for (int q = 0; q < N; q++) sum += d.rows[q * N + i] * d.rows[q * N + j];
      d.tension[i * N + j] = sum;
    }
  return d;
}

static double difference(size_t n, const double *x, const double *y) {
  double worst = 0, norm = 0;
  for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(x[i] - y[i])), norm = fmax(norm, fabs(y[i]));
  return norm > 0 ? worst / norm : worst;
}

/* The line through (0, 1), (1, 3), (2, 4): slope 3/2, height 7/6. */
static void test_by_hand(batten_context *ctx) {
  double a[] = {1, 0, 1, 1, 1, 2}, b[] = {1, 3, 4}, x[2];
  for (int q = 0; q < 3; q++) {
    batten_lsq_options o = batten_lsq_options_default();
    batten_lsq_info info;
    o.method = methods[q];
    T_OK(batten_lsq_solve(ctx, 3, 2, 1, a, b, &o, x, &info), ctx);
    T_RATIO(fmax(fabs(x[0] - 7. / 6), fabs(x[1] - 1.5)), 1e-15, "line by %s: %g + %g t", names[q], x[0], x[1]);
    T_CHECK(fabs(info.residual_norm - sqrt(1. / 6)) < 1e-15 && info.gradient_norm < 1e-15 && info.rcond > 0.1,
            "residual %g, gradient %g, rcond %g", info.residual_norm, info.gradient_norm, info.rcond);
    T_CHECK(info.method == (q == 2 ? BATTEN_LSQ_QR : BATTEN_LSQ_NORMAL), "its method");
    /* tension 2 on the slope alone, one point (1, 3): x1 = 0 costs nothing, height 3 */
    double t[4] = {0, 0, 0, 2}, row[2] = {1, 1}, value[1] = {3};
    o.tension = t;
    T_OK(batten_lsq_solve(ctx, 1, 2, 1, row, value, &o, x, NULL), ctx);
    T_RATIO(fmax(fabs(x[0] - 3), fabs(x[1])), 1e-15, "fewer rows than unknowns, with tension: %g %g", x[0], x[1]);
  }
  T_OK(batten_lsq_solve(ctx, 0, 0, 0, NULL, NULL, NULL, NULL, NULL), ctx);
  T_OK(batten_lsq_solve(ctx, 3, 0, 1, NULL, b, NULL, NULL, NULL), ctx);
  T_OK(batten_lsq_solve(ctx, 3, 2, 0, a, NULL, NULL, NULL, NULL), ctx);
}

/* Weights against rows multiplied by their roots, tension against rows of its factor, both methods. */
static void test_second_routes(batten_context *ctx) {
  static double stacked[(M + N) * N], right[(M + N) * Q];
  double x[N * Q], y[N * Q];
  for (uint64_t seed = 1; seed <= 5; seed++) {
    data d = make_data(seed);
    memset(right, 0, sizeof right);
    memcpy(stacked + M * N, d.rows, sizeof d.rows);
    for (int i = 0; i < M; i++) {
      for (int j = 0; j < N; j++) stacked[i * N + j] = sqrt(d.weights[i]) * d.a[i * N + j];
      for (int q = 0; q < Q; q++) right[i * Q + q] = sqrt(d.weights[i]) * d.b[i * Q + q];
    }
    for (int q = 0; q < 9; q++) {
      batten_lsq_options o = batten_lsq_options_default(), plain = o;
      batten_lsq_info info;
      o.method = methods[q / 3];
      plain.method = methods[q % 3];
      o.weights = d.weights;
      o.tension = d.tension;
      batten_status st = batten_lsq_solve(ctx, M, N, Q, d.a, d.b, &o, x, &info);
      batten_lsq_solve(ctx, M + N, N, Q, stacked, right, &plain, y, NULL);
      T_CHECK(st == BATTEN_OK, "seed %d by %s: gradient %.2g", (int)seed, names[q / 3], info.gradient_norm);
      T_RATIO(difference(N * Q, x, y), 1e-13, "against stacked rows by %s", names[q % 3]);
      T_RATIO(info.gradient_norm, 1e-14, "gradient");
    }
  }
}

/* Columns in other units give the same bits, scaled; the order of rows changes rounding only. */
static void test_invariance(batten_context *ctx) {
  data d = make_data(7), e = d;
  double x[N * Q], y[N * Q];
  for (int i = 0; i < M; i++)
    for (int j = 0; j < N; j++) e.a[i * N + j] = ldexp(d.a[i * N + j], 100 * (j - 3));
  for (int method = 0; method < 3; method++) {
    batten_lsq_options o = batten_lsq_options_default();
    o.method = methods[method];
    T_OK(batten_lsq_solve(ctx, M, N, Q, d.a, d.b, &o, x, NULL), ctx);
    T_OK(batten_lsq_solve(ctx, M, N, Q, e.a, e.b, &o, y, NULL), ctx);
    for (int j = 0; j < N; j++)
      for (int q = 0; q < Q; q++) y[j * Q + q] = ldexp(y[j * Q + q], 100 * (j - 3));
    T_RATIO(difference(N * Q, y, x), 1e-13, "columns scaled by 2^-300 ... 2^300 by %s", names[method]);
  }
  for (int i = 0; i < M; i++) {
    memcpy(e.a + i * N, d.a + (M - 1 - i) * N, N * sizeof *e.a);
    memcpy(e.b + i * Q, d.b + (M - 1 - i) * Q, Q * sizeof *e.b);
  }
  batten_lsq_solve(ctx, M, N, Q, d.a, d.b, NULL, x, NULL);
  batten_lsq_solve(ctx, M, N, Q, e.a, e.b, NULL, y, NULL);
  T_RATIO(difference(N * Q, y, x), 1e-13, "rows reversed");
}

/* Units so large or small that products of entries leave the range of a double. */
static void test_extreme_units(batten_context *ctx) {
  static const int powers[][3] = {{700, 0, 0},     {-700, 0, 0},  {0, 900, 0},     {0, -900, 0},     {900, 900, 0},
                                  {-900, -900, 0}, {300, 0, 400}, {-300, 0, -400}, {-1030, -900, 0}, {0, 0, 900}};
  data d = make_data(17), e;
  double x[N * Q], y[N * Q];
  for (size_t p = 0; p < sizeof powers / sizeof *powers; p++)
    for (int method = 0; method < 3; method++) {
      const int a = powers[p][0], b = powers[p][1], w = powers[p][2];
      batten_lsq_options o = batten_lsq_options_default();
      batten_lsq_info info, plain;
      o.method = methods[method];
      e = d;
      o.weights = d.weights;
      T_OK(batten_lsq_solve(ctx, M, N, Q, d.a, d.b, &o, x, &plain), ctx);
      for (int i = 0; i < M * N; i++) e.a[i] = ldexp(d.a[i], a);
      for (int i = 0; i < M * Q; i++) e.b[i] = ldexp(d.b[i], b + i % Q); /* one unit for each right side */
      for (int i = 0; i < M; i++) e.weights[i] = ldexp(d.weights[i], w);
      o.weights = e.weights;
      T_OK(batten_lsq_solve(ctx, M, N, Q, e.a, e.b, &o, y, &info), ctx);
      for (int i = 0; i < N * Q; i++) y[i] = ldexp(y[i], a - b - i % Q);
      T_RATIO(difference(N * Q, y, x), a < -1022 ? 1e-11 : 1e-14, "a by 2^%d, b by 2^%d, weights by 2^%d, %s", a, b,
              w, names[method]);
      T_RATIO(info.gradient_norm, 1e-13, "its gradient");
      double ratio = ldexp(info.residual_norm, -b - w / 2) / plain.residual_norm;
      T_CHECK(ratio > 1 && ratio < 4, "its residual %g is that of the largest right side", info.residual_norm);
    }
  for (int i = 0; i < M * Q; i++) e.b[i] = ldexp(d.b[i], 900);
  for (int i = 0; i < M * N; i++) e.a[i] = ldexp(d.a[i], -900);
  x[0] = 77;
  T_STATUS(batten_lsq_solve(ctx, M, N, Q, e.a, e.b, NULL, x, NULL), BATTEN_E_INVALID, ctx, "overflows");
  T_CHECK(x[0] == 77, "x is untouched");
  for (int i = 0; i < M * N; i++) e.a[i] = ldexp(d.a[i], 1000);
  batten_lsq_options o = batten_lsq_options_default();
  o.weights = e.weights;
  T_STATUS(batten_lsq_solve(ctx, M, N, Q, e.a, e.b, &o, x, NULL), BATTEN_E_INVALID, ctx, "a: column 0 times");
}

/* A column nearly dependent: normal equations refuse, QR solves, auto takes QR; fully dependent: all refuse. */
static void test_rank(batten_context *ctx) {
  data d = make_data(9);
  double x[N * Q], exact[N];
  batten_lsq_options o = batten_lsq_options_default();
  batten_lsq_info info;
  for (int i = 0; i < M; i++) {
    d.a[i * N + 4] = d.a[i * N + 1] - d.a[i * N + 2] + 1e-9 * d.a[i * N + 4];
    d.b[i] = 0;
    for (int j = 0; j < N; j++) d.b[i] += d.a[i * N + j] * (exact[j] = 1 + j);
  }
  o.method = BATTEN_LSQ_NORMAL;
  T_STATUS(batten_lsq_solve(ctx, M, N, 1, d.a, d.b, &o, x, &info), BATTEN_E_SINGULAR, ctx, "a: column 4 depends");
  T_OK(batten_lsq_solve(ctx, M, N, 1, d.a, d.b, NULL, x, &info), ctx);
  T_CHECK(info.method == BATTEN_LSQ_QR && info.rcond < 1e-8, "auto takes QR, rcond %.2g", info.rcond);
  T_RATIO(difference(N, x, exact), 1e-5, "its solution, 1e-16 times condition 1e10");
  T_RATIO(info.residual_norm, 1e-13, "its residual");
  for (int i = 0; i < M; i++) d.a[i * N + 4] = d.a[i * N + 1] - d.a[i * N + 2];
  for (int method = 0; method < 3; method++) {
    o.method = methods[method];
    T_STATUS(batten_lsq_solve(ctx, M, N, 1, d.a, d.b, &o, x, NULL), BATTEN_E_SINGULAR, ctx, "depends on the others");
    o.tension = d.tension; /* does not know the direction e4 - e1 + e2 */
    T_OK(batten_lsq_solve(ctx, M, N, 1, d.a, d.b, &o, x, NULL), ctx);
    o.tension = NULL;
  }
  for (int i = 0; i < M; i++) d.a[i * N + 5] = 0;
  T_STATUS(batten_lsq_solve(ctx, M, N, 1, d.a, d.b, NULL, x, NULL), BATTEN_E_SINGULAR, ctx, "a: column 5 is zero");
  memset(d.weights, 0, sizeof d.weights);
  o.weights = d.weights;
  T_STATUS(batten_lsq_solve(ctx, M, N, 1, d.a, d.b, &o, x, NULL), BATTEN_E_SINGULAR, ctx, "a: column 0 is zero");
}

static void test_arguments(batten_context *ctx) {
  data d = make_data(11), e;
  double x[N * Q] = {77};
  batten_lsq_options o = batten_lsq_options_default(), zero = {0};
#define CALL(m, n, q) batten_lsq_solve(ctx, m, n, q, e.a, e.b, &o, x, NULL)
  e = d;
  T_CHECK(batten_lsq_solve(NULL, M, N, Q, d.a, d.b, NULL, x, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_lsq_solve(ctx, M, N, Q, d.a, d.b, &zero, x, NULL), BATTEN_E_INVALID, ctx, "struct_size: 0");
  T_STATUS(batten_lsq_solve(ctx, M, N, Q, NULL, d.b, NULL, x, NULL), BATTEN_E_INVALID, ctx, "a: NULL");
  T_STATUS(batten_lsq_solve(ctx, M, N, Q, d.a, NULL, NULL, x, NULL), BATTEN_E_INVALID, ctx, "b: NULL");
  T_STATUS(batten_lsq_solve(ctx, M, N, Q, d.a, d.b, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "x: NULL");
  T_STATUS(CALL(N - 1, N, 1), BATTEN_E_INVALID, ctx, "m: 6 rows for 7 unknowns");
  T_STATUS(CALL(SIZE_MAX, 1, 1), BATTEN_E_TOO_LARGE, ctx, "exceed LAPACK's integers");
  T_STATUS(CALL((size_t)INT32_MAX, 1, 1), BATTEN_E_TOO_LARGE, ctx, "exceed LAPACK's integers");
  o.method = (batten_lsq_method)5;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "opt.method: 5");
  o = batten_lsq_options_default();
  e.a[2 * N + 3] = NAN;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "a[2][3]: nan");
  e = d;
  e.b[4 * Q + 1] = -INFINITY;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "b[4][1]: -inf");
  e = d;
  o.weights = e.weights;
  e.weights[9] = -1;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "opt.weights[9]: -1");
  e.weights[9] = NAN;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "opt.weights[9]: nan");
  e = d;
  o.tension = e.tension;
  e.tension[3] += 1;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "opt.tension[3][0]");
  e = d;
  e.tension[N + 1] = -1;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "opt.tension[1][1]: -1");
  e = d;
  e.tension[N + 1] = INFINITY;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "opt.tension[1][1]: inf");
  e = d;
  e.tension[2] = e.tension[2 * N] = 50; /* indefinite, with a positive diagonal */
  o.method = BATTEN_LSQ_QR;
  T_STATUS(CALL(M, N, Q), BATTEN_E_INVALID, ctx, "not positive semidefinite");
  T_CHECK(x[0] == 77, "x is untouched");
#undef CALL
}

static batten_status everything(batten_context *ctx, void *arg) {
  data *d = arg;
  double x[N * Q] = {77};
  batten_status st = BATTEN_OK;
  for (int method = 0; method < 3 && st == BATTEN_OK; method++) {
    batten_lsq_options o = batten_lsq_options_default();
    o.method = methods[method];
    o.tension = d->tension;
    o.weights = d->weights;
    x[0] = 77;
    st = batten_lsq_solve(ctx, M, N, Q, d->a, d->b, &o, x, NULL);
    if (st < 0 && x[0] != 77) t_line(false, "x is untouched on failure");
  }
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_second_routes(ctx);
  test_invariance(ctx);
  test_extreme_units(ctx);
  test_rank(ctx);
  test_arguments(ctx);
  data d = make_data(13);
  t_fail_every_allocation("lsq", everything, &d);
  t_cancel_every_progress("lsq", everything, &d);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
