/* Legs, turns and wanted signs of patches: by hand, against differences in higher precision, turned, scaled. */
#include <batten/loft.h>
#include <float.h>
#include <math.h>

#include "loft/loft_inner.h"
#include "loft_rig.h"
#include "loft_scenes.h"
#include "tap.h"

/* A square's corner, twice as large above and turned by a quarter. */
static void by_hand(batten_context *ctx) {
  static const double breaks[3] = {0, 0.5, 1},
                      points[2][4][2] = {{{0, 0}, {1, 0}, {1, 1}, {2, 1}}, {{0, 0}, {0, 2}, {-2, 2}, {-4, 2}}};
  rig_contour contours[2] = {{0, 2, breaks, NULL, points[0][0]}, {1, 2, breaks, NULL, points[1][0]}};
  loft_slab *slabs = NULL;
  loft_stack stack = rig_stack(ctx, 2, false, 2, contours, 1);
  T_OK(rig_slabs(ctx, &stack, &slabs), ctx);
  const loft_slab *s = &slabs[0];
  double off = 0;
  static const double length[2][3] = {{1, 1, 1}, {2, 2, 2}}, angle[2][3] = {{0, 0.5, 0}, {0.5, 1, 1}};
  for (size_t e = 0; e < 2; e++)
    for (size_t v = 0; v < 3; v++)
      off = fmax(off, fmax(fabs(s->length[e][v] - length[e][v]), fabs(s->angle[e][v] - angle[e][v] * acos(-1))));
  T_RATIO(off, 4 * DBL_EPSILON, "legs by hand: lengths, angles");
  T_CHECK(s->wanted[0] == 1 && s->wanted[1] == LOFT_FREE,
          "both turn left at one, and one of them at the other: %d %d", s->wanted[0], s->wanted[1]);
  T_RATIO(fabs(loft_turn(s, 0, 1) + acos(-1) / 2), 4 * DBL_EPSILON, "a turn to the right");
  double q[2];
  loft_spiral(s, 0, 0.5, q);
  T_RATIO(hypot(q[0] - 1.5 * sqrt(0.5), q[1] - 1.5 * sqrt(0.5)), 4 * DBL_EPSILON, "half of the way");
  loft_slabs_free(ctx, 1, slabs);
  loft_stack_free_rig(ctx, &stack);
}

/* Random polygons that turn by given angles on random knots: legs on the union as differences of its control points,
 * turns as those of legs. */
static void against_differences(batten_context *ctx) {
  double worst = 0, turn_worst = 0, drift = 0;
  size_t wrong = 0, signs = 0;
  for (uint64_t seed = 1; seed <= 40; seed++) {
    unsigned degree = 2 + (unsigned)(seed % 4);
    bool closed = seed % 3 == 0;
    loft_stack stack = rig_random(ctx, seed, degree, closed, 3, 1.0);
    loft_slab *slabs = NULL;
    if (rig_slabs(ctx, &stack, &slabs) < 0) t_line(false, "seed %d: %s", (int)seed, batten_error(ctx));
    for (size_t i = 0; slabs && i + 1 < stack.count; i++) {
      const loft_slab *s = &slabs[i];
      size_t legs = loft_legs(&s->space);
      double mean = 0, total = 0;
      for (unsigned e = 0; e < 2; e++)
        for (size_t v = 0; v < loft_vertices(&s->space); v++) {
          double leg[2][2];
          for (size_t k = 0; k < 2; k++)
            for (size_t c = 0; c < 2; c++)
              leg[k][c] =
                  s->end[e][2 * ((v + k + 1) % s->space.count) + c] - s->end[e][2 * ((v + k) % s->space.count) + c];
          double size = hypot(leg[0][0], leg[0][1]), rounding = DBL_EPSILON / size;
          worst = fmax(worst, fabs(size - s->length[e][v]) / DBL_EPSILON);
          worst = fmax(worst, hypot(leg[0][0] - s->length[e][v] * cos(s->angle[e][v]),
                                    leg[0][1] - s->length[e][v] * sin(s->angle[e][v])) /
                                  DBL_EPSILON);
          rounding += DBL_EPSILON / hypot(leg[1][0], leg[1][1]);
          double turn = atan2(loft_cross(leg[0], leg[1]), leg[0][0] * leg[1][0] + leg[0][1] * leg[1][1]);
          turn_worst = fmax(turn_worst, fabs(turn - loft_turn(s, e, v)) / (rounding + DBL_EPSILON));
          if (fabs(turn) > 40 * rounding && s->wanted[v] != LOFT_FREE && s->wanted[v] != LOFT_FLAT) {
            signs++;
            wrong += (turn > 0) != (s->wanted[v] > 0);
          }
        }
      for (size_t v = 0; v < legs; v++) {
        mean += (s->angle[1][v] - s->angle[0][v]) * (s->length[0][v] + s->length[1][v]);
        total += s->length[0][v] + s->length[1][v];
      }
      drift = fmax(drift, fabs(mean / total));
    }
    loft_slabs_free(ctx, stack.count - 1, slabs);
    loft_stack_free_rig(ctx, &stack);
  }
  T_RATIO(worst, 60, "legs against differences, over the unit of rounding");
  T_RATIO(turn_worst, 60, "turns against differences, over what rounding makes of these");
  T_RATIO(drift, acos(-1), "mean turn from contour to contour");
  T_CHECK(wrong == 0 && signs > 1000, "%zu of %zu signs are wrong", wrong, signs);
}

