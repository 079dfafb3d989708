/* Contours that no surface can go through: errors that name what is wrong, and what to do. */
#include "../../kernel/loft/loft_inner.h"
#include "loft_scenes.h"
#include "tap.h"

/* Cubic arcs over [0, 1]: knots 0.25, 0.5, 0.75 as often as `fold` says. */
static batten_curve *make_arc(batten_context *ctx, unsigned degree, unsigned fold, double turn, double start) {
  double knots[64], points[128];
  size_t count = 0;
  for (unsigned k = 0; k <= degree; k++) knots[count++] = 0;
  for (int b = 1; b < 4; b++)
    for (unsigned k = 0; k < fold; k++) knots[count++] = b / 4.0;
  for (unsigned k = 0; k <= degree; k++) knots[count++] = 1;
  for (size_t j = 0; j + degree + 1 < count; j++) {
    double greville = 0;
    for (unsigned k = 1; k <= degree; k++) greville += knots[j + k] / degree;
    points[2 * j] = cos(start + turn * greville);
    points[2 * j + 1] = sin(start + turn * greville);
  }
  batten_curve *out = NULL;
  if (batten_curve_create(ctx, &(batten_curve_form){degree, count, knots, points, 0}, &out) < 0) abort();
  return out;
}

/* A closed one of four spans around a square, `way` 1 counter-clockwise, with a corner where it closes if so. */
static batten_curve *make_ring(batten_context *ctx, int way, double corner) {
  const double knots[] = {0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1};
  double points[] = {0, -1 - corner, 1, -1, 1, 1, -1, 1, -1, -1, 0, -1 - corner};
  for (size_t j = 0; j < 6; j++) points[2 * j] *= way;
  batten_curve *out = NULL;
  if (batten_curve_create(ctx, &(batten_curve_form){2, 9, knots, points, 1}, &out) < 0) abort();
  return out;
}

static batten_status make(batten_context *ctx, const batten_curve *a, const batten_curve *b,
                          const batten_loft_options *opt) {
  const batten_curve *contours[3] = {a, a, b};
  const double heights[3] = {0, 1, 2};
  const batten_loft_options plain = batten_loft_options_default();
  loft_stack s = {0};
  batten_status st = loft_stack_make(ctx, 3, contours, heights, opt ? opt : &plain, &s);
  loft_stack_free(ctx, &s);
  return st;
}

static void test_heights(batten_context *ctx, const batten_curve *arc) {
  const batten_curve *contours[3] = {arc, arc, arc};
  const batten_loft_options opt = batten_loft_options_default();
  const struct {
    double heights[3];
    const char *text;
  } cases[] = {
      {{0, 1, 1}, "heights[2]: 1 is not above heights[1], 1; sort"},
      {{0, 2, 1}, "heights[2]: 1 is not above heights[1], 2"},
      {{0, NAN, 1}, "heights[1]: nan; give finite"},
      {{0, 1, INFINITY}, "heights[2]: inf"},
      {{-1.5e308, 0, 1.5e308}, "heights[2]: 1.5e+308 is further from heights[0]"},
      {{-1e30, 1, 2}, "do not differ to rounding seen from heights[0]"},
  };
  loft_stack s = {0};
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
    T_STATUS(loft_stack_make(ctx, 3, contours, cases[k].heights, &opt, &s), BATTEN_E_INVALID, ctx, cases[k].text);
  const double heights[3] = {0, 1, 2};
  T_STATUS(loft_stack_make(ctx, 1, contours, heights, &opt, &s), BATTEN_E_INVALID, ctx, "count: 1 contours; give 2");
  T_STATUS(loft_stack_make(ctx, 3, NULL, heights, &opt, &s), BATTEN_E_INVALID, ctx, "contours: NULL; give 3");
  T_STATUS(loft_stack_make(ctx, 3, contours, NULL, &opt, &s), BATTEN_E_INVALID, ctx, "heights: NULL; give 3");
  contours[1] = NULL;
  T_STATUS(loft_stack_make(ctx, 3, contours, heights, &opt, &s), BATTEN_E_INVALID, ctx, "contours[1]: NULL");
  T_CHECK(!s.contours && !s.notes, "the result is untouched");
}

