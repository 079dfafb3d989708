/* batten_curve_certify where spans meet: inflections at knots, curvature that jumps, corners, closed curves. */
#include <float.h>

#include "basis/refine.h"
#include "curve_oracle.h"

static bspline space_of(const curve_case *c) { return (bspline){c->degree, curve_case_count(c), c->knots}; }

/* The same curve of degree + up. */
static curve_case elevated(const curve_case *c, unsigned up) {
  curve_case out = {.degree = c->degree + up, .closed = c->closed};
  for (size_t k = 0; k < c->knot_count; k++) {
    out.knots[out.knot_count++] = c->knots[k];
    bool last = k + 1 == c->knot_count || c->knots[k + 1] > c->knots[k];
    for (unsigned i = 0; i < up && last; i++) out.knots[out.knot_count++] = c->knots[k];
  }
  bspline from = space_of(c), to = space_of(&out);
  bspline_refine(&from, 2, c->control[0], &to, out.control[0]);
  if (c->closed) memcpy(out.control[curve_case_count(&out) - 1], out.control[0], sizeof out.control[0]);
  return out;
}

/* A cubic with x'' = 0 at inflection knots, where two control vectors of x' are one: x'' is linear between its values
 * at the knots, and turns of x' go one way between inflections; or a parabolic spline whose curvature jumps there. */
static curve_case wave_case(uint64_t *state, unsigned degree, size_t spans, double span_least, int *sign,
                            size_t *count, double *inflections) {
  curve_case c = {.degree = degree};
  double at = 0, q[CASE_POINTS][2], angle = 6 * t_uniform(state), breaks[CASE_KNOTS] = {0};
  for (size_t s = 1; s <= spans; s++) breaks[s] = at += pow(span_least, t_uniform(state));
  for (unsigned k = 0; k <= degree; k++) c.knots[c.knot_count++] = 0;
  for (size_t s = 1; s < spans; s++) c.knots[c.knot_count++] = breaks[s];
  for (unsigned k = 0; k <= degree; k++) c.knots[c.knot_count++] = at;
  *sign = t_random(state) % 2 ? 1 : -1;
  *count = 0;
  int now = *sign;
  size_t vectors = spans + degree - 1, since = 0; /* of x' */
  double size = 1;
  for (size_t j = 0; j < vectors; j++) {
    /* Cubic: between vectors s and s + 1 lies knot s. Parabolic: span s. */
    bool flips = degree == 3 ? j >= 2 && j < spans && since >= 2 && t_random(state) % 3 == 0
                             : j >= 2 && t_random(state) % 3 == 0;
    if (j > 0 && flips) {
      inflections[(*count)++] = breaks[j - 1];
      now = -now;
      since = 0;
    }
    if (j > 0 && !(flips && degree == 3)) {
      angle += now * (0.05 + 0.4 * t_uniform(state));
      size = 0.5 + t_uniform(state);
    }
    since++;
    q[j][0] = size * cos(angle);
    q[j][1] = size * sin(angle);
  }
  from_tangents(&c, (const double(*)[2])q);
  return c;
}

