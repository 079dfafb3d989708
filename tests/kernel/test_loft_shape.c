/* Inflections of contours: knots, partners, notes; polygons that bend as the curves do (assumption 3). */
#include <float.h>

#include "../../kernel/loft/loft_inner.h"
#include "../loft_scenes.h"
#include "tap.h"

static const double PI = 3.14159265358979323846;

static batten_status prepare(batten_context *ctx, size_t count, batten_curve **contours, const double *heights,
                             const batten_loft_options *opt, loft_stack *s) {
  batten_status st = loft_stack_make(ctx, count, (const batten_curve *const *)contours, heights, opt, s);
  if (st < 0) return st;
  st = loft_shape_prepare(ctx, s, opt);
  if (st < 0) loft_stack_free(ctx, s);
  return st;
}

static bool has_note(const loft_stack *s, batten_loft_remark remark, size_t contour) {
  for (size_t k = 0; k < s->note_count; k++)
    if (s->notes[k].remark == remark && s->notes[k].contour == contour) return true;
  return false;
}

/* Whether [a, b] is in the zone of an inflection that is not flat, which is free: the part 0.1 of the given curve's
 * span, or so far beyond a knot just beside it. */
static bool is_bent(const loft_stack *s, size_t contour, const batten_curve *curve, double a, double b) {
  batten_curve_form f = batten_curve_get(curve);
  for (size_t k = 0; k < s->note_count; k++) {
    const batten_loft_note *n = s->notes + k;
    if (n->remark != BATTEN_LOFT_NOT_FLAT || n->contour != contour) continue;
    double reach = 0;
    for (size_t j = 0; j + 1 < f.knot_count; j++) {
      double from = f.knots[j], to = f.knots[j + 1];
      if (n->t >= from - 0.1 * (to - from) && n->t <= to + 0.1 * (to - from)) reach = fmax(reach, 0.2 * (to - from));
    }
    if (fabs(n->t - (a + b) / 2) <= reach) return true;
  }
  return false;
}

/* The sign of the given curve between a and b, 0 if it is not the same at all of many places by more than rounding.
 */
static int curve_sign(batten_context *ctx, const batten_curve *curve, double a, double b) {
  int sign = 0;
  for (int k = 0; k < 15; k++) {
    double t = a + (b - a) * (k + 0.5) / 15, jet[3][2];
    if (batten_curve_derivatives(ctx, curve, 2, 1, &t, jet[0]) < 0) return 0;
    double across = loft_cross(jet[1], jet[2]), speed = hypot(jet[1][0], jet[1][1]);
    int here = fabs(across) * (b - a) < 1e-7 * speed * speed ? 0 : across > 0 ? 1 : -1;
    if (here == 0 || (k > 0 && here != sign)) return 0;
    sign = here;
  }
  return sign;
}

typedef struct tally {
  size_t checked, wrong, steep, inserted, points;
  double turn; /* largest, of pi / (degree - 1) */
} tally;

/* Every vertex that acts on a span with one sign in both contours of a patch turns to that side, or is flat. */
static void check_vertices(batten_context *ctx, const loft_stack *s, batten_curve **contours, tally *out) {
  loft_slab *slabs = NULL;
  if (loft_slabs_make(ctx, s, &slabs) < 0) abort();
  for (size_t i = 0; i + 1 < s->count; i++) {
    const loft_space *space = &slabs[i].space;
    for (size_t span = 0; span < space->spans; span++) {
      double a = space->breaks[span], b = space->breaks[span + 1];
      int signs[2];
      for (size_t e = 0; e < 2; e++)
        signs[e] = is_bent(s, i + e, contours[i + e], a, b) ? 0 : curve_sign(ctx, contours[i + e], a, b);
      if (signs[0] == 0 || signs[0] != signs[1]) continue;
      for (size_t k = 0; k + 2 <= s->degree; k++)
        for (size_t e = 0; e < 2; e++) {
          size_t v = (space->first[span] + k) % space->count;
          const double *p[3];
          for (size_t q = 0; q < 3; q++) p[q] = slabs[i].end[e] + 2 * ((v + q) % space->count);
          double x[2] = {p[1][0] - p[0][0], p[1][1] - p[0][1]}, y[2] = {p[2][0] - p[1][0], p[2][1] - p[1][1]};
          double turn = atan2(loft_cross(x, y), x[0] * y[0] + x[1] * y[1]);
          double rounding = 1e-13 / fmin(hypot(x[0], x[1]), hypot(y[0], y[1])) + 1e-9;
          double part = fabs(turn) * (s->degree - 1) / PI;
          out->checked++;
          if (has_note(s, BATTEN_LOFT_STEEP, i + e)) {
            out->steep++;
            continue;
          }
          out->turn = fmax(out->turn, part);
          if (signs[e] * turn > -rounding && part < 1) continue;
          out->wrong++;
          if (out->wrong < 5)
            printf("# contour %zu, vertex %zu of span %g .. %g: turn %g, sign %d\n", i + e, v, a, b, turn, signs[e]);
        }
    }
  }
  loft_slabs_free(ctx, s->count - 1, slabs);
}

