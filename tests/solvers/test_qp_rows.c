/* Rows of constraints in place, dense, sparse and of the unit matrix, and the workspace's memory. */
#include <qp/engine.h>

#include "tap.h"

enum { N = 13, M = 40 };

typedef struct scene {
  double dense[M * N], values[M * N], scale[M + N], lower[M + N], upper[M + N];
  uint32_t indices[M * N], identity[N];
  size_t starts[M + 1], row[M + N];
  batten_matrix full, sparse;
  qp_rows rows;
} scene;

/* Every third entry is zero; every seventh row is left out, so that dense rows come in runs. */
static void make(scene *s, bool sparse, bool bounds, uint64_t seed) {
  size_t entries = 0;
  for (size_t i = 0; i < M; i++) {
    s->starts[i] = entries;
    for (size_t j = 0; j < N; j++) {
      double v = (i + j) % 3 == 0 ? 0 : t_uniform(&seed) - 0.5;
      s->dense[i * N + j] = v;
      if (v == 0) continue;
      s->indices[entries] = (uint32_t)j;
      s->values[entries++] = v;
    }
  }
  s->starts[M] = entries;
  s->full = batten_matrix_dense(M, N, s->dense);
  s->sparse = batten_matrix_sparse(M, N, s->starts, s->indices, s->values);
  size_t m = 0;
  for (size_t i = 0; i < M; i++)
    if (i % 7 != 3) s->row[m++] = i;
  for (size_t j = 0; bounds && j < N; j += 2) s->row[m++] = M + j;
  for (size_t k = 0; k < m; k++) s->scale[k] = 1 + t_uniform(&seed);
  for (size_t j = 0; j < N; j++) s->identity[j] = (uint32_t)j;
  s->rows = (qp_rows){.n = N, .m = m, .c = sparse ? &s->sparse : &s->full, .row = s->row, .identity = s->identity,
                      .scale = s->scale, .lower = s->lower, .upper = s->upper};
}

/* a_k'x from the definition. */
static long double product(const scene *s, size_t k, const double *x) {
  size_t row = s->rows.row[k];
  long double sum = 0;
  if (row >= M) sum = x[row - M];
  else
    for (size_t j = 0; j < N; j++) sum += (long double)s->dense[row * N + j] * x[j];
  return s->rows.scale[k] * sum;
}

static void test_products(bool sparse, bool bounds) {
  static scene s;
  make(&s, sparse, bounds, 5);
  uint64_t seed = 7;
  double x[N], out[M + N], to[N] = {0};
  long double expected[N] = {0};
  for (size_t j = 0; j < N; j++) x[j] = t_uniform(&seed) - 0.5;
  double worst = 0, worst_times = 0;
  for (size_t k = 0; k < s.rows.m; k++) {
    worst = fmax(worst, fabs((double)(qp_rows_dot(&s.rows, k, x) - product(&s, k, x))));
    qp_rows_add(&s.rows, k, 0.25 * (double)k, to);
    for (size_t j = 0; j < N; j++) {
      double unit[N] = {0};
      unit[j] = 1;
      expected[j] += 0.25L * k * product(&s, k, unit);
    }
  }
  for (size_t first = 0; first < s.rows.m; first += 3)
    for (size_t count = 0; first + count <= s.rows.m; count += 5) {
      qp_rows_times(&s.rows, first, count, x, out);
      for (size_t i = 0; i < count; i++)
        worst_times = fmax(worst_times, fabs((double)(out[i] - product(&s, first + i, x))));
    }
  double worst_add = 0;
  for (size_t j = 0; j < N; j++) worst_add = fmax(worst_add, fabs((double)(to[j] - expected[j])));
  const char *kind = sparse ? "sparse" : "dense";
  T_RATIO(worst, 1e-15 * N, "%s rows%s: a_k'x", kind, bounds ? " and bounds" : "");
  T_RATIO(worst_times, 1e-15 * N, "%s rows%s: runs of products", kind, bounds ? " and bounds" : "");
  T_RATIO(worst_add, 1e-14 * M * N, "%s rows%s: sums of rows", kind, bounds ? " and bounds" : "");
}

static void test_workspace(void) {
  t_memory memory = {0};
  batten_context *ctx = t_context(&memory, NULL, 1);
  batten_qp_workspace *w = NULL;
  T_OK(batten_qp_workspace_new(ctx, &w), ctx);
  size_t sizes[] = {1000, 24, 5000, 24, 0, 1000}, calls = 0;
  for (int round = 0; round < 3; round++) {
    void *block[6];
    for (size_t i = 0; i < 6; i++) {
      block[i] = batten_alloc(qp_context(w), sizes[i]);
      if (block[i]) memset(block[i], round, sizes[i]);
    }
    T_CHECK(block[0] && block[4] && block[0] != block[5] && (uintptr_t)block[2] % 64 == 0, "round %d has its blocks", round);
    for (size_t i = 0; i < 6; i++) batten_free(qp_context(w), block[i]);
    if (round == 0) calls = memory.calls;
    T_CHECK(memory.calls == calls, "round %d takes %zu blocks from the host", round, memory.calls - calls);
    T_CHECK(batten_bytes_in_use(qp_context(w)) == 0, "round %d holds nothing", round);
  }
  void *large = batten_alloc(qp_context(w), 100000);
  T_CHECK(large && memory.calls == calls + 1, "a larger block is taken from the host");
  batten_free(qp_context(w), large);
  void *tiny = batten_alloc(qp_context(w), 5010);
  T_CHECK(memory.calls == calls + 1, "a kept block of about the size serves");
  batten_free(qp_context(w), tiny);
  batten_qp_workspace_free(w);
  T_CHECK(memory.live == 1 && batten_bytes_in_use(ctx) == 0, "the workspace leaves nothing");
  batten_qp_workspace_free(NULL);
  T_STATUS(batten_qp_workspace_new(ctx, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  batten_context_free(ctx);
  T_CHECK(batten_qp_workspace_new(NULL, &w) == BATTEN_E_INVALID, "no context");
}

static void test_limited_workspace(void) {
  batten_context_options o = batten_context_options_default();
  o.memory_limit = 100000;
  batten_context *ctx = NULL;
  T_CHECK(batten_context_new(&o, &ctx) == BATTEN_OK, "a context with a limit");
  batten_qp_workspace *w = NULL;
  T_OK(batten_qp_workspace_new(ctx, &w), ctx);
  batten_free(qp_context(w), batten_alloc(qp_context(w), 70000));
  void *other = batten_alloc(qp_context(w), 20000 + 70000);
  T_CHECK(other, "a kept block of another size makes room");
  batten_free(qp_context(w), other);
  batten_qp_workspace_free(w);
  batten_context_free(ctx);
}

static batten_status make_workspace(batten_context *ctx, void *arg) {
  (void)arg;
  batten_qp_workspace *w;
  batten_status st = batten_qp_workspace_new(ctx, &w);
  if (st == BATTEN_OK) {
    void *block = batten_alloc(qp_context(w), 100);
    if (!block) st = BATTEN_E_NOMEM;
    batten_free(qp_context(w), block);
    batten_qp_workspace_free(w);
  }
  return st;
}

int main(void) {
  for (int sparse = 0; sparse < 2; sparse++)
    for (int bounds = 0; bounds < 2; bounds++) test_products(sparse != 0, bounds != 0);
  test_workspace();
  test_limited_workspace();
  t_fail_every_allocation("a workspace", make_workspace, NULL);
  return t_done();
}
