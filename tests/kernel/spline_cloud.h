/* Clouds of points with a smooth function on them, and fits of them, for the tests of splines of many points. */
#ifndef SPLINE_CLOUD_H
#define SPLINE_CLOUD_H

#include "tap.h"

#include <batten/spline.h>

typedef struct cloud {
  unsigned n;
  size_t count;
  double *points, *values, *gradients;
} cloud;

/* A function that no polynomial of low degree equals, and its gradient (NULL: not wanted). */
static inline double smooth(unsigned n, const double *x, double *g) {
  const double k[3] = {3, 2, -4};
  double t = 0.3;
  for (unsigned a = 0; a < n; a++) t += k[a] * x[a];
  for (unsigned a = 0; a < n && g; a++) g[a] = k[a] * cos(t) + (a == 0 ? 0.4 * x[0] : 0);
  return sin(t) + 0.2 * x[0] * x[0];
}

/* Points of the unit box that keep some distance (jittered additive sequence); their coordinates are multiples of
 * 2^-24, so that with 7e6 added they are still exact. */
static inline cloud make_cloud_by(unsigned n, size_t count, uint64_t seed) {
  static const double step[4][3] = {{0},
                                    {0.6180339887498949},
                                    {0.7548776662466927, 0.5698402909980532},
                                    {0.8191725133961645, 0.6710436067037893, 0.5497004779019703}};
  cloud c = {.n = n, .count = count};
  c.points = malloc(count * n * sizeof(double));
  c.values = malloc(count * sizeof(double));
  c.gradients = malloc(count * n * sizeof(double));
  for (size_t i = 0; i < count * n; i++) {
    double whole, jitter = 0.2 * pow((double)count, -1.0 / n) * t_uniform(&seed);
    c.points[i] = ldexp(floor(ldexp(modf(0.5 + (double)(i / n) * step[n][i % n] + jitter, &whole), 24)), -24);
  }
  for (size_t i = 0; i < count; i++) c.values[i] = smooth(n, c.points + i * n, c.gradients + i * n);
  return c;
}

static inline cloud make_cloud(unsigned n, size_t count) { return make_cloud_by(n, count, 100 * n + count); }

static inline void free_cloud(cloud *c) {
  free(c->points);
  free(c->values);
  free(c->gradients);
}

static inline batten_spline_data data_of(const cloud *c, bool hermite) {
  batten_spline_data d = batten_spline_data_default();
  d.n = c->n;
  d.count = c->count;
  d.points = c->points;
  d.values = c->values;
  if (hermite) {
    d.gradient_count = c->count;
    d.gradients = c->gradients;
  }
  return d;
}

static inline batten_spline_options options_of(unsigned m, batten_saddle_method method, double accuracy) {
  batten_spline_options o = batten_spline_options_default();
  o.m = m;
  o.saddle.method = method;
  o.saddle.accuracy = accuracy;
  return o;
}

/* NULL, and a failed line, when there is none. */
static inline batten_spline *fit(batten_context *ctx, const batten_spline_data *d, const batten_spline_options *o,
                                 batten_spline_info *info) {
  batten_spline *s = NULL;
  batten_status st = batten_spline_fit(ctx, d, o, &s, info);
  if (st != BATTEN_OK) T_CHECK(false, "fit n = %u, m = %u, N = %zu: %s", d->n, o->m, d->count, batten_error(ctx));
  return s;
}

static inline bool same_bits(const batten_spline *a, const batten_spline *b) {
  batten_spline_parts p = {.struct_size = sizeof p}, q = p;
  if (!a || !b) return false;
  batten_spline_get_parts(a, &p);
  batten_spline_get_parts(b, &q);
  return memcmp(p.coefficients, q.coefficients, p.count * sizeof(double)) == 0 &&
         memcmp(p.polynomial, q.polynomial, p.polynomial_count * sizeof(double)) == 0;
}

#endif
