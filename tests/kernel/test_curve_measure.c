/* Box, area, centroid, curvatures, turn and energy of curves. */
#include "curve_case.h"

#include <float.h>

static const double pi = 3.14159265358979323846;

static batten_curve_measures measure(batten_context *ctx, const batten_curve *curve) {
  batten_curve_measures m;
  memset(&m, 0, sizeof m);
  if (batten_curve_measure(ctx, curve, &m) < 0) t_line(false, "measure: %s", batten_error(ctx));
  return m;
}

static batten_curve_measures measure_case(batten_context *ctx, const curve_case *c) {
  batten_curve *curve = curve_case_make(ctx, c);
  batten_curve_measures m = measure(ctx, curve);
  batten_curve_free(curve);
  return m;
}

/* ---- by hand ------------------------------------------------------------------------------------- */

static void test_parabola(batten_context *ctx) {
  /* (t, t^2) from -1 to 2, with the vertex inside. With tan a = 2 t: energy 2 (sin a - sin^3 a / 3). */
  const curve_case c = {
      .degree = 2, .knot_count = 6, .knots = {-1, -1, -1, 2, 2, 2}, .control = {{-1, 1}, {0.5, -2}, {2, 4}}};
  batten_curve_measures m = measure_case(ctx, &c);
  double length = 0, energy = 0, moment = 0;
  for (int end = 0; end < 2; end++) {
    double t = end ? 2 : 1, s = sin(atan(2 * t));
    length += t * sqrt(1 + 4 * t * t) / 2 + asinh(2 * t) / 4;
    energy += 2 * (s - s * s * s / 3);
    moment += (end ? 1 : -1) * pow(1 + 4 * t * t, 1.5) / 12;
  }
  T_RATIO(fabs(m.length - length) / length, 1e-15, "length");
  T_RATIO(fabs(m.energy - energy) / energy, 1e-14, "energy");
  T_RATIO(fabs(m.centroid[0] - moment / length), 1e-14, "centroid");
  T_CHECK(m.lower[0] == -1 && m.upper[0] == 2 && fabs(m.lower[1]) < 1e-15 && m.upper[1] == 4,
          "box [%g, %g] x [%g, %g]", m.lower[0], m.upper[0], m.lower[1], m.upper[1]);
  T_RATIO(fabs(m.curvature_max - 2) + fabs(m.curvature_min - 2 / pow(17, 1.5)), 1e-14, "curvatures");
  T_CHECK(fabs(m.curvature_max_at) < 1e-7 && m.curvature_min_at == 2, "where they are: %g, %g", m.curvature_max_at,
          m.curvature_min_at);
  T_RATIO(fabs(m.turn - atan(4) - atan(2)), 1e-15, "turn");
  T_CHECK(m.area == 0 && m.inflections == 0, "open: no area, no inflection");
}

static void test_square(batten_context *ctx) {
  curve_case c = {.degree = 1,
                  .knot_count = 7,
                  .knots = {0, 0, 1, 3, 4, 8, 8},
                  .control = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0, 0}},
                  .closed = 1};
  batten_curve_measures m = measure_case(ctx, &c);
  T_RATIO(fabs(m.length - 4) + fabs(m.area - 1) + fabs(m.turn - 2 * pi), 1e-15, "a square: length, area, turn");
  T_RATIO(fabs(m.centroid[0] - 0.5) + fabs(m.centroid[1] - 0.5), 1e-15, "centroid");
  T_CHECK(m.energy == 0 && m.curvature_min == 0 && m.curvature_max == 0 && m.lower[0] == 0 && m.upper[1] == 1,
          "no curvature, box");
  for (int i = 0; i < 5; i++) c.control[i][1] = -c.control[i][1];
  m = measure_case(ctx, &c);
  T_RATIO(fabs(m.area + 1) + fabs(m.turn + 2 * pi), 1e-15, "clockwise: area, turn");
}

static void test_lens(batten_context *ctx) {
  /* y = 1 - x^2 above and its mirror image below: area 8 / 3; corners of 4 angles atan 2 in all. */
  const curve_case c = {.degree = 2,
                        .knot_count = 8,
                        .knots = {0, 0, 0, 1, 1, 2, 2, 2},
                        .control = {{1, 0}, {0, 2}, {-1, 0}, {0, -2}, {1, 0}},
                        .closed = 1};
  batten_curve_measures m = measure_case(ctx, &c);
  T_RATIO(fabs(m.area - 8 / 3.0), 1e-15, "area of a lens");
  T_RATIO(fabs(m.turn - 2 * pi), 2e-15, "turn of a lens with its corners");
  T_RATIO(fabs(m.upper[1] - 1) + fabs(m.lower[1] + 1) + fabs(m.upper[0] - 1), 1e-15, "its box");
  T_RATIO(fabs(m.curvature_max - 2) + fabs(m.curvature_min - 2 / pow(5, 1.5)), 1e-14, "its curvatures");
}

