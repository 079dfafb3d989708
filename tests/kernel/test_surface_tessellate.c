/* Meshes of surfaces: regular grids, oriented, with fields, and as close as was asked for. */
#include "mesh/vec.h"
#include "surface_shapes.h"

#include <float.h>

static batten_surface_tessellate_options options(unsigned density, double tolerance) {
  batten_surface_tessellate_options o = batten_surface_tessellate_options_default();
  o.density = density;
  o.tolerance = tolerance;
  return o;
}

static batten_mesh *mesh_of(batten_context *ctx, const batten_surface *s, unsigned density, double tolerance) {
  batten_surface_tessellate_options o = options(density, tolerance);
  batten_mesh *m = NULL;
  T_OK(batten_surface_tessellate(ctx, s, &o, &m), ctx);
  if (!m) exit(1);
  return m;
}

static const double *field(const batten_mesh *m, const char *name, size_t components) {
  for (size_t i = 0; i < batten_mesh_field_count(m); i++) {
    const char *own;
    size_t count;
    const double *values = batten_mesh_field(m, i, &own, &count);
    if (strcmp(own, name) == 0 && count == components) return values;
  }
  printf("# no field %s\n", name);
  exit(1);
}

/* By hand: one bilinear cell, cut once in each direction. */
static void test_small(batten_context *ctx) {
  surface_case c = surface_case_bowl(1, 1);
  surface_case_graph(&c, (const double[3][3]){{0, 0, 0}, {0, 0, 0}, {0, 0, 0}});
  batten_surface *s = surface_case_make(ctx, &c);
  batten_mesh *m = mesh_of(ctx, s, 1, 0);
  static const double corners[12] = {-1, -1, 0, -1, 1, 0, 1, -1, 0, 1, 1, 0};
  static const uint32_t triangles[6] = {0, 2, 3, 0, 3, 1};
  T_CHECK(batten_mesh_vertex_count(m) == 4 && memcmp(batten_mesh_vertices(m), corners, sizeof corners) == 0,
          "corners, v runs faster");
  T_CHECK(batten_mesh_triangle_count(m) == 2 && memcmp(batten_mesh_triangles(m), triangles, sizeof triangles) == 0,
          "two triangles, counter-clockwise from above");
  batten_mesh_free(m);
  batten_surface_free(s);
}

/* Vertices are points of the surface with its normals and curvatures; triangles have the normals' side. */
static void test_fields(batten_context *ctx, unsigned p, unsigned q, unsigned spans, unsigned fold,
                        unsigned density) {
  surface_case c = surface_case_random(p, q, spans, spans + 1, fold, 13);
  batten_surface *s = surface_case_make(ctx, &c);
  batten_mesh *m = mesh_of(ctx, s, density, 0);
  size_t count = batten_mesh_vertex_count(m), rows = spans * density + 1, columns = (spans + 1) * density + 1;
  T_CHECK(count == rows * columns && batten_mesh_triangle_count(m) == 2 * (rows - 1) * (columns - 1),
          "degrees %u, %u: %zu x %zu vertices", p, q, rows, columns);
  const double *vertices = batten_mesh_vertices(m), *place = field(m, "place", 2), *normal = field(m, "normal", 3),
               *gauss = field(m, "gauss", 1), *mean = field(m, "mean", 1);
  batten_surface_point *points = malloc(count * sizeof *points);
  T_OK(batten_surface_evaluate(ctx, s, count, place, points), ctx);
  bool same = true;
  for (size_t v = 0; v < count; v++)
    same = same && memcmp(points[v].point, vertices + 3 * v, 24) == 0 &&
           memcmp(points[v].normal, normal + 3 * v, 24) == 0 && points[v].gauss == gauss[v] &&
           points[v].mean == mean[v];
  T_CHECK(same, "fields are what evaluation gives at the places");
  bool corners = place[0] == c.knots[0][0] && place[2 * count - 1] == c.knots[1][c.knot_count[1] - 1];
  for (int d = 0; d < 3; d++)
    corners = corners && vertices[d] == c.control[0][d] &&
              vertices[3 * (count - 1) + (size_t)d] == c.control[c.points[0] * c.points[1] - 1][d];
  T_CHECK(corners, "the corners are the corners of the net");
  double least = INFINITY;
  const uint32_t *t = batten_mesh_triangles(m);
  for (size_t f = 0; f < batten_mesh_triangle_count(m); f++) {
    double n[3];
    vec_triangle_normal(vertices + 3 * (size_t)t[3 * f], vertices + 3 * (size_t)t[3 * f + 1],
                        vertices + 3 * (size_t)t[3 * f + 2], n);
    least = fmin(least, vec_dot(n, normal + 3 * (size_t)t[3 * f]) / vec_norm(n));
  }
  T_CHECK(least > 0, "triangles are seen counter-clockwise from the normals' side: %g", least);
  batten_mesh_measures measures;
  T_OK(batten_mesh_measure(ctx, m, &measures), ctx);
  T_CHECK(measures.manifold && measures.oriented && measures.euler == 1 && measures.boundary_loops == 1, "a disc");
  free(points);
  batten_mesh_free(m);
  batten_surface_free(s);
}

