/* The box of a surface: control points hold the surface between them, and split nets do so ever closer.
 *
 * For each of the six directions the coordinates of a span pair along it are a function in Bernstein form. Parts
 * whose coefficients stay below what is known to be reached, plus a tolerance, need no more care; others are cut in
 * two across the direction in which the coefficients differ more. The largest is all but reached along whole curves
 * of a torus: after many parts more and more may be missed. */
#include "surface_inner.h"

#include "base/checked.h"

#include <string.h>

enum { NET = BSPLINE_ORDER * BSPLINE_ORDER, DEPTH = 60, PATIENCE = 1 << 15 };
static const double MISS = 0.5e-9, CONCESSION = 16;

/* One direction: all nets are [p + 1][q + 1]. */
typedef struct search {
  unsigned p, q;
  double reached, tolerance;
  double *stack; /* [DEPTH + 2][NET] */
  unsigned depth[DEPTH + 2];
} search;

static double largest_coefficient(const search *s, const double *net) {
  double most = net[0];
  for (size_t i = 1; i < (s->p + 1) * (size_t)(s->q + 1); i++) most = fmax(most, net[i]);
  return most;
}

static void raise_reached(search *s, const double *net) {
  size_t row = s->q + 1, last = s->p * row;
  s->reached = fmax(s->reached, fmax(fmax(net[0], net[s->q]), fmax(net[last], net[last + s->q])));
}

/* A bound of the function over the net at the bottom of the stack, at most reached + tolerance but after DEPTH. */
static double bound(search *s) {
  size_t height = 1;
  double most = -INFINITY, tolerance = s->tolerance;
  s->depth[0] = 0;
  for (size_t looked = 1; height > 0; looked++) {
    double *top = s->stack + --height * NET, above = largest_coefficient(s, top);
    unsigned depth = s->depth[height];
    if (looked % PATIENCE == 0) tolerance *= CONCESSION;
    raise_reached(s, top);
    if (above <= s->reached + tolerance || depth == DEPTH) {
      most = fmax(most, above);
      continue;
    }
    surface_net_halve(s->p, s->q, 1, surface_net_longer_in_u(s->p, s->q, 1, top), top, top + NET);
    s->depth[height] = s->depth[height + 1] = depth + 1;
    height += 2;
  }
  return most;
}

static void find_along(const batten_surface *surface, const surface_axis axis[2], int d, double sign, double size,
                       search *s, double *out) {
  static const double origin[3] = {0, 0, 0};
  size_t count = (s->p + 1) * (size_t)(s->q + 1), own = surface->space[0].count * surface->space[1].count;
  /* Corners of the surface are reached; most span pairs are not near the largest of them. */
  size_t row = surface->space[1].count;
  const size_t corners[4] = {0, row - 1, own - row, own - 1};
  double most = -INFINITY;
  s->tolerance = MISS * size;
  s->reached = -INFINITY;
  for (int c = 0; c < 4; c++)
    s->reached = fmax(s->reached, sign * surface->control_points[3 * corners[c] + (size_t)d]);
  for (int pass = 0; pass < 2; pass++)
    for (size_t i = 0; i < axis[0].count; i++)
      for (size_t j = 0; j < axis[1].count; j++) {
        double net[NET][3];
        surface_patch_net(surface, axis, i, j, origin, 0, net);
        for (size_t k = 0; k < count; k++) s->stack[k] = sign * net[k][d];
        /* First all corners of span pairs, so that the search begins with a good value. */
        if (pass == 0)
          raise_reached(s, s->stack);
        else
          most = fmax(most, bound(s));
      }
  *out = sign * most;
}

batten_status surface_find_box(batten_context *ctx, const batten_surface *surface, const surface_axis axis[2],
                               double lower[3], double upper[3]) {
  search s = {.p = axis[0].degree, .q = axis[1].degree};
  s.stack = batten_alloc_array(ctx, DEPTH + 2, NET * sizeof *s.stack);
  if (!s.stack) return BATTEN_E_NOMEM;
  /* That of the control points is as large or up to twice that. */
  double size = ldexp(1, -surface->exponent);
  for (int d = 0; d < 3; d++) {
    find_along(surface, axis, d, 1, size, &s, &upper[d]);
    find_along(surface, axis, d, -1, size, &s, &lower[d]);
  }
  batten_free(ctx, s.stack);
  return BATTEN_OK;
}
