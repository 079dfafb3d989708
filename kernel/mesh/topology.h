/* Topology of a triangle mesh; for kernel/mesh only. */
#ifndef BATTEN_MESH_TOPOLOGY_H
#define BATTEN_MESH_TOPOLOGY_H

#include <batten/base.h>
#include <stdint.h>

typedef struct batten_mesh_topology {
  size_t vertices; /* in use */
  size_t edges, components, boundary_edges, boundary_loops, nonmanifold_edges, nonmanifold_vertices;
  int oriented;
} batten_mesh_topology;

/* triangles [F][3], 3 F < 2^32 - 1. Time O(V + F). */
batten_status batten_mesh_find_topology(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                        const uint32_t *triangles, batten_mesh_topology *out);

/* The same with order [3 F] as batten_mesh_sort_edges gives it. */
batten_status batten_mesh_topology_of_edges(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                            const uint32_t *triangles, const uint32_t *order,
                                            batten_mesh_topology *out);

#endif
