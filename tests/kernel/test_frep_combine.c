/* The algebra of solids: leaves of its own, set operations, blends, negation, metamorphosis. */
#include "frep/frep_inner.h"
#include "frep_checks.h"

static double value_at(batten_context *ctx, const batten_frep *a, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  return batten_frep_evaluate(ctx, a, 1, p, &f, NULL) == BATTEN_OK ? f : NAN;
}

/* Two balls and a cone that cross. */
typedef struct parts3 {
  batten_frep *ball, *other, *cone;
} parts3;
static parts3 make_parts(batten_context *ctx) {
  parts3 p = {0};
  T_OK(batten_frep_ball(ctx, 3, (double[]){0, 0, 0}, 1, &p.ball), ctx);
  T_OK(batten_frep_ball(ctx, 3, (double[]){0.8, 0.3, -0.1}, 0.7, &p.other), ctx);
  T_OK(batten_frep_cone(ctx, (double[]){-0.5, 0.1, -0.9}, (double[]){0.2, 0.3, 1.1}, 0.6, 0.2, &p.cone), ctx);
  return p;
}
static void free_parts(parts3 p) {
  batten_frep_free(p.ball);
  batten_frep_free(p.other);
  batten_frep_free(p.cone);
}

static void test_leaves(batten_context *ctx) {
  parts3 p = make_parts(ctx);
  frep_check(ctx, "ball", p.ball, 2, 0, 1e-8, 50000);
  frep_check(ctx, "cone", p.cone, 2, 0.01, 1e-8, 50000);
  free_parts(p);
  batten_frep *a = NULL;
  T_OK(batten_frep_cone(ctx, (double[]){0, 0, 0}, (double[]){0, 0, 4}, 3, 0, &a), ctx);
  /* by hand: mantle from (3, 0) to (0, 4), of normal (0.8, 0.6) */
  double worst = fabs(value_at(ctx, a, 0, 0, 0.5) - 0.5);
  worst = fmax(worst, fabs(value_at(ctx, a, 0, 1.5 + 0.8, 2 + 0.6) + 1));
  worst = fmax(worst, fabs(value_at(ctx, a, 0, 0, 6) + 2));
  worst = fmax(worst, fabs(value_at(ctx, a, 6, 0, -4) + 5));
  worst = fmax(worst, fabs(value_at(ctx, a, 2, 0, -3) + 3));
  T_RATIO(worst, 1e-14, "cone at points by hand");
  batten_frep_free(a);
  /* cones that are all but a disc: outward directions lie within 1e-9 of the axis */
  T_OK(batten_frep_cone(ctx, (double[]){0, 0, 0}, (double[]){0, 0, 1e-9}, 1, 0, &a), ctx);
  frep_check_bounds(ctx, "flat cone", a, 2, 50000, 3);
  batten_frep_free(a);
  double lower[3], upper[3];
  T_OK(batten_frep_cone(ctx, (double[]){0, 0, 0}, (double[]){1e-9, 0, 1}, 1, 1, &a), ctx);
  T_CHECK(frep_structural_box(a, lower, upper), "a cone off the z axis by 1e-9 has a box");
  T_CHECK(value_at(ctx, a, 1, 0, -0.9999e-9) >= 0 && lower[2] <= -0.9999e-9, "from %.3g: it holds the rim", lower[2]);
  batten_frep_free(a);
  T_OK(batten_frep_cone(ctx, (double[]){1e-160, 0, 0}, (double[]){0, 0, 0}, 1, 1, &a), ctx);
  frep_check_bounds(ctx, "cone of a length whose square vanishes", a, 2, 1024, 4);
  T_RATIO(fabs(value_at(ctx, a, 0, 3, 0) + 2), 1e-15, "it is a disc");
  batten_frep_free(a);
  T_OK(batten_frep_ball(ctx, 2, (double[]){0.1, 0.2}, 0.5, &a), ctx);
  frep_check(ctx, "disc", a, 1, 0, 1e-8, 20000);
  batten_frep_free(a);
  T_OK(batten_frep_gyroid(ctx, 1.3, 0.2, &a), ctx);
  frep_check(ctx, "gyroid", a, 2, 0.01, 1e-7, 50000);
  batten_frep_free(a);
}

