/* Surfaces of every kind for compare_vtk.py: NAME.vtu, NAME.vtp, NAME.vtk and NAME.ply, and what batten says of them at places
 * in NAME.places. On stdout a line each: NAME, degrees, cells of the .vtu. write_surfaces FOLDER */
#include <batten/exchange.h>

#include <stdio.h>

#include "surface_places.h"
#include "surface_sides.h"

static batten_status write_one(batten_context *ctx, const surface_side_case *c, const char *folder) {
  static const char *const extensions[] = {"vtu", "vtp", "vtk", "ply"};
  char path[600];
  batten_surface *surface = NULL;
  batten_status st = surface_sides_make(ctx, c, &surface);
  for (int i = 0; st >= 0 && i < 4; i++) {
    snprintf(path, sizeof path, "%s/%s.%s", folder, c->name, extensions[i]);
    st = batten_write_surface(ctx, surface, NULL, path);
  }
  snprintf(path, sizeof path, "%s/%s.places", folder, c->name);
  if (st >= 0 && !surface_places_write(ctx, surface, 1, path)) st = BATTEN_E_IO;
  if (st >= 0)
    printf("%s %u %u %zu\n", c->name, c->degree[0], c->degree[1],
           (c->points[0] - c->degree[0]) * (c->points[1] - c->degree[1]));
  batten_surface_free(surface);
  return st;
}

int main(int argc, char **argv) {
  batten_context *ctx = NULL;
  if (argc != 2 || batten_context_new(NULL, &ctx) < 0) return 1;
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < SURFACE_SIDE_CASES && st >= 0; i++) st = write_one(ctx, &surface_side_cases[i], argv[1]);
  if (st < 0) fprintf(stderr, "%s: %s\n", batten_status_name(st), batten_error(ctx));
  batten_context_free(ctx);
  return st < 0;
}
