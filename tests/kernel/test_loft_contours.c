/* Contours as stacks: the same curves, periodic where closed, near knots made equal. */
#include "../loft_scenes.h"

#include "../../kernel/loft/loft_inner.h"
#include "tap.h"

/* x and its derivatives at t in [0, 1], scaled back. */
static void evaluate(const loft_stack *s, const loft_contour *c, double t, double (*out)[2]) {
  const loft_space *p = &c->space;
  size_t span = 0;
  while (span + 1 < p->spans && t >= p->breaks[span + 1]) span++;
  double table[3 * BSPLINE_ORDER];
  bspline_basis(&p->b, p->first[span] + p->degree, t, 2, table);
  for (size_t k = 0; k < 3; k++)
    for (size_t x = 0; x < 2; x++) {
      out[k][x] = k == 0 ? s->middle[x] : 0;
      for (size_t j = 0; j <= p->degree; j++)
        out[k][x] += table[k * (p->degree + 1) + j] * c->points[2 * ((p->first[span] + j) % p->count) + x] / s->unit;
    }
}

/* The largest distance of contour i from a curve with domain [0, 1], over the contours' size; derivatives times
 * powers of the shortest span. */
static double distance_to(batten_context *ctx, const loft_stack *s, size_t i, const batten_curve *curve,
                          size_t order) {
  const loft_contour *c = s->contours + i;
  double most = 0, shortest = 1;
  for (size_t k = 0; k < c->space.spans; k++) shortest = fmin(shortest, c->space.breaks[k + 1] - c->space.breaks[k]);
  batten_curve_form f = batten_curve_get(curve);
  double lower = f.knots[0], length = f.knots[f.knot_count - 1] - lower;
  for (size_t k = 0; k <= 200; k++) {
    double t = ((double)k + 0.5) / 201, at = lower + t * length, mine[3][2], theirs[3][2];
    evaluate(s, c, t, mine);
    if (batten_curve_derivatives(ctx, curve, 2, 1, &at, theirs[0]) < 0) return INFINITY;
    for (size_t d = 0; d <= order; d++)
      for (size_t x = 0; x < 2; x++)
        most = fmax(most, fabs(mine[d][x] - theirs[d][x] * pow(length, (double)d)) * pow(shortest, (double)d));
  }
  return most * s->unit / s->size;
}
static double distance(batten_context *ctx, const loft_stack *s, size_t i, const batten_curve *curve) {
  return distance_to(ctx, s, i, curve, 2);
}

static batten_status make(batten_context *ctx, const loft_scene *scene, const batten_loft_options *opt,
                          loft_stack *out) {
  return loft_stack_make(ctx, scene->count, (const batten_curve *const *)scene->contours, scene->heights, opt, out);
}

static void test_random(batten_context *ctx) {
  double worst = 0, worst_copied = 0;
  size_t closed = 0, smooth[3] = {0}, failed = 0, wrong = 0;
  for (uint64_t seed = 1; seed <= 150; seed++) {
    loft_rule rule = loft_rule_random(seed);
    loft_scene scene = loft_scene_make(ctx, &rule);
    batten_loft_options opt = batten_loft_options_default();
    for (size_t e = 0; e < 2; e++) opt.slopes[e] = scene.slopes[e];
    loft_stack s = {0};
    if (make(ctx, &scene, &opt, &s) < 0) {
      printf("# seed %u: %s\n", (unsigned)seed, batten_error(ctx));
      failed++;
      loft_scene_free(&scene);
      continue;
    }
    if (s.degree != rule.degree || s.smoothness != rule.smoothness || s.closed != rule.closed) {
      printf("# seed %u: degree %u, smoothness %u, %u wanted\n", (unsigned)seed, s.degree, s.smoothness,
             rule.smoothness);
      wrong++;
    }
    closed += s.closed;
    smooth[s.smoothness]++;
    for (size_t i = 0; i < s.count; i++) {
      double off = distance(ctx, &s, i, scene.contours[i]);
      worst = fmax(worst, off);
      if (!s.closed && !rule.slopes) worst_copied = fmax(worst_copied, off);
      if (s.closed && s.contours[i].space.folds[0] > s.degree - s.smoothness) wrong++;
    }
    loft_stack_free(ctx, &s);
    loft_scene_free(&scene);
  }
  T_CHECK(failed == 0, "random stacks are taken: %zu not", failed);
  T_CHECK(wrong == 0 && closed > 20 && smooth[1] > 20 && smooth[2] > 20,
          "with their degree and smoothness (%zu closed, %zu C1, %zu C2)", closed, smooth[1], smooth[2]);
  T_RATIO(worst, 1e-13, "contours and derivatives are the curves");
  T_RATIO(worst_copied, 1e-14, "open ones");
}

