/* The system of a spline as the iterative solver sees it: entries in any order, fast products. */
#include "spline/inner.h"
#include "tap.h"

#include <batten/spline.h>
#include <float.h>

typedef struct scene {
  batten_context *ctx;
  batten_spline_data data;
  batten_spline_options opt;
  double *numbers;
  size_t *at;
  spline_system system;
  size_t rows;
} scene;

/* Random points of a unit box far out; every third has a gradient, if any has. */
static scene open_scene(batten_context *ctx, unsigned n, unsigned m, size_t count, bool hermite, bool smooth) {
  scene s = {.ctx = ctx, .data = batten_spline_data_default(), .opt = batten_spline_options_default()};
  uint64_t seed = 10 * n + m;
  s.numbers = malloc(count * (n + 3) * sizeof(double));
  s.at = malloc(count * sizeof *s.at);
  double *values = s.numbers + n * count, *smoothing = values + count;
  for (size_t i = 0; i < n * count; i++) s.numbers[i] = 1000 + 3 * t_uniform(&seed);
  for (size_t i = 0; i < count; i++) values[i] = t_uniform(&seed);
  for (size_t i = 0; i < count; i++) smoothing[i] = i % 2 ? 0.1 + t_uniform(&seed) : 0;
  s.data.n = n;
  s.data.count = count;
  s.data.points = s.numbers;
  s.data.values = values;
  if (hermite) {
    s.data.gradient_count = count / 3;
    for (size_t q = 0; q < count / 3; q++) s.at[q] = 3 * q + 1;
    s.data.gradient_at = s.at;
    s.data.gradients = s.numbers; /* any */
  }
  s.opt.m = m;
  if (smooth) s.opt.smoothing_per_point = smoothing;
  batten_status st = batten_spline_system_make(ctx, &s.data, &s.opt, &s.system);
  if (st >= 0) st = batten_spline_sums_make(ctx, &s.system);
  if (st < 0) T_CHECK(false, "scene: %s", batten_error(ctx));
  s.rows = s.system.rows;
  return s;
}

static void close_scene(scene *s) {
  batten_spline_system_free(s->ctx, &s->system);
  free(s->numbers);
  free(s->at);
}

/* Each unknown with probability 1 / every; how many. */
static size_t choose(size_t rows, unsigned every, uint64_t seed, size_t *list) {
  size_t count = 0;
  for (size_t i = 0; i < rows; i++)
    if (t_random(&seed) % every == 0) list[count++] = i;
  return count;
}

static void shuffle(size_t count, uint64_t seed, size_t *list) {
  for (size_t i = count; i > 1; i--) {
    size_t j = t_random(&seed) % i, t = list[j];
    list[j] = list[i - 1];
    list[i - 1] = t;
  }
}

/* ---- entries ---- */

static void test_entries(batten_context *ctx, unsigned n, unsigned m, bool hermite, bool smooth) {
  scene s = open_scene(ctx, n, m, 300, hermite, smooth);
  const size_t rows = s.rows;
  double *whole = malloc(rows * rows * sizeof *whole), *part = malloc(rows * (rows + 3) * sizeof *part);
  size_t *row = malloc(rows * sizeof *row), *col = malloc(rows * sizeof *col), differ = 0;
  batten_spline_system_fill(&s.system, 0, rows, 0, rows, whole, rows);
  const size_t row_count = choose(rows, 2, 1, row), col_count = choose(rows, 3, 2, col), ld = row_count + 3;
  for (int order = 0; order < 2; order++) {
    if (order) shuffle(row_count, 3, row), shuffle(col_count, 4, col);
    s.system.sums->calls.entries(&s.system, row_count, row, col_count, col, part, ld);
    for (size_t j = 0; j < col_count; j++)
      for (size_t i = 0; i < row_count; i++)
        differ += memcmp(&part[i + j * ld], &whole[row[i] + col[j] * rows], sizeof *part) != 0;
  }
  T_CHECK(differ == 0, "n = %u, m = %u%s%s: %zu of %zu entries differ from fill", n, m, hermite ? ", gradients" : "",
          smooth ? ", smoothing" : "", differ, 2 * row_count * col_count);
  free(whole);
  free(part);
  free(row);
  free(col);
  close_scene(&s);
}

/* ---- products ---- */

/* 2-norm of the error of a product over that of the direct one, on up to 300 of its rows. */
static double product_error(const scene *s, double accuracy, size_t row_count, const size_t *rows, size_t col_count,
                            const size_t *cols) {
  const batten_saddle_sums *calls = &s->system.sums->calls;
  void *plan = NULL;
  uint64_t seed = 7;
  double *x = malloc(col_count * sizeof *x), *y = malloc(row_count * sizeof *y), *k = malloc(col_count * sizeof *k);
  double miss = 0, norm = 0;
  for (size_t j = 0; j < col_count; j++) x[j] = t_uniform(&seed) - 0.5;
  batten_status st = calls->plan(&s->system, s->ctx, accuracy, row_count, rows, col_count, cols, &plan);
  if (st >= 0) st = calls->apply(plan, s->ctx, x, y);
  if (st < 0) miss = INFINITY;
  size_t *all = malloc(col_count * sizeof *all);
  for (size_t j = 0; j < col_count; j++) all[j] = cols ? cols[j] : j;
  for (size_t i = 0; st >= 0 && i < row_count; i += row_count / 300 + 1) {
    size_t row = rows ? rows[i] : i;
    double sum = 0;
    calls->entries(&s->system, 1, &row, col_count, all, k, 1);
    for (size_t j = 0; j < col_count; j++) sum += k[j] * x[j];
    miss += (y[i] - sum) * (y[i] - sum);
    norm += sum * sum;
  }
  if (plan) calls->release(plan);
  free(x);
  free(y);
  free(k);
  free(all);
  return sqrt(miss / norm);
}

