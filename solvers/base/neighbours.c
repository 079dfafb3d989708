/* kd-tree without pointers: the points are permuted so that a node is a range [low, high) of them.
 *
 *   node [low, high)   more than LEAF points: split at mid = (low + high) / 2 along axis[mid]
 *   left [low, mid)    coordinates <= split[mid]            right [mid, high)    coordinates >= split[mid]
 *
 * Ranges halve, so the depth is at most 64 and a walk needs no recursion. Points with equal coordinates are ordered
 * by their index, so that the permutation depends on nothing but the input. */
#include "base/neighbours.h"

#include <math.h>
#include <string.h>

#include "base/checked.h"
#include "base/points.h"

enum { LEAF = 8, DEPTH = 64, AXES = 3 };

struct batten_tree {
  unsigned n;
  size_t count;
  double *points;      /* [count][n] permuted */
  size_t *index;       /* [count] where a permuted point came from */
  unsigned char *axis; /* [count] split axis of the node with this mid */
  double *split;       /* [count] its place (the right side is permuted further, so no point keeps it) */
};

typedef struct range {
  size_t low, high;
} range;

/* A range still to be searched, and the squared distance of x to its side of the split. */
typedef struct pending {
  size_t low, high;
  double gap;
} pending;

static bool before(const double *points, unsigned n, unsigned axis, size_t a, size_t b) {
  double pa = points[a * n + axis], pb = points[b * n + axis];
  return pa < pb || (pa == pb && a < b);
}

/* Permutes order[low .. high) so that position mid holds what a sort along the axis would put there, smaller ones
 * before it and larger ones behind. Hoare's selection with the median of three. */
static void select_middle(const double *points, unsigned n, unsigned axis, size_t *order, size_t low, size_t high,
                          size_t mid) {
  while (high - low > 1) {
    size_t a = order[low], b = order[low + (high - low) / 2], c = order[high - 1];
    if (before(points, n, axis, b, a)) {
      size_t t = a;
      a = b;
      b = t;
    }
    if (before(points, n, axis, c, b)) b = before(points, n, axis, c, a) ? a : c;
    size_t i = low, j = high - 1;
    for (;;) { /* b is in the range, so both scans stop inside it */
      while (before(points, n, axis, order[i], b)) i++;
      while (before(points, n, axis, b, order[j])) j--;
      if (i >= j) break;
      size_t t = order[i];
      order[i] = order[j];
      order[j] = t;
    }
    /* All are distinct in this order, so the scans met at b: order[i] = b. */
    if (i == mid) return;
    if (i < mid)
      low = i + 1;
    else
      high = i;
  }
}

/* The axis along which the points of a range spread most. */
static unsigned widest_axis(const double *points, unsigned n, const size_t *order, size_t low, size_t high) {
  unsigned best = 0;
  double spread = -1;
  for (unsigned d = 0; d < n; d++) {
    double least = INFINITY, most = -INFINITY;
    for (size_t i = low; i < high; i++) {
      double v = points[order[i] * n + d];
      if (v < least) least = v;
      if (v > most) most = v;
    }
    if (most - least > spread) {
      spread = most - least;
      best = d;
    }
  }
  return best;
}

/* A tree that is being built, and its nodes of one level. */
typedef struct building {
  batten_tree *tree;
  const double *points;
  range *nodes;
} building;

/* Splits a node; false where it is a leaf: *mid stays. */
static bool split(const building *b, range r, size_t *mid) {
  batten_tree *t = b->tree;
  if (r.high - r.low <= LEAF) return false;
  *mid = r.low + (r.high - r.low) / 2;
  unsigned axis = widest_axis(b->points, t->n, t->index, r.low, r.high);
  select_middle(b->points, t->n, axis, t->index, r.low, r.high, *mid);
  t->axis[*mid] = (unsigned char)axis;
  t->split[*mid] = b->points[t->index[*mid] * t->n + axis];
  return true;
}

/* Splits one node of a level: its halves take the places 2 i and 2 i + 1 of the next. */
static void split_node(void *arg, size_t i) {
  const building *b = arg;
  range r = b->nodes[i];
  size_t mid = r.high; /* of a leaf, which has no right half */
  split(b, r, &mid);
  b->nodes[i] = (range){r.low, mid};
}

