/* The map of kernel/loft, and what its parts say to each other.
 *
 * build.c        batten_loft_build: the order of things, what is tried when there is no solution
 * options.c      defaults and ranges
 * contours.c     contours as they come: what makes no sense, scales, equal degrees, merged knots -> loft_stack
 * shape.c        assumptions (2) and (3): inflections, which of them have partners; knots that are inserted for them
 * and until the polygons bend as the curves do; what is told of the contours
 *
 * space.c        spline spaces in t, open and periodic: unions, intersections, knot insertion as matrices
 * slabs.c        patches: their knots [eq. 7], the contours on them
 * vertices.c     turns of the polygons at both contours, which signs must be kept
 * net.c          control points of all patches as functions of free unknowns: continuity [eq. 9] and flat points
 * spiral.c       legs that turn and stretch evenly: the points q of eq. 12
 * objective*.c   eq. 12 and 13 as a sparse system; their minimum
 * turns.c        what turns must keep [eq. 10, 11], and whether those of a surface do
 * rows.c         separators, and the inequalities that they give
 * program.c      the quadratic program, rigid or elastic
 * rounds.c       separators and programs in turns, finer inequalities
 * settle.c       the turns themselves, by Newton's method, where programs leave vertices without a solution
 * measure.c      what the surface leaves of interpolation and continuity, from the patches alone
 *
 * loft.c         the handle: patches, whole surface, sections
 * volume.c       area and volume
 * match*.c       batten_loft_match
 *
 * In all of it points are scaled to a box of size about 1 around 0 and heights to gaps of about 1 (both by powers of
 * two), t is in [0, 1]. */
#ifndef BATTEN_LOFT_INNER_H
#define BATTEN_LOFT_INNER_H

#include <batten/loft.h>
#include <batten/matrix.h>
#include <batten/qp.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "basis/bspline.h"

static inline double loft_cross(const double a[2], const double b[2]) { return a[0] * b[1] - a[1] * b[0]; }

/* ---- spline spaces (space.c) --------------------------------------------------------------------- */

/* Splines of a degree on [0, 1]. Open: the ends are degree + 1 fold, all else as usual. Closed (periodic): functions
 * are taken modulo `count`, the seam at 0 = 1 is a knot like others; count > degree.
 *
 * On [0, 1] `b` has all functions unrolled: function j lives on knots b.knots[j .. j + degree + 1], span s on
 * functions first[s] .. first[s] + degree, and function j is control point j % count. Knot b.knots[degree] is the
 * last copy of 0. In periodic spaces b.knots go on beyond [0, 1], and bspline_lower, _upper, _first do not apply;
 * what bspline.h says of spans (bspline_rows, _basis) does.
 *
 * Leg v leads from control point v to v + 1, vertex v lies between legs v and v + 1 (at control point v + 1); modulo
 * count where closed. The vertices that act on span s are first[s] .. first[s] + degree - 2. */
typedef struct loft_space {
  unsigned degree;
  bool closed;
  size_t spans;
  double *breaks;  /* [spans + 1] ascending, 0 .. 1 */
  unsigned *folds; /* [spans + 1] how often each is a knot, 1 .. degree - 1 inside; closed: the last is the first */
  size_t *first;   /* [spans] */
  size_t count;    /* control points */
  bspline b;       /* its knots are the space's */
  double *knots;
} loft_space;

static inline size_t loft_legs(const loft_space *s) { return s->closed ? s->count : s->count - 1; }
static inline size_t loft_vertices(const loft_space *s) { return s->closed ? s->count : s->count - 2; }
/* Knot j of the unrolled sequence, any j where closed. */
double loft_knot(const loft_space *s, ptrdiff_t j);
/* Greville abscissa of control point j < count; the unrolled one. Leg v is its difference times x' there: the knot
 * interval of leg v is loft_interval = u_(v + degree + 1) - u_(v + 1) = degree times that difference. > 0. */
double loft_greville(const loft_space *s, ptrdiff_t j);
double loft_interval(const loft_space *s, ptrdiff_t v);

