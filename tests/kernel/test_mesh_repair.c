/* Defects by hand and against the measures; repair of each of them, and of all at once. */
#include "mesh/mesh_inner.h"

#include "mesh_shapes.h"
#include "network/net.h"
#include "network_scenes.h"
#include "tap.h"

static batten_context *ctx;

static batten_mesh *make(size_t v, const double *vertices, size_t f, const uint32_t *triangles) {
  batten_mesh *mesh = NULL;
  if (batten_mesh_create(ctx, v, vertices, f, triangles, &mesh) != BATTEN_OK)
    T_CHECK(false, "created: %s", batten_error(ctx));
  return mesh;
}

static batten_mesh_defects defects_of(const batten_mesh *mesh) {
  batten_mesh_defects d = {0};
  if (batten_mesh_find_defects(ctx, mesh, &d) != BATTEN_OK) T_CHECK(false, "judged: %s", batten_error(ctx));
  return d;
}

static size_t count_of(const batten_mesh_defects *d) {
  return d->isolated_vertices + d->duplicate_vertices + d->degenerate_triangles + d->duplicate_triangles +
         d->nonmanifold_edges + d->flipped_edges + d->nonmanifold_vertices;
}

static batten_mesh_measures measures_of(const batten_mesh *mesh) {
  batten_mesh_measures m = {0};
  if (batten_mesh_measure(ctx, mesh, &m) != BATTEN_OK) T_CHECK(false, "measured: %s", batten_error(ctx));
  return m;
}

/* The repaired mesh (the caller frees), free of defects. */
static batten_mesh *mend(const char *what, const batten_mesh *mesh, const batten_mesh_repair_options *opt,
                         batten_mesh_repair_info *info) {
  batten_mesh *out = NULL;
  batten_status st = batten_mesh_repair(ctx, mesh, opt, &out, info);
  T_CHECK(st == BATTEN_OK,
          "%s: %s; %zu welded, %zu split, %zu removed vertices; %zu removed, %zu turned triangles, "
          "%zu swaps",
          what, st == BATTEN_OK ? "repaired" : batten_error(ctx), info->welded_vertices, info->split_vertices,
          info->removed_vertices, info->removed_triangles, info->turned_triangles, info->swapped_edges);
  if (st != BATTEN_OK) exit(t_done());
  batten_mesh_defects d = defects_of(out);
  T_CHECK(count_of(&d) == 0, "%s: no defect is left", what);
  return out;
}

/* ---- defects ------------------------------------------------------------------------------------ */

static void test_defects(void) {
  static const double p[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, -1, -1, -1, 1, 0, 0};
  batten_mesh *mesh = make(4, tetra_vertices, 4, tetra_triangles);
  batten_mesh_defects d = defects_of(mesh);
  T_CHECK(count_of(&d) == 0 && d.isolated_vertex == SIZE_MAX && d.duplicate_vertex[1] == UINT32_MAX &&
              d.nonmanifold_triangle[2] == SIZE_MAX && d.flipped_edge[0] == UINT32_MAX,
          "tetrahedron: none, and no first ones");
  batten_mesh_free(mesh);

  mesh = make(7, p, 3, (uint32_t[]){0, 1, 2, 0, 6, 4, 3, 3, 0});
  d = defects_of(mesh);
  T_CHECK(d.isolated_vertices == 1 && d.isolated_vertex == 5, "an isolated vertex");
  T_CHECK(d.duplicate_vertices == 1 && d.duplicate_vertex[0] == 1 && d.duplicate_vertex[1] == 6,
          "a duplicate where edges would join");
  T_CHECK(d.degenerate_triangles == 1 && d.degenerate_triangle == 2, "a corner twice");
  T_CHECK(d.nonmanifold_vertices == 1 && d.nonmanifold_vertex == 0, "two fans at a vertex");
  batten_mesh_free(mesh);

  mesh = make(7, p, 2, (uint32_t[]){0, 1, 2, 6, 3, 4});
  d = defects_of(mesh);
  T_CHECK(d.duplicate_vertices == 0 && d.isolated_vertices == 1, "parts may touch in a vertex");
  batten_mesh_free(mesh);

  mesh = make(7, p, 5, (uint32_t[]){0, 1, 2, 1, 0, 3, 0, 1, 4, 2, 0, 1, 1, 2, 5});
  d = defects_of(mesh);
  T_CHECK(d.nonmanifold_edges == 1 && d.nonmanifold_edge[0] == 0 && d.nonmanifold_edge[1] == 1 &&
              d.nonmanifold_triangle[0] == 0 && d.nonmanifold_triangle[1] == 1 && d.nonmanifold_triangle[2] == 2,
          "an edge of three triangles");
  T_CHECK(d.duplicate_triangles == 1 && d.duplicate_triangle[0] == 0 && d.duplicate_triangle[1] == 3,
          "a triangle twice, which does not count at edges");
  T_CHECK(d.flipped_edges == 1 && d.flipped_edge[0] == 1 && d.flipped_edge[1] == 2 && d.flipped_triangle[0] == 0 &&
              d.flipped_triangle[1] == 4,
          "an edge passed the same way");
  batten_mesh_free(mesh);
}

