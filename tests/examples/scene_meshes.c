/* Writes the mesh of a test scene as OBJ to the standard output; where the scene has lines (the valve), a second
 * argument names a file for them, as `batten network --lines` reads it. Usage: scene_meshes NAME [LINES] */
#include <stdio.h>
#include <string.h>

#include "network_scenes.h"

static scene_mesh shifted(void) { return scene_mesh_octahedron_shifted(0.5, 0.3); }
static scene_mesh icosphere(void) { return scene_mesh_icosphere(2); }
static scene_mesh ears(void) { return scene_mesh_ears(6); }

/* A drum with a domed top, of 18 vertices: its rims want creases. */
static scene_mesh drum(void) {
  enum { ROUND = 8 };
  scene_mesh m = scene_mesh_make(2 * ROUND + 2, 4 * ROUND);
  scene_point_set(m.points + 6 * ROUND, 0, 0, -0.6);
  scene_point_set(m.points + 6 * ROUND + 3, 0, 0, 0.9);
  for (size_t i = 0; i < ROUND; i++) {
    double a = 2 * SCENE_PI * (double)i / ROUND;
    size_t next = (i + 1) % ROUND;
    scene_point_set(m.points + 3 * i, cos(a), sin(a), -0.6);
    scene_point_set(m.points + 3 * (ROUND + i), cos(a), sin(a), 0.6);
    scene_triangle_set(m.corners + 12 * i, 2 * ROUND, next, i);
    scene_triangle_set(m.corners + 12 * i + 3, i, next, ROUND + next);
    scene_triangle_set(m.corners + 12 * i + 6, i, ROUND + next, ROUND + i);
    scene_triangle_set(m.corners + 12 * i + 9, 2 * ROUND + 1, ROUND + i, ROUND + next);
  }
  return m;
}

static const struct scene {
  const char *name;
  scene_mesh (*make)(void);
} scenes[] = {
    {"octahedron", scene_mesh_octahedron},
    {"shifted", shifted},
    {"icosphere", icosphere},
    {"tetrahedron", scene_mesh_tetrahedron},
    {"irregular-sphere", scene_mesh_sphere_irregular},
    {"noisy-sphere", scene_mesh_sphere_noisy},
    {"irregular-ellipsoid", scene_mesh_ellipsoid_irregular},
    {"long-ellipsoid", scene_mesh_ellipsoid_long},
    {"blob", scene_mesh_blob_162},
    {"torus", scene_mesh_torus_10_6},
    {"genus3", scene_mesh_genus3},
    {"cube", scene_mesh_cube_26},
    {"graph", scene_mesh_graph_7},
    {"ears", ears},
    {"panel", scene_mesh_panel},
    {"valve", scene_mesh_valve},
    {"drum", drum},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

static bool write_lines(const scene_mesh *m, const char *path) {
  FILE *file = fopen(path, "w");
  if (!file) return false;
  for (size_t l = 0; l < m->lines; l++)
    for (size_t i = m->line_starts[l]; i < m->line_starts[l + 1]; i++)
      fprintf(file, "%u%c", (unsigned)m->line_vertices[i], i + 1 < m->line_starts[l + 1] ? ' ' : '\n');
  return fclose(file) == 0;
}

int main(int argc, char **argv) {
  const struct scene *scene = NULL;
  for (size_t i = 0; i < SCENES && (argc == 2 || argc == 3); i++)
    if (!strcmp(argv[1], scenes[i].name)) scene = &scenes[i];
  if (!scene) {
    fprintf(stderr, "usage: scene_meshes NAME [LINES], NAME one of");
    for (size_t i = 0; i < SCENES; i++) fprintf(stderr, " %s", scenes[i].name);
    fprintf(stderr, "\n");
    return 2;
  }
  scene_mesh m = scene->make();
  for (size_t i = 0; i < m.vertices; i++)
    printf("v %.17g %.17g %.17g\n", m.points[3 * i], m.points[3 * i + 1], m.points[3 * i + 2]);
  for (size_t i = 0; i < m.triangles; i++)
    printf("f %u %u %u\n", (unsigned)m.corners[3 * i] + 1, (unsigned)m.corners[3 * i + 1] + 1,
           (unsigned)m.corners[3 * i + 2] + 1);
  bool ok = argc < 3 || write_lines(&m, argv[2]);
  if (!ok) fprintf(stderr, "scene_meshes: %s: cannot be written\n", argv[2]);
  scene_mesh_free(&m);
  return !ok;
}
