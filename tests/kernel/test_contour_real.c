/* Planar curves through real data: frames of a ship, slices of a heart, meridians of a moon, and the section of a
 * wing. Where the data are not there, twins that are made here stand in; both are judged by the same checks. */
#include <batten/contour.h>

#include "contour_scenes.h"
#include "tap.h"

enum { POINTS = 2048 };

static FILE *open_shared(const char *name) {
  const char *shared = getenv("BATTEN_SHARED");
  char path[1024];
  if (!shared || snprintf(path, sizeof path, "%s/data/%s", shared, name) >= (int)sizeof path) return NULL;
  return fopen(path, "r");
}

typedef struct curves {
  size_t count, proven, counted, contradict, wiggles;
  double ratio, worst; /* largest distance in parts of the size */
} curves;

static double size_of(size_t count, const double *points) {
  double lower[2] = {INFINITY, INFINITY}, upper[2] = {-INFINITY, -INFINITY};
  for (size_t i = 0; i < 2 * count; i++) {
    lower[i % 2] = fmin(lower[i % 2], points[i]);
    upper[i % 2] = fmax(upper[i % 2], points[i]);
  }
  return fmax(upper[0] - lower[0], upper[1] - lower[1]);
}

static void fit(batten_context *ctx, const char *what, size_t count, const double *points,
                const batten_contour_options *o, curves *c) {
  batten_curve *curve = NULL;
  batten_contour_info info;
  batten_status st = batten_contour_fit(ctx, count, points, o, &curve, NULL, NULL, &info);
  c->count++;
  if (st < 0 || !info.shape.certified) {
    printf("# %s, curve %zu, %zu points: %s\n", what, c->count - 1, count, batten_error(ctx));
    batten_curve_free(curve);
    return;
  }
  c->proven++;
  c->counted += info.inflections_found == info.inflections_wanted;
  c->contradict += st == BATTEN_W_SHAPE;
  c->wiggles += info.inflections_unconstrained > info.inflections_wanted;
  c->ratio += log((info.rms + 1e-9 * size_of(count, points)) /
                  (sqrt(info.lsq_unconstrained / (double)count) + 1e-9 * size_of(count, points)));
  c->worst = fmax(c->worst, info.max_error / size_of(count, points));
  batten_curve_free(curve);
}

static void report(const char *what, const curves *c, double worst) {
  T_CHECK(c->count > 0 && c->proven == c->count && c->counted == c->count, "%s: %zu of %zu curves proven", what,
          c->proven, c->count);
  T_RATIO(c->worst, worst, "%s: largest distance, in parts of the size", what);
  printf(
      "# %s: geometric mean of rms / unconstrained rms %.3f; %zu wiggle without inequalities; %zu called of another "
      "shape\n",
      what, exp(c->ratio / (double)c->count), c->wiggles, c->contradict);
}

/* ---- frames ------------------------------------------------------------------------------------- */

static void fit_frame(batten_context *ctx, const char *what, size_t count, const double *points, curves *c) {
  batten_contour_options o = batten_contour_options_default();
  if (count >= 6) fit(ctx, what, count, points, &o, c);
}

/* Half-breadths of every third station, ascending z; stations that are 0 there are left out. */
static bool read_frames(batten_context *ctx, curves *c) {
  FILE *file = open_shared("hulls/gunnerus_offsets.csv");
  static double table[POINTS][3];
  char line[256];
  size_t rows = 0, stations = 0;
  while (file && rows < POINTS && fgets(line, sizeof line, file))
    if (sscanf(line, "%lf,%lf,%lf", &table[rows][0], &table[rows][1], &table[rows][2]) == 3) rows++;
  if (file) fclose(file);
  for (size_t first = 0; first < rows; first++) {
    bool seen = false;
    for (size_t i = 0; i < first; i++) seen = seen || table[i][0] == table[first][0];
    double frame[2 * 64];
    size_t count = 0;
    for (size_t i = first; i < rows && !seen && count < 64; i++)
      if (table[i][0] == table[first][0] && table[i][2] > 0) {
        frame[2 * count] = table[i][2];
        frame[2 * count++ + 1] = table[i][1];
      }
    stations += !seen;
    if (!seen && stations % 3 == 0) fit_frame(ctx, "frames of a ship", count, frame, c);
  }
  return rows > 0;
}

static void make_frames(batten_context *ctx, curves *c) {
  for (uint64_t seed = 0; seed < 12; seed++) {
    contour_rule rule = {.kind = CONTOUR_FRAME, .count = 14, .inflections = seed % 2, .noise = 5e-4, .seed = seed};
    contour_scene s = contour_scene_make(&rule);
    fit_frame(ctx, "made frames", s.count, s.points, c);
    contour_scene_free(&s);
  }
}

/* ---- slices ------------------------------------------------------------------------------------- */

static void fit_slice(batten_context *ctx, const char *what, size_t count, const double *points, curves *c) {
  batten_contour_options o = batten_contour_options_default();
  o.closed = 1;
  if (count >= 8) fit(ctx, what, count, points, &o, c);
}

/* Every fourth of them. */
static bool read_slices(batten_context *ctx, curves *c) {
  FILE *file = open_shared("contours/rt_Heart.txt");
  static double slice[2 * POINTS];
  char line[256];
  size_t count = 0, slices = 0;
  bool any = file;
  while (file && fgets(line, sizeof line, file)) {
    double z;
    if (!strncmp(line, "contour", 7)) {
      if (slices++ % 4 == 2) fit_slice(ctx, "slices of a heart", count, slice, c);
      count = 0;
    } else if (count < POINTS && sscanf(line, "%lf %lf %lf", &slice[2 * count], &slice[2 * count + 1], &z) == 3) {
      count++;
    }
  }
  if (file) fclose(file);
  return any;
}

