/* The box of a network's surface: control points hold the surface between them, and split patches do so ever closer.
 *
 * For each of the six directions the coordinates of a patch along it are a function in Bernstein form. Parts whose
 * coefficients stay below what is known to be reached, plus a tolerance, need no more care; others are split. Few
 * patches are ever looked at twice. */
#include "box.h"

#include "surface.h"

#include <string.h>

enum { DEPTH = 8 };

/* A bound of the function over the patch, >= reached + tolerance only where DEPTH ends; raises *reached by values at
 * corners. work: [3 DEPTH + 1 + 4 + 4][count]. */
static double bound(unsigned degree, double *work, double tolerance, double *reached) {
  size_t count = triangular_count(degree), height = 1;
  unsigned depth[3 * DEPTH + 4];
  double *copy = work + (3 * DEPTH + 4) * count, most = -INFINITY;
  depth[0] = 0;
  while (height > 0) {
    double *top = work + --height * count, above = -INFINITY;
    for (size_t i = 0; i < count; i++) above = fmax(above, top[i]);
    *reached = fmax(*reached, fmax(top[0], fmax(top[degree], top[count - 1])));
    if (above <= *reached + tolerance || depth[height] == DEPTH) {
      most = fmax(most, above);
      continue;
    }
    unsigned below = depth[height] + 1;
    memcpy(copy, top, count * sizeof *top);
    triangular_split(degree, 1, copy, top, copy + count);
    for (unsigned k = 0; k < 4; k++) depth[height + k] = below;
    height += 4;
  }
  return most;
}

batten_status net_box(batten_context *ctx, const batten_network *network, double lower[3], double upper[3]) {
  double *work = batten_alloc_array(ctx, (3 * DEPTH + 8) * TRIANGULAR_MAX, sizeof *work);
  if (!work) return BATTEN_E_NOMEM;
  double size = 0;
  for (int d = 0; d < 3; d++) size = fmax(size, upper[d] - lower[d]);
  for (int d = 0; d < 6; d++) {
    double sign = d < 3 ? 1 : -1, reached = d < 3 ? upper[d] : -lower[d - 3], most = reached;
    for (size_t p = 0; p < network->patch_count; p++) {
      unsigned degree = net_surface_degree(network, p);
      const double(*net)[3] = (const double(*)[3])net_surface_points(network, p);
      double above = -INFINITY;
      for (size_t i = 0; i < triangular_count(degree); i++) above = fmax(above, sign * net[i][d % 3]);
      if (above <= most) continue;
      for (size_t i = 0; i < triangular_count(degree); i++) work[i] = sign * net[i][d % 3];
      most = fmax(most, bound(degree, work, 1e-6 * size, &reached));
    }
    if (d < 3)
      upper[d] = most;
    else
      lower[d - 3] = -most;
  }
  batten_free(ctx, work);
  return BATTEN_OK;
}
