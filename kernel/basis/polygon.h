/* Closed polygons in the plane that bound an area by even-odd: nesting, orientation, crossings, exact distances. */
#ifndef BATTEN_BASIS_POLYGON_H
#define BATTEN_BASIS_POLYGON_H

#include <batten/base.h>
#include <stdbool.h>

typedef struct polygon_set {
  batten_context *ctx;
  size_t count;    /* loops */
  size_t *starts;  /* [count + 1] */
  double *points;  /* [starts[count]][2]; the area lies on the left: outer loops counter-clockwise, holes clockwise;
                      no two neighbours equal, the first not repeated */
  size_t *given;   /* [count] number of the loop in what was given */
  size_t *parent;  /* [count] the loop directly around, SIZE_MAX = none */
  unsigned *depth; /* [count] even: outer, odd: hole */
  double lower[2], upper[2];
  double spacing;            /* median edge */
  double area;               /* holes subtract */
  struct polygon_tree *tree; /* of edges, for distances and for inside */
} polygon_set;

/* What is wrong with loops, for the caller's sentence. */
typedef struct polygon_fault {
  enum { POLYGON_SOUND = 0, POLYGON_CROSSING } kind;
  size_t loop[2]; /* as given; equal: with itself */
  size_t edge[2]; /* from point edge to the next, as given */
  double at[2];
} polygon_fault;

/* Loops [count]: starts [count + 1], points [..][2], finite. Neighbouring equal points become one, loops with fewer
 * than three points or |area| < min_area (>= 0) are left out: dropped [count] (NULL: not wanted) tells 1 for these.
 * Loops that cross or overlap along an edge (touching at a vertex is none): *fault is set, and the status INVALID
 * without a text, *out untouched. Crossings are found exactly (signs of determinants by mesh/predicates.h), in O(E
 * log E) for usual data. No loop left: OK with count = 0. */
batten_status polygon_set_make(batten_context *ctx, size_t count, const size_t *starts, const double *points,
                               double min_area, polygon_set *out, unsigned char *dropped, polygon_fault *fault);
void polygon_set_free(polygon_set *p); /* takes a zeroed struct too */

/* Signed distance to the loops, positive inside (even-odd); nearest [2], edge (index of its first point) may be NULL.
 * Sub-linear. Uses no context: workers may call it. */
double polygon_distance(const polygon_set *p, const double x[2], double *nearest, size_t *edge);
/* Distance to some loops only, unsigned: those with chosen[loop] != 0. INFINITY where none is chosen. */
double polygon_distance_to(const polygon_set *p, const unsigned char *chosen, const double x[2]);
bool polygon_inside(const polygon_set *p, const double x[2]);
/* Signed distance takes no value outside of [range[0], range[1]] in the box (rounding included). */
void polygon_distance_bounds(const polygon_set *p, const double lower[2], const double upper[2], double range[2]);
/* Do the areas of a component each (an outer loop and its holes) have a common point? share (may be NULL): common
 * area over the smaller of both, estimated from `samples` regular places in the smaller's box, INDEPENDENT of the
 * order of a and b. */
bool polygon_components_overlap(const polygon_set *a, size_t outer_a, const polygon_set *b, size_t outer_b,
                                double *share);
/* Area and centroid of a component. */
void polygon_component_measure(const polygon_set *p, size_t outer, double *area, double centroid[2]);

#endif
