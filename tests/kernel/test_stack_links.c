/* Components of sections: which overlap, what is noted, pieces; links: sections stay exact, the values between,
 * gradients, bounds. */
#include <string.h>

#include "section/section_inner.h"
#include "stack_scenes.h"
#include "tap.h"

enum { POINTS = 24 };

static batten_context *ctx;

/* A stack that is taken and fitted, with what was found. */
typedef struct found {
  stack s;
  stack_notes notes;
  size_t pieces, non_overlaps;
} found;

static batten_status fit(batten_context *c, stack *s) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < s->count; i++) {
    section_figures figures;
    st = section_fit_loops(c, &s->sections[i].loops, 0.02, 0.75, &s->sections[i].function, &figures);
  }
  return st;
}

static batten_status find(batten_context *c, stack_scene *scene, bool link, bool functions, found *out) {
  batten_stack_options opt = batten_stack_options_default();
  *out = (found){.notes = {.ctx = c}};
  batten_status st = stack_take_sections(c, scene->count, stack_scene_sections(scene), &opt, &out->s, &out->notes);
  if (st >= 0) st = stack_find_components(c, &out->s, link, &out->notes, &out->pieces, &out->non_overlaps);
  if (st >= 0 && functions) st = fit(c, &out->s);
  return st;
}

static void release(found *f) {
  stack_release(&f->s);
  batten_free(f->notes.ctx, f->notes.items);
}

static size_t count_notes(const found *f, batten_stack_note_kind kind) {
  size_t made = 0;
  for (size_t k = 0; k < f->notes.count; k++) made += f->notes.items[k].kind == kind;
  return made;
}

/* ---- components ---------------------------------------------------------------------------------- */

/* Two discs of radius 1 whose centres are s apart. */
static void test_pair(double s, size_t pieces, size_t thin, size_t apart) {
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_disc(&scene, 0, 0, 1, 80);
  stack_scene_slice(&scene, 1);
  stack_scene_disc(&scene, 0.6 * s, -0.8 * s, 1, 80);
  found f;
  T_OK(find(ctx, &scene, false, false, &f), ctx);
  T_CHECK(f.pieces == pieces && count_notes(&f, BATTEN_NOTE_THIN) == thin && f.non_overlaps == apart &&
              count_notes(&f, BATTEN_NOTE_NO_OVERLAP) == apart && f.s.link_count == 0,
          "discs %g apart: %zu pieces", s, f.pieces);
  if (thin > 0) T_RATIO(fabs(f.notes.items[0].value - sqrt(1 - s * s / 4)), 0.02, "what is left of the width");
  if (apart > 0)
    T_CHECK(f.notes.items[0].section == 0 && f.notes.items[0].above && f.notes.items[1].section == 1 &&
                !f.notes.items[1].above && f.notes.items[0].other == SIZE_MAX,
            "the notes name both sides");
  release(&f);
  stack_scene_free(&scene);
}

static void test_pieces(void) {
  stack_scene scene = {0};
  stack_scene_branches(&scene, POINTS);
  found f;
  T_OK(find(ctx, &scene, true, false, &f), ctx);
  T_CHECK(f.pieces == 1 && f.s.link_count == 0 && f.non_overlaps == 0, "one disc to three is one piece");
  release(&f);
  stack_scene_free(&scene);
  scene = (stack_scene){0};
  stack_scene_slice(&scene, 0); /* a ring with an island in its hole, under a disc in the hole alone */
  stack_scene_disc(&scene, 0, 0, 10, 60);
  stack_scene_disc(&scene, 0, 0, 8, 60);
  stack_scene_disc(&scene, 0, 0, 3, POINTS);
  stack_scene_slice(&scene, 1);
  stack_scene_disc(&scene, 1, 0, 4, POINTS);
  T_OK(find(ctx, &scene, false, false, &f), ctx);
  T_CHECK(f.pieces == 2 && f.non_overlaps == 1 && f.notes.items[0].contour == 0, "a ring about what goes on");
  release(&f);
  stack_scene_free(&scene);
}

