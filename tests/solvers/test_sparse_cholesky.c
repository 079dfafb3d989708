/* Cholesky of block systems, in a band and by fronts: against a factor by hand, dense Cholesky and conjugate
 * gradients; meshes, forests, cliques, stars; which way is chosen; what fails. */
#include "sparse_scene.h"

#include "la/la.h"
#include "sparse/fronts.h"

static const char *const names[] = {"auto", "band", "supernodal", "quick"};

/* b := A^-1 b; false when something went wrong. */
static bool solve_by(batten_context *ctx, const block_matrix *a, block_method method, double *b, block_method *used) {
  block_plan *plan;
  if (block_plan_new(ctx, a, method, &plan) != BATTEN_OK) return false;
  bool ok = block_factor(ctx, plan, a, NULL) == BATTEN_OK;
  if (ok) block_solve(ctx, plan, b);
  if (used) *used = block_plan_method(plan);
  block_plan_free(ctx, plan);
  return ok;
}

static void test_hand(batten_context *ctx) {
  /* [4 2 0; 2 5 2; 0 2 5] = L L', L = [2 0 0; 1 2 0; 0 1 2]; A (1, 1, 1) = (6, 9, 7) */
  static const uint32_t pairs[] = {0, 1, 1, 2};
  for (int method = BLOCK_BAND; method <= BLOCK_QUICK; method++) {
    block_matrix a;
    T_OK(block_matrix_new(ctx, 3, 1, 2, pairs, &a), ctx);
    for (size_t i = 0; i < 3; i++) *block_matrix_at(&a, i, i) = i ? 5 : 4;
    *block_matrix_at(&a, 0, 1) = *block_matrix_at(&a, 1, 0) = 2;
    *block_matrix_at(&a, 1, 2) = *block_matrix_at(&a, 2, 1) = 2;
    double x[3] = {6, 9, 7};
    T_CHECK(solve_by(ctx, &a, (block_method)method, x, NULL), "by hand, %s", names[method]);
    T_RATIO(fabs(x[0] - 1) + fabs(x[1] - 1) + fabs(x[2] - 1), 4e-16, "by hand, %s: (1, 1, 1)", names[method]);
    /* -5 in the corner: not definite at the last pivot of whatever order; the row is told */
    *block_matrix_at(&a, 2, 2) = -5;
    block_plan *plan;
    size_t row = 99;
    T_OK(block_plan_new(ctx, &a, (block_method)method, &plan), ctx);
    T_STATUS(block_factor(ctx, plan, &a, &row), BATTEN_E_SINGULAR, ctx, "not positive definite at row");
    T_CHECK(row < 3, "%s: row %zu", names[method], row);
    block_plan_free(ctx, plan);
    block_matrix_free(ctx, &a);
  }
}

/* Both ways against dense Cholesky, or against conjugate gradients where that is too large. */
static void compare(batten_context *ctx, const char *what, const scene_graph *g, unsigned size, uint64_t seed) {
  block_matrix a;
  T_OK(scene_matrix(ctx, g, size, 0.2, &seed, &a), ctx);
  size_t n = g->rows * size;
  double *b = scene_vector(n, &seed), *x = malloc(n * sizeof *x), *truth = malloc(n * sizeof *truth);
  memcpy(truth, b, n * sizeof *b);
  if (n <= 700) {
    double *full = scene_dense(&a);
    T_CHECK(batten_la_potrf(BATTEN_LA_DOUBLE, 'L', n, full, n) == 0, "%s, size %u: definite", what, size);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'N', n, full, n, truth);
    batten_la_trsv(BATTEN_LA_DOUBLE, 'L', 'T', n, full, n, truth);
    free(full);
  } else {
    block_cg_figures figures;
    memset(truth, 0, n * sizeof *truth);
    T_OK(block_cg(ctx, &a, b, 1e-13, 3000, "solve", truth, &figures), ctx);
  }
  for (int method = BLOCK_AUTO; method <= BLOCK_QUICK; method++) {
    block_method used = BLOCK_AUTO;
    memcpy(x, b, n * sizeof *b);
    bool ok = solve_by(ctx, &a, (block_method)method, x, &used);
    T_RATIO(ok ? scene_apart(n, x, truth) : INFINITY, 1e-10, "%s, %zu nodes, size %u, %s (%s)", what, g->rows, size,
            names[method], names[used]);
  }
  block_matrix_free(ctx, &a);
  free(b), free(x), free(truth);
}

