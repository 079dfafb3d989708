/* What can be wrong with the data of a spline, said in words of geometry. */
#include "spline/inner.h"

#include "base/checked.h"
#include "base/neighbours.h"
#include "base/points.h"
#include "basis/eigen3.h"
#include "basis/green.h"

#include <float.h>

/* ---- single numbers ---- */

static batten_status check_rows(batten_context *ctx, const char *name, size_t count, size_t n, const double *values) {
  size_t i = batten_first_nonfinite(count * n, values);
  if (i == count * n) return BATTEN_OK;
  if (n == 1)
    return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu]: %g; must be finite, drop the point", name, i, values[i]);
  return batten_fail(ctx, BATTEN_E_INVALID, "%s[%zu][%zu]: %g; must be finite, drop the point", name, i / n, i % n,
                     values[i]);
}

static batten_status check_orders(batten_context *ctx, const batten_spline_data *data, unsigned m) {
  if (data->n < 1 || data->n > 3) return batten_fail(ctx, BATTEN_E_INVALID, "data.n: %u; must be 1, 2 or 3", data->n);
  if (2 * m <= data->n || m > 4)
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.m: %u; with n = %u it must be %u .. 4", m, data->n,
                       data->n / 2 + 1);
  if (data->gradient_count && batten_green_power(data->n, m) <= 2)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "data.gradient_count: %zu with m = %u; gradients need 2m - n > 2, take m = %u",
                       data->gradient_count, m, data->n / 2 + 2);
  return BATTEN_OK;
}

static batten_status check_method(batten_context *ctx, const batten_spline_data *data,
                                  const batten_spline_options *opt) {
  if (opt->saddle.method != BATTEN_SADDLE_ITERATIVE || batten_spline_sums_exist(data->n)) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID,
                     "opt.saddle.method: iterative with data.n = %u; it is for n = 2 and 3, choose another method",
                     data->n);
}

static batten_status check_gradients(batten_context *ctx, const batten_spline_data *data) {
  const size_t count = data->gradient_count;
  if (count > data->count)
    return batten_fail(ctx, BATTEN_E_INVALID, "data.gradient_count: %zu, more than data.count = %zu points", count,
                       data->count);
  for (size_t q = 0; q < count && data->gradient_at; q++)
    if (data->gradient_at[q] >= data->count || (q > 0 && data->gradient_at[q] <= data->gradient_at[q - 1]))
      return batten_fail(ctx, BATTEN_E_INVALID, "gradient_at[%zu]: %zu; must increase and be < data.count = %zu", q,
                         data->gradient_at[q], data->count);
  return check_rows(ctx, "gradients", count, data->n, data->gradients);
}

static batten_status check_smoothing(batten_context *ctx, const batten_spline_data *data,
                                     const batten_spline_options *opt) {
  if (!(opt->smoothing >= 0) || !isfinite(opt->smoothing))
    return batten_fail(ctx, BATTEN_E_INVALID, "opt.smoothing: %g; must be >= 0 and finite", opt->smoothing);
  for (size_t i = 0; i < data->count && opt->smoothing_per_point; i++)
    if (!(opt->smoothing_per_point[i] >= 0) || !isfinite(opt->smoothing_per_point[i]))
      return batten_fail(ctx, BATTEN_E_INVALID, "opt.smoothing_per_point[%zu]: %g; must be >= 0 and finite", i,
                         opt->smoothing_per_point[i]);
  return BATTEN_OK;
}

