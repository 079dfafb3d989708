/* F(x, y, t) and f in space of parallel stacks: by hand, section by section, in any order, turned, ends, bounds. */
#include "stack_rig.h"

static const char *const names[5] = {"natural", "not-a-knot", "monotone", "linear", "rational"};
static const char *const rules[4] = {"flat", "plane", "rounded", "open"};

static batten_stack_options plain(void) {
  batten_stack_options o = batten_stack_options_default();
  o.saturation = INFINITY;
  return o;
}
static double at(batten_context *ctx, const stack *s, double x, double y, double z) {
  double p[3] = {x, y, z}, f = NAN;
  return stack_parallel_evaluate(s, ctx, 1, p, &f, NULL) >= 0 ? f : NAN;
}

static void test_by_hand(batten_context *ctx) {
  const double radii[2] = {1, 3};
  stack_scene scene = {0};
  stack s;
  stack_scene_discs(&scene, 2, radii, 1, 32);
  batten_stack_options o = plain();
  o.between = BATTEN_BETWEEN_LINEAR;
  T_OK(rig_exact(ctx, &scene, &o, &s), ctx);
  T_RATIO(fabs(at(ctx, &s, 2, 0, 0.5)) + fabs(at(ctx, &s, 0, 1, 0.25) - 0.5), 1e-14, "a cone from radius 1 to 3");
  rig_release(&s);
  o.saturation = 2; /* of one gap: w = 2 */
  T_OK(rig_exact(ctx, &scene, &o, &s), ctx);
  double f = 2 * (0.5 * tanh(-2.0 / 2) + 0.5 * tanh(0.0));
  T_RATIO(fabs(at(ctx, &s, 3, 0, 0.5) - f), 1e-14, "the same, saturated");
  rig_release(&s);
  o.saturation = INFINITY;
  const double scales[2] = {3, 1};
  o.scales = scales;
  T_OK(rig_exact(ctx, &scene, &o, &s), ctx);
  T_RATIO(fabs(at(ctx, &s, 1.5, 0, 0.5)), 1e-14, "and drawn to the first section by a scale of 3");
  rig_release(&s);
  stack_scene_free(&scene);
}

