/* B-splines in one variable, against their definition by recursion, which the library does not use. */
#include "tap.h"

#include <float.h>

#include "basis/bspline.h"

enum { KNOTS = 200, SPANS = 9 };

/* The function i of degree d at t as the limit from the span mu: de Boor's recursion, 0/0 = 0. */
static double recursive(const double *u, size_t i, unsigned d, size_t mu, double t) {
  if (d == 0) return i == mu;
  double value = 0;
  if (u[i + d] > u[i]) value += (t - u[i]) / (u[i + d] - u[i]) * recursive(u, i, d - 1, mu, t);
  if (u[i + d + 1] > u[i + 1])
    value += (u[i + d + 1] - t) / (u[i + d + 1] - u[i + 1]) * recursive(u, i + 1, d - 1, mu, t);
  return value;
}

static double recursive_derivative(const double *u, size_t i, unsigned d, size_t mu, double t, unsigned order) {
  if (order == 0) return recursive(u, i, d, mu, t);
  if (d == 0) return 0;
  double value = 0;
  if (u[i + d] > u[i]) value += d / (u[i + d] - u[i]) * recursive_derivative(u, i, d - 1, mu, t, order - 1);
  if (u[i + d + 1] > u[i + 1])
    value -= d / (u[i + d + 1] - u[i + 1]) * recursive_derivative(u, i + 1, d - 1, mu, t, order - 1);
  return value;
}

static double bernstein(unsigned n, unsigned i, double t) {
  double value = 1;
  for (unsigned k = 0; k < i; k++) value *= t * (n - k) / (k + 1);
  for (unsigned k = i; k < n; k++) value *= 1 - t;
  return value;
}

/* Space with breaks of unequal length; knots live in the caller's array. */
static bspline uneven(unsigned degree, unsigned smoothness, size_t spans, uint64_t *seed, double *knots) {
  double breaks[SPANS], at = -2;
  for (size_t s = 0; s + 1 < spans; s++) breaks[s] = at += 0.05 + t_uniform(seed);
  size_t count = bspline_make_knots(degree, smoothness, spans, breaks, -2, at + 0.3, knots);
  return (bspline){degree, count - degree - 1, knots};
}

/* Bounds are relative to the largest entry of the row, as high derivatives over short spans are large. */
static void test_definition(void) {
  uint64_t seed = 11;
  double knots[KNOTS], table[4 * BSPLINE_ORDER], worst[4] = {0}, sums = 0, negative = 0;
  size_t spaces = 0, spans_wrong = 0;
  for (unsigned d = 1; d <= BSPLINE_DEGREE; d++)
    for (unsigned smooth = 0; smooth < d; smooth++, spaces++) {
      size_t spans = 1 + (size_t)(t_uniform(&seed) * 6);
      bspline b = uneven(d, smooth, spans, &seed, knots);
      if (bspline_span_count(&b) != spans) spans_wrong++;
      for (size_t mu = bspline_first(&b); mu < b.count; mu = bspline_next(&b, mu))
        for (int place = 0; place < 3; place++) {
          double part = place == 0 ? 0 : place == 1 ? 1 : t_uniform(&seed);
          double t = place == 1 ? knots[mu + 1] : (1 - part) * knots[mu] + part * knots[mu + 1];
          if (place != 1 && bspline_span(&b, t) != mu) spans_wrong++;
          bspline_basis(&b, mu, t, 3, table);
          double sum = 0;
          for (unsigned j = 0; j <= d; j++) {
            sum += table[j];
            negative = fmin(negative, table[j]);
          }
          sums = fmax(sums, fabs(sum - 1));
          for (unsigned k = 0; k <= 3; k++) {
            double scale = 0, error = 0;
            for (unsigned j = 0; j <= d; j++) {
              double expected = recursive_derivative(knots, mu - d + j, d, mu, t, k);
              scale = fmax(scale, fabs(expected));
              error = fmax(error, fabs(expected - table[k * (d + 1) + j]));
            }
            worst[k] = fmax(worst[k], scale > 0 ? error / scale : error);
          }
        }
    }
  T_CHECK(spans_wrong == 0, "spans of %zu spaces are found", spaces);
  for (int k = 0; k <= 3; k++) T_RATIO(worst[k], 40 * DBL_EPSILON, "derivative %d against the recursion", k);
  T_RATIO(sums, 10 * DBL_EPSILON, "partition of unity");
  T_CHECK(negative == 0, "no function is negative");
}