/* The largest distance of places inside triangles from the point of the surface at the same parameters. */
static double off(batten_context *ctx, const batten_surface *s, const batten_mesh *m) {
  static const double weights[7][3] = {
      {0.5, 0.5, 0},     {0, 0.5, 0.5},     {0.5, 0, 0.5},    {1 / 3., 1 / 3., 1 / 3.},
      {0.25, 0.25, 0.5}, {0.25, 0.5, 0.25}, {0.5, 0.25, 0.25}};
  const double *x = batten_mesh_vertices(m), *place = field(m, "place", 2);
  const uint32_t *t = batten_mesh_triangles(m);
  double worst = 0;
  for (size_t f = 0; f < batten_mesh_triangle_count(m); f++)
    for (int w = 0; w < 7; w++) {
      double at[2] = {0, 0}, flat[3] = {0, 0, 0};
      for (int k = 0; k < 3; k++) {
        for (int d = 0; d < 3; d++) flat[d] += weights[w][k] * x[3 * (size_t)t[3 * f + (size_t)k] + (size_t)d];
        for (int d = 0; d < 2; d++) at[d] += weights[w][k] * place[2 * (size_t)t[3 * f + (size_t)k] + (size_t)d];
      }
      batten_surface_point p;
      if (batten_surface_evaluate(ctx, s, 1, at, &p) < 0) return NAN;
      worst = surface_worse(worst, vec_distance(p.point, flat));
    }
  return worst;
}

static void test_tolerance(batten_context *ctx) {
  static const double bowls[4][3][3] = {{{0, 0, 0.5}, {0, 0, 0}, {0.5, 0, 0}},   /* round */
                                        {{0, 0, 0.005}, {0, 0, 0}, {0.5, 0, 0}}, /* long */
                                        {{0, 0, 0}, {0, 1, 0}, {0, 0, 0}},       /* only uv */
                                        {{0, 0, 0}, {0, 0.3, 0}, {0.5, 0, 0}}};
  for (int k = 0; k < 4; k++) {
    surface_case c = surface_case_bowl(2, k == 0 ? 3 : 1);
    surface_case_graph(&c, bowls[k]);
    batten_surface *s = surface_case_make(ctx, &c);
    for (double tolerance = 0.1; tolerance > 1e-4; tolerance /= 7) {
      batten_mesh *m = mesh_of(ctx, s, 1024, tolerance);
      double worst = off(ctx, s, m);
      T_CHECK(worst <= tolerance && (worst > 0.2 * tolerance || batten_mesh_triangle_count(m) <= 18),
              "shape %d: within %.1e of %.1e by %zu triangles", k, worst, tolerance, batten_mesh_triangle_count(m));
      batten_mesh_free(m);
    }
    batten_surface_free(s);
  }
  surface_case c = surface_case_random(3, 3, 3, 2, 1, 3);
  batten_surface *s = surface_case_make(ctx, &c);
  batten_mesh *m = mesh_of(ctx, s, 1024, 1e-3);
  T_RATIO(off(ctx, s, m), 1e-3, "random: %zu triangles", batten_mesh_triangle_count(m));
  batten_mesh_free(m);
  m = mesh_of(ctx, s, 2, 1e-9);
  T_CHECK(batten_mesh_vertex_count(m) == 7 * 5, "density at most");
  batten_mesh_free(m);
  m = mesh_of(ctx, s, 1024, 1e300);
  T_CHECK(batten_mesh_vertex_count(m) == 4 * 3, "a segment a span at least");
  batten_mesh_free(m);
  batten_surface_free(s);
}

