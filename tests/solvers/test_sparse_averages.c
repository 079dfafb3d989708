/* Averages of each other against dense elimination, and against closed forms where dense elimination has no digits
 * left: a walk that drifts away from the given values. */
#include "sparse/averages.h"

#include "la/la.h"
#include "tap.h"

enum { SIDE_MAX = 120 };

typedef struct owned {
  sparse_averages a;
  size_t *starts;
  uint32_t *columns;
  double *weights, *given, *values;
} owned;

static owned make(size_t n, size_t entries) {
  owned s = {
      {n, NULL, NULL, NULL, NULL, NULL},      calloc(n + 1, sizeof(size_t)), malloc((entries + 1) * sizeof(uint32_t)),
      malloc((entries + 1) * sizeof(double)), calloc(n + 1, sizeof(double)), calloc(2 * n + 1, sizeof(double))};
  s.a = (sparse_averages){n, s.starts, s.columns, s.weights, s.given, s.values};
  return s;
}

static void drop(owned *s) {
  free(s->starts);
  free(s->columns);
  free(s->weights);
  free(s->given);
  free(s->values);
}

/* A grid of side x side unknowns with diagonals, whose rim knows given values; weights from a random power of 10. */
static owned grid(size_t side, double spread, uint64_t seed) {
  static const int way[6][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 0}, {-1, -1}, {0, -1}};
  owned s = make(side * side, 6 * side * side);
  size_t end = 0;
  for (size_t i = 0; i < side * side; i++) {
    for (int k = 0; k < 6; k++) {
      long x = (long)(i % side) + way[k][0], y = (long)(i / side) + way[k][1];
      double w = pow(10, -spread * t_uniform(&seed));
      if (x >= 0 && y >= 0 && x < (long)side && y < (long)side) {
        s.columns[end] = (uint32_t)(y * (long)side + x);
        s.weights[end++] = w;
      } else {
        s.given[i] += w;
        s.values[2 * i] += w * (double)(x + 1) / (double)(side + 1);
        s.values[2 * i + 1] += w * (double)(y + 1) / (double)(side + 1);
      }
    }
    s.starts[i + 1] = end;
  }
  return s;
}

static void test_dense(batten_context *ctx) {
  for (int spread = 0; spread < 12; spread += 4) {
    size_t side = 17, n = side * side;
    owned s = grid(side, spread, 5);
    double *m = calloc(n * n, sizeof *m), *x = malloc(2 * n * sizeof *x), *tau = malloc(n * sizeof *tau);
    double *right = malloc(2 * n * sizeof *right), worst = 0;
    for (size_t i = 0; i < n; i++) {
      m[i + i * n] = s.given[i];
      for (size_t e = s.starts[i]; e < s.starts[i + 1]; e++) {
        m[i + i * n] += s.weights[e];
        m[i + s.columns[e] * n] -= s.weights[e];
      }
      for (size_t c = 0; c < 2; c++) right[i + c * n] = s.values[2 * i + c];
    }
    T_OK(sparse_solve_averages(ctx, &s.a, "test", 0, x), ctx);
    T_OK(batten_la_geqrf(ctx, n, n, m, n, tau), ctx);
    T_OK(batten_la_ormqr(ctx, 'T', n, 2, n, m, n, tau, right, n), ctx);
    for (size_t c = 0; c < 2; c++) batten_la_trsv(BATTEN_LA_DOUBLE, 'U', 'N', n, m, n, right + c * n);
    for (size_t i = 0; i < n; i++)
      for (size_t c = 0; c < 2; c++) worst = fmax(worst, fabs(x[2 * i + c] - right[i + c * n]));
    T_RATIO(worst, spread ? 1e-10 : 1e-13, "%zu unknowns, weights over %d powers of ten: against dense QR", n, spread);
    drop(&s);
    free(m);
    free(x);
    free(tau);
    free(right);
  }
}

/* Unknowns 1 .. n in a row between the values 0 at 0 and 1 at n + 1, r times as much weight downwards as upwards:
 * x_i = (r^i - 1) / (r^(n + 1) - 1), from 1e-143 on for r = 3: each right to all its digits. */
static void test_drift(batten_context *ctx) {
  enum { N = 300 };
  owned s = make(N, 2 * N);
  double x[2 * N], worst = 0;
  size_t end = 0;
  for (size_t i = 0; i < N; i++) {
    if (i > 0) {
      s.columns[end] = (uint32_t)i - 1;
      s.weights[end++] = 3;
    }
    if (i + 1 < N) {
      s.columns[end] = (uint32_t)i + 1;
      s.weights[end++] = 1;
    }
    s.starts[i + 1] = end;
  }
  s.given[0] = 3;
  s.given[N - 1] = s.values[2 * (N - 1)] = 1;
  T_OK(sparse_solve_averages(ctx, &s.a, "test", 0, x), ctx);
  for (size_t i = 0; i < N; i++) {
    double expected = (1 - pow(3, -(double)(i + 1))) / (1 - pow(3, -(double)(N + 1))) * pow(3, (double)i - N);
    worst = fmax(worst, fabs(x[2 * i] / expected - 1));
  }
  T_RATIO(worst, 1e-12, "a drifting walk: relative error of values down to %.1e", x[0]);
  drop(&s);
}

/* Where all given values are those of a linear function, so is the solution with weights that reproduce it. */
static void test_large(batten_context *ctx) {
  for (size_t side = SIDE_MAX / 4; side <= SIDE_MAX; side *= 2) {
    owned s = grid(side, 0, 1);
    double *x = malloc(2 * side * side * sizeof *x), worst = 0, start = batten_now();
    T_OK(sparse_solve_averages(ctx, &s.a, "test", 0, x), ctx);
    double time = batten_now() - start;
    for (size_t i = 0; i < side * side; i++) {
      worst = fmax(worst, fabs(x[2 * i] - (double)(i % side + 1) / (double)(side + 1)));
      worst = fmax(worst, fabs(x[2 * i + 1] - (double)(i / side + 1) / (double)(side + 1)));
    }
    T_RATIO(worst, 1e-12, "linear on %zu unknowns, %.3f s", side * side, time);
    drop(&s);
    free(x);
  }
}

static batten_status solve_once(batten_context *ctx, void *arg) {
  double x[2 * 64];
  return sparse_solve_averages(ctx, arg, "test", 0, x);
}

static void test_failures(batten_context *ctx) {
  owned s = grid(8, 1, 3);
  t_fail_every_allocation("a solution", solve_once, &s.a);
  t_cancel_every_progress("a solution", solve_once, &s.a);
  memset(s.given, 0, 64 * sizeof *s.given);
  double x[2 * 64];
  T_STATUS(sparse_solve_averages(ctx, &s.a, "test", 0, x), BATTEN_E_SINGULAR, ctx, "connect it to given values");
  sparse_averages none = {0};
  T_OK(sparse_solve_averages(ctx, &none, "test", 0, x), ctx);
  drop(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_dense(ctx);
  test_drift(ctx);
  test_large(ctx);
  test_failures(ctx);
  batten_context_free(ctx);
  return t_done();
}
