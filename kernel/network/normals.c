/* Normals estimated from the triangles around a node, and curvatures from the neighbours.
 *   [Max: Weights for computing vertex normals from facet normals, 1999]
 *   [Moreton, Sequin: Functional optimization for fair surface design, 1992] */
#include "network/normals.h"

#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "network/fan.h"

enum { NODES_PER_TASK = 2048 };

/* Least product of a normal with those of its triangles, 81 degrees, unless that is more than half of what can be
 * had: a bound that nothing meets which is not on its way to fold. */
static const double FRONT_MIN = 0.15;
/* What sees so much needs no better. */
static const double ENOUGH = 0.5;

/* The triangle's normal at a corner with sides a and b, as long as it counts. */
static void corner_normal(batten_normal_weights weights, const double *a, const double *b, double *out) {
  double aa = vec_dot(a, a), bb = vec_dot(b, b), weight = 0;
  vec_cross(a, b, out);
  double twice = vec_norm(out);
  switch (weights) {
    case BATTEN_NORMALS_AREA:
      weight = twice;
      break;
    case BATTEN_NORMALS_INVERSE_AREA:
      weight = twice > 0 ? 1 / twice : 0;
      break;
    case BATTEN_NORMALS_SPHERE:
      weight = twice / aa / bb;
      break;
    case BATTEN_NORMALS_ANGLE:
      weight = atan2(twice, vec_dot(a, b));
      break;
  }
  vec_normalize(out);
  for (int k = 0; k < 3; k++) out[k] *= weight;
}

/* Unit normal of the node's triangles. Where they cancel each other, the first triangle has its way. */
static void estimate(const net_topology *t, batten_normal_weights weights, uint32_t node, double *out) {
  double sum[3] = {0}, first[3] = {0}, largest = 0;
  for (uint32_t h = t->node_first[node]; h != NET_NONE; h = net_fan_next(t, h)) {
    const double *p = t->points + (size_t)3 * t->triangles[h];
    double a[3], b[3], n[3];
    vec_sub(t->points + (size_t)3 * t->triangles[net_next(h)], p, a);
    vec_sub(t->points + (size_t)3 * t->triangles[net_prev(h)], p, b);
    corner_normal(weights, a, b, n);
    if (!(largest > 0)) memcpy(first, n, sizeof first);
    largest = fmax(largest, vec_norm(n));
    for (int k = 0; k < 3; k++) sum[k] += n[k];
  }
  bool cancelled = !(vec_norm(sum) > 1e-10 * largest);
  memcpy(out, cancelled ? first : sum, 3 * sizeof *out);
  if (!vec_normalize(out)) out[2] = 1;
}

/* Turns a normal as little as possible so that it is orthogonal to d. */
static void make_orthogonal(const double *d, double *normal) {
  double part = vec_dot(d, normal), before[3];
  memcpy(before, normal, sizeof before);
  for (int k = 0; k < 3; k++) normal[k] -= part * d[k];
  if (vec_norm(normal) > 1e-8) {
    vec_normalize(normal);
    /* Twice, because of what the first one lost to cancellation. */
    part = vec_dot(d, normal);
    for (int k = 0; k < 3; k++) normal[k] -= part * d[k];
    vec_normalize(normal);
  } else {
    net_node any;
    net_frame(d, NULL, &any);
    memcpy(normal, any.u, sizeof any.u);
  }
}

void net_normal_constrain(const net_constraint *c, double normal[3]) {
  if (!c || c->kind == NET_FREE) return;
  double across[3];
  vec_cross(c->d[0], c->d[1], across);
  if (c->kind == NET_CORNER && vec_norm(across) > 1e-8) {
    vec_normalize(across);
    double sign = vec_dot(across, normal) < 0 ? -1 : 1;
    for (int k = 0; k < 3; k++) normal[k] = sign * across[k];
  } else {
    make_orthogonal(c->d[0], normal);
  }
}

/* ---- normals that see their triangles ------------------------------------------------------------- */

/* The least product of a vector with the unit normals of the node's triangles; which [3]: that normal. */
static double frontness(const net_topology *t, uint32_t node, const double *w, double *which) {
  double least = INFINITY;
  for (uint32_t h = t->node_first[node]; h != NET_NONE; h = net_fan_next(t, h)) {
    const uint32_t *v = t->triangles + h / 3 * 3;
    double n[3];
    vec_triangle_normal(t->points + (size_t)3 * v[0], t->points + (size_t)3 * v[1], t->points + (size_t)3 * v[2], n);
    vec_normalize(n);
    double product = vec_dot(w, n);
    if (product >= least) continue;
    least = product;
    if (which) memcpy(which, n, sizeof n);
  }
  return least;
}

/* The middle of the smallest cap of the unit sphere that holds all normals of the triangles, nearly: to go towards
 * the farthest by ever smaller steps ends there [Badoiu, Clarkson 2003]. */
double net_normal_front(const net_topology *t, uint32_t node, double normal[3]) {
  enum { STEPS = 100 };
  const net_constraint *c = t->constraint ? t->constraint + node : NULL;
  double w[3], best;
  estimate(t, BATTEN_NORMALS_ANGLE, node, w);
  net_normal_constrain(c, w);
  memcpy(normal, w, sizeof w);
  double farthest[3], least = frontness(t, node, w, farthest);
  best = least;
  for (int step = 2; step < STEPS && best < ENOUGH; step++) {
    for (int k = 0; k < 3; k++) w[k] += (farthest[k] - w[k]) / step;
    if (!vec_normalize(w)) break;
    net_normal_constrain(c, w);
    least = frontness(t, node, w, farthest);
    if (least <= best) continue;
    best = least;
    memcpy(normal, w, sizeof w);
  }
  return best;
}

