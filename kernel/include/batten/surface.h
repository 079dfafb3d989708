/* Tensor-product B-spline surfaces (Bezier patches are those of one span), and what can be asked of them; the proof
 * of convexity, and of the signs of sections, among it.
 *
 *   x(u, v) = sum_i sum_j N_i(u) N_j(v) b_ij      (u, v) in [u_0, u_1] x [v_0, v_1]
 *
 * A place is (u, v) in the domain that the knots span. A span pair is a rectangle of the domain between neighbouring
 * different knots of both directions: there the surface is one polynomial. */
#ifndef BATTEN_SURFACE_H
#define BATTEN_SURFACE_H

#include <batten/mesh.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_surface batten_surface; /* never changes */

/* The point of a surface with its derivatives by the two parameters, normal and curvatures. */
typedef struct batten_surface_point {
  double point[3];
  double du[3], dv[3];           /* first derivatives */
  double duu[3], duv[3], dvv[3]; /* second */
  double normal[3];              /* unit, outward: along du x dv; 0 where that vanishes */
  double gauss, mean;            /* curvatures, mean > 0 where the surface bends away from the normal (spheres); NaN
                                    without a normal */
  double principal[2];           /* the larger first */
  double directions[2][3];       /* unit, in the tangent plane, for principal[0] and [1] */
} batten_surface_point;

/* ---- the surface -------------------------------------------------------------------------------- */

enum { BATTEN_SURFACE_DEGREE_MAX = 9 };

/* What it is made of. With n_i = knot_count[i] - degree[i] - 1 control points in direction i. */
typedef struct batten_surface_form {
  unsigned degree[2]; /* in u and v, 1 .. BATTEN_SURFACE_DEGREE_MAX */
  size_t knot_count[2];
  const double *knots[2];       /* [knot_count[i]] not decreasing; the first and the last degree + 1 are equal, inner
                                   ones at most degree[i] times (the surface is continuous) */
  const double *control_points; /* [n_0][n_1][3]: v runs faster */
} batten_surface_form;

/* Copies. Fails: INVALID (names the knot or control point; also where their extent is beyond a double), NOMEM,
 * TOO_LARGE. */
BATTEN_API batten_status batten_surface_create(batten_context *ctx, const batten_surface_form *form,
                                               batten_surface **out);
BATTEN_API void batten_surface_free(batten_surface *surface);
/* Its parts; the arrays are the surface's. */
BATTEN_API batten_surface_form batten_surface_get(const batten_surface *surface);

/* ---- evaluation --------------------------------------------------------------------------------- */

/* places [count][2] in the domain -> out [count]. At inner knots where a derivative jumps: from the right. On the
 * context's threads. Fails: INVALID (names the place). */
BATTEN_API batten_status batten_surface_evaluate(batten_context *ctx, const batten_surface *surface, size_t count,
                                                 const double *places, batten_surface_point *out);

/* The nearest places to points [count][3]: places [count][2], distances [count] (may be NULL), caller's unit: the
 * least distance to 1e-12 of the surface's size, by boxes over Bezier nets and Newton's method. BATTEN_W_ACCURACY:
 * where the surface degenerates and that took too long; the text names the point that is worst off. Progress phase
 * "closest". Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_surface_closest(batten_context *ctx, const batten_surface *surface, size_t count,
                                                const double *points, double *places, double *distances);

typedef struct batten_surface_tessellate_options {
  size_t struct_size;
  unsigned density; /* segments of every span in either direction, 1 .. 1024. Default 16. */
  double tolerance; /* > 0: so many segments in each direction that triangles stay within this distance of the
                       surface, caller's unit, but density at most. Default 0: density everywhere. */
} batten_surface_tessellate_options;
BATTEN_API batten_surface_tessellate_options batten_surface_tessellate_options_default(void);

