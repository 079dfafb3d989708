/* Tessellation of networks: patterns, closed meshes, convergence, tolerance. */
#include "network/pattern.h"
#include "network/surface.h"
#include "network_check.h"
#include "network_shapes.h"

/* ---- patterns -------------------------------------------------------------------------------------- */

/* All sides of 1 .. 9 segments: the triangles cover the triangle once, share edges, and use every vertex. */
static void test_patterns(batten_context *ctx) {
  bool counted = true, positive = true, joined = true;
  double worst = 0;
  size_t patterns = 0;
  for (unsigned a = 1; a <= 9; a++)
    for (unsigned b = 1; b <= 9; b++)
      for (unsigned c = 1; c <= 9; c++, patterns++) {
        net_pattern p = {.segments = {a, b, c}, .corner = {0, 1, 2}, .back = {false, a % 2 == 0, true}};
        unsigned n = net_pattern_steps(p.segments);
        double xyz[3 * 64] = {0};
        uint32_t out[128][3];
        size_t next = 3, triangles = net_pattern_triangle_count(p.segments);
        static const double corner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
        for (unsigned i = 0; i < 3; i++) {
          memcpy(xyz + 3 * i, corner[i], sizeof corner[i]);
          p.first[i] = (uint32_t)next;
          for (unsigned s = 1; s < p.segments[i]; s++)
            for (int x = 0; x < 2; x++)
              xyz[3 * net_pattern_vertex(&p, i, s) + (unsigned)x] =
                  corner[i][x] + (corner[(i + 1) % 3][x] - corner[i][x]) * s / p.segments[i];
          next += p.segments[i] - 1;
        }
        p.inner = (uint32_t)next;
        for (unsigned k = 1; k + 1 < n; k++)
          for (unsigned j = 1; j + k < n; j++, next++) {
            xyz[3 * next] = (double)j / n;
            xyz[3 * next + 1] = (double)k / n;
          }
        counted &= next == p.inner + net_pattern_inner_count(p.segments);
        memset(out, 0xff, sizeof out);
        net_pattern_triangulate(&p, out);
        counted &= out[triangles - 1][0] != UINT32_MAX && out[triangles][0] == UINT32_MAX;
        double area = 0;
        for (size_t t = 0; t < triangles && counted; t++) {
          double normal[3];
          vec_triangle_normal(xyz + 3 * out[t][0], xyz + 3 * out[t][1], xyz + 3 * out[t][2], normal);
          positive &= normal[2] > 1e-12;
          area += normal[2];
        }
        worst = fmax(worst, fabs(area - 1));
        batten_mesh *mesh = NULL;
        batten_mesh_measures m;
        if (batten_mesh_create(ctx, next, xyz, triangles, out[0], &mesh) == BATTEN_OK &&
            batten_mesh_measure(ctx, mesh, &m) == BATTEN_OK)
          joined &= m.manifold && m.oriented && m.euler == 1 && m.boundary_edges == a + b + c && m.vertices == next;
        else
          joined = false;
        batten_mesh_free(mesh);
      }
  T_CHECK(counted, "%zu patterns have the vertices and triangles that are told", patterns);
  T_CHECK(positive, "their triangles are counter-clockwise");
  T_CHECK(joined, "they are disks with the sides' segments as boundary");
  T_RATIO(worst, 1e-14, "and cover the triangle");
}

/* ---- networks -------------------------------------------------------------------------------------- */

/* A network of three quartics (or one quintic) a facet over a scene. */
static batten_network *scene_network(batten_context *ctx, scene_mesh mesh, bool peters) {
  batten_network_options o = check_options(3);
  batten_network *network = NULL;
  check_net n;
  batten_status st = check_net_make(ctx, mesh, &o, true, &n);
  if (st == BATTEN_OK)
    st = net_surface_new(ctx, mesh.vertices, mesh.points, mesh.triangles, mesh.corners, NULL, 0, NULL, peters ? 5 : 4,
                         peters ? 1 : 3, &network);
  if (st == BATTEN_OK && peters)
    st = net_fill_peters(ctx, &n.t, n.normals, n.local, (double(*)[21][3])net_surface_points(network, 0));
  for (size_t f = 0; st == BATTEN_OK && !peters && f < mesh.triangles; f++) {
    double edges[3][4][3], normal[3][3];
    net_facet_cubics(&n.t, n.normals, n.local, f, edges, normal);
    net_fill_ss(false, (const double(*)[4][3])edges, (const double(*)[3])normal,
                (double(*)[15][3])net_surface_points(network, 3 * f));
  }
  if (st != BATTEN_OK) t_line(false, "network of a scene: %s", batten_error(ctx));
  check_net_free(ctx, &n);
  return network;
}

