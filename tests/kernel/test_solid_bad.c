/* Solids: bad input with its texts, failing allocations, cancelling, too few and flat points. */
#include <batten/solid.h>

#include "scenes.h"
#include "tap.h"

enum { COUNT = 60 };

static double points[COUNT * 3], normals[COUNT * 3];

static batten_status fit(batten_context *ctx, unsigned n, size_t count, const double *at,
                         const batten_solid_options *o) {
  batten_solid *s = NULL;
  batten_solid_info info;
  batten_status st = batten_solid_fit(ctx, n, count, at, o, &s, &info);
  if (st < 0 && s) t_line(false, "out touched on failure");
  batten_solid_free(s);
  return st;
}

static void test_arguments(batten_context *ctx) {
  batten_solid *s = NULL;
  T_STATUS(fit(ctx, 4, COUNT, points, NULL), BATTEN_E_INVALID, ctx, "n: 4; give 1, 2 or 3");
  T_STATUS(fit(ctx, 0, COUNT, points, NULL), BATTEN_E_INVALID, ctx, "n: 0");
  T_STATUS(fit(ctx, 3, 0, points, NULL), BATTEN_E_INVALID, ctx, "count: 0");
  T_STATUS(fit(ctx, 3, COUNT, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL; give [60][3]");
  T_STATUS(fit(ctx, 3, SIZE_MAX / 8, points, NULL), BATTEN_E_TOO_LARGE, ctx, "too many");
  T_STATUS(batten_solid_fit(ctx, 3, COUNT, points, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_solid_evaluate(ctx, NULL, 1, points, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "solid: NULL");
  T_CHECK(!s, "nothing made");
}

static void test_points(batten_context *ctx) {
  double bad[COUNT * 3];
  memcpy(bad, points, sizeof bad);
  bad[3 * 17 + 1] = NAN;
  T_STATUS(fit(ctx, 3, COUNT, bad, NULL), BATTEN_E_INVALID, ctx, "points[17]: coordinate 1 is nan");
  bad[3 * 17 + 1] = INFINITY;
  T_STATUS(fit(ctx, 3, COUNT, bad, NULL), BATTEN_E_INVALID, ctx, "points[17]: coordinate 1 is inf");
  bad[3 * 17 + 1] = 1e200;
  T_STATUS(fit(ctx, 3, COUNT, bad, NULL), BATTEN_E_INVALID, ctx, "scale them down");
  T_STATUS(fit(ctx, 3, 1, points, NULL), BATTEN_E_INVALID, ctx, "points: 1, of them 1 distinct; at least 4");
  T_STATUS(fit(ctx, 3, 3, points, NULL), BATTEN_E_INVALID, ctx, "at least 4 are needed in 3 dimensions");
  T_STATUS(fit(ctx, 2, 2, points, NULL), BATTEN_E_INVALID, ctx, "at least 3 are needed in 2 dimensions");
  for (size_t i = 0; i < COUNT * 3; i++) bad[i] = points[i % 9];
  T_STATUS(fit(ctx, 3, COUNT, bad, NULL), BATTEN_E_INVALID, ctx, "points: 60, of them 3 distinct");
  for (size_t i = 0; i < COUNT; i++) bad[3 * i + 2] = 0.5 * bad[3 * i] + 1;
  for (size_t i = 0; i < COUNT; i++)
    memcpy(bad + 3 * i, points + 3 * i, 2 * sizeof *bad), bad[3 * i + 2] = 0.5 * points[3 * i] + 1;
  T_STATUS(fit(ctx, 3, COUNT, bad, NULL), BATTEN_E_SINGULAR, ctx, "points: flat across (");
  for (size_t i = 0; i < COUNT; i++) bad[2 * i] = (double)i, bad[2 * i + 1] = 3 * (double)i;
  T_STATUS(fit(ctx, 2, COUNT, bad, NULL), BATTEN_E_SINGULAR, ctx, "points: flat across (");
  for (size_t i = 0; i < COUNT * 3; i++) bad[i] = points[i] + 7e6;
  T_OK(fit(ctx, 3, COUNT, bad, NULL), ctx);
}

static void test_options(batten_context *ctx) {
  const batten_solid_options good = batten_solid_options_default();
  batten_solid_options o = {0};
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "batten_solid_options.struct_size: 0");
  o = good, o.spline.struct_size = 0;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "batten_spline_options.struct_size: 0");
  o = good, o.merge_radius = -1;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.merge_radius: -1");
  o = good, o.merge_radius = NAN;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.merge_radius: nan");
  o = good, o.merge_radius = 100;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "of them 1 distinct");
  o = good, o.pair_distance = 0;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.pair_distance: 0");
  o = good, o.check_cells = 3;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.check_cells: 3");
  o = good, o.orientation = (batten_orientation)9;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.orientation: 9");
  o = good, o.orient_data = (batten_orient_data)-1;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.orient_data: -1");
  o = good, o.orient_method = (batten_orient_method)7;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.orient_method: 7");
  o = good, o.spline.m = 1;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.spline.m: 1; give 2 to 4 in 3 dimensions");
  o = good, o.spline.m = 5;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.spline.m: 5");
  o = good, o.spline.smoothing = -1;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "smoothing");
  o = good, o.orientation = BATTEN_ORIENT_GIVEN;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.normals: NULL; orientation given");
  o = good, o.normals = normals;
  memcpy(normals, points, sizeof normals);
  memset(normals + 3 * 5, 0, 3 * sizeof *normals);
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "normals[5]: its length is 0");
  normals[3 * 5] = NAN;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "normals[5]: coordinate 0 is nan");
  normals[3 * 5] = 1e-300;
  T_OK(fit(ctx, 3, COUNT, points, &o), ctx);
}

