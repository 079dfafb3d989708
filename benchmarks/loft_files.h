/* The files that lofts of batten and of others are compared by: doubles, contours and surfaces.
 *
 * Scene: count, closed, degree, smoothness, then for each contour its height, its number of knots, knots, control
 * points [knots - degree - 1][2].
 * Surface: seconds (median), builds that were timed, degrees by u and v, numbers of knots, knots of u and v, control
 * points [n_u][n_v][3], parameters v of the contours. */
#ifndef LOFT_FILES_H
#define LOFT_FILES_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

enum { LOFT_HEAD = 4, LOFT_SURFACE_HEAD = 6, LOFT_REPEATS_MAX = 25 };

typedef struct loft_contour_file {
  double height;
  size_t knot_count;
  const double *knots, *points;
} loft_contour_file;

typedef struct loft_scene_file {
  double *numbers;
  size_t count;
  bool closed;
  unsigned degree, smoothness;
  loft_contour_file *contours;
} loft_scene_file;

static inline bool loft_numbers(FILE *file, const double *values, size_t count) {
  return fwrite(values, sizeof *values, count, file) == count;
}

static inline void loft_scene_file_free(loft_scene_file *s) {
  free(s->contours);
  free(s->numbers);
}

/* All of a file's numbers, for free(); NULL where it cannot be read or has fewer than `least`. */
static inline double *loft_file_read(const char *path, size_t least, size_t *size) {
  FILE *file = fopen(path, "rb");
  long bytes = -1;
  if (!file) return NULL;
  if (fseek(file, 0, SEEK_END) == 0) bytes = ftell(file);
  *size = bytes > 0 ? (size_t)bytes / sizeof(double) : 0;
  double *numbers = calloc(*size + 1, sizeof(double));
  bool good = numbers && *size >= least && fseek(file, 0, SEEK_SET) == 0 &&
              fread(numbers, sizeof(double), *size, file) == *size;
  fclose(file);
  if (good) return numbers;
  free(numbers);
  return NULL;
}

static inline bool loft_scene_file_read(const char *path, loft_scene_file *s) {
  size_t size;
  *s = (loft_scene_file){.count = 0};
  s->numbers = loft_file_read(path, LOFT_HEAD, &size);
  if (!s->numbers) return false;
  s->count = (size_t)s->numbers[0];
  s->closed = s->numbers[1] > 0;
  s->degree = (unsigned)s->numbers[2];
  s->smoothness = (unsigned)s->numbers[3];
  s->contours = calloc(s->count + 1, sizeof *s->contours);
  if (!s->contours) return false;
  size_t at = LOFT_HEAD;
  for (size_t i = 0; i < s->count && at + 2 <= size; i++) {
    loft_contour_file *c = &s->contours[i];
    c->height = s->numbers[at];
    c->knot_count = (size_t)s->numbers[at + 1];
    c->knots = s->numbers + at + 2;
    c->points = c->knots + c->knot_count;
    at += 2 + c->knot_count + 2 * (c->knot_count - s->degree - 1);
  }
  return at == size;
}

static inline int loft_by_value(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

typedef struct loft_surface_file {
  double seconds;
  size_t builds;
  unsigned degree[2];
  size_t knot_count[2];
  const double *knots[2], *points;
  size_t count;
  const double *parameters; /* [count] of the contours */
} loft_surface_file;

static inline bool loft_surface_file_write(const char *path, const loft_surface_file *s) {
  double head[LOFT_SURFACE_HEAD] = {s->seconds,   (double)s->builds,        s->degree[0],
                                    s->degree[1], (double)s->knot_count[0], (double)s->knot_count[1]};
  size_t points = (s->knot_count[0] - s->degree[0] - 1) * (s->knot_count[1] - s->degree[1] - 1);
  FILE *file = fopen(path, "wb");
  bool good = file && loft_numbers(file, head, LOFT_SURFACE_HEAD) &&
              loft_numbers(file, s->knots[0], s->knot_count[0]) &&
              loft_numbers(file, s->knots[1], s->knot_count[1]) && loft_numbers(file, s->points, 3 * points) &&
              loft_numbers(file, s->parameters, s->count);
  if (file && fclose(file) != 0) good = false;
  return good;
}

#endif