static void test_graphs(batten_context *ctx) {
  uint64_t seed = 17;
  for (unsigned size = 1; size <= BLOCK_SIZE_MAX; size++) {
    scene_graph g = scene_grid(10, 9, size % 2);
    scene_shuffle(&g, &seed);
    compare(ctx, "grid", &g, size, seed);
    free(g.pairs);
    g = scene_random(90, 100, &seed); /* some components, single nodes among them */
    compare(ctx, "forest and more", &g, size, seed);
    free(g.pairs);
  }
  scene_graph g = scene_grid(40, 30, true);
  scene_shuffle(&g, &seed);
  compare(ctx, "torus", &g, 5, seed);
  free(g.pairs);
  g = scene_grid(50, 50, false);
  compare(ctx, "square", &g, 2, seed);
  free(g.pairs);
  /* everyone with everyone: one front, several tiles */
  g = (scene_graph){.rows = 110, .pairs = malloc(110 * 110 * 2 * sizeof *g.pairs)};
  for (uint32_t i = 0; i < 110; i++)
    for (uint32_t j = 0; j < i; j++) {
      g.pairs[2 * g.pair_count] = i;
      g.pairs[2 * g.pair_count++ + 1] = j;
    }
  compare(ctx, "clique", &g, 6, seed);
  /* a star: one node with many neighbours, leaves of it chained to nothing */
  g.pair_count = 0;
  for (uint32_t i = 1; i < 110; i++) {
    g.pairs[2 * g.pair_count] = 0;
    g.pairs[2 * g.pair_count++ + 1] = i;
  }
  compare(ctx, "star", &g, 4, seed);
  g.pair_count = 0;
  compare(ctx, "no neighbours", &g, 3, seed);
  free(g.pairs);
  g = (scene_graph){.rows = 0};
  block_matrix a;
  block_plan *plan;
  T_OK(block_matrix_new(ctx, 0, 5, 0, NULL, &a), ctx);
  for (int method = BLOCK_AUTO; method <= BLOCK_QUICK; method++) {
    T_OK(block_plan_new(ctx, &a, (block_method)method, &plan), ctx);
    T_OK(block_factor(ctx, plan, &a, NULL), ctx);
    block_solve(ctx, plan, NULL);
    block_plan_free(ctx, plan);
  }
  block_matrix_free(ctx, &a);
}

/* Orders are permutations, whatever the graph; on grids dissection has the fill that it should have. */
static void test_dissection(batten_context *ctx) {
  uint64_t seed = 31;
  for (int kind = 0; kind < 6; kind++) {
    static const char *const what[] = {"grid", "single nodes", "path", "star", "forest", "clique"};
    scene_graph g = kind == 0   ? scene_grid(70, 70, false)
                    : kind == 1 ? scene_grid(1, 1, false)
                    : kind == 2 ? scene_grid(3000, 1, false)
                    : kind == 4 ? scene_random(3000, 2000, &seed)
                                : scene_random(400, 80000, &seed);
    if (kind == 1) g.rows = 900;
    if (kind == 3)
      for (g.pair_count = 0; g.pair_count + 1 < g.rows; g.pair_count++) {
        g.pairs[2 * g.pair_count] = 0;
        g.pairs[2 * g.pair_count + 1] = (uint32_t)g.pair_count + 1;
      }
    if (kind != 1) scene_shuffle(&g, &seed);
    block_matrix a;
    sparse_graph graph;
    block_fronts fronts;
    uint32_t *order = malloc(g.rows * sizeof *order);
    unsigned char *met = calloc(g.rows, 1);
    bool once = true;
    T_OK(block_matrix_new(ctx, g.rows, 1, g.pair_count, g.pairs, &a), ctx);
    T_OK(block_graph(ctx, &a, &graph), ctx);
    T_OK(sparse_order_dissection(ctx, &graph, order), ctx);
    for (size_t p = 0; p < g.rows; p++) {
      once = once && order[p] < g.rows && !met[order[p]];
      if (once) met[order[p]] = 1;
    }
    T_CHECK(once, "%s: each of %zu nodes once", what[kind], g.rows);
    T_OK(block_fronts_new(ctx, &graph, 6, order, &fronts), ctx);
    /* a square grid takes 9.9 n^1.5 multiplications and as many additions [George, Liu 1981, 8.1] */
    if (kind == 0)
      T_RATIO(fronts.flops, 20 * 216 * pow((double)g.rows, 1.5), "grid of %zu nodes: flops, largest front %zu",
              g.rows, fronts.height_most);
    if (kind == 2) T_RATIO(fronts.flops, 25 * 216 * (double)g.rows, "path: flops");
    block_fronts_free(ctx, &fronts);
    sparse_graph_free(ctx, &graph);
    block_matrix_free(ctx, &a);
    free(order), free(met), free(g.pairs);
  }
}

