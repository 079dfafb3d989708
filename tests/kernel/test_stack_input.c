/* Sections as they come, and the options of stacks: defaults, what is settled from them, and each thing that makes no
 * sense with its text. */
#include <string.h>

#include "section/section_inner.h"
#include "tap.h"

static const double PI = 3.14159265358979323846;

enum { SECTIONS = 5, SIDE = 12, CONTOURS = 3 };

/* Regular polygons over each other: changed by tests before they are given. */
typedef struct scene {
  batten_section sections[SECTIONS];
  size_t starts[SECTIONS][CONTOURS + 1];
  double points[SECTIONS][CONTOURS * SIDE][2];
} scene;

static void ring(size_t n, double x, double y, double r, double (*points)[2]) {
  for (size_t i = 0; i < n; i++) {
    double a = 2 * PI * (double)i / (double)n;
    points[i][0] = x + r * cos(a);
    points[i][1] = y + r * sin(a);
  }
}

/* Heights 0, 1, 2, 4, 5; one ring of radius 3 each. */
static void reset(scene *s) {
  static const double heights[SECTIONS] = {0, 1, 2, 4, 5};
  for (size_t i = 0; i < SECTIONS; i++) {
    s->sections[i] = (batten_section){.origin = {0, 0, heights[i]},
                                      .rotation = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                      .contour_count = 1,
                                      .starts = s->starts[i],
                                      .points = s->points[i][0]};
    for (size_t k = 0; k <= CONTOURS; k++) s->starts[i][k] = k * SIDE;
    for (size_t k = 0; k < CONTOURS; k++) ring(SIDE, k == 2 ? 10 : 0, 0, k == 1 ? 1 : 3, s->points[i] + k * SIDE);
  }
}

static batten_context *ctx;

static void release(stack *s, stack_notes *notes) {
  stack_release(s);
  batten_free(notes->ctx, notes->items);
}

/* Takes the sections, and leaves nothing. */
static batten_status attempt_count(batten_context *c, const scene *s, size_t count, const batten_stack_options *opt) {
  stack out = {0};
  stack_notes notes = {.ctx = c};
  batten_status st = stack_check_options(c, count, opt);
  if (st >= 0) st = stack_take_sections(c, count, s->sections, opt, &out, &notes);
  release(&out, &notes);
  return st;
}
static batten_status attempt(const scene *s, const batten_stack_options *opt) {
  return attempt_count(ctx, s, SECTIONS, opt);
}

static void turn_about_y(batten_section *g, double angle) {
  double m[3][3] = {{cos(angle), 0, -sin(angle)}, {0, 1, 0}, {sin(angle), 0, cos(angle)}};
  memcpy(g->rotation, m, sizeof m);
}

/* ---- what is settled ----------------------------------------------------------------------------- */

static void test_settled(void) {
  scene s;
  reset(&s);
  s.sections[1].contour_count = 3;
  s.starts[1][3] = s.starts[1][2] + 2; /* two points of the third */
  s.points[3][0][0] = s.points[3][1][0];
  s.points[3][0][1] = s.points[3][1][1]; /* a point twice */
  batten_stack_options opt = batten_stack_options_default();
  double scales[SECTIONS] = {1, 2, 3, 4, 5}, omega[3 * SECTIONS] = {0};
  omega[7] = 3;
  opt.scales = scales;
  opt.angular_velocity = omega;
  opt.ends[1] = BATTEN_END_ROUNDED;
  stack out = {0};
  stack_notes notes = {.ctx = ctx};
  T_OK(stack_take_sections(ctx, SECTIONS, s.sections, &opt, &out, &notes), ctx);
  T_CHECK(out.parallel && out.gap == 1, "parallel, median gap %g", out.gap);
  T_RATIO(fabs(out.spacing - 6 * sin(PI / SIDE)), 1e-15, "median distance of points");
  T_CHECK(out.sections[3].t == 4 && out.sections[4].t == 5, "t is the height");
  T_CHECK(out.sections[0].saturation == 2 && out.sections[2].saturation == 2 && out.sections[3].saturation == 2,
          "saturation by the shorter gap beside");
  T_CHECK(out.end_lengths[0] == 0.5 && out.end_lengths[1] == 1, "half a gap of flat ends, a gap of rounded ones");
  T_CHECK(out.sections[4].scale == 5 && out.angular_velocity[7] == 3, "scales and velocities are copied");
  T_CHECK(out.sections[1].loops.count == 2 && out.sections[1].loops.depth[1] == 1 &&
              out.sections[3].loops.starts[1] == SIDE - 1,
          "a hole, and a point that is given twice");
  T_CHECK(notes.count == 1 && notes.items[0].kind == BATTEN_NOTE_DROPPED && notes.items[0].section == 1 &&
              notes.items[0].contour == 2 && notes.items[0].value == 0,
          "the contour of two points is noted");
  release(&out, &notes);

  /* The same in the coordinates of any plane, by another unit: nothing changes but rounding. */
  scene moved;
  reset(&moved);
  const double axis[3] = {0.48, 0.64, 0.6}; /* rotation by pi about it, a frame that is exact but for rounding */
  for (size_t i = 0; i < SECTIONS; i++) {
    double way[3] = {s.sections[i].origin[0], s.sections[i].origin[1], s.sections[i].origin[2]};
    for (size_t r = 0; r < 3; r++) {
      for (size_t k = 0; k < 3; k++) moved.sections[i].rotation[r][k] = 2 * axis[r] * axis[k] - (r == k);
      moved.sections[i].origin[r] = 5 + 1024 * (2 * axis[r] * axis[2] * way[2] - (r == 2 ? way[2] : 0));
    }
    for (size_t k = 0; k < SIDE; k++)
      for (size_t d = 0; d < 2; d++) moved.points[i][k][d] *= 1024;
  }
  out = (stack){0};
  notes = (stack_notes){.ctx = ctx};
  T_OK(stack_take_sections(ctx, SECTIONS, moved.sections, &opt, &out, &notes), ctx);
  T_RATIO(fabs(out.sections[4].t - 5 * 1024), 1e-11, "t in a turned frame of reference");
  T_CHECK(out.parallel, "still parallel");
  release(&out, &notes);
}

