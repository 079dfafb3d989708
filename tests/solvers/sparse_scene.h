/* Block systems on the edges of triangulated grids and on random graphs, as least squares: each edge adds G'G with a
 * random G [size][2 size], each node the square of a random block. */
#ifndef SPARSE_SCENE_H
#define SPARSE_SCENE_H

#include "sparse/block.h"
#include "tap.h"

typedef struct scene_graph {
  size_t rows, pair_count;
  uint32_t *pairs;
} scene_graph;

/* width x height nodes, each square with one diagonal; wrapped in both directions: a torus. */
static inline scene_graph scene_grid(size_t width, size_t height, bool wrapped) {
  scene_graph g = {.rows = width * height};
  g.pairs = malloc(6 * g.rows * sizeof *g.pairs);
  for (size_t y = 0; y < height; y++)
    for (size_t x = 0; x < width; x++) {
      static const size_t step[3][2] = {{1, 0}, {0, 1}, {1, 1}};
      for (size_t k = 0; k < 3; k++) {
        size_t to_x = x + step[k][0], to_y = y + step[k][1];
        if (!wrapped && (to_x >= width || to_y >= height)) continue;
        size_t to = to_y % height * width + to_x % width, from = y * width + x;
        if (to == from) continue;
        g.pairs[2 * g.pair_count] = (uint32_t)from;
        g.pairs[2 * g.pair_count++ + 1] = (uint32_t)to;
      }
    }
  return g;
}

/* Pairs at random, some of them given twice. */
static inline scene_graph scene_random(size_t rows, size_t pair_count, uint64_t *seed) {
  scene_graph g = {.rows = rows, .pair_count = 0};
  g.pairs = malloc((2 * pair_count + 1) * sizeof *g.pairs);
  while (g.pair_count < pair_count) {
    uint32_t i = (uint32_t)(t_random(seed) % rows), j = (uint32_t)(t_random(seed) % rows);
    if (i == j) continue;
    g.pairs[2 * g.pair_count] = i;
    g.pairs[2 * g.pair_count++ + 1] = j;
  }
  return g;
}

/* Nodes renamed at random. */
static inline void scene_shuffle(scene_graph *g, uint64_t *seed) {
  uint32_t *name = malloc(g->rows * sizeof *name);
  for (size_t i = 0; i < g->rows; i++) name[i] = (uint32_t)i;
  for (size_t i = g->rows; i-- > 1;) {
    size_t j = t_random(seed) % (i + 1);
    uint32_t swap = name[i];
    name[i] = name[j];
    name[j] = swap;
  }
  for (size_t e = 0; e < 2 * g->pair_count; e++) g->pairs[e] = name[g->pairs[e]];
  free(name);
}

static inline void scene_add_square(unsigned size, const double *g, const double *h, double weight, double *block) {
  for (unsigned p = 0; p < size; p++)
    for (unsigned q = 0; q < size; q++)
      for (unsigned k = 0; k < size; k++) block[p * size + q] += weight * g[k * size + p] * h[k * size + q];
}

/* Small `own`: nearly singular. */
static inline batten_status scene_matrix(batten_context *ctx, const scene_graph *g, unsigned size, double own,
                                         uint64_t *seed, block_matrix *a) {
  batten_status st = block_matrix_new(ctx, g->rows, size, g->pair_count, g->pairs, a);
  double left[BLOCK_SIZE_MAX * BLOCK_SIZE_MAX], right[BLOCK_SIZE_MAX * BLOCK_SIZE_MAX];
  if (st < 0) return st;
  for (size_t e = 0; e < g->pair_count; e++) {
    size_t i = g->pairs[2 * e], j = g->pairs[2 * e + 1];
    for (size_t k = 0; k < (size_t)size * size; k++) {
      left[k] = t_uniform(seed) - 0.5;
      right[k] = t_uniform(seed) - 0.5;
    }
    scene_add_square(size, left, left, 1, block_matrix_at(a, i, i));
    scene_add_square(size, right, right, 1, block_matrix_at(a, j, j));
    scene_add_square(size, left, right, 1, block_matrix_at(a, i, j));
    scene_add_square(size, right, left, 1, block_matrix_at(a, j, i));
  }
  for (size_t i = 0; i < g->rows; i++) {
    double *block = block_matrix_at(a, i, i);
    for (size_t k = 0; k < (size_t)size * size; k++) left[k] = t_uniform(seed) - 0.5;
    scene_add_square(size, left, left, own, block);
    for (unsigned p = 0; p < size; p++) block[p * size + p] += own;
  }
  return st;
}

/* The matrix written out, column-major; the caller frees it. */
static inline double *scene_dense(const block_matrix *a) {
  size_t n = a->rows * a->size, s = a->size;
  double *full = calloc(n * n + 1, sizeof *full);
  for (size_t i = 0; i < a->rows; i++)
    for (size_t e = a->starts[i]; e < a->starts[i + 1]; e++)
      for (size_t p = 0; p < s; p++)
        for (size_t q = 0; q < s; q++) full[(a->columns[e] * s + q) * n + i * s + p] = a->values[(e * s + p) * s + q];
  return full;
}

static inline double *scene_vector(size_t n, uint64_t *seed) {
  double *x = malloc((n + 1) * sizeof *x);
  for (size_t k = 0; k < n; k++) x[k] = t_uniform(seed) - 0.5;
  return x;
}

static inline double scene_apart(size_t n, const double *x, const double *y) {
  double most = 0;
  for (size_t k = 0; k < n; k++) most = fmax(most, isfinite(x[k] - y[k]) ? fabs(x[k] - y[k]) : INFINITY);
  return most;
}

#endif
