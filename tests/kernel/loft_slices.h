/* Slices that real tests of lofts start from: a heart and the frames of a ship, read where the data are there, and
 * twins of both that are made here. */
#ifndef LOFT_SLICES_H
#define LOFT_SLICES_H

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

#endif
