/* Solids through sections as solids: taken apart and put together again, on threads, under other solids, out of
 * memory, cancelled; and all that is wrong input. */
#include <batten/frep.h>
#include <batten/mesh.h>
#include <pthread.h>

#include "stack_kinds.h"
#include "tap.h"

static batten_context *ctx;

/* Values, gradients, seeds and box in one block, as bits: [return] doubles, freed by free. */
static double *bits_of(batten_context *c, const batten_solid *s, size_t count, const double *points, size_t *size) {
  size_t seeds;
  const double *p = batten_solid_points(s, &seeds);
  *size = 4 * count + 3 * seeds + 6;
  double *bits = stack_scene_grow(NULL, *size * sizeof *bits);
  if (batten_solid_evaluate(c, s, count, points, bits, bits + count, NULL) < 0) bits[0] = NAN;
  batten_solid_box(s, bits + 4 * count, bits + 4 * count + 3);
  memcpy(bits + 4 * count + 6, p, 3 * seeds * sizeof *bits);
  return bits;
}
static bool same_bits(const double *a, size_t size_a, const double *b, size_t size_b) {
  return a[0] == a[0] && size_a == size_b && memcmp(a, b, size_a * sizeof *a) == 0;
}

/* ---- parts, threads, Hessians ---------------------------------------------------------------------------- */

enum { POINTS = 400 };

static bool same_parts(batten_context *c, const batten_solid *solid, const double *points, const double *bits,
                       size_t size) {
  batten_stack_parts parts, again;
  batten_solid *made = NULL, *twice = NULL;
  bool same =
      batten_stack_get_parts(c, solid, &parts) == BATTEN_OK && batten_stack_create(c, &parts, &made) == BATTEN_OK &&
      batten_stack_get_parts(c, made, &again) == BATTEN_OK && batten_stack_create(c, &again, &twice) == BATTEN_OK;
  if (!same) printf("# %s\n", batten_error(c));
  for (int i = 0; same && i < 2; i++) {
    size_t other;
    double *b = bits_of(c, i ? twice : made, POINTS, points, &other);
    same = same_bits(bits, size, b, other);
    free(b);
  }
  batten_solid_free(made);
  batten_solid_free(twice);
  return same;
}

/* Largest difference of gradients and of Hessians from differences of values and gradients along an axis, relative.
 */
static void check_derivatives(const batten_solid *solid, const double *points, double *gradient_error,
                              double *hessian_error) {
  enum { SOME = 60 };
  double lower[3], upper[3], errors[2][3 * SOME], scale = 0;
  batten_solid_box(solid, lower, upper);
  const double h = 1e-5 * (upper[0] - lower[0] + upper[1] - lower[1] + upper[2] - lower[2]);
  size_t made = 0;
  for (size_t i = 0; i < SOME; i++)
    for (int k = 0; k < 3; k++, made++) {
      double p[3][3], f[3], g[3][3], H[3][9];
      for (int e = 0; e < 3; e++) {
        memcpy(p[e], points + 3 * i, sizeof p[e]);
        p[e][k] += h * (e - 1);
      }
      batten_solid_evaluate(ctx, solid, 3, p[0], f, g[0], H[0]);
      for (int m = 0; m < 3; m++) scale = fmax(scale, fabs(g[1][m]));
      errors[0][made] = fabs((f[2] - f[0]) / (2 * h) - g[1][k]);
      errors[1][made] = 0;
      for (int m = 0; m < 3; m++)
        errors[1][made] = fmax(errors[1][made], h * fabs((g[2][m] - g[0][m]) / (2 * h) - H[1][3 * k + m]));
    }
  /* f has kinks, at end planes for one: nearly all places tell. */
  for (int e = 0; e < 2; e++) {
    size_t bad = 0;
    for (size_t i = 0; i < made; i++) bad += errors[e][i] <= 1e-6 * scale ? 0 : 1;
    *(e ? hessian_error : gradient_error) = (double)bad / (double)made;
  }
}

