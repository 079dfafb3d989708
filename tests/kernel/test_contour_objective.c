/* The minimum of squares and tension: curves of the space are found again, the gradient vanishes in it, and a dense
 * solution is the same. */
#include <batten/contour.h>
#include <batten/lsq.h>

#include <float.h>

#include "contour/contour_inner.h"
#include "tap.h"

enum { SPANS = 24, COUNT = 300, POINTS = 700 };

typedef struct scene {
  double breaks[SPANS + 1], parameters[POINTS], points[2 * POINTS], weights[POINTS], control[2 * COUNT];
  signed char signs[SPANS];
  contour_shape shape;
  contour_ends ends;
  contour_data data;
} scene;

static void point_at(const bspline *b, const double *control, double t, double *out) {
  double table[BSPLINE_ORDER];
  size_t mu = bspline_span(b, t);
  bspline_basis(b, mu, t, 0, table);
  out[0] = out[1] = 0;
  for (size_t j = 0; j <= b->degree; j++)
    for (size_t k = 0; k < 2; k++) out[k] += table[j] * control[2 * (mu - b->degree + j) + k];
}

static void make_scene(scene *s, unsigned degree, unsigned smoothness, bool closed, size_t spans, bool ends,
                       uint64_t *seed) {
  double at = 0;
  for (size_t i = 0; i <= spans; i++, at += 0.3 + t_uniform(seed)) s->breaks[i] = at;
  for (size_t i = 0; i <= spans; i++) s->breaks[i] /= s->breaks[spans];
  for (size_t i = 0; i < spans; i++) s->signs[i] = i >= spans / 2 ? -1 : 1;
  s->shape = (contour_shape){degree, smoothness, closed, spans, s->breaks, s->signs};
  for (int e = 0; e < 2; e++)
    for (int k = 0; k < 2; k++) {
      s->ends.point[e][k] = ends ? t_uniform(seed) : NAN;
      s->ends.tangent[e][k] = ends ? k ? sin(1 + e) : cos(1 + e) : NAN;
    }
  for (size_t i = 0; i < POINTS; i++) {
    s->parameters[i] = ((double)i + t_uniform(seed)) / POINTS;
    s->weights[i] = 0.5 + t_uniform(seed);
  }
  s->data = (contour_data){POINTS, s->points, s->weights};
}

/* Points on a curve of the space are fitted by that curve: the unknowns are independent, and all else is right. */
static void test_again(batten_context *ctx) {
  uint64_t seed = 11;
  double worst = 0, sums = 0, gradient = 0;
  size_t cases = 0;
  scene *s = malloc(sizeof *s);
  for (int i = 0; i < 48; i++) {
    unsigned smoothness = 1 + (unsigned)i % 2, degree = smoothness + 1 + (unsigned)(i / 2) % 4;
    bool closed = i / 8 % 3 == 1, ends = i / 8 % 3 == 2;
    contour_space space;
    contour_objective o;
    double y[2 * COUNT], control[2 * COUNT], noisy[2 * COUNT];
    make_scene(s, degree, smoothness, closed, 6 + t_random(&seed) % 12, ends, &seed);
    if (contour_space_make(ctx, &s->shape, degree, true, &s->ends, &space) != BATTEN_OK) continue;
    for (size_t j = 0; j < space.unknowns; j++) y[j] = t_uniform(&seed) - 0.5;
    contour_space_expand(&space, y, s->control);
    for (size_t j = 0; j < POINTS; j++) point_at(&space.b, s->control, s->parameters[j], s->points + 2 * j);
    if (contour_objective_new(ctx, &space.b, &o) != BATTEN_OK) break;
    contour_objective_set(&o, &s->data, s->parameters, 0);
    if (contour_objective_solve(ctx, &o, &space, control) == BATTEN_OK) cases++;
    for (size_t j = 0; j < 2 * space.b.count; j++) worst = fmax(worst, fabs(control[j] - s->control[j]));
    sums = fmax(sums, contour_sum(&space.b, control, &s->data, s->parameters));
    /* the gradient at the minimum of other points, with tension, by differences along each unknown */
    for (size_t j = 0; j < 2 * POINTS; j++) s->points[j] += 0.1 * t_uniform(&seed);
    contour_objective_set(&o, &s->data, s->parameters, 1e-6);
    contour_objective_solve(ctx, &o, &space, control);
    double total = 0;
    for (size_t j = 0; j < POINTS; j++) total += s->weights[j];
    for (size_t u = 0; u < space.unknowns; u++) {
      double value[2];
      for (int side = 0; side < 2; side++) {
        memcpy(noisy, control, 2 * space.b.count * sizeof *control);
        for (size_t row = 0; row < 2 * space.b.count; row++)
          for (size_t e = space.starts[row]; e < space.starts[row + 1]; e++)
            if (space.indices[e] == u) noisy[row] += (side ? 1 : -1) * space.values[e];
        double bend = 0;
        for (size_t p = 0; p < space.b.count; p++)
          for (size_t k = 0; k <= degree && p + k < space.b.count; k++)
            for (size_t c = 0; c < 2; c++)
              bend += (k ? 2 : 1) * o.bend[p * (degree + 1) + k] * noisy[2 * p + c] * noisy[2 * (p + k) + c];
        value[side] = contour_sum(&space.b, noisy, &s->data, s->parameters) / total + bend;
      }
      gradient = fmax(gradient, fabs(value[1] - value[0]) / (value[0] + value[1]));
    }
    contour_objective_free(ctx, &o);
    contour_space_free(ctx, &space);
  }
  free(s);
  T_CHECK(cases == 48, "%zu fits, open, closed, with fixed ends", cases);
  T_RATIO(worst, 1e-10, "curves found again");
  T_RATIO(sums, 1e-20, "their sums");
  T_RATIO(gradient, 1e-10, "derivative along each unknown at the minimum with tension");
}

