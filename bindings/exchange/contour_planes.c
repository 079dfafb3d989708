/* The planes of contours in space.
 *
 * Sections of a body have a constant coordinate, mostly the same for all of them; that is looked for first, so that a
 * section that happens to be a straight line does not leave the others. Else the plane through the mean of the points
 * with the normal in which they spread least: the eigenvector of their covariance with the smallest eigenvalue. Its
 * axes are those of the coordinates turned into it as little as that goes: they tend to x y, x z or y z as the plane
 * does. */
#include "contours.h"

#include "base/checked.h"

#include <math.h>
#include <string.h>

static const double flat = 1e-6; /* distance from a plane, as a part of the contour's size: what text files round */

/* The others of coordinate k, in their order. */
static const int others[3][2] = {{1, 2}, {0, 2}, {0, 1}};

typedef struct spread {
  double lower[3], upper[3], size; /* box and its longest side */
} spread;

static spread spread_of(const double (*points)[3], size_t count) {
  spread s = {.size = 0};
  for (int k = 0; k < 3; k++) {
    s.lower[k] = s.upper[k] = points[0][k];
    for (size_t i = 1; i < count; i++) {
      s.lower[k] = fmin(s.lower[k], points[i][k]);
      s.upper[k] = fmax(s.upper[k], points[i][k]);
    }
    s.size = fmax(s.size, s.upper[k] - s.lower[k]);
  }
  return s;
}

static bool is_constant(const spread *s, int k) { return s->upper[k] - s->lower[k] <= flat * s->size; }

/* z before y before x; -1 for none. */
static int constant_of(const bool constant[3]) {
  for (int k = 2; k >= 0; k--)
    if (constant[k]) return k;
  return -1;
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void normalise(double x[3]) {
  double length = sqrt(dot(x, x));
  for (int k = 0; k < 3; k++) x[k] /= length;
}

/* Eigenvectors of the symmetric matrix a as columns of v, by Jacobi's rotations; a becomes diagonal. */
static void diagonalise(double a[3][3], double v[3][3]) {
  enum { SWEEPS = 30 }; /* four or five are enough: convergence is quadratic */
  memcpy(v, (double[3][3]){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 9 * sizeof(double));
  for (int sweep = 0; sweep < SWEEPS; sweep++)
    for (int p = 0; p < 2; p++)
      for (int q = p + 1; q < 3; q++) {
        if (!(fabs(a[p][q]) > 0)) continue;
        double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        double t = copysign(1, theta) / (fabs(theta) + hypot(theta, 1)), c = 1 / hypot(t, 1), s = t * c;
        for (int k = 0; k < 3; k++) {
          double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - s * y;
          a[k][q] = s * x + c * y;
        }
        for (int k = 0; k < 3; k++) {
          double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - s * y;
          a[q][k] = s * x + c * y;
          x = v[k][p], y = v[k][q];
          v[k][p] = c * x - s * y;
          v[k][q] = s * x + c * y;
        }
        a[p][q] = a[q][p] = 0;
      }
}

/* Where the points spread least, seen from a place among them. */
static void best_normal(const double (*points)[3], size_t count, const spread *s, double normal[3]) {
  double mean[3] = {0}, a[3][3] = {{0}}, v[3][3];
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) mean[k] += (points[i][k] - s->lower[k]) / s->size / (double)count;
  for (size_t i = 0; i < count; i++) {
    double x[3];
    for (int k = 0; k < 3; k++) x[k] = (points[i][k] - s->lower[k]) / s->size - mean[k];
    for (int k = 0; k < 3; k++)
      for (int l = 0; l < 3; l++) a[k][l] += x[k] * x[l];
  }
  diagonalise(a, v);
  int least = 0;
  for (int k = 1; k < 3; k++)
    if (a[k][k] < a[least][least]) least = k;
  for (int k = 0; k < 3; k++) normal[k] = v[k][least];
  normalise(normal);
}

static batten_plane coordinate_plane(int k, double at) {
  batten_plane plane = {{0}, {{0}}};
  plane.origin[k] = at;
  for (int i = 0; i < 2; i++) plane.axes[i][others[k][i]] = 1;
  return plane;
}

/* With the origin next to that of space, so that the contours of one direction share their coordinates. */
static batten_plane plane_with(const double normal[3], const double through[3]) {
  int k = 0;
  for (int i = 1; i < 3; i++)
    if (fabs(normal[i]) > fabs(normal[k])) k = i;
  batten_plane plane = coordinate_plane(k, 0);
  double *first = plane.axes[0], *second = plane.axes[1], along = dot(normal, first), height = dot(normal, through);
  for (int i = 0; i < 3; i++) first[i] -= along * normal[i];
  normalise(first);
  double part[2] = {dot(normal, second), dot(first, second)};
  for (int i = 0; i < 3; i++) second[i] -= part[0] * normal[i] + part[1] * first[i];
  normalise(second);
  for (int i = 0; i < 3; i++) plane.origin[i] = height * normal[i];
  return plane;
}

static batten_status fail_size(bx_reader *r, size_t which) {
  return batten_fail(r->ctx, BATTEN_E_FORMAT, "%s: contours[%zu]: its coordinates are beyond a double; scale it",
                     bx_short_path(r->path), which);
}

static batten_status fit_plane(bx_reader *r, size_t which, const double (*points)[3], size_t count, const spread *s,
                               double (*out)[2], batten_plane *plane) {
  double normal[3], middle[3], lower = INFINITY, upper = -INFINITY;
  best_normal(points, count, s, normal);
  for (size_t i = 0; i < count; i++) {
    double x[3];
    for (int k = 0; k < 3; k++) x[k] = points[i][k] - s->lower[k];
    lower = fmin(lower, dot(normal, x));
    upper = fmax(upper, dot(normal, x));
  }
  for (int k = 0; k < 3; k++) middle[k] = s->lower[k] + (lower + upper) / 2 * normal[k];
  double worst = (upper - lower) / 2;
  if (!(worst <= flat * s->size))
    return batten_fail(r->ctx, BATTEN_E_FORMAT,
                       "%s: contours[%zu]: its points lie up to %.3g from their best plane, at most %.3g is taken; "
                       "part different contours by blank lines",
                       bx_short_path(r->path), which, worst, flat * s->size);
  *plane = plane_with(normal, middle);
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 2; k++) out[i][k] = dot(plane->axes[k], points[i]);
  if (batten_first_nonfinite(2 * count, out[0]) < 2 * count || batten_first_nonfinite(3, plane->origin) < 3)
    return fail_size(r, which);
  return BATTEN_OK;
}

