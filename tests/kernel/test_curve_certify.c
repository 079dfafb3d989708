/* batten_curve_certify: curves of known shape are certified, curves with a wrong sign are not, and margins are those
 * that dense sampling in long double finds. */
#include "curve_oracle.h"

static void test_convex(batten_context *ctx) {
  uint64_t state = 1;
  size_t refused = 0, wrong = 0, tried = 0, loose = 0;
  double worst_share = 1;
  for (unsigned degree = 2; degree <= 9; degree++)
    for (int i = 0; i < 250; i++, tried++) {
      unsigned fold = 1 + (unsigned)(t_random(&state) % (degree - 1));
      double least = i % 5 == 0 ? 1e-8 : i % 5 == 1 ? 1e-3 : 0.3;
      curve_case c = convex_case(&state, degree, t_random(&state) % 5, fold, i % 3 ? 1.5 : 3, least);
      c = transformed(&c, i % 2, i % 7 == 3, i % 11 == 4 ? 300 : i % 11 == 5 ? -300 : 0);
      int sign = (i % 2 != 0) != (i % 7 == 3) ? -1 : 1;
      batten_curve_shape shape = certify(ctx, &c, i % 3 ? sign : 0, 0, NULL);
      long double margin = oracle_margin(&c, sign, 0, NULL, 0, false);
      if (!shape.certified) refused++;
      if (shape.certified && (shape.sign != sign || shape.margin_min > margin * (1 + 1e-12L))) wrong++;
      if (shape.certified && shape.margin_min < 0.85L * margin) {
        loose++;
        worst_share = fmin(worst_share, (double)(shape.margin_min / margin));
      }
      if (certify(ctx, &c, -sign, 0, NULL).certified) wrong++;
    }
  T_CHECK(refused == 0 && wrong == 0, "%zu curves that bend one way: %zu refused, %zu wrong", tried, refused, wrong);
  T_CHECK(loose == 0, "their margins are within a tenth of the least: %zu are not, down to %.3g", loose, worst_share);
}

/* Random control points: whatever the inflections are, they are certified, and no others. */
static void test_random(batten_context *ctx) {
  uint64_t state = 5;
  size_t tried = 0, refused = 0, wrong = 0, changed = 0, believed = 0;
  double error = 0;
  for (int i = 0; i < 1500; i++) {
    unsigned degree = 3 + (unsigned)(t_random(&state) % 4), fold = 1 + (unsigned)(t_random(&state) % (degree - 2));
    curve_case c = curve_case_random(&state, degree, t_random(&state) % 5, fold, 0, -1, 2);
    double at[MOST + 2];
    size_t count;
    int sign;
    if (!oracle_inflections(&c, &count, at, &sign)) continue;
    tried++;
    batten_curve_shape shape = certify(ctx, &c, sign, count, at);
    if (!shape.certified) {
      refused++;
      continue;
    }
    error = fmax(error, shape.inflection_error);
    long double margin = oracle_margin(&c, sign, count, at, shape.inflection_error, false);
    if (shape.margin_min > margin * (1 + 1e-9L) || shape.sign != sign) wrong++;
    /* Asked for another shape. */
    if (certify(ctx, &c, -sign, count, at).certified) believed++;
    changed++;
    if (count > 0) {
      double other[MOST + 2];
      memcpy(other, at, sizeof other);
      if (certify(ctx, &c, sign, count - 1, at + 1).certified) believed++;
      size_t k = t_random(&state) % count;
      other[k] += t_random(&state) % 2 ? 1e-6 : -1e-6;
      if (certify(ctx, &c, sign, count, other).certified) believed++;
      if (count > 1 && certify(ctx, &c, sign, count - 2, at + 1).certified) believed++;
      changed += 2;
    }
    double extra[MOST + 2];
    memcpy(extra, at, sizeof extra);
    double end = c.knots[c.knot_count - 1], last = count ? at[count - 1] : -1;
    extra[count] = last + (end - last) / 3;
    extra[count + 1] = last + (end - last) / 2;
    if (certify(ctx, &c, sign, count + 1, extra).certified) believed++;
    if (certify(ctx, &c, sign, count + 2, extra).certified) believed++;
    changed += 2;
  }
  T_CHECK(wrong == 0, "%zu random curves with their inflections: %zu refused, %zu wrong margins", tried, refused,
          wrong);
  T_RATIO((double)refused, 0.01 * (double)tried, "refused");
  T_RATIO(error, 2e-9, "inflections lie so near");
  T_CHECK(believed == 0, "%zu other shapes: %zu certified", changed, believed);
}