static void test_special(batten_context *ctx) {
  surface_case c = surface_case_bowl(3, 1);
  for (size_t j = 1; j < c.points[1]; j++) memcpy(c.control[j], c.control[0], sizeof *c.control);
  batten_surface *s = surface_case_make(ctx, &c);
  batten_mesh *m = mesh_of(ctx, s, 4, 0);
  const double *normal = field(m, "normal", 3), *gauss = field(m, "gauss", 1);
  T_CHECK(vec_norm(normal) == 0 && isnan(gauss[0]) && isfinite(gauss[5]), "a side drawn together has no normal");
  batten_mesh_free(m);
  batten_surface_free(s);
  c = surface_case_bowl(3, 2);
  for (size_t i = 0; i < c.points[0] * c.points[1]; i++)
    for (int d = 0; d < 3; d++) c.control[i][d] = ldexp(c.control[i][d], 600);
  s = surface_case_make(ctx, &c);
  m = mesh_of(ctx, s, 1024, ldexp(1e-3, 600));
  surface_case small = surface_case_bowl(3, 2);
  batten_surface *own = surface_case_make(ctx, &small);
  batten_mesh *same = mesh_of(ctx, own, 1024, 1e-3);
  T_CHECK(batten_mesh_triangle_count(m) == batten_mesh_triangle_count(same), "in another unit as many triangles");
  batten_mesh_free(same);
  batten_mesh_free(m);
  batten_surface_free(own);

  batten_surface_tessellate_options o = options(0, 0);
  m = NULL;
  T_STATUS(batten_surface_tessellate(ctx, s, &o, &m), BATTEN_E_INVALID, ctx, "opt.density: 0; give 1 to 1024");
  o.density = 1025;
  T_STATUS(batten_surface_tessellate(ctx, s, &o, &m), BATTEN_E_INVALID, ctx, "opt.density: 1025");
  o = options(4, -1);
  T_STATUS(batten_surface_tessellate(ctx, s, &o, &m), BATTEN_E_INVALID, ctx, "opt.tolerance: -1");
  o.tolerance = INFINITY;
  T_STATUS(batten_surface_tessellate(ctx, s, &o, &m), BATTEN_E_INVALID, ctx, "opt.tolerance: inf");
  o = (batten_surface_tessellate_options){.struct_size = 3};
  T_STATUS(batten_surface_tessellate(ctx, s, &o, &m), BATTEN_E_INVALID, ctx, "struct_size: 3");
  T_STATUS(batten_surface_tessellate(ctx, NULL, NULL, &m), BATTEN_E_INVALID, ctx, "surface: NULL");
  T_STATUS(batten_surface_tessellate(ctx, s, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(!m && batten_surface_tessellate(NULL, s, NULL, &m) == BATTEN_E_INVALID, "no context; nothing written");
  T_OK(batten_surface_tessellate(ctx, s, NULL, &m), ctx);
  T_CHECK(batten_mesh_vertex_count(m) == 33 * 33, "without options: 16 segments a span");
  batten_mesh_free(m);
  batten_surface_free(s);

  /* 32 x 32 spans of 1024 segments: 2^31 triangles have 3 2^31 corners. */
  c = surface_case_bowl(1, 31);
  for (int k = 0; k < 2; k++) surface_case_axis(&c, k, 1, 31, 1, -1, 1);
  s = surface_case_make(ctx, &c);
  o = options(1024, 0);
  m = NULL;
  T_STATUS(batten_surface_tessellate(ctx, s, &o, &m), BATTEN_E_TOO_LARGE, ctx,
           "opt.density: 1024 on 31 x 31 spans gives more");
  batten_surface_free(s);
}

static batten_status make_one(batten_context *ctx, void *arg) {
  batten_surface_form f = surface_case_form(arg);
  batten_surface *s;
  batten_mesh *m;
  batten_status st = batten_surface_create(ctx, &f, &s);
  if (st < 0) return st;
  st = batten_surface_tessellate(ctx, s, NULL, &m);
  if (st >= 0) batten_mesh_free(m);
  batten_surface_free(s);
  return st;
}

static void test_threads(const surface_case *c) {
  batten_context *ctx[2];
  batten_surface *s[2];
  batten_mesh *m[2];
  for (int k = 0; k < 2; k++) {
    ctx[k] = t_context(NULL, NULL, k ? 4 : 1);
    s[k] = surface_case_make(ctx[k], c);
    m[k] = mesh_of(ctx[k], s[k], 20, 0);
  }
  size_t count = batten_mesh_vertex_count(m[0]), triangles = batten_mesh_triangle_count(m[0]);
  T_CHECK(memcmp(batten_mesh_vertices(m[0]), batten_mesh_vertices(m[1]), count * 24) == 0 &&
              memcmp(batten_mesh_triangles(m[0]), batten_mesh_triangles(m[1]), triangles * 12) == 0 &&
              memcmp(field(m[0], "gauss", 1), field(m[1], "gauss", 1), count * 8) == 0,
          "1 and 4 threads: the same bits");
  for (int k = 0; k < 2; k++) {
    batten_mesh_free(m[k]);
    batten_surface_free(s[k]);
    batten_context_free(ctx[k]);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_small(ctx);
  test_fields(ctx, 3, 3, 1, 1, 16);
  test_fields(ctx, 2, 5, 3, 2, 5);
  test_fields(ctx, 1, 1, 2, 1, 3);
  test_tolerance(ctx);
  test_special(ctx);
  surface_case c = surface_case_random(3, 3, 2, 2, 1, 3);
  test_threads(&c);
  t_fail_every_allocation("batten_surface_tessellate", make_one, &c);
  batten_context_free(ctx);
  return t_done();
}
