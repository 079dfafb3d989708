/* Lofts: surfaces through contours in parallel planes whose sections keep the shape of the contours.
 *   [Juettler: Construction of surfaces by shape preserving approximation of contour data, section 3]
 *
 * Contours x_i(t) at heights z_0 < ... < z_C, B-splines each on knots of its own, points of equal t corresponding,
 * become a surface y(z, t) with y(z_i, t) = x_i(t): between two contours (a patch) a tensor product of degree (d, n)
 * on the union of their knots [eq. 7, 8], with continuous derivatives by z across contours [eq. 9]. Where two
 * neighbouring contours bend to the same side, every section between them does: by linear inequalities for the
 * sections' control polygons [eq. 10, 11] in a quadratic program whose objective turns and stretches the legs of one
 * polygon evenly into those of the next [eq. 12, 13]. Whether the sections have that shape is then proven by
 * batten_surface_certify_sections, which knows nothing of the inequalities. */
#ifndef BATTEN_LOFT_H
#define BATTEN_LOFT_H

#include <batten/contour.h>
#include <batten/surface.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_loft batten_loft; /* never changes */

/* ---- the surface -------------------------------------------------------------------------------- */

typedef struct batten_loft_options {
  size_t struct_size;
  unsigned smooth_z; /* l: continuous derivatives by z across contours, 1 or 2; contours must have as many by t. 0:
                          2 where all contours and slopes have two, else 1. Default 0. */
  unsigned degree_z; /* n, by z: 2 l + 1 .. degree_z_max. 0: 2 l + 2. Default 0. */
  unsigned degree_z_max; /* up to which it may be raised where there is no solution, .. BATTEN_SURFACE_DEGREE_MAX.
                          Default 9. */
  double knot_tolerance; /* knots of different contours that differ by less than this part of the domain are made
                            equal, those of the later contour moving: >= 0, < 0.1. Larger ones mean fewer, longer
                            legs; what contours move by is told (knot_shift). Default 1e-12. */
  const batten_curve *slopes[2]; /* dy/dz at the first and the last contour, as curves over the contours' domain, of
                                    degree d at most, closed as the contours; NULL = free. Where the contour and its
                                    neighbour share a flat point (x'' = 0) the slope must be flat, too; where it is
                                    not this is told (BATTEN_LOFT_SLOPE). Default NULL. */
  double tension; /* of the legs of sections' polygons and the trajectories of first and last control points (closed:
                     of all), against their bending by z, >= 0; does not depend on units. More: smoother from contour
                     to contour, but with more to put right in the sections between. Less than 1e-6 counts as that: it
                     must leave one surface. Default 0.01. */
  unsigned samples; /* S of eq. 12: heights in a patch at which legs are compared, >= degree_z. Default 20. */

  /* The inequalities. */
  unsigned rounds;      /* of inequalities and quadratic program for each degree and knots, 1 .. 100. Default 6. */
  double margin;        /* (0, 1): turns of sections stay above this part of the contours' turns. Default 0.01. */
  unsigned depth_max;   /* bisections of a patch by z for finer inequalities, 0 .. 10. Default 4. */
  unsigned knot_rounds; /* times that knots are inserted where there is no solution, 0 .. 10. Default 2. */
  double zone; /* around inflections that have no partner, and beside those at which x'' does not vanish, sections are
                  free; so far along the contour's neighbouring spans, as a part of them: (0, 0.5]. Default 0.1. */
  size_t row_limit; /* most inequalities, >= 1. Default 5000000. */
} batten_loft_options;
BATTEN_API batten_loft_options batten_loft_options_default(void);

