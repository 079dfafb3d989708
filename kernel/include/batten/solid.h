/* Solids from scattered surface points: f = sign (f_c - U), f >= 0 inside.  [Savchenko et al. 1995, section 3]
 *
 * f_c is the carrier, U the volume spline that interpolates f_c at the points. The paper writes U - f_c with a
 * carrier that is itself positive inside; that is positive outside, so batten turns it round. The data
 * fix where f = 0, not its sign beside them: every fit is checked (batten_sign_check) and, where the check asks
 * for it, cured by orienting the points and fitting again with the orientation as data. */
#ifndef BATTEN_SOLID_H
#define BATTEN_SOLID_H

#include <batten/carrier.h>
#include <batten/spline.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_solid batten_solid;

/* What a solid is made of: all kinds are evaluated, meshed, saved and taken as carriers alike. */
typedef enum batten_solid_kind {
  BATTEN_SOLID_SPLINE = 0, /* a volume spline under a carrier: this header */
  BATTEN_SOLID_STACK,      /* planar sections: <batten/stack.h> */
  BATTEN_SOLID_TREE        /* the algebra of solids: <batten/frep.h> */
} batten_solid_kind;

typedef enum batten_orientation {
  BATTEN_ORIENT_AUTO = 0, /* check; cure from given normals, else from estimated ones, only where needed: where the
                             check asks for it, and where most points lie in lines far apart (planar cuts) */
  BATTEN_ORIENT_NEVER,    /* carrier alone; the check still tells */
  BATTEN_ORIENT_GIVEN,    /* always use the given normals */
  BATTEN_ORIENT_ESTIMATE  /* always estimate normals and use them */
} batten_orientation;

typedef enum batten_orient_data {
  BATTEN_ORIENT_DATA_AUTO = 0,  /* gradients up to 2000 points, and pairs where the check is then not clean or the
                                   system too ill-conditioned; above that, and with opt.noise, pairs alone */
  BATTEN_ORIENT_DATA_GRADIENTS, /* Hermite-Birkhoff refit, no carrier, with the lowest order from m on whose kernel
                                   has two derivatives to spare (from m = 2: r^3, r^4 ln r) */
  BATTEN_ORIENT_DATA_PAIRS      /* refit with points off the surface, same kernel and carrier: 2 for each point; above
                                   50,000 points for one in 8, so 1.25 N unknowns, a little more on thin parts */
} batten_orient_data;

typedef enum batten_orient_method {
  BATTEN_ORIENT_METHOD_AUTO = 0, /* least energy; above energy_points on a well-spread subset */
  BATTEN_ORIENT_METHOD_ENERGY,   /* after Huang, Carr, Ju 2019 (VIPSS) */
  BATTEN_ORIENT_METHOD_PLANES    /* local planes, propagated along the neighbour graph: cheap */
} batten_orient_method;

typedef enum batten_orientation_used {
  BATTEN_ORIENTATION_NONE = 0,
  BATTEN_ORIENTATION_GIVEN,
  BATTEN_ORIENTATION_ESTIMATED
} batten_orientation_used;

typedef enum batten_sign_state {
  BATTEN_SIGN_CLEAN = 0, /* first fit passed the check */
  BATTEN_SIGN_CURED,     /* the refit with orientation passed it and has taken the first one's place */
  BATTEN_SIGN_AMBIGUOUS  /* the check still finds something: status BATTEN_W_AMBIGUOUS */
} batten_sign_state;

#define BATTEN_NOISE_ESTIMATE (-1.0)

/* How f is summed at many places. */
typedef enum batten_evaluation {
  BATTEN_EVALUATE_AUTO = 0, /* FAST from 12,000 terms N + nM on, 30,000 with kernels beyond r and r^2 ln r;
                               DIRECT below */
  BATTEN_EVALUATE_DIRECT,   /* N terms for each place, to rounding: batten_solid_evaluate */
  BATTEN_EVALUATE_FAST      /* by batten_spline_evaluator, as accurate as asked for. Stacks, trees, solids of one
                               dimension and splines without centres have no such sums and are evaluated directly all
                               the same */
} batten_evaluation;

