/* The map of kernel/section, and what its parts say to each other.  [Savchenko et al. 1995, section 4]
 *
 * stack.c        batten_stack_build: the order of things; the handle, its parts
 * options.c      defaults and ranges
 * input.c        sections as they come: what makes no sense, frames made orthonormal, loops -> stack
 * release.c      a stack given back
 * section_fit.c  one section's function: greedy choice of centres; points and carriers as batten_solid_fit does
 * fit_all.c      all sections, on the context's threads
 * section.c      batten_section_fit: the function of one section alone
 * places.c       places along the loops and beside them, for the fit and for the proof
 * certify.c      does a section's function have the sign of its polygons, and how far does it miss them
 * prove.c        the sign, proven over boxes
 * local_field.c  F over a box: far centres expanded about it, near ones bounded (local_field.h)
 * components.c   outer loops with their holes, which overlap from section to section, pieces, notes
 * links.c        components without a partner joined in sheared frames
 * crossings.c    pairs of sections whose planes cross within both
 * space.c        one volume spline through the centres of all sections
 *
 * weights.c      one-dimensional blends between sections
 * blend.c        F(x, y, t): section functions scaled, saturated and blended, in batches
 * blend_bounds.c bounds of it over boxes
 * ends.c         what closes the solid at its first and last section
 * parallel.c     f in space where planes are parallel
 * rotations.c    exponentials, logarithms, splines of rotations; integration of angular velocity
 * path.c         the moving frame M(t), o(t), its derivatives, and bounds of its motion (path.h)
 * swept.c        f in space where planes are not parallel: the t of a point
 * swept_bounds.c bounds of it over boxes
 * frames.c       batten_stack_frames
 *
 * All in the caller's unit. */
#ifndef BATTEN_SECTION_INNER_H
#define BATTEN_SECTION_INNER_H

#include <batten/stack.h>
#include <stdbool.h>
#include <stdint.h>

#include "basis/interval.h"
#include "basis/polygon.h"
#include "solid/solid_form.h"

typedef struct stack_section {
  double origin[3], rotation[3][3]; /* rows: x and y axis, normal */
  double t, scale, saturation;      /* INFINITY: none */
  polygon_set loops;                /* count 0 at an apex and in sections of points in no order (then: function) */
  unsigned apex_count;              /* 0, or 1 or 2 points in which the solid ends */
  double apex[2][2];
  batten_solid *function; /* n = 2; NULL at an apex, whose function is -(distance to apex) */
} stack_section;

/* One blend's knots and what can be made of them beforehand (weights.c). */
typedef struct stack_weights stack_weights;
/* The moving frame (path.c). */
typedef struct stack_path stack_path;

/* A stack: the state of its solid. Filled in this order: input (ctx, count, sections but function), options, gaps;
 * fit (functions); links; stack_prepare (the rest). */
typedef struct stack {
  batten_context *ctx;
  size_t count;
  stack_section *sections; /* [count] */
  batten_stack_between between;
  double shape;
  batten_stack_end ends[2];
  double end_lengths[2]; /* H */
  batten_stack_rotation rotation;
  batten_stack_path path_kind;
  batten_stack_parameter parameter;
  double *angular_velocity; /* [count][3] or NULL */
  size_t link_count;
  batten_stack_link *links; /* by section */
  bool parallel; /* normals agree to 1e-9, and so do the x axes: frames are but shifted. t is the height then, over
                    base = origin of the first section along its normal, if no parameters are given */
  double spacing, gap; /* medians */
  /* made by stack_prepare */
  stack_weights *weights;
  stack_path *path; /* NULL when parallel */
  double
      *end_peak[2]; /* rho of the components of the end sections [loops.count], by outer loop; NULL unless ROUNDED */
  double end_apart[2]; /* half of the smallest distance between those components, INFINITY where there is one */
} stack;

/* ---- input.c ------------------------------------------------------------------------------------- */

/* Checks and takes over; tolerance, spacing, gap are settled; notes DROPPED. *out zeroed before; stack_free takes it
 * whatever has failed. */
typedef struct stack_notes {
  batten_context *ctx;
  size_t count, capacity;
  batten_stack_note *items;
} stack_notes;
batten_status stack_note_add(stack_notes *notes, batten_stack_note note); /* NOMEM */
batten_status stack_check_options(batten_context *ctx, size_t count, const batten_stack_options *opt);
/* opt->method POINTS and CARRIER: contours of a section are taken together as points in no order: loops stay empty,
 * points [starts..] are for the fit to read from the caller's sections. */
batten_status stack_take_sections(batten_context *ctx, size_t count, const batten_section *sections,
                                  const batten_stack_options *opt, stack *out, stack_notes *notes);
/* How far curves may miss: as given, or what stands for 0; after stack_take_sections. */
double stack_tolerance(const stack *s, const batten_stack_options *opt);
void stack_release(stack *s); /* all that hangs on it, not s itself (release.c) */

