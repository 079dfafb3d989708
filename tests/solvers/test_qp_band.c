/* Orders and factors of the interior point's linear systems: narrow band kernel against LAPACK's, solves against
 * products, the bordered band against the sparse factor and both against their own residual, bandwidths got back from
 * shuffled bands and grids, fill of the minimum degree order. */
#include "tap.h"

#include "la/la.h"
#include "sparse/band.h"
#include "qp/kkt.h"

static double *random_band(size_t n, size_t width, uint64_t *seed) {
  double *a = malloc(n * (width + 1) * sizeof *a);
  for (size_t j = 0; j < n; j++)
    for (size_t i = 0; i <= width; i++)
      a[j * (width + 1) + i] = i == 0 ? 2 * (double)width + 1 : t_uniform(seed) - 0.5;
  return a;
}

static void test_kernels(void) {
  static const size_t sizes[][2] = {{1, 0},   {1, 5},   {2, 1},    {3, 7},    {5, 4},    {7, 3},    {50, 0},
                                    {50, 1},  {201, 2}, {200, 3},  {4, 3},    {4, 4},    {5, 4},    {202, 4},
                                    {203, 5}, {204, 9}, {300, 17}, {300, 40}, {333, 71}, {333, 72}, {90, 100}};
  for (size_t t = 0; t < sizeof sizes / sizeof *sizes; t++) {
    size_t n = sizes[t][0], width = sizes[t][1], ld = width + 1;
    uint64_t seed = 7 + t;
    double *a = random_band(n, width, &seed), *b = malloc(n * ld * sizeof *b), *c = malloc(n * ld * sizeof *c);
    double *x = malloc(n * sizeof *x), *r = malloc(n * sizeof *r), apart = 0, worst = 0;
    memcpy(b, a, n * ld * sizeof *b);
    memcpy(c, a, n * ld * sizeof *c);
    size_t bad = sparse_band_cholesky_narrow(n, width, b) + batten_la_pbtrf('L', n, width, c, ld);
    for (size_t j = 0; j < n; j++)
      for (size_t i = 0; i <= width && i + j < n; i++) apart = fmax(apart, fabs(b[j * ld + i] - c[j * ld + i]));
    T_RATIO(bad ? INFINITY : apart, 1e-14 * (1 + (double)width),
            "n = %zu, width %zu: the kernel's factor is LAPACK's", n, width);
    memcpy(c, a, n * ld * sizeof *c);
    sparse_band_cholesky(n, width, c);
    for (size_t j = 0; j < n; j++) x[j] = r[j] = t_uniform(&seed) - 0.5;
    sparse_band_forward(n, width, c, x);
    sparse_band_backward(n, width, c, x);
    for (size_t j = 0; j < n; j++)
      for (size_t i = 0; i <= width && i + j < n; i++) {
        r[i + j] -= a[j * ld + i] * x[j];
        if (i) r[j] -= a[j * ld + i] * x[i + j];
      }
    for (size_t j = 0; j < n; j++) worst = fmax(worst, fabs(r[j]));
    T_RATIO(worst, 1e-15 * (4 + (double)width), "n = %zu, width %zu: residual of a solve", n, width);
    free(a), free(b), free(c), free(x), free(r);
  }
  double bad[] = {1, 2, 1, 0}; /* [1 2; 2 1] */
  T_CHECK(sparse_band_cholesky_narrow(2, 1, bad) == 2, "the second pivot of an indefinite matrix is named");
  double nan[] = {NAN, 0, 1, 0};
  T_CHECK(sparse_band_cholesky_narrow(2, 1, nan) == 1, "a pivot that is no number is named");
  T_CHECK(sparse_band_cholesky(0, 3, NULL) == 0, "nothing to factor");
}

/* ---- sparse matrices ---- */

typedef struct csr {
  size_t *starts, room;
  uint32_t *indices;
  double *values;
  qp_csr view;
} csr;

