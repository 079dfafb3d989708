/* The interior point's systems with the rows condensed into the unknowns, in band form:
 *
 *   [ B  E ] [x_band  ]      B = H + diag(d) + sum over sparse rows c'c / w, in the order of reverse Cuthill-McKee: L
 * L' [ E' F ] [x_border]      border: unknowns that meet very many others, and p of rows with very many entries
 *
 * Y = L^-1 E, S = F - Y'Y, symmetric and quasidefinite with unknowns first, by L D L' without pivoting. Assembling is
 * one pass over the entries of H and the pairs of entries within each row: places follow from the row's sorted
 * columns, nothing is searched. */
#include <math.h>
#include <string.h>

#include "sparse/band.h"
#include "base/checked.h"
#include "kkt.h"
#include "la/la.h"

struct qp_bordered {
  size_t n, m, band, border, width;
  size_t unknowns;     /* of the border's members; rows come behind them */
  qp_csr h, c;         /* the caller's */
  uint32_t *place;     /* [n] place in the band, or band + place in the border */
  uint32_t *row_place; /* [m] place of a kept row, counted as unknowns are; UINT32_MAX: condensed */
  size_t *starts;      /* [m + 1], of rows with entries sorted by place */
  uint32_t *sorted;
  double *values;
  double *b;          /* [band][width + 1] */
  double *e;          /* [border][band] by columns; then Y */
  double *s;          /* [border][border] */
  double *s_diagonal; /* [border] of F and of the sums behind S */
  double *x;          /* [band + border] */
  double *inverse;    /* [m] 1 / w */
  size_t bytes;
  double flops;
};

void qp_bordered_free(batten_context *ctx, qp_bordered *f) {
  if (!f) return;
  void *blocks[] = {f->place, f->row_place, f->starts,     f->sorted, f->values,  f->b,
                    f->e,     f->s,         f->s_diagonal, f->x,      f->inverse, f};
  for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) batten_free(ctx, blocks[i]);
}

static void *take(batten_context *ctx, qp_bordered *f, size_t count, size_t size) {
  void *block = batten_alloc_array(ctx, count, size);
  if (block) f->bytes += count * size;
  return block;
}

/* Rows much longer than the others would each make a clique that no band holds: they stay rows. */
static size_t keep_long_rows(const qp_csr *c, unsigned char *keep) {
  const size_t SHORT = 32, FACTOR = 6;
  size_t kept = 0, entries = c->starts[c->rows];
  double mean = c->rows ? (double)entries / (double)c->rows : 0;
  for (int pass = 0; pass < 2; pass++) { /* the second with the mean of the short ones */
    size_t left = 0, count = 0;
    double limit = fmax((double)SHORT, (double)FACTOR * mean);
    kept = 0;
    for (size_t i = 0; i < c->rows; i++) {
      size_t length = c->starts[i + 1] - c->starts[i];
      keep[i] = (double)length > limit;
      kept += keep[i];
      if (!keep[i]) left += length, count++;
    }
    mean = count ? (double)left / (double)count : 0;
  }
  return kept;
}

/* Unknowns with very many neighbours in the condensed pattern. */
static size_t drop_busy_unknowns(const sparse_graph *g, unsigned char *drop) {
  const double FACTOR = 8;
  size_t dropped = 0;
  double mean = g->count ? (double)g->starts[g->count] / (double)g->count : 0, limit = fmax(64, FACTOR * mean);
  for (size_t j = 0; j < g->count; j++) {
    drop[j] = (double)(g->starts[j + 1] - g->starts[j]) > limit;
    dropped += drop[j];
  }
  return dropped;
}

