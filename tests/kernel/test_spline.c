/* Fitting of volume splines. */
#include "basis/green.h"
#include "basis/polynomial.h"
#include "spline_cloud.h"

#include <float.h>

static batten_spline *fit_by(batten_context *ctx, const batten_spline_data *d, unsigned m, double smoothing,
                             batten_spline_info *info) {
  batten_spline_options o = batten_spline_options_default();
  o.m = m;
  o.smoothing = smoothing;
  batten_spline *s = NULL;
  batten_status st = batten_spline_fit(ctx, d, &o, &s, info);
  if (st != BATTEN_OK) T_CHECK(false, "fit n = %u, m = %u: %s", d->n, m, batten_error(ctx));
  return s;
}

static double value_at(batten_context *ctx, const batten_spline *s, const double *x) {
  double v = NAN;
  batten_spline_evaluate(ctx, s, 1, x, &v, NULL, NULL);
  return v;
}

/* ---- what a fit promises ---- */

static void test_residuals(batten_context *ctx) {
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned m = 1; m <= 4; m++) {
      if (!batten_green_exists(n, m)) continue;
      /* On a line the kernels' condition grows like N^(2m-1): fewer points as m rises. */
      size_t count = n > 1 ? 500 : m < 3 ? 500 : m == 3 ? 200 : 60;
      cloud c = make_cloud_by(n, count, n * 10 + m);
      batten_spline_data d = data_of(&c, false);
      batten_spline_info info;
      batten_spline *s = fit_by(ctx, &d, m, 0, &info);
      T_RATIO(info.residual_max, 1e-10, "n = %u, m = %u, N = %zu: residual (%s, rcond %.1e)", n, m, count,
              batten_saddle_method_name(info.saddle.method), info.saddle.rcond);
      T_CHECK(info.gradient_residual_max == 0 && info.energy > 0, "no gradients, energy %.3g", info.energy);
      batten_spline_free(s);
      free_cloud(&c);
    }
  cloud c = make_cloud_by(3, 4000, 1);
  batten_spline_data d = data_of(&c, false);
  batten_spline_info info;
  double start = batten_now();
  batten_spline *s = fit_by(ctx, &d, 2, 0, &info);
  printf("# N = 4000: %.2f s, %s\n", batten_now() - start, batten_saddle_method_name(info.saddle.method));
  T_RATIO(info.residual_max, 1e-10, "n = 3, m = 2, N = 4000: residual");
  double worst = 0;
  for (size_t i = 0; i < c.count; i += 37)
    worst = fmax(worst, fabs(value_at(ctx, s, c.points + 3 * i) - c.values[i]));
  T_RATIO(worst, 1e-10 * 2.4, "the same, point by point");
  batten_spline_free(s);
  free_cloud(&c);
}

/* Polynomials of degree m-1 come back, 1e7 boxes away from the origin or not, and also off the data. */
static void test_polynomials(batten_context *ctx) {
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned m = 1; m <= 4; m++) {
      if (!batten_green_exists(n, m)) continue;
      cloud c = make_cloud_by(n, n == 1 ? 40 : 150, 7 * n + m);
      batten_polynomial basis = batten_polynomial_basis(n, m - 1);
      double k[BATTEN_POLYNOMIAL_MAX], sums[10], lower = INFINITY, upper = -INFINITY, worst = 0;
      uint64_t seed = 4;
      for (unsigned q = 0; q < basis.count; q++) k[q] = t_uniform(&seed) - 0.5;
      for (size_t i = 0; i < c.count; i++) {
        double x[3] = {0};
        memcpy(x, c.points + i * n, n * sizeof *x);
        batten_polynomial_sum(&basis, k, x, 1, sums);
        c.values[i] = sums[0];
        lower = fmin(lower, sums[0]);
        upper = fmax(upper, sums[0]);
      }
      batten_spline_data d = data_of(&c, false);
      batten_spline *s = fit_by(ctx, &d, m, 0, NULL);
      double slope = 0, worst_slope = 0;
      for (int i = 0; i < 200; i++) {
        double x[3] = {0}, v, g[3];
        for (unsigned a = 0; a < n; a++) x[a] = t_uniform(&seed);
        batten_polynomial_sum(&basis, k, x, 1, sums);
        batten_spline_evaluate(ctx, s, 1, x, &v, g, NULL);
        worst = fmax(worst, fabs(v - sums[0]));
        for (unsigned a = 0; a < n; a++) {
          worst_slope = fmax(worst_slope, fabs(g[a] - sums[1 + a]));
          slope = fmax(slope, fabs(sums[1 + a]));
        }
      }
      double range = m == 1 ? fabs(k[0]) : upper - lower;
      T_RATIO(worst / range, 1e-11, "n = %u, m = %u: polynomial of degree %u reproduced", n, m, m - 1);
      if (m > 1) T_RATIO(worst_slope / slope, 1e-9, "n = %u, m = %u: its gradient", n, m);
      batten_spline_free(s);
      free_cloud(&c);
    }
}

