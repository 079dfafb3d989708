/* The inside of a carrier, shared by the files carrier*.c. */
#ifndef BATTEN_SOLID_CARRIER_INNER_H
#define BATTEN_SOLID_CARRIER_INNER_H

#include <batten/carrier.h>
#include <batten/solid.h>

#include "basis/interval.h"

#include <stdatomic.h>

enum {
  CARRIER_PARAMETERS = 16, /* most numbers of a kind: an ellipsoid's or box's 3 + 3 + 9 + 1 */
  CARRIER_DEPTH = 64,      /* most levels of unions and intersections: bounds the recursion of an evaluation */
  CARRIER_BLOCK = 256      /* points that pass through a composite or a callback at a time: stays in the cache */
};

struct batten_carrier {
  batten_context *ctx;
  atomic_size_t owners;
  batten_carrier_kind kind;
  unsigned n, depth;                     /* depth: 0 for a carrier without children */
  double parameters[CARRIER_PARAMETERS]; /* as the constructor got them: what is saved */
  size_t parameter_count;
  double axis[3];                /* unit vector of cylinder, torus and half-space */
  double middle[3], half_length; /* of the cylinder */
  batten_carrier *children[2];
  batten_solid *solid;
  batten_field field;
  double step; /* of differences of the field */
};

/* Values, gradients and Hessians of a primitive (ball .. half-space, none) at a batch; each may be NULL. */
void batten_carrier_shape(const batten_carrier *c, size_t count, const double *points, double *values,
                          double *gradients, double *hessians);

/* R-function of two fields at a batch: values f and g, gradients and Hessians as wanted (NULL = not); the result
 * replaces f, df and ddf. sign +1 union, -1 intersection. */
void batten_carrier_combine(unsigned n, double alpha, double sign, size_t count, double *f, double *df, double *ddf,
                            const double *g, const double *dg, const double *ddg);

/* All values of (f - alpha g) / S over f and g: the change of the root S of an R-function by f. */
interval batten_carrier_root_change(double alpha, interval f, interval g);
/* Bounds of the slope of an R-function |c_f df + c_g dg| over ranges of f and g, from those of both slopes. For alpha
 * = 1 one of the partial derivatives is 0 and the other 1, for alpha = 0 they are 1 + cos and 1 + sin of an angle,
 * and within [0, 2 / (1 + alpha)] in general. */
interval batten_carrier_join_steep(double alpha, double sign, interval f, interval g, interval df, interval dg);

/* A callback's field at up to CARRIER_BLOCK points with missing derivatives by central differences; checks that what
 * comes back is finite. */
batten_status batten_carrier_call(batten_context *ctx, const batten_carrier *c, size_t count, const double *points,
                                  double *values, double *gradients, double *hessians);

#endif
