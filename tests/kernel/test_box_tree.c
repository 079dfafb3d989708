/* Trees of boxes: everything is there once, and boxes hold what is below. */
#include "mesh/box_tree.h"

#include "tap.h"

/* Boxes around the ends of random segments; every third at the place of the one before. */
static void make_leaves(size_t count, box3 *leaves) {
  uint64_t seed = 7;
  for (size_t i = 0; i < count; i++) {
    double ends[2][3];
    for (int k = 0; k < 6; k++)
      ends[k / 3][k % 3] = (k < 3 ? 0 : ends[0][k % 3]) + t_uniform(&seed) / (k < 3 ? 1 : 9);
    leaves[i] = i % 3 == 2 ? leaves[i - 1] : box3_of_points(2, (const double(*)[3])ends);
  }
}

static void test_tree(batten_context *ctx, size_t count) {
  box3 *leaves = malloc((count + 1) * sizeof *leaves);
  unsigned char *seen = calloc(count + 1, 1);
  box_tree tree;
  make_leaves(count, leaves);
  T_OK(box_tree_make(ctx, count, leaves, &tree), ctx);
  size_t stack[200][3] = {{0, 0, count}}, height = count > 0, nodes = 0;
  bool holds = true;
  while (height > 0) {
    size_t node = stack[--height][0], from = stack[height][1], to = stack[height][2], mid = (from + to) / 2;
    nodes++;
    for (size_t i = from; i < to; i++)
      holds = holds && box3_distance2(&tree.boxes[node], leaves[tree.order[i]].lower) == 0 &&
              box3_distance2(&tree.boxes[node], leaves[tree.order[i]].upper) == 0;
    if (to - from == 1) {
      seen[tree.order[from]]++;
      continue;
    }
    memcpy(stack[height++], (size_t[3]){node + 1, from, mid}, sizeof stack[0]);
    memcpy(stack[height++], (size_t[3]){node + 2 * (mid - from), mid, to}, sizeof stack[0]);
  }
  for (size_t i = 0; i < count; i++) holds = holds && seen[i] == 1;
  T_CHECK(holds && nodes == (count ? 2 * count - 1 : 0), "%zu boxes: each once, and all below a box within it",
          count);
  box_tree_free(ctx, &tree);
  free(seen);
  free(leaves);
}

static batten_status make_some(batten_context *ctx, void *arg) {
  box_tree tree;
  batten_status st = box_tree_make(ctx, 50, arg, &tree);
  box_tree_free(ctx, &tree);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  const size_t counts[] = {0, 1, 2, 3, 64, 1000};
  for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) test_tree(ctx, counts[i]);
  const box3 box = {{0, 0, 0}, {1, 2, 3}};
  T_CHECK(box3_distance2(&box, (const double[3]){0.5, 1, 3}) == 0 &&
              box3_distance2(&box, (const double[3]){4, 1, -4}) == 25,
          "squared distances from a box");
  box3 leaves[50];
  make_leaves(50, leaves);
  t_fail_every_allocation("box_tree_make", make_some, leaves);
  batten_context_free(ctx);
  return t_done();
}
