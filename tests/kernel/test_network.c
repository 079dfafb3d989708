/* Surfaces from meshes by the public call: normals that agree across every edge, vertices met to the bit, and the
 * same surface whatever the unit, the place, the order of vertices and triangles and the number of threads. Joints
 * are judged by plain de Casteljau on the control points. */
#include <batten/network.h>

#include "network_joints.h"
#include "network_scenes.h"
#include "tap.h"

static batten_context *ctx;

static const batten_network_fill fills[] = {BATTEN_FILL_SS,      BATTEN_FILL_SS_CLASSIC, BATTEN_FILL_DEGREE7,
                                            BATTEN_FILL_DEGREE6, BATTEN_FILL_FAIR,       BATTEN_FILL_FAIR_LINEAR};
static const char *const fill_names[] = {"ss", "ss-classic", "degree7", "degree6", "fair", "fair-linear"};
enum { FILLS = 6, PLAIN_FILLS = 4 };

static batten_network_options options_for(int fill) {
  batten_network_options o = batten_network_options_default();
  o.fill = fills[fill];
  return o;
}

static batten_network *build_with(batten_context *c, const scene_mesh *scene, const batten_network_options *o,
                                  batten_network_info *info, batten_status *status) {
  batten_mesh *mesh = NULL;
  batten_network *network = NULL;
  *status = batten_mesh_create(c, scene->vertices, scene->points, scene->triangles, scene->corners, &mesh);
  if (*status == BATTEN_OK) *status = batten_network_build(c, mesh, o, &network, info);
  batten_mesh_free(mesh);
  return network;
}

/* ---- judging --------------------------------------------------------------------------------------- */

/* The patch at edge k of a face, and which of its own edges that is. */
static batten_network_patch patch_at(const batten_network *network, size_t face, unsigned k, unsigned *edge) {
  size_t first;
  unsigned parts = batten_network_face_patches(network, face, &first);
  *edge = parts == 1 ? k : 0;
  return batten_network_get_patch(network, first + (parts == 1 ? 0 : k));
}

static const double (*net_of(const batten_network_patch *p))[3] { return (const double(*)[3])p->control_points; }

/* [3 triangles] the half-edge on the other side, SIZE_MAX at boundaries. Meshes are small. */
static size_t *twins_of(const scene_mesh *m) {
  size_t *twins = scene_allocate(3 * m->triangles * sizeof *twins);
  for (size_t h = 0; h < 3 * m->triangles; h++)
    twins[h] = scene_half_edge(m, m->corners[h % 3 == 2 ? h - 2 : h + 1], m->corners[h]);
  return twins;
}

/* All joints, across the mesh's edges and inside facets. */
static joint_figures judge(const batten_network *network, const scene_mesh *m, const size_t *twins,
                           unsigned samples) {
  joint_figures out = {0};
  for (size_t h = 0; h < 3 * m->triangles; h++) {
    unsigned edge, other;
    batten_network_patch a = patch_at(network, h / 3, (unsigned)(h % 3), &edge), b;
    size_t first;
    if (batten_network_face_patches(network, h / 3, &first) == 3) {
      b = batten_network_get_patch(network, first + (h + 1) % 3);
      joint_measure(a.degree, net_of(&a), 1, b.degree, net_of(&b), 2, samples, &out);
    }
    if (twins[h] == SIZE_MAX || twins[h] < h) continue;
    b = patch_at(network, twins[h] / 3, (unsigned)(twins[h] % 3), &other);
    joint_measure(a.degree, net_of(&a), edge, b.degree, net_of(&b), other, samples, &out);
  }
  out.jacobian /= out.samples ? out.sum / (double)out.samples : 1;
  return out;
}

/* Corners of patches that are not, to the bit, the vertices of the mesh. */
static size_t missed_vertices(const batten_network *network, const scene_mesh *m) {
  size_t missed = 0;
  for (size_t h = 0; h < 3 * m->triangles; h++) {
    unsigned edge;
    batten_network_patch p = patch_at(network, h / 3, (unsigned)(h % 3), &edge);
    size_t n = p.degree, corner[3] = {0, n, (n + 1) * (n + 2) / 2 - 1};
    for (unsigned end = 0; end < 2; end++) {
      uint32_t vertex = m->corners[end == 0 ? h : h % 3 == 2 ? h - 2 : h + 1];
      missed += memcmp(p.control_points + 3 * corner[(edge + end) % 3], m->points + 3 * vertex, 24) != 0;
    }
  }
  return missed + (memcmp(batten_network_vertices(network), m->points, 24 * m->vertices) != 0) +
         (memcmp(batten_network_triangles(network), m->corners, 12 * m->triangles) != 0);
}

