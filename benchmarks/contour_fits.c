/* The scenes and batten's fits for contour_peers.py, so that all curves are of the very same points, and those by
 * least squares have the same parameters and knots.
 *
 *   contour-fits scenes FOLDER                writes NAME.scene; prints name and what it is
 *   contour-fits fit WAY SCENE CURVE SECONDS  WAY: least (least squares alone), round (one round at the scene's
 *                                             parameters), shape (two rounds with corrections) or tolerance (shape,
 *                                             breaks placed for the scene's tolerance); repeats for so many seconds
 *
 * Files hold doubles. Scene: count, degree, continuous derivatives, spans, inflections, sign at the start, tolerance,
 * size, parameters [count], points [count][2], the same without noise, breaks [spans + 1], inflections. Curve:
 * seconds (median), fits that were timed, 1 where the shape is proven, degree, number of knots, knots, control
 * points. */
#include <batten/contour.h>
#include <stdio.h>

#include "contour/density.h"
#include "contour_scenes.h"

enum { HEAD = 8, CURVE_HEAD = 5, REPEATS_MAX = 25 };

static int fail(const char *what, const char *why) {
  fprintf(stderr, "%s: %s\n", what, why);
  return 1;
}

/* ---- Files ---- */

static bool write_numbers(FILE *file, const double *values, size_t count) {
  return fwrite(values, sizeof *values, count, file) == count;
}

/* All numbers of a file; NULL when it is none of ours. */
static double *read_numbers(const char *path, size_t *count) {
  FILE *file = fopen(path, "rb");
  double *values = NULL;
  long bytes = -1;
  if (!file) return NULL;
  if (fseek(file, 0, SEEK_END) == 0) bytes = ftell(file);
  if (bytes > 0 && fseek(file, 0, SEEK_SET) == 0) {
    *count = (size_t)bytes / sizeof *values;
    values = contour_scene_allocate(*count);
    if (fread(values, sizeof *values, *count, file) != *count) {
      free(values);
      values = NULL;
    }
  }
  fclose(file);
  return values;
}

typedef struct read_scene {
  double *numbers;
  size_t count, spans, inflection_count;
  unsigned degree, smoothness;
  int sign;
  double tolerance;
  const double *parameters, *points, *breaks, *inflections;
} read_scene;

static bool scene_read(const char *path, read_scene *s) {
  size_t size = 0;
  *s = (read_scene){.numbers = read_numbers(path, &size)};
  if (!s->numbers || size < HEAD) return false;
  const double *head = s->numbers;
  s->count = (size_t)head[0];
  s->degree = (unsigned)head[1];
  s->smoothness = (unsigned)head[2];
  s->spans = (size_t)head[3];
  s->inflection_count = (size_t)head[4];
  s->sign = (int)head[5];
  s->tolerance = head[6];
  s->parameters = head + HEAD;
  s->points = s->parameters + s->count;
  s->breaks = s->points + 4 * s->count;
  s->inflections = s->breaks + s->spans + 1;
  return size == HEAD + 5 * s->count + s->spans + 1 + s->inflection_count;
}

static bool curve_write(const char *path, double seconds, size_t fits, bool proven, unsigned degree,
                        size_t knot_count, const double *knots, const double *control) {
  double head[CURVE_HEAD] = {seconds, (double)fits, proven, degree, (double)knot_count};
  FILE *file = fopen(path, "wb");
  bool good = file && write_numbers(file, head, CURVE_HEAD) && write_numbers(file, knots, knot_count) &&
              write_numbers(file, control, 2 * (knot_count - degree - 1));
  if (file && fclose(file) != 0) good = false;
  return good;
}

/* ---- Scenes ---- */

typedef struct scene_rule {
  const char *name, *text;
  size_t spans;
  contour_rule rule;
} scene_rule;

static const scene_rule scene_rules[] = {
    {"frame", "Frame of a ship with flare", 12, {CONTOUR_FRAME, 120, 1, false, true, 0.002, false, 1}},
    {"airfoil", "Section of a wing", 24, {CONTOUR_AIRFOIL, 160, 1, false, false, 0.0005, false, 2}},
    {"arcs", "Two arcs of circles", 12, {CONTOUR_S, 200, 1, false, true, 0.01, false, 3}},
    {"wave-noisy", "Wave of 6 inflections", 24, {CONTOUR_WAVE, 400, 6, false, true, 0.02, false, 4}},
    {"wave-100", "Wave of 4 inflections", 12, {CONTOUR_WAVE, 100, 4, false, false, 0.001, false, 9}},
    {"wave-1000", "Wave of 4 inflections", 20, {CONTOUR_WAVE, 1000, 4, false, false, 0.001, false, 9}},
    {"wave-10000", "Wave of 4 inflections", 200, {CONTOUR_WAVE, 10000, 4, false, false, 0.001, false, 9}},
    {"wave-100000", "Wave of 4 inflections", 2000, {CONTOUR_WAVE, 100000, 4, false, false, 0.001, false, 9}}};