/* Double knots as near as 1e-11: the leg between them is lost in differences. Polygons on a circle: all turn to the
 * left, also there. */
static void tiny_legs(batten_context *ctx) {
  double shortest = INFINITY;
  for (double apart = 1e-3; apart > 5e-12; apart *= 0.1) {
    double breaks[2][5] = {{0, 0.3, 0.5, 0.8, 1}, {0, 0.2, 0.5 + apart, 0.7, 1}}, points[2][10][2];
    for (size_t e = 0; e < 2; e++)
      for (size_t j = 0; j < 10; j++) {
        double a = 0.2 * (double)j + 0.4 * (double)e;
        points[e][j][0] = cos(a);
        points[e][j][1] = sin(a);
      }
    rig_contour contours[2] = {{0, 4, breaks[0], NULL, points[0][0]}, {1, 4, breaks[1], NULL, points[1][0]}};
    loft_stack stack = rig_stack(ctx, 3, false, 2, contours, 1);
    loft_slab *slabs = NULL;
    if (rig_slabs(ctx, &stack, &slabs) < 0) t_line(false, "%s", batten_error(ctx));
    bool all = true;
    for (size_t v = 0; v < loft_vertices(&slabs->space); v++) {
      all = all && slabs->wanted[v] == 1 && loft_turn(slabs, 0, v) > 0 && loft_turn(slabs, 1, v) > 0;
      shortest = fmin(shortest, slabs->length[0][v]);
    }
    T_CHECK(all, "knots %g apart: all turn to the left", apart);
    loft_slabs_free(ctx, 1, slabs);
    loft_stack_free_rig(ctx, &stack);
  }
  T_RATIO(shortest, 1e-11, "shortest leg");
}