static void test_bent(void) {
  scene s;
  reset(&s);
  for (size_t i = 0; i < SECTIONS; i++) { /* along a quarter of a circle of radius 20 about y */
    double a = PI / 8 * (double)i;
    turn_about_y(&s.sections[i], a);
    s.sections[i].origin[0] = 20 - 20 * cos(a);
    s.sections[i].origin[2] = 20 * sin(a);
  }
  batten_stack_options opt = batten_stack_options_default();
  stack out = {0};
  stack_notes notes = {.ctx = ctx};
  T_OK(stack_take_sections(ctx, SECTIONS, s.sections, &opt, &out, &notes), ctx);
  T_RATIO(fabs(out.sections[4].t - 4 * 40 * sin(PI / 16)), 1e-13, "t is the sum of chords");
  T_CHECK(!out.parallel && out.count == SECTIONS, "not parallel");
  release(&out, &notes);
  /* All frames at the centre of the circle: the middles of the sections tell the way. */
  for (size_t i = 0; i < SECTIONS; i++) {
    s.sections[i].origin[0] = 20;
    s.sections[i].origin[2] = 0;
    for (size_t k = 0; k < SIDE; k++) s.points[i][k][0] -= 20;
  }
  out = (stack){0};
  notes = (stack_notes){.ctx = ctx};
  T_OK(stack_take_sections(ctx, SECTIONS, s.sections, &opt, &out, &notes), ctx);
  T_RATIO(fabs(out.sections[4].t - 4 * 40 * sin(PI / 16)), 1e-13, "the same with one origin for all");
  release(&out, &notes);
  opt.route = BATTEN_ROUTE_SECTIONS;
  for (size_t i = 0; i < SECTIONS; i++)
    for (size_t k = 0; k < SIDE; k++) s.points[i][k][0] += 20;
  T_STATUS(attempt(&s, &opt), BATTEN_E_INVALID, ctx,
           "sections[1].origin: that of sections[0]; give opt.parameters, or origins apart");
  const double parameters[SECTIONS] = {0, 1, 2, 3, 4};
  opt.parameters = parameters;
  T_OK(attempt(&s, &opt), ctx);
}

static void test_apex(void) {
  scene s;
  reset(&s);
  s.starts[0][1] = 1;
  s.starts[4][1] = 3;
  s.points[4][2][0] = s.points[4][0][0];
  s.points[4][2][1] = s.points[4][0][1];
  batten_stack_options opt = batten_stack_options_default();
  T_STATUS(attempt(&s, &opt), BATTEN_E_INVALID, ctx,
           "sections[0].contours[0]: 1 point; give at least 3, or set opt.apex to end the solid there");
  opt.apex = 1;
  stack out = {0};
  stack_notes notes = {.ctx = ctx};
  T_OK(stack_take_sections(ctx, SECTIONS, s.sections, &opt, &out, &notes), ctx);
  T_CHECK(out.sections[0].apex_count == 1 && out.sections[4].apex_count == 2 && out.sections[0].apex[0][0] == 3 &&
              out.sections[4].loops.count == 0 && notes.count == 0,
          "a point below, a line above");
  release(&out, &notes);
  s.starts[2][1] = 2;
  T_STATUS(attempt(&s, &opt), BATTEN_E_INVALID, ctx,
           "sections[2].contours[0]: 2 points; give at least 3, or leave the section out");
  reset(&s);
  s.starts[0][1] = s.starts[1][1] = 1;
  T_STATUS(attempt_count(ctx, &s, 2, &opt), BATTEN_E_INVALID, ctx,
           "sections: all are apexes; give a contour of at least 3 points");
}

