/* Half-edges, edges and fans of an oriented manifold mesh.
 *
 * Corners are sorted by vertex with a counting sort. Then each vertex v writes its outgoing half-edges down at the
 * vertices where they end, and its incoming ones look there for their twins: two reads a half-edge whatever the
 * valence, and near each other in meshes that are stored in some order. What is not right shows by the way: only then
 * the defects are searched for by name. */
#include "net.h"

#include "base/checked.h"
#include "mesh/mesh_inner.h"

#include <string.h>

typedef struct scratch {
  uint32_t *start;  /* [V + 1] into corner */
  uint32_t *corner; /* [3 F] half-edges by the vertex at which they start */
  uint32_t *mark;   /* [V] half-edge that ends here; valid when it starts at the vertex in hand */
} scratch;

/* False when a triangle has no area, or a vertex no triangle. */
static bool sort_corners(const net_topology *t, scratch *s) {
  mesh_rounding rounding = batten_mesh_rounding(t->vertices, t->points);
  bool good = true;
  memset(s->start, 0, (t->vertices + 1) * sizeof *s->start);
  for (size_t f = 0; f < t->faces; f++) {
    const uint32_t *v = t->triangles + 3 * f;
    const double *p[3];
    for (int k = 0; k < 3; k++) {
      s->start[v[k] + 1]++;
      p[k] = t->points + 3 * (size_t)v[k];
    }
    good &= v[0] != v[1] && v[1] != v[2] && v[2] != v[0] && !batten_mesh_is_degenerate(rounding, p[0], p[1], p[2]);
  }
  for (size_t v = 0; v < t->vertices; v++) {
    good &= s->start[v + 1] > 0;
    s->start[v + 1] += s->start[v];
  }
  for (uint32_t h = 0; h < 3 * t->faces; h++) s->corner[s->start[t->triangles[h]]++] = h;
  for (size_t v = t->vertices; v-- > 0;) s->start[v + 1] = s->start[v];
  s->start[0] = 0;
  return good;
}

/* False when an edge is passed twice the same way, which edges of more than two triangles are too. */
static bool find_twins(const net_topology *t, scratch *s) {
  bool good = true;
  for (size_t h = 0; h < 3 * t->faces; h++) t->twin[h] = NET_NONE;
  for (size_t v = 0; v < t->vertices; v++) s->mark[v] = NET_NONE;
  for (uint32_t v = 0; v < t->vertices; v++) {
    for (uint32_t i = s->start[v]; i < s->start[v + 1]; i++) {
      uint32_t h = s->corner[i], end = t->triangles[net_next(h)];
      uint32_t seen = s->mark[end];
      good &= seen == NET_NONE || t->triangles[seen] != v;
      s->mark[end] = h;
    }
    for (uint32_t i = s->start[v]; i < s->start[v + 1]; i++) {
      uint32_t h = net_prev(s->corner[i]), from = t->triangles[h]; /* runs from `from` to v */
      uint32_t seen = s->mark[from];
      if (seen != NET_NONE && t->triangles[seen] == v) t->twin[h] = seen;
    }
  }
  return good;
}

/* Two triangles upon each other share all their edges. */
static bool has_duplicate(const net_topology *t) {
  for (size_t f = 0; f < t->faces; f++) {
    const uint32_t *twin = t->twin + 3 * f;
    if (twin[0] != NET_NONE && twin[1] != NET_NONE && twin[2] != NET_NONE && twin[0] / 3 == twin[1] / 3 &&
        twin[1] / 3 == twin[2] / 3)
      return true;
  }
  return false;
}

/* Fans begin at the boundary, else at their lowest half-edge. False when one fan does not hold all triangles of its
 * vertex. */
static bool find_fans(const net_topology *t, const scratch *s) {
  for (size_t v = 0; v < t->vertices; v++) {
    uint32_t first = s->corner[s->start[v]], length = 0;
    for (uint32_t i = s->start[v]; i < s->start[v + 1]; i++)
      if (t->twin[s->corner[i]] == NET_NONE) first = s->corner[i];
    t->node_first[v] = first;
    uint32_t h = first;
    do {
      length++;
      h = t->twin[net_prev(h)];
    } while (h != NET_NONE && h != first);
    if (length != s->start[v + 1] - s->start[v]) return false;
  }
  return true;
}