/* A closed quadratic of four equal spans around a square: all corners cut, the seam in the middle of a side. By hand:
 * periodic control points are the corners. */
static void test_square(batten_context *ctx) {
  const double knots[] = {0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1};
  const double points[] = {0, -1, 1, -1, 1, 1, -1, 1, -1, -1, 0, -1};
  batten_curve *curves[2] = {NULL, NULL};
  const double heights[2] = {0, 1};
  const batten_loft_options opt = batten_loft_options_default();
  const batten_curve_form form = {2, 9, knots, points, 1};
  T_OK(batten_curve_create(ctx, &form, &curves[0]), ctx);
  T_OK(batten_curve_elevate(ctx, curves[0], 3, &curves[1]), ctx);
  loft_stack s = {0};
  T_OK(loft_stack_make(ctx, 2, (const batten_curve *const *)curves, heights, &opt, &s), ctx);
  T_CHECK(s.degree == 3 && s.smoothness == 1 && s.closed, "degrees are raised to the highest");
  T_RATIO(fmax(distance(ctx, &s, 0, curves[0]), distance(ctx, &s, 1, curves[1])), 1e-15, "both are the square's");
  loft_stack_free(ctx, &s);
  const batten_curve *same[2] = {curves[0], curves[0]};
  T_OK(loft_stack_make(ctx, 2, same, heights, &opt, &s), ctx);
  bool corners = s.contours[0].space.count == 4;
  for (size_t j = 0; corners && j < 8; j++) corners = fabs(s.contours[0].points[j]) == s.unit;
  T_CHECK(corners, "periodic control points are the corners, to the bit");
  loft_stack_free(ctx, &s);
  for (int i = 0; i < 2; i++) batten_curve_free(curves[i]);
}

/* Knots that differ by a little in the second contour, and one near the end. */
static void test_merge(batten_context *ctx) {
  const double a[] = {0, 0, 0, 0, 0.3, 0.7, 1, 1, 1, 1}, b[] = {0, 0, 0, 0, 0.3001, 0.5, 0.7004, 0.9998, 1, 1, 1, 1};
  double p[16], q[16];
  for (size_t j = 0; j < 8; j++) { /* of both about the same parabola */
    double s = j < 6 ? (a[j + 1] + a[j + 2] + a[j + 3]) / 3 : 0, t = (b[j + 1] + b[j + 2] + b[j + 3]) / 3;
    p[2 * j] = s;
    p[2 * j + 1] = s * s;
    q[2 * j] = t;
    q[2 * j + 1] = t * t;
  }
  batten_curve *curves[2] = {NULL, NULL};
  const double heights[2] = {0, 1};
  T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 10, a, p, 0}, &curves[0]), ctx);
  T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 12, b, q, 0}, &curves[1]), ctx);
  batten_loft_options opt = batten_loft_options_default();
  loft_stack s = {0};
  T_OK(loft_stack_make(ctx, 2, (const batten_curve *const *)curves, heights, &opt, &s), ctx);
  T_CHECK(s.contours[1].space.spans == 5 && s.knot_shift == 0, "knots stay that differ by more than the tolerance");
  loft_stack_free(ctx, &s);
  opt.knot_tolerance = 1e-3;
  T_OK(loft_stack_make(ctx, 2, (const batten_curve *const *)curves, heights, &opt, &s), ctx);
  const loft_space *t = &s.contours[1].space;
  T_CHECK(t->spans == 3 + 1 && t->breaks[1] == 0.3 && t->breaks[2] == 0.5 && t->breaks[3] == 0.7,
          "near knots become those of the first contour, one near the end goes");
  double off = distance_to(ctx, &s, 1, curves[1], 0) * s.size;
  T_CHECK(s.knot_shift > 0.2 * off && s.knot_shift < 1e-4, "the contour moves by %.3g, it is told %.3g", off,
          s.knot_shift);
  T_CHECK(distance(ctx, &s, 0, curves[0]) < 1e-14, "the first contour stays");
  loft_stack_free(ctx, &s);
  for (int i = 0; i < 2; i++) batten_curve_free(curves[i]);
}

