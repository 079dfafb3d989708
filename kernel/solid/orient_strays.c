/* Strays: points off the surface, which must not be taken for a part of it. They get a normal like all others but
 * stand for no area, are chosen for no subset, count as nobody's extreme point and tie nothing together before the
 * others are tied.
 *
 *   alone     its neighbours lie three times as close to each other as to it, and most of their planes miss it by
 *             more than they reach (on a surface whose density changes abruptly the planes do not miss)
 *   in a fog  no neighbourhood of it is flat
 *   among     most of its neighbours are strays: chance makes a neighbourhood in a fog look flat now and then
 *
 * Where more than a third are strays, or too few others would be left, the data are rather a noisy surface, and none
 * is. */
#include <math.h>

#include "base/checked.h"
#include "orient.h"

enum { CHUNK = 1024, ROUNDS = 2 };
static const double ALONE = 3, MISSED = 1.5, FOG = 0.4;

typedef struct stray_task {
  const batten_orient_graph *graph;
  const unsigned char *before;
  unsigned char *stray;
} stray_task;

static double reach(const batten_orient_graph *g, size_t i) { return g->distance[i * g->k + g->k - 1]; }

static bool is_alone(const batten_orient_graph *g, size_t i) {
  size_t closer = 0, missed = 0;
  for (size_t q = 0; q < g->k; q++) {
    size_t j = g->index[i * g->k + q];
    double off = 0;
    for (unsigned c = 0; c < g->n; c++)
      off += (g->points[i * g->n + c] - g->surface[j * g->n + c]) * g->plane[j * g->n + c];
    closer += ALONE * reach(g, j) < reach(g, i);
    missed += fabs(off) > MISSED * reach(g, j);
  }
  return 2 * closer > g->k && 2 * missed > g->k;
}

static void find(void *task, size_t chunk) {
  stray_task *t = task;
  const batten_orient_graph *g = t->graph;
  size_t end = (chunk + 1) * CHUNK < g->count ? (chunk + 1) * CHUNK : g->count;
  for (size_t i = chunk * CHUNK; i < end; i++) t->stray[i] = g->flatness[i] < FOG || is_alone(g, i);
}

static void find_among(void *task, size_t chunk) {
  stray_task *t = task;
  const batten_orient_graph *g = t->graph;
  size_t end = (chunk + 1) * CHUNK < g->count ? (chunk + 1) * CHUNK : g->count;
  for (size_t i = chunk * CHUNK; i < end; i++) {
    size_t strays = 0;
    for (size_t q = 0; q < g->k; q++) strays += t->before[g->index[i * g->k + q]];
    t->stray[i] = t->before[i] || 2 * strays > g->k;
  }
}

batten_status batten_orient_find_strays(batten_context *ctx, batten_orient_graph *g) {
  unsigned char *stray = batten_alloc_array(ctx, g->count, 2), *after = stray ? stray + g->count : NULL;
  if (!stray) return BATTEN_E_NOMEM;
  size_t chunks = (g->count + CHUNK - 1) / CHUNK, strays = 0;
  batten_parallel(ctx, chunks, find, &(stray_task){g, NULL, stray});
  for (int round = 0; round < ROUNDS; round++) {
    batten_parallel(ctx, chunks, find_among, &(stray_task){g, stray, after});
    unsigned char *t = stray;
    stray = after;
    after = t;
  }
  for (size_t i = 0; i < g->count; i++) strays += stray[i];
  if (3 * strays <= g->count && g->count - strays >= g->n + 2) {
    g->strays = strays;
    for (size_t i = 0; i < g->count; i++)
      if (stray[i]) g->area[i] = 0;
  }
  batten_free(ctx, stray < after ? stray : after);
  return BATTEN_OK;
}
