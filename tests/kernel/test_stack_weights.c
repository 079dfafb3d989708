/* Blends along t: exact at sections, the whole spline by another route, what they reproduce, derivatives, bounds. */
#include "section/section_inner.h"
#include "tap.h"

enum { MOST = 80, KINDS = 5 };
static const batten_stack_between kinds[KINDS] = {BATTEN_BETWEEN_NATURAL, BATTEN_BETWEEN_NOT_A_KNOT,
                                                  BATTEN_BETWEEN_MONOTONE, BATTEN_BETWEEN_LINEAR,
                                                  BATTEN_BETWEEN_RATIONAL};
static const char *const names[KINDS] = {"natural", "not-a-knot", "monotone", "linear", "rational"};

static stack_weights *make(batten_context *ctx, int kind, size_t count, const double *t) {
  stack_weights *w = NULL;
  return stack_weights_make(ctx, kinds[kind], 2.5, count, t, &w) == BATTEN_OK ? w : NULL;
}
static void knots(uint64_t seed, size_t count, double uneven, double *t, double *f) {
  double at = -3;
  for (size_t i = 0; i < count; i++) {
    t[i] = at;
    at += 1 + uneven * (t_uniform(&seed) - 0.5);
    f[i] = 4 * t_uniform(&seed) - 2;
  }
}
static double value(const stack_weights *w, double t, const double *f, double *dt) {
  size_t first;
  stack_window(w, t, &first);
  return stack_weigh(w, t, f + first, dt, NULL);
}

/* The cubic spline through all knots at once: moments by elimination with pivots, dense. not_a_knot: both ends. */
static void whole_spline(size_t n, const double *t, const double *f, bool not_a_knot, double *m) {
  static double a[MOST][MOST + 1];
  memset(a, 0, sizeof a);
  for (size_t k = 1; k + 1 < n; k++) {
    double h = t[k] - t[k - 1], g = t[k + 1] - t[k];
    a[k][k - 1] = h, a[k][k] = 2 * (h + g), a[k][k + 1] = g;
    a[k][n] = 6 * ((f[k + 1] - f[k]) / g - (f[k] - f[k - 1]) / h);
  }
  a[0][0] = a[n - 1][n - 1] = 1;
  if (not_a_knot) {
    double r = (t[1] - t[0]) / (t[2] - t[1]), s = (t[n - 1] - t[n - 2]) / (t[n - 2] - t[n - 3]);
    a[0][1] = -1 - r, a[0][2] = r;
    a[n - 1][n - 2] = -1 - s, a[n - 1][n - 3] = s;
  }
  for (size_t k = 0; k < n; k++) {
    size_t pivot = k;
    for (size_t i = k; i < n; i++)
      if (fabs(a[i][k]) > fabs(a[pivot][k])) pivot = i;
    for (size_t j = 0; j <= n; j++) {
      double keep = a[k][j];
      a[k][j] = a[pivot][j], a[pivot][j] = keep;
    }
    for (size_t i = 0; i < n; i++) {
      double factor = i == k ? 0 : a[i][k] / a[k][k];
      for (size_t j = k; j <= n && factor != 0; j++) a[i][j] -= factor * a[k][j];
    }
  }
  for (size_t k = 0; k < n; k++) m[k] = a[k][n] / a[k][k];
}

static void test_spline(batten_context *ctx, int kind, size_t n, double uneven, double bound) {
  double t[MOST], f[MOST], m[MOST], worst = 0, worst_slope = 0;
  knots(n, n, uneven, t, f);
  whole_spline(n, t, f, kinds[kind] == BATTEN_BETWEEN_NOT_A_KNOT, m);
  stack_weights *w = make(ctx, kind, n, t);
  for (size_t i = 0; i + 1 < n; i++)
    for (int k = 0; k <= 10; k++) {
      double h = t[i + 1] - t[i], u = k / 10.0, q = 1 - u, dt, at = k == 10 ? t[i + 1] : t[i] + u * h;
      if (i + 2 < n && k == 10) continue;
      double expected = q * f[i] + u * f[i + 1] + h * h / 6 * ((q * q * q - q) * m[i] + (u * u * u - u) * m[i + 1]);
      double slope = (f[i + 1] - f[i]) / h + h / 6 * ((1 - 3 * q * q) * m[i] + (3 * u * u - 1) * m[i + 1]);
      worst = fmax(worst, fabs(value(w, at, f, &dt) - expected));
      worst_slope = fmax(worst_slope, fabs(dt - slope));
    }
  T_RATIO(worst, bound, "%s through %zu knots, uneven by %g, against the whole spline", names[kind], n, uneven);
  T_RATIO(worst_slope, 8 * bound, "  and its slope");
  stack_weights_free(w);
}

