/* Local parameters of edges: directions, lengths, guides, creases, substitutes. */
#include <float.h>

#include "network_case.h"

typedef struct edge_case {
  double chord[3], normal[2][3];
} edge_case;

static edge_case random_edge(uint64_t *seed) {
  edge_case e;
  double turn[3];
  case_random_unit(seed, e.chord);
  double length = 0.5 + t_uniform(seed);
  do case_random_unit(seed, e.normal[0]);
  while (fabs(vec_dot(e.normal[0], e.chord)) > 0.6);
  do { /* within about 50 degrees of each other */
    case_random_unit(seed, turn);
    for (int k = 0; k < 3; k++) e.normal[1][k] = e.normal[0][k] + 0.8 * turn[k];
    vec_normalize(e.normal[1]);
  } while (fabs(vec_dot(e.normal[1], e.chord)) > 0.7);
  for (int k = 0; k < 3; k++) e.chord[k] *= length;
  return e;
}

static bool tangent(batten_network_direction d, batten_network_length l, const edge_case *e, const double *curvature,
                    net_local *out) {
  return net_tangent(d, l, e->chord, e->normal[0], e->normal[1], NULL, curvature, NULL, out);
}

static double worst_difference(const net_local *a, const net_local *b) {
  double worst = 0;
  for (int end = 0; end < 2; end++)
    worst = fmax(worst, vec_distance(a->t[end], b->t[end]) + vec_distance(a->s[end], b->s[end]));
  return worst;
}

/* The end points of an arc of a circle in the plane of x and z, half angle th to each side of the top. */
static edge_case arc(double radius, double th) {
  edge_case e = {.chord = {2 * radius * sin(th), 0, 0}, .normal = {{-sin(th), 0, cos(th)}, {sin(th), 0, cos(th)}}};
  return e;
}

static void test_by_hand(void) {
  const batten_network_length lengths[] = {BATTEN_LENGTH_L1, BATTEN_LENGTH_L2, BATTEN_LENGTH_L3, BATTEN_LENGTH_L4};
  const double flat[2] = {0, 0};
  double worst = 0;
  bool substitute = false;
  for (int d = 0; d < 2; d++)
    for (int l = 0; l < 4; l++) {
      edge_case e = {.chord = {2, 1, 0}, .normal = {{0, 0, 1}, {0, 0, 1}}};
      net_local out, expected = {.t = {{2, 1, 0}, {-2, -1, 0}}};
      substitute |= tangent((batten_network_direction)d, lengths[l], &e, flat, &out);
      worst = fmax(worst, worst_difference(&out, &expected));
    }
  T_RATIO(worst, 8 * DBL_EPSILON, "in a plane every choice is the edge itself");
  T_CHECK(!substitute, "and none a substitute");

  for (int d = 0; d < 2; d++)
    for (int l = 0; l < 4; l++) {
      double radius = 1.5, th = 0.6, curvature[2] = {-1 / radius, -1 / radius};
      /* the closed form of the symmetric planar case, (d0 x d1) = sin 2 th */
      double handle = radius * (sqrt(pow(sin(2 * th), 2) + 12 * pow(sin(th), 2)) - sin(2 * th));
      double expected[4] = {2 * radius * sin(th), 2 * radius * th, handle, handle};
      edge_case e = arc(radius, th);
      net_local out;
      bool taken = tangent((batten_network_direction)d, lengths[l], &e, curvature, &out);
      double along[3] = {cos(th), 0, sin(th)}, back[3] = {-cos(th), 0, sin(th)};
      double off = case_angle(out.t[0], along) + case_angle(out.t[1], back);
      double size = fabs(vec_norm(out.t[0]) - expected[l]) + fabs(vec_norm(out.t[1]) - expected[l]);
      T_RATIO(off + size, 30 * DBL_EPSILON, "arc of a circle, D%d L%d", d ? 1 : 2, l + 1);
      T_CHECK(!taken, "no substitute");
    }
  edge_case nearly = arc(1, 5e-5);
  net_local out;
  tangent(BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, &nearly, NULL, &out);
  T_RATIO(fabs(vec_norm(out.t[0]) / 1e-4 - 1), 4 * DBL_EPSILON, "length of a nearly straight arc");
}

