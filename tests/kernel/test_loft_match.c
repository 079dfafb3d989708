/* Slices of known shape become contours that correspond: direction, start, inflections, knots. */
#include <batten/loft.h>

#include "tap.h"

enum { SLICES = 12, POINTS = 80, ALL = SLICES * POINTS, TIMES = 64 };
static const double PI = 3.14159265358979323846;

typedef struct scene {
  size_t count, starts[SLICES + 1];
  double points[ALL][2];
  bool reversed[SLICES];
  batten_loft_match_options opt;
} scene;

typedef struct outcome {
  batten_status st;
  batten_curve *curves[SLICES];
  batten_loft_match_info info;
} outcome;

static scene new_scene(bool closed) {
  scene s = {.opt = batten_loft_match_options_default()};
  s.opt.fit.closed = closed;
  return s;
}

static void add_slice(scene *s, size_t count, double points[][2], bool reversed) {
  size_t start = s->starts[s->count];
  s->reversed[s->count++] = reversed;
  for (size_t k = 0; k < count; k++)
    memcpy(s->points[start + k], points[reversed ? count - 1 - k : k], sizeof *points);
  s->starts[s->count] = start + count;
}

static outcome match(batten_context *ctx, const scene *s) {
  outcome o = {0};
  o.st = batten_loft_match(ctx, s->count, s->starts, s->points[0], &s->opt, o.curves, &o.info);
  if (o.st != BATTEN_OK) printf("# %s: %s\n", batten_status_name(o.st), batten_error(ctx));
  return o;
}

static void drop(outcome *o) {
  for (size_t i = 0; i < SLICES; i++) batten_curve_free(o->curves[i]);
}

/* All curves over [0, 1] with one set of knots, to the bit. */
static bool same_knots(const scene *s, const outcome *o) {
  batten_curve_form first = batten_curve_get(o->curves[0]);
  bool same = first.knots[0] == 0 && first.knots[first.knot_count - 1] == 1;
  for (size_t i = 1; i < s->count; i++) {
    batten_curve_form f = batten_curve_get(o->curves[i]);
    same =
        same && f.knot_count == first.knot_count && memcmp(f.knots, first.knots, f.knot_count * sizeof *f.knots) == 0;
  }
  return same;
}

static void point_at(batten_context *ctx, const batten_curve *curve, double t, double out[2]) {
  batten_curve_point p;
  if (batten_curve_evaluate(ctx, curve, 1, &t, &p) < 0) t_line(false, "%s", batten_error(ctx));
  memcpy(out, p.point, sizeof p.point);
}

/* ---- closed ------------------------------------------------------------------------------------- */

/* A ring with dents: r = radius (1 + depth cos(lobes angle)), from `start` on, moved. */
static void ring(size_t count, double radius, double depth, double lobes, double start, double turn, double moved,
                 double points[][2]) {
  for (size_t k = 0; k < count; k++) {
    double a = start + 2 * PI * (double)k / (double)count, r = radius * (1 + depth * cos(lobes * a));
    points[k][0] = moved + r * cos(a + turn);
    points[k][1] = r * sin(a + turn);
  }
}

/* Circles: points of equal t lie at equal angles, whatever start and direction the slices have. */
static void test_circles(batten_context *ctx) {
  uint64_t seed = 7;
  scene s = new_scene(true);
  double points[POINTS][2], worst = 0;
  size_t reversed = 0;
  for (size_t i = 0; i < 8; i++) {
    ring(30 + 5 * i, 1 + 0.3 * sin((double)i), 0, 1, i ? 6 * t_uniform(&seed) : 0, 0, 0.2 * (double)i, points);
    add_slice(&s, 30 + 5 * i, points, i % 3 == 1);
    reversed += i % 3 == 1;
  }
  outcome o = match(ctx, &s);
  T_CHECK(o.st == BATTEN_OK && same_knots(&s, &o), "circles: matched, one set of knots of %zu spans", o.info.spans);
  T_CHECK(o.info.reversed == reversed, "circles: %zu are reversed", o.info.reversed);
  T_CHECK(o.info.certified == s.count && o.info.inflections == 0 && o.info.tracks == 0, "circles: proven convex");
  for (size_t i = 0; i < s.count && o.st >= 0; i++)
    for (size_t k = 0; k < TIMES; k++) {
      double p[2], t = (double)k / TIMES;
      point_at(ctx, o.curves[i], t, p);
      worst = fmax(worst, fabs(remainder(atan2(p[1], p[0] - 0.2 * (double)i) - 2 * PI * t, 2 * PI)));
    }
  T_RATIO(worst, 2e-3, "circles: angle beside 2 pi t");
  T_RATIO(o.info.max_error, 2e-3, "circles: largest distance of points");
  drop(&o);
}

