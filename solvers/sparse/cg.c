/* Conjugate gradients with the inverses of the diagonal blocks [Hestenes, Stiefel 1952; Golub, Van Loan, Matrix
 * Computations, 11.5].
 *
 * Three passes over memory an iteration: A p with p'A p; the step with the new residual, its product z with the
 * inverses and r'z; the next p. Each part of the rows sums on its own, the parts are added up in their order. The
 * residual of the recurrence drifts from the true one, so that is formed when the recurrence says that it is done,
 * and the iteration begins again from it as long as that pays. */
#include "block.h"

#include <string.h>

#include "base/checked.h"
#include "rows.h"

BLOCK_INLINE double rows_apply(unsigned size, const block_matrix *a, size_t first, size_t last, const double *x,
                               double *y) {
  double product = 0;
  for (size_t i = first; i < last; i++) {
    double sum[BLOCK_SIZE_MAX] = {0}, share = 0;
    for (size_t e = a->starts[i]; e < a->starts[i + 1]; e++) {
      const double *block = a->values + e * size * size, *from = x + (size_t)a->columns[e] * size;
      for (unsigned p = 0; p < size; p++)
        for (unsigned q = 0; q < size; q++) sum[p] += block[p * size + q] * from[q];
    }
    for (unsigned p = 0; p < size; p++) {
      y[i * size + p] = sum[p];
      share += sum[p] * x[i * size + p];
    }
    product += share;
  }
  return product;
}

double block_rows_apply(const block_matrix *a, size_t first, size_t last, const double *x, double *y) {
  return BLOCK_FOR_SIZE(a->size, rows_apply, a, first, last, x, y);
}