static void test_operations(batten_context *ctx) {
  const double alphas[] = {1, 0, 0.5, -0.7};
  const char *names[] = {"union", "intersection", "difference"};
  parts3 p = make_parts(ctx);
  for (int operation = 0; operation < 3; operation++)
    for (int i = 0; i < 4; i++) {
      char what[64];
      batten_frep *a = NULL;
      snprintf(what, sizeof what, "%s, alpha %g", names[operation], alphas[i]);
      T_OK(batten_frep_combine(ctx, (batten_frep_operation)operation, p.ball, p.cone, alphas[i], &a), ctx);
      frep_check(ctx, what, a, 2, 0.01, 1e-7, 25600);
      T_CHECK(batten_frep_is_distance(a) == (alphas[i] == 1), "%s is a distance where it is max or min", what);
      batten_frep_free(a);
      snprintf(what, sizeof what, "%s, blend %d", names[operation], i);
      T_OK(batten_frep_blend(ctx, (batten_frep_operation)operation, p.ball, p.cone, i % 2 ? -0.2 : 0.3, 0.2 + i,
                             0.3 + 2 * i, &a),
           ctx);
      frep_check(ctx, what, a, 2, 0.01, 1e-7, 25600);
      batten_frep_free(a);
    }
  free_parts(p);
}

/* -(a | b) = -a & -b and its twin, to the bit, for every alpha; a - b = a & -b. */
static void test_identities(batten_context *ctx) {
  enum { COUNT = 2000 };
  static double x[3 * COUNT], f[2][COUNT];
  uint64_t seed = 5;
  for (size_t i = 0; i < 3 * COUNT; i++) x[i] = 4 * t_uniform(&seed) - 2;
  parts3 p = make_parts(ctx);
  size_t different = 0;
  for (int i = 0; i < 4; i++)
    for (int which = 0; which < 3; which++) {
      const double alpha = (const double[]){1, 0, 0.5, -0.9}[i];
      batten_frep *not_a = NULL, *not_b = NULL, *left = NULL, *right = NULL, *turned = NULL;
      batten_frep_negation(ctx, p.ball, &not_a);
      batten_frep_negation(ctx, p.cone, &not_b);
      batten_frep_combine(ctx, (batten_frep_operation)which, p.ball, p.cone, alpha, &left);
      if (which < 2) {
        batten_frep_combine(ctx, (batten_frep_operation)(1 - which), not_a, not_b, alpha, &turned);
        batten_frep_negation(ctx, turned, &right);
      } else {
        batten_frep_combine(ctx, BATTEN_FREP_INTERSECTION, p.ball, not_b, alpha, &right);
      }
      T_OK(batten_frep_evaluate(ctx, left, COUNT, x, f[0], NULL), ctx);
      T_OK(batten_frep_evaluate(ctx, right, COUNT, x, f[1], NULL), ctx);
      for (size_t k = 0; k < COUNT; k++) different += f[0][k] != f[1][k];
      batten_frep_free(not_a);
      batten_frep_free(not_b);
      batten_frep_free(left);
      batten_frep_free(right);
      batten_frep_free(turned);
    }
  T_CHECK(different == 0, "De Morgan, and difference as intersection, to the bit (%zu differ)", different);
  free_parts(p);
}

