/* Stacks of every kind of sections, blends, ends and frames, by number: for tests that go through all. */
#ifndef STACK_KINDS_H
#define STACK_KINDS_H

#include "stack_scenes.h"
#include "tap.h"

enum { SECTIONS_MAX = 9 };

/* One kind: a scene and options, with the arrays that these point to. */
typedef struct kind {
  stack_scene scene;
  batten_stack_options o;
  double t[SECTIONS_MAX], scales[SECTIONS_MAX], omega[SECTIONS_MAX][3];
} kind;

static const char *const kind_names[] = {"branches",
                                         "not-a-knot, scaled, parameters",
                                         "rational, rounded",
                                         "linked discs",
                                         "monotone, to apex",
                                         "line to line",
                                         "one section",
                                         "points in no order",
                                         "carrier alone",
                                         "bent block",
                                         "angular velocity",
                                         "linear path, ratio",
                                         "logarithm, open",
                                         "bent, points in no order",
                                         "planes that cross inside",
                                         NULL};

static inline void bend(kind *k, size_t count, scene_block block, size_t side) {
  stack_scene_block(&k->scene, &block, count, 0.2, side);
  k->o.tolerance = 0.007; /* corners to the last take centres, and show nothing here */
}

/* k is at the place where it stays: options point into it. */
static inline void kind_make(size_t which, kind *k) {
  static const double radii[4] = {2, 2.6, 2.2, 3};
  const scene_block figure4 = scene_block_figure4(), narrow = {0.2, SCENE_PI / 2, 0, {0.25, 0.15}};
  *k = (kind){.o = batten_stack_options_default()};
  for (size_t i = 0; i < SECTIONS_MAX; i++) {
    k->t[i] = (double)(i * i) / 7 + 0.3 * (double)i;
    k->scales[i] = 1 + 0.25 * (double)(i % 3);
  }
  if (which == 0) stack_scene_branches(&k->scene, 20);
  if (which == 1) {
    stack_scene_shifted(&k->scene, 4, 2, 1, 1.5, 24);
    for (int i = 0; i < 4; i++) k->scene.sections[i].origin[0] = 0.3 * i; /* origins beside the normal */
    k->o.between = BATTEN_BETWEEN_NOT_A_KNOT;
    k->o.scales = k->scales;
    k->o.parameters = k->t;
    k->o.saturation = INFINITY;
  }
  if (which == 2) {
    stack_scene_annuli(&k->scene, 3, 1, 3, 1.25, 24);
    k->o.between = BATTEN_BETWEEN_RATIONAL;
    k->o.shape = 0.4;
    k->o.ends[0] = k->o.ends[1] = BATTEN_END_ROUNDED;
    k->o.end_height[0] = 2;
  }
  if (which == 3) {
    stack_scene_shifted(&k->scene, 3, 2, 4.75, 2, 24);
    k->o.link = 1;
  }
  if (which == 4 || which == 5) {
    if (which == 5) {
      stack_scene_slice(&k->scene, -1.5);
      stack_scene_loop(&k->scene, 2, (const double[4]){-1, 0, 1, 0});
    }
    stack_scene_discs(&k->scene, 3, radii, 1.5, 24);
    stack_scene_slice(&k->scene, 4.25);
    stack_scene_loop(&k->scene, which == 5 ? 2 : 1, (const double[4]){0.25, 0, 0.25, 1});
    k->o.between = which == 4 ? BATTEN_BETWEEN_MONOTONE : BATTEN_BETWEEN_NATURAL;
    k->o.ends[0] = BATTEN_END_ROUNDED;
    k->o.apex = 1;
  }
  if (which == 6) {
    stack_scene_discs(&k->scene, 1, radii, 1, 24);
    k->o.gap = 1.5;
  }
  if (which == 7 || which == 8) {
    stack_scene_discs(&k->scene, 4, radii, 1.5, 24);
    k->o.method = which == 7 ? BATTEN_SECTION_POINTS : BATTEN_SECTION_CARRIER;
    k->o.ends[1] = BATTEN_END_ROUNDED;
  }
  if (which >= 9 && which <= 12) bend(k, 6, figure4, 6);
  if (which == 10) {
    for (size_t i = 0; i < 6; i++) memcpy(k->omega[i], (double[3]){0.2 * (double)i, 1, 0.7}, sizeof k->omega[i]);
    k->o.rotation = BATTEN_ROTATION_VELOCITY;
    k->o.angular_velocity = k->omega[0];
  }
  if (which == 11) {
    k->o.path = BATTEN_PATH_LINEAR;
    k->o.parameter = BATTEN_PARAMETER_RATIO;
    k->o.rotation = BATTEN_ROTATION_GEODESIC;
    k->o.between = BATTEN_BETWEEN_LINEAR;
    k->o.ends[0] = k->o.ends[1] = BATTEN_END_PLANE;
  }
  if (which == 12) {
    k->o.rotation = BATTEN_ROTATION_LOGARITHM;
    k->o.ends[0] = k->o.ends[1] = BATTEN_END_OPEN;
    k->o.parameters = k->t;
  }
  if (which == 13) {
    bend(k, 5, figure4, 6);
    k->o.method = BATTEN_SECTION_POINTS;
  }
  if (which == 14) bend(k, 6, narrow, 6);
  stack_scene_sections(&k->scene);
}
static inline batten_status kind_build(batten_context *c, const kind *k, batten_solid **out) {
  return batten_stack_build(c, k->scene.count, k->scene.sections, &k->o, out, NULL, NULL, NULL);
}

/* Around the solid's box. */
static inline void random_points(const batten_solid *solid, uint64_t seed, size_t count, double *points) {
  double lower[3], upper[3];
  batten_solid_box(solid, lower, upper);
  for (size_t i = 0; i < 3 * count; i++)
    points[i] = lower[i % 3] + (upper[i % 3] - lower[i % 3]) * (1.4 * t_uniform(&seed) - 0.2);
}

#endif
