/* The certificate: measured joints, against another way of measuring, and made to fail in every way we can think of.
 */
#include "mesh/vec.h"
#include "network/surface.h"
#include "network_shapes.h"
#include "tap.h"

static const double DEGREES = 57.295779513082320877;

static void bump(const double xy[2], double out[3]) {
  double x = xy[0], y = xy[1];
  out[0] = x + 0.1 * x * y;
  out[1] = y;
  out[2] = 0.3 * x * x - 0.2 * x * y * y;
}

static batten_network_continuity measured(batten_context *ctx, const shape *s, unsigned samples) {
  batten_network *n = network_of(ctx, s);
  batten_network_continuity c;
  memset(&c, 0xff, sizeof c);
  T_OK(batten_network_measure_continuity(ctx, n, samples, &c), ctx);
  batten_network_free(n);
  return c;
}

static void test_smooth(batten_context *ctx) {
  for (unsigned split = 0; split < 4; split += 3) {
    shape s = shape_torus(split);
    batten_network_continuity c = measured(ctx, &s, 41);
    size_t inner = split ? 3 * (s.patches - s.faces) / 2 : 0;
    T_CHECK(c.smooth.edges == 3 * s.faces / 2 && c.inner.edges == inner && c.crease.edges == 0 &&
                c.boundary_edges == 0 && c.smooth.samples == 41 * c.smooth.edges,
            "torus: each edge once, %zu and %zu inside facets", c.smooth.edges, c.inner.edges);
    T_RATIO(fmax(c.smooth.normal_max_deg, c.inner.normal_max_deg), 1e-9, "normals of a C2 surface agree");
    T_RATIO(fmax(c.smooth.gap_max, fmax(c.inner.gap_max, c.corner_gap_max)), 1e-13, "so do points");
    T_RATIO(fmax(c.smooth.curvature_jump_max, c.inner.curvature_jump_max), 1e-9, "so do curvatures");
    shape_free(&s);
  }
  shape s = shape_graph(4, 4, 3, bump);
  s.creases = 1;
  memcpy(s.crease[0], (uint32_t[2]){7, 6}, 8);
  batten_network_continuity c = measured(ctx, &s, 9);
  T_CHECK(c.boundary_edges == 16 && c.crease.edges == 1 && c.smooth.edges == 39 && c.inner.edges == 33,
          "graph: boundary, a crease, the rest");
  T_RATIO(c.smooth.normal_max_deg + c.crease.normal_max_deg + c.inner.normal_max_deg, 1e-9, "with two degrees");
  shape_free(&s);
}

/* Faces of an octahedron meet at acos(1/3). */
static void test_by_hand(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network_continuity c = measured(ctx, &s, 2);
  double angle = DEGREES * acos(1 / 3.0);
  T_RATIO(fabs(c.smooth.normal_max_deg - angle) + fabs(c.smooth.normal_rms_deg - angle), 1e-12,
          "octahedron: max and rms");
  T_CHECK(c.smooth.gap_max == 0 && c.smooth.curvature_jump_max == 0 && c.corner_gap_max == 0, "no gap at all");
  T_CHECK(c.smooth.normal_p99_deg <= c.smooth.normal_max_deg && c.smooth.normal_p99_deg > 0.98 * angle, "p99 %g",
          c.smooth.normal_p99_deg);
  s.creases = 1;
  memcpy(s.crease[0], (uint32_t[2]){4, 2}, 8);
  c = measured(ctx, &s, 2);
  T_CHECK(c.crease.edges == 1 && c.smooth.edges == 11 && c.crease.worst_face[0] == 0 && c.crease.worst_face[1] == 1 &&
              c.crease.worst_corner == 1,
          "a crease counts apart, and is found at corner %u of face %u", c.crease.worst_corner,
          c.crease.worst_face[0]);
  s.control[0] = 1.25; /* corner 0 of face 0 moves off its vertex by 1/4 */
  c = measured(ctx, &s, 3);
  T_CHECK(c.corner_gap_max == 0.25 && c.smooth.gap_max == 0.25, "a corner off its vertex by 1/4");
  shape_free(&s);
}

