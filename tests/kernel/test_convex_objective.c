/* Sums of squares and tension of tensor-product surfaces: kernel/convex/objective.c. */
#include "convex/convex_inner.h"
#include "convex_scenes.h"
#include "tap.h"

#include <float.h>

enum { KNOTS = 40, COUNT = 200 };

typedef struct rig {
  double knots[2][KNOTS];
  convex_space space;
} rig;

static void make_rig(rig *r, unsigned du, unsigned dv, size_t su, size_t sv) {
  const unsigned degree[2] = {du, dv};
  const size_t spans[2] = {su, sv};
  for (int k = 0; k < 2; k++) {
    size_t n = bspline_make_knots(degree[k], degree[k] - 1, spans[k], NULL, 0, 1, r->knots[k]);
    r->space.axis[k] = (bspline){degree[k], n - degree[k] - 1, r->knots[k]};
  }
}

static double derivative(const bspline *b, size_t i, double t, unsigned k) {
  double table[4 * BSPLINE_ORDER];
  size_t mu = bspline_span(b, t);
  if (i + b->degree < mu || i > mu || k > b->degree) return 0;
  bspline_basis(b, mu, t, k, table);
  return table[k * (b->degree + 1) + i + b->degree - mu];
}

/* The integral by midpoints of 400 parts: another route to the Gram matrix, to some 1e-5. */
static void check_gram(unsigned degree, size_t spans, unsigned k) {
  enum { PARTS = 400 };
  rig r;
  make_rig(&r, degree, degree, spans, spans);
  const bspline *b = &r.space.axis[0];
  size_t n = b->count;
  double *gram = malloc(n * n * sizeof *gram), worst = 0, largest = 0;
  convex_gram(b, k, gram);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++) {
      double sum = 0;
      for (int q = 0; q < PARTS; q++) {
        double t = (q + 0.5) / PARTS;
        sum += derivative(b, i, t, k) * derivative(b, j, t, k) / PARTS;
      }
      worst = fmax(worst, fabs(sum - gram[i * n + j]));
      largest = fmax(largest, fabs(sum));
    }
  T_RATIO(worst, 2e-4 * largest, "Gram matrix of derivatives %u of degree %u, %zu spans, against midpoints", k,
          degree, spans);
  free(gram);
}

static double tension_of(const convex_objective *o, const double *control) {
  double sum = 0;
  for (size_t i = 0; i < o->n; i++)
    for (size_t j = 0; j < o->n; j++)
      for (size_t k = 0; k < 3; k++) sum += control[3 * i + k] * o->tension[i * o->n + j] * control[3 * j + k];
  return sum;
}

/* u^3 (0, 0, 1): |x_uuu|^2 = 36. u v: |x_uv|^2 = 1. By hand on the square. */
static void check_tension_by_hand(batten_context *ctx) {
  rig r;
  make_rig(&r, 3, 3, 1, 1);
  const double point[3] = {0, 0, 0};
  convex_objective o;
  T_OK(convex_objective_new(ctx, &r.space, 1, point, NULL, &o), ctx);
  double cubic[48] = {0}, mixed[48] = {0};
  for (size_t i = 0; i < 4; i++)
    for (size_t j = 0; j < 4; j++) {
      cubic[3 * (4 * i + j) + 2] = i == 3;
      mixed[3 * (4 * i + j) + 1] = (double)(i * j) / 9;
    }
  T_RATIO(fabs(tension_of(&o, cubic) - 36), 1e-12, "tension of u^3 is 36");
  T_RATIO(fabs(tension_of(&o, mixed) - 1), 1e-13, "tension of u v is 1");
  convex_objective_free(ctx, &o);
}

/* f(u) + g(v), both quadratic, has no tension, and is found again as the limit. */
static void check_limit(batten_context *ctx, unsigned du, unsigned dv, size_t su, size_t sv) {
  rig r;
  make_rig(&r, du, dv, su, sv);
  double points[3 * COUNT], parameters[2 * COUNT];
  uint64_t seed = 5;
  for (size_t i = 0; i < COUNT; i++) {
    double u = parameters[2 * i] = t_uniform(&seed), v = parameters[2 * i + 1] = t_uniform(&seed);
    points[3 * i] = 1 + u - 0.3 * v * v;
    points[3 * i + 1] = 2 * v + 0.2 * u * u;
    points[3 * i + 2] = u * u - 3 * v * v + u - 2 * v;
  }
  convex_objective o;
  T_OK(convex_objective_new(ctx, &r.space, COUNT, points, NULL, &o), ctx);
  convex_objective_set(&o, &r.space, parameters);
  double *control = malloc(3 * o.n * sizeof *control), *other = malloc(3 * o.n * sizeof *control), off = 0;
  T_OK(convex_objective_limit(ctx, &o, &r.space, parameters, control), ctx);
  T_RATIO(fabs(tension_of(&o, control)), 1e-10, "degrees %u %u, spans %zu %zu: tension of the limit", du, dv, su, sv);
  T_RATIO(convex_objective_sum(&o, &r.space, control), 1e-24, "its sum of squares");
  T_OK(convex_objective_solve(ctx, &o, &r.space, 1, other), ctx);
  for (size_t i = 0; i < 3 * o.n; i++) off = fmax(off, fabs(control[i] - other[i]));
  T_RATIO(off, 1e-11, "w = 1 gives the same surface");
  free(other);
  free(control);
  convex_objective_free(ctx, &o);
}

