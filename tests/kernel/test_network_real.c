/* Networks on rough meshes: scans, noise, folds. Where a mesh is folded no surface through it is fair; but joints are
 * exact all the same, and few facets are singular. */
#include <batten/network.h>
#include <string.h>

#include "base/checked.h"
#include "mesh/vec.h"
#include "femur.h"
#include "network_scenes.h"
#include "tap.h"

static batten_context *ctx;

static batten_mesh *mesh_of(const scene_mesh *m) {
  batten_mesh *mesh = NULL;
  if (batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh) < 0) {
    printf("Bail out! %s\n", batten_error(ctx));
    exit(1);
  }
  return mesh;
}

/* Noise along all axes, of uniform distribution, in parts of the mean edge. */
static void shake(scene_mesh *m, double parts, uint64_t seed) {
  double edge = 0;
  for (size_t c = 0; c < 3 * m->triangles; c++)
    edge += vec_distance(m->points + 3 * m->corners[c], m->points + 3 * m->corners[c - c % 3 + (c + 1) % 3]);
  edge /= (double)(3 * m->triangles);
  for (size_t i = 0; i < 3 * m->vertices; i++) m->points[i] += parts * edge * (2 * t_uniform(&seed) - 1);
}

/* The most that the least product of a vector with the normals of a vertex's triangles can be, by trying: vectors all
 * over the sphere, then nearer and nearer to the best. */
static double front(const batten_mesh *mesh, const size_t *starts, const uint32_t *fans, size_t v) {
  const double *p = batten_mesh_vertices(mesh);
  const uint32_t *c = batten_mesh_triangles(mesh);
  double best = -1, middle[3] = {0, 0, 0}, reach = 2;
  uint64_t seed = 1;
  for (int round = 0; round < 12 && starts[v + 1] > starts[v]; round++, reach *= 0.6) {
    double center[3];
    memcpy(center, middle, sizeof center);
    for (int trial = 0; trial < 40; trial++) {
      double w[3], least = 1;
      for (int k = 0; k < 3; k++) w[k] = center[k] + reach * (2 * t_uniform(&seed) - 1);
      vec_normalize(w);
      for (size_t f = starts[v]; f < starts[v + 1]; f++) {
        const uint32_t *t = c + 3 * fans[f];
        double n[3];
        vec_triangle_normal(p + 3 * t[0], p + 3 * t[1], p + 3 * t[2], n);
        vec_normalize(n);
        least = fmin(least, vec_dot(w, n));
      }
      if (least <= best) continue;
      best = least;
      memcpy(middle, w, sizeof w);
    }
  }
  return best;
}

/* Vertices that no plane sees whole. */
static size_t count_folded(const batten_mesh *mesh) {
  size_t vertices = batten_mesh_vertex_count(mesh), corners = 3 * batten_mesh_triangle_count(mesh), folded = 0;
  const uint32_t *c = batten_mesh_triangles(mesh);
  size_t *starts = scene_allocate((vertices + 2) * sizeof *starts);
  uint32_t *fans = scene_allocate(corners * sizeof *fans);
  memset(starts, 0, (vertices + 2) * sizeof *starts);
  for (size_t k = 0; k < corners; k++) starts[c[k] + 2]++;
  for (size_t v = 0; v < vertices; v++) starts[v + 2] += starts[v + 1];
  for (size_t k = 0; k < corners; k++) fans[starts[c[k] + 1]++] = (uint32_t)(k / 3);
  for (size_t v = 0; v < vertices; v++) folded += front(mesh, starts, fans, v) < 0;
  free(starts);
  free(fans);
  return folded;
}

typedef struct figures {
  batten_network_info info;
  batten_network_measures measures;
} figures;

static const char *const fill_names[] = {"auto",       "fair",   "fair-linear", "ss",
                                         "ss-classic", "peters", "degree7",     "degree6"};

