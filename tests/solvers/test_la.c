/* Packed Cholesky against LAPACK's own and against full matrices; wrappers at their edges; what BLAS is loaded. */
#include <batten/blas.h>

#include "saddle/rfp.h"
#include "tap.h"

/* A definite matrix [n][n], full, and its packed copy in `real`. */
static double *make_matrix(size_t n, uint64_t seed) {
  double *a = malloc((n * n + 1) * sizeof *a);
  for (size_t j = 0; j < n; j++)
    for (size_t i = j; i < n; i++) a[i + j * n] = a[j + i * n] = t_uniform(&seed) - 0.5 + (i == j ? (double)n : 0);
  return a;
}

static void set(batten_la_real real, void *at, double value) {
  if (real == BATTEN_LA_DOUBLE)
    *(double *)at = value;
  else
    *(float *)at = (float)value;
}
static double get(batten_la_real real, const void *at) {
  return real == BATTEN_LA_DOUBLE ? *(const double *)at : (double)*(const float *)at;
}

/* LAPACK's own Cholesky and solution in the same storage: 'N', 'L'. */
static int packed_cholesky(batten_la_real real, size_t n, void *a) {
  batten_la_int order = (batten_la_int)n, info = 0;
  if (real == BATTEN_LA_DOUBLE)
    FORTRAN(dpftrf)("N", "L", &order, a, &info, 1, 1);
  else
    FORTRAN(spftrf)("N", "L", &order, a, &info, 1, 1);
  return (int)info;
}

static void packed_solve(batten_la_real real, size_t n, size_t columns, const void *a, void *b) {
  batten_la_int order = (batten_la_int)n, nrhs = (batten_la_int)columns, ldb = order > 1 ? order : 1, info = 0;
  if (real == BATTEN_LA_DOUBLE)
    FORTRAN(dpftrs)("N", "L", &order, &nrhs, a, b, &ldb, &info, 1, 1);
  else
    FORTRAN(spftrs)("N", "L", &order, &nrhs, a, b, &ldb, &info, 1, 1);
}

static void *element(const batten_rfp *b, size_t i, size_t j) { /* i >= j */
  if (j < b->n1) return batten_la_at(b->real, b->b11, i + j * b->ld);
  return batten_la_at(b->real, b->b22, (j - b->n1) + (i - b->n1) * b->ld);
}

static void *make_packed(batten_la_real real, size_t n, const double *a, batten_rfp *b) {
  size_t count;
  batten_rfp_count(n, &count);
  void *packed = malloc((count + 1) * (size_t)real);
  for (size_t q = 0; q < count; q++) set(real, batten_la_at(real, packed, q), NAN);
  *b = batten_rfp_view(real, n, packed);
  for (size_t j = 0; j < n; j++)
    for (size_t i = j; i < n; i++) set(real, element(b, i, j), a[i + j * n]);
  return packed;
}

static void test_packed(batten_context *ctx, batten_la_real real, size_t n) {
  double eps = real == BATTEN_LA_DOUBLE ? 0x1p-52 : 0x1p-23, worst = 0, norm = 0, sums_norm = 0;
  double *a = make_matrix(n, n);
  size_t count, failed = 9, m = 3;
  batten_rfp b, reference;
  void *packed = make_packed(real, n, a, &b), *other = make_packed(real, n, a, &reference);
  double *sums = malloc((n + 1) * sizeof *sums);
  void *x = malloc((m * n + 1) * (size_t)real), *y = malloc((m * n + 1) * (size_t)real);
  const char *name = real == BATTEN_LA_DOUBLE ? "double" : "float";
  batten_rfp_count(n, &count);
  bool full = true;
  for (size_t q = 0; q < count; q++) full = full && !isnan(get(real, batten_la_at(real, packed, q)));
  T_CHECK(full && count == n * (n + 1) / 2, "n = %zu, %s: each place of the storage is used once", n, name);

  for (size_t j = 0; j < n; j++) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) sum += fabs(a[i + j * n]);
    norm = fmax(norm, sum);
  }
  sums_norm = batten_rfp_norm1(&b, sums);
  T_RATIO(fabs(sums_norm - norm) / fmax(norm, 1), (double)(n + 1) * eps, "norm");

  T_OK(batten_rfp_cholesky(ctx, &b, &failed), ctx);
  T_CHECK(packed_cholesky(real, n, other) == 0 && failed == 0, "LAPACK's packed Cholesky");
  worst = 0;
  for (size_t q = 0; q < count; q++)
    worst = fmax(worst, fabs(get(real, batten_la_at(real, packed, q)) - get(real, batten_la_at(real, other, q))));
  T_RATIO(worst / sqrt(fmax(norm, 1)), (double)(n + 1) * eps, "own factor against LAPACK's");

  /* Solves for one and for several right sides, against LAPACK's. */
  uint64_t seed = 3;
  worst = 0;
  for (size_t columns = 1; columns <= m; columns += m - 1) {
    for (size_t q = 0; q < columns * n; q++) {
      double value = t_uniform(&seed) - 0.5;
      set(real, batten_la_at(real, x, q), value);
      set(real, batten_la_at(real, y, q), value);
    }
    batten_rfp_forward(&b, columns, x, n);
    batten_rfp_backward(&b, columns, x, n);
    packed_solve(real, n, columns, packed, y);
    for (size_t q = 0; q < columns * n; q++)
      worst = fmax(worst, fabs(get(real, batten_la_at(real, x, q)) - get(real, batten_la_at(real, y, q))));
  }
  T_RATIO(worst, 10 * eps, "solutions against LAPACK's");

  /* One diagonal element spoilt: the minor is named. */
  for (size_t spoilt = 0; spoilt < n; spoilt += n / 4 + 1) {
    free(packed);
    packed = make_packed(real, n, a, &b);
    set(real, element(&b, spoilt, spoilt), -1);
    batten_status st = batten_rfp_cholesky(ctx, &b, &failed);
    T_CHECK(st == BATTEN_E_SINGULAR && failed == spoilt + 1, "spoilt at %zu: %s", spoilt, batten_error(ctx));
  }
  free(y);
  free(x);
  free(sums);
  free(other);
  free(packed);
  free(a);
}

