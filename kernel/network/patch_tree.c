/* A balanced tree of boxes around the control points of a network's patches: halves by the middles of the boxes along
 * the longest axis, until one patch is left. See patch_tree.h. */
#include "patch_tree.h"

#include <math.h>

#include "surface.h"

enum { STACK = 64 }; /* the depth is the number of bits of the patches' number */

static net_box3 box_of_patch(const batten_network *network, size_t patch) {
  const double(*net)[3] = (const double(*)[3])net_surface_points(network, patch);
  size_t count = triangular_count(net_surface_degree(network, patch));
  net_box3 b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
  for (size_t i = 0; i < count; i++)
    for (int d = 0; d < 3; d++) {
      b.lower[d] = fmin(b.lower[d], net[i][d]);
      b.upper[d] = fmax(b.upper[d], net[i][d]);
    }
  return b;
}

static net_box3 joined(const net_box3 *a, const net_box3 *b) {
  net_box3 c;
  for (int d = 0; d < 3; d++) {
    c.lower[d] = fmin(a->lower[d], b->lower[d]);
    c.upper[d] = fmax(a->upper[d], b->upper[d]);
  }
  return c;
}

/* Twice the middle; equal ones by their number, so that the outcome is one alone. */
static bool before(const net_box3 *leaves, int axis, uint32_t a, uint32_t b) {
  double x = leaves[a].lower[axis] + leaves[a].upper[axis], y = leaves[b].lower[axis] + leaves[b].upper[axis];
  return x < y || (!(y < x) && a < b);
}

/* Partial sort: order[mid] gets what belongs there, smaller ones before it [Hoare 1961]. */
static void select_middle(const net_box3 *leaves, int axis, uint32_t *order, size_t from, size_t to, size_t mid) {
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

static int longest_axis(const net_box3 *leaves, const uint32_t *order, size_t from, size_t to) {
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

/* Orders the patches, and puts each leaf's box in its place. */
static void sort_patches(const net_box3 *leaves, net_patch_tree *tree) {
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
static void join_boxes(net_patch_tree *tree) {
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

void net_patch_tree_free(batten_context *ctx, net_patch_tree *tree) {
  batten_free(ctx, tree->boxes);
  batten_free(ctx, tree->order);
}

batten_status net_patch_tree_make(batten_context *ctx, const batten_network *network, net_patch_tree *out) {
  size_t count = network->patch_count;
  *out = (net_patch_tree){.count = count};
  net_box3 *leaves = batten_alloc_array(ctx, count, sizeof *leaves);
  out->order = leaves ? batten_alloc_array(ctx, count, sizeof *out->order) : NULL;
  out->boxes = out->order ? batten_alloc_array(ctx, 2 * count, sizeof *out->boxes) : NULL;
  if (out->boxes && count) {
    for (size_t p = 0; p < count; p++) {
      leaves[p] = box_of_patch(network, p);
      out->order[p] = (uint32_t)p;
    }
    sort_patches(leaves, out);
    join_boxes(out);
  }
  batten_free(ctx, leaves);
  return out->boxes ? BATTEN_OK : BATTEN_E_NOMEM;
}

double net_box3_distance2(const net_box3 *box, const double *point) {
  double sum = 0;
  for (int d = 0; d < 3; d++) {
    double out = fmax(0, fmax(box->lower[d] - point[d], point[d] - box->upper[d]));
    sum += out * out;
  }
  return sum;
}
