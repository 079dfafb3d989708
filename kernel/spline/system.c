/* The system [K P; P' 0] of a fit: unit box, coordinates axis by axis, polynomial part, tiles of K on demand.
 *
 * K holds the functionals of the data (value at a point, derivative at a point) applied to both arguments of phi; it
 * is never stored as a whole here. The solver may ask for the same entry twice, in whatever tile: it gets the same
 * bits, and entry (i, j) has the bits of entry (j, i). */
#include "spline/inner.h"

#include "base/checked.h"
#include "basis/green.h"

#include <float.h>

static batten_status set_box(batten_context *ctx, const batten_spline_data *data, spline_system *s) {
  double extent = 0;
  for (unsigned a = 0; a < data->n; a++) {
    double lower = data->points[a], upper = lower;
    for (size_t i = 1; i < data->count; i++) {
      double x = data->points[i * data->n + a];
      if (x < lower) lower = x;
      if (x > upper) upper = x;
    }
    s->origin[a] = lower + 0.5 * (upper - lower);
    if (upper - lower > extent) extent = upper - lower;
  }
  /* Gradients are multiplied by the scale and Hessians divided by its square. */
  if (extent > 1e100 || (extent > 0 && extent < 1e-100))
    return batten_fail(ctx, BATTEN_E_INVALID,
                       "points: longest side of their box is %g; choose a unit of length that "
                       "brings it between 1e-100 and 1e100",
                       extent);
  s->scale = extent > 0 ? extent : 1;
  return BATTEN_OK;
}

/* P: column c at p + c * rows; monomials at the points, then their derivatives. */
static void fill_polynomial(const batten_spline_data *data, spline_system *s) {
  double row[BATTEN_POLYNOMIAL_MAX], at[3] = {0, 0, 0};
  for (size_t r = 0; r < s->rows; r++) {
    const size_t q = r < s->count ? 0 : (r - s->count) % s->gradient_count;
    const int axis = r < s->count ? -1 : (int)((r - s->count) / s->gradient_count);
    for (unsigned a = 0; a < data->n; a++) at[a] = axis < 0 ? s->y[a][r] : s->gy[a][q];
    batten_polynomial_row(&s->basis, at, axis, row);
    for (unsigned c = 0; c < s->basis.count; c++) s->p[c * s->rows + r] = row[c];
  }
}

batten_status batten_spline_system_make(batten_context *ctx, const batten_spline_data *data,
                                        const batten_spline_options *opt, spline_system *s) {
  const size_t n = data->n, count = data->count, gradients = data->gradient_count;
  *s = (spline_system){.n = data->n,
                       .m = opt->m,
                       .power = batten_green_power(data->n, opt->m),
                       .count = count,
                       .gradient_count = gradients,
                       .gradient_at = data->gradient_at,
                       .basis = batten_polynomial_basis(data->n, opt->m - 1),
                       .smoothing = opt->smoothing,
                       .smoothing_per_point = opt->smoothing_per_point,
                       .code = batten_spline_code()};
  batten_status st = set_box(ctx, data, s);
  if (st < 0) return st;
  size_t entries;
  if (!batten_mul(n, gradients, &s->rows) || !batten_add(s->rows, count, &s->rows) ||
      !batten_mul(s->rows, s->basis.count, &entries))
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu with %zu gradients", count, gradients);
  s->p = batten_alloc_array(ctx, entries, sizeof *s->p);
  if (!s->p) return BATTEN_E_NOMEM;
  for (unsigned a = 0; a < data->n; a++) {
    s->y[a] = batten_alloc_array(ctx, count, sizeof *s->y[a]);
    s->gy[a] = batten_alloc_array(ctx, gradients, sizeof *s->gy[a]);
    if (!s->y[a] || !s->gy[a]) return BATTEN_E_NOMEM;
    for (size_t i = 0; i < count; i++) s->y[a][i] = spline_to_box(data->points[i * n + a], s->origin[a], s->scale);
    for (size_t q = 0; q < gradients; q++) s->gy[a][q] = s->y[a][data->gradient_at ? data->gradient_at[q] : q];
  }
  fill_polynomial(data, s);
  return BATTEN_OK;
}

void batten_spline_system_free(batten_context *ctx, spline_system *s) {
  for (unsigned a = 0; a < 3; a++) {
    batten_free(ctx, s->y[a]);
    batten_free(ctx, s->gy[a]);
  }
  batten_free(ctx, s->p);
  batten_spline_sums_free(ctx, s);
}

/* The part of rows (or columns) that have one kind of functional. */
typedef struct stretch {
  int axis;     /* -1 value */
  size_t count; /* how many from the start */
  const double *x[3];
} stretch;

static stretch stretch_at(const spline_system *s, size_t row, size_t last) {
  stretch out = {.axis = -1};
  size_t first = 0, end = s->count;
  while (row >= end) {
    out.axis++;
    first = end;
    end += s->gradient_count;
  }
  out.count = (last < end ? last : end) - row;
  for (unsigned a = 0; a < s->n; a++) out.x[a] = (out.axis < 0 ? s->y[a] : s->gy[a]) + (row - first);
  return out;
}

static void add_smoothing(const spline_system *s, size_t row0, size_t row1, size_t col0, size_t col1, double *tile,
                          size_t ld) {
  size_t i = row0 > col0 ? row0 : col0, last = row1 < col1 ? row1 : col1;
  for (; i < last && i < s->count; i++)
    tile[i - row0 + (i - col0) * ld] += s->smoothing_per_point ? s->smoothing_per_point[i] : s->smoothing;
}

void batten_spline_system_fill(const void *user, size_t row0, size_t rows, size_t col0, size_t cols, double *tile,
                               size_t ld) {
  const spline_system *s = user;
  stretch r, c;
  for (size_t j = col0; j < col0 + cols; j += c.count) {
    c = stretch_at(s, j, col0 + cols);
    for (size_t i = row0; i < row0 + rows; i += r.count) {
      r = stretch_at(s, i, row0 + rows);
      spline_tile t = {.n = s->n,
                       .power = s->power,
                       .row_axis = r.axis,
                       .col_axis = c.axis,
                       .rows = r.count,
                       .cols = c.count,
                       .row_x = {r.x[0], r.x[1], r.x[2]},
                       .col_x = {c.x[0], c.x[1], c.x[2]},
                       .tile = tile + (i - row0) + (j - col0) * ld,
                       .ld = ld};
      s->code->tile(&t);
    }
  }
  add_smoothing(s, row0, row0 + rows, col0, col0 + cols, tile, ld);
}
