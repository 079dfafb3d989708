/* Polynomials on a triangle in Bernstein form. See triangular.h.
 *
 * All evaluation is de Casteljau's: a step replaces a net of degree m by one of degree m - 1, each point the mean of
 * three neighbours with the weights (1 - u - v, u, v). What is left after n - r steps, a net of degree r, holds the
 * derivatives of order r as its r-th differences, times n (n - 1) .. (n - r + 1). */
#include "triangular.h"

#include <string.h>

/* One step from degree m to m - 1. out may be in: each point is read for the last time when it is overwritten. */
static void step(unsigned m, unsigned dims, const double *in, double u, double v, double *out) {
  double w = 1 - u - v;
  const double *row = in, *next = in + dims * (size_t)(m + 1);
  for (unsigned k = 0; k < m; k++) {
    unsigned length = dims * (m - k);
    for (unsigned j = 0; j < length; j++) out[j] = w * row[j] + u * row[j + dims] + v * next[j];
    out += length;
    row = next;
    next += length;
  }
}

/* First, second and third differences of a net of degree r, times the factor: the jet's entries of order r. */
static void differences(unsigned r, const double (*q)[3], double factor, double (*out)[3]) {
  for (int d = 0; d < 3; d++) {
    if (r == 0) {
      out[0][d] = q[0][d];
    } else if (r == 1) {
      out[1][d] = factor * (q[1][d] - q[0][d]);
      out[2][d] = factor * (q[2][d] - q[0][d]);
    } else if (r == 2) {
      out[3][d] = factor * ((q[2][d] - q[1][d]) - (q[1][d] - q[0][d]));
      out[4][d] = factor * ((q[4][d] - q[3][d]) - (q[1][d] - q[0][d]));
      out[5][d] = factor * ((q[5][d] - q[3][d]) - (q[3][d] - q[0][d]));
    } else {
      double uu[3] = {(q[2][d] - q[1][d]) - (q[1][d] - q[0][d]), (q[3][d] - q[2][d]) - (q[2][d] - q[1][d]),
                      (q[6][d] - q[5][d]) - (q[5][d] - q[4][d])};
      double vv[3] = {(q[7][d] - q[4][d]) - (q[4][d] - q[0][d]), (q[8][d] - q[5][d]) - (q[5][d] - q[1][d]),
                      (q[9][d] - q[7][d]) - (q[7][d] - q[4][d])};
      out[6][d] = factor * (uu[1] - uu[0]);
      out[7][d] = factor * (uu[2] - uu[0]);
      out[8][d] = factor * (vv[1] - vv[0]);
      out[9][d] = factor * (vv[2] - vv[0]);
    }
  }
}

void triangular_jet(unsigned n, const double (*net)[3], double u, double v, unsigned order, double (*out)[3]) {
  double q[TRIANGULAR_MAX][3];
  const double(*from)[3] = net;
  unsigned top = order < n ? order : n;
  for (unsigned m = n; m > top; m--) {
    step(m, 3, from[0], u, v, q[0]);
    from = (const double(*)[3])q;
  }
  size_t zeros = triangular_jet_count(order) - triangular_jet_count(top);
  if (zeros) memset(out + triangular_jet_count(top), 0, zeros * sizeof *out);
  double factor = 1;
  for (unsigned r = 0; r < top; r++) factor *= n - r;
  for (unsigned r = top;; r--) {
    differences(r, from, factor, out);
    if (r == 0) break;
    step(r, 3, from[0], u, v, q[0]);
    from = (const double(*)[3])q;
    factor /= n - r + 1; /* exact: whole numbers */
  }
}

/* The transpose of a step: coefficients of degree m -> m + 1, out(j, k) = w in(j, k) + u in(j - 1, k) + v in(j, k -
 * 1).
 */
static void climb(unsigned m, const double *in, double w, double u, double v, double *out) {
  for (unsigned k = 0; k <= m + 1; k++)
    for (unsigned j = 0; j + k <= m + 1; j++) {
      double sum = 0;
      if (j + k <= m) sum += w * in[triangular_index(m, j, k)];
      if (j > 0) sum += u * in[triangular_index(m, j - 1, k)];
      if (k > 0) sum += v * in[triangular_index(m, j, k - 1)];
      *out++ = sum;
    }
}

void triangular_basis(unsigned n, double u, double v, unsigned order, double *table) {
  double buffer[2][TRIANGULAR_MAX];
  size_t count = triangular_count(n);
  unsigned entry = 0;
  for (unsigned r = 0; r <= order; r++)
    for (unsigned by_v = 0; by_v <= r; by_v++, entry++) {
      double *out = table + entry * count, factor = 1;
      if (r > n) {
        memset(out, 0, count * sizeof *out);
        continue;
      }
      unsigned side = 0;
      buffer[0][0] = 1;
      for (unsigned m = 0; m < n; m++, side = !side) {
        unsigned back = n - 1 - m; /* the last r rises are differences */
        if (back >= r)
          climb(m, buffer[side], 1 - u - v, u, v, buffer[!side]);
        else
          climb(m, buffer[side], -1, back >= by_v, back < by_v, buffer[!side]);
        if (back < r) factor *= m + 1;
      }
      for (size_t i = 0; i < count; i++) out[i] = factor * buffer[side][i];
    }
}

