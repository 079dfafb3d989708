/* The handle of a network: what goes in comes out; everything that can be wrong is named. */
#include "network/surface.h"
#include "network_shapes.h"
#include "tap.h"

static void bowl(const double xy[2], double out[3]) {
  out[0] = xy[0];
  out[1] = xy[1];
  out[2] = xy[0] * xy[0] + 0.5 * xy[1] * xy[1];
}

static bool same_as(const batten_network *n, const shape *s) {
  bool same = batten_network_vertex_count(n) == s->vertices && batten_network_face_count(n) == s->faces &&
              batten_network_patch_count(n) == s->patches && batten_network_crease_count(n) == s->creases &&
              !memcmp(batten_network_vertices(n), s->points, s->vertices * 24) &&
              !memcmp(batten_network_triangles(n), s->triangles, s->faces * 12) &&
              !memcmp(batten_network_creases(n), s->crease, s->creases * 8);
  for (size_t p = 0; p < s->patches; p++) {
    batten_network_patch got = batten_network_get_patch(n, p), put = s->patch[p];
    size_t first = 99;
    unsigned parts = batten_network_face_patches(n, put.face, &first);
    same = same && got.degree == put.degree && got.face == put.face && got.part == put.part &&
           !memcmp(got.control_points, put.control_points, triangular_count(put.degree) * 24) &&
           parts == (put.part ? 3u : 1u) && first + (put.part ? put.part - 1 : 0) == p;
  }
  return same && batten_network_get_patch(n, s->patches).degree == 0 &&
         batten_network_face_patches(n, s->faces, NULL) == 0;
}

/* twin and sharp against all pairs. */
static bool right_neighbours(const batten_network *n) {
  bool right = true;
  uint32_t count = (uint32_t)(3 * n->face_count);
  for (uint32_t h = 0; h < count; h++) {
    uint32_t twin = NET_NONE;
    bool sharp = false;
    for (uint32_t g = 0; g < count; g++)
      if (n->triangles[g] == n->triangles[net_next(h)] && n->triangles[net_next(g)] == n->triangles[h]) twin = g;
    for (size_t c = 0; c < n->crease_count; c++) {
      uint32_t a = n->creases[2 * c], b = n->creases[2 * c + 1], i = n->triangles[h], j = n->triangles[net_next(h)];
      sharp = sharp || (a == i && b == j) || (a == j && b == i);
    }
    right = right && n->twin[h] == twin && net_surface_sharp(n, h) == sharp;
  }
  return right;
}

/* Both sides of every edge, by their control points: those of a side run from corner to corner. */
static bool sides_meet(const batten_network *n) {
  bool meet = true;
  for (uint32_t h = 0; h < 3 * n->face_count; h++) {
    net_side side = net_surface_side(n, h), inner[2];
    unsigned degree = net_surface_degree(n, side.patch);
    double(*net)[3] = net_surface_points(n, side.patch);
    const double *from = n->vertices + 3 * (size_t)n->triangles[h],
                 *to = n->vertices + 3 * (size_t)n->triangles[net_next(h)];
    double jet[1][3], uv[2];
    for (int end = 0; end < 2; end++) {
      const double *p = net[net_side_index(degree, side.side, 0, end ? degree : 0)], *q = end ? to : from;
      for (int d = 0; d < 3; d++) meet = meet && fabs(p[d] - q[d]) < 1e-12;
      net_side_place(side.side, end, uv);
      triangular_jet(degree, (const double(*)[3])net, uv[0], uv[1], 0, jet);
      for (int d = 0; d < 3; d++) meet = meet && fabs(jet[0][d] - q[d]) < 1e-12;
    }
    if (net_surface_parts(n, h / 3) != 3) continue;
    net_surface_inner(n, h / 3, h % 3, inner);
    degree = net_surface_degree(n, inner[0].patch);
    for (unsigned s = 0; s <= degree; s++)
      for (int d = 0; d < 3; d++) {
        double out = net_surface_points(n, inner[0].patch)[net_side_index(degree, inner[0].side, 0, s)][d];
        double back = net_surface_points(n, inner[1].patch)[net_side_index(degree, inner[1].side, 0, degree - s)][d];
        meet = meet && fabs(out - back) < 1e-12;
        if (s == 0) meet = meet && fabs(out - from[d]) < 1e-12;
      }
  }
  return meet;
}

