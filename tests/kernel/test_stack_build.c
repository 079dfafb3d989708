/* Solids through sections, whole: their topology, their ends, what lies apart, planes that are not parallel, planes
 * in no sequence. The figures are those of [Savchenko et al. 1995], figures 3 and 4. */
#include <float.h>

#include <batten/mesh.h>

#include "stack_rig.h"

static batten_context *ctx;

/* What batten_stack_build says of a scene. */
typedef struct built {
  batten_status status;
  batten_solid *solid;
  batten_stack_info info;
  batten_stack_note *notes;
  size_t note_count;
} built;

static built build(stack_scene *scene, const batten_stack_options *o) {
  built b = {.status = BATTEN_OK};
  b.status = batten_stack_build(ctx, scene->count, stack_scene_sections(scene), o, &b.solid, &b.info, &b.notes,
                                &b.note_count);
  if (b.status) printf("# %s\n", batten_error(ctx));
  return b;
}
static void drop(built *b, stack_scene *scene) {
  batten_solid_free(b->solid);
  batten_free(ctx, b->notes);
  *b = (built){0};
  if (scene) stack_scene_free(scene);
}

/* The surface's figures; crossings: pairs of triangles that cross. */
static batten_status measure(const batten_solid *solid, double cell, batten_mesh_measures *m, size_t *crossings) {
  batten_polygonize_options o = batten_polygonize_options_default();
  batten_field field = batten_solid_field(solid);
  batten_mesh *mesh = NULL;
  size_t count;
  const double *seeds = batten_solid_points(solid, &count);
  o.cell = cell;
  o.improve = 3;
  batten_solid_box(solid, o.lower, o.upper);
  for (int k = 0; k < 3; k++) o.lower[k] -= 2.1 * cell, o.upper[k] += 2.1 * cell;
  *m = (batten_mesh_measures){0};
  *crossings = SIZE_MAX;
  batten_status st = batten_polygonize(ctx, &field, count, seeds, &o, &mesh, NULL);
  if (st >= 0) batten_mesh_measure(ctx, mesh, m);
  if (st >= 0) batten_mesh_self_intersections(ctx, mesh, crossings);
  batten_mesh_free(mesh);
  return st;
}

/* ---- topology ---------------------------------------------------------------------------------------- */

static void check_topology(stack_scene *scene, const batten_stack_options *o, double cell, const char *name,
                           size_t pieces, size_t surfaces, long genus, size_t holes) {
  built b = build(scene, o);
  batten_mesh_measures m;
  size_t crossings;
  T_CHECK(b.status == BATTEN_OK && b.info.pieces == pieces && b.info.holes == holes && b.info.non_overlaps == 0 &&
              b.info.certified == b.info.sections && b.info.sections == scene->count &&
              b.info.contours == scene->loops && b.info.points_given == scene->points && b.info.parallel,
          "%s: %zu pieces, %zu holes, %zu sections of %zu contours", name, b.info.pieces, b.info.holes,
          b.info.sections, b.info.contours);
  batten_status st = measure(b.solid, cell, &m, &crossings);
  T_CHECK(st == BATTEN_OK && m.closed && m.manifold && m.oriented && crossings == 0 && m.components == surfaces &&
              m.genus == genus && m.euler == 2 * (long)surfaces - 2 * genus && m.volume > 0,
          "%s: %zu closed surfaces, genus %ld, volume %.5g", name, m.components, m.genus, m.volume);
  drop(&b, scene);
}

/* Figure 3. */
static void test_branches(void) {
  static const char *const names[] = {"natural", "not-a-knot", "monotone", "linear", "rational"};
  for (int i = 0; i < 5; i++) {
    batten_stack_options o = batten_stack_options_default();
    stack_scene scene = {0};
    char name[64];
    o.between = (batten_stack_between)i;
    if (o.between == BATTEN_BETWEEN_RATIONAL) o.shape = 0.6;
    snprintf(name, sizeof name, "three branches, %s", names[i]);
    stack_scene_branches(&scene, 24);
    check_topology(&scene, &o, 1.6, name, 1, 1, 0, 0);
  }
}