static void test_straight(void) {
  /* Height over the longest side, in units in the last place of the largest coordinate: 4 is the bound. */
  for (int exponent = -300; exponent <= 300; exponent += 150)
    for (int ulps = 3; ulps <= 5; ulps += 2) {
      double p[9] = {1, 0, 0, -1, 0, 0, 0, ulps * 0x1p-52, 0};
      for (int i = 0; i < 9; i++) p[i] = ldexp(p[i], exponent);
      batten_mesh *mesh = make(3, p, 1, (uint32_t[]){0, 1, 2});
      batten_mesh_defects d = defects_of(mesh);
      T_CHECK(d.degenerate_triangles == (ulps < 4), "%d units high, size 2^%d: %s", ulps, exponent,
              d.degenerate_triangles ? "without area" : "a triangle");
      batten_mesh_free(mesh);
    }
}

/* Soups of few vertices, against the measures, which count without names. */
static void test_soups(void) {
  uint64_t seed = 5;
  size_t edges = 0, vertices = 0, wrong = 0;
  for (int round = 0; round < 200; round++) {
    size_t v = 5 + (size_t)(t_random(&seed) % 20), f = 0;
    double points[75];
    uint32_t triangles[90];
    for (size_t i = 0; i < 3 * v; i++) points[i] = t_uniform(&seed);
    for (int tries = 0; tries < 60 && f < 30; tries++) { /* three corners that no other triangle has */
      uint32_t *t = triangles + 3 * f;
      for (int k = 0; k < 3; k++) t[k] = (uint32_t)(t_random(&seed) % v);
      bool fresh = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
      for (size_t g = 0; g < f && fresh; g++) {
        int same = 0;
        for (int k = 0; k < 9; k++) same += triangles[3 * g + (size_t)(k / 3)] == t[k % 3];
        fresh = same < 3;
      }
      f += fresh;
    }
    batten_mesh *mesh = make(v, points, f, triangles);
    batten_mesh_defects d = defects_of(mesh);
    batten_mesh_measures m = measures_of(mesh);
    wrong += d.nonmanifold_edges != m.nonmanifold_edges || d.nonmanifold_vertices != m.nonmanifold_vertices ||
             d.isolated_vertices != v - m.vertices || d.degenerate_triangles || d.duplicate_triangles;
    if (m.manifold) wrong += (d.flipped_edges == 0) != m.oriented;
    edges += d.nonmanifold_edges;
    vertices += d.nonmanifold_vertices;
    batten_mesh_free(mesh);
  }
  T_CHECK(wrong == 0 && edges > 100 && vertices > 100, "200 soups (seed 5): %zu edges and %zu vertices, as measured",
          edges, vertices);
}

/* ---- welding ------------------------------------------------------------------------------------ */

/* The rule in two loops. */
static void weld_slowly(size_t n, const double *p, double radius, uint32_t *kept) {
  for (uint32_t v = 0; v < n; v++) {
    kept[v] = v;
    for (uint32_t q = 0; q < v && kept[v] == v; q++) {
      double d[3] = {p[3 * v] - p[3 * q], p[3 * v + 1] - p[3 * q + 1], p[3 * v + 2] - p[3 * q + 2]};
      double distance = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      if (kept[q] == q && (distance < radius || (d[0] == 0 && d[1] == 0 && d[2] == 0))) kept[v] = q;
    }
  }
}