/* jump: what joints may differ by, degrees; irregular: parts of the facets that may be so. */
static figures judge(const char *name, const batten_mesh *mesh, batten_network_fill fill, double jump,
                     double irregular) {
  batten_network_options o = batten_network_options_default();
  batten_network *network = NULL;
  figures f = {.info = {.faces = 0}};
  o.fill = fill;
  o.fair_passes = 5; /* what is irregular then stays so */
  double start = batten_now();
  batten_status st = batten_network_build(ctx, mesh, &o, &network, &f.info);
  double time = batten_now() - start;
  T_CHECK(st >= 0, "%s, %s: %s", name, fill_names[fill], st ? batten_error(ctx) : "all exact and regular");
  if (st < 0) return f;
  T_RATIO(f.info.normal_jump_max_deg, jump, "%s, %s: joints, degrees", name, fill_names[fill]);
  T_CHECK((double)f.info.irregular_faces <= irregular * (double)f.info.faces && f.info.gap_max < 1e-14,
          "%s, %s: %zu of %zu facets not regular, %zu in three; %.2f s", name, fill_names[fill],
          f.info.irregular_faces, f.info.faces, f.info.fallback_faces, time);
  T_CHECK((st == BATTEN_OK) == (f.info.irregular_faces == 0 && f.info.normal_jump_max_deg <= 1e-9), "and told so");
  T_OK(batten_network_measure(ctx, network, &f.measures), ctx);
  batten_network_free(network);
  return f;
}

/* A vertex that has gone past its neighbours: half of its triangles have their backs up, whatever the normal. */
static void test_fold(void) {
  for (int past = 0; past < 3; past++) {
    scene_mesh m = scene_mesh_icosphere(4);
    const uint32_t *t = m.corners;
    for (int k = 0; k < 3; k++)
      m.points[3 * t[0] + (unsigned)k] +=
          (0.6 + 0.6 * past) * (m.points[3 * t[1] + (unsigned)k] - m.points[3 * t[0] + (unsigned)k]);
    batten_mesh *mesh = mesh_of(&m);
    char name[64];
    snprintf(name, sizeof name, "vertex moved by %.1f edges, %zu folded", 0.6 + 0.6 * past, count_folded(mesh));
    judge(name, mesh, BATTEN_FILL_SS, 1e-9, 0.02);
    judge(name, mesh, BATTEN_FILL_DEGREE7, 1e-9, 0.02);
    judge(name, mesh, BATTEN_FILL_FAIR, 1e-9, 0.02);
    batten_mesh_free(mesh);
    scene_mesh_free(&m);
  }
}

static void test_noise(void) {
  static const double noise[3] = {0.2, 0.4, 0.6}, irregular[3] = {0.01, 0.06, 0.15};
  for (int n = 0; n < 3; n++) {
    scene_mesh m = scene_mesh_blob_162();
    shake(&m, noise[n], 5);
    batten_mesh *mesh = mesh_of(&m);
    char name[64];
    snprintf(name, sizeof name, "blob, noise of %.1f edges, %zu folded", noise[n], count_folded(mesh));
    judge(name, mesh, BATTEN_FILL_SS, 1e-8, irregular[n]);
    judge(name, mesh, BATTEN_FILL_DEGREE7, 1e-8, irregular[n]);
    judge(name, mesh, BATTEN_FILL_FAIR, 1e-8, irregular[n]);
    judge(name, mesh, BATTEN_FILL_FAIR_LINEAR, 1e-8, irregular[n]);
    batten_mesh *less;
    T_OK(batten_mesh_decimate(ctx, mesh, 160, &less, NULL), ctx);
    snprintf(name, sizeof name, "of which %zu, %zu folded", batten_mesh_triangle_count(less), count_folded(less));
    judge(name, less, BATTEN_FILL_SS, 1e-8, irregular[n]);
    judge(name, less, BATTEN_FILL_DEGREE7, 1e-8, irregular[n]);
    judge(name, less, BATTEN_FILL_FAIR, 1e-8, irregular[n]);
    batten_mesh_free(less);
    batten_mesh_free(mesh);
    scene_mesh_free(&m);
  }
}

