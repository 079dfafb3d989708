/* Green's functions, their logarithm, and the polynomial basis. */
#include "basis/green.h"
#include "basis/polynomial.h"
#include "tap.h"

#include <float.h>

/* |a - b| in units of b's last place. */
static double ulps(double a, long double b) {
  int e;
  frexpl(b, &e);
  return b == 0 ? (a == 0 ? 0 : INFINITY) : (double)fabsl(((long double)a - b) / ldexpl(1, e - 53));
}

static void test_log(void) {
  uint64_t seed = 1;
  double worst = 0, near_one = 0;
  for (int i = 0; i < 1000000; i++) {
    double x = ldexp(1 + t_uniform(&seed), (int)(t_random(&seed) % 1200) - 600);
    worst = fmax(worst, ulps(batten_log_normal(x), logl((long double)x)));
    x = 1 + (t_uniform(&seed) - 0.5) * pow(2, -(double)(t_random(&seed) % 40));
    near_one = fmax(near_one, ulps(batten_log_normal(x), logl((long double)x)));
  }
  T_RATIO(worst, 1, "logarithm, ulp, 1e6 numbers over 1200 binades");
  T_RATIO(near_one, 1.5, "logarithm, ulp, 1e6 numbers around 1");
  T_CHECK(batten_log_normal(1) == 0, "ln 1 = 0");
  worst = 0;
  for (int k = -1022; k < 1024; k++) worst = fmax(worst, ulps(batten_log_normal(ldexp(1, k)), k * logl(2.0L)));
  T_RATIO(worst, 1, "logarithm of every power of 2, ulp");
}

/* phi, phi1, phi2, phi3 from (a ln r + b) r^q by the recurrence, in long double. */
static void reference(unsigned power, long double r, long double f[4]) {
  long double a = power % 2 ? 0 : 1, b = power % 2 ? 1 : 0;
  for (int k = 0, q = (int)power; k < 4; k++, q -= 2) {
    f[k] = (a == 0 ? b : a * logl(r) + b) * powl(r, q);
    b = b * q + a;
    a *= q;
  }
}

static void test_radial(void) {
  for (unsigned power = 1; power <= 7; power++) {
    double worst = 0, cancelled = 0;
    for (double r = 1e-12; r < 3; r *= 1.0009) {
      double d2 = r * r;
      batten_radial_terms f = batten_green_radial(power, 3, d2);
      double got[4] = {f.f0, f.f1, f.f2, f.f3};
      long double want[4], root = sqrtl((long double)d2);
      reference(power, root, want);
      for (unsigned k = 0; k < 4; k++) {
        if (power < 3 && k > 2) continue; /* not needed: no gradient data with these */
        /* a ln r + b has a zero: there the error is relative to its parts. */
        long double size = fabsl(want[k]), part = power % 2 ? size : powl(root, (int)power - 2 * (int)k);
        cancelled = fmax(cancelled, (double)(fabsl(got[k] - want[k]) / fmaxl(size, part)));
        if (k == 0) worst = fmax(worst, (double)(fabsl(got[k] - want[k]) / size));
      }
    }
    T_RATIO(worst, 4 * DBL_EPSILON, "power %u: phi, relative error", power);
    T_RATIO(cancelled, 50 * DBL_EPSILON, "power %u: phi to phi3", power);
    batten_radial_terms zero = batten_green_radial(power, 3, 0), tiny = batten_green_radial(power, 3, 1e-200);
    T_CHECK(zero.f0 == 0 && zero.f1 == 0 && zero.f2 == 0 && zero.f3 == 0, "power %u: all 0 at the centre", power);
    T_CHECK(isfinite(tiny.f0) && isfinite(tiny.f1) && isfinite(tiny.f2) && isfinite(tiny.f3),
            "power %u: finite at 1e-100 from the centre", power);
  }
}

static void test_orders(void) {
  unsigned exist = 0;
  for (unsigned n = 0; n < 6; n++)
    for (unsigned m = 0; m < 6; m++) exist += batten_green_exists(n, m);
  T_CHECK(exist == 4 + 3 + 3, "10 orders exist");
  const double sign[8] = {0, -1, 1, 1, -1, -1, 1, 1};
  for (unsigned p = 1; p < 8; p++) T_CHECK(batten_green_sign(p) == sign[p], "sign of power %u: %g", p, sign[p]);
}

