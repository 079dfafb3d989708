/* Level-3 BLAS on a triangle in rectangular full packed storage, see rfp.h. */
#include "rfp.h"

#include <math.h>

#include "base/checked.h"

/* Columns factored between two progress calls, measured from 256 to 2048: at 1024 the matrix products run at full
 * speed, 7 % ahead of 512 in float; less than 0.1 s of work up to n = 4000. */
enum { BLOCK = 1024 };

bool batten_rfp_count(size_t n, size_t *count) {
  bool even = n % 2 == 0;
  return batten_mul(even ? n / 2 : n, even ? n + 1 : (n + 1) / 2, count);
}

batten_rfp batten_rfp_view(batten_la_real real, size_t n, void *storage) {
  bool even = n % 2 == 0;
  batten_rfp b = {.real = real, .n = n, .n1 = n - n / 2, .n2 = n / 2, .ld = even ? n + 1 : n};
  b.b11 = batten_la_at(real, storage, even ? 1 : 0);
  b.b21 = batten_la_at(real, b.b11, b.n1);
  b.b22 = batten_la_at(real, storage, even ? 0 : n);
  return b;
}

/* Element (i, j) of the trapezoid [B11; B21], and of the upper triangle B22. */
static void *low(const batten_rfp *b, size_t i, size_t j) { return batten_la_at(b->real, b->b11, i + j * b->ld); }
static void *high(const batten_rfp *b, size_t i, size_t j) { return batten_la_at(b->real, b->b22, i + j * b->ld); }

/* ---- Norm ---- */

/* Adds |a[i]| to sums[i] and returns the sum of all. */
static double add_absolute(batten_la_real real, size_t count, const void *a, double *sums) {
  double total = 0;
  if (real == BATTEN_LA_DOUBLE) {
    const double *d = a;
    for (size_t i = 0; i < count; i++) sums[i] += fabs(d[i]), total += fabs(d[i]);
  } else {
    const float *f = a;
    for (size_t i = 0; i < count; i++) sums[i] += fabs((double)f[i]), total += fabs((double)f[i]);
  }
  return total;
}

static double absolute(batten_la_real real, const void *a) {
  return real == BATTEN_LA_DOUBLE ? fabs(*(const double *)a) : fabs((double)*(const float *)a);
}

double batten_rfp_norm1(const batten_rfp *b, double *sums) {
  for (size_t i = 0; i < b->n; i++) sums[i] = 0;
  for (size_t j = 0; j < b->n1; j++) {
    sums[j] += absolute(b->real, low(b, j, j));
    sums[j] += add_absolute(b->real, b->n - j - 1, low(b, j + 1, j), sums + j + 1);
  }
  for (size_t j = 0; j < b->n2; j++) {
    sums[b->n1 + j] += add_absolute(b->real, j, high(b, 0, j), sums + b->n1);
    sums[b->n1 + j] += absolute(b->real, high(b, j, j));
  }
  double norm = 0;
  for (size_t i = 0; i < b->n; i++) norm = fmax(norm, sums[i]);
  return norm;
}

/* ---- Cholesky ---- */

/* Left-looking by blocks of columns: each block is updated by all columns before it in one large product, then
 * factored, then the rows below it are solved. Blocks of B22 are block rows of its upper triangle. */
static size_t factor_low(const batten_rfp *b, size_t j, size_t width) {
  size_t below = b->n - j - width;
  batten_la_syrk(b->real, 'L', 'N', width, j, -1, low(b, j, 0), b->ld, 1, low(b, j, j), b->ld);
  size_t info = batten_la_potrf(b->real, 'L', width, low(b, j, j), b->ld);
  if (info > 0) return j + info;
  if (below == 0) return 0;
  batten_la_gemm(b->real, 'N', 'T', below, width, j, -1, low(b, j + width, 0), b->ld, low(b, j, 0), b->ld, 1,
                 low(b, j + width, j), b->ld);
  batten_la_trsm(b->real, 'R', 'L', 'T', below, width, 1, low(b, j, j), b->ld, low(b, j + width, j), b->ld);
  return 0;
}

static size_t factor_high(const batten_rfp *b, size_t j, size_t width) {
  size_t n1 = b->n1, right = b->n2 - j - width;
  const void *row = low(b, n1 + j, 0);
  batten_la_syrk(b->real, 'U', 'N', width, n1, -1, row, b->ld, 1, high(b, j, j), b->ld);
  batten_la_syrk(b->real, 'U', 'T', width, j, -1, high(b, 0, j), b->ld, 1, high(b, j, j), b->ld);
  size_t info = batten_la_potrf(b->real, 'U', width, high(b, j, j), b->ld);
  if (info > 0) return n1 + j + info;
  if (right == 0) return 0;
  void *rest = high(b, j, j + width);
  batten_la_gemm(b->real, 'N', 'T', width, right, n1, -1, row, b->ld, low(b, n1 + j + width, 0), b->ld, 1, rest,
                 b->ld);
  batten_la_gemm(b->real, 'T', 'N', width, right, j, -1, high(b, 0, j), b->ld, high(b, 0, j + width), b->ld, 1, rest,
                 b->ld);
  batten_la_trsm(b->real, 'L', 'U', 'T', width, right, 1, high(b, j, j), b->ld, rest, b->ld);
  return 0;
}

