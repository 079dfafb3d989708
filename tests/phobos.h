/* Phobos for tests and benchmarks: the surface points of P. C. Thomas's shape model (NASA PDS) when they are at hand,
 * else a bumpy ellipsoid of the same size made here; and random subsets of them, drawn uniformly by area.
 *
 * The model is a latitude-longitude grid, crowded at the poles, so a point's weight is r^2 cos(latitude). Drawn without
 * replacement by the keys u^(1/weight) [Efraimidis, Spirakis 2006]. */
#ifndef PHOBOS_H
#define PHOBOS_H

#include "tap.h"

#include <batten/field.h>

typedef struct phobos {
  size_t count;
  double *points; /* [count][3], km */
  bool real;
} phobos;

typedef struct phobos_key {
  double key;
  size_t index;
} phobos_key;

static inline int phobos_by_key(const void *a, const void *b) {
  double x = ((const phobos_key *)a)->key, y = ((const phobos_key *)b)->key;
  return (x < y) - (x > y);
}

static inline bool phobos_read(const char *folder, phobos *out) {
  char path[4096], line[256];
  snprintf(path, sizeof path, "%s/phobos/phobos_thomas_xyz.txt", folder ? folder : "");
  FILE *file = folder ? fopen(path, "r") : NULL;
  if (!file) return false;
  out->real = true;
  while (out->count < 20000 && fgets(line, sizeof line, file)) {
    double *p = out->points + 3 * out->count;
    if (sscanf(line, "%lf %lf %lf", p, p + 1, p + 2) == 3) out->count++;
  }
  fclose(file);
  return out->count > 1000;
}

/* Latitude-longitude grid of a bumpy ellipsoid: 91 x 180 points less the repeated poles. */
static inline void phobos_make(phobos *out) {
  const double pi = 3.14159265358979323846;
  out->count = 0;
  out->real = false;
  for (int i = 0; i <= 90; i++)
    for (int j = 0; j < (i % 90 ? 180 : 1); j++) {
      double lat = pi * (i / 90. - 0.5), lon = pi * j / 90., *p = out->points + 3 * out->count++;
      double x = cos(lat) * cos(lon), y = cos(lat) * sin(lon), z = sin(lat);
      double bumps = 1 + 0.03 * sin(5 * x + 1) * sin(6 * y + 2) + 0.02 * sin(11 * z + 3) * sin(9 * x) +
                     0.01 * sin(17 * y) * sin(15 * z + 1);
      p[0] = 13 * bumps * x, p[1] = 11.4 * bumps * y, p[2] = 9.2 * bumps * z;
    }
}

static inline phobos phobos_points(void) {
  phobos p = {.points = malloc(20000 * 3 * sizeof(double))};
  if (!phobos_read(getenv("BATTEN_SHARED"), &p)) phobos_make(&p);
  return p;
}

/* Reorders p so that the first n points are the sample with this seed. */
static inline void phobos_draw(phobos *p, uint64_t seed) {
  phobos_key *keys = malloc(p->count * sizeof *keys);
  double *shuffled = malloc(p->count * 3 * sizeof *shuffled);
  for (size_t i = 0; i < p->count; i++) {
    const double *x = p->points + 3 * i;
    double r2 = x[0] * x[0] + x[1] * x[1] + x[2] * x[2], weight = sqrt(r2) * sqrt(x[0] * x[0] + x[1] * x[1]);
    keys[i] = (phobos_key){log(t_uniform(&seed) + 1e-300) / (weight + 1e-6 * r2), i};
  }
  qsort(keys, p->count, sizeof *keys, phobos_by_key);
  for (size_t i = 0; i < p->count; i++) memcpy(shuffled + 3 * i, p->points + 3 * keys[i].index, 3 * sizeof(double));
  free(p->points);
  free(keys);
  p->points = shuffled;
}

static inline double phobos_diameter(const phobos *p) {
  double best = 0;
  for (size_t i = 0; i < p->count; i += 7)
    for (size_t j = 0; j < i; j += 7) {
      const double *a = p->points + 3 * i, *b = p->points + 3 * j;
      double d = (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
      if (d > best) best = d;
    }
  return sqrt(best);
}

typedef struct phobos_error {
  double mean_radius, mean, max; /* km; mean and max of the error along the ray through the point */
  size_t lost;                   /* points without a crossing on their ray */
} phobos_error;

/* Distance between each of the points first .. count-1 and the surface f = 0, along the ray from the centre: an upper bound of
 * the distance. Secant steps in batches, on the radius. */
static inline phobos_error phobos_errors(batten_context *ctx, const batten_field *field, const phobos *p,
                                         size_t first) {
  size_t n = p->count - first;
  double *x = malloc(3 * n * sizeof *x), *g = malloc(3 * n * sizeof *g), *v = malloc(n * sizeof *v);
  double *scale = malloc(n * sizeof *scale);
  phobos_error e = {0};
  for (size_t i = 0; i < n; i++) scale[i] = 1;
  for (int step = 0; step < 12; step++) {
    for (size_t i = 0; i < 3 * n; i++) x[i] = p->points[3 * first + i] * scale[i / 3];
    if (field->evaluate(field->user, ctx, n, x, v, g, NULL) < 0) break;
    for (size_t i = 0; i < n; i++) {
      const double *q = p->points + 3 * (first + i);
      double slope = g[3 * i] * q[0] + g[3 * i + 1] * q[1] + g[3 * i + 2] * q[2], move = -v[i] / slope;
      scale[i] += fmax(-0.03, fmin(0.03, move));
    }
  }
  for (size_t i = 0; i < n; i++) {
    const double *q = p->points + 3 * (first + i);
    double r = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]), error = fabs(scale[i] - 1) * r;
    e.mean_radius += r / (double)n;
    if (!(error < 0.25 * r)) e.lost++;
    e.mean += error / (double)n;
    e.max = fmax(e.max, error);
  }
  free(x), free(g), free(v), free(scale);
  return e;
}

#endif
