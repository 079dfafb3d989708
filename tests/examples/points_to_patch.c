/* A cloud of points of a convex part to one Bezier patch for CAD, proven convex: a program that embeds batten.
 * Usage: points_to_patch POINTS PATCH.step   prints what is known of the patch. Exit status 0: proven strictly
 * convex; 3: look at what is said. */
#include <batten/batten.h>
#include <batten/exchange.h>
#include <math.h>
#include <stdio.h>

int main(int argc, char **argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: points_to_patch POINTS PATCH.step\n");
    return 2;
  }
  batten_context *ctx = NULL;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  batten_cloud cloud = {0};
  batten_surface *patch = NULL, *free_patch = NULL;
  batten_convex_info info;
  batten_read_points_options reading = batten_read_points_options_default();
  batten_convex_options options = batten_convex_options_default();
  reading.n = 3;

  batten_status status = batten_read_points(ctx, argv[1], &reading, &cloud);
  options.parameters = cloud.parameters; /* NULL: from the points */
  options.weights = cloud.weights;
  if (cloud.parameters) /* whatever box they fill */
    for (int i = 0; i < 4; i++) options.domain[i / 2][i % 2] = NAN;
  if (status >= 0) status = batten_convex_fit(ctx, cloud.count, cloud.points, &options, &patch, &free_patch, &info);
  batten_status fitted = status;
  if (fitted > 0) fprintf(stderr, "points_to_patch: %s\n", batten_error(ctx));
  if (status >= 0) status = batten_write_surface(ctx, patch, NULL, argv[2]);
  if (status < 0) {
    fprintf(stderr, "points_to_patch: %s\n", batten_error(ctx));
  } else {
    printf("points    %zu, off by %.3g (root of mean square), %.3g at most\n", cloud.count, info.rms, info.max_error);
    printf("curvature Gaussian %.4g .. %.4g; without the condition %.4g .. %.4g\n", info.gauss_min, info.gauss_max,
           info.gauss_min_unconstrained, info.gauss_max_unconstrained);
    if (info.convexity.certified) printf("proven    K >= %.3g everywhere\n", info.convexity.margin_min);
  }

  batten_surface_free(patch);
  batten_surface_free(free_patch);
  batten_cloud_free(ctx, &cloud);
  batten_context_free(ctx);
  return status < 0 ? 1 : fitted == BATTEN_OK ? 0 : 3;
}
