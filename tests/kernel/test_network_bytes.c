/* Memory of networks foretold and taken: the forecast holds, and is not far above. */
#include <batten/batten.h>

#include "network_scenes.h"
#include "tap.h"

static const batten_network_fill fills[] = {BATTEN_FILL_FAIR,   BATTEN_FILL_FAIR_LINEAR, BATTEN_FILL_SS,
                                            BATTEN_FILL_PETERS, BATTEN_FILL_DEGREE7,     BATTEN_FILL_DEGREE6,
                                            BATTEN_FILL_PN};

/* Builds and compares. slack: the forecast may be so many times what was taken. */
static void compare(const char *name, const scene_mesh *m, batten_network_options o, double slack) {
  batten_context *ctx = NULL;
  batten_context_new(NULL, &ctx);
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  batten_network_info info = {0};
  size_t build = 0, kept = 0;
  batten_mesh_create(ctx, m->vertices, m->points, m->triangles, m->corners, &mesh);
  size_t before = batten_bytes_in_use(ctx);
  batten_bytes_peak_reset(ctx);
  T_STATUS(batten_network_bytes(ctx, m->vertices, m->triangles, &o, &build, &kept), BATTEN_OK, ctx, "");
  batten_status st = batten_network_build(ctx, mesh, &o, &network, &info);
  double taken = (double)(batten_bytes_peak(ctx) - before), stays = (double)(batten_bytes_in_use(ctx) - before);
  bool near =
      taken <= (double)build && (double)build <= slack * taken && (stays == (double)kept || info.fallback_faces);
  T_CHECK(st >= 0 && near, "%s, fill %d: %.0f bytes taken, %.2f times as many foretold; %.0f kept, %zu foretold",
          name, (int)o.fill, taken, (double)build / taken, stays, kept);
  batten_network_free(network);
  batten_mesh_free(mesh);
  batten_context_free(ctx);
}

static void forecasts(void) {
  scene_mesh scenes[] = {scene_mesh_octahedron(), scene_mesh_icosphere(6), scene_mesh_panel(),
                         scene_mesh_icosphere(10)};
  static const char *const names[] = {"octahedron", "icosphere 6", "panel", "icosphere 10"};
  static const double slack[] = {10, 3, 4, 3};
  for (size_t s = 0; s < 4; s++) {
    for (size_t f = 0; f < sizeof fills / sizeof *fills; f++) {
      batten_network_options o = batten_network_options_default();
      o.fill = fills[f];
      o.fair_passes = 2;
      compare(names[s], &scenes[s], o, slack[s]);
    }
    batten_network_options direct = batten_network_options_default();
    direct.fill = BATTEN_FILL_DEGREE7;
    direct.solver = BATTEN_NETWORK_DIRECT;
    direct.functional = BATTEN_FUNCTIONAL_LAPLACE_BELTRAMI;
    direct.length = BATTEN_LENGTH_L4;
    compare(names[s], &scenes[s], direct, slack[s]);
    scene_mesh_free(&scenes[s]);
  }
}

static void refusals(void) {
  batten_context *ctx = NULL;
  batten_context_new(NULL, &ctx);
  size_t build = 17, kept = 17;
  batten_network_options o = batten_network_options_default();
  T_STATUS(batten_network_bytes(ctx, SIZE_MAX / 2, SIZE_MAX / 2, NULL, &build, &kept), BATTEN_E_TOO_LARGE, ctx,
           "too many to address");
  o.weight_power = -1;
  T_STATUS(batten_network_bytes(ctx, 6, 8, &o, &build, &kept), BATTEN_E_INVALID, ctx, "opt.weight_power: -1");
  T_CHECK(build == 17 && kept == 17, "outputs stay");
  T_CHECK(batten_network_bytes(NULL, 6, 8, NULL, &build, &kept) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_bytes(ctx, 6, 8, NULL, NULL, NULL), BATTEN_OK, ctx, "");
  batten_context_free(ctx);
}

int main(void) {
  forecasts();
  refusals();
  return t_done();
}
