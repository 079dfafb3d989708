/* Outward normals of unoriented points, against shapes whose normals are known. */
#include <batten/batten.h>

#include "orient_scenes.h"

static double orient(batten_context *ctx, const scene *s, batten_orient_method method, size_t energy_points,
                     double least, double least_30) {
  double *normals = calloc(s->count * s->n, sizeof *normals), lambda = -1;
  batten_orient_method used = BATTEN_ORIENT_METHOD_AUTO;
  T_OK(batten_orient(ctx, s->n, s->count, s->points, method, energy_points, normals, &used, &lambda), ctx);
  double share = s_within(s, normals, 90), share_30 = s_within(s, normals, 30);
  T_CHECK(share >= least && share_30 >= least_30,
          "%s, %zu points, %s: %.2f %% within 90 degrees (at least %g), %.2f %% within 30 (%g), lambda %.2g", s->name,
          s->count, used == BATTEN_ORIENT_METHOD_PLANES ? "planes" : "energy", share, least, share_30, least_30,
          lambda);
  free(normals);
  return share;
}

static void test_planes(batten_context *ctx) {
  scene s = s_new("torus", 3);
  s_torus(&s, 600, (double[3]){0}, 1, 0.35, 2, 1);
  orient(ctx, &s, BATTEN_ORIENT_METHOD_PLANES, 0, 100, 98);
  s_free(&s);
  s = s_new("thick C", 2);
  s_thick_c(&s, 59);
  orient(ctx, &s, BATTEN_ORIENT_METHOD_PLANES, 0, 100, 100);
  s_free(&s);
  s = s_new("plate, sides 5 spacings apart", 3);
  s_plate(&s, 20, 5, 0.3, 5);
  orient(ctx, &s, BATTEN_ORIENT_METHOD_PLANES, 0, 100, 80);
  s_free(&s);
  s = s_new("three balls", 3);
  for (int i = 0; i < 3; i++) s_sphere(&s, 60, (double[3]){i == 1, i == 2, 0}, 0.1, 1);
  orient(ctx, &s, BATTEN_ORIENT_METHOD_PLANES, 0, 100, 100);
  s_free(&s);
}

static void test_bad_input(batten_context *ctx) {
  double x[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1},
         flat[15] = {0, 0, 7, 1, 0, 7, 0, 1, 7, 1, 1, 7, 2, 1, 7};
  double line[8] = {0, 0, 1, 2, 2, 4, 5, 10}, equal[15] = {0}, normals[15];
  const batten_orient_method planes = BATTEN_ORIENT_METHOD_PLANES, automatic = BATTEN_ORIENT_METHOD_AUTO;
  T_STATUS(batten_orient(ctx, 1, 5, x, planes, 1000, normals, NULL, NULL), BATTEN_E_INVALID, ctx, "n: 1");
  T_STATUS(batten_orient(ctx, 4, 5, x, planes, 1000, normals, NULL, NULL), BATTEN_E_INVALID, ctx, "n: 4");
  T_STATUS(batten_orient(ctx, 3, 4, x, planes, 1000, normals, NULL, NULL), BATTEN_E_INVALID, ctx,
           "count: 4; 5 points");
  T_STATUS(batten_orient(ctx, 3, 0, x, planes, 1000, normals, NULL, NULL), BATTEN_E_INVALID, ctx, "count: 0");
  T_STATUS(batten_orient(ctx, 3, 5, NULL, planes, 1000, normals, NULL, NULL), BATTEN_E_INVALID, ctx, "points: NULL");
  T_STATUS(batten_orient(ctx, 3, 5, x, planes, 1000, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "normals: NULL");
  T_STATUS(batten_orient(ctx, 3, 5, x, (batten_orient_method)7, 9, normals, NULL, NULL), BATTEN_E_INVALID, ctx,
           "method: 7");
  T_STATUS(batten_orient(ctx, 3, 5, x, automatic, 3, normals, NULL, NULL), BATTEN_E_INVALID, ctx, "energy_points: 3");
  T_STATUS(batten_orient(ctx, 3, SIZE_MAX / 8, x, planes, 9, normals, NULL, NULL), BATTEN_E_TOO_LARGE, ctx, "count");
  T_STATUS(batten_orient(ctx, 3, 5, flat, automatic, 9, normals, NULL, NULL), BATTEN_E_SINGULAR, ctx,
           "plane, normal (0, 0, ");
  T_STATUS(batten_orient(ctx, 2, 4, line, planes, 9, normals, NULL, NULL), BATTEN_E_SINGULAR, ctx, "line, normal (");
  T_STATUS(batten_orient(ctx, 3, 5, equal, planes, 9, normals, NULL, NULL), BATTEN_E_SINGULAR, ctx,
           "all 5 are equal");
  x[7] = NAN;
  T_STATUS(batten_orient(ctx, 3, 5, x, planes, 9, normals, NULL, NULL), BATTEN_E_INVALID, ctx,
           "points[2]: coordinate 1 is nan");
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_planes(ctx);
  test_bad_input(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left behind");
  batten_context_free(ctx);
  return t_done();
}
