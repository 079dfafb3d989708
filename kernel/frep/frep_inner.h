/* The map of kernel/frep, and what its parts say to each other.
 *
 * frep.c         nodes: making, sharing, evaluating in batches, bounds
 * frep_parts.c   the list of all kinds: names, parts, making from parts
 * leaves.c       ball, cone, gyroid
 * leaves_given.c carriers, solids, polygon
 * combine.c      R-functions, min and max, blends, negation, morph
 * distance.c     normalize, offset, shell
 * noise.c        solid noise
 * gather.c       nodes whose value is that of a child elsewhere: maps, extrusions, sweeps of profiles
 * highest.c      the largest value of a child along a track of places: shadows, sweeps
 * dimension.c    extrude, revolve, section
 * project.c      project
 * sweep.c        sweeps along paths: of solids
 * sweep_profile.c  of profiles; sweep_path.c, sweep_roots.c: paths, and their planes through a point
 * map.c          affine
 * axis_frame.c   frames about an axis, for the maps that follow
 * axis_maps.c    twist, taper
 * bend.c         bend
 * deform.c       displaced points
 * frep_box.c     the box of a tree
 * frep_solid.c   a tree as a solid
 *
 * A kind of node is a row of functions (frep_class); no file knows the kinds of another. */
#ifndef BATTEN_FREP_INNER_H
#define BATTEN_FREP_INNER_H

#include <batten/frep.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "basis/interval.h"

enum {
  FREP_DEPTH = 128,    /* most levels of a tree: bounds the recursion */
  FREP_BLOCK = 4096,   /* points that go through a tree at a time: leaves thread themselves over so many */
  FREP_NODES = 1 << 20 /* most nodes that an evaluation passes, shared ones as often as they stand in the tree */
};

typedef struct frep_class {
  batten_frep_kind kind;
  const char *name; /* in scenes */
  /* count <= FREP_BLOCK points; values never NULL, gradients NULL when not wanted. Children by frep_evaluate_block.
   */
  batten_status (*evaluate)(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                            double *values, double *gradients);
  /* count <= FREP_BLOCK boxes. Children by frep_bounds_block. */
  batten_status (*bounds)(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                          double *ranges);
  /* Upper bounds of |grad f| over count <= FREP_BLOCK boxes, INFINITY where none is known: what a first-order
   * distance needs of the node below it. Children by frep_slopes_block. NULL: 1 where the node is a distance, else
   * what `both` tells, else INFINITY. */
  batten_status (*slopes)(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                          double *slopes);
  /* Both at once, where that is cheaper or tells more: ranges as bounds, slopes [count][2] with lower bounds of |grad
   * f| too. NULL: bounds and slopes, and 0. */
  batten_status (*both)(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes, double *ranges,
                        double *slopes);
  /* A finite box that holds f >= 0 if the structure tells one, from those of the children: false = none known.
   * lower, upper [n]; lower > upper: the structure tells that there is nothing. Used as a start, then tightened by
   * bounds. */
  bool (*box)(const batten_frep *a, double *lower, double *upper);
  /* From parts: calls the constructor. */
  batten_status (*create)(batten_context *ctx, const batten_frep_parts *parts, batten_frep **out);
  void (*release)(void *state); /* NULL: state is a plain block */
} frep_class;

struct batten_frep {
  batten_context *ctx;
  atomic_size_t owners;
  const frep_class *cls;
  unsigned n, depth;
  size_t nodes;        /* of the tree, shared ones as often as they stand in it */
  unsigned below;      /* levels of carriers and solids below: 0 = none */
  bool distance;       /* batten_frep_is_distance: |f| is at most the distance to f = 0, and |grad f| at most 1 */
  bool normal;         /* a distance, or one to first order: needs no normalizing. frep_make sets it to distance */
  size_t number_count; /* as in parts */
  double *numbers;
  size_t start_count;
  size_t *starts;
  size_t child_count;
  batten_frep *children[2]; /* owned */
  batten_carrier *carrier;  /* owned */
  batten_solid *solid;      /* owned */
  void *state;              /* what a class prepares from the numbers: a polygon_set, a path, splines */
};

/* A node with copies of the numbers and starts, and owners of the rest added; depth is set. TOO_LARGE: deeper than
 * FREP_DEPTH, or more than FREP_NODES. state goes to the node (on failure it stays the caller's). parts: all but n
 * may be empty; kind is the class's. */
batten_status frep_make(batten_context *ctx, const frep_class *cls, const batten_frep_parts *parts, bool distance,
                        void *state, batten_frep **out);
batten_status frep_evaluate_block(const batten_frep *a, batten_context *ctx, size_t count, const double *points,
                                  double *values, double *gradients);
batten_status frep_bounds_block(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                double *ranges);
batten_status frep_slopes_block(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                                double *slopes);
/* Ranges and slopes [count][2]. */
batten_status frep_both_block(const batten_frep *a, batten_context *ctx, size_t count, const double *boxes,
                              double *ranges, double *slopes);
/* A length and a place to begin with where the structure tells no box: the hull of the boxes that nodes below tell,
 * maps of space left aside. false = no node tells one. */
bool frep_hint_box(const batten_frep *a, double *lower, double *upper);
/* The structural box of a child (class->box or false). */
bool frep_structural_box(const batten_frep *a, double *lower, double *upper);

/* batten_frep_box, some percent wider and sooner found. */
batten_status frep_rough_box(batten_context *ctx, const batten_frep *a, double *lower, double *upper);

/* Checks that every constructor does: texts "a: NULL; give a node", "center[1]: nan; give a finite number", "radius:
 * -1; give a positive finite number", "axis: its length is 0; give a direction". */
batten_status frep_check_out(batten_context *ctx, const void *out);
batten_status frep_check_node(batten_context *ctx, const char *name, const batten_frep *a, unsigned n); /* n 0: any */
batten_status frep_check_numbers(batten_context *ctx, const char *name, size_t count, const double *values);
batten_status frep_check_positive(batten_context *ctx, const char *name, double value);
batten_status frep_check_direction(batten_context *ctx, const char *name, size_t n, const double *v, double *unit);

/* What a class's create begins with where a kind has a fixed count of numbers and children. */
batten_status frep_check_parts(batten_context *ctx, const batten_frep_parts *parts, size_t number_count,
                               size_t child_count);

/* The classes, by file; frep_parts.c lists them. */
extern const frep_class frep_class_carrier, frep_class_solid, frep_class_ball, frep_class_cone, frep_class_polygon,
    frep_class_gyroid;
extern const frep_class frep_class_union, frep_class_intersection, frep_class_difference, frep_class_negation,
    frep_class_blend_union, frep_class_blend_intersection, frep_class_blend_difference, frep_class_morph;
extern const frep_class frep_class_normalize, frep_class_offset, frep_class_shell, frep_class_noise;
extern const frep_class frep_class_extrude, frep_class_revolve, frep_class_project, frep_class_section;
extern const frep_class frep_class_sweep;
extern const frep_class frep_class_affine, frep_class_twist, frep_class_bend, frep_class_taper;
extern const frep_class frep_class_deform;

#endif