/* Copies breaks and folds. Fails: NOMEM, TOO_LARGE. Free it in any case, zeroed before. */
batten_status loft_space_make(batten_context *ctx, unsigned degree, bool closed, size_t spans, const double *breaks,
                              const unsigned *folds, loft_space *out);
void loft_space_free(batten_context *ctx, loft_space *s);
/* The union: every knot as often as in the one that has it more often. */
batten_status loft_space_union(batten_context *ctx, const loft_space *a, const loft_space *b, loft_space *out);
/* What both unions, of middle with below and of middle with above, hold: knots max(middle, min(below, above)) fold.
 */
batten_status loft_space_common(batten_context *ctx, const loft_space *below, const loft_space *middle,
                                const loft_space *above, loft_space *out);
/* With further knots [count], each ascending inside (0, 1) or 0 (closed), `folds` [count]: at least so often then. */
batten_status loft_space_insert(batten_context *ctx, const loft_space *from, size_t count, const double *knots,
                                const unsigned *folds, loft_space *out);

/* Compressed rows; batten's arrays. */
typedef struct loft_matrix {
  size_t rows, columns;
  size_t *starts;
  uint32_t *indices;
  double *values;
} loft_matrix;
void loft_matrix_free(batten_context *ctx, loft_matrix *m);
/* y [rows][2] = m x [columns][2] */
void loft_matrix_apply(const loft_matrix *m, const double *x, double *y);

/* Control points in `to` of those in `from`; to has every knot of from at least as often, and the same degree. Rows
 * are convex combinations of at most degree + 1; a row that copies has one entry 1. */
batten_status loft_insertion(batten_context *ctx, const loft_space *from, const loft_space *to, loft_matrix *out);
/* The same curves over a clamped knot vector: knots [*knot_count], batten's, and the matrix (closed: the last row is
 * the first). Open: a copy and the identity. */
batten_status loft_clamped(batten_context *ctx, const loft_space *from, size_t *knot_count, double **knots,
                           loft_matrix *out);

/* ---- contours (contours.c, shape.c) -------------------------------------------------------------- */

typedef struct loft_contour {
  loft_space space;
  double *points; /* [space.count][2] */
  double height;
  /* Flat points: breaks at which x'' = 0 to rounding and that have a partner in the neighbour above (at the same
   * break, flat too); shape.c. [space.spans + 1] */
  unsigned char *flat_above;
} loft_contour;

/* Contours of one degree. points = (the caller's - middle) * unit, heights = (the caller's - base) * height_unit, t =
 * (the caller's - domain[0]) / (domain[1] - domain[0]). */
typedef struct loft_stack {
  unsigned degree, smoothness;
  bool closed;
  size_t count;
  loft_contour *contours;
  double middle[2], unit, base, height_unit, domain[2];
  double size;       /* of the scaled points' box */
  double *slopes[2]; /* dx/dz at the first and last contour (scaled by unit / height_unit) on that contour's space
                        [space.count][2]; NULL = free. shape.c keeps them with the knots that it inserts */
  double knot_shift; /* scaled */
  size_t knots_inserted, inflections, unmatched, self_crossing;
  size_t note_count, note_room;
  batten_loft_note *notes; /* t in the caller's domain */
} loft_stack;

/* Checks, scales, raises degrees, merges knots. opt has been checked. Fails: INVALID, NOMEM, TOO_LARGE. */
batten_status loft_stack_make(batten_context *ctx, size_t count, const batten_curve *const *contours,
                              const double *heights, const batten_loft_options *opt, loft_stack *out);
void loft_stack_free(batten_context *ctx, loft_stack *s);
batten_status loft_stack_note(batten_context *ctx, loft_stack *s, const batten_loft_note *note);
/* Inserts knots [count] (ascending, inside; folds as in loft_space_insert) into contour i, and its slopes. */
batten_status loft_stack_insert(batten_context *ctx, loft_stack *s, size_t i, size_t count, const double *knots,
                                const unsigned *folds);
