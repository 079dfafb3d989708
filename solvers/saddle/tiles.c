/* Walks over the lower triangle of K, tile by tile, on the context's threads.
 *
 * The triangle is cut into tiles of 128 x 128, numbered row by row; worker w takes the tiles w, w + 16, ... of each
 * portion, so what a worker does and adds up is fixed by the sizes alone and no bit depends on the thread count.
 * Tiles live in per-worker scratch (128 KB, inside the second level cache) and are copied or multiplied from there.
 */
#include <float.h>
#include <string.h>

#include "system.h"

enum {
  WORKERS = 16, /* more threads than this do not help */
  TILE = 128,
  PORTION = 256, /* tiles between two progress calls: 4 million entries */
  LANES = 8      /* partial sums of a dot product; rows of a tile are padded to it with zeros */
};

/* The rows of K cut into blocks that do not straddle the breaks. */
typedef struct partition {
  size_t bounds[4]; /* 0, breaks, n */
  size_t before[4]; /* blocks before each bound */
} partition;

static partition make_partition(size_t n, const size_t breaks[2]) {
  partition p = {.bounds = {0, breaks ? breaks[0] : 0, breaks ? breaks[1] : n, n}};
  for (int part = 0; part < 3; part++)
    p.before[part + 1] = p.before[part] + (p.bounds[part + 1] - p.bounds[part] + TILE - 1) / TILE;
  return p;
}

static void block_range(const partition *p, size_t block, size_t *first, size_t *count) {
  int part = block >= p->before[2] ? 2 : block >= p->before[1] ? 1 : 0;
  *first = p->bounds[part] + (block - p->before[part]) * TILE;
  size_t left = p->bounds[part + 1] - *first;
  *count = left < TILE ? left : TILE;
}

/* Tile number t of the triangle, counted row by row: block row i holds the tiles i (i + 1) / 2 ... */
static void tile_place(size_t t, size_t *row, size_t *col) {
  size_t i = (size_t)((sqrt(8.0 * (double)t + 1) - 1) / 2);
  while (i * (i + 1) / 2 > t) i--;
  while ((i + 1) * (i + 2) / 2 <= t) i++;
  *row = i;
  *col = t - i * (i + 1) / 2;
}

typedef struct walk {
  const batten_saddle_matrix *matrix;
  partition blocks;
  size_t first, end; /* tiles of this portion */
  bool check;
  double *scratch;
  void (*sink)(void *arg, size_t worker, const batten_saddle_tile *tile);
  void *arg;
  bool bad[WORKERS];
  size_t bad_row[WORKERS], bad_col[WORKERS];
} walk;

/* True when all values are finite: x - x is 0 for these and NaN for the others. Independent sums, for vectors. */
static bool all_finite(size_t count, const double *x) {
  double sums[LANES] = {0}, total = 0;
  size_t i = 0;
  for (; i + LANES <= count; i += LANES)
    for (size_t l = 0; l < LANES; l++) sums[l] += x[i + l] - x[i + l];
  for (; i < count; i++) total += x[i] - x[i];
  for (size_t l = 0; l < LANES; l++) total += sums[l];
  return total == 0;
}

static void find_bad(walk *w, size_t worker, const batten_saddle_tile *t) {
  size_t along = t->across ? t->cols : t->rows, columns = t->across ? t->rows : t->cols;
  for (size_t j = 0; j < columns && !w->bad[worker]; j++) {
    const double *column = t->data + j * t->ld;
    if (all_finite(along, column)) continue;
    size_t i = batten_first_nonfinite(along, column);
    w->bad[worker] = true;
    w->bad_row[worker] = t->row0 + (t->across ? j : i);
    w->bad_col[worker] = t->col0 + (t->across ? i : j);
  }
}

static void walk_worker(void *arg, size_t worker) {
  walk *w = arg;
  batten_saddle_tile t = {.ld = TILE, .data = w->scratch + worker * TILE * TILE};
  for (size_t number = w->first + worker; number < w->end; number += WORKERS) {
    size_t row, col;
    tile_place(number, &row, &col);
    block_range(&w->blocks, row, &t.row0, &t.rows);
    block_range(&w->blocks, col, &t.col0, &t.cols);
    t.across = t.col0 >= w->blocks.bounds[2];
    if (t.across)
      w->matrix->fill(w->matrix->user, t.col0, t.cols, t.row0, t.rows, t.data, t.ld);
    else
      w->matrix->fill(w->matrix->user, t.row0, t.rows, t.col0, t.cols, t.data, t.ld);
    if (w->check) find_bad(w, worker, &t);
    w->sink(w->arg, worker, &t);
  }
}

/* Workers that get a tile at all: small systems take little scratch. The breaks add at most 2 blocks. */
static size_t workers(size_t n) {
  size_t blocks = n / TILE + 3;
  return blocks > 5 ? WORKERS : blocks * (blocks + 1) / 2;
}

size_t batten_saddle_walk_bytes(size_t n) { return workers(n) * TILE * TILE * sizeof(double); }

