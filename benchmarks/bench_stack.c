/* Solids of sections: the time of fit and surface beside one spline in space through the same centres, threads, and
 * how errors fall with the number of slices. [Savchenko et al. 1995, sections 4 and 5.5] bench-stack [most sections =
 * 100]
 *
 * 1. A torus that leans by 45 degrees, 10, 30, 100 parallel slices: section functions, surface, the same by one
 *    spline in space (kernel r^3) through the same centres, which stops at CENTERS_MOST.
 * 2. The same on 1 and 2 threads of batten's own.
 * 3. Mean and largest distance of the surface's vertices from the true torus, for each blend; denser points.
 * 4. The paper's test function, 50 nodes on each of 10 .. 100 slices: root mean square at 469 random points, range
 *    normalised to [0, 8.4] as in the paper.
 *
 * OPENBLAS_NUM_THREADS=1 for BLAS. */
#include <batten/batten.h>
#include <stdio.h>

#include "stack_function.h"
#include "stack_scenes.h"

enum { CENTERS_MOST = 12000, REPEATS = 3 };
static const double LEAN = SCENE_PI / 4;
static const double COARSE = 0.1, FINE = 0.04; /* distances of neighbouring points */

static batten_context *new_context(unsigned threads) {
  batten_context_options o = batten_context_options_default();
  batten_context *ctx = NULL;
  o.threads = threads;
  if (batten_context_new(&o, &ctx) < 0) {
    fprintf(stderr, "bench-stack: no context\n");
    exit(1);
  }
  return ctx;
}

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double median(double *values) {
  qsort(values, REPEATS, sizeof *values, by_value);
  return values[REPEATS / 2];
}

typedef struct timing {
  bool done;
  size_t centers, triangles;
  double fit, surface; /* medians */
  double mean, most;   /* distance from the torus, outer radius 1 */
} timing;

/* Between the first and the last plane: what closes the ends is a rule, not data. */
static void torus_distance(const batten_mesh *mesh, double end, timing *t) {
  size_t n = batten_mesh_vertex_count(mesh), taken = 0;
  const double *v = batten_mesh_vertices(mesh);
  for (size_t i = 0; i < n; i++) {
    if (fabs(v[3 * i + 2]) > end) continue;
    double d = fabs(scene_leaning_torus(LEAN, v + 3 * i));
    t->mean += d;
    t->most = fmax(t->most, d);
    taken++;
  }
  t->mean /= (double)taken;
  t->triangles = batten_mesh_triangle_count(mesh);
}

/* Fit and surface, medians of REPEATS (of one where repeats is false). */
static timing measure(batten_context *ctx, size_t sections, double spacing, const batten_stack_options *o,
                      bool repeat) {
  stack_scene s = {0};
  timing t = {0};
  double fit[REPEATS], surface[REPEATS];
  size_t repeats = repeat ? REPEATS : 1;
  stack_scene_leaning_torus(&s, LEAN, sections, spacing);
  const batten_section *given = stack_scene_sections(&s);
  for (size_t k = 0; k < repeats; k++) {
    batten_solid *solid = NULL;
    batten_mesh *mesh = NULL;
    batten_stack_info info;
    batten_polygonize_options p = batten_polygonize_options_default();
    p.cell = 0.03;
    double start = batten_now();
    batten_status st = batten_stack_build(ctx, sections, given, o, &solid, &info, NULL, NULL);
    fit[k] = batten_now() - start;
    start = batten_now();
    if (st >= 0) {
      batten_field field = batten_solid_field(solid);
      size_t seeds;
      const double *points = batten_solid_points(solid, &seeds);
      st = batten_polygonize(ctx, &field, seeds, points, &p, &mesh, NULL);
    }
    surface[k] = batten_now() - start;
    if (st < 0) printf("%zu sections: %s\n", sections, batten_error(ctx));
    if (st >= 0 && k + 1 == repeats) {
      t.done = true;
      t.centers = info.centers;
      torus_distance(mesh, given[sections - 1].origin[2], &t);
    }
    batten_mesh_free(mesh);
    batten_solid_free(solid);
    if (st < 0) break;
  }
  if (!repeat) {
    t.fit = fit[0];
    t.surface = surface[0];
  } else if (t.done) {
    t.fit = median(fit);
    t.surface = median(surface);
  }
  stack_scene_free(&s);
  return t;
}

