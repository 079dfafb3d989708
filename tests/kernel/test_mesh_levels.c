/* Level lines of quantities at the vertices: by hand, against the quantity itself, and by their lengths. */
#include <batten/mesh.h>
#include <float.h>

#include "mesh/vec.h"
#include "tap.h"

/* Two triangles over the unit square, the quantity x + 2 y. */
static batten_mesh *square(batten_context *ctx) {
  static const double vertices[4][3] = {{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}};
  static const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
  batten_mesh *mesh = NULL;
  return batten_mesh_create(ctx, 4, vertices[0], 2, triangles[0], &mesh) == BATTEN_OK ? mesh : NULL;
}
static const double VALUES[4] = {0, 1, 3, 2};

static void test_by_hand(batten_context *ctx) {
  batten_mesh *mesh = square(ctx);
  /* Not sorted, one twice, two without lines. Order: levels as given, triangles within. */
  const double levels[5] = {1.5, 9, 0.5, 1.5, -1};
  /* Larger values on the left. The diagonal has 3 x: 1.5 at x = 1/2, 0.5 at 1/6. */
  const double expected[36] = {0.5,    0.5,    5, 1,   0.25, 5, 0, 0.75, 5, 0.5,    0.5,    5, /* 1.5 */
                               1 / 6., 1 / 6., 5, 0.5, 0,    5, 0, 0.25, 5, 1 / 6., 1 / 6., 5, /* 0.5 */
                               0.5,    0.5,    5, 1,   0.25, 5, 0, 0.75, 5, 0.5,    0.5,    5};
  size_t count = 0;
  double *segments = NULL, worst = 0;
  T_OK(batten_mesh_level_lines(ctx, mesh, VALUES, 5, levels, &count, &segments), ctx);
  T_CHECK(count == 6, "%zu segments of 6", count);
  for (size_t k = 0; k < 36 && count == 6; k++) worst = fmax(worst, fabs(segments[k] - expected[k]));
  T_RATIO(worst, 2 * DBL_EPSILON, "segments by hand, in the order of levels and triangles");
  T_CHECK(count == 6 && memcmp(segments, segments + 9, 3 * sizeof *segments) == 0,
          "triangles agree where they meet in all bits");
  batten_free(ctx, segments);
  batten_mesh_free(mesh);
}

/* Levels at corners, none, values that are not finite, and whose differences are beyond a double. */
static void test_edges(batten_context *ctx) {
  batten_mesh *mesh = square(ctx);
  size_t count = 7;
  double *segments = NULL, level = 1, none[4] = {0, NAN, 3, 2}, huge[4] = {-DBL_MAX, 0, DBL_MAX, 0};
  T_OK(batten_mesh_level_lines(ctx, mesh, VALUES, 1, &level, &count, &segments), ctx);
  T_CHECK(count == 2, "through a corner: %zu segments of 2", count);
  T_CHECK(segments[3] == 1 && segments[4] == 0, "ends in the corner");
  batten_free(ctx, segments);
  T_OK(batten_mesh_level_lines(ctx, mesh, VALUES, 0, NULL, &count, &segments), ctx);
  T_CHECK(count == 0 && !segments, "no levels, no segments");
  T_OK(batten_mesh_level_lines(ctx, mesh, none, 1, &level, &count, &segments), ctx);
  T_CHECK(count == 1 && segments[0] == 0 && segments[4] > 0.3, "a triangle without a value at a corner has no lines");
  batten_free(ctx, segments);
  level = DBL_MAX / 2;
  T_OK(batten_mesh_level_lines(ctx, mesh, huge, 1, &level, &count, &segments), ctx);
  T_CHECK(count == 2 && segments[3] == 1 && segments[4] == 0.5 && segments[0] == 0.75, "values up to DBL_MAX");
  batten_free(ctx, segments);
  batten_mesh_free(mesh);
  T_OK(batten_mesh_create(ctx, 0, NULL, 0, NULL, &mesh), ctx);
  T_OK(batten_mesh_level_lines(ctx, mesh, NULL, 1, &level, &count, &segments), ctx);
  T_CHECK(count == 0 && !segments, "an empty mesh");
  batten_mesh_free(mesh);
}

enum { GRID = 40 };
static batten_mesh *grid(batten_context *ctx, double *values) {
  static double vertices[GRID * GRID][3];
  static uint32_t triangles[2 * (GRID - 1) * (GRID - 1)][3];
  size_t t = 0;
  for (uint32_t i = 0; i < GRID; i++)
    for (uint32_t j = 0; j < GRID; j++) {
      double x = -1 + 2. * i / (GRID - 1), y = -1 + 2. * j / (GRID - 1);
      uint32_t at = i * GRID + j;
      memcpy(vertices[at], (double[3]){x, y, 0}, sizeof vertices[at]);
      values[at] = hypot(x, y);
      if (i + 1 == GRID || j + 1 == GRID) continue;
      memcpy(triangles[t++], (uint32_t[3]){at, at + GRID, at + GRID + 1}, sizeof *triangles);
      memcpy(triangles[t++], (uint32_t[3]){at, at + GRID + 1, at + 1}, sizeof *triangles);
    }
  batten_mesh *mesh = NULL;
  return batten_mesh_create(ctx, (size_t)GRID * GRID, vertices[0], t, triangles[0], &mesh) == BATTEN_OK ? mesh : NULL;
}