static batten_status host_fails(const void *user, batten_context *ctx, size_t count, const double *x, double *f,
                                double *g, double *h) {
  (void)user, (void)count, (void)x, (void)f, (void)g, (void)h;
  return batten_fail(ctx, BATTEN_E_NOT_FOUND, "host: no field");
}

/* |x|^2 by a callback: quadratic, which only a test can know, and m = 3 contains. */
static batten_status quadratic(const void *user, batten_context *ctx, size_t count, const double *x, double *f,
                               double *g, double *h) {
  (void)user, (void)ctx, (void)g, (void)h;
  for (size_t i = 0; i < count; i++, x += 3) f[i] = 1 - x[0] * x[0] - 2 * x[1] * x[1] - x[2] * x[0];
  return BATTEN_OK;
}

static void test_carriers(batten_context *ctx) {
  batten_solid_options o = batten_solid_options_default();
  batten_carrier *c = NULL;
  const double zero[3] = {0, 0, 0}, up[3] = {0, 0, 1};
  batten_carrier_half_space(ctx, 3, zero, up, &c);
  o.carrier = c;
  T_STATUS(
      fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx,
      "opt.carrier: the spline of order m = 2 reproduces this half-space, so that f is 0 everywhere; take a ball");
  o.spline.smoothing = 0;
  o.orientation = BATTEN_ORIENT_NEVER;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "reproduces this half-space");
  o.orientation = BATTEN_ORIENT_ESTIMATE;
  T_OK(fit(ctx, 3, COUNT, points, &o), ctx); /* with orientation any carrier will do */
  batten_carrier_free(c);
  o = batten_solid_options_default();
  batten_carrier_ball(ctx, 3, zero, 1, &c);
  o.carrier = c;
  o.spline.m = 3;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "m = 3 reproduces this ball");
  T_CHECK(strstr(batten_error(ctx), "set opt.spline.m to 2, or opt.orientation"), "and the remedy");
  batten_carrier_free(c);
  batten_field field = {.dimension = 3, .order = 0, .evaluate = quadratic};
  batten_carrier_callback(ctx, &field, 1e-3, &c);
  o.carrier = c;
  double moon[COUNT * 3]; /* a sphere is a quadric: its points are too special for m = 3 */
  scene_moon_points(1, COUNT, moon);
  T_STATUS(fit(ctx, 3, COUNT, moon, &o), BATTEN_E_INVALID, ctx, "m = 3 reproduces this callback");
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_SINGULAR, ctx, "zero set of one polynomial of degree 2");
  o.spline.m = 2;
  T_OK(fit(ctx, 3, COUNT, points, &o), ctx);
  batten_carrier_free(c);
  field.evaluate = host_fails;
  batten_carrier_callback(ctx, &field, 1e-3, &c);
  o.carrier = c;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_NOT_FOUND, ctx, "host: no field");
  batten_carrier_free(c);
  batten_carrier_none(ctx, 3, &c);
  o.carrier = c;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.carrier: none needs oriented points");
  memcpy(normals, points, sizeof normals);
  o.normals = normals;
  T_OK(fit(ctx, 3, COUNT, points, &o), ctx); /* AUTO takes the normals that are there */
  batten_carrier_free(c);
  o = batten_solid_options_default();
  batten_carrier_ball(ctx, 2, zero, 1, &c);
  o.carrier = c;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "opt.carrier: of dimension 2, the points are of 3");
  batten_carrier_free(c);
  o.carrier = NULL;
  o.spline.m = 3;
  o.orientation = BATTEN_ORIENT_NEVER;
  T_STATUS(fit(ctx, 3, COUNT, points, &o), BATTEN_E_INVALID, ctx, "m = 3 reproduces this ellipsoid");
}

