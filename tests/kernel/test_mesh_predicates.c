/* Orientation signs against integer arithmetic, and the hash table and sort below the polygoniser. */
#include "mesh/predicates.h"
#include "mesh/table.h"

#include "tap.h"

typedef long long wide;

static int sign(wide v) { return v > 0 ? 1 : v < 0 ? -1 : 0; }

/* Coordinates of 20 bits: the determinant has 63 at most. The filter of doubles cannot tell the small ones. */
static wide determinant(wide p[4][3]) {
  wide m[3][3];
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) m[i][k] = p[i + 1][k] - p[0][k];
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

static void test_orient3d(void) {
  uint64_t seed = 4;
  size_t wrong = 0, zeros = 0, swapped = 0;
  enum { N = 20000 };
  for (int round = 0; round < N; round++) {
    wide p[4][3];
    double x[4][3], unit = ldexp(1, (int)(t_random(&seed) % 61) - 30);
    wide u[3], v[3];
    for (int k = 0; k < 3; k++) {
      p[0][k] = (wide)(t_random(&seed) % 1000);
      u[k] = (wide)(t_random(&seed) % 1000);
      v[k] = (wide)(t_random(&seed) % 1000);
    }
    /* Three more points of the plane of u and v, the last one off it by at most one unit. */
    for (int i = 1; i < 4; i++) {
      wide a = (wide)(t_random(&seed) % 300), b = (wide)(t_random(&seed) % 300);
      for (int k = 0; k < 3; k++) p[i][k] = p[0][k] + a * u[k] + b * v[k];
    }
    p[3][round % 3] += (wide)(t_random(&seed) % 3) - 1;
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < 3; k++) x[i][k] = unit * (double)p[i][k];
    int expected = sign(determinant(p)), got = batten_orient3d(x[0], x[1], x[2], x[3]);
    wrong += got != expected;
    zeros += expected == 0;
    swapped += batten_orient3d(x[1], x[0], x[2], x[3]) != -got || batten_orient3d(x[2], x[3], x[0], x[1]) != got;
  }
  T_CHECK(wrong == 0 && zeros > N / 10 && zeros < N, "orient3d: %zu of %d signs wrong, %zu zeros (seed 4)", wrong, N,
          zeros);
  T_CHECK(swapped == 0, "orient3d: %zu disagree when corners change places", swapped);
}

/* Points near a line at coordinates that differ in their last bits only. */
static void test_orient2d(void) {
  size_t wrong = 0, signs[3] = {0, 0, 0};
  for (int i = 0; i < 64; i++)
    for (int j = 0; j < 64; j++) {
      double a[2] = {0.5 + ldexp(i, -53), 0.5 + ldexp(j, -53)}, b[2] = {12, 12}, c[2] = {24, 24};
      int expected = sign(j - i), got = batten_orient2d(b, c, a, 0, 1);
      wrong += got != expected;
      signs[got + 1]++;
    }
  T_CHECK(wrong == 0, "orient2d: %zu of 4096 signs wrong; %zu right, %zu on, %zu left", wrong, signs[0], signs[1],
          signs[2]);
}

static void test_table(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  batten_table table = {0};
  enum { N = 20000 };
  bool ok = !batten_table_find(&table, 5);
  for (uint32_t i = 0; i < N; i++) {
    int is_new;
    uint32_t *place = batten_table_insert(ctx, &table, (uint64_t)(i % (N / 2)) << 20, i, &is_new);
    ok = ok && place && *place == i % (N / 2) && is_new == (i < N / 2);
  }
  for (uint32_t i = 0; i < N / 2; i++) {
    uint32_t *place = batten_table_find(&table, (uint64_t)i << 20);
    ok = ok && place && *place == i;
  }
  T_CHECK(ok && table.count == N / 2 && !batten_table_find(&table, 1), "table of %zu keys", table.count);
  batten_table_free(ctx, &table);

  uint64_t seed = 9, *keys = batten_alloc_array(ctx, N, sizeof *keys), sum = 0;
  for (size_t i = 0; i < N; i++) sum += keys[i] = t_random(&seed) >> (i % 64);
  ok = batten_sort_keys(ctx, N, keys) == BATTEN_OK;
  for (size_t i = 0; i < N; i++) {
    ok = ok && (i == 0 || keys[i - 1] <= keys[i]);
    sum -= keys[i];
  }
  T_CHECK(ok && sum == 0, "%d keys sorted", N);
  batten_free(ctx, keys);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all released");
  batten_context_free(ctx);
}

int main(void) {
  test_orient3d();
  test_orient2d();
  test_table();
  return t_done();
}