static double size_of(const scene_mesh *m) {
  double size = 0;
  for (size_t i = 0; i < 3 * m->vertices; i++) size = fmax(size, fabs(m->points[i]));
  return size;
}

/* ---- exact joints on named meshes -------------------------------------------------------------------- */

static scene_mesh exact_mesh(int i, const char **name) {
  static const char *const names[] = {"octahedron",
                                      "shifted octahedron",
                                      "tetrahedron",
                                      "icosahedron",
                                      "sphere, 42 vertices",
                                      "sphere, 92 vertices",
                                      "torus 10 x 6",
                                      "torus 6 x 4",
                                      "genus 3",
                                      "plane",
                                      "graph",
                                      "disk with 3 ears",
                                      "with 6 ears",
                                      "hinge",
                                      "triangle",
                                      "cube"};
  *name = i < 16 ? names[i] : NULL;
  switch (i) {
    case 0:
      return scene_mesh_octahedron();
    case 1:
      return scene_mesh_octahedron_shifted(.5, .3);
    case 2:
      return scene_mesh_tetrahedron();
    case 3:
      return scene_mesh_icosahedron();
    case 4:
      return scene_mesh_icosphere(2);
    case 5:
      return scene_mesh_icosphere(3);
    case 6:
      return scene_mesh_torus_10_6();
    case 7:
      return scene_mesh_torus(6, 4);
    case 8:
      return scene_mesh_genus3();
    case 9:
      return scene_mesh_plane(5);
    case 10:
      return scene_mesh_graph_7();
    case 11:
      return scene_mesh_ears(3);
    case 12:
      return scene_mesh_ears(6);
    case 13:
      return scene_mesh_hinge();
    case 14:
      return scene_mesh_triangle();
    default:
      return scene_mesh_cube_26();
  }
}

static void test_exact(void) {
  const char *name;
  for (int i = 0;; i++) {
    scene_mesh m = exact_mesh(i, &name);
    size_t *twins = twins_of(&m);
    for (int fill = 0; name && fill < FILLS; fill++) {
      batten_network_options o = options_for(fill);
      batten_network_info info;
      batten_status status;
      batten_network *network = build_with(ctx, &m, &o, &info, &status);
      joint_figures j = status >= 0 ? judge(network, &m, twins, 9) : (joint_figures){.angle_deg = NAN};
      T_CHECK(status == BATTEN_OK && j.angle_deg <= 1e-9 && j.gap <= 1e-13 * size_of(&m) &&
                  missed_vertices(network, &m) == 0,
              "%s, %s: %.1e degrees (told %.1e), %.1e apart, jacobian %.2f, %zu split%s%s", name, fill_names[fill],
              j.angle_deg, info.normal_jump_max_deg, j.gap, j.jacobian, info.fallback_faces, status ? ": " : "",
              status ? batten_error(ctx) : "");
      T_CHECK(info.fill == fills[fill] && info.faces == m.triangles && info.vertices == m.vertices &&
                  info.patches == batten_network_patch_count(network) && info.irregular_faces == 0 &&
                  info.continuity == (fill < 2 ? 1 : 2) && info.nodes == m.vertices && info.crease_edges == 0,
              "%s, %s: figures of the mesh", name, fill_names[fill]);
      batten_network_free(network);
    }
    free(twins);
    scene_mesh_free(&m);
    if (!name) break;
  }
}

/* ---- random meshes ----------------------------------------------------------------------------------- */

typedef struct random_tally {
  size_t built, exact, split;
  double angle_deg, told_deg, gap;
} random_tally;

