/* Delaunay triangulations against their definition: no point inside of any triangle's circle, by brute force over all
 * points with exact signs; counts by Euler; and the exact sign of the circle test against integer arithmetic. */
#include "mesh/delaunay.h"

#include "mesh/predicates.h"
#include "tap.h"

/* ---- the circle test ------------------------------------------------------------------------------ */

#if defined(__SIZEOF_INT128__)
__extension__ typedef __int128 wide;
static int wide_sign(wide x) { return (x > 0) - (x < 0); }

/* Coordinates p [4][2] below 2^26 in size: the determinant stays below 2^110. */
static int incircle_integer(int64_t p[4][2]) {
  wide d[3][2], lift[3], det = 0;
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 2; k++) d[i][k] = (wide)p[i][k] - p[3][k];
    lift[i] = d[i][0] * d[i][0] + d[i][1] * d[i][1];
  }
  for (int i = 0; i < 3; i++) {
    wide *q = d[(i + 1) % 3], *r = d[(i + 2) % 3];
    det += lift[i] * (q[0] * r[1] - q[1] * r[0]);
  }
  return wide_sign(det);
}

static void check_incircle(const char *what, double unit, double shift, int64_t size, uint64_t seed) {
  enum { N = 20000 };
  size_t wrong = 0, zeros = 0, swapped = 0;
  for (int trial = 0; trial < N; trial++) {
    int64_t p[4][2];
    double x[4][2];
    for (int i = 0; i < 4; i++)
      for (int k = 0; k < 2; k++) {
        p[i][k] = (int64_t)(t_random(&seed) % (uint64_t)(2 * size + 1)) - size;
        x[i][k] = unit * ((double)p[i][k] + shift);
      }
    if (trial % 2) { /* four of (+-x, +-y), (+-y, +-x): on a circle, or one of them next to it */
      for (int i = 1; i < 4; i++) {
        uint64_t way = t_random(&seed);
        for (int k = 0; k < 2; k++) p[i][k] = p[0][way & 1 ? 1 - k : k] * (way >> (1 + k) & 1 ? 1 : -1);
      }
      p[3][0] += trial % 8 == 1;
      for (int i = 1; i < 4; i++)
        for (int k = 0; k < 2; k++) x[i][k] = unit * ((double)p[i][k] + shift);
    }
    int expected = incircle_integer(p), got = batten_incircle(x[0], x[1], x[2], x[3]);
    wrong += got != expected;
    zeros += expected == 0;
    swapped += batten_incircle(x[1], x[0], x[2], x[3]) != -got || batten_incircle(x[3], x[0], x[1], x[2]) != -got;
  }
  T_CHECK(wrong == 0 && zeros > N / 4 && zeros < N, "incircle, %s: %zu of %d signs wrong, %zu zeros", what, wrong, N,
          zeros);
  T_CHECK(swapped == 0, "incircle, %s: %zu disagree when corners change places", what, swapped);
}

static void test_incircle(void) {
  check_incircle("small integers", 1, 0, 3, 1);
  check_incircle("large integers", 1, 0, 1 << 24, 2);
  check_incircle("far from the origin", 1, 0x1p45, 1 << 6, 3);
  check_incircle("near 1e-150", 0x1p-500, 0, 1 << 20, 4);
  check_incircle("near 1e-300", 0x1p-1000, 0, 1 << 10, 5);
  check_incircle("near 1e+290", 0x1p960, 0, 1 << 20, 6);
}
#else
static void test_incircle(void) { t_skip("incircle", "no integers of 128 bits"); }
#endif

/* Three points of a rectangle with the fourth one unit in the last place inside, on, and outside. */
static void test_incircle_ulp(void) {
  double a[2] = {0.1, 0.2}, b[2] = {0.7, 0.2}, c[2] = {0.7, 0.9}, d[2] = {0.1, 0.9};
  int on = batten_incircle(a, b, c, d);
  d[1] = nextafter(0.9, 0);
  int inside = batten_incircle(a, b, c, d);
  d[1] = nextafter(0.9, 1);
  int outside = batten_incircle(a, b, c, d);
  T_CHECK(on == 0 && inside == 1 && outside == -1, "a rectangle's corner, moved by its last bit: %d %d %d", inside,
          on, outside);
}

/* ---- triangulations ------------------------------------------------------------------------------- */

static const double *cross_points; /* of the comparison below */

static int compare_places(const void *a, const void *b) {
  const double *p = cross_points + 2 * *(const uint32_t *)a, *q = cross_points + 2 * *(const uint32_t *)b;
  for (int k = 0; k < 2; k++)
    if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
  return *(const uint32_t *)a < *(const uint32_t *)b ? -1 : 1;
}

