/* Orientation by local planes: cheap, for many points.   [after Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992]
 *
 *   1. Each pair of neighbours ties the signs of two planes, the firmer the better the planes fit to one surface and
 * the more the pair lies in both (batten_orient_agreement).
 *   2. Kruskal's minimum spanning forest settles the firmest ties first; a union-find with parity carries the signs,
 * so no walk over the tree is needed.
 *   3. Each component of the neighbour graph is turned so that its extreme points look outwards, and turned round
 * again when it lies inside an odd number of the others (winding numbers): the walls of cavities.
 *
 * Time O(N log N) + (components whose boxes overlap) x N. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "orient.h"

typedef struct tie {
  double weight; /* 0 firm .. 1 loose */
  size_t from;   /* i * k + q: the tie to the q-th neighbour of i */
} tie;

static bool firmer(tie a, tie b) { return a.weight < b.weight || (a.weight == b.weight && a.from < b.from); }

/* Merge sort from the bottom up: firm order, no memory of its own, no recursion. spare [count]. */
static void sort_ties(size_t count, tie *ties, tie *spare) {
  tie *from = ties, *to = spare;
  for (size_t width = 1; width < count; width *= 2) {
    for (size_t low = 0; low < count; low += 2 * width) {
      size_t mid = low + width < count ? low + width : count, end = mid + width < count ? mid + width : count;
      for (size_t a = low, b = mid, out = low; out < end; out++)
        to[out] = a < mid && (b == end || !firmer(from[b], from[a])) ? from[a++] : from[b++];
    }
    tie *t = from;
    from = to;
    to = t;
  }
  if (from != ties) memcpy(ties, from, count * sizeof *ties);
}

static double tie_weight(const batten_orient_graph *g, size_t i, size_t j) {
  unsigned n = g->n;
  const double *x = g->points + i * n, *y = g->points + j * n, *u = g->plane + i * n, *v = g->plane + j * n;
  double eu = 0, ev = 0, square = 0;
  for (unsigned c = 0; c < n; c++) {
    double e = y[c] - x[c];
    square += e * e;
    eu += e * u[c];
    ev += e * v[c];
  }
  /* part of the pair that stands off the planes: noise there looks like the other side of a wall */
  double off = square > 0 ? fmax(eu * eu, ev * ev) / square : 0;
  return 1 - fabs(batten_orient_agreement(n, x, y, u, v)) * (1 - off);
}

/* Root of i; turned[i] says whether i's sign is opposite to its parent's (afterwards: to the root's). */
static size_t find_root(size_t *parent, unsigned char *turned, size_t i) {
  while (parent[i] != parent[parent[i]]) { /* halve the path */
    turned[i] ^= turned[parent[i]];
    parent[i] = parent[parent[i]];
  }
  return parent[i];
}

static void propagate(const batten_orient_graph *g, size_t count, const tie *ties, size_t *parent,
                      unsigned char *turned, unsigned char *rank, double *normals) {
  unsigned n = g->n;
  for (size_t i = 0; i < g->count; i++) parent[i] = i;
  memset(turned, 0, g->count);
  memset(rank, 0, g->count);
  for (size_t t = 0; t < count; t++) {
    size_t i = ties[t].from / g->k, j = g->index[ties[t].from];
    size_t a = find_root(parent, turned, i), b = find_root(parent, turned, j);
    if (a == b) continue;
    double agreement =
        batten_orient_agreement(n, g->points + i * n, g->points + j * n, g->plane + i * n, g->plane + j * n);
    unsigned char opposed = (unsigned char)((agreement < 0) ^ (i != a && turned[i]) ^ (j != b && turned[j]));
    if (rank[a] < rank[b]) {
      size_t r = a;
      a = b;
      b = r;
    }
    if (rank[a] == rank[b]) rank[a]++;
    parent[b] = a;
    turned[b] = opposed;
  }
  for (size_t i = 0; i < g->count; i++) {
    size_t root = find_root(parent, turned, i);
    double sign = i != root && turned[i] ? -1 : 1;
    for (unsigned c = 0; c < n; c++) normals[i * n + c] = sign * g->plane[i * n + c];
  }
}

typedef struct box {
  double lower[3], upper[3];
  size_t extreme; /* a point of the component on its box: inside no part of its own */
} box;

static void find_boxes(const batten_orient_graph *g, size_t pieces, const size_t *piece, box *boxes) {
  unsigned n = g->n;
  for (size_t p = 0; p < pieces; p++)
    boxes[p] = (box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}, 0};
  for (size_t i = 0; i < g->count; i++) {
    box *b = boxes + piece[i];
    const double *x = g->points + i * n;
    if (x[0] < b->lower[0]) b->extreme = i;
    for (unsigned c = 0; c < n; c++) {
      b->lower[c] = fmin(b->lower[c], x[c]);
      b->upper[c] = fmax(b->upper[c], x[c]);
    }
  }
}

/* Winding number about x of the part that point j stands for, a disk (line) that reaches half way to its neighbours.
 */
