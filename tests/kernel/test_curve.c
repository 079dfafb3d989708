/* Curves: what they are made of, their points and derivatives. */
#include "curve_case.h"

#include <float.h>

/* ---- create ------------------------------------------------------------------------------------- */

static const curve_case parabola = {
    .degree = 2, .knot_count = 6, .knots = {0, 0, 0, 1, 1, 1}, .control = {{0, 0}, {0.5, 0}, {1, 1}}};

static void refused(batten_context *ctx, const curve_case *c, const char *part) {
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  t_line(st == BATTEN_E_INVALID && !curve && strstr(batten_error(ctx), part), "refused: %s", batten_error(ctx));
}

static void test_parts(batten_context *ctx) {
  uint64_t state = 5;
  curve_case c = curve_case_random(&state, 4, 6, 4, 1, -3, 2);
  batten_curve *curve = curve_case_make(ctx, &c);
  batten_curve_form f = batten_curve_get(curve);
  T_CHECK(f.degree == 4 && f.knot_count == c.knot_count && f.closed &&
              memcmp(f.knots, c.knots, c.knot_count * sizeof(double)) == 0 &&
              memcmp(f.control_points, c.control, curve_case_count(&c) * sizeof c.control[0]) == 0 &&
              f.knots != c.knots,
          "a curve has copies of its parts");
  batten_curve_free(curve);
  batten_curve_free(NULL);
}

