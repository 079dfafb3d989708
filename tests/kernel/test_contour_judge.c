/* Whether a misfit is noise: by hand, and where it is worst. */
#include "contour/contour_inner.h"
#include "tap.h"

enum { COUNT = 200 };
static double points[COUNT][2], squares[COUNT], unconstrained[COUNT];

static void fill(double noise, double unconstrained_noise) {
  for (size_t i = 0; i < COUNT; i++) {
    double t = (double)i / (COUNT - 1);
    points[i][0] = t;
    points[i][1] = t * t;
    squares[i] = noise * noise;
    unconstrained[i] = unconstrained_noise * unconstrained_noise;
  }
}

/* 15 points, 8 control points: 8 parts of the rise against 7 that are left. F = (R - 1) 7 / 8, R the sum beside that
 * without inequalities; by chance F(8, 7) is above 13.1 (R = 16) 1.4 times in 1,000,
 * above 15.8 (R = 19) 0.8 times; misfits are sqrt(7 R / 15). */
static void test_few(void) {
  const contour_data data = {15, points[0], NULL};
  contour_verdict v;
  const double sums[] = {16, 19};
  for (int k = 0; k < 2; k++) {
    fill(0.01 * sqrt(sums[k]), 0.01);
    contour_judge(&data, squares, unconstrained, 16, &v);
    T_CHECK(v.contradicts == (k == 1) && v.misfit > 2.7 && v.misfit < 3,
            "15 points, sums rise %g times: misfit %.3g, %s", sums[k], v.misfit, v.contradicts ? "shape" : "chance");
  }
  fill(2e-5 * sqrt(19), 2e-5); /* the points' size is 14 / 199 here, 3e-3 of it 2e-4 */
  contour_judge(&data, squares, unconstrained, 16, &v);
  T_CHECK(!v.contradicts && v.misfit > 2.7, "a rise that is not seen is none: misfit %.3g", v.misfit);
}

int main(void) {
  contour_data data = {COUNT, points[0], NULL};
  contour_verdict v;

  /* 40 unknowns: 200 distances, 20 of which the curve follows; the noise is 0.01 sqrt(200 / 180) */
  fill(0.016, 0.01);
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_RATIO(fabs(v.misfit - 1.6 * sqrt(0.9)), 1e-12, "1.6 times the noise, by hand: %g, off by", v.misfit);
  T_CHECK(!v.contradicts, "is noise");
  fill(0.022, 0.01);
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_CHECK(v.contradicts && v.misfit < 3, "2.2 times, of 200 points and to be seen: another shape, misfit %g",
          v.misfit);
  fill(0.035, 0.01);
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_RATIO(fabs(v.misfit - 3.5 * sqrt(0.9)), 1e-12, "3.5 times: %g, off by", v.misfit);
  T_CHECK(v.contradicts, "is another shape");

  /* far off from 120 to 139 */
  fill(0.01, 0.01);
  for (size_t i = 120; i < 140; i++) squares[i] = 0.3 * 0.3;
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_CHECK(v.contradicts && v.worst >= 128 && v.worst <= 131, "a dent around point 129.5: %zu, misfit %g", v.worst,
          v.misfit);
  T_RATIO(fabs(v.distance - 0.3), 1e-12, "its depth is off by");
  double misfit = v.misfit, weights[COUNT];
  for (size_t i = 0; i < COUNT; i++) weights[i] = 2;
  data.weights = weights;
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_RATIO(fabs(v.misfit - misfit), 1e-12 * misfit, "weights of 2 change it by");
  for (size_t i = 120; i < 140; i++) weights[i] = 0;
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_CHECK(!v.contradicts, "points without weight contradict nothing: %g", v.misfit);
  data.weights = NULL;

  /* exact data: what is even to the eye is no misfit, however small the noise */
  fill(5e-5, 0);
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_CHECK(!v.contradicts && v.misfit < 1, "1/20,000 of the size from exact data: %g", v.misfit);
  fill(1e-2, 1e-15);
  contour_judge(&data, squares, unconstrained, 40, &v);
  T_CHECK(v.contradicts && v.misfit > 50 && v.misfit < 200, "1/100 of it: %g", v.misfit);

  /* as many unknowns as there are points: the points themselves tell that there is no noise here, and here is */
  fill(1e-2, 0);
  contour_judge(&data, squares, unconstrained, 2 * COUNT, &v);
  T_CHECK(v.contradicts, "smooth points that the fit without inequalities goes through: %g", v.misfit);
  uint64_t state = 4;
  for (size_t i = 0; i < COUNT; i++) points[i][1] += 0.02 * (t_uniform(&state) - 0.5);
  contour_judge(&data, squares, unconstrained, 2 * COUNT, &v);
  T_CHECK(!v.contradicts, "rough points that it goes through: %g", v.misfit);
  test_few();
  fill(1e-2, 1e-8);
  for (size_t i = 0; i < COUNT; i++) points[i][1] += 0.02 * (t_uniform(&state) - 0.5);
  contour_judge(&data, squares, unconstrained, 2 * COUNT - 4, &v);
  T_CHECK(!v.contradicts, "and where two of them are left: %g", v.misfit);
  data.count = 3;
  contour_judge(&data, squares, unconstrained, 8, &v);
  T_CHECK(isnan(v.misfit) && !v.contradicts, "three points tell nothing: %g", v.misfit);
  return t_done();
}
