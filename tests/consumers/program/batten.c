/* A program that embeds batten: fits a solid to points of a sphere, and makes a ball of an octahedron. What each way of
 * building it has to run. */
#include <batten/batten.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { POINTS = 100 };

static batten_status make_ball(batten_context *ctx) {
  static const double corners[6][3] = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  static const uint32_t triangles[8][3] = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4},
                                           {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}};
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  batten_network_info info = {0};
  batten_status st = batten_mesh_create(ctx, 6, corners[0], 8, triangles[0], &mesh);
  if (st == BATTEN_OK) st = batten_network_build(ctx, mesh, NULL, &network, &info);
  printf("%zu facets, normals differ by %.1e degrees\n", info.faces, info.normal_jump_max_deg);
  batten_network_free(network);
  batten_mesh_free(mesh);
  return st;
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  printf("batten %s, headers of %d.%d.%d\n", batten_version(), BATTEN_VERSION_MAJOR, BATTEN_VERSION_MINOR,
         BATTEN_VERSION_PATCH);
  if (strcmp(batten_version(), argv[1])) return 1;

  double points[POINTS][3];
  for (int i = 0; i < POINTS; i++) {
    double z = 1 - (2 * i + 1) / (double)POINTS, r = sqrt(1 - z * z), angle = 2.39996 * i;
    points[i][0] = r * cos(angle);
    points[i][1] = r * sin(angle);
    points[i][2] = z;
  }
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) != BATTEN_OK) return 1;
  batten_solid *solid = NULL;
  batten_solid_info info;
  batten_status st = batten_solid_fit(ctx, 3, POINTS, points[0], NULL, &solid, &info);
  if (st != BATTEN_OK) {
    fprintf(stderr, "%s: %s\n", batten_status_name(st), batten_error(ctx));
    batten_context_free(ctx);
    return 1;
  }
  const double probes[2][3] = {{0, 0, 0}, {0, 2, 0}};
  double f[2] = {0, 0};
  st = batten_solid_evaluate(ctx, solid, 2, probes[0], f, NULL, NULL);
  printf("inside %g, outside %g, residual %.1e\n", f[0], f[1], info.residual_max);
  batten_solid_free(solid);
  if (st == BATTEN_OK) st = make_ball(ctx);
  batten_context_free(ctx);
  return st == BATTEN_OK && f[0] > 0 && f[1] < 0 && info.residual_max < 1e-10 ? 0 : 1;
}