/* Ends of a disc under R - r and of two discs of unlike size. */
static void test_ends(batten_context *ctx) {
  const double radii[3] = {2, 3, 2};
  stack_scene scene = {0}, two = {0};
  stack s;
  stack_scene_discs(&scene, 3, radii, 1, 32);
  for (int rule = 0; rule < 4; rule++) {
    batten_stack_options o = plain();
    o.ends[0] = o.ends[1] = (batten_stack_end)rule;
    o.end_height[0] = 0.8;
    o.end_height[1] = 1.5;
    T_OK(rig_exact(ctx, &scene, &o, &s), ctx);
    double worst = 0, jump = 0;
    for (int end = 0; end < 2; end++)
      for (int i = 0; i <= 40; i++) {
        double x = 0.1 * i, side = end ? 1 : -1, base = end ? 2 : 0, h = rule == 1 ? 0 : end ? 1.5 : 0.8;
        for (int k = 0; k <= 10; k++) {
          double beyond = 0.2 * k, f = 2 - x, got = at(ctx, &s, x, 0, base + side * beyond);
          double expected = rule < 2 ? fmin(f, h - beyond) : rule == 2 ? f - 2 * (beyond / h) * (beyond / h) : f;
          worst = fmax(worst, fabs(got - expected));
        }
        jump = fmax(jump, fabs(at(ctx, &s, x, 0, base - side * 1e-9) - at(ctx, &s, x, 0, base + side * 1e-9)));
      }
    T_RATIO(worst, rule == 2 ? 1e-3 : 1e-14, "%s ends of discs by hand (rho found on grids)", rules[rule]);
    T_RATIO(jump, 2e-8, "  without a jump at the plane");
    rig_release(&s);
  }
  stack_scene_free(&scene);

  for (int i = 0; i < 2; i++) {
    stack_scene_slice(&two, i);
    stack_scene_disc(&two, 0, 0, 2, 64);
    stack_scene_disc(&two, 0, 0, 1.2, 64);
    stack_scene_disc(&two, 0, 0, 0.5, 64);
    stack_scene_disc(&two, 4, 0, 1, 64);
  }
  batten_stack_options o = plain();
  o.ends[0] = o.ends[1] = BATTEN_END_ROUNDED;
  T_OK(rig_fit(ctx, &two, &o, &s), ctx);
  /* rings and discs close at H = 1 where they are thickest: at r = 1.6 of the ring, middles of the discs */
  const double middles[3] = {1.6, 0, 4};
  for (int k = 0; k < 3; k++) {
    double f = at(ctx, &s, middles[k], 0, 1);
    T_RATIO(fabs(at(ctx, &s, middles[k], 0, 1.5) - 0.75 * f), 0.05 * f, "component %d: half-way in its rounded end",
            k);
    T_RATIO(fabs(at(ctx, &s, middles[k], 0, 2)), 0.05 * f, "  and closed at its height");
  }
  double jump = 0, before = at(ctx, &s, -3, 0.1, 1.7), worst = 0;
  for (int i = 1; i <= 4000; i++) {
    double f = at(ctx, &s, -3 + 9e-3 * i / 4, 0.1, 1.7);
    jump = fmax(jump, fabs(f - before));
    before = f;
  }
  T_RATIO(jump, 0.02, "rounded ends of several components are continuous: largest step over 0.00225");
  uint64_t seed = 2;
  for (int i = 0; i < 300; i++) {
    double p[3] = {8 * t_uniform(&seed) - 2.5, 5 * t_uniform(&seed) - 2.5, 3 * t_uniform(&seed) - 1}, g[3], h = 1e-6;
    stack_parallel_evaluate(&s, ctx, 1, p, NULL, g);
    for (int k = 0; k < 3; k++) {
      double q[3] = {p[0], p[1], p[2]}, a, b;
      q[k] += h;
      a = at(ctx, &s, q[0], q[1], q[2]);
      q[k] -= 2 * h;
      b = at(ctx, &s, q[0], q[1], q[2]);
      worst = fmax(worst, fabs((a - b) / (2 * h) - g[k]));
    }
  }
  T_RATIO(worst, 1e-5, "  and their gradients are those of differences");
  rig_release(&s);
  stack_scene_free(&two);

  /* a cone: a disc, and a point as the last section */
  stack_scene_slice(&two, 0);
  stack_scene_disc(&two, 0, 0, 1, 32);
  stack_scene_slice(&two, 1);
  stack_scene_loop(&two, 1, (double[2]){0, 0});
  o = plain();
  o.apex = 1;
  o.between = BATTEN_BETWEEN_LINEAR;
  T_OK(rig_exact(ctx, &two, &o, &s), ctx);
  T_RATIO(
      fabs(at(ctx, &s, 0.5, 0, 0.5)) + fabs(at(ctx, &s, 0, 0.25, 0.5) - 0.25) + fabs(at(ctx, &s, 0, 0, 1.25) + 0.25),
      1e-14, "a cone with its tip as the last section");
  rig_release(&s);
  stack_scene_free(&two);
}

/* Places of a grid and loose ones, all over the stack, sections among them. */
static size_t make_places(const stack *s, double *places) {
  uint64_t seed = 4;
  size_t made = 0;
  for (int i = 0; i < 600; i++, made++) {
    double *p = places + 3 * made, t0 = s->sections[0].t, t1 = s->sections[s->count - 1].t;
    for (int k = 0; k < 2; k++) p[k] = 20 * t_uniform(&seed) - 4;
    p[2] = t0 + (t1 - t0) * t_uniform(&seed);
    if (i % 3 == 0) p[0] = -4 + i % 5 * 3, p[1] = -4 + i % 4 * 3; /* columns */
    if (i % 7 == 0) p[2] = s->sections[(size_t)i % s->count].t;
  }
  return made;
}

