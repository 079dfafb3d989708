/* Closed polygons that bound an area by even-odd: from loops as they come to loops that run the right way round.
 *
 * All decisions are taken on signs of determinants that are exact, so loops that touch, and points that lie on an
 * edge, need no tolerance. Loops may touch at vertices; what they may not do is pass from one side of another (or of
 * themselves) to the other, or run along it: then no way round has the area on the left throughout. A loop's own
 * edges that run there and back between the same points bound nothing: they are taken out, which parts it into
 * several (a hole tied to its outer loop, as medical contours come, becomes a loop of its own). Where two loops meet
 * at a vertex, they pass through each other when the directions of one part those of the other in cyclic order. Loops
 * that do not cross lie within each other or not as a whole, so one point off the other loop tells. Pairs of edges
 * that may meet, and the edges that a ray meets, come from a tree of boxes. */
#include "basis/polygon.h"

#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "basis/quantile.h"
#include "mesh/predicates.h"

/* What is needed while a set is made. */
typedef struct making {
  polygon_set set;
  size_t *origin;       /* [points] index of a point in what was given */
  double *areas;        /* [loops] signed, as given */
  unsigned char *marks; /* [loops] of the ray's loops */
  size_t *touched;      /* [loops] loops with marks */
} making;

enum { MARK_ODD = 1, MARK_ON = 2, MARK_LISTED = 4 };

static int turn(const double *a, const double *b, const double *c) { return batten_orient2d(a, b, c, 0, 1); }

static size_t point_after(const polygon_set *p, size_t loop, size_t i) {
  return i + 1 < p->starts[loop + 1] ? i + 1 : p->starts[loop];
}
static size_t point_before(const polygon_set *p, size_t loop, size_t i) {
  return i > p->starts[loop] ? i - 1 : p->starts[loop + 1] - 1;
}

static bool same_place(const double *a, const double *b) { return a[0] == b[0] && a[1] == b[1]; }

/* For points on a line: is x within the closed segment a b? */
static bool between(const double *a, const double *b, const double *x) {
  return fmin(a[0], b[0]) <= x[0] && x[0] <= fmax(a[0], b[0]) && fmin(a[1], b[1]) <= x[1] && x[1] <= fmax(a[1], b[1]);
}

/* For a and b on a line through p, neither at p: do they lie on the same side of it? */
static bool same_side(const double *p, const double *a, const double *b) {
  return a[0] == p[0] ? (a[1] > p[1]) == (b[1] > p[1]) : (a[0] > p[0]) == (b[0] > p[0]) && b[0] != p[0];
}

/* ---- loops as they come -------------------------------------------------------------------------- */

/* About the first point, so that rounding is that of the loop's own size. */
double polygon_loop_area(size_t count, const double *points) {
  double sum = 0;
  for (size_t i = 1; i + 1 < count; i++) {
    const double *a = points + 2 * i, *b = a + 2;
    sum += (a[0] - points[0]) * (b[1] - points[1]) - (a[1] - points[1]) * (b[0] - points[0]);
  }
  return sum / 2;
}

/* An edge by its ends in order, so that both ways along it are found together. */
typedef struct given_edge {
  const double *ends[2];
  bool forward;
  size_t at;
} given_edge;

/* Edges of a loop, by the numbers of their first points; after SIZE_MAX: taken out. */
typedef struct edge_ring {
  size_t *after, *before;
  given_edge *sorted;
} edge_ring;

static int compare_places(const double *a, const double *b) {
  if (a[0] != b[0]) return a[0] < b[0] ? -1 : 1;
  return (a[1] > b[1]) - (a[1] < b[1]);
}

static int compare_ends(const given_edge *a, const given_edge *b) {
  int order = compare_places(a->ends[0], b->ends[0]);
  return order != 0 ? order : compare_places(a->ends[1], b->ends[1]);
}

static int compare_edges(const void *left, const void *right) {
  const given_edge *a = left, *b = right;
  int order = compare_ends(a, b);
  return order != 0 ? order : (a->at > b->at) - (a->at < b->at);
}

/* Takes out edges i and j, which run there and back: what comes before one goes on with what comes after the other.
 */
