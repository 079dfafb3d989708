/* Evaluation of volume splines at 10,000 nodes ("calculation of surface nodes", Savchenko et al. 1995, Table 2): a
 * plain scalar loop, as one writes it first, against batten_spline_evaluate on one and two threads.
 *
 * Prints a table in Markdown. Times are the best of some runs; the error is the largest difference from a sum in
 * long double, relative to the sum of the terms' sizes, for the plain loop and for batten. */
#include "spline/inner.h"

#include <batten/spline.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

enum { NODES = 10000, CENTRES_MAX = 4000, CHECKED = 100, RUNS = 5 };

static double centers[CENTRES_MAX * 3], coefficients[CENTRES_MAX], nodes[NODES * 3];
static double plain_values[NODES], plain_gradients[NODES * 3], values[NODES], gradients[NODES * 3];

static double uniform(uint64_t *state) {
  *state = *state * 6364136223846793005u + 1442695040888963407u;
  return (double)(*state >> 11) * 0x1p-53 - 0.5;
}

/* phi and phi'/r of the kernel with power p = 1, 2 (with logarithm), 3, without sign. */
static double phi(unsigned power, double r2) {
  if (power == 1) return sqrt(r2);
  if (power == 3) return r2 * sqrt(r2);
  return r2 > 0 ? 0.5 * r2 * log(r2) : 0;
}
static double phi_slope(unsigned power, double r2) {
  if (r2 == 0) return 0;
  if (power == 1) return 1 / sqrt(r2);
  if (power == 3) return 3 * sqrt(r2);
  return log(r2) + 1;
}

/* The plain loop: U, and its gradient if asked for, in the unit box that the centres span. */
static void plain(const batten_spline_parts *p, int with_gradient) {
  const unsigned n = p->n, power = 2 * p->m - n;
  const double s = power == 1 ? -1 : 1;
  for (size_t i = 0; i < NODES; i++) {
    const double *x = nodes + i * n;
    double v = p->polynomial[0], g[3] = {0, 0, 0};
    for (unsigned a = 0; a < n; a++) {
      v += p->polynomial[1 + a] * x[a];
      g[a] = p->polynomial[1 + a];
    }
    for (size_t j = 0; j < p->count; j++) {
      const double *y = p->centers + j * n;
      double dx = x[0] - y[0], dy = x[1] - y[1], dz = n > 2 ? x[2] - y[2] : 0, r2 = dx * dx + dy * dy + dz * dz;
      v += s * p->coefficients[j] * phi(power, r2);
      if (!with_gradient) continue;
      double slope = s * p->coefficients[j] * phi_slope(power, r2);
      g[0] += slope * dx;
      g[1] += slope * dy;
      g[2] += slope * dz;
    }
    plain_values[i] = v;
    for (unsigned a = 0; a < n && with_gradient; a++) plain_gradients[i * n + a] = g[a];
  }
}

/* Largest error of v at the first nodes, relative to the sum of the terms' sizes. */
static double error_of(const batten_spline_parts *p, const double *v) {
  const unsigned n = p->n, power = 2 * p->m - n;
  double worst = 0;
  for (size_t i = 0; i < CHECKED; i++) {
    long double sum = p->polynomial[0], size = 0;
    for (unsigned a = 0; a < n; a++) sum += (long double)p->polynomial[1 + a] * nodes[i * n + a];
    for (size_t j = 0; j < p->count; j++) {
      long double r2 = 0;
      for (unsigned a = 0; a < n; a++) {
        long double d = (long double)nodes[i * n + a] - p->centers[j * n + a];
        r2 += d * d;
      }
      long double f = power == 1 ? -sqrtl(r2) : power == 3 ? r2 * sqrtl(r2) : 0.5L * r2 * logl(r2);
      sum += p->coefficients[j] * f;
      size += fabsl(p->coefficients[j] * f);
    }
    worst = fmax(worst, (double)(fabsl(v[i] - sum) / size));
  }
  return worst;
}

