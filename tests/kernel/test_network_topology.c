/* Half-edges, edges and fans: by hand, against a search through all pairs, renumbered; bad meshes by name. */
#include "network/net.h"

#include "mesh_shapes.h"
#include "tap.h"

static batten_context *ctx;

typedef struct shape {
  size_t vertices, faces;
  double *points;
  uint32_t *triangles;
} shape;

static void drop(shape *s) {
  free(s->points);
  free(s->triangles);
}

/* n x m quads, each cut in two; wrapped into a torus or open. */
static shape grid(size_t n, size_t m, bool torus) {
  size_t rows = torus ? n : n + 1, columns = torus ? m : m + 1;
  shape s = {rows * columns, 2 * n * m, malloc(3 * rows * columns * sizeof(double)),
             malloc(6 * n * m * sizeof(uint32_t))};
  for (size_t i = 0; i < rows; i++)
    for (size_t j = 0; j < columns; j++) {
      double a = 2 * 3.14159265358979 * (double)i / (double)n, b = 2 * 3.14159265358979 * (double)j / (double)m;
      double *p = s.points + 3 * (i * columns + j);
      p[0] = torus ? (2 + cos(b)) * cos(a) : (double)i / (double)n;
      p[1] = torus ? (2 + cos(b)) * sin(a) : (double)j / (double)m;
      p[2] = torus ? sin(b) : 0.1 * sin(3 * p[0]) * p[1];
    }
  uint32_t *t = s.triangles;
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < m; j++) {
      size_t corner[4] = {i * columns + j, (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns,
                          i * columns + (j + 1) % columns};
      static const int cut[6] = {0, 1, 2, 0, 2, 3};
      for (int k = 0; k < 6; k++) *t++ = (uint32_t)corner[cut[k]];
    }
  return s;
}

static uint32_t end_of(const net_topology *t, uint32_t h) { return t->triangles[net_next(h)]; }

/* All that the header promises, each by the slow way. */
static bool holds(const net_topology *t) {
  uint32_t half_edges = (uint32_t)(3 * t->faces), edges = 0;
  size_t boundary = 0;
  bool ok = t->nodes == t->vertices && !t->guide && !t->bend && !t->constraint;
  for (uint32_t h = 0; h < half_edges; h++) {
    uint32_t twin = NET_NONE;
    for (uint32_t g = 0; g < half_edges; g++)
      if (t->triangles[g] == end_of(t, h) && end_of(t, g) == t->triangles[h]) twin = g;
    ok &= t->twin[h] == twin;
    if (twin == NET_NONE || h < twin) {
      ok &= t->edge[h] == edges && t->half[edges] == h;
      ok &= t->kind[edges] == (twin == NET_NONE ? NET_BOUNDARY : NET_SMOOTH);
      boundary += twin == NET_NONE;
      edges++;
    } else {
      ok &= t->edge[h] == t->edge[twin];
    }
    ok &= t->node[h] == t->triangles[h];
  }
  ok &= edges == t->edges && boundary == t->boundary_edges && !t->crease_edges && !t->line_edges;
  for (uint32_t v = 0; v < t->vertices; v++) {
    size_t corners = 0, walked = 0;
    for (uint32_t h = 0; h < half_edges; h++) corners += t->triangles[h] == v;
    uint32_t h = t->node_first[v];
    do {
      ok &= t->triangles[h] == v;
      walked++;
      h = t->twin[net_prev(h)];
    } while (h != NET_NONE && h != t->node_first[v] && walked <= corners);
    ok &= walked == corners && t->node_vertex[v] == v;
  }
  return ok;
}

static void check(const char *what, const shape *s, size_t edges, size_t boundary) {
  net_topology t = {0};
  T_OK(net_topology_make(ctx, s->vertices, s->points, s->faces, s->triangles, &t), ctx);
  if (t.edges)
    T_CHECK(t.edges == edges && t.boundary_edges == boundary && holds(&t), "%s: %zu edges, %zu of them boundary",
            what, t.edges, t.boundary_edges);
  net_topology_free(ctx, &t);
}

static void test_by_hand(void) {
  shape triangle = {3, 1, (double[]){0, 0, 0, 1, 0, 0, 0, 1, 0}, (uint32_t[]){0, 1, 2}};
  check("one triangle", &triangle, 3, 3);
  net_topology t = {0};
  T_OK(net_topology_make(ctx, 4, tetra_vertices, 4, tetra_triangles, &t), ctx);
  /* Triangles 0 2 1, 0 1 3, 0 3 2, 1 2 3: half-edge 2 runs from 1 to 0, half-edge 3 back. */
  T_CHECK(t.twin[2] == 3 && t.twin[3] == 2 && t.twin[0] == 8 && t.twin[1] == 9, "tetrahedron: twins");
  T_CHECK(t.edge[3] == 2 && t.half[2] == 2 && t.edge[4] == 3 && t.half[3] == 4, "tetrahedron: edges");
  T_CHECK(t.node_first[0] == 0 && t.node_first[3] == 5, "tetrahedron: fans begin with the lowest");
  T_CHECK(net_edge_node(&t, 2, 0, 0) == 1 && net_edge_node(&t, 2, 1, 0) == 0 && net_edge_node(&t, 2, 0, 1) == 1 &&
              net_edge_node(&t, 2, 1, 1) == 0,
          "nodes of an edge: the same from both sides");
  net_topology_free(ctx, &t);
}