/* Each of f and g taken apart: t = 0 and 1 to the bit, between as a mean. */
static void test_morph(batten_context *ctx) {
  enum { COUNT = 500 };
  static double x[3 * COUNT], f[5][COUNT], df[4][3 * COUNT];
  uint64_t seed = 6;
  for (size_t i = 0; i < 3 * COUNT; i++) x[i] = 4 * t_uniform(&seed) - 2;
  parts3 p = make_parts(ctx);
  batten_frep *m[3] = {NULL};
  for (int i = 0; i < 3; i++) T_OK(batten_frep_morph(ctx, p.ball, p.cone, i * 0.5, &m[i]), ctx);
  T_OK(batten_frep_evaluate(ctx, p.ball, COUNT, x, f[0], df[0]), ctx);
  T_OK(batten_frep_evaluate(ctx, p.cone, COUNT, x, f[1], df[1]), ctx);
  T_OK(batten_frep_evaluate(ctx, m[0], COUNT, x, f[2], df[2]), ctx);
  T_OK(batten_frep_evaluate(ctx, m[2], COUNT, x, f[3], df[3]), ctx);
  T_OK(batten_frep_evaluate(ctx, m[1], COUNT, x, f[4], NULL), ctx);
  T_CHECK(!memcmp(f[0], f[2], sizeof f[0]) && !memcmp(f[1], f[3], sizeof f[0]) &&
              !memcmp(df[0], df[2], sizeof df[0]) && !memcmp(df[1], df[3], sizeof df[0]),
          "t = 0 and t = 1 are the ends to the bit");
  double ends[4], own[4];
  const double box[6] = {-0.1, 0.2, 0.3, 0.2, 0.4, 0.3};
  for (int i = 0; i < 2; i++) {
    T_OK(batten_frep_bounds(ctx, m[2 * i], 1, box, ends + 2 * i), ctx);
    T_OK(batten_frep_bounds(ctx, i ? p.cone : p.ball, 1, box, own + 2 * i), ctx);
  }
  T_CHECK(memcmp(ends, own, sizeof own) == 0, "and so are their bounds");
  double worst = 0;
  for (size_t i = 0; i < COUNT; i++) worst = fmax(worst, fabs(f[4][i] - (f[0][i] + f[1][i]) / 2));
  T_RATIO(worst, 1e-15, "half way is the mean");
  frep_check(ctx, "morph", m[1], 2, 0.01, 1e-7, 20000);
  for (int i = 0; i < 3; i++) batten_frep_free(m[i]);
  free_parts(p);
}

/* Blends leave the parts alone away from the blend. Over a floor, at the distance d from a wall, the surface solves
 * h + d - sqrt(h^2 + d^2) = a0 / (1 + (h / a1)^2 + (d / a2)^2): h <= 1.71 e, e the right side at h = 0. */
static void test_blend_reach(batten_context *ctx) {
  batten_frep *floor = NULL, *wall = NULL, *blend = NULL;
  /* balls so large that they are planes: z < 0 and x < 0 */
  T_OK(batten_frep_ball(ctx, 3, (double[]){0, 0, -1e6}, 1e6, &floor), ctx);
  T_OK(batten_frep_ball(ctx, 3, (double[]){-1e6, 0, 0}, 1e6, &wall), ctx);
  for (int side = 0; side < 2; side++) {
    const double a0 = side ? -0.3 : 0.3;
    batten_frep_operation operation = side ? BATTEN_FREP_INTERSECTION : BATTEN_FREP_UNION;
    T_OK(batten_frep_blend(ctx, operation, floor, wall, a0, 0.9, 0.5, &blend), ctx);
    size_t beyond = 0, counted = 0;
    double e = INFINITY;
    for (int i = 1; i <= 40; i++) {
      double d = 0.25 * i, x = side ? -d : d;
      e = 0.3 / (1 + (d / 0.5) * (d / 0.5));
      if (1.71 * e > d) continue;
      counted++;
      /* d to the outside of the wall material is added, to its inside it is taken away */
      double at = value_at(ctx, blend, x, 0, 0), off = value_at(ctx, blend, x, 0, side ? -1.71 * e : 1.71 * e);
      beyond += side ? !(at < 0 && off > 0) : !(at > 0 && off < 0);
    }
    T_CHECK(beyond == 0 && counted > 35, "a blend moves the surface by under 1.71 e, e down to %g (%zu places)", e,
            counted);
    batten_frep_free(blend);
  }
  batten_frep_free(floor);
  batten_frep_free(wall);
}

