/* Cholesky of block systems: which way is cheaper, and the band. A band after reverse Cuthill-McKee is for
 * long thin meshes; everything else is for the fronts, see fronts.h. */
#include "block.h"

#include <assert.h>
#include <string.h>

#include "base/checked.h"
#include "band.h"
#include "fronts.h"

typedef struct band {
  uint32_t *place; /* [rows] */
  size_t n, width; /* unknowns, diagonals beside the main one */
  double *factor;  /* [n][width + 1], see band.h */
  double *vector;  /* [n] */
} band;

struct block_plan {
  batten_context *ctx;
  block_method method;
  size_t rows;
  unsigned size;
  double flops;
  band band;
  block_fronts fronts;
  block_work work;
};

static double band_flops(size_t n, size_t width) { return (double)n * (double)(width + 1) * (double)(width + 1); }

/* As block_front_seconds, and fitted with it, to within a quarter: dense work, an entry that is cleared and filled, a
 * column. */
static double band_seconds(size_t n, size_t width) {
  const double FLOP = 2.2e-11, ENTRY = 1.8e-9, COLUMN = 1.4e-8;
  return FLOP * band_flops(n, width) + (double)n * (ENTRY * (double)(width + 1) + COLUMN);
}

static size_t band_width(unsigned size, size_t apart) { return size * apart + size - 1; }

static batten_status band_new(batten_context *ctx, size_t rows, unsigned size, const uint32_t *order, size_t apart,
                              band *out) {
  band b = {.n = rows * size, .width = band_width(size, apart)};
  if (!(b.place = batten_alloc_array(ctx, rows, sizeof *b.place)) ||
      !(b.vector = batten_alloc_array(ctx, b.n, sizeof *b.vector)) ||
      !(b.factor = batten_alloc_array(ctx, b.n, (b.width + 1) * sizeof *b.factor))) {
    batten_free(ctx, b.place);
    batten_free(ctx, b.vector);
    return BATTEN_E_NOMEM;
  }
  for (size_t p = 0; p < rows; p++) b.place[order[p]] = (uint32_t)p;
  *out = b;
  return BATTEN_OK;
}

/* 0, or 1 + the block row. */
static size_t band_factor(const block_matrix *a, band *b) {
  size_t size = a->size, ld = b->width + 1;
  memset(b->factor, 0, b->n * ld * sizeof *b->factor);
  for (size_t i = 0; i < a->rows; i++)
    for (size_t e = a->starts[i]; e < a->starts[i + 1]; e++) {
      size_t p = b->place[i], q = b->place[a->columns[e]];
      const double *block = a->values + e * size * size;
      if (q < p) continue;
      for (size_t r = 0; r < size; r++)
        for (size_t c = q == p ? r : 0; c < size; c++)
          b->factor[(p * size + r) * ld + (q - p) * size + c - r] = block[r * size + c];
    }
  size_t bad = sparse_band_cholesky(b->n, b->width, b->factor);
  for (size_t j = 0; j < b->n && !bad; j++) /* some BLAS let NaN pass */
    if (!isfinite(b->factor[j * ld])) bad = j + 1;
  for (size_t i = 0; bad && i < a->rows; i++)
    if (b->place[i] == (bad - 1) / size) return i + 1;
  return bad;
}

static void band_solve(const band *b, size_t rows, size_t size, double *x) {
  for (size_t i = 0; i < rows; i++) memcpy(b->vector + b->place[i] * size, x + i * size, size * sizeof *x);
  sparse_band_forward(b->n, b->width, b->factor, b->vector);
  sparse_band_backward(b->n, b->width, b->factor, b->vector);
  for (size_t i = 0; i < rows; i++) memcpy(x + i * size, b->vector + b->place[i] * size, size * sizeof *x);
}

/* Fronts after dissection, where these are cheaper than those at hand. */
static batten_status try_dissection(batten_context *ctx, const sparse_graph *g, block_plan *plan, uint32_t *order) {
  block_fronts fronts;
  batten_status st = sparse_order_dissection(ctx, g, order);
  if (st >= 0) st = block_fronts_new(ctx, g, plan->size, order, &fronts);
  if (st < 0) return st;
  if (fronts.seconds < plan->fronts.seconds) {
    block_fronts swap = plan->fronts;
    plan->fronts = fronts;
    fronts = swap;
  }
  block_fronts_free(ctx, &fronts);
  return BATTEN_OK;
}

