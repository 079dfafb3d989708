/* Surfaces for tests: random ones on uneven knots, and graphs whose points and curvatures are known. */
#ifndef SURFACE_SHAPES_H
#define SURFACE_SHAPES_H

#include <batten/surface.h>

#include "tap.h"

enum { SURFACE_KNOTS = 64, SURFACE_POINTS = 1024 };

/* What a surface is made of, with room to change it before it is made. */
typedef struct surface_case {
  unsigned degree[2];
  size_t knot_count[2], points[2]; /* points: control points of a direction */
  double knots[2][SURFACE_KNOTS];
  double control[SURFACE_POINTS][3];
} surface_case;

static inline batten_surface_form surface_case_form(const surface_case *c) {
  return (batten_surface_form){.degree = {c->degree[0], c->degree[1]},
                               .knot_count = {c->knot_count[0], c->knot_count[1]},
                               .knots = {c->knots[0], c->knots[1]},
                               .control_points = c->control[0]};
}

static inline batten_surface *surface_case_make(batten_context *ctx, const surface_case *c) {
  batten_surface_form form = surface_case_form(c);
  batten_surface *s = NULL;
  if (batten_surface_create(ctx, &form, &s) < 0) {
    printf("# surface: %s\n", batten_error(ctx));
    exit(1);
  }
  return s;
}

/* spans - 1 inner knots, evenly from lower to upper, each `fold` times. */
static inline void surface_case_axis(surface_case *c, int k, unsigned degree, unsigned spans, unsigned fold,
                                     double lower, double upper) {
  size_t at = 0;
  for (unsigned s = 0; s <= spans; s++)
    for (unsigned f = 0; f < (s == 0 || s == spans ? degree + 1 : fold); f++)
      c->knots[k][at++] = s == spans ? upper : lower + (upper - lower) * s / spans;
  c->degree[k] = degree;
  c->knot_count[k] = at;
  c->points[k] = at - degree - 1;
}

/* Moves every inner knot by up to a third of a span, equal ones together. */
static inline void surface_case_shake(surface_case *c, int k, uint64_t *seed) {
  double *t = c->knots[k], size = t[c->knot_count[k] - 1] - t[0], step = size, old = t[0], by = 0;
  for (size_t i = 1; i < c->knot_count[k]; i++)
    if (t[i] > t[i - 1]) step = fmin(step, t[i] - t[i - 1]);
  for (size_t i = c->degree[k] + 1; i < c->points[k]; i++) {
    if (t[i] > old) by = 0.33 * step * (2 * t_uniform(seed) - 1);
    old = t[i];
    t[i] += by;
  }
}

/* The control points of u, v (as x and y), and of all polynomials of degree 2 in each: by symmetric multi-affine
 * forms of 1, t, t^2 at the knots. */
static inline void surface_case_powers(const surface_case *c, int k, size_t i, double out[3]) {
  double sum = 0, pairs = 0;
  unsigned d = c->degree[k];
  for (unsigned a = 1; a <= d; a++) {
    for (unsigned b = 1; b < a; b++) pairs += c->knots[k][i + a] * c->knots[k][i + b];
    sum += c->knots[k][i + a];
  }
  out[0] = 1;
  out[1] = sum / d;
  out[2] = d > 1 ? pairs / (0.5 * d * (d - 1)) : 0;
}

/* (u, v, sum_ab f[a][b] u^a v^b); degrees >= 2 where squares are used. */
static inline void surface_case_graph(surface_case *c, const double f[3][3]) {
  for (size_t i = 0; i < c->points[0]; i++)
    for (size_t j = 0; j < c->points[1]; j++) {
      double u[3], v[3], *p = c->control[i * c->points[1] + j];
      surface_case_powers(c, 0, i, u);
      surface_case_powers(c, 1, j, v);
      p[0] = u[1];
      p[1] = v[1];
      p[2] = 0;
      for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) p[2] += f[a][b] * u[a] * v[b];
    }
}

/* z = (x^2 + y^2) / 2 on [-1, 1]^2: K = 1 / (1 + r^2)^2. */
static const double surface_bowl[3][3] = {{0, 0, 0.5}, {0, 0, 0}, {0.5, 0, 0}};

static inline surface_case surface_case_bowl(unsigned degree, unsigned spans) {
  surface_case c = {.degree = {0}};
  for (int k = 0; k < 2; k++) surface_case_axis(&c, k, degree, spans, 1, -1, 1);
  surface_case_graph(&c, surface_bowl);
  return c;
}

