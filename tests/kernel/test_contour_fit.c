/* Planar curves of wanted shape, whole: random data all proven, sums that never rise, a case by hand, and
 * invariances. What is proven is proven by batten_curve_certify; here signs are looked at once more, at samples. */
#include <batten/contour.h>

#include <float.h>

#include "contour_scenes.h"
#include "tap.h"

typedef struct result {
  batten_status status;
  batten_curve *curve;
  batten_contour_info info;
} result;

static result fit(batten_context *ctx, size_t count, const double *points, const batten_contour_options *o) {
  result r = {.curve = NULL};
  r.status = batten_contour_fit(ctx, count, points, o, &r.curve, NULL, NULL, &r.info);
  return r;
}

/* Degrees 2 .. 6, smoothness 1 or 2, by the seed. */
static batten_contour_options options_of(const contour_scene *s, uint64_t seed) {
  batten_contour_options o = batten_contour_options_default();
  o.smoothness = 1 + (unsigned)(t_random(&seed) % 2);
  o.degree = o.smoothness + 1 + (unsigned)(t_random(&seed) % (6 - o.smoothness));
  o.closed = s->closed;
  return o;
}

/* Samples of the curve whose curvature has the wrong sign; those next to inflections may vanish to rounding. */
static size_t wrong_samples(batten_context *ctx, const batten_curve *curve, const batten_contour_options *o,
                            int sign) {
  enum { SAMPLES = 400 };
  double t[SAMPLES];
  batten_curve_point at[SAMPLES];
  size_t wrong = 0;
  for (size_t i = 0; i < SAMPLES; i++) t[i] = ((double)i + 0.5) / SAMPLES;
  if (batten_curve_evaluate(ctx, curve, SAMPLES, t, at) != BATTEN_OK) return SAMPLES;
  for (size_t i = 0; i < SAMPLES; i++) {
    int wanted = sign;
    for (size_t k = 0; k < o->inflection_count; k++)
      if (o->inflections[k] > 0 && o->inflections[k] < t[i]) wanted = -wanted;
    double size = hypot(at[i].first[0], at[i].first[1]) * hypot(at[i].second[0], at[i].second[1]);
    double cross = at[i].first[0] * at[i].second[1] - at[i].first[1] * at[i].second[0];
    if (cross * wanted < -1e-12 * size) wrong++;
  }
  return wrong;
}

typedef struct tally {
  size_t cases, proven, counted, rises, wrong, fallbacks, contradict;
  double ratio;
} tally;

static void take(tally *t, const char *what, uint64_t seed, batten_context *ctx, const result *r) {
  const batten_contour_info *i = &r->info;
  t->cases++;
  if (r->status < 0 || !i->shape.certified || r->status == BATTEN_W_ACCURACY) {
    printf("# %s, seed %d: %s %s\n", what, (int)seed, batten_status_name(r->status), batten_error(ctx));
    return;
  }
  t->proven++;
  t->counted += i->inflections_found == i->inflections_wanted;
  t->fallbacks += i->fallback != 0;
  t->contradict += r->status == BATTEN_W_SHAPE;
  for (unsigned k = 1; k < i->rounds; k++) t->rises += i->lsq_per_round[k] > i->lsq_per_round[k - 1];
  t->rises += i->lsq > i->lsq_per_round[i->rounds - 1] || i->lsq_per_round[0] > i->lsq_reference;
  t->ratio += log(i->lsq / i->lsq_unconstrained);
}

