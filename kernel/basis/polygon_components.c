/* Components of polygons (an outer loop with its holes): measures, and whether two of them overlap.
 *
 * Two areas have a common point when their edges meet, or when one lies within the other as a whole, which one point
 * of it tells. How much they share is counted on regular places, a row of them in the bits of one word: an edge turns
 * all bits on its right in each row that it crosses. */
#include "basis/polygon.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "mesh/predicates.h"

enum { PLACES = 64 }; /* a side: bits of a word */

static bool belongs(const polygon_set *p, size_t loop, size_t outer) {
  return loop == outer || p->parent[loop] == outer;
}

static size_t point_after(const polygon_set *p, size_t loop, size_t i) {
  return i + 1 < p->starts[loop + 1] ? i + 1 : p->starts[loop];
}

/* ---- do they meet -------------------------------------------------------------------------------- */

static int turn(const double *a, const double *b, const double *c) { return batten_orient2d(a, b, c, 0, 1); }

/* Closed segments whose boxes meet; parallel ones on a line too. */
static bool segments_meet(const double *a, const double *b, const double *c, const double *d) {
  return turn(a, b, c) * turn(a, b, d) <= 0 && turn(c, d, a) * turn(c, d, b) <= 0;
}

/* Does the segment a b meet an edge of the component? */
static bool segment_meets(const polygon_set *p, size_t outer, const double *a, const double *b) {
  const double lower[2] = {fmin(a[0], b[0]), fmin(a[1], b[1])}, upper[2] = {fmax(a[0], b[0]), fmax(a[1], b[1])};
  polygon_range stack[POLYGON_STACK] = {{0, 0, p->tree.boxes.count}};
  size_t height = 1;
  while (height > 0) {
    polygon_range r = stack[--height];
    const box3 *box = &p->tree.boxes.boxes[r.node];
    if (box->lower[0] > upper[0] || box->upper[0] < lower[0] || box->lower[1] > upper[1] || box->upper[1] < lower[1])
      continue;
    if (r.to - r.from > 1) {
      polygon_halves(r, stack + height);
      height += 2;
      continue;
    }
    const double *ends = p->tree.leaves + 4 * r.from;
    if (belongs(p, p->tree.loop[p->tree.boxes.order[r.from]], outer) && segments_meet(a, b, ends, ends + 2))
      return true;
  }
  return false;
}

/* x is known not to lie on an edge. */
static bool component_holds(const polygon_set *p, size_t outer, const double *x) {
  bool inside = false;
  for (size_t k = 0; k < p->count; k++) {
    if (!belongs(p, k, outer)) continue;
    for (size_t i = p->starts[k]; i < p->starts[k + 1]; i++) {
      const double *a = p->points + 2 * i, *b = p->points + 2 * point_after(p, k, i);
      bool low = a[1] <= x[1];
      if (low != (b[1] <= x[1])) inside ^= turn(a, b, x) == (low ? 1 : -1);
    }
  }
  return inside;
}

static void moved(const double *x, const double *shift, double sign, double *out) {
  for (int d = 0; d < 2; d++) out[d] = shift ? x[d] + sign * shift[d] : x[d];
}

static bool components_meet(const polygon_set *a, size_t outer_a, const polygon_set *b, size_t outer_b,
                            const double *shift) {
  double x[2], y[2];
  for (size_t k = 0; k < b->count; k++) {
    if (!belongs(b, k, outer_b)) continue;
    for (size_t i = b->starts[k]; i < b->starts[k + 1]; i++) {
      moved(b->points + 2 * i, shift, 1, x);
      moved(b->points + 2 * point_after(b, k, i), shift, 1, y);
      if (segment_meets(a, outer_a, x, y)) return true;
    }
  }
  moved(b->points + 2 * b->starts[outer_b], shift, 1, x);
  moved(a->points + 2 * a->starts[outer_a], shift, -1, y);
  return component_holds(a, outer_a, x) || component_holds(b, outer_b, y);
}

/* ---- how much they share ------------------------------------------------------------------------- */

static void component_box(const polygon_set *p, size_t outer, const double *shift, double *lower, double *upper) {
  lower[0] = lower[1] = INFINITY;
  upper[0] = upper[1] = -INFINITY;
  for (size_t i = p->starts[outer]; i < p->starts[outer + 1]; i++) {
    double x[2];
    moved(p->points + 2 * i, shift, 1, x);
    for (int d = 0; d < 2; d++) {
      lower[d] = fmin(lower[d], x[d]);
      upper[d] = fmax(upper[d], x[d]);
    }
  }
}

