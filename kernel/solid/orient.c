/* Outward normals of unoriented surface points: the choice between least energy and local planes.
 *
 * Points are moved and scaled to the unit size (see orient.h). Planes come first: they are one of energy's starts and
 * what AUTO falls back to. Energy works on all points or, above energy_points, on a well-spread subset, whose field
 * is carried to all points and refined by what they say themselves (orient_refine.c). */
#include "orient.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "base/points.h"
#include "basis/eigen3.h"

/* Unit size: nearer points are one. Many in one place would be each other's neighbours and nobody else's. */
static const double SAME = 1e-9;
/* By which planes must be less in doubt than energy: noise, rims and uneven samples make some hundredths. */
static const double DOUBT = 0.1;
/* From so many times energy_points on there may be detail that the subset does not see. */
enum { REFINE = 2 };
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

/* Normals in the gradients' place: directions from the planes where they are sure, signs from the field. */
static void sign_planes(const batten_orient_graph *g, double *gradients) {
  unsigned n = g->n;
  for (size_t i = 0; i < g->count; i++) {
    double *gradient = gradients + i * n;
    const double *plane = g->plane + i * n;
    double along = 0, square = 0;
    for (unsigned c = 0; c < n; c++) {
      along += gradient[c] * plane[c];
      square += gradient[c] * gradient[c];
    }
    bool sure = g->flatness[i] > 0.7 && along * along > 0.25 * square;
    double length = sqrt(square);
    for (unsigned c = 0; c < n; c++)
      gradient[c] = sure || !(length > 0) ? (along < 0 ? -plane[c] : plane[c]) : gradient[c] / length;
  }
}

/* What one call holds. Points and normals stand in a tree's order: neighbours lie near each other in memory too. */
typedef struct orientation {
  unsigned n;
  size_t given, count; /* points of the caller, different ones */
  size_t *place;       /* [given] which of the different ones a point is */
  double *points;      /* [count][n] unit size */
  double *planes;      /* [count][n] normals by planes */
  double *energy;      /* [count][n] normals by energy */
  batten_orient_graph graph;
  batten_orient_forest forest;
  batten_orient_info info;
} orientation;

/* Least energy on a subset; its field's gradients at all points come into o->energy. */
static batten_status orient_subset(batten_context *ctx, orientation *o, size_t energy_points) {
  unsigned n = o->n;
  size_t most = energy_points < o->count ? energy_points : o->count;
  batten_orient_graph part = {0};
  batten_orient_field field = {0};
  double *points = NULL, *start = NULL;
  batten_status status = BATTEN_E_NOMEM;
  size_t *chosen = batten_alloc_array(ctx, most, sizeof *chosen);
  if (!chosen || !(points = batten_alloc_array(ctx, most, n * sizeof *points)) ||
      !(start = batten_alloc_array(ctx, most, n * sizeof *start)))
    goto done;
  size_t found = most;
  if ((status = batten_orient_spread(ctx, &o->graph, &found, chosen, o->energy)) < 0) goto done;
  for (size_t i = 0; i < found; i++) {
    memcpy(points + i * n, o->points + chosen[i] * n, n * sizeof *points);
    memcpy(start + i * n, o->planes + chosen[i] * n, n * sizeof *start);
  }
  if ((status = batten_orient_graph_new(ctx, n, found, points, false, 0.4, &part)) < 0) goto done;
  if ((status = batten_orient_energy(ctx, &part, start, &field)) < 0) goto done;
  status = batten_orient_field_gradients(ctx, &field, o->count, o->points, o->energy);
  o->info.lambda = field.lambda;
  o->info.energy_points = found;
done:
  batten_orient_field_free(ctx, &field);
  batten_orient_graph_free(ctx, &part);
  batten_free(ctx, start);
  batten_free(ctx, points);
  batten_free(ctx, chosen);
  return status;
}

static batten_status orient_all(batten_context *ctx, orientation *o) {
  batten_orient_field field;
  batten_status status = batten_orient_energy(ctx, &o->graph, o->planes, &field);
  if (status < 0) return status;
  memcpy(o->energy, field.normals, o->count * o->n * sizeof *o->energy);
  o->info.lambda = field.lambda;
  o->info.energy_points = o->count;
  batten_orient_field_free(ctx, &field);
  return BATTEN_OK;
}

