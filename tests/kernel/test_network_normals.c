/* Estimated normals and curvatures, frames, and what constraints leave free. */
#include <float.h>

#include "network/normals.h"
#include "network_case.h"

static const char *const weight_names[] = {"angle", "area", "inverse area", "sphere"};

static void test_frames(void) {
  uint64_t seed = 7;
  double worst = 0, along_worst = 0;
  for (int trial = 0; trial < 1000; trial++) {
    double w[3] = {0}, along[3];
    if (trial < 6)
      w[trial / 2] = trial % 2 ? -1 : 1;
    else
      case_random_unit(&seed, w);
    case_random_unit(&seed, along);
    for (int given = 0; given < 2; given++) {
      net_node n;
      net_frame(w, given ? along : NULL, &n);
      const double *axes[3] = {n.u, n.v, n.w};
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) worst = fmax(worst, fabs(vec_dot(axes[i], axes[j]) - (i == j)));
      double turned[3];
      vec_cross(n.w, n.u, turned);
      worst = fmax(worst, vec_distance(turned, n.v));
      if (given) along_worst = fmax(along_worst, fabs(vec_dot(along, n.v)));
    }
  }
  T_RATIO(worst, 8 * DBL_EPSILON, "frames are orthonormal and right-handed");
  T_RATIO(along_worst, 8 * DBL_EPSILON, "u lies in the plane of w and the vector given");
  net_node n;
  double w[3] = {0, 0, 1};
  net_frame(w, w, &n);
  T_CHECK(fabs(vec_norm(n.u) - 1) < 1e-15 && n.u[2] == 0, "a vector along w is as good as none");
}

/* Two triangles at the origin: sides 3 e_x and e_y (normal e_z, angle 90 degrees, twice the area 3), e_y and e_y +
 * e_z (normal e_x, 45 degrees, 1). */
static void test_by_hand(void) {
  static const double points[12] = {0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 1, 1};
  static const uint32_t corners[6] = {0, 1, 2, 0, 2, 3};
  static const double expected[4][3] = {{1, 0, 2}, {1, 0, 3}, {3, 0, 1}, {1.5, 0, 1}};
  network_case c = case_make(scene_mesh_from(4, points, 2, corners), 1);
  batten_network_options o = case_options();
  for (int k = 0; k < 4; k++) {
    o.normals = (batten_normal_weights)k;
    T_OK(net_normals_make(c.ctx, &c.t, &o, c.normals), c.ctx);
    T_RATIO(case_angle(c.normals, expected[k]), 4 * DBL_EPSILON, "%s weights", weight_names[k]);
  }
  case_free(&c);

  c = case_make(scene_mesh_octahedron(), 1);
  for (int k = 0; k < 4; k++) {
    o.normals = (batten_normal_weights)k;
    net_normals_make(c.ctx, &c.t, &o, c.normals);
    double worst = 0;
    for (size_t i = 0; i < c.t.nodes; i++)
      worst = fmax(worst, vec_distance(c.normals + 3 * i, c.mesh.points + (size_t)3 * c.t.node_vertex[i]));
    T_RATIO(worst, 4 * DBL_EPSILON, "octahedron, %s weights", weight_names[k]);
  }
  case_free(&c);

  c = case_make(scene_mesh_sphere_irregular(), 1);
  o.normals = BATTEN_NORMALS_SPHERE;
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  double worst = 0;
  for (size_t i = 0; i < c.t.nodes; i++)
    worst = fmax(worst, vec_distance(c.normals + 3 * i, c.mesh.points + (size_t)3 * c.t.node_vertex[i]));
  T_RATIO(worst, 100 * DBL_EPSILON, "sphere weights are exact on any mesh of a sphere");
  case_free(&c);
}

