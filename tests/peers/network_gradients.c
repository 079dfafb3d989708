/* For compare_nielson.py: reads "V F", V rows of x y f and F triangles, counter-clockwise; prints the gradients of f
 * that the network of least norm over the plane has at the vertices: one pass from upright normals with t the
 * projected edge and weights |E|^-3, which is Nielson's functional method. f is made so small that an edge is as long
 * as its projection to 1e-12. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "network/net.h"

static int read_mesh(size_t V, size_t F, double *points, uint32_t *triangles) {
  for (size_t i = 0; i < 3 * V; i++)
    if (scanf("%lf", points + i) != 1) return 0;
  for (size_t i = 0; i < 3 * F; i++)
    if (scanf("%" SCNu32, triangles + i) != 1) return 0;
  return 1;
}

/* The factor that makes f flat. */
static double flatten(size_t V, double *points) {
  double size = 0, range = 0;
  for (size_t v = 0; v < V; v++) {
    size = fmax(size, hypot(points[3 * v], points[3 * v + 1]));
    range = fmax(range, fabs(points[3 * v + 2]));
  }
  double factor = 0x1p-24 * size / range;
  for (size_t v = 0; v < V; v++) points[3 * v + 2] *= factor;
  return factor;
}

int main(void) {
  size_t V, F;
  if (scanf("%zu %zu", &V, &F) != 2) return 2;
  double *points = malloc(3 * V * sizeof *points), *up = calloc(3 * V, sizeof *up);
  double *normals = malloc(3 * V * sizeof *normals);
  uint32_t *triangles = malloc(3 * F * sizeof *triangles);
  net_local *local = malloc((V + F) * 2 * sizeof *local);
  if (!points || !up || !normals || !triangles || !local || !read_mesh(V, F, points, triangles)) return 2;
  double factor = flatten(V, points);
  for (size_t v = 0; v < V; v++) up[3 * v + 2] = 1;

  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  batten_network_options o = {.struct_size = sizeof o,
                              .normals_given = up,
                              .normal_passes = 1,
                              .weight_power = 3,
                              .direction = BATTEN_DIRECTION_D1,
                              .length = BATTEN_LENGTH_L1};
  net_topology topology = {0};
  net_figures figures;
  batten_status st = net_topology_make(ctx, V, points, F, triangles, &topology);
  if (st == BATTEN_OK) st = net_normals_make(ctx, &topology, &o, normals);
  if (st == BATTEN_OK) st = net_g1(ctx, &topology, &o, normals, local, &figures);
  if (st != BATTEN_OK) fprintf(stderr, "%s\n", batten_error(ctx));
  for (size_t v = 0; st == BATTEN_OK && v < V; v++) {
    const double *n = normals + 3 * v;
    printf("%.17g %.17g\n", -n[0] / n[2] / factor, -n[1] / n[2] / factor);
  }
  net_topology_free(ctx, &topology);
  batten_context_free(ctx);
  free(points), free(up), free(normals), free(triangles), free(local);
  return st != BATTEN_OK;
}
