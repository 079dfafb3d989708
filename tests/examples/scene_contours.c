/* Prints points of planar curves for the manual, as text that `batten curve` reads.
 *
 *   scene_contours fore | aft                     8 contours each, as in figure 2 of the paper: 296 points together
 *   scene_contours fore-inflections | ...         where they are wanted, as `batten curve --inflections` takes them
 *   scene_contours NAME COUNT NOISE SEED          one contour: wave, loop, frame, airfoil */
#include <stdio.h>
#include <string.h>

#include "contour_scenes.h"

static void print_sections(bool aft, bool wanted) {
  printf(wanted ? "{\"batten\": \"inflections\", \"version\": 1, \"contours\": [\n" : "contour,t,x,y\n");
  for (size_t k = 0; k < CONTOUR_SECTIONS; k++) {
    contour_scene s = contour_section(aft, k);
    for (size_t i = 0; i < s.count && !wanted; i++)
      printf("%zu,%.17g,%.17g,%.17g\n", k + 1, s.lengths[i], s.points[2 * i], s.points[2 * i + 1]);
    if (wanted) printf("{\"sign\": %d, \"inflections\": [", s.sign);
    for (size_t i = 0; i < s.inflection_count && wanted; i++) printf("%s%.17g", i ? ", " : "", s.inflections[i]);
    if (wanted) printf("]}%s\n", k + 1 < CONTOUR_SECTIONS ? "," : "]}");
    contour_scene_free(&s);
  }
}

static bool print_scene(char **argv) {
  static const struct {
    const char *name;
    contour_kind kind;
    size_t inflections;
  } kinds[] = {{"wave", CONTOUR_WAVE, 3},
               {"loop", CONTOUR_LOOP, 4},
               {"frame", CONTOUR_FRAME, 0},
               {"airfoil", CONTOUR_AIRFOIL, 1}};
  for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
    if (strcmp(argv[1], kinds[k].name) != 0) continue;
    contour_scene s = contour_scene_make(&(contour_rule){.kind = kinds[k].kind,
                                                         .count = (size_t)strtoul(argv[2], NULL, 10),
                                                         .inflections = kinds[k].inflections,
                                                         .noise = strtod(argv[3], NULL),
                                                         .seed = strtoul(argv[4], NULL, 10)});
    for (size_t i = 0; i < s.count; i++) printf("%.17g %.17g\n", s.points[2 * i], s.points[2 * i + 1]);
    contour_scene_free(&s);
    return true;
  }
  return false;
}

int main(int argc, char **argv) {
  const char *name = argc == 2 ? argv[1] : "";
  if (argc == 5 && strtoul(argv[2], NULL, 10) >= 3 && print_scene(argv)) return 0;
  bool wanted = strstr(name, "-inflections") != NULL;
  bool fore = !strcmp(name, "fore") || !strcmp(name, "fore-inflections");
  bool aft = !strcmp(name, "aft") || !strcmp(name, "aft-inflections");
  if (!fore && !aft) {
    fprintf(stderr,
            "usage: scene_contours fore | aft | fore-inflections | aft-inflections\n"
            "       scene_contours wave | loop | frame | airfoil COUNT NOISE SEED\n");
    return 2;
  }
  print_sections(aft, wanted);
  return 0;
}