static csr csr_new(size_t rows, size_t columns, size_t room) {
  csr a = {.starts = calloc(rows + 1, sizeof *a.starts),
           .room = room,
           .indices = malloc((room + 1) * sizeof *a.indices),
           .values = malloc((room + 1) * sizeof *a.values)};
  a.view = (qp_csr){rows, columns, a.starts, a.indices, a.values};
  return a;
}
static void csr_free(csr *a) { free(a->starts), free(a->indices), free(a->values); }
/* Entries must come row by row. */
static void csr_put(csr *a, size_t row, size_t column, double value) {
  size_t at = a->starts[row + 1] ? a->starts[row + 1] : a->starts[row];
  if (a->starts[row + 1] == 0) at = a->starts[row];
  a->indices[at] = (uint32_t)column;
  a->values[at] = value;
  a->starts[row + 1] = at + 1;
}
static void csr_end_row(csr *a, size_t row) {
  if (a->starts[row + 1] < a->starts[row]) a->starts[row + 1] = a->starts[row];
}

/* H tridiagonal on a shuffled line, rows of three neighbours on it, `dense` rows that meet all, and one unknown that
 * is in every row if `busy`. */
typedef struct scene {
  csr h, c;
  size_t n, m;
} scene;

static void shuffle(size_t n, size_t *order, uint64_t *seed) {
  for (size_t i = 0; i < n; i++) order[i] = i;
  for (size_t i = n; i > 1; i--) {
    size_t j = (size_t)(t_uniform(seed) * (double)i), swap = order[i - 1];
    order[i - 1] = order[j];
    order[j] = swap;
  }
}

static scene scene_new(size_t n, size_t dense, bool busy, uint64_t *seed) {
  size_t line = n - (busy ? 1 : 0), short_rows = line > 2 ? line - 2 : 0, m = short_rows + dense;
  scene s = {csr_new(n, n, 3 * n), csr_new(m, n, 4 * m + dense * n), n, m};
  size_t *order = malloc(n * sizeof *order), *at = malloc(n * sizeof *at);
  shuffle(line, order, seed);
  for (size_t p = 0; p < line; p++) at[order[p]] = p;
  if (busy) at[n - 1] = SIZE_MAX;
  for (size_t j = 0; j < n; j++) {
    csr_end_row(&s.h, j);
    csr_put(&s.h, j, j, 2.5);
    if (at[j] == SIZE_MAX) continue;
    if (at[j] > 0) csr_put(&s.h, j, order[at[j] - 1], -1);
    if (at[j] + 1 < line) csr_put(&s.h, j, order[at[j] + 1], -1);
  }
  for (size_t i = 0; i < m; i++) {
    csr_end_row(&s.c, i);
    if (i < short_rows) {
      for (size_t q = 0; q < 3; q++) csr_put(&s.c, i, order[i + q], t_uniform(seed) - 0.5);
      if (busy) csr_put(&s.c, i, n - 1, t_uniform(seed) - 0.5);
    } else
      for (size_t j = 0; j < n; j++) csr_put(&s.c, i, j, t_uniform(seed) - 0.5);
  }
  free(order), free(at);
  return s;
}
static void scene_free(scene *s) { csr_free(&s->h), csr_free(&s->c); }

/* Largest residual of [H + d, C'; C, -w] (x, p) = (r, s). */
static double residual(const scene *s, const double *d, const double *w, const double *x, const double *p,
                       const double *r, const double *rs) {
  double worst = 0, *left = malloc(s->n * sizeof *left);
  for (size_t j = 0; j < s->n; j++) {
    left[j] = r[j] - d[j] * x[j];
    for (size_t e = s->h.starts[j]; e < s->h.starts[j + 1]; e++) left[j] -= s->h.values[e] * x[s->h.indices[e]];
  }
  for (size_t i = 0; i < s->m; i++) {
    double row = rs[i] + w[i] * p[i];
    for (size_t e = s->c.starts[i]; e < s->c.starts[i + 1]; e++) {
      row -= s->c.values[e] * x[s->c.indices[e]];
      left[s->c.indices[e]] -= s->c.values[e] * p[i];
    }
    worst = fmax(worst, fabs(row));
  }
  for (size_t j = 0; j < s->n; j++) worst = fmax(worst, fabs(left[j]));
  free(left);
  return worst;
}

