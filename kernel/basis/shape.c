/* Normal and curvatures of a surface at a place, from its derivatives.
 *
 * In the orthonormal frame e1 = du / |du|, e2 = n x e1 the second fundamental form is a symmetric 2 x 2 matrix, whose
 * eigenvalues are the principal curvatures up to their sign. With dv = f e1 + h e2, f = dv . e1, h = |du x dv| / |du|
 * its entries are II(e1, e1) = L / |du|^2, II(e1, e2) = (M - g L) / (|du| h), II(e2, e2) = (N - 2 g M + g^2 L) / h^2,
 * g = f / |du|, from L, M, N = n . S_uu, n . S_uv, n . S_vv. */
#include "shape.h"

#include <float.h>
#include <string.h>

#include "mesh/vec.h"

bool surface_shape_normal(const double du[3], const double dv[3], double normal[3], double *area) {
  double larger = fmax(vec_dot(du, du), vec_dot(dv, dv));
  vec_cross(du, dv, normal);
  *area = vec_norm(normal);
  /* du and dv carry errors of some 10 units of the larger one's rounding. */
  if (!(*area > 32 * DBL_EPSILON * larger) || !isfinite(*area)) {
    memset(normal, 0, 3 * sizeof *normal);
    *area = isfinite(*area) ? *area : NAN;
    return false;
  }
  for (int d = 0; d < 3; d++) normal[d] /= *area;
  return true;
}

/* Unit eigenvector (c, s) of [[a, b], [b, -a]] for the eigenvalue r = hypot(a, b). */
static void larger_axis(double a, double b, double r, double *c, double *s) {
  if (!(r > 0)) {
    *c = 1; /* umbilic: all directions are principal */
    *s = 0;
  } else if (a >= 0) {
    *c = sqrt(0.5 + 0.5 * a / r);
    *s = 0.5 * b / (r * *c);
  } else {
    *s = sqrt(0.5 - 0.5 * a / r);
    *c = 0.5 * b / (r * *s);
  }
}

bool surface_shape_make(const double (*jet)[3], surface_shape *out) {
  double area;
  if (!surface_shape_normal(jet[1], jet[2], out->normal, &area)) {
    out->gauss = out->mean = out->principal[0] = out->principal[1] = NAN;
    memset(out->directions, 0, sizeof out->directions);
    return false;
  }
  const double *n = out->normal;
  double e1[3], e2[3], length = vec_norm(jet[1]), h = area / length;
  for (int d = 0; d < 3; d++) e1[d] = jet[1][d] / length;
  vec_cross(n, e1, e2);
  double g = vec_dot(jet[2], e1) / length;
  double l = vec_dot(n, jet[3]), m = vec_dot(n, jet[4]), q = vec_dot(n, jet[5]);
  /* Positive where the surface bends away from the normal. */
  double a = -l / length / length, b = -(m - g * l) / length / h, c = -(q - 2 * g * m + g * g * l) / h / h;
  double half = 0.5 * (a - c), r = hypot(half, b), co, si;
  out->gauss = a * c - b * b;
  out->mean = 0.5 * (a + c);
  out->principal[0] = out->mean + r;
  out->principal[1] = out->mean - r;
  larger_axis(half, b, r, &co, &si);
  for (int d = 0; d < 3; d++) out->directions[0][d] = co * e1[d] + si * e2[d];
  vec_cross(n, out->directions[0], out->directions[1]);
  return true;
}
