/* Fits by iteration of points and values that are not well spread: each meets what it promises or is refused by a
 * sentence that helps. What a fit tells is not believed: values of the finished spline are summed up directly at all
 * points, without a fast sum. */
#include "spline_cloud.h"

enum { N = 3300 }; /* two levels */

static void renew_values(cloud *c) {
  for (size_t i = 0; i < c->count; i++) c->values[i] = smooth(c->n, c->points + i * c->n, c->gradients + i * c->n);
}

static batten_spline_options asked(unsigned m) { return options_of(m, BATTEN_SADDLE_ITERATIVE, 1e-6); }

/* 2-norm of what a spline misses, of the 2-norm of the values less their mean. */
static double miss_of(batten_context *ctx, const cloud *c, const batten_spline *s) {
  double *u = malloc(c->count * sizeof *u), mean = 0, miss = 0, all = 0, unit = 0;
  for (size_t i = 0; i < c->count; i++) unit = fmax(unit, fabs(c->values[i]));
  for (size_t i = 0; i < c->count; i++) mean += c->values[i] / unit / (double)c->count;
  if (!s || batten_spline_evaluate(ctx, s, c->count, c->points, u, NULL, NULL) < 0) miss = INFINITY;
  for (size_t i = 0; i < c->count && miss < INFINITY; i++) {
    const double e = u[i] / unit - c->values[i] / unit, v = c->values[i] / unit - mean;
    miss += e * e;
    all += v * v;
  }
  free(u);
  return sqrt(miss / all);
}

static void fits(batten_context *ctx, const cloud *c, unsigned m, unsigned iterations, const char *what) {
  const batten_spline_data d = data_of(c, false);
  const batten_spline_options o = asked(m);
  batten_spline_info info = {0};
  batten_spline *s = fit(ctx, &d, &o, &info);
  T_RATIO(info.saddle.iterations, iterations, "%s: iterations", what);
  T_RATIO(info.saddle.residual_rows, 1e-6, "%s: residual that is told", what);
  T_RATIO(miss_of(ctx, c, s), 2e-6, "%s: residual at all points", what);
  batten_spline_free(s);
}

static void test_points(batten_context *ctx) {
  cloud c = make_cloud(3, N), whole = make_cloud(3, N);
  const size_t bytes = 3 * N * sizeof(double);
  for (size_t i = 0; i < 150; i++)
    for (unsigned a = 0; a < 3; a++) c.points[3 * i + a] = c.points[3 * (i + 150) + a] + (a == i % 3 ? 1e-10 : 0);
  renew_values(&c);
  fits(ctx, &c, 2, 10, "pairs 1e-10 of the box apart");

  for (size_t i = 0; i < 50; i++) /* all in one place */
    for (unsigned a = 0; a < 3; a++) c.points[3 * i + a] = 0.3 + ldexp((double)((i + 1) * (a + 3) % 53), -36);
  memcpy(c.points + 150, whole.points + 150, bytes - 150 * sizeof(double));
  renew_values(&c);
  fits(ctx, &c, 2, 10, "fifty points within 1e-9 of the box");

  memcpy(c.points, whole.points, bytes);
  for (size_t i = 300; i < 900; i++) c.points[3 * i] = c.points[3 * i + 1] = 0.25;
  renew_values(&c);
  fits(ctx, &c, 2, 10, "a swarm on a line");

  memcpy(c.points, whole.points, bytes);
  for (unsigned a = 0; a < 3; a++) c.points[3 * 700 + a] = 1e6;
  renew_values(&c);
  fits(ctx, &c, 2, 10, "an outlier");
  for (size_t i = 0; i < 5; i++) c.points[3 * (100 * i) + i % 3] = (i % 2 ? 1e5 : -3e3) * (double)(i + 1);
  renew_values(&c);
  fits(ctx, &c, 2, 18, "several outliers");

  memcpy(c.points, whole.points, bytes);
  for (size_t i = 0; i < N; i++) /* x^10: densities 1 : 1000 and more */
    for (unsigned a = 0; a < 3; a++) c.points[3 * i + a] = pow(c.points[3 * i + a], 10);
  renew_values(&c);
  fits(ctx, &c, 2, 16, "uneven densities");

  memcpy(c.points, whole.points, bytes);
  for (size_t i = 0; i < N; i += 2)
    for (unsigned a = 0; a < 3; a++) c.points[3 * i + a] += 1e4;
  for (size_t i = 0; i < N; i++) c.values[i] = smooth(3, whole.points + 3 * i, c.gradients) + (i % 2 ? 0 : 1);
  fits(ctx, &c, 2, 10, "two distant clusters");

  for (size_t i = 0; i < N; i++) { /* ties wherever a tree is cut */
    c.points[3 * i] = (double)(i % 15), c.points[3 * i + 1] = (double)(i / 15 % 15);
    c.points[3 * i + 2] = (double)(i / 225);
    c.values[i] = sin(0.2 * c.points[3 * i]) * cos(0.3 * c.points[3 * i + 1]) + 0.01 * (double)(i % 7);
  }
  fits(ctx, &c, 2, 12, "a grid");

  for (size_t i = 0; i < 3 * N; i++) c.points[i] = ldexp(floor(ldexp(whole.points[i], 10)), -10);
  for (size_t i = 0; i < N; i++) c.points[3 * i] = whole.points[3 * i]; /* distinct */
  for (size_t i = 0; i < 3 * N; i++) c.points[i] += 7e6;
  memcpy(c.values, whole.values, N * sizeof(double));
  fits(ctx, &c, 2, 10, "coordinates about 7e6");
  free_cloud(&c);
  free_cloud(&whole);
}

