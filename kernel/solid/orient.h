/* Inside of batten_orient: the parts that orient.c puts together.
 *
 * All points here are in the unit size: centroid 0, twice the root mean square distance from it 1 (a sphere of
 * diameter 1). It turns with the data, unlike a box, so that rotated data give the same normals. */
#ifndef BATTEN_SOLID_ORIENT_H
#define BATTEN_SOLID_ORIENT_H

#include <batten/solid.h>
#include <stdbool.h>

/* What the neighbourhoods say, without any sign. */
typedef struct batten_orient_graph {
  unsigned n;
  size_t count, k;      /* k nearest other points of each point */
  const double *points; /* [count][n], not owned */
  size_t *index;        /* [count][k], nearest first */
  double *distance;     /* [count][k] */
  double *plane;        /* [count][n] unit normal of the plane (line) through the neighbours, sign arbitrary */
  double *flatness;     /* [count] 1 on a plane, 0 where no direction is thinner than the next */
} batten_orient_graph;

/* count >= 2. On failure nothing is held. */
batten_status batten_orient_graph_new(batten_context *ctx, unsigned n, size_t count, const double *points,
                                      batten_orient_graph *graph);
void batten_orient_graph_free(batten_context *ctx, batten_orient_graph *graph);

/* How well normals u at a and v at b fit to one smooth surface, in [-1, 1]: v reflected in the bisector plane of a
 * and b, times u. It is 1 where a circle through both points has the normals u and v, whatever the angle that it
 * turns through; also where a and b face each other across a thin wall or a narrow gap and the normals oppose. -1:
 * the same with one of them turned round. About 0: nothing can be said. */
double batten_orient_agreement(unsigned n, const double *a, const double *b, const double *u, const double *v);

/* Area (length) that point i stands for: its share of the disk that holds it and its neighbours. */
double batten_orient_area(const batten_orient_graph *graph, size_t i);

/* What speaks against normals: roughness in [0, 1], the mean of (1 - agreement) / 2 over the neighbour pairs, plus
 * openness in [0, 1], |sum of area_i normal_i| / sum of area_i. Right normals of closed surfaces have 0.01 to 0.25
 * (noise, edges), random ones 0.5, a wall taken for one sheet 1. */
double batten_orient_doubt(const batten_orient_graph *graph, const double *normals);

/* Labels piece[i] < return value: points joined by neighbour pairs whose normals agree by more than `threshold`.
 * Numbered by their lowest point. */
size_t batten_orient_pieces(const batten_orient_graph *graph, const double *normals, double threshold, size_t *piece);

/* Sum over fixed directions of (normal at the extreme point) . direction: positive when normals look outwards. Of the
 * points members[0 .. count), or of all count points where members is NULL. */
double batten_orient_outwardness(unsigned n, const double *points, const double *normals, size_t count,
                                 const size_t *members);

/* normals [count][n] from the planes alone: see orient_planes.c. */
batten_status batten_orient_planes(batten_context *ctx, const batten_orient_graph *graph, double *normals);
/* The Hermite spline that least energy ends with, about the point `middle`:
 * f(y) = sum a_i phi(y - y_i) - sum b_i . grad phi(y - y_i) + c0 + c . y,  y = x - middle,  phi(y) = |y|^3; positive
 * outside. */
typedef struct batten_orient_field {
  unsigned n;
  size_t count;
  double middle[3];
  double *points;  /* [count][n] y_i */
  double *a, *b;   /* [count], [count][n] */
  double c[3];     /* linear part; c0 plays no role in gradients */
  double *normals; /* [count][n] gradients at the points: unit, outward */
  double lambda;   /* smoothing at which it was settled, unit size */
} batten_orient_field;

/* Least energy over all points of the graph, which must be pairwise distinct: see orient_energy.c. start [count][n]
 * is one of the starts. *field is empty on failure. Fails: SINGULAR, NOMEM, TOO_LARGE, CANCELLED. */
batten_status batten_orient_energy(batten_context *ctx, const batten_orient_graph *graph, const double *start,
                                   batten_orient_field *field);
void batten_orient_field_free(batten_context *ctx, batten_orient_field *field);
/* gradients [count][n] of f at points [count][n]. */
void batten_orient_field_gradients(batten_context *ctx, const batten_orient_field *field, size_t count,
                                   const double *points, double *gradients);

#endif
