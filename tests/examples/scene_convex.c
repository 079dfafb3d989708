/* Prints the points of a scene for convex fits, one a line.
 * Usage: scene_convex paper | superquadric | dent | softmax | roof [SEED] */
#include <stdio.h>
#include <string.h>

#include "convex_scenes.h"

int main(int argc, char **argv) {
  const char *name = argc >= 2 ? argv[1] : "";
  uint64_t seed = argc >= 3 ? (uint64_t)strtoull(argv[2], NULL, 10) : 1;
  convex_scene s = {0};
  if (!strcmp(name, "paper")) s = convex_scene_paper(seed);
  if (!strcmp(name, "superquadric"))
    s = convex_scene_make(&(convex_rule){.body = CONVEX_SUPERQUADRIC,
                                         .count = 300,
                                         .axes = {1.4, 1, 0.8},
                                         .noise = 0.01,
                                         .turned = true,
                                         .seed = seed});
  if (!strcmp(name, "dent"))
    s = convex_scene_make(&(convex_rule){.body = CONVEX_ELLIPSOID,
                                         .count = 400,
                                         .axes = {1.6, 1, 0.6},
                                         .noise = 0.004,
                                         .dent_depth = 0.1,
                                         .dent_at = {0.2, -0.1},
                                         .seed = seed});
  if (!strcmp(name, "softmax")) s = convex_scene_function(CONVEX_F_SOFT_MAX, 200, 0.04, seed);
  if (!strcmp(name, "roof")) s = convex_scene_function(CONVEX_F_ROOF, 300, 0.02, seed);
  if (!s.count) {
    fprintf(stderr, "usage: scene_convex paper | superquadric | dent | softmax | roof [SEED]\n");
    return 2;
  }
  for (size_t i = 0; i < 3 * s.count; i++) printf("%.17g%c", s.points[i], (i + 1) % 3 ? ' ' : '\n');
  convex_scene_free(&s);
  return 0;
}