static void test_hermite(batten_context *ctx) {
  for (unsigned n = 1; n <= 3; n++)
    for (unsigned m = 1; m <= 4; m++) {
      if (!batten_green_exists(n, m) || 2 * m - n <= 2 || (n == 2 && m == 4)) continue;
      cloud c = make_cloud_by(n, n == 1 ? 20 : 120, 9 * n + m);
      batten_spline_data d = data_of(&c, true);
      batten_spline_info info;
      batten_spline *s = fit_by(ctx, &d, m, 0, &info);
      T_RATIO(info.residual_max, 1e-10, "n = %u, m = %u with gradients: residual of the values (rcond %.1e)", n, m,
              info.saddle.rcond);
      T_RATIO(info.gradient_residual_max, 1e-10, "n = %u, m = %u with gradients: residual of the gradients", n, m);
      /* More data, better elsewhere. */
      batten_spline_data plain = data_of(&c, false);
      batten_spline *p = fit_by(ctx, &plain, m, 0, NULL);
      double with = 0, without = 0;
      uint64_t seed = 8;
      for (int i = 0; i < 300; i++) {
        double x[3];
        for (unsigned a = 0; a < n; a++) x[a] = 0.1 + 0.8 * t_uniform(&seed);
        double want = smooth(n, x, NULL);
        with += pow(value_at(ctx, s, x) - want, 2);
        without += pow(value_at(ctx, p, x) - want, 2);
      }
      T_RATIO(sqrt(with), sqrt(without), "n = %u, m = %u: gradients lower the error elsewhere", n, m);
      batten_spline_free(p);
      batten_spline_free(s);

      /* Gradients at some points only, in the caller's unit of length. */
      enum { SOME = 7 };
      size_t at[SOME];
      double some[SOME * 3], worst = 0, largest = 0;
      for (size_t q = 0; q < SOME; q++) {
        at[q] = 2 * q + q % 2;
        for (unsigned a = 0; a < n; a++) some[q * n + a] = 0.01 * c.gradients[at[q] * n + a];
      }
      for (size_t i = 0; i < c.count * n; i++) c.points[i] *= 100;
      d.gradient_count = SOME;
      d.gradient_at = at;
      d.gradients = some;
      s = fit_by(ctx, &d, m, 0, &info);
      for (size_t q = 0; q < SOME; q++) {
        double g[3];
        batten_spline_evaluate(ctx, s, 1, c.points + at[q] * n, NULL, g, NULL);
        for (unsigned a = 0; a < n; a++) {
          worst = fmax(worst, fabs(g[a] - some[q * n + a]));
          largest = fmax(largest, fabs(some[q * n + a]));
        }
      }
      T_RATIO(worst / largest, 1e-9, "n = %u, m = %u: %d gradients of %zu points, box of side 100", n, m, (int)SOME,
              c.count);
      batten_spline_free(s);
      free_cloud(&c);
    }
}

/* ---- a second route ---- */

/* n = 1, m = 2 is the natural cubic spline. Its second derivatives M solve
 * h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (slope_i - slope_{i-1}), M_0 = M_{N-1} = 0. */