static void test_contours(batten_context *ctx, const batten_curve *arc) {
  batten_curve *bad = NULL;
  batten_curve *ring = make_ring(ctx, 1, 0);
  T_STATUS(make(ctx, arc, ring, NULL), BATTEN_E_INVALID, ctx, "contours[2]: closed, but contours[0] is open");
  T_STATUS(make(ctx, ring, arc, NULL), BATTEN_E_INVALID, ctx, "contours[2]: open, but contours[0] is closed");
  const double domain[2] = {0, 2}, zero[4] = {0, 0, 0, 0}, shift[2] = {3, 4};
  T_OK(batten_curve_transform(ctx, arc, NULL, NULL, domain, &bad), ctx);
  T_STATUS(make(ctx, arc, bad, NULL), BATTEN_E_INVALID, ctx,
           "contours[2]: from t = 0 to 2, but contours[0] from 0 to 1; bring it there by batten_curve_transform");
  batten_curve_free(bad);
  T_OK(batten_curve_transform(ctx, arc, zero, shift, NULL, &bad), ctx);
  T_STATUS(make(ctx, arc, bad, NULL), BATTEN_E_INVALID, ctx, "contours[2]: all its control points are (3, 4)");
  batten_curve_free(bad);
  bad = make_arc(ctx, 1, 1, 1, 0);
  T_STATUS(make(ctx, arc, bad, NULL), BATTEN_E_INVALID, ctx, "contours[2]: of degree 1, a polygon");
  batten_curve_free(bad);
  const double big[4] = {4e307, 0, 0, 4e307}, right[2] = {1.7e308, 0}, left[2] = {-1.7e308, 0};
  const double small[4] = {1e306, 0, 0, 1e306};
  batten_curve *other = NULL;
  T_OK(batten_curve_transform(ctx, arc, small, right, NULL, &bad), ctx);
  T_OK(batten_curve_transform(ctx, arc, small, left, NULL, &other), ctx);
  T_STATUS(make(ctx, other, bad, NULL), BATTEN_E_INVALID, ctx, "is larger than a double can say; scale them");
  batten_curve_free(bad);
  batten_curve_free(other);
  T_OK(batten_curve_transform(ctx, arc, big, NULL, NULL, &bad), ctx);
  T_OK(make(ctx, bad, bad, NULL), ctx);
  batten_curve_free(bad);
  batten_curve_free(ring);
}

static void test_smoothness(batten_context *ctx, const batten_curve *arc) {
  batten_loft_options two = batten_loft_options_default();
  two.smooth_z = 2;
  batten_curve *corner = make_arc(ctx, 3, 3, 3, 0), *once = make_arc(ctx, 3, 2, 3, 0),
               *quadratic = make_arc(ctx, 2, 1, 3, 0);
  T_STATUS(make(ctx, arc, corner, NULL), BATTEN_E_INVALID, ctx,
           "contours[2]: at the knot 0.25, which is there 3 times, its tangent jumps");
  T_STATUS(make(ctx, arc, once, &two), BATTEN_E_INVALID, ctx,
           "contours[2]: at the knot 0.25, which is there 2 times, its second derivative jumps");
  T_STATUS(make(ctx, quadratic, quadratic, &two), BATTEN_E_INVALID, ctx,
           "opt.smooth_z: 2, but contours of degree 2 have one");
  T_OK(make(ctx, arc, once, NULL), ctx);
  batten_curve *ring = make_ring(ctx, 1, 0), *pointed = make_ring(ctx, 1, 0.3);
  T_OK(make(ctx, ring, ring, NULL), ctx);
  T_STATUS(make(ctx, ring, pointed, NULL), BATTEN_E_INVALID, ctx,
           "contours[2]: where it closes, at t = 0, its tangent jumps");
  /* Knots are told as they were given, not as they are after raising to the highest degree. */
  batten_curve *broken = make_arc(ctx, 2, 2, 3, 0);
  T_STATUS(make(ctx, arc, broken, NULL), BATTEN_E_INVALID, ctx,
           "contours[2]: at the knot 0.25, which is there 2 times, its tangent jumps");
  batten_curve_free(broken);
  batten_curve_free(pointed);
  batten_curve_free(ring);
  batten_curve_free(quadratic);
  batten_curve_free(once);
  batten_curve_free(corner);
}

static void test_directions(batten_context *ctx) {
  for (int k = 1; k <= 5; k++) {
    batten_curve *arc = make_arc(ctx, 3, 1, k, 0.3), *turned = make_arc(ctx, 3, 1, k, 0.3 + 2.2), *reversed = NULL;
    T_OK(batten_curve_reverse(ctx, arc, &reversed), ctx);
    T_STATUS(make(ctx, arc, reversed, NULL), BATTEN_E_INVALID, ctx,
             "contours[2]: runs against contours[1] for most of its length; reverse it by batten_curve_reverse");
    T_OK(make(ctx, arc, turned, NULL), ctx);
    batten_curve_free(arc);
    batten_curve_free(turned);
    batten_curve_free(reversed);
  }
  batten_curve *ring = make_ring(ctx, 1, 0), *other = make_ring(ctx, -1, 0);
  T_STATUS(make(ctx, ring, other, NULL), BATTEN_E_INVALID, ctx,
           "contours[2]: runs against contours[1], one clockwise and the other counter-clockwise; reverse it");
  batten_curve_free(other);
  batten_curve_free(ring);
  /* Loops beyond crossings can enclose more than the rest: the areas of the last two differ in sign, their turns do
   * not. */
  loft_rule rule = loft_rule_random(466);
  loft_scene s = loft_scene_make(ctx, &rule);
  batten_loft *loft = NULL;
  batten_status st =
      batten_loft_build(ctx, s.count, (const batten_curve *const *)s.contours, s.heights, NULL, &loft, NULL, NULL);
  T_CHECK(st >= 0, "closed contours that cross themselves: %s", st ? batten_error(ctx) : "");
  batten_loft_free(loft);
  loft_scene_free(&s);
}

