/* Splines of many points: fits by iteration, against the factors where they still serve. */
#include "spline_cloud.h"

#include <float.h>

/* Points of a bumpy sphere with what is left of a function on it: the case of solids. */
static cloud make_sphere(size_t count) {
  cloud c = make_cloud(3, count);
  uint64_t seed = 5;
  for (size_t i = 0; i < count; i++) {
    double *x = c.points + 3 * i, z = 2 * t_uniform(&seed) - 1, a = 8 * atan(1) * t_uniform(&seed),
           s = sqrt(1 - z * z);
    double radius = 1 + 0.1 * sin(5 * a) * s * s + 0.05 * cos(9 * z);
    x[0] = radius * s * cos(a), x[1] = radius * s * sin(a), x[2] = radius * z;
    c.values[i] = x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - 1;
  }
  return c;
}

/* Largest difference of two splines at points of the unit box, at `at` in the box of the second. */
static double difference(batten_context *ctx, unsigned n, const batten_spline *a, const batten_spline *b) {
  enum { TRIALS = 500 };
  double *x = malloc(TRIALS * (n + 2) * sizeof *x), *u = x + TRIALS * n, *v = u + TRIALS, worst = 0;
  uint64_t seed = 77;
  for (size_t i = 0; i < TRIALS * n; i++) x[i] = t_uniform(&seed);
  if (!a || !b || batten_spline_evaluate(ctx, a, TRIALS, x, u, NULL, NULL) < 0 ||
      batten_spline_evaluate(ctx, b, TRIALS, x, v, NULL, NULL) < 0)
    worst = INFINITY;
  for (size_t i = 0; i < TRIALS; i++) worst = fmax(worst, fabs(u[i] - v[i]));
  free(x);
  return worst;
}

/* ---- against the factors ---- */

static void print(const char *what, size_t count, double time, const batten_spline_info *i) {
  const batten_saddle_info *s = &i->saddle;
  printf("# %s, N = %zu: %.2f s, %u levels, %u iterations, products %.0e, residual %.1e (2-norm) %.1e (largest)\n",
         what, count, time, s->levels, s->iterations, s->products_accuracy, s->residual_rows, i->residual_max);
}

/* Fits by factors, and by iteration to `accuracy`, 1e-3 of that, ...: so many. */
static void compare(batten_context *ctx, const char *what, const cloud *c, bool hermite, unsigned m,
                    const double *smoothing, double accuracy, int accuracies) {
  batten_spline_data d = data_of(c, hermite);
  batten_spline_options o = options_of(m, BATTEN_SADDLE_CHOLESKY, accuracy);
  o.smoothing_per_point = smoothing;
  o.loo_samples = 0;
  batten_spline_info dense = {0}, info = {0};
  double start = batten_now();
  batten_spline *exact = fit(ctx, &d, &o, &dense);
  printf("# by factors: %.2f s\n", batten_now() - start);
  o.saddle.method = BATTEN_SADDLE_ITERATIVE;
  o.loo_samples = 256;
  for (int i = 0; i < accuracies; i++, accuracy *= 1e-3) {
    o.saddle.accuracy = accuracy;
    start = batten_now();
    batten_spline *s = fit(ctx, &d, &o, &info);
    print(what, c->count, batten_now() - start, &info);
    T_CHECK(info.saddle.method == BATTEN_SADDLE_ITERATIVE && info.residual_points == c->count, "%s: by iteration",
            what);
    T_CHECK(isnan(info.loo_rms) && info.loo_samples == 0, "%s: no leave-one-out errors", what);
    T_RATIO(info.saddle.residual_rows, accuracy, "%s: residual", what);
    T_RATIO(fmax(info.residual_max, info.gradient_residual_max), 20 * accuracy, "%s: largest residual", what);
    T_RATIO(difference(ctx, c->n, exact, s), 20 * accuracy, "%s: from the dense solution", what);
    T_RATIO(fabs(info.energy - dense.energy) / dense.energy, 100 * accuracy, "%s: energy", what);
    batten_spline_free(s);
  }
  batten_spline_free(exact);
}

