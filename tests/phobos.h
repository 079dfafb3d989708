/* Phobos for tests and benchmarks: the surface points of P. C. Thomas's shape model (NASA PDS) when they are at hand,
 * else a bumpy ellipsoid of the same size made here; and random subsets of them. Every point is as likely as every
 * other; the model is a latitude-longitude grid, so both the sample and the points left over are denser near the
 * poles. */
#ifndef PHOBOS_H
#define PHOBOS_H

#include "tap.h"

#include <batten/field.h>

typedef struct phobos {
  size_t count;
  double *points; /* [count][3], km */
  bool real;
} phobos;

static inline bool phobos_read(const char *folder, phobos *out) {
  char path[4096], line[256];
  snprintf(path, sizeof path, "%s/data/phobos/phobos_thomas_xyz.txt", folder ? folder : "");
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

/* Shuffles p: the first n points are then the sample of n with this seed. */
static inline void phobos_draw(phobos *p, uint64_t seed) {
  for (size_t i = p->count; i > 1; i--) {
    size_t j = (size_t)(t_uniform(&seed) * (double)i);
    double *a = p->points + 3 * (i - 1), *b = p->points + 3 * j;
    for (int c = 0; c < 3; c++) {
      double keep = a[c];
      a[c] = b[c], b[c] = keep;
    }
  }
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
  double mean_radius, mean, max; /* km */
  size_t lost;                   /* points from which no surface was found */
} phobos_error;

/* Distance between each of the points first .. count-1 and the surface f = 0: Newton steps along the gradient to a
 * point of the surface, so an upper bound of the distance. */
static inline phobos_error phobos_errors(batten_context *ctx, const batten_field *field, const phobos *p,
                                         size_t first) {
  size_t n = p->count - first;
  const double *start = p->points + 3 * first;
  double *x = malloc(3 * n * sizeof *x), *g = malloc(3 * n * sizeof *g), *v = malloc(n * sizeof *v);
  phobos_error e = {0};
  memcpy(x, start, 3 * n * sizeof *x);
  for (int step = 0; step < 10; step++) {
    if (field->evaluate(field->user, ctx, n, x, v, g, NULL) < 0) break;
    for (size_t i = 0; i < n; i++) {
      const double *d = g + 3 * i, square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      for (size_t c = 0; c < 3; c++) x[3 * i + c] -= v[i] * d[c] / square;
    }
  }
  if (field->evaluate(field->user, ctx, n, x, v, g, NULL) < 0) e.lost = n;
  for (size_t i = 0; i < n; i++) {
    const double *q = start + 3 * i, *y = x + 3 * i, *d = g + 3 * i;
    double r = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    double error =
        sqrt((y[0] - q[0]) * (y[0] - q[0]) + (y[1] - q[1]) * (y[1] - q[1]) + (y[2] - q[2]) * (y[2] - q[2]));
    double left = fabs(v[i]) / sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    e.mean_radius += r / (double)n;
    if (!(left < 1e-6 * r)) e.lost++;
    e.mean += error / (double)n;
    e.max = fmax(e.max, error);
  }
  free(x), free(g), free(v);
  return e;
}

#endif
