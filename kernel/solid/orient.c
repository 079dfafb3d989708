/* Outward normals of unoriented surface points: the choice between least energy and local planes.
 *
 * Points are moved and scaled to the unit size (see orient.h). Planes come first: they are one of energy's starts and
 * what AUTO falls back to. Energy works on all points or, above energy_points, on a well-spread subset. */
#include "orient.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"

/* Unit size: nearer points are one. */
static const double SAME = 1e-9;
/* By which planes must be less in doubt than energy: noise, rims and uneven samples make some hundredths. */
static const double DOUBT = 0.1;
/* Thickness over length; rounding of coordinates alone gives 1e-16 times their distance from 0. */
static const double FLAT = 1e-10;

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

/* lambda of the unit size as smoothing of batten_spline_options: for the box of longest side 1. The kernel is cubic.
 */
static double lambda_in_box(unsigned n, size_t count, const double *unit, double lambda) {
  double side = 0;
  for (unsigned c = 0; c < n; c++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      lower = fmin(lower, unit[i * n + c]);
      upper = fmax(upper, unit[i * n + c]);
    }
    side = fmax(side, upper - lower);
  }
  return lambda / (side * side * side);
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

/* At most *found points, each the farthest from those before it, the first the farthest from the centroid; none
 * twice. chosen [*found], distance [count] of work. *found becomes how many there are. */
static batten_status spread(batten_context *ctx, unsigned n, size_t count, const double *points, size_t *found,
                            size_t *chosen, double *distance) {
  size_t most = *found, first = 0;
  double far = -1;
  for (size_t i = 0; i < count; i++) {
    double square = 0;
    for (unsigned c = 0; c < n; c++) square += points[i * n + c] * points[i * n + c];
    if (square > far) far = square, first = i;
    distance[i] = INFINITY;
  }
  chosen[0] = first;
  for (*found = 1; *found < most; ++*found) {
    const double *last = points + chosen[*found - 1] * n;
    size_t next = 0;
    far = -1;
    for (size_t i = 0; i < count; i++) {
      double square = 0;
      for (unsigned c = 0; c < n; c++) square += (points[i * n + c] - last[c]) * (points[i * n + c] - last[c]);
      if (square < distance[i]) distance[i] = square;
      if (distance[i] > far) far = distance[i], next = i;
    }
    if (far <= SAME * SAME) break;
    chosen[*found] = next;
    batten_status status = *found % 64 ? BATTEN_OK : batten_progress(ctx, "orient", 0);
    if (status < 0) return status;
  }
  return BATTEN_OK;
}

/* Directions from the planes where they are sure, signs from the field's gradients. */
static void sign_planes(const batten_orient_graph *g, const double *gradients, double *normals) {
  unsigned n = g->n;
  for (size_t i = 0; i < g->count; i++) {
    const double *gradient = gradients + i * n, *plane = g->plane + i * n;
    double along = 0, square = 0;
    for (unsigned c = 0; c < n; c++) {
      along += gradient[c] * plane[c];
      square += gradient[c] * gradient[c];
    }
    bool sure = g->flatness[i] > 0.7 && along * along > 0.25 * square;
    double length = sqrt(square);
    for (unsigned c = 0; c < n; c++)
      normals[i * n + c] = sure || !(length > 0) ? (along < 0 ? -plane[c] : plane[c]) : gradient[c] / length;
  }
}

