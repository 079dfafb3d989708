/* Orientation and circle tests: a filter in doubles, and expansion arithmetic when it cannot tell (Shewchuk 1997,
 * "Adaptive precision floating-point arithmetic and fast robust geometric predicates").
 *
 * An expansion is a sum of doubles, least first, whose pieces do not overlap; the sign of the last one is the sign of
 * the sum. A coordinate difference is an expansion of 2 pieces, a product with one of them doubles the pieces twice,
 * so a 3 x 3 determinant of differences has at most 192. The circle's determinant, of degree 4, would have 1536; it
 * is compressed on the way: then each piece is below half a unit in the last place of the next, and some 2100 powers
 * of two have room for no more than 42. */
#include "predicates.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

enum { PRODUCT2 = 8, MINOR = 16, TERM = 64, DETERMINANT = 192, COMPRESSED = 48 };

typedef struct two {
  double low, high;
} two;

static two two_sum(double a, double b) {
  double s = a + b, part = s - a;
  return (two){(a - (s - part)) + (b - part), s};
}

static two two_product(double a, double b) {
  double p = a * b;
  return (two){fma(a, b, -p), p};
}

/* h = e + b; room for n + 1 pieces; h may be e. Zero pieces are left out. */
static size_t grow(size_t n, const double *e, double b, double *h) {
  size_t count = 0;
  for (size_t i = 0; i < n; i++) {
    two s = two_sum(b, e[i]);
    b = s.high;
    if (s.low != 0) h[count++] = s.low;
  }
  if (b != 0) h[count++] = b;
  return count;
}

/* h = e + f, in place on h = e. */
static size_t add(size_t n, double *h, size_t m, const double *f) {
  for (size_t i = 0; i < m; i++) n = grow(n, h, f[i], h);
  return n;
}

/* h = e * (b.low + b.high); room for 4 n pieces. */
static size_t multiply(size_t n, const double *e, two b, double *h) {
  size_t count = 0;
  for (size_t i = 0; i < n; i++) {
    two low = two_product(e[i], b.low), high = two_product(e[i], b.high);
    double pieces[4] = {low.low, low.high, high.low, high.high};
    for (int k = 0; k < 4; k++)
      if (pieces[k] != 0) count = grow(count, h, pieces[k], h);
  }
  return count;
}

static two difference(double a, double b) { return two_sum(a, -b); }

static size_t negate(size_t n, double *e) {
  for (size_t i = 0; i < n; i++) e[i] = -e[i];
  return n;
}

/* h [MINOR] = p q - r s. */
static size_t minor2(two p, two q, two r, two s, double *h) {
  double first[2], product[PRODUCT2];
  size_t n = grow(p.low != 0, &p.low, p.high, first);
  size_t count = multiply(n, first, q, h);
  n = grow(r.low != 0, &r.low, r.high, first);
  n = negate(multiply(n, first, s, product), product);
  return add(count, h, n, product);
}

static int sign_of(size_t n, const double *e) { return n == 0 ? 0 : e[n - 1] > 0 ? 1 : -1; }

int batten_orient2d(const double *a, const double *b, const double *c, int x, int y) {
  double left = (b[x] - a[x]) * (c[y] - a[y]), right = (b[y] - a[y]) * (c[x] - a[x]), det = left - right;
  /* Shewchuk's bound (3 + 16 u) u on the error, u = DBL_EPSILON / 2, a little enlarged. */
  double bound = 2 * DBL_EPSILON * (fabs(left) + fabs(right));
  if (det > bound) return 1;
  if (det < -bound) return -1;
  double h[MINOR];
  size_t n =
      minor2(difference(b[x], a[x]), difference(c[y], a[y]), difference(b[y], a[y]), difference(c[x], a[x]), h);
  return sign_of(n, h);
}