/* Differences of values say the same as the derivatives, and smoothness is what was asked for, not more. */
static void test_smoothness(void) {
  uint64_t seed = 12;
  double knots[KNOTS], left[10 * BSPLINE_ORDER], right[10 * BSPLINE_ORDER], jump_inside = 0, jump_least = INFINITY,
                                                                            difference = 0;
  for (unsigned d = 1; d <= BSPLINE_DEGREE; d++)
    for (unsigned smooth = 0; smooth < d; smooth++) {
      bspline b = uneven(d, smooth, 3, &seed, knots);
      size_t mu = bspline_first(&b), next = bspline_next(&b, mu);
      double values[KNOTS];
      for (size_t i = 0; i < b.count; i++) values[i] = t_uniform(&seed) - 0.5;
      bspline_basis(&b, mu, knots[next], d, left);
      bspline_basis(&b, next, knots[next], d, right);
      for (unsigned k = 0; k <= smooth + 1; k++) {
        double jump = 0, size = 0;
        for (unsigned j = 0; j <= d; j++) {
          double l = left[k * (d + 1) + j] * values[mu - d + j], r = right[k * (d + 1) + j] * values[next - d + j];
          jump += r - l;
          size += fabs(r) + fabs(l);
        }
        if (k <= smooth)
          jump_inside = fmax(jump_inside, fabs(jump) / size);
        else
          jump_least = fmin(jump_least, fabs(jump) / size);
      }
      double h = 1e-4 * (knots[mu + 1] - knots[mu]), t = knots[mu] + 0.37 * (knots[mu + 1] - knots[mu]), scale = 0;
      bspline_basis(&b, mu, t, 1, left);
      for (unsigned j = 0; j <= d; j++) scale = fmax(scale, fabs(left[d + 1 + j]));
      double before[BSPLINE_ORDER], after[BSPLINE_ORDER];
      bspline_basis(&b, mu, t - h, 0, before);
      bspline_basis(&b, mu, t + h, 0, after);
      for (unsigned j = 0; j <= d; j++)
        difference = fmax(difference, fabs((after[j] - before[j]) / (2 * h) - left[d + 1 + j]) / scale);
    }
  T_RATIO(jump_inside, 40 * DBL_EPSILON, "jump of derivatives up to the smoothness");
  T_RATIO(1e-6, jump_least, "the next derivative does jump");
  T_RATIO(difference, 1e-6, "derivative against differences");
}

/* Bernstein coefficients on parts of spans, evaluated, are the derivative; tiny parts cost no digits. */
static void test_rows(void) {
  uint64_t seed = 13;
  double knots[KNOTS], rows[BSPLINE_ORDER * BSPLINE_ORDER], table[10 * BSPLINE_ORDER], worst[3] = {0}, sums = 0;
  bool negative = false;
  for (unsigned d = 1; d <= BSPLINE_DEGREE; d++)
    for (unsigned smooth = 0; smooth < d; smooth++) {
      bspline b = uneven(d, smooth, 4, &seed, knots);
      for (size_t mu = bspline_first(&b); mu < b.count; mu = bspline_next(&b, mu))
        for (int size = 0; size < 3; size++) {
          double length = knots[mu + 1] - knots[mu], part = size == 0 ? 1 : size == 1 ? 0.3 : 0x1p-30;
          double lower = size == 0 ? knots[mu] : knots[mu] + 0.41 * length;
          double upper = size == 0 ? knots[mu + 1] : lower + part * length;
          for (unsigned k = 0; k <= d; k++) {
            bspline_rows(&b, mu, k, lower, upper, rows);
            double x = t_uniform(&seed), scale = 0, error = 0;
            bspline_basis(&b, mu, lower + x * (upper - lower), k, table);
            for (unsigned j = 0; j <= d; j++) {
              double value = 0;
              for (unsigned i = 0; i <= d - k; i++) {
                value += bernstein(d - k, i, x) * rows[i * (d + 1) + j];
                scale = fmax(scale, fabs(rows[i * (d + 1) + j]));
                if (k == 0 && rows[i * (d + 1) + j] < 0) negative = true;
              }
              error = fmax(error, fabs(value - table[k * (d + 1) + j]));
            }
            worst[size] = fmax(worst[size], error / scale);
            for (unsigned i = 0; i <= d - k; i++) {
              double sum = 0, whole = 0;
              for (unsigned j = 0; j <= d; j++) {
                sum += rows[i * (d + 1) + j];
                whole += fabs(rows[i * (d + 1) + j]);
              }
              sums = fmax(sums, fabs(sum - (k == 0)) / whole);
            }
          }
        }
    }
  T_RATIO(worst[0], 100 * DBL_EPSILON, "rows on whole spans, evaluated");
  T_RATIO(worst[1], 100 * DBL_EPSILON, "rows on a third of the span");
  T_RATIO(worst[2], 100 * DBL_EPSILON, "rows on 2^-30 of the span");
  T_RATIO(sums, 40 * DBL_EPSILON, "rows of values have sum 1, of derivatives 0");
  T_CHECK(!negative, "rows of values are not negative");
}

