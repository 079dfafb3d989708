/* Convex surfaces from scattered data, by quadratic programming.
 *   [Juettler: Convex surface fitting with parametric Bezier surfaces, 1998]
 *   [Juettler: Surface fitting using convex tensor-product splines, 1997]
 *
 * A parametric tensor-product patch, or several that join smoothly (a B-spline surface), is fitted to points by least
 * squares such that its Gaussian curvature is positive everywhere. A reference surface of the wanted shape yields
 * linear inequalities for the control points that are sufficient; the fit is a quadratic program; its result, blended
 * with the reference, is the next reference. Whether the result is convex is then proven by
 * batten_surface_certify_convex, which knows nothing of the inequalities.
 *
 * Functions z = f(x, y) need no reference: there the inequalities fill the set of all convex splines as they become
 * more. */
#ifndef BATTEN_CONVEX_H
#define BATTEN_CONVEX_H

#include <batten/surface.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- parameters of scattered points ------------------------------------------------------------- */

typedef enum batten_parametrization {
  BATTEN_PARAMETERS_AUTO = 0, /* PROJECT, unless the triangles are steep: more than 5 % of the points tilted by more
                                 than 65 degrees against the best plane; then FLOATER */
  BATTEN_PARAMETERS_PROJECT,  /* into the best plane, in the least rectangle there */
  BATTEN_PARAMETERS_FLOATER   /* shape-preserving [Floater 1997]: the boundary of a triangulation goes to the boundary
                                 of the square by chord length, its corners to four of its vertices, and every inner
                                 vertex is a convex combination of its neighbours. Without triangles: those of Delaunay
                                 in the best plane, less those at the rim that are flat to rounding, and those that fill
                                 gaps more than 4 times as wide and deep as the points' usual distances there; points
                                 at one place in the plane get the same parameters. */
} batten_parametrization;

typedef struct batten_parametrize_options {
  size_t struct_size;
  batten_parametrization method; /* default AUTO */
  size_t triangle_count;         /* of a triangulation of the points: a disc; every point in it */
  const uint32_t *triangles;     /* [triangle_count][3] */
  const uint32_t *corners; /* [4] boundary points, counter-clockwise, that go to (0,0), (1,0), (1,1), (0,1); NULL =
                              those where the boundary turns most as seen over 1/16 of its length to both sides, with
                              a small premium on even sides (a boundary of three points: to (0,0), (1,0), (0,1)).
                              FLOATER. Default NULL. */
} batten_parametrize_options;
BATTEN_API batten_parametrize_options batten_parametrize_options_default(void);

/* points [count][3] -> parameters [count][2] in [0, 1]^2. The same for points that are moved, turned (up to which
 * side is which) or scaled; PROJECT: same bits for any order of the points and for scaling by a power of two. u x v
 * runs counter-clockwise about the plane's normal, whose largest coordinate is positive (FLOATER with triangles:
 * about theirs); u is the side that points most along the coordinate axis which follows that largest one (x after z).
 * FLOATER folds no triangle, where edges through the inside with both ends on one side of the square count as bent in
 * their middle (straight they would lie on that side, and an ear there has no area); it reproduces points of a plane
 * in a rectangle but for its scale; points in a plane within another outline are bent to the square. Cost:
 * O(n log n); FLOATER solves a sparse system of n unknowns directly, O(n^1.5). BATTEN_W_ACCURACY: done, but triangles
 * vanish to the rounding of parameters (a nearly closed surface); the text says where. Progress phase "parameters".
 * Fails: INVALID (points on a line; triangles that are no disc, named), NOMEM, TOO_LARGE, CANCELLED. */
BATTEN_API batten_status batten_parametrize(batten_context *ctx, size_t count, const double *points,
                                            const batten_parametrize_options *opt, double *parameters);

/* ---- parametric surfaces ------------------------------------------------------------------------ */

