/* The points of a fit: checked, duplicates merged, spacing measured.
 *
 * Merging goes through the points in the order given: the first one of a place stays, bits and normal and all, and
 * every later point within the radius of one that stayed is dropped. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "base/points.h"
#include "basis/eigen3.h"
#include "solid/solid_inner.h"

/* Points nearer than this part of the box's diagonal are the same but for rounding (what the spline refuses). */
static const double SAME = 1e-12;

static batten_status check_points(batten_context *ctx, const char *name, unsigned n, size_t count,
                                  const double *points) {
  size_t bad = batten_first_nonfinite(count * n, points);
  if (bad == count * n) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: coordinate %zu is %g; remove the point", name, bad / n, bad % n,
                     points[bad]);
}

static void measure_box(surface_data *d, size_t count, const double *points) {
  double square = 0;
  for (unsigned k = 0; k < d->n; k++) {
    d->lower[k] = INFINITY;
    d->upper[k] = -INFINITY;
    for (size_t i = 0; i < count; i++) {
      d->lower[k] = fmin(d->lower[k], points[i * d->n + k]);
      d->upper[k] = fmax(d->upper[k], points[i * d->n + k]);
    }
    double half = d->upper[k] / 2 - d->lower[k] / 2;
    d->middle[k] = d->lower[k] + half;
    square += half * half;
  }
  d->radius = sqrt(square);
}

typedef struct crowd_query {
  const batten_tree *tree;
  const double *points;
  unsigned n;
  double radius;
  unsigned char *crowded; /* [count] */
} crowd_query;

static void find_crowded(void *arg, size_t i) {
  const crowd_query *q = arg;
  q->crowded[i] = batten_tree_any_within(q->tree, q->points + i * q->n, q->radius, i);
}

/* kept[0 .. *kept_count): increasing indices of the points that stay. *whole: the tree of all points, which is the
 * caller's. Nearly all points are alone, which is found by tasks; who of the others stays depends on those before. */
static batten_status merge(batten_context *ctx, unsigned n, size_t count, const double *points, double radius,
                           size_t *kept, size_t *kept_count, batten_tree **whole) {
  enum { ALONE, CROWDED, GONE };
  unsigned char *state = batten_alloc_array(ctx, count, 1);
  size_t *near = batten_alloc_array(ctx, count, sizeof *near);
  batten_status st = state && near ? batten_tree_new(ctx, n, count, points, whole) : BATTEN_E_NOMEM;
  crowd_query q = {.tree = *whole, .points = points, .n = n, .radius = radius, .crowded = state};
  if (st >= 0) st = batten_for_points(ctx, "merge", count, find_crowded, &q);
  if (st < 0) goto done;
  *kept_count = 0;
  for (size_t i = 0; i < count; i++) {
    if (state[i] == GONE) continue;
    kept[(*kept_count)++] = i;
    if (state[i] == ALONE) continue;
    size_t found = batten_tree_within(*whole, points + i * n, radius, near);
    for (size_t j = 0; j < found; j++) state[near[j]] = GONE;
  }
done:
  batten_free(ctx, state);
  batten_free(ctx, near);
  return st;
}

static batten_status gather_normals(batten_context *ctx, surface_data *d, const size_t *kept, const double *normals) {
  size_t n = d->n;
  batten_status st = check_points(ctx, "normals", d->n, d->given, normals);
  if (st < 0) return st;
  d->normals = batten_alloc_array(ctx, d->count, n * sizeof(double));
  if (!d->normals) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < d->count; i++) {
    const double *v = normals + kept[i] * n;
    double largest = 0, square = 0;
    for (size_t k = 0; k < n; k++) largest = fmax(largest, fabs(v[k]));
    if (!(largest > 0))
      return batten_fail(ctx, BATTEN_E_INVALID, "normals[%zu]: its length is 0; give a direction, or no normals",
                         kept[i]);
    for (size_t k = 0; k < n; k++) square += (v[k] / largest) * (v[k] / largest);
    for (size_t k = 0; k < n; k++) d->normals[i * n + k] = v[k] / largest / sqrt(square);
  }
  return BATTEN_OK;
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

enum { NEIGHBOURS = 6 };

enum { NEIGHBOURS_MAX = 256 };

/* Points of a surface may come in lines much denser than the lines lie (scan lines, planar cuts): where the nearest
 * points of point i lie along a line, the distance to the nearest point aside of it, else 0. near, distance
 * [NEIGHBOURS_MAX] scratch. */