/* A trunk under two discs beside it, a lobe on the trunk that ends. */
static void slanted(stack_scene *scene) {
  *scene = (stack_scene){0};
  for (int i = 0; i < 5; i++) {
    stack_scene_slice(scene, 2 * i);
    if (i < 3) stack_scene_disc(scene, 0, 0, 2, POINTS);
    if (i >= 3) stack_scene_disc(scene, 4.5, 0, 1.5, POINTS);
    if (i >= 3) stack_scene_disc(scene, -4.5, 1, 1.5, POINTS);
  }
}

static void test_linked(void) {
  stack_scene scene;
  slanted(&scene);
  found f;
  T_OK(find(ctx, &scene, false, false, &f), ctx);
  T_CHECK(f.pieces == 3 && f.non_overlaps == 3, "a slanted branching: %zu pieces, %zu sides without partner",
          f.pieces, f.non_overlaps);
  release(&f);
  T_OK(find(ctx, &scene, true, false, &f), ctx);
  T_CHECK(f.pieces == 1 && f.s.link_count == 2 && f.non_overlaps == 3 && count_notes(&f, BATTEN_NOTE_LINKED) == 3 &&
              f.s.links[0].section == 2 && f.s.links[1].section == 2 && f.s.links[0].loop[1] == 0 &&
              f.s.links[1].loop[1] == 1,
          "links make one piece of it");
  T_CHECK(f.notes.items[0].section == 2 && f.notes.items[0].above && f.notes.items[0].other == 0 &&
              fabs(f.notes.items[0].value - 4.5) < 1e-12,
          "the trunk is joined to the nearest, shift %g", f.notes.items[0].value);
  release(&f);
  stack_scene_free(&scene);
  scene = (stack_scene){0}; /* a lobe that ends beside a trunk that goes on */
  for (int i = 0; i < 4; i++) {
    stack_scene_slice(&scene, i);
    stack_scene_disc(&scene, i == 1 ? 1 : 0, 0, i == 1 ? 3 : 2, POINTS);
    if (i == 2) stack_scene_disc(&scene, 3.3, 0, 0.8, POINTS);
  }
  T_OK(find(ctx, &scene, true, false, &f), ctx);
  T_CHECK(f.pieces == 1 && f.s.link_count == 0 && f.non_overlaps == 1 &&
              count_notes(&f, BATTEN_NOTE_NO_OVERLAP) == 1 && f.notes.items[f.notes.count - 1].above,
          "a lobe's end is noted, not joined");
  release(&f);
  stack_scene_free(&scene);
}

/* ---- links --------------------------------------------------------------------------------------- */

static double section_value(const found *f, size_t i, const double *x) {
  double value = NAN;
  if (stack_section_evaluate(&f->s, ctx, i, 1, x, &value, NULL) < 0) return NAN;
  return value;
}

/* The links' own value: above a floor that nothing falls below. */
static double link_value(const found *f, const double *x, double u, double *gradient) {
  double value = -1e30;
  if (stack_link_evaluate(&f->s, ctx, 2, 1, x, &u, &value, gradient) < 0) return NAN;
  return value;
}

/* By the definition, with the components told apart by their discs. */
static double expected_value(const found *f, const double *x, double u) {
  static const double center[2][2] = {{4.5, 0}, {-4.5, 1}};
  double most = -INFINITY;
  for (int k = 0; k < 2; k++) {
    double y[2] = {x[0] - u * center[k][0], x[1] - u * center[k][1]};
    double z[2] = {x[0] + (1 - u) * center[k][0], x[1] + (1 - u) * center[k][1]};
    double own = 1.5 - hypot(z[0] - center[k][0], z[1] - center[k][1]);
    double other = 1.5 - hypot(z[0] - center[1 - k][0], z[1] - center[1 - k][1]);
    double b = fmin(section_value(f, 3, z), (own - other) / 2);
    most = fmax(most, (1 - u) * section_value(f, 2, y) + u * b);
  }
  return most;
}