static void drop_coordinate(const double (*points)[3], size_t count, const spread *s, int k, double (*out)[2],
                            batten_plane *plane) {
  double middle = s->lower[k] + (s->upper[k] - s->lower[k]) / 2;
  for (size_t i = 0; i < count; i++)
    for (int c = 0; c < 2; c++) out[i][c] = points[i][others[k][c]];
  *plane = coordinate_plane(k, middle);
}

batten_status bx_find_planes(bx_reader *r, size_t count, const size_t *starts, const double *points, double *out,
                             batten_plane *planes) {
  bool all[3] = {true, true, true};
  batten_status st = BATTEN_OK;
  for (size_t c = 0; c < count; c++) {
    spread s = spread_of((const double(*)[3])points + starts[c], starts[c + 1] - starts[c]);
    if (!isfinite(s.size)) return fail_size(r, c);
    for (int k = 0; k < 3; k++) all[k] = all[k] && is_constant(&s, k);
  }
  int shared = constant_of(all);
  for (size_t c = 0; st == BATTEN_OK && c < count; c++) {
    const double(*from)[3] = (const double(*)[3])points + starts[c];
    double(*to)[2] = (double(*)[2])out + starts[c];
    size_t n = starts[c + 1] - starts[c];
    spread s = spread_of(from, n);
    bool constant[3];
    for (int k = 0; k < 3; k++) constant[k] = is_constant(&s, k);
    int k = shared >= 0 ? shared : constant_of(constant);
    if (k >= 0)
      drop_coordinate(from, n, &s, k, to, &planes[c]);
    else
      st = fit_plane(r, c, from, n, &s, to, &planes[c]);
  }
  return st;
}

batten_plane bx_station_plane(double station) { return coordinate_plane(0, station); }