enum { DEGREE = 3, SMOOTHNESS = 2 };

static int write_scene(batten_context *ctx, const char *folder, const scene_rule *r) {
  contour_scene s = contour_scene_make(&r->rule);
  contour_data data = {s.count, s.points, NULL};
  contour_knots_options o = {DEGREE, SMOOTHNESS, false, r->spans, 0, s.inflection_count, s.inflections};
  size_t pieces = 0;
  double *breaks = NULL;
  char path[4096];
  bool good = false;
  snprintf(path, sizeof path, "%s/%s.scene", folder, r->name);
  if (contour_knots_place(ctx, &data, s.lengths, &o, &pieces, &breaks) == BATTEN_OK) {
    double tolerance = (5 * r->rule.noise + 1e-4) * s.size;
    double head[HEAD] = {(double)s.count, DEGREE,    SMOOTHNESS, (double)pieces, (double)s.inflection_count,
                         s.sign,          tolerance, s.size};
    FILE *file = fopen(path, "wb");
    good = file && write_numbers(file, head, HEAD) && write_numbers(file, s.lengths, s.count) &&
           write_numbers(file, s.points, 2 * s.count) && write_numbers(file, s.truth, 2 * s.count) &&
           write_numbers(file, breaks, pieces + 1) && write_numbers(file, s.inflections, s.inflection_count);
    if (file && fclose(file) != 0) good = false;
  }
  printf("%s %s, noise %g %%\n", r->name, r->text, 100 * r->rule.noise);
  batten_free(ctx, breaks);
  contour_scene_free(&s);
  return good ? 0 : fail(path, "cannot be written");
}

/* ---- Fits ---- */

static batten_status fit_least(batten_context *ctx, const read_scene *s, contour_least *out) {
  contour_data data = {s->count, s->points, NULL};
  return contour_least_fit(ctx, &data, s->parameters, s->degree, s->smoothness, false, s->spans, s->breaks, out);
}

static batten_status fit_shape(batten_context *ctx, const read_scene *s, const char *way, batten_curve **curve,
                               batten_contour_info *info) {
  batten_contour_options o = batten_contour_options_default();
  bool round = strcmp(way, "round") == 0, tolerance = strcmp(way, "tolerance") == 0;
  o.degree = s->degree;
  o.smoothness = s->smoothness;
  o.parameters = s->parameters;
  o.domain[0] = 0;
  o.domain[1] = 1;
  o.inflection_count = s->inflection_count;
  o.inflections = s->inflections;
  o.sign = s->sign;
  o.rounds = round ? 1 : 2;
  o.correction_passes = round ? 0 : 3;
  if (tolerance) {
    o.tolerance = s->tolerance;
  } else {
    o.break_count = s->spans - 1;
    o.breaks = s->breaks + 1;
  }
  return batten_contour_fit(ctx, s->count, s->points, &o, curve, NULL, NULL, info);
}

static int by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static int fit(batten_context *ctx, const char *way, const char *scene, const char *path, double seconds) {
  read_scene s;
  double times[REPEATS_MAX], begin = batten_now();
  size_t fits = 0;
  bool least = strcmp(way, "least") == 0, good = false;
  contour_least f = {0};
  batten_curve *curve = NULL;
  batten_contour_info info = {0};
  batten_status st = BATTEN_OK;
  if (!scene_read(scene, &s)) return fail(scene, "is no scene");
  while (st >= 0 && (fits == 0 || (fits < REPEATS_MAX && batten_now() - begin < seconds))) {
    contour_least_free(ctx, &f);
    batten_curve_free(curve);
    curve = NULL;
    double start = batten_now();
    st = least ? fit_least(ctx, &s, &f) : fit_shape(ctx, &s, way, &curve, &info);
    times[fits++] = batten_now() - start;
  }
  qsort(times, fits, sizeof *times, by_value);
  if (st < 0) {
    fail(way, batten_error(ctx));
  } else if (least) {
    good = curve_write(path, times[fits / 2], fits, false, s.degree, f.space.b.count + s.degree + 1, f.space.knots,
                       f.control);
  } else {
    batten_curve_form form = batten_curve_get(curve);
    good = curve_write(path, times[fits / 2], fits, info.shape.certified, form.degree, form.knot_count, form.knots,
                       form.control_points);
    if (st > 0) fprintf(stderr, "%s\n", batten_error(ctx));
  }
  contour_least_free(ctx, &f);
  batten_curve_free(curve);
  free(s.numbers);
  return good ? 0 : 1;
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
  } else {
    fail("contour-fits", "scenes FOLDER, or fit WAY SCENE CURVE SECONDS");
  }
  batten_context_free(ctx);
  return result;
}