/* x' = (1 - u + u exp(i a))^8 turns by 8 a within one span. */
static void test_turn(batten_context *ctx) {
  for (double a = -2.5; a < 2.6; a += 0.5) {
    curve_case c = {.degree = 9, .knot_count = 20};
    for (int k = 10; k < 20; k++) c.knots[k] = 1;
    for (int k = 0; k < 9; k++) {
      c.control[k + 1][0] = c.control[k][0] + cos(k * a);
      c.control[k + 1][1] = c.control[k][1] + sin(k * a);
    }
    batten_curve_measures m = measure_case(ctx, &c);
    T_RATIO(fabs(m.turn - 8 * a), 2e-14, "turn by %g in one span", 8 * a);
  }
}

static void test_degenerate(batten_context *ctx) {
  curve_case point = {.degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}};
  for (int i = 0; i < 4; i++) point.control[i][1] = 0.1;
  batten_curve_measures m = measure_case(ctx, &point);
  T_CHECK(m.length == 0 && m.turn == 0 && m.energy == 0 && m.centroid[1] == 0.1 && m.lower[1] == 0.1 &&
              m.upper[1] == 0.1 && isnan(m.curvature_min) && isnan(m.curvature_max) && isnan(m.curvature_min_at) &&
              isnan(m.curvature_max_at) && m.inflections == 0,
          "a point");
  /* Straight, there, back and there again: it turns round at two places. */
  curve_case line = point;
  for (int i = 0; i < 4; i++) line.control[i][0] = line.control[i][1] = (const double[]){0, 2, -1, 1}[i];
  m = measure_case(ctx, &line);
  T_CHECK(fabs(fabs(m.turn) - 2 * pi) < 1e-12 || fabs(m.turn) < 1e-12, "there and back: turn %g", m.turn);
  T_RATIO(fabs(m.curvature_max) + fabs(m.curvature_min), 1e-12, "no curvature");
  T_RATIO(fabs(m.upper[0] - m.upper[1]) + fabs(m.lower[0] + m.upper[0] - 1), 1e-15, "its box");
  /* The first control points coincide: a tangent there only in the limit. */
  curve_case slow = {
      .degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}, .control = {{0, 0}, {0, 0}, {1, 0}, {2, 2}}};
  m = measure_case(ctx, &slow);
  T_RATIO(fabs(m.turn - atan(2)), 1e-15, "turn from where x' vanishes");
}

/* ---- against dense evaluation --------------------------------------------------------------------- */

/* How far the curvature at t, or just before it, is from a value. */
static double attained(batten_context *ctx, const batten_curve *curve, double t, double value) {
  double least = INFINITY;
  for (int side = 0; side < 2; side++) {
    double at = side ? nextafter(t, -1) : t;
    batten_curve_point p;
    if (at >= 0 && batten_curve_evaluate(ctx, curve, 1, &at, &p) >= 0)
      least = fmin(least, fabs(p.curvature - value) / fabs(value));
  }
  return least;
}