/* Inflections at knots, degree 3 (C2) and 2 (C1), and both elevated. */
static void test_knots(batten_context *ctx, unsigned smoothness) {
  uint64_t state = 17 + smoothness;
  size_t tried = 0, refused = 0, wrong = 0, loose = 0, inflections = 0, believed = 0, others = 0;
  double error = 0, worst = 1;
  for (int i = 0; i < 1200; i++) {
    double at[CASE_KNOTS];
    size_t count;
    int sign;
    double least = i % 3 == 0 ? 1e-4 : 0.3;
    unsigned up = (unsigned)(i % 4);
    curve_case low = wave_case(&state, smoothness + 1, 3 + t_random(&state) % 6, least, &sign, &count, at);
    curve_case c = elevated(&low, up);
    tried++;
    inflections += count;
    batten_curve_shape shape = certify(ctx, &c, sign, count, at);
    if (!shape.certified) {
      refused++;
      continue;
    }
    double span = INFINITY;
    for (size_t k = 1; k < c.knot_count; k++)
      if (c.knots[k] > c.knots[k - 1]) span = fmin(span, c.knots[k] - c.knots[k - 1]);
    error = fmax(error, shape.inflection_error / span);
    long double margin = oracle_margin(&c, sign, count, at, shape.inflection_error, smoothness == 1);
    if (shape.margin_min > margin * (1 + 1e-9L)) wrong++;
    if (shape.margin_min < 0.85L * margin) {
      loose++;
      worst = fmin(worst, (double)(shape.margin_min / margin));
    }
    believed += certify(ctx, &c, -sign, count, at).certified != 0;
    others++;
    for (size_t k = 0; k < count; k++) {
      double other[CASE_KNOTS];
      memcpy(other, at, sizeof other);
      other[k] += 1e-5 * span;
      believed += certify(ctx, &c, sign, count, other).certified != 0;
      memmove(other + k, at + k + 1, (count - k - 1) * sizeof *other);
      believed += certify(ctx, &c, sign, count - 1, other).certified != 0;
      others += 2;
    }
  }
  T_CHECK(refused == 0, "%zu curves with %zu inflections at C%u knots: %zu refused", tried, inflections, smoothness,
          refused);
  T_CHECK(wrong == 0 && loose == 0, "their margins: %zu wrong, %zu loose, down to %.3g", wrong, loose, worst);
  T_RATIO(error, smoothness == 2 ? 1e-6 : 0, "inflections are so near, in shortest spans");
  T_CHECK(believed == 0, "%zu other shapes: %zu certified", others, believed);
}

/* A closed cubic, C2 but for rounding at its start, of a control polygon [k][2] of uniform knots; turned: the start
 * is at its vertex 1. */
static curve_case closed_case(size_t spans, const double (*p)[2]) {
  curve_case c = {.degree = 3, .closed = 1};
  for (int k = 0; k < 3; k++) c.knots[c.knot_count++] = 0;
  for (size_t s = 0; s <= spans; s++) c.knots[c.knot_count++] = (double)s;
  for (int k = 0; k < 3; k++) c.knots[c.knot_count++] = (double)spans;
  for (int x = 0; x < 2; x++) {
    const double p0 = p[0][x], p1 = p[1][x], p2 = p[2 % spans][x];
    c.control[0][x] = (p0 + 4 * p1 + p2) / 6;
    c.control[1][x] = (2 * p1 + p2) / 3;
    for (size_t i = 2; i <= spans; i++) c.control[i][x] = p[i % spans][x];
    c.control[spans + 1][x] = (p0 + 2 * p1) / 3;
    c.control[spans + 2][x] = c.control[0][x];
  }
  return c;
}

static double turn_of(const double *a, const double *b, const double *c) {
  return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
}

