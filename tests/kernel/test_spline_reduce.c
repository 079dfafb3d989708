/* Splines with fewer centres than points: what they promise, recomputed by sums of the test's own. */
#include "tap.h"

#include <batten/spline.h>
#include <float.h>

typedef struct cloud {
  unsigned n;
  size_t count;
  double *points, *values, *gradients; /* gradients of the field that the values are of */
} cloud;

/* Random points of a bumpy sphere with the values of a ball's field, 1 - |x|^2. */
static cloud make_sphere(size_t count, uint64_t seed) {
  cloud c = {.n = 3, .count = count};
  c.points = malloc(count * 3 * sizeof(double));
  c.values = malloc(count * sizeof(double));
  c.gradients = malloc(count * 3 * sizeof(double));
  for (size_t i = 0; i < count; i++) {
    double *x = c.points + 3 * i, z = 2 * t_uniform(&seed) - 1, a = 8 * atan(1) * t_uniform(&seed),
           s = sqrt(1 - z * z), radius = 1 + 0.1 * sin(5 * a) * s * s + 0.05 * cos(9 * z);
    x[0] = radius * s * cos(a), x[1] = radius * s * sin(a), x[2] = radius * z;
    c.values[i] = 1 - x[0] * x[0] - x[1] * x[1] - x[2] * x[2];
    for (unsigned k = 0; k < 3; k++) c.gradients[3 * i + k] = -2 * x[k];
  }
  return c;
}

/* Random points of the unit box, a smooth function. */
static cloud make_box(unsigned n, size_t count) {
  cloud c = {.n = n, .count = count};
  uint64_t seed = 10 * n + count;
  c.points = malloc(count * n * sizeof(double));
  c.values = malloc(count * sizeof(double));
  c.gradients = calloc(count * n, sizeof(double));
  for (size_t i = 0; i < count * n; i++) c.points[i] = t_uniform(&seed);
  for (size_t i = 0; i < count; i++) {
    double t = 0.3;
    for (unsigned a = 0; a < n; a++) t += (a + 2.0) * c.points[i * n + a];
    c.values[i] = sin(t);
  }
  return c;
}

static void free_cloud(cloud *c) {
  free(c->points);
  free(c->values);
  free(c->gradients);
}

static batten_spline_data data_of(const cloud *c) {
  batten_spline_data d = batten_spline_data_default();
  d.n = c->n;
  d.count = c->count;
  d.points = c->points;
  d.values = c->values;
  return d;
}

static batten_spline_reduce_options to(double tolerance) {
  batten_spline_reduce_options r = batten_spline_reduce_options_default();
  r.tolerance = tolerance;
  return r;
}

static batten_spline_options order(unsigned m) {
  batten_spline_options o = batten_spline_options_default();
  o.m = m;
  return o;
}

/* U and its gradient (not NULL) in three dimensions, m = 2: phi(r) = -r, polynomial 1, x, y, z. */
static double naive(const batten_spline_parts *p, const double *x, double *gradient) {
  double y[3], u = p->polynomial[0];
  for (unsigned a = 0; a < 3; a++) {
    y[a] = (x[a] - p->origin[a]) / p->scale;
    u += p->polynomial[1 + a] * y[a];
    if (gradient) gradient[a] = p->polynomial[1 + a] / p->scale;
  }
  for (size_t j = 0; j < p->count; j++) {
    double d[3], square = 0;
    for (unsigned a = 0; a < 3; a++) {
      d[a] = y[a] - (p->centers[3 * j + a] - p->origin[a]) / p->scale;
      square += d[a] * d[a];
    }
    const double r = sqrt(square);
    u -= p->coefficients[j] * r;
    for (unsigned a = 0; a < 3 && r > 0 && gradient; a++) gradient[a] -= p->coefficients[j] * d[a] / r / p->scale;
  }
  return u;
}

static batten_spline_parts parts_of(const batten_spline *s) {
  batten_spline_parts p = {.struct_size = sizeof p};
  if (s) batten_spline_get_parts(s, &p);
  return p;
}

