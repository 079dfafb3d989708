/* The driver of quadratic programs, between its files: check.c, choose.c, proximal.c, refine.c, digits.c, qp.c. */
#ifndef BATTEN_QP_DRIVER_H
#define BATTEN_QP_DRIVER_H

#include "engine.h"
#include "objective.h"

/* check.c: the caller's mistakes. First sizes, pointers and numbers, without memory of its own; then what takes
 * memory: columns twice in a row, asymmetry of H. */
batten_status qp_check(batten_context *ctx, const batten_qp_problem *problem, const batten_qp_options *o);
batten_status qp_check_structure(batten_context *ctx, const batten_qp_problem *problem);

static inline size_t qp_problem_rows(const batten_qp_problem *p) { return p->c ? p->c->rows : 0; }

/* What the attempts at one problem share. */
typedef struct qp_task {
  const batten_qp_problem *problem;
  const qp_objective *objective;
  const qp_rows *rows;
  qp_limits limits;
  double least_rho;      /* that rho must have: 0 at first, more where an engine got stuck */
  double rho;            /* of the factor that the dense engines work with; 0 = strictly convex as it is */
  double *r, *base;      /* that factor, [n][n] and [n]; NULL until it is needed */
  size_t proximal_steps; /* added to */
  size_t not_convex_index;
  double factor_s; /* time that the factor took */
} qp_task;

/* proximal.c: PRIMAL or DUAL to the end, by a proximal loop where the objective is not strictly convex. Status as of
 * the engines, and E_NOT_CONVEX with point->ray. */
batten_status qp_dense_solve(batten_context *ctx, qp_task *task, batten_qp_engine engine, qp_point *point);
/* Makes task->r for the least rho that it takes, or once more with a larger one. */
batten_status qp_dense_factor(batten_context *ctx, qp_task *task, double *ray);
/* Asks for a larger rho; false when it is as large as makes sense. */
bool qp_dense_damp(qp_task *task);
/* Back to the least rho that the objective needs. */
void qp_dense_undamp(batten_context *ctx, qp_task *task);
void qp_task_free(batten_context *ctx, qp_task *task);

/* refine.c: the minimiser on the working set point->active alone, by steps of conjugate gradients on the factor, with
 * residuals in twice the working precision. *error: its relative residuals; INFINITY, and the point untouched, where
 * it breaks other rows or signs by more than rounding, or is not found. Fails: E_LIMIT, E_CANCELLED, NOMEM; the point
 * untouched. */
batten_status qp_refine(batten_context *ctx, const qp_task *task, qp_point *point, double *error);

/* digits.c: other doubles next to x [n] and y [m + n] of the caller, that meet the tolerances better; info is theirs
 * then. work [3 n]. */
void qp_last_digits(const batten_qp_problem *problem, const batten_qp_options *o, double *x, double *y, double *work,
                    batten_qp_info *info);

/* choose.c: engines in the order in which they are to be tried, by estimated cost. exactly: bytes count the interior
 * point even where it is only the last resort; that takes an ordering of the unknowns. */
typedef struct qp_plan {
  batten_qp_engine engine[3];
  double flops[3];
  size_t count;
  size_t bytes;          /* the most that one of them takes, factors included */
  bool dense_affordable; /* for the last digits of the interior point's result */
} qp_plan;
batten_status qp_choose(batten_context *ctx, const qp_task *task, const batten_qp_options *o, bool exactly,
                        qp_plan *plan);

#endif