static void test_directions(void) {
  uint64_t seed = 21;
  double planar = 0, projected = 0, orthogonal = 0, symmetric = 0, forward = INFINITY, turned = 0, scaled = 0;
  double r[3][3];
  case_rotation(4, r);
  for (int trial = 0; trial < 2000; trial++) {
    edge_case e = random_edge(&seed), back = e, rotated, small = e;
    net_local a, b;
    double cross[3];
    for (int k = 0; k < 3; k++) {
      back.chord[k] = -e.chord[k];
      small.chord[k] = 0x1p-40 * e.chord[k];
    }
    memcpy(back.normal[0], e.normal[1], sizeof cross);
    memcpy(back.normal[1], e.normal[0], sizeof cross);
    case_rotate((const double(*)[3])r, e.chord, rotated.chord);
    for (int k = 0; k < 2; k++) case_rotate((const double(*)[3])r, e.normal[k], rotated.normal[k]);
    for (int d = 0; d < 2; d++)
      for (int l = 0; l < 2; l++) {
        batten_network_direction direction = d ? BATTEN_DIRECTION_D1 : BATTEN_DIRECTION_D2;
        batten_network_length length = l ? BATTEN_LENGTH_L1 : BATTEN_LENGTH_L2;
        tangent(direction, length, &e, NULL, &a);
        tangent(direction, length, &back, NULL, &b);
        symmetric = fmax(symmetric, vec_distance(a.t[0], b.t[1]) + vec_distance(a.t[1], b.t[0]));
        for (int end = 0; end < 2; end++) {
          orthogonal = fmax(orthogonal, fabs(vec_dot(a.t[end], e.normal[end])));
          forward = fmin(forward, (end ? -1 : 1) * vec_dot(a.t[end], e.chord));
          vec_cross(e.chord, e.normal[end], cross);
          if (d) projected = fmax(projected, fabs(vec_dot(cross, a.t[end])));
        }
        vec_cross(a.t[0], a.t[1], cross);
        if (!d) planar = fmax(planar, fabs(vec_dot(cross, e.chord)));
        tangent(direction, length, &small, NULL, &b);
        for (int k = 0; k < 6; k++) scaled = fmax(scaled, fabs(0x1p40 * (&b.t[0][0])[k] - (&a.t[0][0])[k]));
        tangent(direction, length, &rotated, NULL, &b);
        for (int end = 0; end < 2; end++) {
          case_rotate((const double(*)[3])r, a.t[end], cross);
          turned = fmax(turned, vec_distance(cross, b.t[end]));
        }
      }
  }
  T_RATIO(orthogonal, 30 * DBL_EPSILON, "t lies in the tangent plane");
  T_RATIO(planar, 50 * DBL_EPSILON, "D2: the curve lies in a plane");
  T_RATIO(projected, 30 * DBL_EPSILON, "D1: t lies above the edge");
  T_CHECK(forward > 0, "every direction goes forward");
  T_CHECK(symmetric == 0, "the edge run backward gives the same bits");
  T_CHECK(scaled == 0, "2^-40 times the edge gives 2^-40 times the t, to the bit");
  T_RATIO(turned, 1e-13, "t turns with the edge");
}

