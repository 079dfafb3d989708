/* Prints the points of a test scene, one a line. Usage: scene_points c | pair | torus | links | plate | moon */
#include <stdio.h>
#include <string.h>

#include "scenes.h"

int main(int argc, char **argv) {
  static double points[3 * 3000];
  const char *name = argc == 2 ? argv[1] : "";
  size_t count = 0, n = 3;
  if (!strcmp(name, "c")) scene_c_points(count = 59, points), n = 2;
  if (!strcmp(name, "pair")) scene_pair_points(count = 67, points), n = 2;
  if (!strcmp(name, "torus")) scene_torus_points(1, count = 600, points);
  if (!strcmp(name, "links")) scene_links_points(1, count = 900, points);
  if (!strcmp(name, "plate")) count = scene_plate_points(1, points);
  if (!strcmp(name, "moon")) scene_moon_points(1, count = 942, points);
  if (!count) {
    fprintf(stderr, "usage: scene_points c | pair | torus | links | plate | moon\n");
    return 2;
  }
  for (size_t i = 0; i < count * n; i++) printf("%.17g%c", points[i], (i + 1) % n ? ' ' : '\n');
  return 0;
}
