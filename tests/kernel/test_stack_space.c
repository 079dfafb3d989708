/* Planes that cross within sections, and the one spline in space through all of them; one section alone. */
#include "base/checked.h"
#include "section/section_inner.h"
#include "stack_scenes.h"
#include "tap.h"

static batten_status take(batten_context *ctx, stack_scene *scene, batten_stack_options *options, stack *s,
                          stack_notes *notes) {
  *s = (stack){.ctx = ctx};
  *notes = (stack_notes){.ctx = ctx};
  options->route = BATTEN_ROUTE_SPACE;
  return stack_take_sections(ctx, scene->count, stack_scene_sections(scene), options, s, notes);
}
static void drop(stack *s, stack_notes *notes) {
  batten_free(notes->ctx, notes->items);
  stack_release(s);
}

/* ---- crossings ------------------------------------------------------------------------------------- */

/* A disc of this radius about (x, 0) of a plane through the z axis (its y axis), turned by an angle. */
static void add_leaf(stack_scene *scene, double angle, double x, double y, double radius) {
  const double c = cos(angle), s = sin(angle), origin[3] = {0, 0, 0};
  const double rotation[9] = {c, s, 0, 0, 0, 1, s, -c, 0};
  stack_scene_section(scene, origin, rotation);
  stack_scene_disc(scene, x, y, radius, 60);
}

/* Discs in planes through the z axis: they cross where they reach over it, at common heights. The whole also turned.
 */
static void test_crossings(batten_context *ctx) {
  const double axis[3] = {0.3, -0.5, 0.81240384046359};
  double turn[9];
  stack_scene_rotation(axis, 2.967, turn);
  for (int turned = 0; turned < 2; turned++) {
    stack_scene scene = {0};
    stack s;
    stack_notes notes;
    size_t crossings = 99;
    batten_stack_options options = batten_stack_options_default();
    add_leaf(&scene, 0, 0.5, 0, 1);      /* 0: over the axis, heights -0.87 .. 0.87 */
    add_leaf(&scene, 0.7, 0.5, 1.2, 1);  /* 1: 0.33 .. 2.07: crosses 0 */
    add_leaf(&scene, 1.4, 2, 0, 1);      /* 2: beside the axis */
    add_leaf(&scene, 2.1, 0.5, 3, 0.9);  /* 3: over the axis, 2.25 .. 3.75: above all others */
    add_leaf(&scene, 2.8, 1.0001, 0, 1); /* 4: short of the axis */
    if (turned) stack_scene_turn(&scene, turn);
    T_OK(take(ctx, &scene, &options, &s, &notes), ctx);
    notes.count = 0;
    T_OK(stack_find_crossings(ctx, &s, &notes, &crossings), ctx);
    T_CHECK(crossings == 1 && notes.count == 1 && notes.items[0].kind == BATTEN_NOTE_CROSSING &&
                notes.items[0].section == 0 && notes.items[0].other == 1,
            "leaves about an axis: one pair crosses within both%s", turned ? ", turned as a whole too" : "");
    drop(&s, &notes);
    stack_scene_free(&scene);
  }
}

static void test_no_crossings(batten_context *ctx) {
  stack_scene scene = {0};
  stack s;
  stack_notes notes;
  size_t crossings = 99;
  batten_stack_options options = batten_stack_options_default();
  const scene_block block = scene_block_figure4();
  stack_scene_block(&scene, &block, 20, 0, 8);
  T_OK(take(ctx, &scene, &options, &s, &notes), ctx);
  T_OK(stack_find_crossings(ctx, &s, &notes, &crossings), ctx);
  T_CHECK(crossings == 0, "the bent and twisted block: no crossings");
  drop(&s, &notes);
  stack_scene_free(&scene);
}

/* ---- one spline ------------------------------------------------------------------------------------ */

/* The unit ball by circles in planes through a point near its middle, each turned another way. */
static void add_ball(stack_scene *scene, size_t planes, size_t points) {
  for (size_t i = 0; i < planes; i++) {
    double rotation[9], z = ((double)i + 0.5) / (double)planes, a = 2.4 * (double)i, r = sqrt(1 - z * z);
    double *n = rotation + 6, length = hypot(r, z), middle[3];
    n[0] = r * cos(a) / length, n[1] = r * sin(a) / length, n[2] = z / length;
    rotation[0] = -sin(a), rotation[1] = cos(a), rotation[2] = 0;
    for (int k = 0; k < 3; k++)
      rotation[3 + k] = n[(k + 1) % 3] * rotation[(k + 2) % 3] - n[(k + 2) % 3] * rotation[(k + 1) % 3];
    double offset = 0.3 * ((double)(i % 3) - 1);
    for (int k = 0; k < 3; k++) middle[k] = offset * n[k];
    stack_scene_section(scene, middle, rotation);
    stack_scene_disc(scene, 0, 0, sqrt(1 - offset * offset), points);
  }
}