static void test_random(batten_context *ctx) {
  for (int automatic = 0; automatic < 2; automatic++) {
    tally t = {0};
    for (uint64_t seed = 0; seed < (automatic ? 100 : 200); seed++) {
      contour_rule rule = contour_rule_random(1000 + seed);
      contour_scene s = contour_scene_make(&rule);
      batten_contour_options o = options_of(&s, seed);
      if (!automatic) {
        o.inflection_count = s.inflection_count;
        o.inflections = s.inflections;
        o.sign = s.sign;
      }
      if (automatic && s.count > 400) s.count = 400;
      result r = fit(ctx, s.count, s.points, &o);
      take(&t, automatic ? "inflections found" : "inflections given", seed, ctx, &r);
      if (!automatic && r.status >= 0) t.wrong += wrong_samples(ctx, r.curve, &o, s.sign);
      batten_curve_free(r.curve);
      contour_scene_free(&s);
    }
    const char *what = automatic ? "inflections found" : "inflections given";
    T_CHECK(t.proven == t.cases, "%s: %zu of %zu random fits proven", what, t.proven, t.cases);
    T_CHECK(t.counted == t.cases, "%s: counted as wanted in %zu", what, t.counted);
    T_CHECK(t.rises == 0, "%s: sums never rise (%zu do)", what, t.rises);
    T_CHECK(t.wrong == 0, "%s: %zu samples of the wrong sign", what, t.wrong);
    T_CHECK(t.contradict <= t.cases / 20, "%s: the data are called of another shape in %zu", what, t.contradict);
    printf("# %s: construction 1 as the fallback in %zu, geometric mean of sum / unconstrained sum %.3f\n", what,
           t.fallbacks, exp(t.ratio / (double)t.cases));
  }
}

/* Points of a parabola are a curve of degree 2 and one piece, without any error. */
static void test_by_hand(batten_context *ctx) {
  double points[2 * 21], parameters[21], got[21];
  for (int i = 0; i <= 20; i++) {
    parameters[i] = 2 + i / 5.0;
    points[2 * i] = parameters[i];
    points[2 * i + 1] = parameters[i] * parameters[i];
  }
  batten_contour_options o = batten_contour_options_default();
  o.degree = 2;
  o.smoothness = 1;
  o.parameters = parameters;
  o.spans = 1;
  o.tension = 0;
  o.inflection_count = 0;
  batten_curve *curve = NULL, *other = NULL;
  batten_contour_info info;
  T_OK(batten_contour_fit(ctx, 21, points, &o, &curve, got, &other, &info), ctx);
  batten_curve_form form = batten_curve_get(curve);
  const double wanted[6] = {2, 4, 4, 12, 6, 36}; /* x = t, y = t^2 on [2, 6]: blossoms (t, s t) */
  double worst = 0, moved = 0;
  for (int i = 0; i < 6; i++) worst = fmax(worst, fabs(form.control_points[i] - wanted[i]));
  for (int i = 0; i <= 20; i++) moved = fmax(moved, fabs(got[i] - parameters[i]));
  T_CHECK(form.knot_count == 6 && form.knots[0] == 2 && form.knots[5] == 6, "one piece on [2, 6]");
  T_RATIO(worst, 1e-12, "control points of the parabola");
  T_RATIO(moved, 1e-12, "its points stay where they are");
  T_RATIO(info.lsq, 1e-24, "its sum");
  T_CHECK(info.inflections_found == 0 && info.spans == 1 && info.unknowns == 6 && info.equalities == 0,
          "figures: %zu spans, %zu unknowns", info.spans, info.unknowns);
  T_RATIO(fabs(info.shape.margin_min * 2 * pow(145, 1.5) / 4 - 1), 0.2, "least curvature, at 6: 2 / 145^(3/2)");
  batten_curve_free(other);
  batten_curve_free(curve);
}

static double control_distance(const batten_curve *a, const batten_curve *b, double c, double s, double dx, double dy,
                               double size) {
  batten_curve_form f = batten_curve_get(a), g = batten_curve_get(b);
  double worst = f.knot_count == g.knot_count ? 0 : INFINITY;
  for (size_t i = 0; worst < INFINITY && i < f.knot_count - f.degree - 1; i++) {
    const double *p = f.control_points + 2 * i, *q = g.control_points + 2 * i;
    worst = fmax(worst, hypot(size * (c * p[0] - s * p[1]) + dx - q[0], size * (s * p[0] + c * p[1]) + dy - q[1]));
  }
  return worst / size;
}

static contour_scene scene_of(size_t k) {
  const contour_rule rules[] = {
      {.kind = CONTOUR_WAVE, .count = 150, .inflections = 3, .noise = 0.01, .seed = 4},
      {.kind = CONTOUR_LOOP, .count = 200, .inflections = 4, .noise = 0.005, .seed = 9},
      {.kind = CONTOUR_FRAME, .count = 60, .inflections = 1, .noise = 0.002, .seed = 2},
  };
  return contour_scene_make(&rules[k]);
}

