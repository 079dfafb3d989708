/* Polynomials with bounds of their rounding errors, for the proof of convexity.
 *
 * certify_poly.c  products, raising, bisection       certify_jet.c  a surface's derivatives on a span pair
 * certify_box.c   proof that D > kappa V on a square  certify_direction.c  one direction against all normals
 * certify_crease.c  sides without a common tangent    certify.c  what they say together
 *
 * A polynomial is kept by its Bernstein coefficients f_kl on the unit square with an `error` that none of them is
 * further than from the exact one, and `most` that none exceeds in size. All bounds hold in any rounding mode. */
#ifndef BATTEN_SURFACE_CERTIFY_H
#define BATTEN_SURFACE_CERTIFY_H

#include <stdbool.h>

#include "basis/rounding.h"
#include "surface_inner.h"

/* Highest degrees in one variable: of the surface m = 9; of L' .. N' 3 m - 1, D 6 m - 4, V = |x_u x x_v|^4 8 m - 4.
 */
enum { CERTIFY_DEGREE = 8 * BATTEN_SURFACE_DEGREE_MAX - 4, CERTIFY_ORDER = CERTIFY_DEGREE + 1 };

typedef struct certify_poly {
  unsigned degree[2];
  double *c; /* [degree[0] + 1][degree[1] + 1]: f_kl, or "scaled" f_kl C(p, k) C(q, l) */
  double most, error;
} certify_poly;

static inline size_t certify_count(const certify_poly *p) { return (size_t)(p->degree[0] + 1) * (p->degree[1] + 1); }

/* row [n + 1] of Pascal's triangle; exact up to n = 56, beyond it off by (n - 56) CERTIFY_EPS at most. */
void certify_binomials(unsigned n, double *row);

/* From f_kl to scaled and back. */
void certify_scale(certify_poly *p);
void certify_unscale(certify_poly *p);

/* Scaled, of any content: zero, of this degree. */
void certify_clear(certify_poly *p, unsigned degree_u, unsigned degree_v);
/* out += sign a b, scaled, out one of `products` such sums. The degrees of out are those of a and b together. */
void certify_add_product(certify_poly *out, double sign, const certify_poly *a, const certify_poly *b,
                         unsigned products);
/* To be called when the products are summed: sets out->most. */
void certify_summed(certify_poly *out);
/* a + constant, scaled. */
void certify_add_constant(certify_poly *a, double constant);
/* out = a of a higher degree, scaled; work [out rows][a columns]. */
void certify_raise(const certify_poly *a, unsigned degree_u, unsigned degree_v, double *work, certify_poly *out);
/* Value at (u, v) in [0, 1]^2, without a bound. */
double certify_value(const certify_poly *p, bool scaled, double u, double v);

/* `polys` coefficient arrays [rows][columns] behind each other, not scaled, are bisected: c becomes the lower half in
 * the direction axis, upper the other; work is of the same size. An error grows by degree CERTIFY_EPS most. */
void certify_bisect(unsigned axis, size_t polys, size_t rows, size_t columns, double *c, double *upper, double *work);

/* ---- derivatives --------------------------------------------------------------------------------- */

enum { CERTIFY_U, CERTIFY_V, CERTIFY_UU, CERTIFY_UV, CERTIFY_VV, CERTIFY_DERIVATIVES };

/* Derivatives on a span pair by parameters in [0, 1], scaled, of points multiplied by `unit`; u and v are then
 * multiplied by powers of two, factor, so that x_u and x_v are of size 1. Degrees below 2 are raised to 2. */
typedef struct certify_jet {
  unsigned degree[2];
  certify_poly part[CERTIFY_DERIVATIVES][3];
  double factor[2]; /* d/d(domain's parameter) = factor d/d(parameter of the jet) */
} certify_jet;