static void test_cubic(batten_context *ctx) {
  enum { N = 12 };
  double x[N], f[N], diagonal[N], right[N], second[N] = {0}, worst[2] = {0};
  uint64_t seed = 21;
  for (int i = 0; i < N; i++) {
    x[i] = 5 + i + 0.6 * t_uniform(&seed);
    f[i] = t_uniform(&seed);
  }
  for (int i = 1; i < N - 1; i++) {
    double h0 = x[i] - x[i - 1], h1 = x[i + 1] - x[i], factor = i > 1 ? h0 / diagonal[i - 1] : 0;
    diagonal[i] = 2 * (h0 + h1) - (i > 1 ? factor * h0 : 0);
    right[i] = 6 * ((f[i + 1] - f[i]) / h1 - (f[i] - f[i - 1]) / h0) - (i > 1 ? factor * right[i - 1] : 0);
  }
  for (int i = N - 2; i > 0; i--) second[i] = (right[i] - (x[i + 1] - x[i]) * second[i + 1]) / diagonal[i];
  batten_spline_data d = batten_spline_data_default();
  d.n = 1;
  d.count = N;
  d.points = x;
  d.values = f;
  batten_spline_info info;
  batten_spline *s = fit_by(ctx, &d, 2, 0, &info);
  /* The 4th derivative of |x|^3 is 12 delta: the integral of U''^2 over the unit box is 12 w'Kw. */
  double bending = 0;
  for (int i = 0; i + 1 < N; i++)
    bending +=
        (x[i + 1] - x[i]) / 3 * (second[i] * second[i] + second[i] * second[i + 1] + second[i + 1] * second[i + 1]);
  T_RATIO(fabs(12 * info.energy / (bending * pow(x[N - 1] - x[0], 3)) - 1), 1e-11,
          "energy %.6g is the bending energy", info.energy);
  for (int i = 0; i + 1 < N; i++)
    for (double t = 0.125; t < 1; t += 0.25) {
      double h = x[i + 1] - x[i], at = x[i] + t * h, a = x[i + 1] - at, b = at - x[i], v, g, hessian;
      double want = (second[i] * a * a * a + second[i + 1] * b * b * b) / (6 * h) +
                    (f[i] / h - second[i] * h / 6) * a + (f[i + 1] / h - second[i + 1] * h / 6) * b;
      double want_second = (second[i] * a + second[i + 1] * b) / h;
      batten_spline_evaluate(ctx, s, 1, &at, &v, &g, &hessian);
      worst[0] = fmax(worst[0], fabs(v - want));
      worst[1] = fmax(worst[1], fabs(hessian - want_second));
    }
  T_RATIO(worst[0], 1e-11, "the natural cubic spline from its tridiagonal system");
  T_RATIO(worst[1], 1e-9, "and its second derivative");
  double beyond = 100, hessian;
  batten_spline_evaluate(ctx, s, 1, &beyond, NULL, NULL, &hessian);
  T_RATIO(fabs(hessian), 1e-9, "straight beyond the ends");
  batten_spline_free(s);
}

/* By hand: -|x| in one dimension, m = 1, is the piecewise linear interpolant, constant beyond the ends. */
static void test_linear(batten_context *ctx) {
  double x[3] = {0, 1, 3}, f[3] = {1, 3, -1}, at[4] = {0.25, 2.5, 7, -4}, want[4] = {1.5, 0, -1, 1};
  batten_spline_data d = batten_spline_data_default();
  d.n = 1;
  d.count = 3;
  d.points = x;
  d.values = f;
  batten_spline *s = fit_by(ctx, &d, 1, 0, NULL);
  for (int i = 0; i < 4; i++)
    T_RATIO(fabs(value_at(ctx, s, at + i) - want[i]), 1e-13, "polyline at %g: %g", at[i], want[i]);
  batten_spline_free(s);
}

/* Leave-one-out errors by really leaving one out. */
static void test_loo(batten_context *ctx) {
  for (int run = 0; run < 4; run++) {
    const bool hermite = run == 1, per_point = run == 3;
    const double rho = run == 2 ? 0.05 : 0;
    const unsigned m = run == 0 ? 2 : 3;
    cloud c = make_cloud_by(3, 40, 60 + (uint64_t)run);
    double each[40], sum = 0;
    for (int i = 0; i < 40; i++) each[i] = 0.001 * (1 + i % 5);
    batten_spline_data d = data_of(&c, hermite);
    /* A point's gradient would stay when its value goes: leave out point 0 alone, gradients belong to the next five.
     */
    size_t next[5] = {1, 2, 3, 4, 5};
    if (hermite) d.gradient_count = 5, d.gradient_at = next, d.gradients = c.gradients + 3;
    batten_spline_options o = batten_spline_options_default();
    o.m = m;
    o.smoothing = rho;
    o.smoothing_per_point = per_point ? each : NULL;
    o.loo_samples = hermite ? 1 : SIZE_MAX;
    batten_spline *s = NULL;
    batten_spline_info info;
    batten_spline_fit(ctx, &d, &o, &s, &info);
    batten_spline_free(s);
    const size_t left = hermite ? 1 : c.count;
    double *points = malloc(40 * 3 * sizeof *points), values[40], part = 0;
    o.loo_samples = 0;
    for (size_t i = 0; i < left; i++) {
      double x[3];
      memcpy(x, c.points + 3 * i, sizeof x);
      double rest[40];
      for (size_t j = 0, k = 0; j < c.count; j++) {
        if (j == i) continue;
        memcpy(points + 3 * k, c.points + 3 * j, sizeof x);
        rest[k] = each[j];
        values[k++] = c.values[j];
      }
      batten_spline_data less = d;
      less.count = c.count - 1;
      less.points = points;
      less.values = values;
      less.gradient_at = NULL;
      batten_spline_options p = o;
      if (per_point) p.smoothing_per_point = rest;
      s = NULL;
      if (batten_spline_fit(ctx, &less, &p, &s, NULL) < 0) {
        T_CHECK(false, "refit: %s", batten_error(ctx));
        continue;
      }
      double error = value_at(ctx, s, x) - c.values[i];
      sum += error * error;
      batten_spline_free(s);
    }
    part = sqrt(sum / (double)left);
    /* With smoothing the refit's own unit box differs a little where an extreme point is left out. */
    double allowed = run < 2 ? 1e-8 : 1e-3;
    T_RATIO(fabs(info.loo_rms / part - 1), allowed, "leave-one-out %.4g, by refits %.4g (%s)", info.loo_rms, part,
            run == 0   ? "r"
            : run == 1 ? "with gradients"
            : run == 2 ? "smoothed"
                       : "smoothed point by point");
    T_CHECK(info.loo_samples == left, "of %zu points", info.loo_samples);
    free(points);
    free_cloud(&c);
  }
}