static void test_welding(void) {
  static const double chain[] = {0, 0, 0, 0.6, 0, 0, 1.2, 0, 0, -0.0, 0, -0.0};
  uint32_t kept[400], slow[400];
  T_OK(batten_mesh_find_welds(ctx, 4, chain, NULL, 1, kept), ctx);
  T_CHECK(kept[1] == 0 && kept[2] == 2 && kept[3] == 0, "a chain does not run on: 0.6 joins 0, 1.2 stays");
  T_OK(batten_mesh_find_welds(ctx, 4, chain, NULL, 0, kept), ctx);
  T_CHECK(kept[1] == 1 && kept[3] == 0, "radius 0: the same place, and -0 is 0");
  uint64_t seed = 11;
  double points[1200];
  size_t wrong = 0, welded = 0;
  for (int round = 0; round < 30; round++) {
    double far = round % 3 == 2 ? 1e6 : 0, radius = round % 5 ? 0.02 * round : round ? 1e-300 : 0;
    for (int i = 0; i < 1200; i++) points[i] = far + floor(16 * t_uniform(&seed)) / 8 - 1;
    T_CHECK(batten_mesh_find_welds(ctx, 400, points, NULL, radius, kept) == BATTEN_OK, "welded");
    weld_slowly(400, points, radius, slow);
    for (int v = 0; v < 400; v++) {
      wrong += kept[v] != slow[v];
      welded += kept[v] != (uint32_t)v;
    }
  }
  T_CHECK(wrong == 0 && welded > 1000, "%zu vertices welded (seed 11), as by two loops", welded);
}

/* ---- repair ------------------------------------------------------------------------------------- */

static void test_soup_of_tetrahedron(void) {
  double points[36];
  uint32_t triangles[12];
  for (uint32_t h = 0; h < 12; h++) {
    memcpy(points + 3 * h, tetra_vertices + 3 * tetra_triangles[h], 3 * sizeof *points);
    triangles[h] = h;
  }
  batten_mesh *mesh = make(12, points, 4, triangles);
  double values[24];
  for (int i = 0; i < 24; i++) values[i] = i;
  batten_mesh_set_field(ctx, mesh, "place", 2, values);
  batten_mesh_repair_info info = {0};
  batten_mesh *out = mend("soup", mesh, NULL, &info);
  batten_mesh_measures m = measures_of(out);
  T_CHECK(info.welded_vertices == 8 && m.vertices == 4 && m.closed && m.oriented && !info.removed_vertices &&
              !info.turned_triangles,
          "soup of a tetrahedron: closed");
  T_RATIO(fabs(m.volume - 1.0 / 6), 1e-16, "of volume 1/6");
  /* Triangles 0 2 1, 0 1 3: the vertices that stay are corners 0, 1, 2 and 5. */
  const char *name = NULL;
  size_t components = 0;
  const double *field = batten_mesh_field(out, 0, &name, &components);
  T_CHECK(field && components == 2 && !strcmp(name, "place") && field[0] == 0 && field[3] == 3 && field[4] == 4 &&
              field[7] == 11,
          "fields are taken along");
  batten_mesh_free(out);
  batten_mesh_repair_options opt = batten_mesh_repair_options_default();
  opt.weld_radius = -1;
  out = NULL;
  T_OK(batten_mesh_repair(ctx, mesh, &opt, &out, NULL), ctx);
  T_CHECK(batten_mesh_vertex_count(out) == 12, "negative radius: nothing is welded");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
}

