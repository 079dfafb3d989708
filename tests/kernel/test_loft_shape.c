/* Inflections of contours: knots, partners, notes; polygons that bend as the curves do (assumption 3). */
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

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_random(ctx);
  test_wild(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
