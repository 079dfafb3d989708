/* The proof of shape: what its two files say to each other.
 *
 * bend.c           x' and [x', x''] of a span with bounds of errors
 * certify_prove.c  the sign on one stretch
 * certify.c        stretches, knots and corners, the verdict
 *
 * Includes nothing of kernel/contour and not the blossoms of basis/bspline.c. */
#ifndef BATTEN_CURVE_CERTIFY_H
#define BATTEN_CURVE_CERTIFY_H

#include "bend.h"

/* A part of a stretch that is not proven yet: f and x' in Bernstein form (f in the place of g). */
typedef struct certify_piece {
  bend b;
  double lower, width; /* in the stretch's parameter */
  unsigned depth;
} certify_piece;

/* What is proven over the stretches, one after the other, in curvatures of the curve times 2^curve->exponent. */
typedef struct certify_proof {
  unsigned depth_max;
  certify_piece *stack; /* [depth_max + 2] */
  double least;         /* of what was met */
  double least_at;      /* where, in the domain */
  double target;        /* the least of what could be proven of the places that were met */
  double bound;         /* proven everywhere so far */
  bool failed;          /* then stretches are only looked at */
  double error;         /* of inflections, in parameters: the largest so far */
  size_t pieces;
  unsigned depth;
} certify_proof;

/* A part of a span on which the curvature is to be positive. */
typedef struct certify_stretch {
  bend b;          /* the sign in g */
  double from, to; /* parameters at s = 0 and 1: to < from where b was reversed */
  double share;    /* of the span's length */
  bool zero;       /* g vanishes at s = 0, or nearly: */
  double allowed;  /* by so much g may be wrong there, */
  double slack;    /* or by what moves its zero by so much of the span */
  double offset;   /* that the zero's wanted parameter is away from s = 0, in parameters */
} certify_stretch;

/* Proves it, or leaves proof->failed. Consumes the stretch. */
void curve_prove(certify_proof *proof, certify_stretch *stretch);

#endif