static void test_by_hand(batten_context *ctx) {
  const double t[3] = {0, 1, 2}, f[3] = {0, 1, 0}, g[4] = {0, 0, 1, 1}, four[4] = {0, 1, 2, 3};
  const double expected[KINDS] = {11.0 / 16, 0.75, 0.75, 0.5, 0.5 / (0.5 + 2.5 * 0.5)};
  for (int k = 0; k < KINDS; k++) {
    stack_weights *w = make(ctx, k, 3, t);
    T_RATIO(fabs(value(w, 0.5, f, NULL) - expected[k]), 1e-15, "%s through (0, 1, 0): %.4f halfway", names[k],
            expected[k]);
    stack_weights_free(w);
    size_t first;
    w = make(ctx, k, 1, t);
    double dt = 7, weight = 0;
    T_CHECK(stack_window(w, 0, &first) == 1 && first == 0 && stack_weigh(w, 0, f + 1, &dt, &weight) == 1 && dt == 0 &&
                weight == 1,
            "%s of one section is that section", names[k]);
    stack_weights_free(w);
    w = make(ctx, k, 2, t);
    if (k < 4) T_RATIO(fabs(value(w, 0.25, f, &dt) - 0.25) + fabs(dt - 1), 1e-15, "%s of two is a line", names[k]);
    stack_weights_free(w);
  }
  stack_weights *w = make(ctx, 2, 4, four);
  T_RATIO(fabs(value(w, 1.5, g, NULL) - 0.5), 1e-15, "monotone from 0 to 1 is halfway in the middle");
  T_CHECK(value(w, 0.5, g, NULL) == 0 && value(w, 2.5, g, NULL) == 1, "and level where sections are equal");
  stack_weights_free(w);
}

/* What all kinds have: sections to the bit, constants, straight lines (but rational), derivatives. */
static void test_all(batten_context *ctx, int kind, size_t n, double uneven) {
  double t[MOST], f[MOST], line[MOST], worst = 0, worst_dt = 0, worst_weight = 0, worst_sum = 0, worst_line = 0;
  uint64_t seed = 5;
  knots(n + 1, n, uneven, t, f);
  for (size_t i = 0; i < n; i++) line[i] = 3 * t[i] - 1;
  stack_weights *w = make(ctx, kind, n, t);
  bool exact = true, window = true;
  for (size_t i = 0; i < n; i++) exact = exact && value(w, t[i], f, NULL) == f[i];
  for (int k = 0; k < 400; k++) {
    double at = t[0] + (t[n - 1] - t[0]) * t_uniform(&seed), dt, weights[STACK_WINDOW], h = 1e-5, sum = 0, again = 0;
    size_t first, count = stack_window(w, at, &first);
    window = window && count <= STACK_WINDOW && first + count <= n;
    double v = stack_weigh(w, at, f + first, &dt, weights);
    for (size_t i = 0; i < count; i++) {
      double moved[MOST];
      memcpy(moved, f, sizeof moved);
      moved[first + i] += h;
      double up = value(w, at, moved, NULL);
      moved[first + i] -= 2 * h;
      worst_weight = fmax(worst_weight, fabs((up - value(w, at, moved, NULL)) / (2 * h) - weights[i]));
      sum += weights[i];
      again += weights[i] * f[first + i];
    }
    worst = fmax(worst, fabs(again - v)); /* all are of degree 1 in f */
    worst_sum = fmax(worst_sum, fabs(sum - 1));
    worst_line = fmax(worst_line, fabs(value(w, at, line, NULL) - (3 * at - 1)));
    size_t a, b;
    if (stack_window(w, at - h, &a) != stack_window(w, at + h, &b) || a != b) continue;
    worst_dt = fmax(worst_dt, fabs((value(w, at + h, f, NULL) - value(w, at - h, f, NULL)) / (2 * h) - dt));
  }
  T_CHECK(exact && window, "%s of %zu sections, uneven by %g: each section to the bit", names[kind], n, uneven);
  T_RATIO(worst, 1e-14, "  values are weights times functions");
  T_RATIO(worst_sum, 1e-14, "  weights sum to 1");
  if (kind < 4) T_RATIO(worst_line, 1e-12, "  lines stay lines");
  T_RATIO(worst_dt, 1e-8, "  slope against differences");
  T_RATIO(worst_weight, 1e-8, "  weights against differences");
  stack_weights_free(w);
}

static void test_kinds(batten_context *ctx) {
  double t[MOST], f[MOST], scaled[MOST], worst = 0, over = 0;
  knots(9, MOST, 0.9, t, f);
  stack_weights *rational = make(ctx, 4, 2, t), *linear = make(ctx, 3, 2, t), *monotone = make(ctx, 2, MOST, t);
  scaled[0] = 2.5 * f[0], scaled[1] = f[1];
  for (int k = 1; k < 20; k++) { /* zero together: the scaled blend is a positive multiple of the rational one */
    double at = t[0] + (t[1] - t[0]) * k / 20, u = k / 20.0;
    double both = value(linear, at, scaled, NULL) / (u + 2.5 * (1 - u));
    worst = fmax(worst, fabs(both - value(rational, at, f, NULL)));
  }
  T_RATIO(worst, 1e-14, "rational is linear with the lower section scaled by the shape");
  for (size_t i = 0; i + 1 < MOST; i++)
    for (int k = 0; k <= 40; k++) {
      double v = value(monotone, t[i] + (t[i + 1] - t[i]) * fmin(k / 40.0, 0.999999), f, NULL);
      over = fmax(over, fmax(v - fmax(f[i], f[i + 1]), fmin(f[i], f[i + 1]) - v));
    }
  T_RATIO(over, 1e-15, "monotone stays between its sections");
  stack_weights_free(rational);
  stack_weights_free(linear);
  stack_weights_free(monotone);
}