static void test_against_dense(batten_context *ctx) {
  cloud c = make_sphere(4000);
  compare(ctx, "r, 4,000 points of a surface", &c, false, 2, NULL, 1e-6, 2);
  free_cloud(&c);
  c = make_cloud(3, 8000);
  compare(ctx, "r, 8,000 points of a volume", &c, false, 2, NULL, 1e-6, 2);
  free_cloud(&c);
  c = make_cloud(3, 3300);
  double *rho = malloc(c.count * sizeof *rho);
  for (size_t i = 0; i < c.count; i++) rho[i] = i % 3 ? 0 : 0.02 * (double)(i % 7);
  compare(ctx, "r, smoothing of some", &c, false, 2, rho, 1e-6, 1);
  compare(ctx, "r^3", &c, false, 3, NULL, 1e-6, 1);
  free(rho);
  free_cloud(&c);
  c = make_cloud(2, 3300);
  compare(ctx, "r^2 ln r", &c, false, 2, NULL, 1e-6, 1);
  free_cloud(&c);
  c = make_cloud(2, 500);
  compare(ctx, "r^4 ln r, gradients", &c, true, 3, NULL, 1e-6, 1);
  free_cloud(&c);
  c = make_cloud(3, 800);
  compare(ctx, "r^3, gradients", &c, true, 3, NULL, 1e-6, 1);
  free_cloud(&c);
}

/* ---- smooth kernels ---- */

/* A wrong preconditioner, or products too coarse for K^-1, still converge or stall quietly: counts tell. */
static void test_smooth(batten_context *ctx) {
  cloud c = make_sphere(9000), few = make_cloud(3, 2000);
  for (size_t i = 0; i < c.count; i++) { /* a distance: no polynomial of order 3 */
    const double length = sqrt(1 + c.values[i]);
    c.values[i] = length - 1;
    for (unsigned a = 0; a < 3; a++) c.gradients[3 * i + a] = c.points[3 * i + a] / length;
  }
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(3, BATTEN_SADDLE_ITERATIVE, 1e-8);
  batten_spline_info info = {0};
  double start = batten_now();
  batten_spline_free(fit(ctx, &d, &o, &info));
  print("r^3, bumpy sphere", c.count, batten_now() - start, &info);
  T_RATIO(info.saddle.iterations, 9, "r^3: iterations to 1e-8");
  T_RATIO(info.saddle.residual_rows, 1e-8, "r^3: residual");
  T_RATIO(info.residual_max, 1e-8, "r^3: the largest");
  /* Products of five digits where nine are needed: the direct rows tell, and finer ones cure. */
  d.count = 5000;
  o.saddle.accuracy = 1e-6;
  o.saddle.products_accuracy = 1e-5;
  start = batten_now();
  batten_spline_free(fit(ctx, &d, &o, &info));
  print("r^3, products of 1e-5 at first", d.count, batten_now() - start, &info);
  T_CHECK(info.saddle.products_accuracy < 1e-6, "r^3: products of %g in the end", info.saddle.products_accuracy);
  T_RATIO(info.saddle.residual_rows, 1e-6, "r^3, coarse products at first: residual");
  /* Gradients: on a surface as a solid has them, and in a volume. */
  for (int volume = 0; volume < 2; volume++) {
    d = data_of(volume ? &few : &c, true);
    d.count = d.gradient_count = 2000;
    o = options_of(3, BATTEN_SADDLE_ITERATIVE, 1e-8);
    start = batten_now();
    batten_spline_free(fit(ctx, &d, &o, &info));
    print(volume ? "r^3, gradients in a volume" : "r^3, gradients on a surface", d.count, batten_now() - start,
          &info);
    T_RATIO(info.saddle.iterations, volume ? 9 : 7, "r^3, gradients: iterations to 1e-8");
    T_RATIO(info.saddle.residual_rows, 1e-8, "r^3, gradients: residual");
  }
  free_cloud(&few);
  free_cloud(&c);
}