static void cancel(edge_ring r, size_t i, size_t j) {
  const size_t joints[2][2] = {{r.before[i], r.after[j]}, {r.before[j], r.after[i]}};
  for (int k = 0; k < 2; k++) {
    if (joints[k][0] == i || joints[k][0] == j) continue; /* nothing lies between them on that side */
    r.after[joints[k][0]] = joints[k][1];
    r.before[joints[k][1]] = joints[k][0];
  }
  r.after[i] = r.after[j] = SIZE_MAX;
}

static void cancel_edges(edge_ring r, size_t count, const double *points) {
  for (size_t i = 0; i < count; i++) {
    const double *a = points + 2 * i, *b = points + 2 * (i + 1 < count ? i + 1 : 0);
    bool forward = compare_places(a, b) < 0;
    r.sorted[i] = (given_edge){{forward ? a : b, forward ? b : a}, forward, i};
    r.after[i] = i + 1 < count ? i + 1 : 0;
    r.before[i] = i > 0 ? i - 1 : count - 1;
  }
  qsort(r.sorted, count, sizeof *r.sorted, compare_edges);
  size_t open = 0; /* edges without an opposite so far go to the front */
  for (size_t i = 0; i < count; i++) {
    const given_edge e = r.sorted[i], *last = r.sorted + open - 1;
    if (open > 0 && last->forward != e.forward && compare_ends(last, &e) == 0) {
      cancel(r, last->at, e.at);
      open--;
    } else {
      r.sorted[open++] = e;
    }
  }
}

/* The loop's points, neighbouring equal ones once, behind those of the set. Returns how many. */
static size_t take_points(making *m, size_t from, size_t to, const double *points) {
  const size_t first = m->set.starts[m->set.count];
  double *taken = m->set.points + 2 * first;
  size_t made = 0;
  for (size_t i = from; i < to; i++) {
    if (made > 0 && same_place(points + 2 * i, taken + 2 * (made - 1))) continue;
    memcpy(taken + 2 * made, points + 2 * i, 2 * sizeof *taken);
    m->origin[first + made++] = i;
  }
  while (made > 1 && same_place(taken, taken + 2 * (made - 1))) made--;
  return made;
}

/* Takes over the loops that count, and tells of which nothing does. */
static batten_status take_loops(making *m, size_t count, const size_t *starts, const double *points, double min_area,
                                unsigned char *dropped) {
  polygon_set *p = &m->set;
  size_t longest = 0;
  for (size_t k = 0; k < count; k++)
    if (starts[k + 1] - starts[k] > longest) longest = starts[k + 1] - starts[k];
  edge_ring ring = {batten_alloc_array(p->ctx, longest, sizeof *ring.after),
                    batten_alloc_array(p->ctx, longest, sizeof *ring.before),
                    batten_alloc_array(p->ctx, longest, sizeof *ring.sorted)};
  size_t *origin = batten_alloc_array(p->ctx, longest, sizeof *origin);
  double *loop = batten_alloc_array(p->ctx, longest, 2 * sizeof *loop);
  batten_status st = ring.after && ring.before && ring.sorted && origin && loop ? BATTEN_OK : BATTEN_E_NOMEM;
  p->starts[0] = 0;
  for (size_t k = 0; st >= 0 && k < count; k++) {
    const size_t first = p->starts[p->count], taken = take_points(m, starts[k], starts[k + 1], points);
    memcpy(loop, p->points + 2 * first, taken * 2 * sizeof *loop);
    memcpy(origin, m->origin + first, taken * sizeof *origin);
    cancel_edges(ring, taken, loop);
    if (dropped) dropped[k] = 1;
    for (size_t from = 0; from < taken; from++) {
      const size_t begin = p->starts[p->count];
      size_t made = begin;
      for (size_t i = from, next; (next = ring.after[i]) != SIZE_MAX; i = next, made++) {
        memcpy(p->points + 2 * made, loop + 2 * i, 2 * sizeof *loop);
        m->origin[made] = origin[i];
        ring.after[i] = SIZE_MAX;
      }
      double area = polygon_loop_area(made - begin, p->points + 2 * begin);
      if (made - begin < 3 || !(fabs(area) >= min_area)) continue;
      p->given[p->count] = k;
      m->areas[p->count] = area;
      p->starts[++p->count] = made;
      if (dropped) dropped[k] = 0;
    }
  }
  batten_free(p->ctx, ring.after);
  batten_free(p->ctx, ring.before);
  batten_free(p->ctx, ring.sorted);
  batten_free(p->ctx, origin);
  batten_free(p->ctx, loop);
  return st;
}

