/* The scenes, batten's fits and the judge for convex_peers.py, so that all surfaces are of the very same points and
 * are measured by the same code.
 *
 *   convex-fits scenes FOLDER                   writes NAME.scene; prints name and what it is
 *   convex-fits fit WAY SCENE SURFACE SECONDS   WAY: unconstrained, convex, least-squares or function; repeats for so
 *                                               many seconds
 *   convex-fits judge SCENE SURFACE             prints figures
 *
 * Files hold doubles. Scene: count, degrees, spans, standard deviation of the noise, side of the grid (0: scattered),
 * half widths of the rectangle in x and y that has the data, +1 where z is a convex function and -1 where a concave
 * one, points [count][3], the same without noise. Surface: seconds (median; NaN: by the way), fits that were timed,
 * degrees, numbers of knots, knots in u, in v, control points. */
#include <batten/convex.h>
#include <stdio.h>
#include <time.h>

#include "convex_scenes.h"

enum { HEAD = 10, SURFACE_HEAD = 6, REPEATS_MAX = 25, GRID = 301 };

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
    values = convex_allocate(*count, sizeof *values);
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
  size_t count;
  unsigned degree[2], spans[2];
  double half[2];
  int sign;
  const double *points, *truth;
} read_scene;

static bool scene_read(const char *path, read_scene *s) {
  size_t size = 0;
  *s = (read_scene){.numbers = read_numbers(path, &size)};
  if (!s->numbers || size < HEAD || size != HEAD + 6 * (size_t)s->numbers[0]) return false;
  s->count = (size_t)s->numbers[0];
  for (int k = 0; k < 2; k++) {
    s->degree[k] = (unsigned)s->numbers[1 + k];
    s->spans[k] = (unsigned)s->numbers[3 + k];
    s->half[k] = s->numbers[7 + k];
  }
  s->sign = (int)s->numbers[9];
  s->points = s->numbers + HEAD;
  s->truth = s->points + 3 * s->count;
  return true;
}

static bool surface_write(const char *path, const batten_surface *surface, double seconds, size_t fits) {
  batten_surface_form f = batten_surface_get(surface);
  double head[SURFACE_HEAD] = {
      seconds, (double)fits, f.degree[0], f.degree[1], (double)f.knot_count[0], (double)f.knot_count[1]};
  size_t points = (f.knot_count[0] - f.degree[0] - 1) * (f.knot_count[1] - f.degree[1] - 1);
  FILE *file = fopen(path, "wb");
  bool good = file && write_numbers(file, head, SURFACE_HEAD) && write_numbers(file, f.knots[0], f.knot_count[0]) &&
              write_numbers(file, f.knots[1], f.knot_count[1]) && write_numbers(file, f.control_points, 3 * points);
  if (file && fclose(file) != 0) good = false;
  return good;
}

static batten_status surface_read(batten_context *ctx, const char *path, batten_surface **out) {
  size_t size = 0;
  double *numbers = read_numbers(path, &size);
  if (!numbers || size < SURFACE_HEAD) {
    free(numbers);
    return BATTEN_E_IO;
  }
  batten_surface_form f = {.degree = {(unsigned)numbers[2], (unsigned)numbers[3]},
                           .knot_count = {(size_t)numbers[4], (size_t)numbers[5]}};
  f.knots[0] = numbers + SURFACE_HEAD;
  f.knots[1] = f.knots[0] + f.knot_count[0];
  f.control_points = f.knots[1] + f.knot_count[1];
  batten_status st = batten_surface_create(ctx, &f, out);
  free(numbers);
  return st;
}

/* ---- Scenes ---- */

typedef struct scene_rule {
  const char *name, *text;
  int function; /* -1: the body */
  unsigned spans;
  convex_rule body;
} scene_rule;

enum { DEGREE = 3 };