/* Largest error over its tolerance, and the largest error, of the test's own sums. */
static double recompute(const cloud *c, const batten_spline *s, const batten_spline_reduce_options *r,
                        double *error) {
  const batten_spline_parts p = parts_of(s);
  double worst = 0;
  *error = 0;
  for (size_t i = 0; i < c->count; i++) {
    const bool distance = i < r->distance_count;
    double g[3] = {0}, e = fabs(naive(&p, c->points + 3 * i, distance ? g : NULL) - c->values[i]), square = 0;
    for (unsigned a = 0; a < 3; a++) square += pow(g[a] - c->gradients[3 * i + a], 2);
    if (distance) e /= sqrt(square);
    if (distance || r->distance_count == 0) *error = fmax(*error, e);
    worst = fmax(worst, e / (r->tolerances ? r->tolerances[i] : r->tolerance));
  }
  return worst;
}

/* Every centre is a point of the cloud, with its bits. */
static bool are_points(const cloud *c, const batten_spline *s) {
  const batten_spline_parts p = parts_of(s);
  size_t at = 0, n = c->n;
  for (size_t j = 0; j < p.count; j++, at++) { /* in their order */
    while (at < c->count && memcmp(c->points + at * n, p.centers + j * n, n * sizeof(double)) != 0) at++;
    if (at >= c->count) return false;
  }
  return true;
}

static bool same_bits(const batten_spline *a, const batten_spline *b) {
  const batten_spline_parts p = parts_of(a), q = parts_of(b);
  return a && b && p.count == q.count && memcmp(p.centers, q.centers, p.count * p.n * sizeof(double)) == 0 &&
         memcmp(p.coefficients, q.coefficients, p.count * sizeof(double)) == 0 &&
         memcmp(p.polynomial, q.polynomial, p.polynomial_count * sizeof(double)) == 0;
}

static batten_spline *reduce(batten_context *ctx, const cloud *c, const batten_spline_options *o,
                             const batten_spline_reduce_options *r, batten_status wanted,
                             batten_spline_reduce_info *info) {
  batten_spline *s = NULL;
  const batten_spline_data d = data_of(c);
  batten_status st = batten_spline_fit_reduced(ctx, &d, o, r, &s, info);
  if (st != wanted) t_line(false, "%s: %s", batten_status_name(st), batten_error(ctx));
  return s;
}

/* ---- what is promised ---- */

static void check(batten_context *ctx, const char *what, const cloud *c, const batten_spline_reduce_options *r,
                  size_t most) {
  batten_spline_reduce_info i = {0};
  double error;
  batten_spline *s = reduce(ctx, c, NULL, r, BATTEN_OK, &i);
  printf("# %s: %zu of %zu points in %u rounds, error %.3g\n", what, i.centers, c->count, i.rounds, i.error_max);
  const double ratio = recompute(c, s, r, &error);
  T_RATIO(ratio, 1 + 1e-9, "%s: largest error over its tolerance, by naive sums", what);
  T_RATIO(fabs(i.error_max - error), 1e-9 * error + 1e-12, "the largest error that is told");
  T_RATIO(fabs(i.ratio_max - ratio), 1e-8, "and over the tolerance");
  T_CHECK(i.certified_points == c->count && i.error_certified == i.error_max && !i.all, "all of them certified");
  T_CHECK(s && are_points(c, s) && parts_of(s).count == i.centers, "centres are points");
  T_RATIO((double)i.centers, (double)most, "centres");
  bool grows = i.rounds > 1 && i.history[i.rounds - 1].centers == i.centers;
  for (unsigned k = 1; k < i.rounds; k++) grows = grows && i.history[k].centers > i.history[k - 1].centers;
  T_CHECK(grows && i.history[i.rounds - 1].ratio_max <= 1 && i.history[i.rounds - 2].ratio_max > 1,
          "rounds add centres until it is met");
  T_CHECK(i.error_rms > 0 && i.error_rms < i.error_max, "root mean square %.3g", i.error_rms);
  batten_spline_free(s);
}