/* Where the equations have a solution near the arc, the cubic has the curvatures asked for. */
static void test_curvatures(void) {
  uint64_t seed = 8;
  double worst = 0, second = 0, planar_worst = 0;
  int solved = 0, trials = 1000;
  for (int trial = 0; trial < trials; trial++) {
    edge_case e = random_edge(&seed);
    net_local out, plain, three;
    for (int d = 0; d < 2; d++) {
      batten_network_direction direction = d ? BATTEN_DIRECTION_D1 : BATTEN_DIRECTION_D2;
      /* curvatures near those of arcs that touch the planes */
      double curvature[2];
      for (int end = 0; end < 2; end++)
        curvature[end] = (end ? -2 : 2) * vec_dot(e.normal[end], e.chord) / vec_dot(e.chord, e.chord) +
                         0.1 * (t_uniform(&seed) - 0.5);
      bool substitute = tangent(direction, BATTEN_LENGTH_L4, &e, curvature, &out);
      tangent(direction, BATTEN_LENGTH_L2, &e, NULL, &plain);
      bool other = tangent(direction, BATTEN_LENGTH_L3, &e, curvature, &three);
      planar_worst = fmax(planar_worst, vec_distance(out.t[0], three.t[0]) + vec_norm(three.s[0]));
      planar_worst = fmax(planar_worst, other != substitute);
      if (substitute) {
        second = fmax(second, worst_difference(&out, &plain));
        continue;
      }
      solved++;
      for (int end = 0; end < 2; end++) {
        double bend[3], tt = vec_dot(out.t[end], out.t[end]);
        for (int k = 0; k < 3; k++)
          bend[k] = 6 * (end ? -e.chord[k] : e.chord[k]) - 4 * out.t[end][k] + 2 * out.t[!end][k];
        double part = vec_dot(bend, e.normal[end]);
        worst = fmax(worst, fabs(part / tt - curvature[end]));
        for (int k = 0; k < 3; k++) bend[k] -= part * e.normal[end][k];
        second = fmax(second, vec_distance(bend, out.s[end]));
      }
    }
  }
  printf("# %d of %d edges have such a cubic\n", solved, 2 * trials);
  T_CHECK(solved > trials / 2, "most of them");
  T_RATIO(worst, 1e-9, "normal curvatures of the cubic");
  T_RATIO(second, 1e-12, "s is its second derivative's tangential part; others have L2 and s = 0");
  T_CHECK(planar_worst == 0, "L3 has the lengths of L4, and s = 0");
}

static void test_substitutes(void) {
  const edge_case upright = {.chord = {0, 0, 2}, .normal = {{0, 0, 1}, {0, 1, 0}}};
  const double fallback[2][3] = {{3, 4, 7}, {1, 0, 0}};
  for (int d = 0; d < 2; d++) {
    net_local out;
    bool taken = net_tangent(d ? BATTEN_DIRECTION_D1 : BATTEN_DIRECTION_D2, BATTEN_LENGTH_L1, upright.chord,
                             upright.normal[0], upright.normal[0], NULL, NULL, fallback, &out);
    const double expected[3] = {1.2, 1.6, 0};
    T_CHECK(taken && vec_distance(out.t[0], expected) < 1e-15,
            "D%d: an edge along the normal leaves along the triangles", d ? 1 : 2);
    taken = net_tangent(d ? BATTEN_DIRECTION_D1 : BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, upright.chord,
                        upright.normal[0], upright.normal[0], NULL, NULL, NULL, &out);
    T_CHECK(taken && out.t[0][2] == 0 && vec_norm(out.t[0]) > 2 && vec_norm(out.t[0]) < 4, "somewhere without them");
  }
  net_local out, mixed;
  bool taken = net_tangent(BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, upright.chord, upright.normal[0], upright.normal[1],
                           NULL, NULL, fallback, &out);
  T_CHECK(taken && case_angle(out.t[0], (double[]){3, 4, 0}) < 1e-15 &&
              case_angle(out.t[1], (double[]){0, 0, -1}) < 1e-15,
          "D2 has no forward at an end where the normal is along the edge, the other end keeps its plane");
  const double opposite[3] = {0, 0, -1}, normal[3] = {0, 0, 1}, chord[3] = {1, 0, 0};
  taken = net_tangent(BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, chord, normal, opposite, NULL, NULL, NULL, &out);
  net_tangent(BATTEN_DIRECTION_D1, BATTEN_LENGTH_L2, chord, normal, opposite, NULL, NULL, NULL, &mixed);
  T_CHECK(taken && worst_difference(&out, &mixed) == 0, "opposite normals have no plane: D1");
}

