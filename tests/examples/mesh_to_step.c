/* A triangle mesh to a smooth surface for CAD, and questions to that surface: a program that embeds batten.
 * Usage: mesh_to_step MESH SURFACE.step X Y Z   prints the place of the surface nearest to X Y Z, with its normal and
 * curvatures. Exit status 0: the surface is proven smooth; 3: look at what is said. */
#include <batten/batten.h>
#include <batten/exchange.h>
#include <stdio.h>
#include <stdlib.h>

/* Called now and then; another value than 0 would cancel. */
static int show(void *user, const char *phase, double fraction) {
  (void)user;
  fprintf(stderr, "\r%-10s %3.0f %%", phase, 100 * fraction);
  return 0;
}

/* What a milling machine or a simulation would ask. */
static batten_status ask(batten_context *ctx, const batten_network *network, const double *from) {
  batten_place place;
  batten_surface_point at;
  double distance;
  batten_status status = batten_network_closest(ctx, network, 1, from, &place, &distance);
  if (status >= 0) status = batten_network_evaluate(ctx, network, 1, &place, &at);
  if (status < 0) return status;
  printf("nearest   %.9g %.9g %.9g, %.9g away, on triangle %lu\n", at.point[0], at.point[1], at.point[2], distance,
         (unsigned long)batten_network_get_patch(network, place.patch).face);
  printf("normal    %.9g %.9g %.9g\n", at.normal[0], at.normal[1], at.normal[2]);
  printf("curvature %.6g and %.6g\n", at.principal[0], at.principal[1]);
  return status;
}

int main(int argc, char **argv) {
  if (argc != 6) {
    fprintf(stderr, "usage: mesh_to_step MESH SURFACE.step X Y Z\n");
    return 2;
  }
  double from[3] = {strtod(argv[3], NULL), strtod(argv[4], NULL), strtod(argv[5], NULL)};
  batten_context_options options = batten_context_options_default();
  options.threads = 2;
  options.progress = show;
  batten_context *ctx = NULL;
  if (batten_context_new(&options, &ctx) < 0) return 1;
  batten_mesh *read = NULL, *mesh = NULL;
  batten_network *network = NULL;
  batten_network_info info;

  batten_status status = batten_read_mesh(ctx, argv[1], &read);
  if (status >= 0) status = batten_mesh_repair(ctx, read, NULL, &mesh, NULL); /* exports are rarely clean */
  if (status >= 0) status = batten_network_build(ctx, mesh, NULL, &network, &info);
  batten_status built = status;
  if (built > 0) fprintf(stderr, "\nmesh_to_step: %s\n", batten_error(ctx));
  if (status >= 0) status = batten_write_network(ctx, network, NULL, argv[2]);
  if (status >= 0) status = ask(ctx, network, from);
  if (status < 0)
    fprintf(stderr, "\nmesh_to_step: %s\n", batten_error(ctx));
  else
    printf("joints    %.1e degrees at most over %zu facets\n", info.normal_jump_max_deg, info.faces);

  batten_network_free(network);
  batten_mesh_free(mesh);
  batten_mesh_free(read);
  batten_context_free(ctx);
  return status < 0 ? 1 : built == BATTEN_OK ? 0 : 3;
}