static void test_random(batten_context *ctx) {
  tally all = {0};
  size_t failed = 0, unmatched = 0, inflections = 0, lone = 0;
  for (uint64_t seed = 1; seed <= 150; seed++) {
    loft_rule rule = loft_rule_random(seed);
    loft_scene scene = loft_scene_make(ctx, &rule);
    const batten_loft_options opt = batten_loft_options_default();
    loft_stack s = {0};
    if (prepare(ctx, scene.count, scene.contours, scene.heights, &opt, &s) < 0) {
      printf("# seed %u: %s\n", (unsigned)seed, batten_error(ctx));
      failed++;
      continue;
    }
    size_t wrong = all.wrong;
    check_vertices(ctx, &s, scene.contours, &all);
    if (all.wrong > wrong || (!rule.unmatched && s.unmatched > 0))
      printf("# seed %u: degree %u, smoothness %u, closed %d, %zu inserted, %zu of %zu unmatched\n", (unsigned)seed,
             s.degree, s.smoothness, s.closed, s.knots_inserted, s.unmatched, s.inflections);
    all.inserted += s.knots_inserted;
    for (size_t i = 0; i < s.count; i++) all.points += s.contours[i].space.count;
    inflections += s.inflections;
    unmatched += s.unmatched;
    if (!rule.unmatched) lone += s.unmatched;
    loft_stack_free(ctx, &s);
    loft_scene_free(&scene);
  }
  T_CHECK(failed == 0, "all random stacks are prepared");
  T_CHECK(all.wrong == 0, "polygons bend as the curves at %zu of %zu vertices, largest turn %.3g of what is allowed",
          all.checked - all.wrong, all.checked, all.turn);
  T_CHECK(all.steep == 0, "none is too steep: %zu", all.steep);
  T_CHECK(lone == 0 && unmatched > 0 && inflections > 100, "%zu inflections, %zu without partner, %zu unforeseen",
          inflections, unmatched, lone);
  T_RATIO((double)all.inserted, 0.25 * (double)all.points, "knots inserted, of control points");
}

/* A contour with random control points: many inflections, none flat. Knots at random. */
static batten_curve *make_wild(batten_context *ctx, uint64_t *state, unsigned degree, size_t spans, double calm) {
  double knots[64], points[2 * 64];
  size_t count = 0;
  double at = 0, breaks[16];
  for (size_t k = 0; k < spans; k++) breaks[k] = at += 0.05 + t_uniform(state);
  for (unsigned k = 0; k <= degree; k++) knots[count++] = 0;
  for (size_t k = 0; k + 1 < spans; k++)
    for (unsigned f = 0; f < (degree > 3 ? degree - 2 : 1); f++) knots[count++] = breaks[k] / at;
  for (unsigned k = 0; k <= degree; k++) knots[count++] = 1;
  for (size_t j = 0; j + degree + 1 < count; j++) {
    double greville = 0;
    for (unsigned k = 1; k <= degree; k++) greville += knots[j + k] / degree;
    points[2 * j] = 2 * calm * greville + t_uniform(state);
    points[2 * j + 1] = t_uniform(state);
  }
  batten_curve *out = NULL;
  if (batten_curve_create(ctx, &(batten_curve_form){degree, count, knots, points, 0}, &out) < 0) abort();
  return out;
}

