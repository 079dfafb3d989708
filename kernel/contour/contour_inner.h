/* The map of kernel/contour, and what its parts say to each other.
 *
 * input.c          data that make no sense; scales
 * options.c        defaults and ranges
 * parameters.c     batten_contour_parametrize
 *
 * propose.c        batten_contour_propose: what is asked for of the runs of bends.c
 * bends            the curvature plot of the smoothing spline, its runs of one sign, and which of them count
 * smooth           the smoothing spline of data, and the noise that it tells
 * smooth_forced    the same with given signs of curvature
 *
 * layout           breaks, inflections and signs of pieces
 * knots.c          where breaks are placed, and how many
 * density          how densely: as the data lie, and as a pilot fit without inequalities needs them
 *
 * fit.c            batten_contour_fit: scales, rounds, certificate
 * space.c          curves that satisfy the equalities: the unknowns
 * objective.c      sum of squares and tension in banded form; their minimum
 * reference        a curve of the wanted shape near the data [section 2.2 (i)]: which of two constructions,
 *   _legs.c        prescribed directions of legs, and
 *   _removal.c     least squares on fewer knots
 * wedges           where the reference bends clearly enough for linear inequalities, by bisection [section 2.2 (ii)]
 * rows.c           those inequalities as rows
 * program.c        the quadratic program of a round [section 2.2 (iii)]
 * correct.c        parameter correction
 * judge.c          noise, or data of another shape
 *
 * Names without ending are a .c with its own .h; all else is declared here.
 *
 * In all of it points are scaled to a box of size about 1 around 0 (by a power of two), parameters and breaks are in
 * [0, 1], and control points are [n][2], those of a clamped B-spline; where they are unknowns of a matrix, coordinate
 * k of point j is column 2 j + k. */
#ifndef BATTEN_CONTOUR_INNER_H
#define BATTEN_CONTOUR_INNER_H

#include <batten/contour.h>
#include <batten/matrix.h>
#include <batten/qp.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "basis/bspline.h"

/* [a, b] = a_1 b_2 - a_2 b_1 */
static inline double contour_cross(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }

/* The data of a fit. */
typedef struct contour_data {
  size_t count;
  const double *points;  /* [count][2]; closed: the first one is not repeated */
  const double *weights; /* [count] >= 0, or NULL = ones */
} contour_data;

/* The wanted shape: spans with their signs. Inflections are breaks between different signs; of closed curves break 0
 * (= the last one) lies between the last span and the first. */
typedef struct contour_shape {
  unsigned degree, smoothness;
  bool closed;
  size_t spans;
  const double *breaks;     /* [spans + 1] ascending, the first 0, the last 1 */
  const signed char *signs; /* [spans] +1, -1 */
} contour_shape;
/* Whether break i (0 .. spans) is an inflection. */
static inline bool contour_inflection(const contour_shape *s, size_t i) {
  if (i == 0 || i == s->spans) return s->closed && s->signs[0] != s->signs[s->spans - 1];
  return s->signs[i - 1] != s->signs[i];
}

/* What is fixed at the ends of open curves; all NaN = nothing. */
typedef struct contour_ends {
  double point[2][2];
  double tangent[2][2]; /* unit */
} contour_ends;

/* ---- options.c, input.c -------------------------------------------------------------------------- */

/* Fails: INVALID, as the header says of each option; breaks and inflections are checked with the data. */
batten_status contour_options_check(batten_context *ctx, const batten_contour_options *opt);
batten_status contour_breaks_check(batten_context *ctx, const batten_contour_options *opt, const double domain[2]);

/* Points [count][2] in a box of size about 1, parameters in [0, 1], weights up to about 1. */
typedef struct contour_input {
  size_t count;
  bool repeated;                         /* the first point came again at the end, and was left out */
  double *points, *weights, *parameters; /* batten's; weights NULL = ones */
  double middle[2], unit;                /* points = (the caller's - middle) * unit */
  double weight_unit, total;             /* weights = the caller's * weight_unit; their sum */
  double domain[2];                      /* parameters = (the caller's - domain[0]) / (domain[1] - domain[0]) */
} contour_input;
/* Checks data, breaks and inflections, scales, and estimates parameters that are not given. opt has been checked.
 * Fails: INVALID, NOMEM, TOO_LARGE. */
batten_status contour_input_make(batten_context *ctx, size_t count, const double *points,
                                 const batten_contour_options *opt, contour_input *out);
void contour_input_free(batten_context *ctx, contour_input *in);