static void random_one(const scene_mesh *m, const size_t *twins, int seed, int fill, random_tally *t) {
  batten_network_options o = options_for(fill);
  batten_network_info info;
  batten_status status;
  batten_network *network = build_with(ctx, m, &o, &info, &status);
  t->built++;
  if (status != BATTEN_OK) printf("# seed %d, %s: %s\n", seed, fill_names[fill], batten_error(ctx));
  if (status >= 0) {
    joint_figures j = judge(network, m, twins, 5);
    t->exact += status == BATTEN_OK && missed_vertices(network, m) == 0;
    t->angle_deg = fmax(t->angle_deg, isnan(j.angle_deg) ? INFINITY : j.angle_deg);
    t->told_deg = fmax(t->told_deg, info.normal_jump_max_deg);
    t->gap = fmax(t->gap, j.gap / size_of(m));
    t->split += info.fallback_faces;
  }
  batten_network_free(network);
}

/* 200 closed meshes with valences from 3 to 20, each in the units 1, 1e-6 and 1e6, and by each fill in one of them.
 */
static void test_random(void) {
  static const double units[] = {1, 1e-6, 1e6};
  random_tally tally[FILLS] = {{0}};
  unsigned least = UINT32_MAX, most = 0;
  for (int seed = 0; seed < 200; seed++) {
    scene_mesh m = scene_mesh_random((uint64_t)seed);
    unsigned *valence = scene_allocate(m.vertices * sizeof *valence);
    memset(valence, 0, m.vertices * sizeof *valence);
    for (size_t h = 0; h < 3 * m.triangles; h++) valence[m.corners[h]]++;
    for (size_t v = 0; v < m.vertices; v++) {
      least = valence[v] < least ? valence[v] : least;
      most = valence[v] > most ? valence[v] : most;
    }
    size_t *twins = twins_of(&m);
    for (int unit = 0; unit < 3; unit++) {
      scene_mesh n = scene_mesh_from(m.vertices, m.points, m.triangles, m.corners);
      scene_mesh_scale(&n, units[unit], units[unit], units[unit]);
      for (int fill = 0; fill < FILLS; fill++)
        if (fill < PLAIN_FILLS ? (seed + fill) % 3 == unit : seed % 60 == 7 * fill + unit)
          random_one(&n, twins, seed, fill, &tally[fill]);
      scene_mesh_free(&n);
    }
    free(twins);
    free(valence);
    scene_mesh_free(&m);
  }
  T_CHECK(least == 3 && most == 20, "valences from %u to %u", least, most);
  for (int fill = 0; fill < FILLS; fill++) {
    const random_tally *t = &tally[fill];
    T_CHECK(t->exact == t->built && t->built > 0 && t->angle_deg <= 1e-9 && t->gap <= 1e-13,
            "random meshes, %s: %zu of %zu exact, %.1e degrees (told %.1e), gap %.1e, %zu facets split",
            fill_names[fill], t->exact, t->built, t->angle_deg, t->told_deg, t->gap, t->split);
  }
}

/* Octahedra shaken so much that some facets need three patches beside the others' one: where all are regular the
 * joints are as exact, elsewhere the status says so. */
static void test_mixed(void) {
  size_t mixed = 0, exact = 0, warned = 0, wrong = 0;
  double angle_deg = 0;
  for (uint64_t seed = 1; seed <= 60; seed++) {
    uint64_t state = seed;
    scene_mesh m = scene_mesh_octahedron();
    batten_network_options o = options_for(2);
    batten_network_info info;
    batten_status status;
    o.normal_passes = 0;
    for (size_t i = 0; i < 3 * m.vertices; i++) m.points[i] += 0.8 * (2 * t_uniform(&state) - 1);
    batten_network *network = build_with(ctx, &m, &o, &info, &status);
    size_t *twins = twins_of(&m);
    if (status >= 0 && info.fallback_faces) {
      joint_figures j = judge(network, &m, twins, 9);
      mixed++;
      exact += status == BATTEN_OK;
      warned += status == BATTEN_W_ACCURACY;
      wrong += (status == BATTEN_OK) != (info.irregular_faces == 0 && j.angle_deg <= 1e-9) ||
               info.patches != 8 + 2 * info.fallback_faces || missed_vertices(network, &m) > 0 ||
               !(j.gap <= 1e-13 * size_of(&m));
      if (status == BATTEN_OK) angle_deg = fmax(angle_deg, j.angle_deg);
    }
    free(twins);
    batten_network_free(network);
    scene_mesh_free(&m);
  }
  T_CHECK(exact >= 2 && exact + warned == mixed && wrong == 0 && angle_deg <= 1e-9,
          "one patch beside three: %zu networks, %zu exact to %.1e degrees, %zu warn", mixed, exact, angle_deg,
          warned);
}