static batten_mesh *tessellate(batten_context *ctx, const batten_network *network, unsigned density, double tolerance,
                               int per_patch) {
  batten_tessellate_options o = batten_tessellate_options_default();
  o.density = density;
  o.tolerance = tolerance;
  o.per_patch = per_patch;
  batten_mesh *mesh = NULL;
  if (batten_network_tessellate(ctx, network, &o, &mesh) != BATTEN_OK) t_line(false, "%s", batten_error(ctx));
  return mesh;
}

static const double *field(const batten_mesh *mesh, const char *name, size_t components) {
  const char *found;
  size_t count;
  const double *values;
  for (size_t i = 0; (values = batten_mesh_field(mesh, i, &found, &count)) != NULL; i++)
    if (strcmp(found, name) == 0 && count == components) return values;
  return NULL;
}

/* Largest distance of the triangles' middles and sides' middles from the surface. */
static double chord_error(batten_context *ctx, const batten_network *network, const batten_mesh *mesh) {
  size_t every = batten_mesh_triangle_count(mesh) / 1500 + 1, triangles = batten_mesh_triangle_count(mesh) / every;
  size_t count = 4 * triangles; /* 6000 places at most */
  double *points = scene_allocate(3 * count * sizeof *points), *distances = scene_allocate(count * sizeof *distances);
  batten_place *places = scene_allocate(count * sizeof *places);
  for (size_t t = 0; t < triangles; t++)
    for (size_t i = 0; i < 4; i++)
      for (size_t x = 0; x < 3; x++) {
        double sum = 0;
        for (size_t k = 0; k < 3; k++)
          sum += batten_mesh_vertices(mesh)[3 * batten_mesh_triangles(mesh)[3 * t * every + k] + x] *
                 (i == 3 ? 1 : k != i);
        points[3 * (4 * t + i) + x] = sum / (i == 3 ? 3 : 2);
      }
  double worst = NAN;
  if (batten_network_closest(ctx, network, count, points, places, distances) == BATTEN_OK) {
    worst = 0;
    for (size_t i = 0; i < count; i++) worst = fmax(worst, distances[i]);
  }
  free(points);
  free(distances);
  free(places);
  return worst;
}

typedef struct subject {
  const char *name;
  batten_network *network;
  bool closed;
  long euler;
} subject;

static void bowl(const double xy[2], double out[3]) {
  out[0] = xy[0];
  out[1] = xy[1];
  out[2] = 0.5 * xy[0] * xy[0] - 0.2 * xy[0] * xy[1] + 0.3 * xy[1] * xy[1];
}
/* Steep in one corner: patches that ask for different numbers of segments. */
static void ramp(const double xy[2], double out[3]) {
  double x = xy[0] + 1, y = xy[1] + 1;
  out[0] = xy[0];
  out[1] = xy[1];
  out[2] = 0.05 * (x * x * x * x + y * y * y * x);
}

static batten_network *shape_made(batten_context *ctx, shape s) {
  batten_network *network = NULL;
  if (shape_network(ctx, &s, &network) != BATTEN_OK) t_line(false, "%s", batten_error(ctx));
  shape_free(&s);
  return network;
}

static void test_counts(batten_context *ctx, const subject *s) {
  size_t V = batten_network_vertex_count(s->network), F = batten_network_face_count(s->network);
  for (unsigned n = 1; n <= 5; n++) {
    batten_mesh *mesh = tessellate(ctx, s->network, n, 0, 0);
    batten_mesh_measures m;
    if (!mesh || batten_mesh_measure(ctx, mesh, &m) != BATTEN_OK) return;
    size_t triangles = batten_network_patch_count(s->network) * n * n;
    bool first = memcmp(batten_mesh_vertices(mesh), batten_network_vertices(s->network), 24 * V) == 0;
    T_CHECK(m.manifold && m.oriented && !m.closed == !s->closed && m.euler == s->euler && m.triangles == triangles &&
                first && m.vertices == batten_mesh_vertex_count(mesh),
            "%s, density %u: %zu facets give %zu triangles, euler %ld, closed %d, genus %ld", s->name, n, F,
            m.triangles, m.euler, m.closed, m.genus);
    batten_mesh_free(mesh);
  }
}