/* ---- invariances ---- */

static void test_invariance(batten_context *ctx) {
  cloud c = make_cloud(3, 4000);
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(2, BATTEN_SADDLE_ITERATIVE, 1e-6);
  batten_spline_info info = {0};
  batten_spline *first = fit(ctx, &d, &o, &info), *other;
  T_CHECK(info.saddle.levels > 1, "%u levels", info.saddle.levels);
  T_RATIO(info.saddle.iterations, 7, "iterations to 1e-6");
  other = fit(ctx, &d, &o, NULL);
  T_CHECK(same_bits(first, other), "again: same bits");
  batten_spline_free(other);
  for (size_t i = 0; i < 3 * c.count; i++) c.points[i] += 7e6;
  other = fit(ctx, &d, &o, NULL);
  T_CHECK(same_bits(first, other), "coordinates about 7e6: same bits");
  batten_spline_free(other);
  for (size_t i = 0; i < 3 * c.count; i++) c.points[i] = ldexp(c.points[i] - 7e6, -30);
  other = fit(ctx, &d, &o, NULL);
  T_CHECK(same_bits(first, other), "2^-30 times as large: same bits");
  batten_spline_free(other);
  batten_spline_free(first);
  free_cloud(&c);
}

/* ---- many places ---- */

static batten_spline_parts parts_of(const cloud *c, unsigned m, bool hermite, const size_t *at, const double *poly) {
  const size_t count[4][5] = {{0}, {0}, {0, 1, 3, 6, 10}, {0, 1, 4, 10, 20}};
  return (batten_spline_parts){.struct_size = sizeof(batten_spline_parts),
                               .n = c->n,
                               .m = m,
                               .count = c->count,
                               .centers = c->points,
                               .coefficients = c->values,
                               .gradient_count = hermite ? c->count / 2 : 0,
                               .gradient_at = at,
                               .gradient_coefficients = c->gradients,
                               .polynomial_count = count[c->n][m],
                               .polynomial = poly,
                               .origin = {0.5, 0.5, 0.5},
                               .scale = 2};
}