/* ---- units, places, orders, threads ------------------------------------------------------------------- */

/* Point of a face, its corners counted from k on; on split facets of the part at edge k. */
static void face_point(const batten_network *network, size_t face, unsigned k, const double bary[3], double *out) {
  double place[3], du[3], dv[3];
  unsigned edge;
  batten_network_patch p = patch_at(network, face, k, &edge);
  for (unsigned i = 0; i < 3; i++) place[(edge + i) % 3] = bary[i];
  joint_evaluate(p.degree, net_of(&p), place, out, du, dv);
}

static bool same_patches(const batten_network *a, const batten_network *b, int exponent) {
  bool same = a && b && batten_network_patch_count(a) == batten_network_patch_count(b);
  for (size_t i = 0; same && i < batten_network_patch_count(a); i++) {
    batten_network_patch p = batten_network_get_patch(a, i), q = batten_network_get_patch(b, i);
    size_t numbers = 3 * (size_t)(p.degree + 1) * (p.degree + 2) / 2;
    same = p.degree == q.degree && p.face == q.face && p.part == q.part;
    for (size_t k = 0; same && k < numbers; k++) same = ldexp(p.control_points[k], exponent) == q.control_points[k];
  }
  return same;
}

static void test_units(void) {
  static const int exponents[] = {-20, 3, 200, -200};
  for (int fill = 0; fill < FILLS; fill++) {
    batten_network_options o = options_for(fill);
    batten_network_info info, other;
    batten_status status;
    scene_mesh m = scene_mesh_random(7);
    batten_network *plain = build_with(ctx, &m, &o, &info, &status);
    for (int i = 0; i < 4; i++) {
      double factor = ldexp(1, exponents[i]);
      scene_mesh n = scene_mesh_from(m.vertices, m.points, m.triangles, m.corners);
      scene_mesh_scale(&n, factor, factor, factor);
      batten_network *scaled = build_with(ctx, &n, &o, &other, &status);
      T_CHECK(status == BATTEN_OK && same_patches(plain, scaled, exponents[i]),
              "%s, 2^%d times the mesh: 2^%d times the surface to the bit%s%s", fill_names[fill], exponents[i],
              exponents[i], status ? ": " : "", status ? batten_error(ctx) : "");
      /* Energies are homogeneous: |grad II|^2 of degree -2, |C''|^2 weighted by |E|^-3 of degree -1. */
      int degree = fill < PLAIN_FILLS ? -1 : -2;
      T_CHECK(other.energy == ldexp(info.energy, degree * exponents[i]), "%s: energy in the caller's unit, %g",
              fill_names[fill], other.energy);
      batten_network_free(scaled);
      scene_mesh_free(&n);
    }
    batten_network_free(plain);
    scene_mesh_free(&m);
  }
}

/* Largest difference between the surface of m and that of the mesh moved by x -> R x + shift, with vertices and faces
 * in another order and faces begun at other corners. */
