/* Delaunay triangulation by divide and conquer [Guibas, Stolfi 1985, "Primitives for the manipulation of general
 * subdivisions and the computation of Voronoi diagrams"].
 *
 * Points in lexicographic order are triangulated by twos and threes, then neighbouring sets are merged, pair by pair,
 * until one is left: from the lower common tangent upwards, edges that the other side's points contradict give way to
 * edges across. Decisions are exact, so that nothing is needed for points on lines, on circles or close together.
 *
 * Directed edges e and e ^ 1 are the two ways of one edge. Those that leave a vertex form a ring, counter-clockwise
 * by `next`; the left face of e continues with next_left(e). */
#include "delaunay.h"

#include <stdbool.h>
#include <string.h>

#include "base/checked.h"
#include "basis/sort_points.h"
#include "predicates.h"

#define NONE UINT32_MAX

typedef struct edge {
  uint32_t origin, next, previous; /* of the ring around the origin */
} edge;

typedef struct subdivision {
  const double *xy; /* [points][2] in lexicographic order, no two at one place */
  edge *edges;      /* an edge of no use has the origin NONE */
  uint32_t count, free;
} subdivision;

/* A merged set of points: the edge of its hull that leaves the leftmost point counter-clockwise, and the one that
 * leaves the rightmost clockwise. */
typedef struct hull {
  uint32_t left, right;
} hull;

/* ---- edges --------------------------------------------------------------------------------------- */

static uint32_t origin(const subdivision *s, uint32_t e) { return s->edges[e].origin; }
static uint32_t target(const subdivision *s, uint32_t e) { return s->edges[e ^ 1].origin; }
static uint32_t next(const subdivision *s, uint32_t e) { return s->edges[e].next; }
static uint32_t previous(const subdivision *s, uint32_t e) { return s->edges[e].previous; }
static uint32_t next_left(const subdivision *s, uint32_t e) { return s->edges[e ^ 1].previous; }

static uint32_t make_edge(subdivision *s, uint32_t from, uint32_t to) {
  uint32_t e = s->free;
  if (e == NONE) {
    e = s->count;
    s->count += 2;
  } else {
    s->free = s->edges[e].next;
  }
  s->edges[e] = (edge){from, e, e};
  s->edges[e ^ 1] = (edge){to, e ^ 1, e ^ 1};
  return e;
}

/* Joins the rings of a and b, or parts their one ring. */
static void splice(subdivision *s, uint32_t a, uint32_t b) {
  uint32_t after_a = next(s, a), after_b = next(s, b);
  s->edges[a].next = after_b;
  s->edges[after_b].previous = a;
  s->edges[b].next = after_a;
  s->edges[after_a].previous = b;
}

/* A new edge from the end of a to the start of b, across the left face of both. */
static uint32_t connect(subdivision *s, uint32_t a, uint32_t b) {
  uint32_t e = make_edge(s, target(s, a), origin(s, b));
  splice(s, e, next_left(s, a));
  splice(s, e ^ 1, b);
  return e;
}

static void remove_edge(subdivision *s, uint32_t e) {
  splice(s, e, previous(s, e));
  splice(s, e ^ 1, previous(s, e ^ 1));
  e &= ~(uint32_t)1;
  s->edges[e] = s->edges[e + 1] = (edge){NONE, s->free, NONE};
  s->free = e;
}

/* +1: a b c turn left. */
static int turn(const subdivision *s, uint32_t a, uint32_t b, uint32_t c) {
  return batten_orient2d(s->xy + 2 * (size_t)a, s->xy + 2 * (size_t)b, s->xy + 2 * (size_t)c, 0, 1);
}
static bool is_left(const subdivision *s, uint32_t p, uint32_t e) {
  return turn(s, p, origin(s, e), target(s, e)) > 0;
}
static bool is_right(const subdivision *s, uint32_t p, uint32_t e) {
  return turn(s, p, target(s, e), origin(s, e)) > 0;
}
static bool is_inside(const subdivision *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  const double *p = s->xy;
  return batten_incircle(p + 2 * (size_t)a, p + 2 * (size_t)b, p + 2 * (size_t)c, p + 2 * (size_t)d) > 0;
}