/* w' K w > 0 for weights that annihilate the polynomials: that is what the sign is for. */
static void test_definite(void) {
  enum { N = 24 };
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned m = 1; m <= 4; m++) {
      if (!batten_green_exists(n, m)) continue;
      uint64_t seed = 100 * n + m;
      batten_polynomial basis = batten_polynomial_basis(n, m - 1);
      double least = INFINITY;
      for (int run = 0; run < 50; run++) {
        double x[N][3], w[N], q[BATTEN_POLYNOMIAL_MAX][N], form = 0, size = 0;
        for (int i = 0; i < N; i++) {
          for (int a = 0; a < 3; a++) x[i][a] = t_uniform(&seed) - 0.5;
          double row[BATTEN_POLYNOMIAL_MAX];
          batten_polynomial_row(&basis, x[i], -1, row);
          for (unsigned c = 0; c < basis.count; c++) q[c][i] = row[c];
          w[i] = t_uniform(&seed) - 0.5;
        }
        /* Gram-Schmidt, twice: w orthogonal to all columns. */
        for (unsigned c = 0; c <= basis.count; c++)
          for (int twice = 0; twice < 2; twice++) {
            double *v = c < basis.count ? q[c] : w;
            for (unsigned b = 0; b < c; b++) {
              double dot = 0, norm = 0;
              for (int i = 0; i < N; i++) dot += v[i] * q[b][i], norm += q[b][i] * q[b][i];
              for (int i = 0; i < N; i++) v[i] -= dot / norm * q[b][i];
            }
          }
        for (int i = 0; i < N; i++)
          for (int j = 0; j < N; j++) {
            double d2 = 0;
            for (unsigned a = 0; a < n; a++) d2 += (x[i][a] - x[j][a]) * (x[i][a] - x[j][a]);
            double k = batten_green_sign(2 * m - n) * batten_green_radial(2 * m - n, 0, d2).f0;
            form += w[i] * k * w[j];
            size += fabs(w[i] * k * w[j]);
          }
        least = fmin(least, form / size);
      }
      T_CHECK(least > 1e-12, "n = %u, m = %u: w'Kw > 0 on 50 random weights, least %.3g of the sum of its parts", n,
              m, least);
    }
}

static void test_polynomial(void) {
  static const unsigned char order[10][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 0},
                                             {1, 1, 0}, {1, 0, 1}, {0, 2, 0}, {0, 1, 1}, {0, 0, 2}};
  const unsigned counts[3][4] = {{1, 2, 3, 4}, {1, 3, 6, 10}, {1, 4, 10, 20}};
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned d = 0; d < 4; d++)
      T_CHECK(batten_polynomial_count(n, d) == counts[n - 1][d] &&
                  batten_polynomial_basis(n, d).count == counts[n - 1][d],
              "degree %u in %u variables: %u monomials", d, n, counts[n - 1][d]);
  batten_polynomial basis = batten_polynomial_basis(3, 2);
  T_CHECK(!memcmp(basis.exponent, order, sizeof order), "1, x, y, z, x^2, xy, xz, y^2, yz, z^2");
  basis = batten_polynomial_basis(2, 3);
  T_CHECK(basis.exponent[6][0] == 3 && basis.exponent[7][0] == 2 && basis.exponent[7][1] == 1 &&
              basis.exponent[9][1] == 3,
          "cubic in the plane ends with x^3, x^2 y, x y^2, y^3");

  /* By hand: 1 + 2 x^2 y - 3 y z at (2, 3, 5). */
  basis = batten_polynomial_basis(3, 3);
  double c[BATTEN_POLYNOMIAL_MAX] = {0}, x[3] = {2, 3, 5}, s[10];
  for (unsigned q = 0; q < basis.count; q++) {
    const unsigned char *e = basis.exponent[q];
    if (e[0] == 0 && e[1] == 0 && e[2] == 0) c[q] = 1;
    if (e[0] == 2 && e[1] == 1 && e[2] == 0) c[q] = 2;
    if (e[0] == 0 && e[1] == 1 && e[2] == 1) c[q] = -3;
  }
  const double want[10] = {1 + 24 - 45, 24, 8 - 15, -9, 12, 8, 0, 0, -3, 0};
  for (unsigned order_wanted = 0; order_wanted < 3; order_wanted++) {
    batten_polynomial_sum(&basis, c, x, order_wanted, s);
    unsigned used = order_wanted == 0 ? 1 : order_wanted == 1 ? 4 : 10;
    bool same = true;
    for (unsigned q = 0; q < 10; q++) same = same && s[q] == (q < used ? want[q] : 0);
    T_CHECK(same, "1 + 2 x^2 y - 3 y z and its derivatives up to order %u", order_wanted);
  }
  double row[BATTEN_POLYNOMIAL_MAX], sum[4] = {0};
  for (int axis = -1; axis < 3; axis++) {
    batten_polynomial_row(&basis, x, axis, row);
    for (unsigned q = 0; q < basis.count; q++) sum[axis + 1] += c[q] * row[q];
  }
  T_CHECK(sum[0] == want[0] && sum[1] == want[1] && sum[2] == want[2] && sum[3] == want[3], "the same from rows");
}

int main(void) {
  test_log();
  test_radial();
  test_orders();
  test_definite();
  test_polynomial();
  return t_done();
}
