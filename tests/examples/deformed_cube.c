/* The paper's figure 5: a cube from 90 random surface points with the R-union of two balls as carrier, then deformed
 * by moving the balls apart while the spline stays. [Savchenko et al. 1995, section 6] Usage: deformed_cube FOLDER
 * writes FOLDER/cube.png and FOLDER/cube-deformed.png */
#include "scenes.h"

#include <batten/exchange.h>
#include <stdio.h>

/* Two balls of radius 0.8 at x = -shift and +shift, joined smoothly. */
static batten_status two_balls(batten_context *ctx, double shift, batten_carrier **out) {
  double left[3] = {-shift, 0, 0}, right[3] = {shift, 0, 0};
  batten_carrier *a = NULL, *b = NULL;
  batten_status status = batten_carrier_ball(ctx, 3, left, 0.8, &a);
  if (status >= 0) status = batten_carrier_ball(ctx, 3, right, 0.8, &b);
  if (status >= 0) status = batten_carrier_union(ctx, a, b, 0, out);
  batten_carrier_free(a); /* the union keeps its own hold */
  batten_carrier_free(b);
  return status;
}

static batten_status picture(batten_context *ctx, const batten_solid *solid, const char *folder, const char *name) {
  size_t count;
  const double *points = batten_solid_points(solid, &count);
  batten_field field = batten_solid_field(solid);
  batten_polygonize_options o = batten_polygonize_options_default();
  for (int c = 0; c < 3; c++) o.lower[c] = -2.5, o.upper[c] = 2.5;
  o.cell = 0.06;
  batten_mesh *mesh = NULL;
  batten_status status = batten_polygonize(ctx, &field, count, points, &o, &mesh, NULL);
  if (status >= 0) {
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    batten_picture_options p = batten_picture_options_default();
    p.width = 800, p.height = 600;
    status = batten_picture_mesh(ctx, mesh, &p, path);
  }
  batten_mesh_free(mesh);
  return status;
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  batten_carrier *near_balls = NULL, *far_balls = NULL;
  batten_solid *cube = NULL, *deformed = NULL;
  double points[90][3];
  scene_cube_points(1, 90, &points[0][0]);

  batten_status status = two_balls(ctx, 0.4, &near_balls);
  batten_solid_options o = batten_solid_options_default();
  o.carrier = near_balls;
  o.orientation = BATTEN_ORIENT_NEVER; /* as the paper: the carrier decides */
  if (status >= 0) status = batten_solid_fit(ctx, 3, 90, &points[0][0], &o, &cube, NULL);
  if (status >= 0) status = two_balls(ctx, 0.6, &far_balls);
  if (status >= 0) status = batten_solid_with_carrier(ctx, cube, far_balls, &deformed);
  if (status >= 0) status = picture(ctx, cube, argv[1], "cube.png");
  if (status >= 0) status = picture(ctx, deformed, argv[1], "cube-deformed.png");
  if (status < 0) fprintf(stderr, "deformed_cube: %s\n", batten_error(ctx));

  batten_solid_free(deformed);
  batten_solid_free(cube);
  batten_carrier_free(far_balls);
  batten_carrier_free(near_balls);
  batten_context_free(ctx);
  return status < 0;
}
