/* Nearest places: against distances known in closed form, against a search over fine samples, and where it is hard.
 */
#include "mesh/vec.h"
#include "network/surface.h"
#include "network_shapes.h"
#include "tap.h"

static void wave(const double xy[2], double out[3]) {
  double x = xy[0], y = xy[1];
  out[0] = x;
  out[1] = y;
  out[2] = 0.8 * x * x * x - 0.6 * x + 0.5 * x * y * y + 0.4 * y * y * y;
}

/* Distance of a point from the octahedron |x| + |y| + |z| = 1: nearest on the triangle of its octant, by projections
 * onto faces of a simplex. */
static double from_octahedron(const double q[3]) {
  double a[3], sum = 0, best;
  for (int d = 0; d < 3; d++) sum += a[d] = fabs(q[d]);
  if (sum <= 1) return (1 - sum) / sqrt(3);
  bool used[3] = {true, true, true};
  for (;;) { /* project onto the simplex, dropping negative coordinates */
    double excess = -1;
    int left = 0;
    for (int d = 0; d < 3; d++)
      if (used[d]) {
        excess += a[d];
        left++;
      }
    excess /= left;
    bool again = false;
    for (int d = 0; d < 3; d++)
      if (used[d] && a[d] - excess < 0) {
        used[d] = false;
        again = true;
      }
    if (again) continue;
    best = 0;
    for (int d = 0; d < 3; d++) best += used[d] ? excess * excess : a[d] * a[d];
    return sqrt(best);
  }
}

static void test_octahedron(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network *n = network_of(ctx, &s);
  enum { COUNT = 500 };
  double points[COUNT][3], distances[COUNT], worst = 0, place = 0;
  batten_place places[COUNT];
  batten_surface_point p[COUNT];
  uint64_t seed = 2;
  for (size_t i = 0; i < COUNT; i++)
    for (int d = 0; d < 3; d++) points[i][d] = 3 * t_uniform(&seed) - 1.5;
  T_OK(batten_network_closest(ctx, n, COUNT, points[0], places, distances), ctx);
  T_OK(batten_network_evaluate(ctx, n, COUNT, places, p), ctx);
  for (size_t i = 0; i < COUNT; i++) {
    worst = worse(worst, fabs(distances[i] - from_octahedron(points[i])));
    place = worse(place, fabs(distances[i] - vec_distance(p[i].point, points[i])));
  }
  T_RATIO(worst, 1e-14, "octahedron: 500 distances as calculated by hand");
  T_RATIO(place, 1e-15, "the places are at these distances");
  double middle[3] = {0, 0, 0}, distance;
  T_OK(batten_network_closest(ctx, n, 1, middle, places, &distance), ctx);
  T_RATIO(fabs(distance - 1 / sqrt(3)), 1e-15, "from the middle, where all faces are as near");
  batten_network_free(n);
  shape_free(&s);
}

/* Samples of every patch, the best of them refined by ever smaller steps about it. */
static double brute_force(batten_context *ctx, const batten_network *n, const batten_surface_point *samples,
                          size_t rows, const double q[3]) {
  size_t each = rows * (rows + 1) / 2, patches = batten_network_patch_count(n);
  double best = INFINITY;
  size_t candidates[8];
  double at[8];
  int kept = 0;
  for (size_t i = 0; i < patches * each; i++) {
    double d = vec_distance(samples[i].point, q);
    if (kept == 8 && d >= at[7]) continue;
    int k = kept < 8 ? kept++ : 7;
    for (; k > 0 && at[k - 1] > d; k--) {
      at[k] = at[k - 1];
      candidates[k] = candidates[k - 1];
    }
    at[k] = d;
    candidates[k] = i;
  }
  for (int c = 0; c < kept; c++) {
    uint32_t patch = (uint32_t)(candidates[c] / each);
    size_t left = candidates[c] % each, k = 0;
    while (left >= rows - k) left -= rows - k++;
    double u = (double)left / (double)(rows - 1), v = (double)k / (double)(rows - 1), d = at[c];
    for (double step = 1 / (double)rows; step > 1e-9;) {
      static const double way[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}, {1, 1}, {-1, -1}};
      bool better = false;
      for (int w = 0; w < 8; w++) {
        double a = u + step * way[w][0], b = v + step * way[w][1];
        batten_surface_point p;
        a = fmax(0, a);
        b = fmax(0, b);
        if (a + b > 1) {
          double over = (a + b - 1) / 2;
          a = fmin(1, fmax(0, a - over));
          b = 1 - a;
        }
        if (batten_network_evaluate(ctx, n, 1, &(batten_place){patch, a, b}, &p) < 0) exit(1);
        if (vec_distance(p.point, q) < d) {
          d = vec_distance(p.point, q);
          u = a;
          v = b;
          better = true;
        }
      }
      if (!better) step *= 0.5;
    }
    best = fmin(best, d);
  }
  return best;
}

