/* What the parts of solvers/qp say to each other. Data flow one way (public types in <batten/qp.h>):
 *
 *   qp.c         the driver (driver.h): check.c the caller's problem, choose.c engines, judge, try the next, then
 *   presolve.c     caller's rows and bounds -> qp_rows: unit length, merged, redundant ones left out; and back again
 *   objective.c    caller's A, b, w, H, g   -> qp_objective: gradients, triangular factor, sparse Hessian
 *   proximal.c     the dense engines on a strictly convex problem, or on a sequence of such
 *     dual.c (pricing.c), primal.c (phase1.c, search.c), both on active.c: 1/2 |R x - c|^2
 *   interior.c     1/2 x'Hx + g'x on sparse rows: scaled.c, newton.c, polish.c, proof.c
 *     kkt.c          its linear systems: bordered.c or ldl.c, orders and bands from
 *                    solvers/sparse; pattern.c
 *   refine.c digits.c   the last digits on a working set, and below the rounding of x and y
 *   certify.c    residuals, certificates, rays from the caller's data alone
 *   exact.c      the blend with a strictly feasible point
 *
 * Inner loops, of the engines (lanes.c) and of the judge (judge_sums.c), are built once for each instruction set.
 *
 * All memory is that of qp_context(workspace): a context whose blocks stay in the workspace between solves, so code
 * below allocates and frees with batten_alloc() as everywhere. */
#ifndef BATTEN_QP_ENGINE_H
#define BATTEN_QP_ENGINE_H

#include <batten/qp.h>
#include <math.h>
#include <stdbool.h>

/* Constraints as engines see them: lower[k] <= a_k'x <= upper[k] with a_k = scale[k] * (a row of the caller, or of
 * the unit matrix) of length 1. */
typedef struct qp_rows {
  size_t n, m;             /* unknowns, constraints */
  const batten_matrix *c;  /* the caller's rows; NULL = none */
  const size_t *row;       /* [m] row of c, or c->rows + j for the bounds of unknown j; ascending */
  const uint32_t *identity; /* [n] 0, 1, 2, ...: where the rows of the unit matrix have their entries */
  const double *scale;     /* [m] > 0 */
  const double *lower, *upper; /* [m] of a_k'x; lower <= upper, not both infinite; equal = equality */
} qp_rows;

/* a_k'x */
double qp_rows_dot(const qp_rows *rows, size_t k, const double *x);
/* to [n] += factor * a_k */
void qp_rows_add(const qp_rows *rows, size_t k, double factor, double *to);
/* out[i] = a_{first+i}'x, i < count: one matrix-vector product where rows are dense */
void qp_rows_times(const qp_rows *rows, size_t first, size_t count, const double *x, double *out);
/* Entries of a_k: how many; unscaled values; their columns, or NULL when the row is dense (entry j is column j). A
 * bound gives one entry with value 1. */
size_t qp_rows_entries(const qp_rows *rows, size_t k, const double **values, const uint32_t **columns);

/* Entries of all constraints. */
size_t qp_rows_count(const qp_rows *rows);

static inline bool qp_rows_is_equality(const qp_rows *rows, size_t k) { return rows->lower[k] == rows->upper[k]; }

/* Side of a constraint in a working set; as in batten_qp_solution.active. */
enum { QP_FREE = 0, QP_LOWER = -1, QP_UPPER = 1, QP_EQUAL = 2 };

/* Dense strictly convex objective 1/2 |R x - c|^2. */
typedef struct qp_dense {
  size_t n;
  const double *r;      /* [n][n] column-major upper triangle, not singular */
  const double *target; /* [n] c */
} qp_dense;

/* Sparse convex objective 1/2 x'H x + g'x. */
typedef struct qp_sparse {
  size_t n;
  const batten_matrix *h; /* CSR, both triangles; rows sorted by column */
  const double *g;        /* [n] */
} qp_sparse;

typedef struct qp_limits {
  size_t iterations;    /* at most; SIZE_MAX = none */
  double deadline;      /* on the clock of batten_now(); INFINITY = none */
  double tolerance;     /* of the interior point: relative residuals and gap to go down to */
  double absolute, relative; /* of it too: and below absolute + relative * size; 0, 0 = no matter */
} qp_limits;

/* BATTEN_OK to go on; E_LIMIT past the deadline or when count iterations exceed the limit; E_CANCELLED by the host. */
batten_status qp_limits_check(batten_context *ctx, const qp_limits *limits, size_t count, double fraction);

/* What an engine starts from and leaves. Arrays are the driver's. */
typedef struct qp_point {
  double *x;           /* [n] in: start; out: result */
  double *y;           /* [m] out: gradient = sum y_k a_k; of E_INFEASIBLE: sum y_k a_k = 0 and sum y_k side_k > 0 */
  signed char *active; /* [m] in: working set to try (QP_FREE all: cold start); out: the final one */
  double *ray;         /* [n] out: of E_UNBOUNDED */
  bool have_x;         /* in: x is a start of the caller; out: x satisfies the rows up to rounding */
  size_t iterations, factorizations; /* added to */
} qp_point;

/* Engines. Status: BATTEN_OK optimal; E_INFEASIBLE (y proposed; certify.c decides); E_UNBOUNDED (interior: ray
 * proposed); E_LIMIT, E_CANCELLED with have_x telling whether x is feasible all the same; W_ACCURACY stuck: the point
 * is the best found; NOMEM. */
batten_status qp_dual(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, const qp_limits *limits,
                      qp_point *point);
batten_status qp_primal(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, const qp_limits *limits,
                        qp_point *point);
batten_status qp_interior(batten_context *ctx, const qp_sparse *objective, const qp_rows *rows, const qp_limits *limits,
                          qp_point *point);

/* Bytes that they will hold, and an estimate of their time in floating point operations. */
typedef struct qp_cost {
  size_t bytes;
  double flops;
} qp_cost;
qp_cost qp_dual_cost(const qp_rows *rows);
qp_cost qp_primal_cost(const qp_rows *rows);
batten_status qp_interior_cost(batten_context *ctx, const batten_matrix *h, const qp_rows *rows, qp_cost *out);

/* The workspace's inside: a context that keeps freed blocks for the next solve. Progress, threads and limits are
 * those of the outer context. */
batten_context *qp_context(batten_qp_workspace *workspace);
/* The caller's context that it was made with. */
batten_context *qp_outer_context(batten_qp_workspace *workspace);

#endif