/* Normals of a mesh that was turned, scaled, and whose triangles and vertices were numbered anew. */
static void test_invariance(void) {
  batten_network_options o = case_options();
  for (int k = 0; k < 4; k++) {
    o.normals = (batten_normal_weights)k;
    network_case a = case_make(scene_mesh_graph_7(), 1), s, b;
    scene_mesh scaled = scene_mesh_graph_7(), turned = scene_mesh_graph_7();
    double r[3][3];
    size_t V = turned.vertices, F = turned.triangles;
    case_rotation(11, r);
    scene_mesh_scale(&scaled, 0x1p-30, 0x1p-30, 0x1p-30);
    for (size_t v = 0; v < V; v++) /* vertex v becomes V - 1 - v */
      case_rotate((const double(*)[3])r, a.mesh.points + 3 * v, turned.points + 3 * (V - 1 - v));
    for (size_t f = 0; f < F; f++)
      for (size_t i = 0; i < 3; i++)
        turned.corners[3 * f + i] = (uint32_t)(V - 1 - a.mesh.corners[3 * (F - 1 - f) + (i + 1) % 3]);
    s = case_make(scaled, 1);
    b = case_make(turned, 1);
    net_normals_make(a.ctx, &a.t, &o, a.normals);
    net_normals_make(s.ctx, &s.t, &o, s.normals);
    net_normals_make(b.ctx, &b.t, &o, b.normals);
    double worst = 0, size_worst = 0;
    for (size_t v = 0; v < V; v++) {
      double expected[3];
      case_rotate((const double(*)[3])r, a.normals + 3 * v, expected);
      worst = fmax(worst, vec_distance(expected, b.normals + 3 * (V - 1 - v)));
      size_worst = fmax(size_worst, vec_distance(a.normals + 3 * v, s.normals + 3 * v));
    }
    T_RATIO(worst, 20 * DBL_EPSILON, "%s weights turn with the mesh, whatever its numbers", weight_names[k]);
    T_RATIO(size_worst, 2 * DBL_EPSILON, "%s weights do not know the unit", weight_names[k]);
    case_free(&a);
    case_free(&s);
    case_free(&b);
  }
}

static void test_given(void) {
  network_case c = case_make(scene_mesh_icosphere(2), 1);
  size_t V = c.mesh.vertices;
  double *given = calloc(V, 3 * sizeof *given), *estimated = calloc(V, 3 * sizeof *estimated);
  batten_network_options o = case_options();
  net_normals_make(c.ctx, &c.t, &o, estimated);
  scene_point_set(given + 3, 0, 3e200, 4e200);
  o.normals_given = given;
  T_OK(net_normals_make(c.ctx, &c.t, &o, c.normals), c.ctx);
  const double unit[3] = {0, 0.6, 0.8};
  T_RATIO(vec_distance(c.normals + 3, unit), 2 * DBL_EPSILON, "a given normal is taken, whatever its length");
  memcpy(estimated + 3, c.normals + 3, 3 * sizeof *given);
  T_CHECK(memcmp(estimated, c.normals, V * 3 * sizeof *given) == 0, "others are estimated as ever");
  given[3 * 5 + 2] = NAN;
  T_STATUS(net_normals_make(c.ctx, &c.t, &o, c.normals), BATTEN_E_INVALID, c.ctx, "opt.normals_given[5][2]");
  free(given);
  free(estimated);
  case_free(&c);
}

static void test_threads(void) {
  network_case a = case_make(scene_mesh_icosphere(30), 1), b = case_make(scene_mesh_icosphere(30), 4);
  batten_network_options o = case_options();
  net_normals_make(a.ctx, &a.t, &o, a.normals);
  net_normals_make(b.ctx, &b.t, &o, b.normals);
  T_CHECK(memcmp(a.normals, b.normals, a.t.nodes * 3 * sizeof *a.normals) == 0, "same bits with 4 threads");
  case_free(&a);
  case_free(&b);
}

/* Triangles that cancel each other: a flat double fan has no normal of its own. */
static void test_cancelled(void) {
  static const double points[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, -1, -1, 0};
  static const uint32_t corners[12] = {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2};
  network_case c = case_make(scene_mesh_from(4, points, 4, corners), 1);
  batten_network_options o = case_options();
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  bool unit = true;
  for (size_t i = 0; i < 4; i++) unit &= fabs(vec_norm(c.normals + 3 * i) - 1) < 1e-15;
  T_CHECK(unit, "unit normals on a flat pillow");
  case_free(&c);
}