static void test_guides(void) {
  uint64_t seed = 2;
  double off = 0, free_end = 0;
  for (int trial = 0; trial < 500; trial++) {
    edge_case e = random_edge(&seed);
    double guide[2][3] = {{0}}, part;
    net_local out, plain;
    case_random_unit(&seed, guide[0]);
    part = vec_dot(guide[0], e.normal[0]);
    if (fabs(part) > 0.99) continue;
    net_tangent(BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, e.chord, e.normal[0], e.normal[1], (const double(*)[3])guide,
                NULL, NULL, &out);
    tangent(BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, &e, NULL, &plain);
    for (int k = 0; k < 3; k++) guide[0][k] -= part * e.normal[0][k];
    off = fmax(off, case_angle(out.t[0], guide[0]));
    free_end = fmax(free_end, vec_distance(out.t[1], plain.t[1]));
  }
  T_RATIO(off, 1e-13, "curves leave along their guides' projections");
  T_CHECK(free_end == 0, "ends without a guide do not feel the other's");
  const double guide[2][3] = {{-1, 0, 0}}, normal[3] = {0, 0, 1}, chord[3] = {2, 0, 0};
  net_local out;
  net_tangent(BATTEN_DIRECTION_D2, BATTEN_LENGTH_L2, chord, normal, normal, guide, NULL, NULL, &out);
  T_RATIO(fabs(vec_norm(out.t[0]) - 2 * 2.6 / sin(2.6)), 1e-14, "a guide that turns back makes no endless arc");
}

/* Two triangles on a crease with tangents of its own at both ends. */
static void test_creases(void) {
  uint64_t seed = 12;
  for (int l = 0; l < 4; l++) {
    network_case c = case_make(scene_mesh_hinge(), 1);
    net_constraint constraint[6] = {{.kind = NET_FREE}};
    double guides[5][2][3] = {{{0}}}, forms[18];
    uint32_t e = c.t.edge[1], nodes[6];
    T_CHECK(c.t.kind[e] == NET_SMOOTH, "the edge between the two triangles");
    c.t.kind[e] = NET_CREASE;
    /* 1 and 2 have nodes of their own on the second triangle, whose corners are 2 1 3 */
    memcpy(nodes, c.t.node, sizeof nodes);
    c.t.node[3] = 4;
    c.t.node[4] = 5;
    memcpy(guides[e][0], (double[]){-0.5, 0.7, 0.5}, sizeof guides[e][0]);
    memcpy(guides[e][1], (double[]){0.8, -0.5, 0.1}, sizeof guides[e][1]);
    c.t.guide = &guides[0][0][0];
    c.t.constraint = constraint;
    batten_network_options o = case_options();
    const batten_network_length lengths[] = {BATTEN_LENGTH_L1, BATTEN_LENGTH_L2, BATTEN_LENGTH_L3, BATTEN_LENGTH_L4};
    o.length = lengths[l];
    net_local out, first;
    net_node frames[6];
    bool same = true;
    double off = 0;
    const double *start = c.t.points + (size_t)3 * c.t.triangles[c.t.half[e]];
    const double *end = c.t.points + (size_t)3 * c.t.triangles[net_next(c.t.half[e])];
    for (int k = 0; k < 18; k++) forms[k] = t_uniform(&seed);
    for (int trial = 0; trial < 20; trial++) {
      for (int i = 0; i < 6; i++) { /* normals orthogonal to the crease where there is one */
        double normal[3];
        case_random_unit(&seed, normal);
        bool at_start = i == 1 || i == 5, crease = at_start || i == 2 || i == 4;
        const double *d = guides[e][at_start ? 0 : 1];
        constraint[i].kind = crease ? NET_CREASED : NET_FREE;
        memcpy(constraint[i].d[0], d, 3 * sizeof *d);
        double part = crease ? vec_dot(d, normal) / vec_dot(d, d) : 0;
        for (int k = 0; k < 3; k++) normal[k] -= part * d[k];
        vec_normalize(normal);
        net_frame(normal, crease ? d : NULL, &frames[i]);
      }
      net_tangent_edge(&c.t, &o, frames, forms, e, &out);
      if (trial == 0) first = out;
      same &= memcmp(&first, &out, sizeof out) == 0;
      off = fmax(off, case_angle(out.t[0], guides[e][0]) + case_angle(out.t[1], guides[e][1]));
    }
    T_CHECK(same, "L%d: no bit of a crease's t depends on the normals at its sides", l + 1);
    T_RATIO(off, 1e-15, "it is along the crease's tangents");
    if (l == 0) {
      T_RATIO(fabs(vec_norm(out.t[0]) - vec_distance(start, end)), 1e-15, "as long as the edge");
    } else {
      T_CHECK(vec_norm(out.t[0]) > vec_distance(start, end), "longer than the edge");
    }
    memcpy(c.t.node, nodes, sizeof nodes);
    c.t.guide = NULL;
    c.t.constraint = NULL;
    case_free(&c);
  }
}