/* Largest distance of places of the sphere from f = 0, and of far ones with the wrong sign. */
static double ball_error(batten_context *ctx, const batten_solid *solid, size_t *wrong) {
  double worst = 0;
  uint64_t seed = 5;
  *wrong = 0;
  for (int i = 0; i < 2000; i++) {
    double p[3], length = 0, f, df[3], slope = 0;
    for (int k = 0; k < 3; k++) {
      p[k] = t_uniform(&seed) + t_uniform(&seed) + t_uniform(&seed) - 1.5;
      length += p[k] * p[k];
    }
    for (int k = 0; k < 3; k++) p[k] /= sqrt(length);
    batten_solid_evaluate(ctx, solid, 1, p, &f, df, NULL);
    for (int k = 0; k < 3; k++) slope += df[k] * df[k];
    worst = fmax(worst, fabs(f) / sqrt(slope));
    double scale = i % 2 ? 0.85 * t_uniform(&seed) : pow(10, 2 * t_uniform(&seed)) * 1.15;
    for (int k = 0; k < 3; k++) p[k] *= scale;
    batten_solid_evaluate(ctx, solid, 1, p, &f, NULL, NULL);
    *wrong += (f > 0) != (scale < 1);
  }
  return worst;
}

static void test_space(batten_context *ctx) {
  static const double allowed[2] = {0.025, 0.012};
  for (int method = 0; method < 2; method++) {
    stack_scene scene = {0};
    stack s;
    stack_notes notes;
    batten_stack_options options = batten_stack_options_default();
    section_figures figures[7];
    batten_solid *solid = NULL;
    size_t centers = 0, crossings, wrong = 1, points;
    options.method = (batten_section_method)method;
    add_ball(&scene, 7, 40);
    T_OK(take(ctx, &scene, &options, &s, &notes), ctx);
    T_OK(stack_fit_all(ctx, &s, stack_scene_sections(&scene), &options, 0.1 * s.spacing, figures), ctx);
    T_OK(stack_find_crossings(ctx, &s, &notes, &crossings), ctx);
    T_CHECK(crossings == 21, "each of seven planes of a ball crosses the others: %zu pairs", crossings);
    T_OK(stack_fit_space(ctx, &s, method == 0, options.pair_distance, &solid, &centers), ctx);
    double error = solid ? ball_error(ctx, solid, &wrong) : INFINITY;
    T_RATIO(error, allowed[method], "ball from seven crossing circles, %s: off by (%zu centres)",
            method ? "points in no order" : "contours", centers);
    T_CHECK(wrong == 0, "its sign within 0.85 and beyond 1.15, up to 115 radii: %zu wrong of 2000", wrong);
    const double *x = batten_solid_points(solid, &points);
    double worst = 0;
    for (size_t i = 0; i < points; i++)
      worst = fmax(worst,
                   fabs(sqrt(x[3 * i] * x[3 * i] + x[3 * i + 1] * x[3 * i + 1] + x[3 * i + 2] * x[3 * i + 2]) - 1));
    T_RATIO(worst, 0.01, "its %zu points lie on the sphere, but for the polygons' sagitta", points);
    T_CHECK(batten_solid_dimension(solid) == 3 && batten_solid_kind_of(solid) == BATTEN_SOLID_SPLINE, "a spline");
    batten_solid_free(solid);
    drop(&s, &notes);
    stack_scene_free(&scene);
  }
}

/* As it is built from outside, where sections of points in no order have got loops, which more points than centres
 * may lie on. */
static void test_route(batten_context *ctx) {
  for (int method = 0; method < 3; method++) {
    stack_scene scene = {0};
    batten_stack_options options = batten_stack_options_default();
    batten_stack_info info = {0};
    batten_solid *solid = NULL;
    size_t wrong = 1;
    options.method = (batten_section_method)method;
    options.route = BATTEN_ROUTE_SPACE;
    if (method == 0) options.tolerance = 0.01;
    add_ball(&scene, 7, method == 0 ? 120 : 40);
    T_OK(batten_stack_build(ctx, scene.count, stack_scene_sections(&scene), &options, &solid, &info, NULL, NULL), ctx);
    double error = solid ? ball_error(ctx, solid, &wrong) : INFINITY;
    T_CHECK(info.route == BATTEN_ROUTE_SPACE && wrong == 0, "built in space, method %d: %zu wrong signs", method, wrong);
    T_RATIO(error, 0.025, "off by (%zu centres)", info.centers);
    batten_solid_free(solid);
    stack_scene_free(&scene);
  }
}