static void test_random(batten_context *ctx) {
  enum { STEPS = 4000 };
  uint64_t state = 67;
  for (unsigned d = 2; d <= 9; d++)
    for (int closed = 0; closed < 2; closed++) {
      curve_case c = curve_case_random(&state, d, 3, d > 2 ? d - 2 : 1, closed, 0, 1);
      batten_curve *curve = curve_case_make(ctx, &c), *refined = NULL;
      batten_curve_measures m = measure(ctx, curve);
      double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY}, least = INFINITY, most = -INFINITY;
      double turn = 0, area = 0, energy = 0;
      batten_curve_point p, before = {0}, start = {0};
      for (size_t k = d; k + 1 < c.knot_count - d; k++)
        for (int i = 0; i <= STEPS && c.knots[k] < c.knots[k + 1]; i++) {
          double t = c.knots[k] + (c.knots[k + 1] - c.knots[k]) * i / STEPS;
          if (i == STEPS) t = nextafter(c.knots[k + 1], 0);
          batten_curve_evaluate(ctx, curve, 1, &t, &p);
          for (int x = 0; x < 2; x++) {
            low[x] = fmin(low[x], p.point[x]);
            high[x] = fmax(high[x], p.point[x]);
          }
          least = fmin(least, p.curvature);
          most = fmax(most, p.curvature);
          if (k == d && i == 0) start = before = p;
          turn += atan2(before.tangent[0] * p.tangent[1] - before.tangent[1] * p.tangent[0],
                        before.tangent[0] * p.tangent[0] + before.tangent[1] * p.tangent[1]);
          energy += p.curvature * p.curvature * hypot(p.first[0], p.first[1]) * (c.knots[k + 1] - c.knots[k]) /
                    STEPS *
                    (i == 0 || i == STEPS ? 1
                     : i % 2              ? 4
                                          : 2) /
                    3;
          area += 0.5 * (before.point[0] * p.point[1] - before.point[1] * p.point[0]);
          before = p;
        }
      if (closed)
        turn += atan2(before.tangent[0] * start.tangent[1] - before.tangent[1] * start.tangent[0],
                      before.tangent[0] * start.tangent[0] + before.tangent[1] * start.tangent[1]);
      double size = fmax(high[0] - low[0], high[1] - low[1]), below = 0, beyond = 0;
      for (int x = 0; x < 2; x++) {
        below = fmax(below, fmax(m.lower[x] - low[x], high[x] - m.upper[x]));
        beyond = fmax(beyond, fmax(low[x] - m.lower[x], m.upper[x] - high[x]));
      }
      T_CHECK(below <= 1e-15 && beyond <= 1e-5 * size, "degree %u: box holds all (%g), and no more (%g)", d, below,
              beyond);
      T_CHECK(m.curvature_max >= most - 1e-9 * fabs(most) && m.curvature_min <= least + 1e-9 * fabs(least),
              "degree %u: curvatures %g .. %g, seen %g .. %g", d, m.curvature_min, m.curvature_max, least, most);
      T_RATIO(fmax(attained(ctx, curve, m.curvature_min_at, m.curvature_min),
                   attained(ctx, curve, m.curvature_max_at, m.curvature_max)),
              1e-7, "degree %u: they are taken", d);
      T_RATIO(fabs(m.turn - turn), 1e-9, "degree %u: turn %g", d, m.turn);
      T_RATIO(fabs(m.area - (closed ? area : 0)), 1e-4, "degree %u: area %g", d, m.area);
      /* The grid is too coarse for what is nearly a cusp. */
      T_RATIO(fabs(m.energy - energy) / m.energy, fmax(most, -least) > 1e5 ? 0.1 : 1e-5, "degree %u: energy %g", d,
              m.energy);
      /* Another form of the same curve has the same measures, to rounding. */
      if (d < 9 && batten_curve_elevate(ctx, curve, d + 1, &refined) >= 0) {
        batten_curve_measures e = measure(ctx, refined);
        double worst =
            fabs(m.length - e.length) / m.length + fabs(m.area - e.area) + fabs(m.turn - e.turn) +
            fabs(m.energy - e.energy) / m.energy + fabs(m.curvature_max - e.curvature_max) / fabs(m.curvature_max) +
            fabs(m.curvature_min - e.curvature_min) / fabs(m.curvature_min) + fabs(m.centroid[0] - e.centroid[0]) +
            fabs(m.lower[0] - e.lower[0]) + fabs(m.upper[1] - e.upper[1]);
        T_RATIO(worst, 1e-9, "degree %u: elevated it measures the same", d);
        batten_curve_free(refined);
      }
      batten_curve_free(curve);
    }
}

/* ---- invariances --------------------------------------------------------------------------------- */

/* Of one span; the speed varies by 10^5. */
static const curve_case uneven = {.degree = 8,
                                  .knot_count = 18,
                                  .knots = {0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1},
                                  .control = {{0, 0},
                                              {2e-05, 0},
                                              {3e-05, 1e-05},
                                              {-0.00011, -0.00132},
                                              {-0.00022, -0.00171},
                                              {-0.00022, -0.00174},
                                              {2.05637, 5.23775},
                                              {2.05637, 5.23659},
                                              {2.0382, 5.25809}}};