/* ---- invariances ---- */

enum { PROBES = 60 };

/* U at fixed places of the cloud's box under x -> rotation x * scale + shift. */
static void probe(batten_context *ctx, const cloud *c, unsigned m, const double rotation[9], double scale,
                  double shift, const size_t *order, double out[PROBES]) {
  cloud moved = make_cloud_by(c->n, c->count, 1);
  batten_spline_data d = data_of(&moved, false);
  for (size_t i = 0; i < c->count; i++) {
    size_t from = order ? order[i] : i;
    moved.values[i] = c->values[from];
    for (unsigned a = 0; a < 3; a++) {
      double x = 0;
      if (rotation)
        for (unsigned b = 0; b < 3; b++) x += rotation[3 * a + b] * c->points[3 * from + b];
      else
        x = c->points[3 * from + a];
      moved.points[3 * i + a] = x * scale + shift;
    }
  }
  batten_spline *s = fit_by(ctx, &d, m, 0, NULL);
  uint64_t seed = 15;
  for (int i = 0; i < PROBES; i++) {
    double p[3], x[3];
    /* Multiples of 2^-20: shifts by whole numbers are exact. */
    for (unsigned a = 0; a < 3; a++) p[a] = floor(t_uniform(&seed) * 0x1p20) * 0x1p-20;
    for (unsigned a = 0; a < 3; a++) {
      x[a] = p[a];
      if (rotation) x[a] = rotation[3 * a] * p[0] + rotation[3 * a + 1] * p[1] + rotation[3 * a + 2] * p[2];
      x[a] = x[a] * scale + shift;
    }
    out[i] = value_at(ctx, s, x);
  }
  batten_spline_free(s);
  free_cloud(&moved);
}

static double difference(const double a[PROBES], const double b[PROBES]) {
  double worst = 0;
  for (int i = 0; i < PROBES; i++) worst = fmax(worst, fabs(a[i] - b[i]));
  return worst;
}

static void test_invariance(batten_context *ctx) {
  for (unsigned m = 2; m <= 3; m++) {
    cloud c = make_cloud_by(3, 200, 33);
    for (size_t i = 0; i < 600; i++) c.points[i] = floor(c.points[i] * 0x1p20) * 0x1p-20;
    double base[PROBES], other[PROBES];
    size_t order[200];
    for (size_t i = 0; i < 200; i++) order[i] = i * 77 % 200;
    const double third = 1.0 / 3, rotation[9] = {2 * third, -third, 2 * third, 2 * third, 2 * third,
                                                 -third,    -third, 2 * third, 2 * third};
    probe(ctx, &c, m, NULL, 1, 0, NULL, base);
    probe(ctx, &c, m, NULL, 0x1p40, 0, NULL, other);
    T_CHECK(difference(base, other) == 0, "m = %u: scaling by 2^40 changes no bit", m);
    probe(ctx, &c, m, NULL, 1, 1 << 23, NULL, other);
    T_CHECK(difference(base, other) == 0, "m = %u: an exact shift by 2^23 changes no bit", m);
    probe(ctx, &c, m, rotation, 1, 0, NULL, other);
    T_RATIO(difference(base, other), m == 2 ? 1e-12 : 1e-10, "m = %u: rotation", m);
    probe(ctx, &c, m, NULL, 1, 0, order, other);
    T_RATIO(difference(base, other), m == 2 ? 1e-12 : 1e-10, "m = %u: permutation", m);
    probe(ctx, &c, m, NULL, 123.4, 7e6, NULL, other);
    /* Coordinates lose 7e6 / 123.4 ulp, the function has slopes up to 10. */
    T_RATIO(difference(base, other), 10 * 7e6 / 123.4 * DBL_EPSILON * 10, "m = %u: 7e6 away with extent 123", m);
    free_cloud(&c);
  }
}

