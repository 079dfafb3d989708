/* Decimation: cubes and planes down to what they need, spheres and tori against their own surface, topology and
 * boundaries, what must not matter, what is refused. The result is always free of defects. */
#include "femur.h"
#include "network_scenes.h"
#include "tap.h"

#include <batten/mesh.h>

#include "mesh_shapes.h"

static batten_mesh *mesh_of(batten_context *ctx, const scene_mesh *m) {
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh), ctx);
  return mesh;
}

static bool clean(batten_context *ctx, const batten_mesh *mesh) {
  batten_mesh_defects d;
  if (batten_mesh_find_defects(ctx, mesh, &d) != BATTEN_OK) return false;
  return d.isolated_vertices + d.duplicate_vertices + d.degenerate_triangles + d.duplicate_triangles +
             d.nonmanifold_edges + d.flipped_edges + d.nonmanifold_vertices ==
         0;
}

/* Decimated, of the same topology and without defects; after may be NULL. */
static batten_mesh *decimated(batten_context *ctx, const char *what, const scene_mesh *m, size_t triangles,
                              double *distance, batten_mesh_measures *before, batten_mesh_measures *after) {
  batten_mesh *mesh = mesh_of(ctx, m), *out = NULL;
  double started = batten_now();
  batten_status st = batten_mesh_decimate(ctx, mesh, triangles, &out, distance);
  double time = batten_now() - started;
  T_CHECK(st >= 0 && out, "%s: %zu triangles to %zu, %zu wanted, in %.3f s, distance %.3g: %s", what, m->triangles,
          out ? batten_mesh_triangle_count(out) : 0, triangles, time, *distance, st ? batten_error(ctx) : "done");
  batten_mesh_measure(ctx, mesh, before);
  batten_mesh_measure(ctx, out, after);
  T_CHECK(clean(ctx, out), "%s: no defects", what);
  T_CHECK(before->euler == after->euler && before->genus == after->genus && before->components == after->components &&
              before->boundary_loops == after->boundary_loops && after->manifold && after->oriented,
          "%s: topology kept, Euler number %ld, %zu boundary loops", what, after->euler, after->boundary_loops);
  batten_mesh_free(mesh);
  return out;
}

/* The cube of side n, with sides of n x n squares. */
static scene_mesh cube_of(size_t n) {
  unsigned char *cells = malloc(n * n * n);
  memset(cells, 1, n * n * n);
  scene_mesh m = scene_mesh_cells(n, n, n, cells, 0);
  free(cells);
  return m;
}

static void test_flat(batten_context *ctx) {
  batten_mesh_measures before, after;
  double distance = -1;
  scene_mesh m = scene_mesh_plane(12);
  batten_mesh *out = decimated(ctx, "plane", &m, 2, &distance, &before, &after);
  T_CHECK(batten_mesh_triangle_count(out) == 2, "a square needs two triangles");
  T_RATIO(fabs(after.area / before.area - 1), 1e-7, "plane: area");
  T_RATIO(distance, 1e-7, "plane: distance");
  batten_mesh_free(out);
  scene_mesh_free(&m);
  m = cube_of(6);
  out = decimated(ctx, "cube", &m, 12, &distance, &before, &after);
  T_CHECK(batten_mesh_triangle_count(out) == 12, "a cube needs twelve triangles");
  T_RATIO(fabs(after.volume / before.volume - 1), 1e-6, "cube: volume");
  batten_mesh_free(out);
  scene_mesh_free(&m);
}