/* Points on the boundary of the hull, those within its sides too; 0 for points on a line. order: of the places. */
static size_t count_hull(size_t n, const double *points, const uint32_t *order) {
  uint32_t *hull = malloc((2 * n + 2) * sizeof *hull);
  size_t size = 0;
  bool line = true;
  for (size_t i = 2; i < n && line; i++)
    line = batten_orient2d(points + 2 * order[0], points + 2 * order[1], points + 2 * order[i], 0, 1) == 0;
  for (int upper = 0; upper < 2; upper++) {
    size_t first = size;
    for (size_t i = 0; i < n; i++) {
      const double *p = points + 2 * order[upper ? n - 1 - i : i];
      while (size > first + 1 &&
             batten_orient2d(points + 2 * hull[size - 2], points + 2 * hull[size - 1], p, 0, 1) < 0)
        size--;
      hull[size++] = order[upper ? n - 1 - i : i];
    }
    size--;
  }
  free(hull);
  return line ? 0 : size;
}

/* All that defines a Delaunay triangulation. */
static void check_delaunay(const char *what, size_t count, const double *points) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  size_t triangle_count = 0, places = 0, wrong_first = 0, turned = 0, inside = 0, unused = 0;
  uint32_t *triangles = NULL, *first = malloc((count + 1) * sizeof *first);
  uint32_t *order = malloc((count + 1) * sizeof *order);
  T_OK(batten_mesh_delaunay(ctx, count, points, first, &triangle_count, &triangles), ctx);
  for (uint32_t i = 0; i < count; i++) order[i] = i;
  cross_points = points;
  qsort(order, count, sizeof *order, compare_places);
  for (size_t i = 0; i < count; i++) {
    if (i == 0 || memcmp(points + 2 * order[i], points + 2 * order[places - 1], 2 * sizeof(double)) != 0)
      order[places++] = order[i];
    wrong_first += first[order[i]] != order[places - 1];
  }
  unsigned char *used = calloc(count + 1, 1);
  for (size_t t = 0; t < triangle_count; t++) {
    const uint32_t *c = triangles + 3 * t;
    const double *p[3] = {points + 2 * c[0], points + 2 * c[1], points + 2 * c[2]};
    turned += batten_orient2d(p[0], p[1], p[2], 0, 1) <= 0;
    for (size_t i = 0; i < places; i++) inside += batten_incircle(p[0], p[1], p[2], points + 2 * order[i]) > 0;
    for (int k = 0; k < 3; k++) used[c[k]] = 1;
  }
  size_t hull = places > 2 ? count_hull(places, points, order) : 0;
  for (size_t i = 0; i < places && hull; i++) unused += !used[order[i]];
  size_t expected = hull ? 2 * places - 2 - hull : 0; /* Euler */
  T_CHECK(
      turned == 0 && inside == 0 && unused == 0 && wrong_first == 0 && triangle_count == expected,
      "%s: %zu points at %zu places, %zu on the hull; %zu triangles of %zu; %zu turned, %zu points in circles, %zu "
      "places without triangle, %zu wrong first indices",
      what, count, places, hull, triangle_count, expected, turned, inside, unused, wrong_first);
  batten_free(ctx, triangles);
  batten_context_free(ctx);
  free(used);
  free(order);
  free(first);
}

enum { POINTS = 700 };

static void test_random(void) {
  double p[2 * POINTS], q[2 * POINTS];
  uint64_t seed = 7;
  for (int i = 0; i < 2 * POINTS; i++) p[i] = t_uniform(&seed);
  check_delaunay("random", POINTS, p);
  for (size_t n = 0; n <= 12; n++) check_delaunay("few", n, p);
  for (int i = 0; i < 2 * POINTS; i++) q[i] = p[i] * 1e150;
  check_delaunay("near 1e150", POINTS, q);
  for (int i = 0; i < 2 * POINTS; i++) q[i] = p[i] * 1e-150;
  check_delaunay("near 1e-150", POINTS, q);
  for (int i = 0; i < POINTS; i++) {
    int cluster = i % 7;
    for (int k = 0; k < 2; k++) q[2 * i + k] = sin(cluster * (k + 2)) + ldexp(p[2 * i + k], -6 * cluster);
  }
  check_delaunay("clusters", POINTS, q);
  for (int i = 0; i < POINTS; i++) {
    q[2 * i] = p[2 * i] * 1e-9;
    q[2 * i + 1] = p[2 * i + 1];
  }
  check_delaunay("a strip", POINTS, q);
}