/* The tree of edges. */
static batten_status index_edges(polygon_set *p) {
  size_t edges = p->starts[p->count];
  polygon_tree *t = &p->tree;
  box3 *boxes = batten_alloc_array(p->ctx, edges, sizeof *boxes);
  t->loop = batten_alloc_array(p->ctx, edges, sizeof *t->loop);
  t->leaves = batten_alloc_array(p->ctx, edges, 4 * sizeof(double));
  batten_status st = BATTEN_E_NOMEM;
  if (!boxes || !t->loop || !t->leaves) goto done;
  for (size_t k = 0; k < p->count; k++)
    for (size_t i = p->starts[k]; i < p->starts[k + 1]; i++) {
      const double *a = p->points + 2 * i, *b = p->points + 2 * point_after(p, k, i);
      boxes[i] = (box3){{fmin(a[0], b[0]), fmin(a[1], b[1]), 0}, {fmax(a[0], b[0]), fmax(a[1], b[1]), 0}};
      t->loop[i] = k;
    }
  st = box_tree_make(p->ctx, edges, boxes, &t->boxes);
  if (st < 0) goto done;
  for (size_t k = 0; k < edges; k++) {
    size_t i = t->boxes.order[k];
    memcpy(t->leaves + 4 * k, p->points + 2 * i, 2 * sizeof(double));
    memcpy(t->leaves + 4 * k + 2, p->points + 2 * point_after(p, t->loop[i], i), 2 * sizeof(double));
  }
done:
  batten_free(p->ctx, boxes);
  return st;
}

/* ---- crossings ----------------------------------------------------------------------------------- */

/* Does q, off both rays, lie in the sector that is swept counter-clockwise from p a to p b? */
static bool in_sector(const double *p, const double *a, const double *b, const double *q) {
  int opening = turn(p, a, b);
  if (opening > 0) return turn(p, a, q) > 0 && turn(p, q, b) > 0;
  if (opening < 0) return !(turn(p, b, q) > 0 && turn(p, q, a) > 0);
  return turn(p, a, q) > 0;
}

/* Corners a p b and c p d at the same place p: do they pass through each other, or run along an edge? */
static bool corners_cross(const double *p, const double *a, const double *b, const double *c, const double *d) {
  const double *u[2] = {a, b}, *v[2] = {c, d};
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++)
      if (turn(p, u[i], v[j]) == 0 && same_side(p, u[i], v[j])) return true;
  return in_sector(p, a, b, c) != in_sector(p, a, b, d);
}

/* The corner a p b whose p lies within the edge c d, not at its ends. */
static bool corner_crosses(const double *a, const double *b, const double *c, const double *d) {
  return turn(c, d, a) * turn(c, d, b) <= 0;
}

/* Where two lines cross that are known to do so. */
static void crossing_place(const double *a, const double *b, const double *c, const double *d, double *at) {
  double u[2] = {b[0] - a[0], b[1] - a[1]}, v[2] = {d[0] - c[0], d[1] - c[1]};
  double s = ((c[0] - a[0]) * v[1] - (c[1] - a[1]) * v[0]) / (u[0] * v[1] - u[1] * v[0]);
  s = s > 0 ? fmin(s, 1) : 0; /* NaN too */
  for (int k = 0; k < 2; k++) at[k] = a[k] + s * u[k];
}

/* Do edges e and f cross, overlap, or do loops pass through each other at the start of one of them? (An end is the
 * start of the next edge.) */
