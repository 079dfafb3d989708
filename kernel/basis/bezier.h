/* Polynomials on [0, 1] in Bernstein form: sum_k c_k C(n, k) t^k (1 - t)^(n - k).   [Farin, Hansford 2000]
 *
 * Coefficients are [n + 1][dim], dim numbers together. All is inline: degrees and dim are constants where these are
 * called, the loops vanish, and a call would cost more than the work. Results may not overlap arguments. */
#ifndef BATTEN_BASIS_BEZIER_H
#define BATTEN_BASIS_BEZIER_H

#include <assert.h>

#include "mesh/vec.h"

enum { BEZIER_DEGREE_MAX = 12, BEZIER_DIM_MAX = 3 };

static const double bezier_binomial[BEZIER_DEGREE_MAX + 1][BEZIER_DEGREE_MAX + 1] = {
    {1},
    {1, 1},
    {1, 2, 1},
    {1, 3, 3, 1},
    {1, 4, 6, 4, 1},
    {1, 5, 10, 10, 5, 1},
    {1, 6, 15, 20, 15, 6, 1},
    {1, 7, 21, 35, 35, 21, 7, 1},
    {1, 8, 28, 56, 70, 56, 28, 8, 1},
    {1, 9, 36, 84, 126, 126, 84, 36, 9, 1},
    {1, 10, 45, 120, 210, 252, 210, 120, 45, 10, 1},
    {1, 11, 55, 165, 330, 462, 462, 330, 165, 55, 11, 1},
    {1, 12, 66, 220, 495, 792, 924, 792, 495, 220, 66, 12, 1}};

/* The same polynomial as one of degree n + 1: out [n + 2][dim]. */
static inline void bezier_elevate(unsigned n, unsigned dim, const double *c, double *out) {
  for (unsigned x = 0; x < dim; x++) {
    out[x] = c[x];
    out[(n + 1) * dim + x] = c[n * dim + x];
  }
  for (unsigned k = 1; k <= n; k++) {
    double part = (double)k / (n + 1);
    for (unsigned x = 0; x < dim; x++) out[k * dim + x] = part * c[(k - 1) * dim + x] + (1 - part) * c[k * dim + x];
  }
}

/* out [n][dim] = c_(k + 1) - c_k: the derivative divided by n. */
static inline void bezier_difference(unsigned n, unsigned dim, const double *c, double *out) {
  for (unsigned k = 0; k < n * dim; k++) out[k] = c[k + dim] - c[k];
}

/* a of degree p, scalar, times b of degree q: out [p + q + 1][dim]. */
static inline void bezier_multiply(unsigned p, const double *a, unsigned q, unsigned dim, const double *b,
                                   double *out) {
  assert(p + q <= BEZIER_DEGREE_MAX);
  for (unsigned k = 0; k < (p + q + 1) * dim; k++) out[k] = 0;
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= q; j++) {
      double weight = bezier_binomial[p][i] * bezier_binomial[q][j] / bezier_binomial[p + q][i + j] * a[i];
      for (unsigned x = 0; x < dim; x++) out[(i + j) * dim + x] += weight * b[j * dim + x];
    }
}

/* Vector product of a of degree p and b of degree q, both in space: out [p + q + 1][3]. */
static inline void bezier_cross(unsigned p, const double *a, unsigned q, const double *b, double *out) {
  assert(p + q <= BEZIER_DEGREE_MAX);
  for (unsigned k = 0; k < (p + q + 1) * 3; k++) out[k] = 0;
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= q; j++) {
      double weight = bezier_binomial[p][i] * bezier_binomial[q][j] / bezier_binomial[p + q][i + j], both[3];
      vec_cross(a + 3 * i, b + 3 * j, both);
      for (unsigned x = 0; x < 3; x++) out[(i + j) * 3 + x] += weight * both[x];
    }
}

/* The parts over [0, t] and [t, 1], each [n + 1][dim]; de Casteljau's algorithm. */
static inline void bezier_split(unsigned n, unsigned dim, const double *c, double t, double *left, double *right) {
  assert(n <= BEZIER_DEGREE_MAX && dim <= BEZIER_DIM_MAX);
  for (unsigned k = 0; k < (n + 1) * dim; k++) right[k] = c[k];
  for (unsigned level = 0;; level++) {
    for (unsigned x = 0; x < dim; x++) left[level * dim + x] = right[x];
    if (level == n) return;
    for (unsigned k = 0; k < (n - level) * dim; k++) right[k] = (1 - t) * right[k] + t * right[k + dim];
  }
}

/* Value [dim] and, unless NULL, first derivative [dim] at t, on [0, 1] to rounding of the largest coefficient. */
static inline void bezier_evaluate(unsigned n, unsigned dim, const double *c, double t, double *value,
                                   double *derivative) {
  double work[(BEZIER_DEGREE_MAX + 1) * BEZIER_DIM_MAX];
  assert(n <= BEZIER_DEGREE_MAX && dim <= BEZIER_DIM_MAX);
  for (unsigned k = 0; k < (n + 1) * dim; k++) work[k] = c[k];
  for (unsigned x = 0; x < dim && derivative; x++) derivative[x] = 0;
  for (unsigned left = n; left > 0; left--) {
    for (unsigned x = 0; x < dim && derivative && left == 1; x++) derivative[x] = n * (work[dim + x] - work[x]);
    for (unsigned k = 0; k < left * dim; k++) work[k] = (1 - t) * work[k] + t * work[k + dim];
  }
  for (unsigned x = 0; x < dim; x++) value[x] = work[x];
}

#endif