static double winding(const batten_orient_graph *g, const double *normals, size_t j, const double *x) {
  unsigned n = g->n;
  double radius = g->distance[j * g->k + g->k - 1], share = 1 / (double)(g->k + 1), square = 0, flux = 0;
  for (unsigned c = 0; c < n; c++) {
    double d = g->points[j * n + c] - x[c];
    square += d * d;
    flux += d * normals[j * n + c];
  }
  if (square == 0) return 0;
  const double pi = 3.141592653589793;
  return n == 2 ? flux * 2 * radius * share / (2 * pi * square)
                : flux * pi * radius * radius * share / (4 * pi * square * sqrt(square));
}

/* Number of other components around component p. order: points sorted by component, start [pieces + 1]. */
static size_t depth(const batten_orient_graph *g, const double *normals, size_t pieces, const box *boxes,
                    const size_t *order, const size_t *start, size_t p) {
  unsigned n = g->n;
  const double *x = g->points + boxes[p].extreme * n;
  size_t around = 0;
  for (size_t q = 0; q < pieces; q++) {
    bool within = q != p;
    for (unsigned c = 0; c < n; c++) within = within && x[c] > boxes[q].lower[c] && x[c] < boxes[q].upper[c];
    if (!within) continue;
    double turns = 0;
    for (size_t s = start[q]; s < start[q + 1]; s++) turns += winding(g, normals, order[s], x);
    if (turns > 0.5) around++;
  }
  return around;
}

static void turn(const batten_orient_graph *g, size_t begin, size_t end, const size_t *order, double *normals) {
  for (size_t s = begin; s < end; s++)
    for (unsigned c = 0; c < g->n; c++) normals[order[s] * g->n + c] *= -1;
}

/* Step 3. */
static batten_status settle_components(batten_context *ctx, const batten_orient_graph *g, double *normals) {
  batten_status status = BATTEN_E_NOMEM;
  size_t *piece = NULL, *order = NULL, *start = NULL;
  unsigned char *inside = NULL;
  box *boxes = NULL;
  if (!(piece = batten_alloc_array(ctx, g->count, sizeof *piece))) goto done;
  size_t pieces = batten_orient_pieces(g, normals, -2, piece);
  if (!(order = batten_alloc_array(ctx, g->count, sizeof *order)) ||
      !(start = batten_alloc_array(ctx, pieces + 1, sizeof *start)) ||
      !(inside = batten_alloc_array(ctx, pieces, sizeof *inside)) ||
      !(boxes = batten_alloc_array(ctx, pieces, sizeof *boxes)))
    goto done;
  memset(start, 0, (pieces + 1) * sizeof *start);
  for (size_t i = 0; i < g->count; i++) start[piece[i] + 1]++;
  for (size_t p = 0; p < pieces; p++) start[p + 1] += start[p];
  for (size_t i = g->count; i-- > 0;) order[--start[piece[i] + 1]] = i; /* start[p + 1] walks down to p's begin */
  memmove(start, start + 1, pieces * sizeof *start);
  start[pieces] = g->count;

  find_boxes(g, pieces, piece, boxes);
  for (size_t p = 0; p < pieces; p++)
    if (batten_orient_outwardness(g->n, g->points, normals, start[p + 1] - start[p], order + start[p]) < 0)
      turn(g, start[p], start[p + 1], order, normals);
  for (size_t p = 0; p < pieces; p++) {
    if ((status = batten_progress(ctx, "orient", (double)p / (double)pieces)) < 0) goto done;
    inside[p] = depth(g, normals, pieces, boxes, order, start, p) & 1;
  }
  for (size_t p = 0; p < pieces; p++)
    if (inside[p]) turn(g, start[p], start[p + 1], order, normals);
  status = BATTEN_OK;
done:
  batten_free(ctx, boxes);
  batten_free(ctx, inside);
  batten_free(ctx, start);
  batten_free(ctx, order);
  batten_free(ctx, piece);
  return status;
}

batten_status batten_orient_planes(batten_context *ctx, const batten_orient_graph *g, double *normals) {
  size_t pairs = g->count * g->k; /* the graph holds so many */
  batten_status status = BATTEN_E_NOMEM;
  tie *ties = batten_alloc_array(ctx, pairs, sizeof *ties), *spare = batten_alloc_array(ctx, pairs, sizeof *spare);
  size_t *parent = batten_alloc_array(ctx, g->count, sizeof *parent);
  unsigned char *turned = batten_alloc(ctx, g->count), *rank = batten_alloc(ctx, g->count);
  if (!ties || !spare || !parent || !turned || !rank) goto done;
  size_t count = 0;
  for (size_t i = 0; i < g->count; i++)
    for (size_t q = 0; q < g->k; q++) ties[count++] = (tie){tie_weight(g, i, g->index[i * g->k + q]), i * g->k + q};
  sort_ties(count, ties, spare);
  if ((status = batten_progress(ctx, "orient", 0.5)) < 0) goto done;
  propagate(g, count, ties, parent, turned, rank, normals);
  status = settle_components(ctx, g, normals);
done:
  batten_free(ctx, rank);
  batten_free(ctx, turned);
  batten_free(ctx, parent);
  batten_free(ctx, spare);
  batten_free(ctx, ties);
  return status;
}