/* How much of a displacement of one control point is certified, and what the oracle says a little beyond. */
static long double least_bend(const curve_case *c, int sign) {
  long double least = INFINITY;
  for (size_t mu = c->degree; mu < curve_case_count(c); mu = next_span(c, mu)) {
    long double from = c->knots[mu], h = c->knots[mu + 1] - from, best = from, span_least = INFINITY;
    for (int i = 0; i <= 256; i++) {
      long double t = from + h * i / 256, bend = sign * oracle_bend(c, mu, t, NULL);
      if (bend < span_least) {
        span_least = bend;
        best = t;
      }
    }
    /* Golden sections around the least sample. */
    long double a = fmaxl(best - h / 256, from), b = fminl(best + h / 256, from + h), g = 0.6180339887498948482L;
    for (int k = 0; k < 80; k++) {
      long double u = b - g * (b - a), v = a + g * (b - a);
      if (sign * oracle_bend(c, mu, u, NULL) < sign * oracle_bend(c, mu, v, NULL))
        b = v;
      else
        a = u;
    }
    least = fminl(least, fminl(span_least, sign * oracle_bend(c, mu, (a + b) / 2, NULL)));
  }
  return least;
}

static void test_sharpness(batten_context *ctx) {
  uint64_t state = 31;
  size_t wrong = 0, nuisance = 0, tried = 0, critical = 0;
  for (int i = 0; i < 120; i++) {
    unsigned degree = 2 + (unsigned)(i % 5);
    curve_case c = convex_case(&state, degree, t_random(&state) % 4, 1, 2, 0.3), moved = c;
    size_t j = t_random(&state) % curve_case_count(&c);
    double way[2] = {t_uniform(&state) - 0.5, t_uniform(&state) - 0.5}, low = 0, high = 100;
    for (int k = 0; k < 60; k++) {
      double middle = 0.5 * low + 0.5 * high;
      for (int x = 0; x < 2; x++) moved.control[j][x] = c.control[j][x] + middle * way[x];
      if (certify(ctx, &moved, 1, 0, NULL).certified)
        low = middle;
      else
        high = middle;
    }
    for (int x = 0; x < 2; x++) moved.control[j][x] = c.control[j][x] + low * way[x];
    bool holds = least_bend(&moved, 1) > 0, reached = low < 99;
    for (int x = 0; x < 2; x++) moved.control[j][x] = c.control[j][x] + low * (1 + 1e-11) * way[x];
    /* x' may vanish before a sign is wrong. */
    bool fails = !reached || !(least_bend(&moved, 1) > 0) || !certify(ctx, &moved, 1, 0, NULL).certified;
    for (int x = 0; x < 2; x++) moved.control[j][x] = c.control[j][x] + low * (1 + 1e-9) * way[x];
    bool bad = !(least_bend(&moved, 1) > 0);
    tried++;
    wrong += !holds || !fails;
    nuisance += !bad && reached;
    critical += reached;
  }
  T_CHECK(wrong == 0, "%zu curves, %zu just about to bend the other way: %zu certified wrongly", tried, critical,
          wrong);
  T_RATIO((double)nuisance, 0.1 * (double)tried, "refused although good 1e-9 further on");
}