/* Creases along two sides of one triangle: with one tangent it would have to make half a turn there. */
static void test_creased_corner(void) {
  static const batten_network_fill fills[3] = {BATTEN_FILL_SS, BATTEN_FILL_DEGREE7, BATTEN_FILL_FAIR};
  scene_mesh m = scene_mesh_icosphere(4);
  batten_mesh *mesh = mesh_of(&m);
  const uint32_t *t = m.corners, creases[4] = {t[0], t[1], t[1], t[2]};
  for (int i = 0; i < 3; i++) {
    batten_network_options o = batten_network_options_default();
    batten_network *network = NULL;
    batten_network_info info;
    o.fill = fills[i];
    o.crease_count = 2;
    o.creases = creases;
    o.corner_angle_deg = 170;
    T_OK(batten_network_build(ctx, mesh, &o, &network, &info), ctx);
    batten_network_free(network);
  }
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

/* Smoothing takes the noise out of the curvature: that of a sphere comes back. */
static void test_smoothing(void) {
  scene_mesh m = scene_mesh_icosphere(10);
  shake(&m, 0.2, 3);
  batten_mesh *mesh = mesh_of(&m), *smooth = NULL;
  figures rough = judge("sphere, noisy", mesh, BATTEN_FILL_DEGREE7, 1e-9, 0.01);
  T_OK(batten_mesh_smooth(ctx, mesh, 0.2 * 0.12 / sqrt(3), &smooth, NULL), ctx);
  figures calm = judge("sphere, smoothed", smooth, BATTEN_FILL_DEGREE7, 1e-9, 0.01);
  double before = rough.measures.gauss_p98 - rough.measures.gauss_p02;
  double after = calm.measures.gauss_p98 - calm.measures.gauss_p02;
  T_CHECK(after < 0.2 * before, "K from %.2f .. %.2f to %.2f .. %.2f, radius 1", rough.measures.gauss_p02,
          rough.measures.gauss_p98, calm.measures.gauss_p02, calm.measures.gauss_p98);
  T_RATIO(fabs(calm.measures.volume / 4.18879 - 1), 0.02, "and the volume stays");
  batten_mesh_free(smooth);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

static void test_femur(void) {
  scene_mesh m;
  if (!femur_read(&m)) {
    t_skip("femur", "no data");
    return;
  }
  batten_mesh *mesh = mesh_of(&m), *smooth, *less;
  figures rough = judge("femur", mesh, BATTEN_FILL_AUTO, 1e-8, 0.005);
  judge("femur", mesh, BATTEN_FILL_SS, 1e-8, 0.005);
  T_OK(batten_mesh_decimate(ctx, mesh, 600, &less, NULL), ctx);
  judge("femur of 600", less, BATTEN_FILL_FAIR, 1e-8, 0.08);

  batten_mesh_free(less);
  T_OK(batten_mesh_smooth(ctx, mesh, 0.001, &smooth, NULL), ctx);
  figures calm = judge("femur, smoothed", smooth, BATTEN_FILL_AUTO, 1e-8, 0.005);
  T_CHECK(
      calm.measures.gauss_p98 - calm.measures.gauss_p02 < 0.5 * (rough.measures.gauss_p98 - rough.measures.gauss_p02),
      "K from %.0f .. %.0f to %.0f .. %.0f", rough.measures.gauss_p02, rough.measures.gauss_p98,
      calm.measures.gauss_p02, calm.measures.gauss_p98);
  T_RATIO(fabs(calm.measures.volume / rough.measures.volume - 1), 0.01, "and the volume stays");
  batten_mesh_free(smooth);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_fold();
  test_noise();
  test_creased_corner();
  test_smoothing();
  test_femur();
  batten_context_free(ctx);
  return t_done();
}