enum {
  CERTIFY_NET = (BATTEN_SURFACE_DEGREE_MAX + 1) * (BATTEN_SURFACE_DEGREE_MAX + 1),
  CERTIFY_JET_DOUBLES = (CERTIFY_DERIVATIVES + 2) * 3 * CERTIFY_NET /* two nets to work in */
};

/* room [CERTIFY_JET_DOUBLES]; data_error: what the control points themselves are taken to be off by, 0 but at
 * creases. */
void certify_jet_make(const batten_surface *surface, size_t mu, size_t nu, double unit, double data_error,
                      double *room, certify_jet *out);

/* u x v, scaled. */
void certify_cross(const certify_poly u[3], const certify_poly v[3], certify_poly cross[3]);

/* ---- boxes --------------------------------------------------------------------------------------- */

/* What is proven over the parts of a surface, one after the other: D > kappa V with kappa = CERTIFY_SHARE of the
 * least D / V that was met. It falls while the proof goes on; what was proven before holds all the more. */
typedef struct certify_proof {
  unsigned depth_max;
  size_t box_limit;
  double least, least_at[2]; /* of D / V, and where, in the domain */
  double bound;              /* least bound of boxes for which the share could not be had, INFINITY */
  size_t boxes, unproven;
  unsigned depth;
  double progress[2]; /* part done before this span pair, and with it */
} certify_proof;

static const double CERTIFY_SHARE = 0.91;

/* A part of the square that is not proven yet. */
typedef struct certify_box {
  double *c;                /* D and V */
  double error[2], most[2]; /* of both */
  double lower[2], upper[2];
  unsigned depth[2], axis; /* axis: which to bisect */
  double least;            /* coefficient of D - kappa V */
  double bound;            /* below D / V by D and V apart */
} certify_box;

/* The square [lower, upper] of the domain, D and V behind each other in slots[0], of the same degrees, not scaled. */
typedef struct certify_square {
  double lower[2], upper[2];
  unsigned degree[2];
  double error[2];
  double *slots, *work; /* slots [2 depth_max + 2][2][coefficients], work [2][coefficients] */
  certify_box *stack;   /* [2 depth_max + 2] */
} certify_square;

/* Looks at D / V at the corners and at a grid within. */
void certify_sample(certify_proof *proof, const certify_square *square);
/* Proves, or leaves proof->unproven > 0: then it stops. Fails: CANCELLED. */
batten_status certify_prove(batten_context *ctx, certify_proof *proof, const certify_square *square);

/* ---- creases -------------------------------------------------------------------------------------- */

/* First derivatives on a side of a span pair, as polynomials along it; do not copy it. */
typedef struct certify_edge {
  certify_poly across[3], along[3];
  double c[6][BATTEN_SURFACE_DEGREE_MAX + 1];
} certify_edge;

/* The side at the lower or upper end in direction axis. */
void certify_edge_make(const certify_jet *jet, int axis, bool upper, certify_edge *out);

/* True when the surface turns from the one to the other side of a knot in direction axis, less than half a turn, to
 * where normal curvatures have the sign, or not beyond the errors of the jets. room [CERTIFY_FACES_DOUBLES]; at:
 * where along the side (0 .. 1) it was not. */
bool certify_crease(const certify_edge *before, const certify_edge *after, int axis, int sign, double *room,
                    double *at);

/* ---- one direction -------------------------------------------------------------------------------- */

/* A direction with positive products with all of `count` unit normals [count][3]; false when none was found. */
bool certify_direction(size_t count, const double (*normals)[3], double direction[3]);
enum {
  CERTIFY_CROSS = 4 * BATTEN_SURFACE_DEGREE_MAX * BATTEN_SURFACE_DEGREE_MAX, /* coefficients of x_u x x_v */
  CERTIFY_FACES_DOUBLES = 26 * CERTIFY_CROSS
};
/* True when direction has a positive product with x_u x x_v on all of the span pair. room [CERTIFY_FACES_DOUBLES]. */
bool certify_faces(const certify_poly cross[3], const double direction[3], double *room);

#endif
