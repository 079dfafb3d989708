/* The objective of a spline function as sparse matrices: |A x - b|^2 + x' T x.
 *
 * A has the basis at the points, a row a point, times the root of its weight. T = weight times the integral of f_xx^2
 * + 2 f_xy^2 + f_yy^2 over [0, 1]^2: with the Gram matrices G_k of k-th derivatives in one variable it is
 * G_2 (x) G_0 + 2 G_1 (x) G_1 + G_0 (x) G_2. Each is exact: on a span, derivatives have Bernstein coefficients, and
 * integrals of products of Bernstein polynomials are quotients of binomials. */
#include <string.h>

#include "base/checked.h"
#include "basis/bezier.h"
#include "function_inner.h"

void function_matrix_free(batten_context *ctx, function_matrix *m) {
  batten_free(ctx, m->starts);
  batten_free(ctx, m->indices);
  batten_free(ctx, m->values);
  batten_free(ctx, m->lower);
  batten_free(ctx, m->upper);
  *m = (function_matrix){0};
}

batten_status function_matrix_reserve(batten_context *ctx, function_matrix *m, size_t rows, size_t entries) {
  size_t need_rows, need_entries, used = m->starts ? m->starts[m->rows] : 0;
  if (!batten_add(m->rows, rows, &need_rows) || !batten_add(used, entries, &need_entries) ||
      need_rows > SIZE_MAX / 4 || need_entries > SIZE_MAX / 4)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "%zu more rows; use fewer spans or points", rows);
  if (!m->starts || need_rows > m->row_room) {
    size_t room = need_rows + m->row_room / 2 + 16;
    size_t *starts = batten_realloc_array(ctx, m->starts, room + 1, sizeof *starts);
    if (!starts) return BATTEN_E_NOMEM;
    if (!m->starts) starts[0] = 0;
    m->starts = starts;
    double *lower = batten_realloc_array(ctx, m->lower, room, sizeof *lower);
    if (!lower) return BATTEN_E_NOMEM;
    m->lower = lower;
    double *upper = batten_realloc_array(ctx, m->upper, room, sizeof *upper);
    if (!upper) return BATTEN_E_NOMEM;
    m->upper = upper;
    m->row_room = room;
  }
  if (!m->indices || need_entries > m->entry_room) {
    size_t room = need_entries + m->entry_room / 2 + 64;
    uint32_t *indices = batten_realloc_array(ctx, m->indices, room, sizeof *indices);
    if (!indices) return BATTEN_E_NOMEM;
    m->indices = indices;
    double *values = batten_realloc_array(ctx, m->values, room, sizeof *values);
    if (!values) return BATTEN_E_NOMEM;
    m->values = values;
    m->entry_room = room;
  }
  return BATTEN_OK;
}

/* Integral over [0, 1] of the product of two polynomials of degree p in Bernstein form. */
static double product_integral(unsigned p, const double *a, const double *b) {
  double sum = 0;
  for (unsigned i = 0; i <= p; i++)
    for (unsigned j = 0; j <= p; j++) {
      double weight = 1; /* C(p, i) C(p, j) / C(2 p, i + j) */
      for (unsigned k = 1; k <= i; k++) weight *= (double)(p - i + k) / k;
      for (unsigned k = 1; k <= j; k++) weight *= (double)(p - j + k) / k;
      for (unsigned k = 1; k <= i + j; k++) weight *= (double)k / (2 * p - i - j + k);
      sum += weight * a[i] * b[j];
    }
  return sum / (2 * p + 1);
}

/* Gram matrix of k-th derivatives: band [count][2 d + 1], entry (i, j - i + d). */
static void gram(const bspline *b, unsigned k, double *band) {
  unsigned d = b->degree, width = 2 * d + 1;
  double rows[BSPLINE_ORDER * BSPLINE_ORDER], columns[BSPLINE_ORDER][BSPLINE_ORDER];
  memset(band, 0, b->count * width * sizeof *band);
  for (size_t mu = bspline_first(b); mu < b->count; mu = bspline_next(b, mu)) {
    double lower = b->knots[mu], upper = b->knots[mu + 1];
    bspline_rows(b, mu, k, lower, upper, rows);
    for (unsigned i = 0; i <= d; i++)
      for (unsigned r = 0; r <= d - k; r++) columns[i][r] = rows[r * (d + 1) + i];
    for (unsigned i = 0; i <= d; i++)
      for (unsigned j = 0; j <= d; j++)
        band[(mu - d + i) * width + j + d - i] += (upper - lower) * product_integral(d - k, columns[i], columns[j]);
  }
}

