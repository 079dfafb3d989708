/* Stacks of planes that are not parallel, whole: the bent and twisted block from points; frames of a solid. */
#include "stack_scenes.h"
#include "tap.h"

static batten_solid *build(batten_context *ctx, stack_scene *scene, const batten_stack_options *o) {
  batten_solid *solid = NULL;
  T_OK(batten_stack_build(ctx, scene->count, stack_scene_sections(scene), o, &solid, NULL, NULL, NULL), ctx);
  stack_scene_free(scene);
  return solid;
}

static void test_block(batten_context *ctx) {
  scene_block b = scene_block_figure4();
  stack_scene scene = {0};
  enum { COUNT = 12, PLACES = 31 };
  double t[COUNT], at[PLACES + 2], rotations[PLACES + 2][3][3], origins[PLACES + 2][3], worst = 0;
  for (int i = 0; i < COUNT; i++) t[i] = scene_block_length(&b) * i / (COUNT - 1);
  for (int i = 0; i < PLACES; i++) at[i] = scene_block_length(&b) * i / (PLACES - 1);
  at[PLACES] = -1;
  at[PLACES + 1] = 9;
  stack_scene_block(&scene, &b, COUNT, 0, 4);
  batten_stack_options o = batten_stack_options_default();
  o.parameters = t;
  batten_solid *solid = build(ctx, &scene, &o);
  T_OK(batten_stack_frames(ctx, solid, PLACES + 2, at, rotations[0][0], origins[0]), ctx);
  for (int i = 0; i < PLACES; i++) {
    double origin[3], m[3][3];
    scene_block_frame(&b, at[i] / scene_block_length(&b), origin, m, NULL);
    for (int k = 0; k < 3; k++) {
      worst = fmax(worst, fabs(origin[k] - origins[i][k]));
      for (int j = 0; j < 3; j++) worst = fmax(worst, fabs(m[k][j] - rotations[i][k][j]));
    }
  }
  T_RATIO(worst, 5e-5, "frames of the block by %d sections", COUNT);
  T_CHECK(memcmp(rotations[PLACES], rotations[0], sizeof rotations[0]) == 0 &&
              memcmp(origins[PLACES + 1], origins[PLACES - 1], sizeof origins[0]) == 0,
          "held beyond the ends");
  double place = NAN;
  T_STATUS(batten_stack_frames(ctx, solid, 1, &place, rotations[0][0], origins[0]), BATTEN_E_INVALID, ctx,
           "t[0]: nan; give finite places");
  T_STATUS(batten_stack_frames(ctx, solid, 1, at, NULL, origins[0]), BATTEN_E_INVALID, ctx, "rotations: NULL");
  T_STATUS(batten_stack_frames(ctx, NULL, 1, at, rotations[0][0], origins[0]), BATTEN_E_INVALID, ctx, "solid: NULL");
  batten_solid_free(solid);
}

/* Figure 4 from 50 sections of 52 points: distances of true surface points, over the length. */
static void test_fitted(batten_context *ctx) {
  enum { SECTIONS = 50, COUNT = 1000 };
  static double p[COUNT][3], values[COUNT], gradients[COUNT][3];
  static const char *const names[] = {"spherical spline", "all turned by 170 degrees", "from angular velocity"};
  scene_block b = scene_block_figure4();
  double turn[9], omega[SECTIONS][3], t[SECTIONS], first = 0;
  stack_scene_rotation((const double[3]){0.3, -0.5, 0.8}, 170 * SCENE_PI / 180, turn);
  for (int n = 0; n < 3; n++) {
    stack_scene scene = {0};
    stack_scene_block(&scene, &b, SECTIONS, 0, 13);
    batten_stack_options o = batten_stack_options_default();
    if (n == 1) stack_scene_turn(&scene, turn);
    if (n == 2) {
      for (int i = 0; i < SECTIONS; i++) {
        double origin[3], m[3][3];
        scene_block_frame(&b, (double)i / (SECTIONS - 1), origin, m, omega[i]);
        t[i] = scene_block_length(&b) * i / (SECTIONS - 1);
      }
      o.rotation = BATTEN_ROTATION_VELOCITY;
      o.angular_velocity = omega[0];
      o.parameters = t;
    }
    batten_solid *solid = build(ctx, &scene, &o);
    uint64_t seed = 3;
    for (int i = 0; i < COUNT; i++) {
      scene_block_point(&b, t_uniform(&seed), t_uniform(&seed), p[i]);
      if (n == 1) stack_scene_turn_vector(turn, p[i]);
    }
    T_OK(batten_solid_evaluate(ctx, solid, COUNT, p[0], values, gradients[0], NULL), ctx);
    double worst = 0, sum = 0;
    for (int i = 0; i < COUNT; i++) {
      const double *g = gradients[i];
      double distance = fabs(values[i]) / sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) / scene_block_length(&b);
      worst = fmax(worst, distance);
      sum += distance;
    }
    T_RATIO(worst, 2e-3, "block of fitted sections, %s: max", names[n]);
    T_RATIO(sum / COUNT, 4e-4, "block of fitted sections, %s: mean", names[n]);
    if (n == 0) first = worst;
    T_RATIO(fabs(worst - first), n == 1 ? 1e-9 : 1e-6, "the same solid");
    batten_solid_free(solid);
  }
}