static void test_promise(batten_context *ctx) {
  cloud c = make_sphere(8000, 1);
  batten_spline_reduce_options r = to(3e-3);
  check(ctx, "values", &c, &r, 1100);
  double *tolerances = malloc(c.count * sizeof *tolerances);
  for (size_t i = 0; i < c.count; i++) tolerances[i] = c.points[3 * i] > 0 ? 3e-3 : 3e-2;
  r.tolerances = tolerances;
  check(ctx, "loose on one side", &c, &r, 700);
  r = to(3e-3);
  r.distance_count = c.count;
  r.field_gradients = c.gradients;
  check(ctx, "distances", &c, &r, 1000);
  for (size_t i = 0; i < c.count; i++) tolerances[i] = i < 6000 ? 3e-3 : 0.1;
  r.tolerances = tolerances;
  r.distance_count = 6000;
  check(ctx, "distances at some", &c, &r, 1000);
  free(tolerances);
  free_cloud(&c);
}

/* Where there are too many terms for direct sums at all points, the error at the others is bounded by what fast sums
 * are off. */
static void test_many_terms(batten_context *ctx) {
  cloud c = make_box(2, 20000);
  uint64_t seed = 3;
  for (size_t i = 0; i < c.count; i++) c.values[i] += 0.02 * t_uniform(&seed); /* asks for all */
  batten_spline_reduce_options r = to(2e-3);
  r.centers_max = 1500;
  r.terms_max = 1500.0 * 3000;
  batten_spline_reduce_info i = {0};
  batten_spline *s = reduce(ctx, &c, NULL, &r, BATTEN_W_ACCURACY, &i);
  T_CHECK(strstr(batten_error(ctx), "allow more by reduce.centers_max"), "%s", batten_error(ctx));
  T_CHECK(i.centers == 1500, "%zu centres, as allowed", i.centers);
  T_CHECK(i.certified_points == 3000, "%zu points certified", i.certified_points);
  double *u = malloc(c.count * sizeof *u), error = 0;
  T_OK(batten_spline_evaluate(ctx, s, c.count, c.points, u, NULL, NULL), ctx);
  for (size_t k = 0; k < c.count; k++) error = fmax(error, fabs(u[k] - c.values[k]));
  T_RATIO(error, i.error_certified, "error by direct sums everywhere, against the bound");
  T_RATIO(error / r.tolerance, i.ratio_max, "over the tolerance");
  T_RATIO(i.error_certified, 1.02 * error, "the bound is tight");
  T_RATIO(fabs(i.error_max - error), 1e-12, "the worst is among those that are certified");
  free(u);
  batten_spline_free(s);
  free_cloud(&c);
}

/* The same in space, for values, distances, and both with tolerances of their own, against the test's own sums. */
static void test_many_terms_in_space(batten_context *ctx) {
  cloud c = make_sphere(3000, 7);
  double *tolerances = malloc(c.count * sizeof *tolerances);
  for (size_t i = 0; i < c.count; i++) tolerances[i] = i % 50 ? 5e-3 : 5e-4;
  for (int k = 0; k < 3; k++) {
    batten_spline_reduce_options r = to(5e-3);
    batten_spline_reduce_info i = {0};
    double error;
    r.terms_max = 0;
    r.distance_count = k == 0 ? 0 : k == 1 ? c.count : 2000;
    r.field_gradients = c.gradients;
    if (k == 2) r.tolerances = tolerances;
    batten_spline *s = reduce(ctx, &c, NULL, &r, BATTEN_OK, &i);
    const double ratio = recompute(&c, s, &r, &error);
    T_RATIO(ratio, 1, "%zu distances: %zu centres", r.distance_count, i.centers);
    T_RATIO(ratio, i.ratio_max * (1 + 1e-9), "largest error over its tolerance, against the bound");
    T_RATIO(error, i.error_certified * (1 + 1e-9), "largest error");
    T_RATIO(i.ratio_max, 1.05 * ratio, "the bound is tight");
    T_CHECK(i.points == c.count && i.certified_points == 1000, "%zu points certified", i.certified_points);
    batten_spline_free(s);
  }
  free(tolerances);
  free_cloud(&c);
}

/* ---- special cases ---- */

