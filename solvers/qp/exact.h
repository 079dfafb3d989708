/* Feasibility that is exact: blend with a strictly feasible point. */
#ifndef BATTEN_QP_EXACT_H
#define BATTEN_QP_EXACT_H

#include "engine.h"

/* Moves x [n] towards a strictly feasible point by the smallest fraction *blend with which every inequality holds in
 * exact arithmetic and under any order of floating point summation (rounding bounds of [Higham, Accuracy and
 * Stability, 3.1] for each row, all evaluated on the rounded x that is returned); bounds are met by clipping x.
 * interior [n] is the caller's point, or NULL: then x0 if it is strictly feasible and not too near the rows, else one
 * is found by projecting x on the constraints moved inwards (rows: the presolved ones, for the engines). Equalities
 * are left as they are. W_ACCURACY with a text when there is no such point: x, *blend untouched. Else NOMEM,
 * TOO_LARGE, CANCELLED. */
batten_status qp_exact(batten_context *ctx, const batten_qp_problem *problem, const qp_rows *rows,
                       const qp_limits *limits, const double *interior, const double *x0, double *x, double *blend);

#endif
