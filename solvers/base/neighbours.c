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

static void build(batten_tree *t, const double *points) {
  range stack[DEPTH];
  size_t top = 0;
  stack[top++] = (range){0, t->count};
  for (size_t i = 0; i < t->count; i++) t->index[i] = i;
  while (top > 0) {
    range r = stack[--top];
    if (r.high - r.low <= LEAF) continue;
    size_t mid = r.low + (r.high - r.low) / 2;
    unsigned axis = widest_axis(points, t->n, t->index, r.low, r.high);
    select_middle(points, t->n, axis, t->index, r.low, r.high, mid);
    t->axis[mid] = (unsigned char)axis;
    t->split[mid] = points[t->index[mid] * t->n + axis];
    stack[top++] = (range){r.low, mid};
    stack[top++] = (range){mid, r.high};
  }
  for (size_t i = 0; i < t->count; i++)
    memcpy(t->points + i * t->n, points + t->index[i] * t->n, t->n * sizeof(double));
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
  if (!t->points || !t->index || !t->axis || !t->split) {
    batten_tree_free(ctx, t);
    return BATTEN_E_NOMEM;
  }
  build(t, points);
  *out = t;
  return BATTEN_OK;
}

/* ---- all points against all ---------------------------------------------------------------------- */

enum { QUERIES_PER_TASK = 256 };

typedef struct all_queries {
  const batten_tree *tree;
  const double *points;
  size_t k;
  size_t *index;
  double *distance;
} all_queries;

static void query_block(void *arg, size_t block) {
  const all_queries *q = arg;
  size_t last = (block + 1) * QUERIES_PER_TASK;
  if (last > q->tree->count) last = q->tree->count;
  for (size_t i = block * QUERIES_PER_TASK; i < last; i++)
    batten_tree_nearest(q->tree, q->points + i * q->tree->n, q->k, i, q->index + i * q->k, q->distance + i * q->k);
}

batten_status batten_neighbours(batten_context *ctx, unsigned n, size_t count, const double *points, size_t k,
                                size_t *index, double *distance) {
  size_t numbers;
  if (count == 0) return BATTEN_OK;
  if (k >= count) return batten_fail(ctx, BATTEN_E_INVALID, "k: %zu neighbours of %zu points; give fewer", k, count);
  if (!batten_mul(count, k, &numbers)) return batten_fail(ctx, BATTEN_E_TOO_LARGE, "k: %zu; too many", k);
  batten_tree *tree = NULL;
  double *own = NULL;
  batten_status st = batten_tree_new(ctx, n, count, points, &tree);
  if (st < 0) return st;
  if (!distance) {
    distance = own = batten_alloc_array(ctx, numbers, sizeof *own);
    if (!own) {
      st = BATTEN_E_NOMEM;
      goto done;
    }
  }
  all_queries q = {tree, points, k, index, distance};
  batten_parallel(ctx, (count + QUERIES_PER_TASK - 1) / QUERIES_PER_TASK, query_block, &q);
done:
  batten_free(ctx, own);
  batten_tree_free(ctx, tree);
  return st;
}
