/* Convex quadratic programs, stated as least squares or by their Hessian:
 *
 *   minimise    1/2 sum_i w_i (A x - b)_i^2  +  1/2 x'H x  +  g'x  +  constant
 *   subject to  lower <= C x <= upper,   x_lower <= x <= x_upper
 *
 * Three engines behind one call. Two are dense, for up to some hundred unknowns and very many rows: a dual active set
 * [Goldfarb, Idnani 1983] on the triangular factor of the objective, and a primal active set [Fletcher, Practical
 * Methods of Optimization, ch. 10] whose every iterate is feasible. The third is a proximal interior point on banded
 * or sparse factors, for hundreds to 1e5 unknowns. Whatever the engine, the result is judged by residuals that are
 * recomputed from the caller's own data by code that the engines do not share, and only what passes is BATTEN_OK. */
#ifndef BATTEN_QP_H
#define BATTEN_QP_H

#include <batten/base.h>
#include <batten/matrix.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The problem, n unknowns and m = c->rows rows. Start from batten_qp_problem_default(n). What is NULL is absent: no
 * least squares, no Hessian, a zero vector, no rows, no bounds. The arrays are the caller's and only read. */
typedef struct batten_qp_problem {
  size_t struct_size;
  size_t n;
  const batten_matrix *a; /* [k][n], any k: factored by QR in the dense engines, A'A is never formed there */
  const double *b;        /* [k]; NULL = zeros */
  const double *weights;  /* [k] >= 0; NULL = ones */
  const batten_matrix *h; /* [n][n] symmetric positive semidefinite, both triangles: the Hessian, or beside A a tension term */
  const double *g;        /* [n] */
  double constant;        /* only adds to the objective */
  const batten_matrix *c; /* [m][n] */
  const double *lower, *upper;     /* [m], of C x; -INFINITY, INFINITY = none; equal = equality */
  const double *x_lower, *x_upper; /* [n], of x; likewise */
} batten_qp_problem;
BATTEN_API batten_qp_problem batten_qp_problem_default(size_t n);

typedef enum batten_qp_engine {
  BATTEN_QP_AUTO = 0,    /* by estimated cost */
  BATTEN_QP_PRIMAL = 1,  /* primal active set: every iterate feasible, so that it can be stopped at any time */
  BATTEN_QP_DUAL = 2,    /* dual active set: fastest for few unknowns and many rows */
  BATTEN_QP_INTERIOR = 3 /* interior point on sparse rows: many unknowns */
} batten_qp_engine;

typedef struct batten_qp_options {
  size_t struct_size;
  batten_qp_engine engine; /* default AUTO */

  /* BATTEN_OK means primal_residual <= tolerance_absolute + tolerance_relative * primal_scale, and so on for the dual
   * residual and the gap (see batten_qp_info). Each >= 0, not both 0. The engines go on to rounding where that costs
   * little. Default 1e-9 both. */
  double tolerance_absolute, tolerance_relative;

  size_t iteration_limit; /* pivots or interior steps; 0 = chosen by size, generous. Default 0 */
  double time_limit_s;    /* seconds, > 0; INFINITY = none. Checked at every progress call. Default INFINITY */

  const double *x0;          /* [n] start; the primal engine goes on from it when it is feasible. NULL = none */
  const signed char *active; /* [m + n] working set to start from, as batten_qp_solution.active; NULL = none */

  int hand_over; /* 1: engines help each other: the interior point's active set is given to a dense engine for the last
                    digits where n allows it, and where an engine gets stuck, also one that was asked for, others are
                    tried. 0: one engine alone. Default 1 */

  /* 1: the result satisfies every inequality and bound exactly: in exact arithmetic, and in floating point however the
   * products of a row are added up. x is moved towards a strictly feasible point by the fraction that is
   * batten_qp_info.blend. Default 0 */
  int exact;
  const double *interior; /* [n] that strictly feasible point; NULL = x0 if it is one, else found. Only with exact */
} batten_qp_options;
BATTEN_API batten_qp_options batten_qp_options_default(void);

/* Where the result goes: the caller's arrays, each may be NULL. active, and multipliers and certificate, have the
 * rows first, then the bounds of x. x, multipliers, active are written by BATTEN_OK, W_ACCURACY and W_STOPPED;
 * certificate by E_INFEASIBLE; ray by E_UNBOUNDED and E_NOT_CONVEX; nothing else is touched. */
