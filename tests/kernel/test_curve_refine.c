/* The same curve with more knots, of a higher degree, in parts, reversed and moved. */
#include "basis/refine.h"
#include "curve_case.h"

#include <float.h>

/* The largest distance of b at `map` of t from a at t, over [from, to], in roundings of a size of 1. */
static double difference(batten_context *ctx, const batten_curve *a, const batten_curve *b, double from, double to,
                         double scale, double shift) {
  double worst = 0;
  for (int i = 0; i <= 200; i++) {
    double t = i == 200 ? to : from + (to - from) * i / 200, u = scale * t + shift;
    batten_curve_point p, q;
    if (batten_curve_evaluate(ctx, a, 1, &t, &p) < 0 || batten_curve_evaluate(ctx, b, 1, &u, &q) < 0) {
      printf("# %s\n", batten_error(ctx));
      return INFINITY;
    }
    worst = fmax(worst, hypot(p.point[0] - q.point[0], p.point[1] - q.point[1]));
  }
  return worst / DBL_EPSILON;
}

/* Whether the form is one that batten_curve_create takes. */
static bool is_valid(batten_context *ctx, const batten_curve *curve) {
  batten_curve_form form = batten_curve_get(curve);
  batten_curve *again = NULL;
  bool ok = batten_curve_create(ctx, &form, &again) == BATTEN_OK;
  if (!ok) printf("# %s\n", batten_error(ctx));
  batten_curve_free(again);
  return ok;
}

/* ---- by hand ------------------------------------------------------------------------------------- */

static void test_parabola(batten_context *ctx) {
  /* (t, t^2) on [0, 4], cut at 1 and 2; all in whole numbers and halves. */
  const curve_case c = {
      .degree = 2, .knot_count = 6, .knots = {0, 0, 0, 4, 4, 4}, .control = {{0, 0}, {2, 0}, {4, 16}}};
  const double knots[3] = {2, 1, 2};
  const double expected[6][2] = {{0, 0}, {0.5, 0}, {1.5, 2}, {2, 4}, {3, 8}, {4, 16}};
  batten_curve *curve = curve_case_make(ctx, &c), *more = NULL, *part = NULL;
  T_OK(batten_curve_insert_knots(ctx, curve, 3, knots, &more), ctx);
  batten_curve_form f = batten_curve_get(more);
  T_CHECK(f.knot_count == 9 && f.knots[3] == 1 && f.knots[4] == 2 && f.knots[5] == 2 &&
              memcmp(f.control_points, expected, sizeof expected) == 0,
          "a parabola with knots 1, 2, 2");
  T_OK(batten_curve_part(ctx, more, 1, 2, &part), ctx);
  f = batten_curve_get(part);
  T_CHECK(f.knot_count == 6 && f.knots[2] == 1 && f.knots[3] == 2 && f.control_points[2] == 1.5 &&
              f.control_points[3] == 2 && f.control_points[1] == 1,
          "its part from 1 to 2");
  batten_curve_free(part);
  T_OK(batten_curve_elevate(ctx, curve, 3, &part), ctx);
  f = batten_curve_get(part);
  T_CHECK(f.degree == 3 && f.knot_count == 8 && fabs(f.control_points[2] - 4 / 3.0) < 1e-15 &&
              f.control_points[3] == 0 && fabs(f.control_points[4] - 8 / 3.0) < 1e-15 &&
              fabs(f.control_points[5] - 16 / 3.0) < 2e-15,
          "as a cubic");
  batten_curve_free(part);
  batten_curve_free(more);
  batten_curve_free(curve);
}

/* Bezier points of a span, by the blossom and by inserting its ends. */
static void test_blossom(batten_context *ctx) {
  uint64_t state = 23;
  double worst = 0;
  for (unsigned d = 1; d <= 9; d++) {
    curve_case c = curve_case_random(&state, d, 3, 1, 0, -1, 2);
    bspline b = {d, curve_case_count(&c), c.knots};
    batten_curve *curve = curve_case_make(ctx, &c), *part = NULL;
    for (size_t mu = bspline_first(&b); mu < b.count; mu = bspline_next(&b, mu)) {
      double at[9], point[2];
      T_CHECK(batten_curve_part(ctx, curve, c.knots[mu], c.knots[mu + 1], &part) == BATTEN_OK, "span %zu, degree %u",
              mu, d);
      batten_curve_form f = batten_curve_get(part);
      for (unsigned i = 0; i <= d; i++) {
        for (unsigned k = 0; k < d; k++) at[k] = k < i ? c.knots[mu + 1] : c.knots[mu];
        bspline_blossom(&b, 2, c.control[0], mu, at, point);
        worst = fmax(worst, hypot(point[0] - f.control_points[2 * i], point[1] - f.control_points[2 * i + 1]));
      }
      batten_curve_free(part);
    }
    batten_curve_free(curve);
  }
  T_RATIO(worst / DBL_EPSILON, 8, "Bezier points by insertion and by the blossom, in roundings");
}