static void test_topology(void) {
  stack_scene scene = {0};
  stack_scene_annuli(&scene, 4, 2, 5, 3, 32);
  check_topology(&scene, NULL, 0.9, "a tube", 1, 1, 1, 4);
  stack_scene_cavity(&scene, 32);
  check_topology(&scene, NULL, 1.7, "a cavity", 1, 2, 0, 3);
  stack_scene_seven(&scene, 3, 20);
  check_topology(&scene, NULL, 0.8, "seven contours a slice", 7, 7, 0, 0);
}

/* ---- pieces that lie apart ----------------------------------------------------------------------------- */

static void test_apart(void) {
  enum { COUNT = 4, TRIALS = 1000 };
  static double points[TRIALS][3], values[2][TRIALS];
  batten_stack_options o = batten_stack_options_default();
  stack_scene scene = {0};
  stack_scene_shifted(&scene, COUNT, 2, 5, 2, 32);
  built apart = build(&scene, &o), linked;
  bool named = apart.note_count == 6 && apart.info.non_overlaps == 6;
  for (size_t k = 0; named && k < apart.note_count; k++) {
    const batten_stack_note *n = apart.notes + k;
    size_t pair = k / 2, upper = !n->above;
    named =
        n->kind == BATTEN_NOTE_NO_OVERLAP && n->section == pair + upper && n->contour == 0 && n->other == SIZE_MAX;
  }
  T_CHECK(named && apart.info.pieces == COUNT && apart.info.links == 0, "discs apart: %zu pieces, slices are named",
          apart.info.pieces);
  o.link = 1;
  linked = build(&scene, &o);
  T_CHECK(linked.info.pieces == 1 && linked.info.links == 3 && linked.note_count == 6 &&
              linked.notes[0].kind == BATTEN_NOTE_LINKED && fabs(linked.notes[0].value - 5) < 1e-9,
          "linked: one piece");
  batten_mesh_measures m;
  size_t crossings, changed = 0, raised = 0;
  for (int i = 0; i < 2; i++) {
    T_OK(measure(i ? linked.solid : apart.solid, 0.5, &m, &crossings), ctx);
    T_CHECK(m.components == (i ? 1 : COUNT) && m.genus == 0 && m.manifold && crossings == 0, "%s: %zu components",
            i ? "linked" : "apart", m.components);
  }
  uint64_t seed = 8;
  for (int between = 0; between < 2; between++) {
    for (size_t i = 0; i < TRIALS; i++) {
      points[i][0] = -4 + 24 * t_uniform(&seed);
      points[i][1] = -4 + 8 * t_uniform(&seed);
      points[i][2] = between ? 6 * t_uniform(&seed) : 2 * (double)(i % COUNT);
    }
    batten_solid_evaluate(ctx, apart.solid, TRIALS, points[0], values[0], NULL, NULL);
    batten_solid_evaluate(ctx, linked.solid, TRIALS, points[0], values[1], NULL, NULL);
    for (size_t i = 0; i < TRIALS; i++) {
      changed += !between && values[0][i] != values[1][i];
      raised += between && values[1][i] > values[0][i];
    }
  }
  T_CHECK(changed == 0 && raised > 50, "given sections stay to the bit, %zu places between them are raised", raised);
  drop(&apart, NULL);
  drop(&linked, &scene);
}

/* ---- ends --------------------------------------------------------------------------------------------- */

enum { SLICES = 4 };

/* A cylinder or cone of radius 2 and slices 1.5 apart by functions R - r in closed form, through its parts. */
static batten_solid *exact_cylinder(batten_stack_end end, double length, bool apex) {
  static const double t[SLICES] = {0, 1.5, 3, 4.5}, ones[SLICES] = {1, 1, 1, 1};
  static const double none[SLICES] = {INFINITY, INFINITY, INFINITY, INFINITY}, at[1][3] = {{0, 0, 2}};
  stack_scene scene = {0};
  batten_solid *functions[SLICES] = {NULL}, *solid = NULL;
  size_t count = apex ? 2 : SLICES;
  for (size_t i = 0; i < count; i++) {
    stack_scene_slice(&scene, t[i]);
    if (apex && i == 1)
      stack_scene_loop(&scene, 1, (const double[2]){0, 0});
    else
      stack_scene_disc(&scene, 0, 0, 2, 40);
    if (!apex || i == 0) rig_discs_make(ctx, 1, at, &functions[i]);
  }
  batten_stack_parts p = {.struct_size = sizeof p,
                          .count = count,
                          .sections = stack_scene_sections(&scene),
                          .functions = functions,
                          .parameters = t,
                          .scales = ones,
                          .saturations = none,
                          .between = apex ? BATTEN_BETWEEN_LINEAR : BATTEN_BETWEEN_NATURAL,
                          .shape = 1,
                          .ends = {apex ? BATTEN_END_PLANE : end, end},
                          .end_lengths = {apex ? 0 : length, length}};
  T_OK(batten_stack_create(ctx, &p, &solid), ctx);
  for (size_t i = 0; i < count; i++) batten_solid_free(functions[i]);
  stack_scene_free(&scene);
  return solid;
}

