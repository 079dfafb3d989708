/* Bernstein polynomials on a triangle: against the sum over the basis written out, differences, and each other. */
#include "basis/triangular.h"
#include "tap.h"

#include <float.h>

typedef struct net {
  double b[TRIANGULAR_MAX][3];
} net;

static void random_net(uint64_t *seed, unsigned n, net *out) {
  for (size_t i = 0; i < triangular_count(n); i++)
    for (int d = 0; d < 3; d++) out->b[i][d] = 2 * t_uniform(seed) - 1;
}

static double factorial(unsigned n) { return n ? n * factorial(n - 1) : 1; }

/* The definition, with powers and factorials. */
static void by_definition(unsigned n, const double *b, unsigned dims, double u, double v, double *out) {
  for (unsigned d = 0; d < dims; d++) out[d] = 0;
  for (unsigned k = 0; k <= n; k++)
    for (unsigned j = 0; j + k <= n; j++) {
      unsigned i = n - j - k;
      double value =
          factorial(n) / (factorial(i) * factorial(j) * factorial(k)) * pow(1 - u - v, i) * pow(u, j) * pow(v, k);
      for (unsigned d = 0; d < dims; d++) out[d] += value * b[(k * (n + 1) - k * (k - 1) / 2 + j) * dims + d];
    }
}

/* The larger one; NaN wins. */
static double worse(double a, double b) { return isnan(a) || b <= a ? a : b; }

static double apart(const double *a, const double *b, size_t count) {
  double most = 0;
  for (size_t i = 0; i < count; i++) {
    double difference = fabs(a[i] - b[i]);
    if (!(difference <= most)) most = difference; /* NaN stays */
  }
  return most;
}

/* S = (u, v, u^2 v) has these jets everywhere. */
static void test_by_hand(void) {
  double b[10][3];
  for (unsigned k = 0; k <= 3; k++)
    for (unsigned j = 0; j + k <= 3; j++) {
      double *p = b[triangular_index(3, j, k)];
      p[0] = j / 3.0;
      p[1] = k / 3.0;
      p[2] = j == 2 && k == 1 ? 1 / 3.0 : 0; /* u^2 v = B_021 / 3 */
    }
  double u = 0.3, v = 0.25, jet[10][3];
  const double expected[10] = {u * u * v, 2 * u * v, u * u, 2 * v, 2 * u, 0, 0, 2, 0, 0};
  triangular_jet(3, (const double(*)[3])b, u, v, 3, jet);
  double worst = 0;
  for (int i = 0; i < 10; i++) {
    worst = worse(worst, fabs(jet[i][2] - expected[i]));
    worst = worse(worst, fabs(jet[i][0] - (i == 0 ? u : i == 1)));
    worst = worse(worst, fabs(jet[i][1] - (i == 0 ? v : i == 2)));
  }
  T_RATIO(worst, 8 * DBL_EPSILON, "jet of (u, v, u^2 v) as written out");
  T_CHECK(triangular_count(7) == 36 && triangular_index(7, 0, 7) == 35 && triangular_index(7, 7, 0) == 7 &&
              triangular_index(2, 0, 1) == 3,
          "indices: rows of j, k by k");
}

static void test_jets(uint64_t *seed) {
  double value = 0, slope = 0, table = 0;
  for (unsigned n = 0; n <= TRIANGULAR_DEGREE; n++) {
    net a;
    random_net(seed, n, &a);
    const double(*b)[3] = (const double(*)[3])a.b;
    for (int trial = 0; trial < 4; trial++) {
      double u = 1.4 * t_uniform(seed) - 0.2, v = 1.2 * t_uniform(seed) - 0.2, jet[10][3], expected[3], h = 1e-5;
      triangular_jet(n, b, u, v, 3, jet);
      by_definition(n, a.b[0], 3, u, v, expected);
      double size = fmax(1, pow(fabs(u) + fabs(v) + fabs(1 - u - v), n));
      value = worse(value, apart(jet[0], expected, 3) / size);
      /* Each derivative is the central difference of one of an order less. */
      static const int lower[10] = {0, 0, 0, 1, 1, 2, 3, 3, 4, 5}, along[10] = {0, 0, 1, 0, 1, 1, 0, 1, 1, 1};
      double ahead[2][10][3], behind[2][10][3];
      for (int axis = 0; axis < 2; axis++) {
        triangular_jet(n, b, u + (axis ? 0 : h), v + (axis ? h : 0), 2, ahead[axis]);
        triangular_jet(n, b, u - (axis ? 0 : h), v - (axis ? h : 0), 2, behind[axis]);
      }
      for (int i = 1; i < 10; i++)
        for (int d = 0; d < 3; d++) {
          double q = (ahead[along[i]][lower[i]][d] - behind[along[i]][lower[i]][d]) / (2 * h);
          slope = worse(slope, fabs(q - jet[i][d]) / (size * pow(fmax(n, 1), 5)));
        }
      double basis[TRIANGULAR_JET * TRIANGULAR_MAX], sum[10][3] = {{0}};
      triangular_basis(n, u, v, 3, basis);
      for (int i = 0; i < 10; i++)
        for (size_t c = 0; c < triangular_count(n); c++)
          for (int d = 0; d < 3; d++) sum[i][d] += basis[(size_t)i * triangular_count(n) + c] * b[c][d];
      for (int i = 0; i < 10; i++)
        table = worse(table, apart(sum[i], jet[i], 3) / (size * pow(fmax(n, 1), i < 1   ? 0
                                                                                : i < 3 ? 1
                                                                                : i < 6 ? 2
                                                                                        : 3)));
    }
  }
  T_RATIO(value, 100 * DBL_EPSILON, "values of degrees 0 .. 12, inside and outside, against powers");
  T_RATIO(slope, 1e-9, "derivatives to order 3 against differences");
  T_RATIO(table, 100 * DBL_EPSILON, "table of the basis times the net is the jet");
}