typedef struct sums {
  double gap, gaps, angle, angles, jump, jumps, all[20000];
  size_t count;
} sums;
static int by_size(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}
static void other_way(batten_context *ctx, const batten_network *n, net_side a, net_side b, unsigned samples,
                      sums *s) {
  for (unsigned i = 0; i < samples; i++) {
    double t = (double)i / (samples - 1), left[2], right[2];
    net_side_place(a.side, t, left);
    net_side_place(b.side, 1 - t, right);
    batten_place places[2] = {{(uint32_t)a.patch, left[0], left[1]}, {(uint32_t)b.patch, right[0], right[1]}};
    batten_surface_point p[2];
    if (batten_network_evaluate(ctx, n, 2, places, p) < 0) exit(1);
    double cross[3];
    vec_cross(p[0].normal, p[1].normal, cross);
    double gap = vec_distance(p[0].point, p[1].point), jump = fabs(p[0].gauss - p[1].gauss);
    double angle = DEGREES * atan2(vec_norm(cross), vec_dot(p[0].normal, p[1].normal));
    s->gap = fmax(s->gap, gap);
    s->angle = fmax(s->angle, angle);
    s->jump = fmax(s->jump, jump);
    s->gaps += gap * gap;
    s->angles += angle * angle;
    s->jumps += jump * jump;
    s->all[s->count++] = angle;
  }
}
static double off(double a, double b) { return fabs(a - b) / fabs(b); }

/* Patches with all control points a little off, measured by evaluating both sides with another function. */
static void test_other_way(batten_context *ctx) {
  shape s = shape_torus(4);
  uint64_t seed = 11;
  for (size_t i = 0; i < 3 * TRIANGULAR_MAX * s.patches; i++)
    s.control[i] += pow(10, -1 - 8 * t_uniform(&seed)) * 0.1;
  batten_network *n = network_of(ctx, &s);
  batten_network_continuity c;
  T_OK(batten_network_measure_continuity(ctx, n, 17, &c), ctx);
  sums *edges = calloc(2, sizeof *edges);
  for (uint32_t h = 0; h < 3 * s.faces; h++) {
    net_side inner[2];
    if (h < n->twin[h]) other_way(ctx, n, net_surface_side(n, h), net_surface_side(n, n->twin[h]), 17, &edges[0]);
    if (net_surface_parts(n, h / 3) != 3) continue;
    net_surface_inner(n, h / 3, h % 3, inner);
    other_way(ctx, n, inner[0], inner[1], 17, &edges[1]);
  }
  for (int k = 0; k < 2; k++) {
    const batten_joint_figures *f = k ? &c.inner : &c.smooth;
    sums *e = &edges[k];
    double m = (double)e->count;
    T_CHECK(f->samples == e->count, "%zu samples", e->count);
    T_RATIO(off(f->gap_max, e->gap) + off(f->gap_rms, sqrt(e->gaps / m)), 1e-9, "gaps");
    T_RATIO(off(f->normal_max_deg, e->angle) + off(f->normal_rms_deg, sqrt(e->angles / m)), 1e-9, "angles");
    T_RATIO(off(f->curvature_jump_max, e->jump) + off(f->curvature_jump_rms, sqrt(e->jumps / m)), 1e-8, "jumps");
    qsort(e->all, e->count, sizeof *e->all, by_size);
    double p99 = e->all[e->count - 1 - e->count / 100];
    T_CHECK(f->normal_p99_deg >= p99 && f->normal_p99_deg <= 1.0157 * p99, "p99 %g, rounded up from %g",
            f->normal_p99_deg, p99);
  }
  free(edges);
  batten_network_free(n);
  shape_free(&s);
}

/* Angles too small for atan2 of rounded normals to be of use, and those of the series' border. */
static void test_small_angles(batten_context *ctx) {
  for (int k = 1; k < 12; k++) {
    double angle = pow(10, -k);
    shape s = shape_graph(1, 1, 0, bump);
    const double corners[2][9] = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 0, 1, 0}};
    for (int f = 0; f < 2; f++) memcpy(s.control + f * 3 * TRIANGULAR_MAX, corners[f], sizeof corners[f]);
    /* The second triangle turned about the diagonal. */
    double *apex = s.control + 3 * TRIANGULAR_MAX + 6, h = sqrt(0.5);
    apex[0] = 0.5 - 0.5 * cos(angle);
    apex[1] = 0.5 + 0.5 * cos(angle);
    apex[2] = h * sin(angle);
    batten_network_continuity c = measured(ctx, &s, 2);
    T_RATIO(fabs(c.smooth.normal_max_deg / DEGREES - angle), 4e-16 + 1e-12 * angle, "a bend of 1e-%d", k);
    shape_free(&s);
  }
}

