/* Parameters of scattered points: what projection and shape-preserving maps must give, by closed forms, by exact
 * signs of all triangles, and by invariance; and every input that has none. */
#include <batten/convex.h>

#include "convex/plane.h"
#include "mesh/delaunay.h"
#include "mesh/predicates.h"
#include "tap.h"

static const double PI = 3.14159265358979323846;

/* ---- scenes -------------------------------------------------------------------------------------- */

typedef struct scene {
  size_t count, triangle_count;
  double *points;      /* [count][3] */
  uint32_t *triangles; /* [triangle_count][3], or NULL */
} scene;

static scene new_scene(size_t count, size_t triangle_count) {
  return (scene){count, triangle_count, calloc(3 * count + 1, sizeof(double)),
                 triangle_count ? calloc(3 * triangle_count, sizeof(uint32_t)) : NULL};
}

static void drop(scene *s) {
  free(s->points);
  free(s->triangles);
}

/* Rotation about (1, 2, 3) by an angle, then a shift. */
static void move(scene *s, double angle, double shift) {
  double a[3] = {1 / sqrt(14), 2 / sqrt(14), 3 / sqrt(14)}, c = cos(angle), d = sin(angle);
  for (size_t i = 0; i < s->count; i++) {
    double *p = s->points + 3 * i, q[3], along = a[0] * p[0] + a[1] * p[1] + a[2] * p[2];
    for (int k = 0; k < 3; k++) {
      int m = (k + 1) % 3, n = (k + 2) % 3;
      q[k] = c * p[k] + d * (a[m] * p[n] - a[n] * p[m]) + (1 - c) * along * a[k] + shift * (k + 1);
    }
    memcpy(p, q, sizeof q);
  }
}

/* Points of the rectangle 3 x 2 at z = 0: its corners, `side` more on each side, the rest inside; uv: their place. */
static scene rectangle(size_t count, size_t side, uint64_t seed, double *uv) {
  scene s = new_scene(count, 0);
  for (size_t i = 0; i < count; i++) {
    double u = t_uniform(&seed), v = t_uniform(&seed);
    size_t edge = i < 4 ? i : (i - 4) / (side + !side);
    if (i < 4) u = v = 0;
    if (i < 4 + 4 * side) {
      double t = u;
      u = edge == 0 ? t : edge == 1 ? 1 : edge == 2 ? 1 - t : 0;
      v = edge == 0 ? 0 : edge == 1 ? t : edge == 2 ? 1 : 1 - t;
    }
    uv[2 * i] = u;
    uv[2 * i + 1] = v;
    s.points[3 * i] = 3 * u;
    s.points[3 * i + 1] = 2 * v;
  }
  return s;
}

/* A cap of the unit sphere about +z, out to the polar angle `reach`: a pole and `rings` of `sectors` points. */
static scene cap(size_t rings, size_t sectors, double reach) {
  scene s = new_scene(1 + rings * sectors, sectors * (2 * rings - 1));
  s.points[2] = 1;
  uint32_t *t = s.triangles;
  for (size_t r = 0; r < rings; r++)
    for (size_t k = 0; k < sectors; k++) {
      double polar = reach * (double)(r + 1) / (double)rings, turn = 2 * PI * (double)k / (double)sectors;
      double *p = s.points + 3 * (1 + r * sectors + k);
      p[0] = sin(polar) * cos(turn);
      p[1] = sin(polar) * sin(turn);
      p[2] = cos(polar);
      uint32_t next = (uint32_t)((k + 1) % sectors), here = (uint32_t)(1 + r * sectors);
      uint32_t inner = here - (uint32_t)sectors;
      uint32_t two[6] = {r ? inner + (uint32_t)k : 0, here + (uint32_t)k, here + next,
                         inner + (uint32_t)k,         here + next,        inner + next};
      memcpy(t, two, (r ? 6 : 3) * sizeof *t);
      t += r ? 6 : 3;
    }
  return s;
}

static batten_status parametrize(batten_context *ctx, const scene *s, batten_parametrization method, double *uv) {
  batten_parametrize_options o = batten_parametrize_options_default();
  o.method = method;
  o.triangle_count = s->triangle_count;
  o.triangles = s->triangles;
  return batten_parametrize(ctx, s->count, s->points, &o, uv);
}

