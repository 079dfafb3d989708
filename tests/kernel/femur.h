/* The femur of the data that lie beside the source tree, for tests of rough meshes. */
#ifndef FEMUR_H
#define FEMUR_H

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "network_scenes.h"

/* False where there is none: the test is to be skipped. Freed by scene_mesh_free. */
static inline bool femur_read(scene_mesh *out) {
  const char *shared = getenv("BATTEN_SHARED");
  char path[1024] = "";
  if (shared) snprintf(path, sizeof path, "%s/data/meshes/femur.off", shared);
  FILE *file = *path ? fopen(path, "r") : NULL;
  size_t vertices = 0, triangles = 0;
  if (!file) return false;
  bool read = fscanf(file, "OFF %zu %zu %*u", &vertices, &triangles) == 2;
  if (read) *out = scene_mesh_make(vertices, triangles);
  bool made = read;
  for (size_t k = 0; read && k < 3 * vertices; k++) read = fscanf(file, "%lf", &out->points[k]) == 1;
  for (size_t t = 0; read && t < triangles; t++) {
    uint32_t *c = out->corners + 3 * t;
    read = fscanf(file, "%*u %" SCNu32 " %" SCNu32 " %" SCNu32, &c[0], &c[1], &c[2]) == 3;
  }
  fclose(file);
  if (made && !read) scene_mesh_free(out);
  return read;
}

#endif
