/* What a surface is made of, for kernel/surface and kernel/convex.
 *
 * surface.c    create, free, parts         evaluate.c   points, normals, curvatures
 * patches.c    span pairs as Bezier nets   tessellate.c meshes
 * closest.c    nearest places              measure.c    area, quantiles, tangent planes; extremes.c, box.c
 * certify*.c   the proofs of convexity and of the signs of sections: include nothing of kernel/convex, kernel/loft and
 * not the blossoms of basis/bspline.c, with which their inequalities are made
 */
#ifndef BATTEN_SURFACE_INNER_H
#define BATTEN_SURFACE_INNER_H

#include <batten/surface.h>
#include <stdbool.h>

#include "basis/bspline.h"

struct batten_surface {
  batten_context *ctx;
  bspline space[2];       /* their knots are in the surface's one block */
  double *control_points; /* [space[0].count][space[1].count][3] */
  int exponent;           /* 2^exponent brings the largest side of the control points' box to [1, 2) */
};

/* ---- evaluate.c ---------------------------------------------------------------------------------- */

/* S, S_u, S_v, S_uu, S_uv, S_vv at a place of the domain: jet [6][3]. */
void surface_jet(const batten_surface *surface, const double place[2], double (*jet)[3]);

/* What one parameter has to say of a place: of it and a whole grid line of places the same. Derivatives are those by
 * t' = 2^exponent t, in which the span is about 1 long, so that neither tiny nor huge domains overflow. */
typedef struct surface_basis {
  size_t first; /* control point of the first entry */
  int exponent;
  double value[BSPLINE_ORDER]; /* of control points first .. first + degree */
  /* First and second derivatives as combinations of the differences b_(i + 1) - b_i of these control points. */
  double slope[BSPLINE_DEGREE], bend[BSPLINE_DEGREE];
} surface_basis;

/* t on the closed span mu; at its ends derivatives are those from within. */
void surface_basis_make(const bspline *space, size_t mu, double t, surface_basis *out);
/* jet [6][3]: the point, and the derivatives by u' and v' of the surface times 2^surface->exponent: curvatures of
 * this jet are those of the surface over that factor. */
void surface_jet_scaled(const batten_surface *surface, const surface_basis *u, const surface_basis *v,
                        double (*jet)[3]);
/* The same of the control points that count, `row` their first; rows along v are `stride` numbers apart. Derivatives
 * are times unit. */
void surface_net_jet(unsigned p, unsigned q, size_t stride, const double *row, double unit, const surface_basis *u,
                     const surface_basis *v, double (*jet)[3]);
void surface_point_make(const batten_surface *surface, const surface_basis *u, const surface_basis *v,
                        batten_surface_point *out);

/* The parameter at a part (0 .. 1) of span mu: within it, its ends exactly. */
static inline double surface_span_at(const bspline *space, size_t mu, double part) {
  double from = space->knots[mu], to = space->knots[mu + 1], t = (1 - part) * from + part * to;
  return t < from ? from : t > to ? to : t;
}

/* ---- patches.c ----------------------------------------------------------------------------------- */

/* The spans of one direction. */
typedef struct surface_axis {
  unsigned degree;
  size_t count; /* of spans */
  size_t *span; /* [count] mu */
  double *rows; /* [count][degree + 1][degree + 1] Bezier points from control points */
} surface_axis;

/* Fails: NOMEM; free it in any case, zeroed before. */
batten_status surface_axis_make(batten_context *ctx, const bspline *space, surface_axis *out);
void surface_axis_free(batten_context *ctx, surface_axis *axis);

/* The Bezier net [degree 0 + 1][degree 1 + 1][3] of span pair (i, j), 2^exponent (b - origin). */
void surface_patch_net(const batten_surface *surface, const surface_axis axis[2], size_t i, size_t j,
                       const double origin[3], int exponent, double (*net)[3]);
/* The halves of a net [p + 1][q + 1][dim] by u, or by v; left holds the whole at first. */
void surface_net_halve(unsigned p, unsigned q, unsigned dim, bool by_u, double *left, double *right);
/* True when neighbours in u differ by more than those in v. */
bool surface_net_longer_in_u(unsigned p, unsigned q, unsigned dim, const double *net);

/* ---- extremes.c, box.c: for measure.c ------------------------------------------------------------ */

/* What extremes are looked for; the last is the least |du x dv| by parameters in which the domain is 1 x 1, in the
 * scaled unit. */
enum { SURFACE_GAUSS_MIN, SURFACE_GAUSS_MAX, SURFACE_MEAN_MIN, SURFACE_MEAN_MAX, SURFACE_AREA_MIN, SURFACE_EXTREMES };
typedef struct surface_extreme {
  double value, at[2]; /* of the scaled surface; NaN where there is no normal anywhere */
} surface_extreme;
/* Progress phase "measure", `from` to `to`. Fails: NOMEM, CANCELLED. */
batten_status surface_find_extremes(batten_context *ctx, const batten_surface *surface, const surface_axis axis[2],
                                    double from, double to, surface_extreme out[SURFACE_EXTREMES]);

/* Least and largest Gaussian curvature, caller's unit: those of batten_surface_measure, without the rest of it. */
batten_status surface_gauss_range(batten_context *ctx, const batten_surface *surface, double range[2]);

/* A box that holds the surface, larger than the least one by 1e-9 of its size at most, where that can be had. Fails:
 * NOMEM. */
batten_status surface_find_box(batten_context *ctx, const batten_surface *surface, const surface_axis axis[2],
                               double lower[3], double upper[3]);

#endif