static double time_plain(const batten_spline_parts *p, int with_gradient) {
  double best = INFINITY;
  for (int run = 0; run < RUNS - 2; run++) {
    double start = batten_now();
    plain(p, with_gradient);
    best = fmin(best, batten_now() - start);
  }
  return best;
}

static double time_batten(const batten_spline_parts *p, int with_gradient, unsigned threads) {
  batten_context_options o = batten_context_options_default();
  o.threads = threads;
  batten_context *ctx = NULL;
  batten_spline *s = NULL;
  double best = INFINITY;
  if (batten_context_new(&o, &ctx) < 0) return NAN;
  if (batten_spline_create(ctx, p, &s) == BATTEN_OK)
    for (int run = 0; run < RUNS; run++) {
      double start = batten_now();
      batten_spline_evaluate(ctx, s, NODES, nodes, values, with_gradient ? gradients : NULL, NULL);
      best = fmin(best, batten_now() - start);
    }
  batten_spline_free(s);
  batten_context_free(ctx);
  return best;
}

static void row(const char *name, unsigned n, unsigned m, size_t count, int with_gradient) {
  const double polynomial[4] = {0.3, 1, -1, 0.5};
  uint64_t seed = 17;
  for (size_t i = 0; i < count * n; i++) centers[i] = uniform(&seed);
  for (size_t i = 0; i < count; i++) coefficients[i] = uniform(&seed);
  for (size_t i = 0; i < NODES * n; i++) nodes[i] = uniform(&seed);
  double all[BATTEN_POLYNOMIAL_MAX] = {0};
  for (unsigned a = 0; a <= n; a++) all[a] = polynomial[a];
  batten_spline_parts p = {.struct_size = sizeof p,
                           .n = n,
                           .m = m,
                           .count = count,
                           .centers = centers,
                           .coefficients = coefficients,
                           .polynomial_count = batten_polynomial_count(n, m - 1),
                           .polynomial = all,
                           .scale = 1};
  double scalar = time_plain(&p, with_gradient), one = time_batten(&p, with_gradient, 1),
         two = time_batten(&p, with_gradient, 2);
  printf("| %s | %zu | %s | %.2f | %.2f | %.2f | %.1f | %.1f | %.2f | %.1e | %.1e |\n", name, count,
         with_gradient ? "value, gradient" : "value", 1e3 * scalar, 1e3 * one, 1e3 * two, scalar / one, scalar / two,
         1e-9 * NODES * (double)count / two, error_of(&p, plain_values), error_of(&p, values));
  fflush(stdout);
}

int main(void) {
  static const struct {
    const char *name;
    unsigned n, m;
  } kernels[] = {{"r, 3-D", 3, 2}, {"r^3, 3-D", 3, 3}, {"r^2 ln r, 2-D", 2, 2}};
  static const size_t counts[] = {184, 377, 628, 942, 4000};
#if defined(__VERSION__)
  printf("Compiler %s, inner loops for %s, batten %s.\n", __VERSION__, batten_spline_code()->name, batten_version());
#else
  printf("Inner loops for %s, batten %s.\n", batten_spline_code()->name, batten_version());
#endif
  printf(
      "%d nodes; times in ms; speed-up over the plain scalar loop on 1 and 2 threads; 1e9 pairs (node, centre) a "
      "second on 2 threads.\n\n",
      (int)NODES);
  printf("| kernel | N | what | plain | 1 thread | 2 threads | x (1) | x (2) | Gpairs/s | error plain | error |\n");
  printf("|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t k = 0; k < sizeof kernels / sizeof kernels[0]; k++)
    for (int with_gradient = 0; with_gradient < 2; with_gradient++)
      for (size_t c = 0; c < sizeof counts / sizeof counts[0]; c++)
        row(kernels[k].name, kernels[k].n, kernels[k].m, counts[c], with_gradient);
  return 0;
}