/* Triangles that are not positive in the plane of uv, by exact signs. */
static size_t count_folds(const scene *s, const double *uv) {
  size_t folds = 0;
  for (size_t t = 0; t < s->triangle_count; t++) {
    const uint32_t *c = s->triangles + 3 * t;
    folds += batten_orient2d(uv + 2 * c[0], uv + 2 * c[1], uv + 2 * c[2], 0, 1) <= 0;
  }
  return folds;
}

static double distance(size_t count, const double *a, const double *b) {
  double worst = 0;
  for (size_t i = 0; i < 2 * count; i++) worst = fmax(worst, fabs(a[i] - b[i]));
  return worst;
}

/* The same but for a turn of the square. */
static double turned_distance(size_t count, const double *a, const double *b) {
  double least = INFINITY, *c = malloc(2 * count * sizeof *c);
  memcpy(c, b, 2 * count * sizeof *c);
  for (int quarter = 0; quarter < 4; quarter++) {
    least = fmin(least, distance(count, a, c));
    for (size_t i = 0; i < count; i++) {
      double u = c[2 * i];
      c[2 * i] = 1 - c[2 * i + 1];
      c[2 * i + 1] = u;
    }
  }
  free(c);
  return least;
}

static bool is_in_square(size_t count, const double *uv) {
  bool inside = true;
  for (size_t i = 0; i < 2 * count; i++) inside = inside && uv[i] >= 0 && uv[i] <= 1;
  return inside;
}

/* ---- projection ---------------------------------------------------------------------------------- */

static void test_project_by_hand(batten_context *ctx) {
  double p[7][3] = {{2, 3, 5}, {6, 3, 5}, {6, 5, 5}, {2, 5, 5}, {4, 4, 5}, {3, 4.5, 5}, {3, 4.5, 5}}, uv[7][2];
  static const double expected[7][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, 0.5}, {0.25, 0.75}, {0.25, 0.75}};
  T_OK(batten_parametrize(ctx, 7, &p[0][0], NULL, &uv[0][0]), ctx);
  T_RATIO(distance(7, &uv[0][0], &expected[0][0]), 4e-16, "a rectangle 4 x 2 along x and y");
  for (int i = 0; i < 7; i++) { /* the plane of y and z: u along y; as deep as it is wide */
    double x = p[i][0];
    p[i][0] = 5;
    p[i][2] = 2 * p[i][1];
    p[i][1] = x;
  }
  T_OK(batten_parametrize(ctx, 7, &p[0][0], NULL, &uv[0][0]), ctx);
  T_RATIO(distance(7, &uv[0][0], &expected[0][0]), 4e-16, "a square along y and z");
  double triangle[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  T_OK(batten_parametrize(ctx, 3, &triangle[0][0], NULL, &uv[0][0]), ctx);
  T_CHECK(uv[0][0] == 0 && uv[0][1] == 0 && uv[1][1] == 1 && uv[2][0] == 1,
          "three points in the plane of z and x: u along z: (%g %g) (%g %g) (%g %g)", uv[0][0], uv[0][1], uv[1][0],
          uv[1][1], uv[2][0], uv[2][1]);
}

/* The least rectangle against all rectangles in steps of a hundredth of a degree. */
static void test_least_rectangle(batten_context *ctx) {
  enum { N = 60 };
  double p[3 * N], flat[2 * N], size[2], axes[2][3], worst = -INFINITY, best = INFINITY;
  uint64_t seed = 3;
  for (int trial = 0; trial < 20; trial++) {
    for (int i = 0; i < 3 * N; i++) p[i] = i % 3 == 2 ? 0 : t_uniform(&seed) + (trial % 2) * t_uniform(&seed);
    convex_scale scale;
    T_OK(convex_scale_find(ctx, N, p, &scale), ctx);
    T_OK(convex_plane_project(ctx, N, p, NULL, &scale, flat, size, axes), ctx);
    double least = INFINITY;
    for (int step = 0; step < 9000; step++) {
      double c = cos(PI / 18000 * step), d = sin(PI / 18000 * step),
             box[4] = {INFINITY, -INFINITY, INFINITY, -INFINITY};
      for (int i = 0; i < N; i++) {
        double x = (c * p[3 * i] + d * p[3 * i + 1]) * scale.scale * scale.unit;
        double y = (c * p[3 * i + 1] - d * p[3 * i]) * scale.scale * scale.unit;
        box[0] = fmin(box[0], x);
        box[1] = fmax(box[1], x);
        box[2] = fmin(box[2], y);
        box[3] = fmax(box[3], y);
      }
      least = fmin(least, (box[1] - box[0]) * (box[3] - box[2]));
    }
    worst = fmax(worst, size[0] * size[1] / least - 1);
    best = fmin(best, size[0] * size[1] / least - 1);
  }
  T_RATIO(worst, 1e-12, "area above the least of a search, 20 clouds (below by up to %.1e)", -best);
  T_CHECK(best > -1e-3, "and not below what there is");
}

