/* kernel/basis/polygon.h: nesting, the way round, crossings and touches, distances against brute force, bounds,
 * overlaps of components. */
#include "basis/polygon.h"

#include <string.h>

#include "tap.h"

static const double PI = 3.14159265358979323846;

static batten_context *ctx;

/* ---- brute force --------------------------------------------------------------------------------- */

static double brute_distance(size_t count, const size_t *starts, const double *points, const double *x) {
  double best = INFINITY;
  bool inside = false;
  for (size_t k = 0; k < count; k++)
    for (size_t i = starts[k]; i < starts[k + 1]; i++) {
      const double *a = points + 2 * i, *b = points + 2 * (i + 1 < starts[k + 1] ? i + 1 : starts[k]);
      double ux = b[0] - a[0], uy = b[1] - a[1], s = ((x[0] - a[0]) * ux + (x[1] - a[1]) * uy) / (ux * ux + uy * uy);
      s = fmin(fmax(s, 0), 1);
      best = fmin(best, hypot(x[0] - a[0] - s * ux, x[1] - a[1] - s * uy));
      if ((a[1] > x[1]) != (b[1] > x[1]) && x[0] < a[0] + (x[1] - a[1]) / uy * ux) inside = !inside;
    }
  return inside ? best : -best;
}

static void ring(size_t n, double x, double y, double r, double wave, bool backwards, double *points) {
  for (size_t i = 0; i < n; i++) {
    double a = 2 * PI * (double)(backwards ? n - i : i) / (double)n, s = r * (1 + wave * sin(5 * a));
    points[2 * i] = x + s * cos(a);
    points[2 * i + 1] = y + s * sin(a);
  }
}

static batten_status make(size_t count, const size_t *starts, const double *points, polygon_set *p,
                          polygon_fault *fault) {
  *fault = (polygon_fault){POLYGON_SOUND, {0, 0}, {0, 0}, {0, 0}};
  return polygon_set_make(ctx, count, starts, points, 0, p, NULL, fault);
}

/* ---- cases by hand ------------------------------------------------------------------------------- */

/* A square with a square hole, an island in the hole and a square beside: given every way round. */
static void test_nest(void) {
  static const double side[5][3] = {{0, 0, 1}, {0, 0, 4}, {10, 0, 2}, {0, 0, 2}, {0, 0, 0.5}};
  static const unsigned depth[5] = {2, 0, 0, 1, 3};
  static const size_t parent[5] = {3, SIZE_MAX, SIZE_MAX, 1, 0};
  static const size_t starts[6] = {0, 4, 8, 12, 16, 20};
  for (unsigned turned = 0; turned < 32; turned++) {
    double points[40];
    for (size_t k = 0; k < 5; k++)
      for (size_t i = 0; i < 4; i++) {
        size_t j = turned >> k & 1 ? 3 - i : i;
        points[8 * k + 2 * i] = side[k][0] + (j == 1 || j == 2 ? 1 : -1) * side[k][2];
        points[8 * k + 2 * i + 1] = side[k][1] + (j >= 2 ? 1 : -1) * side[k][2];
      }
    polygon_set p;
    polygon_fault fault;
    if (make(5, starts, points, &p, &fault) != BATTEN_OK) {
      T_CHECK(false, "nested squares, turned %u", turned);
      return;
    }
    bool ok =
        p.count == 5 && p.area == 64 + 16 - 16 + 4 - 1 && p.spacing == 4 && p.lower[0] == -4 && p.upper[0] == 12;
    for (size_t k = 0; k < 5; k++) {
      double twice = 0;
      for (size_t i = 0; i < 4; i++) {
        const double *a = p.points + 8 * k + 2 * i, *b = p.points + 8 * k + 2 * ((i + 1) % 4);
        twice += a[0] * b[1] - a[1] * b[0];
      }
      ok = ok && p.depth[k] == depth[k] && p.parent[k] == parent[k] && p.given[k] == k &&
           (twice > 0) == (depth[k] % 2 == 0);
    }
    /* The tree's edges must go with the points, which may have been turned. */
    for (size_t k = 0; k < 20; k++) {
      size_t e = p.tree.boxes.order[k], first = p.starts[p.tree.loop[e]];
      size_t next = e + 1 < first + 4 ? e + 1 : first;
      ok = ok && memcmp(p.tree.leaves + 4 * k, p.points + 2 * e, 16) == 0 &&
           memcmp(p.tree.leaves + 4 * k + 2, p.points + 2 * next, 16) == 0;
    }
    if (!ok || turned == 31) T_CHECK(ok, "five squares in three depths, turned %u", turned);
    double area, center[2];
    polygon_component_measure(&p, 1, &area, center);
    if (turned == 31) T_CHECK(area == 48 && center[0] == 0 && center[1] == 0, "the outer square without its hole");
    double x[2] = {3, 0.25}, nearest[2];
    size_t edge;
    double d = polygon_distance(&p, x, nearest, &edge);
    if (turned == 31)
      T_CHECK(d == 1 && nearest[1] == 0.25 && (nearest[0] == 2 || nearest[0] == 4) && edge < 20, "distance %g", d);
    unsigned char chosen[5] = {0, 0, 1, 0, 0};
    if (turned == 31) T_CHECK(polygon_distance_to(&p, chosen, x) == 5, "distance to the square beside alone");
    polygon_set_free(&p);
    if (!ok) return;
  }
}

