/* A mesh taken as far as the fills: topology, normals, frames, local parameters, and the patches of all facets, each
 * by the function under test. */
#ifndef NETWORK_RIG_H
#define NETWORK_RIG_H

#include "network/fill.h"
#include "network_joints.h"
#include "network_scenes.h"
#include "tap.h"

typedef struct network_rig {
  batten_context *ctx;
  scene_mesh mesh;
  net_topology topology;
  batten_network_options options;
  double *normals;
  net_node *nodes;
  net_local *local;
  double (*single)[36][3];
  double (*thirds)[3][28][3];
  unsigned char *split;
  bool *crease;   /* by half-edge */
  size_t refused; /* facets of degree 7 that were */
} network_rig;

typedef batten_status (*rig_features)(batten_context *, const batten_network_options *, net_topology *);

/* Takes the mesh over. features: net_features_make or NULL. opt NULL: D2, L2, weights of the library's defaults. */
static inline void rig_open(batten_context *ctx, scene_mesh mesh, const batten_network_options *opt,
                            rig_features features, network_rig *r) {
  *r = (network_rig){.ctx = ctx, .mesh = mesh, .options = {.weight_power = 3, .field_weight = 0.32}};
  if (opt) r->options = *opt;
  if (net_topology_make(ctx, mesh.vertices, mesh.points, mesh.triangles, mesh.corners, &r->topology) ||
      (features && features(ctx, &r->options, &r->topology)))
    t_line(false, "rig: %s", batten_error(ctx));
  const net_topology *t = &r->topology;
  r->normals = scene_allocate(3 * t->nodes * sizeof *r->normals);
  r->nodes = scene_allocate(t->nodes * sizeof *r->nodes);
  r->local = scene_allocate(t->edges * sizeof *r->local);
  r->single = scene_allocate(t->faces * sizeof *r->single);
  r->thirds = scene_allocate(t->faces * sizeof *r->thirds);
  r->split = scene_allocate(t->faces);
  r->crease = scene_allocate(3 * t->faces * sizeof *r->crease);
  memset(r->split, 0, t->faces);
  for (size_t h = 0; h < 3 * t->faces; h++) r->crease[h] = t->kind[t->edge[h]] == NET_CREASE;
  if (net_normals_make(ctx, t, &r->options, r->normals)) t_line(false, "rig: %s", batten_error(ctx));
}

static inline void rig_close(network_rig *r) {
  net_topology_free(r->ctx, &r->topology);
  scene_mesh_free(&r->mesh);
  free(r->normals);
  free(r->nodes);
  free(r->local);
  free(r->single);
  free(r->thirds);
  free(r->split);
  free(r->crease);
}

/* Frames on the normals, and any data x that the constraints allow, up to `size`. */
static inline void rig_nodes_random(network_rig *r, double size, uint64_t seed) {
  net_topology *t = &r->topology;
  for (size_t i = 0; i < t->nodes; i++) {
    net_constraint *c = t->constraint ? &t->constraint[i] : NULL;
    net_frame(r->normals + 3 * i, c && c->kind == NET_CREASED ? c->d[0] : NULL, &r->nodes[i]);
    double origin[5], columns[5][5];
    unsigned dof;
    net_node_freedom(c, &r->nodes[i], origin, columns, &dof);
    for (int k = 0; k < 5; k++) {
      r->nodes[i].x[k] = origin[k];
    }
    for (unsigned y = 0; y < dof; y++) {
      double value = size * (2 * t_uniform(&seed) - 1);
      for (int k = 0; k < 5; k++) r->nodes[i].x[k] += columns[k][y] * value;
    }
  }
  for (uint32_t e = 0; e < t->edges; e++) net_tangent_edge(t, &r->options, r->nodes, NULL, e, &r->local[e]);
}

typedef enum rig_choice { RIG_7, RIG_6, RIG_MIXED, RIG_FALLBACK } rig_choice;

/* Fills all facets: degree 7, degree 6, each with every second one, or 7 where it does not refuse. */
static inline joint_figures rig_fill(network_rig *r, rig_choice choice, unsigned samples) {
  const net_topology *t = &r->topology;
  r->refused = 0;
  for (size_t f = 0; f < t->faces; f++) {
    net_node corner[3];
    net_ribbon ribbon[3];
    net_facet_ribbons(t, r->nodes, r->local, f, corner, ribbon);
    bool good = net_fill_degree7(corner, ribbon, r->single[f]);
    net_fill_degree6(corner, ribbon, r->thirds[f]);
    r->refused += !good;
    r->split[f] = choice == RIG_6 || (choice == RIG_MIXED && f % 2) || (choice == RIG_FALLBACK && !good);
  }
  joint_patches s = {7, 6, (const double(*)[36][3])r->single, (const double(*)[3][28][3])r->thirds, r->split};
  return joint_measure_all(&s, t->faces, t->twin, r->crease, samples);
}

#endif
