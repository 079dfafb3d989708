/* The points of a fit: checked, duplicates merged, spacing measured.
 *
 * Merging goes through the points in the order given: the first one of a place stays, bits and normal and all, and
 * every later point within the radius of one that stayed is dropped. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
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

/* kept[0 .. *kept_count): increasing indices of the points that stay. */
static batten_status merge(batten_context *ctx, unsigned n, size_t count, const double *points, double radius,
                           size_t *kept, size_t *kept_count) {
  batten_tree *tree = NULL;
  unsigned char *gone = batten_alloc_array(ctx, count, 1);
  size_t *near = batten_alloc_array(ctx, count, sizeof *near);
  batten_status st = gone && near ? batten_tree_new(ctx, n, count, points, &tree) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  memset(gone, 0, count);
  *kept_count = 0;
  for (size_t i = 0; i < count; i++) {
    if (gone[i]) continue;
    kept[(*kept_count)++] = i;
    size_t found = batten_tree_within(tree, points + i * n, radius, near);
    for (size_t j = 0; j < found; j++) gone[near[j]] = 1;
  }
done:
  batten_tree_free(ctx, tree);
  batten_free(ctx, gone);
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

/* Local spacing: mean distance to the points around, 2 on a curve and 6 on a surface. */
static batten_status measure_spacing(batten_context *ctx, surface_data *d) {
  size_t k = d->n == 3 ? NEIGHBOURS : d->n == 2 ? 2 : 1, count = d->count;
  if (k > count - 1) k = count - 1;
  size_t *index = batten_alloc_array(ctx, count, k * sizeof *index);
  double *distance = batten_alloc_array(ctx, count, k * sizeof *distance);
  double *nearest = batten_alloc_array(ctx, count, sizeof *nearest);
  d->spacing = batten_alloc_array(ctx, count, sizeof(double));
  batten_status st = index && distance && nearest && d->spacing ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0) st = batten_neighbours(ctx, d->n, count, d->points, k, index, distance);
  if (st < 0) goto done;
  for (size_t i = 0; i < count; i++) {
    double sum = 0;
    for (size_t j = 0; j < k; j++) sum += distance[i * k + j];
    d->spacing[i] = sum / (double)k;
    nearest[i] = distance[i * k];
  }
  qsort(nearest, count, sizeof *nearest, compare_doubles);
  d->spacing_median = nearest[count / 2];
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
  st = merge(ctx, n, count, points, fmax(opt->merge_radius, SAME * 2 * d.radius), kept, &d.count);
  if (st < 0) goto done;
  if (d.count < n + 1u) {
    st = batten_fail(ctx, BATTEN_E_INVALID, "points: %zu, of them %zu distinct; at least %u are needed in %u dimensions",
                     count, d.count, n + 1u, n);
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
  if (st >= 0) st = measure_spacing(ctx, &d);
  if (st >= 0) st = batten_tree_new(ctx, n, d.count, d.points, &d.tree);
done:
  batten_free(ctx, kept);
  if (st < 0)
    batten_surface_data_free(ctx, &d);
  else
    *out = d;
  return st;
}