static const scene_rule scene_rules[] = {
    {.name = "ellipsoid-51",
     .text = "Cap of an ellipsoid, the paper's experiment",
     .function = -1,
     .spans = 1,
     .body = {.count = CONVEX_PAPER_COUNT, .axes = {1.5, 1.2, 1}, .noise = 0.06, .seed = 1}},
    {.name = "ellipsoid-800",
     .text = "Cap of an ellipsoid",
     .function = -1,
     .spans = 3,
     .body = {.count = 800, .axes = {1.5, 1.2, 1}, .noise = 0.03, .seed = 2}},
    {.name = "superquadric-600",
     .text = "Cap of a superquadric, flat along two lines",
     .function = -1,
     .spans = 2,
     .body = {.body = CONVEX_SUPERQUADRIC, .count = 600, .noise = 0.02, .seed = 3}},
    {.name = "sphere-grid",
     .text = "Cap of a sphere, points in rows",
     .function = -1,
     .spans = 3,
     .body = {.count = 625, .noise = 0.02, .grid = true, .seed = 4}},
    {.name = "soft-max",
     .text = "The function log(exp 4x + exp 4y + exp(-4x - 4y)) / 4",
     .function = CONVEX_F_SOFT_MAX,
     .spans = 4,
     .body = {.count = 1000, .noise = 0.1, .seed = 5}},
    {.name = "cone",
     .text = "The function hypot(x, y)",
     .function = CONVEX_F_CONE,
     .spans = 6,
     .body = {.count = 1000, .noise = 0.05, .seed = 6}},
    {.name = "exponential",
     .text = "The function exp(x - y), bent in one direction only",
     .function = CONVEX_F_EXP,
     .spans = 4,
     .body = {.count = 1000, .noise = 0.1, .seed = 7}}};

/* Height without noise over the rectangle's place (s, t) in [-1, 1]^2; half: its half widths. */
static double height(const scene_rule *r, double s, double t, double half[2]) {
  double p[3];
  if (r->function >= 0) {
    half[0] = half[1] = 1;
    return convex_function_value((convex_function)r->function, s, t);
  }
  convex_point(&r->body, 1, 1, p);
  half[0] = p[0];
  half[1] = p[1];
  convex_point(&r->body, s, t, p);
  return p[2];
}

/* Range of K without noise, by differences at places that avoid kinks along the axes. */
static void truth_range(const scene_rule *r, double gauss[2]) {
  const double h = 1e-4;
  const int places = 60;
  gauss[0] = INFINITY;
  gauss[1] = -INFINITY;
  for (int k = 0; k < places * places; k++) {
    double s = (k % places + 0.5) * 2 / places - 1, t = (k / places + 0.5) * 2 / places - 1, half[2], z[3][3];
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) z[i][j] = height(r, s + (i - 1) * h, t + (j - 1) * h, half);
    double x = h * half[0], y = h * half[1], zx = (z[2][1] - z[0][1]) / (2 * x), zy = (z[1][2] - z[1][0]) / (2 * y);
    double xx = (z[2][1] - 2 * z[1][1] + z[0][1]) / (x * x), yy = (z[1][2] - 2 * z[1][1] + z[1][0]) / (y * y);
    double xy = (z[2][2] - z[2][0] - z[0][2] + z[0][0]) / (4 * x * y);
    double k_here = (xx * yy - xy * xy) / pow(1 + zx * zx + zy * zy, 2);
    gauss[0] = fmin(gauss[0], k_here);
    gauss[1] = fmax(gauss[1], k_here);
  }
}

static int write_scene(const char *folder, const scene_rule *r) {
  convex_scene s = r->function < 0 ? convex_scene_make(&r->body)
                                   : convex_scene_function((convex_function)r->function, r->body.count, r->body.noise,
                                                           r->body.seed);
  const double *a = r->body.axes;
  double mean = a[0] == 0 ? 1 : (a[0] + a[1] + a[2]) / 3, half[2], gauss[2];
  (void)height(r, 0, 0, half);
  double head[HEAD] = {(double)s.count,
                       DEGREE,
                       DEGREE,
                       r->spans,
                       r->spans,
                       r->body.noise * mean,
                       r->body.grid ? sqrt((double)s.count) : 0,
                       half[0],
                       half[1],
                       r->function < 0 ? -1 : 1};
  char path[4096];
  snprintf(path, sizeof path, "%s/%s.scene", folder, r->name);
  FILE *file = fopen(path, "wb");
  bool good = file && write_numbers(file, head, HEAD) && write_numbers(file, s.points, 3 * s.count) &&
              write_numbers(file, s.truth, 3 * s.count);
  if (file && fclose(file) != 0) good = false;
  convex_scene_free(&s);
  if (!good) return fail(path, "cannot be written");
  truth_range(r, gauss);
  printf("%s %s, K from %.2f to %.2f\n", r->name, r->text, fmax(gauss[0], 0), gauss[1]);
  return 0;
}