/* Scaling by powers of two changes no bit; far from the origin points come back. */
static void test_scales(batten_context *ctx) {
  loft_rule rule = {.kind = LOFT_STACK,
                    .degree = 3,
                    .smoothness = 2,
                    .contours = 3,
                    .closed = true,
                    .seed = 5,
                    .decades = 1,
                    .rotation = 0.3};
  loft_scene scene = loft_scene_make(ctx, &rule);
  const batten_loft_options opt = batten_loft_options_default();
  loft_stack s = {0}, t = {0};
  T_OK(make(ctx, &scene, &opt, &s), ctx);
  const double matrix[4] = {0x1p300, 0, 0, 0x1p300}, domain[2] = {-2, 6};
  for (size_t i = 0; i < 3; i++) {
    batten_curve *big = NULL;
    T_OK(batten_curve_transform(ctx, scene.contours[i], matrix, NULL, NULL, &big), ctx);
    batten_curve_free(scene.contours[i]);
    scene.contours[i] = big;
    scene.heights[i] *= 0x1p-200;
  }
  T_OK(make(ctx, &scene, &opt, &t), ctx);
  bool same = true;
  for (size_t i = 0; i < 3; i++)
    same = same && s.contours[i].height == t.contours[i].height &&
           memcmp(s.contours[i].points, t.contours[i].points, 2 * s.contours[i].space.count * sizeof(double)) == 0;
  T_CHECK(same, "powers of two change no bit");
  loft_stack_free(ctx, &t);
  loft_stack_free(ctx, &s);
  loft_scene_free(&scene);

  rule.closed = false;
  scene = loft_scene_make(ctx, &rule);
  const double far[2] = {1e6, -3e5};
  for (size_t i = 0; i < 3; i++) {
    batten_curve *moved = NULL;
    T_OK(batten_curve_transform(ctx, scene.contours[i], NULL, far, domain, &moved), ctx);
    batten_curve_free(scene.contours[i]);
    scene.contours[i] = moved;
  }
  T_OK(make(ctx, &scene, &opt, &s), ctx);
  bool back = true;
  for (size_t i = 0; i < 3; i++) {
    const double *p = batten_curve_get(scene.contours[i]).control_points;
    for (size_t j = 0; j < 2 * s.contours[i].space.count; j++)
      back = back && s.contours[i].points[j] / s.unit + s.middle[j % 2] == p[j];
  }
  T_CHECK(back && s.size >= 1 && s.size < 2, "control points far from the origin come back to the bit");
  T_CHECK(s.domain[0] == -2 && s.domain[1] == 6, "the domain is kept");
  loft_stack_free(ctx, &s);
  loft_scene_free(&scene);
}

/* Bezier pieces that fit smoothly: knots that are there as often as the degree, of which one is enough. */
static void test_pieces(batten_context *ctx) {
  loft_rule rule = {.kind = LOFT_STACK,
                    .degree = 4,
                    .smoothness = 2,
                    .contours = 2,
                    .spans = 6,
                    .seed = 3,
                    .decades = 1.5,
                    .rotation = 0.3};
  loft_scene scene = loft_scene_make(ctx, &rule);
  batten_curve *pieces[2] = {NULL, NULL};
  for (size_t i = 0; i < 2; i++) {
    batten_curve_form f = batten_curve_get(scene.contours[i]);
    double more[64];
    size_t count = 0;
    for (size_t k = 5; k + 5 < f.knot_count; k++) more[count++] = f.knots[k];
    T_OK(batten_curve_insert_knots(ctx, scene.contours[i], count, more, &pieces[i]), ctx);
  }
  const batten_loft_options opt = batten_loft_options_default();
  loft_stack s = {0};
  T_OK(loft_stack_make(ctx, 2, (const batten_curve *const *)pieces, scene.heights, &opt, &s), ctx);
  batten_curve_form f = batten_curve_get(scene.contours[0]);
  T_CHECK(s.smoothness == 2 && s.contours[0].space.count == f.knot_count - 5, "knots that are not needed go");
  T_RATIO(fmax(distance(ctx, &s, 0, scene.contours[0]), distance(ctx, &s, 1, scene.contours[1])), 1e-12,
          "and the curves stay");
  loft_stack_free(ctx, &s);
  for (int i = 0; i < 2; i++) batten_curve_free(pieces[i]);
  loft_scene_free(&scene);
}