static void test_constraints(void) {
  uint64_t seed = 3;
  double creased = 0, unchanged = 0, corner = 0;
  bool sign = true, least = true;
  for (int trial = 0; trial < 1000; trial++) {
    net_constraint c = {.kind = NET_CREASED};
    double n[3], before[3], across[3];
    case_random_unit(&seed, n);
    case_random_unit(&seed, c.d[0]);
    case_random_unit(&seed, c.d[1]);
    vec_cross(c.d[0], c.d[1], across);
    if (vec_norm(across) < 0.05) continue;
    memcpy(before, n, sizeof n);
    net_normal_constrain(&c, n);
    creased = fmax(creased, fabs(vec_dot(n, c.d[0])) + fabs(vec_norm(n) - 1));
    /* the nearest vector of that plane lies in the plane of both */
    vec_cross(c.d[0], before, across);
    least &= fabs(vec_dot(across, n)) < 1e-12 * vec_norm(across) + 1e-14;
    memcpy(before, n, sizeof n);
    net_normal_constrain(&c, n);
    unchanged = fmax(unchanged, vec_distance(before, n));
    c.kind = NET_CORNER;
    net_normal_constrain(&c, n);
    corner = fmax(corner, fabs(vec_dot(n, c.d[0])) + fabs(vec_dot(n, c.d[1])));
    sign &= vec_dot(before, n) >= 0;
  }
  T_RATIO(creased, 4 * DBL_EPSILON, "a creased node's normal is orthogonal to the crease");
  T_CHECK(least, "and turned no further than that takes");
  T_RATIO(unchanged, 4 * DBL_EPSILON, "one that is stays");
  T_RATIO(corner, 100 * DBL_EPSILON, "a corner's is orthogonal to both");
  T_CHECK(sign, "and on the side of the triangles");
  net_constraint along = {.kind = NET_CREASED, .d = {{0, 0, 1}}};
  double n[3] = {0, 0, 1};
  net_normal_constrain(&along, n);
  T_CHECK(n[2] == 0 && fabs(vec_norm(n) - 1) < 1e-15, "a normal along the crease is replaced");

  /* through net_normals_make: the octahedron's top with a crease to (1, 0, 0.2) */
  network_case c = case_make(scene_mesh_octahedron(), 1);
  net_constraint *all = batten_alloc_array(c.ctx, c.t.nodes, sizeof *all);
  memset(all, 0, c.t.nodes * sizeof *all);
  all[4] = (net_constraint){.kind = NET_CREASED, .d = {{0.6, 0, 0.8}}};
  c.t.constraint = all;
  double given[18] = {0};
  given[3 * 4] = 1;
  batten_network_options o = case_options();
  o.normals_given = given;
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  const double expected[3] = {-0.8, 0, 0.6};
  T_RATIO(vec_distance(c.normals + 3 * 4, expected), 1e-15, "given normals do not count at creases");
  case_free(&c);
}

static double form_at(const double *x, double a, double b) { return x[2] * a * a + 2 * x[3] * a * b + x[4] * b * b; }

static double form_product(const double *x, const double *y) { return x[2] * y[2] + 2 * x[3] * y[3] + x[4] * y[4]; }

static void test_freedom(void) {
  uint64_t seed = 5;
  double creased = 0, corner = 0, least = 0;
  bool counts = true;
  for (int trial = 0; trial < 500; trial++) {
    net_constraint c = {.kind = NET_CREASED};
    double normal[3], origin[5], columns[5][5], x[5], n[3];
    unsigned dof;
    case_random_unit(&seed, c.d[0]);
    case_random_unit(&seed, c.d[1]);
    case_random_unit(&seed, normal);
    for (int side = 0; side < 2; side++) { /* curvature vectors are orthogonal to the curves */
      case_random_unit(&seed, c.k[side]);
      double part = vec_dot(c.k[side], c.d[side]);
      for (int k = 0; k < 3; k++) c.k[side][k] -= part * c.d[side][k];
    }
    net_node node;
    net_normal_constrain(&c, normal);
    net_frame(normal, c.d[0], &node);
    net_node_freedom(&c, &node, origin, columns, &dof);
    counts &= dof == 3;
    memcpy(x, origin, sizeof x);
    for (unsigned j = 0; j < dof; j++) {
      double y = 2 * t_uniform(&seed) - 1;
      for (int k = 0; k < 5; k++) x[k] += columns[k][j] * y;
    }
    /* normal and form of the surface with the slopes p, q: II(d0, d0) = (0, 0, r) . n */
    for (int k = 0; k < 3; k++) n[k] = node.w[k] - x[0] * node.u[k] - x[1] * node.v[k];
    vec_normalize(n);
    double bend = x[2] * vec_dot(n, node.w);
    creased = fmax(creased, fabs(vec_dot(n, c.d[0])) + fabs(bend - vec_dot(c.k[0], n)));

    c.kind = NET_CORNER;
    vec_cross(c.d[0], c.d[1], normal);
    double sine = vec_norm(normal);
    if (sine < 0.1) continue;
    vec_normalize(normal);
    net_frame(normal, NULL, &node);
    net_node_freedom(&c, &node, origin, columns, &dof);
    counts &= dof == 1;
    double free_form[5];
    for (int k = 0; k < 5; k++) {
      free_form[k] = columns[k][0];
      x[k] = origin[k] + 3 * free_form[k];
    }
    for (int side = 0; side < 2; side++)
      corner = fmax(corner, fabs(form_at(x, vec_dot(c.d[side], node.u), vec_dot(c.d[side], node.v)) -
                                 vec_dot(c.k[side], node.w)));
    least = fmax(least, fabs(form_product(origin, free_form)) / (1 + sqrt(form_product(origin, origin))));
    counts &= x[0] == 0 && x[1] == 0 && form_product(free_form, free_form) > 0.1;
  }
  T_CHECK(counts, "3 unknowns at a crease, 1 at a corner");
  T_RATIO(creased, 30 * DBL_EPSILON, "tangent and curvature of a crease are kept for any slope across it");
  T_RATIO(corner, 1e-13, "curvatures of both creases are kept at a corner");
  T_RATIO(least, 1e-13, "by the shortest form");

  net_node node;
  double origin[5], columns[5][5], w[3] = {0, 0, 1};
  unsigned dof;
  net_frame(w, NULL, &node);
  net_node_freedom(NULL, &node, origin, columns, &dof);
  bool identity = dof == 5;
  for (int i = 0; i < 5; i++)
    for (int j = 0; j < 5; j++) identity &= columns[i][j] == (i == j) && origin[i] == 0;
  T_CHECK(identity, "a free node has 5");
  net_constraint straight = {.kind = NET_CORNER, .d = {{1, 0, 0}, {-1, 0, 0}}, .k = {{0, 0, 1}, {0, 0, 3}}};
  net_node_freedom(&straight, &node, origin, columns, &dof);
  double a = vec_dot(straight.d[0], node.u), b = vec_dot(straight.d[0], node.v), worst = 0;
  worst = fabs(form_at(origin, a, b) - 2);
  for (unsigned j = 0; j < dof; j++) {
    double x[5];
    for (int k = 0; k < 5; k++) x[k] = columns[k][j];
    worst = fmax(worst, fabs(form_at(x, a, b)));
  }
  T_CHECK(dof == 2 && worst < 1e-15, "creases that go straight on count once, with their mean curvature: %.1e",
          worst);
}