/* ---- what makes no sense ------------------------------------------------------------------------- */

static void test_bad_sections(void) {
  batten_stack_options opt = batten_stack_options_default();
  scene s;
#define BAD(change, text)                                     \
  do {                                                        \
    reset(&s);                                                \
    change;                                                   \
    T_STATUS(attempt(&s, &opt), BATTEN_E_INVALID, ctx, text); \
  } while (0)
  BAD(s.sections[2].contour_count = 0, "sections[2].contour_count: 0; give a contour, or leave it out");
  BAD(s.sections[2].starts = NULL, "sections[2].starts: NULL; give its contours");
  BAD(s.sections[2].points = NULL, "sections[2].points: NULL; give its contours");
  BAD((s.sections[3].contour_count = 2, s.starts[3][2] = 5), "sections[3].starts[2]: 5 after 12; must not decrease");
  BAD(s.points[1][7][1] = NAN, "sections[1].points[7]: coordinate 1 is nan; give finite numbers below 1e150");
  BAD(s.points[1][7][0] = 1e200, "sections[1].points[7]: coordinate 0 is 1e+200; give finite numbers below 1e150");
  BAD(s.sections[4].origin[2] = INFINITY, "sections[4].origin[2]: inf; give finite numbers below 1e150");
  BAD(s.sections[4].rotation[2][2] = -1, "sections[4].rotation: not a rotation");
  BAD(s.sections[4].rotation[0][1] = 1e-5, "sections[4].rotation: not a rotation, off by 1e-05; rows must be");
  BAD(s.sections[4].rotation[0][0] = NAN, "sections[4].rotation: not a rotation");
  BAD(s.starts[2][1] = 2, "sections[2].contours[0]: 2 points; give at least 3, or leave the section out");
  BAD(s.starts[2][1] = 0, "sections[2].contours[0]: 0 points; give at least 3, or leave the section out");
  BAD(ring(SIDE, 0, 0, 0.01, s.points[2]), "sections[2].contours[0]: area 0.0003 below 0.603; give a contour");
  BAD((s.points[2][3][0] = 0, s.points[2][3][1] = -5), "sections[2].contours[0]: crosses or overlaps itself at (");
  BAD((s.sections[2].contour_count = 2, ring(SIDE, 1, 0, 3, s.points[2] + SIDE)),
      "sections[2].contours[0]: crosses or overlaps contours[1] at (");
  BAD((s.sections[2].contour_count = 2, ring(SIDE, 0, 0, 3, s.points[2] + SIDE)),
      "contours of a section must lie apart or within each other");
  BAD(s.sections[2].origin[2] = 1, "sections[2]: its plane coincides with that of sections[1]; join their contours");
  BAD(s.sections[2].origin[2] = 0.5, "sections[2]: lies 0.5 behind the plane of sections[1]; order sections along");
  /* In planes that are not parallel: the same plane turned in itself, the other way along the normals. */
  BAD((turn_about_y(&s.sections[2], 0.1), turn_about_y(&s.sections[3], 0.1), s.sections[3].origin[2] = 2),
      "sections[3]: its plane coincides with that of sections[2]");
  BAD((turn_about_y(&s.sections[2], 0.1), s.sections[2].origin[2] = -4),
      "sections[2]: lies 4.7 behind the plane of sections[1]");
#undef BAD
  reset(&s);
  T_STATUS(attempt_count(ctx, &s, 0, &opt), BATTEN_E_INVALID, ctx, "sections: 0; give at least one");
  opt.route = BATTEN_ROUTE_SPACE;
  s.sections[2].origin[2] = 0.5;
  T_OK(attempt(&s, &opt), ctx); /* one function in space needs no order */
  opt.method = BATTEN_SECTION_POINTS;
  s.starts[2][1] = 2;
  T_STATUS(attempt(&s, &opt), BATTEN_E_INVALID, ctx, "sections[2]: 2 points; give at least 3");
  reset(&s);
  s.points[2][3][0] = -s.points[2][3][0];
  T_OK(attempt(&s, &opt), ctx); /* nor have points in no order edges that cross */
}

