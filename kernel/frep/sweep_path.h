/* Paths of sweeps: pieces of a C2 cubic spline or of a polyline, and frames that turn with them as little as can be.
 */
#ifndef BATTEN_FREP_SWEEP_PATH_H
#define BATTEN_FREP_SWEEP_PATH_H

#include <batten/base.h>
#include <stdbool.h>

/* All places are relative to path->base. u runs through [0, 1] in a piece, t = start + span u through the path. */
typedef struct sweep_piece {
  double b[4][3];         /* Bezier points */
  double low[3], high[3]; /* of them */
  double start, span;
  double length, turn; /* of the Bezier polygon: the curve's are no more */
  double slow, fast;   /* |do/du| lies between */
  double bend;         /* |d2o/du2| at most */
  double second[2][3]; /* d2o/du2 at u = 0 and 1, linear between */
  double plane[6][3],
      offset[6]; /* h(u) = o'(u) . (x - o(u)) has the Bernstein coefficients plane . (x - b0) - offset */
} sweep_piece;

typedef struct sweep_node {
  double o[3], tangent[3], axis[3]; /* axis: the profile's x; its y is tangent x axis */
} sweep_node;

enum { SWEEP_RUN = 8 /* pieces of a run */ };

/* So many pieces one after the other, to be passed over at once where no plane across them comes near. */
typedef struct sweep_run {
  double middle[3], radius;  /* a ball that holds them */
  double tangent[3], spread; /* unit vectors along them differ from it by at most so much */
} sweep_run;

typedef struct sweep_path {
  batten_context *ctx;
  bool smooth, closed;
  size_t pieces;
  sweep_piece *piece; /* [pieces] */
  sweep_node *node;   /* [pieces + 1]; of polylines [k] has the frame of piece k */
  sweep_run *run;     /* of smooth paths with frames: [pieces / SWEEP_RUN, rounded up], else NULL */
  double base[3], total;
  double spin; /* of the frame, beyond that of least turning, by t: closes smooth closed paths */
} sweep_path;

/* points [count][3], checked here ("path[i]: ..."). framed: with frames from up (NULL: any), and pieces that turn
 * little; else at least `least` pieces. */
batten_status sweep_path_make(batten_context *ctx, size_t count, const double *points, bool smooth, bool closed,
                              bool framed, const double *up, size_t least, sweep_path **out);
void sweep_path_free(sweep_path *path);

/* o, do/du, d2o/du2; each may be NULL. */
void sweep_piece_at(const sweep_piece *p, double u, double *o, double *slope, double *bend);
/* Axes x and y of the profile at u, spin included. */
void sweep_frame_at(const sweep_path *path, size_t piece, double u, double axes[2][3]);
/* Hull of all Bezier points. */
void sweep_path_box(const sweep_path *path, double *lower, double *upper);

/* The first piece from `piece` on that may have a root for a place within `half` of x (relative), or `pieces`. Smooth
 * paths with frames. */
size_t sweep_next_near(const sweep_path *path, size_t piece, const double *x, double half);
/* The t at which the plane across the path passes through x (relative), as piece and u; ordered. Returns how many; at
 * most 5 a piece. */
size_t sweep_roots(const sweep_path *path, size_t piece, const double *x, double roots[5]);

#endif