static void test_values(const found *f) {
  uint64_t seed = 5;
  double worst = 0, above[2] = {0, 0};
  size_t slope_misses = 0;
  for (int i = 0; i < 400; i++) {
    double x[2] = {-7 + 14 * t_uniform(&seed), -3 + 6 * t_uniform(&seed)}, u = t_uniform(&seed), g[3], h = 1e-6;
    double value = link_value(f, x, u, g);
    /* outlines are polygons of 24 sides: distances differ by their sagitta */
    worst = fmax(worst, fabs(value - expected_value(f, x, u)));
    if (u < 2 * h || u > 1 - 2 * h) continue;
    double difference[3];
    for (int k = 0; k < 3; k++) {
      double p[2] = {x[0] + (k == 0) * h, x[1] + (k == 1) * h}, q[2] = {x[0] - (k == 0) * h, x[1] - (k == 1) * h};
      difference[k] = (link_value(f, p, u + (k == 2) * h, NULL) - link_value(f, q, u - (k == 2) * h, NULL)) / (2 * h);
    }
    double miss = fmax(fabs(g[0] - difference[0]), fmax(fabs(g[1] - difference[1]), fabs(g[2] - difference[2]) / 4));
    slope_misses += miss > 1e-6; /* where a kink lies between, differences tell nothing */
    above[0] = fmax(above[0], link_value(f, x, 1e-12, NULL) - section_value(f, 2, x));
    above[1] = fmax(above[1], link_value(f, x, 1 - 1e-12, NULL) - section_value(f, 3, x));
  }
  T_RATIO(worst, 0.02, "links against their formula, discs for polygons (seed 5)");
  T_RATIO((double)slope_misses, 2, "places of 400 where gradients are not differences");
  T_RATIO(fmax(above[0], above[1]), 1e-10, "links above the sections next to the planes");
  double zero[2] = {0, 0}, values[2] = {-3, -3}, u[2] = {0, 1}, places[4] = {0, 0, 4.5, 0};
  T_OK(stack_link_evaluate(&f->s, ctx, 2, 2, places, u, values, NULL), ctx);
  T_CHECK(values[0] == -3 && values[1] == -3, "on the planes links say nothing");
  T_OK(stack_link_evaluate(&f->s, ctx, 1, 1, zero, &(double){0.5}, values, NULL), ctx);
  T_CHECK(values[0] == -3, "nor between other sections");
  double least = INFINITY;
  for (int i = 1; i < 50; i++) {
    double way = i / 50.0, x[2] = {4.5 * way, 0};
    least = fmin(least, link_value(f, x, way, NULL));
  }
  T_CHECK(least > 0.5, "the link is solid along its middle: %g", least);
}

static void test_bounds(const found *f) {
  enum { BOXES = 300, SAMPLES = 30 };
  uint64_t seed = 9;
  double boxes[6 * BOXES], ranges[2 * BOXES], narrow = 0;
  for (int i = 0; i < BOXES; i++) {
    double size = pow(2, -8 * t_uniform(&seed));
    for (int d = 0; d < 3; d++) {
      double low = d < 2 ? -7 + 14 * t_uniform(&seed) : t_uniform(&seed);
      boxes[6 * i + d] = low;
      boxes[6 * i + 3 + d] = low + size * t_uniform(&seed) * (d < 2 ? 4 : 1);
    }
    ranges[2 * i] = ranges[2 * i + 1] = -INFINITY; /* links alone */
  }
  T_OK(stack_link_bounds(&f->s, ctx, 2, BOXES, boxes, ranges), ctx);
  size_t outside = 0;
  for (int i = 0; i < BOXES; i++) {
    double most = -INFINITY, least = INFINITY, size = 0;
    for (int k = 0; k < SAMPLES; k++) {
      double p[3];
      for (int d = 0; d < 3; d++) {
        double share = k < 8 ? k >> d & 1 : t_uniform(&seed);
        p[d] = boxes[6 * i + d] + share * (boxes[6 * i + 3 + d] - boxes[6 * i + d]);
        size = fmax(size, boxes[6 * i + 3 + d] - boxes[6 * i + d]);
      }
      if (!(p[2] > 0 && p[2] < 1)) continue;
      double value = link_value(f, p, p[2], NULL);
      most = fmax(most, value);
      least = fmin(least, value);
    }
    outside += most > ranges[2 * i + 1] || least < ranges[2 * i];
    if (size < 0.02 && boxes[6 * i + 5] <= 1)
      narrow = fmax(narrow, (ranges[2 * i + 1] - most + least - ranges[2 * i]) / size);
  }
  T_CHECK(outside == 0, "%zu of %d boxes have links outside of their bounds (seed 9)", outside, BOXES);
  T_RATIO(narrow, 4, "bounds of small boxes beyond the values within, over the size");
  double above[2] = {ranges[1] + 1, ranges[1] + 2}, before[2] = {3, 4};
  T_OK(stack_link_bounds(&f->s, ctx, 2, 1, boxes, above), ctx);
  T_CHECK(above[0] == ranges[1] + 1 && above[1] == ranges[1] + 2, "links below what is there change nothing");
  T_OK(stack_link_bounds(&f->s, ctx, 0, 1, boxes, before), ctx);
  T_CHECK(before[0] == 3 && before[1] == 4, "no links, no change");
}