/* No value outside of the bounds; functions over a box are intervals about f. */
static void test_bounds(batten_context *ctx, int kind, size_t n) {
  double t[MOST], f[MOST], excess[3] = {0};
  uint64_t seed = 11;
  size_t outside = 0, tried = 0;
  knots(n + 2, n, 0.8, t, f);
  stack_weights *w = make(ctx, kind, n, t);
  for (int trial = 0; trial < 4000; trial++) {
    double width = (t[n - 1] - t[0]) * pow(0.5, 12 * t_uniform(&seed)), spread = pow(10, -8 * t_uniform(&seed));
    double t0 = t[0] + (t[n - 1] - t[0] - width) * t_uniform(&seed), t1 = fmin(t0 + width, t[n - 1]);
    if (trial % 5 == 0) t0 = t[trial % (int)n], t1 = fmin(t0 + width, t[n - 1]);
    size_t first, unused;
    stack_window(w, t0, &first);
    size_t end = stack_window(w, t1, &unused) + unused;
    interval box[MOST];
    for (size_t i = first; i < end; i++) box[i - first] = (interval){f[i] - spread, f[i] + spread * t_uniform(&seed)};
    interval r = stack_weigh_bounds(w, t0, t1, first, box);
    for (int k = 0; k < 12; k++) {
      double at = k == 0 ? t0 : k == 1 ? t1 : t0 + (t1 - t0) * t_uniform(&seed), g[MOST];
      for (size_t i = first; i < end; i++) {
        double u = t_uniform(&seed);
        u = k % 3 == 2 ? u : u < 0.5 ? 0 : 1;
        g[i] = fmin(fmax(box[i - first].lo * (1 - u) + box[i - first].hi * u, box[i - first].lo), box[i - first].hi);
      }
      double v = value(w, fmin(at, t1), g, NULL);
      outside += !(v >= r.lo && v <= r.hi);
      tried++;
    }
  }
  T_CHECK(outside == 0, "%s: %zu of %zu values outside of their bounds", names[kind], outside, tried);
  /* in t alone: how much wider than the values are the bounds, over widths that halve */
  for (int level = 0; level < 3; level++)
    for (int trial = 0; trial < 200; trial++) {
      double width = 0.2 * pow(0.5, level), low = INFINITY, high = -INFINITY;
      double t0 = t[0] + (t[n - 1] - t[0] - width) * trial / 200.0;
      size_t first, unused;
      stack_window(w, t0, &first);
      size_t end = stack_window(w, t0 + width, &unused) + unused;
      interval box[MOST];
      for (size_t i = first; i < end; i++) box[i - first] = interval_of(f[i]);
      interval r = stack_weigh_bounds(w, t0, t0 + width, first, box);
      for (int k = 0; k <= 200; k++) {
        double v = value(w, t0 + width * k / 200, f, NULL);
        low = fmin(low, v), high = fmax(high, v);
      }
      excess[level] += (r.hi - r.lo - (high - low)) / 200;
    }
  T_CHECK(excess[2] < 0.35 * excess[1] + 1e-12 && excess[1] < 0.35 * excess[0] + 1e-12,
          "%s: bounds narrow with order 2 in t: %.2g, %.2g, %.2g too wide", names[kind], excess[0], excess[1],
          excess[2]);
  stack_weights_free(w);
}

static batten_status make_and_free(batten_context *ctx, void *arg) {
  stack_weights *w = NULL;
  batten_status st = stack_weights_make(ctx, BATTEN_BETWEEN_NATURAL, 1, 3, arg, &w);
  stack_weights_free(w);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  double t[3] = {0, 1, 2};
  test_by_hand(ctx);
  for (int k = 0; k < 2; k++) {
    for (size_t n = 3 + (size_t)k; n < 7; n++) test_spline(ctx, k, n, 0.8, 1e-13);
    test_spline(ctx, k, 17, 0, 1e-13);
    test_spline(ctx, k, MOST, 0, 1e-8);   /* 0.268^16 = 7e-10 */
    test_spline(ctx, k, MOST, 1.6, 1e-7); /* gaps 1 : 9 */
  }
  for (int k = 0; k < KINDS; k++) {
    test_all(ctx, k, 2, 0);
    test_all(ctx, k, 5, 0.5);
    test_all(ctx, k, MOST, 1);
    test_bounds(ctx, k, 6);
    test_bounds(ctx, k, 60);
  }
  test_kinds(ctx);
  t_fail_every_allocation("making weights", make_and_free, t);
  batten_context_free(ctx);
  return t_done();
}