/* Similar data have similar curves; by powers of two to the bit. */
static void test_similar(batten_context *ctx) {
  for (size_t k = 0; k < 3; k++) {
    contour_scene s = scene_of(k);
    batten_contour_options o = batten_contour_options_default();
    o.closed = s.closed;
    o.spans = 12; /* what is placed by data may flip with rounding */
    o.inflection_count = s.inflection_count;
    o.inflections = s.inflections;
    result a = fit(ctx, s.count, s.points, &o);
    double *moved = malloc(2 * s.count * sizeof *moved);
    for (size_t i = 0; i < 2 * s.count; i++) moved[i] = 0x1p-40 * s.points[i];
    result b = fit(ctx, s.count, moved, &o);
    T_CHECK(a.status == b.status && a.status >= 0 && control_distance(a.curve, b.curve, 1, 0, 0, 0, 0x1p-40) == 0 &&
                b.info.lsq == ldexp(a.info.lsq, -80),
            "scene %zu, scaled by a power of two: the same bits", k);
    batten_curve_free(b.curve);
    for (size_t i = 0; i < s.count; i++) {
      moved[2 * i] = 3 * (0.6 * s.points[2 * i] - 0.8 * s.points[2 * i + 1]) + 7;
      moved[2 * i + 1] = 3 * (0.8 * s.points[2 * i] + 0.6 * s.points[2 * i + 1]) - 2;
    }
    b = fit(ctx, s.count, moved, &o);
    T_CHECK(b.status >= 0 && b.info.shape.certified, "scene %zu turned: %s", k, batten_status_name(b.status));
    T_RATIO(fabs(b.info.lsq / a.info.lsq / 9 - 1), 1e-4, "scene %zu turned, moved and scaled: sums", k);
    batten_curve_free(b.curve);
    batten_curve_free(a.curve);
    free(moved);
    contour_scene_free(&s);
  }
}

static void test_reversed(batten_context *ctx) {
  for (size_t k = 0; k < 3; k++) {
    contour_scene s = scene_of(k);
    double *turned = malloc(2 * s.count * sizeof *turned), inflections[CONTOUR_INFLECTIONS_MAX];
    for (size_t i = 0; i < s.count; i++)
      for (size_t c = 0; c < 2; c++)
        turned[2 * i + c] = s.points[2 * ((s.closed ? 2 * s.count : s.count - 1) - i) % (2 * s.count) + c];
    for (size_t i = 0; i < s.inflection_count; i++) inflections[i] = 1 - s.inflections[s.inflection_count - 1 - i];
    batten_contour_options o = batten_contour_options_default();
    o.closed = s.closed;
    o.spans = 12;
    o.inflection_count = s.inflection_count;
    o.inflections = s.inflections;
    o.sign = s.sign;
    result a = fit(ctx, s.count, s.points, &o);
    o.inflections = inflections;
    o.sign = s.inflection_count % 2 ? s.sign : -s.sign;
    result b = fit(ctx, s.count, turned, &o);
    T_CHECK(a.status >= 0 && b.status >= 0 && a.info.shape.certified && b.info.shape.certified,
            "scene %zu: both ways proven", k);
    T_RATIO(fabs(b.info.lsq / a.info.lsq - 1), 1e-4, "scene %zu reversed: sums", k);
    T_RATIO(fabs(b.info.lsq_unconstrained / a.info.lsq_unconstrained - 1), 1e-4,
            "scene %zu reversed: sums without inequalities", k);
    batten_curve_free(b.curve);
    batten_curve_free(a.curve);
    free(turned);
    contour_scene_free(&s);
  }
}