static void against_brute_force(batten_context *ctx, const shape *s, const char *what, double reach, size_t count) {
  enum { ROWS = 12, EACH = ROWS * (ROWS + 1) / 2 };
  batten_network *n = network_of(ctx, s);
  batten_place *all = malloc(s->patches * EACH * sizeof *all), *places = malloc(count * sizeof *places);
  batten_surface_point *samples = malloc(s->patches * EACH * sizeof *samples);
  double *points = malloc(3 * count * sizeof *points), *distances = malloc(count * sizeof *distances);
  size_t at = 0;
  for (uint32_t p = 0; p < s->patches; p++)
    for (int k = 0; k < ROWS; k++)
      for (int j = 0; j + k < ROWS; j++)
        all[at++] = (batten_place){p, (double)j / (ROWS - 1), (double)k / (ROWS - 1)};
  T_OK(batten_network_evaluate(ctx, n, at, all, samples), ctx);
  uint64_t seed = 77;
  for (size_t i = 0; i < 3 * count; i++) points[i] = reach * (2 * t_uniform(&seed) - 1);
  double start = batten_now();
  T_OK(batten_network_closest(ctx, n, count, points, places, distances), ctx);
  printf("# %s: %.0f us a point\n", what, 1e6 * (batten_now() - start) / (double)count);
  double over = -INFINITY, under = 0;
  for (size_t i = 0; i < count; i++) {
    double d = brute_force(ctx, n, samples, ROWS, points + 3 * i);
    over = fmax(over, isnan(distances[i]) ? INFINITY : distances[i] - d);
    under = fmax(under, d - distances[i]);
  }
  T_RATIO(over, 1e-12, "%s: never farther than a search over samples", what);
  T_RATIO(under, 1e-7, "nor much nearer");
  free(distances);
  free(points);
  free(samples);
  free(places);
  free(all);
  batten_network_free(n);
  shape_free((shape *)s);
}

/* Points off the surface along its normal by less than its radius of curvature come back to where they left. */
static void test_feet(batten_context *ctx) {
  shape s = shape_torus(4);
  batten_network *n = network_of(ctx, &s);
  enum { COUNT = 300 };
  batten_place places[COUNT], found[COUNT];
  batten_surface_point p[COUNT], q[COUNT];
  double points[COUNT][3], distances[COUNT];
  uint64_t seed = 4;
  for (size_t i = 0; i < COUNT; i++) {
    double u = t_uniform(&seed), v = (1 - u) * t_uniform(&seed);
    if (i % 3 == 1) v = 0; /* on an edge */
    if (i % 9 == 4) u = 0; /* at a corner */
    places[i] = (batten_place){(uint32_t)(i * 7 % s.patches), u, v};
  }
  T_OK(batten_network_evaluate(ctx, n, COUNT, places, p), ctx);
  double worst = 0, back = 0;
  static const double height[7] = {0, 0.3, -0.3, 1e-3, -1e-6, 1e-9, 1e-13};
  for (size_t i = 0; i < COUNT; i++)
    for (int d = 0; d < 3; d++) points[i][d] = p[i].point[d] + height[i % 7] * p[i].normal[d];
  T_OK(batten_network_closest(ctx, n, COUNT, points[0], found, distances), ctx);
  T_OK(batten_network_evaluate(ctx, n, COUNT, found, q), ctx);
  for (size_t i = 0; i < COUNT; i++) {
    worst = worse(worst, fabs(distances[i] - fabs(height[i % 7])));
    back = worse(back, vec_distance(p[i].point, q[i].point));
  }
  T_RATIO(worst, 1e-13, "heights over the torus, from 0 to 0.3, over edges and corners");
  T_RATIO(back, 3e-11, "and the feet");
  batten_network_free(n);
  shape_free(&s);
}

