/* Matrices of small blocks and conjugate gradients: patterns against the pairs, products against the dense matrix,
 * solutions against dense Cholesky, the same bits for any number of threads. */
#include "sparse_scene.h"

#include "la/la.h"

static void test_pattern(batten_context *ctx) {
  /* 0 - 2 twice, once each way; 1 - 2; 3 alone */
  static const uint32_t pairs[] = {0, 2, 2, 1, 2, 0};
  static const size_t starts[] = {0, 2, 4, 7, 8};
  static const uint32_t columns[] = {0, 2, 1, 2, 0, 1, 2, 3};
  block_matrix a;
  T_OK(block_matrix_new(ctx, 4, 2, 3, pairs, &a), ctx);
  T_CHECK(memcmp(a.starts, starts, sizeof starts) == 0 && memcmp(a.columns, columns, sizeof columns) == 0,
          "by hand: pattern of four rows");
  T_CHECK(!block_matrix_at(&a, 0, 1) && !block_matrix_at(&a, 3, 2) && block_matrix_at(&a, 2, 1) == a.values + 20,
          "blocks are found, those that are not are NULL");
  double zeros = 0;
  for (size_t k = 0; k < 32; k++) zeros += fabs(a.values[k]);
  T_CHECK(zeros == 0, "values begin with 0");
  /* y = A x by hand: block (2, 1) = [1 2; 3 4], x_1 = (10, 100): row 2 gets (210, 430) */
  double *block = block_matrix_at(&a, 2, 1), x[8] = {0, 0, 10, 100}, y[8];
  for (int k = 0; k < 4; k++) block[k] = k + 1;
  block_matrix_apply(ctx, &a, x, y);
  T_CHECK(y[4] == 210 && y[5] == 430 && y[0] == 0 && y[2] == 0 && y[7] == 0, "by hand: a product");
  block_matrix_free(ctx, &a);
  T_OK(block_matrix_new(ctx, 0, 3, 0, NULL, &a), ctx);
  block_cg_figures figures;
  block_matrix_apply(ctx, &a, x, y);
  T_OK(block_cg(ctx, &a, x, 1e-10, 10, "none", y, &figures), ctx);
  T_CHECK(figures.iterations == 0 && figures.residual == 0, "no rows: nothing to do");
  block_matrix_free(ctx, &a);
  T_STATUS(block_matrix_new(ctx, (size_t)UINT32_MAX, 1, 0, NULL, &a), BATTEN_E_TOO_LARGE, ctx, "4294967295 rows");
}

/* x := A^-1 b by the dense factor. */
static void dense_solve(const block_matrix *a, double *x) {
  size_t n = a->rows * a->size;
  double *full = scene_dense(a);
  if (batten_la_potrf(BATTEN_LA_DOUBLE, 'L', n, full, n) != 0) x[0] = NAN;
  batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'N', n, full, n, x);
  batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', n, full, n, x);
  free(full);
}

static void test_dense(batten_context *ctx) {
  for (unsigned size = 1; size <= BLOCK_SIZE_MAX; size++) {
    uint64_t seed = 40 + size;
    scene_graph g = scene_random(60, 150, &seed);
    block_matrix a;
    T_OK(scene_matrix(ctx, &g, size, 0.3, &seed, &a), ctx);
    size_t n = a.rows * size;
    double *full = scene_dense(&a), *x = scene_vector(n, &seed), *y = calloc(n, sizeof *y),
           *b = scene_vector(n, &seed);
    batten_la_gemv(BATTEN_LA_DOUBLE, 'N', n, n, 1, full, n, x, 0, y);
    double *z = malloc(n * sizeof *z);
    block_matrix_apply(ctx, &a, x, z);
    T_RATIO(scene_apart(n, y, z), 1e-13, "size %u: product against the dense one", size);
    memcpy(z, b, n * sizeof *z);
    dense_solve(&a, z);
    block_cg_figures figures;
    T_OK(block_cg(ctx, &a, b, 1e-13, 2000, "solve", x, &figures), ctx);
    T_RATIO(scene_apart(n, x, z), 1e-10, "size %u: solution in %zu iterations against dense Cholesky", size,
            figures.iterations);
    T_RATIO(figures.residual, 1e-13, "size %u: residual told", size);
    /* from the solution there is nothing to do; 2^k scale changes no bit of the figures */
    size_t before = figures.iterations;
    T_OK(block_cg(ctx, &a, b, 1e-12, 2000, "solve", x, &figures), ctx);
    T_CHECK(figures.iterations == 0, "size %u: started at the solution", size);
    for (size_t k = 0; k < a.starts[a.rows] * size * size; k++) a.values[k] *= 0x1p20;
    memset(x, 0, n * sizeof *x);
    T_OK(block_cg(ctx, &a, b, 1e-13, 2000, "solve", x, &figures), ctx);
    double *u = calloc(n, sizeof *u);
    for (size_t k = 0; k < a.starts[a.rows] * size * size; k++) a.values[k] *= 0x1p-20;
    block_cg_figures again;
    T_OK(block_cg(ctx, &a, b, 1e-13, 2000, "solve", u, &again), ctx);
    for (size_t k = 0; k < n; k++) u[k] *= 0x1p-20;
    T_CHECK(memcmp(u, x, n * sizeof *u) == 0 && again.iterations == figures.iterations,
            "size %u: matrix times 2^20 gives the solution times 2^-20, bit for bit (%zu, %zu iterations)", size,
            before, again.iterations);
    block_matrix_free(ctx, &a);
    free(g.pairs), free(full), free(x), free(y), free(b), free(z), free(u);
  }
}