static void test_round_trip(batten_context *ctx) {
  for (unsigned split = 0; split < 4; split++) {
    shape s = split < 3 ? shape_graph(3, 2, split, bowl) : shape_torus(5);
    s.creases = split;
    if (split < 3) memcpy(s.crease, (uint32_t[3][2]){{5, 6}, {6, 2}, {9, 5}}, sizeof(uint32_t[3][2]));
    if (split == 3) s.creases = 0;
    batten_network *n = NULL;
    T_OK(shape_network(ctx, &s, &n), ctx);
    if (!n) exit(1);
    T_CHECK(same_as(n, &s), "%s: what went in comes out", split == 3 ? "torus" : split ? "mixed" : "uniform");
    T_CHECK(right_neighbours(n) && sides_meet(n), "neighbours, creases, and sides that run from corner to corner");
    batten_network_free(n);
    shape_free(&s);
  }
  batten_network *n = NULL;
  T_OK(batten_network_create(ctx, 0, NULL, 0, NULL, 0, NULL, 0, NULL, &n), ctx);
  T_CHECK(n && batten_network_patch_count(n) == 0 && batten_network_get_patch(n, 0).degree == 0, "nothing at all");
  batten_network_free(n);
  batten_network_free(NULL);
}

static void test_in_place(batten_context *ctx) {
  shape s = shape_graph(3, 2, 0, bowl), mixed = shape_graph(3, 2, 4, bowl);
  size_t before = batten_bytes_in_use(ctx);
  batten_network *n = NULL, *again = NULL;
  T_OK(net_surface_new(ctx, s.vertices, s.points, s.faces, s.triangles, NULL, 0, NULL, 2, 1, &n), ctx);
  for (size_t p = 0; p < s.patches; p++)
    memcpy(net_surface_points(n, p), s.patch[p].control_points, triangular_count(2) * 24);
  T_CHECK(same_as(n, &s) && sides_meet(n), "filled in place: the same network");
  T_CHECK(batten_bytes_in_use(ctx) - before <= net_surface_bytes(s.vertices, s.faces, 0, 2, 1, 0, 0) + 64 * 16,
          "it keeps the bytes that are told");
  T_OK(net_surface_new(ctx, s.vertices, s.points, s.faces, s.triangles, n->twin, 0, NULL, 2, 1, &again), ctx);
  T_CHECK(!memcmp(again->twin, n->twin, 12 * s.faces), "neighbours that are given");
  batten_network_free(again);
  const uint32_t faces[5] = {0, 4, 8, 12, 16};
  T_OK(net_surface_split(n, 5, faces, 3), ctx);
  for (size_t p = 0; p < mixed.patches; p++)
    if (mixed.patch[p].part)
      memcpy(net_surface_points(n, p), mixed.patch[p].control_points, triangular_count(3) * 24);
  T_CHECK(same_as(n, &mixed) && sides_meet(n), "faces that were split: the mixed network");
  T_CHECK(batten_bytes_in_use(ctx) - before <= net_surface_bytes(s.vertices, s.faces, 0, 2, 1, 5, 3) + 64 * 16,
          "and the bytes of that");
  batten_network_free(n);
  T_CHECK(batten_bytes_in_use(ctx) == before, "all is freed");
  T_CHECK(net_surface_bytes(SIZE_MAX / 8, 3, 0, 7, 1, 0, 0) == SIZE_MAX, "bytes beyond counting");
  shape_free(&mixed);
  shape_free(&s);
}

