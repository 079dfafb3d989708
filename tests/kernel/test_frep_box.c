/* The box of a tree: it holds the solid and is tight, whether the structure tells one or bounds alone find it. */
#include "frep_checks.h"

static const double o[3] = {0, 0, 0};

/* The box of a node against the one that is known; frees the node. */
static void check_box(batten_context *ctx, const char *what, batten_frep *a, const double *known) {
  unsigned n = batten_frep_dimension(a);
  double lower[3], upper[3], size = 0, least = INFINITY, most = 0, t = batten_now();
  T_OK(batten_frep_box(ctx, a, lower, upper), ctx);
  t = batten_now() - t;
  for (unsigned k = 0; k < n; k++) size = fmax(size, known[n + k] - known[k]);
  for (unsigned k = 0; k < n; k++) {
    least = fmin(least, fmin(known[k] - lower[k], upper[k] - known[n + k]) / size);
    most = fmax(most, fmax(known[k] - lower[k], upper[k] - known[n + k]) / size);
  }
  T_CHECK(least > 0 && most < 0.015, "%s: the box is wider by %.4f to %.4f of its size (%.0f ms)", what, least, most,
          1e3 * t);
  batten_frep_free(a);
}

static batten_frep *box_at(batten_context *ctx, unsigned n, const double *center, const double *half,
                           const double *rotation) {
  batten_carrier *c = NULL;
  batten_frep *a = NULL;
  T_OK(batten_carrier_box(ctx, n, center, half, rotation, 0, &c), ctx);
  T_OK(batten_frep_carrier(ctx, c, &a), ctx);
  batten_carrier_free(c);
  return a;
}

/* not (not a): the same solid, of which the structure tells nothing. */
static batten_frep *hidden(batten_context *ctx, batten_frep *a) {
  batten_frep *not_a = NULL, *again = NULL;
  T_OK(batten_frep_negation(ctx, a, &not_a), ctx);
  T_OK(batten_frep_negation(ctx, not_a, &again), ctx);
  batten_frep_free(not_a);
  batten_frep_free(a);
  return again;
}

static void test_boxes(batten_context *ctx) {
  const double r = sqrt(0.5), turned[4] = {r, r, -r, r};
  batten_frep *a = NULL, *b = NULL, *c = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){5, 0, -3}, 2, &a), ctx);
  check_box(ctx, "ball", batten_frep_retain(a), (double[]){3, -2, -5, 7, 2, -1});
  check_box(ctx, "ball from bounds alone", hidden(ctx, a), (double[]){3, -2, -5, 7, 2, -1});
  a = box_at(ctx, 3, (double[]){1, 2, 3}, (double[]){0.5, 0.02, 4}, NULL);
  check_box(ctx, "beam from bounds alone", hidden(ctx, a), (double[]){0.5, 1.98, -1, 1.5, 2.02, 7});
  a = box_at(ctx, 2, o, (double[]){1, 1}, turned);
  check_box(ctx, "square on its corner", hidden(ctx, a), (double[]){-2 * r, -2 * r, 2 * r, 2 * r});
  /* the lens of two balls is much smaller than what both boxes share */
  T_OK(batten_frep_ball(ctx, 3, o, 1, &a), ctx);
  T_OK(batten_frep_ball(ctx, 3, (double[]){1, 1, 0}, 1, &b), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_INTERSECTION, a, b, 0, &c), ctx);
  const double h = sqrt(0.5);
  check_box(ctx, "lens of two balls", c, (double[]){0, 0, -h, 1, 1, h});
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_DIFFERENCE, b, a, 1, &c), ctx);
  check_box(ctx, "ball without another", c, (double[]){0, 0, -1, 2, 2, 1});
  /* a blend that adds material: no box from the structure */
  batten_frep *blend = NULL;
  T_OK(batten_frep_blend(ctx, BATTEN_FREP_UNION, a, a, 0.1, 1, 1, &blend), ctx);
  double radius = 1, u;
  do { /* u = 2 f + sqrt(2) |f| + 0.1 / (1 + 2 f^2) = 0 on the axis, f = 1 - radius < 0 */
    double f = 1 - radius;
    u = (2 - sqrt(2)) * f + 0.1 / (1 + 2 * f * f);
    radius += u / 0.6;
  } while (fabs(u) > 1e-12);
  check_box(ctx, "blend", blend, (double[]){-radius, -radius, -radius, radius, radius, radius});
  batten_frep_free(a);
  batten_frep_free(b);
  T_OK(batten_frep_ball(ctx, 2, o, 1, &a), ctx);
  T_OK(batten_frep_offset(ctx, a, -0.3, &b), ctx);
  check_box(ctx, "shrunk disc", b, (double[]){-0.7, -0.7, 0.7, 0.7});
  T_OK(batten_frep_shell(ctx, a, 0.2, &b), ctx);
  check_box(ctx, "shell of a disc", b, (double[]){-1.1, -1.1, 1.1, 1.1});
  batten_frep_free(a);
  batten_carrier *carrier = NULL;
  T_OK(batten_carrier_ball(ctx, 3, o, 1, &carrier), ctx);
  T_OK(batten_frep_carrier(ctx, carrier, &a), ctx);
  batten_carrier_free(carrier);
  T_OK(batten_frep_offset(ctx, a, 0.1, &b), ctx);
  radius = 0.1 + sqrt(1.01);
  check_box(ctx, "offset to first order", b, (double[]){-radius, -radius, -radius, radius, radius, radius});
  batten_frep_free(a);
}

