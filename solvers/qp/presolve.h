/* From the caller's rows and bounds to the constraints that engines see, and back. */
#ifndef BATTEN_QP_PRESOLVE_H
#define BATTEN_QP_PRESOLVE_H

#include "engine.h"

/* One constraint of the core may take its two sides from two constraints of the caller (parallel rows are merged,
 * rows of one entry become bounds). Constraints of the caller are numbered as in batten_qp_solution: rows, then
 * unknowns. */
typedef struct qp_presolve {
  const batten_qp_problem *problem;
  qp_rows rows;
  size_t *row;
  uint32_t *identity;
  double *scale, *lower, *upper;
  size_t *lower_from, *upper_from;     /* [m] the caller's constraint behind each side; SIZE_MAX = no such side */
  double *lower_factor, *upper_factor; /* [m] its multiplier = factor * the core's; negative where the row was turned round */
} qp_presolve;

/* problem has been checked. Leaves out rows without finite sides, zero rows, rows implied by the bounds; merges
 * parallel ones. E_INFEASIBLE when two sides cross beyond rounding and by more than slack (in the caller's units:
 * what is as good as feasible to him), or a zero row cannot hold: certificate [m + n] is then the proposed proof.
 * Free with qp_presolve_free, also after a failure. Time O(entries + m log m). */
batten_status qp_presolve_new(batten_context *ctx, const batten_qp_problem *problem, double slack, qp_presolve *out,
                              double *certificate);
void qp_presolve_free(batten_context *ctx, qp_presolve *p);

/* Multipliers and working set of the core -> the caller's ([m + n] each); either pair may be NULL. A multiplier of a
 * sign that the constraint has no side for is dropped. */
void qp_presolve_back(const qp_presolve *p, const double *y, const signed char *active, double *caller_y,
                      signed char *caller_active);
/* The caller's working set -> the core's; what back gave comes back as it was. */
void qp_presolve_forward(const qp_presolve *p, const signed char *caller_active, signed char *active);

#endif