/* Everything below a node. */
static void split_below(void *arg, size_t i) {
  const building *b = arg;
  range stack[DEPTH];
  size_t top = 0, mid;
  stack[top++] = b->nodes[i];
  while (top > 0) {
    range r = stack[--top];
    if (!split(b, r, &mid)) continue;
    stack[top++] = (range){r.low, mid};
    stack[top++] = (range){mid, r.high};
  }
  for (size_t j = b->nodes[i].low; j < b->nodes[i].high; j++)
    memcpy(b->tree->points + j * b->tree->n, b->points + b->tree->index[j] * b->tree->n, b->tree->n * sizeof(double));
}

enum { LEVELS_APART = 6 };          /* of 2^6 nodes each level is split by tasks, below them one task does it all */
static const size_t SERIAL = 10000; /* points that are sooner split than given to threads */

/* Who splits what changes nothing: a node is split by its own points alone. Fails: CANCELLED. */
static batten_status build(batten_context *ctx, batten_tree *t, const double *points) {
  range nodes[1 << LEVELS_APART];
  building b = {t, points, nodes};
  size_t count = 1;
  for (size_t i = 0; i < t->count; i++) t->index[i] = i;
  nodes[0] = (range){0, t->count};
  if (t->count <= SERIAL) {
    split_below(&b, 0);
    return BATTEN_OK;
  }
  for (unsigned level = 0; level < LEVELS_APART; level++) {
    range before[1 << LEVELS_APART];
    batten_status st = batten_progress(ctx, "tree", (double)level / (LEVELS_APART + 2));
    if (st < 0) return st;
    memcpy(before, nodes, count * sizeof *nodes);
    batten_parallel(ctx, count, split_node, &b);
    for (size_t i = count; i-- > 0;) {
      nodes[2 * i + 1] = (range){nodes[i].high, before[i].high};
      nodes[2 * i] = nodes[i];
    }
    count *= 2;
  }
  batten_status st = batten_progress(ctx, "tree", (double)LEVELS_APART / (LEVELS_APART + 2));
  if (st < 0) return st;
  batten_parallel(ctx, count, split_below, &b);
  return batten_progress(ctx, "tree", 1);
}

void batten_tree_order(const batten_tree *t, size_t *order) {
  if (t->count) memcpy(order, t->index, t->count * sizeof *order);
}

static double distance_squared(const batten_tree *t, size_t i, const double *x) {
  double sum = 0;
  for (unsigned d = 0; d < t->n; d++) {
    double e = t->points[i * t->n + d] - x[d];
    sum += e * e;
  }
  return sum;
}

/* Goes down from r to the leaf on x's side and pushes the other sides that a ball of squared radius `reach` may
 * touch. */
static range descend(const batten_tree *t, const double *x, range r, double reach, pending *stack, size_t *top) {
  while (r.high - r.low > LEAF) {
    size_t mid = r.low + (r.high - r.low) / 2;
    double side = x[t->axis[mid]] - t->split[mid], gap = side * side;
    bool left = side < 0;
    if (gap <= reach) stack[(*top)++] = left ? (pending){mid, r.high, gap} : (pending){r.low, mid, gap};
    if (left)
      r.high = mid;
    else
      r.low = mid;
  }
  return r;
}

size_t batten_tree_nearest(const batten_tree *t, const double *x, size_t k, size_t skip, size_t *index,
                           double *distance) {
  pending stack[DEPTH];
  size_t top = 0, found = 0;
  if (k == 0 || t->count == 0) return 0;
  stack[top++] = (pending){0, t->count, 0};
  while (top > 0) {
    pending p = stack[--top];
    double reach = found < k ? INFINITY : distance[k - 1];
    if (p.gap > reach) continue;
    range leaf = descend(t, x, (range){p.low, p.high}, reach, stack, &top);
    for (size_t i = leaf.low; i < leaf.high; i++) {
      size_t candidate = t->index[i];
      double d = distance_squared(t, i, x);
      if (candidate == skip) continue;
      if (found == k && (d > distance[k - 1] || (d == distance[k - 1] && candidate > index[k - 1]))) continue;
      size_t place = found < k ? found++ : k - 1;
      for (; place > 0 && (d < distance[place - 1] || (d == distance[place - 1] && candidate < index[place - 1]));
           place--) {
        distance[place] = distance[place - 1];
        index[place] = index[place - 1];
      }
      distance[place] = d;
      index[place] = candidate;
    }
  }
  for (size_t i = 0; i < found; i++) distance[i] = sqrt(distance[i]);
  return found;
}

