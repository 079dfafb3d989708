/* The search for surfaces by bounds: every one of scattered balls is found and no other thing, whole meshes and
 * outlines without seeds, boxes with nothing in them, bad input. */
#include <batten/carrier.h>
#include <batten/mesh.h>
#include <batten/solid.h>

#include "scenes.h"
#include "tap.h"

enum { BALLS = 20 };

typedef struct balls {
  unsigned n;
  double center[BALLS][3], radius[BALLS];
  batten_carrier *all;
} balls;

/* Balls apart from each other in [0, 1]^n, joined in pairs. */
static void make_balls(batten_context *ctx, unsigned n, double radius, balls *b) {
  batten_carrier *level[BALLS], *joined;
  uint64_t seed = 11 + n;
  *b = (balls){.n = n};
  for (size_t made = 0; made < BALLS;) {
    double least = INFINITY;
    for (unsigned k = 0; k < n; k++) b->center[made][k] = 0.1 + 0.8 * t_uniform(&seed);
    for (size_t i = 0; i < made; i++) {
      double square = 0;
      for (unsigned k = 0; k < n; k++) square += pow(b->center[made][k] - b->center[i][k], 2);
      least = fmin(least, sqrt(square));
    }
    if (least < 3.5 * radius) continue;
    b->radius[made] = radius * (0.7 + 0.3 * t_uniform(&seed));
    made++;
  }
  size_t count = BALLS;
  for (size_t i = 0; i < BALLS; i++) T_OK(batten_carrier_ball(ctx, n, b->center[i], b->radius[i], &level[i]), ctx);
  while (count > 1) {
    for (size_t i = 0; i < count / 2; i++) {
      T_OK(batten_carrier_union(ctx, level[2 * i], level[2 * i + 1], 1, &joined), ctx);
      batten_carrier_free(level[2 * i]);
      batten_carrier_free(level[2 * i + 1]);
      level[i] = joined;
    }
    if (count % 2) level[count / 2] = level[count - 1];
    count = (count + 1) / 2;
  }
  b->all = level[0];
}

/* How many balls have a seed within a cell of their surface; *stray: seeds that no ball has. */
static size_t balls_seen(const balls *b, size_t count, const double *seeds, double cell, size_t *stray) {
  bool seen[BALLS] = {false};
  *stray = 0;
  for (size_t s = 0; s < count; s++) {
    bool of_some = false;
    for (size_t i = 0; i < BALLS; i++) {
      double square = 0;
      for (unsigned k = 0; k < b->n; k++) square += pow(seeds[s * b->n + k] - b->center[i][k], 2);
      if (fabs(sqrt(square) - b->radius[i]) > cell) continue;
      seen[i] = of_some = true;
    }
    *stray += !of_some;
  }
  size_t total = 0;
  for (size_t i = 0; i < BALLS; i++) total += seen[i];
  return total;
}

static void test_balls(batten_context *ctx) {
  for (unsigned n = 2; n <= 3; n++) {
    balls b;
    const double lower[3] = {0, -0.1, 0}, upper[3] = {1, 1, 1.3}, cell = n == 2 ? 0.01 : 0.02;
    double *seeds = NULL;
    size_t count = 0, stray = 0;
    make_balls(ctx, n, n == 2 ? 0.03 : 0.04, &b);
    batten_field f = batten_carrier_field(b.all);
    T_OK(batten_find_seeds(ctx, &f, lower, upper, cell, &count, &seeds), ctx);
    size_t seen = balls_seen(&b, count, seeds, cell, &stray);
    T_CHECK(seen == BALLS && stray == 0, "%u-D: %zu of %d balls have seeds, %zu seeds, %zu stray", n, seen, BALLS,
            count, stray);
    batten_free(ctx, seeds);
    batten_polygonize_options o = batten_polygonize_options_default();
    batten_polygonize_info info;
    memcpy(o.lower, lower, sizeof lower);
    memcpy(o.upper, upper, sizeof upper);
    if (n == 3) {
      batten_mesh *mesh = NULL;
      batten_mesh_measures m;
      o.cell = 0.012;
      double volume = 0;
      for (size_t i = 0; i < BALLS; i++) volume += 4 * SCENE_PI / 3 * pow(b.radius[i], 3);
      T_OK(batten_polygonize(ctx, &f, 0, NULL, &o, &mesh, &info), ctx);
      T_OK(batten_mesh_measure(ctx, mesh, &m), ctx);
      T_CHECK(m.components == BALLS && m.closed && m.manifold, "mesh without seeds: %zu components, %zu evaluations",
              m.components, info.evaluations);
      T_RATIO(fabs(m.volume / volume - 1), 0.06,
              "volume of the balls, less by the chords of cells of a third of a radius");
      batten_mesh_free(mesh);
    } else {
      batten_outline *outline = NULL;
      T_OK(batten_trace_outline(ctx, &f, 0, NULL, &o, &outline, &info), ctx);
      T_CHECK(batten_outline_loop_count(outline) == BALLS, "outline without seeds: %zu loops, cell %.3g",
              batten_outline_loop_count(outline), info.cell);
      batten_outline_free(outline);
    }
    batten_carrier_free(b.all);
  }
}