typedef struct crowd_query {
  const batten_tree *tree;
  const double *unit;
  const size_t *order;
  unsigned n;
  unsigned char *crowded; /* [count] in the tree's order */
} crowd_query;

static void find_crowded(void *arg, size_t i) {
  const crowd_query *q = arg;
  q->crowded[i] = batten_tree_any_within(q->tree, q->unit + q->order[i] * q->n, SAME, q->order[i]);
}

/* Says which points are different, in the tree's order; o->count becomes how many, o->place where each of the given
 * ones went. Nearly all points are alone, which is found by tasks; who stands for the others depends on those before.
 * first [given]: out, the caller's index of each different point. */
static batten_status merge_points(batten_context *ctx, orientation *o, const batten_tree *tree, const double *unit,
                                  size_t *first) {
  unsigned n = o->n;
  size_t *order = batten_alloc_array(ctx, o->given, sizeof *order), *near = NULL;
  unsigned char *crowded = batten_alloc(ctx, o->given);
  batten_status status = order && crowded ? BATTEN_OK : BATTEN_E_NOMEM;
  if (status < 0) goto done;
  batten_tree_order(tree, order);
  status = batten_for_points(ctx, "merge", o->given, find_crowded, &(crowd_query){tree, unit, order, n, crowded});
  if (status < 0) goto done;
  for (size_t i = 0; i < o->given; i++) o->place[i] = SIZE_MAX;
  o->count = 0;
  for (size_t i = 0; i < o->given; i++) {
    if (o->place[order[i]] != SIZE_MAX) continue;
    if (crowded[i]) {
      if (!near && !(near = batten_alloc_array(ctx, o->given, sizeof *near))) {
        status = BATTEN_E_NOMEM;
        goto done;
      }
      size_t found = batten_tree_within(tree, unit + order[i] * n, SAME, near);
      for (size_t q = 0; q < found; q++)
        if (o->place[near[q]] == SIZE_MAX) o->place[near[q]] = o->count;
    }
    o->place[order[i]] = o->count;
    first[o->count++] = order[i];
  }
  if (o->count < n + 2)
    status = batten_fail(ctx, BATTEN_E_INVALID, "points: %zu different ones; %u or more are needed", o->count, n + 2);
done:
  batten_free(ctx, near);
  batten_free(ctx, crowded);
  batten_free(ctx, order);
  return status;
}

/* Unit size, tree's order, each place once. */
static batten_status take_points(batten_context *ctx, orientation *o, const double *points) {
  unsigned n = o->n;
  batten_tree *tree = NULL;
  size_t *first = NULL;
  double *unit = batten_alloc_array(ctx, o->given, n * sizeof *unit);
  batten_status status = unit ? to_unit_size(ctx, n, o->given, points, unit) : BATTEN_E_NOMEM;
  if (status >= 0) status = batten_progress(ctx, "orient", 0);
  if (status >= 0) status = batten_tree_new(ctx, n, o->given, unit, &tree);
  if (status < 0) goto done;
  status = BATTEN_E_NOMEM;
  if (!(o->place = batten_alloc_array(ctx, o->given, sizeof *o->place)) ||
      !(first = batten_alloc_array(ctx, o->given, sizeof *first)))
    goto done;
  if ((status = merge_points(ctx, o, tree, unit, first)) < 0) goto done;
  status = BATTEN_E_NOMEM;
  if (!(o->points = batten_alloc_array(ctx, o->count, n * sizeof *o->points))) goto done;
  for (size_t i = 0; i < o->count; i++) memcpy(o->points + i * n, unit + first[i] * n, n * sizeof *unit);
  status = BATTEN_OK;
done:
  batten_tree_free(ctx, tree);
  batten_free(ctx, first);
  batten_free(ctx, unit);
  return status;
}

