/* Shape-preserving curves through scattered data in the plane, by quadratic programming.
 *   [Juettler: Construction of surfaces by shape preserving approximation of contour data, section 2]
 *
 * A sequence of points becomes a C^1 or C^2 B-spline curve that has exactly the inflections and signs of curvature
 * that one wants. A reference curve of that shape yields linear inequalities for the control points that are
 * sufficient; the fit is a quadratic program; its result, blended with the reference, is the next reference. Whether
 * the result has its shape is then proven by batten_curve_certify, which knows nothing of the inequalities. */
#ifndef BATTEN_CONTOUR_H
#define BATTEN_CONTOUR_H

#include <batten/curve.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- parameters of points in order -------------------------------------------------------------- */

typedef enum batten_contour_parametrization {
  BATTEN_CONTOUR_CHORD = 0,   /* steps as long as the distances of neighbours */
  BATTEN_CONTOUR_CENTRIPETAL, /* their square roots [Lee 1989] */
  BATTEN_CONTOUR_UNIFORM,     /* equal steps; repeated points none */
  BATTEN_CONTOUR_FOLEY        /* chords lengthened where the polygon turns [Foley, Nielson 1989] */
} batten_contour_parametrization;

/* points [count][2] -> parameters [count] in [0, 1], not decreasing, equal for equal neighbours. closed: the way from
 * the last point to the first one counts, and the first one's second parameter is 1. Fails: INVALID (fewer than two
 * different points), NOMEM. */
BATTEN_API batten_status batten_contour_parametrize(batten_context *ctx, size_t count, const double *points,
                                                    batten_contour_parametrization method, int closed,
                                                    double *parameters);

/* ---- the fit ------------------------------------------------------------------------------------ */

#define BATTEN_INFLECTIONS_AUTO ((size_t)-1)

typedef struct batten_contour_options {
  size_t struct_size;
  unsigned degree;     /* smoothness + 1 .. BATTEN_CURVE_DEGREE_MAX. Default 3. */
  unsigned smoothness; /* continuous derivatives: 1 or 2. Default 2. */
  int closed; /* non-zero: a closed smooth curve. The first point may be repeated at the end or not. Default 0.
               */

  const double *parameters; /* [count] not decreasing; NULL = by parametrization, in [0, 1]. Default NULL. */
  batten_contour_parametrization parametrization; /* default CHORD */
  double domain[2];      /* of the given parameters, and of the curve; closed: domain[1] is where the first point
                            comes again. NaN: from the first to the last parameter (closed: must be given). Default
                            NaN. */
  const double *weights; /* [count] >= 0, NULL = ones. Points of weight 0 do not count: as if they were not there, but
                            that they get parameters, of the places that are near to them */

  size_t break_count;   /* inner knots that are wanted; each becomes degree - smoothness fold */
  const double *breaks; /* [break_count] ascending, inside the domain; inflections join them. NULL = placed. */
  size_t spans;         /* where breaks are placed: number of polynomial pieces at least (an inflection more may add
                           some); 0 = as many as the data speak for, or tolerance needs. Default 0. */
  double tolerance;     /* > 0: as few spans as bring all points within this distance of the fit without inequalities,
                           caller's unit. Default 0: none. */

  size_t inflection_count;   /* BATTEN_INFLECTIONS_AUTO: those that batten_contour_propose keeps. Default AUTO. */
  const double *inflections; /* [inflection_count] ascending, inside the domain (closed: the start may be one; their
                                number is even). Each becomes a knot */
  int sign; /* of the curvature at the start: +1 turns left, -1 right, 0 = as the data have it. Default 0. */
  double significance; /* AUTO: standard deviations of noise that a bend must have to count, > 0. Default 4. */

  int fix_ends[2];           /* non-zero: the curve begins (ends) in end_points. Open curves. Default 0. */
  double end_points[2][2];   /* NaN = the first (last) point. Default NaN. */
  double end_tangents[2][2]; /* direction of the curve at its begin and end, any length; NaN = free. Default NaN. */

  unsigned rounds;   /* of inequalities, quadratic program and parameter correction, 1 .. 100. Default 10. */
  double rounds_tol; /* >= 0. A round that lowers the sum of squares by a smaller part is the last. Default 1e-3. */
  unsigned correction_passes; /* of parameter correction (nearest places) in each round, 0 = parameters stay. The
                                 first and last points of open curves stay at the ends of the domain, where they are
                                 there: else the curve might run on beyond them. Default 3. */
  double tension; /* weight of K^-4 integral of |x''|^2 beside the mean square distance, domain [0, 1], K spans, >= 0:
                     as stiff beside the data of a span however many spans there are. What keeps places without data
                     calm. Default 1e-9. */

  /* The inequalities. */
  unsigned construction; /* of the first reference: 1 prescribed directions of legs, 2 knot removal, 0 = both, and the
                            one that is nearer to the points. Default 0. */
  double blend;          /* part of the old reference in the new one, (0, 1). Default 0.05. */
  double margin;         /* every inequality holds by this part of what the reference has, (0, 1): curvature is not 0.
                            Default 1e-3. */
  double gap;            /* a piece is accepted when the wedges of its first and second differences are so far apart,
                            radians, (0, 0.5), or half as far as they can be: larger ones mean more rows, and a little
                            lower sums. Default 0.1. */
  unsigned depth_max;    /* bisections of spans, 0 .. 20. Default 12. */
  size_t row_limit;      /* most inequalities, >= 1. Default 2000000. */
} batten_contour_options;
BATTEN_API batten_contour_options batten_contour_options_default(void);