/* Area and volume go to those by quadrature with the square of the density. */
static void test_convergence(batten_context *ctx, const subject *s) {
  batten_network_measures exact;
  double area[2], volume[2];
  T_OK(batten_network_measure(ctx, s->network, &exact), ctx);
  for (int i = 0; i < 2; i++) {
    batten_mesh *mesh = tessellate(ctx, s->network, i ? 16 : 8, 0, 0);
    batten_mesh_measures m;
    if (!mesh || batten_mesh_measure(ctx, mesh, &m) != BATTEN_OK) return;
    area[i] = fabs(m.area - exact.area) / exact.area;
    volume[i] = s->closed ? fabs(m.volume - exact.volume) / exact.volume : 0;
    batten_mesh_free(mesh);
  }
  T_CHECK(area[1] < 1e-2 && area[0] / area[1] > 3.8 && area[0] / area[1] < 4.2, "%s: area off by %.2e, then %.2e",
          s->name, area[0], area[1]);
  if (s->closed)
    T_CHECK(volume[1] < 1e-2 && volume[0] / volume[1] > 3.8 && volume[0] / volume[1] < 4.2,
            "%s: volume off by %.2e, then %.2e", s->name, volume[0], volume[1]);
}

static void test_tolerance(batten_context *ctx, const subject *s, double tolerance) {
  batten_mesh *mesh = tessellate(ctx, s->network, 512, tolerance, 0), *apart;
  batten_mesh_measures m, pieces;
  if (!mesh || batten_mesh_measure(ctx, mesh, &m) != BATTEN_OK) return;
  T_CHECK(m.manifold && m.oriented && !m.closed == !s->closed && m.euler == s->euler,
          "%s, tolerance %g: %zu triangles without cracks", s->name, tolerance, m.triangles);
  double error = chord_error(ctx, s->network, mesh);
  T_CHECK(error <= tolerance && error >= tolerance / 30, "%s, tolerance %g: %.2e from the surface", s->name,
          tolerance, error);
  apart = tessellate(ctx, s->network, 512, tolerance, 1);
  if (apart && batten_mesh_measure(ctx, apart, &pieces) == BATTEN_OK) {
    const double *patch = field(apart, "patch", 1);
    bool numbered = patch != NULL;
    for (size_t t = 0; t < batten_mesh_triangle_count(apart) && numbered; t++) {
      const uint32_t *c = batten_mesh_triangles(apart) + 3 * t;
      numbered = patch[c[0]] == patch[c[1]] && patch[c[0]] == patch[c[2]];
    }
    T_CHECK(numbered && pieces.components == batten_network_patch_count(s->network) &&
                pieces.triangles == m.triangles && fabs(pieces.area - m.area) <= 1e-12 * m.area,
            "%s: as many pieces as patches, with their numbers, of the same area", s->name);
  }
  batten_mesh_free(apart);
  batten_mesh_free(mesh);
}

/* On an exact surface of second order fields are exact too, at shared and single vertices. */
static void test_fields(batten_context *ctx) {
  batten_network *network = shape_made(ctx, shape_graph(3, 2, 4, bowl));
  for (int per_patch = 0; per_patch < 2; per_patch++) {
    batten_mesh *mesh = tessellate(ctx, network, 4, 0, per_patch);
    const double *gauss = field(mesh, "gauss", 1), *mean = field(mesh, "mean", 1), *normal = field(mesh, "normal", 3);
    double worst = 0;
    for (size_t i = 0; i < batten_mesh_vertex_count(mesh); i++) {
      const double *p = batten_mesh_vertices(mesh) + 3 * i;
      double fx = p[0] - 0.2 * p[1], fy = 0.6 * p[1] - 0.2 * p[0], s = 1 + fx * fx + fy * fy;
      double height[3];
      bowl(p, height);
      worst = fmax(worst, fabs(p[2] - height[2]));
      worst = fmax(worst, fabs(gauss[i] - (0.6 - 0.04) / (s * s)));
      double exact = -((1 + fy * fy) - 2 * fx * fy * -0.2 + (1 + fx * fx) * 0.6) / (2 * s * sqrt(s));
      worst = fmax(worst, fabs(mean[i] - exact));
      worst = fmax(worst, fabs(normal[3 * i] + fx / sqrt(s)) + fabs(normal[3 * i + 2] - 1 / sqrt(s)));
    }
    T_RATIO(worst, 1e-12, "points, curvatures and normals of a quadratic graph%s",
            per_patch ? ", patch by patch" : "");
    T_CHECK(!field(mesh, "patch", 1) == !per_patch, "the field \"patch\" is there patch by patch");
    batten_mesh_free(mesh);
  }
  batten_network_free(network);
}

