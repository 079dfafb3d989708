/* What primal.c and phase1.c share: a point, its working set, and the rows in sight.
 *
 * Few of very many rows are ever near the path of the iterates. Those that are make up the list in sight; both phases
 * work on it alone, and primal.c surveys all rows in between and brings into sight what is violated. With few rows
 * all are in sight from the start, and the method is Fletcher's as he wrote it. */
#ifndef BATTEN_QP_PRIMAL_H
#define BATTEN_QP_PRIMAL_H

#include "active.h"

/* A place on the way along p where the sum of infeasibilities gets steeper. */
typedef struct qp_break {
  double at, steeper;
  size_t place;     /* in sight */
  signed char side; /* that is crossed */
} qp_break;

typedef struct qp_search {
  batten_context *ctx;
  const qp_dense *objective;
  const qp_rows *rows;
  const qp_limits *limits;
  qp_point *point;
  qp_active set;
  size_t n, m;

  double *x;        /* [n] where the search is */
  double *p;        /* [n] direction */
  double *aim;      /* [n] minimiser on the working set */
  double *u;        /* [n] Q'R aim */
  double *y;        /* [n] multipliers of the members */
  double *d, *work; /* [n] scratch */
  double *most;     /* [n] largest |x_j| since values were computed from x */
  double size;      /* length of most */
  double *ever;     /* [n] largest |x_j| of all */
  double *f;        /* [n] phase 1: gradient of the sum of infeasibilities */
  double *jf;       /* [n] J'f */
  double f_size;    /* number of rows that it is the sum of */
  double weight;    /* of the sum of infeasibilities beside the objective: 0 in phase 2; INFINITY: it is alone */

  size_t sighted;    /* rows in sight */
  size_t *sight;     /* [m] which, in the order of their coming */
  double *value;     /* [m] a_k'x of the rows in sight, in that order */
  double *slope;     /* [m] a_k'p, likewise */
  double *rounding;  /* [m] errors in value, likewise, see qp_search_tolerance() */
  unsigned char *is; /* [m] QP_SEEN and so on, by constraint */
  qp_break *breaks;  /* [2 m] heap */

  double *safe;       /* [n] feasible in all rows, if have_safe */
  double *safe_value; /* [m] of all constraints, at safe */
  double *new_value;  /* [m] at the point surveyed */
  bool have_safe;
  size_t stuck; /* times that degeneracy was resolved since x moved */
  size_t since; /* pivots since values were computed from x */
} qp_search;

enum { QP_SEEN = 1, QP_MEMBER = 2, QP_SKIPPED = 4, QP_NEW = 8 };

/* Times that a point may be come back to before what moves it must be rounding. */
enum { QP_PATIENCE = 20 };

/* By how much more than its own rounding a row may be missed when it cannot be met better: it depends on members,
 * whose errors it has then as well. */
enum { QP_LOOSE = 64 };

/* Relative rounding in sums of n terms. */
double qp_search_error(size_t n);
/* sum of |a_kj x_j|: times qp_search_error() the errors in a_k'x. */
double qp_search_terms(const qp_search *s, size_t k, const double *x);
/* What a side of the row at a place in sight may be missed by. */
double qp_search_tolerance(const qp_search *s, size_t place, double side);

/* Counts a pivot; BATTEN_OK, E_LIMIT or E_CANCELLED. */
batten_status qp_search_pivot(qp_search *s);
/* Takes x into most, size and ever. */
void qp_search_remember(qp_search *s);
/* Brings constraint k into sight. */
void qp_search_see(qp_search *s, size_t k);
/* Values and rounding of the rows in sight, from x. */
void qp_search_refresh(qp_search *s);
/* Slopes along p. */
void qp_search_slopes(qp_search *s);
/* Moves x and values along p by alpha. */
void qp_search_move(qp_search *s, double alpha);
/* Moves x onto the members' sides. */
void qp_search_return(qp_search *s);
/* Adds the row at a place in sight, unless it depends on the members. */
bool qp_search_add(qp_search *s, size_t place, signed char side);
void qp_search_drop(qp_search *s, size_t place);
/* p, and y, on the working set. */
void qp_search_direction(qp_search *s);
void qp_search_multipliers(qp_search *s);
/* The member whose multiplier is most wrong beyond rounding, by what the objective gains without it; q if none. */
size_t qp_search_wrong(qp_search *s);
/* Where multipliers are wrong at the minimiser x: exchanges members with the rows that are met at x until p leads
 * away from none of them and no multiplier is wrong. False if p is then zero up to rounding: x is optimal; or if that
 * is all that it has been for long. */
bool qp_search_resolve(qp_search *s);
/* From the minimiser x on the working set, its multipliers right, to that on all rows in sight, by dual steps for
 * those that are violated. False when rounding is in the way. *st: as of qp_search_pivot(). */
bool qp_search_meet(qp_search *s, batten_status *st);

/* From x to a point where the rows in sight hold, on the working set as it is and becomes. E_INFEASIBLE: there is
 * none; point->y has the proof. */
batten_status qp_phase1(qp_search *s);
/* Whether the sum of infeasibilities falls along p beyond rounding. */
bool qp_phase1_falls(const qp_search *s);

#endif