/* Parameters and inflections of another domain: the same curve, and its inflections are zeros of x'' to rounding. */
static void test_domain(batten_context *ctx) {
  contour_scene s = scene_of(0);
  double *t = malloc(s.count * sizeof *t), inflections[2][CONTOUR_INFLECTIONS_MAX];
  const double domains[3][2] = {{0, 1}, {-3, 4}, {1000, 1000.7}};
  result base = {.status = BATTEN_OK};
  for (int d = 0; d < 3; d++) {
    double begin = domains[d][0], width = domains[d][1] - begin;
    for (size_t i = 0; i < s.count; i++) t[i] = begin + s.lengths[i] * width;
    t[s.count - 1] = domains[d][1];
    for (size_t i = 0; i < s.inflection_count; i++) inflections[1][i] = begin + s.inflections[i] * width;
    batten_contour_options o = batten_contour_options_default();
    o.parameters = t;
    o.spans = 14;
    o.inflection_count = s.inflection_count;
    o.inflections = inflections[1];
    result r = fit(ctx, s.count, s.points, &o);
    T_CHECK(r.status == BATTEN_OK, "domain %g to %g: %s", begin, domains[d][1], batten_status_name(r.status));
    if (r.status < 0) continue;
    batten_curve_point at[CONTOUR_INFLECTIONS_MAX];
    double worst = 0;
    if (batten_curve_evaluate(ctx, r.curve, s.inflection_count, inflections[1], at) == BATTEN_OK)
      for (size_t i = 0; i < s.inflection_count; i++)
        worst = fmax(worst, hypot(at[i].second[0], at[i].second[1]) * width * width);
    T_RATIO(worst, 1e-9, "its x'' at inflections, domain brought to [0, 1]");
    batten_curve_form f = batten_curve_get(r.curve);
    size_t there = 0;
    for (size_t i = 0; i < s.inflection_count; i++)
      for (size_t k = 0; k < f.knot_count; k++) there += f.knots[k] == inflections[1][i];
    T_CHECK(there == s.inflection_count, "its inflections are knots to the bit");
    if (d == 0) {
      base = r;
      continue;
    }
    T_RATIO(fabs(r.info.lsq / base.info.lsq - 1), 1e-3, "its sum");
    batten_curve_free(r.curve);
  }
  batten_curve_free(base.curve);
  free(t);
  contour_scene_free(&s);
}

static void test_threads(void) {
  for (size_t k = 0; k < 2; k++) {
    contour_rule rule = {.kind = k ? CONTOUR_LOOP : CONTOUR_WAVE, .count = 3000, .inflections = 2, .noise = 0.01};
    contour_scene s = contour_scene_make(&rule);
    batten_contour_options o = batten_contour_options_default();
    o.closed = s.closed;
    result r[2];
    batten_context *contexts[2];
    for (unsigned i = 0; i < 2; i++) {
      contexts[i] = t_context(NULL, NULL, i ? 5 : 1);
      r[i] = fit(contexts[i], s.count, s.points, &o);
    }
    T_CHECK(r[0].status >= 0 && r[0].status == r[1].status && r[0].info.lsq == r[1].info.lsq &&
                control_distance(r[0].curve, r[1].curve, 1, 0, 0, 0, 1) == 0,
            "3000 points, %s: the same bits by 1 and 5 threads", s.closed ? "closed" : "open");
    for (unsigned i = 0; i < 2; i++) {
      batten_curve_free(r[i].curve);
      batten_context_free(contexts[i]);
    }
    contour_scene_free(&s);
  }
}

