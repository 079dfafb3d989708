/* batten_curve_closest: by hand, beside dense sampling with refinement, ties, units, threads. */
#include "curve_case.h"

static void find(batten_context *ctx, const curve_case *c, size_t count, const double *points, double *t, double *r) {
  batten_curve *curve = curve_case_make(ctx, c);
  if (batten_curve_closest(ctx, curve, count, points, t, r) < 0) t_line(false, "closest: %s", batten_error(ctx));
  batten_curve_free(curve);
}

static double distance_at(const curve_case *c, double t, const double *q) {
  batten_curve_form f = curve_case_form(c);
  double p[2];
  curve_case_value(&f, 0, t, p, NULL);
  return hypot(p[0] - q[0], p[1] - q[1]);
}

/* The least distance at samples, each better one narrowed by golden sections. */
static double oracle(const curve_case *c, const double *q) {
  enum { SAMPLES = 400 };
  double lower = c->knots[0], step = (c->knots[c->knot_count - 1] - lower) / SAMPLES, r[SAMPLES + 1],
         least = INFINITY;
  for (int i = 0; i <= SAMPLES; i++) r[i] = distance_at(c, lower + i * step, q);
  for (int i = 0; i <= SAMPLES; i++) {
    least = fmin(least, r[i]);
    if ((i > 0 && r[i] > r[i - 1]) || (i < SAMPLES && r[i] > r[i + 1]) || r[i] > 1.5 * least + 0.05) continue;
    double a = lower + fmax(i - 1, 0) * step, b = lower + fmin(i + 1, SAMPLES) * step, g = 0.6180339887498949;
    for (int k = 0; k < 70; k++) {
      double u = b - g * (b - a), v = a + g * (b - a);
      if (distance_at(c, u, q) < distance_at(c, v, q))
        b = v;
      else
        a = u;
    }
    least = fmin(least, distance_at(c, 0.5 * a + 0.5 * b, q));
  }
  return least;
}

static void test_by_hand(batten_context *ctx) {
  curve_case line = {.degree = 1, .knot_count = 5, .knots = {0, 0, 1, 3, 3}, .control = {{0, 0}, {2, 0}, {2, 4}}};
  double points[] = {1, 1, -1, -1, 3, 3, 2, 5, 0.5, 0}, t[5], r[5];
  find(ctx, &line, 5, points, t, r);
  T_CHECK(t[0] == 0.5 && r[0] == 1, "equally near both legs: the first, %g at %g", r[0], t[0]);
  T_CHECK(t[1] == 0 && fabs(r[1] - sqrt(2)) < 1e-15 && t[3] == 3 && r[3] == 1, "beyond the ends: %g, %g", t[1], t[3]);
  T_CHECK(fabs(t[2] - 2.5) < 1e-15 && r[2] == 1 && r[4] == 0 && t[4] == 0.25, "beside and on it: %g, %g", t[2], t[4]);
  /* y = x^2 on [-1, 1] from its axis: the vertex below 1/2, two feet x^2 = y - 1/2 above. */
  curve_case parabola = {
      .degree = 2, .knot_count = 6, .knots = {-1, -1, -1, 1, 1, 1}, .control = {{-1, 1}, {0, -1}, {1, 1}}};
  double axis[] = {0, 0.25, 0, 0.75, 0, -3};
  find(ctx, &parabola, 3, axis, t, r);
  T_CHECK(fabs(t[0]) < 1e-15 && fabs(r[0] - 0.25) < 1e-15 && fabs(t[2]) < 1e-15 && r[2] == 3, "the vertex: %g", t[0]);
  T_CHECK(fabs(t[1] + 0.5) < 1e-8 && fabs(r[1] - sqrt(0.5)) < 1e-15, "two feet: the first, %.17g", t[1]);
  curve_case point = {.degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}};
  for (int i = 0; i < 4; i++) point.control[i][0] = 3;
  double q[2] = {0, 4};
  find(ctx, &point, 1, q, t, r);
  T_CHECK(t[0] == 0 && r[0] == 5, "a curve that is one point: %g at %g", r[0], t[0]);
  double same[2];
  batten_curve *curve = curve_case_make(ctx, &parabola);
  T_OK(batten_curve_closest(ctx, curve, 1, axis, same, NULL), ctx);
  T_OK(batten_curve_closest(ctx, curve, 0, NULL, NULL, NULL), ctx);
  batten_curve_free(curve);
}

