/* Directions at nodes that no tangent plane sees whole.
 *
 * Where a scan is folded, every plane at a vertex has some of its triangles with their backs up: projected edges come
 * in the wrong order, facets turn over between them, and normals of neighbours are opposite. A smooth surface can
 * pass there all the same, since its tangents need only be in the order of the edges: they leave as in the geodesic
 * polar map [Welch, Witkin 1994], at angles in proportion to those of the triangles at the vertex, turned to where
 * the projected edges are as near as can be. */
#include <string.h>

#include "base/checked.h"
#include "network/fan.h"
#include "network/normals.h"

enum { NODES_PER_TASK = 2048 };

static const double PI = 3.14159265358979323846;
/* Below this part of a triangle's size the plane of the most frontal normal shows nothing of it. */
static const double FOLDED = 0.02;

typedef struct folds_job {
  const net_topology *t;
  unsigned char *folded; /* [nodes] */
} folds_job;

static bool is_folded(const net_topology *t, uint32_t node) {
  double normal[3];
  if (t->constraint && t->constraint[node].kind != NET_FREE) return false;
  return net_normal_front(t, node, normal) < FOLDED;
}

static void find_folded(void *arg, size_t index) {
  const folds_job *job = arg;
  size_t end = index * NODES_PER_TASK + NODES_PER_TASK;
  for (size_t i = index * NODES_PER_TASK; i < end && i < job->t->nodes; i++)
    job->folded[i] = is_folded(job->t, (uint32_t)i);
}

/* Angle of the node's triangle behind h, which runs out of it. */
static double corner_angle(const net_topology *t, uint32_t h) {
  const double *p = t->points + (size_t)3 * t->triangles[h];
  double a[3], b[3], n[3];
  vec_sub(t->points + (size_t)3 * t->triangles[net_next(h)], p, a);
  vec_sub(t->points + (size_t)3 * t->triangles[net_prev(h)], p, b);
  vec_cross(a, b, n);
  return atan2(vec_norm(n), vec_dot(a, b));
}

/* Guides of all smooth edges of the node that have none. */
static void spread(net_topology *t, uint32_t node) {
  const double *p = t->points + (size_t)3 * t->node_vertex[node];
  double normal[3], total = 0, along = 0, across = 0, angle = 0;
  bool open = true;
  net_node frame;
  net_normal_front(t, node, normal);
  net_frame(normal, NULL, &frame);
  for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) {
    if (!s.in) total += corner_angle(t, s.half);
    open = s.in;
  }
  double scale = open ? fmin(1, 1.5 * PI / total) : 2 * PI / total;
  for (int pass = 0; pass < 2; pass++, angle = atan2(across, along))
    for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) {
      double c = cos(angle), d = sin(angle), e[3];
      vec_sub(t->points + (size_t)3 * net_spoke_vertex(t, s), p, e);
      if (!s.in) angle += scale * corner_angle(t, s.half);
      if (pass == 0) {
        double x = vec_dot(e, frame.u), y = vec_dot(e, frame.v);
        along += c * x + d * y;
        across += c * y - d * x;
        continue;
      }
      double *guide = t->guide + 3 * (2 * (size_t)t->edge[s.half] + net_spoke_end(t, s));
      if (t->kind[t->edge[s.half]] == NET_CREASE || vec_dot(guide, guide) > 0) continue;
      for (int k = 0; k < 3; k++) guide[k] = c * frame.u[k] + d * frame.v[k];
    }
}

batten_status net_folds_make(batten_context *ctx, net_topology *t) {
  batten_status st = BATTEN_OK;
  folds_job job = {t, batten_alloc_array(ctx, t->nodes, 1)};
  if (!job.folded) return BATTEN_E_NOMEM;
  batten_parallel(ctx, (t->nodes + NODES_PER_TASK - 1) / NODES_PER_TASK, find_folded, &job);
  for (size_t i = 0; i < t->nodes && st == BATTEN_OK; i++) {
    if (!job.folded[i]) continue;
    if (!t->guide) {
      t->guide = batten_alloc_array(ctx, t->edges, 6 * sizeof *t->guide);
      if (t->guide)
        memset(t->guide, 0, t->edges * 6 * sizeof *t->guide);
      else
        st = BATTEN_E_NOMEM;
    }
    if (st == BATTEN_OK) spread(t, (uint32_t)i);
  }
  batten_free(ctx, job.folded);
  return st;
}