static void test_blend(batten_context *ctx, int kind) {
  enum { PLACES = 600 };
  static double places[3 * PLACES], values[PLACES], gradients[3 * PLACES], turned[3 * PLACES], again[PLACES];
  stack_scene scene = {0};
  stack s;
  batten_stack_options o = batten_stack_options_default();
  o.between = (batten_stack_between)kind;
  o.shape = 1.7;
  stack_scene_random(&scene, 3, 40, 30);
  T_OK(rig_fit(ctx, &scene, &o, &s), ctx);
  size_t count = make_places(&s, places);
  T_OK(stack_blend(&s, ctx, count, places, values, gradients), ctx);
  double worst = 0, worst_gradient = 0, h = 4e-6; /* values have 1e-12 of rounding */
  size_t exact = 0, planes = 0;
  for (size_t i = 0; i < count; i++) {
    const double *p = places + 3 * i;
    double f[STACK_WINDOW];
    size_t first, window = stack_window(s.weights, p[2], &first);
    for (size_t k = 0; k < window; k++) {
      stack_section_evaluate(&s, ctx, first + k, 1, p, &f[k], NULL);
      if (s.sections[first + k].t == p[2]) planes++, exact += f[k] == values[i];
    }
    worst = fmax(worst, fabs(stack_weigh(s.weights, p[2], f, NULL, NULL) - values[i]));
    if (i % 7 == 0) continue; /* on planes monotone blends may have a kink */
    for (int k = 0; k < 3; k++) {
      double two[6] = {p[0], p[1], p[2], p[0], p[1], p[2]}, v[2];
      two[k] -= h, two[3 + k] += h;
      stack_blend(&s, ctx, 2, two, v, NULL);
      worst_gradient = fmax(worst_gradient, fabs((v[1] - v[0]) / (2 * h) - gradients[3 * i + (size_t)k]));
    }
  }
  T_CHECK(exact == planes && planes > 50, "%s: %zu of %zu places on sections have their value to the bit",
          names[kind], exact, planes);
  T_RATIO(worst, 0, "  batches against one place and one section at a time");
  T_RATIO(worst_gradient, 3e-7, "  gradients against differences");
  for (size_t i = 0; i < count; i++) memcpy(turned + 3 * i, places + 3 * (count - 1 - i), 3 * sizeof *turned);
  batten_context *two = t_context(NULL, NULL, 2);
  stack_blend(&s, two, count, turned, again, NULL);
  size_t differ = 0;
  for (size_t i = 0; i < count; i++) differ += again[i] != values[count - 1 - i];
  T_CHECK(differ == 0, "  same bits in another order, on two threads");
  batten_context_free(two);
  rig_release(&s);
  stack_scene_free(&scene);
}