typedef struct batten_solid_options {
  size_t struct_size;
  const batten_carrier *carrier; /* NULL = auto: batten_carrier_fit */
  const double *normals;         /* [N][n] outward, any positive length; NULL = none. AUTO looks at them only where
                                    the check asks for it. Where they are used they decide: turned inwards they make
                                    the outside the solid, which the check reports as ambiguous, because f is held
                                    negative far away */
  double merge_radius;           /* points closer than this become one, the first given stays; caller's unit, >= 0.
                                    Default 0: only points equal to within 1e-12 of the box merge */
  batten_orientation orientation;
  batten_orient_data orient_data;
  batten_orient_method orient_method;
  size_t energy_points; /* least-energy orientation works on at most so many points. Default 1000. */
  double noise;         /* standard deviation of the points' distance from the surface, caller's unit. Not 0: the
                           smoothing is the one with which the root mean square of |f| / |grad f| at the points, each cut
                           at 5 times the noise, is the noise to 5 % (discrepancy principle), at the cost of some 3 to 8
                           fits, above 6000 points of a subset of 3000 and 1 to 4 of all; spline.smoothing must then be 0.
                           Where even the smoothest spline comes nearer to the points (the carrier alone fits them), or
                           none comes so near, it is the nearest one: see info.distance_rms. BATTEN_NOISE_ESTIMATE (any
                           negative number): estimated from what quadrics over local planes leave. Default 0:
                           spline.smoothing as it is. */
  double pair_distance; /* off-surface distance over the local spacing, in (0, 1]. Default 0.5. */
  size_t check_cells;   /* cells of the sign check's grid along the longest side, 8 .. 1000. Default 40. */
  double reduce; /* distance, caller's unit, >= 0: so few points become centres of the spline that the surface is
                    within it of all, |f| / |grad f| <= reduce; batten_spline_fit_reduced(). Orientation then
                    enters as pairs, of which half the height may be missed. 0: all points. Default 0. */
  batten_evaluation evaluation; /* how the sign check evaluates f. What is reported of residuals is always direct.
                                   Default AUTO. */
  batten_spline_options spline;
} batten_solid_options;
BATTEN_API batten_solid_options batten_solid_options_default(void);

/* What the check of the sign field found. */
typedef struct batten_sign_check {
  size_t weak_gradients;     /* data points where |grad f| is under 1 % of the median, or where f does not change sign
                                from a tenth of the spacing before to as much behind along it */
  size_t flipped_neighbours; /* pairs of neighbouring points with locally like tangents whose gradients oppose */
  size_t phantom_components; /* pieces of f = 0 without data near them */
  size_t phantom_cells;      /* grid cells crossed by f = 0 too far from all data: one gap of the contour in the
                                plane, 2.5 local spacings (1.25 gaps between sampled lines) in space; and positive
                                samples of f among 256 on spheres of 1.5 to 50 half diagonals of the box */
  int inside_out;            /* non-zero: f was positive far away and has been turned */
  int clean;                 /* none of these; phantom cells up to 0.2 % of the crossed ones do not count */
} batten_sign_check;

/* What an evaluator does, and how well. */
typedef struct batten_solid_evaluator_info {
  batten_evaluation method; /* DIRECT or FAST; with DIRECT the next four are 0 */
  double error;          /* the largest |difference to direct f| / |grad f| at `places` over the diagonal of the box:
                            how far the surface moves. Elsewhere on the surface, where it is as steep, the worst is up
                            to six times that, which accuracy allows for; in the box beside, where f is large, f is off by some
                            times as much. A slope under 1 % of the median          counts as 1 %, one off the surface as the
                            median. */
  double gradient_error; /* likewise of the gradients, |difference| / |grad f| */
  double sums_accuracy;  /* what the fast sums were asked for, see batten_spline_evaluator_new() */
  size_t places;         /* where f was summed directly too: up to 400 points of the surface, evenly drawn, and 112
                            off it */
  size_t terms;          /* N + nM, 0 of stacks and trees */
  size_t evaluations;    /* points asked for so far */
  double time_new_s, time_evaluate_s; /* making it, trials included; all evaluations so far */
} batten_solid_evaluator_info;

