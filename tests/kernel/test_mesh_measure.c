/* Measures of meshes by hand, topology of every kind of bad mesh, random soups. */
#include <batten/mesh.h>

#include "mesh_shapes.h"
#include "tap.h"

static batten_context *ctx;

static batten_mesh_measures measure(size_t v, const double *vertices, size_t f, const uint32_t *triangles) {
  batten_mesh *mesh = NULL;
  batten_mesh_measures m = {0};
  batten_status st = batten_mesh_create(ctx, v, vertices, f, triangles, &mesh);
  if (st == BATTEN_OK) st = batten_mesh_measure(ctx, mesh, &m);
  if (st != BATTEN_OK) T_CHECK(false, "measured: %s", batten_error(ctx));
  batten_mesh_free(mesh);
  return m;
}

static size_t crossings(size_t v, const double *vertices, size_t f, const uint32_t *triangles) {
  batten_mesh *mesh = NULL;
  size_t pairs = SIZE_MAX;
  batten_mesh_create(ctx, v, vertices, f, triangles, &mesh);
  batten_mesh_self_intersections(ctx, mesh, &pairs);
  batten_mesh_free(mesh);
  return pairs;
}

static void test_tetrahedron(void) {
  batten_mesh_measures m = measure(4, tetra_vertices, 4, tetra_triangles);
  T_CHECK(m.vertices == 4 && m.edges == 6 && m.triangles == 4 && m.components == 1 && m.euler == 2 && m.genus == 0,
          "tetrahedron: counts");
  T_CHECK(m.closed && m.manifold && m.oriented && !m.boundary_loops, "tetrahedron: closed oriented manifold");
  T_RATIO(fabs(m.volume - 1.0 / 6), 4 * 0x1p-53, "volume 1/6");
  T_RATIO(fabs(m.area - (1.5 + sqrt(0.75))), 8 * 0x1p-53, "area");
  for (int k = 0; k < 3; k++) T_RATIO(fabs(m.centroid[k] - 0.25), 8 * 0x1p-53, "centroid[%d] 1/4", k);
  /* About the centroid: integral of (x - 1/4)^2 = 1/60 - 1/96 = 1/160; of (x - 1/4)(y - 1/4) = 1/120 - 1/96. */
  T_RATIO(fabs(m.inertia[0][0] - 2.0 / 160), 0x1p-52, "moment of inertia 1/80");
  T_RATIO(fabs(m.inertia[0][1] - 1.0 / 480), 0x1p-52, "product of inertia 1/480");
  T_RATIO(fabs(m.angle_min_deg - 45) + fabs(m.angle_max_deg - 90), 1e-13, "angles 45 to 90");
  T_RATIO(fabs(m.edge_min - 1) + fabs(m.edge_max - sqrt(2.0)) + fabs(m.edge_mean - (1 + sqrt(2.0)) / 2), 1e-15,
          "edges");
  T_CHECK(m.angles_above_20deg == 1, "all angles above 20");
  uint32_t inward[12];
  for (int i = 0; i < 12; i++) inward[i] = tetra_triangles[i / 3 * 3 + 2 - i % 3];
  m = measure(4, tetra_vertices, 4, inward);
  T_RATIO(fabs(m.volume + 1.0 / 6), 4 * 0x1p-53, "turned inside out: volume -1/6");
  T_RATIO(fabs(m.inertia[1][1] - 2.0 / 160), 0x1p-52, "turned inside out: inertia as before");
}

