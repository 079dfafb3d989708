/* Where curves cross themselves: by hand, and against all pairs of edges of fine polygons. */
#include <float.h>

#include "curve_case.h"

enum { MOST = 64 };

static size_t find(batten_context *ctx, const curve_case *c, double at[MOST][2]) {
  batten_curve *curve = curve_case_make(ctx, c);
  size_t count = 99;
  double(*found)[2] = NULL;
  if (batten_curve_crossings(ctx, curve, &count, &found) != BATTEN_OK) printf("# %s\n", batten_error(ctx));
  for (size_t k = 0; k < count && k < MOST; k++) memcpy(at[k], found[k], sizeof at[k]);
  batten_free(ctx, found);
  batten_curve_free(curve);
  return count;
}

static void point_at(const curve_case *c, double t, double out[2]) {
  batten_curve_form form = curve_case_form(c);
  curve_case_value(&form, 0, t, out, NULL);
}

/* Bezier pieces of a degree with common ends, each over one unit of the domain. */
static curve_case pieces(unsigned degree, size_t count, const double (*points)[2], int closed) {
  curve_case c = {.degree = degree, .closed = closed};
  for (size_t s = 0; s <= count; s++)
    for (unsigned k = 0; k < (s == 0 || s == count ? degree + 1 : degree); k++) c.knots[c.knot_count++] = (double)s;
  memcpy(c.control, points, (count * degree + 1) * sizeof *points);
  return c;
}

typedef struct wanted {
  const char *what;
  curve_case c;
  size_t count;
  double at[4][2];
} wanted;

static void compare(batten_context *ctx, const wanted *e, double within) {
  double at[MOST][2], worst = 0;
  size_t count = find(ctx, &e->c, at);
  for (size_t k = 0; k < count && k < e->count; k++)
    worst = fmax(worst, fmax(fabs(at[k][0] - e->at[k][0]), fabs(at[k][1] - e->at[k][1])));
  T_CHECK(count == e->count && worst <= within, "%s: %zu crossings, off by %.2g", e->what, count, worst);
  for (size_t k = 0; k < count && k < 4 && count != e->count; k++) printf("# %.17g %.17g\n", at[k][0], at[k][1]);
}