/* By hand: a flat octahedron, and one triangle. */
static void test_hand(batten_context *ctx) {
  batten_network *network = shape_made(ctx, shape_octahedron());
  batten_mesh *mesh = tessellate(ctx, network, 512, 1e-9, 0);
  T_CHECK(batten_mesh_triangle_count(mesh) == 8 && batten_mesh_vertex_count(mesh) == 6,
          "flat triangles stay what they are, whatever the tolerance");
  T_CHECK(memcmp(batten_mesh_triangles(mesh), batten_network_triangles(network), 96) == 0, "with their corners");
  const double *normal = field(mesh, "normal", 3), *gauss = field(mesh, "gauss", 1);
  T_RATIO(fabs(normal[0] - 1) + fabs(normal[1]) + fabs(normal[2]) + fabs(gauss[0]), 1e-15,
          "at corners the mean of four normals");
  batten_mesh_free(mesh);
  mesh = tessellate(ctx, network, 2, 0, 0);
  T_CHECK(batten_mesh_triangle_count(mesh) == 32 && batten_mesh_vertex_count(mesh) == 18, "density 2: 18 vertices");
  double nearest = 1;
  for (size_t i = 6; i < 18; i++) {
    const double *p = batten_mesh_vertices(mesh) + 3 * i;
    nearest = fmin(nearest, fabs(p[0]) + fabs(p[1]) + fabs(p[2]));
    if (fabs(p[0] * p[1]) + fabs(p[1] * p[2]) + fabs(p[2] * p[0]) != 0.25) nearest = 0;
  }
  T_CHECK(nearest == 1, "in the middles of the edges");
  batten_mesh_free(mesh);
  batten_network_free(network);
  network = NULL;
  T_OK(batten_network_create(ctx, 0, NULL, 0, NULL, 0, NULL, 0, NULL, &network), ctx);
  mesh = tessellate(ctx, network, 8, 0, 0);
  T_CHECK(mesh && batten_mesh_vertex_count(mesh) == 0, "nothing gives nothing");
  batten_mesh_free(mesh);
  batten_network_free(network);
}

static void test_bad(batten_context *ctx) {
  batten_network *network = shape_made(ctx, shape_octahedron());
  batten_tessellate_options o = batten_tessellate_options_default();
  batten_mesh *mesh = NULL;
  T_CHECK(batten_network_tessellate(NULL, network, &o, &mesh) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_tessellate(ctx, NULL, &o, &mesh), BATTEN_E_INVALID, ctx, "network: NULL; give a network");
  T_STATUS(batten_network_tessellate(ctx, network, &o, NULL), BATTEN_E_INVALID, ctx, "out: NULL; give the address");
  o.density = 0;
  T_STATUS(batten_network_tessellate(ctx, network, &o, &mesh), BATTEN_E_INVALID, ctx,
           "opt.density: 0; give 1 to 512");
  o.density = 513;
  T_STATUS(batten_network_tessellate(ctx, network, &o, &mesh), BATTEN_E_INVALID, ctx,
           "opt.density: 513; give 1 to 512");
  o.density = 8;
  o.tolerance = -1;
  T_STATUS(batten_network_tessellate(ctx, network, &o, &mesh), BATTEN_E_INVALID, ctx, "opt.tolerance: -1; give");
  o.tolerance = NAN;
  T_STATUS(batten_network_tessellate(ctx, network, &o, &mesh), BATTEN_E_INVALID, ctx, "opt.tolerance: nan; give");
  o = (batten_tessellate_options){.density = 8};
  T_STATUS(batten_network_tessellate(ctx, network, &o, &mesh), BATTEN_E_INVALID, ctx,
           "batten_tessellate_options.struct_size");
  T_CHECK(mesh == NULL, "out is untouched");
  batten_network_free(network);
  scene_mesh ball = scene_mesh_icosphere(64); /* 81920 facets at 512^2 triangles */
  T_OK(net_surface_new(ctx, ball.vertices, ball.points, ball.triangles, ball.corners, NULL, 0, NULL, 1, 1, &network),
       ctx);
  memset(net_surface_points(network, 0), 0, ball.triangles * 72);
  o = batten_tessellate_options_default();
  o.density = 512;
  T_STATUS(batten_network_tessellate(ctx, network, &o, &mesh), BATTEN_E_TOO_LARGE, ctx,
           "opt.density: 512 on 81920 facets");
  batten_network_free(network);
  scene_mesh_free(&ball);
}