/* Widths so small or large that the squares of f / a1 overflow or vanish: no more than the operation, or the same
 * addition everywhere; gradients stay finite. */
static void test_blend_widths(batten_context *ctx) {
  const double widths[3] = {1e-200, 1e-100, 1e200};
  parts3 p = make_parts(ctx);
  batten_frep *plain = NULL, *blend = NULL;
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_UNION, p.ball, p.cone, 0, &plain), ctx);
  for (int i = 0; i < 3; i++) {
    T_OK(batten_frep_blend(ctx, BATTEN_FREP_UNION, p.ball, p.cone, 0.25, widths[i], widths[i], &blend), ctx);
    const double x[3] = {0.3, 0.4, 0.2};
    double f, g, df[3], dg[3];
    bool same = true;
    T_OK(batten_frep_evaluate(ctx, plain, 1, x, &f, df), ctx);
    T_OK(batten_frep_evaluate(ctx, blend, 1, x, &g, dg), ctx);
    for (int k = 0; k < 3; k++) same = same && df[k] == dg[k];
    T_CHECK(g == f + (i == 2 ? 0.25 : 0) && same, "a blend of width %g adds %g", widths[i], g - f);
    frep_check_bounds(ctx, "it", blend, 2, 1024, 8);
    batten_frep_free(blend);
  }
  batten_frep_free(plain);
  free_parts(p);
}

static void test_sharing(batten_context *ctx) {
  enum { MANY = 300 };
  batten_frep *balls[MANY] = {NULL}, *all = NULL, *chain = NULL;
  for (int i = 0; i < MANY; i++) batten_frep_ball(ctx, 2, (double[]){3.0 * i, 0}, 1 + 0.001 * i, &balls[i]);
  T_OK(batten_frep_combine_all(ctx, BATTEN_FREP_UNION, MANY, balls, 1, &all), ctx);
  batten_frep *rest = NULL;
  T_OK(batten_frep_combine_all(ctx, BATTEN_FREP_DIFFERENCE, MANY, balls, 1, &rest), ctx);
  for (int i = 0; i < MANY; i++) batten_frep_free(balls[i]);
  size_t wrong = 0;
  for (int i = 0; i < MANY; i++) {
    wrong += fabs(value_at(ctx, all, 3.0 * i, 0.5, 0) - (0.5 + 0.001 * i)) > 1e-12;
    wrong += (value_at(ctx, rest, 3.0 * i, 0.5, 0) > 0) != (i == 0);
  }
  T_CHECK(wrong == 0, "%d discs: every one stays in the union, and only the first in the difference", MANY);
  T_OK(batten_frep_negation(ctx, all, &chain), ctx);
  batten_status st = BATTEN_OK;
  unsigned levels = 0;
  while (st == BATTEN_OK) {
    batten_frep *next = NULL;
    st = batten_frep_combine(ctx, BATTEN_FREP_UNION, chain, chain, 1, &next);
    if (st == BATTEN_OK) {
      batten_frep_free(chain);
      chain = next;
      levels++;
    }
  }
  T_CHECK(st == BATTEN_E_TOO_LARGE && strstr(batten_error(ctx), "shared ones as often"),
          "a node united with itself again and again is refused after %u levels: %s", levels, batten_error(ctx));
  batten_frep_free(chain);
  T_OK(batten_frep_negation(ctx, all, &chain), ctx);
  st = BATTEN_OK;
  for (levels = 0; st == BATTEN_OK; levels++) {
    batten_frep *next = NULL;
    st = batten_frep_negation(ctx, chain, &next);
    if (st == BATTEN_OK) {
      batten_frep_free(chain);
      chain = next;
    }
  }
  T_CHECK(st == BATTEN_E_TOO_LARGE && strstr(batten_error(ctx), "levels deep"), "%s", batten_error(ctx));
  batten_frep_free(chain);
  batten_frep_free(all);
  batten_frep_free(rest);
}

