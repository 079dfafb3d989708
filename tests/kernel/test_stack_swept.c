/* What moving sections sweep: values, gradients, bounds; the bent and twisted block. */
#include "stack_swept.h"

/* Largest |f| at `count` points of the block's sides, over its length; *mean likewise. */
static double block_error(batten_context *ctx, const swept_case *c, size_t count, const double *turn, double *mean) {
  scene_block b = scene_block_figure4();
  uint64_t seed = 3;
  double worst = 0, sum = 0;
  double *points = calloc(count, 4 * sizeof *points), *values = points + 3 * count;
  for (size_t i = 0; i < count; i++) {
    scene_block_point(&b, t_uniform(&seed), t_uniform(&seed), points + 3 * i);
    if (turn) stack_scene_turn_vector(turn, points + 3 * i);
  }
  batten_status st = stack_swept_evaluate(&c->s, ctx, count, points, values, NULL);
  for (size_t i = 0; i < count; i++) {
    worst = fmax(worst, fabs(values[i]));
    sum += fabs(values[i]);
  }
  free(points);
  *mean = sum / (double)count / scene_block_length(&b);
  return st == BATTEN_OK ? worst / scene_block_length(&b) : INFINITY;
}

/* The block by `count` sections. */
static void make_block(batten_context *ctx, size_t count, double uneven, const double *turn, batten_stack_options o,
                       swept_case *c) {
  scene_block b = scene_block_figure4();
  stack_scene scene = {0};
  stack_scene_block(&scene, &b, count, uneven, 0);
  double omega[64][3], t[64];
  for (size_t i = 0; i < count; i++) {
    double xy[2], unused[3], m[3][3], u = scene_block_local(&b, scene.sections[i].origin, xy);
    scene_block_frame(&b, u, unused, m, omega[i]);
    t[i] = u * scene_block_length(&b);
  }
  if (turn) stack_scene_turn(&scene, turn);
  if (o.rotation == BATTEN_ROTATION_VELOCITY) { /* it is one by the arc's length, not by the chords' */
    o.angular_velocity = omega[0];
    o.parameters = t;
  }
  const rectangle section = {{b.half[0], b.half[1]}};
  T_OK(swept_case_make(ctx, &scene, &o, &section, c), ctx);
  stack_scene_free(&scene);
}

static void test_block(batten_context *ctx) {
  static const struct {
    const char *name;
    size_t count;
    double uneven;
    batten_stack_rotation rotation;
    batten_stack_parameter parameter;
    batten_stack_path path;
    double mean, most;
  } rows[] = {
      {"spherical, root, cubic", 50, 0, BATTEN_ROTATION_SPHERICAL, BATTEN_PARAMETER_ROOT, BATTEN_PATH_CUBIC, 1e-7,
       1e-5},
      {"geodesic, root, cubic", 50, 0, BATTEN_ROTATION_GEODESIC, BATTEN_PARAMETER_ROOT, BATTEN_PATH_CUBIC, 2e-6,
       1e-5},
      {"geodesic, ratio, linear", 50, 0, BATTEN_ROTATION_GEODESIC, BATTEN_PARAMETER_RATIO, BATTEN_PATH_LINEAR, 1e-4,
       2e-4},
      {"the paper's: logarithm, ratio, linear", 50, 0, BATTEN_ROTATION_LOGARITHM, BATTEN_PARAMETER_RATIO,
       BATTEN_PATH_LINEAR, 1e-4, 2e-4},
      {"from angular velocity, root, cubic", 50, 0, BATTEN_ROTATION_VELOCITY, BATTEN_PARAMETER_ROOT,
       BATTEN_PATH_CUBIC, 1e-6, 1e-5},
      {"spherical, root, cubic", 10, 0, BATTEN_ROTATION_SPHERICAL, BATTEN_PARAMETER_ROOT, BATTEN_PATH_CUBIC, 1e-5,
       1e-3},
      {"uneven: spherical, root, cubic", 50, 0.8, BATTEN_ROTATION_SPHERICAL, BATTEN_PARAMETER_ROOT, BATTEN_PATH_CUBIC,
       5e-6, 5e-5},
  };
  double turn[9], mean;
  stack_scene_rotation((const double[3]){0.3, -0.5, 0.8}, 170 * SCENE_PI / 180, turn);
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    swept_case c;
    batten_stack_options o = swept_options();
    o.rotation = rows[i].rotation;
    o.parameter = rows[i].parameter;
    o.path = rows[i].path;
    o.ends[0] = o.ends[1] = BATTEN_END_FLAT;
    make_block(ctx, rows[i].count, rows[i].uneven, NULL, o, &c);
    double most = block_error(ctx, &c, 2000, NULL, &mean);
    T_RATIO(mean, rows[i].mean, "%zu sections, %s: mean", rows[i].count, rows[i].name);
    T_RATIO(most, rows[i].most, "%zu sections, %s: max", rows[i].count, rows[i].name);
    swept_case_release(ctx, &c);
    make_block(ctx, rows[i].count, rows[i].uneven, turn, o, &c);
    double turned = block_error(ctx, &c, 2000, turn, &mean);
    if (o.rotation == BATTEN_ROTATION_LOGARITHM)
      T_CHECK(turned > 1e-2, "the paper's way, all turned by 170 degrees: another solid, %.2g off", turned);
    else
      T_RATIO(fabs(turned - most), 1e-13, "all turned by 170 degrees: no change");
    swept_case_release(ctx, &c);
  }
}