/* A mesh of the surface, a regular grid whose cells are cut along the shorter diagonal, counter-clockwise seen from
 * the side of the normals; vertices of a side drawn together stay apart. Fields: "gauss", "mean", "normal" (3),
 * "place" (2), the first two NaN and the normal 0 where there is none. Fails: INVALID, NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_surface_tessellate(batten_context *ctx, const batten_surface *surface,
                                                   const batten_surface_tessellate_options *opt, batten_mesh **out);

/* ---- measures ----------------------------------------------------------------------------------- */

typedef struct batten_surface_measures {
  double area;
  double centroid[3];
  double lower[3], upper[3];   /* box, by subdivided control nets: to 1e-9 of its size */
  double gauss_min, gauss_max; /* over the whole surface, both sides of inner knots: grid, then descent from its best
                                  places. NaN, as are the places, where there is no normal anywhere */
  double gauss_min_at[2], gauss_max_at[2];
  double gauss_p01, gauss_p50, gauss_p99; /* quantiles by area */
  double gauss_integral;
  double mean_min, mean_max;
  double regularity_min; /* least |du x dv| over its mean; 0 of surfaces without area */
  double
      supporting_gap; /* over a grid of tangent planes and points: how far a point lies beyond a tangent plane on the
                         side to which the surface does not bend there, caller's unit: 0 of parts of convex bodies */
} batten_surface_measures;
/* By quadrature and sampling. Area, centroid and integral are exact to 1e-12 or so where the surface is regular;
 * quantiles are those of tens of thousands of samples. Time: tens of milliseconds and more with many spans. Progress
 * phase "measure". Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_surface_measure(batten_context *ctx, const batten_surface *surface,
                                                batten_surface_measures *out);

/* ---- the proof of convexity --------------------------------------------------------------------- */

/* With L' = x_uu . (x_u x x_v), M' and N' likewise, K |x_u x x_v|^4 = L'N' - M'^2. On each span pair, subdivided as
 * need be, the Bernstein coefficients of this polynomial less margin |x_u x x_v|^4 must be positive by more than all
 * rounding errors together: then K > margin everywhere, the surface has a normal everywhere, and L' vanishes nowhere:
 * the sign of one value is that of all. Between span pairs of the same sign, along inner knots that are there as
 * often as the degree, the surface must turn to the side to which it bends, or have one tangent plane to rounding of
 * the control points; slack does not matter there. Knows nothing of how the surface was made. What lies far apart is
 * not judged (graph tells more). */
typedef struct batten_convexity_options {
  size_t struct_size;
  const signed char *signs; /* [span pairs in u][in v] what is to be shown: +1 normal curvatures have the sign of L' >
                               0 (bends towards the normal; functions: convex), -1 that of L' < 0 (functions:
                               concave), 0 nothing. NULL: one sign everywhere, whichever it is. Default NULL. */
  double slack; /* >= 0: what is shown is that no normal curvature is below -slack (above +slack where -1), in the
                   metric of the parameters: L' + slack, N' + slack take the place of L', N', in units of L'. For
                   functions of which nothing strict can be said, like cylinders. Default 0. */
  unsigned depth_max; /* bisections in each direction, 0 .. 30. Default 20. */
  size_t box_limit;   /* boxes at most, >= 1. Default 1000000. */
} batten_convexity_options;
BATTEN_API batten_convexity_options batten_convexity_options_default(void);