/* No more than that, from the first round on. */
static void test_few_allowed(batten_context *ctx) {
  cloud c = make_sphere(2000, 11);
  static const size_t most[] = {10, 20, 133, 300};
  for (size_t k = 0; k < sizeof most / sizeof *most; k++) {
    batten_spline_reduce_options r = to(1e-3);
    batten_spline_reduce_info i = {0};
    r.centers_max = most[k];
    batten_spline *s = reduce(ctx, &c, NULL, &r, BATTEN_W_ACCURACY, &i);
    T_CHECK(parts_of(s).count == most[k] && i.centers == most[k] && !i.all, "%zu allowed: %zu", most[k], i.centers);
    T_CHECK(strstr(batten_error(ctx), "allow more by reduce.centers_max"), "%s", batten_error(ctx));
    batten_spline_free(s);
  }
  c.count = 4;
  batten_spline_reduce_options r = to(1e-3);
  batten_spline_reduce_info i = {0};
  batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_OK, &i));
  T_CHECK(i.all && i.centers == 4, "four points: all of them, and so it says");
  free_cloud(&c);
}

/* All points but few lie in a plane, and so does every start of that many. */
static void test_flat_few_allowed(batten_context *ctx) {
  cloud c = make_box(3, 512);
  for (size_t i = 0; i < c.count; i++) c.points[3 * i + 2] = 0.5 * c.points[3 * i];
  batten_spline_reduce_options r = to(1e-3);
  batten_spline_reduce_info i = {0};
  r.centers_max = 300;
  T_CHECK(!reduce(ctx, &c, NULL, &r, BATTEN_E_SINGULAR, &i), "in a plane, 300 allowed: %s", batten_error(ctx));
  free_cloud(&c);
}

/* Squares of slopes in such units are no doubles any more, distances are the same. */
static void test_small_values(batten_context *ctx) {
  cloud c = make_sphere(2000, 12);
  batten_spline_reduce_options r = to(5e-3);
  batten_spline_reduce_info i = {0}, j = {0};
  r.distance_count = c.count;
  r.field_gradients = c.gradients;
  batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_OK, &i));
  for (size_t k = 0; k < c.count; k++) c.values[k] = ldexp(c.values[k], -600);
  for (size_t k = 0; k < 3 * c.count; k++) c.gradients[k] = ldexp(c.gradients[k], -600);
  batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_OK, &j));
  T_CHECK(i.centers == j.centers && i.error_max == j.error_max,
          "values times 2^-600: the same distances, %zu centres", j.centers);
  free_cloud(&c);
}

static void test_all(batten_context *ctx) {
  cloud c = make_box(3, 300);
  batten_spline_data d = data_of(&c);
  batten_spline_reduce_options r = to(1e-11);
  batten_spline_reduce_info i = {0};
  batten_spline *s = reduce(ctx, &c, NULL, &r, BATTEN_OK, &i), *plain = NULL;
  T_OK(batten_spline_fit(ctx, &d, NULL, &plain, NULL), ctx);
  T_CHECK(i.all && i.centers == c.count && same_bits(s, plain), "nearly no tolerance: the plain fit, to the bit");
  batten_spline_free(s);
  r.tolerance = 1e-18;
  s = reduce(ctx, &c, NULL, &r, BATTEN_W_ACCURACY, &i);
  T_CHECK(i.all && i.ratio_max > 1, "less than rounding: all points, and a warning: %s", batten_error(ctx));
  batten_spline_free(s);
  batten_spline_free(plain);
  free_cloud(&c);
}

static void test_polynomial(batten_context *ctx) {
  for (unsigned n = 1; n <= 3; n++) {
    cloud c = make_box(n, 5000);
    for (size_t i = 0; i < c.count; i++) c.values[i] = 3 + c.points[i * n] - 2 * c.points[i * n + n - 1];
    batten_spline_reduce_options r = to(1e-6);
    batten_spline_reduce_info i = {0};
    batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_OK, &i));
    T_CHECK(i.rounds == 1 && i.centers <= 140, "a linear function in n = %u: %zu centres, error %.2g", n, i.centers,
            i.error_max);
    free_cloud(&c);
  }
}

