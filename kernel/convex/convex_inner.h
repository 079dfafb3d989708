/* The map of kernel/convex, and what its parts say to each other.
 *
 * parameters.c, floater.c  parameters of scattered points (triangulation: mesh/delaunay.c)
 * objective.c              sums of squares and tension as matrices; their minimum
 * cones.c                  bounding cones of first derivatives and of their cross products on a box
 * inequalities.c           boxes, cones, rows: linear inequalities around a reference surface [section 4]
 * reference.c              the search for the tension weight [section 3]
 * correct.c                parameter correction
 * fit.c                    batten_convex_fit: checks, scales, rounds, judgement
 * function_rows.c, function.c   batten_convex_function_fit
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

/* Of coordinates apart: `n` = convex_points. */
typedef struct convex_objective {
  size_t n, count;
  double *tension; /* [n][n] both triangles: b'T b is the integral of eq. 3 */
  double *design;  /* [count][n] values of the basis at the parameters, times sqrt(weight) */
  double *normal;  /* [n][n] design' design */
  double *right;   /* [n][3] design' (sqrt(weight) points) */
} convex_objective;

#endif
