/* Multifrontal Cholesky, the numbers [Duff, Reid 1983; Liu 1992]; see fronts.h.
 *
 * Subtrees that are small beside the whole are factored side by side, each by one thread with updates in a stack of
 * its own; the fronts above them one after the other, with the dense work of large ones in tiles on all threads. Both
 * partitions are made from sizes alone, so the threads change no bit. */
#include "fronts.h"

#include <assert.h>
#include <string.h>

#include "base/checked.h"
#include "la/la.h"
#include "rows.h"

/* ---- sharing out, and memory ---- */

/* Roots of the largest subtrees that take at most 1/SHARES of the time; none where threads cost more than they save.
 */
static void share_out(const block_fronts *f, double *seconds, block_work *w) {
  const double SHARES = 12, WORTH_S = 1.5e-4;
  w->part_count = 0;
  memset(w->inside, 0, f->count);
  if (f->seconds < WORTH_S) return;
  for (size_t s = 0; s < f->count; s++) seconds[s] = 0;
  for (size_t s = 0; s < f->count; s++) {
    double own = (double)(block_front_own(f, s) * f->size), below = (double)(block_front_below(f, s) * f->size);
    seconds[s] += block_front_seconds(own, below);
    if (f->parent[s] != UINT32_MAX) seconds[f->parent[s]] += seconds[s];
  }
  double limit = f->seconds / SHARES;
  for (size_t s = 0; s < f->count; s++) {
    if (seconds[s] > limit || (f->parent[s] != UINT32_MAX && seconds[f->parent[s]] <= limit)) continue;
    w->part[w->part_count++] = (uint32_t)s;
    memset(w->inside + s + 1 - f->subtree[s], 1, f->subtree[s]);
  }
}

/* Places for the updates: a stack for each part, and one for what is above. A front is formed on top of its
 * children's updates; what it leaves to its parent then moves down to where they began. False: too large. */
static bool stack_updates(const block_fronts *f, block_work *w) {
  size_t at = 0, part = 0, height = 0, top_height = 0, top_room = 0;
  for (size_t s = 0; s < f->count; s++) w->update[s] = SIZE_MAX;
  for (size_t s = 0; s < f->count; s++) {
    bool inside = w->inside[s];
    if (inside && s == w->part[part] + 1 - f->subtree[w->part[part]]) height = 0;
    size_t *top = inside ? &height : &top_height, square, room;
    size_t below = block_front_below(f, s) * f->size, start = w->update[s] == SIZE_MAX ? *top : w->update[s];
    if (!batten_mul(below, below, &square) || !batten_add(*top, square, &room)) return false;
    w->scratch[s] = *top;
    w->update[s] = start;
    *top = start + square;
    uint32_t up = f->parent[s];
    if (up != UINT32_MAX && w->inside[up] == inside && start < w->update[up]) w->update[up] = start;
    if (!inside) {
      if (room > top_room) top_room = room;
      continue;
    }
    uint32_t root = w->part[part];
    size_t *needed = &w->room; /* of this part so far */
    if (room > *needed) *needed = room;
    if (s < root) continue;
    for (size_t t = root + 1 - f->subtree[root]; t <= root; t++) {
      w->update[t] += at;
      w->scratch[t] += at;
    }
    if (!batten_add(at, *needed, &at)) return false;
    *needed = 0;
    part++;
  }
  for (size_t s = 0; s < f->count; s++)
    if (!w->inside[s]) {
      w->update[s] += at;
      w->scratch[s] += at;
    }
  return batten_add(at, top_room, &w->room);
}