/* ---- planes that cross -------------------------------------------------------------------------------------------
 */

/* A circle's arc with sections that reach beyond its middle; the union of what they sweep by many planes. */
static double swept_union(const scene_block *b, const double *p) {
  rectangle section = {{b->half[0], b->half[1]}};
  double best = -INFINITY;
  enum { PLANES = 4000 };
  double before = 0, last[2] = {0};
  for (int i = 0; i <= PLANES; i++) {
    double o[3], m[3][3], xy[2], height = 0;
    scene_block_frame(b, (double)i / PLANES, o, m, NULL);
    for (int k = 0; k < 3; k++) height += m[2][k] * (p[k] - o[k]);
    for (int j = 0; j < 2; j++) xy[j] = m[j][0] * (p[0] - o[0]) + m[j][1] * (p[1] - o[1]) + m[j][2] * (p[2] - o[2]);
    if (i > 0 && (height > 0) != (before > 0)) {
      double u = before / (before - height);
      double at[2] = {last[0] + u * (xy[0] - last[0]), last[1] + u * (xy[1] - last[1])};
      best = fmax(best, rectangle_value(&section, at, NULL));
    }
    before = height;
    memcpy(last, xy, sizeof last);
  }
  return best;
}

static void test_crossing(batten_context *ctx) {
  static const double radii[] = {0.2, 0.1};
  for (int n = 0; n < 2; n++) {
    scene_block b = {radii[n], 1.5 * SCENE_PI / 2, 0.5, {0.25, 0.15}};
    stack_scene scene = {0};
    stack_scene_block(&scene, &b, 25, 0.3, 0);
    batten_stack_options o = swept_options();
    o.ends[0] = o.ends[1] = BATTEN_END_PLANE;
    const rectangle section = {{b.half[0], b.half[1]}};
    swept_case c;
    T_OK(swept_case_make(ctx, &scene, &o, &section, &c), ctx);
    stack_scene_free(&scene);
    enum { COUNT = 3000 };
    double(*p)[3] = malloc(COUNT * sizeof *p), *values = malloc(COUNT * sizeof *values);
    uint64_t seed = 11;
    for (int i = 0; i < COUNT; i++) {
      p[i][0] = radii[n] + 0.5 * (2 * t_uniform(&seed) - 1);
      p[i][1] = 0.2 * (2 * t_uniform(&seed) - 1);
      p[i][2] = 0.5 * (2 * t_uniform(&seed) - 1);
    }
    T_OK(stack_swept_evaluate(&c.s, ctx, COUNT, p[0], values, NULL), ctx);
    int wrong = 0, inside = 0;
    for (int i = 0; i < COUNT; i++) {
      double f = swept_union(&b, p[i]);
      inside += f > 0;
      wrong += (f > 1e-3 && values[i] < 0) || (f < -1e-3 && values[i] > 0);
    }
    T_CHECK(wrong == 0 && inside > COUNT / 20, "radius %g, planes cross within: %d of %d wrong, %d inside", radii[n],
            wrong, COUNT, inside);
    free(p);
    free(values);
    swept_case_release(ctx, &c);
  }
}

/* ---- gradients, ends, bounds -------------------------------------------------------------------------------------
 */

static void random_points(uint64_t *seed, size_t count, double (*p)[3]) {
  for (size_t i = 0; i < count; i++) {
    p[i][0] = 2.2 * t_uniform(seed) - 0.7;
    p[i][1] = 1.2 * (2 * t_uniform(seed) - 1);
    p[i][2] = 2.2 * t_uniform(seed) - 0.7;
  }
}