static void test_create(batten_context *ctx) {
  batten_solid *s = NULL, *other = NULL;
  batten_carrier *flat = NULL;
  T_OK(batten_solid_fit(ctx, 3, COUNT, points, NULL, &s, NULL), ctx);
  batten_carrier_ball(ctx, 2, points, 1, &flat);
  batten_spline *spline = batten_solid_spline(s);
  batten_carrier *carrier = batten_solid_carrier(s);
  const double lower[3] = {-1, -1, -1}, upper[3] = {1, 1, 1}, wild[3] = {1, NAN, 1};
  T_STATUS(batten_solid_create(ctx, NULL, carrier, 1, lower, upper, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "spline: NULL");
  T_STATUS(batten_solid_create(ctx, spline, NULL, 1, lower, upper, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "carrier: NULL");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 0, lower, upper, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "sign: 0");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, upper, lower, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "in order");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, lower, wild, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "upper[1]: -1, nan");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, NULL, wild, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "lower: NULL");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, lower, upper, 0, lower, &other), BATTEN_E_INVALID, ctx,
           "point_count: 0");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, lower, upper, 1, wild, &other), BATTEN_E_INVALID, ctx,
           "points[0]: coordinate 1 is nan");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, lower, upper, SIZE_MAX / 8, lower, &other),
           BATTEN_E_TOO_LARGE, ctx, "point_count: ");
  T_STATUS(batten_solid_create(ctx, spline, flat, 1, lower, upper, 0, NULL, &other), BATTEN_E_INVALID, ctx,
           "carrier: of dimension 2, the spline's is 3");
  T_STATUS(batten_solid_create(ctx, spline, carrier, 1, lower, upper, 0, NULL, NULL), BATTEN_E_INVALID, ctx,
           "out: NULL");
  T_STATUS(batten_solid_with_carrier(ctx, s, flat, &other), BATTEN_E_INVALID, ctx, "carrier: of dimension 2");
  T_STATUS(batten_solid_with_carrier(ctx, s, NULL, &other), BATTEN_E_INVALID, ctx, "carrier: NULL");
  T_STATUS(batten_solid_with_carrier(ctx, s, carrier, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_solid_evaluate(ctx, s, 1, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_solid_evaluate(ctx, s, SIZE_MAX / 4, points, normals, normals, NULL), BATTEN_E_TOO_LARGE, ctx,
           "too many");
  T_OK(batten_solid_evaluate(ctx, s, 0, NULL, NULL, NULL, NULL), ctx);
  T_CHECK(!other, "out untouched");
  batten_solid_free(s);
  batten_solid_free(NULL);
  batten_carrier_free(flat);
}

/* ---- every allocation, every progress call ------------------------------------------------------- */

static batten_status call_auto(batten_context *ctx, void *arg) { return fit(ctx, 2, 24, arg, NULL); }

static batten_status call_estimate(batten_context *ctx, void *arg) {
  batten_solid_options o = batten_solid_options_default();
  o.orientation = BATTEN_ORIENT_ESTIMATE;
  o.orient_method = BATTEN_ORIENT_METHOD_PLANES;
  o.check_cells = 8;
  return fit(ctx, 2, 24, arg, &o);
}

static batten_status call_pairs(batten_context *ctx, void *arg) {
  batten_solid_options o = batten_solid_options_default();
  double each[24], outward[48];
  for (size_t i = 0; i < 24; i++) {
    each[i] = 1e-6;
    scene_normal(2, scene_pair, (const double *)arg + 2 * i, outward + 2 * i);
  }
  o.orientation = BATTEN_ORIENT_GIVEN;
  o.normals = outward;
  o.orient_data = BATTEN_ORIENT_DATA_PAIRS;
  o.spline.smoothing_per_point = each;
  o.check_cells = 8;
  return fit(ctx, 2, 24, arg, &o);
}

static batten_status call_deform(batten_context *ctx, void *arg) {
  batten_solid *s = NULL, *moved = NULL, *copy = NULL;
  batten_carrier *ball = NULL;
  double lower[2], upper[2];
  batten_status st = batten_solid_fit(ctx, 2, 24, arg, NULL, &s, NULL);
  if (st >= 0) st = batten_carrier_ball(ctx, 2, (double[]){0.1, 0}, 1, &ball);
  if (st >= 0) st = batten_solid_with_carrier(ctx, s, ball, &moved);
  if (st >= 0) batten_solid_box(s, lower, upper);
  if (st >= 0) st = batten_solid_create(ctx, batten_solid_spline(s), ball, -1, lower, upper, 0, NULL, &copy);
  batten_solid_free(s);
  batten_solid_free(moved);
  batten_solid_free(copy);
  batten_carrier_free(ball);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  scene_sphere_points(7, COUNT, points);
  test_arguments(ctx);
  test_points(ctx);
  test_options(ctx);
  test_carriers(ctx);
  test_create(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  double contour[48];
  scene_pair_points(24, contour);
  t_fail_every_allocation("fit", call_auto, contour);
  t_fail_every_allocation("fit with estimated normals", call_estimate, contour);
  t_fail_every_allocation("fit with pairs", call_pairs, contour);
  t_fail_every_allocation("another carrier, and parts", call_deform, contour);
  t_cancel_every_progress("fit", call_auto, contour);
  t_cancel_every_progress("fit with estimated normals", call_estimate, contour);
  return t_done();
}