batten_status batten_spline_check_data(batten_context *ctx, const batten_spline_data *data,
                                       const batten_spline_options *opt) {
  batten_status st = batten_check_struct(ctx, "batten_spline_data", data->struct_size, sizeof *data);
  if (st < 0) return st;
  if ((st = batten_check_struct(ctx, "batten_spline_options", opt->struct_size, sizeof *opt)) < 0) return st;
  if ((st = check_orders(ctx, data, opt->m)) < 0) return st;
  if ((st = check_method(ctx, data, opt)) < 0) return st;
  size_t bytes;
  if (!batten_mul3(data->count, data->n, sizeof(double), &bytes))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "data.count: %zu", data->count);
  if ((data->count && (!data->points || !data->values)) || (data->gradient_count && !data->gradients))
    return batten_fail(ctx, BATTEN_E_INVALID, "data.%s: NULL",
                       !data->points   ? "points"
                       : !data->values ? "values"
                                       : "gradients");
  if (data->count == 0) return batten_fail(ctx, BATTEN_E_INVALID, "data.count: 0 points; at least one is needed");
  if ((st = check_rows(ctx, "points", data->count, data->n, data->points)) < 0) return st;
  if ((st = check_rows(ctx, "values", data->count, 1, data->values)) < 0) return st;
  if ((st = check_gradients(ctx, data)) < 0) return st;
  return check_smoothing(ctx, data, opt);
}

/* ---- equal points ---- */

/* Lexicographic order of points i and j: < 0, 0, > 0. */
static int compare(const spline_system *s, size_t i, size_t j) {
  for (unsigned a = 0; a < s->n; a++)
    if (s->y[a][i] != s->y[a][j]) return s->y[a][i] < s->y[a][j] ? -1 : 1;
  return 0;
}

/* Equal points in order of their index, so that the text names the first ones. */
static bool before(const spline_system *s, size_t i, size_t j) {
  int c = compare(s, i, j);
  return c < 0 || (c == 0 && i < j);
}

static void sift(const spline_system *s, size_t *order, size_t root, size_t count) {
  for (size_t child; (child = 2 * root + 1) < count; root = child) {
    if (child + 1 < count && before(s, order[child], order[child + 1])) child++;
    if (!before(s, order[root], order[child])) return;
    size_t t = order[root];
    order[root] = order[child];
    order[child] = t;
  }
}

/* Heap sort: qsort may take memory behind the context's back, and its order of equals is nobody's. */
static void sort_points(const spline_system *s, size_t *order) {
  for (size_t i = 0; i < s->count; i++) order[i] = i;
  for (size_t root = s->count / 2; root-- > 0;) sift(s, order, root, s->count);
  for (size_t last = s->count; last-- > 1;) {
    size_t t = order[0];
    order[0] = order[last];
    order[last] = t;
    sift(s, order, 0, last);
  }
}

typedef struct twin_query {
  const batten_tree *tree;
  const double *points;
  unsigned n;
  unsigned char *twin; /* [count] */
} twin_query;

static void find_twin(void *arg, size_t i) {
  const twin_query *q = arg;
  q->twin[i] = batten_tree_any_within(q->tree, q->points + i * q->n, 0, i);
}

/* Whether some points may be equal: found by tasks, where sorting would take the host's time. */
static batten_status look_for_twins(batten_context *ctx, const spline_system *s, bool *found) {
  batten_tree *tree = NULL;
  double *points = batten_alloc_array(ctx, s->count, s->n * sizeof *points);
  unsigned char *twin = batten_alloc_array(ctx, s->count, 1);
  batten_status st = points && twin ? BATTEN_OK : BATTEN_E_NOMEM;
  for (size_t i = 0; st >= 0 && i < s->count; i++)
    for (unsigned a = 0; a < s->n; a++) points[i * s->n + a] = s->y[a][i];
  if (st >= 0) st = batten_tree_new(ctx, s->n, s->count, points, &tree);
  twin_query q = {tree, points, s->n, twin};
  if (st >= 0) st = batten_for_points(ctx, "points", s->count, find_twin, &q);
  *found = false;
  for (size_t i = 0; st >= 0 && i < s->count; i++) *found = *found || twin[i];
  batten_tree_free(ctx, tree);
  batten_free(ctx, twin);
  batten_free(ctx, points);
  return st;
}

enum { SORTED = 20000 }; /* points that are sorted at once */

