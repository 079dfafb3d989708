/* Distances to closed polygons, inside and outside, by walks through the tree of their edges: the nearer child first,
 * and nothing whose box is farther than what has been found.
 *
 * Whether a point lies inside is decided by exact signs, so the distance has the right sign however near the edge.
 * Bounds over a box: the distance changes no faster than its argument, so half the box's diagonal about the value in
 * the middle bounds it; where no edge meets the box the sign is one, and nearest edges bound its size from both
 * sides. */
#include "basis/polygon.h"

#include <float.h>
#include <math.h>
#include <stdint.h>

#include "mesh/predicates.h"

typedef struct pending {
  polygon_range range;
  double gap; /* squared distance to the node's box */
} pending;

static double square(double x) { return x * x; }

/* Squared distance of x to the segment with these ends [4]; its nearest place. */
static double segment_distance2(const double *ends, const double x[2], double place[2]) {
  double u[2] = {ends[2] - ends[0], ends[3] - ends[1]}, v[2] = {x[0] - ends[0], x[1] - ends[1]};
  double along = u[0] * v[0] + u[1] * v[1], all = u[0] * u[0] + u[1] * u[1];
  if (along >= all) {
    place[0] = ends[2];
    place[1] = ends[3];
  } else {
    double s = along > 0 ? along / all : 0;
    place[0] = ends[0] + s * u[0];
    place[1] = ends[1] + s * u[1];
  }
  return square(x[0] - place[0]) + square(x[1] - place[1]);
}

static double point_box_distance2(const box3 *box, const double x[2]) {
  double sum = 0;
  for (int d = 0; d < 2; d++) {
    double out = fmax(0, fmax(box->lower[d] - x[d], x[d] - box->upper[d]));
    sum += out * out;
  }
  return sum;
}

/* Squared distance to the nearest edge of the chosen loops (NULL: all); *edge SIZE_MAX if there is none. */
static double nearest_edge(const polygon_set *p, const unsigned char *chosen, const double x[2], double nearest[2],
                           size_t *edge) {
  const polygon_tree *t = &p->tree;
  pending stack[POLYGON_STACK];
  size_t height = 0;
  double best = INFINITY;
  *edge = SIZE_MAX;
  if (p->count > 0) stack[height++] = (pending){{0, 0, t->boxes.count}, 0};
  while (height > 0) {
    pending here = stack[--height];
    if (here.gap > best) continue;
    if (here.range.to - here.range.from > 1) {
      polygon_range half[2];
      polygon_halves(here.range, half);
      double gap[2] = {point_box_distance2(&t->boxes.boxes[half[0].node], x),
                       point_box_distance2(&t->boxes.boxes[half[1].node], x)};
      int near = gap[1] < gap[0];
      stack[height++] = (pending){half[1 - near], gap[1 - near]};
      stack[height++] = (pending){half[near], gap[near]};
      continue;
    }
    size_t candidate = t->boxes.order[here.range.from];
    if (chosen && !chosen[t->loop[candidate]]) continue;
    double place[2], d = segment_distance2(t->leaves + 4 * here.range.from, x, place);
    if (d > best || (d == best && candidate > *edge)) continue;
    best = d;
    *edge = candidate;
    nearest[0] = place[0];
    nearest[1] = place[1];
  }
  return best;
}

bool polygon_inside(const polygon_set *p, const double x[2]) {
  const polygon_tree *t = &p->tree;
  polygon_range stack[POLYGON_STACK];
  size_t height = 0;
  bool inside = false;
  if (p->count > 0) stack[height++] = (polygon_range){0, 0, t->boxes.count};
  while (height > 0) {
    polygon_range r = stack[--height];
    const box3 *box = &t->boxes.boxes[r.node];
    if (box->lower[1] > x[1] || box->upper[1] <= x[1] || box->upper[0] < x[0]) continue;
    if (r.to - r.from > 1) {
      polygon_halves(r, stack + height);
      height += 2;
      continue;
    }
    /* The box says that the edge goes from y <= x[1] to above, one way or the other. */
    const double *ends = t->leaves + 4 * r.from;
    bool rising = ends[3] > ends[1];
    bool right = box->lower[0] > x[0] || batten_orient2d(ends, ends + 2, x, 0, 1) == (rising ? 1 : -1);
    inside ^= right;
  }
  return inside;
}

double polygon_distance(const polygon_set *p, const double x[2], double *nearest, size_t *edge) {
  double place[2] = {x[0], x[1]};
  size_t at;
  double d = sqrt(nearest_edge(p, NULL, x, place, &at));
  if (nearest) {
    nearest[0] = place[0];
    nearest[1] = place[1];
  }
  if (edge) *edge = at;
  return polygon_inside(p, x) ? d : -d;
}

double polygon_nearest_to(const polygon_set *p, const unsigned char *chosen, const double x[2], double *nearest) {
  size_t edge;
  return sqrt(nearest_edge(p, chosen, x, nearest, &edge));
}