typedef struct batten_solid_info {
  size_t points_given, points_used, duplicates_merged;
  batten_sign_state sign;
  batten_orientation_used orientation;
  batten_orient_data orient_data;     /* what the refit used; AUTO when there was none */
  batten_orient_method orient_method; /* what estimated the normals; AUTO when nothing did */
  double orient_lambda;               /* smoothing at which the estimated orientation was settled */
  batten_sign_check check;            /* of the first fit */
  batten_sign_check check_final;      /* of the solid that is returned */
  double residual_max;    /* max |f(x_i)| / (max - min of the interpolated values; where a carrier runs through all
                             points its own size in the box) */
  double distance_max;    /* max |f(x_i)| / |grad f(x_i)|, caller's unit */
  double distance_rms;    /* root mean square of |f(x_i)| / |grad f(x_i)|, with noise each cut at 5 times it; caller's
                             unit */
  double noise;           /* given or estimated, caller's unit; 0: none was asked for */
  double smoothing;       /* of the spline that is returned, as in batten_spline_options */
  size_t residual_points; /* at how many points these were looked for, by direct sums: all, or, where N times the
                             terms of f are above 1e9, 1e9 / terms evenly drawn ones, and 1000 at least */
  batten_solid_evaluator_info evaluation; /* of check_final's evaluations of f */
  double spacing;                         /* median distance to the nearest other point, caller's unit */
  batten_spline_info spline;              /* of the fit that is returned */
  batten_spline_reduce_info reduced;      /* of that fit; errors are distances at the points; 0 without opt.reduce */
  double time_data_s;                     /* merging, neighbours, spacing */
  double time_fit_s, time_check_s, time_orient_s;
} batten_solid_info;

/* Fit to points [count][n], n = 2 or 3. In one dimension an even number of points bounds intervals, and their order
 * orients them. Positive status: BATTEN_W_AMBIGUOUS, BATTEN_W_ACCURACY (residual_max above 1e-10; by ITERATIVE,
 * spline.saddle.residual_rows above opt.spline.saddle.accuracy; with opt.reduce, reduced.ratio_max above 1). Fails as
 * batten_spline_fit, and INVALID for a carrier that the spline reproduces (the text says which to take): every
 * carrier alone with m >= 3 needs orientation, and without a carrier of the caller's it is estimated at once. *out
 * untouched on failure; info may be NULL. The check costs (about 1.5 check_cells)^n evaluations of f on its grid and
 * 3 N and N gradients at the points; with fast sums all takes time in proportion to N. */
BATTEN_API batten_status batten_solid_fit(batten_context *ctx, unsigned n, size_t count, const double *points,
                                          const batten_solid_options *opt, batten_solid **out,
                                          batten_solid_info *info);

/* The same spline under another carrier: the paper's deformation (figure 5). The points of the new solid are the old
 * ones moved to its surface by Newton's method, its box is theirs. Takes up to 20 values and gradients at each, by a
 * batten_solid_evaluator of AUTO: of large splines they are on the surface to 1e-7 of the box's diagonal. Fails:
 * INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_solid_with_carrier(batten_context *ctx, const batten_solid *solid,
                                                   batten_carrier *carrier, batten_solid **out);

/* From parts; sign is +1 or -1. spline and carrier are retained. lower/upper [n]: box of the data. points
 * [point_count][n]: on the surface, at least one, copied. NULL (point_count is not read): the centres at which f
 * vanishes to 1e-6; all centres when, after smoothing, under a quarter do. Where terms times centres are above 1e9,
 * that is looked at with fast sums (BATTEN_EVALUATE_AUTO). Fails: INVALID, TOO_LARGE, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_solid_create(batten_context *ctx, batten_spline *spline, batten_carrier *carrier,
                                             int sign, const double *lower, const double *upper, size_t point_count,
                                             const double *points, batten_solid **out);

/* f = sign (f_c - U), its gradient and Hessian; arrays as batten_spline_evaluate. Takes as much memory again as it
 * returns. Hessians of stacks and trees are central differences of gradients, with steps of 1e-5 of the box's
 * diagonal. */
