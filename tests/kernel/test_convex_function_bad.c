/* Convex spline functions: what is refused, with which words, failing memory, and cancelling. */
#include <batten/convex.h>

#include "tap.h"

enum { N = 60 };

static void scatter(double *points) {
  uint64_t seed = 3;
  for (int k = 0; k < N; k++) {
    double x = t_uniform(&seed), y = t_uniform(&seed);
    double p[3] = {x, y, x * x + y * y + 0.2 * t_uniform(&seed)};
    memcpy(points + 3 * k, p, sizeof p);
  }
}

static batten_surface *sentinel;
static batten_status try(batten_context *ctx, size_t count, const double *points,
                         const batten_convex_function_options *o) {
  batten_surface *s = (batten_surface *)&sentinel;
  batten_convex_function_info info = {.unknowns = 77};
  batten_status st = batten_convex_function_fit(ctx, count, points, o, &s, NULL, &info);
  if (st < 0 && (s != (batten_surface *)&sentinel || info.unknowns != 77)) t_line(false, "outputs untouched");
  if (st >= 0) batten_surface_free(s);
  return st;
}

static void options(batten_context *ctx) {
  double points[3 * N];
  scatter(points);
  const batten_convex_function_options fine = batten_convex_function_options_default();
  batten_convex_function_options o = fine;
  double two[2] = {0.5, 0.4}, outside[1] = {2}, weights[N];
  signed char signs[16];
#define REFUSED(set, part)                                          \
  do {                                                              \
    o = fine;                                                       \
    set;                                                            \
    T_STATUS(try(ctx, N, points, &o), BATTEN_E_INVALID, ctx, part); \
  } while (0)
  REFUSED(o.struct_size = 1, "struct_size: 1");
  REFUSED(o.degree[1] = 1, "opt.degree[1]: 1; give 2 to 7");
  REFUSED(o.degree[0] = 8, "opt.degree[0]: 8");
  REFUSED(o.spans[0] = 0, "opt.spans[0]: 0; give 1 to 64");
  REFUSED(o.spans[1] = 65, "opt.spans[1]: 65");
  REFUSED(o.smoothness[0] = 3, "opt.smoothness[0]: 3; degree 3 allows 1 to 2");
  REFUSED(o.tension = -1, "opt.tension: -1");
  REFUSED(o.tension = NAN, "opt.tension: nan");
  REFUSED(o.gap_tol = 0, "opt.gap_tol: 0");
  REFUSED(o.rounds = 0, "opt.rounds: 0; give 1 to 20");
  REFUSED(o.rounds = 21, "opt.rounds: 21");
  REFUSED((o.domain[0][0] = 0, o.domain[0][1] = 1, o.domain[1][0] = 0, o.domain[1][1] = 0.5),
          "is outside the domain");
  REFUSED(o.domain[0][0] = 0, "opt.domain[0]: 0 to nan");
  REFUSED((o.domain[0][0] = 2, o.domain[0][1] = 1, o.domain[1][0] = 0, o.domain[1][1] = 1), "opt.domain[0]: 2 to 1");
  REFUSED(o.break_count[0] = 2, "opt.breaks[0]: NULL; give [2]");
  REFUSED((o.break_count[0] = 2, o.breaks[0] = two), "opt.breaks[0][1]: 0.40000000000000002; breaks must ascend");
  REFUSED((o.break_count[1] = 1, o.breaks[1] = outside), "opt.breaks[1][0]: 2; give one inside the domain");
  REFUSED((o.break_count[1] = 64, o.breaks[1] = outside), "opt.break_count[1]: 64; give at most 63");
  memset(signs, 1, sizeof signs);
  signs[7] = 2;
  REFUSED(o.signs = signs, "opt.signs[1][3]: 2; give -1, 0 or 1");
  for (int k = 0; k < N; k++) weights[k] = 0;
  REFUSED(o.weights = weights, "opt.weights: all are 0");
  weights[3] = -1;
  REFUSED(o.weights = weights, "opt.weights[3]: -1");
  weights[3] = NAN;
  REFUSED(o.weights = weights, "opt.weights[3]: nan");
}