/* Outlines on a raster of 2 mm, of size 100 mm. */
static void make_slices(batten_context *ctx, curves *c) {
  for (uint64_t seed = 0; seed < 8; seed++) {
    contour_rule rule = {.kind = CONTOUR_LOOP, .count = 150, .inflections = 2 * (seed % 3), .seed = seed};
    contour_scene s = contour_scene_make(&rule);
    for (size_t i = 0; i < 2 * s.count; i++) s.points[i] = round(s.points[i] / s.size * 200) / 2;
    fit_slice(ctx, "made slices", s.count, s.points, c);
    contour_scene_free(&s);
  }
}

/* ---- meridians ---------------------------------------------------------------------------------- */

/* Points at a longitude in degrees and opposite to it, round the body: by angle. */
typedef struct angle_point {
  double angle, p[2];
} angle_point;

static int by_angle(const void *a, const void *b) {
  double x = ((const angle_point *)a)->angle, y = ((const angle_point *)b)->angle;
  return (x > y) - (x < y);
}

static bool read_meridians(batten_context *ctx, curves *c) {
  enum { MERIDIANS = 3 };
  bool any = false;
  for (int k = 0; k < MERIDIANS; k++) {
    FILE *file = open_shared("phobos/phobos_thomas_xyz.txt");
    angle_point at[720];
    double p[3], points[2 * 720], longitude = 60.0 * k * 3.14159265358979 / 180;
    size_t count = 0;
    while (file && count < 720 && fscanf(file, "%lf %lf %lf", &p[0], &p[1], &p[2]) == 3) {
      double along = cos(longitude) * p[0] + sin(longitude) * p[1],
             off = cos(longitude) * p[1] - sin(longitude) * p[0];
      if (fabs(off) > 1e-3) continue;
      at[count++] = (angle_point){atan2(p[2], along), {along, p[2]}};
    }
    if (!file) return any;
    fclose(file);
    any = true;
    qsort(at, count, sizeof *at, by_angle);
    for (size_t i = 0; i < count; i++) memcpy(points + 2 * i, at[i].p, sizeof at[i].p);
    fit_slice(ctx, "meridians of a moon", count, points, c);
  }
  return any;
}

static void make_meridians(batten_context *ctx, curves *c) {
  for (int k = 0; k < 6; k++) {
    double points[2 * 180];
    for (int i = 0; i < 180; i++) {
      double a = 2 * 3.14159265358979 * i / 180, lon = 0.5 * k;
      double u[3] = {cos(a) * cos(lon), cos(a) * sin(lon), sin(a)}, r = scene_moon_radius(u);
      points[2 * i] = r * cos(a);
      points[2 * i + 1] = r * sin(a);
    }
    fit_slice(ctx, "made meridians", 180, points, c);
  }
}

/* ---- a wing ------------------------------------------------------------------------------------- */

/* NACA 2412 from the trailing edge over the upper side and the nose back to it: open, for the edge is a corner. Table
 * with five decimals, as they are printed. Convex from edge to edge: no inflection is wanted, and none comes out. */
static void test_wing(batten_context *ctx) {
  double points[2 * 71];
  for (int i = 0; i <= 70; i++) {
    double a = 3.14159265358979 * i / 70, x = cos(a) * cos(a), mean, half;
    contour_naca(0.02, 0.4, 0.12, x, &mean, &half);
    points[2 * i] = round(1e5 * x) / 1e5;
    points[2 * i + 1] = round(1e5 * (2 * i <= 70 ? mean + half : mean - half)) / 1e5;
  }
  for (unsigned degree = 3; degree <= 5; degree += 2) {
    batten_contour_options o = batten_contour_options_default();
    o.degree = degree;
    o.fix_ends[0] = o.fix_ends[1] = 1;
    batten_curve *curve = NULL;
    batten_contour_info info;
    T_OK(batten_contour_fit(ctx, 71, points, &o, &curve, NULL, NULL, &info), ctx);
    if (!curve) continue;
    T_CHECK(info.shape.certified && info.inflections_found == info.inflections_wanted,
            "NACA 2412, degree %u: proven, %zu inflections, %zu without inequalities, %zu spans", degree,
            info.inflections_found, info.inflections_unconstrained, info.spans);
    T_RATIO(info.max_error, 5e-4, "largest distance, in chords");
    batten_curve_form f = batten_curve_get(curve);
    const double *last = f.control_points + 2 * (f.knot_count - f.degree - 2);
    T_CHECK(hypot(f.control_points[0] - points[0], f.control_points[1] - points[1]) < 1e-15 &&
                hypot(last[0] - points[140], last[1] - points[141]) < 1e-15,
            "the trailing edge stays sharp, where it is");
    batten_curve_free(curve);
  }
}

int main(void) {
  batten_context *ctx = t_context(NULL, NULL, 2);
  const char *absent = "BATTEN_SHARED does not lead to it";
  curves c[6] = {{0}};
  if (read_frames(ctx, &c[0]))
    report("frames of a ship", &c[0], 0.05);
  else
    t_skip("frames of a ship", absent);
  make_frames(ctx, &c[1]);
  report("made frames", &c[1], 0.03);
  if (read_slices(ctx, &c[2]))
    report("slices of a heart", &c[2], 0.05);
  else
    t_skip("slices of a heart", absent);
  make_slices(ctx, &c[3]);
  report("made slices", &c[3], 0.02);
  if (read_meridians(ctx, &c[4]))
    report("meridians of a moon", &c[4], 0.05);
  else
    t_skip("meridians of a moon", absent);
  make_meridians(ctx, &c[5]);
  report("made meridians", &c[5], 0.05);
  test_wing(ctx);
  batten_context_free(ctx);
  return t_done();
}