static batten_status check_distinct(batten_context *ctx, const spline_system *s) {
  if (s->count > SORTED) {
    bool found;
    batten_status st = look_for_twins(ctx, s, &found);
    if (st < 0 || !found) return st;
  }
  size_t *order = batten_alloc_array(ctx, s->count, sizeof *order);
  if (!order) return BATTEN_E_NOMEM;
  sort_points(s, order);
  size_t later = SIZE_MAX, earlier = 0;
  for (size_t i = 1; i < s->count; i++)
    if (compare(s, order[i - 1], order[i]) == 0 && order[i] < later) {
      earlier = order[i - 1];
      later = order[i];
    }
  batten_free(ctx, order);
  if (later == SIZE_MAX) return BATTEN_OK;
  return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu]: equals points[%zu]; merge equal points first", later,
                     earlier);
}

/* ---- points on a line or in a plane ---- */

typedef struct principal_axes {
  double mean[3], axis[9]; /* rows: smallest to largest spread */
} principal_axes;

static principal_axes find_axes(const spline_system *s) {
  principal_axes out = {{0, 0, 0}, {0}};
  double moment[9] = {0}, values[3];
  for (unsigned a = 0; a < s->n; a++) {
    for (size_t i = 0; i < s->count; i++) out.mean[a] += s->y[a][i];
    out.mean[a] /= (double)s->count;
  }
  for (unsigned a = 0; a < s->n; a++)
    for (unsigned b = a; b < s->n; b++)
      for (size_t i = 0; i < s->count; i++)
        moment[a * s->n + b] += (s->y[a][i] - out.mean[a]) * (s->y[b][i] - out.mean[b]);
  batten_eigen_symmetric(s->n, moment, values, out.axis);
  return out;
}

/* The moments square the coordinates, so their smallest eigenvalue cannot tell 1e-9 from 0; the axes are good to
 * rounding, and distances measured along them are too. */
static double thickness(const spline_system *s, const principal_axes *axes, unsigned which) {
  double largest = 0;
  for (size_t i = 0; i < s->count; i++) {
    double along = 0;
    for (unsigned a = 0; a < s->n; a++) along += axes->axis[which * s->n + a] * (s->y[a][i] - axes->mean[a]);
    if (fabs(along) > largest) largest = fabs(along);
  }
  return largest;
}

/* The points must not lie in one plane (line in 2-D): the linear part would not be determined; and where gradients
 * are given, m >= 3, and the square of the plane's equation vanishes with its gradient. */
static batten_status check_flat(batten_context *ctx, const spline_system *s) {
  if (s->m < 2 || s->n < 2) return BATTEN_OK;
  principal_axes axes = find_axes(s);
  double far = s->scale;
  for (unsigned a = 0; a < s->n; a++) far = fmax(far, fabs(s->origin[a]));
  /* 64: a few roundings of coordinates as far out as the points. */
  const double tolerance = 64 * DBL_EPSILON * far / s->scale;
  const double *normal = axes.axis, *along = axes.axis + (s->n - 1) * s->n;
  if (thickness(s, &axes, 0) > tolerance) return BATTEN_OK;
  if (s->n == 2)
    return batten_fail(ctx, BATTEN_E_SINGULAR,
                       "points: all %zu lie on a line with direction (%.6g, %.6g); add a point "
                       "off it, or fit in one dimension",
                       s->count, along[0], along[1]);
  if (thickness(s, &axes, 1) <= tolerance)
    return batten_fail(ctx, BATTEN_E_SINGULAR,
                       "points: all %zu lie on a line with direction (%.6g, %.6g, %.6g); add "
                       "points off it, or fit in one dimension",
                       s->count, along[0], along[1], along[2]);
  return batten_fail(ctx, BATTEN_E_SINGULAR,
                     "points: all %zu lie in a plane with normal (%.6g, %.6g, %.6g); add a point "
                     "off it, or fit in two dimensions",
                     s->count, normal[0], normal[1], normal[2]);
}

batten_status batten_spline_check_points(batten_context *ctx, const spline_system *s) {
  batten_status st = check_distinct(ctx, s);
  if (st < 0) return st;
  const unsigned k = s->basis.count;
  if (s->rows < k)
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "data.count: %zu points and %zu gradients give %zu conditions, the "
                       "polynomial of degree %u needs %u; add points or lower m",
                       s->count, s->gradient_count, s->rows, s->m - 1, k);
  return check_flat(ctx, s);
}
