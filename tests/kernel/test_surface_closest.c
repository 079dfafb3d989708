/* Nearest places of surfaces: known feet, dense sampling, other knots, units and frames. */
#include "mesh/vec.h"
#include "surface_shapes.h"

#include <float.h>

/* ---- known feet ---------------------------------------------------------------------------------- */

/* The bowl is a part of a convex body: from below, along its normals, any place is the nearest, from however far. In
 * a corner and on the sides so are the places of all points between the normals. */
static void test_feet(batten_context *ctx, unsigned degree, unsigned spans) {
  enum { COUNT = 300 };
  surface_case c = surface_case_bowl(degree, spans);
  batten_surface *s = surface_case_make(ctx, &c);
  uint64_t seed = 3;
  double at[COUNT][2], points[COUNT][3], places[COUNT][2], distances[COUNT], away[COUNT];
  for (int i = 0; i < COUNT; i++) {
    surface_case_place(&c, &seed, at[i]);
    if (i % 3 == 1) at[i][0] = i % 2 ? 1 : -1;
    if (i % 15 == 1) at[i][1] = 1;
    batten_surface_point p;
    if (batten_surface_evaluate(ctx, s, 1, at[i], &p) < 0) exit(1);
    away[i] = i % 10 == 0 ? 0 : pow(10, 8 * t_uniform(&seed) - 5);
    for (int d = 0; d < 3; d++) points[i][d] = p.point[d] - away[i] * p.normal[d];
  }
  T_OK(batten_surface_closest(ctx, s, COUNT, points[0], places[0], distances), ctx);
  double place = 0, distance = 0;
  for (int i = 0; i < COUNT; i++) {
    place = surface_worse(place, hypot(places[i][0] - at[i][0], places[i][1] - at[i][1]) / (1 + away[i]));
    distance = surface_worse(distance, fabs(distances[i] - away[i]) / (1 + away[i]));
  }
  T_RATIO(place, 1e-13, "below the bowl (degree %u, %u spans): feet of normals", degree, spans);
  T_RATIO(distance, 2e-15, "their distances");

  /* By hand: over the bottom, up to its centre of curvature; beside a side; beyond a corner. */
  const double few[5][3] = {{0, 0, 0.5}, {0, 0, 0.999}, {0, 0, -2}, {3, 0, 0.5}, {2, 3, 1}};
  const double feet[5][3] = {{0, 0, 0.5}, {0, 0, 0.999}, {0, 0, 2}, {1, 0, 2}, {1, 1, sqrt(5)}};
  T_OK(batten_surface_closest(ctx, s, 5, few[0], places[0], distances), ctx);
  distance = 0;
  for (int i = 0; i < 5; i++)
    distance = surface_worse(distance, hypot(places[i][0] - feet[i][0], places[i][1] - feet[i][1]) * (i != 1) +
                                           fabs(distances[i] - feet[i][2]));
  T_RATIO(distance, 1e-14, "over the bottom, beside a side, beyond a corner");
  batten_surface_free(s);
}

/* ---- dense sampling ------------------------------------------------------------------------------ */

static double sampled(const batten_surface_point *all, size_t count, const double *point) {
  double least = INFINITY;
  for (size_t i = 0; i < count; i++) least = fmin(least, vec_distance(all[i].point, point));
  return least;
}

