/* The data of one facet, gathered from nodes and edges: what the fills take.
 *
 * The curve of an edge, and on smooth edges its field, are computed along half[e] for both facets: the neighbours get
 * the same bits. Across a crease each side has nodes, and so a field, of its own. */
#include <stddef.h>

#include "network/fill.h"

const double *net_edge_bend(const net_topology *t, uint32_t e, unsigned end) {
  if (!t->bend || !t->guide || !t->constraint || t->kind[e] == NET_SMOOTH) return NULL;
  const double *guide = t->guide + 3 * (2 * (size_t)e + end);
  if (guide[0] == 0 && guide[1] == 0 && guide[2] == 0) return NULL;
  if (t->constraint[net_edge_node(t, e, end, 0)].kind == NET_FREE) return NULL;
  return t->bend + 3 * (2 * (size_t)e + end);
}

static const double *point(const net_topology *t, uint32_t half_edge) {
  return t->points + 3 * (size_t)t->triangles[half_edge];
}

void net_half_ribbon(const net_topology *t, const net_node *nodes, const net_local *local, uint32_t h,
                     net_ribbon *out) {
  uint32_t e = t->edge[h], run = t->kind[e] == NET_CREASE ? h : t->half[e], last = net_next(run);
  unsigned turned = run != t->half[e];
  net_local along = local[e];
  if (turned)
    for (int k = 0; k < 3; k++) {
      along.t[0][k] = local[e].t[1][k];
      along.t[1][k] = local[e].t[0][k];
      along.s[0][k] = local[e].s[1][k];
      along.s[1][k] = local[e].s[0][k];
    }
  net_ribbon_join(point(t, run), point(t, last), nodes + t->node[run], nodes + t->node[last], &along,
                  net_edge_bend(t, e, turned), net_edge_bend(t, e, !turned), out);
  if (run != h) net_ribbon_reverse(out, out);
}

void net_facet_ribbons(const net_topology *t, const net_node *nodes, const net_local *local, size_t face,
                       net_node corner[3], net_ribbon ribbon[3]) {
  for (unsigned k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face + k);
    corner[k] = nodes[t->node[h]];
    net_half_ribbon(t, nodes, local, h, &ribbon[k]);
  }
}

void net_facet_cubics(const net_topology *t, const double *normals, const net_local *local, size_t face,
                      double edges[3][4][3], double normal[3][3]) {
  for (unsigned k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face + k), e = t->edge[h];
    unsigned start = h != t->half[e];
    const double *from = point(t, h), *to = point(t, net_next(h));
    for (int x = 0; x < 3; x++) {
      edges[k][0][x] = from[x];
      edges[k][1][x] = from[x] + local[e].t[start][x] / 3;
      edges[k][2][x] = to[x] + local[e].t[!start][x] / 3;
      edges[k][3][x] = to[x];
      normal[k][x] = normals[3 * (size_t)t->node[h] + (size_t)x];
    }
  }
}
