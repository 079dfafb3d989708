/* Arc length, its inverse, and samples. */
#include "curve_case.h"

#include <float.h>

static const curve_case parabola = {
    .degree = 2, .knot_count = 6, .knots = {0, 0, 0, 1, 1, 1}, .control = {{0, 0}, {0.5, 0}, {1, 1}}};
/* (3 t^2, 3 t - t^3) has the speed 3 (1 + t^2): length 3 t + t^3. */
static const curve_case cubic = {.degree = 3,
                                 .knot_count = 8,
                                 .knots = {-1, -1, -1, -1, 2, 2, 2, 2},
                                 .control = {{3, -2}, {-3, -2}, {0, 7}, {12, -2}}};
/* (s^2, s^3), s = -1 .. 1, over [0, 1]. */
static const curve_case cusp = {.degree = 3,
                                .knot_count = 8,
                                .knots = {0, 0, 0, 0, 1, 1, 1, 1},
                                .control = {{1, -1}, {-1 / 3.0, 1}, {-1 / 3.0, -1}, {1, 1}}};

static double length_of(batten_context *ctx, const batten_curve *curve, double from, double to) {
  double length = NAN;
  if (batten_curve_length(ctx, curve, from, to, &length) < 0) printf("# %s\n", batten_error(ctx));
  return length;
}

static double place(batten_context *ctx, const batten_curve *curve, double length) {
  double t = NAN;
  if (batten_curve_at_lengths(ctx, curve, 1, &length, &t) < 0) printf("# %s\n", batten_error(ctx));
  return t;
}

/* ---- by hand ------------------------------------------------------------------------------------- */

static void test_known(batten_context *ctx) {
  batten_curve *curve = curve_case_make(ctx, &parabola);
  double whole = sqrt(5) / 2 + asinh(2) / 4;
  T_RATIO(fabs(length_of(ctx, curve, 0, 1) - whole) / whole, 1e-15, "length of a parabola");
  T_RATIO(fabs(length_of(ctx, curve, 1, 0) + whole) / whole, 1e-15, "the other way: negative");
  T_RATIO(fabs(length_of(ctx, curve, 0, 1e-9) / 1e-9 - 1), 1e-15, "a short part, to all digits");
  T_CHECK(length_of(ctx, curve, 0.3, 0.3) == 0, "nothing");
  T_CHECK(place(ctx, curve, 0) == 0 && place(ctx, curve, length_of(ctx, curve, 0, 1)) == 1 &&
              place(ctx, curve, whole) >= 1 - 1e-15,
          "the ends");
  batten_curve_free(curve);
  curve = curve_case_make(ctx, &cubic);
  double worst = 0, back = 0;
  for (int i = 0; i <= 60; i++) {
    double t = -1 + i / 20.0, s = 3 * t + t * t * t + 4;
    worst = fmax(worst, fabs(length_of(ctx, curve, -1, t) - s) / 18);
    back = fmax(back, fabs(place(ctx, curve, s) - t));
  }
  T_RATIO(worst, 1e-15, "lengths of a cubic with the speed 3 (1 + t^2)");
  T_RATIO(back, 2e-15, "its parameters at lengths");
  batten_curve_free(curve);
  curve = curve_case_make(ctx, &cusp);
  whole = 2 * (13 * sqrt(13) - 8) / 27;
  T_RATIO(fabs(length_of(ctx, curve, 0, 1) - whole) / whole, 1e-14, "over a cusp in the middle");
  T_RATIO(fabs(length_of(ctx, curve, 0.1, 1) + length_of(ctx, curve, 0, 0.1) - whole) / whole, 1e-14,
          "and in two parts, one with the cusp elsewhere");
  T_RATIO(fabs(place(ctx, curve, whole / 2) - 0.5), 1e-7, "the place of the cusp"); /* length goes as its square */
  batten_curve_free(curve);
}

/* ---- closed -------------------------------------------------------------------------------------- */

/* ((t - c)^2 / 2, e (t - c)) has the speed sqrt((t - c)^2 + e^2): where it is least may be narrower than any rule's
 * nodes are apart, and next to the end. */
