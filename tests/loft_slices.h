/* Slices that real tests of lofts start from: a heart and the frames of a ship, read where the data are there, and
 * twins of both that are made here. */
#ifndef LOFT_SLICES_H
#define LOFT_SLICES_H

#include <batten/solid.h>

#include "scenes.h"
#include "tap.h"

enum { POINTS = 8192, SLICES = 128 };

typedef struct stack {
  size_t count, starts[SLICES + 1], used; /* points; those beyond the last slice begin the next */
  double points[POINTS][2], heights[SLICES];
  bool closed;
} stack;

static inline FILE *open_shared(const char *name) {
  const char *shared = getenv("BATTEN_SHARED");
  char path[1024];
  if (!shared || snprintf(path, sizeof path, "%s/data/%s", shared, name) >= (int)sizeof path) return NULL;
  return fopen(path, "r");
}

static inline void add_point(stack *s, double x, double y) {
  double *p = s->points[s->used++];
  p[0] = x;
  p[1] = y;
}

/* The points since the last call are a slice; fewer than `least` are none. */
static inline void end_slice(stack *s, size_t least, double height) {
  if (s->used - s->starts[s->count] < least) {
    s->used = s->starts[s->count];
    return;
  }
  s->heights[s->count] = height;
  s->starts[++s->count] = s->used;
}

/* ---- a heart ------------------------------------------------------------------------------------ */

static inline bool read_heart(stack *s) {
  FILE *file = open_shared("contours/rt_Heart.txt");
  char line[256];
  double x, y, z, last = 0;
  if (!file) return false;
  while (fgets(line, sizeof line, file) && s->count + 1 < SLICES && s->used < POINTS) {
    if (strncmp(line, "contour", 7) == 0) end_slice(s, 3, last);
    if (sscanf(line, "%lf %lf %lf", &x, &y, &z) != 3) continue;
    add_point(s, x, y);
    last = z;
  }
  end_slice(s, 3, last);
  fclose(file);
  return s->count > 0;
}

/* Outlines on pixels of 1, from 25 to 40 wide, that move and turn, with a dent that comes and goes; each begins
 * somewhere, every seventh runs backwards. */
static inline void make_heart(stack *s) {
  uint64_t seed = 5;
  for (size_t i = 0; i < 24; i++) {
    double z = (double)i / 23, size = 25 + 60 * z * (1 - z), dent = 0.35 * sin(SCENE_PI * z) * (z > 0.2 && z < 0.8);
    double start = 2 * SCENE_PI * t_uniform(&seed);
    size_t count = (size_t)(4 * size);
    for (size_t k = 0; k < count; k++) {
      double a = start + (i % 7 == 6 ? -2 : 2) * SCENE_PI * (double)k / (double)count;
      double r = size * (1 + 0.1 * cos(2 * a + z) - dent * exp(-pow(remainder(a - 1 - z, 2 * SCENE_PI) / 0.4, 2)));
      add_point(s, 5 * z + r * cos(a) + 0.3 * t_uniform(&seed), r * sin(a) + 0.3 * t_uniform(&seed));
    }
    end_slice(s, 3, 3 * (double)i);
  }
}

/* ---- a ship ------------------------------------------------------------------------------------- */

static inline int by_station(const void *a, const void *b) {
  const double *p = a, *q = b;
  for (int k = 0; k < 2; k++)
    if (p[k] != q[k]) return p[k] < q[k] ? -1 : 1;
  return 0;
}

/* Half-breadths by waterline; of those that are 0 at the keel the highest is kept. */
static inline bool read_ship(stack *s) {
  FILE *file = open_shared("hulls/gunnerus_offsets.csv");
  static double table[POINTS][3];
  char line[256];
  size_t rows = 0;
  if (!file) return false;
  while (rows < POINTS && fgets(line, sizeof line, file))
    if (sscanf(line, "%lf,%lf,%lf", &table[rows][0], &table[rows][1], &table[rows][2]) == 3) rows++;
  fclose(file);
  qsort(table, rows, sizeof table[0], by_station);
  for (size_t i = 0; i < rows && s->count + 1 < SLICES; i++) {
    bool ends = i + 1 == rows || table[i + 1][0] != table[i][0];
    if (table[i][2] > 0 || (!ends && table[i + 1][2] > 0)) add_point(s, table[i][2], table[i][1]);
    if (ends) end_slice(s, 5, table[i][0]);
  }
  return s->count > 0;
}

