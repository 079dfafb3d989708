/* For compare_meshio.py: writes the octahedron |x|/1 + |y|/2 + |z|/3 <= 1 (volume 8) in every mesh format to a
 * folder. */
#include <batten/exchange.h>
#include <stdio.h>

int main(int argc, char **argv) {
  static const double vertices[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 2, 0}, {0, -2, 0}, {0, 0, 3}, {0, 0, -3}};
  static const uint32_t triangles[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                           {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  static const char *const extensions[] = {"ply", "obj", "stl", "off", "vtu", "vtp"};
  double height[6];
  for (int i = 0; i < 6; i++) height[i] = vertices[i][2];
  batten_context *ctx = NULL;
  batten_mesh *mesh = NULL;
  if (argc != 2 || batten_context_new(NULL, &ctx) < 0) return 2;
  batten_status status = batten_mesh_create(ctx, 6, &vertices[0][0], 8, &triangles[0][0], &mesh);
  if (status >= 0) status = batten_mesh_set_field(ctx, mesh, "height", 1, height);
  for (size_t i = 0; status >= 0 && i < sizeof extensions / sizeof *extensions; i++) {
    char path[4096];
    snprintf(path, sizeof path, "%s/octahedron.%s", argv[1], extensions[i]);
    status = batten_write_mesh(ctx, mesh, path);
  }
  if (status < 0) fprintf(stderr, "%s\n", batten_error(ctx));
  batten_mesh_free(mesh);
  batten_context_free(ctx);
  return status < 0;
}