static void test_closed(batten_context *ctx) {
  uint64_t state = 23;
  size_t refused = 0, wrong = 0, tried = 0;
  for (int i = 0; i < 500; i++) {
    double p[40][2];
    size_t spans = 5 + t_random(&state) % 30;
    double shift = i % 2 ? 1000 * t_uniform(&state) : 0, noise = i % 3 ? 0 : 0.3 / (double)(spans * spans);
    for (size_t k = 0; k < spans; k++) {
      double a = 6.283185307179586 * (double)k / (double)spans + 0.3, r = 1 + noise * t_uniform(&state);
      p[k][0] = shift + 2 * r * cos(a);
      p[k][1] = r * sin(a);
    }
    curve_case c = closed_case(spans, (const double(*)[2])p);
    tried++;
    batten_curve_shape shape = certify(ctx, &c, 0, 0, NULL);
    refused += !shape.certified;
    if (shape.certified &&
        (shape.sign != 1 || shape.margin_min > oracle_margin(&c, 1, 0, NULL, 0, false) * (1 + 1e-9L)))
      wrong++;
    c = transformed(&c, true, false, 0);
    wrong += certify(ctx, &c, 1, 0, NULL).certified != 0;
    refused += !certify(ctx, &c, -1, 0, NULL).certified;
  }
  T_CHECK(refused == 0 && wrong == 0, "%zu closed curves: %zu refused, %zu wrong", tried, refused, wrong);
  /* Waves round a circle: inflections in spans, and one at the start. */
  size_t inflected = 0, started = 0;
  for (int i = 0; i < 300; i++) {
    double p[40][2], at[MOST + 2];
    size_t spans = 24 + t_random(&state) % 10, count;
    int sign;
    bool start = i % 2, changes = false;
    while (!changes) {
      double phase = t_uniform(&state);
      for (size_t k = 0; k < spans; k++) {
        double a = 6.283185307179586 * ((double)k / (double)spans + phase);
        double r = 1 + 0.3 * cos(3 * a) + 0.02 * t_uniform(&state);
        p[k][0] = 1 + r * cos(a);
        p[k][1] = r * sin(a);
      }
      for (int x = 0; x < 2 && start; x++) p[1][x] = 0.5 * (p[0][x] + p[2][x]);
      changes = !start || turn_of(p[spans - 1], p[0], p[1]) * turn_of(p[1], p[2], p[3]) < 0;
    }
    curve_case c = closed_case(spans, (const double(*)[2])p);
    if (!oracle_inflections(&c, &count, at, &sign) && !start) continue;
    /* Near the start rounding decides: what samples find there is replaced by the start itself where it is one. */
    double kept[MOST + 2];
    size_t n = 0;
    for (size_t k = 0; k < count; k++)
      if (at[k] > 1e-9 && at[k] < (double)spans - 1e-9) kept[n++] = at[k];
    if (n % 2) {
      memmove(kept + 1, kept, n * sizeof *kept);
      kept[0] = 0;
      n++;
    }
    if (start && kept[0] != 0) continue; /* straight there, but bent alike on both sides */
    long double curvature;
    oracle_bend(&c, 3, 0.001L, &curvature);
    sign = curvature < 0 ? -1 : 1;
    batten_curve_shape shape = certify(ctx, &c, sign, n, kept);
    inflected++;
    started += start;
    refused += !shape.certified;
    wrong += certify(ctx, &c, -sign, n, kept).certified != 0;
    wrong += n > 0 && certify(ctx, &c, sign, n - 2, kept + 1).certified;
    if (start) {
      kept[0] = 1e-5;
      wrong += certify(ctx, &c, sign, n, kept).certified != 0;
      wrong += certify(ctx, &c, -sign, n, kept).certified != 0;
    }
  }
  T_CHECK(refused == 0 && wrong == 0,
          "%zu closed curves with inflections, %zu with one at the start: %zu refused, %zu wrong", inflected, started,
          refused, wrong);
}

static void test_corners(batten_context *ctx) {
  /* Two arcs that meet at (2, 1) with a turn of `angle` degrees, the second bending by the sign. */
  size_t wrong = 0, tried = 0;
  for (int angle = -175; angle <= 180; angle += 5)
    for (int second = -1; second <= 1; second += 2)
      for (int flip = 0; flip < 2; flip++) {
        double a = (90 + angle) * 3.141592653589793 / 180;
        curve_case c = {.degree = 2,
                        .knot_count = 8,
                        .knots = {0, 0, 0, 1, 1, 2, 2, 2},
                        .control = {{0, 0}, {2, 0}, {2, 1}, {2 + cos(a), 1 + sin(a)}}};
        c.control[4][0] = c.control[3][0] + cos(a + second);
        c.control[4][1] = c.control[3][1] + sin(a + second);
        c = transformed(&c, flip, false, 0);
        double at = 1;
        int sign = flip ? -1 : 1;
        bool same = certify(ctx, &c, sign, 0, NULL).certified, other = certify(ctx, &c, sign, 1, &at).certified;
        wrong += same != (second == 1 && angle >= 0 && angle < 180);
        wrong += other != (second == -1 && angle < 180);
        tried++;
      }
  T_CHECK(wrong == 0, "%zu corners, beside their turns: %zu wrong", tried, wrong);
  /* A closed drop: its corner at the start. */
  curve_case drop = {.degree = 3,
                     .knot_count = 8,
                     .knots = {0, 0, 0, 0, 1, 1, 1, 1},
                     .closed = 1,
                     .control = {{0, 0}, {2, -1}, {2, 1}, {0, 0}}};
  T_CHECK(certify(ctx, &drop, 1, 0, NULL).certified, "a drop with its corner at the start");
  curve_case loop = drop; /* turns by more than half a turn inside, the other way at the corner */
  double wide[2][2] = {{2, 1}, {-2, 1}};
  memcpy(loop.control[1], wide, sizeof wide);
  batten_curve_shape shape = certify(ctx, &loop, 1, 0, NULL);
  T_CHECK(shape.certified, "an acute corner the same way");
  curve_case heart = {.degree = 3,
                      .knot_count = 11,
                      .knots = {0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2},
                      .closed = 1,
                      .control = {{0, 0.5}, {1.5, 2}, {2.5, 0}, {0, -2}, {-2.5, 0}, {-1.5, 2}, {0, 0.5}}};
  shape = certify(ctx, &heart, -1, 0, NULL);
  T_CHECK(!shape.certified && shape.margin_min == 0 && shape.worst_at == 0,
          "a heart: the corner at its start turns back");
}