static void test_bad(batten_context *ctx) {
  batten_frep *a = NULL, *b = NULL, *c = NULL;
  const double o[3] = {0, 0, 0}, z[3] = {0, 0, 1}, bad[3] = {0, NAN, 0};
  T_OK(batten_frep_ball(ctx, 3, o, 1, &a), ctx);
  T_OK(batten_frep_ball(ctx, 2, o, 1, &b), ctx);
  T_STATUS(batten_frep_ball(ctx, 4, o, 1, &c), BATTEN_E_INVALID, ctx, "n: 4; give 2 or 3");
  T_STATUS(batten_frep_ball(ctx, 3, o, 0, &c), BATTEN_E_INVALID, ctx, "radius: 0; give a positive finite number");
  T_STATUS(batten_frep_ball(ctx, 3, bad, 1, &c), BATTEN_E_INVALID, ctx, "center[1]: nan; give a finite number");
  T_STATUS(batten_frep_ball(ctx, 3, NULL, 1, &c), BATTEN_E_INVALID, ctx, "center: NULL; give 3 numbers");
  T_STATUS(batten_frep_ball(ctx, 3, o, 1, NULL), BATTEN_E_INVALID, ctx, "out: NULL; give the place for the node");
  T_STATUS(batten_frep_cone(ctx, o, o, 1, 1, &c), BATTEN_E_INVALID, ctx, "b: at distance 0 from a");
  T_STATUS(batten_frep_cone(ctx, o, z, 0, 0, &c), BATTEN_E_INVALID, ctx, "radius_a, radius_b: both 0");
  T_STATUS(batten_frep_cone(ctx, o, z, 1, -1, &c), BATTEN_E_INVALID, ctx, "radius_b: -1; give a finite radius >= 0");
  T_STATUS(batten_frep_gyroid(ctx, -1, 1, &c), BATTEN_E_INVALID, ctx, "period: -1; give a positive finite number");
  T_STATUS(batten_frep_combine(ctx, BATTEN_FREP_UNION, a, b, 0, &c), BATTEN_E_INVALID, ctx,
           "b: of dimension 2; give a node of dimension 3");
  T_STATUS(batten_frep_combine(ctx, BATTEN_FREP_UNION, NULL, b, 0, &c), BATTEN_E_INVALID, ctx,
           "a: NULL; give a node");
  T_STATUS(batten_frep_combine(ctx, BATTEN_FREP_UNION, a, a, 2, &c), BATTEN_E_INVALID, ctx,
           "alpha: 2; give -1 < alpha <= 1 (0 smooth, 1 max and min)");
  T_STATUS(batten_frep_combine(ctx, (batten_frep_operation)7, a, a, 0, &c), BATTEN_E_INVALID, ctx,
           "operation: 7; give union, intersection or difference");
  T_STATUS(batten_frep_combine_all(ctx, BATTEN_FREP_UNION, 0, NULL, 0, &c), BATTEN_E_INVALID, ctx,
           "count: 0; give at least one node");
  T_STATUS(batten_frep_combine_all(ctx, BATTEN_FREP_UNION, 2, (batten_frep *[2]){a, b}, 0, &c), BATTEN_E_INVALID, ctx,
           "nodes[1]: of another dimension than nodes[0]");
  T_STATUS(batten_frep_blend(ctx, BATTEN_FREP_UNION, a, a, 1, 0, 1, &c), BATTEN_E_INVALID, ctx,
           "a1: 0; give a positive finite number");
  T_STATUS(batten_frep_morph(ctx, a, a, 1.5, &c), BATTEN_E_INVALID, ctx, "t: 1.5; give 0 <= t <= 1");
  double f, range[2], box[6] = {0, 0, 1, 1, 1, 0};
  T_STATUS(batten_frep_evaluate(ctx, a, 1, bad, &f, NULL), BATTEN_E_INVALID, ctx,
           "points[0][1]: nan; give finite coordinates");
  T_STATUS(batten_frep_evaluate(ctx, NULL, 1, o, &f, NULL), BATTEN_E_INVALID, ctx, "a: NULL; give a node");
  T_STATUS(batten_frep_bounds(ctx, a, 1, box, range), BATTEN_E_INVALID, ctx,
           "boxes[0]: from 1 to 0 along axis 2; give finite corners, lower <= upper");
  batten_frep_parts parts = {
      .struct_size = sizeof parts, .kind = BATTEN_FREP_KIND_MORPH, .n = 3, .child_count = 2, .children = {a, a}};
  T_STATUS(batten_frep_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx,
           "parts.number_count: 0; a node \"morph\" takes 1");
  parts.kind = (batten_frep_kind)99;
  T_STATUS(batten_frep_create(ctx, &parts, &c), BATTEN_E_INVALID, ctx, "parts.kind: 99; give a kind of node");
  T_CHECK(c == NULL, "out is untouched on failure");
  batten_frep_free(a);
  batten_frep_free(b);
}