static void test_systems(void) {
  static const struct {
    size_t n, dense;
    bool busy;
  } cases[] = {{3, 0, false}, {40, 0, false}, {200, 0, false}, {200, 3, false}, {200, 0, true}, {200, 2, true}};
  for (size_t t = 0; t < sizeof cases / sizeof *cases; t++) {
    uint64_t seed = 11 + t;
    scene s = scene_new(cases[t].n, cases[t].dense, cases[t].busy, &seed);
    batten_context *ctx = t_context(NULL, NULL, 1);
    size_t n = s.n, m = s.m;
    double *v = malloc((4 * n + 5 * m) * sizeof *v), *d = v, *r = v + n, *x = v + 2 * n, *x2 = v + 3 * n;
    double *w = v + 4 * n, *rs = w + m, *p = w + 2 * m, *p2 = w + 3 * m, *at = w + 4 * m, apart = 0;
    for (size_t j = 0; j < n; j++) d[j] = t_uniform(&seed), r[j] = t_uniform(&seed) - 0.5;
    for (size_t i = 0; i < m; i++) w[i] = 0.1 + t_uniform(&seed), rs[i] = t_uniform(&seed) - 0.5;
    qp_ldl *ldl = NULL;
    qp_bordered *band = NULL;
    T_OK(qp_ldl_new(ctx, &s.h.view, &s.c.view, &ldl), ctx);
    T_OK(qp_bordered_new(ctx, &s.h.view, &s.c.view, 1e9, &band), ctx);
    for (int again = 0; again < 2; again++) { /* the second factorization starts from a used matrix */
      size_t repaired = qp_ldl_factor(ldl, d, w) + qp_bordered_factor(band, d, w);
      memcpy(x, r, n * sizeof *x), memcpy(p, rs, m * sizeof *p);
      memcpy(x2, r, n * sizeof *x), memcpy(p2, rs, m * sizeof *p);
      qp_ldl_solve(ldl, x, p);
      for (size_t i = 0; i < m; i++) at[i] = 1;
      qp_bordered_solve(band, x2, p2, at);
      apart = 0;
      for (size_t i = 0; i < m; i++) apart = fmax(apart, fabs(at[i] - 1 - qp_csr_dot(&s.c.view, i, x2)));
      for (size_t j = 0; j < n; j++) apart = fmax(apart, fabs(x[j] - x2[j]));
      for (size_t i = 0; i < m; i++) apart = fmax(apart, fabs(p[i] - p2[i]));
      T_RATIO(repaired ? INFINITY : residual(&s, d, w, x, p, r, rs), 1e-12,
              "n = %zu, %zu dense rows: residual, sparse", n, cases[t].dense);
      T_RATIO(residual(&s, d, w, x2, p2, r, rs), 1e-12, "n = %zu, %zu dense rows, %s: residual, band", n,
              cases[t].dense, cases[t].busy ? "busy unknown" : "no busy unknown");
      T_RATIO(apart, 1e-12, "both agree");
      for (size_t j = 0; j < n; j++) d[j] *= 3;
    }
    for (size_t j = 0; j < n; j++) d[j] = NAN;
    T_CHECK(qp_bordered_factor(band, d, w) <= n + m, "it gives up where numbers are none");
    double line = (double)n;
    T_RATIO(qp_bordered_flops(band), line * 400, "n = %zu: what is dense went to the border, the rest is narrow", n);
    qp_ldl_free(ctx, ldl);
    qp_bordered_free(ctx, band);
    T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is back");
    batten_context_free(ctx);
    scene_free(&s);
    free(v);
  }
}

/* ---- orders ---- */

/* rows x columns grid with shuffled numbers; parts copies of it side by side, unconnected. */
static csr grid(size_t rows, size_t columns, size_t parts, uint64_t *seed) {
  size_t each = rows * columns, n = each * parts, *order = malloc(n * sizeof *order), *at = malloc(n * sizeof *at);
  csr h = csr_new(n, n, 5 * n);
  shuffle(n, order, seed);
  for (size_t p = 0; p < n; p++) at[order[p]] = p;
  for (size_t j = 0; j < n; j++) {
    size_t p = at[j], in = p % each, row = in / columns, column = in % columns;
    csr_end_row(&h, j);
    csr_put(&h, j, j, 4);
    if (column > 0) csr_put(&h, j, order[p - 1], -1);
    if (column + 1 < columns) csr_put(&h, j, order[p + 1], -1);
    if (row > 0) csr_put(&h, j, order[p - columns], -1);
    if (row + 1 < rows) csr_put(&h, j, order[p + columns], -1);
  }
  free(order), free(at);
  return h;
}

static bool is_permutation(size_t n, const uint32_t *order) {
  unsigned char *seen = calloc(n + 1, 1);
  bool ok = true;
  for (size_t i = 0; i < n; i++) ok = ok && order[i] < n && !seen[order[i]]++;
  free(seen);
  return ok;
}

