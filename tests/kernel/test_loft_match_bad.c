/* Slices and options that make no sense: an error that names what is wrong; no memory, and cancelled hosts. */
#include <batten/loft.h>

#include "tap.h"

enum { SLICES = 3, POINTS = 16, ALL = SLICES * POINTS };
static const double PI = 3.14159265358979323846;

typedef struct job {
  size_t count, starts[SLICES + 1];
  double points[ALL][2];
  batten_loft_match_options opt;
} job;

/* Ovals, two of them with dents. */
static job new_job(bool closed) {
  job j = {.count = SLICES, .opt = batten_loft_match_options_default()};
  j.opt.fit.closed = closed;
  for (size_t k = 0; k < ALL; k++) {
    double a = 2 * PI * (double)(k % POINTS) / POINTS, depth = k < 2 * POINTS ? 0.35 : 0;
    double r = 1 + depth * cos(2 * a);
    j.points[k][0] = r * cos(a);
    j.points[k][1] = r * sin(a);
  }
  for (size_t i = 0; i <= SLICES; i++) j.starts[i] = i * POINTS;
  return j;
}

static batten_status run(batten_context *ctx, void *arg) {
  const job *j = arg;
  batten_curve *curves[SLICES] = {NULL};
  batten_loft_match_info info;
  batten_status st = batten_loft_match(ctx, j->count, j->starts, j->points[0], &j->opt, curves, &info);
  for (size_t i = 0; i < SLICES; i++) {
    if (st < 0 && curves[i]) t_line(false, "a curve in spite of %s", batten_status_name(st));
    batten_curve_free(curves[i]);
  }
  return st;
}

static void test_options(batten_context *ctx) {
  const double one = 0.5;
  double weights[ALL];
  for (size_t k = 0; k < ALL; k++) weights[k] = k == 20 ? -1 : 1;
#define BAD(change, text)                                \
  do {                                                   \
    job j = new_job(true);                               \
    batten_loft_match_options *o = &j.opt;               \
    (void)o;                                             \
    change;                                              \
    T_STATUS(run(ctx, &j), BATTEN_E_INVALID, ctx, text); \
  } while (0)
  BAD(o->struct_size = 0, "batten_loft_match_options.struct_size: 0");
  BAD(o->fit.struct_size = 1, "batten_contour_options.struct_size: 1");
  BAD(o->fit.parameters = &one, "opt.fit.parameters: given; leave it as in the default");
  BAD(o->fit.breaks = &one, "opt.fit.breaks: given");
  BAD(o->fit.inflection_count = 0, "opt.fit.inflections: given");
  BAD(o->fit.sign = 1, "opt.fit.sign: given");
  BAD(o->fit.domain[1] = 2, "opt.fit.domain: given");
  BAD(o->fit.fix_ends[0] = 1, "opt.fit.fix_ends: given");
  BAD(o->fit.end_tangents[1][0] = 1, "opt.fit.end_points and end_tangents: given");
  BAD(o->fit.degree = 1, "opt.fit.degree: 1; must be 3 .. 9");
  BAD(o->fit.significance = 0, "opt.fit.significance: 0; must be above 0");
  BAD(o->fit.weights = weights, "opt.fit.weights[20]: -1");
  BAD(j.count = 1, "slice_count: 1; a loft needs 2 at least");
  BAD(j.starts[0] = 1, "starts[0]: 1; must be 0");
  BAD(j.starts[2] = 0, "starts[2]: slice 1 has fewer than 0 points");
  BAD(j.starts[1] = 2, "starts[1]: slice 0 has fewer than 3 points");
  BAD(j.points[18][1] = NAN, "slice 1: points[18][1]: nan; give finite points");
  BAD(j.points[40][0] = 1e200, "slice 2: points[40][0]: 1e+200");
  BAD((j.starts[1] = 3, j.points[2][0] = j.points[0][0], j.points[2][1] = j.points[0][1]),
      "slice 0: count: 2 points; a curve that bends needs 3 at least");
  BAD(for (size_t k = 16; k < 32; k++) j.points[k][0] = j.points[k][1] = 3, "slice 1: points: all 15 are equal");
  BAD(for (size_t k = 16; k < 32; k++) j.points[k][1] = 3, "slice 1: points: all 16 are one point or lie on a line");
#undef BAD
  job j = new_job(true);
  batten_curve *curves[SLICES];
  T_STATUS(batten_loft_match(ctx, 3, NULL, j.points[0], &j.opt, curves, NULL), BATTEN_E_INVALID, ctx, "starts: NULL");
  T_STATUS(batten_loft_match(ctx, 3, j.starts, NULL, &j.opt, curves, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_loft_match(ctx, 3, j.starts, j.points[0], &j.opt, NULL, NULL), BATTEN_E_INVALID, ctx,
           "curves: NULL; give room for 3 curves");
  j.starts[3] = SIZE_MAX / 4;
  T_STATUS(run(ctx, &j), BATTEN_E_TOO_LARGE, ctx, "more than memory can have");
}

/* What a slice is told of comes with its number. */
static void test_told(batten_context *ctx) {
  job j = new_job(true);
  j.opt.fit.tension = 0;
  j.opt.fit.spans = 40;
  T_CHECK(run(ctx, &j) >= 0, "16 points on 40 spans have a solution");
  j = new_job(true);
  j.opt.fit.row_limit = 1;
  T_STATUS(run(ctx, &j), BATTEN_E_TOO_LARGE, ctx, "slice 0: ");
  j = new_job(false);
  T_CHECK(run(ctx, &j) >= 0, "the same as open slices");
  j = new_job(true);
  j.points[2 * POINTS - 1][0] = j.points[POINTS][0];
  j.points[2 * POINTS - 1][1] = j.points[POINTS][1];
  T_CHECK(run(ctx, &j) >= 0, "a first point that is repeated");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_options(ctx);
  test_told(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "no memory is left");
  batten_context_free(ctx);
  job j = new_job(true);
  j.opt.fit.degree = 2;
  j.opt.fit.smoothness = 1;
  j.opt.fit.spans = 8;
  j.opt.fit.rounds = 1;
  j.count = 2;
  t_fail_every_allocation("batten_loft_match", run, &j);
  t_cancel_every_progress("batten_loft_match", run, &j);
  return t_done();
}