/* Where whole curves or discs are as near to second order and more. */
static void test_focal_points(batten_context *ctx) {
  shape s = shape_graph(4, 2, 3, shape_cap);
  batten_network *n = network_of(ctx, &s);
  double start = batten_now();
  const double points[4][3] = {{0, 0, -1}, {0, 0, -0.999999}, {0, 0, -1.5}, {1e-9, 0, -1}};
  /* From (0, 0, -z), z > 1: f = r^2 + (z - r^2 / 2)^2 is least where r^2 = 2 z - 2. */
  const double expected[4] = {1, 0.999999, sqrt(1 + 0.25 * 4), 1};
  double distances[4];
  batten_place places[4];
  T_OK(batten_network_closest(ctx, n, 4, points[0], places, distances), ctx);
  T_RATIO(fabs(distances[0] - expected[0]) + fabs(distances[1] - expected[1]) + fabs(distances[3] - 1), 3e-12,
          "cap: at its focal point, and next to it");
  T_RATIO(fabs(distances[2] - expected[2]), 1e-12, "beyond it: a circle is nearest");
  batten_network_free(n);
  shape_free(&s);
  s = shape_graph(3, 3, 0, shape_ridge);
  n = network_of(ctx, &s);
  const double axis[3][3] = {{0, 0.1, -1}, {0, -0.7, -1.2}, {0, 3, -1}};
  T_OK(batten_network_closest(ctx, n, 3, axis[0], places, distances), ctx);
  T_RATIO(fabs(distances[0] - 1) + fabs(distances[1] - sqrt(1.4)) + fabs(distances[2] - sqrt(5)), 3e-12,
          "ridge: on its focal line, below it, and off the end");
  printf("# %.0f us a point\n", 1e6 * (batten_now() - start) / 7);
  batten_network_free(n);
  shape_free(&s);
}

/* From afar the rounding of the distance is more than a millionth part of the surface. */
static void test_far_points(batten_context *ctx) {
  shape s = shape_torus(4);
  batten_network *n = network_of(ctx, &s);
  double start = batten_now(), worst = 0;
  size_t turned = 0;
  for (int e = 2; e < 14; e += 2) {
    uint64_t seed = 5;
    double points[30][3], distances[30], size = pow(10, e);
    batten_place places[30];
    batten_surface_point p[30];
    for (size_t i = 0; i < 30; i++)
      for (int d = 0; d < 3; d++) points[i][d] = size * (2 * t_uniform(&seed) - 1);
    if (batten_network_closest(ctx, n, 30, points[0], places, distances) < 0 ||
        batten_network_evaluate(ctx, n, 30, places, p) < 0)
      worst = INFINITY;
    for (size_t i = 0; i < 30; i++) {
      double way[3];
      vec_sub(points[i], p[i].point, way);
      worst = worse(worst, fabs(distances[i] - vec_norm(way)) / distances[i]);
      vec_normalize(way);
      /* Feet are known to the square root of what the distance is known to. */
      if (!(vec_dot(way, p[i].normal) > (e < 7 ? 1 - 1e-6 : 0.99))) turned++;
    }
  }
  T_RATIO(worst, 4e-15, "from 1e2 to 1e12 away: the places are at the distances");
  T_CHECK(turned == 0, "and their normals point there, but for %zu", turned);
  printf("# %.0f us a point\n", 1e6 * (batten_now() - start) / 180);
  batten_network_free(n);
  shape_free(&s);
}

