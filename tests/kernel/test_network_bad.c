/* What batten_network_build refuses, in words that name what is wrong; and that it survives any lack of memory and
 * any wish to stop. */
#include <batten/network.h>

#include <float.h>

#include "network_scenes.h"
#include "tap.h"

static batten_context *ctx;

/* ---- meshes ---------------------------------------------------------------------------------------- */

/* Takes the scene over. */
static void refused(scene_mesh scene, const char *text) {
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  batten_network_info info = {.faces = 77};
  batten_status st = batten_mesh_create(ctx, scene.vertices, scene.points, scene.triangles, scene.corners, &mesh);
  if (st == BATTEN_OK)
    T_STATUS(batten_network_build(ctx, mesh, NULL, &network, &info), BATTEN_E_INVALID, ctx, text);
  else
    T_STATUS(st, BATTEN_E_INVALID, ctx, text);
  if (network || info.faces != 77) t_line(false, "%s: outputs are touched", text);
  batten_mesh_free(mesh);
  scene_mesh_free(&scene);
}

/* Room for more vertices and triangles. */
static scene_mesh grown(scene_mesh base, size_t vertices, size_t triangles) {
  scene_mesh m = scene_mesh_make(base.vertices + vertices, base.triangles + triangles);
  memcpy(m.points, base.points, 3 * base.vertices * sizeof *m.points);
  memcpy(m.corners, base.corners, 3 * base.triangles * sizeof *m.corners);
  scene_mesh_free(&base);
  return m;
}

static void test_meshes(void) {
  scene_mesh m = scene_mesh_make(0, 0);
  refused(m, "mesh: 0 triangles; give at least one");
  m = scene_mesh_octahedron();
  m.triangles = 0;
  refused(m, "mesh: 0 triangles; give at least one");

  refused(scene_mesh_moebius(7), "pass it the same way");

  m = scene_mesh_octahedron(); /* triangle 3 flipped */
  scene_triangle_set(m.corners + 9, 3, 4, 0);
  refused(m,
          "edge from vertex 0 to 3: triangles 3 and 7 pass it the same way, one of 3 such edges; turn one of them");

  m = grown(scene_mesh_octahedron(), 1, 1); /* a fin */
  scene_point_set(m.points + 18, 2, 2, 2);
  scene_triangle_set(m.corners + 24, 0, 2, 6);
  refused(m, "edge from vertex 0 to 2: in triangles 0, 4, 8, one of 1 such edges; leave two of its triangles");

  m = grown(scene_mesh_octahedron(), 1, 0);
  scene_point_set(m.points + 18, 0.1, 0.2, 0.3);
  refused(m, "vertices[6]: in no triangle, one of 1; see batten_mesh_repair");

  m = grown(scene_mesh_octahedron(), 1,
            0); /* cut open at the top: triangles 2 and 3 get their own copy of vertex 4 */
  scene_point_set(m.points + 18, 0, 0, 1);
  m.corners[8] = m.corners[11] = 6;
  refused(m, "vertices[6]: at the place of vertices[4], one of 1; see batten_mesh_repair");

  m = scene_mesh_octahedron(); /* the corners of triangle 0 on a line */
  scene_point_set(m.points + 12, 0.5, 0.5, 0);
  refused(m, "triangles[0]: without area, one of 1; see batten_mesh_repair");

  m = scene_mesh_octahedron();
  m.corners[2] = 2; /* one corner twice */
  refused(m, "triangles[0]: without area, one of 1");

  m = grown(scene_mesh_octahedron(), 0, 1);
  memcpy(m.corners + 24, m.corners + 3, 12);
  refused(m, "triangles[8]: has the corners of triangles[1], one of 1; see batten_mesh_repair");

  m = grown(scene_mesh_triangle(), 2, 1); /* two triangles that touch in a vertex */
  scene_point_set(m.points + 9, -1, 0, 0);
  scene_point_set(m.points + 12, -0.3, -0.9, 0);
  scene_triangle_set(m.corners + 3, 0, 3, 4);
  refused(m, "vertices[0]: its triangles fall apart into more than one fan, one of 1; see batten_mesh_repair");

  m = scene_mesh_octahedron();
  m.points[13] = NAN;
  refused(m, "vertices[4][1]: nan; remove the vertex or give finite coordinates");

  m = scene_mesh_octahedron(); /* differences overflow */
  scene_mesh_scale(&m, 0.9 * DBL_MAX, 0.9 * DBL_MAX, 0.9 * DBL_MAX);
  refused(m, "vertices: their box has the size inf; must be 1e-70 .. 1e+70: scale the mesh");

  m = scene_mesh_octahedron(); /* its curvatures to the 4th power would */
  scene_mesh_scale(&m, 1e-100, 1e-100, 1e-100);
  refused(m, "vertices: their box has the size 2e-100; must be 1e-70 .. 1e+70: scale the mesh");

  m = scene_mesh_octahedron();
  scene_mesh_scale(&m, 0, 0, 0);
  refused(m, "vertices: their box has the size 0; must be 1e-70 .. 1e+70: scale the mesh");
}

