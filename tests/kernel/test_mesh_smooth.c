/* Smoothing by the discrepancy principle: an octahedron by hand, the normal equations against a dense solution with
 * an umbrella operator made another way, noise on a sphere, boundaries, what must not matter. */
#include "femur.h"
#include "network_scenes.h"
#include "tap.h"

#include "la/la.h"
#include <batten/mesh.h>

static batten_mesh *mesh_of(batten_context *ctx, const scene_mesh *m) {
  batten_mesh *mesh = NULL;
  T_OK(batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh), ctx);
  return mesh;
}

static double normal(uint64_t *seed) {
  return sqrt(-2 * log(1 - t_uniform(seed))) * cos(2 * SCENE_PI * t_uniform(seed));
}

static void add_noise(scene_mesh *m, double noise, uint64_t seed) {
  for (size_t k = 0; k < 3 * m->vertices; k++) m->points[k] += noise * normal(&seed);
}

static double move(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t k = 0; k < 3 * n; k++) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return sqrt(sum / (3 * (double)n));
}

/* Each vertex's neighbours cancel, so L x = x and d = -lambda / (1 + lambda) x: noise of half the mean coordinate
 * takes lambda = 1. */
static void test_hand(batten_context *ctx) {
  scene_mesh m = scene_mesh_octahedron();
  batten_mesh *mesh = mesh_of(ctx, &m), *out = NULL;
  double lambda = 0;
  T_OK(batten_mesh_smooth(ctx, mesh, 0.5 / sqrt(3), &out, &lambda), ctx);
  T_RATIO(fabs(lambda - 1), 1e-5, "octahedron by hand: lambda = 1");
  double worst = 0;
  for (size_t k = 0; k < 18; k++) worst = fmax(worst, fabs(batten_mesh_vertices(out)[k] - 0.5 * m.points[k]));
  T_RATIO(worst, 1e-5, "octahedron by hand: half the size");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

/* Umbrella rows [V][V] by looking at all pairs of vertices. */
static double *dense_umbrella(const scene_mesh *m) {
  size_t n = m->vertices;
  double *l = calloc(n * n, sizeof *l), *count = calloc(n * n, sizeof *count);
  bool *border = calloc(n, sizeof *border);
  for (size_t t = 0; t < m->triangles; t++)
    for (size_t k = 0; k < 3; k++) {
      size_t a = m->corners[3 * t + k], b = m->corners[3 * t + (k + 1) % 3];
      count[a * n + b]++;
      count[b * n + a]++;
    }
  for (size_t a = 0; a < n; a++)
    for (size_t b = 0; b < n; b++) border[a] = border[a] || count[a * n + b] == 1;
  for (size_t a = 0; a < n; a++) {
    double degree = 0;
    for (size_t b = 0; b < n; b++) degree += border[a] ? count[a * n + b] == 1 : count[a * n + b] > 0;
    for (size_t b = 0; b < n && degree > 0; b++)
      l[a * n + b] = (a == b) - (double)(border[a] ? count[a * n + b] == 1 : count[a * n + b] > 0) / degree;
  }
  free(count), free(border);
  return l;
}

static void test_dense(batten_context *ctx, const char *what, scene_mesh m, double noise) {
  add_noise(&m, noise, 77);
  size_t n = m.vertices;
  batten_mesh *mesh = mesh_of(ctx, &m), *out = NULL;
  double lambda = 0, *l = dense_umbrella(&m), *a = calloc(n * n, sizeof *a), *x = malloc(n * 3 * sizeof *x);
  T_OK(batten_mesh_smooth(ctx, mesh, noise, &out, &lambda), ctx);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k < n; k++) a[j * n + k] += lambda * l[i * n + j] * l[i * n + k];
  for (size_t i = 0; i < n; i++) a[i * n + i] += 1;
  T_CHECK(batten_la_potrf(BATTEN_LA_DOUBLE, 'L', n, a, n) == 0, "%s: definite", what);
  double worst = 0;
  for (size_t k = 0; k < 3; k++) {
    for (size_t i = 0; i < n; i++) x[i] = m.points[3 * i + k];
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'N', n, a, n, x);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', n, a, n, x);
    for (size_t i = 0; i < n; i++) worst = fmax(worst, fabs(batten_mesh_vertices(out)[3 * i + k] - x[i]));
  }
  T_RATIO(worst, 1e-8, "%s: against the dense solution, lambda %.4g", what, lambda);
  T_RATIO(fabs(move(n, batten_mesh_vertices(out), m.points) / noise - 1), 2e-6, "%s: moved by the noise", what);
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  free(l), free(a), free(x);
  scene_mesh_free(&m);
}

static double length(const double *p) { return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]); }

static double radius_error(size_t n, const double *points) {
  double sum = 0, mean = 0;
  for (size_t i = 0; i < n; i++) mean += length(points + 3 * i) / (double)n;
  for (size_t i = 0; i < n; i++) sum += pow(length(points + 3 * i) - mean, 2);
  return sqrt(sum / (double)n);
}