static void test_cube(void) {
  /* Far away, and tiny or huge: the figures keep their digits. */
  for (int exponent = -150; exponent <= 150; exponent += 75) {
    double vertices[24], place[3] = {7e6, -3, 1e6 / 3};
    for (int i = 0; i < 24; i++)
      vertices[i] = ldexp(cube_vertices[i] + (exponent ? 0 : round(place[i % 3])), exponent);
    batten_mesh_measures m = measure(8, vertices, 12, cube_triangles);
    T_RATIO(fabs(ldexp(m.volume, -3 * exponent) - 1), 8 * 0x1p-53, "volume of a cube of side 2^%d", exponent);
    T_RATIO(fabs(ldexp(m.area, -2 * exponent) - 6), 1e-15, "area");
    T_RATIO(fabs(ldexp(m.inertia[2][2], -5 * exponent) - 1.0 / 6) + fabs(ldexp(m.inertia[1][2], -5 * exponent)),
            1e-15, "inertia");
    T_CHECK(m.genus == 0 && m.edges == 18 && m.angle_max_deg == 90, "counts");
    T_CHECK(m.upper[0] - m.lower[0] == ldexp(1, exponent), "box");
  }
  T_CHECK(crossings(8, cube_vertices, 12, cube_triangles) == 0, "a cube does not cross itself");
  uint32_t turned[36];
  memcpy(turned, cube_triangles, sizeof turned);
  turned[3] = cube_triangles[4];
  turned[4] = cube_triangles[3];
  batten_mesh_measures m = measure(8, cube_vertices, 12, turned);
  T_CHECK(m.closed && m.manifold && !m.oriented && m.genus == -1 && isnan(m.volume) && isnan(m.inertia[0][0]),
          "one triangle turned: closed, not oriented, no volume");
  m = measure(8, cube_vertices, 10, cube_triangles);
  T_CHECK(!m.closed && m.manifold && m.oriented && m.boundary_edges == 4 && m.boundary_loops == 1 && m.genus == -1 &&
              isnan(m.volume),
          "lid off: one boundary loop of 4 edges");
  m = measure(8, cube_vertices, 8, cube_triangles);
  T_CHECK(m.boundary_edges == 8 && m.boundary_loops == 2 && m.euler == 0, "tube: two boundary loops");
}

static void test_bad_meshes(void) {
  batten_mesh_measures m = measure(0, NULL, 0, NULL);
  T_CHECK(!m.closed && m.manifold && m.oriented && m.components == 0 && m.area == 0 && isnan(m.volume) &&
              m.edge_mean == 0 && m.lower[0] == 0,
          "empty mesh");
  double grid[27];
  for (int i = 0; i < 27; i++) grid[i] = (double)((i / 3) % 3 == i % 3) + 0.25 * (double)((i * 7) % 5);
  m = measure(9, grid, 0, NULL);
  T_CHECK(m.vertices == 0 && m.triangles == 0, "vertices that nothing uses do not count");

  uint32_t fins[] = {0, 1, 2, 1, 0, 3, 0, 1, 4};
  m = measure(5, grid, 3, fins);
  T_CHECK(!m.manifold && m.nonmanifold_edges == 1 && m.nonmanifold_vertices == 0 && !m.oriented &&
              m.components == 1 && m.boundary_edges == 6,
          "three triangles on an edge");
  uint32_t bow[] = {0, 1, 2, 0, 3, 4};
  m = measure(5, grid, 2, bow);
  T_CHECK(!m.manifold && m.nonmanifold_edges == 0 && m.nonmanifold_vertices == 1 && m.components == 2 &&
              m.boundary_loops == 2 && m.oriented,
          "bow tie: two fans at a vertex");
  uint32_t twice[] = {0, 1, 2, 0, 1, 2};
  m = measure(3, grid, 2, twice);
  T_CHECK(m.closed && !m.oriented && isnan(m.volume), "a triangle given twice");
  uint32_t both[] = {0, 1, 2, 0, 2, 1};
  m = measure(3, grid, 2, both);
  T_CHECK(m.closed && m.oriented && m.genus == 0 && m.volume == 0, "a triangle and its back: a flat sphere");
  uint32_t needle[] = {0, 0, 1};
  m = measure(3, grid, 1, needle);
  T_CHECK(!m.manifold && m.area == 0 && m.angles_above_20deg == 0, "a triangle with a corner twice");
  double line[9] = {0, 0, 0, 1, 1, 1, 3, 3, 3};
  uint32_t one[] = {0, 1, 2};
  m = measure(3, line, 1, one);
  T_CHECK(m.area == 0 && m.angle_min_deg == 0 && m.angle_max_deg == 180 && m.manifold, "a triangle without area");

  enum { N = 12 };
  double band[6 * N];
  uint32_t strip[6 * N];
  for (uint32_t i = 0; i < N; i++) {
    double t = 2 * acos(-1) * i / N;
    for (int side = 0; side < 2; side++) {
      double r = 2 + (side ? 0.3 : -0.3) * cos(t / 2), *p = band + 6 * i + 3 * side;
      p[0] = r * cos(t);
      p[1] = r * sin(t);
      p[2] = (side ? 0.3 : -0.3) * sin(t / 2);
    }
    uint32_t a = 2 * i, b = a + 1, c = i + 1 < N ? a + 2 : 1, d = i + 1 < N ? a + 3 : 0;
    uint32_t two[6] = {a, c, b, b, c, d};
    memcpy(strip + 6 * i, two, sizeof two);
  }
  m = measure(2 * N, band, 2 * N, strip);
  T_CHECK(m.manifold && !m.oriented && !m.closed && m.boundary_loops == 1 && m.euler == 0 && m.components == 1,
          "Moebius strip: one boundary loop, not orientable");
  T_CHECK(crossings(2 * N, band, 2 * N, strip) == 0, "Moebius strip does not cross itself");
}