static void test_insert(batten_context *ctx) {
  loft_rule rule = {.kind = LOFT_STACK,
                    .degree = 3,
                    .smoothness = 2,
                    .contours = 3,
                    .seed = 8,
                    .slopes = true,
                    .decades = 1,
                    .rotation = 0.3};
  for (int closed = 0; closed < 2; closed++) {
    rule.closed = closed;
    loft_scene scene = loft_scene_make(ctx, &rule);
    batten_loft_options opt = batten_loft_options_default();
    for (size_t e = 0; e < 2; e++) opt.slopes[e] = scene.slopes[e];
    loft_stack s = {0};
    T_OK(make(ctx, &scene, &opt, &s), ctx);
    size_t before = s.contours[0].space.count, spans = s.contours[0].space.spans;
    s.contours[0].flat_above[1] = 1;
    double flat = s.contours[0].space.breaks[1], knots[2] = {flat / 3, 0.77};
    const unsigned folds[2] = {1, 1};
    double slope_before[2] = {s.slopes[0][0], s.slopes[0][1]};
    T_OK(loft_stack_insert(ctx, &s, 0, 2, knots, folds), ctx);
    const loft_contour *c = s.contours;
    T_CHECK(c->space.count == before + 2 && c->space.spans == spans + 2 && s.knots_inserted == 2, "two knots more");
    T_CHECK(!c->flat_above[1] && c->flat_above[2] && c->space.breaks[2] == flat, "flat points go along");
    T_RATIO(distance(ctx, &s, 0, scene.contours[0]), 1e-13, "the contour stays");
    loft_contour slope = *c;
    slope.points = s.slopes[0];
    double jet[3][2], most = 0, factor = s.unit / s.height_unit;
    for (size_t k = 0; k < 100; k++) {
      double t = ((double)k + 0.5) / 100, theirs[2];
      evaluate(&s, &slope, t, jet);
      if (batten_curve_derivatives(ctx, scene.slopes[0], 0, 1, &t, theirs) < 0) theirs[0] = NAN;
      for (size_t x = 0; x < 2; x++) most = fmax(most, fabs((jet[0][x] - s.middle[x]) * s.unit - theirs[x] * factor));
    }
    T_RATIO(most, 1e-13, "and the slope");
    T_CHECK(closed || (slope_before[0] == s.slopes[0][0] && slope_before[1] == s.slopes[0][1]), "its end to the bit");
    loft_stack_free(ctx, &s);
    loft_scene_free(&scene);
  }
}

static batten_status call(batten_context *ctx, void *arg) {
  loft_rule rule = {.kind = LOFT_STACK,
                    .degree = 3,
                    .smoothness = 1,
                    .contours = 3,
                    .spans = 5,
                    .seed = 8,
                    .slopes = true,
                    .decades = 1,
                    .rotation = 0.3,
                    .closed = *(const int *)arg};
  batten_context *own = t_context(NULL, NULL, 1); /* scenes know no failure */
  loft_scene scene = loft_scene_make(own, &rule);
  batten_loft_options opt = batten_loft_options_default();
  opt.knot_tolerance = 1e-3;
  for (size_t e = 0; e < 2; e++) opt.slopes[e] = scene.slopes[e];
  loft_stack s = {0};
  batten_status st = make(ctx, &scene, &opt, &s);
  double knot = 0.123;
  unsigned fold = 1;
  if (st >= 0) st = loft_stack_insert(ctx, &s, 0, 1, &knot, &fold);
  loft_stack_free(ctx, &s);
  loft_scene_free(&scene);
  batten_context_free(own);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_square(ctx);
  test_random(ctx);
  test_merge(ctx);
  test_scales(ctx);
  test_pieces(ctx);
  test_insert(ctx);
  for (int closed = 0; closed < 2; closed++) t_fail_every_allocation("a stack", call, &closed);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