static void test_oracle(batten_context *ctx) {
  enum { CASES = 40, POINTS = 20 };
  uint64_t state = 3;
  double worst = 0, inconsistent = 0;
  for (int i = 0; i < CASES; i++) {
    unsigned degree = 1 + (unsigned)(i % 5);
    curve_case c = curve_case_random(&state, degree, t_random(&state) % 8, degree, i % 4 == 3, 2, 5);
    double points[2 * POINTS], t[POINTS], r[POINTS];
    for (int k = 0; k < 2 * POINTS; k++) points[k] = (k < POINTS ? 3 : 1) * (2 * t_uniform(&state) - 1);
    find(ctx, &c, POINTS, points, t, r);
    for (int k = 0; k < POINTS; k++) {
      worst = fmax(worst, r[k] - oracle(&c, points + 2 * k));
      inconsistent = fmax(inconsistent, fabs(distance_at(&c, t[k], points + 2 * k) - r[k]));
    }
  }
  T_RATIO(worst, 2e-12, "farther than the nearest of dense samples, refined");
  T_RATIO(inconsistent, 1e-14, "the distance is that at the parameter");
}

/* Points on the curve, near it, at the centre of a circle that is nearly one, and the start of a closed curve. */
static void test_special(batten_context *ctx) {
  uint64_t state = 8;
  curve_case c = curve_case_random(&state, 4, 9, 3, 0, 0, 1);
  batten_curve_form f = curve_case_form(&c);
  enum { POINTS = 200 };
  static double points[2 * POINTS], t[POINTS], r[POINTS];
  double on = 0, off = 0;
  for (int i = 0; i < POINTS; i++) curve_case_value(&f, 0, (double)i / (POINTS - 1), points + 2 * i, NULL);
  find(ctx, &c, POINTS, points, t, r);
  for (int i = 0; i < POINTS; i++) {
    on = fmax(on, r[i]);
    off = fmax(off, fabs(t[i] - (double)i / (POINTS - 1)));
  }
  T_CHECK(on < 2e-12 && off < 1e-9, "points of the curve: distance %.2g, parameter off by %.2g", on, off);
  curve_case ring = {.degree = 3, .knot_count = 17, .closed = 1};
  double k = 4 * (sqrt(2) - 1) / 3;
  for (int i = 0; i < 17; i++) ring.knots[i] = i < 4 ? 0 : i > 12 ? 4 : 1 + (i - 4) / 3;
  double arc[13][2] = {{1, 0},   {1, k},   {k, 1},  {0, 1},  {-k, 1}, {-1, k}, {-1, 0},
                       {-1, -k}, {-k, -1}, {0, -1}, {k, -1}, {1, -k}, {1, 0}};
  memcpy(ring.control, arc, sizeof arc);
  double centre[] = {0, 0, 2, 0, 1, 0, 0, 1e-9};
  find(ctx, &ring, 4, centre, t, r);
  T_CHECK(t[0] == 0 && r[0] == 1, "nearly a circle from its centre: the first place, %g at %g", r[0], t[0]);
  T_CHECK(t[1] == 0 && r[1] == 1 && t[2] == 0 && r[2] == 0, "the start of a closed curve, not its end: %g, %g", t[1],
          t[2]);
}