/* Lines that cross themselves have areas of any sign: noise decides it. */
static void test_eights(batten_context *ctx) {
  uint64_t seed = 5;
  scene s = new_scene(true);
  double points[POINTS][2];
  for (size_t i = 0; i < 8; i++) {
    double start = 6 * t_uniform(&seed);
    for (size_t k = 0; k < POINTS; k++) {
      double a = start + 2 * PI * (double)k / POINTS;
      points[k][0] = (1 + 0.05 * (double)i) * sin(2 * a) + 0.01 * t_uniform(&seed);
      points[k][1] = sin(a) + 0.01 * t_uniform(&seed);
    }
    add_slice(&s, POINTS, points, i % 3 == 1);
  }
  outcome o = match(ctx, &s);
  T_CHECK(o.st >= 0 && o.info.reversed == 3 && o.info.inflections_matched == 16 && o.info.certified == 8,
          "eights: %zu are reversed, %zu of %zu inflections matched", o.info.reversed, o.info.inflections_matched,
          o.info.inflections);
  T_RATIO(o.info.max_error, 0.05, "eights: largest distance of points");
  drop(&o);
}

/* Dents that turn slowly: four inflections, at one parameter each in all slices. */
static void test_dents(batten_context *ctx) {
  uint64_t seed = 11;
  scene s = new_scene(true);
  double points[POINTS][2], first[8], worst = 0, speed = INFINITY;
  for (size_t i = 0; i < 10; i++) {
    ring(POINTS, 1 + 0.05 * (double)i, 0.3 + 0.02 * cos((double)i), 2, 6 * t_uniform(&seed), 0.06 * (double)i, 0,
         points);
    add_slice(&s, POINTS, points, i == 4);
  }
  outcome o = match(ctx, &s);
  T_CHECK(o.st == BATTEN_OK && same_knots(&s, &o), "dents: matched, one set of knots of %zu spans", o.info.spans);
  T_CHECK(o.info.inflections == 40 && o.info.inflections_matched == 40 && o.info.tracks == 4,
          "dents: all %zu inflections have partners, on %zu tracks", o.info.inflections_matched, o.info.tracks);
  T_CHECK(o.info.certified == s.count, "dents: all proven");
  for (size_t i = 0; i < s.count && o.st >= 0; i++) {
    size_t count = 0;
    double *at = NULL, last[2], p[2];
    batten_status st = batten_curve_inflections(ctx, o.curves[i], &count, &at);
    T_CHECK(st == BATTEN_OK && count == 4, "dents: slice %zu has %zu inflections", i, count);
    for (size_t k = 0; k < count && k < 4; k++) {
      if (i == 0) first[k] = at[k];
      worst = fmax(worst, fabs(at[k] - first[k]));
    }
    batten_free(ctx, at);
    point_at(ctx, o.curves[i], 0, last);
    for (size_t k = 1; k <= TIMES; k++) {
      point_at(ctx, o.curves[i], (double)k / TIMES, p);
      speed = fmin(speed, hypot(p[0] - last[0], p[1] - last[1]) * TIMES);
      memcpy(last, p, sizeof last);
    }
  }
  T_RATIO(worst, 1e-8, "dents: parameters of inflections between slices");
  T_RATIO(2, speed, "dents: parameters do not crowd: their speed");
  T_RATIO(o.info.max_error, 0.01, "dents: largest distance of points");
  drop(&o);
}

/* ---- open --------------------------------------------------------------------------------------- */

/* A frame: from the keel out and up, with a hollow below that moves along: one inflection at x = hollow. */
static void frame(size_t count, double hollow, double height, double points[][2]) {
  for (size_t k = 0; k < count; k++) {
    double x = (double)k / (double)(count - 1);
    points[k][0] = 2 * x;
    points[k][1] = height * (x + 3 * pow(x - hollow, 3));
  }
}

