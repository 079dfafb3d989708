/* Split, collapse and flip keep an oriented manifold, closed or with a boundary, whatever their order. */
#include "mesh/surface.h"

#include "mesh_shapes.h"
#include "tap.h"

static batten_context *ctx;

/* Every rule that surface.h states. */
static bool holds_together(const mesh_surface *s) {
  for (uint32_t h = 0; h < 3 * s->triangle_count; h++) {
    if (s->origin[h] == MESH_NONE) continue;
    uint32_t g = s->twin[h], a = s->origin[h], b = s->origin[mesh_next(h)];
    if (a == b || s->out[a] == MESH_NONE) return false;
    if (g != MESH_NONE && (s->twin[g] != h || s->origin[g] != b || s->origin[mesh_next(g)] != a)) return false;
  }
  for (uint32_t v = 0; v < s->vertex_count; v++) {
    uint32_t h = s->out[v];
    if (h == MESH_NONE) continue;
    if (s->origin[h] != v) return false;
    /* From out[v] all half-edges that leave v are met. */
    uint32_t ring[SURFACE_RING_MAX];
    size_t count = mesh_surface_ring(s, v, ring), leaving = 0;
    for (uint32_t g = 0; g < 3 * s->triangle_count; g++) leaving += s->origin[g] == v;
    if (count && count != leaving) return false;
  }
  return true;
}

static batten_mesh_measures measure(mesh_surface *s) {
  batten_mesh *mesh = NULL;
  batten_mesh_measures m = {0};
  mesh_surface_compact(s);
  batten_mesh_create(ctx, s->vertex_count, s->points, s->triangle_count, s->origin, &mesh);
  batten_mesh_measure(ctx, mesh, &m);
  batten_mesh_free(mesh);
  return m;
}

/* The cube, or without its first `missing` triangles; then all vertices count as lying on a box. */
static batten_status build(size_t missing, mesh_surface *s) {
  batten_rough_surface rough = {.vertex_count = 8, .triangle_count = 12 - missing};
  rough.vertices = batten_alloc(ctx, sizeof cube_vertices);
  rough.faces = batten_alloc(ctx, 8);
  rough.triangles = batten_alloc(ctx, sizeof cube_triangles);
  memcpy(rough.vertices, cube_vertices, sizeof cube_vertices);
  memset(rough.faces, missing > 0, 8);
  memcpy(rough.triangles, cube_triangles + 3 * missing, (12 - missing) * 3 * sizeof *cube_triangles);
  return mesh_surface_build(ctx, &rough, s);
}

static void test_random_changes(size_t missing, long euler, size_t loops) {
  mesh_surface s = {.ctx = ctx};
  T_OK(build(missing, &s), ctx);
  uint64_t seed = 31 + missing;
  size_t done[3] = {0, 0, 0}, broken = 0;
  for (int step = 0; step < 9000; step++) {
    uint32_t h = (uint32_t)(t_random(&seed) % (3 * s.triangle_count));
    /* Grow and shrink by turns, so that collapses reach the smallest meshes. */
    size_t what = step / 300 % 2 ? 1 + t_random(&seed) % 2 : t_random(&seed) % 4 % 3;
    if (s.origin[h] == MESH_NONE) continue;
    double x[3] = {t_uniform(&seed), t_uniform(&seed), t_uniform(&seed)};
    if (what == 0) done[0] += mesh_surface_split(&s, h, x) != MESH_NONE;
    if (what == 1 && mesh_surface_may_collapse(&s, h)) {
      mesh_surface_collapse(&s, h);
      done[1]++;
    }
    if (what == 2 && mesh_surface_may_flip(&s, h)) {
      mesh_surface_flip(&s, h);
      done[2]++;
    }
    if (step % 10 == 0) broken += !holds_together(&s);
    if (step % 500 == 499) {
      batten_mesh_measures m = measure(&s);
      if (!m.manifold || !m.oriented || m.components != 1 || m.euler != euler || m.boundary_loops != loops)
        T_CHECK(false, "step %d: Euler number %ld, %zu loops", step, m.euler, m.boundary_loops);
      broken += !holds_together(&s);
    }
  }
  T_CHECK(broken == 0 && done[0] > 100 && done[1] > 100 && done[2] > 100,
          "%zu splits, %zu collapses, %zu flips: Euler number %ld and %zu boundary loops stay", done[0], done[1],
          done[2], euler, loops);
  mesh_surface_free(&s);
}

/* A tetrahedron allows neither collapse nor flip. */
static void test_tetrahedron(void) {
  batten_rough_surface rough = {.vertex_count = 4, .triangle_count = 4};
  rough.vertices = batten_alloc(ctx, sizeof tetra_vertices);
  rough.faces = batten_alloc(ctx, 4);
  rough.triangles = batten_alloc(ctx, sizeof tetra_triangles);
  memcpy(rough.vertices, tetra_vertices, sizeof tetra_vertices);
  memset(rough.faces, 0, 4);
  memcpy(rough.triangles, tetra_triangles, sizeof tetra_triangles);
  mesh_surface s = {.ctx = ctx};
  T_OK(mesh_surface_build(ctx, &rough, &s), ctx);
  bool allowed = false;
  for (uint32_t h = 0; h < 12; h++)
    allowed = allowed || mesh_surface_may_collapse(&s, h) || mesh_surface_may_flip(&s, h);
  T_CHECK(!allowed, "a tetrahedron stays one");
  mesh_surface_free(&s);
}

static void test_open_inside(void) {
  batten_rough_surface rough = {.vertex_count = 4, .triangle_count = 3};
  rough.vertices = batten_alloc(ctx, sizeof tetra_vertices);
  rough.faces = batten_alloc(ctx, 4);
  rough.triangles = batten_alloc(ctx, sizeof tetra_triangles);
  memcpy(rough.vertices, tetra_vertices, sizeof tetra_vertices);
  memset(rough.faces, 0, 4);
  memcpy(rough.triangles, tetra_triangles, sizeof tetra_triangles);
  mesh_surface s = {.ctx = ctx};
  T_STATUS(mesh_surface_build(ctx, &rough, &s), BATTEN_E_INTERNAL, ctx, "open at the edge");
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_random_changes(0, 2, 0);
  test_random_changes(2, 1, 1);
  test_random_changes(4, 0, 2);
  test_tetrahedron();
  test_open_inside();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
  return t_done();
}