/* Ends are met, also with tangents. */
static void test_ends(batten_context *ctx) {
  contour_scene s = scene_of(0);
  batten_contour_options o = batten_contour_options_default();
  o.inflection_count = s.inflection_count;
  o.inflections = s.inflections;
  o.fix_ends[0] = o.fix_ends[1] = 1;
  result r = fit(ctx, s.count, s.points, &o);
  T_CHECK(r.status >= 0 && r.info.shape.certified, "fixed ends: %s", batten_status_name(r.status));
  if (r.status >= 0) {
    batten_curve_form f = batten_curve_get(r.curve);
    const double *last = f.control_points + 2 * (f.knot_count - f.degree - 2), *p = s.points + 2 * s.count - 2;
    T_RATIO(hypot(f.control_points[0] - s.points[0], f.control_points[1] - s.points[1]) +
                hypot(last[0] - p[0], last[1] - p[1]),
            4 * DBL_EPSILON, "the first and last points are met");
    /* the directions that came out are asked for, a little turned */
    double turn = 0.05, d[2][2];
    for (int e = 0; e < 2; e++) {
      const double *a = e ? last - 2 : f.control_points, *b = a + 2;
      d[e][0] = cos(turn) * (b[0] - a[0]) - sin(turn) * (b[1] - a[1]);
      d[e][1] = sin(turn) * (b[0] - a[0]) + cos(turn) * (b[1] - a[1]);
    }
    memcpy(o.end_tangents, d, sizeof d);
    result q = fit(ctx, s.count, s.points, &o);
    T_CHECK(q.status >= 0 && q.info.shape.certified, "fixed tangents: %s %s", batten_status_name(q.status),
            q.status ? batten_error(ctx) : "");
    if (q.status >= 0) {
      batten_curve_form g = batten_curve_get(q.curve);
      for (int e = 0; e < 2; e++) {
        const double *a = e ? g.control_points + 2 * (g.knot_count - g.degree - 3) : g.control_points, *b = a + 2;
        double angle = atan2((b[1] - a[1]) * d[e][0] - (b[0] - a[0]) * d[e][1],
                             (b[0] - a[0]) * d[e][0] + (b[1] - a[1]) * d[e][1]);
        T_RATIO(fabs(angle), 1e-12, "direction at end %d", e);
      }
      T_CHECK(q.info.equalities == r.info.equalities + 2, "%zu equalities", q.info.equalities);
    }
    batten_curve_free(q.curve);
  }
  batten_curve_free(r.curve);
  contour_scene_free(&s);
}

/* Tangents are directions, not lines: wherever they point, curves leave their ends along them. */
static void test_tangents(batten_context *ctx) {
  enum { COUNT = 60 };
  double points[2 * COUNT], inflection = 0.5;
  size_t fitted = 0, against = 0;
  for (size_t i = 0; i < COUNT; i++) {
    double t = (double)i / (COUNT - 1);
    points[2 * i] = 4 * t;
    points[2 * i + 1] = sin(6 * t);
  }
  batten_contour_options o = batten_contour_options_default();
  o.inflections = &inflection;
  o.inflection_count = 1;
  o.sign = -1;
  for (int k = 0; k < 14; k++) {
    int end = k % 2;
    double angle = atan2(end ? 6 * cos(6.0) : 6, 4) + k / 2, size = k % 4 < 2 ? 1.7e308 : 1e-300;
    for (int e = 0; e < 2; e++) o.end_tangents[e][0] = o.end_tangents[e][1] = NAN;
    o.end_tangents[end][0] = size * cos(angle);
    o.end_tangents[end][1] = size * sin(angle);
    o.degree = k % 3 ? 3 : 5;
    result r = fit(ctx, COUNT, points, &o);
    if (r.status < 0) {
      printf("# turned by %d: %s %s\n", k / 2, batten_status_name(r.status), batten_error(ctx));
      continue;
    }
    fitted += r.info.shape.certified != 0;
    batten_curve_form f = batten_curve_get(r.curve);
    const double *a = f.control_points + (end ? 2 * (f.knot_count - f.degree - 3) : 0);
    against += fabs(atan2(cos(angle) * (a[3] - a[1]) - sin(angle) * (a[2] - a[0]),
                          cos(angle) * (a[2] - a[0]) + sin(angle) * (a[3] - a[1]))) > 1e-9;
    batten_curve_free(r.curve);
  }
  T_CHECK(fitted == 14 && against == 0, "14 tangents: %zu proven, %zu run another way", fitted, against);
}

/* Where rounding far from the origin spoils the best curve, one that keeps more of its reference is found. */
static void test_far(batten_context *ctx) {
  enum { COUNT = 200 };
  double points[2 * COUNT];
  size_t proven = 0, moved = 0;
  for (unsigned k = 0; k < 8; k++) {
    uint64_t seed = 7 + k;
    for (size_t i = 0; i < COUNT; i++) {
      double t = (double)i / (COUNT - 1);
      points[2 * i] = 1e9 + 4 * t + 2e-3 * (t_uniform(&seed) - 0.5);
      points[2 * i + 1] = sin((k % 2 ? 6 : 3) * t) - 1e9 + 2e-3 * (t_uniform(&seed) - 0.5);
    }
    batten_contour_options o = batten_contour_options_default();
    o.degree = k & 2 ? 5 : 3;
    o.inflection_count = 0;
    o.spans = k & 4 ? 60 : 20;
    result r = fit(ctx, COUNT, points, &o);
    proven += r.status >= 0 && r.status != BATTEN_W_ACCURACY && r.info.shape.certified;
    moved += r.status >= 0 && r.info.lsq > r.info.lsq_per_round[r.info.rounds - 1];
    if (r.status == BATTEN_W_ACCURACY) printf("# far, %u: %s\n", k, batten_error(ctx));
    batten_curve_free(r.curve);
  }
  T_CHECK(proven == 8 && moved > 0, "1e9 away: %zu of 8 proven, %zu of them moved", proven, moved);
}