static void test_frames(batten_context *ctx) {
  scene s = new_scene(false);
  double points[POINTS][2], t = NAN, worst = 0, across = 0;
  for (size_t i = 0; i < 9; i++) {
    frame(25 + i, 0.35 + 0.02 * (double)i, 1 + 0.1 * (double)i, points);
    add_slice(&s, 25 + i, points, i % 2 == 1);
  }
  outcome o = match(ctx, &s);
  T_CHECK(o.st == BATTEN_OK && same_knots(&s, &o), "frames: matched, one set of knots of %zu spans", o.info.spans);
  T_CHECK(o.info.reversed == 4 && o.info.tracks == 1 && o.info.inflections_matched == 9,
          "frames: %zu reversed, %zu inflections on %zu track", o.info.reversed, o.info.inflections_matched,
          o.info.tracks);
  for (size_t i = 0; i < s.count && o.st >= 0; i++) {
    size_t count = 0;
    double *at = NULL, p[2];
    if (batten_curve_inflections(ctx, o.curves[i], &count, &at) < 0 || count != 1) {
      t_line(false, "frames: slice %zu has %zu inflections", i, count);
      continue;
    }
    if (i == 0) t = at[0];
    worst = fmax(worst, fabs(at[0] - t));
    point_at(ctx, o.curves[i], at[0], p);
    across = fmax(across, fabs(p[0] / 2 - (0.35 + 0.02 * (double)i)));
    batten_free(ctx, at);
  }
  T_RATIO(worst, 1e-8, "frames: parameters of the inflection between slices");
  T_RATIO(across, 0.02, "frames: the inflection from where it is");
  T_RATIO(o.info.max_error, 2e-3, "frames: largest distance of points");
  drop(&o);
}

/* ---- tracks that begin and end ------------------------------------------------------------------- */

/* A dent on one side in slices 3 .. 6 only: two tracks. */
static void test_passing(batten_context *ctx) {
  scene s = new_scene(true);
  double points[POINTS][2];
  for (size_t i = 0; i < 9; i++) {
    double depth = i >= 3 && i <= 6 ? 0.25 : 0;
    for (size_t k = 0; k < POINTS; k++) {
      double a = 2 * PI * (double)k / POINTS, r = 1 - depth * exp(-pow(remainder(a - 2, 2 * PI) / 0.35, 2));
      points[k][0] = r * cos(a);
      points[k][1] = r * sin(a);
    }
    add_slice(&s, POINTS, points, false);
  }
  outcome o = match(ctx, &s);
  T_CHECK(o.st >= 0 && o.info.inflections == 8 && o.info.tracks == 2 && o.info.inflections_matched == 4,
          "a dent that comes and goes: %zu inflections, %zu tracks, %zu with partners on both sides",
          o.info.inflections, o.info.tracks, o.info.inflections_matched);
  T_CHECK(o.info.certified == s.count && o.info.reversed == 0, "a dent that comes and goes: all proven");
  drop(&o);
  s.opt.features = 0;
  o = match(ctx, &s);
  T_CHECK(o.st >= 0 && o.info.tracks == 8 && o.info.inflections_matched == 0 && o.info.certified == s.count,
          "without features: %zu tracks, %zu with partners", o.info.tracks, o.info.inflections_matched);
  drop(&o);
}

/* A ring with noise, and a dent at 3. */
static void noisy_dent(double depth, double points[][2]) {
  uint64_t seed = 23;
  for (size_t k = 0; k < POINTS; k++) {
    double a = 2 * PI * (double)k / POINTS, r = 1 - depth * exp(-pow((a - 3) / 0.5, 2));
    points[k][0] = r * cos(a) + 0.02 * (t_uniform(&seed) - 0.5);
    points[k][1] = r * sin(a) + 0.02 * (t_uniform(&seed) - 0.5);
  }
}

/* Slice 3 of 7 has a dent of another depth. One of 0.18 has about 3 standard deviations, 0.22 about 7, and 0.35 above
 * 16. */
static outcome faint(batten_context *ctx, double depth, double others, int features) {
  scene s = new_scene(true);
  double points[POINTS][2];
  for (size_t i = 0; i < 7; i++) {
    noisy_dent(i == 3 ? depth : others, points);
    add_slice(&s, POINTS, points, false);
  }
  s.opt.features = features;
  return match(ctx, &s);
}

