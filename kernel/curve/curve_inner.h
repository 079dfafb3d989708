/* What a curve is made of, for kernel/curve and kernel/contour.
 *
 * curve.c      create, free, parts              refine.c    knots, degree, parts, reversal, transformation
 * evaluate.c   points, derivatives, curvature   length.c    arc length and its inverse, samples
 * piece.c      spans alone, integrals over them closest.c   nearest parameters
 * measure.c    area, centroid, turn, energy     extremes.c  box, curvature
 * bend.c       x' and [x', x''] with error bounds inflections.c  changes of sign
 * crossings.c  where a curve crosses or touches itself
 * certify*.c   the proof of shape: like bend.c includes nothing of kernel/contour and not the blossoms of
 *              basis/bspline.c, with which its inequalities are made
 */
#ifndef BATTEN_CURVE_INNER_H
#define BATTEN_CURVE_INNER_H

#include <batten/curve.h>
#include <stdbool.h>

#include "basis/bspline.h"

struct batten_curve {
  batten_context *ctx;
  bspline space;          /* its knots are in the curve's one block */
  double *control_points; /* [space.count][2] */
  int exponent;           /* 2^exponent brings the larger side of the control points' box to [1, 2) */
  bool closed;
};

/* A curve that takes over nothing: copies knots and points without the checks of batten_curve_create. Fails: NOMEM,
 * TOO_LARGE. */
batten_status curve_make(batten_context *ctx, const bspline *space, const double *points, bool closed,
                         batten_curve **out);

/* The box of points [count][2], count > 0. */
void curve_points_box(size_t count, const double *points, double lower[2], double upper[2]);

/* x, x', x'' at t on span mu (at its ends from within): jet [order + 1][2]. points [count][2]. */
void curve_jet(const bspline *space, const double *points, size_t mu, double t, unsigned order, double (*jet)[2]);

/* The same with derivatives by 2^e t of 2^curve->exponent times the curve (not its point), so that the span is about
 * 1 long. Returns e. */
int curve_jet_scaled(const batten_curve *curve, size_t mu, double t, unsigned order, double (*jet)[2]);
/* Of its x': the length, 0 with tangent 0 where it is below rounding. exponent: that e. */
double curve_tangent(const batten_curve *curve, size_t mu, int exponent, const double first[2], double tangent[2]);
/* The curvature there, in the scaled unit. */
double curve_curvature(const double tangent[2], double speed, const double second[2]);

/* t in the domain: of closed curves by whole periods. */
double curve_wrap(const batten_curve *curve, double t);

/* Whether t is a parameter of the curve; errors name it so, with [index] unless that is SIZE_MAX. Fails: INVALID. */
batten_status curve_check_parameter(batten_context *ctx, const batten_curve *curve, const char *name, size_t index,
                                    double t);

/* ---- piece.c ------------------------------------------------------------------------------------- */

/* A span by itself, by the part u of it, in the scaled unit: Bezier points of x - middle, x', x''. */
typedef struct curve_piece {
  unsigned degree;
  double point[BSPLINE_ORDER][2], first[BSPLINE_ORDER][2], second[BSPLINE_ORDER][2]; /* [degree + 1 - k] */
} curve_piece;
void curve_piece_make(const batten_curve *curve, size_t mu, const double middle[2], curve_piece *out);
/* The middle of the control points' box. */
void curve_find_middle(const batten_curve *curve, double middle[2]);
/* The parameter at part u of span mu: within it, its ends exactly. */
double curve_span_at(const bspline *space, size_t mu, double u);
/* The part of span mu at which t is. */
double curve_span_part(const bspline *space, size_t mu, double t);
/* Bezier points [degree + 1][2] at u. */
void curve_net_at(unsigned degree, const double (*net)[2], double u, double out[2]);
/* Bernstein coefficients c [n + 1][dim] become those over [from, to], 0 <= from < to: towards one end of the whole,
 * and of that towards the other end. */
void curve_restrict(unsigned n, unsigned dim, double from, double to, double *c);
/* Whether Bezier points [n + 1][2] of x' tell that it comes nowhere near 0. */
bool curve_is_steady(unsigned n, const double (*net)[2]);

/* What is integrated by u: the first number is the speed |x'|, all [CURVE_INTEGRALS]. */
enum { CURVE_INTEGRALS = 3, CURVE_DEPTH = 44 };
typedef void curve_integrand(const curve_piece *piece, double u, double *out);
/* Speed alone; others are 0. */
void curve_speed(const curve_piece *piece, double u, double *out);
double curve_gauss_speed(const curve_piece *piece, double from, double to);

/* Walks over [from, to] in parts on which the rule of Gauss and Legendre has the integrals to 1e-13 of the length or,
 * where that is more, of themselves: over the halves of a part they are the same as over the whole, and x' is nowhere
 * near 0. Parts that contain a cusp become so short that they do not count. */
typedef struct curve_walk {
  const curve_piece *piece;
  curve_integrand *integrand;
  double most;     /* bound of |x'| on the whole piece */
  unsigned leaves; /* so far */
  unsigned height;
  struct {
    double from, to, whole[CURVE_INTEGRALS];
  } stack[CURVE_DEPTH + 1];
} curve_walk;
void curve_walk_start(curve_walk *walk, const curve_piece *piece, curve_integrand *integrand, double from, double to);
/* The next part and the integrals over it; false after the last. */
bool curve_walk_next(curve_walk *walk, double *from, double *to, double integrals[CURVE_INTEGRALS]);

/* Adds without the rounding of long sums: the sum is total + rest. */
typedef struct curve_sum {
  double total, rest;
} curve_sum;
static inline void curve_sum_add(curve_sum *s, double x) {
  double total = s->total + x, part = total - s->total;
  s->rest += (s->total - (total - part)) + (x - part);
  s->total = total;
}
static inline double curve_sum_get(const curve_sum *s) { return s->total + s->rest; }

/* The length of the whole curve in the scaled unit. */
double curve_whole_length(const batten_curve *curve);

/* ---- extremes.c: for measure.c ------------------------------------------------------------------- */

void curve_find_box(const batten_curve *curve, double lower[2], double upper[2]);

/* Least and largest curvature and the parameters, caller's unit; NaN without a tangent anywhere. */
void curve_find_curvatures(const batten_curve *curve, double value[2], double at[2]);

#endif