static void test_project_invariance(batten_context *ctx) {
  enum { N = 400 };
  double uv[2 * N], moved[2 * N], expected[2 * N];
  scene s = rectangle(N, 0, 5, expected);
  for (size_t i = 0; i < N; i++) s.points[3 * i + 2] = 0.3 * sin(s.points[3 * i]) * s.points[3 * i + 1];
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_AUTO, uv), ctx);
  T_CHECK(is_in_square(N, uv), "projected parameters lie in the square");
  scene other = new_scene(N, 0);
  for (size_t i = 0; i < N; i++) memcpy(other.points + 3 * i, s.points + 3 * (N - 1 - i), 3 * sizeof(double));
  T_OK(parametrize(ctx, &other, BATTEN_PARAMETERS_PROJECT, moved), ctx);
  bool same = true;
  for (size_t i = 0; i < N; i++) same = same && memcmp(uv + 2 * i, moved + 2 * (N - 1 - i), 2 * sizeof *uv) == 0;
  T_CHECK(same, "other order: same bits");
  static const int power[3] = {-1000, 30, 1000};
  for (int k = 0; k < 3; k++) {
    for (size_t i = 0; i < 3 * N; i++) other.points[i] = ldexp(s.points[i], power[k]);
    T_OK(parametrize(ctx, &other, BATTEN_PARAMETERS_PROJECT, moved), ctx);
    T_CHECK(memcmp(uv, moved, sizeof uv) == 0, "scaled by 2^%d: same bits", power[k]);
  }
  for (int k = 0; k < 5; k++) {
    memcpy(other.points, s.points, 3 * N * sizeof(double));
    move(&other, 1.3 * k, 7);
    T_OK(parametrize(ctx, &other, BATTEN_PARAMETERS_PROJECT, moved), ctx);
    /* A reflection is no turn: where the normal flips its sign, u and v change places. */
    double plain = turned_distance(N, uv, moved);
    for (size_t i = 0; i < N; i++) {
      double u = moved[2 * i];
      moved[2 * i] = moved[2 * i + 1];
      moved[2 * i + 1] = u;
    }
    T_RATIO(fmin(plain, turned_distance(N, uv, moved)), 1e-12, "turned by %g rad and moved", 1.3 * k);
  }
  drop(&other);
  drop(&s);
}

/* Points of a plane: parameters are the affine coordinates in its rectangle; by every method. */
static void test_planes(batten_context *ctx) {
  enum { N = 1500 };
  double *uv = malloc(2 * N * sizeof *uv), *expected = malloc(2 * N * sizeof *expected);
  for (size_t side = 0; side <= 40; side += 20)
    for (int turn = 0; turn < 3; turn++) {
      scene s = rectangle(N, side, 7 + (uint64_t)turn, expected);
      for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++) { /* corners at the corners */
          expected[2 * i + k] = k == 0 ? i == 1 || i == 2 : i > 1;
          s.points[3 * i + k] = (3 - k) * expected[2 * i + k];
        }
      move(&s, 0.9 * turn, 0.1 * turn);
      T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_PROJECT, uv), ctx);
      T_RATIO(turned_distance(N, uv, expected), 1e-13, "PROJECT of a rectangle, %zu points on each side", side);
      T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
      T_RATIO(turned_distance(N, uv, expected), 1e-12, "FLOATER of a rectangle, %zu points on each side", side);
      drop(&s);
    }
  free(uv);
  free(expected);
}