/* x = t^2 - 1, y = t (t^2 - 1) over [-2, 2], t = 4 u - 2: a loop in one span that meets at t = -1 and 1. */
static void test_by_hand(batten_context *ctx) {
  const wanted all[] = {
      {"loop of a cubic",
       pieces(3, 1, (const double[][2]){{3, -6}, {-7. / 3, 26. / 3}, {-7. / 3, -26. / 3}, {3, 6}}, 0),
       1,
       {{0.25, 0.75}}},
      {"arc", pieces(3, 1, (const double[][2]){{0, 0}, {1, 1}, {2, 1}, {3, 0}}, 0), 0, {{0}}},
      {"cusp", pieces(3, 1, (const double[][2]){{0, 0}, {1, 1}, {0, 1}, {1, 0}}, 0), 0, {{0}}},
      {"figure of eight",
       pieces(1, 4, (const double[][2]){{0, 0}, {1, 1}, {1, 0}, {0, 1}, {0, 0}}, 1),
       1,
       {{0.5, 2.5}}},
      {"square", pieces(1, 4, (const double[][2]){{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}, 1), 0, {{0}}},
      {"open square whose ends meet",
       pieces(1, 4, (const double[][2]){{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}}, 0),
       1,
       {{0, 4}}},
      {"end on an edge",
       pieces(1, 4, (const double[][2]){{0, 0}, {2, 0}, {2, 1}, {0.5, 1}, {0.5, 0}}, 0),
       1,
       {{0.25, 4}}},
      {"corner on an edge",
       pieces(1, 4, (const double[][2]){{0, 0}, {2, 0}, {1, 1}, {0.5, 0}, {0, 1}}, 0),
       1,
       {{0.25, 3}}},
      {"crossing at knots of both",
       pieces(1, 6, (const double[][2]){{0, 0}, {1, 1}, {2, 2}, {2, 0}, {1, 1}, {0, 2}, {0, 3}}, 0),
       1,
       {{1, 4}}},
      {"three through one point",
       pieces(1, 5, (const double[][2]){{-1, 0}, {1, 0}, {1, 1}, {-1, -1}, {-1, -2}, {1, 2}}, 0),
       3,
       {{0.5, 2.5}, {0.5, 4.5}, {2.5, 4.5}}},
      {"parabolas that touch",
       pieces(2, 3, (const double[][2]){{-1, 1}, {0, -1}, {1, 1}, {2, 0}, {1, -1}, {0, 1}, {-1, -1}}, 0),
       1,
       {{0.5, 2.5}}},
      {"parabolas that touch elsewhere",
       pieces(2, 3, (const double[][2]){{-1, 1}, {0.25, -1.5}, {1.5, 2.25}, {2, 0}, {1, -1}, {0, 1}, {-1, -1}}, 0),
       1,
       {{0.4, 2.5}}},
      {"closed at a crossing of three",
       pieces(1, 5, (const double[][2]){{0, 0}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}, {0, 0}}, 1),
       1,
       {{0, 2.5}}},
      {"the way back", pieces(1, 2, (const double[][2]){{0, 0}, {2, 0}, {0, 0}}, 0), 1, {{0.5, 1.5}}},
      {"part of the way back, past it",
       pieces(1, 3, (const double[][2]){{0, 0}, {4, 0}, {4, 0}, {1, 0}}, 0),
       1,
       {{0.625, 2.5}}},
      {"standing still",
       pieces(2, 3, (const double[][2]){{0, 0}, {1, 0}, {2, 0}, {2, 0}, {2, 0}, {3, 1}, {4, 1}}, 0),
       0,
       {{0}}},
      {"a point", pieces(2, 1, (const double[][2]){{1, 1}, {1, 1}, {1, 1}}, 0), 0, {{0}}},
      {"twice the same arc",
       pieces(2, 3, (const double[][2]){{0, 0}, {1, 1}, {2, 0}, {1, -3}, {0, 0}, {1, 1}, {2, 0}}, 0),
       1,
       {{0.5, 2.5}}},
  };
  for (size_t k = 0; k < sizeof all / sizeof *all; k++)
    compare(ctx, &all[k], k == 10 || k == 11 ? 1e-7 : k >= 13 ? 0.51 : 1e-14);
}

/* ---- at random ------------------------------------------------------------------------------------ */

enum { EDGES = 600 };

typedef struct meeting {
  double at[2], angle;
} meeting;

/* All crossings of the polygon through EDGES + 1 points. */
static size_t brute(const curve_case *c, meeting *out, size_t room) {
  static double t[EDGES + 1], x[EDGES + 1][2];
  double lower = c->knots[0], upper = c->knots[c->knot_count - 1];
  size_t count = 0;
  for (size_t i = 0; i <= EDGES; i++) {
    t[i] = lower + (upper - lower) * (double)i / EDGES;
    point_at(c, t[i], x[i]);
  }
  for (size_t i = 0; i < EDGES; i++)
    for (size_t j = i + 2; j < EDGES; j++) {
      if (c->closed && i == 0 && j + 1 == EDGES) continue;
      const double p[2] = {x[i + 1][0] - x[i][0], x[i + 1][1] - x[i][1]};
      const double q[2] = {x[j + 1][0] - x[j][0], x[j + 1][1] - x[j][1]},
                   o[2] = {x[j][0] - x[i][0], x[j][1] - x[i][1]};
      double area = p[0] * q[1] - p[1] * q[0];
      double a = (o[0] * q[1] - o[1] * q[0]) / area, b = (o[0] * p[1] - o[1] * p[0]) / area;
      if (!(a >= 0 && a < 1 && b >= 0 && b < 1) || count == room) continue;
      out[count].angle = fabs(area) / (hypot(p[0], p[1]) * hypot(q[0], q[1]));
      out[count].at[0] = t[i] + a * (t[i + 1] - t[i]);
      out[count++].at[1] = t[j] + b * (t[j + 1] - t[j]);
    }
  return count;
}