/* By hand: a quadratic on one span is its Bezier form; on two equal spans the middle point of the first is at 1/2. */
static void test_by_hand(void) {
  double knots[KNOTS], rows[9], table[9];
  T_CHECK(bspline_make_knots(2, 1, 1, NULL, 0, 1, knots) == 6 && knots[2] == 0 && knots[3] == 1, "knots 000111");
  bspline one = {2, 3, knots};
  bspline_rows(&one, 2, 0, 0, 1, rows);
  bool unit = true;
  for (int i = 0; i < 9; i++) unit = unit && rows[i] == (i % 4 == 0);
  T_CHECK(unit, "a Bezier space: control points are coefficients");
  bspline_rows(&one, 2, 1, 0, 1, rows);
  T_CHECK(rows[0] == -2 && rows[1] == 2 && rows[2] == 0 && rows[3] == 0 && rows[4] == -2 && rows[5] == 2,
          "first derivative: twice the differences");
  bspline_rows(&one, 2, 2, 0.25, 0.5, rows);
  T_CHECK(rows[0] == 2 && rows[1] == -4 && rows[2] == 2, "second derivative: 2, -4, 2 on any part");
  bspline_basis(&one, 2, 0.5, 2, table);
  T_CHECK(table[0] == 0.25 && table[1] == 0.5 && table[2] == 0.25 && table[3] == -1 && table[4] == 0 && table[5] == 1,
          "values and slopes at 1/2");
  bspline_basis(&one, 2, 0.5, 2, table);
  T_CHECK(table[6] == 2 && table[7] == -4 && table[8] == 2, "second derivatives at 1/2");

  T_CHECK(bspline_make_knots(2, 1, 2, NULL, 0, 1, NULL) == 7, "knots are counted without an array");
  bspline_make_knots(2, 1, 2, NULL, 0, 1, knots);
  bspline two = {2, 4, knots};
  bspline_rows(&two, 2, 0, 0, 0.5, rows);
  T_CHECK(rows[6] == 0 && rows[7] == 0.5 && rows[8] == 0.5, "two spans meet in the middle of two control points");
}

static void test_edges(void) {
  double knots[KNOTS], greville[KNOTS], table[BSPLINE_ORDER * 12], worst = 0;
  uint64_t seed = 14;
  for (unsigned d = 1; d <= BSPLINE_DEGREE; d++)
    for (unsigned smooth = 0; smooth < d; smooth++) {
      bspline b = uneven(d, smooth, 5, &seed, knots);
      bspline_greville(&b, greville);
      for (int i = 0; i < 20; i++) {
        double t = bspline_lower(&b) + i / 19.0 * (bspline_upper(&b) - bspline_lower(&b)), value = 0;
        size_t mu = bspline_span(&b, t);
        bspline_basis(&b, mu, t, 0, table);
        for (unsigned j = 0; j <= d; j++) value += table[j] * greville[mu - d + j];
        worst = fmax(worst, fabs(value - t));
      }
    }
  T_RATIO(worst, 40 * DBL_EPSILON, "abscissas of Greville are the control points of t");

  size_t count = bspline_make_knots(3, 1, 4, NULL, 1, 3, knots);
  bspline b = {3, count - 4, knots};
  T_CHECK(count == 8 + 3 * 2 && b.count == 10, "cubics of smoothness 1: inner knots are double");
  T_CHECK(bspline_span(&b, 0) == 3 && bspline_span(&b, 1) == 3 && bspline_span(&b, -INFINITY) == 3,
          "before the beginning the first span");
  size_t last = bspline_span(&b, 3);
  T_CHECK(knots[last] == 2.5 && knots[last + 1] == 3 && bspline_span(&b, 9) == last, "beyond the end the last span");
  T_CHECK(bspline_next(&b, last) == b.count, "there is none after the last span");
  T_CHECK(knots[bspline_span(&b, 1.5)] == 1.5, "a knot belongs to the span that it begins");
  bspline_basis(&b, 3, 1.2, 6, table);
  bool zero = true;
  for (int i = 16; i < 28; i++) zero = zero && table[i] == 0;
  T_CHECK(zero, "derivatives beyond the degree vanish");
  double equal[KNOTS], given[] = {1.5, 2, 2.5};
  bspline_make_knots(3, 1, 4, given, 1, 3, equal);
  T_CHECK(memcmp(equal, knots, count * sizeof *knots) == 0, "given breaks at equal spans are equal spans");
}

int main(void) {
  test_by_hand();
  test_definition();
  test_smoothness();
  test_rows();
  test_edges();
  return t_done();
}
