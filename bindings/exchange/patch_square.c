/* Triangular patches as tensor products, and their sides: see patch_square.h.
 *
 * By blossoms. The symmetric n-affine form f of the patch has f(c, ..., c) = S(c). With a bilinear place
 * c(s, t) = (1-s)(1-t) c00 + s (1-t) c10 + (1-s) t c01 + s t c11, expanding f(c, ..., c) and sorting by the Bernstein
 * polynomials B_i(s) B_j(t) gives
 *
 *   P_ij = sum over r of C(i, r) C(n-i, j-r) / C(n, j) f(c11 r times, c10 i-r, c01 j-r, c00 n-i-j+r times):
 *
 * of the i factors with s, r have t as well. The weights are hypergeometric and sum to 1, so nothing is lost where
 * the corners lie in the triangle; (-1, 1, 1), the fourth corner of the parallelogram, costs up to 3^n roundings
 * there, and next to none in the half that is kept. One argument of f more is one step of de Casteljau's algorithm.
 */
#include "patch_square.h"

#include <math.h>
#include <string.h>

unsigned bx_squares_of(batten_cad_form form) { return form == BATTEN_CAD_QUADS ? 3 : 1; }

void bx_corners_of(batten_cad_form form, unsigned square, bx_corners out) {
  static const bx_corners trimmed = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 1, 1}};
  static const bx_corners degenerate = {{1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  if (form != BATTEN_CAD_QUADS) {
    memcpy(out, form == BATTEN_CAD_TRIMMED ? trimmed : degenerate, sizeof trimmed);
    return;
  }
  memset(out, 0, sizeof(bx_corners));
  unsigned next = (square + 1) % 3, last = (square + 2) % 3;
  out[0][square] = 1;
  out[1][square] = out[1][next] = 0.5;
  out[2][square] = out[2][last] = 0.5;
  for (int k = 0; k < 3; k++) out[3][k] = 1.0 / 3;
}

/* ---- nets ---------------------------------------------------------------------------------------- */

/* Control point with j, k steps towards the second and third corner. */
static size_t index_of(unsigned n, unsigned j, unsigned k) { return (size_t)k * (2 * n + 3 - k) / 2 + j; }

static size_t net_size(unsigned n) { return (size_t)(n + 1) * (n + 2) / 2; }

/* One argument of the blossom: degree n to n - 1, in place (what is written lies before all that is still read). */
static void step(unsigned n, double (*net)[3], const double c[3]) {
  size_t to = 0;
  for (unsigned k = 0; k < n; k++)
    for (unsigned j = 0; j + k < n; j++, to++) {
      const double *a = net[index_of(n, j, k)], *b = net[index_of(n, j + 1, k)], *d = net[index_of(n, j, k + 1)];
      for (int x = 0; x < 3; x++) net[to][x] = c[0] * a[x] + c[1] * b[x] + c[2] * d[x];
    }
}

static double binomial(unsigned n, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i; /* whole at every step */
  return value;
}

void bx_patch_square(bx_square_work *work, unsigned n, const double *net, const bx_corners corners, double *out) {
  double(*by11)[3] = work->nets[0], (*by01)[3] = work->nets[1], (*by10)[3] = work->nets[2],
  (*by00)[3] = work->nets[3];
  size_t width = n + 1, point = sizeof by11[0];
  memset(out, 0, width * width * point);
  memcpy(by11, net, net_size(n) * point);
  for (unsigned r = 0; r <= n; r++) {
    memcpy(by01, by11, net_size(n - r) * point);
    for (unsigned j = r; j <= n; j++) {
      memcpy(by10, by01, net_size(n - j) * point);
      for (unsigned i = r; i + j <= n + r; i++) {
        unsigned left = n + r - i - j;
        memcpy(by00, by10, net_size(left) * point);
        for (unsigned a = left; a > 0; a--) step(a, by00, corners[0]);
        double weight = binomial(i, r) * binomial(n - i, j - r) / binomial(n, j);
        for (int x = 0; x < 3; x++) out[3 * (i * width + j) + (size_t)x] += weight * by00[0][x];
        if (left) step(left, by10, corners[1]);
      }
      if (j < n) step(n - j, by01, corners[2]);
    }
    if (r < n) step(n - r, by11, corners[3]);
  }
}

void bx_patch_at(bx_square_work *work, unsigned n, const double *net, double u, double v, double out[3]) {
  const double place[3] = {1 - u - v, u, v};
  memcpy(work->nets[0], net, net_size(n) * sizeof work->nets[0][0]);
  for (unsigned a = n; a > 0; a--) step(a, work->nets[0], place);
  memcpy(out, work->nets[0][0], sizeof work->nets[0][0]);
}

/* ---- curves -------------------------------------------------------------------------------------- */

size_t bx_bezier_knots(unsigned n, double knots[2 * BX_DEGREE_MAX + 2]) {
  size_t count = 2 * ((size_t)n + 1);
  for (size_t i = 0; i < count; i++) knots[i] = i <= n ? 0 : 1;
  return count;
}

batten_surface_form bx_square_form(unsigned n, const double *points, double knots[2 * BX_DEGREE_MAX + 2]) {
  size_t count = bx_bezier_knots(n, knots);
  return (batten_surface_form){
      .degree = {n, n}, .knot_count = {count, count}, .knots = {knots, knots}, .control_points = points};
}

void bx_patch_side(unsigned n, const double *net, unsigned k, double (*out)[3]) {
  for (unsigned i = 0; i <= n; i++) {
    size_t at = k == 0 ? index_of(n, i, 0) : k == 1 ? index_of(n, n - i, i) : index_of(n, 0, n - i);
    memcpy(out[i], net + 3 * at, sizeof out[i]);
  }
}

/* Degree n to n - 1 of a curve that is of degree n - 1: the first half from the left, the second from the right,
 * where the recursion b_i = (n p_i - i b_{i-1}) / (n - i) does not amplify. */
static void lower(unsigned n, const double (*p)[3], double (*b)[3]) {
  for (int x = 0; x < 3; x++) {
    unsigned half = n / 2;
    for (unsigned i = 0; i < half; i++) b[i][x] = (n * p[i][x] - (i ? i * b[i - 1][x] : 0)) / (n - i);
    for (unsigned i = n - 1; i + 1 > half; i--)
      b[i][x] = (n * p[i + 1][x] - (i + 1 < n ? (n - 1 - i) * b[i + 1][x] : 0)) / (i + 1);
  }
}

static void raise(unsigned n, double (*b)[3]) { /* to n + 1, in place */
  for (int x = 0; x < 3; x++) {
    b[n + 1][x] = b[n][x];
    for (unsigned i = n; i > 0; i--) b[i][x] = (i * b[i - 1][x] + (n + 1 - i) * b[i][x]) / (n + 1);
  }
}

unsigned bx_curve_reduce(unsigned n, double (*points)[3], double tolerance) {
  double given[BX_DEGREE_MAX + 1][3], less[BX_DEGREE_MAX + 1][3], again[BX_DEGREE_MAX + 1][3];
  unsigned degree = n;
  memcpy(given, points, (n + 1) * sizeof given[0]);
  while (degree > 1) {
    double off = 0;
    lower(degree, (const double(*)[3])points, less);
    memcpy(less[0], given[0], sizeof less[0]);
    memcpy(less[degree - 1], given[n], sizeof less[0]);
    memcpy(again, less, degree * sizeof again[0]);
    for (unsigned k = degree - 1; k < n; k++) raise(k, again);
    for (unsigned i = 0; i <= n; i++)
      for (int x = 0; x < 3; x++) off = fmax(off, fabs(again[i][x] - given[i][x]));
    if (!(off <= tolerance)) break;
    degree--;
    memcpy(points, less, (degree + 1) * sizeof less[0]);
  }
  return degree;
}

void bx_curve_reverse(unsigned n, double (*points)[3]) {
  for (unsigned i = 0; 2 * i < n; i++)
    for (int x = 0; x < 3; x++) {
      double swap = points[i][x];
      points[i][x] = points[n - i][x];
      points[n - i][x] = swap;
    }
}

void bx_curve_at(unsigned n, const double (*points)[3], double t, double out[3]) {
  double b[BX_DEGREE_MAX + 1][3];
  memcpy(b, points, (n + 1) * sizeof b[0]);
  for (unsigned k = n; k > 0; k--)
    for (unsigned i = 0; i < k; i++)
      for (int x = 0; x < 3; x++) b[i][x] = (1 - t) * b[i][x] + t * b[i + 1][x];
  memcpy(out, b[0], sizeof b[0]);
}

void bx_curve_halve(unsigned n, const double (*points)[3], double (*left)[3], double (*right)[3]) {
  memmove(right, points, (n + 1) * sizeof right[0]);
  for (unsigned k = 0; k <= n; k++) {
    memcpy(left[k], right[0], sizeof left[k]);
    for (unsigned i = 0; i + k < n; i++)
      for (int x = 0; x < 3; x++) right[i][x] = 0.5 * (right[i][x] + right[i + 1][x]);
  }
}