batten_status block_work_new(batten_context *ctx, const block_fronts *f, block_work *out) {
  batten_status st = BATTEN_E_NOMEM;
  block_work w = {0};
  double *seconds = batten_alloc_array(ctx, f->count, sizeof *seconds);
  if (!seconds || !(w.part = batten_alloc_array(ctx, f->count, sizeof *w.part)) ||
      !(w.inside = batten_alloc(ctx, f->count)) ||
      !(w.failed = batten_alloc_array(ctx, f->count, sizeof *w.failed)) ||
      !(w.update = batten_alloc_array(ctx, f->count, sizeof *w.update)) ||
      !(w.scratch = batten_alloc_array(ctx, f->count, sizeof *w.scratch)))
    goto done;
  share_out(f, seconds, &w);
  if (!stack_updates(f, &w)) {
    st = batten_fail(ctx, BATTEN_E_TOO_LARGE, "sparse system: fronts of up to %zu unknowns", f->height_most);
    goto done;
  }
  if (!(w.factor = batten_alloc_array(ctx, f->panel[f->count], sizeof *w.factor)) ||
      !(w.updates = batten_alloc_array(ctx, w.room, sizeof *w.updates)) ||
      !(w.vector = batten_alloc_array(ctx, f->nodes, f->size * sizeof *w.vector)) ||
      !(w.front = batten_alloc_array(ctx, f->height_most, sizeof *w.front)))
    goto done;
  st = BATTEN_OK;
done:
  batten_free(ctx, seconds);
  if (st < 0)
    block_work_free(ctx, &w);
  else
    *out = w;
  return st;
}

void block_work_free(batten_context *ctx, block_work *w) {
  batten_free(ctx, w->part);
  batten_free(ctx, w->inside);
  batten_free(ctx, w->failed);
  batten_free(ctx, w->update);
  batten_free(ctx, w->scratch);
  batten_free(ctx, w->factor);
  batten_free(ctx, w->updates);
  batten_free(ctx, w->vector);
  batten_free(ctx, w->front);
  *w = (block_work){0};
}

size_t block_work_bytes(const block_fronts *f, const block_work *w) {
  return f->count * (sizeof *w->part + 1 + 3 * sizeof *w->update) +
         (f->panel[f->count] + w->room + f->nodes * f->size + f->height_most) * sizeof(double);
}

/* ---- dense work of a front ---- */

enum { TILE = 160 }; /* columns and rows of a tile: 20 rows of a tile fit the first cache, a tile the second */

typedef struct dense_front {
  double *panel, *update; /* [height][own], [below][below], columns of length height, below */
  size_t height, own, below;
  size_t from, to; /* the columns of the step */
} dense_front;

static size_t tiles(size_t length) { return (length + TILE - 1) / TILE; }
static size_t least(size_t a, size_t b) { return a < b ? a : b; }

/* Rows of the step's columns below its triangle. */
static void divide_tile(void *arg, size_t index) {
  const dense_front *d = arg;
  size_t row = d->to + index * TILE, rows = least(TILE, d->height - row), ld = d->height;
  batten_la_trsm(BATTEN_LA_DOUBLE, 'R', 'L', 'T', rows, d->to - d->from, 1, d->panel + d->from * ld + d->from, ld,
                 d->panel + d->from * ld + row, ld);
}

/* Own columns to the right of the step, less what the step takes off. */
static void subtract_tile(void *arg, size_t index) {
  const dense_front *d = arg;
  size_t ld = d->height, wide = d->to - d->from, column = d->to + index * TILE;
  size_t columns = least(TILE, d->own - column), end = column + columns;
  const double *l = d->panel + d->from * ld;
  batten_la_syrk(BATTEN_LA_DOUBLE, 'L', 'N', columns, wide, -1, l + column, ld, 1, d->panel + column * ld + column,
                 ld);
  batten_la_gemm(BATTEN_LA_DOUBLE, 'N', 'T', d->height - end, columns, wide, -1, l + end, ld, l + column, ld, 1,
                 d->panel + column * ld + end, ld);
}

/* The update before its children's are added. */
static void update_tile(void *arg, size_t index) {
  const dense_front *d = arg;
  size_t ld = d->height, column = index * TILE, columns = least(TILE, d->below - column), end = column + columns;
  const double *l = d->panel + d->own;
  batten_la_syrk(BATTEN_LA_DOUBLE, 'L', 'N', columns, d->own, -1, l + column, ld, 0,
                 d->update + column * d->below + column, d->below);
  batten_la_gemm(BATTEN_LA_DOUBLE, 'N', 'T', d->below - end, columns, d->own, -1, l + end, ld, l + column, ld, 0,
                 d->update + column * d->below + end, d->below);
}

static void run_tiles(batten_context *ctx, size_t count, void (*tile)(void *arg, size_t index), dense_front *d) {
  if (ctx) {
    batten_parallel(ctx, count, tile, d);
    return;
  }
  for (size_t i = 0; i < count; i++) tile(d, i);
}