/* Values and gradients against batten_spline_evaluate, centres among the places; errors over the largest. */
static void test_evaluator(batten_context *ctx, unsigned n, unsigned m, bool hermite, double accuracy) {
  enum { MORE = 2000 };
  cloud c = make_cloud(n, 6000), places = make_cloud(n, 5000 + MORE);
  const double poly[20] = {0.3, 1, -2, 0.5};
  size_t *at = malloc(c.count * sizeof *at);
  for (size_t q = 0; q < c.count / 2; q++) at[q] = 2 * q + 1;
  memcpy(places.points, c.points, 5000 * n * sizeof(double));
  batten_spline_parts parts = parts_of(&c, m, hermite, at, poly);
  batten_spline *s = NULL;
  batten_spline_evaluator *e = NULL;
  T_OK(batten_spline_create(ctx, &parts, &s), ctx);
  T_OK(batten_spline_evaluator_new(ctx, s, accuracy, &e), ctx);
  batten_spline_free(s); /* it lives on */
  const size_t count = places.count;
  double *u = malloc(count * (2 + 2 * n) * sizeof *u), *v = u + count, *du = v + count, *dv = du + count * n;
  double error = NAN, worst = 0, largest = 0, slope = 0, steepest = 0;
  batten_spline_evaluate(ctx, s, count, places.points, v, dv, NULL);
  for (int batch = 0; batch < 2; batch++) { /* the second has the operators of the first */
    T_OK(batten_spline_evaluator_evaluate(ctx, e, count, places.points, u, du, &error), ctx);
    for (size_t i = 0; i < count; i++) {
      worst = fmax(worst, fabs(u[i] - v[i]));
      largest = fmax(largest, fabs(v[i]));
    }
    for (size_t i = 0; i < count * n; i++) {
      slope = fmax(slope, fabs(du[i] - dv[i]));
      steepest = fmax(steepest, fabs(dv[i]));
    }
    T_RATIO(worst / largest, 20 * accuracy, "n = %u, m = %u%s: values at %zu places", n, m,
            hermite ? ", gradients" : "", count);
    T_RATIO(slope / steepest, 20 * accuracy, "gradients");
    T_CHECK(error <= worst, "the error that is told, %.2g, is one of them, %.2g", error, worst);
  }
  T_OK(batten_spline_evaluator_evaluate(ctx, e, count, places.points, v, NULL, NULL), ctx);
  T_CHECK(!memcmp(u, v, count * sizeof *u), "values have the same bits without gradients");
  v[0] = NAN;
  T_OK(batten_spline_evaluator_evaluate(ctx, e, MORE, places.points + (count - MORE) * n, v, dv, NULL), ctx);
  T_CHECK(
      !memcmp(u + count - MORE, v, MORE * sizeof *u) && !memcmp(du + (count - MORE) * n, dv, MORE * n * sizeof *u),
      "and in another batch");
  T_OK(batten_spline_evaluator_evaluate(ctx, e, 0, NULL, NULL, NULL, &error), ctx);
  T_CHECK(error == 0, "no places, no error");
  const double before = u[0];
  places.points[1] = NAN;
  T_STATUS(batten_spline_evaluator_evaluate(ctx, e, count, places.points, u, NULL, NULL), BATTEN_E_INVALID, ctx,
           "points[0][1]");
  T_CHECK(u[0] == before, "outputs are untouched");
  batten_spline_evaluator_free(e);
  free(u);
  free(at);
  free_cloud(&c);
  free_cloud(&places);
}

static batten_status evaluate_small(batten_context *ctx, void *arg) {
  const cloud *c = arg;
  const double poly[20] = {1};
  size_t at[30];
  double u[60], error;
  for (size_t q = 0; q < 30; q++) at[q] = q;
  batten_spline_parts parts = parts_of(c, 3, true, at, poly);
  batten_spline *s = NULL;
  batten_spline_evaluator *e = NULL;
  batten_status st = batten_spline_create(ctx, &parts, &s);
  if (st >= 0) st = batten_spline_evaluator_new(ctx, s, 1e-6, &e);
  if (st >= 0) st = batten_spline_evaluator_evaluate(ctx, e, 60, c->points, u, NULL, &error);
  batten_spline_evaluator_free(e);
  batten_spline_free(s);
  return st;
}

/* ---- choice of method, memory ---- */

/* A preconditioner that is wrong somewhere still converges: 40,000 points of a surface took 9 iterations while the
 * rims of some local solves were bare. */