/* Neighbours let bends count that one slice does not tell of clearly. */
static void test_faint(batten_context *ctx) {
  outcome o = faint(ctx, 0.18, 0.35, 0);
  T_CHECK(o.st >= 0 && o.info.inflections == 12, "a faint dent alone does not count");
  drop(&o);
  o = faint(ctx, 0.18, 0.35, 1);
  T_CHECK(o.st == BATTEN_OK && o.info.inflections_matched == 14 && o.info.inflections == 14 && o.info.certified == 7,
          "a faint dent that neighbours have counts: %zu of %zu matched", o.info.inflections_matched,
          o.info.inflections);
  drop(&o);
  o = faint(ctx, 0.22, 0, 1);
  T_CHECK(o.st == BATTEN_OK && o.info.inflections == 2 && o.info.inflections_matched == 0,
          "a dent that counts alone does so without neighbours");
  drop(&o);
  o = faint(ctx, 0, 0.35, 1);
  T_CHECK(o.st >= 0 && o.info.inflections == 12 && o.info.inflections_matched == 8,
          "where there is no dent, neighbours do not make one");
  drop(&o);
}

/* ---- options ------------------------------------------------------------------------------------- */

static void test_options(batten_context *ctx) {
  scene s = new_scene(true);
  double points[POINTS][2], p[2], q[2];
  for (size_t i = 0; i < 4; i++) {
    ring(40, 1, 0.05, 3, i == 2 ? 1 : 0, 0, 0, points);
    add_slice(&s, 40, points, i == 3);
  }
  s.opt.orient = s.opt.align = 0;
  outcome o = match(ctx, &s);
  point_at(ctx, o.curves[2], 0, p);
  T_CHECK(o.st >= 0 && o.info.reversed == 0 && fabs(atan2(p[1], p[0]) - 1) < 0.1,
          "without align a slice begins where it began, at %.3f", atan2(p[1], p[0]));
  drop(&o);
  s.opt.align = 1;
  s.opt.orient = 1;
  o = match(ctx, &s);
  point_at(ctx, o.curves[1], 0, p);
  point_at(ctx, o.curves[2], 0, q);
  T_CHECK(o.st == BATTEN_OK && o.info.reversed == 1, "with both: %zu is reversed", o.info.reversed);
  T_RATIO(hypot(p[0] - q[0], p[1] - q[1]), 0.02, "with align starts are near to each other");
  drop(&o);
  s.opt.fit.spans = 17;
  o = match(ctx, &s);
  T_CHECK(o.st >= 0 && o.info.spans >= 16 && o.info.spans <= 18, "17 spans were asked for, %zu came", o.info.spans);
  drop(&o);
  s.opt.fit.spans = 0;
  s.opt.fit.tolerance = 1e-4;
  o = match(ctx, &s);
  T_RATIO(o.info.max_error, 1e-4, "a tolerance: largest distance with %zu spans", o.info.spans);
  drop(&o);
  for (unsigned l = 1; l <= 2; l++)
    for (unsigned d = l + 1; d <= 5; d++) {
      scene w = new_scene(true);
      for (size_t i = 0; i < 3; i++) {
        ring(60, 1, 0.3, 2, 0.5 * (double)i, 0.1 * (double)i, 0, points);
        add_slice(&w, 60, points, false);
      }
      w.opt.fit.smoothness = l;
      w.opt.fit.degree = d;
      o = match(ctx, &w);
      T_CHECK(o.st >= 0 && o.info.certified == 3 && o.info.tracks == 4 && o.info.inflections_matched == 12,
              "degree %u, smoothness %u: %zu tracks, %zu spans, largest distance %.2g", d, l, o.info.tracks,
              o.info.spans, o.info.max_error);
      drop(&o);
    }
}

