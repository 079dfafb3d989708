/* Pieces of a curve whose first and second differences can be separated.   [section 2.2 (ii), Lemma, eq. 3]
 *
 * A piece of sign sigma is accepted when there are directions u, v with sigma [u, v] > 0 and, for the Bernstein
 * coefficients a_i of x' and c_i of x'' on it,
 *
 *   sigma [u, a_i] >= 0,   sigma [a_i, v] >= 0,   sigma [v, c_i] >= 0,   sigma [u, c_i] >= 0:
 *
 * a_i lie in the cone (u, v), c_i in the cone (-u, v), so that sigma [a_i, c_j] >= 0 for all i and j, and curvature
 * has the sign sigma. (For [u, v] < 0 the cones would be those of other signs.) */
#ifndef BATTEN_CONTOUR_WEDGES_H
#define BATTEN_CONTOUR_WEDGES_H

#include "contour_inner.h"

/* x' and x'' on a piece: rows [degree][degree + 1] and [degree - 1][degree + 1] of coefficients, as combinations of
 * the control points mu - degree .. mu. */
typedef struct contour_piece {
  double first[BSPLINE_ORDER * BSPLINE_ORDER], second[BSPLINE_ORDER * BSPLINE_ORDER];
  bool zero_first, zero_last; /* x'' at its begin (end) is 0 by the equalities: an inflection of a C^2 curve */
} contour_piece;

/* w: place of the piece. */
void contour_piece_set(contour_piece *p, const contour_shape *shape, const bspline *b, const contour_wedge *w);

/* Pieces with their wedges for all of the reference, in their order; arguments and failures as contour_rows_make has
 * them. *wedges [*count] is batten's; NULL: only the question. */
batten_status contour_wedges_make(batten_context *ctx, const contour_shape *shape, const bspline *b,
                                  const double *reference, const contour_row_options *opt, const contour_rows *old,
                                  bool *accepted, contour_wedge **wedges, size_t *count);

/* The least value of a row at the reference that rounding leaves its sign. Points are of size one, rows of length 1.
 */
static const double CONTOUR_CLEAR = 1e-14;

#endif
