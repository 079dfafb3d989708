/* Inside of least energy: the system, the minimisation over unit gradients, and the field that comes of it. */
#ifndef BATTEN_SOLID_ORIENT_ENERGY_H
#define BATTEN_SOLID_ORIENT_ENERGY_H

#include "orient.h"

/* See orient_system.c; matrices column-major. */
typedef struct batten_orient_system {
  unsigned n;
  size_t count, size; /* N, n N */
  double middle[3];
  double *x;                  /* [N][n] about their centroid `middle` */
  double *d, *vd;             /* [N][n] */
  double *e;                  /* [n][n N] */
  double dd[9], dvd[9];       /* d'd, d'V d: row q, column c at q * 3 + c */
  double *values, *mixed;     /* [N][N] Q'V Q, [N][n N] Q'(W + V d (1' x I)) */
  double *factor, *y;         /* L and Y at lambda */
  double *matrix;             /* [n N][n N]: S above the diagonal, its Cholesky factor on and below */
  double *diagonal;           /* [n N] of S */
  double *reflectors, tau[4]; /* Householder QR of P = (1, x') */
  double lambda;
} batten_orient_system;

batten_status batten_orient_system_new(batten_context *ctx, unsigned n, size_t count, const double *points,
                                       batten_orient_system *out);
void batten_orient_system_free(batten_context *ctx, batten_orient_system *s);
/* SINGULAR: lambda is too small for the points' distances. */
batten_status batten_orient_system_factor(batten_context *ctx, batten_orient_system *s, double lambda);
/* S v, and M g = S^-1 g; vectors [N][n]. */
void batten_orient_system_multiply(const batten_orient_system *s, const double *v, double *sv);
void batten_orient_system_solve(const batten_orient_system *s, const double *g, double *mg);
/* Coefficients of the f that belongs to gradients g: a [N], b [N][n], linear part c [n]. */
batten_status batten_orient_system_field(batten_context *ctx, const batten_orient_system *s, const double *g,
                                         double *a, double *b, double *c);

/* Minimises g' M g over unit g_i from g [N][n]; mg = M g and *energy belong to the result. `part` is what progress is
 * told. */
batten_status batten_orient_minimize(batten_context *ctx, const batten_orient_system *s, double part, double *g,
                                     double *mg, double *energy);
/* Unit vectors along M's eigenvector of the smallest eigenvalue, point by point. */
batten_status batten_orient_eigenvector(batten_context *ctx, const batten_orient_system *s, double part, double *g);
/* Scales each vector of g [N][n] to length 1; a zero vector becomes the first axis. */
void batten_orient_normalize(unsigned n, size_t count, double *g);

#endif
