/* The largest value of a child in space along a track of places y(x, t) for every point x: shadows (the union over an
 * interval) and sweeps without turning (the union over the places of a path). */
#ifndef BATTEN_FREP_HIGHEST_H
#define BATTEN_FREP_HIGHEST_H

#include "frep/frep_inner.h"

typedef struct frep_track {
  const batten_frep *child; /* in space */
  unsigned n;               /* of x */
  const void *user;
  size_t pieces; /* >= 1; u runs through [0, 1] in each, and where one ends the next begins */
  void (*place)(const void *user, size_t piece, double u, const double *x, double *y);
  void (*velocity)(const void *user, size_t piece, double u, double *dy); /* dy/du, the same for every x */
  /* Holds all places of the box for u in [from, to]; n intervals in, 3 out. */
  void (*image)(const void *user, size_t piece, double from, double to, const interval *x, interval *y);
} frep_track;

/* values [count]; slopes [count][3]: the child's gradient at the highest place, NULL = not wanted. */
batten_status frep_highest(const frep_track *track, batten_context *ctx, size_t count, const double *points,
                           double *values, double *slopes);
batten_status frep_highest_bounds(const frep_track *track, batten_context *ctx, size_t count, const double *boxes,
                                  double *ranges);
/* Upper bounds of |the child's gradient| over the places of boxes. */
batten_status frep_highest_slopes(const frep_track *track, batten_context *ctx, size_t count, const double *boxes,
                                  double *slopes);

#endif
