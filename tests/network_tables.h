/* Meshes with the range of the Gaussian curvature that their surfaces should have, and ways of making surfaces
 * through them: the rows and columns of the tables that tests assert and benchmarks print. */
#ifndef NETWORK_TABLES_H
#define NETWORK_TABLES_H

#include <batten/network.h>
#include <math.h>

#include "network_scenes.h"

typedef struct table_mesh {
  const char *name;
  scene_mesh (*make)(void);
  double exact[2]; /* range of K on the surface that the vertices were taken from; NaN: there is none */
} table_mesh;

static inline scene_mesh table_shifted(void) { return scene_mesh_octahedron_shifted(.5, .3); }
static inline scene_mesh table_shifted_far(void) { return scene_mesh_octahedron_shifted(1, .6); }
static inline scene_mesh table_shifted_farther(void) { return scene_mesh_octahedron_shifted(1.2, .72); }
static inline scene_mesh table_sphere_42(void) { return scene_mesh_icosphere(2); }

static const table_mesh table_meshes[] = {
    {"octahedron", scene_mesh_octahedron, {1, 1}},
    {"shifted octahedron", table_shifted, {1, 1}},
    {"shifted by (1, .6)", table_shifted_far, {1, 1}},
    {"shifted by (1.2, .72)", table_shifted_farther, {1, 1}},
    {"tetrahedron", scene_mesh_tetrahedron, {1, 1}},
    {"sphere, 42 vertices", table_sphere_42, {1, 1}},
    {"irregular sphere, 42", scene_mesh_sphere_irregular, {1, 1}},
    {"noisy sphere, 42, 5 %", scene_mesh_sphere_noisy, {NAN, NAN}},
    {"irregular ellipsoid, 42", scene_mesh_ellipsoid_irregular, {.54, 5.88}},
    {"ellipsoid 2, .7, .7, 42", scene_mesh_ellipsoid_long, {.25, 16.7}},
    {"graph 7 x 7, open", scene_mesh_graph_7, {-.631, -.050}},
    {"torus 10 x 6", scene_mesh_torus_10_6, {-1.042, .446}},
    {"blob, 162", scene_mesh_blob_162, {-3.60, 4.75}},
    {"blob, 642", scene_mesh_blob_642, {-3.60, 4.75}},
    {"cube, 26 vertices, as if smooth", scene_mesh_cube_26, {NAN, NAN}},
};
enum { TABLE_MESHES = sizeof table_meshes / sizeof *table_meshes };

typedef enum table_way {
  TABLE_PN,
  TABLE_PLAIN, /* Shirman and Sequin as they published it: projected edges, estimated normals */
  TABLE_G1,    /* minimum norm network with the paper's weights, modified Shirman-Sequin fill */
  TABLE_G1_WEIGHTED,
  TABLE_PETERS,
  TABLE_G2, /* the paper's weights */
  TABLE_G2_WEIGHTED,
  TABLE_FAIR_LINEAR,
  TABLE_FAIR,
  TABLE_WAYS
} table_way;

static const char *const table_way_names[TABLE_WAYS] = {"PN",
                                                        "SS plain",
                                                        "G1 MNN + SS, p = 0",
                                                        "G1 MNN + SS, p = 3",
                                                        "G1 MNN + Peters",
                                                        "G2 MNN, p = 0",
                                                        "G2 MNN, p = 3",
                                                        "fair-linear",
                                                        "fair"};

static inline batten_network_options table_options(table_way way) {
  batten_network_options o = batten_network_options_default();
  switch (way) {
    case TABLE_PN:
      o.fill = BATTEN_FILL_PN;
      break;
    case TABLE_PLAIN:
      o.fill = BATTEN_FILL_SS_CLASSIC;
      o.normal_passes = 0;
      o.direction = BATTEN_DIRECTION_D1;
      o.length = BATTEN_LENGTH_L1;
      break;
    case TABLE_G1:
    case TABLE_G1_WEIGHTED:
      o.fill = BATTEN_FILL_SS;
      o.weight_power = way == TABLE_G1 ? 0 : 3;
      break;
    case TABLE_PETERS:
      o.fill = BATTEN_FILL_PETERS;
      o.weight_power = 0;
      break;
    case TABLE_G2:
    case TABLE_G2_WEIGHTED:
      o.fill = BATTEN_FILL_DEGREE7;
      o.weight_power = way == TABLE_G2 ? 0 : 3;
      o.field_weight = way == TABLE_G2 ? 0.1 : 0.32;
      break;
    case TABLE_FAIR_LINEAR:
      o.fill = BATTEN_FILL_FAIR_LINEAR;
      break;
    default:
      o.fill = BATTEN_FILL_FAIR;
  }
  return o;
}

typedef struct table_figures {
  batten_status status;
  batten_network_info info;
  batten_network_measures measures;
  double time_s;
} table_figures;

/* The surface of a mesh, measured. A negative status in *out: why is in the context. */
static inline table_figures table_build(batten_context *ctx, const scene_mesh *scene,
                                        const batten_network_options *options) {
  table_figures out = {.status = BATTEN_OK};
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  out.status = batten_mesh_create(ctx, scene->vertices, scene->points, scene->triangles, scene->corners, &mesh);
  if (out.status == BATTEN_OK) out.status = batten_network_build(ctx, mesh, options, &network, &out.info);
  if (out.status >= 0) {
    batten_status st = batten_network_measure(ctx, network, &out.measures);
    if (st < 0) out.status = st;
  }
  out.time_s = out.info.time_topology_s + out.info.time_normals_s + out.info.time_network_s + out.info.time_fill_s;
  batten_network_free(network);
  batten_mesh_free(mesh);
  return out;
}

#endif
