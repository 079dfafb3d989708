/* Point sets with known outward normals, for the tests of orientation. */
#ifndef ORIENT_SCENES_H
#define ORIENT_SCENES_H

#include <batten/solid.h>

#include "tap.h"

enum { SCENE_MAX = 20000 };

typedef struct scene {
  const char *name;
  unsigned n;
  size_t count;
  double *points, *normals; /* [SCENE_MAX][n] */
} scene;

static const double s_pi = 3.141592653589793;

static inline scene s_new(const char *name, unsigned n) {
  scene s = {name, n, 0, calloc(SCENE_MAX * n, sizeof(double)), calloc(SCENE_MAX * n, sizeof(double))};
  return s;
}
static inline void s_free(scene *s) {
  free(s->points);
  free(s->normals);
}
static inline void s_add(scene *s, const double *x, const double *normal) {
  double square = 0;
  for (unsigned c = 0; c < s->n; c++) square += normal[c] * normal[c];
  for (unsigned c = 0; c < s->n; c++) {
    s->points[s->count * s->n + c] = x[c];
    s->normals[s->count * s->n + c] = normal[c] / sqrt(square);
  }
  s->count++;
}

/* count points spread evenly (Fibonacci's spiral) over a sphere; side -1: the wall of a cavity. */
static inline void s_sphere(scene *s, size_t count, const double center[3], double radius, double side) {
  for (size_t i = 0; i < count; i++) {
    double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z),
           a = s_pi * (1 + sqrt(5)) * ((double)i + 0.5);
    double u[3] = {r * cos(a), r * sin(a), z}, x[3], v[3];
    for (int c = 0; c < 3; c++) x[c] = center[c] + radius * u[c], v[c] = side * u[c];
    s_add(s, x, v);
  }
}

/* count points of random, area-uniform parameters on a torus about axis (0: x, 1: y, 2: z). */
static inline void s_torus(scene *s, size_t count, const double center[3], double major, double minor, int axis,
                           uint64_t seed) {
  for (size_t i = 0; i < count;) {
    double u = 2 * s_pi * t_uniform(&seed), v = 2 * s_pi * t_uniform(&seed);
    if (t_uniform(&seed) * (major + minor) > major + minor * cos(v)) continue;
    double w[3], x[3], d[3] = {cos(u) * cos(v), sin(u) * cos(v), sin(v)},
                       ring[3] = {major * cos(u), major * sin(u), 0};
    for (int c = 0; c < 3; c++) {
      int to = (c + axis + 1) % 3;
      w[to] = d[c];
      x[to] = center[to] + ring[c] + minor * d[c];
    }
    s_add(s, x, w);
    i++;
  }
}

/* Plate [0, 1]^2 of two jittered grids and rims, its sides `gap` grid spacings apart. */
static inline void s_plate(scene *s, size_t cells, double gap, double jitter, uint64_t seed) {
  double h = 1 / (double)cells, half = gap * h / 2;
  for (int side = -1; side <= 1; side += 2)
    for (size_t i = 0; i <= cells; i++)
      for (size_t j = 0; j <= cells; j++) {
        double a = jitter * h * (t_uniform(&seed) - 0.5), b = jitter * h * (t_uniform(&seed) - 0.5);
        double x[3] = {(double)i * h + (i > 0 && i < cells ? a : 0), (double)j * h + (j > 0 && j < cells ? b : 0),
                       side * half};
        s_add(s, x, (double[3]){0, 0, side});
      }
  size_t rows = gap > 2 ? (size_t)gap - 1 : 1;
  for (size_t r = 1; r <= rows; r++)
    for (size_t i = 0; i < cells; i++) {
      double z = -half + 2 * half * (double)r / (double)(rows + 1), t = ((double)i + 0.5) * h;
      s_add(s, (double[3]){t, 0, z}, (double[3]){0, -1, 0});
      s_add(s, (double[3]){t, 1, z}, (double[3]){0, 1, 0});
      s_add(s, (double[3]){0, t, z}, (double[3]){-1, 0, 0});
      s_add(s, (double[3]){1, t, z}, (double[3]){1, 0, 0});
    }
}