static void test_none(batten_context *ctx) {
  batten_frep *a = NULL, *b = NULL, *c = NULL;
  double lower[3] = {9, 9, 9}, upper[3] = {9, 9, 9};
  T_OK(batten_frep_ball(ctx, 3, o, 1, &a), ctx);
  T_OK(batten_frep_negation(ctx, a, &b), ctx);
  T_STATUS(batten_frep_box(ctx, b, lower, upper), BATTEN_E_NOT_FOUND, ctx, "a: the solid has no end along axis 0");
  batten_frep_free(b);
  T_OK(batten_frep_gyroid(ctx, 1, 0.1, &b), ctx);
  T_STATUS(batten_frep_box(ctx, b, lower, upper), BATTEN_E_NOT_FOUND, ctx, "a: the solid has no end along axis");
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_INTERSECTION, a, b, 1, &c), ctx);
  T_OK(batten_frep_box(ctx, c, lower, upper), ctx);
  T_CHECK(lower[0] > -1.01 && upper[2] < 1.01, "a gyroid in a ball ends with the ball");
  batten_frep_free(b);
  batten_frep_free(c);
  T_OK(batten_frep_ball(ctx, 3, (double[]){3, 0, 0}, 1, &b), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_INTERSECTION, a, b, 0, &c), ctx);
  lower[0] = 9;
  T_STATUS(batten_frep_box(ctx, c, lower, upper), BATTEN_E_NOT_FOUND, ctx, "a: the solid is empty");
  batten_frep_free(b);
  batten_frep_free(c);
  T_OK(batten_frep_offset(ctx, a, -1.01, &b), ctx);
  T_STATUS(batten_frep_box(ctx, b, lower, upper), BATTEN_E_NOT_FOUND, ctx, "a: the solid is empty");
  T_CHECK(lower[0] == 9, "outputs are untouched on failure");
  batten_frep_free(b);
  T_STATUS(batten_frep_box(ctx, a, lower, NULL), BATTEN_E_INVALID, ctx, "upper: NULL; give the place for 3 numbers");
  batten_frep_free(a);
}

static batten_status find_box(batten_context *ctx, void *arg) {
  (void)arg;
  batten_frep *a = NULL, *b = NULL, *c = NULL;
  double lower[3], upper[3];
  batten_status st = batten_frep_ball(ctx, 3, o, 1, &a);
  if (st >= 0) st = batten_frep_negation(ctx, a, &b);
  if (st >= 0) st = batten_frep_negation(ctx, b, &c);
  if (st >= 0) st = batten_frep_box(ctx, c, lower, upper);
  batten_frep_free(a);
  batten_frep_free(b);
  batten_frep_free(c);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_boxes(ctx);
  test_none(ctx);
  t_fail_every_allocation("a tree's box", find_box, NULL);
  t_cancel_every_progress("a tree's box", find_box, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