static void test_dense(batten_context *ctx, unsigned p, unsigned q, unsigned spans, uint64_t seed) {
  enum { COUNT = 200, GRID = 400 };
  surface_case c = surface_case_random(p, q, spans, spans, 1, seed);
  batten_surface *s = surface_case_make(ctx, &c);
  double points[COUNT][3], places[COUNT][2], distances[COUNT];
  double *grid = malloc((size_t)GRID * GRID * 2 * sizeof *grid);
  batten_surface_point *all = malloc((size_t)GRID * GRID * sizeof *all), found;
  for (size_t i = 0; i < (size_t)GRID * GRID; i++) {
    const size_t at[2] = {i / GRID, i % GRID};
    for (size_t k = 0; k < 2; k++) {
      double part = (double)at[k] / (GRID - 1), a = c.knots[k][0], b = c.knots[k][c.knot_count[k] - 1];
      grid[2 * i + k] = part == 1 ? b : (1 - part) * a + part * b;
    }
  }
  if (batten_surface_evaluate(ctx, s, (size_t)GRID * GRID, grid, all) < 0) exit(1);
  for (int i = 0; i < COUNT; i++) {
    points[i][0] = 4 * t_uniform(&seed) - 1;
    points[i][1] = 3 * t_uniform(&seed) - 1;
    points[i][2] = 3 * t_uniform(&seed) - 1.5;
  }
  double start = batten_now();
  T_OK(batten_surface_closest(ctx, s, COUNT, points[0], places[0], distances), ctx);
  printf("# degrees %u, %u: %.0f us a point\n", p, q, 1e6 * (batten_now() - start) / COUNT);
  double over = 0, under = 0, own = 0, slope = 0;
  for (int i = 0; i < COUNT; i++) {
    double best = sampled(all, (size_t)GRID * GRID, points[i]), away[3];
    /* Between samples the surface comes nearer by h^2 / (2 distance) at most, h half a diagonal of their cells. */
    over = surface_worse(over, distances[i] - best);
    under = surface_worse(under, (best - distances[i]) * (best + distances[i]));
    if (batten_surface_evaluate(ctx, s, 1, places[i], &found) < 0) exit(1);
    own = surface_worse(own, fabs(vec_distance(found.point, points[i]) - distances[i]));
    vec_sub(found.point, points[i], away);
    const double *d[2] = {found.du, found.dv};
    for (int k = 0; k < 2; k++) {
      double g = vec_dot(away, d[k]) / vec_norm(d[k]), a = c.knots[k][0], b = c.knots[k][c.knot_count[k] - 1];
      bool lower = places[i][k] == a, upper = places[i][k] == b;
      slope = surface_worse(slope, lower ? fmax(0, -g) : upper ? fmax(0, g) : fabs(g));
    }
  }
  T_RATIO(over, 1e-14, "no sample is nearer");
  T_RATIO(under, p > 1 ? 4e-4 : 4e-3, "samples come close"); /* on edges less so */
  T_RATIO(own, 1e-14, "the place has this distance");
  if (p > 1) T_RATIO(slope, 1e-12, "upright on the surface, or on its side");
  free(all);
  free(grid);
  batten_surface_free(s);
}

/* ---- the same surface otherwise ------------------------------------------------------------------ */

static void distances_of(batten_context *ctx, const surface_case *c, size_t count, double (*points)[3],
                         double *distances) {
  batten_surface *s = surface_case_make(ctx, c);
  double *places = malloc(2 * count * sizeof *places);
  T_OK(batten_surface_closest(ctx, s, count, points[0], places, distances), ctx);
  free(places);
  batten_surface_free(s);
}

