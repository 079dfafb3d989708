/* The automatic carrier: the ellipsoid of the points' second moments.
 *
 * Points spread evenly over a sphere of radius R in n dimensions have the covariance R^2 / n in every direction, so
 * semi-axes sqrt(n eigenvalue) meet the sphere exactly. On an ellipsoid that is sampled evenly by area the long axes
 * come out too short and the short ones too long: by 8 and 4 % for axes 1 : 1 : 2, 13 and 6 % for 1 : 1 : 10. A
 * carrier needs no more: the spline corrects it, and for m = 2 the ratio of the axes is all that has any effect. */
#include <math.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "solid/carrier_inner.h"

/* Mean of the points and their covariance about it. Sums run over differences to the first point, so that coordinates
 * far from the origin cost no digits. */
static void moments(unsigned n, size_t count, const double *points, double *mean, double *covariance) {
  for (unsigned a = 0; a < n; a++) {
    double sum = 0;
    for (size_t i = 0; i < count; i++) sum += points[i * n + a] - points[a];
    mean[a] = points[a] + sum / (double)count;
  }
  for (unsigned a = 0; a < n; a++)
    for (unsigned b = a; b < n; b++) {
      double sum = 0;
      for (size_t i = 0; i < count; i++) sum += (points[i * n + a] - mean[a]) * (points[i * n + b] - mean[b]);
      covariance[a * n + b] = covariance[b * n + a] = sum / (double)count;
    }
}

batten_status batten_carrier_fit(batten_context *ctx, unsigned n, size_t count, const double *points,
                                 batten_carrier **out) {
  if (n < 1 || n > 3) return batten_fail(ctx, BATTEN_E_INVALID, "n: %u; give 1, 2 or 3", n);
  if (count < n + 1u)
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu points; at least %u are needed in %u dimensions", count,
                       n + 1u, n);
  size_t numbers;
  if (!batten_mul(count, n, &numbers)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; too many", count);
  if (!points) return batten_fail(ctx, BATTEN_E_INVALID, "points: NULL; give [%zu][%u] numbers", count, n);
  size_t bad = batten_first_nonfinite(numbers, points);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu]: coordinate %zu is %g; remove it", bad / n, bad % n,
                       points[bad]);
  double mean[3], covariance[9], values[3] = {0}, axes[3], rotation[9] = {0};
  moments(n, count, points, mean, covariance);
  batten_eigen_symmetric(n, covariance, values, rotation);
  /* 1e-12: rounding of the covariance, a thickness of 1e-6 of the length */
  if (!(values[0] > 1e-12 * values[n - 1]))
    return batten_fail(
        ctx, BATTEN_E_SINGULAR,
        "points: flat across (%g, %g, %g), thickness %.3g of length %.3g; give points of a solid, or a "
        "carrier",
        rotation[0], n > 1 ? rotation[1] : 0, n > 2 ? rotation[2] : 0, sqrt(fmax(values[0], 0)),
        sqrt(fmax(values[n - 1], 0)));
  for (unsigned i = 0; i < n; i++) axes[i] = sqrt(n * values[i]);
  return batten_carrier_ellipsoid(ctx, n, mean, axes, rotation, out);
}