/* ---- random curves ------------------------------------------------------------------------------- */

/* Every degree and multiplicity, spans of any ratio: convex combinations keep it to rounding. */
static void test_same_curve(batten_context *ctx) {
  uint64_t state = 29;
  double inserted = 0, elevated = 0, parts = 0, reversed = 0;
  bool valid = true, ends = true, inside = true;
  for (unsigned d = 1; d <= 9; d++)
    for (int closed = 0; closed < 2; closed++)
      for (unsigned fold = 1; fold <= d; fold += d > 4 ? 4 : 1) {
        curve_case c = curve_case_random(&state, d, 3, fold, closed, 0, 1);
        /* One span is very short. */
        for (size_t k = d + 1; k < curve_case_count(&c); k++) c.knots[k] *= closed ? 1 : 1e-7;
        batten_curve *curve = curve_case_make(ctx, &c), *other = NULL;
        double knots[6];
        for (int k = 0; k < 5; k++) knots[k] = t_uniform(&state);
        knots[5] = knots[0];
        size_t count = d > 1 ? 6 : 5;
        if (batten_curve_insert_knots(ctx, curve, count, knots, &other) < 0) {
          t_line(false, "%s", batten_error(ctx));
          continue;
        }
        inserted = fmax(inserted, difference(ctx, curve, other, 0, 1, 1, 0));
        batten_curve_form f = batten_curve_get(other);
        size_t last = f.knot_count - f.degree - 2;
        valid = valid && is_valid(ctx, other);
        ends = ends && memcmp(f.control_points, c.control[0], sizeof c.control[0]) == 0 &&
               memcmp(f.control_points + 2 * last, c.control[curve_case_count(&c) - 1], sizeof c.control[0]) == 0;
        for (size_t i = 0; i <= 2 * last + 1; i++) inside = inside && fabs(f.control_points[i]) <= 1;
        batten_curve_free(other);
        for (unsigned e = d; e <= 9; e++) {
          if (batten_curve_elevate(ctx, curve, e, &other) < 0) {
            t_line(false, "%s", batten_error(ctx));
            continue;
          }
          elevated = fmax(elevated, difference(ctx, curve, other, 0, 1, 1, 0));
          valid = valid && is_valid(ctx, other);
          f = batten_curve_get(other);
          for (size_t i = 0; i < 2 * (f.knot_count - e - 1); i++) inside = inside && fabs(f.control_points[i]) <= 1;
          batten_curve_free(other);
        }
        double from = 0.6 * t_uniform(&state), to = from + 0.3;
        if (batten_curve_part(ctx, curve, from, to, &other) < 0) t_line(false, "%s", batten_error(ctx));
        parts = fmax(parts, difference(ctx, curve, other, from, to, 1, 0));
        valid = valid && is_valid(ctx, other) && !batten_curve_get(other).closed;
        batten_curve_free(other);
        if (batten_curve_reverse(ctx, curve, &other) < 0) t_line(false, "%s", batten_error(ctx));
        valid = valid && is_valid(ctx, other) && batten_curve_get(other).closed == closed;
        /* Steep where the short span is: there 1 - t is another parameter. */
        if (closed) reversed = fmax(reversed, difference(ctx, curve, other, 0, 1, -1, 1));
        batten_curve_free(other);
        batten_curve_free(curve);
      }
  T_RATIO(inserted, 12, "with more knots, in roundings");
  T_RATIO(elevated, 12, "of a higher degree, in roundings");
  T_RATIO(parts, 12, "parts, in roundings");
  T_RATIO(reversed, 60, "reversed, in roundings"); /* 1 - t rounds, and x' is up to 50 */
  T_CHECK(valid, "all are curves that batten_curve_create takes");
  T_CHECK(ends, "ends are the same to the bit");
  T_CHECK(inside, "control points stay in the convex hull");
}

