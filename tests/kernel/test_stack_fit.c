/* Functions of sections: their signs, where they vanish, and that threads change nothing. */
#include "base/checked.h"
#include "section/section_inner.h"
#include "stack_scenes.h"
#include "tap.h"

/* A stack as input.c makes it, as far as fits look at it. */
static stack make_stack(batten_context *ctx, stack_scene *scene) {
  stack s = {.ctx = ctx, .count = scene->count};
  const batten_section *given = stack_scene_sections(scene);
  s.sections = calloc(s.count, sizeof *s.sections);
  for (size_t i = 0; i < s.count; i++) {
    polygon_fault fault;
    batten_status st = polygon_set_make(ctx, given[i].contour_count, given[i].starts, given[i].points, 0,
                                        &s.sections[i].loops, NULL, &fault);
    if (st < 0) T_CHECK(false, "loops of section %zu: %s", i, batten_error(ctx));
  }
  return s;
}
static void free_stack(stack *s) {
  for (size_t i = 0; i < s->count; i++) {
    polygon_set_free(&s->sections[i].loops);
    batten_solid_free(s->sections[i].function);
  }
  free(s->sections);
}

static double value_at(batten_context *ctx, const batten_solid *s, double x, double y, double *gradient) {
  double p[2] = {x, y}, f = NAN;
  batten_solid_evaluate(ctx, s, 1, p, &f, gradient, NULL);
  return f;
}

/* ---- one section --------------------------------------------------------------------------------- */

typedef struct fitted {
  stack s;
  section_figures figures;
  double tolerance;
} fitted;

static fitted fit_first(batten_context *ctx, stack_scene *scene, double part) {
  fitted f = {.s = make_stack(ctx, scene)};
  f.tolerance = part * f.s.sections[0].loops.spacing;
  batten_status st =
      section_fit_proven(ctx, &f.s.sections[0].loops, f.tolerance, 0.75, &f.s.sections[0].function, &f.figures);
  if (st < 0) T_CHECK(false, "fit: %s", batten_error(ctx));
  return f;
}

/* Deepest wrong sign against a function of the caller's whose |value| is no more than the distance, on a fine grid.
 */
static double deepest(batten_context *ctx, const batten_solid *s, double (*exact)(const double *), double low,
                      double high) {
  enum { SIDE = 300 };
  double *p = malloc(SIDE * SIDE * 2 * sizeof *p), *f = malloc(SIDE * SIDE * sizeof *f), worst = 0;
  for (size_t i = 0; i < SIDE * SIDE; i++) {
    p[2 * i] = low + (high - low) * ((double)(i % SIDE) + 0.5) / SIDE;
    p[2 * i + 1] = low + (high - low) * ((double)(i / SIDE) + 0.5) / SIDE;
  }
  batten_solid_evaluate(ctx, s, SIDE * SIDE, p, f, NULL, NULL);
  for (size_t i = 0; i < SIDE * SIDE; i++) {
    double e = exact(p + 2 * i);
    if (f[i] * e < 0) worst = fmax(worst, fabs(e));
  }
  free(p);
  free(f);
  return worst;
}

/* On the circle F is 0 and falls by 1 a unit of length. */
static void test_disc(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_disc(&scene, 3, -2, 10, 60);
  fitted f = fit_first(ctx, &scene, 0.1);
  const batten_solid *s = f.s.sections[0].function;
  double miss = 0, slope = 0, df[2];
  for (int i = 0; i < 997; i++) {
    double a = 2 * SCENE_PI * i / 997, x = cos(a), y = sin(a);
    miss = fmax(miss, fabs(value_at(ctx, s, 3 + 10 * x, -2 + 10 * y, df)));
    slope = fmax(slope, fabs(-(df[0] * x + df[1] * y) - 1));
  }
  T_RATIO(miss, f.tolerance, "disc: |F| on the circle (%zu centres for 60 points)", f.figures.centers);
  T_RATIO(slope, 0.1, "disc: slope across the circle is 1");
  T_RATIO(fabs(value_at(ctx, s, 3, -2, NULL) - 10), 6, "disc: F in the middle is of the size of the distance");
  double lower[2], upper[2];
  size_t count;
  const double *points = batten_solid_points(s, &count);
  batten_solid_box(s, lower, upper);
  T_CHECK(lower[0] == -7 && upper[0] == 13, "disc: box of the points");
  miss = 0;
  for (size_t i = 0; i < count; i++)
    miss = fmax(miss, fabs(value_at(ctx, s, points[2 * i], points[2 * i + 1], NULL)));
  T_CHECK(count >= 8 && count < f.figures.centers / 2, "disc: %zu of the centres are points of the surface", count);
  T_RATIO(miss, 1e-10, "disc: F at these");
  T_OK(section_certify(ctx, &f.s.sections[0].loops, s, f.tolerance, &f.figures, NULL), ctx);
  T_CHECK(f.figures.certified, "disc: certified, miss %.3g, wrong sign %.3g of %.3g", f.figures.residual_max,
          f.figures.wrong_sign_max, f.tolerance);
  free_stack(&f.s);
  stack_scene_free(&scene);
}