static void test_ends(void) {
  static const char *const names[] = {"flat", "plane", "rounded"};
  const double area = SCENE_PI * 4, gap = 1.5;
  const double volumes[] = {area * gap * SLICES, area * gap * (SLICES - 1),
                            area * (gap * (SLICES - 1) + 16. / 15 * gap)};
  batten_mesh_measures m;
  size_t crossings;
  double lower[3], upper[3];
  for (int i = 0; i < 3; i++) {
    double length = i == 0 ? gap / 2 : i == 1 ? 0 : gap;
    batten_solid *solid = exact_cylinder((batten_stack_end)i, length, false);
    T_OK(measure(solid, 0.3, &m, &crossings), ctx);
    T_RATIO(fabs(m.volume / volumes[i] - 1), 0.015, "%s ends of a cylinder, volume %.4f", names[i], m.volume);
    double over = fmax(m.upper[2] - 4.5, -m.lower[2]) - length, under = length - fmin(m.upper[2] - 4.5, -m.lower[2]);
    T_RATIO(over, 1e-6, "%s ends, highest above their height", names[i]);
    T_RATIO(under, i == 2 ? 0.1 : 1e-6, "%s ends, highest below it", names[i]); /* a tip may have no vertex */
    batten_solid_box(solid, lower, upper);
    T_RATIO(fabs(lower[2] + length) + fabs(upper[2] - 4.5 - length), 1e-12, "%s ends, the solid's box", names[i]);
    batten_solid_free(solid);
  }
  batten_solid *cone = exact_cylinder(BATTEN_END_FLAT, 0.75, true);
  T_OK(measure(cone, 0.075, &m, &crossings), ctx); /* twice that would chamfer the rim, of 37 degrees, by 3 % */
  T_RATIO(fabs(m.volume / (area * gap / 3) - 1), 0.02, "a cone to an apex, volume %.4f", m.volume);
  T_RATIO(m.upper[2] - gap, 1e-6, "nothing beyond the apex");
  T_RATIO(gap - m.upper[2], 0.1, "and little missing before it");
  double tip[3] = {0, 0, gap}, value = 1;
  T_OK(batten_solid_evaluate(ctx, cone, 1, tip, &value, NULL, NULL), ctx);
  T_CHECK(value == 0, "the apex is a point of the surface");
  batten_solid_free(cone);
}

/* Fitted sections: the volume of the sum of slices, and open ends. */
static void test_fitted_ends(void) {
  const double radii[SLICES] = {2, 2, 2, 2}, area = 80 * sin(SCENE_PI / 20); /* of the polygons */
  batten_stack_options o = batten_stack_options_default();
  stack_scene scene = {0};
  batten_mesh_measures m;
  size_t crossings;
  stack_scene_discs(&scene, SLICES, radii, 1.5, 40);
  built b = build(&scene, &o);
  T_OK(measure(b.solid, 0.3, &m, &crossings), ctx);
  T_RATIO(fabs(m.volume / (area * 1.5 * SLICES) - 1), 0.015, "the sum of slices, volume %.4f", m.volume);
  drop(&b, NULL);
  o.ends[0] = o.ends[1] = BATTEN_END_OPEN;
  b = build(&scene, &o);
  batten_field field = batten_solid_field(b.solid);
  batten_polygonize_options p = batten_polygonize_options_default();
  batten_mesh *mesh = NULL;
  size_t count;
  const double *seeds = batten_solid_points(b.solid, &count);
  p.cell = 0.3;
  batten_solid_box(b.solid, p.lower, p.upper);
  T_CHECK(p.lower[2] == 0 && p.upper[2] == 4.5, "open ends: the solid's box ends at the planes");
  for (int k = 0; k < 2; k++) p.lower[k] -= 1, p.upper[k] += 1;
  batten_status st = batten_polygonize(ctx, &field, count, seeds, &p, &mesh, NULL);
  batten_mesh_measure(ctx, mesh, &m);
  T_CHECK(st == BATTEN_W_CLIPPED && m.boundary_loops == 2 && m.components == 1 && !m.closed && m.manifold,
          "open ends: %zu boundary loops", m.boundary_loops);
  T_RATIO(fabs(m.area / (2 * SCENE_PI * 2 * 4.5) - 1), 0.01, "the cylinder's side");
  batten_mesh_free(mesh);
  drop(&b, &scene);
}

