/* The loops of panels.c in one precision: REAL, WIDTH of them in a panel's row, COLUMNS at a time, NAME(x) for names.
 */

typedef REAL NAME(vec) __attribute__((vector_size(BATTEN_PANEL_BYTES), may_alias));
typedef REAL NAME(part) __attribute__((vector_size(BATTEN_PANEL_BYTES / PARTS), may_alias));
typedef REAL NAME(half) __attribute__((vector_size(BATTEN_PANEL_BYTES / 2), may_alias));
typedef REAL NAME(quarter) __attribute__((vector_size(BATTEN_PANEL_BYTES / 4), may_alias));

/* c[j] -= sum of a[k] b[k][j] over k < count, j < COLUMNS: the loop that takes nearly all of the time. The sums stay
 * in registers, as vectors of the processor's own size: gcc spills longer ones. */
static inline void NAME(reduce)(size_t count, const NAME(vec) * a, const REAL *b, NAME(vec) * c) {
  const NAME(part) *rows = (const NAME(part) *)(const void *)a;
  NAME(part) *out = (NAME(part) *)(void *)c, sums[COLUMNS * PARTS];
#pragma GCC unroll 16
  for (int j = 0; j < COLUMNS * PARTS; j++) sums[j] = out[j];
  for (size_t k = 0; k < count; k++)
#pragma GCC unroll 16
    for (int j = 0; j < COLUMNS; j++)
#pragma GCC unroll 4
      for (int i = 0; i < PARTS; i++) sums[j * PARTS + i] -= rows[k * PARTS + (size_t)i] * b[k * WIDTH + (size_t)j];
#pragma GCC unroll 16
  for (int j = 0; j < COLUMNS * PARTS; j++) out[j] = sums[j];
}

/* The block on the diagonal: its Cholesky factor, diagonal inverted, zeros above it. 0, or 1-based which pivot fails.
 */
static size_t NAME(corner)(NAME(vec) * c, const REAL *diagonal, REAL least) {
  for (size_t j = 0; j < WIDTH; j++) {
    REAL pivot = c[j][j];
    if (!(pivot > least * diagonal[j])) return j + 1;
    REAL inverse = (REAL)(1 / sqrt((double)pivot));
    for (size_t i = 0; i < j; i++) c[j][i] = 0;
    c[j] *= inverse;
    for (size_t t = j + 1; t < WIDTH; t++) c[t] -= c[j] * c[j][t];
    c[j][j] = inverse;
  }
  return 0;
}

static size_t NAME(factor)(size_t n, void *b, double least) {
  const size_t panels = (n + WIDTH - 1) / WIDTH;
  REAL *panel = b;
  for (size_t p = 0; p < panels; p++) {
    NAME(vec) *rows = (NAME(vec) *)(void *)panel;
    const REAL *other = b;
    REAL diagonal[WIDTH];
    for (size_t j = 0; j < WIDTH; j++) diagonal[j] = rows[p * WIDTH + j][j];
    for (size_t q = 0; q <= p; q++) {
      NAME(vec) *c = rows + q * WIDTH;
      for (size_t j = 0; j < WIDTH; j += COLUMNS) NAME(reduce)(q * WIDTH, rows, other + j, c + j);
      const REAL *corner = other + q * WIDTH * WIDTH; /* of the other panel: its factor on the diagonal */
      for (size_t j = 0; j < WIDTH && q < p; j++) {
        for (size_t t = 0; t < j; t++) c[j] -= c[t] * corner[t * WIDTH + j];
        c[j] *= corner[j * WIDTH + j];
      }
      other += WIDTH * WIDTH * (q + 1);
    }
    size_t failed = NAME(corner)(rows + p * WIDTH, diagonal, (REAL)least);
    if (failed) return p * WIDTH + failed;
    panel += WIDTH * WIDTH * (p + 1);
  }
  return 0;
}

/* Sum of the numbers in a vector, by halves. */
static inline REAL NAME(sum)(const NAME(vec) * v) {
  NAME(half) a[2];
  NAME(quarter) b[2];
  memcpy(a, v, sizeof a);
  a[0] += a[1];
  memcpy(b, a, sizeof b);
  b[0] += b[1];
  REAL total = b[0][0] + b[0][1];
#if WIDTH == 16
  total += b[0][2] + b[0][3];
#endif
  return total;
}

static void NAME(solve)(size_t n, const void *b, void *solution) {
  enum { SUMS = 4 };
  const size_t panels = (n + WIDTH - 1) / WIDTH;
  const REAL *panel = b;
  REAL *x = solution;
  NAME(vec) *xs = solution;
  for (size_t p = 0; p < panels; p++) {
    const NAME(vec) *rows = (const NAME(vec) *)(const void *)panel;
    NAME(vec) sums[SUMS] = {xs[p]};
    for (size_t k = 0; k < p * WIDTH; k += SUMS)
#pragma GCC unroll 4
      for (size_t l = 0; l < SUMS; l++) sums[l] -= rows[k + l] * x[k + l];
    sums[0] = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    for (size_t j = 0; j < WIDTH; j++) {
      const NAME(vec) column = rows[p * WIDTH + j];
      REAL value = sums[0][j] * column[j];
      sums[0] -= column * value;
      x[p * WIDTH + j] = value;
    }
    panel += WIDTH * WIDTH * (p + 1);
  }
  for (size_t p = panels; p-- > 0;) {
    panel -= WIDTH * WIDTH * (p + 1);
    const NAME(vec) *rows = (const NAME(vec) *)(const void *)panel;
    for (size_t j = WIDTH; j-- > 0;) {
      REAL value = x[p * WIDTH + j];
      const REAL *column = panel + (p * WIDTH + j) * WIDTH;
      for (size_t i = j + 1; i < WIDTH; i++) value -= column[i] * x[p * WIDTH + i];
      x[p * WIDTH + j] = value * column[j];
    }
    const NAME(vec) own = xs[p];
    for (size_t k = 0; k < p * WIDTH; k++) {
      const NAME(vec) products = rows[k] * own;
      x[k] -= NAME(sum)(&products);
    }
  }
}
