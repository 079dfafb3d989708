/* The judge: residuals and proofs recomputed from the caller's problem. Shares nothing with the engines, not even
 * rows.c: plain loops over the caller's arrays with compensated sums (twice the working precision), so that the
 * figures are those of x and y, not of rounding in the check. */
#ifndef BATTEN_QP_CERTIFY_H
#define BATTEN_QP_CERTIFY_H

#include <batten/qp.h>
#include <stdbool.h>

/* Fills objective, residuals, gap and scales of info at x [n] and y [m + n]; y NULL = zeros. work [2 n]. The gap is
 * |gradient'x - sum of y_i side_i|, its scale the largest of |x'Px|, |q'x| and |sum of y_i side_i| (P = A'WA + H,
 * q = g - A'Wb). A y_i whose side is infinite is charged to the dual residual and adds nothing to the gap. */
void qp_certify_residuals(const batten_qp_problem *problem, const double *x, const double *y, double *work,
                          batten_qp_info *info);
/* Whether info's residuals are within the tolerances; the second: the primal one alone. */
bool qp_certify_optimal(const batten_qp_info *info, const batten_qp_options *o);
bool qp_certify_feasible(const batten_qp_info *info, const batten_qp_options *o);

/* Cleans and scales the proposed y [m + n] so that its bound sum is 1 (the multipliers of bounds are set so that C'y
 * + y_bounds vanishes as far as x has bounds there) and tells whether it proves that no x exists: what is left of
 * C'y_rows + y_bounds is below n eps-like rounding of the sum of |C_ij y_i|, and the bound sum is positive beyond its
 * own rounding. work [2 n]. */
bool qp_certify_infeasible(const batten_qp_problem *problem, double *y, double *work);
/* Whether the direction d [n], scaled to slope -1, lies in the recession cone with P d = 0 up to rounding. work [n]. */
bool qp_certify_unbounded(const batten_qp_problem *problem, double *d, double *work);
/* Whether d'H d < 0 beyond rounding. */
bool qp_certify_not_convex(const batten_qp_problem *problem, const double *d);

#endif
