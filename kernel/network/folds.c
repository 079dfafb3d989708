/* Directions at nodes where projected edges are out of order.
 *
 * Where a scan is folded, every plane at a vertex has some of its triangles with their backs up: projected edges come
 * in the wrong order, facets turn over between them, and normals of neighbours are opposite. A smooth surface can
 * pass there all the same, since its tangents need only be in the order of the edges: they leave as in the geodesic
 * polar map [Welch, Witkin 1994], at angles in proportion to those of the triangles at the vertex, turned to where
 * the projected edges are as near as can be.
 *
 * A sector between creases has tangents at its sides that do not go by the edges inside. Where a rim of few vertices
 * turns, or triangles are thin, the rim's tangent passes the next edge, and the facet between them turns over. There
 * the edges inside share the angle between the two tangents likewise. */
#include <string.h>

#include "base/checked.h"
#include "network/fan.h"
#include "network/normals.h"

enum { NODES_PER_TASK = 2048 };

static const double PI = 3.14159265358979323846;
/* Below this part of a triangle's size the plane of the most frontal normal shows nothing of it. */
static const double FOLDED = 0.02;
/* What must be left between the projections of neighbours in a sector, of their share of its angle. */
static const double SECTOR_SHARE = 0.3;

/* Angle of the node's triangle behind h, which runs out of it. */
static double corner_angle(const net_topology *t, uint32_t h) {
  const double *p = t->points + (size_t)3 * t->triangles[h];
  double a[3], b[3], n[3];
  vec_sub(t->points + (size_t)3 * t->triangles[net_next(h)], p, a);
  vec_sub(t->points + (size_t)3 * t->triangles[net_prev(h)], p, b);
  vec_cross(a, b, n);
  return atan2(vec_norm(n), vec_dot(a, b));
}

/* Angle from a to b about w, 0 .. 2 pi; a is orthogonal to w. */
static double angle_about(const double *w, const double *a, const double *b) {
  double across[3];
  vec_cross(a, b, across);
  double angle = atan2(vec_dot(w, across), vec_dot(a, b) - vec_dot(a, w) * vec_dot(b, w));
  return angle < 0 ? angle + 2 * PI : angle;
}

/* Of all triangles of the node; the last spoke, its half NET_NONE when the fan is closed. */
static double total_angle(const net_topology *t, uint32_t node, net_spoke *last) {
  double total = 0;
  *last = (net_spoke){NET_NONE, false};
  for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) {
    if (!s.in) total += corner_angle(t, s.half);
    if (s.in) *last = s;
  }
  return total;
}

static double *guide_of(const net_topology *t, net_spoke s) {
  return t->guide + 3 * (2 * (size_t)t->edge[s.half] + net_spoke_end(t, s));
}

/* ---- sectors between creases ---------------------------------------------------------------------- */

typedef struct sector {
  double normal[3];
  const double *first; /* tangents at its sides */
  double angle, total; /* between them; of the triangles */
} sector;

/* False where a side has no tangent, or nothing is between them. */
static bool sector_of(const net_topology *t, uint32_t node, sector *out) {
  net_spoke last, first = net_spoke_first(t, node);
  if (!t->constraint || t->constraint[node].kind == NET_FREE) return false;
  out->total = total_angle(t, node, &last);
  if (last.half == NET_NONE || net_next(net_next(first.half)) == last.half) return false;
  out->first = guide_of(t, first);
  const double *end = guide_of(t, last);
  if (vec_dot(out->first, out->first) == 0 || vec_dot(end, end) == 0) return false;
  net_normal_front(t, node, out->normal);
  out->angle = angle_about(out->normal, out->first, end);
  return true;
}