/* Uneven knots, and points around a bent sheet. */
static inline surface_case surface_case_random(unsigned p, unsigned q, unsigned spans_u, unsigned spans_v,
                                               unsigned fold, uint64_t seed) {
  surface_case c = {.degree = {0}};
  surface_case_axis(&c, 0, p, spans_u, fold < p ? fold : p, -2, 1);
  surface_case_axis(&c, 1, q, spans_v, fold < q ? fold : q, 3, 4.5);
  surface_case_shake(&c, 0, &seed);
  surface_case_shake(&c, 1, &seed);
  for (size_t i = 0; i < c.points[0]; i++)
    for (size_t j = 0; j < c.points[1]; j++) {
      double x = (double)i / (double)(c.points[0] - 1), y = (double)j / (double)(c.points[1] - 1);
      double *b = c.control[i * c.points[1] + j];
      b[0] = 2 * x + 0.15 * t_uniform(&seed);
      b[1] = y + 0.15 * t_uniform(&seed);
      b[2] = x * x - 0.7 * y * y + 0.3 * t_uniform(&seed);
    }
  return c;
}

/* ---- changes -------------------------------------------------------------------------------------- */

/* The same with u (k = 0) or v the other way round. */
static inline void surface_case_reverse(surface_case *c, int k) {
  surface_case old = *c;
  size_t n = c->knot_count[k];
  for (size_t i = 0; i < n; i++) c->knots[k][i] = -old.knots[k][n - 1 - i];
  for (size_t i = 0; i < c->points[0]; i++)
    for (size_t j = 0; j < c->points[1]; j++) {
      size_t a = k == 0 ? c->points[0] - 1 - i : i, b = k == 1 ? c->points[1] - 1 - j : j;
      memcpy(c->control[i * c->points[1] + j], old.control[a * c->points[1] + b], sizeof *c->control);
    }
}

/* u and v exchanged. */
static inline void surface_case_swap(surface_case *c) {
  surface_case old = *c;
  for (int k = 0; k < 2; k++) {
    c->degree[k] = old.degree[1 - k];
    c->knot_count[k] = old.knot_count[1 - k];
    c->points[k] = old.points[1 - k];
    memcpy(c->knots[k], old.knots[1 - k], sizeof *c->knots);
  }
  for (size_t i = 0; i < c->points[0]; i++)
    for (size_t j = 0; j < c->points[1]; j++)
      memcpy(c->control[i * c->points[1] + j], old.control[j * old.points[1] + i], sizeof *c->control);
}

/* One more knot at t in direction k: the same surface [Boehm 1980]. */
static inline void surface_case_insert(surface_case *c, int k, double t) {
  surface_case old = *c;
  unsigned d = c->degree[k];
  size_t mu = d, n = old.points[k], other = old.points[1 - k];
  while (mu + 1 < n && old.knots[k][mu + 1] <= t) mu++;
  for (size_t i = mu + 1; i < old.knot_count[k]; i++) c->knots[k][i + 1] = old.knots[k][i];
  c->knots[k][mu + 1] = t;
  c->knot_count[k]++;
  c->points[k]++;
  for (size_t i = 0; i <= n; i++)
    for (size_t j = 0; j < other; j++)
      for (int x = 0; x < 3; x++) {
        double part = i + d <= mu ? 1 : i > mu ? 0 : (t - old.knots[k][i]) / (old.knots[k][i + d] - old.knots[k][i]);
#define SURFACE_OLD(i) (k == 0 ? old.control[(i)*other + j][x] : old.control[j * n + (i)][x])
        double before = i > 0 ? SURFACE_OLD(i - 1) : 0, own = i < n ? SURFACE_OLD(i) : 0;
#undef SURFACE_OLD
        c->control[k == 0 ? i * other + j : j * (n + 1) + i][x] = part * own + (1 - part) * before;
      }
}

/* A turn of 0.7 about (1, 2, 2) / 3, then times `scale`, then moved. */
static inline void surface_turn(const double *x, double scale, const double move[3], double *out) {
  const double axis[3] = {1 / 3.0, 2 / 3.0, 2 / 3.0}, c = cos(0.7), s = sin(0.7);
  double along = axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2], turned[3];
  for (int d = 0; d < 3; d++) {
    int e = (d + 1) % 3, f = (d + 2) % 3;
    turned[d] = c * x[d] + (1 - c) * along * axis[d] + s * (axis[e] * x[f] - axis[f] * x[e]);
  }
  for (int d = 0; d < 3; d++) out[d] = scale * turned[d] + (move ? move[d] : 0);
}

/* A place of the domain. */
static inline void surface_case_place(const surface_case *c, uint64_t *seed, double place[2]) {
  for (int k = 0; k < 2; k++) {
    double part = t_uniform(seed), a = c->knots[k][0], b = c->knots[k][c->knot_count[k] - 1];
    place[k] = fmin(fmax((1 - part) * a + part * b, a), b);
  }
}

static inline double surface_worse(double a, double b) { return isnan(a) || isnan(b) ? NAN : a > b ? a : b; }

#endif
