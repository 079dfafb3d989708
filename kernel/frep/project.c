/* Shadows: the union over an interval of one coordinate. */
#include "base/checked.h"
#include "frep/gather.h"
#include "frep/highest.h"

enum { MOST_SAMPLES = 1000000 };

/* Numbers: axis, lower, upper, samples. */
static unsigned axis_of(const batten_frep *a) { return (unsigned)a->numbers[0]; }

/* The plane's coordinates are the two others, in their order. */
static unsigned other_axis(const batten_frep *a, unsigned k) { return k < axis_of(a) ? k : k + 1; }

static double height(const batten_frep *a, double part) { return (1 - part) * a->numbers[1] + part * a->numbers[2]; }

static double part_of(const batten_frep *a, size_t piece, double u) {
  return ((double)piece + u) / (a->numbers[3] - 1);
}

static void place(const void *user, size_t piece, double u, const double *x, double *y) {
  const batten_frep *a = user;
  y[axis_of(a)] = height(a, part_of(a, piece, u));
  for (unsigned k = 0; k < 2; k++) y[other_axis(a, k)] = x[k];
}

static void velocity(const void *user, size_t piece, double u, double *dy) {
  const batten_frep *a = user;
  (void)piece;
  (void)u;
  dy[0] = dy[1] = dy[2] = 0;
  dy[axis_of(a)] = (a->numbers[2] - a->numbers[1]) / (a->numbers[3] - 1);
}

static void image(const void *user, size_t piece, double from, double to, const interval *x, interval *y) {
  const batten_frep *a = user;
  /* the ends are those of a line; 1e-15 of its ends: the rounding of what place does */
  double slack = 1e-15 * (fabs(a->numbers[1]) + fabs(a->numbers[2]));
  y[axis_of(a)] =
      interval_widen(height(a, part_of(a, piece, from)) - slack, height(a, part_of(a, piece, to)) + slack, 4);
  for (unsigned k = 0; k < 2; k++) y[other_axis(a, k)] = x[k];
}

static frep_track track_of(const batten_frep *a) {
  return (frep_track){.child = a->children[0],
                      .n = 2,
                      .user = a,
                      .pieces = (size_t)a->numbers[3] - 1,
                      .place = place,
                      .velocity = velocity,
                      .image = image};
}

static batten_status project_evaluate(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients) {
  frep_track track = track_of(a);
  double *slopes = NULL;
  if (gradients) {
    slopes = batten_alloc_array(ctx, count, 3 * sizeof *slopes);
    if (!slopes) return BATTEN_E_NOMEM;
  }
  batten_status st = frep_highest(&track, ctx, count, points, values, slopes);
  for (size_t i = 0; st >= 0 && gradients && i < count; i++)
    for (unsigned k = 0; k < 2; k++) gradients[2 * i + k] = slopes[3 * i + other_axis(a, k)];
  batten_free(ctx, slopes);
  return st;
}

static batten_status project_bounds(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges) {
  frep_track track = track_of(a);
  return frep_highest_bounds(&track, ctx, count, boxes, ranges);
}

static batten_status project_slopes(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                    double *slopes) {
  frep_track track = track_of(a);
  return frep_highest_slopes(&track, ctx, count, boxes, slopes);
}

static bool project_box(const batten_frep *a, double *lower, double *upper) {
  double low[3], high[3];
  if (!frep_structural_box(a->children[0], low, high)) return false;
  unsigned axis = axis_of(a);
  bool empty = low[axis] > high[axis] || high[axis] < a->numbers[1] || low[axis] > a->numbers[2];
  for (unsigned k = 0; k < 2; k++) {
    lower[k] = empty ? 1 : low[other_axis(a, k)];
    upper[k] = empty ? -1 : high[other_axis(a, k)];
  }
  return true;
}

batten_status batten_frep_project(batten_context *ctx, batten_frep *a, unsigned axis, double lower, double upper,
                                  size_t samples, batten_frep **out) {
  batten_status st = frep_check_out(ctx, out);
  if (st >= 0) st = frep_check_node(ctx, "a", a, 3);
  if (st < 0) return st;
  if (axis > 2) return batten_fail(ctx, BATTEN_E_INVALID, "axis: %u; give 0, 1 or 2", axis);
  st = frep_check_numbers(ctx, "lower", 1, &lower);
  if (st >= 0) st = frep_check_numbers(ctx, "upper", 1, &upper);
  if (st < 0) return st;
  if (!(lower < upper))
    return batten_fail(ctx, BATTEN_E_INVALID, "upper: %g, lower: %g; give lower < upper", upper, lower);
  if (samples < 2 || samples > MOST_SAMPLES)
    return batten_fail(ctx, BATTEN_E_INVALID, "samples: %zu; give 2 to %d", samples, MOST_SAMPLES);
  const double numbers[4] = {axis, lower, upper, (double)samples};
  batten_frep_parts parts = {.n = 2, .number_count = 4, .numbers = numbers, .child_count = 1, .children = {a}};
  /* no distance: inside a thin rim the solid is less deep than its shadow */
  return frep_make(ctx, &frep_class_project, &parts, false, NULL, out);
}

static batten_status project_create(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out) {
  const double *v = parts->numbers;
  batten_status st = frep_check_parts(ctx, parts, 4, 1);
  if (st >= 0 && !(v[0] == 0 || v[0] == 1 || v[0] == 2))
    st = batten_fail(ctx, BATTEN_E_INVALID, "axis: %g; give 0, 1 or 2", v[0]);
  if (st >= 0 && !(v[3] >= 2 && v[3] <= MOST_SAMPLES))
    st = batten_fail(ctx, BATTEN_E_INVALID, "samples: %g; give 2 to %d", v[3], MOST_SAMPLES);
  if (st < 0) return st;
  return batten_frep_project(ctx, parts->children[0], (unsigned)v[0], v[1], v[2], (size_t)v[3], out);
}

const frep_class frep_class_project = {.kind = BATTEN_FREP_KIND_PROJECT,
                                       .name = "project",
                                       .evaluate = project_evaluate,
                                       .bounds = project_bounds,
                                       .slopes = project_slopes,
                                       .box = project_box,
                                       .create = project_create};