/* Finds inflections and their partners, makes them knots, flat ones degree - 2 fold, ends the free zones of others by
 * knots; inserts knots until vertices turn by less than eq. 11 says and to the side to which the spans bend on which
 * they act (assumption 3). Progress phase "contours". Fails: NOMEM, TOO_LARGE, CANCELLED. */
batten_status loft_shape_prepare(batten_context *ctx, loft_stack *s, const batten_loft_options *opt);

batten_status loft_options_check(batten_context *ctx, const batten_loft_options *opt);

/* ---- patches and their vertices (slabs.c, vertices.c) -------------------------------------------- */

enum { LOFT_FREE = 0, LOFT_FLAT = 2 }; /* else a sign, +1 or -1 */

/* Patch i between contours i and i + 1. */
typedef struct loft_slab {
  loft_space space;
  double gap;          /* height */
  double *end[2];      /* [space.count][2] the control points of both contours on its knots */
  double *angle[2];    /* [legs] directions of the legs, unwrapped along the polygon, and between both by turns that
                          are least on the whole; NaN: the leg is 0 */
  double *length[2];   /* [legs] */
  signed char *wanted; /* [vertices] LOFT_FREE: only eq. 11; LOFT_FLAT: x'' = 0 there in all sections; +1, -1: the
                          turn keeps this sign [eq. 10] */
} loft_slab;

/* All count - 1 patches: spaces, ends. Fails: NOMEM, TOO_LARGE. */
batten_status loft_slabs_make(batten_context *ctx, const loft_stack *stack, loft_slab **out);
void loft_slabs_free(batten_context *ctx, size_t count, loft_slab *slabs);
/* Angles, lengths, wanted. */
batten_status loft_vertices_make(batten_context *ctx, const loft_stack *stack, size_t i, loft_slab *slab);
/* turn[e] at vertex v of end e: in (-pi, pi]; NaN beside legs of length 0. */
double loft_turn(const loft_slab *slab, unsigned end, size_t v);

/* ---- unknowns (net.c) ---------------------------------------------------------------------------- */

/* Control points of all patches, c = offset + Z y: row at(net, i, j, k) for c_(i, j, k), j < space.count, k = 0 .. n
 * of eq. 8. Rows of k = 0 and k = n are empty, their offsets are the contours. Both coordinates have the same Z; y is
 * [unknowns][2]. */
typedef struct loft_net {
  unsigned degree, smoothness; /* n, l */
  size_t slab_count;
  const loft_slab *slabs; /* the caller's */
  size_t *start;          /* [slab_count + 1] first row of each patch */
  loft_matrix z;
  double *offset;    /* [rows][2] */
  size_t equalities; /* unknowns that flat points took away */
} loft_net;
static inline size_t loft_at(const loft_net *net, size_t i, size_t j, unsigned k) {
  return net->start[i] + j * (net->degree + 1) + k;
}
/* Continuity is solved for: the free unknowns at contour i are the control points of the l derivatives by z there, in
 * the common space of both patches' knots. Where a flat point has a partner in one of the patches, these have x'' = 0
 * there. Fails: NOMEM, TOO_LARGE. */
batten_status loft_net_make(batten_context *ctx, const loft_stack *stack, const loft_slab *slabs, unsigned degree,
                            loft_net *out);
void loft_net_free(batten_context *ctx, loft_net *net);
/* control [z.rows][2] of y. */
void loft_net_expand(const loft_net *net, const double *y, double *control);

/* ---- objective (spiral.c, objective.c) ----------------------------------------------------------- */

/* Leg v of patch i at part zeta of its height: the spiral, its angle and radius linear in zeta. */
void loft_spiral(const loft_slab *slab, size_t v, double zeta, double q[2]);

/* F(y), see objective.c, has no unit: for each coordinate y'H y / 2 - right'y + constant, the same H. Legs count by 1
 * over their mean length at both contours (no less than a small part of the polygon): legs have the length of their
 * knot interval, so that this weighs x' evenly. The objective looks at net and its slabs as long as it lives. */