static void test_wild(batten_context *ctx) {
  tally all = {0};
  size_t failed = 0, notes = 0, inflections = 0;
  uint64_t state = 11;
  size_t by_degree[10][4] = {{0}};
  for (unsigned trial = 0; trial < 64; trial++) {
    unsigned degree = 2 + trial % 8;
    batten_curve *contours[3];
    const double heights[3] = {0, 1, 3};
    for (size_t i = 0; i < 3; i++) contours[i] = make_wild(ctx, &state, degree, 2 + trial % 5, trial % 3);
    const batten_loft_options opt = batten_loft_options_default();
    loft_stack s = {0};
    batten_status st = prepare(ctx, 3, contours, heights, &opt, &s);
    if (st < 0) {
      failed += !strstr(batten_error(ctx), "runs against");
      if (!strstr(batten_error(ctx), "runs against")) printf("# trial %u: %s\n", trial, batten_error(ctx));
    } else {
      check_vertices(ctx, &s, contours, &all);
      all.inserted += s.knots_inserted;
      for (size_t i = 0; i < 3; i++) all.points += s.contours[i].space.count;
      for (size_t i = 0; i < 3; i++) notes += has_note(&s, BATTEN_LOFT_STEEP, i);
      inflections += s.inflections;
      by_degree[degree][0] += s.knots_inserted;
      for (size_t i = 0; i < 3; i++) by_degree[degree][1] += batten_curve_get(contours[i]).knot_count - degree - 1;
      for (size_t i = 0; i < 3; i++) by_degree[degree][2] += has_note(&s, BATTEN_LOFT_STEEP, i);
      by_degree[degree][3] += s.inflections;
      loft_stack_free(ctx, &s);
    }
    for (size_t i = 0; i < 3; i++) batten_curve_free(contours[i]);
  }
  for (unsigned d = 2; d < 10; d++)
    printf("# degree %u: %zu knots inserted into contours of %zu points, %zu of 24 steep, %zu inflections\n", d,
           by_degree[d][0], by_degree[d][1], by_degree[d][2], by_degree[d][3]);
  T_CHECK(failed == 0, "wild contours are prepared, %zu inflections", inflections);
  T_CHECK(all.wrong == 0, "polygons bend as the curves at %zu of %zu vertices, largest turn %.3g of what is allowed",
          all.checked - all.wrong, all.checked, all.turn);
  T_CHECK(notes < 10, "steep contours: %zu", notes);
  T_RATIO((double)all.inserted, 20 * (double)inflections, "knots inserted, by inflections");
}

/* A cubic over [0, 1] with simple knots, x'' = 0 at the break number `flat` (0: nowhere) where its legs change from
 * left bends to right ones; the second flat point there, `again`, bends back. */
static batten_curve *make_s(batten_context *ctx, const double *breaks, size_t spans, size_t flat) {
  double knots[32], points[64], angle = 0.1;
  size_t count = 0;
  for (int k = 0; k < 3; k++) knots[count++] = 0;
  for (size_t k = 0; k <= spans; k++) knots[count++] = breaks[k];
  for (int k = 0; k < 3; k++) knots[count++] = 1;
  points[0] = points[1] = 0;
  for (size_t v = 0; v + 5 < count; v++) { /* vertex v is x'' at break v, between legs v and v + 1 */
    double length = knots[v + 4] - knots[v + 1];
    points[2 * v + 2] = points[2 * v] + length * cos(angle);
    points[2 * v + 3] = points[2 * v + 1] + length * sin(angle);
    if (flat == 0 || v != flat) angle += flat == 0 || v < flat ? 0.3 : -0.3;
  }
  batten_curve *out = NULL;
  if (batten_curve_create(ctx, &(batten_curve_form){3, count, knots, points, 0}, &out) < 0) abort();
  return out;
}