/* Frames of a hull that is hollow in the bow. */
static inline void make_ship(stack *s) {
  for (size_t i = 0; i < 30; i++) {
    double z = (double)i / 29, full = 0.3 + 0.7 * sqrt(1 - z), hollow = 0.45 * z;
    for (size_t k = 0; k <= 14; k++) {
      double h = (double)k / 14;
      add_point(s, full * (pow(h, 0.5 + z) - hollow * sin(SCENE_PI * h) * h), h);
    }
    end_slice(s, 5, 6 * z);
  }
}

/* ---- outlines, and the solid that they bound ------------------------------------------------------ */

static inline const double *slice(const stack *s, size_t i, size_t *count) {
  *count = s->starts[i + 1] - s->starts[i];
  return s->points[s->starts[i]];
}

static inline double slice_area(const stack *s, size_t i) {
  size_t n;
  const double *p = slice(s, i, &n);
  double sum = 0;
  for (size_t k = 0; k < n; k++) {
    const double *a = p + 2 * k, *b = p + 2 * ((k + 1) % n);
    sum += 0.5 * (a[0] * b[1] - a[1] * b[0]);
  }
  return sum;
}

/* Distance of q from the outline of a slice, positive outside. */
static inline double slice_distance(const stack *s, size_t i, const double q[2]) {
  size_t n;
  const double *p = slice(s, i, &n);
  double least = INFINITY;
  bool inside = false;
  for (size_t k = 0; k < n; k++) {
    const double *a = p + 2 * k, *b = p + 2 * ((k + 1) % n), d[2] = {b[0] - a[0], b[1] - a[1]};
    double length = d[0] * d[0] + d[1] * d[1], t = 0;
    if (length > 0) t = fmin(fmax(((q[0] - a[0]) * d[0] + (q[1] - a[1]) * d[1]) / length, 0), 1);
    least = fmin(least, hypot(q[0] - a[0] - t * d[0], q[1] - a[1] - t * d[1]));
    if ((a[1] > q[1]) != (b[1] > q[1]) && q[0] < a[0] + d[0] * (q[1] - a[1]) / d[1]) inside = !inside;
  }
  return inside ? -least : least;
}

/* Every so many points of the slices with normals outwards: across the outline by its own points, along z by the
 * distances from the neighbours' outlines. Returns their number. */
static inline size_t slices_scatter(const stack *s, size_t every, double (*points)[3], double (*normals)[3]) {
  size_t used = 0;
  for (size_t i = 0; i < s->count; i++) {
    size_t n, below = i > 0 ? i - 1 : 0, above = i + 1 < s->count ? i + 1 : i;
    const double *p = slice(s, i, &n);
    double side = slice_area(s, i) > 0 ? 1 : -1;
    for (size_t k = i % every; k < n; k += every) {
      const double *a = p + 2 * ((k + n - 2) % n), *b = p + 2 * ((k + 2) % n), *q = p + 2 * k;
      double length = hypot(b[0] - a[0], b[1] - a[1]);
      double rise = slice_distance(s, above, q) - slice_distance(s, below, q);
      memcpy(points[used], (double[3]){q[0], q[1], s->heights[i]}, sizeof points[used]);
      memcpy(normals[used],
             (double[3]){side * (b[1] - a[1]) / length, side * (a[0] - b[0]) / length,
                         rise / (s->heights[above] - s->heights[below])},
             sizeof normals[used]);
      used++;
    }
  }
  return used;
}

/* A volume spline through every so many points; NULL where that fails. */
static inline batten_solid *slices_solid(batten_context *ctx, const stack *s, size_t every) {
  double(*points)[3] = malloc(s->used * sizeof *points), (*normals)[3] = malloc(s->used * sizeof *normals);
  batten_solid *solid = NULL;
  batten_solid_options o = batten_solid_options_default();
  if (!points || !normals) abort();
  size_t count = slices_scatter(s, every, points, normals);
  o.normals = normals[0];
  o.orientation = BATTEN_ORIENT_GIVEN;
  o.orient_data = BATTEN_ORIENT_DATA_PAIRS;
  o.check_cells = 8; /* normals are known: the check is not needed */
  o.spline.loo_samples = 0;
  if (batten_solid_fit(ctx, 3, count, points[0], &o, &solid, NULL) < 0) solid = NULL;
  free(points);
  free(normals);
  return solid;
}

#endif