/* Circles: their lengths, closed (each end is the start of another in all bits), larger on the left; and each level
 * alone gives the same as all together. */
static void test_circles(batten_context *ctx) {
  static double values[GRID * GRID];
  const double levels[4] = {0.9, 0.3, 0.6, 0.45};
  batten_mesh *mesh = grid(ctx, values);
  size_t count = 0, at = 0, open = 0, turned = 0;
  double *segments = NULL;
  T_OK(batten_mesh_level_lines(ctx, mesh, values, 4, levels, &count, &segments), ctx);
  bool same = true;
  for (int k = 0; k < 4; k++) {
    size_t alone_count = 0;
    double *alone = NULL, length = 0;
    batten_mesh_level_lines(ctx, mesh, values, 1, &levels[k], &alone_count, &alone);
    same = same && at + alone_count <= count && !memcmp(alone, segments + 6 * at, alone_count * 6 * sizeof *alone);
    for (size_t i = 0; i < alone_count; i++) {
      const double *p = alone + 6 * i, *q = p + 3;
      bool found = false;
      length += vec_distance(p, q);
      turned += p[0] * q[1] - p[1] * q[0] > 1e-12;
      for (size_t j = 0; j < alone_count && !found; j++) found = !memcmp(q, alone + 6 * j, 3 * sizeof *q);
      open += !found;
    }
    double circle = 2 * 3.14159265358979323846 * levels[k];
    T_RATIO(fabs(length - circle) / circle, 5e-3, "circle of radius %g", levels[k]);
    at += alone_count;
    batten_free(ctx, alone);
  }
  T_CHECK(same && at == count, "levels alone and together agree");
  T_CHECK(open == 0, "%zu ends without a start", open);
  T_CHECK(turned == 0, "%zu segments with the larger values on their right", turned);
  batten_free(ctx, segments);
  batten_mesh_free(mesh);
}

static batten_status lines(batten_context *ctx, void *arg) {
  const double levels[2] = {1.5, 0.5};
  size_t count = 0;
  double *segments = NULL;
  (void)arg;
  batten_mesh *mesh = square(ctx);
  if (!mesh) return BATTEN_E_NOMEM;
  batten_status st = batten_mesh_level_lines(ctx, mesh, VALUES, 2, levels, &count, &segments);
  batten_free(ctx, segments);
  batten_mesh_free(mesh);
  return st;
}

static void test_bad(batten_context *ctx) {
  batten_mesh *mesh = square(ctx);
  double levels[2] = {1, INFINITY}, *segments = levels;
  size_t count = 7;
  T_CHECK(batten_mesh_level_lines(NULL, mesh, VALUES, 1, levels, &count, &segments) == BATTEN_E_INVALID,
          "no context");
  T_STATUS(batten_mesh_level_lines(ctx, NULL, VALUES, 1, levels, &count, &segments), BATTEN_E_INVALID, ctx,
           "mesh: NULL");
  T_STATUS(batten_mesh_level_lines(ctx, mesh, NULL, 1, levels, &count, &segments), BATTEN_E_INVALID, ctx,
           "values: NULL; give one for each of the 4 vertices");
  T_STATUS(batten_mesh_level_lines(ctx, mesh, VALUES, 2, NULL, &count, &segments), BATTEN_E_INVALID, ctx,
           "levels: NULL");
  T_STATUS(batten_mesh_level_lines(ctx, mesh, VALUES, 2, levels, &count, &segments), BATTEN_E_INVALID, ctx,
           "levels[1]: inf");
  T_STATUS(batten_mesh_level_lines(ctx, mesh, VALUES, 1, levels, NULL, &segments), BATTEN_E_INVALID, ctx,
           "count: NULL");
  T_STATUS(batten_mesh_level_lines(ctx, mesh, VALUES, 1, levels, &count, NULL), BATTEN_E_INVALID, ctx,
           "segments: NULL");
  T_CHECK(count == 7 && segments == levels, "failures leave the results alone");
  batten_mesh_free(mesh);
  t_fail_every_allocation("batten_mesh_level_lines", lines, NULL);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_edges(ctx);
  test_circles(ctx);
  test_bad(ctx);
  batten_context_free(ctx);
  return t_done();
}