static double exact_comb(const double *p) { return scene_comb(5, 3, p); }
static double exact_annulus(const double *p) {
  double r = hypot(p[0], p[1]);
  return fmin(10 - r, r - 4);
}
static double exact_crescent(const double *p) {
  double q[2] = {p[0] / 10, p[1] / 10};
  return 10 * scene_crescent(q);
}
static double exact_plate(const double *p) { return fmin(6 - fabs(p[0]), 0.15 - fabs(p[1])); }

/* Shapes that carriers alone fill with phantoms; the truth is a function of its own. The polygon's own sagitta comes
 * on top of the tolerance. */
static void test_shapes(batten_context *ctx) {
  static const char *const names[] = {"comb", "annulus", "crescent", "thin plate"};
  double (*const exact[])(const double *) = {exact_comb, exact_annulus, exact_crescent, exact_plate};
  for (int shape = 0; shape < 4; shape++) {
    stack_scene scene = {0};
    stack_scene_slice(&scene, 0);
    if (shape == 0) stack_scene_comb(&scene, 5, 3, 6);
    if (shape == 1) stack_scene_disc(&scene, 0, 0, 4, 40), stack_scene_disc(&scene, 0, 0, 10, 90);
    if (shape == 2) stack_scene_crescent(&scene, 10, 120);
    if (shape == 3) stack_scene_rectangle(&scene, 6, 0.15, 30);
    fitted f = fit_first(ctx, &scene, 0.1);
    const polygon_set *loops = &f.s.sections[0].loops;
    double sagitta = shape == 0 || shape == 3 ? 0 : loops->spacing * loops->spacing / (8 * 4);
    double depth = deepest(ctx, f.s.sections[0].function, exact[shape], -20, 20);
    T_RATIO(depth, f.tolerance + sagitta, "%s: deepest wrong sign over a fine grid (%zu centres, %zu points)",
            names[shape], f.figures.centers, loops->starts[loops->count]);
    T_OK(section_certify(ctx, loops, f.s.sections[0].function, f.tolerance, &f.figures, NULL), ctx);
    T_CHECK(f.figures.certified && f.figures.residual_max <= 1.05 * f.tolerance,
            "%s: certified, miss %.3g, wrong sign %.3g of %.3g", names[shape], f.figures.residual_max,
            f.figures.wrong_sign_max, f.tolerance);
    free_stack(&f.s);
    stack_scene_free(&scene);
  }
}

/* What is awkward: parts thinner than the tolerance, corners with long edges, spikes, places where loops touch,
 * points that nearly coincide. */
static void test_awkward(batten_context *ctx) {
  static const char *const names[] = {"sliver", "spikes", "touching", "thin ring", "dense"};
  for (int shape = 0; shape < 5; shape++) {
    stack_scene scene = {0};
    stack_scene_slice(&scene, 0);
    if (shape == 0) stack_scene_loop(&scene, 4, (double[]){0, 0, 3, 0, 3, 0.01, 0, 0.01});
    double spikes[80];
    for (int i = 0; i < 40; i++) {
      double r = i % 2 ? 1 : 5, a = 2 * SCENE_PI * i / 40;
      spikes[2 * i] = r * cos(a);
      spikes[2 * i + 1] = r * sin(a);
    }
    if (shape == 1) stack_scene_loop(&scene, 40, spikes);
    if (shape == 2) stack_scene_loop(&scene, 4, (double[]){0, 0, 1, -1, 2, 0, 1, 1});
    if (shape == 2) stack_scene_loop(&scene, 4, (double[]){2, 0, 3, -1, 4, 0, 3, 1});
    if (shape == 3) stack_scene_disc(&scene, 0, 0, 10, 60), stack_scene_disc(&scene, 0, 0, 9.99, 60);
    if (shape == 4) stack_scene_disc(&scene, 0, 0, 10, 1500);
    fitted f = fit_first(ctx, &scene, shape == 0 ? 0.5 : 0.1);
    T_OK(section_certify(ctx, &f.s.sections[0].loops, f.s.sections[0].function, f.tolerance, &f.figures, NULL), ctx);
    T_CHECK(f.figures.certified, "%s: certified, wrong sign %.3g of %.3g (%zu centres)", names[shape],
            f.figures.wrong_sign_max, f.tolerance, f.figures.centers);
    if (shape == 4) T_CHECK(f.figures.centers < 500, "dense points do not cost a centre each");
    free_stack(&f.s);
    stack_scene_free(&scene);
  }
}

