/* The factorised working set of the dense engines [Goldfarb, Idnani 1983; Fletcher, Practical Methods, 10.1].
 *
 * With q members of normals N = [a_1 .. a_q], independent:   J = R^-1 Q,  Q orthogonal,   J'N = [T; 0]
 *   J = [J1 J2] [n][n] column-major, T [q][q] upper triangular.
 * In the variables u = Q'Rx the objective is 1/2 |u - Q'c|^2 and x = J u: columns of J2 span the directions along
 * which no member changes, the step to the minimiser on the working set is J2 J2'(-gradient), and multipliers solve
 * T y = J1' gradient. Members are added by a reflection and dropped by rotations, 4 n^2 to 6 n^2 flops. */
#ifndef BATTEN_QP_ACTIVE_H
#define BATTEN_QP_ACTIVE_H

#include "engine.h"

typedef struct qp_active {
  const qp_rows *rows;
  size_t n, q;
  double *inverse;   /* [n][n] R^-1, upper triangle with zeros below: where qp_active_reset() starts */
  double *reach;     /* [n] lengths of the rows of R^-1, and of J whatever Q is */
  double *j;         /* [n][n] */
  double *t;         /* [n][n], leading dimension n; below the diagonal nothing is kept */
  double *target;    /* [n] Q'c */
  size_t *member;    /* [n] constraint at each place */
  signed char *side; /* [n] QP_LOWER, QP_UPPER, QP_EQUAL */
  double *scratch;   /* [n] */
} qp_active;

/* Empty working set of the objective's factor R: J = R^-1. Free with qp_active_free, also after NOMEM. */
batten_status qp_active_new(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, qp_active *set);
void qp_active_free(batten_context *ctx, qp_active *set);

/* Empties the set again, J = R^-1 fresh, with target c [n]. */
void qp_active_reset(qp_active *set, const double *c);

/* d [n] = J'a_k: its first q entries are the row's part in the working set, the rest is what is new. */
void qp_active_project(const qp_active *set, size_t k, double *d);

/* d [n] = J'v for any v [n]. */
void qp_active_project_vector(const qp_active *set, const double *v, double *d);

/* sum_i |a_ki| reach_i: bounds |J'a_k|, and times eps the rounding errors in it. */
double qp_active_row_reach(const qp_active *set, size_t k);

/* Whether a_k depends on the members up to rounding, given d: |J2'a_k| against sum_i |a_ki| reach_i >= |J'a_k|, of
 * which eps is the size of the errors in d. Does not change when rows, unknowns or the objective are scaled. */
bool qp_active_depends(const qp_active *set, size_t k, const double *d);

/* Adds constraint k, given d, which is overwritten; it must not depend on the members. */
void qp_active_add(qp_active *set, size_t k, signed char side, double *d);

/* Adds those of k [count] that do not depend on the members and each other, in an order of falling independence: QR
 * with column pivoting. Nothing changes on failure. */
batten_status qp_active_add_many(batten_context *ctx, qp_active *set, size_t count, const size_t *k,
                                 const signed char *side);

/* Drops the member at a place; those behind move up by one. */
void qp_active_drop(qp_active *set, size_t place);

/* y [q]: T y = d[0 .. q-1] (from J1'gradient: multipliers; from J1'a_k: how a_k is made up of the members). y may be
 * d. */
void qp_active_solve(const qp_active *set, const double *d, double *y);

/* u [q]: T'u = b[0 .. q-1] (from the members' sides: the part of u = Q'Rx that they fix). u may be b. */
void qp_active_solve_transposed(const qp_active *set, const double *b, double *u);

/* x [n] += factor * (columns first .. last-1 of J) u[first .. last-1]: J2 d2 is first = q, last = n. */
void qp_active_combine(const qp_active *set, size_t first, size_t last, double factor, const double *u, double *x);

/* The finite side that a member keeps. */
static inline double qp_active_bound(const qp_active *set, size_t place) {
  size_t k = set->member[place];
  return set->side[place] == QP_UPPER ? set->rows->upper[k] : set->rows->lower[k];
}

#endif
