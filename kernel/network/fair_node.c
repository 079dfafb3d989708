/* How the nodes' tangent planes and curvatures move. Frames turn with their normals, so that p = q = 0 after every
 * step, curvatures are those of the surface, and the largest turn of all does no harm. */
#include <string.h>

#include "fair.h"

/* The least rotation that takes one unit vector to another, not opposite one: c a + k x a + (k . a) k / (1 + c) with
 * k = from x to, c = from . to. */
static void rotate(const double *from, const double *to, double *a) {
  double k[3], cross[3], c = vec_dot(from, to);
  vec_cross(from, to, k);
  vec_cross(k, a, cross);
  double along = vec_dot(k, a) / (1 + c);
  for (int x = 0; x < 3; x++) a[x] = c * a[x] + cross[x] + along * k[x];
}

static void turn(const net_node *node, double p, double q, net_node *out) {
  double w[3], u[3];
  for (int x = 0; x < 3; x++) {
    w[x] = node->w[x] - p * node->u[x] - q * node->v[x];
    u[x] = node->u[x];
  }
  vec_normalize(w);
  rotate(node->w, w, u);
  net_frame(w, u, out); /* along u, which rounding has not quite left at right angles */
}

void fair_node_turn(const net_node *node, const double step[5], net_node *out) {
  net_node from = *node;
  turn(&from, step[0], step[1], out);
  for (int k = 2; k < 5; k++) out->x[k] = from.x[k] + step[k];
}

/* With g_a the parts along u and v of the new axes, II(e_a, e_b) = (w . n) g_a' X g_b, X the second derivatives. */
void fair_node_upright(const net_node *node, net_node *out) {
  net_node from = *node;
  const double *x = from.x;
  turn(&from, x[0], x[1], out);
  double slant = vec_dot(from.w, out->w), g[2][2];
  const double *axis[2] = {out->u, out->v};
  for (int a = 0; a < 2; a++) {
    g[a][0] = vec_dot(axis[a], from.u);
    g[a][1] = vec_dot(axis[a], from.v);
  }
  for (int a = 0; a < 2; a++)
    for (int b = a; b < 2; b++)
      out->x[2 + a + b] = slant * (x[2] * g[a][0] * g[b][0] + x[3] * (g[a][0] * g[b][1] + g[a][1] * g[b][0]) +
                                   x[4] * g[a][1] * g[b][1]);
}

/* Columns that move the normal are left out; the others are made orthonormal in the norm of forms, in which m counts
 * twice, and take up of x what they can. */
void fair_node_constrain(const net_constraint *c, net_node *node) {
  static const double weight[3] = {1, 2, 1};
  double origin[5], columns[5][5], basis[5][3], form[3] = {0};
  unsigned dof, count = 0;
  if (!c || c->kind == NET_FREE) return;
  net_node_freedom(c, node, origin, columns, &dof);
  for (unsigned y = 0; y < dof; y++) {
    double length = 0;
    if (columns[0][y] != 0 || columns[1][y] != 0) continue;
    double *own = basis[count];
    for (int k = 0; k < 3; k++) own[k] = columns[2 + k][y];
    for (unsigned z = 0; z < count; z++) {
      double part = 0;
      for (int k = 0; k < 3; k++) part += weight[k] * own[k] * basis[z][k];
      for (int k = 0; k < 3; k++) own[k] -= part * basis[z][k];
    }
    for (int k = 0; k < 3; k++) length += weight[k] * own[k] * own[k];
    if (!(length > 0)) continue;
    for (int k = 0; k < 3; k++) own[k] /= sqrt(length);
    count++;
  }
  for (unsigned y = 0; y < count; y++) {
    double part = 0;
    for (int k = 0; k < 3; k++) part += weight[k] * basis[y][k] * (node->x[2 + k] - origin[2 + k]);
    for (int k = 0; k < 3; k++) form[k] += part * basis[y][k];
  }
  for (int k = 0; k < 3; k++) node->x[2 + k] = origin[2 + k] + form[k];
}