/* Flat points that have a partner, one that has none, straight pieces. */
static void flat_points(batten_context *ctx) {
  static const double breaks[5] = {0, 0.25, 0.5, 0.75, 1};
  static const double bend[7][2] = {{0, 0},       {1.0 / 12, 0.1},  {0.25, 0.16}, {0.5, 0.2},
                                    {0.75, 0.24}, {11.0 / 12, 0.3}, {1, 0.4}};
  double straight[7][2];
  const double greville[7] = {0, 0.25 / 3, 0.25, 0.5, 0.75, 2.75 / 3, 1};
  for (size_t j = 0; j < 7; j++) {
    straight[j][0] = greville[j];
    straight[j][1] = 0.3 * greville[j] + 0.1;
  }
  rig_contour s[3] = {
      {0, 4, breaks, NULL, bend[0]}, {1, 4, breaks, NULL, bend[0]}, {2, 4, breaks, NULL, straight[0]}};
  loft_stack stack = rig_stack(ctx, 3, false, 3, s, 2);
  loft_slab *slabs = NULL;
  T_OK(rig_slabs(ctx, &stack, &slabs), ctx);
  T_CHECK(slabs[0].wanted[0] == -1 && slabs[0].wanted[2] == LOFT_FLAT && slabs[0].wanted[4] == 1,
          "x'' = 0 in both: %d %d %d", slabs[0].wanted[0], slabs[0].wanted[2], slabs[0].wanted[4]);
  bool free = true;
  for (size_t v = 0; v < 5; v++) free = free && slabs[1].wanted[v] == (v == 2 ? LOFT_FLAT : LOFT_FREE);
  T_CHECK(free, "beside a straight contour nothing is kept but what is flat in both");
  loft_slabs_free(ctx, 2, slabs);
  /* The flag alone makes it flat too, where x'' is a little more than rounding. */
  double near[7][2];
  memcpy(near, bend, sizeof near);
  near[3][1] += 1e-8;
  s[1].points = near[0];
  loft_stack_free_rig(ctx, &stack);
  stack = rig_stack(ctx, 3, false, 2, s, 2);
  T_OK(rig_slabs(ctx, &stack, &slabs), ctx);
  T_CHECK(slabs[0].wanted[2] == LOFT_FREE, "x'' of 1e-8 is not 0: %d", slabs[0].wanted[2]);
  loft_slabs_free(ctx, 1, slabs);
  stack.contours[0].flat_above[2] = 1;
  T_OK(rig_slabs(ctx, &stack, &slabs), ctx);
  T_CHECK(slabs[0].wanted[2] == LOFT_FLAT && slabs[0].wanted[1] == -1, "unless it was found to be an inflection's");
  loft_slabs_free(ctx, 1, slabs);
  loft_stack_free_rig(ctx, &stack);
}

/* A leg of length 0 has no direction, its neighbours keep theirs. */
static void zero_leg(batten_context *ctx) {
  static const double breaks[4] = {0, 0.4, 0.6, 1};
  static const double points[2][5][2] = {{{0, 0}, {1, 0}, {1, 0}, {1, 1}, {0, 1}},
                                         {{0, 0}, {1, 0}, {1.5, 0.5}, {1, 1}, {0, 1}}};
  rig_contour c[2] = {{0, 3, breaks, NULL, points[0][0]}, {1, 3, breaks, NULL, points[1][0]}};
  loft_stack stack = rig_stack(ctx, 2, false, 2, c, 1);
  loft_slab *slabs = NULL;
  T_OK(rig_slabs(ctx, &stack, &slabs), ctx);
  T_CHECK(isnan(slabs->angle[0][1]) && slabs->length[0][1] == 0 && !isnan(slabs->angle[0][2]), "a leg of length 0");
  T_CHECK(isnan(loft_turn(slabs, 0, 0)) && isnan(loft_turn(slabs, 0, 1)) && slabs->wanted[0] == LOFT_FREE,
          "has no turns beside it");
  T_RATIO(fabs(slabs->angle[0][2] - acos(-1) / 2), 4 * DBL_EPSILON, "the leg after it");
  double q[2], want = slabs->angle[1][1];
  loft_spiral(slabs, 1, 0.5, q);
  T_RATIO(hypot(q[0] - 0.5 * slabs->length[1][1] * cos(want), q[1] - 0.5 * slabs->length[1][1] * sin(want)),
          4 * DBL_EPSILON, "its spiral has the direction of its partner");
  loft_slabs_free(ctx, 1, slabs);
  loft_stack_free_rig(ctx, &stack);
}

/* Polygons whose first leg turns by more than half a turn while all others turn little. */
static void whole_turns(batten_context *ctx) {
  static const double breaks[6] = {0, 0.02, 0.3, 0.6, 0.8, 1};
  double points[2][7][2] = {{{0}}};
  for (size_t e = 0; e < 2; e++)
    for (size_t v = 0; v < 6; v++) {
      double angle = e == 0 ? 0.2 * (double)v : 0.3 + 0.2 * (double)v + (v == 0 ? -3 : 0) + (v == 1 ? -1 : 0);
      double length = v == 0 ? 0.01 : 0.2;
      points[e][v + 1][0] = points[e][v][0] + length * cos(angle);
      points[e][v + 1][1] = points[e][v][1] + length * sin(angle);
    }
  rig_contour c[2] = {{0, 5, breaks, NULL, points[0][0]}, {1, 5, breaks, NULL, points[1][0]}};
  loft_stack stack = rig_stack(ctx, 2, false, 2, c, 1);
  loft_slab *slabs = NULL;
  T_OK(rig_slabs(ctx, &stack, &slabs), ctx);
  double most = 0;
  for (size_t v = 2; v < 6; v++) most = fmax(most, fabs(slabs->angle[1][v] - slabs->angle[0][v] - 0.3));
  T_RATIO(most, 1e-14, "long legs turn the short way");
  loft_slabs_free(ctx, 1, slabs);
  loft_stack_free_rig(ctx, &stack);
}