/* inverse [size][size] of a symmetric positive definite block, by its Cholesky factor; false: not definite. */
static bool invert(unsigned size, const double *block, double *inverse) {
  double l[BLOCK_SIZE_MAX][BLOCK_SIZE_MAX] = {{0}}, m[BLOCK_SIZE_MAX][BLOCK_SIZE_MAX] = {{0}}; /* m = l^-1 */
  for (unsigned j = 0; j < size; j++) {
    double pivot = block[j * size + j];
    for (unsigned k = 0; k < j; k++) pivot -= l[j][k] * l[j][k];
    if (!(pivot > 0) || !isfinite(pivot)) return false;
    l[j][j] = sqrt(pivot);
    for (unsigned i = j + 1; i < size; i++) {
      double sum = block[i * size + j];
      for (unsigned k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
      l[i][j] = sum / l[j][j];
    }
  }
  for (unsigned j = 0; j < size; j++) {
    m[j][j] = 1 / l[j][j];
    for (unsigned i = j + 1; i < size; i++) {
      double sum = 0;
      for (unsigned k = j; k < i; k++) sum -= l[i][k] * m[k][j];
      m[i][j] = sum / l[i][i];
    }
  }
  for (unsigned i = 0; i < size; i++)
    for (unsigned j = 0; j <= i; j++) {
      double sum = 0;
      for (unsigned k = i; k < size; k++) sum += m[k][i] * m[k][j];
      inverse[i * size + j] = inverse[j * size + i] = sum;
    }
  return true;
}

typedef struct descent {
  const block_matrix *a;
  const double *b;
  double *x, *r, *p, *y; /* y: A p, then z = D^-1 r */
  double *inverse;       /* [rows][size][size] of the diagonal blocks */
  double *share;         /* [parts] of the sum of the pass */
  size_t *bad;           /* [parts] first row whose diagonal block is not definite, or SIZE_MAX */
  double step, mix;
} descent;

static double total(batten_context *ctx, descent *d, void (*pass)(void *arg, size_t index)) {
  size_t parts = block_parts(d->a);
  batten_parallel(ctx, parts, pass, d);
  double sum = 0;
  for (size_t i = 0; i < parts; i++) sum += d->share[i];
  return sum;
}

static void prepare_part(void *arg, size_t index) {
  descent *d = arg;
  size_t first, last, square = (size_t)d->a->size * d->a->size;
  block_part(d->a, index, &first, &last);
  d->bad[index] = SIZE_MAX;
  for (size_t i = first; i < last && d->bad[index] == SIZE_MAX; i++)
    if (!invert(d->a->size, block_matrix_at(d->a, i, i), d->inverse + i * square)) d->bad[index] = i;
}

/* to := D^-1 from; returns from'to. */
BLOCK_INLINE double precondition(unsigned size, const double *inverse, size_t first, size_t last, const double *from,
                                 double *to) {
  double product = 0;
  for (size_t i = first; i < last; i++) {
    const double *block = inverse + i * size * size;
    double share = 0;
    for (unsigned p = 0; p < size; p++) {
      double sum = 0;
      for (unsigned q = 0; q < size; q++) sum += block[p * size + q] * from[i * size + q];
      to[i * size + p] = sum;
      share += sum * from[i * size + p];
    }
    product += share;
  }
  return product;
}

/* b'D^-1 b. */
static void norm_part(void *arg, size_t index) {
  descent *d = arg;
  size_t first, last;
  block_part(d->a, index, &first, &last);
  d->share[index] = BLOCK_FOR_SIZE(d->a->size, precondition, d->inverse, first, last, d->b, d->y);
}

/* r = b - A x, y = D^-1 r, r'y. */
static void residual_part(void *arg, size_t index) {
  descent *d = arg;
  size_t first, last;
  block_part(d->a, index, &first, &last);
  block_rows_apply(d->a, first, last, d->x, d->r);
  for (size_t k = first * d->a->size; k < last * d->a->size; k++) d->r[k] = d->b[k] - d->r[k];
  d->share[index] = BLOCK_FOR_SIZE(d->a->size, precondition, d->inverse, first, last, d->r, d->y);
}

static void product_part(void *arg, size_t index) {
  descent *d = arg;
  size_t first, last;
  block_part(d->a, index, &first, &last);
  d->share[index] = block_rows_apply(d->a, first, last, d->p, d->y);
}

BLOCK_INLINE double step_rows(unsigned size, descent *d, size_t first, size_t last) {
  double step = d->step, *x = d->x, *r = d->r;
  for (size_t k = first * size; k < last * size; k++) {
    x[k] += step * d->p[k];
    r[k] -= step * d->y[k];
  }
  return precondition(size, d->inverse, first, last, r, d->y);
}

static void step_part(void *arg, size_t index) {
  descent *d = arg;
  size_t first, last;
  enum { CACHED = 512 }; /* unknowns: their vectors stay in the first cache between the loops */
  block_part(d->a, index, &first, &last);
  double sum = 0;
  for (size_t from = first, to; from < last; from = to) {
    to = last - from > CACHED / BLOCK_SIZE_MAX ? from + CACHED / BLOCK_SIZE_MAX : last;
    sum += BLOCK_FOR_SIZE(d->a->size, step_rows, d, from, to);
  }
  d->share[index] = sum;
}

static void turn_part(void *arg, size_t index) {
  descent *d = arg;
  size_t first, last;
  block_part(d->a, index, &first, &last);
  double mix = d->mix, *p = d->p;
  for (size_t k = first * d->a->size; k < last * d->a->size; k++) p[k] = d->y[k] + mix * p[k];
}

/* Share of the digits asked for that is reached: residual squared, from start to goal. */
static double reached(double start, double now, double goal) {
  double share = start > goal && now > 0 ? log(start / now) / log(start / goal) : 1;
  return share < 0 ? 0 : share > 1 ? 1 : share;
}

/* From the residual in hand, rr = r'D^-1 r, until the recurrence's is down at goal or `most` iterations are done. */
static batten_status descend(batten_context *ctx, descent *d, double rr, double start, double goal, size_t most,
                             const char *phase, size_t *iterations) {
  size_t parts = block_parts(d->a);
  d->mix = 0;
  memset(d->p, 0, d->a->rows * d->a->size * sizeof *d->p);
  while (rr > goal && *iterations < most) {
    batten_status st = batten_progress(ctx, phase, reached(start, rr, goal));
    if (st < 0) return st;
    batten_parallel(ctx, parts, turn_part, d);
    double curvature = total(ctx, d, product_part);
    if (!(curvature > 0) || !isfinite(curvature))
      return batten_fail(ctx, BATTEN_E_SINGULAR, "%s: matrix not positive definite after %zu iterations", phase,
                         *iterations);
    d->step = rr / curvature;
    double next = total(ctx, d, step_part);
    d->mix = next / rr;
    rr = next;
    ++*iterations;
  }
  return BATTEN_OK;
}

/* Memory for the vectors: false when refused. */
static bool take(batten_context *ctx, const block_matrix *a, descent *d) {
  size_t n = a->rows * a->size, parts = block_parts(a);
  d->r = batten_alloc_array(ctx, n, sizeof *d->r);
  d->p = d->r ? batten_alloc_array(ctx, n, sizeof *d->p) : NULL;
  d->y = d->p ? batten_alloc_array(ctx, n, sizeof *d->y) : NULL;
  d->inverse = d->y ? batten_alloc_array(ctx, n, a->size * sizeof *d->inverse) : NULL;
  d->share = d->inverse ? batten_alloc_array(ctx, parts, sizeof *d->share) : NULL;
  d->bad = d->share ? batten_alloc_array(ctx, parts, sizeof *d->bad) : NULL;
  return d->bad != NULL;
}

static void give_back(batten_context *ctx, descent *d) {
  batten_free(ctx, d->bad);
  batten_free(ctx, d->share);
  batten_free(ctx, d->inverse);
  batten_free(ctx, d->y);
  batten_free(ctx, d->p);
  batten_free(ctx, d->r);
}

batten_status block_cg(batten_context *ctx, const block_matrix *a, const double *b, double tolerance, size_t most,
                       const char *phase, double *x, block_cg_figures *figures) {
  descent d = {.a = a, .b = b, .x = x};
  block_cg_figures done = {0};
  size_t parts = block_parts(a);
  batten_status st = take(ctx, a, &d) ? BATTEN_OK : BATTEN_E_NOMEM;
  if (st < 0) goto out;
  batten_parallel(ctx, parts, prepare_part, &d);
  for (size_t i = 0; i < parts && st == BATTEN_OK; i++)
    if (d.bad[i] != SIZE_MAX)
      st = batten_fail(ctx, BATTEN_E_SINGULAR, "%s: diagonal block %zu is not positive definite", phase, d.bad[i]);
  if (st < 0) goto out;
  double bb = total(ctx, &d, norm_part), goal = tolerance * tolerance * bb;
  if (bb == 0) {
    memset(x, 0, a->rows * a->size * sizeof *x);
    *figures = done;
    goto out;
  }
  double start = total(ctx, &d, residual_part), rr = start;
  while (rr > goal && done.iterations < most) {
    double before = rr;
    st = descend(ctx, &d, rr, start, goal, most, phase, &done.iterations);
    if (st < 0) goto out;
    rr = total(ctx, &d, residual_part);
    if (!(rr < before / 4)) break; /* rounding keeps it where it is */
  }
  done.residual = sqrt(rr / bb);
  *figures = done;
  if (!(rr <= goal))
    st = batten_fail(ctx, BATTEN_W_ACCURACY, "%s: residual %.3g after %zu iterations, wanted %.3g", phase,
                     done.residual, done.iterations, tolerance);
out:
  give_back(ctx, &d);
  return st;
}