/* to -= sum of f[c] columns[c] over four columns. */
static void subtract_four(size_t count, const double f[4], const double *restrict columns, size_t ld,
                          double *restrict to) {
  const double *restrict a = columns, *restrict b = a + ld, *restrict c = b + ld, *restrict d = c + ld;
  for (size_t i = 0; i < count; i++) to[i] -= (f[0] * a[i] + f[1] * b[i]) + (f[2] * c[i] + f[3] * d[i]);
}

static void subtract_one(size_t count, double f, const double *restrict column, double *restrict to) {
  for (size_t i = 0; i < count; i++) to[i] -= f * column[i];
}

/* to [count] -= what columns from .. end - 1 of the panel, at this row and below, take off of the column that belongs
 * to the row. */
static void subtract_columns(const dense_front *d, size_t row, size_t from, size_t end, double *to) {
  size_t ld = d->height, count = ld - row;
  for (; from + 4 <= end; from += 4) {
    const double *l = d->panel + from * ld + row, f[4] = {l[0], l[ld], l[2 * ld], l[3 * ld]};
    subtract_four(count, f, l, ld, to);
  }
  for (; from < end; from++) subtract_one(count, d->panel[from * ld + row], d->panel + from * ld + row, to);
}

/* Columns from .. to - 1 of the panel, which lack what they take off of each other; 0, or the 1-based row of the
 * pivot that is not positive. */
static size_t factor_columns(const dense_front *d) {
  for (size_t j = d->from; j < d->to; j++) {
    double *column = d->panel + j * (d->height + 1);
    subtract_columns(d, j, d->from, j, column);
    if (!(column[0] > 0) || !isfinite(column[0])) return j + 1;
    column[0] = sqrt(column[0]);
    double inverse = 1 / column[0];
    for (size_t i = 1; i < d->height - j; i++) column[i] *= inverse;
  }
  return 0;
}

/* A small front, panel and update, by loops of our own: a call of BLAS costs more than a small front, far more where
 * BLAS wakes its threads for it. */
static size_t factor_small(dense_front *d) {
  d->from = 0;
  d->to = d->own;
  size_t bad = factor_columns(d);
  if (bad) return bad;
  for (size_t j = 0; j < d->below; j++) {
    double *column = d->update + j * (d->below + 1);
    memset(column, 0, (d->below - j) * sizeof *column);
    subtract_columns(d, d->own + j, 0, d->own, column);
  }
  return 0;
}

/* Rows and columns of the front from `row` to `end` - 1, less what the step takes off; the diagonal tiles whole, what
 * is above the diagonal is never read. `to`: where (row, row) is. */
static void subtract_tiles(const dense_front *d, size_t row, size_t end, double beta, double *to, size_t ld) {
  enum { ROWS = 128, COLUMNS = 64 };
  const double *l = d->panel + d->from * d->height;
  size_t wide = d->to - d->from;
  for (size_t column = row; column < end; column += COLUMNS)
    for (size_t i = column; i < d->height; i += ROWS)
      batten_la_gemm(BATTEN_LA_DOUBLE, 'N', 'T', least(ROWS, d->height - i), least(COLUMNS, end - column), wide, -1,
                     l + i, d->height, l + column, d->height, beta, to + (column - row) * ld + (i - row), ld);
}

/* Fronts of middle size: narrow steps by loops of our own, the rest by products so small (128 x 64 x 32) that BLAS
 * does not wake its threads, which costs more than they save and keeps the other tasks waiting. */
static size_t factor_middle(dense_front *d) {
  enum { STEP = 32 };
  for (d->from = 0; d->from < d->own; d->from = d->to) {
    d->to = least(d->own, d->from + STEP);
    size_t bad = factor_columns(d);
    if (bad) return bad;
    subtract_tiles(d, d->to, d->own, 1, d->panel + d->to * (d->height + 1), d->height);
    subtract_tiles(d, d->own, d->height, d->from == 0 ? 0 : 1, d->update, d->below);
  }
  return 0;
}

/* Factor of the panel and the update that it leaves. 0, or the 1-based row of the pivot that is not positive. ctx
 * NULL: on this thread. */