static void number_edges(net_topology *t) {
  for (uint32_t h = 0; h < 3 * t->faces; h++) {
    uint32_t twin = t->twin[h];
    if (twin < h) { /* NET_NONE is the largest */
      t->edge[h] = t->edge[twin];
      continue;
    }
    t->half[t->edges] = h;
    t->kind[t->edges] = twin == NET_NONE ? NET_BOUNDARY : NET_SMOOTH;
    t->boundary_edges += twin == NET_NONE;
    t->edge[h] = (uint32_t)t->edges++;
  }
}

static size_t count_edges(const net_topology *t) {
  size_t edges = 0;
  for (uint32_t h = 0; h < 3 * t->faces; h++) edges += t->twin[h] > h;
  return edges;
}

static batten_status has_duplicate_place(batten_context *ctx, const net_topology *t, uint32_t *kept, bool *out) {
  batten_status st = batten_mesh_find_welds(ctx, t->vertices, t->points, NULL, 0, kept);
  if (st < 0) return st;
  *out = false;
  for (size_t v = 0; v < t->vertices; v++) *out |= kept[v] != v;
  return BATTEN_OK;
}

/* Names what is wrong. A mesh that is whole can still have vertices at one place, which may be meant or not. */
static batten_status check_defects(batten_context *ctx, const net_topology *t, bool whole) {
  bool duplicates = false;
  batten_mesh_defects defects;
  batten_status st = BATTEN_OK;
  if (whole) st = has_duplicate_place(ctx, t, t->node_vertex, &duplicates);
  if (st < 0 || (whole && !duplicates)) return st;
  st = batten_mesh_find_defects_of(ctx, t->vertices, t->points, t->faces, t->triangles, &defects);
  if (st == BATTEN_OK && (!whole || defects.duplicate_vertices)) st = batten_mesh_fail_defects(ctx, &defects);
  return st;
}

batten_status net_topology_make(batten_context *ctx, size_t vertices, const double *points, size_t faces,
                                const uint32_t *triangles, net_topology *out) {
  if (!faces) return batten_fail(ctx, BATTEN_E_INVALID, "mesh: 0 triangles; give at least one");
  batten_status st = BATTEN_E_NOMEM;
  net_topology t = {
      .vertices = vertices, .faces = faces, .nodes = vertices, .points = points, .triangles = triangles};
  size_t half_edges = 3 * faces;
  scratch s = {0};
  if (!(s.start = batten_alloc_array(ctx, vertices + 1, sizeof *s.start)) ||
      !(s.corner = batten_alloc_array(ctx, half_edges, sizeof *s.corner)) ||
      !(s.mark = batten_alloc_array(ctx, vertices, sizeof *s.mark)) ||
      !(t.twin = batten_alloc_array(ctx, half_edges, sizeof *t.twin)) ||
      !(t.edge = batten_alloc_array(ctx, half_edges, sizeof *t.edge)) ||
      !(t.node = batten_alloc_array(ctx, half_edges, sizeof *t.node)) ||
      !(t.node_vertex = batten_alloc_array(ctx, vertices, sizeof *t.node_vertex)) ||
      !(t.node_first = batten_alloc_array(ctx, vertices, sizeof *t.node_first)))
    goto done;
  bool whole = sort_corners(&t, &s) && find_twins(&t, &s) && !has_duplicate(&t) && find_fans(&t, &s);
  st = check_defects(ctx, &t, whole);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  size_t edges = count_edges(&t);
  if (!(t.half = batten_alloc_array(ctx, edges, sizeof *t.half)) ||
      !(t.kind = batten_alloc_array(ctx, edges, sizeof *t.kind)))
    goto done;
  number_edges(&t);
  memcpy(t.node, triangles, half_edges * sizeof *t.node);
  for (uint32_t v = 0; v < vertices; v++) t.node_vertex[v] = v;
  *out = t;
  st = BATTEN_OK;
done:
  batten_free(ctx, s.mark);
  batten_free(ctx, s.corner);
  batten_free(ctx, s.start);
  if (st < 0) net_topology_free(ctx, &t);
  return st;
}

void net_topology_free(batten_context *ctx, net_topology *t) {
  batten_free(ctx, t->constraint);
  batten_free(ctx, t->bend);
  batten_free(ctx, t->guide);
  batten_free(ctx, t->node_first);
  batten_free(ctx, t->node_vertex);
  batten_free(ctx, t->node);
  batten_free(ctx, t->kind);
  batten_free(ctx, t->half);
  batten_free(ctx, t->edge);
  batten_free(ctx, t->twin);
  *t = (net_topology){0};
}
