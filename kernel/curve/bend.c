/* Derivatives of a span in Bernstein form, by Boehm's knot insertion, and their product.   [Boehm 1980]
 *
 * Every coefficient carries its own bound: on short spans beside long ones the coefficients' errors differ by
 * the ratio of their lengths. Differences of control points come first, as these were given: they are what the proof
 * is about, and lose nothing by points that are far from the origin. */
#include "bend.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"

enum { ORDER = BSPLINE_ORDER };

typedef struct vectors {
  unsigned degree;
  double v[ORDER][2], error[ORDER];
} vectors;

static double largest(const vectors *x) {
  double most = 0;
  for (unsigned j = 0; j <= x->degree; j++) most = fmax(most, fmax(fabs(x->v[j][0]), fabs(x->v[j][1])));
  return most;
}

/* The power of two by which the largest coordinate becomes 1 .. 2, as far as its products stay far from overflow. */
static int normalise(vectors *x) {
  double most = largest(x);
  if (!(most > 0)) return 0;
  int exponent = -ilogb(most);
  if (exponent > 400) exponent = 400;
  double factor = ldexp(1, exponent);
  for (unsigned j = 0; j <= x->degree; j++) {
    x->v[j][0] *= factor;
    x->v[j][1] *= factor;
    x->error[j] *= factor;
  }
  return exponent;
}

/* a becomes from a + to b. Both parts are off by 3 roundings, products and sum by one each. */
static void blend(vectors *x, unsigned j, double from, double to, unsigned into) {
  const double *a = x->v[j], *b = x->v[j + 1];
  double size = 0, *out = x->v[into], sum[2];
  for (int k = 0; k < 2; k++) {
    size = fmax(size, from * fabs(a[k]) + to * fabs(b[k]));
    sum[k] = from * a[k] + to * b[k];
  }
  x->error[into] = (from * x->error[j] + to * x->error[j + 1] + 8 * CERTIFY_EPS * size) * CERTIFY_UP + CERTIFY_TINY;
  out[0] = sum[0];
  out[1] = sum[1];
}

/* Inserts the ends of the span until they are `degree` fold. knots[1 .. 2 degree], t_degree and t_(degree+1) the
 * ends; point j is the blossom's value at t_(j+1) .. t_(j+degree). */
static void to_bezier(vectors *x, double *knots) {
  unsigned d = x->degree;
  if (d == 0) return;
  double lower = knots[d], upper = knots[d + 1];
  while (knots[1] < lower) {
    for (unsigned j = 0; j < d; j++) {
      double left = knots[j + 1], right = knots[j + 1 + d], width = right - left;
      if (left < lower) blend(x, j, (right - lower) / width, (lower - left) / width, j);
    }
    for (unsigned i = 1; i < d; i++) knots[i] = knots[i + 1];
  }
  while (knots[2 * d] > upper) {
    for (unsigned j = d; j > 0; j--) {
      double left = knots[j], right = knots[j + d], width = right - left;
      if (right > upper) blend(x, j - 1, (right - upper) / width, (upper - left) / width, j);
    }
    for (unsigned i = 2 * d; i > d + 1; i--) knots[i] = knots[i - 1];
  }
}

/* The control points of x' on the span as those of degree - 1, by s. knots[0 .. 2 degree + 1]. */
static void differentiate_points(const batten_curve *curve, size_t mu, const double *knots, double data_error,
                                 vectors *out) {
  unsigned d = curve->space.degree;
  const double *points = curve->control_points + 2 * (mu - d);
  double length = knots[d + 1] - knots[d], unit = ldexp(1, curve->exponent);
  out->degree = d - 1;
  for (unsigned j = 0; j < d; j++) {
    double factor = d * (length / (knots[j + d + 1] - knots[j + 1])), size = 0;
    for (unsigned k = 0; k < 2; k++) {
      out->v[j][k] = factor * (unit * (points[2 * j + 2 + k] - points[2 * j + k]));
      size = fmax(size, fabs(out->v[j][k]));
    }
    out->error[j] = (2 * factor * data_error + 6 * CERTIFY_EPS * size) * CERTIFY_UP + CERTIFY_TINY;
  }
}

/* The same for x'' from those of x', the span being knots[degree + 1 .. degree + 2] there. */
static void differentiate(const vectors *x, const double *knots, vectors *out) {
  unsigned m = x->degree;
  double length = knots[m + 2] - knots[m + 1];
  out->degree = m - 1;
  for (unsigned j = 0; j < m; j++) {
    double factor = m * (length / (knots[j + m + 2] - knots[j + 2])), size = 0;
    for (int k = 0; k < 2; k++) {
      out->v[j][k] = factor * (x->v[j + 1][k] - x->v[j][k]);
      size = fmax(size, fabs(out->v[j][k]));
    }
    out->error[j] = (factor * (x->error[j] + x->error[j + 1]) + 6 * CERTIFY_EPS * size) * CERTIFY_UP + CERTIFY_TINY;
  }
}

static void binomials(unsigned n, double *row) {
  row[0] = 1;
  for (unsigned k = 1; k <= n; k++) row[k] = row[k - 1] * (n - k + 1) / k; /* whole numbers all the way */
}