/* Orders: place and row_place, width, and whether the form can be worth it at all. */
static batten_status order(batten_context *ctx, qp_bordered *f, double most_flops) {
  const size_t MOST_BORDER = 256;
  size_t n = f->n, m = f->m, most;
  sparse_graph g = {0};
  uint32_t *sequence = NULL;
  unsigned char *drop = NULL, *keep = batten_alloc(ctx, m);
  if (!keep) return BATTEN_E_NOMEM;
  batten_status st = BATTEN_E_NOMEM;
  drop = batten_alloc(ctx, n);
  if (!drop) goto done;
  sequence = batten_alloc_array(ctx, n, sizeof *sequence);
  if (!sequence) goto done;
  size_t kept = keep_long_rows(&f->c, keep);
  st = BATTEN_E_TOO_LARGE;
  if (kept > MOST_BORDER) goto done;
  /* A band of width k holds n k entries beside the diagonal; a pattern with more costs more than it may. */
  if (!batten_mul(n, 2 + 2 * (size_t)fmin(sqrt(most_flops / (double)(n + 1)), (double)n), &most)) goto done;
  st = qp_graph_condensed(ctx, &f->h, &f->c, keep, NULL, most, &g);
  if (st < 0) goto done;
  f->unknowns = drop_busy_unknowns(&g, drop);
  st = BATTEN_E_TOO_LARGE;
  if (kept + f->unknowns > MOST_BORDER) goto done;
  if (f->unknowns) {
    sparse_graph_free(ctx, &g);
    st = qp_graph_condensed(ctx, &f->h, &f->c, keep, drop, most, &g);
    if (st < 0) goto done;
  }
  st = sparse_order_band(ctx, &g, sequence, &f->width);
  if (st < 0) goto done;
  f->band = n - f->unknowns;
  f->border = f->unknowns + kept;
  size_t at = 0, behind = f->band;
  for (size_t p = 0; p < n; p++) f->place[sequence[p]] = (uint32_t)(drop[sequence[p]] ? behind++ : at++);
  for (size_t i = 0; i < m; i++) f->row_place[i] = keep[i] ? (uint32_t)behind++ : UINT32_MAX;
  double k = (double)f->width, b = (double)f->border, nb = (double)f->band;
  f->flops = nb * ((k + 1) * (k + 2) + 2 * b * (k + b));
  for (size_t i = 0; i < m; i++) {
    double length = (double)(f->c.starts[i + 1] - f->c.starts[i]);
    f->flops += keep[i] ? length : length * (length + 1);
  }
done:
  sparse_graph_free(ctx, &g);
  batten_free(ctx, sequence);
  batten_free(ctx, drop);
  batten_free(ctx, keep);
  return st;
}

/* Rows with entries sorted by place: the pairs (e, f), e <= f, are then the lower triangle. */
static void sort_rows(qp_bordered *f) {
  const qp_csr *c = &f->c;
  memcpy(f->starts, c->starts, (f->m + 1) * sizeof *f->starts);
  for (size_t i = 0; i < f->m; i++)
    for (size_t e = c->starts[i]; e < c->starts[i + 1]; e++) {
      uint32_t place = f->place[c->indices[e]];
      size_t to = e;
      for (; to > c->starts[i] && f->sorted[to - 1] > place; to--) {
        f->sorted[to] = f->sorted[to - 1];
        f->values[to] = f->values[to - 1];
      }
      f->sorted[to] = place;
      f->values[to] = c->values[e];
    }
}

