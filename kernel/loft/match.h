/* What the parts of batten_loft_match say to each other.
 *
 * match.c             the public call: checks, fits, figures
 * match_align.c       slices that run alike and begin where their neighbours begin
 * match_tracks.c      inflections, followed through slices
 * match_positions.c   one parameter for each track
 * match_parameters.c  parameters of points: smooth monotone functions of the length that lead tracks there
 * match_breaks.c      one set of knots */
#ifndef BATTEN_LOFT_MATCH_H
#define BATTEN_LOFT_MATCH_H

#include <batten/loft.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define MATCH_NONE ((size_t)-1)

/* An inflection of a slice. */
typedef struct match_bend {
  double at;              /* part of the slice's length */
  double place[2], angle; /* from the slice's middle; direction of the tangent there */
  int sign;               /* of the curvature after it */
  size_t before, after;   /* its partners in the neighbouring slices, or MATCH_NONE */
  size_t track;
  double lift; /* closed: whole turns; at + lift of a track are near to each other and to its t */
} match_bend;

typedef struct match_slice {
  size_t count;
  size_t *from;             /* [count] number of the caller's point, ascending but for its way and start */
  double *points, *weights; /* [count][2]; weights NULL = ones */
  double *lengths;          /* [count] parts of the length from the slice's start, not decreasing, in [0, 1] */
  double *parameters;       /* [count] in [0, 1], not decreasing once match_parameters has run */
  double middle[2], radius; /* of the line; root mean square distance from it */
  bool reversed;
  int sign; /* of the curvature at the start */
  size_t bend_count;
  match_bend *bends; /* [bend_count] ascending */
} match_slice;

/* Tracks are numbered; those that never meet may share a line, and lines have t. */
typedef struct match_stack {
  bool closed;
  size_t count;
  match_slice *slices;
  size_t track_count;
  size_t *first, *last; /* [track_count] slices */
  size_t *line;         /* [track_count] */
  size_t line_count;
  double *t;     /* [line_count] ascending, inside (0, 1) */
  double origin; /* closed: about the part of the length at t = 0 */
} match_stack;

/* Distance in t that lines keep, from each other and from 0 and 1. */
static inline double match_gap(size_t lines) { return fmin(0.01, 0.5 / (double)(lines + 1)); }

/* Copies, turns and rotates the caller's slices, which have been checked. Fails: INVALID (names slice), NOMEM. */
batten_status match_align(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                          const batten_loft_match_options *opt, match_stack *out);
void match_stack_free(batten_context *ctx, match_stack *s);

/* Fills in bends and tracks. features false: each inflection is a track of its own. Fails: NOMEM, CANCELLED. */
batten_status match_tracks(batten_context *ctx, const batten_loft_match_options *opt, match_stack *s);

/* Fills in lines, their t, and the origin. Fails: NOMEM, CANCELLED. */
batten_status match_positions(batten_context *ctx, match_stack *s);

/* Fills in parameters; points and what belongs to them go round so that these ascend. Fails: NOMEM. */
batten_status match_parameters(batten_context *ctx, match_stack *s);

/* Inflections of slice i by t, [bend_count] ascending in [0, 1], and the sign at the start. */
void match_inflections(const match_stack *s, size_t i, double *inflections, int *sign);

/* How densely slices ask for breaks, batten's: handed to match_breaks. Fails: NOMEM, TOO_LARGE, CANCELLED. */
batten_status match_density(batten_context *ctx, const match_stack *s, const batten_contour_options *fit,
                            double **density);
/* Inner breaks [*count] of all slices, the lines among them, batten's; crowding >= 1: so many times more than slices
 * ask for. Fails: NOMEM. */
batten_status match_breaks(batten_context *ctx, const match_stack *s, const batten_contour_options *fit,
                           const double *density, double crowding, size_t *count, double **breaks);

/* The text of a failure in slice i, told as that. */
batten_status match_fail_in(batten_context *ctx, size_t i, batten_status st);

#endif