/* ---- planes that are not parallel ---------------------------------------------------------------------- */

/* Figure 4 as a mesh: its middle line is that of the centroids, so its volume is area times length. */
static void test_block(void) {
  scene_block block = scene_block_figure4();
  batten_stack_options o = batten_stack_options_default();
  stack_scene scene = {0};
  o.ends[0] = o.ends[1] = BATTEN_END_PLANE;
  stack_scene_block(&scene, &block, 9, 0, 8);
  built b = build(&scene, &o);
  batten_mesh_measures m;
  size_t crossings;
  T_OK(measure(b.solid, 0.03, &m, &crossings), ctx);
  T_CHECK(!b.info.parallel && b.info.crossings == 0 && b.info.route == BATTEN_ROUTE_SECTIONS && m.components == 1 &&
              m.genus == 0 && m.closed && m.manifold && crossings == 0,
          "bent and twisted block: one closed surface");
  double truth = scene_block_length(&block) * 4 * block.half[0] * block.half[1];
  T_RATIO(fabs(m.volume / truth - 1), 0.02, "its volume %.5f", m.volume);
  drop(&b, &scene);
}

static bool same_solid(const batten_solid *a, const batten_solid *b, size_t count, const double *points) {
  double *values = stack_scene_grow(NULL, 8 * count * sizeof *values);
  batten_status st = batten_solid_evaluate(ctx, a, count, points, values, values + count, NULL);
  if (st >= 0) st = batten_solid_evaluate(ctx, b, count, points, values + 4 * count, values + 5 * count, NULL);
  bool same = st >= 0 && memcmp(values, values + 4 * count, 4 * count * sizeof *values) == 0;
  size_t n[2];
  const double *p[2] = {batten_solid_points(a, n), batten_solid_points(b, n + 1)};
  double box[2][6];
  batten_solid_box(a, box[0], box[0] + 3);
  batten_solid_box(b, box[1], box[1] + 3);
  same = same && n[0] == n[1] && memcmp(p[0], p[1], n[0] * 3 * sizeof(double)) == 0 &&
         memcmp(box[0], box[1], sizeof box[0]) == 0;
  free(values);
  return same;
}

/* Frames by their angular velocity: the rotations given with the sections do not count but for the first, and seeds
 * and box stand in the integrated ones. */
