/* Outward normals of unoriented surface points: the choice between least energy and local planes.
 *
 * Points are moved and scaled to the unit size (see orient.h), oriented there by orient_planes.c. */
#include "orient.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"

static const double FLAT =
    1e-10; /* thickness over length; rounding of coordinates alone gives 1e-16 times their distance from 0 */

/* Centroid to 0 and twice the root mean square distance from it to 1. Refuses what lies on a line or plane. */
static batten_status to_unit_size(batten_context *ctx, unsigned n, size_t count, const double *points, double *unit) {
  double middle[3], mean[3] = {0}, second[9] = {0}, values[3], vectors[9], side = 0;
  for (unsigned c = 0; c < n; c++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lower = fmin(lower, points[i * n + c]);
      upper = fmax(upper, points[i * n + c]);
    }
    middle[c] = lower / 2 + upper / 2; /* first, so that far coordinates keep their digits in the mean */
    side = fmax(side, upper / 2 - lower / 2);
  }
  if (!(side > 0)) return batten_fail(ctx, BATTEN_E_SINGULAR, "points: all %zu are equal", count);
  for (size_t i = 0; i < count; i++)
    for (unsigned c = 0; c < n; c++) {
      unit[i * n + c] = (points[i * n + c] - middle[c]) / side;
      mean[c] += unit[i * n + c] / (double)count;
    }
  for (size_t i = 0; i < count; i++) {
    double *x = unit + i * n;
    for (unsigned c = 0; c < n; c++) x[c] -= mean[c];
    for (unsigned r = 0; r < n; r++)
      for (unsigned c = 0; c < n; c++) second[r * n + c] += x[r] * x[c] / (double)count;
  }
  batten_eigen_symmetric(n, second, values, vectors);
  if (values[0] <= FLAT * FLAT * values[n - 1])
    return batten_fail(ctx, BATTEN_E_SINGULAR,
                       "points: all %zu lie on one %s, normal (%.4g, %.4g, %.4g); it has no inside", count,
                       n == 2 ? "line" : "plane", vectors[0], vectors[1], n == 2 ? 0 : vectors[2]);
  double square = 0;
  for (unsigned c = 0; c < n; c++) square += values[c];
  double scale = 0.5 / sqrt(square);
  for (size_t i = 0; i < count * n; i++) unit[i] *= scale;
  return BATTEN_OK;
}

static batten_status check(batten_context *ctx, unsigned n, size_t count, const double *points,
                           batten_orient_method method, size_t energy_points, const double *normals) {
  if (n < 2 || n > 3) return batten_fail(ctx, BATTEN_E_INVALID, "n: %u; normals are estimated for n = 2 or 3", n);
  if (!points || !normals) return batten_fail(ctx, BATTEN_E_INVALID, "%s: NULL", points ? "normals" : "points");
  if ((int)method < BATTEN_ORIENT_METHOD_AUTO || method > BATTEN_ORIENT_METHOD_PLANES)
    return batten_fail(ctx, BATTEN_E_INVALID, "method: %d; take a batten_orient_method", (int)method);
  size_t least = n + 2; /* one more than span a simplex: fewer have no inside to speak of */
  if (count < least)
    return batten_fail(ctx, BATTEN_E_INVALID, "count: %zu; %zu points or more are needed to orient them", count,
                       least);
  if (method != BATTEN_ORIENT_METHOD_PLANES && energy_points < least)
    return batten_fail(ctx, BATTEN_E_INVALID, "energy_points: %zu; at least %zu", energy_points, least);
  size_t values, bad;
  if (!batten_mul3(count, n, sizeof *points, &values))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points", count);
  if ((bad = batten_first_nonfinite(count * n, points)) < count * n)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu]: coordinate %zu is %g; remove it", bad / n, bad % n,
                       points[bad]);
  return BATTEN_OK;
}

batten_status batten_orient(batten_context *ctx, unsigned n, size_t count, const double *points,
                            batten_orient_method method, size_t energy_points, double *normals,
                            batten_orient_method *method_used, double *lambda_used) {
  batten_status status = check(ctx, n, count, points, method, energy_points, normals);
  if (status < 0) return status;
  batten_orient_graph graph = {0};
  double *unit = NULL, *found = NULL;
  status = BATTEN_E_NOMEM;
  if (!(unit = batten_alloc_array(ctx, count, n * sizeof *unit)) ||
      !(found = batten_alloc_array(ctx, count, n * sizeof *found)))
    goto done;
  if ((status = to_unit_size(ctx, n, count, points, unit)) < 0) goto done;
  if ((status = batten_progress(ctx, "orient", 0)) < 0) goto done;
  if ((status = batten_orient_graph_new(ctx, n, count, unit, &graph)) < 0) goto done;
  if ((status = batten_orient_planes(ctx, &graph, found)) < 0) goto done;
  memcpy(normals, found, count * n * sizeof *normals);
  if (method_used) *method_used = BATTEN_ORIENT_METHOD_PLANES;
  if (lambda_used) *lambda_used = 0;
done:
  batten_orient_graph_free(ctx, &graph);
  batten_free(ctx, found);
  batten_free(ctx, unit);
  return status;
}
