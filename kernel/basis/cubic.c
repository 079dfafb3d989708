/* Cubic splines through values at given places. See cubic.h.
 *
 * The unknowns are the slopes: continuity of the second derivative is one row of a tridiagonal system each. With h_i
 * the distance from place i to i + 1, d_i the chord's slope, p = h_i / (h_(i-1) + h_i) and q = 1 - p a row reads
 *
 *   p s_(i-1) + 2 s_i + q s_(i+1) = 3 (p d_(i-1) + q d_i)
 *
 * and at the ends p s_0 + s_1 = (q + 2) p d_0 + q^2 d_1, with p and q of i = 1. Written in p and q it does not care
 * for the unit of t. */
#include "basis/cubic.h"

/* d of the chord from place i on. */
static double chord(size_t i, size_t dims, const double *t, const double *values, size_t k) {
  return (values[(i + 1) * dims + k] - values[i * dims + k]) / (t[i + 1] - t[i]);
}

void cubic_slopes(size_t count, size_t dims, const double *t, const double *values, double *slopes, double *work) {
  if (count < 3) {
    for (size_t i = 0; i < count; i++)
      for (size_t k = 0; k < dims; k++) slopes[i * dims + k] = count == 2 ? chord(0, dims, t, values, k) : 0;
    return;
  }
  double p = (t[2] - t[1]) / (t[2] - t[0]), q = (t[1] - t[0]) / (t[2] - t[0]);
  if (count == 3) { /* the rows of both ends are the same: a parabola */
    for (size_t k = 0; k < dims; k++) {
      double a = chord(0, dims, t, values, k), b = chord(1, dims, t, values, k), bend = b - a;
      slopes[k] = a - q * bend;
      slopes[dims + k] = p * a + q * b;
      slopes[2 * dims + k] = b + p * bend;
    }
    return;
  }
  /* work: what is left above the diagonal, which becomes 1 */
  work[0] = 1 / p;
  for (size_t k = 0; k < dims; k++)
    slopes[k] = ((q + 2) * p * chord(0, dims, t, values, k) + q * q * chord(1, dims, t, values, k)) / p;
  for (size_t i = 1; i + 1 < count; i++) {
    p = (t[i + 1] - t[i]) / (t[i + 1] - t[i - 1]);
    q = (t[i] - t[i - 1]) / (t[i + 1] - t[i - 1]);
    double pivot = 2 - p * work[i - 1];
    work[i] = q / pivot;
    for (size_t k = 0; k < dims; k++) {
      double right = 3 * (p * chord(i - 1, dims, t, values, k) + q * chord(i, dims, t, values, k));
      slopes[i * dims + k] = (right - p * slopes[(i - 1) * dims + k]) / pivot;
    }
  }
  size_t last = count - 1; /* p and q are those of place last - 1 */
  double pivot = q - work[last - 1];
  for (size_t k = 0; k < dims; k++) {
    double right = (p + 2) * q * chord(last - 1, dims, t, values, k) + p * p * chord(last - 2, dims, t, values, k);
    slopes[last * dims + k] = (right - slopes[(last - 1) * dims + k]) / pivot;
  }
  for (size_t i = last; i-- > 0;)
    for (size_t k = 0; k < dims; k++) slopes[i * dims + k] -= work[i] * slopes[(i + 1) * dims + k];
}

size_t cubic_interval(size_t count, const double *t, double at) {
  size_t low = 0, high = count - 1;
  while (high - low > 1) {
    size_t middle = low + (high - low) / 2;
    if (t[middle] <= at)
      low = middle;
    else
      high = middle;
  }
  return low;
}

void cubic_value(size_t count, size_t dims, const double *t, const double *values, const double *slopes, double at,
                 double *value, double *slope) {
  size_t i = cubic_interval(count, t, at);
  double h = t[i + 1] - t[i], u = (at - t[i]) / h;
  u = u > 0 ? (u < 1 ? u : 1) : 0;
  double v = 1 - u;
  for (size_t k = 0; k < dims; k++) {
    double a = values[i * dims + k], b = values[(i + 1) * dims + k];
    double sa = h * slopes[i * dims + k], sb = h * slopes[(i + 1) * dims + k];
    value[k] = v * v * ((1 + 2 * u) * a + u * sa) + u * u * ((1 + 2 * v) * b - v * sb);
    if (slope) slope[k] = (6 * u * v * (b - a) + v * (v - 2 * u) * sa + u * (u - 2 * v) * sb) / h;
  }
}
