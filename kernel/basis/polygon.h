/* Closed polygons in the plane that bound an area by even-odd: nesting, orientation, crossings, exact distances. */
#ifndef BATTEN_BASIS_POLYGON_H
#define BATTEN_BASIS_POLYGON_H

#include <batten/base.h>
#include <stdbool.h>

#include "mesh/box_tree.h"

/* Edges of all loops; edge i goes from point i to the next one of its loop. */
typedef struct polygon_tree {
  box_tree boxes;
  size_t *loop;   /* [edges] */
  double *leaves; /* [edges][4] ends of edge boxes.order[k] at k */
} polygon_tree;

/* A node of the tree, and its edges boxes.order[from .. to - 1]. */
typedef struct polygon_range {
  size_t node, from, to;
} polygon_range;

enum { POLYGON_STACK = 64 }; /* deep enough for a walk through any tree */

/* The children of a node with more than one edge. */
static inline void polygon_halves(polygon_range r, polygon_range half[2]) {
  size_t mid = (r.from + r.to) / 2;
  half[0] = (polygon_range){r.node + 1, r.from, mid};
  half[1] = (polygon_range){r.node + 2 * (mid - r.from), mid, r.to};
}

typedef struct polygon_set {
  batten_context *ctx;
  size_t count;    /* loops */
  size_t *starts;  /* [count + 1] */
  double *points;  /* [starts[count]][2]; the area lies on the left: outer loops counter-clockwise, holes clockwise;
                      no two neighbours equal, the first not repeated */
  size_t *given;   /* [count] number of the loop in what was given, increasing */
  size_t *parent;  /* [count] the loop directly around, SIZE_MAX = none */
  unsigned *depth; /* [count] even: outer, odd: hole */
  double lower[2], upper[2];
  double spacing;    /* median edge */
  double area;       /* holes subtract */
  polygon_tree tree; /* nothing when count = 0 */
} polygon_set;

/* What is wrong with loops, for the caller's sentence. */
typedef struct polygon_fault {
  enum { POLYGON_SOUND = 0, POLYGON_CROSSING } kind;
  size_t loop[2]; /* as given; equal: with itself */
  size_t edge[2]; /* from points[edge] as given to the next one */
  double at[2];
} polygon_fault;

/* Loops [count]: starts [count + 1], points [..][2], finite and below 1e150. Neighbouring equal points become one;
 * edges of a loop that run there and back between the same points are taken out, which may part it into several; what
 * has fewer than three points or |area| < min_area (>= 0) then is left out: dropped [count] (NULL: not wanted) tells 1
 * for loops of which nothing is left. Loops that cross or overlap along an edge (touching at a vertex is none, passing through another
 * loop at a vertex is): *fault is set, and the status INVALID without a text, *out untouched. Crossings are found
 * exactly (signs of determinants by mesh/predicates.h), in O(E log E) for usual data. No loop left: OK with count =
 * 0. Fails: INVALID, TOO_LARGE, NOMEM. */
batten_status polygon_set_make(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                               double min_area, polygon_set *out, unsigned char *dropped, polygon_fault *fault);
void polygon_set_free(polygon_set *p); /* takes a zeroed struct too */

/* Signed distance to the loops, positive inside (even-odd), -INFINITY without loops; nearest [2], edge (index of its
 * first point) may be NULL; of equally near edges the lowest. Sub-linear. Uses no context: workers may call it. */
double polygon_distance(const polygon_set *p, const double x[2], double *nearest, size_t *edge);
/* Distance to some loops only, unsigned: those with chosen[loop] != 0. INFINITY where none is chosen. */
double polygon_distance_to(const polygon_set *p, const unsigned char *chosen, const double x[2]);
/* The same with the nearest place [2], untouched where none is chosen. */
double polygon_nearest_to(const polygon_set *p, const unsigned char *chosen, const double x[2], double *nearest);
bool polygon_inside(const polygon_set *p, const double x[2]);
/* Signed distance takes no value outside of [range[0], range[1]] in the box (rounding included). */
void polygon_distance_bounds(const polygon_set *p, const double lower[2], const double upper[2], double range[2]);
/* Do the areas of a component each (an outer loop and its holes), b's moved by shift (NULL: not at all), have a
 * common point? share (may be NULL): common area over the smaller of both, counted on 64 x 64 regular places in the
 * smaller's box, so good to about 1 %; the same (but for rounding of the shift) when a and b are exchanged and the
 * shift is turned round. */
bool polygon_components_overlap(const polygon_set *a, size_t outer_a, const polygon_set *b, size_t outer_b,
                                const double *shift, double *share);
/* Of points [count][2], positive where they run counter-clockwise. */
double polygon_loop_area(size_t count, const double *points);
/* Area and centroid of a component. */
void polygon_component_measure(const polygon_set *p, size_t outer, double *area, double centroid[2]);

#endif