/* Energy in the end, where AUTO does not find planes less in doubt. */
static batten_status orient_by_energy(batten_context *ctx, orientation *o, bool automatic, size_t energy_points) {
  if (!(o->energy = batten_alloc_array(ctx, o->count, o->n * sizeof *o->energy))) return BATTEN_E_NOMEM;
  bool whole = o->count <= energy_points, refined = false;
  batten_status status = whole ? orient_all(ctx, o) : orient_subset(ctx, o, energy_points);
  if (automatic && status == BATTEN_E_SINGULAR) return BATTEN_OK;
  if (status >= 0 && o->count / REFINE >= energy_points) {
    batten_orient_forest_plant(&o->graph, &o->forest);
    status = batten_orient_refine(ctx, &o->graph, &o->forest, o->planes, o->energy, &o->info.pieces,
                                  &o->info.doubtful, &refined);
  }
  if (status >= 0 && !whole && !refined) sign_planes(&o->graph, o->energy);
  if (status < 0) return status;
  if (refined || !automatic ||
      batten_orient_doubt(&o->graph, o->energy) <= batten_orient_doubt(&o->graph, o->planes) + DOUBT)
    o->info.method = BATTEN_ORIENT_METHOD_ENERGY;
  return BATTEN_OK;
}

static void release(batten_context *ctx, orientation *o) {
  batten_orient_forest_free(ctx, &o->forest);
  batten_orient_graph_free(ctx, &o->graph);
  batten_free(ctx, o->energy);
  batten_free(ctx, o->planes);
  batten_free(ctx, o->points);
  batten_free(ctx, o->place);
}

batten_orient_options batten_orient_options_default(void) {
  return (batten_orient_options){.struct_size = sizeof(batten_orient_options), .energy_points = 1000};
}

batten_status batten_orient_points(batten_context *ctx, unsigned n, size_t count, const double *points,
                                   const batten_orient_options *opt, double *normals, batten_orient_info *info) {
  batten_orient_options used = opt ? *opt : batten_orient_options_default();
  batten_status status = batten_check_struct(ctx, "batten_orient_options", used.struct_size, sizeof used);
  if (status >= 0) status = check(ctx, n, count, points, used.method, used.energy_points, normals);
  if (status < 0) return status;
  orientation o = {.n = n, .given = count, .info.method = BATTEN_ORIENT_METHOD_PLANES};
  if ((status = take_points(ctx, &o, points)) < 0) goto done;
  status = BATTEN_E_NOMEM;
  if (!(o.planes = batten_alloc_array(ctx, o.count, n * sizeof *o.planes))) goto done;
  bool many = o.count > used.energy_points;
  if ((status = batten_progress(ctx, "orient", 0.05)) < 0) goto done;
  if ((status = batten_orient_graph_new(ctx, n, o.count, o.points, many, 0.05, &o.graph)) < 0) goto done;
  if (many && (status = batten_orient_find_strays(ctx, &o.graph)) < 0) goto done;
  if ((status = batten_orient_forest_new(ctx, &o.graph, &o.forest)) < 0) goto done;
  if ((status = batten_orient_planes(ctx, &o.graph, &o.forest, o.planes)) < 0) goto done;
  if (used.method != BATTEN_ORIENT_METHOD_PLANES)
    status = orient_by_energy(ctx, &o, used.method == BATTEN_ORIENT_METHOD_AUTO, used.energy_points);
  if (status < 0) goto done;
  bool energy = o.info.method == BATTEN_ORIENT_METHOD_ENERGY;
  for (size_t i = 0; i < count; i++)
    memcpy(normals + i * n, (energy ? o.energy : o.planes) + o.place[i] * n, n * sizeof *normals);
  o.info.strays = o.graph.strays;
  o.info.lambda = energy ? lambda_in_box(n, o.count, o.points, o.info.lambda) : 0;
  if (!energy) o.info.energy_points = o.info.pieces = o.info.doubtful = 0;
  if (info) *info = o.info;
done:
  release(ctx, &o);
  return status;
}

batten_status batten_orient(batten_context *ctx, unsigned n, size_t count, const double *points,
                            batten_orient_method method, size_t energy_points, double *normals,
                            batten_orient_method *method_used, double *lambda_used) {
  batten_orient_options opt = batten_orient_options_default();
  batten_orient_info info;
  opt.method = method;
  opt.energy_points = energy_points;
  batten_status status = batten_orient_points(ctx, n, count, points, &opt, normals, &info);
  if (status < 0) return status;
  if (method_used) *method_used = info.method;
  if (lambda_used) *lambda_used = info.lambda;
  return status;
}