/* Many parts of rows: 1 and 4 threads, and a permutation that CG must not mind beyond rounding. */
static void test_threads(void) {
  double *first = NULL;
  size_t rows = 0;
  for (unsigned threads = 1; threads <= 4; threads += 3) {
    batten_context *ctx = t_context(NULL, NULL, threads);
    uint64_t seed = 5;
    scene_graph g = scene_grid(150, 140, true);
    block_matrix a;
    T_OK(scene_matrix(ctx, &g, 2, 0.5, &seed, &a), ctx);
    rows = a.rows;
    double *b = scene_vector(2 * rows, &seed), *x = calloc(2 * rows, sizeof *x), *r = malloc(2 * rows * sizeof *r);
    block_cg_figures figures;
    T_OK(block_cg(ctx, &a, b, 1e-11, 500, "solve", x, &figures), ctx);
    block_matrix_apply(ctx, &a, x, r);
    T_RATIO(scene_apart(2 * rows, r, b), 1e-10, "%u threads: residual of %zu rows after %zu iterations", threads,
            rows, figures.iterations);
    if (first) T_CHECK(memcmp(first, x, 2 * rows * sizeof *x) == 0, "the same bits with 1 and 4 threads");
    free(first), free(b), free(r), free(g.pairs);
    first = x;
    block_matrix_free(ctx, &a);
    batten_context_free(ctx);
  }
  free(first);
}

static void test_failures(batten_context *ctx) {
  uint64_t seed = 9;
  scene_graph g = scene_grid(20, 20, false);
  block_matrix a;
  block_cg_figures figures = {0};
  T_OK(scene_matrix(ctx, &g, 3, 1e-9, &seed, &a), ctx);
  double *b = scene_vector(1200, &seed), *x = calloc(1200, sizeof *x);
  T_STATUS(block_cg(ctx, &a, b, 1e-10, 3, "solve", x, &figures), BATTEN_W_ACCURACY, ctx, "after 3 iterations");
  T_CHECK(figures.iterations == 3 && figures.residual > 1e-10, "figures of what was reached: %g", figures.residual);
  T_STATUS(block_cg(ctx, &a, b, 1e-19, 100000, "solve", x, &figures), BATTEN_W_ACCURACY, ctx, "wanted 1e-19");
  T_RATIO(figures.residual, 1e-9, "beyond the digits there are: stops after %zu iterations", figures.iterations);
  memset(b, 0, 1200 * sizeof *b);
  T_OK(block_cg(ctx, &a, b, 1e-10, 100, "solve", x, &figures), ctx);
  double largest = 0;
  for (size_t k = 0; k < 1200; k++) largest = fmax(largest, fabs(x[k]));
  T_CHECK(largest == 0 && figures.iterations == 0, "a right-hand side of zeros has the solution 0");
  b[7] = 1;
  double *block = block_matrix_at(&a, 17, 17), kept = block[4];
  block[4] = -1;
  T_STATUS(block_cg(ctx, &a, b, 1e-10, 100, "solve", x, &figures), BATTEN_E_SINGULAR, ctx, "diagonal block 17");
  block[4] = NAN;
  T_STATUS(block_cg(ctx, &a, b, 1e-10, 100, "solve", x, &figures), BATTEN_E_SINGULAR, ctx, "diagonal block 17");
  block[4] = kept;
  for (size_t k = 0; k < 3; k++) block_matrix_at(&a, 0, 1)[4 * k] = block_matrix_at(&a, 1, 0)[4 * k] = 100;
  T_STATUS(block_cg(ctx, &a, b, 1e-10, 1000, "solve", x, &figures), BATTEN_E_SINGULAR, ctx, "not positive definite");
  free(b), free(x), free(g.pairs);
  block_matrix_free(ctx, &a);
}

static batten_status whole(batten_context *ctx, void *arg) {
  const scene_graph *g = arg;
  uint64_t seed = 3;
  block_matrix a;
  block_cg_figures figures;
  double b[200], x[200] = {0};
  for (size_t k = 0; k < 200; k++) b[k] = (double)k;
  batten_status st = scene_matrix(ctx, g, 2, 0.5, &seed, &a);
  if (st < 0) return st;
  st = block_cg(ctx, &a, b, 1e-10, 1000, "solve", x, &figures);
  block_matrix_free(ctx, &a);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_pattern(ctx);
  test_dense(ctx);
  test_threads();
  test_failures(ctx);
  scene_graph g = scene_grid(10, 10, false);
  t_fail_every_allocation("block_cg", whole, &g);
  t_cancel_every_progress("block_cg", whole, &g);
  free(g.pairs);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