batten_status qp_bordered_new(batten_context *ctx, const qp_csr *h, const qp_csr *c, double most_flops,
                              qp_bordered **out) {
  size_t n = c->columns, m = c->rows, entries = c->starts[m], band_entries, border_entries;
  qp_bordered *f = batten_alloc(ctx, sizeof *f);
  if (!f) return BATTEN_E_NOMEM;
  *f = (qp_bordered){.n = n, .m = m, .h = *h, .c = *c};
  batten_status st = BATTEN_E_NOMEM;
  f->place = take(ctx, f, n, sizeof *f->place);
  f->row_place = take(ctx, f, m, sizeof *f->row_place);
  if (!f->place || !f->row_place) goto done;
  st = order(ctx, f, most_flops);
  if (st < 0) goto done;
  st = BATTEN_E_TOO_LARGE;
  if (f->flops > most_flops || !batten_mul(f->band, f->width + 1, &band_entries) ||
      !batten_mul(f->border, f->band, &border_entries) || !batten_la_fits(f->width + 1) || !batten_la_fits(n))
    goto done;
  st = BATTEN_E_NOMEM;
  f->starts = take(ctx, f, m + 1, sizeof *f->starts);
  f->sorted = take(ctx, f, entries, sizeof *f->sorted);
  f->values = take(ctx, f, entries, sizeof *f->values);
  f->inverse = take(ctx, f, m, sizeof *f->inverse);
  f->b = take(ctx, f, band_entries, sizeof *f->b);
  f->e = take(ctx, f, border_entries, sizeof *f->e);
  f->s = take(ctx, f, f->border * f->border, sizeof *f->s);
  f->s_diagonal = take(ctx, f, f->border, sizeof *f->s_diagonal);
  f->x = take(ctx, f, f->band + f->border, sizeof *f->x);
  if (!f->starts || !f->sorted || !f->values || !f->inverse || !f->b || !f->e || !f->s || !f->s_diagonal || !f->x)
    goto done;
  sort_rows(f);
  *out = f;
  f = NULL;
  st = BATTEN_OK;
done:
  qp_bordered_free(ctx, f);
  return st;
}

/* Adds value at places i >= j of the whole matrix's lower triangle. */
static inline void add(qp_bordered *f, size_t i, size_t j, double value) {
  if (i < f->band)
    f->b[j * (f->width + 1) + (i - j)] += value;
  else if (j < f->band)
    f->e[(i - f->band) * f->band + j] += value;
  else
    f->s[(j - f->band) * f->border + (i - f->band)] += value;
}

static void assemble(qp_bordered *f, const double *d, const double *w, double shift) {
  memset(f->b, 0, f->band * (f->width + 1) * sizeof *f->b);
  memset(f->e, 0, f->border * f->band * sizeof *f->e);
  memset(f->s, 0, f->border * f->border * sizeof *f->s);
  for (size_t j = 0; j < f->n; j++) {
    size_t p = f->place[j];
    add(f, p, p, d[j] + shift);
    for (size_t e = f->h.starts[j]; e < f->h.starts[j + 1]; e++) {
      size_t q = f->place[f->h.indices[e]];
      if (q <= p) add(f, p, q, f->h.values[e]);
    }
  }
  for (size_t i = 0; i < f->m; i++) {
    size_t first = f->starts[i], end = f->starts[i + 1];
    f->inverse[i] = 1 / w[i];
    if (f->row_place[i] != UINT32_MAX) {
      for (size_t e = first; e < end; e++) add(f, f->row_place[i], f->sorted[e], f->values[e]);
      add(f, f->row_place[i], f->row_place[i], -w[i]);
      continue;
    }
    bool inside = end == first || f->sorted[end - 1] < f->band;
    for (size_t e = first; e < end; e++) {
      double v = f->values[e] * f->inverse[i];
      size_t p = f->sorted[e];
      if (inside) {
        double *column = f->b + p * (f->width + 1);
        for (size_t g = e; g < end; g++) column[f->sorted[g] - p] += v * f->values[g];
      } else
        for (size_t g = e; g < end; g++) add(f, f->sorted[g], p, v * f->values[g]);
    }
  }
}

/* S = L D L', D on the diagonal: positive for unknowns, negative for rows, or repaired as in ldl.c. */
static size_t border_factor(qp_bordered *f) {
  size_t count = f->border, repaired = 0;
  for (size_t j = 0; j < count; j++) {
    double *column = f->s + j * count, pivot = column[j];
    double least = 1e-15 * fabs(f->s_diagonal[j]) + 1e-30;
    bool unknown = j < f->unknowns;
    if (unknown ? !(pivot > least) : !(pivot < -least)) {
      pivot = column[j] = unknown ? 1e8 * least : -1e8 * least;
      repaired++;
    }
    for (size_t q = j + 1; q < count; q++) {
      double l = column[q] / pivot, *to = f->s + q * count;
      for (size_t i = q; i < count; i++) to[i] -= l * column[i];
    }
    for (size_t i = j + 1; i < count; i++) column[i] /= pivot;
  }
  return repaired;
}