/* Turned as a whole, and with origins shifted across while the loops are shifted back. */
static void test_frames(batten_context *ctx) {
  enum { PLACES = 300 };
  static double p[3 * PLACES], q[3 * PLACES], f[PLACES], g[PLACES], df[3 * PLACES], dg[3 * PLACES];
  const double axis[3] = {1, -2, 0.5};
  double turn[9], worst = 0, worst_gradient = 0, worst_shift = 0;
  stack_scene scene = {0}, turned = {0}, shifted = {0};
  stack s, t, u;
  batten_stack_options o = batten_stack_options_default();
  o.ends[1] = BATTEN_END_ROUNDED;
  stack_scene_branches(&scene, 24);
  stack_scene_branches(&turned, 24);
  stack_scene_rotation(axis, 2.6, turn);
  stack_scene_turn(&turned, turn);
  for (size_t i = 0; i < scene.count; i++) { /* by powers of two: to the bit */
    const double origin[3] = {(double)(i * 8), -4.0 * (double)(i % 2), scene.sections[i].origin[2]};
    stack_scene_section(&shifted, origin, NULL);
    for (size_t k = scene.section_loops[i]; k < scene.section_loops[i + 1]; k++) {
      size_t n = scene.loop_points[k + 1] - scene.loop_points[k];
      double *x = stack_scene_grow(NULL, 2 * n * sizeof *x);
      memcpy(x, scene.at + 2 * scene.loop_points[k], 2 * n * sizeof *x);
      for (size_t j = 0; j < n; j++) x[2 * j] -= origin[0], x[2 * j + 1] -= origin[1];
      stack_scene_loop(&shifted, n, x);
      free(x);
    }
  }
  T_OK(rig_fit(ctx, &scene, &o, &s), ctx);
  T_OK(rig_fit(ctx, &turned, &o, &t), ctx);
  T_OK(rig_fit(ctx, &shifted, &o, &u), ctx);
  uint64_t seed = 9;
  for (size_t i = 0; i < PLACES; i++) {
    for (size_t k = 0; k < 3; k++) p[3 * i + k] = 36 * t_uniform(&seed) - (k == 2 ? 8 : 18);
    memcpy(q + 3 * i, p + 3 * i, 3 * sizeof *q);
    stack_scene_turn_vector(turn, q + 3 * i);
  }
  T_OK(stack_parallel_evaluate(&s, ctx, PLACES, p, f, df), ctx);
  T_OK(stack_parallel_evaluate(&t, ctx, PLACES, q, g, dg), ctx);
  for (size_t i = 0; i < PLACES; i++) {
    worst = fmax(worst, fabs(f[i] - g[i]));
    stack_scene_turn_vector(turn, df + 3 * i);
    for (size_t k = 0; k < 3; k++) worst_gradient = fmax(worst_gradient, fabs(df[3 * i + k] - dg[3 * i + k]));
  }
  T_CHECK(s.parallel && t.parallel && u.parallel, "all three stacks are parallel");
  T_RATIO(worst, 1e-9, "turned as a whole, f turns along");
  T_RATIO(worst_gradient, 1e-8, "  so does its gradient");
  T_OK(stack_parallel_evaluate(&u, ctx, PLACES, p, g, NULL), ctx);
  for (size_t i = 0; i < PLACES; i++) worst_shift = fmax(worst_shift, fabs(f[i] - g[i]));
  T_RATIO(worst_shift, 1e-9, "origins and loops shifted against each other leave f as it is");
  rig_release(&s);
  rig_release(&t);
  rig_release(&u);
  stack_scene_free(&scene);
  stack_scene_free(&turned);
  stack_scene_free(&shifted);
}

