/* Topology of a triangle mesh: edges, boundary, fans, components.
 *
 * Half-edges are sorted by their two ends with counting sorts; runs of equal ends are the edges. Two disjoint-set
 * forests do the rest: triangles joined through edges are the components, corners joined through the edges at their
 * vertex are the fans, and the boundary half-edges that meet in a fan are joined to loops. */
#include "topology.h"

#include "base/checked.h"
#include "mesh_inner.h"
#include "sets.h"

#include <string.h>

static uint32_t lower_end(const uint32_t *triangles, uint32_t h) {
  uint32_t a = triangles[h], b = triangles[mesh_next(h)];
  return a < b ? a : b;
}
static uint32_t higher_end(const uint32_t *triangles, uint32_t h) {
  uint32_t a = triangles[h], b = triangles[mesh_next(h)];
  return a < b ? b : a;
}

void batten_mesh_counting_sort(size_t key_count, size_t count, const uint32_t *triangles,
                               uint32_t (*key)(const uint32_t *, uint32_t), const uint32_t *in, uint32_t *start,
                               uint32_t *out) {
  memset(start, 0, (key_count + 1) * sizeof *start);
  for (uint32_t i = 0; i < count; i++) start[key(triangles, i) + 1]++;
  for (size_t v = 0; v < key_count; v++) start[v + 1] += start[v];
  for (uint32_t i = 0; i < count; i++) {
    uint32_t item = in ? in[i] : i;
    out[start[key(triangles, item)]++] = item;
  }
}

batten_status batten_mesh_sort_edges(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                     const uint32_t *triangles, uint32_t *order) {
  size_t half_edges = 3 * triangle_count;
  uint32_t *start = batten_alloc_array(ctx, vertex_count + 1, sizeof *start);
  uint32_t *by_higher = start ? batten_alloc_array(ctx, half_edges, sizeof *by_higher) : NULL;
  if (by_higher) {
    batten_mesh_counting_sort(vertex_count, half_edges, triangles, higher_end, NULL, start, by_higher);
    batten_mesh_counting_sort(vertex_count, half_edges, triangles, lower_end, by_higher, start, order);
  }
  batten_status st = by_higher ? BATTEN_OK : BATTEN_E_NOMEM;
  batten_free(ctx, by_higher);
  batten_free(ctx, start);
  return st;
}

static size_t count_roots(size_t count, const uint32_t *parent) {
  size_t roots = 0;
  for (uint32_t i = 0; i < count; i++) roots += parent[i] == i;
  return roots;
}

/* ---- edges -------------------------------------------------------------------------------------- */

typedef struct scratch {
  uint32_t *triangle;  /* [F] disjoint sets: components */
  uint32_t *corner;    /* [3 F] disjoint sets: fans */
  uint32_t *loop;      /* [3 F] disjoint sets of boundary half-edges; MESH_NONE for others */
  uint32_t *fan_entry; /* [3 F] by root corner: a boundary half-edge of the fan */
} scratch;

/* The corner of half-edge h's triangle at vertex v, one of its ends. */
static uint32_t corner_at(const uint32_t *triangles, uint32_t h, uint32_t v) {
  return triangles[h] == v ? h : mesh_next(h);
}

static void join_edge(const uint32_t *triangles, const uint32_t *run, size_t count, scratch *s,
                      batten_mesh_topology *topology) {
  uint32_t a = triangles[run[0]], b = triangles[mesh_next(run[0])];
  topology->edges++;
  if (count == 1) {
    topology->boundary_edges++;
    s->loop[run[0]] = run[0];
  }
  if (count > 2 || a == b) topology->nonmanifold_edges++;
  size_t along = 1; /* half-edges that run the same way as the first */
  for (size_t i = 1; i < count; i++) {
    along += triangles[run[i]] == a;
    sets_join(s->triangle, run[0] / 3, run[i] / 3);
    sets_join(s->corner, corner_at(triangles, run[0], a), corner_at(triangles, run[i], a));
    sets_join(s->corner, corner_at(triangles, run[0], b), corner_at(triangles, run[i], b));
  }
  if (count > 1 && 2 * along != count) topology->oriented = 0;
}