static bool edges_cross(const polygon_set *p, size_t e, size_t f, double *at) {
  size_t le = p->tree.loop[e], lf = p->tree.loop[f], e1 = point_after(p, le, e), f1 = point_after(p, lf, f);
  const double *a = p->points + 2 * e, *b = p->points + 2 * e1, *c = p->points + 2 * f, *d = p->points + 2 * f1;
  memcpy(at, c, 2 * sizeof(double));
  if (e1 == f) return turn(a, b, d) == 0 && same_side(b, a, d);
  memcpy(at, a, 2 * sizeof(double));
  if (f1 == e) return turn(c, d, b) == 0 && same_side(d, c, b);
  int c_side = turn(a, b, c), d_side = turn(a, b, d), a_side = turn(c, d, a), b_side = turn(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) {
    crossing_place(a, b, c, d, at);
    return true;
  }
  const double *before_a = p->points + 2 * point_before(p, le, e), *before_c = p->points + 2 * point_before(p, lf, f);
  if (same_place(a, c)) return corners_cross(a, before_a, b, before_c, d);
  if (a_side == 0 && between(c, d, a) && !same_place(a, d)) return corner_crosses(before_a, b, c, d);
  memcpy(at, c, 2 * sizeof(double));
  return c_side == 0 && between(a, b, c) && !same_place(c, b) && corner_crosses(before_c, d, a, b);
}

static bool boxes_meet(const box3 *a, const box3 *b) {
  return a->lower[0] <= b->upper[0] && b->lower[0] <= a->upper[0] && a->lower[1] <= b->upper[1] &&
         b->lower[1] <= a->upper[1];
}

/* The lowest edge above e with which it crosses, or SIZE_MAX. */
static size_t first_crossing(const polygon_set *p, size_t e, const box3 *box, double *at) {
  polygon_range stack[POLYGON_STACK] = {{0, 0, p->starts[p->count]}};
  size_t height = 1, least = SIZE_MAX;
  while (height > 0) {
    polygon_range r = stack[--height];
    if (!boxes_meet(box, &p->tree.boxes.boxes[r.node])) continue;
    if (r.to - r.from > 1) {
      polygon_halves(r, stack + height);
      height += 2;
      continue;
    }
    size_t f = p->tree.boxes.order[r.from];
    double place[2];
    if (f > e && f < least && edges_cross(p, e, f, place)) {
      least = f;
      memcpy(at, place, sizeof place);
    }
  }
  return least;
}

static bool find_fault(const making *m, polygon_fault *fault) {
  const polygon_set *p = &m->set;
  for (size_t e = 0; e < p->starts[p->count]; e++) {
    size_t loop = p->tree.loop[e];
    const double *a = p->points + 2 * e, *b = p->points + 2 * point_after(p, loop, e);
    box3 box = {{fmin(a[0], b[0]), fmin(a[1], b[1]), 0}, {fmax(a[0], b[0]), fmax(a[1], b[1]), 0}};
    size_t f = first_crossing(p, e, &box, fault->at);
    if (f == SIZE_MAX) continue;
    fault->kind = POLYGON_CROSSING;
    fault->loop[0] = p->given[loop];
    fault->loop[1] = p->given[p->tree.loop[f]];
    fault->edge[0] = m->origin[e];
    fault->edge[1] = m->origin[f];
    return true;
  }
  return false;
}

/* ---- nesting ------------------------------------------------------------------------------------- */

/* Of the ray from x along the first axis: MARK_ODD where it meets the edge, MARK_ON where x lies on it, or 0. */
static unsigned meets(const double *a, const double *b, const double *x) {
  bool low_a = a[1] <= x[1], low_b = b[1] <= x[1];
  if (low_a == low_b && a[1] != x[1] && b[1] != x[1]) return 0;
  int side = turn(a, b, x);
  if (side == 0 && between(a, b, x)) return MARK_ON;
  if (low_a == low_b) return 0;
  return side == (low_a ? 1 : -1) ? MARK_ODD : 0;
}

/* Is x inside of the loop? MARK_ON on it. */
static unsigned inside_loop(const polygon_set *p, size_t loop, const double *x) {
  unsigned mark = 0;
  for (size_t i = p->starts[loop]; i < p->starts[loop + 1]; i++) {
    unsigned here = meets(p->points + 2 * i, p->points + 2 * point_after(p, loop, i), x);
    if (here == MARK_ON) return MARK_ON;
    mark ^= here;
  }
  return mark;
}

