/* Places on networks: against closed forms, differences, and in other units and frames. */
#include "mesh/vec.h"
#include "network_shapes.h"
#include "tap.h"

#include <float.h>

/* The graph of f: K = (fxx fyy - fxy^2) / W^4, 2 H = ((1 + fy^2) fxx - 2 fx fy fxy + (1 + fx^2) fyy) / W^3 towards
 * the normal, W^2 = 1 + fx^2 + fy^2. */
static void test_graph(batten_context *ctx, unsigned split) {
  shape s = shape_graph(3, 3, split, shape_saddle);
  batten_network *n = network_of(ctx, &s);
  uint64_t seed = 3;
  enum { COUNT = 700 };
  batten_place places[COUNT];
  batten_surface_point *points = malloc(COUNT * sizeof *points);
  for (size_t i = 0; i < COUNT; i++) {
    places[i].patch = (uint32_t)(i % s.patches);
    places[i].u = t_uniform(&seed);
    places[i].v = (1 - places[i].u) * t_uniform(&seed);
  }
  T_OK(batten_network_evaluate(ctx, n, COUNT, places, points), ctx);
  double place = 0, normal = 0, gauss = 0, mean = 0, principal = 0, axes = 0;
  for (size_t i = 0; i < COUNT; i++) {
    const batten_surface_point *p = &points[i];
    double x = p->point[0], y = p->point[1], q[3];
    shape_saddle((double[2]){x, y}, q);
    place = worse(place, fabs(q[2] - p->point[2]));
    double fx = 0.9 * x * x - y, fy = y - x, fxx = 1.8 * x, w = sqrt(1 + fx * fx + fy * fy);
    const double up[3] = {-fx / w, -fy / w, 1 / w};
    normal = worse(normal, vec_distance(up, p->normal));
    double k = (fxx - 1) / pow(w, 4);
    double h = -((1 + fy * fy) * fxx + 2 * fx * fy + (1 + fx * fx)) / (2 * pow(w, 3));
    gauss = worse(gauss, fabs(p->gauss - k));
    mean = worse(mean, fabs(p->mean - h));
    principal = worse(principal, fabs(p->principal[0] - h - sqrt(fmax(0, h * h - k))) +
                                     fabs(p->principal[1] - h + sqrt(fmax(0, h * h - k))));
    for (int a = 0; a < 2; a++) {
      axes = worse(axes, fabs(vec_norm(p->directions[a]) - 1));
      axes = worse(axes, fabs(vec_dot(p->directions[a], p->normal)));
      /* Along a direction (dx, dy, .) the curvature is -(fxx dx^2 - 2 dx dy + dy^2) / w. */
      double dx = p->directions[a][0], dy = p->directions[a][1];
      axes = worse(axes, fabs(-(fxx * dx * dx - 2 * dx * dy + dy * dy) / w - p->principal[a]));
    }
    axes = worse(axes, fabs(vec_dot(p->directions[0], p->directions[1])));
  }
  T_RATIO(place, 1e-13, "cubic graph, split %u: points", split);
  T_RATIO(normal, 1e-12, "normals");
  T_RATIO(gauss, 2e-11, "Gauss curvature");
  T_RATIO(mean, 2e-11, "mean curvature, its sign");
  T_RATIO(principal, 1e-9, "principal curvatures, larger first");
  T_RATIO(axes, 2e-11, "principal directions: orthonormal, tangent, of that curvature");
  free(points);
  batten_network_free(n);
  shape_free(&s);
}

static batten_surface_point at_place(batten_context *ctx, const batten_network *n, uint32_t patch, double u,
                                     double v) {
  batten_surface_point p;
  memset(&p, 0, sizeof p);
  T_OK(batten_network_evaluate(ctx, n, 1, &(batten_place){patch, u, v}, &p), ctx);
  return p;
}

