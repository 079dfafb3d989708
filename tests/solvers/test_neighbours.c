/* Nearest points: against all pairs, with ties, duplicates and lines. */
#include "base/neighbours.h"
#include "tap.h"

enum { MAX = 700, K = 7 };

static double points[MAX * 3];

/* The k nearest of all by selection over every pair, ties to the lower index. */
static size_t nearest_of_all(unsigned n, size_t count, const double *x, size_t k, size_t skip, size_t *index) {
  static double d[MAX];
  for (size_t i = 0; i < count; i++) {
    d[i] = 0;
    for (unsigned c = 0; c < n; c++) d[i] += (points[i * n + c] - x[c]) * (points[i * n + c] - x[c]);
  }
  if (skip < count) d[skip] = INFINITY;
  for (size_t j = 0; j < k; j++) {
    size_t best = SIZE_MAX;
    for (size_t i = 0; i < count; i++)
      if (d[i] < INFINITY && (best == SIZE_MAX || d[i] < d[best])) best = i;
    if (best == SIZE_MAX) return j;
    index[j] = best;
    d[best] = INFINITY;
  }
  return k;
}

static bool same_as_all_pairs(batten_context *ctx, unsigned n, size_t count) {
  static size_t index[MAX * K];
  static double distance[MAX * K];
  size_t k = count > K ? K : count - 1;
  if (batten_neighbours(ctx, n, count, points, k, index, distance) != BATTEN_OK) return false;
  bool same = true;
  for (size_t i = 0; i < count; i++) {
    size_t expected[K];
    nearest_of_all(n, count, points + i * n, k, i, expected);
    same = same && !memcmp(expected, index + i * k, k * sizeof *expected);
    for (size_t j = 1; j < k; j++) same = same && distance[i * k + j] >= distance[i * k + j - 1];
  }
  return same;
}

static void test_all_pairs(batten_context *ctx) {
  uint64_t seed = 11;
  for (unsigned n = 1; n <= 3; n++) {
    for (size_t i = 0; i < MAX * n; i++) points[i] = t_uniform(&seed);
    T_CHECK(same_as_all_pairs(ctx, n, MAX), "%d random points, n = %u", MAX, n);
    for (size_t i = 0; i < MAX * n; i++) points[i] = floor(5 * t_uniform(&seed));
    T_CHECK(same_as_all_pairs(ctx, n, MAX), "duplicates and ties on a lattice, n = %u", n);
    for (size_t i = 0; i < MAX * n; i++) points[i] = i % n == 0 ? (double)(i / n) : 1;
    T_CHECK(same_as_all_pairs(ctx, n, MAX), "a sorted line, n = %u", n);
    for (size_t i = 0; i < MAX * n; i++) points[i] = 3;
    T_CHECK(same_as_all_pairs(ctx, n, MAX), "all equal, n = %u", n);
  }
  size_t wrong = 0;
  for (size_t count = 2; count < 30; count++) wrong += !same_as_all_pairs(ctx, 2, count);
  T_CHECK(wrong == 0, "2 .. 29 points");
}

static void test_by_hand(batten_context *ctx) {
  const double line[4] = {0, 1, 3, 7};
  size_t index[8];
  double distance[8];
  T_OK(batten_neighbours(ctx, 1, 4, line, 2, index, distance), ctx);
  const size_t expected[8] = {1, 2, 0, 2, 1, 0, 2, 1};
  T_CHECK(!memcmp(expected, index, sizeof index) && distance[0] == 1 && distance[7] == 6, "0 1 3 7 by hand");
  batten_tree *tree = NULL;
  T_OK(batten_tree_new(ctx, 1, 4, line, &tree), ctx);
  double x = 2;
  T_CHECK(batten_tree_nearest(tree, &x, 8, SIZE_MAX, index, distance) == 4 && index[0] == 1 && index[1] == 2,
          "all four, the tie to the lower index");
  T_CHECK(batten_tree_within(tree, &x, 1, index) == 2, "two within 1");
  T_CHECK(batten_tree_within(tree, &x, 0.5, index) == 0, "none within 0.5");
  batten_tree_free(ctx, tree);
}

