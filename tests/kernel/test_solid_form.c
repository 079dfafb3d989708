/* Solids of a form of another part of the kernel: evaluated, differentiated, bounded, shared and refused as the
 * headers say; and what bounds refuse, survive and do not depend on. */
#include <batten/carrier.h>
#include <batten/solid.h>

#include "scenes.h"
#include "solid/solid_form.h"
#include "tap.h"

/* f = 1 - |x|^2 - x^3 y: a form with gradients alone. */
typedef struct wave {
  size_t released;
} wave;

static batten_status wave_evaluate(const void *state, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients, double *hessians) {
  (void)state;
  if (hessians) return batten_fail(ctx, BATTEN_E_INTERNAL, "Hessians were asked of a form without them");
  for (size_t i = 0; i < count; i++) {
    const double *p = points + 3 * i;
    if (values) values[i] = 1 - p[0] * p[0] - p[1] * p[1] - p[2] * p[2] - p[0] * p[0] * p[0] * p[1];
    if (!gradients) continue;
    gradients[3 * i] = -2 * p[0] - 3 * p[0] * p[0] * p[1];
    gradients[3 * i + 1] = -2 * p[1] - p[0] * p[0] * p[0];
    gradients[3 * i + 2] = -2 * p[2];
  }
  return BATTEN_OK;
}

static batten_status wave_bounds(const void *state, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges) {
  (void)state;
  (void)ctx;
  for (size_t i = 0; i < count; i++) {
    double far = 0, cube = 1;
    for (int k = 0; k < 3; k++) {
      double most = fmax(fabs(boxes[6 * i + (size_t)k]), fabs(boxes[6 * i + 3 + (size_t)k]));
      far += most * most;
      cube = k == 0 ? most * most * most : k == 1 ? cube * most : cube;
    }
    ranges[2 * i] = 1 - far - cube;
    ranges[2 * i + 1] = 1 + cube;
  }
  return BATTEN_OK;
}

static void wave_release(void *state) { ((wave *)state)->released++; }

static const solid_form wave_form = {
    .kind = BATTEN_SOLID_TREE, .order = 1, .evaluate = wave_evaluate, .bounds = wave_bounds, .release = wave_release};
static const solid_form other_form = {.kind = BATTEN_SOLID_STACK, .order = 1, .release = wave_release};
static const double lower[3] = {-1, -1, -1}, upper[3] = {1, 1, 1}, tip[3] = {0, 0, 1};

static batten_solid *make(batten_context *ctx, wave *w, unsigned depth) {
  batten_solid *s = NULL;
  T_OK(batten_solid_make(ctx, &wave_form, w, 3, depth, lower, upper, 1, tip, &s), ctx);
  return s;
}