static double gap_of_lines(const surface_data *d, size_t i, const size_t *nearest, size_t *near, double *distance) {
  const double *x = d->points + 3 * i;
  double moment[9] = {0}, values[3], axes[9];
  for (size_t j = 0; j < NEIGHBOURS; j++)
    for (unsigned a = 0; a < 3; a++)
      for (unsigned b = 0; b < 3; b++)
        moment[3 * a + b] += (d->points[3 * nearest[j] + a] - x[a]) * (d->points[3 * nearest[j] + b] - x[b]);
  batten_eigen_symmetric(3, moment, values, axes);
  /* Spread across under a third of that along: random points on a surface stay above it in 95 of 100 places, and for
   * the others the answer below is about their spacing anyway. */
  if (values[1] > 0.1 * values[2]) return 0;
  const double *along = axes + 6;
  for (size_t k = 16;; k *= 4) {
    size_t found = batten_tree_nearest(d->tree, x, k, i, near, distance);
    for (size_t j = 0; j < found; j++) {
      double t = 0;
      for (unsigned a = 0; a < 3; a++) t += (d->points[3 * near[j] + a] - x[a]) * along[a];
      if (t * t < 0.5 * distance[j] * distance[j]) return distance[j]; /* more than 45 degrees aside */
    }
    if (found < k || k == NEIGHBOURS_MAX) return distance[found - 1];
  }
}

/* In the plane: the distance to the nearest point that lies another way than the nearest one (60 degrees off), so
 * that both sides of a wide gap on the contour know of it. */
static double gap_of_contour(const surface_data *d, size_t i, size_t *near, double *distance) {
  const double *x = d->points + 2 * i;
  for (size_t k = 4;; k *= 4) {
    size_t found = batten_tree_nearest(d->tree, x, k, i, near, distance);
    const double *first = d->points + 2 * near[0];
    for (size_t j = 1; j < found; j++) {
      const double *other = d->points + 2 * near[j];
      double t = (first[0] - x[0]) * (other[0] - x[0]) + (first[1] - x[1]) * (other[1] - x[1]);
      if (t < 0.5 * distance[0] * distance[j]) return distance[j];
    }
    if (found < k || k == NEIGHBOURS_MAX) return distance[found - 1];
  }
}

/* Each value becomes the largest among the point's neighbours and its own. */
static void spread(size_t count, size_t k, const size_t *index, double *values, double *scratch) {
  for (size_t i = 0; i < count; i++) {
    scratch[i] = values[i];
    for (size_t j = 0; j < k; j++) scratch[i] = fmax(scratch[i], values[index[i * k + j]]);
  }
  memcpy(values, scratch, count * sizeof *values);
}

/* What a gap between lines counts as, so that the sign check asks from 1.25 of it on: the middle is half a gap away.
 */
static const double LINE_GAP = 0.5;
/* Where lines cross, the points of the crossing know of no gap: they learn it from neighbours of neighbours. */
enum { ROUNDS = 3 };

typedef struct gap_query {
  const surface_data *data;
  size_t k;
  const size_t *index; /* [count][k] nearest points */
  double *own;         /* [count] */
} gap_query;

static void measure_own_gap(void *arg, size_t i) {
  const gap_query *q = arg;
  const surface_data *d = q->data;
  const bool lines = d->n == 3 && q->k == NEIGHBOURS;
  size_t near[NEIGHBOURS_MAX];
  double distance[NEIGHBOURS_MAX];
  q->own[i] = d->n == 2 ? gap_of_contour(d, i, near, distance)
              : lines   ? gap_of_lines(d, i, q->index + i * q->k, near, distance)
                        : 0;
}

/* gap: how far the surface may be expected to go on without data. In space the spacing, or what is left
 * free between lines about a point. */
static batten_status measure_gaps(batten_context *ctx, surface_data *d, size_t k, const size_t *index) {
  double *own = batten_alloc_array(ctx, d->count, sizeof *own);
  batten_status st = own ? BATTEN_OK : BATTEN_E_NOMEM;
  gap_query q = {.data = d, .k = k, .index = index, .own = own};
  if (st >= 0) st = batten_for_points(ctx, "gaps", d->count, measure_own_gap, &q);
  if (st < 0) goto done;
  for (size_t i = 0; i < d->count; i++) d->in_lines += d->n == 3 && own[i] > 3 * d->spacing[i];
  for (unsigned round = 0; d->n == 3 && round < ROUNDS; round++) spread(d->count, k, index, own, d->gap);
  for (size_t i = 0; i < d->count; i++) d->gap[i] = fmax(d->spacing[i], (d->n == 3 ? LINE_GAP : 1) * own[i]);
done:
  batten_free(ctx, own);
  return st;
}