static void test_edges(batten_context *ctx) {
  /* Parabolas that are almost straight: the sign is that of the last digits, or none. */
  size_t wrong = 0, least = 0;
  for (int k = -200; k <= 200; k++) {
    curve_case c = {.degree = 2,
                    .knot_count = 6,
                    .knots = {0, 0, 0, 1, 1, 1},
                    .control = {{0, 0.5}, {1, 0.75}, {2, 1 + k * 0x1p-52}}};
    batten_curve_shape shape = certify(ctx, &c, k < 0 ? -1 : 1, 0, NULL);
    wrong += shape.certified && k == 0;
    wrong += certify(ctx, &c, k < 0 ? 1 : -1, 0, NULL).certified != 0;
    if (shape.certified && (!least || (size_t)abs(k) < least)) least = (size_t)abs(k);
  }
  T_CHECK(wrong == 0 && least > 0 && least <= 64,
          "almost straight: %zu wrong, proven from %zu units in the last place", wrong, least);
  /* (s^2, s^3): its [x', x''] is 6 s^2, and x' vanishes with it. */
  curve_case cusp = {.degree = 3,
                     .knot_count = 8,
                     .knots = {-1, -1, -1, -1, 1, 1, 1, 1},
                     .control = {{1, -1}, {-1 / 3.0, 1}, {-1 / 3.0, -1}, {1, 1}}};
  double at = 0;
  bool any = false;
  for (int sign = -1; sign <= 1; sign++)
    any = any || certify(ctx, &cusp, sign, 0, NULL).certified || certify(ctx, &cusp, sign, 1, &at).certified;
  T_CHECK(!any, "a cusp is not certified in any way");
  /* (s, s^4): flat at 0, where it bends the same way on both sides. (s, s^5): an inflection of a higher order. */
  curve_case flat = {.degree = 4,
                     .knot_count = 10,
                     .knots = {-1, -1, -1, -1, -1, 1, 1, 1, 1, 1},
                     .control = {{-1, 1}, {-0.5, -1}, {0, 1}, {0.5, -1}, {1, 1}}};
  T_CHECK(!certify(ctx, &flat, 1, 0, NULL).certified && !certify(ctx, &flat, 1, 1, &at).certified, "a flat point");
  curve_case line = {.degree = 1, .knot_count = 5, .knots = {0, 0, 1, 2, 2}, .control = {{0, 0}, {1, 0}, {1, 1}}};
  batten_curve_shape shape = certify(ctx, &line, 1, 0, NULL);
  T_CHECK(!shape.certified && shape.margin_min == 0, "degree 1 does not bend");
  curve_case point = {.degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}};
  shape = certify(ctx, &point, 0, 0, NULL);
  T_CHECK(!shape.certified && shape.margin_min == 0, "a point neither");
  /* Half a circle, nearly: by hand, the curvature of [x', x''] = 36, |x'| = 3 at its ends. */
  double k = 4 * (sqrt(2) - 1) / 3;
  curve_case quarter = {
      .degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 2, 2, 2, 2}, .control = {{1, 0}, {1, k}, {k, 1}, {0, 1}}};
  shape = certify(ctx, &quarter, 0, 0, NULL);
  long double margin = oracle_margin(&quarter, 1, 0, NULL, 0, false);
  T_CHECK(shape.certified && shape.sign == 1 && shape.margin_min <= margin && shape.margin_min >= 0.9L * margin,
          "a quarter of a circle: margin %.6g of %.6Lg", shape.margin_min, margin);
}

/* Units of points and of parameters are powers of two: the same digits. */
static void test_units(batten_context *ctx) {
  uint64_t state = 2;
  curve_case c = convex_case(&state, 4, 3, 1, 2, 0.3);
  batten_curve_shape shape = certify(ctx, &c, 1, 0, NULL);
  for (int e = -900; e <= 900; e += 300) {
    curve_case d = transformed(&c, false, false, e);
    for (size_t k = 0; k < d.knot_count; k++) d.knots[k] = ldexp(d.knots[k], -e);
    batten_curve_shape other = certify(ctx, &d, 1, 0, NULL);
    T_CHECK(other.certified && other.margin_min == ldexp(shape.margin_min, -e) && other.pieces == shape.pieces,
            "the same in units of 2^%d: margin %g", e, other.margin_min);
  }
}

static batten_status call(batten_context *ctx, void *arg) {
  batten_curve_form form = curve_case_form(arg);
  batten_curve *curve = NULL;
  batten_curve_shape shape;
  batten_status st = batten_curve_create(ctx, &form, &curve);
  if (st < 0) return st;
  st = batten_curve_certify(ctx, curve, NULL, &shape);
  batten_curve_free(curve);
  return st;
}

static void test_bad(batten_context *ctx) {
  uint64_t state = 9;
  curve_case c = convex_case(&state, 3, 3, 1, 2, 0.3);
  batten_curve *curve = curve_case_make(ctx, &c);
  batten_curve_shape shape = {.sign = 7};
  batten_curve_shape_options o = batten_curve_shape_options_default(), bad = o;
  double at[3] = {0.5, 0.25, 0};
  T_CHECK(batten_curve_certify(NULL, curve, &o, &shape) == BATTEN_E_INVALID, "no context");
  T_STATUS(batten_curve_certify(ctx, NULL, &o, &shape), BATTEN_E_INVALID, ctx, "curve: NULL");
  T_STATUS(batten_curve_certify(ctx, curve, &o, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  bad.struct_size = 0;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "struct_size");
  bad = o;
  bad.sign = 2;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.sign: 2");
  bad = o;
  bad.slack = 0;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.slack: 0");
  bad.slack = NAN;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.slack: nan");
  bad = o;
  bad.depth_max = 51;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.depth_max: 51");
  bad = o;
  bad.inflection_count = 2;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.inflections: NULL");
  bad.inflections = at;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.inflections[1]: 0.25");
  at[0] = 0;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.inflections[0]: 0");
  at[0] = NAN;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "opt.inflections[0]: nan");
  T_CHECK(shape.sign == 7, "the result is untouched");
  bad = o;
  bad.depth_max = 0;
  T_OK(batten_curve_certify(ctx, curve, &bad, &shape), ctx);
  T_CHECK(shape.depth == 0, "no bisections: certified %d, margin %g", shape.certified, shape.margin_min);
  batten_curve_free(curve);
  curve_case closed = {
      .degree = 2, .knot_count = 6, .knots = {0, 0, 0, 1, 1, 1}, .closed = 1, .control = {{0, 0}, {1, 1}, {0, 0}}};
  curve = curve_case_make(ctx, &closed);
  at[0] = 0;
  bad = o;
  bad.inflection_count = 1;
  bad.inflections = at;
  T_STATUS(batten_curve_certify(ctx, curve, &bad, &shape), BATTEN_E_INVALID, ctx, "of a closed curve it is even");
  batten_curve_free(curve);
  t_fail_every_allocation("batten_curve_certify", call, &c);
}

