/* For the tests of the fills: a network's parts from a scene, and joints and curvatures of patches in plain arrays,
 * measured by nothing but evaluation. */
#ifndef NETWORK_CHECK_H
#define NETWORK_CHECK_H

#include "basis/triangular.h"
#include "network/net.h"
#include "network_scenes.h"
#include "tap.h"

typedef struct check_net {
  scene_mesh mesh;
  net_topology t;
  double *normals;  /* [nodes][3] */
  net_local *local; /* [edges] */
} check_net;

/* Options of the library's defaults but for the power of the weights. */
static inline batten_network_options check_options(double weight_power) {
  batten_network_options o = {.struct_size = sizeof o, .normal_passes = 30, .normal_tol_rad = 1e-6};
  o.weight_power = weight_power;
  o.field_weight = 0.32;
  o.corner_angle_deg = 60;
  return o;
}

static inline void check_net_free(batten_context *ctx, check_net *n) {
  net_topology_free(ctx, &n->t);
  free(n->normals);
  free(n->local);
  scene_mesh_free(&n->mesh);
}

/* Takes the scene over. optimise: by net_g1; else the estimated normals stay. */
static inline batten_status check_net_make(batten_context *ctx, scene_mesh mesh, const batten_network_options *opt,
                                           bool optimise, check_net *out) {
  *out = (check_net){.mesh = mesh};
  batten_status st = net_topology_make(ctx, mesh.vertices, mesh.points, mesh.triangles, mesh.corners, &out->t);
  if (st < 0) return st;
  out->normals = scene_allocate(3 * out->t.nodes * sizeof(double));
  out->local = scene_allocate(out->t.edges * sizeof *out->local);
  st = net_normals_make(ctx, &out->t, opt, out->normals);
  if (st < 0) return st;
  net_figures figures = {0};
  if (optimise) return net_g1(ctx, &out->t, opt, out->normals, out->local, &figures);
  net_node *nodes = scene_allocate(out->t.nodes * sizeof *nodes);
  memset(nodes, 0, out->t.nodes * sizeof *nodes);
  for (size_t i = 0; i < out->t.nodes; i++) net_frame(out->normals + 3 * i, NULL, nodes + i);
  for (uint32_t e = 0; e < out->t.edges; e++) net_tangent_edge(&out->t, opt, nodes, NULL, e, out->local + e);
  free(nodes);
  return BATTEN_OK;
}

/* Patches of one degree, parts (1 or 3) for each face. */
typedef struct check_patches {
  const net_topology *t;
  unsigned degree, parts;
  double (*net)[3];
} check_patches;

static inline check_patches check_patches_make(const net_topology *t, unsigned degree, unsigned parts) {
  check_patches p = {t, degree, parts, NULL};
  p.net = scene_allocate(t->faces * parts * triangular_count(degree) * sizeof *p.net);
  return p;
}
static inline double (*check_patch(const check_patches *p, size_t index))[3] {
  return p->net + index * triangular_count(p->degree);
}

static inline void check_evaluate(const check_patches *p, size_t patch, double u, double v, double jet[6][3],
                                  double normal[3]) {
  triangular_jet(p->degree, (const double(*)[3])check_patch(p, patch), u, v, 2, jet);
  vec_cross(jet[1], jet[2], normal);
}

/* At s along half-edge h from inside its face. */
static inline void check_edge(const check_patches *p, uint32_t h, double s, double point[3], double normal[3]) {
  double jet[6][3], bary[3] = {0};
  unsigned k = p->parts == 3 ? 0 : h % 3;
  bary[k] = 1 - s;
  bary[(k + 1) % 3] = s;
  check_evaluate(p, p->parts == 3 ? h : h / 3, bary[1], bary[2], jet, normal);
  memcpy(point, jet[0], sizeof jet[0]);
}

static inline double check_angle_deg(const double *a, const double *b) {
  double c[3];
  vec_cross(a, b, c);
  return atan2(vec_norm(c), vec_dot(a, b)) * (180 / SCENE_PI);
}