typedef struct batten_loft_info {
  size_t contours, patches;
  unsigned smoothness, degree_t, degree_z;
  unsigned degree_raised;     /* by how much beyond what was asked for */
  size_t knots_inserted;      /* in all contours together */
  double knot_shift;          /* largest distance that merging of knots moved a contour, caller's unit; 0: none */
  size_t unknowns;            /* coordinates that are free */
  size_t equalities;          /* coordinates that flat points of the sections took away */
  size_t rows;                /* inequalities that the last program had to satisfy */
  size_t rows_used;           /* of them handed to the solver: others hold by themselves */
  unsigned rounds;            /* of quadratic programs, all degrees and knots together */
  size_t iterations;          /* of their solver, and of Newton's method */
  int settled;                /* non-zero: programs left vertices without a solution, or too many failed at first, and
                                 the turns themselves were settled by Newton's method */
  double interpolation_error; /* largest distance of the surface from the contours as given (knot_shift included),
                                 over the size of the contours' box */
  double continuity_error; /* largest jump of derivatives by z up to the smoothness, k-th ones times the k-th power of
                              the height of the lower one of both patches, over that size */
  size_t inflections;      /* of all contours */
  size_t
      inflections_unmatched; /* that have no partner in a neighbouring contour, or x'' not 0: see batten_loft_notes */
  size_t vertices_elastic;   /* of control polygons for which there was no solution: see batten_loft_notes */
  size_t self_intersecting;  /* contours that cross themselves */
  size_t sign_pairs;         /* patch and span of t in which sections must keep a sign */
  size_t sign_pairs_free;    /* others */
  size_t sign_violations_unconstrained; /* such pairs in which sections of the surface without inequalities have the
                                           wrong sign somewhere */
  size_t sign_violations;               /* the same of the result */
  int certified;                        /* non-zero: all of them are proven, and there are some where contours bend */
  double margin_min; /* proven: the least of (curvature with its sign) over these pairs where no flat point bounds the
                        span, 1 / unit; when not certified the least that was met */
  size_t worst_patch;
  double worst_at[2];                        /* where: t, z */
  double objective, objective_unconstrained; /* eq. 12 and 13 together; no unit */
  double time_prepare_s, time_objective_s, time_rows_s, time_qp_s, time_check_s;
} batten_loft_info;

/* A loft through contours [count] at heights [count], ascending; count >= 2. All contours open, or all closed;
 * over one domain; degree 2 .. BATTEN_CURVE_DEGREE_MAX (lower ones are raised to the highest); none runs against
 * the next. Where there is no solution, these are tried in order until there is one: new separators, finer
 * inequalities (where few vertices of the polygons fail), Newton's method on the turns themselves, degree n + 1
 * and so on, more knots next to the vertices that have none; the latter two only as long as fewer vertices fail for
 * it. Then inequalities of single vertices give way (elastic) as little as possible, and are named.
 *   unconstrained  NULL, or a new loft: the minimum without inequalities, same degree and knots, to compare with
 *   info           NULL, or the figures
 * Progress phases: "contours", "objective", "quadratic program", "certify".
 * BATTEN_OK          proven on all sign_pairs
 * BATTEN_W_ACCURACY  not proven; the text says where. Also when there are no sign_pairs though contours bend, since
 *                    rounding hides how
 * Same bits for any number of threads, and for points or heights scaled by a power of two. Cost: about linear in
 * patches x knots, where few inequalities matter.
 * Fails: INVALID (heights that do not ascend, contours that are degenerate, differ in domain, are open and closed,
 * not smooth enough, or run in opposite directions: named, with what to do), NOMEM, TOO_LARGE, CANCELLED. */
BATTEN_API batten_status batten_loft_build(batten_context *ctx, size_t count, const batten_curve *const *contours,
                                           const double *heights, const batten_loft_options *opt, batten_loft **out,
                                           batten_loft **unconstrained, batten_loft_info *info);
BATTEN_API void batten_loft_free(batten_loft *loft);

/* What it is made of; the arrays are the loft's. */
typedef struct batten_loft_form {
  size_t contours;       /* C + 1 */
  const double *heights; /* [contours] */
  unsigned degree[2];    /* d by t, n by z */
  unsigned smoothness;
  int closed;
} batten_loft_form;
BATTEN_API batten_loft_form batten_loft_get(const batten_loft *loft);

/* Patch i < contours - 1, between contours i and i + 1: u = t, v = z, Bezier in v, knots of both contours in u. */
BATTEN_API batten_status batten_loft_patch(batten_context *ctx, const batten_loft *loft, size_t i,
                                           batten_surface **out);
/* The whole as one B-spline surface: u = t with the knots of all contours, v = z with inner knots n - l fold. O(all
 * knots x contours) numbers. Fails: NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_loft_surface(batten_context *ctx, const batten_loft *loft, batten_surface **out);
/* The section at height z, a curve like the contours; its control points are the polygon of eq. 7. Fails: INVALID (z
 * outside), NOMEM. */
BATTEN_API batten_status batten_loft_section(batten_context *ctx, const batten_loft *loft, double z,
                                             batten_curve **out);