/* In other dimensions and orders, against the evaluator. */
static void test_kernels(batten_context *ctx) {
  static const struct {
    unsigned n, m;
    double tolerance;
  } of[] = {{1, 1, 1e-4}, {1, 2, 1e-4}, {2, 2, 1e-3}, {2, 3, 1e-4}, {3, 3, 2e-3}};
  for (size_t k = 0; k < sizeof of / sizeof *of; k++) {
    cloud c = make_box(of[k].n, 3000);
    batten_spline_options o = order(of[k].m);
    batten_spline_reduce_options r = to(of[k].tolerance);
    batten_spline_reduce_info i = {0};
    batten_spline *s = reduce(ctx, &c, &o, &r, BATTEN_OK, &i);
    double *u = malloc(c.count * sizeof *u), worst = INFINITY;
    if (s && batten_spline_evaluate(ctx, s, c.count, c.points, u, NULL, NULL) >= 0) worst = 0;
    for (size_t q = 0; q < c.count && worst < INFINITY; q++) worst = fmax(worst, fabs(u[q] - c.values[q]));
    T_RATIO(worst, of[k].tolerance, "n = %u, m = %u: %zu centres", of[k].n, of[k].m, i.centers);
    T_RATIO((double)i.centers, 0.5 * (double)c.count, "fewer than points");
    free(u);
    batten_spline_free(s);
    free_cloud(&c);
  }
}

static void test_twins(batten_context *ctx) {
  cloud c = make_box(3, 2000);
  for (size_t i = 0; i < 500; i++) {
    memcpy(c.points + 3 * (1500 + i), c.points + 3 * i, 3 * sizeof(double));
    c.values[1500 + i] = c.values[i] + 1e-4;
  }
  batten_spline_reduce_options r = to(1e-2);
  batten_spline_reduce_info i = {0};
  batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_OK, &i));
  T_CHECK(i.ratio_max <= 1, "equal points with nearly equal values: %zu centres", i.centers);
  c.values[1600] += 1;
  batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_W_ACCURACY, &i));
  T_CHECK(strstr(batten_error(ctx), "points[1600]") && strstr(batten_error(ctx), "equals another point"),
          "another value: %s", batten_error(ctx));
  free_cloud(&c);
}

/* A start in a plane has no spline. */
static void test_flat_start(batten_context *ctx) {
  cloud c = make_box(3, 1500);
  for (size_t i = 0; i < c.count; i++) c.points[3 * i + 2] = 0.5 * c.points[3 * i];
  c.points[3 * 700 + 2] += 0.02;
  batten_spline_reduce_options r = to(1e-2);
  batten_spline_reduce_info i = {0};
  batten_spline_free(reduce(ctx, &c, NULL, &r, BATTEN_OK, &i));
  T_CHECK(i.ratio_max <= 1, "all points but one in a plane: %zu centres", i.centers);
  c.points[3 * 700 + 2] -= 0.02;
  batten_spline *s = reduce(ctx, &c, NULL, &r, BATTEN_E_SINGULAR, &i);
  T_CHECK(!s, "all of them: %s", batten_error(ctx));
  free_cloud(&c);
}

static void test_smoothing(batten_context *ctx) {
  cloud c = make_sphere(3000, 5);
  batten_spline_options o = batten_spline_options_default();
  batten_spline_reduce_options r = to(1e-2);
  batten_spline_reduce_info i = {0};
  double error, *rho = calloc(c.count, sizeof *rho);
  o.smoothing = 1e-4;
  batten_spline *s = reduce(ctx, &c, &o, &r, BATTEN_OK, &i), *per;
  T_RATIO(recompute(&c, s, &r, &error), 1, "a little smoothing: %zu centres", i.centers);
  for (size_t k = 0; k < c.count; k++) rho[k] = 1e-4;
  o.smoothing_per_point = rho;
  per = reduce(ctx, &c, &o, &r, BATTEN_OK, &i);
  T_CHECK(same_bits(s, per), "one for each point: same bits");
  batten_spline_free(per);
  batten_spline_free(s);
  o.smoothing_per_point = NULL;
  o.smoothing = 100;
  s = reduce(ctx, &c, &o, &r, BATTEN_W_ACCURACY, &i);
  T_CHECK(s && strstr(batten_error(ctx), "smoothing holds U off"), "much: %s", batten_error(ctx));
  batten_spline_free(s);
  free(rho);
  free_cloud(&c);
}