/* Points of weight 0 are as if they were not there, wherever they are. */
static void test_masked(batten_context *ctx) {
  enum { COUNT = 150, MASKED = 5 };
  const double places[MASKED] = {1e4, -1e12, 1e299, 0, 1};
  double points[2 * COUNT], more[2 * (COUNT + MASKED)], weights[COUNT + MASKED], parameters[COUNT + MASKED];
  for (size_t i = 0; i < COUNT; i++) {
    double t = (double)i / (COUNT - 1);
    points[2 * i] = 4 * t + 1e-3 * sin(97.0 * (double)i);
    points[2 * i + 1] = sin(6 * t) + 1e-3 * sin(57.0 * (double)i);
  }
  for (size_t i = 0, at = 0; i < COUNT; i++) {
    for (size_t k = 0; k < MASKED && i % 37 == 0 && at < i + i / 37 + 1; k++) { /* one, the first before all */
      weights[at] = 0;
      more[2 * at] = places[i / 37];
      more[2 * at + 1] = -places[i / 37];
      at++;
    }
    weights[at] = 1;
    memcpy(more + 2 * at, points + 2 * i, 2 * sizeof *more);
    at++;
  }
  batten_contour_options o = batten_contour_options_default();
  const double inflection = 0.52;
  o.spans = 9;
  o.inflections = &inflection;
  o.inflection_count = 1;
  o.sign = -1;
  result a = fit(ctx, COUNT, points, &o), b = {.curve = NULL};
  o.weights = weights;
  b.status = batten_contour_fit(ctx, COUNT + MASKED, more, &o, &b.curve, parameters, NULL, &b.info);
  T_CHECK(a.status == BATTEN_OK && b.status == BATTEN_OK, "points of weight 0: %s, %s", batten_status_name(b.status),
          b.status ? batten_error(ctx) : "");
  T_RATIO(fabs(b.info.lsq / a.info.lsq - 1), 1e-9, "the sum is as without them");
  T_RATIO(fabs(b.info.misfit / a.info.misfit - 1), 0.05, "and so is the misfit");
  T_CHECK(parameters[1] == 0 && parameters[COUNT + MASKED - 1] == 1, "ends are held by points that count");
  batten_curve_free(b.curve);
  batten_curve_free(a.curve);
}

/* Tension holds places without data, and takes nothing from the data that there are: however many spans. */
static void test_tension(batten_context *ctx) {
  enum { COUNT = 6000, SPANS = 1000 };
  double *points = malloc(2 * COUNT * sizeof *points), *t = malloc(COUNT * sizeof *t), breaks[SPANS];
  uint64_t seed = 3;
  for (size_t i = 0; i < COUNT; i++) {
    double r = 1 + 1e-3 * (t_uniform(&seed) - 0.5);
    t[i] = (double)i / (COUNT - 1);
    points[2 * i] = r * cos(3 * t[i]);
    points[2 * i + 1] = r * sin(3 * t[i]);
  }
  for (size_t i = 0; i < SPANS; i++) breaks[i] = (double)(i + 1) / SPANS;
  batten_contour_options o = batten_contour_options_default();
  o.parameters = t;
  o.breaks = breaks;
  o.break_count = SPANS - 1;
  o.inflection_count = 0;
  o.rounds = 1;
  o.correction_passes = 0;
  result with = fit(ctx, COUNT, points, &o);
  o.tension = 0;
  result without = fit(ctx, COUNT, points, &o);
  T_CHECK(with.status == BATTEN_OK && without.status == BATTEN_OK, "%d spans: %s, %s", SPANS,
          batten_status_name(with.status), batten_status_name(without.status));
  T_RATIO(fabs(with.info.lsq_unconstrained / without.info.lsq_unconstrained - 1), 1e-6,
          "%d spans: tension adds to the sum of noise", SPANS);
  batten_curve_free(with.curve);
  batten_curve_free(without.curve);
  size_t kept = 0; /* no data in half of the domain */
  for (size_t i = 0; i < COUNT; i++) {
    if (t[i] > 0.2 && t[i] < 0.7) continue;
    t[kept] = t[i];
    points[2 * kept] = cos(3 * t[i]);
    points[2 * kept + 1] = sin(3 * t[i]);
    kept++;
  }
  o.tension = batten_contour_options_default().tension;
  with = fit(ctx, kept, points, &o);
  T_CHECK(with.status == BATTEN_OK && with.info.shape.certified, "500 spans without data: %s",
          batten_status_name(with.status));
  T_RATIO(with.info.rms, 1e-6, "and the data are met");
  batten_curve_free(with.curve);
  free(points);
  free(t);
}