static void test_curvature(void) {
  network_case c = case_make(scene_mesh_sphere_irregular(), 1);
  scene_mesh_scale(&c.mesh, 2, 2, 2);
  double worst = 0, turned = 0;
  for (size_t i = 0; i < c.t.nodes; i++) {
    double form[3], other[3];
    memcpy(c.normals + 3 * i, c.mesh.points + 3 * i, 3 * sizeof *c.normals);
    vec_normalize(c.normals + 3 * i);
    net_frame(c.normals + 3 * i, NULL, &c.nodes[i]);
    net_curvature_estimate(&c.t, (uint32_t)i, &c.nodes[i], form);
    worst = fmax(worst, fmax(fabs(form[0] + 0.5), fmax(fabs(form[1]), fabs(form[2] + 0.5))));
    net_curvature_estimate(&c.t, (uint32_t)i, &(net_node){0}, other);
    turned = fmax(turned, fabs(other[0]) + fabs(other[1]) + fabs(other[2]));
  }
  T_RATIO(worst, 1e-12, "the form of a sphere of radius 2 is -1/2");
  T_CHECK(turned == 0, "no direction, no curvature");
  case_free(&c);

  /* fewer than three directions: the shortest form, in any frame */
  c = case_make(scene_mesh_hinge(), 1);
  batten_network_options o = case_options();
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  worst = turned = 0;
  for (size_t i = 0; i < c.t.nodes; i++) {
    static const double along[3] = {0.3, -0.7, 0.2};
    net_node frame, other;
    c.normals[3 * i] += 0.2; /* from the ears' own planes, in which there is no curvature */
    vec_normalize(c.normals + 3 * i);
    double form[3], second[3], residual = 0;
    net_frame(c.normals + 3 * i, NULL, &frame);
    net_frame(c.normals + 3 * i, along, &other);
    net_curvature_estimate(&c.t, (uint32_t)i, &frame, form);
    net_curvature_estimate(&c.t, (uint32_t)i, &other, second);
    for (size_t j = 0; j < 4; j++) {
      if (j == i || (i + j == 3 && (i == 0 || j == 0))) continue; /* 0 and 3 share no edge */
      double e[3];
      vec_sub(c.mesh.points + 3 * j, c.mesh.points + 3 * i, e);
      double x = vec_dot(e, frame.u), y = vec_dot(e, frame.v), s = x * x + y * y;
      double wanted = 2 * vec_dot(e, frame.w) / vec_dot(e, e);
      if (i == 0 || i == 3)
        residual = fmax(residual, fabs((form[0] * x * x + 2 * form[1] * x * y + form[2] * y * y) / s - wanted));
      double p = vec_dot(e, other.u), q = vec_dot(e, other.v);
      turned = fmax(turned, fabs((form[0] * x * x + 2 * form[1] * x * y + form[2] * y * y) -
                                 (second[0] * p * p + 2 * second[1] * p * q + second[2] * q * q)));
    }
    worst = fmax(worst, residual);
  }
  T_RATIO(worst, 1e-12, "two directions are met exactly");
  T_RATIO(turned, 1e-13, "the form does not depend on the frame");
  case_free(&c);
}

int main(void) {
  test_frames();
  test_by_hand();
  test_invariance();
  test_given();
  test_threads();
  test_cancelled();
  test_constraints();
  test_freedom();
  test_curvature();
  return t_done();
}