/* n! / (a! j! k!), a = n - j - k: whole numbers below 2^53 for n <= 24, each quotient exact. */
static double trinomial(unsigned n, unsigned j, unsigned k) {
  double value = 1;
  for (unsigned i = 1; i <= j; i++) value = value * (n - j - k + i) / i;
  for (unsigned i = 1; i <= k; i++) value = value * (n - k + i) / i;
  return value;
}

void triangular_normal(unsigned n, const double (*net)[3], double (*out)[3]) {
  unsigned m = n - 1, sum = 2 * m;
  memset(out, 0, triangular_count(sum) * sizeof *out);
  for (unsigned ka = 0; ka <= m; ka++)
    for (unsigned ja = 0; ja + ka <= m; ja++) {
      const double *at = net[triangular_index(n, ja, ka)], *right = net[triangular_index(n, ja + 1, ka)];
      double weight = trinomial(m, ja, ka) * n * n, a[3];
      for (int d = 0; d < 3; d++) a[d] = weight * (right[d] - at[d]);
      for (unsigned kb = 0; kb <= m; kb++)
        for (unsigned jb = 0; jb + kb <= m; jb++) {
          const double *from = net[triangular_index(n, jb, kb)], *up = net[triangular_index(n, jb, kb + 1)];
          double *to = out[triangular_index(sum, ja + jb, ka + kb)];
          double share = trinomial(m, jb, kb), b[3];
          for (int d = 0; d < 3; d++) b[d] = share * (up[d] - from[d]);
          to[0] += a[1] * b[2] - a[2] * b[1];
          to[1] += a[2] * b[0] - a[0] * b[2];
          to[2] += a[0] * b[1] - a[1] * b[0];
        }
    }
  for (unsigned k = 0, i = 0; k <= sum; k++)
    for (unsigned j = 0; j + k <= sum; j++, i++)
      for (int d = 0; d < 3; d++) out[i][d] /= trinomial(sum, j, k);
}

/* Index in a net of degree m of the corner at (u, v), or -1 when there is none. */
static int corner_index(unsigned m, const double place[2]) {
  if (place[0] == 0 && place[1] == 0) return 0;
  if (place[0] == 1 && place[1] == 0) return (int)m;
  if (place[0] == 0 && place[1] == 1) return (int)triangular_count(m) - 1;
  return -1;
}

/* Point (j, k) of the part is the blossom at corners[1] j times, corners[2] k times, corners[0] for the rest: k steps
 * towards corners[2] are shared by a row, j towards corners[1] by what is left of it. */
void triangular_part(unsigned n, unsigned dims, const double *net, const double corners[3][2], double *out,
                     double *work) {
  size_t size = triangular_count(n) * dims;
  double *by_row = work, *by_point = work + size, *rest = work + 2 * size;
  memcpy(by_row, net, size * sizeof *net);
  for (unsigned k = 0; k <= n; k++) {
    memcpy(by_point, by_row, triangular_count(n - k) * dims * sizeof *net);
    for (unsigned j = 0; j + k <= n; j++, out += dims) {
      unsigned left = n - j - k;
      int at = corner_index(left, corners[0]);
      const double *from = by_point + (at < 0 ? 0 : (size_t)at * dims);
      for (unsigned m = left; at < 0 && m > 0; m--) {
        step(m, dims, from, corners[0][0], corners[0][1], rest);
        from = rest;
      }
      memcpy(out, from, dims * sizeof *out);
      if (left > 0) step(left, dims, by_point, corners[1][0], corners[1][1], by_point);
    }
    if (k < n) step(n - k, dims, by_row, corners[2][0], corners[2][1], by_row);
  }
}

/* Coefficients of a part that was cut with its corners in the order (1, 2, 0) or (2, 0, 1), turned back. */
static void turn(unsigned n, unsigned dims, const double *in, unsigned first, double *out) {
  for (unsigned k = 0; k <= n; k++)
    for (unsigned j = 0; j + k <= n; j++, out += dims) {
      unsigned i = n - j - k;
      memcpy(out, in + dims * (first == 1 ? triangular_index(n, k, i) : triangular_index(n, i, j)),
             dims * sizeof *out);
    }
}

void triangular_split(unsigned n, unsigned dims, const double *net, double *out, double *work) {
  static const double middle[4][3][2] = {{{0, 0}, {0.5, 0}, {0, 0.5}},
                                         {{1, 0}, {0.5, 0.5}, {0.5, 0}},
                                         {{0, 1}, {0, 0.5}, {0.5, 0.5}},
                                         {{0.5, 0.5}, {0, 0.5}, {0.5, 0}}};
  size_t size = triangular_count(n) * dims;
  triangular_part(n, dims, net, middle[0], out, work);
  /* The corner goes first, which is fast; the middle part's place serves as scratch. */
  for (unsigned part = 1; part <= 2; part++) {
    triangular_part(n, dims, net, middle[part], out + 3 * size, work);
    turn(n, dims, out + 3 * size, part, out + part * size);
  }
  triangular_part(n, dims, net, middle[3], out + 3 * size, work);
}