/* ---- the triangulation ---------------------------------------------------------------------------- */

static hull start_two(subdivision *s, uint32_t p) {
  uint32_t e = make_edge(s, p, p + 1);
  return (hull){e, e ^ 1};
}

static hull start_three(subdivision *s, uint32_t p) {
  uint32_t a = make_edge(s, p, p + 1), b = make_edge(s, p + 1, p + 2);
  splice(s, a ^ 1, b);
  int side = turn(s, p, p + 1, p + 2);
  if (side == 0) return (hull){a, b ^ 1};
  uint32_t c = connect(s, b, a);
  return side > 0 ? (hull){a, b ^ 1} : (hull){c ^ 1, c};
}

/* The left neighbour's edge to the first of its points that, with base, has an empty circle; edges on the way there
 * that cross into it are gone. base runs from right to left; the edge may point below it. */
static uint32_t left_candidate(subdivision *s, uint32_t base) {
  uint32_t e = next(s, base ^ 1);
  if (!is_right(s, target(s, e), base)) return e;
  while (is_inside(s, target(s, base), origin(s, base), target(s, e), target(s, next(s, e)))) {
    uint32_t after = next(s, e);
    remove_edge(s, e);
    e = after;
  }
  return e;
}

static uint32_t right_candidate(subdivision *s, uint32_t base) {
  uint32_t e = previous(s, base);
  if (!is_right(s, target(s, e), base)) return e;
  while (is_inside(s, target(s, base), origin(s, base), target(s, e), target(s, previous(s, e)))) {
    uint32_t after = previous(s, e);
    remove_edge(s, e);
    e = after;
  }
  return e;
}

/* The lower common tangent, from right to left; the outer hull edges take it in where it ends at them. */
static uint32_t join_below(subdivision *s, hull *left, hull *right) {
  uint32_t l = left->right, r = right->left;
  for (;;) {
    if (is_left(s, origin(s, r), l))
      l = next_left(s, l);
    else if (is_right(s, origin(s, l), r))
      r = next(s, r ^ 1);
    else
      break;
  }
  uint32_t base = connect(s, r ^ 1, l);
  if (origin(s, l) == origin(s, left->left)) left->left = base ^ 1;
  if (origin(s, r) == origin(s, right->right)) right->right = base;
  return base;
}

static hull merge(subdivision *s, hull left, hull right) {
  uint32_t base = join_below(s, &left, &right);
  for (;;) {
    uint32_t l = left_candidate(s, base), r = right_candidate(s, base);
    bool has_left = is_right(s, target(s, l), base), has_right = is_right(s, target(s, r), base);
    if (!has_left && !has_right) break;
    if (!has_left || (has_right && is_inside(s, target(s, l), origin(s, l), origin(s, r), target(s, r))))
      base = connect(s, r, base ^ 1);
    else
      base = connect(s, base ^ 1, l ^ 1);
  }
  return (hull){left.left, right.right};
}

/* hulls [n / 2]; n >= 2. */
static void triangulate(subdivision *s, uint32_t n, hull *hulls) {
  uint32_t sets = n / 2;
  for (uint32_t i = 0; i < sets; i++) hulls[i] = i == sets - 1 && n % 2 ? start_three(s, 2 * i) : start_two(s, 2 * i);
  while (sets > 1) {
    for (uint32_t i = 0; i + 1 < sets; i += 2) hulls[i / 2] = merge(s, hulls[i], hulls[i + 1]);
    if (sets % 2) hulls[sets / 2] = hulls[sets - 1];
    sets = (sets + 1) / 2;
  }
}

/* The triangles left of the edges, each from its edge of lowest number. index [points]: what corners are called.
 * out NULL: only their number. */