static void join_loops(const uint32_t *triangles, size_t half_edges, scratch *s) {
  for (uint32_t h = 0; h < half_edges; h++) {
    if (s->loop[h] == MESH_NONE) continue;
    uint32_t ends[2] = {h, mesh_next(h)};
    for (int e = 0; e < 2; e++) {
      uint32_t fan = sets_find(s->corner, ends[e]);
      if (s->fan_entry[fan] == MESH_NONE)
        s->fan_entry[fan] = h;
      else
        sets_join(s->loop, s->fan_entry[fan], h);
    }
  }
  (void)triangles;
}

static void count_vertices(size_t vertex_count, const uint32_t *triangles, size_t half_edges, scratch *s,
                           uint32_t *fans, batten_mesh_topology *topology) {
  memset(fans, 0, vertex_count * sizeof *fans);
  for (uint32_t h = 0; h < half_edges; h++)
    if (s->corner[h] == h) fans[triangles[h]]++;
  for (size_t v = 0; v < vertex_count; v++) {
    topology->vertices += fans[v] > 0;
    topology->nonmanifold_vertices += fans[v] > 1;
  }
}

batten_status batten_mesh_topology_of_edges(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                            const uint32_t *triangles, const uint32_t *order,
                                            batten_mesh_topology *out) {
  size_t half_edges = 3 * triangle_count;
  batten_status st = BATTEN_E_NOMEM;
  batten_mesh_topology t = {.oriented = 1};
  scratch s = {0};
  uint32_t *fans = batten_alloc_array(ctx, vertex_count, sizeof *fans);
  if (!fans || !(s.triangle = batten_alloc_array(ctx, triangle_count, sizeof *s.triangle)) ||
      !(s.corner = batten_alloc_array(ctx, half_edges, sizeof *s.corner)) ||
      !(s.loop = batten_alloc_array(ctx, half_edges, sizeof *s.loop)) ||
      !(s.fan_entry = batten_alloc_array(ctx, half_edges, sizeof *s.fan_entry)))
    goto done;
  st = BATTEN_OK;
  sets_start(triangle_count, s.triangle);
  sets_start(half_edges, s.corner);
  for (uint32_t h = 0; h < half_edges; h++) s.loop[h] = s.fan_entry[h] = MESH_NONE;
  for (size_t i = 0, n; i < half_edges; i += n) {
    uint32_t low = lower_end(triangles, order[i]), high = higher_end(triangles, order[i]);
    n = 1;
    while (i + n < half_edges && lower_end(triangles, order[i + n]) == low &&
           higher_end(triangles, order[i + n]) == high)
      n++;
    join_edge(triangles, order + i, n, &s, &t);
  }
  join_loops(triangles, half_edges, &s);
  count_vertices(vertex_count, triangles, half_edges, &s, fans, &t);
  t.components = count_roots(triangle_count, s.triangle);
  t.boundary_loops = count_roots(half_edges, s.loop);
  *out = t;
done:
  batten_free(ctx, s.fan_entry);
  batten_free(ctx, s.loop);
  batten_free(ctx, s.corner);
  batten_free(ctx, s.triangle);
  batten_free(ctx, fans);
  return st;
}

batten_status batten_mesh_find_topology(batten_context *ctx, size_t vertex_count, size_t triangle_count,
                                        const uint32_t *triangles, batten_mesh_topology *out) {
  uint32_t *order = batten_alloc_array(ctx, triangle_count, 3 * sizeof *order);
  batten_status st =
      order ? batten_mesh_sort_edges(ctx, vertex_count, triangle_count, triangles, order) : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_mesh_topology_of_edges(ctx, vertex_count, triangle_count, triangles, order, out);
  batten_free(ctx, order);
  return st;
}