static void test_empty(batten_context *ctx) {
  size_t rank = 9, zero = 9;
  double rcond = 0, norm = 9;
  T_CHECK(batten_la_fits(0) && !batten_la_fits(SIZE_MAX), "range of LAPACK's integers");
  T_CHECK(batten_la_potrf(BATTEN_LA_DOUBLE, 'L', 0, NULL, 0) == 0, "empty Cholesky");
  T_OK(batten_la_sytrf(ctx, 0, NULL, 0, NULL, &zero), ctx);
  T_OK(batten_la_sycon(ctx, 0, NULL, 0, NULL, 0, &rcond), ctx);
  T_CHECK(rcond == 1 && batten_la_norm_sy(0, NULL, 0, NULL) == 0, "condition of nothing");
  T_OK(batten_la_geqp3(ctx, 0, 0, NULL, 0, NULL, NULL), ctx);
  T_OK(batten_la_geqrf(ctx, 0, 0, NULL, 0, NULL), ctx);
  T_OK(batten_la_ormqr(ctx, 'T', 0, 0, 0, NULL, 0, NULL, NULL, 0), ctx);
  T_OK(batten_la_trcon(ctx, 0, NULL, 0, &rcond), ctx);
  T_OK(batten_la_pstrf(ctx, 0, NULL, 0, -1, NULL, &rank), ctx);
  T_OK(batten_la_norm1_estimate(ctx, 0, NULL, NULL, &norm), ctx);
  T_CHECK(rank == 0 && norm == 0 && batten_la_sytrf_work(0) == 1 && batten_la_geqrf_work(0, 0) == 1 &&
              batten_la_ormqr_work('N', 0, 0, 0) == 1,
          "workspace of nothing");
}

/* Pivoted Cholesky of diag(4, 1e-4, 9, 0, 1e-9): the tolerance decides where it stops. */
static void test_pivoted(batten_context *ctx) {
  static const double diagonal[] = {4, 1e-4, 9, 0, 1e-9}, tolerance[] = {-1, 1e-8, 1e-3, 10};
  static const size_t order[] = {2, 0, 1, 4}, ranks[] = {4, 3, 2, 1};
  for (size_t q = 0; q < sizeof ranks / sizeof *ranks; q++) {
    double a[25] = {0};
    size_t pivots[5], rank = 9;
    for (size_t j = 0; j < 5; j++) a[6 * j] = diagonal[j];
    T_OK(batten_la_pstrf(ctx, 5, a, 5, tolerance[q], pivots, &rank), ctx);
    bool right = rank == ranks[q];
    for (size_t j = 0; j < rank; j++)
      right = right && pivots[j] == order[j] && fabs(a[6 * j] - sqrt(diagonal[order[j]])) < 1e-15;
    T_CHECK(right, "pivoted Cholesky down to %g: rank %zu", tolerance[q], rank);
  }
}

/* The estimate is exact for a diagonal. */
static void scale_by_index(void *arg, double *x) {
  for (size_t i = 0; i < *(size_t *)arg; i++) x[i] *= (double)(i + 1);
}

static void test_estimate(batten_context *ctx) {
  size_t n = 17;
  double norm = 0;
  T_OK(batten_la_norm1_estimate(ctx, n, scale_by_index, &n, &norm), ctx);
  T_CHECK(norm == 17, "norm of a diagonal: %g", norm);
}

static void test_blas(void) {
  char text[256] = "?", little[5] = "?";
  batten_blas_describe(text, sizeof text);
  batten_blas_describe(little, sizeof little);
  batten_blas_describe(NULL, 0);
  T_CHECK(strlen(text) > 5 && strlen(little) == 4 && !strncmp(text, little, 4), "BLAS: %s", text);
  unsigned threads = batten_blas_threads();
  T_CHECK(!strstr(text, "OpenBLAS") || threads >= 1, "its threads: %u", threads);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  static const size_t sizes[] = {0, 1, 2, 3, 5, 6, 50, 101, 1100, 1101}; /* the last with several blocks */
  for (size_t q = 0; q < sizeof sizes / sizeof *sizes; q++) {
    test_packed(ctx, BATTEN_LA_DOUBLE, sizes[q]);
    test_packed(ctx, BATTEN_LA_FLOAT, sizes[q]);
  }
  test_empty(ctx);
  test_pivoted(ctx);
  test_estimate(ctx);
  test_blas();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