/* Origins of planes that differ across the normal move nothing. */
static void test_shifted_origins(const found *f) {
  stack_scene scene;
  slanted(&scene);
  stack_scene_sections(&scene);
  size_t at = 0;
  for (size_t i = 0; i < scene.count; i++) {
    size_t points = scene.sections[i].starts[scene.sections[i].contour_count];
    double way[2] = {0.25 * (double)i, -0.5 * (double)(i * i)};
    for (size_t k = 0; k < points; k++, at++)
      for (size_t d = 0; d < 2; d++) scene.at[2 * at + d] -= way[d];
    for (size_t d = 0; d < 2; d++) scene.sections[i].origin[d] += way[d];
  }
  found moved;
  T_OK(find(ctx, &scene, true, true, &moved), ctx);
  T_CHECK(moved.pieces == 1 && moved.s.link_count == 2, "the same links");
  uint64_t seed = 3;
  double worst = 0;
  for (int i = 0; i < 100; i++) {
    double x[2] = {-7 + 14 * t_uniform(&seed), -3 + 6 * t_uniform(&seed)}, u = t_uniform(&seed);
    worst = fmax(worst, fabs(link_value(f, x, u, NULL) - link_value(&moved, x, u, NULL)));
  }
  T_RATIO(worst, 1e-9, "values with origins elsewhere");
  release(&moved);
  stack_scene_free(&scene);
}

static batten_status find_and_release(batten_context *c, void *arg) {
  found f;
  batten_status st = find(c, arg, true, false, &f);
  release(&f);
  return st;
}

static batten_status evaluate_and_bound(batten_context *c, void *arg) {
  const found *f = arg;
  double places[4] = {1, 0, 2, 0}, u[2] = {0.4, 0.6}, values[2] = {-9, -9}, gradients[6], range[2] = {-9, -9};
  double box[6] = {0, 0, 0.2, 1, 1, 0.6};
  batten_status st = stack_link_evaluate(&f->s, c, 2, 2, places, u, values, gradients);
  return st < 0 ? st : stack_link_bounds(&f->s, c, 2, 1, box, range);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_pair(1, 1, 0, 0);
  test_pair(1.4, 1, 0, 0);
  test_pair(1.7, 1, 2, 0);
  test_pair(1.9, 1, 2, 0);
  test_pair(2.2, 2, 0, 2);
  test_pieces();
  test_linked();
  stack_scene scene;
  slanted(&scene);
  found f;
  T_OK(find(ctx, &scene, true, true, &f), ctx);
  test_values(&f);
  test_bounds(&f);
  test_shifted_origins(&f);
  t_fail_every_allocation("stack_find_components", find_and_release, &scene);
  t_fail_every_allocation("stack_link_evaluate and _bounds", evaluate_and_bound, &f);
  release(&f);
  stack_scene_free(&scene);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is given back");
  batten_context_free(ctx);
  return t_done();
}