BATTEN_API batten_status batten_solid_evaluate(batten_context *ctx, const batten_solid *s, size_t count,
                                               const double *points, double *values, double *gradients,
                                               double *hessians);

/* f and its gradient at many points, in time O(N + count) where the spline has many terms. f is then approximated:
 * off by `error` as a distance (see above), and the same bits for any thread count. */
typedef struct batten_solid_evaluator batten_solid_evaluator;

/* accuracy: how far the surface may move, over the diagonal of the solid's box, 1e-12 .. 1e-2; 0: 1e-7, a tenth of
 * what the polygoniser settles its vertices to. What the sums take for it is found by trial at some 500 places, which
 * are summed directly too: about a second, more for kernels beyond r and r^2 ln r. DIRECT evaluators take no time to
 * make and are exact. The solid is retained. A carrier is evaluated as it is: one that is a solid of N' centres adds
 * N' terms for each place. Positive status: BATTEN_W_ACCURACY when the finest sums do not reach it; the info says
 * what they reach. Fails: INVALID, NOMEM, TOO_LARGE, CANCELLED. */
BATTEN_API batten_status batten_solid_evaluator_new(batten_context *ctx, batten_solid *s, batten_evaluation how,
                                                    double accuracy, batten_solid_evaluator **out);
/* points [count][n], finite; values [count], gradients [count][n], each may be NULL. ctx is the one that e was made
 * with. One call at a time. Progress phase "evaluate" in large batches. Outputs are partly written on failure. Fails:
 * INVALID, NOMEM, TOO_LARGE, CANCELLED. */
BATTEN_API batten_status batten_solid_evaluator_evaluate(batten_context *ctx, batten_solid_evaluator *e, size_t count,
                                                         const double *points, double *values, double *gradients);
/* The same as a field of order 1, with the solid's bounds grown by ten times the largest error of f that was seen:
 * for the polygoniser. Valid as long as e, and to be evaluated with its context. */
BATTEN_API batten_field batten_solid_evaluator_field(batten_solid_evaluator *e);
BATTEN_API batten_solid_evaluator_info batten_solid_evaluator_get_info(const batten_solid_evaluator *e);
/* NULL is fine. */
BATTEN_API void batten_solid_evaluator_free(batten_solid_evaluator *e);

/* Bounds of f over boxes, as batten_field says: boxes [count][2][n], ranges [count][2]. */
BATTEN_API batten_status batten_solid_bounds(batten_context *ctx, const batten_solid *s, size_t count,
                                             const double *boxes, double *ranges);
BATTEN_API batten_field batten_solid_field(const batten_solid *s); /* with bounds */

BATTEN_API unsigned batten_solid_dimension(const batten_solid *s);
BATTEN_API batten_solid_kind batten_solid_kind_of(const batten_solid *s);
BATTEN_API batten_spline *batten_solid_spline(const batten_solid *s);   /* not retained; NULL of other kinds */
BATTEN_API batten_carrier *batten_solid_carrier(const batten_solid *s); /* not retained; NULL of other kinds */
BATTEN_API int batten_solid_sign(const batten_solid *s);                /* 1 of other kinds */
BATTEN_API void batten_solid_box(const batten_solid *s, double *lower, double *upper); /* [n] of the data */

/* The data points on the surface (not the off-surface pairs): [count][n], seeds for the polygoniser. */
BATTEN_API const double *batten_solid_points(const batten_solid *s, size_t *count);

