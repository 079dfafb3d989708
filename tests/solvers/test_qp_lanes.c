/* The inner loops that are built for several instruction sets: right by longer sums, the same bits in all. */
#include <qp/judge_sums.h>
#include <qp/lanes.h>

#include "tap.h"

#include <float.h>
#include <string.h>

enum { MOST = 67, COLUMNS = 11, LD = MOST + 2 };

static double a[COLUMNS * LD], b[COLUMNS * LD], x[LD], u[COLUMNS];

static void fill(uint64_t seed) {
  for (size_t i = 0; i < COLUMNS * LD; i++) a[i] = 2 * t_uniform(&seed) - 1;
  for (size_t i = 0; i < LD; i++) x[i] = 2 * t_uniform(&seed) - 1;
  for (size_t i = 0; i < COLUMNS; i++) u[i] = 2 * t_uniform(&seed) - 1;
}

static long double dot(size_t n, const double *c, const double *v) {
  long double sum = 0;
  for (size_t i = 0; i < n; i++) sum += (long double)c[i] * v[i];
  return sum;
}

/* Everything that a set gives for length n, side by side in out; returns how many numbers. */
static size_t results(const qp_lanes *lanes, const qp_judge_sums *sums, size_t n, size_t count,
                      const uint32_t *columns, double *out) {
  size_t used = 0;
  lanes->dots(n, count, a, LD, x, out);
  used += count;
  const double *at[COLUMNS];
  for (size_t j = 0; j < count; j++) at[j] = a + (count - 1 - j) * LD;
  lanes->dots_at(n, count, at, x, out + used);
  used += count;
  memcpy(out + used, x, n * sizeof *x);
  lanes->combine(n, count, a, LD, 0.75, u, out + used);
  used += n;
  memcpy(b, a, sizeof a);
  lanes->subtract(n, count, b, LD, x, u);
  lanes->rotate(n, 0.6, 0.8, b, b + LD);
  for (size_t j = 0; j < count; j++, used += n) memcpy(out + used, b + j * LD, n * sizeof *b);
  memcpy(out + used, x, n * sizeof *x);
  lanes->slacks(n, a, a + 1, out + used);
  used += n;
  lanes->squares(n, a, x, out + used, out + used + 1);
  out[used + 2] = sums->plain(n, a, columns, x, out + used + 3);
  sums->twice(n, a, columns, x, out + used + 4, out + used + 5);
  used += 6;
  memcpy(out + used, x, n * sizeof *x);
  memset(out + used + n, 0, n * sizeof *x);
  sums->add(n, a, columns, 0.3, 1e-17, out + used, out + used + n);
  return used + 2 * n;
}

static void test_same_bits(void) {
  static double first[4096], other[4096];
  size_t sets = 0, differ = 0;
  uint32_t columns[MOST];
  for (uint32_t i = 0; i < MOST; i++) columns[i] = i;
  while (qp_lanes_at((unsigned)sets) && qp_judge_sums_at((unsigned)sets)) sets++;
  fill(1);
  for (size_t n = 1; n <= MOST; n++)
    for (size_t count = 2; count <= COLUMNS; count++) {
      size_t used = results(qp_lanes_at(0), qp_judge_sums_at(0), n, count, NULL, first);
      for (unsigned set = 0; set < sets; set++) {
        results(qp_lanes_at(set), qp_judge_sums_at(set), n, count, set % 2 ? NULL : columns, other);
        differ += memcmp(first, other, used * sizeof *first) != 0;
        results(qp_lanes_at(set), qp_judge_sums_at(set), n, count, set % 2 ? columns : NULL, other);
        differ += memcmp(first, other, used * sizeof *first) != 0;
      }
    }
  T_CHECK(sets >= 1 && differ == 0, "%zu sets, dense and sparse, %zu cases differ", sets, differ);
  T_CHECK(qp_lanes_now() == qp_lanes_at(0) && qp_judge_sums_now() == qp_judge_sums_at(0), "the widest is used");
}

static void test_values(void) {
  double worst = 0, worst_twice = 0;
  size_t beyond = 0, elsewhere = 0;
  fill(2);
  for (unsigned set = 0; qp_lanes_at(set); set++)
    for (size_t n = 1; n <= MOST; n++) {
      double out[COLUMNS], sum[LD], square, along, size, hi, lo;
      qp_lanes_at(set)->dots(n, COLUMNS, a, LD, x, out);
      for (size_t j = 0; j < COLUMNS; j++) worst = fmax(worst, fabs((double)(out[j] - dot(n, a + j * LD, x))));
      const double *at[COLUMNS];
      double again[COLUMNS];
      for (size_t j = 0; j < COLUMNS; j++) at[j] = a + j * LD;
      qp_lanes_at(set)->dots_at(n, COLUMNS, at, x, again);
      elsewhere += memcmp(out, again, sizeof out) != 0;
      memset(sum, 0, sizeof sum);
      qp_lanes_at(set)->combine(n, COLUMNS, a, LD, 2, u, sum);
      for (size_t i = 0; i < n; i++) {
        long double exact = 0;
        for (size_t j = 0; j < COLUMNS; j++) exact += 2 * (long double)u[j] * a[j * LD + i];
        worst = fmax(worst, fabs((double)(sum[i] - exact)));
      }
      memcpy(b, a, sizeof a);
      qp_lanes_at(set)->subtract(n, COLUMNS, b, LD, x, u);
      for (size_t i = 0; i < n; i++)
        worst = fmax(worst, fabs(b[(COLUMNS - 1) * LD + i] - (a[(COLUMNS - 1) * LD + i] - u[COLUMNS - 1] * x[i])));
      beyond += b[n] != a[n];
      qp_lanes_at(set)->squares(n, a, x, &square, &along);
      worst = fmax(worst, fabs((double)(square - dot(n, a, a))) + fabs((double)(along - dot(n, a, x))));
      worst = fmax(worst, fabs((double)(qp_judge_sums_at(set)->plain(n, a, NULL, x, &size) - dot(n, a, x))));
      qp_judge_sums_at(set)->twice(n, a, NULL, x, &hi, &lo);
      worst_twice = fmax(worst_twice, fabs((double)(hi + (long double)lo - dot(n, a, x))));
    }
  T_CHECK(elsewhere == 0, "vectors here and there: the same");
  T_CHECK(beyond == 0, "nothing is written beyond the end");
  T_CHECK(worst < 40 * DBL_EPSILON, "errors of plain sums %.2g", worst);
  T_CHECK(worst_twice < 100 * LDBL_EPSILON, "of sums in twice the precision %.2g", worst_twice);
}

int main(void) {
  test_values();
  test_same_bits();
  return t_done();
}