/* ---- smoothing ---- */

static void test_smoothing(batten_context *ctx) {
  cloud c = make_cloud_by(2, 80, 12);
  batten_spline_data d = data_of(&c, false);
  batten_spline_info info;
  batten_spline *s = fit_by(ctx, &d, 2, 0.02, &info);
  batten_spline_parts parts;
  batten_spline_get_parts(s, &parts);
  double worst = 0, largest = 0;
  for (size_t i = 0; i < c.count; i++) {
    double gap = c.values[i] - value_at(ctx, s, c.points + 2 * i);
    worst = fmax(worst, fabs(gap - 0.02 * parts.coefficients[i]));
    largest = fmax(largest, fabs(gap));
  }
  T_RATIO(worst, 1e-12, "v - U = rho w");
  T_CHECK(largest > 1e-4 && info.residual_max < 1e-12, "the smoothed spline misses by %.3g, its equations by %.1e",
          largest, info.residual_max);
  batten_spline_free(s);

  /* rho -> infinity: the least-squares plane, here from its 3 x 3 normal equations by Cramer's rule. */
  s = fit_by(ctx, &d, 2, 1e9, NULL);
  double a[3][3] = {{0}}, b[3] = {0};
  for (size_t i = 0; i < c.count; i++) {
    double row[3] = {1, c.points[2 * i], c.points[2 * i + 1]};
    for (int p = 0; p < 3; p++) {
      b[p] += row[p] * c.values[i];
      for (int q = 0; q < 3; q++) a[p][q] += row[p] * row[q];
    }
  }
  double x[4]; /* determinants: of a, and with column j replaced by b */
  for (int j = -1; j < 3; j++) {
    double t[3][3];
    for (int p = 0; p < 3; p++)
      for (int q = 0; q < 3; q++) t[p][q] = q == j ? b[p] : a[p][q];
    x[j + 1] = t[0][0] * (t[1][1] * t[2][2] - t[1][2] * t[2][1]) - t[0][1] * (t[1][0] * t[2][2] - t[1][2] * t[2][0]) +
               t[0][2] * (t[1][0] * t[2][1] - t[1][1] * t[2][0]);
  }
  double at[2] = {0.3, 0.8};
  T_RATIO(fabs(value_at(ctx, s, at) - (x[1] + x[2] * at[0] + x[3] * at[1]) / x[0]), 1e-6,
          "rho = 1e9: least-squares plane");
  batten_spline_free(s);
  for (double rho = 1e12; rho < 1e20; rho *= 3) {
    s = fit_by(ctx, &d, 2, rho, &info);
    T_CHECK(info.energy >= 0 && info.energy < 1e-9, "rho = %.0e: energy %.2g, rounding is not negative", rho,
            info.energy);
    batten_spline_free(s);
  }

  double each[80];
  for (int i = 0; i < 80; i++) each[i] = i == 5 ? 100 : 0;
  batten_spline_options o = batten_spline_options_default();
  o.smoothing = 7; /* must not count */
  o.smoothing_per_point = each;
  T_OK(batten_spline_fit(ctx, &d, &o, &s, NULL), ctx);
  T_RATIO(fabs(value_at(ctx, s, c.points + 2 * 6) - c.values[6]), 1e-11,
          "smoothing of one point leaves the others interpolated");
  T_CHECK(fabs(value_at(ctx, s, c.points + 2 * 5) - c.values[5]) > 1e-5, "and lets that one go");
  batten_spline_free(s);
  free_cloud(&c);
}

/* ---- edges and bad input ---- */