static void test_bounds(batten_context *ctx, int kind, int rule, bool exact) {
  enum { BOXES = 400, TRIES = 24 };
  static double boxes[6 * BOXES], ranges[2 * BOXES], p[3 * TRIES * BOXES], f[TRIES * BOXES];
  const double axis[3] = {0.3, 0.2, -1}, radii[7] = {2, 3, 3.5, 2, 1, 2, 2.5};
  stack_scene scene = {0};
  stack s;
  batten_stack_options o = batten_stack_options_default();
  double turn[9];
  o.between = (batten_stack_between)kind;
  o.ends[0] = o.ends[1] = (batten_stack_end)rule;
  if (exact)
    stack_scene_discs(&scene, 7, radii, 1, 32);
  else
    stack_scene_random(&scene, 17, 12, 24);
  stack_scene_rotation(axis, 0.2 * rule, turn);
  stack_scene_turn(&scene, turn);
  T_OK(exact ? rig_exact(ctx, &scene, &o, &s) : rig_fit(ctx, &scene, &o, &s), ctx);
  uint64_t seed = 21;
  double narrow = 0;
  for (size_t i = 0; i < BOXES; i++) {
    double size = 12 * pow(0.5, 11 * t_uniform(&seed)), *box = boxes + 6 * i;
    for (size_t k = 0; k < 3; k++) {
      box[k] = 16 * t_uniform(&seed) - 4;
      if (i % 5 == 1) box[k] = floor(box[k]);
      box[3 + k] = box[k] + size;
    }
    if (i % 4 == 1) memcpy(box, box - 6, 6 * sizeof *box), box[2] += 1, box[5] += 1; /* above the one before */
    for (size_t j = 0; j < TRIES; j++)
      for (size_t k = 0; k < 3; k++) {
        double u = t_uniform(&seed);
        u = j < 8 ? (double)((j >> k) & 1) : u;
        p[3 * (i * TRIES + j) + k] = fmin(box[k] + (box[3 + k] - box[k]) * u, box[3 + k]);
      }
  }
  T_OK(stack_parallel_bounds(&s, ctx, BOXES, boxes, ranges), ctx);
  T_OK(stack_parallel_evaluate(&s, ctx, (size_t)TRIES * BOXES, p, f, NULL), ctx);
  size_t outside = 0, told = 0, seen = 0;
  for (size_t i = 0; i < BOXES; i++) {
    double low = INFINITY, high = -INFINITY;
    for (size_t j = i * TRIES; j < (i + 1) * TRIES; j++) {
      outside += !(f[j] >= ranges[2 * i] && f[j] <= ranges[2 * i + 1]);
      low = fmin(low, f[j]), high = fmax(high, f[j]);
    }
    told += ranges[2 * i] > 0 || ranges[2 * i + 1] < 0;
    if (high - low < 0.05 * (boxes[6 * i + 3] - boxes[6 * i])) continue; /* saturated */
    narrow += (ranges[2 * i + 1] - ranges[2 * i]) / (high - low);
    seen++;
  }
  T_CHECK(outside == 0, "%s, %s%s: %zu of %d values outside of bounds", names[kind], rules[rule],
          exact ? ", exact discs" : "", outside, TRIES * BOXES);
  T_RATIO(narrow / (double)seen, exact ? 2.5 : 6,
          "  which are so many times as wide as what was seen; %zu of %d boxes are decided", told, BOXES);
  rig_release(&s);
  stack_scene_free(&scene);
}

