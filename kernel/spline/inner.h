/* The inside of a volume spline and of its fit, for kernel/spline only. */
#ifndef BATTEN_SPLINE_INNER_H
#define BATTEN_SPLINE_INNER_H

#include <batten/spline.h>

#include "basis/polynomial.h"
#include "spline/clusters.h"
#include "spline/sum.h"

#include <stdatomic.h>
#include <stdbool.h>

struct batten_spline {
  atomic_size_t owners;
  batten_context *ctx;
  batten_spline_parts parts; /* pointers into the blocks below */
  batten_polynomial basis;
  spline_terms terms;
  spline_clusters clusters;
  double *numbers; /* everything of type double */
  size_t *gradient_at;
};

/* The caller's unit <-> the unit box. Everybody who changes units uses this one line, so that a centre that is
 * evaluated meets itself at distance exactly 0. */
static inline double spline_to_box(double x, double origin, double scale) { return (x - origin) / scale; }

/* What the iterative solver takes of a system beside its entries; see sums.c. */
typedef struct spline_sums {
  batten_saddle_sums calls;  /* their user is the spline_system */
  double *points;            /* [rows][n] in the unit box, of each unknown */
  struct spline_plan *plans; /* alive; they share operators */
} spline_sums;

/* The system of a fit: unknowns 0 .. N-1 are the weights of the values, N + a M + q the weight of the
 * derivative along axis a of gradient q. */
typedef struct spline_system {
  unsigned n, m, power;
  size_t count, gradient_count; /* N, M */
  size_t rows;                  /* N + n M */
  const size_t *gradient_at;    /* [M] points with gradients; NULL: the first M */
  double origin[3], scale;
  double *y[3];  /* [N] points in the unit box; absent axes NULL */
  double *gy[3]; /* [M] those with gradients */
  double *p;     /* [k][rows] polynomial part */
  batten_polynomial basis;
  double smoothing;
  const double *smoothing_per_point; /* [N] or NULL */
  const spline_code *code;
  spline_sums *sums; /* NULL until they are made */
} spline_system;

/* Units, coordinates and polynomial part of checked data. Fails: INVALID (extent overflows), NOMEM. Freed in both
 * cases by batten_spline_system_free; opt's arrays must live as long. */
batten_status batten_spline_system_make(batten_context *ctx, const batten_spline_data *data,
                                        const batten_spline_options *opt, spline_system *system);
void batten_spline_system_free(batten_context *ctx, spline_system *system);
/* The fill callback of the saddle solver; user is a spline_system. */
void batten_spline_system_fill(const void *user, size_t row0, size_t rows, size_t col0, size_t cols, double *tile,
                               size_t ld);

/* Whether the iterative solver has sums of this dimension. */
bool batten_spline_sums_exist(unsigned n);
/* Bytes that the sums of all unknowns take at an accuracy; SIZE_MAX on overflow. */
size_t batten_spline_sums_bytes(unsigned n, unsigned m, size_t points, size_t gradients, double accuracy);
/* system->sums; freed in both cases by batten_spline_sums_free, after the plans. Fails: NOMEM. */
batten_status batten_spline_sums_make(batten_context *ctx, spline_system *system);
void batten_spline_sums_free(batten_context *ctx, spline_system *system);

/* Everything that can be wrong with the caller's data before a system is made, and with the points after it. */
batten_status batten_spline_check_data(batten_context *ctx, const batten_spline_data *data,
                                       const batten_spline_options *opt);
batten_status batten_spline_check_points(batten_context *ctx, const spline_system *system);

#endif