static void test_slopes(batten_context *ctx, const batten_curve *arc) {
  batten_loft_options opt = batten_loft_options_default();
  batten_curve *high = make_arc(ctx, 4, 1, 2, 0), *line = make_arc(ctx, 1, 1, 2, 0), *ring = make_ring(ctx, 1, 0);
  batten_curve *late = NULL, *steep = NULL;
  const double domain[2] = {1, 2}, matrix[4] = {1e300, 0, 0, 1e300};
  T_OK(batten_curve_transform(ctx, arc, NULL, NULL, domain, &late), ctx);
  T_OK(batten_curve_transform(ctx, arc, matrix, NULL, NULL, &steep), ctx);
  opt.slopes[1] = high;
  T_STATUS(make(ctx, arc, arc, &opt), BATTEN_E_INVALID, ctx, "opt.slopes[1]: of degree 4, the contours of 3");
  opt.slopes[1] = ring;
  T_STATUS(make(ctx, arc, arc, &opt), BATTEN_E_INVALID, ctx, "opt.slopes[1]: closed, but contours[0] is open");
  opt.slopes[1] = late;
  T_STATUS(make(ctx, arc, arc, &opt), BATTEN_E_INVALID, ctx, "opt.slopes[1]: from t = 1 to 2");
  opt.slopes[1] = steep;
  T_STATUS(make(ctx, arc, arc, &opt), BATTEN_E_INVALID, ctx, "opt.slopes[1]: control point 0");
  opt.slopes[1] = line;
  T_STATUS(make(ctx, arc, arc, &opt), BATTEN_E_INVALID, ctx,
           "opt.slopes[1]: at the knot 0.25, which is there 1 times, its tangent jumps");
  T_CHECK(strstr(batten_error(ctx), "give one without that jump, or NULL"), "slopes are not split");
  opt.slopes[1] = arc;
  T_OK(make(ctx, arc, arc, &opt), ctx);
  batten_curve *curves[] = {high, line, ring, late, steep};
  for (size_t k = 0; k < 5; k++) batten_curve_free(curves[k]);
}

/* A proof of nothing is no success where contours bend; where none does there is nothing to prove. */
static void test_nothing_proven(batten_context *ctx) {
  const double heights[3] = {0, 1, 2}, small[4] = {1e-9, 0, 0, 1e-9};
  const double knots[] = {0, 0, 0, 0.5, 1, 1, 1}, line[] = {0, 0, 1, 0, 2, 0, 3, 0};
  batten_curve *ring = make_ring(ctx, 1, 0), *tiny = NULL, *straight = NULL;
  T_OK(batten_curve_transform(ctx, ring, small, NULL, NULL, &tiny), ctx);
  T_OK(batten_curve_create(ctx, &(batten_curve_form){2, 7, knots, line, 0}, &straight), ctx);
  const batten_curve *rings[3] = {ring, tiny, ring}, *lines[3] = {straight, straight, straight};
  batten_loft *loft = NULL;
  batten_loft_info info;
  T_STATUS(batten_loft_build(ctx, 3, rings, heights, NULL, &loft, NULL, &info), BATTEN_W_ACCURACY, ctx,
           "nothing is proven of the sections");
  T_CHECK(info.sign_pairs == 0 && !info.certified, "%zu pairs beside a contour of 1e-9, and no proof",
          info.sign_pairs);
  batten_loft_free(loft);
  loft = NULL;
  T_OK(batten_loft_build(ctx, 3, lines, heights, NULL, &loft, NULL, &info), ctx);
  T_CHECK(info.sign_pairs == 0, "straight contours have no sign to keep");
  batten_loft_free(loft);
  batten_curve_free(straight);
  batten_curve_free(tiny);
  batten_curve_free(ring);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_curve *arc = make_arc(ctx, 3, 1, 3, 0);
  test_heights(ctx, arc);
  test_contours(ctx, arc);
  test_smoothness(ctx, arc);
  test_directions(ctx);
  test_slopes(ctx, arc);
  test_nothing_proven(ctx);
  batten_curve_free(arc);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