static double length(const double *p) { return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

static void test_curved(batten_context *ctx) {
  batten_mesh_measures before, after;
  double distance = 0;
  scene_mesh m = scene_mesh_icosphere(24);
  batten_mesh *out = decimated(ctx, "sphere", &m, 600, &distance, &before, &after);
  const double *x = batten_mesh_vertices(out);
  const uint32_t *t = batten_mesh_triangles(out);
  double least = INFINITY, most = 0, inward = INFINITY;
  for (size_t i = 0; i < batten_mesh_vertex_count(out); i++) {
    least = fmin(least, length(x + 3 * i));
    most = fmax(most, length(x + 3 * i));
  }
  for (size_t i = 0; i < batten_mesh_triangle_count(out); i++) {
    const double *a = x + 3 * (size_t)t[3 * i], *b = x + 3 * (size_t)t[3 * i + 1], *c = x + 3 * (size_t)t[3 * i + 2];
    double u[3], v[3], w[3];
    for (int k = 0; k < 3; k++) u[k] = b[k] - a[k], v[k] = c[k] - a[k];
    w[0] = u[1] * v[2] - u[2] * v[1], w[1] = u[2] * v[0] - u[0] * v[2], w[2] = u[0] * v[1] - u[1] * v[0];
    inward = fmin(inward, (w[0] * a[0] + w[1] * a[1] + w[2] * a[2]) / length(w));
  }
  T_RATIO(fmax(1 - least, most - 1), 0.01, "sphere: vertices off the sphere, of radii %.4f to %.4f", least, most);
  T_RATIO(1 - inward, 0.05, "sphere: faces within the sphere");
  T_RATIO(fabs(after.volume / before.volume - 1), 0.01, "sphere: volume");
  T_CHECK(after.angles_above_20deg > 0.95, "sphere: %.1f %% of the triangles without an angle below 20 degrees",
          100 * after.angles_above_20deg);
  batten_mesh_free(out);
  scene_mesh_free(&m);
  m = scene_mesh_torus(48, 32);
  out = decimated(ctx, "torus", &m, 400, &distance, &before, &after);
  T_RATIO(fabs(after.volume / before.volume - 1), 0.03, "torus: volume");
  batten_mesh_free(out);
  scene_mesh_free(&m);
  m = scene_mesh_graph(31);
  out = decimated(ctx, "graph with a border", &m, 200, &distance, &before, &after);
  T_RATIO(fabs(after.area / before.area - 1), 0.01, "graph: area");
  double low = 0;
  for (int k = 0; k < 2; k++)
    low = fmax(low, fmax(fabs(after.lower[k] - before.lower[k]), fabs(after.upper[k] - before.upper[k])));
  T_RATIO(low, distance, "graph: the border stays");
  batten_mesh_free(out);
  scene_mesh_free(&m);
}

/* Down to where nothing may go: topology is what stays. */
static void test_least(batten_context *ctx) {
  batten_mesh_measures before, after;
  double distance = 0;
  scene_mesh meshes[] = {scene_mesh_icosphere(6), scene_mesh_torus(12, 8),  scene_mesh_genus3(),  scene_mesh_ears(5),
                         scene_mesh_cube_26(),    scene_mesh_tetrahedron(), scene_mesh_triangle()};
  const char *names[] = {"sphere", "torus", "genus 3", "ears", "cube", "tetrahedron", "triangle"};
  for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
    batten_mesh *out = decimated(ctx, names[i], &meshes[i], 1, &distance, &before, &after);
    if (strcmp(names[i], "tetrahedron") == 0)
      T_CHECK(batten_mesh_triangle_count(out) == 4 && distance == 0, "a tetrahedron stays");
    batten_mesh_free(out);
    scene_mesh_free(&meshes[i]);
  }
  for (uint64_t seed = 1; seed <= 12; seed++) {
    scene_mesh m = scene_mesh_random(seed);
    char name[40];
    snprintf(name, sizeof name, "random mesh %" PRIu64, seed);
    batten_mesh_free(decimated(ctx, name, &m, m.triangles / 3, &distance, &before, &after));
    scene_mesh_free(&m);
  }
}

static void test_same(batten_context *ctx) {
  scene_mesh m = scene_mesh_blob_642();
  batten_mesh *mesh = mesh_of(ctx, &m), *one = NULL, *two = NULL;
  double d_one = 0, d_two = 0;
  T_OK(batten_mesh_decimate(ctx, mesh, 300, &one, &d_one), ctx);
  batten_mesh_free(mesh);
  scene_mesh_scale(&m, 0x1p-200, 0x1p-200, 0x1p-200);
  mesh = mesh_of(ctx, &m);
  T_OK(batten_mesh_decimate(ctx, mesh, 300, &two, &d_two), ctx);
  size_t n = batten_mesh_vertex_count(one), f = batten_mesh_triangle_count(one);
  bool same = f == 300 && batten_mesh_vertex_count(two) == n && d_two == d_one * 0x1p-200 &&
              memcmp(batten_mesh_triangles(one), batten_mesh_triangles(two), f * 3 * sizeof(uint32_t)) == 0;
  for (size_t k = 0; same && k < 3 * n; k++)
    same = batten_mesh_vertices(two)[k] == batten_mesh_vertices(one)[k] * 0x1p-200;
  T_CHECK(same, "times 2^-200: the same bits");
  batten_mesh_free(one);
  batten_mesh_free(two);
  /* nothing to do: the same mesh, without its fields and unused vertices */
  double *points = malloc((m.vertices + 1) * 3 * sizeof *points);
  memcpy(points, m.points, m.vertices * 3 * sizeof *points);
  memset(points + 3 * m.vertices, 0, 3 * sizeof *points);
  batten_mesh_free(mesh);
  T_OK(batten_mesh_create(ctx, m.vertices + 1, points, m.triangles, m.corners, &mesh), ctx);
  T_OK(batten_mesh_set_field(ctx, mesh, "x", 1, points), ctx);
  T_OK(batten_mesh_decimate(ctx, mesh, m.triangles, &one, NULL), ctx);
  T_CHECK(batten_mesh_vertex_count(one) == m.vertices && batten_mesh_field_count(one) == 0 &&
              memcmp(batten_mesh_vertices(one), m.points, m.vertices * 3 * sizeof *points) == 0 &&
              memcmp(batten_mesh_triangles(one), m.corners, m.triangles * 3 * sizeof(uint32_t)) == 0,
          "few enough: as it was");
  batten_mesh_free(one);
  batten_mesh_free(mesh);
  free(points);
  scene_mesh_free(&m);
}