static void test_special(void) {
  double p[2 * POINTS];
  uint64_t seed = 9;
  for (int i = 0; i < 625; i++) {
    p[2 * i] = i % 25;
    p[2 * i + 1] = i / 25;
  }
  check_delaunay("a grid", 625, p);
  for (int i = 0; i < 1250; i++) p[i] = 0.1 * p[i] + 0.3;
  check_delaunay("a grid of tenths", 625, p);
  for (int i = 0; i < 625; i++) {
    double x = p[2 * i], y = p[2 * i + 1];
    p[2 * i] = x * cos(0.3) - y * sin(0.3);
    p[2 * i + 1] = x * sin(0.3) + y * cos(0.3);
  }
  check_delaunay("a grid, turned", 625, p);
  for (int i = 0; i < POINTS; i++) {
    p[2 * i] = cos(2 * 3.14159265358979323846 * i / POINTS);
    p[2 * i + 1] = sin(2 * 3.14159265358979323846 * i / POINTS);
  }
  check_delaunay("a circle", POINTS, p);
  static const int8_t ring[12][2] = {{5, 0},  {4, 3},   {3, 4},   {0, 5},  {-3, 4}, {-4, 3},
                                     {-5, 0}, {-4, -3}, {-3, -4}, {0, -5}, {3, -4}, {4, -3}};
  for (int i = 0; i < 12; i++)
    for (int k = 0; k < 2; k++) p[2 * i + k] = ring[i][k];
  check_delaunay("twelve points on a circle", 12, p);
  p[24] = p[25] = 0;
  check_delaunay("twelve points on a circle and its centre", 13, p);
  for (int i = 0; i < POINTS; i++) {
    p[2 * i] = (double)(t_random(&seed) % 6);
    p[2 * i + 1] = (double)(t_random(&seed) % 6);
  }
  check_delaunay("duplicates", POINTS, p);
  for (int i = 0; i < 50; i++) {
    p[2 * i] = (double)(t_random(&seed) % 30);
    p[2 * i + 1] = 3 * p[2 * i] + 1;
  }
  check_delaunay("a line", 50, p);
  p[2 * 17 + 1] += 1;
  check_delaunay("a line and a point beside it", 50, p);
  for (int i = 0; i < 50; i++) p[2 * i] = 0.1;
  check_delaunay("a line of equal x", 50, p);
  for (int i = 0; i < 100; i++) p[i] = 0.1;
  check_delaunay("one place", 50, p);
  for (int i = 0; i < 60; i++) { /* points on a parabola next to a far one: long thin triangles */
    p[2 * i] = i - 30;
    p[2 * i + 1] = 1e-9 * (i - 30) * (i - 30);
  }
  p[120] = 0;
  p[121] = 1e9;
  check_delaunay("a flat parabola and a far point", 61, p);
}

/* Coordinates of all sizes at once, some of which vanish beside others: each point is a corner, or at the place of
 * one. */
static void test_ranges(void) {
  enum { N = 200, TRIALS = 300 };
  batten_context *ctx = t_context(NULL, NULL, 1);
  double p[2 * N];
  uint32_t first[N], *triangles = NULL;
  size_t wrong = 0, largest = 0;
  uint64_t seed = 19;
  for (int trial = 0; trial < TRIALS; trial++) {
    size_t n = 3 + t_random(&seed) % (N - 2), triangle_count = 0;
    for (size_t i = 0; i < 2 * n; i++) {
      int lower = (int)(t_random(&seed) % 1060);
      p[i] = trial % 2 ? ldexp(t_uniform(&seed) - 0.5, -lower) : (double)(t_random(&seed) % 5) * 0x1p-1074;
    }
    p[0] = trial % 2 ? p[0] : 1e300;
    T_OK(batten_mesh_delaunay(ctx, n, p, first, &triangle_count, &triangles), ctx);
    bool used[N] = {false};
    for (size_t t = 0; t < triangle_count; t++) {
      const uint32_t *c = triangles + 3 * t;
      for (int k = 0; k < 3; k++) used[c[k]] = true;
    }
    for (size_t i = 0; i < n; i++) {
      wrong += first[i] > i || first[first[i]] != first[i];
      wrong += triangle_count > 0 && !used[first[i]];
      for (size_t k = 0; k < 2; k++) wrong += fabs(p[2 * first[i] + k] - p[2 * i + k]) > 0x1p-255 * fabs(p[0] + 1);
    }
    if (triangle_count > largest) largest = triangle_count;
    batten_free(ctx, triangles);
  }
  T_CHECK(wrong == 0 && largest > 100, "coordinates down to 1e-320 beside 1: %zu wrong, up to %zu triangles", wrong,
          largest);
  batten_context_free(ctx);
}