/* A wave of many short spans with inflections at knots: x'' is 0 there but for what rounding of far control points
 * does, which moves inflections by more than the slack. */
static void test_many(batten_context *ctx) {
  enum { SPANS = 2000, WAVES = 5, COUNT = SPANS + 3 };
  static double knots[COUNT + 4], points[COUNT][2];
  double at[WAVES], angle = 0;
  for (int k = 0; k < COUNT + 4; k++) knots[k] = fmin(fmax(k - 3, 0), SPANS) / (double)SPANS;
  for (int shift = 0; shift < 2; shift++) {
    size_t count = 0;
    points[0][0] = shift * 100;
    points[0][1] = 0;
    for (int j = 0; j + 1 < COUNT; j++) {
      double step = (knots[j + 4] - knots[j + 1]) / 3, turn = cos(3.2 * WAVES * j / SPANS);
      /* Knot s is between vectors s and s + 1. */
      if (j > 1 && j < SPANS && count < WAVES && turn * cos(3.2 * WAVES * (j - 1.0) / SPANS) < 0)
        at[count++] = knots[j + 2];
      else
        angle += 10 * turn / SPANS;
      points[j + 1][0] = points[j][0] + step * cos(angle);
      points[j + 1][1] = points[j][1] + step * sin(angle);
    }
    batten_curve_form form = {3, COUNT + 4, knots, points[0], 0};
    batten_curve *curve = NULL;
    T_OK(batten_curve_create(ctx, &form, &curve), ctx);
    batten_curve_shape_options o = batten_curve_shape_options_default();
    batten_curve_shape shape = {0};
    o.inflection_count = count;
    o.inflections = at;
    double start = batten_now();
    T_OK(batten_curve_certify(ctx, curve, &o, &shape), ctx);
    printf(
        "# %d spans, %zu inflections, %.2f ms, %zu pieces, margin %.3g at %.6g, inflections within %.2g of a span\n",
        SPANS, count, (batten_now() - start) * 1e3, shape.pieces, shape.margin_min, shape.worst_at,
        shape.inflection_error * SPANS);
    T_CHECK(shape.certified && shape.sign == 1 && shape.inflection_error * SPANS < (shift ? 1e-3 : 1e-5),
            "%d spans%s are certified", SPANS, shift ? ", far from the origin" : "");
    at[1] += 10.0 / SPANS;
    T_OK(batten_curve_certify(ctx, curve, &o, &shape), ctx);
    T_CHECK(!shape.certified, "but not with another inflection: margin %g", shape.margin_min);
    batten_curve_free(curve);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_knots(ctx, 2);
  test_knots(ctx, 1);
  test_closed(ctx);
  test_corners(ctx);
  test_many(ctx);
  batten_context_free(ctx);
  return t_done();
}