static void test_bad_options(void) {
  scene s;
  reset(&s);
  batten_stack_options opt;
  double numbers[3 * SECTIONS] = {0};
#define BAD(change, text)                                     \
  do {                                                        \
    opt = batten_stack_options_default();                     \
    change;                                                   \
    T_STATUS(attempt(&s, &opt), BATTEN_E_INVALID, ctx, text); \
  } while (0)
  BAD(opt = (batten_stack_options){0}, "batten_stack_options.struct_size: 0, expected");
  BAD(opt.method = (batten_section_method)3, "opt.method: 3; give one of its names");
  BAD(opt.between = (batten_stack_between)5, "opt.between: 5; give one of its names");
  BAD(opt.ends[1] = (batten_stack_end)4, "opt.ends[1]: 4; give one of its names");
  BAD(opt.rotation = (batten_stack_rotation)4, "opt.rotation: 4; give one of its names");
  BAD(opt.path = (batten_stack_path)2, "opt.path: 2; give one of its names");
  BAD(opt.parameter = (batten_stack_parameter)2, "opt.parameter: 2; give one of its names");
  BAD(opt.route = (batten_stack_route)3, "opt.route: 3; give one of its names");
  BAD(opt.tolerance = -1, "opt.tolerance: -1; must be finite and 0 or more");
  BAD(opt.min_area = NAN, "opt.min_area: nan; must be finite and 0 or more");
  BAD(opt.end_height[1] = INFINITY, "opt.end_height[1]: inf; must be finite and 0 or more");
  BAD(opt.gap = -2, "opt.gap: -2; must be finite and 0 or more");
  BAD(opt.pair_distance = 0, "opt.pair_distance: 0; give 0 < it <= 1");
  BAD(opt.shape = 0, "opt.shape: 0; must be finite and above 0");
  BAD(opt.saturation = 0, "opt.saturation: 0; must be above 0 (INFINITY: none)");
  BAD(opt.scales = numbers, "opt.scales[0]: 0; must be finite and above 0");
  BAD(opt.parameters = numbers, "opt.parameters[1]: 0 after 0; must increase");
  BAD(opt.rotation = BATTEN_ROTATION_VELOCITY, "opt.angular_velocity: NULL; BATTEN_ROTATION_VELOCITY needs it");
  numbers[5] = NAN;
  BAD(opt.angular_velocity = numbers, "opt.angular_velocity[1]: component 2 is nan; must be finite");
#undef BAD
  opt = batten_stack_options_default();
  T_STATUS(attempt_count(ctx, &s, 1, &opt), BATTEN_E_INVALID, ctx, "opt.gap: 0; one section needs the distance");
  opt.gap = 1;
  opt.ends[0] = BATTEN_END_PLANE;
  T_CHECK(attempt_count(ctx, &s, 1, &opt) == BATTEN_OK, "one section that ends at its plane on one side");
  opt.ends[1] = BATTEN_END_OPEN;
  T_STATUS(attempt_count(ctx, &s, 1, &opt), BATTEN_E_INVALID, ctx, "opt.ends: both at the plane of the one section");
  opt = batten_stack_options_default();
  opt.gap = 2;
  opt.saturation = INFINITY;
  stack out = {0};
  stack_notes notes = {.ctx = ctx};
  T_OK(stack_take_sections(ctx, 1, s.sections, &opt, &out, &notes), ctx);
  T_CHECK(out.gap == 2 && out.sections[0].saturation == INFINITY && out.end_lengths[1] == 1,
          "one section that stands for a gap");
  release(&out, &notes);
}

static batten_status take_and_release(batten_context *c, void *arg) {
  return attempt_count(c, arg, SECTIONS,
                       &(batten_stack_options){.struct_size = sizeof(batten_stack_options),
                                               .pair_distance = 0.5,
                                               .shape = 1,
                                               .saturation = 1,
                                               .min_area = 20,
                                               .angular_velocity = (double[3 * SECTIONS]){0}});
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_settled();
  test_bent();
  test_apex();
  test_bad_sections();
  test_bad_options();
  scene s;
  reset(&s);
  s.sections[1].contour_count = s.sections[2].contour_count = 2; /* holes, dropped */
  t_fail_every_allocation("stack_take_sections", take_and_release, &s);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "all is given back");
  batten_context_free(ctx);
  return t_done();
}