/* An inflection that is wanted where the curve has none is never certified, at its ends neither, however large the
 * slack; and without a given sign the start has the one before the first inflection, wherever that is. */
static void test_ends(batten_context *ctx) {
  curve_case arc = {
      .degree = 3, .knot_count = 8, .knots = {0, 0, 0, 0, 1, 1, 1, 1}, .control = {{0, 0}, {1, 0}, {2, 1}, {2, 2}}};
  static const double slacks[] = {1e-9, 1e-3, 0.3, 2}, places[] = {1e-10, 1e-3, 0.2, 0.8, 0.999, 1 - 1e-10};
  size_t believed = 0, refused = 0;
  batten_curve *curve = curve_case_make(ctx, &arc);
  for (int i = 0; i < 24; i++)
    for (int sign = -1; sign <= 1; sign++) {
      batten_curve_shape_options o = batten_curve_shape_options_default();
      batten_curve_shape shape = {.certified = -1};
      o.sign = sign;
      o.slack = slacks[i / 6];
      o.inflection_count = 1;
      o.inflections = &places[i % 6];
      if (batten_curve_certify(ctx, curve, &o, &shape) < 0 || shape.certified) believed++;
    }
  batten_curve_free(curve);
  T_CHECK(believed == 0, "inflections that an arc does not have: %zu of 72 believed", believed);
  /* [x', x''] is a positive multiple of at - t. */
  for (int k = 1; k < 32; k++) {
    double at = k / 32.0;
    curve_case c = arc;
    for (int j = 0; j <= 3; j++) {
      c.control[j][0] = j / 3.0; /* x = t */
      c.control[j][1] = j == 2 ? at : j == 3 ? 3 * at - 1 : 0;
    }
    batten_curve_shape shape = certify(ctx, &c, 0, 1, &at);
    if (!shape.certified || shape.sign != 1) refused++;
  }
  T_CHECK(refused == 0, "graphs t^2 (3 at - t) without a sign: %zu refused", refused);
}

/* The graph x = t, y'' = sum_i c_i s^i with s = t + from, t in [0, to - from], of degree 5: [x', x''] is y''. */
static curve_case graph_case(const double c[4], double from, double to) {
  curve_case out = {.degree = 5, .knot_count = 12};
  double h = to - from, moved[4] = {0}, power[6] = {0};
  for (int i = 0; i <= 3; i++) /* by parts of the span */
    for (int k = 0, choose = 1; k <= i; choose = choose * (i - k) / (k + 1), k++)
      moved[k] += c[i] * choose * pow(from, i - k) * pow(h, k);
  for (int k = 0; k <= 3; k++) power[k + 2] = moved[k] * h * h / ((k + 1) * (k + 2));
  for (int j = 0; j <= 5; j++) {
    out.knots[6 + j] = h;
    out.control[j][0] = h * j / 5;
    double share = 1;
    for (int k = 0; k <= j; share = share * (j - k) / (5 - k), k++) out.control[j][1] += share * power[k];
  }
  return out;
}