static void test_gradients(batten_context *ctx) {
  enum { COUNT = 400 };
  static double p[COUNT][3], q[6 * COUNT][3], values[6 * COUNT], gradients[COUNT][3];
  const double h = 1e-6;
  for (int n = 0; n < 4; n++) {
    swept_case c;
    batten_stack_options o = swept_options();
    o.parameter = n == 1 ? BATTEN_PARAMETER_RATIO : BATTEN_PARAMETER_ROOT;
    o.ends[0] = o.ends[1] = n == 2 ? BATTEN_END_PLANE : n == 3 ? BATTEN_END_OPEN : BATTEN_END_FLAT;
    o.saturation = n == 0 ? 0.2 : INFINITY;
    o.between = n == 0 ? BATTEN_BETWEEN_NATURAL : BATTEN_BETWEEN_LINEAR;
    make_block(ctx, 9, 0.3, NULL, o, &c);
    for (size_t i = 0; i < c.s.count; i++) c.sections[i].scale = 1 + 0.1 * sin((double)i); /* so that F hangs on t */
    uint64_t seed = 5;
    random_points(&seed, COUNT, p);
    for (size_t i = 0; i < COUNT; i++)
      for (size_t k = 0; k < 6; k++) {
        memcpy(q[6 * i + k], p[i], sizeof p[i]);
        q[6 * i + k][k / 2] += k % 2 ? h : -h;
      }
    T_OK(stack_swept_evaluate(&c.s, ctx, COUNT, p[0], NULL, gradients[0]), ctx);
    T_OK(stack_swept_evaluate(&c.s, ctx, 6 * COUNT, q[0], values, NULL), ctx);
    size_t bad = 0;
    double sum = 0;
    for (size_t i = 0; i < COUNT; i++) {
      double worst = 0;
      for (size_t k = 0; k < 3; k++)
        worst = fmax(worst, fabs((values[6 * i + 2 * k + 1] - values[6 * i + 2 * k]) / (2 * h) - gradients[i][k]));
      bad += worst > 1e-4;
      sum += fmin(worst, 1e-4);
    }
    /* some differences straddle an edge of the rectangle, a plane, or another largest root */
    T_CHECK(bad <= COUNT / 100, "gradients against differences, case %d: %zu of %d straddle a kink", n, bad, COUNT);
    T_RATIO(sum / COUNT, 2e-6, "and differ by, in the mean");
    swept_case_release(ctx, &c);
  }
}

static void test_ends(batten_context *ctx) {
  swept_case c;
  batten_stack_options o = swept_options();
  o.ends[1] = BATTEN_END_PLANE;
  make_block(ctx, 20, 0, NULL, o, &c);
  /* below the first plane, z = 0, the rectangle goes on to half a gap; at the last one, x = 1, it ends */
  double half_gap = c.s.gap / 2, values[9];
  double points[9][3] = {{0, 0, -half_gap / 2}, {0, 0, -half_gap},  {0, 0, -2 * half_gap},
                         {0, 0, -1e-9},         {0, 0, 1e-9},       {1, 0, 1},
                         {1 + 1e-3, 0, 1},      {1 - 1e-3, 0, 1.0}, {1, 0.1, 0.99}};
  T_OK(stack_swept_evaluate(&c.s, ctx, 9, points[0], values, NULL), ctx);
  T_RATIO(fabs(values[0] - half_gap / 2) + fabs(values[1]) + fabs(values[2] + half_gap), 1e-14, "FLAT: H - s beyond");
  T_RATIO(fabs(values[3] - values[4]), 3e-9, "continuous across the first plane");
  T_RATIO(fabs(values[5]), 1e-12, "PLANE: zero on the last plane");
  T_RATIO(fabs(values[6] + 1e-3) + fabs(values[7] - 1e-3), 2e-6, "and the distance to it on both sides");
  T_RATIO(fabs(values[8]), 1e-12, "all over the section");
  swept_case_release(ctx, &c);
}