static void test_edges(batten_context *ctx) {
  double x[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 2, 2, 2}, f[5] = {1, 2, 3, 4, 5};
  batten_spline_data d = batten_spline_data_default();
  d.count = 4;
  d.points = x;
  d.values = f;
  batten_spline_info info;
  batten_spline *s = fit_by(ctx, &d, 2, 0, &info);
  double at[3] = {0.5, 0.25, 2};
  T_RATIO(fabs(value_at(ctx, s, at) - 8), 1e-14, "4 points in space: the linear function through them");
  T_CHECK(isnan(info.loo_rms) && info.loo_samples == 0 && info.energy == 0, "no leave-one-out error, no energy");
  batten_spline_free(s);
  d.count = 5;
  s = fit_by(ctx, &d, 2, 0, &info);
  T_RATIO(info.residual_max, 1e-14, "5 points");
  batten_spline_free(s);
  d.count = 1;
  d.n = 1;
  s = fit_by(ctx, &d, 1, 0, &info);
  T_CHECK(value_at(ctx, s, at) == 1, "one point on a line: the constant");
  batten_spline_free(s);
  /* One value and one gradient are a linear function. */
  double g[3] = {2, -1, 3};
  d.n = 1, d.count = 1, d.gradient_count = 1, d.gradients = g;
  s = fit_by(ctx, &d, 2, 0, &info);
  T_CHECK(value_at(ctx, s, at) == 2 && info.gradient_residual_max == 0, "a value and a slope");
  batten_spline_free(s);

  /* A surface with its normals: all values equal. */
  cloud c = make_cloud_by(3, 60, 2);
  for (size_t i = 0; i < c.count; i++) c.values[i] = 0;
  d = data_of(&c, true);
  s = fit_by(ctx, &d, 3, 0, &info);
  T_RATIO(fmax(info.residual_max, info.gradient_residual_max), 1e-10, "all values 0, gradients given");
  batten_spline_free(s);
  d = data_of(&c, false);
  s = fit_by(ctx, &d, 2, 0, &info);
  T_CHECK(value_at(ctx, s, at) == 0 && info.residual_max == 0 && info.loo_rms == 0, "all values 0");
  batten_spline_free(s);
  free_cloud(&c);
}

static void test_units_of_value(batten_context *ctx) {
  cloud c = make_cloud_by(3, 100, 3);
  batten_spline_data d = data_of(&c, false);
  double at[3] = {0.3, 0.4, 0.5};
  batten_spline *s = fit_by(ctx, &d, 2, 0, NULL);
  double base = value_at(ctx, s, at);
  batten_spline_free(s);
  for (int k = -300; k <= 300; k += 600) {
    for (size_t i = 0; i < c.count; i++) c.values[i] = ldexp(smooth(3, c.points + 3 * i, NULL), k);
    s = fit_by(ctx, &d, 2, 0, NULL);
    T_CHECK(value_at(ctx, s, at) == ldexp(base, k), "values times 2^%d: the same bits", k);
    batten_spline_free(s);
  }
  for (size_t i = 0; i < c.count; i++) c.values[i] = smooth(3, c.points + 3 * i, NULL) + 1e8;
  batten_spline_info info;
  s = fit_by(ctx, &d, 2, 0, &info);
  T_RATIO(fabs(value_at(ctx, s, at) - 1e8 - base), 1e-6, "values about 1e8");
  batten_spline_free(s);
  free_cloud(&c);
}