static void test_refused(batten_context *ctx) {
  static const uint32_t three[9] = {0, 1, 2, 1, 0, 3, 0, 1, 4}, flipped[6] = {0, 1, 2, 0, 1, 3};
  static const double places[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1};
  batten_mesh *mesh, *out = NULL;
  double distance = -1;
  T_OK(batten_mesh_create(ctx, 5, places, 3, three, &mesh), ctx);
  T_STATUS(batten_mesh_decimate(ctx, mesh, 1, &out, &distance), BATTEN_E_INVALID, ctx, "triangles");
  batten_mesh_free(mesh);
  T_OK(batten_mesh_create(ctx, 4, places, 2, flipped, &mesh), ctx);
  T_STATUS(batten_mesh_decimate(ctx, mesh, 1, &out, &distance), BATTEN_E_INVALID, ctx, "edge");
  batten_mesh_free(mesh);
  T_OK(batten_mesh_create(ctx, 8, cube_vertices, 12, cube_triangles, &mesh), ctx);
  T_STATUS(batten_mesh_decimate(ctx, mesh, 0, &out, &distance), BATTEN_E_INVALID, ctx, "triangles: 0");
  T_STATUS(batten_mesh_decimate(ctx, NULL, 1, &out, &distance), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_decimate(ctx, mesh, 1, NULL, &distance), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_mesh_decimate(NULL, mesh, 1, &out, NULL) == BATTEN_E_INVALID && !out && distance == -1,
          "outputs are untouched");
  batten_mesh_free(mesh);
  T_OK(batten_mesh_create(ctx, 0, NULL, 0, NULL, &mesh), ctx);
  T_OK(batten_mesh_decimate(ctx, mesh, 1, &out, &distance), ctx);
  T_CHECK(batten_mesh_triangle_count(out) == 0 && distance == 0, "nothing to do");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
}

static void test_femur(batten_context *ctx) {
  scene_mesh m;
  if (!femur_read(&m)) {
    t_skip("femur", "no data");
    return;
  }
  batten_mesh_measures before, after;
  double distance = 0;
  batten_mesh *out = decimated(ctx, "femur", &m, 1000, &distance, &before, &after);
  T_RATIO(fabs(after.volume / before.volume - 1), 0.01, "femur: volume");
  batten_mesh_free(out);
  scene_mesh_free(&m);
}

static batten_status whole(batten_context *ctx, void *arg) {
  const scene_mesh *m = arg;
  batten_mesh *mesh, *out;
  batten_status st = batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh);
  if (st < 0) return st;
  st = batten_mesh_decimate(ctx, mesh, 40, &out, NULL);
  if (st >= 0) batten_mesh_free(out);
  batten_mesh_free(mesh);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_flat(ctx);
  test_curved(ctx);
  test_least(ctx);
  test_same(ctx);
  test_refused(ctx);
  test_femur(ctx);
  scene_mesh m = scene_mesh_icosphere(3);
  t_fail_every_allocation("batten_mesh_decimate", whole, &m);
  scene_mesh_free(&m);
  m = scene_mesh_icosphere(16);
  t_cancel_every_progress("batten_mesh_decimate", whole, &m);
  scene_mesh_free(&m);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