/* Where slack lets the zero be elsewhere, it still must be the only one, and near. */
static void test_slack(batten_context *ctx) {
  static const struct {
    double c[4];
    int certified;
    const char *what;
  } cases[] = {{{-0.1, 1, 0, 0}, 1, "one inflection, a tenth away"},
               {{-0.3, 1, 0, 0}, 0, "one inflection, too far away"},
               /* -0.02 + s ((s - 0.6)^2 + 0.01) is negative again near 0.6. */
               {{-0.02, 0.37, -1.2, 1}, 0, "a dip behind the inflection"},
               /* (s - 0.1) (s - 0.11) (s - 0.12) */
               {{-0.00132, 0.0362, -0.33, 1}, 0, "three inflections in the place of one"}};
  for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
    curve_case c = graph_case(cases[i].c, -0.5, 1);
    batten_curve *curve = curve_case_make(ctx, &c);
    batten_curve_shape_options o = batten_curve_shape_options_default();
    batten_curve_shape shape = {.certified = -1};
    double at = 0.5;
    o.slack = 2;
    o.inflection_count = 1;
    o.inflections = &at;
    T_OK(batten_curve_certify(ctx, curve, &o, &shape), ctx);
    T_CHECK(shape.certified == cases[i].certified, "%s: certified %d", cases[i].what, shape.certified);
    if (shape.certified)
      T_CHECK(shape.inflection_error >= 0.1 && shape.inflection_error < 0.25, "it is within %.4g",
              shape.inflection_error);
    batten_curve_free(curve);
  }
}

/* An inflection at its end of a closed curve, where it has a corner to the other side: of degree 2, which bends to
 * where its polygon turns. */
static void test_closed_corner(batten_context *ctx) {
  curve_case c = {.degree = 2,
                  .knot_count = 11,
                  .knots = {0, 0, 0, 0.25, 0.5, 0.6, 0.7, 0.8, 1, 1, 1},
                  .control = {{0, 0}, {2, 0}, {3, 2}, {3, 4}, {5, 5}, {7, 2}, {4, 0.5}, {0, 0}},
                  .closed = 1};
  double at[2] = {0, 0.5}, late[2] = {0.5, 1 - 0x1p-33};
  for (int k = 0; k < 2; k++) {
    c.control[6][1] = k ? 0.5 : -0.5; /* the corner turns to the left, and to the right */
    batten_curve_shape shape = certify(ctx, &c, 0, 2, at);
    T_CHECK(shape.certified && shape.sign == 1, "a closed curve with an inflection at its corner");
    shape = certify(ctx, &c, 0, 2, late);
    T_CHECK(shape.certified && shape.inflection_error >= 0x1p-33 && shape.inflection_error < 0x1.1p-33,
            "wanted a little before it: %.3g", shape.inflection_error);
  }
}

/* Two inflections that are wanted where there is one, at a knot; and a curvature that ends with the wrong sign at a
 * knot where it jumps, beyond rounding and below. */
static void test_at_knots(batten_context *ctx) {
  curve_case c = {.degree = 3, .knot_count = 9, .knots = {0, 0, 0, 0, 0.5, 1, 1, 1, 1}};
  static const double waves[] = {0, 0, 0.5, 1, 1}; /* y'' = 12 (1 - 2 t) */
  for (int j = 0; j < 5; j++) {
    c.control[j][0] = (c.knots[j + 1] + c.knots[j + 2] + c.knots[j + 3]) / 3;
    c.control[j][1] = waves[j];
  }
  double at[2] = {0.5, 0.5 + 1e-11};
  T_CHECK(certify(ctx, &c, 1, 1, at).certified, "a wave");
  T_CHECK(!certify(ctx, &c, 1, 2, at).certified, "with its inflection twice");
  static const double wrong[] = {0, 1e-15, 1e-12, 1e-9};
  for (int i = 0; i < 4; i++) {
    /* x = t, y'' from 1 to -e on [0, 1], then -1 to 2. */
    double e = wrong[i], slope = (1 - e) / 2, value = 0.5 - (1 + e) / 6;
    curve_case jump = {.degree = 3,
                       .knot_count = 10,
                       .knots = {0, 0, 0, 0, 1, 1, 2, 2, 2, 2},
                       .control = {{0, 0},
                                   {1 / 3.0, 0},
                                   {2 / 3.0, value - slope / 3},
                                   {4 / 3.0, value + slope / 3},
                                   {5 / 3.0, value + 2 * slope / 3 - 1 / 6.0},
                                   {2, value + slope - 0.5}}};
    double knot = 1;
    batten_curve_shape shape = certify(ctx, &jump, 1, 1, &knot);
    T_CHECK(shape.certified == (e < 1e-14), "the wrong sign by %g: certified %d", e, shape.certified);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_convex(ctx);
  test_random(ctx);
  test_sharpness(ctx);
  test_edges(ctx);
  test_ends(ctx);
  test_slack(ctx);
  test_closed_corner(ctx);
  test_at_knots(ctx);
  test_units(ctx);
  test_bad(ctx);
  batten_context_free(ctx);
  return t_done();
}