static void test_slow(batten_context *ctx) {
  double worst = 0;
  for (int k = 0; k < 8; k++) {
    double c = 0.5, e = k ? pow(10, -k) : 0;
    curve_case slow = {.degree = 2,
                       .knot_count = 6,
                       .knots = {0, 0, 0, 1, 1, 1},
                       .control = {{0.125, -0.5 * e}, {-0.125, 0}, {0.125, 0.5 * e}}};
    batten_curve *curve = curve_case_make(ctx, &slow);
    for (int i = 1; i < 400; i++) {
      double t = i / 400.0, length = 0;
      for (int side = 0; side < 2; side++) {
        double a = side ? t - c : c;
        length += 0.5 * a * hypot(a, e) + (e > 0 ? 0.5 * e * e * asinh(a / e) : 0);
      }
      worst = fmax(worst, fabs(length_of(ctx, curve, 0, t) - length));
    }
    batten_curve_free(curve);
  }
  T_RATIO(worst, 1e-15, "lengths up to places at which curves are slow");
}

static void test_closed(batten_context *ctx) {
  /* A square of side 1, its sides of different spans. */
  const curve_case c = {.degree = 1,
                        .knot_count = 7,
                        .knots = {0, 0, 1, 3, 4, 8, 8},
                        .control = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}},
                        .closed = 1};
  batten_curve *curve = curve_case_make(ctx, &c);
  T_RATIO(fabs(length_of(ctx, curve, 6, 9) - 1.5), 1e-15, "over the seam");
  T_RATIO(fabs(length_of(ctx, curve, 9, 6) + 1.5), 1e-15, "backwards over it");
  T_RATIO(fabs(length_of(ctx, curve, -7, 17) - 12), 1e-15, "three times round");
  T_RATIO(fabs(length_of(ctx, curve, 0, 8) - 4) + fabs(length_of(ctx, curve, 8, 16) - 4), 1e-15, "once round");
  T_RATIO(fabs(length_of(ctx, curve, 8, 9) - 1), 1e-15, "from the seam");
  T_CHECK(place(ctx, curve, 5) == 9 && place(ctx, curve, -0.5) == -2 && place(ctx, curve, 4) == 8 &&
              place(ctx, curve, 8) == 16 && place(ctx, curve, 1.5) == 2 && place(ctx, curve, -4) == -8,
          "parameters at any lengths");
  batten_curve_free(curve);
}

/* ---- random ones: there and back, against Simpson's rule, the same bits in other units ----------- */

static double simpson(batten_context *ctx, const batten_curve *curve, double from, double to) {
  enum { STEPS = 20000 };
  double sum = 0;
  for (int i = 0; i <= STEPS; i++) {
    double t = from + (to - from) * i / STEPS, jet[2][2];
    batten_curve_derivatives(ctx, curve, 1, 1, &t, jet[0]);
    sum += (i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2) * hypot(jet[1][0], jet[1][1]);
  }
  return sum * (to - from) / STEPS / 3;
}

static void test_random(batten_context *ctx) {
  enum { COUNT = 300 };
  uint64_t state = 47;
  for (unsigned d = 1; d <= 9; d += d < 3 ? 1 : 3) {
    curve_case c = curve_case_random(&state, d, 5, d > 3 ? 3 : 1, 0, 0, 2), big = c;
    batten_curve *curve = curve_case_make(ctx, &c);
    double whole = length_of(ctx, curve, 0, 2), parts = 0, there[COUNT], at[COUNT], error = 0;
    for (int k = 0; k < 17; k++) parts += length_of(ctx, curve, 2 * k / 17.0, 2 * (k + 1) / 17.0);
    T_RATIO(fabs(parts - whole) / whole, 1e-12, "degree %u: parts have the length of the whole", d);
    double by_simpson = 0;
    for (size_t k = d; k + 1 < c.knot_count - d; k++)
      if (c.knots[k] < c.knots[k + 1]) by_simpson += simpson(ctx, curve, c.knots[k], nextafter(c.knots[k + 1], 0));
    T_RATIO(fabs(by_simpson - whole) / whole, 1e-10, "degree %u: against Simpson's rule", d);
    for (int k = 0; k < COUNT; k++) there[k] = whole * t_uniform(&state);
    T_OK(batten_curve_at_lengths(ctx, curve, COUNT, there, at), ctx);
    for (int k = 0; k < COUNT; k++) error = fmax(error, fabs(length_of(ctx, curve, 0, at[k]) - there[k]));
    T_RATIO(error / whole, 1e-12, "degree %u: there and back", d);
    bool same = true;
    for (int scale = -1000; scale <= 1000; scale += 2000) {
      for (size_t k = 0; k < curve_case_count(&c); k++)
        for (int x = 0; x < 2; x++) big.control[k][x] = ldexp(c.control[k][x], scale);
      for (size_t k = 0; k < c.knot_count; k++) big.knots[k] = ldexp(c.knots[k], -scale);
      batten_curve *other = curve_case_make(ctx, &big);
      same = same && length_of(ctx, other, 0, big.knots[c.knot_count - 1]) == ldexp(whole, scale) &&
             place(ctx, other, ldexp(there[0], scale)) == ldexp(at[0], -scale);
      batten_curve_free(other);
    }
    T_CHECK(same, "degree %u: the same bits in units of 2^-1000 and 2^1000", d);
    batten_curve *back = NULL;
    T_OK(batten_curve_reverse(ctx, curve, &back), ctx);
    T_RATIO(fabs(length_of(ctx, back, 0, 2) - whole) / whole, 1e-13, "degree %u: reversed as long", d);
    batten_curve_free(back);
    batten_curve_free(curve);
  }
}