/* ---- invariances ---- */

static size_t sum_of_places(const cloud *c, const batten_spline *s, bool reversed) {
  const batten_spline_parts p = parts_of(s);
  size_t sum = 0, found = 0;
  for (size_t i = 0; i < c->count; i++)
    for (size_t j = 0; j < p.count; j++)
      if (memcmp(c->points + 3 * i, p.centers + 3 * j, 3 * sizeof(double)) == 0) {
        const size_t place = reversed ? c->count - 1 - i : i;
        sum += (place + 1) * (place + 7);
        found++;
      }
  return found == p.count ? sum : 0;
}

static void test_invariance(batten_context *ctx) {
  cloud c = make_sphere(4000, 6), back = make_sphere(4000, 6);
  batten_spline_reduce_options r = to(5e-3);
  batten_spline_reduce_info i = {0}, j = {0};
  batten_spline *s = reduce(ctx, &c, NULL, &r, BATTEN_OK, &i), *other;
  double *same = malloc(c.count * sizeof *same);
  for (size_t k = 0; k < c.count; k++) same[k] = r.tolerance;
  batten_spline_reduce_options listed = r;
  listed.tolerances = same;
  other = reduce(ctx, &c, NULL, &listed, BATTEN_OK, &j);
  T_CHECK(same_bits(s, other), "tolerances all the same: same bits");
  batten_spline_free(other);
  free(same);
  batten_context *many = t_context(NULL, NULL, 3);
  other = reduce(many, &c, NULL, &r, BATTEN_OK, &j);
  T_CHECK(same_bits(s, other) && j.error_max == i.error_max, "three threads: same bits");
  batten_spline_free(other);
  batten_context_free(many);
  for (size_t k = 0; k < c.count; k++) {
    memcpy(back.points + 3 * k, c.points + 3 * (c.count - 1 - k), 3 * sizeof(double));
    back.values[k] = c.values[c.count - 1 - k];
  }
  other = reduce(ctx, &back, NULL, &r, BATTEN_OK, &j);
  T_CHECK(j.centers == i.centers && sum_of_places(&c, s, false) == sum_of_places(&back, other, true),
          "points in reverse: the same %zu centres", j.centers);
  batten_spline_free(other);
  for (size_t k = 0; k < 3 * c.count; k++) c.points[k] = ldexp(c.points[k], -30);
  for (size_t k = 0; k < c.count; k++) c.values[k] = ldexp(c.values[k], 40);
  r.tolerance = ldexp(r.tolerance, 40);
  other = reduce(ctx, &c, NULL, &r, BATTEN_OK, &j);
  bool scaled = j.centers == i.centers && j.error_max == ldexp(i.error_max, 40);
  for (size_t k = 0; k < i.centers && scaled; k++)
    scaled = parts_of(other).coefficients[k] == ldexp(parts_of(s).coefficients[k], 40);
  T_CHECK(scaled, "lengths times 2^-30, values times 2^40: weights times 2^40 to the bit");
  batten_spline_free(other);
  batten_spline_free(s);
  free_cloud(&c);
  free_cloud(&back);
}

/* ---- what can go wrong ---- */

static batten_status small(batten_context *ctx, void *arg) {
  const cloud *c = arg;
  const batten_spline_data d = data_of(c);
  batten_spline_reduce_options r = to(4e-2);
  batten_spline_reduce_info i = {.centers = 7};
  batten_spline *s = NULL;
  r.distance_count = 40;
  r.field_gradients = c->gradients;
  batten_status st = batten_spline_fit_reduced(ctx, &d, NULL, &r, &s, &i);
  if (st < 0 && (s || i.centers != 7)) t_line(false, "outputs touched by a failure");
  batten_spline_free(s);
  return st;
}

