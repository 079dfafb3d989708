/* What can be asked of a surface: millions of places a second, nearest places, meshes, measures, the
 * proof of convexity of a bowl whose control points are moved a little; by degree, on one
 * and two threads. */
#include "surface_shapes.h"

enum { PLACES = 200000, POINTS = 2000, REPEATS = 3 };

typedef struct data {
  double *places, *points, *near, *distances;
  batten_surface_point *out;
} data;

/* Seconds of the best of several calls: 0 evaluate, 1 closest, 2 tessellate, 3 measure, 4 certify. */
static double seconds(batten_context *ctx, const batten_surface *s, int what, const data *d) {
  double least = INFINITY;
  for (int k = 0; k < REPEATS; k++) {
    batten_surface_tessellate_options o = batten_surface_tessellate_options_default();
    batten_surface_measures measures;
    batten_convexity convexity = {.certified = 1};
    batten_mesh *mesh = NULL;
    o.density = 64;
    double start = batten_now();
    batten_status st = what == 0   ? batten_surface_evaluate(ctx, s, PLACES, d->places, d->out)
                       : what == 1 ? batten_surface_closest(ctx, s, POINTS, d->points, d->near, d->distances)
                       : what == 2 ? batten_surface_tessellate(ctx, s, &o, &mesh)
                       : what == 3 ? batten_surface_measure(ctx, s, &measures)
                                   : batten_surface_certify_convex(ctx, s, NULL, &convexity);
    least = st < 0 || !convexity.certified ? NAN : fmin(least, batten_now() - start);
    batten_mesh_free(mesh);
  }
  return least;
}

int main(void) {
  static const unsigned cases[][2] = {{2, 1}, {3, 1}, {3, 8}, {5, 4}, {7, 1}, {9, 1}}; /* degree, spans */
  data d = {malloc(PLACES * 2 * sizeof(double)), malloc(POINTS * 3 * sizeof(double)),
            malloc(POINTS * 2 * sizeof(double)), malloc(POINTS * sizeof(double)),
            malloc(PLACES * sizeof(batten_surface_point))};
  if (!d.places || !d.points || !d.near || !d.distances || !d.out) return 1;
  printf(
      "batten %s\n\n| degree | spans | threads | places, 1e6/s | nearest, us a point | mesh, 64 a span, ms | "
      "measure, ms | proof, ms |\n|---|---|---|---|---|---|---|---|\n",
      batten_version());
  for (size_t k = 0; k < sizeof cases / sizeof *cases; k++)
    for (unsigned threads = 1; threads <= 2; threads++) {
      surface_case c = surface_case_random(cases[k][0], cases[k][0], cases[k][1], cases[k][1], 1, 7);
      batten_context *ctx = t_context(NULL, NULL, threads);
      batten_surface *s = surface_case_make(ctx, &c);
      uint64_t seed = 3;
      for (size_t i = 0; i < PLACES; i++) surface_case_place(&c, &seed, d.places + 2 * i);
      for (size_t i = 0; i < POINTS; i++) {
        const double lower[3] = {-0.5, -0.5, -1}, size[3] = {3, 2, 2};
        for (size_t x = 0; x < 3; x++) d.points[3 * i + x] = lower[x] + size[x] * t_uniform(&seed);
      }
      double evaluate = PLACES / seconds(ctx, s, 0, &d) / 1e6, closest = seconds(ctx, s, 1, &d) * 1e6 / POINTS;
      double mesh = seconds(ctx, s, 2, &d) * 1e3, measure = seconds(ctx, s, 3, &d) * 1e3;
      /* Without what makes it one polynomial of degree 2. */
      surface_case b = surface_case_bowl(cases[k][0], cases[k][1]);
      for (size_t i = 0; i < b.points[0] * b.points[1]; i++) b.control[i][2] += 1e-3 * t_uniform(&seed);
      batten_surface *bowl = surface_case_make(ctx, &b);
      double proof = seconds(ctx, bowl, 4, &d) * 1e3;
      batten_surface_free(bowl);
      printf("| %u | %u x %u | %u | %.2f | %.1f | %.2f | %.1f | %.2f |\n", cases[k][0], cases[k][1], cases[k][1],
             threads, evaluate, closest, mesh, measure, proof);
      fflush(stdout);
      batten_surface_free(s);
      batten_context_free(ctx);
    }
  free(d.out);
  free(d.distances);
  free(d.near);
  free(d.points);
  free(d.places);
  return 0;
}