/* ---- options --------------------------------------------------------------------------------------- */

static void wrong(const batten_mesh *mesh, const batten_network_options *o, const char *text) {
  batten_network *network = NULL;
  batten_network_info info = {.faces = 77};
  T_STATUS(batten_network_build(ctx, mesh, o, &network, &info), BATTEN_E_INVALID, ctx, text);
  if (network || info.faces != 77) t_line(false, "%s: outputs are touched", text);
}

static void test_options(void) {
  scene_mesh scene = scene_mesh_octahedron();
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  T_OK(batten_mesh_create(ctx, scene.vertices, scene.points, scene.triangles, scene.corners, &mesh), ctx);
  T_CHECK(batten_network_build(NULL, mesh, NULL, &network, NULL) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_build(ctx, NULL, NULL, &network, NULL), BATTEN_E_INVALID, ctx, "mesh: NULL; give a mesh");
  T_STATUS(batten_network_build(ctx, mesh, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL; give the address");

  batten_network_options o = batten_network_options_default();
#define WRONG(field, value, text)         \
  do {                                    \
    o = batten_network_options_default(); \
    o.field = value;                      \
    wrong(mesh, &o, text);                \
  } while (0)
  WRONG(struct_size, 8, "batten_network_options.struct_size");
  WRONG(fill, (batten_network_fill)9, "opt.fill: 9; must be 0 .. 8");
  WRONG(normals, (batten_normal_weights)4, "opt.normals: 4; must be 0 .. 3");
  WRONG(direction, (batten_network_direction)2, "opt.direction: 2; must be 0 .. 1");
  WRONG(length, (batten_network_length)4, "opt.length: 4; must be 0 .. 3");
  WRONG(functional, (batten_network_functional)2, "opt.functional: 2; must be 0 .. 1");
  WRONG(solver, (batten_network_solver)3, "opt.solver: 3; must be 0 .. 2");
  WRONG(continuity, 3, "opt.continuity: 3; must be 1 (G1), 2 (G2) or 0 (as the fill wants)");
  o.fill = BATTEN_FILL_SS;
  o.continuity = 2;
  wrong(mesh, &o, "opt.continuity: 2, but this fill is made for a G1 network; leave it 0 or take another fill");
  o.fill = BATTEN_FILL_FAIR;
  o.continuity = 1;
  wrong(mesh, &o, "opt.continuity: 1, but this fill is made for a G2 network");
  WRONG(normal_tol_rad, -1e-9, "opt.normal_tol_rad: -1e-09; must be 0 .. 1");
  WRONG(normal_tol_rad, NAN, "opt.normal_tol_rad: nan; must be 0 .. 1");
  WRONG(weight_power, 6.5, "opt.weight_power: 6.5; must be 0 .. 6");
  WRONG(weight_power, NAN, "opt.weight_power: nan; must be 0 .. 6");
  WRONG(field_weight, -1, "opt.field_weight: -1; must be 0 .. 1e+06");
  WRONG(crease_angle_deg, 181, "opt.crease_angle_deg: 181; must be 0 .. 180");
  WRONG(corner_angle_deg, -1, "opt.corner_angle_deg: -1; must be 0 .. 180");
  WRONG(fair_tol, INFINITY, "opt.fair_tol: inf; must be 0 .. 1");
  WRONG(check_samples, 1, "opt.check_samples: 1; must be 2 .. 1000, or 0 for no check");
  WRONG(check_samples, 1001, "opt.check_samples: 1001; must be 2 .. 1000");
  WRONG(crease_count, 1, "opt.creases: NULL; give 1 pairs of vertices");
  WRONG(line_count, 1, "opt.line_starts: NULL; give 1 lines");

  static const uint32_t no_edge[4] = {0, 2, 4, 5}, beyond[2] = {0, 6};
  o = batten_network_options_default();
  o.creases = no_edge;
  o.crease_count = 2;
  wrong(mesh, &o, "opt.creases[1]: vertices 4 and 5; give the ends of an edge of the mesh");
  o.crease_count = 1;
  o.creases = beyond;
  wrong(mesh, &o, "opt.creases[0]: vertices 0 and 6; give the ends of an edge of the mesh");

  static const uint32_t line[5] = {0, 2, 1, 0, 2}, twice[3] = {0, 2, 0};
  size_t starts[3] = {0, 5, 6};
  o = batten_network_options_default();
  o.line_count = 1;
  o.line_starts = starts;
  wrong(mesh, &o, "opt.line_vertices: NULL; give 1 lines");
  o.line_vertices = line;
  wrong(mesh, &o, "opt.line_vertices[3]: no edge from vertex 1 to vertex 0; lines run along edges of the mesh");
  starts[1] = 1;
  wrong(mesh, &o, "opt.line_starts[1]: 1 after 0; a line has two vertices or more");
  starts[0] = 1;
  wrong(mesh, &o, "opt.line_starts[0]: 1; it must be 0");
  starts[0] = 0;
  starts[1] = 3;
  o.line_vertices = twice;
  wrong(mesh, &o, "opt.line_vertices[2]: the edge from vertex 2 to vertex 0 is in a line already");

  double normals[18] = {0};
  normals[7] = INFINITY;
  WRONG(normals_given, normals, "opt.normals_given[2][1]: not finite; give 0 0 0 for a normal to estimate");
#undef WRONG
  batten_mesh_free(mesh);
  scene_mesh_free(&scene);
}

/* ---- lack of memory, wish to stop --------------------------------------------------------------------- */

typedef struct build_call {
  const scene_mesh *scene;
  batten_network_options options;
} build_call;

static batten_status call_build(batten_context *c, void *arg) {
  const build_call *call = arg;
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  batten_status st = batten_mesh_create(c, call->scene->vertices, call->scene->points, call->scene->triangles,
                                        call->scene->corners, &mesh);
  if (st == BATTEN_OK) st = batten_network_build(c, mesh, &call->options, &network, NULL);
  batten_network_free(network);
  batten_mesh_free(mesh);
  return st;
}

static void test_stops(void) {
  static const batten_network_fill fills[] = {BATTEN_FILL_SS,   BATTEN_FILL_SS_CLASSIC, BATTEN_FILL_PETERS,
                                              BATTEN_FILL_PN,   BATTEN_FILL_DEGREE7,    BATTEN_FILL_DEGREE6,
                                              BATTEN_FILL_FAIR, BATTEN_FILL_FAIR_LINEAR};
  static const char *const names[] = {"ss",      "ss-classic", "peters", "PN",
                                      "degree7", "degree6",    "fair",   "fair-linear"};
  scene_mesh octahedron = scene_mesh_octahedron_shifted(.5, .3), ears = scene_mesh_ears(4);
  for (int i = 0; i < 8; i++)
    for (int featured = 0; featured < 2; featured++) {
      static const uint32_t crease[2] = {0, 1}, line[3] = {1, 2, 3};
      static const size_t starts[2] = {0, 3};
      build_call call = {featured ? &ears : &octahedron, batten_network_options_default()};
      char what[64];
      call.options.fill = fills[i];
      call.options.fair_passes = 2;
      call.options.check_samples = 2;
      if (featured) {
        call.options.crease_count = 1;
        call.options.creases = crease;
        call.options.line_count = 1;
        call.options.line_starts = starts;
        call.options.line_vertices = line;
        call.options.boundary_curves = 1;
        call.options.solver = BATTEN_NETWORK_DIRECT;
      }
      snprintf(what, sizeof what, "%s%s", names[i], featured ? ", crease, line, direct" : "");
      t_fail_every_allocation(what, call_build, &call);
      t_cancel_every_progress(what, call_build, &call);
    }
  scene_mesh_free(&octahedron);
  scene_mesh_free(&ears);
}

/* The fall-back to three patches takes memory of its own: an octahedron shaken until one patch is too few. */
static void test_split_stops(void) {
  scene_mesh m = scene_mesh_octahedron();
  uint64_t seed = 1;
  for (size_t i = 0; i < 3 * m.vertices; i++) m.points[i] += 2 * t_uniform(&seed) - 1;
  build_call call = {&m, batten_network_options_default()};
  call.options.fill = BATTEN_FILL_DEGREE7;
  call.options.normal_passes = 0;
  call.options.check_samples = 9;
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  batten_network_info info = {.faces = 0};
  T_OK(batten_mesh_create(ctx, m.vertices, m.points, m.triangles, m.corners, &mesh), ctx);
  batten_status st = batten_network_build(ctx, mesh, &call.options, &network, &info);
  T_CHECK(st >= 0 && info.fallback_faces > 0 && info.patches == info.faces + 2 * info.fallback_faces,
          "%zu of %zu facets in three, %.1e degrees: %s", info.fallback_faces, info.faces, info.normal_jump_max_deg,
          st ? batten_error(ctx) : "exact");
  batten_network_free(network);
  batten_mesh_free(mesh);
  t_fail_every_allocation("degree7 with facets in three", call_build, &call);
  scene_mesh_free(&m);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  size_t before = batten_bytes_in_use(ctx);
  double start = batten_now();
  test_meshes();
  test_options();
  test_stops();
  test_split_stops();
  printf("# %.2f s\n", batten_now() - start);
  T_CHECK(batten_bytes_in_use(ctx) == before, "all is freed");
  batten_context_free(ctx);
  return t_done();
}