/* ---- Fits ---- */

static double now(void) {
  struct timespec t;
  timespec_get(&t, TIME_UTC);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* With the options' defaults. least-squares: a function of which no shape is asked. */
static batten_status fit_once(batten_context *ctx, const char *way, const read_scene *s, batten_surface **out,
                              batten_surface **unconstrained) {
  if (strcmp(way, "convex") == 0 || strcmp(way, "unconstrained") == 0) {
    batten_convex_options o = batten_convex_options_default();
    for (int k = 0; k < 2; k++) {
      o.degree[k] = s->degree[k];
      o.spans[k] = s->spans[k];
    }
    return batten_convex_fit(ctx, s->count, s->points, &o, out, unconstrained, NULL);
  }
  batten_convex_function_options o = batten_convex_function_options_default();
  signed char *signs = convex_allocate((size_t)s->spans[0] * s->spans[1], 1);
  memset(signs, s->sign, (size_t)s->spans[0] * s->spans[1]);
  for (int k = 0; k < 2; k++) {
    o.degree[k] = s->degree[k];
    o.spans[k] = s->spans[k];
  }
  if (strcmp(way, "least-squares") == 0) memset(signs, 0, (size_t)s->spans[0] * s->spans[1]);
  o.signs = signs;
  batten_status st = batten_convex_function_fit(ctx, s->count, s->points, &o, out, NULL, NULL);
  free(signs);
  return st;
}

static int fit(batten_context *ctx, const char *way, const char *path, const char *result, double budget) {
  bool by_the_way = strcmp(way, "unconstrained") == 0;
  batten_surface *surface = NULL, *unconstrained = NULL;
  double times[REPEATS_MAX], begin = now();
  size_t count = 0;
  read_scene s;
  if (!scene_read(path, &s)) return fail(path, "cannot be read");
  int failed = 0;
  do {
    batten_surface_free(surface);
    batten_surface_free(unconstrained);
    surface = unconstrained = NULL;
    double start = now();
    batten_status st = fit_once(ctx, way, &s, &surface, by_the_way ? &unconstrained : NULL);
    times[count++] = now() - start;
    if (st != BATTEN_OK && count == 1) fprintf(stderr, "%s: %s\n", way, batten_error(ctx));
    failed = st < 0;
  } while (!failed && count < REPEATS_MAX && now() - begin < budget && !by_the_way);
  qsort(times, count, sizeof *times, by_size);
  if (!failed && !surface_write(result, by_the_way ? unconstrained : surface,
                                by_the_way ? (double)NAN : times[count / 2], count))
    failed = fail(result, "cannot be written");
  batten_surface_free(unconstrained);
  batten_surface_free(surface);
  free(s.numbers);
  return failed;
}

/* ---- The judge ---- */

/* Root mean square and largest of the distances of points to their nearest places. */
static batten_status distances(batten_context *ctx, const batten_surface *surface, size_t count, const double *points,
                               double *rms, double *largest) {
  double *places = convex_allocate(2 * count, sizeof *places), *away = convex_allocate(count, sizeof *away);
  batten_status st = batten_surface_closest(ctx, surface, count, points, places, away);
  *rms = *largest = 0;
  for (size_t i = 0; st >= 0 && i < count; i++) {
    *rms += away[i] * away[i] / (double)count;
    *largest = fmax(*largest, away[i]);
  }
  *rms = sqrt(*rms);
  free(away);
  free(places);
  return st;
}

/* Range of K over an even grid of places, of those only that lie over the rectangle that has the data: some surfaces
 * reach beyond. bend: the largest |L'|. */
static batten_status sample(batten_context *ctx, const batten_surface *surface, const double half[2], double gauss[2],
                            double *bend) {
  batten_surface_form f = batten_surface_get(surface);
  double *places = convex_allocate(2 * GRID, sizeof *places);
  batten_surface_point *row = convex_allocate(GRID, sizeof *row);
  batten_status st = BATTEN_OK;
  gauss[0] = INFINITY;
  gauss[1] = -INFINITY;
  *bend = 0;
  for (int i = 0; i < GRID && st >= 0; i++) {
    for (int j = 0; j < GRID; j++)
      for (int k = 0; k < 2; k++) {
        double low = f.knots[k][0], high = f.knots[k][f.knot_count[k] - 1], t = (double)(k ? j : i) / (GRID - 1);
        places[2 * j + k] = fmin(high, low + t * (high - low));
      }
    st = batten_surface_evaluate(ctx, surface, GRID, places, row);
    for (int j = 0; st >= 0 && j < GRID; j++) {
      const batten_surface_point *p = &row[j];
      if (fabs(p->point[0]) > half[0] || fabs(p->point[1]) > half[1]) continue;
      if (p->gauss < gauss[0]) gauss[0] = p->gauss;
      if (p->gauss > gauss[1]) gauss[1] = p->gauss;
      const double *u = p->du, *v = p->dv, *w = p->duu;
      *bend = fmax(*bend, fabs(w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) +
                               w[2] * (u[0] * v[1] - u[1] * v[0])));
    }
  }
  free(row);
  free(places);
  return st;
}