static void test_orders(void) {
  static const struct {
    size_t rows, columns, parts, width;
  } cases[] = {{1, 1, 1, 0},  {1, 500, 1, 1},  {1, 1, 100, 0}, {1, 50, 7, 1},
               {40, 9, 1, 9}, {60, 20, 1, 20}, {30, 8, 3, 8}};
  for (size_t t = 0; t < sizeof cases / sizeof *cases; t++) {
    uint64_t seed = 3 + t;
    csr h = grid(cases[t].rows, cases[t].columns, cases[t].parts, &seed);
    size_t n = h.view.rows, width = 0, none_start = 0;
    qp_csr none = {0, n, &none_start, NULL, NULL};
    batten_context *ctx = t_context(NULL, NULL, 1);
    uint32_t *order = malloc(n * sizeof *order);
    sparse_graph g = {0};
    T_OK(qp_graph_condensed(ctx, &h.view, &none, NULL, NULL, SIZE_MAX, &g), ctx);
    T_OK(sparse_order_band(ctx, &g, order, &width), ctx);
    T_CHECK(is_permutation(n, order) && width <= cases[t].width + 1,
            "%zu grids of %zu x %zu: bandwidth %zu, shuffled from %zu", cases[t].parts, cases[t].rows,
            cases[t].columns, width, cases[t].width);
    T_OK(sparse_order_degree(ctx, &g, order), ctx);
    T_CHECK(is_permutation(n, order), "minimum degree numbers each once");
    qp_ldl *ldl = NULL;
    T_OK(qp_ldl_new(ctx, &h.view, &none, &ldl), ctx);
    double log_n = log2((double)n + 2);
    T_RATIO(qp_ldl_flops(ldl), 2 * pow((double)n, 1.5) * log_n, "n = %zu: fill as of a good order", n);
    qp_ldl_free(ctx, ldl);
    sparse_graph_free(ctx, &g);
    T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is back");
    batten_context_free(ctx);
    free(order);
    csr_free(&h);
  }
  /* An arrow: the tip meets all, and must come last for no fill at all. */
  size_t n = 2000;
  csr h = csr_new(n, n, 3 * n);
  for (size_t j = 0; j < n; j++) {
    csr_end_row(&h, j);
    if (j > 0) csr_put(&h, j, 0, 1);
    if (j > 0)
      csr_put(&h, j, j, 2);
    else
      for (size_t i = 0; i < n; i++) csr_put(&h, j, i, i ? 1 : 4000);
  }
  size_t none_start = 0;
  qp_csr none = {0, n, &none_start, NULL, NULL};
  batten_context *ctx = t_context(NULL, NULL, 1);
  qp_ldl *ldl = NULL;
  T_OK(qp_ldl_new(ctx, &h.view, &none, &ldl), ctx);
  T_CHECK(qp_ldl_flops(ldl) == 3.0 * (double)(n - 1), "an arrow gets no fill: %g", qp_ldl_flops(ldl));
  qp_ldl_free(ctx, ldl);
  batten_context_free(ctx);
  csr_free(&h);
}

static batten_status all_of_it(batten_context *ctx, void *arg) {
  scene *s = arg;
  qp_kkt k;
  batten_status st = qp_kkt_new(ctx, &s->h.view, &s->c.view, &k);
  qp_kkt_free(ctx, &k);
  if (st < 0) return st;
  qp_bordered *band = NULL;
  st = qp_bordered_new(ctx, &s->h.view, &s->c.view, 1e9, &band);
  qp_bordered_free(ctx, band);
  return st;
}

int main(void) {
  test_kernels();
  test_systems();
  test_orders();
  uint64_t seed = 5;
  scene s = scene_new(150, 2, true, &seed);
  t_fail_every_allocation("factoring", all_of_it, &s);
  scene_free(&s);
  batten_context *ctx = t_context(NULL, NULL, 1);
  scene long_rows = scene_new(3000, 300, false, &seed);
  qp_bordered *band = NULL;
  T_CHECK(qp_bordered_new(ctx, &long_rows.h.view, &long_rows.c.view, 1e12, &band) == BATTEN_E_TOO_LARGE && !band,
          "300 dense rows are too many for a border");
  scene_free(&long_rows);
  batten_context_free(ctx);
  return t_done();
}