static void expect_fault(const char *what, size_t count, const size_t *starts, const double *points, bool fails,
                         size_t loop0, size_t loop1, size_t edge0, size_t edge1) {
  size_t total = starts[count];
  /* Every first point, both ways round, and exchanged axes: the verdict is the same. */
  bool ok = true;
  for (size_t way = 0; way < 4; way++)
    for (size_t first = 0; first < 4; first++) {
      double moved[64];
      for (size_t k = 0; k < count; k++) {
        size_t n = starts[k + 1] - starts[k];
        for (size_t i = 0; i < n; i++) {
          size_t j = starts[k] + (way & 1 ? n - 1 - (i + first) % n : (i + first) % n);
          moved[2 * (starts[k] + i)] = points[2 * j + (way >> 1)];
          moved[2 * (starts[k] + i) + 1] = points[2 * j + 1 - (way >> 1)];
        }
      }
      polygon_set p;
      polygon_fault fault;
      batten_status st = make(count, starts, way + first == 0 ? points : moved, &p, &fault);
      bool here = st == (fails ? BATTEN_E_INVALID : BATTEN_OK) && (fault.kind == POLYGON_CROSSING) == fails;
      if (fails && way + first == 0) {
        here = here && fault.loop[0] == loop0 && fault.loop[1] == loop1 && fault.edge[0] == edge0 &&
               fault.edge[1] == edge1;
        if (!here)
          printf("# loops %zu %zu edges %zu %zu\n", fault.loop[0], fault.loop[1], fault.edge[0], fault.edge[1]);
      }
      if (st == BATTEN_OK) polygon_set_free(&p);
      if (!here) printf("# way %zu first %zu: %s\n", way, first, batten_status_name(st));
      ok = ok && here;
    }
  T_CHECK(ok, "%s (%zu points)", what, total);
}

