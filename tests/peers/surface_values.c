/* For compare_surface.py: reads degrees, numbers of knots, knots, control points [n_0][n_1][3], a number of places
 * and places [count][2]; prints point, first and second derivatives of each on a line. */
#include <batten/surface.h>
#include <stdio.h>
#include <stdlib.h>

static int read_numbers(size_t count, double *out) {
  for (size_t i = 0; i < count; i++)
    if (scanf("%lf", &out[i]) != 1) return 0;
  return 1;
}

int main(void) {
  batten_surface_form f = {.degree = {0}};
  batten_context *ctx = NULL;
  batten_surface *s = NULL;
  double *knots[2] = {NULL, NULL}, *control = NULL, *places = NULL;
  batten_surface_point *out = NULL;
  size_t count, points = 3;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  if (scanf("%u %u %zu %zu %zu", &f.degree[0], &f.degree[1], &f.knot_count[0], &f.knot_count[1], &count) != 5)
    return 1;
  for (int k = 0; k < 2; k++) {
    knots[k] = malloc(f.knot_count[k] * sizeof *knots[k]);
    if (!knots[k] || !read_numbers(f.knot_count[k], knots[k])) return 1;
    f.knots[k] = knots[k];
    points *= f.knot_count[k] - f.degree[k] - 1;
  }
  f.control_points = control = malloc(points * sizeof *control);
  places = malloc(2 * count * sizeof *places);
  out = malloc(count * sizeof *out);
  if (!control || !places || !out || !read_numbers(points, control) || !read_numbers(2 * count, places)) return 1;
  if (batten_surface_create(ctx, &f, &s) < 0 || batten_surface_evaluate(ctx, s, count, places, out) < 0) {
    fprintf(stderr, "%s\n", batten_error(ctx));
    return 1;
  }
  for (size_t i = 0; i < count; i++) {
    const double *vectors[6] = {out[i].point, out[i].du, out[i].dv, out[i].duu, out[i].duv, out[i].dvv};
    for (int k = 0; k < 18; k++) printf("%.17g%c", vectors[k / 3][k % 3], k == 17 ? '\n' : ' ');
  }
  batten_surface_free(s);
  batten_context_free(ctx);
  free(out);
  free(places);
  free(control);
  free(knots[1]);
  free(knots[0]);
  return 0;
}