int batten_orient3d(const double *a, const double *b, const double *c, const double *d) {
  double u[3], v[3], w[3];
  for (int k = 0; k < 3; k++) {
    u[k] = b[k] - a[k];
    v[k] = c[k] - a[k];
    w[k] = d[k] - a[k];
  }
  double det = 0, permanent = 0;
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double left = u[i] * v[j], right = u[j] * v[i];
    det += (left - right) * w[k];
    permanent += (fabs(left) + fabs(right)) * fabs(w[k]);
  }
  /* Shewchuk's bound (7 + 56 u) u, a little enlarged. */
  double bound = 4 * DBL_EPSILON * permanent;
  if (det > bound) return 1;
  if (det < -bound) return -1;
  two du[3], dv[3], dw[3];
  for (int k = 0; k < 3; k++) {
    du[k] = difference(b[k], a[k]);
    dv[k] = difference(c[k], a[k]);
    dw[k] = difference(d[k], a[k]);
  }
  double total[DETERMINANT], minor[MINOR], term[TERM];
  size_t count = 0;
  for (int k = 0; k < 3; k++) {
    int i = (k + 1) % 3, j = (k + 2) % 3;
    size_t n = minor2(du[i], dv[j], du[j], dv[i], minor);
    n = multiply(n, minor, dw[k], term);
    count = add(count, total, n, term);
  }
  return sign_of(count, total);
}

/* The same sum in as few pieces as its digits need, in place [Shewchuk 1997, figure 15]. */
static size_t compress(size_t n, double *e) {
  if (n < 2) return n;
  size_t bottom = n - 1, count = 0;
  double sum = e[n - 1];
  for (size_t i = n - 1; i-- > 0;) {
    two s = two_sum(sum, e[i]);
    sum = s.high;
    if (s.low == 0) continue;
    e[bottom--] = s.high;
    sum = s.low;
  }
  e[bottom] = sum;
  sum = e[bottom];
  for (size_t i = bottom + 1; i < n; i++) {
    two s = two_sum(e[i], sum);
    if (s.low != 0) e[count++] = s.low;
    sum = s.high;
  }
  e[count++] = sum;
  return count;
}

/* h [2 COMPRESSED] = e * b^2, compressed. */
static size_t multiply_square(size_t n, const double *e, two b, double *h) {
  double once[4 * MINOR], twice[4 * COMPRESSED];
  size_t count = compress(multiply(n, e, b, once), once);
  count = compress(multiply(count, once, b, twice), twice);
  for (size_t i = 0; i < count; i++) h[i] = twice[i];
  return count;
}

/* Differences from d, times the power of two that brings the largest to 1. */
static void incircle_differences(const double *corners[3], const double *d, two delta[3][2]) {
  double largest = 0;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 2; k++) {
      delta[i][k] = difference(corners[i][k], d[k]);
      largest = fmax(largest, fabs(delta[i][k].high));
    }
  int exponent = 0;
  frexp(largest, &exponent);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 2; k++) {
      delta[i][k].high = ldexp(delta[i][k].high, -exponent);
      delta[i][k].low = ldexp(delta[i][k].low, -exponent);
    }
}

static int incircle_exact(const double *a, const double *b, const double *c, const double *d) {
  const double *corners[3] = {a, b, c};
  two delta[3][2];
  incircle_differences(corners, d, delta);
  double total[3 * COMPRESSED], minor[MINOR], term[2 * COMPRESSED];
  size_t count = 0;
  for (int i = 0; i < 3; i++) {
    two *p = delta[(i + 1) % 3], *q = delta[(i + 2) % 3];
    size_t n = minor2(p[0], q[1], p[1], q[0], minor);
    for (int k = 0; k < 2; k++) {
      size_t pieces = multiply_square(n, minor, delta[i][k], term);
      count = compress(add(count, total, pieces, term), total);
    }
  }
  return sign_of(count, total);
}

int batten_incircle(const double *a, const double *b, const double *c, const double *d) {
  double ax = a[0] - d[0], ay = a[1] - d[1], bx = b[0] - d[0], by = b[1] - d[1], cx = c[0] - d[0], cy = c[1] - d[1];
  double lift_a = ax * ax + ay * ay, lift_b = bx * bx + by * by, lift_c = cx * cx + cy * cy;
  double det = lift_a * (bx * cy - by * cx) + lift_b * (cx * ay - cy * ax) + lift_c * (ax * by - ay * bx);
  double permanent = lift_a * (fabs(bx * cy) + fabs(by * cx)) + lift_b * (fabs(cx * ay) + fabs(cy * ax)) +
                     lift_c * (fabs(ax * by) + fabs(ay * bx));
  /* Shewchuk's bound (10 + 96 u) u, a little enlarged; it knows nothing of underflow. */
  double bound = 6 * DBL_EPSILON * permanent;
  if (permanent > 1e-200) {
    if (det > bound) return 1;
    if (det < -bound) return -1;
  }
  return incircle_exact(a, b, c, d);
}