/* ---- invariance, cost, failures ------------------------------------------------------------------- */

static int compare_triples(const void *a, const void *b) { return memcmp(a, b, 3 * sizeof(uint32_t)); }

static size_t sorted_triangles(batten_context *ctx, size_t count, const double *points, const uint32_t *name,
                               uint32_t **out) {
  size_t n = 0;
  if (batten_mesh_delaunay(ctx, count, points, NULL, &n, out) < 0) return 0;
  for (size_t t = 0; t < n; t++) {
    uint32_t *c = *out + 3 * t;
    for (int k = 0; k < 3; k++) c[k] = name[c[k]];
    while (c[0] > c[1] || c[0] > c[2]) {
      uint32_t x = c[0];
      c[0] = c[1];
      c[1] = c[2];
      c[2] = x;
    }
  }
  qsort(*out, n, 3 * sizeof **out, compare_triples);
  return n;
}

/* The order of the points, and powers of two, change nothing: on a grid neither. */
static void test_invariance(void) {
  enum { N = 900 };
  batten_context *ctx = t_context(NULL, NULL, 1);
  double p[2 * N], q[2 * N];
  uint32_t name[N], same[N], *a = NULL, *b = NULL;
  uint64_t seed = 11;
  for (int kind = 0; kind < 2; kind++) {
    for (uint32_t i = 0; i < N; i++) {
      same[i] = name[i] = i;
      p[2 * i] = kind ? i % 30 : t_uniform(&seed);
      p[2 * i + 1] = kind ? i / 30 : t_uniform(&seed);
    }
    for (uint32_t i = N - 1; i > 0; i--) {
      uint32_t j = (uint32_t)(t_random(&seed) % (i + 1)), x = name[i];
      name[i] = name[j];
      name[j] = x;
    }
    for (uint32_t i = 0; i < N; i++)
      for (int k = 0; k < 2; k++) q[2 * i + (uint32_t)k] = ldexp(p[2 * name[i] + (uint32_t)k], 300);
    size_t n = sorted_triangles(ctx, N, p, same, &a), m = sorted_triangles(ctx, N, q, name, &b);
    T_CHECK(n > 0 && n == m && memcmp(a, b, 3 * n * sizeof *a) == 0,
            "%s: other order and scale, the same %zu triangles", kind ? "a grid" : "random points", n);
    batten_free(ctx, a);
    batten_free(ctx, b);
  }
  batten_context_free(ctx);
}

static void test_time(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  double time[2] = {0, 0};
  for (int large = 0; large < 2; large++) {
    size_t count = large ? 80000 : 10000, triangle_count = 0;
    double *p = malloc(2 * count * sizeof *p);
    uint64_t seed = 13;
    for (size_t i = 0; i < 2 * count; i++) p[i] = t_uniform(&seed);
    uint32_t *triangles = NULL;
    double start = batten_now();
    T_OK(batten_mesh_delaunay(ctx, count, p, NULL, &triangle_count, &triangles), ctx);
    time[large] = batten_now() - start;
    batten_free(ctx, triangles);
    free(p);
  }
  /* Eight times the points are about eleven times the work; 64 would be quadratic. */
  T_RATIO(time[1] / fmax(time[0], 1e-4), 40, "80000 random points, %.3f s, against 10000", time[1]);
  batten_context_free(ctx);
}

static batten_status triangulate_once(batten_context *ctx, void *arg) {
  size_t n = 0;
  uint32_t *triangles = NULL;
  batten_status st = batten_mesh_delaunay(ctx, 20, arg, NULL, &n, &triangles);
  batten_free(ctx, triangles);
  return st;
}

static void test_failures(void) {
  double p[40];
  uint64_t seed = 17;
  for (int i = 0; i < 40; i++) p[i] = t_uniform(&seed);
  t_fail_every_allocation("a triangulation", triangulate_once, p);
  batten_context *ctx = t_context(NULL, NULL, 1);
  size_t n = 0;
  uint32_t *triangles = NULL;
  T_STATUS(batten_mesh_delaunay(ctx, (size_t)1 << 30, p, NULL, &n, &triangles), BATTEN_E_TOO_LARGE, ctx, "count: ");
  batten_context_free(ctx);
}

int main(void) {
  test_incircle();
  test_incircle_ulp();
  test_random();
  test_special();
  test_ranges();
  test_invariance();
  test_time();
  test_failures();
  return t_done();
}