static void test_velocity(void) {
  enum { COUNT = 9, TRIALS = 200 };
  static double points[TRIALS][3];
  scene_block block = scene_block_figure4();
  batten_stack_options o = batten_stack_options_default();
  double omega[COUNT][3], t[COUNT], worst = 0, at[3] = {0, 0, 0}, f, g[3];
  uint64_t seed = 4;
  built b[2];
  for (int given = 0; given < 2; given++) {
    stack_scene scene = {0};
    stack_scene_block(&scene, &block, COUNT, 0, 8);
    for (size_t i = 0; i < COUNT; i++) {
      double origin[3], m[3][3];
      scene_block_frame(&block, (double)i / (COUNT - 1), origin, m, omega[i]);
      t[i] = scene_block_length(&block) * (double)i / (COUNT - 1);
      if (given) memcpy(scene.sections[i].rotation, scene.sections[0].rotation, sizeof m);
    }
    o.rotation = BATTEN_ROTATION_VELOCITY;
    o.angular_velocity = omega[0];
    o.parameters = t;
    b[given] = build(&scene, &o);
    stack_scene_free(&scene);
  }
  for (size_t i = 0; i < TRIALS; i++)
    for (int k = 0; k < 3; k++) points[i][k] = -0.4 + 1.8 * t_uniform(&seed);
  T_CHECK(b[0].solid && b[1].solid && !b[1].info.parallel && same_solid(b[0].solid, b[1].solid, TRIALS, points[0]),
          "frames by angular velocity do not depend on the rotations given");
  size_t count;
  const double *seeds = batten_solid_points(b[1].solid, &count);
  for (size_t i = 0; i < count; i++) {
    batten_solid_evaluate(ctx, b[1].solid, 1, seeds + 3 * i, &f, g, NULL);
    worst = fmax(worst, fabs(f));
  }
  T_RATIO(worst, 0.02, "seeds lie on the surface of integrated frames");
  T_RATIO(b[1].info.rotation_drift, 1e-14, "the first integral is kept");
  batten_stack_parts parts;
  T_OK(batten_stack_get_parts(ctx, b[1].solid, &parts), ctx);
  double origin[3], m[3][3], off = 0;
  scene_block_frame(&block, 1, origin, m, NULL);
  for (int k = 0; k < 9; k++)
    off = fmax(off, fabs(parts.sections[COUNT - 1].rotation[k / 3][k % 3] - m[k / 3][k % 3]));
  T_RATIO(off, 1e-3, "the last frame is the integrated one");
  drop(&b[0], NULL);
  drop(&b[1], NULL);

  /* Parallel planes whose frames turn about their normal. */
  stack_scene scene = {0};
  for (size_t i = 0; i < 4; i++) {
    stack_scene_slice(&scene, (double)i);
    stack_scene_rectangle(&scene, 2, 1, 6);
    omega[i][0] = omega[i][1] = 0;
    omega[i][2] = SCENE_PI / 6;
  }
  o.parameters = NULL;
  b[0] = build(&scene, &o);
  T_CHECK(!b[0].info.parallel, "parallel planes that turn are no parallel sections");
  at[2] = 3; /* at 90 degrees: 1 across x, 2 across y */
  at[1] = 1.9;
  batten_solid_evaluate(ctx, b[0].solid, 1, at, &f, g, NULL);
  double beside[3] = {1.1, 0, 3}, f_beside;
  batten_solid_evaluate(ctx, b[0].solid, 1, beside, &f_beside, NULL, NULL);
  T_CHECK(f > 0 && f_beside < 0, "a twisted bar: %.3f along, %.3f across", f, f_beside);
  drop(&b[0], &scene);
}

/* Bend radius 0.2 below the half width 0.25: the planes meet inside. The solid is the union of all sections swept. */
static void test_planes_cross(void) {
  enum { TRIALS = 3000, STEPS = 600 };
  static double points[TRIALS][3], values[TRIALS];
  scene_block block = {0.2, SCENE_PI / 2, 0, {0.25, 0.15}};
  batten_stack_options o = batten_stack_options_default();
  stack_scene scene = {0};
  o.ends[0] = o.ends[1] = BATTEN_END_PLANE;
  stack_scene_block(&scene, &block, 7, 0, 8);
  built b = build(&scene, &o);
  size_t crossing_notes = 0;
  for (size_t k = 0; k < b.note_count; k++) crossing_notes += b.notes[k].kind == BATTEN_NOTE_CROSSING;
  T_CHECK(b.status == BATTEN_W_AMBIGUOUS && b.info.crossings > 0 && crossing_notes == b.info.crossings &&
              b.info.route == BATTEN_ROUTE_SECTIONS && strstr(batten_error(ctx), "cross within both"),
          "planes that cross within sections: %zu pairs", b.info.crossings);
  uint64_t seed = 6;
  for (size_t i = 0; i < TRIALS; i++) {
    points[i][0] = -0.3 + 0.8 * t_uniform(&seed);
    points[i][1] = -0.2 + 0.4 * t_uniform(&seed);
    points[i][2] = -0.1 + 0.6 * t_uniform(&seed);
  }
  T_OK(batten_solid_evaluate(ctx, b.solid, TRIALS, points[0], values, NULL, NULL), ctx);
  size_t wrong = 0, inside = 0;
  double frames[STEPS + 1][4]; /* origin and the first axis in x, z */
  for (int k = 0; k <= STEPS; k++) {
    double origin[3], m[3][3];
    scene_block_frame(&block, (double)k / STEPS, origin, m, NULL);
    memcpy(frames[k], (double[4]){origin[0], origin[2], m[0][0], m[0][2]}, sizeof frames[k]);
  }
  for (size_t i = 0; i < TRIALS; i++) {
    const double *p = points[i];
    double deepest = -1, before = 0;
    for (int k = 0; k <= STEPS; k++) {
      const double *w = frames[k], x = (p[0] - w[0]) * w[2] + (p[2] - w[1]) * w[3],
                   z = (p[2] - w[1]) * w[2] - (p[0] - w[0]) * w[3];
      if (k > 0 && (z > 0) != (before > 0))
        deepest = fmax(deepest, fmin(block.half[0] - fabs(x), block.half[1] - fabs(p[1])));
      before = z;
    }
    inside += deepest > 0;
    wrong += fabs(deepest) > 0.01 && (deepest > 0) != (values[i] > 0);
  }
  T_CHECK(wrong == 0 && inside > 300, "the union of what the plane sweeps: %zu of %zu points inside, %zu wrong",
          inside, (size_t)TRIALS, wrong);
  drop(&b, &scene);
}

