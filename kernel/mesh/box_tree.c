/* A balanced tree of boxes: halves by the middles of the boxes along the longest axis, until one is left. */
#include "box_tree.h"

#include <math.h>
#include <stdbool.h>

enum { STACK = 64 }; /* the depth is the number of bits of the boxes' number */

static box3 joined(const box3 *a, const box3 *b) {
  box3 c;
  for (int d = 0; d < 3; d++) {
    c.lower[d] = fmin(a->lower[d], b->lower[d]);
    c.upper[d] = fmax(a->upper[d], b->upper[d]);
  }
  return c;
}

/* Twice the middle; equal ones by their number, so that the outcome is one alone. */
static bool before(const box3 *leaves, int axis, uint32_t a, uint32_t b) {
  double x = leaves[a].lower[axis] + leaves[a].upper[axis], y = leaves[b].lower[axis] + leaves[b].upper[axis];
  return x < y || (!(y < x) && a < b);
}

/* Partial sort: order[mid] gets what belongs there, smaller ones before it [Hoare 1961]. */
static void select_middle(const box3 *leaves, int axis, uint32_t *order, size_t from, size_t to, size_t mid) {
  while (to - from > 1) {
    uint32_t pivot = order[from + (to - from) / 2];
    size_t i = from, j = to - 1;
    for (;;) {
      while (before(leaves, axis, order[i], pivot)) i++;
      while (before(leaves, axis, pivot, order[j])) j--;
      if (i >= j) break;
      uint32_t swap = order[i];
      order[i++] = order[j];
      order[j--] = swap;
    }
    if (i == j) { /* the pivot in its place */
      if (mid == j) return;
      if (mid < j)
        to = j;
      else
        from = j + 1;
    } else if (mid <= j) {
      to = j + 1;
    } else {
      from = j + 1;
    }
  }
}

static int longest_axis(const box3 *leaves, const uint32_t *order, size_t from, size_t to) {
  double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (size_t i = from; i < to; i++)
    for (int d = 0; d < 3; d++) {
      double middle = leaves[order[i]].lower[d] + leaves[order[i]].upper[d];
      lower[d] = fmin(lower[d], middle);
      upper[d] = fmax(upper[d], middle);
    }
  int axis = 0;
  for (int d = 1; d < 3; d++)
    if (upper[d] - lower[d] > upper[axis] - lower[axis]) axis = d;
  return axis;
}

typedef struct range {
  size_t node, from, to;
} range;

/* Orders the boxes, and puts each leaf's box in its place. */
static void sort_boxes(const box3 *leaves, box_tree *tree) {
  range stack[STACK] = {{0, 0, tree->count}};
  size_t height = 1;
  while (height > 0) {
    range r = stack[--height];
    if (r.to - r.from == 1) {
      tree->boxes[r.node] = leaves[tree->order[r.from]];
      continue;
    }
    size_t mid = (r.from + r.to) / 2;
    select_middle(leaves, longest_axis(leaves, tree->order, r.from, r.to), tree->order, r.from, r.to, mid);
    stack[height++] = (range){r.node + 2 * (mid - r.from), mid, r.to};
    stack[height++] = (range){r.node + 1, r.from, mid};
  }
}

/* A node is joined when it comes up again after its children. */
static void join_boxes(box_tree *tree) {
  range stack[2 * STACK] = {{0, 0, tree->count}};
  bool again[2 * STACK] = {false};
  size_t height = 1;
  while (height > 0) {
    range r = stack[--height];
    size_t mid = (r.from + r.to) / 2, left = r.node + 1, right = r.node + 2 * (mid - r.from);
    if (r.to - r.from == 1) continue;
    if (again[height]) {
      tree->boxes[r.node] = joined(&tree->boxes[left], &tree->boxes[right]);
      continue;
    }
    again[height++] = true;
    again[height] = false;
    stack[height++] = (range){right, mid, r.to};
    again[height] = false;
    stack[height++] = (range){left, r.from, mid};
  }
}

void box_tree_free(batten_context *ctx, box_tree *tree) {
  batten_free(ctx, tree->boxes);
  batten_free(ctx, tree->order);
}

batten_status box_tree_make(batten_context *ctx, size_t count, const box3 *leaves, box_tree *out) {
  *out = (box_tree){.count = count};
  out->order = batten_alloc_array(ctx, count, sizeof *out->order);
  out->boxes = out->order ? batten_alloc_array(ctx, count, 2 * sizeof *out->boxes) : NULL;
  if (!out->boxes) return BATTEN_E_NOMEM;
  for (size_t i = 0; i < count; i++) out->order[i] = (uint32_t)i;
  if (count) {
    sort_boxes(leaves, out);
    join_boxes(out);
  }
  return BATTEN_OK;
}

box3 box3_of_points(size_t count, const double (*points)[3]) {
  box3 b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (size_t i = 0; i < count; i++)
    for (int d = 0; d < 3; d++) {
      b.lower[d] = fmin(b.lower[d], points[i][d]);
      b.upper[d] = fmax(b.upper[d], points[i][d]);
    }
  return b;
}

double box3_distance2(const box3 *box, const double *point) {
  double sum = 0;
  for (int d = 0; d < 3; d++) {
    double out = fmax(0, fmax(box->lower[d] - point[d], point[d] - box->upper[d]));
    sum += out * out;
  }
  return sum;
}