/* ---- shape-preserving ---------------------------------------------------------------------------- */

/* PROJECT folds a cap beyond a hemisphere, FLOATER never. */
static void test_caps(batten_context *ctx) {
  static const double reach[5] = {30, 80, 110, 150, 170};
  for (int k = 0; k < 5; k++) {
    scene s = cap(16, 36, reach[k] * PI / 180);
    double *uv = malloc(2 * s.count * sizeof *uv), *other = malloc(2 * s.count * sizeof *uv);
    T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_PROJECT, uv), ctx);
    size_t projected = count_folds(&s, uv);
    T_CHECK((projected > 0) == (reach[k] > 90), "PROJECT of a cap to %g degrees folds %zu triangles", reach[k],
            projected);
    T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_AUTO, other), ctx);
    T_CHECK((memcmp(uv, other, 2 * s.count * sizeof *uv) == 0) == (reach[k] < 60), "AUTO projects up to 65 degrees");
    T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
    size_t folds = count_folds(&s, uv), on_side[4] = {0};
    T_CHECK(folds == 0 && is_in_square(s.count, uv), "FLOATER of it folds %zu of %zu", folds, s.triangle_count);
    for (size_t i = s.count - 36; i < s.count; i++)
      for (size_t c = 0; c < 4; c++) on_side[c] += uv[2 * i + c % 2] == (double)(c / 2);
    T_CHECK(on_side[0] == 10 && on_side[1] == 10 && on_side[2] == 10 && on_side[3] == 10,
            "a circle's corners are evenly spread: %zu %zu %zu %zu of 40 on the sides", on_side[0], on_side[1],
            on_side[2], on_side[3]);
    T_RATIO(hypot(uv[0] - 0.5, uv[1] - 0.5), 1e-12, "its pole is in the middle");
    drop(&s);
    free(other);
    free(uv);
  }
}

/* A tube of 45 radii, closed at its far end: that shrinks like exp(-45), below what parameters near 1/2 can tell. */
static void test_deep(batten_context *ctx) {
  scene s = cap(150, 8, 1);
  for (size_t i = 1; i < s.count; i++) {
    double turn = 2 * PI * (double)((i - 1) % 8) / 8;
    s.points[3 * i] = cos(turn);
    s.points[3 * i + 1] = sin(turn);
    s.points[3 * i + 2] = -0.3 * (double)((i - 1) / 8);
  }
  double *uv = malloc(2 * s.count * sizeof *uv);
  T_STATUS(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), BATTEN_W_ACCURACY, ctx,
           "the surface is too deep for one square");
  T_CHECK(is_in_square(s.count, uv), "there are parameters all the same");
  drop(&s);
  free(uv);
}

static void test_floater_invariance(batten_context *ctx) {
  scene s = cap(6, 24, 2.0);
  uint64_t seed = 9;
  for (size_t i = 0; i < 3 * s.count; i++) s.points[i] += 0.04 * t_uniform(&seed);
  double *uv = malloc(2 * s.count * sizeof *uv), *moved = malloc(2 * s.count * sizeof *uv);
  scene other = new_scene(s.count, s.triangle_count);
  memcpy(other.triangles, s.triangles, 3 * s.triangle_count * sizeof(uint32_t));
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
  for (size_t i = 0; i < 3 * s.count; i++) other.points[i] = ldexp(s.points[i], 900);
  T_OK(parametrize(ctx, &other, BATTEN_PARAMETERS_FLOATER, moved), ctx);
  T_CHECK(memcmp(uv, moved, 2 * s.count * sizeof *uv) == 0, "FLOATER scaled by 2^900: same bits");
  for (int k = 0; k < 4; k++) {
    memcpy(other.points, s.points, 3 * s.count * sizeof(double));
    move(&other, k, 3);
    T_OK(parametrize(ctx, &other, BATTEN_PARAMETERS_FLOATER, moved), ctx);
    T_RATIO(turned_distance(s.count, uv, moved), 1e-11, "FLOATER turned by %d rad and moved", k);
  }
  /* Other numbers for the points, other order and first corners for the triangles. */
  uint32_t last = (uint32_t)s.count - 1, t_last = (uint32_t)s.triangle_count - 1;
  for (uint32_t i = 0; i <= last; i++) memcpy(other.points + 3 * i, s.points + 3 * (last - i), 3 * sizeof(double));
  for (uint32_t t = 0; t <= t_last; t++)
    for (uint32_t k = 0; k < 3; k++) other.triangles[3 * t + k] = last - s.triangles[3 * (t_last - t) + (k + 1) % 3];
  T_OK(parametrize(ctx, &other, BATTEN_PARAMETERS_FLOATER, moved), ctx);
  double worst = 0;
  for (uint32_t i = 0; i <= last; i++)
    for (uint32_t k = 0; k < 2; k++) worst = fmax(worst, fabs(moved[2 * i + k] - uv[2 * (last - i) + k]));
  T_RATIO(worst, 1e-12, "FLOATER with other numbers");
  drop(&other);
  drop(&s);
  free(uv);
  free(moved);
}

