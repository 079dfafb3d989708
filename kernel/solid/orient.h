/* Inside of batten_orient: the parts that orient.c puts together.
 *
 * All points here are in the unit size: centroid 0, twice the root mean square distance from it 1 (a sphere of
 * diameter 1). It turns with the data, unlike a box, so that rotated data give the same normals. */
#ifndef BATTEN_SOLID_ORIENT_H
#define BATTEN_SOLID_ORIENT_H

#include <batten/solid.h>
#include <stdbool.h>

#include "base/neighbours.h"

/* What the neighbourhoods say, without any sign. */
typedef struct batten_orient_graph {
  unsigned n;
  size_t count, k;      /* k nearest other points of each point */
  const double *points; /* [count][n], not owned */
  size_t *index;        /* [count][k], nearest first */
  double *distance;     /* [count][k] */
  double *plane;        /* [count][n] unit normal of the plane (line) through the neighbours, sign arbitrary */
  double *flatness;     /* [count] 1 on a plane, 0 where no direction is thinner than the next */
  double *surface;      /* [count][n] the points; where noise asked for a wider plane, moved onto it */
  double *area;         /* [count] area (length) that a point stands for; 0: a stray, see orient_strays.c */
  size_t strays;
} batten_orient_graph;

/* count >= 2. adapt: planes go through more points where there is noise, fewer where walls are thin; for dense
 * samples. part: of the work done, for the host. On failure nothing is held. */
batten_status batten_orient_graph_new(batten_context *ctx, unsigned n, size_t count, const double *points, bool adapt,
                                      double part, batten_orient_graph *graph);
void batten_orient_graph_free(batten_context *ctx, batten_orient_graph *graph);

/* How well normals u at a and v at b fit to one smooth surface, in [-1, 1]: v reflected in the bisector plane of a
 * and b, times u. It is 1 where a circle through both points has the normals u and v, whatever the angle that it
 * turns through; also where a and b face each other across a thin wall or a narrow gap and the normals oppose. -1:
 * the same with one of them turned round. About 0: nothing can be said. */
double batten_orient_agreement(unsigned n, const double *a, const double *b, const double *u, const double *v);

/* Neighbours and planes of the graph: see orient_local.c. tree: of its points. */
batten_status batten_orient_fit_planes(batten_context *ctx, const batten_tree *tree, bool adapt, double part,
                                       batten_orient_graph *graph);
/* Finds points that lie off the surface: see orient_strays.c. Their area becomes 0. */
batten_status batten_orient_find_strays(batten_context *ctx, batten_orient_graph *graph);

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

/* The ties between neighbours and the trees that they make: see orient_forest.c. */
typedef struct batten_orient_forest {
  size_t count;           /* ties, the firmest first; those of strays come last */
  size_t next;            /* the first that has not been looked at */
  size_t *ties;           /* [count] i * k + q: the tie of i to its q-th neighbour */
  unsigned short *weight; /* [count of points * k] see orient_forest.c */
  size_t *parent;         /* [points] */
  unsigned char *turned;  /* [points] whether the sign is opposite to the parent's */
  unsigned char *rank;    /* [points] */
  double *sum, *total;    /* [points][3], [points]: signed area and area below a root */
} batten_orient_forest;

/* Every point a tree of its own, the ties sorted. On failure nothing is held. */
batten_status batten_orient_forest_new(batten_context *ctx, const batten_orient_graph *graph,
                                       batten_orient_forest *forest);
/* Every point a tree of its own again. */
void batten_orient_forest_plant(const batten_orient_graph *graph, batten_orient_forest *forest);
void batten_orient_forest_free(batten_context *ctx, batten_orient_forest *forest);
/* Joins trees along ties of weight (0 .. 1) <= loosest. Ties that are more than 0.7 loose do not join two
 * that are closed already. part: of the work done, for the host. */
batten_status batten_orient_forest_join(batten_context *ctx, const batten_orient_graph *graph,
                                        batten_orient_forest *forest, double loosest, double part);
/* The tree of point i; *opposed: whether its plane's sign is opposite to the root's. */
size_t batten_orient_forest_root(batten_orient_forest *forest, size_t i, bool *opposed);
/* Makes one tree of those of i and j, in which the planes' signs of i and j are opposed or not. */
void batten_orient_forest_tie(batten_orient_forest *forest, size_t i, size_t j, bool opposed);

/* normals [count][n] from the planes alone: see orient_planes.c. */
batten_status batten_orient_planes(batten_context *ctx, const batten_orient_graph *graph,
                                   batten_orient_forest *forest, double *normals);
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
/* gradients [count][n] of f at points [count][n]. CANCELLED. */
batten_status batten_orient_field_gradients(batten_context *ctx, const batten_orient_field *field, size_t count,
                                            const double *points, double *gradients);

/* At most *found points of the graph that are no strays, each the farthest from those before it, the first the
 * farthest from the centroid; none twice. The graph's points stand in a tree's order. chosen [*found], distance
 * [count] of work. *found becomes how many there are. */
batten_status batten_orient_spread(batten_context *ctx, const batten_orient_graph *graph, size_t *found,
                                   size_t *chosen, double *distance);

/* Signs of the pieces of a surface by Gauss's formula: see orient_gauss.c.
 *   normals  [count][n] whose signs agree within a piece
 *   piece    [count] which piece a point belongs to, SIZE_MAX: to none
 *   votes    [pieces] area that speaks for the normals' own sign less what speaks against
 *   planes   [pieces] the same by another way: only a start
 *   signs    [pieces] out: +1 or -1
 *   margin   [pieces] out: by how much the misfit grows when a piece is turned, over its area: 0 undecided, 1 sure */
batten_status batten_orient_gauss(batten_context *ctx, const batten_orient_graph *graph, const double *normals,
                                  const size_t *piece, size_t pieces, const double *votes, const double *planes,
                                  signed char *signs, double *margin);

/* Normals from sure pieces of the surface, their signs by Gauss's formula, and from gradients [count][n] of a field,
 * which become the normals: see orient_refine.c. forest: planted; planes [count][n]: normals by planes. *doubtful:
 * points whose sign is not sure. False in *done: there are no sure pieces; nothing was changed. */
batten_status batten_orient_refine(batten_context *ctx, const batten_orient_graph *graph,
                                   batten_orient_forest *forest, const double *planes, double *gradients,
                                   size_t *pieces, size_t *doubtful, bool *done);

#endif