typedef struct batten_convex_options {
  size_t struct_size;
  unsigned degree[2];     /* 2 .. 7. Default 3, 3. */
  unsigned spans[2];      /* of equal length, 1 .. 16: 1, 1 is one Bezier patch. Default 1, 1. */
  unsigned smoothness[2]; /* continuous derivatives at inner knots, 1 .. degree - 1; 0 = degree - 1. Default 0. */

  const double *parameters; /* [count][2], NULL = by parametrize. Default NULL. */
  double domain[2][2];      /* of the parameters: {{u_0, u_1}, {v_0, v_1}}, u_0 < u_1, and of the surface. Default
                               {{0, 1}, {0, 1}}. All NaN: their bounding box. */
  batten_parametrize_options parametrize;
  const double *weights; /* [count] >= 0, NULL = ones */

  unsigned rounds;   /* of inequalities, quadratic program and parameter correction, 1 .. 100. Default 10. */
  double rounds_tol; /* >= 0. A round that lowers the sum of squares by a smaller part divides the blend by 3; when
                        that has happened three times, the next such round is the last. Default 1e-3. */
  unsigned
      correction_passes; /* of parameter correction (nearest places) in each round, 0 = parameters stay. Default 3. */
  double tension;        /* weight of the integral of |x_uuu|^2 + |x_vvv|^2 + |x_uv|^2 beside the mean square
                            distance [eq. 3; there beside the sum], domain [0, 1]^2, >= 0. What keeps places without
                            data calm. Default 1e-6. */

  /* The inequalities. */
  double blend;        /* part of the old reference in the new one, (0, 1). Default 0.1. */
  double margin;       /* every inequality holds by this part of what the reference has, (0, 1): K > 0. Default
                          1e-3. */
  unsigned directions; /* of the quadratic form, 3 .. 16. Default 4. */
  double row_share;    /* a box is accepted where the reference has this part of the best value, (0, 1). Default
                          0.15. */
  unsigned depth_max;  /* bisections of span pairs, 0 .. 10. Default 6. */
  size_t row_limit;    /* most inequalities, >= 1. Default 500000. */
} batten_convex_options;
BATTEN_API batten_convex_options batten_convex_options_default(void);

enum { BATTEN_CONVEX_ROUNDS_MAX = 100 };

typedef struct batten_convex_info {
  size_t unknowns;                /* three a control point */
  double lsq_unconstrained;       /* weighted sums of squares, caller's unit^2: without inequalities, same rounds of
                                     parameter correction and one more from the result's parameters, least over
                                     them */
  double lsq_unconstrained_first; /* the same at the first parameters */
  double lsq_reference;           /* first reference surface, first parameters; NaN: none was found */
  double lsq;                     /* of the result */
  double rms, max_error;          /* of the result: distances of points from their places */
  size_t max_error_index;         /* that point */
  double tension_weight;  /* of the first reference: the paper's w, beside the sum. INFINITY: its limit, or, where that
                             bends both ways too, a plane that is bent a little. NaN: none was found. */
  unsigned tension_steps; /* doublings and halvings */
  unsigned rounds;        /* that were run; 0 where no reference was found, or the points are a plane's */
  unsigned round_best;    /* that gave the result, 0 = the reference already */
  size_t rows_per_round[BATTEN_CONVEX_ROUNDS_MAX]; /* inequalities */
  size_t boxes_per_round[BATTEN_CONVEX_ROUNDS_MAX];
  double lsq_per_round[BATTEN_CONVEX_ROUNDS_MAX]; /* after parameter correction; never rises */
  size_t rows_active;                             /* of the last quadratic program */
  int plane;                   /* non-zero: no convex surface near the points was found, the result is the best
                                  plane; where rounds were run, figures a round are of what they led to */
  double misfit; /* how far the data bend inwards: of three neighbouring parts of them in a row the middle one's mean
                    lies inside the chord of the others by so many standard deviations of noise; the largest there
                    is. 0 of fewer points than show it; NaN: no rounds. See BATTEN_W_SHAPE */
  double gauss_min, gauss_max; /* of the result */
  double gauss_min_unconstrained, gauss_max_unconstrained;
  batten_convexity convexity; /* of the result */
  double time_parameters_s, time_reference_s, time_rows_s, time_qp_s, time_correction_s, time_check_s;
} batten_convex_info;

/* Fits a convex surface to points [count][3], any unit, count >= 6.
 *   unconstrained  NULL, or a new surface: the fit without inequalities, for comparison
 *   info           NULL, or the figures
 * Progress phases: "parameters", "reference", "quadratic program", "fit", "certify", "measure".
 * BATTEN_OK          fitted, and proven strictly convex (info->convexity.certified)
 * BATTEN_W_SHAPE     done, but the data have another shape: no convex surface near them was found (of row_limit
 *                    inequalities, where the text says so), and the result is the best plane (info->plane); or the
 *                    result is proven convex, but the data bend inwards by 6 standard deviations of their noise
 *                    (info->misfit): a dent; or they are three times as far from it as their noise explains, which
 *                    the unconstrained fit tells of more than 1.5 points a control point. The text says where and by
 *                    how much.
 * BATTEN_W_ACCURACY  not proven; the text says where
 * Without `parameters` a domain that is all NaN is [0, 1]^2. Same bits for any number of threads, and for points
 * scaled by a power of two; sums and curvatures out of the range of doubles are then INFINITY or 0. Bytes: some
 * 40 n^2, n control points, and the inequalities.
 * Fails: INVALID (points on a line, all parameters equal, parameters outside the domain, named), NOMEM, TOO_LARGE,
 * SINGULAR (the parameters lie on a conic of parallel axes, or without tension do not determine the control points),
 * CANCELLED. */