static batten_status call_space(batten_context *ctx, void *arg) {
  stack_scene *scene = arg;
  stack s;
  stack_notes notes;
  batten_stack_options options = batten_stack_options_default();
  section_figures figures[3];
  batten_solid *solid = NULL;
  size_t centers, crossings;
  batten_status st = take(ctx, scene, &options, &s, &notes);
  if (st >= 0) st = stack_fit_all(ctx, &s, stack_scene_sections(scene), &options, 0.3 * s.spacing, figures);
  if (st >= 0) st = stack_find_crossings(ctx, &s, &notes, &crossings);
  if (st >= 0) st = stack_fit_space(ctx, &s, true, 0.75, &solid, &centers);
  batten_solid_free(solid);
  drop(&s, &notes);
  return st;
}

/* ---- one section alone ------------------------------------------------------------------------------ */

static void test_alone(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_annuli(&scene, 1, 4, 10, 1, 80);
  stack_scene_disc(&scene, 30, 0, 0.001, 20);
  batten_section section = stack_scene_sections(&scene)[0];
  memset(section.rotation, 0, sizeof section.rotation);
  batten_solid *solid = NULL;
  batten_stack_info info;
  T_OK(batten_section_fit(ctx, &section, NULL, &solid, &info), ctx);
  T_CHECK(info.sections == 1 && info.contours == 2 && info.holes == 1 && info.contours_dropped == 1 &&
              info.pieces == 1 && info.certified == 1 && info.points_given == 180 && info.centers > 40,
          "an annulus, a speck beside it: %zu contours, %zu dropped, %zu centres, miss %.3g, wrong sign %.3g of %.3g",
          info.contours, info.contours_dropped, info.centers, info.section_residual_max, info.wrong_sign_max,
          info.tolerance);
  const double p[8] = {7, 0, 0, 0, 12, 0, 0, -9};
  double f[4] = {0};
  T_OK(batten_solid_evaluate(ctx, solid, 4, p, f, NULL, NULL), ctx);
  T_CHECK(f[0] > 1.5 && f[1] < -2 && f[2] < -1 && f[3] > 0.9, "its values: %.3f %.3f %.3f %.3f", f[0], f[1], f[2],
          f[3]);
  batten_solid_free(solid);
  solid = NULL;
  batten_stack_options options = batten_stack_options_default();
  options.method = BATTEN_SECTION_CARRIER;
  T_OK(batten_section_fit(ctx, &section, NULL, &solid, NULL), ctx);
  batten_solid_free(solid);
  solid = NULL;
  options = (batten_stack_options){0};
  T_STATUS(batten_section_fit(ctx, &section, &options, &solid, NULL), BATTEN_E_INVALID, ctx, "struct_size");
  options = batten_stack_options_default();
  options.tolerance = -1;
  T_STATUS(batten_section_fit(ctx, &section, &options, &solid, NULL), BATTEN_E_INVALID, ctx, "opt.tolerance: -1");
  T_STATUS(batten_section_fit(ctx, NULL, NULL, &solid, NULL), BATTEN_E_INVALID, ctx, "section: NULL");
  T_STATUS(batten_section_fit(ctx, &section, NULL, NULL, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  scene.at[5] = NAN;
  T_STATUS(batten_section_fit(ctx, &section, NULL, &solid, NULL), BATTEN_E_INVALID, ctx, "nan");
  T_CHECK(!solid && batten_section_fit(NULL, &section, NULL, &solid, NULL) == BATTEN_E_INVALID, "no context");
  stack_scene_free(&scene);
}

static batten_status call_alone(batten_context *ctx, void *arg) {
  stack_scene *scene = arg;
  batten_solid *solid = NULL;
  batten_status st = batten_section_fit(ctx, stack_scene_sections(scene), NULL, &solid, NULL);
  batten_solid_free(solid);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_crossings(ctx);
  test_no_crossings(ctx);
  test_space(ctx);
  test_route(ctx);
  test_alone(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing held");
  batten_context_free(ctx);
  stack_scene scene = {0}, disc = {0};
  add_ball(&scene, 3, 12);
  stack_scene_slice(&disc, 0);
  stack_scene_disc(&disc, 0, 0, 2, 16);
  t_fail_every_allocation("a spline in space", call_space, &scene);
  t_cancel_every_progress("a spline in space", call_space, &scene);
  t_fail_every_allocation("batten_section_fit", call_alone, &disc);
  t_cancel_every_progress("batten_section_fit", call_alone, &disc);
  stack_scene_free(&scene);
  stack_scene_free(&disc);
  return t_done();
}