static batten_status make_tension(batten_context *ctx, const function_space *space, double weight,
                                  function_matrix *out) {
  const bspline *u = &space->spline.axis[0], *v = &space->spline.axis[1];
  size_t width[2] = {2 * u->degree + 1, 2 * v->degree + 1}, size[2] = {u->count * width[0], v->count * width[1]};
  double *band = batten_alloc_array(ctx, 3 * (size[0] + size[1]), sizeof *band);
  if (!band) return BATTEN_E_NOMEM;
  double *of[2][3];
  for (unsigned k = 0; k < 3; k++) {
    of[0][k] = band + k * size[0];
    of[1][k] = band + 3 * size[0] + k * size[1];
    gram(u, k, of[0][k]);
    gram(v, k, of[1][k]);
  }
  batten_status st = function_matrix_reserve(ctx, out, space->n, space->n * width[0] * width[1]);
  if (st < 0) goto done;
  for (size_t i = 0; i < u->count; i++)
    for (size_t j = 0; j < v->count; j++) {
      size_t at = out->starts[out->rows];
      for (size_t a = 0; a < width[0]; a++)
        for (size_t b = 0; b < width[1]; b++) {
          if (i + a < u->degree || i + a - u->degree >= u->count) continue;
          if (j + b < v->degree || j + b - v->degree >= v->count) continue;
          size_t x = i * width[0] + a, y = j * width[1] + b;
          out->indices[at] = (uint32_t)((i + a - u->degree) * v->count + j + b - v->degree);
          out->values[at++] =
              weight * (of[0][2][x] * of[1][0][y] + 2 * of[0][1][x] * of[1][1][y] + of[0][0][x] * of[1][2][y]);
        }
      out->starts[++out->rows] = at;
    }
done:
  batten_free(ctx, band);
  return st;
}

static batten_status make_design(batten_context *ctx, const function_space *space, size_t count, const double *points,
                                 const double *weights, function_terms *out) {
  const bspline *u = &space->spline.axis[0], *v = &space->spline.axis[1];
  unsigned d[2] = {u->degree, v->degree};
  size_t entries;
  batten_mul(count, (d[0] + 1) * (d[1] + 1), &entries);
  batten_status st = function_matrix_reserve(ctx, &out->design, count, entries);
  if (st < 0) return st;
  out->right = batten_alloc_array(ctx, count, sizeof *out->right);
  if (!out->right) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) {
    double root = sqrt(weights ? weights[i] : 1.0 / (double)count);
    if (!(root > 0)) continue;
    const double *p = points + 3 * i;
    size_t mu[2] = {bspline_span(u, p[0]), bspline_span(v, p[1])}, at = out->design.starts[out->design.rows];
    double table[2][BSPLINE_ORDER];
    bspline_basis(u, mu[0], p[0], 0, table[0]);
    bspline_basis(v, mu[1], p[1], 0, table[1]);
    for (unsigned a = 0; a <= d[0]; a++)
      for (unsigned b = 0; b <= d[1]; b++, at++) {
        out->design.indices[at] = (uint32_t)((mu[0] - d[0] + a) * v->count + mu[1] - d[1] + b);
        out->design.values[at] = root * table[0][a] * table[1][b];
      }
    out->right[out->design.rows] = root * p[2];
    out->design.starts[++out->design.rows] = at;
  }
  return BATTEN_OK;
}

batten_status function_terms_make(batten_context *ctx, const function_space *space, size_t count,
                                  const double *points, const double *weights, double tension, function_terms *out) {
  *out = (function_terms){0};
  batten_status st = make_design(ctx, space, count, points, weights, out);
  if (st == BATTEN_OK && tension > 0) st = make_tension(ctx, space, tension, &out->tension);
  if (st < 0) function_terms_free(ctx, out);
  return st;
}

void function_terms_free(batten_context *ctx, function_terms *terms) {
  function_matrix_free(ctx, &terms->design);
  function_matrix_free(ctx, &terms->tension);
  batten_free(ctx, terms->right);
  *terms = (function_terms){0};
}

static double row_times(const function_matrix *m, size_t row, const double *x) {
  double sum = 0;
  for (size_t k = m->starts[row]; k < m->starts[row + 1]; k++) sum += m->values[k] * x[m->indices[k]];
  return sum;
}

double function_terms_squares(const function_terms *terms, const double *x) {
  double sum = 0;
  for (size_t i = 0; i < terms->design.rows; i++) {
    double off = row_times(&terms->design, i, x) - terms->right[i];
    sum += off * off;
  }
  return sum;
}

double function_terms_tension(const function_terms *terms, const double *x) {
  double sum = 0;
  for (size_t i = 0; i < terms->tension.rows; i++) sum += x[i] * row_times(&terms->tension, i, x);
  return fmax(sum, 0); /* rounding: splines that are linear */
}