/* A sphere with noise: radii spread less, for any number of threads, in any unit, anywhere. */
static void test_sphere(void) {
  scene_mesh m = scene_mesh_icosphere(20);
  const double noise = 0.005;
  add_noise(&m, noise, 5);
  size_t n = m.vertices;
  double *first = malloc(n * 3 * sizeof *first), *shifted = malloc(n * 3 * sizeof *first);
  for (unsigned threads = 1; threads <= 4; threads += 3) {
    batten_context *ctx = t_context(NULL, NULL, threads);
    batten_mesh *mesh = mesh_of(ctx, &m), *out = NULL;
    double lambda;
    T_OK(batten_mesh_smooth(ctx, mesh, noise, &out, &lambda), ctx);
    const double *x = batten_mesh_vertices(out);
    if (threads == 1) {
      memcpy(first, x, n * 3 * sizeof *first);
      T_RATIO(radius_error(n, x), 0.35 * radius_error(n, m.points), "sphere of %zu vertices, lambda %.3g: noise left",
              n, lambda);
    } else {
      T_CHECK(memcmp(first, x, n * 3 * sizeof *first) == 0, "the same bits with 1 and 4 threads");
    }
    batten_mesh_free(out);
    batten_mesh_free(mesh);
    batten_context_free(ctx);
  }
  batten_context *ctx = t_context(NULL, NULL, 2);
  for (size_t k = 0; k < 3 * n; k++) shifted[k] = m.points[k] * 0x1p300;
  batten_mesh *mesh = NULL, *out = NULL;
  T_OK(batten_mesh_create(ctx, n, shifted, m.triangles, m.corners, &mesh), ctx);
  T_OK(batten_mesh_smooth(ctx, mesh, noise * 0x1p300, &out, NULL), ctx);
  bool same = true;
  for (size_t k = 0; k < 3 * n; k++) same = same && batten_mesh_vertices(out)[k] == first[k] * 0x1p300;
  T_CHECK(same, "times 2^300: the same bits");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  for (size_t k = 0; k < 3 * n; k++) shifted[k] = m.points[k] + 1000;
  T_OK(batten_mesh_create(ctx, n, shifted, m.triangles, m.corners, &mesh), ctx);
  T_OK(batten_mesh_smooth(ctx, mesh, noise, &out, NULL), ctx);
  double worst = 0;
  for (size_t k = 0; k < 3 * n; k++) worst = fmax(worst, fabs(batten_mesh_vertices(out)[k] - 1000 - first[k]));
  T_RATIO(worst, 1e-9, "a thousand radii away");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  batten_context_free(ctx);
  free(first), free(shifted);
  scene_mesh_free(&m);
}