/* Random points on the faces of [-1, 1]^3. */
static inline void s_cube(scene *s, size_t count, uint64_t seed) {
  for (size_t i = 0; i < count; i++) {
    double x[3], normal[3] = {0};
    for (int c = 0; c < 3; c++) x[c] = 2 * t_uniform(&seed) - 1;
    x[i % 3] = normal[i % 3] = i % 6 < 3 ? -1 : 1;
    s_add(s, x, normal);
  }
}

/* The letter C: ring 0.6 .. 1 with a mouth of 60 degrees and round ends, evenly spaced. */
static inline void s_thick_c(scene *s, size_t count) {
  double outer = 1, inner = 0.6, from = s_pi / 6, span = 2 * s_pi - 2 * from, tip = (outer - inner) / 2,
         mid = inner + tip;
  double length[4] = {span * outer, s_pi * tip, span * inner, s_pi * tip};
  double total = length[0] + length[1] + length[2] + length[3];
  for (size_t i = 0; i < count; i++) {
    double t = ((double)i + 0.5) * total / (double)count;
    int part = 0;
    while (t > length[part]) t -= length[part++];
    double a = part == 0 ? from + t / outer : part == 1 ? from + span : part == 2 ? from + span - t / inner : from;
    double u[2] = {cos(a), sin(a)}, b = a + t / tip + (part == 3 ? s_pi : 0), v[2] = {cos(b), sin(b)};
    if (part % 2)
      s_add(s, (double[2]){mid * u[0] + tip * v[0], mid * u[1] + tip * v[1]}, v);
    else if (part == 0)
      s_add(s, u, u);
    else
      s_add(s, (double[2]){inner * u[0], inner * u[1]}, (double[2]){-u[0], -u[1]});
  }
}

static inline void s_ellipse(scene *s, size_t count, double x, double y, double a, double b, double side) {
  for (size_t i = 0; i < count; i++) {
    double t = 2 * s_pi * ((double)i + 0.5) / (double)count;
    s_add(s, (double[2]){x + a * cos(t), y + b * sin(t)}, (double[2]){side * cos(t) / a, side * sin(t) / b});
  }
}

/* Percent of the normals within the angle of the truth. */
static inline double s_within(const scene *s, const double *normals, double angle_deg) {
  size_t good = 0;
  for (size_t i = 0; i < s->count; i++) {
    double cosine = 0;
    for (unsigned c = 0; c < s->n; c++) cosine += normals[i * s->n + c] * s->normals[i * s->n + c];
    good += cosine > cos(angle_deg * s_pi / 180);
  }
  return 100 * (double)good / (double)s->count;
}

/* Moves every point along its normal by a random length of at most `size`. */
static inline void s_noise(scene *s, double size, uint64_t seed) {
  for (size_t i = 0; i < s->count; i++) {
    double along = size * (2 * t_uniform(&seed) - 1);
    for (unsigned c = 0; c < s->n; c++) s->points[i * s->n + c] += along * s->normals[i * s->n + c];
  }
}

/* Orients the scene and judges the result: method that must have been used, least percent within 90 and 30 degrees.
 */
static inline void s_orient(batten_context *ctx, const scene *s, batten_orient_method method, size_t energy_points,
                            batten_orient_method expected, double least, double least_30) {
  double *normals = calloc(s->count * s->n, sizeof *normals), lambda = -1, start = batten_now();
  batten_orient_method used = BATTEN_ORIENT_METHOD_AUTO;
  T_OK(batten_orient(ctx, s->n, s->count, s->points, method, energy_points, normals, &used, &lambda), ctx);
  double share = s_within(s, normals, 90), share_30 = s_within(s, normals, 30), took = batten_now() - start;
  T_CHECK(share >= least && share_30 >= least_30 && used == expected &&
              (lambda > 0) == (used != BATTEN_ORIENT_METHOD_PLANES),
          "%s, %zu points, %s: %.2f %% within 90 degrees (at least %g), %.2f %% within 30 (%g), lambda %.2g, %.2f s",
          s->name, s->count, used == BATTEN_ORIENT_METHOD_PLANES ? "planes" : "energy", share, least, share_30,
          least_30, lambda, took);
  free(normals);
}

/* ../shared/data/NAME, or NULL when it is not there. */
static inline FILE *s_open(const char *name) {
  char path[1024];
  const char *shared = getenv("BATTEN_SHARED");
  if (!shared || snprintf(path, sizeof path, "%s/data/%s", shared, name) >= (int)sizeof path) return NULL;
  return fopen(path, "r");
}

#endif