/* Heights 0, 3, 6, .. at parameters 0, 1, 4, ..: t is not the height here. */
static void test_parallel(batten_context *ctx) {
  const double radii[4] = {1, 1.2, 1.3, 1.1}, t[4] = {0, 1, 4, 5}, at[5] = {-1, 0.5, 1, 2, 7};
  const double heights[5] = {0, 1.5, 3, 4, 9};
  double rotations[5][3][3], origins[5][3], worst = 0;
  stack_scene scene = {0};
  stack_scene_discs(&scene, 4, radii, 3, 40);
  batten_stack_options o = batten_stack_options_default();
  o.parameters = t;
  const double base = scene.sections[0].origin[2];
  batten_solid *solid = build(ctx, &scene, &o);
  T_OK(batten_stack_frames(ctx, solid, 5, at, rotations[0][0], origins[0]), ctx);
  for (int i = 0; i < 5; i++) {
    worst = fmax(worst, fabs(origins[i][2] - base - heights[i]) + fabs(origins[i][0]) + fabs(origins[i][1]));
    for (int k = 0; k < 9; k++) worst = fmax(worst, fabs(rotations[i][k / 3][k % 3] - (k % 4 == 0)));
  }
  T_RATIO(worst, 1e-14, "parallel planes: the first frame goes up in proportion to the height");
  batten_solid_free(solid);
}

static void test_other(batten_context *ctx) {
  batten_solid *solid = NULL;
  double points[40][2], t = 0, m[9], o[3] = {7, 7, 7};
  for (int i = 0; i < 40; i++) {
    points[i][0] = cos(SCENE_PI * i / 20);
    points[i][1] = 2 * sin(SCENE_PI * i / 20);
  }
  T_OK(batten_solid_fit(ctx, 2, 40, points[0], NULL, &solid, NULL), ctx);
  T_STATUS(batten_stack_frames(ctx, solid, 1, &t, m, o), BATTEN_E_INVALID, ctx, "solid: not a stack");
  T_CHECK(o[0] == 7, "outputs untouched by failures");
  batten_solid_free(solid);
}

/* Planes about an axis, all with their origin on it, as a probe that turns sees them: a quarter of a ring. */
static void test_fan(batten_context *ctx) {
  stack_scene scene = {0};
  for (int k = 0; k < 7; k++) {
    const double angle = SCENE_PI * k / 12, x = cos(angle), z = sin(angle), origin[3] = {0, 0, 0};
    const double rotation[9] = {x, 0, z, 0, 1, 0, -z, 0, x};
    stack_scene_section(&scene, origin, rotation);
    stack_scene_disc(&scene, 30, 0, 8, 50);
  }
  for (int given = 0; given < 2; given++)
    for (int end = BATTEN_END_FLAT; end <= BATTEN_END_ROUNDED; end++) {
      const double parameters[7] = {0, 1, 2, 3, 4, 5, 6}, step = 1e-5;
      batten_stack_options o = batten_stack_options_default();
      batten_solid *solid = NULL;
      o.ends[0] = o.ends[1] = (batten_stack_end)end;
      o.parameters = given ? parameters : NULL;
      T_OK(batten_stack_build(ctx, 7, stack_scene_sections(&scene), &o, &solid, NULL, NULL, NULL), ctx);
      double worst = 0, inside = -INFINITY;
      for (int k = 0; k < 50; k++) {
        double angle = 0.03 + 0.03 * k, r = 30 + 6 * sin(3.0 * k),
               p[3] = {r * cos(angle), 3 * cos(7.0 * k), r * sin(angle)};
        double f, gradient[3];
        batten_solid_evaluate(ctx, solid, 1, p, &f, gradient, NULL);
        if (k == 25) inside = f;
        for (int d = 0; d < 3; d++) {
          double q[2][3], side[2];
          memcpy(q[0], p, sizeof p);
          memcpy(q[1], p, sizeof p);
          q[0][d] -= step;
          q[1][d] += step;
          batten_solid_evaluate(ctx, solid, 2, q[0], side, NULL, NULL);
          double error = fabs((side[1] - side[0]) / (2 * step) - gradient[d]);
          if (!(error <= worst)) worst = error;
        }
      }
      T_RATIO(worst, 1e-4, "fan, end rule %d, parameters %s: gradients against differences", end,
              given ? "given" : "not");
      T_CHECK(inside > 1, "inside of the ring: %g", inside);
      batten_solid_free(solid);
    }
  stack_scene_free(&scene);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_block(ctx);
  test_fitted(ctx);
  test_parallel(ctx);
  test_other(ctx);
  test_fan(ctx);
  batten_context_free(ctx);
  return t_done();
}
