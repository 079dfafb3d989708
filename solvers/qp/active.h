/* The factorised working set of the dense engines [Goldfarb, Idnani 1983; Fletcher, Practical Methods, 10.1].
 *
 * With q members of normals N = [a_1 .. a_q], independent:   J = R^-1 Q,  Q orthogonal,   J'N = [T; 0]
 *   J = [J1 J2] [n][n] column-major, T [q][q] upper triangular.
 * In the variables R x the objective is 1/2 |Rx - c|^2: columns of J2 are an orthonormal basis of the directions along
 * which no member changes, so the step to the minimiser on the working set is J2 J2'(-gradient), and multipliers solve
 * T y = J1' gradient. Members are added by a reflection and dropped by rotations, 4 n^2 to 6 n^2 flops. */
#ifndef BATTEN_QP_ACTIVE_H
#define BATTEN_QP_ACTIVE_H

#include "engine.h"

typedef struct qp_active {
  const qp_rows *rows;
  size_t n, q;
  double *j;         /* [n][n] */
  double *t;         /* [n][n], leading dimension n */
  size_t *member;    /* [n] constraint at each place */
  signed char *side; /* [n] QP_LOWER, QP_UPPER, QP_EQUAL */
  double *place;     /* [n] scratch */
} qp_active;

/* Empty working set of the objective's factor R: J = R^-1. Free with qp_active_free, also after NOMEM. */
batten_status qp_active_new(batten_context *ctx, const qp_dense *objective, const qp_rows *rows, qp_active *set);
void qp_active_free(batten_context *ctx, qp_active *set);

/* d [n] = J'a_k: its first q entries are the row's part in the working set, the rest is what is new. */
void qp_active_project(const qp_active *set, size_t k, double *d);

/* Whether a_k depends on the members, given d: relative, |J2'a_k| against |J'a_k|. */
bool qp_active_depends(const qp_active *set, const double *d);

/* Adds constraint k, given d, which is overwritten; it must not depend on the members. */
void qp_active_add(qp_active *set, size_t k, signed char side, double *d);

/* Drops the member at a place; those behind move up by one. */
void qp_active_drop(qp_active *set, size_t place);

/* y [q]: T y = d[0 .. q-1] (from J1'gradient: multipliers; from J1'a_k: how a_k is made up of the members). */
void qp_active_solve(const qp_active *set, const double *d, double *y);

#endif