static double moved_difference(const scene_mesh *m, int fill, double turn, bool permute, bool begin) {
  static const double samples[4][3] = {{0.4, 0.35, 0.25}, {0.2, 0.7, 0.1}, {0.6, 0.4, 0}, {0, 0.3, 0.7}};
  const double c = cos(turn), s = sin(turn), shift = turn != 0 ? 0.25 : 0;
  size_t V = m->vertices, F = m->triangles, stride = permute ? 7 : 1;
  while (permute && (V % stride == 0 || F % stride == 0)) stride = stride == 7 ? 11 : 13; /* prime to V and F */
  scene_mesh n = scene_mesh_make(V, F);
  for (size_t v = 0; v < V; v++) {
    const double *p = m->points + 3 * v;
    double x = c * p[0] - s * p[1], y = s * p[0] + c * p[1], z = c * p[2] - s * x;
    scene_point_set(n.points + 3 * (v * stride % V), c * x + s * p[2] + shift, y - shift, z + shift);
  }
  for (size_t f = 0; f < F; f++)
    for (size_t k = 0; k < 3; k++) {
      size_t from = (k + (begin ? f % 3 : 0)) % 3;
      n.corners[3 * (f * stride % F) + k] = (uint32_t)(m->corners[3 * f + from] * stride % V);
    }
  batten_network_options o = options_for(fill);
  batten_status status[2];
  o.fair_tol = 1e-9; /* so that all come to rest in the same place */
  o.fair_passes = 40;
  batten_network *a = build_with(ctx, m, &o, NULL, &status[0]), *b = build_with(ctx, &n, &o, NULL, &status[1]);
  double worst = status[0] < 0 || status[1] < 0 ? INFINITY : 0;
  for (size_t f = 0; worst < INFINITY && f < F; f++)
    for (unsigned k = 0; k < 3; k++)
      for (int i = 0; i < 4; i++) {
        double p[3], q[3], own[3];
        face_point(a, f, (unsigned)((k + (begin ? f % 3 : 0)) % 3), samples[i], p);
        face_point(b, f * stride % F, k, samples[i], q);
        double x = c * p[0] - s * p[1], y = s * p[0] + c * p[1];
        scene_point_set(own, c * x + s * p[2] + shift, y - shift, c * p[2] - s * x + shift);
        for (int d = 0; d < 3; d++) worst = fmax(worst, fabs(own[d] - q[d]));
      }
  batten_network_free(a);
  batten_network_free(b);
  scene_mesh_free(&n);
  return worst;
}

static void test_moves(void) {
  for (int scene = 0; scene < 2; scene++)
    for (int fill = 0; fill < FILLS; fill++) {
      scene_mesh m = scene == 0 ? scene_mesh_sphere_irregular() : scene_mesh_graph(5);
      double bound = fill < PLAIN_FILLS ? 1e-11 : 1e-7; /* the fair fills rest where the energy stops falling */
      double off = moved_difference(&m, fill, 0.7, false, false);
      T_RATIO(off, bound, "scene %d, %s: turned and shifted", scene, fill_names[fill]);
      off = moved_difference(&m, fill, 0, true, false);
      T_RATIO(off, bound, "scene %d, %s: vertices and triangles in another order", scene, fill_names[fill]);
      off = moved_difference(&m, fill, 0, false, true);
      T_RATIO(off, bound, "scene %d, %s: triangles begun at other corners", scene, fill_names[fill]);
      scene_mesh_free(&m);
    }
}

static void test_threads(void) {
  batten_context *four = t_context(NULL, NULL, 4);
  for (int fill = 0; fill < FILLS; fill++) {
    batten_network_options o = options_for(fill);
    batten_network_info one_info, four_info;
    batten_status status[2];
    scene_mesh m = fill < PLAIN_FILLS ? scene_mesh_blob(8, 0.045) : scene_mesh_blob(4, 0.09);
    batten_network *a = build_with(ctx, &m, &o, &one_info, &status[0]);
    batten_network *b = build_with(four, &m, &o, &four_info, &status[1]);
    T_CHECK(status[0] == status[1] && same_patches(a, b, 0) && one_info.energy == four_info.energy &&
                one_info.cg_iterations == four_info.cg_iterations &&
                one_info.normal_jump_max_deg == four_info.normal_jump_max_deg,
            "%s: 1 and 4 threads give the same bits", fill_names[fill]);
    batten_network_free(a);
    batten_network_free(b);
    scene_mesh_free(&m);
  }
  batten_context_free(four);
}

/* ---- what is told --------------------------------------------------------------------------------------- */

static void test_choices(void) {
  scene_mesh m = scene_mesh_icosphere(2);
  batten_network_options o = batten_network_options_default();
  batten_network_info info;
  batten_status status;
  const struct {
    batten_network_fill fill, taken;
    unsigned continuity;
    size_t faces_max, unknowns, patches;
  } cases[] = {{BATTEN_FILL_AUTO, BATTEN_FILL_FAIR, 0, 80, 930, 80}, /* 9 more inside each facet */
               {BATTEN_FILL_AUTO, BATTEN_FILL_DEGREE7, 2, 79, 210, 80},
               {BATTEN_FILL_AUTO, BATTEN_FILL_SS, 1, 80, 84, 240},
               {BATTEN_FILL_DEGREE6, BATTEN_FILL_DEGREE6, 2, 80, 210, 240},
               {BATTEN_FILL_FAIR_LINEAR, BATTEN_FILL_FAIR_LINEAR, 0, 1, 930, 80}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    o.fill = cases[i].fill;
    o.continuity = cases[i].continuity;
    o.fair_faces_max = cases[i].faces_max;
    batten_network *network = build_with(ctx, &m, &o, &info, &status);
    T_CHECK(status == BATTEN_OK && info.fill == cases[i].taken && info.unknowns == cases[i].unknowns &&
                info.patches == cases[i].patches && info.edges == 120 && info.boundary_edges == 0,
            "fill %d, continuity %u: fill %d, %zu unknowns, %zu patches, %zu edges", (int)cases[i].fill,
            cases[i].continuity, (int)info.fill, info.unknowns, info.patches, info.edges);
    T_CHECK(info.energy <= info.energy_start || info.fairing_passes == 0, "energy %g to %g in %u passes",
            info.energy_start, info.energy, info.fairing_passes);
    batten_network_free(network);
  }
  scene_mesh_free(&m);
}