/* Proven convex over all of the surface: strictly (2), or but for 1e-8 of its curvatures (1). */
static batten_status prove(batten_context *ctx, const batten_surface *surface, double bend, int *proven) {
  batten_convexity_options o = batten_convexity_options_default();
  batten_convexity c;
  *proven = 0;
  for (int strict = 1; strict >= 0 && *proven == 0; strict--) {
    o.slack = strict ? 0 : 1e-8 * bend;
    o.depth_max = 12;
    o.box_limit = 200000;
    batten_status st = batten_surface_certify_convex(ctx, surface, &o, &c);
    if (st < 0) return st;
    if (c.certified) *proven = 1 + strict;
  }
  return BATTEN_OK;
}

static int judge(batten_context *ctx, const char *path, const char *result) {
  read_scene s;
  batten_surface *surface = NULL;
  batten_surface_measures m;
  double rms, largest, truth, unused, gauss[2], bend;
  int proven = 0;
  if (!scene_read(path, &s)) return fail(path, "cannot be read");
  batten_status st = surface_read(ctx, result, &surface);
  if (st >= 0) st = distances(ctx, surface, s.count, s.points, &rms, &largest);
  if (st >= 0) st = distances(ctx, surface, s.count, s.truth, &truth, &unused);
  if (st >= 0) st = sample(ctx, surface, s.half, gauss, &bend);
  if (st >= 0) st = prove(ctx, surface, bend, &proven);
  if (st >= 0) st = batten_surface_measure(ctx, surface, &m);
  if (st >= 0) {
    batten_surface_form f = batten_surface_get(surface);
    printf("%zu %.17g %.17g %.17g %.17g %.17g %.17g %.17g %d\n",
           (f.knot_count[0] - f.degree[0] - 1) * (f.knot_count[1] - f.degree[1] - 1), rms, largest, truth, gauss[0],
           gauss[1], m.gauss_min, m.gauss_max, proven);
  }
  batten_surface_free(surface);
  free(s.numbers);
  return st < 0 ? fail(result, batten_error(ctx)) : 0;
}

int main(int argc, char **argv) {
  batten_context *ctx = NULL;
  int failed = 0;
  if (batten_context_new(NULL, &ctx) < 0) return 1;
  if (argc == 3 && strcmp(argv[1], "scenes") == 0)
    for (size_t i = 0; i < sizeof scene_rules / sizeof *scene_rules; i++)
      failed += write_scene(argv[2], &scene_rules[i]);
  else if (argc == 6 && strcmp(argv[1], "fit") == 0)
    failed = fit(ctx, argv[2], argv[3], argv[4], strtod(argv[5], NULL));
  else if (argc == 4 && strcmp(argv[1], "judge") == 0)
    failed = judge(ctx, argv[2], argv[3]);
  else
    failed = fail("convex-fits", "scenes FOLDER | fit WAY SCENE SURFACE SECONDS | judge SCENE SURFACE");
  batten_context_free(ctx);
  return failed != 0;
}