static void test_bounds(batten_context *ctx) {
  enum { BOXES = 4000, SAMPLES = 25 };
  static double boxes[BOXES][2][3], ranges[BOXES][2], p[BOXES * SAMPLES][3], values[BOXES * SAMPLES];
  for (int n = 0; n < 5; n++) {
    swept_case c;
    batten_stack_options o = swept_options();
    o.parameter = n == 1 ? BATTEN_PARAMETER_RATIO : BATTEN_PARAMETER_ROOT;
    o.ends[0] = n == 2 ? BATTEN_END_OPEN : BATTEN_END_FLAT;
    o.ends[1] = n == 2 ? BATTEN_END_PLANE : BATTEN_END_FLAT;
    o.rotation = n == 2 ? BATTEN_ROTATION_GEODESIC : n == 3 ? BATTEN_ROTATION_VELOCITY : BATTEN_ROTATION_SPHERICAL;
    o.saturation = n == 0 ? 0.3 : INFINITY;
    if (n < 4) {
      make_block(ctx, n == 1 ? 30 : 9, 0.3, NULL, o, &c);
    } else { /* planes that cross within */
      scene_block b = {0.2, 3 * SCENE_PI / 4, 0.5, {0.25, 0.15}};
      stack_scene scene = {0};
      stack_scene_block(&scene, &b, 25, 0.3, 0);
      const rectangle section = {{b.half[0], b.half[1]}};
      T_OK(swept_case_make(ctx, &scene, &o, &section, &c), ctx);
      stack_scene_free(&scene);
    }
    uint64_t seed = (uint64_t)(21 + n);
    for (size_t i = 0; i < BOXES; i++) {
      double size = pow(10, -4 * t_uniform(&seed));
      random_points(&seed, 1, &boxes[i][0]);
      for (int k = 0; k < 3; k++) boxes[i][1][k] = boxes[i][0][k] + size * t_uniform(&seed);
      for (size_t j = 0; j < SAMPLES; j++)
        for (int k = 0; k < 3; k++) { /* corners first */
          double u = j < 8 ? (double)(j >> k & 1) : t_uniform(&seed);
          p[i * SAMPLES + j][k] = fmin(boxes[i][0][k] + u * (boxes[i][1][k] - boxes[i][0][k]), boxes[i][1][k]);
        }
    }
    T_OK(stack_swept_bounds(&c.s, ctx, BOXES, boxes[0][0], ranges[0]), ctx);
    T_OK(stack_swept_evaluate(&c.s, ctx, BOXES * SAMPLES, p[0], values, NULL), ctx);
    size_t outside = 0, small = 0, loose = 0;
    double ratio = 0;
    for (size_t i = 0; i < BOXES; i++) {
      double least = INFINITY, most = -INFINITY;
      for (size_t j = 0; j < SAMPLES; j++) {
        double v = values[i * SAMPLES + j];
        least = fmin(least, v);
        most = fmax(most, v);
      }
      if (!(least >= ranges[i][0] && most <= ranges[i][1])) {
        if (outside++ == 0)
          printf("# box %zu: [%.17g, %.17g] not in [%.17g, %.17g]\n", i, least, most, ranges[i][0], ranges[i][1]);
      }
      if (boxes[i][1][0] - boxes[i][0][0] > 0.01) continue;
      small++;
      double wide = (ranges[i][1] - ranges[i][0]) / fmax(most - least, 1e-6);
      ratio += fmin(wide, 10);
      loose += wide > 10;
    }
    T_CHECK(outside == 0, "case %d: values outside of the bounds in %zu of %d boxes", n, outside, BOXES);
    T_RATIO(ratio / (double)small, n == 4 ? 4.0 : 2.5, "case %d: small boxes' bounds over the samples' range, mean",
            n);
    T_CHECK(loose < small / (n == 4 ? 5 : 20), "case %d: %zu of %zu above 10", n, loose, small);
    swept_case_release(ctx, &c);
  }
}

static void test_threads(batten_context *ctx) {
  enum { COUNT = 9000 };
  static double p[COUNT][3], a[COUNT], b[COUNT], ga[COUNT][3], gb[COUNT][3];
  swept_case c;
  make_block(ctx, 20, 0, NULL, swept_options(), &c);
  uint64_t seed = 9;
  random_points(&seed, COUNT, p);
  T_OK(stack_swept_evaluate(&c.s, ctx, COUNT, p[0], a, ga[0]), ctx);
  batten_context *two = t_context(NULL, NULL, 2);
  T_OK(stack_swept_evaluate(&c.s, two, COUNT, p[0], b, gb[0]), two);
  bool finite = true;
  for (int i = 0; i < COUNT; i++) finite = finite && isfinite(a[i]) && isfinite(ga[i][0] + ga[i][1] + ga[i][2]);
  T_CHECK(finite && memcmp(a, b, sizeof a) == 0 && memcmp(ga, gb, sizeof ga) == 0, "same bits with two threads");
  batten_context_free(two);
  swept_case_release(ctx, &c);
}

static batten_status call_all(batten_context *ctx, void *arg) {
  swept_case *c = arg;
  double p[2][3] = {{0.1, 0, 0.2}, {0.1, 0.1, -0.1}}, values[2], gradients[2][3], range[2];
  batten_status st = stack_swept_evaluate(&c->s, ctx, 2, p[0], values, gradients[0]);
  const double box[6] = {0, 0, 0, 0.5, 0.5, 0.5};
  return st < 0 ? st : stack_swept_bounds(&c->s, ctx, 1, box, range);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_block(ctx);
  test_crossing(ctx);
  test_gradients(ctx);
  test_ends(ctx);
  test_bounds(ctx);
  test_threads(ctx);
  swept_case c;
  make_block(ctx, 5, 0, NULL, swept_options(), &c);
  t_fail_every_allocation("stack_swept_evaluate and _bounds", call_all, &c);
  swept_case_release(ctx, &c);
  batten_context_free(ctx);
  return t_done();
}