static void test_bad(batten_context *ctx) {
  uint64_t state = 6;
  const curve_case good = curve_case_random(&state, 3, 2, 1, 0, 0, 1);
  curve_case c = good;
  batten_curve *curve = NULL;
  batten_curve_form f = curve_case_form(&good);
  T_STATUS(batten_curve_create(ctx, NULL, &curve), BATTEN_E_INVALID, ctx, "form: NULL");
  T_STATUS(batten_curve_create(ctx, &f, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_CHECK(batten_curve_create(NULL, &f, &curve) == BATTEN_E_INVALID && !curve, "no context");
  c.degree = 10;
  refused(ctx, &c, "degree: 10; give 1 to 9");
  c.degree = 0;
  refused(ctx, &c, "degree: 0; give 1 to 9");
  c = good;
  c.knot_count = 7;
  refused(ctx, &c, "knot_count: 7; degree 3 needs 8 knots at least");
  c = good;
  c.knots[4] = NAN;
  refused(ctx, &c, "knots[4]: nan; give finite knots");
  c.knots[4] = 2;
  refused(ctx, &c, "is below the knot before it; sort them");
  c.knots[4] = 0;
  refused(ctx, &c, "knots[4]: 0 repeats too often; inner knots may be there 3 times");
  c = good;
  c.knots[1] = c.knots[2] = c.knots[3] = 0.01;
  refused(ctx, &c, "knots[1]: 0.01; the first and the last 4 knots of degree 3 must be equal");
  c = good;
  for (size_t k = 0; k < c.knot_count; k++) c.knots[k] = 7;
  refused(ctx, &c, "knots: all are 7; give a domain of some length");
  c = good;
  for (size_t k = 0; k < c.knot_count; k++) c.knots[k] = (2 * c.knots[k] - 1) * 1e308;
  refused(ctx, &c, "knots: -1e+308 to 1e+308; their distance is beyond a double");
  c = good;
  c.control[3][1] = INFINITY;
  refused(ctx, &c, "control_points[3][1]: inf; give finite points");
  c.control[3][1] = 1e308;
  c.control[2][1] = -1e308;
  refused(ctx, &c, "control_points: their box is larger than a double can say; scale them");
  c = good;
  c.closed = 1;
  refused(ctx, &c, "control_points[5]");
  f.control_points = NULL;
  T_STATUS(batten_curve_create(ctx, &f, &curve), BATTEN_E_INVALID, ctx, "control_points: NULL; give [6][2]");
  f = curve_case_form(&good);
  f.knots = NULL;
  T_STATUS(batten_curve_create(ctx, &f, &curve), BATTEN_E_INVALID, ctx, "knots: NULL; give 10");
}

/* ---- evaluation --------------------------------------------------------------------------------- */

static void test_parabola(batten_context *ctx) {
  /* (t, t^2) */
  batten_curve *curve = curve_case_make(ctx, &parabola);
  double t[3] = {0, 0.5, 1}, d[3][5][2];
  batten_curve_point p[3];
  T_OK(batten_curve_evaluate(ctx, curve, 3, t, p), ctx);
  T_OK(batten_curve_derivatives(ctx, curve, 4, 3, t, d[0][0]), ctx);
  for (int i = 0; i < 3; i++) {
    double k = 2 / pow(1 + 4 * t[i] * t[i], 1.5), speed = sqrt(1 + 4 * t[i] * t[i]);
    T_CHECK(p[i].point[0] == t[i] && p[i].point[1] == t[i] * t[i] && p[i].first[0] == 1 &&
                p[i].first[1] == 2 * t[i] && p[i].second[0] == 0 && p[i].second[1] == 2,
            "the parabola at %g", t[i]);
    T_RATIO(fabs(p[i].curvature - k) + fabs(p[i].tangent[0] - 1 / speed) + fabs(p[i].tangent[1] - 2 * t[i] / speed),
            1e-15, "its curvature and tangent at %g", t[i]);
    T_CHECK(memcmp(d[i][0], p[i].point, sizeof d[i][0]) == 0 && memcmp(d[i][1], p[i].first, sizeof d[i][1]) == 0 &&
                memcmp(d[i][2], p[i].second, sizeof d[i][2]) == 0 && d[i][3][0] == 0 && d[i][3][1] == 0 &&
                d[i][4][0] == 0 && d[i][4][1] == 0,
            "derivatives are the same, those above the degree 0");
  }
  batten_curve_free(curve);
}

/* Against Cox and de Boor: every degree, knots up to degree times, inside of spans and at knots. */
static void test_recursion(batten_context *ctx) {
  double worst[10] = {0};
  uint64_t state = 11;
  for (unsigned degree = 1; degree <= 9; degree++)
    for (unsigned fold = 1; fold <= degree; fold += degree > 5 ? 3 : 1) {
      curve_case c = curve_case_random(&state, degree, 4, fold, 0, -2, 5);
      batten_curve_form f = curve_case_form(&c);
      batten_curve *curve = curve_case_make(ctx, &c);
      for (int i = 0; i < 12; i++) {
        double t = i < 8 ? -2 + 7 * t_uniform(&state) : c.knots[(size_t)(i - 7) * (c.knot_count - 1) / 4];
        double all[10][2];
        if (i == 7) t = -2;
        if (batten_curve_derivatives(ctx, curve, degree, 1, &t, all[0]) < 0) t_line(false, "%s", batten_error(ctx));
        for (unsigned k = 0; k <= degree; k++) {
          double expected[2], scale;
          curve_case_value(&f, k, t, expected, &scale);
          double error = hypot(all[k][0] - expected[0], all[k][1] - expected[1]) / (scale * DBL_EPSILON);
          worst[k] = fmax(worst[k], error);
        }
      }
      batten_curve_free(curve);
    }
  for (unsigned k = 0; k <= 9; k++)
    T_RATIO(worst[k], 20, "derivative %u against Cox and de Boor, in roundings of the terms", k);
}

static void test_sides(batten_context *ctx) {
  /* A corner at 1: from the right; at the end from the left. */
  curve_case c = {.degree = 1,
                  .knot_count = 6,
                  .knots = {0, 0, 1, 3, 4, 4},
                  .control = {{0, 0}, {1, 0}, {1, 2}, {0, 0}},
                  .closed = 1};
  batten_curve *curve = curve_case_make(ctx, &c);
  double t[6] = {1, 4, 3, 5, -1, 404};
  batten_curve_point p[6];
  T_OK(batten_curve_evaluate(ctx, curve, 6, t, p), ctx);
  T_CHECK(p[0].first[0] == 0 && p[0].first[1] == 1 && p[0].tangent[1] == 1, "from the right at a corner");
  T_CHECK(p[1].first[0] == -1 && p[1].first[1] == -2, "from the left at the end");
  T_CHECK(p[3].point[0] == 1 && p[3].point[1] == 0 && p[3].first[1] == 1, "closed: 5 is 1");
  T_CHECK(memcmp(&p[4].point, &p[2].point, sizeof p[2].point) == 0, "closed: -1 is 3");
  T_CHECK(p[5].point[0] == 0 && p[5].first[0] == 1, "closed: a hundred times round, to the start");
  T_CHECK(p[2].curvature == 0, "a polygon's sides are straight");
  t[1] = NAN;
  T_STATUS(batten_curve_evaluate(ctx, curve, 2, t, p), BATTEN_E_INVALID, ctx,
           "parameters[1]: nan; give a finite one");
  batten_curve_free(curve);
  curve = curve_case_make(ctx, &parabola);
  t[1] = 1.5;
  T_STATUS(batten_curve_evaluate(ctx, curve, 2, t, p), BATTEN_E_INVALID, ctx,
           "parameters[1]: 1.5; give one from 0 to 1");
  T_STATUS(batten_curve_derivatives(ctx, curve, 1, 2, t, p[0].point), BATTEN_E_INVALID, ctx, "parameters[1]: 1.5");
  T_STATUS(batten_curve_evaluate(ctx, curve, 2, NULL, p), BATTEN_E_INVALID, ctx, "parameters: NULL; give 2");
  T_STATUS(batten_curve_evaluate(ctx, curve, 2, t, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_curve_evaluate(ctx, NULL, 2, t, p), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_OK(batten_curve_evaluate(ctx, curve, 0, NULL, NULL), ctx);
  T_CHECK(batten_curve_evaluate(NULL, curve, 1, t, p) == BATTEN_E_INVALID, "no context");
  batten_curve_free(curve);
}

/* Units of the curve and of its parameter by powers of two: the same bits, even at the ends of the doubles. */
static void test_scales(batten_context *ctx) {
  uint64_t state = 17;
  const curve_case c = curve_case_random(&state, 5, 4, 2, 0, 0, 1);
  batten_curve *curve = curve_case_make(ctx, &c);
  const int by[][2] = {{0, 3}, {40, -50}, {900, 600}, {-900, -600}, {1000, 1020}, {-1000, 1000}, {1000, -1000}};
  for (size_t s = 0; s < sizeof by / sizeof *by; s++) {
    curve_case d = c;
    for (size_t k = 0; k < c.knot_count; k++) d.knots[k] = ldexp(c.knots[k], by[s][1]);
    for (size_t k = 0; k < curve_case_count(&c); k++)
      for (int x = 0; x < 2; x++) d.control[k][x] = ldexp(c.control[k][x], by[s][0]);
    batten_curve *other = curve_case_make(ctx, &d);
    bool same = true, turned = true;
    for (int i = 0; i <= 20; i++) {
      double t = i / 20.0, u = ldexp(t, by[s][1]);
      batten_curve_point p, q;
      if (batten_curve_evaluate(ctx, curve, 1, &t, &p) < 0 || batten_curve_evaluate(ctx, other, 1, &u, &q) < 0)
        same = false;
      for (int x = 0; x < 2; x++) {
        same =
            same && q.point[x] == ldexp(p.point[x], by[s][0]) && q.first[x] == ldexp(p.first[x], by[s][0] - by[s][1]);
        turned = turned && q.tangent[x] == p.tangent[x];
      }
      turned = turned && q.curvature == ldexp(p.curvature, -by[s][0]);
    }
    T_CHECK(same && turned, "the same bits for 2^%d times the curve over 2^%d times the domain", by[s][0], by[s][1]);
    batten_curve_free(other);
  }
  batten_curve_free(curve);
}

static void test_degenerate(batten_context *ctx) {
  uint64_t state = 19;
  curve_case c = curve_case_random(&state, 4, 3, 2, 0, 0, 1);
  for (size_t k = 0; k < curve_case_count(&c); k++)
    memcpy(c.control[k], (double[2]){0.1, 1e17 / 3}, 2 * sizeof(double));
  batten_curve *curve = curve_case_make(ctx, &c);
  bool same = true;
  for (int i = 0; i <= 30; i++) {
    double t = i / 30.0;
    batten_curve_point p;
    if (batten_curve_evaluate(ctx, curve, 1, &t, &p) < 0) same = false;
    same = same && p.point[0] == 0.1 && p.point[1] == 1e17 / 3 && p.first[0] == 0 && p.tangent[0] == 0 &&
           p.tangent[1] == 0 && isnan(p.curvature);
  }
  T_CHECK(same, "a curve that is one point stays there, without tangent and curvature");
  batten_curve_free(curve);
  /* A cusp inside, at 1/2: (s^2, s^3) with s = 2 t - 1. */
  curve_case cusp = {.degree = 3,
                     .knot_count = 8,
                     .knots = {0, 0, 0, 0, 1, 1, 1, 1},
                     .control = {{1, -1}, {-1 / 3.0, 1}, {-1 / 3.0, -1}, {1, 1}}};
  curve = curve_case_make(ctx, &cusp);
  double t = 0.5;
  batten_curve_point p;
  T_OK(batten_curve_evaluate(ctx, curve, 1, &t, &p), ctx);
  T_CHECK(p.tangent[0] == 0 && p.tangent[1] == 0 && isnan(p.curvature), "no tangent at a cusp: first (%g, %g)",
          p.first[0], p.first[1]);
  batten_curve_free(curve);
}

static void test_threads(const curve_case *c) {
  enum { COUNT = 5000 };
  static batten_curve_point out[2][COUNT];
  static double t[COUNT];
  for (int i = 0; i < COUNT; i++) t[i] = (double)i / (COUNT - 1);
  for (unsigned k = 0; k < 2; k++) {
    batten_context *ctx = t_context(NULL, NULL, k ? 3 : 1);
    batten_curve *curve = curve_case_make(ctx, c);
    T_OK(batten_curve_evaluate(ctx, curve, COUNT, t, out[k]), ctx);
    batten_curve_free(curve);
    batten_context_free(ctx);
  }
  T_CHECK(memcmp(out[0], out[1], sizeof out[0]) == 0, "the same bits for 1 and 3 threads");
}

static batten_status make_one(batten_context *ctx, void *arg) {
  const curve_case *c = arg;
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  batten_curve_free(curve);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  uint64_t state = 3;
  curve_case c = curve_case_random(&state, 3, 9, 2, 0, 0, 1);
  test_parts(ctx);
  test_bad(ctx);
  test_parabola(ctx);
  test_recursion(ctx);
  test_sides(ctx);
  test_scales(ctx);
  test_degenerate(ctx);
  test_threads(&c);
  t_fail_every_allocation("batten_curve_create", make_one, &c);
  batten_context_free(ctx);
  return t_done();
}
