/* Within the objective of lofts: what it consists of. The formula is at objective.c. */
#ifndef BATTEN_LOFT_OBJECTIVE_H
#define BATTEN_LOFT_OBJECTIVE_H

#include "loft_inner.h"
#include "sparse/block.h"

enum { ORDER = BATTEN_SURFACE_DEGREE_MAX + 1 };

/* A quadratic form of the n + 1 control points of a polynomial. */
typedef struct form {
  double at[ORDER][ORDER];
} form;

struct loft_objective {
  batten_context *ctx;
  const loft_net *net;
  bool closed;
  double mean_gap, polygon; /* P */
  double tension;           /* a */
  form sampled, gram, bent; /* M; see make_bent */
  size_t *leg_start;        /* [slab_count + 1] */
  double *weight;           /* [legs] g / (rho P) */
  double *target;           /* [legs][n + 1][2] b */
  double constant;
  block_matrix h;
  block_plan *plan;
};

/* The control point behind j. */
static inline size_t objective_after(const loft_space *s, size_t j) { return j + 1 == s->count ? 0 : j + 1; }

/* Of trajectory j of patch i: a w / (g^3 P^2). */
double objective_trajectory_weight(const loft_objective *o, size_t i, size_t j);

/* objective_matrix.c: o->h of all else. Progress phase "objective". Fails: NOMEM, TOO_LARGE, CANCELLED. */
batten_status objective_make_matrix(batten_context *ctx, loft_objective *o);

#endif