static void test_bad_mesh(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network *n = NULL, *const untouched = (batten_network *)&s;
  T_CHECK(batten_network_create(NULL, 0, NULL, 0, NULL, 0, NULL, 0, NULL, &n) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_create(ctx, 0, NULL, 0, NULL, 0, NULL, 0, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  n = untouched;
  T_STATUS(batten_network_create(ctx, 6, NULL, 8, s.triangles, 8, s.patch, 0, NULL, &n), BATTEN_E_INVALID, ctx,
           "vertices: NULL");
  T_STATUS(batten_network_create(ctx, 6, s.points, 8, NULL, 8, s.patch, 0, NULL, &n), BATTEN_E_INVALID, ctx,
           "triangles: NULL");
  T_STATUS(batten_network_create(ctx, 6, s.points, 8, s.triangles, 8, NULL, 0, NULL, &n), BATTEN_E_INVALID, ctx,
           "patches: NULL");
  T_STATUS(batten_network_create(ctx, 6, s.points, 8, s.triangles, 8, s.patch, 1, NULL, &n), BATTEN_E_INVALID, ctx,
           "creases: NULL");
  T_STATUS(batten_network_create(ctx, SIZE_MAX / 8, s.points, 8, s.triangles, 8, s.patch, 0, NULL, &n),
           BATTEN_E_TOO_LARGE, ctx, "vertex_count");
  T_STATUS(batten_network_create(ctx, 6, s.points, SIZE_MAX / 8, s.triangles, 8, s.patch, 0, NULL, &n),
           BATTEN_E_TOO_LARGE, ctx, "triangle_count");
  T_STATUS(batten_network_create(ctx, 6, s.points, 8, s.triangles, SIZE_MAX / 8, s.patch, 0, NULL, &n),
           BATTEN_E_TOO_LARGE, ctx, "patches; at most");
  s.points[7] = NAN;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "vertices[2][1]: nan");
  s.points[7] = 1;
  s.triangles[4] = 6;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "triangles[1][1]: index 6, but there are 6 vertices");
  s.triangles[4] = 2;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "triangles[1]: corner 2 twice");
  s.triangles[4] = 1;
  uint32_t keep[3];
  memcpy(keep, s.triangles + 3, sizeof keep);
  memcpy(s.triangles + 3, (uint32_t[3]){1, 2, 4}, sizeof keep);
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "triangles[1], [5]: pass the edge 1-2 the same way");
  memcpy(s.triangles + 3, (uint32_t[3]){2, 0, 1}, sizeof keep);
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "triangles[0], [1], [4]: share the edge 0-2");
  memcpy(s.triangles + 3, keep, sizeof keep);
  s.creases = 2;
  memcpy(s.crease, (uint32_t[2][2]){{0, 2}, {0, 1}}, sizeof(uint32_t[2][2]));
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "creases[1]: 0-1 is no edge");
  s.crease[1][1] = 700;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "creases[1]: 0-700 is no edge");
  T_CHECK(n == untouched, "failures leave the result alone");
  shape_free(&s);
}

static void test_bad_patches(batten_context *ctx) {
  shape s = shape_graph(1, 2, 1, bowl);
  batten_network *n = NULL;
  T_STATUS(batten_network_create(ctx, 4, s.points, 2, s.triangles, 5, s.patch, 0, NULL, &n), BATTEN_E_INVALID, ctx,
           "patches: 5, which end before part 3 of face 1");
  T_STATUS(batten_network_create(ctx, 4, s.points, 1, s.triangles, 6, s.patch, 0, NULL, &n), BATTEN_E_INVALID, ctx,
           "patches[3]: after the last of 1 faces");
  s.patch[4].part = 3;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx,
           "patches[4]: part 3 of face 1; expected part 2 of face 1");
  s.patch[4].part = 2;
  s.patch[2].face = 7;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx,
           "patches[2]: part 3 of face 7; expected part 3 of face 0");
  s.patch[2].face = 0;
  s.patch[5].degree = 13;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "patches[5].degree: 13; give 1 to 12");
  s.patch[5].degree = 0;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "patches[5].degree: 0; give 1 to 12");
  s.patch[5].degree = 3;
  const double *keep = s.patch[1].control_points;
  s.patch[1].control_points = NULL;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "patches[1].control_points: NULL; give 10");
  s.patch[1].control_points = keep;
  s.control[5 * 3 * TRIANGULAR_MAX + 3 * 9 + 1] = INFINITY;
  T_STATUS(shape_network(ctx, &s, &n), BATTEN_E_INVALID, ctx, "patches[5].control_points[9][1]: inf");
  shape_free(&s);
}

static batten_status make_mixed(batten_context *ctx, void *arg) {
  batten_network *n = NULL;
  batten_status st = shape_network(ctx, arg, &n);
  batten_network_free(n);
  return st;
}
static batten_status make_and_split(batten_context *ctx, void *arg) {
  shape *s = arg;
  batten_network *n = NULL;
  batten_status st =
      net_surface_new(ctx, s->vertices, s->points, s->faces, s->triangles, NULL, 1, s->crease[0], 7, 1, &n);
  if (st == BATTEN_OK) st = net_surface_split(n, 1, (uint32_t[1]){1}, 6);
  batten_network_free(n);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_round_trip(ctx);
  test_in_place(ctx);
  test_bad_mesh(ctx);
  test_bad_patches(ctx);
  shape s = shape_graph(2, 2, 3, bowl);
  s.creases = 1;
  s.crease[0][0] = 0;
  s.crease[0][1] = 1;
  t_fail_every_allocation("batten_network_create", make_mixed, &s);
  t_fail_every_allocation("net_surface_new and _split", make_and_split, &s);
  shape_free(&s);
  batten_context_free(ctx);
  return t_done();
}