size_t batten_tree_within(const batten_tree *t, const double *x, double radius, size_t *index) {
  pending stack[DEPTH];
  size_t top = 0, found = 0;
  double reach = radius * radius;
  if (t->count == 0) return 0;
  stack[top++] = (pending){0, t->count, 0};
  while (top > 0) {
    pending p = stack[--top];
    range leaf = descend(t, x, (range){p.low, p.high}, reach, stack, &top);
    for (size_t i = leaf.low; i < leaf.high; i++)
      if (distance_squared(t, i, x) <= reach) index[found++] = t->index[i];
  }
  return found;
}

bool batten_tree_any_within(const batten_tree *t, const double *x, double radius, size_t skip) {
  pending stack[DEPTH];
  size_t top = 0;
  const double reach = radius * radius;
  if (t->count == 0) return false;
  stack[top++] = (pending){0, t->count, 0};
  while (top > 0) {
    pending p = stack[--top];
    range leaf = descend(t, x, (range){p.low, p.high}, reach, stack, &top);
    for (size_t i = leaf.low; i < leaf.high; i++)
      if (t->index[i] != skip && distance_squared(t, i, x) <= reach) return true;
  }
  return false;
}

void batten_tree_free(batten_context *ctx, batten_tree *tree) {
  if (!tree) return;
  batten_free(ctx, tree->points);
  batten_free(ctx, tree->index);
  batten_free(ctx, tree->axis);
  batten_free(ctx, tree->split);
  batten_free(ctx, tree);
}

batten_status batten_tree_new(batten_context *ctx, unsigned n, size_t count, const double *points,
                              batten_tree **out) {
  size_t numbers;
  if (n < 1 || n > AXES) return batten_fail(ctx, BATTEN_E_INVALID, "n: %u; give 1, 2 or 3", n);
  if (!batten_mul(count, n, &numbers)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "count: %zu; too many", count);
  size_t bad = batten_first_nonfinite(numbers, points);
  if (bad < numbers)
    return batten_fail(ctx, BATTEN_E_INVALID, "points[%zu]: coordinate %zu is %g; remove it", bad / n, bad % n,
                       points[bad]);
  batten_tree *t = batten_alloc(ctx, sizeof *t);
  if (!t) return BATTEN_E_NOMEM;
  *t = (batten_tree){.n = n, .count = count};
  t->points = batten_alloc_array(ctx, numbers, sizeof(double));
  t->index = batten_alloc_array(ctx, count, sizeof(size_t));
  t->axis = batten_alloc_array(ctx, count, 1);
  t->split = batten_alloc_array(ctx, count, sizeof(double));
  batten_status st = BATTEN_E_NOMEM;
  if (t->points && t->index && t->axis && t->split) st = build(ctx, t, points);
  if (st < 0) {
    batten_tree_free(ctx, t);
    return st;
  }
  *out = t;
  return BATTEN_OK;
}

/* ---- all points against all ---------------------------------------------------------------------- */

typedef struct all_queries {
  const batten_tree *tree;
  size_t k;
  size_t *index;
  double *distance;
} all_queries;

/* In the order of the tree: neighbours there look at the same nodes. */
static void query(void *arg, size_t j) {
  const all_queries *q = arg;
  const batten_tree *t = q->tree;
  const size_t i = t->index[j];
  batten_tree_nearest(t, t->points + j * t->n, q->k, i, q->index + i * q->k, q->distance + i * q->k);
}

batten_status batten_tree_neighbours(batten_context *ctx, const batten_tree *tree, size_t k, size_t *index,
                                     double *distance) {
  const size_t count = tree->count;
  size_t numbers;
  if (count == 0) return BATTEN_OK;
  if (k >= count) return batten_fail(ctx, BATTEN_E_INVALID, "k: %zu neighbours of %zu points; give fewer", k, count);
  if (!batten_mul(count, k, &numbers)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "k: %zu; too many", k);
  double *own = NULL;
  if (!distance && !(distance = own = batten_alloc_array(ctx, numbers, sizeof *own))) return BATTEN_E_NOMEM;
  all_queries q = {tree, k, index, distance};
  batten_status st = batten_for_points(ctx, "neighbours", count, query, &q);
  batten_free(ctx, own);
  return st;
}

batten_status batten_neighbours(batten_context *ctx, unsigned n, size_t count, const double *points, size_t k,
                                size_t *index, double *distance) {
  if (count == 0) return BATTEN_OK;
  if (k >= count) return batten_fail(ctx, BATTEN_E_INVALID, "k: %zu neighbours of %zu points; give fewer", k, count);
  batten_tree *tree = NULL;
  batten_status st = batten_tree_new(ctx, n, count, points, &tree);
  if (st >= 0) st = batten_tree_neighbours(ctx, tree, k, index, distance);
  batten_tree_free(ctx, tree);
  return st;
}
