/* A well-spread subset: each point the farthest from those before it.   [Gonzalez 1985]
 *
 * Points in a tree's order fall into blocks that lie together. A new point changes nothing in a block that it is
 * farther from than the block's farthest point is from those before: so the work falls with every point chosen, and
 * is about N log E + E N / BLOCK in all where the plain way takes N E. */
#include <math.h>

#include "base/checked.h"
#include "orient.h"

/* Unit size: nearer points are one. */
static const double SAME = 1e-9;
enum { BLOCK = 128, BLOCKS_PER_TASK = 64 };

typedef struct block {
  double middle[3], radius;
  double far; /* largest squared distance to the chosen, -1: all are strays */
  size_t at;
} block;

typedef struct spread_task {
  const batten_orient_graph *graph;
  block *blocks;
  size_t count;
  double *distance;
  const double *last; /* NULL: start */
} spread_task;

static double square_distance(unsigned n, const double *a, const double *b) {
  double square = 0;
  for (unsigned c = 0; c < n; c++) square += (a[c] - b[c]) * (a[c] - b[c]);
  return square;
}

static void start_block(const batten_orient_graph *g, block *b, size_t begin, size_t end, double *distance) {
  const double origin[3] = {0};
  for (unsigned c = 0; c < g->n; c++) {
    double lower = INFINITY, upper = -INFINITY;
    for (size_t i = begin; i < end; i++) {
      lower = fmin(lower, g->points[i * g->n + c]);
      upper = fmax(upper, g->points[i * g->n + c]);
    }
    b->middle[c] = (lower + upper) / 2;
  }
  b->radius = 0;
  b->far = -1;
  for (size_t i = begin; i < end; i++) {
    const double *x = g->points + i * g->n;
    b->radius = fmax(b->radius, sqrt(square_distance(g->n, x, b->middle)));
    double square = g->area[i] > 0 ? square_distance(g->n, x, origin) : -1;
    distance[i] = g->area[i] > 0 ? INFINITY : -1;
    if (square > b->far) b->far = square, b->at = i;
  }
}

static void come_nearer(const batten_orient_graph *g, block *b, size_t begin, size_t end, const double *last,
                        double *distance) {
  double away = sqrt(square_distance(g->n, last, b->middle)) - b->radius;
  if (b->far < 0 || (away > 0 && away * away * (1 - 1e-12) > b->far)) return;
  b->far = -1;
  for (size_t i = begin; i < end; i++) {
    double square = square_distance(g->n, g->points + i * g->n, last);
    if (square < distance[i]) distance[i] = square;
    if (distance[i] > b->far) b->far = distance[i], b->at = i;
  }
}

static void do_blocks(void *task, size_t chunk) {
  spread_task *t = task;
  size_t end = (chunk + 1) * BLOCKS_PER_TASK < t->count ? (chunk + 1) * BLOCKS_PER_TASK : t->count;
  for (size_t b = chunk * BLOCKS_PER_TASK; b < end; b++) {
    size_t low = b * BLOCK, high = low + BLOCK < t->graph->count ? low + BLOCK : t->graph->count;
    if (t->last)
      come_nearer(t->graph, t->blocks + b, low, high, t->last, t->distance);
    else
      start_block(t->graph, t->blocks + b, low, high, t->distance);
  }
}

/* The farthest point over all blocks and its distance; blocks start at INFINITY after the first choice. */
static double farthest(const spread_task *t, size_t *at) {
  double far = -1;
  for (size_t b = 0; b < t->count; b++)
    if (t->blocks[b].far > far) far = t->blocks[b].far, *at = t->blocks[b].at;
  return far;
}

batten_status batten_orient_spread(batten_context *ctx, const batten_orient_graph *g, size_t *found, size_t *chosen,
                                   double *distance) {
  size_t most = *found, blocks = (g->count + BLOCK - 1) / BLOCK,
         tasks = (blocks + BLOCKS_PER_TASK - 1) / BLOCKS_PER_TASK;
  spread_task t = {.graph = g, .count = blocks, .distance = distance};
  batten_status status = BATTEN_OK;
  if (!(t.blocks = batten_alloc_array(ctx, blocks, sizeof *t.blocks))) return BATTEN_E_NOMEM;
  batten_parallel(ctx, tasks, do_blocks, &t);
  *found = 0;
  for (size_t at; *found < most; ++*found) {
    double far = farthest(&t, &at);
    if (far < 0 || (*found > 0 && far <= SAME * SAME)) break;
    if (*found == 0)
      for (size_t b = 0; b < blocks; b++)
        if (t.blocks[b].far >= 0) t.blocks[b].far = INFINITY;
    chosen[*found] = at;
    t.last = g->points + at * g->n;
    if (*found % 64 == 0 && (status = batten_progress(ctx, "orient", 0.4)) < 0) break;
    if (blocks <= 4 * BLOCKS_PER_TASK || *found > 16) /* too little left for threads */
      for (size_t b = 0; b < tasks; b++) do_blocks(&t, b);
    else
      batten_parallel(ctx, tasks, do_blocks, &t);
  }
  batten_free(ctx, t.blocks);
  return status;
}