/* ---- parameters.c, knots.c, correct.c ------------------------------------------------------------ */

/* Breaks of `spans` pieces or (spans = 0) as many as it takes for all points to be within tolerance, or (tolerance =
 * 0) as the data speak for, without inequalities; every run between inflections (given, in [0, 1], ascending, of
 * closed curves maybe 0) has enough pieces for the reference (smoothness 2: two between inflections). Inflections are
 * breaks. *breaks [*pieces + 1], batten's; parameters [count] in [0, 1], not decreasing. Fails: NOMEM, TOO_LARGE,
 * CANCELLED. */
typedef struct contour_knots_options {
  unsigned degree, smoothness;
  bool closed;
  size_t spans;
  double tolerance;
  size_t inflection_count;
  const double *inflections;
} contour_knots_options;
batten_status contour_knots_place(batten_context *ctx, const contour_data *data, const double *parameters,
                                  const contour_knots_options *opt, size_t *pieces, double **breaks);

/* Up to `passes` steps of each point to a nearer place; parameters [count] stay in [0, 1]; the first point at 0 and
 * the last at 1 of those with a weight stay there. closed: all go round. No distance rises. squares [count]: squared
 * distances from the new places. On the context's threads. */
void contour_correct(batten_context *ctx, const bspline *space, bool closed, const double *control,
                     const contour_data *data, unsigned passes, double *parameters, double *squares);

/* ---- the unknowns (space.c) ---------------------------------------------------------------------- */

/* control = offset + Z y: what periodicity, the ends and (where asked for) x'' = 0 at inflections leave free. Entries
 * of Z are those of convex combinations, but at fixed tangents. */
typedef struct contour_space {
  bspline b; /* clamped, degree as asked for; knots are the space's */
  double *knots;
  size_t unknowns; /* length of y */
  size_t *starts;  /* [2 b.count + 1] compressed rows of Z */
  uint32_t *indices;
  double *values;
  double *offset;    /* [2 b.count] */
  size_t equalities; /* scalar ones that were eliminated, periodicity not counted */
} contour_space;

/* degree >= shape->smoothness + 1; inner breaks are degree - smoothness fold. ends NULL = free. Fails: INVALID (too
 * few spans for what is asked), NOMEM, TOO_LARGE. */
batten_status contour_space_make(batten_context *ctx, const contour_shape *shape, unsigned degree, bool inflections,
                                 const contour_ends *ends, contour_space *out);
void contour_space_free(batten_context *ctx, contour_space *s);
/* Whether control [count][2] leaves its ends along their tangents, and not the other way: a space of curves holds
 * both. Inequalities around a reference that does keep it so. */
bool contour_forward(const contour_ends *ends, size_t count, const double *control);
/* control [b.count][2] of y. */
void contour_space_expand(const contour_space *s, const double *y, double *control);

/* The weight of the integral of |x''|^2 over [0, 1] for an option's tension: spans of length 1 / K have coefficients
 * of K^3 there and of 1 / K in the mean square, which keep their ratio so. */
static inline double contour_tension(double tension, size_t spans) { return tension * pow((double)spans, -4); }
/* The default: what exact data of 500 random curves are off is within 1 % of what a hundredth of it leaves; with ten
 * times it 4 % more. */
#define CONTOUR_TENSION 1e-9

/* ---- objective (objective.c) --------------------------------------------------------------------- */

/* sum of weight |x(t) - point|^2 / total weight + tension * integral of |x''|^2, banded: coefficient j, j + k at
 * [j][k], k = 0 .. degree, of both coordinates alike. */
typedef struct contour_objective {
  bspline b;
  double tension; /* of bend */
  double *bend;   /* [b.count][degree + 1] tension * integral of |x''|^2, of very short spans less */
  double *band;   /* [b.count][degree + 1] */
  double *right;  /* [b.count][2] */
} contour_objective;
batten_status contour_objective_new(batten_context *ctx, const bspline *b, contour_objective *out);
void contour_objective_free(batten_context *ctx, contour_objective *o);
void contour_objective_set(contour_objective *o, const contour_data *data, const double *parameters, double tension);
/* Its minimum in a space: control [b.count][2]. Fails: SINGULAR, NOMEM. Time and room O(b.count) (closed ones too).
 */
batten_status contour_objective_solve(batten_context *ctx, const contour_objective *o, const contour_space *space,
                                      double *control);
/* The weighted sum of squares at parameters. */
double contour_sum(const bspline *b, const double *control, const contour_data *data, const double *parameters);

/* ---- reference (reference*.c) -------------------------------------------------------------------- */

