/* Three quartics a facet.  [Shirman, Sequin 1987: Local surface interpolation with Bezier patches; 1991: errata;
 * Chiyokura, Kimura 1983; scaling of the inner points: Kolb, Pottmann, Seidel 1995, section 4]
 *
 * The facet A_0 A_1 A_2 is split at an inner point Z: part k lies between edge k, a cubic c_0 .. c_3 raised to
 * degree 4, and inner curves A_i S_i P_i Z, cubics too. Q(t), a quarter of the derivative from the edge towards Z, is
 *   Q = k a + h C' / 3,   a(t) = (1 - t) a_0 + t a_1 the cross field,  k and h linear,
 * with a_0, a_1 the unit vectors to the left of the curve in the tangent planes at its ends. The facet beyond the
 * edge has the same C and -a: both tangent planes are span {a, C'}, whatever its k and h. Across inner curve I, with
 * the neighbouring rows r, r' of its two parts, Farin's condition
 *   r + r' - 2 I = mu(t) I' / 3,   mu linear from mu_i to 3/4,
 * gives, coefficient by coefficient, S_i (chosen along the line to the centroid of A_i and its neighbours), P_i, the
 * middle points N and Z: nothing is left free. */
#include <stdbool.h>

#include "network/net.h"

/* The inner end of the cross derivative, mu(1): three parts around Z whose first rows balance, Z = (P_0 + P_1 + P_2)
 * / 3, leave nothing else. At A_i it is 9/4 / f_i with S_i = A_i + f_i ((A_i + B_i + C_i) / 3 - A_i). */
#define MU_IN 0.75
#define MU_OUT 2.25
#define FACTOR_MIN 0.5 /* f_i beyond these would turn the parts over before they made the surface rounder */
#define FACTOR_MAX 2.0

/* Unit vector to the left of direction d in the plane of normal n; the chord stands in for a tangent of length zero.
 */
static bool cross_direction(const double *n, const double *d, const double *chord, double *out) {
  vec_cross(n, d, out);
  if (vec_normalize(out)) return false;
  vec_cross(n, chord, out);
  vec_normalize(out);
  return true;
}

/* Coordinates of b in span {a, d}, a unit and orthogonal to d. */
static void span(const double *b, const double *a, const double *d, double *along_a, double *along_d) {
  double square = vec_dot(d, d);
  *along_a = vec_dot(b, a);
  *along_d = square > 0 ? vec_dot(b, d) / square : 0;
}

/* f_1 and f_2, the middle of the first row of the part on edge c, from what the ends ask for: q_0, q_3 = Q there. */
static bool first_row(const double (*c)[3], const double *n0, const double *n3, const double *q0, const double *q3,
                      double *f1, double *f2) {
  double d[3][3], a0[3], a1[3], chord[3], k0, h0, k1, h1;
  for (int m = 0; m < 3; m++) vec_sub(c[m + 1], c[m], d[m]);
  vec_sub(c[3], c[0], chord);
  bool clamped = cross_direction(n0, d[0], chord, a0);
  clamped |= cross_direction(n3, d[2], chord, a1);
  span(q0, a0, d[0], &k0, &h0);
  span(q3, a1, d[2], &k1, &h1);
  for (int x = 0; x < 3; x++) {
    f1[x] = c[1][x] + ((k0 + k1) * a0[x] + k0 * a1[x] + 2 * h0 * d[1][x] + h1 * d[0][x]) / 3;
    f2[x] = c[2][x] + (k1 * a0[x] + (k0 + k1) * a1[x] + h0 * d[2][x] + 2 * h1 * d[1][x]) / 3;
  }
  return clamped;
}

/* How far S goes along `way` = centroid of A and its neighbours - A: the length of the circle's arc that leaves A
 * that way and ends at the middle of the opposite curve, over the distance of the opposite side's middle from A. */