static void test_special_places(batten_context *ctx) {
  shape s = shape_graph(2, 2, 0, shape_cap);
  batten_network *n = network_of(ctx, &s);
  batten_surface_point p = at_place(ctx, n, 0, 0, 1); /* face 0 ends with the middle vertex at k = n */
  T_CHECK(vec_norm(p.point) < 1e-15 && fabs(p.gauss - 1) < 1e-13 && fabs(p.mean - 1) < 1e-13,
          "top of a cap: both curvatures 1, away from the normal");
  T_CHECK(fabs(vec_norm(p.directions[0]) - 1) < 1e-14 && fabs(vec_dot(p.directions[0], p.directions[1])) < 1e-14 &&
              fabs(p.directions[0][2]) < 1e-14,
          "umbilic: some orthonormal pair of directions");
  batten_network_free(n);
  shape_free(&s);

  s = shape_graph(2, 2, 0, shape_ridge);
  n = network_of(ctx, &s);
  p = at_place(ctx, n, 0, 0, 1);
  T_CHECK(fabs(p.principal[0] - 1) < 1e-13 && fabs(p.principal[1]) < 1e-13 &&
              fabs(fabs(p.directions[0][0]) - 1) < 1e-13 && fabs(fabs(p.directions[1][1]) - 1) < 1e-13,
          "a ridge along y bends along x");
  batten_network_free(n);
  shape_free(&s);

  s = shape_octahedron();
  memcpy(s.control + 3 * TRIANGULAR_MAX, (double[9]){1, 1, 1, 2, 2, 2, 4, 4, 4}, 72); /* a line */
  memset(s.control + 6 * TRIANGULAR_MAX, 0, 72);                                      /* a point */
  n = network_of(ctx, &s);
  p = at_place(ctx, n, 0, 0.2, 0.3);
  T_CHECK(p.gauss == 0 && p.mean == 0 && fabs(p.normal[0] - 1 / sqrt(3)) < 1e-15 && p.duu[0] == 0, "a flat patch");
  for (uint32_t k = 1; k <= 2; k++) {
    p = at_place(ctx, n, k, 0.2, 0.3);
    T_CHECK(vec_norm(p.normal) == 0 && isnan(p.gauss) && isnan(p.mean) && isnan(p.principal[0]) &&
                vec_norm(p.directions[1]) == 0,
            "no normal on a patch that is a %s", k == 1 ? "line" : "point");
  }
  batten_network_free(n);
  shape_free(&s);
}

/* The normal changes by k times the way along a principal direction: differences on the spline torus. */
static void test_torus(batten_context *ctx) {
  shape s = shape_torus(3);
  batten_network *n = network_of(ctx, &s);
  uint64_t seed = 5;
  double worst = 0, out = 1e300;
  for (size_t i = 0; i < 60; i++) {
    batten_place place = {(uint32_t)(t_random(&seed) % s.patches), 0.1 + 0.4 * t_uniform(&seed),
                          0.1 + 0.3 * t_uniform(&seed)};
    batten_surface_point p, q[2];
    if (batten_network_evaluate(ctx, n, 1, &place, &p) < 0) worst = NAN;
    /* Outwards: away from the ring's middle line. */
    double r = hypot(p.point[0], p.point[1]);
    const double spoke[3] = {p.point[0] * (1 - 2 / r), p.point[1] * (1 - 2 / r), p.point[2]};
    out = fmin(out, vec_dot(spoke, p.normal));
    for (int a = 0; a < 2; a++) {
      /* a du + b dv = direction */
      double e = vec_dot(p.du, p.du), f = vec_dot(p.du, p.dv), g = vec_dot(p.dv, p.dv), det = e * g - f * f;
      double x = vec_dot(p.du, p.directions[a]), y = vec_dot(p.dv, p.directions[a]), h = 1e-5;
      double u = (g * x - f * y) / det, v = (e * y - f * x) / det;
      batten_place around[2] = {{place.patch, place.u + h * u, place.v + h * v},
                                {place.patch, place.u - h * u, place.v - h * v}};
      if (batten_network_evaluate(ctx, n, 2, around, q) < 0) worst = NAN;
      for (int d = 0; d < 3; d++)
        worst = worse(worst, fabs((q[0].normal[d] - q[1].normal[d]) / (2 * h) - p.principal[a] * p.directions[a][d]));
    }
  }
  T_RATIO(worst, 1e-8, "torus: the normal turns by k along principal directions");
  T_CHECK(out > 0, "its normals point outwards");
  batten_network_free(n);
  shape_free(&s);
}

