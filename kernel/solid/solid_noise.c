/* Noise of surface points, and the smoothing that it asks for.
 *
 *   estimate  At some thousand points a quadric over the local plane is fitted to the nearest neighbours by least
 *             squares; the root mean square of what it leaves, over k + 1 - 6 degrees of freedom, is the noise there.
 *             Its median over the places passes over edges and strays. A plane would take curvature for noise.
 *   choice    Discrepancy principle [Morozov 1966]: the smoothing rho at which the root mean square distance
 *             |f| / |grad f| of the points from the surface is the noise, by the secant method on log rho against the
 *             log of that distance, which grows with rho throughout.
 *
 * How rho depends on the number of points N, with the noise s the same: the spline minimises
 * energy + sum (f(x_i) - v_i)^2 / rho, the sum grows with N, so the same spline for other N has rho = N c. At the
 * discrepancy the spline's own bias^2 is about s^2 times the part of the noise that it still follows, that part
 * goes like c^(-2/3) / N (kernel r on a surface), bias^2 like c^1 to c^2 with the surface's smoothness: hence c goes
 * like N^(-3/5) to N^(-3/8), and rho like N^(2/5) to N^(5/8). So rho of a subset times the root of N over its points
 * is a good start for all. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "basis/eigen3.h"
#include "solid/solid_inner.h"
#include "solid/solid_noise.h"

enum { NEIGHBOURS_3D = 32, NEIGHBOURS_2D = 10, PLACES = 4096, TERMS = 6, SAMPLE = 3000 };

static double dot(size_t n, const double *a, const double *b) {
  double sum = 0;
  for (size_t k = 0; k < n; k++) sum += a[k] * b[k];
  return sum;
}

/* Solves the normal equations A c = r, A [terms][terms] positive semidefinite, by elimination with the diagonal as
 * pivot; unknowns whose pivot has vanished stay 0. */
static void solve_normal(size_t terms, double a[TERMS][TERMS], double *r) {
  bool kept[TERMS];
  double first[TERMS];
  for (size_t p = 0; p < terms; p++) first[p] = a[p][p];
  for (size_t p = 0; p < terms; p++) {
    kept[p] = a[p][p] > 1e-10 * first[p];
    for (size_t q = p + 1; kept[p] && q < terms; q++) {
      double factor = a[q][p] / a[p][p];
      for (size_t c = p; c < terms; c++) a[q][c] -= factor * a[p][c];
      r[q] -= factor * r[p];
    }
  }
  for (size_t p = terms; p-- > 0;) {
    for (size_t c = p + 1; c < terms; c++) r[p] -= a[p][c] * r[c];
    r[p] = kept[p] ? r[p] / a[p][p] : 0;
  }
}

/* 1, u, v, u^2, u v, v^2, or 1, u, u^2. */
static size_t monomials(size_t n, double u, double v, double *out) {
  if (n == 2) return out[0] = 1, out[1] = u, out[2] = u * u, 3;
  out[0] = 1, out[1] = u, out[2] = v, out[3] = u * u, out[4] = u * v, out[5] = v * v;
  return TERMS;
}

/* What a quadric leaves of point i and its neighbours. */
static double residual_at(const surface_data *d, size_t i, size_t k) {
  size_t n = d->n, index[NEIGHBOURS_3D], terms = 0;
  double distance[NEIGHBOURS_3D], local[NEIGHBOURS_3D + 1][3], second[9] = {0}, values[3], axes[9], mean[3] = {0};
  size_t found = batten_tree_nearest(d->tree, d->points + i * n, k, i, index, distance);
  for (size_t q = 0; q <= found; q++)
    for (size_t c = 0; c < n; c++)
      mean[c] += (d->points[(q < found ? index[q] : i) * n + c] - d->points[i * n + c]) / (double)(found + 1);
  for (size_t q = 0; q <= found; q++) {
    size_t j = q < found ? index[q] : i;
    for (size_t c = 0; c < n; c++) local[q][c] = d->points[j * n + c] - d->points[i * n + c] - mean[c];
    for (size_t r = 0; r < n; r++)
      for (size_t c = 0; c < n; c++) second[r * n + c] += local[q][r] * local[q][c];
  }
  batten_eigen_symmetric((unsigned)n, second, values, axes);
  double scale = sqrt(values[n - 1]), a[TERMS][TERMS] = {{0}}, right[TERMS] = {0}, m[TERMS], square = 0;
  if (!(scale > 0)) return 0;
  for (int pass = 0; pass < 2; pass++) {
    for (size_t q = 0; q <= found; q++) {
      double height = dot(n, local[q], axes);
      terms = monomials(n, dot(n, local[q], axes + n * (n - 1)) / scale, dot(n, local[q], axes + n) / scale, m);
      for (size_t p = 0; p < terms && pass == 0; p++) {
        right[p] += m[p] * height;
        for (size_t c = 0; c < terms; c++) a[p][c] += m[p] * m[c];
      }
      double left = height - dot(terms, m, right);
      if (pass == 1) square += left * left;
    }
    if (pass == 0) solve_normal(terms, a, right);
  }
  return found + 1 > terms ? sqrt(square / (double)(found + 1 - terms)) : 0;
}

typedef struct estimate_task {
  const surface_data *data;
  size_t k, stride, places;
  double *residuals;
} estimate_task;

enum { CHUNK = 32 };

static void estimate_chunk(void *task, size_t chunk) {
  const estimate_task *t = task;
  size_t end = (chunk + 1) * CHUNK < t->places ? (chunk + 1) * CHUNK : t->places;
  for (size_t p = chunk * CHUNK; p < end; p++) t->residuals[p] = residual_at(t->data, p * t->stride, t->k);
}

