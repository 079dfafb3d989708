/* What the parts of batten_convex_fit say to each other. Points are scaled, the domain is [0, 1]^2. */
#ifndef BATTEN_CONVEX_FIT_INNER_H
#define BATTEN_CONVEX_FIT_INNER_H

#include "convex_inner.h"

/* 1e-4 of the points' size: what departs by less is even to the eye and the hand, and no noise is taken for less. */
static const double CONVEX_EVEN = 1e-4;

/* options.c: every number in its range, or INVALID. */
batten_status convex_options_check(batten_context *ctx, const batten_convex_options *opt);
/* options.c: data that no fit makes sense of: INVALID. parameters as the caller gave them, or NULL. */
batten_status convex_data_check(batten_context *ctx, size_t count, const double *points,
                                const batten_convex_options *opt);
/* options.c: bounds in their order, or INVALID. */
batten_status convex_domain_check(batten_context *ctx, const double domain[2][2]);
/* options.c: the domain that the options mean. */
batten_status convex_domain(batten_context *ctx, size_t count, const double *parameters,
                            const batten_convex_options *opt, double domain[2][2]);

/* program.c: minimum of sum + w b'T b subject to rows. */
typedef struct convex_program {
  batten_qp_workspace *workspace;
  double *hessian; /* [3 n][3 n] where all is dense, else */
  size_t *starts;  /* compressed rows */
  uint32_t *indices;
  double *values;
  double *point; /* [3 n] */
} convex_program;
batten_status convex_program_new(batten_context *ctx, const convex_space *space, convex_program *out);
void convex_program_free(batten_context *ctx, convex_program *p);
/* free [n][3] the minimum without rows, reference [n][3] strictly feasible -> control [n][3]; feasible. *active rows
 * hold with equality. *solved false: rounding kept the engines from a result, control is untouched. */
batten_status convex_program_solve(batten_context *ctx, convex_program *p, const convex_objective *o,
                                   const convex_space *space, double w, const convex_rows *rows, const double *free,
                                   const double *reference, double *control, size_t *active, bool *solved);

/* One of the two surfaces that are compared: what has been reached, and at which parameters. */
typedef struct convex_track {
  double *control;    /* [n][3] the best so far */
  double *parameters; /* [count][2] its points' places */
  double *squares;    /* [count] squared distances from there */
  double sum;         /* weighted */
} convex_track;

/* judge.c: whether the data bend inwards by more than noise does. */
typedef struct convex_verdict {
  double misfit; /* as batten_convex_info.misfit */
  bool dent;
  size_t worst;  /* the point that is deepest in it, */
  double depth;  /* how far the mean there lies inside the chord, */
  size_t points; /* of that part of the data */
} convex_verdict;
batten_status convex_judge(batten_context *ctx, const convex_space *space, size_t count, const double *points,
                           const double *weights, const convex_track *convex, convex_verdict *out);

#endif