enum { BATTEN_CONTOUR_ROUNDS_MAX = 100 };

typedef struct batten_contour_info {
  size_t unknowns; /* coordinates of control points that are free */
  size_t spans;    /* polynomial pieces */
  size_t inflections_wanted;
  size_t inflections_found;         /* of the result, by batten_curve_inflections */
  size_t inflections_unconstrained; /* of the fit without inequalities */
  double lsq_unconstrained;         /* weighted sums of squares, caller's unit^2: without inequalities, same knots and
                                       rounds of parameter correction, and once more from the result's parameters: the
                                       least */
  double lsq_unconstrained_first;   /* the same at the first parameters */
  double lsq_reference;             /* first reference curve, first parameters */
  double lsq;                       /* of the result. Above the last of lsq_per_round where rounding, far from the
                                       origin, spoils the shape of the best curve, and the result moved away from it */
  double rms, max_error;            /* of the result: distances of points from their places */
  size_t max_error_index;           /* that point */
  unsigned construction;            /* that gave the first reference: 1 or 2 */
  int fallback;                     /* non-zero: construction 2 gave none of the wanted shape, and 1 stood in */
  unsigned rounds;                  /* that were run */
  unsigned round_best;              /* that gave the result, 0 = the reference already */
  size_t equalities;                /* that were eliminated: x'' = 0 at inflections, ends, two each */
  size_t iterations;                /* of the quadratic programs, all rounds */
  size_t rows_per_round[BATTEN_CONTOUR_ROUNDS_MAX];     /* inequalities */
  size_t segments_per_round[BATTEN_CONTOUR_ROUNDS_MAX]; /* pieces of spans that they belong to */
  double lsq_per_round[BATTEN_CONTOUR_ROUNDS_MAX];      /* after parameter correction; never rises */
  size_t rows_active;                                   /* of the last quadratic program */
  double misfit; /* how far the data contradict the wanted shape: root mean square distance of the result over the
                    noise that the fit without inequalities tells; NaN: too few points to tell. See BATTEN_W_SHAPE
                  */
  batten_curve_shape shape; /* of the result, proven */
  double time_parameters_s, time_inflections_s, time_knots_s, time_reference_s, time_rows_s, time_qp_s,
      time_correction_s, time_check_s;
} batten_contour_info;