static bool near(const double a[2], const double b[2], double within, double period) {
  for (int k = 0; k < 2; k++) {
    double way = fabs(a[k] - b[k]);
    if (period > 0) way = fmin(way, period - way);
    if (way > within) return false;
  }
  return true;
}

static void test_random(batten_context *ctx) {
  static meeting expected[MOST];
  enum { CASES = 250 };
  size_t all = 0, missed = 0, open = 0, unordered = 0, twice = 0, without = 0, differ = 0;
  uint64_t state = 11;
  for (int i = 0; i < CASES; i++) {
    int closed = i % 3 == 0;
    curve_case c = curve_case_random(&state, 1 + (unsigned)(i % 6), (size_t)(t_random(&state) % 6), 1, closed, -1, 4);
    double at[MOST][2], other[MOST][2], period = closed ? 5 : 0;
    size_t count = find(ctx, &c, at), rough = brute(&c, expected, MOST);
    all += count;
    without += count == 0;
    for (size_t k = 0; k < count && k < MOST; k++) {
      double x[2], y[2];
      point_at(&c, at[k][0], x);
      point_at(&c, at[k][1], y);
      if (!(hypot(x[0] - y[0], x[1] - y[1]) <= 2e-12)) open++;
      if (!(at[k][0] < at[k][1]) || (k > 0 && at[k][0] < at[k - 1][0])) unordered++;
      for (size_t m = 0; m < k; m++) twice += near(at[k], at[m], 1e-7, period);
    }
    for (size_t m = 0; m < rough; m++) {
      bool known = expected[m].angle < 0.05;
      for (size_t k = 0; k < count && k < MOST; k++) {
        const double swapped[2] = {at[k][1], at[k][0]};
        known = known || near(at[k], expected[m].at, 0.03, period) || near(swapped, expected[m].at, 0.03, period);
      }
      missed += !known;
      if (!known)
        printf("# case %d: %.4f %.4f angle %.3f\n", i, expected[m].at[0], expected[m].at[1], expected[m].angle);
    }
    for (size_t k = 0; k < curve_case_count(&c); k++) { /* turned, larger, far away */
      double x = c.control[k][0], y = c.control[k][1];
      c.control[k][0] = 1e3 * (0.6 * x - 0.8 * y) + 2e3;
      c.control[k][1] = 1e3 * (0.8 * x + 0.6 * y) - 1e3;
    }
    if (closed) memcpy(c.control[curve_case_count(&c) - 1], c.control[0], sizeof *c.control);
    bool same = find(ctx, &c, other) == count;
    for (size_t k = 0; k < count && k < MOST && same; k++) same = near(at[k], other[k], 1e-9, 0);
    differ += !same;
  }
  printf("# %d curves, %zu crossings, %zu curves without\n", CASES, all, without);
  T_CHECK(all > 200 && without > 20 && missed == 0, "%zu crossings of polygons missed", missed);
  T_CHECK(open == 0 && unordered == 0 && twice == 0, "%zu pairs are not one point, %zu not in order, %zu twice", open,
          unordered, twice);
  T_CHECK(differ == 0, "turned and moved: others of %zu", differ);
}