/* Points of weight 0 do not count, wherever they are; and a slice of few points is calm on the knots of others. */
static void test_weights(batten_context *ctx) {
  scene s = new_scene(true);
  double points[POINTS][2], weights[ALL], length = 0, p[2], last[2];
  for (size_t i = 0; i < 3; i++) {
    size_t count = i == 1 ? 7 : POINTS;
    ring(count, 1, 0.02, 5, 0.1, 0, 0, points);
    add_slice(&s, count, points, false);
  }
  s.opt.fit.spans = 24;
  outcome o = match(ctx, &s);
  T_CHECK(o.st >= 0 && o.info.certified == 3, "a slice of 7 points on %zu spans is proven", o.info.spans);
  point_at(ctx, o.curves[1], 0, last);
  for (size_t k = 1; k <= TIMES; k++) {
    point_at(ctx, o.curves[1], (double)k / TIMES, p);
    length += hypot(p[0] - last[0], p[1] - last[1]);
    memcpy(last, p, sizeof last);
  }
  T_RATIO(length, 2.1 * PI, "its length");
  drop(&o);
  for (size_t k = 0; k < s.starts[3]; k++) weights[k] = 1;
  s.opt.fit.weights = weights;
  s.points[20][0] += 0.05;
  weights[20] = 0;
  o = match(ctx, &s);
  T_CHECK(o.st >= 0 && o.info.certified == 3, "with weights: proven");
  T_RATIO(o.info.max_error, 0.01, "with weights: largest distance of points that count");
  drop(&o);
}

/* ---- invariances --------------------------------------------------------------------------------- */

static bool same_curves(size_t count, const outcome *a, const outcome *b, double scale) {
  bool same = true;
  for (size_t i = 0; i < count; i++) {
    batten_curve_form f = batten_curve_get(a->curves[i]), g = batten_curve_get(b->curves[i]);
    size_t n = f.knot_count - f.degree - 1;
    same = same && f.knot_count == g.knot_count && memcmp(f.knots, g.knots, f.knot_count * sizeof *f.knots) == 0;
    for (size_t k = 0; k < 2 * n && same; k++) same = scale * f.control_points[k] == g.control_points[k];
  }
  return same;
}

static void test_invariance(batten_context *ctx) {
  uint64_t seed = 3;
  scene s = new_scene(true);
  double points[POINTS][2];
  for (size_t i = 0; i < 5; i++) {
    ring(POINTS, 1, 0.28, 2, 6 * t_uniform(&seed), 0.1 * (double)i, 0, points);
    add_slice(&s, POINTS, points, i == 2);
  }
  outcome o = match(ctx, &s);
  T_CHECK(o.st >= 0, "the scene is matched");
  batten_context *other = t_context(NULL, NULL, 4);
  outcome p = match(other, &s);
  T_CHECK(p.st == o.st && same_curves(s.count, &o, &p, 1), "four threads: the same bits");
  drop(&p);
  batten_context_free(other);
  scene big = s;
  for (size_t k = 0; k < 2 * s.starts[s.count]; k++) big.points[k / 2][k % 2] *= 0x1p40;
  p = match(ctx, &big);
  T_CHECK(p.st == o.st && same_curves(s.count, &o, &p, 0x1p40), "points times 2^40: the same bits");
  drop(&p);
  scene turned = s;
  double worst = 0;
  for (size_t k = 0; k < s.starts[s.count]; k++) {
    turned.points[k][0] = 0.6 * s.points[k][0] - 0.8 * s.points[k][1] + 3;
    turned.points[k][1] = 0.8 * s.points[k][0] + 0.6 * s.points[k][1] - 5;
  }
  p = match(ctx, &turned);
  for (size_t i = 0; i < s.count && p.st >= 0; i++)
    for (size_t k = 0; k < TIMES; k++) {
      double a[2], b[2], t = (double)k / TIMES;
      point_at(ctx, o.curves[i], t, a);
      point_at(ctx, p.curves[i], t, b);
      worst = fmax(worst, hypot(0.6 * a[0] - 0.8 * a[1] + 3 - b[0], 0.8 * a[0] + 0.6 * a[1] - 5 - b[1]));
    }
  /* Rounds of fits end where sums drop by less than 1e-3: rounding decides about one more. */
  T_RATIO(worst, 1e-4, "turned and moved: the same curves");
  drop(&p);
  drop(&o);
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_circles(ctx);
  test_eights(ctx);
  test_dents(ctx);
  test_frames(ctx);
  test_passing(ctx);
  test_faint(ctx);
  test_options(ctx);
  test_weights(ctx);
  test_invariance(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "no memory is left");
  batten_context_free(ctx);
  return t_done();
}