static size_t factor_dense(batten_context *ctx, dense_front *d) {
  for (d->from = 0; d->from < d->own; d->from = d->to) {
    d->to = least(d->own, d->from + TILE);
    size_t bad =
        batten_la_potrf(BATTEN_LA_DOUBLE, 'L', d->to - d->from, d->panel + d->from * (d->height + 1), d->height);
    for (size_t j = d->from; j < d->to && !bad; j++) /* some BLAS let NaN pass */
      if (!isfinite(d->panel[j * (d->height + 1)])) bad = j - d->from + 1;
    if (bad) return d->from + bad;
    run_tiles(ctx, tiles(d->height - d->to), divide_tile, d);
    run_tiles(ctx, tiles(d->own - d->to), subtract_tile, d);
  }
  run_tiles(ctx, tiles(d->below), update_tile, d);
  return 0;
}

/* ---- fronts ---- */

typedef struct factoring {
  const block_fronts *f;
  const block_work *w;
  const block_matrix *a;
} factoring;

/* The matrix's blocks into the panel, whose columns are rows of a block. */
BLOCK_INLINE int scatter(unsigned size, const block_fronts *f, size_t s, const double *values, double *factor) {
  size_t ld = block_front_height(f, s);
  for (size_t e = f->entry_starts[s]; e < f->entry_starts[s + 1]; e++) {
    const double *block = values + f->entries[e] * size * size;
    double *to = factor + f->targets[e];
    for (unsigned q = 0; q < size; q++)
      for (unsigned p = 0; p < size; p++) to[q * ld + p] = block[q * size + p];
  }
  return 0;
}

/* Columns first .. last - 1 (in nodes) of the child's update added to the parent's columns: `to` is where row and
 * column `base` of the parent's front are. Both by lower triangles. */
BLOCK_INLINE int add_columns(unsigned size, const uint32_t *relative, size_t below, size_t first, size_t last,
                             const double *from, double *to, size_t ld, size_t base) {
  size_t from_ld = below * size;
  for (size_t j = first; j < last; j++) {
    const double *column = from + j * size * (from_ld + 1);
    double *target = to + (relative[j] - base) * size * ld, *corner = target + (relative[j] - base) * size;
    for (unsigned q = 0; q < size; q++)
      for (unsigned p = q; p < size; p++) corner[q * ld + p] += column[q * from_ld + p];
    for (size_t i = j + 1; i < below; i++) {
      const double *block = column + (i - j) * size;
      double *place = target + (relative[i] - base) * size;
      for (unsigned q = 0; q < size; q++)
        for (unsigned p = 0; p < size; p++) place[q * ld + p] += block[q * from_ld + p];
    }
  }
  return 0;
}

/* Of all children, what goes to the panel of s, or what goes to its update. */
static void add_children(const factoring *k, size_t s, bool to_panel, double *to, size_t ld) {
  const block_fronts *f = k->f;
  size_t own = block_front_own(f, s), base = to_panel ? 0 : own;
  for (size_t c = s - 1, left = f->subtree[s] - 1; left > 0; left -= f->subtree[c], c -= f->subtree[c]) {
    const uint32_t *relative = f->relative + f->row_starts[c];
    size_t below = block_front_below(f, c), split = 0;
    while (split < below && relative[split] < own) split++;
    const double *from = k->w->updates + k->w->update[c];
    size_t first = to_panel ? 0 : split, last = to_panel ? split : below;
    BLOCK_FOR_SIZE(f->size, add_columns, relative, below, first, last, from, to, ld, base);
  }
}

static size_t factor_front(batten_context *ctx, const factoring *k, size_t s) {
  const double SMALL_FLOPS = 6e4, PARALLEL_FLOPS = 1e7; /* 3 us, a third of a millisecond */
  const block_fronts *f = k->f;
  const block_work *w = k->w;
  size_t own = block_front_own(f, s) * f->size, below = block_front_below(f, s) * f->size, height = own + below;
  double *panel = w->factor + f->panel[s], *update = w->updates + w->scratch[s];
  memset(panel, 0, height * own * sizeof *panel);
  BLOCK_FOR_SIZE(f->size, scatter, f, s, k->a->values, w->factor);
  add_children(k, s, true, panel, height);
  dense_front d = {.panel = panel, .update = update, .height = height, .own = own, .below = below};
  double flops = block_front_flops((double)own, (double)below);
  size_t bad = flops < SMALL_FLOPS      ? factor_small(&d)
               : flops < PARALLEL_FLOPS ? factor_middle(&d)
                                        : factor_dense(ctx, &d);
  if (bad) return 1 + f->order[f->first[s] + (bad - 1) / f->size];
  add_children(k, s, false, update, below);
  if (w->update[s] != w->scratch[s]) memmove(w->updates + w->update[s], update, below * below * sizeof *update);
  return 0;
}

