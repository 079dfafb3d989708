/* Bounds of solids through sections of every kind: conservative over boxes of all sizes, and narrow over points. */
#include "stack_kinds.h"

static batten_context *ctx;

static void check_bounds(const batten_solid *solid, const char *name, uint64_t seed) {
  enum { BOXES = 8400, PLACES = 2 };
  static double boxes[BOXES][2][3], ranges[BOXES][2], points[BOXES][PLACES][3], values[BOXES][PLACES];
  double lower[3], upper[3];
  batten_solid_box(solid, lower, upper);
  const double size = upper[0] - lower[0] + upper[1] - lower[1] + upper[2] - lower[2];
  for (size_t i = 0; i < BOXES; i++) {
    double scale = pow(10, -4 * t_uniform(&seed));
    for (int k = 0; k < 3; k++) {
      double side = upper[k] - lower[k], half = i % 50 ? 0.5 * side * scale * t_uniform(&seed) : 0;
      double middle = lower[k] + side * (1.4 * t_uniform(&seed) - 0.2);
      boxes[i][0][k] = middle - half;
      boxes[i][1][k] = middle + half;
      for (int e = 0; e < PLACES; e++) {
        double u = e == 0 ? (double)(t_random(&seed) % 2) : t_uniform(&seed);
        points[i][e][k] = fmin(boxes[i][1][k], boxes[i][0][k] + u * (boxes[i][1][k] - boxes[i][0][k]));
      }
    }
  }
  batten_status st = batten_solid_bounds(ctx, solid, BOXES, boxes[0][0], ranges[0]);
  if (st >= 0) st = batten_solid_evaluate(ctx, solid, (size_t)BOXES * PLACES, points[0][0], values[0], NULL, NULL);
  size_t outside = 0, known = 0, points_known = 0;
  for (size_t i = 0; i < BOXES; i++) {
    for (int e = 0; e < PLACES; e++) outside += !(values[i][e] >= ranges[i][0] && values[i][e] <= ranges[i][1]);
    known += ranges[i][1] < 0 || ranges[i][0] > 0;
    if (i % 50 == 0) points_known += ranges[i][1] - ranges[i][0] < 1e-8 * size;
  }
  T_CHECK(st == BATTEN_OK && outside == 0, "%s: bounds hold in %d boxes, %.0f %% of one sign", name, (int)BOXES,
          100. * (double)known / BOXES);
  T_RATIO(1 - (double)points_known * 50 / BOXES, 0.1, "%s: share of points whose bounds are wide", name);
}

static void test_bounds(void) {
  static const size_t kinds[] = {0, 1, 2, 3, 4, 6, 8, 9, 10, 11, 13, 14};
  for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
    kind k;
    batten_solid *solid = NULL;
    kind_make(kinds[i], &k);
    kind_build(ctx, &k, &solid);
    check_bounds(solid, kind_names[kinds[i]], 11 * (i + 1));
    batten_solid_free(solid);
    stack_scene_free(&k.scene);
  }
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_bounds();
  batten_context_free(ctx);
  return t_done();
}
