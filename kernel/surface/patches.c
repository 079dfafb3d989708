/* Span pairs of a surface as Bezier patches. */
#include "surface_inner.h"

#include "base/checked.h"

#include <string.h>

batten_status surface_axis_make(batten_context *ctx, const bspline *space, surface_axis *out) {
  unsigned d = space->degree;
  size_t order = d + 1, mu = bspline_first(space);
  *out = (surface_axis){.degree = d, .count = bspline_span_count(space)};
  out->span = batten_alloc_array(ctx, out->count, sizeof *out->span);
  out->rows = out->span ? batten_alloc_array(ctx, out->count, order * order * sizeof *out->rows) : NULL;
  if (!out->rows) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < out->count; i++, mu = bspline_next(space, mu)) {
    out->span[i] = mu;
    bspline_rows(space, mu, 0, space->knots[mu], space->knots[mu + 1], out->rows + i * order * order);
  }
  return BATTEN_OK;
}

void surface_axis_free(batten_context *ctx, surface_axis *axis) {
  batten_free(ctx, axis->rows);
  batten_free(ctx, axis->span);
}

void surface_patch_net(const batten_surface *surface, const surface_axis axis[2], size_t i, size_t j,
                       const double origin[3], int exponent, double (*net)[3]) {
  unsigned p = axis[0].degree, q = axis[1].degree;
  size_t stride = surface->space[1].count;
  const double *along = axis[0].rows + i * (p + 1) * (p + 1), *across = axis[1].rows + j * (q + 1) * (q + 1);
  const double *points = surface->control_points + 3 * ((axis[0].span[i] - p) * stride + axis[1].span[j] - q);
  double unit = ldexp(1, exponent), half[BSPLINE_ORDER][3];
  memset(net, 0, (size_t)(p + 1) * (q + 1) * sizeof *net);
  for (unsigned a = 0; a <= p; a++, points += 3 * stride) {
    /* One row of control points along v, then its share in all rows of the net. */
    for (unsigned c = 0; c <= q; c++)
      for (unsigned d = 0; d < 3; d++) {
        half[c][d] = 0;
        for (unsigned b = 0; b <= q; b++)
          half[c][d] += across[c * (q + 1) + b] * ((points[3 * b + d] - origin[d]) * unit);
      }
    for (unsigned k = 0; k <= p; k++) {
      double weight = along[k * (p + 1) + a];
      double(*row)[3] = net + k * (q + 1);
      for (unsigned c = 0; c <= q; c++)
        for (unsigned d = 0; d < 3; d++) row[c][d] += weight * half[c][d];
    }
  }
}

void surface_net_halve(unsigned p, unsigned q, unsigned dim, bool by_u, double *left, double *right) {
  /* de Casteljau's algorithm along all lines at once: `lines` numbers, then those `step` further. */
  size_t row = (q + 1) * (size_t)dim, step = by_u ? row : dim, blocks = by_u ? 1 : p + 1;
  unsigned degree = by_u ? p : q;
  memcpy(right, left, (p + 1) * row * sizeof *left);
  for (size_t block = 0; block < blocks; block++) {
    double *a = left + block * row, *b = right + block * row;
    for (unsigned level = 0; level <= degree; level++) {
      memcpy(a + level * step, b, step * sizeof *a);
      for (size_t x = 0; x < (degree - level) * step; x++) b[x] = 0.5 * (b[x] + b[x + step]);
    }
  }
}

bool surface_net_longer_in_u(unsigned p, unsigned q, unsigned dim, const double *net) {
  double u = 0, v = 0;
  size_t row = (q + 1) * (size_t)dim;
  for (size_t i = 0; i <= p; i++)
    for (size_t x = 0; x < row; x++) {
      const double *b = net + i * row + x;
      if (i < p) u = fmax(u, fabs(b[row] - b[0]));
      if (x + dim < row) v = fmax(v, fabs(b[dim] - b[0]));
    }
  return u >= v;
}