static void test_random(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_random(&scene, 8, 40, 60);
  stack s = make_stack(ctx, &scene);
  size_t certified = 0, centers = 0;
  double depth = 0, miss = 0;
  for (size_t i = 0; i < s.count; i++) {
    section_figures figures;
    double tolerance = 0.1 * s.sections[i].loops.spacing;
    if (section_fit_proven(ctx, &s.sections[i].loops, tolerance, 0.75, &s.sections[i].function, &figures) < 0)
      continue;
    centers += figures.centers;
    section_certify(ctx, &s.sections[i].loops, s.sections[i].function, tolerance, &figures, NULL);
    certified += figures.certified;
    depth = fmax(depth, figures.wrong_sign_max / tolerance);
    miss = fmax(miss, figures.residual_max / tolerance);
  }
  T_CHECK(certified == 40,
          "random: %zu of 40 certified, %.2f and miss %.2f tolerances at most, %zu centres for %zu "
          "points (seed 8)",
          certified, depth, miss, centers, scene.points);
  free_stack(&s);
  stack_scene_free(&scene);
}

/* Twice the size: twice the values, to the bit. Turned round: the same shape. */
static void test_invariance(batten_context *ctx) {
  stack_scene scenes[3] = {{0}, {0}, {0}};
  fitted f[3];
  for (int k = 0; k < 3; k++) {
    stack_scene_slice(&scenes[k], 0);
    stack_scene_crescent(&scenes[k], k == 1 ? 20 : 10, 80);
    size_t count = scenes[k].points;
    for (size_t i = 0; k == 2 && i < count / 2; i++)
      for (size_t c = 0; c < 2; c++) {
        double *a = &scenes[k].at[2 * i + c], *b = &scenes[k].at[2 * (count - 1 - i) + c], x = *a;
        *a = *b;
        *b = x;
      }
    f[k] = fit_first(ctx, &scenes[k], 0.1);
  }
  double worst = 0, reversed = 0;
  for (int i = 0; i < 400; i++) {
    double x = -15 + 1.5 * (i % 20), y = -15 + 1.5 * (i / 20);
    double a = value_at(ctx, f[0].s.sections[0].function, x, y, NULL);
    worst = fmax(worst, fabs(2 * a - value_at(ctx, f[1].s.sections[0].function, 2 * x, 2 * y, NULL)));
    if (fabs(a) < 1) reversed = fmax(reversed, fabs(a - value_at(ctx, f[2].s.sections[0].function, x, y, NULL)));
  }
  T_CHECK(worst == 0, "twice the size: twice the values to the bit (off by %g)", worst);
  T_RATIO(reversed, 2 * f[0].tolerance, "run the other way round: the same near the curve");
  for (int k = 0; k < 3; k++) {
    free_stack(&f[k].s);
    stack_scene_free(&scenes[k]);
  }
}

/* A proof must not pass what is wrong: the function of one section against the loops of another. */
static void test_proof(batten_context *ctx) {
  stack_scene scene = {0};
  const double radii[2] = {10, 11};
  stack_scene_discs(&scene, 2, radii, 1, 80);
  fitted f = fit_first(ctx, &scene, 0.1);
  section_figures figures = {0};
  T_OK(section_certify(ctx, &f.s.sections[1].loops, f.s.sections[0].function, f.tolerance, &figures, NULL), ctx);
  T_CHECK(!figures.certified, "a function of another disc is not certified");
  T_RATIO(fabs(figures.wrong_sign_max - 0.5), 0.5 + f.tolerance,
          "and its depth %.3g is told: up to 1 and the tolerance", figures.wrong_sign_max);
  T_RATIO(fabs(figures.residual_max - 1), 0.2, "its miss too");
  free_stack(&f.s);
  stack_scene_free(&scene);
}