bool net_normal_guard(const net_topology *t, uint32_t node, double normal[3]) {
  const net_constraint *c = t->constraint ? t->constraint + node : NULL;
  if (c && c->kind == NET_CORNER) return false;
  double least = frontness(t, node, normal, NULL), center[3], from[3];
  if (least >= FRONT_MIN) return false;
  memcpy(from, normal, sizeof from);
  double best = net_normal_front(t, node, center), bound = fmin(FRONT_MIN, 0.5 * best);
  if (least >= bound || least >= best) return false;
  /* What is seen grows along the arc from the given normal up to the middle. */
  double seen = 1, unseen = 0;
  memcpy(normal, center, 3 * sizeof *normal);
  for (int step = 0; step < 20 && best > 0; step++) {
    double w[3], part = 0.5 * (seen + unseen);
    for (int k = 0; k < 3; k++) w[k] = (1 - part) * from[k] + part * center[k];
    if (vec_normalize(w) && frontness(t, node, w, NULL) >= bound) {
      seen = part;
      memcpy(normal, w, sizeof w);
    } else {
      unseen = part;
    }
  }
  net_normal_constrain(c, normal);
  return true;
}

/* ---- all nodes ------------------------------------------------------------------------------------ */

typedef struct normals_job {
  const net_topology *t;
  batten_normal_weights weights;
  const double *given;
  double *normals;
} normals_job;

static void estimate_nodes(void *arg, size_t index) {
  const normals_job *job = arg;
  const net_topology *t = job->t;
  size_t end = index * NODES_PER_TASK + NODES_PER_TASK < t->nodes ? (index + 1) * NODES_PER_TASK : t->nodes;
  for (size_t i = index * NODES_PER_TASK; i < end; i++) {
    const net_constraint *c = t->constraint ? t->constraint + i : NULL;
    double *normal = job->normals + 3 * i;
    bool free_node = !c || c->kind == NET_FREE;
    if (job->given && free_node) {
      memcpy(normal, job->given + (size_t)3 * t->node_vertex[i], 3 * sizeof *normal);
      if (vec_normalize(normal)) continue;
    }
    estimate(t, job->weights, (uint32_t)i, normal);
    net_normal_constrain(c, normal);
    net_normal_guard(t, (uint32_t)i, normal);
  }
}

batten_status net_normals_make(batten_context *ctx, const net_topology *t, const batten_network_options *opt,
                               double *normals) {
  if (opt->normals_given) {
    size_t bad = batten_first_nonfinite(3 * t->vertices, opt->normals_given);
    if (bad < 3 * t->vertices)
      return batten_fail(ctx, BATTEN_E_INVALID,
                         "opt.normals_given[%zu][%zu]: not finite; give 0 0 0 for a normal to estimate", bad / 3,
                         bad % 3);
  }
  normals_job job = {t, opt->normals, opt->normals_given, normals};
  batten_parallel(ctx, (t->nodes + NODES_PER_TASK - 1) / NODES_PER_TASK, estimate_nodes, &job);
  return BATTEN_OK;
}

/* The circle through V_i and V_j that touches the tangent plane at V_i has the curvature 2 w . E / |E|^2. The form is
 * fitted to these; as a vector (r, sqrt2 m, n) it has a norm that no rotation of the frame changes, so that the
 * shortest of several fits, where there are fewer than three directions, depends on the surface alone. */
void net_curvature_estimate(const net_topology *t, uint32_t node, const net_node *frame, double form[3]) {
  double a[9] = {0}, b[3] = {0}, values[3], vectors[9];
  const double *p = t->points + (size_t)3 * t->node_vertex[node];
  for (net_spoke s = net_spoke_first(t, node); s.half != NET_NONE; s = net_spoke_next(t, s)) {
    double e[3];
    vec_sub(t->points + (size_t)3 * net_spoke_vertex(t, s), p, e);
    double x = vec_dot(e, frame->u), y = vec_dot(e, frame->v), length = hypot(x, y);
    double square = vec_dot(e, e), curvature = 2 * vec_dot(e, frame->w) / square;
    if (!(length > 1e-6 * sqrt(square))) continue;
    x /= length;
    y /= length;
    double row[3] = {x * x, sqrt(2) * x * y, y * y};
    for (int i = 0; i < 3; i++) {
      b[i] += row[i] * curvature;
      for (int j = 0; j < 3; j++) a[3 * i + j] += row[i] * row[j];
    }
  }
  double fit[3] = {0};
  batten_eigen_symmetric(3, a, values, vectors);
  for (int i = 0; i < 3; i++) {
    /* Singular values below 1e-4 of the largest: directions that are the same to the eye. */
    if (!(values[i] > 1e-8 * values[2])) continue;
    double part = vec_dot(vectors + 3 * i, b) / values[i];
    for (int k = 0; k < 3; k++) fit[k] += part * vectors[3 * i + k];
  }
  form[0] = fit[0];
  form[1] = fit[1] / sqrt(2);
  form[2] = fit[2];
}
