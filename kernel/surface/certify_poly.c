/* Polynomials of two variables in Bernstein form with bounds of their rounding errors.
 *
 * The coefficients of a product, sum_(k+i=r) C(p,k) C(q,i) / C(p+q,r) f_k g_i, are weighted means of products of
 * coefficients, so that their errors are below error_f most_g + most_f error_g + error_f error_g, whatever the
 * degree. Scaled coefficients turn them into a convolution. Its sums are nested (along a row, then over the rows), so
 * that rounding adds up along a path of the sum of the degrees, not of their product. */
#include "certify.h"

#include <math.h>
#include <string.h>

void certify_binomials(unsigned n, double *row) {
  row[0] = 1;
  for (unsigned k = 1; k <= n; k++) {
    row[k] = 1;
    for (unsigned i = k - 1; i > 0; i--) row[i] += row[i - 1];
  }
}

static double binomial_error(unsigned n) { return n > 56 ? (n - 56) * CERTIFY_EPS : 0; }

/* Multiplies by the binomials (or divides); sets most to what the f_kl have then or had before. */
static void rescale(certify_poly *p, bool divide) {
  double first[CERTIFY_ORDER], second[CERTIFY_ORDER], most = 0;
  certify_binomials(p->degree[0], first);
  certify_binomials(p->degree[1], second);
  double *c = p->c;
  for (unsigned i = 0; i <= p->degree[0]; i++)
    for (unsigned j = 0; j <= p->degree[1]; j++, c++) {
      double before = *c, factor = first[i] * second[j];
      *c = divide ? before / factor : before * factor;
      most = fmax(most, fabs(divide ? *c : before));
    }
  double relative = 2 * CERTIFY_EPS + binomial_error(p->degree[0]) + binomial_error(p->degree[1]);
  p->most = most * CERTIFY_UP;
  p->error = (p->error + relative * p->most) * CERTIFY_UP + CERTIFY_TINY;
}

void certify_scale(certify_poly *p) { rescale(p, false); }
void certify_unscale(certify_poly *p) { rescale(p, true); }

void certify_clear(certify_poly *p, unsigned degree_u, unsigned degree_v) {
  p->degree[0] = degree_u;
  p->degree[1] = degree_v;
  p->most = p->error = 0;
  memset(p->c, 0, certify_count(p) * sizeof *p->c);
}

static unsigned least(unsigned a, unsigned b) { return a < b ? a : b; }

void certify_add_product(certify_poly *out, double sign, const certify_poly *a, const certify_poly *b,
                         unsigned products) {
  size_t na = a->degree[1] + 1, nb = b->degree[1] + 1, n = na + nb - 1;
  double row[CERTIFY_ORDER];
  for (unsigned i = 0; i <= a->degree[0]; i++)
    for (unsigned k = 0; k <= b->degree[0]; k++) {
      const double *f = a->c + i * na, *g = b->c + k * nb;
      double *to = out->c + (i + k) * n;
      for (size_t x = 0; x < n; x++) row[x] = 0;
      for (size_t j = 0; j < na; j++)
        for (size_t l = 0; l < nb; l++) row[j + l] += f[j] * g[l];
      for (size_t x = 0; x < n; x++) to[x] += sign * row[x];
    }
  unsigned path = 2 + least(a->degree[1], b->degree[1]) + products * (1 + least(a->degree[0], b->degree[0]));
  double size_a = a->most + a->error, size_b = b->most + b->error;
  out->error +=
      (a->error * b->most + a->most * b->error + a->error * b->error + path * CERTIFY_EPS * size_a * size_b) *
          CERTIFY_UP +
      CERTIFY_TINY;
}

void certify_summed(certify_poly *out) {
  double first[CERTIFY_ORDER], second[CERTIFY_ORDER], most = 0;
  certify_binomials(out->degree[0], first);
  certify_binomials(out->degree[1], second);
  for (unsigned j = 0; j <= out->degree[1]; j++) second[j] = 1 / second[j];
  for (unsigned i = 0; i <= out->degree[0]; i++) {
    const double *c = out->c + (size_t)i * (out->degree[1] + 1);
    double row = 0;
    for (unsigned j = 0; j <= out->degree[1]; j++) row = fmax(row, fabs(c[j]) * second[j]);
    most = fmax(most, row / first[i]);
  }
  out->most = most * CERTIFY_UP;
}

