/* A mesh on its way to a network, for tests of the parts: topology, normals, local parameters. */
#ifndef NETWORK_CASE_H
#define NETWORK_CASE_H

#include "network/net.h"
#include "network_scenes.h"
#include "tap.h"

static inline batten_network_options case_options(void) {
  return (batten_network_options){.struct_size = sizeof(batten_network_options),
                                  .normal_passes = 30,
                                  .normal_tol_rad = 1e-6,
                                  .weight_power = 3,
                                  .field_weight = 0.32,
                                  .corner_angle_deg = 60};
}

typedef struct network_case {
  batten_context *ctx;
  scene_mesh mesh;
  net_topology t;
  double *normals;  /* [nodes][3] */
  net_node *nodes;  /* [nodes] */
  net_local *local; /* [edges] */
  net_figures figures;
  bool ok;
} network_case;

/* Takes the mesh over. Nodes and local have room, no contents. */
static inline network_case case_make(scene_mesh mesh, unsigned threads) {
  network_case c = {.ctx = t_context(NULL, NULL, threads), .mesh = mesh};
  c.ok = net_topology_make(c.ctx, mesh.vertices, mesh.points, mesh.triangles, mesh.corners, &c.t) == BATTEN_OK;
  if (!c.ok) t_line(false, "topology: %s", batten_error(c.ctx));
  c.normals = calloc(c.t.nodes + 1, 3 * sizeof *c.normals);
  c.nodes = calloc(c.t.nodes + 1, sizeof *c.nodes);
  c.local = calloc(c.t.edges + 1, sizeof *c.local);
  return c;
}

static inline void case_free(network_case *c) {
  net_topology_free(c->ctx, &c->t);
  free(c->normals);
  free(c->nodes);
  free(c->local);
  scene_mesh_free(&c->mesh);
  batten_context_free(c->ctx);
}

static inline void case_frames(network_case *c) {
  for (size_t i = 0; i < c->t.nodes; i++) {
    bool creased = c->t.constraint && c->t.constraint[i].kind == NET_CREASED;
    net_frame(c->normals + 3 * i, creased ? c->t.constraint[i].d[0] : NULL, &c->nodes[i]);
  }
}

static inline void case_random_unit(uint64_t *seed, double *out) {
  do
    for (int k = 0; k < 3; k++) out[k] = 2 * t_uniform(seed) - 1;
  while (vec_norm(out) < 0.1);
  vec_normalize(out);
}

/* A rotation by rows. */
static inline void case_rotation(uint64_t seed, double r[3][3]) {
  double other[3];
  case_random_unit(&seed, r[0]);
  do {
    case_random_unit(&seed, other);
    vec_cross(r[0], other, r[1]);
  } while (!(vec_norm(r[1]) > 0.1));
  vec_normalize(r[1]);
  vec_cross(r[0], r[1], r[2]);
}

static inline void case_rotate(const double r[3][3], const double *in, double *out) {
  double a[3] = {vec_dot(r[0], in), vec_dot(r[1], in), vec_dot(r[2], in)};
  memcpy(out, a, sizeof a);
}

static inline double case_angle(const double *a, const double *b) {
  double c[3];
  vec_cross(a, b, c);
  return atan2(vec_norm(c), vec_dot(a, b));
}

#endif
