/* Patterns of the interior point's systems. */
#include "pattern.h"

#include <assert.h>
#include <string.h>

#include "base/checked.h"

/* Rows of c that each column meets: the transposed pattern. */
static batten_status transpose(batten_context *ctx, const qp_csr *c, sparse_graph *out) {
  size_t n = c->columns, entries = c->starts[c->rows];
  sparse_graph t = {.count = n};
  t.starts = batten_alloc_array(ctx, n + 2, sizeof *t.starts);
  t.indices = t.starts ? batten_alloc_array(ctx, entries, sizeof *t.indices) : NULL;
  if (!t.indices) {
    sparse_graph_free(ctx, &t);
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
static size_t neighbours(const qp_csr *h, const qp_csr *c, const sparse_graph *columns, const unsigned char *keep,
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
                                 const unsigned char *drop, size_t most, sparse_graph *out) {
  size_t n = c->columns;
  assert(n < UINT32_MAX / 2);
  sparse_graph columns = {0}, g = {.count = n};
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
  g = (sparse_graph){0};
  st = BATTEN_OK;
done:
  sparse_graph_free(ctx, &g);
  sparse_graph_free(ctx, &columns);
  batten_free(ctx, mark);
  return st;
}

batten_status qp_graph_augmented(batten_context *ctx, const qp_csr *h, const qp_csr *c, sparse_graph *out) {
  size_t n = c->columns, m = c->rows, all = n + m;
  sparse_graph columns = {0}, g = {.count = all};
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
  g = (sparse_graph){0};
  st = BATTEN_OK;
done:
  sparse_graph_free(ctx, &g);
  sparse_graph_free(ctx, &columns);
  return st;
}
