/* Triangular Bezier patches as the quadrangular ones of CAD files, and their edges: all exact but for rounding. */
#ifndef BATTEN_EXCHANGE_PATCH_SQUARE_H
#define BATTEN_EXCHANGE_PATCH_SQUARE_H

#include <batten/exchange.h>

enum {
  BX_DEGREE_MAX = 12,
  BX_NET_MAX = (BX_DEGREE_MAX + 1) * (BX_DEGREE_MAX + 2) / 2,
  BX_SQUARE_MAX = (BX_DEGREE_MAX + 1) * (BX_DEGREE_MAX + 1)
};

/* Where the corners (s, t) = (0, 0), (1, 0), (0, 1), (1, 1) of a square lie on the triangle: barycentric, sums 1. */
typedef double bx_corners[4][3];

/* The squares of a form: 1, or 3 for QUADS, where square q is the one at the patch's corner q. Side s of a square
 * runs from its loop's corner s to the next. */
unsigned bx_squares_of(batten_cad_form form);
void bx_corners_of(batten_cad_form form, unsigned square, bx_corners out);

/* Work space of bx_patch_square. */
typedef struct bx_square_work {
  double nets[4][BX_NET_MAX][3];
} bx_square_work;

/* Control points [(n + 1)][(n + 1)][3] of S(s, t) = patch at the bilinear mean of the corners: degree n in s (first
 * index) and t. */
void bx_patch_square(bx_square_work *work, unsigned n, const double *net, const bx_corners corners, double *out);

/* Knots of Bezier curves and patches in [0, 1]: knots [2 n + 2]. Returns how many they are. */
size_t bx_bezier_knots(unsigned n, double knots[2 * BX_DEGREE_MAX + 2]);
/* What bx_patch_square gave as the surface that it is; the arrays stay the caller's. */
batten_surface_form bx_square_form(unsigned n, const double *points, double knots[2 * BX_DEGREE_MAX + 2]);

/* Control points [n + 1] of the side from corner k to corner k + 1 of the triangle. */
void bx_patch_side(unsigned n, const double *net, unsigned k, double (*out)[3]);

/* Lowers the degree of a curve in place as far as that moves no control point (raised again) by more than tolerance;
 * returns the degree, at least 1. */
unsigned bx_curve_reduce(unsigned n, double (*points)[3], double tolerance);

void bx_curve_reverse(unsigned n, double (*points)[3]);
void bx_curve_at(unsigned n, const double (*points)[3], double t, double out[3]);
/* Halves of a curve: both [n + 1]; right may be points. */
void bx_curve_halve(unsigned n, const double (*points)[3], double (*left)[3], double (*right)[3]);

/* Point of a patch at barycentric place (1 - u - v, u, v). */
void bx_patch_at(bx_square_work *work, unsigned n, const double *net, double u, double v, double out[3]);

#endif
