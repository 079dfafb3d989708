/* The caller's objective 1/2 |W^1/2 (A x - b)|^2 + 1/2 x'H x + g'x as engines need it. P = A'WA + H, q = g - A'Wb. */
#ifndef BATTEN_QP_OBJECTIVE_H
#define BATTEN_QP_OBJECTIVE_H

#include "engine.h"

typedef struct qp_objective {
  const batten_qp_problem *problem;
  size_t n, k;       /* unknowns, rows of A */
  double *metric;    /* [n] powers of two d_j > 0 of size sqrt(P_jj): d_j x_j are of size one; the proximal term is
                        rho/2 |D (x - center)|^2 */
  double *residual;  /* [k] scratch */
  struct qp_objective_state *state; /* what the factors for several rho share */
} qp_objective;

batten_status qp_objective_new(batten_context *ctx, const batten_qp_problem *problem, qp_objective *out);
void qp_objective_free(batten_context *ctx, qp_objective *o);

/* gradient [n] at x. */
void qp_objective_gradient(const qp_objective *o, const double *x, double *gradient);

/* r [n][n] column-major, diagonal > 0: R'R = P + rho D^2. By QR of [W^1/2 A; U; rho^1/2 D] where there is A (U'U = H
 * by pivoted Cholesky), else by Cholesky of H + rho D^2. base [n]: the c of rho's center 0, so that 1/2 |Rx - base|^2
 * is the objective + rho/2 |Dx|^2 up to a constant: Q'W^1/2 b - R^-T g, not through the normal equations. E_SINGULAR:
 * R is (numerically) singular: take a larger rho. E_NOT_CONVEX: *index and ray [n], with d'H d < 0; rho does not hide
 * it. QR of A and the test of H are done once, by the first call. */
batten_status qp_objective_factor(batten_context *ctx, const qp_objective *o, double rho, double *r, double *base,
                                  size_t *index, double *ray);
/* target [n] := base + rho R^-T D^2 center: the objective + rho/2 |D (x - center)|^2. */
void qp_objective_target(const qp_objective *o, double rho, const double *r, const double *base, const double *center,
                         double *target);

/* P and q as sparse matrix and vector; out's arrays are one allocation in *memory, out->h is h. Rows are sorted, each
 * has its diagonal entry, and P is symmetric to the last bit where H is. */
batten_status qp_objective_sparse(batten_context *ctx, const qp_objective *o, qp_sparse *out, batten_matrix *h,
                                  void **memory);
/* Whether H is semidefinite, for engines that do without factors: E_NOT_CONVEX, *index, ray [n] as of factor. By a
 * sparse factor of H where H is sparse. */
batten_status qp_objective_convex(batten_context *ctx, const qp_objective *o, size_t *index, double *ray);

/* ---- hessian.c: a symmetric matrix alone ---- */

/* E_NOT_CONVEX, *index, ray [n] as above, when H is not semidefinite up to rounding: by a dense factor, some n^3/3
 * flops and n^2 doubles; by a sparse one; by the minors of two rows alone, in O(entries). */
batten_status qp_hessian_convex(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray);
batten_status qp_hessian_convex_sparse(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray);
batten_status qp_hessian_minors(batten_context *ctx, const batten_matrix *h, size_t *index, double *ray);
/* u [n][n] column-major, its first *rank rows: U'U = H up to rounding, entries of column j being those of unknown j.
 * H is semidefinite. */
batten_status qp_hessian_root(batten_context *ctx, const batten_matrix *h, double *u, size_t *rank);

#endif