double polygon_distance_to(const polygon_set *p, const unsigned char *chosen, const double x[2]) {
  double nearest[2];
  return polygon_nearest_to(p, chosen, x, nearest);
}

/* ---- bounds -------------------------------------------------------------------------------------- */

static double boxes_distance2(const box3 *a, const double lower[2], const double upper[2]) {
  double sum = 0;
  for (int d = 0; d < 2; d++) {
    double out = fmax(0, fmax(a->lower[d] - upper[d], lower[d] - a->upper[d]));
    sum += out * out;
  }
  return sum;
}

/* Does the segment meet the box? Its boxes are known to meet, so only its own line can part them: all corners on one
 * side. */
static bool segment_meets_box(const double *ends, const double lower[2], const double upper[2]) {
  int least = 1, most = -1;
  for (int c = 0; c < 4; c++) {
    const double corner[2] = {c & 1 ? upper[0] : lower[0], c & 2 ? upper[1] : lower[1]};
    int side = batten_orient2d(ends, ends + 2, corner, 0, 1);
    if (side < least) least = side;
    if (side > most) most = side;
  }
  return least <= 0 && most >= 0;
}

/* Squared distance of a segment from a box. */
static double segment_box_distance2(const double *ends, const double lower[2], const double upper[2]) {
  const box3 of_segment = {{fmin(ends[0], ends[2]), fmin(ends[1], ends[3]), 0},
                           {fmax(ends[0], ends[2]), fmax(ends[1], ends[3]), 0}};
  const box3 box = {{lower[0], lower[1], 0}, {upper[0], upper[1], 0}};
  if (boxes_distance2(&of_segment, lower, upper) == 0 && segment_meets_box(ends, lower, upper)) return 0;
  double least = fmin(point_box_distance2(&box, ends), point_box_distance2(&box, ends + 2)), place[2];
  for (int c = 0; c < 4; c++) {
    const double corner[2] = {c & 1 ? upper[0] : lower[0], c & 2 ? upper[1] : lower[1]};
    least = fmin(least, segment_distance2(ends, corner, place));
  }
  return least;
}

static double box_distance2(const polygon_set *p, const double lower[2], const double upper[2]) {
  const polygon_tree *t = &p->tree;
  pending stack[POLYGON_STACK] = {{{0, 0, t->boxes.count}, 0}};
  size_t height = 1;
  double best = INFINITY;
  while (height > 0) {
    pending here = stack[--height];
    if (here.gap >= best) continue;
    if (here.range.to - here.range.from > 1) {
      polygon_range half[2];
      polygon_halves(here.range, half);
      double gap[2] = {boxes_distance2(&t->boxes.boxes[half[0].node], lower, upper),
                       boxes_distance2(&t->boxes.boxes[half[1].node], lower, upper)};
      int near = gap[1] < gap[0];
      stack[height++] = (pending){half[1 - near], gap[1 - near]};
      stack[height++] = (pending){half[near], gap[near]};
      continue;
    }
    best = fmin(best, segment_box_distance2(t->leaves + 4 * here.range.from, lower, upper));
  }
  return best;
}

void polygon_distance_bounds(const polygon_set *p, const double lower[2], const double upper[2], double range[2]) {
  range[0] = range[1] = -INFINITY;
  if (p->count == 0) return;
  double size = 0, half_diagonal2 = 0, middle[2];
  for (int d = 0; d < 2; d++) {
    middle[d] = lower[d] / 2 + upper[d] / 2;
    half_diagonal2 += square(fmax(upper[d] - middle[d], middle[d] - lower[d]));
    size += fmax(fmax(fabs(lower[d]), fabs(upper[d])), fmax(fabs(p->lower[d]), fabs(p->upper[d])));
  }
  if (!(size <= DBL_MAX)) {
    range[0] = -INFINITY;
    range[1] = INFINITY;
    return;
  }
  /* 64: some ten roundings at most of each of the distances, relative to the largest coordinates in play. */
  double slack = 64 * DBL_EPSILON * size, half_diagonal = sqrt(half_diagonal2);
  double place[2];
  size_t edge;
  double at_middle = sqrt(nearest_edge(p, NULL, middle, place, &edge)), gap = sqrt(box_distance2(p, lower, upper));
  bool inside = polygon_inside(p, middle);
  if (gap <= slack) {
    double value = inside ? at_middle : -at_middle;
    range[0] = value - half_diagonal - slack;
    range[1] = value + half_diagonal + slack;
    return;
  }
  /* The distance to any one place is largest at a corner. */
  double most = 0;
  for (int c = 0; c < 4; c++) {
    const double corner[2] = {c & 1 ? upper[0] : lower[0], c & 2 ? upper[1] : lower[1]};
    most = fmax(most, hypot(corner[0] - place[0], corner[1] - place[1]));
  }
  double near = fmax(gap, at_middle - half_diagonal) - slack, far = fmin(most, at_middle + half_diagonal) + slack;
  range[0] = inside ? near : -far;
  range[1] = inside ? far : -near;
}