typedef struct batten_loft_measures {
  double area;   /* of the surface itself, without ends, caller's unit^2 */
  double volume; /* closed: between the surface and the planes of its first and last contour, caller's unit^3,
                    positive where contours run counter-clockwise; open: NaN */
} batten_loft_measures;
/* By quadrature, to 1e-9 or so where the surface is regular; the volume to rounding. Progress phase "measure". Fails:
 * INVALID, CANCELLED. */
BATTEN_API batten_status batten_loft_measure(batten_context *ctx, const batten_loft *loft, batten_loft_measures *out);

typedef enum batten_loft_remark {
  BATTEN_LOFT_UNMATCHED = 1, /* inflection of `contour` at t without a partner in contour `other` */
  BATTEN_LOFT_NOT_FLAT = 2,  /* inflection of `contour` at t where x'' is not 0 */
  BATTEN_LOFT_ELASTIC = 3,   /* inequalities gave way at the polygon's vertex near t between `contour` and `other` */
  BATTEN_LOFT_SELF_CROSSING = 4, /* `contour` crosses itself at t (and elsewhere) */
  BATTEN_LOFT_STEEP = 5, /* the polygon of `contour` turns by more than eq. 11 allows near t, however many knots */
  BATTEN_LOFT_SLOPE = 6 /* `contour` and `other` have x'' = 0 at t, but the slope given at `contour` has not: sections
                           beside it cannot keep their signs there. Give one with x'' = 0 there, or NULL */
} batten_loft_remark;
typedef struct batten_loft_note {
  batten_loft_remark remark;
  size_t contour, other; /* other = contour where there is none */
  double t;
  double amount; /* ELASTIC: by how much the turn fails, radians */
} batten_loft_note;
/* What is to be told of the contours; [*count], the loft's, by contour and t. */
BATTEN_API const batten_loft_note *batten_loft_notes(const batten_loft *loft, size_t *count);

/* ---- contours from slices ----------------------------------------------------------------------- */

typedef struct batten_loft_match_options {
  size_t struct_size;
  batten_contour_options fit; /* of each slice: degree, smoothness, closed, weights, significance, spans, tolerance,
                                 rounds and what the inequalities need; parameters, breaks, inflections, sign, ends
                                 must be as in its default: they are found here. With spans = tolerance = 0: as many
                                 as the slices speak for. Slices that have hardly more points than unknowns get
                                 more tension, up to 1e-4, so that they stay calm on the knots of others. */
  int orient;                 /* non-zero: slices that run against the first one are reversed. Default 1. */
  int align;                  /* non-zero, closed slices: begin where neighbours begin. Default 1. */
  int features; /* non-zero: inflections of neighbours that belong together get one parameter; bends count
                   from half of fit.significance on where that gives more inflections partners. Default 1. */
} batten_loft_match_options;
BATTEN_API batten_loft_match_options batten_loft_match_options_default(void);

typedef struct batten_loft_match_info {
  size_t slices, points;
  size_t reversed;            /* slices that were */
  size_t inflections;         /* of all slices */
  size_t inflections_matched; /* of them with a partner in each neighbouring slice */
  size_t tracks;              /* inflections followed through slices */
  size_t spans;               /* of every contour */
  double rms, max_error;      /* of all points */
  size_t max_error_slice;
  size_t told;      /* slices that are told to be of another shape (BATTEN_W_SHAPE of batten_contour_fit) */
  size_t certified; /* slices whose curve is proven to have its shape */
  double time_s;
} batten_loft_match_info;

/* Contours for batten_loft_build from slices: points [starts[slice_count]][2], those of slice i from starts[i] on, in
 * order. Solves the matching problem for slices that resemble their neighbours: the same direction; of closed slices
 * a starting point so that the sum of squared distances between neighbours at equal parts of their length is least;
 * parameters by arc length, shifted smoothly and monotonously so that inflections that correspond have the same one;
 * one set of knots. Fits by batten_contour_fit. curves [slice_count]: new curves over [0, 1]; all or none.
 * BATTEN_OK, BATTEN_W_SHAPE (some slices are of another shape than their fit, the text names the worst),
 * BATTEN_W_ACCURACY (a curve is not proven). Progress phase "slices". Fails: INVALID (names slice and point), as
 * batten_contour_fit of a slice, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_loft_match(batten_context *ctx, size_t slice_count, const size_t *starts,
                                           const double *points, const batten_loft_match_options *opt,
                                           batten_curve **curves, batten_loft_match_info *info);

#ifdef __cplusplus
}
#endif
#endif