batten_status batten_rfp_cholesky(batten_context *ctx, const batten_rfp *b, size_t *failed) {
  *failed = 0;
  for (size_t done = 0; done < b->n;) {
    /* The columns before `done` cost this part of all: 1 - (1 - done / n)^3. */
    double left = 1 - (double)done / (double)b->n;
    batten_status st = batten_progress(ctx, "factor", 1 - left * left * left);
    if (st < 0) return st;
    bool in_low = done < b->n1;
    size_t most = (in_low ? b->n1 : b->n) - done, width = most < BLOCK ? most : BLOCK;
    *failed = in_low ? factor_low(b, done, width) : factor_high(b, done - b->n1, width);
    if (*failed) return batten_fail(ctx, BATTEN_E_SINGULAR, "Cholesky: leading minor %zu is not positive", *failed);
    done += width;
  }
  return BATTEN_OK;
}

size_t batten_rfp_weakest(const batten_rfp *b, double *ratio) {
  size_t weakest = 0;
  double least = INFINITY, largest = 0;
  for (size_t j = 0; j < b->n; j++) {
    double value = absolute(b->real, j < b->n1 ? low(b, j, j) : high(b, j - b->n1, j - b->n1));
    largest = fmax(largest, value);
    if (value < least) least = value, weakest = j;
  }
  *ratio = b->n > 0 ? least / largest * (least / largest) : 1;
  return weakest;
}

/* ---- Triangular solves ---- */

/* One right side reads the factor once and is bound by memory: the small triangles on the diagonal are solved from
 * cache, and everything beside them goes through products with a vector, which BLAS threads and its trsv does not. */
static size_t block_at(size_t j, size_t n) { return n - j < BLOCK ? n - j : BLOCK; }

static void forward_one(const batten_rfp *b, void *x) {
  for (size_t j = 0; j < b->n1; j += BLOCK) {
    size_t width = block_at(j, b->n1), below = j + width;
    void *xj = batten_la_at(b->real, x, j);
    batten_la_trsv(b->real, 'L', 'N', width, low(b, j, j), b->ld, xj);
    if (below < b->n)
      batten_la_gemv(b->real, 'N', b->n - below, width, -1, low(b, below, j), b->ld, xj, 1,
                     batten_la_at(b->real, x, below));
  }
  void *x2 = batten_la_at(b->real, x, b->n1);
  for (size_t j = 0; j < b->n2; j += BLOCK) {
    size_t width = block_at(j, b->n2), right = j + width;
    void *xj = batten_la_at(b->real, x2, j);
    batten_la_trsv(b->real, 'U', 'T', width, high(b, j, j), b->ld, xj);
    if (right < b->n2)
      batten_la_gemv(b->real, 'T', width, b->n2 - right, -1, high(b, j, right), b->ld, xj, 1,
                     batten_la_at(b->real, x2, right));
  }
}

static void backward_one(const batten_rfp *b, void *x) {
  void *x2 = batten_la_at(b->real, x, b->n1);
  for (size_t end = b->n2; end > 0;) {
    size_t j = (end - 1) / BLOCK * BLOCK, width = end - j;
    void *xj = batten_la_at(b->real, x2, j);
    batten_la_trsv(b->real, 'U', 'N', width, high(b, j, j), b->ld, xj);
    if (j > 0) batten_la_gemv(b->real, 'N', j, width, -1, high(b, 0, j), b->ld, xj, 1, x2);
    end = j;
  }
  for (size_t end = b->n1; end > 0;) {
    size_t j = (end - 1) / BLOCK * BLOCK, width = end - j;
    void *xj = batten_la_at(b->real, x, j);
    if (end < b->n)
      batten_la_gemv(b->real, 'T', b->n - end, width, -1, low(b, end, j), b->ld, batten_la_at(b->real, x, end), 1,
                     xj);
    batten_la_trsv(b->real, 'L', 'T', width, low(b, j, j), b->ld, xj);
    end = j;
  }
}

void batten_rfp_forward(const batten_rfp *b, size_t m, void *x, size_t ldx) {
  if (m == 1) {
    forward_one(b, x);
    return;
  }
  void *x2 = batten_la_at(b->real, x, b->n1);
  batten_la_trsm(b->real, 'L', 'L', 'N', b->n1, m, 1, b->b11, b->ld, x, ldx);
  batten_la_gemm(b->real, 'N', 'N', b->n2, m, b->n1, -1, b->b21, b->ld, x, ldx, 1, x2, ldx);
  batten_la_trsm(b->real, 'L', 'U', 'T', b->n2, m, 1, b->b22, b->ld, x2, ldx);
}

void batten_rfp_backward(const batten_rfp *b, size_t m, void *x, size_t ldx) {
  if (m == 1) {
    backward_one(b, x);
    return;
  }
  void *x2 = batten_la_at(b->real, x, b->n1);
  batten_la_trsm(b->real, 'L', 'U', 'N', b->n2, m, 1, b->b22, b->ld, x2, ldx);
  if (b->n2 > 0) batten_la_gemm(b->real, 'T', 'N', b->n1, m, b->n2, -1, b->b21, b->ld, x2, ldx, 1, x, ldx);
  batten_la_trsm(b->real, 'L', 'L', 'T', b->n1, m, 1, b->b11, b->ld, x, ldx);
}