/* The same for a loop that touches the other: its first vertex off it tells, or the first middle of an edge. */
static bool loop_inside(const polygon_set *p, size_t loop, size_t other) {
  for (int middle = 0; middle < 2; middle++)
    for (size_t i = p->starts[loop]; i < p->starts[loop + 1]; i++) {
      const double *a = p->points + 2 * i, *b = p->points + 2 * point_after(p, loop, i);
      const double x[2] = {middle ? a[0] / 2 + b[0] / 2 : a[0], middle ? a[1] / 2 + b[1] / 2 : a[1]};
      unsigned mark = inside_loop(p, other, x);
      if (mark != MARK_ON) return mark == MARK_ODD;
    }
  return false;
}

/* Marks the loops that the ray from the loop's first point meets, which are listed; returns how many. */
static size_t cast_ray(making *m, size_t loop) {
  const polygon_set *p = &m->set;
  const double *x = p->points + 2 * p->starts[loop];
  polygon_range stack[POLYGON_STACK] = {{0, 0, p->starts[p->count]}};
  size_t height = 1, listed = 0;
  while (height > 0) {
    polygon_range r = stack[--height];
    const box3 *box = &p->tree.boxes.boxes[r.node];
    if (box->lower[1] > x[1] || box->upper[1] < x[1] || box->upper[0] < x[0]) continue;
    if (r.to - r.from > 1) {
      polygon_halves(r, stack + height);
      height += 2;
      continue;
    }
    size_t other = p->tree.loop[p->tree.boxes.order[r.from]];
    const double *ends = p->tree.leaves + 4 * r.from;
    unsigned here = other == loop ? 0 : meets(ends, ends + 2, x);
    if (here == 0) continue;
    if (!(m->marks[other] & MARK_LISTED)) m->touched[listed++] = other;
    unsigned mark = m->marks[other];
    mark = here == MARK_ON ? mark | MARK_ON : mark ^ MARK_ODD;
    m->marks[other] = (unsigned char)(mark | MARK_LISTED);
  }
  return listed;
}

/* depth and parent of each loop: the smallest around it is the one directly around. */
static void nest(making *m) {
  polygon_set *p = &m->set;
  for (size_t k = 0; k < p->count; k++) {
    p->depth[k] = 0;
    p->parent[k] = SIZE_MAX;
    size_t listed = cast_ray(m, k);
    for (size_t i = 0; i < listed; i++) {
      size_t other = m->touched[i], *parent = &p->parent[k];
      unsigned mark = m->marks[other];
      m->marks[other] = 0;
      if (mark & MARK_ON ? !loop_inside(p, k, other) : !(mark & MARK_ODD)) continue;
      p->depth[k]++;
      if (*parent == SIZE_MAX || fabs(m->areas[other]) < fabs(m->areas[*parent])) *parent = other;
    }
  }
}

/* ---- the right way round ------------------------------------------------------------------------- */

/* Edge i of a loop that is turned round is edge n - 2 - i of the new one. */
static void turn_loops(making *m) {
  polygon_set *p = &m->set;
  for (size_t k = 0; k < p->count; k++) {
    if ((m->areas[k] > 0) == (p->depth[k] % 2 == 0)) continue;
    for (size_t i = p->starts[k], j = p->starts[k + 1] - 1; i < j; i++, j--)
      for (int d = 0; d < 2; d++) {
        double swap = p->points[2 * i + (size_t)d];
        p->points[2 * i + (size_t)d] = p->points[2 * j + (size_t)d];
        p->points[2 * j + (size_t)d] = swap;
      }
  }
  for (size_t leaf = 0; leaf < p->starts[p->count]; leaf++) {
    size_t edge = p->tree.boxes.order[leaf], k = p->tree.loop[edge], first = p->starts[k], end = p->starts[k + 1];
    if ((m->areas[k] > 0) == (p->depth[k] % 2 == 0)) continue;
    double *ends = p->tree.leaves + 4 * leaf;
    for (int d = 0; d < 2; d++) {
      double swap = ends[d];
      ends[d] = ends[2 + d];
      ends[2 + d] = swap;
    }
    p->tree.boxes.order[leaf] = (uint32_t)(edge + 1 == end ? end - 1 : end - 2 - (edge - first));
  }
}