/* A ball cut by planes through its middle in no sequence. */
static void test_no_sequence(void) {
  static const double rotations[3][9] = {
      {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 1, 0, 0, 0, 1, 1, 0, 0}, {0, 0, 1, 1, 0, 0, 0, 1, 0}};
  static const double origins[3][3] = {{0.1, 0, 0.05}, {0.05, 0.1, 0}, {0, 0.05, 0.1}};
  stack_scene scene = {0};
  for (int i = 0; i < 3; i++) {
    const double *o = origins[i], *m = rotations[i];
    double height = 0, middle[2] = {0, 0};
    for (int k = 0; k < 3; k++) {
      height += o[k] * m[6 + k];
      middle[0] -= o[k] * m[k];
      middle[1] -= o[k] * m[3 + k];
    }
    stack_scene_section(&scene, o, m);
    stack_scene_disc(&scene, middle[0], middle[1], sqrt(1 - height * height), 40);
  }
  built b = build(&scene, NULL);
  batten_mesh_measures m;
  size_t crossings;
  T_CHECK(b.info.route == BATTEN_ROUTE_SPACE && b.info.crossings == 3 && b.info.centers >= 120 &&
              batten_solid_kind_of(b.solid) == BATTEN_SOLID_SPLINE,
          "planes in no sequence: one spline in space");
  T_OK(measure(b.solid, 0.2, &m, &crossings), ctx);
  T_RATIO(fabs(m.volume / (4 * SCENE_PI / 3) - 1), 0.03, "its ball");
  drop(&b, NULL);
  batten_stack_options o = batten_stack_options_default();
  o.route = BATTEN_ROUTE_SECTIONS; /* no way: still a solid, and a warning */
  b = build(&scene, &o);
  T_CHECK(b.status == BATTEN_W_AMBIGUOUS && b.solid && batten_solid_kind_of(b.solid) == BATTEN_SOLID_STACK,
          "unless the route is given");
  drop(&b, &scene);
}

/* A keel that is far thinner than its points lie apart. */
static void test_unsettled(void) {
  static const double half[] = {0.01, 0.012, 0.015, 0.02, 0.03, 0.05, 0.3, 2, 4, 4.5};
  enum { HEIGHTS = sizeof half / sizeof *half };
  stack_scene scene = {0};
  for (int i = 0; i < 2; i++) {
    stack_scene_slice(&scene, i);
    stack_scene_disc(&scene, 0, 0, 1, 2 * HEIGHTS);
    for (size_t k = 0; k < HEIGHTS; k++)
      for (size_t side = 0; side < 2; side++) {
        double *x = scene.at + 2 * (2 * HEIGHTS * (size_t)i + (side ? 2 * HEIGHTS - 1 - k : k));
        x[0] = side ? -half[k] : half[k];
        x[1] = 0.5 * (double)k;
      }
  }
  batten_stack_options o = batten_stack_options_default();
  o.method = BATTEN_SECTION_POINTS;
  built b = build(&scene, &o);
  T_STATUS(b.status, BATTEN_W_AMBIGUOUS, ctx,
           "sections: the points of 2 of 2 do not settle which side of them is inside");
  drop(&b, &scene);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  test_branches();
  test_topology();
  test_apart();
  test_ends();
  test_fitted_ends();
  test_block();
  test_velocity();
  test_planes_cross();
  test_no_sequence();
  test_unsettled();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
