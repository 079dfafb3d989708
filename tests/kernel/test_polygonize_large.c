/* A surface of more than 100,000 triangles, where loops are cut into tasks and short edges are collapsed in parts of
 * the mesh side by side: topology, figures of the torus in closed form, the same bits on any number of threads, the
 * memory and the evaluations that the header tells, cancelling amid the collapses. */
#include "tap.h"

#include <batten/mesh.h>

enum { SEEDS = 20000 };
static const double RING = 1, TUBE = 0.4, CELL = 0.0165;

static batten_status torus(const void *user, batten_context *ctx, size_t count, const double *points, double *values,
                           double *gradients, double *hessians) {
  (void)user, (void)ctx, (void)hessians;
  for (size_t i = 0; i < count; i++) {
    const double *x = points + 3 * i;
    double ring = sqrt(x[0] * x[0] + x[1] * x[1]), u = ring - RING, d = sqrt(u * u + x[2] * x[2]);
    values[i] = TUBE - d;
    if (!gradients) continue;
    gradients[3 * i] = -u / d * x[0] / ring;
    gradients[3 * i + 1] = -u / d * x[1] / ring;
    gradients[3 * i + 2] = -x[2] / d;
  }
  return BATTEN_OK;
}

static const batten_field field = {.dimension = 3, .order = 1, .evaluate = torus};
static double seeds[SEEDS][3];

static void make_seeds(void) {
  uint64_t state = 7;
  for (size_t i = 0; i < SEEDS; i++) {
    double a = 8 * atan(1) * t_uniform(&state), b = 8 * atan(1) * t_uniform(&state), ring = RING + TUBE * cos(b);
    seeds[i][0] = ring * cos(a), seeds[i][1] = ring * sin(a), seeds[i][2] = TUBE * sin(b);
  }
}

static batten_status make(batten_context *ctx, batten_mesh **mesh, batten_polygonize_info *info) {
  batten_polygonize_options o = batten_polygonize_options_default();
  o.cell = CELL;
  o.improve = 4; /* half of the rounds: the first two do most */
  return batten_polygonize(ctx, &field, SEEDS, seeds[0], &o, mesh, info);
}

static void check_figures(batten_context *ctx, const batten_mesh *mesh, const batten_polygonize_info *info) {
  const double pi = acos(-1), area = 4 * pi * pi * RING * TUBE, volume = 2 * pi * pi * RING * TUBE * TUBE;
  batten_mesh_measures m;
  size_t pairs = 1;
  batten_status st = batten_mesh_measure(ctx, mesh, &m);
  T_CHECK(st == BATTEN_OK && m.triangles > 100000, "%zu triangles", m.triangles);
  T_CHECK(m.closed && m.manifold && m.oriented && m.components == 1 && m.genus == 1,
          "one closed oriented manifold of genus %ld", m.genus);
  st = batten_mesh_self_intersections(ctx, mesh, &pairs);
  T_CHECK(st == BATTEN_OK && pairs == 0 && info->self_intersections == 0, "%zu self-intersections", pairs);
  /* Chords of a surface that bends by 1 / TUBE lie inside by less than (edge / 2)^2 / TUBE. */
  T_RATIO(fabs(m.volume - volume), CELL * CELL / TUBE * area, "volume");
  T_RATIO(fabs(m.area - area), CELL * CELL / TUBE / TUBE * area, "area");
  T_CHECK(m.angles_above_20deg >= 0.9999, "angles from %.1f to %.1f degrees", m.angle_min_deg, m.angle_max_deg);
  T_RATIO(fabs(m.edge_mean / CELL - 1), 0.1, "mean edge over the cell");
  T_RATIO((double)info->evaluations / (double)m.vertices, 7, "evaluations a vertex");
}

/* Progress in the steps of large surfaces: call number 1 + calls / 4 is among the collapses. */
static void check_cancel(size_t calls) {
  t_memory memory = {0};
  t_progress progress = {.cancel_at = 1 + calls / 4};
  batten_context *ctx = t_context(&memory, &progress, 2);
  batten_mesh *mesh = NULL;
  batten_status st = make(ctx, &mesh, NULL);
  T_CHECK(st == BATTEN_E_CANCELLED && !mesh && batten_bytes_in_use(ctx) == 0 && memory.live == 1,
          "cancelled at call %zu of %zu", progress.cancel_at, calls);
  batten_context_free(ctx);
}

int main(void) {
  batten_mesh *meshes[2] = {NULL, NULL};
  batten_context *contexts[2];
  batten_polygonize_info info[2];
  t_progress progress = {0};
  make_seeds();
  for (int i = 0; i < 2; i++) {
    contexts[i] = t_context(NULL, &progress, i == 0 ? 1 : 3);
    progress.calls = 0;
    batten_status st = make(contexts[i], &meshes[i], &info[i]);
    T_CHECK(st == BATTEN_OK, "the surface on %d threads, %zu calls of progress", i == 0 ? 1 : 3, progress.calls);
    if (st < 0) return t_done();
  }
  const size_t calls = progress.calls, vertices = batten_mesh_vertex_count(meshes[0]);
  const size_t triangles = batten_mesh_triangle_count(meshes[0]);
  T_RATIO((double)batten_bytes_peak(contexts[0]) / (double)vertices, 1024, "bytes a vertex");
  T_CHECK(
      vertices == batten_mesh_vertex_count(meshes[1]) && triangles == batten_mesh_triangle_count(meshes[1]) &&
          !memcmp(batten_mesh_vertices(meshes[0]), batten_mesh_vertices(meshes[1]), vertices * 3 * sizeof(double)) &&
          !memcmp(batten_mesh_triangles(meshes[0]), batten_mesh_triangles(meshes[1]),
                  triangles * 3 * sizeof(uint32_t)),
      "the same bits on 1 and 3 threads");
  check_figures(contexts[1], meshes[1], &info[1]);
  check_cancel(calls);
  for (int i = 0; i < 2; i++) {
    batten_mesh_free(meshes[i]);
    batten_context_free(contexts[i]);
  }
  return t_done();
}