typedef struct check_figures {
  double jump_max, jump_rms, inner_max; /* degrees; 41 places on each edge */
  double gap_max;
  double K_min, K_max; /* on a grid of 15 rows on each patch, with edges and corners */
  double corner_gap, corner_normal_deg;
} check_figures;

static inline check_figures check_measure(const check_patches *p, const double *normals) {
  enum { SAMPLES = 41, ROWS = 15 };
  check_figures c = {.K_min = INFINITY, .K_max = -INFINITY};
  double squares = 0, count = 0;
  const net_topology *t = p->t;
  for (uint32_t h = 0; h < 3 * t->faces; h++) {
    double a[3], na[3], b[3], nb[3];
    check_edge(p, h, 0, a, na);
    const double *corner = t->points + 3 * (size_t)t->triangles[h];
    c.corner_gap = fmax(c.corner_gap, vec_distance(a, corner));
    c.corner_normal_deg = fmax(c.corner_normal_deg, check_angle_deg(na, normals + 3 * (size_t)t->node[h]));
    for (int i = 0; i < SAMPLES; i++) {
      double s = (double)i / (SAMPLES - 1);
      if (t->twin[h] != NET_NONE && t->twin[h] > h && t->kind[t->edge[h]] == NET_SMOOTH) {
        check_edge(p, h, s, a, na);
        check_edge(p, t->twin[h], 1 - s, b, nb);
        double jump = check_angle_deg(na, nb);
        c.gap_max = fmax(c.gap_max, vec_distance(a, b));
        c.jump_max = fmax(c.jump_max, jump);
        squares += jump * jump;
        count++;
      }
      if (p->parts == 3) { /* part k's edge to the inner point, and that of part k + 1 */
        double jet[6][3];
        check_evaluate(p, h, 1 - s, s, jet, na);
        memcpy(a, jet[0], sizeof a);
        check_evaluate(p, net_next(h), 0, s, jet, nb);
        c.gap_max = fmax(c.gap_max, vec_distance(a, jet[0]));
        c.inner_max = fmax(c.inner_max, check_angle_deg(na, nb));
      }
    }
  }
  c.jump_rms = count > 0 ? sqrt(squares / count) : 0;
  for (size_t patch = 0; patch < t->faces * p->parts; patch++)
    for (int i = 0; i < ROWS; i++)
      for (int j = 0; j + i < ROWS; j++) {
        double jet[6][3], n[3];
        check_evaluate(p, patch, (double)i / (ROWS - 1), (double)j / (ROWS - 1), jet, n);
        double square = vec_dot(n, n), m = vec_dot(n, jet[4]);
        double K = (vec_dot(n, jet[3]) * vec_dot(n, jet[5]) - m * m) / (square * square);
        c.K_min = fmin(c.K_min, K);
        c.K_max = fmax(c.K_max, K);
      }
  return c;
}

/* The corners and curves of a face, gathered without the library's own routine. */
static inline void check_cubics(const check_net *n, size_t face, double edges[3][4][3], double normal[3][3]) {
  const net_topology *t = &n->t;
  for (uint32_t k = 0; k < 3; k++) {
    uint32_t h = (uint32_t)(3 * face) + k, e = t->edge[h];
    unsigned back = t->half[e] != h;
    const double *a = t->points + 3 * (size_t)t->triangles[h], *b = t->points + 3 * (size_t)t->triangles[net_next(h)];
    for (int x = 0; x < 3; x++) {
      edges[k][0][x] = a[x];
      edges[k][1][x] = a[x] + n->local[e].t[back][x] / 3;
      edges[k][2][x] = b[x] + n->local[e].t[!back][x] / 3;
      edges[k][3][x] = b[x];
      normal[k][x] = n->normals[3 * (size_t)t->node[h] + (size_t)x];
    }
  }
}

#endif