static void factor_part(void *arg, size_t index) {
  const factoring *k = arg;
  size_t root = k->w->part[index], bad = 0;
  for (size_t s = root + 1 - k->f->subtree[root]; s <= root && !bad; s++) bad = factor_front(NULL, k, s);
  k->w->failed[index] = bad;
}

size_t block_fronts_factor(batten_context *ctx, const block_fronts *f, block_work *w, const block_matrix *a) {
  factoring k = {f, w, a};
  size_t bad = 0;
  batten_parallel(ctx, w->part_count, factor_part, &k);
  for (size_t i = 0; i < w->part_count && !bad; i++) bad = w->failed[i];
  for (size_t s = 0; s < f->count && !bad; s++)
    if (!w->inside[s]) bad = factor_front(ctx, &k, s);
  return bad;
}

/* ---- solves ---- */

/* v := L^-1 v on the first `own` of `height` numbers, the others less what those take off: two columns at a time. */
static void forward(const double *l, size_t height, size_t own, double *restrict v) {
  size_t j = 0;
  for (; j + 2 <= own; j += 2) {
    const double *restrict a = l + j * height, *restrict b = a + height;
    double x = v[j] / a[j], y = (v[j + 1] - x * a[j + 1]) / b[j + 1];
    v[j] = x;
    v[j + 1] = y;
    for (size_t i = j + 2; i < height; i++) v[i] -= x * a[i] + y * b[i];
  }
  if (j < own) {
    const double *restrict a = l + j * height;
    double x = v[j] /= a[j];
    for (size_t i = j + 1; i < height; i++) v[i] -= x * a[i];
  }
}

/* The first `own` numbers of v := L^-T (v less what the others take off). */
static void backward(const double *l, size_t height, size_t own, double *restrict v) {
  for (size_t j = own; j-- > 0;) {
    const double *restrict a = l + j * height;
    double s[4] = {0};
    size_t i = j + 1;
    for (; i + 4 <= height; i += 4)
      for (int c = 0; c < 4; c++) s[c] += a[i + (size_t)c] * v[i + (size_t)c];
    for (; i < height; i++) s[0] += a[i] * v[i];
    v[j] = (v[j] - ((s[0] + s[1]) + (s[2] + s[3]))) / a[j];
  }
}

void block_fronts_solve(const block_fronts *f, const block_work *w, double *x) {
  size_t size = f->size;
  double *v = w->front, *y = w->vector;
  for (size_t p = 0; p < f->nodes; p++) memcpy(y + p * size, x + f->order[p] * size, size * sizeof *y);
  for (size_t s = 0; s < f->count; s++) {
    size_t own = block_front_own(f, s) * size, height = block_front_height(f, s);
    double *to = v + own;
    memcpy(v, y + f->first[s] * size, own * sizeof *v);
    memset(to, 0, (height - own) * sizeof *v);
    forward(w->factor + f->panel[s], height, own, v);
    memcpy(y + f->first[s] * size, v, own * sizeof *v);
    for (size_t e = f->row_starts[s]; e < f->row_starts[s + 1]; e++)
      for (size_t p = 0; p < size; p++) y[f->rows[e] * size + p] += *to++;
  }
  for (size_t s = f->count; s-- > 0;) {
    size_t own = block_front_own(f, s) * size;
    double *to = v + own;
    memcpy(v, y + f->first[s] * size, own * sizeof *v);
    for (size_t e = f->row_starts[s]; e < f->row_starts[s + 1]; e++)
      for (size_t p = 0; p < size; p++) *to++ = y[f->rows[e] * size + p];
    backward(w->factor + f->panel[s], block_front_height(f, s), own, v);
    memcpy(y + f->first[s] * size, v, own * sizeof *v);
  }
  for (size_t p = 0; p < f->nodes; p++) memcpy(x + f->order[p] * size, y + p * size, size * sizeof *y);
}