/* Edges of a mesh: as single ones with the same data; those that stand upright leave between the triangles. */
static void test_edges(void) {
  network_case c = case_make(scene_mesh_blob(2, 0.1), 1);
  batten_network_options o = case_options();
  double *forms = calloc(c.t.nodes, 3 * sizeof *forms);
  net_normals_make(c.ctx, &c.t, &o, c.normals);
  case_frames(&c);
  for (size_t i = 0; i < c.t.nodes; i++) net_curvature_estimate(&c.t, (uint32_t)i, &c.nodes[i], forms + 3 * i);
  for (int l = 0; l < 4; l++) {
    const batten_network_length lengths[] = {BATTEN_LENGTH_L1, BATTEN_LENGTH_L2, BATTEN_LENGTH_L3, BATTEN_LENGTH_L4};
    bool same = true;
    o.length = lengths[l];
    for (size_t e = 0; e < c.t.edges; e++) {
      net_local out, single;
      uint32_t i = net_edge_node(&c.t, (uint32_t)e, 0, 0), j = net_edge_node(&c.t, (uint32_t)e, 1, 0);
      double chord[3], curvature[2];
      vec_sub(c.t.points + (size_t)3 * c.t.node_vertex[j], c.t.points + (size_t)3 * c.t.node_vertex[i], chord);
      bool first = net_tangent_edge(&c.t, &o, c.nodes, forms, (uint32_t)e, &out);
      for (int end = 0; end < 2; end++) {
        const net_node *n = &c.nodes[end ? j : i];
        const double *f = forms + (size_t)3 * (end ? j : i);
        double a = vec_dot(out.t[end], n->u), b = vec_dot(out.t[end], n->v);
        curvature[end] = (f[0] * a * a + 2 * f[1] * a * b + f[2] * b * b) / (a * a + b * b);
      }
      bool second =
          net_tangent(o.direction, o.length, chord, c.nodes[i].w, c.nodes[j].w, NULL, curvature, NULL, &single);
      same &= first == second && worst_difference(&out, &single) < 1e-12;
    }
    T_CHECK(same, "L%d: edges of a mesh as single ones", l + 1);
  }
  double chord[3];
  vec_sub(c.t.points + (size_t)3 * c.t.node_vertex[net_edge_node(&c.t, 0, 1, 0)],
          c.t.points + (size_t)3 * c.t.node_vertex[net_edge_node(&c.t, 0, 0, 0)], chord);
  vec_normalize(chord);
  for (int end = 0; end < 2; end++) net_frame(chord, NULL, &c.nodes[net_edge_node(&c.t, 0, (unsigned)end, 0)]);
  net_local out;
  o.length = BATTEN_LENGTH_L2;
  bool taken = net_tangent_edge(&c.t, &o, c.nodes, NULL, 0, &out);
  T_CHECK(taken && fabs(vec_dot(out.t[0], chord)) < 1e-14 && vec_norm(out.t[0]) > 0, "an upright edge is told");
  uint32_t h = c.t.half[0];
  double toward = 0;
  for (int side = 0; side < 2; side++, h = c.t.twin[h]) {
    double side_edge[3];
    vec_sub(c.t.points + (size_t)3 * c.t.triangles[net_prev(h)], c.t.points + (size_t)3 * c.t.triangles[c.t.half[0]],
            side_edge);
    toward += vec_dot(side_edge, out.t[0]);
  }
  T_CHECK(toward > 0, "and leaves between the triangles");
  free(forms);
  case_free(&c);
}

int main(void) {
  test_by_hand();
  test_directions();
  test_curvatures();
  test_substitutes();
  test_guides();
  test_creases();
  test_edges();
  return t_done();
}