static batten_status build_and_use(batten_context *ctx, void *arg) {
  (void)arg;
  batten_frep *leaf[3] = {NULL}, *node[4] = {NULL};
  const double x[6] = {0.1, 0.2, 0.3, 1, 1, 1}, o[3] = {0, 0, 0}, z[3] = {0, 0, 1};
  double f, df[3], range[2];
  batten_status st = batten_frep_ball(ctx, 3, o, 1, &leaf[0]);
  if (st >= 0) st = batten_frep_cone(ctx, o, z, 1, 0.5, &leaf[1]);
  if (st >= 0) st = batten_frep_gyroid(ctx, 1, 0.1, &leaf[2]);
  if (st >= 0) st = batten_frep_combine_all(ctx, BATTEN_FREP_UNION, 3, leaf, 0, &node[0]);
  if (st >= 0) st = batten_frep_combine_all(ctx, BATTEN_FREP_DIFFERENCE, 3, leaf, 0, &node[1]);
  if (st >= 0) st = batten_frep_blend(ctx, BATTEN_FREP_DIFFERENCE, node[0], node[1], 0.1, 1, 1, &node[2]);
  if (st >= 0) st = batten_frep_morph(ctx, node[2], leaf[0], 0.3, &node[3]);
  if (st >= 0) st = batten_frep_evaluate(ctx, node[3], 1, x, &f, df);
  if (st >= 0) st = batten_frep_evaluate(ctx, node[3], 1, x, NULL, df);
  if (st >= 0) st = batten_frep_bounds(ctx, node[3], 1, x, range);
  for (int i = 0; i < 3; i++) batten_frep_free(leaf[i]);
  for (int i = 0; i < 4; i++) batten_frep_free(node[i]);
  return st;
}

/* So many points that an evaluation goes over several blocks. */
static batten_status evaluate_many(batten_context *ctx, void *arg) {
  enum { COUNT = 10000 };
  static double x[3 * COUNT], f[COUNT], boxes[6 * COUNT], ranges[2 * COUNT];
  batten_frep *a = arg;
  batten_status st = batten_frep_evaluate(ctx, a, COUNT, x, f, NULL);
  return st < 0 ? st : batten_frep_bounds(ctx, a, COUNT, boxes, ranges);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_leaves(ctx);
  test_operations(ctx);
  test_identities(ctx);
  test_morph(ctx);
  test_blend_reach(ctx);
  test_blend_widths(ctx);
  test_sharing(ctx);
  test_bad(ctx);
  t_fail_every_allocation("building and using a tree", build_and_use, NULL);
  batten_frep *a = NULL;
  T_OK(batten_frep_ball(ctx, 3, (double[]){0, 0, 0}, 1, &a), ctx);
  t_cancel_every_progress("evaluating a tree", evaluate_many, a);
  batten_frep_free(a);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