static void test_same(batten_context *ctx) {
  enum { COUNT = 60 };
  surface_case c = surface_case_random(3, 4, 3, 2, 2, 5), other = c;
  double points[COUNT][3], turned[COUNT][3], own[COUNT], found[COUNT], worst;
  uint64_t seed = 7;
  for (int i = 0; i < COUNT; i++)
    for (int d = 0; d < 3; d++) points[i][d] = 3 * t_uniform(&seed) - 1;
  distances_of(ctx, &c, COUNT, points, own);
  surface_case_swap(&other);
  surface_case_reverse(&other, 0);
  surface_case_insert(&other, 1, -0.5);
  distances_of(ctx, &other, COUNT, points, found);
  worst = 0;
  for (int i = 0; i < COUNT; i++) worst = surface_worse(worst, fabs(found[i] - own[i]));
  T_RATIO(worst, 1e-13, "u, v exchanged, reversed, more knots: the same");
  other = c;
  const double move[3] = {-5, 20, 9};
  for (size_t i = 0; i < c.points[0] * c.points[1]; i++) surface_turn(c.control[i], 7, move, other.control[i]);
  for (int i = 0; i < COUNT; i++) surface_turn(points[i], 7, move, turned[i]);
  distances_of(ctx, &other, COUNT, turned, found);
  worst = 0;
  for (int i = 0; i < COUNT; i++) worst = surface_worse(worst, fabs(found[i] / 7 - own[i]));
  T_RATIO(worst, 1e-13, "turned, larger and moved: the same");
  static const int scale[] = {-600, 500, 900};
  for (int k = 0; k < 3; k++) {
    for (size_t i = 0; i < c.points[0] * c.points[1]; i++)
      for (int d = 0; d < 3; d++) other.control[i][d] = ldexp(c.control[i][d], scale[k]);
    for (int i = 0; i < COUNT; i++)
      for (int d = 0; d < 3; d++) turned[i][d] = ldexp(points[i][d], scale[k]);
    distances_of(ctx, &other, COUNT, turned, found);
    bool same = true;
    for (int i = 0; i < COUNT; i++) same = same && found[i] == ldexp(own[i], scale[k]);
    T_CHECK(same, "times 2^%d: the same bits", scale[k]);
  }
  /* From very far: the distance along the way, less what the surface reaches towards the point. */
  const double far[3][3] = {{1e150, 0, 0}, {0, -1e300, 0}, {1e10, 1e10, 1e10}};
  memcpy(turned, far, sizeof far);
  distances_of(ctx, &c, 3, turned, found);
  T_CHECK(fabs(found[0] / 1e150 - 1) < 1e-15 && fabs(found[1] / 1e300 - 1) < 1e-15 &&
              fabs(found[2] / (1e10 * sqrt(3)) - 1) < 1e-9,
          "from 1e150, 1e300: that far");
  /* 2^30 from the origin the points' differences are the same, and so is all else. */
  surface_case near = c;
  for (size_t i = 0; i < c.points[0] * c.points[1]; i++)
    for (int d = 0; d < 3; d++) {
      other.control[i][d] = c.control[i][d] + 0x1p30;
      near.control[i][d] = other.control[i][d] - 0x1p30;
    }
  for (int i = 0; i < COUNT; i++)
    for (int d = 0; d < 3; d++) {
      turned[i][d] = points[i][d] + 0x1p30;
      points[i][d] = turned[i][d] - 0x1p30;
    }
  distances_of(ctx, &near, COUNT, points, own);
  distances_of(ctx, &other, COUNT, turned, found);
  worst = 0;
  for (int i = 0; i < COUNT; i++) worst = surface_worse(worst, fabs(found[i] - own[i]));
  T_RATIO(worst, 1e-14, "1e9 sizes from the origin: distances to the last digit");
}

/* ---- degenerate, bad ----------------------------------------------------------------------------- */

static void test_degenerate(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 1);
  double points[2][3] = {{-4, 0, 0}, {0.3, 0.1, -1}}, places[2][2], distances[2];
  for (size_t j = 0; j < c.points[1]; j++) memcpy(c.control[j], (double[3]){-1, 0, 0}, sizeof *c.control);
  batten_surface *s = surface_case_make(ctx, &c);
  T_OK(batten_surface_closest(ctx, s, 2, points[0], places[0], distances), ctx);
  T_CHECK(fabs(distances[0] - 3) < 1e-14 && places[0][0] == -1, "a side drawn together is the nearest: %.17g",
          distances[0]);
  batten_surface_free(s);

  for (size_t i = 0; i < 16; i++) memcpy(c.control[i], (double[3]){1, 2, 2}, sizeof *c.control);
  s = surface_case_make(ctx, &c);
  points[0][0] = points[0][1] = points[0][2] = 0;
  T_OK(batten_surface_closest(ctx, s, 1, points[0], places[0], distances), ctx);
  T_CHECK(fabs(distances[0] - 3) < 1e-15, "a surface that is a point");
  T_OK(batten_surface_closest(ctx, s, 1, c.control[0], places[0], distances), ctx);
  T_CHECK(distances[0] == 0, "at that point");
  batten_surface_free(s);

  /* All on a line, twice there and back. */
  c = surface_case_bowl(2, 2);
  for (size_t i = 0; i < 16; i++) memcpy(c.control[i], (double[3]){i % 2 ? 1 : -1, 0, 0}, sizeof *c.control);
  s = surface_case_make(ctx, &c);
  memcpy(points, (double[2][3]){{0.1, 3, 4}, {0.1, 0, 0}}, sizeof points);
  T_OK(batten_surface_closest(ctx, s, 2, points[0], places[0], distances), ctx);
  T_CHECK(fabs(distances[0] - 5) < 1e-11 && distances[1] < 1e-11, "a surface that is a line: %.15g, %.3g",
          distances[0], distances[1]);
  batten_surface_free(s);
}

