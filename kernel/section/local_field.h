/* The function of a section over squares: local expansions of its far centres, bounds of the near ones. */
#ifndef BATTEN_SECTION_LOCAL_FIELD_H
#define BATTEN_SECTION_LOCAL_FIELD_H

#include <batten/solid.h>
#include <stdint.h>

#include "basis/interval.h"

enum { LOCAL_ORDER = 10 };

/* F = c[0] + c[1] x + c[2] y + sum of w r^2 ln r, in the unit box of its spline. */
typedef struct local_source {
  size_t count;
  double *x, *y, *w; /* [count] */
  double c[3];
  double rounding; /* of the sum of all terms, relative to the sum of their sizes */
} local_source;

/* A square of the tree, |x - middle[0]|, |y - middle[1]| <= half. */
typedef struct local_square {
  double middle[2], half;
} local_square;

/* A part of F over a square, u = (x + i y - middle) / half: within rest of Re(conj(u) phi(u) + chi(u)). */
typedef struct local_field {
  double phi[LOCAL_ORDER + 1][2], chi[LOCAL_ORDER + 1][2]; /* coefficients of u^k */
  double rest;
} local_field;

/* No source when the function is another one than a spline with r^2 ln r, without gradients, under no carrier: count
 * 0. Fails: NOMEM. */
batten_status local_source_make(batten_context *ctx, const batten_solid *function, local_source *out);
void local_source_free(batten_context *ctx, local_source *s);

/* The linear part. most: the largest |x|, |y| at which F will be looked at. */
local_field local_begin(const local_source *s, const local_square *square, double most);
/* The same over a quarter of the square, right if c & 1, upper if c & 2. */
void local_part(const local_field *whole, unsigned c, local_field *out);
/* Centres near [count] that can be expanded over the square leaving out no more than `allowed` each are, the others
 * are left: returns their number. */
size_t local_take_far(const local_source *s, const local_square *square, double allowed, size_t count,
                      const uint32_t *near, uint32_t *left, local_field *f);
/* Bounds of F over the square: of what f holds and of the centres near [count]. */
interval local_bounds(const local_source *s, const local_square *square, const local_field *f, size_t count,
                      const uint32_t *near);

#endif