/* Matched, at other places, and missing: by hand. */
static void test_partners(batten_context *ctx) {
  const double breaks[] = {0, 0.2, 0.4, 0.6, 0.8, 1}, heights[3] = {0, 1, 3};
  const batten_loft_options opt = batten_loft_options_default();
  loft_stack s = {0};
  batten_curve *curves[3];
  for (size_t i = 0; i < 3; i++) curves[i] = make_s(ctx, breaks, 5, 2);
  T_OK(prepare(ctx, 3, curves, heights, &opt, &s), ctx);
  bool flat = true;
  for (size_t i = 0; i < 3; i++)
    for (size_t b = 0; b <= s.contours[i].space.spans; b++)
      flat = flat && s.contours[i].flat_above[b] == (i < 2 && b == 2);
  T_CHECK(s.inflections == 3 && s.unmatched == 0 && s.note_count == 0 && s.knots_inserted == 0 && flat,
          "matched inflections are flat, nothing is told and nothing inserted");
  loft_stack_free(ctx, &s);

  batten_curve_free(curves[2]);
  curves[2] = make_s(ctx, breaks, 5, 3);
  T_OK(prepare(ctx, 3, curves, heights, &opt, &s), ctx);
  const batten_loft_note *n = s.notes;
  T_CHECK(s.inflections == 3 && s.unmatched == 2 && s.note_count == 2, "one that moved: 2 without partner");
  T_CHECK(s.note_count == 2 && n[0].remark == BATTEN_LOFT_UNMATCHED && n[0].contour == 1 && n[0].other == 2 &&
              n[0].t == breaks[2] && n[1].contour == 2 && n[1].other == 1 && n[1].t == breaks[3],
          "both are named");
  const loft_space *low = &s.contours[1].space, *high = &s.contours[2].space;
  T_CHECK(s.contours[0].flat_above[2] && !s.contours[1].flat_above[2], "flat only towards the partner");
  T_CHECK(low->spans == 6 && fabs(low->breaks[2] - 0.38) < 1e-15 && high->spans == 6 &&
              fabs(high->breaks[4] - 0.62) < 1e-15,
          "a knot where the zone ends, on the side where both bend alike");
  loft_stack_free(ctx, &s);

  batten_curve_free(curves[2]);
  curves[2] = make_s(ctx, breaks, 5, 0);
  T_OK(prepare(ctx, 3, curves, heights, &opt, &s), ctx);
  T_CHECK(
      s.inflections == 2 && s.unmatched == 1 && s.note_count == 1 && s.notes[0].contour == 1 && s.notes[0].other == 2,
      "a neighbour without one");
  loft_stack_free(ctx, &s);
  for (size_t i = 0; i < 3; i++) batten_curve_free(curves[i]);
}

/* Slopes at a shared inflection: one that is flat there, to rounding, and one that is not. */
static void test_slopes(batten_context *ctx) {
  const double breaks[] = {0, 0.2, 0.4, 0.6, 0.8, 1}, heights[2] = {0, 1}, matrix[4] = {0.1, 0.2, -0.1, 0.1};
  for (size_t end = 0; end < 2; end++)
    for (int off = 0; off < 3; off++) { /* none, rounding, more */
      batten_curve *curves[2] = {make_s(ctx, breaks, 5, 2), make_s(ctx, breaks, 5, 2)}, *turned = NULL, *slope = NULL;
      T_OK(batten_curve_transform(ctx, curves[0], matrix, NULL, NULL, &turned), ctx);
      batten_curve_form form = batten_curve_get(turned);
      double points[16];
      memcpy(points, form.control_points, sizeof points);
      points[7] += off == 0 ? 0 : off == 1 ? 1e-13 : 1e-6;
      form.control_points = points;
      T_OK(batten_curve_create(ctx, &form, &slope), ctx);
      batten_loft_options opt = batten_loft_options_default();
      opt.slopes[end] = slope;
      loft_stack s = {0};
      T_OK(prepare(ctx, 2, curves, heights, &opt, &s), ctx);
      const double *p = s.slopes[end] + 2 * 2;
      double bend = hypot(p[0] + p[4] - 2 * p[2], p[1] + p[5] - 2 * p[3]);
      if (off < 2) {
        T_CHECK(s.note_count == 0, "a slope that is flat where the contours are");
        T_RATIO(bend, 2 * DBL_EPSILON, "it is afterwards");
      } else {
        const batten_loft_note *n = s.notes;
        T_CHECK(s.note_count == 1 && n->remark == BATTEN_LOFT_SLOPE && n->contour == end && n->other == 1 - end &&
                    n->t == breaks[2] && bend > 1e-7,
                "one that is not is told, and left");
      }
      batten_loft *loft = NULL;
      batten_loft_info info;
      batten_status st =
          batten_loft_build(ctx, 2, (const batten_curve *const *)curves, heights, &opt, &loft, NULL, &info);
      T_CHECK(st == (off < 2 ? BATTEN_OK : BATTEN_W_ACCURACY), "sections: %s", batten_error(ctx));
      batten_loft_free(loft);
      loft_stack_free(ctx, &s);
      batten_curve *all[] = {curves[0], curves[1], turned, slope};
      for (size_t k = 0; k < 4; k++) batten_curve_free(all[k]);
    }
}