typedef struct tessellate_call {
  const shape *s;
  int per_patch;
} tessellate_call;
static batten_status call_tessellate(batten_context *ctx, void *arg) {
  const tessellate_call *c = arg;
  batten_network *network = NULL;
  batten_mesh *mesh = NULL;
  batten_tessellate_options o = batten_tessellate_options_default();
  o.per_patch = c->per_patch;
  batten_status st = shape_network(ctx, c->s, &network);
  if (st == BATTEN_OK) st = batten_network_tessellate(ctx, network, &o, &mesh);
  batten_mesh_free(mesh);
  batten_network_free(network);
  return st;
}

static bool same_mesh(const batten_mesh *a, const batten_mesh *b) {
  size_t V = batten_mesh_vertex_count(a), F = batten_mesh_triangle_count(a);
  return V == batten_mesh_vertex_count(b) && F == batten_mesh_triangle_count(b) &&
         memcmp(batten_mesh_vertices(a), batten_mesh_vertices(b), 24 * V) == 0 &&
         memcmp(batten_mesh_triangles(a), batten_mesh_triangles(b), 12 * F) == 0 &&
         memcmp(field(a, "gauss", 1), field(b, "gauss", 1), 8 * V) == 0 &&
         memcmp(field(a, "normal", 3), field(b, "normal", 3), 24 * V) == 0;
}

static void test_running(batten_context *ctx, const batten_network *network) {
  batten_context *four = t_context(NULL, NULL, 4);
  batten_mesh *a = tessellate(ctx, network, 64, 1e-3, 0), *b = tessellate(four, network, 64, 1e-3, 0);
  T_CHECK(same_mesh(a, b), "four threads give the same bits");
  batten_mesh_free(a);
  batten_mesh_free(b);
  batten_context_free(four);
  shape s = shape_graph(2, 3, 3, bowl);
  for (int per_patch = 0; per_patch < 2; per_patch++)
    t_fail_every_allocation("batten_network_tessellate", call_tessellate, &(tessellate_call){&s, per_patch});
  shape_free(&s);
  double start = batten_now();
  a = tessellate(ctx, network, 8, 0, 0);
  size_t triangles = batten_mesh_triangle_count(a);
  T_CHECK(triangles > 0, "%.2f us a triangle", (batten_now() - start) / (double)triangles * 1e6);
  batten_mesh_free(a);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  size_t before = batten_bytes_in_use(ctx);
  test_patterns(ctx);
  test_hand(ctx);
  test_fields(ctx);
  test_bad(ctx);
  subject subjects[] = {
      {"shifted octahedron, quartics", scene_network(ctx, scene_mesh_octahedron_shifted(0.5, 0.3), false), true, 2},
      {"shifted octahedron, quintics", scene_network(ctx, scene_mesh_octahedron_shifted(0.5, 0.3), true), true, 2},
      {"long ellipsoid", scene_network(ctx, scene_mesh_ellipsoid_long(), true), true, 2},
      {"torus, some facets split", shape_made(ctx, shape_torus(5)), true, 0},
      {"valve", scene_network(ctx, scene_mesh_valve(), false), false, 0},
      {"ramp, some facets split", shape_made(ctx, shape_graph(3, 4, 4, ramp)), false, 1}};
  for (size_t i = 0; i < sizeof subjects / sizeof *subjects; i++) {
    if (!subjects[i].network) continue;
    test_counts(ctx, &subjects[i]);
    test_convergence(ctx, &subjects[i]);
    test_tolerance(ctx, &subjects[i], 1e-2);
    test_tolerance(ctx, &subjects[i], 3e-3);
    if (i == 3) test_running(ctx, subjects[i].network);
    batten_network_free(subjects[i].network);
  }
  T_CHECK(batten_bytes_in_use(ctx) == before, "all is freed");
  batten_context_free(ctx);
  return t_done();
}