static void test_form(batten_context *ctx) {
  enum { COUNT = 2500 }; /* more than a block of differences */
  static double points[COUNT * 3], values[COUNT], gradients[COUNT * 3], hessians[COUNT * 9];
  wave w = {0};
  uint64_t seed = 9;
  batten_solid *s = make(ctx, &w, 2), *moved = NULL;
  batten_carrier *c = NULL, *ball = NULL, *both = NULL;
  for (size_t i = 0; i < COUNT * 3; i++) points[i] = 2 * t_uniform(&seed) - 1;
  T_OK(batten_solid_evaluate(ctx, s, COUNT, points, values, gradients, hessians), ctx);
  double worst = 0;
  for (size_t i = 0; i < COUNT; i++) {
    double x = points[3 * i], y = points[3 * i + 1];
    const double want[9] = {-2 - 6 * x * y, -3 * x * x, 0, -3 * x * x, -2, 0, 0, 0, -2};
    for (size_t k = 0; k < 9; k++) worst = fmax(worst, fabs(hessians[9 * i + k] - want[k]));
  }
  /* h = 1e-5 sqrt 12: its square, and 1e-16 / h. */
  T_RATIO(worst, 1e-9, "Hessians by differences of gradients");
  T_OK(batten_solid_evaluate(ctx, s, COUNT, points, NULL, NULL, hessians), ctx);
  T_CHECK(batten_solid_kind_of(s) == BATTEN_SOLID_TREE && batten_solid_dimension(s) == 3 &&
              batten_solid_sign(s) == 1 && batten_solid_depth(s) == 2 && !batten_solid_spline(s) &&
              !batten_solid_carrier(s),
          "kind and parts");
  T_CHECK(batten_solid_state(s, &wave_form) == &w && !batten_solid_state(s, &other_form),
          "state of its own form only");
  T_OK(batten_carrier_ball(ctx, 3, tip, 0.5, &ball), ctx);
  T_STATUS(batten_solid_with_carrier(ctx, s, ball, &moved), BATTEN_E_INVALID, ctx,
           "solid: of other solids, it has no carrier");
  T_OK(batten_carrier_solid(ctx, s, &c), ctx);
  T_OK(batten_carrier_union(ctx, c, ball, 0, &both), ctx);
  double box[6] = {0.2, 0.1, -0.3, 0.4, 0.3, 0.1}, of_solid[2], of_carrier[2], of_union[2], f, at[3] = {0.3, 0.2, 0};
  T_OK(batten_solid_bounds(ctx, s, 1, box, of_solid), ctx);
  T_OK(batten_carrier_bounds(ctx, c, 1, box, of_carrier), ctx);
  T_OK(batten_carrier_bounds(ctx, both, 1, box, of_union), ctx);
  T_OK(batten_carrier_evaluate(ctx, both, 1, at, &f, NULL, NULL), ctx);
  T_CHECK(of_solid[0] == of_carrier[0] && of_solid[1] == of_carrier[1], "bounds of a solid as a carrier are its own");
  T_CHECK(of_union[0] <= f && f <= of_union[1] && of_union[0] >= of_solid[0], "bounds of its union: %g <= %g <= %g",
          of_union[0], f, of_union[1]);
  batten_solid *again = batten_solid_retain(s);
  batten_solid_free(s);
  batten_solid_free(again);
  batten_carrier_free(c);
  T_CHECK(w.released == 0, "the union keeps the solid");
  batten_carrier_free(both);
  batten_carrier_free(ball);
  T_CHECK(w.released == 1, "the last owner releases the state, once");
  s = make(ctx, &w, 64);
  T_STATUS(batten_carrier_solid(ctx, s, &c), BATTEN_E_TOO_LARGE, ctx, "solid: nested 65 levels deep");
  batten_solid_free(s);
}

/* ---- bounds -------------------------------------------------------------------------------------- */

static batten_solid *fit(batten_context *ctx, batten_status *st) {
  enum { COUNT = 120 };
  static double points[COUNT * 3];
  scene_sphere_points(3, COUNT, points);
  batten_solid_options o = batten_solid_options_default();
  o.check_cells = 8;
  o.spline.loo_samples = 0;
  batten_solid *s = NULL;
  *st = batten_solid_fit(ctx, 3, COUNT, points, &o, &s, NULL);
  return s;
}

/* Bounds of a solid that is there already, so that what fails is theirs: arg is the solid's carrier in a union. */
static batten_status bound(batten_context *ctx, void *arg) {
  const double boxes[12] = {0, 0, 0, 1, 1, 1, -0.1, 0.9, 0, 0.1, 1, 0};
  double ranges[4];
  return batten_carrier_bounds(ctx, arg, 2, boxes, ranges);
}