static void test_kind(size_t which) {
  static double points[POINTS][3];
  kind k;
  kind_make(which, &k);
  const char *name = kind_names[which];
  batten_solid *solid = NULL;
  batten_status st = kind_build(ctx, &k, &solid);
  T_CHECK(st >= 0 && solid && batten_solid_kind_of(solid) == BATTEN_SOLID_STACK, "%s: %s", name,
          st ? batten_error(ctx) : "built");
  random_points(solid, 5 + which, POINTS, points[0]);
  size_t size, other;
  double *bits = bits_of(ctx, solid, POINTS, points[0], &size), gradient_error, hessian_error;
  T_CHECK(same_parts(ctx, solid, points[0], bits, size), "%s: the same bits from its parts, twice", name);
  bool same = true;
  for (unsigned threads = 2; threads <= 3; threads++) {
    batten_context *c = t_context(NULL, NULL, threads);
    batten_solid *again = NULL;
    same = same && kind_build(c, &k, &again) >= 0;
    double *b = bits_of(c, again, POINTS, points[0], &other);
    same = same && same_bits(bits, size, b, other);
    free(b);
    b = bits_of(c, solid, POINTS, points[0], &other);
    same = same && same_bits(bits, size, b, other);
    free(b);
    batten_solid_free(again);
    batten_context_free(c);
  }
  T_CHECK(same, "%s: the same bits from 1, 2, 3 threads", name);
  double one[4];
  for (size_t i = 0; i < POINTS && same; i += 37) {
    batten_solid_evaluate(ctx, solid, 1, points[i], one, one + 1, NULL);
    same = memcmp(one, bits + i, sizeof *one) == 0 && memcmp(one + 1, bits + POINTS + 3 * i, 3 * sizeof *one) == 0;
  }
  T_CHECK(same, "%s: alone and in a batch", name);
  check_derivatives(solid, points[0], &gradient_error, &hessian_error);
  T_RATIO(gradient_error, 0.02, "%s: gradients against differences, share of outliers", name);
  T_RATIO(hessian_error, 0.02, "%s: Hessians against differences, share of outliers", name);
  free(bits);
  batten_solid_free(solid);
  stack_scene_free(&k.scene);
}

/* ---- under others ------------------------------------------------------------------------------------------ */

static void test_under(void) {
  static double points[POINTS][3], f[POINTS], g[POINTS], fd[POINTS][3], gd[POINTS][3];
  kind k;
  batten_solid *solid = NULL, *over = NULL, *tree = NULL;
  batten_carrier *carrier = NULL;
  batten_spline *zero = NULL;
  kind_make(9, &k);
  T_OK(kind_build(ctx, &k, &solid), ctx);
  random_points(solid, 3, POINTS, points[0]);
  batten_solid_evaluate(ctx, solid, POINTS, points[0], f, fd[0], NULL);

  /* The carrier of a spline that is 0. */
  T_OK(batten_carrier_solid(ctx, solid, &carrier), ctx);
  size_t count;
  const double *seeds = batten_solid_points(solid, &count);
  double lower[3], upper[3];
  const double corners[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}, nothing[5] = {0};
  batten_spline_data data = batten_spline_data_default();
  data.n = 3;
  data.count = 5;
  data.points = corners[0];
  data.values = nothing;
  T_OK(batten_spline_fit(ctx, &data, NULL, &zero, NULL), ctx);
  batten_solid_box(solid, lower, upper);
  T_OK(batten_solid_create(ctx, zero, carrier, 1, lower, upper, count, seeds, &over), ctx);
  batten_solid_evaluate(ctx, over, POINTS, points[0], g, gd[0], NULL);
  T_CHECK(memcmp(f, g, sizeof f) == 0 && memcmp(fd, gd, sizeof fd) == 0, "as the carrier of a solid");

  batten_frep *leaf = NULL, *ball = NULL, *both = NULL;
  const double center[3] = {0.2929, 0, 0.7071}; /* on the middle line: a hole through the flat sides */
  T_OK(batten_frep_solid(ctx, solid, &leaf), ctx);
  T_OK(batten_frep_ball(ctx, 3, center, 0.18, &ball), ctx);
  T_OK(batten_frep_combine(ctx, BATTEN_FREP_DIFFERENCE, leaf, ball, BATTEN_R_MIN_MAX, &both), ctx);
  batten_frep_evaluate(ctx, both, POINTS, points[0], g, gd[0]);
  double worst = 0;
  for (size_t i = 0; i < POINTS; i++) {
    double d = 0;
    for (int j = 0; j < 3; j++) d += (points[i][j] - center[j]) * (points[i][j] - center[j]);
    worst = fmax(worst, fabs(g[i] - fmin(f[i], sqrt(d) - 0.18)));
  }
  T_RATIO(worst, 1e-15, "as the leaf of a tree");
  for (int d = 0; d < 3; d++) lower[d] -= 0.2, upper[d] += 0.2;
  T_OK(batten_frep_to_solid(ctx, both, lower, upper, 0.12, &tree), ctx);
  batten_field field = batten_solid_field(tree);
  batten_polygonize_options o = batten_polygonize_options_default();
  batten_mesh *mesh = NULL;
  batten_mesh_measures m = {0};
  o.cell = 0.04;
  seeds = batten_solid_points(tree, &count);
  T_OK(batten_polygonize(ctx, &field, count, seeds, &o, &mesh, NULL), ctx);
  batten_mesh_measure(ctx, mesh, &m);
  T_CHECK(m.closed && m.manifold && m.components == 1 && m.genus == 1, "the tree's mesh: %zu components, genus %ld",
          m.components, m.genus);
  batten_mesh_free(mesh);
  batten_frep_free(leaf);
  batten_frep_free(ball);
  batten_frep_free(both);
  batten_solid_free(tree);
  batten_solid_free(over);
  batten_carrier_free(carrier);
  batten_spline_free(zero);
  batten_solid_free(solid);
  stack_scene_free(&k.scene);
}