static void test_crossings(void) {
  uint32_t two[] = {0, 1, 2, 3, 4, 5}, fold[] = {0, 1, 2, 1, 0, 3}, fan[] = {0, 1, 2, 0, 3, 4};
  double crossing[18] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, -1, 1, 1, 1, 5, 5, 1};
  T_CHECK(crossings(6, crossing, 2, two) == 1, "two triangles that cross");
  double touching[18] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 0, 1, 1, 1, 5, 5, 1};
  T_CHECK(crossings(6, touching, 2, two) == 1, "a corner on a face touches");
  touching[11] = 0x1p-60;
  T_CHECK(crossings(6, touching, 2, two) == 0, "2^-60 above the face does not");
  for (int e = -900; e <= 900; e += 900) {
    double scaled[18];
    for (int i = 0; i < 18; i++) scaled[i] = ldexp(touching[i], e);
    T_CHECK(crossings(6, scaled, 2, two) == 0, "nor in units of 2^%d", e);
    scaled[11] = 0;
    T_CHECK(crossings(6, scaled, 2, two) == 1, "and touching still does");
  }
  double coplanar[18] = {0, 0, 0, 9, 0, 0, 0, 9, 0, 1, 1, 0, 2, 1, 0, 1, 2, 0};
  T_CHECK(crossings(6, coplanar, 2, two) == 1, "one in the plane and inside of the other");
  for (int i = 9; i < 18; i += 3) coplanar[i] += 10;
  T_CHECK(crossings(6, coplanar, 2, two) == 0, "one in the plane and outside of the other");
  double folded[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  T_CHECK(crossings(4, folded, 2, fold) == 1, "neighbours folded flat onto each other");
  folded[11] = 0x1p-60;
  T_CHECK(crossings(4, folded, 2, fold) == 0, "nearly folded");
  folded[10] = -1;
  folded[11] = 0;
  T_CHECK(crossings(4, folded, 2, fold) == 0, "neighbours side by side in a plane");
  double corner[15] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, -1, 1, 1, 1};
  T_CHECK(crossings(5, corner, 2, fan) == 1, "triangles that share a corner and cross");
  corner[11] = 0.5;
  T_CHECK(crossings(5, corner, 2, fan) == 0, "that share a corner only");
  double same[18] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 0, 0, 4, 0, 4, 0, 0};
  T_CHECK(crossings(6, same, 2, two) == 1, "a triangle and its back");
  double soup[18] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 4, 0, 4, 0, 0, 4, 4, 1};
  T_CHECK(crossings(6, soup, 2, two) == 0, "neighbours without common indices share places");
  double flat[18] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 1, 1, 1, -1, 1, 1, -3};
  T_CHECK(crossings(6, flat, 2, two) == 0, "a triangle without area takes no part");
  T_CHECK(crossings(0, NULL, 0, NULL) == 0, "empty mesh");
}