/* [p, x''], p the coefficients of x' without the last one. */
static void multiply(const vectors *second, bend *out) {
  unsigned m = out->m, n = 2 * m - 2;
  double own[BEND_TANGENTS], both[BEND_PRODUCTS], size[BEND_PRODUCTS] = {0}, error[BEND_PRODUCTS] = {0};
  binomials(m - 1, own);
  binomials(n, both);
  memset(out->g, 0, sizeof out->g);
  for (unsigned k = 0; k < m; k++)
    for (unsigned i = 0; i < m; i++) {
      const double *a = out->a[k], *b = second->v[i];
      double weight = own[k] * own[i], p = a[0] * b[1], q = a[1] * b[0], ea = out->a_error[k], eb = second->error[i];
      out->g[k + i] += weight * (p - q);
      size[k + i] += weight * (fabs(p) + fabs(q));
      error[k + i] += weight * (ea * (fabs(b[0]) + fabs(b[1])) + eb * (fabs(a[0]) + fabs(a[1])) + 2 * ea * eb);
    }
  out->n = n;
  for (unsigned r = 0; r <= n; r++) {
    out->g[r] /= both[r];
    out->g_error[r] = (error[r] + (m + 6) * CERTIFY_EPS * size[r]) / both[r] * CERTIFY_UP + CERTIFY_TINY;
  }
}

double bend_data_error(const batten_curve *curve) {
  double most = 0;
  for (size_t i = 0; i < 2 * curve->space.count; i++) most = fmax(most, fabs(curve->control_points[i]));
  return 4 * CERTIFY_EPS * ldexp(most, curve->exponent);
}

void bend_make(const batten_curve *curve, size_t mu, double data_error, bend *out) {
  unsigned d = curve->space.degree;
  double knots[2 * ORDER], work[2 * ORDER];
  vectors first, second;
  memcpy(knots, curve->space.knots + mu - d, (2 * d + 2) * sizeof *knots);
  memset(out, 0, sizeof *out);
  differentiate_points(curve, mu, knots, data_error, &first);
  out->exponent = normalise(&first);
  if (d > 1) {
    differentiate(&first, knots, &second);
    out->exponent -= normalise(&second);
    memcpy(work, knots + 2, (2 * d - 2) * sizeof *work);
    to_bezier(&second, work);
  }
  memcpy(work, knots + 1, 2 * d * sizeof *work);
  to_bezier(&first, work);
  out->m = d - 1;
  for (unsigned k = 0; k < d; k++) {
    memcpy(out->a[k], first.v[k], sizeof out->a[k]);
    out->a_error[k] = first.error[k];
  }
  if (d > 1) multiply(&second, out);
}

/* De Casteljau's algorithm at `to` on n + 1 rows of dim numbers with their errors; the arguments become the left
 * part. The first entry of a level is a coefficient of the left part, the last one of the right. `roundings`: of a
 * combination. */
static void split_rows(unsigned n, unsigned dim, double to, double roundings, double *c, double *error, double *right,
                       double *right_error) {
  double from = 1 - to, work[2 * BEND_TANGENTS], work_error[BEND_PRODUCTS];
  memcpy(work, c, (n + 1) * dim * sizeof *work);
  memcpy(work_error, error, (n + 1) * sizeof *work);
  for (unsigned level = 0;; level++) {
    unsigned last = n - level;
    for (unsigned k = 0; k < dim; k++) {
      c[level * dim + k] = work[k];
      right[last * dim + k] = work[last * dim + k];
    }
    error[level] = work_error[0];
    right_error[last] = work_error[last];
    if (last == 0) return;
    for (unsigned i = 0; i < last; i++) {
      double size = 0;
      for (unsigned x = i * dim; x < (i + 1) * dim; x++) {
        size = fmax(size, from * fabs(work[x]) + to * fabs(work[x + dim]));
        work[x] = from * work[x] + to * work[x + dim];
      }
      double sum = from * work_error[i] + to * work_error[i + 1] + roundings * CERTIFY_EPS * size;
      work_error[i] = sum * CERTIFY_UP + CERTIFY_TINY;
    }
  }
}

void bend_split(bend *whole, double s, bend *right) {
  double roundings = s == 0.5 ? 1 : 4; /* halves are exact: one for the sum */
  right->m = whole->m;
  right->n = whole->n;
  right->exponent = whole->exponent;
  split_rows(whole->m, 2, s, roundings, whole->a[0], whole->a_error, right->a[0], right->a_error);
  split_rows(whole->n, 1, s, roundings, whole->g, whole->g_error, right->g, right->g_error);
}

static void swap(double *a, double *b) {
  double keep = *a;
  *a = *b;
  *b = keep;
}

void bend_reverse(bend *b) {
  for (unsigned i = 0, j = b->m; i < j; i++, j--) {
    for (int k = 0; k < 2; k++) swap(&b->a[i][k], &b->a[j][k]);
    swap(&b->a_error[i], &b->a_error[j]);
  }
  for (unsigned i = 0, j = b->n; i < j; i++, j--) {
    swap(&b->g[i], &b->g[j]);
    swap(&b->g_error[i], &b->g_error[j]);
  }
}

void bend_negate(bend *b) {
  for (unsigned i = 0; i <= b->n; i++) b->g[i] = -b->g[i];
}

int bend_turn(const double a[2], double a_error, const double b[2], double b_error) {
  double p = a[0] * b[1], q = a[1] * b[0], cross = p - q;
  double error = a_error * (fabs(b[0]) + fabs(b[1])) + b_error * (fabs(a[0]) + fabs(a[1])) + 2 * a_error * b_error +
                 4 * CERTIFY_EPS * (fabs(p) + fabs(q));
  error = error * CERTIFY_UP + CERTIFY_TINY;
  return cross > error ? 1 : cross < -error ? -1 : 0;
}