/* A small phantom between the places next to the loops and those of the grid: a hole that the loops do not have. */
static void test_phantom(batten_context *ctx) {
  stack_scene scene = {0};
  const double radius = 10;
  stack_scene_discs(&scene, 1, &radius, 1, 2000);
  stack_scene_disc(&scene, 9.85 * cos(1), 9.85 * sin(1), 0.05, 20);
  stack_scene_discs(&scene, 1, &radius, 1, 2000);
  stack s = make_stack(ctx, &scene);
  section_figures figures = {0};
  batten_solid *function = NULL;
  const double tolerance = 0.1 * s.sections[1].loops.spacing;
  T_CHECK(section_fit_proven(ctx, &s.sections[0].loops, tolerance, 0.75, &function, &figures) >= 0, "%s",
          batten_error(ctx));
  T_OK(section_certify(ctx, &s.sections[0].loops, function, tolerance, &figures, NULL), ctx);
  T_CHECK(figures.certified, "a disc with a hole near its edge: wrong sign %.3g", figures.wrong_sign_max);
  T_OK(section_certify(ctx, &s.sections[1].loops, function, tolerance, &figures, NULL), ctx);
  T_CHECK(!figures.certified && figures.wrong_sign_max > 0.1 && figures.wrong_sign_max <= 0.2,
          "the same is no disc: wrong sign %.3g, a grid has cells of %.3g", figures.wrong_sign_max, 20.0 / 64);
  batten_solid_free(function);
  free_stack(&s);
  stack_scene_free(&scene);
}

/* A function that misses by a little more than the tolerance all along long edges, which have no vertices. */
static void test_miss(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_rectangle(&scene, 10, 10, 1);
  fitted f = fit_first(ctx, &scene, 0.0005); /* 0.01 */
  section_figures figures = {0};
  T_OK(section_certify(ctx, &f.s.sections[0].loops, f.s.sections[0].function, f.tolerance, &figures, NULL), ctx);
  T_CHECK(figures.certified, "a square of four points: wrong sign %.3g, tolerance %.3g", figures.wrong_sign_max,
          f.tolerance);
  stack_scene larger = {0};
  stack_scene_slice(&larger, 0);
  stack_scene_polygon(&larger, 12, (const double[]){-10, -10, 3, -10, 3.05, -10.03, 3.1, -10.03, 3.15, -10, 10,  -10,
                                                    10,  10,  3, 10,  2,    10,     1,   10,     -10,  10,  -10, 9},
                      1);
  stack s = make_stack(ctx, &larger);
  T_OK(section_certify(ctx, &s.sections[0].loops, f.s.sections[0].function, 0.012, &figures, NULL), ctx);
  T_CHECK(!figures.certified, "a bump of 0.03 by 0.1 is missed: wrong sign %.3g", figures.wrong_sign_max);
  T_OK(section_certify(ctx, &f.s.sections[0].loops, f.s.sections[0].function, 0.012, &figures, NULL), ctx);
  T_CHECK(figures.certified, "the square within 0.012: wrong sign %.3g", figures.wrong_sign_max);
  free_stack(&s);
  free_stack(&f.s);
  stack_scene_free(&larger);
  stack_scene_free(&scene);
}

/* Dense points in one place do not ask for as many all along the edges of a loop of four. */
static void test_coarse_and_dense(batten_context *ctx) {
  stack_scene scene = {0};
  stack_scene_slice(&scene, 0);
  stack_scene_rectangle(&scene, 50, 50, 1);
  stack_scene_disc(&scene, 0, 0, 1, 2000);
  batten_solid *solid = NULL;
  batten_stack_info info;
  T_OK(batten_section_fit(ctx, stack_scene_sections(&scene), NULL, &solid, &info), ctx);
  T_RATIO(fabs(info.tolerance - 1e-4 * hypot(100, 100)), 1e-12, "tolerance %.4g, spacing %.3g", info.tolerance,
          info.spacing);
  T_CHECK(info.certified == 1 && info.centers < 1500, "%zu centres in %.2f s", info.centers, info.time_fit_s);
  batten_solid_free(solid);
  stack_scene_free(&scene);
}

/* ---- points in no order ---------------------------------------------------------------------------- */