static void border_solve(const qp_bordered *f, double *x) {
  size_t count = f->border;
  for (size_t j = 0; j < count; j++)
    for (size_t i = j + 1; i < count; i++) x[i] -= f->s[j * count + i] * x[j];
  for (size_t j = count; j-- > 0;) {
    x[j] /= f->s[j * count + j];
    for (size_t i = j + 1; i < count; i++) x[j] -= f->s[j * count + i] * x[i];
  }
}

size_t qp_bordered_factor(qp_bordered *f, const double *d, const double *w) {
  size_t repaired = 0;
  double top = 0; /* stays 0 where no pivot is a number: nothing can be held then */
  for (double shift = 0;; shift = fmax(100 * shift, 1e-15 * top)) {
    assemble(f, d, w, shift);
    if (repaired == 0)
      for (size_t j = 0; j < f->band; j++) top = fmax(top, f->b[j * (f->width + 1)]);
    if (sparse_band_cholesky(f->band, f->width, f->b) == 0 || !isfinite(top) || !(shift < top)) break;
    repaired++; /* rounding has eaten a pivot: all unknowns are held more tightly, refinement takes it out again */
  }
  if (f->border == 0) return repaired;
  for (size_t k = 0; k < f->border; k++) f->s_diagonal[k] = f->s[k * f->border + k];
  for (size_t k = 0; k < f->border; k++) sparse_band_forward(f->band, f->width, f->b, f->e + k * f->band);
  batten_la_syrk(BATTEN_LA_DOUBLE, 'L', 'T', f->border, f->band, -1, f->e, f->band, 1, f->s, f->border);
  for (size_t k = f->unknowns; k < f->border; k++) f->s_diagonal[k] = f->s[k * f->border + k]; /* only grows */
  return repaired + border_factor(f);
}

void qp_bordered_solve(qp_bordered *f, double *r, double *s, double *to) {
  double *x = f->x, *border = x + f->band;
  for (size_t j = 0; j < f->n; j++) x[f->place[j]] = r[j];
  for (size_t i = 0; i < f->m; i++) {
    if (f->row_place[i] != UINT32_MAX) {
      x[f->row_place[i]] = s[i];
      continue;
    }
    double v = s[i] * f->inverse[i];
    for (size_t e = f->starts[i]; e < f->starts[i + 1]; e++) x[f->sorted[e]] += v * f->values[e];
  }
  sparse_band_forward(f->band, f->width, f->b, x);
  if (f->border) {
    batten_la_gemv(BATTEN_LA_DOUBLE, 'T', f->band, f->border, -1, f->e, f->band, x, 1, border);
    border_solve(f, border);
    batten_la_gemv(BATTEN_LA_DOUBLE, 'N', f->band, f->border, -1, f->e, f->band, border, 1, x);
  }
  sparse_band_backward(f->band, f->width, f->b, x);
  for (size_t j = 0; j < f->n; j++) r[j] = x[f->place[j]];
  for (size_t i = 0; i < f->m; i++) {
    double sum = 0;
    for (size_t e = f->starts[i]; e < f->starts[i + 1]; e++) sum += f->values[e] * x[f->sorted[e]];
    to[i] += sum;
    s[i] = f->row_place[i] != UINT32_MAX ? x[f->row_place[i]] : (sum - s[i]) * f->inverse[i];
  }
}

double qp_bordered_flops(const qp_bordered *f) { return f->flops; }
size_t qp_bordered_bytes(const qp_bordered *f) { return f->bytes; }