static void test_lower_orders(uint64_t *seed) {
  net a;
  random_net(seed, 5, &a);
  double full[10][3], part[10][3];
  triangular_jet(5, (const double(*)[3])a.b, 0.2, 0.3, 3, full);
  bool same = true, kept = true;
  for (unsigned order = 0; order < 3; order++) {
    for (int i = 0; i < 10; i++) part[i][0] = part[i][1] = part[i][2] = 77;
    triangular_jet(5, (const double(*)[3])a.b, 0.2, 0.3, order, part);
    unsigned entries = triangular_jet_count(order);
    same = same && apart(part[0], full[0], 3 * (size_t)entries) < 1e-13;
    kept = kept && part[entries][0] == 77;
  }
  T_CHECK(same && kept, "lower orders give the first entries and write no more");
}

static void test_normal(uint64_t *seed) {
  double cross = 0;
  for (unsigned n = 1; n <= TRIANGULAR_DEGREE; n++) {
    net a;
    random_net(seed, n, &a);
    double u = t_uniform(seed), v = (1 - u) * t_uniform(seed), normal[276][3], jet[3][3], expected[3], q[3];
    triangular_normal(n, (const double(*)[3])a.b, normal);
    by_definition(2 * n - 2, normal[0], 3, u, v, q);
    triangular_jet(n, (const double(*)[3])a.b, u, v, 1, jet);
    for (int d = 0; d < 3; d++)
      expected[d] = jet[1][(d + 1) % 3] * jet[2][(d + 2) % 3] - jet[1][(d + 2) % 3] * jet[2][(d + 1) % 3];
    cross = worse(cross, apart(q, expected, 3) / (n * n));
  }
  T_RATIO(cross, 100 * DBL_EPSILON, "du x dv in Bernstein form");
}

static void test_parts(uint64_t *seed) {
  double split = 0, part = 0;
  for (unsigned n = 0; n <= TRIANGULAR_DEGREE; n++) {
    net a, cut;
    random_net(seed, n, &a);
    double four[4 * TRIANGULAR_MAX * 3], work[3 * TRIANGULAR_MAX * 3], p[3], q[3];
    size_t size = triangular_count(n) * 3;
    triangular_split(n, 3, a.b[0], four, work);
    for (unsigned k = 0; k < 4; k++) {
      double u = t_uniform(seed), v = (1 - u) * t_uniform(seed), place[2];
      triangular_split_place(k, u, v, place);
      by_definition(n, four + k * size, 3, u, v, p);
      by_definition(n, a.b[0], 3, place[0], place[1], q);
      split = worse(split, apart(p, q, 3));
    }
    double corners[3][2] = {{0.1, 0.2}, {0.7, 0.15}, {0.3, 0.6}};
    for (int fixed = -1; fixed < 3; fixed++) {
      if (fixed >= 0) {
        corners[0][0] = fixed == 1;
        corners[0][1] = fixed == 2;
      }
      double u = 0.3, v = 0.45, w = 1 - u - v, x[2];
      for (int d = 0; d < 2; d++) x[d] = w * corners[0][d] + u * corners[1][d] + v * corners[2][d];
      triangular_part(n, 3, a.b[0], (const double(*)[2])corners, cut.b[0], work);
      by_definition(n, cut.b[0], 3, u, v, p);
      by_definition(n, a.b[0], 3, x[0], x[1], q);
      part = worse(part, apart(p, q, 3));
    }
  }
  T_RATIO(split, 40 * DBL_EPSILON, "the four parts of the midpoints");
  T_RATIO(part, 40 * DBL_EPSILON, "parts over triangles, with and without a common corner");
}

static void test_scaling(uint64_t *seed) {
  net a, b;
  random_net(seed, 7, &a);
  for (size_t i = 0; i < 36; i++)
    for (int d = 0; d < 3; d++) b.b[i][d] = ldexp(a.b[i][d], 40);
  double p[10][3], q[10][3];
  triangular_jet(7, (const double(*)[3])a.b, 0.3, 0.1, 3, p);
  triangular_jet(7, (const double(*)[3])b.b, 0.3, 0.1, 3, q);
  bool same = true;
  for (int i = 0; i < 10; i++)
    for (int d = 0; d < 3; d++) same = same && ldexp(p[i][d], 40) == q[i][d];
  T_CHECK(same, "2^40 times the net: 2^40 times the jet, to the bit");
}

int main(void) {
  uint64_t seed = 20;
  printf("# seed %llu\n", (unsigned long long)seed);
  test_by_hand();
  test_jets(&seed);
  test_lower_orders(&seed);
  test_normal(&seed);
  test_parts(&seed);
  test_scaling(&seed);
  return t_done();
}