static void test_units(batten_context *ctx, batten_context *three) {
  const double shift[3] = {0, 0, 0};
  shape plain = shape_torus(4), large = shape_torus(4), turned = shape_torus(4);
  shape_move(&large, false, 0x1p70, shift);
  shape_move(&turned, true, 1, (double[3]){1, -2, 3});
  batten_network *n[3] = {network_of(ctx, &plain), network_of(ctx, &large), network_of(ctx, &turned)};
  enum { COUNT = 1000 };
  batten_place *places = malloc(COUNT * sizeof *places);
  batten_surface_point *p[4];
  for (int i = 0; i < 4; i++) p[i] = malloc(COUNT * sizeof *p[i]);
  for (size_t i = 0; i < COUNT; i++)
    places[i] = (batten_place){(uint32_t)(i % plain.patches), (double)(i % 7) / 7, (double)(i % 5) / 20};
  for (int i = 0; i < 3; i++) T_OK(batten_network_evaluate(ctx, n[i], COUNT, places, p[i]), ctx);
  T_OK(batten_network_evaluate(three, n[0], COUNT, places, p[3]), three);
  T_CHECK(!memcmp(p[0], p[3], COUNT * sizeof *p[0]), "the same bits on three threads");
  bool exact = true;
  double turn = 0;
  for (size_t i = 0; i < COUNT; i++) {
    exact = exact && ldexp(p[0][i].gauss, -140) == p[1][i].gauss &&
            ldexp(p[0][i].principal[1], -70) == p[1][i].principal[1] && !memcmp(p[0][i].normal, p[1][i].normal, 24) &&
            !memcmp(p[0][i].directions, p[1][i].directions, 48);
    turn = worse(turn, fabs(p[0][i].gauss - p[2][i].gauss) + fabs(p[0][i].mean - p[2][i].mean));
  }
  T_CHECK(exact, "2^70 times as large: curvatures by 2^-70, the same directions, to the bit");
  T_RATIO(turn, 1e-11, "turned and moved: the same curvatures");
  for (int i = 0; i < 4; i++) free(p[i]);
  free(places);
  for (int i = 0; i < 3; i++) batten_network_free(n[i]);
  shape_free(&plain);
  shape_free(&large);
  shape_free(&turned);
}

static void test_bad(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network *n = network_of(ctx, &s);
  batten_place places[2] = {{0, 0.1, 0.1}, {8, 0, 0}};
  batten_surface_point p[2], before[2];
  memset(p, 7, sizeof p);
  memcpy(before, p, sizeof p);
  T_CHECK(batten_network_evaluate(NULL, n, 0, NULL, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_evaluate(ctx, NULL, 2, places, p), BATTEN_E_INVALID, ctx, "network: NULL");
  T_STATUS(batten_network_evaluate(ctx, n, 2, NULL, p), BATTEN_E_INVALID, ctx, "places: NULL");
  T_STATUS(batten_network_evaluate(ctx, n, 2, places, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_network_evaluate(ctx, n, 2, places, p), BATTEN_E_INVALID, ctx,
           "places[1].patch: 8, but there are 8");
  places[1] = (batten_place){1, NAN, 0};
  T_STATUS(batten_network_evaluate(ctx, n, 2, places, p), BATTEN_E_INVALID, ctx, "places[1]: (nan, 0)");
  T_CHECK(!memcmp(p, before, sizeof p), "failures write nothing");
  T_OK(batten_network_evaluate(ctx, n, 0, NULL, NULL), ctx);
  batten_network_free(n);
  shape_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1), *three = t_context(NULL, NULL, 3);
  test_graph(ctx, 0);
  test_graph(ctx, 2);
  test_special_places(ctx);
  test_torus(ctx);
  test_units(ctx, three);
  test_bad(ctx);
  batten_context_free(three);
  batten_context_free(ctx);
  return t_done();
}