static void run_times(batten_context *ctx, size_t most) {
  printf(
      "\n## Time against one spline in space, one thread\n\n"
      "| sections | centres | sections: fit, s | surface, s | in space: fit, s | surface, s | fit, ratio |\n"
      "|---|---|---|---|---|---|---|\n");
  static const size_t counts[] = {10, 30, 100};
  for (size_t i = 0; i < 3 && counts[i] <= most; i++) {
    batten_stack_options o = batten_stack_options_default();
    timing a = measure(ctx, counts[i], COARSE, &o, true), b = {0};
    o.route = BATTEN_ROUTE_SPACE;
    if (a.done && a.centers <= CENTERS_MOST) b = measure(ctx, counts[i], COARSE, &o, false);
    printf("| %zu | %zu | %.3f | %.2f |", counts[i], a.centers, a.fit, a.surface);
    if (b.done)
      printf(" %.2f | %.2f | %.0f |\n", b.fit, b.surface, b.fit / a.fit);
    else
      printf(" - | - | - |\n");
    fflush(stdout);
  }
}

static void run_threads(size_t most) {
  printf(
      "\n## Threads\n\n| sections | fit on 1, s | on 2, s | ratio | surface on 1, s | on 2, s | ratio |\n"
      "|---|---|---|---|---|---|---|\n");
  batten_context *one = new_context(1), *two = new_context(2);
  batten_stack_options o = batten_stack_options_default();
  static const size_t counts[] = {10, 30, 100};
  for (size_t i = 0; i < 3 && counts[i] <= most; i++) {
    timing a = measure(one, counts[i], COARSE, &o, true), b = measure(two, counts[i], COARSE, &o, true);
    printf("| %zu | %.3f | %.3f | %.2f | %.2f | %.2f | %.2f |\n", counts[i], a.fit, b.fit, a.fit / b.fit, a.surface,
           b.surface, a.surface / b.surface);
    fflush(stdout);
  }
  batten_context_free(one);
  batten_context_free(two);
}

static void run_torus(batten_context *ctx) {
  static const struct {
    const char *name;
    batten_stack_between between;
    double saturation;
  } ways[] = {{"linear", BATTEN_BETWEEN_LINEAR, 2},
              {"monotone", BATTEN_BETWEEN_MONOTONE, 2},
              {"natural (default)", BATTEN_BETWEEN_NATURAL, 2},
              {"natural, no saturation", BATTEN_BETWEEN_NATURAL, INFINITY},
              {"not-a-knot, no saturation", BATTEN_BETWEEN_NOT_A_KNOT, INFINITY}};
  static const size_t counts[] = {8, 12, 24};
  printf("\n## Distance from the true torus between the end planes, outer radius 1: mean / largest\n\n| blend |");
  for (size_t i = 0; i < 3; i++) printf(" %zu slices |", counts[i]);
  printf("\n|---|---|---|---|\n");
  for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
    batten_stack_options o = batten_stack_options_default();
    o.between = ways[w].between;
    o.saturation = ways[w].saturation;
    o.ends[0] = o.ends[1] = BATTEN_END_ROUNDED;
    o.end_height[0] = o.end_height[1] = 0.5;
    printf("| %s |", ways[w].name);
    for (size_t i = 0; i < 3; i++) {
      timing t = measure(ctx, counts[i], FINE, &o, false);
      printf(" %.5f / %.4f |", t.mean, t.most);
    }
    printf("\n");
    fflush(stdout);
  }
}

static void run_function(batten_context *ctx) {
  static const struct {
    const char *name;
    batten_stack_between between;
  } ways[] = {{"linear", BATTEN_BETWEEN_LINEAR},
              {"monotone", BATTEN_BETWEEN_MONOTONE},
              {"natural", BATTEN_BETWEEN_NATURAL},
              {"not-a-knot", BATTEN_BETWEEN_NOT_A_KNOT}};
  static const size_t counts[] = {10, 20, 50, 100};
  printf("\n## The paper's test function: root mean square error, 50 nodes on each slice\n\n| blend |");
  for (size_t i = 0; i < 4; i++) printf(" %zu slices |", counts[i]);
  printf("\n|---|---|---|---|---|\n");
  for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
    printf("| %s |", ways[w].name);
    for (size_t i = 0; i < 4; i++) printf(" %.2g |", function_error(ctx, counts[i], 50, ways[w].between));
    printf("\n");
    fflush(stdout);
  }
}

int main(int argc, char **argv) {
  size_t most = argc > 1 ? (size_t)strtoul(argv[1], NULL, 10) : 100;
  batten_context *ctx = new_context(1);
  printf("# Solids of sections\n");
  run_times(ctx, most);
  run_threads(most);
  run_torus(ctx);
  run_function(ctx);
  batten_context_free(ctx);
  return 0;
}
