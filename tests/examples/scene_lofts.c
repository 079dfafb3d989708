/* Writes stacks of contours for the manual, as files that `batten loft` reads.
 *
 *   scene-lofts paper FILE.json                   four quadratic C1 contours, as in figure 5 of the paper
 *   scene-lofts stack FILE.json SEED CONTOURS [SPANS]  random cubic C2 contours with an inflection, that turn from one
 *                                                 to the next
 *   scene-lofts ring FILE.json SEED CONTOURS [SPANS]   the same closed, with two inflections */
#include <batten/exchange.h>
#include <stdio.h>
#include <string.h>

#include "loft_scenes.h"

static batten_status write_scene(batten_context *ctx, const loft_scene *s, const char *path) {
  batten_write_curves_options o = batten_write_curves_options_default();
  batten_plane *planes = loft_scene_memory(s->count, sizeof *planes);
  for (size_t i = 0; i < s->count; i++) planes[i] = (batten_plane){{0, 0, s->heights[i]}, {{1, 0, 0}, {0, 1, 0}}};
  o.planes = planes;
  batten_status st = batten_write_curves(ctx, s->count, (const batten_curve *const *)s->contours, &o, path);
  free(planes);
  return st;
}

int main(int argc, char **argv) {
  loft_rule rule = {.kind = LOFT_PAPER};
  bool ring = argc >= 5 && strcmp(argv[1], "ring") == 0, stack = argc >= 5 && strcmp(argv[1], "stack") == 0;
  if (ring || stack)
    rule = (loft_rule){.kind = LOFT_STACK,
                       .degree = 3,
                       .smoothness = 2,
                       .closed = ring,
                       .contours = (size_t)strtoul(argv[4], NULL, 10),
                       .spans = argc > 5 ? (size_t)strtoul(argv[5], NULL, 10) : 0,
                       .inflections = ring ? 2 : 1,
                       .decades = 1,
                       .rotation = 0.3,
                       .seed = strtoul(argv[3], NULL, 10)};
  else if (argc != 3 || strcmp(argv[1], "paper") != 0) {
    fprintf(stderr, "usage: scene-lofts paper FILE.json | stack|ring FILE.json SEED CONTOURS [SPANS]\n");
    return 2;
  }
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  loft_scene s = loft_scene_make(ctx, &rule);
  batten_status st = write_scene(ctx, &s, argv[2]);
  if (st < 0) fprintf(stderr, "%s\n", batten_error(ctx));
  loft_scene_free(&s);
  batten_context_free(ctx);
  return st < 0;
}