static void points_refused(batten_context *ctx) {
  double points[3 * N];
  scatter(points);
  T_STATUS(try(ctx, 0, points, NULL), BATTEN_E_INVALID, ctx, "count: 0");
  T_STATUS(try(ctx, N, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  points[3 * 5 + 1] = NAN;
  T_STATUS(try(ctx, N, points, NULL), BATTEN_E_INVALID, ctx, "points[5][1]: nan");
  points[3 * 5 + 1] = INFINITY;
  T_STATUS(try(ctx, N, points, NULL), BATTEN_E_INVALID, ctx, "points[5][1]: inf");
  for (int k = 0; k < N; k++) points[3 * k + 1] = 4;
  T_STATUS(try(ctx, N, points, NULL), BATTEN_E_SINGULAR, ctx, "all have y = 4");
  for (int k = 0; k < N; k++) points[3 * k + 1] = 1 - 3 * points[3 * k];
  T_STATUS(try(ctx, N, points, NULL), BATTEN_E_SINGULAR, ctx, "on a line");
  T_STATUS(try(ctx, 1, points, NULL), BATTEN_E_SINGULAR, ctx, "all have x");
  T_STATUS(try(ctx, 2, points, NULL), BATTEN_E_SINGULAR, ctx, "on a line");
  scatter(points);
  double weights[N] = {1, 1};
  batten_convex_function_options o = batten_convex_function_options_default();
  o.weights = weights;
  T_STATUS(try(ctx, N, points, &o), BATTEN_E_SINGULAR, ctx, "all that count are on a line");
  T_OK(try(ctx, 3, points, NULL), ctx);
  for (int k = 0; k < N; k++) weights[k] = k ? 1 : 1e300;
  T_OK(try(ctx, N, points, &o), ctx);
  for (int k = 0; k < N; k++) weights[k] = 1e308;
  T_STATUS(try(ctx, N, points, &o), BATTEN_E_INVALID, ctx, "sums of squares are beyond a double");
  for (int k = 0; k < N; k++) points[3 * k + 2] *= 1e200;
  T_STATUS(try(ctx, N, points, NULL), BATTEN_E_INVALID, ctx, "sums of squares are beyond a double");
  scatter(points);
  for (int k = 0; k < N; k++) points[3 * k] += 1e15;
  T_STATUS(try(ctx, N, points, NULL), BATTEN_E_INVALID, ctx, "too far from 0");
}

/* One round that is told to come very near: done, but not as near; and all rounds that are of use, told to come as
 * near as no program can tell. */
static void stopped(batten_context *ctx) {
  double points[3 * N];
  signed char signs[16];
  scatter(points);
  for (int k = 0; k < 16; k++) signs[k] = k / 4 < 2 ? 1 : -1;
  batten_convex_function_options o = batten_convex_function_options_default();
  o.rounds = 1;
  o.gap_tol = 1e-9;
  o.signs = signs;
  T_STATUS(try(ctx, N, points, &o), BATTEN_W_STOPPED, ctx, "raise opt.rounds");
  o.rounds = 20;
  o.spans[0] = 2;
  o.spans[1] = 1;
  signs[1] = -1;
  o.gap_tol = 1e-13;
  T_STATUS(try(ctx, N, points, &o), BATTEN_W_STOPPED, ctx, "more rounds would not reach");
}

static batten_status small(batten_context *ctx, void *arg) {
  batten_convex_function_options o = batten_convex_function_options_default();
  o.spans[0] = 2;
  o.spans[1] = 1;
  const signed char halves[2] = {1, -1};
  o.signs = halves;
  o.rounds = 2;
  o.gap_tol = 0.1;
  batten_surface *s = NULL, *u = NULL;
  batten_status st = batten_convex_function_fit(ctx, N, arg, &o, &s, &u, NULL);
  if (st >= 0) {
    batten_surface_free(s);
    batten_surface_free(u);
  }
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  double points[3 * N];
  options(ctx);
  points_refused(ctx);
  stopped(ctx);
  scatter(points);
  for (int k = 0; k < N; k++) points[3 * k + 2] = points[3 * k] * points[3 * k + 1];
  t_fail_every_allocation("batten_convex_function_fit", small, points);
  t_cancel_every_progress("batten_convex_function_fit", small, points);
  batten_context_free(ctx);
  return t_done();
}