/* A patch that follows a half circle within 1e-9, seen from its middle: all places are all but the nearest. */
static void test_circle(batten_context *ctx) {
  surface_case c = {.degree = {0}};
  surface_case_axis(&c, 0, 9, 1, 1, 0, 1);
  surface_case_axis(&c, 1, 1, 1, 1, -1, 1);
  /* Taylor polynomials of cos and sin of degree 9 on [0, 1] in Bernstein form. */
  static const double cosine[10] = {1, 0, -1 / 2.0, 0, 1 / 24.0, 0, -1 / 720.0, 0, 1 / 40320.0, 0};
  static const double sine[10] = {0, 1, 0, -1 / 6.0, 0, 1 / 120.0, 0, -1 / 5040.0, 0, 1 / 362880.0};
  for (size_t i = 0; i < 10; i++)
    for (size_t j = 0; j < 2; j++) {
      double *b = c.control[2 * i + j], ratio = 1;
      b[0] = b[1] = 0;
      b[2] = j ? 1 : -1;
      for (size_t k = 0; k <= i; k++) { /* C(i, k) / C(9, k) */
        b[0] += ratio * cosine[k];
        b[1] += ratio * sine[k];
        ratio *= (double)(i - k) / (double)(9 - k);
      }
    }
  batten_surface *s = surface_case_make(ctx, &c);
  const double points[2][3] = {{0, 0, 0.3}, {1e-3, 0, 0}};
  double places[2][2], distances[2], start = batten_now();
  batten_status st = batten_surface_closest(ctx, s, 2, points[0], places[0], distances);
  printf("# %s: %s, %.3f s\n", batten_status_name(st), st ? batten_error(ctx) : "", batten_now() - start);
  T_CHECK(st >= 0 && fabs(distances[0] - 1) < 1e-6 && distances[1] <= 1 - 1e-3 + 1e-15 && distances[1] > 1 - 1.1e-3,
          "in the middle of a circle: %.15g, %.15g", distances[0], distances[1]);
  batten_surface_free(s);
}

/* Over the bowl at the height h > 1 all places with r^2 = 2 (h - 1) are equally near, sqrt(2 h - 1) away. */
static void test_ring(batten_context *ctx) {
  surface_case c = surface_case_bowl(2, 1);
  batten_surface *s = surface_case_make(ctx, &c);
  const double point[3] = {0, 0, 1.3};
  double place[2], distance, start = batten_now();
  batten_status st = batten_surface_closest(ctx, s, 1, point, place, &distance);
  printf("# %.3f s\n", batten_now() - start);
  T_CHECK(
      (st == BATTEN_OK || (st == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "points[0]: the distance may be"))) &&
          fabs(distance - sqrt(1.6)) < 1e-12 && fabs(hypot(place[0], place[1]) - sqrt(0.6)) < 1e-6,
      "a ring of nearest places: %s", batten_status_name(st));
  batten_surface_free(s);
}

