/* Unknowns that are weighted averages of each other and of given values: nonsymmetric systems with M-matrices. */
#ifndef BATTEN_SPARSE_AVERAGES_H
#define BATTEN_SPARSE_AVERAGES_H

#include <batten/base.h>
#include <stdint.h>

typedef struct sparse_averages {
  size_t count;
  const size_t *starts;    /* [count + 1] */
  const uint32_t *columns; /* [starts[count]] others than i, none twice; j has i when i has j */
  const double *weights;   /* [starts[count]] w_ij >= 0 */
  const double *given;     /* [count] g_i >= 0: the weights of given values together */
  const double *values;    /* [count][2]: the given values of i times their weights, added up */
} sparse_averages;

/* x [count][2] with (g_i + sum_j w_ij) x_i = values_i + sum_j w_ij x_j. Where the given values are not negative, each
 * x is right to a small multiple of the rounding unit however badly conditioned the system is, and so are solutions
 * near zero. Progress phase as given, from `from` to 1. Time of planar graphs O(count^1.5), room O(count log count).
 * Fails: SINGULAR (unknowns that no given value reaches), NOMEM, TOO_LARGE, CANCELLED. */
batten_status sparse_solve_averages(batten_context *ctx, const sparse_averages *a, const char *phase, double from,
                                    double *x);

#endif