/* ---- host threads --------------------------------------------------------------------------------------------- */

enum { BOXES = 20 };

typedef struct host {
  const batten_solid *solid;
  const double *points;
  double values[POINTS], gradients[POINTS][3], ranges[BOXES][2];
  batten_status status;
} host;

static void *ask_on_thread(void *arg) {
  host *h = arg;
  batten_context *c = t_context(NULL, NULL, 2);
  h->status = BATTEN_OK;
  for (int round = 0; round < 3 && h->status >= 0; round++) {
    batten_solid *own = batten_solid_retain((batten_solid *)h->solid);
    h->status = batten_solid_evaluate(c, own, POINTS, h->points, h->values, h->gradients[0], NULL);
    for (size_t i = 0; i < BOXES && h->status >= 0; i++) {
      double box[2][3];
      for (size_t k = 0; k < 3; k++) {
        box[0][k] = fmin(h->points[6 * i + k], h->points[6 * i + 3 + k]);
        box[1][k] = fmax(h->points[6 * i + k], h->points[6 * i + 3 + k]);
      }
      h->status = batten_solid_bounds(c, own, 1, box[0], h->ranges[i]);
    }
    batten_solid_free(own);
  }
  batten_context_free(c);
  return NULL;
}

static void test_host_threads(void) {
  static const size_t kinds[] = {3, 9};
  static double points[POINTS][3];
  static host hosts[3];
  for (size_t i = 0; i < 2; i++) {
    kind k;
    batten_solid *solid = NULL;
    kind_make(kinds[i], &k);
    kind_build(ctx, &k, &solid);
    random_points(solid, 2, POINTS, points[0]);
    pthread_t threads[2];
    for (int h = 0; h < 3; h++) hosts[h] = (host){.solid = solid, .points = points[0]};
    for (int h = 0; h < 2; h++) pthread_create(&threads[h], NULL, ask_on_thread, &hosts[h]);
    for (int h = 0; h < 2; h++) pthread_join(threads[h], NULL);
    ask_on_thread(&hosts[2]);
    bool same = hosts[2].status == BATTEN_OK;
    for (int h = 0; h < 2; h++) same = same && memcmp(&hosts[h], &hosts[2], sizeof hosts[h]) == 0;
    T_CHECK(same, "%s: asked from two threads of the host at a time", kind_names[kinds[i]]);
    batten_solid_free(solid);
    stack_scene_free(&k.scene);
  }
}

/* ---- out of memory, cancelled ------------------------------------------------------------------------------- */

