/* Parameters of points in order: kernel/contour/parameters.c. */
#include <batten/contour.h>
#include <float.h>

#include "tap.h"

enum { METHODS = 4, MANY = 400 };
static const batten_contour_parametrization methods[METHODS] = {BATTEN_CONTOUR_CHORD, BATTEN_CONTOUR_CENTRIPETAL,
                                                                BATTEN_CONTOUR_UNIFORM, BATTEN_CONTOUR_FOLEY};
static const char *const names[METHODS] = {"chord", "centripetal", "uniform", "Foley"};

static double farthest(size_t n, const double *a, const double *b) {
  double most = 0;
  for (size_t i = 0; i < n; i++) most = fmax(most, fabs(a[i] - b[i]));
  return most;
}

/* Points whose steps can be told by hand: lengths 4, 1, 9 with a right angle and a turn of 45 degrees. */
static void test_by_hand(batten_context *ctx) {
  const double r = sqrt(0.5), pi = acos(-1);
  const double points[] = {1, 1, 5, 1, 5, 2, 5 - 9 * r, 2 + 9 * r};
  const double first = 4 * (1 + 1.5 * pi / 2 * 1 / 5);
  const double second = 1 + 1.5 * pi / 2 * 4 / 5 + 1.5 * pi / 4 * 9 / 10;
  const double third = 9 * (1 + 1.5 * pi / 4 * 1 / 10);
  const double foley = first + second + third;
  const double expected[METHODS][4] = {{0, 4. / 14, 5. / 14, 1},
                                       {0, 2. / 6, 3. / 6, 1},
                                       {0, 1. / 3, 2. / 3, 1},
                                       {0, first / foley, (first + second) / foley, 1}};
  for (int m = 0; m < METHODS; m++) {
    double t[4] = {-1, -1, -1, -1};
    T_OK(batten_contour_parametrize(ctx, 4, points, methods[m], 0, t), ctx);
    T_RATIO(farthest(4, t, expected[m]), 4 * DBL_EPSILON, "%s by hand", names[m]);
  }
  const double square[] = {0, 0, 1, 0, 1, 1, 0, 1};
  const double quarters[] = {0, 0.25, 0.5, 0.75};
  for (int m = 0; m < METHODS; m++) {
    double t[5];
    T_OK(batten_contour_parametrize(ctx, 4, square, methods[m], 1, t), ctx);
    T_RATIO(farthest(4, t, quarters), DBL_EPSILON, "%s, closed square", names[m]);
    const double again[] = {0, 0, 1, 0, 1, 1, 0, 1, 0, 0};
    T_OK(batten_contour_parametrize(ctx, 5, again, methods[m], 1, t), ctx);
    T_CHECK(farthest(4, t, quarters) <= DBL_EPSILON && t[4] == 1, "%s, its first point repeated at the end: %.17g",
            names[m], t[4]);
  }
  /* A turn beyond 90 degrees counts as 90: there and back again. */
  const double back[] = {0, 0, 2, 0, 1, 0};
  double t[3];
  T_OK(batten_contour_parametrize(ctx, 3, back, BATTEN_CONTOUR_FOLEY, 0, t), ctx);
  double there = 2 * (1 + 0.75 * pi / 3), again = 1 + 0.75 * pi * 2 / 3;
  T_RATIO(fabs(t[1] - there / (there + again)), 2 * DBL_EPSILON, "Foley, there and back again");
}

static void test_repeated(batten_context *ctx) {
  uint64_t seed = 7;
  double points[2 * MANY], each[MANY], twice[4 * MANY], t[2 * MANY];
  for (size_t i = 0; i < 2 * MANY; i++) points[i] = t_uniform(&seed);
  for (size_t i = 0; i < MANY; i++)
    memcpy(twice + 4 * i, (double[]){points[2 * i], points[2 * i + 1], points[2 * i], points[2 * i + 1]}, 32);
  for (int m = 0; m < METHODS; m++)
    for (int closed = 0; closed < 2; closed++) {
      batten_status first = batten_contour_parametrize(ctx, MANY, points, methods[m], closed, each);
      batten_status second = batten_contour_parametrize(ctx, 2 * MANY, twice, methods[m], closed, t);
      bool same = first == BATTEN_OK && second == BATTEN_OK;
      for (size_t i = 0; i < 2 * MANY; i++) same = same && t[i] == each[i / 2];
      T_CHECK(same, "%s, %s: each point twice changes no parameter", names[m], closed ? "closed" : "open");
      T_CHECK(closed ? each[MANY - 1] < 1 : each[MANY - 1] == 1, "the last one is %g", each[MANY - 1]);
    }
}