static int compare_doubles(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

batten_status batten_solid_estimate_noise(batten_context *ctx, const surface_data *d, double *noise) {
  size_t stride = d->count / PLACES + 1, places = (d->count + stride - 1) / stride;
  estimate_task task = {d, d->n == 3 ? NEIGHBOURS_3D : NEIGHBOURS_2D, stride, places,
                        batten_alloc_array(ctx, places, sizeof(double))};
  if (!task.residuals) return BATTEN_E_NOMEM;
  batten_parallel(ctx, (places + CHUNK - 1) / CHUNK, estimate_chunk, &task);
  qsort(task.residuals, places, sizeof *task.residuals, compare_doubles);
  *noise = task.residuals[places / 2];
  batten_free(ctx, task.residuals);
  return BATTEN_OK;
}

/* Beyond so many times the noise a point is a stray and counts as if it were there; so do vanishing gradients. */
static const double CUT = 5;

double batten_solid_cut_distance(double f, double slope, double noise) {
  const double most = CUT * noise;
  return noise > 0 && f > most * slope ? most : f > 0 ? f / slope : 0;
}

batten_status batten_solid_rms_distance(batten_context *ctx, const batten_solid *s, size_t of, const double *points,
                                        double noise, double *rms) {
  /* Many are evenly drawn: direct sums at all would take time in proportion to their square. */
  const size_t n = s->n, count = batten_solid_points_to_sum(s, of);
  double *values = batten_alloc_array(ctx, count, (2 * n + 1) * sizeof *values), sum = 0;
  if (!values) return BATTEN_E_NOMEM;
  double *at = values + count * (n + 1);
  for (size_t q = 0; q < count; q++) memcpy(at + q * n, points + batten_drawn(q, count, of) * n, n * sizeof *at);
  batten_status st = batten_solid_evaluate(ctx, s, count, at, values, values + count, NULL);
  for (size_t i = 0; st >= 0 && i < count; i++) {
    const double *g = values + count + i * n;
    const double distance = batten_solid_cut_distance(fabs(values[i]), sqrt(dot(n, g, g)), noise);
    sum += distance * distance;
  }
  *rms = sqrt(sum / (double)count);
  batten_free(ctx, values);
  return st;
}

/* ---- the choice ---------------------------------------------------------------------------------- */

enum { FITS_MAX = 12 };
/* Of the distance: 5 % is what 200 points know of their own noise. */
static const double NEAR = 0.05;
/* Where the unit box has lost all detail, and where rounding has the last word. */
static const double MOST = 1e6, LEAST = 1e-12;

batten_status batten_solid_find_smoothing(batten_context *ctx, double noise, double start,
                                          batten_smoothing_trial trial, void *user, double *rho, double *reached) {
  double low = LEAST, high = MOST, x = log(start), last_x = 0, last_y = 0, best = INFINITY;
  for (int fit = 0; fit < FITS_MAX; fit++) {
    double rms;
    batten_status st = trial(ctx, user, exp(x), &rms);
    if (st < 0) return st;
    double y = log(fmax(rms, 1e-9 * noise) / noise);
    if (fabs(y) < best) {
      best = fabs(y);
      *rho = exp(x);
      *reached = rms;
    }
    if (fabs(y) <= NEAR) break;
    if (y < 0)
      low = fmax(low, exp(x));
    else
      high = fmin(high, exp(x));
    if (high <= low * 1.01) break;
    /* The distance goes about like rho^(2/3) where neither end is near. */
    double slope = fit > 0 && x != last_x ? (y - last_y) / (x - last_x) : 0.67, next;
    slope = fmin(fmax(slope, 0.15), 1.5);
    next = x - fmin(fmax(y / slope, -5), 5);
    if (next <= log(low) || next >= log(high)) next = (log(low) + log(high)) / 2;
    last_x = x;
    last_y = y;
    x = next;
  }
  return BATTEN_OK;
}

/* ---- the subset ---------------------------------------------------------------------------------- */

batten_status batten_solid_noise_subset(batten_context *ctx, const surface_data *d, const batten_solid_options *opt,
                                        const double *normals, surface_data *out, double **out_normals) {
  size_t n = d->n, stride = (d->count + SAMPLE - 1) / SAMPLE, count = (d->count + stride - 1) / stride;
  batten_solid_options o = *opt;
  size_t *order = batten_alloc_array(ctx, d->count, sizeof *order);
  double *points = batten_alloc_array(ctx, count, n * sizeof *points), *some = NULL;
  batten_status st = order && points ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st >= 0 && normals && !(some = batten_alloc_array(ctx, count, n * sizeof *some))) st = BATTEN_E_NOMEM;
  if (st < 0) goto done;
  batten_tree_order(d->tree, order); /* neighbours stand together: every so many is well spread */
  for (size_t i = 0; i < count; i++) {
    memcpy(points + i * n, d->points + order[i * stride] * n, n * sizeof *points);
    if (some) memcpy(some + i * n, normals + order[i * stride] * n, n * sizeof *some);
  }
  o.normals = some; /* merging keeps them beside their points */
  o.merge_radius = 0;
  o.spline.smoothing_per_point = NULL;
  st = batten_surface_data_make(ctx, d->n, count, points, &o, out);
  if (st >= 0) *out_normals = out->normals;
done:
  batten_free(ctx, some);
  batten_free(ctx, points);
  batten_free(ctx, order);
  return st;
}

bool batten_solid_noise_is_large(const surface_data *d) { return d->count > 2 * SAMPLE; }