/* A small stack: bent, parallel and linked, or by points in no order and to an apex. */
static void small_make(int which, kind *k) {
  *k = (kind){.o = batten_stack_options_default()};
  if (which == 0) {
    const scene_block block = {1, 0.6, 0.3, {0.25, 0.15}};
    stack_scene_block(&k->scene, &block, 3, 0, 3);
    for (size_t i = 0; i < 3; i++) k->omega[i][1] = 1;
    k->o.rotation = BATTEN_ROTATION_VELOCITY;
    k->o.angular_velocity = k->omega[0];
  } else if (which == 1) {
    stack_scene_shifted(&k->scene, 2, 1, 2.5, 1, 10);
    k->o.link = 1;
    k->o.ends[0] = BATTEN_END_ROUNDED;
  } else {
    stack_scene_slice(&k->scene, 0);
    stack_scene_disc(&k->scene, 0, 0, 1, 10);
    stack_scene_slice(&k->scene, 1);
    stack_scene_loop(&k->scene, 1, (const double[2]){0, 0});
    k->o.apex = 1;
    k->o.method = BATTEN_SECTION_CARRIER;
  }
  k->o.tolerance = 0.05; /* few centres: built once for every allocation */
  stack_scene_sections(&k->scene);
}

static batten_status use_build(batten_context *c, void *arg) {
  const kind *k = arg;
  batten_solid *out = (batten_solid *)arg;
  batten_stack_note *notes = arg;
  size_t count = 77;
  batten_stack_info info = {.sections = 77};
  batten_status st = batten_stack_build(c, k->scene.count, k->scene.sections, &k->o, &out, &info, &notes, &count);
  if (st < 0) return out == arg && notes == arg && count == 77 && info.sections == 77 ? st : BATTEN_E_INVALID;
  batten_solid_free(out);
  batten_free(c, notes);
  return st;
}
static batten_status use_create(batten_context *c, void *arg) {
  batten_solid *out = NULL;
  batten_status st = batten_stack_create(c, arg, &out);
  if (st < 0) return out ? BATTEN_E_INVALID : st;
  batten_solid_free(out);
  return st;
}
static batten_status use_evaluate(batten_context *c, void *arg) {
  double points[40][3], values[40], gradients[40][3], hessians[40][9], boxes[10][2][3] = {{{0}}}, ranges[10][2];
  random_points(arg, 6, 40, points[0]);
  for (size_t i = 0; i < 10; i++)
    for (int k = 0; k < 3; k++) {
      boxes[i][0][k] = points[i][k];
      boxes[i][1][k] = points[i][k] + 0.1;
    }
  batten_status st = batten_solid_evaluate(c, arg, 40, points[0], values, gradients[0], hessians[0]);
  return st < 0 ? st : batten_solid_bounds(c, arg, 10, boxes[0][0], ranges[0]);
}

static void test_failures(void) {
  static const char *const names[] = {"swept", "linked", "points to an apex"};
  for (int which = 0; which < 3; which++) {
    kind k;
    char what[80];
    batten_solid *solid = NULL;
    batten_stack_parts parts;
    small_make(which, &k);
    batten_status st = kind_build(ctx, &k, &solid);
    T_CHECK(st >= 0, "%s: %s", names[which], st ? batten_error(ctx) : "built");
    batten_stack_get_parts(ctx, solid, &parts);
    snprintf(what, sizeof what, "build, %s,", names[which]);
    t_fail_every_allocation(what, use_build, &k);
    t_cancel_every_progress(what, use_build, &k);
    snprintf(what, sizeof what, "create, %s,", names[which]);
    t_fail_every_allocation(what, use_create, &parts);
    snprintf(what, sizeof what, "evaluate, %s,", names[which]);
    t_fail_every_allocation(what, use_evaluate, solid);
    batten_solid_free(solid);
    stack_scene_free(&k.scene);
  }
}

/* ---- what makes no sense ---------------------------------------------------------------------------------- */

static void bad(stack_scene *scene, const batten_stack_options *o, const char *text) {
  batten_solid *out = (batten_solid *)scene;
  batten_stack_note *notes = (batten_stack_note *)scene;
  size_t count = 55;
  batten_stack_info info = {.sections = 55}, before = info;
  const batten_section *sections = stack_scene_sections(scene);
  T_STATUS(batten_stack_build(ctx, scene->count, sections, o, &out, &info, &notes, &count), BATTEN_E_INVALID, ctx,
           text);
  if (out != (batten_solid *)scene || notes != (batten_stack_note *)scene || count != 55 ||
      memcmp(&info, &before, sizeof info) != 0)
    t_line(false, "outputs untouched: %s", text);
}