typedef struct loft_objective loft_objective;
batten_status loft_objective_new(batten_context *ctx, const loft_stack *stack, const loft_net *net,
                                 const batten_loft_options *opt, loft_objective **out);
void loft_objective_free(batten_context *ctx, loft_objective *o);
/* Its minimum y [unknowns][2]. Fails: SINGULAR, NOMEM, CANCELLED. */
batten_status loft_objective_minimum(batten_context *ctx, loft_objective *o, double *y);
/* x := H^-1 x, x [unknowns] of one coordinate. */
void loft_objective_solve(const loft_objective *o, double *x);
/* H, both triangles. */
batten_matrix loft_objective_hessian(const loft_objective *o);
double loft_objective_value(const loft_objective *o, const double *y);

/* ---- inequalities and programs (turns.c, rows.c, program.c, rounds.c) ---------------------------- */

/* What is asked of the turn at a vertex in all sections, radians: lower <= turn <= upper. */
typedef struct loft_bound {
  double lower, upper;
} loft_bound;
/* That turns keep their sign and the part `margin` of what both contours turn by at least, and stay below eq. 11, or
 * what the contours turn by if that is more. False: nothing is asked. */
bool loft_bound_of(const loft_slab *slab, size_t v, double margin, loft_bound *out);
/* Leg v of patch i, modulo the legs: its control points by zeta [degree + 1][2]. */
void loft_leg(const loft_net *net, const double *control, size_t i, size_t v, double (*out)[2]);
/* By how much the turn at a vertex of a surface misses its bound, at most; 0: it is proven to hold for all zeta. */
double loft_shortage(const loft_net *net, const double *control, size_t i, size_t v, const loft_bound *bound);

/* A separator: a direction by zeta that leg v stays on the one side of and leg v + 1 on the other, each by lower / 2
 * to upper / 2; on a part of the patch's height. */
enum { LOFT_FIELD = 4 }; /* its degree */
typedef struct loft_piece {
  size_t slab, vertex, group;
  double from, to;
  double w[LOFT_FIELD + 1][2]; /* Bernstein */
  loft_bound bound;
  double turn;   /* the smaller one of both contours, radians */
  double inside; /* by which inequalities are raised: what solvers leave shall be inside */
  uint64_t used; /* inequalities that are in the program */
} loft_piece;

typedef struct loft_pieces {
  size_t count, room;
  loft_piece *all; /* those of a vertex one after the other */
} loft_pieces;
void loft_pieces_free(batten_context *ctx, loft_pieces *p);

/* Directions of the legs of a patch, of which separators are made, at dyadic heights. Where the turns of the surface
 * do not hold they are moved, legs as evenly as may be, until they do. */
typedef struct loft_directions {
  size_t slab;
  unsigned depth; /* pieces may be 1 / 2^depth long */
  double *turned; /* [LOFT_FIELD 2^depth + 1][legs] against those that turn evenly from contour to contour */
  bool whole;     /* all turns hold by themselves */
} loft_directions;
batten_status loft_directions_make(batten_context *ctx, const loft_net *net, const double *control, size_t i,
                                   double margin, unsigned depth, loft_directions *out);
void loft_directions_free(batten_context *ctx, loft_directions *d);

/* Appends the pieces of vertex v: at least 2^least of them, and so many more (2^depth) that `control` satisfies their
 * inequalities; *strict: it does. Fails: NOMEM. */
batten_status loft_pieces_add(batten_context *ctx, const loft_net *net, const double *control,
                              const loft_directions *d, size_t v, double margin, unsigned least, size_t group,
                              loft_pieces *out, bool *strict);

/* Inequalities row . y >= lower over the 2 unknowns of net (unknown p of coordinate k is column 2 p + k), in radians
 * about, with the offsets taken off. */
typedef struct loft_rows {
  size_t columns, rows, row_room, entries, entry_room;
  size_t *starts;
  uint32_t *indices;
  double *values, *lower;
  size_t *group; /* [rows] vertices whose inequalities give way together */
} loft_rows;
void loft_rows_free(batten_context *ctx, loft_rows *r);
/* Inequalities that a vertex has for each piece. */
size_t loft_rows_each(const loft_net *net);
/* Where `control` satisfies an inequality of a piece by less than `below`: adds all of them that it satisfies by less
 * than `near` and that are not used yet, but for those that only say something of the contours. Fails: NOMEM. */