static void test_products(batten_context *ctx, unsigned n, unsigned m, size_t count, bool hermite, bool smooth) {
  const double accuracy = 1e-7;
  scene s = open_scene(ctx, n, m, count, hermite, smooth);
  size_t *row = malloc(s.rows * sizeof *row), *col = malloc(s.rows * sizeof *col);
  const size_t row_count = choose(s.rows, 2, 5, row), col_count = choose(s.rows, 4, 6, col);
  const char *what = hermite ? ", gradients" : smooth ? ", smoothing" : "";
  const double all = product_error(&s, accuracy, s.rows, NULL, s.rows, NULL);
  T_RATIO(all, accuracy, "n = %u, m = %u, N = %zu%s: K x", n, m, count, what);
  T_RATIO(product_error(&s, accuracy, row_count, row, s.rows, NULL), accuracy, "rows");
  T_RATIO(product_error(&s, accuracy, s.rows, NULL, col_count, col), accuracy, "columns");
  T_RATIO(product_error(&s, accuracy, row_count, row, col_count, col), accuracy, "both");
  T_RATIO(product_error(&s, 1e-16, row_count, row, col_count, col), 1e-10, "finer than there is");
  T_CHECK(!s.system.sums->plans, "no plan is left");
  free(row);
  free(col);
  close_scene(&s);
}

/* Enough points for the far field of sums in space with gradients. */
static void test_gradients(batten_context *ctx) {
  scene s = open_scene(ctx, 3, 3, 8000, true, false);
  T_RATIO(product_error(&s, 1e-5, s.rows, NULL, s.rows, NULL), 1e-5, "n = 3, m = 3, N = 8000, gradients: K x");
  close_scene(&s);
}

/* Plans that are alive share operators: the second one's bits do not depend on it, and any may go first. */
static void test_sharing(batten_context *ctx) {
  scene s = open_scene(ctx, 3, 2, 6000, false, false);
  const batten_saddle_sums *calls = &s.system.sums->calls;
  double *x = malloc(3 * s.rows * sizeof *x), *alone = x + s.rows, *y = alone + s.rows;
  size_t *row = malloc(s.rows * sizeof *row), count = choose(s.rows, 3, 5, row);
  uint64_t seed = 1;
  for (size_t i = 0; i < s.rows; i++) x[i] = t_uniform(&seed) - 0.5;
  void *a = NULL, *b = NULL;
  T_OK(calls->plan(&s.system, ctx, 1e-5, count, row, s.rows, NULL, &b), ctx);
  T_OK(calls->apply(b, ctx, x, alone), ctx);
  calls->release(b);
  T_OK(calls->plan(&s.system, ctx, 1e-5, s.rows, NULL, s.rows, NULL, &a), ctx);
  T_OK(calls->plan(&s.system, ctx, 1e-5, count, row, s.rows, NULL, &b), ctx);
  calls->release(a);
  T_OK(calls->apply(b, ctx, x, y), ctx);
  T_CHECK(memcmp(alone, y, count * sizeof *y) == 0, "a plan with the operators of another gives the same bits");
  calls->release(b);
  free(x);
  free(row);
  close_scene(&s);
}

/* The prediction holds what a plan takes. */
static void test_bytes(batten_context *ctx) {
  for (int hermite = 0; hermite < 2; hermite++) {
    scene s = open_scene(ctx, 3, 3, 4000, hermite, false);
    const batten_saddle_sums *calls = &s.system.sums->calls;
    const size_t before = batten_bytes_in_use(ctx), said = calls->bytes(&s.system, 1e-6, s.rows, s.rows);
    void *plan = NULL;
    batten_bytes_peak_reset(ctx);
    T_OK(calls->plan(&s.system, ctx, 1e-6, s.rows, NULL, s.rows, NULL, &plan), ctx);
    T_RATIO((double)(batten_bytes_peak(ctx) - before), (double)said, "bytes of a plan%s",
            hermite ? ", gradients" : "");
    if (plan) calls->release(plan);
    close_scene(&s);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  for (int smooth = 0; smooth < 2; smooth++) {
    test_entries(ctx, 2, 2, false, smooth);
    test_entries(ctx, 2, 3, true, smooth);
    test_entries(ctx, 3, 2, false, smooth);
    test_entries(ctx, 3, 3, true, smooth);
  }
  test_products(ctx, 2, 2, 4000, false, false);
  test_products(ctx, 2, 3, 3000, true, false);
  test_products(ctx, 3, 2, 4000, false, true);
  test_products(ctx, 3, 3, 1500, true, false);
  test_gradients(ctx);
  test_sharing(ctx);
  test_bytes(ctx);
  batten_context_free(ctx);
  return t_done();
}