/* Inside a span of a cubic x'' passes through 0 where both ends bend against each other evenly: matched at one t. */
static void test_inside(batten_context *ctx) {
  const double knots[] = {0, 0, 0, 0, 1, 1, 1, 1}, points[] = {0, 0, 0.3, 0.4, 0.7, -0.4, 1, 0};
  const double twisted[] = {0, 0, 0.2, 0.4, 0.7, -0.4, 1, 0.1}, heights[2] = {0, 1};
  const batten_loft_options opt = batten_loft_options_default();
  batten_curve *curves[2] = {NULL, NULL};
  loft_stack s = {0};
  for (size_t i = 0; i < 2; i++)
    T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 8, knots, points, 0}, &curves[i]), ctx);
  T_OK(prepare(ctx, 2, curves, heights, &opt, &s), ctx);
  size_t at = 0;
  for (size_t b = 1; b < s.contours[0].space.spans; b++)
    if (s.contours[0].flat_above[b]) at = b;
  T_CHECK(s.unmatched == 0 && s.inflections == 2 && at > 0 && fabs(s.contours[0].space.breaks[at] - 0.5) < 1e-12,
          "an inflection inside a span becomes a knot, flat");
  bool same = false;
  for (size_t b = 1; b < s.contours[1].space.spans; b++)
    same = same || s.contours[1].space.breaks[b] == s.contours[0].space.breaks[at];
  T_CHECK(same, "the same in both");
  loft_stack_free(ctx, &s);
  batten_curve_free(curves[1]);
  T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 8, knots, twisted, 0}, &curves[1]), ctx);
  T_OK(prepare(ctx, 2, curves, heights, &opt, &s), ctx);
  T_CHECK(has_note(&s, BATTEN_LOFT_NOT_FLAT, 1) && !has_note(&s, BATTEN_LOFT_NOT_FLAT, 0) && s.unmatched == 2,
          "x'' is not 0 at that of a curve that is not even, it is told");
  loft_stack_free(ctx, &s);
  for (size_t i = 0; i < 2; i++) batten_curve_free(curves[i]);
}