static void test_corners(batten_context *ctx) {
  scene s = cap(3, 12, 1);
  double *uv = malloc(2 * s.count * sizeof *uv);
  uint32_t corners[4] = {26, 29, 30, 36};
  batten_parametrize_options o = batten_parametrize_options_default();
  o.method = BATTEN_PARAMETERS_FLOATER;
  o.triangles = s.triangles;
  o.triangle_count = s.triangle_count;
  o.corners = corners;
  T_OK(batten_parametrize(ctx, s.count, s.points, &o, uv), ctx);
  static const double square[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  bool there = true;
  for (int k = 0; k < 4; k++) there = there && memcmp(uv + 2 * corners[k], square[k], sizeof square[k]) == 0;
  T_CHECK(there && count_folds(&s, uv) == 0, "given corners go to the corners, nothing folds");
  T_RATIO(fabs(uv[2 * 27] - 1.0 / 3), 1e-12, "along a side by chord length");
  corners[1] = 30;
  corners[2] = 29;
  T_STATUS(batten_parametrize(ctx, s.count, s.points, &o, uv), BATTEN_E_INVALID, ctx,
           "opt.corners: 26, 30, 29, 36 do not follow each other");
  corners[1] = 26;
  T_STATUS(batten_parametrize(ctx, s.count, s.points, &o, uv), BATTEN_E_INVALID, ctx, "do not follow each other");
  corners[2] = 3;
  T_STATUS(batten_parametrize(ctx, s.count, s.points, &o, uv), BATTEN_E_INVALID, ctx,
           "opt.corners[2]: point 3 is not on the boundary");
  corners[2] = 37;
  T_STATUS(batten_parametrize(ctx, s.count, s.points, &o, uv), BATTEN_E_INVALID, ctx,
           "opt.corners[2]: 37, but there are 37 points");
  drop(&s);
  free(uv);
}

/* Twelve points around, no one inside: edges from side to side, and ears with all corners on one side. */
static void test_flat_edges(batten_context *ctx) {
  scene s = new_scene(12, 10);
  double uv[24];
  for (uint32_t i = 0; i < 12; i++) {
    s.points[3 * i] = cos(2 * PI * i / 12);
    s.points[3 * i + 1] = sin(2 * PI * i / 12);
    if (i < 10)
      for (uint32_t k = 0; k < 3; k++) s.triangles[3 * i + k] = k ? i + k : 0;
  }
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
  bool on_rim = true;
  for (int i = 0; i < 12; i++)
    on_rim = on_rim && (uv[2 * i] == 0 || uv[2 * i] == 1 || uv[2 * i + 1] == 0 || uv[2 * i + 1] == 1);
  double least = INFINITY;
  for (int i = 0; i < 12; i++)
    for (int j = 0; j < i; j++) least = fmin(least, hypot(uv[2 * i] - uv[2 * j], uv[2 * i + 1] - uv[2 * j + 1]));
  T_CHECK(on_rim && least > 0.3, "a fan without inner points: all on the boundary, apart by %.3f", least);
  drop(&s);
  /* An inner point that only a flat edge parts from one side: 0 1 2 3 a square, 4 in the middle of 0 and 1, 5 within
   * 0 4 1, which the edge 0 1 closes. */
  s = new_scene(6, 6);
  static const double xy[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, -0.02}, {0.5, -0.01}};
  static const uint32_t corners[18] = {0, 4, 5, 4, 1, 5, 1, 0, 5, 0, 1, 2, 0, 2, 3};
  for (int i = 0; i < 6; i++)
    for (int k = 0; k < 2; k++) s.points[3 * i + k] = xy[i][k];
  memcpy(s.triangles, corners, sizeof corners);
  s.triangle_count = 5;
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
  T_CHECK(uv[9] == 0 && uv[11] > 1e-4 && uv[11] < 0.3, "a point behind a flat edge is inside: v = %g", uv[11]);
  drop(&s);
}