/* The plan of a long strip is a band, that of a square one is fronts; flops are those of the formulas. */
static void test_choice(batten_context *ctx) {
  uint64_t seed = 4;
  for (int square = 0; square < 2; square++) {
    scene_graph g = square ? scene_grid(40, 40, false) : scene_grid(800, 1, false);
    scene_shuffle(&g, &seed);
    block_matrix a;
    block_plan *plan;
    T_OK(block_matrix_new(ctx, g.rows, square ? 5 : 1, g.pair_count, g.pairs, &a), ctx);
    T_OK(block_plan_new(ctx, &a, BLOCK_AUTO, &plan), ctx);
    T_CHECK(block_plan_method(plan) == (square ? BLOCK_SUPERNODAL : BLOCK_BAND), "%s: %s, %.3g flops, %zu bytes",
            square ? "square" : "strip", names[block_plan_method(plan)], block_plan_flops(plan),
            block_plan_bytes(plan));
    /* n (w + 1)^2 with w = 1 for a chain */
    if (!square) T_CHECK(block_plan_flops(plan) == 800 * 4, "a chain's band takes %g flops", block_plan_flops(plan));
    double least = block_plan_flops(plan);
    size_t told = block_plan_bytes(plan), held = batten_bytes_in_use(ctx);
    block_plan_free(ctx, plan);
    held -= batten_bytes_in_use(ctx);
    T_RATIO(fabs((double)held - (double)told), 0.02 * (double)told + 2048, "bytes held, %zu, beside those told",
            held);
    block_plan *quick;
    T_OK(block_plan_new(ctx, &a, BLOCK_QUICK, &quick), ctx);
    T_CHECK(block_plan_method(quick) == (square ? BLOCK_SUPERNODAL : BLOCK_BAND) && block_plan_flops(quick) >= least,
            "quick: %.3g flops", block_plan_flops(quick));
    block_plan_free(ctx, quick);
    block_matrix_free(ctx, &a);
    free(g.pairs);
  }
}

