/* Equilibration [Ruiz, RAL-TR-2001-034] of [H C'; C 0] by powers of two, of the objective by one more: products and
 * residuals of the copy are those of the problem, bit for bit but for the exponents (bounds aside). See scaled.h. */
#include "scaled.h"

#include <string.h>

#include "base/checked.h"

void qp_scaled_free(batten_context *ctx, qp_scaled *s) {
  for (size_t b = 0; b < sizeof s->memory / sizeof *s->memory; b++) batten_free(ctx, s->memory[b]);
  *s = (qp_scaled){0};
}

/* Copies of Hessian and rows without their zeros, row scale included. */
static void copy_hessian(const batten_matrix *h, size_t n, size_t *starts, uint32_t *indices, double *values) {
  size_t at = 0;
  for (size_t i = 0; i < n; i++) {
    starts[i] = at;
    if (h)
      for (size_t e = h->starts[i]; e < h->starts[i + 1]; e++)
        if (h->values[e] != 0) {
          indices[at] = h->indices[e];
          values[at++] = h->values[e];
        }
  }
  starts[n] = at;
}

static void copy_rows(const qp_rows *rows, size_t general, size_t *starts, uint32_t *indices, double *values) {
  size_t at = 0;
  for (size_t k = 0; k < general; k++) {
    const double *v;
    const uint32_t *columns;
    size_t count = qp_rows_entries(rows, k, &v, &columns);
    starts[k] = at;
    for (size_t e = 0; e < count; e++)
      if (v[e] != 0) {
        indices[at] = columns ? columns[e] : (uint32_t)e;
        values[at++] = v[e] * rows->scale[k];
      }
  }
  starts[general] = at;
}

/* Largest entry of each unknown and row, as scaled so far. */
static void largest(const qp_scaled *s, double *of_unknown, double *of_row) {
  for (size_t j = 0; j < s->n; j++) of_unknown[j] = 0;
  for (size_t i = 0; i < s->n; i++)
    for (size_t e = s->h.starts[i]; e < s->h.starts[i + 1]; e++)
      of_unknown[i] = qp_larger(of_unknown[i], fabs(s->h.values[e]) * s->e[i] * s->e[s->h.indices[e]]);
  for (size_t k = 0; k < s->general; k++) {
    of_row[k] = 0;
    for (size_t e = s->c.starts[k]; e < s->c.starts[k + 1]; e++) {
      double entry = fabs(s->c.values[e]) * s->f[k] * s->e[s->c.indices[e]];
      of_row[k] = qp_larger(of_row[k], entry);
      of_unknown[s->c.indices[e]] = qp_larger(of_unknown[s->c.indices[e]], entry);
    }
  }
}

/* A power of two within a factor 2 of 1 / sqrt(x), x > 0. */
static double inverse_root(double x) {
  int exponent; /* x = part 2^exponent, part in [1/2, 1) */
  frexp(x, &exponent);
  int half = exponent >= 0 ? exponent / 2 : -((1 - exponent) / 2);
  return ldexp(1, -half);
}

static void equilibrate(qp_scaled *s, double *of_unknown, double *of_row) {
  const int ROUNDS = 12; /* each takes the square root of what is uneven: from 2^1000 to below 2 */
  for (size_t j = 0; j < s->n; j++) s->e[j] = 1;
  for (size_t k = 0; k < s->general; k++) s->f[k] = 1;
  for (int round = 0; round < ROUNDS; round++) {
    bool changed = false;
    largest(s, of_unknown, of_row);
    for (size_t j = 0; j < s->n; j++) {
      double factor = of_unknown[j] > 0 ? inverse_root(of_unknown[j]) : 1;
      changed |= factor != 1;
      s->e[j] *= factor;
    }
    for (size_t k = 0; k < s->general; k++) {
      double factor = of_row[k] > 0 ? inverse_root(of_row[k]) : 1;
      changed |= factor != 1;
      s->f[k] *= factor;
    }
    if (!changed) break;
  }
}

/* Brings the objective to size one: the larger of the mean size of H's columns and the gradient at 0. */
static double objective_unit(const qp_scaled *s, const double *g) {
  double sum = 0, top = 0;
  for (size_t i = 0; i < s->n; i++) {
    double column = 0;
    for (size_t e = s->h.starts[i]; e < s->h.starts[i + 1]; e++)
      column = qp_larger(column, fabs(s->h.values[e]) * s->e[i] * s->e[s->h.indices[e]]);
    sum += column;
    top = qp_larger(top, fabs(g[i]) * s->e[i]);
  }
  double size = qp_larger(s->n ? sum / (double)s->n : 0, top);
  return size > 0 ? batten_unit(size) : 1;
}

