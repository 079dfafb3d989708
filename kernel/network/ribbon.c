/* Curve and cross field of an edge from the surface's data at its ends.   [Kolb, Pottmann, Seidel 1995, section 5]
 *
 * In the frame (u, v, w) of a node the surface is, to second order, the graph of p u + q v + (r u^2 + 2 m u v + n
 * v^2) / 2. A curve on it whose projection has first and second derivative t = (a, b), s = (c, d) there has C' = t +
 * (a p + b q) w,   C'' = s + (c p + d q + a^2 r + 2 a b m + b^2 n) w, and a field of tangent vectors along it with
 * projection (e, f), constant to first order, has D = (e, f) + (e p + f q) w,   D' = (a e r + (a f + b e) m + b f n)
 * w. The quintic and the cubic take these over at both ends. The field starts at right angles to t, as long as the
 * chord, to the left of the run. */
#include "network/fill.h"

typedef struct end_data {
  double curve[2][3]; /* first and second derivative, outgoing */
  double field[2][3]; /* the field and its derivative along the run */
} end_data;

/* turn: 1 where the run begins, -1 where it ends. */
static void end_make(const net_node *node, const double *t, const double *s, double length, double turn,
                     const double *bend, end_data *out) {
  const double *u = node->u, *v = node->v, *w = node->w, *x = node->x;
  double a = vec_dot(t, u), b = vec_dot(t, v), c = vec_dot(s, u), d = vec_dot(s, v);
  double left[3];
  vec_cross(w, t, left);
  double scale = turn * length / vec_norm(left);
  for (int k = 0; k < 3; k++) left[k] *= scale;
  double e = vec_dot(left, u), f = vec_dot(left, v);
  double first = a * x[0] + b * x[1], across = e * x[0] + f * x[1];
  double second = c * x[0] + d * x[1] + a * a * x[2] + 2 * a * b * x[3] + b * b * x[4];
  double rate = turn * (a * e * x[2] + (a * f + b * e) * x[3] + b * f * x[4]), speed = vec_dot(t, t);
  for (int k = 0; k < 3; k++) {
    out->curve[0][k] = bend ? t[k] : t[k] + first * w[k];
    out->curve[1][k] = bend ? s[k] + speed * bend[k] : s[k] + second * w[k];
    out->field[0][k] = left[k] + across * w[k];
    out->field[1][k] = rate * w[k];
  }
}

void net_ribbon_join(const double *vi, const double *vj, const net_node *i, const net_node *j, const net_local *local,
                     const double *bend_i, const double *bend_j, net_ribbon *out) {
  double length = vec_distance(vi, vj);
  end_data start, end;
  end_make(i, local->t[0], local->s[0], length, 1, bend_i, &start);
  end_make(j, local->t[1], local->s[1], length, -1, bend_j, &end);
  for (int k = 0; k < 3; k++) {
    out->c[0][k] = vi[k];
    out->c[1][k] = vi[k] + start.curve[0][k] / 5;
    out->c[2][k] = vi[k] + 2 * start.curve[0][k] / 5 + start.curve[1][k] / 20;
    out->c[3][k] = vj[k] + 2 * end.curve[0][k] / 5 + end.curve[1][k] / 20;
    out->c[4][k] = vj[k] + end.curve[0][k] / 5;
    out->c[5][k] = vj[k];
    out->d[0][k] = start.field[0][k];
    out->d[1][k] = start.field[0][k] + start.field[1][k] / 3;
    out->d[2][k] = end.field[0][k] - end.field[1][k] / 3;
    out->d[3][k] = end.field[0][k];
  }
}

void net_ribbon_make(const double *vi, const double *vj, const net_node *i, const net_node *j, const net_local *local,
                     const double (*bend)[3], net_ribbon *out) {
  net_ribbon_join(vi, vj, i, j, local, bend ? bend[0] : NULL, bend ? bend[1] : NULL, out);
}

void net_ribbon_reverse(const net_ribbon *in, net_ribbon *out) {
  net_ribbon from = *in;
  for (int x = 0; x < 3; x++) {
    for (int k = 0; k < 6; k++) out->c[k][x] = from.c[5 - k][x];
    for (int k = 0; k < 4; k++) out->d[k][x] = -from.d[3 - k][x];
  }
}
