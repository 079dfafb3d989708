/* The map of kernel/convex, and what its parts say to each other.
 *
 * parameters.c             batten_parametrize
 * plane.c                  the best plane and the least rectangle in it
 * disc.c, outline.c        triangulations that are a disc; how their rim goes to the square's
 * cloud.c                  the disc that points without triangles form (mesh/delaunay.c)
 * floater.c                shape-preserving parameters of a disc (sparse/averages.c)
 * objective.c              sums of squares and tension as matrices; their minimum
 * cones.c                  bounding cones of first derivatives and of their cross products on a box
 * boxes.c                  where the reference is convex enough for linear inequalities, by bisection [section 4]
 * inequalities.c           those inequalities as rows
 * reference.c              the search for the tension weight [section 3]
 * correct.c                parameter correction
 * program.c                the quadratic program of a round [section 5]
 * judge.c                  noise or a dent
 * options.c                of fits: defaults, ranges, data that make no sense
 * fit.c                    batten_convex_fit: scales, rounds, certificate
 * function*.c              batten_convex_function_fit, see function_inner.h
 *
 * In all of it points are scaled to a box of size about 1 around 0 (by a power of two), the domain is [0, 1]^2, and
 * the unknowns are the control points in the order [n_0][n_1][3] (functions: [n_0][n_1]). */
#ifndef BATTEN_CONVEX_INNER_H
#define BATTEN_CONVEX_INNER_H

#include <batten/convex.h>
#include <batten/qp.h>
#include <stdbool.h>

#include "basis/bspline.h"

/* The tensor product: space[0] in u, space[1] in v. */
typedef struct convex_space {
  bspline axis[2];
} convex_space;
static inline size_t convex_points(const convex_space *s) { return s->axis[0].count * s->axis[1].count; }

/* ---- inequalities (inequalities.c, cones.c) ------------------------------------------------------ */

typedef struct convex_row_options {
  unsigned directions, depth_max;
  double row_share, margin;
  size_t row_limit;
  bool *limited; /* NULL, or becomes true where row_limit refuses a reference */
} convex_row_options;

/* Rows of length 1 over 3 n_0 n_1 unknowns, exact parallels once. What satisfies rows x >= lower is convex. */
typedef struct convex_rows {
  batten_matrix matrix; /* dense when there is one span pair, else sparse; its arrays are batten's (free below) */
  double *lower;        /* [matrix.rows] margin times what the reference has there: > 0 */
  size_t boxes;
  unsigned depth; /* bisections of the smallest */
  int sign;       /* of the second fundamental form along x_u x x_v */
} convex_rows;

/* Inequalities that the reference [n_0][n_1][3] satisfies strictly. *accepted = false and *out untouched when the
 * reference is not convex enough for boxes of depth_max or needs more than row_limit rows. out NULL: only the
 * question, nothing is stored. Fails: NOMEM, CANCELLED. */
batten_status convex_rows_make(batten_context *ctx, const convex_space *space, const double *reference,
                               const convex_row_options *opt, bool *accepted, convex_rows *out);
void convex_rows_free(batten_context *ctx, convex_rows *rows);

/* ---- objective (objective.c) --------------------------------------------------------------------- */

/* Gram matrix of the k-th derivatives of a space's functions over its domain: out [count][count]. Exact. */
void convex_gram(const bspline *b, unsigned k, double *out);

/* Control point i of t and of t^2, t = (parameter - mean) / reach. */
void convex_quadratic(const bspline *b, size_t i, double mean, double reach, double out[2]);

/* The sum over points of weight |x(u, v) - point|^2, of coordinates apart: `n` = convex_points. */
typedef struct convex_objective {
  size_t n, count;
  unsigned order[2];    /* degree + 1: functions that live at a place */
  const double *points; /* [count][3] the caller's, as are the weights: positive, or NULL = ones */
  const double *weights;
  double *tension; /* [n][n] both triangles: b'T b is the integral of eq. 3 */
  double *basis;   /* [count][order[0] + order[1]] values of the functions in u, and in v */
  uint32_t *first; /* [count][2] the first of them */
  double *normal;  /* [n][n] both triangles: sum of weight N N' */
  double *right;   /* [3][n] sum of weight N point */
} convex_objective;

/* Everything that does not depend on the parameters. Fails: NOMEM, TOO_LARGE. */
batten_status convex_objective_new(batten_context *ctx, const convex_space *space, size_t count, const double *points,
                                   const double *weights, convex_objective *out);
void convex_objective_free(batten_context *ctx, convex_objective *o);
/* The rest. parameters [count][2] in [0, 1]^2. */
void convex_objective_set(convex_objective *o, const convex_space *space, const double *parameters);
/* The sum of squares at the parameters that were set. control [n][3]. */
double convex_objective_sum(const convex_objective *o, const convex_space *space, const double *control);
/* Minimum of sum + w b'T b: control [n][3]. Fails: SINGULAR, NOMEM. */
batten_status convex_objective_solve(batten_context *ctx, const convex_objective *o, const convex_space *space,
                                     double w, double *control);
/* Its limit for w -> infinity: the best biquadratic translational surface. SINGULAR: the parameters lie on one conic
 * whose axes are parallel to theirs, and no w determines the surface. */
batten_status convex_objective_limit(batten_context *ctx, const convex_objective *o, const convex_space *space,
                                     const double *parameters, double *control);

/* ---- places (correct.c) -------------------------------------------------------------------------- */

/* The surface and its derivatives at a place of [0, 1]^2: jet [6][3]: x, x_u, x_v, x_uu, x_uv, x_vv. */
void convex_jet(const convex_space *space, const double *control, const double place[2], double (*jet)[3]);

/* Up to `passes` steps of each point to a nearer place; parameters [count][2] stay in [0, 1]^2. No distance rises.
 * squares [count]: squared distances from the new places. On the context's threads. */
void convex_correct(batten_context *ctx, const convex_space *space, const double *control, size_t count,
                    const double *points, unsigned passes, double *parameters, double *squares);

/* ---- reference (reference.c) --------------------------------------------------------------------- */

typedef struct convex_reference {
  double *control; /* [n][3] the caller's memory */
  double weight;   /* w, beside the sum; INFINITY = the limit */
  unsigned steps;  /* doublings and halvings */
  bool found;      /* false: not even a bent plane will do, control is untouched */
  bool whole;      /* already w_least does: it is the best fit, and needs no inequalities */
  bool bent;       /* none is: it is a plane, bent a little, weight is INFINITY */
} convex_reference;

/* Whether the generator of inequalities takes a surface for strictly convex. Fails: NOMEM, CANCELLED. */
batten_status convex_is_convex(batten_context *ctx, const convex_space *space, const double *control,
                               const convex_row_options *rows, bool *convex);

/* Binary search for the least w, not below w_least, whose surface the generator of inequalities takes for convex.
 * Fails: SINGULAR, NOMEM, CANCELLED. */
batten_status convex_reference_find(batten_context *ctx, const convex_objective *o, const convex_space *space,
                                    const double *parameters, const convex_row_options *rows, double w_least,
                                    convex_reference *out);

#endif
