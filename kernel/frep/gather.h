/* Nodes whose value is that of one child elsewhere: f(x) = max over some places y of meet(g(y), w).
 *
 * Maps of space have one place y = phi^-1(x) for every x and no limit w; a bend that closes upon itself and a sweep
 * have several, and extrusions and sweeps are ended by a limit w, positive within. The node tells the places of one
 * point, and images of one box that hold all places of its points; here they are gathered into blocks for the child,
 * whose answers are folded into those of the node. */
#ifndef BATTEN_FREP_GATHER_H
#define BATTEN_FREP_GATHER_H

#include "frep/frep_inner.h"

enum { FREP_PLACES = 3, FREP_IMAGES = 6 /* most of a map, of a point and of a box */ };

typedef struct frep_place {
  double y[3];
  double jacobian[3][3]; /* dy_i / dx_j */
  double limit;          /* w, INFINITY = none */
  double limit_slope[3]; /* dw / dx */
} frep_place;

typedef struct frep_image {
  interval y[3];
  interval limit;
  double stretch; /* |dy/dx| is at most this in the box */
  size_t group;   /* > 0: each point of the box has a place in one of the images of the group; 0: it may have none */
} frep_image;

typedef struct frep_gather frep_gather;

/* Values and gradients of a, whose child takes y of dimension child->n. gradients may be NULL. At least one place
 * must be added for every point, in any order. */
batten_status frep_gather_new(batten_context *ctx, const batten_frep *a, size_t count, double *values,
                              double *gradients, frep_gather **out);
batten_status frep_gather_add(frep_gather *g, size_t point, const frep_place *place);
/* What has been added is in values and gradients after it. */
batten_status frep_gather_flush(frep_gather *g);
void frep_gather_free(frep_gather *g);

/* Ranges of a over boxes; slopes of a (upper bounds of |grad a|) instead where ranges is NULL. Images of one box are
 * added one after the other, those of a group too. */
batten_status frep_gather_boxes(batten_context *ctx, const batten_frep *a, size_t count, double *ranges,
                                double *slopes, frep_gather **out);
batten_status frep_gather_image(frep_gather *g, size_t box, const frep_image *image);

/* Maps: the places of a point and the images of a box; they return how many. */
typedef unsigned (*frep_places_of)(const batten_frep *a, const double *x, frep_place *places);
typedef unsigned (*frep_images_of)(const batten_frep *a, const interval *x, frep_image *images);
batten_status frep_map_evaluate(const batten_frep *a, batten_context *ctx, frep_places_of places_of, size_t count,
                                const double *points, double *values, double *gradients);
batten_status frep_map_bounds(const batten_frep *a, batten_context *ctx, frep_images_of images_of, size_t count,
                              const double *boxes, double *ranges, double *slopes);

/* Corners of a box [2][n] as intervals, and back: infinite ends become the largest numbers. */
void frep_box_intervals(unsigned n, const double *box, interval *x);
void frep_intervals_box(unsigned n, const interval *x, double *box);

/* sum_j matrix[j] x[j], and the range of what rounding makes of it. */
interval frep_linear_range(unsigned n, const double *row, const interval *x);

/* Inverse of a matrix [n][n], n = 2 or 3; false where it has none (map.c). */
bool frep_invert(unsigned n, const double *matrix, double *inverse);

#endif