/* One plan, other numbers: a second matrix of the same pattern, an indefinite one in between. */
static void test_again(batten_context *ctx) {
  uint64_t seed = 8;
  scene_graph g = scene_grid(30, 30, true);
  block_matrix a;
  T_OK(scene_matrix(ctx, &g, 5, 0.5, &seed, &a), ctx);
  size_t n = g.rows * 5, row = 0;
  double *x = scene_vector(n, &seed), *b = malloc(n * sizeof *b), *r = malloc(n * sizeof *r);
  memcpy(b, x, n * sizeof *b);
  for (int method = BLOCK_BAND; method <= BLOCK_QUICK; method++) {
    block_plan *plan;
    T_OK(block_plan_new(ctx, &a, (block_method)method, &plan), ctx);
    T_OK(block_factor(ctx, plan, &a, NULL), ctx);
    double *block = block_matrix_at(&a, 417, 417), kept = block[12];
    block[12] = -1; /* a negative diagonal entry makes its own pivot negative, in any order */
    T_STATUS(block_factor(ctx, plan, &a, &row), BATTEN_E_SINGULAR, ctx, "at row 417 of 900");
    T_CHECK(row == 417, "%s: the row is told, %zu", names[method], row);
    block[12] = NAN;
    T_STATUS(block_factor(ctx, plan, &a, &row), BATTEN_E_SINGULAR, ctx, "at row 417 of 900");
    block[12] = kept;
    for (size_t k = 0; k < a.starts[a.rows] * 25; k++) a.values[k] *= 0.25;
    T_OK(block_factor(ctx, plan, &a, NULL), ctx);
    memcpy(x, b, n * sizeof *x);
    block_solve(ctx, plan, x);
    block_matrix_apply(ctx, &a, x, r);
    T_RATIO(scene_apart(n, r, b), 1e-13, "%s: residual with the second matrix of a plan", names[method]);
    block_plan_free(ctx, plan);
  }
  block_matrix_free(ctx, &a);
  free(x), free(b), free(r), free(g.pairs);
}

static void test_threads(void) {
  double *first = NULL;
  for (unsigned threads = 1; threads <= 4; threads += 3) {
    batten_context *ctx = t_context(NULL, NULL, threads);
    uint64_t seed = 12;
    scene_graph g = scene_grid(45, 40, true);
    block_matrix a;
    T_OK(scene_matrix(ctx, &g, 5, 0.5, &seed, &a), ctx);
    double *x = scene_vector(g.rows * 5, &seed);
    T_CHECK(solve_by(ctx, &a, BLOCK_SUPERNODAL, x, NULL), "%u threads", threads);
    if (first) T_CHECK(memcmp(first, x, g.rows * 5 * sizeof *x) == 0, "the same bits with 1 and 4 threads");
    free(first);
    first = x;
    block_matrix_free(ctx, &a);
    free(g.pairs);
    batten_context_free(ctx);
  }
  free(first);
}

static batten_status whole(batten_context *ctx, void *arg) {
  static const uint32_t pairs[] = {0, 1, 1, 2, 2, 3, 3, 0, 1, 3, 3, 4};
  const block_method *method = arg;
  scene_graph g = {.rows = 6, .pair_count = 6, .pairs = (uint32_t *)pairs};
  uint64_t seed = 2;
  block_matrix a;
  block_plan *plan;
  double x[12] = {1, 2, 3};
  batten_status st = scene_matrix(ctx, &g, 2, 1, &seed, &a);
  if (st < 0) return st;
  st = block_plan_new(ctx, &a, *method, &plan);
  if (st >= 0) {
    st = block_factor(ctx, plan, &a, NULL);
    if (st >= 0) block_solve(ctx, plan, x);
    block_plan_free(ctx, plan);
  }
  block_matrix_free(ctx, &a);
  return st;
}

static batten_status dissected(batten_context *ctx, void *arg) {
  const scene_graph *g = arg;
  block_matrix a;
  block_plan *plan;
  batten_status st = block_matrix_new(ctx, g->rows, 2, g->pair_count, g->pairs, &a);
  if (st < 0) return st;
  st = block_plan_new(ctx, &a, BLOCK_AUTO, &plan);
  if (st >= 0) block_plan_free(ctx, plan);
  block_matrix_free(ctx, &a);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_hand(ctx);
  test_graphs(ctx);
  test_choice(ctx);
  test_dissection(ctx);
  test_again(ctx);
  test_threads();
  scene_graph g = scene_grid(30, 20, false);
  t_fail_every_allocation("dissection", dissected, &g);
  free(g.pairs);
  for (block_method method = BLOCK_AUTO; method <= BLOCK_QUICK; method++)
    t_fail_every_allocation(names[method], whole, &method);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all memory is given back");
  batten_context_free(ctx);
  return t_done();
}