static batten_status measure(making *m) {
  polygon_set *p = &m->set;
  size_t edges = p->starts[p->count];
  weighted_sample *samples = batten_alloc_array(p->ctx, edges, sizeof *samples);
  if (!samples) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < edges; i++) {
    const double *ends = p->tree.leaves + 4 * i;
    samples[i] = (weighted_sample){hypot(ends[2] - ends[0], ends[3] - ends[1]), 1};
  }
  p->spacing = weighted_quantile(edges, samples, 0.5);
  batten_free(p->ctx, samples);
  for (size_t k = 0; k < p->count; k++) p->area += p->depth[k] % 2 == 0 ? fabs(m->areas[k]) : -fabs(m->areas[k]);
  memcpy(p->lower, p->tree.boxes.boxes[0].lower, sizeof p->lower);
  memcpy(p->upper, p->tree.boxes.boxes[0].upper, sizeof p->upper);
  return BATTEN_OK;
}

/* ---- entry --------------------------------------------------------------------------------------- */

void polygon_set_free(polygon_set *p) {
  batten_free(p->ctx, p->starts);
  batten_free(p->ctx, p->points);
  batten_free(p->ctx, p->given);
  batten_free(p->ctx, p->parent);
  batten_free(p->ctx, p->depth);
  batten_free(p->ctx, p->tree.loop);
  batten_free(p->ctx, p->tree.leaves);
  box_tree_free(p->ctx, &p->tree.boxes);
  *p = (polygon_set){.ctx = p->ctx};
}

static batten_status take_room(making *m, size_t points) {
  polygon_set *p = &m->set;
  const size_t count = points / 3, loops = count + 1; /* those that are parted too */
  if (points > UINT32_MAX)
    return batten_fail(p->ctx, BATTEN_E_TOO_LARGE, "points: %zu of a section's contours; too many", points);
  p->starts = batten_alloc_array(p->ctx, loops, sizeof *p->starts);
  p->points = batten_alloc_array(p->ctx, points, 2 * sizeof(double));
  p->given = batten_alloc_array(p->ctx, count, sizeof *p->given);
  p->parent = batten_alloc_array(p->ctx, count, sizeof *p->parent);
  p->depth = batten_alloc_array(p->ctx, count, sizeof *p->depth);
  m->origin = batten_alloc_array(p->ctx, points, sizeof *m->origin);
  m->areas = batten_alloc_array(p->ctx, count, sizeof *m->areas);
  m->marks = batten_alloc_array(p->ctx, count, 1);
  m->touched = batten_alloc_array(p->ctx, count, sizeof *m->touched);
  bool all = p->starts && p->points && p->given && p->parent && p->depth;
  if (!all || !m->origin || !m->areas || !m->marks || !m->touched) return BATTEN_E_NOMEM;
  memset(m->marks, 0, count);
  return BATTEN_OK;
}

batten_status polygon_set_make(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                               double min_area, polygon_set *out, unsigned char *dropped, polygon_fault *fault) {
  making m = {.set = {.ctx = ctx}};
  batten_status st = take_room(&m, count > 0 ? starts[count] : 0);
  if (st < 0) goto done;
  st = take_loops(&m, count, starts, points, min_area, dropped);
  if (st < 0) goto done;
  if (m.set.count > 0) {
    st = index_edges(&m.set);
    if (st < 0) goto done;
    if (find_fault(&m, fault)) {
      st = BATTEN_E_INVALID;
      goto done;
    }
    nest(&m);
    turn_loops(&m);
    st = measure(&m);
    if (st < 0) goto done;
  }
  *out = m.set;
  m.set = (polygon_set){.ctx = ctx};
done:
  batten_free(ctx, m.origin);
  batten_free(ctx, m.areas);
  batten_free(ctx, m.marks);
  batten_free(ctx, m.touched);
  polygon_set_free(&m.set);
  return st;
}