static void test_points(batten_context *ctx) {
  stack_scene scene = {0};
  uint64_t seed = 3;
  stack_scene_slice(&scene, 0);
  stack_scene_disc(&scene, 0, 0, 10, 60);
  for (size_t i = scene.points - 1; i > 0; i--) {
    size_t j = t_random(&seed) % (i + 1);
    for (size_t c = 0; c < 2; c++) {
      double x = scene.at[2 * i + c];
      scene.at[2 * i + c] = scene.at[2 * j + c];
      scene.at[2 * j + c] = x;
    }
  }
  for (int method = BATTEN_SECTION_POINTS; method <= BATTEN_SECTION_CARRIER; method++) {
    section_figures figures = {0};
    batten_solid *s = NULL;
    T_OK(section_fit_points(ctx, (batten_section_method)method, scene.points, scene.at, &s, &figures), ctx);
    double worst = 0;
    for (int i = 0; i < 500; i++) {
      double a = 2 * SCENE_PI * i / 500;
      if (value_at(ctx, s, 9.8 * cos(a), 9.8 * sin(a), NULL) <= 0) worst = 1;
      if (value_at(ctx, s, 10.2 * cos(a), 10.2 * sin(a), NULL) >= 0) worst = 1;
    }
    T_CHECK(worst == 0 && figures.centers >= 60 && figures.certified && figures.residual_max < 1e-8,
            "points in no order, method %d: %zu centres, miss %.3g", method, figures.centers, figures.residual_max);
    batten_solid_free(s);
  }
  stack_scene_free(&scene);
}

/* ---- all of a stack -------------------------------------------------------------------------------- */

static batten_status fit_scene(batten_context *ctx, stack_scene *scene, stack *s, section_figures *figures) {
  batten_stack_options options = {.struct_size = sizeof options, .pair_distance = 0.75};
  *s = make_stack(ctx, scene);
  return stack_fit_all(ctx, s, stack_scene_sections(scene), &options, 0.05, figures);
}

static bool same_figures(size_t count, const section_figures *a, const section_figures *b) {
  size_t same = 0;
  for (size_t i = 0; i < count; i++)
    same += a[i].centers == b[i].centers && a[i].residual_max == b[i].residual_max && a[i].status == b[i].status &&
            a[i].wrong_sign_max == b[i].wrong_sign_max && a[i].certified == b[i].certified;
  return same == count;
}

static size_t count_differing(const stack *a, const stack *b) {
  size_t differing = 0;
  for (size_t i = 0; i < a->count; i++) {
    batten_spline_parts p, q;
    batten_spline_get_parts(batten_solid_spline(a->sections[i].function), &p);
    batten_spline_get_parts(batten_solid_spline(b->sections[i].function), &q);
    differing += p.count != q.count || memcmp(p.centers, q.centers, p.count * 2 * sizeof(double)) ||
                 memcmp(p.coefficients, q.coefficients, p.count * sizeof(double)) ||
                 memcmp(p.polynomial, q.polynomial, 3 * sizeof(double)) || p.scale != q.scale;
  }
  return differing;
}

/* The host runs the loop in its own way: here the last task first, on one thread. */
static void backwards(void *user, size_t tasks, void (*task)(void *arg, size_t index), void *arg) {
  (void)user;
  while (tasks > 0) task(arg, --tasks);
}

static void test_threads(void) {
  stack_scene scene = {0};
  enum { COUNT = 30, RUNS = 5 };
  stack_scene_random(&scene, 21, COUNT, 40);
  stack s[RUNS];
  section_figures figures[RUNS][COUNT];
  batten_context *ctx[RUNS];
  size_t same = 0, direct = 0;
  for (unsigned k = 0; k < RUNS; k++) {
    batten_context_options o = batten_context_options_default();
    o.threads = k == 4 ? 1 : k + 1;
    if (k == 3) o.parallel_for = backwards;
    if (k == 4) o.memory_limit = 3000000; /* too little for an arena */
    batten_context_new(&o, &ctx[k]);
    T_OK(fit_scene(ctx[k], &scene, &s[k], figures[k]), ctx[k]);
    same += count_differing(&s[0], &s[k]) == 0 && same_figures(COUNT, figures[0], figures[k]);
  }
  T_CHECK(same == RUNS, "same bits with 1, 2, 3 threads, a host's loop, and without room for arenas");
  for (size_t i = 0; i < COUNT; i++) {
    stack_section one = s[0].sections[i];
    section_figures own = {0};
    stack lone = {.count = 1, .sections = &one}, of = {.count = 1, .sections = &s[0].sections[i]};
    section_fit_proven(ctx[0], &one.loops, 0.05, 0.75, &one.function, &own);
    direct += count_differing(&lone, &of) == 0 && own.centers == figures[0][i].centers && figures[0][i].certified;
    batten_solid_free(one.function);
  }
  T_CHECK(direct == COUNT, "each section as if it were alone, and certified: %zu of %d", direct, COUNT);
  for (unsigned k = 0; k < RUNS; k++) {
    free_stack(&s[k]);
    T_CHECK(batten_bytes_in_use(ctx[k]) == 0, "nothing held");
    batten_context_free(ctx[k]);
  }
  stack_scene_free(&scene);
}

