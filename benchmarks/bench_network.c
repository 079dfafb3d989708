/* Surfaces through icospheres of a thousand to a million triangles: time of each stage, time and memory per triangle;
 * they should not depend on the size. Usage: bench-network [triangles ...] default 1000 10000 100000 1000000, made to
 * the next 20 n^2. The fair fill runs up to FAIR_MOST triangles. */
#include "network_scenes.h"
#include "tap.h"

#include <batten/batten.h>
#include <unistd.h>

enum { FAIR_MOST = 20000, PASSES = 5, REPEATS = 3, FILLS = 3 };

static const struct {
  batten_network_fill fill;
  const char *name;
} fills[FILLS] = {{BATTEN_FILL_SS, "ss"}, {BATTEN_FILL_DEGREE7, "degree 7"}, {BATTEN_FILL_FAIR, "fair"}};

typedef struct row {
  size_t triangles;
  double time, bytes; /* per triangle: microseconds, bytes at the peak */
} row;

/* The best of several builds, in a context of its own, so that the peak is that of the build and its mesh. */
static bool measure(unsigned threads, const scene_mesh *m, int kind, row *out) {
  batten_network_info best = {0}, info;
  double least = INFINITY;
  size_t peak = 0, held = 0;
  for (size_t k = 0; k < REPEATS; k++) {
    batten_network_options o = batten_network_options_default();
    batten_mesh *mesh = NULL;
    batten_network *network = NULL;
    batten_context *ctx = t_context(NULL, NULL, threads);
    o.fill = fills[kind].fill;
    o.normal_passes = PASSES;
    o.normal_tol_rad = 0; /* all of them */
    batten_status st = batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh);
    double start = batten_now();
    if (st >= 0) st = batten_network_build(ctx, mesh, &o, &network, &info);
    double time = batten_now() - start;
    if (st < 0) {
      printf("%zu triangles, %s: %s\n", m->triangles, fills[kind].name, batten_error(ctx));
    } else if (time < least) {
      least = time;
      best = info;
      peak = batten_bytes_peak(ctx);
      held = batten_bytes_in_use(ctx);
      batten_network_free(network);
      held -= batten_bytes_in_use(ctx);
      network = NULL;
    }
    batten_network_free(network);
    batten_mesh_free(mesh);
    batten_context_free(ctx);
    if (st < 0) return false;
  }
  double each = 1e6 / (double)m->triangles;
  *out = (row){m->triangles, least * each, (double)peak / (double)m->triangles};
  printf("| %zu | %s | %.3f | %.2f | %.3f | %.3f | %.3f | %.3f | %.3f | %u | %zu | %u | %.0f | %.0f | %.1e | %zu |\n",
         m->triangles, fills[kind].name, least, out->time, best.time_topology_s, best.time_normals_s,
         best.time_network_s, best.time_fill_s, best.time_check_s, best.normal_passes, best.cg_iterations,
         best.fairing_passes, out->bytes, (double)held / (double)m->triangles, best.normal_jump_max_deg,
         best.irregular_faces);
  fflush(stdout);
  return true;
}

/* Largest time per triangle over the least one, of the sizes from 10,000 triangles on. */
static double spread(const row *rows, size_t count) {
  double least = INFINITY, most = 0;
  for (size_t i = 0; i < count; i++) {
    if (rows[i].triangles < 9000) continue;
    least = fmin(least, rows[i].time);
    most = fmax(most, rows[i].time);
  }
  return most / least;
}

int main(int argc, char **argv) {
  static const size_t sizes[] = {1000, 10000, 100000, 1000000};
  enum { SIZES_MAX = 16 };
  size_t given = argc > 1 ? (size_t)argc - 1 : sizeof sizes / sizeof *sizes, done[FILLS] = {0};
  row rows[FILLS][SIZES_MAX];
  if (given > SIZES_MAX) given = SIZES_MAX;
  unsigned threads = (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
  char blas[256];
  batten_blas_describe(blas, sizeof blas);
  printf("batten %s, %u threads, BLAS: %s, %u threads; icospheres, %d passes of the normals\n\n",
         batten_version(), threads, blas, batten_blas_threads(), PASSES);
  printf(
      "| triangles | fill | time s | us a triangle | topology s | normals s | network s | fill s | check s | passes "
      "| "
      "cg steps | fair passes | peak bytes a triangle | bytes held | largest jump deg | irregular |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t i = 0; i < given; i++) {
    double wanted = argc > 1 ? strtod(argv[i + 1], NULL) : (double)sizes[i];
    if (!(wanted >= 20 && wanted <= 1e8)) continue;
    scene_mesh m = scene_mesh_icosphere((size_t)lrint(sqrt(wanted / 20)));
    for (int kind = 0; kind < FILLS; kind++) {
      if (fills[kind].fill == BATTEN_FILL_FAIR && m.triangles > FAIR_MOST) continue;
      if (measure(threads, &m, kind, &rows[kind][done[kind]])) done[kind]++;
    }
    scene_mesh_free(&m);
  }
  printf("\n");
  for (int kind = 0; kind < FILLS; kind++)
    if (done[kind] > 1)
      printf("%s: time per triangle from 10,000 triangles on within a factor %.2f\n", fills[kind].name,
             spread(rows[kind], done[kind]));
  return done[0] == 0;
}