static void test_bad_input(batten_context *ctx) {
  cloud c = make_cloud_by(3, 50, 5);
  batten_spline_data good = data_of(&c, false), d = good;
  batten_spline_options defaults = batten_spline_options_default(), o = defaults;
  batten_spline *s = NULL;
  T_CHECK(batten_spline_fit(NULL, &d, NULL, &s, NULL) == BATTEN_E_INVALID, "no context is refused");
  T_STATUS(batten_spline_fit(ctx, NULL, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "data: NULL");
  T_STATUS(batten_spline_fit(ctx, &d, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  d.struct_size = 3;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "batten_spline_data.struct_size: 3");
  o.struct_size = 0;
  T_STATUS(batten_spline_fit(ctx, &good, &o, &s, NULL), BATTEN_E_INVALID, ctx,
           "batten_spline_options.struct_size: 0");
  o = defaults, o.saddle.struct_size = 1;
  T_STATUS(batten_spline_fit(ctx, &good, &o, &s, NULL), BATTEN_E_INVALID, ctx, "batten_saddle_options.struct_size");
  d = good, d.n = 0;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "data.n: 0");
  d = good, d.n = 4;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "data.n: 4");
  o = defaults, o.m = 1;
  T_STATUS(batten_spline_fit(ctx, &good, &o, &s, NULL), BATTEN_E_INVALID, ctx,
           "opt.m: 1; with n = 3 it must be 2 .. 4");
  o = defaults, o.m = 5;
  T_STATUS(batten_spline_fit(ctx, &good, &o, &s, NULL), BATTEN_E_INVALID, ctx, "opt.m: 5");
  o = defaults, o.smoothing = -1;
  T_STATUS(batten_spline_fit(ctx, &good, &o, &s, NULL), BATTEN_E_INVALID, ctx, "opt.smoothing: -1");
  double each[50] = {0};
  each[9] = NAN;
  o = defaults, o.smoothing_per_point = each;
  T_STATUS(batten_spline_fit(ctx, &good, &o, &s, NULL), BATTEN_E_INVALID, ctx, "opt.smoothing_per_point[9]: nan");
  d = good, d.values = NULL;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "data.values: NULL");
  d = good, d.count = 0;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "data.count: 0 points");
  d = good, d.count = 3;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx,
           "3 points and 0 gradients give 3 conditions");
  d = good, d.count = SIZE_MAX / 8;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_TOO_LARGE, ctx, "data.count");
  d = good, d.gradient_count = 5;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "take m = 3");
  o = defaults, o.m = 3;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_INVALID, ctx, "data.gradients: NULL");
  d.gradients = c.gradients, d.gradient_count = 51;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_INVALID, ctx, "data.gradient_count: 51");
  size_t at[3] = {4, 50, 7};
  d.gradient_count = 3, d.gradient_at = at;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_INVALID, ctx, "gradient_at[1]: 50");
  at[1] = 4;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_INVALID, ctx, "gradient_at[1]: 4");
  at[1] = 5;
  c.gradients[7] = INFINITY;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_INVALID, ctx, "gradients[2][1]: inf");
  c.points[3 * 17 + 2] = NAN;
  T_STATUS(batten_spline_fit(ctx, &good, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "points[17][2]: nan");
  c.points[3 * 17 + 2] = 0.5;
  c.values[3] = -INFINITY;
  T_STATUS(batten_spline_fit(ctx, &good, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "values[3]: -inf");
  c.values[3] = 1e200;
  T_STATUS(batten_spline_fit(ctx, &good, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "values: range 1e+200");
  c.values[3] = 0;
  c.points[0] = 1e200;
  T_STATUS(batten_spline_fit(ctx, &good, NULL, &s, NULL), BATTEN_E_INVALID, ctx,
           "longest side of their box is 1e+200");
  c.points[0] = 0.25;
  memcpy(c.points + 3 * 40, c.points + 3 * 11, 3 * sizeof(double));
  memcpy(c.points + 3 * 30, c.points + 3 * 12, 3 * sizeof(double));
  memcpy(c.points + 3 * 31, c.points + 3 * 12, 3 * sizeof(double));
  T_STATUS(batten_spline_fit(ctx, &good, NULL, &s, NULL), BATTEN_E_INVALID, ctx, "points[30]: equals points[12]");
  T_CHECK(!s, "nothing was made");
  free_cloud(&c);
}

/* Points on oblique lines and planes, near the origin and far from it; and just off them. */
static void test_flat(batten_context *ctx) {
  uint64_t seed = 6;
  double x[30 * 3], f[30];
  batten_spline *s = NULL;
  batten_spline_data d = batten_spline_data_default();
  d.count = 30, d.points = x, d.values = f;
  for (int far = 0; far < 2; far++) {
    const double shift = far ? 7e6 : 0;
    for (int i = 0; i < 30; i++) {
      double u = 100 * t_uniform(&seed), v = 100 * t_uniform(&seed);
      f[i] = t_uniform(&seed);
      x[3 * i] = 2 * u - v + shift, x[3 * i + 1] = 2 * u + 2 * v + shift, x[3 * i + 2] = -u + 2 * v + shift;
    }
    T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_SINGULAR, ctx, "in a plane with normal (");
    x[0] += 1e-3;
    T_OK(batten_spline_fit(ctx, &d, NULL, &s, NULL), ctx);
    batten_spline_free(s);
    for (int i = 0; i < 30; i++) {
      double u = 100 * t_uniform(&seed);
      x[3 * i] = u + shift, x[3 * i + 1] = u / 3 + shift, x[3 * i + 2] = -u / 7 + shift;
    }
    T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_SINGULAR, ctx,
             "on a line with direction (0.940089, 0.313363, -0.134298)");
    d.n = 2, d.count = 30;
    for (int i = 0; i < 30; i++) {
      double u = 100 * t_uniform(&seed);
      x[2 * i] = 0.6 * u + shift, x[2 * i + 1] = 0.8 * u + shift;
    }
    T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_SINGULAR, ctx,
             "on a line with direction (0.6, 0.8)");
    d.n = 3;
  }
  /* On a sphere, which is a zero set of the quadratics that m = 3 has. */
  for (int i = 0; i < 30; i++) {
    double z = 2 * t_uniform(&seed) - 1, t = 6.28 * t_uniform(&seed), r = sqrt(1 - z * z);
    x[3 * i] = r * cos(t), x[3 * i + 1] = r * sin(t), x[3 * i + 2] = z;
  }
  batten_spline_options o = batten_spline_options_default();
  o.m = 3;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_SINGULAR, ctx,
           "zero set of one polynomial of degree 2");
  o.m = 2;
  T_OK(batten_spline_fit(ctx, &d, &o, &s, NULL), ctx);
  batten_spline_free(s);
  /* Four points in a plane are as many as the monomials. Gradients do not make up for being flat: m is 3 then, and
   * the square of the plane's equation has neither value nor gradient on it. */
  double square[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 3, 0}, up[15], zero[5] = {0};
  for (int i = 0; i < 15; i++) up[i] = i % 3 == 2;
  d.count = 4, d.points = square, d.values = zero;
  s = NULL;
  T_STATUS(batten_spline_fit(ctx, &d, NULL, &s, NULL), BATTEN_E_SINGULAR, ctx, "in a plane with normal (0, 0, 1)");
  d.count = d.gradient_count = 5, d.gradients = up, o.m = 3;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_SINGULAR, ctx, "in a plane with normal (0, 0, 1)");
  T_CHECK(!s, "nothing was made");
  /* As many conditions as monomials, on a circle. */
  double circle[12];
  for (int i = 0; i < 6; i++) circle[2 * i] = cos(i), circle[2 * i + 1] = sin(i);
  d = batten_spline_data_default();
  d.n = 2, d.count = 6, d.points = circle, d.values = f;
  T_STATUS(batten_spline_fit(ctx, &d, &o, &s, NULL), BATTEN_E_SINGULAR, ctx, "polynomial of degree 2");
}