/* Least energy on a subset, and what its field says at all points. */
static batten_status orient_subset(batten_context *ctx, const batten_orient_graph *graph, const double *start,
                                   size_t energy_points, double *normals, double *lambda) {
  unsigned n = graph->n;
  size_t most = energy_points < graph->count ? energy_points : graph->count;
  batten_orient_graph part = {0};
  batten_orient_field field = {0};
  double *gradients = NULL, *points = NULL, *some = NULL;
  batten_status status = BATTEN_E_NOMEM;
  size_t *chosen = batten_alloc_array(ctx, most, sizeof *chosen);
  if (!chosen || !(gradients = batten_alloc_array(ctx, graph->count, n * sizeof *gradients)) ||
      !(points = batten_alloc_array(ctx, most, n * sizeof *points)) ||
      !(some = batten_alloc_array(ctx, most, n * sizeof *some)))
    goto done;
  size_t found = most;
  if ((status = spread(ctx, n, graph->count, graph->points, &found, chosen, gradients)) < 0) goto done;
  if (found < n + 2) {
    status = batten_fail(ctx, BATTEN_E_INVALID, "points: %zu different ones; %u or more are needed", found, n + 2);
    goto done;
  }
  for (size_t i = 0; i < found; i++) {
    memcpy(points + i * n, graph->points + chosen[i] * n, n * sizeof *points);
    memcpy(some + i * n, start + chosen[i] * n, n * sizeof *some);
  }
  if ((status = batten_orient_graph_new(ctx, n, found, points, &part)) < 0) goto done;
  if ((status = batten_orient_energy(ctx, &part, some, &field)) < 0) goto done;
  batten_orient_field_gradients(ctx, &field, graph->count, graph->points, gradients);
  sign_planes(graph, gradients, normals);
  *lambda = field.lambda;
done:
  batten_orient_field_free(ctx, &field);
  batten_orient_graph_free(ctx, &part);
  batten_free(ctx, some);
  batten_free(ctx, points);
  batten_free(ctx, gradients);
  batten_free(ctx, chosen);
  return status;
}

static batten_status orient_all(batten_context *ctx, const batten_orient_graph *graph, const double *start,
                                double *normals, double *lambda) {
  batten_orient_field field;
  batten_status status = batten_orient_energy(ctx, graph, start, &field);
  if (status < 0) return status;
  memcpy(normals, field.normals, graph->count * graph->n * sizeof *normals);
  *lambda = field.lambda;
  batten_orient_field_free(ctx, &field);
  return BATTEN_OK;
}

static bool has_equal_points(const batten_orient_graph *graph) {
  size_t i = 0;
  while (i < graph->count && graph->distance[i * graph->k] > SAME) i++;
  return i < graph->count;
}

batten_status batten_orient(batten_context *ctx, unsigned n, size_t count, const double *points,
                            batten_orient_method method, size_t energy_points, double *normals,
                            batten_orient_method *method_used, double *lambda_used) {
  batten_status status = check(ctx, n, count, points, method, energy_points, normals);
  if (status < 0) return status;
  batten_orient_graph graph = {0};
  double *unit = NULL, *planes = NULL, *energy = NULL, lambda = 0;
  batten_orient_method used = BATTEN_ORIENT_METHOD_PLANES;
  status = BATTEN_E_NOMEM;
  if (!(unit = batten_alloc_array(ctx, count, n * sizeof *unit)) ||
      !(planes = batten_alloc_array(ctx, count, n * sizeof *planes)))
    goto done;
  if ((status = to_unit_size(ctx, n, count, points, unit)) < 0) goto done;
  if ((status = batten_progress(ctx, "orient", 0)) < 0) goto done;
  if ((status = batten_orient_graph_new(ctx, n, count, unit, &graph)) < 0) goto done;
  if ((status = batten_orient_planes(ctx, &graph, planes)) < 0) goto done;
  if (method != BATTEN_ORIENT_METHOD_PLANES) {
    status = BATTEN_E_NOMEM;
    if (!(energy = batten_alloc_array(ctx, count, n * sizeof *energy))) goto done;
    bool whole = count <= energy_points && !has_equal_points(&graph);
    status = whole ? orient_all(ctx, &graph, planes, energy, &lambda)
                   : orient_subset(ctx, &graph, planes, energy_points, energy, &lambda);
    bool automatic = method == BATTEN_ORIENT_METHOD_AUTO;
    if (status < 0 && !(automatic && status == BATTEN_E_SINGULAR)) goto done;
    if (status >= 0 &&
        !(automatic && batten_orient_doubt(&graph, energy) > batten_orient_doubt(&graph, planes) + DOUBT))
      used = BATTEN_ORIENT_METHOD_ENERGY;
    status = BATTEN_OK;
  }
  memcpy(normals, used == BATTEN_ORIENT_METHOD_ENERGY ? energy : planes, count * n * sizeof *normals);
  if (method_used) *method_used = used;
  if (lambda_used) *lambda_used = used == BATTEN_ORIENT_METHOD_ENERGY ? lambda_in_box(n, count, unit, lambda) : 0;
done:
  batten_orient_graph_free(ctx, &graph);
  batten_free(ctx, energy);
  batten_free(ctx, planes);
  batten_free(ctx, unit);
  return status;
}