void certify_add_constant(certify_poly *a, double constant) {
  double first[CERTIFY_ORDER], second[CERTIFY_ORDER];
  certify_binomials(a->degree[0], first);
  certify_binomials(a->degree[1], second);
  double *c = a->c;
  for (unsigned i = 0; i <= a->degree[0]; i++)
    for (unsigned j = 0; j <= a->degree[1]; j++) *c++ += constant * first[i] * second[j];
  a->most = (a->most + fabs(constant)) * CERTIFY_UP;
  a->error = (a->error + 3 * CERTIFY_EPS * a->most) * CERTIFY_UP + CERTIFY_TINY;
}

/* Times 1 of degree raise[0], then of raise[1]: all terms of one sign, so that the sums lose nothing else. */
void certify_raise(const certify_poly *a, unsigned degree_u, unsigned degree_v, double *work, certify_poly *out) {
  double weights[CERTIFY_ORDER];
  unsigned du = degree_u - a->degree[0], dv = degree_v - a->degree[1];
  size_t na = a->degree[1] + 1, n = degree_v + 1;
  certify_binomials(du, weights);
  memset(work, 0, (degree_u + 1) * na * sizeof *work);
  for (size_t i = 0; i <= a->degree[0]; i++)
    for (size_t k = 0; k <= du; k++)
      for (size_t j = 0; j < na; j++) work[(i + k) * na + j] += weights[k] * a->c[i * na + j];
  certify_binomials(dv, weights);
  certify_clear(out, degree_u, degree_v);
  for (size_t i = 0; i <= degree_u; i++)
    for (size_t j = 0; j < na; j++)
      for (size_t l = 0; l <= dv; l++) out->c[i * n + j + l] += weights[l] * work[i * na + j];
  unsigned path = 4 + least(du, a->degree[0]) + least(dv, a->degree[1]);
  out->most = (a->most + a->error) * CERTIFY_UP;
  out->error = (a->error + path * CERTIFY_EPS * out->most) * CERTIFY_UP + CERTIFY_TINY;
}

/* Bernstein polynomials of degree n at t, or divided by the binomials. */
static void basis(unsigned n, bool scaled, double t, double *b) {
  b[0] = 1;
  for (unsigned k = 1; k <= n; k++) {
    b[k] = t * b[k - 1];
    for (unsigned i = k - 1; i > 0; i--) b[i] = t * b[i - 1] + (1 - t) * b[i];
    b[0] *= 1 - t;
  }
  if (!scaled) return;
  double binomials[CERTIFY_ORDER];
  certify_binomials(n, binomials);
  for (unsigned k = 0; k <= n; k++) b[k] /= binomials[k];
}

double certify_value(const certify_poly *p, bool scaled, double u, double v) {
  double at_u[CERTIFY_ORDER], at_v[CERTIFY_ORDER], sum = 0;
  basis(p->degree[0], scaled, u, at_u);
  basis(p->degree[1], scaled, v, at_v);
  const double *c = p->c;
  for (unsigned i = 0; i <= p->degree[0]; i++) {
    double row = 0;
    for (unsigned j = 0; j <= p->degree[1]; j++) row += at_v[j] * *c++;
    sum += at_u[i] * row;
  }
  return sum;
}

/* De Casteljau's algorithm at 1/2: of the level r of its triangle the first entry is a coefficient of the lower half
 * and the last one of the upper half. All rows are done as one, of which neighbours spoil each other's ends: an end
 * that is taken at level r is spoilt after it. */
static void bisect_columns(size_t rows, size_t columns, double *c, double *upper, double *work) {
  size_t all = rows * columns, last = columns - 1;
  memcpy(work, c, all * sizeof *work);
  for (size_t level = 0;; level++) {
    for (size_t i = 0; i < rows; i++) {
      c[i * columns + level] = work[i * columns];
      upper[i * columns + last - level] = work[i * columns + last - level];
    }
    if (level == last) return;
    for (size_t x = 0; x + 1 < all; x++) work[x] = 0.5 * (work[x] + work[x + 1]);
  }
}

static void bisect_rows(size_t rows, size_t columns, double *c, double *upper) {
  memcpy(upper, c, rows * columns * sizeof *c);
  for (size_t level = 1; level < rows; level++) {
    size_t kept = (rows - level) * columns;
    for (size_t x = 0; x < kept; x++) upper[x] = 0.5 * (upper[x] + upper[x + columns]);
    memcpy(c + level * columns, upper, columns * sizeof *c);
  }
}

void certify_bisect(unsigned axis, size_t polys, size_t rows, size_t columns, double *c, double *upper,
                    double *work) {
  if (axis == 1) bisect_columns(polys * rows, columns, c, upper, work);
  for (size_t p = 0; p < polys && axis == 0; p++)
    bisect_rows(rows, columns, c + p * rows * columns, upper + p * rows * columns);
}
