/* Prints points of planar curves for the manual, as text that `batten curve` reads.
 *
 *   scene_contours fore | aft                     8 contours each, as in figure 2 of the paper: 296 points together
 *   scene_contours fore-inflections | ...         where they are wanted, as `batten curve --inflections` takes them
 *   scene_contours NAME COUNT NOISE SEED          one contour: wave, loop, frame, airfoil */
#include <stdio.h>
#include <string.h>

#include "contour_scenes.h"

/* Sections of a ship: the bilge turns left, the flare above it right; aft there is a hollow below it. The paper's own
 * points are not to be had. part 0 .. 1 goes from the middle of the ship to its end. */
static size_t section(bool aft, double part, double *table, double *inflections) {
  const double degree = SCENE_PI / 180;
  contour_arc fore_arcs[] = {{0, 0.68 - 0.15 * part, (78 - 30 * part) * degree, false, false},
                             {1, 0.68 - 0.15 * part, -(10 + 38 * part) * degree, true, false}};
  contour_arc aft_arcs[] = {{0, 0.34 + 0.1 * part, -(24 + 30 * part) * degree, true, false},
                            {0.34 + 0.1 * part, 0.78, (84 + 6 * part) * degree, false, false},
                            {1, 0.78, -(14 + 12 * part) * degree, true, false}};
  double turn = (aft ? 28 + 40 * part : 6 + 52 * part) * degree, length = 1.25 - 0.3 * part;
  contour_integrate(aft ? 3 : 2, aft ? aft_arcs : fore_arcs, table);
  for (size_t i = 0; i <= CONTOUR_TABLE; i++) {
    double x = table[2 * i], y = table[2 * i + 1];
    table[2 * i] = length * (cos(turn) * x - sin(turn) * y) + (1 - part) * (aft ? 0.15 : 0.25);
    table[2 * i + 1] = length * (sin(turn) * x + cos(turn) * y) + 0.1 * part * part;
  }
  inflections[0] = aft ? 0.34 + 0.1 * part : 0.68 - 0.15 * part;
  inflections[1] = 0.78;
  return aft ? 2 : 1;
}

static void print_sections(bool aft, bool wanted) {
  static double table[2 * CONTOUR_TABLE + 2];
  uint64_t state = aft ? 11 : 7;
  double inflections[2];
  if (wanted)
    printf("{\"batten\": \"inflections\", \"version\": 1, \"contours\": [\n");
  else
    printf("contour,t,x,y\n");
  for (size_t k = 0; k < 8; k++) {
    size_t count = section(aft, (double)k / 7, table, inflections), points = 18 + k % 2;
    for (size_t i = 0; i < points && !wanted; i++) {
      double t = (double)i / (double)(points - 1), noise = i == 0 || i == points - 1 ? 0.004 : 0.01;
      const double *p = table + 2 * (size_t)(t * CONTOUR_TABLE + 0.5);
      double x = p[0] + noise * contour_scene_normal(&state), y = p[1] + noise * contour_scene_normal(&state);
      printf("%zu,%.17g,%.17g,%.17g\n", k + 1, t, x, y);
    }
    if (wanted && count == 1)
      printf("{\"inflections\": [%.17g], \"sign\": 1}%s\n", inflections[0], k < 7 ? "," : "]}");
    if (wanted && count == 2)
      printf("{\"inflections\": [%.17g, %.17g], \"sign\": -1}%s\n", inflections[0], inflections[1],
             k < 7 ? "," : "]}");
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
