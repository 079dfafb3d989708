/* Which of very many constraints does x violate? Full passes over all rows are memory-bound, so they are few: each
 * brings a list of candidates, on which the dual engine pivots until none is violated. */
#ifndef BATTEN_QP_PRICING_H
#define BATTEN_QP_PRICING_H

#include "engine.h"

typedef struct qp_pricing {
  const qp_rows *rows;
  const signed char *active; /* [m] members are not priced */
  const double *inverse;     /* [n][n] R^-1 */
  double feasibility;        /* violations up to this times sum_i |a_ki x_i| are rounding */

  /* Rows have length one: a slack shrinks by no more than x moves. */
  double length;     /* |x| */
  double path;       /* length of the way that x went from pass to pass */
  double *last;      /* [n] x of the last pass */
  double *safe_till; /* [m] a row needs no product while path is below */

  size_t chunk, chunks; /* rows that make one offer; they depend on m and n alone */
  size_t per_block;     /* chunks of one task */
  size_t *offer;        /* [chunks] most violated row of each chunk, SIZE_MAX = none */
  double *offer_by;     /* by how much */

  size_t count;          /* of candidates now */
  size_t *candidate;     /* [most] */
  const double **values; /* [most] their rows, dense, not scaled: the caller's or in copy */
  double *copy;          /* [most][n] of sparse ones */
  double *weight;        /* [most] 1 / |R^-T a_k|: takes violations into the objective's metric */
  double *known;         /* [m] the same of every row that was a candidate, else 0 */
  size_t *fresh;         /* [most] scratch: candidates without */
  double *product;       /* [most] a_k'x */
  double first;          /* distance of the farthest one met in this pass */
  bool *skip;            /* [most] given up until the next pass */
} qp_pricing;

/* Free with qp_pricing_free, also after NOMEM. */
batten_status qp_pricing_new(batten_context *ctx, const qp_rows *rows, const signed char *active,
                             const double *inverse, qp_pricing *p);
void qp_pricing_free(batten_context *ctx, qp_pricing *p);
size_t qp_pricing_bytes(const qp_rows *rows);

/* Full pass at x: fills the candidates. True when a row is violated. */
bool qp_pricing_pass(batten_context *ctx, qp_pricing *p, const double *x);

/* The candidate whose side is farthest from x in the objective's metric, where a step to it raises the objective most
 * (by half the square of the distance, as far as no member is in the way): its place, or SIZE_MAX when it is time for
 * the next pass. */
size_t qp_pricing_worst(qp_pricing *p, const double *x);

/* Gives the candidate at a place up until the next pass. */
static inline void qp_pricing_skip(qp_pricing *p, size_t place) {
  p->skip[place] = true;
  p->first = 0; /* no measure for the others */
}

/* By how much a_k'x = product misses its sides beyond rounding, else 0; *side the side missed. For the x of the last
 * qp_pricing_pass or qp_pricing_worst. */
double qp_pricing_violation(const qp_pricing *p, size_t k, double product, const double *x, signed char *side);

/* The rounding allowed to a_k'x; also to the side, for near it the two are the same. */
double qp_pricing_tolerance(const qp_pricing *p, size_t k, const double *x);

#endif