static void test_bytes(void) {
  for (int hermite = 0; hermite < 2; hermite++) {
    batten_context *ctx = t_context(NULL, NULL, 2);
    cloud c = make_cloud_by(3, hermite ? 200 : 800, 4);
    batten_spline_data d = data_of(&c, hermite);
    batten_spline_info info;
    batten_spline *s = fit_by(ctx, &d, hermite ? 3 : 2, 0, &info);
    double ratio = (double)batten_bytes_peak(ctx) /
                   (double)batten_spline_bytes(info.saddle.method, 3, hermite ? 3 : 2, c.count, d.gradient_count);
    T_CHECK(ratio <= 1 && ratio > 0.5, "predicted bytes (%s): peak is %.3f of them",
            batten_saddle_method_name(info.saddle.method), ratio);
    batten_spline_free(s);
    T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing stays");
    free_cloud(&c);
    batten_context_free(ctx);
  }
  T_CHECK(batten_spline_bytes(BATTEN_SADDLE_LDL, 3, 1, 10, 0) == SIZE_MAX, "orders that do not exist have no size");
  T_CHECK(batten_spline_bytes(BATTEN_SADDLE_LDL, 3, 2, SIZE_MAX / 4, 0) == SIZE_MAX, "overflow");
  T_CHECK(batten_spline_bytes(BATTEN_SADDLE_LDL, 3, 3, 10, SIZE_MAX / 2) == SIZE_MAX, "overflow by gradients");
}

static batten_status fit_once(batten_context *ctx, void *arg) {
  batten_spline_options o = batten_spline_options_default();
  o.m = 3;
  batten_spline *s = NULL;
  batten_status st = batten_spline_fit(ctx, arg, &o, &s, NULL);
  batten_spline_free(s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_linear(ctx);
  test_cubic(ctx);
  test_residuals(ctx);
  test_polynomials(ctx);
  test_hermite(ctx);
  test_loo(ctx);
  test_invariance(ctx);
  test_smoothing(ctx);
  test_edges(ctx);
  test_units_of_value(ctx);
  test_bad_input(ctx);
  test_flat(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing stays in the context");
  batten_context_free(ctx);
  test_bytes();
  cloud c = make_cloud_by(3, 30, 5);
  batten_spline_data d = data_of(&c, true);
  d.gradient_count = 6;
  t_fail_every_allocation("batten_spline_fit", fit_once, &d);
  t_cancel_every_progress("batten_spline_fit", fit_once, &d);
  free_cloud(&c);
  return t_done();
}