static void test_within(batten_context *ctx) {
  uint64_t seed = 5;
  batten_tree *tree = NULL;
  size_t index[MAX], wrong = 0;
  for (size_t i = 0; i < MAX * 3; i++) points[i] = t_uniform(&seed);
  batten_tree_new(ctx, 3, MAX, points, &tree);
  for (size_t q = 0; q < 50; q++) {
    double x[3] = {t_uniform(&seed), t_uniform(&seed), t_uniform(&seed)}, radius = 0.4 * t_uniform(&seed);
    size_t found = batten_tree_within(tree, x, radius, index), expected = 0;
    for (size_t i = 0; i < MAX; i++) {
      double sum = 0;
      for (size_t c = 0; c < 3; c++) sum += (points[3 * i + c] - x[c]) * (points[3 * i + c] - x[c]);
      expected += sum <= radius * radius;
    }
    wrong += found != expected;
  }
  batten_tree_free(ctx, tree);
  T_CHECK(wrong == 0, "balls hold as many as all pairs say");
}

/* Trees that are built by several tasks, and looked up in several pieces: the same from 1 and from 3 threads, and
 * what all pairs say at some of the points. A hundred places hold 20 points each. */
static void test_many(batten_context *ctx) {
  enum { MANY = 70000, DOUBLES = 2000, NEAR = 4 };
  batten_context *alone = t_context(NULL, NULL, 1);
  double *x = malloc(3 * MANY * sizeof *x), *distance[2];
  size_t *index[2], *order[2], wrong = 0, crowded = 0, expected = 0;
  uint64_t seed = 9;
  for (size_t i = 0; i < 3 * MANY; i++) x[i] = i < 3 * DOUBLES ? (double)(i / 3 % 100) : 100 * t_uniform(&seed);
  for (int t = 0; t < 2; t++) {
    batten_tree *tree = NULL;
    index[t] = malloc(MANY * NEAR * sizeof **index);
    order[t] = malloc(MANY * sizeof **order);
    distance[t] = malloc(MANY * NEAR * sizeof **distance);
    T_OK(batten_tree_new(t ? ctx : alone, 3, MANY, x, &tree), ctx);
    batten_tree_order(tree, order[t]);
    T_OK(batten_tree_neighbours(t ? ctx : alone, tree, NEAR, index[t], distance[t]), ctx);
    for (size_t i = 0; t && i < MANY; i += 97) {
      const bool near = batten_tree_any_within(tree, x + 3 * i, 0.5, i);
      crowded += near;
      expected += distance[t][i * NEAR] <= 0.5;
    }
    batten_tree_free(t ? ctx : alone, tree);
  }
  T_CHECK(!memcmp(index[0], index[1], MANY * NEAR * sizeof **index) &&
              !memcmp(distance[0], distance[1], MANY * NEAR * sizeof **distance) &&
              !memcmp(order[0], order[1], MANY * sizeof **order),
          "%d points: the same tree and neighbours by 1 and 3 threads", (int)MANY);
  for (size_t i = 0; i < MANY; i += 997) {
    size_t nearer = 0;
    const double last = distance[0][i * NEAR + NEAR - 1];
    for (size_t j = 0; j < MANY; j++) {
      double sum = 0;
      for (size_t c = 0; c < 3; c++) sum += (x[3 * i + c] - x[3 * j + c]) * (x[3 * i + c] - x[3 * j + c]);
      nearer += j != i && sqrt(sum) < last;
    }
    wrong += nearer >= NEAR;
  }
  T_CHECK(wrong == 0, "no point is nearer than they");
  T_CHECK(crowded == expected && crowded > 20, "%zu of %zu have somebody within 0.5", crowded, expected);
  for (int t = 0; t < 2; t++) {
    free(index[t]);
    free(order[t]);
    free(distance[t]);
  }
  free(x);
  batten_context_free(alone);
}

static batten_status call_neighbours(batten_context *ctx, void *arg) {
  size_t index[40];
  (void)arg;
  return batten_neighbours(ctx, 2, 20, points, 2, index, NULL);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 3);
  test_by_hand(ctx);
  test_all_pairs(ctx);
  test_within(ctx);
  test_many(ctx);
  size_t index[4];
  const double bad[4] = {0, 1, NAN, 2};
  T_STATUS(batten_neighbours(ctx, 4, 1, bad, 0, index, NULL), BATTEN_E_INVALID, ctx, "n: 4");
  T_STATUS(batten_neighbours(ctx, 2, 2, bad, 1, index, NULL), BATTEN_E_INVALID, ctx,
           "points[1]: coordinate 0 is nan");
  T_STATUS(batten_neighbours(ctx, 2, 2, bad, 2, index, NULL), BATTEN_E_INVALID, ctx, "k: 2 neighbours of 2");
  T_OK(batten_neighbours(ctx, 2, 0, NULL, 2, NULL, NULL), ctx);
  batten_context_free(ctx);
  t_fail_every_allocation("batten_neighbours", call_neighbours, NULL);
  return t_done();
}
