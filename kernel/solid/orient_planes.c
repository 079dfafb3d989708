/* Orientation by local planes: cheap, for many points.   [after Hoppe, DeRose, Duchamp, McDonald, Stuetzle 1992]
 *
 *   1. Each pair of neighbours ties the signs of two planes, the firmer the better the planes fit to one surface and
 *      the more the pair lies in both (batten_orient_agreement).
 *   2. Kruskal's minimum spanning forest settles the firmest ties first; a union-find with parity carries the signs,
 *      so no walk over the tree is needed. Loose ties do not join what is closed already: bodies that nearly touch.
 *   3. Each tree is turned so that its extreme points look outwards, and turned round again when it lies inside
 *      an odd number of the others (winding numbers): the walls of cavities.
 *
 * Time O(N log N) + (components whose boxes overlap) x N. */
#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "orient.h"

/* A tie with less than 0.3 left of its agreement does not join two trees that are closed surfaces already. */
static const double LOOSE = 0.7;
static const double CLOSED = 0.1; /* openness of random samples of a torus: 0.03 */

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

/* Signed area so far of the tree below a root. */
typedef struct area {
  double sum[3], total;
} area;

static bool closed(const area *a, unsigned n) {
  double square = 0;
  for (unsigned c = 0; c < n; c++) square += a->sum[c] * a->sum[c];
  return square < CLOSED * CLOSED * a->total * a->total;
}

typedef struct forest {
  size_t *parent, *piece; /* [count] */
  unsigned char *turned, *rank;
  area *areas;
} forest;

static void plant(const batten_orient_graph *g, forest *f) {
  unsigned n = g->n;
  for (size_t i = 0; i < g->count; i++) {
    f->parent[i] = i;
    f->turned[i] = f->rank[i] = 0;
    f->areas[i].total = batten_orient_area(g, i);
    for (unsigned c = 0; c < 3; c++) f->areas[i].sum[c] = c < n ? f->areas[i].total * g->plane[i * n + c] : 0;
  }
}

/* Joins the trees of i and j, whose planes agree up to sign. */
static void join(const batten_orient_graph *g, const tie *t, forest *f) {
  size_t i = t->from / g->k, j = g->index[t->from];
  size_t a = find_root(f->parent, f->turned, i), b = find_root(f->parent, f->turned, j);
  if (a == b || (t->weight > LOOSE && closed(&f->areas[a], g->n) && closed(&f->areas[b], g->n))) return;
  const double *x = g->points, *u = g->plane;
  double agreement = batten_orient_agreement(g->n, x + i * g->n, x + j * g->n, u + i * g->n, u + j * g->n);
  bool opposed = (agreement < 0) != ((i != a && f->turned[i]) != (j != b && f->turned[j]));
  if (f->rank[a] < f->rank[b]) {
    size_t r = a;
    a = b;
    b = r;
  }
  if (f->rank[a] == f->rank[b]) f->rank[a]++;
  f->parent[b] = a;
  f->turned[b] = opposed;
  f->areas[a].total += f->areas[b].total;
  for (unsigned c = 0; c < 3; c++) f->areas[a].sum[c] += opposed ? -f->areas[b].sum[c] : f->areas[b].sum[c];
}

/* Steps 1 and 2. piece [count]: label of each point's component, numbered by first point. Returns how many. */
static size_t propagate(const batten_orient_graph *g, size_t count, const tie *ties, forest *f, double *normals) {
  unsigned n = g->n;
  size_t pieces = 0;
  plant(g, f);
  for (size_t t = 0; t < count; t++) join(g, ties + t, f);
  for (size_t i = 0; i < g->count; i++) f->piece[i] = SIZE_MAX;
  for (size_t i = 0; i < g->count; i++) {
    size_t root = find_root(f->parent, f->turned, i);
    double sign = i != root && f->turned[i] ? -1 : 1;
    for (unsigned c = 0; c < n; c++) normals[i * n + c] = sign * g->plane[i * n + c];
    if (f->piece[root] == SIZE_MAX) f->piece[root] = pieces++; /* a root may come after its points */
    f->piece[i] = f->piece[root];
  }
  return pieces;
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

/* Winding number about x of what point j stands for. */
static double winding(const batten_orient_graph *g, const double *normals, size_t j, const double *x) {
  const double full = g->n == 2 ? 6.283185307179586 : 12.566370614359172;
  double square = 0, flux = 0;
  for (unsigned c = 0; c < g->n; c++) {
    double d = g->points[j * g->n + c] - x[c];
    square += d * d;
    flux += d * normals[j * g->n + c];
  }
  if (square == 0) return 0;
  return flux * batten_orient_area(g, j) / (full * (g->n == 2 ? square : square * sqrt(square)));
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
static batten_status settle_components(batten_context *ctx, const batten_orient_graph *g, size_t pieces,
                                       const size_t *piece, double *normals) {
  batten_status status = BATTEN_E_NOMEM;
  size_t *order = NULL, *start = NULL;
  unsigned char *inside = NULL;
  box *boxes = NULL;
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
  return status;
}

batten_status batten_orient_planes(batten_context *ctx, const batten_orient_graph *g, double *normals) {
  size_t pairs = g->count * g->k, count = 0; /* the graph holds so many */
  batten_status status = BATTEN_E_NOMEM;
  tie *spare = NULL, *ties = batten_alloc_array(ctx, pairs, sizeof *ties);
  forest f = {0};
  if (!ties || !(spare = batten_alloc_array(ctx, pairs, sizeof *spare)) ||
      !(f.parent = batten_alloc_array(ctx, g->count, sizeof *f.parent)) ||
      !(f.piece = batten_alloc_array(ctx, g->count, sizeof *f.piece)) || !(f.turned = batten_alloc(ctx, g->count)) ||
      !(f.rank = batten_alloc(ctx, g->count)) || !(f.areas = batten_alloc_array(ctx, g->count, sizeof *f.areas)))
    goto done;
  for (size_t i = 0; i < g->count; i++)
    for (size_t q = 0; q < g->k; q++) ties[count++] = (tie){tie_weight(g, i, g->index[i * g->k + q]), i * g->k + q};
  sort_ties(count, ties, spare);
  if ((status = batten_progress(ctx, "orient", 0.5)) < 0) goto done;
  size_t pieces = propagate(g, count, ties, &f, normals);
  status = settle_components(ctx, g, pieces, f.piece, normals);
done:
  batten_free(ctx, f.areas);
  batten_free(ctx, f.rank);
  batten_free(ctx, f.turned);
  batten_free(ctx, f.piece);
  batten_free(ctx, f.parent);
  batten_free(ctx, spare);
  batten_free(ctx, ties);
  return status;
}