static void apply(qp_scaled *s, const qp_sparse *objective, const qp_rows *rows, double *h, double *c) {
  s->cost = objective_unit(s, objective->g);
  for (size_t i = 0; i < s->n; i++) {
    s->g[i] = objective->g[i] * s->e[i] * s->cost;
    for (size_t e = s->h.starts[i]; e < s->h.starts[i + 1]; e++) h[e] *= s->cost * s->e[i] * s->e[s->h.indices[e]];
  }
  for (size_t k = 0; k < s->m; k++) {
    if (k < s->general)
      for (size_t e = s->c.starts[k]; e < s->c.starts[k + 1]; e++) c[e] *= s->f[k] * s->e[s->c.indices[e]];
    else
      s->f[k] = 1 / (rows->scale[k] * s->e[s->column[k - s->general]]);
    s->lower[k] = rows->lower[k] * s->f[k];
    s->upper[k] = rows->upper[k] * s->f[k];
  }
}

static void *take(batten_context *ctx, qp_scaled *s, size_t *used, size_t count, size_t size) {
  void *block = batten_alloc_array(ctx, count, size);
  if (block) s->bytes += count * size;
  return s->memory[(*used)++] = block;
}

batten_status qp_scaled_new(batten_context *ctx, const qp_sparse *objective, const qp_rows *rows, qp_scaled *out) {
  size_t n = objective->n, m = rows->m, general = 0, entries = 0, used = 0;
  const batten_matrix *h = objective->h && objective->h->rows ? objective->h : NULL;
  size_t h_entries = h ? h->starts[n] : 0;
  size_t caller_rows = rows->c ? rows->c->rows : 0;
  *out = (qp_scaled){.n = n, .m = m, .cost = 1};
  if (n > UINT32_MAX / 4 || m > UINT32_MAX / 4)
    return batten_fail(ctx, BATTEN_E_TOO_LARGE, "n = %zu, m = %zu: too large for the interior point", n, m);
  for (; general < m && rows->row[general] < caller_rows; general++) {
    const double *v;
    const uint32_t *columns;
    entries += qp_rows_entries(rows, general, &v, &columns);
  }
  out->general = general;
  size_t *h_starts = take(ctx, out, &used, n + 1, sizeof *h_starts);
  size_t *c_starts = take(ctx, out, &used, general + 1, sizeof *c_starts);
  uint32_t *indices = take(ctx, out, &used, h_entries + entries + (m - general), sizeof *indices);
  double *h_values = take(ctx, out, &used, h_entries, sizeof *h_values);
  double *c_values = take(ctx, out, &used, entries, sizeof *c_values);
  out->g = take(ctx, out, &used, n, 2 * sizeof *out->g);
  out->lower = take(ctx, out, &used, m, 3 * sizeof *out->lower);
  double *work = take(ctx, out, &used, n + m, sizeof *work);
  for (size_t b = 0; b < used; b++)
    if (!out->memory[b]) return BATTEN_E_NOMEM;
  out->e = out->g + n, out->upper = out->lower + m, out->f = out->lower + 2 * m;
  uint32_t *c_indices = indices + h_entries, *column = c_indices + entries;
  copy_hessian(h, n, h_starts, indices, h_values);
  copy_rows(rows, general, c_starts, c_indices, c_values);
  for (size_t k = general; k < m; k++) column[k - general] = (uint32_t)(rows->row[k] - caller_rows);
  out->column = column;
  out->h = (qp_csr){n, n, h_starts, indices, h_values};
  out->c = (qp_csr){general, n, c_starts, c_indices, c_values};
  equilibrate(out, work, work + n);
  apply(out, objective, rows, h_values, c_values);
  return BATTEN_OK;
}

void qp_scaled_rows(const qp_scaled *s, const double *x, double *out) {
  for (size_t k = 0; k < s->general; k++) out[k] = qp_csr_dot(&s->c, k, x);
  for (size_t k = s->general; k < s->m; k++) out[k] = x[s->column[k - s->general]];
}

void qp_scaled_hessian(const qp_scaled *s, const double *x, double *out) {
  for (size_t i = 0; i < s->n; i++) out[i] = qp_csr_dot(&s->h, i, x);
}

void qp_scaled_add(const qp_scaled *s, double factor, const double *y, double *to) {
  for (size_t k = 0; k < s->general; k++) {
    double v = factor * y[k];
    if (v != 0)
      for (size_t e = s->c.starts[k]; e < s->c.starts[k + 1]; e++) to[s->c.indices[e]] += v * s->c.values[e];
  }
  for (size_t k = s->general; k < s->m; k++) to[s->column[k - s->general]] += factor * y[k];
}