/* What is smooth stays so: as many knots as need be and no more. */
static void test_elevated_knots(batten_context *ctx) {
  const curve_case c = {.degree = 3,
                        .knot_count = 11,
                        .knots = {0, 0, 0, 0, 1, 2, 2, 3, 3, 3, 3},
                        .control = {{0, 0}, {1, 3}, {2, -1}, {3, 1}, {4, 4}, {5, 1}, {6, 0}}};
  const double expected[17] = {0, 0, 0, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
  batten_curve *curve = curve_case_make(ctx, &c), *other = NULL;
  T_OK(batten_curve_elevate(ctx, curve, 5, &other), ctx);
  batten_curve_form f = batten_curve_get(other);
  T_CHECK(f.knot_count == 19 && memcmp(f.knots, expected, sizeof expected) == 0, "knots of a cubic as a quintic");
  /* Back and forth: the quintic's third difference at 1 is the cubic's. */
  double t = 1, a[2][6][2];
  T_OK(batten_curve_derivatives(ctx, curve, 5, 1, &t, a[0][0]), ctx);
  T_OK(batten_curve_derivatives(ctx, other, 5, 1, &t, a[1][0]), ctx);
  double worst = 0;
  for (int k = 0; k < 6; k++) worst = fmax(worst, hypot(a[0][k][0] - a[1][k][0], a[0][k][1] - a[1][k][1]));
  T_RATIO(worst, 1e-12, "all derivatives of the quintic");
  batten_curve_free(other);
  batten_curve_free(curve);
}

/* ---- parts of closed curves, split --------------------------------------------------------------- */

static void test_seam(batten_context *ctx) {
  uint64_t state = 31;
  double worst = 0;
  bool valid = true;
  const double part[][2] = {{0.7, 1.3},   {0.7, 1.7},  {0, 1},   {1, 2},       {1, 1.25},
                            {-0.25, 0.5}, {-3.75, -3}, {7.5, 8}, {0.25, 1.25}, {0.5, 1}};
  for (unsigned d = 1; d <= 9; d += 2) {
    curve_case c = curve_case_random(&state, d, 4, d > 2 ? 2 : 1, 1, 0, 1);
    batten_curve *curve = curve_case_make(ctx, &c), *other = NULL;
    for (size_t k = 0; k < sizeof part / sizeof *part; k++) {
      if (batten_curve_part(ctx, curve, part[k][0], part[k][1], &other) < 0) {
        t_line(false, "%s", batten_error(ctx));
        continue;
      }
      batten_curve_form f = batten_curve_get(other);
      valid = valid && is_valid(ctx, other) && !f.closed && f.knots[0] == part[k][0] &&
              f.knots[f.knot_count - 1] == part[k][1];
      worst = fmax(worst, difference(ctx, curve, other, part[k][0], part[k][1], 1, 0));
      batten_curve_free(other);
    }
    batten_curve_free(curve);
  }
  T_CHECK(valid, "parts over the seam are open curves with the parameters that were asked for");
  T_RATIO(worst, 200, "parts over the seam, in roundings"); /* parameters up to 8 round */
}

static void test_split(batten_context *ctx) {
  uint64_t state = 37;
  curve_case c = curve_case_random(&state, 3, 5, 3, 1, -1, 1);
  batten_curve *curve = curve_case_make(ctx, &c), *parts[2] = {NULL, NULL};
  T_OK(batten_curve_split(ctx, curve, 0.125, &parts[0], &parts[1]), ctx);
  T_RATIO(fmax(difference(ctx, curve, parts[0], -1, 0.125, 1, 0), difference(ctx, curve, parts[1], 0.125, 1, 1, 0)),
          12, "both parts, in roundings");
  batten_curve_form f = batten_curve_get(parts[0]), g = batten_curve_get(parts[1]);
  T_CHECK(memcmp(f.control_points + 2 * (f.knot_count - 5), g.control_points, 2 * sizeof(double)) == 0 &&
              f.knots[f.knot_count - 1] == 0.125 && g.knots[0] == 0.125,
          "they meet to the bit");
  batten_curve_free(parts[0]);
  batten_curve_free(parts[1]);
  parts[0] = parts[1] = NULL;
  T_STATUS(batten_curve_split(ctx, curve, 1, &parts[0], &parts[1]), BATTEN_E_INVALID, ctx, "t: 1; give one between");
  T_STATUS(batten_curve_split(ctx, curve, NAN, &parts[0], &parts[1]), BATTEN_E_INVALID, ctx, "t: nan");
  T_STATUS(batten_curve_split(ctx, curve, 0, &parts[0], NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(!parts[0] && !parts[1], "nothing was made");
  batten_curve_free(curve);
}

/* ---- reversed and moved -------------------------------------------------------------------------- */

static void test_moved(batten_context *ctx) {
  uint64_t state = 41;
  curve_case c = curve_case_random(&state, 4, 3, 2, 1, 1, 3);
  batten_curve *curve = curve_case_make(ctx, &c), *other = NULL, *back = NULL;
  const double matrix[4] = {0, -2, 2, 0}, shift[2] = {0.5, -4}, domain[2] = {2, 6}, inverse[4] = {0, 0.5, -0.5, 0};
  T_OK(batten_curve_transform(ctx, curve, matrix, shift, domain, &other), ctx);
  double worst = 0, bend = 0;
  for (int i = 0; i <= 50; i++) {
    double t = 1 + i / 25.0, u = 2 * t;
    batten_curve_point p, q;
    batten_curve_evaluate(ctx, curve, 1, &t, &p);
    batten_curve_evaluate(ctx, other, 1, &u, &q);
    worst = fmax(worst, hypot(-2 * p.point[1] + 0.5 - q.point[0], 2 * p.point[0] - 4 - q.point[1]));
    bend = fmax(bend, fabs(q.curvature - 0.5 * p.curvature) / fabs(q.curvature));
  }
  T_RATIO(worst / DBL_EPSILON, 16, "turned, doubled and moved, in roundings");
  T_RATIO(bend, 1e-10, "half the curvature");
  T_CHECK(is_valid(ctx, other) && batten_curve_get(other).closed, "closed as before");
  batten_curve_free(other);
  T_OK(batten_curve_transform(ctx, curve, matrix, NULL, NULL, &other), ctx);
  T_OK(batten_curve_transform(ctx, other, inverse, NULL, NULL, &back), ctx);
  batten_curve_form f = batten_curve_get(back);
  T_CHECK(memcmp(f.control_points, c.control, curve_case_count(&c) * sizeof c.control[0]) == 0 &&
              memcmp(f.knots, c.knots, c.knot_count * sizeof *c.knots) == 0,
          "there and back: the same bits");
  batten_curve_free(other);
  batten_curve_free(back);
  T_OK(batten_curve_transform(ctx, curve, NULL, NULL, (const double[]){-1e300, 1e300}, &other), ctx);
  T_CHECK(is_valid(ctx, other) && batten_curve_get(other).knots[0] == -1e300, "over a huge domain");
  batten_curve_free(other);
  /* Reversed twice; curvature and tangent change their sign. */
  T_OK(batten_curve_reverse(ctx, curve, &other), ctx);
  T_OK(batten_curve_reverse(ctx, other, &back), ctx);
  T_RATIO(difference(ctx, curve, back, 1, 3, 1, 0), 64, "reversed twice, in roundings");
  double t = 1.3, u = 2.7;
  batten_curve_point p, q;
  batten_curve_evaluate(ctx, curve, 1, &t, &p);
  batten_curve_evaluate(ctx, other, 1, &u, &q);
  T_RATIO(fabs(p.curvature + q.curvature) / fabs(p.curvature) + fabs(p.tangent[0] + q.tangent[0]), 1e-12,
          "the other way round curvature and tangent have the other sign");
  batten_curve_free(other);
  batten_curve_free(back);
  batten_curve_free(curve);
}

/* ---- refusals ------------------------------------------------------------------------------------ */

static void test_bad(batten_context *ctx) {
  const curve_case c = {
      .degree = 2, .knot_count = 7, .knots = {0, 0, 0, 0.5, 1, 1, 1}, .control = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  curve_case round = c, narrow = c;
  memcpy(round.control[3], round.control[0], sizeof round.control[0]);
  round.closed = 1;
  narrow.knots[3] = 1e-20;
  batten_curve *curve = curve_case_make(ctx, &c), *loop = curve_case_make(ctx, &round),
               *thin = curve_case_make(ctx, &narrow), *out = NULL;
  T_STATUS(batten_curve_insert_knots(ctx, curve, 2, (double[]){0.5, 0.5}, &out), BATTEN_E_INVALID, ctx,
           "knots[1]: 0.5 would be there more often than 2 times, the degree; leave it out");
  T_STATUS(batten_curve_insert_knots(ctx, curve, 1, (double[]){0}, &out), BATTEN_E_INVALID, ctx, "knots[0]: 0 would");
  T_STATUS(batten_curve_insert_knots(ctx, loop, 1, (double[]){3}, &out), BATTEN_E_INVALID, ctx, "knots[0]: 0 would");
  T_STATUS(batten_curve_insert_knots(ctx, curve, 1, (double[]){1.5}, &out), BATTEN_E_INVALID, ctx,
           "knots[0]: 1.5; give one from 0 to 1");
  T_STATUS(batten_curve_insert_knots(ctx, curve, 1, NULL, &out), BATTEN_E_INVALID, ctx, "knots: NULL; give 1");
  T_STATUS(batten_curve_insert_knots(ctx, NULL, 0, NULL, &out), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_insert_knots(ctx, curve, 0, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_curve_elevate(ctx, curve, 1, &out), BATTEN_E_INVALID, ctx,
           "degree: 1; give one from 2, the curve's, to 9");
  T_STATUS(batten_curve_elevate(ctx, curve, 10, &out), BATTEN_E_INVALID, ctx, "degree: 10");
  T_STATUS(batten_curve_part(ctx, curve, 0.5, 0.5, &out), BATTEN_E_INVALID, ctx, "to: 0.5; give one after from, 0.5");
  T_STATUS(batten_curve_part(ctx, curve, -0.5, 0.5, &out), BATTEN_E_INVALID, ctx, "from: -0.5; give one from 0 to 1");
  T_STATUS(batten_curve_part(ctx, curve, 0.5, NAN, &out), BATTEN_E_INVALID, ctx, "to: nan");
  T_STATUS(batten_curve_part(ctx, loop, 0.25, 1.5, &out), BATTEN_E_INVALID, ctx,
           "to: 1.5; give one up to 1.25, once round from there");
  T_STATUS(batten_curve_part(ctx, loop, -1e-30, 1e-30, &out), BATTEN_E_INVALID, ctx, "too near to from");
  T_STATUS(batten_curve_part(ctx, loop, 1e17, 1e17 + 1, &out), BATTEN_E_INVALID, ctx, "to: 1");
  T_STATUS(batten_curve_reverse(ctx, thin, &out), BATTEN_E_INVALID, ctx,
           "curve: knots 9.9999999999999995e-21 and 0 would both be 1 there; its spans are too different");
  T_STATUS(
      batten_curve_transform(ctx, thin, NULL, NULL, (double[]){1, 2}, &out), BATTEN_E_INVALID, ctx,
      "domain: knots 0 and 9.9999999999999995e-21 would both be 1 there; give one in which short spans are near");
  T_STATUS(batten_curve_transform(ctx, curve, (double[]){1, 0, 0, NAN}, NULL, NULL, &out), BATTEN_E_INVALID, ctx,
           "matrix[3]: nan");
  T_STATUS(batten_curve_transform(ctx, curve, NULL, (double[]){INFINITY, 0}, NULL, &out), BATTEN_E_INVALID, ctx,
           "shift[0]: inf");
  T_STATUS(batten_curve_transform(ctx, curve, NULL, NULL, (double[]){1, 1}, &out), BATTEN_E_INVALID, ctx,
           "domain: 1 to 1; give a rising one");
  T_STATUS(batten_curve_transform(ctx, curve, (double[]){1e308, 1e308, 0, 1}, NULL, NULL, &out), BATTEN_E_INVALID,
           ctx, "control_points[2][0]: inf");
  T_CHECK(!out, "nothing was made");
  batten_curve_free(curve);
  batten_curve_free(loop);
  batten_curve_free(thin);
}

static batten_status make_all(batten_context *ctx, void *arg) {
  const curve_case *c = arg;
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL, *out[7] = {NULL};
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st >= 0) st = batten_curve_insert_knots(ctx, curve, 2, (double[]){0.1, 0.7}, &out[0]);
  if (st >= 0) st = batten_curve_elevate(ctx, curve, c->degree + 2, &out[1]);
  if (st >= 0) st = batten_curve_part(ctx, curve, 0.7, 1.3, &out[2]);
  if (st >= 0) st = batten_curve_split(ctx, curve, 0.3, &out[3], &out[4]);
  if (st >= 0) st = batten_curve_reverse(ctx, curve, &out[5]);
  if (st >= 0) st = batten_curve_transform(ctx, curve, (double[]){2, 0, 0, 2}, NULL, (double[]){-1, 1}, &out[6]);
  for (int k = 0; k < 7; k++) batten_curve_free(out[k]);
  batten_curve_free(curve);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  uint64_t state = 43;
  curve_case c = curve_case_random(&state, 3, 4, 2, 1, 0, 1);
  test_parabola(ctx);
  test_blossom(ctx);
  test_same_curve(ctx);
  test_elevated_knots(ctx);
  test_seam(ctx);
  test_split(ctx);
  test_moved(ctx);
  test_bad(ctx);
  t_fail_every_allocation("all that makes other forms of a curve", make_all, &c);
  batten_context_free(ctx);
  return t_done();
}