static size_t list_triangles(const subdivision *s, const uint32_t *index, uint32_t *out) {
  size_t count = 0;
  for (uint32_t e = 0; e < s->count; e++) {
    if (origin(s, e) == NONE) continue;
    uint32_t f = next_left(s, e), g = next_left(s, f);
    if (f < e || g < e || next_left(s, g) != e) continue;
    uint32_t corner[3] = {origin(s, e), origin(s, f), origin(s, g)};
    if (turn(s, corner[0], corner[1], corner[2]) <= 0) continue; /* the outside */
    if (out)
      for (size_t k = 0; k < 3; k++) out[3 * count + k] = index[corner[k]];
    count++;
  }
  return count;
}

/* scaled [count][2]: by a power of two to about 1, and rounded to multiples of 2^-256, which moves nothing above
 * 2^-204: products of four differences then neither over- nor underflow, so that signs are exact for all input. */
static void scale_points(size_t count, const double *points, double *scaled) {
  double largest = 0;
  for (size_t i = 0; i < 2 * count; i++) largest = fmax(largest, fabs(points[i]));
  double unit = largest > 0 ? batten_unit(largest) : 1;
  for (size_t i = 0; i < 2 * count; i++) scaled[i] = rint(points[i] * unit * 0x1p256) * 0x1p-256;
}

/* xy [n][2]: the places in lexicographic order; index [n]: the lowest index there; first [count]: that index for each
 * point, or NULL. Returns n. */
static uint32_t find_places(size_t count, const double *scaled, const uint32_t *order, double *xy, uint32_t *index,
                            uint32_t *first) {
  uint32_t n = 0;
  for (size_t i = 0; i < count; i++) {
    const double *p = scaled + 2 * (size_t)order[i];
    double *place = xy + 2 * (size_t)n;
    if (n == 0 || p[0] != place[-2] || p[1] != place[-1]) {
      place[0] = p[0];
      place[1] = p[1];
      index[n++] = order[i];
    }
    if (first) first[order[i]] = index[n - 1];
  }
  return n;
}

batten_status batten_mesh_delaunay(batten_context *ctx, size_t count, const double *points, uint32_t *first,
                                   size_t *triangle_count, uint32_t **triangles) {
  /* A planar graph of n vertices has less than 3 n edges. */
  if (count > NONE / 6)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu points; at most %u can be triangulated", count, NONE / 6);
  uint32_t *order = batten_alloc_array(ctx, count, sizeof *order), *index = NULL, *out = NULL;
  double *scaled = order ? batten_alloc_array(ctx, count, 2 * sizeof *scaled) : NULL, *xy = NULL;
  edge *edges = NULL;
  hull *hulls = NULL;
  size_t found = 0;
  batten_status st = BATTEN_E_NOMEM;
  if (!scaled) goto done;
  scale_points(count, points, scaled);
  st = batten_sort_points(ctx, 2, count, scaled, order);
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  xy = batten_alloc_array(ctx, count, 2 * sizeof *xy);
  index = xy ? batten_alloc_array(ctx, count, sizeof *index) : NULL;
  edges = index ? batten_alloc_array(ctx, 6 * count, sizeof *edges) : NULL;
  hulls = edges ? batten_alloc_array(ctx, count / 2, sizeof *hulls) : NULL;
  if (!hulls) goto done;
  uint32_t n = find_places(count, scaled, order, xy, index, first);
  subdivision s = {.xy = xy, .edges = edges, .free = NONE};
  if (n >= 2) triangulate(&s, n, hulls);
  found = list_triangles(&s, index, NULL);
  out = batten_alloc_array(ctx, found, 3 * sizeof *out);
  if (!out) goto done;
  list_triangles(&s, index, out);
  *triangle_count = found;
  *triangles = out;
  st = BATTEN_OK;

done:
  batten_free(ctx, hulls);
  batten_free(ctx, edges);
  batten_free(ctx, index);
  batten_free(ctx, xy);
  batten_free(ctx, scaled);
  batten_free(ctx, order);
  return st;
}