batten_status loft_rows_add(batten_context *ctx, const loft_net *net, const double *control, loft_piece *piece,
                            double below, double near, loft_rows *rows);

/* The minimum of the objective under rows, where the groups [groups] of them give way, by `give` radians, rather than
 * cost more than weight times `costs` for each. Unknowns are those near to the rows, `reach` steps in the Hessian.
 * Not the minimum but another point: BATTEN_W_ACCURACY. Fails: NOMEM, TOO_LARGE, CANCELLED. */
typedef struct loft_program {
  batten_qp_workspace *workspace;
  batten_matrix hessian;
  const double *free; /* [unknowns][2] the minimum without rows */
  double weight;
  unsigned reach;
  size_t iterations;
} loft_program;
batten_status loft_program_solve(batten_context *ctx, loft_program *p, const loft_rows *rows, size_t groups,
                                 const double *costs, double *y, double *give);

/* Where there is no solution: by how much the turn at a vertex fails. */
typedef struct loft_elastic {
  size_t slab, vertex;
  double amount; /* radians */
} loft_elastic;

typedef struct loft_result {
  double *y;     /* [unknowns][2], batten's */
  bool feasible; /* all inequalities around it hold */
  size_t elastic_count;
  loft_elastic *elastic; /* those that do not, largest first; batten's */
  size_t rows, rows_used, iterations;
  unsigned rounds;
  bool settled; /* the turns were settled: programs left vertices, or there were too many */
} loft_result;
/* From the minimum without inequalities (free [unknowns][2]): separators from the last surface, a program, and so on;
 * finer inequalities where these are too strict. Fails: NOMEM, TOO_LARGE (row_limit), CANCELLED. */
batten_status loft_rounds(batten_context *ctx, const loft_net *net, loft_objective *objective,
                          const batten_loft_options *opt, const double *free, double *seconds_rows,
                          double *seconds_qp, loft_result *out);
void loft_result_free(batten_context *ctx, loft_result *r);

/* From y, whose turns do not all hold, to a surface near the minimum of the objective in which they do; `free` the
 * minimum without inequalities. *steps more by those of Newton's method. *feasible: all turns are proven to hold.
 * Fails: NOMEM, TOO_LARGE, CANCELLED. */
batten_status loft_settle(batten_context *ctx, const loft_net *net, const loft_objective *objective, double margin,
                          const double *free, double *y, size_t *steps, bool *feasible);

/* ---- the handle (loft.c, measure.c) -------------------------------------------------------------- */

typedef struct loft_patch {
  size_t knot_count, count; /* in t: clamped, in the caller's domain */
  double *knots;
  double *control; /* [count][degree[1] + 1][2], caller's unit; closed: the last of count is the first */
} loft_patch;

struct batten_loft {
  batten_context *ctx;
  size_t contours;
  double *heights; /* [contours] caller's */
  unsigned degree[2], smoothness;
  bool closed;
  double domain[2];
  loft_patch *patches; /* [contours - 1] */
  size_t note_count;
  batten_loft_note *notes;
};

/* The handle of control points [net->z.rows][2]. Takes over copies of notes; heights are the caller's. The contours'
 * control points in it are the contours' to the last bit that scaling allows. Fails: NOMEM, TOO_LARGE. */
batten_status loft_make(batten_context *ctx, const loft_stack *stack, const loft_net *net, const double *heights,
                        const double *control, batten_loft **out);

/* Against the given curves at many t, in caller's unit: largest distance of the surface at the contours; and the
 * largest jump of derivatives by z up to the smoothness, k-th ones times the k-th power of the less of the gaps
 * beside. Fails: NOMEM. */
batten_status loft_measure(batten_context *ctx, const batten_loft *loft, const batten_curve *const *contours,
                           double *interpolation, double *continuity);

#endif