/* Tension of t^2 and t^3, whose integrals of x''^2 are 4 and 12. */
static void test_tension(batten_context *ctx) {
  uint64_t seed = 3;
  scene *s = malloc(sizeof *s);
  for (unsigned degree = 3; degree <= 9; degree += 3) {
    make_scene(s, degree, 2, false, 7, false, &seed);
    contour_space space;
    contour_objective o;
    if (contour_space_make(ctx, &s->shape, degree, false, NULL, &space) != BATTEN_OK) break;
    if (contour_objective_new(ctx, &space.b, &o) != BATTEN_OK) break;
    contour_objective_set(&o, &s->data, s->parameters, 1e-3);
    size_t n = space.b.count;
    double bend[2] = {0, 0}, control[2 * COUNT];
    for (size_t j = 0; j < n; j++) { /* blossoms of t^2 and t^3 at the knots */
      double e[4] = {1, 0, 0, 0}, d = degree;
      for (unsigned k = 1; k <= degree; k++)
        for (int r = 3; r > 0; r--) e[r] += e[r - 1] * space.knots[j + k];
      control[2 * j] = e[2] / (d * (d - 1) / 2);
      control[2 * j + 1] = e[3] / (d * (d - 1) * (d - 2) / 6);
    }
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k <= degree && j + k < n; k++)
        for (size_t c = 0; c < 2; c++)
          bend[c] += (k ? 2 : 1) * o.bend[j * (degree + 1) + k] * control[2 * j + c] * control[2 * (j + k) + c];
    T_RATIO(fabs(bend[0] / 4e-3 - 1), 1e-9, "degree %u: a thousandth of the tension of t^2 is 4e-3", degree);
    T_RATIO(fabs(bend[1] / 12e-3 - 1), 1e-9, "degree %u: a thousandth of the tension of t^3 is 12e-3", degree);
    contour_objective_free(ctx, &o);
    contour_space_free(ctx, &space);
  }
  free(s);
}

/* A last span of length 1e-8 without data: its tension must not drown the rest. */
static void test_short(batten_context *ctx) {
  const double breaks[4] = {0, 0.5, 1 - 1e-8, 1};
  const signed char signs[3] = {1, 1, 1};
  uint64_t seed = 8;
  scene *s = malloc(sizeof *s);
  make_scene(s, 6, 1, false, 3, false, &seed);
  s->shape = (contour_shape){6, 1, false, 3, breaks, signs};
  for (size_t i = 0; i < POINTS; i++) {
    s->points[2 * i] = s->parameters[i];
    s->points[2 * i + 1] = sin(3 * s->parameters[i]);
  }
  contour_space space;
  contour_objective o;
  double control[2 * COUNT];
  T_OK(contour_space_make(ctx, &s->shape, 6, true, NULL, &space), ctx);
  T_OK(contour_objective_new(ctx, &space.b, &o), ctx);
  contour_objective_set(&o, &s->data, s->parameters, 1e-12);
  T_OK(contour_objective_solve(ctx, &o, &space, control), ctx);
  T_RATIO(sqrt(contour_sum(&space.b, control, &s->data, s->parameters) / POINTS), 1e-5,
          "root mean square distance of a sine from two pieces of degree 6 and a tiny one");
  contour_objective_free(ctx, &o);
  contour_space_free(ctx, &space);
  free(s);
}