/* Points of the rim by the thousand, heaps of them at the corners: in the square, and apart. A fan of as many without
 * points inside has no fault either. */
static void test_long_rim(batten_context *ctx) {
  enum { N = 20000, FAN = 3000, HEAP = 50 };
  scene s = cap(1, N, 1);
  double *uv = malloc(2 * s.count * sizeof *uv);
  uint64_t seed = 23;
  uint32_t corners[4] = {1, 1 + N / 4, 1 + N / 2, 1 + 3 * N / 4};
  for (size_t i = 1; i <= N; i++) s.points[3 * i] *= 1 + 1e-3 * t_uniform(&seed);
  for (size_t k = 0; k < 4; k++)
    for (size_t i = 1; i < HEAP; i++)
      memcpy(s.points + 3 * ((corners[k] + N - 1 - i) % N + 1), s.points + 3 * corners[k], 3 * sizeof *s.points);
  batten_parametrize_options o = batten_parametrize_options_default();
  o.method = BATTEN_PARAMETERS_FLOATER;
  o.triangle_count = s.triangle_count;
  o.triangles = s.triangles;
  o.corners = corners;
  T_OK(batten_parametrize(ctx, s.count, s.points, &o, uv), ctx);
  T_CHECK(is_in_square(s.count, uv) && count_folds(&s, uv) == 0, "%d points on the rim, %d at each corner's place", N,
          HEAP);
  drop(&s);
  s = new_scene(FAN, FAN - 2);
  for (uint32_t i = 0; i < FAN; i++) {
    s.points[3 * i] = cos(2 * PI * i / FAN);
    s.points[3 * i + 1] = sin(2 * PI * i / FAN);
    for (uint32_t k = 0; k < 3 && i < FAN - 2; k++) s.triangles[3 * i + k] = k ? i + k : 0;
  }
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
  T_CHECK(is_in_square(s.count, uv), "a fan of %d points: in the square", FAN);
  drop(&s);
  free(uv);
}

/* The hull of an L is not its outline: but for what four steps hide, its reentrant sides are on the boundary all the
 * same. 80 points are, 61 of the hull and what fills it. */
static void test_gap(batten_context *ctx) {
  enum { SIDE = 21, N = SIDE * SIDE };
  scene s = new_scene(N, 0);
  double uv[2 * N];
  size_t count = 0, corner = 0, rim = 0;
  for (size_t i = 0; i < N; i++) {
    if (i % SIDE > SIDE / 2 && i / SIDE > SIDE / 2) continue;
    if (i % SIDE == SIDE / 2 && i / SIDE == SIDE / 2) corner = count;
    s.points[3 * count] = (double)(i % SIDE);
    s.points[3 * count++ + 1] = (double)(i / SIDE);
  }
  s.count = count;
  move(&s, 0.4, 0);
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
  for (size_t i = 0; i < count; i++)
    rim += uv[2 * i] == 0 || uv[2 * i] == 1 || uv[2 * i + 1] == 0 || uv[2 * i + 1] == 1;
  double u = uv[2 * corner], v = uv[2 * corner + 1];
  T_CHECK(fmin(fmin(u, 1 - u), fmin(v, 1 - v)) < 0.2 && rim > 70,
          "the corner of an L: %.3f %.3f; %zu points on the boundary", u, v, rim);
  drop(&s);
}

/* ---- what has no parameters ---------------------------------------------------------------------- */