static void test_invariance(batten_context *ctx) {
  uint64_t seed = 3;
  double points[2 * MANY], moved[2 * MANY], t[MANY], other[MANY];
  for (size_t i = 0; i < MANY; i++) {
    double a = 6 * (double)i / MANY;
    points[2 * i] = cos(a) + 0.3 * t_uniform(&seed);
    points[2 * i + 1] = sin(2 * a) + 0.3 * t_uniform(&seed);
  }
  for (int m = 0; m < METHODS; m++)
    for (int closed = 0; closed < 2; closed++) {
      batten_contour_parametrize(ctx, MANY, points, methods[m], closed, t);
      bool ordered = t[0] == 0;
      for (size_t i = 1; i < MANY; i++) ordered = ordered && t[i] > t[i - 1] && t[i] <= 1;
      T_CHECK(ordered, "%s, %s: in order", names[m], closed ? "closed" : "open");
      for (size_t i = 0; i < MANY; i++) memcpy(moved + 2 * i, points + 2 * ((MANY - i) % MANY), 16); /* first stays */
      if (!closed)
        for (size_t i = 0; i < MANY; i++) memcpy(moved + 2 * i, points + 2 * (MANY - 1 - i), 16);
      batten_contour_parametrize(ctx, MANY, moved, methods[m], closed, other);
      double most = 0;
      for (size_t i = closed != 0; i < MANY; i++)
        most = fmax(most, fabs(t[i] + other[closed ? MANY - i : MANY - 1 - i] - 1));
      T_RATIO(most, 4 * DBL_EPSILON, "reversed: t becomes 1 - t");
      bool same = true;
      for (int power = -1001; power <= 1001; power += 91) {
        for (size_t i = 0; i < 2 * MANY; i++) moved[i] = ldexp(points[i], power);
        batten_contour_parametrize(ctx, MANY, moved, methods[m], closed, other);
        same = same && memcmp(t, other, sizeof t) == 0;
      }
      T_CHECK(same, "scaled by powers of two, odd ones too: same bits");
      for (size_t i = 0; i < MANY; i++) {
        const double *p = points + 2 * i;
        moved[2 * i] = 300 * (0.6 * p[0] - 0.8 * p[1]) + 5;
        moved[2 * i + 1] = 300 * (0.8 * p[0] + 0.6 * p[1]) - 2;
      }
      batten_contour_parametrize(ctx, MANY, moved, methods[m], closed, other);
      T_RATIO(farthest(MANY, t, other), 1e-13, "turned, scaled and moved");
    }
}

static void test_bad(batten_context *ctx) {
  double points[] = {1, 2, 1, 2, 1, 2}, t[3] = {7, 7, 7};
  T_STATUS(batten_contour_parametrize(ctx, 3, points, BATTEN_CONTOUR_CHORD, 0, t), BATTEN_E_INVALID, ctx,
           "points: all 3 are equal; give two different");
  T_STATUS(batten_contour_parametrize(ctx, 3, points, BATTEN_CONTOUR_UNIFORM, 1, t), BATTEN_E_INVALID, ctx,
           "points: all 3 are equal");
  T_STATUS(batten_contour_parametrize(ctx, 1, points, BATTEN_CONTOUR_CHORD, 0, t), BATTEN_E_INVALID, ctx,
           "count: 1 points");
  T_STATUS(batten_contour_parametrize(ctx, 3, NULL, BATTEN_CONTOUR_CHORD, 0, t), BATTEN_E_INVALID, ctx,
           "points: NULL");
  T_STATUS(batten_contour_parametrize(ctx, 3, points, BATTEN_CONTOUR_CHORD, 0, NULL), BATTEN_E_INVALID, ctx,
           "parameters: NULL");
  T_STATUS(batten_contour_parametrize(ctx, 3, points, (batten_contour_parametrization)4, 0, t), BATTEN_E_INVALID, ctx,
           "method: 4");
  T_STATUS(batten_contour_parametrize(ctx, SIZE_MAX / 8, points, BATTEN_CONTOUR_CHORD, 0, t), BATTEN_E_TOO_LARGE, ctx,
           "count: ");
  points[3] = NAN;
  T_STATUS(batten_contour_parametrize(ctx, 3, points, BATTEN_CONTOUR_CHORD, 0, t), BATTEN_E_INVALID, ctx,
           "points[1][1]: nan; give finite");
  T_CHECK(t[0] == 7 && t[1] == 7 && t[2] == 7, "refused calls leave the parameters alone");
}

/* Distances beyond a double, and steps that vanish beside others. */
static void test_extremes(batten_context *ctx) {
  const double far_apart[] = {-1.7e308, -1.7e308, 1.7e308, 1.7e308, -1.7e308, 1.7e308};
  const double tiny[] = {1e300, 0, 1e300, 1e-320, -1e300, 0, -1e300, 5e-324};
  const double small[] = {0, 0, 5e-324, 0, 5e-324, 5e-324};
  for (int m = 0; m < METHODS; m++) {
    double t[4];
    T_OK(batten_contour_parametrize(ctx, 3, far_apart, methods[m], 1, t), ctx);
    T_CHECK(t[0] == 0 && t[1] > t[0] && t[2] > t[1] && t[2] < 1, "%s far apart: %g, %g", names[m], t[1], t[2]);
    T_OK(batten_contour_parametrize(ctx, 4, tiny, methods[m], 0, t), ctx);
    T_CHECK(t[0] == 0 && t[1] == 0 && t[2] == 1 && t[3] == 1, "%s: %g, %g, %g, %g", names[m], t[0], t[1], t[2], t[3]);
    T_OK(batten_contour_parametrize(ctx, 3, small, methods[m], 0, t), ctx);
    T_CHECK(t[1] == 0.5 && t[2] == 1, "%s, smallest numbers: %g", names[m], t[1]);
  }
}

static batten_status once(batten_context *ctx, void *arg) {
  double t[4];
  return batten_contour_parametrize(ctx, 4, arg, BATTEN_CONTOUR_FOLEY, 1, t);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  double square[] = {0, 0, 1, 0, 1, 1, 0, 1};
  test_by_hand(ctx);
  test_repeated(ctx);
  test_invariance(ctx);
  test_bad(ctx);
  test_extremes(ctx);
  t_fail_every_allocation("parametrize", once, square);
  batten_context_free(ctx);
  return t_done();
}