static void test_bounds(batten_context *ctx) {
  enum { COUNT = 1000 };
  static double boxes[COUNT * 6], one[COUNT * 2], two[COUNT * 2];
  batten_status st;
  batten_solid *s = fit(ctx, &st);
  T_CHECK(st >= 0, "solid of 120 points");
  uint64_t seed = 4;
  for (size_t i = 0; i < COUNT; i++)
    for (size_t k = 0; k < 3; k++) {
      boxes[6 * i + k] = 3 * t_uniform(&seed) - 1.5;
      boxes[6 * i + 3 + k] = boxes[6 * i + k] + 0.3 * t_uniform(&seed);
    }
  batten_context *serial = t_context(NULL, NULL, 1);
  T_OK(batten_solid_bounds(ctx, s, COUNT, boxes, one), ctx);
  T_OK(batten_solid_bounds(serial, s, COUNT, boxes, two), serial);
  T_CHECK(!memcmp(one, two, sizeof one), "the same bits on one thread and on two");
  for (size_t i = 0; i < COUNT; i++) (void)batten_solid_bounds(serial, s, 1, boxes + 6 * i, two + 2 * i);
  T_CHECK(!memcmp(one, two, sizeof one), "the same bits one by one");
  batten_context_free(serial);

  double range[2] = {7, 7};
  T_OK(batten_solid_bounds(ctx, s, 0, NULL, NULL), ctx);
  T_STATUS(batten_solid_bounds(ctx, NULL, 1, boxes, range), BATTEN_E_INVALID, ctx, "solid: NULL");
  T_STATUS(batten_solid_bounds(ctx, s, 1, NULL, range), BATTEN_E_INVALID, ctx, "boxes: NULL; give [1][2][3] numbers");
  T_STATUS(batten_solid_bounds(ctx, s, 1, boxes, NULL), BATTEN_E_INVALID, ctx, "ranges: NULL");
  T_STATUS(batten_solid_bounds(ctx, s, SIZE_MAX / 2, boxes, range), BATTEN_E_TOO_LARGE, ctx, "count: ");
  T_STATUS(batten_solid_bounds(ctx, s, 1, (double[]){0, 1, 0, 1, 0, 1}, range), BATTEN_E_INVALID, ctx,
           "boxes[0]: from 1 to 0 along axis 1");
  T_STATUS(batten_carrier_bounds(ctx, NULL, 1, boxes, range), BATTEN_E_INVALID, ctx, "carrier: NULL");
  T_STATUS(batten_carrier_bounds(ctx, batten_solid_carrier(s), 1, (double[]){0, 0, 0, 1, NAN, 1}, range),
           BATTEN_E_INVALID, ctx, "boxes[0]: from 0 to nan along axis 1");
  T_STATUS(batten_spline_bounds(ctx, NULL, 1, boxes, range), BATTEN_E_INVALID, ctx, "s: NULL");
  T_STATUS(batten_spline_bounds(ctx, batten_solid_spline(s), 1, (double[]){0, 0, 0, 1, 1, INFINITY}, range),
           BATTEN_E_INVALID, ctx, "boxes[0]: from 0 to inf along axis 2");
  T_CHECK(range[0] == 7 && range[1] == 7, "nothing is put out on failure");
  T_OK(batten_solid_bounds(ctx, s, 1, (double[]){-1e200, 0, 0, 1e200, 1, 1}, range), ctx);
  T_CHECK(range[0] < -1e300 && range[1] >= 0, "a box that overflows: %g, %g", range[0], range[1]);

  batten_carrier *c = NULL, *ball = NULL, *both = NULL;
  T_OK(batten_carrier_solid(ctx, s, &c), ctx);
  T_OK(batten_carrier_ball(ctx, 3, tip, 0.5, &ball), ctx);
  T_OK(batten_carrier_intersection(ctx, c, ball, 0, &both), ctx);
  t_fail_every_allocation("bounds", bound, both);
  batten_carrier_free(both);
  batten_carrier_free(ball);
  batten_carrier_free(c);
  batten_solid_free(s);
}

/* A field of the host's: without bounds nothing is known, with them what it says. */
static batten_status narrow(const void *user, batten_context *ctx, size_t count, const double *boxes,
                            double *ranges) {
  (void)ctx;
  (void)boxes;
  for (size_t i = 0; i < 2 * count; i++) ranges[i] = *(const double *)user + (double)(i % 2);
  return BATTEN_OK;
}

static void test_callback(batten_context *ctx) {
  double five = 5, range[2];
  const double box[6] = {0, 0, 0, 1, 1, 1};
  wave w = {0};
  batten_field f = {.dimension = 3, .order = 1, .evaluate = wave_evaluate, .user = &w};
  batten_carrier *c = NULL;
  T_OK(batten_carrier_callback(ctx, &f, 1e-4, &c), ctx);
  T_OK(batten_carrier_bounds(ctx, c, 1, box, range), ctx);
  T_CHECK(range[0] == -INFINITY && range[1] == INFINITY, "a callback without bounds may do anything");
  batten_carrier_free(c);
  f.bounds = narrow;
  f.user = &five;
  T_OK(batten_carrier_callback(ctx, &f, 1e-4, &c), ctx);
  T_OK(batten_carrier_bounds(ctx, c, 1, box, range), ctx);
  T_CHECK(range[0] == 5 && range[1] == 6, "a callback's bounds are handed on");
  batten_carrier_free(c);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_form(ctx);
  test_bounds(ctx);
  test_callback(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
