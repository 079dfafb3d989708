/* Between shape.c, shape_places.c and shape_bend.c. */
#ifndef BATTEN_LOFT_SHAPE_INNER_H
#define BATTEN_LOFT_SHAPE_INNER_H

#include "contours_inner.h"

typedef enum shape_kind {
  SHAPE_FLAT,     /* x'' = 0, on both sides */
  SHAPE_JUMP,     /* x'' jumps there from one side of the tangent to the other: a knot degree - 1 fold */
  SHAPE_STRAIGHT, /* an inflection in the middle of a straight piece, whose ends are flat points or such knots */
  SHAPE_BENT      /* an inflection at which x'' is not 0: neither */
} shape_kind;

/* A place of a contour where the curvature vanishes or changes its sign. */
typedef struct shape_place {
  double t;
  shape_kind kind;
  bool inflection;
  double from, to;   /* of a straight piece; of the zone around a bent inflection, beyond [0, 1] too */
  int before, after; /* signs beside it, 0 beyond the ends of open ones, and of straight pieces */
  bool partner[2];   /* in the contour below, above */
} shape_place;

/* Those of a contour, ascending; of closed ones in [0, 1). */
typedef struct shape_places {
  size_t count, room;
  shape_place *at;
} shape_places;

/* The contour as a curve over [0, 1]. Fails: NOMEM, TOO_LARGE. */
batten_status shape_curve(batten_context *ctx, const loft_contour *c, batten_curve **out);
/* Fails: NOMEM. */
batten_status shape_places_find(batten_context *ctx, const loft_contour *c, const batten_curve *curve,
                                shape_places *out);

/* Knots to be inserted, ascending. */
typedef struct shape_knots {
  size_t count, room;
  double *knots;
  unsigned *folds;
} shape_knots;
batten_status shape_knots_add(batten_context *ctx, shape_knots *list, double t, unsigned fold);
void shape_knots_free(batten_context *ctx, shape_knots *list);

/* x'' at t, on the span where t is or ends, is 0 to rounding. */
bool shape_is_flat(const loft_contour *c, size_t span, double t);
/* The sign of the curvature between a and b, part of a period apart, taken where it is largest; 0 if straight. */
int shape_sign(const loft_contour *c, double a, double b);
/* The span with breaks[s] <= t < breaks[s + 1], the last one at 1. t in [0, 1]. */
size_t shape_span(const loft_space *s, double t);
/* t of closed ones to [0, 1). */
double shape_wrap(const loft_space *s, double t);
/* Break i; of closed ones any i. */
double shape_break(const loft_space *s, ptrdiff_t i);

/* Inserts knots until the polygon of contour i bends as the curve does. Fails: NOMEM, TOO_LARGE. */
batten_status shape_bend(batten_context *ctx, loft_stack *s, size_t i, const shape_places *places);

#endif