/* The paper's contours, straight pieces, cylinders: nothing to be told. A hairpin needs knots. */
static void test_kinds(batten_context *ctx) {
  const batten_loft_options opt = batten_loft_options_default();
  for (unsigned kind = LOFT_PAPER; kind < LOFT_KINDS; kind++)
    for (unsigned degree = 2; degree <= (kind == LOFT_PAPER ? 2 : 5); degree++) {
      loft_rule rule = {.kind = (loft_kind)kind,
                        .degree = degree,
                        .smoothness = degree > 2 ? 2 : 1,
                        .contours = 4,
                        .spans = 9,
                        .seed = 4};
      loft_scene scene = loft_scene_make(ctx, &rule);
      loft_stack s = {0};
      tally all = {0};
      T_OK(prepare(ctx, scene.count, scene.contours, scene.heights, &opt, &s), ctx);
      check_vertices(ctx, &s, scene.contours, &all);
      /* Straight pieces end at other knots in each contour. */
      size_t most = kind == LOFT_STRAIGHT ? 8 * (degree - 2) : 0;
      T_CHECK(s.note_count == 0 && all.wrong == 0 && all.steep == 0 && s.knots_inserted <= most,
              "kind %u, degree %u: nothing to tell, %zu knots inserted, %zu vertices", kind, degree, s.knots_inserted,
              all.checked);
      loft_stack_free(ctx, &s);
      loft_scene_free(&scene);
    }
  const double knots[] = {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1};
  const double points[] = {-1, 0, 0, 0, 1, 0, 1, 0.1, 0, 0.1, -1, 0.1}, heights[2] = {0, 1};
  batten_curve *curves[2] = {NULL, NULL};
  for (size_t i = 0; i < 2; i++)
    T_OK(batten_curve_create(ctx, &(batten_curve_form){5, 12, knots, points, 0}, &curves[i]), ctx);
  loft_stack s = {0};
  tally all = {0};
  T_OK(prepare(ctx, 2, curves, heights, &opt, &s), ctx);
  check_vertices(ctx, &s, curves, &all);
  T_CHECK(s.note_count == 0 && all.checked > 0 && all.wrong == 0 && all.turn < 1 && s.knots_inserted > 0,
          "a hairpin: %zu knots inserted, turns are %.3g of what is allowed", s.knots_inserted / 2, all.turn);
  loft_stack_free(ctx, &s);
  for (size_t i = 0; i < 2; i++) batten_curve_free(curves[i]);
}

/* A loop: one crossing is told, of the contour that has it. */
static void test_loop(batten_context *ctx) {
  const double knots[] = {0, 0, 0, 0, 0.5, 1, 1, 1, 1}, heights[2] = {0, 1};
  const double arch[] = {-1, 0, -1, 1, 0, 2, 1, 1, 1, 0}, loop[] = {-1, 0, 2, 2, 0, 4, -2, 2, 1, 0};
  const batten_loft_options opt = batten_loft_options_default();
  batten_curve *curves[2] = {NULL, NULL};
  T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 9, knots, loop, 0}, &curves[0]), ctx);
  T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 9, knots, arch, 0}, &curves[1]), ctx);
  batten_curve *reversed = NULL;
  T_OK(batten_curve_reverse(ctx, curves[1], &reversed), ctx);
  loft_stack s = {0};
  T_OK(prepare(ctx, 2, (batten_curve *[]){curves[0], reversed}, heights, &opt, &s), ctx);
  T_CHECK(s.self_crossing == 1 && has_note(&s, BATTEN_LOFT_SELF_CROSSING, 0) &&
              !has_note(&s, BATTEN_LOFT_SELF_CROSSING, 1),
          "a contour that crosses itself is told");
  size_t count = 0;
  double(*crossings)[2] = NULL;
  T_OK(batten_curve_crossings(ctx, curves[0], &count, &crossings), ctx);
  for (size_t k = 0; k < s.note_count; k++)
    if (s.notes[k].remark == BATTEN_LOFT_SELF_CROSSING)
      T_RATIO(count ? fabs(s.notes[k].t - crossings[0][0]) : 1, 1e-12, "where it does");
  batten_free(ctx, crossings);
  loft_stack_free(ctx, &s);
  batten_curve_free(reversed);
  for (size_t i = 0; i < 2; i++) batten_curve_free(curves[i]);
}

/* A cusp, where no knots are enough: it is told, and knots stay so far apart that legs keep digits. */
static void test_cusp(batten_context *ctx) {
  const double knots[] = {0, 0, 0, 0, 1, 1, 1, 1}, points[] = {0, 0, 1, 1, 0, 1, 1, 0}, heights[2] = {0, 1};
  const batten_loft_options opt = batten_loft_options_default();
  batten_curve *curve = NULL;
  T_OK(batten_curve_create(ctx, &(batten_curve_form){3, 8, knots, points, 0}, &curve), ctx);
  loft_stack s = {0};
  T_OK(prepare(ctx, 2, (batten_curve *[]){curve, curve}, heights, &opt, &s), ctx);
  const loft_space *space = &s.contours[0].space;
  double least = 1;
  for (size_t k = 0; k < space->spans; k++) least = fmin(least, space->breaks[k + 1] - space->breaks[k]);
  T_CHECK(least >= 0x1p-21 && least < 1e-5, "least span beside a cusp: %g", least);
  size_t told = 0;
  for (size_t k = 0; k < s.note_count; k++)
    told += s.notes[k].remark == BATTEN_LOFT_STEEP && fabs(s.notes[k].t - 0.5) < 1e-5;
  T_CHECK(told == s.note_count && told >= 2 && has_note(&s, BATTEN_LOFT_STEEP, 1), "told of both: %zu", told);
  loft_stack_free(ctx, &s);
  batten_curve_free(curve);
}