/* Fills that do not meet with one normal say so, and where. */
static void test_inexact(void) {
  static const batten_network_fill inexact[] = {BATTEN_FILL_PN, BATTEN_FILL_PETERS};
  for (int i = 0; i < 2; i++) {
    scene_mesh m = scene_mesh_octahedron_shifted(.5, .3);
    batten_network_options o = batten_network_options_default();
    batten_network_info info;
    batten_status status;
    o.fill = inexact[i];
    batten_network *network = build_with(ctx, &m, &o, &info, &status);
    size_t *twins = twins_of(&m);
    joint_figures j = judge(network, &m, twins, 9);
    free(twins);
    T_CHECK(status == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "degrees across the edge between triangles"),
            "%s", batten_error(ctx));
    T_RATIO(fabs(j.angle_deg - info.normal_jump_max_deg), 1e-9 * j.angle_deg, "%.4g degrees, as measured apart",
            j.angle_deg);
    T_CHECK(missed_vertices(network, &m) == 0 && j.gap < 1e-14, "vertices met, no gaps");
    batten_network_free(network);
    o.fill = BATTEN_FILL_DEGREE7;
    o.check_samples = 0;
    network = build_with(ctx, &m, &o, &info, &status);
    T_CHECK(status == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "opt.check_samples: 0") &&
                isnan(info.normal_jump_max_deg) && isnan(info.gap_max),
            "unchecked: %s", batten_error(ctx));
    batten_network_free(network);
    o.check_samples = 8;
    network = build_with(ctx, &m, &o, &info, &status);
    T_CHECK(status == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "opt.check_samples: 8 places") &&
                info.normal_jump_max_deg < 1e-11,
            "hardly checked: %s", batten_error(ctx));
    batten_network_free(network);
    scene_mesh_free(&m);
  }
}

/* Coordinates that are large beside the mesh have few digits left for its shape. */
static void test_far(void) {
  static const double far[] = {1e2, 1e8};
  for (int i = 0; i < 2; i++)
    for (int fill = 0; fill < FILLS; fill++) {
      scene_mesh m = scene_mesh_octahedron_shifted(.5, .3);
      batten_network_options o = options_for(fill);
      batten_network_info info;
      batten_status status;
      for (size_t k = 0; k < 3 * m.vertices; k++) m.points[k] += far[i];
      batten_network *network = build_with(ctx, &m, &o, &info, &status);
      T_CHECK(missed_vertices(network, &m) == 0 &&
                  (i == 0 ? status == BATTEN_OK
                          : status == BATTEN_W_ACCURACY && strstr(batten_error(ctx), "far from the origin")),
              "%s, %g away: %.1e degrees; %s", fill_names[fill], far[i], info.normal_jump_max_deg,
              status ? batten_error(ctx) : "OK");
      batten_network_free(network);
      scene_mesh_free(&m);
    }
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  size_t before = batten_bytes_in_use(ctx);
  double start = batten_now();
  void (*const tests[])(void) = {test_exact,   test_random,  test_mixed,   test_units, test_moves,
                                 test_threads, test_choices, test_inexact, test_far};
  for (size_t i = 0; i < sizeof tests / sizeof *tests; i++) {
    tests[i]();
    printf("# %.2f s\n", batten_now() - start);
  }
  T_CHECK(batten_bytes_in_use(ctx) == before, "all is freed");
  batten_context_free(ctx);
  return t_done();
}
