/* Frames of nodes, and what their constraints leave free. */
#include "network/net.h"

#include <string.h>

/* Takes what lies along w from u and brings the rest to length 1. */
static bool orthogonal_unit(const double *w, double *u) {
  double part = vec_dot(u, w);
  for (int k = 0; k < 3; k++) u[k] -= part * w[k];
  return vec_normalize(u);
}

void net_frame(const double w[3], const double *along, net_node *out) {
  double u[3] = {0};
  memset(out->x, 0, sizeof out->x);
  memcpy(out->w, w, sizeof out->w);
  if (along) memcpy(u, along, sizeof u);
  /* Twice, because of what the first round loses to cancellation. */
  bool found = along && orthogonal_unit(w, u) && orthogonal_unit(w, u);
  if (!found) {
    /* The axis that is farthest from w, made orthogonal: no division by anything small. */
    int axis = fabs(w[0]) <= fabs(w[1]) ? (fabs(w[0]) <= fabs(w[2]) ? 0 : 2) : (fabs(w[1]) <= fabs(w[2]) ? 1 : 2);
    for (int k = 0; k < 3; k++) u[k] = k == axis;
    orthogonal_unit(w, u);
  }
  memcpy(out->u, u, sizeof u);
  vec_cross(w, u, out->v);
}

/* A crease along u with curvature vector k. p = 0 keeps its tangent. A curve on the surface with tangent u and second
 * derivative k has k . w = q k . v + r, so r follows q. */
static void creased_freedom(const net_constraint *c, const net_node *node, double origin[5], double columns[5][5]) {
  origin[2] = vec_dot(c->k[0], node->w);
  columns[1][0] = 1;
  columns[2][0] = -vec_dot(c->k[0], node->v);
  columns[3][1] = 1;
  columns[4][2] = 1;
}

/* Two creases. Forms are vectors (r, sqrt2 m, n), in which those of d d' for unit d, e have the product (d . e)^2:
 * the shortest form with the given values on both is y0 d0 d0' + y1 d1 d1'. Creases that are parallel to 1e-3 are
 * one condition only, of which the mean value is taken; then two forms are left free rather than one. */
static unsigned corner_freedom(const net_constraint *c, const net_node *node, double origin[5],
                               double columns[5][5]) {
  double a[2], b[2], value[2];
  for (int k = 0; k < 2; k++) {
    a[k] = vec_dot(c->d[k], node->u);
    b[k] = vec_dot(c->d[k], node->v);
    double length = hypot(a[k], b[k]);
    a[k] /= length;
    b[k] /= length;
    value[k] = vec_dot(c->k[k], node->w);
  }
  double cosine = a[0] * a[1] + b[0] * b[1], sine = a[0] * b[1] - b[0] * a[1];
  double product = cosine * cosine;
  double mean = (value[0] + value[1]) / (2 * (1 + product)), y[2] = {mean, mean};
  bool parallel = fabs(sine) < 1e-3;
  if (!parallel) {
    double half = (value[0] - value[1]) / (2 * sine * sine);
    y[0] += half;
    y[1] -= half;
  }
  for (int k = 0; k < 2; k++) {
    origin[2] += y[k] * a[k] * a[k];
    origin[3] += y[k] * a[k] * b[k];
    origin[4] += y[k] * b[k] * b[k];
  }
  /* The product of the linear functions that vanish on d0 and on d1 vanishes on both. */
  columns[2][0] = b[0] * b[1];
  columns[3][0] = -0.5 * (a[0] * b[1] + a[1] * b[0]);
  columns[4][0] = a[0] * a[1];
  if (!parallel) return 1;
  columns[2][1] = -2 * a[0] * b[0];
  columns[3][1] = a[0] * a[0] - b[0] * b[0];
  columns[4][1] = 2 * a[0] * b[0];
  return 2;
}

void net_node_freedom(const net_constraint *c, const net_node *node, double origin[5], double columns[5][5],
                      unsigned *dof) {
  memset(origin, 0, 5 * sizeof *origin);
  memset(columns, 0, 5 * sizeof *columns);
  if (c && c->kind == NET_CREASED) {
    creased_freedom(c, node, origin, columns);
    *dof = 3;
  } else if (c && c->kind == NET_CORNER) {
    *dof = corner_freedom(c, node, origin, columns);
  } else {
    for (int k = 0; k < 5; k++) columns[k][k] = 1;
    *dof = 5;
  }
}