/* The minimum is one: a step in any direction raises sum + w T, and by the same amount to both sides. */
static void check_minimum(batten_context *ctx, double w, bool weighted) {
  rig r;
  make_rig(&r, 3, 4, 2, 1);
  convex_scene s = convex_scene_make(&(convex_rule){.count = COUNT, .noise = 0.05, .seed = 3});
  double weights[COUNT], worst = 0;
  uint64_t seed = 9;
  for (size_t i = 0; i < COUNT; i++) weights[i] = i % 5 ? t_uniform(&seed) : 0;
  convex_objective o;
  T_OK(convex_objective_new(ctx, &r.space, COUNT, s.points, weighted ? weights : NULL, &o), ctx);
  convex_objective_set(&o, &r.space, s.parameters);
  double *x = malloc(6 * o.n * sizeof *x), *y = x + 3 * o.n;
  T_OK(convex_objective_solve(ctx, &o, &r.space, w, x), ctx);
  double least = convex_objective_sum(&o, &r.space, x) + w * tension_of(&o, x);
  for (int trial = 0; trial < 20; trial++) {
    double value[2];
    uint64_t start = seed;
    for (int side = 0; side < 2; side++) {
      seed = start;
      for (size_t i = 0; i < 3 * o.n; i++) y[i] = x[i] + (side ? -1e-3 : 1e-3) * (t_uniform(&seed) - 0.5);
      value[side] = convex_objective_sum(&o, &r.space, y) + w * tension_of(&o, y);
    }
    if (!(value[0] > least)) worst = INFINITY;
    worst = fmax(worst, fabs(value[0] - value[1]) / (value[0] - least));
  }
  T_RATIO(worst, 1e-7, "w = %g%s: all around the minimum is higher, evenly", w, weighted ? ", weighted" : "");
  free(x);
  convex_objective_free(ctx, &o);
  convex_scene_free(&s);
}

/* Exact data of a bicubic surface without tension: to rounding, also where the condition is bad. */
static void check_exact(batten_context *ctx, unsigned degree) {
  rig r;
  make_rig(&r, degree, degree, 1, 1);
  double points[3 * COUNT], parameters[2 * COUNT], off = 0;
  double *truth = malloc(6 * 64 * sizeof *truth), *found = truth + 3 * 64;
  uint64_t seed = 11;
  size_t n = convex_points(&r.space);
  for (size_t i = 0; i < 3 * n; i++) truth[i] = t_uniform(&seed);
  for (size_t i = 0; i < COUNT; i++) {
    double jet[6][3];
    for (size_t k = 0; k < 2; k++) parameters[2 * i + k] = t_uniform(&seed);
    convex_jet(&r.space, truth, parameters + 2 * i, jet);
    for (size_t k = 0; k < 3; k++) points[3 * i + k] = jet[0][k];
  }
  convex_objective o;
  T_OK(convex_objective_new(ctx, &r.space, COUNT, points, NULL, &o), ctx);
  convex_objective_set(&o, &r.space, parameters);
  T_OK(convex_objective_solve(ctx, &o, &r.space, 0, found), ctx);
  for (size_t i = 0; i < 3 * n; i++) off = fmax(off, fabs(truth[i] - found[i]));
  T_RATIO(off, degree < 5 ? 1e-12 : 1e-9, "degree %u: control points of exact data", degree);
  T_RATIO(sqrt(convex_objective_sum(&o, &r.space, found) / COUNT), 1e-14, "and their root mean square");
  convex_objective_free(ctx, &o);
  free(truth);
}

/* Points on a circle of the parameters and without tension; on a line; on a parabola. */
static void check_singular(batten_context *ctx) {
  rig r;
  make_rig(&r, 3, 3, 1, 1);
  double points[3 * COUNT], places[2 * COUNT], control[48];
  for (int shape = 0; shape < 4; shape++) {
    for (size_t i = 0; i < COUNT; i++) {
      double t = (double)i / COUNT, *p = places + 2 * i;
      p[0] = shape == 0 ? 0.5 + 0.4 * cos(2 * SCENE_PI * t) : t;
      p[1] = shape == 0 ? 0.5 + 0.4 * sin(2 * SCENE_PI * t) : shape == 1 ? 0.25 + t / 2 : shape == 2 ? t * t : 0.5;
      for (size_t k = 0; k < 3; k++) points[3 * i + k] = k < 2 ? p[k] : p[0] * p[0] + p[1] * p[1];
    }
    convex_objective o;
    T_OK(convex_objective_new(ctx, &r.space, COUNT, points, NULL, &o), ctx);
    convex_objective_set(&o, &r.space, places);
    T_STATUS(convex_objective_limit(ctx, &o, &r.space, places, control), BATTEN_E_SINGULAR, ctx, "one conic");
    T_STATUS(convex_objective_solve(ctx, &o, &r.space, 0, control), BATTEN_E_SINGULAR, ctx, "do not determine");
    convex_objective_free(ctx, &o);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  for (unsigned degree = 2; degree <= 4; degree++)
    for (unsigned k = 0; k <= 3; k++) check_gram(degree, degree == 3 ? 4 : 1, k);
  check_tension_by_hand(ctx);
  check_limit(ctx, 3, 3, 1, 1);
  check_limit(ctx, 2, 5, 3, 2);
  check_minimum(ctx, 0.01, false);
  check_minimum(ctx, 1e-6, true);
  check_exact(ctx, 3);
  check_exact(ctx, 6);
  check_singular(ctx);
  batten_context_free(ctx);
  return t_done();
}
