/* Three-vectors for the mesh code: small, inline, no state. */
#ifndef BATTEN_MESH_VEC_H
#define BATTEN_MESH_VEC_H

#include <math.h>

static inline void vec_sub(const double *a, const double *b, double *out) {
  for (int k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

static inline double vec_dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void vec_cross(const double *a, const double *b, double *out) {
  double x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  out[0] = x;
  out[1] = y;
  out[2] = z;
}

static inline double vec_norm(const double *a) { return sqrt(vec_dot(a, a)); }

static inline double vec_distance(const double *a, const double *b) {
  double d[3];
  vec_sub(a, b, d);
  return vec_norm(d);
}

/* (b - a) x (c - a): twice the area, towards the side that sees a b c counter-clockwise. */
static inline void vec_triangle_normal(const double *a, const double *b, const double *c, double *out) {
  double u[3], v[3];
  vec_sub(b, a, u);
  vec_sub(c, a, v);
  vec_cross(u, v, out);
}

/* Scales a to length 1 whatever its size; false and zero when it has no direction. */
static inline int vec_normalize(double *a) {
  double square = vec_dot(a, a);
  if (!(square > 1e-280 && square < 1e280)) { /* by a power of two, which changes no digit of the outcome */
    double largest = fmax(fabs(a[0]), fmax(fabs(a[1]), fabs(a[2])));
    if (!(largest > 0) || isinf(largest)) {
      a[0] = a[1] = a[2] = 0;
      return 0;
    }
    int exponent;
    frexp(largest, &exponent);
    for (int k = 0; k < 3; k++) a[k] = ldexp(a[k], -exponent);
    square = vec_dot(a, a);
  }
  double length = sqrt(square);
  for (int k = 0; k < 3; k++) a[k] /= length;
  return 1;
}

/* Angle at a in the triangle a b c, radians; 0 when a side has no length. */
static inline double vec_angle(const double *a, const double *b, const double *c) {
  double u[3], v[3], w[3];
  vec_sub(b, a, u);
  vec_sub(c, a, v);
  if (!vec_normalize(u) || !vec_normalize(v)) return 0;
  vec_cross(u, v, w);
  return atan2(vec_norm(w), vec_dot(u, v));
}

#endif