/* All splines that have fast sums; from so many unknowns on that there is a second level. */
static void test_orders(batten_context *ctx) {
  for (unsigned n = 2; n <= 3; n++)
    for (unsigned m = 2; m <= 3; m++) {
      cloud c = make_cloud(n, 3001);
      char what[64];
      snprintf(what, sizeof what, "n = %u, m = %u", n, m);
      fits(ctx, &c, m, 12, what);
      free_cloud(&c);
    }
}

static void test_values(batten_context *ctx) {
  cloud c = make_cloud(3, N);
  const batten_spline_data d = data_of(&c, false);
  const batten_spline_options o = asked(2);
  batten_spline *first = fit(ctx, &d, &o, NULL), *s;
  for (size_t i = 0; i < N; i++) c.values[i] = ldexp(c.values[i], -660); /* 1e-199 */
  s = fit(ctx, &d, &o, NULL);
  batten_spline_parts p = {.struct_size = sizeof p}, q = p;
  size_t differ = 0;
  if (first && s) {
    batten_spline_get_parts(first, &p);
    batten_spline_get_parts(s, &q);
    for (size_t i = 0; i < N; i++) differ += ldexp(p.coefficients[i], -660) != q.coefficients[i];
  }
  T_CHECK(first && s && differ == 0, "values 2^-660 times as large: so are the coefficients, %zu differ", differ);
  batten_spline_free(s);
  batten_spline_free(first);
  s = NULL;
  for (size_t i = 0; i < N; i++) c.values[i] = ldexp(c.values[i], 660 + 664); /* 1e200 */
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_INVALID, ctx, "choose a unit");
  T_CHECK(!s, "out is untouched");

  for (int linear = 0; linear < 2; linear++) {
    batten_spline_info info = {.saddle.iterations = 99};
    for (size_t i = 0; i < N; i++)
      c.values[i] = 3 + linear * (2 * c.points[3 * i] - c.points[3 * i + 1] + 0.5 * c.points[3 * i + 2]);
    s = fit(ctx, &d, &o, &info);
    T_RATIO(info.residual_max, 1e-13, "%s values", linear ? "linear" : "constant");
    T_CHECK(info.saddle.iterations == 0 && info.energy == 0, "no iterations, no energy: %u, %g",
            info.saddle.iterations, info.energy);
    batten_spline_free(s);
  }
  uint64_t seed = 3;
  for (size_t i = 0; i < N; i++) c.values[i] = t_uniform(&seed);
  fits(ctx, &c, 2, 12, "noise");
  free_cloud(&c);
}

/* Whole fits on contexts of several numbers of threads: the same bits, far fields included. */
static void test_threads(void) {
  static const unsigned threads[] = {1, 2, 3, 7};
  cloud c = make_cloud(3, 6000);
  const batten_spline_data d = data_of(&c, false);
  const batten_spline_options o = options_of(2, BATTEN_SADDLE_ITERATIVE, 1e-4);
  batten_context *ctx[4];
  batten_spline *s[4];
  for (unsigned q = 0; q < 4; q++) {
    ctx[q] = t_context(NULL, NULL, threads[q]);
    s[q] = fit(ctx[q], &d, &o, NULL);
    T_CHECK(same_bits(s[0], s[q]), "%u threads: the same bits", threads[q]);
  }
  for (unsigned q = 0; q < 4; q++) {
    batten_spline_free(s[q]);
    batten_context_free(ctx[q]);
  }
  free_cloud(&c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_points(ctx);
  test_orders(ctx);
  test_values(ctx);
  test_threads();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