/* A plane grid stays plane, and what its border does depends on the border alone. */
static void test_border(batten_context *ctx) {
  scene_mesh m = scene_mesh_grid(9, 7);
  uint64_t seed = 3;
  batten_mesh *mesh, *out = NULL;
  for (size_t i = 0; i < m.vertices; i++)
    scene_point_set(m.points + 3 * i, 0.1 * (double)(i % 9) + 0.02 * normal(&seed), 0.1 * (double)(i / 9), 2);
  mesh = mesh_of(ctx, &m);
  T_OK(batten_mesh_smooth(ctx, mesh, 0.01, &out, NULL), ctx);
  double off = 0;
  for (size_t i = 0; i < m.vertices; i++) off = fmax(off, fabs(batten_mesh_vertices(out)[3 * i + 2] - 2));
  T_CHECK(off == 0, "a plane stays plane");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

static void test_rest(batten_context *ctx) {
  /* an unused vertex and a field */
  scene_mesh m = scene_mesh_icosphere(3);
  size_t n = m.vertices + 1;
  double *points = malloc(n * 3 * sizeof *points), *field = malloc(n * sizeof *field), lambda = -1;
  memcpy(points, m.points, m.vertices * 3 * sizeof *points);
  for (size_t k = 0; k < 3; k++) points[3 * m.vertices + k] = 7;
  for (size_t k = 0; k < n; k++) field[k] = (double)k;
  batten_mesh *mesh, *out = NULL;
  T_OK(batten_mesh_create(ctx, n, points, m.triangles, m.corners, &mesh), ctx);
  T_OK(batten_mesh_set_field(ctx, mesh, "number", 1, field), ctx);
  T_OK(batten_mesh_smooth(ctx, mesh, 0.001, &out, &lambda), ctx);
  const char *name = "";
  size_t components = 0;
  const double *kept = batten_mesh_field(out, 0, &name, &components);
  T_CHECK(kept && strcmp(name, "number") == 0 && components == 1 && memcmp(kept, field, n * sizeof *field) == 0,
          "fields are kept");
  T_CHECK(batten_mesh_vertices(out)[3 * m.vertices] == 7, "unused vertices stay where they are");
  T_RATIO(fabs(move(m.vertices, batten_mesh_vertices(out), m.points) / 0.001 - 1), 2e-6,
          "the move is that of the vertices in use");
  batten_mesh_free(out);
  out = NULL;
  T_STATUS(batten_mesh_smooth(ctx, mesh, 10, &out, &lambda), BATTEN_W_ACCURACY, ctx, "noise: too large");
  T_CHECK(out && lambda == 1e6, "the largest lambda was taken, %g", lambda);
  batten_mesh_free(out);
  out = NULL;
  T_STATUS(batten_mesh_smooth(ctx, mesh, 0, &out, NULL), BATTEN_E_INVALID, ctx, "noise: 0");
  T_STATUS(batten_mesh_smooth(ctx, mesh, -1, &out, NULL), BATTEN_E_INVALID, ctx, "noise: -1");
  T_STATUS(batten_mesh_smooth(ctx, mesh, NAN, &out, NULL), BATTEN_E_INVALID, ctx, "noise: nan");
  T_STATUS(batten_mesh_smooth(ctx, NULL, 1, &out, NULL), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_smooth(ctx, mesh, 1, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_mesh_smooth(NULL, mesh, 1, &out, NULL) == BATTEN_E_INVALID && !out, "no context");
  batten_mesh_free(mesh);
  T_OK(batten_mesh_create(ctx, 2, points, 0, NULL, &mesh), ctx);
  T_STATUS(batten_mesh_smooth(ctx, mesh, 1, &out, NULL), BATTEN_W_ACCURACY, ctx, "smooth as it is");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  out = NULL;
  T_OK(batten_mesh_create(ctx, 0, NULL, 0, NULL, &mesh), ctx);
  T_STATUS(batten_mesh_smooth(ctx, mesh, 1, &out, NULL), BATTEN_W_ACCURACY, ctx, "smooth as it is");
  T_CHECK(out && batten_mesh_vertex_count(out) == 0, "nothing to smooth");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  /* a hub of many triangles: L'L would be full */
  size_t spokes = 5000;
  scene_mesh fan = scene_mesh_make(spokes + 1, spokes);
  for (size_t i = 0; i < spokes; i++) {
    double turn = 2 * SCENE_PI * (double)i / (double)spokes;
    scene_point_set(fan.points + 3 * i, cos(turn), sin(turn), 0.01 * (double)(i % 2));
    scene_triangle_set(fan.corners + 3 * i, i, (i + 1) % spokes, spokes);
  }
  scene_point_set(fan.points + 3 * spokes, 0, 0, 1);
  mesh = mesh_of(ctx, &fan);
  T_OK(batten_mesh_smooth(ctx, mesh, 0.002, &out, &lambda), ctx);
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  scene_mesh_free(&fan);
  scene_mesh_free(&m);
  free(points), free(field);
}

/* The femur of the collection, or nothing. */
static void test_femur(batten_context *ctx) {
  scene_mesh m;
  if (!femur_read(&m)) {
    t_skip("femur", "no data");
    return;
  }
  batten_mesh *mesh = mesh_of(ctx, &m), *out = NULL;
  batten_mesh_measures before, after;
  double lambda = 0;
  T_OK(batten_mesh_measure(ctx, mesh, &before), ctx);
  double noise = 0.05 * before.edge_mean, started = batten_now();
  T_OK(batten_mesh_smooth(ctx, mesh, noise, &out, &lambda), ctx);
  printf("# femur: %zu vertices in %.3f s, lambda %.3g\n", m.vertices, batten_now() - started, lambda);
  T_OK(batten_mesh_measure(ctx, out, &after), ctx);
  T_RATIO(fabs(after.volume / before.volume - 1), 0.01, "femur: volume");
  T_CHECK(after.area < before.area && after.genus == before.genus, "femur: area %.6g, was %.6g", after.area,
          before.area);
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

static batten_status whole(batten_context *ctx, void *arg) {
  const scene_mesh *m = arg;
  batten_mesh *mesh, *out;
  double field[64] = {0};
  batten_status st = batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh);
  if (st < 0) return st;
  st = batten_mesh_set_field(ctx, mesh, "field", 1, field);
  if (st >= 0) st = batten_mesh_smooth(ctx, mesh, 0.01, &out, NULL);
  if (st >= 0) batten_mesh_free(out);
  batten_mesh_free(mesh);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_hand(ctx);
  test_dense(ctx, "noisy sphere", scene_mesh_icosphere(4), 0.03);
  test_dense(ctx, "noisy graph with a border", scene_mesh_graph(11), 0.01);
  test_dense(ctx, "torus", scene_mesh_torus(14, 9), 0.02);
  test_dense(ctx, "ears", scene_mesh_ears(6), 0.02);
  test_sphere();
  test_border(ctx);
  test_rest(ctx);
  test_femur(ctx);
  scene_mesh m = scene_mesh_icosphere(2);
  t_fail_every_allocation("batten_mesh_smooth", whole, &m);
  t_cancel_every_progress("batten_mesh_smooth", whole, &m);
  scene_mesh_free(&m);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
