/* The scenes and batten's lofts for loft_peers.py, so that all surfaces go through the very same contours.
 *
 *   loft-fits scenes FOLDER                     writes NAME.scene; prints name and what it is
 *   loft-fits fit WAY SCENE SURFACE SECONDS     WAY: loft (as by default), cubic (C^1 and of degree 3 across the
 *                                               contours, raised where need be), free (the same without inequalities,
 *                                               in the time of both); repeats for so many seconds
 *   loft-fits prove SURFACE                     of whomsoever: prints the span pairs of which a sign is wanted, since
 *                                               both end sections have it, those with a wrong sign, those unproven
 *
 * Files as in loft_files.h. */
#include <batten/loft.h>

#include "loft_files.h"
#include "loft_scenes.h"

static int fail(const char *what, const char *why) {
  fprintf(stderr, "%s: %s\n", what, why);
  return 1;
}

/* ---- scenes ---- */

typedef struct scene_rule {
  const char *name, *text;
  loft_rule rule;
} scene_rule;

static const scene_rule scene_rules[] = {
    {"paper", "Four quadratic contours as in figure 5", {.kind = LOFT_PAPER, .degree = 2, .smoothness = 1}},
    {"open",
     "Open, one bend",
     {.degree = 3, .smoothness = 2, .contours = 8, .decades = 1, .rotation = 0.4, .seed = 1}},
    {"uneven",
     "Open, spans over two powers of ten",
     {.degree = 3, .smoothness = 2, .contours = 8, .decades = 2, .rotation = 0.6, .seed = 2}},
    {"inflections",
     "Open, two inflections with partners",
     {.degree = 3, .smoothness = 2, .contours = 8, .inflections = 2, .decades = 1, .rotation = 0.4, .seed = 3}},
    {"closed",
     "Closed, convex",
     {.degree = 3, .smoothness = 2, .closed = true, .contours = 8, .decades = 1, .rotation = 0.4, .seed = 4}},
    {"quintic",
     "Open, of degree 5",
     {.degree = 5, .smoothness = 2, .contours = 8, .spans = 8, .decades = 1, .rotation = 0.4, .seed = 5}},
    {"stack-20-20",
     "Closed, convex, 20 contours of 20 spans",
     {.degree = 3, .smoothness = 2, .closed = true, .contours = 20, .spans = 20, .rotation = 0.4, .seed = 6}},
    {"stack-50-40",
     "Closed, convex, 50 contours of 40 spans",
     {.degree = 3, .smoothness = 2, .closed = true, .contours = 50, .spans = 40, .rotation = 0.4, .seed = 7}}};

static int write_scene(batten_context *ctx, const char *folder, const scene_rule *r) {
  loft_scene s = loft_scene_make(ctx, &r->rule);
  char path[4096];
  snprintf(path, sizeof path, "%s/%s.scene", folder, r->name);
  FILE *file = fopen(path, "wb");
  const double head[LOFT_HEAD] = {(double)s.count, r->rule.closed, r->rule.degree, r->rule.smoothness};
  bool good = file && loft_numbers(file, head, LOFT_HEAD);
  for (size_t i = 0; good && i < s.count; i++) {
    batten_curve_form f = batten_curve_get(s.contours[i]);
    const double own[2] = {s.heights[i], (double)f.knot_count};
    good = loft_numbers(file, own, 2) && loft_numbers(file, f.knots, f.knot_count) &&
           loft_numbers(file, f.control_points, 2 * (f.knot_count - f.degree - 1));
  }
  if (file && fclose(file) != 0) good = false;
  printf("%s %s\n", r->name, r->text);
  loft_scene_free(&s);
  return good ? 0 : fail(path, "cannot be written");
}

/* ---- lofts ---- */

static batten_status make_contours(batten_context *ctx, const loft_scene_file *s, batten_curve **curves,
                                   double *heights) {
  batten_status st = BATTEN_OK;
  for (size_t i = 0; st >= 0 && i < s->count; i++) {
    const loft_contour_file *c = &s->contours[i];
    heights[i] = c->height;
    st = batten_curve_create(ctx, &(batten_curve_form){s->degree, c->knot_count, c->knots, c->points, s->closed},
                             &curves[i]);
  }
  return st;
}

