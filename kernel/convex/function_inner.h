/* What the parts of batten_convex_function_fit say to each other.
 *
 * function.c        checks, scales, the result
 * function_terms.c  least squares and tension as sparse matrices
 * function_rows.c   Bernstein coefficients of Hessians, the two kinds of inequalities
 * function_least.c  the least eigenvalue of a spline's Hessian, by bounds
 * function_rounds.c the rounds between the upper and the lower bound
 *
 * In all of it the domain is [0, 1]^2, z is scaled to about 1 with its best plane taken off, and the sign of the
 * first constrained span pair is +1. A Hessian is three numbers f_xx, f_xy, f_yy. */
#ifndef BATTEN_CONVEX_FUNCTION_INNER_H
#define BATTEN_CONVEX_FUNCTION_INNER_H

#include "convex_inner.h"

enum { FUNCTION_ORDER = 8, FUNCTION_TABLE = FUNCTION_ORDER * FUNCTION_ORDER, FUNCTION_ROUNDS_MAX = 20 };

typedef struct function_space {
  convex_space spline;
  unsigned smoothness[2];
  size_t n, spans[2];
  size_t *span[2];          /* [spans[i]] where they are among the knots */
  const signed char *signs; /* [spans[0]][spans[1]] */
  bool opposite;            /* there are both signs: no one bowl makes all of it strict, and none where they touch */
} function_space;

/* Compressed rows that grow, between lower and upper [rows]. */
typedef struct function_matrix {
  size_t rows, row_room, entry_room;
  size_t *starts;
  uint32_t *indices;
  double *values, *lower, *upper;
} function_matrix;

void function_matrix_free(batten_context *ctx, function_matrix *m);
/* Room for so many more rows and entries; NOMEM, TOO_LARGE. */
batten_status function_matrix_reserve(batten_context *ctx, function_matrix *m, size_t rows, size_t entries);
static inline batten_matrix function_matrix_view(const function_matrix *m, size_t columns) {
  return batten_matrix_sparse(m->rows, columns, m->starts, m->indices, m->values);
}

/* What is minimised: |design x - right|^2 + x' tension x. */
typedef struct function_terms {
  function_matrix design, tension; /* tension: with its weight; no rows when that is 0 */
  double *right;                   /* [design.rows] */
} function_terms;

/* Of points [count][3], weights [count] of sum 1 or NULL. */
batten_status function_terms_make(batten_context *ctx, const function_space *space, size_t count,
                                  const double *points, const double *weights, double tension, function_terms *out);
void function_terms_free(batten_context *ctx, function_terms *terms);
/* The two parts at x. */
double function_terms_squares(const function_terms *terms, const double *x);
double function_terms_tension(const function_terms *terms, const double *x);

/* A part of a span pair. */
typedef struct function_box {
  uint32_t span[2];
  unsigned depth;
  double lower[2], upper[2];
} function_box;
/* In a span pair. */
typedef struct function_place {
  uint32_t span[2];
  double at[2];
} function_place;
static inline int function_sign(const function_space *space, const uint32_t span[2]) {
  return space->signs[span[0] * space->spans[1] + span[1]];
}

/* Bernstein coefficients of the Hessian on a box: out [d_0 + 1][d_1 + 1][3]. */
void function_hessian_box(const function_space *space, const function_box *box, const double *x, double *out);
/* Coefficients [n] of (x^2 + y^2) / 2, whose Hessian is the identity. */
void function_bowl(const function_space *space, double *out);
/* Eigenvalues, the larger first, and the angle of its direction; 0 for multiples of the identity. */
void function_eigen(const double h[3], double values[2], double *angle);

typedef struct function_directions {
  unsigned extra; /* 0: four of each coefficient; more where it is nearly singular */
  double bunch;   /* least ratio of eigenvalues of the metric in which directions are spread, (0, 1] */
  double margin;  /* the Hessian minus this times the identity is to be semidefinite */
} function_directions;

/* The sufficient inequalities of a box, appended. reference: what directions are fitted to; other (may be NULL):
 * another spline whose null directions are also taken. */
batten_status function_rows_box(batten_context *ctx, const function_space *space, const function_box *box,
                                const function_directions *opt, const double *reference, const double *other,
                                double scale, function_matrix *rows);

/* Equalities that hold where opposite signs meet along a line, appended: f is linear along it, its slope across is
 * constant, and its second derivative across vanishes if that is continuous. */
batten_status function_equalities(batten_context *ctx, const function_space *space, function_matrix *rows);

/* Necessary inequalities where x violates them by more than tolerance, appended: in every span pair at the lowest
 * places of a grid, and at `also` (NULL: nowhere). *worst: the least eigenvalue that was met, 0 if none is below. */
batten_status function_cuts(batten_context *ctx, const function_space *space, const double *x, double tolerance,
                            const function_place *also, function_matrix *cuts, double *worst);

/* A proven lower bound of the least eigenvalue (signed as asked) over all constrained span pairs; at most
 * max(tolerance, 1/16 of it) off unless box_limit boxes are not enough. *where: of the least that was met. */
batten_status function_least(batten_context *ctx, const function_space *space, const double *x, double tolerance,
                             size_t box_limit, double *least, function_place *where);

typedef struct function_rounds_options {
  unsigned rounds;
  double gap_tol;
  double floor;   /* objectives below it are nothing */
  double noise;   /* of second derivatives, by rounding of coefficients */
  bool rows_only; /* the result comes from the sufficient inequalities alone: for tests */
} function_rounds_options;

typedef struct function_rounds_info {
  unsigned rounds;
  size_t rows[FUNCTION_ROUNDS_MAX], cuts;
  double upper[FUNCTION_ROUNDS_MAX]; /* objectives after each round */
  double lower, squares_lower;
  double objective;
  double margin;       /* proven: the least eigenvalue, negative = slack is needed */
  double scale;        /* of second derivatives */
  double least_margin; /* that was asked for */
  double time_rows, time_qp;
} function_rounds_info;

/* x [n]: the best spline found, unconstrained [n]. */
batten_status function_rounds(batten_context *ctx, const function_space *space, const function_terms *terms,
                              const function_rounds_options *opt, double *x, double *unconstrained,
                              function_rounds_info *info);

#endif