/* Least squares by QR of the dense matrix: the second route. */
static void test_dense(batten_context *ctx) {
  uint64_t seed = 21;
  scene *s = malloc(sizeof *s);
  make_scene(s, 4, 2, true, 9, false, &seed);
  for (size_t j = 0; j < 2 * POINTS; j++) s->points[j] = t_uniform(&seed);
  contour_space space;
  contour_objective o;
  T_OK(contour_space_make(ctx, &s->shape, 4, true, NULL, &space), ctx);
  size_t n = space.b.count, u = space.unknowns;
  double *a = calloc(2 * POINTS * u, sizeof *a), *b = malloc(2 * POINTS * sizeof *b), *y = malloc(u * sizeof *y);
  double *w = malloc(2 * POINTS * sizeof *w), control[2][2 * COUNT], worst = 0;
  for (size_t i = 0; i < 2 * POINTS; i++) {
    double table[BSPLINE_ORDER];
    size_t mu = bspline_span(&space.b, s->parameters[i / 2]);
    bspline_basis(&space.b, mu, s->parameters[i / 2], 0, table);
    for (size_t j = 0; j <= 4; j++) {
      size_t row = 2 * (mu - 4 + j) + i % 2;
      for (size_t e = space.starts[row]; e < space.starts[row + 1]; e++)
        a[i * u + space.indices[e]] += table[j] * space.values[e];
    }
    b[i] = s->points[i];
    w[i] = s->weights[i / 2];
  }
  batten_lsq_options opt = batten_lsq_options_default();
  opt.method = BATTEN_LSQ_QR;
  opt.weights = w;
  T_OK(batten_lsq_solve(ctx, 2 * POINTS, u, 1, a, b, &opt, y, NULL), ctx);
  contour_space_expand(&space, y, control[0]);
  T_OK(contour_objective_new(ctx, &space.b, &o), ctx);
  contour_objective_set(&o, &s->data, s->parameters, 0);
  T_OK(contour_objective_solve(ctx, &o, &space, control[1]), ctx);
  for (size_t j = 0; j < 2 * n; j++) worst = fmax(worst, fabs(control[0][j] - control[1][j]));
  T_RATIO(worst, 1e-12, "control points by dense QR");
  s->data.count = 3;
  contour_objective_set(&o, &s->data, s->parameters, 0);
  T_STATUS(contour_objective_solve(ctx, &o, &space, control[1]), BATTEN_E_SINGULAR, ctx, "opt.tension");
  contour_objective_free(ctx, &o);
  contour_space_free(ctx, &space);
  free(a);
  free(b);
  free(y);
  free(w);
  free(s);
}

static batten_status solve_one(batten_context *ctx, void *arg) {
  scene *s = arg;
  contour_space space = {0};
  contour_objective o = {0};
  double control[2 * COUNT];
  batten_status st = contour_space_make(ctx, &s->shape, 3, true, NULL, &space);
  if (st >= 0) st = contour_objective_new(ctx, &space.b, &o);
  if (st >= 0) {
    contour_objective_set(&o, &s->data, s->parameters, 0);
    st = contour_objective_solve(ctx, &o, &space, control);
  }
  contour_objective_free(ctx, &o);
  contour_space_free(ctx, &space);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_again(ctx);
  test_tension(ctx);
  test_dense(ctx);
  test_short(ctx);
  uint64_t seed = 4;
  scene *s = malloc(sizeof *s);
  make_scene(s, 3, 2, true, 9, false, &seed);
  for (size_t j = 0; j < 2 * POINTS; j++) s->points[j] = t_uniform(&seed);
  t_fail_every_allocation("contour_objective_solve", solve_one, s);
  free(s);
  batten_context_free(ctx);
  return t_done();
}
