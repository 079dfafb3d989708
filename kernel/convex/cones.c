/* Cones that bound first derivatives and their cross products. */
#include "cones.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "mesh/vec.h"

bool convex_cone_bound(size_t count, double (*vectors)[3], const double normal[3], convex_cone *out) {
  convex_cone c = {{0}, {{0}}, {INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
  for (size_t i = 0; i < count; i++)
    for (int k = 0; k < 3; k++) c.axis[k] += vectors[i][k];
  if (!vec_normalize(c.axis)) return false;
  double along = vec_dot(normal, c.axis);
  for (int k = 0; k < 3; k++) c.side[0][k] = normal[k] - along * c.axis[k];
  if (!vec_normalize(c.side[0])) return false;
  vec_cross(c.axis, c.side[0], c.side[1]);
  for (size_t i = 0; i < count; i++) {
    double ahead = vec_dot(vectors[i], c.axis);
    if (!(ahead > 0)) return false;
    for (int k = 0; k < 2; k++) {
      double slope = vec_dot(vectors[i], c.side[k]) / ahead;
      c.low[k] = fmin(c.low[k], slope);
      c.high[k] = fmax(c.high[k], slope);
    }
  }
  *out = c;
  return isfinite(c.high[0] - c.low[0]) && isfinite(c.high[1] - c.low[1]);
}

convex_cone convex_cone_widen(const convex_cone *cone, double delta) {
  convex_cone wide = *cone;
  for (int k = 0; k < 2; k++) {
    wide.low[k] -= delta;
    wide.high[k] += delta;
  }
  return wide;
}

void convex_cone_facets(const convex_cone *cone, double facets[4][3]) {
  for (int k = 0; k < 2; k++)
    for (int j = 0; j < 3; j++) {
      facets[2 * k][j] = cone->side[k][j] - cone->low[k] * cone->axis[j];
      facets[2 * k + 1][j] = cone->high[k] * cone->axis[j] - cone->side[k][j];
    }
  for (int k = 0; k < 4; k++) vec_normalize(facets[k]);
}

static void ray(const convex_cone *c, int index, double *out) {
  double slope0 = index & 1 ? c->high[0] : c->low[0], slope1 = index & 2 ? c->high[1] : c->low[1];
  for (int j = 0; j < 3; j++) out[j] = c->axis[j] + slope0 * c->side[0][j] + slope1 * c->side[1][j];
}

typedef struct place {
  double x, y;
  int index;
} place;

/* Twice the area of a b c; what is flat up to rounding counts as flat. */
static double turn(const place *a, const place *b, const place *c) {
  double x0 = b->x - a->x, y0 = b->y - a->y, x1 = c->x - a->x, y1 = c->y - a->y;
  double area = x0 * y1 - x1 * y0, size = fabs(x0 * y1) + fabs(x1 * y0);
  return fabs(area) > 16 * DBL_EPSILON * size ? area : 0;
}

/* Andrew's monotone chain; places come sorted. Writes the indices of the corners, counter-clockwise. */
static size_t hull(size_t count, const place *places, int *corners) {
  const place *chain[2 * CONVEX_CROSS_RAYS];
  size_t top = 0;
  for (size_t i = 0; i < count; i++) {
    while (top >= 2 && turn(chain[top - 2], chain[top - 1], &places[i]) <= 0) top--;
    chain[top++] = &places[i];
  }
  size_t lower = top + 1;
  for (size_t i = count - 1; i-- > 0;) {
    while (top >= lower && turn(chain[top - 2], chain[top - 1], &places[i]) <= 0) top--;
    chain[top++] = &places[i];
  }
  top--; /* the first again */
  for (size_t i = 0; i < top; i++) corners[i] = chain[i]->index;
  return top;
}

size_t convex_cone_cross(const convex_cone *first, const convex_cone *second, const double normal[3],
                         double out[CONVEX_CROSS_RAYS][3]) {
  double rays[4][3], products[CONVEX_CROSS_RAYS][3], across[3];
  for (int j = 0; j < 4; j++) ray(second, j, rays[j]);
  vec_cross(normal, first->axis, across);
  place places[CONVEX_CROSS_RAYS];
  for (int i = 0; i < 4; i++) {
    double other[3];
    ray(first, i, other);
    for (int j = 0; j < 4; j++) {
      double *w = products[4 * i + j];
      vec_cross(other, rays[j], w);
      double height = vec_dot(w, normal);
      if (!(height > 0)) return 0;
      for (int k = 0; k < 3; k++) w[k] /= height;
      /* Along first->axis and across it: axes that turn with the surface, so that the result does too. */
      place p = {vec_dot(w, first->axis), vec_dot(w, across), 4 * i + j};
      int at = 4 * i + j;
      for (; at > 0 && (places[at - 1].x > p.x || (places[at - 1].x == p.x && places[at - 1].y > p.y)); at--)
        places[at] = places[at - 1];
      places[at] = p;
    }
  }
  int corners[2 * CONVEX_CROSS_RAYS];
  size_t count = hull(CONVEX_CROSS_RAYS, places, corners);
  for (size_t k = 0; k < count; k++) memcpy(out[k], products[corners[k]], sizeof out[k]);
  return count;
}
