/* Planar B-spline curves, and what can be asked of them; the proof that a curve bends as it should among it.
 *
 *   x(t) = sum_j N_j(t) d_j      t in [t_0, t_1]
 *
 * Curvature is positive where the curve turns left. Parameters outside of the domain: curves that are closed are
 * taken periodically, of others INVALID. */
#ifndef BATTEN_CURVE_H
#define BATTEN_CURVE_H

#include <batten/base.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct batten_curve batten_curve; /* never changes */

enum { BATTEN_CURVE_DEGREE_MAX = 9 };

/* What it is made of, n = knot_count - degree - 1 control points. */
typedef struct batten_curve_form {
  unsigned degree; /* 1 .. BATTEN_CURVE_DEGREE_MAX */
  size_t knot_count;
  const double *knots; /* [knot_count] not decreasing; the first and the last degree + 1 are equal, inner ones
                          at most degree times (the curve is continuous) */
  const double *control_points; /* [n][2] */
  int closed;                   /* non-zero: the first control point is also the last one, to the bit, and the curve
                                   goes on there: its ends are an inner knot like others */
} batten_curve_form;

/* Copies. Fails: INVALID (names the knot or control point; also where their extent is beyond a double), NOMEM,
 * TOO_LARGE. */
BATTEN_API batten_status batten_curve_create(batten_context *ctx, const batten_curve_form *form, batten_curve **out);
BATTEN_API void batten_curve_free(batten_curve *curve);
/* Its parts; the arrays are the curve's. */
BATTEN_API batten_curve_form batten_curve_get(const batten_curve *curve);

/* ---- evaluation --------------------------------------------------------------------------------- */

typedef struct batten_curve_point {
  double point[2];
  double first[2], second[2]; /* derivatives by the parameter */
  double tangent[2];          /* unit; 0 where the first derivative vanishes */
  double curvature;           /* 1 / unit; NaN without a tangent */
} batten_curve_point;

/* parameters [count] -> out [count]. At inner knots where a derivative jumps: from the right (at the end: from the
 * left). On the context's threads. Fails: INVALID (names the parameter). */
BATTEN_API batten_status batten_curve_evaluate(batten_context *ctx, const batten_curve *curve, size_t count,
                                               const double *parameters, batten_curve_point *out);
/* Derivatives up to an order (any; those above the degree are 0): out [count][order + 1][2]. */
BATTEN_API batten_status batten_curve_derivatives(batten_context *ctx, const batten_curve *curve, unsigned order,
                                                  size_t count, const double *parameters, double *out);

/* ---- other forms of the same curve -------------------------------------------------------------- */

/* With further knots [count], in any order; one that is there already becomes more frequent, at most degree times.
 * Fails: INVALID (names the knot), NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_curve_insert_knots(batten_context *ctx, const batten_curve *curve, size_t count,
                                                   const double *knots, batten_curve **out);
/* Of a higher degree; every knot becomes more frequent by the difference: as smooth as before. */
BATTEN_API batten_status batten_curve_elevate(batten_context *ctx, const batten_curve *curve, unsigned degree,
                                              batten_curve **out);
/* The part from one parameter to another, not closed, with the same parameters. of a closed curve to <= from + period
 * may lie beyond the end. Fails: INVALID (from >= to, outside; where distinct knots would become equal, moved by
 * periods far from 0), NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_curve_part(batten_context *ctx, const batten_curve *curve, double from, double to,
                                           batten_curve **out);
/* Parts before and after t, inside the domain; both or none are made. Fails: as batten_curve_part. */
BATTEN_API batten_status batten_curve_split(batten_context *ctx, const batten_curve *curve, double t,
                                            batten_curve **before, batten_curve **after);
/* Run through the other way, over the same domain. Fails: INVALID (knots near the start that are too near to each
 * other to differ near the end), NOMEM. */
BATTEN_API batten_status batten_curve_reverse(batten_context *ctx, const batten_curve *curve, batten_curve **out);
/* x -> matrix x + shift (matrix row-major), t -> the domain [domain[0], domain[1]]. NULL: as it is. Fails: INVALID
 * (not finite, points beyond a double, a domain in which knots would no longer differ), NOMEM. */
BATTEN_API batten_status batten_curve_transform(batten_context *ctx, const batten_curve *curve,
                                                const double matrix[4], const double shift[2], const double domain[2],
                                                batten_curve **out);

/* ---- lengths and measures ----------------------------------------------------------------------- */

/* Length of the part from one parameter to another, to 1e-12 of the whole where the curve is regular; negative when
 * to < from. */
BATTEN_API batten_status batten_curve_length(batten_context *ctx, const batten_curve *curve, double from, double to,
                                             double *length);
/* Parameters at lengths [count] from the start, in any order; closed curves: any length. Fails: INVALID (names the
 * length), NOMEM. */
BATTEN_API batten_status batten_curve_at_lengths(batten_context *ctx, const batten_curve *curve, size_t count,
                                                 const double *lengths, double *parameters);

typedef struct batten_curve_measures {
  double length;
  double area;                         /* closed curves: positive when it runs counter-clockwise; of others 0 */
  double centroid[2];                  /* of the line itself */
  double lower[2], upper[2];           /* box, to 1e-12 of its size */
  double curvature_min, curvature_max; /* over both sides of knots; NaN, as are the places, without a tangent
                                          anywhere. Where x' vanishes the curvature may be unbounded: that is
                                          not seen */
  double curvature_min_at, curvature_max_at;
  double turn;        /* of the tangent from start to end, radians: a circle has 2 pi; corners at knots count
                         as turns by less than pi */
  double energy;      /* integral of the squared curvature by length */
  size_t inflections; /* as batten_curve_inflections */
} batten_curve_measures;
BATTEN_API batten_status batten_curve_measure(batten_context *ctx, const batten_curve *curve,
                                              batten_curve_measures *out);