static void test_choice(batten_context *ctx) {
  cloud c = make_sphere(40000);
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(2, BATTEN_SADDLE_AUTO, 2e-9); /* for which the iteration goes on to 1e-9 */
  batten_spline_info info = {0};
  double start = batten_now();
  batten_spline_free(fit(ctx, &d, &o, &info));
  print("bumpy sphere", c.count, batten_now() - start, &info);
  T_CHECK(info.saddle.method == BATTEN_SADDLE_ITERATIVE, "40,000 points: %s",
          batten_saddle_method_name(info.saddle.method));
  const unsigned *to = info.saddle.iterations_to;
  T_CHECK(to[1] > 0 && to[1] <= 6 && to[2] > 0 && to[2] <= 8, "%u iterations to 1e-6, %u to 1e-9", to[1], to[2]);
  T_RATIO(info.saddle.residual_rows, 2e-9, "its residual");
  free_cloud(&c);
  c = make_cloud(3, 60000); /* in a volume local solves need three times the neighbours: 40,000 took 23 without */
  d = data_of(&c, false);
  o.saddle.accuracy = 1e-6;
  start = batten_now();
  batten_spline_free(fit(ctx, &d, &o, &info));
  print("a volume", c.count, batten_now() - start, &info);
  T_RATIO(info.saddle.iterations, 8, "60,000 points of a volume: iterations to 1e-6");
  T_RATIO(info.saddle.residual_rows, 1e-6, "60,000 points of a volume: residual");
  d.count = 6000;
  batten_spline_free(fit(ctx, &d, &o, &info));
  T_CHECK(info.saddle.method == BATTEN_SADDLE_ITERATIVE && info.saddle.residual_rows <= 1e-6,
          "6,000 points: %s, %.1e", batten_saddle_method_name(info.saddle.method), info.saddle.residual_rows);
  d.count = 5999;
  batten_spline_free(fit(ctx, &d, &o, &info));
  T_CHECK(info.saddle.method == BATTEN_SADDLE_CHOLESKY_MIXED && info.residual_max <= 1e-10, "5,999 points: %s, %.1e",
          batten_saddle_method_name(info.saddle.method), info.residual_max);
  d.count = 3000;
  batten_spline_free(fit(ctx, &d, &o, &info));
  T_CHECK(info.saddle.method == BATTEN_SADDLE_CHOLESKY_MIXED && info.residual_max <= 1e-10, "3,000 points: %s",
          batten_saddle_method_name(info.saddle.method));
  free_cloud(&c);
}

/* In a volume iteration turns out too large when the neighbours are known, the more the more threads there are: what
 * was chosen for two threads is a factor for 32. */
static void test_no_room(void) {
  cloud c = make_cloud(3, 7000);
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(2, BATTEN_SADDLE_AUTO, 1e-6);
  for (unsigned threads = 2; threads <= 32; threads += 30) {
    batten_context_options limited = batten_context_options_default();
    limited.memory_limit = 200000000;
    limited.threads = threads;
    batten_context *ctx = NULL;
    batten_spline_info info = {0};
    T_CHECK(batten_context_new(&limited, &ctx) == BATTEN_OK, "a context");
    batten_spline_free(fit(ctx, &d, &o, &info));
    const batten_saddle_method expected = threads > 2 ? BATTEN_SADDLE_CHOLESKY_MIXED : BATTEN_SADDLE_ITERATIVE;
    T_CHECK(info.saddle.method == expected && *batten_error(ctx) == 0, "%u threads in 200 MB: %s%s", threads,
            batten_saddle_method_name(info.saddle.method), batten_error(ctx));
    T_CHECK(batten_bytes_peak(ctx) <= limited.memory_limit && batten_bytes_in_use(ctx) == 0, "at most %.3g MB",
            (double)batten_bytes_peak(ctx) * 1e-6);
    batten_context_free(ctx);
  }
  free_cloud(&c);
}

/* Prediction against what was taken. */
static void test_bytes(batten_context *ctx) {
  cloud c = make_sphere(14000); /* fewer are summed directly, which is not foreseen */
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(2, BATTEN_SADDLE_ITERATIVE, 1e-6);
  batten_bytes_peak_reset(ctx);
  batten_spline_free(fit(ctx, &d, &o, NULL));
  const double said = (double)batten_spline_bytes(BATTEN_SADDLE_ITERATIVE, 3, 2, c.count, 0);
  T_RATIO((double)batten_bytes_peak(ctx), said, "bytes at the peak");
  T_RATIO(said, 3 * (double)batten_bytes_peak(ctx), "bytes predicted");
  T_CHECK(batten_spline_bytes(BATTEN_SADDLE_ITERATIVE, 3, 2, SIZE_MAX / 4, 0) == SIZE_MAX, "too many to count");
  free_cloud(&c);
}

/* ---- bad input ---- */

