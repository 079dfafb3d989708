/* For compare_convex.py: reads degrees, spans, gap_tol, rounds, a number of points and the points; fits a convex
 * function without tension. Prints status, objective, its lower bound, lsq, its lower bound and whether it is
 * certified, then the coefficients of the unconstrained fit and those of the convex one, each on a line. */
#include <batten/convex.h>
#include <stdio.h>
#include <stdlib.h>

static void print_heights(const batten_surface *surface) {
  batten_surface_form f = batten_surface_get(surface);
  size_t count = (f.knot_count[0] - f.degree[0] - 1) * (f.knot_count[1] - f.degree[1] - 1);
  for (size_t i = 0; i < count; i++) printf("%.17g%c", f.control_points[3 * i + 2], i + 1 == count ? '\n' : ' ');
}

int main(void) {
  batten_convex_function_options o = batten_convex_function_options_default();
  batten_convex_function_info info;
  batten_context *ctx = NULL;
  batten_surface *convex = NULL, *unconstrained = NULL;
  size_t count;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  if (scanf("%u %u %u %u %lf %u %zu", &o.degree[0], &o.degree[1], &o.spans[0], &o.spans[1], &o.gap_tol, &o.rounds,
            &count) != 7)
    return 1;
  double *points = malloc(3 * count * sizeof *points);
  if (!points) return 1;
  for (size_t i = 0; i < 3 * count; i++)
    if (scanf("%lf", &points[i]) != 1) return 1;
  o.tension = 0;
  for (int k = 0; k < 2; k++) o.domain[k][0] = -1, o.domain[k][1] = 1;
  batten_status st = batten_convex_function_fit(ctx, count, points, &o, &convex, &unconstrained, &info);
  if (st < 0) {
    fprintf(stderr, "%s: %s\n", batten_status_name(st), batten_error(ctx));
    return 1;
  }
  printf("%d %.17g %.17g %.17g %.17g %d\n", (int)st, info.objective, info.objective_lower, info.lsq, info.lsq_lower,
         info.convexity.certified);
  print_heights(unconstrained);
  print_heights(convex);
  batten_surface_free(unconstrained);
  batten_surface_free(convex);
  batten_context_free(ctx);
  free(points);
  return 0;
}