static void test_bad(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 2);
  batten_surface *s = surface_case_make(ctx, &c);
  double places[2] = {7, 7}, distance = 7;
  const double point[3] = {0, 0, 0}, nan[6] = {0, 0, 0, 1, NAN, 0};
  T_STATUS(batten_surface_closest(ctx, NULL, 1, point, places, &distance), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_surface_closest(ctx, s, 1, NULL, places, &distance), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_surface_closest(ctx, s, 1, point, NULL, &distance), BATTEN_E_INVALID, ctx, "places: NULL");
  T_STATUS(batten_surface_closest(ctx, s, 2, nan, places, &distance), BATTEN_E_INVALID, ctx,
           "points[1][1]: nan; give finite");
  T_STATUS(batten_surface_closest(ctx, s, SIZE_MAX, point, places, &distance), BATTEN_E_INVALID, ctx,
           "no array has so many");
  T_CHECK(places[0] == 7 && distance == 7, "nothing is written then");
  T_OK(batten_surface_closest(ctx, s, 0, NULL, NULL, NULL), ctx);
  T_OK(batten_surface_closest(ctx, s, 1, point, places, NULL), ctx);
  T_CHECK(batten_surface_closest(NULL, s, 1, point, places, NULL) == BATTEN_E_INVALID, "no context");
  batten_surface_free(s);
  for (size_t i = 0; i < c.points[0] * c.points[1]; i++) c.control[i][2] -= 1.7e308;
  s = surface_case_make(ctx, &c);
  T_STATUS(batten_surface_closest(ctx, s, 1, (const double[3]){0, 0, 1e308}, places, &distance), BATTEN_E_INVALID,
           ctx, "points[0][2]: 1e+308; its distance is beyond a double");
  batten_surface_free(s);
}

static batten_status find_some(batten_context *ctx, void *arg) {
  const surface_case *c = arg;
  batten_surface_form form = surface_case_form(c);
  batten_surface *s;
  double points[40][3], places[40][2], distances[40];
  for (int i = 0; i < 120; i++) points[i / 3][i % 3] = sin(i);
  batten_status st = batten_surface_create(ctx, &form, &s);
  if (st < 0) return st;
  st = batten_surface_closest(ctx, s, 40, points[0], places[0], distances);
  batten_surface_free(s);
  return st;
}

static void test_threads(const surface_case *c) {
  enum { COUNT = 500 };
  double points[COUNT][3], places[2][COUNT][2], distances[2][COUNT];
  uint64_t seed = 5;
  for (int i = 0; i < 3 * COUNT; i++) points[i / 3][i % 3] = 2 * t_uniform(&seed);
  for (int k = 0; k < 2; k++) {
    batten_context *own = t_context(NULL, NULL, k ? 4 : 1);
    batten_surface *s = surface_case_make(own, c);
    T_OK(batten_surface_closest(own, s, COUNT, points[0], places[k][0], distances[k]), own);
    batten_surface_free(s);
    batten_context_free(own);
  }
  T_CHECK(memcmp(places[0], places[1], sizeof places[0]) == 0 &&
              memcmp(distances[0], distances[1], sizeof distances[0]) == 0,
          "1 and 4 threads: the same bits");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_feet(ctx, 2, 1);
  test_feet(ctx, 3, 4);
  test_dense(ctx, 1, 1, 2, 1);
  test_dense(ctx, 3, 3, 1, 2);
  test_dense(ctx, 3, 3, 5, 3);
  test_dense(ctx, 5, 2, 2, 4);
  test_dense(ctx, 9, 9, 1, 5);
  test_same(ctx);
  test_degenerate(ctx);
  test_circle(ctx);
  test_ring(ctx);
  test_bad(ctx);
  surface_case c = surface_case_random(3, 3, 2, 2, 1, 3);
  test_threads(&c);
  t_fail_every_allocation("batten_surface_closest", find_some, &c);
  t_cancel_every_progress("batten_surface_closest", find_some, &c);
  batten_context_free(ctx);
  return t_done();
}