static void test_lies(batten_context *ctx) {
  /* A patch that was never written. */
  shape s = shape_octahedron();
  batten_network *n = NULL;
  batten_network_continuity c;
  T_OK(net_surface_new(ctx, 6, s.points, 8, s.triangles, NULL, 0, NULL, 1, 1, &n), ctx);
  for (size_t p = 0; p < 8; p++) memcpy(net_surface_points(n, p), s.patch[p].control_points, 72);
  for (int number = 0; number < 9; number++) {
    double *x = net_surface_points(n, 5)[0] + number, keep = *x;
    *x = number % 2 ? NAN : INFINITY;
    if (batten_network_measure_continuity(ctx, n, 9, &c) < 0) exit(1);
    T_CHECK(c.smooth.gap_max == INFINITY && c.smooth.gap_rms == INFINITY && c.corner_gap_max == INFINITY &&
                c.smooth.normal_max_deg == 180,
            "number %d of a patch not finite: infinite gaps, 180 degrees", number);
    *x = keep;
  }
  batten_network_free(n);
  shape_free(&s);

  s = shape_graph(1, 9, 0, bump);
  T_OK(net_surface_new(ctx, 4, s.points, 2, s.triangles, NULL, 0, NULL, 9, 1, &n), ctx);
  for (size_t p = 0; p < 2; p++) memcpy(net_surface_points(n, p), s.patch[p].control_points, 55 * 24);
  net_surface_points(n, 1)[triangular_index(9, 3, 3)][1] = NAN; /* three rows from every edge */
  T_OK(batten_network_measure_continuity(ctx, n, 9, &c), ctx);
  T_CHECK(c.corner_gap_max == INFINITY && c.smooth.normal_max_deg < 1e-9, "a point inside that no edge sees");
  batten_network_free(n);
  shape_free(&s);

  /* Control points in another order: turned by a corner. */
  s = shape_torus(0);
  double *net = s.control + 17 * 3 * TRIANGULAR_MAX, copy[28][3];
  memcpy(copy, net, sizeof copy);
  for (unsigned k = 0; k <= 6; k++)
    for (unsigned j = 0; j + k <= 6; j++)
      memcpy(net + 3 * triangular_index(6, j, k), copy[triangular_index(6, k, 6 - j - k)], 24);
  c = measured(ctx, &s, 9);
  T_CHECK(c.smooth.gap_max > 0.1 && c.corner_gap_max > 0.1, "a patch turned by a corner: a gap of %.2g",
          c.smooth.gap_max);
  /* Mirrored: the same points, inside out. */
  for (unsigned k = 0; k <= 6; k++)
    for (unsigned j = 0; j + k <= 6; j++)
      memcpy(net + 3 * triangular_index(6, j, k), copy[triangular_index(6, k, j)], 24);
  c = measured(ctx, &s, 9);
  T_CHECK(c.smooth.normal_max_deg > 170 || c.smooth.gap_max > 0.1, "a patch inside out: gap %.2g", c.smooth.gap_max);
  shape_free(&s);

  /* Folded back flat onto its neighbour: the tangent planes agree, the normals do not. */
  s = shape_graph(1, 1, 0, bump);
  const double folded[2][9] = {{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 1, 0.25, 0}};
  for (int f = 0; f < 2; f++) memcpy(s.control + f * 3 * TRIANGULAR_MAX, folded[f], sizeof folded[f]);
  c = measured(ctx, &s, 2);
  T_RATIO(180 - c.smooth.normal_max_deg, 1e-12, "a fold counts 180 degrees");
  shape_free(&s);

  /* No normal at a corner: two control points at one place. */
  s = shape_graph(2, 4, 0, bump);
  memcpy(s.control + 3, s.control, 24);
  c = measured(ctx, &s, 9);
  T_CHECK(c.smooth.normal_max_deg == 180 && c.smooth.curvature_jump_max == INFINITY,
          "no normal at a corner: 180 degrees");
  shape_free(&s);
  s = shape_octahedron();
  memset(s.control, 0, 72);
  c = measured(ctx, &s, 2);
  T_CHECK(c.smooth.normal_max_deg == 180 && c.smooth.gap_max == 1, "a patch that is a point: 180 degrees");
  shape_free(&s);

  /* One control point of one patch off by 1e-8, next to an edge, between the ends. */
  s = shape_torus(0);
  for (unsigned side = 0; side < 3; side++) {
    double *x = s.control + 40 * 3 * TRIANGULAR_MAX + 3 * net_side_index(6, side, 1, 2);
    x[2] += 1e-8;
    c = measured(ctx, &s, 9);
    T_CHECK(c.smooth.normal_max_deg > 1e-9 && c.smooth.gap_max < 1e-13 &&
                (c.smooth.worst_face[0] == 40 || c.smooth.worst_face[1] == 40),
            "a point off by 1e-8: %.2g degrees, at its face", c.smooth.normal_max_deg);
    x[2] -= 1e-8;
  }
  shape_free(&s);
}

