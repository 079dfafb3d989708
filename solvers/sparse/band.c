/* Band Cholesky. Below the width where LAPACK's blocks come in (32) dpbtrf calls BLAS once for each column with
 * vectors of `width` numbers, so that calls cost more than sums; there a loop with four columns at a time takes its
 * place. */
#include "band.h"

#include <math.h>

#include "la/la.h"

/* Column j of the factor from a column that has all its updates: scaled by the root of its pivot. False: pivot bad.
 */
static int finish(size_t below, double *column) {
  double pivot = column[0];
  if (!(pivot > 0) || !isfinite(pivot)) return 0;
  double root = sqrt(pivot), inverse = 1 / root;
  column[0] = root;
  for (size_t i = 1; i <= below; i++) column[i] *= inverse;
  return 1;
}

static size_t least(size_t a, size_t b) { return a < b ? a : b; }

size_t sparse_band_cholesky_narrow(size_t n, size_t width, double *a) {
  enum { BLOCK = 4 };
  const size_t ld = width + 1;
  for (size_t j = 0; j < n; j += BLOCK) {
    size_t block = least(BLOCK, n - j);
    /* The block's own columns, each updating the others of the block. */
    for (size_t c = 0; c < block; c++) {
      double *column = a + (j + c) * ld;
      size_t below = least(width, n - 1 - (j + c));
      if (!finish(below, column)) return j + c + 1;
      for (size_t p = 1; p <= below && c + p < block; p++) {
        double factor = column[p], *to = column + p * ld;
        for (size_t i = p; i <= below; i++) to[i - p] -= factor * column[i];
      }
    }
    /* All later columns, by the block at once: entry (r, q) -= sum_c l(r, c) l(q, c). */
    size_t last = least(n - 1, j + block - 1 + width);
    for (size_t q = j + block; q <= last; q++) {
      double *to = a + q * ld;
      for (size_t c = block; c-- > 0;) {
        size_t column = j + c;
        if (q > column + width) break;
        const double *l = a + column * ld + (q - column);
        size_t rows = least(n - 1, column + width) - q;
        if (c >= 1 && block == BLOCK && q <= column - 1 + width) {
          /* two columns at a time where both reach q; the second reaches one row less far */
          const double *k = l - ld + 1;
          double f = l[0], g = k[0];
          size_t both = least(n - 1, column - 1 + width) - q;
          for (size_t i = 0; i <= both; i++) to[i] -= f * l[i] + g * k[i];
          for (size_t i = both + 1; i <= rows; i++) to[i] -= f * l[i];
          c--;
          continue;
        }
        double f = l[0];
        for (size_t i = 0; i <= rows; i++) to[i] -= f * l[i];
      }
    }
  }
  return 0;
}

size_t sparse_band_cholesky(size_t n, size_t width, double *a) {
  const size_t BLOCKED = 72; /* LAPACK has blocks from 32 on, which pay from here on: measured */
  size_t bad = width < BLOCKED ? sparse_band_cholesky_narrow(n, width, a) : batten_la_pbtrf('L', n, width, a, width + 1);
  for (size_t j = 0; j < n && !bad; j++) a[j * (width + 1)] = 1 / a[j * (width + 1)];
  return bad;
}

/* Columns from first on, one after the other. */
static void forward_from(size_t first, size_t n, size_t width, const double *l, double *x) {
  for (size_t j = first; j < n; j++) {
    const double *column = l + j * (width + 1);
    double xj = x[j] * column[0], *to = x + j;
    size_t below = least(width, n - 1 - j);
    to[0] = xj;
    for (size_t i = 1; i <= below; i++) to[i] -= xj * column[i];
  }
}

/* Terms that were known for long come first, in four sums; the last one to become known comes last. */
static void backward_from(size_t from_column, size_t n, size_t width, const double *l, double *x) {
  for (size_t j = from_column; j-- > 0;) {
    const double *column = l + j * (width + 1), *from = x + j;
    size_t i = least(width, n - 1 - j);
    double a = x[j], b = 0, c = 0, d = 0;
    for (; i >= 5; i -= 4) {
      a -= column[i] * from[i];
      b -= column[i - 1] * from[i - 1];
      c -= column[i - 2] * from[i - 2];
      d -= column[i - 3] * from[i - 3];
    }
    a += b + c + d;
    for (; i >= 1; i--) a -= column[i] * from[i];
    x[j] = a * column[0];
  }
}

/* The same for widths below 5, of which the compiler makes loops that keep what is under way in registers: through
 * memory, each column would wait for the one before to be stored and loaded again. t1 .. t4: x[j + 1] .. x[j + 4]. */
static inline size_t forward_narrow(size_t n, size_t width, const double *l, double *x) {
  if (n <= width) return 0;
  double t0 = x[0], t1 = x[1], t2 = width > 1 ? x[2] : 0, t3 = width > 2 ? x[3] : 0;
  size_t j = 0;
  for (; j + width < n; j++) {
    const double *column = l + j * (width + 1);
    double last = x[j + width], xj = t0 * column[0];
    x[j] = xj;
    t0 = (width == 1 ? last : t1) - xj * column[1];
    if (width > 1) t1 = (width == 2 ? last : t2) - xj * column[2];
    if (width > 2) t2 = (width == 3 ? last : t3) - xj * column[3];
    if (width > 3) t3 = last - xj * column[4];
  }
  x[j] = t0;
  if (width > 1) x[j + 1] = t1;
  if (width > 2) x[j + 2] = t2;
  if (width > 3) x[j + 3] = t3;
  return j;
}

static inline void backward_narrow(size_t columns, size_t width, const double *l, double *x) {
  if (columns == 0) return;
  double t1 = x[columns], t2 = width > 1 ? x[columns + 1] : 0, t3 = width > 2 ? x[columns + 2] : 0;
  double t4 = width > 3 ? x[columns + 3] : 0;
  for (size_t j = columns; j-- > 0;) {
    const double *column = l + j * (width + 1);
    double a = x[j];
    if (width > 3) a -= column[4] * t4;
    if (width > 2) a -= column[3] * t3;
    if (width > 1) a -= column[2] * t2;
    a -= column[1] * t1;
    t4 = t3, t3 = t2, t2 = t1;
    x[j] = t1 = a * column[0];
  }
}

void sparse_band_forward(size_t n, size_t width, const double *l, double *x) {
  size_t done = 0;
  switch (width) {
    case 1:
      done = forward_narrow(n, 1, l, x);
      break;
    case 2:
      done = forward_narrow(n, 2, l, x);
      break;
    case 3:
      done = forward_narrow(n, 3, l, x);
      break;
    case 4:
      done = forward_narrow(n, 4, l, x);
      break;
    default:
      break;
  }
  forward_from(done, n, width, l, x);
}

void sparse_band_backward(size_t n, size_t width, const double *l, double *x) {
  size_t whole = n > width ? n - width : 0; /* columns with width entries below the diagonal */
  if (width == 0 || width > 4) whole = n;
  if (width > 0 && width <= 4) {
    for (size_t j = n; j-- > whole;) {
      double a = x[j];
      for (size_t i = n - 1 - j; i >= 1; i--) a -= l[j * (width + 1) + i] * x[j + i];
      x[j] = a * l[j * (width + 1)];
    }
  }
  switch (width) {
    case 1:
      backward_narrow(whole, 1, l, x);
      break;
    case 2:
      backward_narrow(whole, 2, l, x);
      break;
    case 3:
      backward_narrow(whole, 3, l, x);
      break;
    case 4:
      backward_narrow(whole, 4, l, x);
      break;
    default:
      backward_from(whole, n, width, l, x);
      break;
  }
}