/* Few points whose shape is not the wanted one: it is said, and the curve ends where they end. */
static void test_few_points(batten_context *ctx) {
  double points[2 * 15], parameters[15];
  for (int i = 0; i < 15; i++) { /* bends to both sides, as the foremost frames of ships with a bulb do */
    double t = i / 14.0;
    points[2 * i] = 4 * t * t + 0.9 * sin(7 * t);
    points[2 * i + 1] = 7 * t;
  }
  batten_contour_options o = batten_contour_options_default();
  const double inflection = 0.25;
  o.inflections = &inflection;
  o.inflection_count = 1;
  o.sign = 1;
  batten_curve *curve = NULL;
  batten_contour_info info;
  batten_status st = batten_contour_fit(ctx, 15, points, &o, &curve, parameters, NULL, &info);
  T_STATUS(st, BATTEN_W_SHAPE, ctx, "most near points[");
  T_CHECK(info.shape.certified && info.max_error > 0.01 * 7, "proven, with points %g away", info.max_error);
  T_CHECK(parameters[0] == 0 && parameters[14] == 1, "the ends stay: %g, %g", parameters[0], parameters[14]);
  batten_curve_free(curve);
}

/* Few spans, closed: all that can be fitted is, the rest is told. */
static void test_few_spans(batten_context *ctx) {
  const contour_rule rule = {.kind = CONTOUR_ELLIPSE, .count = 80, .seed = 3};
  contour_scene s = contour_scene_make(&rule);
  size_t proven = 0, refused = 0;
  for (unsigned l = 1; l <= 2; l++)
    for (unsigned d = l + 1; d <= 6; d++)
      for (size_t spans = 1; spans <= 4; spans++) {
        double breaks[3] = {1.0 / (double)spans, 2.0 / (double)spans, 3.0 / (double)spans};
        batten_contour_options o = batten_contour_options_default();
        o.degree = d;
        o.smoothness = l;
        o.closed = 1;
        o.breaks = breaks;
        o.break_count = spans - 1;
        o.inflection_count = 0;
        result r = fit(ctx, s.count, s.points, &o);
        if (r.status >= 0)
          proven += (size_t)r.info.shape.certified;
        else if (r.status == BATTEN_E_INVALID && strstr(batten_error(ctx), "3 at least"))
          refused++;
        else
          printf("# degree %u, smoothness %u, %zu spans: %s\n", d, l, spans, batten_error(ctx));
        batten_curve_free(r.curve);
      }
  T_CHECK(proven == 18 && refused == 18, "closed curves of 1 to 4 spans: %zu proven, %zu refused", proven, refused);
  contour_scene_free(&s);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  test_by_hand(ctx);
  test_random(ctx);
  test_similar(ctx);
  test_reversed(ctx);
  test_domain(ctx);
  test_threads();
  test_ends(ctx);
  test_tangents(ctx);
  test_far(ctx);
  test_masked(ctx);
  test_tension(ctx);
  test_few_points(ctx);
  test_few_spans(ctx);
  batten_context_free(ctx);
  return t_done();
}