/* Turns the places right of the edge a b: place k of a row is lower[0] + (k + 1/2) step[0]. */
static void rasterize_edge(const double *a, const double *b, const double *lower, const double *step,
                           uint64_t rows[PLACES]) {
  double low = fmin(a[1], b[1]), high = fmax(a[1], b[1]);
  double first = ceil((low - lower[1]) / step[1] - 0.5), end = ceil((high - lower[1]) / step[1] - 0.5);
  for (size_t row = (size_t)fmin(fmax(first, 0), PLACES); row < PLACES && (double)row < end; row++) {
    double y = lower[1] + ((double)row + 0.5) * step[1], x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
    double column = ceil((x - lower[0]) / step[0] - 0.5);
    if (column < PLACES) rows[row] ^= UINT64_MAX << (unsigned)fmax(column, 0);
  }
}

static void rasterize(const polygon_set *p, size_t outer, const double *shift, const double *lower,
                      const double *step, uint64_t rows[PLACES]) {
  memset(rows, 0, PLACES * sizeof *rows);
  for (size_t k = 0; k < p->count; k++) {
    if (!belongs(p, k, outer)) continue;
    for (size_t i = p->starts[k]; i < p->starts[k + 1]; i++) {
      double a[2], b[2];
      moved(p->points + 2 * i, shift, 1, a);
      moved(p->points + 2 * point_after(p, k, i), shift, 1, b);
      rasterize_edge(a, b, lower, step, rows);
    }
  }
}

static unsigned bits_of(uint64_t word) {
  unsigned n = 0;
  for (; word; word &= word - 1) n++;
  return n;
}

/* Of equal areas the one whose box begins first counts as the smaller. */
static bool first_is_smaller(double area_a, const double *lower_a, double area_b, const double *lower_b) {
  if (area_a != area_b) return area_a < area_b;
  return lower_a[0] != lower_b[0] ? lower_a[0] < lower_b[0] : lower_a[1] <= lower_b[1];
}

static double common_share(const polygon_set *a, size_t outer_a, const polygon_set *b, size_t outer_b,
                           const double *shift) {
  double area_a, area_b, center[2], lower[2][2], upper[2][2], step[2];
  polygon_component_measure(a, outer_a, &area_a, center);
  polygon_component_measure(b, outer_b, &area_b, center);
  component_box(a, outer_a, NULL, lower[0], upper[0]);
  component_box(b, outer_b, shift, lower[1], upper[1]);
  int small = first_is_smaller(area_a, lower[0], area_b, lower[1]) ? 0 : 1;
  for (int d = 0; d < 2; d++) step[d] = (upper[small][d] - lower[small][d]) / PLACES;
  uint64_t rows[2][PLACES];
  rasterize(a, outer_a, NULL, lower[small], step, rows[0]);
  rasterize(b, outer_b, shift, lower[small], step, rows[1]);
  unsigned both = 0, one = 0;
  for (size_t r = 0; r < PLACES; r++) {
    both += bits_of(rows[0][r] & rows[1][r]);
    one += bits_of(rows[small][r]);
  }
  return one > 0 ? (double)both / one : 0;
}

/* ---- entries ------------------------------------------------------------------------------------- */

void polygon_component_measure(const polygon_set *p, size_t outer, double *area, double centroid[2]) {
  const double *base = p->points + 2 * p->starts[outer];
  double twice = 0, moment[2] = {0, 0};
  for (size_t k = 0; k < p->count; k++) {
    if (!belongs(p, k, outer)) continue;
    for (size_t i = p->starts[k]; i < p->starts[k + 1]; i++) {
      const double *x = p->points + 2 * i, *y = p->points + 2 * point_after(p, k, i);
      double a[2] = {x[0] - base[0], x[1] - base[1]}, b[2] = {y[0] - base[0], y[1] - base[1]};
      double cross = a[0] * b[1] - a[1] * b[0];
      twice += cross;
      for (int d = 0; d < 2; d++) moment[d] += (a[d] + b[d]) * cross;
    }
  }
  *area = twice / 2;
  for (int d = 0; d < 2; d++) centroid[d] = base[d] + (twice != 0 ? moment[d] / (3 * twice) : 0);
}

bool polygon_components_overlap(const polygon_set *a, size_t outer_a, const polygon_set *b, size_t outer_b,
                                const double *shift, double *share) {
  bool meet = components_meet(a, outer_a, b, outer_b, shift);
  if (share) *share = meet ? common_share(a, outer_a, b, outer_b, shift) : 0;
  return meet;
}
