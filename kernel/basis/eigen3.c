/* Jacobi's method for symmetric matrices up to 3 x 3: plane rotations that zero one off-diagonal entry after another.
 *
 * Small eigenvalues of well scaled positive matrices come with high relative accuracy, which is what a test for flat
 * point sets needs. [Golub, Van Loan, Matrix Computations, section 8.5; Demmel, Veselic 1992] */
#include "basis/eigen3.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdbool.h>

/* Rotates rows and columns p and q of w so that w[p][q] = 0, and the rows p and q of v along. */
static void rotate(unsigned n, double w[3][3], double v[3][3], unsigned p, unsigned q) {
  double theta = 0.5 * (w[q][q] - w[p][p]) / w[p][q];
  /* The smaller root of t^2 + 2 theta t = 1: rotation by at most 45 degrees. fabs(theta) may be infinite. */
  double t = copysign(1, theta) / (fabs(theta) + sqrt(theta * theta + 1));
  double c = 1 / sqrt(t * t + 1), s = t * c;
  w[p][p] -= t * w[p][q];
  w[q][q] += t * w[p][q];
  w[p][q] = w[q][p] = 0;
  for (unsigned k = 0; k < n; k++) {
    if (k != p && k != q) {
      double a = w[p][k], b = w[q][k];
      w[p][k] = w[k][p] = c * a - s * b;
      w[q][k] = w[k][q] = s * a + c * b;
    }
    double a = v[p][k], b = v[q][k];
    v[p][k] = c * a - s * b;
    v[q][k] = s * a + c * b;
  }
}

/* One sweep over the off-diagonal; false when all of it was negligible already. */
static bool sweep(unsigned n, double w[3][3], double v[3][3]) {
  bool rotated = false;
  for (unsigned p = 0; p < n; p++)
    for (unsigned q = p + 1; q < n; q++)
      if (fabs(w[p][q]) > 0.25 * DBL_EPSILON * sqrt(fabs(w[p][p] * w[q][q])) && fabs(w[p][q]) >= DBL_MIN) {
        rotate(n, w, v, p, q);
        rotated = true;
      }
  return rotated;
}

static void swap_rows(unsigned n, double *values, double v[3][3], unsigned i, unsigned j) {
  double t = values[i];
  values[i] = values[j];
  values[j] = t;
  for (unsigned k = 0; k < n; k++) {
    /* One sign changes, so that the system stays right-handed. */
    double x = v[i][k];
    v[i][k] = v[j][k];
    v[j][k] = -x;
  }
}

void batten_eigen_symmetric(unsigned n, const double *a, double *values, double *vectors) {
  assert(n >= 1 && n <= 3);
  double largest = 0, w[3][3], v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (unsigned i = 0; i < n; i++)
    for (unsigned j = i; j < n; j++) largest = fmax(largest, fabs(a[i * n + j]));
  int exponent = 0;
  frexp(largest, &exponent); /* scaling by a power of two keeps squares away from overflow and changes no bit */
  for (unsigned i = 0; i < n; i++)
    for (unsigned j = i; j < n; j++) w[i][j] = w[j][i] = ldexp(a[i * n + j], -exponent);
  /* Convergence is quadratic: 3 x 3 takes 4 to 7 sweeps. The bound only stops what rounding might keep going. */
  for (unsigned k = 0; k < 30 && sweep(n, w, v); k++) continue;
  for (unsigned i = 0; i < n; i++) values[i] = ldexp(w[i][i], exponent);
  for (unsigned i = 1; i < n; i++)
    for (unsigned j = i; j > 0 && values[j] < values[j - 1]; j--) swap_rows(n, values, v, j - 1, j);
  if (vectors)
    for (unsigned i = 0; i < n; i++)
      for (unsigned k = 0; k < n; k++) vectors[i * n + k] = v[i][k];
}