/* Decides by predicted time; what is left of the fronts is that of the choice. */
static batten_status choose(batten_context *ctx, const block_matrix *a, block_plan *plan) {
  enum { DISSECTED = 500 }; /* rows: from here on dissection can win */
  batten_status st = BATTEN_E_NOMEM;
  sparse_graph g = {0};
  size_t apart = 0, rows = a->rows;
  uint32_t *in_band = batten_alloc_array(ctx, rows, sizeof *in_band), *order = NULL;
  if (!in_band) goto done;
  order = batten_alloc_array(ctx, rows, sizeof *order);
  if (!order) goto done;
  st = block_graph(ctx, a, &g);
  if (st >= 0 && plan->method != BLOCK_SUPERNODAL) st = sparse_order_band(ctx, &g, in_band, &apart);
  if (st >= 0 && plan->method != BLOCK_BAND) {
    st = sparse_order_degree(ctx, &g, order);
    if (st >= 0) st = block_graph(ctx, a, &g);
    if (st >= 0) st = block_fronts_new(ctx, &g, plan->size, order, &plan->fronts);
    if (st >= 0 && rows > DISSECTED && plan->method != BLOCK_QUICK) st = try_dissection(ctx, &g, plan, order);
  }
  if (st < 0) goto done;
  size_t n = rows * plan->size, width = band_width(plan->size, apart);
  if (plan->method == BLOCK_AUTO || plan->method == BLOCK_QUICK)
    plan->method = band_seconds(n, width) < plan->fronts.seconds ? BLOCK_BAND : BLOCK_SUPERNODAL;
  if (plan->method == BLOCK_BAND) {
    if (plan->fronts.order) block_fronts_free(ctx, &plan->fronts);
    plan->flops = band_flops(n, width);
    st = band_new(ctx, rows, plan->size, in_band, apart, &plan->band);
    goto done;
  }
  plan->flops = plan->fronts.flops;
  st = block_fronts_place(ctx, a, &plan->fronts);
  if (st >= 0) st = block_work_new(ctx, &plan->fronts, &plan->work);
done:
  sparse_graph_free(ctx, &g);
  batten_free(ctx, order);
  batten_free(ctx, in_band);
  return st;
}

batten_status block_plan_new(batten_context *ctx, const block_matrix *a, block_method method, block_plan **out) {
  block_plan *plan = batten_alloc(ctx, sizeof *plan);
  if (!plan) return BATTEN_E_NOMEM;
  *plan = (block_plan){.ctx = ctx, .method = method, .rows = a->rows, .size = a->size};
  batten_status st = choose(ctx, a, plan);
  if (st < 0)
    block_plan_free(ctx, plan);
  else
    *out = plan;
  return st;
}

void block_plan_free(batten_context *ctx, block_plan *plan) {
  if (!plan) return;
  batten_free(ctx, plan->band.place);
  batten_free(ctx, plan->band.vector);
  batten_free(ctx, plan->band.factor);
  block_work_free(ctx, &plan->work);
  block_fronts_free(ctx, &plan->fronts);
  batten_free(ctx, plan);
}

block_method block_plan_method(const block_plan *plan) { return plan->method; }
double block_plan_flops(const block_plan *plan) { return plan->flops; }

size_t block_plan_bytes(const block_plan *plan) {
  if (plan->method == BLOCK_SUPERNODAL)
    return sizeof *plan + block_fronts_bytes(&plan->fronts) + block_work_bytes(&plan->fronts, &plan->work);
  return sizeof *plan + plan->rows * sizeof(uint32_t) + plan->band.n * (plan->band.width + 2) * sizeof(double);
}

batten_status block_factor(batten_context *ctx, block_plan *plan, const block_matrix *a, size_t *row) {
  assert(a->rows == plan->rows && a->size == plan->size);
  size_t bad = plan->method == BLOCK_BAND ? band_factor(a, &plan->band)
                                          : block_fronts_factor(ctx, &plan->fronts, &plan->work, a);
  if (!bad) return BATTEN_OK;
  if (row) *row = bad - 1;
  return batten_fail(ctx, BATTEN_E_SINGULAR, "sparse system: not positive definite at row %zu of %zu", bad - 1,
                     plan->rows);
}

void block_solve(batten_context *ctx, const block_plan *plan, double *x) {
  (void)ctx;
  if (plan->method == BLOCK_BAND)
    band_solve(&plan->band, plan->rows, plan->size, x);
  else
    block_fronts_solve(&plan->fronts, &plan->work, x);
}