/* Turned, moved, 2^k times as large and high, mirrored: the same knots. */
static void test_invariance(batten_context *ctx) {
  loft_rule rule = {.kind = LOFT_STACK,
                    .degree = 4,
                    .smoothness = 2,
                    .contours = 4,
                    .inflections = 2,
                    .unmatched = true,
                    .seed = 12,
                    .decades = 1,
                    .rotation = 0.3};
  const double matrices[3][4] = {{0x1p40, 0, 0, 0x1p40}, {-1, 0, 0, 1}, {0.6, -0.8, 0.8, 0.6}};
  const batten_loft_options opt = batten_loft_options_default();
  loft_stack first = {0};
  for (size_t k = 0; k < 4; k++) {
    loft_scene scene = loft_scene_make(ctx, &rule);
    for (size_t i = 0; i < scene.count && k > 0; i++) {
      batten_curve *moved = NULL;
      if (batten_curve_transform(ctx, scene.contours[i], matrices[k - 1], NULL, NULL, &moved) < 0) abort();
      batten_curve_free(scene.contours[i]);
      scene.contours[i] = moved;
      scene.heights[i] *= 0x1p-7;
    }
    loft_stack s = {0};
    T_OK(prepare(ctx, scene.count, scene.contours, scene.heights, &opt, &s), ctx);
    loft_scene_free(&scene);
    if (k == 0) {
      first = s;
      continue;
    }
    bool same = s.note_count == first.note_count && s.knots_inserted == first.knots_inserted;
    double off = 0;
    for (size_t i = 0; i < s.count && same; i++) {
      const loft_space *a = &s.contours[i].space, *b = &first.contours[i].space;
      same = a->spans == b->spans && a->count == b->count &&
             memcmp(s.contours[i].flat_above, first.contours[i].flat_above, a->spans + 1) == 0;
      for (size_t j = 0; j <= a->spans && same; j++) off = fmax(off, fabs(a->breaks[j] - b->breaks[j]));
    }
    T_CHECK(same, "the same knots and notes");
    T_RATIO(off, k == 1 ? 0 : 1e-12, "to");
    loft_stack_free(ctx, &s);
  }
  T_CHECK(first.unmatched > 0, "with %zu inflections of %zu that have no partner", first.unmatched,
          first.inflections);
  loft_stack_free(ctx, &first);
}

static batten_status call(batten_context *ctx, void *arg) {
  (void)arg;
  batten_context *own = t_context(NULL, NULL, 1); /* scenes know no failure */
  loft_rule rule = {.kind = LOFT_STACK,
                    .degree = 3,
                    .smoothness = 2,
                    .contours = 3,
                    .inflections = 2,
                    .unmatched = true,
                    .seed = 12,
                    .decades = 2,
                    .rotation = 0.3,
                    .spans = 6,
                    .slopes = true};
  loft_scene scene = loft_scene_make(own, &rule);
  batten_loft_options opt = batten_loft_options_default();
  for (size_t e = 0; e < 2; e++) opt.slopes[e] = scene.slopes[e];
  loft_stack s = {0};
  batten_status st = prepare(ctx, scene.count, scene.contours, scene.heights, &opt, &s);
  loft_stack_free(ctx, &s);
  loft_scene_free(&scene);
  batten_context_free(own);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_partners(ctx);
  test_slopes(ctx);
  test_inside(ctx);
  test_kinds(ctx);
  test_loop(ctx);
  test_cusp(ctx);
  test_invariance(ctx);
  test_random(ctx);
  test_wild(ctx);
  t_fail_every_allocation("preparing", call, NULL);
  t_cancel_every_progress("preparing", call, NULL);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
