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
