/* Writes sections of solids for the manual, as files that `batten stack` reads.
 *
 *   scene-sections branches FILE.json   a trunk and three branches, as in figure 3 of the paper
 *   scene-sections block FILE.json      a block bent and twisted by 90 degrees, 50 sections, as in figure 4
 *   scene-sections fan FILE.json        the same with 12 sections, bent so tightly that the planes cross within
 *   scene-sections seven FILE.json      seven contours in each section
 *   scene-sections tube FILE.json       annuli: a through-hole
 *   scene-sections cavity FILE.json     holes in inner slices only
 *   scene-sections torus FILE.json      a leaning torus in 12 slices
 *   scene-sections apart FILE.json      discs that do not overlap */
#include <batten/exchange.h>
#include <stdio.h>
#include <string.h>

#include "stack_scenes.h"

static int make(const char *name, stack_scene *s) {
  scene_block block = scene_block_figure4();
  scene_block tight = {0.2, SCENE_PI / 2, 0, {0.25, 0.15}};
  if (strcmp(name, "branches") == 0)
    stack_scene_branches(s, 60);
  else if (strcmp(name, "block") == 0)
    stack_scene_block(s, &block, 50, 0, 16);
  else if (strcmp(name, "fan") == 0)
    stack_scene_block(s, &tight, 12, 0, 16);
  else if (strcmp(name, "seven") == 0)
    stack_scene_seven(s, 5, 40);
  else if (strcmp(name, "tube") == 0)
    stack_scene_annuli(s, 5, 5, 10, 5, 60);
  else if (strcmp(name, "cavity") == 0)
    stack_scene_cavity(s, 60);
  else if (strcmp(name, "torus") == 0)
    stack_scene_leaning_torus(s, SCENE_PI / 4, 12, 0.08);
  else if (strcmp(name, "apart") == 0)
    stack_scene_shifted(s, 4, 3, 6.6, 5, 40);
  else
    return 0;
  return 1;
}

int main(int argc, char **argv) {
  stack_scene s = {0};
  if (argc != 3 || !make(argv[1], &s)) {
    fprintf(stderr, "usage: scene-sections branches|block|fan|seven|tube|cavity|torus|apart FILE.json\n");
    return 2;
  }
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  batten_status st = batten_write_sections(ctx, s.count, stack_scene_sections(&s), argv[2]);
  if (st < 0) fprintf(stderr, "%s\n", batten_error(ctx));
  stack_scene_free(&s);
  batten_context_free(ctx);
  return st < 0;
}