/* From a crossing to a touch to nothing: y = x^2 - gap against y = -x^2, which meet at x = sqrt(gap / 2). */
static void test_nearly_touching(batten_context *ctx) {
  for (int k = 1; k <= 20; k++)
    for (int sign = -1; sign <= 1; sign += 2) {
      double gap = sign * pow(10, -k), at[MOST][2], x = 0.5 * sqrt(fmax(gap, 0) / 2);
      curve_case c = pieces(
          2, 3, (const double[][2]){{-1, 1 - gap}, {0, -1 - gap}, {1, 1 - gap}, {2, 0}, {1, -1}, {0, 1}, {-1, -1}},
          0);
      size_t count = find(ctx, &c, at);
      bool ok = k >= 11 ? count <= 2 : count == (gap < 0 ? 0 : 2);
      if (k >= 14) ok = count == 1; /* nearer than what counts as common */
      for (size_t i = 0; i < count && gap > 0 && count == 2; i++) {
        double place = i == 0 ? 0.5 - x : 0.5 + x;
        ok = ok && fabs(at[i][0] - place) < 1e-15 / x + 1e-14;
      }
      T_CHECK(ok, "gap %g: %zu crossings", gap, count);
    }
}

/* An arc twice, hardly further apart than what counts as common: no pairs without end. */
static void test_hardly_apart(batten_context *ctx) {
  for (int k = 0; k <= 4; k++) {
    double gap = 3e-13 * k, at[MOST][2];
    curve_case c =
        pieces(2, 3, (const double[][2]){{0, 0}, {1, 1}, {2, 0}, {1, -3}, {0, gap}, {1, 1 + gap}, {2, gap}}, 0);
    size_t count = find(ctx, &c, at);
    T_CHECK(count == 1 && fabs(at[0][0] - 0.5) < 0.01 && fabs(at[0][1] - 2.5) < 0.01, "%g apart: %zu", gap, count);
  }
}

static batten_status call(batten_context *ctx, void *arg) {
  const curve_case *c = arg;
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st < 0) return st;
  size_t count;
  double(*found)[2];
  st = batten_curve_crossings(ctx, curve, &count, &found);
  if (st >= 0) batten_free(ctx, found);
  batten_curve_free(curve);
  return st;
}

/* Many spans: a wound coil. */
static void test_many(batten_context *ctx) {
  enum { COUNT = 4000 };
  static double knots[COUNT + 4], points[COUNT][2];
  for (size_t i = 0; i < COUNT; i++) {
    double a = 0.05 * (double)i;
    points[i][0] = 0.02 * (double)i + 4 * cos(a);
    points[i][1] = 4 * sin(a);
  }
  for (size_t i = 0; i < COUNT + 4; i++) knots[i] = i < 4 ? 0 : i >= COUNT ? COUNT - 3 : (double)i - 3;
  batten_curve *curve = NULL;
  batten_curve_form form = {3, COUNT + 4, knots, points[0], 0};
  T_OK(batten_curve_create(ctx, &form, &curve), ctx);
  size_t count = 0;
  double(*found)[2] = NULL, start = batten_now();
  T_OK(batten_curve_crossings(ctx, curve, &count, &found), ctx);
  printf("# %zu crossings in %.1f ms\n", count, 1e3 * (batten_now() - start));
  T_CHECK(count > 50 && count < 500, "a coil of 32 turns crosses itself %zu times", count);
  batten_free(ctx, found);
  batten_curve_free(curve);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_random(ctx);
  test_nearly_touching(ctx);
  test_hardly_apart(ctx);
  test_many(ctx);
  uint64_t state = 2;
  curve_case c = curve_case_random(&state, 3, 40, 1, 0, 0, 1);
  size_t count = 7;
  double(*found)[2] = NULL;
  batten_curve *curve = curve_case_make(ctx, &c);
  T_STATUS(batten_curve_crossings(ctx, NULL, &count, &found), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_crossings(ctx, curve, NULL, &found), BATTEN_E_INVALID, ctx, "count: NULL");
  T_STATUS(batten_curve_crossings(ctx, curve, &count, NULL), BATTEN_E_INVALID, ctx, "parameters: NULL");
  T_CHECK(batten_curve_crossings(NULL, curve, &count, &found) == BATTEN_E_INVALID && count == 7, "no context");
  batten_curve_free(curve);
  t_fail_every_allocation("batten_curve_crossings", call, &c);
  batten_context_free(ctx);
  return t_done();
}
