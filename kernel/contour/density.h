/* How densely breaks lie along the data: what knots.c asks of density.c. */
#ifndef BATTEN_CONTOUR_DENSITY_H
#define BATTEN_CONTOUR_DENSITY_H

#include "contour_inner.h"

/* A spline curve by least squares without inequalities. */
typedef struct contour_least {
  size_t spans;
  contour_space space;
  double *control; /* [space.b.count][2] */
} contour_least;

/* ends free. Fails: SINGULAR (too few points for the spans), NOMEM, TOO_LARGE. */
batten_status contour_least_fit(batten_context *ctx, const contour_data *data, const double *parameters,
                                unsigned degree, unsigned smoothness, bool closed, size_t spans, const double *breaks,
                                contour_least *out);
void contour_least_free(batten_context *ctx, contour_least *f);

/* What a fit leaves of the data. */
typedef struct contour_left {
  double rms;   /* of the distances' parts normal to the curve */
  double most;  /* largest distance */
  double noise; /* what the differences of neighbours tell, if distances were noise alone: then noise = rms */
} contour_left;
void contour_left_of(const bspline *b, const double *control, const contour_data *data, const double *parameters,
                     contour_left *out);

/* The criterion of Schwarz for `count` distances of this mean square and `unknowns` that made them: less is better.
 * Squares below `floor` count as floor. */
double contour_schwarz(size_t count, double rms, double floor, size_t unknowns);

/* Pieces of the domain between neighbouring data. */
typedef struct contour_density {
  size_t cells;
  double *at;    /* [cells + 1] from 0 to 1 */
  double *data;  /* [cells] part of the data in a cell */
  double *need;  /* [cells] part of what the curve needs */
  double *sum;   /* [cells + 1] of their blend, from 0 to 1 */
  size_t places; /* different parameters of points that have weight */
  double floor;  /* distances below which structure does not count: a part of the data's size, and what neighbours
                    deviate alike by */
  contour_least pilot;
} contour_density;

/* Fits a pilot, and tells from it where the curve needs breaks. parameters ascend. */
batten_status contour_density_make(batten_context *ctx, const contour_data *data, const double *parameters,
                                   unsigned degree, bool closed, contour_density *out);
void contour_density_free(batten_context *ctx, contour_density *d);

/* Blends need and data so that no cell gets more than `most` (>= 1) times its data's part. */
void contour_density_blend(contour_density *d, double most);
/* The blend up to t, and its inverse from cell *cell on (ascending sums). */
double contour_density_sum(const contour_density *d, double t);
double contour_density_place(const contour_density *d, double sum, size_t *cell);

/* By how much the pilot's tangent turns from one parameter to another, with its sign. */
double contour_pilot_turn(const contour_least *pilot, double from, double to);

#endif