/* A patch that has collapsed to a long way to and fro, seen from far off: whole curves of places are equally near to
 * what rounding tells. The search ends, and says what it may have missed. */
static void test_degenerate(batten_context *ctx) {
  enum { DEGREE = 6, POINTS = (DEGREE + 1) * (DEGREE + 2) / 2, FINE = 400 };
  double net[POINTS][3], vertices[3][3];
  for (unsigned k = 0, i = 0; k <= DEGREE; k++)
    for (unsigned j = 0; j + k <= DEGREE; j++, i++)
      for (int d = 0; d < 3; d++) net[i][d] = sin((d + 1) * 2.0 * (j + k));
  const size_t corner[3] = {0, DEGREE, POINTS - 1};
  for (int c = 0; c < 3; c++) memcpy(vertices[c], net[corner[c]], sizeof vertices[c]);
  const uint32_t triangle[3] = {0, 1, 2};
  const batten_network_patch patch = {DEGREE, 0, 0, net[0]};
  batten_network *n = NULL;
  T_OK(batten_network_create(ctx, 3, vertices[0], 1, triangle, 1, &patch, 0, NULL, &n), ctx);
  const double points[2][3] = {{0.1, 0.2, 0.1}, {108, 107, -163}};
  batten_place places[2];
  double distances[2];
  batten_status st = batten_network_closest(ctx, n, 2, points[0], places, distances);
  double told = 0;
  const char *by = strstr(batten_error(ctx), "too large by ");
  T_CHECK(st == BATTEN_W_ACCURACY && by && strncmp(batten_error(ctx), "points[1]", 9) == 0, "degenerate: %s (%s)",
          batten_status_name(st), batten_error(ctx));
  if (by) told = strtod(by + strlen("too large by "), NULL);
  T_CHECK(told > 0 && told < 1e-6, "what may be missed is told, and little: %.2g", told);
  /* All that matters is u + v. */
  for (int i = 0; i < 2; i++) {
    double least = INFINITY;
    for (int f = 0; f <= FINE; f++) {
      batten_place place = {0, (double)f / FINE, 0};
      batten_surface_point p;
      if (batten_network_evaluate(ctx, n, 1, &place, &p) < 0) continue;
      least = fmin(least, vec_distance(p.point, points[i]));
    }
    T_CHECK(distances[i] <= least + told, "as near as %d samples: %.12g", FINE, distances[i]);
  }
  batten_network_free(n);
}

static void test_units(batten_context *ctx, batten_context *three) {
  shape s = shape_torus(4), large = shape_torus(4), turned = shape_torus(4);
  shape_move(&large, false, 0x1p80, (double[3]){0, 0, 0});
  shape_move(&turned, true, 1, (double[3]){0, 0, 0});
  batten_network *n[3] = {network_of(ctx, &s), network_of(ctx, &large), network_of(ctx, &turned)};
  enum { COUNT = 200 };
  double points[3][COUNT][3], distances[4][COUNT];
  batten_place places[4][COUNT];
  uint64_t seed = 6;
  for (size_t i = 0; i < COUNT; i++) {
    double *x = points[0][i];
    for (int d = 0; d < 3; d++) {
      x[d] = 6 * t_uniform(&seed) - 3;
      points[1][i][d] = ldexp(x[d], 80);
    }
    points[2][i][0] = (2 * x[0] - x[1] + 2 * x[2]) / 3;
    points[2][i][1] = (2 * x[0] + 2 * x[1] - x[2]) / 3;
    points[2][i][2] = (-x[0] + 2 * x[1] + 2 * x[2]) / 3;
  }
  for (int i = 0; i < 3; i++)
    T_OK(batten_network_closest(ctx, n[i], COUNT, points[i][0], places[i], distances[i]), ctx);
  T_OK(batten_network_closest(three, n[0], COUNT, points[0][0], places[3], distances[3]), three);
  T_CHECK(!memcmp(distances[0], distances[3], sizeof distances[0]) && !memcmp(places[0], places[3], sizeof places[0]),
          "the same bits on three threads");
  bool exact = true;
  double turn = 0;
  for (size_t i = 0; i < COUNT; i++) {
    exact = exact && ldexp(distances[0][i], 80) == distances[1][i] && places[0][i].u == places[1][i].u;
    turn = worse(turn, fabs(distances[0][i] - distances[2][i]));
  }
  T_CHECK(exact, "2^80 times as large: the same places, to the bit");
  T_RATIO(turn, 1e-13, "turned: the same distances");
  double alone;
  batten_place place;
  bool same = true;
  for (size_t i = 0; i < COUNT; i += 17)
    same = same && batten_network_closest(ctx, n[0], 1, points[0][i], &place, &alone) == BATTEN_OK &&
           alone == distances[0][i];
  T_CHECK(same, "one at a time: the same");
  T_OK(batten_network_closest(ctx, n[0], 1, points[0][0], &place, NULL), ctx);
  for (int i = 0; i < 3; i++) batten_network_free(n[i]);
  shape_free(&s);
  shape_free(&large);
  shape_free(&turned);
}