static double inner_factor(const double *corner, const double *way, const double (*opposite)[3], bool *clamped) {
  double middle[3], to[3], turn[3];
  for (int x = 0; x < 3; x++) {
    middle[x] = 0.5 * (opposite[0][x] + opposite[3][x]) - corner[x];
    to[x] = 0.125 * ((opposite[0][x] + opposite[3][x]) + 3 * (opposite[1][x] + opposite[2][x])) - corner[x];
  }
  vec_cross(way, to, turn);
  double angle = atan2(vec_norm(turn), vec_dot(way, to)), flat = vec_norm(middle);
  double arc = vec_norm(to) * (angle < 1e-4 ? 1 + angle * angle / 6 : angle / sin(angle));
  if (arc >= FACTOR_MIN * flat && arc <= FACTOR_MAX * flat && flat > 0) return arc / flat;
  *clamped = true;
  return arc < FACTOR_MIN * flat ? FACTOR_MIN : FACTOR_MAX;
}

bool net_fill_ss(bool classic, const double (*edges)[4][3], const double (*normals)[3], double (*out)[15][3]) {
  double s[3][3], p[3][3], r[3][3], z[3], first[3][3], second[3][3], mu[3];
  bool clamped = false;
  for (int i = 0; i < 3; i++) { /* S_i: in the tangent plane at A_i */
    const double(*leaving)[3] = edges[i], (*arriving)[3] = edges[(i + 2) % 3], *a = leaving[0];
    double way[3];
    for (int x = 0; x < 3; x++) way[x] = ((leaving[1][x] - a[x]) + (arriving[2][x] - a[x])) / 3;
    double f = classic ? 1 : inner_factor(a, way, edges[(i + 1) % 3], &clamped);
    for (int x = 0; x < 3; x++) s[i][x] = a[x] + f * way[x];
    mu[i] = MU_OUT / f;
  }
  for (int k = 0; k < 3; k++) {
    int j = (k + 1) % 3;
    double q0[3], q3[3];
    for (int x = 0; x < 3; x++) {
      q0[x] = 0.75 * (s[k][x] - edges[k][0][x]);
      q3[x] = 0.75 * (s[j][x] - edges[k][3][x]);
    }
    clamped |= first_row(edges[k], normals[k], normals[j], q0, q3, first[k], second[k]);
  }
  for (int i = 0; i < 3; i++)
    for (int x = 0; x < 3; x++) {
      double rows = first[i][x] + second[(i + 2) % 3][x];
      p[i][x] = s[i][x] + (3 * (rows - 2 * s[i][x]) - MU_IN * (s[i][x] - edges[i][0][x])) / (2 * mu[i]);
    }
  for (int x = 0; x < 3; x++) z[x] = (p[0][x] + p[1][x] + p[2][x]) / 3;
  for (int i = 0; i < 3; i++)
    for (int x = 0; x < 3; x++)
      r[i][x] = 2 * p[i][x] + (mu[i] * (z[x] - p[i][x]) + 2 * MU_IN * (p[i][x] - s[i][x])) / 3;
  for (int k = 0; k < 3; k++) {
    const double(*c)[3] = edges[k];
    int j = (k + 1) % 3, l = (k + 2) % 3;
    for (int x = 0; x < 3; x++) {
      double(*o)[3] = out[k];
      o[0][x] = c[0][x]; /* row 0; sums such that the facet beyond gets the same bits */
      o[1][x] = 0.25 * (c[0][x] + 3 * c[1][x]);
      o[2][x] = 0.5 * (c[1][x] + c[2][x]);
      o[3][x] = 0.25 * (c[3][x] + 3 * c[2][x]);
      o[4][x] = c[3][x];
      o[5][x] = 0.25 * (c[0][x] + 3 * s[k][x]); /* row 1 */
      o[6][x] = first[k][x];
      o[7][x] = second[k][x];
      o[8][x] = 0.25 * (c[3][x] + 3 * s[j][x]);
      o[9][x] = 0.5 * (s[k][x] + p[k][x]); /* row 2 */
      o[10][x] = 0.5 * (r[k][x] + r[j][x] - r[l][x]);
      o[11][x] = 0.5 * (s[j][x] + p[j][x]);
      o[12][x] = 0.25 * (3 * p[k][x] + z[x]); /* row 3 */
      o[13][x] = 0.25 * (3 * p[j][x] + z[x]);
      o[14][x] = z[x];
    }
  }
  return clamped;
}