/* Degree 1 by z between both polygons of a patch. */
static batten_surface *rule_patch(batten_context *ctx, const loft_slab *slab) {
  const loft_space *s = &slab->space;
  size_t count = 0;
  double *knots = NULL;
  const double heights[4] = {0, 0, 1, 1};
  loft_matrix m = {0};
  batten_surface *out = NULL;
  if (loft_clamped(ctx, s, &count, &knots, &m) < 0) abort();
  double *end = malloc(2 * m.rows * sizeof *end), *points = malloc(6 * m.rows * sizeof *points);
  if (!end || !points) abort();
  for (size_t e = 0; e < 2; e++) {
    loft_matrix_apply(&m, slab->end[e], end);
    for (size_t j = 0; j < m.rows; j++) {
      double *p = points + 3 * (2 * j + e);
      p[0] = end[2 * j];
      p[1] = end[2 * j + 1];
      p[2] = (double)e;
    }
  }
  const batten_surface_form form = {{s->degree, 1}, {count, 4}, {knots, heights}, points};
  if (batten_surface_create(ctx, &form, &out) < 0) abort();
  free(points);
  free(end);
  batten_free(ctx, knots);
  loft_matrix_free(ctx, &m);
  return out;
}

/* Where the proof wants a sign of a span every vertex that acts on it must have been asked to keep it, or be flat. */
static void asked_and_proven(batten_context *ctx) {
  size_t pairs = 0, without = 0;
  for (uint64_t seed = 1; seed <= 120; seed++) {
    loft_rule rule = loft_rule_random(seed);
    if (!rule.unmatched && seed % 4) continue; /* those are the hard ones */
    loft_scene scene = loft_scene_make(ctx, &rule);
    const batten_loft_options opt = batten_loft_options_default();
    loft_stack s = {0};
    loft_slab *slabs = NULL;
    T_OK(loft_stack_make(ctx, scene.count, (const batten_curve *const *)scene.contours, scene.heights, &opt, &s),
         ctx);
    if (loft_shape_prepare(ctx, &s, &opt) < 0 || rig_slabs(ctx, &s, &slabs) < 0) abort();
    for (size_t i = 0; i + 1 < s.count; i++) {
      const loft_space *space = &slabs[i].space;
      batten_surface *patch = rule_patch(ctx, &slabs[i]);
      batten_sections sections;
      signed char *verdicts = malloc(space->spans);
      if (!verdicts || batten_surface_certify_sections(ctx, patch, NULL, &sections, verdicts) < 0) abort();
      for (size_t span = 0; span < space->spans; span++)
        for (size_t k = 0; k + 2 <= s.degree && verdicts[span] != 0; k++) {
          int wanted = slabs[i].wanted[(space->first[span] + k) % loft_vertices(space)];
          pairs += k == 0;
          without += wanted == LOFT_FREE;
        }
      free(verdicts);
      batten_surface_free(patch);
    }
    loft_slabs_free(ctx, s.count - 1, slabs);
    loft_stack_free(ctx, &s);
    loft_scene_free(&scene);
  }
  T_CHECK(pairs > 5000 && without == 0, "%zu span pairs have signs to be proven, %zu free vertices act on them",
          pairs, without);
}

static batten_status run(batten_context *ctx, void *arg) {
  loft_stack stack = rig_random(NULL, 5, 3, true, 3, 1.0);
  loft_slab *slabs = NULL;
  batten_status st = rig_slabs(ctx, &stack, &slabs);
  (void)arg;
  if (st >= 0) loft_slabs_free(ctx, 2, slabs);
  loft_stack_free_rig(NULL, &stack);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  by_hand(ctx);
  against_differences(ctx);
  tiny_legs(ctx);
  flat_points(ctx);
  zero_leg(ctx);
  whole_turns(ctx);
  asked_and_proven(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  t_fail_every_allocation("angles and signs", run, NULL);
  batten_context_free(ctx);
  return t_done();
}