/* Closed curves of one span: x' has no mean direction. */
static void test_one_span(batten_context *ctx) {
  enum { PLACES = 501 };
  static batten_curve_point points[PLACES];
  double places[PLACES];
  uint64_t state = 77;
  size_t missed = 0;
  for (int i = 0; i < PLACES; i++) places[i] = i / (PLACES - 1.0);
  for (unsigned i = 0; i < 40; i++) {
    curve_case c = i ? curve_case_random(&state, 3 + i % 7, 0, 1, 1, 0, 1) : uneven;
    batten_curve *curve = curve_case_make(ctx, &c);
    batten_curve_measures m = {.curvature_max = NAN};
    if (batten_curve_measure(ctx, curve, &m) < 0 || batten_curve_evaluate(ctx, curve, PLACES, places, points) < 0)
      missed++;
    for (int k = 0; k < PLACES; k++) {
      double slack = 1e-9 * fmax(1, fabs(points[k].curvature));
      if (!(points[k].curvature <= m.curvature_max + slack && points[k].curvature >= m.curvature_min - slack))
        missed++;
    }
    batten_curve_free(curve);
  }
  T_CHECK(missed == 0, "curves of one span: %zu places bend more than is said", missed);
}

static void test_moved(batten_context *ctx) {
  uint64_t state = 71;
  curve_case c = curve_case_random(&state, 4, 5, 1, 1, 0, 1);
  batten_curve *curve = curve_case_make(ctx, &c), *other = NULL;
  batten_curve_measures m = measure(ctx, curve), n;
  const double scale[3] = {0x1p40, 0x1p-300, 0x1p300};
  for (int k = 0; k < 3; k++) {
    double by = scale[k];
    T_OK(batten_curve_transform(ctx, curve, (double[]){by, 0, 0, by}, NULL, NULL, &other), ctx);
    n = measure(ctx, other);
    T_CHECK(n.length == by * m.length && n.area == by * by * m.area && n.centroid[0] == by * m.centroid[0] &&
                n.lower[0] == by * m.lower[0] && n.upper[1] == by * m.upper[1] && n.turn == m.turn &&
                n.curvature_max == m.curvature_max / by && n.curvature_min_at == m.curvature_min_at &&
                n.energy == m.energy / by && n.inflections == m.inflections,
            "the same bits in units of %g", 1 / by);
    batten_curve_free(other);
  }
  double s = sin(1), o = cos(1);
  T_OK(batten_curve_transform(ctx, curve, (double[]){o, -s, s, o}, (double[]){3, 4}, (double[]){-5, 20}, &other),
       ctx);
  n = measure(ctx, other);
  T_RATIO(fabs(m.length - n.length) + fabs(m.area - n.area) + fabs(m.turn - n.turn), 1e-13,
          "rotated, moved, over another domain: length, area, turn");
  T_RATIO(fabs(m.energy - n.energy) / m.energy + fabs(1 - n.curvature_max / m.curvature_max), 1e-9,
          "energy and curvature");
  T_RATIO(fabs(o * m.centroid[0] - s * m.centroid[1] + 3 - n.centroid[0]), 1e-14, "centroid");
  batten_curve_free(other);
  T_OK(batten_curve_reverse(ctx, curve, &other), ctx);
  n = measure(ctx, other);
  T_RATIO(fabs(m.length - n.length) + fabs(m.area + n.area) + fabs(m.turn + n.turn), 1e-13,
          "reversed: area and turn change their sign");
  T_RATIO(fabs(1 + n.curvature_min / m.curvature_max) + fabs(m.curvature_max_at + n.curvature_min_at - 1), 1e-8,
          "so do curvatures");
  batten_curve_free(other);
  batten_curve_free(curve);
}

static batten_status measure_one(batten_context *ctx, void *arg) {
  const curve_case *c = arg;
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  batten_curve_measures m;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st >= 0) st = batten_curve_measure(ctx, curve, &m);
  batten_curve_free(curve);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  uint64_t state = 73;
  curve_case c = curve_case_random(&state, 3, 8, 2, 0, 0, 1);
  batten_curve_measures m;
  test_parabola(ctx);
  test_square(ctx);
  test_lens(ctx);
  test_turn(ctx);
  test_degenerate(ctx);
  test_random(ctx);
  test_moved(ctx);
  test_one_span(ctx);
  T_STATUS(batten_curve_measure(ctx, NULL, &m), BATTEN_E_INVALID, ctx, "curve: NULL");
  batten_curve *curve = curve_case_make(ctx, &c);
  T_STATUS(batten_curve_measure(ctx, curve, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_curve_measure(NULL, curve, &m) == BATTEN_E_INVALID, "no context");
  batten_curve_free(curve);
  t_fail_every_allocation("batten_curve_measure", measure_one, &c);
  batten_context_free(ctx);
  return t_done();
}