/* A heart of 33 drawn slices, where the data are at hand; test_random is its twin. */
static void test_heart(batten_context *ctx) {
  const char *shared = getenv("BATTEN_SHARED");
  char path[1024];
  snprintf(path, sizeof path, "%s/data/contours/rt_Heart.txt", shared ? shared : "");
  FILE *file = shared ? fopen(path, "r") : NULL;
  if (!file) {
    t_skip("heart", "no shared data");
    return;
  }
  stack_scene scene = {0};
  for (size_t count; fscanf(file, " contour %zu", &count) == 1;) {
    double *p = malloc(2 * count * sizeof *p), z = 0;
    for (size_t i = 0; i < count; i++)
      if (fscanf(file, "%lf %lf %lf", p + 2 * i, p + 2 * i + 1, &z) != 3) T_CHECK(false, "heart: point %zu", i);
    stack_scene_slice(&scene, z);
    stack_scene_loop(&scene, count, p);
    free(p);
  }
  fclose(file);
  stack s = make_stack(ctx, &scene);
  batten_stack_options options = {.struct_size = sizeof options, .pair_distance = 0.75};
  section_figures *figures = malloc(s.count * sizeof *figures);
  const double tolerance = 0.2, start = batten_now();
  T_OK(stack_fit_all(ctx, &s, stack_scene_sections(&scene), &options, tolerance, figures), ctx);
  const double seconds = batten_now() - start;
  size_t certified = 0, centers = 0;
  double depth = 0, miss = 0;
  for (size_t i = 0; i < s.count; i++) {
    certified += figures[i].certified;
    centers += figures[i].centers;
    depth = fmax(depth, figures[i].wrong_sign_max);
    miss = fmax(miss, figures[i].residual_max);
  }
  T_CHECK(s.count == 33 && certified == 33, "heart: %zu of %zu slices certified in %.2f s, wrong sign %.3g at most",
          certified, s.count, seconds, depth);
  T_RATIO(miss, 1.05 * tolerance, "heart: miss");
  T_RATIO((double)centers, 1.6 * (double)scene.points, "heart: %zu centres for %zu points", centers, scene.points);
  free(figures);
  free_stack(&s);
  stack_scene_free(&scene);
}

static batten_status call_fit_all(batten_context *ctx, void *arg) {
  stack_scene *scene = arg;
  section_figures figures[8];
  stack s = {.ctx = ctx, .count = scene->count};
  batten_stack_options options = {.struct_size = sizeof options, .pair_distance = 0.75};
  const batten_section *given = stack_scene_sections(scene);
  s.sections = calloc(s.count, sizeof *s.sections);
  batten_status st = BATTEN_OK;
  for (size_t i = 0; i < s.count && st >= 0; i++) {
    polygon_fault fault;
    st = polygon_set_make(ctx, given[i].contour_count, given[i].starts, given[i].points, 0, &s.sections[i].loops,
                          NULL, &fault);
  }
  if (st >= 0) st = stack_fit_all(ctx, &s, given, &options, 0.3, figures);
  free_stack(&s);
  return st;
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 1);
  test_disc(ctx);
  test_shapes(ctx);
  test_awkward(ctx);
  test_random(ctx);
  test_invariance(ctx);
  test_proof(ctx);
  test_phantom(ctx);
  test_miss(ctx);
  test_coarse_and_dense(ctx);
  test_points(ctx);
  test_heart(ctx);
  T_CHECK(batten_bytes_in_use(ctx) == 0, "nothing held");
  batten_context_free(ctx);
  test_threads();
  stack_scene scene = {0};
  const double radii[3] = {2, 3, 2.5};
  stack_scene_discs(&scene, 3, radii, 1, 16);
  t_fail_every_allocation("stack_fit_all", call_fit_all, &scene);
  t_cancel_every_progress("stack_fit_all", call_fit_all, &scene);
  stack_scene_free(&scene);
  return t_done();
}