typedef struct batten_convexity {
  int certified;       /* non-zero: proven on every span pair of which it was asked, and between them */
  int flat;            /* non-zero: all control points lie in one plane to their rounding: convex, but not strictly:
                          certified is 0 (without slack) */
  int sign;            /* of L' when certified and one sign was asked for: +1, -1; else 0 */
  double margin_min;   /* K is proven to be larger everywhere (with slack: (L' + slack)(N' + slack) - M'^2 over |x_u x
                          x_v|^4 is), 1 / unit^2: at least nine tenths of the least K, unless depth_max or box_limit
                          ended the search (with slack it may be less). 0 when nothing was asked. When not certified:
                          the least K that was met, or 0 when all were positive */
  int creased;         /* non-zero: proven on all span pairs, but there is a crease near worst_at, along an inner
                          knot that is there as often as the degree, not shown to turn to the side to which the
                          surface bends */
  double worst_at[2];  /* where the least K was met; the crease */
  size_t boxes;        /* that were looked at */
  unsigned depth;      /* bisections of the smallest */
  size_t unproven;     /* boxes given up; the search ends with the first */
  int graph;           /* non-zero: one direction is proven to have a positive product with all normals (or a negative
                          one with all): the surface has no folds over the plane across it */
  double direction[3]; /* that direction, unit; 0 when not graph */
} batten_convexity;
/* Returns BATTEN_OK whether certified or not. Progress phase "certify". Fails: INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_surface_certify_convex(batten_context *ctx, const batten_surface *surface,
                                                       const batten_convexity_options *opt, batten_convexity *out);

/* ---- the proof that sections keep their sign ---------------------------------------------------- */

/* Of surfaces whose sections v = const are plane, in parallel planes. With n the planes' normal, a section bends to
 * the left where w = n . (x_u x x_uu) > 0; its curvature is w / |x_u|^3. On each span pair of which a sign is wanted,
 * subdivided as need be, the Bernstein coefficients of w must have it by more than all rounding errors together. At
 * an end of the span in u where both end sections have x_uu = 0 to the rounding of the control points (2^-50 of the
 * largest coordinate), and there alone, w may vanish and have the wrong sign by what that rounding explains. Knows
 * nothing of how the surface was made. */
typedef struct batten_sections_options {
  size_t struct_size;
  double normal[3];         /* of the planes, any length. Default (0, 0, 1). */
  const signed char *signs; /* [span pairs in u][in v] wanted: +1, -1; 0 nothing. NULL: where both end sections of a
                               span pair (at its least and its largest v) are proven to have one and the same sign on
                               the closed span, but at ends where both have x_uu = 0 to rounding, that sign; else
                               nothing, nor where only one of both has x_uu = 0 at an end. Default NULL. */
  unsigned depth_max;       /* bisections in each direction, 0 .. 30. Default 20. */
  size_t box_limit;         /* boxes at most for a span pair, >= 1. Default 100000. */
} batten_sections_options;
BATTEN_API batten_sections_options batten_sections_options_default(void);

typedef struct batten_sections {
  int certified;      /* non-zero: all wanted signs are proven */
  size_t pairs;       /* span pairs of which a sign was wanted */
  size_t pairs_free;  /* others */
  size_t violations;  /* where a wrong sign was met, or 0 and no flat point explains it */
  size_t unproven;    /* neither that nor proven: depth_max or box_limit ended the search */
  double margin_min;  /* of span pairs without flat points at their ends: with sigma the sign, sigma curvature >=
                         margin_min is proven, 1 / unit, at least nine tenths of the least there is; NaN when there are
                         none. Not certified: the least that was met, of all */
  double worst_at[2]; /* (u, v) where the least was met */
  size_t boxes;       /* that were looked at */
  unsigned depth;     /* bisections of the smallest */
} batten_sections;
/* verdicts: NULL, or [span pairs in u][in v]: 1 proven, 0 not wanted, -1 violated, -2 unproven. On the context's
 * threads, same bits for any number. Progress phase "certify". Returns BATTEN_OK whether certified or not. Fails:
 * INVALID (sections that are not plane: names the control point; signs), NOMEM, TOO_LARGE, CANCELLED. */
BATTEN_API batten_status batten_surface_certify_sections(batten_context *ctx, const batten_surface *surface,
                                                         const batten_sections_options *opt, batten_sections *out,
                                                         signed char *verdicts);

#ifdef __cplusplus
}
#endif
#endif