static batten_status find_some(batten_context *ctx, void *arg) {
  batten_network *n = NULL;
  double points[300][3], distances[300];
  batten_place places[300];
  for (int i = 0; i < 300; i++)
    for (int d = 0; d < 3; d++) points[i][d] = sin(i + d);
  distances[0] = -7;
  batten_status st = shape_network(ctx, arg, &n);
  if (st == BATTEN_OK) st = batten_network_closest(ctx, n, 300, points[0], places, distances);
  if (st < 0 && distances[0] != -7) st = BATTEN_E_INTERNAL;
  batten_network_free(n);
  return st;
}

static void test_bad(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network *n = network_of(ctx, &s), *empty = NULL;
  double points[2][3] = {{0, 0, 0}, {1, INFINITY, 2}}, distances[2];
  batten_place places[2];
  T_CHECK(batten_network_closest(NULL, n, 0, NULL, NULL, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_closest(ctx, NULL, 2, points[0], places, distances), BATTEN_E_INVALID, ctx,
           "network: NULL");
  T_STATUS(batten_network_closest(ctx, n, 2, NULL, places, distances), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_network_closest(ctx, n, 2, points[0], NULL, distances), BATTEN_E_INVALID, ctx, "places: NULL");
  T_STATUS(batten_network_closest(ctx, n, 2, points[0], places, distances), BATTEN_E_INVALID, ctx,
           "points[1][1]: inf");
  T_STATUS(batten_network_closest(ctx, n, SIZE_MAX / 8, points[0], places, distances), BATTEN_E_INVALID, ctx,
           "count: ");
  T_OK(batten_network_closest(ctx, n, 0, NULL, NULL, NULL), ctx);
  T_OK(batten_network_create(ctx, 0, NULL, 0, NULL, 0, NULL, 0, NULL, &empty), ctx);
  T_STATUS(batten_network_closest(ctx, empty, 1, points[0], places, distances), BATTEN_E_INVALID, ctx,
           "network: no patches");
  batten_network_free(empty);
  batten_network_free(n);
  t_fail_every_allocation("batten_network_closest", find_some, &s);
  t_cancel_every_progress("batten_network_closest", find_some, &s);
  shape_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1), *three = t_context(NULL, NULL, 3);
  test_octahedron(ctx);
  shape s = shape_graph(3, 3, 2, wave);
  against_brute_force(ctx, &s, "a wave", 1.5, 40);
  s = shape_torus(0);
  against_brute_force(ctx, &s, "a torus", 3, 40);
  test_feet(ctx);
  test_focal_points(ctx);
  test_far_points(ctx);
  test_degenerate(ctx);
  test_units(ctx, three);
  test_bad(ctx);
  batten_context_free(three);
  batten_context_free(ctx);
  return t_done();
}