static void test_turning(void) {
  uint64_t seed = 3;
  for (int round = 0; round < 6; round++) {
    uint32_t triangles[36];
    memcpy(triangles, cube_triangles, sizeof triangles);
    size_t turned = 0;
    for (size_t t = 0; t < 12; t++) {
      if (round && round < 5 && t_random(&seed) % 2) continue;
      if (!round) continue;
      uint32_t corner = triangles[3 * t];
      triangles[3 * t] = triangles[3 * t + 2];
      triangles[3 * t + 2] = corner;
      turned++;
    }
    double points[24];
    for (int i = 0; i < 24; i++) points[i] = ldexp(cube_vertices[i] + 1000, 100 * (round - 2));
    batten_mesh *mesh = make(8, points, 12, triangles);
    batten_mesh_repair_info info = {0};
    batten_mesh *out = mend("cube with turned triangles", mesh, NULL, &info);
    batten_mesh_measures m = measures_of(out);
    T_CHECK(info.turned_triangles == turned && m.oriented && ldexp(m.volume, -300 * (round - 2)) == 1,
            "%zu of 12 triangles turned back", turned);
    batten_mesh_free(out);
    batten_mesh_free(mesh);
  }
  /* An open part: as few as possible. */
  scene_mesh m = scene_mesh_plane(4);
  for (size_t t = 3; t < m.triangles; t++) {
    uint32_t corner = m.corners[3 * t];
    m.corners[3 * t] = m.corners[3 * t + 1];
    m.corners[3 * t + 1] = corner;
  }
  batten_mesh *mesh = make(m.vertices, m.points, m.triangles, m.corners);
  batten_mesh_repair_info info = {0};
  batten_mesh *out = mend("open mesh with most triangles turned", mesh, NULL, &info);
  T_CHECK(info.turned_triangles == 3, "the few are turned");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

/* A cube one edge of which has n further vertices, held by triangles without area. */
static void test_swaps(void) {
  enum { MOST = 6 };
  for (uint32_t n = 1; n <= MOST; n++) {
    double points[24 + 3 * MOST];
    uint32_t triangles[36 + 3 * 2 * MOST];
    size_t f = 0;
    memcpy(points, cube_vertices, sizeof cube_vertices);
    for (uint32_t i = 0; i < n; i++) { /* on the edge from vertex 0 to vertex 1 */
      double *p = points + 24 + 3 * i;
      p[0] = -0.5 + (double)(i + 1) / (n + 1);
      p[1] = p[2] = -0.5;
    }
    for (size_t t = 0; t < 12; t++) {
      const uint32_t *c = cube_triangles + 3 * t;
      if (t != 0) memcpy(triangles + 3 * f++, c, 3 * sizeof *c);
      if (t == 0) /* 0 2 1 becomes a fan around 2, from 1 to 0 along the edge */
        for (uint32_t i = 0; i <= n; i++) {
          uint32_t a = i ? 7 + i : 0, b = i < n ? 8 + i : 1;
          scene_triangle_set(triangles + 3 * f++, 2, b, a);
        }
    }
    for (uint32_t i = 0; i < n; i++) /* fan from 0: 0 8 9, 0 9 10, ..., 0 last 1 */
      scene_triangle_set(triangles + 3 * f++, 0, 8 + i, i + 1 < n ? 9 + i : 1);
    batten_mesh *mesh = make(8 + n, points, f, triangles);
    batten_mesh_measures m = measures_of(mesh);
    batten_mesh_defects d = defects_of(mesh);
    T_CHECK(m.closed && m.oriented && d.degenerate_triangles == n, "cube with %u triangles without area: closed", n);
    batten_mesh_repair_info info = {0};
    batten_mesh *out = mend("cube with swaps", mesh, NULL, &info);
    m = measures_of(out);
    T_CHECK(m.closed && m.oriented && m.vertices == 8 + n && info.swapped_edges >= n && !info.removed_triangles,
            "still closed, with all vertices");
    T_RATIO(fabs(m.volume - 1) + fabs(m.area - 6), 1e-14, "the same cube");
    batten_mesh_free(out);
    batten_mesh_free(mesh);
  }
}

static void test_splitting(void) {
  /* Two tetrahedra that touch in vertex 0, and an isolated vertex. */
  double points[24];
  uint32_t triangles[24];
  memcpy(points, tetra_vertices, sizeof tetra_vertices);
  for (int i = 0; i < 12; i++) {
    points[12 + i] = i < 3 ? 9 : -tetra_vertices[i];
    triangles[i] = tetra_triangles[i];
    triangles[12 + i] = tetra_triangles[i] ? tetra_triangles[i] + 4 : 0;
  }
  batten_mesh *mesh = make(8, points, 8, triangles);
  batten_mesh_repair_info info = {0};
  batten_mesh *out = mend("two tetrahedra at a vertex", mesh, NULL, &info);
  T_CHECK(info.split_vertices == 1 && info.removed_vertices == 1 && info.turned_triangles == 4 &&
              batten_mesh_vertex_count(out) == 8,
          "the vertex of two fans becomes two, the mirrored one is turned");
  batten_mesh_measures m = measures_of(out);
  T_CHECK(m.closed && m.manifold && m.components == 2 && batten_mesh_vertices(out)[21] == 0, "new ones come last");
  net_topology t = {0};
  T_OK(net_topology_make(ctx, 8, batten_mesh_vertices(out), 8, batten_mesh_triangles(out), &t), ctx);
  net_topology_free(ctx, &t);
  batten_mesh_free(out);
  batten_mesh_repair_options opt = batten_mesh_repair_options_default();
  opt.split = 0;
  opt.orient = 0;
  T_OK(batten_mesh_repair(ctx, mesh, &opt, &out, &info), ctx);
  T_CHECK(batten_mesh_vertex_count(out) == 7 && !info.split_vertices && !info.turned_triangles &&
              memcmp(batten_mesh_triangles(out), triangles, 12 * sizeof *triangles) == 0,
          "not when it is not wanted");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
}

/* Everything at once, on meshes that are right: what comes back has their counts and their volume. */
static void test_random(void) {
  uint64_t seed = 2;
  for (int round = 0; round < 12; round++) {
    scene_mesh m = round % 3 == 0   ? scene_mesh_torus_10_6()
                   : round % 3 == 1 ? scene_mesh_genus3()
                                    : scene_mesh_panel();
    batten_mesh *good = make(m.vertices, m.points, m.triangles, m.corners);
    batten_mesh_measures before = measures_of(good);
    size_t half_edges = 3 * m.triangles, f = m.triangles, extra = 20;
    double *points = scene_allocate((half_edges + 1) * 3 * sizeof *points);
    uint32_t *triangles = scene_allocate((half_edges + 3 * extra) * sizeof *triangles);
    for (size_t t = 0; t < f; t++) {
      size_t from = (size_t)(t_random(&seed) % 3);
      bool turn = t_random(&seed) % 4 == 0;
      for (size_t k = 0; k < 3; k++) {
        size_t corner = turn ? (from + 3 - k) % 3 : (from + k) % 3, h = 3 * t + k;
        memcpy(points + 3 * h, m.points + 3 * m.corners[3 * t + corner], 3 * sizeof *points);
        for (size_t x = 0; x < 3; x++) points[3 * h + x] += 1e-9 * (t_uniform(&seed) - 0.5);
        triangles[h] = (uint32_t)h;
      }
    }
    for (int k = 0; k < 3; k++) points[3 * half_edges + (size_t)k] = 7; /* isolated */
    for (size_t i = 0; i < extra; i++, f++) {
      uint32_t copy = 3 * (uint32_t)(t_random(&seed) % m.triangles);
      if (i % 2)
        scene_triangle_set(triangles + 3 * f, copy + 2, copy + 1, copy);
      else
        scene_triangle_set(triangles + 3 * f, copy + 1, copy + 1, copy);
    }
    batten_mesh *mesh = make(half_edges + 1, points, f, triangles);
    batten_mesh_repair_options opt = batten_mesh_repair_options_default();
    opt.weld_radius = 1e-8;
    batten_mesh_repair_info info = {0};
    batten_mesh *out = mend("random", mesh, &opt, &info);
    batten_mesh_measures after = measures_of(out);
    T_CHECK(after.vertices == before.vertices && after.triangles == before.triangles && after.euler == before.euler &&
                after.oriented && after.closed == before.closed && info.removed_triangles == extra &&
                info.removed_vertices == 1 && info.welded_vertices == half_edges - before.vertices,
            "%zu vertices, %zu triangles are back (seed 2, round %d)", after.vertices, after.triangles, round);
    if (before.closed) T_RATIO(fabs(after.volume / fabs(before.volume) - 1), 1e-7, "with their volume");
    batten_mesh_repair_info again = {0};
    batten_mesh *twice = mend("random, again", out, NULL, &again);
    T_CHECK(again.welded_vertices + again.split_vertices + again.removed_vertices + again.removed_triangles +
                    again.turned_triangles + again.swapped_edges ==
                0,
            "a second repair finds nothing to do");
    batten_mesh_free(twice);
    batten_mesh_free(out);
    batten_mesh_free(mesh);
    batten_mesh_free(good);
    free(points);
    free(triangles);
    scene_mesh_free(&m);
  }
}

/* ---- bad input ---------------------------------------------------------------------------------- */

static void test_bad(void) {
  static const double p[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, -1, 0, 1, 0, 0};
  batten_mesh *out = NULL;
  batten_mesh_defects d;
  batten_mesh *mesh = make(5, p, 3, (uint32_t[]){0, 1, 2, 1, 0, 3, 0, 1, 4});
  T_STATUS(batten_mesh_repair(ctx, mesh, NULL, &out, NULL), BATTEN_E_INVALID, ctx,
           "mesh: triangles 0, 1 and 2, or more, share the edge from vertex 0 to vertex 1; leave two of them");
  T_STATUS(batten_mesh_repair(ctx, NULL, NULL, &out, NULL), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_repair(ctx, mesh, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_mesh_find_defects(ctx, NULL, &d), BATTEN_E_INVALID, ctx, "mesh: NULL");
  T_STATUS(batten_mesh_find_defects(ctx, mesh, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_mesh_repair(NULL, mesh, NULL, &out, NULL) == BATTEN_E_INVALID &&
              batten_mesh_find_defects(NULL, mesh, &d) == BATTEN_E_INVALID,
          "no context");
  batten_mesh_repair_options opt = batten_mesh_repair_options_default();
  opt.weld_radius = NAN;
  T_STATUS(batten_mesh_repair(ctx, mesh, &opt, &out, NULL), BATTEN_E_INVALID, ctx, "opt.weld_radius: nan");
  opt.struct_size = 0;
  T_STATUS(batten_mesh_repair(ctx, mesh, &opt, &out, NULL), BATTEN_E_INVALID, ctx,
           "batten_mesh_repair_options.struct_size: 0");
  batten_mesh_free(mesh);
  mesh = make(6, p, 3, (uint32_t[]){0, 1, 2, 1, 0, 3, 0, 5, 4});
  T_STATUS(batten_mesh_repair(ctx, mesh, NULL, &out, NULL), BATTEN_E_INVALID, ctx, "or do not weld");
  batten_mesh_free(mesh);
  scene_mesh m = scene_mesh_moebius(12);
  mesh = make(m.vertices, m.points, m.triangles, m.corners);
  T_STATUS(batten_mesh_repair(ctx, mesh, NULL, &out, NULL), BATTEN_E_INVALID, ctx,
           "mesh: its part with triangle 0 has one side only, as a Moebius strip: at the edge from vertex");
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
  T_CHECK(out == NULL, "nothing was written");

  batten_mesh_repair_info info = {0};
  mesh = make(3, p, 0, NULL);
  out = mend("no triangles", mesh, NULL, &info);
  T_CHECK(batten_mesh_vertex_count(out) == 0 && info.removed_vertices == 3, "no triangles: no vertices");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  static const double zero[9] = {0};
  opt = batten_mesh_repair_options_default();
  opt.weld_radius = -1;
  mesh = make(3, zero, 1, (uint32_t[]){0, 1, 2});
  out = mend("a point", mesh, &opt, &info);
  T_CHECK(batten_mesh_triangle_count(out) == 0, "three vertices at the origin: nothing is left");
  batten_mesh_free(out);
  batten_mesh_free(mesh);
}

static batten_status repair_all(batten_context *c, void *arg) {
  (void)arg;
  /* A duplicate vertex, a triangle without area with a neighbour, two fans at vertex 0, a field. */
  static const double p[] = {0, 0, 0, 2, 0, 0, 1, 1, 0, 1, 0, 0, -1, 0, 1, -1, 1, 0, 0, 0, 0};
  static const uint32_t t[] = {0, 1, 2, 1, 0, 3, 6, 4, 5};
  batten_mesh *mesh = NULL, *out = NULL;
  batten_mesh_defects d;
  batten_status st = batten_mesh_create(c, 7, p, 3, t, &mesh);
  if (st == BATTEN_OK) st = batten_mesh_set_field(c, mesh, "x", 1, p);
  if (st == BATTEN_OK) st = batten_mesh_find_defects(c, mesh, &d);
  if (st == BATTEN_OK) st = batten_mesh_repair(c, mesh, NULL, &out, NULL);
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  return st;
}

static void test_large(void) {
  scene_mesh m = scene_mesh_torus(400, 250);
  batten_mesh *mesh = make(m.vertices, m.points, m.triangles, m.corners), *out = NULL;
  double begin = batten_now();
  batten_mesh_defects d = defects_of(mesh);
  double found = batten_now() - begin;
  batten_mesh_repair(ctx, mesh, NULL, &out, NULL);
  T_CHECK(count_of(&d) == 0 && out, "%zu triangles: defects in %.0f ms, repair in %.0f ms", m.triangles, 1e3 * found,
          1e3 * (batten_now() - begin - found));
  batten_mesh_free(out);
  batten_mesh_free(mesh);
  scene_mesh_free(&m);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_defects();
  test_straight();
  test_soups();
  test_welding();
  test_soup_of_tetrahedron();
  test_turning();
  test_swaps();
  test_splitting();
  test_random();
  test_bad();
  test_large();
  t_fail_every_allocation("batten_mesh_repair", repair_all, NULL);
  batten_context_free(ctx);
  return t_done();
}