static void test_scales(batten_context *ctx) {
  uint64_t state = 21;
  curve_case c = curve_case_random(&state, 3, 6, 2, 0, 0, 1), large = c;
  enum { POINTS = 50 };
  double q[2 * POINTS], t[2][POINTS], r[2][POINTS];
  for (int k = 0; k < 2 * POINTS; k++) q[k] = 4 * t_uniform(&state) - 2;
  find(ctx, &c, POINTS, q, t[0], r[0]);
  for (int exponent = -600; exponent <= 900; exponent += 500) {
    double scaled[2 * POINTS];
    for (size_t i = 0; i < curve_case_count(&c); i++)
      for (int x = 0; x < 2; x++) large.control[i][x] = ldexp(c.control[i][x], exponent);
    for (int k = 0; k < 2 * POINTS; k++) scaled[k] = ldexp(q[k], exponent);
    find(ctx, &large, POINTS, scaled, t[1], r[1]);
    bool same = memcmp(t[0], t[1], sizeof t[0]) == 0;
    for (int k = 0; k < POINTS; k++) same = same && r[1][k] == ldexp(r[0][k], exponent);
    T_CHECK(same, "the same in units of 2^%d", exponent);
  }
  double far[] = {1e300, 0, -1e150, 1e150}, at[2], away[2];
  find(ctx, &c, 2, far, at, away);
  T_CHECK(away[0] == 1e300 && fabs(away[1] / (sqrt(2) * 1e150) - 1) < 1e-14, "far points: %g, %g", away[0], away[1]);
}

typedef struct query {
  const curve_case *c;
  size_t count;
  double *points, *t;
} query;

static batten_status call(batten_context *ctx, void *arg) {
  const query *q = arg;
  batten_curve_form form = curve_case_form(q->c);
  batten_curve *curve = NULL;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st < 0) return st;
  st = batten_curve_closest(ctx, curve, q->count, q->points, q->t, NULL);
  batten_curve_free(curve);
  return st;
}

static void test_threads(const query *q) {
  double *one = malloc(q->count * sizeof *one);
  for (unsigned k = 0; k < 2 && one; k++) {
    batten_context *ctx = t_context(NULL, NULL, k ? 3 : 1);
    query mine = *q;
    if (k == 0) mine.t = one;
    double start = batten_now();
    T_OK(call(ctx, &mine), ctx);
    printf("# %zu points: %.2f us each\n", q->count, (batten_now() - start) * 1e6 / (double)q->count);
    batten_context_free(ctx);
  }
  T_CHECK(one && memcmp(one, q->t, q->count * sizeof *one) == 0, "the same bits for 1 and 3 threads");
  free(one);
}

static void test_bad(batten_context *ctx, const curve_case *c) {
  batten_curve *curve = curve_case_make(ctx, c);
  double q[4] = {0, 0, NAN, 0}, t[2];
  T_STATUS(batten_curve_closest(ctx, NULL, 1, q, t, NULL), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_closest(ctx, curve, 1, NULL, t, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_curve_closest(ctx, curve, 1, q, NULL, NULL), BATTEN_E_INVALID, ctx, "parameters: NULL");
  T_STATUS(batten_curve_closest(ctx, curve, 2, q, t, NULL), BATTEN_E_INVALID, ctx, "points[1][0]: nan");
  T_STATUS(batten_curve_closest(ctx, curve, SIZE_MAX / 8, q, t, NULL), BATTEN_E_INVALID, ctx, "no array has so many");
  T_CHECK(batten_curve_closest(NULL, curve, 1, q, t, NULL) == BATTEN_E_INVALID, "no context");
  batten_curve_free(curve);
  curve_case huge = *c;
  for (size_t i = 0; i < curve_case_count(c); i++) huge.control[i][0] = i ? 1e308 : 0;
  curve = curve_case_make(ctx, &huge);
  q[0] = -1e308;
  T_STATUS(batten_curve_closest(ctx, curve, 1, q, t, NULL), BATTEN_E_INVALID, ctx,
           "points[0][0]: -1e+308; its distance");
  batten_curve_free(curve);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_oracle(ctx);
  test_special(ctx);
  test_scales(ctx);
  uint64_t state = 6;
  curve_case c = curve_case_random(&state, 3, 30, 1, 0, 0, 1);
  enum { COUNT = 20000 };
  query q = {&c, COUNT, malloc(2 * COUNT * sizeof(double)), malloc(COUNT * sizeof(double))};
  for (size_t k = 0; q.points && k < 2 * COUNT; k++) q.points[k] = 2 * t_uniform(&state) - 1;
  if (q.points && q.t) test_threads(&q);
  test_bad(ctx, &c);
  t_cancel_every_progress("batten_curve_closest", call, &q);
  q.count = 100;
  t_fail_every_allocation("batten_curve_closest", call, &q);
  free(q.points);
  free(q.t);
  batten_context_free(ctx);
  return t_done();
}