batten_status batten_saddle_walk(const batten_saddle *s, const char *phase, const size_t breaks[2], bool check,
                                 void (*sink)(void *arg, size_t worker, const batten_saddle_tile *tile), void *arg) {
  batten_context *ctx = s->ctx;
  batten_status st = BATTEN_OK;
  walk w = {
      .matrix = &s->matrix, .blocks = make_partition(s->matrix.n, breaks), .check = check, .sink = sink, .arg = arg};
  size_t tiles = w.blocks.before[3] * (w.blocks.before[3] + 1) / 2;
  w.scratch = batten_alloc(ctx, batten_saddle_walk_bytes(s->matrix.n));
  if (!w.scratch) return BATTEN_E_NOMEM;
  while (w.end < tiles) {
    st = batten_progress(ctx, phase, (double)w.end / (double)tiles);
    if (st < 0) goto done;
    w.first = w.end;
    w.end = tiles - w.first < PORTION ? tiles : w.first + PORTION;
    size_t in_portion = w.end - w.first;
    batten_parallel(ctx, in_portion < WORKERS ? in_portion : WORKERS, walk_worker, &w);
    for (size_t i = 0; i < WORKERS; i++) {
      if (!w.bad[i]) continue;
      st = batten_fail(ctx, BATTEN_E_INVALID, "matrix.fill: entry [%zu][%zu] is not finite; check points %zu and %zu",
                       w.bad_row[i], w.bad_col[i], w.bad_row[i], w.bad_col[i]);
      goto done;
    }
  }
done:
  batten_free(ctx, w.scratch);
  return st;
}

batten_status batten_saddle_probe_scale(batten_saddle *s) {
  size_t n = s->matrix.n;
  double largest = 0, *column = batten_alloc_array(s->ctx, TILE, sizeof *column);
  if (!column) return BATTEN_E_NOMEM;
  for (size_t probe = 0; probe < 3 && n > 0; probe++)
    for (size_t row = 0; row < n; row += TILE) {
      size_t rows = n - row < TILE ? n - row : TILE;
      s->matrix.fill(s->matrix.user, row, rows, probe * (n - 1) / 2, 1, column, TILE);
      for (size_t i = 0; i < rows; i++) largest = fmax(largest, fabs(column[i]));
    }
  batten_free(s->ctx, column);
  s->scale = largest > 0 && largest <= DBL_MAX ? batten_unit(largest) : 1;
  return BATTEN_OK;
}

/* ---- Product with fresh entries ---- */

typedef struct product {
  size_t m;
  const double *x; /* [m][stride], zero beyond n */
  double *sums;    /* [workers][m][stride] */
  size_t stride;
  bool absolute;
} product;

static size_t padded(size_t n) { return n + LANES; }

/* y_row += column x and returns column' x_row, rows a multiple of LANES. */
static double multiply_column(size_t rows, const double *column, double x, const double *x_row, double *y_row) {
  double dot[LANES] = {0};
  for (size_t i = 0; i < rows; i += LANES)
    for (size_t l = 0; l < LANES; l++) {
      y_row[i + l] += column[i + l] * x;
      dot[l] += column[i + l] * x_row[i + l];
    }
  return ((dot[0] + dot[4]) + (dot[1] + dot[5])) + ((dot[2] + dot[6]) + (dot[3] + dot[7]));
}

/* y_row += tile x_col, and y_col += tile' x_row unless the tile lies on the diagonal. */
static void multiply_tile(void *arg, size_t worker, const batten_saddle_tile *t) {
  const product *p = arg;
  size_t rows = (t->rows + LANES - 1) / LANES * LANES;
  for (size_t j = 0; j < t->cols; j++) {
    double *column = t->data + j * t->ld;
    for (size_t i = t->rows; i < rows; i++) column[i] = 0;
    for (size_t i = 0; p->absolute && i < rows; i++) column[i] = fabs(column[i]);
    for (size_t v = 0; v < p->m; v++) {
      const double *x = p->x + v * p->stride;
      double *y = p->sums + (worker * p->m + v) * p->stride;
      double dot = multiply_column(rows, column, x[t->col0 + j], x + t->row0, y + t->row0);
      if (t->row0 != t->col0) y[t->col0 + j] += dot;
    }
  }
}

size_t batten_saddle_product_bytes(size_t n, size_t m) {
  return (workers(n) + 1) * m * padded(n) * sizeof(double) + batten_saddle_walk_bytes(n);
}

batten_status batten_saddle_product(const batten_saddle *s, const char *phase, bool absolute, size_t m,
                                    const double *x, double *y) {
  size_t n = s->matrix.n, stride = padded(n), all = (workers(n) + 1) * m;
  double *block = batten_alloc_array(s->ctx, stride, all * sizeof *block);
  if (!block) return BATTEN_E_NOMEM;
  memset(block, 0, all * stride * sizeof *block);
  product p = {.m = m, .x = block, .sums = block + m * stride, .stride = stride, .absolute = absolute};
  for (size_t v = 0; v < m; v++)
    for (size_t i = 0; i < n; i++) block[v * stride + i] = absolute ? fabs(x[v * n + i]) : x[v * n + i];
  batten_status st = batten_saddle_walk(s, phase, NULL, false, multiply_tile, &p);
  if (st < 0) goto done;
  memset(y, 0, m * n * sizeof *y);
  for (size_t worker = 0; worker < workers(n); worker++)
    for (size_t v = 0; v < m; v++)
      for (size_t i = 0; i < n; i++) y[v * n + i] += p.sums[(worker * m + v) * stride + i];
done:
  batten_free(s->ctx, block);
  return st;
}