/* Two routes to the same count: the tree, and every pair of a small soup as a mesh of its own. */
static void test_crossings_against_pairs(void) {
  uint64_t seed = 20;
  enum { F = 60 };
  size_t total = 0;
  for (int round = 0; round < 6; round++) {
    double p[9 * F];
    uint32_t t[3 * F], pair[6] = {0, 1, 2, 3, 4, 5};
    for (int i = 0; i < 9 * F; i++) {
      if (i % 9 < 3)
        p[i] = (double)(t_random(&seed) % 10); /* integers: plenty of touching, coplanar, shared */
      else
        p[i] = p[i - i % 9 + i % 3] + (double)(t_random(&seed) % 5) - 2;
    }
    for (uint32_t i = 0; i < 3 * F; i++) t[i] = i;
    size_t count = 0;
    for (size_t i = 0; i < F; i++)
      for (size_t j = 0; j < i; j++) {
        double q[18];
        memcpy(q, p + 9 * i, 9 * sizeof *q);
        memcpy(q + 9, p + 9 * j, 9 * sizeof *q);
        count += crossings(6, q, 2, pair);
      }
    size_t got = crossings(3 * F, p, F, t);
    total += got;
    if (got != count) T_CHECK(false, "round %d: %zu pairs, one by one %zu (seed 20)", round, got, count);
  }
  T_CHECK(total > 50, "%zu crossing pairs, the same one by one", total);
}

static void test_soups(void) {
  uint64_t seed = 7;
  for (int round = 0; round < 300; round++) {
    double p[300];
    uint32_t t[300];
    for (int i = 0; i < 300; i++) {
      p[i] = (double)(t_random(&seed) % 10);
      t[i] = (uint32_t)(t_random(&seed) % 100);
    }
    size_t f = t_random(&seed) % 101;
    batten_mesh_measures m = measure(100, p, f, t);
    size_t pairs = crossings(100, p, f, t);
    if (!(m.area >= 0) || m.vertices > 100 || m.triangles != f || m.components > f || pairs > f * (f + 1) / 2)
      T_CHECK(false, "soup %d makes no sense (seed 7)", round);
  }
  T_CHECK(true, "300 random soups measured");
}

static batten_status call_measure(batten_context *c, void *arg) {
  batten_mesh *mesh = NULL;
  batten_mesh_measures m;
  size_t pairs;
  (void)arg;
  batten_status st = batten_mesh_create(c, 8, cube_vertices, 12, cube_triangles, &mesh);
  if (st == BATTEN_OK) st = batten_mesh_measure(c, mesh, &m);
  if (st == BATTEN_OK) st = batten_mesh_self_intersections(c, mesh, &pairs);
  batten_mesh_free(mesh);
  return st;
}

static void test_refusals(void) {
  batten_mesh *mesh = NULL;
  batten_mesh_measures m;
  size_t pairs;
  batten_mesh_create(ctx, 4, tetra_vertices, 4, tetra_triangles, &mesh);
  T_STATUS(batten_mesh_measure(ctx, NULL, &m), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_measure(ctx, mesh, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_mesh_self_intersections(ctx, NULL, &pairs), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_self_intersections(ctx, mesh, NULL), BATTEN_E_INVALID, ctx, "pairs: NULL");
  batten_mesh_free(mesh);
}

int main(void) {
  ctx = t_context(NULL, NULL, 2);
  test_tetrahedron();
  test_cube();
  test_bad_meshes();
  test_crossings();
  test_crossings_against_pairs();
  test_soups();
  test_refusals();
  t_fail_every_allocation("measuring", call_measure, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
