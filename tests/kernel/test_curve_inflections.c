/* batten_curve_inflections: by hand, beside sampling, and what must not count. */
#include "curve_case.h"

static size_t find(batten_context *ctx, const curve_case *c, double *out, size_t room) {
  batten_curve *curve = curve_case_make(ctx, c);
  size_t count = SIZE_MAX;
  double *found = NULL;
  if (batten_curve_inflections(ctx, curve, &count, &found) < 0) t_line(false, "inflections: %s", batten_error(ctx));
  for (size_t i = 0; i < count && i < room; i++) out[i] = found[i];
  bool ascending = (count == 0) == (found == NULL);
  for (size_t i = 1; i < count; i++) ascending = ascending && found[i - 1] <= found[i];
  if (!ascending) t_line(false, "inflections ascending, NULL when there are none");
  batten_free(ctx, found);
  batten_curve_free(curve);
  return count;
}

static void test_by_hand(batten_context *ctx) {
  double at[8];
  /* y = x^3 - x, x = 2 t - 1: by polar forms, xyz - (x + y + z) / 3. */
  curve_case cubic = {.degree = 3,
                      .knot_count = 8,
                      .knots = {0, 0, 0, 0, 1, 1, 1, 1},
                      .control = {{-1, 0}, {-1 / 3.0, 4 / 3.0}, {1 / 3.0, -4 / 3.0}, {1, 0}}};
  size_t count = find(ctx, &cubic, at, 8);
  T_CHECK(count == 1 && fabs(at[0] - 0.5) < 1e-14, "the cubic y = x^3 - x: %zu, at %.17g", count, at[0]);
  curve_case parabola = {
      .degree = 2, .knot_count = 6, .knots = {0, 0, 0, 1, 1, 1}, .control = {{0, 0}, {1, 1}, {2, 0}}};
  T_CHECK(find(ctx, &parabola, at, 8) == 0, "a parabola has none");
  /* Two parabolas, C1, that bend against each other: the knot itself. */
  curve_case s = {
      .degree = 2, .knot_count = 7, .knots = {0, 0, 0, 0.3, 1, 1, 1}, .control = {{0, 0}, {1, 1}, {2, 0}, {3, 1}}};
  count = find(ctx, &s, at, 8);
  T_CHECK(count == 1 && at[0] == 0.3, "curvature that jumps at a knot: %zu, at %.17g", count, at[0]);
  /* A straight piece between: C2 cubics whose four middle points are on a line. */
  curve_case bend = {.degree = 3,
                     .knot_count = 12,
                     .knots = {0, 0, 0, 0, 1, 2, 3, 4, 5, 5, 5, 5},
                     .control = {{-2, 1}, {-1, 0}, {0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, -1}}};
  count = find(ctx, &bend, at, 8);
  T_CHECK(count == 1 && fabs(at[0] - 2.5) < 1e-9, "a straight piece counts once, in its middle: %zu, at %.17g", count,
          at[0]);
  for (int i = 0; i < 3; i++) bend.control[i][1] *= -1;
  T_CHECK(find(ctx, &bend, at, 8) == 0, "a straight piece between like signs does not count");
  curve_case line = {.degree = 3,
                     .knot_count = 9,
                     .knots = {0, 0, 0, 0, 1, 2, 2, 2, 2},
                     .control = {{1e6, 1e6},
                                 {1e6 + 0.1, 1e6 + 0.1},
                                 {1e6 + 0.3, 1e6 + 0.3},
                                 {1e6 + 0.5, 1e6 + 0.5},
                                 {1e6 + 0.6, 1e6 + 0.6}}};
  line.control[2][1] += 1e-9;
  line.control[3][0] += 1e-9;
  T_CHECK(find(ctx, &line, at, 8) == 0, "signs below the rounding of the control points do not count");
  curve_case point = {.degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}};
  T_CHECK(find(ctx, &point, at, 8) == 0, "a point has none");
}

static void test_corners(batten_context *ctx) {
  double at[8];
  curve_case zigzag = {.degree = 1,
                       .knot_count = 8,
                       .knots = {0, 0, 1, 2, 3, 4, 5, 5},
                       .control = {{0, 0}, {1, 1}, {2, 0}, {3, 1}, {4, 1}, {5, 3}}};
  /* Right, left, right, left at 1, 2, 3, 4. */
  size_t count = find(ctx, &zigzag, at, 8);
  T_CHECK(count == 3 && at[0] == 1.5 && at[1] == 2.5 && at[2] == 3.5,
          "a zigzag changes in the middle of its legs: %zu, at %g, %g, %g", count, at[0], at[1], at[2]);
  curve_case star = {.degree = 1,
                     .knot_count = 10,
                     .knots = {0, 0, 1, 2, 3, 4, 5, 6, 7, 7},
                     .closed = 1,
                     .control = {{2, 0}, {0.5, 0.5}, {0, 2}, {-0.5, 0.5}, {-2, 0}, {-0.5, -2}, {0.5, -2}, {2, 0}}};
  count = find(ctx, &star, at, 8);
  T_CHECK(count == 4 && at[0] == 0.5 && at[1] == 1.5 && at[2] == 2.5 && at[3] == 3.5,
          "two dents of a closed polygon: %zu, at %g, %g, %g, %g", count, at[0], at[1], at[2], at[3]);
  /* The same that starts at the foot of a dent. */
  curve_case turned = star;
  for (int i = 0; i < 7; i++) memcpy(turned.control[i], star.control[(i + 1) % 7], sizeof star.control[0]);
  memcpy(turned.control[7], turned.control[0], sizeof turned.control[0]);
  count = find(ctx, &turned, at, 8);
  T_CHECK(count == 4 && at[0] == 0.5 && at[1] == 1.5 && at[2] == 2.5 && at[3] == 6.5,
          "and across its start: %zu, at %g, %g, %g, %g", count, at[0], at[1], at[2], at[3]);
  /* A corner between two left bends, to the left and to the right: two changes at it. */
  curve_case corner = {.degree = 2,
                       .knot_count = 8,
                       .knots = {0, 0, 0, 1, 1, 2, 2, 2},
                       .control = {{0, 0}, {1, 0}, {2, 1}, {2, 2}, {1, 3}}};
  T_CHECK(find(ctx, &corner, at, 8) == 0, "a corner the same way");
  double right[2][2] = {{3, 1}, {4, 2}};
  memcpy(corner.control[3], right, sizeof right);
  count = find(ctx, &corner, at, 8);
  T_CHECK(count == 2 && at[0] == 1 && at[1] == 1, "a corner the other way: %zu, at %g, %g", count, at[0], at[1]);
}