/* Points on the curve so near to each other that the polygon through them is within tolerance (> 0, caller's unit) of
 * it: knots, and equal steps between them. *parameters [*count] ascending, from start to end (closed ones too), freed
 * by batten_free(ctx, *parameters). Fails: INVALID, NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_curve_sample(batten_context *ctx, const batten_curve *curve, double tolerance,
                                             size_t *count, double **parameters);

/* The nearest parameters to points [count][2]; distances [count] may be NULL. The least distance there is, to 1e-12
 * of the curve's size. Of equally near ones the first. On the context's threads. Progress phase "closest". Fails:
 * INVALID, NOMEM, CANCELLED. */
BATTEN_API batten_status batten_curve_closest(batten_context *ctx, const batten_curve *curve, size_t count,
                                              const double *points, double *parameters, double *distances);

/* Where the curve crosses or touches itself: *parameters [*count][2], the smaller one first, ascending by it, freed
 * by batten_free(ctx, *parameters), NULL when there are none. Found by boxes of Bezier pieces and Newton's method to
 * 1e-12 of the curve's size; pieces that lie on each other give one pair each. The common ends of closed curves do
 * not count. Fails: INVALID, NOMEM, TOO_LARGE. */
BATTEN_API batten_status batten_curve_crossings(batten_context *ctx, const batten_curve *curve, size_t *count,
                                                double (**parameters)[2]);

/* ---- inflections, and the proof of shape -------------------------------------------------------- */

/* Where the curvature changes its sign, corners at knots included: *parameters [*count] ascending, freed by
 * batten_free(ctx, *parameters), NULL when there are none. A straight piece between different signs counts once, in
 * its middle; a corner that turns against the bends on both sides counts twice; signs below the rounding of the
 * control points do not count. Of closed curves the start may be one. Fails: INVALID, NOMEM. */
BATTEN_API batten_status batten_curve_inflections(batten_context *ctx, const batten_curve *curve, size_t *count,
                                                  double **parameters);

/* With [a, b] = a_1 b_2 - a_2 b_1 the curvature is [x', x''] / |x'|^3. On each span, subdivided as need be, the
 * Bernstein coefficients of [x', x''] must have the wanted sign by more than all rounding errors together: then the
 * curvature has that sign and x' vanishes nowhere. At an inflection t_w where x'' is continuous (inside a span, or at
 * a knot that is there degree - 2 times or less) the same is shown of ([x', x''](t) - [x', x''](t_w)) / (t - t_w) on
 * the spans next to it, and near it that its product with t - t_w, hence [x', x''], is monotone on either side: then
 * there is exactly one zero. At knots that are there degree - 1 times, corners, and the ends of closed curves, x''
 * may jump: signs are proven up to them, but wrong ones that the rounding of the control points explains do not count
 * at a wanted inflection. At corners (knots that are there degree times) the tangent must turn by less than pi to the
 * side to which the curve bends there, or not at all to that rounding; so at the ends of closed curves. That
 * rounding: 2^-50 of the largest coordinate of the control points. Knows nothing of how the curve was made. Curves of
 * degree 1 do not bend and are never certified. About 1 us a span of degree 3.
 */
typedef struct batten_curve_shape_options {
  size_t struct_size;
  int sign;                  /* of the curvature at the start, +1 or -1; 0: whichever it is. Default 0. */
  size_t inflection_count;   /* changes of sign that are wanted, no others. Default 0. */
  const double *inflections; /* [inflection_count] ascending, inside the domain; of closed curves the start may be one
                                and their number is even */
  double slack;       /* > 0: how far from its parameter an inflection may lie, as a part of the spans next to it,
                         besides what the rounding of the control points may move it by (up to a quarter of a span:
                         on short spans that is what decides). Default 1e-9. */
  unsigned depth_max; /* bisections of a span, 0 .. 50. Default 40. */
} batten_curve_shape_options;
BATTEN_API batten_curve_shape_options batten_curve_shape_options_default(void);

typedef struct batten_curve_shape {
  int certified;           /* non-zero: proven: the wanted signs, exactly the wanted inflections, x' nowhere 0 */
  int sign;                /* at the start when certified, else 0 */
  double margin_min;       /* With sigma the wanted sign and rho(t) = 1, but on a span with an inflection at which the
                              curvature vanishes (|t - inflection| - inflection_error) / length of the span, of the
                              nearest one: sigma curvature(t) >= margin_min rho(t) is proven where rho(t) > 0, in
                              1 / unit, and margin_min is at least nine tenths of the largest such number, as far as
                              rounding lets that be proven. When not certified: the least that was met; 0 at corners
                              that turn the wrong way */
  double worst_at;         /* where the least was met */
  double inflection_error; /* proven: so near to the wanted parameters the inflections lie, in parameters */
  size_t pieces;           /* that were looked at */
  unsigned depth;          /* bisections of the smallest */
} batten_curve_shape;
/* Returns BATTEN_OK whether certified or not. Fails: INVALID, NOMEM. */
BATTEN_API batten_status batten_curve_certify(batten_context *ctx, const batten_curve *curve,
                                              const batten_curve_shape_options *opt, batten_curve_shape *out);

#ifdef __cplusplus
}
#endif
#endif