static void test_units(batten_context *ctx, batten_context *three) {
  shape s[3];
  batten_network_continuity c[4];
  for (int i = 0; i < 3; i++) {
    s[i] = shape_torus(4);
    uint64_t seed = 1;
    for (size_t k = 0; k < 3 * TRIANGULAR_MAX * s[i].patches; k++) s[i].control[k] += 1e-3 * t_uniform(&seed);
  }
  shape_move(&s[1], false, 0x1p-90, (double[3]){0, 0, 0});
  shape_move(&s[2], true, 1, (double[3]){3, 4, 5});
  for (int i = 0; i < 3; i++) c[i] = measured(ctx, &s[i], 9);
  c[3] = measured(three, &s[0], 9);
  T_CHECK(
      !memcmp(&c[0].smooth, &c[3].smooth, sizeof c[0].smooth) && !memcmp(&c[0].inner, &c[3].inner, sizeof c[0].inner),
      "the same bits on three threads");
  T_CHECK(c[0].smooth.normal_max_deg == c[1].smooth.normal_max_deg &&
              c[0].smooth.normal_rms_deg == c[1].smooth.normal_rms_deg &&
              ldexp(c[0].smooth.gap_max, -90) == c[1].smooth.gap_max &&
              ldexp(c[0].inner.curvature_jump_rms, 180) == c[1].inner.curvature_jump_rms,
          "2^-90 times as large: the same angles to the bit");
  T_RATIO(off(c[2].smooth.normal_max_deg, c[0].smooth.normal_max_deg) +
              off(c[2].smooth.gap_rms, c[0].smooth.gap_rms) +
              off(c[2].smooth.curvature_jump_max, c[0].smooth.curvature_jump_max),
          1e-9, "turned and moved: the same figures");
  for (int i = 0; i < 3; i++) shape_free(&s[i]);
}

static batten_status measure_torus(batten_context *ctx, void *arg) {
  batten_network *n = NULL;
  batten_network_continuity c;
  batten_status st = shape_network(ctx, arg, &n);
  if (st == BATTEN_OK) st = batten_network_measure_continuity(ctx, n, 5, &c);
  batten_network_free(n);
  return st;
}

static void test_bad(batten_context *ctx) {
  shape s = shape_octahedron();
  batten_network *n = network_of(ctx, &s);
  batten_network_continuity c;
  T_CHECK(batten_network_measure_continuity(NULL, n, 9, &c) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_network_measure_continuity(ctx, NULL, 9, &c), BATTEN_E_INVALID, ctx, "network: NULL");
  T_STATUS(batten_network_measure_continuity(ctx, n, 9, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_network_measure_continuity(ctx, n, 1, &c), BATTEN_E_INVALID, ctx, "samples: 1; give 2 to 1000");
  T_STATUS(batten_network_measure_continuity(ctx, n, 1001, &c), BATTEN_E_INVALID, ctx, "samples: 1001");
  T_OK(batten_network_measure_continuity(ctx, n, 1000, &c), ctx);
  T_CHECK(c.smooth.samples == 12000 && c.inner.edges == 0 && c.inner.worst_face[0] == UINT32_MAX,
          "1000 samples; no inner edges");
  batten_network_free(n);
  T_OK(batten_network_create(ctx, 0, NULL, 0, NULL, 0, NULL, 0, NULL, &n), ctx);
  T_OK(batten_network_measure_continuity(ctx, n, 9, &c), ctx);
  T_CHECK(c.smooth.edges == 0 && c.corner_gap_max == 0, "nothing at all");
  batten_network_free(n);
  shape_free(&s);
  s = shape_torus(4);
  t_fail_every_allocation("batten_network_measure_continuity", measure_torus, &s);
  t_cancel_every_progress("batten_network_measure_continuity", measure_torus, &s);
  shape_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1), *three = t_context(NULL, NULL, 3);
  test_by_hand(ctx);
  test_smooth(ctx);
  test_other_way(ctx);
  test_small_angles(ctx);
  test_lies(ctx);
  test_units(ctx, three);
  test_bad(ctx);
  batten_context_free(three);
  batten_context_free(ctx);
  return t_done();
}