static void test_bad_points(batten_context *ctx) {
  double p[300], uv[200];
  for (int method = 0; method <= BATTEN_PARAMETERS_FLOATER; method++) {
    scene s = {100, 0, p, NULL};
    for (int i = 0; i < 300; i++) p[i] = (i / 3) * (1 + i % 3) * 0.1 + 100;
    T_STATUS(parametrize(ctx, &s, (batten_parametrization)method, uv), BATTEN_E_INVALID, ctx,
             "points: all 100 lie on a line");
    for (int i = 0; i < 300; i++) p[i] = 0.1 * (i % 3);
    T_STATUS(parametrize(ctx, &s, (batten_parametrization)method, uv), BATTEN_E_INVALID, ctx,
             "points: all 100 lie at one place");
    p[3 * 17 + 1] = NAN;
    T_STATUS(parametrize(ctx, &s, (batten_parametrization)method, uv), BATTEN_E_INVALID, ctx,
             "points[17]: coordinate 1 is nan");
    p[3 * 17 + 1] = INFINITY;
    T_STATUS(parametrize(ctx, &s, (batten_parametrization)method, uv), BATTEN_E_INVALID, ctx, "points[17]");
    for (s.count = 0; s.count < 3; s.count++)
      T_STATUS(parametrize(ctx, &s, (batten_parametrization)method, uv), BATTEN_E_INVALID, ctx, "count: ");
    double few[9] = {0, 0, 0, 4, 0, 0, 1, 3, 0};
    scene three = {3, 0, few, NULL};
    T_OK(parametrize(ctx, &three, (batten_parametrization)method, uv), ctx);
    T_CHECK(is_in_square(3, uv), "three points: (%g %g) (%g %g) (%g %g)", uv[0], uv[1], uv[2], uv[3], uv[4], uv[5]);
    T_STATUS(parametrize(ctx, &(scene){3, 0, NULL, NULL}, (batten_parametrization)method, uv), BATTEN_E_INVALID, ctx,
             "points: NULL");
    T_STATUS(parametrize(ctx, &three, (batten_parametrization)method, NULL), BATTEN_E_INVALID, ctx,
             "parameters: NULL");
  }
  double few[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  batten_parametrize_options o = {0};
  T_STATUS(batten_parametrize(ctx, 3, few, &o, uv), BATTEN_E_INVALID, ctx, "batten_parametrize_options.struct_size");
  o = batten_parametrize_options_default();
  o.method = (batten_parametrization)3;
  T_STATUS(batten_parametrize(ctx, 3, few, &o, uv), BATTEN_E_INVALID, ctx, "opt.method: 3");
  o = batten_parametrize_options_default();
  o.triangle_count = 1;
  T_STATUS(batten_parametrize(ctx, 3, few, &o, uv), BATTEN_E_INVALID, ctx, "opt.triangles: NULL");
  T_CHECK(batten_parametrize(NULL, 3, few, NULL, uv) == BATTEN_E_INVALID, "no context");
}

static void check_no_disc(batten_context *ctx, size_t count, size_t triangle_count, const uint32_t *triangles,
                          const char *text) {
  double p[30], uv[20], before[20];
  uint64_t seed = 21;
  for (int i = 0; i < 30; i++) p[i] = t_uniform(&seed);
  for (int i = 0; i < 20; i++) uv[i] = before[i] = i;
  batten_parametrize_options o = batten_parametrize_options_default();
  o.method = BATTEN_PARAMETERS_FLOATER;
  o.triangles = triangles;
  o.triangle_count = triangle_count;
  T_STATUS(batten_parametrize(ctx, count, p, &o, uv), BATTEN_E_INVALID, ctx, text);
  T_CHECK(memcmp(uv, before, sizeof uv) == 0, "parameters are as before");
}

static void test_no_disc(batten_context *ctx) {
  check_no_disc(ctx, 3, 1, (uint32_t[]){0, 1, 3}, "opt.triangles[0]: corner 2 is 3, but there are 3 points");
  check_no_disc(ctx, 3, 1, (uint32_t[]){0, 1, 1}, "opt.triangles[0]: point 1 is a corner twice");
  check_no_disc(ctx, 5, 3, (uint32_t[]){0, 1, 2, 1, 0, 3, 0, 1, 4},
                "opt.triangles[0]: its edge of points 0 and 1 is in 3 triangles");
  check_no_disc(ctx, 4, 2, (uint32_t[]){0, 1, 2, 0, 1, 3}, "opt.triangles[1]: passes its edge from point 0 to 1");
  check_no_disc(ctx, 4, 1, (uint32_t[]){0, 1, 2}, "points[3]: in no triangle");
  check_no_disc(ctx, 5, 2, (uint32_t[]){0, 1, 2, 0, 3, 4}, "points[0]: its 2 triangles fall apart");
  check_no_disc(ctx, 4, 4, (uint32_t[]){0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, "without a boundary");
  check_no_disc(ctx, 6, 2, (uint32_t[]){0, 1, 2, 3, 4, 5}, "more than one boundary");
  /* A triangle and a tetrahedron beside it. */
  check_no_disc(ctx, 7, 5, (uint32_t[]){4, 5, 6, 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, "no edges lead to it");
  /* A band around. */
  check_no_disc(ctx, 6, 6, (uint32_t[]){0, 1, 3, 1, 4, 3, 1, 2, 4, 2, 5, 4, 2, 0, 5, 0, 3, 5},
                "more than one boundary");
  /* The torus of seven points less a triangle: edges i, i + 1; i, i + 2; i, i + 3. */
  uint32_t torus[42];
  for (uint32_t i = 0; i < 7; i++) {
    uint32_t two[6] = {i, (i + 1) % 7, (i + 3) % 7, i, (i + 3) % 7, (i + 2) % 7};
    memcpy(torus + 6 * i, two, sizeof two);
  }
  check_no_disc(ctx, 7, 13, torus, "handles");
}

/* ---- failures, cost ------------------------------------------------------------------------------ */

static batten_status project_once(batten_context *ctx, void *arg) {
  double uv[2 * 37];
  return parametrize(ctx, arg, BATTEN_PARAMETERS_PROJECT, uv);
}
static batten_status auto_once(batten_context *ctx, void *arg) {
  double uv[2 * 37];
  return parametrize(ctx, arg, BATTEN_PARAMETERS_AUTO, uv);
}
static batten_status floater_once(batten_context *ctx, void *arg) {
  double uv[2 * 37];
  return parametrize(ctx, arg, BATTEN_PARAMETERS_FLOATER, uv);
}

static void test_failures(void) {
  scene s = cap(3, 12, 1);
  t_fail_every_allocation("PROJECT", project_once, &s);
  t_cancel_every_progress("PROJECT", project_once, &s);
  t_fail_every_allocation("AUTO", auto_once, &s);
  t_fail_every_allocation("FLOATER of triangles", floater_once, &s);
  s.triangle_count = 0;
  t_fail_every_allocation("FLOATER of points", floater_once, &s);
  t_cancel_every_progress("FLOATER of points", floater_once, &s);
  drop(&s);
}

static void test_time(batten_context *ctx) {
  enum { N = 20000 };
  double *uv = malloc(2 * N * sizeof *uv);
  scene s = rectangle(N, 100, 1, uv);
  for (size_t i = 0; i < N; i++) s.points[3 * i + 2] = 0.1 * s.points[3 * i] * s.points[3 * i + 1];
  double start = batten_now();
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_PROJECT, uv), ctx);
  double middle = batten_now();
  T_OK(parametrize(ctx, &s, BATTEN_PARAMETERS_FLOATER, uv), ctx);
  printf("# %d points: PROJECT %.3f s, FLOATER %.3f s\n", N, middle - start, batten_now() - middle);
  drop(&s);
  free(uv);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_project_by_hand(ctx);
  test_least_rectangle(ctx);
  test_project_invariance(ctx);
  test_planes(ctx);
  test_caps(ctx);
  test_deep(ctx);
  test_floater_invariance(ctx);
  test_corners(ctx);
  test_flat_edges(ctx);
  test_long_rim(ctx);
  test_gap(ctx);
  test_bad_points(ctx);
  test_no_disc(ctx);
  test_failures();
  test_time(ctx);
  batten_context_free(ctx);
  return t_done();
}