/* [x', x''] at t. */
static double bend_at(const curve_case *c, double t) {
  batten_curve_form f = curve_case_form(c);
  double a[2], b[2];
  curve_case_value(&f, 1, t, a, NULL);
  curve_case_value(&f, 2, t, b, NULL);
  return a[0] * b[1] - a[1] * b[0];
}

/* Numbers of changes beside those between samples; at each the sign changes over a short step. */
static void test_random(batten_context *ctx) {
  enum { CASES = 400, SAMPLES = 300, MOST = 128 };
  uint64_t state = 11;
  size_t differ = 0, misplaced = 0, all = 0, turned = 0;
  for (int i = 0; i < CASES; i++) {
    unsigned degree = 2 + (unsigned)(t_random(&state) % 5), fold = degree > 2 ? degree - 2 : 1;
    curve_case c = curve_case_random(&state, degree, t_random(&state) % 4, fold, 0, 0, 1);
    double at[MOST], other[MOST];
    size_t count = find(ctx, &c, at, MOST), samples = 0;
    double before = bend_at(&c, 0);
    for (int k = 1; k <= SAMPLES; k++) {
      double now = bend_at(&c, (double)k / SAMPLES);
      samples += (now < 0) != (before < 0);
      before = now;
    }
    /* Samples miss pairs. */
    if (samples > count || (count - samples) % 2 || count > samples + 2) differ++;
    for (size_t k = 0; k < count; k++, all++) {
      double step = 1e-7;
      if (k > 0 && at[k] - at[k - 1] < 2 * step) continue;
      if (k + 1 < count && at[k + 1] - at[k] < 2 * step) continue;
      if ((bend_at(&c, at[k] - step) < 0) == (bend_at(&c, at[k] + step) < 0)) misplaced++;
    }
    /* Mirrored, in other units, and run through the other way. */
    curve_case d = c;
    size_t n = curve_case_count(&c);
    for (size_t k = 0; k < n; k++) {
      d.control[k][0] = ldexp(c.control[n - 1 - k][1], 200);
      d.control[k][1] = ldexp(c.control[n - 1 - k][0], 200);
    }
    for (size_t k = 0; k < c.knot_count; k++) d.knots[k] = 1 - c.knots[c.knot_count - 1 - k];
    bool same = find(ctx, &d, other, MOST) == count;
    for (size_t k = 0; same && k < count; k++) same = fabs(1 - other[count - 1 - k] - at[k]) < 1e-9;
    turned += !same;
  }
  T_CHECK(differ == 0, "%d random curves, %zu inflections: numbers differ from samples in %zu", CASES, all, differ);
  T_CHECK(misplaced == 0, "the sign changes at each: not at %zu", misplaced);
  T_CHECK(turned == 0, "the same ones mirrored, larger, reversed: not of %zu", turned);
}

/* A closed curve has an even number wherever it starts. */
static void test_closed(batten_context *ctx) {
  uint64_t state = 4;
  size_t odd = 0;
  for (int i = 0; i < 200; i++) {
    curve_case c = curve_case_random(&state, 2 + (unsigned)(i % 5), 3 + t_random(&state) % 5, 2, 1, -3, 7);
    double at[64];
    size_t count = find(ctx, &c, at, 64);
    if (count % 2) odd++;
    for (size_t k = 0; k < count; k++)
      if (!(at[k] >= -3 && at[k] < 7)) odd++;
  }
  T_CHECK(odd == 0, "closed curves have an even number, in the domain: %zu have not", odd);
}

static batten_status call(batten_context *ctx, void *arg) {
  const curve_case *c = arg;
  batten_curve_form form = curve_case_form(c);
  batten_curve *curve = NULL;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st < 0) return st;
  size_t count;
  double *found;
  st = batten_curve_inflections(ctx, curve, &count, &found);
  if (st >= 0) batten_free(ctx, found);
  batten_curve_free(curve);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_corners(ctx);
  test_random(ctx);
  test_closed(ctx);
  uint64_t state = 2;
  curve_case c = curve_case_random(&state, 1, 40, 1, 0, 0, 1);
  size_t count = 0;
  double *found = NULL;
  batten_curve *curve = curve_case_make(ctx, &c);
  T_STATUS(batten_curve_inflections(ctx, NULL, &count, &found), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_inflections(ctx, curve, NULL, &found), BATTEN_E_INVALID, ctx, "count: NULL");
  T_STATUS(batten_curve_inflections(ctx, curve, &count, NULL), BATTEN_E_INVALID, ctx, "parameters: NULL");
  T_CHECK(batten_curve_inflections(NULL, curve, &count, &found) == BATTEN_E_INVALID, "no context");
  batten_curve_free(curve);
  t_fail_every_allocation("batten_curve_inflections", call, &c);
  batten_context_free(ctx);
  return t_done();
}
