/* Bernstein polynomials in one variable: by hand, against the monomial form, and the parts against the whole. */
#include "basis/bezier.h"

#include "tap.h"

static double power(double t, unsigned n) {
  double p = 1;
  while (n--) p *= t;
  return p;
}

/* The sum as it is written. */
static double plain(unsigned n, unsigned dim, const double *c, unsigned x, double t) {
  double sum = 0;
  for (unsigned k = 0; k <= n; k++) sum += c[k * dim + x] * bezier_binomial[n][k] * power(t, k) * power(1 - t, n - k);
  return sum;
}

static void by_hand(void) {
  /* t^2 = (0, 0, 1); as a cubic (0, 0, 1/3, 1). (1 - t) (2 t) = (0, 1, 0). */
  const double square[3] = {0, 0, 1}, one[2] = {1, 0}, two[2] = {0, 2};
  double cubic[4], product[3], rate[2], value, slope;
  bezier_elevate(2, 1, square, cubic);
  T_CHECK(cubic[0] == 0 && cubic[1] == 0 && fabs(cubic[2] - 1. / 3) < 1e-16 && cubic[3] == 1, "t^2 as a cubic");
  bezier_multiply(1, one, 1, 1, two, product);
  T_CHECK(product[0] == 0 && product[1] == 1 && product[2] == 0, "(1 - t) 2 t");
  bezier_difference(2, 1, square, rate);
  T_CHECK(rate[0] == 0 && rate[1] == 1, "derivative of t^2 over 2");
  bezier_evaluate(2, 1, square, 3, &value, &slope);
  T_CHECK(value == 9 && slope == 6, "t^2 and its derivative at 3");
  bezier_evaluate(0, 1, two + 1, 0.5, &value, &slope);
  T_CHECK(value == 2 && slope == 0, "a constant");
  const double x[6] = {1, 0, 0, 1, 0, 0}, y[6] = {0, 1, 0, 0, 0, 1};
  double cross[9];
  bezier_cross(1, x, 1, y, cross); /* x cross ((1 - t) y + t z) = (1 - t) z - t y */
  T_CHECK(cross[2] == 1 && cross[1] == 0 && cross[4] == -0.5 && cross[5] == 0.5 && cross[7] == -1, "vector product");
}

static void against_sums(void) {
  uint64_t seed = 11;
  double worst = 0, worst_slope = 0, worst_part = 0, worst_product = 0;
  for (unsigned n = 0; n <= BEZIER_DEGREE_MAX; n++) {
    double c[39], value[3], slope[3], left[39], right[39], up[42], rate[39];
    for (unsigned k = 0; k < 3 * (n + 1); k++) c[k] = 2 * t_uniform(&seed) - 1;
    for (int i = 0; i < 7; i++) {
      double t = t_uniform(&seed), s = t_uniform(&seed), part[3], q = 0;
      bezier_evaluate(n, 3, c, t, value, slope);
      bezier_split(n, 3, c, t, left, right);
      if (n) bezier_difference(n, 3, c, rate);
      for (unsigned x = 0; x < 3; x++) {
        worst = fmax(worst, fabs(value[x] - plain(n, 3, c, x, t)));
        if (n) worst_slope = fmax(worst_slope, fabs(slope[x] - n * plain(n - 1, 3, rate, x, t)) / n);
      }
      bezier_evaluate(n, 3, left, s, part, NULL);
      for (unsigned x = 0; x < 3; x++) worst_part = fmax(worst_part, fabs(part[x] - plain(n, 3, c, x, s * t)));
      bezier_evaluate(n, 3, right, s, part, NULL);
      for (unsigned x = 0; x < 3; x++)
        worst_part = fmax(worst_part, fabs(part[x] - plain(n, 3, c, x, t + s * (1 - t))));
      if (n < BEZIER_DEGREE_MAX) {
        bezier_elevate(n, 3, c, up);
        for (unsigned x = 0; x < 3; x++)
          worst_part = fmax(worst_part, fabs(plain(n + 1, 3, up, x, t) - plain(n, 3, c, x, t)));
      }
      for (unsigned m = 0; m + n <= BEZIER_DEGREE_MAX; m++) {
        double a[13], both[39], crossed[39], b[39];
        for (unsigned k = 0; k <= m; k++) a[k] = 2 * t_uniform(&seed) - 1;
        for (unsigned k = 0; k < 3 * (m + 1); k++) b[k] = 2 * t_uniform(&seed) - 1;
        bezier_multiply(m, a, n, 3, c, both);
        bezier_cross(m, b, n, c, crossed);
        double f = plain(m, 1, a, 0, t), g[3], h[3], gh[3];
        for (unsigned x = 0; x < 3; x++) {
          h[x] = plain(n, 3, c, x, t);
          g[x] = plain(m, 3, b, x, t);
          q = fmax(q, fabs(plain(m + n, 3, both, x, t) - f * h[x]));
        }
        vec_cross(g, h, gh);
        for (unsigned x = 0; x < 3; x++) q = fmax(q, fabs(plain(m + n, 3, crossed, x, t) - gh[x]));
      }
      worst_product = fmax(worst_product, q);
    }
  }
  T_RATIO(worst, 1e-14, "values against the sum");
  T_RATIO(worst_slope, 1e-14, "derivatives against the sum of differences");
  T_RATIO(worst_part, 1e-14, "parts and elevation against the whole");
  T_RATIO(worst_product, 1e-14, "products of values");
}

int main(void) {
  by_hand();
  against_sums();
  return t_done();
}
