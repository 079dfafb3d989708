/* PN triangles.  [Vlachos, Peters, Boyd, Mitchell 2001: Curved PN triangles]
 *
 * One cubic a facet from its corners and their normals alone: the control points beside a corner are the thirds of
 * the sides, dropped into the tangent plane there; the middle one reproduces quadratics. Neighbours share their curve
 * but not their tangent planes. */
#include "network/net.h"

/* The third of a -> b near a, dropped into the tangent plane at a. */
static void third(const double *a, const double *b, const double *normal, double *out) {
  double to[3];
  vec_sub(b, a, to);
  double high = vec_dot(to, normal);
  for (int x = 0; x < 3; x++) out[x] = a[x] + (to[x] - high * normal[x]) / 3;
}

void net_fill_pn(const double (*corners)[3], const double (*normals)[3], double (*out)[3]) {
  /* beside corner i: towards i + 1, towards i + 2 */
  static const unsigned char place[3][2] = {{1, 4}, {6, 2}, {7, 8}}, tip[3] = {0, 3, 9};
  for (int i = 0; i < 3; i++) {
    for (int x = 0; x < 3; x++) out[tip[i]][x] = corners[i][x];
    for (int k = 0; k < 2; k++) third(corners[i], corners[(i + 1 + k) % 3], normals[i], out[place[i][k]]);
  }
  for (int x = 0; x < 3; x++) {
    double edge = 0, corner = 0;
    for (int i = 0; i < 3; i++) {
      edge += out[place[i][0]][x] + out[place[i][1]][x];
      corner += corners[i][x];
    }
    out[5][x] = edge / 4 - corner / 6;
  }
}