static batten_status try_fit(batten_context *ctx, const batten_spline_data *d, const batten_spline_options *o) {
  batten_spline *s = NULL;
  batten_status st = batten_spline_fit(ctx, d, o, &s, NULL);
  if (st < 0 && s) T_CHECK(false, "out is untouched");
  batten_spline_free(s);
  return st;
}

static void test_bad(batten_context *ctx) {
  cloud c = make_cloud(3, 4000);
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(2, BATTEN_SADDLE_ITERATIVE, 1e-6);
  memcpy(c.points + 3 * 2900, c.points + 3 * 17, 3 * sizeof(double));
  T_STATUS(try_fit(ctx, &d, &o), BATTEN_E_INVALID, ctx, "points[2900]: equals points[17]");
  for (size_t i = 0; i < c.count; i++) c.points[3 * i + 2] = 0.25;
  c.points[3 * 2900] = 2;
  T_STATUS(try_fit(ctx, &d, &o), BATTEN_E_SINGULAR, ctx, "lie in a plane with normal");
  for (size_t i = 0; i < c.count; i++) {
    c.points[3 * i] = (double)i;
    c.points[3 * i + 1] = 2 * (double)i;
  }
  T_STATUS(try_fit(ctx, &d, &o), BATTEN_E_SINGULAR, ctx, "lie on a line with direction");
  d.n = 1;
  T_STATUS(try_fit(ctx, &d, &o), BATTEN_E_INVALID, ctx, "opt.saddle.method: iterative with data.n = 1");
  d.n = 3;
  o.saddle.accuracy = 1e-20;
  free_cloud(&c);
  c = make_cloud(3, 100);
  d = data_of(&c, false);
  T_STATUS(try_fit(ctx, &d, &o), BATTEN_E_INVALID, ctx, "opt.accuracy: 1e-20");
  T_STATUS(batten_spline_evaluator_new(ctx, NULL, 1e-6, NULL), BATTEN_E_INVALID, ctx, "s: NULL");
  T_STATUS(batten_spline_evaluator_evaluate(ctx, NULL, 0, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "e: NULL");
  o.saddle.accuracy = 1e-6;
  d.count = 4; /* as many as monomials: nothing to iterate */
  T_OK(try_fit(ctx, &d, &o), ctx);
  d.count = 5;
  T_OK(try_fit(ctx, &d, &o), ctx);
  free_cloud(&c);
}

/* A residual that misses what was asked for is said. */
static void test_missed(batten_context *ctx) {
  cloud c = make_sphere(4500);
  batten_spline_data d = data_of(&c, false);
  batten_spline_options o = options_of(2, BATTEN_SADDLE_ITERATIVE, 1e-9);
  o.saddle.iterations_max = 1;
  T_STATUS(try_fit(ctx, &d, &o), BATTEN_W_ACCURACY, ctx, "above opt.saddle.accuracy = 1e-09");
  free_cloud(&c);
}

static batten_status fit_small(batten_context *ctx, void *arg) {
  const cloud *c = arg;
  batten_spline_data d = data_of(c, true);
  batten_spline_options o = options_of(3, BATTEN_SADDLE_ITERATIVE, 1e-6);
  return try_fit(ctx, &d, &o);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_against_dense(ctx);
  test_smooth(ctx);
  test_invariance(ctx);
  test_evaluator(ctx, 3, 2, false, 1e-6);
  test_evaluator(ctx, 2, 2, false, 1e-8);
  test_evaluator(ctx, 3, 3, true, 1e-6);
  test_choice(ctx);
  test_no_room();
  test_bytes(ctx);
  test_bad(ctx);
  test_missed(ctx);
  cloud small = make_cloud(2, 60);
  t_fail_every_allocation("a fit by iteration", fit_small, &small);
  t_cancel_every_progress("a fit by iteration", fit_small, &small);
  t_fail_every_allocation("an evaluator", evaluate_small, &small);
  free_cloud(&small);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