static void discs(stack_scene *scene) {
  static const double radii[3] = {2, 2, 2};
  stack_scene_free(scene);
  stack_scene_discs(scene, 3, radii, 1, 12);
}

static void test_bad_sections(void) {
  stack_scene scene = {0};
  discs(&scene);
  stack_scene_disc(&scene, 1, 0, 2, 12);
  bad(&scene, NULL, "sections[2].contours[0]: crosses or overlaps contours[1] at (");
  discs(&scene);
  for (int k = 0; k < 2; k++) {
    double swap = scene.at[2 * (12 + 3) + k];
    scene.at[2 * (12 + 3) + k] = scene.at[2 * (12 + 9) + k];
    scene.at[2 * (12 + 9) + k] = swap;
  }
  bad(&scene, NULL, "sections[1].contours[0]: crosses or overlaps itself at (");
  discs(&scene);
  scene.sections[2].origin[2] = 1;
  bad(&scene, NULL, "sections[2]: its plane coincides with that of sections[1]; join their contours");
  scene.sections[2].origin[2] = 0.5;
  bad(&scene, NULL, "sections[2]: lies 0.5 behind the plane of sections[1]; order sections along their normals");
  discs(&scene);
  scene.sections[1].rotation[0][0] = 1.01;
  bad(&scene, NULL, "sections[1].rotation: not a rotation, off by 0.0201; rows must be orthonormal to 1e-6");
  discs(&scene);
  scene.sections[1].rotation[0][0] = -1; /* left-handed */
  bad(&scene, NULL, "sections[1].rotation: not a rotation");
  discs(&scene);
  scene.sections[2].origin[1] = NAN;
  bad(&scene, NULL, "sections[2].origin[1]: nan; give finite numbers");
  discs(&scene);
  scene.at[2 * 12 + 5] = INFINITY;
  bad(&scene, NULL, "sections[1].points[2]: coordinate 1 is inf; give finite numbers");
  discs(&scene);
  stack_scene_slice(&scene, 3);
  stack_scene_loop(&scene, 2, (const double[4]){0, 0, 1, 0});
  bad(&scene, NULL, "sections[3].contours[0]: 2 points; give at least 3, or set opt.apex to end the solid there");
  stack_scene_slice(&scene, 4);
  stack_scene_disc(&scene, 0, 0, 2, 12);
  bad(&scene, NULL, "sections[3].contours[0]: 2 points; give at least 3, or leave the section out");
  discs(&scene);
  stack_scene_slice(&scene, 3);
  bad(&scene, NULL, "sections[3].contour_count: 0; give a contour, or leave it out");
  stack_scene_free(&scene);
}

static void test_bad_options(void) {
  stack_scene scene = {0};
  batten_stack_options o = batten_stack_options_default();
  double scales[3] = {1, 0, 1}, t[3] = {0, 1, 1};
  discs(&scene);
#define BAD_OPTION(member, value, text) \
  do {                                  \
    o = batten_stack_options_default(); \
    o.member = (value);                 \
    bad(&scene, &o, text);              \
  } while (0)
  BAD_OPTION(struct_size, 3, "batten_stack_options");
  BAD_OPTION(method, (batten_section_method)9, "opt.method: 9; give one of its names");
  BAD_OPTION(ends[1], (batten_stack_end)4, "opt.ends[1]: 4; give one of its names");
  BAD_OPTION(tolerance, -1, "opt.tolerance: -1; must be finite and 0 or more");
  BAD_OPTION(end_height[1], NAN, "opt.end_height[1]: nan; must be finite and 0 or more");
  BAD_OPTION(pair_distance, 2, "opt.pair_distance: 2; give 0 < it <= 1");
  BAD_OPTION(shape, 0, "opt.shape: 0; must be finite and above 0");
  BAD_OPTION(saturation, 0, "opt.saturation: 0; must be above 0 (INFINITY: none)");
  BAD_OPTION(scales, scales, "opt.scales[1]: 0; must be finite and above 0");
  BAD_OPTION(parameters, t, "opt.parameters[2]: 1 after 1; must increase");
  BAD_OPTION(rotation, BATTEN_ROTATION_VELOCITY, "opt.angular_velocity: NULL; BATTEN_ROTATION_VELOCITY needs it");
#undef BAD_OPTION
  stack_scene_free(&scene);
  stack_scene_slice(&scene, 0);
  stack_scene_disc(&scene, 0, 0, 1, 12);
  bad(&scene, NULL, "opt.gap: 0; one section needs the distance that it stands for");
  batten_solid *out = NULL;
  batten_stack_note *notes = NULL;
  T_STATUS(batten_stack_build(ctx, 0, NULL, NULL, &out, NULL, NULL, NULL), BATTEN_E_INVALID, ctx,
           "sections: 0; give at least one");
  T_STATUS(batten_stack_build(ctx, 1, scene.sections, NULL, NULL, NULL, NULL, NULL), BATTEN_E_INVALID, ctx,
           "out: NULL; give the place for the solid");
  T_STATUS(batten_stack_build(ctx, 1, scene.sections, NULL, &out, NULL, &notes, NULL), BATTEN_E_INVALID, ctx,
           "note_count: NULL");
  stack_scene_free(&scene);
}