/* One solid of points, without seeds and with its own: the same mesh measures. */
static void test_solid(batten_context *ctx) {
  enum { COUNT = 600 };
  static double points[COUNT * 3];
  double lower[3], upper[3];
  scene_sphere_points(3, COUNT, points);
  for (size_t i = 0; i < COUNT; i++) points[3 * i] *= 1.5;
  batten_solid_options o = batten_solid_options_default();
  o.check_cells = 12;
  batten_solid *s = NULL;
  T_OK(batten_solid_fit(ctx, 3, COUNT, points, &o, &s, NULL), ctx);
  batten_solid_box(s, lower, upper);
  batten_polygonize_options p = batten_polygonize_options_default();
  p.cell = 0.1;
  for (int k = 0; k < 3; k++) {
    p.lower[k] = lower[k] - 0.4;
    p.upper[k] = upper[k] + 0.4;
  }
  batten_field f = batten_solid_field(s);
  batten_mesh *mesh[2] = {NULL, NULL};
  batten_mesh_measures m[2];
  batten_polygonize_info info[2];
  T_OK(batten_polygonize(ctx, &f, 0, NULL, &p, &mesh[0], &info[0]), ctx);
  T_OK(batten_polygonize(ctx, &f, COUNT, points, &p, &mesh[1], &info[1]), ctx);
  T_OK(batten_mesh_measure(ctx, mesh[0], &m[0]), ctx);
  T_OK(batten_mesh_measure(ctx, mesh[1], &m[1]), ctx);
  T_CHECK(m[0].components == 1 && m[0].closed && m[0].triangles == m[1].triangles && m[0].volume == m[1].volume,
          "a solid found by its bounds is the one found from its points: volume %.6g, %.6g; %zu and %zu evaluations",
          m[0].volume, m[1].volume, info[0].evaluations, info[1].evaluations);
  batten_mesh_free(mesh[0]);
  batten_mesh_free(mesh[1]);
  batten_solid_free(s);
}

/* ---- what cannot be found, bad input ------------------------------------------------------------- */

static batten_status find(batten_context *ctx, void *arg) {
  const double lower[3] = {-1, -1, -1}, upper[3] = {1, 1, 1};
  batten_field f = {0};
  batten_carrier *ball = NULL;
  double *seeds = NULL;
  size_t count;
  (void)arg;
  batten_status st = batten_carrier_ball(ctx, 3, (double[]){0.1, 0.2, 0}, 0.5, &ball);
  if (st >= 0) f = batten_carrier_field(ball);
  if (st >= 0) st = batten_find_seeds(ctx, &f, lower, upper, 0.2, &count, &seeds);
  batten_free(ctx, seeds);
  batten_carrier_free(ball);
  return st;
}

static void test_bad(batten_context *ctx) {
  double lower[3] = {-1, -1, -1}, upper[3] = {1, 1, 1}, *seeds = NULL;
  size_t count = 77;
  batten_carrier *ball = NULL;
  T_OK(batten_carrier_ball(ctx, 3, (double[]){3, 0, 0}, 0.5, &ball), ctx);
  batten_field f = batten_carrier_field(ball), bare = f;
  bare.bounds = NULL;
#define FIND(field, cell) batten_find_seeds(ctx, field, lower, upper, cell, &count, &seeds)
  T_STATUS(FIND(&f, 0.1), BATTEN_E_NOT_FOUND, ctx, "changes its sign nowhere in the box");
  T_STATUS(FIND(&bare, 0.1), BATTEN_E_INVALID, ctx, "field: without bounds");
  T_STATUS(FIND(NULL, 0.1), BATTEN_E_INVALID, ctx, "field: NULL");
  T_STATUS(FIND(&f, 0), BATTEN_E_INVALID, ctx, "cell: 0; give a length > 0");
  T_STATUS(FIND(&f, NAN), BATTEN_E_INVALID, ctx, "cell: nan");
  T_STATUS(FIND(&f, 1e-7), BATTEN_E_TOO_LARGE, ctx, "cell: 1e-07, under a millionth of the box");
  lower[1] = 1;
  T_STATUS(FIND(&f, 0.1), BATTEN_E_INVALID, ctx, "lower[1], upper[1]: 1, 1; give lower < upper");
  lower[1] = -INFINITY;
  T_STATUS(FIND(&f, 0.1), BATTEN_E_INVALID, ctx, "lower[1], upper[1]: -inf, 1");
  lower[1] = -1;
  T_STATUS(batten_find_seeds(ctx, &f, NULL, upper, 0.1, &count, &seeds), BATTEN_E_INVALID, ctx, "lower: NULL");
  T_STATUS(batten_find_seeds(ctx, &f, lower, upper, 0.1, NULL, &seeds), BATTEN_E_INVALID, ctx, "count: NULL");
  bare.dimension = 1;
  bare.bounds = f.bounds;
  T_STATUS(FIND(&bare, 0.1), BATTEN_E_INVALID, ctx, "field.dimension: 1");
  T_CHECK(count == 77 && !seeds, "nothing is put out on failure");
#undef FIND
  batten_carrier_free(ball);
  t_fail_every_allocation("search", find, NULL);
  t_cancel_every_progress("search", find, NULL);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_balls(ctx);
  test_solid(ctx);
  test_bad(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