static void test_failures(void) {
  cloud c = make_sphere(90, 8);
  t_fail_every_allocation("a reduced fit", small, &c);
  t_cancel_every_progress("a reduced fit", small, &c);
  batten_context_options o = batten_context_options_default();
  for (o.memory_limit = 20000; o.memory_limit < 80000; o.memory_limit += 20000) {
    batten_context *ctx = NULL;
    batten_context_new(&o, &ctx);
    batten_status st = small(ctx, &c);
    T_CHECK(st >= 0 || st == BATTEN_E_NOMEM || st == BATTEN_E_TOO_LARGE, "%zu bytes: %s", o.memory_limit,
            batten_status_name(st));
    T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing held");
    batten_context_free(ctx);
  }
  free_cloud(&c);
}

static void test_bad(batten_context *ctx) {
  cloud c = make_sphere(200, 9);
  batten_spline_data d = data_of(&c);
  const batten_spline_reduce_options good = to(1e-2);
  batten_spline_reduce_options r = good;
  batten_spline *s = NULL;
  double some[200];
#define BAD(text) T_STATUS(batten_spline_fit_reduced(ctx, &d, NULL, &r, &s, NULL), BATTEN_E_INVALID, ctx, text)
  T_STATUS(batten_spline_fit_reduced(ctx, NULL, NULL, &r, &s, NULL), BATTEN_E_INVALID, ctx, "data: NULL");
  T_STATUS(batten_spline_fit_reduced(ctx, &d, NULL, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "reduce: NULL");
  T_STATUS(batten_spline_fit_reduced(ctx, &d, NULL, &r, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_spline_fit_reduced(NULL, &d, NULL, &r, &s, NULL) == BATTEN_E_INVALID, "no context");
  r.struct_size = 0;
  BAD("batten_spline_reduce_options.struct_size: 0");
  r = to(0);
  BAD("reduce.tolerance: 0");
  r = to(NAN);
  BAD("reduce.tolerance: nan");
  r = to(INFINITY);
  BAD("reduce.tolerance: inf");
  for (size_t i = 0; i < 200; i++) some[i] = i == 17 ? -1 : 1;
  r = good, r.tolerances = some;
  BAD("reduce.tolerances[17]: -1");
  r = good, r.share_max = 0;
  BAD("reduce.share_max: 0");
  r = good, r.share_max = 1.5;
  BAD("reduce.share_max: 1.5");
  r = good, r.terms_max = NAN;
  BAD("reduce.terms_max: nan");
  r = good, r.centers_max = 9;
  BAD("reduce.centers_max: 9; with n = 3 and m = 2 give 0 or at least 10");
  r = good, r.distance_count = 201;
  BAD("reduce.distance_count: 201, more than data.count = 200");
  r = good, r.distance_count = 3;
  BAD("reduce.field_gradients: NULL with reduce.distance_count = 3");
  some[4] = INFINITY, r.field_gradients = some;
  BAD("reduce.field_gradients[1][1]: inf");
  r = good;
  d.gradient_count = 1, d.gradients = some + 20;
  batten_spline_options o = order(3);
  T_STATUS(batten_spline_fit_reduced(ctx, &d, &o, &r, &s, NULL), BATTEN_E_INVALID, ctx,
           "data.gradient_count: 1; a tolerance is for values alone");
  d.gradient_count = 0;
  c.points[5] = NAN;
  BAD("points[1][2]: nan");
#undef BAD
  T_CHECK(!s, "nothing made");
  free_cloud(&c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_promise(ctx);
  test_many_terms(ctx);
  test_many_terms_in_space(ctx);
  test_few_allowed(ctx);
  test_flat_few_allowed(ctx);
  test_small_values(ctx);
  test_all(ctx);
  test_polynomial(ctx);
  test_kernels(ctx);
  test_twins(ctx);
  test_flat_start(ctx);
  test_smoothing(ctx);
  test_invariance(ctx);
  test_failures();
  test_bad(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is back");
  batten_context_free(ctx);
  return t_done();
}