/* Fits a curve of wanted shape to points [count][2] in order, any unit, count >= 3.
 *   parameters     NULL, or [count]: those of the result
 *   unconstrained  NULL, or a new curve: the fit without inequalities on the same knots, for comparison
 *   info           NULL, or the figures
 * Progress phases: "parameters", "inflections", "knots", "reference", "quadratic program", "fit", "certify".
 * BATTEN_OK          fitted, and proven to have exactly the wanted shape (info->shape.certified)
 * BATTEN_W_SHAPE     proven, but the data have another shape: they are three times as far from the curve as their
 *                    noise explains (misfit); or twice, where that is seen (0.3 % of the points' size above the fit
 *                    without inequalities) and chance would give it about once in 1,000 times. The text says where
 *                    and by how much.
 * BATTEN_W_ACCURACY  not proven; the text says where
 * Same bits for any number of threads, and for points scaled by a power of two. Cost: O(count + spans) a round.
 * Fails: INVALID (points or weights that are not finite, all points equal or on one line, parameters out of order,
 * named; inflections without a knot between them where degree = smoothness + 1 = 3), INFEASIBLE (no curve has these
 * ends and that shape, or hardly one has; the text says why), SINGULAR (tension 0, and too few points for the spans),
 * NOMEM, TOO_LARGE, CANCELLED. */
BATTEN_API batten_status batten_contour_fit(batten_context *ctx, size_t count, const double *points,
                                            const batten_contour_options *opt, batten_curve **out, double *parameters,
                                            batten_curve **unconstrained, batten_contour_info *info);

/* ---- inflections of data ------------------------------------------------------------------------ */

/* A run of one sign of curvature in smoothed data. */
typedef struct batten_contour_run {
  double from, to; /* parameters; the first begins and the last ends with the domain (closed: with the first change)
                    */
  int sign;        /* +1 turns left */
  double turn;     /* of the tangent, radians, with its sign */
  double significance; /* standard deviations of the noise by which the fit worsens without the run: small ones are
                        * wiggles
                        */
  int kept;            /* non-zero: it counts. Runs that do not count belong to their neighbours. */
} batten_contour_run;

typedef struct batten_contour_proposal {
  size_t run_count;
  batten_contour_run *runs; /* [run_count] before runs are joined */
  size_t inflection_count;
  double *inflections;    /* [inflection_count] what to hand to the fit, maybe after changes; ascending */
  double *uncertainties;  /* [inflection_count] standard deviations of their parameters */
  int sign;               /* at the start */
  double noise;           /* standard deviation of a coordinate, caller's unit */
  size_t sample_count;    /* of the curvature plot */
  double *samples;        /* [sample_count][4] parameter, curvature of the smoothed data, its standard deviation,
                             length from the start */
  batten_curve *smoothed; /* the smoothing spline */
} batten_contour_proposal;

/* Smooths the points, and tells bends from noise. What is taken for noise: what the smoothing spline leaves, between
 * 0.85 and 2.4 times what neighbouring points tell (the distances of points across the cubics through two neighbours
 * on both sides); and where those distances grow slowly with the neighbours' steps, as in outlines that were drawn by
 * hand or follow pixels, the distance across neighbours four points away: neighbours deviate alike there, and bends
 * of a few points do not count. No less than 1e-4 of the points' size up to 100 points; with their number's root
 * for more. Uses of opt: closed, parameters, parametrization, domain, weights,
 * significance. Free with batten_contour_proposal_free. Progress phase "inflections". Fails: as batten_contour_fit.
 */
BATTEN_API batten_status batten_contour_propose(batten_context *ctx, size_t count, const double *points,
                                                const batten_contour_options *opt, batten_contour_proposal *out);
BATTEN_API void batten_contour_proposal_free(batten_context *ctx, batten_contour_proposal *proposal);

#ifdef __cplusplus
}
#endif
#endif