/* An edge inside has come too near to the one before it, or passed it; the last side included. */
static bool is_disordered(const net_topology *t, uint32_t node, const sector *c) {
  const double *p = t->points + (size_t)3 * t->node_vertex[node];
  double before = 0, scale = c->angle / c->total, share = 0;
  for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) {
    double here = 0, e[3];
    if (s.half != t->node_first[node]) {
      vec_sub(t->points + (size_t)3 * net_spoke_vertex(t, s), p, e);
      here = s.in ? c->angle : angle_about(c->normal, c->first, e);
      if (!(here - before >= SECTOR_SHARE * share)) return true;
    }
    before = here;
    share = s.in ? 0 : scale * corner_angle(t, s.half);
  }
  return false;
}

static void spread_sector(net_topology *t, uint32_t node) {
  sector c;
  double angle = 0, across[3];
  if (!sector_of(t, node, &c)) return;
  vec_cross(c.normal, c.first, across);
  for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE && !s.in; s = net_spoke_next(t, s)) {
    double *guide = guide_of(t, s);
    if (t->kind[t->edge[s.half]] != NET_CREASE && vec_dot(guide, guide) == 0)
      for (int k = 0; k < 3; k++) guide[k] = cos(angle) * c.first[k] + sin(angle) * across[k];
    angle += c.angle / c.total * corner_angle(t, s.half);
  }
}

/* ---- folds ---------------------------------------------------------------------------------------- */

/* Guides of all smooth edges of the node that have none. */
static void spread_fold(net_topology *t, uint32_t node) {
  const double *p = t->points + (size_t)3 * t->node_vertex[node];
  double normal[3], along = 0, across = 0, angle = 0;
  net_node frame;
  net_spoke last;
  net_normal_front(t, node, normal);
  net_frame(normal, NULL, &frame);
  double total = total_angle(t, node, &last),
         scale = last.half != NET_NONE ? fmin(1, 1.5 * PI / total) : 2 * PI / total;
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
      double *guide = guide_of(t, s);
      if (t->kind[t->edge[s.half]] == NET_CREASE || vec_dot(guide, guide) > 0) continue;
      for (int k = 0; k < 3; k++) guide[k] = c * frame.u[k] + d * frame.v[k];
    }
}

/* ---- all nodes ------------------------------------------------------------------------------------ */

typedef struct folds_job {
  const net_topology *t;
  unsigned char *folded; /* [nodes] */
} folds_job;

static bool is_folded(const net_topology *t, uint32_t node) {
  double normal[3];
  sector c;
  if (t->constraint && t->constraint[node].kind != NET_FREE)
    return sector_of(t, node, &c) && is_disordered(t, node, &c);
  return net_normal_front(t, node, normal) < FOLDED;
}

static void find_folded(void *arg, size_t index) {
  const folds_job *job = arg;
  size_t end = index * NODES_PER_TASK + NODES_PER_TASK;
  for (size_t i = index * NODES_PER_TASK; i < end && i < job->t->nodes; i++)
    job->folded[i] = is_folded(job->t, (uint32_t)i);
}

batten_status net_folds_make(batten_context *ctx, net_topology *t) {
  batten_status st = BATTEN_OK;
  folds_job job = {t, batten_alloc_array(ctx, t->nodes, 1)};
  if (!job.folded) return BATTEN_E_NOMEM;
  batten_parallel(ctx, (t->nodes + NODES_PER_TASK - 1) / NODES_PER_TASK, find_folded, &job);
  for (size_t i = 0; i < t->nodes; i++) {
    if (!job.folded[i]) continue;
    if (!t->guide) {
      t->guide = batten_alloc_array(ctx, t->edges, 6 * sizeof *t->guide);
      if (t->guide)
        memset(t->guide, 0, t->edges * 6 * sizeof *t->guide);
      else
        st = BATTEN_E_NOMEM;
    }
    if (st != BATTEN_OK) break;
    if (t->constraint && t->constraint[i].kind != NET_FREE)
      spread_sector(t, (uint32_t)i);
    else
      spread_fold(t, (uint32_t)i);
  }
  batten_free(ctx, job.folded);
  return st;
}