BATTEN_API batten_status batten_convex_fit(batten_context *ctx, size_t count, const double *points,
                                           const batten_convex_options *opt, batten_surface **out,
                                           batten_surface **unconstrained, batten_convex_info *info);

/* ---- functions ---------------------------------------------------------------------------------- */

typedef struct batten_convex_function_options {
  size_t struct_size;
  unsigned degree[2];       /* 2 .. 7. Default 3, 3. */
  unsigned spans[2];        /* 1 .. 64. Default 4, 4. */
  unsigned smoothness[2];   /* 1 .. degree - 1; 0 = degree - 1. Default 0. */
  double domain[2][2];      /* {{x_0, x_1}, {y_0, y_1}}. All NaN (default): the points' bounding box. */
  size_t break_count[2];    /* inner breaks of the spans, in place of equal spans; 0 = equal */
  const double *breaks[2];  /* [break_count[i]] ascending, inside the domain */
  const signed char *signs; /* [spans in x][in y] +1 convex, -1 concave, 0 free; NULL = all +1. Default NULL. */
  const double *weights;    /* [count] >= 0, NULL = ones */
  double tension;  /* weight of the integral of f_xx^2 + 2 f_xy^2 + f_yy^2 beside the mean square, domain scaled
                      to [0, 1]^2, >= 0. Default 1e-8. */
  double gap_tol;  /* refine the inequalities until the objective is within this part of its lower
                      bound, > 0. Default 1e-3. */
  unsigned rounds; /* of refinement at most, 1 .. 20; fewer once two of them closed less than a tenth of the gap each.
                      Default 10. */
} batten_convex_function_options;
BATTEN_API batten_convex_function_options batten_convex_function_options_default(void);

typedef struct batten_convex_function_info {
  size_t unknowns;
  double lsq_unconstrained;
  double lsq;                        /* of the result */
  double lsq_lower;                  /* no spline of this space with the signs has less: from necessary conditions */
  double objective, objective_lower; /* the same with tension: what is minimised */
  double rms, max_error;
  size_t max_error_index;
  unsigned rounds;
  size_t rows_per_round[20]; /* sufficient inequalities; 0 where the fit from below could be made convex for next to
                                nothing */
  size_t rows_outer;         /* necessary ones */
  double slack;              /* of the certificate, see batten_convexity_options: 0 where all is strictly convex */
  double gauss_min, gauss_max;
  double gauss_min_unconstrained;
  batten_convexity convexity;
  double time_rows_s, time_qp_s, time_check_s;
} batten_convex_function_info;

/* Fits a spline function to points [count][3]: x, y, z = f(x, y), with f convex or concave on span pairs as
 * opt->signs has it. The surface is its graph (x, y, f(x, y)), u = x, v = y. unconstrained as above.
 * Where all signs are equal (or 0) f is strictly convex; where +1 and -1 touch its Hessian vanishes, and with both
 * signs what is proven is proven with info->slack. Too few points are fine: tension determines the rest. The lower
 * bounds are dual values of quadratic programs whose residuals are below 1e-9; what these residuals can shift is not
 * taken off.
 * BATTEN_OK: proven, and the objective is within gap_tol of objective_lower, or within a millionth of the size of z of
 * it, root mean square. W_STOPPED: proven, but the gap is larger (the text says it). W_ACCURACY: not proven. Progress
 * phases "fit", "certify", and those of the quadratic programs.
 * Fails: INVALID, NOMEM, TOO_LARGE, SINGULAR (points on a line), CANCELLED. */
BATTEN_API batten_status batten_convex_function_fit(batten_context *ctx, size_t count, const double *points,
                                                    const batten_convex_function_options *opt, batten_surface **out,
                                                    batten_surface **unconstrained,
                                                    batten_convex_function_info *info);

#ifdef __cplusplus
}
#endif
#endif
