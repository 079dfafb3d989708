/* Analytic fields for the polygoniser's tests: f >= 0 inside, value and gradient in closed form. */
#ifndef FIELD_SHAPES_H
#define FIELD_SHAPES_H

#include <batten/field.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

/* f and its gradient g at x, in the shape's own frame. */
typedef double (*shape_function)(const double *x, double *g);

typedef struct shape {
  shape_function function;
  double rotation[3][3]; /* rows: the shape's axes in the world */
  double scale;          /* world length of the shape's unit */
  double origin[3];
  size_t calls, fail_at; /* fail_at: the call that fails, 0 = none */
  size_t nan_at;         /* evaluated point that gives NaN, counted from 1, 0 = none */
  size_t points;
} shape;

static inline shape shape_make(shape_function function) {
  return (shape){.function = function, .rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .scale = 1};
}

/* An arbitrary turn. */
static inline void shape_turn(shape *s, double a, double b) {
  double ca = cos(a), sa = sin(a), cb = cos(b), sb = sin(b);
  double r[3][3] = {{ca, sa, 0}, {-sa * cb, ca * cb, sb}, {sa * sb, -ca * sb, cb}};
  memcpy(s->rotation, r, sizeof r);
}

static inline void shape_to_world(const shape *s, const double *u, double *x) {
  for (int k = 0; k < 3; k++)
    x[k] = s->origin[k] + s->scale * (s->rotation[0][k] * u[0] + s->rotation[1][k] * u[1] + s->rotation[2][k] * u[2]);
}

static inline batten_status shape_evaluate(const void *user, batten_context *ctx, size_t count, const double *points,
                                           double *values, double *gradients, double *hessians) {
  shape *s = (shape *)(uintptr_t)user;
  (void)hessians;
  if (++s->calls == s->fail_at) return batten_fail(ctx, BATTEN_E_SINGULAR, "the field fails at call %zu", s->calls);
  for (size_t i = 0; i < count; i++) {
    double u[3] = {0, 0, 0}, g[3];
    for (int r = 0; r < 3; r++)
      for (int k = 0; k < 3; k++) u[r] += s->rotation[r][k] * (points[3 * i + (size_t)k] - s->origin[k]) / s->scale;
    values[i] = s->scale * s->function(u, g);
    if (++s->points == s->nan_at) values[i] = NAN;
    if (!gradients) continue;
    for (size_t k = 0; k < 3; k++)
      gradients[3 * i + k] = s->rotation[0][k] * g[0] + s->rotation[1][k] * g[1] + s->rotation[2][k] * g[2];
  }
  return BATTEN_OK;
}

static inline batten_field shape_field(shape *s) {
  return (batten_field){.dimension = 3, .order = 1, .evaluate = shape_evaluate, .user = s};
}

/* ---- shapes ------------------------------------------------------------------------------------- */

static inline double shape_ball(const double *x, double *g) {
  for (int k = 0; k < 3; k++) g[k] = -2 * x[k];
  return 1 - x[0] * x[0] - x[1] * x[1] - x[2] * x[2];
}

/* Tube of radius 0.35 around the circle of radius 1 in the plane z = 0; distance. */
static inline double torus_at(const double *x, double *g) {
  double rho = sqrt(x[0] * x[0] + x[1] * x[1]), q = rho - 1, d = sqrt(q * q + x[2] * x[2]);
  double safe = d > 0 ? d : 1, around = rho > 0 ? rho : 1;
  g[0] = -q / safe * x[0] / around;
  g[1] = -q / safe * x[1] / around;
  g[2] = -x[2] / safe;
  return 0.35 - d;
}
static inline double shape_torus(const double *x, double *g) { return torus_at(x, g); }

static inline double shape_larger(double a, const double *ga, double b, const double *gb, double *g) {
  memcpy(g, a >= b ? ga : gb, 3 * sizeof *g);
  return a >= b ? a : b;
}

/* Two tori through each other's holes. */
static inline double shape_links(const double *x, double *g) {
  double y[3] = {x[0] - 1, x[2], -x[1]}, ga[3], gb[3];
  double a = torus_at(x, ga), b = torus_at(y, gb);
  double turned[3] = {gb[0], -gb[2], gb[1]};
  return shape_larger(a, ga, b, turned, g);
}

/* Box of half sides h rounded by r: exact distance outside. */
static inline double rounded_box(const double *x, const double *h, double r, double *g) {
  double q[3], out = 0, in = -INFINITY;
  int axis = 0;
  for (int k = 0; k < 3; k++) {
    q[k] = fabs(x[k]) - (h[k] - r);
    if (q[k] > 0) out += q[k] * q[k];
    if (q[k] > in) {
      in = q[k];
      axis = k;
    }
  }
  out = sqrt(out);
  for (int k = 0; k < 3; k++) g[k] = out > 0 ? (q[k] > 0 ? -copysign(q[k] / out, x[k]) : 0) : 0;
  if (!(out > 0)) g[axis] = -copysign(1, x[axis]);
  return r - (out > 0 ? out : in);
}
static inline double shape_cube(const double *x, double *g) {
  static const double half[3] = {0.5, 0.5, 0.5};
  return rounded_box(x, half, 0, g);
}
static inline double shape_plate(const double *x, double *g) {
  static const double half[3] = {1, 1, 0.04};
  return rounded_box(x, half, 0.03, g);
}

/* Genus 2: a smooth figure eight, thickened. y^2 = x^2 (1 - x^2) - eps, f = a^2 - (..)^2 - z^2. */
static inline double shape_eight(const double *x, double *g) {
  double p = x[1] * x[1] - x[0] * x[0] * (1 - x[0] * x[0]);
  g[0] = -2 * p * (-2 * x[0] + 4 * x[0] * x[0] * x[0]);
  g[1] = -2 * p * 2 * x[1];
  g[2] = -2 * x[2];
  return 0.01 - p * p - x[2] * x[2];
}

/* A sheet that reaches every box: z <= 0.1 sin(3 x) cos(2 y). */
static inline double shape_sheet(const double *x, double *g) {
  g[0] = 0.3 * cos(3 * x[0]) * cos(2 * x[1]);
  g[1] = -0.2 * sin(3 * x[0]) * sin(2 * x[1]);
  g[2] = -1;
  return 0.1 * sin(3 * x[0]) * cos(2 * x[1]) - x[2];
}

/* Gyroid: a surface of high genus, cut by its box. */
static inline double shape_gyroid(const double *x, double *g) {
  double s[3], c[3];
  for (int k = 0; k < 3; k++) {
    s[k] = sin(4 * x[k]);
    c[k] = cos(4 * x[k]);
  }
  for (int k = 0; k < 3; k++) {
    int n = (k + 1) % 3, p = (k + 2) % 3;
    g[k] = 4 * (c[k] * c[n] - s[p] * s[k]);
  }
  return s[0] * c[1] + s[1] * c[2] + s[2] * c[0];
}

static inline double shape_outside(const double *x, double *g) {
  for (int k = 0; k < 3; k++) g[k] = -2 * x[k];
  return -1 - x[0] * x[0] - x[1] * x[1] - x[2] * x[2];
}

#endif