/* Edges that run there and back bound nothing, whatever hangs at their other end. */
static void test_there_and_back(void) {
  const struct {
    const char *what;
    size_t count;
    double points[24][2];
    size_t loops;
    double area;
  } cases[] = {
      {"a hole tied to its outer loop",
       10,
       {{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}},
       2,
       81 - 9},
      {"the same, turned the same way",
       10,
       {{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {6, 3}, {6, 6}, {3, 6}, {3, 3}},
       2,
       81 - 9},
      {"a tie of three edges",
       14,
       {{0, 0},
        {9, 0},
        {9, 9},
        {0, 9},
        {0, 0},
        {1, 2},
        {2, 2},
        {3, 3},
        {3, 6},
        {6, 6},
        {6, 3},
        {3, 3},
        {2, 2},
        {1, 2}},
       2,
       81 - 9},
      {"two holes at one vertex, an island tied to one",
       20,
       {{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {1, 3}, {1, 8}, {6, 8}, {6, 3}, {1, 3},
        {2, 4}, {3, 4}, {3, 5}, {2, 4}, {1, 3}, {0, 0}, {4, 1}, {8, 1}, {8, 2}, {4, 1}},
       4,
       81 - 25 + 0.5 - 2},
      {"spikes, one of them at the first point", 7, {{5, 5}, {0, 0}, {4, 0}, {4, 4}, {7, 4}, {4, 4}, {0, 0}}, 1, 8},
      {"a line there and back", 4, {{0, 0}, {1, 0}, {2, 1}, {1, 0}}, 0, 0},
  };
  for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
    const size_t n = cases[c].count;
    bool ok = true;
    for (size_t way = 0; way < 2 * n; way++) {
      double points[24][2];
      for (size_t i = 0; i < n; i++) {
        size_t j = (way / 2 + i) % n;
        memcpy(points[i], cases[c].points[way % 2 ? n - 1 - j : j], sizeof *points);
      }
      polygon_set p = {.ctx = ctx};
      polygon_fault fault = {POLYGON_SOUND, {0, 0}, {0, 0}, {0, 0}};
      unsigned char dropped = 2;
      batten_status st = polygon_set_make(ctx, 1, (const size_t[]){0, n}, points[0], 1e-9, &p, &dropped, &fault);
      ok = ok && st == BATTEN_OK && p.count == cases[c].loops && fabs(p.area - cases[c].area) < 1e-12 &&
           dropped == (cases[c].loops == 0);
      for (size_t k = 0; st == BATTEN_OK && k < p.count; k++) ok = ok && p.given[k] == 0;
      if (!ok) printf("# way %zu: %s, %zu loops, area %g\n", way, batten_status_name(st), p.count, p.area);
      if (st == BATTEN_OK) polygon_set_free(&p);
      if (!ok) break;
    }
    T_CHECK(ok, "%s: %zu loops, area %g", cases[c].what, cases[c].loops, cases[c].area);
  }
}

static void test_crossings(void) {
  const double bow[] = {0, 0, 2, 2, 2, 0, 0, 2};
  expect_fault("a bow crosses itself", 1, (const size_t[]){0, 4}, bow, true, 0, 0, 0, 2);
  const double bow_vertex[] = {0, 0, 1, 1, 2, 2, 2, 0, 1, 1, 0, 2};
  expect_fault("a bow through a shared vertex", 1, (const size_t[]){0, 6}, bow_vertex, true, 0, 0, 1, 4);
  const double touch[] = {0, 0, 1, 1, 2, 0, 2, 2, 1, 1, 0, 2};
  expect_fault("a loop that touches itself at a vertex", 1, (const size_t[]){0, 6}, touch, false, 0, 0, 0, 0);
  const double spike[] = {0, 0, 4, 0, 2, 0, 2, 3};
  expect_fault("a spike runs back along its edge", 1, (const size_t[]){0, 4}, spike, true, 0, 0, 0, 1);
  const double two[] = {0, 0, 2, 0, 2, 2, 0, 2, 1, 1, 3, 1, 3, 3, 1, 3};
  expect_fault("two squares cross", 2, (const size_t[]){0, 4, 8}, two, true, 0, 1, 1, 4);
  const double beside[] = {0, 0, 2, 0, 2, 2, 0, 2, 2, 0.5, 3, 0.5, 3, 1, 2, 1};
  expect_fault("two squares share a part of an edge", 2, (const size_t[]){0, 4, 8}, beside, true, 0, 1, 1, 4);
  const double corner[] = {0, 0, 2, 0, 2, 2, 0, 2, 2, 2, 3, 2, 3, 3, 2, 3};
  expect_fault("two squares touch at a corner", 2, (const size_t[]){0, 4, 8}, corner, false, 0, 0, 0, 0);
  const double tee[] = {0, 0, 2, 0, 2, 2, 0, 2, 2, 1, 3, 0.5, 3, 1.5};
  expect_fault("a corner touches an edge from without", 2, (const size_t[]){0, 4, 7}, tee, false, 0, 0, 0, 0);
  const double hole[] = {0, 0, 2, 0, 2, 2, 0, 2, 2, 1, 1, 0.5, 1, 1.5};
  expect_fault("a hole's corner touches the edge from within", 2, (const size_t[]){0, 4, 7}, hole, false, 0, 0, 0, 0);
  const double through[] = {0, 0, 2, 0, 2, 2, 0, 2, 2, 1, 3, 0.5, 1, 1.5};
  expect_fault("a corner on the edge, with sides within and without", 2, (const size_t[]){0, 4, 7}, through, true, 0,
               1, 1, 4);
  const double diamond[] = {0, 0, 2, 0, 2, 2, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1};
  polygon_set p;
  polygon_fault fault;
  T_OK(make(2, (const size_t[]){0, 4, 8}, diamond, &p, &fault), ctx);
  T_CHECK(p.depth[1] == 1 && p.parent[1] == 0 && p.area == 2, "a hole all of whose corners lie on the loop around");
  polygon_set_free(&p);
  /* An edge in two halves is shared with another loop's whole edge: no crossing is proper. */
  const double halves[] = {0, 0, 1, 0, 2, 0, 2, 2, 0, 2, 0, 0, 2, 0, 1, -1};
  expect_fault("an edge runs along two", 2, (const size_t[]){0, 5, 8}, halves, true, 0, 1, 0, 5);
}

static void test_drop(void) {
  const double points[] = {5, 5, 0, 0, 0, 0, 4, 0, 4, 0, 4, 4, 0, 4, 0, 0, 1, 1, 2, 2, 1, 1, 1, 1, 1.1, 1, 1, 1.1};
  const size_t starts[] = {0, 1, 8, 11, 11, 14};
  unsigned char dropped[5];
  polygon_set p;
  polygon_fault fault = {POLYGON_SOUND, {0, 0}, {0, 0}, {0, 0}};
  T_OK(polygon_set_make(ctx, 5, starts, points, 0.01, &p, dropped, &fault), ctx);
  T_CHECK(p.count == 1 && p.starts[1] == 4 && p.given[0] == 1 && p.area == 16, "equal neighbours become one");
  T_CHECK(dropped[0] && !dropped[1] && dropped[2] && dropped[3] && dropped[4],
          "a point, two places, nothing, and a speck are left out");
  polygon_set_free(&p);
  T_OK(polygon_set_make(ctx, 1, starts, points, 0, &p, NULL, &fault), ctx);
  const double x[2] = {0, 0}, upper[2] = {1, 1};
  double range[2];
  polygon_distance_bounds(&p, x, upper, range);
  T_CHECK(p.count == 0 && polygon_distance(&p, x, NULL, NULL) == -INFINITY && range[1] == -INFINITY &&
              !polygon_inside(&p, x),
          "no loop at all");
  polygon_set_free(&p);
  polygon_set zero = {0};
  polygon_set_free(&zero);
}

/* ---- against brute force ------------------------------------------------------------------------- */

enum { POINTS = 700, LOOPS = 6 };

static void waves(double *points, size_t *starts) {
  static const size_t n[LOOPS] = {300, 200, 100, 60, 30, 10};
  static const double place[LOOPS][4] = {{0, 0, 10, 0.2}, {0, 0, 6, 0.1}, {20, 3, 7, 0.3},
                                         {1, 1, 2, 0.2},  {-2, -2, 1, 0}, {20, 3, 1, 0}};
  starts[0] = 0;
  for (size_t k = 0; k < LOOPS; k++) {
    starts[k + 1] = starts[k] + n[k];
    ring(n[k], place[k][0], place[k][1], place[k][2], place[k][3], k % 2 == 1, points + 2 * starts[k]);
  }
}

static void test_distance(void) {
  double points[2 * POINTS];
  size_t starts[LOOPS + 1];
  waves(points, starts);
  polygon_set p;
  polygon_fault fault;
  T_OK(make(LOOPS, starts, points, &p, &fault), ctx);
  T_CHECK(p.depth[1] == 1 && p.depth[3] == 2 && p.depth[4] == 2 && p.depth[5] == 1 && p.parent[5] == 2,
          "waves lie in each other");
  uint64_t seed = 11;
  double worst = 0;
  for (int i = 0; i < 5000; i++) {
    double x[2] = {-30 + 80 * t_uniform(&seed), -30 + 60 * t_uniform(&seed)};
    double d = polygon_distance(&p, x, NULL, NULL), e = brute_distance(LOOPS, starts, points, x);
    worst = fmax(worst, fabs(d - e));
  }
  T_RATIO(worst, 1e-14 * 40, "distances against all edges one by one (seed 11)");
  size_t outside = 0, boxes = 0;
  double wide = 0;
  for (int i = 0; i < 3000; i++) {
    double size = 20 * pow(2, -12 * t_uniform(&seed)), lower[2], upper[2], range[2];
    for (int d = 0; d < 2; d++) {
      lower[d] = -20 + 50 * t_uniform(&seed);
      upper[d] = lower[d] + size * t_uniform(&seed);
    }
    polygon_distance_bounds(&p, lower, upper, range);
    double least = INFINITY, most = -INFINITY;
    for (int s = 0; s < 100; s++) {
      double x[2];
      for (int d = 0; d < 2; d++)
        x[d] = s < 4 ? (s >> d & 1 ? upper[d] : lower[d]) : lower[d] + (upper[d] - lower[d]) * t_uniform(&seed);
      double value = polygon_distance(&p, x, NULL, NULL);
      outside += value < range[0] || value > range[1];
      least = fmin(least, value);
      most = fmax(most, value);
    }
    wide = fmax(wide, (range[1] - range[0]) / hypot(upper[0] - lower[0], upper[1] - lower[1]));
    boxes++;
  }
  T_CHECK(outside == 0, "%zu of %zu places leave the bounds over their box", outside, 100 * boxes);
  T_RATIO(wide, 1 + 1e-9, "width of bounds over the diagonal of the box");
  polygon_set_free(&p);
}

/* Points of the loops themselves, and boxes about them: the bounds hold to the last bit, and so does the sign beside
 * a point when one coordinate is moved by a unit in the last place. */
static void test_edge_of_rounding(void) {
  const double square[] = {0.1, 0.1, 0.7, 0.1, 0.7, 0.7, 0.1, 0.7};
  polygon_set p;
  polygon_fault fault;
  T_OK(make(1, (const size_t[]){0, 4}, square, &p, &fault), ctx);
  bool ok = true;
  for (int k = 0; k < 5; k++) {
    double y = 0.1 + 0.6 * k / 5 + 0.05;
    ok = ok && polygon_distance(&p, (const double[]){nextafter(0.1, 1), y}, NULL, NULL) > 0;
    ok = ok && polygon_distance(&p, (const double[]){nextafter(0.1, 0), y}, NULL, NULL) < 0;
    ok = ok && polygon_distance(&p, (const double[]){y, nextafter(0.7, 0)}, NULL, NULL) > 0;
    ok = ok && polygon_distance(&p, (const double[]){y, nextafter(0.7, 1)}, NULL, NULL) < 0;
    ok = ok && polygon_distance(&p, (const double[]){y, 0.7}, NULL, NULL) == 0;
  }
  T_CHECK(ok, "the sign is right beside an edge, one unit in the last place away");
  for (size_t i = 0; i < 4; i++) {
    double range[2];
    polygon_distance_bounds(&p, square + 2 * i, square + 2 * i, range);
    ok = ok && range[0] <= 0 && range[1] >= 0 && range[1] - range[0] < 1e-12;
  }
  T_CHECK(ok, "a box of no size has bounds of no size");
  polygon_set_free(&p);
}

/* ---- components ---------------------------------------------------------------------------------- */

static double lens(double s) { return (2 * acos(s / 2) - s / 2 * sqrt(4 - s * s)) / PI; }

static void test_overlap(void) {
  double disc[400], ring_points[800];
  ring(200, 0, 0, 1, 0, false, disc);
  ring(200, 0, 0, 3, 0, false, ring_points);
  ring(200, 0, 0, 2, 0, false, ring_points + 400);
  polygon_set a, b;
  polygon_fault fault;
  T_OK(make(1, (const size_t[]){0, 200}, disc, &a, &fault), ctx);
  T_OK(make(2, (const size_t[]){0, 200, 400}, ring_points, &b, &fault), ctx);
  double worst = 0;
  bool same = true;
  for (int i = 0; i <= 20; i++) {
    double s = 0.11 * i, angle = i, shift[2] = {s * cos(angle), s * sin(angle)}, back[2] = {-shift[0], -shift[1]};
    double share, again;
    bool meet = polygon_components_overlap(&a, 0, &a, 0, shift, &share);
    bool meet_again = polygon_components_overlap(&a, 0, &a, 0, back, &again);
    same = same && meet == (s < 2) && meet_again == meet;
    worst = fmax(worst, fabs(share - (s < 2 ? lens(s) : 0)));
    worst = fmax(worst, fabs(again - share));
  }
  T_CHECK(same, "discs overlap while they are nearer than two radii");
  T_RATIO(worst, 0.012, "share of discs against the lens's area");
  double share, again, out[2] = {0, 2.5}, touch[2] = {0, 1.5};
  T_CHECK(!polygon_components_overlap(&a, 0, &b, 0, NULL, &share) && share == 0, "a disc in the hole of a ring");
  T_CHECK(!polygon_components_overlap(&b, 0, &a, 0, NULL, NULL), "the same, exchanged");
  bool meet = polygon_components_overlap(&a, 0, &b, 0, out, &share);
  T_CHECK(meet && share > 0.6 && share < 0.9, "a ring moved onto the disc: share %g", share);
  out[1] = -2.5;
  meet = polygon_components_overlap(&b, 0, &a, 0, out, &again);
  T_CHECK(meet && again == share, "the same, exchanged: %g", again);
  meet = polygon_components_overlap(&a, 0, &b, 0, touch, &share);
  T_CHECK(meet && share > 0.2 && share < 0.7, "the disc partly in the hole: share %g", share);
  double area, center[2];
  polygon_component_measure(&b, 0, &area, center);
  T_RATIO(fabs(area - 100 * sin(2 * PI / 200) * 5), 1e-12, "area of the ring");
  T_RATIO(hypot(center[0], center[1]), 1e-13, "its centroid");
  polygon_set_free(&a);
  polygon_set_free(&b);
}

static batten_status make_and_free(batten_context *c, void *arg) {
  (void)arg;
  double points[2 * POINTS];
  size_t starts[LOOPS + 1];
  waves(points, starts);
  polygon_set p;
  polygon_fault fault;
  batten_status st = polygon_set_make(c, LOOPS, starts, points, 0, &p, NULL, &fault);
  if (st == BATTEN_OK) polygon_set_free(&p);
  return st;
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_nest();
  test_there_and_back();
  test_crossings();
  test_drop();
  test_distance();
  test_edge_of_rounding();
  test_overlap();
  t_fail_every_allocation("polygon_set_make", make_and_free, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is given back");
  batten_context_free(ctx);
  return t_done();
}