static void test_threads(void) {
  enum { COUNT = 1000 };
  static double at[2][COUNT], lengths[COUNT];
  uint64_t state = 53;
  curve_case c = curve_case_random(&state, 4, 9, 1, 1, 0, 1);
  for (int k = 0; k < COUNT; k++) lengths[k] = 0.03 * (k - 300);
  for (unsigned k = 0; k < 2; k++) {
    batten_context *ctx = t_context(NULL, NULL, k ? 3 : 1);
    batten_curve *curve = curve_case_make(ctx, &c);
    T_OK(batten_curve_at_lengths(ctx, curve, COUNT, lengths, at[k]), ctx);
    batten_curve_free(curve);
    batten_context_free(ctx);
  }
  T_CHECK(memcmp(at[0], at[1], sizeof at[0]) == 0, "the same bits for 1 and 3 threads");
}

/* ---- samples ------------------------------------------------------------------------------------- */

/* The largest distance of the curve between samples from the chord. */
static double deviation(batten_context *ctx, const batten_curve *curve, size_t count, const double *t) {
  double most = 0;
  for (size_t i = 0; i + 1 < count; i++) {
    batten_curve_point p[2], q;
    batten_curve_evaluate(ctx, curve, 2, t + i, p);
    double chord[2] = {p[1].point[0] - p[0].point[0], p[1].point[1] - p[0].point[1]};
    double square = chord[0] * chord[0] + chord[1] * chord[1];
    for (int k = 1; k < 16; k++) {
      double u = t[i] + (t[i + 1] - t[i]) * k / 16;
      batten_curve_evaluate(ctx, curve, 1, &u, &q);
      double a = q.point[0] - p[0].point[0], b = q.point[1] - p[0].point[1];
      double part = square > 0 ? fmin(fmax((a * chord[0] + b * chord[1]) / square, 0), 1) : 0;
      most = fmax(most, hypot(a - part * chord[0], b - part * chord[1]));
    }
  }
  return most;
}

static void test_samples(batten_context *ctx) {
  uint64_t state = 59;
  double *t = NULL;
  size_t count = 0;
  for (unsigned d = 1; d <= 9; d += 2) {
    curve_case c = curve_case_random(&state, d, 4, 1, d == 5, 0, 1);
    batten_curve *curve = curve_case_make(ctx, &c);
    for (double tolerance = 0.1; tolerance > 1e-5; tolerance *= 0.1) {
      T_OK(batten_curve_sample(ctx, curve, tolerance, &count, &t), ctx);
      bool rises = t[0] == 0 && t[count - 1] == 1, knots = true;
      for (size_t i = 1; i < count; i++) rises = rises && t[i - 1] < t[i];
      for (size_t k = 0; k < c.knot_count; k++) {
        bool there = false;
        for (size_t i = 0; i < count; i++) there = there || t[i] == c.knots[k];
        knots = knots && there;
      }
      double off = deviation(ctx, curve, count, t);
      T_CHECK(rises && knots && off <= tolerance && (d > 1 || count == 6),
              "degree %u, tolerance %g: %zu samples, %g off", d, tolerance, count, off);
      batten_free(ctx, t);
    }
    batten_curve_free(curve);
  }
  /* A straight line at an uneven pace needs no more than its ends. */
  curve_case line = parabola;
  line.control[1][0] = 0.1;
  line.control[1][1] = 0.1;
  batten_curve *curve = curve_case_make(ctx, &line);
  T_OK(batten_curve_sample(ctx, curve, 1e-9, &count, &t), ctx);
  T_CHECK(count == 2 && t[0] == 0 && t[1] == 1, "a straight line: its ends");
  batten_free(ctx, t);
  batten_curve_free(curve);
  /* The parabola is 1 / (4 n^2) off its chords. */
  curve = curve_case_make(ctx, &parabola);
  T_OK(batten_curve_sample(ctx, curve, 1 / 400.0, &count, &t), ctx);
  T_CHECK(count <= 12 && count >= 10, "a parabola: %zu samples", count);
  batten_free(ctx, t);
  T_STATUS(batten_curve_sample(ctx, curve, 1e-300, &count, &t), BATTEN_E_TOO_LARGE, ctx,
           "tolerance: 1e-300; asks for");
  T_STATUS(batten_curve_sample(ctx, curve, 0, &count, &t), BATTEN_E_INVALID, ctx, "tolerance: 0; give a positive");
  T_STATUS(batten_curve_sample(ctx, curve, NAN, &count, &t), BATTEN_E_INVALID, ctx, "tolerance: nan");
  T_STATUS(batten_curve_sample(ctx, NULL, 1, &count, &t), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_sample(ctx, curve, 1, NULL, &t), BATTEN_E_INVALID, ctx, "count: NULL");
  T_STATUS(batten_curve_sample(ctx, curve, 1, &count, NULL), BATTEN_E_INVALID, ctx, "parameters: NULL");
  batten_curve_free(curve);
}