/* ---- section_fit.c, fit_all.c, certify.c, prove.c ---------------------------------------------------- */

typedef struct section_figures {
  size_t centers;
  double residual_max;   /* of the curve against the polygon's points: |F| / |grad F| */
  double wrong_sign_max; /* deepest wrong sign */
  bool certified;        /* of loops: proven, see section_prove */
  batten_status status;  /* BATTEN_OK or a warning */
} section_figures;

/* One function from loops; ctx may be a context of a task's own. pair_distance as in the options, tolerance > 0. */
batten_status section_fit_loops(batten_context *ctx, const polygon_set *loops, double tolerance, double pair_distance,
                                batten_solid **out, section_figures *figures);
/* From points in no order, [count][2]: POINTS or CARRIER. */
batten_status section_fit_points(batten_context *ctx, batten_section_method method, size_t count,
                                 const double *points, batten_solid **out, section_figures *figures);
/* The same, proven by section_certify, whose figures are filled: as long as it finds places of wrong sign, and not
 * too often, they become centres of another fit. The best of them is left. */
batten_status section_fit_proven(batten_context *ctx, const polygon_set *loops, double tolerance,
                                 double pair_distance, batten_solid **out, section_figures *figures);

enum { SECTION_WRONG_MAX = 64 };
/* Places at which F has a wrong sign or is too near to 0 for a proof, the deepest, most of them some way apart; count
 * 0, depth 0 to begin with. */
typedef struct section_wrong {
  size_t count;
  double depth; /* of the deepest wrong sign */
  double places[SECTION_WRONG_MAX][2], depths[SECTION_WRONG_MAX];
} section_wrong;
void section_add_wrong(section_wrong *wrong, const double *x, double depth);

/* The judge, which knows nothing of the fit. certified: section_prove says so. wrong_sign_max: the deepest wrong sign
 * that was found, at a grid, at places beside the loops and far away, or by section_prove: never above the tolerance
 * when certified, but it may be below it, when a box is not settled and nothing wrong is found in it. residual_max:
 * |F| / |grad F| at the points of the loops. wrong (NULL: not wanted) is filled. */
batten_status section_certify(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                              double tolerance, section_figures *figures, section_wrong *wrong);
/* *proven: F has, farther than 17/16 tolerances from the loops and out to 100 half diagonals along x and y, the sign
 * of the signed distance: every box of a quadtree is settled by bounds of both; and no place was seen to be wrong
 * that is deeper than the tolerance. Places seen to be wrong are added to wrong. False also where two million boxes
 * do not do, and for functions that are no plain splines with r^2 ln r. */
batten_status section_prove(batten_context *ctx, const polygon_set *loops, const batten_solid *function,
                            double tolerance, bool *proven, section_wrong *wrong);
/* All sections without apex; figures [count]. Errors name the section ("sections[3]: ..."). */
batten_status stack_fit_all(batten_context *ctx, stack *s, const batten_section *given,
                            const batten_stack_options *opt, double tolerance, section_figures *figures);

/* ---- components.c, links.c, crossings.c, space.c -------------------------------------------------- */

/* Overlaps of components of neighbouring sections, in the places that both have in common (stack_shift): notes
 * NO_OVERLAP, THIN; pieces of the graph, 0 where no section has loops. Sections without loops (apexes, points in no
 * order) count for nothing. Where link: a component without a partner is joined to the nearest of the other section
 * if that belongs to another piece (else it is the end of a lobe): s->links is filled, sorted by section, and notes
 * say LINKED; non_overlaps counts these sides too. */
batten_status stack_find_components(batten_context *ctx, stack *s, bool link, stack_notes *notes, size_t *pieces,
                                    size_t *non_overlaps);
/* What the links of section `at` (between it and the next) add at places [count][2] of the stack with u = (t - t_at)
 * / (t_next - t_at) in [0, 1]: values becomes max(values, links), gradients [count][3] (d/dx, d/dy, d/du) likewise;
 * may be NULL. On the planes themselves, u = 0 and u = 1, nothing is changed: links are never above the scaled,
 * saturated F_at and F_next there. */
batten_status stack_link_evaluate(const stack *s, batten_context *ctx, size_t at, size_t count, const double *places,
                                  const double *u, double *values, double *gradients);
/* Bounds of it over boxes [count][2][3] (x, y, u; u may go beyond [0, 1], where there are no links): ranges
 * [count][2] of the values without links become those with them. */
batten_status stack_link_bounds(const stack *s, batten_context *ctx, size_t at, size_t count, const double *boxes,
                                double *ranges);
/* Pairs of sections whose planes cross in a line of which a part lies in the convex hulls of both: notes CROSSING,
 * section before other, contour SIZE_MAX. */