static void test_grids(void) {
  shape open = grid(5, 4, false), torus = grid(6, 4, true);
  check("open grid", &open, 5 * 5 + 6 * 4 + 20, 18);
  check("torus", &torus, 72, 0);
  uint64_t seed = 7; /* shuffled triangles with turned corners: the same facts */
  for (int round = 0; round < 5; round++) {
    for (size_t f = open.faces; f-- > 1;) {
      size_t g = (size_t)(t_random(&seed) % (f + 1)), turn = (size_t)(t_random(&seed) % 3);
      uint32_t row[3];
      memcpy(row, open.triangles + 3 * f, sizeof row);
      memcpy(open.triangles + 3 * f, open.triangles + 3 * g, sizeof row);
      for (size_t k = 0; k < 3; k++) open.triangles[3 * g + k] = row[(k + turn) % 3];
    }
    check("shuffled grid (seed 7)", &open, 69, 18);
  }
  drop(&open);
  drop(&torus);
}

/* A hub of as many triangles as there are: time must not grow with the square of a valence. */
static void test_large(void) {
  size_t rim = 200000;
  shape s = {rim + 1, rim, malloc(3 * (rim + 1) * sizeof(double)), malloc(3 * rim * sizeof(uint32_t))};
  for (size_t i = 0; i <= rim; i++) {
    double angle = 2 * 3.14159265358979 * (double)i / (double)rim;
    s.points[3 * i] = i ? cos(angle) : 0;
    s.points[3 * i + 1] = i ? sin(angle) : 0;
    s.points[3 * i + 2] = 0;
  }
  for (uint32_t i = 0; i < rim; i++) {
    s.triangles[3 * i] = 0;
    s.triangles[3 * i + 1] = 1 + i;
    s.triangles[3 * i + 2] = 1 + (i + 1) % (uint32_t)rim;
  }
  net_topology t = {0};
  double begin = batten_now();
  T_OK(net_topology_make(ctx, s.vertices, s.points, s.faces, s.triangles, &t), ctx);
  double hub = batten_now() - begin;
  T_CHECK(t.edges == 2 * rim && t.boundary_edges == rim, "a vertex of valence %zu: %.0f ms", rim, 1e3 * hub);
  net_topology_free(ctx, &t);
  drop(&s);
  s = grid(450, 450, true);
  begin = batten_now();
  T_OK(net_topology_make(ctx, s.vertices, s.points, s.faces, s.triangles, &t), ctx);
  T_CHECK(t.edges == 3 * 450 * 450, "%zu triangles: %.0f ms", s.faces, 1e3 * (batten_now() - begin));
  net_topology_free(ctx, &t);
  drop(&s);
}

static void refuse(size_t vertices, const double *points, size_t faces, const uint32_t *triangles, const char *text) {
  net_topology t = {.edges = 77};
  T_STATUS(net_topology_make(ctx, vertices, points, faces, triangles, &t), BATTEN_E_INVALID, ctx, text);
  T_CHECK(t.edges == 77, "and nothing written");
}

static void test_bad(void) {
  static const double p[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, -1, -1, -1, 1, 0, 0};
  refuse(3, p, 0, NULL, "mesh: 0 triangles");
  refuse(4, p, 1, (uint32_t[]){0, 1, 2}, "vertices[3]: in no triangle, one of 1; see batten_mesh_repair");
  refuse(7, p, 3, (uint32_t[]){0, 1, 2, 0, 6, 3, 0, 4, 5},
         "vertices[6]: at the place of vertices[1], one of 1; see batten_mesh_repair");
  refuse(3, p, 2, (uint32_t[]){0, 1, 2, 1, 1, 2}, "triangles[1]: without area, one of 1");
  static const double line[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.5, 0.5, 0};
  refuse(4, line, 3, (uint32_t[]){0, 1, 3, 0, 3, 2, 1, 2, 3}, "triangles[2]: without area");
  refuse(3, p, 2, (uint32_t[]){0, 1, 2, 2, 1, 0}, "triangles[1]: has the corners of triangles[0], one of 1");
  refuse(5, p, 3, (uint32_t[]){0, 1, 2, 0, 3, 1, 1, 0, 4},
         "edge from vertex 0 to 1: in triangles 0, 1, 2, one of 1 such edges; leave two of its triangles");
  refuse(4, p, 2, (uint32_t[]){0, 1, 2, 0, 1, 3},
         "edge from vertex 0 to 1: triangles 0 and 1 pass it the same way, one of 1 such edges; turn one of them");
  refuse(5, p, 2, (uint32_t[]){0, 1, 2, 0, 3, 4}, "vertices[0]: its triangles fall apart into more than one fan");
}

static batten_status make(batten_context *c, void *arg) {
  const shape *s = arg;
  net_topology t;
  batten_status st = net_topology_make(c, s->vertices, s->points, s->faces, s->triangles, &t);
  if (st == BATTEN_E_INVALID) return BATTEN_OK; /* reached with all allocations */
  if (st == BATTEN_OK) net_topology_free(c, &t);
  return st;
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_by_hand();
  test_grids();
  test_large();
  test_bad();
  shape torus = grid(4, 4, true);
  t_fail_every_allocation("net_topology_make", make, &torus);
  torus.triangles[1] = torus.triangles[0];
  t_fail_every_allocation("net_topology_make of a bad mesh", make, &torus);
  drop(&torus);
  batten_context_free(ctx);
  return t_done();
}