static void test_bad_parts(void) {
  kind k;
  batten_solid *solid = NULL, *out = NULL, *flat = NULL;
  batten_stack_parts good, p;
  kind_make(3, &k);
  T_OK(kind_build(ctx, &k, &solid), ctx);
  T_OK(batten_stack_get_parts(ctx, solid, &good), ctx);
  double w[3] = {1, -1, 1}, t[3] = {0, 2, 2};
  batten_solid *functions[3] = {good.functions[0], good.functions[1], NULL};
  batten_stack_link link = good.links[0];
#define BAD_PART(member, value, text)                                          \
  do {                                                                         \
    p = good;                                                                  \
    p.member = (value);                                                        \
    T_STATUS(batten_stack_create(ctx, &p, &out), BATTEN_E_INVALID, ctx, text); \
  } while (0)
  BAD_PART(struct_size, 1, "batten_stack_parts");
  BAD_PART(functions, NULL, "NULL; give arrays");
  BAD_PART(functions, functions, "functions[2]: NULL; give a solid of dimension 2");
  functions[2] = solid;
  BAD_PART(functions, functions, "functions[2]: not in the plane");
  BAD_PART(saturations, w, "saturations[1]: -1; give a positive number");
  BAD_PART(parameters, t, "opt.parameters[2]: 2 after 2; must increase");
  BAD_PART(end_lengths[1], NAN, "end_lengths[1]: nan; give a length >= 0");
  BAD_PART(shape, -1, "opt.shape: -1");
  p = good;
  p.links = &link;
  p.link_count = 1;
  link.loop[1] = 5;
  T_STATUS(batten_stack_create(ctx, &p, &out), BATTEN_E_INVALID, ctx, "links[0]: section 0, loops 0 and 5");
  link.section = 2;
  T_STATUS(batten_stack_create(ctx, &p, &out), BATTEN_E_INVALID, ctx, "links[0]: section 2");
  T_STATUS(batten_stack_create(ctx, NULL, &out), BATTEN_E_INVALID, ctx, "parts: NULL");
  T_STATUS(batten_stack_create(ctx, &good, NULL), BATTEN_E_INVALID, ctx, "out: NULL");
  T_STATUS(batten_stack_get_parts(ctx, NULL, &p), BATTEN_E_INVALID, ctx, "solid: NULL");
  T_STATUS(batten_stack_get_parts(ctx, good.functions[0], &p), BATTEN_E_INVALID, ctx, "solid: not of sections");
  T_CHECK(!out, "outputs untouched");
  batten_solid_free(flat);
  batten_solid_free(solid);
  stack_scene_free(&k.scene);
}

int main(void) {
  ctx = t_context(NULL, NULL, 1);
  for (size_t i = 0; kind_names[i]; i++) test_kind(i);
  test_under();
  test_host_threads();
  test_failures();
  test_bad_sections();
  test_bad_options();
  test_bad_parts();
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing is left");
  batten_context_free(ctx);
  return t_done();
}