/* Discs in a slanted row that do not overlap: joined by links, which leave the sections as they are. */
static void test_links(batten_context *ctx) {
  enum { PLACES = 2000, BOXES = 200, TRIES = 20 };
  static double p[3 * PLACES], f[PLACES], g[PLACES], gradients[3 * PLACES], boxes[6 * BOXES], ranges[2 * BOXES];
  stack_scene scene = {0};
  stack s;
  stack_notes notes = {.ctx = ctx};
  size_t pieces = 0, apart = 0, same = 0, planes = 0, outside = 0;
  batten_stack_options o = batten_stack_options_default();
  stack_scene_shifted(&scene, 4, 1, 3, 2, 32);
  T_OK(rig_exact(ctx, &scene, &o, &s), ctx);
  uint64_t seed = 8;
  for (size_t i = 0; i < PLACES; i++) {
    p[3 * i] = 13 * t_uniform(&seed) - 2;
    p[3 * i + 1] = 4 * t_uniform(&seed) - 2;
    p[3 * i + 2] = i % 4 == 0 ? (double)(i % 8) / 4 * 2 : 6 * t_uniform(&seed);
  }
  double before = at(ctx, &s, 1.5, 0, 1), worst = 0, h = 1e-6;
  T_OK(stack_blend(&s, ctx, PLACES, p, f, NULL), ctx);
  T_OK(stack_find_components(ctx, &s, true, &notes, &pieces, &apart), ctx);
  T_CHECK(s.link_count == 3 && before < 0 && at(ctx, &s, 1.5, 0, 1) > 0, "three links; half-way %.3f becomes %.3f",
          before, at(ctx, &s, 1.5, 0, 1));
  T_OK(stack_blend(&s, ctx, PLACES, p, g, gradients), ctx);
  for (size_t i = 0; i < PLACES; i++) {
    if (i % 4 == 0) planes++, same += f[i] == g[i];
    if (i % 4 == 0 || i > 800 || fabs(p[3 * i + 1]) < 0.01) continue;
    double two[6], v[2];
    for (size_t k = 0; k < 3; k++) {
      memcpy(two, p + 3 * i, 3 * sizeof *two);
      memcpy(two + 3, p + 3 * i, 3 * sizeof *two);
      two[k] -= h, two[3 + k] += h;
      stack_blend(&s, ctx, 2, two, v, NULL);
      double off = fabs((v[1] - v[0]) / (2 * h) - gradients[3 * i + k]);
      if (off > 1e-4) outside++; /* a kink between */
      if (off <= 1e-4) worst = fmax(worst, off);
    }
  }
  T_CHECK(same == planes, "  %zu of %zu places in the planes keep their bits", same, planes);
  T_CHECK(outside <= 2, "  gradients against differences: %.2g, and %zu at kinks", worst, outside);
  for (size_t i = 0; i < BOXES; i++)
    for (size_t k = 0; k < 3; k++) {
      boxes[6 * i + k] = p[3 * i + k];
      boxes[6 * i + 3 + k] = fmin(p[3 * i + k] + t_uniform(&seed), k == 2 ? 6 : 20);
    }
  T_OK(stack_blend_bounds(&s, ctx, BOXES, boxes, ranges), ctx);
  outside = 0;
  for (int j = 0; j < TRIES; j++) {
    for (size_t i = 0; i < 3 * BOXES; i++) {
      const double *box = boxes + 6 * (i / 3) + i % 3;
      p[i] = fmin(box[0] + (box[3] - box[0]) * t_uniform(&seed), box[3]);
    }
    stack_blend(&s, ctx, BOXES, p, f, NULL);
    for (size_t i = 0; i < BOXES; i++) outside += !(f[i] >= ranges[2 * i] && f[i] <= ranges[2 * i + 1]);
  }
  T_CHECK(outside == 0, "  %zu of %d values outside of bounds", outside, BOXES * TRIES);
  batten_free(ctx, notes.items);
  rig_release(&s);
  stack_scene_free(&scene);
}

static stack *shared;
static batten_status call_all(batten_context *ctx, void *arg) {
  const double p[6] = {1, 0, 1, 1, 2, -1}, box[6] = {0, 0, 0, 1, 1, 1};
  double f[2], g[6], range[2];
  (void)arg;
  batten_status st = stack_parallel_evaluate(shared, ctx, 2, p, f, g);
  return st < 0 ? st : stack_parallel_bounds(shared, ctx, 1, box, range);
}
static batten_status call_prepare(batten_context *ctx, void *arg) {
  stack_scene *scene = arg;
  batten_stack_options o = plain();
  stack s;
  o.ends[1] = BATTEN_END_ROUNDED;
  batten_status st = rig_exact(ctx, scene, &o, &s);
  rig_release(&s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_by_hand(ctx);
  test_ends(ctx);
  for (int kind = 0; kind < 5; kind++) test_blend(ctx, kind);
  test_frames(ctx);
  for (int kind = 0; kind < 5; kind++) {
    test_bounds(ctx, kind, kind % 4, false);
    test_bounds(ctx, kind, (kind + 2) % 4, true);
  }
  test_links(ctx);
  const double radii[3] = {2, 3, 2.5};
  stack_scene scene = {0};
  stack s;
  batten_stack_options o = plain();
  stack_scene_discs(&scene, 3, radii, 1, 16);
  T_OK(rig_exact(ctx, &scene, &o, &s), ctx);
  shared = &s;
  t_fail_every_allocation("evaluating and bounding a stack", call_all, NULL);
  t_fail_every_allocation("preparing a stack", call_prepare, &scene);
  rig_release(&s);
  stack_scene_free(&scene);
  batten_context_free(ctx);
  return t_done();
}