batten_status stack_find_crossings(batten_context *ctx, const stack *s, stack_notes *notes, size_t *crossings);
/* One solid in space through the centres of all sections' functions, which must be there. ordered: the points were
 * contours; else their loops, if any, were traced, and pair_distance says where values stand beside the points.
 * Returns BATTEN_W_ACCURACY as batten_spline_fit. */
batten_status stack_fit_space(batten_context *ctx, const stack *s, bool ordered, double pair_distance,
                              batten_solid **out, size_t *centers);

/* ---- weights.c ------------------------------------------------------------------------------------ */

enum {
  STACK_WINDOW = 34
}; /* most sections that count at a place: natural splines' weights fall by 0.268 a section */

batten_status stack_weights_make(batten_context *ctx, batten_stack_between between, double shape, size_t count,
                                 const double *t, stack_weights **out);
void stack_weights_free(stack_weights *w);
/* Sections first .. first + return - 1 count at t in [t_0, t_last]. */
size_t stack_window(const stack_weights *w, double t, size_t *first);
/* f [the window]: value and df/dt of the blend, and weights [the window]: its derivatives by f. At t = t_i exactly
 * f_i. */
double stack_weigh(const stack_weights *w, double t, const double *f, double *dt, double *weights);
/* Bounds over [t0, t1] from those of the sections first .. first + count - 1 of all windows there. */
interval stack_weigh_bounds(const stack_weights *w, double t0, double t1, size_t first, const interval *f);

/* ---- blend.c, ends.c, parallel.c ------------------------------------------------------------------ */

/* Where section i lies in the x, y of places: 0 where planes are not parallel and the frame moves with t; in parallel
 * stacks, whose x and y are measured from the origin of the first section, how far its origin is from there across
 * the normal. The function of section i is asked at (x, y) - shift; so are links. */
void stack_shift(const stack *s, size_t i, double shift[2]);
/* What is blended: w tanh(scale F / w) of F, a value of the section's function; *slope: its derivative by F. */
double stack_shape(const stack_section *section, double f, double *slope);
/* Of one section, shaped so, at places [count][2] (x, y of the stack, not of the section); gradients [count][2] or
 * NULL. At an apex: minus the distance to it. */
batten_status stack_section_evaluate(const stack *s, batten_context *ctx, size_t i, size_t count,
                                     const double *places, double *values, double *gradients);
/* Bounds of it over boxes [count][2][2], ranges [count][2]. */
batten_status stack_section_bounds(const stack *s, batten_context *ctx, size_t i, size_t count, const double *boxes,
                                   double *ranges);
/* F at places [count][3] = x, y in the stack's frame, t in [t_0, t_last]; gradients [count][3] by x, y, t, or NULL.
 * Links included, ends not. In batches over the sections, so that a section's function is asked once for many places.
 */
batten_status stack_blend(const stack *s, batten_context *ctx, size_t count, const double *places, double *values,
                          double *gradients);
/* boxes [count][2][3], lower and upper (x, y, t), t in [t_0, t_last]. */
batten_status stack_blend_bounds(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges);
/* The rule of an end (0 first, 1 last), at (x, y) of its section and `beyond` its plane (negative: inside of it,
 * where rules that bound the solid from above still count). value, gradient (by x, y, beyond; may be NULL): of the
 * blend with t at the end on entry, under the rule on return. */
void stack_end_apply(const stack *s, unsigned end, const double *x, double beyond, double *value, double *gradient);
interval stack_end_bounds(const stack *s, unsigned end, interval value, interval beyond);
/* rho of ROUNDED; after the functions are there. */
batten_status stack_end_prepare(batten_context *ctx, stack *s);
batten_status stack_parallel_evaluate(const stack *s, batten_context *ctx, size_t count, const double *points,
                                      double *values, double *gradients);
batten_status stack_parallel_bounds(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                    double *ranges);

/* ---- rotations.c, path.c, swept.c ------------------------------------------------------------------ */

/* The frame at t: rows of rotation as in batten_section, and derivatives by t; t outside of the sections is held at
 * the ends. */
typedef struct stack_frame {
  double origin[3], rotation[3][3], d_origin[3], d_rotation[3][3];
} stack_frame;
batten_status stack_path_make(batten_context *ctx, const stack *s, stack_path **out);
void stack_path_free(stack_path *p);
void stack_path_frame(const stack_path *p, double t, stack_frame *out);
double stack_path_drift(const stack_path *p);
batten_status stack_swept_evaluate(const stack *s, batten_context *ctx, size_t count, const double *points,
                                   double *values, double *gradients);
batten_status stack_swept_bounds(const stack *s, batten_context *ctx, size_t count, const double *boxes,
                                 double *ranges);

/* ---- stack.c -------------------------------------------------------------------------------------- */

extern const solid_form stack_form;

#endif
