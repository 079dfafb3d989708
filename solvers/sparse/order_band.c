/* The order of unknowns that gives the narrowest band: reverse Cuthill-McKee from pseudo-peripheral nodes [George,
 * Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981, ch. 4]. The order for least fill is in
 * order_degree.c, that by dissection in order_dissect.c. */
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"
#include "order.h"

void sparse_graph_free(batten_context *ctx, sparse_graph *g) {
  batten_free(ctx, g->starts);
  batten_free(ctx, g->indices);
  *g = (sparse_graph){0};
}

typedef struct walk {
  const sparse_graph *g;
  uint32_t *level; /* [count] distance from the root; UINT32_MAX = not reached */
  uint32_t *queue; /* [count] */
} walk;

static size_t degree(const sparse_graph *g, size_t i) { return g->starts[i + 1] - g->starts[i]; }

/* Breadth first from root over nodes that are not reached: returns how many, in queue; *depth = last level. Levels
 * are wiped again. */
static size_t levels(walk *w, uint32_t root, size_t *depth) {
  size_t head = 0, tail = 0;
  w->queue[tail++] = root;
  w->level[root] = 0;
  while (head < tail) {
    uint32_t i = w->queue[head++];
    for (size_t e = w->g->starts[i]; e < w->g->starts[i + 1]; e++) {
      uint32_t j = w->g->indices[e];
      if (w->level[j] != UINT32_MAX) continue;
      w->level[j] = w->level[i] + 1;
      w->queue[tail++] = j;
    }
  }
  *depth = w->level[w->queue[tail - 1]];
  return tail;
}

/* A node from which the component of start is long and thin: go to a node of least degree in the last level as long
 * as that makes the levels more. */
static uint32_t peripheral(walk *w, uint32_t start) {
  size_t deepest = 0;
  for (bool first = true;; first = false) {
    size_t depth, reached = levels(w, start, &depth);
    uint32_t best = start;
    for (size_t q = reached; q-- > 0 && w->level[w->queue[q]] == depth;)
      if (best == start || degree(w->g, w->queue[q]) < degree(w->g, best)) best = w->queue[q];
    for (size_t q = 0; q < reached; q++) w->level[w->queue[q]] = UINT32_MAX;
    if (!first && depth <= deepest) return start;
    deepest = depth;
    if (depth == 0) return start;
    start = best;
  }
}

/* Sort key: degree, then number, so that the order is the same everywhere. */
static int by_key(const void *a, const void *b) {
  uint64_t p = *(const uint64_t *)a, q = *(const uint64_t *)b;
  return (p > q) - (p < q);
}

/* Few at a time: insertion, longer lists by qsort. */
static void sort_keys(uint64_t *key, size_t count) {
  if (count > 32) {
    qsort(key, count, sizeof *key, by_key);
    return;
  }
  for (size_t i = 1; i < count; i++) {
    uint64_t k = key[i];
    size_t p = i;
    for (; p > 0 && key[p - 1] > k; p--) key[p] = key[p - 1];
    key[p] = k;
  }
}

/* Appends the component of root to order in Cuthill and McKee's way: neighbours by rising degree. */
static size_t number(const sparse_graph *g, uint32_t root, unsigned char *done, uint64_t *key, uint32_t *order,
                     size_t tail) {
  size_t head = tail;
  order[tail++] = root;
  done[root] = 1;
  while (head < tail) {
    uint32_t i = order[head++];
    size_t fresh = 0;
    for (size_t e = g->starts[i]; e < g->starts[i + 1]; e++) {
      uint32_t j = g->indices[e];
      if (done[j]) continue;
      done[j] = 1;
      key[fresh++] = (uint64_t)degree(g, j) << 32 | j;
    }
    sort_keys(key, fresh);
    for (size_t q = 0; q < fresh; q++) order[tail++] = (uint32_t)key[q];
  }
  return tail;
}

batten_status sparse_order_band(batten_context *ctx, const sparse_graph *g, uint32_t *order, size_t *bandwidth) {
  size_t n = g->count, tail = 0, widest = 0;
  *bandwidth = 0;
  if (n == 0) return BATTEN_OK;
  batten_status st = BATTEN_E_NOMEM;
  walk w = {.g = g};
  unsigned char *done = NULL;
  uint64_t *key = batten_alloc_array(ctx, n, sizeof *key);
  if (!key) goto done;
  done = batten_alloc(ctx, n);
  if (!done) goto done;
  w.level = batten_alloc_array(ctx, n, sizeof *w.level);
  if (!w.level) goto done;
  w.queue = batten_alloc_array(ctx, n, sizeof *w.queue);
  if (!w.queue) goto done;
  for (size_t i = 0; i < n; i++) w.level[i] = UINT32_MAX;
  memset(done, 0, n);
  for (size_t i = 0; i < n; i++)
    if (!done[i]) tail = number(g, peripheral(&w, (uint32_t)i), done, key, order, tail);
  for (size_t i = 0; i < n / 2; i++) {
    uint32_t swap = order[i];
    order[i] = order[n - 1 - i];
    order[n - 1 - i] = swap;
  }
  for (size_t p = 0; p < n; p++) w.level[order[p]] = (uint32_t)p;
  for (size_t i = 0; i < n; i++)
    for (size_t e = g->starts[i]; e < g->starts[i + 1]; e++) {
      size_t a = w.level[i], b = w.level[g->indices[e]], apart = a > b ? a - b : b - a;
      if (apart > widest) widest = apart;
    }
  *bandwidth = widest;
  st = BATTEN_OK;
done:
  batten_free(ctx, w.queue);
  batten_free(ctx, w.level);
  batten_free(ctx, done);
  batten_free(ctx, key);
  return st;
}