BATTEN_API batten_solid *batten_solid_retain(batten_solid *s);
BATTEN_API void batten_solid_free(batten_solid *s);

typedef struct batten_orient_options {
  size_t struct_size;
  batten_orient_method method;
  size_t energy_points; /* least energy works on at most so many points, more than n + 1. Default 1000. PLANES does
                           not read it. */
} batten_orient_options;
BATTEN_API batten_orient_options batten_orient_options_default(void);

typedef struct batten_orient_info {
  batten_orient_method method; /* ENERGY or PLANES */
  double lambda;        /* at which the signs were settled, as smoothing of batten_spline_options (unit box); 0 with
                           PLANES */
  size_t energy_points; /* that least energy worked on; 0 with PLANES */
  size_t strays;   /* points off the surface, only looked for above energy_points: they get normals too, but have no
                      say in those of others */
  size_t pieces;   /* sure pieces whose signs were settled above energy_points */
  size_t doubtful; /* points above energy_points whose sign is not sure: on a piece that fits turned round about as
                      well, or on none and with field and neighbours at odds */
} batten_orient_info;

/* Normals of unoriented surface points: normals [count][n], outward unit vectors, n = 2 or 3, count >= n + 2.
 *
 *   ENERGY  the unit gradients of the spline (kernel r^3, linear part) of least energy that is 0 at the points
 *           [Huang, Carr, Ju 2019]. Values are smoothed: the spline minimises |f|^2 + sum f(x_i)^2 / lambda. lambda
 *           walks down by tens from 1e-2 (points scaled to twice their root mean square distance from the centroid)
 *           until the signs stay put. About 8 ((n + 1) E)^2 bytes, and 20 E^3 flops for each of 2 to 5 lambdas, for E
 *           points. Above energy_points a well-spread subset is oriented so, and its f is carried to all points:
 *           those that firm ties between neighbours join to pieces take the piece's sign, which is the one that fits
 *           Gauss's formula sum of a_j n_j . (x_j - x) / |x_j - x|^3 = 2 pi at the points best, with f's gradient
 *           where that decides nothing; the others hang on by ties or take the sign, and where local planes are
 *           unsure the direction, of the gradient. Walls thinner than the subset's spacing are right so, down to 2 or
 *           3 spacings of all points. About 600 bytes for each point (n = 3) beside the subset, O(N log N + N E).
 *   PLANES  planes through nearest neighbours, signs along a spanning forest: for dense, even samples. O(N log N).
 *   AUTO    ENERGY; up to energy_points PLANES where energy's normals are rougher between neighbours plus less
 *           closed as a surface (|sum of area normal| / area) by more than 0.1, and where its matrix is singular.
 *
 * Planes go through 10 (4) neighbours, above energy_points through up to 160 where noise makes these no plane: noise
 * of one spacing of the points is well. Points far off the surface turn nothing. Outward:
 * extreme points look away from the rest (PLANES, and ENERGY up to energy_points). Points that coincide count once
 * and get the same normal. The result does not depend on the order of the points, up to ties in distance, nor on the
 * context's threads; with other threads of BLAS it differs by rounding. Progress phase "orient". opt NULL: defaults;
 * info may be NULL. Fails: INVALID, NOMEM, TOO_LARGE, SINGULAR (all on one line or plane), CANCELLED. */
BATTEN_API batten_status batten_orient_points(batten_context *ctx, unsigned n, size_t count, const double *points,
                                              const batten_orient_options *opt, double *normals,
                                              batten_orient_info *info);
/* The same with options and results one by one; method_used and lambda_used may be NULL. */
BATTEN_API batten_status batten_orient(batten_context *ctx, unsigned n, size_t count, const double *points,
                                       batten_orient_method method, size_t energy_points, double *normals,
                                       batten_orient_method *method_used, double *lambda_used);

#ifdef __cplusplus
}
#endif
#endif