/* Local spacing: mean distance to the points around, 2 on a curve and 6 on a surface. */
static batten_status measure_spacing(batten_context *ctx, surface_data *d) {
  size_t k = d->n == 3 ? NEIGHBOURS : d->n == 2 ? 2 : 1, count = d->count;
  if (k > count - 1) k = count - 1;
  size_t *index = batten_alloc_array(ctx, count, k * sizeof *index);
  double *distance = batten_alloc_array(ctx, count, k * sizeof *distance);
  double *nearest = batten_alloc_array(ctx, count, sizeof *nearest);
  d->spacing = batten_alloc_array(ctx, count, sizeof(double));
  d->gap = batten_alloc_array(ctx, count, sizeof(double));
  batten_status st = index && distance && nearest && d->spacing && d->gap ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_tree_neighbours(ctx, d->tree, k, index, distance);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) {
    double sum = 0;
    for (size_t j = 0; j < k; j++) sum += distance[i * k + j];
    d->spacing[i] = sum / (double)k;
    nearest[i] = distance[i * k];
  }
  qsort(nearest, count, sizeof *nearest, compare_doubles);
  d->spacing_median = nearest[count / 2];
  st = measure_gaps(ctx, d, k, index);
done:
  batten_free(ctx, index);
  batten_free(ctx, distance);
  batten_free(ctx, nearest);
  return st;
}

void batten_surface_data_free(batten_context *ctx, surface_data *d) {
  batten_free(ctx, d->points);
  batten_free(ctx, d->normals);
  batten_free(ctx, d->smoothing);
  batten_free(ctx, d->spacing);
  batten_free(ctx, d->gap);
  batten_tree_free(ctx, d->tree);
  *d = (surface_data){0};
}

batten_status batten_surface_data_make(batten_context *ctx, unsigned n, size_t count, const double *points,
                                       const batten_solid_options *opt, surface_data *out) {
  surface_data d = {.n = n, .given = count};
  size_t *kept = batten_alloc_array(ctx, count, sizeof *kept);
  batten_status st = kept ? check_points(ctx, "points", n, count, points) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  measure_box(&d, count, points);
  if (!isfinite(4 * d.radius * d.radius)) {
    st = batten_fail(ctx, BATTEN_E_INVALID, "points: a box of half diagonal %g; scale them down", d.radius);
    goto done;
  }
  st = merge(ctx, n, count, points, fmax(opt->merge_radius, SAME * 2 * d.radius), kept, &d.count, &d.tree);
  if (st < 0) goto done;
  if (d.count < count) { /* not the tree of those that stay */
    batten_tree_free(ctx, d.tree);
    d.tree = NULL;
  }
  if (d.count < n + 1u) {
    st = batten_fail(ctx, BATTEN_E_INVALID,
                     "points: %zu, of them %zu distinct; at least %u are needed in %u dimensions", count, d.count,
                     n + 1u, n);
    goto done;
  }
  st = BATTEN_E_NOMEM;
  d.points = batten_alloc_array(ctx, d.count, n * sizeof(double));
  if (!d.points) goto done;
  for (size_t i = 0; i < d.count; i++) memcpy(d.points + i * n, points + kept[i] * n, n * sizeof(double));
  if (opt->spline.smoothing_per_point) {
    d.smoothing = batten_alloc_array(ctx, d.count, sizeof(double));
    if (!d.smoothing) goto done;
    for (size_t i = 0; i < d.count; i++) d.smoothing[i] = opt->spline.smoothing_per_point[kept[i]];
  }
  measure_box(&d, d.count, d.points);
  st = opt->normals ? gather_normals(ctx, &d, kept, opt->normals) : BATTEN_OK;
  if (st >= 0 && !d.tree) st = batten_tree_new(ctx, n, d.count, d.points, &d.tree);
  if (st >= 0) st = measure_spacing(ctx, &d);
done:
  batten_free(ctx, kept);
  if (st < 0)
    batten_surface_data_free(ctx, &d);
  else
    *out = d;
  return st;
}