typedef struct contour_row_options {
  double gap;         /* between wedges, radians; where the reference is nearly straight, half of what it can be */
  unsigned depth_max; /* bisections of a span */
  double margin;
  size_t row_limit;
} contour_row_options;

typedef struct contour_reference {
  double *control;       /* [n][2] of the degree of the shape; the caller's memory */
  unsigned construction; /* that gave it: 1 or 2 */
  bool fallback;         /* 1, for 2 was asked, too, and gave none */
} contour_reference;

/* A curve of the wanted shape in the space of the fit, that satisfies the ends, is near the data, and that
 * contour_rows_make accepts with the same `rows`. construction 1, 2, or 0: both are made, and the one with the lower
 * sum of squares is kept. Fails: INFEASIBLE (the ends contradict the shape, or rows are too strict; says how), NOMEM,
 * TOO_LARGE, CANCELLED. */
batten_status contour_reference_find(batten_context *ctx, const contour_shape *shape, const contour_space *space,
                                     const contour_ends *ends, const contour_data *data, const double *parameters,
                                     unsigned construction, double tension, const contour_row_options *rows,
                                     contour_reference *out);

/* ---- inequalities (wedges.c, rows.c) ------------------------------------------------------------- */

/* A piece [from, to] of span mu with the directions u, v that separate its differences [Lemma, eq. 3]. */
typedef struct contour_wedge {
  size_t mu;
  double from, to;
  double u[2], v[2];
  signed char sign;
} contour_wedge;

typedef struct contour_rows {
  batten_matrix matrix; /* sparse, 2 n columns, rows of length 1; its arrays are batten's (free below) */
  double *lower;        /* [matrix.rows] margin times what the reference has there, or a floor above rounding: > 0 */
  contour_wedge *wedges;
  size_t wedge_count;
  unsigned depth; /* bisections of the smallest */
} contour_rows;

/* Inequalities that the reference [n][2] satisfies strictly, and that are sufficient together with the equalities of
 * the space (shape's inflections). old: NULL, or rows that the reference satisfies strictly: where bisection fails
 * its pieces stay. *accepted = false and *out untouched when a span does not bend clearly enough. out NULL: only the
 * question. Fails: NOMEM, TOO_LARGE (row_limit), CANCELLED. */
batten_status contour_rows_make(batten_context *ctx, const contour_shape *shape, const bspline *b,
                                const double *reference, const contour_row_options *opt, const contour_rows *old,
                                bool *accepted, contour_rows *out);
void contour_rows_free(batten_context *ctx, contour_rows *rows);

/* ---- the quadratic program of a round (program.c) ------------------------------------------------ */

typedef struct contour_program_figures {
  size_t iterations, active;
  bool solved; /* false: rounding kept the engines from a result, control is untouched */
} contour_program_figures;
/* free [n][2] the minimum without rows in the space, reference [n][2] in the space and strictly feasible -> control
 * [n][2], feasible for every row in floating point, in the space to rounding. Fails: NOMEM, TOO_LARGE, CANCELLED. */
batten_status contour_program_solve(batten_context *ctx, batten_qp_workspace *workspace,
                                    const contour_objective *objective, const contour_space *space,
                                    const contour_rows *rows, const double *free, const double *reference,
                                    double *control, contour_program_figures *figures);

/* ---- smoothing, proposal, verdict (smooth.c, propose.c, judge.c) --------------------------------- */

/* Inflections of data in [0, 1] and the sign at the start, as batten_contour_propose keeps them. *inflections
 * [*count] batten's, NULL when none. */
batten_status contour_inflections_find(batten_context *ctx, const contour_data *data, const double *parameters,
                                       bool closed, double significance, size_t *count, double **inflections,
                                       int *sign);
/* The sign at the start that suits given inflections best. */
batten_status contour_sign_guess(batten_context *ctx, const contour_data *data, const double *parameters, bool closed,
                                 size_t count, const double *inflections, int *sign);

/* The fit's squares [count] beside those of the fit without inequalities: *misfit as batten_contour_info.misfit, and
 * where the data contradict the shape most: *from, *to (points). unknowns: of the fit without inequalities. */
typedef struct contour_verdict {
  double misfit;
  bool contradicts; /* W_SHAPE */
  size_t worst;     /* point in the middle of the worst part */
  double distance;  /* mean distance there */
} contour_verdict;
void contour_judge(const contour_data *data, const double *squares, const double *unconstrained_squares,
                   size_t unknowns, contour_verdict *out);

#endif