typedef struct batten_qp_solution {
  double *x;           /* [n] */
  double *multipliers; /* [m + n] y: gradient of the objective = C'y_rows + y_bounds; > 0 at a lower, < 0 at an upper side */
  signed char *active; /* [m + n] -1 at the lower side, 1 at the upper side, 2 equality, 0 not in the working set */
  double *certificate; /* [m + n] y with C'y_rows + y_bounds = 0 and sum of y_i (y_i > 0 ? lower_i : upper_i) = 1: no x exists */
  double *ray;         /* [n] unbounded: d with H d = 0, A d = 0, g'd = -1 along which every row stays satisfied;
                          not convex: d with d'H d < 0 */
} batten_qp_solution;

/* All figures come from the caller's data, at the very x and multipliers that are returned. */
typedef struct batten_qp_info {
  batten_qp_engine engine;   /* that gave the result */
  double objective;          /* of the problem as stated, constant included */
  double primal_residual;    /* largest violation of a row or bound, in the caller's units */
  double dual_residual;      /* largest |gradient - C'y_rows - y_bounds|, and of multipliers whose side has no bound */
  double duality_gap;        /* |primal objective - dual objective| */
  double primal_scale;       /* largest |C x|, |x| where x is bounded */
  double dual_scale;         /* largest of |A'W A x + H x|, |g - A'W b|, |C'y_rows + y_bounds| */
  double gap_scale;          /* largest of |x'(A'W A + H) x|, |(g - A'W b)'x|, |sum of y_i side_i| */
  size_t iterations;         /* pivots of the active set engines, steps of the interior point, over all rounds */
  size_t factorizations;     /* of the objective, of the interior point's matrix; fresh ones of the working set */
  size_t proximal_steps;     /* rounds of the proximal loop for semidefinite Hessians; 0 = not needed */
  size_t rows_used;          /* one-sided or two-sided constraints, bounds among them, left after presolve */
  size_t rows_active;        /* in the working set at the end */
  int cancelled;             /* W_STOPPED: non-zero = the host asked for it, 0 = a limit was met */
  size_t not_convex_index;   /* E_NOT_CONVEX: the unknown whose pivot is negative; else n */
  double blend;              /* exact: the fraction by which x was moved, in [0, 1] */
  double time_setup_s;       /* checks, presolve, first factorization */
  double time_solve_s;       /* engines and proximal loop */
  double time_s;             /* all */
} batten_qp_info;

/* Memory that solves share, so that solving again with the same sizes takes none from the host. One solve at a time. */
typedef struct batten_qp_workspace batten_qp_workspace;

/* Fails: INVALID, NOMEM. The workspace holds blocks of ctx: free it before the context; NULL is fine. */
BATTEN_API batten_status batten_qp_workspace_new(batten_context *ctx, batten_qp_workspace **out);
BATTEN_API void batten_qp_workspace_free(batten_qp_workspace *workspace);

/* Solves problem. opt NULL = defaults; workspace NULL = memory for this call alone (else it must be of ctx); solution
 * and info may be NULL. info is written whenever the status is one of these:
 *   BATTEN_OK           optimal, residuals within tolerance
 *   BATTEN_W_ACCURACY   the best point found; a residual misses its tolerance, or exact could not be had
 *   BATTEN_W_STOPPED    a limit was met or the host cancelled: x is feasible within tolerance, not optimal
 *   BATTEN_E_INFEASIBLE no x satisfies the rows; proven by certificate
 *   BATTEN_E_UNBOUNDED  the objective falls without end; proven by ray
 *   BATTEN_E_NOT_CONVEX H is not positive semidefinite; proven by ray and not_convex_index
 *   BATTEN_E_LIMIT      a limit was met before a feasible point was known, or no engine found a point
 * Other failures: INVALID, TOO_LARGE, NOMEM, CANCELLED (no feasible point was known).
 * Cost: dense engines O(k n^2 + n^3) to factor, then about 2 m n for a pass over all rows (some five to ten passes),
 * and 10 n^2 (dual) to 26 n^2 (primal) for a pivot; interior point: about 25 steps of n * bandwidth^2, or of a sparse
 * factor. Bytes: batten_qp_bytes. Threads: one call per context and workspace at a time; inputs are only read. */
BATTEN_API batten_status batten_qp_solve(batten_context *ctx, const batten_qp_problem *problem,
                                         const batten_qp_options *opt, batten_qp_workspace *workspace,
                                         batten_qp_solution *solution, batten_qp_info *info);

/* Bytes that solving will hold at most, and the engine that AUTO chooses (engine may be NULL). Fails: INVALID,
 * TOO_LARGE, NOMEM (it orders the unknowns). */
BATTEN_API batten_status batten_qp_bytes(batten_context *ctx, const batten_qp_problem *problem,
                                         const batten_qp_options *opt, size_t *bytes, batten_qp_engine *engine);

#ifdef __cplusplus
}
#endif
#endif