/* ---- edges --------------------------------------------------------------------------------------- */

static void test_bad(batten_context *ctx) {
  batten_curve *curve = curve_case_make(ctx, &parabola);
  double length, t;
  T_STATUS(batten_curve_length(ctx, curve, -1, 1, &length), BATTEN_E_INVALID, ctx, "from: -1; give one from 0 to 1");
  T_STATUS(batten_curve_length(ctx, curve, 0, NAN, &length), BATTEN_E_INVALID, ctx, "to: nan");
  T_STATUS(batten_curve_length(ctx, NULL, 0, 1, &length), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_length(ctx, curve, 0, 1, NULL), BATTEN_E_INVALID, ctx, "length: NULL");
  T_STATUS(batten_curve_at_lengths(ctx, curve, 1, (double[]){1.5}, &t), BATTEN_E_INVALID, ctx,
           "lengths[0]: 1.5; the curve has those from 0 to 1.478942857544597");
  T_STATUS(batten_curve_at_lengths(ctx, curve, 2, (double[]){1, -0.1}, &t), BATTEN_E_INVALID, ctx,
           "lengths[1]: -0.1");
  T_STATUS(batten_curve_at_lengths(ctx, curve, 1, (double[]){NAN}, &t), BATTEN_E_INVALID, ctx, "lengths[0]: nan");
  T_STATUS(batten_curve_at_lengths(ctx, curve, 1, NULL, &t), BATTEN_E_INVALID, ctx, "lengths: NULL");
  T_STATUS(batten_curve_at_lengths(ctx, curve, 1, &t, NULL), BATTEN_E_INVALID, ctx, "parameters: NULL");
  T_STATUS(batten_curve_at_lengths(ctx, NULL, 1, &t, &t), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_OK(batten_curve_at_lengths(ctx, curve, 0, NULL, NULL), ctx);
  batten_curve_free(curve);
  curve_case point = {.degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}, .closed = 1};
  for (int i = 0; i < 4; i++) point.control[i][0] = 1e9 / 3;
  curve = curve_case_make(ctx, &point);
  T_CHECK(length_of(ctx, curve, 0, 5) == 0 && place(ctx, curve, 0) == 0, "a point has no length");
  T_STATUS(batten_curve_at_lengths(ctx, curve, 1, (double[]){1}, &t), BATTEN_E_INVALID, ctx, "lengths[0]: 1");
  size_t count;
  double *samples;
  T_OK(batten_curve_sample(ctx, curve, 1e-9, &count, &samples), ctx);
  T_CHECK(count == 2, "two samples of a point");
  batten_free(ctx, samples);
  batten_curve_free(curve);
}

static batten_status use_all(batten_context *ctx, void *arg) {
  const curve_case *c = arg;
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  double lengths[3] = {0.1, 0.2, 0.5}, at[3], *samples = NULL;
  size_t count;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st >= 0) st = batten_curve_at_lengths(ctx, curve, 3, lengths, at);
  if (st >= 0) st = batten_curve_sample(ctx, curve, 0.01, &count, &samples);
  batten_free(ctx, samples);
  batten_curve_free(curve);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  uint64_t state = 61;
  curve_case c = curve_case_random(&state, 3, 8, 2, 0, 0, 1);
  test_known(ctx);
  test_slow(ctx);
  test_closed(ctx);
  test_random(ctx);
  test_threads();
  test_samples(ctx);
  test_bad(ctx);
  t_fail_every_allocation("lengths and samples", use_all, &c);
  batten_context_free(ctx);
  return t_done();
}
