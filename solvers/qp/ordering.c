/* Patterns of the interior point's systems, and the order of their unknowns that gives the narrowest band: reverse
 * Cuthill-McKee from pseudo-peripheral nodes [George, Liu, Computer Solution of Large Sparse Positive Definite
 * Systems, 1981, ch. 4]. The order for least fill is in degree.c. */
#include "ordering.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/checked.h"

void qp_graph_free(batten_context *ctx, qp_graph *g) {
  batten_free(ctx, g->starts);
  batten_free(ctx, g->indices);
  *g = (qp_graph){0};
}

/* ---- patterns ---- */

/* Rows of c that each column meets: the transposed pattern. */
static batten_status transpose(batten_context *ctx, const qp_csr *c, qp_graph *out) {
  size_t n = c->columns, entries = c->starts[c->rows];
  qp_graph t = {.count = n};
  t.starts = batten_alloc_array(ctx, n + 2, sizeof *t.starts);
  t.indices = t.starts ? batten_alloc_array(ctx, entries, sizeof *t.indices) : NULL;
  if (!t.indices) {
    qp_graph_free(ctx, &t);
    return BATTEN_E_NOMEM;
  }
  memset(t.starts, 0, (n + 2) * sizeof *t.starts);
  for (size_t e = 0; e < entries; e++) t.starts[c->indices[e] + 2]++;
  for (size_t j = 2; j < n + 2; j++) t.starts[j] += t.starts[j - 1];
  for (size_t i = 0; i < c->rows; i++)
    for (size_t e = c->starts[i]; e < c->starts[i + 1]; e++) t.indices[t.starts[c->indices[e] + 1]++] = (uint32_t)i;
  *out = t;
  return BATTEN_OK;
}

/* Neighbours of j, each once, to `to` unless NULL; returns how many. mark[i] == stamp: seen. */
static size_t neighbours(const qp_csr *h, const qp_csr *c, const qp_graph *columns, const unsigned char *keep,
                         const unsigned char *drop, size_t j, uint32_t *mark, uint32_t stamp, uint32_t *to) {
  size_t count = 0;
  mark[j] = stamp;
#define VISIT(i)                     \
  do {                               \
    uint32_t visited = (i);          \
    if (mark[visited] != stamp) {    \
      mark[visited] = stamp;         \
      if (!drop || !drop[visited]) { \
        if (to) to[count] = visited; \
        count++;                     \
      }                              \
    }                                \
  } while (0)
  for (size_t e = h->starts[j]; e < h->starts[j + 1]; e++) VISIT(h->indices[e]);
  for (size_t t = columns->starts[j]; t < columns->starts[j + 1]; t++) {
    size_t row = columns->indices[t];
    if (keep && keep[row]) continue;
    for (size_t e = c->starts[row]; e < c->starts[row + 1]; e++) VISIT(c->indices[e]);
  }
#undef VISIT
  return count;
}

batten_status qp_graph_condensed(batten_context *ctx, const qp_csr *h, const qp_csr *c, const unsigned char *keep,
                                 const unsigned char *drop, size_t most, qp_graph *out) {
  size_t n = c->columns;
  assert(n < UINT32_MAX / 2);
  qp_graph columns = {0}, g = {.count = n};
  uint32_t *mark = batten_alloc_array(ctx, n, sizeof *mark);
  batten_status st = mark ? transpose(ctx, c, &columns) : BATTEN_E_NOMEM;
  if (st < 0) goto done;
  st = BATTEN_E_NOMEM;
  g.starts = batten_alloc_array(ctx, n + 1, sizeof *g.starts);
  if (!g.starts) goto done;
  for (size_t j = 0; j < n; j++) mark[j] = UINT32_MAX;
  g.starts[0] = 0;
  for (size_t j = 0; j < n; j++) {
    size_t count = drop && drop[j] ? 0 : neighbours(h, c, &columns, keep, drop, j, mark, (uint32_t)j, NULL);
    g.starts[j + 1] = g.starts[j] + count;
    if (g.starts[j + 1] > most) {
      st = BATTEN_E_TOO_LARGE;
      goto done;
    }
  }
  g.indices = batten_alloc_array(ctx, g.starts[n], sizeof *g.indices);
  if (!g.indices) goto done;
  for (size_t j = 0; j < n; j++)
    if (!drop || !drop[j])
      neighbours(h, c, &columns, keep, drop, j, mark, (uint32_t)(n + j), g.indices + g.starts[j]);
  *out = g;
  g = (qp_graph){0};
  st = BATTEN_OK;
done:
  qp_graph_free(ctx, &g);
  qp_graph_free(ctx, &columns);
  batten_free(ctx, mark);
  return st;
}

batten_status qp_graph_augmented(batten_context *ctx, const qp_csr *h, const qp_csr *c, qp_graph *out) {
  size_t n = c->columns, m = c->rows, all = n + m;
  qp_graph columns = {0}, g = {.count = all};
  batten_status st = transpose(ctx, c, &columns);
  if (st < 0) return st;
  st = BATTEN_E_NOMEM;
  g.starts = batten_alloc_array(ctx, all + 1, sizeof *g.starts);
  if (!g.starts) goto done;
  g.indices = batten_alloc_array(ctx, h->starts[n] + 2 * c->starts[m], sizeof *g.indices);
  if (!g.indices) goto done;
  size_t at = 0;
  for (size_t j = 0; j < n; j++) {
    g.starts[j] = at;
    for (size_t e = h->starts[j]; e < h->starts[j + 1]; e++)
      if (h->indices[e] != j) g.indices[at++] = h->indices[e];
    for (size_t e = columns.starts[j]; e < columns.starts[j + 1]; e++)
      g.indices[at++] = (uint32_t)(n + columns.indices[e]);
  }
  for (size_t i = 0; i < m; i++) {
    g.starts[n + i] = at;
    for (size_t e = c->starts[i]; e < c->starts[i + 1]; e++) g.indices[at++] = c->indices[e];
  }
  g.starts[all] = at;
  *out = g;
  g = (qp_graph){0};
  st = BATTEN_OK;
done:
  qp_graph_free(ctx, &g);
  qp_graph_free(ctx, &columns);
  return st;
}

/* ---- reverse Cuthill-McKee ---- */

typedef struct walk {
  const qp_graph *g;
  uint32_t *level; /* [count] distance from the root; UINT32_MAX = not reached */
  uint32_t *queue; /* [count] */
} walk;

static size_t degree(const qp_graph *g, size_t i) { return g->starts[i + 1] - g->starts[i]; }

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
static size_t number(const qp_graph *g, uint32_t root, unsigned char *done, uint64_t *key, uint32_t *order,
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

batten_status qp_order_band(batten_context *ctx, const qp_graph *g, uint32_t *order, size_t *bandwidth) {
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