static bool write_loft(batten_context *ctx, const batten_loft *loft, double seconds, size_t builds,
                       const char *path) {
  batten_surface *surface = NULL;
  if (batten_loft_surface(ctx, loft, &surface) < 0) return false;
  batten_surface_form f = batten_surface_get(surface);
  batten_loft_form own = batten_loft_get(loft);
  loft_surface_file out = {.seconds = seconds,
                           .builds = builds,
                           .degree = {f.degree[0], f.degree[1]},
                           .knot_count = {f.knot_count[0], f.knot_count[1]},
                           .knots = {f.knots[0], f.knots[1]},
                           .points = f.control_points,
                           .count = own.contours,
                           .parameters = own.heights};
  bool good = loft_surface_file_write(path, &out);
  batten_surface_free(surface);
  return good;
}

static int fit(batten_context *ctx, const char *way, const char *scene, const char *path, double seconds) {
  loft_scene_file s;
  if (!loft_scene_file_read(scene, &s)) {
    loft_scene_file_free(&s);
    return fail(scene, "is no scene");
  }
  batten_curve **curves = loft_scene_memory(s.count, sizeof(batten_curve *));
  double *heights = loft_scene_memory(s.count, sizeof *heights), times[LOFT_REPEATS_MAX], begin = batten_now();
  batten_loft *loft = NULL, *unconstrained = NULL;
  batten_loft_info info = {0};
  size_t builds = 0;
  bool is_free = strcmp(way, "free") == 0, good = false;
  batten_loft_options o = batten_loft_options_default();
  if (strcmp(way, "loft") != 0) {
    o.smooth_z = 1;
    o.degree_z = 3;
  }
  batten_status st = make_contours(ctx, &s, curves, heights);
  while (st >= 0 && (builds == 0 || (builds < LOFT_REPEATS_MAX && batten_now() - begin < seconds))) {
    batten_loft_free(loft);
    batten_loft_free(unconstrained);
    loft = unconstrained = NULL;
    double start = batten_now();
    st = batten_loft_build(ctx, s.count, (const batten_curve *const *)curves, heights, &o, &loft,
                           is_free ? &unconstrained : NULL, &info);
    times[builds++] = batten_now() - start;
  }
  if (st < 0) {
    fail(way, batten_error(ctx));
  } else {
    qsort(times, builds, sizeof *times, loft_by_value);
    good = write_loft(ctx, is_free ? unconstrained : loft, times[builds / 2], builds, path);
    if (st > 0) fprintf(stderr, "%s\n", batten_error(ctx));
  }
  batten_loft_free(loft);
  batten_loft_free(unconstrained);
  for (size_t i = 0; i < s.count; i++) batten_curve_free(curves[i]);
  free(curves);
  free(heights);
  loft_scene_file_free(&s);
  return good ? 0 : 1;
}

/* ---- proof ---- */

static int prove(batten_context *ctx, const char *path) {
  size_t size;
  double *numbers = loft_file_read(path, LOFT_SURFACE_HEAD, &size);
  if (!numbers) return fail(path, "is no surface");
  batten_surface_form f = {.degree = {(unsigned)numbers[2], (unsigned)numbers[3]},
                           .knot_count = {(size_t)numbers[4], (size_t)numbers[5]}};
  f.knots[0] = numbers + LOFT_SURFACE_HEAD;
  f.knots[1] = f.knots[0] + f.knot_count[0];
  f.control_points = f.knots[1] + f.knot_count[1];
  batten_surface *surface = NULL;
  batten_sections found;
  batten_status st = batten_surface_create(ctx, &f, &surface);
  if (st >= 0) st = batten_surface_certify_sections(ctx, surface, NULL, &found, NULL);
  if (st >= 0) printf("%zu %zu %zu\n", found.pairs, found.violations, found.unproven);
  batten_surface_free(surface);
  free(numbers);
  return st >= 0 ? 0 : fail(path, batten_error(ctx));
}

int main(int argc, char **argv) {
  batten_context *ctx = NULL;
  int result = 1;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  if (argc == 3 && strcmp(argv[1], "scenes") == 0) {
    result = 0;
    for (size_t i = 0; i < sizeof scene_rules / sizeof *scene_rules && result == 0; i++)
      result = write_scene(ctx, argv[2], &scene_rules[i]);
  } else if (argc == 6 && strcmp(argv[1], "fit") == 0) {
    result = fit(ctx, argv[2], argv[3], argv[4], strtod(argv[5], NULL));
  } else if (argc == 3 && strcmp(argv[1], "prove") == 0) {
    result = prove(ctx, argv[2]);
  } else {
    fail("loft-fits", "scenes FOLDER, fit WAY SCENE SURFACE SECONDS, or prove SURFACE");
  }
  batten_context_free(ctx);
  return result;
}
